"""A typed rotation: three angles, a quaternion, or a matrix."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.rotations.conventions import Convention
from kin.poses import read_pose
from kin.transforms import Array
from kin.typed import EntryError, ReadError, elements, interpret, read_element
from kin.units import Units

LONGEST = 400  # characters


def read_rotation(text: str, convention: Convention, units: Units) -> Array:
    """The rotation ``(3, 3)``: 3 angles in the convention and the unit on screen, 4 numbers w x y z, or 9.

    Raises:
        EntryError: with what is valid.
    """

    valid = (
        f"Valid: 3 angles in {units.angles.name}, a quaternion w x y z, or the 9 numbers of a matrix, row by row."
    )

    def rotation(way: str) -> Array:
        words = elements(way)
        match len(words):
            case 3:
                a, b, c = (read_element(word, units.angles) for word in words)
                return convention.rotation((a, b, c))
            case 4:
                return read_pose("quaternion", "; ".join(words), units, np.eye(4))[0][:3, :3]
            case 9:
                rows = "; ".join(word for k in (0, 3, 6) for word in (*words[k : k + 3], "0"))
                return read_pose("pose", rows, units, np.eye(4))[0][:3, :3]
        raise EntryError("The rotation needs another count of numbers", f"Found {len(words)}. {valid}")

    try:
        return interpret(text, rotation, np.allclose)
    except EntryError:
        raise
    except ReadError as error:
        raise EntryError("The rotation was not read", f"{error.sentence} {valid}", error.readings) from None
