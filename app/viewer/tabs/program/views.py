"""What the tab shows, as HTML."""

from __future__ import annotations

import math

from app.exports.motion_snippets import SNIPPETS
from app.exports.snippets import Service
from app.viewer.live.tape import BYTES
from app.viewer.panel.share import box_html
from app.viewer.panel.status import Notice
from app.viewer.tabs.program.compare import CHOICES, Choice, about, jerk_is_infinite
from app.viewer.tabs.program.plan import Fault, Plan
from app.viewer.tabs.program.program import LARGEST, MOST, Segments, places, start_of
from app.viewer.tabs.program.settings import RATES
from app.viewer.tabs.program.typed import NUMBERS, Fields
from app.viewer.tabs.workspace.colours import bar
from app.viewer.views.templates import render
from kin.motion import Dwell, Gripper, Motion, MotionLimits, Peak, Spline
from kin.motion.details import ArrivesOtherwise
from kin.motion.messages import note
from kin.motion.program import Kind, Pause, Segment, kind_of
from kin.motion.results import Quantity
from kin.transforms import Array
from kin.units import Units, fixed, general, typeset

KINDS: dict[Kind, tuple[str, str]] = {
    "ptp": ("PTP – straight in the joints", "PTP"),
    "lin": ("LIN – tool on a straight line", "LIN"),
    "circ": ("CIRC – tool on an arc", "CIRC"),
    "spline": ("Spline – smooth curve", "spline"),
}
# Formats of a motion over time, of `app.exports.motion`.
MOTIONS = {
    "csv-commented": "CSV",
    "trajectory-yaml": "ROS YAML",
    "trajectory-json": "ROS JSON",
    "mcap": "MCAP",
    "urscript": "URScript",
}
QUANTITIES: dict[Quantity, str] = {"velocity": "velocities", "acceleration": "accelerations", "jerk": "jerks"}
EXCEEDED = 1.0 + 1e-6
# Least part of a limit, the word for it, and its colour.
STATES = (
    (EXCEEDED, "exceeded", "kb-vermilion"),
    (0.995, "at limit", "kb-amber"),
    (0.8, "near", ""),
    (0.0, "below", ""),
)


def player(
    plan: Plan | None, playable: bool, rate: float, loop: bool, drawn: tuple[bool, bool, bool], units: Units
) -> str:
    """Buttons and time; below them the meaning of the path's colours.

    `drawn`: whether the path, copies of the arm, and frames are shown.
    """
    if plan is None:
        return ""
    top_speed = plan.top_speed if drawn[0] else 0.0
    top = f"{units.lengths.number(top_speed, 0)} {units.lengths.name}/s"
    legend = bar("program", f"0 {units.lengths.name}/s", top, "speed of the tool along its path", "viridis")
    return render(
        "program/player",
        playable=playable,
        duration=plan.duration,
        rates=[(each, name, each == rate) for name, each in RATES.items()],
        loop=loop,
        drawn=dict(zip(("path", "ghosts", "frames"), drawn, strict=True)),
        legend=legend if top_speed > 1e-6 else "",
    )


def clock(plan: Plan | None, time: float, playing: bool) -> str:
    """The present moment, for the page's own script."""
    duration, here = (0.0, None) if plan is None else (plan.duration, plan.row_at(time))
    return render("program/clock", time=f"{time:.3f}", duration=f"{duration:.3f}", playing=playing, here=here)


def playing(plan: Plan, here: int | None) -> Notice:
    """What the status says while a row is driven."""
    if here is None or here >= len(plan.segments):
        return Notice("hand", "Playing", "" if here is None else "Back to the start")
    row = plan.segments[here]
    match row:
        case Gripper():
            words = f"Gripper to {_percent(row.opening)}"
        case Dwell():
            words = f"Waits {row.seconds:g} s"
        case _:
            words = f"To waypoint {here + 1}"
    return Notice("hand", "Playing", f"{words}: {row.name}" if row.name else words)


def ended(plan: Plan, rate: float, units: Units) -> Notice:
    """What the status says at the end of what can be driven."""
    refusal = plan.motion.refusal
    if refusal is None:
        words = f"{plan.motion.duration:.2f} s, as planned." if rate == 1.0 else ""
        return Notice("hand", "The program has ended", words)
    return Notice("error", f"The program ends on the way to {refusal.segment + 1}", plan.explain(units))


