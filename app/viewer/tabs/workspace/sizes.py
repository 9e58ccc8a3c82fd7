"""The sizes of a workspace in words and numbers."""

from __future__ import annotations

import math

from kin import WorkspaceFacts
from kin.units import Unit, Units
from kin.workspace import Estimate, Span

LESS = 5e-4  # m: a hole smaller than this is none on screen
WAIT = '<div style="margin:.2em 1em .5em;font-size:.8em;opacity:.8">Computing…</div>'


def html(facts: WorkspaceFacts, waiting: bool, units: Units) -> str:
    """Bounding box, reach, holes, volume and surface as a small table; `waiting` for the last two."""
    unit = units.lengths
    rows = [
        *((name, _span(span, unit), unit.name) for name, span in (("x", facts.x), ("y", facts.y), ("z", facts.z))),
        ("reach from the shoulder", unit.number(facts.reach.largest.value), unit.name),
        ("hole around the shoulder", _hole(facts.reach, unit), unit.name),
        ("reach from joint 1's axis", unit.number(facts.radius.largest.value), unit.name),
        ("hole around the axis", _hole(facts.radius, unit), unit.name),
        ("volume", _estimate(facts.volume, waiting), "m³"),
        ("surface", _estimate(facts.surface, waiting), "m²"),
    ]
    body = "".join(
        f'<tr><th style="text-align:left;font-weight:500;opacity:.75;padding:0">{name}</th>'
        f'<td style="text-align:right;padding:0;white-space:nowrap">{value}</td>'
        f'<td style="padding:0 0 0 .3em;width:1.9em;opacity:.75">{name_of_unit if value != NONE else ""}</td></tr>'
        for name, value, name_of_unit in rows
    )
    return (
        '<table aria-label="sizes of the workspace" style="width:calc(100% - 2em);margin:.1em 1em .5em;'
        f'border-collapse:collapse;font-size:.78em;line-height:1.6;font-variant-numeric:tabular-nums">{body}</table>'
    )


NONE = "none"


def _span(span: Span, unit: Unit) -> str:
    return f"{unit.number(span.least.value)} … {unit.number(span.largest.value)}"


def _hole(span: Span, unit: Unit) -> str:
    return NONE if span.least.value < LESS else f"radius {unit.number(span.least.value)}"


def _estimate(estimate: Estimate | None, waiting: bool) -> str:
    """A number with its error, neither with digits that the error makes meaningless."""
    if estimate is None:
        return "computing…" if waiting else "unknown"
    error = max(estimate.error, 1e-12)
    digits = min(max(1 - math.floor(math.log10(error)), 0), 6)
    return f'<span title="{estimate.method}">{estimate.value:.{digits}f} ± {error:.{digits}f}</span>'
