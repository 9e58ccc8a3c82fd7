"""Tables as entered with seven joints: branches, feasible intervals and choices are those of the table as it is.

The family gives the structure, the table as entered the numbers. First the ends of the intervals are moved from
the nominal arm to the table as entered (:mod:`kin.solvers.rounded.ends`). If the structure is in doubt, the
self-motions of the table as entered are followed (:mod:`kin.solvers.selfmotion.tracing`). Then each branch gets
its row strictly inside the interval, with the redundancy parameter held (:mod:`kin.solvers.rounded.rows`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN, apart, wrapped
from kin.axes import size
from kin.fk import jacobian
from kin.robot import Robot
from kin.solvers import rolled
from kin.solvers.canonical import OFFSET, UPPER_ARM, at_every_turn, turn_around
from kin.solvers.contract import APPROACH, POSE, BatchKernels, Candidates, ClosedForm, Completeness, SolverInput
from kin.solvers.reversed import ReversedJoints
from kin.solvers.rounded.closed_form import Flags, Rounded
from kin.solvers.rounded.ends import joined, move_ends
from kin.solvers.rounded.rows import choose_rows, move_rows
from kin.solvers.selfmotion.following import Motions
from kin.solvers.selfmotion.points import FRAME, JOINT, MOST, OFF, SETTING, SPAN, WANTED, set_frame
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_WIDER, _MOST = 50.0, 0.1  # times the rounding, rad at most: how far limits are moved, to see what changes
_REACH = 10.0  # times the rounding: the same for lengths
_MOVED, _MOVED_BY = 0.1, 100.0  # rad, or times the rounding: a row that moves farther has left the posture
_ENDS, _MIDDLE = np.array([0.0, 1.0]), np.array([0.5])  # shares of an interval
_SHARES = np.array([0.5, 0.02, 0.98])  # where curves are begun
_ALIKE = 1e-7  # rad: intervals with ends this close are one
_ASIDE, _BESIDE = 3.0, 10.0  # times the root of the rounding, and the rounding: from a fold
_BESIDE_VALUE = np.outer(4.0 ** np.arange(-1, 5), (-1.0, 1.0)).ravel()  # times the rounding: where rows are begun
_CLEAR = 0.5  # of the distance of the next row: closer than that, a posture is of the branch of the nearest row
_SAME = 1e-8  # rad: postures this close are one
_FREE = (math.nan,)


class Rounded7(Rounded):
    """The closed form of the nominal arm with seven joints, and every number on the table as entered."""

    def __init__(self, robot: Robot, form: ClosedForm, off: float) -> None:
        parameter = form.redundancies(POSE)[0]
        plain = form.form if isinstance(form, ReversedJoints) else form
        self._joint, self._params = parameter.joint, plain.kernels.params
        self._setting = np.zeros(SETTING)
        self._setting[[JOINT, OFF, MOST]] = self._joint, off, max(_MOVED, _MOVED_BY * off)
        if self._joint < 0:
            self._setting[FRAME : FRAME + 7] = form.signs if isinstance(form, ReversedJoints) else 1.0
            self._setting[FRAME + 7 : FRAME + 16] = self._params[OFFSET : UPPER_ARM + 2]
        super().__init__(robot, form, off)
        self._roll = rolled.roll_sense(robot)
        if form.handles(APPROACH) and form.redundancies(APPROACH) != rolled.parameters(parameter):
            self._roll = 0.0
        reach = _REACH * off * size(robot)
        # The widest one has postures at the very ends of intervals of the wider one, too.
        self._wider, self._narrower, widest = (form.relaxed(by * reach) for by in (1.0, -1.0, 1.5))
        self._start = widest.kernels
        self._move = min(_WIDER * off, _MOST)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, each at the feasible value of the redundancy parameter nearest to the wanted one."""
        if problem.task != POSE:
            return rolled.solve_approach(self, problem, self._roll) if self._roll else super().solve(problem)
        p, j = self._in_one_turn(problem), self._joint
        requested = not math.isnan(p.values[0])
        limits, setting = self._widened(p), self._set(p)
        arcs, places, rows = np.empty((0, 3)), np.empty((0, 3, 7)), np.full((8, 8), math.nan)
        sure, single = True, j >= 0 and bool(p.lower[j] == p.upper[j])
        if single:
            arcs, places = self._single(p, setting)
        elif p.respect_limits or (j >= 0 and not requested):
            arcs, places, rows, known, sure = self._intervals(p, setting, limits)
        if requested or single or not len(arcs) or not p.respect_limits:
            rows, known = self._rows(p)
        if requested:
            moved = np.ascontiguousarray(rows[:, :7])
            self._move_rows(p, setting, moved)
            self._part(p, setting, moved)
            rows[:, :7], rows[:, 7] = moved, np.where(np.isnan(moved[:, 0]), math.nan, p.values[0])
            self._add_from_intervals(p, setting, limits, (arcs, places), rows)
            missed, known = np.isnan(rows[:, 0]), known | _branches_of(arcs[_have(arcs, p.values[0])])
        else:
            bits = choose_rows(self.robot.model, p.T, setting, limits, arcs, places, rows)
            missed = (bits >> np.arange(8)) & 1 > 0
            within = _branches_of(arcs)
            known = within if p.respect_limits else known | within  # a row outside the limits may be lost
        sure &= not (missed & known).any() and not _merged(rows[:, :7]).any()
        gap, obstacle = 0.0, None
        if np.isnan(rows[:, 0]).all():
            none = self.form.solve(p)
            gap, obstacle = none.gap, none.obstacle
        if j >= 0:
            arcs = at_every_turn(arcs, float(problem.lower[j]), float(problem.upper[j]))
        at_best: Completeness = "agreed" if self.form.exact_ranges else "searched"
        return Candidates(rows[:, :7], rows[:, 7:], (arcs,), gap, obstacle, at_best if sure else "unknown")

    def rows_at(self, T: Array, values: Array, near: Array, branches: NDArray[np.intp]) -> Array:
        """One branch at each value, moved onto its target: most of the time goes into moving rows."""
        rows = self.form.rows_at(T, values, near, branches)
        move_rows(self.robot.model, self._params, T, self._setting, values, rows[:, None])
        return rows

    def _in_one_turn(self, problem: SolverInput) -> SolverInput:
        """The same with contiguous arrays, and the limits of the parameter's joint at most one turn apart."""
        j, p = self._joint, problem
        lower, upper = p.lower, p.upper
        if j >= 0 and upper[j] - lower[j] > TURN:
            lower, upper = lower.copy(), upper.copy()
            lower[j], upper[j] = turn_around(float(lower[j]), float(upper[j]), float(p.seed[j]))
        return SolverInput(
            np.ascontiguousarray(p.T), POSE, p.values, p.respect_limits, p.seed, lower, upper, p.seed_roll
        )

    def _set(self, p: SolverInput) -> Array:
        """The setting of a problem."""
        out, j = self._setting.copy(), self._joint
        if j < 0:
            set_frame(self._params, p.T, out[FRAME:])
            out[WANTED] = math.nan
        else:
            low, high = float(p.lower[j]), float(p.upper[j])
            out[SPAN], out[SPAN + 1], out[WANTED] = low, high, min(max(float(p.seed[j]), low), high)
        return out

    def _widened(self, p: SolverInput) -> Array:
        """``(6, 7)`` lower and upper limits: as they are, a little wider, a little narrower.

        Limits a whole turn apart forbid nothing, and narrower ones must not either.
        """
        out, width = np.empty((6, 7)), p.upper - p.lower
        move = np.minimum(self._move, 0.25 * width)
        if self._joint >= 0:
            move[self._joint] = 0.0
        out[0], out[1], out[2], out[3] = p.lower, p.upper, p.lower - move, p.upper + move
        inwards = np.where(width >= TURN, -move, move)
        out[4], out[5] = p.lower + inwards, p.upper - inwards
        return out

    def _rows(self, p: SolverInput) -> tuple[Array, Flags]:
        """Rows ``(8, 8)`` of the nominal arm, with their values, and which exist for certain."""
        found = self.form.solve(p)
        rows = np.column_stack([found.q, found.values])
        missing = np.isnan(rows[:, 0])
        value = p.values[0]
        if missing.any() and self._wider is not self.form and not math.isnan(value):
            more = np.empty(found.q.shape)
            self._start.one(self._start.params, p.T, value, p.seed, more)
            rows[missing, :7], rows[missing, 7] = more[missing], value
        return rows, ~missing

    def _intervals(self, p: SolverInput, setting: Array, limits: Array) -> tuple[Array, Array, Array, Flags, bool]:
        """The intervals of the table as entered, and what choosing rows needs.

        Returns intervals ``(m, 3)``, their postures ``(m, 3, 7)``, rows ``(8, 8)`` of the nominal arm,
        which of these exist for certain, and whether the intervals are certain.
        """
        wide, narrow = (
            form.solve(SolverInput(p.T, POSE, _FREE, p.respect_limits, p.seed, limits[k], limits[k + 1]))
            for form, k in ((self._wider, 2), (self._narrower, 4))
        )
        outer, inner = self._joined(wide.arcs[0]), self._joined(narrow.arcs[0])
        arcs, sure, places = np.empty(outer.shape), np.empty(8), np.empty((len(outer), 3, 7))
        merged = _merged(wide.q)
        known = np.concatenate([outer, inner])
        ends = self._postures(p, known, _ENDS)
        move_ends(self.robot.model, p.T, setting, limits, known, ends, places, arcs, sure)
        certain = True
        if not sure.all():
            moved = arcs, places, sure
            arcs, places, certain = self._traced(p, setting, limits, outer, inner, merged, moved)
        inside = np.isnan(places[:, 2, 0])
        if inside.any():
            places[inside, 2] = self._postures(p, arcs[inside], _MIDDLE)[:, 0]
        rows = np.empty((8, 8))
        rows[:, :7], rows[:, 7:] = wide.q, wide.values
        rows[merged] = math.nan  # of two branches, which only its intervals tell apart
        return arcs, places, rows, ~np.isnan(narrow.q[:, 0]), certain

    def _joined(self, arcs: Array) -> Array:
        """The same intervals, those of an angle joined where they touch."""
        if self._joint >= 0:
            return arcs.copy()
        out = np.empty(arcs.shape)
        return out[: joined(np.ascontiguousarray(arcs), out)]

    def _postures(self, p: SolverInput, arcs: Array, shares: Array) -> Array:
        """Postures ``(m, k, 7)`` of the nominal arm at shares ``(k,)`` of intervals ``(m, 3)``."""
        m, k = len(arcs), len(shares)
        if not m:
            return np.empty((0, k, 7))
        values = (arcs[:, 1:2] + shares * (arcs[:, 2:] - arcs[:, 1:2])).ravel()
        branch = np.repeat(arcs[:, 0].astype(int), k)
        return np.asarray(self._all_at(p, values)[np.arange(m * k), branch].reshape(m, k, 7))

    def _all_at(self, p: SolverInput, values: Array) -> Array:
        """Rows ``(k, 8, 7)`` of the nominal arm, of all branches at values ``(k,)`` of the parameter."""
        T = np.empty((len(values), 4, 4))
        T[:] = p.T
        out = np.empty((len(values), 8, 7))
        self._start.many(self._start.params, T, values, p.seed, out)
        return out

    def _move_rows(self, p: SolverInput, setting: Array, rows: Array) -> None:
        """Move rows ``(8, 7)`` onto the target at the requested value, in place."""
        move_rows(self.robot.model, self._params, p.T[None], setting, np.array(p.values[:1]), rows[None])

    def _part(self, p: SolverInput, setting: Array, rows: Array) -> None:
        """Rows ``(8, 7)`` at the requested value that two branches share, each moved to its own posture, in place.

        Between the folds of the two tables the nominal arm has one row for the two branches, and the table
        as entered has two: each is begun where the nominal arm has two, on either side of that value.
        """
        shared = _merged(rows)
        if self._joint < 0 or not shared.any():
            return
        for starts in self._all_at(p, p.values[0] + self.off * _BESIDE_VALUE):
            starts[~shared | _merged(starts)] = math.nan
            self._move_rows(p, setting, starts)
            own = shared & ~_merged(starts) & ~np.isnan(starts[:, 0])
            if own.sum() > 1:
                rows[own] = starts[own]
                shared = _merged(rows)
            if not shared.any():
                return

    def _add_from_intervals(
        self, p: SolverInput, setting: Array, limits: Array, intervals: tuple[Array, Array], rows: Array
    ) -> None:
        """Rows ``(8, 8)`` at the requested value that are missing or shared, from intervals with it, in place.

        Beside a fold the row of the table as entered may be farther from the nominal one than a row may move.
        """
        arcs, places = intervals
        sought = np.isnan(rows[:, 0]) | _merged(rows[:, :7])
        if not sought.any() or not len(arcs):
            return
        here = sought[arcs[:, 0].astype(int)] & _have(arcs, p.values[0])
        if here.any():
            spans, found = arcs[here], np.full((8, 8), math.nan)
            spans[:, 1:] = p.values[0]
            choose_rows(self.robot.model, p.T, setting, limits, spans, places[here], found)
            there = ~np.isnan(found[:, 0])
            rows[there] = found[there]

    def _single(self, p: SolverInput, setting: Array) -> tuple[Array, Array]:
        """The intervals of a joint that has one value only, and their postures."""
        value = float(p.lower[self._joint])
        p = replace(p, values=(value,))
        q = np.ascontiguousarray(self._rows(p)[0][:, :7])
        self._move_rows(p, setting, q)
        half = 0.5 * (p.upper - p.lower)
        middle = np.add(p.lower, half, where=np.isfinite(half), out=np.zeros_like(half))
        off = np.abs(wrapped(q - middle))
        inside = np.flatnonzero(((off <= half + TOLERANCES.limit) | (half >= math.pi)).all(axis=1))
        arcs = np.column_stack([inside, np.full((len(inside), 2), value)]).astype(np.float64)
        return arcs, np.repeat(q[inside][:, None], 3, axis=1)

    def _traced(
        self,
        p: SolverInput,
        setting: Array,
        limits: Array,
        outer: Array,
        inner: Array,
        merged: Flags,
        moved: tuple[Array, Array, Array],
    ) -> tuple[Array, Array, bool]:
        """Intervals and postures as in `moved`, but by following the curves where it is in doubt; whether certain.

        A curve begins inside each interval that such a branch has with wider or with narrower limits, and at the
        ends of the wider ones; on both sides of a fold where two branches have `merged` ``(8,)``.
        """
        sure = moved[2][moved[0][:, 0].astype(int)] > 0.0
        arcs, places, certain = [(a, b, c) for a, b, c in moved[0][sure].tolist()], list(moved[1][sure]), True
        motions = Motions(self.robot.model, p.T, setting, limits, 3.0 * self._move)
        for intervals, shares in ((inner, _MIDDLE), (outer, _SHARES)):
            doubtful = intervals[moved[2][intervals[:, 0].astype(int)] == 0.0]
            values = (doubtful[:, 1:2] + shares * (doubtful[:, 2:] - doubtful[:, 1:2])).ravel().tolist()
            owners = list(zip(np.repeat(doubtful[:, 0], len(shares)).tolist(), values, strict=True))
            starts = self._postures(p, doubtful, shares).reshape(-1, 7)
            there = (~np.isnan(starts[:, 0])).tolist()
            begun = [i for i, owner in enumerate(owners) if there[i] and not _is_known(arcs, *owner)]
            whose = np.array([owners[i][0] for i in begun], dtype=np.int64)
            starts = self._beside_folds(starts[begun], merged[whose])
            if not len(starts):
                continue
            pieces, postures, lost = motions.follow(starts)
            branches, clear = self._whose(p, pieces, postures)
            certain &= clear
            for branch, piece, posture in zip(branches, pieces.tolist(), postures, strict=True):
                for ends in self._in_span(p, *piece[:2]):
                    if not any(branch == b and _are_alike(ends, (x, y)) for b, x, y in arcs):
                        arcs.append((branch, *ends))
                        places.append(posture.copy())
            certain &= not lost[len(begun) :].any()
            certain &= all(_is_known(arcs, *owners[begun[i]]) for i in np.flatnonzero(lost[: len(begun)]).tolist())
        found_arcs = np.array(arcs).reshape(-1, 3)
        return found_arcs, np.array(places).reshape(-1, 3, 7), certain and not _overlap(found_arcs)

    def _beside_folds(self, starts: Array, merged: Flags) -> Array:
        """Postures ``(k, 7)``, and two more for each where branches have merged: to either side of that fold."""
        if not merged.any():
            return starts
        at = starts[merged]
        across = np.linalg.svd(jacobian(self.robot, at))[2][:, 5]
        step = _ASIDE * math.sqrt(self.off) * across
        return np.concatenate([starts, at + step, at - step])

    def _whose(self, p: SolverInput, values: Array, postures: Array) -> tuple[list[float], bool]:
        """The branches of pieces with these values ``(k, 3)`` and postures ``(k, 3, 7)``; whether all are clear.

        That of a piece is the one of the nearest row of the nominal arm, where the next one is farthest
        away: at a fold two branches meet, and the signs that name them may differ between the two tables. If all
        its postures are beside rows of two branches that have merged, the one farthest from there names it.
        """
        k = np.arange(len(values))
        rows = self._all_at(p, values.ravel()).reshape(-1, 3, 8, 7)
        away = apart(rows, postures[:, :, None])
        away[np.isnan(away)] = math.inf
        first = away.argmin(axis=2)
        nearest, next_one = np.moveaxis(np.partition(away, 1, axis=2)[:, :, :2], 2, 0)
        known = np.isfinite(nearest)
        share = np.divide(nearest, np.maximum(next_one, 1e-300), out=np.full(nearest.shape, math.inf), where=known)
        best = share.argmin(axis=1)
        branches, clear = first[k, best].tolist(), share[k, best] < _CLEAR
        merged = known & (next_one < nearest + _SAME)
        for i in np.flatnonzero(~clear).tolist():
            if merged[i].any():  # the signs of a posture tell which, far enough from the fold
                b = int(np.where(merged[i], nearest[i], -1.0).argmax())
                branches[i], clear[i] = self.branch_of(postures[i, b]), nearest[i, b] > _BESIDE * self.off
            elif known[i].any():
                clear[i] = branches[i] == self.branch_of(postures[i, best[i]])
            else:
                branches[i] = self.branch_of(postures[i, 2])
        return branches, bool(clear.all())

    def _in_span(self, p: SolverInput, low: float, high: float) -> list[tuple[float, float]]:
        """An interval at the whole turn at which the range of the parameter has it; parts, where that ends inside.

        An arm angle begins in (−π, π] and may go on beyond.
        """
        j = self._joint
        first, last = (float(p.lower[j]), float(p.upper[j])) if j >= 0 else (-math.pi, math.pi)
        if j < 0 or last - first < TURN - _ALIKE:
            shift = TURN * math.floor((0.5 * (low + high) - first) / TURN)
            return [(low - shift, high - shift)]
        if high - low > TURN - _ALIKE:
            return [(first, last)]
        shift = TURN * math.floor((low - first + _ALIKE) / TURN)
        low, high = max(low - shift, first), high - shift
        return [(low, min(high, last))] if high < last + _ALIKE else [(low, last), (first, high - TURN)]

    def _kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels: those of the family, and each row moved onto the target on the table as entered."""
        model, params, setting = self.robot.model, self._params, self._setting

        def many(_: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            form.many(form.params, T, values, near, out)
            move_rows(model, params, T, setting, values, out)

        return BatchKernels.of_many(form.params, many)


def _merged(rows: Array) -> Flags:
    """Which of the rows ``(8, 7)``, NaN where a branch has none, are the posture of another branch, too."""
    return np.asarray((apart(rows[:, None], rows) < _SAME).sum(axis=1) > 1)


def _have(arcs: Array, value: float) -> Flags:
    """Which intervals ``(m, 3)`` have a value, at some whole turn."""
    return np.asarray((value - arcs[:, 1]) % TURN <= arcs[:, 2] - arcs[:, 1])


def _overlap(arcs: Array) -> bool:
    """Whether a branch has a value in two of the intervals ``(m, 3)``: then one of them is another branch's."""
    branch, low, high = arcs.T
    both = (branch[:, None] == branch) & ((low[:, None] - low) % TURN < (high - low - _ALIKE))
    np.fill_diagonal(both, False)
    return bool(both.any())


def _branches_of(arcs: Array) -> Flags:
    """Which of the eight branches have an interval ``(m, 3)``."""
    found = np.zeros(8, dtype=bool)
    found[arcs[:, 0].astype(int)] = True
    return found


def _is_known(arcs: list[tuple[float, float, float]], branch: float, value: float) -> bool:
    """Whether a value is in one of the intervals (branch, low, high), at some whole turn."""
    return any(whose == branch and (value - low) % TURN <= high - low for whose, low, high in arcs)


def _are_alike(a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether two intervals of an angle have the same ends."""
    return abs(math.remainder(a[0] - b[0], TURN)) < _ALIKE and abs(a[1] - a[0] - b[1] + b[0]) < _ALIKE
