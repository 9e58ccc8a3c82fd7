"""What the tab shows, as HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.viewer.tabs.program.faults import Fault
from app.viewer.tabs.program.items import MOST, Item, Items, Kind, start_of
from app.viewer.tabs.program.player import RATES, Player
from app.viewer.tabs.workspace.colours import bar
from app.viewer.views.templates import render
from kin import Robot
from kin.motion import Motion, MotionLimits
from kin.units import Units, fixed

KINDS: dict[Kind, tuple[str, str]] = {
    "ptp": ("PTP – every joint goes the shortest way", "PTP"),
    "lin": ("LIN – the tool moves on a straight line", "LIN"),
}
QUANTITIES = {"velocity": "velocities", "acceleration": "accelerations", "jerk": "jerks"}


def rate_name(rate: float) -> str:
    """A factor of the speed as text."""
    return f"{rate:g}×"


def player(player: Player, motion: Motion | None, playable: bool, path: bool, top_speed: float) -> str:
    """Buttons and time; below them the meaning of the path's colours."""
    legend = bar("program", "0 m/s", f"{top_speed:.2f} m/s", "speed of the tool along its path", "viridis")
    return render(
        "program/player",
        playable=playable,
        duration=0.0 if motion is None else motion.duration,
        rates=[(rate, rate_name(rate), rate == player.rate) for rate in RATES],
        loop=player.loop,
        path=path,
        legend=legend if path and top_speed > 1e-6 else "",
    )


def clock(player: Player, duration: float, here: int | None) -> str:
    """The present moment, for the page's own script; `here`: index of the item that is driven."""
    return render(
        "program/clock", time=f"{player.time:.3f}", duration=f"{duration:.3f}", playing=player.playing, here=here
    )


def items_html(
    items: Items, chosen: int | None, motion: Motion | None, fault: Fault | None, loop: bool, revision: int
) -> str:
    """The list; the chosen item is open."""
    first = start_of(items)
    rows = []
    for i, item in enumerate(items):
        starts = item is first
        rows.append(
            {
                "title": item.name or ("Pause" if item.kind == "pause" else f"Waypoint {i + 1}"),
                "words": _words(item, starts),
                "time": "" if motion is None else f"{motion.segments[i].end:.2f} s",
                "item": item,
                "starts": starts,
                "speed": f"{100.0 * item.speed:g}",
                "seconds": f"{item.seconds:g}",
                "fault": fault.words if fault is not None and fault.index == i else "",
            }
        )
    back = None
    if loop and first is not None:
        time = "" if motion is None else f"{motion.duration:.2f} s"
        back = {"time": time, "fault": fault.words if fault is not None and fault.index == len(items) else ""}
    return render(
        "program/list",
        rows=rows,
        chosen=chosen,
        back=back,
        kinds=KINDS,
        full=len(items) >= MOST,
        revision=revision,
    )


def _words(item: Item, starts: bool) -> str:
    if item.kind == "pause":
        return f"waits {item.seconds:g} s"
    if starts:
        return "start"
    speed = "" if item.speed == 1.0 else f" at {100.0 * item.speed:g} % speed"
    return KINDS[item.kind][1] + speed


def summary(motion: Motion, limits: MotionLimits, robot: Robot, own: bool, units: Units) -> str:
    """How long the motion takes, what limits it, and what is assumed of the limits."""
    heads = [f"{units.angles.name}{per}" for per in ("/s", "/s²", "/s³")]
    if not robot.revolute.all():
        heads = [
            f"{head} or {units.lengths.name}{per}" for head, per in zip(heads, ("/s", "/s²", "/s³"), strict=True)
        ]
    rows = []
    for i, joint in enumerate(robot.joints):
        scale = units.of(joint.kind == "revolute").scale
        values = (limits.velocity[i], limits.acceleration[i], limits.jerk[i])
        cells = [
            (_number(value * scale), quantity in limits.assumed[i])
            for value, quantity in zip(values, QUANTITIES, strict=True)
        ]
        rows.append((joint.name, cells))
    return render(
        "program/summary",
        words=_busiest(motion),
        notes=motion.explain(units) if motion.notes else "",
        assumed=assumption(limits, own, units),
        heads=heads,
        rows=rows,
    )


def _busiest(motion: Motion) -> str:
    """Which joint is at which of its limits most."""
    if motion.duration == 0.0:
        return "Record another pose: the arm has nowhere to go yet."
    at_limit = [peak for peak in motion.peaks if peak.ratio is not None]
    words = {
        "velocity": "its largest velocity",
        "acceleration": "its largest acceleration",
        "jerk": "its largest jerk",
    }
    best = max(at_limit, key=lambda peak: (round(peak.ratio or 0.0, 3), peak.quantity == "velocity"))
    share = f"{100.0 * (best.ratio or 0.0):.0f} % of"
    joint = 0 if best.joint is None else best.joint + 1
    return (
        f"{motion.duration:.2f} s in all. Every joint keeps its limits; joint {joint} ({best.name}) comes "
        f"closest, with {share} {words[best.quantity]} at {best.time:.2f} s."
    )


def assumption(limits: MotionLimits, own: bool, units: Units) -> str:
    """Which limits are assumed, in a sentence; empty if none is."""
    missing = {
        quantity: [i for i, names in enumerate(limits.assumed) if quantity in names] for quantity in QUANTITIES
    }
    missing = {quantity: joints for quantity, joints in missing.items() if joints}
    if not missing:
        return ""
    partly = any(len(joints) < len(limits.assumed) for joints in missing.values())
    names = [QUANTITIES[quantity] for quantity in missing]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    half_turn = f"{units.angles.number(math.pi, 0 if units.degrees else 1)} {units.angles.name}/s"
    rules = {
        "velocity": f"half a turn ({half_turn}) or 1 m per second",
        "acceleration": "full speed after 0.25 s",
        "jerk": "full acceleration after 0.1 s",
    }
    who = "Your arm states" if own else "The maker publishes"
    where = " of some joints" if partly else ""
    return f"{who} no {listed}{where}: assumed {', '.join(rules[quantity] for quantity in missing)}."


def _number(value: float) -> str:
    return fixed(value, 0 if value >= 100 else 1 if value >= 10 else 2)


def shown_names(items: Sequence[Item]) -> list[str]:
    """The label of each waypoint in the scene: its number, and its name if it has one."""
    return [f"{i + 1} {item.name}".strip() for i, item in enumerate(items) if item.q]
