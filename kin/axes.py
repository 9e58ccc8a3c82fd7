"""The joint axes of a robot as lines in space: the one place where a robot's table is read as geometry.

An axis is a line: the line a revolute joint turns about, or the direction a prismatic joint slides along (which
has no particular place). The same arm can be written as many tables of DH rows: in two conventions, with twists of
either sign, with fixed rows, with joints that count in either sense. Its axes are always the same lines.

**Relations.** Two numbers describe the relation of two lines: the angle and the shortest distance between them.
Lines are *parallel* at angle 0, *perpendicular* at 90°, and *intersect* at distance 0; parallel lines that
intersect are *one line*. Two consecutive joints are connected by one rigid link, so these relations belong to the
arm, not to a configuration. Three consecutive axes through one point form a *spherical group*, a wrist or a
shoulder: rotation about them leaves the point in place, which separates position from orientation (Pieper, The
kinematics of manipulators under computer control, Stanford 1968). Three parallel axes do the same for motion in a
plane.

**Links.** `links_of` connects each line to the next by their common normal, which describes every arm in the same
form, between a base and a tool transform. Which twists are 0° or 90° and which lengths vanish then decides whether
an arm belongs to a family with a closed form. `links_by_rows` gives the same form with the exact numbers of the
table, for tables that are already written in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kin.robot import Robot, exact_cos_sin
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_GOLDEN = 0.6180339887498949
# An axis this close (radians, shares of the arm's size) to a special position was meant to be there: the table was
# typed with three or four digits.
NEARLY = 2e-3


@dataclass(frozen=True, eq=False)
class Axis:
    """A joint's axis in the base frame, with every joint at 0.

    Attributes:
        joint: index of the moving joint.
        slides: whether the joint is prismatic; `point` is then arbitrary.
        point: a point of the axis ``(3,)``, metres.
        direction: unit vector ``(3,)`` in the positive direction of the joint.
    """

    joint: int
    slides: bool
    point: Array
    direction: Array


@dataclass(frozen=True, slots=True)
class Pair:
    """The relation of two consecutive axes.

    Attributes:
        joint: index of the first of the two joints.
        angle: between the lines, 0 to π/2 radians.
        distance: shortest distance between the lines in metres, NaN if one joint is prismatic.
        parallel, perpendicular, intersect: within the tolerances; one line is parallel and intersecting.
        almost: "parallel", "perpendicular" or "intersecting" if the axes miss that by so little that it must have
            been intended, "" otherwise.
    """

    joint: int
    angle: float
    distance: float
    parallel: bool
    perpendicular: bool
    intersect: bool
    almost: str = ""

    @property
    def one_line(self) -> bool:
        """Whether both joints turn about the same line."""
        return self.parallel and self.intersect


class Lines(NamedTuple):
    """The joint axes as lines, with every joint at 0, in the base frame.

    Attributes:
        z: directions ``(n, 3)``, unit vectors.
        points: a point of each ``(n, 3)``, metres.
        sign: ``(n,)`` −1.0 where the positive direction of the joint is opposite to z.
        T_base_tool: ``(4, 4)``.
    """

    z: Array
    points: Array
    sign: Array
    T_base_tool: Array


def lines_of(robot: Robot, as_counted: bool = False) -> Lines:
    """The joint axes of a robot, in whichever way its table is written.

    The direction of an axis that is antiparallel to the previous one is reversed, and so is that of the first axis
    if it points down in the robot's base: these joints have sign −1. With `as_counted` no direction is reversed.
    What follows a joint is where it is with that joint at 0.
    """
    T = robot.T_world_base.copy()
    z, points, sign = np.empty((robot.n, 3)), np.empty((robot.n, 3)), np.ones(robot.n)
    joint = 0
    for row in robot.rows:
        parts = [screw_z(row.theta, row.d), screw_x(row.a, row.alpha)]
        turning = 0 if robot.convention == "standard" else 1
        for k, part in enumerate(parts if turning == 0 else parts[::-1]):
            if k == turning and row.driven:
                z[joint], points[joint] = T[:3, 2], T[:3, 3]
                joint += 1
            T = T @ part
    up = robot.T_world_base[:3, 2]
    for i in range(0 if as_counted else robot.n):
        before = z[i - 1] if i else up
        if z[i] @ before < -TOLERANCES.geometry and (i == 0 or is_zero(*cross(before, z[i]))):
            z[i], sign[i] = -z[i], -1.0
    return Lines(z, points, sign, T @ robot.T_last_tool)


def joint_axes(robot: Robot) -> tuple[Axis, ...]:
    """Every joint's axis, in the positive direction of the joint."""
    lines, turns = lines_of(robot, as_counted=True), robot.revolute.tolist()
    return tuple(Axis(i, not turns[i], lines.points[i], lines.z[i]) for i in range(robot.n))


