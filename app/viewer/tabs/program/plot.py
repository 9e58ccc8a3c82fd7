"""Joint values, velocities, accelerations and the tool's speed over time as SVG, with their limits as bands.

All joints together are shown in percent of their limits, so that turning and sliding joints share a scale; one
joint alone is shown in its unit. A motion that is compared is dashed. The cursor and clicks are the page's own
script's (``static/program.js``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from app.exports.svg import chart, extremes, few, joint_colour, tick_labels
from app.viewer.views.templates import render
from kin import Robot
from kin.motion import Dwell, Motion
from kin.transforms import Array
from kin.units import Units

WIDTH, LEFT, RIGHT = 320.0, 44.0, 8.0
HIGH, GAP, TOP, BOTTOM = 74.0, 22.0, 16.0, 18.0
SAMPLES = 240
NAMES = ("Position", "Velocity", "Acceleration")


class Panel(NamedTuple):
    """One of the plots.

    Attributes:
        title: what is shown, with the unit.
        low, high: the ends of the axis.
        band: the limits within the axis; None: there are none.
        steps: limits that hold for a time: from, to, limit.
    """

    title: str
    low: float
    high: float
    band: tuple[float, float] | None
    steps: tuple[tuple[float, float, float], ...] = ()


class Course(NamedTuple):
    """A motion as it is plotted.

    Attributes:
        times: ``(k,)``, s.
        curves: for each plot its values ``(k,)``, by joint; -1 is the tool.
        dashed: whether it is the one that is compared.
    """

    times: Array
    curves: list[dict[int, Array]]
    dashed: bool


def plot_html(motion: Motion, joint: int | None, units: Units, other: Motion | None = None) -> str:
    """The plots of a motion that takes time, of one joint or all (None), and the buttons that choose the joint.

    `other`: a motion of the same arm to compare it with.
    """
    robot = motion.robot
    span = max(motion.duration, 0.0 if other is None else other.duration)
    courses = [_course(each, joint, units, each is other) for each in (other, motion) if each is not None]
    panels = _panels(motion, joint, units, courses)
    bottom = TOP + len(panels) * HIGH + (len(panels) - 1) * GAP
    parts = [_panel(panel, courses, i, span, TOP + i * (HIGH + GAP)) for i, panel in enumerate(panels)]
    parts.append(_time_axis(span, bottom))
    words = "all joints in percent of their limits" if joint is None else f"joint {joint + 1}"
    label = f"Position, velocity and acceleration over time: {words}; speed of the tool. "
    label += "; ".join(_extremes(panel.title, i, courses) for i, panel in enumerate(panels)) + "."
    svg = Markup(chart(WIDTH, bottom + BOTTOM, label, "".join(parts)))
    joints = [
        {"index": i, "name": each.name, "colour": joint_colour(i), "on": i == joint}
        for i, each in enumerate(robot.joints)
    ]
    left, right = 100 * LEFT / WIDTH, 100 * (WIDTH - RIGHT) / WIDTH
    return render(
        "program/plot",
        svg=svg,
        joints=joints,
        all=joint is None,
        left=left,
        right=right,
        span=f"{span:.6f}",
        dashed=other is not None,
    )


def _extremes(title: str, panel: int, courses: Sequence[Course]) -> str:
    curves = []
    for course in courses:
        for i, values in course.curves[panel].items():
            name = "the tool" if i < 0 else f"joint {i + 1}"
            curves.append((name + ", compared" * course.dashed, course.times, values))
    return extremes(title, curves, "s")


def _course(motion: Motion, joint: int | None, units: Units, dashed: bool) -> Course:
    """The curves of a motion, in percent of the limits or in the joint's unit."""
    robot, limits = motion.robot, motion.limits
    times = np.linspace(0.0, motion.duration, SAMPLES)
    sample = motion.sample(times)
    if joint is None:
        middle, half = _middle(robot)
        rows = [(sample.q - middle) / half, sample.qd / limits.velocity, sample.qdd / limits.acceleration]
        curves = [{i: 100.0 * row[:, i] for i in range(robot.n)} for row in rows]
    else:
        scale = units.of(bool(robot.revolute[joint])).scale
        curves = [{joint: row[:, joint] * scale} for row in (sample.q, sample.qd, sample.qdd)]
    return Course(times, [*curves, {-1: sample.tool_speed * units.lengths.scale}], dashed)


