"""The Pioneer family asked for a point only: five joints, three demands, so θ4 and θ5 remain to be chosen.

Angles are canonical here, as in :mod:`kin.solvers.wrist5`. Seen from the elbow in frame 3 the tool point is
``(tx, −m, d4 + C) = (−d6 c4 s5, −d6 s4 s5, d4 + d6 c5)``: m is how far it stands off the plane of the arm. With
r = hypot(x, y), h = −z (from the shoulder's height) and L = hypot(tx, d4 + C), given θ4 and θ5:

- R = ±√(r² − m²), the tool in front of axis 1 or behind it; θ1 = atan2(y, x) − atan2(m, R);
- a planar arm with links a2 and L from (a1, 0) to (R, h): elbow angle ±w, θ3 = w + atan2(tx, d4 + C), then θ2.

So (θ4, θ5) and two signs name a configuration. **Every stop is a plane** in the coordinates (C, tx, R), and the
configurations are a hyperboloid in them, R² − tx² − C² = r² − d6². With K = r² + h² + a1² − a2² − d4² − d6²,
e = a1 + a2 c2, f = h − a2 s2:

- θ1: R = c1 x + s1 y (and m = c1 y − s1 x);
- θ2: 2 e R + 2 d4 C = r² + e² + f² − d4² − d6²;
- θ3: 2 a1 R + 2 a2 (tx s3 + (d4 + C) c3) + 2 d4 C = K;
- θ5: C = d6 c5.

Besides, there is the edge of reach: R = 0, and the arm stretched or folded, K − 2 d4 C − 2 a1 R = ±2 a2 L.

**θ5 for a given θ4.** Each plane, and the edge, is a polynomial of degree four at most in tan(θ5/2) or cos θ5.
Its real roots, the stops of θ5 and the places where a branch changes its name cut the circle into pieces on which
nothing changes: a test of each root and of each piece gives the intervals. Nothing is sampled.

**θ4 for which some θ5 exists.** This set is the shadow of a region bounded by the same curves. It ends where two
curves cross or where one runs upright, along θ5 (cylindrical algebraic decomposition, Collins 1975). Two planes
cross in a line, which meets the hyperboloid twice. A plane pC C + pT tx + pR R + p0 = 0 runs upright, that is
tx²/s5² is stationary along it, where R (pC d6² + p0 C) + pR r² C = 0: a quartic in C; the edge of reach does at
the roots of a polynomial of degree six. Where it meets a stop of θ1 or θ5 the range may end too, as these do not
see which way the elbow bends. Those points that are inside all limits cut θ4 into pieces, one test per piece.
Again nothing is sampled: real roots are bracketed by those of the derivative.

**The choice.** Of a branch's feasible configurations the one nearest to the seed is wanted. It is *searched*: from
the seed itself, and from the best feasible point met, by Newton steps on the nearest-point condition within the
limits. What it ends in is exact and feasible, and a local minimum of the distance.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.common import (
    TURN,
    add_roots,
    excess,
    nearest_image,
)
from kin.solvers.contract import Candidates, Obstacle, RedundancyParameter, SolverInput
from kin.tolerances import TOLERANCES
from kin.transforms import Array

if TYPE_CHECKING:
    from kin.solvers.wrist5 import Geometry

REDUNDANCIES = (RedundancyParameter("theta4", "θ4", joint=3), RedundancyParameter("theta5", "θ5", joint=4))
_REACH = TOLERANCES.closure_position * 0.1
_SLACK = TOLERANCES.limit
_SAME = 1e-11
_TIGHT = 1e-13
_HAIR = 1e-6
# Zero as a count. No literal: numba compiles a callee again for every literal it is called with.
_NONE = cast(int, np.int64(0))
_OVER = 1e6  # a radian beyond a stop weighs more than any distance to the seed
# Constants of a problem, and columns of its planes: the joint, the plane's four numbers, what m and s5 are if
# known.
A1, A2, D4, D6, X, Y, H, RAD, PHI, KAY = range(10)
JOINT, PC, PT, PR, P0, M, S = range(7)
_BITS = range(8)
Row = tuple[int, float, float]


# -- real roots ------------------------------------------------------------------------------------------------


@jit
def _root_between(p: Array, degree: int, a: float, b: float, fa: float) -> float:
    """The root of Σ p[i] xⁱ between a and b, where it changes sign: Newton kept inside the bracket."""
    x = 0.5 * (a + b)
    for _ in range(80):
        f, slope = p[degree], 0.0
        for i in range(degree - 1, -1, -1):
            slope = slope * x + f
            f = f * x + p[i]
        if f == 0.0:
            return x
        if (f < 0.0) == (fa < 0.0):
            a = x
        else:
            b = x
        nearer = x - f / slope if slope != 0.0 else math.inf
        if not a < nearer < b:
            nearer = 0.5 * (a + b)
        if abs(nearer - x) <= 1e-16 * abs(x) or nearer in (a, b):
            return nearer
        x = nearer
    return x


@jit
def _real_roots(p: Array, low: float, high: float, out: Array) -> int:
    """Real roots of Σ p[i] xⁱ in [low, high], rising; points where the graph all but touches zero count as roots.

    Between two roots of the derivative there is one root at most: so from degree one up, each derivative's roots
    bracket the next. `p` ``(degree + 1,)``, `out` ``(2·degree,)``.
    """
    degree = p.shape[0] - 1
    size = 0.0
    for i in range(degree + 1):
        size = max(size, abs(p[i]))
    if size == 0.0:
        return 0
    ladder = np.empty(16)
    marks = np.empty(16)
    n_marks = 0
    count = 0
    for d in range(1, degree + 1):
        lift = degree - d
        scale = 0.0
        for i in range(d + 1):
            factor = 1.0
            for j in range(lift):
                factor *= i + lift - j
            ladder[i] = p[i + lift] * factor / size
            scale += abs(ladder[i])
        count = 0
        left = low
        f_left = 0.0
        for i in range(d, -1, -1):
            f_left = f_left * left + ladder[i]
        for k in range(n_marks + 1):
            right = marks[k] if k < n_marks else high
            f_right = 0.0
            for i in range(d, -1, -1):
                f_right = f_right * right + ladder[i]
            if (f_left < 0.0) != (f_right < 0.0):
                out[count] = _root_between(ladder, d, left, right, f_left)
                count += 1
            if d == degree and k < n_marks:
                weight = max(1.0, abs(right)) ** d
                if abs(f_right) < 1e-10 * scale * weight:
                    out[count] = right
                    count += 1
            left, f_left = right, f_right
        if d < degree:
            n_marks = count
            for k in range(count):
                marks[k] = out[k]
    return count


@jit
def _quadratic(a: float, b: float, c: float, out: Array) -> int:
    """Real roots of a x² + b x + c; a double root missed by rounding only is kept."""
    inner = b * b - 4.0 * a * c
    scale = b * b + abs(4.0 * a * c)
    half = -0.5 * (b + math.copysign(math.sqrt(max(inner, 0.0)), b))
    if half == 0.0 or inner < -1e-12 * scale:
        return 0
    out[0] = c / half
    if abs(half) >= 1e9 * abs(a):
        return 1
    out[1] = half / a
    return 2


@jit
def _level_roots(
    g0: float, g1: float, g2: float, g3: float, r: float, lever: float, start: float, end: float, breaks: Array,
    count: int,
) -> int:  # fmt: skip
    """Append the θ in [start, end] with g0 + g1 cos θ + g2 sin θ ± g3 √(r² − (lever sin θ)²) = 0.

    Squared it is a quartic in tan((θ − θ0)/2), half a turn at a time. The equation before squaring then polishes
    the roots, also those that squaring has merged.
    """
    reach = abs(g3) * r
    size = max(abs(g0) + reach, math.hypot(g1, g2))
    if reach <= 1e-13 * size:
        return add_roots(g1, g2, g0, breaks, count)
    w = (g3 * lever) ** 2
    a0 = g0 * g0 + 0.5 * (g1 * g1 + g2 * g2) - reach * reach + 0.5 * w
    p, roots = np.empty(5), np.empty(8)
    pieces = math.ceil((end - start) / math.pi - 1e-9)
    for piece in range(pieces):
        width = (end - start) / pieces
        middle = start + (piece + 0.5) * width
        c, s = math.cos(middle), math.sin(middle)
        u, v = g1 * c + g2 * s, g2 * c - g1 * s
        a1, b1 = 2.0 * g0 * u, 2.0 * g0 * v
        c2, s2 = c * c - s * s, 2.0 * c * s
        a2 = 0.5 * (u * u - v * v - w * c2)
        b2 = u * v + 0.5 * w * s2
        p[0] = a0 + a1 + a2
        p[1] = 2.0 * b1 + 4.0 * b2
        p[2] = 2.0 * a0 - 6.0 * a2
        p[3] = 2.0 * b1 - 4.0 * b2
        p[4] = a0 - a1 + a2
        bound = math.tan(0.25 * width) * (1.0 + 1e-9)
        for k in range(_real_roots(p, -bound, bound, roots)):
            found = middle + 2.0 * math.atan(roots[k])
            level = g0 + g1 * math.cos(found) + g2 * math.sin(found)
            for side in (-1.0, 1.0):
                # Where the root's size vanishes, either sign may be meant.
                if level * side * g3 > 1e-5 * size * abs(g3):
                    continue
                t = found
                for _ in range(4):
                    c, s = math.cos(t), math.sin(t)
                    R = side * math.sqrt(max(r * r - (lever * s) ** 2, 0.0))
                    f = g0 + g1 * c + g2 * s + g3 * R
                    slope = g2 * c - g1 * s
                    if R != 0.0:
                        slope -= g3 * lever * lever * s * c / R
                    if abs(f) > 0.01 * abs(slope) or abs(f) < 1e-16 * abs(slope):
                        break
                    t -= f / slope
                breaks[count] = t
                count += 1
    return count


# -- one configuration -----------------------------------------------------------------------------------------


@jit
def _posture(
    k: Array, t4: float, t5: float, side: float, elbow: float, near: Array, low: Array, high: Array, q: Array
) -> float:
    """q ← the configuration with these signs; returns the metres by which it fails to close, 0.0 if it closes."""
    r, a2 = k[RAD], k[A2]
    c5, s5 = math.cos(t5), math.sin(t5)
    m = k[D6] * math.sin(t4) * s5
    tx, tz = -k[D6] * math.cos(t4) * s5, k[D4] + k[D6] * c5
    if abs(m) - r > _REACH:
        return float(abs(m) - r)
    R = side * math.sqrt(max((r - m) * (r + m), 0.0))
    L, D = math.hypot(tx, tz), math.hypot(R - k[A1], k[H])
    miss = max(D - (a2 + L), abs(a2 - L) - D)
    if miss > _REACH:
        return float(miss)
    far, nearby = (a2 + L - D) * (a2 + L + D), (D - a2 + L) * (D + a2 - L)
    w = elbow * 2.0 * math.atan2(math.sqrt(max(far, 0.0)), math.sqrt(max(nearby, 0.0)))
    # A point on axis 1 leaves θ1 free.
    q[0] = min(max(near[0], low[0]), high[0]) if r < _REACH else k[PHI] - math.atan2(m, R)
    q[1] = math.atan2(k[H], R - k[A1]) - math.atan2(L * math.sin(w), a2 + L * math.cos(w))
    q[2] = w + math.atan2(tx, tz)
    q[3] = t4
    q[4] = t5
    return 0.0


@jit
def _linearise(k: Array, q: Array, J: Array, e: Array) -> float:
    """e ← what is missing to the point, J ← ∂(R, h, m)/∂q, both in the arm's plane; returns |e|."""
    c1, s1, c4, s4 = math.cos(q[0]), math.sin(q[0]), math.cos(q[3]), math.sin(q[3])
    c5, s5, c23, s23 = math.cos(q[4]), math.sin(q[4]), math.cos(q[1] + q[2]), math.sin(q[1] + q[2])
    d6 = k[D6]
    tx, m, tz = -d6 * c4 * s5, d6 * s4 * s5, k[D4] + d6 * c5
    level, drop = tz * c23 + tx * s23, tz * s23 - tx * c23
    R = k[A1] + k[A2] * math.cos(q[1]) + level
    h = k[A2] * math.sin(q[1]) + drop
    e[0], e[1], e[2] = c1 * k[X] + s1 * k[Y] - R, k[H] - h, c1 * k[Y] - s1 * k[X] - m
    J[0, 0], J[1, 0], J[2, 0] = -m, 0.0, R
    J[0, 1], J[1, 1], J[2, 1] = -h, R - k[A1], 0.0
    J[0, 2], J[1, 2], J[2, 2] = -drop, level, 0.0
    J[0, 3], J[1, 3], J[2, 3] = m * s23, -m * c23, -tx
    x5, z5 = -d6 * c4 * c5, -d6 * s5
    J[0, 4], J[1, 4], J[2, 4] = z5 * c23 + x5 * s23, z5 * s23 - x5 * c23, d6 * s4 * c5
    return math.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2])


