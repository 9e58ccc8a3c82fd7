"""Progress and points, in words and numbers that do not move while they change."""

from __future__ import annotations

from typing import Literal

import numpy as np

import kin
from kin import Robot
from kin.transforms import Array
from kin.units import Units
from kin.workspace.clouds.measures import measured
from kin.workspace.region import Region

Locks = tuple[float | None, ...] | None
State = Literal["ready", "preparing", "running", "paused", "recolouring", "done"]
SYMBOLS: dict[State, str] = {
    "ready": "○",
    "preparing": "◔",
    "running": "▶",
    "paused": "❚❚",
    "recolouring": "◐",
    "done": "✓",
}


def grouped(number: int) -> str:
    """A whole number in groups of three digits."""
    return f"{number:,}".replace(",", "\u202f")


def rate(points_per_second: float) -> str:
    """A speed to three digits."""
    for limit, scale, unit in ((1e6, 1e6, " M"), (1e3, 1e3, " k")):
        if points_per_second >= limit:
            return f"{points_per_second / scale:.3g}{unit}"
    return f"{points_per_second:.3g} "


def locks(locked: Locks) -> str:
    """Which joints a cloud or a map was made without; nothing if all moved."""
    joints = [str(i + 1) for i, value in enumerate(locked or ()) if value is not None]
    return f"joint{'s' if len(joints) > 1 else ''} {', '.join(joints)} locked" if joints else ""


def progress(state: State, drawn: int, total: int, speed: float, locked: Locks = None) -> str:
    """The line below the bar, and one more if joints are locked."""
    right = f"{rate(speed)} points/s" if drawn and speed > 0.0 else ""
    said = locks(locked)
    return (
        f'<div data-cloud="{state}" role="status" style="display:flex;justify-content:space-between;gap:.6em;'
        'margin:-.2em 1em .5em;font-size:.78em;line-height:1.5;font-variant-numeric:tabular-nums">'
        f'<span style="white-space:nowrap"><span aria-hidden="true">{SYMBOLS[state]}</span> {state}</span>'
        f'<span style="white-space:nowrap">{grouped(drawn)} / {grouped(total)}</span>'
        f'<span style="white-space:nowrap;min-width:7.5em;text-align:right">{right}</span></div>'
        + (f'<div style="margin:-.4em 1em .5em;font-size:.78em;opacity:.8">{said}</div>' if said else "")
    )


def picked(robot: Robot, locked: Locks, index: int, q: Array, point: Array, units: Units) -> str:
    """The numbers of a point that was clicked on, of a cloud with these joints locked."""
    x, y, z = (units.lengths.number(v) for v in point.tolist())
    w = float(kin.manipulability(robot, q))
    margin = float(measured(Region.of(robot, None, locked), "limits", np.asarray(q)[None])[0])
    rows = (
        ("point", grouped(index), ""),
        ("x y z", f"{x} &nbsp; {y} &nbsp; {z}", units.lengths.name),
        ("manipulability", f"{w:.3g}", ""),
        ("limit margin", f"{100.0 * margin:.0f}", "%"),
    )
    body = "".join(
        f'<tr><th style="text-align:left;font-weight:500;opacity:.75;padding:0">{name}</th>'
        f'<td style="text-align:right;padding:0;white-space:nowrap">{value}</td>'
        f'<td style="padding:0 0 0 .3em;width:1.9em;opacity:.75">{unit}</td></tr>'
        for name, value, unit in rows
    )
    return (
        '<table aria-label="picked point" style="width:calc(100% - 2em);margin:.1em 1em .5em;'
        f'border-collapse:collapse;font-size:.78em;line-height:1.6;font-variant-numeric:tabular-nums">{body}</table>'
    )


def nothing_picked() -> str:
    """What is told when a click met no point."""
    return '<div style="margin:.1em 1em .5em;font-size:.78em;opacity:.8">No point near that click.</div>'
