"""The HTML of *Connect a program*."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from app.classroom.tokens import show_code
from app.live import Program
from app.live.announced import Announcement, State
from app.viewer.live.tape import BYTES, SECONDS
from app.viewer.panel.share import box_html
from app.viewer.views.templates import render
from kin import Robot
from kin.units import Units, fixed


def about() -> str:
    """What the button is for."""
    return render("live/about")


def websocket(address: str, code: str) -> str:
    """The address of the websocket with a page, at a service whose address ends with a slash."""
    return f"{address.replace('http', 'ws', 1)}api/v1/live/{show_code(code)}"


def code(code: str, address: str) -> str:
    """The code of the page, how a program in Python connects, and where others do."""
    python = f'import kin\n\npage = kin.connect("{address.rstrip("/")}", "{show_code(code)}")'
    boxes = (
        box_html(python, "Copy Python", wrap=True),
        box_html(websocket(address, code), "Copy address", wrap=True),
    )
    return render("live/code", code=show_code(code), boxes=boxes)


def state_of(program: Program | None) -> tuple[str, int, str]:
    """Who is connected, how many messages came within the last second, and the delay in words."""
    if program is None:
        return "", 0, ""
    delay = program.delay()
    return program.name, program.rate(), "" if delay is None else f"{max(1e3 * delay, 0.1):.1f}"


def state(name: str, rate: int, delay: str) -> str:
    """Who is connected, in the words of the page."""
    return render("live/state", name=name, rate=rate, delay=delay)


@lru_cache(maxsize=256)
def stop(name: str) -> str:
    """Who may move the arm, and the button that ends that, for the status card."""
    button = "stop", "Stop", "Ends the connection: no program can move this page until you show a new code"
    return render(
        "panel/offer",
        feature="connect",
        label="Connected program",
        words=f"{name} is connected.",
        more="",
        buttons=(button,),
    )


# The word of each state, and its symbol and CSS class.
STATES: dict[State, tuple[str, str, str]] = {
    "ready": ("Ready", "○", "blue"),
    "enabled": ("Enabled", "●", "green"),
    "stopped": ("Stopped", "■", "amber"),
    "fault": ("Fault", "✕", "crimson"),
}


@lru_cache(maxsize=256)
def announced(name: str, number: int, said: Announcement, halted: str = "") -> str:
    """What a program announces, for the status card; presses tell the `number`: they count for this one.

    Args:
        halted: why the page had it stop, before its own words.
    """
    state, symbol, color = STATES[said.state]
    return render(
        "live/announced",
        name=name,
        number=number,
        announced=said,
        halted=halted,
        state=state,
        symbol=symbol,
        color=color,
    )


def opening(words: str) -> str:
    """What goes on with a recording that is opened."""
    return render("live/opening", words=words)


def recording(seconds: float, count: int, size: int, state: str, why: str, other: str) -> str:
    """How far a recording is, of how much.

    Args:
        state: "running", "ended", or "opened": it came from a file.
        why: it has ended by itself.
        other: the arm that it is of, if that is not on show.
    """
    return render(
        "live/recording",
        seconds=f"{seconds:.1f}",
        count=count,
        size=f"{size / 1e6:.2f}",
        state=state,
        running=state == "running",
        why=why,
        other=other,
        most_seconds=f"{SECONDS:g}",
        most_size=f"{BYTES / 1e6:.0f}",
    )


def measured(
    robot: Robot, joints: tuple[bytes, bytes] | None, fingers: tuple[float, float] | None, units: Units
) -> str:
    """The measured joint values and opening of the gripper, and their differences from those on show.

    Args:
        joints: the differences, and the measured values, both as bytes; None: not measured.
        fingers: how far the gripper is open, as measured and as on show; None: not measured.
    """
    rows = []
    if joints is not None:
        gap, q = map(np.frombuffer, joints)
        for joint, turns, value, apart in zip(robot.joints, robot.revolute, q, gap, strict=True):
            unit = units.of(bool(turns))
            rows.append((joint.name, unit.number(value), unit.number(apart), unit.suffix))
    if fingers is not None:
        opening, commanded = (100.0 * share for share in fingers)
        rows.append(("Gripper", fixed(opening, 0), fixed(opening - commanded, 0), "%"))
    return render("live/measured", rows=rows)
