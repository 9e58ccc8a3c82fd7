"""How a robot's joint axes lie to each other: what decides whether an arm has a closed form, and which.

An axis is a line in space: the line a revolute joint turns about, or the direction a prismatic joint slides along
(a direction only: a slide may be drawn anywhere). Of two lines, two figures tell everything: the angle between
them and the shortest distance between them. Lines are *parallel* at angle 0, *perpendicular* at 90°, they
*intersect* at distance 0, and both at once makes them *one line*.

Between two consecutive joints lies one rigid link, so these relations belong to the arm, not to a configuration.
Three consecutive axes through one point form a *spherical group*, a wrist or a shoulder: turning about them
leaves the point where it is, which splits position from orientation (Pieper, The kinematics of manipulators under
computer control, Stanford 1968). Three parallel axes do the same for motion in a plane.

The axes are read off the Jacobian, so conventions, fixed rows, base and tool need no cases of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_GOLDEN = 0.6180339887498949
# Within this of a special place (radians, shares of the arm's size) an axis was meant to be there: a table typed
# with three or four digits.
NEARLY = 2e-3


@dataclass(frozen=True, eq=False)
class Axis:
    """A joint's axis in the base frame.

    Attributes:
        joint: index of the moving joint.
        slides: whether the joint is prismatic; `point` then means nothing.
        point: the point of the axis nearest to the tool ``(3,)``, metres.
        direction: unit vector ``(3,)``.
    """

    joint: int
    slides: bool
    point: Array
    direction: Array


@dataclass(frozen=True, slots=True)
class Pair:
    """How two consecutive axes lie.

    Attributes:
        joint: index of the first of the two joints.
        angle: between the lines, 0 to π/2 radians.
        distance: shortest distance between the lines in metres, NaN where one is a slide.
        parallel, perpendicular, intersect: within the tolerances; one line is parallel and intersecting.
        almost: "parallel", "perpendicular" or "intersecting" if it misses that by so little that it must have
            been meant, "" otherwise.
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


def joint_axes(robot: Robot, q: ArrayLike | None = None) -> tuple[Axis, ...]:
    """Every joint's axis at a configuration ``(n,)``; at a generic one, no angle of which is special, by default.

    A revolute column of the Jacobian is (ω × r, ω) with r from the axis to the tool point; r is recovered as
    (ω × r) × ω.
    """
    q = generic_q(robot) if q is None else robot.check_q(q)
    J, tool = jacobian(robot, q), fk(robot, q)[:3, 3]
    axes = []
    for i, turns in enumerate(robot.revolute.tolist()):
        linear, angular = J[:3, i], J[3:, i]
        point = tool - np.cross(linear, angular)
        axes.append(Axis(i, not turns, point, angular if turns else linear))
    return tuple(axes)


def generic_q(robot: Robot) -> Array:
    """A configuration ``(n,)`` inside the limits, special in no way: golden-section shares of each range."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
    share = np.modf(_GOLDEN * np.arange(1.0, robot.n + 1.0))[0]
    return np.asarray(lower + (0.15 + 0.7 * share) * (upper - lower))


def size(robot: Robot) -> float:
    """The arm's size in metres, that lengths are compared with: all offsets end to end, slides apart."""
    total = sum(math.hypot(row.a, row.d) for row in robot.rows)
    return float(total + np.linalg.norm(robot.T_last_tool[:3, 3])) or 1.0


def pairs(robot: Robot, q: ArrayLike | None = None) -> tuple[Pair, ...]:
    """How each axis lies to the next one: n − 1 pairs, the same at every configuration."""
    return tuple(_pair(a, b, size(robot)) for a, b in pairwise(joint_axes(robot, q)))


def _pair(a: Axis, b: Axis, scale: float) -> Pair:
    normal = np.cross(a.direction, b.direction)
    sine, cosine = float(np.linalg.norm(normal)), abs(float(a.direction @ b.direction))
    angle = math.atan2(sine, cosine)
    parallel, square = sine < TOLERANCES.geometry, cosine < TOLERANCES.geometry
    between = b.point - a.point
    if a.slides or b.slides:
        distance = math.nan
    elif sine < NEARLY:  # the common normal of almost parallel lines is lost in rounding: measure across them
        distance = float(np.linalg.norm(between - (between @ a.direction) * a.direction))
    else:
        distance = abs(float(between @ normal)) / sine
    meet = distance < TOLERANCES.geometry * scale
    almost = ""
    if not parallel and sine < NEARLY:
        almost = "parallel"
    elif not square and cosine < NEARLY:
        almost = "perpendicular"
    elif not meet and not parallel and distance < NEARLY * scale:
        almost = "intersecting"
    return Pair(a.joint, angle, distance, parallel, square, meet, almost)


def spherical_groups(robot: Robot, q: ArrayLike | None = None) -> tuple[int, ...]:
    """First joint of each three consecutive axes that meet in one point, neighbours not being one line.

    A shoulder, an elbow and a wrist may share joints: four axes through one point are two groups.
    """
    axes, found = joint_axes(robot, q), []
    near = TOLERANCES.geometry * size(robot)
    for i, (first, second) in enumerate(pairwise(pairs(robot, q))):
        if not (first.intersect and second.intersect) or first.parallel or second.parallel:
            continue
        a, b, c = axes[i : i + 3]
        if float(np.linalg.norm(_meeting(a, b) - _meeting(b, c))) < 10.0 * near:
            found.append(i)
    return tuple(found)


def _meeting(a: Axis, b: Axis) -> Array:
    """Where two lines that intersect do so ``(3,)``: the point of b nearest to a."""
    between = b.point - a.point
    cosine = float(a.direction @ b.direction)
    along = (cosine * (between @ a.direction) - between @ b.direction) / (1.0 - cosine * cosine)
    return np.asarray(b.point + along * b.direction)


def parallel_groups(robot: Robot, q: ArrayLike | None = None) -> tuple[tuple[int, int], ...]:
    """(first, last) joint of each longest run of consecutive parallel axes, slides included."""
    found: list[tuple[int, int]] = []
    for pair in pairs(robot, q):
        if not pair.parallel:
            continue
        if found and found[-1][1] == pair.joint:
            found[-1] = (found[-1][0], pair.joint + 1)
        else:
            found.append((pair.joint, pair.joint + 1))
    return tuple(found)
