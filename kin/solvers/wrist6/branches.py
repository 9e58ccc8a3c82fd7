"""The careful kernel: all branches inside limits, at singular targets too, with the feasible arcs of a free θ1."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, wrap
from kin.kernels.compile import jit
from kin.kernels.simd import atan2
from kin.solvers.blocks import Entries
from kin.solvers.canonical import canonical, signed_box
from kin.solvers.common import (
    HIGH,
    LOW,
    NEAR,
    clear,
    copy_row,
    extend_arcs,
    lay_probes,
    misfit_of,
    nearest_in_arcs,
    zyz,
    zyz_breaks,
)
from kin.solvers.planar import two_links
from kin.solvers.wrist6.geometry import (
    A1,
    A2,
    BESIDE,
    COS_PHASE,
    COS_TWIST,
    OFFSET,
    SIGN,
    SIN_PHASE,
    SIN_TWIST,
    SLIDES,
    F,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REACH = TOLERANCES.reach
_SINGULAR = TOLERANCES.singular
_MERGE = TOLERANCES.merge
_ROUNDING, _DOUBLE_ROOT = TOLERANCES.rounding, TOLERANCES.double_root

Arm = tuple[float, float, float]  # canonical θ1, θ2, θ3
Rotation = tuple[float, float, float, float, float, float, float, float, float]  # column after column


@jit
def solve(
    params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """out ``(8, 6)`` ← the branches of T ``(4, 4)``: (gap in metres, number of arcs of θ1 or −1 if it is fixed).

    near, lower, upper ``(6,)``: seed and joint limits, which decide what a singular target leaves free; value: θ1
    where that is free, NaN to let the seed decide. Arcs are rows (branch, low, high) of canonical θ1; none are
    computed if `arcs` has no rows.
    """
    clear(out)
    box = np.empty((3, 6))
    signed_box(near, lower, upper, params[SIGN:OFFSET], params[OFFSET : OFFSET + 6], box)
    M = canonical(params, T)
    wx, wy = M[3], M[7]
    beside = params[BESIDE]
    r = math.sqrt(wx * wx + wy * wy)
    if r < abs(beside) - _REACH:
        return abs(beside) - r, -1
    free = beside == 0.0 and r < _SINGULAR
    root = math.sqrt(max((r - abs(beside)) * (r + abs(beside)), 0.0))
    if beside != 0.0 and root < _MERGE * abs(beside):
        root = 0.0
    single = free or root == 0.0
    gap = math.inf
    found = 0 if free else -1
    for back in range(1 if single else 2):
        X = root if back == 0 else -root
        miss, found = _shoulder(params, M, X, back, value, box, arcs, found, out)
        gap = min(gap, miss)
    if single:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return gap, found


@jit
def _shoulder(
    params: Array, M: Entries, X: float, back: int, value: float, box: Array, arcs: Array, found: int,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ← the four branches with W at (X, L) in the frame that turns with axis 1: (miss, number of arcs).

    θ1 is free if `found` is not negative.
    """
    h, beside, slides = -M[11], params[BESIDE], params[SLIDES] != 0.0
    miss, bend, c3, k1, k2, x = _elbow(params, X - params[A1], h, abs(X))
    if miss > _REACH:
        return miss, found
    if x != X - params[A1]:
        X = x + params[A1]
    D = math.sqrt(x * x + h * h)
    t1 = atan2(M[7], M[3]) - atan2(beside, X)
    R = _turned(M, X, beside)
    for down in range(2 if bend > 0.0 else 1):
        up = 1.0 if down == (0 if slides else back) else -1.0
        e1, e2 = (up * k1, k2) if slides else (k1, up * k2)
        c2, s2 = x * e1 + h * e2, h * e1 - x * e2
        if D < _SINGULAR:
            # W on axis 2, as in a folded arm of equal links: θ2 is free.
            t2 = min(max(box[NEAR, 1], box[LOW, 1]), box[HIGH, 1])
            c2, s2 = math.cos(t2), math.sin(t2)
        else:
            t2 = atan2(s2, c2)
            unit = 1.0 / math.sqrt(c2 * c2 + s2 * s2)
            c2, s2 = c2 * unit, s2 * unit
        t3, s3 = up * bend, 0.0 if slides else up * k2 / params[F]
        branch = 4 * back + 2 * down
        if found >= 0:
            for flip in range(2):
                found = _on_axis(params, M, (t2, t3), value, branch + flip, box, arcs, found, out)
        else:
            c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
            g = c23 * params[COS_PHASE] + s23 * params[SIN_PHASE]
            s = s23 * params[COS_PHASE] - c23 * params[SIN_PHASE]
            _both_wrists(params, (t1, t2, t3), g, s, R, branch, box, out)
    if bend == 0.0:
        copy_row(out, 4 * back, 4 * back + 2)
        copy_row(out, 4 * back + 1, 4 * back + 3)
    return miss, found


