"""How generated code asks each family of closed forms for its branches.

A family with a careful kernel, which also chooses free joints inside the limits, has an adapter here from the
arguments that all have in common to its own. One that leaves nothing free in a pose is asked by its `one`. What
the solver of another arm does for one is in :mod:`kin.codegen.wrappers`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from kin.angles import TURN
from kin.axes import NEARLY, size
from kin.codegen import wrappers
from kin.codegen.entries import ROWS_OF_ARCS
from kin.codegen.source import plain
from kin.codegen.types import Constants
from kin.differential.metric import extent
from kin.errors import InputError
from kin.robot import Robot
from kin.solvers import pair2
from kin.solvers.collinear7.branches import solve as solve_collinear7
from kin.solvers.collinear7.closed_form import Collinear7
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import APPROACH, POSE, BatchKernels, ClosedForm
from kin.solvers.coupled import Coupled
from kin.solvers.general5.closed_form import ANY_ORIENTATION, General5
from kin.solvers.general6 import batch as general6_batch
from kin.solvers.general6.closed_form import STEPS, General6
from kin.solvers.general7.closed_form import General7
from kin.solvers.offset7.answers import answer as answer_offset7
from kin.solvers.offset7.closed_form import Offset7
from kin.solvers.offset7.geometry import REVERSED
from kin.solvers.offset7.places import SAMPLES
from kin.solvers.offset7.ranges import INTERVALS
from kin.solvers.parallel5.branches import solve as solve_parallel5
from kin.solvers.parallel5.closed_form import Parallel5
from kin.solvers.parallel6.branches import solve as solve_parallel6
from kin.solvers.parallel6.closed_form import Parallel6
from kin.solvers.planar4.branches import solve as solve_planar4
from kin.solvers.planar4.closed_form import Planar4
from kin.solvers.reversed import ReversedJoints
from kin.solvers.rounded.closed_form import Rounded
from kin.solvers.rounded.table import SHORT
from kin.solvers.scaled import Scaled
from kin.solvers.srs7.branches import solve as solve_srs7
from kin.solvers.srs7.closed_form import Srs7
from kin.solvers.turned.closed_form import Turned
from kin.solvers.wrist5.branches import solve as solve_wrist5
from kin.solvers.wrist5.closed_form import Wrist5
from kin.solvers.wrist6.branches import solve as solve_wrist6
from kin.solvers.wrist6.closed_form import Wrist6
from kin.transforms import Array

Inner = Callable[..., Any]
Limits = tuple[Array, Array]  # lower and upper
# Of numbers that decide the size of an array and do not follow from the arm, see `Rooms`: rows that are sorted,
# marks over at most one turn.
BOUNDS = {
    ("general6_batch_sort", "count"): general6_batch.SOLUTIONS,
    ("offset7_places_marks_of", "n"): 2 * SAMPLES,
}
_ELSE = "Use kin.solve_ik, or the REST service"
_RIGHT, _SEEN = 0.5 * math.pi, 1e-10
_ANGLES = ("0", "pi/2 (90°)", "pi (180°)", "-pi/2 (-90°)")


class Alone(NamedTuple):
    """What generated code calls for the branches of a pose.

    Attributes:
        rows: an adapter: ``rows(inner, params, T, value, near, limits, arcs, q)`` writes the branches
            to q ``(k, n)`` and the intervals of the redundancy parameter to arcs, and returns their number.
        inner: the kernel of the family that it calls; of a wrapper what it calls and the arm's numbers.
        params: what the kernel reads.
        stepped: whether the value of the redundancy parameter is searched for by steps: the intervals of such a
            parameter are not known, and `kin.solve_ik`, which follows self-motions, may choose another value.
    """

    rows: Inner
    inner: Inner | Constants
    params: Array
    stepped: bool = False

    @property
    def intervals(self) -> int:
        """How many intervals of free joints the adapter writes at most; if none, one row that is not read."""
        rows, inner = self.rows, self.inner
        while isinstance(inner, Constants):
            rows, inner = inner.rows, inner.inner
        return 1 if rows in (without_limits, of_elimination) else ROWS_OF_ARCS

    def within(self, rows: Inner, **constants: Any) -> Alone:
        """The same for another arm, whose branches an adapter of `kin.codegen.wrappers` makes of these."""
        return self._replace(rows=rows, inner=Constants(rows=self.rows, inner=self.inner, **constants))


def as_it_is(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """A kernel with these very arguments."""
    _, count = inner(params, T, value, near, limits[0], limits[1], arcs, q)
    return int(count)


def without_limits(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """A family's `one`."""
    inner(params, T, value, near, q)
    return 0


