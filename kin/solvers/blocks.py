"""Batches of targets: computed in blocks, by loops that the compiler vectorises.

A block of `BLOCK` targets is laid out entry by entry in one array S ``(rows, BLOCK)``. What a family computes of a
target is then a loop along the rows of S, without jumps and calls, several targets to an instruction:

1. *pairs*: every angle of every branch as (y, x), from the poses and values in the first rows of S. Where there is
   no branch, one of the two is NaN; a target near a singularity is marked by 1.0 in the last row.
2. *angles*: the arc tangents of all pairs, which are most of the work, and joint values of them.
3. *store*: the rows of the answer, gathered from S.
4. *careful*: a marked target once more, by the kernel that limits and ranges are computed with, too.

One target is a block of one, the same operations in the same order: so results of a batch and of single
targets are bit-identical.

`nearest_each` picks, among the rows of a block, the branch that is nearest to a seed inside the limits, and has
only that one computed by the careful kernel. Both kernels give the same angles but for rounding, so the choice is
the same too, unless two branches are equally near, the nearest one is at a limit, or the target is marked: such a
target is left open.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK, all_finite_pose
from kin.kernels.simd import atan2, rounded, widest, wrapped
from kin.solvers.common import HIGH, LOW, NEAR
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REACH = TOLERANCES.closure_position * 0.1
# Metres beyond the reach of an elbow or a shoulder up to which the careful kernel decides.
BEYOND = 10.0 * _REACH
# Sine of a singular angle, or metres, below which the careful kernel computes: farther off, rows of both kernels
# differ by far less than `_CLEAR`.
NEARLY = 1e-6
# Radians, or square radians, by which a choice among branches must be clear.
_CLEAR = 1e-6
_PER_TURN = 1.0 / TURN
# Rows of S: the first three rows of the pose, the requested value, a family's own from OWN on, and last the mark.
VALUE, OWN, _MARK = 12, 13, -1

Pairs = Callable[[Array, Array, int, Array], int]
Arc = Callable[[Array, int, int, int], float]
Angles = Callable[[Arc, Array, Array, int, Array], None]
Store = Callable[[Array, Array, int, Array], None]
Careful = Callable[[Array, Array, float, Array, Array], None]
Alone = Callable[[Array, Array, tuple[float, int], Array, Array, Array], object]
Entries = tuple[float, float, float, float, float, float, float, float, float, float, float, float]


@joined
def solve_each(
    solve: Callable[..., object], request: object, layout: tuple[int, int], params: Array, T: Array, seeds: Array,
    limits: tuple[Array, Array], out: Array,
) -> None:  # fmt: skip
    """out ``(N, branches, n)`` ← what a family's kernel `solve` finds of each of the targets T ``(N, 4, 4)``.

    request: its argument before the seed. layout: most arcs, columns of its rows. seeds ``(N, n)``, or ``(1, n)``
    for all; limits: lower, upper ``(n,)``.
    """
    arcs, rows = np.empty((layout[0], 3)), np.empty((out.shape[1], layout[1]))
    lower, upper = limits
    last = seeds.shape[0] - 1
    for i in range(T.shape[0]):
        solve(params, T[i], request, seeds[min(i, last)], lower, upper, arcs, rows)
        for r in range(out.shape[1]):
            for c in range(out.shape[2]):
                out[i, r, c] = rows[r, c]


@joined
def each(
    pairs: Pairs, angles: Angles, store: Store, careful: Careful, layout: tuple[int, int], params: Array, T: Array,
    request: tuple[Array, Array], out: Array,
) -> None:  # fmt: skip
    """out ``(N, branches, n)`` ← all branches of each of the targets T ``(N, 4, 4)``.

    layout: as in `one`. request: a value for each target ``(N,)``, or one for all ``(1,)``; the configuration
    ``(n,)`` to stay near.
    """
    values, near = request
    S = np.empty((layout[0], BLOCK))
    last = values.shape[0] - 1
    for first in range(0, T.shape[0], BLOCK):
        count = min(BLOCK, T.shape[0] - first)
        for b in range(count):
            for r in range(3):
                for c in range(4):
                    S[4 * r + c, b] = T[first + b, r, c]
            S[VALUE, b] = values[min(first + b, last)]
        marked = pairs(params, near, count, S)
        angles(arc, params, near, count, S)
        for b in range(count):
            store(params, S, b, out[first + b])
        if marked > 0:
            for b in range(count):
                if S[_MARK, b] > 0.0:
                    i = first + b
                    careful(params, T[i], values[min(i, last)], near, out[i])


@joined
def one(
    pairs: Pairs, angles: Angles, store: Store, careful: Careful, layout: tuple[int, int], params: Array, T: Array,
    request: tuple[float, Array], out: Array,
) -> bool:  # fmt: skip
    """out ``(branches, n)`` ← all branches of T ``(4, 4)``. False if T is not finite.

    layout: how many rows S has, and how many pairs there are: S[OWN + k], S[OWN + pairs + k]. request: the value,
    and the configuration ``(n,)`` to stay near.
    """
    value, near = request
    rows, size = layout
    S = np.empty((rows, 1))
    for r in range(3):
        for c in range(4):
            S[4 * r + c, 0] = T[r, c]
    S[VALUE, 0] = value
    if pairs(params, near, S.shape[1], S) > 0:
        careful(params, T, value, near, out)
    else:
        # Vectors go down the one column: all arc tangents in one loop.
        for k in range(OWN, OWN + size):
            S[k, 0] = atan2(S[k, 0], S[size + k, 0])
        angles(taken, params, near, S.shape[1], S)
        store(params, S, 0, out)
    return all_finite_pose(T)


@joined
def nearest_each(
    pairs: Pairs, angles: Angles, store: Store, alone: Alone, layout: tuple[int, int], params: Array, T: Array,
    around: tuple[Array, Array, Array], out: Array,
) -> None:  # fmt: skip
    """out ``(N, n)`` ← of the branches of each target T ``(N, 4, 4)`` the nearest one inside the limits, or NaN.

    All joints turn. NaN where there is none, or where the choice is not clear. around: seeds
    ``(N, n)``, or ``(1, n)`` for all, and lower and upper limits ``(n,)``.

    Args:
        alone: ``alone(params, T, (NaN, branch), box, arcs, rows)`` writes ``rows[branch]`` as the careful kernel
            does, nothing if there is no such branch. Of a target that is not marked it reads no seed and no limit:
            box ``(4, n)`` is NaN, arcs ``(1, 3)``.
        layout: how many rows S has, how many columns rows has.
    """
    seeds, lower, upper = around
    n, last = out.shape[1], seeds.shape[0] - 1
    S, rows, arcs = np.empty((layout[0], BLOCK)), np.empty((8, layout[1])), np.empty((1, 3))
    box = np.full((4, n), math.nan)
    found, tiled, cost = np.empty((8, n)), np.empty((3, 8 * n)), np.empty(8 * n)
    flat = found.reshape(8 * n)
    laid, inside = -1, False
    for first in range(0, T.shape[0], BLOCK):
        count = min(BLOCK, T.shape[0] - first)
        for b in range(count):
            for r in range(3):
                for c in range(4):
                    S[4 * r + c, b] = T[first + b, r, c]
            S[VALUE, b] = math.nan
        pairs(params, seeds[0], count, S)
        angles(arc, params, seeds[0], count, S)
        for b in range(count):
            i = first + b
            which = min(i, last)
            if which != laid:
                laid, inside = which, _tile(seeds[which], lower, upper, tiled)
            branch = -1
            if inside and S[_MARK, b] == 0.0:
                store(params, S, b, found)
                branch = _nearest_branch(flat, tiled, cost)
            if branch >= 0:
                rows[branch, 0] = math.nan
                alone(params, T[i], (math.nan, branch), box, arcs, rows)
            for c in range(n):
                out[i, c] = rows[branch, c] if branch >= 0 else math.nan


@jit
def _tile(seed: Array, lower: Array, upper: Array, around: Array) -> bool:
    """Rows NEAR, LOW, HIGH of around ``(3, 8 n)`` ← seed and limits ``(n,)``, once for each branch.

    Whether the seed is inside the limits: from outside, the nearest image may be several turns away.
    """
    n = seed.shape[0]
    inside = True
    for i in range(n):
        inside = inside and lower[i] <= seed[i] <= upper[i]
        for k in range(i, 8 * n, n):
            around[NEAR, k], around[LOW, k], around[HIGH, k] = seed[i], lower[i], upper[i]
    return inside


@jit
def _nearest_branch(q: Array, around: Array, cost: Array) -> int:
    """The branch of q ``(8 n,)``, n angles of each, that is nearest to the seed inside the limits; −1 if unclear.

    A branch that does not exist is NaN. Angles are brought to their best images, in place. Those at a limit count
    as inside, and so no branch is farther than it is taken for; cost ``(8 n,)`` is scratch.
    """
    widest()
    for k in range(cost.shape[0]):
        near, low, high = around[NEAR, k], around[LOW, k], around[HIGH, k]
        x = q[k] + TURN * rounded((near - q[k]) * _PER_TURN)
        x = x + TURN if x < low - _CLEAR else (x - TURN if x > high + _CLEAR else x)
        outside = (x < low - _CLEAR) | (x > high + _CLEAR)
        q[k] = x
        cost[k] = math.inf if outside else (x - near) * (x - near)
    n = cost.shape[0] // 8
    best, least, second = -1, math.inf, math.inf
    for branch in range(8):
        total = 0.0
        for k in range(branch * n, branch * n + n):
            total += cost[k]
        if total < least:
            best, least, second = branch, total, least
        elif total < second:
            second = total
    if not second - least > _CLEAR:
        return -1
    for k in range(best * n, best * n + n):
        if q[k] - around[LOW, k] < _CLEAR or around[HIGH, k] - q[k] < _CLEAR:
            return -1
    return best


@inlined
def is_wanted(only: int, branch: int, bits: int) -> bool:
    """Whether a branch is to be computed: `only` is negative, or has the same ones of these bits."""
    return only < 0 or (only ^ branch) & bits == 0


@inlined
def rows_of(params: Array, first: int) -> Entries:
    """Twelve numbers of params: read before a loop, as it might write there for all LLVM knows."""
    p, i = params, first
    return (
        p[i], p[i + 1], p[i + 2], p[i + 3], p[i + 4], p[i + 5], p[i + 6], p[i + 7], p[i + 8], p[i + 9], p[i + 10],
        p[i + 11],
    )  # fmt: skip


@inlined
def in_base(k: Entries, S: Array, column: int, b: int) -> tuple[float, float, float]:
    """A column of the pose of target b, turned by base⁻¹, whose first three rows are k."""
    x, y, z = S[column, b], S[column + 4, b], S[column + 8, b]
    return k[0] * x + k[1] * y + k[2] * z, k[4] * x + k[5] * y + k[6] * z, k[8] * x + k[9] * y + k[10] * z


@inlined
def canonical_of(k: Entries, t: Entries, S: Array, b: int) -> Entries:
    """base⁻¹ · T · tool⁻¹ of target b, row after row; k and t are the first three rows of base⁻¹ and tool⁻¹."""
    u0, u1, u2 = in_base(k, S, 0, b)
    v0, v1, v2 = in_base(k, S, 1, b)
    w0, w1, w2 = in_base(k, S, 2, b)
    p0, p1, p2 = in_base(k, S, 3, b)
    return (
        u0 * t[0] + v0 * t[4] + w0 * t[8], u0 * t[1] + v0 * t[5] + w0 * t[9], u0 * t[2] + v0 * t[6] + w0 * t[10],
        u0 * t[3] + v0 * t[7] + w0 * t[11] + (p0 + k[3]),
        u1 * t[0] + v1 * t[4] + w1 * t[8], u1 * t[1] + v1 * t[5] + w1 * t[9], u1 * t[2] + v1 * t[6] + w1 * t[10],
        u1 * t[3] + v1 * t[7] + w1 * t[11] + (p1 + k[7]),
        u2 * t[0] + v2 * t[4] + w2 * t[8], u2 * t[1] + v2 * t[5] + w2 * t[9], u2 * t[2] + v2 * t[6] + w2 * t[10],
        u2 * t[3] + v2 * t[7] + w2 * t[11] + (p2 + k[11]),
    )  # fmt: skip


@inlined
def elbow_of(x: float, y: float, a: float, b: float) -> tuple[float, float, float, bool]:
    """The elbow of a planar arm of links a, b that ends in (x, y): c, s ≥ 0, 1/D²; c is NaN if it does not close.

    The last is whether it is so nearly straight or folded, closing or not, or ends so near to the first axis, that
    it needs the careful kernel. See :func:`kin.solvers.planar.two_links`.
    """
    D2 = x * x + y * y
    most, least = a + b, abs(a - b)
    far, near_by = most * most - D2, D2 - least * least
    far = far if far > 0.0 else 0.0
    near_by = near_by if near_by > 0.0 else 0.0
    nearest = least - _REACH if least > _REACH else 0.0
    reached = ((most + _REACH) ** 2 >= D2) & (nearest * nearest <= D2)  # not if it is NaN
    closest = least - BEYOND if least > BEYOND else 0.0
    nearly_reached = ((most + BEYOND) ** 2 >= D2) & (closest * closest <= D2)
    half = 0.5 / (a * b)
    s = half * math.sqrt(far * near_by)
    c = 0.5 * half * (near_by - far)
    close = (far < 1e-14 * near_by) | (near_by < 1e-14 * far) | (1e-8 * most * most > D2)
    return c if reached else math.nan, s, 1.0 / D2, close & nearly_reached


@inlined
def arc(S: Array, k: int, pairs: int, b: int) -> float:
    """The angle whose pair (y, x) is S[k, b], S[pairs + k, b]."""
    return atan2(S[k, b], S[pairs + k, b])


@inlined
def taken(S: Array, k: int, pairs: int, b: int) -> float:
    """The angle that `arc` gave, left in S[k, b]."""
    return float(S[k, b])


@inlined
def _shift(sign: float, offset: float) -> float:
    """What `sign` times an angle lacks to its joint value, in [−π, π]; θ = sign q + offset."""
    angle = -sign * offset
    return angle - TURN * rounded(angle / TURN)


@joined
def single(
    angle_of: Arc, S: Array, first: int, last: int, pairs: int, count: int, sign: float, offset: float
) -> None:
    """S[first:last] ← joint values of the angles whose pairs (y, x) are S[k], S[pairs + k]."""
    widest()
    shift = _shift(sign, offset)
    for k in range(first, last):
        for b in range(count):
            S[k, b] = wrapped(sign * angle_of(S, k, pairs, b) + shift)


@joined
def double(
    angle_of: Arc, S: Array, first: int, last: int, pairs: int, count: int, sign: float, offset: float,
    turned: bool,
) -> None:  # fmt: skip
    """As `single`, and S[pairs + k] ← those of the same angles half a turn on, or of the opposite sign."""
    widest()
    shift = _shift(sign, offset)
    second, other = (sign, wrapped(shift + math.pi)) if turned else (-sign, shift)
    for k in range(first, last):
        for b in range(count):
            angle = angle_of(S, k, pairs, b)
            S[k, b] = wrapped(sign * angle + shift)
            S[pairs + k, b] = wrapped(second * angle + other)
