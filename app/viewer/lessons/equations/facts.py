"""What the lesson "Equations" knows: the arm's equations, and the values of the one on show."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from app.equations import Book, DerivationError, Equation, Values
from app.viewer.declared.facts import Facts
from app.viewer.lessons.equations.settings import EquationsSettings
from app.viewer.lessons.equations.views import segments, summary
from kin.transforms import Array

DERIVING = "Deriving the equations of this arm …"
SIZE = 0.2  # of an axis in the scene, relative to the reach of the arm


@dataclass(frozen=True, eq=False)
class EquationsFacts(Facts[EquationsSettings]):
    """See the module."""

    @property
    def book(self) -> Book | None:
        """All equations; None: there are none, or none yet."""
        found: Book | None = self.work("book").value
        return found

    @property
    def about(self) -> str:
        """Where the equations come from, or why there are none."""
        match self.work("book").error:
            case DerivationError() as error:
                return f"No equations: {error}."
            case None:
                return DERIVING if self.book is None else summary(self.book)
        return "The equations of this arm could not be derived."

    @cached_property
    def equation(self) -> Equation | None:
        """The one on show: the chosen one, else the first misprint, else the first readable one."""
        if self.book is None:
            return None
        readable = [e for e in self.book.equations if e.correct is not None]
        chosen = [e for e in self.book.equations if e.id == self.settings.equation]
        return next(iter([*chosen, *(e for e in readable if e.verdict == "misprinted"), *readable]))

    @property
    def misprinted(self) -> bool:
        """Whether the equation on show is printed wrong."""
        return self.equation is not None and self.equation.verdict == "misprinted"

    @cached_property
    def values(self) -> Values:
        """Its values at the configuration in the scene; of equations that can be read."""
        assert self.book is not None
        assert self.equation is not None
        return self.book.values(self.equation, self.q, self.T)

    @property
    def largest(self) -> float:
        """The largest error of a misprinted equation (m or rad), 0 of the others."""
        if self.book is None or self.equation is None or not self.equation.worst:
            return 0.0
        return _largest(self.book, self.equation.id)

    @property
    def segments(self) -> Array:
        """The effect of the misprint as lines ``(k, 2, 3)``, the printed one first."""
        assert self.equation is not None
        return segments(self.equation, self.values, self.T, SIZE * self.robot.reach)


@lru_cache(maxsize=64)
def _largest(book: Book, key: str) -> float:
    equation = book.equation(key)
    values = book.values(equation, np.array(equation.worst))
    return abs(float(values.difference)) if equation.is_length else float(values.turn)
