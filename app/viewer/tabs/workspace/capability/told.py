"""A capability map in words and numbers that do not move while they change."""

from __future__ import annotations

from typing import Literal

import numpy as np

from app.viewer.tabs.workspace import colours
from app.viewer.tabs.workspace.capability.voxels import LEVELS, first_level, largest, levels, values_of
from app.viewer.tabs.workspace.capability.wishes import By
from app.viewer.tabs.workspace.words import Locks, grouped, locks
from kin import CapabilityMap
from kin.units import Units
from kin.workspace.capability.evaluation import ROLLS, STARTS, Method

State = Literal["ready", "waiting", "computing", "stopped", "done", "failed"]
SYMBOLS: dict[State, str] = {
    "ready": "○",
    "waiting": "◔",
    "computing": "▶",
    "stopped": "■",
    "done": "✓",
    "failed": "✕",
}
MEANING: dict[By, str] = {
    "share": "share of the directions the tool can come from",
    "manipulability": "best manipulability (Yoshikawa)",
}
WORTH: dict[Method, str] = {
    "closed form": "Decided exactly: a direction that is missing cannot be had.",
    "sweep": f"{ROLLS} rolls were tried about each direction: one that fewer rolls fit may be missing.",
    "search": f"Searched with {STARTS} descents each: a few directions that can be had may be missing.",
}
STYLE = "margin:.1em 1em .5em;font-size:.78em;line-height:1.5;font-variant-numeric:tabular-nums"


def progress(state: State, done: int, total: int) -> str:
    """The line below the bar."""
    right = f"{grouped(done)} / {grouped(total)} blocks" if total else ""
    return (
        f'<div data-map="{state}" role="status" style="{STYLE};display:flex;justify-content:space-between">'
        f'<span><span aria-hidden="true">{SYMBOLS[state]}</span> {state}</span><span>{right}</span></div>'
    )


def value_text(by: By, value: float) -> str:
    """A value for people."""
    return f"{100.0 * value:.3g} %" if by == "share" else f"{value:.3g}"


def legend(found: CapabilityMap, by: By, name: str, least: float) -> str:
    """Which colour is which value, and how many voxels are at least the least one."""
    values = values_of(found, by)
    most = largest(found, by)
    first = first_level(least)
    shown = int((levels(values) >= first).sum())
    limit = f"at least {value_text(by, first / LEVELS * most)}: " if first else ""
    return (
        colours.bar(f"map-{by}", value_text(by, 0.0), value_text(by, most), MEANING[by], name)
        + f'<div data-shown="{shown}" style="{STYLE};margin-top:-.4em">{limit}{grouped(shown)} of '
        f"{grouped(len(values))} voxels</div>"
    )


def facts(found: CapabilityMap, locked: Locks, whole: bool, units: Units) -> str:
    """Size, shares, which joints were locked, and what a missing direction is worth; unless `whole`, of a part."""
    count, share = len(found.index), found.share
    w = float(found.manipulability.max(initial=0.0))
    mean = float(share.mean(dtype=np.float64)) if count else 0.0
    rows = (
        ("voxel", units.lengths.number(found.grid.voxel), units.lengths.name),
        ("reachable", grouped(count), ""),
        ("their volume", f"{found.volume:.4g}", "m³"),
        ("mean share", f"{100.0 * mean:.3g}", "%"),
        ("best share", f"{100.0 * float(share.max(initial=0.0)):.3g}", "%"),
        ("best manipulability", f"{w:.3g}", ""),
    )
    note = WORTH[found.grid.method] if whole else "Of the part that is there so far."
    if locked is not None:
        note = f"With {locks(locked)}. {note}"
    return f'{_table("capability in numbers", rows)}<div style="{STYLE};opacity:.8">{note}</div>'


def picked(found: CapabilityMap, row: int, units: Units) -> str:
    """What is known of the voxel that was clicked on."""
    x, y, z = (units.lengths.number(v, 0) for v in found.centres[row].tolist())
    fits, of = int(found.approachable[row].sum()), found.grid.count
    rows = (
        ("centre x y z", f"{x} &nbsp; {y} &nbsp; {z}", units.lengths.name),
        ("approached from", f"{fits} of {of} directions", ""),
        ("share", f"{100.0 * fits / of:.3g}", "%"),
        ("best manipulability", f"{float(found.manipulability[row]):.3g}", ""),
    )
    note = "" if fits else f'<div style="{STYLE};opacity:.8">Reachable, but along none of the set.</div>'
    return _table("picked voxel", rows) + note


def _table(label: str, rows: tuple[tuple[str, str, str], ...]) -> str:
    body = "".join(
        f'<tr><th style="text-align:left;font-weight:500;opacity:.75;padding:0">{name}</th>'
        f'<td style="text-align:right;padding:0;white-space:nowrap">{value}</td>'
        f'<td style="padding:0 0 0 .3em;width:1.9em;opacity:.75">{unit}</td></tr>'
        for name, value, unit in rows
    )
    style = f"width:calc(100% - 2em);{STYLE};border-collapse:collapse"
    return f'<table aria-label="{label}" style="{style}">{body}</table>'
