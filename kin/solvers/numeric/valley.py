"""Descents that end a little beside their target are continued along the weakly controllable directions.

On an arm whose axes are nearly in a special position, by the rounding of its table for example, some motions of
the joints move the tool by next to nothing: the *weak* directions. A target may need far motion along them, but a
valley is curved, and a descent that takes straight steps across it goes no farther than the root of its error in
each. Here each step along the weak directions is followed by steps back to the floor along the others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kin.solvers.contract import POSITION
from kin.solvers.numeric.error import Goal, look, quadratic_model
from kin.solvers.numeric.step import Bounds, inside
from kin.transforms import Array

Flags = NDArray[np.bool_]
_WEAK = 3.0  # times the root of the error: singular values of weak directions
_NULL = 1e-13  # singular values of motions that do not move the tool at all
_STRIDES = (0.5, 0.15, 0.04, 0.01)  # rad or m, the longest step along the floor
_STEPS = 60
_NEARER = 0.97  # of the error, at most, is left after a step that counts
_PROMISED = 0.995  # of the error, at most, must the linear model leave
_RETURNS = 8  # steps back to the floor


def follow(model: Array, goal: Goal, bounds: Bounds, enough: float, q: Array) -> tuple[Array, float]:
    """Where the valley in which q ``(n,)`` is meets the target, inside the limits, and the error E there.

    Ends at E ≤ `enough`, or where no step along the floor makes the error smaller.
    """
    valley = _Valley(model, goal, bounds)
    at, error = q, valley.error(q)
    for _ in range(_STEPS):
        if error <= enough:
            break
        if not valley.leads_on(at):
            break
        steps = (valley.step(at, stride) for stride in _STRIDES)
        nearer = next(((there, left) for there, left in steps if left < _NEARER * error), None)
        if nearer is None:
            break
        at, error = nearer
    return at, error


class _Valley:
    """The error of a task around a configuration, split into strong and weak directions."""

    def __init__(self, model: Array, goal: Goal, bounds: Bounds) -> None:
        n = len(bounds[0])
        self.model, self.goal, self.bounds = model, goal, bounds
        self.chain = (np.empty((6, n)), np.empty((4, 4)), np.empty((n, 7)))
        self.e, self.scratch, self.H, self.g = np.empty(6), np.empty(6), np.empty((n, n)), np.empty(n)

    def error(self, q: Array) -> float:
        """E in metres."""
        return float(np.sqrt(2.0 * look(self.model, q, self.goal, self.chain, self.e)))

    def _linear(self, q: Array) -> tuple[Array, Array]:
        """The weighted error ``(6,)`` that is left, and its Jacobian ``(6, n)``."""
        look(self.model, q, self.goal, self.chain, self.e)
        J, T, _ = self.chain
        quadratic_model(self.goal, False, J, T, self.e, self.scratch, self.H, self.g)
        rows = 3 if self.goal[1] == POSITION else 6
        return self.e[:rows].copy(), J[:rows].copy()

    def leads_on(self, q: Array) -> bool:
        """Whether the longest step promises less error; it does not where the workspace ends."""
        e, J = self._linear(q)
        move, _ = self._along(q, e, J, _STRIDES[0])
        return bool(np.linalg.norm(e - J @ move) < _PROMISED * np.linalg.norm(e))

    def _along(self, q: Array, e: Array, J: Array, stride: float) -> tuple[Array, Flags]:
        """A step ``(n,)`` along the floor, and which joints a limit holds."""
        least = _WEAK * float(np.sqrt(np.linalg.norm(e)))
        held = np.zeros(len(q), dtype=bool)
        for _ in range(len(q) + 1):
            move = _step(e, J, held, least, stride)
            stopped = self._outwards(q, move) & ~held
            if not stopped.any():
                break
            held |= stopped
        return move, held

    def step(self, q: Array, stride: float) -> tuple[Array, float]:
        """A step along the floor, and back to it: the configuration, and the error there."""
        e, J = self._linear(q)
        least = _WEAK * float(np.sqrt(np.linalg.norm(e)))
        move, held = self._along(q, e, J, stride)
        at, error = self._moved(q, move)
        for _ in range(_RETURNS):
            e, J = self._linear(at)
            move = _step(e, J, held, least, 0.0)
            there, left = self._moved(at, move)
            if not left < 0.9 * error:
                break
            at, error = there, left
        return at, error

    def _outwards(self, q: Array, move: Array) -> Flags:
        """Which joints are at a limit that the move would pass."""
        lower, upper, turns = self.bounds
        there = q + move
        passes = (turns == 0.0) | (upper - lower < turns - 1e-9)
        return np.asarray(passes & (((q <= lower) & (there < lower)) | ((q >= upper) & (there > upper))))

    def _moved(self, q: Array, move: Array) -> tuple[Array, float]:
        lower, upper, turns = self.bounds
        ends = zip((q + move).tolist(), lower.tolist(), upper.tolist(), turns.tolist(), strict=True)
        at = np.array([inside(*end) for end in ends])
        return at, self.error(at)


def _step(e: Array, J: Array, held: Flags, least: float, stride: float) -> Array:
    """The step ``(n,)`` that removes the error in the strong directions and, of at most `stride`, in the weak."""
    J = np.where(held, 0.0, J)
    U, sigma, V = np.linalg.svd(J, full_matrices=False)
    parts = U.T @ e
    strong = sigma > least
    move = V[strong].T @ (parts[strong] / sigma[strong])
    weak = ~strong & (sigma > _NULL)
    if stride > 0.0:
        move = move + V[weak].T @ np.clip(parts[weak] / sigma[weak], -stride, stride)
    return np.asarray(move)
