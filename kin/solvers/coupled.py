"""Closed forms of arms with rows that follow joints, made of those of their free arms.

In the *free arm* every row moves by itself, and neighbouring rows about one line count as one. With t its values
and q those of the joints, ``t = A q`` (:mod:`kin.joint`), so the configurations of the arm at a pose are
those of the free arm that are of this form. A palletiser has four joints and a free arm with five axes, three of
them parallel. Whole turns need care: t is known but for them, so an n × n part of A is inverted whose inverse
has whole numbers too. The rows of A that are left tell which configurations the joints can make.

This needs ratios that are whole numbers, and a pose that leaves the free arm no freedom; other arms and tasks
are left to numeric descents.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN, images_near
from kin.axes import is_zero
from kin.differential.task import natural_task, task_jacobian, usual_rank
from kin.fk import jacobian
from kin.robot import Joint, Robot
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import POSE, Candidates, ClosedForm, SolverInput
from kin.solvers.reduced import held
from kin.solvers.reversed import kernels_by_solving
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.transforms import Array

Flags = NDArray[np.bool_]
_THETA = re.compile(r"θ(\d)")
_MOST = 8  # axes of a free arm: no closed form has more
APART = 0.05  # rad or m by which a row may miss the value that the joints give it: a target may be rounded
_SINGULAR = 1e-7  # of the largest singular value


def match(robot: Robot, form_of: Callable[[Robot], ClosedForm | None]) -> Coupled | None:
    """The closed form of an arm with rows that follow joints, made of that of its free arm, if there is one."""
    free, A = _free_arm(robot)
    chosen = _invertible(A, robot.revolute, free.revolute) if free.n <= _MOST else None
    if chosen is None:
        return None
    form = form_of(free)
    if form is None or not form.handles(POSE) or form.redundancies(POSE):
        return None
    return Coupled(robot, free, form, A, chosen)


def _free_arm(robot: Robot) -> tuple[Robot, Array]:
    """The free arm, neighbours about one line as one joint, and A ``(m, n)`` of its values ``A q``."""
    rows: list[Joint] = []
    sums: list[Array] = []
    line = -1  # index in `rows` of the last moving row, while the rows after it are about its line
    values = iter(robot.expansion)
    for row in robot.free.rows:
        turned = is_zero(row.a, math.remainder(row.alpha, TURN))
        if robot.convention == "modified" and not turned:
            line = -1
        if row.kind == "fixed":
            rows.append(row)
        elif line >= 0 and rows[line].kind == row.kind:
            sums[-1] = sums[-1] + next(values)
            rows.append(held(row, 0.0))
        else:
            sums.append(next(values))
            line = len(rows)
            rows.append(replace(row, limits=None))
        if robot.convention == "standard" and not turned:
            line = -1
    return replace(robot.free, rows=tuple(rows), home=(0.0,) * len(sums)), np.array(sums)


def _invertible(A: Array, turns: Flags, free_turns: Flags) -> list[int] | None:
    """Rows of A that give the joints' values, whole turns included; None if there are none."""
    mixed = A[np.ix_(free_turns, ~turns)].any() or A[np.ix_(~free_turns, turns)].any()
    if mixed or not np.array_equal(A[free_turns], np.round(A[free_turns])):
        return None
    for rows in combinations(range(len(A)), A.shape[1]):
        part = A[list(rows)]
        turning = part[np.ix_(free_turns[list(rows)], turns)]
        if turning.shape[0] != turning.shape[1] or (
            turning.size and not is_zero(abs(np.linalg.det(turning)) - 1.0)
        ):
            continue
        if abs(np.linalg.det(part)) > 0.0:
            return list(rows)
    return None


class Coupled(ClosedForm):
    """The closed form of an arm with rows that follow joints.

    Attributes:
        free: the arm in which every row moves by itself.
        form: its closed form.
        expansion: A ``(m, n)``.
        chosen, back: the rows of A that give the joints' values, and their inverse ``(n, n)``.
    """

    def __init__(self, robot: Robot, free: Robot, form: ClosedForm, A: Array, chosen: list[int]) -> None:
        self.robot, self.free, self.form = robot, free, form
        self.expansion, self.chosen = A, chosen
        self.back = np.linalg.inv(A[chosen])
        self.back[np.ix_(robot.revolute, free.revolute[chosen])] = np.round(
            self.back[np.ix_(robot.revolute, free.revolute[chosen])]
        )
        self.name, self.title, self.lengths = form.name, form.title, form.lengths
        self.reason = f"{form.reason}; {robot.n} joints move these {free.n} axes"
        self.branches, self.named = form.branches, form.named
        # Of the free arm: an angle that the joints together turn.
        self.meanings = tuple((name, _THETA.sub(r"the angle at axis \1", text)) for name, text in form.meanings)
        self.off = form.off
        self.kernels = kernels_by_solving(self, form.kernels.params)

    def solve(self, problem: SolverInput) -> Candidates:
        """The configurations of the free arm that the joints can make."""
        wide = np.full(self.free.n, UNBOUNDED)
        seed = self.expansion @ problem.seed
        found = self.form.solve(replace(problem, values=(), seed=seed, lower=-wide, upper=wide))
        t = found.q
        q = t[:, self.chosen] @ self.back.T
        apart = t - q @ self.expansion.T
        apart = np.where(self.free.revolute, images_near(apart), apart)
        possible = np.abs(apart).max(axis=1) < APART  # NaN is not
        completeness = found.completeness if self._is_isolated(t) else "unknown"
        q = np.where(possible[:, None], np.where(self.robot.revolute, images_near(q), q), math.nan)
        return Candidates(q, np.empty((len(q), 0)), (), found.gap, found.obstacle, completeness)

    def _is_isolated(self, t: Array) -> bool:
        """Whether the configurations t ``(k, m)`` of the free arm are on no curve: then they are all there are."""
        t = t[~np.isnan(t[:, 0])]
        if not len(t) or self.free.n == self.robot.n:
            return True
        J = jacobian(self.free, np.ascontiguousarray(t))
        J[:, :3] /= self.free.reach or 1.0
        values = np.linalg.svd(J, compute_uv=False)
        return bool((values[:, self.free.n - 1] > _SINGULAR * values[:, 0]).all())

    def branch_of(self, q: Array) -> int:
        """The branch of the free arm."""
        return self.form.branch_of(self.expansion @ q)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The nearest one by its singular value: the free arm's are others."""
        rank = usual_rank(self.robot, natural_task(self.robot))
        return those_within(within, by_jacobian(task_jacobian(self.robot, q), rank))
