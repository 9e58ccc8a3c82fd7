"""The tool's point alone: θ4 and the direction φ of the third link are redundancy parameters.

**φ for a given θ4.** The third link and the tool are one rigid link, the arm one of three links whose last
direction is free: exact arcs (:mod:`kin.solvers.planar`).

**θ4 for which some φ exists.** Such an interval ends where the other joints cannot move with the point held:
some of joints 1, 2 and 3 are at limits, and what is left of the chain is straight or folded. Then the distance
of the point from one of the first three axes, which depends on θ4 as ``a cos θ4 + b sin θ4 + c``, has one of a few
values. θ2 = 0 and θ2 = π count as limits, because the elbow changes its side there. Between neighbouring roots
nothing changes, so one test per piece decides it.

**θ4 for a given φ.** The third axis goes round a circle: exact arcs.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, excess, wrap
from kin.kernels.compile import jit
from kin.solvers.canonical import signed_box
from kin.solvers.common import (
    HIGH,
    LOW,
    NEAR,
    UNBOUNDED,
    clear,
    extend_arcs,
    lay_probes,
    misfit_of,
    nearest_in_arcs,
)
from kin.solvers.contract import POSITION
from kin.solvers.planar import (
    LINKS,
    TOOL_X,
    TOOL_Y,
    PlanarArm,
    distance_roots,
    held,
    planar_angles,
    planar_free,
)
from kin.solvers.planar4.branches import OFFSET, SIGN, SIZE
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REACH = TOLERANCES.reach
_BREAKS = 96
ARCS = 256  # the most intervals of each parameter

# The point (x, y), the links a, b, c, and the point (p, q) in the frame of axis 4.
Chain = tuple[float, float, float, float, float, float, float]


@jit
def solve_point(
    params: Array, T: Array, asked: Array, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int, int]:
    """out ``(2, 6)`` ← joint values, φ and canonical θ4 of both branches: (gap in metres, arcs of θ4, arcs of φ).

    asked ``(2,)``: θ4 (canonical) and φ, NaN to let them be chosen near the seed. arcs ``(2, ARCS, 3)`` ← those of
    canonical θ4, on a circle, then those of φ.
    """
    clear(out)
    box, angles = np.empty((3, 4)), np.empty(4)
    signed_box(near, lower, upper, params[SIGN:OFFSET], params[OFFSET:SIZE], box)
    x, y, _, _ = held(params, T, POSITION)
    a, b, c, p, q = params[LINKS], params[LINKS + 1], params[LINKS + 2], params[TOOL_X], params[TOOL_Y]
    chain = (x, y, a, b, c, p, q)
    given = not math.isnan(asked[1])
    phi = asked[1] if given else box[NEAR, 0] + box[NEAR, 1] + box[NEAR, 2]
    first, second = 0, 0
    for row in range(2):
        up = 1.0 - 2.0 * row
        t4, first = _choose_theta4(chain, (up, asked[0], asked[1]), row, box, arcs[0], first)
        if math.isnan(t4):
            continue
        before = second
        chosen, second = planar_free(
            _at(chain, t4), (up, 0.0, 0.0), (phi, given), row, box, arcs[1], second, angles
        )
        if excess(t4, box[LOW, 3], box[HIGH, 3]) > 0.0:
            second = before
        if not math.isnan(chosen):
            angles[3] = t4
            for i in range(4):
                out[row, i] = wrap(params[SIGN + i] * (angles[i] - params[OFFSET + i]))
            out[row, 4], out[row, 5] = chosen, t4
    R, e = math.hypot(x, y), math.hypot(p, q)
    return 2.0 * max(R, a, b, c, e) - (R + a + b + c + e), first, second


@jit
def _choose_theta4(
    chain: Chain, request: tuple[float, float, float], row: int, box: Array, arcs: Array, found: int
) -> tuple[float, int]:
    """Canonical θ4 of a branch, and the new number of intervals in `arcs`, which are appended.

    request: the sign of the elbow, θ4 and φ, NaN where they are free. θ4 is the feasible value nearest to the
    seed's; if only the limits prevent one, the nearest without them; NaN if there is none.
    """
    up, t4, phi = request
    wanted = min(max(box[NEAR, 3], box[LOW, 3]), box[HIGH, 3])
    breaks, probes = np.empty(_BREAKS), np.empty(2 * _BREAKS + 2)
    n = lay_probes(breaks, _theta4_breaks(chain, phi, box, breaks), probes)
    after = _theta4_arcs(chain, up, phi, box, probes[:n], row, arcs, found)
    if not math.isnan(t4):
        return t4, after
    if after > found:
        return nearest_in_arcs(arcs, found, after, wanted), after
    free, others = box.copy(), np.empty((ARCS, 3))
    for i in range(4):
        free[LOW, i], free[HIGH, i] = -UNBOUNDED, UNBOUNDED
    n = lay_probes(breaks, _theta4_breaks(chain, phi, free, breaks), probes)
    count = _theta4_arcs(chain, up, phi, free, probes[:n], row, others, 0)
    return (nearest_in_arcs(others, 0, count, wanted) if count > 0 else math.nan), after


@jit
def _at(chain: Chain, t4: float) -> PlanarArm:
    """The arm of three links that is left at one θ4."""
    x, y, a, b, c, p, q = chain
    s, k = math.sin(t4), math.cos(t4)
    return x, y, c + p * k - q * s, p * s + q * k, a, b


@jit
def _theta4_arcs(
    chain: Chain, up: float, phi: float, box: Array, probes: Array, row: int, arcs: Array, found: int
) -> int:
    """Append the feasible intervals of canonical θ4 between the probes; returns the new number."""
    n = probes.shape[0]
    feasible = np.zeros(n, dtype=np.bool_)
    scratch, angles, side = np.empty((64, 3)), np.empty(4), (up, 0.0, 0.0)
    for odd in (1, 0):  # the ends of a feasible piece are feasible
        for k in range(odd if n > 1 else 0, n, 2):
            if odd == 0 and n > 1 and (feasible[k - 1] or feasible[k + 1]):
                feasible[k] = True
            elif excess(probes[k], box[LOW, 3], box[HIGH, 3]) > 0.0:
                feasible[k] = False
            elif math.isnan(phi):
                side = (up, 0.0, 0.0)
                feasible[k] = (
                    planar_free(_at(chain, probes[k]), side, (0.0, False), row, box, scratch, 0, angles)[1] > 0
                )
            else:
                miss = planar_angles(_at(chain, probes[k]), side, phi, box, angles)
                feasible[k] = miss <= _REACH and misfit_of(angles, box[LOW], box[HIGH], 0, 3) == 0.0
    first = found
    for k in range(n):
        if feasible[k] and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, row, probes, k, n)
    return found


@jit
def _theta4_breaks(chain: Chain, phi: float, box: Array, breaks: Array) -> int:
    """breaks ← every canonical θ4 where an interval may end, for any φ (NaN) or a given one; returns how many."""
    count = _breaks_at(chain, phi, box, breaks) if not math.isnan(phi) else _breaks_of_all(chain, box, breaks)
    if box[HIGH, 3] - box[LOW, 3] < TURN:
        breaks[count], breaks[count + 1] = wrap(box[LOW, 3]), wrap(box[HIGH, 3])
        count += 2
    return count


@jit
def _limits_of(box: Array, joint: int, values: Array) -> int:
    """values ← the limits of a joint that bind, and where the elbow changes its side; returns how many."""
    count = 0
    if box[HIGH, joint] - box[LOW, joint] < TURN:
        values[0], values[1] = box[LOW, joint], box[HIGH, joint]
        count = 2
    if joint == 1:
        values[count], values[count + 1] = 0.0, math.pi
        count += 2
    return count


@jit
def _away(chain: Chain, k: tuple[float, float], distance: float, breaks: Array, count: int) -> int:
    """Append the θ4 at which a point k in the frame of axis 3, turned by π, is this far from the tool's point."""
    _, _, _, _, _, p, q = chain
    return int(distance_roots(-k[0], -k[1], p, q, distance * distance, breaks, count))