@jit
def _elbow(params: Array, x: float, h: float, root: float) -> tuple[float, float, float, float, float, float]:
    """The elbow for W at (x, h) from axis 2: (miss, bend, cos bend, k1, k2, x), see `two_links`.

    A slide runs past axis 2 at the distance f, and W is at ±bend along it. Where two shoulders merge (root → 0), x
    is known only approximately: a tiny change may let the elbow close, and the returned x includes it.
    """
    a2, f, beside = params[A2], params[F], params[BESIDE]
    if params[SLIDES] != 0.0:
        D = math.sqrt(x * x + h * h)
        along = math.sqrt(max((D - f) * (D + f), 0.0))
        if along < max(_MERGE * abs(f), _SINGULAR):
            along = 0.0
        return abs(f) - D, along, 1.0, along, -f, x
    miss, bend, c3, k1, k2 = two_links(x, h, a2, f)
    if miss > _REACH and beside != 0.0:
        edge = a2 + f if x * x + h * h > a2 * a2 + f * f else a2 - f
        nearest = math.copysign(math.sqrt(max(edge * edge - h * h, 0.0)), x)
        if abs(nearest - x) < abs(beside) * min(_DOUBLE_ROOT, _ROUNDING / max(root, _ROUNDING)):
            x = nearest
            miss, bend, c3, k1, k2 = two_links(x, h, a2, f)
    return miss, bend, c3, k1, k2, x


@jit
def _turned(M: Entries, X: float, beside: float) -> Rotation:
    """The target's rotation as seen from the frame that turns with axis 1, W at (X, L) in it."""
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, _ = M
    r = math.sqrt(wx * wx + wy * wy)
    scale = 1.0 / max(r * math.sqrt(X * X + beside * beside), 1e-300)
    c1, s1 = (wx * X + wy * beside) * scale, (wy * X - wx * beside) * scale
    return (
        c1 * r00 + s1 * r10, c1 * r10 - s1 * r00, r20,
        c1 * r01 + s1 * r11, c1 * r11 - s1 * r01, r21,
        c1 * r02 + s1 * r12, c1 * r12 - s1 * r02, r22,
    )  # fmt: skip


@jit
def _both_wrists(
    params: Array, arm: Arm, g: float, s: float, R: Rotation, branch: int, box: Array, out: Array
) -> None:
    """out[branch], out[branch + 1] ← both wrists; g, s: cosine and sine of the forearm's direction."""
    t1, t2, t3 = arm
    m00, m10, _ = _seen(params, g, s, R[0], R[1], R[2])
    m01, m11, _ = _seen(params, g, s, R[3], R[4], R[5])
    m02, m12, m22 = _seen(params, g, s, R[6], R[7], R[8])
    sine = math.sqrt(m02 * m02 + m12 * m12)
    if sine < _SINGULAR:
        M, angles = np.empty((3, 3)), np.empty(6)
        M[0, 0], M[1, 0], M[0, 1], M[1, 1], M[0, 2], M[1, 2], M[2, 2] = m00, m10, m01, m11, m02, m12, m22
        zyz(M, 1.0, box[NEAR], box[LOW], box[HIGH], 3, angles)
        _put(params, out, branch, t1, t2, t3, angles[3], angles[4], angles[5])
        copy_row(out, branch, branch + 1)
        return
    cA, sA = m02 / sine, m12 / sine
    A, B = atan2(m12, m02), atan2(sine, m22)
    C = atan2(cA * m10 - sA * m00, cA * m11 - sA * m01)
    _put(params, out, branch, t1, t2, t3, A, B, C)
    other = branch + 1
    out[other, 0], out[other, 1], out[other, 2] = out[branch, 0], out[branch, 1], out[branch, 2]
    out[other, 3] = wrap(params[SIGN + 3] * (A + math.pi - params[OFFSET + 3]))
    out[other, 4] = wrap(params[SIGN + 4] * (-B - params[OFFSET + 4]))
    out[other, 5] = wrap(params[SIGN + 5] * (C + math.pi - params[OFFSET + 5]))


