"""How generated code asks each family of closed forms for its branches.

A family with a careful kernel, which also chooses free joints inside the limits, has an adapter here from the
arguments that all have in common to its own. One that leaves nothing free in a pose is asked by its `one`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import singledispatch
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from kin.codegen.source import plain
from kin.errors import InputError
from kin.robot import Robot
from kin.solvers.collinear7.branches import solve as solve_collinear7
from kin.solvers.collinear7.closed_form import Collinear7
from kin.solvers.contract import POSE, ClosedForm
from kin.solvers.coupled import Coupled
from kin.solvers.general6 import batch as general6_batch
from kin.solvers.general6.closed_form import General6
from kin.solvers.offset7.branches import branches_one as branches_offset7
from kin.solvers.offset7.closed_form import Offset7
from kin.solvers.parallel5.branches import solve as solve_parallel5
from kin.solvers.parallel5.closed_form import Parallel5
from kin.solvers.parallel6.branches import solve as solve_parallel6
from kin.solvers.parallel6.closed_form import Parallel6
from kin.solvers.reversed import ReversedJoints, WrappedKernels
from kin.solvers.rounded.closed_form import Rounded
from kin.solvers.srs7.branches import solve as solve_srs7
from kin.solvers.srs7.closed_form import Srs7
from kin.solvers.wrist5.branches import solve as solve_wrist5
from kin.solvers.wrist5.closed_form import Wrist5
from kin.solvers.wrist6.branches import solve as solve_wrist6
from kin.solvers.wrist6.closed_form import Wrist6
from kin.transforms import Array

Inner = Callable[..., Any]
Limits = tuple[Array, Array]  # lower and upper


class Alone(NamedTuple):
    """What generated code calls for the branches of a pose.

    Attributes:
        rows: an adapter below: ``rows(inner, params, T, value, near, limits, arcs, q)`` writes the branches
            to q ``(k, n)`` and the intervals of the redundancy parameter to arcs, and returns the gap and their
            number.
        inner: the kernel of the family that it calls.
        params: what that reads.
        signs: ``(n,)`` −1.0 for joints that are reversed.
        needs_value: whether the value of the redundancy parameter must be given.
        bounds: of numbers that decide the size of an array and do not follow from the arm, see `Rooms`.
    """

    rows: Inner
    inner: Inner
    params: Array
    signs: Array
    needs_value: bool = False
    bounds: Mapping[tuple[str, str], int] = {}


def as_it_is(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """A kernel with these very arguments."""
    gap, count = inner(params, T, value, near, limits[0], limits[1], arcs, q)
    return gap, count


def without_limits(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """A family's `one`."""
    inner(params, T, value, near, q)
    return 0.0, 0


def of_wrist5(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """Five joint values of six columns."""
    out = np.empty((8, 6))
    gap, count = inner(params, T, value, near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return gap, count


def of_parallel5(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """A pose leaves nothing free: the value is not used."""
    out = np.empty((4, 6))
    gap, count = inner(params, T, (POSE, math.nan), near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return gap, count


def of_srs7(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """The arm angle is `value`, or the feasible one nearest to the seed's."""
    out = np.empty((8, 8))
    _, gap, count = inner(params, T, (value, True, False, False), near, limits[0], limits[1], arcs, out)
    _copy(out, q)
    return gap, count


def of_collinear7(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """θ1 is `value`, or the feasible one nearest to the seed's."""
    out, rolls = np.empty((8, 9)), np.empty((256, 3))
    gap, count, _ = inner(
        params, T, (value, math.nan, 0.0, True, False), near, limits[0], limits[1], arcs, rolls, out
    )
    _copy(out, q)
    return gap, count


def of_general6(
    inner: Inner, params: Array, T: Array, value: float, near: Array, limits: Limits, arcs: Array, q: Array
) -> tuple[float, int]:
    """What the elimination finds."""
    inner(params, T, q)
    return 0.0, 0


def _copy(rows: Array, q: Array) -> None:
    """q ``(k, n)`` ← the first n columns of rows."""
    for i in range(q.shape[0]):
        for j in range(q.shape[1]):
            q[i, j] = rows[i, j]


def alone(robot: Robot, form: ClosedForm | None) -> Alone:
    """What generated code calls for the branches of a robot.

    Raises:
        InputError: an arm whose solver is more than kernels, with why, and what would help.
    """
    if form is None:
        raise refused(robot, "an arm with a closed form: this one is solved by descents from many starts")
    return _alone(form, robot)


def refused(robot: Robot, expected: str) -> InputError:
    """The error for an arm that cannot be emitted."""
    return InputError("robot", robot.id, expected)


def _of(rows: Callable[..., Any], inner: Callable[..., Any], form: ClosedForm, n: int, **more: Any) -> Alone:
    return Alone(rows, inner, np.asarray(form.kernels.params), np.ones(n), **more)


@singledispatch
def _alone(form: ClosedForm, robot: Robot) -> Alone:
    inner = plain(form.kernels.one)
    if isinstance(form.kernels, WrappedKernels) or form.redundancies(POSE) or not isinstance(inner, FunctionType):
        raise refused(
            robot,
            f"an arm whose solver is made of kernels alone: that of this one ({form.name}) also needs Python. Use "
            "kin.solve_ik, or the REST service",
        )
    return _of(without_limits, form.kernels.one, form, robot.n)


@_alone.register
def _(form: ReversedJoints, robot: Robot) -> Alone:
    return _alone(form.form, robot)._replace(signs=form.signs)


@_alone.register
def _(form: Rounded, robot: Robot) -> Alone:
    raise refused(
        robot,
        f"a table with exact numbers: this one is near an arm of the family {form.name}, but off by "
        f"{form.off:.1g} rad or of the arm's size, so that every posture is refined on the table as entered. "
        "Write angles such as pi/2 and lengths with all their digits, or 0",
    )


@_alone.register
def _(form: Coupled, robot: Robot) -> Alone:
    raise refused(robot, "an arm without rows that follow other joints: enter the table of its free joints")


@_alone.register
def _(form: Wrist5, robot: Robot) -> Alone:
    return _of(of_wrist5, solve_wrist5, form, robot.n)


@_alone.register
def _(form: Wrist6, robot: Robot) -> Alone:
    return _of(as_it_is, solve_wrist6, form, robot.n)


@_alone.register
def _(form: Parallel6, robot: Robot) -> Alone:
    return _of(as_it_is, solve_parallel6, form, robot.n)


@_alone.register
def _(form: Parallel5, robot: Robot) -> Alone:
    return _of(of_parallel5, solve_parallel5, form, robot.n)._replace(params=np.asarray(form.geometry.params))


@_alone.register
def _(form: Srs7, robot: Robot) -> Alone:
    return _of(of_srs7, solve_srs7, form, robot.n)


@_alone.register
def _(form: Collinear7, robot: Robot) -> Alone:
    return _of(of_collinear7, solve_collinear7, form, robot.n)


@_alone.register
def _(form: Offset7, robot: Robot) -> Alone:
    return _of(without_limits, branches_offset7, form, robot.n, needs_value=True)


@_alone.register
def _(form: General6, robot: Robot) -> Alone:
    if plain(form.kernels.one) is not plain(general6_batch.branches_one):
        raise refused(
            robot,
            "an arm whose axes the elimination reads from base to tool: this one is read in another order. Use "
            "kin.solve_ik, or the REST service",
        )
    # It sorts the rows of its answer.
    bounds = {("general6_batch_sort", "count"): general6_batch.SOLUTIONS}
    return _of(of_general6, general6_batch.solve_all, form, robot.n, bounds=bounds)
