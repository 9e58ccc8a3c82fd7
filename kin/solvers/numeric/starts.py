"""Descents from many starts: until one meets the target, or until the deepest valley has been met often enough."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.common import UNBOUNDED
from kin.solvers.numeric.descent import descend
from kin.solvers.numeric.error import Goal
from kin.solvers.numeric.step import Bounds
from kin.transforms import Array

_STEPS = 120  # of one descent at most
# A descent of `solve` must halve E² every few steps; the first ones are given this many.
_PATIENCE = 4
_SHORT = 40
_ALIKE = 1e-9  # metres; errors E this close are those of one minimum


@jit
def each_of(model: Array, goal: Goal, bounds: Bounds, enough: float, meetings: int, q: Array, costs: Array) -> int:
    """Move the rows of q ``(k, n)`` to local minima, in place; costs ``(k,)`` ← E there; returns how many were.

    Stops after the first with E ≤ `enough`, and once `meetings` descents have ended as low as the best: by then a
    deeper valley would hardly have been missed.
    """
    best = math.inf
    met = count = 0
    while count < q.shape[0] and best > enough and met < meetings:
        cost = descend(model, goal, bounds, _STEPS, 0, q[count])
        costs[count] = cost
        count += 1
        if cost < best - _ALIKE:
            met = 1
        elif cost <= best + _ALIKE:
            met += 1
        best = min(best, cost)
    return count


def descend_freely(
    model: Array, T: Array, task: int, starts: Array, held: Sequence[int] = ()
) -> tuple[Array, Array]:
    """Where descents from the starts ``(k, n)`` end, and their errors ``(k,)``; a radian is worth a metre.

    There are no limits, but the joints `held` stay as they are.
    """
    rows, errors = np.array(starts, order="C"), np.empty(len(starts))
    goal = (np.ascontiguousarray(T), task, np.append(np.ones(6), 0.0), 1.0)
    upper = np.full(rows.shape[1], UNBOUNDED)
    lower, turns = -upper, np.zeros(len(upper))
    if not held:
        each_of(model, goal, (lower, upper, turns), -1.0, len(rows) + 1, rows, errors)
        return rows, errors
    for k in range(len(rows)):
        lower[held] = upper[held] = rows[k, held]
        each_of(model, goal, (lower, upper, turns), -1.0, 2, rows[k : k + 1], errors[k : k + 1])
    return rows, errors


@jit
def _golden(n: int) -> float:
    """The generalised golden ratio φ with φ^(n+1) = φ + 1, of which each dimension takes another power."""
    phi = 2.0
    for _ in range(40):
        phi = (1.0 + phi) ** (1.0 / (n + 1))
    return phi


@jit
def solve(model: Array, goal: Goal, bounds: Bounds, budget: int, enough: float, out: Array) -> tuple[float, int]:
    """out ← the first configuration ``(n,)`` found with E ≤ `enough`; returns (E, number of starts used).

    The first start is what out holds, the others are the points of `spread`, `budget` in all (at least 1). If none
    meets the target, out is the best minimum that was reached.
    """
    lower, upper, _ = bounds
    n = out.shape[0]
    q = np.empty(n)
    phi = 0.0
    best = math.inf
    for start in range(budget + 1):
        step = 1.0
        if start == 1:
            phi = _golden(n)
        for i in range(n):
            q[i] = out[i]
            if 0 < start < budget:
                step /= phi
                low = lower[i] if math.isfinite(lower[i]) else -math.pi
                high = upper[i] if math.isfinite(upper[i]) else math.pi
                q[i] = low + (0.5 + start * step) % 1.0 * (high - low)
        # At last the best of all is followed to the end of its valley.
        patience = _PATIENCE + start // 8 if start < budget else 0
        steps = min(_SHORT + start, _STEPS) if start < budget else _STEPS
        cost = descend(model, goal, bounds, steps, patience, q)
        if cost < best:
            best = cost
            for i in range(n):
                out[i] = q[i]
            if best <= enough:
                return best, min(start + 1, budget)
    return best, budget


def spread(lower: Array, upper: Array, count: int) -> Array:
    """`count` configurations spread evenly over the limits ``(count, n)``: an additive recurrence.

    The generalised golden ratio gives every dimension its own irrational step.
    """
    n = len(lower)
    alpha = _golden(n) ** -np.arange(1, n + 1)
    low = np.where(np.isfinite(lower), lower, -math.pi)
    high = np.where(np.isfinite(upper), upper, math.pi)
    points = (0.5 + np.outer(np.arange(1, count + 1), alpha)) % 1.0
    return np.asarray(low + points * (high - low))
