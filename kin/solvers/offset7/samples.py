"""Kernels that sample the branches of an elbow, more closely where a joint may pass a limit.

All branches of an elbow are sampled together: those of one side of the plane of chain axes 2 and 3 and those of
the other make two *chains* of samples, each in the order of the given joint's values. First, the places where
branches exist. Then, pass after pass, an interval between samples is divided if it is *in doubt*: if one of the
joints turns by more, there or beside, than it is away from its limit. A pass looks only at neighbourhoods of
intervals that the one before has divided: elsewhere nothing has changed. The neighbourhoods are packed one behind
the other, so that vector instructions handle them, too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.kernels.simd import wrapped
from kin.solvers.blocks import Entries
from kin.solvers.offset7.lanes import (
    ANGLES,
    ELBOW,
    FIRST,
    JOINTS,
    MARGIN,
    MOST,
    SECOND,
    SIDE,
    SPACE,
    STRIDE,
    VALUE,
    Angles,
    insides,
    lanes,
    limits_of,
)
from kin.solvers.offset7.search import Target
from kin.transforms import Array

Whole = NDArray[np.int64]

# Offsets of the columns of samples: value, how far inside the arm's reach, slack of both branches.
LENGTH = 2 * STRIDE
X, REACH, ONE, OTHER = range(0, 4 * LENGTH, LENGTH)
SAMPLES_SPACE = 4 * LENGTH
PLACES = MOST // 2 - 2  # at most: both sides have to fit into the lanes
# A pass works on lanes with one more column, which says whose sample it is: −1.0 between neighbourhoods, where the
# value is NaN and no branch exists.
_WHOSE = SPACE
PASS_SPACE = SPACE + STRIDE
_PARTS = 4  # of an interval in doubt
# The maximum joint step between samples where a joint may pass a limit, in each pass.
_LONGEST = (0.0, 0.0, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05)
# Scratch of a pass: the step of each joint from sample to sample, how much an interval is in doubt (behind the
# steps), and the most of those around a sample.
_AROUND = 3
_DOUBT, _MOST_DOUBT = JOINTS * STRIDE + _AROUND, (JOINTS + 1) * STRIDE
DOUBT_SPACE = (JOINTS + 2) * STRIDE


@jit
def sample(
    target: Target, elbow: float, places: Array, m: int, S: Array, after: Whole, passes: tuple[Array, Array],
    fresh: Array, D: Array,
) -> None:  # fmt: skip
    """S ``(SAMPLES_SPACE,)`` ← samples of an elbow (±1.0), after ``(LENGTH,)`` ← which follows each, −1 at an end.

    places ``(2, ≥ m)``: values and margins, as from `places_of`. The first chain, of the positive side, begins at
    sample 0, the other at sample m. passes, fresh, D: scratch ``(PASS_SPACE,)``, ``(SPACE,)``, ``(DOUBT_SPACE,)``.
    """
    params, T, box, setup = target
    W, V = passes
    n = _first_pass(elbow, places, m, S, after, W)
    lanes(params, T, box, setup, W, n)
    for i in range(n):
        k = int(W[_WHOSE + i])
        if k >= 0:
            S[ONE + k], S[OTHER + k] = W[FIRST + i], W[SECOND + i]
    size = 2 * m
    for least in _LONGEST:
        _doubts(setup, W, n, D)
        n, more = _next_pass(least, W, n, D, S, after, size, V, fresh)
        if more == 0:
            break
        lanes(params, T, box, setup, fresh, more)
        _spread(fresh, more, S, size, V)
        size += more
        W, V = V, W


@jit
def _first_pass(elbow: float, places: Array, m: int, S: Array, after: Whole, W: Array) -> int:
    """Both chains of the places; W ← those where branches exist, with a gap behind each run; their number."""
    n = 0
    for side in range(2):
        runs = False
        for i in range(m):
            k, margin = side * m + i, places[1, i]
            S[X + k], S[REACH + k], S[ONE + k], S[OTHER + k] = places[0, i], margin, margin, margin
            after[k] = k + 1
            if margin >= 0.0:
                W[VALUE + n], W[ELBOW + n], W[SIDE + n], W[_WHOSE + n] = places[0, i], elbow, 1.0 - 2.0 * side, k
                n += 1
            elif runs:
                n = _gap(W, n)
            runs = margin >= 0.0
        after[(side + 1) * m - 1] = -1
        if runs:
            n = _gap(W, n)
    return n


@inlined
def _gap(W: Array, n: int) -> int:
    """Append a gap to the n entries of a pass; returns their number."""
    W[VALUE + n], W[ELBOW + n], W[SIDE + n], W[MARGIN + n], W[_WHOSE + n] = math.nan, 1.0, 1.0, -1.0, -1.0
    return n + 1


@inlined
def _angles(W: Array, i: int) -> Angles:
    """The angles of entry i."""
    k = ANGLES + i
    return W[k], W[k + STRIDE], W[k + 2 * STRIDE], W[k + 3 * STRIDE], W[k + 4 * STRIDE], W[k + 5 * STRIDE]


@inlined
def _doubt(here: Angles, there: Angles, moved: Angles, second: bool, h: Entries) -> float:
    """The largest step of a joint that may pass a limit between two samples; 0.0 if none may or one stays out."""
    a, b = insides(here, second, h), insides(there, second, h)
    most, out = 0.0, False
    for j in range(JOINTS):
        near = min(abs(a[j]), abs(b[j]))
        sure = near >= moved[j]
        out = out | (sure & (a[j] < 0.0) & (b[j] < 0.0))
        most = most if sure else max(most, moved[j])
    return 0.0 if out else most


@inlined
def _around(D: Array, j: int, i: int) -> float:
    """The largest step of joint j between entries i and i + 1 and the two intervals beside."""
    k = j * STRIDE + i
    return float(max(D[k], max(D[k + 1], D[k + 2])))


@jit
def _doubts(setup: Array, W: Array, n: int, D: Array) -> None:
    """D[_DOUBT + i] ← the larger `_doubt` of both branches between entries i and i + 1, D[_MOST_DOUBT + i] ← the
    largest one from three intervals before entry i to three after it."""
    h = limits_of(setup)
    for j in range(JOINTS):
        a, d = ANGLES + j * STRIDE, j * STRIDE
        for i in range(n - 1):
            exists = (W[MARGIN + i] >= 0.0) & (W[MARGIN + i + 1] >= 0.0)
            D[d + i + 1] = abs(wrapped(W[a + i + 1] - W[a + i])) if exists else 0.0
        D[d] = D[d + n] = 0.0
    for i in range(n - 1):
        moved = (
            _around(D, 0, i), _around(D, 1, i), _around(D, 2, i),
            _around(D, 3, i), _around(D, 4, i), _around(D, 5, i),
        )  # fmt: skip
        here, there = _angles(W, i), _angles(W, i + 1)
        doubt = max(_doubt(here, there, moved, False, h), _doubt(here, there, moved, True, h))
        exists = (W[MARGIN + i] >= 0.0) & (W[MARGIN + i + 1] >= 0.0)
        D[_DOUBT + i] = doubt if exists else 0.0
    for i in range(_AROUND):
        D[_DOUBT - 1 - i] = D[_DOUBT + n - 1 + i] = 0.0
    for i in range(n):
        k = _DOUBT - _AROUND + i
        before, behind = max(D[k], max(D[k + 1], D[k + 2])), max(D[k + 3], max(D[k + 4], D[k + 5]))
        D[_MOST_DOUBT + i] = max(before, behind)


@jit
def _next_pass(
    least: float, W: Array, n: int, D: Array, S: Array, after: Whole, size: int, V: Array, fresh: Array
) -> tuple[int, int]:
    """V ← the neighbourhoods of those of the n entries of W that are in doubt, with new samples between them.

    fresh ← the new samples as lanes, from `size` on in S; returns the numbers of entries and of new samples.
    """
    count = more = 0
    gap = True
    for i in range(n):
        if not D[_MOST_DOUBT + i] > least:
            if not gap:
                count, gap = _gap(V, count), True
            continue
        for column in range(0, PASS_SPACE, STRIDE):
            V[column + count] = W[column + i]
        gap, count = W[_WHOSE + i] < 0.0, count + 1
        if D[_DOUBT + i] > least and count + n - i + 2 * _PARTS < MOST and size + more + _PARTS < LENGTH:
            k, x = int(W[_WHOSE + i]), W[VALUE + i]
            last = after[k]
            for part in range(1, _PARTS):
                value, whose = x + (W[VALUE + i + 1] - x) * part / _PARTS, size + more
                fresh[VALUE + more], fresh[ELBOW + more], fresh[SIDE + more] = value, W[ELBOW + i], W[SIDE + i]
                S[X + whose], S[REACH + whose] = value, 0.0
                V[VALUE + count], V[ELBOW + count], V[SIDE + count] = value, W[ELBOW + i], W[SIDE + i]
                V[MARGIN + count], V[_WHOSE + count] = 0.0, whose
                after[k], k = whose, whose
                count, more = count + 1, more + 1
            after[k] = last
    return count, more


@jit
def _spread(fresh: Array, more: int, S: Array, size: int, V: Array) -> None:
    """What `lanes` gave of the new samples: slacks into S, angles into V."""
    i = 0
    for b in range(more):
        k = size + b
        S[ONE + k], S[OTHER + k] = fresh[FIRST + b], fresh[SECOND + b]
        while V[_WHOSE + i] != k:
            i += 1
        for column in range(ANGLES, SPACE, STRIDE):
            V[column + i] = fresh[column + b]


@jit
def in_order(S: Array, after: Whole, k: int, out: Array) -> int:
    """out ``(SAMPLES_SPACE,)`` ← the samples of the chain that begins at sample k; returns their number."""
    n = 0
    while k >= 0:
        for column in range(0, SAMPLES_SPACE, LENGTH):
            out[column + n] = S[column + k]
        n, k = n + 1, after[k]
    return n
