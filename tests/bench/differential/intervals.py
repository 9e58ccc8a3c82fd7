"""Intervals that only one of two trees has, judged by the branch inside them: forward kinematics and limits.

A change may find intervals that were missed, or drop some in which the arm is outside its limits; neither is a
fault. Inside an interval the arm is evaluated at several values of the redundancy parameter: the joint values come
from `kin.ik_branches` of the new tree, and count only if plain matrix products bring them to the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import kin
from differential.answers import Answer, Interval
from differential.questions import Question, pose
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE

_NARROW = 1e-9  # radians; narrower intervals are not judged
_POINTS = np.linspace(0.05, 0.95, 7)  # of an interval
_TARGET_ERROR = 1e-6
_SLACK = 1e-9
# Options under which the intervals are those of the whole arm at the target.
_JUDGED_WITH = {"limits", "images", "prefer", "position_tolerance", "rotation_tolerance"}


class Judged(NamedTuple):
    """An interval that only one tree has.

    Attributes:
        new: whether it is the new tree.
        branch, interval: where.
        feasible: the share of the values tried at which the arm is at the target and inside the limits.
    """

    new: bool
    branch: str
    interval: Interval
    feasible: float

    @property
    def wrong(self) -> bool:
        """Whether the new tree is at fault: values that are feasible are lost, or some that it adds are not."""
        return self.feasible < 1.0 if self.new else self.feasible > 0.0

    @property
    def width(self) -> float:
        """Radians."""
        return self.interval[1] - self.interval[0]


def parameter_of(question: Question) -> str | None:
    """The redundancy parameter whose intervals can be judged; None if there is none for this question."""
    form = closed_form_of(question.robot)
    if form is None or not form.named or question.target.ndim != 2 or not set(question.options) <= _JUDGED_WITH:
        return None
    parameters = [parameter for parameter in form.redundancies(POSE)[:1] if not parameter.rare]
    return parameters[0].name if parameters else None


def judge(question: Question, old: Answer, new: Answer) -> list[Judged]:
    """What one tree has and the other has not, on every branch."""
    name = parameter_of(question)
    if name is None:
        return []
    found = []
    there = [_by_branch(answer, name) for answer in (old, new)]
    for branch in dict.fromkeys((*there[0], *there[1])):
        before, after = (intervals.get(branch, ()) for intervals in there)
        for is_new, kept, other in ((False, before, after), (True, after, before)):
            found += [Judged(is_new, branch, x, _feasible(question, branch, x)) for x in without(kept, other)]
    return found


def without(kept: Sequence[Interval], other: Sequence[Interval]) -> list[Interval]:
    """The parts of some intervals that others do not cover."""
    found = []
    for low, high in kept:
        start = low
        for a, b in sorted(other):
            if b < start:
                continue
            if a > high:
                break
            found.append((start, a))
            start = max(start, b)
        found.append((start, high))
    return [(a, b) for a, b in found if b - a > _NARROW]


def _by_branch(answer: Answer, name: str) -> dict[str, tuple[Interval, ...]]:
    """The intervals of parameter `name` on each branch that has a solution."""
    found: dict[str, tuple[Interval, ...]] = {}
    for branch, ranges in zip(answer.branches, answer.ranges, strict=True):
        for parameter, _, intervals in ranges:
            if parameter == name:
                found.setdefault(branch, intervals)
    return found


def _feasible(question: Question, branch: str, interval: Interval) -> float:
    robot, T = question.robot, question.target
    lower, upper = robot.lower, robot.upper
    if "limits" in question.options:
        lower, upper = np.array(question.options["limits"]).T
    values = interval[0] + (interval[1] - interval[0]) * _POINTS
    row = kin.branch_names(robot).index(branch)
    rows = kin.ik_branches(robot, np.broadcast_to(T, (len(values), 4, 4)), values)[:, row]
    good = 0
    for q in rows:
        # Each joint at the lowest of its whole turns that is not below the lower limit.
        turn = np.where(robot.revolute & np.isfinite(lower), 2.0 * math.pi, 0.0)
        steps = np.ceil(
            (lower - _SLACK - q) / np.where(turn > 0.0, turn, 1.0), where=turn > 0.0, out=np.zeros_like(q)
        )
        image = q + turn * steps
        inside = (image >= lower - _SLACK) & (image <= upper + _SLACK)
        good += bool(inside.all() and np.abs(pose(robot, q) - T).max() <= _TARGET_ERROR)
    return good / len(rows)