def generic_q(robot: Robot) -> Array:
    """A configuration ``(n,)`` inside the limits in general position: golden-section shares of each range."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
    share = np.modf(_GOLDEN * np.arange(1.0, robot.n + 1.0))[0]
    return np.asarray(lower + (0.15 + 0.7 * share) * (upper - lower))


def size(robot: Robot) -> float:
    """The arm's size in metres, to compare lengths with: the sum of all offsets, without prismatic travel."""
    total = sum(math.hypot(row.a, row.d) for row in robot.rows)
    return float(total + np.linalg.norm(robot.T_last_tool[:3, 3])) or 1.0


def pairs(robot: Robot) -> tuple[Pair, ...]:
    """The relation of each axis to the next one: n − 1 pairs."""
    return tuple(_pair(a, b, size(robot)) for a, b in pairwise(joint_axes(robot)))


def _pair(a: Axis, b: Axis, scale: float) -> Pair:
    normal = cross(a.direction, b.direction)
    sine, cosine = float(np.linalg.norm(normal)), abs(float(a.direction @ b.direction))
    angle = math.atan2(sine, cosine)
    parallel, perpendicular = sine < TOLERANCES.geometry, cosine < TOLERANCES.geometry
    between = b.point - a.point
    if a.slides or b.slides:
        distance = math.nan
    elif sine < NEARLY:  # rounding spoils the common normal of almost parallel lines: measure across them
        distance = float(np.linalg.norm(between - (between @ a.direction) * a.direction))
    else:
        distance = abs(float(between @ normal)) / sine
    meet = distance < TOLERANCES.geometry * scale
    almost = ""
    if not parallel and sine < NEARLY:
        almost = "parallel"
    elif not perpendicular and cosine < NEARLY:
        almost = "perpendicular"
    elif not meet and not parallel and distance < NEARLY * scale:
        almost = "intersecting"
    return Pair(a.joint, angle, distance, parallel, perpendicular, meet, almost)


def spherical_groups(robot: Robot) -> tuple[int, ...]:
    """First joint of each three consecutive axes that meet in one point, where no two neighbours are one line.

    Groups may share joints: four axes through one point are two groups.
    """
    axes, found = joint_axes(robot), []
    near = TOLERANCES.geometry * size(robot)
    for i, (first, second) in enumerate(pairwise(pairs(robot))):
        if not (first.intersect and second.intersect) or first.parallel or second.parallel:
            continue
        a, b, c = axes[i : i + 3]
        if float(np.linalg.norm(_meeting(a, b) - _meeting(b, c))) < 10.0 * near:
            found.append(i)
    return tuple(found)


def _meeting(a: Axis, b: Axis) -> Array:
    """The intersection of two lines ``(3,)``: the point of b nearest to a."""
    between = b.point - a.point
    cosine = float(a.direction @ b.direction)
    along = (cosine * (between @ a.direction) - between @ b.direction) / (1.0 - cosine * cosine)
    return np.asarray(b.point + along * b.direction)


def parallel_groups(robot: Robot) -> tuple[tuple[int, int], ...]:
    """(first, last) joint of each longest run of consecutive parallel axes, prismatic joints included."""
    found: list[tuple[int, int]] = []
    for pair in pairs(robot):
        if not pair.parallel:
            continue
        if found and found[-1][1] == pair.joint:
            found[-1] = (found[-1][0], pair.joint + 1)
        else:
            found.append((pair.joint, pair.joint + 1))
    return tuple(found)


class Links(NamedTuple):
    """A serial arm as ``base · L1 L2 … Ln · tool``, derived from its axes as lines.

    ``Li = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)``; joint i adds ``sign_i q_i`` to theta_i if it is revolute, to
    d_i if it is prismatic. The d, a and alpha of the last link are 0, `tool` contains them; theta_1 = d_1 = 0.
    """

    base: Array
    sign: Array
    theta: Array
    d: Array
    a: Array
    alpha: Array
    tool: Array


def links_of(robot: Robot, twists: tuple[int, ...]) -> Links:
    """The robot as `Links`, each twist with the sign in `twists` (one per joint but the last) or zero.

    The frames lie on the common normals. The result does not depend on the convention or on fixed rows, and all
    offsets along parallel axes are in the d of the last one.
    """
    z, points, sign, end = lines_of(robot)
    theta, d, a, alpha = (np.zeros(robot.n) for _ in range(4))
    origin, incoming = points[0], np.zeros(3)
    base = frame = np.eye(4)
    for i, sense in enumerate(twists):
        normal, between = cross(z[i], z[i + 1]), points[i + 1] - origin
        sine = float(np.linalg.norm(normal))
        if sine < TOLERANCES.geometry:
            foot, across = origin, between - z[i] * (between @ z[i])
            a[i] = float(np.linalg.norm(across))
            if a[i] < TOLERANCES.geometry:
                a[i], across = 0.0, incoming if incoming.any() else perpendicular_to(z[i])
            x = across / np.linalg.norm(across)
            origin = origin + a[i] * x
        else:
            x = sense * normal / sine
            alpha[i] = sense * math.atan2(sine, z[i] @ z[i + 1])
            a[i] = between @ x
            foot = origin + z[i] * (cross(between, z[i + 1]) @ normal / sine**2)
            origin = points[i + 1] + z[i + 1] * (cross(between, z[i]) @ normal / sine**2)
        if i == 0:
            base = frame_of(x, z[0], foot)
        else:
            theta[i] = math.atan2(cross(incoming, x) @ z[i], incoming @ x)
            d[i] = (foot - frame[:3, 3]) @ z[i]
        incoming = x
        frame = frame_of(x, z[i + 1], origin)
    return Links(base, sign, theta, d, a, alpha, inverse(frame) @ end)


