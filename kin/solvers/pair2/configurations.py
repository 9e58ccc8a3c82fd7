"""Kernels: the configurations of one target, and of many."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.kernels.compile import jit
from kin.kernels.fk import all_finite_pose
from kin.solvers.blocks import each_solved, one_after_another
from kin.solvers.common import clear
from kin.solvers.contract import POSE, POSITION
from kin.solvers.pair2.geometry import (
    FIXED,
    JOINTS,
    MOST,
    SCALE,
    TASK,
    TURNS,
    WAVE,
    before_joint_1,
    invariants,
    is_kept,
    main_direction,
    moved,
    see,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_DECIDES = 1e-3  # of the arm's size: joint 2 moves the point enough to follow from it
_POLISH = 4
GONE = 1e-2  # of the arm's size: a point that is missed by more is not reached, however rounded it is
REACH = TOLERANCES.reach
_FLOOR = 4e-16  # of the squared length of the derivatives: a floor where they are singular
_TINY = TOLERANCES.singular
_ALIKE = 100.0
OFF, OPEN = 0, 1  # columns of what is notes of a configuration


@jit
def configurations(
    params: Array, T: Array, task: int, near: Array, gone: float, out: Array, notes: Array
) -> None:  # fmt: skip
    """out ``(rows, n)`` ← the configurations of a target, NaN where they miss its point by more than `gone` (m).

    What a task leaves free is near ``(n,)``. notes ``(rows, 2)`` ← by how many metres each misses the point, and
    1.0 where joint 1 may have any value: what the task keeps is on axis 1.
    """
    n, rows = int(params[JOINTS]), out.shape[0]
    seen, v, J = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 2))
    q = np.zeros(2)
    see(params, T, seen)
    for row in range(rows):
        q[1], x, y = _second(params, seen, task, near, 1.0 - 2.0 * row)
        before_joint_1(params, x, y, v)
        q[0], notes[row, OPEN] = _first(params, v, seen, task, near[0])
        off = _polish(params, q, seen, task, v, J)
        if off > REACH:  # the point comes first where the directions cannot be met as well
            off = _polish(params, q, seen, POSITION, v, J)
        notes[row, OFF] = off
        for i in range(n):
            turned = wrap(q[i]) if params[TURNS + i] else q[i]
            out[row, i] = turned if off <= gone else math.nan


@jit
def _second(params: Array, seen: Array, task: int, near: Array, side: float) -> tuple[float, float, float]:
    """Joint 2, x and y from what joint 1 does not change; `side`: 1.0 for the first row, −1.0 for the second."""
    if params[JOINTS] == 1.0:
        return 0.0, 0.0, 0.0
    if not params[TURNS + 1]:
        d = _slide(params, seen, side)
        return d * params[SCALE], d, 0.0
    A, b = np.empty((MOST, 2)), np.empty(MOST)
    m = invariants(params, seen, POSITION, A, b)
    x, y, along = main_direction(A, m)
    if along < _DECIDES:
        m = invariants(params, seen, task, A, b)
        x, y, along = main_direction(A, m)
    last = near[1]
    if along >= _TINY:
        cosine = 0.0
        for i in range(m):
            cosine += b[i] * (A[i, 0] * x + A[i, 1] * y)
        last = math.atan2(y, x) + side * math.acos(min(max(cosine / along**2, -1.0), 1.0))
    return last, math.cos(last), math.sin(last)


@jit
def _slide(params: Array, seen: Array, side: float) -> float:
    """Joint 2 in arm sizes, if it slides."""
    a, u, p = params[FIXED : FIXED + 3], params[WAVE : WAVE + 3], seen[0]
    if not params[TURNS]:
        square = u[0] * u[0] + u[1] * u[1]
        return float(((p[0] - a[0]) * u[0] + (p[1] - a[1]) * u[1]) / square)
    # The distance from a point of axis 1: d² + 2 d (a · u) + a² = p².
    half = a[0] * u[0] + a[1] * u[1] + a[2] * u[2]
    left = half * half
    for i in range(3):
        left += p[i] * p[i] - a[i] * a[i]
    return float(side * math.sqrt(max(left, 0.0)) - half)


@jit
def _first(params: Array, v: Array, seen: Array, task: int, near: float) -> tuple[float, float]:
    """Joint 1 from where the point, or else the directions, are before it moves them, and after.

    Where all of them are on axis 1 it is `near`, and the second number is 1.0.
    """
    if not params[TURNS]:
        return (seen[0, 2] - v[0, 2]) * params[SCALE], 0.0
    for first, last in ((0, 1), (1, 4)):
        sine = cosine = length = 0.0
        for k in range(first, last):
            if is_kept(task, k):
                sine += v[k, 0] * seen[k, 1] - v[k, 1] * seen[k, 0]
                cosine += v[k, 0] * seen[k, 0] + v[k, 1] * seen[k, 1]
                length += seen[k, 0] * seen[k, 0] + seen[k, 1] * seen[k, 1]
        if math.sqrt(length) > _TINY:
            return math.atan2(sine, cosine), 0.0
    return near, 1.0


@jit
def _missed(params: Array, q: Array, seen: Array, task: int, v: Array, J: Array) -> float:
    """The error of what the task keeps, in arm sizes; v ``(4, 3)``, J ``(4, 3, 2)`` ← error and derivatives."""
    moved(params, q, v, J)
    total = 0.0
    for k in range(4):
        for r in range(3):
            v[k, r] = seen[k, r] - v[k, r]
            if is_kept(task, k):
                total += v[k, r] * v[k, r]
    return math.sqrt(total)


@jit
def _step(task: int, n: int, e: Array, J: Array) -> tuple[float, float]:
    """The Gauss–Newton step of both joints: the larger column of J first, what is left of the other after it."""
    aa = ab = bb = ae = be = 0.0
    for k in range(4):
        if is_kept(task, k):
            for r in range(3):
                a, b = J[k, r, 0], J[k, r, 1]
                aa, ab, bb = aa + a * a, ab + a * b, bb + b * b
                ae, be = ae + a * e[k, r], be + b * e[k, r]
    floor = _FLOOR * (aa + bb) + _FLOOR**2
    swap = n == 2 and bb > aa
    if swap:
        aa, bb, ae, be = bb, aa, be, ae
    if n == 1 or aa == 0.0:
        return ae / (aa + floor), 0.0
    # The second column without its part along the first, summed anew: the difference would lose its digits.
    share = ab / aa
    rest = left = 0.0
    for k in range(4):
        if is_kept(task, k):
            for r in range(3):
                a, b = J[k, r, 1 if swap else 0], J[k, r, 0 if swap else 1]
                c = b - share * a
                rest, left = rest + c * c, left + c * e[k, r]
    second = left / (rest + floor)
    first = (ae - ab * second) / (aa + floor)
    return (second, first) if swap else (first, second)


@jit
def _polish(params: Array, q: Array, seen: Array, task: int, v: Array, J: Array) -> float:
    """Gauss–Newton steps from q ``(2,)`` if it nearly meets the task; how far it misses the point, in metres.

    A double root is as precise as the root of the rounding.
    """
    n, scale, there = int(params[JOINTS]), params[SCALE], np.zeros(2)
    least = _missed(params, q, seen, task, v, J)
    for _ in range(_POLISH):
        if not least < _DECIDES:
            break
        first, second = _step(task, n, v, J)
        there[0] = q[0] + first * (1.0 if params[TURNS] else scale)
        there[1] = q[1] + second * (1.0 if params[TURNS + 1] else scale)
        left = _missed(params, there, seen, task, v, J)
        if not left < least:
            break
        q[0], q[1] = there[0], there[1]
        least = left
    moved(params, q, v, J)
    total = 0.0
    for r in range(3):
        total += (v[0, r] - seen[0, r]) ** 2
    return float(math.sqrt(total) * scale)


@jit
def solve(params: Array, T: Array, task: int, near: Array, out: Array, notes: Array) -> None:
    """out ``(rows, n)`` ← the configurations that meet the point of a target as nearly as the arm can.

    NaN where there is none; notes as in `configurations`. With rounded numbers all rows miss the point about
    alike: one that misses it by far more is none.
    """
    configurations(params, T, task, near, GONE * params[SCALE], out, notes)
    least = notes[0, OFF]
    for row in range(1, notes.shape[0]):
        if notes[row, OFF] < least or math.isnan(notes[row, OFF]):
            least = notes[row, OFF]
    for row in range(out.shape[0]):
        if notes[row, OFF] > max(REACH, _ALIKE * least):
            for i in range(out.shape[1]):
                out[row, i] = math.nan


@jit
def _solve_pose(
    params: Array, T: Array, request: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> None:
    """`solve` for a pose."""
    solve(params, T, POSE, near, out, np.empty((out.shape[0], 2)))


solve_many = each_solved(_solve_pose, math.nan, 0)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(rows, n)`` ← all configurations of the target T ``(4, 4)``; False if T is not finite."""
    if not all_finite_pose(T):
        clear(out)
        return False
    configurations(params, T, int(params[TASK]), near, REACH, out, np.empty((out.shape[0], 2)))
    return True


branches_many = one_after_another(branches_one)
