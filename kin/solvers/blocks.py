"""Batches of targets: computed in blocks, by loops that the compiler vectorises.

A block of `BLOCK` targets is laid out entry by entry in one array S ``(rows, BLOCK)``. What a family computes of a
target is then a loop along the rows of S, without jumps and calls, several targets to an instruction:

1. *pairs*: every angle of every branch as (y, x), from the poses and values in the first rows of S. Where there is
   no branch, one of the two is NaN; a target near a singularity is marked by 1.0 in the last row.
2. *angles*: the arc tangents of all pairs, which are most of the work, and joint values of them.
3. *store*: the rows of the answer, gathered from S.
4. *careful*: a marked target once more, by the kernel that also chooses what is free there, inside the limits.

One target is a block of one, the same operations in the same order: so results of a batch and of single
targets are bit-identical. Where a target that is not marked leaves nothing free, neither seed nor limits count, so
that what is solved inside limits (`solved`, `solved_many`) is computed in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import inlined, jit
from kin.kernels.fk import BLOCK, all_finite_pose
from kin.kernels.simd import atan2, rounded, wrapped
from kin.solvers.common import UNBOUNDED, clear
from kin.solvers.contract import Many, One, Seeded
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REACH = TOLERANCES.reach
# Metres beyond the reach of an elbow or a shoulder up to which the careful kernel decides.
BEYOND = 10.0 * _REACH
# Sine of a singular angle, or metres, below which the careful kernel computes: there, rounding is amplified, and
# rows of both kernels would differ by 1e-11 and more.
NEARLY = 1e-4
# The same for an elbow: the square of half its angle, or of half of what it lacks of a half turn.
_STRAIGHT = 1e-8
# Rows of S: the first three rows of the pose, the requested value, a family's own from OWN on, and last the mark.
VALUE, OWN, _MARK = 12, 13, -1

Pairs = Callable[[Array, Array, int, Array], int]
Arc = Callable[[Array, int, int, int], float]
Angles = Callable[[Arc, Array, Array, int, Array], None]
Store = Callable[[Array, Array, int, Array], None]
# Of params, T, value, seed, lower, upper, arcs, out: gap in metres, and number of arcs, −1 if nothing is free.
Careful = Callable[[Array, Array, float, Array, Array, Array, Array, Array], tuple[float, int]]
_Function = TypeVar("_Function", bound=Callable[..., object])
Entries = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
Vector = tuple[float, float, float]


@inlined
def each(
    pairs: Pairs, angles: Angles, store: Store, careful: Careful, layout: tuple[int, bool], params: Array,
    T: Array, request: tuple[Array, Array, Array, Array], out: Array,
) -> None:  # fmt: skip
    """out ``(N, branches, n)`` ← all branches of each of the targets T ``(N, 4, 4)``.

    layout: how many rows S has, and whether what a target leaves free is chosen; else its branches are NaN.
    request: a value for each target ``(N,)``, or one for all ``(1,)``; configurations to stay near, ``(N, n)`` or
    ``(1, n)``, the first of them for `pairs` and `angles`; lower and upper limits ``(n,)``.
    """
    values, seeds, lower, upper = request
    rows, chosen = layout
    S, arcs = np.empty((rows, BLOCK)), np.empty((0, 3))
    last, last_seed = values.shape[0] - 1, seeds.shape[0] - 1
    for first in range(0, T.shape[0], BLOCK):
        count = min(BLOCK, T.shape[0] - first)
        for b in range(count):
            for r in range(3):
                for c in range(4):
                    S[4 * r + c, b] = T[first + b, r, c]
            S[VALUE, b] = values[min(first + b, last)]
        marked = pairs(params, seeds[0], count, S)
        angles(arc, params, seeds[0], count, S)
        for b in range(count):
            store(params, S, b, out[first + b])
        if marked > 0:
            for b in range(count):
                if S[_MARK, b] > 0.0:
                    i = first + b
                    value, near = values[min(i, last)], seeds[min(i, last_seed)]
                    _, free = careful(params, T[i], value, near, lower, upper, arcs, out[i])
                    if free >= 0 and not chosen:
                        clear(out[i])


@inlined
def regular(
    pairs: Pairs, angles: Angles, store: Store, layout: tuple[int, int], params: Array, T: Array,
    request: tuple[float, Array], out: Array,
) -> bool:  # fmt: skip
    """out ``(branches, n)`` ← all branches of T ``(4, 4)``; False, and out as it was, if it is marked.

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
        return False
    # Vectors go down the one column: all arc tangents in one loop.
    for k in range(OWN, OWN + size):
        S[k, 0] = atan2(S[k, 0], S[size + k, 0])
    angles(taken, params, near, S.shape[1], S)
    store(params, S, 0, out)
    return True


