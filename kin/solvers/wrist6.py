"""Elbow arms with a spherical wrist: six joints, axes 2 and 3 parallel, axes 4, 5 and 6 through one point W.

Most industrial arms are of this family: Puma 560, IRB 120, KR 6. The pose fixes W, and W fixes the first three
joints, whatever the wrist does (Pieper 1968). Seen from the frame that turns with axis 1, the plane the elbow
moves in lies at the distance L beside the axis, so W = (X, L, −h) there and

- X = ±√(wx² + wy² − L²), shoulder in front or at the back; θ1 = atan2(wy, wx) − atan2(L, X);
- D² = (X − a1)² + h²; tan²(θ3/2) = ((a2+f)² − D²)/(D² − (a2−f)²), elbow up or down, where f is the distance of W
  from axis 3; θ2 = atan2(h, X − a1) − atan2(f s3, a2 + f c3);
- R03ᵀ R = Rz(θ4) Ry(θ5) Rz(θ6): two wrists, (θ4, θ5, θ6) and (θ4 + π, −θ5, θ6 + π).

Eight branches; no angle is taken from a sine or cosine alone, so none loses digits. L, a1, the twist from axis
3 to axis 4 and the offsets of the elbow may be anything. Singular: s3 = 0 (two elbows merge); X = 0, where two
shoulders merge, or, if L = 0, W is on axis 1 and θ1 is free: R03ᵀ R is affine in cos θ1, sin θ1 and the
feasible θ1 are exact arcs; s5 = 0 (only θ4 ± θ6 matters).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK
from kin.kernels.simd import atan2, widest
from kin.robot import Robot
from kin.solvers.blocks import OWN, Arc, Entries, canonical_of, double, each, elbow_of, one, rows_of, single
from kin.solvers.common import (
    TURN,
    clear,
    copy_row,
    extend_arcs,
    is_zero,
    lay_probes,
    misfit_of,
    nearest_in_arcs,
    wrap,
    zyz,
    zyz_breaks,
)
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
    Links,
    canonical,
    free_last,
    is_square,
    links_of,
    pose_params,
    rolled,
    signed_box,
    two_links,
)
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "wrist6"
TITLE = "closed form, elbow arm with a spherical wrist"
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s in ("front", "back")
    for e in ("up", "down")
    for w in ("no-flip", "flip")
)
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0, circular=True, rare=True)
_THETA6 = RedundancyParameter("theta6", "θ6", joint=5)
_REACH = TOLERANCES.closure_position * 0.1
_SINGULAR = TOLERANCES.singular
_MERGE = TOLERANCES.merge
_ROUNDING, _HAIR = 1e-14, 3e-7  # metres in a target's coordinates; the root of that
_FAR = 1e6
# Layout of params: base⁻¹ and tool⁻¹ (24), signs, offsets, shape (see `pack`), then limits that never bind.
_SHAPE, _LOW, _HIGH, _SIZE = 36, 45, 51, 57


class Geometry(NamedTuple):
    """The arm in canonical form: angles are θ = sign q + offset.

    Attributes:
        params: what the kernels read.
        sign, offset: ``(6,)``.
        a1, a2, f, beside: distances axis 1 to 2, 2 to 3, 3 to W, and of the arm's plane from axis 1.
        tool_on_axis: whether joint 6 turns the tool about its own z axis.
    """

    params: Array
    sign: Array
    offset: Array
    a1: float
    a2: float
    f: float
    beside: float
    tool_on_axis: bool


def match(robot: Robot) -> Wrist6 | None:
    """The closed form if axes 2, 3 are parallel and perpendicular to axis 1, and 4, 5, 6 are a spherical wrist."""
    if robot.n != 6 or not robot.revolute.all():
        return None
    links = links_of(robot, (-1, -1, -1, -1, 1))
    a, d, alpha = links.a, links.d, links.alpha
    if not (is_square(alpha[0]) and alpha[1] == 0.0 and is_square(alpha[3]) and is_square(alpha[4])):
        return None
    if not is_zero(a[3], a[4], d[4]):
        return None
    # W as seen from axis 3, across it and along it.
    across = complex(a[2], -math.sin(alpha[2]) * d[3])
    beside = float(d[2] + math.cos(alpha[2]) * d[3])
    a1, a2, f, phase = float(a[0]), float(a[1]), abs(across), math.atan2(across.imag, across.real)
    if min(a2, f) < TOLERANCES.geometry:
        return None
    beside = 0.0 if is_zero(beside) else beside
    offset = links.theta.copy()
    offset[2] += phase
    return Wrist6(pack(links, offset, (a1, a2, f, beside), phase, float(alpha[2])))


def pack(
    links: Links, offset: Array, lengths: tuple[float, float, float, float], phase: float, twist: float,
    slides: bool = False,
) -> Geometry:  # fmt: skip
    """The geometry of these lengths (a1, a2, f, L) and angle offsets ``(6,)``.

    Axis 4 is turned by −phase and then by the twist against the line from axis 3 to W. With `slides` the third
    joint is one, as :mod:`kin.solvers.slide6` has it.
    """
    shape = [*lengths, math.cos(phase), math.sin(phase), math.cos(twist), math.sin(twist), float(slides)]
    params = np.array(
        [*pose_params(links.base, links.tool), *links.sign, *offset, *shape, *[-_FAR] * 6, *[_FAR] * 6]
    )
    on_axis = is_zero(links.tool[0, 3], links.tool[1, 3], abs(links.tool[2, 2]) - 1.0)
    return Geometry(params, links.sign, offset, *lengths, on_axis)


@jit
def _put(
    params: Array, out: Array, row: int, t1: float, t2: float, t3: float, A: float, B: float, C: float
) -> None:
    """out[row] ← joint values of canonical angles."""
    out[row, 0] = wrap(params[24] * (t1 - params[30]))
    out[row, 1] = wrap(params[25] * (t2 - params[31]))
    q3 = params[26] * (t3 - params[32])
    out[row, 2] = q3 if params[_SHAPE + 8] else wrap(q3)
    out[row, 3] = wrap(params[27] * (A - params[33]))
    out[row, 4] = wrap(params[28] * (B - params[34]))
    out[row, 5] = wrap(params[29] * (C - params[35]))


@jit
def _aligned(
    params: Array, x: float, y: float, z: float, m00: float, m10: float, m01: float, m11: float,
    near: Array, lower: Array, upper: Array,
) -> tuple[float, float, float]:  # fmt: skip
    """Wrist angles of a rotation whose third column is (x, y, z) with x = y = 0: θ4 and θ6 shared out."""
    box, low, high, angles = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    signed_box(near, lower, upper, params[24:30], params[30:36], box, low, high)
    M = np.empty((3, 3))
    M[0, 0], M[1, 0], M[0, 1], M[1, 1], M[0, 2], M[1, 2], M[2, 2] = m00, m10, m01, m11, x, y, z
    zyz(M, 1.0, box, low, high, 3, angles)
    return angles[3], angles[4], angles[5]


@jit
def _seen(params: Array, g: float, s: float, X: float, Y: float, Z: float) -> tuple[float, float, float]:
    """A vector that is (X, Y, Z) in the frame turning with axis 1, seen from the forearm at cos, sin = g, s."""
    ca, sa = params[_SHAPE + 6], params[_SHAPE + 7]
    v = -s * X - g * Z
    return g * X - s * Z, ca * v + sa * Y, ca * Y - sa * v


@jit
def _on_axis(
    params: Array, T: Array, t2: float, t3: float, sign: float, value: float, branch: int, near: Array,
    lower: Array, upper: Array, arcs: Array, found: int, out: Array,
) -> int:  # fmt: skip
    """out[branch] ← W on axis 1 and θ1 the feasible one nearest to the seed's; returns the number of arcs."""
    box, low, high, angles = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    signed_box(near, lower, upper, params[24:30], params[30:36], box, low, high)
    M, M0, M1, M2 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    r00, r01, r02, _, r10, r11, r12, _, r20, r21, r22, _ = canonical(params, T)
    columns = ((r00, r10, r20), (r01, r11, r21), (r02, r12, r22))
    breaks, probes = np.empty(32), np.empty(66)
    phased = t2 - math.atan2(params[_SHAPE + 5], params[_SHAPE + 4]) + (0.0 if params[_SHAPE + 8] else t3)
    g, s = math.cos(phased), math.sin(phased)
    for j in range(3):
        x, y, z = columns[j]
        M0[0, j], M0[1, j], M0[2, j] = _seen(params, g, s, 0.0, 0.0, z)
        M1[0, j], M1[1, j], M1[2, j] = _seen(params, g, s, x, y, 0.0)
        M2[0, j], M2[1, j], M2[2, j] = _seen(params, g, s, y, -x, 0.0)
    n = 0
    if arcs.shape[0] > 0:
        count = zyz_breaks(M0, M1, M2, low, high, 3, breaks, 0)
        for side in range(2):
            if high[0] - low[0] < TURN:
                breaks[count] = wrap(low[0] if side == 0 else high[0])
                count += 1
        n = lay_probes(breaks, count, probes)
    first = found
    best = math.inf
    t1 = box[0]
    for k in range(n + 1):
        # The last round writes the angle that was chosen.
        if k == n:
            if not math.isnan(value):
                t1 = params[24] * value + params[30]
            elif found > first:
                t1 = nearest_in_arcs(arcs, first, found, box[0])
        angles[0] = probes[k] if k < n else t1
        c1, s1 = math.cos(angles[0]), math.sin(angles[0])
        for i in range(3):
            for j in range(3):
                M[i, j] = M0[i, j] + c1 * M1[i, j] + s1 * M2[i, j]
        zyz(M, sign, box, low, high, 3, angles)
        if k < n:
            misfit = misfit_of(angles, low, high, 0, 1) + misfit_of(angles, low, high, 3, 6)
            if misfit == 0.0 and found < arcs.shape[0]:
                found = extend_arcs(arcs, first, found, branch, probes, k, n)
            elif misfit < best and found == first:
                best, t1 = misfit, probes[k]
    _put(params, out, branch, t1, t2, t3, angles[3], angles[4], angles[5])
    return found


