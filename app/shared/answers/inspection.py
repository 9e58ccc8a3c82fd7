"""What an arm is: how its axes lie, which solver it gets and why, and likely mistakes in its table.

Warnings forbid nothing: the arm works, but perhaps not as its author intended.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np

from app.shared.answers.answer import Answer, From
from app.shared.answers.robots import RobotAnswer, robot_answer
from kin import Robot, jacobian, singularities
from kin.axes import Pair, generic_q, pairs, parallel_groups, size, spherical_groups
from kin.collision.bodies import bodies_of
from kin.files.home import candidates, margins
from kin.files.units import suspicious_angles
from kin.ik.messages.singularity import CONDITIONS
from kin.solvers import closed_form_of, family_of
from kin.tolerances import TOLERANCES

_SINGULAR = {"smallest singular value": "the tool cannot move in some direction"}  # what has no name of its own
NEAR_SINGULAR, SINGULAR = 0.1, 1e-6  # of the best margin among the candidates for a home pose
LONG, SHORT = 100.0, 0.01  # m; a reach beyond these suggests a wrong unit


Relation = Literal["same line", "parallel", "perpendicular", "oblique"]


def _relation(pair: Pair) -> Relation:
    if pair.one_line:
        return "same line"
    return "parallel" if pair.parallel else "perpendicular" if pair.perpendicular else "oblique"


class PairAnswer(Answer):
    """Relation of two consecutive joint axes."""

    joints: Annotated[list[int], From(lambda pair: (pair.joint, pair.joint + 1))]
    """Indices of the two moving joints."""
    angle: float
    """Angle between the axes, 0 to π/2 radians."""
    distance: Annotated[float | None, From(lambda pair: None if math.isnan(pair.distance) else pair.distance)]
    """Shortest distance between the axes in metres; null if one of the joints slides."""
    relation: Annotated[Relation, From(_relation)]
    """Kind of the angle; "same line" for coincident axes."""
    intersect: bool
    """Whether the axes intersect."""


class CapsuleAnswer(Answer):
    """A part of a link's body: all points within `radius` of a segment."""

    link: int
    """0 for the base, k for the link that joint k moves."""
    row: int
    """Index of the DH row in whose frame the points are; -1 for the frame before the first row."""
    start: list[float]
    """One end of the segment, in metres."""
    end: list[float]
    """The other end."""
    radius: float
    """In metres."""
    assumed: bool
    """Whether the real body is not known."""


class BodiesAnswer(Answer):
    """The bodies of the links, and which of them are compared."""

    assumed: bool
    """Whether they are assumed along the lengths of the table, because the arm's file states none."""
    source: str
    """Where they are from; empty if that is not stated."""
    capsules: list[CapsuleAnswer]
    """Base first."""
    compared: list[list[int]]
    """Pairs of links that are compared: not those that share a joint, touch at home or nearly always, or have one
    link between them and hardly touch."""


class InspectionAnswer(Answer):
    """What an arm is: its axes, its motions, its solver, and likely mistakes in its table."""

    robot: RobotAnswer
    """The arm itself."""
    axes: list[PairAnswer]
    """Relation of each joint axis to the next one."""
    parallel: list[list[int]]
    """Maximal runs of consecutive joints with parallel axes."""
    spherical: list[list[int]]
    """Triples of consecutive joints whose axes meet in one point."""
    motions: int
    """Number of independent tool motions, at most six."""
    redundancy: int
    """Number of joints beyond that: the dimension of the self-motion at almost every configuration."""
    home_margin: float
    """Distance of the home configuration from a singularity, relative to the best of the configurations that were
    compared with it: 0 at a singularity, 1 at best."""
    singular_at_home: bool
    """Whether the home configuration is singular: some tool motions that the arm has elsewhere are lost there."""
    solver: str
    """The closed form that answers inverse kinematics, or "numeric"."""
    reason: str
    """Why this solver was chosen."""
    warnings: list[str]
    """Likely mistakes in the table, one sentence each."""
    bodies: BodiesAnswer
    """What self-collisions are judged by."""