def kernels_in_lanes(
    module: str, pairs: Pairs, angles: Angles, store: Store, careful: Careful, rows: int, size: int
) -> tuple[One, Many, Careful, Seeded]:
    """The kernels of a family in lanes: attributes of its module with the names that they have here.

    `branches_one` and `branches_many` are those of `kin.solvers.contract.BatchKernels`, which have no limits, and
    `solve_many` is its `seeded`, which leaves out what has a free joint. `solve_one` is as `careful`, which it
    asks where a target is singular; further columns of its out are NaN elsewhere.

    Args:
        rows, size: how many rows S has, and how many pairs.
    """

    def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
        if not regular(pairs, angles, store, (rows, size), params, T, (value, near), out):
            limits = unbounded(near.shape[0])
            careful(params, T, value, near, limits[0], limits[1], out[:0], out)
        return all_finite_pose(T)

    def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        limits = unbounded(near.shape[0])
        around = (values, near.reshape(1, near.shape[0]), limits[0], limits[1])
        each(pairs, angles, store, careful, (rows, True), params, T, around, out)

    def solve_one(
        params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
    ) -> tuple[float, int]:
        if regular(pairs, angles, store, (rows, size), params, T, (value, near), out):
            reached = False
            for i in range(out.shape[0]):
                reached = reached or not math.isnan(out[i, 0])
                for j in range(near.shape[0], out.shape[1]):
                    out[i, j] = math.nan
            if reached:
                return 0.0, -1
        return careful(params, T, value, near, lower, upper, arcs, out)

    def solve_many(params: Array, T: Array, seeds: Array, lower: Array, upper: Array, out: Array) -> None:
        request = (np.full(1, math.nan), seeds, lower, upper)
        each(pairs, angles, store, careful, (rows, False), params, T, request, out)

    return (
        _kernel(module, branches_one),
        _kernel(module, branches_many),
        _kernel(module, solve_one),
        _kernel(module, solve_many),
    )


def one_after_another(branches_one: One) -> Many:
    """`branches_many` of a family without lanes, in the module of its `branches_one`."""

    def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        last = values.shape[0] - 1
        for i in range(T.shape[0]):
            branches_one(params, T[i], values[min(i, last)], near, out[i])

    return _kernel(branches_one.__module__, branches_many)


def each_solved(solve: Callable[..., object], request: object, arcs: int, more: int = 0) -> Seeded:
    """`solve_many` of a family without lanes, in the module of its kernel for one target.

    Args:
        solve: of params, T, request, seed, lower, upper, arcs, out.
        arcs: how many rows those have at most.
        more: columns of out after the joint values.
    """

    def solve_many(params: Array, T: Array, seeds: Array, lower: Array, upper: Array, out: Array) -> None:
        found, rows = np.empty((arcs, 3)), np.empty((out.shape[1], out.shape[2] + more))
        last = seeds.shape[0] - 1
        for i in range(T.shape[0]):
            solve(params, T[i], request, seeds[min(i, last)], lower, upper, found, rows)
            for r in range(out.shape[1]):
                for c in range(out.shape[2]):
                    out[i, r, c] = rows[r, c]

    return _kernel(solve.__module__, solve_many)


def _kernel(module: str, function: _Function) -> _Function:
    """A function that was made here as a kernel of another module."""
    function.__module__, function.__qualname__ = module, function.__name__
    return jit(function)


@jit
def unbounded(n: int) -> Array:
    """Lower and upper limits ``(2, n)`` that never bind."""
    limits = np.empty((2, n))
    for i in range(n):
        limits[0, i], limits[1, i] = -UNBOUNDED, UNBOUNDED
    return limits


@inlined
def rows_of(params: Array, first: int) -> Entries:
    """Twelve numbers of params: read before a loop, as it might write there for all the compiler knows."""
    p, i = params, first
    return (
        p[i], p[i + 1], p[i + 2], p[i + 3], p[i + 4], p[i + 5], p[i + 6], p[i + 7], p[i + 8], p[i + 9], p[i + 10],
        p[i + 11],
    )  # fmt: skip


@inlined
def turned_by(k: Entries, x: float, y: float, z: float) -> Vector:
    """A vector, turned by a transform of which k are the first three rows."""
    return k[0] * x + k[1] * y + k[2] * z, k[4] * x + k[5] * y + k[6] * z, k[8] * x + k[9] * y + k[10] * z


@inlined
def in_base(k: Entries, S: Array, column: int, b: int) -> Vector:
    """A column of the pose of target b, turned by base⁻¹, whose first three rows are k."""
    return turned_by(k, S[column, b], S[column + 4, b], S[column + 8, b])