@jit
def _foot(q: Array, J: Array, e: Array, aim: Array, low: Array, high: Array, x: Array) -> None:
    """x ← the point of the box nearest to aim with J (x − q) = e, by Newton on the dual: x = clamp(aim + Jᵀ λ)."""
    u = v = w = 0.0
    for _ in range(12):
        # What J (x − q) lacks of e, and H = J Jᵀ over the joints that are not at the box.
        gu, gv, gw = e[0], e[1], e[2]
        uu = vv = ww = 1e-12
        uv = uw = vw = 0.0
        for i in range(5):
            a, b, c = J[0, i], J[1, i], J[2, i]
            free = aim[i] + a * u + b * v + c * w
            x[i] = min(max(free, low[i]), high[i])
            step = x[i] - q[i]
            gu -= a * step
            gv -= b * step
            gw -= c * step
            if x[i] == free:
                uu += a * a
                vv += b * b
                ww += c * c
                uv += a * b
                uw += a * c
                vw += b * c
        # The adjugate of H, row by row, over its determinant.
        au, av, aw = vv * ww - vw * vw, vw * uw - uv * ww, uv * vw - vv * uw
        det = uu * au + uv * av + uw * aw
        if abs(gu) + abs(gv) + abs(gw) < 1e-15 or not det > 0.0:
            break
        bv, bw, cw = uu * ww - uw * uw, uv * uw - uu * vw, uu * vv - uv * uv
        u += (au * gu + av * gv + aw * gw) / det
        v += (av * gu + bv * gv + bw * gw) / det
        w += (aw * gu + bw * gv + cw * gw) / det


