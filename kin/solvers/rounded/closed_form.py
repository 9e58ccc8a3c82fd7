"""The closed form of a family, made exact on a table that fits the family only nearly."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.angles import wrapped
from kin.axes import size
from kin.robot import Robot
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    SolverInput,
    WrappedForm,
    weakest,
)
from kin.solvers.numeric import descend_freely
from kin.solvers.rounded.six import SixJoints
from kin.transforms import Array

Flags = NDArray[np.bool_]
_MOVED = 0.1  # rad, m: a descent that goes farther has left the posture
_DIRECTIONS = np.concatenate([np.eye(6), -np.eye(6)])
# Where two limits of the reach meet, only a motion away from both leads back.
_CORNERS = np.array([
    [*np.eye(3)[i] * a + np.eye(3)[j] * b, 0.0, 0.0, 0.0]
    for i, j in ((0, 1), (0, 2), (1, 2)) for a in (1.0, -1.0) for b in (1.0, -1.0)
])  # fmt: skip
_MARGIN = 10.0  # times the rounding: how far from a target starts are looked for
_ABOUT = 1e-9  # m, rad: what is closer needs no descent with another task


class Rounded(WrappedForm):
    """The closed form of the nominal arm of a rounded table; its postures are exact on the table itself.

    Ranges of redundancy parameters and distances to singularities are those of the nominal arm. A row whose
    descent ends elsewhere is left out: a joint that is free in the family may have one value only on the table.
    """

    exact_ranges = False

    def __init__(self, robot: Robot, form: ClosedForm, off: float) -> None:
        self.robot, self.form = robot, form
        self.name, self.title, self.lengths = form.name, form.title, form.lengths
        self.named, self.steady, self.off = form.named, form.steady, off
        self.reason = (
            f"{form.reason}, but for rounding of the table ({off:.1g} rad or of the arm's size); "
            "every posture is made exact on the table as it is"
        )
        self.branches, self.meanings = form.names(robot, np.ones(robot.n))
        self._six = SixJoints(robot, form, off) if robot.n == 6 else None
        self._margin = _MARGIN * off * size(robot)
        self.kernels = self._kernels(form.kernels)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, each moved onto the target on the true table; requested values are kept."""
        p, found = problem, self.form.solve(problem)
        q, values = found.q, found.values.copy()
        parameters = tuple(enumerate(self.redundancies(p.task)))
        held = [r.joint for k, r in parameters if r.joint >= 0 and not math.isnan(p.values[k])]
        known = ~np.isnan(q[:, 0])
        six = self._six if p.task == POSE else None
        if six is not None:
            q = self._with_starts(self.form.kernels, p.T, p.seed, q)
        starts = q
        q, met = self._exact(p.T, p.task, q, held, known)
        for k, r in parameters:
            if r.joint >= 0:
                values[:, k] = np.where(np.isnan(values[:, k]), math.nan, q[:, r.joint])
        obstacle = None if not np.isnan(q).all() else found.obstacle
        completeness = weakest(found.completeness, "searched") if met else "unknown"
        if six is not None:
            q, completeness = six.completed(p.T, found.q, starts, q)
            if np.isnan(q).all() and found.gap < self._margin:  # the true table may just reach it
                completeness = "unknown"
        return Candidates(q, values, found.arcs, found.gap, obstacle, completeness)

    def _with_starts(self, form: BatchKernels, T: Array, near: Array, q: Array) -> Array:
        """The rows ``(k, 6)``, the missing ones from targets close by: the true table may just reach this one."""
        out, missing, rows = q.copy(), np.isnan(q[:, 0]), np.empty(q.shape)
        for i, direction in enumerate((*_DIRECTIONS, *_CORNERS)):
            if not missing.any() or (i >= len(_DIRECTIONS) and not missing.all()):
                break
            moved = T.copy()
            moved[:3, 3] += self._margin * direction[:3]
            moved[:3, :3] = T[:3, :3] + _MARGIN * self.off * np.cross(direction[3:], T[:3, :3].T).T
            form.one(form.params, moved, math.nan, near, rows)
            out[missing] = rows[missing]
            missing = np.isnan(out[:, 0])
        return out

    def _exact(self, T: Array, task: int, q: Array, held: list[int], known: Flags) -> tuple[Array, bool]:
        """Rows ``(k, n)`` moved onto the target, with the joints in `held` where they are.

        Those not `known` ``(k,)`` that do not meet the target do not exist. Also returns whether the others do.

        Arms with few joints miss a part of most poses: then rows meet what they can, the direction or the point.
        """
        out = np.array(q, order="C")
        there = np.flatnonzero(~np.isnan(out[:, 0]))
        for code in (task,) if self.robot.n >= 6 else dict.fromkeys((task, max(task, APPROACH), POSITION)):
            if not len(there):
                break
            rows, errors = descend_freely(self.robot.model, T, code, q[there], held)
            near = np.abs(rows - q[there]).max(axis=1) < _MOVED
            met = near & (errors < _ABOUT)
            out[there[met]] = rows[met]
            there = there[~met]
        out[there[~known[there]]] = math.nan
        return out, not known[there].any()

    def _kernels(self, form: BatchKernels) -> BatchKernels:
        """The batch kernels: those of the family, and a descent for each row."""
        held = [r.joint for r in self.redundancies(POSE) if r.joint >= 0 and not r.rare]

        def many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
            form.many(params, T, values, near, out)
            for k in range(len(T)):
                out[k] = self._row(form, T[k], near, out[k], held)

        return BatchKernels.of_many(form.params, many)

    def _row(self, form: BatchKernels, T: Array, near: Array, q: Array, held: list[int]) -> Array:
        """All branches of one target from those of the family ``(k, n)``."""
        known = ~np.isnan(q[:, 0])
        if self.robot.n == 6:
            q = self._with_starts(form, T, near, q)
        return self._wrapped(self._exact(T, POSE, q, held, known)[0], held)

    def _wrapped(self, q: Array, held: list[int]) -> Array:
        """The same with angles in (−π, π], but for joints whose values may be requested."""
        turns = self.robot.revolute.copy()
        turns[held] = False
        return np.where(turns, wrapped(q), q)

    def value_at(self, T: Array, q: Array) -> float:
        """The redundancy parameter of the nominal arm."""
        return self.form.value_at(T, q)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on, as the family has it."""
        return self.form.branch_of(q)
