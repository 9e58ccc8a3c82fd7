"""The charts of the lesson "Trajectories": each belongs to the answer of a step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from app.viewer.lessons.trajectories.chart import Curve, Row, chart
from app.viewer.lessons.trajectories.motions import Ways, example, family, frequency, sampled, swing
from kin import Robot
from kin.motion import profiles
from kin.transforms import Array
from kin.units import Unit, Units

_TITLES = ("Position", "Velocity", "Acceleration", "Jerk")


def _rows(unit: Unit, quantities: tuple[int, ...], limits: tuple[float, ...] = ()) -> tuple[Row, ...]:
    """Rows of position and its derivatives; `limits` of velocity, acceleration and jerk in this unit."""
    titles = [f"{_TITLES[k]}, {unit.name}{('', '/s', '/s²', '/s³')[k]}" for k in quantities]
    return tuple(
        Row(title, limits[k - 1] if limits and k else None) for k, title in zip(quantities, titles, strict=True)
    )


def cubic(robot: Robot, unit: Unit) -> Markup:
    """Position, velocity and acceleration of a cubic."""
    times, values = sampled(family(robot)["cubic"], unit.scale)
    return chart(_rows(unit, (0, 1, 2)), (Curve("cubic", times, values[:3]),), "A cubic from rest to rest")


def family_of(robot: Robot, unit: Unit) -> Markup:
    """All profiles of the same way."""
    curves = []
    for name, profile in family(robot).items():
        times, values = sampled(profile, unit.scale)
        curves.append(Curve(f"{name} {profile.duration:.2f} s", times, values[:3]))
    limits = tuple((example(robot).limits * unit.scale).tolist())
    return chart(_rows(unit, (0, 1, 2), limits), tuple(curves), "Four profiles of the same way")


def ends(robot: Robot, unit: Unit) -> Markup:
    """Cubics that end at rest, going on, and moving back."""
    way, duration = example(robot).way, family(robot)["cubic"].duration
    mean = way / duration
    curves = []
    for name, end in (
        ("ends at rest", 0.0),
        ("ends with the mean velocity", mean),
        ("ends moving back", -2.0 * mean),
    ):
        times, values = sampled(profiles.cubic(0.0, way, duration, 0.0, end), unit.scale)
        curves.append(Curve(name, times, values[:2]))
    return chart(_rows(unit, (0, 1)), tuple(curves), "Three cubics with different velocities at the end")


def two_ways(found: Ways, units: Units) -> Markup:
    """How far the tool is from the line, and how fast, on the PTP and on the line."""
    times, off = found.off_line()
    lengths = units.lengths
    lin_times = np.linspace(0.0, found.lin.duration, len(times))
    speeds = [
        each.sample(t).tool_speed * lengths.scale for each, t in ((found.ptp, times), (found.lin, lin_times))
    ]
    curves = (
        Curve(f"PTP {found.ptp.duration:.2f} s", times, (off * lengths.scale, speeds[0])),
        Curve(f"LIN {found.lin.duration:.2f} s", lin_times, (np.zeros_like(lin_times), speeds[1])),
    )
    rows = (Row(f"Distance from the line, {lengths.name}"), Row(f"Speed of the tool, {lengths.name}/s"))
    return chart(rows, curves, "PTP and LIN between the same two configurations")


def past_axis(past: Sequence[tuple[Array, Array]], offsets: Sequence[float], units: Units) -> Markup:
    """How fast a joint turns along lines past its axis, as `motions.turning_past` gives it for each distance."""
    lengths, angles = units.lengths, units.angles
    curves = tuple(
        Curve(lengths.brief(offset), x * lengths.scale, (rate * angles.scale,))
        for offset, (x, rate) in zip(offsets, past, strict=True)
    )
    rows = (Row(f"Rate of the joint, {angles.name}/s"),)
    return chart(rows, curves, "Rate of the joint along three lines", lengths.name)


def load(robot: Robot, unit: Unit) -> Markup:
    """A load that swings behind two profiles."""
    found, hertz, curves = family(robot), frequency(robot), []
    for name in ("trapezoidal", "S-curve"):
        times, x = swing(found[name], hertz)
        push = np.where(times < found[name].duration, found[name].sample(times)[2], 0.0)
        curves.append(Curve(name, times, (push * unit.scale, x * unit.scale)))
    rows = (Row(f"Acceleration, {unit.name}/s²"), Row(f"Swing of the load, {unit.name}"))
    return chart(rows, tuple(curves), "A swinging load behind two profiles")


def elbows(share: Array, found: Array, angles: Unit) -> Markup:
    """Joint 1 ``(2, k)`` along parts ``(k,)`` of a line, with the elbow positive and negative."""
    curves = tuple(
        Curve(f"elbow {name}", 100.0 * share, (row * angles.scale,))
        for name, row in zip(("positive", "negative"), found, strict=True)
    )
    rows = (Row(f"Joint 1, {angles.name}", np.pi * angles.scale),)
    return chart(rows, curves, "Joint 1 along the line, both elbows", "%")
