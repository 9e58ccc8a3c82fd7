"""Compiled distances from the capsules of an arm to obstacles, and the least of all distances."""

from __future__ import annotations

import math

import numpy as np

from kin.collision.kernels import Ints, beyond, least_distance, place, segment_distance
from kin.kernels.compile import inlined, jit
from kin.transforms import Array

SPHERE, CYLINDER, BOX = 0, 1, 2
COLUMNS = 17  # of an obstacle: kind, three half sizes, rotation by rows, place, radius of a ball around it
_STEPS = 60  # at most, where no formula gives the nearest point
_SETTLED = 1e-22  # m² by which the squared distance may still fall


@inlined
def _beyond(x: float, half: float) -> float:
    """By how much x is outside [−half, half], with its sign."""
    return x - half if x > half else x + half if x < -half else 0.0


@inlined
def _slope(kind: int, size: tuple[float, float, float], a: Array, t: float) -> float:
    """Half the derivative of the squared distance to the obstacle along a segment; a: start and direction."""
    x, y, z = a[0] + t * a[3], a[1] + t * a[4], a[2] + t * a[5]
    if kind == BOX:
        return float(_beyond(x, size[0]) * a[3] + _beyond(y, size[1]) * a[4] + _beyond(z, size[2]) * a[5])
    far = math.sqrt(x * x + y * y)
    out = _beyond(z, size[2]) * a[5]
    if far > size[0]:
        out += (far - size[0]) / far * (x * a[3] + y * a[4])
    return float(out)


@inlined
def _away(kind: int, size: tuple[float, float, float], a: Array, t: float) -> float:
    """Distance of a point of the segment to the obstacle, 0 inside."""
    x, y, z = a[0] + t * a[3], a[1] + t * a[4], a[2] + t * a[5]
    if kind == BOX:
        x, y, z = _beyond(x, size[0]), _beyond(y, size[1]), _beyond(z, size[2])
        return math.sqrt(x * x + y * y + z * z)
    x, z = max(math.sqrt(x * x + y * y) - size[0], 0.0), _beyond(z, size[2])
    return math.sqrt(x * x + z * z)


@inlined
def _corner(kind: int, size: tuple[float, float, float], a: Array, k: int) -> float:
    """Where along the segment the formula of the slope changes, for k from 0 to 5; −1 if it does not."""
    if kind == BOX or k >= 4:
        r = k // 2 if kind == BOX else 2
        side = size[r] if k % 2 == 0 else -size[r]
        return float((side - a[r]) / a[3 + r]) if a[3 + r] != 0.0 else -1.0
    if k >= 2:
        return -1.0
    p = a[3] * a[3] + a[4] * a[4]
    q = a[0] * a[3] + a[1] * a[4]
    root = q * q - p * (a[0] * a[0] + a[1] * a[1] - size[0] * size[0])
    if p == 0.0 or root < 0.0:
        return -1.0
    return float(((-q + math.sqrt(root)) if k == 0 else (-q - math.sqrt(root))) / p)


@jit
def nearest_on(ends: Array, i: int, solids: Array, k: int, a: Array) -> tuple[float, float]:
    """Distance of segment i from obstacle k, and where on the segment it is, 0 to 1.

    Inside a sphere it is negative, inside a box or a cylinder 0.

    The squared distance to a convex body is convex along the segment, so its slope has one change of sign. Between
    the corners of a box the slope is a straight line; otherwise the change is found by halving. a ``(6,)``:
    scratch.
    """
    kind = int(solids[k, 0])
    size = (solids[k, 1], solids[k, 2], solids[k, 3])
    for r in range(3):
        a[r], a[3 + r] = 0.0, 0.0
        for c in range(3):
            turn = solids[k, 4 + 3 * c + r]
            a[r] += turn * (ends[i, c] - solids[k, 13 + c])
            a[3 + r] += turn * (ends[i, 3 + c] - ends[i, c])
    if kind == SPHERE:
        square = a[3] * a[3] + a[4] * a[4] + a[5] * a[5]
        t = 0.0
        if square > 0.0:
            t = min(max(-(a[0] * a[3] + a[1] * a[4] + a[2] * a[5]) / square, 0.0), 1.0)
        x, y, z = a[0] + t * a[3], a[1] + t * a[4], a[2] + t * a[5]
        return math.sqrt(x * x + y * y + z * z) - size[0], t
    low, high = 0.0, 1.0
    below, above = _slope(kind, size, a, low), _slope(kind, size, a, high)
    if below >= 0.0:
        return _away(kind, size, a, low), low
    if above <= 0.0:
        return _away(kind, size, a, high), high
    for c in range(6):
        t = _corner(kind, size, a, c)
        if low < t < high:
            slope = _slope(kind, size, a, t)
            if slope <= 0.0:
                low, below = t, slope
            else:
                high, above = t, slope
    t = low - below * (high - low) / (above - below)
    if kind != BOX:
        for step in range(_STEPS):
            slope = _slope(kind, size, a, t)
            if slope < 0.0:
                low, below = t, slope
            else:
                high, above = t, slope
            if abs(slope) * (high - low) <= _SETTLED:
                break
            # The secant and a halving in turn: fast where the slope is nearly straight, and never slow.
            t = 0.5 * (low + high) if step % 2 == 0 else low - below * (high - low) / (above - below)
    return _away(kind, size, a, t), t


