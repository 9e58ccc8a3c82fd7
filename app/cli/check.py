"""``kinboard check``: describes the arm of a robot file, names its solver, and warns of likely mistakes.

A file that is not a valid robot is rejected earlier, by :mod:`kin.catalog`. Warnings forbid nothing: the arm
works, but perhaps not as its author intended.
"""

from __future__ import annotations

import math
from argparse import Namespace
from pathlib import Path
from typing import Literal

import numpy as np
from typing_extensions import TypedDict

from app.cli.terminal import Notation, print_json, table
from app.shared.answers.robots import RobotAnswer, robot_answer
from kin import Robot, builtin_robots, jacobian, load_robot
from kin.axes import Pair, generic_q, pairs, parallel_groups, size, spherical_groups
from kin.catalog import BUILTIN
from kin.home import candidates, margins
from kin.solvers import closed_form_of

NEAR_SINGULAR = 0.1  # of the best margin among the candidates for a home pose
LONG, SHORT = 100.0, 0.01  # m; a reach beyond these suggests a wrong unit


class PairAnswer(TypedDict):
    """Relation of two consecutive joint axes."""

    joints: list[int]
    """Indices of the two moving joints."""
    angle: float
    """Angle between the axes, 0 to π/2 radians."""
    distance: float | None
    """Shortest distance between the axes in metres; null if one of the joints slides."""
    relation: Literal["same line", "parallel", "perpendicular", "oblique"]
    """Kind of the angle; "same line" for coincident axes."""
    intersect: bool
    """Whether the axes intersect."""


class CheckAnswer(TypedDict):
    """Result of ``kinboard check``."""

    robot: RobotAnswer
    axes: list[PairAnswer]
    parallel: list[list[int]]
    """Maximal runs of consecutive joints with parallel axes."""
    spherical: list[list[int]]
    """Triples of consecutive joints whose axes meet in one point."""
    motions: int
    """Number of independent tool motions, at most six."""
    solver: str
    """The closed form that answers inverse kinematics, or "numeric"."""
    reason: str
    """Why this solver was chosen."""
    warnings: list[str]


def run(arguments: Namespace) -> int:
    """Describe the arm of a robot file."""
    path = Path(arguments.file)
    robot = load_robot(path)
    answer = check(robot, robot.id in builtin_robots() and path.resolve().parent != BUILTIN.resolve())
    if arguments.json:
        return print_json(answer)
    units = Notation(robot, arguments.rad)
    print(f"{robot.name} ({robot.id})\n{robot.description or 'No description.'}\nsource: {robot.source}\n")
    rows = [
        [str(i + 1), joint.name, joint.kind, units.joint(i, low), units.joint(i, high), units.joint(i, home)]
        for i, (joint, low, high, home) in enumerate(
            zip(robot.joints, robot.lower, robot.upper, robot.home, strict=True)
        )
    ]
    print(table(["", "joint", "kind", "lower", "upper", "home"], rows) + "\n")
    for line in _about(answer, units):
        print(line)
    return 0


def _about(answer: CheckAnswer, units: Notation) -> list[str]:
    """Lines about joint axes, solver and warnings."""
    robot = answer["robot"]
    lines = []
    for pair in answer["axes"]:
        a, b = (j + 1 for j in pair["joints"])
        apart = "" if pair["distance"] is None else f", {units.length(pair['distance'])} {units.of_length} apart"
        angle = f" ({units.angle(pair['angle'])})" if pair["relation"] == "oblique" else ""
        where = "" if pair["relation"] == "same line" else ", intersecting" if pair["intersect"] else apart
        lines.append(f"axes {a} and {b}: {pair['relation']}{angle}{where}")
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: parallel axes" for run in answer["parallel"]]
    lines += [f"joints {run[0] + 1} to {run[-1] + 1}: axes through one point" for run in answer["spherical"]]
    count = len(robot["branches"])
    lines += [
        "",
        f"convention  {robot['convention']}",
        f"joints      {robot['n']}, giving the tool {answer['motions']} independent motions",
        f"reach       {units.length(robot['reach'])} {units.of_length} at most",
        f"solver      {answer['solver']}: {answer['reason']}",
        f"branches    {count if count else 'not known in advance: a search finds them one by one'}",
        "",
        *(f"warning: {text}" for text in answer["warnings"]),
    ]
    return lines if answer["warnings"] else [*lines, "No warnings."]


def check(robot: Robot, taken: bool = False) -> CheckAnswer:
    """Describe an arm; `taken`: a built-in robot has the same id."""
    match = closed_form_of(robot)
    between = pairs(robot)
    return {
        "robot": robot_answer(robot),
        "axes": [_pair(pair) for pair in between],
        "parallel": [list(range(first, last + 1)) for first, last in parallel_groups(robot)],
        "spherical": [list(range(i, i + 3)) for i in spherical_groups(robot)],
        "motions": motions(robot),
        "solver": "numeric" if match is None else match.name,
        "reason": "none of Kinboard's closed forms fits this arm's axes" if match is None else match.reason,
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
    """Rank of the Jacobian at a generic configuration, with lengths relative to the size of the arm."""
    J = jacobian(robot, generic_q(robot))
    J[:3] /= size(robot)
    return int(np.linalg.matrix_rank(J, tol=1e-9))


def warnings(robot: Robot, between: tuple[Pair, ...], taken: bool) -> list[str]:
    """Likely mistakes, one sentence each."""
    found = []
    if taken:
        found.append(f'The id "{robot.id}" is that of a built-in robot; robot files in a folder need another id.')
    if not SHORT <= robot.reach <= LONG:
        found.append(f"The arm reaches {robot.reach:g} m: check units.length.")
    for i, joint in enumerate(robot.joints):
        if joint.kind == "revolute" and joint.limits and joint.limits[1] - joint.limits[0] > 4 * math.pi + 1e-9:
            span = math.degrees(joint.limits[1] - joint.limits[0])
            found.append(
                f"Joint {i + 1} ({joint.name}) turns through {span:.0f}°, more than two turns: "
                "each solution has several images that differ by whole turns."
            )
    for pair in between:
        here, there = pair.joint + 1, pair.joint + 2
        if pair.one_line:
            found.append(f"Joints {here} and {there} turn about the same line: only their sum moves the tool.")
        elif pair.almost:
            found.append(
                f"The axes of joints {here} and {there} are almost {pair.almost}: a closed form needs "
                "exact values; give the table with more digits."
            )
    found += [
        f'The fixed row "{row.name}" changes nothing.'
        for row in robot.rows
        if row.kind == "fixed" and not any((row.theta, row.d, row.a, row.alpha))
    ]
    margin = margins(robot, np.vstack([robot.q_home, candidates(robot)[0]]))
    if margin[0] < NEAR_SINGULAR * margin.max():
        found.append("The home configuration is near a singularity: some tool motions there need fast joints.")
    if robot.n > 6 and motions(robot) < 6:
        found.append(f"{robot.n} joints give the tool only {motions(robot)} independent motions.")
    return found
