"""Quaternions that callers give: one whose length is far from 1 has a wrong number, and is refused.

A quaternion with a few decimals has a length near 1 and is normalised. Further away one of its numbers is missing,
mistyped or of something else, and the rotation that normalising would make of it was meant by nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kin import transforms
from kin.errors import InputError
from kin.transforms import Array, finite_array

UNIT = 0.1  # by how much a quaternion's length may differ from 1: one decimal makes 0.1


def check_length(wxyz: Sequence[float], field: str = "wxyz") -> None:
    """Raises `InputError` naming the field if the length of four finite numbers is far from 1."""
    length = math.hypot(*wxyz)
    if not abs(length - 1.0) <= UNIT:
        what = f"this one has the length {length:.3g}" if length else "this one is zero; 1, 0, 0, 0 is no rotation"
        raise InputError(field, list(wxyz), f"a quaternion of length 1: {what}")


def checked_wxyz(wxyz: ArrayLike, field: str = "wxyz") -> Array:
    """A quaternion ``(4,)`` as it was given; raises `InputError` naming the field unless its length is about 1."""
    given = finite_array(field, wxyz, (4,))
    if given.ndim != 1:
        raise InputError(field, f"shape {given.shape}", "four numbers w, x, y, z")
    check_length(given.tolist(), field)
    return given


def far_from_unit(wxyz: Array) -> NDArray[np.bool_]:
    """Which quaternions ``(..., 4)`` `check_length` refuses, as booleans ``(...,)``."""
    far: NDArray[np.bool_] = ~(np.abs(np.linalg.norm(wxyz, axis=-1) - 1.0) <= UNIT)
    return far


def rotation_from_wxyz(wxyz: ArrayLike) -> Array:
    """Rotation matrix ``(3, 3)`` of a quaternion ``(4,)``, which is normalised.

    Args:
        wxyz: scalar first, of length 1 to within 0.1.

    Returns:
        The rotation matrix.

    Raises:
        InputError: its length is far from 1, or it is not four finite numbers.

    Examples:
        >>> import kin
        >>> kin.rotation_from_wxyz([1.0, 0.0, 0.0, 0.0])
        array([[1., 0., 0.],
               [0., 1., 0.],
               [0., 0., 1.]])
    """
    return transforms.rotation_from_wxyz(checked_wxyz(wxyz))


def pose_from_position_wxyz(position: ArrayLike, wxyz: ArrayLike | None = None) -> Array:
    """Transform ``(4, 4)`` from a position ``(3,)`` in metres and a quaternion ``(4,)`` (scalar first).

    Args:
        position: ``(3,)`` in metres.
        wxyz: ``(4,)`` quaternion, scalar first, of length 1 to within 0.1; it is normalised. None: no rotation.

    Returns:
        The transform.

    Raises:
        InputError: numbers that are not finite, another shape, or a quaternion whose length is far from 1.

    Examples:
        >>> import kin
        >>> kin.pose_from_position_wxyz([0.4, 0.0, 0.2], [0.0, 1.0, 0.0, 0.0])[:3, 2]  # upside down
        array([ 0.,  0., -1.])
    """
    T = transforms.pose_from_position_wxyz(position)
    if wxyz is not None:
        T[:3, :3] = rotation_from_wxyz(wxyz)
    return T
