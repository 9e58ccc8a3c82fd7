"""The kernels in lanes: all branches of targets that are not singular, see :mod:`kin.solvers.blocks`.

Rows of S are θ1 (front, back), θ3 (front, back), and of the four arms (front up, front down, back up, back down)
θ2, θ4, θ5, θ6. The other elbow is −θ3, the other wrist −θ5 and half a turn on in θ4 and θ6.
"""

from __future__ import annotations

from collections.abc import Callable

from kin.kernels.compile import inlined
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
from kin.solvers.wrist6.branches import Rotation, solve
from kin.solvers.wrist6.geometry import (
    A1,
    A2,
    BASE,
    BESIDE,
    COS_PHASE,
    COS_TWIST,
    OFFSET,
    SIGN,
    SIN_PHASE,
    SIN_TWIST,
    TOOL,
    F,
)
from kin.transforms import Array

FRONT, BEND, _UPPER, _ROLL, _TILT, _SPIN, _END = (OWN + i for i in (0, 2, 4, 8, 12, 16, 20))
PAIRS, ROWS = _END - OWN, _END + _END - OWN + 1
_CLOSE = 1e-4  # of the distance L: how far apart two shoulders are that the careful kernel computes
Twist = tuple[float, float, float, float]
Lengths = tuple[float, float, float, float]
Side = Callable[[Entries, float, float, Lengths, Twist, Array, int, int], bool]


@inlined
def shape_of(params: Array) -> tuple[float, float, float, float, Twist]:
    """a1, a2, f, L, and how axis 4 is turned against the line from axis 3 to W: see the layout of params."""
    p = params
    return p[A1], p[A2], p[F], p[BESIDE], (p[COS_PHASE], p[SIN_PHASE], p[COS_TWIST], p[SIN_TWIST])


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
    x: float, h: float, elbow: tuple[float, float, float, float, float], R: Rotation, twist: Twist, S: Array,
    arm: int, b: int,
) -> bool:  # fmt: skip
    """The pairs of θ2, θ4, θ5, θ6; whether axes 4 and 6 are in line.

    W is at (x, h) in the arm's plane. `elbow`: where W is seen from axis 2 with θ2 = 0, cosine and sine of θ3,
    1/D².
    """
    A, B, c3, s3, scale = elbow
    c2, s2 = (x * A + h * B) * scale, (h * A - x * B) * scale
    S[_UPPER + arm, b], S[PAIRS + _UPPER + arm, b] = s2, c2
    cp, sp, ca, sa = twist
    c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
    g, s = c23 * cp + s23 * sp, s23 * cp - c23 * sp
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = R
    # As `_seen` of the careful kernel.
    v0, v1, v2 = -s * x0 - g * z0, -s * x1 - g * z1, -s * x2 - g * z2
    m00, m01, m02 = g * x0 - s * z0, g * x1 - s * z1, g * x2 - s * z2
    m10, m11, m12, m22 = ca * v0 + sa * y0, ca * v1 + sa * y1, ca * v2 + sa * y2, ca * y2 - sa * v2
    sine = zyz_pairs(S, _ROLL + arm, 4, PAIRS, b, (m00, m01, m02), (m10, m11, m12), m22)
    return sine < NEARLY


@inlined
def _side(
    M: Entries, X: float, scale: float, lengths: Lengths, twist: Twist, S: Array, back: int, b: int
) -> bool:  # fmt: skip
    """All pairs of the shoulder with W at X, scale = 1/r²; whether one needs the careful kernel."""
    a1, a2, f, beside = lengths
    s1, c1, R = turned(M, X, beside, scale)
    x, h = X - a1, -M[11]
    c3, s3, inverse_D2, close0 = elbow_of(x * x + h * h, a2, f)
    s3 = -s3 if back else s3
    S[FRONT + back, b], S[PAIRS + FRONT + back, b] = s1, c1 + 0.0 * c3
    S[BEND + back, b], S[PAIRS + BEND + back, b] = s3, c3
    A, B = a2 + f * c3, f * s3
    close1 = arm_pairs(x, h, (A, B, c3, s3, inverse_D2), R, twist, S, 2 * back, b)
    close2 = arm_pairs(x, h, (A, -B, c3, -s3, inverse_D2), R, twist, S, 2 * back + 1, b)
    return close0 | close1 | close2


@inlined
def both_sides(side: Side, params: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets with W before axis 1 and behind it, each written by `side`.

    S[-1] ← 1.0 for the targets that need the careful kernel; returns their number.
    """
    base, tool = rows_of(params, BASE), rows_of(params, TOOL)
    a1, a2, f, beside, twist = shape_of(params)
    lengths = (a1, a2, f, beside)
    found = 0
    for b in range(count):
        M = canonical_of(base, tool, S, b)
        X, scale = shoulder_of(M[3], M[7], beside)
        margin = X - _CLOSE * abs(beside)
        close0 = side(M, X, scale, lengths, twist, S, 0, b)
        close1 = side(M, -X, scale, lengths, twist, S, 1, b)
        marked = (margin < NEARLY) | close0 | close1
        S[-1, b] = 1.0 if marked else 0.0
        found += 1 if marked else 0
    return found


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets, as `both_sides` writes them."""
    return both_sides(_side, params, count, S)


@inlined
def all_but_third(arc: Arc, params: Array, count: int, S: Array) -> None:
    """S ← the values of joints 1, 2, 4, 5, 6 for `count` targets, from the pairs."""
    single(arc, S, FRONT, BEND, PAIRS, count, params[SIGN], params[OFFSET])
    single(arc, S, _UPPER, _ROLL, PAIRS, count, params[SIGN + 1], params[OFFSET + 1])
    double(arc, S, _ROLL, _TILT, PAIRS, count, params[SIGN + 3], params[OFFSET + 3], True)
    double(arc, S, _TILT, _SPIN, PAIRS, count, params[SIGN + 4], params[OFFSET + 4], False)
    double(arc, S, _SPIN, _END, PAIRS, count, params[SIGN + 5], params[OFFSET + 5], True)


@inlined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    all_but_third(arc, params, count, S)
    double(arc, S, BEND, _UPPER, PAIRS, count, params[SIGN + 2], params[OFFSET + 2], False)


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


branches_one, branches_many, solve_one, solve_many = kernels_in_lanes(
    __name__, _pairs, _angles, store, solve, ROWS, PAIRS
)
