"""DH tables of a given chain: the same arm in the other convention, and rows for any joint axes.

Rows of both conventions are screws along z and along x in turn, ``Z1 X1 Z2 X2 …`` with ``Z = Rz(θ) Tz(d)`` and
``X = Tx(a) Rx(α)``: a standard row is ``Z X``, a modified row ``X Z``. To convert is to shift by half a row. What
is left over at the end goes into the tool or the base.

A chain of joints is a product ``C0 J1 C1 J2 … Jn Cn`` in which each J is a screw along the z axis of its frame.
Each constant transform between two joints is written as ``Z X Z'`` along the common normal of the two axes. Z' and
the next Z commute with the joint between them, so they add up to one row. If the axes are almost parallel the
common normal is far away or badly defined, and rounding is multiplied by the square of the inverse angle: at
1e-6 rad 0.2 mm are lost. Such a transform is written as two rows instead: one moves, and a fixed one tilts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kin.axes import inverse, screw_x
from kin.errors import InputError
from kin.fk import fk
from kin.named import robot_of
from kin.robot import CONVENTIONS, IDENTITY, Capsule, Convention, Joint, Matrix, NominalTable, Robot
from kin.transforms import Array

ALMOST = 0.05  # sine of an angle below which two axes count as almost parallel
ROUNDING = 4e-15  # radians, metres: an angle or a length this small comes from rounding
PARALLEL = 2e-14  # radians: a tilt this small is dropped
SAMPLES = 256


def convert_dh(robot: Robot | str, convention: Convention) -> Robot:
    """The same arm as a table in this convention: the same joints, limits and tool poses.

    Args:
        robot: the arm, or the id of a built-in one.
        convention: ``"standard"`` or ``"modified"`` (Craig).

    Returns:
        The arm with its other table.

    Raises:
        InputError: an unknown convention.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("puma560")
        >>> craig = kin.dh.convert_dh(arm, "modified")
        >>> bool(abs(kin.fk(craig, arm.q_home) - kin.fk(arm, arm.q_home)).max() < 1e-12)
        True
    """
    if convention not in CONVENTIONS:
        raise InputError("convention", convention, "one of " + ", ".join(CONVENTIONS))
    robot = robot_of(robot)
    if robot.convention == convention:
        return robot
    offsets = [(row.a, row.alpha) for row in robot.rows]
    if convention == "modified":
        shifted = [(0.0, 0.0), *offsets[:-1]]
        tool = _product(screw_x(*offsets[-1]), robot.tool) if any(offsets[-1]) else robot.tool
        base = robot.base
    else:
        shifted = [*offsets[1:], (0.0, 0.0)]
        base = _product(robot.base, screw_x(*offsets[0])) if any(offsets[0]) else robot.base
        tool = robot.tool
    moved = tuple(_in_shifted_frame(each, offsets, convention) for each in robot.capsules)
    rows = tuple(replace(row, a=a, alpha=alpha) for row, (a, alpha) in zip(robot.rows, shifted, strict=True))
    nominal = robot.nominal_arm
    if nominal is not None:
        nominal = convert_dh(nominal, convention)
    table = None if nominal is None else NominalTable(nominal.rows, nominal.tool)
    return replace(robot, convention=convention, rows=rows, base=base, tool=tool, capsules=moved, nominal=table)


def _in_shifted_frame(capsule: Capsule, offsets: list[tuple[float, float]], to: Convention) -> Capsule:
    """A capsule in the frame that its row has in the other convention: before or behind the next Tx(a) Rx(α)."""
    if to == "modified":
        T = np.array(screw_x(*offsets[capsule.row])) if capsule.row >= 0 else np.eye(4)
    else:
        shift = [*offsets, (0.0, 0.0)][capsule.row + 1]
        T = inverse(np.array(screw_x(*shift)))
    start, end = (tuple((T[:3, :3] @ p + T[:3, 3]).tolist()) for p in (capsule.start, capsule.end))
    return replace(capsule, start=start, end=end)


def largest_difference(one: Robot, other: Robot, samples: int = SAMPLES) -> float:
    """Largest difference of any entry of the tool poses of two arms, at the same random configurations."""
    q = one.random_q(np.random.default_rng(0), samples)
    return float(np.abs(fk(one, q) - fk(other, q)).max())


class Table(NamedTuple):
    """A standard DH table with its two constant transforms."""

    base: Matrix
    rows: tuple[Joint, ...]
    tool: Matrix


def table_of_chain(joints: Sequence[Joint], transforms: Sequence[Array]) -> Table:
    """The standard table of a chain ``C0 J1 C1 J2 … Jn Cn``.

    Args:
        joints: names, kinds and limits; their DH numbers are ignored.
        transforms: the n + 1 constant transforms ``(4, 4)``; each joint moves along z of the frame before it.
    """
    first, last = transforms[0], transforms[-1]
    base = nested(first)
    theta = d = 0.0
    if _is_parallel(first) and first[2, 2] > 0.0 and math.hypot(first[0, 3], first[1, 3]) < ROUNDING:
        base, theta, d = IDENTITY, math.atan2(first[1, 0], first[0, 0]), float(first[2, 3])
    rows: list[Joint] = []
    for joint, C in zip(joints, transforms[1:-1], strict=False):
        link = _link(C, theta)
        rows.append(_row(joint, theta + link.theta, d + link.d, link.a, 0.0 if link.tilts else link.alpha))
        if link.tilts:
            tilt = Joint(f"{joint.name} tilt", kind="fixed")
            rows.append(_row(tilt, link.turn, 0.0, 0.0, link.alpha))
        theta, d = link.next_theta, link.next_d
    for flip in (False, True):
        link = _link(last, theta, ends=True, flip=flip)
        if not link.tilts and abs(_wrapped(link.next_theta)) < ROUNDING and abs(link.next_d) < ROUNDING:
            rows.append(_row(joints[-1], theta + link.theta, d + link.d, link.a, link.alpha))
            return Table(base, tuple(rows), IDENTITY)
    rows.append(_row(joints[-1], theta, d, 0.0, 0.0))
    return Table(base, tuple(rows), nested(last))


class _Link(NamedTuple):
    """A constant transform as ``Rz(theta) Tz(d) Tx(a) Rz(turn) Rx(alpha) Rz(next_theta) Tz(next_d)``."""

    theta: float
    d: float
    a: float
    turn: float
    alpha: float
    next_theta: float
    next_d: float

    @property
    def tilts(self) -> bool:
        """Whether the tilt needs a row of its own."""
        return self.turn != 0.0


def _link(C: Array, before: float, *, ends: bool = False, flip: bool = False) -> _Link:
    """The factors of a transform; `before` is the angle that `theta` is added to.

    The common normal has two directions. The one that keeps that sum within ±90° is chosen; the other with `flip`.
    With `ends` the last angle is zero where it is free.
    """
    R, p = C[:3, :3], C[:3, 3]
    sine = math.hypot(R[0, 2], R[1, 2])
    alpha = math.atan2(sine, R[2, 2])
    tilt = math.atan2(R[0, 2], -R[1, 2])  # direction of z × z'
    if sine >= ALMOST:
        x, y = np.array([-R[1, 2], R[0, 2], 0.0]) / sine, np.array([-R[0, 2], -R[1, 2], 0.0]) / sine
        next_d = -float(p @ y) / sine
        d, a = float(p[2]) - next_d * float(R[2, 2]), float(p @ x)
        lifted = y * R[2, 2] + (0.0, 0.0, sine)
        next_theta = math.atan2(float(lifted @ R[:, 0]), float(x @ R[:, 0]))
        if _backwards(before + tilt) != flip:
            tilt, alpha, a, next_theta = tilt + math.pi, -alpha, -a, next_theta + math.pi
        return _Link(tilt, d, a, 0.0, alpha, next_theta, next_d)
    up = R[2, 2] > 0.0
    a, d = math.hypot(p[0], p[1]), float(p[2])
    # Sum (or difference, if antiparallel) of the two angles about z: defined well, while each alone is not.
    sense = 1.0 if up else -1.0
    whole = math.atan2(R[1, 0] - sense * R[0, 1], R[0, 0] + sense * R[1, 1])
    if sine < PARALLEL:
        alpha = 0.0 if up else math.pi
        tilt = math.atan2(p[1], p[0]) if a > ROUNDING else whole if ends else -before
    theta = math.atan2(p[1], p[0]) if a > ROUNDING else tilt
    if _backwards(before + theta) != flip:
        theta, a = theta + math.pi, -a
    if _backwards(tilt - theta):
        tilt, alpha = tilt + math.pi, -alpha
    turn = _wrapped(tilt - theta)
    if abs(a * turn) < ROUNDING:  # the tilt is about the common normal
        theta, turn = tilt, 0.0
    return _Link(theta, d, a if abs(a) > ROUNDING else 0.0, turn, alpha, sense * (whole - tilt), 0.0)


def _is_parallel(C: Array) -> bool:
    return math.hypot(C[0, 2], C[1, 2]) < PARALLEL


def _row(joint: Joint, theta: float, d: float, a: float, alpha: float) -> Joint:
    theta, alpha = tidy_angle(_wrapped(theta)), tidy_angle(_wrapped(alpha))
    return replace(joint, theta=theta, d=tidy_length(d), a=tidy_length(a), alpha=alpha)


def tidy_length(value: float) -> float:
    """A length without rounding errors: 0.333 instead of 0.33300000000000013."""
    return _tidy(value, 1.0)


def tidy_angle(value: float) -> float:
    """An angle without rounding errors: a round number of degrees or radians if it is one."""
    in_degrees = _tidy(value, math.pi / 180)
    return in_degrees if in_degrees != value else _tidy(value, 1.0)


def _tidy(value: float, unit: float) -> float:
    if abs(value) < ROUNDING:
        return 0.0
    tidy = float(f"{value / unit:.10g}") * unit
    return tidy if abs(tidy - value) < ROUNDING else value


def _wrapped(angle: float) -> float:
    """The angle in (−π, π]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped + math.pi < ROUNDING else wrapped


def _backwards(angle: float) -> bool:
    return abs(_wrapped(angle)) > 0.5 * math.pi + 1e-9


def _product(A: Array | Matrix, B: Array | Matrix) -> Matrix:
    return nested(np.asarray(A) @ np.asarray(B))


def nested(T: Array) -> Matrix:
    """A matrix as nested tuples, the form of `Robot.base`; -0.0 becomes 0.0."""
    return tuple(tuple(row) for row in (T + 0.0).tolist())
