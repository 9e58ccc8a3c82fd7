"""Smoothing: samples make a staircase, which is straightened as if springs joined the neighbours.

The sum of squares is the energy of a chain of springs, and the task leaves each waypoint a tangent to move along.
A Newton step of all waypoints together is one block tridiagonal system. Solutions of the closed form near that
step are proposed, and Viterbi's algorithm chooses between the present path and the proposals, so a path never gets
worse. This also determines the angles that singular poses leave open. The result is a local minimum, not provably
the global one.
"""

from __future__ import annotations

import numpy as np

from kin.fk import fk
from kin.kernels.compile import jit
from kin.kernels.fk import fk_into
from kin.path.configurations import branches_near, descended, meeting
from kin.path.viterbi import shortest
from kin.path.waypoints import LayerSequence, Waypoint, has_closed_form
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.numeric.error import relative_pose
from kin.transforms import Array

# Rounds, relative improvement that is not worth another one, largest pull on a jump; stiffness off the tangent and
# of a joint held at its limit, radians that a joint may move in one step, half the width of a difference.
_ROUNDS, _CONVERGED, _MOST_PULL = 24, 1e-5, 256.0
_STIFF, _RIGID, _TRUST, _DELTA = 1e6, 1e9, 0.6, 1e-6


def smoothed(sequence: LayerSequence, q: Array) -> Array:
    """The path ``(s, n)``, straightened while its cost falls.

    After that, steps that are still jumps get stiffer and stiffer springs, so that other steps take over their
    motion.
    """
    settings = sequence.settings
    cost, pull = sequence.cost(q), 1.0
    for _ in range(_ROUNDS):
        step = _newton_step(sequence, q, pull)
        layers = [_proposals(*each) for each in zip(sequence.waypoints, q, step, strict=True)]
        trellis = shortest(settings, layers, sequence.spans, np.zeros(q.shape[1]), settings.max_step)
        q = trellis.path(layers)
        before, cost = cost, sequence.cost(q)
        if cost[0] < before[0] or cost[1] < before[1] * (1.0 - _CONVERGED):
            pull = 1.0
        elif cost[0] == 0 or pull >= _MOST_PULL:
            break
        else:
            pull *= 4.0
    return q


def _proposals(waypoint: Waypoint, q: Array, step: Array) -> Array:
    """q ``(n,)`` and solutions near the end of a step and near a part of it ``(m, n)``."""
    seeds = [q + part * step for part in (1.0, 0.3)]
    if has_closed_form(waypoint.problem):
        rows = np.concatenate([branches_near(waypoint.problem, seed).q for seed in seeds])
        more = meeting(waypoint.problem, waypoint.relaxed, rows, q)
    else:
        more = descended(waypoint.problem, np.array(seeds))
    return np.concatenate([q[None], more])


def _newton_step(sequence: LayerSequence, q: Array, pull: float) -> Array:
    """The step ``(s, n)`` to the smallest sum of squares along the tangents of the task, inside the limits.

    Jumps count `pull` times. Springs join neighbours only, so the normal equations are block tridiagonal. Motion
    off the tangent is made stiff; joints that would pass a limit are held at it in a second and third pass.
    """
    settings = sequence.settings
    problem, weight = settings.problem, settings.weight
    k, n = q.shape
    tangents = np.empty((k, 6, n))
    for waypoint, row, out in zip(sequence.waypoints, q, tangents, strict=True):
        target, mask = waypoint.problem.T, problem.mask
        if waypoint.problem.code != MASK:
            kept = {POSE: 6, APPROACH: 5, POSITION: 3}[waypoint.problem.code]
            target, mask = fk(problem.robot, row), np.array([float(r < kept) for r in range(6)] + [0.0])
        _tangent(problem.robot.model, target, mask, row.copy(), out)
    stiffness = np.array([settings.start_weight, *(1.0 / span for span in sequence.spans[1:]), 0.0])
    springs = stiffness[:, None] * weight**2
    springs[sequence.jumps(q)] *= pull
    stretch = springs * np.diff(np.concatenate([problem.seed[None], q, q[-1:]]), axis=0)
    force = stretch[1:] - stretch[:-1]
    blocks = _STIFF * np.swapaxes(tangents, 1, 2) @ tangents
    blocks += (springs[:-1] + springs[1:] + 1e-9)[:, None, :] * np.eye(n)
    low, high = problem.lower - q, problem.upper - q
    step = _sweep(blocks, springs[1:-1], force)
    held = np.zeros((k, n), dtype=np.bool_)
    for _ in range(2):
        passed = (step < low - 1e-9) | (step > high + 1e-9)
        if not passed.any():
            break
        held |= passed
        at_limit = _RIGID * held * np.clip(step, low, high)
        step = _sweep(blocks + (_RIGID * held)[:, None, :] * np.eye(n), springs[1:-1], force + at_limit)
    return np.clip(step, np.maximum(low, -_TRUST), np.minimum(high, _TRUST))


def _sweep(blocks: Array, links: Array, right: Array) -> Array:
    """Solve a block tridiagonal system: blocks ``(k, n, n)``, off the diagonal −diag(links) ``(k − 1, n)``."""
    k, n = right.shape
    ahead, found = np.empty((k, n, n)), np.empty((k, n))
    block, rest = blocks[0], right[0]
    for i in range(k):
        if i:
            block = blocks[i] - links[i - 1][:, None] * ahead[i - 1]
            rest = right[i] + links[i - 1] * found[i - 1]
        link = np.diag(links[i]) if i < k - 1 else np.zeros((n, n))
        sides = np.column_stack([link, rest])
        try:
            both = np.linalg.solve(block, sides)
        except np.linalg.LinAlgError:  # the springs vanish beside the tangents of an arm of kilometres
            both = np.linalg.lstsq(block, sides)[0]
        ahead[i], found[i] = both[:, :n], both[:, n]
    for i in range(k - 2, -1, -1):
        found[i] += ahead[i] @ found[i + 1]
    return found


@jit
def _tangent(model: Array, target: Array, mask: Array, q: Array, out: Array) -> None:
    """out ← derivative ``(6, n)`` of the masked coordinates of `relative_pose`, by central differences."""
    T, e = np.empty((4, 4)), np.empty(6)
    for j in range(q.shape[0]):
        x = q[j]
        for side in range(2):
            q[j] = x + _DELTA if side == 0 else x - _DELTA
            fk_into(model, q, T)
            relative_pose(T, target, mask[6] == 0.0, e)
            for r in range(6):
                out[r, j] = e[r] if side == 0 else mask[r] * (out[r, j] - e[r]) / (2.0 * _DELTA)
        q[j] = x
