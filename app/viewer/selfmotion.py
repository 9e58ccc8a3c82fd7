"""Self-motion: what the arm can do while the tool keeps its task.

The core tells a free value's ranges exactly. Here are the questions a screen asks of them: where the arm goes when
the value is set, which range it can swing through from where it is, and which stop ends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import kin
from kin import IKOptions, IKResult, JointConstraints, Redundancy, Robot, Task
from kin.ik.problem import prepare
from kin.transforms import Array

SMOOTH = 0.6  # rad of one joint in one event: more than that is no motion but another posture
INSET = 1e-6  # rad; how far inside a range its end is looked at
AT_STOP = 1e-4  # rad or m
_SEAM = 1e-9
Locks = tuple[float | None, ...] | None


@dataclass(frozen=True)
class End:
    """Where a range of a free value ends: the value, and the joint whose stop ends it (−1: none does)."""

    value: float
    joint: int


def self_motion(robot: Robot, T: Array, task: Task, q: Array, locked: Locks, name: str, value: float) -> IKResult:
    """The target `T` ``(4, 4)`` with a free value set: a smooth motion from `q` ``(n,)`` if there is one, else the
    same branch."""
    target = T[:3, 3] if task == "position" else T
    for branch in (None, "seed"):
        result = kin.solve_ik(
            robot, target, task=task, q_seed=q, locked=locked, branch=branch, redundancy={name: value},
            max_solutions=1,
        )  # fmt: skip
        if result.solutions and float(np.abs(result.solutions[0].q - q).max()) < SMOOTH:
            break
    return result


def free_values(robot: Robot, T: Array, task: Task, q: Array, locked: Locks) -> tuple[Redundancy, ...]:
    """What the task leaves free at `q` ``(n,)``, on the branch it is on; not what only a singularity sets free."""
    target = T[:3, 3] if task == "position" else T
    seed = "seed" if kin.branch_names(robot) else None
    options = IKOptions(task=task, constraints=JointConstraints(locked=locked), branch=seed, max_solutions=1)
    rare = {parameter.name for parameter in prepare(robot, options).redundancies if parameter.rare}
    found = kin.ik.solve(robot, target, options, q)
    return tuple(item for item in found.redundancy if item.name not in rare)


def circular(item: Redundancy) -> bool:
    """Whether a value is an angle on a circle, and not a joint's own."""
    return not item.name.startswith("theta")


def reach_of(item: Redundancy) -> tuple[float, float] | None:
    """The range that can be swung through from the present value; across the seam of a circle its upper end is
    beyond π. None if the value is in no range."""
    ranges = [r for r in item.intervals if r[0] - INSET <= item.value <= r[1] + INSET]
    if not ranges:
        return None
    low, high = ranges[0]
    if not circular(item) or (low <= -math.pi + _SEAM and high >= math.pi - _SEAM):
        return low, high
    if high >= math.pi - _SEAM:
        after = next((r for r in item.intervals if r[0] <= -math.pi + _SEAM), None)
        return (low, after[1] + 2.0 * math.pi) if after else (low, high)
    if low <= -math.pi + _SEAM:
        before = next((r for r in item.intervals if r[1] >= math.pi - _SEAM), None)
        return (before[0] - 2.0 * math.pi, high) if before else (low, high)
    return low, high


def ends(robot: Robot, T: Array, task: Task, q: Array, locked: Locks, item: Redundancy) -> tuple[End, ...]:
    """The ends of all ranges of a value, with the joint whose stop makes each; the seam of a circle is none."""
    found = []
    target = T[:3, 3] if task == "position" else T
    branch = "seed" if kin.branch_names(robot) else None
    for low, high in item.intervals:
        for value, inside in ((low, min(low + INSET, high)), (high, max(high - INSET, low))):
            if circular(item) and abs(abs(value) - math.pi) < _SEAM:
                continue
            result = kin.solve_ik(
                robot, target, task=task, q_seed=q, locked=locked, branch=branch, redundancy={item.name: inside},
                max_solutions=1,
            )  # fmt: skip
            joint = -1
            if result.solutions:
                there = result.solutions[0].q
                room = np.minimum(there - robot.lower, robot.upper - there)
                nearest = int(np.argmin(room))
                joint = nearest if room[nearest] < AT_STOP else -1
            found.append(End(value, joint))
    return tuple(found)
