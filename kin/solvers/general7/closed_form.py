"""The solver of any seven revolute joints: the choice of the given joint, solutions, ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kin.angles import TURN, apart, wrapped
from kin.axes import frame_of, inverse, lines_of, perpendicular_to
from kin.robot import Robot
from kin.solvers import rolled
from kin.solvers.canonical import turn_around
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Completeness,
    RedundancyParameter,
    SolverInput,
    weakest,
)
from kin.solvers.general7.motion import nearest_on_motion, to_images
from kin.solvers.reduced import fixed
from kin.solvers.reversed import WrappedKernels
from kin.solvers.selfmotion.tracing import end_of_motion
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "general7"
TITLE = "all solutions, seven revolute joints of which one is given"
_SCAN = 64  # values that are tried where the nearest solution, or any feasible one, is looked for
# Samples of a turn for the ranges of all solutions, and between two of them where solutions come close to the
# limits; how close (rad, all joints together); motion between two samples that counts as going on (rad).
_SAMPLES, _FINER, _CLOSE, _SAME_MOTION = 144, 12, 0.3, 0.3
# Of the search for the nearest solution: parts of what is between two values where it is looked at closely, how
# near what is there has to be, self-motions that are followed, how far from those before they begin, and how much
# farther from the seed than the nearest one (rad).
_PARTS, _NEARER, _DOWNHILL, _SAME_START, _BEYOND = 6, 0.3, 12, 0.2, 1.0


Match = Callable[[Robot], ClosedForm | None]


def match(robot: Robot, form_of: Match, family_of: Match) -> General7 | None:
    """The solver with the last joint given, or the first one if only that leaves an arm with a closed form.

    Args:
        form_of: gives the solver of an arm with six joints.
        family_of: gives it only if the arm fits a family, in less time.
    """
    if robot.n != 7 or not robot.revolute.all():
        return None
    without_last, without_first = (fixed(robot, {joint: 0.0}) for joint in (6, 0))
    last = form_of(without_last)
    if last is not None and last.named:
        return General7(robot, 6, last)
    if first := family_of(without_first) if last is not None else form_of(without_first):
        return General7(robot, 0, first)
    return None if last is None else General7(robot, 6, last)


def _is_beside(q: Array, start: Array, end: Array) -> bool:
    """Whether a configuration is near the segment between two others."""
    along, to = end - start, q - start
    share = min(max(float(to @ along) / max(float(along @ along), 1e-12), 0.0), 1.0)
    return bool(np.abs(to - share * along).max() < _SAME_START)


class Fold:
    """Moves a rotation about the first or last joint's axis into the target.

    Attributes:
        joint, last: that joint, and whether it is the last one.
        others: the other joints.
        axis, back: the frame of its axis, and the inverse ``(4, 4)``: in the tool's frame for the last joint, in
            the base frame for the first.
    """

    def __init__(self, robot: Robot, joint: int) -> None:
        lines = lines_of(robot, as_counted=True)
        z = lines.z[joint]
        axis = frame_of(perpendicular_to(z), z, lines.points[joint])
        self.joint, self.last = joint, joint > 0
        self.others = [i for i in range(robot.n) if i != joint]
        self.axis = inverse(lines.T_base_tool) @ axis if self.last else axis
        self.back = inverse(self.axis)

    def targets(self, T: Array, values: Array) -> Array:
        """Targets ``(N, 4, 4)`` of the arm whose joint is at 0, with the joint of the arm at values ``(N,)``."""
        turn = np.zeros((len(values), 4, 4))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(values)
        turn[:, 0, 1] = np.sin(values)
        turn[:, 1, 0] = -turn[:, 0, 1]
        turn[:, 2, 2] = turn[:, 3, 3] = 1.0
        whole = self.axis @ turn @ self.back
        return np.ascontiguousarray(T @ whole if self.last else whole @ T)

    def kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels of the arm from those of the six joints."""

        def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            value = np.where(np.isnan(values), near[self.joint], values)
            value = np.ascontiguousarray(np.broadcast_to(value, len(T)))
            rows = np.empty((*out.shape[:2], len(self.others)))
            form.many(params, self.targets(T, value), np.array([math.nan]), near[self.others].copy(), rows)
            out[..., self.others] = rows
            out[..., self.joint] = np.where(np.isnan(rows[..., 0]), math.nan, value[:, None])

        def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
            many(params, T[None], np.array([value]), near, out[None])
            return bool(np.isfinite(T).all())

        return WrappedKernels(form.params, one, many, self.kernels, form)


