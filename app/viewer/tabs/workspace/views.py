"""Texts of the workspace tab: progress, the picked point, and joint locks. Changing numbers never move."""

from __future__ import annotations

from typing import Literal

import numpy as np
from markupsafe import Markup

import kin
from app.viewer.tabs.workspace.pick import Picked
from app.viewer.views.templates import render
from kin.ik.options import Locks
from kin.units import Units, general, grouped
from kin.workspace.clouds.measures import measured
from kin.workspace.region import Region

State = Literal["ready", "preparing", "running", "paused", "stopped", "recolouring", "done", "outdated"]
SYMBOLS: dict[State, str] = {
    "ready": "○",
    "preparing": "◔",
    "running": "▶",
    "paused": "❚❚",
    "stopped": "■",
    "recolouring": "◐",
    "done": "✓",
    "outdated": "!",
}


GAP = Markup(" &nbsp; ")  # between coordinates


def rate(points_per_second: float) -> str:
    """A rate with three significant digits."""
    for limit, scale, unit in ((1e6, 1e6, " M"), (1e3, 1e3, " k")):
        if points_per_second >= limit:
            return f"{general(points_per_second / scale, 3)}{unit}"
    return f"{general(points_per_second, 3)} "


def locks(locked: Locks | None) -> str:
    """The joints locked in a cloud or a map, in words; empty if none."""
    joints = [str(i + 1) for i, value in enumerate(locked or ()) if value is not None]
    return f"joint{'s' if len(joints) > 1 else ''} {', '.join(joints)} locked" if joints else ""


def buttons(state: State, old: bool) -> tuple[str, ...]:
    """The buttons of a cloud in this state; `old`: it is not the one that the settings describe."""
    match state:
        case "ready":
            return ("Start",)
        case "preparing" | "running":
            return "Pause", "Stop"
        case "paused":
            return ("Continue", "Restart", "Clear") if old else ("Continue", "Clear")
        case "stopped" if not old:
            return "Start", "Clear"
    return ("Restart", "Clear") if old else ("Clear",)


OLD = "Settings or locks have changed: the grey cloud is the old one. Restart samples a new one"


def progress(
    state: State, drawn: int, total: int, speed: float, locked: Locks | None = None, old: bool = False
) -> str:
    """The line below the progress bar, and a second line if joints are locked.

    `old`: whether the cloud is not the one that the settings describe.
    """
    return render(
        "workspace/progress",
        state="outdated" if old and state == "done" else state,
        symbol=SYMBOLS["outdated" if old and state == "done" else state],
        done=grouped(drawn),
        total=grouped(total),
        rate=f"{rate(speed)} points/s" if drawn and speed > 0.0 else "",
        note=". ".join(filter(None, (locks(locked), OLD if old else ""))),
    )


def picked(found: Picked | None, units: Units) -> str:
    """The numbers of the clicked point of a cloud; `found`: None after a click far from all points."""
    if found is None:
        return render("panel/note", text="No point near that click.")
    region = Region.of(found.cloud.robot, found.cloud.constraints)
    manipulability = float(kin.manipulability(found.cloud.robot, found.q))
    margin = float(measured(region, "limit_margin", np.asarray(found.q)[None])[0])
    rows = (
        ("point", grouped(found.index), ""),
        ("x y z", GAP.join(units.lengths.number(v) for v in found.point.tolist()), units.lengths.name),
        ("manipulability w (pose)", f"{manipulability:.4f}", ""),
        ("limit margin", f"{100.0 * margin:.0f}", "%"),
    )
    return render("panel/facts", label="picked point", rows=rows, note="w: all six rows of the Jacobian")
