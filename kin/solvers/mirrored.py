"""An arm read with some of its joints counting the other way round, and a closed form asked about that arm.

Which way a joint counts is a choice of whoever writes the table: with joint 3 of an arm turned round and θ3 → −θ3
it is the same arm. A closed form has made its own choice. Where an arm fits none as it is, its axes as lines in
space (:mod:`kin.solvers.links`) say which joints would have to count otherwise:

- Of parallel neighbours all count the same way.
- From one link to the next the way along an axis between two others goes forward, so that d3, d4, d5 > 0.
- The tool looks along the last axis, not against it.

What is still open is read with as few joints turned round as possible. The closed form then answers for that arm,
and what is said of a joint turned round changes its sign: values, limits (which change places), intervals.
Lines also do not see how a table comes to them, so that rows that do not move may stand anywhere in it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING, Any

import numpy as np

from kin.robot import Joint, Robot
from kin.solvers.common import POSE, TURN, Candidates, Freedom, Problem, is_zero, screw_z
from kin.solvers.links import Links, links_of
from kin.solvers.singular import Singularity, counting_otherwise
from kin.transforms import Array

if TYPE_CHECKING:
    from kin.solvers import Solver

Joints = tuple[int, ...]
_MOST = 16  # readings of one arm: what has a closed form has four at most
_HALF_TURN = np.diag([1.0, -1.0, -1.0, 1.0])  # Rx(π)


def readings(robot: Robot) -> Iterator[tuple[Joints, Robot]]:
    """The arm as a plain standard table, with the joints (indices) in it that count the other way round.

    The fewest joints come first, and possibly none. The tables have neither limits nor home.
    """
    if robot.n < 2:
        return
    links = links_of(robot, (1,) * (robot.n - 1))
    choices = islice(product(*_choices(robot, links)), _MOST)
    for joints in sorted((tuple(i for part in choice for i in part) for choice in choices), key=len):
        yield joints, _table(robot, links, joints)


def _choices(robot: Robot, links: Links) -> list[list[Joints]]:
    """For each run of parallel axes the joints that may be turned round, in one or two ways."""
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
        upright = first > 0 or links.base[2, 2] >= 0.0  # of equals axis 1 rather points up
        ways = (along, against) if upright else (against, along)
        found.append([joints for joints in ways if len(joints) == least])
        if end == robot.n and is_zero(abs(links.tool[2, 2]) - 1.0):
            with_tool = along if links.tool[2, 2] > 0.0 else against
            found[-1] += [with_tool] * (with_tool not in found[-1])
    return found


def _table(robot: Robot, links: Links, joints: Joints) -> Robot:
    """The arm of these links, as the robot counts, but for `joints`.

    ``Rz(θ) Tz(d) = Rx(π) Rz(−θ) Tz(−d) Rx(π)``, and half turns about x join the twists before and after.
    """
    turned = [(i in joints) != (sign < 0.0) for i, sign in enumerate(links.sign.tolist())]
    # Lines do not tell from where the first and the last angle are counted. Here that is the x axis of the robot's
    # own base, and where the tool looks along the frame's y axis if it does not look along the last joint's.
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


class Mirrored:
    """A closed form, asked about an arm of which some joints count the other way round.

    From outside it is that closed form, with the arm's own joint values. Its geometry is that of the arm turned
    round, which is the same in space.
    """

    def __init__(self, solver: Solver, geometry: Any, joints: Joints, n: int) -> None:
        self.NAME, self.TITLE, self.BRANCHES = solver.NAME, solver.TITLE, solver.BRANCHES
        self.solver, self.joints = solver, joints
        self._signs = np.ones(n)
        self._signs[list(joints)] = -1.0
        free = [freedom.joint for freedom in solver.freedoms(geometry, POSE)[:1] if not freedom.rare]
        self.branches_one, self.branches_many, self.branches_each = (
            kernel and _Around(kernel, self._signs, joints, free)
            for kernel in (getattr(solver, f"branches_{name}", None) for name in ("one", "many", "each"))
        )

    def why(self, geometry: Any) -> str:
        """What makes the arm one of the family, and which joints count the other way round."""
        *most, last = (str(i + 1) for i in self.joints)
        told = f"joints {', '.join(most)} and {last} count" if most else f"joint {last} counts"
        return f"{self.solver.why(geometry)}; {told} the other way round"

    def handles(self, geometry: Any, task: int) -> bool:
        """As the closed form does."""
        return self.solver.handles(geometry, task)

    def freedoms(self, geometry: Any, task: int) -> tuple[Freedom, ...]:
        """As the closed form has them: those that are a joint's value are the joint's own."""
        return self.solver.freedoms(geometry, task)

    def solve(self, geometry: Any, problem: Problem) -> Candidates:
        """The branches, in the arm's own joint values."""
        p, own = problem, self.solver.freedoms(geometry, problem.task)
        lower, upper = p.lower.copy(), p.upper.copy()
        for i in self.joints:
            lower[i], upper[i] = -p.upper[i], -p.lower[i]
        signs = [-1.0 if freedom.joint in self.joints else 1.0 for freedom in own]
        given = tuple([value * sign for value, sign in zip(p.values, signs, strict=True)])
        seed = p.seed * self._signs
        found = self.solver.solve(
            geometry, Problem(p.T, p.task, given, p.respect_limits, seed, lower, upper, p.seed_roll)
        )
        arcs = [x if sign > 0.0 else _opposite(x) for x, sign in zip(found.arcs, signs, strict=True)]
        return Candidates(found.q * self._signs, found.values * signs, tuple(arcs), found.gap, found.obstacle)

    def branch_of(self, geometry: Any, q: Array) -> int:
        """The branch a configuration ``(n,)`` is on."""
        return self.solver.branch_of(geometry, q * self._signs)

    def singularities(self, geometry: Any, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """How far a configuration ``(n,)`` is from each of the arm's singularities."""
        with counting_otherwise(self.joints):
            return self.solver.singularities(geometry, q * self._signs, within)

    def params(self, geometry: Any) -> Array:
        """The arm turned round as the thin kernels read it."""
        solver: Any = self.solver
        params: Array = solver.params(geometry)
        return params


class _Around:
    """A thin kernel of the arm turned round, called like that of the arm as it is; see :mod:`kin.ik.batch`.

    Like a kernel it can be compiled ahead (`kin.kernels.compile.direct`).
    """

    def __init__(self, kernel: Any, signs: Array, joints: Joints, free: list[int]) -> None:
        self._kernel, self._signs, self._joints, self._free = kernel, signs, joints, free
        self._asked = any(joint in joints for joint in free)

    def compile(self, signature: tuple[Any, ...]) -> _Around:
        """The same round the compiled function."""
        return _Around(self._kernel.compile(signature), self._signs, self._joints, self._free)

    def __call__(self, params: Array, T: Array, value: Any, near: Array, out: Array) -> bool | None:
        finite: bool | None = self._kernel(params, T, -value if self._asked else value, near * self._signs, out)
        for joint in self._joints:
            column = out[..., joint]
            np.subtract(0.0, column, out=column)
            if joint not in self._free:  # what may be asked for is told as it was asked
                column[column == -math.pi] = math.pi
        return finite


def _opposite(arcs: Array) -> Array:
    """Rows (branch, low, high) of values that change their sign."""
    out = arcs.copy()
    out[:, 1], out[:, 2] = -arcs[:, 2], -arcs[:, 1]
    return out
