"""The settings of the lesson "Redundancy". The names are those of links."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.declared.fields import Settings, choice, flag, slider

CHOICE_HINT = "The redundancy parameter to change"
SWEEP_HINT = "Moves back and forth between the ends of the range"
SLIDER_HINT = "Moves the arm while the tool stays where it is"


@dataclass(frozen=True)
class RedundancySettings(Settings):
    """Which parameter is changed, by its name, and how. The parameters are facts: here any name is valid."""

    free: str = choice(
        "Parameter", {}, "", hint=CHOICE_HINT, names="redundancy parameter", anything=True, renew=True
    )
    swing: bool = flag("Sweep", hint=SWEEP_HINT, renew=True)
    value: float = slider(
        "", 0.0, (0.0, 0.0), "angle", hint=SLIDER_HINT, link=False, marks=True, named=False, clip=True
    )
