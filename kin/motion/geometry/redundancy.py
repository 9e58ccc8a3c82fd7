"""A joint that is left over: where along the path it goes.

Where the arm has one joint more than the tool needs, each configuration of a path can move along one direction
without moving the tool. All of them are moved together, by Newton steps, to lower the integral of a cost, which is
high close to limits and singularities, plus the square of how far the joints move.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.dense import cholesky, gram, solve_positive
from kin.kernels.jacobian import jacobian_into
from kin.motion.geometry.tracking import approach, to_tool
from kin.transforms import Array

_SINGULAR = 0.05  # weight of the logarithm of manipulability
_SWEEPS, _HALVINGS = 8, 3
_MOST, _ENOUGH = (
    0.25,
    1e-3,
)  # of a step: the largest, in radians or metres, and the relative gain worth another one
_STEP = 1e-3  # of differences
_MET = 1e-9


@jit
def relax(
    model: Array, targets: Array, s: Array, rows: int, bounds: Array, most: float, moving: float, q: Array
) -> float:
    """q ← configurations ``(k, n)`` that meet the same targets at a lower cost, the first one kept; n is rows + 1.

    Args:
        model, targets, s, rows, bounds, most: as in `kin.motion.geometry.tracking.follow`.
        moving: weight of motion; the smaller it is, the further joints move away from limits.
        q: configurations that meet the targets.
    """
    k, n = q.shape
    z, trial, step = np.zeros((k, n)), np.empty((k, n)), np.zeros(k)
    least = _total(model, s, rows, bounds, moving, q)
    for _ in range(_SWEEPS):
        _directions(model, rows, q, z)
        _newton(model, s, rows, bounds, moving, q, (z, step))
        size, better = 1.0, False
        for _ in range(_HALVINGS):
            met = True
            for i in range(k):
                for j in range(n):
                    trial[i, j] = q[i, j] + size * step[i] * z[i, j]
                if i > 0:
                    met = met and approach(model, targets[i], rows, trial[i]) < _MET
                    for j in range(n):
                        met = met and abs(trial[i, j] - trial[i - 1, j]) <= most
            total = _total(model, s, rows, bounds, moving, trial) if met else math.inf
            if total < least:
                better = least - total > _ENOUGH * abs(least)
                least = total
                q[:] = trial
                break
            size *= 0.3
        if not better:
            break
    return least


@jit
def _jacobian(model: Array, rows: int, q: Array, J: Array) -> None:
    T, axes = np.empty((4, 4)), np.empty((q.shape[0], 7))
    jacobian_into(model, q, J, T, axes)
    to_tool(J, T, rows)


@jit
def _directions(model: Array, rows: int, q: Array, z: Array) -> None:
    """z ← the directions ``(k, n)`` in which the tool rests, of size 1 and continuous along the path."""
    k, n = q.shape
    J, A, y, found = np.empty((6, n)), np.empty((rows, rows)), np.empty(rows), np.empty(n)
    for i in range(k):
        _jacobian(model, rows, q[i], J)
        longest = 0.0
        # Of the direction before; at the start, of each joint.
        for first in range(n if i == 0 else 1):
            for r in range(rows):
                y[r] = 0.0
                for j in range(n):
                    y[r] += J[r, j] * ((1.0 if j == first else 0.0) if i == 0 else z[i - 1, j])
            gram(J, rows, 1e-12, A)
            if not solve_positive(A, rows, 0.0, 0.0, y):
                continue
            length = 0.0
            for j in range(n):
                found[j] = (1.0 if j == first else 0.0) if i == 0 else z[i - 1, j]
                for r in range(rows):
                    found[j] -= J[r, j] * y[r]
                length += found[j] * found[j]
            if length > longest:
                longest = length
                for j in range(n):
                    z[i, j] = found[j] / math.sqrt(length)
        if longest < 1e-6:
            for j in range(n):
                z[i, j] = 0.0 if i == 0 else z[i - 1, j]


@jit
def _cost(model: Array, rows: int, bounds: Array, q: Array) -> float:
    """High close to limits and singularities."""
    n, total = q.shape[0], 0.0
    for j in range(n):
        half = 0.5 * (bounds[1, j] - bounds[0, j])
        if half < 1e6:
            off = (q[j] - 0.5 * (bounds[0, j] + bounds[1, j])) / half
            total += off**8
    J, A = np.empty((6, n)), np.empty((rows, rows))
    _jacobian(model, rows, q, J)
    gram(J, rows, 1e-12, A)
    if not cholesky(A, rows, 0.0, 0.0):
        return math.inf
    for i in range(rows):
        total -= _SINGULAR * math.log(A[i, i])
    return total


@jit
def _total(model: Array, s: Array, rows: int, bounds: Array, moving: float, q: Array) -> float:
    """The cost of a path."""
    k, n = q.shape
    length, total = s[k - 1] - s[0], 0.0
    for i in range(k):
        share = 0.5 * (s[min(i + 1, k - 1)] - s[max(i - 1, 0)]) / length
        total += share * _cost(model, rows, bounds, q[i])
        if i > 0:
            for j in range(n):
                total += 0.5 * moving * (q[i, j] - q[i - 1, j]) ** 2 / ((s[i] - s[i - 1]) / length)
    return total


@jit
def _newton(
    model: Array, s: Array, rows: int, bounds: Array, moving: float, q: Array, ways: tuple[Array, Array]
) -> None:
    """Of the directions and steps, steps ← how far to move along each; the first configuration stays."""
    z, step = ways
    k, n = q.shape
    length, largest = s[k - 1] - s[0], 0.0
    upper, near = np.zeros(k), np.empty(n)
    step[0] = 0.0
    for i in range(1, k):
        costs = np.empty(3)
        for side in range(3):
            for j in range(n):
                near[j] = q[i, j] + (side - 1) * _STEP * z[i, j]
            costs[side] = _cost(model, rows, bounds, near)
        before = moving * length / (s[i] - s[i - 1])
        after = moving * length / (s[i + 1] - s[i]) if i < k - 1 else 0.0
        share = 0.5 * (s[min(i + 1, k - 1)] - s[i - 1]) / length
        slope = share * (costs[2] - costs[0]) / (2.0 * _STEP)
        bend = share * max((costs[2] - 2.0 * costs[1] + costs[0]) / (_STEP * _STEP), 0.0)
        left = right = 0.0
        for j in range(n):
            slope += before * z[i, j] * (q[i, j] - q[i - 1, j])
            left -= before * z[i, j] * z[i - 1, j]
            if i < k - 1:
                slope -= after * z[i, j] * (q[i + 1, j] - q[i, j])
                right -= after * z[i, j] * z[i + 1, j]
        left = left if i > 1 else 0.0
        pivot = bend + before + after - left * upper[i - 1]
        upper[i] = right / pivot
        step[i] = (-slope - left * step[i - 1]) / pivot
    for i in range(k - 2, 0, -1):
        step[i] -= upper[i] * step[i + 1]
    for i in range(k):
        largest = max(largest, abs(step[i]))
    if largest > _MOST:
        for i in range(k):
            step[i] *= _MOST / largest
