"""A numeric solver for any chain: bounded Levenberg–Marquardt on the task error, from several starts.

It answers what the closed forms do not: what is the *closest* configuration inside the limits when a target
cannot be met, and how to meet a task that has no closed form. It minimises

    E(q)² = |Δp|² + (ℓ · angle)²

with Δp the position error in metres, the angle between the orientations (pose) or approach directions
(approach; ignored for position), and ℓ metres per radian. A mask keeps some of the six coordinates (Δp, φ) of
the error in the target's or the base frame.

**One descent.** Gradient and Gauss–Newton matrix JᵀJ come from the geometric Jacobian. For the three whole tasks
the gradient is exact at any angle: the log of a rotation is its own image under the inverse left Jacobian; for a
mask that Jacobian has to be applied. The damping follows the gain ratio, the decrease had over the decrease the
quadratic model promised (Nielsen, Damping Parameter in Marquardt's Method, 1999). As E → 0 it vanishes, and
convergence is quadratic. Where the target is out of reach, E stays, and Gauss–Newton only creeps: there the
second derivatives join, which a chain of screws gives for nothing (a later axis is turned by an earlier one), and
it is Newton's method (Nocedal & Wright, Numerical Optimization, chapters 3, 10 and 16).

**Limits.** A joint that the step would carry past a stop goes to the image of that angle a whole turn away if that
one is inside: a joint of a turn or more has no stop, and one of 340° leaps the gap. Otherwise it goes to its stop
and the other joints are solved again, given where it stands (an active set). Joints at a stop whose gradient
pushes outwards are held there from the outset. No configuration looked at is ever outside.

**Many starts.** A descent may end in a valley that is not the one. `solve` descends from the seed and then from
points spread evenly over the limits until one meets the target, and drops a descent early that gets nowhere. The
longer nothing is found, the more patience each descent is given.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.pose import relative_pose
from kin.transforms import Array

# Steps of one descent at most, and of one step (radians, metres) at most.
_STEPS = 120
_STRIDE = 1.5
# A descent of `solve` must halve E² every few steps; the first ones are given this many.
_PATIENCE = 4
_SHORT = 40
# Damping at least, as a share of JᵀJ's largest entry. Close to a singularity convergence needs it small; with
# the whole Hessian (a radian worth a metre) a small one would make rounding errors into motion of what is free.
_FLOOR = 1e-15
_BENT_FLOOR = 1e-8
# Errors E this close (metres) are those of one minimum.
_ALIKE = 1e-9
# Half of E² below which a descent has arrived (E = 4e-14 m), and below which it is as good as there.
_ARRIVED = 1e-27
_THERE = 1e-20


@jit
def _look(
    model: Array, q: Array, target: Array, task: int, mask: Array, weight: float, J: Array, T: Array, axes: Array,
    e: Array,
) -> float:  # fmt: skip
    """J, T ← as `jacobian_into`, e ← weighted error twist (6,) that would move T onto the target; returns E²/2."""
    jacobian_into(model, q, J, T, axes)
    if task == APPROACH:
        ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
        bx, by, bz = target[0, 2], target[1, 2], target[2, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        sine = math.sqrt(x * x + y * y + z * z)
        angle = math.atan2(sine, ax * bx + ay * by + az * bz)
        k = weight * angle / sine if sine > 1e-14 else weight
        if sine <= 1e-14 and angle > 1.0:
            # Exactly opposite: any axis is as good, the tool's own x axis is turned about.
            x, y, z, k = T[0, 0], T[1, 0], T[2, 0], weight * math.pi
        e[3], e[4], e[5] = k * x, k * y, k * z
        for r in range(3):
            e[r] = target[r, 3] - T[r, 3]
    else:
        relative_pose(T, target, task == MASK and mask[6] == 0.0, e)
        for r in range(6):
            kept = mask[r] if task == MASK else (0.0 if task == POSITION and r >= 3 else 1.0)
            e[r] *= -kept if r < 3 else -kept * weight
    total = 0.0
    for r in range(6):
        total += e[r] * e[r]
    return 0.5 * total


@jit
def _bend(T: Array, task: int, weight: float, J: Array, e: Array, H: Array) -> None:
    """H ← lower triangle of the Hessian of E²/2 less Gauss–Newton's ``(n, n)``; J as `jacobian_into` left it.

    With ω the axis of a joint (0 if it is prismatic), v its column of the point's Jacobian and joint j before
    joint i: ∂v_i/∂q_j = ω_j × v_i. For half the squared angle of φ between two orientations, with b as in
    `_mask_rows`:  b ((φ·ω_i)(φ·ω_j) − θ² ω_i·ω_j) − ½ φ·(ω_j × ω_i). For the angle α between two directions, of
    which the tool's own is a: (α cot α − 1)(u_i·φ/α)(u_j·φ/α) − (φ × a)·(ω_j × u_i) with u = ω × a, the Hessian
    of the squared distance on a sphere.
    """
    ex, ey, ez = e[3], e[4], e[5]
    squared = ex * ex + ey * ey + ez * ez
    angle = math.sqrt(squared) / weight
    ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
    tx, ty, tz = ey * az - ez * ay, ez * ax - ex * az, ex * ay - ey * ax
    b = across = 0.0
    if task == POSE:
        b = _inverse_left(angle)
    elif task == APPROACH and angle > 1e-4:
        # Close to opposite the sphere is bent without bound; the descent only needs to get away from there.
        across = max(angle / math.tan(angle) - 1.0, -10.0) / squared * weight * weight
    for i in range(J.shape[1]):
        vx, vy, vz = J[0, i], J[1, i], J[2, i]
        wx, wy, wz = J[3, i], J[4, i], J[5, i]
        ux, uy, uz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        for j in range(i + 1):
            x, y, z = J[3, j], J[4, j], J[5, j]
            h = -(e[0] * (y * vz - z * vy) + e[1] * (z * vx - x * vz) + e[2] * (x * vy - y * vx))
            if task == POSE:
                along = (ex * wx + ey * wy + ez * wz) * (ex * x + ey * y + ez * z)
                h += b * (along - squared * (wx * x + wy * y + wz * z))
                h -= 0.5 * weight * (ex * (y * wz - z * wy) + ey * (z * wx - x * wz) + ez * (x * wy - y * wx))
            elif task == APPROACH:
                # (ω × a)·φ = ω·(a × φ) = −ω·t
                h += across * (wx * tx + wy * ty + wz * tz) * (x * tx + y * ty + z * tz)
                h -= weight * (tx * (y * uz - z * uy) + ty * (z * ux - x * uz) + tz * (x * uy - y * ux))
            H[i, j] = h


@jit
def _inverse_left(theta: float) -> float:
    """b = (1 − (θ/2) cot(θ/2))/θ² of J_l⁻¹(φ) = I − ½[φ]× + b [φ]×² (Barfoot, State Estimation, section 7.1)."""
    if theta < 1e-4:
        return 1.0 / 12.0
    return (1.0 - 0.5 * theta / math.tan(0.5 * theta)) / (theta * theta)


@jit
def _mask_rows(T: Array, target: Array, mask: Array, e: Array, J: Array) -> None:
    """J ← Jacobian of the masked coordinates (Δp, φ) of `relative_pose`, as φ̇ = J_l⁻¹(φ) ω; e is scratch."""
    in_tool = mask[6] == 0.0
    relative_pose(T, target, in_tool, e)
    x, y, z = e[3], e[4], e[5]
    b = _inverse_left(math.sqrt(x * x + y * y + z * z))
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
def _model(
    T: Array, target: Array, task: int, mask: Array, weight: float, bent: bool, J: Array, e: Array, scratch: Array,
    H: Array, g: Array,
) -> float:  # fmt: skip
    """g ← −gradient of E²/2 ``(n,)``, H ← its Hessian's lower triangle, whole or Gauss–Newton's; uses up J.

    Returns the largest diagonal entry of Gauss–Newton's.
    """
    n = J.shape[1]
    rows = 3 if task == POSITION else 6
    if bent:
        _bend(T, task, weight, J, e, H)
    if task == MASK:
        _mask_rows(T, target, mask, scratch, J)
    largest = 0.0
    for i in range(n):
        if task == APPROACH:
            # Spinning about the approach axis changes nothing: that part of each column is no progress.
            spin = J[3, i] * T[0, 2] + J[4, i] * T[1, 2] + J[5, i] * T[2, 2]
            for r in range(3):
                J[3 + r, i] -= spin * T[r, 2]
        g[i] = 0.0
        for r in range(rows):
            if r >= 3:
                J[r, i] *= weight
            g[i] += J[r, i] * e[r]
        for j in range(i + 1):
            total = 0.0
            for r in range(rows):
                total += J[r, i] * J[r, j]
            if i == j:
                largest = max(largest, total)
            H[i, j] = total + (H[i, j] if bent else 0.0)
    return largest


@jit
def _solve_free(H: Array, g: Array, free: NDArray[np.bool_], damping: float, L: Array, x: Array) -> bool:
    """x ← (H + damping · I)⁻¹ g on the free indices, x given on the others; False if that is not positive.

    Cholesky on the lower triangle; L ``(n, n)`` is scratch.
    """
    n = g.shape[0]
    for i in range(n):
        if not free[i]:
            continue
        right = g[i]
        for j in range(n):
            if not free[j]:
                right -= (H[i, j] if j < i else H[j, i]) * x[j]
        for j in range(i):
            if free[j]:
                total = H[i, j]
                for k in range(j):
                    if free[k]:
                        total -= L[i, k] * L[j, k]
                L[i, j] = total / L[j, j]
                right -= L[i, j] * x[j]
        total = H[i, i] + damping
        for k in range(i):
            if free[k]:
                total -= L[i, k] * L[i, k]
        if total <= 1e-300:
            return False
        L[i, i] = math.sqrt(total)
        x[i] = right / L[i, i]
    for i in range(n - 1, -1, -1):
        if free[i]:
            total = x[i]
            for k in range(i + 1, n):
                if free[k]:
                    total -= L[k, i] * x[k]
            x[i] = total / L[i, i]
    return True


@jit
def _inside(x: float, low: float, high: float, turn: float) -> float:
    """x, or its image x + k·turn inside [low, high] if there is one, or the nearer end."""
    if low <= x <= high:
        return x
    if turn > 0.0:
        y = x - turn * math.ceil((x - high) / turn) if x > high else x + turn * math.ceil((low - x) / turn)
        if low <= y <= high:
            return y
    return min(max(x, low), high)


@jit
def _bounded_step(
    H: Array, g: Array, q: Array, lower: Array, upper: Array, turns: Array, damping: float,
    held: NDArray[np.bool_], free: NDArray[np.bool_], L: Array, step: Array, trial: Array,
) -> bool:  # fmt: skip
    """step, trial ← the damped step and where it leads, inside the limits; False if H + damping is not positive.

    A joint that would pass a stop goes to the stop, and the others are solved again given that.
    """
    n = q.shape[0]
    for i in range(n):
        free[i] = not held[i]
        step[i] = 0.0
    for _ in range(n + 1):
        if not _solve_free(H, g, free, damping, L, step):
            return False
        longest = 0.0
        for i in range(n):
            longest = max(longest, abs(step[i]))
        shrink = _STRIDE / longest if longest > _STRIDE else 1.0
        stopped = False
        for i in range(n):
            step[i] *= shrink
            x = q[i] + step[i]
            trial[i] = _inside(x, lower[i], upper[i], turns[i])
            if free[i] and ((x < lower[i] and trial[i] == lower[i]) or (x > upper[i] and trial[i] == upper[i])):
                step[i] = trial[i] - q[i]
                free[i] = False
                stopped = True
        if not stopped or shrink < 1.0:
            break
    return True


@jit
def _descend(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, turns: Array,
    steps: int, patience: int, q: Array,
) -> float:  # fmt: skip
    """Move q, in place, to a local minimum of E inside the limits; returns E there (metres).

    With a patience, the descent ends as soon as E² does not halve within that many steps, and the model is
    Gauss–Newton's; without (0) it is followed to the minimum.
    """
    n = q.shape[0]
    J, T, axes = np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7))
    H, L = np.empty((n, n)), np.empty((n, n))
    g, step, trial = np.empty(n), np.empty(n), np.empty(n)
    held, free = np.empty(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    e, scratch = np.empty(6), np.empty(6)
    for i in range(n):
        q[i] = _inside(q[i], lower[i], upper[i], turns[i])
    cost = _look(model, q, target, task, mask, weight, J, T, axes, e)
    before = cost
    damping = 0.1
    bent = False
    for count in range(steps):
        if cost < _ARRIVED:
            break
        if patience > 0 and count > 0 and count % patience == 0:
            if cost > 0.5 * before and cost > 1e-6:
                break
            before = cost
        largest = _model(T, target, task, mask, weight, bent, J, e, scratch, H, g)
        slope = 0.0
        for i in range(n):
            outwards = (q[i] <= lower[i] and g[i] < 0.0) or (q[i] >= upper[i] and g[i] > 0.0)
            gap = turns[i] - (upper[i] - lower[i])
            # What the step may leap to is left to the step.
            held[i] = outwards and (turns[i] == 0.0 or gap >= _STRIDE)
            if not outwards or (turns[i] > 0.0 and gap <= 0.0):
                slope = max(slope, abs(g[i]))
        if slope < 1e-15:
            break
        better, promised, grow, settled = math.inf, 0.0, 2.0, False
        while damping * cost < 1e4 * largest:
            added = damping * cost + (max(_BENT_FLOOR * weight * weight, _FLOOR) if bent else _FLOOR) * largest
            if _bounded_step(H, g, q, lower, upper, turns, added, held, free, L, step, trial):
                promised = 0.0
                for i in range(n):
                    half = 0.5 * H[i, i] * step[i]
                    for j in range(i):
                        half += H[i, j] * step[j]
                    promised += step[i] * (g[i] - half)
                better = _look(model, trial, target, task, mask, weight, J, T, axes, e)
                settled = abs(promised) < 1e-14 * cost and cost > _THERE
                if better < cost or cost < _THERE or settled:
                    break
            damping = max(damping, 1e-9) * grow
            grow *= 2.0
        # The joints are known to half of the digits when E no longer tells: the last step gives the others.
        if not (better < cost or (settled and better <= cost * (1.0 + 1e-14))):
            break
        for i in range(n):
            q[i] = trial[i]
        gain = cost - better
        # Far from zero and slow: this is a minimum with an error that stays.
        bent = patience == 0 and task != MASK and gain < 0.5 * cost
        cost = better
        if promised > 0.0:
            damping = max(damping * max(0.1, 1.0 - (2.0 * gain / promised - 1.0) ** 3), 1e-12)
        if settled or (gain < 1e-15 * cost and cost > _THERE):
            break
    return math.sqrt(2.0 * cost)


@jit
def each_of(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, turns: Array,
    enough: float, meetings: int, q: Array, costs: Array,
) -> int:  # fmt: skip
    """Move the rows of q ``(k, n)`` to local minima, in place; costs ``(k,)`` ← E there; returns how many were.

    Stops after the first with E ≤ `enough`, and once `meetings` descents have ended as low as the best: by then a
    lower valley would hardly have been missed. `turns` ``(n,)`` is 2π for a joint that has whole-turn images and
    0.0 for one that has none.
    """
    best = math.inf
    met = count = 0
    while count < q.shape[0] and best > enough and met < meetings:
        cost = _descend(model, target, task, mask, weight, lower, upper, turns, _STEPS, 0, q[count])
        costs[count] = cost
        count += 1
        if cost < best - _ALIKE:
            met = 1
        elif cost <= best + _ALIKE:
            met += 1
        best = min(best, cost)
    return count


@jit
def _golden(n: int) -> float:
    """The generalised golden ratio φ with φ^(n+1) = φ + 1, of which each dimension takes another power."""
    phi = 2.0
    for _ in range(40):
        phi = (1.0 + phi) ** (1.0 / (n + 1))
    return phi


@jit
def solve(
    model: Array, target: Array, task: int, mask: Array, weight: float, lower: Array, upper: Array, turns: Array,
    budget: int, enough: float, out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ← the first configuration ``(n,)`` found with E ≤ `enough`; returns (E, number of starts used).

    The first start is what out holds, the others are the points of `spread`, `budget` in all (at least 1). If none
    meets the target, out is the best minimum that was reached.
    """
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
        cost = _descend(model, target, task, mask, weight, lower, upper, turns, steps, patience, q)
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