@jit
def _branches(
    params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """The branches inside limits ``(6,)``, see `branches_one`. Returns (gap, number of arcs of θ1 or −1)."""
    clear(out)
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, wz = canonical(params, T)
    a1, a2, f, beside = params[_SHAPE], params[_SHAPE + 1], params[_SHAPE + 2], params[_SHAPE + 3]
    slides = params[_SHAPE + 8] != 0.0
    r = math.sqrt(wx * wx + wy * wy)
    if r < abs(beside) - _REACH:
        return abs(beside) - r, -1
    free = beside == 0.0 and r < _SINGULAR
    root = math.sqrt(max((r - abs(beside)) * (r + abs(beside)), 0.0))
    if beside != 0.0 and root < _MERGE * abs(beside):
        root = 0.0
    single = free or root == 0.0
    azimuth = atan2(wy, wx)
    gap = math.inf
    found = 0 if free else -1
    for si in range(1 if single else 2):
        side = 1.0 if si == 0 else -1.0
        X = side * root
        x, h = X - a1, -wz
        D = math.sqrt(x * x + h * h)
        if slides:
            # The slide runs past axis 2 at the distance f, and W is at ±bend on it.
            miss, c3, k2 = abs(f) - D, 1.0, -f
            bend = math.sqrt(max((D - f) * (D + f), 0.0))
            if bend < max(_MERGE * abs(f), _SINGULAR):
                bend = 0.0
            k1 = bend
        else:
            miss, bend, c3, k1, k2 = two_links(x, h, a2, f)
        if miss > _REACH and beside != 0.0 and not slides:
            # Where two shoulders merge X is known but roughly: a hair more or less may be what the elbow needs.
            edge = a2 + f if x * x + h * h > a2 * a2 + f * f else a2 - f
            nearest = math.copysign(math.sqrt(max(edge * edge - h * h, 0.0)), x)
            if abs(nearest - x) < abs(beside) * min(_HAIR, _ROUNDING / max(root, _ROUNDING)):
                x = nearest
                X = x + a1
                miss, bend, c3, k1, k2 = two_links(x, h, a2, f)
                D = math.sqrt(x * x + h * h)
        gap = min(gap, miss)
        if miss > _REACH:
            continue
        t1 = azimuth - atan2(beside, X)
        scale = 1.0 / max(r * math.sqrt(X * X + beside * beside), 1e-300)
        c1, s1 = (wx * X + wy * beside) * scale, (wy * X - wx * beside) * scale
        x0, y0 = c1 * r00 + s1 * r10, c1 * r10 - s1 * r00
        x1, y1 = c1 * r01 + s1 * r11, c1 * r11 - s1 * r01
        x2, y2 = c1 * r02 + s1 * r12, c1 * r12 - s1 * r02
        for ei in range(2 if bend > 0.0 else 1):
            up = (side if ei == 0 else -side) if not slides else (1.0 if ei == 0 else -1.0)
            e1, e2 = (up * k1, k2) if slides else (k1, up * k2)
            c2, s2 = x * e1 + h * e2, h * e1 - x * e2
            if D < _SINGULAR:
                # W on axis 2, as in a folded arm of equal links: θ2 is free.
                a, b = params[25] * lower[1] + params[31], params[25] * upper[1] + params[31]
                t2 = min(max(params[25] * near[1] + params[31], min(a, b)), max(a, b))
                c2, s2 = math.cos(t2), math.sin(t2)
            else:
                t2 = atan2(s2, c2)
                unit = 1.0 / math.sqrt(c2 * c2 + s2 * s2)
                c2, s2 = c2 * unit, s2 * unit
            t3, s3 = up * bend, 0.0 if slides else up * k2 / f
            branch = 4 * si + 2 * ei
            if free:
                for wi in range(2):
                    sign = 1.0 if wi == 0 else -1.0
                    found = _on_axis(
                        params, T, t2, t3, sign, value, branch + wi, near, lower, upper, arcs, found, out
                    )
                continue
            c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
            g = c23 * params[_SHAPE + 4] + s23 * params[_SHAPE + 5]
            s = s23 * params[_SHAPE + 4] - c23 * params[_SHAPE + 5]
            m00, m10, _ = _seen(params, g, s, x0, y0, r20)
            m01, m11, _ = _seen(params, g, s, x1, y1, r21)
            m02, m12, m22 = _seen(params, g, s, x2, y2, r22)
            sine = math.sqrt(m02 * m02 + m12 * m12)
            if sine < _SINGULAR:
                A, B, C = _aligned(params, m02, m12, m22, m00, m10, m01, m11, near, lower, upper)
                _put(params, out, branch, t1, t2, t3, A, B, C)
                copy_row(out, branch, branch + 1)
            else:
                cA, sA = m02 / sine, m12 / sine
                A, B = atan2(m12, m02), atan2(sine, m22)
                C = atan2(cA * m10 - sA * m00, cA * m11 - sA * m01)
                _put(params, out, branch, t1, t2, t3, A, B, C)
                # The other wrist, with the same three first joints.
                out[branch + 1, 0], out[branch + 1, 1], out[branch + 1, 2] = (
                    out[branch, 0], out[branch, 1], out[branch, 2]
                )  # fmt: skip
                out[branch + 1, 3] = wrap(params[27] * (A + math.pi - params[33]))
                out[branch + 1, 4] = wrap(params[28] * (-B - params[34]))
                out[branch + 1, 5] = wrap(params[29] * (C + math.pi - params[35]))
        if bend == 0.0:
            copy_row(out, 4 * si, 4 * si + 2)
            copy_row(out, 4 * si + 1, 4 * si + 3)
    if single:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return gap, found


# Thin: all branches, without limits, ranges and a choice, as :mod:`kin.solvers.blocks` has it. Rows of S are θ1
# (front, back), θ3 (front, back), and of the four arms (front up, front down, back up, back down) θ2, θ4, θ5, θ6.
# The other elbow is −θ3, the other wrist −θ5 and half a turn on in θ4 and θ6.
FRONT, BEND, _UPPER, _ROLL, _TILT, _SPIN, _END = (OWN + i for i in (0, 2, 4, 8, 12, 16, 20))
PAIRS, ROWS = _END - OWN, _END + _END - OWN + 1
_BESIDE = 1e-4  # of the distance L: how far apart two shoulders are that the careful kernel looks at
Rotation = tuple[float, float, float, float, float, float, float, float, float]


@inlined
def shape_of(params: Array) -> tuple[float, float, float, float, tuple[float, float, float, float]]:
    """a1, a2, f, L, and how axis 4 stands against the line from axis 3 to W; see `pack`."""
    p, k = params, _SHAPE
    return p[k], p[k + 1], p[k + 2], p[k + 3], (p[k + 4], p[k + 5], p[k + 6], p[k + 7])


@inlined
def shoulder(wx: float, wy: float, beside: float) -> tuple[float, float, bool]:
    """X of the shoulder in front, NaN if W is too near to axis 1; 1/r²; whether it is to be looked at closely."""
    r2 = wx * wx + wy * wy
    r, apart = math.sqrt(r2), abs(beside)
    square = (r - apart) * (r + apart)
    x = math.sqrt(square if square > 0.0 else 0.0)
    x = math.nan if r + _REACH < apart else x
    return x, 1.0 / r2, x < _BESIDE * apart + _SINGULAR


@inlined
def turned(M: Entries, X: float, beside: float, scale: float) -> tuple[float, float, Rotation]:
    """sin and cos of θ1 with W at (X, L), scale = 1/r²; the rotation's columns as seen once axis 1 has turned."""
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, _ = M
    c, s = (wx * X + wy * beside) * scale, (wy * X - wx * beside) * scale
    R = (
        c * r00 + s * r10, c * r10 - s * r00, r20,
        c * r01 + s * r11, c * r11 - s * r01, r21,
        c * r02 + s * r12, c * r12 - s * r02, r22,
    )  # fmt: skip
    return s, c, R


@inlined
def arm_pairs(
    x: float, h: float, A: float, B: float, c3: float, s3: float, scale: float, R: Rotation,
    stands: tuple[float, float, float, float], S: Array, arm: int, b: int,
) -> bool:  # fmt: skip
    """The pairs of θ2, θ4, θ5, θ6, given θ3 and scale = 1/D²; whether axes 4 and 6 are in line.

    W is at (x, h) in the arm's plane, and seen from axis 2 at (A, B) with θ2 = 0.
    """
    c2, s2 = (x * A + h * B) * scale, (h * A - x * B) * scale
    S[_UPPER + arm, b], S[PAIRS + _UPPER + arm, b] = s2, c2
    cp, sp, ca, sa = stands
    c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
    g, s = c23 * cp + s23 * sp, s23 * cp - c23 * sp
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = R
    # As `_seen`.
    v0, v1, v2 = -s * x0 - g * z0, -s * x1 - g * z1, -s * x2 - g * z2
    m00, m01, m02 = g * x0 - s * z0, g * x1 - s * z1, g * x2 - s * z2
    m10, m11, m12, m22 = ca * v0 + sa * y0, ca * v1 + sa * y1, ca * v2 + sa * y2, ca * y2 - sa * v2
    sine = math.sqrt(m02 * m02 + m12 * m12)
    S[_ROLL + arm, b], S[PAIRS + _ROLL + arm, b] = m12, m02
    S[_TILT + arm, b], S[PAIRS + _TILT + arm, b] = sine, m22
    S[_SPIN + arm, b], S[PAIRS + _SPIN + arm, b] = m02 * m10 - m12 * m00, m02 * m11 - m12 * m01
    return sine < _SINGULAR


@inlined
def _side(
    M: Entries, X: float, scale: float, side: float, lengths: tuple[float, float, float, float],
    stands: tuple[float, float, float, float], S: Array, back: int, b: int,
) -> bool:  # fmt: skip
    """All pairs of the shoulder with W at X, scale = 1/r²; whether one is to be looked at closely."""
    a1, a2, f, beside = lengths
    s1, c1, R = turned(M, X, beside, scale)
    x, h = X - a1, -M[11]
    c3, s3, inverse_D2, close0 = elbow_of(x, h, a2, f)
    s3 = side * s3
    S[FRONT + back, b], S[PAIRS + FRONT + back, b] = s1, c1 + 0.0 * c3
    S[BEND + back, b], S[PAIRS + BEND + back, b] = s3, c3
    A, B = a2 + f * c3, f * s3
    close1 = arm_pairs(x, h, A, B, c3, s3, inverse_D2, R, stands, S, 2 * back, b)
    close2 = arm_pairs(x, h, A, -B, c3, -s3, inverse_D2, R, stands, S, 2 * back + 1, b)
    return close0 | close1 | close2


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those to be looked at closely, and how many these are."""
    base, tool = rows_of(params, 0), rows_of(params, 12)
    a1, a2, f, beside, stands = shape_of(params)
    lengths = (a1, a2, f, beside)
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        X, scale, close = shoulder(M[3], M[7], beside)
        close0 = _side(M, X, scale, 1.0, lengths, stands, S, 0, b)
        close1 = _side(M, -X, scale, -1.0, lengths, stands, S, 1, b)
        marked = close | close0 | close1
        S[-1, b] = 1.0 if marked else 0.0
        found += 1 if marked else 0
    return found


@joined
def all_but_third(arc: Arc, params: Array, count: int, S: Array) -> None:
    """S ← the values of joints 1, 2, 4, 5, 6 for `count` targets, from the pairs."""
    single(arc, S, FRONT, BEND, PAIRS, count, params[24], params[30])
    single(arc, S, _UPPER, _ROLL, PAIRS, count, params[25], params[31])
    double(arc, S, _ROLL, _TILT, PAIRS, count, params[27], params[33], True)
    double(arc, S, _TILT, _SPIN, PAIRS, count, params[28], params[34], False)
    double(arc, S, _SPIN, _END, PAIRS, count, params[29], params[35], True)


@joined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    widest()
    all_but_third(arc, params, count, S)
    double(arc, S, BEND, _UPPER, PAIRS, count, params[26], params[32], False)


@inlined
def store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 6)`` ← the branches of target b."""
    for row in range(8):
        back, down, flip, arm = row >> 2, (row >> 1) & 1, row & 1, row >> 1
        out[row, 0] = S[FRONT + back, b]
        out[row, 1] = S[_UPPER + arm, b]
        out[row, 2] = S[PAIRS * down + BEND + back, b]
        out[row, 3] = S[PAIRS * flip + _ROLL + arm, b]
        out[row, 4] = S[PAIRS * flip + _TILT + arm, b]
        out[row, 5] = S[PAIRS * flip + _SPIN + arm, b]


@jit
def closely(params: Array, T: Array, value: float, near: Array, out: Array) -> None:
    """out ``(8, 6)`` ← the branches by `_branches`, which is at home in singularities."""
    _branches(params, T, value, near, params[_LOW:_HIGH], params[_HIGH:_SIZE], out[:0], out)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 6)`` ← all branches of the target T ``(4, 4)``; False if T is not finite."""
    S = np.empty((ROWS, 1))
    return one(_pairs, _angles, store, closely, PAIRS, params, T, value, near, out, S)


@jit
def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 8, 6)`` ← all branches of each of the targets T ``(N, 4, 4)``, values ``(N,)`` or ``(1,)``."""
    widest()
    S = np.empty((ROWS, BLOCK))
    each(_pairs, _angles, store, closely, params, T, values, near, out, S)


