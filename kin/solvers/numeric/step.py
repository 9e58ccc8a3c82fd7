"""One damped step inside the limits: an active set of joints that are held at theirs."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.kernels.dense import packed, solve_positive
from kin.transforms import Array

Bounds = tuple[Array, Array, Array]  # lower, upper, turns
STRIDE = 1.5  # radians or metres of one joint in one step at most


@jit
def solve_free(H: Array, g: Array, free: NDArray[np.bool_], damping: float, L: Array, x: Array) -> bool:
    """x ← (H + damping · I)⁻¹ g on the free indices, given x on the others; False if that is not positive.

    H is a lower triangle; L ``(n, n)`` is scratch.
    """
    n, k = g.shape[0], 0
    m, y = packed(H, free, L), np.empty(n)
    for i in range(n):
        if free[i]:
            y[k] = g[i]
            for j in range(n):
                if not free[j]:
                    y[k] -= (H[i, j] if j < i else H[j, i]) * x[j]
            k += 1
    if not solve_positive(L, m, damping, 0.0, y):
        return False
    for i in range(n - 1, -1, -1):
        if free[i]:
            k -= 1
            x[i] = y[k]
    return True


@jit
def inside(x: float, low: float, high: float, turn: float) -> float:
    """x, or its image x + k·turn inside [low, high] if there is one, or the nearer end."""
    if low <= x <= high:
        return x
    if turn > 0.0:
        y = x - turn * math.ceil((x - high) / turn) if x > high else x + turn * math.ceil((low - x) / turn)
        if low <= y <= high:
            return y
    return min(max(x, low), high)


@jit
def bounded_step(
    H: Array, g: Array, q: Array, bounds: Bounds, damping: float, held: NDArray[np.bool_], L: Array, step: Array,
    trial: Array,
) -> bool:  # fmt: skip
    """step, trial ← the damped step and where it leads, inside the limits; False if H + damping is not positive.

    A joint that would pass a limit goes to the limit, and the others are solved again with it held there.
    """
    lower, upper, turns = bounds
    n = q.shape[0]
    free = np.empty(n, dtype=np.bool_)
    for i in range(n):
        free[i] = not held[i]
        step[i] = 0.0
    for _ in range(n + 1):
        if not solve_free(H, g, free, damping, L, step):
            return False
        longest = 0.0
        for i in range(n):
            longest = max(longest, abs(step[i]))
        shrink = STRIDE / longest if longest > STRIDE else 1.0
        stopped = False
        for i in range(n):
            step[i] *= shrink
            x = q[i] + step[i]
            trial[i] = inside(x, lower[i], upper[i], turns[i])
            if free[i] and ((x < lower[i] and trial[i] == lower[i]) or (x > upper[i] and trial[i] == upper[i])):
                step[i] = trial[i] - q[i]
                free[i] = False
                stopped = True
        if not stopped or shrink < 1.0:
            break
    return True


@jit
def hold(q: Array, g: Array, bounds: Bounds, held: NDArray[np.bool_]) -> float:
    """held ``(n,)`` ← the joints at a limit that −gradient g pushes against; returns the steepest slope left."""
    lower, upper, turns = bounds
    slope = 0.0
    for i in range(q.shape[0]):
        outwards = (q[i] <= lower[i] and g[i] < 0.0) or (q[i] >= upper[i] and g[i] > 0.0)
        gap = turns[i] - (upper[i] - lower[i])
        # A gap that the step may leap is left to the step.
        held[i] = outwards and (turns[i] == 0.0 or gap >= STRIDE)
        if not outwards or (turns[i] > 0.0 and gap <= 0.0):
            slope = max(slope, abs(g[i]))
    return slope


@jit
def promised_decrease(H: Array, g: Array, step: Array) -> float:
    """The decrease of E²/2 that the quadratic model predicts for a step; H is a lower triangle."""
    promised = 0.0
    for i in range(step.shape[0]):
        half = 0.5 * H[i, i] * step[i]
        for j in range(i):
            half += H[i, j] * step[j]
        promised += step[i] * (g[i] - half)
    return promised
