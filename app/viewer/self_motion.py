"""Self-motion: motions of the arm that keep the tool in place.

The core gives the feasible ranges of a redundancy parameter exactly. This module answers what a page asks about
them: the configuration for a value, the range reachable from the present value, and the joint limit at each end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

import kin
from app.viewer.null_space import null_space
from kin import IKOptions, IKResult, Robot
from kin.differential.task import free_motions
from kin.ik import Redundancy, Task, solve
from kin.ik.problem import prepare
from kin.transforms import Array

SMOOTH = 0.6  # rad; a larger step of a joint in one event is a jump to another posture
INSET = 1e-6  # rad; the end of a range is evaluated this far inside it
AT_LIMIT = 1e-4  # rad or m
_SEAM = 1e-9
_OFFERED = 1e-3  # least share of a joint in the null space to be offered as a parameter


@dataclass(frozen=True)
class End:
    """An end of a feasible range: the value, and the joint whose limit is met there (−1: none)."""

    value: float
    joint: int


def self_motion(robot: Robot, T: Array, options: IKOptions, q: Array, name: str, value: float) -> IKResult:
    """Solve for the target `T` ``(4, 4)`` with a redundancy parameter set.

    Of the options, task and constraints hold, not the branch. A solution near `q` ``(n,)`` is preferred; if there
    is none, the solution on the branch of `q` is returned, or the closest one if branches have no names.
    """
    target = T[:3, 3] if options.task == "position" else T
    for branch in (None, "seed") if kin.branch_names(robot) else (None,):
        trial = replace(options, branch=branch, redundancy={name: value}, max_solutions=1)
        result = solve(robot, target, trial, q)
        if result.solutions and float(np.abs(result.solutions[0].q - q).max()) < SMOOTH:
            break
    return result


def redundancy_at(robot: Robot, T: Array, options: IKOptions, q: Array) -> tuple[Redundancy, ...]:
    """The redundancy parameters of a task at `q` ``(n,)``, on its branch, without those of singular poses only."""
    target = T[:3, 3] if options.task == "position" else T
    seed = "seed" if kin.branch_names(robot) else None
    options = replace(options, branch=seed, max_solutions=1)
    rare = {parameter.name for parameter in prepare(robot, options).redundancies if parameter.rare}
    found = solve(robot, target, options, q)
    own = found.solutions[0].redundancy if found.solutions else found.redundancy
    return tuple(item for item in own if item.name not in rare)


def circular(item: Redundancy) -> bool:
    """Whether a parameter is periodic, and not a joint's own value."""
    return not item.name.startswith("theta")


def range_of(item: Redundancy) -> tuple[float, float] | None:
    """The feasible range that contains the present value, in which ±π may lie; None if there is none.

    A range across ±π is given with an upper end beyond π, or a lower end below −π.
    """
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


def ends(robot: Robot, T: Array, options: IKOptions, q: Array, item: Redundancy) -> tuple[End, ...]:
    """The ends of all feasible ranges, each with the joint whose limit is met; ±π of a periodic one is no end."""
    found = []
    target = T[:3, 3] if options.task == "position" else T
    branch = "seed" if kin.branch_names(robot) else None
    for low, high in item.intervals:
        for value, inside in ((low, min(low + INSET, high)), (high, max(high - INSET, low))):
            if circular(item) and abs(abs(value) - math.pi) < _SEAM:
                continue
            trial = replace(options, branch=branch, redundancy={item.name: inside}, max_solutions=1)
            result = solve(robot, target, trial, q)
            joint = -1
            if result.solutions:
                there = result.solutions[0].q
                room = np.minimum(there - robot.lower, robot.upper - there)
                nearest = int(np.argmin(room))
                joint = nearest if room[nearest] < AT_LIMIT else -1
            found.append(End(value, joint))
    return tuple(found)


def leaders(robot: Robot, q: Array, task: Task, locked: tuple[int, ...] = ()) -> tuple[Redundancy, ...]:
    """The revolute joints of the null space at q ``(n,)``, each as a parameter that can be set.

    Without a closed form nobody knows the feasible range: it is that of the joint's own limits.
    """
    if not free_motions(robot, task, locked):
        return ()
    basis = null_space(robot, q, task, locked).basis
    found = []
    for i in np.flatnonzero(robot.revolute & (np.linalg.norm(basis, axis=1) > _OFFERED)).tolist():
        low, high = float(robot.lower[i]), float(robot.upper[i])
        ends = (low, high) if math.isfinite(high - low) else (-math.pi, math.pi)
        found.append(Redundancy(f"theta{i + 1}", f"θ{i + 1}", float(q[i]), (ends,)))
    return tuple(found)