class Wrist6(ClosedForm):
    """The closed form of an elbow arm with a spherical wrist."""

    name, title, branches = NAME, TITLE, BRANCHES
    reason = "axes 4, 5 and 6 meet in one point, and axes 2 and 3 are parallel and perpendicular to axis 1"

    def __init__(self, geometry: Geometry) -> None:
        g = self.geometry = geometry
        self.lengths = (g.a1, g.a2, g.f, g.beside)
        self.kernels = BatchKernels(g.params, branches_one, branches_many)

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
        return task == POSE or (task == APPROACH and self.geometry.tool_on_axis)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ1 where the wrist centre can be on axis 1; for an approach direction joint 6 as well."""
        return (_THETA1,) * self._reaches_axis_1 + (_THETA6,) * (task == APPROACH)

    @property
    def _reaches_axis_1(self) -> bool:
        """Whether W can be on axis 1."""
        return self.geometry.beside == 0.0

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches; with an approach direction only, joint 6 stays or takes the value requested."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out, arcs = np.empty((8, 6)), np.empty((128, 3))
        T, lower, upper = problem.T, problem.lower, problem.upper
        if free_roll:
            T, lower, upper = rolled(T, problem.seed_roll), lower.copy(), upper.copy()
            lower[5], upper[5] = -_FAR, _FAR
        value = problem.values[0] if self._reaches_axis_1 else math.nan
        gap, count = _branches(g.params, T, value, problem.seed, lower, upper, arcs, out)
        values, ranges = np.full((8, len(self.redundancies(problem.task))), math.nan), []
        if self._reaches_axis_1:
            rows = arcs[: max(count, 0)]
            rows[:, 1:] -= g.offset[0]
            if g.sign[0] < 0.0:
                rows[:, 1:] = -rows[:, :0:-1]
            if count >= 0:
                values[:, 0] = out[:, 0]
            ranges.append(rows)
        if free_roll:
            ranges.append(free_last(problem, out))
            values[:, -1] = out[:, 5]
        obstacle = None if gap <= _REACH else self._obstacle()
        return Candidates(out, values, tuple(ranges), max(gap, 0.0), obstacle)

    def _obstacle(self) -> Obstacle:
        return Obstacle("wrist centre beyond the elbow's reach")

    def _x_of_wrist(self, t: Sequence[float] | Array) -> float:
        """X of the wrist centre: how far it is before axis 1 in the arm's own plane, metres."""
        g = self.geometry
        return float(g.a1 + g.a2 * math.cos(t[1]) + g.f * math.cos(t[1] + t[2]))

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on.

        "Front" is the side of axis 1 the arm faces with the wrist centre before it; the elbow is "up" when it is
        above the line from the shoulder to the wrist centre; the wrist is the sign of θ5.
        """
        t = self.geometry.sign * q + self.geometry.offset
        side = -1.0 if self._x_of_wrist(t) < 0.0 else 1.0
        return 4 * int(side < 0.0) + 2 * int(side * math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant, −a2 f s3 (a1 + a2 c2 + f c23) s5: there are no others."""
        g = self.geometry
        t = (g.sign * q + g.offset).tolist()
        elbow, x, wrist = off_line(t[2]), self._x_of_wrist(t), off_line(t[4])
        if min(abs(elbow), abs(x), abs(wrist)) > within:
            return ()  # as almost everywhere
        straight, aligned = float(q[2] - g.sign[2] * elbow), float(q[4] - g.sign[4] * wrist)
        return those_within(
            within,
            Singularity(
                "elbow",
                elbow_at(t[2]),
                "wrist centre along the arm",
                abs(elbow),
                "rad",
                (JointValue(2, straight),),
            ),
            Singularity(
                "shoulder",
                "wrist centre on axis 1" if self._reaches_axis_1 else "wrist centre nearest to axis 1",
                "wrist centre sideways",
                abs(x),
                "m",
            ),
            Singularity(
                "wrist",
                "axes 4 and 6 in line",
                "tilt about the third axis",
                abs(wrist),
                "rad",
                (JointValue(4, aligned),),
            ),
        )
