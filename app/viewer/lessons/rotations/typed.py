"""A typed rotation: three angles, a quaternion, or a matrix."""

from __future__ import annotations

import re

import numpy as np

from app.exercises.typed import EntryError, read_number
from app.viewer.lessons.rotations.conventions import Convention
from app.viewer.panel.entry import read_pose
from kin.transforms import Array
from kin.units import Units

LONGEST = 400  # characters


def read_rotation(text: str, convention: Convention, units: Units) -> Array:
    """The rotation ``(3, 3)``: 3 angles in the convention and the unit on screen, 4 numbers w x y z, or 9.

    Raises:
        EntryError: with what is valid.
    """
    words = [word for word in re.split(r"[\s,;|\[\](){}]+", text[:LONGEST].replace("−", "-")) if word]
    start = np.eye(4)
    match len(words):
        case 3:
            a, b, c = (read_number(word, units.angles) for word in words)
            return convention.rotation((a, b, c))
        case 4:
            return read_pose("quaternion", " ".join(words), units, start)[0][:3, :3]
        case 9:
            lines = [" ".join([*words[k : k + 3], "0"]) for k in (0, 3, 6)]
            return read_pose("pose", " ".join(lines), units, start)[0][:3, :3]
        case found:
            detail = (
                f"Found {found}. Valid: 3 angles in {units.angles.name}, a quaternion w x y z, or the "
                "9 numbers of a matrix, row by row."
            )
            raise EntryError("The rotation needs another count of numbers", detail)
