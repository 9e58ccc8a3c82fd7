"""Poses as the numbers that they are made of, their logarithm, and poses between two poses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kin.dh.exponentials import exp_screw
from kin.errors import InputError
from kin.poses.rotations import roll_pitch_yaw
from kin.transforms import Array, as_transform, finite_array, rotation_vector, wxyz_from_rotation

_SMALL = 1e-4  # rad: below this, the series of a coefficient is exact to the last digit


def xyz_rpy_from_pose(T: ArrayLike) -> tuple[Array, Array]:
    """Position and roll, pitch, yaw of a pose ``(4, 4)``: the inverse of `kin.pose_from_xyz_rpy`.

    Args:
        T: the pose ``(4, 4)``, metres.

    Returns:
        ``(3,)`` position in metres, and ``(3,)`` angles in radians about the fixed axes x, y and z in this order.
        The pitch is within ±π/2; where it is ±π/2, the roll is 0.

    Raises:
        InputError: no rigid transform.

    Examples:
        >>> import kin
        >>> xyz, rpy = kin.xyz_rpy_from_pose(kin.pose_from_xyz_rpy([0.4, 0.0, 0.2], [0.1, 0.2, 0.3]))
        >>> xyz.tolist(), rpy.round(9).tolist()
        ([0.4, 0.0, 0.2], [0.1, 0.2, 0.3])
    """
    pose = as_transform(T, "T")
    return pose[:3, 3].copy(), np.array(roll_pitch_yaw(pose[:3, :3]))


def position_wxyz_from_pose(T: ArrayLike) -> tuple[Array, Array]:
    """Position and quaternion of a pose ``(4, 4)``: the inverse of `kin.pose_from_position_wxyz`.

    Args:
        T: the pose ``(4, 4)``, metres.

    Returns:
        ``(3,)`` position in metres, and the unit quaternion ``(4,)``; its scalar comes first and is not negative.

    Raises:
        InputError: no rigid transform.

    Examples:
        >>> import kin
        >>> T = kin.pose_from_position_wxyz([0.4, 0.0, 0.2], [0, 1, 0, 0])
        >>> position, wxyz = kin.position_wxyz_from_pose(T)
        >>> position.tolist(), wxyz.tolist()
        ([0.4, 0.0, 0.2], [0.0, 1.0, 0.0, 0.0])
    """
    pose = as_transform(T, "T")
    return pose[:3, 3].copy(), wxyz_from_rotation(pose[:3, :3])


def pose_log(T: ArrayLike) -> Array:
    """The logarithm of a pose ``(4, 4)``: the constant twist ``(6,)`` that leads there from the identity in 1 s.

    Linear first, as the rows of `kin.jacobian`: ``pose_log(inv(T_a) @ T_b)`` is the twist from a to b with the
    axes of a, as ``frame="tool"`` has them.

    Args:
        T: the pose ``(4, 4)``, metres.

    Returns:
        ``(v, ω)`` in metres and radians, the rotation within ±π.

    Raises:
        InputError: no rigid transform.

    Examples:
        >>> import kin, math
        >>> kin.pose_log(kin.pose_from_xyz_rpy([0.0, 0.2, 0.0], [0.0, 0.0, math.pi])).round(6).tolist()
        [0.314159, 0.0, 0.0, 0.0, 0.0, 3.141593]
    """
    pose = as_transform(T, "T")
    omega, p = rotation_vector(pose[:3, :3]), pose[:3, 3]
    half = 0.5 * float(np.linalg.norm(omega))
    share = 1.0 / 12.0 if half < _SMALL else (1.0 - half / math.tan(half)) / (4.0 * half * half)
    across = np.cross(omega, p)
    return np.concatenate([p - 0.5 * across + share * np.cross(omega, across), omega])


def pose_exp(twist: ArrayLike) -> Array:
    """The pose ``(4, 4)`` to which a constant twist leads from the identity in 1 s: the inverse of `kin.pose_log`.

    Args:
        twist: ``(6,)`` (v, ω), metres and radians.

    Returns:
        The pose.

    Raises:
        InputError: numbers that are not finite, or another shape.

    Examples:
        >>> import kin, math
        >>> kin.pose_exp([0.0, 0.0, 0.1, 0.0, 0.0, math.pi])[:3, 3].round(9)
        array([0. , 0. , 0.1])
    """
    given = finite_array("twist", twist, (6,))
    if given.ndim != 1:
        raise InputError("twist", f"shape {given.shape}", "six numbers (v, ω)")
    return exp_screw(np.concatenate([given[3:], given[:3]]), 1.0)


def interpolate_poses(a: ArrayLike, b: ArrayLike, share: ArrayLike) -> Array:
    """Poses ``(..., 4, 4)`` between two: the tool point on a line, the rotation about one axis, both evenly.

    Args:
        a, b: poses ``(4, 4)``, metres.
        share: ``(...)`` of the way, a scalar without unit: 0 at a, 1 at b; beyond them the motion goes on.

    Returns:
        The poses, one for each share.

    Raises:
        InputError: no rigid transform, or a share that is not finite.

    Examples:
        >>> import kin
        >>> a, b = kin.fk("ur5", [0.0] * 6), kin.fk("ur5", [0.1] * 6)
        >>> kin.interpolate_poses(a, b, [0.0, 0.25, 0.5, 1.0]).shape
        (4, 4, 4)
    """
    start, end = as_transform(a, "a"), as_transform(b, "b")
    several: Any = [share] if isinstance(share, int | float | np.number) else share
    shares = finite_array("share", several, (None,))
    omega = rotation_vector(start[:3, :3].T @ end[:3, :3])
    angle = float(np.linalg.norm(omega))
    turn = exp_screw([*(omega / angle if angle else omega), 0.0, 0.0, 0.0], shares * angle)[..., :3, :3]
    out = np.zeros((*shares.shape, 4, 4))
    out[..., :3, :3] = start[:3, :3] @ turn
    out[..., :3, 3] = start[:3, 3] + shares[..., None] * (end[:3, 3] - start[:3, 3])
    out[..., 3, 3] = 1.0
    return out if several is share else out[0]
