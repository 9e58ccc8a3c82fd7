"""The task error of a configuration and its derivatives."""

from __future__ import annotations

import math

from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.transforms import Array

Goal = tuple[Array, int, Array, float]  # target pose, task, mask, metres per radian
Chain = tuple[Array, Array, Array]  # Jacobian (6, n), pose (4, 4), joint axes (n, 7), see `jacobian_into`


@jit
def relative_pose(T: Array, target: Array, in_tool: bool, e: Array) -> None:
    """e ← (Δp, φ) ``(6,)``: where T is, seen from the target, in the target's frame or in the base frame.

    φ is the rotation vector of Rₜᵀ R (target's frame) or R Rₜᵀ (base frame), |φ| ≤ π.
    """
    for i in range(3):
        if in_tool:
            e[i] = 0.0
            for r in range(3):
                e[i] += target[r, i] * (T[r, 3] - target[r, 3])
        else:
            e[i] = T[i, 3] - target[i, 3]
    # Twice the vector part of R Rₜᵀ, in the base frame; Rₜᵀ carries it over into the target's frame.
    x = y = z = trace = 0.0
    for c in range(3):
        x += T[2, c] * target[1, c] - T[1, c] * target[2, c]
        y += T[0, c] * target[2, c] - T[2, c] * target[0, c]
        z += T[1, c] * target[0, c] - T[0, c] * target[1, c]
        trace += T[0, c] * target[0, c] + T[1, c] * target[1, c] + T[2, c] * target[2, c]
    sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, trace - 1.0)
    k = angle / sine if sine > 1e-14 else 0.5
    if sine <= 1e-14 and trace < 0.0:
        # Exactly opposite: any axis is as good, the target's own x axis is turned about.
        x, y, z, k = target[0, 0], target[1, 0], target[2, 0], math.pi
    for i in range(3):
        if in_tool:
            e[3 + i] = k * (target[0, i] * x + target[1, i] * y + target[2, i] * z)
        else:
            e[3 + i] = k * (x if i == 0 else (y if i == 1 else z))


@jit
def look(model: Array, q: Array, goal: Goal, chain: Chain, e: Array) -> float:
    """chain ← as `jacobian_into`, e ← weighted twist ``(6,)`` that would move T onto the target; returns E²/2."""
    target, task, mask, weight = goal
    J, T, axes = chain
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
def second_order(goal: Goal, J: Array, T: Array, e: Array, H: Array) -> None:
    """H ← lower triangle of the Hessian of E²/2 less Gauss–Newton's ``(n, n)``; J as `jacobian_into` left it.

    With ω the axis of a joint (0 if it is prismatic), v its column of the point's Jacobian and joint j before
    joint i: ∂v_i/∂q_j = ω_j × v_i. For half the squared angle of φ between two orientations, with b as in
    `mask_rows`:  b ((φ·ω_i)(φ·ω_j) − θ² ω_i·ω_j) − ½ φ·(ω_j × ω_i). For the angle α between two directions, of
    which the tool's own is a: (α cot α − 1)(u_i·φ/α)(u_j·φ/α) − (φ × a)·(ω_j × u_i) with u = ω × a, the Hessian
    of the squared distance on a sphere.
    """
    _, task, _, weight = goal
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
def mask_rows(T: Array, target: Array, mask: Array, e: Array, J: Array) -> None:
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
def quadratic_model(
    goal: Goal, bent: bool, J: Array, T: Array, e: Array, scratch: Array, H: Array, g: Array
) -> float:
    """g ← −gradient of E²/2 ``(n,)``, H ← its Hessian's lower triangle, whole (`bent`) or Gauss–Newton's.

    Returns the largest diagonal entry of Gauss–Newton's. Overwrites J.
    """
    target, task, mask, weight = goal
    n = J.shape[1]
    rows = 3 if task == POSITION else 6
    if bent:
        second_order(goal, J, T, e, H)
    if task == MASK:
        mask_rows(T, target, mask, scratch, J)
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
