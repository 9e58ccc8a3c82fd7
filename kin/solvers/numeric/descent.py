"""One descent: damped Gauss–Newton or Newton steps to a local minimum of the task error inside the limits."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.contract import MASK
from kin.solvers.numeric.error import Goal, look, quadratic_model
from kin.solvers.numeric.step import Bounds, bounded_step, hold, inside, promised_decrease
from kin.transforms import Array

# Damping at least, as a share of the largest entry of JᵀJ. Close to a singularity convergence needs it small; with
# the whole Hessian (a radian worth a metre) a small one would turn rounding errors into motion of what is free.
_FLOOR = 1e-15
_BENT_FLOOR = 1e-8
# Half of E² below which a descent has arrived (E = 4e-14 m), and below which it is as good as there.
_ARRIVED = 1e-27
_THERE = 1e-20


@jit
def descend(model: Array, goal: Goal, bounds: Bounds, steps: int, patience: int, q: Array) -> float:
    """Move q, in place, to a local minimum of E inside the limits; returns E there (metres).

    With a patience, the descent ends as soon as E² does not halve within that many steps, and the model is
    Gauss–Newton's; without (0) it is followed to the minimum.
    """
    n = q.shape[0]
    chain = (np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7)))
    H, L, g, e, scratch = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(6), np.empty(6)
    step, trial, held = np.empty(n), np.empty(n), np.empty(n, dtype=np.bool_)
    for i in range(n):
        q[i] = inside(q[i], bounds[0][i], bounds[1][i], bounds[2][i])
    cost = look(model, q, goal, chain, e)
    before = cost
    damping = 0.1
    bent = False
    for count in range(steps):
        if cost < _ARRIVED:
            break
        if patience > 0 and count > 0 and count % patience == 0:
            if cost > 0.5 * before and cost > 1e-6:
                break
            before = cost
        largest = quadratic_model(goal, bent, chain[0], chain[1], e, scratch, H, g)
        if hold(q, g, bounds, held) < 1e-15:
            break
        floor = (max(_BENT_FLOOR * goal[3] * goal[3], _FLOOR) if bent else _FLOOR) * largest
        better, promised, grow, settled = math.inf, 0.0, 2.0, False
        while damping * cost < 1e4 * largest:
            if bounded_step(H, g, q, bounds, damping * cost + floor, held, L, step, trial):
                promised = promised_decrease(H, g, step)
                better = look(model, trial, goal, chain, e)
                settled = abs(promised) < 1e-14 * cost and cost > _THERE
                if better < cost or cost < _THERE or settled:
                    break
            damping = max(damping, 1e-9) * grow
            grow *= 2.0
        # The joints have half of their digits when E no longer decreases: the last step gives the others.
        if not (better < cost or (settled and better <= cost * (1.0 + 1e-14))):
            break
        for i in range(n):
            q[i] = trial[i]
        gain = cost - better
        # Far from zero and slow: this is a minimum with an error that stays.
        bent = patience == 0 and goal[1] != MASK and gain < 0.5 * cost
        cost = better
        if promised > 0.0:
            damping = max(damping * max(0.1, 1.0 - (2.0 * gain / promised - 1.0) ** 3), 1e-12)
        if settled or (gain < 1e-15 * cost and cost > _THERE):
            break
    return math.sqrt(2.0 * cost)
