"""What the lesson says: what is free, its ranges and what ends them, how exactly the tool is held."""

from __future__ import annotations

import math
from html import escape

import numpy as np

import kin
from app.viewer.panel.posture import strip_html
from app.viewer.selfmotion import End
from kin import Redundancy, Robot, Task
from kin.transforms import Array, rotation_angle, vector_angle
from kin.units import Unit, Units

# A slider outside a framed folder has a narrower label.
UNDER_TRACK = "margin:0 3.25em 0 5em"
DEMANDS: dict[Task, int] = {"pose": 6, "approach": 5, "position": 3}
TRADE = (
    "Axes 1 and 2 are one line. What joint 1 turns, joint 2 takes back, and nothing else moves: not the elbow, "
    "not the hand. The seventh joint buys this arm no other posture; compare the S-R-S arm, whose elbow swings."
)
SWING = (
    "Seven joints for six demands: the elbow may swing on a circle round the line from shoulder to wrist while "
    "the tool stays. The ring shows the angles that the stops allow."
)
_WORDS = ("no", "one", "two", "three", "four")


def idea(robot: Robot, task: Task, free: tuple[Redundancy, ...], trades: bool, swings: bool) -> str:
    """What is free here, in a sentence or two."""
    count = robot.n - DEMANDS[task]
    if not free:
        if count <= 0:
            return (
                f"Nothing is free: {robot.n} joints for the {DEMANDS[task]} demands of this task. Choose a task "
                "that asks for less (Move, Match), or an arm with seven joints."
            )
        word = _WORDS[count] if count < len(_WORDS) else str(count)
        return (
            f"{word.capitalize()} of {robot.n} joints is free in this task, but no closed form tells its range. "
            "Postures and targets work all the same."
            if count == 1
            else f"{word.capitalize()} motions are free in this task, but no closed form tells their ranges."
        )
    if trades and free[0].name == "theta1":
        return TRADE
    if swings and free[0].name == "psi":
        return SWING
    names = " and ".join(item.label for item in free)
    asked = {"pose": "the full pose", "approach": "point and approach", "position": "the point"}[task]
    return f"To match {asked}, {names} may be anything that the stops allow."


def residual(T: Array, held: Array, task: Task) -> tuple[float, float | None]:
    """How far the tool at `T` is from where it is `held`: metres, and radians of what the task asks for."""
    off = float(np.linalg.norm(T[:3, 3] - held[:3, 3]))
    if task == "position":
        return off, None
    if task == "approach":
        return off, vector_angle(T[:3, 2], held[:3, 2])
    return off, rotation_angle(T[:3, :3], held[:3, :3])


def small(value: float, unit: Unit) -> str:
    """A residual for people: plain where that says something, else with its power of ten."""
    shown = value * unit.scale
    if shown == 0.0:
        return f"0{unit.suffix}"
    if shown >= unit.step(2):
        return unit.text(value, 2)
    mantissa, exponent = f"{shown:.0e}".split("e")
    return f"{mantissa}·10<sup>{int(exponent)}</sup>{unit.suffix}".replace("-", "−")


def residual_html(off: float, turned: float | None, elbow: float | None, units: Units) -> str:
    """The residual, measured by forward kinematics; `elbow`: metres it has moved, for an arm whose does not."""
    parts = [small(off, units.lengths)]
    if turned is not None:
        parts.append(small(turned, units.angles))
    still = f"<br>Elbow moved {small(elbow, units.lengths)}." if elbow is not None else ""
    return (
        '<div data-residual style="margin:0 1em .4em;font-size:.8em;min-height:1.6em;font-variant-numeric:'
        f'tabular-nums">Tool held to {", ".join(parts)}.{still}</div>'
    )


def stops_html(robot: Robot, found: tuple[End, ...], units: Units) -> str:
    """Each end of a range, and whose stop it is."""
    rows = []
    for end in found:
        value = units.angles.text(end.value)
        if end.joint < 0:
            why = "the branch ends"
        else:
            name = robot.joints[end.joint].name
            same = name.lower() in (f"joint {end.joint + 1}", str(end.joint + 1))
            why = f"stop of joint {end.joint + 1}" + ("" if same else f", {name}")
        rows.append(f'<tr><td style="text-align:right;width:5em">{value}</td><td>{escape(why)}</td></tr>')
    if not rows:
        return _small("No stop is in the way: the whole turn is free.")
    return (
        '<table data-stops style="margin:0 1em .4em;font-size:.78em;opacity:.85;border-spacing:.5em .1em;'
        f'font-variant-numeric:tabular-nums">{"".join(rows)}</table>'
    )


def range_html(item: Redundancy, low: float, high: float, units: Units) -> str:
    """The ranges as a bar from `low` to `high` (radians)."""
    unit = units.angles
    return strip_html(item, low * unit.scale, high * unit.scale, unit, UNDER_TRACK)


def bounds(robot: Robot, item: Redundancy) -> tuple[float, float]:
    """From where to where a free value could go, stops of its own joint aside from those of the others."""
    if not item.name.startswith("theta"):
        return -math.pi, math.pi
    joint = int(item.name.removeprefix("theta")) - 1
    low, high = float(robot.lower[joint]), float(robot.upper[joint])
    return (low, high) if math.isfinite(high - low) else (-math.pi, math.pi)


def elbow_of(robot: Robot, q: Array) -> Array:
    """The origins of all frames between the second joint and the tool ``(k, 3)``: the arm's shape."""
    return kin.link_frames(robot, q)[robot.joint_rows[1] :, :3, 3]


def _small(text: str) -> str:
    return f'<div data-stops style="margin:0 1em .4em;font-size:.78em;opacity:.85">{escape(text)}</div>'
