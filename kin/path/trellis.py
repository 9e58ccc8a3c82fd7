"""The shortest way through layers: the fewest jumps and, of these, the least sum of squared joint motion.

Dynamic programming (Viterbi, IEEE Trans. Information Theory 13(2), 1967): for each configuration of a layer the
best predecessor in the layer before is found and kept, so the time grows linearly with the number of layers. What
is minimised is a pair: the number of jumps first, the cost second.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import jit
from kin.path.course import Way
from kin.solvers.common import TURN
from kin.transforms import Array


@jit
def _first_from(values: Array, least: float) -> int:
    """The index of the first of the rising values ``(m,)`` that is not below `least`, m if there is none."""
    a, b = 0, values.shape[0]
    while a < b:
        middle = (a + b) // 2
        if values[middle] < least:
            a = middle + 1
        else:
            b = middle
    return a


@jit
def _advance(
    before: Array, jumps: Array, cost: Array, order: Array, key: int, sorted_key: Array, by_key: Array,
    here: Array, weight: Array, ring: Array, allowed: float, scale: float, jumps_out: Array, cost_out: Array,
    parent: Array,
) -> None:  # fmt: skip
    """One layer on: the best predecessor of each row of `here` ``(p, n)`` among the rows of `before` ``(m, n)``.

    Steps without a jump first: their predecessors lie in a window of joint `key`, whose values are `sorted_key` in
    the order `by_key`. Then jumps, from predecessors in the order of their own jumps and cost: the search ends at
    the first that would not be better for a jump of no length, so mostly at once. Of equals the jump is taken: it
    comes as late as it can. Row numbers are floats.
    """
    m, n = before.shape
    for j in range(here.shape[0]):
        best, best_jumps, best_cost = 0, math.inf, math.inf
        first, last = 0, m
        if key >= 0:
            reach = allowed / weight[key] * (1.0 + 1e-9)
            first = _first_from(sorted_key, here[j, key] - reach)
            last = _first_from(sorted_key, here[j, key] + reach)
        tie = 0.0
        for leap in range(2):
            if leap == 1:
                first, last = 0, m
                tie = 1e-11 * (1.0 + best_cost)
            for o in range(first, last):
                i = int(order[o]) if leap == 1 else int(by_key[o])
                count = jumps[i] + leap
                enough = best_cost + tie
                if count > best_jumps or (count == best_jumps and cost[i] >= enough):
                    if leap == 1:
                        break
                    continue
                total = cost[i]
                worse = False
                for k in range(n):
                    d = here[j, k] - before[i, k]
                    if ring[k] > 0.0:
                        d -= ring[k] * math.floor(d / ring[k] + 0.5)
                    d *= weight[k]
                    total += scale * d * d
                    if (leap == 0 and abs(d) > allowed) or (count == best_jumps and total >= enough):
                        worse = True
                        break
                if not worse:
                    best, best_jumps, best_cost = i, count, total
                    tie = 0.0
        parent[j], jumps_out[j], cost_out[j] = best, best_jumps, best_cost


class Trellis(NamedTuple):
    """The shortest way: its row in each layer and its jumps; the fewest jumps and the cost of every row."""

    rows: list[int]
    jumps: int
    fewest: list[Array]
    costs: list[Array]

    def path(self, layers: Sequence[Array]) -> Array:
        """The configurations on the way ``(s, n)``."""
        return np.array([layer[row] for layer, row in zip(layers, self.rows, strict=True)])

    def dead_ends(self) -> list[tuple[int, int]]:
        """For 0, 1, … jumps: the last layer that can be reached with so many, and its cheapest row."""
        least = np.array([jumps.min() for jumps in self.fewest])
        out = []
        for count in range(self.jumps):
            s = int(np.flatnonzero(least > count)[0]) - 1
            out.append((s, int(np.argmin(np.where(self.fewest[s] == count, self.costs[s], math.inf)))))
        return out


def shortest(way: Way, layers: Sequence[Array], spans: Sequence[int], ring: Array, allowed: float) -> Trellis:
    """Viterbi's algorithm over layers ``(m_i, n)``; from layer i − 1 to layer i there are spans[i] steps."""
    start = layers[0] - way.question.seed
    start -= ring * np.floor(start / TURN + 0.5)
    jumps, costs = [np.zeros(len(start))], [way.pull * ((start * way.weight) ** 2).sum(axis=1)]
    parents: list[Array] = []
    for i in range(1, len(layers)):
        more, cost, parent = (np.empty(len(layers[i])) for _ in range(3))
        before = layers[i - 1]
        order = np.lexsort((costs[-1], jumps[-1])).astype(np.float64)
        key = int(np.argmax(np.where(ring > 0.0, -1.0, np.ptp(before, axis=0) * way.weight)))
        by_key = np.argsort(before[:, key], kind="stable")
        _advance(
            before, jumps[-1], costs[-1], order, -1 if ring[key] > 0.0 else key, before[by_key, key],
            by_key.astype(np.float64), layers[i], way.weight, ring, allowed * spans[i], 1.0 / spans[i], more, cost,
            parent,
        )  # fmt: skip
        jumps.append(more)
        costs.append(cost)
        parents.append(parent)
    row = int(np.lexsort((costs[-1], jumps[-1]))[0])
    fewest = int(jumps[-1][row])
    rows = [row]
    for parent in reversed(parents):
        row = int(parent[row])
        rows.append(row)
    return Trellis(rows[::-1], fewest, jumps, costs)
