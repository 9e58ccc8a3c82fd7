"""Arms with three parallel axes: six joints, axes 2, 3 and 4 parallel, axes 5 and 6 through one point W.

Universal Robots and their kin. With n the direction of axes 2, 3, 4, everything between joint 1 and W happens in
planes square to n, so two figures of the pose do not depend on joints 2, 3 and 4 (Hawkins, "Analytic Inverse
Kinematics for the Universal Robots UR-5/UR-10 Arms", 2013; the subproblems are those of Elias and Wen, "IK-Geo",
2022):

- n·W = L, the sum of the offsets along n. In the frame that turns with axis 1 this fixes y, hence
  x = ±√(wx² + wy² − y²), shoulder left or right, and θ1 = atan2(wy, wx) − atan2(y, x);
- R1ᵀ R = Rz(A) Ry(θ5) Rz(θ6) with A = θ2 + θ3 + θ4: two wrists, (A, θ5, θ6) and (A + π, −θ5, θ6 + π);
- A and W give axis 4, and the triangle of axes 2, 3, 4 gives θ3 and θ2, elbow up or down; θ4 = A − θ2 − θ3.

Eight branches. The twist between axes 1 and 2 and all offsets may be anything, but axes 5 and 6 meet, squarely.
Singular: s3 = 0 (two elbows merge); x = 0 (two shoulders merge); s5 = 0, where axis 6 is parallel to the three
and θ6 is free: then axis 4 goes round a circle, and where it meets the end of the elbow's reach or a joint a
limit is a root of ``a cos ψ + b sin ψ + c = 0``, so the feasible θ6 are exact arcs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK
from kin.kernels.simd import atan2, widest, wrapped
from kin.robot import Robot
from kin.solvers.blocks import OWN, Arc, Entries, canonical_of, double, each, elbow_of, one, rows_of, single
from kin.solvers.common import clear, copy_row, is_zero, wrap
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.links import (
    canonical,
    free_last,
    is_square,
    links_of,
    planar_angles,
    planar_free,
    pose_params,
    rolled,
    signed_box,
    two_links,
)
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "parallel6"
TITLE = "closed form, three parallel axes and a wrist"
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s in ("left", "right")
    for e in ("up", "down")
    for w in ("no-flip", "flip")
)
_SPIN6 = RedundancyParameter("theta6", "θ6", joint=5, circular=True, rare=True)
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_REACH = TOLERANCES.closure_position * 0.1
_SINGULAR = TOLERANCES.singular
_MERGE = TOLERANCES.merge
_STEPS = 180  # that half a turn of θ1 is tried in, where it is free
_FAR = 1e6
_ROUNDING, _HAIR = 1e-14, 3e-7  # metres in a target's coordinates; the root of that
# Layout of params: base⁻¹ and tool⁻¹ (24), signs, offsets, lengths and the first twist, limits that never bind.
_SHAPE, _LOW, _HIGH, _SIZE = 36, 44, 50, 56


class Geometry(NamedTuple):
    """The arm in canonical form: angles are θ = sign q + offset.

    Attributes:
        params: what the kernels read.
        sign, offset: ``(6,)``.
        a1, a2, a3, a4, d5: distances axis 1 to 2, 2 to 3, 3 to 4, 4 to 5, and along axis 5 to W.
        beside: L, the sum of the offsets along axes 2, 3 and 4.
        tool_on_axis: whether joint 6 turns the tool about its own z axis.
    """

    params: Array
    sign: Array
    offset: Array
    a1: float
    a2: float
    a3: float
    a4: float
    d5: float
    beside: float
    tool_on_axis: bool


def match(robot: Robot) -> Parallel6 | None:
    """The closed form if axes 2, 3, 4 are parallel and 1 is not, 4-5 and 5-6 are square, and 5 and 6 meet."""
    if robot.n != 6 or not robot.revolute.all():
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if alpha[0] == 0.0 or alpha[1] != 0.0 or alpha[2] != 0.0 or not is_zero(a[4]):
        return None
    if not (is_square(alpha[3]) and is_square(alpha[4])) or min(a[1], a[2]) < TOLERANCES.geometry:
        return None
    a1, a2, a3, a4, d5 = (float(x) for x in (a[0], a[1], a[2], a[3], d[4]))
    beside = 0.0 if is_zero(d[3]) else float(d[3])
    shape = [a1, a2, a3, a4, d5, beside, math.cos(alpha[0]), math.sin(alpha[0])]
    params = np.array(
        [*pose_params(links.base, links.tool), *links.sign, *links.theta, *shape, *[-_FAR] * 6, *[_FAR] * 6]
    )
    on_axis = is_zero(links.tool[0, 3], links.tool[1, 3], abs(links.tool[2, 2]) - 1.0)
    return Parallel6(Geometry(params, links.sign, links.theta, a1, a2, a3, a4, d5, beside, on_axis))


@jit
def _put(
    params: Array, out: Array, row: int, t1: float, t2: float, t3: float, t4: float, B: float, C: float
) -> None:
    """out[row] ← joint values of canonical angles."""
    out[row, 0] = wrap(params[24] * (t1 - params[30]))
    out[row, 1] = wrap(params[25] * (t2 - params[31]))
    out[row, 2] = wrap(params[26] * (t3 - params[32]))
    out[row, 3] = wrap(params[27] * (t4 - params[33]))
    out[row, 4] = wrap(params[28] * (B - params[34]))
    out[row, 5] = wrap(params[29] * (C - params[35]))


@jit
def _box(params: Array, near: Array, lower: Array, upper: Array, out_near: Array, low: Array, high: Array) -> None:
    """out_near, low, high ``(6,)`` ← seed and limits of θ2, θ3, θ4, θ6, then of θ1 and θ5."""
    a, b, c = np.empty(6), np.empty(6), np.empty(6)
    signed_box(near, lower, upper, params[24:30], params[30:36], a, b, c)
    for i in range(6):
        k = (1, 2, 3, 5, 0, 4)[i]
        out_near[i], low[i], high[i] = a[k], b[k], c[k]


@jit
def _spinning(
    params: Array, t1: float, u: float, v: float, B: float, turn: float, up: float, value: float, branch: int,
    near: Array, lower: Array, upper: Array, arcs: Array, found: int, out: Array,
) -> int:  # fmt: skip
    """out[branch] ← the arm with axis 6 parallel to axis 4, θ6 free; returns the number of arcs of θ6 so far.

    ``A + θ6 = turn`` for B = 0, ``A − θ6 = turn`` for B = π. The planar arm's third link is that from axis 4 to W.
    """
    box, low, high, angles = np.empty(6), np.empty(6), np.empty(6), np.empty(4)
    _box(params, near, lower, upper, box, low, high)
    spin = 1.0 if B == 0.0 else -1.0
    own, first = arcs, found
    if arcs.shape[0] == 0:
        own = np.empty((64, 3))
    C = box[3] if math.isnan(value) else params[29] * value + params[35]
    psi, found = planar_free(
        u, v, params[_SHAPE + 3], params[_SHAPE + 4], params[_SHAPE + 1], params[_SHAPE + 2], up, spin, turn,
        turn - spin * C, not math.isnan(value), branch, box, low, high, own, found, angles,
    )  # fmt: skip
    for k in range(first, found):
        # An arc of ψ as one of joint 6.
        a = params[29] * (spin * (turn - own[k, 1]) - params[35])
        b = params[29] * (spin * (turn - own[k, 2]) - params[35])
        own[k, 1], own[k, 2] = min(a, b), max(a, b)
    if not math.isnan(psi):
        _put(params, out, branch, t1, angles[0], angles[1], angles[2], B, angles[3])
    return int(min(found, arcs.shape[0]))


@jit
def _facing(params: Array, T: Array, near: Array, lower: Array, upper: Array) -> float:
    """θ1 for W on axis 1, where it is free: of those that bring axis 4 within reach, in steps, the seed's nearest.

    W is on axis 1 for arms without L only, and what then is allowed is no simple arc: A turns with θ1, unevenly.
    """
    _, _, r02, _, _, _, r12, _, _, _, r22, wz = canonical(params, T)
    ca, sa = params[_SHAPE + 6], params[_SHAPE + 7]
    y = (ca * wz - params[_SHAPE + 5]) / sa
    u, v = -params[_SHAPE], ca * y + sa * wz
    a2, a3, a4, d5 = params[_SHAPE + 1], params[_SHAPE + 2], params[_SHAPE + 3], params[_SHAPE + 4]
    a, b = params[24] * lower[0] + params[30], params[24] * upper[0] + params[30]
    low, high = min(a, b), max(a, b)
    start = min(max(params[24] * near[0] + params[30], low), high)
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
        for wi in range(2):
            k1 = (1.0 if wi == 0 else -1.0) / length
            px, py = u - k1 * (a4 * x - d5 * z), v - k1 * (a4 * z + d5 * x)
            miss = two_links(px, py, a2, a3)[0]
            if miss <= 0.0:
                return float(t1)
            if miss < least:
                best, least = t1, miss
    return float(best)


@jit
def _within(u: float, v: float, p: float, q: float, a: float, b: float, A: float, hair: float) -> float:
    """The direction nearest to A that brings axis 4 within reach, A itself if that is more than a hair away."""
    low, high, angles, arcs = np.full(4, -_FAR), np.full(4, _FAR), np.empty(4), np.empty((16, 3))
    none = min(0, arcs.shape[0])
    psi, _ = planar_free(u, v, p, q, a, b, 1.0, 0.0, 0.0, A, hair < 0.0, none, low, low, high, arcs, none, angles)
    return float(psi if abs(wrap(psi - A)) < hair else A)


@jit
def _branches(
    params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, free: Array,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """The branches inside limits ``(6,)``, see `branches_one`: (gap, number of arcs).

    free ``(≥ 8,)`` ← 1 for the rows in which θ6 is free, else 0; left alone if it is shorter.
    """
    clear(out)
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, wz = canonical(params, T)
    a1, a2, a3, a4, d5 = (
        params[_SHAPE], params[_SHAPE + 1], params[_SHAPE + 2], params[_SHAPE + 3], params[_SHAPE + 4]
    )  # fmt: skip
    beside, ca, sa = params[_SHAPE + 5], params[_SHAPE + 6], params[_SHAPE + 7]
    y = (ca * wz - beside) / sa
    r = math.sqrt(wx * wx + wy * wy)
    if r < abs(y) - _REACH:
        return abs(y) - r, 0
    root = math.sqrt(max((r - abs(y)) * (r + abs(y)), 0.0))
    if root < _MERGE * abs(y) or r < _SINGULAR:
        root = 0.0
    azimuth = atan2(wy, wx)
    # Where two shoulders merge θ1 is known but roughly, and what misses by a hair may be mended.
    slack = _REACH + (abs(y) + abs(a4) + abs(d5)) * min(_HAIR, _ROUNDING / max(root, _ROUNDING))
    left = 1.0 if beside >= 0.0 else -1.0
    gap = math.inf
    found = min(0, arcs.shape[0])  # a bare 0 would have what it is passed to compiled once more, for that number
    for si in range(1 if root == 0.0 else 2):
        side = left if si == 0 else -left
        x = side * root
        t1 = _facing(params, T, near, lower, upper) if r < _SINGULAR else azimuth - atan2(y, x)
        c1, s1 = math.cos(t1), math.sin(t1)
        v0, v1, v2 = c1 * r10 - s1 * r00, c1 * r11 - s1 * r01, c1 * r12 - s1 * r02
        m00, m01, m02 = c1 * r00 + s1 * r10, c1 * r01 + s1 * r11, c1 * r02 + s1 * r12
        m10, m11, m12, m22 = ca * v0 + sa * r20, ca * v1 + sa * r21, ca * v2 + sa * r22, ca * r22 - sa * v2
        u, v = x - a1, ca * y + sa * wz
        sine = math.sqrt(m02 * m02 + m12 * m12)
        if sine < _SINGULAR:
            B = 0.0 if m22 > 0.0 else math.pi
            turn = atan2(m10, m00) if m22 > 0.0 else atan2(-m10, -m00)
            for ei in range(2):
                up = side if ei == 0 else -side
                branch = 4 * si + 2 * ei
                found = _spinning(
                    params, t1, u, v, B, turn, up, value, branch, near, lower, upper, arcs, found, out
                )
                copy_row(out, branch, branch + 1)
                if free.shape[0] >= 8:
                    free[branch] = free[branch + 1] = 1.0
            # How far the circle that axis 4 may be on is from the reach of the elbow.
            R, rho = math.hypot(u, v), math.hypot(a4, d5)
            gap = min(gap, abs(R - rho) - a2 - a3, abs(a2 - a3) - R - rho) if math.isnan(out[4 * si, 0]) else 0.0
            continue
        cA, sA = m02 / sine, m12 / sine
        A0, B0 = atan2(m12, m02), atan2(sine, m22)
        C0 = atan2(cA * m10 - sA * m00, cA * m11 - sA * m01)
        for wi in range(2):
            flip, turned = (1.0, 0.0) if wi == 0 else (-1.0, math.pi)
            A, B, C = A0 + turned, flip * B0, C0 + turned
            px, py = u - flip * (a4 * cA - d5 * sA), v - flip * (a4 * sA + d5 * cA)
            miss, bend, _, k1, k2 = two_links(px, py, a2, a3)
            if miss > _REACH and miss * sine < _ROUNDING:
                # Beside s5 = 0 A is known but roughly: a hair more or less of it may be what brings axis 4 near.
                A = _within(u, v, a4, d5, a2, a3, A, _REACH / sine)
                c, s = math.cos(A), math.sin(A)
                B = atan2(c * m02 + s * m12, m22)
                C = atan2(c * m10 - s * m00, c * m11 - s * m01)
                px, py = u - a4 * c + d5 * s, v - a4 * s - d5 * c
                miss, bend, _, k1, k2 = two_links(px, py, a2, a3)
            gap = min(gap, miss)
            if miss > slack:
                continue
            middle, half = atan2(py, px), atan2(k2, k1)
            for ei in range(2 if bend > 0.0 else 1):
                up = side if ei == 0 else -side
                t2, t3 = middle - up * half, up * bend
                if px * px + py * py < _SINGULAR * _SINGULAR:
                    t2 = _folded(params, A - t3, near, lower, upper)
                _put(params, out, 4 * si + 2 * ei + wi, t1, t2, t3, A - t2 - t3, B, C)
            if bend == 0.0:
                copy_row(out, 4 * si + wi, 4 * si + 2 + wi)
    if root == 0.0:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
            if free.shape[0] >= 8:
                free[branch + 4] = free[branch]
    return gap, found


@jit
def _folded(params: Array, total: float, near: Array, lower: Array, upper: Array) -> float:
    """θ2 with axis 4 on axis 2, where only θ2 + θ4 counts."""
    box, low, high, angles = np.empty(6), np.empty(6), np.empty(6), np.empty(4)
    _box(params, near, lower, upper, box, low, high)
    planar_angles(0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, total + math.pi, box, low, high, angles)
    return float(angles[0])


# Thin: all branches, without limits, ranges and a choice, as :mod:`kin.solvers.blocks` has it. Rows of S are of
# the shoulders (left, right) θ1, θ5, θ6 and A, of the four pairs of shoulder and wrist θ3, of the eight branches
# θ2. The other elbow is −θ3, the other wrist −θ5 and half a turn on in θ6 and A; θ4 is what A leaves.
_FRONT, _TILT, _SPIN, _SUM, _BEND, _UPPER, _END = (OWN + i for i in (0, 2, 4, 6, 8, 12, 20))
_PAIRS, _ROWS = _END - OWN, _END + _END - OWN + 1
_REST = _PAIRS + _UPPER  # θ4
_BESIDE = 1e-3  # of the lengths: what two shoulders are apart that the careful kernel looks at
_ALONG = 1e-4  # the sine of θ5 at which it looks


@inlined
def _arm(
    u: float, v: float, p: float, q: float, a2: float, a3: float, side: float, S: Array, pair: int, branch: int,
    b: int,
) -> bool:  # fmt: skip
    """The pairs of θ2 and θ3 with axis 4 at (u − p, v − q), on the shoulder `side`; whether to look closely."""
    px, py = u - p, v - q
    c3, s3, scale, close = elbow_of(px, py, a2, a3)
    s3 = side * s3
    S[_BEND + pair, b], S[_PAIRS + _BEND + pair, b] = s3, c3
    A, B = a2 + a3 * c3, a3 * s3
    S[_UPPER + branch, b], S[_PAIRS + _UPPER + branch, b] = (py * A - px * B) * scale, (px * A + py * B) * scale
    branch += 2
    S[_UPPER + branch, b], S[_PAIRS + _UPPER + branch, b] = (py * A + px * B) * scale, (px * A - py * B) * scale
    return close


@inlined
def _shoulder(
    M: Entries, x: float, y: float, scale: float, side: float,
    lengths: tuple[float, float, float, float, float, float, float], S: Array, si: int, b: int,
) -> bool:  # fmt: skip
    """All pairs of the shoulder with W at (x, y) in the frame that turns with axis 1, scale = 1/r²."""
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, wz = M
    a1, a2, a3, a4, d5, ca, sa = lengths
    c1, s1 = (wx * x + wy * y) * scale, (wy * x - wx * y) * scale
    v0, v1, v2 = c1 * r10 - s1 * r00, c1 * r11 - s1 * r01, c1 * r12 - s1 * r02
    m00, m01, m02 = c1 * r00 + s1 * r10, c1 * r01 + s1 * r11, c1 * r02 + s1 * r12
    m10, m11, m12, m22 = ca * v0 + sa * r20, ca * v1 + sa * r21, ca * v2 + sa * r22, ca * r22 - sa * v2
    square = m02 * m02 + m12 * m12
    sine = math.sqrt(square)
    inverse = sine / square
    cA, sA = m02 * inverse, m12 * inverse
    S[_FRONT + si, b], S[_PAIRS + _FRONT + si, b] = s1, c1
    S[_TILT + si, b], S[_PAIRS + _TILT + si, b] = sine, m22
    S[_SPIN + si, b], S[_PAIRS + _SPIN + si, b] = cA * m10 - sA * m00, cA * m11 - sA * m01
    S[_SUM + si, b], S[_PAIRS + _SUM + si, b] = m12, m02
    u, v, p, q = x - a1, ca * y + sa * wz, a4 * cA - d5 * sA, a4 * sA + d5 * cA
    close0 = _arm(u, v, p, q, a2, a3, side, S, 2 * si, 4 * si, b)
    close1 = _arm(u, v, -p, -q, a2, a3, side, S, 2 * si + 1, 4 * si + 1, b)
    return close0 | close1 | (sine < _ALONG)


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those to be looked at closely, and how many these are."""
    base, tool = rows_of(params, 0), rows_of(params, 12)
    a4, d5, beside, ca, sa = (
        params[_SHAPE + 3], params[_SHAPE + 4], params[_SHAPE + 5], params[_SHAPE + 6], params[_SHAPE + 7]
    )  # fmt: skip
    lengths = (params[_SHAPE], params[_SHAPE + 1], params[_SHAPE + 2], a4, d5, ca, sa)
    left = 1.0 if beside >= 0.0 else -1.0
    inverse_sa = 1.0 / sa
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        wx, wy, wz = M[3], M[7], M[11]
        y = (ca * wz - beside) * inverse_sa
        r2 = wx * wx + wy * wy
        r, apart = math.sqrt(r2), abs(y)
        square = (r - apart) * (r + apart)
        root = math.sqrt(square if square > 0.0 else 0.0)
        root = math.nan if r + _REACH < apart else root
        scale = 1.0 / r2
        x = left * root
        close0 = _shoulder(M, x, y, scale, left, lengths, S, 0, b)
        close1 = _shoulder(M, -x, y, scale, -left, lengths, S, 1, b)
        marked = close0 | close1 | (root < _BESIDE * (apart + abs(a4) + abs(d5)) + _SINGULAR)
        S[-1, b] = 1.0 if marked else 0.0
        found += 1 if marked else 0
    return found


