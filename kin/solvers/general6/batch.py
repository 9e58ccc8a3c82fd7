"""All real solutions of one arm, for one target or many, as plain arrays."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, wrap
from kin.kernels.compile import jit
from kin.kernels.fk import all_finite_pose
from kin.solvers.blocks import one_after_another
from kin.solvers.canonical import inverse_into
from kin.solvers.common import clear
from kin.solvers.general6.cuts import (
    AFTER,
    BEFORE,
    LOOP,
    OFFSET,
    PLACE,
    SHIFT,
    SIGN,
    SIZE,
    SIZE_OF_ARM,
    SLIDES,
    TURN_D,
    TURN_E,
)
from kin.solvers.general6.elimination import QUANTITIES, UNKNOWN, condense, eliminate
from kin.solvers.general6.recovery import monomials, null_vectors, others, polish, values_of
from kin.solvers.general6.roots import ROOTS, coefficients, covers_circle, polynomial_at, zeros
from kin.tolerances import TOLERANCES
from kin.transforms import Array

SOLUTIONS = 16
NOT_FINITE, OPEN, AGREED, PROVED = range(-1, 3)  # what `solve_all` knows of its solutions
_CLOSE = 1e-3  # rad; a solution farther from the root that led to it belongs to another root
_MERGE = TOLERANCES.merge
# Rows are sorted by a weighted sum of cosines, which does not jump where an angle passes ±180°.
_WEIGHTS = np.array([1.0, 0.7548776662, 0.5698402910, 0.4301597090, 0.3247179572, 0.2451223338])
_PROBES = np.array([(math.cos(x), math.sin(x)) for x in (0.2, 1.9, 3.3, 4.4, 5.7)])


@jit
def loop_of(params: Array, T: Array, F: Array) -> None:
    """F ``(6, 3, 4)`` ← the fixed transforms of the loop closed by the target T ``(4, 4)``, in arm sizes."""
    p = params
    for i in range(6):
        for r in range(3):
            for k in range(4):
                F[i, r, k] = p[LOOP + 12 * i + 4 * r + k]
    X, Y = np.empty((3, 4)), np.empty((3, 4))
    inverse_into(T, X)
    for r in range(3):
        X[r, 3] /= p[SIZE_OF_ARM]
    _times(p[BEFORE : BEFORE + 12].reshape(3, 4), X, Y)
    _times(Y, p[AFTER : AFTER + 12].reshape(3, 4), F[int(p[PLACE]) % 6])


@jit
def _times(X: Array, Y: Array, out: Array) -> None:
    """out ← X Y, transforms of which the first three rows are given ``(3, 4)``."""
    for r in range(3):
        for k in range(4):
            total = X[r, 3] if k == 3 else 0.0
            for m in range(3):
                total += X[r, m] * Y[m, k]
            out[r, k] = total


@jit
def solve_cut(params: Array, T: Array, doubtful: bool, out: Array, count: int) -> tuple[int, int, bool]:
    """Add the solutions found with one cut to the first `count` rows of out ``(16, 6)``.

    Returns the number of rows, how many of them this cut has found, and whether discs around its roots prove that
    none is missing.
    """
    F, E = np.empty((6, 3, 4)), np.empty((3, 6, 9))
    B, Q, diagonal = np.empty((QUANTITIES, 9)), np.empty((QUANTITIES, 9)), np.empty(UNKNOWN)
    A, W, vectors = np.empty((2, 6, 9)), np.empty((6, 6)), np.empty((2, 6))
    found, t = np.empty(ROOTS), np.empty(6)
    z, radius = np.empty(ROOTS, dtype=np.complex128), np.empty(ROOTS)
    row, angles, met = np.empty(6), np.empty(SOLUTIONS), np.zeros(SOLUTIONS, dtype=np.bool_)
    shift, slides, size = int(params[SHIFT]), params[SLIDES:SIZE], params[SIZE_OF_ARM]
    third = slides[2] != 0.0
    loop_of(params, T, F)
    eliminate(F, slides, B, Q, diagonal, E)
    for k in range(zeros(E, third, doubtful, z, radius, found)):
        own = False
        for least in range(1, 3):
            # A root that leads to a known solution has a close neighbour: two null vectors span both solutions.
            if own:
                break
            condense(E, math.cos(found[k]), math.sin(found[k]), A, W)
            for m in range(monomials(vectors, null_vectors(W, vectors, least))):
                t[2] = math.tan(0.5 * found[k]) if third else found[k]
                t[3], t[4] = values_of(vectors[m], slides)
                others(F, slides, B, Q, diagonal, t)
                if not polish(F, slides, t):
                    continue
                close = abs(wrap((2.0 * math.atan(t[2]) if third else t[2]) - found[k])) < _CLOSE
                t[3] += TURN_D if slides[3] == 0.0 else 0.0
                t[4] += TURN_E if slides[4] == 0.0 else 0.0
                for i in range(6):
                    j = (i + shift) % 6
                    value = params[SIGN + j] * (t[i] - params[OFFSET + j])
                    row[j] = wrap(value) if slides[i] == 0.0 else value * size
                same = _place_of(row, out, count, slides, shift)
                if same == SOLUTIONS or (same < count and met[same]):
                    continue
                if same == count:
                    for i in range(6):
                        out[count, i] = row[i]
                    count += 1
                met[same] = True
                own = own or close
    number, joint = 0, (2 + shift) % 6
    for k in range(count):
        number += 1 if met[k] else 0
        value = params[SIGN + joint] * out[k, joint]
        angles[k] = (
            2.0 * math.atan(value / size + params[OFFSET + joint]) if third else value + params[OFFSET + joint]
        )
    return count, number, covers_circle(z, radius, angles, count)


@jit
def _place_of(row: Array, out: Array, count: int, slides: Array, shift: int) -> int:
    """The first of `count` rows of out ``(16, 6)`` that equals row ``(6,)``; `count` if none does."""
    for k in range(count):
        apart = 0.0
        for i in range(6):
            gap = abs(out[k, i] - row[i])
            apart = max(apart, min(gap, TURN - gap) if slides[(i - shift) % 6] == 0.0 else gap)
        if apart < _MERGE:
            return k
    return count


@jit
def _sort(out: Array, count: int) -> None:
    """Sort the first `count` rows of out by `_WEIGHTS`."""
    key = np.empty(count)
    for k in range(count):
        key[k] = 0.0
        for i in range(6):
            key[k] += _WEIGHTS[i] * math.cos(out[k, i] - i)
    for k in range(1, count):
        j = k
        while j > 0 and key[j - 1] > key[j]:
            key[j - 1], key[j] = key[j], key[j - 1]
            for i in range(6):
                out[j - 1, i], out[j, i] = out[j, i], out[j - 1, i]
            j -= 1


@jit
def solve_all(params: Array, T: Array, out: Array) -> int:
    """out ``(16, 6)`` ← all solutions of the target T ``(4, 4)``, then NaN; returns OPEN, AGREED or PROVED.

    A cut whose discs prove that none is missing ends the search. Else the next one is asked too, until one has
    found the same as those before it. With an odd number, or none, the first cut is tried with doubtful roots.
    """
    clear(out)
    if not all_finite_pose(T):
        return NOT_FINITE
    count, before, known = 0, -1, OPEN
    cuts = params.shape[0] // SIZE
    for k in range(cuts):
        count, found, proved = solve_cut(params[k * SIZE : (k + 1) * SIZE], T, False, out, count)
        if count % 2 == 0 and proved:
            known = PROVED
            break
        if count > 0 and count % 2 == 0 and found == count == before:
            known = AGREED
            break
        before = count
    if count == 0 or count % 2 == 1:
        count = solve_cut(params[:SIZE], T, True, out, count)[0]
    _sort(out, count)
    return known


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(16, 6)`` ← all solutions of the target T ``(4, 4)``, then NaN; False if T is not finite.

    `value` and `near` are not used: a pose leaves nothing free.
    """
    return solve_all(params, T, out) != NOT_FINITE