@jit
def _breaks_of_all(chain: Chain, box: Array, breaks: Array) -> int:
    """The θ4 at which the point's distance from axis 1, 2 or 3 is that of a chain which cannot move.

    The distance from axis 3 is |k|, k = (c, 0) + Rz(θ4) (p, q). From axes 2 and 1 other vectors take the place of
    (c, 0), once θ3, or θ2 and θ3, are given.
    """
    x, y, a, b, c, _, _ = chain
    R, count = math.hypot(x, y), 0
    one, two, three = np.empty(4), np.empty(4), np.empty(4)
    ones, twos, threes = _limits_of(box, 0, one), _limits_of(box, 1, two), _limits_of(box, 2, three)
    for i in range(ones):
        u, v = x - a * math.cos(one[i]), y - a * math.sin(one[i])
        D = math.hypot(u, v)
        for sign in (1.0, -1.0):
            count = _away(chain, (c, 0.0), abs(D + sign * b), breaks, count)
        for j in range(twos):
            t = one[i] + two[j]
            count = _away(chain, (c, 0.0), math.hypot(u - b * math.cos(t), v - b * math.sin(t)), breaks, count)
        for j in range(threes):
            count = _away(chain, _from_axis_2(b, c, three[j]), D, breaks, count)
    for i in range(twos):
        D = math.hypot(a + b * math.cos(two[i]), b * math.sin(two[i]))
        for sign in (1.0, -1.0):
            count = _away(chain, (c, 0.0), abs(R + sign * D), breaks, count)
        for j in range(threes):
            w, t = _from_axis_2(b, c, three[j]), -two[i] - three[j]
            count = _away(chain, (w[0] + a * math.cos(t), w[1] + a * math.sin(t)), R, breaks, count)
    for i in range(threes):
        for sign in (1.0, -1.0):
            count = _away(chain, _from_axis_2(b, c, three[i]), abs(R + sign * a), breaks, count)
    return count


@jit
def _from_axis_2(b: float, c: float, t3: float) -> tuple[float, float]:
    """From axis 2 to axis 4 in the frame of the third link, at one θ3."""
    return c + b * math.cos(t3), -b * math.sin(t3)


@jit
def _breaks_at(chain: Chain, phi: float, box: Array, breaks: Array) -> int:
    """The θ4 at which, with this φ, the first two links are straight or folded or a joint is at a limit."""
    x, y, a, b, c, p, q = chain
    k, s = math.cos(phi), math.sin(phi)
    # The third axis is at (u, v) − Rz(θ4) (px, qx).
    u, v, px, qx = x - c * k, y - c * s, p * k - q * s, p * s + q * k
    values, count = np.empty(4), 0
    for i in range(_limits_of(box, 0, values)):
        t = values[i]
        count = int(distance_roots(u - a * math.cos(t), v - a * math.sin(t), px, qx, b * b, breaks, count))
    for i in range(_limits_of(box, 1, values)):
        square = a * a + b * b + 2.0 * a * b * math.cos(values[i])
        count = int(distance_roots(u, v, px, qx, square, breaks, count))
    for i in range(_limits_of(box, 2, values)):
        t = phi - values[i]
        count = int(distance_roots(u - b * math.cos(t), v - b * math.sin(t), px, qx, a * a, breaks, count))
    return count