@joined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    widest()
    single(arc, S, _FRONT, _TILT, _PAIRS, count, params[24], params[30])
    double(arc, S, _TILT, _SPIN, _PAIRS, count, params[28], params[34], False)
    double(arc, S, _SPIN, _SUM, _PAIRS, count, params[29], params[35], True)
    # A as joint 4 would have it with joints 2 and 3 at 0.
    double(arc, S, _SUM, _BEND, _PAIRS, count, params[27], params[31] + params[32] + params[33], True)
    double(arc, S, _BEND, _UPPER, _PAIRS, count, params[26], params[32], False)
    single(arc, S, _UPPER, _END, _PAIRS, count, params[25], params[31])
    sense2, sense3 = params[27] * params[25], params[27] * params[26]
    for si in range(2):
        for wi in range(2):
            pair = _BEND + 2 * si + wi
            wrist = _PAIRS * wi
            for b in range(count):
                bend, other, upper, lower = (
                    S[pair, b], S[_PAIRS + pair, b], S[_UPPER + 4 * si + wi, b], S[_UPPER + 4 * si + 2 + wi, b]
                )  # fmt: skip
                total = S[_SUM + wrist + si, b]
                S[_REST + 4 * si + wi, b] = wrapped(wrapped(total - sense2 * upper) - sense3 * bend)
                S[_REST + 4 * si + 2 + wi, b] = wrapped(wrapped(total - sense2 * lower) - sense3 * other)
                # Where the elbow does not close nothing is left of the branch.
                nothing = 0.0 * bend
                S[_TILT + wrist + si, b] += nothing
                S[_SPIN + wrist + si, b] += nothing
        for b in range(count):
            front = S[_FRONT + si, b]
            S[_FRONT + si, b] = front + 0.0 * S[_BEND + 2 * si, b]
            S[_PAIRS + _FRONT + si, b] = front + 0.0 * S[_BEND + 2 * si + 1, b]