branches_many = one_after_another(branches_one)


@jit
def misfit_of_degree(params: Array, T: Array) -> float:
    """How far det Z is from a trigonometric polynomial of degree eight, relative to its largest coefficient.

    It is one where the cut is valid. In a degenerate cut the determinant vanishes identically, up to rounding.
    """
    F, E = np.empty((6, 3, 4)), np.empty((3, 6, 9))
    B, Q, diagonal = np.empty((QUANTITIES, 9)), np.empty((QUANTITIES, 9)), np.empty(UNKNOWN)
    re, im = np.empty(ROOTS + 1), np.empty(ROOTS + 1)
    A, W = np.empty((2, 6, 9), dtype=np.complex128), np.empty((6, 6), dtype=np.complex128)
    slides = params[SLIDES:SIZE]
    third = slides[2] != 0.0
    loop_of(params, T, F)
    eliminate(F, slides, B, Q, diagonal, E)
    scale = coefficients(E, third, re, im)
    worst = 0.0
    for k in range(_PROBES.shape[0]):
        z = complex(_PROBES[k, 0], _PROBES[k, 1])
        if third and z.real < 0.0:  # too small a determinant to be divided
            continue
        predicted = 0.0 + 0.0j
        for n in range(ROOTS, -1, -1):
            predicted = predicted * z + complex(re[n], im[n])
        worst = max(worst, abs(polynomial_at(E, third, z, A, W) / scale - predicted))
    return worst