def list_html(
    plan: Plan | None,
    opened: tuple[int | None, int],
    fault: Fault | None,
    loop: bool,
    fields: Fields,
    by_pose: bool,
    revision: int,
    grips: bool,
) -> str:
    """The rows of a program.

    Args:
        opened: index of the row that is open, and which of its points the fields are of.
        by_pose: whether its values are those of the tool, not of the joints.
        revision: another one replaces what was typed into the fields.
        grips: whether the arm has a gripper that opens.
    """
    segments = () if plan is None else plan.segments
    chosen, back = opened[0], None
    if loop and plan is not None:
        time = f"{plan.ends[-1]:.2f} s" if plan.motion.planned else ""
        back = {"time": time, "fault": fault if fault is not None and fault.index == len(segments) else None}
    q: tuple[Array, ...] = () if plan is None or chosen is None else plan.q[chosen]
    begins = None
    if plan is not None and chosen is not None and plan.arrives_otherwise(chosen) is not None:
        begins = plan.start_as_recorded(chosen)
    return render(
        "program/list",
        rows=[] if plan is None else [_row(plan, i, fault, fields) for i in range(len(segments))],
        chosen=chosen,
        count=len(q),
        point=opened[1],
        q=q[opened[1]] if q else None,
        back=back,
        kinds=KINDS,
        full=places(segments) >= MOST,
        revision=revision,
        fields=fields,
        by_pose=by_pose,
        grips=grips,
        way=plan is not None and chosen is not None and plan.can_have_way(chosen),
        begins=None if begins is None else begins[0] + 1,
    )


def _row(plan: Plan, index: int, fault: Fault | None, fields: Fields) -> dict[str, object]:
    """What the list shows of a row."""
    segment = plan.segments[index]
    return {
        "title": title(index, segment),
        "words": _words(plan.segments, index, fields),
        "time": f"{plan.ends[index]:.2f} s" if index < len(plan.ends) else "",
        "kind": kind_of(segment),
        "waits": isinstance(segment, Pause),
        "row": segment,
        "otherwise": _otherwise(plan, index, fields),
        "starts": index == start_of(plan.segments),
        "fault": fault if fault is not None and fault.index == index else None,
    }


def title(index: int, segment: Segment) -> str:
    """The name of a row, or what it is."""
    usual = {Dwell: "Pause", Gripper: "Gripper", Spline: "Spline"}
    return segment.name or usual.get(type(segment), f"Waypoint {index + 1}")


def _otherwise(plan: Plan, index: int, fields: Fields) -> dict[str, object] | None:
    """An arrival in other joint values than recorded, as it is shown: a headline, a sentence, the true values."""
    arrival = plan.arrives_otherwise(index)
    if arrival is None or plan.driven is None:
        return None
    others = arrival.posture != arrival.recorded_posture
    facts = [each for each in plan.driven.notes if isinstance(each, ArrivesOtherwise) and each.segment == index]
    units = map(fields.units.of, fields.robot.revolute.tolist())
    return {
        "title": "Arrives in another posture" if others else "Arrives in other joint values",
        "detail": typeset(" ".join(note(each, fields.units) for each in facts)),
        "joints": [unit.number(value, 3) for unit, value in zip(units, arrival.q.tolist(), strict=True)],
    }


def _words(segments: Segments, index: int, fields: Fields) -> str:
    """How the arm comes to a row, in a few words."""
    row, lengths = segments[index], fields.units.lengths
    if isinstance(row, Pause):
        to = f"to {_percent(row.opening)}, " if isinstance(row, Gripper) else ""
        return f"{to}waits {row.seconds:g} s"
    if index == start_of(segments):
        return "start"
    words = KINDS[kind_of(row)][1]
    if isinstance(row, Spline):
        words += f" through {len(row.points)} point{'s' * (len(row.points) != 1)}"
    if row.speed != 1.0:
        words += f" at {100.0 * row.speed:g} %"
    if row.tool_speed is not None:
        words += f" ≤ {lengths.brief(row.tool_speed, 6)}/s"
    if row.blend:
        words += f", zone {lengths.brief(row.blend, 6)}"
    return words


def _percent(opening: float) -> str:
    """How far a gripper is open."""
    return f"{general(100.0 * opening, 3)} %"


