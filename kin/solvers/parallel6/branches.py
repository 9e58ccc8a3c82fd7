"""The careful kernel: all branches inside limits, at singular targets too, with the feasible arcs of a free θ6.

A *box* ``(3, 6)`` holds the seed and the joint limits as canonical angles (rows NEAR, LOW, HIGH), in the order θ2,
θ3, θ4, θ6, θ1, θ5: the first four are those of the planar arm, see :mod:`kin.solvers.planar`.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.fk import sine_cosine
from kin.kernels.simd import atan2
from kin.solvers.blocks import Entries
from kin.solvers.canonical import canonical, signed_box
from kin.solvers.common import HIGH, LOW, NEAR, UNBOUNDED, clear, copy_row
from kin.solvers.parallel6.geometry import A1, A2, A3, A4, BESIDE, COS_TWIST, D5, OFFSET, SIGN, SIN_TWIST
from kin.solvers.planar import planar_angles, planar_free, two_links
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REACH = TOLERANCES.reach
_SINGULAR = TOLERANCES.singular
_MERGE = TOLERANCES.merge
_STEPS = 180  # that half a turn of θ1 is searched in, where it is free
_ROUNDING, _DOUBLE_ROOT = TOLERANCES.rounding, TOLERANCES.double_root
_FREE = 6  # column of out: 1.0 where θ6 is free
_ORDER = (1, 2, 3, 5, 0, 4)  # joints of the columns of a box


@jit
def solve(
    params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """out ``(8, 6)`` ← the branches of T ``(4, 4)``: (gap in metres, number of arcs of θ6 or −1 if it is fixed).

    near, lower, upper ``(6,)``: seed and joint limits, which decide what a singular target leaves free; value: θ6
    where that is free, NaN to let the seed decide. A seventh column, if out has one, ← 1.0 where θ6 is free.
    """
    clear(out)
    box, joint_box = np.empty((3, 6)), np.empty((3, 6))
    signed_box(near, lower, upper, params[SIGN:OFFSET], params[OFFSET : OFFSET + 6], joint_box)
    for i in range(6):
        for row in range(3):
            box[row, i] = joint_box[row, _ORDER[i]]
    M = canonical(params, T)
    wx, wy, wz = M[3], M[7], M[11]
    y = (params[COS_TWIST] * wz - params[BESIDE]) / params[SIN_TWIST]
    r = math.sqrt(wx * wx + wy * wy)
    if r < abs(y) - _REACH:
        return abs(y) - r, -1
    root = math.sqrt(max((r - abs(y)) * (r + abs(y)), 0.0))
    if root < _MERGE * abs(y) or r < _SINGULAR:
        root = 0.0
    left = 1.0 if params[BESIDE] >= 0.0 else -1.0
    gap, found = math.inf, -1
    for right in range(1 if root == 0.0 else 2):
        side = left if right == 0 else -left
        miss, found = _shoulder(params, M, side * root, right, value, box, arcs, found, out)
        gap = min(gap, miss)
    if root == 0.0:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return gap, found


@jit
def _shoulder(
    params: Array, M: Entries, x: float, right: int, value: float, box: Array, arcs: Array, found: int,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ← the four branches with W at x in the frame that turns with axis 1: (miss, number of arcs)."""
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, wz = M
    ca, sa = params[COS_TWIST], params[SIN_TWIST]
    y = (ca * wz - params[BESIDE]) / sa
    on_axis = math.sqrt(wx * wx + wy * wy) < _SINGULAR
    t1 = _facing(params, M, box) if on_axis else atan2(wy, wx) - atan2(y, x)
    s1, c1 = sine_cosine(t1)
    v0, v1, v2 = c1 * r10 - s1 * r00, c1 * r11 - s1 * r01, c1 * r12 - s1 * r02
    m00, m01, m02 = c1 * r00 + s1 * r10, c1 * r01 + s1 * r11, c1 * r02 + s1 * r12
    m10, m11, m12, m22 = ca * v0 + sa * r20, ca * v1 + sa * r21, ca * v2 + sa * r22, ca * r22 - sa * v2
    wrist = (t1, x - params[A1], ca * y + sa * wz)
    if math.sqrt(m02 * m02 + m12 * m12) < _SINGULAR:
        B = 0.0 if m22 > 0.0 else math.pi
        found = max(found, 0)
        turn = atan2(m10, m00) if m22 > 0.0 else atan2(-m10, -m00)
        for down in range(2):
            branch = 4 * right + 2 * down
            found = _spinning(params, wrist, (B, turn), value, branch, box, arcs, found, out)
            if out.shape[1] > _FREE:
                out[branch, _FREE] = 1.0
            copy_row(out, branch, branch + 1)
        if not math.isnan(out[4 * right, 0]):
            return 0.0, found
        # How far the circle that axis 4 may be on is from the reach of the elbow.
        R, rho = math.hypot(wrist[1], wrist[2]), math.hypot(params[A4], params[D5])
        a2, a3 = params[A2], params[A3]
        return max(abs(R - rho) - a2 - a3, abs(a2 - a3) - R - rho), found
    # Where two shoulders merge θ1 is known only approximately; a small change of it may close the rest.
    lever = abs(y) + abs(params[A4]) + abs(params[D5])
    slack = _REACH + lever * min(_DOUBLE_ROOT, _ROUNDING / max(abs(x), _ROUNDING))
    gap = math.inf
    sine = math.sqrt(m02 * m02 + m12 * m12)
    cA, sA = m02 / sine, m12 / sine
    aimed = atan2(m12, m02), atan2(sine, m22), atan2(cA * m10 - sA * m00, cA * m11 - sA * m01)
    for flip in range(2):
        m = (m00, m01, m02, m10, m11, m12, m22)
        miss = _arm(params, wrist, m, aimed, 4 * right + flip, slack, box, out)
        gap = min(gap, miss)
    return gap, found


