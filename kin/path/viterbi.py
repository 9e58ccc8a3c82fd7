"""Viterbi's algorithm: the shortest path through layers of configurations.

Dynamic programming (Viterbi, IEEE Trans. Information Theory 13(2), 1967): for each configuration of a layer the
best predecessor in the layer before is found and kept, so the time grows linearly with the number of layers. What
is minimised is a pair: the number of jumps first, then the cost, the sum of squared joint motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kin.angles import TURN
from kin.kernels.compile import jit
from kin.path.waypoints import PathSettings
from kin.transforms import Array


@jit
def first_from(values: Array, least: float) -> int:
    """The index of the first of the sorted values ``(m,)`` that is not below `least`, m if there is none."""
    a, b = 0, values.shape[0]
    while a < b:
        middle = (a + b) // 2
        if values[middle] < least:
            a = middle + 1
        else:
            b = middle
    return a


class _Layer(NamedTuple):
    """A layer from which the next one is reached; row numbers are floats.

    Attributes:
        q: configurations ``(m, n)``.
        jumps, cost: ``(m,)`` of the best path to each.
        order: ``(m,)`` rows by jumps, then cost.
        by_key, sorted_key: ``(m,)`` rows by their value of joint `key`, and these values; see `_Step`.
    """

    q: Array
    jumps: Array
    cost: Array
    order: Array
    by_key: Array
    sorted_key: Array


class _Step(NamedTuple):
    """How a motion to the next layer is measured.

    Attributes:
        weight, circle: ``(n,)`` as in `kin.path.waypoints.PathSettings`.
        key: the joint that spreads most, −1 if there is none to search by.
        allowed: a larger weighted motion of a joint is a jump.
        scale: factor of the squared motion.
    """

    weight: Array
    circle: Array
    key: int
    allowed: float
    scale: float


class _Best(NamedTuple):
    """Of each row of a layer ``(p,)``: jumps and cost of the best path to it, and the row before it on that
    path."""

    jumps: Array
    cost: Array
    parent: Array


@jit
def _advance(before: _Layer, step: _Step, q: Array, best: _Best) -> None:
    """One layer on: the best predecessor of each row of q ``(p, n)`` among the rows of `before`.

    First steps without a jump: their predecessors lie in a window of joint `key`. Then jumps, from predecessors in
    the order of their own jumps and cost: the search ends at the first that would not be better for a jump of zero
    length, so mostly at once. Of equal steps the jump is taken: it comes as late as possible.
    """
    m, n = before.q.shape
    key, weight, circle = step.key, step.weight, step.circle
    for j in range(q.shape[0]):
        row, row_jumps, row_cost = 0, math.inf, math.inf
        first, last = 0, m
        if key >= 0:
            reach = step.allowed / weight[key] * (1.0 + 1e-9)
            first = first_from(before.sorted_key, q[j, key] - reach)
            last = first_from(before.sorted_key, q[j, key] + reach)
        tie = 0.0
        for jump in range(2):
            if jump == 1:
                first, last = 0, m
                tie = 1e-11 * (1.0 + row_cost)
            for o in range(first, last):
                i = int(before.order[o]) if jump == 1 else int(before.by_key[o])
                count = before.jumps[i] + jump
                enough = row_cost + tie
                if count > row_jumps or (count == row_jumps and before.cost[i] >= enough):
                    if jump == 1:
                        break
                    continue
                total = before.cost[i]
                worse = False
                for k in range(n):
                    d = q[j, k] - before.q[i, k]
                    if circle[k] > 0.0:
                        d -= circle[k] * math.floor(d / circle[k] + 0.5)
                    d *= weight[k]
                    total += step.scale * d * d
                    if (jump == 0 and abs(d) > step.allowed) or (count == row_jumps and total >= enough):
                        worse = True
                        break
                if not worse:
                    row, row_jumps, row_cost = i, count, total
                    tie = 0.0
        best.parent[j], best.jumps[j], best.cost[j] = row, row_jumps, row_cost


class Trellis(NamedTuple):
    """The shortest path through layers.

    Attributes:
        rows: its row in each layer.
        jumps: its number of jumps.
        fewest, costs: per layer ``(m,)``: jumps and cost of the best path to each row.
    """

    rows: list[int]
    jumps: int
    fewest: list[Array]
    costs: list[Array]

    def path(self, layers: Sequence[Array]) -> Array:
        """The configurations on the path ``(s, n)``."""
        return np.array([layer[row] for layer, row in zip(layers, self.rows, strict=True)])

    def dead_ends(self) -> list[tuple[int, int]]:
        """For 0, 1, … jumps: the last layer that can be reached with so many, and its cheapest row."""
        least = np.array([jumps.min() for jumps in self.fewest])
        out = []
        for count in range(self.jumps):
            s = int(np.flatnonzero(least > count)[0]) - 1
            out.append((s, int(np.argmin(np.where(self.fewest[s] == count, self.costs[s], math.inf)))))
        return out


def shortest(
    settings: PathSettings, layers: Sequence[Array], spans: Sequence[int], circle: Array, allowed: float
) -> Trellis:
    """The shortest path through layers ``(m_i, n)``; from layer i − 1 to layer i there are spans[i] steps."""
    start = layers[0] - settings.problem.seed
    start -= circle * np.floor(start / TURN + 0.5)
    jumps = [np.zeros(len(start))]
    costs = [settings.start_weight * ((start * settings.weight) ** 2).sum(axis=1)]
    parents: list[Array] = []
    for i in range(1, len(layers)):
        q = layers[i - 1]
        key = int(np.argmax(np.where(circle > 0.0, -1.0, np.ptp(q, axis=0) * settings.weight)))
        by_key = np.argsort(q[:, key], kind="stable")
        order = np.lexsort((costs[-1], jumps[-1])).astype(np.float64)
        before = _Layer(q, jumps[-1], costs[-1], order, by_key.astype(np.float64), q[by_key, key])
        usable = -1 if circle[key] > 0.0 else key
        step = _Step(settings.weight, circle, usable, allowed * spans[i], 1.0 / spans[i])
        best = _Best(*(np.empty(len(layers[i])) for _ in range(3)))
        _advance(before, step, layers[i], best)
        jumps.append(best.jumps)
        costs.append(best.cost)
        parents.append(best.parent)
    row = int(np.lexsort((costs[-1], jumps[-1]))[0])
    fewest = int(jumps[-1][row])
    rows = [row]
    for parent in reversed(parents):
        row = int(parent[row])
        rows.append(row)
    return Trellis(rows[::-1], fewest, jumps, costs)