def summary(plan: Plan | None, own: bool, units: Units) -> str:
    """How long the motion takes, how near each joint comes to its limits, and what is assumed of them."""
    motion = None if plan is None else plan.driven
    if plan is None or motion is None or not (plan.motion.planned or motion.duration > 0.0):
        return ""
    limits, robot = plan.motion.limits, plan.motion.robot
    heads = [f"{units.angles.name}{per}" for per in ("/s", "/s²", "/s³")]
    if not robot.revolute.all():
        heads = [
            f"{head} or {units.lengths.name}{per}" for head, per in zip(heads, ("/s", "/s²", "/s³"), strict=True)
        ]
    peaks = {(peak.joint, peak.quantity): peak for peak in motion.peaks}
    rows = []
    for i, joint in enumerate(robot.joints):
        scale = units.of(joint.kind == "revolute").scale
        rows.append((joint.name, [_cell(peaks[i, quantity], scale) for quantity in QUANTITIES]))
    speed, turn = peaks[None, "tool_speed"].peak, peaks[None, "tool_turn"].peak
    return render(
        "program/summary",
        words=("" if plan.motion.planned else "Up to where the program ends: ") + _busiest(motion),
        notes=plan.notes(units),
        touches=plan.touches(),
        touched=plan.touch.segment if plan.touch is not None and plan.can_have_way(plan.touch.segment) else None,
        assumed=assumption(limits, own, units),
        heads=list(zip(QUANTITIES, heads, strict=True)),
        rows=rows,
        tool=f"{_number(speed * units.lengths.scale)} {units.lengths.name}/s, "
        f"{_number(turn * units.angles.scale)} {units.angles.name}/s",
        source=robot.source,
        data="" if own else f"../api/v1/robots/{robot.id}",
    )


def _share(ratio: float) -> tuple[str, str]:
    """A part of a limit, and its colour."""
    return (
        (f"{100.0 * ratio:.0f} %, exceeded", "kb-vermilion")
        if ratio > EXCEEDED
        else (f"{100.0 * ratio:.0f} %", "")
    )


_INFINITE = ("∞, exceeded", "kb-vermilion")  # where the acceleration jumps


def _cell(peak: Peak, scale: float) -> dict[str, object]:
    """A peak beside its limit: numbers, a word, and the colour of its state."""
    ratio = peak.ratio or 0.0
    word, colour = next((word, colour) for least, word, colour in STATES if ratio >= least)
    return {
        "share": f"{100.0 * ratio:.0f} %",
        "word": word,
        "colour": colour,
        "numbers": f"{_number(peak.peak * scale)} / {_number((peak.limit or 0.0) * scale)}",
        "assumed": peak.assumed,
    }


def comparison(
    motion: Motion | None, other: Motion | None, choice: Choice | None, zone: float, units: Units
) -> str:
    """Another motion of the same waypoints beside the program, or why there is none."""
    if motion is None or motion.duration == 0.0:
        return ""
    words = "" if other is None or other.planned else other.explain(units)
    both = [each for each in (motion, other) if each is not None and each.planned]
    lengths = units.lengths
    rows = [("duration", [(f"{each.duration:.2f} s", "") for each in both])]
    for quantity in QUANTITIES:
        ratios = [max(peak.ratio or 0.0 for peak in each.peaks if peak.quantity == quantity) for each in both]
        cells = [_share(ratio) for ratio in ratios]
        if quantity == "jerk":
            cells = [_INFINITE if jerk_is_infinite(each) else cell for each, cell in zip(both, cells, strict=True)]
        rows.append((quantity, cells))
    speeds = [max(peak.peak for peak in each.peaks if peak.quantity == "tool_speed") for each in both]
    rows.append(("tool", [(f"{lengths.number(speed, 0)} {lengths.name}/s", "") for speed in speeds]))
    return render(
        "program/compare",
        choices=CHOICES,
        choice=choice,
        zone=NUMBERS["blend"].cell("zone", zone, units)["value"],
        unit=lengths.name,
        rows=rows,
        words=words or (about(choice, motion) if choice is not None else ""),
        refused=bool(words),
    )


def files(motion: Motion | None, any_rows: bool, own: bool, service: Service, language: str) -> str:
    """Saving, opening, and the program as code."""
    code = "" if motion is None else box_html(SNIPPETS[language](motion, own, service), "Copy code")
    return render(
        "program/files",
        any=any_rows,
        most=f"{LARGEST // 1000} kB",
        most_recording=f"{BYTES // 1_000_000} MB",
        code=code,
        languages=list(SNIPPETS),
        language=language,
        motions=MOTIONS if motion is not None else {},
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
