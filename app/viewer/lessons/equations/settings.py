"""The settings of the lesson "Equations"."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.declared.fields import Settings, choice

HINT = "The entry of the tool's pose [n o a p] to show"


@dataclass(frozen=True)
class EquationsSettings(Settings):
    """The id of the equation on show. Which there are follows from the arm: here any text is valid."""

    equation: str = choice("Equation", {}, "", hint=HINT, anything=True, renew=True)
