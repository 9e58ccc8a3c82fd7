"""The solver of three to five joints: the choice of virtual joints, solutions, singularities."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from kin.angles import apart
from kin.axes import screw_x, screw_z
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.canonical import free_last, without_last
from kin.solvers.common import UNBOUNDED
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.general5.completion import BALL, COMPLETIONS, ROLL, Axes, completed
from kin.solvers.general5.point import Point3
from kin.solvers.general6.closed_form import moves_freely
from kin.solvers.rolled import roll_sense
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "general5"
TITLE = "all solutions, three to five joints"
ANY_ORIENTATION = (screw_z(0.4, 0.0) @ screw_x(0.0, 1.2) @ screw_z(-2.2, 0.0))[:3, :3]  # in no special position
_AT_ZERO = TOLERANCES.near_miss
_CHUNK = 256  # targets whose solutions are compared at a time


Match = Callable[[Robot], ClosedForm | None]


def match(robot: Robot, form_of: Match, family_of: Match) -> General5 | Point3 | None:
    """The solver, if virtual joints make the arm one with a solver, or the point moves in every direction.

    Args:
        form_of: gives the solver of an arm with six joints.
        family_of: gives it only if the arm fits a family.
    """
    for axes in COMPLETIONS.get(robot.n, ()):
        if robot.revolute.all() and robot.n == 3 and axes is not BALL:
            continue  # planar arms have a family
        longer = completed(robot, axes)
        if not moves_freely(longer):
            continue  # where it can barely move in some direction, solutions would be lost
        form = (family_of if axes is BALL else form_of)(longer)
        if form is not None:
            return General5(robot, form, axes)
        if axes is BALL:
            return Point3(robot)
    return None


class General5(ClosedForm):
    """All solutions of an arm with three to five revolute joints that has no closed form of its own.

    Attributes:
        form: the solver of the arm that is completed to six joints.
        point: whether it meets points only, as three joints do; each has two branches of `form`.
        rolls: whether the virtual joint rolls the tool about its z axis.
    """

    name, title = NAME, TITLE
    lengths = ()
    steady = False

    def __init__(self, robot: Robot, form: ClosedForm, axes: Axes) -> None:
        self.robot, self.form, self.off = robot, form, form.off
        self.point, self.rolls = axes is BALL, axes is ROLL
        rolls = bool(robot.revolute[-1]) and roll_sense(robot) != 0.0
        self._last_rolls = not (self.point or self.rolls) and rolls
        virtual = "a virtual joint" if len(axes) == 1 else f"{len(axes)} virtual joints"
        kind = "revolute joints" if robot.revolute.all() else "joints"
        self.reason = f"{robot.n} {kind} whose axes fit no closed form; with {virtual} at the tool: {form.name}"
        # Names belong to all solutions of the six joints; for a point, the last part is about the virtual joints.
        self.named = form.named and not self._last_rolls
        if self.point:
            self.branches = tuple(name.rpartition(" · ")[0] for name in form.branches[::2])
            known = {part for name in self.branches for part in name.split(" · ")}
            self.meanings = tuple(meaning for meaning in form.meanings if meaning[0] in known)
        elif self.named and self.rolls:
            self.branches, self.meanings = form.branches, form.meanings
        else:
            self.named = False
            self.branches = tuple(f"solution {i + 1}" for i in range(len(form.branches)))
        self.kernels = self._kernels(form.kernels)

    def handles(self, task: int) -> bool:
        """Poses; a direction with five joints, or if the last joint keeps it; a point with three joints."""
        if task == APPROACH:
            return self.point or self.rolls or self._last_rolls
        return task == POSE or (task == POSITION and self.point)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """What a pose of the six joints leaves free, and a last joint that only rolls the tool."""
        own = tuple(r for r in self.form.redundancies(POSE) if r.joint < self.robot.n)
        if task == APPROACH and self._last_rolls:
            n = self.robot.n
            own += (RedundancyParameter(f"theta{n}", f"θ{n}", joint=n - 1),)
        return own

    def solve(self, problem: SolverInput) -> Candidates:
        """All solutions that meet what the arm can meet of the target."""
        p, n = problem, self.robot.n
        free_roll = p.task == APPROACH and self._last_rolls
        T, lower, upper = without_last(p) if free_roll else (p.T, p.lower, p.upper)
        if self.point:
            T = T.copy()
            T[:3, :3] = ANY_ORIENTATION
        virtual = np.zeros(6 - n)
        own = self.form.redundancies(POSE)
        kept = [k for k, r in enumerate(own) if r.joint < n]
        values = [math.nan] * len(own)
        for k, value in zip(kept, p.values, strict=False):
            values[k] = value
        found = self.form.solve(
            replace(
                p,
                T=T,
                task=POSE,
                values=tuple(values),
                seed=np.append(p.seed, virtual),
                lower=np.append(lower, virtual - UNBOUNDED),
                upper=np.append(upper, virtual + UNBOUNDED),
            )
        )
        rows = self._rows(found.q[None])[0]
        exists = rows >= 0
        q = np.where(exists[:, None], found.q[rows, :n], math.nan)
        columns = np.where(exists[:, None], found.values[rows][:, kept], math.nan)
        arcs = [_placed(found.arcs[k], rows) for k in kept]
        if free_roll:
            arcs.append(free_last(p, q))
            columns = np.column_stack([columns, q[:, -1]])
        obstacle = found.obstacle
        if self.point:
            obstacle = None if exists.any() else Obstacle("point")
        return Candidates(q, columns, tuple(arcs), found.gap, obstacle, found.completeness)

    def _rows(self, q: Array) -> Array:
        """The solution of the six joints, q ``(N, k, 6)``, that each row ``(N, b)`` takes; −1 for none."""
        there = ~np.isnan(q[:, :, 0])
        numbers = np.broadcast_to(np.arange(q.shape[1]), there.shape)
        if self.point:
            first = np.where(there[:, ::2], numbers[:, ::2], numbers[:, 1::2])
            return np.where(there[:, ::2] | there[:, 1::2], first, -1)
        if not self.rolls:
            off = apart(q[:, :, self.robot.n :], np.zeros(6 - self.robot.n))
            there = there & (off < _AT_ZERO)
        return np.where(there, numbers, -1)

    def _kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels of the arm from those of the six joints."""
        n = self.robot.n

        def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            longer = np.append(near, np.zeros(6 - n))
            values = np.broadcast_to(values, len(T))
            for start in range(0, len(T), _CHUNK):
                part = slice(start, start + _CHUNK)
                wanted = np.ascontiguousarray(values[part])
                found = self._completed(form, params, np.ascontiguousarray(T[part]), wanted, longer)
                rows = self._rows(found)
                q = np.take_along_axis(found[..., :n], np.maximum(rows, 0)[..., None], axis=1)
                out[part] = np.where(rows[..., None] >= 0, q, math.nan)

        if not self.rolls:
            return BatchKernels.of_many(form.params, many)

        def one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
            longer, rows = np.zeros(6), np.empty((len(out), 6))
            longer[:n] = near
            finite = form.one(params, T, value, longer, rows)
            out[:] = rows[:, :n]
            return finite

        return BatchKernels(form.params, one, many)

    def _completed(self, form: BatchKernels, params: Array, T: Array, values: Array, near: Array) -> Array:
        """Solutions of the six joints ``(N, k, 6)``."""
        found = np.empty((len(T), len(self.form.branches), 6))
        if self.point:
            T = T.copy()
            T[:, :3, :3] = ANY_ORIENTATION
        form.many(params, T, values, near, found)
        return found

    def branch_of(self, q: Array) -> int:
        """The row of q ``(n,)`` among all solutions of its pose."""
        if self.named:
            row = self.form.branch_of(np.append(q, np.zeros(6 - self.robot.n)))
            return row // 2 if self.point else row
        return super().branch_of(q)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian of what the arm can control."""
        J = jacobian(self.robot, q)
        if self.point:
            J = J[:3]
        elif self.rolls:
            J = np.vstack([J[:3], fk(self.robot, q)[:3, :2].T @ J[3:]])
        return those_within(within, by_jacobian(J, rank=self.robot.n))


def _placed(arcs: Array, rows: Sequence[int] | Array) -> Array:
    """Intervals ``(k, 3)`` of solutions as intervals of the rows that take them."""
    place = {int(i): row for row, i in enumerate(rows) if i >= 0}
    kept = [(place[int(i)], low, high) for i, low, high in arcs.tolist() if int(i) in place]
    return np.array(kept, dtype=np.float64).reshape(-1, 3)
