"""What following the self-motions of one target finds, collected for Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from kin.kernels.compile import MODEL, direct, record, row_of
from kin.solvers.selfmotion.tracing import CURVES, PATHS, PIECES, Paths, trace
from kin.transforms import Array


class Followed:
    """The self-motions of one target that have been followed.

    Attributes:
        pieces, postures: what `follow` has found last: ends of feasible pieces and a value inside ``(PIECES, 3)``,
            and the postures there ``(PIECES, 3, 7)``.
        paths: the curves.
    """

    def __init__(self) -> None:
        self.pieces, self.postures = np.empty((PIECES, 3)), np.empty((PIECES, 3, 7))
        self.paths = Paths(np.empty((PATHS, 14)), np.zeros(1 + CURVES, dtype=np.int64))

    def follow(
        self, model: Array, T: Array, setting: Array, limits: Array, margin: float, starts: Array
    ) -> tuple[int, NDArray[np.bool_]]:
        """How many pieces of the curves through postures ``(k, 7)`` are now in `pieces` and `postures`.

        Also returns ``(k,)`` which curves were lost, see `trace`.
        """
        goal, starts = (model, T, setting, limits, margin), starts.copy()
        count = _trace()(*goal, starts, self.paths, self.pieces, self.postures)
        return count, np.isnan(starts[:, 0])

    @property
    def points(self) -> Array:
        """Points ``(m, 7)`` of all curves, curve after curve."""
        count, *ends = self.paths.ends.tolist()
        return self.paths.points[: ends[count - 1] if count else 0, :7]


@cache
def _trace() -> Callable[..., int]:
    """`trace` without type dispatch."""
    return direct(trace, MODEL, (4, 4), 1, 2, float, 2, record(Paths, 2, row_of(int)), 2, 3)
