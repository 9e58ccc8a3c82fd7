"""Compiled distances between the capsules of one arm."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.kernels.fk import advance, base_rows, x_part, z_part
from kin.transforms import Array

TINY = 1e-24  # m²; a shorter segment is a point
Ints = NDArray[np.int64]


@inlined
def _clamped(x: float) -> float:
    return min(max(x, 0.0), 1.0)


@inlined
def segment_distance(A: Array, i: int, B: Array, j: int) -> tuple[float, float, float]:
    """Least distance of two segments, and where on each it is, 0 at the start and 1 at the end.

    Rows of A and B are start and end. C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
    """
    ux, uy, uz = A[i, 3] - A[i, 0], A[i, 4] - A[i, 1], A[i, 5] - A[i, 2]
    vx, vy, vz = B[j, 3] - B[j, 0], B[j, 4] - B[j, 1], B[j, 5] - B[j, 2]
    rx, ry, rz = A[i, 0] - B[j, 0], A[i, 1] - B[j, 1], A[i, 2] - B[j, 2]
    a = ux * ux + uy * uy + uz * uz
    e = vx * vx + vy * vy + vz * vz
    c = ux * rx + uy * ry + uz * rz
    f = vx * rx + vy * ry + vz * rz
    s = 0.0
    t = 0.0
    if a <= TINY:
        if e > TINY:
            t = _clamped(f / e)
    elif e <= TINY:
        s = _clamped(-c / a)
    else:
        b = ux * vx + uy * vy + uz * vz
        across = a * e - b * b  # 0 if they are parallel: then any s will do
        if across > 1e-14 * a * e:
            s = _clamped((b * f - c * e) / across)
        t = (b * s + f) / e
        if t < 0.0:
            t = 0.0
            s = _clamped(-c / a)
        elif t > 1.0:
            t = 1.0
            s = _clamped((b - c) / a)
    x = rx + s * ux - t * vx
    y = ry + s * uy - t * vy
    z = rz + s * uz - t * vz
    return math.sqrt(x * x + y * y + z * z), s, t


@inlined
def _put(shape: Array, k: int, r: int, x: float, y: float, z: float, p: float, out: Array) -> None:
    """Coordinate r of both ends of capsule k, from that row of its frame."""
    out[k, r] = x * shape[k, 0] + y * shape[k, 1] + z * shape[k, 2] + p
    out[k, 3 + r] = x * shape[k, 3] + y * shape[k, 4] + z * shape[k, 5] + p


@jit
def place(model: Array, rows: Ints, shape: Array, q: Array, out: Array) -> None:
    """out ← starts and ends ``(m, 6)`` of the capsules at q; `rows` ascends."""
    k = 0
    x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2 = base_rows(model, 0)
    modified = model[2] == 1.0
    for i in range(-1, int(model[0])):
        if i >= 0:
            s, c, d = z_part(model, i, q)
            a, ca, sa = x_part(model, i)
            if modified:
                x0, y0, z0, p0 = advance((x0, y0, z0, p0), 0.0, 1.0, 0.0, a, ca, sa)
                x1, y1, z1, p1 = advance((x1, y1, z1, p1), 0.0, 1.0, 0.0, a, ca, sa)
                x2, y2, z2, p2 = advance((x2, y2, z2, p2), 0.0, 1.0, 0.0, a, ca, sa)
                a, ca, sa = 0.0, 1.0, 0.0
            x0, y0, z0, p0 = advance((x0, y0, z0, p0), s, c, d, a, ca, sa)
            x1, y1, z1, p1 = advance((x1, y1, z1, p1), s, c, d, a, ca, sa)
            x2, y2, z2, p2 = advance((x2, y2, z2, p2), s, c, d, a, ca, sa)
        while k < rows.shape[0] and rows[k] == i:
            _put(shape, k, 0, x0, y0, z0, p0, out)
            _put(shape, k, 1, x1, y1, z1, p1, out)
            _put(shape, k, 2, x2, y2, z2, p2, out)
            k += 1


@jit
def distances_of_pairs(model: Array, rows: Ints, shape: Array, pairs: Ints, q: Array) -> Array:
    """Distance of each pair of capsules ``(k, p)`` at configurations ``(k, n)``; negative where they overlap."""
    out = np.empty((q.shape[0], pairs.shape[0]))
    ends = np.empty((rows.shape[0], 6))
    for j in range(q.shape[0]):
        place(model, rows, shape, q[j], ends)
        for p in range(pairs.shape[0]):
            first, second = pairs[p, 0], pairs[p, 1]
            apart, _, _ = segment_distance(ends, first, ends, second)
            out[j, p] = apart - shape[first, 6] - shape[second, 6]
    return out


@inlined
def beyond(A: Array, shape: Array, i: int, j: int, least: float) -> bool:
    """Whether the balls around capsules i and j are farther apart than `least`."""
    x = 0.5 * (A[i, 0] + A[i, 3] - A[j, 0] - A[j, 3])
    y = 0.5 * (A[i, 1] + A[i, 4] - A[j, 1] - A[j, 4])
    z = 0.5 * (A[i, 2] + A[i, 5] - A[j, 2] - A[j, 5])
    most = least + shape[i, 7] + shape[j, 7]
    return bool(most < 0.0 or x * x + y * y + z * z > most * most)


@jit
def least_distance(model: Array, rows: Ints, shape: Array, pairs: Ints, q: Array, ends: Array, out: Array) -> int:
    """Index of the pair with the least distance at q ``(n,)``, −1 without pairs.

    `ends` ``(m, 6)`` is overwritten with the ends of the capsules. out ``(7,)`` ← that distance, and the points of
    the two axes where it is.
    """
    place(model, rows, shape, q, ends)
    nearest = -1
    least = math.inf
    at, by = 0.0, 0.0
    for p in range(pairs.shape[0]):
        first, second = pairs[p, 0], pairs[p, 1]
        if beyond(ends, shape, first, second, least):
            continue
        apart, s, t = segment_distance(ends, first, ends, second)
        apart -= shape[first, 6] + shape[second, 6]
        if apart < least:
            least, nearest, at, by = apart, p, s, t
    out[0] = least
    if nearest >= 0:
        first, second = pairs[nearest, 0], pairs[nearest, 1]
        for r in range(3):
            out[1 + r] = ends[first, r] + at * (ends[first, 3 + r] - ends[first, r])
            out[4 + r] = ends[second, r] + by * (ends[second, 3 + r] - ends[second, r])
    return nearest
