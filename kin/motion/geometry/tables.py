"""Curves of the tool as numbers, and the compiled function that gives their poses.

A row describes one curve; a corner refers to the rows of the two curves that it joins.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array

LINE, ARC, THROUGH, CORNER = 0.0, 1.0, 2.0, 3.0
# Columns: kind, length, two numbers (a corner: its curves; a spline: its first knot and its pieces), radius of a
# corner, start or centre, way or one radius of an arc, the other radius, angle of an arc, first orientation, and
# the rotation vectors in the base and in the tool.
_A, _B, _RADIUS, _START, _WAY, _ACROSS, _ANGLE, _R0, _BASE, _TOOL, _WIDTH = 2, 3, 4, 5, 8, 11, 14, 15, 24, 27, 30

Numbers = tuple[Array, Array, Array]  # rows, and knots and pieces of splines


class Table:
    """Rows of curves, each of them once."""

    def __init__(self) -> None:
        self._rows: list[Array] = []
        self._knots: list[Array] = [np.zeros(0)]
        self._pieces: list[Array] = [np.zeros((0, 7, 4))]
        self._known: dict[int, int] = {}

    def index(self, curve: Any) -> int:
        """The row of a curve, which has a method `describe`."""
        found = self._known.get(id(curve))
        if found is None:
            row = np.zeros(_WIDTH)
            curve.describe(self, row)
            self._rows.append(row)
            found = self._known[id(curve)] = len(self._rows) - 1
        return found

    def spline(self, row: Array, knots: Array, pieces: Array) -> None:
        """A spline of point and quaternion."""
        row[:4] = THROUGH, knots[-1], sum(map(len, self._knots)), len(pieces)
        self._knots.append(knots)
        # Each spline has one knot more than pieces: an empty piece keeps the indices equal.
        self._pieces += [pieces, np.zeros((1, 7, 4))]

    @property
    def numbers(self) -> Numbers:
        """All rows, knots and pieces."""
        return np.array(self._rows), np.concatenate(self._knots), np.concatenate(self._pieces)


def line(row: Array, length: float, start: Array, way: Array) -> None:
    """row ← a line."""
    row[0], row[1], row[_START : _START + 3], row[_WAY : _WAY + 3] = LINE, length, start, way


def arc(row: Array, length: float, centre: Array, along: Array, across: Array, angle: float) -> None:
    """row ← an arc."""
    line(row, length, centre, along)
    row[0], row[_ACROSS : _ACROSS + 3], row[_ANGLE] = ARC, across, angle


def turn(row: Array, R0: Array, base: Array, tool: Array) -> None:
    """row ← how the tool turns on a line or an arc."""
    row[_R0 : _R0 + 9], row[_BASE : _BASE + 3], row[_TOOL : _TOOL + 3] = R0.ravel(), base, tool


def corner(row: Array, radius: float, before: int, after: int) -> None:
    """row ← the corner between the curves of two rows."""
    row[:5] = CORNER, 2.0 * radius, before, after, radius


@jit
def poses_into(numbers: Numbers, which: Array, starts: Array, offsets: Array, s: Array, out: Array) -> None:
    """out ← poses ``(m, 4, 4)`` at s ``(m,)`` of curves one after the other.

    Args:
        numbers: of a table.
        which, starts, offsets: their rows, s where each begins, and which s of its own that is ``(k,)``.
        s, out: where, and the result.
    """
    i = 0
    for m in range(s.shape[0]):
        while i > 0 and s[m] < starts[i]:
            i -= 1
        while i < which.shape[0] - 1 and s[m] >= starts[i + 1]:
            i += 1
        pose_into(numbers, int(which[i]), s[m] - starts[i] + offsets[i], out[m])


@jit
def pose_into(numbers: Numbers, index: int, s: float, T: Array) -> None:
    """T ← the pose of one curve."""
    row = numbers[0][index]
    if row[0] != CORNER:
        _plain(numbers, index, s, T)
        return
    radius = row[_RADIUS]
    first, second = corner_at(s / row[1], radius)
    rows = numbers[0].shape[0]
    before, after = int(row[_A]) % rows, int(row[_B]) % rows
    T0, T1, met, turned = np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4)), np.empty((3, 3))
    _plain(numbers, before, numbers[0][before, 1] + first, T0)
    _plain(numbers, after, second, T1)
    _plain(numbers, after, 0.0, met)
    for r in range(3):
        for c in range(3):
            # T0 metᵀ T1
            turned[r, c] = T0[r, 0] * met[c, 0] + T0[r, 1] * met[c, 1] + T0[r, 2] * met[c, 2]
    for r in range(3):
        for c in range(3):
            T[r, c] = turned[r, 0] * T1[0, c] + turned[r, 1] * T1[1, c] + turned[r, 2] * T1[2, c]
        T[r, 3] = T0[r, 3] + T1[r, 3] - met[r, 3]
    T[3, 0] = T[3, 1] = T[3, 2] = 0.0
    T[3, 3] = 1.0


@jit
def corner_at(u: float, radius: float) -> tuple[float, float]:
    """How far a corner of this radius has come on both of its curves, relative to where they meet.

    On the first from −radius to 0, on the second from 0 to radius, with u from 0 to 1. Both are Bézier polynomials
    of degree five whose first and second derivatives continue the curves before and after the corner.
    """
    v = 1.0 - u
    first = -radius * v * v * v * (v * v + 3.0 * u * v + 2.0 * u * u)
    return first, radius * u * u * u * (u * u + 3.0 * u * v + 2.0 * v * v)


@jit
def _plain(numbers: Numbers, index: int, s: float, T: Array) -> None:
    """T ← the pose of a curve that is not a corner."""
    row = numbers[0][index]
    T[3, 0] = T[3, 1] = T[3, 2] = 0.0
    T[3, 3] = 1.0
    if row[0] == THROUGH and numbers[1].shape[0] > 0:
        _through(numbers, row, s, T)
        return
    f = s / row[1]
    if row[0] == LINE:
        for r in range(3):
            T[r, 3] = row[_START + r] + f * row[_WAY + r]
    else:
        c, d = math.cos(f * row[_ANGLE]), math.sin(f * row[_ANGLE])
        for r in range(3):
            T[r, 3] = row[_START + r] + c * row[_WAY + r] + d * row[_ACROSS + r]
    # exp(f·base) R0 exp(f·tool), column by column and row by row
    for k in range(3):
        x, y, z = row[_R0 + k], row[_R0 + 3 + k], row[_R0 + 6 + k]
        T[0, k], T[1, k], T[2, k] = _turned(row, _BASE, f, x, y, z)
    for r in range(3):
        # A row times a rotation is the inverse rotation times the row.
        T[r, 0], T[r, 1], T[r, 2] = _turned(row, _TOOL, -f, T[r, 0], T[r, 1], T[r, 2])


@jit
def _turned(row: Array, at: int, f: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """A vector turned by a part of the rotation vector in a row (Rodrigues)."""
    a, b, c = row[at], row[at + 1], row[at + 2]
    size = math.sqrt(a * a + b * b + c * c)
    if size == 0.0:
        return x, y, z
    a, b, c = a / size, b / size, c / size
    sine, half = math.sin(size * f), math.sin(0.5 * size * f)
    bend = 2.0 * half * half
    u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
    return (
        x + sine * u + bend * (b * w - c * v),
        y + sine * v + bend * (c * u - a * w),
        z + sine * w + bend * (a * v - b * u),
    )


@jit
def _through(numbers: Numbers, row: Array, s: float, T: Array) -> None:
    """T ← the pose of a spline of point and quaternion."""
    knots, pieces = numbers[1], numbers[2]
    i = min(max(int(row[_A]), 0), knots.shape[0] - 1)
    last = min(i + int(row[_B]), knots.shape[0]) - 1
    while i < last and s >= knots[i + 1]:
        i += 1
    d, p = s - knots[i], pieces[i]
    for r in range(3):
        T[r, 3] = p[r, 0] + d * (p[r, 1] + d * (p[r, 2] + d * p[r, 3]))
    w = p[3, 0] + d * (p[3, 1] + d * (p[3, 2] + d * p[3, 3]))
    x = p[4, 0] + d * (p[4, 1] + d * (p[4, 2] + d * p[4, 3]))
    y = p[5, 0] + d * (p[5, 1] + d * (p[5, 2] + d * p[5, 3]))
    z = p[6, 0] + d * (p[6, 1] + d * (p[6, 2] + d * p[6, 3]))
    k = 2.0 / (w * w + x * x + y * y + z * z)
    T[0, 0], T[0, 1], T[0, 2] = 1.0 - k * (y * y + z * z), k * (x * y - w * z), k * (x * z + w * y)
    T[1, 0], T[1, 1], T[1, 2] = k * (x * y + w * z), 1.0 - k * (x * x + z * z), k * (y * z - w * x)
    T[2, 0], T[2, 1], T[2, 2] = k * (x * z - w * y), k * (y * z + w * x), 1.0 - k * (x * x + y * y)
