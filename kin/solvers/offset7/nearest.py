"""Kernels that choose the value of the given joint at which the joints move least from the seed.

On each feasible interval of a branch the squared distance from the seed is sampled, with its derivative, and more
closely where joints turn far from sample to sample: beside a singularity the nearest value may be in a narrow dip.
Between samples where the derivative changes its sign, and at ends of intervals, may be minima; all of them
are refined at the same time, see :mod:`kin.solvers.srs7.minima`. Derivatives are differences over a hair, since
joints are computed at hundreds of values in the time of a few.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import jit
from kin.kernels.simd import rounded, wrapped
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.offset7.lanes import ANGLES, ELBOW, STRIDE, VALUE, lanes
from kin.solvers.offset7.lanes import SIDE as LANE_SIDE
from kin.solvers.offset7.search import Target
from kin.solvers.srs7.minima import (
    AT,
    BRANCH,
    DIP,
    FIRST_END,
    FLIP,
    FROM,
    LANE_ROWS,
    LANES,
    LAST_END,
    RATE,
    SIDE,
    STEPS,
    TO,
    F,
    G,
    begin,
    best_of,
    finish,
    promising,
    step,
    whole_vectors,
)
from kin.solvers.srs7.redundancy import image_of
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_INSET = TOLERANCES.interval_inset
_HAIR = 1e-6  # rad, half of what derivatives are differences over
_APART = 0.1  # rad between samples
_CLOSE = 1e-6  # rad; a shorter step ends the refinement
_FEW, _SAMPLES = 192, 504  # most samples, first and then: two lanes are computed for each
_WAY, _PIECES = 0.3, 12  # rad that the joints may turn between samples, or so many parts of it
_JOINTS = 6
# Rows of samples: those of a lane, and the steps of the joints but for the given one.
_STEP, _SAMPLE_ROWS = LANE_ROWS, LANE_ROWS + _JOINTS


@jit
def _evaluate(target: Target, seed: tuple[float, float], middle: Array, count: int, L: Array, S: Array) -> None:
    """Rows F, G and RATE of `count` lanes ← at their values of the given joint; S ``(SPACE,)``: scratch.

    If L has rows for the steps of the joints, these too.
    """
    params, T, box, setup = target
    value, weight = seed
    for b in range(count):
        x, elbow, side = L[AT, b], 1.0 - 2.0 * float(int(L[BRANCH, b]) >> 2), L[SIDE, b]
        least, most = max(x - _HAIR, L[FROM, b]), min(x + _HAIR, L[TO, b])
        S[VALUE + b], S[ELBOW + b], S[LANE_SIDE + b] = least, elbow, side
        S[VALUE + count + b], S[ELBOW + count + b], S[LANE_SIDE + count + b] = most, elbow, side
    lanes(params, T, box, setup, S, 2 * count)
    for b in range(count):
        below, above = S[VALUE + b], S[VALUE + count + b]
        x = L[AT, b] - value
        L[F, b], L[G, b], L[RATE, b] = weight * (x * x), weight * x, weight
        S[VALUE + b] = 1.0 / (above - below) if above > below else 0.0
    for k in range(6):
        # Angles of a lane are those of chain joints 2, 3, 4, 5, 7 and 6; only the last three differ by the flip.
        joint = k if k < 4 else 9 - k
        near, low, high, mid = box[NEAR, joint + 1], box[LOW, joint + 1], box[HIGH, joint + 1], middle[joint]
        column = ANGLES + k * STRIDE
        turns, mirrored = (1.0 if k == 3 or k == 4 else 0.0), k == 5
        for b in range(count):
            flipped = 0.5 - 0.5 * L[FLIP, b]
            sign = L[FLIP, b] if mirrored else 1.0
            shift = mid + turns * flipped * math.pi
            _, y = image_of(sign * S[column + b] + shift, near, low, high)
            _, z = image_of(sign * S[column + count + b] + shift, near, low, high)
            # Where the image jumps in between, the nearer one counts.
            jump = abs(z - y) > 1.0
            turns_between = TURN * rounded((z - y) / TURN) if jump else 0.0
            rate = (z - y - turns_between) * S[VALUE + b]
            at = (y if abs(y) < abs(z) else z) if jump else 0.5 * (y + z)
            L[F, b] += at * at
            L[G, b] += at * rate
            L[RATE, b] += rate * rate
            S[column + b] = at
        if L.shape[0] > LANE_ROWS:
            for b in range(count):
                L[_STEP + k, b] = S[column + b]


@jit
def _add(D: Array, i: int, x: float, count: int, L: Array) -> int:
    """Append a lane for the interval that sample i of D is in; returns the number of lanes."""
    if count < LANES:
        for r in range(LANE_ROWS):
            L[r, count] = D[r, i]
        L[AT, count] = x
        count += 1
    return count


@jit
def nearest_values(
    target: Target, seed: tuple[float, float], arcs: Array, found: int, chosen: Array, S: Array
) -> None:
    """chosen ``(8,)`` ← of each branch with an interval the value of the given joint nearest to the seed.

    seed: its value, and what a step of the given joint counts. arcs: `found` rows (branch, low, high). S
    ``(SPACE,)``: scratch.
    """
    box, middle, least = target[2], np.empty(6), np.full(8, math.inf)
    for i in range(6):
        low, high = box[LOW, i + 1], box[HIGH, i + 1]
        middle[i] = 0.5 * (low + high) if high - low < 2.0 * math.pi and i != 4 else 0.0
    few, D = np.empty((_SAMPLE_ROWS, _FEW)), np.empty((LANE_ROWS, _SAMPLES))
    L = np.empty((LANE_ROWS, LANES))
    n = _sampled(arcs, found, few)
    if n == 0:
        return
    _evaluate(target, seed, middle, n, few, S)
    for i in range(n):
        k = int(few[BRANCH, i])
        least[k] = min(least[k], few[F, i])
    n = _closer(few, n, least, D)
    _evaluate(target, seed, middle, n, D, S)
    count = _starts(D, n, seed[0], least, L)
    begin(count, L)
    for k in range(STEPS):
        filled = whole_vectors(count, L)
        _evaluate(target, seed, middle, filled, L, S)
        if step(filled, k == 0, L) < _CLOSE:
            break
        if k == 1:
            count = promising(count, L)
    finish(count, L)
    for k in range(8):
        chosen[k], _ = best_of(k, chosen[k], count, L)


@jit
def _sampled(arcs: Array, found: int, few: Array) -> int:
    """few ← values over the intervals arcs ``(found, 3)``, ends included, in order; returns their number."""
    total, n = 0.0, 0
    for i in range(found):
        total += arcs[i, 2] - arcs[i, 1]
    apart = max(_APART, total / max(few.shape[1] - 3 * found, 1))
    for i in range(found):
        low, high, k = arcs[i, 1], arcs[i, 2], int(arcs[i, 0])
        inset = min(_INSET, 0.5 * (high - low))
        low, high = low + inset, high - inset
        pieces = math.ceil((high - low) / apart)
        if n + pieces < few.shape[1]:
            for j in range(pieces + 1):
                few[AT, n] = high if j == pieces else low + (high - low) * j / pieces
                few[FROM, n] = few[FIRST_END, n] = low
                few[TO, n] = few[LAST_END, n] = high
                few[BRANCH, n], few[SIDE, n], few[FLIP, n] = k, 1.0 - 2.0 * ((k >> 1) & 1), 1.0 - 2.0 * (k & 1)
                n += 1
    return n


@jit
def _closer(few: Array, count: int, least: Array, D: Array) -> int:
    """D ← the samples, and others between neighbours where joints turn so far that they may come below `least`.

    least ``(8,)``: F of the best sample of each branch. Returns the number of samples.
    """
    n = 0
    for i in range(count):
        for r in range(LANE_ROWS):
            D[r, n] = few[r, i]
        n += 1
        if few[AT, i] == few[LAST_END, i] or i + 1 == count:
            continue
        width, turned = few[AT, i + 1] - few[AT, i], 0.0
        for k in range(_STEP, _SAMPLE_ROWS):
            turned += wrapped(few[k, i + 1] - few[k, i]) ** 2
        way = math.sqrt(max(width * width * max(few[RATE, i], few[RATE, i + 1]), turned))
        nearest = 0.5 * (math.sqrt(few[F, i]) + math.sqrt(few[F, i + 1]) - way)
        if way > _WAY and (nearest <= 0.0 or nearest * nearest < least[int(few[BRANCH, i])]):
            pieces = int(min(math.ceil(way / _WAY), _PIECES))
            for j in range(1, pieces):
                if n + count - i < D.shape[1]:
                    for r in range(LANE_ROWS):
                        D[r, n] = few[r, i]
                    D[AT, n] += width * j / pieces
                    n += 1
    return n


@jit
def _starts(D: Array, n: int, seed: float, least: Array, L: Array) -> int:
    """Append lanes for the minima that n samples tell; returns how many. least ``(8,)`` is lowered to them."""
    for i in range(n):
        k = int(D[BRANCH, i])
        least[k] = min(least[k], D[F, i])
    count = 0
    for i in range(n):
        most = least[int(D[BRANCH, i])] + DIP
        first, last = D[AT, i] == D[FIRST_END, i], D[AT, i] == D[LAST_END, i]
        if first and D[FIRST_END, i] <= seed <= D[LAST_END, i]:
            count = _add(D, i, seed, count, L)  # so that a seed that meets the target is found to the last digit
        uphill, downhill = first and D[G, i] >= 0.0, last and D[G, i] <= 0.0
        if (uphill or downhill) and D[F, i] < most:
            count = _add(D, i, D[AT, i], count, L)
        if last or i + 1 == n:
            continue
        f, g, other, slope = D[F, i], D[G, i], D[F, i + 1], D[G, i + 1]
        if g < 0.0 < slope:
            if min(f, other) < most:
                share = g / (g - slope)
                count = _add(D, i, D[AT, i] + share * (D[AT, i + 1] - D[AT, i]), count, L)
        # Downhill from one sample, but the other one is higher: in between the image of a joint jumps.
        elif g < 0.0 and f < min(other, most):
            count = _add(D, i, D[AT, i], count, L)
        elif slope > 0.0 and other < min(f, most):
            count = _add(D, i, D[AT, i + 1], count, L)
    return count
