"""Minima of a function of one redundancy parameter, refined many at a time.

A minimum is looked for from each of several starts, all at the same time: a *lane* L[:, b] of the workspace for
each. A family evaluates the function and its derivative at all lanes as vectors; `step` then moves each lane by a
safeguarded secant step inside its bracket. The function is the squared distance of the joints from the seed; where
the image of a joint jumps by a turn it has a jump too.
"""

from __future__ import annotations

import math

from kin.kernels.compile import jit
from kin.transforms import Array

# Rows of L: the parameter and the bracket around it, the ends of its interval (infinite once they have been tried
# and the minimum is inside), the parameter before; two signs that tell branches apart; the function F, half its
# derivative G there and before, the squared rate of the joints; the least F, and where it is; the branch; 1.0
# where the derivative rises; the function before.
AT, FROM, TO, FIRST_END, LAST_END, BEFORE, SIDE, FLIP, F, G, G_BEFORE, RATE, LEAST, BEST, BRANCH, CONVEX = range(
    16
)
F_BEFORE = 16
LANE_ROWS, LANES = 17, 64
STEPS = 12  # of a refinement, at most
CLOSE = 1e-5  # rad; steps converge so fast that the one after it does not count
DIP = 0.5  # squared rad by which a value beside one that is tested may be nearer
_VECTOR = 8
_STRIDE = 0.5  # rad, the longest step
_DROP = 3.0  # times what Newton's step promises: more than a lane can still come down
_TINY = 1e-14
_SAME = 1e-9  # squared rad that rounding may add
_SETTLED = 1e-20  # a squared derivative, as a share of what it can be: there is nothing left to find


@jit
def begin(count: int, L: Array) -> None:
    """Start `count` lanes at their parameters, with their intervals as brackets."""
    for b in range(LANES):
        L[F, b] = L[G, b] = L[RATE, b] = 0.0
    for b in range(count):
        L[FROM, b], L[TO, b], L[BEFORE, b], L[G_BEFORE, b] = L[FIRST_END, b], L[LAST_END, b], L[AT, b], 0.0
        L[LEAST, b], L[BEST, b] = math.inf, L[AT, b]


@jit
def whole_vectors(count: int, L: Array) -> int:
    """Fill up the last vector of `count` lanes with copies of the first lane; returns the number of lanes then."""
    filled = (count + _VECTOR - 1) // _VECTOR * _VECTOR
    for b in range(count, filled):
        for r in range(LANE_ROWS):
            L[r, b] = L[r, 0]
    return filled


@jit
def step(count: int, first: bool, L: Array) -> float:
    """One step of `count` lanes from what was evaluated; returns the longest one."""
    for b in range(count):
        x, g = L[AT, b], L[G, b]
        better = L[F, b] < L[LEAST, b]
        L[LEAST, b] = L[F, b] if better else L[LEAST, b]
        L[BEST, b] = x if better else L[BEST, b]
        before, slope_before = L[BEFORE, b], L[G_BEFORE, b]
        uphill = g > 0.0
        # Higher although the step was downhill: there is a minimum before, or the image of a joint has jumped.
        worse = (L[F, b] > L[F_BEFORE, b] + _SAME) & (not first)
        ahead = x > before
        since = (before if ahead else x) if worse else (L[FROM, b] if uphill else x)
        to = (x if ahead else before) if worse else (x if uphill else L[TO, b])
        slope = (g - slope_before) / (x - before)
        convex = (slope > 0.0) & (not first) & (not worse)
        slope = slope if convex else L[RATE, b]
        L[CONVEX, b] = 1.0 if convex else 0.0
        d = -g / (slope + 1e-300)
        d = _STRIDE if d > _STRIDE else d
        d = -_STRIDE if d < -_STRIDE else d
        y = x + d
        # Beyond an end of the interval that end is next; beyond a tried parameter the middle of the bracket, as
        # where steps towards one have hardly changed the derivative, or a steep end makes the secant's step tiny.
        low, high = L[FIRST_END, b], L[LAST_END, b]
        L[FIRST_END, b] = -math.inf if (x == low) & (worse | (not uphill)) else low
        L[LAST_END, b] = math.inf if (x == high) & (worse | uphill) else high
        end = since if uphill else to
        tried = (end != L[FIRST_END, b]) & (end != L[LAST_END, b])
        beyond = (y <= since) | (y >= to)
        steep = convex & (slope > 10.0 * (1.0 + L[RATE, b]))
        slow = ((abs(g) > 0.5 * abs(slope_before)) & (not first) | steep) & tried
        y = (0.5 * (since + to) if tried else end) if beyond | slow else y
        y = 0.5 * (since + to) if worse else y
        # Where only rounding is left of the derivative a bracket says nothing.
        settled = g * g <= _SETTLED * (1.0 + L[F, b]) * L[RATE, b]
        y = x - g / (L[RATE, b] + 1e-300) if settled else y
        L[FROM, b], L[TO, b] = since, to
        L[BEFORE, b] = before if worse else x
        L[G_BEFORE, b] = slope_before if worse else g
        L[F_BEFORE, b] = L[F_BEFORE, b] if worse else L[F, b]
        L[AT, b] = y
    longest = 0.0
    for b in range(count):
        d = abs(L[AT, b] - L[BEFORE, b])
        longest = d if d > longest else longest
    return longest


@jit
def promising(count: int, L: Array) -> int:
    """Keep the lanes that may become their branch's best one, in place; returns how many these are."""
    kept = 0
    for b in range(count):
        promised = L[F, b] - _DROP * L[G_BEFORE, b] * L[G_BEFORE, b] / (L[RATE, b] + _TINY)
        keep = True
        for k in range(count if L[CONVEX, b] > 0.0 else 0):
            better = L[BRANCH, k] == L[BRANCH, b] and k != b and L[LEAST, k] < L[LEAST, b]
            keep = keep and not (better and L[LEAST, k] < min(promised, L[LEAST, b]))
        L[AT, b] = L[AT, b] if keep else math.nan
    for b in range(count):
        if not math.isnan(L[AT, b]):
            for r in range(LANE_ROWS):
                L[r, kept] = L[r, b]
            kept += 1
    return kept


@jit
def finish(count: int, L: Array) -> None:
    """Take the last steps, which were not evaluated, where they are small and the derivative is, too.

    It is not where the image of a joint jumps. A step to the middle of a bracket is not what the derivative asks
    for.
    """
    for b in range(count):
        d, slope = abs(L[AT, b] - L[BEFORE, b]), abs(L[G_BEFORE, b])
        asked = slope <= 10.0 * (1.0 + L[RATE, b]) * d and L[RATE, b] * d <= 10.0 * slope
        if L[BEST, b] == L[BEFORE, b] and asked and 10.0 * (1.0 + L[RATE, b]) * d < 1e-2:
            L[BEST, b] = L[AT, b]


@jit
def best_of(branch: int, psi: float, count: int, L: Array) -> tuple[float, float]:
    """(parameter, F) of a branch's best lane; (`psi`, infinity) if it has none."""
    least = math.inf
    for b in range(count):
        if L[BRANCH, b] == branch and L[LEAST, b] < least:
            least, psi = L[LEAST, b], L[BEST, b]
    return psi, least