@jit
def _closes(k: Array, low: Array, high: Array, J: Array, e: Array, x: Array, q: Array) -> bool:
    """Move q, in place, onto the point within [low, high] by least Newton steps; whether that succeeds."""
    for _ in range(8):
        if _linearise(k, q, J, e) < _TIGHT:
            return True
        _foot(q, J, e, q, low, high, x)
        for i in range(5):
            q[i] = x[i]
    return _linearise(k, q, J, e) < 1e-12


@jit
def _draw_near(k: Array, near: Array, low: Array, high: Array, q: Array) -> bool:
    """Move q, in place, along the point's configurations inside [low, high] to where it is nearest to a box.

    `near` ``(2, 5)``: the box's corners. Each step goes to the foot of the aim on the tangent space, or as much of
    the way as brings it nearer. Returns whether q closes; it may not, if it did not at first.
    """
    J, e, x, y, aim, foot = np.empty((3, 5)), np.empty(3), np.empty(5), np.empty(5), np.empty(5), np.empty(5)
    if not _closes(k, low, high, J, e, x, q):
        return False
    distance = math.inf
    share = 1.0
    for _ in range(60):
        _linearise(k, q, J, e)
        now = 0.0
        for i in range(5):
            aim[i] = min(max(q[i], near[0, i]), near[1, i])
            now += (q[i] - aim[i]) ** 2
        if now > distance * (1.0 - 1e-7) or share < 1e-3:
            break
        distance = now
        _foot(q, J, e, aim, low, high, foot)
        share = min(1.0, 4.0 * share)
        while share >= 1e-3:
            after = 0.0
            for i in range(5):
                y[i] = q[i] + share * (foot[i] - q[i])
            closed = _closes(k, low, high, J, e, x, y)
            for i in range(5):
                after += (y[i] - min(max(y[i], near[0, i]), near[1, i])) ** 2
            if closed and after < now:
                for i in range(5):
                    q[i] = y[i]
                break
            share *= 0.25
            _linearise(k, q, J, e)
    return True


@jit
def _fits(
    k: Array, t4: float, t5: float, side: float, elbow: float, near: Array, low: Array, high: Array, q: Array
) -> bool:
    """q ← the configuration with these signs; whether it exists and is inside all limits.

    With the arm stretched or R = 0, a rounding error of 1e-16 in the point is 1e-8 in angles, but not the reverse:
    what is a hair outside its limits is moved to the nearest configuration inside, if there is one.
    """
    if excess(t5, low[4], high[4]) > 0.0 or excess(t4, low[3], high[3]) > 0.0:
        return False
    if _posture(k, t4, t5, side, elbow, near, low, high, q) > 0.0:
        return False
    over = 0.0
    for i in range(3):
        if high[i] - low[i] < TURN:
            over += excess(q[i], low[i], high[i])
    if 0.0 < over < _HAIR:
        floor, ceiling, J, e, spare = np.empty(5), np.empty(5), np.empty((3, 5)), np.empty(3), np.empty(5)
        for i in range(5):
            x = nearest_image(q[i], q[i], low[i], high[i])
            slack = _HAIR if i < 3 else _SLACK
            floor[i], ceiling[i] = max(low[i], x - slack), min(high[i], x + slack)
            q[i] = min(max(x, floor[i]), ceiling[i])
        return _closes(k, floor, ceiling, J, e, spare, q)
    return over == 0.0


@jit
def _branch(k: Array, q: Array) -> int:
    """`Wrist5.branch_of` for canonical angles; 8 is added where a sign is a matter of rounding."""
    radial = k[A1] + k[A2] * math.cos(q[1]) + k[D4] * math.cos(q[1] + q[2])
    bend, flip = math.sin(q[2]), math.sin(q[4])
    branch = 0
    if radial < 0.0:
        branch += 4
    if bend < 0.0:
        branch += 2
    if flip < 0.0:
        branch += 1
    if min(abs(radial), abs(bend), abs(flip)) < _HAIR:
        branch += 8
    return branch


@jit
def _offer(k: Array, q: Array, near: Array, box: Array, best: Array) -> None:
    """Keep q, at its images nearest to the seed, if it is the best of its branch.

    `best` ``(8, 6)``: five angles and the cost; first counts how far beyond the limits `box` ``(2, 5)`` it is,
    then the distance.
    """
    row = _branch(k, q) % 8
    cost = 0.0
    for i in range(5):
        x = nearest_image(q[i], near[i], box[0, i], box[1, i])
        cost += (x - near[i]) ** 2 + _OVER * excess(x, box[0, i], box[1, i])
    if not cost >= best[row, 5]:
        for i in range(5):
            best[row, i] = nearest_image(q[i], near[i], box[0, i], box[1, i])
        best[row, 5] = cost


# -- planes ----------------------------------------------------------------------------------------------------


@jit
def _add_plane(
    planes: Array, count: int, joint: float, pc: float, pt: float, pr: float, p0: float, m: float, s: float
) -> int:
    """Append a plane, scaled to a normal of length one, unless it has none."""
    norm = math.sqrt(pc * pc + pt * pt + pr * pr)
    if norm > 1e-12:
        row = planes[count]
        row[JOINT], row[M], row[S] = joint, m, s
        row[PC], row[PT] = pc / norm, pt / norm
        row[PR], row[P0] = pr / norm, p0 / norm
        count += 1
    return count


