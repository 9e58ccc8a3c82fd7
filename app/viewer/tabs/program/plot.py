"""Joint values, velocities, accelerations and the tool's speed over time, with their limits as bands.

All joints together are shown in percent of their limits, so that turning and sliding joints share a scale; one
joint alone is shown in its unit. A motion that is compared is dashed. The cursor and clicks are the page's own
script's (``static/program.js``).
"""

from __future__ import annotations

import math

import numpy as np

from app.exports.curves import LEFT, RIGHT, WIDTH, Curve, Row, drawn
from app.exports.svg import joint_colour
from app.viewer.views.templates import render
from kin import Robot
from kin.motion import Motion
from kin.motion.program import Pause
from kin.transforms import Array
from kin.units import Units

SAMPLES = 240
NAMES = ("Position", "Velocity", "Acceleration")


def plot_html(motion: Motion | None, joint: int | None, units: Units, other: Motion | None = None) -> str:
    """The plots of a motion that takes time, of one joint or all (None), and the buttons that choose the joint.

    `other`: a motion of the same arm to compare it with.
    """
    if motion is None or motion.duration == 0.0:
        return ""
    other = other if other is not None and other.planned and other.duration > 0.0 else None
    both = [each for each in (other, motion) if each is not None]
    curves = [curve for each in both for curve in _curves(each, joint, units, each is other)]
    words = "all joints in percent of their limits" if joint is None else f"joint {joint + 1}"
    label = f"Position, velocity and acceleration over time: {words}; speed of the tool"
    joints = [
        {"index": i, "name": each.name, "colour": joint_colour(i), "on": i == joint}
        for i, each in enumerate(motion.robot.joints)
    ]
    return render(
        "program/plot",
        svg=drawn(_rows(motion, joint, units, curves), curves, label),
        joints=joints,
        all=joint is None,
        left=100 * LEFT / WIDTH,
        right=100 * (WIDTH - RIGHT) / WIDTH,
        span=f"{max(each.duration for each in both):.6f}",
        dashed=other is not None,
    )


def _curves(motion: Motion, joint: int | None, units: Units, compared: bool) -> list[Curve]:
    """The curves of a motion, in percent of the limits or in the joint's unit; the last one is the tool's."""
    robot, limits = motion.robot, motion.limits
    times = np.linspace(0.0, motion.duration, SAMPLES)
    sample = motion.sample(times)
    if joint is None:
        middle, half = _middle(robot)
        values = [(sample.q - middle) / half, sample.qd / limits.velocity, sample.qdd / limits.acceleration]
        scale = 100.0
    else:
        values, scale = [sample.q, sample.qd, sample.qdd], units.of(bool(robot.revolute[joint])).scale
    also = ", compared" * compared
    found = [
        Curve(
            f"joint {i + 1}{also}",
            times,
            (*(row[:, i] * scale for row in values), None),
            joint_colour(i),
            compared,
        )
        for i in (range(robot.n) if joint is None else (joint,))
    ]
    speed = sample.tool_speed * units.lengths.scale
    return [*found, Curve(f"the tool{also}", times, (None, None, None, speed), "currentColor", compared)]


def _rows(motion: Motion, joint: int | None, units: Units, curves: list[Curve]) -> list[Row]:
    if joint is None:
        found = [Row(f"{name}, % of the limit", (-100.0, 100.0), shows=(-100.0, 100.0)) for name in NAMES]
    else:
        unit = units.of(bool(motion.robot.revolute[joint]))
        found = [
            Row(f"{name}, {unit.name}{per}", band, shows=band or ())
            for name, per, band in zip(NAMES, ("", "/s", "/s²"), _bands(motion, joint, unit.scale), strict=True)
        ]
    scale = units.lengths.scale
    limits = tuple(
        (times.start, times.end, segment.tool_speed * scale)
        for times, segment in zip(motion.segments, motion.program.segments, strict=True)
        if not isinstance(segment, Pause) and segment.tool_speed is not None
    )
    top = max(float(row.max()) for curve in curves if (row := curve.rows[-1]) is not None)
    shows = (0.0, 1e-6 * scale, *(limit for *_, limit in limits if limit < 4.0 * top))
    return [*found, Row(f"Speed of the tool, {units.lengths.name}/s", shows=shows, spans=limits)]


def _bands(motion: Motion, joint: int, scale: float) -> list[tuple[float, float] | None]:
    """What a joint may reach: its position (None without limits), velocity and acceleration."""
    robot, limits = motion.robot, motion.limits
    low, high = float(robot.lower[joint]) * scale, float(robot.upper[joint]) * scale
    sizes = [float(row[joint]) * scale for row in (limits.velocity, limits.acceleration)]
    return [(low, high) if math.isfinite(high - low) else None, *((-size, size) for size in sizes)]


def _middle(robot: Robot) -> tuple[Array, Array]:
    """Middle and half of each joint's range; half a turn (a metre) where there are no limits."""
    free = ~np.isfinite(robot.upper - robot.lower)
    spare = np.where(robot.revolute, math.pi, 1.0)
    lower, upper = np.where(free, -spare, robot.lower), np.where(free, spare, robot.upper)
    return 0.5 * (lower + upper), np.maximum(0.5 * (upper - lower), 1e-9)
