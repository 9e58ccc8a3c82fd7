"""Smoothing: samples make a staircase, which is drawn straight as if springs joined the neighbours.

The sum of squares is a chain of springs, and the task leaves each waypoint a tangent to move along. A Newton step
of all waypoints together is one block tridiagonal system. Solutions of the closed form near that step are then
proposed, and the search chooses between the present path and what is proposed, so a path never gets worse. This
also settles the angles that singular poses leave open. The end is a path that cannot be drawn straighter: not
provably the least of all.
"""

from __future__ import annotations

import numpy as np

from kin.fk import fk
from kin.kernels.compile import jit
from kin.kernels.fk import fk_into
from kin.path.course import Course, Stop, has_closed_form
from kin.path.trellis import shortest
from kin.path.waypoint import branches_near, descended, meeting
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION
from kin.solvers.pose import relative_pose
from kin.transforms import Array

# Rounds, share of the cost that is not worth another one, hardest pull on a jump; stiffness across the tangent and
# of a joint held at its stop, radians a joint may go in one step, half width of a difference.
_ROUNDS, _SETTLED, _HARDEST = 24, 1e-5, 256.0
_STIFF, _RIGID, _TRUST, _DELTA = 1e6, 1e9, 0.6, 1e-6


def smoothed(course: Course, q: Array) -> Array:
    """The path ``(s, n)`` drawn as straight as it gets without turning anything over; it never gets worse.

    Once it is, the steps that are still too large are drawn together harder and harder: the others may take over.
    """
    rank, pull = course.rank(q), 1.0
    for _ in range(_ROUNDS):
        step = _newton_step(course, q, pull)
        layers = [_proposed(stop, row, dq) for stop, row, dq in zip(course.stops, q, step, strict=True)]
        trellis = shortest(course.way, layers, course.spans, np.zeros(q.shape[1]), course.way.max_step)
        q = trellis.path(layers)
        before, rank = rank, course.rank(q)
        if rank[0] < before[0] or rank[1] < before[1] * (1.0 - _SETTLED):
            pull = 1.0
        elif rank[0] == 0 or pull >= _HARDEST:
            break
        else:
            pull *= 4.0
    return q


def _proposed(stop: Stop, q: Array, step: Array) -> Array:
    """q ``(n,)`` and the solutions near it, towards a step and parts of it ``(m, n)``."""
    wishes = [q + part * step for part in (1.0, 0.3)]
    if has_closed_form(stop.question):
        rows = np.concatenate([branches_near(stop.question, wish).q for wish in wishes])
        more = meeting(stop.question, stop.relaxed, rows, q)
    else:
        more = descended(stop.question, np.array(wishes))
    return np.concatenate([q[None], more])


def _newton_step(course: Course, q: Array, pull: float) -> Array:
    """The step ``(s, n)`` to the least sum of squares along the tangents of the task, inside the limits.

    Steps that are jumps count `pull` times.

    Springs join the neighbours, so the normal equations are block tridiagonal. Leaving the tangent is made stiff,
    and joints that would pass a stop are held at it in a second and third pass.
    """
    question, weight = course.way.question, course.way.weight
    k, n = q.shape
    tangents = np.empty((k, 6, n))
    for stop, row, out in zip(course.stops, q, tangents, strict=True):
        target, mask = stop.question.T, question.mask
        if stop.question.code != MASK:
            kept = {POSE: 6, APPROACH: 5, POSITION: 3}[stop.question.code]
            target, mask = fk(question.robot, row), np.array([float(r < kept) for r in range(6)] + [0.0])
        _tangent(question.robot.model, target, mask, row.copy(), out)
    springs = np.array([course.way.pull, *(1.0 / span for span in course.spans[1:]), 0.0])[:, None] * weight**2
    springs[course.leaps(q)] *= pull
    stretch = springs * np.diff(np.concatenate([question.seed[None], q, q[-1:]]), axis=0)
    force = stretch[1:] - stretch[:-1]
    blocks = _STIFF * np.swapaxes(tangents, 1, 2) @ tangents
    blocks += (springs[:-1] + springs[1:] + 1e-9)[:, None, :] * np.eye(n)
    low, high = question.lower - q, question.upper - q
    step = _sweep(blocks, springs[1:-1], force)
    held = np.zeros((k, n), dtype=np.bool_)
    for _ in range(2):
        passed = (step < low - 1e-9) | (step > high + 1e-9)
        if not passed.any():
            break
        held |= passed
        stops = _RIGID * held * np.clip(step, low, high)
        step = _sweep(blocks + (_RIGID * held)[:, None, :] * np.eye(n), springs[1:-1], force + stops)
    return np.clip(step, np.maximum(low, -_TRUST), np.minimum(high, _TRUST))


def _sweep(blocks: Array, links: Array, right: Array) -> Array:
    """Solve a block tridiagonal system: blocks ``(k, n, n)``, off the diagonal −diag(links) ``(k − 1, n)``."""
    k, n = right.shape
    ahead, known = np.empty((k, n, n)), np.empty((k, n))
    block, rest = blocks[0], right[0]
    for i in range(k):
        if i:
            block = blocks[i] - links[i - 1][:, None] * ahead[i - 1]
            rest = right[i] + links[i - 1] * known[i - 1]
        link = np.diag(links[i]) if i < k - 1 else np.zeros((n, n))
        both = np.linalg.solve(block, np.column_stack([link, rest]))
        ahead[i], known[i] = both[:, :n], both[:, n]
    for i in range(k - 2, -1, -1):
        known[i] += ahead[i] @ known[i + 1]
    return known


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
