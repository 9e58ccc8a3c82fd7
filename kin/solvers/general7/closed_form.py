"""The solver of any seven revolute joints: the choice of the given joint, solutions, ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.angles import TURN, wrapped
from kin.axes import frame_of, inverse, lines_of, perpendicular_to, size
from kin.fk import fk
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
from kin.solvers.general6 import General6
from kin.solvers.general7.motion import nearest_on_motion, to_images
from kin.solvers.reduced import fixed
from kin.solvers.selfmotion.following import Motions
from kin.solvers.selfmotion.points import JOINT, SETTING
from kin.solvers.selfmotion.tracing import end_of_motion
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "general7"
TITLE = "all solutions, seven revolute joints of which one is given"
# Values of a turn at which all solutions are computed, also where a nominal arm has some; how far outside limits
# self-motions are followed (rad); how much wider the nominal arm's limits and reach are (rad, arm sizes).
# With what the nominal arm finds, the tool may be _WIDER off: in arm sizes, and in each entry of its rotation.
_VALUES, _FEWER, _MARGIN, _WIDER, _LONGER = 48, 12, 0.6, 0.1, 0.01
# Of the search for the nearest solution: self-motions that are followed downhill, how far from those before they
# begin, and how much farther from the seed than the nearest one (rad): more than half the way to the next point.
_DOWNHILL, _SAME_START, _BEYOND = 12, 0.2, 0.1

_NONE = np.empty((0, 7))
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
    first = family_of(without_first) or form_of(without_first)
    if last is None or (first is not None and first.named):
        return None if first is None else General7(robot, 0, first)
    form = General7(robot, 6, last)
    if isinstance(first, General6) and isinstance(last, General6) and first.proved > last.proved:
        form.sweeper = General7(robot, 0, first)
    nominal = None if robot.nominal_arm is None else family_of(robot.nominal_arm)
    form.sweeper.nominal = None if nominal is None else nominal.relaxed(_LONGER * size(robot))
    return form


def _beside(q: Array, start: Array, end: Array) -> NDArray[np.bool_]:
    """Which configurations ``(k, 7)`` are near the segment between two others."""
    along, to = end - start, q - start
    share = np.clip((to @ along) / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.abs(to - share[:, None] * along).max(axis=1) < _SAME_START)


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

        return BatchKernels.of_many(form.params, many)


class Sweep(NamedTuple):
    """What all values of a target's redundancy parameter were searched for, and what is there.

    Attributes:
        motions: the self-motions.
        ranges: ``(m, 2)`` values of the sweeper's joint on each piece that keeps the limits, at some whole turn.
            Where the joint turns back, another piece begins.
        inner: ``(m, 7)`` a configuration inside each.
        rows, outside: ``(k, 7)`` all solutions at the values at which they were computed, and ``(k,)`` how far
            each is outside the limits; NaN and ∞ where there is none.
        agreed: whether at each of these values as many solutions keep the limits as motions that were followed do.
    """

    motions: Motions
    ranges: Array
    inner: Array
    rows: Array
    outside: Array
    agreed: bool

    def have(self, q: Array) -> bool:
        """Whether configurations ``(k, 7)`` inside the limits that meet the target are all on the motions."""
        more, _, lost = self.motions.follow(q)
        return not len(more) and not lost.any()


def _counts(ranges: Array, values: Array) -> NDArray[np.int64]:
    """How many ranges ``(m, 2)`` of an angle have each value ``(N,)``."""
    ahead = (values[:, None] - ranges[:, 0] + TOLERANCES.limit) % TURN
    return np.asarray((ahead <= ranges[:, 1] - ranges[:, 0] + 2.0 * TOLERANCES.limit).sum(axis=1))


def _limits(problem: SolverInput) -> Array:
    """Lower and upper limits ``(2, 7)``, finite."""
    return np.clip((problem.lower, problem.upper), -UNBOUNDED, UNBOUNDED)


class General7(ClosedForm):
    """All solutions of an arm with seven revolute joints for a given value of its last or first joint.

    Attributes:
        given: that joint.
        form: the solver of the other six.
        fold: moves its rotation into their target.
        sweeper: searches all values: the same with the joint at the other end given, if that is solved with more
            certainty, or itself.
        nominal: of a calibrated arm the solver of the nominal one, with some more reach.
    """

    name, title = NAME, TITLE
    lengths = ()
    named = steady = exact_ranges = False
    nominal: ClosedForm | None = None

    def __init__(self, robot: Robot, joint: int, form: ClosedForm) -> None:
        self.robot, self.given, self.form, self.off = robot, joint, form, form.off
        self.sweeper = self
        self.reason = (
            f"seven revolute joints whose axes fit no closed form; joint {joint + 1} is given ({form.name})"
        )
        self.branches = tuple(f"solution {i + 1}" for i in range(len(form.branches)))
        self.fold = Fold(robot, joint)
        self.kernels = self.fold.kernels(form.kernels)
        self._roll = rolled.roll_sense(robot)
        self.tasks = (POSE, APPROACH) if self._roll != 0.0 else (POSE,)
        self._parameter = RedundancyParameter(f"theta{joint + 1}", f"θ{joint + 1}", joint=joint)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The given joint; for an approach direction the roll or the last joint as well."""
        return rolled.parameters(self._parameter) if task == APPROACH else (self._parameter,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All solutions at one value of the given joint, requested or the nearest one's, and their ranges."""
        if problem.task == APPROACH:
            return rolled.solve_approach(self, problem, self._roll)
        p, value, sweep = problem, problem.values[0], None
        low, high = float(p.lower[self.given]), float(p.upper[self.given])
        if math.isnan(value) and low == high:
            value = low
        elif math.isnan(value):
            sweep = self.sweeper.sweep(p)
            value = self._value_of_nearest(p, sweep)
        out = self._at(p, np.array([value]))[0]
        known = self._add_missing(p, value, out)
        if sweep is not None:
            agreed = sweep.agreed and sweep.have(out[self._outside(p, out) == 0.0])
            known = weakest(known, "agreed" if agreed else "searched")
        values = np.where(np.isnan(out[:, :1]), math.nan, value)
        arcs = self._ranges(p, out) if p.respect_limits else np.empty((0, 3))
        # Not the sweep itself: answers that are kept would keep the points of all self-motions.
        kept = None if sweep is None else (sweep.ranges.copy(), sweep.inner.copy())
        further = (lambda: self._all_ranges(p, kept)) if p.respect_limits else None
        return Candidates(out, values, (arcs,), completeness=known, further=further)

    def sweep(self, problem: SolverInput) -> Sweep:
        """What is found at values of the given joint, also the seed's, and along the self-motions from there."""
        p, i = problem, self.given
        least, most = float(p.lower[i]), float(p.upper[i])
        low, high = turn_around(least, most, min(max(float(p.seed[i]), least), most))
        known = self._of_nominal(p)
        count = math.ceil((_FEWER if len(known) else _VALUES) * (high - low) / TURN)
        inset = min(TOLERANCES.interval_inset, 0.5 * (high - low))  # a motion is not begun at a limit
        value = min(max(float(p.seed[i]), low + inset), high - inset)
        values = np.unique(np.append(low + (np.arange(count) + 0.5) * ((high - low) / max(count, 1)), value))
        rows = self._at(p, values)
        outside = self._outside(p, rows)
        motions, starts, inside = self._motions(p), rows[outside < _MARGIN], outside == 0.0
        pieces, postures, lost = motions.follow(np.concatenate([starts, known]))
        ranges, complete = pieces[:, :2], inside.any() and not lost[: len(starts)].any()
        agreed = bool(complete and (_counts(ranges, values) == inside.sum(axis=1)).all())
        return Sweep(motions, ranges, postures[:, 2], rows.reshape(-1, 7), outside.ravel(), agreed)

    def _motions(self, problem: SolverInput) -> Motions:
        """The self-motions of a target, none of which has been followed."""
        setting = np.zeros(SETTING)
        setting[JOINT] = self.given
        return Motions(self.robot.model, problem.T, setting, _limits(problem), _MARGIN)

    def _of_nominal(self, problem: SolverInput) -> Array:
        """A configuration ``(k, 7)`` of the nominal arm inside each of its ranges, close to the arm's motions."""
        if self.nominal is None:
            return _NONE
        p, free = problem, (math.nan,)
        lower, upper = p.lower - _WIDER, p.upper + _WIDER
        arcs = self.nominal.solve(replace(p, values=free, respect_limits=True, lower=lower, upper=upper)).arcs[0]
        T = np.ascontiguousarray(np.broadcast_to(p.T, (len(arcs), 4, 4)))
        q = self.nominal.rows_at(T, arcs[:, 1:].mean(axis=1), p.seed, arcs[:, 0].astype(np.intp))
        q = q[~np.isnan(q[:, 0])]
        off = np.abs(fk(self.robot, q) - p.T)
        off[:, :3, 3] /= size(self.robot)
        return q[(off < _WIDER).all(axis=(1, 2))]

    def _value_of_nearest(self, problem: SolverInput, sweep: Sweep) -> float:
        """The value of the given joint at the solution nearest to the seed; motions are followed downhill.

        Where none is inside the limits, that of the solution that is least outside, or the seed's.
        """
        p, i, (lower, upper) = problem, self.given, _limits(problem)
        q = np.concatenate([sweep.rows, sweep.inner, sweep.motions.points])
        squares, least = np.empty(len(q)), math.inf
        to_images(q, p.seed, lower, upper, squares)
        best = float(p.seed[i])
        if squares.min() == math.inf and self.sweeper is not self:
            sweep = self.sweep(p)  # at values of the given joint inside its limits
        if squares.min() == math.inf > sweep.outside.min():
            best = float(sweep.rows[sweep.outside.argmin(), i])
        for _ in range(_DOWNHILL):
            k = int(squares.argmin())
            if not math.sqrt(squares[k]) < math.sqrt(least) + _BEYOND:
                break
            end = q[k].copy()
            distance = nearest_on_motion(self.robot.model, p.T, i, end, p.seed, lower, upper)
            if distance < least:
                best, least = float(end[i]), distance
            # A start beside a motion that has been followed ends where that one does.
            near = np.flatnonzero(squares < (math.sqrt(least) + _BEYOND) ** 2)
            squares[near[_beside(q[near], q[k], end)]] = math.inf
        return min(max(best, float(p.lower[i])), float(p.upper[i]))

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

    def _end(self, problem: SolverInput, row: Array, sense: float) -> float:
        """The end of the self-motion from a solution inside the limits."""
        return float(end_of_motion(self.robot.model, problem.T, self.given, sense, row, *_limits(problem)))

    def _ranges(self, problem: SolverInput, out: Array) -> Array:
        """The range of the given joint around each solution ``(rows, 7)`` that is inside the limits."""
        found = []
        least, most = float(problem.lower[self.given]), float(problem.upper[self.given])
        for i in np.flatnonzero(self._outside(problem, out) == 0.0).tolist():
            low, high = (self._end(problem, out[i], sense) for sense in (-1.0, 1.0))
            if high - low >= TURN:
                low, high = turn_around(least, most, float(out[i, self.given]))
            found.append((float(i), max(low, least), min(high, most)))
        return np.array(found).reshape(-1, 3)

    def _all_ranges(self, problem: SolverInput, kept: tuple[Array, Array] | None) -> Array:
        """The values ``(k, 2)`` of the given joint at which any solution is inside the limits.

        Args:
            kept: `ranges` and `inner` of the target's `Sweep`, None if it has not been searched.
        """
        p, i = problem, self.given
        ranges, inner = kept or self.sweeper.sweep(p)[1:3]
        if self.sweeper is not self:
            pieces, _, lost = self._motions(p).follow(inner)
            ranges = pieces[:, :2]
            if lost.any():
                ranges = np.concatenate([ranges, self.sweep(p).ranges])
        least, most = float(p.lower[i]), float(p.upper[i])
        if not len(ranges):
            return ranges
        if not most - least < UNBOUNDED:
            least, most = turn_around(least, most, float(p.seed[i]))
        first, last = math.floor((least - ranges.max()) / TURN), math.ceil((most - ranges.min()) / TURN)
        turned = (ranges + TURN * np.arange(first, last + 1)[:, None, None]).reshape(-1, 2)
        return np.clip(turned[(turned[:, 0] <= most) & (turned[:, 1] >= least)], least, most)

    def branch_of(self, q: Array) -> int:
        """The row of q ``(7,)`` among all solutions of its pose with the same value of the given joint."""
        others = [i for i in range(7) if i != self.given]
        return self.form.branch_of(np.asarray(q)[others])
