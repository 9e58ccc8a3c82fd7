"""What ``kinboard check`` tells of a robot file: what the arm is, who will solve it, and what looks odd.

A file that cannot be read as a robot is refused before this (:mod:`kin.catalog`). What is found here does not
forbid anything: an arm with warnings works, but perhaps not as its author meant.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from typing_extensions import TypedDict

from app.shared.answers.robots import RobotAnswer, robot_answer
from kin import Robot, jacobian
from kin.axes import Pair, generic_q, pairs, parallel_groups, size, spherical_groups
from kin.home import candidates, margins
from kin.solvers import closed_form_of

NEAR_SINGULAR = 0.1  # of the best margin among the poses a home would be chosen from
LONG, SHORT = 100.0, 0.01  # metres: reaches beyond these are rather another unit


class PairAnswer(TypedDict):
    """How two consecutive axes lie to each other."""

    joints: list[int]
    """Indices of the two moving joints."""
    angle: float
    """Between the two lines, 0 to π/2 radians."""
    distance: float | None
    """Shortest distance between the lines in metres; null where one of the joints slides."""
    relation: Literal["same line", "parallel", "perpendicular", "oblique"]
    """What the angle is, and whether parallel lines are one line."""
    intersect: bool
    """Whether the lines meet."""


class CheckAnswer(TypedDict):
    """Everything ``kinboard check`` finds out."""

    robot: RobotAnswer
    axes: list[PairAnswer]
    parallel: list[list[int]]
    """Each longest run of consecutive joints with parallel axes."""
    spherical: list[list[int]]
    """Each three consecutive joints whose axes meet in one point."""
    motions: int
    """How many independent motions the joints give the tool, at most six."""
    solver: str
    """The closed form that answers inverse kinematics, or "numeric"."""
    reason: str
    """Why this one."""
    warnings: list[str]


def check(robot: Robot, taken: bool = False) -> CheckAnswer:
    """What an arm is; `taken` tells that a built-in one has its id."""
    match = closed_form_of(robot)
    between = pairs(robot)
    return {
        "robot": robot_answer(robot),
        "axes": [_pair(pair) for pair in between],
        "parallel": [list(range(first, last + 1)) for first, last in parallel_groups(robot)],
        "spherical": [list(range(i, i + 3)) for i in spherical_groups(robot)],
        "motions": motions(robot),
        "solver": "numeric" if match is None else match.name,
        "reason": "no closed form fits this arm's axes" if match is None else match.reason,
        "warnings": warnings(robot, between, taken),
    }


def _pair(pair: Pair) -> PairAnswer:
    turned: Literal["parallel", "perpendicular", "oblique"] = (
        "parallel" if pair.parallel else "perpendicular" if pair.perpendicular else "oblique"
    )
    return {
        "joints": [pair.joint, pair.joint + 1],
        "angle": pair.angle,
        "distance": None if math.isnan(pair.distance) else pair.distance,
        "relation": "same line" if pair.one_line else turned,
        "intersect": pair.intersect,
    }


def motions(robot: Robot) -> int:
    """Rank of the Jacobian at a generic configuration, lengths in units of the arm's size."""
    J = jacobian(robot, generic_q(robot))
    J[:3] /= size(robot)
    return int(np.linalg.matrix_rank(J, tol=1e-9))


def warnings(robot: Robot, between: tuple[Pair, ...], taken: bool) -> list[str]:
    """What looks odd, one sentence each."""
    found = []
    if taken:
        found.append(f'The id "{robot.id}" is that of a built-in robot; a folder of robots may not use it again.')
    if not SHORT <= robot.reach <= LONG:
        found.append(f"The arm reaches {robot.reach:g} m: is units.length what the table is in?")
    for i, joint in enumerate(robot.joints):
        if joint.kind == "revolute" and joint.limits and joint.limits[1] - joint.limits[0] > 4 * math.pi + 1e-9:
            span = math.degrees(joint.limits[1] - joint.limits[0])
            found.append(
                f"Joint {i + 1} ({joint.name}) turns through {span:.0f}°, more than twice round: "
                "postures come in several whole-turn images."
            )
    for pair in between:
        here, there = pair.joint + 1, pair.joint + 2
        if pair.one_line:
            found.append(f"Joints {here} and {there} turn about the same line: only their sum moves the tool.")
        elif pair.almost:
            found.append(
                f"The axes of joints {here} and {there} are almost {pair.almost}: a closed form needs that "
                "exactly; type the table with more digits."
            )
    found += [
        f'The fixed row "{row.name}" changes nothing.'
        for row in robot.rows
        if row.kind == "fixed" and not any((row.theta, row.d, row.a, row.alpha))
    ]
    margin = margins(robot, np.vstack([robot.q_home, candidates(robot)[0]]))
    if margin[0] < NEAR_SINGULAR * margin.max():
        found.append("The home pose is near a singularity: from there some motions of the tool need fast joints.")
    if robot.n > 6 and motions(robot) < 6:
        found.append(f"{robot.n} joints give the tool only {motions(robot)} independent motions.")
    return found