def links_by_rows(robot: Robot, quarters: tuple[int, ...]) -> Links | None:
    """The robot as `Links` with the numbers of its table, and the twists `quarters` (in quarter turns).

    None if it has prismatic joints or a fixed offset between two joints, or if a twist differs. Unlike
    `links_of`, it copies the values of the table unchanged: all signs are +1.0, theta_1 and d_1 are those of
    the table, and so are the last link's, which are not in `tool`.

    ``Tx(a) Rx(90°) = Rz(π) Tx(−a) Rx(−90°) Rz(π)``: a twist of the wrong sign is replaced by half turns of its two
    neighbours.
    """
    links = _links_of_table(robot) if robot.revolute.all() else None
    if links is None:
        return None
    theta, a, alpha = links.theta, links.a, links.alpha
    for i, quarter in enumerate(quarters):
        wanted = quarter * math.pi / 2
        if is_zero(math.remainder(alpha[i] - wanted, 2.0 * math.pi)):
            continue
        if quarter == 0 or not is_zero(math.remainder(alpha[i] + wanted, 2.0 * math.pi)):
            return None
        theta[i] += math.pi
        theta[i + 1] += math.pi
        a[i] = -a[i]
        alpha[i] = wanted
    return links


def _links_of_table(robot: Robot) -> Links | None:
    """The rows of a table with revolute joints as `Links`; None with a fixed offset between two joints."""
    base, tool = robot.T_world_base.copy(), np.eye(4)
    theta, d, a, alpha = (np.zeros(robot.n) for _ in range(4))
    joint = -1
    for row in robot.rows:
        z_part, x_part = ("z", row.theta, row.d), ("x", row.a, row.alpha)
        for axis, first, second in (z_part, x_part) if robot.convention == "standard" else (x_part, z_part):
            constant = screw_z(first, second) if axis == "z" else screw_x(first, second)
            if axis == "z" and row.driven:
                joint += 1
                theta[joint], d[joint] = first, second
            elif joint < 0:
                base = base @ constant
            elif joint == robot.n - 1:
                tool = tool @ constant
            elif axis == "x":
                a[joint] += first
                alpha[joint] += second
            elif first or second:
                if a[joint] or alpha[joint]:
                    return None
                theta[joint] += first
                d[joint] += second
    return Links(base, np.ones(robot.n), theta, d, a, alpha, tool @ robot.T_last_tool)


def cross(a: Array, b: Array) -> Array:
    """The vector product of two vectors ``(3,)``; numpy's takes four times as long for a single pair."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def screw_z(theta: float, d: float) -> Array:
    """``Rz(theta) Tz(d)``."""
    c, s = exact_cos_sin(theta)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1.0]])


def screw_x(a: float, alpha: float) -> Array:
    """``Tx(a) Rx(alpha)``."""
    c, s = exact_cos_sin(alpha)
    return np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def inverse(T: Array) -> Array:
    """Inverse of a rigid transform ``(4, 4)``."""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def frame_of(x: Array, z: Array, origin: Array) -> Array:
    """The frame with these axes x and z (perpendicular unit vectors) and this origin ``(4, 4)``."""
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, cross(z, x), z, origin
    return T


def perpendicular_to(z: Array) -> Array:
    """Any unit vector perpendicular to the unit vector z."""
    x = cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    return np.asarray(x / np.linalg.norm(x))


def is_perpendicular(angle: float) -> bool:
    """Whether an angle is 90° or −90° within the geometric tolerance."""
    return abs(abs(angle) - 0.5 * math.pi) < TOLERANCES.geometry


def is_along(T: Array) -> bool:
    """Whether the z axis of a frame ``(4, 4)`` is that of its parent, or opposite to it.

    The sideways components decide: the cosine does not change with a small tilt.
    """
    return is_zero(T[0, 2], T[1, 2])


def is_zero(*values: float) -> bool:
    """Whether all lengths vanish within the geometric tolerance."""
    return all(abs(v) < TOLERANCES.geometry for v in values)
