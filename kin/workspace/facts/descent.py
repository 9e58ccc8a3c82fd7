"""Where a quadratic of the tool point is least inside the joint limits: one compiled descent for all questions.

The farthest point, the nearest one to an axis, the reach along x, the configuration closest to a target: each is a
minimum of

    f(q) = ½ (p − c)ᵀ D (p − c) + gᵀ (p − c),    p the tool point of q,

for some centre c, symmetric D and slope g. With w = D (p − c) + g its derivatives are exact and cheap,

    ∂f/∂qⱼ = w·Jⱼ,    ∂²f/∂qᵢ∂qⱼ = Jᵢᵀ D Jⱼ + w·(zᵢ × Jⱼ)  for i ≤ j (the second term only if joint i turns),

so the descent is Newton's, with a shift that makes the matrix positive, on the joints that are not held by a stop
(Nocedal & Wright, Numerical Optimization, chapters 3 and 16). It is quadratic to the last digit where Gauss–Newton
would creep: at the envelope the tool cannot follow its target, and the arm is singular or at stops.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.fk import fk_into
from kin.kernels.jacobian import jacobian_into
from kin.transforms import Array

Room = tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array, Array]

_STEPS = 100
_LONGEST = 0.7  # of a step, rad or m
_DIGITS = 1e-16
_HARMLESS = 1e-6  # a shift below this part of the matrix does not hold a step back
_LEAST_SHIFT = 1e-8  # of the matrix: near the envelope valleys are a million times as long as they are wide
_SHORTEST = 1e-9  # rad or m
_FLAT = 1e-13  # a slope below this times the arm's own scale is none


@jit
def _height(T: Array, f: Array, w: Array) -> float:
    """f at the point of T; w ← its gradient there. `f` holds D (9), c (3) and g (3)."""
    x, y, z = T[0, 3] - f[9], T[1, 3] - f[10], T[2, 3] - f[11]
    total = 0.0
    for r in range(3):
        bent = f[3 * r] * x + f[3 * r + 1] * y + f[3 * r + 2] * z
        w[r] = bent + f[12 + r]
        total += (0.5 * bent + f[12 + r]) * (x if r == 0 else y if r == 1 else z)
    return total


@jit
def _solve(H: Array, slope: Array, shift: float, free: Array, L: Array, step: Array) -> bool:
    """step ← −(H + shift) ⁻¹ slope on the free joints, by Cholesky; False if that is not positive."""
    n = slope.shape[0]
    for i in range(n):
        step[i] = 0.0
        if free[i] == 0.0:
            continue
        for j in range(i + 1):
            if free[j] == 0.0:
                continue
            total = H[i, j]
            if i == j:
                total += shift
            for k in range(j):
                if free[k] != 0.0:
                    total -= L[i, k] * L[j, k]
            if i == j:
                if not total > 1e-12 * (abs(H[i, i]) + shift):
                    return False
                L[i, i] = math.sqrt(total)
            else:
                L[i, j] = total / L[j, j]
    for i in range(n):
        if free[i] != 0.0:
            total = -slope[i]
            for k in range(i):
                if free[k] != 0.0:
                    total -= L[i, k] * step[k]
            step[i] = total / L[i, i]
    for i in range(n - 1, -1, -1):
        if free[i] != 0.0:
            total = step[i]
            for k in range(i + 1, n):
                if free[k] != 0.0:
                    total -= L[k, i] * step[k]
            step[i] = total / L[i, i]
    return True


@jit
def settle(
    model: Array, f: Array, low: Array, high: Array, enough: float, grain: float, q: Array,
    work: Room,
) -> float:  # fmt: skip
    """Move q ``(n,)``, in place and inside [low, high], to a local minimum of f; returns f there.

    `f` ``(15,)`` is D row by row, c, g. The descent ends early once f ≤ `enough`, and
    when a step promises less than the part `grain` of f. `work`: `room(n)` scratch.
    """
    n = q.shape[0]
    J, H, L, axes, T, slope, free, step, trial, w = work
    for j in range(n):
        q[j] = min(max(q[j], low[j]), high[j])
    jacobian_into(model, q, J, T, axes)
    height = _height(T, f, w)
    shift = 0.0
    for _ in range(_STEPS):
        if height <= enough:
            break
        steepest = 0.0
        scale = 0.0
        for j in range(n):
            slope[j] = w[0] * J[0, j] + w[1] * J[1, j] + w[2] * J[2, j]
            held = (q[j] <= low[j] and slope[j] >= 0.0) or (q[j] >= high[j] and slope[j] <= 0.0)
            free[j] = 0.0 if held else 1.0
            if not held:
                steepest = max(steepest, abs(slope[j]))
        for j in range(n):
            if free[j] == 0.0:
                continue
            bx = f[0] * J[0, j] + f[1] * J[1, j] + f[2] * J[2, j]
            by = f[3] * J[0, j] + f[4] * J[1, j] + f[5] * J[2, j]
            bz = f[6] * J[0, j] + f[7] * J[1, j] + f[8] * J[2, j]
            for i in range(j + 1):
                if free[i] == 0.0:
                    continue
                # w · (z × J) with the joint's axis z, which is zero here for a sliding joint.
                cx = J[4, i] * J[2, j] - J[5, i] * J[1, j]
                cy = J[5, i] * J[0, j] - J[3, i] * J[2, j]
                cz = J[3, i] * J[1, j] - J[4, i] * J[0, j]
                h = J[0, i] * bx + J[1, i] * by + J[2, i] * bz + w[0] * cx + w[1] * cy + w[2] * cz
                H[i, j] = h
                H[j, i] = h
            scale = max(scale, abs(H[j, j]))
        if steepest <= _FLAT * scale or steepest == 0.0:
            break
        improved = False
        last = False
        for _ in range(40):
            if _solve(H, slope, shift, free, L, step):
                longest = 0.0
                gain = 0.0
                for j in range(n):
                    longest = max(longest, abs(step[j]))
                    gain -= 0.5 * step[j] * slope[j]
                # So little is promised that f cannot tell; the step still brings q nearer. A step that is held
                # back by the shift promises little too, far from the end.
                little = gain <= grain * (abs(height) + _DIGITS * scale)
                last = little and (shift <= _HARMLESS * scale or longest < _SHORTEST)
                shorter = min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
                for j in range(n):
                    trial[j] = min(max(q[j] + shorter * step[j], low[j]), high[j])
                fk_into(model, trial, T)
                lower = _height(T, f, w)
                if lower < height or (last and lower <= height + _DIGITS * scale):
                    improved = True
                    break
                if last:
                    break
            shift = max(8.0 * shift, _LEAST_SHIFT * scale, 1e-15)
        if not improved:
            break
        for j in range(n):
            q[j] = trial[j]
        jacobian_into(model, q, J, T, axes)
        height = _height(T, f, w)
        if last:
            break
        shift = 0.0 if shift < 10.0 * _LEAST_SHIFT * scale else 0.1 * shift
    return height


@jit
def room(n: int) -> Room:
    """Scratch of descents with n joints: J, H, L, axes, T, slope, free, step, trial, w."""
    return (
        np.empty((6, n)),
        np.empty((n, n)),
        np.empty((n, n)),
        np.empty((n, 7)),
        np.empty((4, 4)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(3),
    )


@jit
def settle_each(model: Array, f: Array, low: Array, high: Array, q: Array, heights: Array) -> None:
    """Move every row of q ``(k, n)`` to a local minimum of f, in place; heights ``(k,)`` ← f there."""
    work = room(q.shape[1])
    for i in range(q.shape[0]):
        heights[i] = settle(model, f, low, high, -math.inf, 1e-15, q[i], work)
