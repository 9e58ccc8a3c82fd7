"""Kernels that the closed forms share: angles of a rotation, sums of two angles, and feasible arcs.

Two ideas are common to all families:

- **Z-Y-Z with a known first angle.** A rotation ``Rz(A) Ry(B) Rz(C)`` gives A from its third column up to the
  sign of sin B. B and C are then computed *given* A, so that the product reproduces the rotation to rounding
  error however small sin B is. Only where sin B vanishes is A free; then only A ± C matters, and the sum
  is split as near the seed as the limits allow.
- **Arcs.** If a rotation depends on a free angle ψ as ``M0 + M1 cos ψ + M2 sin ψ``, the values of ψ where one
  of its three angles meets a limit are roots of ``a cos ψ + b sin ψ + c = 0``. Between neighbouring roots
  nothing changes, so one test per arc decides it: the feasible set is exact, not sampled (Shimizu et al., IEEE
  Trans. Robotics 24(5), 2008).
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, excess, wrap
from kin.kernels.compile import jit
from kin.kernels.fk import sine_cosine
from kin.kernels.simd import atan2
from kin.tolerances import TOLERANCES
from kin.transforms import Array

UNBOUNDED = 1e6  # of a limit that never binds
NEAR, LOW, HIGH = range(3)  # rows of a box: seed and joint limits
_SINGULAR = TOLERANCES.singular
_LIMIT = TOLERANCES.limit
_INSET = TOLERANCES.interval_inset


@jit
def split_sum(
    total: float, near_a: float, low_a: float, high_a: float, near_c: float, low_c: float, high_c: float
) -> float:
    """A of the pair A + C = total (mod 2π) nearest to (near_a, near_c) inside both limits.

    For each whole turn the pairs form a line, and the box cuts a segment out of it: the foot of the
    perpendicular, clamped. When no turn fits, A stays within its own limits and C is left outside.
    """
    best = min(max(near_a, low_a), high_a)
    best_cost = math.inf
    middle = np.round((near_a + near_c - total) / TURN)
    for step in range(-3, 4):
        s = total + TURN * (middle + step)
        low = max(low_a, s - high_c)
        high = min(high_a, s - low_c)
        if low > high + _LIMIT:
            continue
        a = min(max(near_a + 0.5 * (s - near_a - near_c), low), max(low, high))
        cost = (a - near_a) ** 2 + (s - a - near_c) ** 2
        if cost < best_cost:
            best, best_cost = a, cost
    return best


@jit
def zyz(M: Array, sign: float, near: Array, low: Array, high: Array, first: int, out: Array) -> None:
    """out[first:first+3] ← (A, B, C) with ``M = Rz(A) Ry(B) Rz(C)`` and sin B of the given sign.

    `near`, `low`, `high` (indexed like `out`) only matter when sin B = 0 and A is free.
    """
    x = sign * M[0, 2]
    y = sign * M[1, 2]
    h = math.sqrt(x * x + y * y)
    if h < _SINGULAR:
        k = first + 2
        if M[2, 2] > 0.0:
            total = math.atan2(M[1, 0], M[0, 0])
            A = split_sum(total, near[first], low[first], high[first], near[k], low[k], high[k])
        else:
            total = math.atan2(-M[1, 0], -M[0, 0])
            A = split_sum(total, near[first], low[first], high[first], -near[k], -high[k], -low[k])
        c = math.cos(A)
        s = math.sin(A)
        h = sign * (c * x + s * y)
    else:
        A = atan2(y, x)
        c, s = x / h, y / h
        h *= sign
    out[first] = A
    out[first + 1] = atan2(h, M[2, 2])
    out[first + 2] = atan2(c * M[1, 0] - s * M[0, 0], c * M[1, 1] - s * M[0, 1])


@jit
def add_roots(a: float, b: float, c: float, breaks: Array, count: int) -> int:
    """Append the roots of ``a cos ψ + b sin ψ + c = 0`` in (−π, π]; returns the new count.

    A root that is missed by rounding error only (|c| just above the amplitude) is kept as the touching point.
    """
    amplitude = math.sqrt(a * a + b * b)
    if amplitude < 1e-15 or abs(c) > amplitude * (1.0 + 1e-9):
        return count
    centre = atan2(b, a)
    offset = atan2(math.sqrt(max((amplitude - c) * (amplitude + c), 0.0)), -c)
    breaks[count] = wrap(centre + offset)
    breaks[count + 1] = wrap(centre - offset)
    return count + 2


@jit
def zyz_conditions(M: Array, limits: tuple[Array, Array], first: int, rows: Array, count: int) -> int:
    """Append (a, b, c) to rows ``(3, n)``: ``a cos ψ + b sin ψ + c = 0`` where an angle may meet a limit.

    M ``(3, 3, 3)``: M0, M1, M2 of ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ``; limits: lower and upper ones,
    of A, B, C from `first` on. Third column (cA sB, sA sB, cB), third row (−sB cC, sB sC, cB): A and C are of the
    tan type, B of the cos type. Angles whose limits span a whole turn never bind.
    """
    low, high = limits
    for side in range(2):
        for i in range(3):
            k = first + i
            # A locked joint has one limit, not two.
            if not (high[k] - low[k] < TURN and (side == 0 or high[k] > low[k])):
                continue
            s, c = sine_cosine(low[k] if side == 0 else high[k])
            for part in range(3):
                P = M[part]
                if i == 0:
                    value = P[1, 2] * c - P[0, 2] * s
                elif i == 1:
                    value = P[2, 2] - c if part == 0 else P[2, 2]
                else:
                    value = P[2, 1] * c + P[2, 0] * s
                rows[(part + 2) % 3, count] = value
            count += 1
    return count


@jit
def zyz_breaks(M: Array, limits: tuple[Array, Array], first: int, breaks: Array, count: int) -> int:
    """Append every ψ where an angle of ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ`` may meet a limit.

    They are the roots of `zyz_conditions`, and the extremes of cos B: there A and C may jump by π, and a limit of
    B may just be touched.
    """
    rows = np.empty((3, 6))
    for k in range(zyz_conditions(M, limits, first, rows, 0)):
        count = add_roots(rows[0, k], rows[1, k], rows[2, k], breaks, count)
    return add_extremes(M, breaks, count)


@jit
def add_extremes(M: Array, breaks: Array, count: int) -> int:
    """Append the two ψ at which cos B of ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ`` is extreme."""
    if M[1, 2, 2] * M[1, 2, 2] + M[2, 2, 2] * M[2, 2, 2] > 1e-30:
        extreme = atan2(M[2, 2, 2], M[1, 2, 2])
        breaks[count] = extreme
        breaks[count + 1] = wrap(extreme + math.pi)
        count += 2
    return count


@jit
def circular_clamp(value: float, low: float, high: float) -> float:
    """The angle of the arc [low, high] (low ≤ high, any turn) nearest to `value`, slightly inside its ends."""
    inset = min(_INSET, 0.5 * (high - low))
    middle = 0.5 * (low + high)
    v = middle + wrap(value - middle)
    return min(max(v, low + inset), high - inset)


@jit
def clear(out: Array) -> None:
    """out ← NaN everywhere ``(k, m)``."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = math.nan


