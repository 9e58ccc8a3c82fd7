"""The kernels in lanes: all branches of targets that are not singular, see :mod:`kin.solvers.blocks`.

Rows of S are of the shoulders (left, right) θ1, A, θ5 and θ6, of the four pairs of shoulder and wrist θ3, of the
eight branches θ2. The other elbow is −θ3, the other wrist −θ5 and half a turn on in θ6 and A; θ4 is what A leaves.
"""

from __future__ import annotations

from kin.kernels.compile import inlined
from kin.kernels.simd import wrapped
from kin.solvers.blocks import (
    NEARLY,
    OWN,
    Arc,
    Entries,
    canonical_of,
    double,
    elbow_of,
    kernels_in_lanes,
    rows_of,
    shoulder_of,
    single,
    zyz_pairs,
)
from kin.solvers.parallel6.branches import solve
from kin.solvers.parallel6.geometry import (
    A1,
    A2,
    A3,
    A4,
    BASE,
    BESIDE,
    COS_TWIST,
    D5,
    OFFSET,
    SIGN,
    SIN_TWIST,
    TOOL,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_SINGULAR = TOLERANCES.singular

_FRONT, _SUM, _TILT, _SPIN, _BEND, _UPPER, _END = (OWN + i for i in (0, 2, 4, 6, 8, 12, 20))
_PAIRS, _ROWS = _END - OWN, _END + _END - OWN + 1
_REST = _PAIRS + _UPPER  # θ4
_CLOSE = 1e-3  # of the lengths: how far apart two shoulders are that the careful kernel computes


@inlined
def _arm(
    px: float, py: float, links: tuple[float, float, float], S: Array, pair: int, branch: int, b: int
) -> bool:
    """The pairs of θ2 and θ3 with axis 4 at (px, py); whether they need the careful kernel.

    links: a2, a3 and the sign of θ3 with the elbow up.
    """
    a2, a3, side = links
    c3, s3, scale, close = elbow_of(px * px + py * py, a2, a3)
    s3 = side * s3
    S[_BEND + pair, b], S[_PAIRS + _BEND + pair, b] = s3, c3
    A, B = a2 + a3 * c3, a3 * s3
    S[_UPPER + branch, b], S[_PAIRS + _UPPER + branch, b] = (py * A - px * B) * scale, (px * A + py * B) * scale
    branch += 2
    S[_UPPER + branch, b], S[_PAIRS + _UPPER + branch, b] = (py * A + px * B) * scale, (px * A - py * B) * scale
    return close


@inlined
def _shoulder(
    M: Entries, at: tuple[float, float, float], side: float,
    lengths: tuple[float, float, float, float, float, float, float], S: Array, si: int, b: int,
) -> bool:  # fmt: skip
    """All pairs of the shoulder with W at (x, y) in the frame that turns with axis 1; at: x, y, 1/r²."""
    r00, r01, r02, wx, r10, r11, r12, wy, r20, r21, r22, wz = M
    x, y, scale = at
    a1, a2, a3, a4, d5, ca, sa = lengths
    c1, s1 = (wx * x + wy * y) * scale, (wy * x - wx * y) * scale
    v0, v1, v2 = c1 * r10 - s1 * r00, c1 * r11 - s1 * r01, c1 * r12 - s1 * r02
    m00, m01, m02 = c1 * r00 + s1 * r10, c1 * r01 + s1 * r11, c1 * r02 + s1 * r12
    m10, m11, m12, m22 = ca * v0 + sa * r20, ca * v1 + sa * r21, ca * v2 + sa * r22, ca * r22 - sa * v2
    S[_FRONT + si, b], S[_PAIRS + _FRONT + si, b] = s1, c1
    sine = zyz_pairs(S, _SUM + si, 2, _PAIRS, b, (m00, m01, m02), (m10, m11, m12), m22)
    inverse = 1.0 / sine
    cA, sA = m02 * inverse, m12 * inverse
    u, v, p, q = x - a1, ca * y + sa * wz, a4 * cA - d5 * sA, a4 * sA + d5 * cA
    links = (a2, a3, side)
    close0 = _arm(u - p, v - q, links, S, 2 * si, 4 * si, b)
    close1 = _arm(u + p, v + q, links, S, 2 * si + 1, 4 * si + 1, b)
    return close0 | close1 | (sine < NEARLY)


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those that need the careful kernel, and how many these are."""
    base, tool = rows_of(params, BASE), rows_of(params, TOOL)
    a4, d5, beside, ca, sa = params[A4], params[D5], params[BESIDE], params[COS_TWIST], params[SIN_TWIST]
    lengths = (params[A1], params[A2], params[A3], a4, d5, ca, sa)
    left = 1.0 if beside >= 0.0 else -1.0
    inverse_sa = 1.0 / sa
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        wx, wy, wz = M[3], M[7], M[11]
        y = (ca * wz - beside) * inverse_sa
        root, scale = shoulder_of(wx, wy, y)
        x = left * root
        close0 = _shoulder(M, (x, y, scale), left, lengths, S, 0, b)
        close1 = _shoulder(M, (-x, y, scale), -left, lengths, S, 1, b)
        marked = close0 | close1 | (root < _CLOSE * (abs(y) + abs(a4) + abs(d5)) + _SINGULAR)
        S[-1, b] = 1.0 if marked else 0.0
        found += 1 if marked else 0
    return found


@inlined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    single(arc, S, _FRONT, _SUM, _PAIRS, count, params[SIGN], params[OFFSET])
    double(arc, S, _TILT, _SPIN, _PAIRS, count, params[SIGN + 4], params[OFFSET + 4], False)
    double(arc, S, _SPIN, _BEND, _PAIRS, count, params[SIGN + 5], params[OFFSET + 5], True)
    # A as joint 4 would have it with joints 2 and 3 at 0.
    total = params[OFFSET + 1] + params[OFFSET + 2] + params[OFFSET + 3]
    double(arc, S, _SUM, _TILT, _PAIRS, count, params[SIGN + 3], total, True)
    double(arc, S, _BEND, _UPPER, _PAIRS, count, params[SIGN + 2], params[OFFSET + 2], False)
    single(arc, S, _UPPER, _END, _PAIRS, count, params[SIGN + 1], params[OFFSET + 1])
    sense2, sense3 = params[SIGN + 3] * params[SIGN + 1], params[SIGN + 3] * params[SIGN + 2]
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


branches_one, branches_many, solve_one, solve_many = kernels_in_lanes(
    __name__, _pairs, _angles, _store, solve, _ROWS, _PAIRS
)
