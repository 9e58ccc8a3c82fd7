"""Named frames in which poses may be stated: world, base, tool, and workpieces that the user names.

Poses of this library are in the world frame, in which an arm's ``base`` is stated. Without such a transform it is
the base frame, that of the first DH row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.fk import fk
from kin.named import robot_of
from kin.robot import Matrix, Robot, exact_cos_sin
from kin.transforms import Array, as_transform, finite_array

WORLD, BASE, TOOL = "world", "base", "tool"
FRAMES = (WORLD, BASE, TOOL)


def matrix_of(xyz: Sequence[float], rpy: Sequence[float]) -> Matrix:
    """The transform ``Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll)``, metres and radians."""
    (cr, sr), (cp, sp), (cy, sy) = map(exact_cos_sin, rpy)
    x, y, z = xyz
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y),
        (-sp, cp * sr, cp * cr, z),
        (0.0, 0.0, 0.0, 1.0),
    )


def pose_from_xyz_rpy(xyz: ArrayLike, rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Transform ``(4, 4)`` with a position in metres and the rotation Rz(yaw) Ry(pitch) Rx(roll) in radians.

    Args:
        xyz: ``(3,)`` position in metres.
        rpy: ``(3,)`` roll, pitch and yaw in radians, about the fixed axes x, y and z in this order.

    Returns:
        The transform.

    Raises:
        InputError: numbers that are not finite, or another shape.

    Examples:
        >>> import kin, math
        >>> kin.pose_from_xyz_rpy([0.4, 0.0, 0.2], [0.0, 0.0, math.pi / 2])[:3, 0].round(9)
        array([ 0.,  1., -0.])
    """
    parts = [finite_array(name, value, (3,)) for name, value in (("xyz", xyz), ("rpy", rpy))]
    for name, part in zip(("xyz", "rpy"), parts, strict=True):
        if part.ndim != 1:
            raise InputError(name, f"shape {part.shape}", "three numbers")
    return np.array(matrix_of(*(part.tolist() for part in parts)))


def frame_pose(
    robot: Robot | str, frame: str, workpieces: Mapping[str, ArrayLike] | None = None, q: ArrayLike | None = None
) -> Array:
    """Pose of a named frame in the world frame, T_world_frame ``(4, 4)``.

    ``frame_pose(robot, "table", {"table": T}) @ T_table_target`` is the target as `solve_ik` takes it.

    Args:
        robot: the arm, or the id of a built-in one.
        frame: ``"world"``, ``"base"`` (before the first DH row), ``"tool"`` (where the tool is at `q`), or the
            name of a workpiece frame.
        workpieces: poses ``(4, 4)`` of workpiece frames in the world frame, by name.
        q: the present configuration ``(n,)``, radians (metres); needed for the frame of the tool.

    Returns:
        The pose of the frame.

    Raises:
        InputError: an unknown frame, the frame of the tool without a configuration, or a pose that is none.

    Examples:
        >>> import kin
        >>> table = kin.pose_from_xyz_rpy([0.5, 0.0, 0.1])
        >>> kin.frame_pose("ur5", "table", {"table": table})[:3, 3]
        array([0.5, 0. , 0.1])
    """
    robot = robot_of(robot)
    if workpieces is not None and not isinstance(workpieces, Mapping):
        raise InputError("workpieces", workpieces, "poses (4, 4) by the names of their frames")
    known = dict(workpieces or {})
    for name in known:
        if not isinstance(name, str) or not name.strip() or name in FRAMES:
            raise InputError("workpieces", name, "names that are not empty, and not " + ", ".join(FRAMES))
    if frame == WORLD:
        return np.eye(4)
    if frame == BASE:
        return robot.T_world_base.copy()
    if frame == TOOL:
        if q is None:
            raise InputError("frame", frame, "a configuration as well, which tells where the tool is")
        present = robot.check_q(q)
        if present.ndim != 1:
            raise InputError("q", f"shape {present.shape}", f"one configuration of {robot.n} values")
        return fk(robot, present)
    if not isinstance(frame, str) or frame not in known:
        raise InputError("frame", frame, "one of " + ", ".join([*FRAMES, *known]))
    return as_transform(known[frame], f"workpieces.{frame}")
