"""The sizes of a workspace in words and numbers."""

from __future__ import annotations

import math

from kin import WorkspaceFacts
from kin.workspace import Estimate, Span

LESS = 5e-4  # m: a hole smaller than this is none on screen
WAIT = '<div style="margin:.2em 1em .5em;font-size:.8em;opacity:.8">Computing…</div>'


def html(facts: WorkspaceFacts, waiting: bool) -> str:
    """Bounding box, reach, holes, volume and surface as a small table; `waiting` for the last two."""
    rows = [
        *((name, _span(span), "mm") for name, span in (("x", facts.x), ("y", facts.y), ("z", facts.z))),
        ("reach from the shoulder", _mm(facts.reach.largest.value), "mm"),
        ("hole around the shoulder", _hole(facts.reach), "mm"),
        ("reach from joint 1's axis", _mm(facts.radius.largest.value), "mm"),
        ("hole around the axis", _hole(facts.radius), "mm"),
        ("volume", _estimate(facts.volume, waiting), "m³"),
        ("surface", _estimate(facts.surface, waiting), "m²"),
    ]
    body = "".join(
        f'<tr><th style="text-align:left;font-weight:500;opacity:.75;padding:0">{name}</th>'
        f'<td style="text-align:right;padding:0;white-space:nowrap">{value}</td>'
        f'<td style="padding:0 0 0 .3em;width:1.9em;opacity:.75">{unit if value != NONE else ""}</td></tr>'
        for name, value, unit in rows
    )
    return (
        '<table aria-label="sizes of the workspace" style="width:calc(100% - 2em);margin:.1em 1em .5em;'
        f'border-collapse:collapse;font-size:.78em;line-height:1.6;font-variant-numeric:tabular-nums">{body}</table>'
    )


NONE = "none"


def _mm(metres: float) -> str:
    return f"{1000.0 * metres:.1f}".replace("-", "−").replace("−0.0", "0.0")


def _span(span: Span) -> str:
    return f"{_mm(span.least.value)} … {_mm(span.largest.value)}"


def _hole(span: Span) -> str:
    return NONE if span.least.value < LESS else f"radius {_mm(span.least.value)}"


def _estimate(estimate: Estimate | None, waiting: bool) -> str:
    """A number with its error, neither with digits that the error makes meaningless."""
    if estimate is None:
        return "computing…" if waiting else "unknown"
    error = max(estimate.error, 1e-12)
    digits = min(max(1 - math.floor(math.log10(error)), 0), 6)
    return f'<span title="{estimate.method}">{estimate.value:.{digits}f} ± {error:.{digits}f}</span>'
