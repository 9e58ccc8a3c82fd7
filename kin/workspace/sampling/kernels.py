"""Compiled sampling: random numbers, scaling to the joint limits and forward kinematics in one pass.

Only the points go through memory: a block of `BLOCK` configurations stays in the first-level cache, laid out value
by value so that one vector instruction serves several of them. The random numbers cost as much as the kinematics.
Angles are never converted to radians, and sine and cosine have the digits that float32 keeps: the point of a
configuration recomputed from its index equals the point of the cloud to the rounding of float32, not to the last
bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import inlined, jit
from kin.kernels.fk import BLOCK, load_base, sine_cosine, x_part, z_row
from kin.kernels.simd import fma, sin_cos_quarters
from kin.transforms import Array
from kin.workspace.region import BoundedArm
from kin.workspace.sampling.streams import Streams, Words, fraction, scrambled

Points = NDArray[np.float32]

_QUARTERS = 2.0 / math.pi  # per radian
# Offsets of the values of a block, BLOCK entries each.
_X, _Y, _Z, _ANGLE, _SPACE = range(0, 5 * BLOCK, BLOCK)


@inlined
def _value(x: Any, quasi: bool, low: float, span: float, high: float) -> float:
    """A joint's value from its 64-bit number, never beyond its limits."""
    value = low + fraction(x if quasi else scrambled(x)) * span
    return high if value > high else value


@inlined
def _move(S: Array, b: int, s: float, c: float, d: float, a: float, ca: float, sa: float) -> None:
    """Point b of a block ← Rz(θ) Tz(d) Tx(a) Rx(α) · point."""
    x = S[_X + b] + a
    y = ca * S[_Y + b] - sa * S[_Z + b]
    z = sa * S[_Y + b] + ca * S[_Z + b]
    S[_X + b] = c * x - s * y
    S[_Y + b] = s * x + c * y
    S[_Z + b] = z + d


@inlined
def _offsets_in_block(step: Words) -> Words:
    """b · step ``(n, BLOCK)``: made once, as a product of 64-bit integers is slow."""
    offsets = np.empty((step.shape[0], BLOCK), dtype=np.uint64)
    for j in range(step.shape[0]):
        for b in range(BLOCK):
            offsets[j, b] = np.uint64(b) * step[j]
    return offsets


@inlined
def _store(S: Array, T: Array, P: Points, out: Points, first: int) -> None:
    """Rows `first`, … of out ← T · the points of a block; P: scratch."""
    x0, x1, x2, x3 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
    y0, y1, y2, y3 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
    z0, z1, z2, z3 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
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
def sample_points(arm: BoundedArm, streams: Streams, start: int, out: Points) -> None:
    """out ← tool points ``(k, 3)`` of samples start, start + 1, …."""
    model, low, high = arm.model, arm.lower, arm.upper
    key, step, quasi = streams.key, streams.step, streams.quasi
    S = np.empty(_SPACE)
    T = np.empty((4, 4))
    P = np.empty(_SPACE, dtype=np.float32)
    offsets = _offsets_in_block(step)
    ahead = load_base(model, T)
    for first in range(0, out.shape[0], BLOCK):
        for b in range(BLOCK):
            S[_X + b] = model[18]
            S[_Y + b] = model[22]
            S[_Z + b] = model[26]
        for i in range(int(model[0]) - 1, -1, -1):
            theta, d, j, turn, slide = z_row(model, i)
            a, ca, sa = x_part(model, i + ahead)
            x = key[j] + np.uint64(start + first) * step[j]
            span = high[j] - low[j]
            if turn == 0.0:
                s, c = sine_cosine(theta)
                for b in range(BLOCK):
                    value = slide * _value(x + offsets[j, b], quasi, low[j], span, high[j])
                    _move(S, b, s, c, d + value, a, ca, sa)
                continue
            least = (theta + turn * low[j]) * _QUARTERS
            span = span * turn * _QUARTERS
            # Numbers and kinematics in two loops: a processor cannot look ahead far enough to overlap the steps of
            # one loop that does both.
            if quasi:
                for b in range(BLOCK):
                    S[_ANGLE + b] = fma(fraction(x + offsets[j, b]), span, least)
            else:
                for b in range(BLOCK):
                    S[_ANGLE + b] = fma(fraction(scrambled(x + offsets[j, b])), span, least)
            for b in range(BLOCK):
                s, c = sin_cos_quarters(S[_ANGLE + b])
                _move(S, b, s, c, d, a, ca, sa)
        _store(S, T, P, out, first)


@jit
def sample_configurations(arm: BoundedArm, streams: Streams, start: int, out: Array) -> None:
    """out ← the configurations ``(k, n)`` of samples start, start + 1, …"""
    low, high = arm.lower, arm.upper
    for j in range(out.shape[1]):
        span = high[j] - low[j]
        stride = streams.step[j]
        x = streams.key[j] + np.uint64(start) * stride
        if streams.quasi:
            for b in range(out.shape[0]):
                out[b, j] = _value(x + np.uint64(b) * stride, True, low[j], span, high[j])
        else:
            for b in range(out.shape[0]):
                out[b, j] = _value(x + np.uint64(b) * stride, False, low[j], span, high[j])


@jit
def configurations_of(arm: BoundedArm, streams: Streams, index: Words, out: Array) -> None:
    """out ← the configurations ``(k, n)`` of the samples with these indices ``(k,)``."""
    low, high = arm.lower, arm.upper
    for j in range(out.shape[1]):
        span = high[j] - low[j]
        for b in range(out.shape[0]):
            x = streams.key[j] + index[b] * streams.step[j]
            out[b, j] = _value(x, streams.quasi, low[j], span, high[j])