def inspect(robot: Robot, taken: bool = False) -> InspectionAnswer:
    """Describe an arm; `taken`: a built-in robot has the same id."""
    match = closed_form_of(robot)
    # Between two joints of an arm with rows that follow there is no rigid link, and so no lasting relation.
    rigid = not robot.coupled
    between, count, margin = pairs(robot) if rigid else (), motions(robot), home_margin(robot)
    return InspectionAnswer(
        robot=robot_answer(robot),
        axes=[PairAnswer.of(pair) for pair in between],
        parallel=[list(range(first, last + 1)) for first, last in parallel_groups(robot)] if rigid else [],
        spherical=[list(range(i, i + 3)) for i in spherical_groups(robot)] if rigid else [],
        motions=count,
        redundancy=robot.n - count,
        home_margin=margin,
        singular_at_home=margin < SINGULAR,
        solver=family_of(robot),
        reason="none of Kinboard's closed forms fits this arm's axes" if match is None else match.reason,
        warnings=[*_odd_table(robot, taken), *_odd_axes(robot, between), *_odd_motion(robot, count, margin)],
        bodies=_bodies(robot),
    )


def _bodies(robot: Robot) -> BodiesAnswer:
    found = bodies_of(robot)
    links = np.array([each.link for each in found.capsules], np.int64)
    return BodiesAnswer(
        assumed=not robot.capsules,
        source=robot.capsules_source,
        capsules=[CapsuleAnswer.of(each) for each in found.capsules],
        compared=sorted({(int(a), int(b)): [int(a), int(b)] for a, b in links[found.pairs]}.values()),
    )


def motions(robot: Robot) -> int:
    """Rank of the Jacobian at a generic configuration, with lengths relative to the size of the arm."""
    J = jacobian(robot, generic_q(robot))
    J[:3] /= size(robot)
    return int(np.linalg.matrix_rank(J, tol=1e-9))


@lru_cache(maxsize=64)
def home_margin(robot: Robot) -> float:
    """Margin of the home configuration (see `kin.files.home`), relative to the best of the candidates for one."""
    margin = margins(robot, np.vstack([robot.q_home, candidates(robot)[0]]))
    return float(margin[0] / margin.max()) if margin.max() > 0.0 else 0.0


def singular_at(robot: Robot) -> str:
    """Where an arm is singular of home and zero, as far as its limits allow zero, and how, in a sentence each."""
    said = []
    for name, q in (("home", robot.q_home), ("zero", np.zeros(robot.n))):
        if ((q < robot.lower) | (q > robot.upper)).any():
            continue
        near = singularities(robot, q, TOLERANCES.at_singularity)
        named = [_SINGULAR.get(s.condition, CONDITIONS[s.condition]) for s in near if s.kind != "algorithmic"]
        if named:
            said.append(f"At {name} it is singular: {', '.join(dict.fromkeys(named))}.")
    return " ".join(said)


def _odd_table(robot: Robot, taken: bool) -> list[str]:
    """Likely mistakes in single numbers."""
    found = []
    if taken:
        found.append(f'The id "{robot.id}" is that of a built-in robot; robot files in a folder need another id.')
    if not SHORT <= robot.reach <= LONG:
        found.append(f"The arm reaches {robot.reach:g} m: check units.length.")
    found += [f"{words[0].upper()}{words[1:]}" for words in suspicious_angles(robot)]
    for i, joint in enumerate(robot.joints):
        if joint.kind == "revolute" and joint.limits and joint.limits[1] - joint.limits[0] > 4 * math.pi + 1e-9:
            span = math.degrees(joint.limits[1] - joint.limits[0])
            found.append(
                f"Joint {i + 1} ({joint.name}) turns through {span:.0f}°, more than two turns: "
                "each solution has several images that differ by whole turns."
            )
    return found


def _odd_axes(robot: Robot, between: tuple[Pair, ...]) -> list[str]:
    """Likely mistakes in how rows follow one another."""
    found = []
    for pair in between:
        here, there = pair.joint + 1, pair.joint + 2
        if pair.one_line:
            found.append(f"Joints {here} and {there} turn about the same line: only their sum moves the tool.")
        elif pair.almost and robot.nominal is None:  # a measured table is meant as it is
            found.append(
                f"The axes of joints {here} and {there} are almost {pair.almost}: if they should be so exactly, "
                "give the table with more digits."
            )
    return found + [
        f'The fixed row "{row.name}" changes nothing.'
        for row in robot.rows
        if row.kind == "fixed" and not any((row.theta, row.d, row.a, row.alpha))
    ]


def _odd_motion(robot: Robot, count: int, margin: float) -> list[str]:
    """Likely mistakes that show in how the tool moves."""
    found = []
    if margin < NEAR_SINGULAR:
        found.append("The home configuration is near a singularity: some tool motions there need fast joints.")
    if robot.n > 6 and count < 6:
        found.append(f"{robot.n} joints give the tool only {count} independent motions.")
    return found
