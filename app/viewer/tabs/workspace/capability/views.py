"""Texts of a capability map: progress, legend, numbers, and the picked voxel."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from markupsafe import Markup

from app.viewer.tabs.workspace import colours
from app.viewer.tabs.workspace.capability.voxels import LEVELS, By, first_level, largest, levels, values_of
from app.viewer.tabs.workspace.views import GAP, locks
from app.viewer.views.templates import render
from kin.ik.options import Locks
from kin.units import Units, general, grouped
from kin.workspace import CapabilityMap
from kin.workspace.capability.evaluation import ROLLS, STARTS, Method

State = Literal["ready", "waiting", "computing", "stopped", "out of time", "done", "failed"]
SYMBOLS: dict[State, str] = {
    "ready": "○",
    "waiting": "◔",
    "computing": "▶",
    "stopped": "■",
    "out of time": "■",
    "done": "✓",
    "failed": "✕",
}
MEANING: dict[By, str] = {
    "share": "share of possible approach directions",
    "manipulability": "best manipulability w (pose)",
}
CERTAINTY: dict[Method, str] = {
    "closed form": "Exact: directions not counted cannot be reached.",
    "sweep": f"{ROLLS} rolls were tried about each direction: directions with few possible rolls may be missing.",
    "search": f"Searched with {STARTS} descents each: a few possible directions may be missing.",
}


def buttons(state: State, old: bool) -> tuple[str, ...]:
    """The buttons of a map in this state; `old`: it is not the one that the settings describe."""
    match state:
        case "ready":
            return ("Start",)
        case "waiting" | "computing":
            return ("Stop",)
        case "done" if not old:
            return ("Clear",)
    return "Start", "Clear"


def progress(state: State, done: int, total: int) -> str:
    """The line below the progress bar."""
    counts = (grouped(done), grouped(total)) if total else ("", "")
    return render("workspace/map_progress", state=state, symbol=SYMBOLS[state], done=counts[0], total=counts[1])


def apart(directions: int) -> float:
    """About the angle between neighbours of so many evenly spread directions, radians."""
    return math.sqrt(4.0 * math.pi / directions)


def value_text(by: By, value: float) -> str:
    """A value as text."""
    return f"{general(100.0 * value, 3)} %" if by == "share" else general(value, 3)


def legend(found: CapabilityMap, by: By, name: str, least: float) -> str:
    """The colours of the values, and the number of visible voxels."""
    values = values_of(found, by)
    most = largest(found, by)
    first = first_level(least)
    shown = int((levels(values) >= first).sum())
    limit = f"at least {value_text(by, first / LEVELS * most)}: " if first else ""
    return render(
        "workspace/shown",
        bar=Markup(colours.bar(f"map-{by}", value_text(by, 0.0), value_text(by, most), MEANING[by], name)),
        shown=shown,
        text=f"{limit}{grouped(shown)} of {grouped(len(values))} voxels",
    )


def facts(found: CapabilityMap, locked: Locks | None, complete: bool, units: Units) -> str:
    """Size and shares, which joints were locked, and how certain a missing direction is."""
    count, share = len(found.index), found.share
    best = float(found.manipulability.max(initial=0.0))
    mean = float(share.mean(dtype=np.float64)) if count else 0.0
    rows = (
        ("voxel", units.lengths.number(found.grid.voxel), units.lengths.name),
        ("directions", f"{found.grid.count}, about {units.angle(apart(found.grid.count))} apart", ""),
        ("reachable", grouped(count), ""),
        ("their volume", general(found.volume, 4), "m³"),
        ("mean share", general(100.0 * mean, 3), "%"),
        ("best share", general(100.0 * float(share.max(initial=0.0)), 3), "%"),
        ("best manipulability (pose)", general(best, 3), ""),
    )
    note = CERTAINTY[found.grid.method] if complete else "Of the part computed so far."
    if locked is not None:
        note = f"With {locks(locked)}. {note}"
    return render("panel/facts", label="capability in numbers", rows=rows, note=note)


def picked(found: CapabilityMap, row: int, units: Units) -> str:
    """The numbers of the clicked voxel."""
    centre = GAP.join(units.lengths.number(v, 0) for v in found.centres[row].tolist())
    possible, count = int(found.approachable[row].sum()), found.grid.count
    rows = (
        ("centre x y z", centre, units.lengths.name),
        ("approached from", f"{possible} of {count} directions", ""),
        ("share", general(100.0 * possible / count, 3), "%"),
        ("best manipulability (pose)", general(float(found.manipulability[row]), 3), ""),
    )
    note = "" if possible else "Reachable, but not along any of these directions."
    return render("panel/facts", label="picked voxel", rows=rows, note=note)
