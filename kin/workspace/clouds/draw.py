"""Compiled draws from the box of joint values: numbers, scaling and forward kinematics of the point in one pass.

Nothing goes through memory but the points: a block of `BLOCK` configurations lives in the first-level cache, laid
out value by value so that one vector instruction serves several of them. Drawing the numbers costs as much as the
kinematics. Angles never become radians on the way, and sine and cosine have the digits that float32 keeps: the
point of a configuration recomputed from its index is the point of the cloud to the rounding of float32, not to the
last bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.kernels.fk import BLOCK, HEADER, WIDTH, load_base, sine_cosine, x_part
from kin.kernels.simd import _ROUND, _bits, _float, fma, widest
from kin.transforms import Array
from kin.workspace.clouds.numbers import Words, fraction, scrambled

Points = NDArray[np.float32]

_QUARTERS = 2.0 / math.pi  # per radian
# Where a block keeps what: BLOCK values each.
_X, _Y, _Z, _ANGLE, _SPACE = range(0, 5 * BLOCK, BLOCK)


@inlined
def _value(x: Any, quasi: bool, low: float, span: float, high: float) -> float:
    """A joint's value from its 64-bit number, never beyond its stops."""
    value = low + fraction(x if quasi else scrambled(x)) * span
    return high if value > high else value


@inlined
def _sin_cos_quarters(y: float) -> tuple[float, float]:
    """(sin, cos) of y quarter turns, to 5e-11.

    Half the work of `kin.kernels.simd.sin_cos`: quarter turns need no reduction by π, and float32 no more digits.
    Chebyshev interpolation in r², |r| ≤ ½.
    """
    shifted = y + _ROUND
    r = y - (shifted - _ROUND)
    quadrant = _bits(shifted)
    z = r * r
    p = fma(z, fma(z, 0.00015820628792786513, -0.004681266248964948), 0.07969258272440714)
    sine = r * fma(z, fma(z, p, -0.6459640961467292), 1.5707963267880989)
    p = fma(z, fma(z, 0.0009036280586426939, -0.02086006949632079), 0.2536692036544627)
    cosine = fma(z, fma(z, p, -1.2337005406331254), 0.9999999999524891)
    odd = (quadrant & 1) != 0
    s = cosine if odd else sine
    c = sine if odd else cosine
    return _float(_bits(s) ^ ((quadrant & 2) << 62)), _float(_bits(c) ^ (((quadrant + 1) & 2) << 62))


@inlined
def _move(S: Array, b: int, s: float, c: float, d: float, a: float, ca: float, sa: float) -> None:
    """Point b of a block ← Rz(θ) Tz(d) Tx(a) Rx(α) · point."""
    x = S[_X + b] + a
    y = ca * S[_Y + b] - sa * S[_Z + b]
    z = sa * S[_Y + b] + ca * S[_Z + b]
    S[_X + b] = c * x - s * y
    S[_Y + b] = s * x + c * y
    S[_Z + b] = z + d


@jit
def points(
    model: Array, key: Words, step: Words, quasi: bool, low: Array, high: Array, start: int, out: Points
) -> None:
    """out ← tool points ``(k, 3)`` of draws start, start + 1, …."""
    widest()
    S = np.empty(_SPACE)
    T = np.empty((4, 4))
    P = np.empty(_SPACE, dtype=np.float32)
    # A product of 64-bit integers is dear: those within a block are made once.
    ahead_by = np.empty((step.shape[0], BLOCK), dtype=np.uint64)
    for j in range(step.shape[0]):
        for b in range(BLOCK):
            ahead_by[j, b] = np.uint64(b) * step[j]
    ahead = load_base(model, T)
    x0, x1, x2, x3 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
    y0, y1, y2, y3 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
    z0, z1, z2, z3 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    for first in range(0, out.shape[0], BLOCK):
        for b in range(BLOCK):
            S[_X + b] = model[18]
            S[_Y + b] = model[22]
            S[_Z + b] = model[26]
        for i in range(int(model[0]) - 1, -1, -1):
            k = HEADER + WIDTH * i
            theta, d, kind, j = model[k], model[k + 1], model[k + 5], int(model[k + 6])
            a, ca, sa = x_part(model, i + ahead)
            if kind == 0.0:
                s, c = sine_cosine(theta)
                for b in range(BLOCK):
                    _move(S, b, s, c, d, a, ca, sa)
                continue
            x = key[j] + np.uint64(start + first) * step[j]
            span = high[j] - low[j]
            if kind == 2.0:
                s, c = sine_cosine(theta)
                for b in range(BLOCK):
                    _move(S, b, s, c, d + _value(x + ahead_by[j, b], quasi, low[j], span, high[j]), a, ca, sa)
                continue
            least = (theta + low[j]) * _QUARTERS
            span *= _QUARTERS
            # Two loops: one value's way through both is longer than a processor looks ahead, and it would wait.
            if quasi:
                for b in range(BLOCK):
                    S[_ANGLE + b] = fma(fraction(x + ahead_by[j, b]), span, least)
            else:
                for b in range(BLOCK):
                    S[_ANGLE + b] = fma(fraction(scrambled(x + ahead_by[j, b])), span, least)
            for b in range(BLOCK):
                s, c = _sin_cos_quarters(S[_ANGLE + b])
                _move(S, b, s, c, d, a, ca, sa)
        # Converted with vector instructions first: storing three by three is scalar work.
        for b in range(BLOCK):
            x, y, z = S[_X + b], S[_Y + b], S[_Z + b]
            P[_X + b] = np.float32(x0 * x + x1 * y + x2 * z + x3)
            P[_Y + b] = np.float32(y0 * x + y1 * y + y2 * z + y3)
            P[_Z + b] = np.float32(z0 * x + z1 * y + z2 * z + z3)
        for b in range(min(BLOCK, out.shape[0] - first)):
            out[first + b, 0] = P[_X + b]
            out[first + b, 1] = P[_Y + b]
            out[first + b, 2] = P[_Z + b]


@jit
def configurations(key: Words, step: Words, quasi: bool, low: Array, high: Array, start: int, out: Array) -> None:
    """out ← the configurations ``(k, n)`` of draws start, start + 1, …"""
    widest()
    for j in range(out.shape[1]):
        span = high[j] - low[j]
        stride = step[j]
        x = key[j] + np.uint64(start) * stride
        if quasi:
            for b in range(out.shape[0]):
                out[b, j] = _value(x + np.uint64(b) * stride, True, low[j], span, high[j])
        else:
            for b in range(out.shape[0]):
                out[b, j] = _value(x + np.uint64(b) * stride, False, low[j], span, high[j])


@jit
def chosen(key: Words, step: Words, quasi: bool, low: Array, high: Array, index: Words, out: Array) -> None:
    """out ← the configurations ``(k, n)`` of the draws `index` ``(k,)``."""
    for j in range(out.shape[1]):
        span = high[j] - low[j]
        for b in range(out.shape[0]):
            out[b, j] = _value(key[j] + index[b] * step[j], quasi, low[j], span, high[j])