@jit
def _planes(k: Array, low: Array, high: Array, planes: Array) -> int:
    """planes ``(16, 7)`` ← the stops that can bind, and θ3 where a branch changes its name; returns their number.

    It does where the elbow is straight, and where the wrist centre is on axis 1, at two heights at most. R = 0,
    with m = ±r, joins them as joint −1.
    """
    a1, a2, d4, d6 = k[A1], k[A2], k[D4], k[D6]
    count = _add_plane(planes, _NONE, -1.0, 0.0, 0.0, 1.0, 0.0, k[RAD], 0.0)
    count = _add_plane(planes, count, -1.0, 0.0, 0.0, 1.0, 0.0, -k[RAD], 0.0)
    rise = math.sqrt(max((d6 - k[RAD]) * (d6 + k[RAD]), 0.0))
    for i in range(14):
        joint = i // 2 if i < 6 else (4 if i < 8 else 2)
        t = low[joint] if i % 2 == 0 else high[joint]
        if i < 8:
            if high[joint] - low[joint] >= TURN or (i % 2 == 1 and high[joint] == low[joint]):
                continue
        elif i < 10:
            t = 0.0 if i == 8 else math.pi
        else:
            h = k[H] + (rise if i < 12 else -rise)
            c = (a1 * a1 + h * h - a2 * a2 - d4 * d4) / (2.0 * a2 * d4)
            if abs(c) > 1.0 or k[RAD] > abs(d6):
                continue
            t = math.acos(c) if i % 2 == 0 else -math.acos(c)
        if i >= 8 and high[2] - low[2] < TURN and excess(t, low[2] + 2e-9, high[2] - 2e-9) > 0.0:
            continue
        c, s = math.cos(t), math.sin(t)
        if joint == 0:
            count = _add_plane(planes, count, 0.0, 0.0, 0.0, 1.0, -c * k[X] - s * k[Y], c * k[Y] - s * k[X], 0.0)
        elif joint == 1:
            e, f = a1 + a2 * c, k[H] - a2 * s
            p0 = d4 * d4 + d6 * d6 - k[RAD] * k[RAD] - e * e - f * f
            count = _add_plane(planes, count, 1.0, 2.0 * d4, 0.0, 2.0 * e, p0, 0.0, 0.0)
        elif joint == 2:
            p0 = 2.0 * a2 * d4 * c - k[KAY]
            count = _add_plane(planes, count, 2.0, 2.0 * d4 + 2.0 * a2 * c, 2.0 * a2 * s, 2.0 * a1, p0, 0.0, 0.0)
        else:
            count = _add_plane(planes, count, 4.0, 1.0, 0.0, 0.0, -d6 * c, 0.0, s)
    return count


# -- θ5 for a given θ4 -----------------------------------------------------------------------------------------


@jit
def _stretched(k: Array, lever: float, breaks: Array, count: int) -> int:
    """Append the θ5 where the arm is stretched or folded flat; lever = d6 sin θ4.

    K − g c − 2 a1 R = ±2 a2 L with R² = r² − w s² and L² = d4² + d6² + g c − w s², squared twice: with
    A = K − g c and U = A² + 4 a1² R² − 4 a2² L² the first square is U = 4 a1 A R.
    """
    a1, a2, K, r2 = k[A1], k[A2], k[KAY], k[RAD] * k[RAD]
    g, w = 2.0 * k[D4] * k[D6], lever * lever
    rest, l0 = r2 - w, k[D4] * k[D4] + k[D6] * k[D6] - w
    u0 = K * K + 4.0 * a1 * a1 * rest - 4.0 * a2 * a2 * l0
    u1 = -2.0 * (K + 2.0 * a2 * a2) * g
    u2 = g * g + 4.0 * (a1 * a1 - a2 * a2) * w
    p, roots = np.zeros(5), np.empty(8)
    v = 16.0 * a1 * a1
    if v * r2 > 1e-26:
        p[0] = u0 * u0 - v * K * K * rest
        p[1] = 2.0 * u0 * u1 + v * 2.0 * K * g * rest
        p[2] = u1 * u1 + 2.0 * u0 * u2 - v * (g * g * rest + K * K * w)
        p[3] = 2.0 * u1 * u2 + v * 2.0 * K * g * w
        p[4] = u2 * u2 - v * g * g * w
    else:
        p[0] = u0
        p[1] = u1
        p[2] = u2
    for i in range(_real_roots(p, -1.0, 1.0, roots)):
        c = roots[i]
        U = u0 + roots[i] * (u1 + roots[i] * u2)
        for side in (-2.0 * a1, 2.0 * a1):
            # Where U all but vanishes, either sign of R may be meant.
            if U * (K - g * roots[i]) * side < -1e-5 * abs(u0 * K * side):
                continue
            c, fold = roots[i], 0.0
            for _ in range(4):
                # The equation before squaring polishes the root.
                R = math.sqrt(max(rest + w * c * c, 0.0))
                L = math.sqrt(max(l0 + c * (g + w * c), 0.0))
                f = K - g * c - side * R
                if fold == 0.0:
                    fold = math.copysign(2.0 * a2, f)
                f -= fold * L
                slope = -g - side * w * c / R - 0.5 * fold * (g + 2.0 * w * c) / L
                if not 1e-16 * abs(slope) < abs(f) < 0.01 * abs(slope):
                    break
                c -= f / slope
            breaks[count] = math.acos(min(max(c, -1.0), 1.0))
            breaks[count + 1] = -breaks[count]
            count += 2
    return count


@jit
def _tilt_breaks(
    k: Array, t4: float, planes: Array, n_planes: int, start: float, end: float, breaks: Array
) -> int:
    """Every θ5 in [start, end] where, at this θ4, a stop is met, the arm stops closing or a branch changes."""
    d6, r = k[D6], k[RAD]
    lever, forward = d6 * math.sin(t4), d6 * math.cos(t4)
    breaks[0], breaks[1] = 0.0, math.pi
    count = _NONE + 2
    for i in range(n_planes):
        joint, m = planes[i, JOINT], planes[i, M]
        if joint == 1.0 or joint == 2.0:
            g1, g2, g3 = planes[i, PC] * d6, -planes[i, PT] * forward, planes[i, PR]
            count = _level_roots(planes[i, P0], g1, g2, g3, r, lever, start, end, breaks, count)
        elif joint <= 0.0 and lever != 0.0 and abs(m) <= abs(lever) * (1.0 + 1e-12):
            t = math.asin(min(max(m / lever, -1.0), 1.0))
            breaks[count], breaks[count + 1] = t, math.pi - t
            count += 2
    return _stretched(k, lever, breaks, count)