class General7(ClosedForm):
    """All solutions of an arm with seven revolute joints for a given value of its last or first joint.

    Attributes:
        given: that joint.
        form: the solver of the other six.
        fold: moves its rotation into their target.
    """

    name, title = NAME, TITLE
    lengths = ()
    named = steady = exact_ranges = False

    def __init__(self, robot: Robot, joint: int, form: ClosedForm) -> None:
        self.robot, self.given, self.form, self.off = robot, joint, form, form.off
        self.reason = (
            f"seven revolute joints whose axes fit no closed form; joint {joint + 1} is given ({form.name})"
        )
        self.branches = tuple(f"solution {i + 1}" for i in range(len(form.branches)))
        self.fold = Fold(robot, joint)
        self.kernels = self.fold.kernels(form.kernels)
        self._roll = rolled.roll_sense(robot)
        self._parameter = RedundancyParameter(f"theta{joint + 1}", f"θ{joint + 1}", joint=joint)

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction along the last joint's axis."""
        return task == POSE or (task == APPROACH and self._roll != 0.0)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The given joint; for an approach direction the roll or the last joint as well."""
        return rolled.parameters(self._parameter) if task == APPROACH else (self._parameter,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All solutions at one value of the given joint, requested or that of the nearest one, and their ranges.

        Where none is found inside the limits, the feasible value nearest to the seed's is looked for.
        """
        if problem.task == APPROACH:
            return rolled.solve_approach(self, problem, self._roll)
        p, requested = problem, problem.values[0]
        low, high = float(p.lower[self.given]), float(p.upper[self.given])
        value = min(max(float(p.seed[self.given]), low), high) if math.isnan(requested) else requested
        if math.isnan(requested):
            value = self._value_of_nearest(p, value)
        out = self._at(p, np.array([value]))[0]
        if math.isnan(requested) and p.respect_limits and not self._inside(p, out).any():
            value, out = self._nearest_value(p, value, out)
        # All solutions at one value of the given joint: at others there may be further branches.
        known = self._add_missing(p, value, out)
        completeness = weakest(known, "searched") if math.isnan(requested) and low < high else known
        values = np.where(np.isnan(out[:, :1]), math.nan, value)
        arcs = self._ranges(p, out) if p.respect_limits else np.empty((0, 3))
        further = (lambda: self._all_ranges(p)) if p.respect_limits else None
        return Candidates(out, values, (arcs,), completeness=completeness, further=further)

    def _value_of_nearest(self, problem: SolverInput, value: float) -> float:
        """The value of the given joint at the solution nearest to the seed; `value` if none is found.

        Samples of a turn tell where solutions are; from the nearest ones self-motions are followed downhill.
        """
        p, i = problem, self.given
        low, high = turn_around(float(p.lower[i]), float(p.upper[i]), value)
        tried = np.unique(np.append(np.linspace(low, high, _SCAN), value))
        found, lower, upper = self._at(p, tried), *(np.clip(x, -UNBOUNDED, UNBOUNDED) for x in (p.lower, p.upper))
        q = found.reshape(-1, 7)
        squares, outside = np.empty(len(q)), self._outside(p, found)
        away = np.linalg.norm(wrapped(found - p.seed), axis=-1)  # at least
        to_images(q, p.seed, lower, upper, i, squares)
        # Where solutions begin to exist, or come close to the limits, there may be nearer ones between two values.
        near = away < math.sqrt(squares.min()) + _NEARER
        close, there = ((outside > 0.0) & (outside < _CLOSE) & near).any(axis=1), np.isfinite(away).sum(axis=1)
        folds = (there[1:] != there[:-1]) & (near[1:] | near[:-1]).any(axis=1)
        cells = np.flatnonzero(folds | close[1:] | close[:-1])
        shares = np.arange(1, _PARTS) / _PARTS
        more = self._at(p, (tried[cells, None] + np.diff(tried)[cells, None] * shares).ravel()).reshape(-1, 7)
        further = np.empty(len(more))
        to_images(more, p.seed, lower, upper, i, further)
        q, squares = np.concatenate([q, more]), np.concatenate([squares, further])
        best, least = value, math.inf
        walked: list[tuple[Array, Array]] = []
        for k in np.argsort(squares).tolist():
            if not math.sqrt(squares[k]) < math.sqrt(least) + _BEYOND or len(walked) == _DOWNHILL:
                break
            # A start beside a motion that has been followed ends where that one does.
            if any(_is_beside(q[k], *ends) for ends in walked):
                continue
            start = q[k].copy()
            distance = nearest_on_motion(self.robot.model, p.T, i, q[k], p.seed, lower, upper)
            walked.append((start, q[k]))
            if distance < least:
                best, least = float(q[k, i]), distance
        return best

    def _at(self, problem: SolverInput, values: Array) -> Array:
        """All solutions ``(N, rows, 7)`` at these values of the given joint."""
        out = np.empty((len(values), len(self.branches), 7))
        T = np.ascontiguousarray(np.broadcast_to(problem.T, (len(values), 4, 4)))
        self.kernels.many(self.kernels.params, T, values, problem.seed, out)
        return out

    def _add_missing(self, problem: SolverInput, value: float, out: Array) -> Completeness:
        """Add to solutions ``(rows, 7)`` what the solver of six joints finds besides; how complete they are."""
        others = self.fold.others
        q, T = np.ascontiguousarray(out[:, others]), self.fold.targets(problem.T, np.array([value]))[0]
        completeness = self.form.add_missing(T, problem.seed[others], q)
        out[:, others] = q
        out[:, self.given] = np.where(np.isnan(q[:, 0]), math.nan, value)
        return completeness

    def _outside(self, problem: SolverInput, q: Array) -> Array:
        """How far configurations ``(..., 7)`` are outside the limits, in all; ∞ for those that do not exist."""
        half = 0.5 * (problem.upper - problem.lower)
        middle = np.add(problem.lower, half, where=np.isfinite(half), out=np.zeros_like(half))
        off = np.abs(wrapped(q - middle)) - half - TOLERANCES.limit
        total = np.maximum(off, 0.0).sum(axis=-1)
        return np.where(np.isnan(total), math.inf, total)

    def _inside(self, problem: SolverInput, q: Array) -> Array:
        return np.asarray(self._outside(problem, q) == 0.0)

    def _nearest_value(self, problem: SolverInput, value: float, out: Array) -> tuple[float, Array]:
        """The feasible value nearest to `value`, and the solutions there; else those least outside the limits."""
        low, high = turn_around(float(problem.lower[self.given]), float(problem.upper[self.given]), value)
        tried = np.linspace(low, high, _SCAN)
        found = self._at(problem, tried)
        miss = self._outside(problem, found).min(axis=1)
        if not np.isfinite(miss).any():
            return value, out
        if miss.min() > 0.0:
            here = float(self._outside(problem, out).min())
            best = int(miss.argmin())
            return (value, out) if here <= miss[best] else (float(tried[best]), found[best])
        best = int(np.where(miss == 0.0, np.abs(tried - value), math.inf).argmin())
        row = found[best, int(self._outside(problem, found[best]).argmin())]
        end = self._end(problem, row, 1.0 if value > tried[best] else -1.0)
        inset = min(TOLERANCES.interval_inset, 0.5 * abs(end - tried[best]))
        nearest = end - math.copysign(inset, end - tried[best])
        there = self._at(problem, np.array([nearest]))[0]
        return (nearest, there) if self._inside(problem, there).any() else (float(tried[best]), found[best])

    def _end(self, problem: SolverInput, row: Array, sense: float) -> float:
        """The end of the self-motion from a solution inside the limits."""
        lower, upper = (np.clip(x, -UNBOUNDED, UNBOUNDED) for x in (problem.lower, problem.upper))
        return float(end_of_motion(self.robot.model, problem.T, self.given, sense, row, lower, upper))

    def _ranges(self, problem: SolverInput, out: Array) -> Array:
        """The range of the given joint around each solution ``(rows, 7)`` that is inside the limits."""
        found = []
        least, most = float(problem.lower[self.given]), float(problem.upper[self.given])
        for i in np.flatnonzero(self._inside(problem, out)).tolist():
            low, high = (self._end(problem, out[i], sense) for sense in (-1.0, 1.0))
            if high - low >= TURN:
                low, high = turn_around(least, most, float(out[i, self.given]))
            found.append((float(i), max(low, least), min(high, most)))
        return np.array(found).reshape(-1, 3)

    def _all_ranges(self, problem: SolverInput) -> Array:
        """The values ``(k, 2)`` of the given joint at which any solution is inside the limits.

        Samples tell where there are solutions; the ends between two samples are found by following self-motions. A
        range between two samples is found if solutions that are outside the limits come close to them there.
        """
        least, most = float(problem.lower[self.given]), float(problem.upper[self.given])
        low, high = turn_around(least, most, float(problem.seed[self.given]))
        if high <= low:
            return np.empty((0, 2))
        values = np.linspace(low, high, 1 + math.ceil(_SAMPLES * (high - low) / TURN))
        found = self._at(problem, values)
        outside = self._outside(problem, found)
        near = outside.min(axis=1)
        finer = [
            np.linspace(values[i - 1], values[i + 1], 2 * _FINER + 1)[1:-1]
            for i in range(1, len(values) - 1)
            if 0.0 < near[i] < _CLOSE and near[i] <= near[i - 1] and near[i] <= near[i + 1]
        ]
        if finer:
            values = np.unique(np.concatenate([values, *finer]))
            found = self._at(problem, values)
            outside = self._outside(problem, found)
        inside = outside == 0.0
        ranges: list[tuple[float, float]] = []
        for i in np.flatnonzero(inside.any(axis=1)).tolist():
            low = high = float(values[i])
            if i > 0:
                low = self._reached(
                    problem, found[i - 1][inside[i - 1]], found[i][inside[i]], float(values[i - 1])
                )
            if i < len(values) - 1:
                high = self._reached(
                    problem, found[i + 1][inside[i + 1]], found[i][inside[i]], float(values[i + 1])
                )
            ranges.append((low, high))
        turns: range | tuple[int, ...] = (0,)
        if most - least < UNBOUNDED:
            turns = range(math.floor((least - values[-1]) / TURN), math.ceil((most - values[0]) / TURN) + 1)
        shifted = [(max(a + k * TURN, least), min(b + k * TURN, most)) for k in turns for a, b in ranges]
        return np.array([(a, b) for a, b in shifted if a <= b]).reshape(-1, 2)

    def _reached(self, problem: SolverInput, there: Array, here: Array, to: float) -> float:
        """How far solutions `here` ``(k, 7)`` go on towards the next value; those there are `there` ``(m, 7)``."""
        start = float(here[0, self.given])
        if len(there) and apart(there[:, None], here).min() < _SAME_MOTION:
            return to
        sense = math.copysign(1.0, to - start)
        lower, upper = problem.lower.copy(), problem.upper.copy()
        lower[self.given], upper[self.given] = min(start, to), max(start, to)
        cell = replace(problem, lower=lower, upper=upper)
        ends = [self._end(cell, row, sense) for row in here]
        return max(ends) if sense > 0.0 else min(ends)

    def branch_of(self, q: Array) -> int:
        """The row of q ``(7,)`` among all solutions of its pose with the same value of the given joint."""
        others = [i for i in range(7) if i != self.given]
        return self.form.branch_of(np.asarray(q)[others])
