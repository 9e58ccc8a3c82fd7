"""Targets in JSON, as REST requests and lines of JSON have them: which fields there are, and how each is read.

A target is a `position` with one orientation or none, a `matrix`, or a `text` as it stands on a maker's pendant.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from kin.differential.task import Task
from kin.errors import InputError
from kin.frames import pose_from_xyz_rpy
from kin.poses.quaternions import checked_wxyz, rotation_from_wxyz
from kin.poses.reading import read_target
from kin.poses.rotations import VECTOR
from kin.transforms import Array, finite_array
from kin.typed import ReadError

ORIENTATIONS: Final = ("wxyz", "xyzw", "rpy", "rotvec")
FIELDS: Final = ("position", *ORIENTATIONS, "approach", "matrix", "text", "form", "frame")
_BOTTOM = [0.0, 0.0, 0.0, 1.0]


def orientation(name: str, values: ArrayLike) -> Array:
    """The rotation ``(3, 3)`` of one of `ORIENTATIONS` in radians; an `InputError` names the orientation."""
    if name == "wxyz":
        return rotation_from_wxyz(values)
    if name == "xyzw":
        checked_wxyz(values, "xyzw")
        return rotation_from_wxyz(np.roll(np.asarray(values, dtype=np.float64), 1))
    given = finite_array(name, values, (3,))
    if given.ndim != 1:
        raise InputError(name, f"shape {given.shape}", "three numbers in radians")
    return pose_from_xyz_rpy(np.zeros(3), given)[:3, :3] if name == "rpy" else VECTOR.matrix(given.tolist())


def whole_matrix(matrix: Any) -> Any:
    """The rows of a 4×4 matrix, of which the last may be left out; anything else as it is."""
    return [*matrix, _BOTTOM] if isinstance(matrix, list) and len(matrix) == 3 else matrix


def text_target(text: object, form: str | None, field: str, maker: str = "") -> tuple[Task, Array]:
    """The task that a text implies, and its pose ``(4, 4)``; an `InputError` names the field.

    Args:
        form: of `kin.pose_to_text`; None: what the text shows.
        maker: of the arm, which decides between forms with the same letters.
    """
    try:
        T, task = read_target(text, form, maker=maker)
    except InputError as error:
        raise error.within(field) from None
    except ReadError as error:
        raise InputError(
            f"{field}.text", text, f"a target that can be read in one way. {error.sentence}"
        ) from None
    return task, T