@jit
def copy_row(out: Array, source: int, target: int) -> None:
    """out[target] ← out[source]: two branches that have merged are both there, with the same joints."""
    for j in range(out.shape[1]):
        out[target, j] = out[source, j]


@jit
def shifted(values: Array, offset: Array) -> Array:
    """values + offset ``(n,)``."""
    out = np.empty(values.shape[0])
    for i in range(values.shape[0]):
        out[i] = values[i] + offset[i]
    return out


@jit
def misfit_of(angles: Array, low: Array, high: Array, first: int, last: int) -> float:
    """Sum over the angles first…last−1 of how far outside its limits each one is."""
    total = 0.0
    for i in range(first, last):
        total += excess(angles[i], low[i], high[i])
    return total


@jit
def lay_probes(breaks: Array, count: int, probes: Array) -> int:
    """probes ← point, middle, point, middle, … round the circle: each break and the middle of each arc.

    Sorts `breaks` in place (there are few); probes[even] are breaks. With no break at all one probe stands for the
    whole circle.
    """
    if count == 0:
        probes[0] = 0.0
        return 1
    for i in range(1, count):
        moving = breaks[i]
        j = i - 1
        while j >= 0 and breaks[j] > moving:
            breaks[j + 1] = breaks[j]
            j -= 1
        breaks[j + 1] = moving
    n = 0
    for i in range(count):
        after = breaks[i + 1] if i + 1 < count else breaks[0] + TURN
        probes[n] = breaks[i]
        probes[n + 1] = 0.5 * (breaks[i] + after)
        n += 2
    return n


@jit
def extend_arcs(arcs: Array, first: int, found: int, branch: int, probes: Array, j: int, n: int) -> int:
    """Add the piece that probe j stands for to the branch's arcs, growing the last one where they touch."""
    if n == 1:
        low, high = -math.pi, math.pi
    elif j % 2 == 0:
        low, high = probes[j], probes[j]
    else:
        low = probes[j - 1]
        high = probes[j + 1] if j + 1 < n else probes[0] + TURN
    if found > first and low <= arcs[found - 1, 2]:
        arcs[found - 1, 2] = max(high, arcs[found - 1, 2])
        return found
    arcs[found, 0] = branch
    arcs[found, 1] = low
    arcs[found, 2] = high
    return found + 1


@jit
def nearest_in_arcs(arcs: Array, first: int, found: int, wanted: float) -> float:
    """The angle of the arcs first…found−1 nearest to the wanted one; that one itself if there is no arc."""
    best = wanted
    best_distance = math.inf
    for i in range(first, found):
        v = circular_clamp(wanted, arcs[i, 1], arcs[i, 2])
        distance = abs(wrap(v - wanted))
        if distance < best_distance:
            best, best_distance = v, distance
    return best
