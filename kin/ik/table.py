"""Answers to many targets as arrays: what takes longest of a whole answer is to make its objects.

Most answers of an arm without a redundancy parameter differ in numbers only: the solutions are isolated, the best
one is at no singularity, and everything else follows from how many there are. One compiled pass finds these
targets and writes their solutions into arrays. To have all of such an answer, make it once, for one target
of each *kind*, and copy it for the others. All other targets are answered one by one, as :func:`kin.ik.solve`
does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kin.axes import size
from kin.ik.answers import answer
from kin.ik.branches import limits_of
from kin.ik.candidates import Requirement, Rows, Whole, measure_and_sort, to_image
from kin.ik.options import IKOptions
from kin.ik.problem import IKProblem, never_cancel, prepare, read_poses
from kin.ik.results import IKResult
from kin.kernels.compile import jit
from kin.robot import Robot
from kin.solvers.contract import ClosedForm
from kin.solvers.curves import isolated, nearly_singular
from kin.tolerances import TOLERANCES
from kin.transforms import Array

AT_ONCE = 256  # targets of one compiled call
_POSTURES = 64  # more than an answer has


@dataclass(frozen=True, eq=False)
class Table:
    """The answers to many targets.

    Attributes:
        kinds: ``(k,)`` −1 where only `result` tells the answer; elsewhere answers of one kind are the same but for
            the numbers below. The status is "solved".
        count: ``(k,)`` how many solutions are listed, at most as many as were asked for.
        q: ``(k, m, n)`` the solutions of each target in their order, as far as `count` says.
        branch: ``(k, m)`` their branches, as indices into `branches`.
        figures: ``(k, m, 5)`` their statistics, columns as in :mod:`kin.ik.candidates`.
        branches: the names of the branches.
    """

    kinds: Whole
    count: Whole
    q: Array
    branch: Whole
    figures: Array
    branches: tuple[str, ...]
    _problem_at: Callable[[int], IKProblem]

    def result(self, i: int) -> IKResult:
        """The answer to target i as `kin.ik.solve` gives it."""
        return answer(self._problem_at(i))

    @classmethod
    def of(
        cls,
        robot: Robot,
        T: Array,
        options: IKOptions,
        seeds: Array | None = None,
        cancel: Callable[[], None] = never_cancel,
    ) -> Table:
        """The answers to poses of the tool ``(k, 4, 4)``.

        Args:
            robot, options: as in `kin.ik.solve`.
            T: the poses, metres.
            seeds: ``(k, n)``, checked; the home configuration by default.
            cancel: called now and then; raises to cancel.

        Raises:
            InputError: a malformed target (named ``targets[i]``), or an option that does not fit the arm.
        """
        prepared = prepare(robot, options)
        poses, errors = read_poses(T, prepared.code, always=robot.n < 6)
        near = prepared.seed[None] if seeds is None else seeds
        last = len(near) - 1

        def problem_at(i: int) -> IKProblem:
            cancel()
            return prepared.at(poses[i], float(errors[i]), near[min(i, last)])

        form = _table_form(prepared)
        width = 0 if form is None else len(form.branches)
        most = width if options.max_solutions is None else min(width, options.max_solutions)
        k = len(poses)
        kinds, count, branch = np.full(k, -1), np.zeros(k, dtype=np.int64), np.zeros((k, most), dtype=np.int64)
        q, figures = np.empty((k, most, robot.n)), np.empty((k, most, 5))
        table = cls(kinds, count, q, branch, figures, () if form is None else form.branches, problem_at)
        if form is not None:
            for start in range(0, k, AT_ONCE):
                cancel()
                table._fill(prepared, form, poses, near, slice(start, start + AT_ONCE))
            kinds[errors != 0.0] = -1
        return table

    def _fill(self, prepared: IKProblem, form: ClosedForm, poses: Array, seeds: Array, some: slice) -> None:
        """The rows of some targets."""
        T, near = np.ascontiguousarray(poses[some]), seeds if len(seeds) == 1 else seeds[some]
        rows = np.empty((len(T), len(form.branches), prepared.robot.n))
        form.solve_many(T, near, *limits_of(prepared), rows)
        names = np.array([form.branches.index(name) for name in form.branches])
        free = prepared.free if isolated(prepared.code, prepared.free) else prepared.free[:0]
        out = self.kinds[some], self.count[some], self.q[some], self.branch[some], self.figures[some]
        _tabulate(prepared.requirement, T, near, rows, names, size(prepared.robot), free, out)
        for i in np.flatnonzero(out[0] >= 0).tolist():
            if form.singularities(out[2][i, 0], TOLERANCES.at_singularity):
                out[0][i] = -1


def _table_form(problem: IKProblem) -> ClosedForm | None:
    """The closed form whose answers to a prepared problem can be listed by number; None if there is none.

    It finds all solutions of this task in microseconds, and no option chooses among them but the distance to the
    seed.
    """
    options, form = problem.options, problem.closed_form
    if form is None or problem.code not in form.quick or options.avoids:
        return None
    if not options.prefer == options.images == "nearest" or options.redundancy is not None:
        return None
    return form if problem.branches is None and all(p.rare for p in problem.redundancies) else None


@jit
def _tabulate(
    requirement: Requirement, T: Array, seeds: Array, rows: Array, names: Whole, scale: float, free: Whole,
    out: tuple[Whole, Whole, Array, Whole, Array],
) -> None:  # fmt: skip
    """out: kinds, count, q, branch, figures of a `Table` ← what it says of targets T ``(k, 4, 4)``.

    rows ``(k, branches, n)``: the branches of each, brought to their best images. seeds ``(k, n)``, or ``(1, n)``
    for all. names ``(branches,)``: for each branch the first one with its name. scale, free: as in
    `nearly_singular`; no joints if solutions on a curve are as good as others.
    """
    kinds, count, q, branch, figures = out
    width, n = rows.shape[1], rows.shape[2]
    stats, order = np.empty((width, 5)), np.empty(width, dtype=np.int64)
    closed, good = np.empty(width, dtype=np.bool_), np.empty(width, dtype=np.bool_)
    ordered = np.empty((width, n))
    last = seeds.shape[0] - 1
    for i in range(T.shape[0]):
        seed = seeds[min(i, last)]
        for k in range(width):  # what the limits refuse need not be measured
            if to_image(requirement, seed, seed, rows[i, k])[1] > 0.0 and requirement.respect:
                rows[i, k, 0] = math.nan
        found = measure_and_sort(requirement, T[i], seed, seed, Rows(rows[i], stats, closed, good, order))
        on_seed = found < 0
        found = max(found, 0)
        postures = 0
        for k in range(found):
            new = True
            for j in range(k):
                new = new and names[order[j]] != names[order[k]]
            postures += new
            for c in range(n):
                ordered[k, c] = rows[i, order[k], c]
        kinds[i] = _POSTURES * found + postures
        suspect = 0
        if free.shape[0] > 0:
            suspect = nearly_singular(requirement.model, requirement.task, scale, free, ordered[:found])
        if found == 0 or suspect != 0 or on_seed:
            kinds[i] = -1
        count[i] = min(found, q.shape[1])
        for k in range(count[i]):
            branch[i, k] = order[k]
            for c in range(n):
                q[i, k, c] = ordered[k, c]
            for c in range(5):
                figures[i, k, c] = stats[order[k], c]