@jit
def _arm(
    params: Array,
    wrist: tuple[float, float, float],
    m: tuple[float, float, float, float, float, float, float],
    aimed: tuple[float, float, float],
    branch: int,
    slack: float,
    box: Array,
    out: Array,
) -> float:
    """out[branch], out[branch + 2] ← elbow up and down of one shoulder and wrist; by how much they miss, metres.

    wrist: θ1, and W in the plane of axes 2, 3, 4; m: entries of the rotation after axis 1, without the third row's
    first two; aimed: its angles A, B, C with sin B > 0.
    """
    t1, u, v = wrist
    m00, m01, m02, m10, m11, m12, m22 = m
    a2, a3, a4, d5 = params[A2], params[A3], params[A4], params[D5]
    sine = math.sqrt(m02 * m02 + m12 * m12)
    cA, sA = m02 / sine, m12 / sine
    flip, turned = (1.0, 0.0) if branch & 1 == 0 else (-1.0, math.pi)
    A, B, C = aimed[0] + turned, flip * aimed[1], aimed[2] + turned
    px, py = u - flip * (a4 * cA - d5 * sA), v - flip * (a4 * sA + d5 * cA)
    miss, bend, _, k1, k2 = two_links(px, py, a2, a3)
    if miss > _REACH and miss * sine < _ROUNDING:
        # Near s5 = 0 A is known only approximately: a tiny change may bring axis 4 within reach.
        A = _within((u, v, a4, d5, a2, a3), A, _REACH / sine)
        c, s = math.cos(A), math.sin(A)
        B = atan2(c * m02 + s * m12, m22)
        C = atan2(c * m10 - s * m00, c * m11 - s * m01)
        px, py = u - a4 * c + d5 * s, v - a4 * s - d5 * c
        miss, bend, _, k1, k2 = two_links(px, py, a2, a3)
    if miss > slack:
        return miss
    middle, half = atan2(py, px), atan2(k2, k1)
    for down in range(2 if bend > 0.0 else 1):
        up = _elbow_sign(params, branch + 2 * down)
        t2, t3 = middle - up * half, up * bend
        if px * px + py * py < _SINGULAR * _SINGULAR:
            t2 = _folded(A - t3, box)
        _put(params, out, branch + 2 * down, t1, t2, t3, A - t2 - t3, B, C)
    if bend == 0.0:
        copy_row(out, branch, branch + 2)
    return miss


@jit
def _elbow_sign(params: Array, branch: int) -> float:
    """The sign of θ3 on a branch: the elbow is "up" with the sign of the side that the arm's plane is on."""
    left = 1.0 if params[BESIDE] >= 0.0 else -1.0
    side = left if branch & 4 == 0 else -left
    return side if branch & 2 == 0 else -side


@jit
def _put(
    params: Array, out: Array, row: int, t1: float, t2: float, t3: float, t4: float, B: float, C: float
) -> None:
    """out[row] ← joint values of canonical angles."""
    out[row, 0] = wrap(params[SIGN] * (t1 - params[OFFSET]))
    out[row, 1] = wrap(params[SIGN + 1] * (t2 - params[OFFSET + 1]))
    out[row, 2] = wrap(params[SIGN + 2] * (t3 - params[OFFSET + 2]))
    out[row, 3] = wrap(params[SIGN + 3] * (t4 - params[OFFSET + 3]))
    out[row, 4] = wrap(params[SIGN + 4] * (B - params[OFFSET + 4]))
    out[row, 5] = wrap(params[SIGN + 5] * (C - params[OFFSET + 5]))


