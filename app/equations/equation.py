"""One equation of an arm: an entry of the tool's pose ``[n o a p]``, as it is printed and as it is right."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from app.equations.expression import Expression, astray
from kin.transforms import Array

Verdict = Literal["right", "misprinted", "unreadable", "derived"]

COLUMNS = "noap"
AXES = "xyz"


@dataclass(frozen=True)
class Equation:
    """One equation.

    Attributes:
        id: its key within the book: the chapter's number, or the entry for a derived one.
        number: the chapter's number; None for a derived one.
        entry: which entry, e.g. ``"p_x"``; ``"T"`` for the whole matrix.
        verdict: ``"right"`` if the printed form equals the DH product for every q.
        printed: as the chapter prints it; None for derived and unreadable ones.
        correct: what equals the DH product; None for the unreadable one.
        note: what is wrong with the printed form.
        worst: for a misprinted one, the configuration inside the limits, in radians, where that shows most: in the
            position for an entry of p, else in the direction of the axis (see `turned`).
    """

    id: str
    number: int | None
    entry: str
    verdict: Verdict
    printed: Expression | None
    correct: Expression | None
    note: str = ""
    worst: tuple[float, ...] = ()

    @property
    def index(self) -> tuple[int, int]:
        """Row and column in T_base_tool; raises ValueError for the whole matrix."""
        column, row = self.entry.split("_")
        return AXES.index(row), COLUMNS.index(column)

    @property
    def is_length(self) -> bool:
        """Whether it is in metres: an entry of p. Else a pure number."""
        return self.entry[0] == "p"

    @cached_property
    def wrong_terms(self) -> tuple[bool, ...]:
        """For each outer term of `printed`, whether it is a misprint."""
        assert self.printed is not None
        assert self.correct is not None
        return astray(self.printed, self.correct)

    @cached_property
    def mended_terms(self) -> tuple[bool, ...]:
        """For each outer term of `correct`, whether the print has it wrong or lacks it."""
        assert self.printed is not None
        assert self.correct is not None
        return astray(self.correct, self.printed)


def turned(T_base_tool: Array, index: tuple[int, int], entry: Array) -> Array:
    """Angle in radians ``(...)`` between an axis of poses ``(..., 4, 4)`` and that axis with one entry replaced.

    It turns an error in an entry of n, o or a, a pure number, into an error of direction. 0 for an entry of p.
    """
    row, column = index
    if column == 3:
        return np.zeros(T_base_tool.shape[:-2])
    axis = T_base_tool[..., :3, column]
    other = axis.copy()
    other[..., row] = entry
    # atan2, because acos loses half the digits of a small angle.
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(axis, other), axis=-1), (axis * other).sum(axis=-1)))
