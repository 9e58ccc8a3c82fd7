"""θ1 with the wrist centre on axis 1, where it is a redundancy parameter: feasible intervals and choice."""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, wrap
from kin.kernels.compile import jit
from kin.solvers.common import HIGH, LOW, NEAR, add_roots, extend_arcs, lay_probes, misfit_of, nearest_in_arcs
from kin.solvers.wrist5.geometry import wrist_angles
from kin.transforms import Array


@jit
def _theta1_breaks(t23: float, a: Array, box: Array, breaks: Array) -> int:
    """breaks ← every θ1 at which θ1, θ4 or θ5 may meet a limit; returns their number.

    The extremes of cos θ5 are among them: θ4 may jump by π there.
    """
    c23, s23 = math.cos(t23), math.sin(t23)
    count = 0
    for row in (LOW, HIGH):
        if box[HIGH, 0] - box[LOW, 0] < TURN:
            breaks[count] = wrap(box[row, 0])
            count += 1
        if box[HIGH, 3] - box[LOW, 3] < TURN:
            c, s = math.cos(box[row, 3]), math.sin(box[row, 3])
            count = add_roots(
                -a[1] * c - s23 * a[0] * s, a[0] * c - s23 * a[1] * s, -c23 * a[2] * s, breaks, count
            )
        if box[HIGH, 4] - box[LOW, 4] < TURN:
            count = add_roots(c23 * a[0], c23 * a[1], -s23 * a[2] - math.cos(box[row, 4]), breaks, count)
    extreme = math.atan2(a[1], a[0])
    breaks[count] = extreme
    breaks[count + 1] = wrap(extreme + math.pi)
    return count + 2


@jit
def choose_theta1(
    t23: float, a: Array, branch: int, requested: float, box: Array, arcs: Array, found: int
) -> tuple[float, int]:
    """Canonical θ1 for a wrist centre on axis 1, and the new number of feasible intervals in arcs ``(n, 3)``.

    Without a requested value (NaN) it is the feasible one nearest to the seed's; if none is feasible, the tested
    one with the least excess over the limits. The intervals are those of one branch, given θ23 = θ2 + θ3 and the
    approach direction a ``(3,)``.
    """
    breaks, probes, angles = np.empty(32), np.empty(66), np.empty(5)
    n = lay_probes(breaks, _theta1_breaks(t23, a, box, breaks), probes) if arcs.shape[0] > 0 else 0
    first = found
    best = math.inf
    t1 = box[NEAR, 0]
    for j in range(n):
        angles[0] = probes[j]
        wrist_angles(probes[j], t23, a, branch, box, angles)
        misfit = misfit_of(angles, box[LOW], box[HIGH], 0, 1) + misfit_of(angles, box[LOW], box[HIGH], 3, 5)
        if misfit == 0.0 and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, branch, probes, j, n)
        elif misfit < best and found == first:
            best, t1 = misfit, probes[j]
    if not math.isnan(requested):
        t1 = requested
    elif found > first:
        t1 = nearest_in_arcs(arcs, first, found, box[NEAR, 0])
    return t1, found
