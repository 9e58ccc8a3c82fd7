"""Six joints on a rounded table: which postures of the exact arm carry over, and what is looked for besides.

The pose of the typed arm differs from that of the exact one by no more than η, about the rounding. Where the
smallest singular value σ of the Jacobian is well above √η, a theorem of Newton and Kantorovich gives each posture
of either arm exactly one of the other arm, within 2 η/σ. Such postures are *regular*. Eight regular postures are
all that the family can have, at this target and at those within η: then none is missing, which is proved.

Elsewhere the two arms may differ. Where the exact arm has fewer postures than its family, targets a little off
show whether more are near. Close to folds, postures are looked for along the directions in which the arm barely
moves, from two sets of starts. Where both find the same, the answer is agreed, not proved.

Where they do not, the elimination for any arm with six joints is asked, which knows nothing of the family: of the
table as it is. What it certifies, and what was found here is among, is agreed.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kin.angles import apart
from kin.axes import size
from kin.differential.error import task_error
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.contract import POSE, ClosedForm, Completeness
from kin.solvers.curves import curves_among
from kin.solvers.general6 import General6
from kin.solvers.general6 import match as general
from kin.solvers.numeric import descend_freely
from kin.transforms import Array

Flags = NDArray[np.bool_]
_JOINTS = np.arange(6)
_REGULAR = 2.5  # times the root of the rounding: singular values of regular postures
_MOVED = 20.0  # times the rounding, over the singular value: how far a regular posture moves at most
_MET, _SAME = 1e-10, 1e-6
_NEAR = 1e-4  # of the arm's size: a descent that stalled with less error may be between two postures
_NEWTON = 8
_CLOSE = 0.02  # rad: how far Newton's steps may lead
_STEP = 1e-3  # rad, of second differences
_AMONG = 1e-4  # rad: beside a fold, a posture found by descent is so far from the exact one
_DOUBLE = 1e-5  # smallest singular value of a posture whose twin may be the same in floating point
_SHARES = np.array([0.003, -0.01, 0.03, -0.1, 0.3, -1.0, 3.0])  # rad along a weak direction


class SixJoints:
    """The search for the postures of one rounded arm with six joints, in the rows of its family."""

    def __init__(self, robot: Robot, form: ClosedForm, off: float) -> None:
        self.robot, self.form, self.off, self.size = robot, form, off, size(robot)

    def completed(self, T: Array, exact: Array, starts: Array, q: Array) -> tuple[Array, Completeness]:
        """The postures ``(k, 6)`` of a pose, and how it is known that these are all.

        Args:
            exact: ``(k, 6)`` those of the exact arm, NaN where there is none.
            starts: the same, the missing ones from targets close by.
            q: the starts moved onto the target; NaN, or as they were, where that failed.
        """
        found, known = self._by_continuation(T, exact, starts, q)
        return (found, known) if known != "unknown" else self._by_elimination(T, found)

    @cached_property
    def _general(self) -> General6 | None:
        """The elimination for the table as it is."""
        return general(self.robot)

    def _by_elimination(self, T: Array, q: Array) -> tuple[Array, Completeness]:
        """The rows q ``(k, 6)`` and those that an elimination finds; agreed if it certifies that these are all."""
        if self._general is None:
            return q, "unknown"
        out = np.empty((len(self._general.branches), 6))
        known = self._general.add_missing(T, np.zeros(6), out)
        rows, curves = self._without_curves(T, out[~np.isnan(out[:, 0])])
        rows = rows[np.abs(fk(self.robot, rows) - T).max(axis=(1, 2), initial=0.0) < _MET]
        there = ~np.isnan(q[:, 0])
        there[there] = np.abs(fk(self.robot, q[there]) - T).max(axis=(1, 2), initial=0.0) < _MET
        nearest = [apart(rows, row) for row in q[there]] if len(rows) else []
        among = len(nearest) == int(there.sum()) and all(away.min() < _AMONG for away in nearest)
        sure = known == "proved" or (known == "agreed" and len(rows) == there.sum())
        if curves or not (sure and among and 0 < len(rows) <= len(q) and len(rows) % 2 == 0):
            return self._in_rows(q, there, rows), "unknown"
        # The exact ones, each in the row of the posture that was found near it.
        exact = np.full_like(q, math.nan)
        for place, away in zip(np.flatnonzero(there).tolist(), nearest, strict=True):
            exact[place] = rows[int(away.argmin())]
        exact, there = _each_once(exact, there)
        return self._in_rows(exact, there, rows), "agreed"

    def _by_continuation(self, T: Array, exact: Array, starts: Array, q: Array) -> tuple[Array, Completeness]:
        """`completed` from the postures of the exact arm alone."""
        given = ~np.isnan(starts[:, 0])
        there = given & ~np.isnan(q[:, 0])
        there[there] = np.abs(fk(self.robot, q[there]) - T).max(axis=(1, 2), initial=0.0) < _MET
        sigma = self._weak(q[there])[0][:, 0]
        moved = apart(q[there], starts[there])
        regular = there.copy()
        regular[there] = (sigma > _REGULAR * math.sqrt(self.off)) & (moved * sigma < _MOVED * self.off)
        as_exact = np.array_equal(given, ~np.isnan(exact[:, 0]))
        if not as_exact or not np.array_equal(regular, given):
            return self._searched(T, starts, q, there, given if not as_exact else given & ~regular)
        if len(_unique(q[there])) < there.sum():
            return q, "unknown"
        return q, "proved" if given.all() else "agreed"

    def _searched(
        self, T: Array, starts: Array, q: Array, there: Flags, doubtful: Flags
    ) -> tuple[Array, Completeness]:
        """`completed` by a search around the postures that are not regular: the flags are ``(k,)``."""
        q, there = self._polished(T, q, there)
        known = np.ascontiguousarray(q[there])
        rows = starts[doubtful]
        sigma, vectors = self._weak(rows)
        flat = sigma[:, 1] < math.sqrt(self.off)
        sets = []
        for shares in (_SHARES, -_SHARES):
            tried = rows[:, None] + shares[:, None] * vectors[:, None, 5]
            grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2)
            wide = rows[flat][:, None] + np.einsum("gc,kcn->kgn", grid, vectors[flat][:, 4:])
            ends = self._descended(T, np.concatenate([tried.reshape(-1, 6), wide.reshape(-1, 6)]))
            sets.append(self._without_curves(T, np.concatenate([known, ends]))[0])
        found, curves = self._without_curves(T, np.concatenate([known, *sets]))
        agreed = len(found) == len(sets[0]) == len(sets[1]) <= len(q) and not flat.any()
        # As many as the family has at most: what stalled is none. With fewer, both sets may have missed a pair.
        agreed &= len(found) + curves == len(q)
        single = bool((self._weak(found)[0][:, 0] > _DOUBLE).all())
        even = curves > 0 or (len(found) % 2 == 0 and single)
        return self._in_rows(q, there, found), "agreed" if agreed and even and len(found) else "unknown"

    def _weak(self, q: Array) -> tuple[Array, Array]:
        """The two smallest singular values ``(k, 2)``, lengths in arm sizes, and right singular vectors."""
        _, sigma, vectors = np.linalg.svd(self._jacobian(q))
        return np.asarray(sigma[:, :3:-1]), np.asarray(vectors)

    def _descended(self, T: Array, starts: Array) -> Array:
        """Where descents from `starts` ``(k, 6)`` meet the target.

        A descent creeps in the valley between two postures that have almost merged. Newton's steps leave it.
        """
        rows, errors = descend_freely(self.robot.model, T, POSE, starts)
        beside = _unique(rows[(errors >= _MET) & (errors < _NEAR * self.size)])
        ends, met = self._newton(T, beside)
        others, reached = self._newton(T, self._across(T, beside[~met]).reshape(-1, 6))
        # Near a fold the error of a posture is far larger than that of its pose: only exact ones can be compared.
        exact, _ = self._newton(T, _unique(rows[errors < _MET]))
        return np.concatenate([exact, ends[met], others[reached]])

    def _polished(self, T: Array, q: Array, there: Flags) -> tuple[Array, Flags]:
        """The rows q ``(k, 6)`` on the target to the last digit, each posture once, and which are there.

        Beside a fold a pose met to 1e-10 leaves its posture uncertain by far more, so one could be counted twice.
        """
        out = q.copy()
        out[there] = self._newton(T, q[there])[0]
        return _each_once(out, there)

    def _errors(self, T: Array, q: Array) -> Array:
        """Twists ``(k, 6)`` that would bring the tool from where it is onto the target, lengths in arm sizes."""
        return np.asarray(task_error(self.robot, q, T, "pose") / np.repeat([self.size, 1.0], 3))

    def _newton(self, T: Array, q: Array) -> tuple[Array, Flags]:
        """Newton's method without damping from rows ``(k, 6)``, and which it brings onto the target close by.

        The others stay: a step from between two postures may lead to any other one.
        """
        out = q
        for _ in range(_NEWTON if len(q) else 0):
            inverse = np.linalg.pinv(self._jacobian(out), rcond=1e-14)
            out = out + np.clip(np.einsum("kij,kj->ki", inverse, self._errors(T, out)), -1.0, 1.0)
        met = (np.abs(self._errors(T, out)).max(axis=1, initial=0.0) < 0.1 * _MET) & (apart(out, q) < _CLOSE)
        return np.where(met[:, None], out, q), met

    def _across(self, T: Array, q: Array) -> Array:
        """Near the two postures ``(k, 2, 6)`` on either side of configurations between them, if there are two.

        Along the weak direction v the error that no motion corrects is a quadratic: its value and its curvature.
        """
        if not len(q):
            return np.empty((0, 2, 6))
        U, _, V = np.linalg.svd(self._jacobian(q))
        weak, lost, step = V[:, 5], U[:, :, 5], _STEP * V[:, 5]
        here = self._errors(T, q)
        bent = (self._errors(T, q + step) + self._errors(T, q - step) - 2.0 * here) / _STEP**2
        value, curvature = ((lost * each).sum(axis=1) for each in (here, bent))
        square = -2.0 * value / np.where(curvature == 0.0, 1e-300, curvature)
        along = np.sqrt(np.clip(square, 0.0, 1.0))[:, None] * weak
        return np.stack([q + along, q - along], axis=1)

    def _jacobian(self, q: Array) -> Array:
        """Jacobians ``(k, 6, 6)``, lengths in arm sizes."""
        J = jacobian(self.robot, q)
        J[:, :3] /= self.size
        return J

    def _without_curves(self, T: Array, rows: Array) -> tuple[Array, int]:
        """The configurations ``(k, 6)``, each once and of those on one curve the first, and how many curves."""
        rows = _unique(rows)
        curves, kept = curves_among(self.robot, T, POSE, _JOINTS, rows, list(range(len(rows))))
        return rows[kept], len(curves)

    def _in_rows(self, q: Array, there: Flags, found: Array) -> Array:
        """The rows ``(k, 6)`` with what was found besides in the rows of its branch, or in any that are free."""
        out, free = q.copy(), ~there
        for row in found:
            if (apart(q[there], row) < _SAME).any() or not free.any():
                continue
            own = self.form.branch_of(row)
            place = own if free[own] else int(np.flatnonzero(free)[0])
            out[place], free[place] = row, False
        return out


def _each_once(q: Array, there: Flags) -> tuple[Array, Flags]:
    """The rows ``(k, 6)`` that are there, of equal ones the first; the others are NaN."""
    out, kept = q.copy(), there.copy()
    for i in np.flatnonzero(there)[1:].tolist():
        if (apart(out[:i][kept[:i]], out[i]) < _SAME).any():
            out[i], kept[i] = math.nan, False
    return out, kept


def _unique(rows: Array) -> Array:
    """The configurations ``(k, 6)``, each once."""
    kept: list[int] = []
    same = apart(rows[:, None], rows) <= _SAME
    for i in range(len(rows)):
        if not same[i, kept].any():
            kept.append(i)
    return np.ascontiguousarray(rows[kept])
