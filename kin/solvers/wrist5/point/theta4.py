"""θ4 for which some θ5 is feasible: the points (θ4, θ5, R), called spots, at which this set may end."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import excess
from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW
from kin.solvers.wrist5.point.constants import A1, A2, D4, D6, JOINT, KAY, P0, PC, PR, PT, RAD, H, M, S
from kin.solvers.wrist5.point.roots import quadratic, real_roots
from kin.transforms import Array

Point = tuple[float, float, float]


@jit
def _add_spot(k: Array, point: Point, m: float, s: float, box: Array, spots: Array, count: int) -> int:
    """Append (θ4, θ5, R) at a point (C, tx, R) of the hyperboloid unless θ4 or θ5 is outside its limits.

    m and the sign s of sin θ5 are 0.0 if they are not known: then both signs are appended.
    """
    C, tx, R = point
    d6, m2 = k[D6], (k[RAD] - R) * (k[RAD] + R)
    if m2 < -1e-10 or abs(C) > abs(d6) * (1.0 + 1e-9):
        return count
    off = abs(m) if m != 0.0 else math.sqrt(max(m2, 0.0))
    tilt = math.atan2(math.hypot(tx, off), C * math.copysign(1.0, d6))
    for i in range(4):
        a, b = 1.0 - 2.0 * (i // 2), 1.0 - 2.0 * (i % 2)
        if min(a * m, b * s) >= 0.0:
            t4, t5 = math.atan2(a * b * off / d6, -b * tx / d6), b * tilt
            if (
                excess(t5, box[LOW, 4], box[HIGH, 4]) + excess(t4, box[LOW, 3], box[HIGH, 3]) == 0.0
                and count < spots.shape[0]
            ):
                spots[count, 0], spots[count, 1], spots[count, 2] = t4, t5, R
                count += 1
    return count


@jit
def _cross(k: Array, plane: Array, other: Array, box: Array, roots: Array, spots: Array, count: int) -> int:
    """Append the points at which the line of intersection of two planes meets the hyperboloid.

    The line runs along d = n × n', with n and n' the normals. `roots` is scratch.
    """
    n1, n2, n3, n0 = plane[PC], plane[PT], plane[PR], plane[P0]
    o1, o2, o3, o0 = other[PC], other[PT], other[PR], other[P0]
    d1, d2, d3 = n2 * o3 - n3 * o2, n3 * o1 - n1 * o3, n1 * o2 - n2 * o1
    size = d1 * d1 + d2 * d2 + d3 * d3
    if size < 1e-20:
        return count
    # Its point nearest to the origin is w × d / |d|² with w = n0' n − n0 n'.
    w1, w2, w3 = (o0 * n1 - n0 * o1) / size, (o0 * n2 - n0 * o2) / size, (o0 * n3 - n0 * o3) / size
    x1, x2, x3 = w2 * d3 - w3 * d2, w3 * d1 - w1 * d3, w1 * d2 - w2 * d1
    level = (k[RAD] - k[D6]) * (k[RAD] + k[D6])
    n = quadratic(
        d3 * d3 - d2 * d2 - d1 * d1,
        2.0 * (x3 * d3 - x2 * d2 - x1 * d1),
        x3 * x3 - x2 * x2 - x1 * x1 - level,
        roots,
    )
    m, s = plane[M] + other[M], plane[S] + other[S]
    for root in range(n):
        t = roots[root]
        count = _add_spot(k, (x1 + t * d1, x2 + t * d2, x3 + t * d3), m, s, box, spots, count)
    return count


@jit
def _vertical_tangents(k: Array, plane: Array, roots: Array) -> int:
    """roots ← every C/d6 = cos θ5 = c at which the curve of a plane has a vertical tangent; returns their number.

    R v + pR r² c = 0 with v = pC d6 + p0 c; then pT tx = −u/v with u = (p0 + pC d6 c) v − pR² r² c.
    """
    d6, r2 = k[D6], k[RAD] * k[RAD]
    b, pt2, p0 = plane[PC] * d6, plane[PT] ** 2, plane[P0]
    pr2 = plane[PR] ** 2 * r2
    u, v, p = np.empty(3), np.empty(3), np.zeros(5)
    u[0] = u[2] = p0 * b
    u[1] = p0 * p0 + b * b - pr2
    if pt2 < 1e-14 or pr2 < 1e-26:
        return quadratic(u[2], u[1], u[0], roots)
    v[0] = b * b
    v[1] = 2.0 * b * p0
    v[2] = p0 * p0
    for j in range(3):
        for n in range(3):
            p[j + n] += u[j] * u[n]
        p[j] += pt2 * (r2 - d6 * d6) * v[j]
        p[j + 2] += pt2 * d6 * d6 * v[j]
    p[2] -= pt2 * pr2 * r2
    return real_roots(p, -1.0, 1.0, roots)


@jit
def _add_edge(k: Array, C: float, R: float, m: float, s: float, box: Array, spots: Array, count: int) -> int:
    """As `_add_spot`, with tx of either sign from the equation of the hyperboloid."""
    tx2 = R * R - C * C - (k[RAD] - k[D6]) * (k[RAD] + k[D6])
    if tx2 > -1e-10:
        tx = math.sqrt(max(tx2, 0.0))
        for sign in (-1.0, 1.0):
            count = _add_spot(k, (C, sign * tx, R), m, s, box, spots, count)
    return count


@jit
def _edge_at_limits(k: Array, planes: Array, box: Array, spots: Array, count: int) -> int:
    """Append the points at which the stretched or folded arm meets a limit of θ1 or θ5.

    (K − 2 d4 C − 2 a1 R)² = 4 a2² L² with L² = d4² + d6² − r² + R² + 2 d4 C is quadratic in R and in C. At limits
    of θ2 and θ3 the set does not end: the two ways to bend the elbow meet there.
    """
    a1, a2, d4, d6, r2 = k[A1], k[A2], k[D4], k[D6], k[RAD] * k[RAD]
    roots = np.empty(12)
    for i in range(planes.shape[0]):
        if planes[i, JOINT] != 0.0 and planes[i, JOINT] != 4.0:
            continue
        fixed = -planes[i, P0]
        if planes[i, JOINT] == 0.0:
            Q, L2 = k[KAY] - 2.0 * a1 * fixed, d4 * d4 + d6 * d6 - r2 + fixed * fixed
            f = 2.0 * d4
            n = quadratic(f * f, -2.0 * f * Q - 4.0 * a2 * a2 * f, Q * Q - 4.0 * a2 * a2 * L2, roots)
        else:
            Q, L2 = k[KAY] - 2.0 * d4 * fixed, d4 * d4 + d6 * d6 - r2 + 2.0 * d4 * fixed
            f = 2.0 * a1
            n = quadratic(f * f - 4.0 * a2 * a2, -2.0 * f * Q, Q * Q - 4.0 * a2 * a2 * L2, roots)
        for j in range(n):
            x, z = (roots[j], fixed) if planes[i, JOINT] == 0.0 else (fixed, roots[j])
            count = _add_edge(k, x, z, planes[i, M], planes[i, S], box, spots, count)
    return count


@jit
def _edge_tangents(k: Array, box: Array, spots: Array, count: int) -> int:
    """Append the points at which the edge of reach has a vertical tangent.

    D = ±a2 ± L is the distance from the shoulder to the tool point in the arm's plane. u = D − (R − a1) or, where
    that is the smaller one, u = D + (R − a1), makes D = (u + h²/u)/2, R and C rational in u; (r² − R²)/sin² θ5 is
    stationary at the roots of a polynomial of degree six.
    """
    a1, a2, d4, d6 = k[A1], k[A2], k[D4], k[D6]
    r2, h2 = k[RAD] * k[RAD], k[H] * k[H]
    edge, far = abs(k[H]) * (1.0 - 1e-9), 2.0 * (a2 + d4 + abs(d6))
    R, C, top, bottom, p, roots = np.empty(3), np.empty(3), np.empty(5), np.empty(5), np.empty(7), np.empty(12)
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
        for i in range(real_roots(p, start, start + far - edge, roots)):
            u = roots[i]
            if u != 0.0:
                x, z = C[0] / u + C[1] + C[2] * u, R[0] / u + R[1] + R[2] * u
                count = _add_edge(k, x, z, 0.0, 0.0, box, spots, count)
    return count


@jit
def find_spots(k: Array, planes: Array, box: Array, spots: Array) -> int:
    """spots ``(n, 3)`` ← (θ4, θ5, R) where the set of feasible θ4 may end; returns their number."""
    roots, levels, level = np.empty(12), np.empty(8), np.zeros(7)
    level[PC] = 1.0
    count = 0
    for i in range(planes.shape[0]):
        joint = planes[i, JOINT]
        n = _vertical_tangents(k, planes[i], levels) if joint < 4.0 else 0
        for j in range(n):
            level[P0] = -k[D6] * levels[j]
            count = _cross(k, planes[i], level, box, roots, spots, count)
        for j in range(i):
            if planes[j, JOINT] != joint and not (planes[j, JOINT] < 0.0 and abs(planes[i, PR]) > 1e-9):
                count = _cross(k, planes[i], planes[j], box, roots, spots, count)
    count = _edge_at_limits(k, planes, box, spots, count)
    return int(_edge_tangents(k, box, spots, count))
