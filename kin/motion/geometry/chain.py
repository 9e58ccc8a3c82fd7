"""A chain of curves with one joint path: followed, then a spline through nodes that are dense enough.

The spline meets the curves at its nodes; between them it is compared with the curves, and nodes are added until it
is within `DEVIATION` everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import jit
from kin.kernels.fk import fk_into
from kin.motion.geometry.curves import Curve
from kin.motion.geometry.redundancy import relax
from kin.motion.geometry.splines import spline, values, values_into
from kin.motion.geometry.tables import Table, poses_into
from kin.motion.geometry.tracking import follow, settle
from kin.robot import Robot
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.transforms import Array

DEVIATION = 4e-7  # metres and radians; what lies between the points that are compared stays below 1e-6
ROWS = {POSE: 6, APPROACH: 5, POSITION: 3}
_NODES = 24  # per curve at first
_MOST_NODES, _ROUNDS = 20_000, 12
_STEP = 0.2  # radians or metres that a joint may move between the nodes that are followed
_CLOSEST = 1e-7  # of the whole length: nodes that are closer are not parted
_MOVING = (0.2, 0.02)  # weights of motion where a joint is left over; the second one if a limit is passed
_BETWEEN = (0.2, 0.5, 0.8)


class LostError(Exception):
    """The curves cannot be followed: the path up to there; its last configuration does not continue it."""

    def __init__(self, s: Array, q: Array) -> None:
        super().__init__(float(s[-1]))
        self.s, self.q = s, q


class Chain:
    """Curves one after the other.

    Args:
        curves: the curves.
        offsets: which s of its own curve each begins at.
        starts: ``(k + 1,)`` has s where each begins, and the end.
    """

    def __init__(self, curves: Sequence[Curve], offsets: Sequence[float], starts: Array) -> None:
        table = Table()
        self.starts = starts
        self._which = np.array([table.index(curve) for curve in curves])
        self._numbers, self._offsets = table.numbers, np.array(offsets)

    def poses(self, s: Array) -> Array:
        """T_base_tool ``(m, 4, 4)`` at s ``(m,)``."""
        out: Array = np.empty((len(s), 4, 4))
        poses_into(self._numbers, self._which, self.starts, self._offsets, s, out)
        return out


def first_nodes(starts: Array) -> Array:
    """Evenly spaced nodes on each curve."""
    parts = [np.linspace(a, b, _NODES, endpoint=False) for a, b in pairwise(starts)]
    return np.concatenate([*parts, starts[-1:]])


def followed(
    robot: Robot, chain: Chain, q_start: Array, code: int, cancel: Callable[[], None]
) -> tuple[Array, Array]:
    """The joint path of a chain: knots ``(k + 1,)`` and coefficients ``(k, n, 4)``.

    Raises:
        LostError: where it cannot be followed.
    """
    s, q = _nodes(robot, chain, first_nodes(chain.starts), q_start, code, cancel)
    if robot.n == ROWS[code] + 1:
        _relax(robot, chain, s, q, ROWS[code], cancel)
    for _ in range(_ROUNDS):
        cancel()
        pieces = spline(s, q)
        off = _deviation(robot, chain, s, pieces, code)
        if not (off > DEVIATION).any():
            return s, pieces
        worst = int(np.argmax(off))
        if len(s) > _MOST_NODES:
            break
        parts = np.clip(np.ceil((off / (0.5 * DEVIATION)) ** 0.25), 2, 8)
        parts = np.where(off > DEVIATION, parts, 1.0).astype(np.int64)
        finer, rows, new = _parted(s, q, parts)
        guesses = np.ascontiguousarray(values(s, pieces, finer[new]))
        errors = np.empty(len(new))
        settle(robot.model, chain.poses(finer[new]), ROWS[code], guesses, errors)
        rows[new] = guesses
        if (errors > 1e-9).any():
            lost = int(new[int(np.argmax(errors > 1e-9))])
            raise LostError(finer[: lost + 1], rows[: lost + 1])
        s, q = finer, rows
    raise LostError(s[: worst + 2], q[: worst + 2])


def _relax(robot: Robot, chain: Chain, s: Array, q: Array, rows: int, cancel: Callable[[], None]) -> None:
    """Move a joint that is left over away from limits and singularities, further where a limit is passed."""
    bounds = np.ascontiguousarray(np.stack([robot.lower, robot.upper]))
    targets = chain.poses(s)
    for moving in _MOVING:
        cancel()
        relax(robot.model, targets, s, rows, bounds, 2.0 * _STEP, moving, q)
        if (q >= robot.lower).all() and (q <= robot.upper).all():
            return


def _parted(s: Array, q: Array, parts: NDArray[np.int64]) -> tuple[Array, Array, NDArray[np.int64]]:
    """Nodes with each interval cut into equal parts, their configurations, and which of them are new."""
    old = np.repeat(np.arange(len(parts)), parts)
    step = np.arange(len(old)) - np.repeat(np.cumsum(parts) - parts, parts)
    finer = np.append(s[old] + (np.diff(s) / parts)[old] * step, s[-1])
    return finer, np.append(q[old], q[-1:], axis=0), np.flatnonzero(step > 0)


def _nodes(
    robot: Robot, chain: Chain, s: Array, q_start: Array, code: int, cancel: Callable[[], None]
) -> tuple[Array, Array]:
    """Configurations at the nodes, and at further ones where a joint moves far."""
    bounds = np.ascontiguousarray(np.stack([robot.lower, robot.upper]))
    closest = _CLOSEST * float(s[-1])
    targets, q, done = chain.poses(s), np.empty((len(s), robot.n)), 1
    q[0] = q_start
    while True:
        cancel()
        done = follow(robot.model, targets, s, ROWS[code], bounds, _STEP, done, q)
        if done >= len(s):
            return s, q
        if s[done] - s[done - 1] < closest or len(s) > _MOST_NODES:
            raise LostError(s[: done + 1], q[: done + 1])
        between = 0.5 * (s[done - 1] + s[done])
        s = np.insert(s, done, between)
        targets = np.insert(targets, done, chain.poses(np.array([between])), axis=0)
        q = np.insert(q, done, 0.0, axis=0)


def _deviation(robot: Robot, chain: Chain, s: Array, pieces: Array, code: int) -> Array:
    """By how much the spline leaves the curves on each interval: metres or radians, whichever is more ``(k,)``."""
    at = (s[:-1, None] + np.diff(s)[:, None] * _BETWEEN).ravel()
    off, q = np.zeros(len(s) - 1), np.empty((len(at), robot.n))
    values_into(s, pieces, at, q)
    _compare(robot.model, q, chain.poses(at), len(_BETWEEN), ROWS[code], off)
    return off


@jit
def _compare(model: Array, q: Array, goals: Array, points: int, rows: int, off: Array) -> None:
    """off ← the largest distance from a goal, of each so many configurations; `rows` as in `follow`."""
    T = np.empty((4, 4))
    for i in range(q.shape[0]):
        fk_into(model, q[i], T)
        goal, away, turn = goals[i], 0.0, 0.0
        for r in range(3):
            away += (T[r, 3] - goal[r, 3]) ** 2
            for c in range(3 if rows == 3 else (2 if rows == 5 else 0), 3):
                turn += (T[r, c] - goal[r, c]) ** 2
        turn = turn if rows == 5 else 0.5 * turn
        off[i // points] = max(off[i // points], math.sqrt(max(away, turn)))
