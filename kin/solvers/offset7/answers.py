"""The kernel that computes all that the solver says of one target, so that Python makes a single call."""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.canonical import signed_box, turn_around
from kin.solvers.common import NEAR
from kin.solvers.offset7.branches import all_branches, branches_one, joints_of
from kin.solvers.offset7.geometry import OFFSET, REVERSED, SIGN
from kin.solvers.offset7.ranges import feasible
from kin.transforms import Array


@jit
def answer(
    params: Array, T: Array, joints: Array, requested: float, limited: bool, weight: float, arcs: Array, out: Array
) -> int:
    """out ``(8, 8)`` ← each branch at the requested value of the given joint; if that is NaN, at the feasible one
    at which the joints move least; behind the joint values, that value. NaN where a branch does not exist.

    arcs ``(INTERVALS, 3)`` ← the feasible intervals in one turn, rows (branch, low, high); returns their number, 0
    if a value is requested and limits do not matter. joints ``(3, 7)``: seed, lower and upper limits. weight:
    what a step of the given joint counts.
    """
    back = params[REVERSED] > 0.0
    given = 6 if back else 0
    seed, lower, upper = joints[0], joints[1], joints[2]
    box, chosen, q, chain = np.empty((3, 7)), np.empty(8), np.empty((8, 7)), np.empty((3, 7))
    for k in range(3):
        for i in range(7):
            chain[k, i] = joints[k, 6 - i if back else i]
    signed_box(chain[0], chain[1], chain[2], params[SIGN : SIGN + 7], params[OFFSET : OFFSET + 7], box)
    low, high = lower[given], upper[given]
    count = 0
    if math.isnan(requested) or limited:
        span = turn_around(low, high, seed[given])
        wanted = min(max(seed[given], span[0]), span[1])
        near = seed[given] if math.isnan(requested) else math.nan
        count = feasible(params, T, box, span, wanted, (near, weight), arcs, chosen)
    if math.isnan(requested):
        _rows_at(params, T, box[NEAR], chosen, q)
    else:
        branches_one(params, T, requested, seed, q)
    for k in range(8):
        for i in range(7):
            out[k, i] = q[k, i]
        there = math.nan if math.isnan(q[k, 0]) else requested
        out[k, 7] = chosen[k] if math.isnan(requested) else there
    return count


@jit
def _rows_at(params: Array, T: Array, near: Array, chosen: Array, out: Array) -> None:
    """out ``(8, 7)`` ← joint values of each branch at its value of the given joint, chosen ``(8,)``.

    NaN where a branch has none. near ``(7,)``: chain angles that decide what is free.
    """
    rows, margin, t, joints = np.empty((8, 7)), np.empty(8), near.copy(), np.empty((8, 7))
    last = math.nan
    for k in range(8):
        for i in range(7):
            out[k, i] = math.nan
        if math.isnan(chosen[k]):
            continue
        if chosen[k] != last:
            last = chosen[k]
            t[0] = params[SIGN] * last + params[OFFSET]
            all_branches(params, T, near, t, -1, rows, margin)
            joints_of(params, rows, last, joints)
        for i in range(7):
            out[k, i] = joints[k, i]