@inlined
def product_of(k: Entries, T: Entries, t: Entries) -> Entries:
    """k · T · t, row after row, of transforms as their first three rows."""
    u0, u1, u2 = turned_by(k, T[0], T[4], T[8])
    v0, v1, v2 = turned_by(k, T[1], T[5], T[9])
    w0, w1, w2 = turned_by(k, T[2], T[6], T[10])
    p0, p1, p2 = turned_by(k, T[3], T[7], T[11])
    return (
        u0 * t[0] + v0 * t[4] + w0 * t[8], u0 * t[1] + v0 * t[5] + w0 * t[9], u0 * t[2] + v0 * t[6] + w0 * t[10],
        u0 * t[3] + v0 * t[7] + w0 * t[11] + (p0 + k[3]),
        u1 * t[0] + v1 * t[4] + w1 * t[8], u1 * t[1] + v1 * t[5] + w1 * t[9], u1 * t[2] + v1 * t[6] + w1 * t[10],
        u1 * t[3] + v1 * t[7] + w1 * t[11] + (p1 + k[7]),
        u2 * t[0] + v2 * t[4] + w2 * t[8], u2 * t[1] + v2 * t[5] + w2 * t[9], u2 * t[2] + v2 * t[6] + w2 * t[10],
        u2 * t[3] + v2 * t[7] + w2 * t[11] + (p2 + k[11]),
    )  # fmt: skip


@inlined
def canonical_of(k: Entries, t: Entries, S: Array, b: int) -> Entries:
    """base⁻¹ · T · tool⁻¹ of target b, row after row; k and t are the first three rows of base⁻¹ and tool⁻¹."""
    T = (
        S[0, b], S[1, b], S[2, b], S[3, b], S[4, b], S[5, b], S[6, b], S[7, b], S[8, b], S[9, b], S[10, b],
        S[11, b],
    )  # fmt: skip
    return product_of(k, T, t)


@inlined
def shoulder_of(wx: float, wy: float, beside: float) -> tuple[float, float]:
    """X ≥ 0 and 1/r² of a point at (±X, beside), r from the axis of that frame; X is NaN if r is too small."""
    r2 = wx * wx + wy * wy
    r, apart = math.sqrt(r2), abs(beside)
    square = (r - apart) * (r + apart)
    x = math.sqrt(square if square > 0.0 else 0.0)
    return math.nan if r + BEYOND < apart else x, 1.0 / r2


@inlined
def elbow_of(D2: float, a: float, b: float) -> tuple[float, float, float, bool]:
    """The elbow of links a, b whose ends are √D2 apart: c, s ≥ 0, 1/D2; c is NaN if it does not close.

    The last is whether it is so nearly straight or folded, closing or not, or ends so near to the first axis, that
    it needs the careful kernel. See :func:`kin.solvers.planar.two_links`.
    """
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
    close = (far < _STRAIGHT * near_by) | (near_by < _STRAIGHT * far) | (1e-8 * most * most > D2)
    return c if reached else math.nan, s, 1.0 / D2, close & nearly_reached


@inlined
def zyz_pairs(
    S: Array, first: int, step: int, pairs: int, b: int, x: Vector, y: Vector, cosine: float
) -> float:  # fmt: skip
    """The pairs of A, B, C, rows first, first + step, first + 2 step of S, of ``Rz(A) Ry(B) Rz(C)``; sin B ≥ 0.

    x, y: the first two rows of that rotation; cosine: cos B.
    """
    sine = math.sqrt(x[2] * x[2] + y[2] * y[2])
    S[first, b], S[pairs + first, b] = y[2], x[2]
    S[first + step, b], S[pairs + first + step, b] = sine, cosine
    third = first + 2 * step
    S[third, b], S[pairs + third, b] = x[2] * y[0] - y[2] * x[0], x[2] * y[1] - y[2] * x[1]
    return sine


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


@inlined
def single(
    angle_of: Arc, S: Array, first: int, last: int, pairs: int, count: int, sign: float, offset: float
) -> None:
    """S[first:last] ← joint values of the angles whose pairs (y, x) are S[k], S[pairs + k]."""
    shift = _shift(sign, offset)
    for k in range(first, last):
        for b in range(count):
            S[k, b] = wrapped(sign * angle_of(S, k, pairs, b) + shift)


@inlined
def double(
    angle_of: Arc, S: Array, first: int, last: int, pairs: int, count: int, sign: float, offset: float,
    turned: bool,
) -> None:  # fmt: skip
    """As `single`, and S[pairs + k] ← those of the same angles half a turn on, or of the opposite sign."""
    shift = _shift(sign, offset)
    second, other = (sign, wrapped(shift + math.pi)) if turned else (-sign, shift)
    for k in range(first, last):
        for b in range(count):
            angle = angle_of(S, k, pairs, b)
            S[k, b] = wrapped(sign * angle + shift)
            S[pairs + k, b] = wrapped(second * angle + other)
