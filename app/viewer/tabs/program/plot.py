"""Joint values, velocities and accelerations over time as SVG, with their limits as bands.

All joints together are shown in percent of their limits, so that turning and sliding joints share a scale; one
joint alone is shown in its unit. The cursor and clicks are the page's own script's (``static/program.js``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from app.exports.svg import joint_colour, tick_labels
from app.viewer.views.templates import render
from kin import Robot
from kin.motion import Motion
from kin.transforms import Array
from kin.units import Units

WIDTH, LEFT, RIGHT = 320.0, 44.0, 8.0
HIGH, GAP, TOP, BOTTOM = 74.0, 22.0, 16.0, 18.0
SAMPLES = 240
NAMES = ("Position", "Velocity", "Acceleration")


class Panel(NamedTuple):
    """One of the three plots.

    Attributes:
        title: what is shown, with the unit.
        curves: values ``(k,)`` by joint.
        low, high: the ends of the axis.
        band: the limits within the axis; None: there are none.
    """

    title: str
    curves: dict[int, Array]
    low: float
    high: float
    band: tuple[float, float] | None


def plot_html(motion: Motion, joint: int | None, units: Units) -> str:
    """The plots of a motion that lasts, of one joint or of all (None), with the buttons that choose the joint."""
    robot = motion.robot
    times = np.linspace(0.0, motion.duration, SAMPLES)
    values = motion.derivatives(times)
    shown = _all(motion, values) if joint is None else _one(motion, values, joint, units)
    bottom = TOP + 3 * HIGH + 2 * GAP
    parts = [_panel(panel, times, TOP + i * (HIGH + GAP)) for i, panel in enumerate(shown)]
    parts.append(_time_axis(motion.duration, bottom))
    words = "all joints in percent of their limits" if joint is None else f"joint {joint + 1}"
    svg = Markup(
        f'<svg class="kb-plot" viewBox="0 0 {WIDTH:.0f} {bottom + BOTTOM:.0f}" width="100%" role="img" '
        f'aria-label="Position, velocity and acceleration over time: {words}">{"".join(parts)}</svg>'
    )
    joints = [
        {"index": i, "name": each.name, "colour": joint_colour(i), "on": i == joint}
        for i, each in enumerate(robot.joints)
    ]
    left, right = 100 * LEFT / WIDTH, 100 * (WIDTH - RIGHT) / WIDTH
    return render(
        "program/plot", svg=svg, joints=joints, all=joint is None, left=left, right=right,
        duration=motion.duration, words=words,
    )  # fmt: skip


def _all(motion: Motion, values: Array) -> list[Panel]:
    robot, limits = motion.robot, motion.limits
    middle, half = _middle(robot)
    rows = [(values[0] - middle) / half, values[1] / limits.velocity, values[2] / limits.acceleration]
    return [
        Panel(
            f"{name}, % of the limit", {i: 100.0 * row[:, i] for i in range(robot.n)}, -112.0, 112.0, (-100, 100)
        )
        for name, row in zip(NAMES, rows, strict=True)
    ]


def _one(motion: Motion, values: Array, joint: int, units: Units) -> list[Panel]:
    robot, limits = motion.robot, motion.limits
    unit = units.of(bool(robot.revolute[joint]))
    low, high = float(robot.lower[joint]), float(robot.upper[joint])
    ranges = [
        (low, high) if math.isfinite(high - low) else None,
        (-limits.velocity[joint], limits.velocity[joint]),
        (-limits.acceleration[joint], limits.acceleration[joint]),
    ]
    shown = []
    for name, row, band, per in zip(NAMES, values[:3], ranges, ("", "/s", "/s²"), strict=True):
        curve = row[:, joint] * unit.scale
        ends = (float(curve.min()), float(curve.max())) if band is None else tuple(x * unit.scale for x in band)
        room = 0.06 * max(ends[1] - ends[0], 1e-9)
        bounds = None if band is None else (float(ends[0]), float(ends[1]))
        shown.append(
            Panel(
                f"{name}, {unit.name}{per}", {joint: curve}, float(ends[0] - room), float(ends[1] + room), bounds
            )
        )
    return shown


def _middle(robot: Robot) -> tuple[Array, Array]:
    """Middle and half of each joint's range; half a turn (a metre) where there are no limits."""
    free = ~np.isfinite(robot.upper - robot.lower)
    spare = np.where(robot.revolute, math.pi, 1.0)
    lower, upper = np.where(free, -spare, robot.lower), np.where(free, spare, robot.upper)
    return 0.5 * (lower + upper), np.maximum(0.5 * (upper - lower), 1e-9)


def _panel(panel: Panel, times: Array, top: float) -> str:
    scale = HIGH / (panel.high - panel.low)
    right, bottom = WIDTH - RIGHT, top + HIGH

    def y(value: float) -> float:
        return min(max(top + (panel.high - value) * scale, top), bottom)

    parts = [f'<text x="{LEFT}" y="{top - 5:.1f}" class="kb-axis kb-motion-title">{panel.title}</text>']
    if panel.band is not None:
        for a, b, edge in ((panel.high, panel.band[1], 1), (panel.band[0], panel.low, 0)):
            line = y(panel.band[edge])
            parts.append(
                f'<rect class="kb-motion-band" x="{LEFT}" y="{y(a):.1f}" width="{right - LEFT:.1f}" '
                f'height="{y(b) - y(a):.1f}"/><path class="kb-motion-limit" d="M{LEFT} {line:.1f}H{right:.1f}"/>'
            )
    for value, text in _few(tick_labels(panel.low, panel.high, 1.0), 4):
        at = y(value)
        parts.append(
            f'<path d="M{LEFT} {at:.1f}H{right:.1f}" stroke="currentColor" stroke-opacity=".16"/>'
            f'<text x="{LEFT - 5:.1f}" y="{at + 3.4:.1f}" text-anchor="end" class="kb-axis">{text}</text>'
        )
    across = LEFT + times / max(times[-1], 1e-9) * (right - LEFT)
    for joint, curve in panel.curves.items():
        heights = np.clip(top + (panel.high - curve) * scale, top, bottom)
        path = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(across.tolist(), heights.tolist(), strict=True))
        parts.append(
            f'<path class="kb-motion-curve" d="M{path}" stroke="{joint_colour(joint)}"><title>joint {joint + 1}'
            "</title></path>"
        )
    parts.append(
        f'<rect x="{LEFT}" y="{top:.1f}" width="{right - LEFT:.1f}" height="{HIGH}" fill="none" '
        'stroke="currentColor" stroke-opacity=".4"/>'
    )
    return "".join(parts)


def _time_axis(duration: float, bottom: float) -> str:
    right = WIDTH - RIGHT
    marks = _few(tick_labels(0.0, duration, 1.0), 7)
    parts = []
    for value, text in marks:
        x = LEFT + value / duration * (right - LEFT)
        unit = " s" if value == marks[-1][0] else ""
        parts.append(
            f'<text x="{min(x, right - 6):.1f}" y="{bottom + 13:.1f}" text-anchor="middle" class="kb-axis">'
            f"{text}{unit}</text>"
        )
    return "".join(parts)


def _few(labels: list[tuple[float, str]], most: int) -> list[tuple[float, str]]:
    """At most about `most` of evenly spread labels; zero stays."""
    every = math.ceil(len(labels) / most)
    step = labels[1][0] - labels[0][0] if len(labels) > 1 else 1.0
    return [label for label in labels if round(label[0] / step) % every == 0]