@jit
def _spinning(
    params: Array, wrist: tuple[float, float, float], aligned: tuple[float, float], value: float, branch: int,
    box: Array, arcs: Array, found: int, out: Array,
) -> int:  # fmt: skip
    """out[branch] ← the arm with axis 6 parallel to axis 4, θ6 free; returns the number of arcs of θ6 so far.

    aligned: B and turn, ``A + θ6 = turn`` for B = 0, ``A − θ6 = turn`` for B = π. The planar arm's third link is
    that from axis 4 to W.
    """
    t1, u, v = wrist
    B, turn = aligned
    spin = 1.0 if B == 0.0 else -1.0
    angles = np.empty(4)
    own, first = arcs, found
    if arcs.shape[0] == 0:
        own = np.empty((64, 3))
    C = box[NEAR, 3] if math.isnan(value) else params[SIGN + 5] * value + params[OFFSET + 5]
    arm = (u, v, params[A4], params[D5], params[A2], params[A3])
    last = (_elbow_sign(params, branch), spin, turn)
    request = (turn - spin * C, not math.isnan(value))
    psi, found = planar_free(arm, last, request, branch, box, own, found, angles)
    for k in range(first, found):
        # An arc of ψ as one of joint 6.
        a = params[SIGN + 5] * (spin * (turn - own[k, 1]) - params[OFFSET + 5])
        b = params[SIGN + 5] * (spin * (turn - own[k, 2]) - params[OFFSET + 5])
        own[k, 1], own[k, 2] = min(a, b), max(a, b)
    if not math.isnan(psi):
        _put(params, out, branch, t1, angles[0], angles[1], angles[2], B, angles[3])
    return int(min(found, arcs.shape[0]))


@jit
def _facing(params: Array, M: Entries, box: Array) -> float:
    """θ1 for W on axis 1, where it is free: of those that bring axis 4 within reach, in steps, the seed's nearest.

    W is on axis 1 for arms without L only, and what is allowed then is no simple arc: A turns with θ1, unevenly.
    """
    r02, r12, r22, wz = M[2], M[6], M[10], M[11]
    ca, sa = params[COS_TWIST], params[SIN_TWIST]
    y = (ca * wz - params[BESIDE]) / sa
    u, v = -params[A1], ca * y + sa * wz
    a2, a3, a4, d5 = params[A2], params[A3], params[A4], params[D5]
    low, high = box[LOW, 4], box[HIGH, 4]
    start = min(max(box[NEAR, 4], low), high)
    best, least = start, math.inf
    for k in range(2 * _STEPS):
        # 0, 1, −1, 2, −2, … steps from the seed.
        t1 = start + (k + 1) // 2 * (math.pi / _STEPS) * (1.0 if k % 2 else -1.0)
        if t1 < low or t1 > high:
            continue
        c1, s1 = math.cos(t1), math.sin(t1)
        x = c1 * r02 + s1 * r12
        z = ca * (c1 * r12 - s1 * r02) + sa * r22
        length = max(math.sqrt(x * x + z * z), 1e-300)
        for flip in range(2):
            k1 = (1.0 if flip == 0 else -1.0) / length
            px, py = u - k1 * (a4 * x - d5 * z), v - k1 * (a4 * z + d5 * x)
            miss = two_links(px, py, a2, a3)[0]
            if miss <= 0.0:
                return float(t1)
            if miss < least:
                best, least = t1, miss
    return float(best)


@jit
def _within(arm: tuple[float, float, float, float, float, float], A: float, margin: float) -> float:
    """The direction nearest to A that brings axis 4 within reach, A itself if that is `margin` away or more."""
    box, angles, arcs = np.empty((3, 4)), np.empty(4), np.empty((16, 3))
    for i in range(4):
        box[NEAR, i], box[LOW, i], box[HIGH, i] = -UNBOUNDED, -UNBOUNDED, UNBOUNDED
    psi, _ = planar_free(arm, (1.0, 0.0, 0.0), (A, margin < 0.0), 0, box, arcs, 0, angles)
    return float(psi if abs(wrap(psi - A)) < margin else A)


@jit
def _folded(total: float, box: Array) -> float:
    """θ2 with axis 4 on axis 2, where only θ2 + θ4 counts."""
    angles = np.empty(4)
    planar_angles((0.0, 0.0, 0.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0), total + math.pi, box, angles)
    return float(angles[0])
