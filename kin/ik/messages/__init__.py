"""Sentences for people: what an inverse-kinematics answer means, in degrees and millimetres."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from kin.fk import fk, link_frames
from kin.ik.messages.obstacle import clause_of
from kin.ik.messages.singularity import short
from kin.ik.problem import Question
from kin.ik.results import BlockedBranch, Cause, IKSolution, LimitViolation, Redundancy
from kin.robot import Robot
from kin.solvers.contract import Obstacle
from kin.solvers.singular import Singularity
from kin.transforms import Array

_WHAT = {
    "pose": "pose",
    "approach": "point and approach direction",
    "position": "point",
    "mask": "set of coordinates",
}


@lru_cache(maxsize=256)
def solved(count: int, task: str, redundant: bool) -> str:
    """Reached, with how many branches."""
    ways = "one configuration" if count == 1 else f"{count} configurations"
    family = ", each with a free parameter" if redundant and count > 1 else ""
    family = " with a free parameter" if redundant and count == 1 else family
    return f"Reached: {ways}{family} for this {_WHAT[task]}."


def solver(question: Question, used: str) -> str:
    """Why the answer comes from the solver it comes from."""
    match = question.match
    if match is None:
        none = "no closed form fits this arm's axes" if question.wanted == "auto" else "asked for"
        return f"{none}: numeric descent from many starts"
    if used != match.name:
        return f"the closed form ({match.name}) does not cover this task or target: numeric descent"
    return match.reason


def singular(found: tuple[Singularity, ...], shown: bool) -> str:
    """A further sentence if the configuration is singular; `shown`: it is the answer, not the closest one."""
    real = [s for s in found if s.kind != "algorithmic"] if found else found
    if not real:
        return ""
    where = "there" if shown else "at the closest pose"
    return f" Singular {where}: {short(real[0])}."


def limits(
    question: Question, blocked: tuple[BlockedBranch, ...], redundancy: tuple[Redundancy, ...], others: int
) -> str:
    """Which joint would have to go where, for the branch that breaks the limits least."""
    first = blocked[0]
    needs = "; ".join(_need(question, v) for v in first.violations)
    given = [f.label for f in question.given]
    place = f" with the given {' and '.join(given)}" if given else ""
    which = "the least offending branch" if len(blocked) > 1 else "the only branch"
    text = f"Out of limits{place}: {which} ({first.branch}) would need {needs}."
    if len(blocked) > 1:
        rest = len(blocked) - 1
        text += f" {_count(rest)} other {_plural(rest, 'branch', 'branches')} would need more."
    if given and any(r.intervals for r in redundancy):
        free = next(r for r in redundancy if r.intervals)
        ranges = ", ".join(f"{degrees(a)} … {degrees(b)}" for a, b in free.intervals)
        text += f" Possible {free.label}: {ranges}."
    if others:
        fits = _plural(others, "configuration on another branch fits", "configurations on other branches fit")
        text += f" {_count(others)} {fits}."
    return text


def other_branch(fits: int, exist: int) -> str:
    """The branch asked for is not there."""
    if fits:
        others = f"{_count(fits).lower()} {_plural(fits, 'configuration reaches', 'configurations reach')}"
        return f"No solution on the chosen branch: {others} this target on other branches."
    return f"No solution on the chosen branch: other branches ({exist}) exist, but the joint limits forbid them."


def approximate(question: Question, best: IKSolution, blocked: tuple[BlockedBranch, ...]) -> str:
    """What an arm with too few joints gave up."""
    if best.compromise == "roll":
        return (
            f"Reached with roll error {degrees(best.rotation_error)}: {question.robot.n} joints keep the point "
            "and the approach direction, not the roll about it."
        )
    why = f": the approach direction would need {_need(question, blocked[0].violations[0])}" if blocked else ""
    return f"Point reached, orientation off by {degrees(best.rotation_error)}{why}."


def mask(closest: IKSolution | None) -> str:
    """The coordinates of a mask cannot all be met."""
    if closest is None:
        return "These coordinates cannot be met together on the chosen branch."
    return (
        "These coordinates cannot be met together: the closest configuration is off by "
        f"{millimetres(closest.position_error)} and {degrees(closest.rotation_error)}."
    )


def orientation(
    closest: IKSolution | None, oriented: IKSolution | None, obstacle: Obstacle | None, gap: float
) -> str:
    """The point can be reached, but not with this orientation."""
    why = f" ({clause_of(obstacle)}, by {millimetres(gap)})" if obstacle and gap > 0.0 else ""
    text = f"This orientation cannot be had at this point{why}"
    if oriented is not None:
        text += f"; the nearest attainable one is {degrees(oriented.rotation_error)} away"
    if closest is not None:
        text += (
            f"; the closest pose is off by {millimetres(closest.position_error)} "
            f"and {degrees(closest.rotation_error)}"
        )
    return text + "."


def unreachable(question: Question, q: Array, distance: float) -> tuple[Cause, str]:
    """How far the point is out of reach, and on which side; q ``(n,)`` is nearest to it."""
    cause = _side(question, q)
    side = {
        "too far": "too far away",
        "too near": "too near to the arm",
        "around the axis": "in the hole around the first axis",
    }.get(cause, "outside the workspace the joint limits leave")
    return cause, f"Out of reach by {millimetres(distance)}: the point is {side}."


def _side(question: Question, q: Array) -> Cause:
    """Whether the point is outside the workspace or inside a hole of it, seen from the shoulder.

    The shoulder is taken on the first joint's axis at the second joint's height. In a hole the way out tells which
    one: straight away from the axis, or away from the shoulder.
    """
    robot = question.robot
    first = link_frames(robot, q)[0]
    axis = robot.T_world_base[:3, 2] if robot.convention == "standard" else first[:3, 2]
    foot = robot.T_world_base[:3, 3]
    shoulder = foot + axis * float(axis @ (first[:3, 3] - foot))
    reached = fk(robot, q)[:3, 3] - shoulder
    wanted = question.T[:3, 3] - shoulder
    far, near = float(np.linalg.norm(wanted)), float(np.linalg.norm(reached))
    if far > near + 1e-6:
        return "too far"
    out = reached - wanted
    radial = out - axis * float(axis @ out)
    away = float(out @ wanted) / far if far > 1e-9 else math.inf
    off_axis = [float(np.linalg.norm(v - axis * float(axis @ v))) for v in (wanted, reached)]
    if (
        robot.joints[0].kind == "revolute"
        and off_axis[1] > off_axis[0] + 1e-6
        and np.linalg.norm(radial) > away - 1e-9
    ):
        return "around the axis"
    return "too near" if far < near - 1e-6 else "outside"


def _need(question: Question, violation: LimitViolation) -> str:
    robot, index = question.robot, violation.joint
    stop = "locked at" if question.locked[index] else "limit"
    value, limit = (joint_value(robot, index, x) for x in (violation.value, violation.limit))
    return f"{joint(robot, index)} at {value} ({stop} {limit})"


def joint(robot: Robot, index: int) -> str:
    """A joint for a sentence: its number, and its name if that is another."""
    name, number = robot.joints[index].name, f"joint {index + 1}"
    return number if name.lower() in (number, str(index + 1)) else f"{number} ({name})"


def joint_value(robot: Robot, index: int, value: float) -> str:
    """A joint's value or motion for a sentence."""
    return degrees(value) if robot.joints[index].kind == "revolute" else millimetres(value)


def _count(number: int) -> str:
    return "One" if number == 1 else str(number)


def _plural(number: int, one: str, many: str) -> str:
    return one if number == 1 else many


def degrees(angle: float) -> str:
    """An angle for a sentence: one decimal, or enough to show that it is not zero."""
    value = math.degrees(angle)
    return f"{value:.1f}°" if abs(value) >= 0.05 or value == 0 else f"{value:.1e}°"


def millimetres(length: float) -> str:
    """A length for a sentence: one decimal, or enough to show that it is not zero."""
    value = 1e3 * length
    return f"{value:.1f} mm" if abs(value) >= 0.05 or value == 0 else f"{value:.1e} mm"