@inlined
def _beyond_ball(ends: Array, shape: Array, i: int, solids: Array, k: int, least: float) -> bool:
    """Whether the balls around capsule i and obstacle k are farther apart than `least`."""
    x = 0.5 * (ends[i, 0] + ends[i, 3]) - solids[k, 13]
    y = 0.5 * (ends[i, 1] + ends[i, 4]) - solids[k, 14]
    z = 0.5 * (ends[i, 2] + ends[i, 5]) - solids[k, 15]
    most = least + shape[i, 7] + solids[k, 16]
    return bool(most < 0.0 or x * x + y * y + z * z > most * most)


@jit
def least_clearance(
    model: Array, rows: Ints, shape: Array, pairs: Ints, solids: Array, watched: Ints, q: Array, ends: Array,
    out: Array,
) -> int:  # fmt: skip
    """Which distance at q ``(n,)`` is the least: the index of a pair of capsules, then of (watched, obstacle).

    −1 if there is none. `watched`: the capsules that are compared with the obstacles `solids` ``(k, 17)``.
    `ends` ``(m, 6)`` is overwritten with the ends of the capsules. out ``(13,)`` ← that distance, and the points
    of both axes where it is (of an obstacle only that of the link); the rest is scratch.
    """
    nearest = least_distance(model, rows, shape, pairs, q, ends, out)
    least = out[0] if nearest >= 0 else math.inf
    a = out[7:]
    for w in range(watched.shape[0]):
        i = watched[w]
        for k in range(solids.shape[0]):
            if _beyond_ball(ends, shape, i, solids, k, least):
                continue
            apart, t = nearest_on(ends, i, solids, k, a)
            apart -= shape[i, 6]
            if apart < least:
                least = apart
                nearest = pairs.shape[0] + w * solids.shape[0] + k
                for r in range(3):
                    out[1 + r] = ends[i, r] + t * (ends[i, 3 + r] - ends[i, r])
    out[0] = least
    return nearest


@jit
def least_clearances(
    model: Array, rows: Ints, shape: Array, pairs: Ints, solids: Array, watched: Ints, q: Array, out: Array,
    which: Ints,
) -> None:  # fmt: skip
    """out and which ← the least distance ``(k,)`` of each configuration ``(k, n)``, and where it is."""
    ends = np.empty((rows.shape[0], 6))
    found = np.empty(13)
    for j in range(q.shape[0]):
        which[j] = least_clearance(model, rows, shape, pairs, solids, watched, q[j], ends, found)
        out[j] = found[0]


@jit
def distances_to_each(
    model: Array, rows: Ints, shape: Array, solids: Array, watched: Ints, q: Array, out: Array
) -> None:
    """out ← the distance of each watched capsule from each obstacle ``(w, k)`` at one configuration ``(n,)``."""
    ends = np.empty((rows.shape[0], 6))
    a = np.empty(6)
    place(model, rows, shape, q, ends)
    for w in range(watched.shape[0]):
        for k in range(solids.shape[0]):
            apart, _ = nearest_on(ends, watched[w], solids, k, a)
            out[w, k] = apart - shape[watched[w], 6]


@jit
def margins(
    model: Array, rows: Ints, shape: Array, couples: Ints, solids: Array, q: Array, parts: Array, paces: Array,
    out: Array,
) -> None:  # fmt: skip
    """Whether anything can touch around configurations ``(k, n)``.

    `couples` ``(c, 2)``: two capsules, or a capsule and −1 for all obstacles. They come nearer by at most `paces`
    ``(r, c)`` times a factor; `parts` ``(k, 2)`` has the row and the factor of each configuration. out ``(k, 2)``
    ← the smallest distance of what is as near as that, infinite if nothing is, and the smallest distance less what
    can be lost.
    """
    ends = np.empty((rows.shape[0], 6))
    a = np.empty(6)
    for j in range(q.shape[0]):
        place(model, rows, shape, q[j], ends)
        r = int(parts[j, 0])
        out[j, 0], out[j, 1] = math.inf, math.inf
        for c in range(couples.shape[0]):
            first, second = couples[c, 0], couples[c, 1]
            lost = paces[r, c] * parts[j, 1]
            if second >= 0:
                if beyond(ends, shape, first, second, lost):
                    continue
                apart, _, _ = segment_distance(ends, first, ends, second)
                apart -= shape[first, 6] + shape[second, 6]
                out[j, 0], out[j, 1] = min(out[j, 0], apart), min(out[j, 1], apart - lost)
                continue
            for k in range(solids.shape[0]):
                if _beyond_ball(ends, shape, first, solids, k, lost):
                    continue
                apart, _ = nearest_on(ends, first, solids, k, a)
                apart -= shape[first, 6]
                out[j, 0], out[j, 1] = min(out[j, 0], apart), min(out[j, 1], apart - lost)
