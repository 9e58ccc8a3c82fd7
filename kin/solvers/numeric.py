"""A numeric solver for any chain: bounded Levenberg–Marquardt on the task error, from several starts.

It answers what the closed forms do not: what is the *closest* configuration inside the limits when a target
cannot be met, and how to meet a task that has no closed form. It minimises

    E(q)² = |Δp|² + (ℓ · angle)²

with Δp the position error in metres, the angle between the orientations (pose) or approach directions
(approach; ignored for position), and ℓ metres per radian. The angle's gradient is exact at any size: the log of
a rotation is its own image under the inverse left Jacobian. A mask keeps some of the six coordinates (Δp, φ) of
the error in the target's or the base frame; there that Jacobian has to be applied. Joints at a limit whose
gradient pushes outwards are held (projection), the others take a damped Gauss–Newton step (Nocedal & Wright,
Numerical Optimization, chapters 10 and 16).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels import fk_into, jacobian_into, jit
from kin.solvers.common import APPROACH, MASK, POSE, POSITION, relative_pose
from kin.transforms import Array

_STEPS = 120


@jit
def _task_error(T: Array, target: Array, task: int, mask: Array, weight: float, e: Array) -> float:
    """e ← weighted error twist (6,) that would move T onto the target; returns half its square."""
    if task == MASK:
        relative_pose(T, target, mask[6] == 0.0, e)
        total = 0.0
        for r in range(6):
            e[r] *= -mask[r] if r < 3 else -mask[r] * weight
            total += e[r] * e[r]
        return 0.5 * total
    for r in range(3):
        e[r] = target[r, 3] - T[r, 3]
        e[3 + r] = 0.0
    if task == POSE:
        # Twice the vector part of the rotation target · Tᵀ, then scaled to the rotation vector.
        x = y = z = trace = 0.0
        for c in range(3):
            x += target[2, c] * T[1, c] - target[1, c] * T[2, c]
            y += target[0, c] * T[2, c] - target[2, c] * T[0, c]
            z += target[1, c] * T[0, c] - target[0, c] * T[1, c]
            trace += target[0, c] * T[0, c] + target[1, c] * T[1, c] + target[2, c] * T[2, c]
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, trace - 1.0)
        if sine > 1e-14:
            k = weight * angle / sine
            e[3], e[4], e[5] = k * x, k * y, k * z
        elif trace < 0.0:
            # Exactly opposite: any axis is as good, the tool's own x axis is turned about.
            e[3], e[4], e[5] = weight * math.pi * T[0, 0], weight * math.pi * T[1, 0], weight * math.pi * T[2, 0]
    elif task == APPROACH:
        ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
        bx, by, bz = target[0, 2], target[1, 2], target[2, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, ax * bx + ay * by + az * bz)
        if sine > 1e-14:
            k = weight * angle / sine
            e[3], e[4], e[5] = k * x, k * y, k * z
        elif angle > 1.0:
            e[3], e[4], e[5] = weight * math.pi * T[0, 0], weight * math.pi * T[1, 0], weight * math.pi * T[2, 0]
    total = 0.0
    for r in range(6):
        total += e[r] * e[r]
    return 0.5 * total


@jit
def _solve_spd(H: Array, g: Array, free: NDArray[np.bool_], damping: float, x: Array) -> bool:
    """x ← (H + damping · (1 + diag)) ⁻¹ g on the free indices by Cholesky; False if H is not positive."""
    n = g.shape[0]
    Lo = np.zeros((n, n))
    for i in range(n):
        x[i] = 0.0
        if not free[i]:
            Lo[i, i] = 1.0
            continue
        for j in range(i + 1):
            if not free[j]:
                continue
            total = H[i, j]
            if i == j:
                total += damping * (1e-3 + H[i, i])
            for k in range(j):
                total -= Lo[i, k] * Lo[j, k]
            if i == j:
                if total <= 1e-300:
                    return False
                Lo[i, i] = math.sqrt(total)
            else:
                Lo[i, j] = total / Lo[j, j]
    for i in range(n):
        if free[i]:
            total = g[i]
            for k in range(i):
                total -= Lo[i, k] * x[k]
            x[i] = total / Lo[i, i]
    for i in range(n - 1, -1, -1):
        if free[i]:
            total = x[i]
            for k in range(i + 1, n):
                total -= Lo[k, i] * x[k]
            x[i] = total / Lo[i, i]
    return True


@jit
def _mask_rows(T: Array, target: Array, mask: Array, e: Array, J: Array) -> None:
    """J ← Jacobian of the masked coordinates (Δp, φ) of `relative_pose`; e is scratch.

    φ̇ = J_l⁻¹(φ) ω with J_l⁻¹ = I − ½[φ]× + b [φ]×², b = (1 − (θ/2) cot(θ/2))/θ² (Barfoot, State Estimation for
    Robotics, section 7.1).
    """
    in_tool = mask[6] == 0.0
    relative_pose(T, target, in_tool, e)
    x, y, z = e[3], e[4], e[5]
    theta = math.sqrt(x * x + y * y + z * z)
    b = 1.0 / 12.0
    if theta > 1e-4:
        b = (1.0 - 0.5 * theta / math.tan(0.5 * theta)) / (theta * theta)
    for j in range(J.shape[1]):
        for part in range(0, 6, 3):
            u, v, w = J[part, j], J[part + 1, j], J[part + 2, j]
            if in_tool:
                J[part, j] = target[0, 0] * u + target[1, 0] * v + target[2, 0] * w
                J[part + 1, j] = target[0, 1] * u + target[1, 1] * v + target[2, 1] * w
                J[part + 2, j] = target[0, 2] * u + target[1, 2] * v + target[2, 2] * w
        u, v, w = J[3, j], J[4, j], J[5, j]
        cx, cy, cz = y * w - z * v, z * u - x * w, x * v - y * u
        J[3, j] = u - 0.5 * cx + b * (y * cz - z * cy)
        J[4, j] = v - 0.5 * cy + b * (z * cx - x * cz)
        J[5, j] = w - 0.5 * cz + b * (x * cy - y * cx)
        for r in range(6):
            J[r, j] *= mask[r]


@jit
def descend(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, q: Array
) -> float:
    """Move q, in place, to a local minimum of E inside the limits; returns E there (metres)."""
    n = q.shape[0]
    J, T, axes = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    H, g, step, trial = np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n)
    free = np.empty(n, dtype=np.bool_)
    e = np.empty(6)
    for i in range(n):
        q[i] = min(max(q[i], lower[i]), upper[i])
    damping = 1e-6
    jacobian_into(model, q, J, T, axes)
    cost = _task_error(T, target, task, mask, weight, e)
    for _ in range(_STEPS):
        if cost < 1e-27:
            break
        if task == APPROACH:
            # Spinning about the approach axis changes nothing: that part of each column is no progress.
            for j in range(n):
                spin = J[3, j] * T[0, 2] + J[4, j] * T[1, 2] + J[5, j] * T[2, 2]
                for r in range(3):
                    J[3 + r, j] -= spin * T[r, 2]
        if task == MASK:
            _mask_rows(T, target, mask, e, J)
            _task_error(T, target, task, mask, weight, e)
        rows = 3 if task == POSITION else 6
        for i in range(n):
            g[i] = 0.0
            for r in range(rows):
                J[r, i] *= 1.0 if r < 3 else weight
                g[i] += J[r, i] * e[r]
            free[i] = not ((q[i] <= lower[i] and g[i] < 0.0) or (q[i] >= upper[i] and g[i] > 0.0))
        slope = 0.0
        for i in range(n):
            if free[i]:
                slope = max(slope, abs(g[i]))
            for j in range(i + 1):
                H[i, j] = 0.0
                for r in range(rows):
                    H[i, j] += J[r, i] * J[r, j]
        if slope < 1e-15:
            break
        improved = False
        for _ in range(12):
            if not _solve_spd(H, g, free, damping, step):
                damping = max(10.0 * damping, 1e-9)
                continue
            for i in range(n):
                trial[i] = min(max(q[i] + min(max(step[i], -0.7), 0.7), lower[i]), upper[i])
            fk_into(model, trial, T)
            better = _task_error(T, target, task, mask, weight, e)
            if better < cost:
                improved = True
                break
            damping = max(8.0 * damping, 1e-9)
            if damping > 1e6:
                break
        if not improved:
            break
        gain = cost - better
        for i in range(n):
            q[i] = trial[i]
        cost = better
        damping *= 0.1
        jacobian_into(model, q, J, T, axes)
        _task_error(T, target, task, mask, weight, e)
        if gain < 1e-15 * cost and cost > 1e-20:
            break
    return math.sqrt(2.0 * cost)


@jit
def best_of(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, starts: Array,
    enough: float, out: Array,
) -> float:  # fmt: skip
    """out ← the best local minimum over the starts ``(k, n)``, stopping at the first with E ≤ `enough`."""
    best = math.inf
    q = np.empty(starts.shape[1])
    for i in range(starts.shape[0]):
        for j in range(q.shape[0]):
            q[j] = starts[i, j]
        cost = descend(model, target, task, mask, weight, lower, upper, q)
        # A later start must be better by more than rounding: of equal minima the one nearest to the seed stays,
        # so that the arm does not jump about while a target is dragged out of reach.
        if cost < best * (1.0 - 1e-6) - 1e-12:
            best = cost
            for j in range(q.shape[0]):
                out[j] = q[j]
            if best <= enough:
                break
    return best


@jit
def each_of(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, q: Array,
    costs: Array,
) -> None:  # fmt: skip
    """Move every row of q ``(k, n)`` to a local minimum, in place; costs ``(k,)`` ← E there."""
    for i in range(q.shape[0]):
        costs[i] = descend(model, target, task, mask, weight, lower, upper, q[i])


def spread(lower: Array, upper: Array, count: int) -> Array:
    """`count` configurations spread evenly over the limits ``(count, n)``: an additive recurrence.

    The generalised golden ratio φ with φ^(n+1) = φ + 1 gives every dimension its own irrational step.
    """
    n = len(lower)
    phi = 2.0
    for _ in range(40):
        phi = (1.0 + phi) ** (1.0 / (n + 1))
    alpha = phi ** -np.arange(1, n + 1)
    low = np.where(np.isfinite(lower), lower, -math.pi)
    high = np.where(np.isfinite(upper), upper, math.pi)
    points = (0.5 + np.outer(np.arange(1, count + 1), alpha)) % 1.0
    return np.asarray(low + points * (high - low))
