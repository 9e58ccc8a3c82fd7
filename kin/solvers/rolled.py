"""An approach direction along the last joint's axis, for an arm with seven joints whose poses are solved.

The last joint only rolls the tool. If another joint is the given one, the last joint absorbs any roll. If it is
the given one itself, the other six joints depend on the difference of its value and the roll alone: a roll by φ at
the value θ is the pose without a roll at the value θ − φ.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kin.angles import TURN, wrapped
from kin.axes import is_zero, lines_of
from kin.robot import Robot
from kin.solvers.canonical import free_last, without_last
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import POSE, Candidates, ClosedForm, RedundancyParameter, SolverInput
from kin.transforms import Array

_ROLL = RedundancyParameter("roll", "roll about the approach axis", circular=True)


def roll_sense(robot: Robot) -> float:
    """1.0 if the last joint turns the tool about its z axis, −1.0 if it does so backwards, 0.0 if it does more."""
    lines = lines_of(robot, as_counted=True)
    z, T = lines.z[-1], lines.T_base_tool
    between = np.cross(T[:3, 3] - lines.points[-1], z)
    along = float(z @ T[:3, 2])
    return math.copysign(1.0, along) if is_zero(*between, *np.cross(z, T[:3, 2])) else 0.0


def parameters(given: RedundancyParameter) -> tuple[RedundancyParameter, ...]:
    """The redundancy parameters of an approach direction: two."""
    last = RedundancyParameter("theta7", "θ7", joint=6)
    return (_ROLL if given.joint == last.joint else given, last)


def solve_approach(form: ClosedForm, problem: SolverInput, sense: float) -> Candidates:
    """All branches of an approach direction from those of poses; `sense` as from `roll_sense`."""
    if form.redundancies(POSE)[0].joint != 6:
        T, lower, upper = without_last(problem)
        pose = replace(problem, T=T, task=POSE, values=problem.values[:1], lower=lower, upper=upper)
        found = form.solve(pose)
        last = free_last(problem, found.q)
        return replace(found, values=np.column_stack([found.values, found.q[:, 6]]), arcs=(*found.arcs, last))
    low, high = float(problem.lower[6]), float(problem.upper[6])
    roll, value = problem.values
    if math.isnan(value):
        value = min(max(float(problem.seed[6]), low), high)
    seed, lower, upper = problem.seed.copy(), problem.lower.copy(), problem.upper.copy()
    seed[6], lower[6], upper[6] = value - sense * problem.seed_roll, -UNBOUNDED, UNBOUNDED
    found = form.solve(
        replace(
            problem, task=POSE, values=(value - sense * roll,), seed=seed, lower=lower, upper=upper, weight=0.0
        )
    )
    last = free_last(problem, found.q)
    values = np.column_stack([wrapped(sense * (value - found.values[:, 0])), found.q[:, 6]])
    further = found.further
    return replace(
        found,
        values=values,
        arcs=(_rolls(found.arcs[0], value, sense), last),
        further=None if further is None else lambda: _angles(further(), value, sense),
    )


def _rolls(arcs: Array, value: float, sense: float) -> Array:
    """Intervals ``(k, 3)`` of the difference θ − φ as intervals of φ."""
    ends = np.sort(sense * (value - arcs[:, 1:]), axis=1)
    return np.column_stack([arcs[:, :1], ends])


def _angles(found: Array, value: float, sense: float) -> Array:
    """Intervals ``(k, 2)`` of the difference θ − φ as intervals of φ in [−π, π]; one across ±π is given as two."""
    ends = np.sort(sense * (value - found), axis=1)
    low = wrapped(ends[:, :1])
    whole = np.hstack([low, low + np.minimum(np.diff(ends), TURN)])
    over = whole[whole[:, 1] > math.pi, 1] - TURN
    return np.concatenate([np.minimum(whole, math.pi), np.column_stack([np.full(len(over), -math.pi), over])])
