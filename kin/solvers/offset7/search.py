"""Kernels for zeros, peaks and dips between samples, of the slack of a branch or of the margin of an elbow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.solvers.offset7.lanes import level_margin, reach_margin, slack_at
from kin.transforms import Array

LEVEL, EITHER = -1, -2  # instead of a branch: parts of the margin of an elbow
_GOLDEN = 0.6180339887498949
_PEAK_STEPS = 24
STEPS = 60  # at most, to find a zero
_EDGE_WIDTH = 1e-14  # rad; beside where a branch begins to exist angles change with a root

Whole = NDArray[np.int64]
Target = tuple[Array, Array, Array, Array]  # params, T ``(4, 4)``, box ``(3, 7)``, setup
# Two values with a zero between them, and a third one, each with the function there.
Bracket = tuple[float, float, float, float, float, float]


@jit
def _at(target: Target, value: float, k: int, elbow: float) -> float:
    """The slack of branch k; `level_margin` of an elbow if k is LEVEL, `reach_margin` if it is EITHER."""
    params, T, box, setup = target
    if k == EITHER:
        return reach_margin(setup, value, elbow)
    if k == LEVEL:
        return level_margin(setup, value, elbow)
    return slack_at(params, T, box, setup, value, k)


@inlined
def next_in(bracket: Bracket, width: float) -> float:
    """The next value at which to look for a zero: by inverse quadratic interpolation if that is safe, or halfway.

    T. R. Chandrupatla, Advances in Engineering Software 28(3), 1997. It stays a share of `width` away from both
    ends, so that the zero is soon between two values as close as that; beside an end that is a zero itself, too.
    """
    a, fa, b, fb, c, fc = bracket
    along, up = (a - b) / (c - b), (fa - fb) / (fc - fb)
    safe = (up * up < along) & ((1.0 - up) * (1.0 - up) < 1.0 - along)
    share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    share = share if safe else 0.5
    share = 0.0 if fa == 0.0 else (1.0 if fb == 0.0 else share)
    least = min(0.4 * width / abs(b - a), 0.5)
    return a + min(max(share, least), 1.0 - least) * (b - a)


@inlined
def narrowed(bracket: Bracket, value: float, f: float) -> Bracket:
    """The bracket once the function is known at a value inside it."""
    a, fa, b, fb, _, _ = bracket
    same = (f >= 0.0) == (fa >= 0.0)
    return value, f, b if same else a, fb if same else fa, a if same else b, fa if same else fb


@jit
def edge(setup: Array, elbow: float, bracket: Bracket) -> tuple[float, float]:
    """Where the branches of an elbow begin to exist, in a bracket of `reach_margin`: neighbours on both sides."""
    x = bracket
    for _ in range(STEPS):
        if abs(x[2] - x[0]) < _EDGE_WIDTH:
            break
        value = next_in(x, _EDGE_WIDTH)
        x = narrowed(x, value, reach_margin(setup, value, elbow))
    return (x[0], x[2]) if x[1] >= 0.0 else (x[2], x[0])


@jit
def peak(target: Target, k: int, elbow: float, low: float, high: float, sense: float) -> tuple[float, float]:
    """(value, function) where `_at` times `sense` is largest in [low, high], or passes zero."""
    x, y = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fx, fy = sense * _at(target, x, k, elbow), sense * _at(target, y, k, elbow)
    for _ in range(_PEAK_STEPS):
        if max(fx, fy) > 0.0:
            break
        if fx > fy:
            high, y, fy = y, x, fx
            x = high - _GOLDEN * (high - low)
            fx = sense * _at(target, x, k, elbow)
        else:
            low, x, fx = x, y, fy
            y = low + _GOLDEN * (high - low)
            fy = sense * _at(target, y, k, elbow)
    return (x, sense * fx) if fx > fy else (y, sense * fy)


@jit
def turns(x: Array, f: Array, out: Array) -> None:
    """out ``(n,)`` ← 1.0 if a peak of f ``(n,)`` around value x[i] could be above zero, −1.0 if a dip could be
    below, else 0.0.

    It could if the steeper of the two slopes, over the wider interval, leads as far as zero.
    """
    n = out.shape[0]
    out[0] = out[n - 1] = 0.0
    for i in range(1, n - 1):
        left, right = x[i] - x[i - 1], x[i + 1] - x[i]
        before, here, after = f[i - 1], f[i], f[i + 1]
        peaks = (here < 0.0) & (before <= here) & (after < here)
        dips = (here >= 0.0) & (before >= here) & (after > here)
        rise = max(abs(here - before) / left, abs(after - here) / right) * max(left, right)
        turning = (left > 0.0) & (right > 0.0) & (abs(here) < rise)
        out[i] = 1.0 if turning & peaks else (-1.0 if turning & dips else 0.0)
