"""Local minima of a quadratic function of the tool point inside the joint limits: one compiled Newton descent.

The farthest point, the nearest one to an axis, the reach along x, the configuration closest to a target: each is a
minimum of

    f(q) = ½ (p − c)ᵀ D (p − c) + gᵀ (p − c),    p the tool point of q,

for some centre c, symmetric matrix D and slope g. With w = D (p − c) + g its derivatives are exact and cheap,

    ∂f/∂qⱼ = w·Jⱼ,    ∂²f/∂qᵢ∂qⱼ = Jᵢᵀ D Jⱼ + w·(zᵢ × Jⱼ)  for i ≤ j (second term: joint i revolute),

so the descent is Newton's method, with a shift that makes the Hessian positive definite, on the joints that are
not at a limit which f pushes them against (Nocedal & Wright, Numerical Optimization, chapters 3 and 16). It
converges quadratically to the last digit where Gauss–Newton would creep: at the envelope the tool cannot follow
its target, and the arm is singular or at limits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.dense import packed, solve_positive
from kin.kernels.jacobian import jacobian_into
from kin.transforms import Array
from kin.workspace.region import BoundedArm

_STEPS = 100
_TRIALS = 40  # shifts per step
_LONGEST = 0.7  # of a step, rad or m
_DIGITS = 1e-16
_HARMLESS = 1e-6  # a shift smaller than this fraction of the Hessian does not shorten a step
_LEAST_SHIFT = 1e-8  # fraction of the Hessian: near the envelope valleys are a million times as long as wide
_SHORTEST = 1e-9  # rad or m
_FLAT = 1e-13  # a slope smaller than this fraction of the Hessian counts as zero


class Scratch(NamedTuple):
    """Arrays that a descent of n joints works in.

    Attributes:
        J: ``(6, n)`` Jacobian at q.
        H: ``(n, n)`` Hessian of f.
        L: ``(n, n)`` its Cholesky factor.
        axes: ``(n, 7)`` scratch of the Jacobian.
        T: ``(4, 4)`` tool pose.
        slope: ``(n,)`` gradient of f with respect to q.
        free: ``(n,)`` 1.0 for a joint that may move, 0.0 for one held at a limit.
        q, step, trial: ``(n,)`` configuration of the caller's descent, Newton step, configuration after it.
        w: ``(3,)`` gradient of f with respect to the tool point.
    """

    J: Array
    H: Array
    L: Array
    axes: Array
    T: Array
    slope: Array
    free: Array
    q: Array
    step: Array
    trial: Array
    w: Array


@jit
def make_scratch(n: int) -> Scratch:
    """Scratch of descents with n joints."""
    return Scratch(
        np.empty((6, n)),
        np.empty((n, n)),
        np.empty((n, n)),
        np.empty((n, 7)),
        np.empty((4, 4)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(3),
    )


def quadratic(D: Array | None = None, centre: Array | None = None, slope: Array | None = None) -> Array:
    """½ (p − c)ᵀ D (p − c) + gᵀ (p − c) as `minimise` takes it: ``(15,)``, D row by row, c, g."""
    zero = np.zeros(3)
    parts = (
        np.zeros(9) if D is None else D.ravel(),
        zero if centre is None else centre,
        zero if slope is None else slope,
    )
    return np.concatenate(parts).astype(np.float64)


@jit
def _evaluate(T: Array, f: Array, w: Array) -> float:
    """f at the tool point of T; w ← its gradient there."""
    x, y, z = T[0, 3] - f[9], T[1, 3] - f[10], T[2, 3] - f[11]
    total = 0.0
    for r in range(3):
        bent = f[3 * r] * x + f[3 * r + 1] * y + f[3 * r + 2] * z
        w[r] = bent + f[12 + r]
        total += (0.5 * bent + f[12 + r]) * (x if r == 0 else y if r == 1 else z)
    return total


@jit
def _gradient(arm: BoundedArm, q: Array, work: Scratch) -> float:
    """work.slope and work.free ← gradient and free joints at q; returns the largest slope of a free joint."""
    J, w = work.J, work.w
    steepest = 0.0
    for j in range(q.shape[0]):
        slope = w[0] * J[0, j] + w[1] * J[1, j] + w[2] * J[2, j]
        held = (q[j] <= arm.lower[j] and slope >= 0.0) or (q[j] >= arm.upper[j] and slope <= 0.0)
        work.slope[j] = slope
        work.free[j] = 0.0 if held else 1.0
        if not held:
            steepest = max(steepest, abs(slope))
    return steepest


@jit
def _hessian(f: Array, work: Scratch) -> float:
    """work.H ← Hessian over the free joints; returns its largest diagonal entry."""
    J, H, free, w = work.J, work.H, work.free, work.w
    scale = 0.0
    for j in range(free.shape[0]):
        if free[j] == 0.0:
            continue
        bx = f[0] * J[0, j] + f[1] * J[1, j] + f[2] * J[2, j]
        by = f[3] * J[0, j] + f[4] * J[1, j] + f[5] * J[2, j]
        bz = f[6] * J[0, j] + f[7] * J[1, j] + f[8] * J[2, j]
        for i in range(j + 1):
            if free[i] == 0.0:
                continue
            # w · (z × J) with the joint axis z; its rows of J are zero for a prismatic joint.
            cx = J[4, i] * J[2, j] - J[5, i] * J[1, j]
            cy = J[5, i] * J[0, j] - J[3, i] * J[2, j]
            cz = J[3, i] * J[1, j] - J[4, i] * J[0, j]
            h = J[0, i] * bx + J[1, i] * by + J[2, i] * bz + w[0] * cx + w[1] * cy + w[2] * cz
            H[i, j] = h
            H[j, i] = h
        scale = max(scale, abs(H[j, j]))
    return scale


@jit
def _newton_step(shift: float, work: Scratch) -> bool:
    """work.step ← −(H + shift)⁻¹ slope on the free joints; False if that is not positive definite."""
    slope, free, step = work.slope, work.free, work.step
    m, k = packed(work.H, free, work.L), 0
    for i in range(slope.shape[0]):
        if free[i]:
            step[k] = -slope[i]
            k += 1
    if not solve_positive(work.L, m, shift, 1e-12, step):
        return False
    for i in range(slope.shape[0] - 1, -1, -1):
        k -= 1 if free[i] else 0
        step[i] = step[k] if free[i] else 0.0
    return True


@jit
def _descend_once(
    arm: BoundedArm, f: Array, grain: float, height: float, scale: float, shift: float, q: Array, work: Scratch
) -> tuple[bool, bool, float, float]:
    """work.trial ← a configuration where f is less than `height`, with growing shifts until there is one.

    Returns whether there is one, whether the descent ends with it, the shift that was needed, and f there. Nearly
    every trial is accepted, so each computes the Jacobian that the next step needs, too (work.J, work.T, work.w).
    """
    step, trial, slope = work.step, work.trial, work.slope
    for _ in range(_TRIALS):
        if _newton_step(shift, work):
            longest = 0.0
            gain = 0.0
            for j in range(q.shape[0]):
                longest = max(longest, abs(step[j]))
                gain -= 0.5 * step[j] * slope[j]
            # The predicted gain may be too small for f to show it, and the step still brings q closer. A step that
            # the shift shortens predicts a small gain too, far from the minimum.
            little = gain <= grain * (abs(height) + _DIGITS * scale)
            last = little and (shift <= _HARMLESS * scale or longest < _SHORTEST)
            shorter = min(1.0, _LONGEST / longest) if longest > 0.0 else 1.0
            for j in range(q.shape[0]):
                trial[j] = min(max(q[j] + shorter * step[j], arm.lower[j]), arm.upper[j])
            jacobian_into(arm.model, trial, work.J, work.T, work.axes)
            lower = _evaluate(work.T, f, work.w)
            if lower < height or (last and lower <= height + _DIGITS * scale):
                return True, last, shift, lower
            if last:
                return False, True, shift, height
        shift = max(8.0 * shift, _LEAST_SHIFT * scale, 1e-15)
    return False, False, shift, height


@jit
def minimise(arm: BoundedArm, f: Array, enough: float, grain: float, q: Array, work: Scratch) -> float:
    """Move q ``(n,)`` inside the joint limits to a local minimum of f; returns f there.

    Args:
        arm: the arm and its limits.
        f: ``(15,)`` the function, from `quadratic`.
        enough: the descent ends once f ≤ `enough`.
        grain: the descent ends when a step would lower f by less than this fraction.
        q: start on entry, minimum on return.
        work: from `make_scratch`.
    """
    for j in range(q.shape[0]):
        q[j] = min(max(q[j], arm.lower[j]), arm.upper[j])
    jacobian_into(arm.model, q, work.J, work.T, work.axes)
    height = _evaluate(work.T, f, work.w)
    shift = 0.0
    for _ in range(_STEPS):
        if height <= enough:
            break
        steepest = _gradient(arm, q, work)
        scale = _hessian(f, work)
        if steepest <= _FLAT * scale or steepest == 0.0:
            break
        improved, last, shift, height = _descend_once(arm, f, grain, height, scale, shift, q, work)
        if not improved:
            break
        for j in range(q.shape[0]):
            q[j] = work.trial[j]
        if last:
            break
        shift = 0.0 if shift < 10.0 * _LEAST_SHIFT * scale else 0.1 * shift
    return height


@jit
def minimise_each(arm: BoundedArm, f: Array, q: Array, heights: Array) -> None:
    """Move every row of q ``(k, n)`` to a local minimum of f, in place; heights ``(k,)`` ← f there."""
    work = make_scratch(q.shape[1])
    for i in range(q.shape[0]):
        heights[i] = minimise(arm, f, -math.inf, 1e-15, q[i], work)
