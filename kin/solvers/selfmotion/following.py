"""Self-motions that have been followed, for Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kin.solvers.selfmotion.tracing import CURVES, PATHS, PIECES, Paths, trace
from kin.transforms import Array


class Motions:
    """The self-motions of one target that have been followed, as far as they come close to keeping the limits.

    Args:
        model, T, setting, limits, margin: as for `trace`.
    """

    def __init__(self, model: Array, T: Array, setting: Array, limits: Array, margin: float) -> None:
        self._goal = model, T, setting, limits, margin
        self._paths = Paths(np.empty((PATHS, 14)), np.zeros(1 + CURVES, dtype=np.int64))

    def follow(self, starts: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """The feasible pieces of those through postures ``(k, 7)`` that are on none of the motions so far.

        Returns:
            Their ends and a value inside ``(m, 3)``, the postures there ``(m, 3, 7)``, and ``(k,)`` which motions
            were lost, see `trace`.
        """
        pieces, postures, starts = np.empty((PIECES, 3)), np.empty((PIECES, 3, 7)), starts.copy()
        count = trace(*self._goal, starts, self._paths, pieces, postures)
        return pieces[:count], postures[:count], np.isnan(starts[:, 0])

    @property
    def points(self) -> Array:
        """Points ``(m, 7)`` of all motions, one after the other."""
        count, *ends = self._paths.ends.tolist()
        return self._paths.points[: ends[count - 1] if count else 0, :7]