def of_wrist5(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """Five joint values of six columns."""
    out = np.empty((8, 6))
    _, count = inner(params, T, value, near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return int(count)


def of_planar4(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The direction of the third link is `value`, or the feasible one nearest to the seed's."""
    out = np.empty((2, 5))
    _, count = inner(params, T, POSE, value, near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return int(count)


def of_parallel5(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """A pose leaves nothing free: the value is not used."""
    out = np.empty((4, 6))
    _, count = inner(params, T, (POSE, math.nan), near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return int(count)


def of_srs7(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The arm angle is `value`, or the feasible one nearest to the seed's."""
    out = np.empty((8, 8))
    _, _, count = inner(params, T, (value, True, False, False), near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return int(count)


def of_collinear7(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """θ1 is `value`, or the feasible one nearest to the seed's."""
    out, rolls = np.empty((8, 9)), np.empty((256, 3))
    _, count, _ = inner(
        params, T, (value, math.nan, 0.0, True, False), near, limits[0], limits[1], arcs, rolls, out
    )
    _copy(out, q)
    return int(count)


def of_offset7(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """The joint at the end is at `value`, or of each branch at the feasible value nearest to the seed."""
    lower, upper = limits
    out, found, joints = np.empty((8, 8)), np.empty((INTERVALS, 3)), np.empty((3, 7))
    for j in range(7):
        joints[0, j], joints[1, j], joints[2, j] = near[j], lower[j], upper[j]
    once = inner(params, T, joints, value, math.isnan(value), 1.0, found, out)
    _copy(out, q)
    given = 6 if params[REVERSED] > 0.0 else 0
    low, high = lower[given], upper[given]
    turns, count = math.ceil((high - low) / TURN) if TURN < high - low < UNBOUNDED else 0, 0
    for turn in range(-turns, turns + 1):
        for i in range(once):
            first, last = max(found[i, 1] + TURN * turn, low), min(found[i, 2] + TURN * turn, high)
            if first <= last and count < arcs.shape[0]:
                arcs[count, 0], arcs[count, 1], arcs[count, 2] = found[i, 0], first, last
                count += 1
    return count


def of_elimination(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> int:
    """What the elimination finds; returns minus what it knows of that."""
    known: int = inner(params, T, q)
    return 0 - known


def _copy(rows: Array, q: Array) -> None:
    """q ``(k, n)`` ← the first n columns of rows."""
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            q[i, j] = rows[i, j]


# Of the families with an adapter of their own: that, and the kernel that it calls.
KERNELS: dict[type[ClosedForm], tuple[Inner, Inner]] = {
    Wrist5: (of_wrist5, solve_wrist5),
    Wrist6: (as_it_is, solve_wrist6),
    Planar4: (of_planar4, solve_planar4),
    Parallel5: (of_parallel5, solve_parallel5),
    Parallel6: (as_it_is, solve_parallel6),
    Srs7: (of_srs7, solve_srs7),
    Collinear7: (of_collinear7, solve_collinear7),
    Offset7: (of_offset7, answer_offset7),
}


def alone(robot: Robot, form: ClosedForm | None) -> Alone:
    """What generated code calls for the branches of a robot, or of an arm that stands for it.

    Raises:
        InputError: an arm whose solver is more than kernels, with why, and what would help.
    """
    if form is None:
        raise InputError(
            "robot",
            robot.id,
            f"an arm with a closed form: this one is solved by descents from many starts. {_ELSE}",
        )
    if isinstance(form, Rounded):
        raise InputError(
            "robot",
            robot.id,
            f"a table with exact numbers: this one is near an arm of the family {form.name}, but off by "
            f"{form.off:.1g} rad or of the arm's size, so that every posture is refined on the table as entered. "
            f"Write {_exact(robot)}",
        )
    if family := next((each for each in type(form).__mro__ if each in KERNELS), None):
        rows, inner = KERNELS[family]
        params = form.geometry.params if isinstance(form, Parallel5) else form.kernels.params
        return Alone(rows, inner, np.asarray(params))
    if type(form) in _WRAPPERS:
        return _WRAPPERS[type(form)](form, robot)
    if form.redundancies(POSE):
        raise needs_python(robot, form)
    return _by_one(form.kernels, form, robot)


def _exact(robot: Robot) -> str:
    """What to write exactly in a rounded table: its numbers near right angles or 0.

    Without those before the first axis, which only place the base. Not all of the others have to be exact: offsets
    along parallel axes are added up.
    """
    rows, found = list(robot.rows[robot.joint_rows[0] :]), []
    if robot.convention == "modified":
        rows[0] = replace(rows[0], a=0.0, alpha=0.0)
    for row in rows:
        angles = {"alpha": row.alpha, **({} if row.kind == "revolute" else {"theta": row.theta})}
        for name, value in angles.items():
            quarters = round(value / _RIGHT)
            if _SEEN < abs(value - quarters * _RIGHT) < NEARLY:
                found.append(f"{name} of {row.name} as {_ANGLES[quarters % 4]}")
        lengths = {"a": row.a, **({} if row.kind == "prismatic" else {"d": row.d})}
        found += [
            f"{name} of {row.name} as 0" for name, x in lengths.items() if 0.0 < abs(x) < SHORT * size(robot)
        ]
    if not found:
        return "angles such as pi/2 and lengths with all their digits, or 0"
    return f"the numbers near right angles or 0 exactly: {', '.join(found)}"


def needs_python(robot: Robot, form: ClosedForm) -> InputError:
    """The error for an arm of which parts of the solver are no kernels, or none that can be translated."""
    expected = f"an arm whose solver is made of kernels alone: that of this one ({form.name}) also needs Python"
    return InputError("robot", robot.id, f"{expected}. {_ELSE}")


def _by_one(kernels: BatchKernels, form: ClosedForm, robot: Robot) -> Alone:
    if plain(kernels.one) is kernels.one:  # plain Python
        raise needs_python(robot, form)
    return Alone(without_limits, kernels.one, np.asarray(kernels.params))


def _counted(form: ReversedJoints | Scaled, robot: Robot) -> Alone:
    scales = form.signs if isinstance(form, ReversedJoints) else form.metres
    joint = next((r.joint for r in form.redundancies(POSE) if not r.rare), -1)
    return alone(robot, form.form).within(
        wrappers.of_counted,
        scales=scales,
        unit=form.unit if isinstance(form, Scaled) else 1.0,
        scale=1.0 if joint < 0 else float(scales[joint]),
    )


def _general5(form: General5, robot: Robot) -> Alone:
    inner = alone(robot, form.form)
    if form.point:
        return inner.within(wrappers.of_pairs, turn=np.ascontiguousarray(ANY_ORIENTATION))
    return inner.within(wrappers.of_completed, rolls=form.rolls)


def _general6(form: General6, robot: Robot) -> Alone:
    return _elimination(form, robot).within(
        wrappers.of_general6,
        model=np.asarray(form.robot.model),
        turns=form.robot.revolute.astype(np.float64),
        size=size(form.robot),
        reach=extent(form.robot),
        steps=np.concatenate(STEPS),
    )


def _elimination(form: General6, robot: Robot) -> Alone:
    reading = form.reading
    if form.solver is not general6_batch.solve_all:
        raise needs_python(robot, form)
    found = Alone(of_elimination, general6_batch.solve_all, np.asarray(form.kernels.params))
    if reading.is_itself:
        return found
    return found.within(wrappers.of_order, order=np.array(reading.order), inverted=reading.inverted)


def _general7(form: General7, robot: Robot) -> Alone:
    fold = form.fold
    inner = _elimination(form.form, robot) if isinstance(form.form, General6) else alone(robot, form.form)
    found = inner.within(wrappers.of_general7, joint=fold.joint, last=fold.last, axis=fold.axis, back=fold.back)
    return found._replace(stepped=True)


def _turned(form: Turned, robot: Robot) -> Alone:
    if form.whole is not None:
        return alone(robot, form.whole)
    inner = _by_one(pair2.kernels_of(form.last.others, APPROACH), form, robot)
    return inner.within(wrappers.of_turned, axis=form.last.axis, model=np.asarray(form.last.others.model))


def _coupled(form: Coupled, robot: Robot) -> Alone:
    back = np.zeros(form.expansion.T.shape)
    back[:, form.chosen] = form.back
    return alone(robot, form.form).within(
        wrappers.of_coupled,
        count=form.free.n,
        expansion=form.expansion,
        back=back,
        turns=robot.revolute.astype(np.float64),
        revolute=form.free.revolute.astype(np.float64),
    )


_WRAPPERS: dict[type[ClosedForm], Callable[[Any, Robot], Alone]] = {
    ReversedJoints: _counted,
    Scaled: _counted,
    General5: _general5,
    General6: _general6,
    General7: _general7,
    Turned: _turned,
    Coupled: _coupled,
}