@jit
def _seen(params: Array, g: float, s: float, X: float, Y: float, Z: float) -> tuple[float, float, float]:
    """A vector that is (X, Y, Z) in the frame turning with axis 1, seen from the forearm at cos, sin = g, s."""
    ca, sa = params[COS_TWIST], params[SIN_TWIST]
    v = -s * X - g * Z
    return g * X - s * Z, ca * v + sa * Y, ca * Y - sa * v


@jit
def _put(
    params: Array, out: Array, row: int, t1: float, t2: float, t3: float, A: float, B: float, C: float
) -> None:
    """out[row] ← joint values of canonical angles; t3 is a length if joint 3 slides."""
    out[row, 0] = wrap(params[SIGN] * (t1 - params[OFFSET]))
    out[row, 1] = wrap(params[SIGN + 1] * (t2 - params[OFFSET + 1]))
    q3 = params[SIGN + 2] * (t3 - params[OFFSET + 2])
    out[row, 2] = q3 if params[SLIDES] else wrap(q3)
    out[row, 3] = wrap(params[SIGN + 3] * (A - params[OFFSET + 3]))
    out[row, 4] = wrap(params[SIGN + 4] * (B - params[OFFSET + 4]))
    out[row, 5] = wrap(params[SIGN + 5] * (C - params[OFFSET + 5]))


@jit
def _on_axis(
    params: Array, M: Entries, t23: tuple[float, float], value: float, branch: int, box: Array, arcs: Array,
    found: int, out: Array,
) -> int:  # fmt: skip
    """out[branch] ← W on axis 1 and θ1 the feasible one nearest to the seed's; returns the number of arcs."""
    near, low, high = box[NEAR], box[LOW], box[HIGH]
    wrist, parts = np.empty((3, 3)), np.empty((3, 3, 3))
    _affine_wrist(params, M, t23, parts)
    breaks, probes, angles = np.empty(32), np.empty(66), np.empty(6)
    n = 0
    if arcs.shape[0] > 0:
        count = zyz_breaks(parts, (low, high), 3, breaks, 0)
        for side in range(2):
            if high[0] - low[0] < TURN:
                breaks[count] = wrap(low[0] if side == 0 else high[0])
                count += 1
        n = lay_probes(breaks, count, probes)
    sign = 1.0 - 2.0 * (branch & 1)
    first = found
    best = math.inf
    t1 = near[0]
    for k in range(n + 1):
        # The last round writes the angle that was chosen.
        if k == n:
            if not math.isnan(value):
                t1 = params[SIGN] * value + params[OFFSET]
            elif found > first:
                t1 = nearest_in_arcs(arcs, first, found, near[0])
        angles[0] = probes[k] if k < n else t1
        c1, s1 = math.cos(angles[0]), math.sin(angles[0])
        for i in range(3):
            for j in range(3):
                wrist[i, j] = parts[0, i, j] + c1 * parts[1, i, j] + s1 * parts[2, i, j]
        zyz(wrist, sign, near, low, high, 3, angles)
        if k < n:
            misfit = misfit_of(angles, low, high, 0, 1) + misfit_of(angles, low, high, 3, 6)
            if misfit == 0.0 and found < arcs.shape[0]:
                found = extend_arcs(arcs, first, found, branch, probes, k, n)
            elif misfit < best and found == first:
                best, t1 = misfit, probes[k]
    _put(params, out, branch, t1, t23[0], t23[1], angles[3], angles[4], angles[5])
    return found


@jit
def _affine_wrist(params: Array, M: Entries, t23: tuple[float, float], parts: Array) -> None:
    """parts ``(3, 3, 3)`` ← M0, M1, M2 of the wrist's rotation M0 + M1 cos θ1 + M2 sin θ1, given θ2 and θ3."""
    r00, r01, r02, _, r10, r11, r12, _, r20, r21, r22, _ = M
    columns = ((r00, r10, r20), (r01, r11, r21), (r02, r12, r22))
    t2, t3 = t23
    phased = t2 - math.atan2(params[SIN_PHASE], params[COS_PHASE]) + (0.0 if params[SLIDES] else t3)
    g, s = math.cos(phased), math.sin(phased)
    for j in range(3):
        x, y, z = columns[j]
        parts[0, 0, j], parts[0, 1, j], parts[0, 2, j] = _seen(params, g, s, 0.0, 0.0, z)
        parts[1, 0, j], parts[1, 1, j], parts[1, 2, j] = _seen(params, g, s, x, y, 0.0)
        parts[2, 0, j], parts[2, 1, j], parts[2, 2, j] = _seen(params, g, s, y, -x, 0.0)
