"""Arms with reversed joints: the closed form of the same arm with some joints counted in the other direction.

The positive direction of a joint is a choice of the table's author: with the axis of joint 3 reversed and θ3 → −θ3
it is the same arm. Each family assumes certain directions. If an arm fits no family as it is, its axes as lines
(:mod:`kin.axes`) show which joints have to be reversed:

- Neighbouring parallel axes have the same direction.
- The offset along an axis between two others is positive: d3, d4, d5 > 0.
- The tool points along the last axis, not against it.

Where several choices remain, the one with the fewest reversed joints is tried first. The closed form then solves
that arm, and every number that belongs to a reversed joint changes its sign: values, limits (which are swapped),
intervals.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from itertools import islice, product

import numpy as np

from kin.angles import TURN
from kin.axes import Links, is_along, is_zero, links_of, screw_z
from kin.robot import Joint, Robot
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import POSE, BatchKernels, Candidates, ClosedForm, SolverInput, WrappedForm
from kin.solvers.singular import JointValue, Singularity
from kin.transforms import Array

Joints = tuple[int, ...]
_MOST = 16  # readings of one arm; an arm with a closed form has at most four
_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # Rx(π)


def readings(robot: Robot) -> Iterator[tuple[Joints, Robot]]:
    """The arm as a table in the standard convention, with the joints (indices) that are reversed in it.

    Readings with the fewest reversed joints come first, possibly with none. The tables have no limits and no home.
    """
    if robot.n < 2:
        return
    links = links_of(robot, (1,) * (robot.n - 1))
    choices = islice(product(*_choices(robot, links)), _MOST)
    for joints in sorted((tuple(i for part in choice for i in part) for choice in choices), key=len):
        yield joints, table_of(robot, links, joints)


def _choices(robot: Robot, links: Links) -> list[list[Joints]]:
    """For each run of parallel axes, the one or two sets of joints that may be reversed."""
    starts = [i for i in range(robot.n) if i == 0 or links.alpha[i - 1] != 0.0]
    found = []
    for first, end in zip(starts, [*starts[1:], robot.n], strict=True):
        run = range(first, end)
        along = tuple(i for i in run if links.sign[i] < 0.0)
        against = tuple(i for i in run if links.sign[i] > 0.0)
        forward = float(links.d[first:end].sum())
        if first > 0 and end < robot.n and robot.revolute[first:end].all() and not is_zero(forward):
            found.append([along if forward > 0.0 else against])
            continue
        least = min(len(along), len(against))
        upright = first > 0 or links.base[2, 2] >= 0.0  # on a tie, axis 1 points up
        ways = (along, against) if upright else (against, along)
        found.append([joints for joints in ways if len(joints) == least])
        if end == robot.n and is_along(links.tool):
            with_tool = along if links.tool[2, 2] > 0.0 else against
            found[-1] += [with_tool] * (with_tool not in found[-1])
    return found


def table_of(robot: Robot, links: Links, joints: Joints) -> Robot:
    """The arm of these links, with the joint directions of the robot except for the reversed `joints`.

    ``Rz(θ) Tz(d) = Rx(π) Rz(−θ) Tz(−d) Rx(π)``; the half turns about x are added to the twists before and after.
    """
    turned = [(i in joints) != (sign < 0.0) for i, sign in enumerate(links.sign.tolist())]
    # Lines do not determine the zero of the first and the last angle. The first is counted from the x axis of the
    # robot's base. The last is 0 where the tool points along the frame's y axis, if it is not along the last axis.
    x, y = (links.base[:3, :2].T @ robot.T_world_base[:3, 0]).tolist()
    start = math.atan2(y, x)
    x, y = links.tool[:2, 2].tolist()
    end = 0.0 if is_zero(x, y) else math.atan2(-x, y)
    base, tool = links.base @ screw_z(start, 0.0), screw_z(-end, 0.0) @ links.tool
    theta = links.theta.copy()
    theta[0] -= start
    theta[-1] += end
    rows = []
    for i, joint in enumerate(robot.joints):
        after = turned[i + 1] if i + 1 < robot.n else turned[i]
        twist = links.alpha[i] + (math.pi if turned[i] != after else 0.0)
        sense = -1.0 if turned[i] else 1.0
        rows.append(
            Joint(
                joint.name,
                sense * float(theta[i]),
                sense * float(links.d[i]),
                float(links.a[i]),
                math.remainder(twist, TURN),
                joint.kind,
            )
        )
    return replace(
        robot,
        convention="standard",
        rows=tuple(rows),
        home=(0.0,) * robot.n,
        base=_nested(base @ _HALF_TURN if turned[0] else base),
        tool=_nested(_HALF_TURN @ tool if turned[-1] else tool),
    )


def _nested(T: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in T.tolist())


class ReversedJoints(WrappedForm):
    """The closed form of an arm of which some joints are reversed.

    It behaves as the family's closed form, in the arm's own joint values: every number that belongs to a reversed
    joint changes its sign.

    Attributes:
        form: the closed form of the arm with these joints reversed.
        joints: indices of the reversed joints.
        signs: ``(n,)`` −1.0 for those, else 1.0.
    """

    def __init__(self, form: ClosedForm, joints: Joints, robot: Robot) -> None:
        self.form, self.joints = form, joints
        self.name, self.title, self.lengths, self.quick = form.name, form.title, form.lengths, form.quick
        *most, last = (str(i + 1) for i in joints)
        which = f"joints {', '.join(most)} and {last} are" if most else f"joint {last} is"
        self.reason = f"{form.reason}; {which} reversed"
        self.signs = np.ones(robot.n)
        self.signs[list(joints)] = -1.0
        self.branches, self.meanings = form.names(robot, self.signs)
        self.kernels = self._kernels(form.kernels)

    def _kernels(self, form: BatchKernels) -> BatchKernels:
        requested = [r.joint for r in self.form.redundancies(POSE)[:1] if not r.rare]
        return _reversed_kernels(form, self.signs, self.joints, requested)

    def relaxed(self, by: float) -> ReversedJoints:
        """The same of the relaxed family."""
        other = copy(self)
        other.form = self.form.relaxed(by)
        other.kernels = self._kernels(other.form.kernels)
        return other

    def _signs_of(self, task: int) -> list[float]:
        return [-1.0 if r.joint in self.joints else 1.0 for r in self.form.redundancies(task)]

    def solve(self, problem: SolverInput) -> Candidates:
        """The branches, in the arm's own joint values."""
        p, signs = problem, self._signs_of(problem.task)
        lower, upper = p.lower.copy(), p.upper.copy()
        for i in self.joints:
            lower[i], upper[i] = -p.upper[i], -p.lower[i]
        values = tuple([value * sign for value, sign in zip(p.values, signs, strict=True)])
        found = self.form.solve(replace(p, values=values, seed=p.seed * self.signs, lower=lower, upper=upper))
        arcs = [x if sign > 0.0 else _opposite(x) for x, sign in zip(found.arcs, signs, strict=True)]
        return replace(found, q=found.q * self.signs, values=found.values * signs, arcs=tuple(arcs))

    def solve_many(self, T: Array, seeds: Array, lower: Array, upper: Array, q: Array) -> None:
        """The branches of many targets, in the arm's own joint values."""
        self.form.solve_many(T, seeds * self.signs, *self._limits(lower, upper), q)
        q *= self.signs

    def _limits(self, lower: Array, upper: Array) -> tuple[Array, Array]:
        """Joint limits of the family's arm."""
        reversed_ = self.signs < 0.0
        return np.where(reversed_, -upper, lower), np.where(reversed_, -lower, upper)

    def value_at(self, T: Array, q: Array) -> float:
        """The redundancy parameter of the family's arm."""
        return self.form.value_at(T, q * self.signs)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration ``(n,)`` is on."""
        return self.form.branch_of(q * self.signs)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the family, with the arm's own joint values."""
        signs = self.signs.tolist()
        return tuple(
            replace(s, met_at=tuple(JointValue(i, signs[i] * value) for i, value in s.met_at))
            for s in self.form.singularities(q * self.signs, within)
        )