@inlined
def _store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 6)`` ← the branches of target b."""
    for row in range(8):
        right, down, flip = row >> 2, (row >> 1) & 1, row & 1
        out[row, 0] = S[_PAIRS * flip + _FRONT + right, b]
        out[row, 1] = S[_UPPER + row, b]
        out[row, 2] = S[_PAIRS * down + _BEND + 2 * right + flip, b]
        out[row, 3] = S[_REST + row, b]
        out[row, 4] = S[_PAIRS * flip + _TILT + right, b]
        out[row, 5] = S[_PAIRS * flip + _SPIN + right, b]


@jit
def _closely(params: Array, T: Array, value: float, near: Array, out: Array) -> None:
    """out ``(8, 6)`` ← the branches by `_branches`, which is at home in singularities."""
    _branches(params, T, value, near, params[_LOW:_HIGH], params[_HIGH:_SIZE], out[:0], params[:0], out)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 6)`` ← all branches of the target T ``(4, 4)``; False if T is not finite."""
    S = np.empty((_ROWS, 1))
    return one(_pairs, _angles, _store, _closely, _PAIRS, params, T, value, near, out, S)


@jit
def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 8, 6)`` ← all branches of each of the targets T ``(N, 4, 4)``, values ``(N,)`` or ``(1,)``."""
    widest()
    S = np.empty((_ROWS, BLOCK))
    each(_pairs, _angles, _store, _closely, params, T, values, near, out, S)


class Parallel6(ClosedForm):
    """The closed form of an arm with three parallel axes and a wrist."""

    name, title, branches = NAME, TITLE, BRANCHES
    reason = (
        "axes 2, 3 and 4 are parallel, and axis 5 is perpendicular to axis 4 and meets axis 6 at a right angle"
    )

    def __init__(self, geometry: Geometry) -> None:
        g = self.geometry = geometry
        self.lengths = (g.a1, g.a2, g.a3, g.a4, g.d5, g.beside)
        self.kernels = BatchKernels(g.params, branches_one, branches_many)

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
        return task == POSE or (task == APPROACH and self.geometry.tool_on_axis)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ6: for a pose when axis 6 is parallel to axes 2, 3 and 4; for an approach direction always."""
        return (_THETA6,) if task == APPROACH else (_SPIN6,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches; with an approach direction only, joint 6 stays or takes the value requested."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out, arcs, free = np.empty((8, 6)), np.empty((128, 3)), np.zeros(8)
        T, lower, upper = problem.T, problem.lower, problem.upper
        if free_roll:
            T, lower, upper = rolled(T, problem.seed_roll), lower.copy(), upper.copy()
            lower[5], upper[5] = -_FAR, _FAR
        value = math.nan if free_roll else problem.values[0]
        gap, count = _branches(g.params, T, value, problem.seed, lower, upper, arcs, free, out)
        if free_roll:
            ranges = free_last(problem, out)
            values = out[:, 5:].copy()
        else:
            ranges = arcs[:count]
            values = np.where(free[:, None] == 1.0, out[:, 5:], math.nan)
        obstacle = None if gap <= _REACH else Obstacle("wrist centre beyond the elbow's reach")
        return Candidates(out, values, (ranges,), max(gap, 0.0), obstacle)

    def _x_of_wrist(self, t: Sequence[float] | Array) -> float:
        """x of W in the frame that turns with axis 1, metres."""
        g = self.geometry
        A = t[1] + t[2] + t[3]
        return float(
            g.a1 + g.a2 * math.cos(t[1]) + g.a3 * math.cos(t[1] + t[2]) + g.a4 * math.cos(A) - g.d5 * math.sin(A)
        )

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on.

        "Left": the arm's plane is on the left of axis 1, seen along the arm. The elbow is "up" when it is above
        the line from axis 2 to axis 4; the wrist is the sign of θ5.
        """
        t = self.geometry.sign * q + self.geometry.offset
        side = -1.0 if self._x_of_wrist(t) < 0.0 else 1.0
        right = (side < 0.0) == (self.geometry.beside >= 0.0)
        return 4 * int(right) + 2 * int(side * math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant, ±a2 a3 s3 · x sin α1 · s5: there are no others."""
        g = self.geometry
        t = (g.sign * q + g.offset).tolist()
        elbow, x, wrist = off_line(t[2]), self._x_of_wrist(t), off_line(t[4])
        if min(abs(elbow), abs(x), abs(wrist)) > within:
            return ()  # as almost everywhere
        straight, aligned = float(q[2] - g.sign[2] * elbow), float(q[4] - g.sign[4] * wrist)
        return those_within(
            within,
            Singularity(
                "elbow", elbow_at(t[2]), "axis 4 along the arm", abs(elbow), "rad", (JointValue(2, straight),)
            ),
            Singularity("shoulder", "wrist centre nearest to axis 1", "wrist centre along axis 2", abs(x), "m"),
            Singularity(
                "wrist",
                "axis 6 parallel to axes 2, 3 and 4",
                "tilt about the third axis",
                abs(wrist),
                "rad",
                (JointValue(4, aligned),),
            ),
        )