@jit
def _window(low: float, high: float) -> tuple[float, float]:
    """One turn at most of a joint's range: from its lower stop, from −π where it has none."""
    if not math.isfinite(low):
        low = -math.pi if not math.isfinite(high) else high - TURN
    return low, min(high, low + TURN)


@jit
def _into_window(breaks: Array, count: int, low: float, high: float) -> int:
    """Keep the breaks that have an image in [low, high], as that image, the ends added, in rising order."""
    kept = 0
    for i in range(count):
        x = nearest_image(breaks[i], 0.5 * (low + high), low, high)
        if low <= x <= high:
            breaks[kept] = x
            kept += 1
    breaks[kept], breaks[kept + 1] = low, high
    kept += 2
    for i in range(1, kept):
        moving = breaks[i]
        j = i - 1
        while j >= 0 and breaks[j] > moving:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = moving
    return kept


@jit
def _add_piece(rows: Array, found: int, branch: int, low: float, high: float, sheet: int) -> int:
    """Append (branch, low, high, sheet), or lengthen the last row if that goes on here; returns the number."""
    last = found - 1
    if found > 0 and rows[last, 0] == branch and rows[last, 2] == low and rows[last, 3] == sheet:
        rows[last, 2] = high
    elif found < rows.shape[0]:
        rows[found, 0], rows[found, 1] = branch, low
        rows[found, 2], rows[found, 3] = high, sheet
        found += 1
    return found


