"""The sizes of a workspace as a table: bounding box, reach, holes, volume and surface."""

from __future__ import annotations

import math

from markupsafe import Markup

from app.viewer.views.templates import render
from kin.units import Unit, Units
from kin.workspace import Estimate, Span, WorkspaceFacts

SMALLEST_HOLE = 5e-4  # m; smaller holes are not reported


def html(facts: WorkspaceFacts | None, waiting: bool, units: Units) -> str:
    """The sizes as a table, if they are known; `waiting`: volume and surface are still being computed."""
    if facts is None:
        return render("panel/note", text="Computing…")
    unit = units.lengths
    rows = [
        *((name, _span(span, unit), unit.name) for name, span in (("x", facts.x), ("y", facts.y), ("z", facts.z))),
        ("reach from the shoulder", unit.number(facts.reach.largest.value), unit.name),
        ("hole around the shoulder", *_hole(facts.reach, unit)),
        ("reach from joint 1's axis", unit.number(facts.radius.largest.value), unit.name),
        ("hole around the axis", *_hole(facts.radius, unit)),
        ("volume", _estimate(facts.volume, waiting), "m³"),
        ("surface", _estimate(facts.surface, waiting), "m²"),
    ]
    return render("panel/facts", label="sizes of the workspace", rows=rows, note="")


def _span(span: Span, unit: Unit) -> str:
    return f"{unit.number(span.least.value)} … {unit.number(span.largest.value)}"


def _hole(span: Span, unit: Unit) -> tuple[str, str]:
    """The radius of a hole and its unit."""
    if span.least.value < SMALLEST_HOLE:
        return "none", ""
    return f"radius {unit.number(span.least.value)}", unit.name


def _estimate(estimate: Estimate | None, waiting: bool) -> str:
    """A number with its error, without digits that the error makes meaningless."""
    if estimate is None:
        return "computing…" if waiting else "unknown"
    error = max(estimate.error, 1e-12)
    digits = min(max(1 - math.floor(math.log10(error)), 0), 6)
    return Markup('<span title="{}">{} ± {}</span>').format(
        estimate.method, f"{estimate.value:.{digits}f}", f"{error:.{digits}f}"
    )