def kernels_by_solving(form: ClosedForm, params: Array) -> BatchKernels:
    """Batch kernels that call `form.solve`."""

    def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
        if not np.isfinite(T).all():
            out[:] = math.nan
            return False
        values = (value,) + (math.nan,) * len(form.redundancies(POSE))
        open_ended = np.full(len(near), UNBOUNDED)
        asked = SolverInput(T, POSE, values[: len(form.redundancies(POSE))], False, near, -open_ended, open_ended)
        out[:] = form.solve(asked).q
        return True

    def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        for k, value in enumerate(np.broadcast_to(values, len(T)).tolist()):
            one(params, T[k], value, near, out[k])

    return BatchKernels(params, one, many)


def _reversed_kernels(form: BatchKernels, signs: Array, joints: Joints, requested: list[int]) -> BatchKernels:
    """`form` with the signs of `joints` changed; `requested`: the joint whose value may be requested, if any."""
    value_sign = -1.0 if any(joint in joints for joint in requested) else 1.0

    def reverse(out: Array) -> None:
        for joint in joints:
            column = out[..., joint]
            np.subtract(0.0, column, out=column)
            if joint not in requested:  # a requested value is returned as it was requested
                column[column == -math.pi] = math.pi

    def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
        finite = form.one(params, T, value_sign * value, near * signs, out)
        reverse(out)
        return finite

    def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        form.many(params, T, value_sign * values, near * signs, out)
        reverse(out)

    return BatchKernels(form.params, one, many)


def _opposite(arcs: Array) -> Array:
    """Rows (branch, low, high) with the sign of the values changed."""
    out = arcs.copy()
    out[:, 1], out[:, 2] = -arcs[:, 2], -arcs[:, 1]
    return out