def _panels(motion: Motion, joint: int | None, units: Units, courses: list[Course]) -> list[Panel]:
    names = zip(NAMES, ("", "/s", "/s²"), strict=True)
    if joint is None:
        panels = [Panel(f"{name}, % of the limit", -112.0, 112.0, (-100.0, 100.0)) for name, _ in names]
    else:
        unit = units.of(bool(motion.robot.revolute[joint]))
        bands = _bands(motion, joint, unit.scale)
        panels = [
            _fitting(f"{name}, {unit.name}{per}", bands[i], [course.curves[i][joint] for course in courses])
            for i, (name, per) in enumerate(names)
        ]
    scale = units.lengths.scale
    steps = tuple(
        (times.start, times.end, segment.tool_speed * scale)
        for times, segment in zip(motion.segments, motion.program.segments, strict=True)
        if not isinstance(segment, Dwell) and segment.tool_speed is not None
    )
    top = max(float(course.curves[-1][-1].max()) for course in courses)
    top = 1.12 * max([top, 1e-6 * scale, *(limit for *_, limit in steps if limit < 4.0 * top)])
    return [*panels, Panel(f"Speed of the tool, {units.lengths.name}/s", 0.0, top, None, steps)]


def _bands(motion: Motion, joint: int, scale: float) -> list[tuple[float, float] | None]:
    """What a joint may reach: its position (None without limits), velocity and acceleration."""
    robot, limits = motion.robot, motion.limits
    low, high = float(robot.lower[joint]) * scale, float(robot.upper[joint]) * scale
    sizes = [float(row[joint]) * scale for row in (limits.velocity, limits.acceleration)]
    return [(low, high) if math.isfinite(high - low) else None, *((-size, size) for size in sizes)]


def _fitting(title: str, band: tuple[float, float] | None, curves: list[Array]) -> Panel:
    """A plot with room for the curves, or for the band."""
    low, high = band or (min(float(c.min()) for c in curves), max(float(c.max()) for c in curves))
    room = 0.06 * max(high - low, 1e-9)
    return Panel(title, low - room, high + room, band)


def _middle(robot: Robot) -> tuple[Array, Array]:
    """Middle and half of each joint's range; half a turn (a metre) where there are no limits."""
    free = ~np.isfinite(robot.upper - robot.lower)
    spare = np.where(robot.revolute, math.pi, 1.0)
    lower, upper = np.where(free, -spare, robot.lower), np.where(free, spare, robot.upper)
    return 0.5 * (lower + upper), np.maximum(0.5 * (upper - lower), 1e-9)


def _panel(panel: Panel, courses: list[Course], index: int, span: float, top: float) -> str:
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
    for value, text in few(tick_labels(panel.low, panel.high, 1.0), 4):
        at = y(value)
        parts.append(
            f'<path d="M{LEFT} {at:.1f}H{right:.1f}" stroke="currentColor" stroke-opacity=".16"/>'
            f'<text x="{LEFT - 5:.1f}" y="{at + 3.4:.1f}" text-anchor="end" class="kb-axis">{text}</text>'
        )
    for start, end, limit in panel.steps:
        ends = [LEFT + time / span * (right - LEFT) for time in (start, end)]
        parts.append(f'<path class="kb-motion-limit" d="M{ends[0]:.1f} {y(limit):.1f}H{ends[1]:.1f}"/>')
    for course in courses:
        across = LEFT + course.times / max(span, 1e-9) * (right - LEFT)
        for joint, curve in course.curves[index].items():
            heights = np.clip(top + (panel.high - curve) * scale, top, bottom)
            path = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(across.tolist(), heights.tolist(), strict=True))
            colour = "currentColor" if joint < 0 else joint_colour(joint)
            name = "tool" if joint < 0 else f"joint {joint + 1}"
            parts.append(
                f'<path class="kb-motion-curve{" kb-motion-other" * course.dashed}" d="M{path}" stroke="{colour}">'
                f"<title>{name}</title></path>"
            )
    parts.append(
        f'<rect x="{LEFT}" y="{top:.1f}" width="{right - LEFT:.1f}" height="{HIGH}" fill="none" '
        'stroke="currentColor" stroke-opacity=".4"/>'
    )
    return "".join(parts)


def _time_axis(duration: float, bottom: float) -> str:
    right = WIDTH - RIGHT
    marks = few(tick_labels(0.0, duration, 1.0), 7)
    parts = []
    for value, text in marks:
        x = LEFT + value / duration * (right - LEFT)
        unit = " s" if value == marks[-1][0] else ""
        parts.append(
            f'<text x="{min(x, right - 6):.1f}" y="{bottom + 13:.1f}" text-anchor="middle" class="kb-axis">'
            f"{text}{unit}</text>"
        )
    return "".join(parts)
