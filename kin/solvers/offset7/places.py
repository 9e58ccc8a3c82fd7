"""Kernels for the values of the given joint at which branches are sampled, and for where branches exist.

How far inside the arm's reach a branch is, its *reach margin*, depends on the elbow alone and costs little.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.offset7.branches import distances, seen, two_roots
from kin.solvers.offset7.geometry import OFFSET, SIGN
from kin.solvers.offset7.lanes import reach_margins
from kin.solvers.offset7.search import EITHER, LEVEL, Target, Whole, edge, peak, turns
from kin.transforms import Array

SAMPLES = 96  # of a whole turn
# How far from an end of the reach branches are looked at, and the most places where.
_BESIDE = (1e-9, -1e-9, 1e-5, -1e-5, 1e-4, -1e-4, 1e-3, -1e-3, 4e-3, -4e-3, 0.015, -0.015)
_MOST_ENDS = 64
_MOST_TURNS = 64  # peaks and dips of the margin
# Places for all of these; if rounding makes up edges, the last ones have no places beside them.
_RESERVED = 256
# Shares of an interval between samples, from where a branch begins to exist.
_FROM_EDGE = np.array([1e-4, 1e-3, 0.01, 0.03, 0.08, 0.15, 0.25, 0.4, 0.6, 0.8])


@jit
def marks_of(params: Array, T: Array, span: tuple[float, float], wanted: float) -> Array:
    """Values over the range of the given joint, the wanted one, and those beside ends of the reach; sorted."""
    low, high = span
    n = max(8, math.ceil(SAMPLES * (high - low) / (2.0 * math.pi))) + 1 if high > low else 1
    every = np.empty(n + 1 + _MOST_ENDS)
    for i in range(n):
        every[i] = low + (high - low) * i / (n - 1) if n > 1 else low
    if n > 1:
        n = _insert(every, n, min(max(wanted, low), high))
        n = _insert_ends(params, T, span, every, n)
    return every[:n]


@jit
def _insert(marks: Array, n: int, value: float) -> int:
    """Insert a value into the n sorted marks, if it is not there and there is space; returns their number."""
    i = n
    while i > 0 and marks[i - 1] > value:
        i -= 1
    if n == marks.shape[0] or (i > 0 and marks[i - 1] == value):
        return n
    for j in range(n, i, -1):
        marks[j] = marks[j - 1]
    marks[i] = value
    return n + 1


@jit
def _insert_ends(params: Array, T: Array, span: tuple[float, float], marks: Array, n: int) -> int:
    """Insert values beside those where the wrist centre is as far or as near as it can be; returns the number.

    Its squared distance is a sinusoid of the given joint's angle.
    """
    low, high = span
    M, square, roots = np.empty((3, 4)), np.empty(3), np.empty(2)
    for i in range(3):
        seen(params, T, 2.0 * math.pi * i / 3.0, M)
        square[i] = M[0, 3] * M[0, 3] + M[1, 3] * M[1, 3] + M[2, 3] * M[2, 3]
    mean = (square[0] + square[1] + square[2]) / 3.0
    cosine, sine = square[0] - mean, (square[1] - square[2]) / math.sqrt(3.0)
    constant, a, b = distances(params)
    for end in range(2):
        bound = constant + (2.0 - 4.0 * end) * math.sqrt(a * a + b * b)
        if two_roots(cosine, sine, bound - mean, 0.0, roots) < 0.0 or math.isnan(roots[0]):
            continue
        for i in range(2):
            first = params[SIGN] * (roots[i] - params[OFFSET])
            first += 2.0 * math.pi * math.ceil((low - first) / (2.0 * math.pi))
            for beside in _BESIDE:
                if low <= first + beside <= high:
                    n = _insert(marks, n, first + beside)
    return n


@jit
def places_of(target: Target, elbow: float, marks: Array, out: Array, coarse: Whole) -> int:
    """out ``(2, m)`` ← values at which branches are sampled, and the margin there; returns their number.

    Those are the marks ``(n,)``, and values beside where the branches of the elbow begin to exist.
    coarse ``(n,)`` ← the places of the marks.
    """
    n = marks.shape[0]
    every, margin, level = np.empty(n + _MOST_TURNS), np.empty(n + _MOST_TURNS), np.empty(out.shape[1])
    for i in range(n):
        every[i] = marks[i]
    reach_margins(target[3], marks, elbow, margin, level)
    count = _insert_turns(target, LEVEL, elbow, marks, level, every, n)
    count = _insert_turns(target, EITHER, elbow, marks, margin, every, count)
    if count > n:
        reach_margins(target[3], every[:count], elbow, margin, level)
    m = j = 0
    for i in range(count):
        if i > 0 and (margin[i - 1] >= 0.0) != (margin[i] >= 0.0) and m < out.shape[1] - _RESERVED:
            m = _append_edge(target[3], elbow, every[:count], margin, i, out, m)
        out[0, m] = every[i]
        if j < n and every[i] == marks[j]:
            coarse[j] = m
            j += 1
        m += 1
    reach_margins(target[3], out[0, :m], elbow, out[1], level)
    return m


@jit
def _insert_turns(
    target: Target, what: int, elbow: float, marks: Array, f: Array, every: Array, count: int
) -> int:
    """Insert the peaks and dips of f ``(n,)``, `reach_margin` or `level_margin` at the marks, that pass zero.

    every ``(≥ count,)``: the sorted marks, with those inserted before; returns the new count.
    """
    n = marks.shape[0]
    sense = np.empty(n)
    turns(marks, f, sense)
    for i in range(1, n - 1):
        if sense[i] != 0.0:
            x, top = peak(target, what, elbow, marks[i - 1], marks[i + 1], sense[i])
            if (top >= 0.0) != (f[i] >= 0.0):
                count = _insert(every, count, x)
    return count


@jit
def _append_edge(setup: Array, elbow: float, values: Array, margin: Array, i: int, out: Array, m: int) -> int:
    """Append to the m values those of the edge between values i − 1 and i, and beside it; returns their number."""
    opens = margin[i] >= 0.0
    a, b = (i, i - 1) if opens else (i - 1, i)
    c = min(max(2 * a - b, 0), values.shape[0] - 1)  # the value behind the one inside
    x, y = edge(setup, elbow, (values[a], margin[a], values[b], margin[b], values[c], margin[c]))
    count = len(_FROM_EDGE)
    for j in range(count):
        out[0, m + (j + 2 if opens else count - 1 - j)] = x + _FROM_EDGE[j] * (values[a] - x)
    out[0, m + (1 if opens else count)] = x
    out[0, m + (0 if opens else count + 1)] = y
    return m + count + 2
