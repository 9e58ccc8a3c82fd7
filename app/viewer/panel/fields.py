"""The number fields beside sliders: units, steps of the arrow keys, and a precision of the visitor's choice.

viser's own number field silently drops what it cannot read and cuts decimals. So ``static/input.js`` shows
a text field with the unit instead, and sends what was typed; :mod:`app.viewer.panel.entry` reads it.
"""

from __future__ import annotations

import json
from typing import Any

import viser

from app.viewer.views.templates import render
from app.viewer.viser_patches import uuid_of
from kin.units import Unit, general

PRECISION = 9  # decimals that a field can show
_MARKED = 3  # decimals of the limits below a slider
_TYPED = 7  # decimals: a value with more is rounded
_EXACT = 1e-10  # far below the last of them
TEN = 10  # PageUp and PageDown are ten arrow keys


def shown(value: float, unit: Unit, digits: int) -> float:
    """A value (rad or m) rounded for a field: to as few decimals as it has, but at least to `digits`.

    So a typed 45.678 stays as it was typed, while the solution of a target is rounded to two decimals.
    """
    scaled, least = value * unit.scale, unit.decimals(digits)
    for decimals in range(least, _TYPED):
        if abs(scaled - round(scaled, decimals)) < _EXACT:
            return round(scaled, decimals)
    return round(scaled, least)


def limit_marks(low: float, high: float) -> tuple[tuple[float, str], ...]:
    """The marks at the ends of a slider: its limits, in screen units, with a true minus sign."""
    return tuple((end, general(round(end, _MARKED))) for end in (low, high))


def field(slider: viser.GuiSliderHandle[float], unit: Unit) -> tuple[str, dict[str, Any]]:
    """The id of a slider, and what the page must know to draw the field beside it."""
    slider.precision = PRECISION
    steps = {"step": unit.step(0), "fine": unit.step(1), "page": TEN * unit.step(0)}
    return uuid_of(slider), {"unit": unit.name, **steps}


def fields_html(fields: dict[str, dict[str, Any]]) -> str:
    """A hidden element with the fields of some sliders."""
    return render("panel/fields", fields=json.dumps(fields))
