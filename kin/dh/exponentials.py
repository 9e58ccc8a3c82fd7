"""Arms as products of exponentials, ``T(q) = exp([S₁] q₁) … exp([Sₙ] qₙ) M`` (Lynch and Park, Modern Robotics).

A screw ``S = (ω, v)`` is the twist of the whole space, seen from the world frame, when its joint moves at 1 rad/s
or 1 m/s and the others stand still at zero: ω is the direction of the axis and v the velocity of the point at the
world's origin, ``v = p × ω`` for a point p of the axis. A prismatic joint has ω = 0, and v is its direction.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice, pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from kin.axes import frame_of, inverse, perpendicular_to
from kin.dh.tables import convert_dh, table_of_chain
from kin.errors import InputError
from kin.fk import fk, jacobian
from kin.named import robot_of
from kin.robot import DEFAULT_LIMITS, Convention, Joint, Kind, Robot
from kin.transforms import Array, as_transform, finite_array

_ROUNDED = 1e-6  # deviation from a unit vector, or pitch in metres, that is taken as rounding

Value = TypeVar("Value")


class Screws(NamedTuple):
    """An arm as a product of exponentials.

    Attributes:
        S: ``(6, n)`` screws in the world frame, one column (ω, v) per moving joint.
        M: ``(4, 4)`` pose of the tool in the world frame where all joints of the formula are zero.
    """

    S: Array
    M: Array

    @property
    def B(self) -> Array:
        """The same screws ``(6, n)``, seen from the tool at zero: ``T(q) = M exp([B₁] q₁) … exp([Bₙ] qₙ)``."""
        R, p = self.M[:3, :3], self.M[:3, 3]
        omega, v = self.S[:3], self.S[3:]
        moved = v - np.cross(p, omega, axisb=0, axisc=0)  # the velocity of the tool point
        return np.concatenate([R.T @ omega, R.T @ moved]) + 0.0

    def pose(self, q: ArrayLike) -> Array:
        """The product of exponentials.

        Args:
            q: ``(..., n)`` values of its joints, radians (metres).

        Returns:
            Poses ``(..., 4, 4)`` of the tool in the world frame.

        Raises:
            InputError: another number of joint values, or values that are not finite.

        Examples:
            >>> import kin, numpy as np
            >>> arm = kin.get_robot("ur5")
            >>> np.allclose(kin.dh.screws(arm).pose(arm.q_home), kin.fk(arm, arm.q_home))
            True
        """
        values = finite_array("q", q, (self.S.shape[1],))
        T = np.broadcast_to(np.eye(4), (*values.shape[:-1], 4, 4))
        for i, S in enumerate(self.S.T):
            T = T @ exp_screw(S, values[..., i])
        return T @ self.M


def exp_screw(S: ArrayLike, value: ArrayLike) -> Array:
    """The motion ``exp([S] value)`` ``(..., 4, 4)`` along one screw (ω, v) ``(6,)``, for values ``(...)``.

    With |ω| = 1 a rotation by that angle about the axis; with a pitch h = ω·v, also a slide by h times the angle.
    With ω = 0 a translation by v times the value.

    Args:
        S: ``(6,)`` the screw (ω, v): rotation without unit first, then metres.
        value: ``(...)`` of the joint, radians (metres where ω = 0).

    Returns:
        Transforms ``(..., 4, 4)``.

    Raises:
        InputError: numbers that are not finite, or another shape.

    Examples:
        >>> import kin
        >>> kin.dh.exp_screw([0, 0, 0, 0, 0, 1], 0.2)[:3, 3]
        array([0. , 0. , 0.2])
    """
    screw, angle = finite_array("S", S, (6,)), _values(value)
    if screw.ndim != 1:
        raise InputError("S", f"shape {screw.shape}", "one screw of six numbers (ω, v)")
    omega, v = screw[:3], screw[3:]
    speed = float(np.linalg.norm(omega))
    out = np.zeros((*angle.shape, 4, 4))
    out[..., 3, 3] = 1.0
    if speed == 0.0:
        out[..., :3, :3] = np.eye(3)
        out[..., :3, 3] = angle[..., None] * v
        return out
    W = np.cross(np.eye(3), omega / speed)  # [ω]: W a = ω × a
    turn = (angle * speed)[..., None, None]
    sine, cosine = np.sin(turn), 2.0 * np.sin(0.5 * turn) ** 2  # 1 − cos, whose digits would cancel
    out[..., :3, :3] = np.eye(3) + sine * W + cosine * (W @ W)
    out[..., :3, 3] = (turn * np.eye(3) + cosine * W + (turn - sine) * (W @ W)) @ (v / speed)
    return out


def screws(robot: Robot | str, q: ArrayLike | None = None) -> Screws:
    """The arm as a product of exponentials.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` the configuration at which the joints of the formula are zero, radians (metres); by default
            q = 0, so that they are the joints of the arm.

    Returns:
        The screws in space and body form, and the pose of the tool at zero.

    Raises:
        InputError: q is not one configuration, or rows follow joints.

    Examples:
        >>> import kin
        >>> kin.dh.screws("ur5").S.shape
        (6, 6)
    """
    robot = robot_of(robot)
    if robot.coupled:
        expected = "no rows that follow joints, as of `Robot.free`: screws(robot.free).pose(robot.expand(q))"
        raise InputError("robot", robot.id, expected)
    zero = robot.check_q(np.zeros(robot.n) if q is None else q)
    if zero.ndim != 1:
        raise InputError("q", f"shape {zero.shape}", f"one configuration of {robot.n} values")
    J, M = jacobian(robot, zero), fk(robot, zero)
    omega = np.where(robot.revolute, J[3:], 0.0)
    return Screws(np.concatenate([omega, J[:3] + np.cross(M[:3, 3], omega, axisb=0, axisc=0)]) + 0.0, M)


def robot_from_screws(
    S: ArrayLike,
    M: ArrayLike,
    *,
    limits: Iterable[tuple[float, float] | None] | None = None,
    names: Iterable[str] | None = None,
    home: Iterable[float] | None = None,
    convention: Convention = "standard",
    robot_id: str = "arm",
    name: str = "Arm",
    source: str = "screws in Python",
) -> Robot:
    """An arm from its screws and its tool pose at zero, with the same joint values.

    Args:
        S: ``(6, n)`` one column (ω, v) per joint, in the world frame: |ω| = 1 and v in metres for a revolute
            joint; ω = 0 and |v| = 1 for a prismatic one.
        M: ``(4, 4)`` pose of the tool in the world frame at q = 0.
        limits: per joint (lower, upper), None for a revolute joint without limits. By default a revolute joint
            turns ±π and a prismatic one slides 0 to 1 m.
        names: of the joints.
        home: one value per joint, radians (metres); by default the middle of the limits.
        convention: of the DH table that the robot gets.
        robot_id, name, source: as in a robot file.

    Returns:
        The arm; its table may have more rows than it has joints.

    Raises:
        InputError: a column that is no unit screw, or one with a pitch; a malformed argument.

    Examples:
        >>> import kin
        >>> given = kin.dh.screws("ur5")
        >>> arm = kin.dh.robot_from_screws(given.S, given.M)
        >>> bool(abs(kin.fk(arm, [0.1] * 6) - kin.fk("ur5", [0.1] * 6)).max() < 1e-12)
        True
    """
    columns = finite_array("S", S, (6, None))
    n = columns.shape[-1]
    if columns.ndim != 2 or n == 0:
        raise InputError("S", f"shape {columns.shape}", "one column of six numbers (ω, v) per joint")
    tool = as_transform(M, "M")
    ranges = _one_per_joint("limits", limits, n)
    labels = _one_per_joint("names", names, n)
    joints, frames = [], []
    for i, column in enumerate(columns.T):
        kind, frame = _axis(column, f"S[:, {i}]")
        bounds = DEFAULT_LIMITS[kind] if ranges is None else ranges[i]
        joints.append(Joint(f"joint {i + 1}" if labels is None else labels[i], kind=kind, limits=bounds))
        frames.append(frame)
    chain = [np.eye(4), *frames, tool]
    table = table_of_chain(joints, [inverse(a) @ b for a, b in pairwise(chain)])
    robot = Robot.from_dh(
        table.rows, robot_id=robot_id, name=name, source=source, home=home, base=table.base, tool=table.tool
    )
    return convert_dh(robot, convention)


def _values(value: ArrayLike) -> Array:
    """Finite numbers of any shape, none included."""
    several: list[Any] = [value]
    return np.asarray(finite_array("value", several, (None,))[0])


def _one_per_joint(field: str, values: Iterable[Value] | None, n: int) -> list[Value] | None:
    """An argument with one value per joint as a list, None if it is not given."""
    if values is None:
        return None
    several = isinstance(values, Iterable) and not isinstance(values, str | bytes)
    listed = list(islice(values, n + 1)) if several else []
    if len(listed) != n:
        raise InputError(field, values, f"{n} values, one per joint")
    return listed


def _axis(column: Array, field: str) -> tuple[Kind, Array]:
    """The kind of a joint, and a frame ``(4, 4)`` in the world frame whose z axis is the joint's."""
    omega, v = column[:3], column[3:]
    size, speed = float(np.linalg.norm(omega)), float(np.linalg.norm(v))
    slides = size <= _ROUNDED and abs(speed - 1.0) <= _ROUNDED
    if not slides and abs(size - 1.0) > _ROUNDED:
        raise InputError(field, column.tolist(), "|ω| = 1 (revolute), or ω = 0 and |v| = 1 (prismatic)")
    if slides:
        z = v / speed
        return "prismatic", frame_of(perpendicular_to(z), z, np.zeros(3))
    z = omega / size
    if abs(float(z @ v)) > _ROUNDED * max(1.0, speed):
        raise InputError(field, column.tolist(), "v perpendicular to ω: a joint has no pitch")
    return "revolute", frame_of(perpendicular_to(z), z, np.cross(z, v / size))