@jit
def _tilt_arcs(
    k: Array, t4: float, planes: Array, n_planes: int, near: Array, low: Array, high: Array, breaks: Array,
    q: Array, rows: Array,
) -> int:  # fmt: skip
    """rows ← (branch, low, high, sheet) of every θ5 that is feasible with this θ4; returns their number.

    A sheet is a choice of the two signs of the module docstring: 2 · (behind) + (elbow angle negative). `breaks`
    ``(256,)`` and `q` are scratch.
    """
    found = _NONE
    start, end = _window(low[4], high[4])
    count = _into_window(breaks, _tilt_breaks(k, t4, planes, n_planes, start, end, breaks), start, end)
    for sheet in range(4):
        side, elbow = 1.0 - 2.0 * (sheet // 2), 1.0 - 2.0 * (sheet % 2)
        inside = False
        alone = _NONE - 1
        last = math.nan
        for i in range(count):
            t5 = breaks[i]
            if inside and t5 - last < _TIGHT:
                continue
            fits = _fits(k, t4, t5, side, elbow, near, low, high, q)
            here = _branch(k, q) % 8 if fits else -1
            joined = fits and inside and _fits(k, t4, 0.5 * (last + t5), side, elbow, near, low, high, q)
            # A feasible point between two pieces that are not stands alone.
            if joined:
                found = _add_piece(rows, found, _branch(k, q) % 8, last, t5, sheet)
            elif alone >= 0:
                found = _add_piece(rows, found, alone, last, last, sheet)
            alone = -1 if joined else here
            inside, last = fits, t5
        if alone >= 0:
            found = _add_piece(rows, found, alone, last, last, sheet)
    return found


# -- θ4 --------------------------------------------------------------------------------------------------------


@jit
def _add_tool(
    k: Array, C: float, tx: float, R: float, m: float, s: float, low: Array, high: Array, spots: Array, count: int
) -> int:
    """Append (θ4, θ5, R) at a point of the hyperboloid unless a limit forbids it.

    m and the sign s of s5 are 0.0 if unknown: then either is.
    """
    d6, m2 = k[D6], (k[RAD] - R) * (k[RAD] + R)
    if m2 < -1e-10 or abs(C) > abs(d6) * (1.0 + 1e-9):
        return count
    off = abs(m) if m != 0.0 else math.sqrt(max(m2, 0.0))
    tilt = math.atan2(math.hypot(tx, off), C * math.copysign(1.0, d6))
    for i in range(4):
        a, b = 1.0 - 2.0 * (i // 2), 1.0 - 2.0 * (i % 2)
        if min(a * m, b * s) >= 0.0:
            t4, t5 = math.atan2(a * b * off / d6, -b * tx / d6), b * tilt
            if excess(t5, low[4], high[4]) + excess(t4, low[3], high[3]) == 0.0 and count < spots.shape[0]:
                spots[count, 0], spots[count, 1], spots[count, 2] = t4, t5, R
                count += 1
    return count


@jit
def _cross(
    k: Array, planes: Array, i: int, j: int, low: Array, high: Array, roots: Array, spots: Array, count: int
) -> int:
    """Append where two of the planes meet the hyperboloid: on the line along d = n × n'."""
    n1, n2, n3, n0 = planes[i, PC], planes[i, PT], planes[i, PR], planes[i, P0]
    o1, o2, o3, o0 = planes[j, PC], planes[j, PT], planes[j, PR], planes[j, P0]
    d1, d2, d3 = n2 * o3 - n3 * o2, n3 * o1 - n1 * o3, n1 * o2 - n2 * o1
    size = d1 * d1 + d2 * d2 + d3 * d3
    if size < 1e-20:
        return count
    # Its point nearest to the origin is w × d / |d|² with w = n0' n − n0 n'.
    w1, w2, w3 = (o0 * n1 - n0 * o1) / size, (o0 * n2 - n0 * o2) / size, (o0 * n3 - n0 * o3) / size
    x1, x2, x3 = w2 * d3 - w3 * d2, w3 * d1 - w1 * d3, w1 * d2 - w2 * d1
    level = (k[RAD] - k[D6]) * (k[RAD] + k[D6])
    n = _quadratic(
        d3 * d3 - d2 * d2 - d1 * d1,
        2.0 * (x3 * d3 - x2 * d2 - x1 * d1),
        x3 * x3 - x2 * x2 - x1 * x1 - level,
        roots,
    )
    m, s = planes[i, M] + planes[j, M], planes[i, S] + planes[j, S]
    for root in range(n):
        t = roots[root]
        count = _add_tool(k, x1 + t * d1, x2 + t * d2, x3 + t * d3, m, s, low, high, spots, count)
    return count


@jit
def _uprights(k: Array, planes: Array, i: int, roots: Array) -> int:
    """roots ← every cos θ5 = c where the curve of a plane runs upright; returns their number.

    R v + pR r² c = 0 with v = pC d6 + p0 c; then pT tx = −u/v with u = (p0 + pC d6 c) v − pR² r² c.
    """
    d6, r2 = k[D6], k[RAD] * k[RAD]
    b, pt2, p0 = planes[i, PC] * d6, planes[i, PT] ** 2, planes[i, P0]
    pr2 = planes[i, PR] ** 2 * r2
    u, v, p = np.empty(3), np.empty(3), np.zeros(5)
    u[0] = u[2] = p0 * b
    u[1] = p0 * p0 + b * b - pr2
    if pt2 < 1e-14 or pr2 < 1e-26:
        return _quadratic(u[2], u[1], u[0], roots)
    v[0] = b * b
    v[1] = 2.0 * b * p0
    v[2] = p0 * p0
    for j in range(3):
        for n in range(3):
            p[j + n] += u[j] * u[n]
        p[j] += pt2 * (r2 - d6 * d6) * v[j]
        p[j + 2] += pt2 * d6 * d6 * v[j]
    p[2] -= pt2 * pr2 * r2
    return _real_roots(p, -1.0, 1.0, roots)


@jit
def _add_edge(
    k: Array, C: float, R: float, m: float, s: float, low: Array, high: Array, spots: Array, count: int
) -> int:
    """`_add_tool` with tx from the hyperboloid, either sign."""
    tx2 = R * R - C * C - (k[RAD] - k[D6]) * (k[RAD] + k[D6])
    if tx2 > -1e-10:
        tx = math.sqrt(max(tx2, 0.0))
        for sign in (-1.0, 1.0):
            count = _add_tool(k, C, sign * tx, R, m, s, low, high, spots, count)
    return count


@jit
def _reach_spots(
    k: Array, planes: Array, n_planes: int, low: Array, high: Array, roots: Array, spots: Array, count: int
) -> int:
    """Append where the stretched or folded arm meets stops of θ1 and θ5, and where this edge runs upright.

    (K − 2 d4 C − 2 a1 R)² = 4 a2² L² with L² = d4² + d6² − r² + R² + 2 d4 C is quadratic in R and in C. Stops of
    θ2 and θ3 touch the edge and go on: the two ways to bend the elbow meet there.

    For the rest, D = ±a2 ± L is the distance from the shoulder to the tool point in the arm's plane. u = D − (R −
    a1) or, where that is the smaller one, u = D + (R − a1), makes D = (u + h²/u)/2, R and C rational; (r² −
    R²)/s5² is stationary at the roots of a polynomial of degree six.
    """
    a1, a2, d4, d6 = k[A1], k[A2], k[D4], k[D6]
    r2, h2 = k[RAD] * k[RAD], k[H] * k[H]
    edge, far = abs(k[H]) * (1.0 - 1e-9), 2.0 * (a2 + d4 + abs(d6))
    R, C, top, bottom, p = np.empty(3), np.empty(3), np.empty(5), np.empty(5), np.empty(7)
    for i in range(n_planes):
        if planes[i, JOINT] != 0.0 and planes[i, JOINT] != 4.0:
            continue
        fixed = -planes[i, P0]
        if planes[i, JOINT] == 0.0:
            Q, L2 = k[KAY] - 2.0 * a1 * fixed, d4 * d4 + d6 * d6 - r2 + fixed * fixed
            f = 2.0 * d4
            n = _quadratic(f * f, -2.0 * f * Q - 4.0 * a2 * a2 * f, Q * Q - 4.0 * a2 * a2 * L2, roots)
        else:
            Q, L2 = k[KAY] - 2.0 * d4 * fixed, d4 * d4 + d6 * d6 - r2 + 2.0 * d4 * fixed
            f = 2.0 * a1
            n = _quadratic(f * f - 4.0 * a2 * a2, -2.0 * f * Q, Q * Q - 4.0 * a2 * a2 * L2, roots)
        for j in range(n):
            x, z = (roots[j], fixed) if planes[i, JOINT] == 0.0 else (fixed, roots[j])
            count = _add_edge(k, x, z, planes[i, M], planes[i, S], low, high, spots, count)
    for half in range(4):
        side = 1.0 - 2.0 * (half // 2)
        # u R, u C, then u² (r² − R²) and u² (d6² − C²).
        for i in range(3):
            D = 0.5 * (1.0 if i == 2 else h2)
            R[i] = D * side * (1.0 - i)
            C[i] = -(a1 * R[i] + a2 * D) / d4
        R[1], C[1] = a1, (0.5 * k[KAY] + a2 * a2 - a1 * a1) / d4
        for i in range(5):
            top[i] = bottom[i] = 0.0
        top[2], bottom[2] = r2, d6 * d6
        for i in range(9):
            top[i // 3 + i % 3] -= R[i // 3] * R[i % 3]
            bottom[i // 3 + i % 3] -= C[i // 3] * C[i % 3]
        for i in range(7):
            p[i] = 0.0
        for i in range(25):
            power = i // 5 + i % 5 - 1
            if 0 <= power < 7:
                p[power] += (i // 5 - i % 5) * top[i // 5] * bottom[i % 5]
        start = edge if half % 2 == 0 else -far
        for i in range(_real_roots(p, start, start + far - edge, roots)):
            u = roots[i]
            if u != 0.0:
                x, z = C[0] / u + C[1] + C[2] * u, R[0] / u + R[1] + R[2] * u
                count = _add_edge(k, x, z, 0.0, 0.0, low, high, spots, count)
    return count


@jit
def _find_spots(k: Array, planes: Array, n_planes: int, low: Array, high: Array, spots: Array) -> int:
    """spots ← (θ4, θ5, R) where the shadow on θ4 of the feasible set may end; returns their number."""
    roots, levels = np.empty(12), np.empty(8)
    count = _NONE
    for i in range(n_planes):
        joint = planes[i, JOINT]
        n = _uprights(k, planes, i, levels) if joint < 4.0 else 0
        for j in range(n + i):
            other = n_planes if j < n else j - n
            if j < n:
                for column in range(7):
                    planes[other, column] = 0.0
                planes[other, PC], planes[other, P0] = 1.0, -k[D6] * levels[j]
            elif planes[other, JOINT] == joint or (planes[other, JOINT] < 0.0 and abs(planes[i, PR]) > 1e-9):
                continue
            count = _cross(k, planes, i, other, low, high, roots, spots, count)
    return _reach_spots(k, planes, n_planes, low, high, roots, spots, count)


@jit
def _gather(
    k: Array, spots: Array, n_spots: int, near: Array, low: Array, high: Array, box: Array, best: Array,
    ends: Array,
) -> int:  # fmt: skip
    """ends ← (θ4, branch) of the spots that are feasible, with the elbow either way; returns their number.

    best ``(8, 6)`` ← per branch the one nearest to the seed, and its cost.
    """
    q = np.empty(5)
    start, stop = _window(low[3], high[3])
    count = 0
    for i in range(2 * n_spots):
        elbow, j = 1.0 - 2.0 * (i % 2), i // 2
        side = 1.0 if spots[j, 2] >= 0.0 else -1.0
        if count < ends.shape[0] and _fits(k, spots[j, 0], spots[j, 1], side, elbow, near, low, high, q):
            _offer(k, q, near, box, best)
            ends[count, 0] = min(max(nearest_image(q[3], 0.5 * (start + stop), start, stop), start), stop)
            ends[count, 1] = _branch(k, q)
            count += 1
    return count


@jit
def _probe(
    k: Array, turns: Array, planes: Array, n_planes: int, near: Array, low: Array, high: Array, box: Array,
    seen: Array, best: Array,
) -> None:  # fmt: skip
    """seen ← per θ4 in turns, the branches on which some θ5 is feasible, one bit each; best as in `_gather`."""
    breaks, q, rows = np.empty(256), np.empty(5), np.empty((128, 4))
    for i in range(turns.shape[0]):
        mask = 0
        for j in range(_tilt_arcs(k, turns[i], planes, n_planes, near, low, high, breaks, q, rows)):
            mask |= 1 << int(rows[j, 0])
            side, elbow = 1.0 - rows[j, 3] // 2.0 * 2.0, 1.0 - rows[j, 3] % 2.0 * 2.0
            # Of each interval the point nearest to the seed, a hair inside, and the middle.
            middle, half = 0.5 * (rows[j, 1] + rows[j, 2]), 0.5 * (rows[j, 2] - rows[j, 1])
            half -= min(half, 1e-7)
            for t5 in (middle, min(max(near[4], middle - half), middle + half)):
                if _fits(k, turns[i], t5, side, elbow, near, low, high, q):
                    _offer(k, q, near, box, best)
        seen[i] = mask


# -- the choice ------------------------------------------------------------------------------------------------


@jit
def _settle(
    k: Array, best: Array, near: Array, low: Array, high: Array, box: Array, relaxed: float, answer: Array
) -> None:
    """Draw what was found, and the seed, towards the seed within [low, high]; offer all to answer ``(8, 6)``.

    With relaxed = 1.0, [low, high] are wider than the limits in `box` ``(2, 5)``, and it is drawn towards these.
    """
    q, floor, ceiling, aims = np.empty(5), np.empty(5), np.empty(5), np.empty((2, 5))
    for i in range(5):
        for j in range(2):
            aims[j, i] = box[j, i] if relaxed > 0.0 else near[i]
    for row in range(9):
        if row < 8 and math.isnan(best[row, 5]):
            continue
        for i in range(5):
            q[i] = best[row, i] if row < 8 else near[i]
        if row < 8:
            _offer(k, q, near, box, answer)
        for i in range(5):
            q[i] = min(max(q[i], low[i]), high[i])
            floor[i], ceiling[i] = low[i], high[i]
            if row < 8 and (i == 2 or i == 4):
                # The sines of θ3 and θ5 name the branch.
                turn = math.floor(q[i] / math.pi)
                floor[i], ceiling[i] = max(low[i], turn * math.pi), min(high[i], (turn + 1.0) * math.pi)
        if _draw_near(k, aims, floor, ceiling, q):
            _offer(k, q, near, box, answer)


def solve(geometry: Geometry, problem: SolverInput) -> Candidates:
    """Per branch, the configuration that brings the tool point to the target's and is nearest to the seed.

    `problem.values` are θ4 and θ5 as joint values, kept exactly where they are numbers. Where nothing fits the
    limits, the rows hold what breaks them least of what was found. Where the point is out of reach they are NaN
    and `gap` tells by how far; if only the given values forbid it, `gap` is 0.

    Returns:
        Candidates: `values` ``(8, 2)``: θ4, θ5 used; `arcs[0]`: every θ4 inside the limits for which some θ5 (or
        the given one) is feasible; `arcs[1]`: every θ5 inside the limits that is, with the θ4 used. Radians.
    """
    g = geometry
    out, none = np.full((8, 5), math.nan), np.empty((0, 3))
    k = _constants(g, problem.T)
    gap = _gap(k)
    if gap > _REACH:
        return Candidates(out, out[:, 3:], (none, none), gap, Obstacle("point"))
    near = problem.seed + g.offset
    limits = np.array([problem.lower, problem.upper]) + g.offset
    if not problem.respect_limits:
        limits[0], limits[1] = -math.inf, math.inf
    held = {j: float(problem.values[j - 3] + g.offset[j]) for j in (3, 4) if not math.isnan(problem.values[j - 3])}
    box = limits.copy()
    for j, value in held.items():
        box[:, j] = value
    answer = np.full((8, 6), math.nan)
    turns = _explore(k, near, box, box, answer)
    if 3 in held:
        free = box.copy()
        free[:, 3] = limits[:, 3]
        turns = _explore(k, near, free, free, np.full((8, 6), math.nan))
    if 4 in held and excess(held[4], limits[0, 4], limits[1, 4]) > 0.0:
        turns = []
    if not _found(answer):
        # Nothing fits: free one joint after the other, then all, for what breaks the limits least.
        for joints in ((0,), (1,), (2,), (3,), (4,), (0, 1, 2, 3, 4)):
            free = box.copy()
            for j in set(joints) - set(held):
                free[:, j] = -math.inf, math.inf
            if len(joints) == 1 or not _found(answer):
                _explore(k, near, free, box, answer)
    breaks, q, pieces, planes = np.empty(256), np.empty(5), np.empty((128, 4)), np.empty((17, 7))
    n_planes = _planes(k, limits[0], limits[1], planes)
    tilts: list[Row] = []
    for branch in _found(answer):
        out[branch] = answer[branch, :5] - g.offset
        for j in held:
            out[branch, j] = problem.values[j - 3]
        t4 = answer[branch, 3]
        n = _tilt_arcs(k, t4, planes, n_planes, near, limits[0], limits[1], breaks, q, pieces)
        mine = [(branch, low, high) for name, low, high, _ in pieces[:n].tolist() if name == branch]
        if not mine and all(excess(answer[branch, i], limits[0, i], limits[1, i]) == 0.0 for i in range(5)):
            # At the very end of θ4's interval a single θ5 is left, which rounding may hide.
            start, stop = _window(limits[0, 4], limits[1, 4])
            t5 = float(nearest_image(answer[branch, 4], 0.5 * (start + stop), start, stop))
            mine = [(branch, t5, t5)]
        tilts += _union(mine)
    arcs = _as_joint(turns, limits[:, 3], g.offset[3]), _as_joint(tilts, limits[:, 4], g.offset[4])
    obstacle = Obstacle("given joint values") if np.isnan(out).all() else None
    return Candidates(out, out[:, 3:], arcs, 0.0, obstacle)


def _found(answer: Array) -> list[int]:
    """The branches that have a row in answer."""
    return [branch for branch, cost in enumerate(answer[:, 5].tolist()) if not math.isnan(cost)]


def _constants(g: Geometry, T: Array) -> Array:
    """The numbers of the module docstring ``(10,)``."""
    x, y, z = (g.inverse_base[:3, :3] @ T[:3, 3] + g.inverse_base[:3, 3]).tolist()
    square = x * x + y * y + z * z + g.a1**2 - g.a2**2 - g.d4**2 - g.d6**2
    return np.array([g.a1, g.a2, g.d4, g.d6, x, y, -z, math.hypot(x, y), math.atan2(y, x), square])


def _gap(k: Array) -> float:
    """Metres by which the point is out of reach, the limits ignored; not positive if it is within.

    The wrist centre reaches the annulus |a2 − d4| … a2 + d4 about (a1, 0) of any plane through axis 1, and the
    tool every direction from it: the point must be d6 from the annulus' nearest point at most, and from its
    farthest at least.
    """
    a1, a2, d4, d6, _, _, h, r, _, _ = k.tolist()
    outer, inner = a2 + d4, abs(a2 - d4)
    shorter, longer = math.hypot(r - abs(a1), h), math.hypot(r + abs(a1), h)
    nearest = max(0.0, min(max(shorter - outer, inner - shorter), max(longer - outer, inner - longer)))
    return float(max(nearest - abs(d6), abs(d6) - (longer + outer)))


def _explore(k: Array, near: Array, limits: Array, box: Array, answer: Array) -> list[Row]:
    """Offer to answer what `limits` ``(2, 5)`` allow, drawn towards the seed, or towards `box` if that is another.

    Returns every feasible θ4, rows (branch, low, high).
    """
    low, high = limits
    planes, best, seen = np.empty((17, 7)), np.full((8, 6), math.nan), np.empty(512)
    spots, found = np.empty((2048, 3)), np.empty((256, 2))
    n_planes = _planes(k, low, high, planes)
    n = _find_spots(k, planes, n_planes, low, high, spots)
    n = _gather(k, spots, n, near, low, high, box, best, found)
    ends = [(t4, int(branch)) for t4, branch in found[:n].tolist()]
    edges = _edges(k, planes[:n_planes].tolist(), *_window(low[3], high[3]))
    _probe(k, np.array(edges), planes, n_planes, near, low, high, box, seen, best)
    masks = seen[: len(edges)].tolist()
    ends += [(t4, b) for t4, mask in zip(edges, masks, strict=True) for b in _BITS if int(mask) >> b & 1]
    ends.sort()
    marks: list[float] = []
    for t4, _ in ends:
        if not marks or t4 - marks[-1] > _SAME:
            marks.append(t4)
    middles = np.array([0.5 * (a + b) for a, b in pairwise(marks)])
    _probe(k, middles, planes, n_planes, near, low, high, box, seen, best)
    rows = _merge(ends, marks, [int(mask) for mask in seen[: len(middles)].tolist()])
    wish = float(near[3])
    turns = np.array([_nearest(rows, branch, wish) for branch in sorted({row[0] for row in rows})])
    _probe(k, turns, planes, n_planes, near, low, high, box, seen, best)
    _settle(k, best, near, low, high, box, float(limits is not box), answer)
    return rows


def _edges(k: Array, planes: list[list[float]], start: float, stop: float) -> list[float]:
    """θ4 at its stops and, where a boundary is upright all along, at the quarter turns.

    It is with the point on axis 1, or with a stop of θ1 at which the arm's plane holds the point.
    """
    out = [start, stop] if stop > start else [start]
    if k[RAD] < _HAIR or any(plane[JOINT] == 0.0 and abs(plane[M]) < _HAIR for plane in planes):
        quarters = (nearest_image(0.5 * math.pi * i, 0.5 * (start + stop), start, stop) for i in range(4))
        out += [t4 for t4 in quarters if start <= t4 <= stop]
    return out


def _merge(ends: list[tuple[float, int]], marks: list[float], seen: list[int]) -> list[Row]:
    """Intervals (branch, low, high) from sorted ends (θ4, branch), their values, the branches seen between."""
    rows: list[Row] = []
    for branch in _BITS:
        bit = 1 << branch
        for i, t4 in enumerate(marks[:-1]):
            if seen[i] & bit:
                if rows and rows[-1][0] == branch and rows[-1][2] == t4:
                    rows[-1] = (branch, rows[-1][1], marks[i + 1])
                else:
                    rows.append((branch, t4, marks[i + 1]))
    for t4, name in ends:
        i = bisect_right(marks, t4) - 1
        around = [mask for mask in (seen[i - 1 : i] if i else []) + seen[i : i + 1] if mask]
        # A point alone; where branches meet, its name is a matter of rounding.
        alone = not any(mask >> name % 8 & 1 for mask in around) if name < 8 else not around
        if alone and (name % 8, marks[i], marks[i]) not in rows:
            rows.append((name % 8, marks[i], marks[i]))
    return rows


def _union(rows: list[Row]) -> list[Row]:
    """The intervals of one branch, sorted, those that overlap or touch as one."""
    out: list[Row] = []
    for branch, low, high in sorted(rows):
        if out and low <= out[-1][2] + _SAME:
            out[-1] = (branch, out[-1][1], max(high, out[-1][2]))
        else:
            out.append((branch, low, high))
    return out


def _nearest(rows: list[Row], branch: int, wish: float) -> float:
    """The value of the branch's intervals nearest to the wish, a hair inside where there is room; NaN without."""
    values = []
    for name, low, high in rows:
        if name == branch:
            inset = min(1e-7, 0.5 * (high - low))
            values.append(min(max(wish, low + inset), high - inset))
    return min(values, key=lambda value: abs(value - wish), default=math.nan)


def _as_joint(rows: list[Row], limits: Array, offset: float) -> Array:
    """Canonical intervals as joint values, with the whole-turn images that a range of more than a turn holds."""
    low, high = limits.tolist()
    turns = int((high - low) / TURN) if math.isfinite(high - low) else 0
    images = [
        (branch, a + TURN * turn - offset, min(b + TURN * turn, high) - offset)
        for turn in range(turns + 1)
        for branch, a, b in rows
        if a + TURN * turn <= high
    ]
    return np.array(images, dtype=np.float64).reshape(-1, 3)
