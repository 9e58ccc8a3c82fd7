"""The charts of the lesson "Trajectories": each belongs to the answer of a step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from app.exercises.typed import read_number
from app.exports.curves import Curve, Row, with_legend
from app.viewer import profiles
from app.viewer.lessons.figure_shapes import GREEN, VERMILION
from app.viewer.lessons.guide.outline import Answered
from app.viewer.lessons.trajectories.motions import Sketched, Ways, example, family, frequency, sampled, swing
from kin import Robot
from kin.transforms import Array
from kin.typed import EntryError
from kin.units import Unit, Units

RIGHT, WRONG = (f"rgb{color}" for color in (GREEN, VERMILION))
SHORTEST, LONGEST = 0.2, 5.0  # of the right time, or of the limit: what is drawn
_TITLES = ("Position", "Velocity", "Acceleration", "Jerk")


def _rows(unit: Unit, quantities: tuple[int, ...], limits: tuple[float, ...] = ()) -> tuple[Row, ...]:
    """Rows of position and its derivatives; `limits` of velocity, acceleration and jerk in this unit."""
    titles = [f"{_TITLES[k]}, {unit.name}{('', '/s', '/s²', '/s³')[k]}" for k in quantities]
    return tuple(
        Row(title, (-limits[k - 1], limits[k - 1]) if limits and k else None)
        for k, title in zip(quantities, titles, strict=True)
    )


def cubic(robot: Robot, unit: Unit) -> Markup:
    """Position, velocity and acceleration of a cubic."""
    times, values = sampled(family(robot)["cubic"], unit.scale)
    return with_legend(_rows(unit, (0, 1, 2)), (Curve("cubic", times, values[:3]),), "A cubic from rest to rest")


def family_of(robot: Robot, unit: Unit) -> Markup:
    """All profiles of the same way."""
    curves = []
    for name, profile in family(robot).items():
        times, values = sampled(profile, unit.scale)
        curves.append(Curve(f"{name} {profile.duration:.2f} s", times, values[:3]))
    limits = tuple((example(robot).limits * unit.scale).tolist())
    return with_legend(_rows(unit, (0, 1, 2), limits), tuple(curves), "Four profiles of the same way")


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
    return with_legend(_rows(unit, (0, 1)), tuple(curves), "Three cubics with different velocities at the end")


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
    return with_legend(rows, curves, "PTP and LIN between the same two configurations")


def past_axis(past: Sequence[tuple[Array, Array]], offsets: Sequence[float], units: Units) -> Markup:
    """How fast a joint turns along lines past its axis, as `motions.turning_past` gives it for each distance."""
    lengths, angles = units.lengths, units.angles
    curves = tuple(
        Curve(lengths.brief(offset), x * lengths.scale, (rate * angles.scale,))
        for offset, (x, rate) in zip(offsets, past, strict=True)
    )
    rows = (Row(f"Rate of the joint, {angles.name}/s"),)
    return with_legend(rows, curves, "Rate of the joint along three lines", lengths.name)


def load(robot: Robot, unit: Unit) -> Markup:
    """A load that swings behind two profiles."""
    found, hertz, curves = family(robot), frequency(robot), []
    for name in ("trapezoidal", "S-curve"):
        times, x = swing(found[name], hertz)
        push = np.where(times < found[name].duration, found[name].sample(times)[2], 0.0)
        curves.append(Curve(name, times, (push * unit.scale, x * unit.scale)))
    rows = (Row(f"Acceleration, {unit.name}/s²"), Row(f"Swing of the load, {unit.name}"))
    return with_legend(rows, tuple(curves), "A swinging load behind two profiles")


def elbows(share: Array, found: Array, angles: Unit) -> Markup:
    """Joint 1 ``(2, k)`` along parts ``(k,)`` of a line, with the elbow positive and negative."""
    curves = tuple(
        Curve(f"elbow {name}", 100.0 * share, (row * angles.scale,))
        for name, row in zip(("positive", "negative"), found, strict=True)
    )
    rows = (Row(f"Joint 1, {angles.name}", (-np.pi * angles.scale, np.pi * angles.scale)),)
    return with_legend(rows, curves, "Joint 1 along the line, both elbows", "%")


def timed(unit: Unit, way: float, limits: Array) -> Answered:
    """The velocity of a trapezoidal profile that takes a typed time, beside the fastest within the limits.

    It accelerates as the joint may; if the time is too short for that, it is a triangle that is steeper.
    """
    v, a = limits[:2].tolist()

    right = way / v + v / a

    def figure(given: object, fine: bool, closed: bool) -> Markup:
        curves = []
        if isinstance(given, float | int) and not fine and SHORTEST * right < given < LONGEST * right:
            curves.append(
                Curve(f"your answer {given:.2f} s", *_trapezoid(float(given), way, a, unit), WRONG, True)
            )
        if closed:
            curves.append(Curve(f"right {right:.2f} s", *_trapezoid(right, way, a, unit), RIGHT))
        if not curves:
            return Markup("")
        rows = (Row(f"Velocity, {unit.name}/s", (-v * unit.scale, v * unit.scale), shows=(0.0,)),)
        return with_legend(rows, tuple(curves), "Velocity of the trapezoidal profile")

    return figure


def _trapezoid(time: float, way: float, a: float, unit: Unit) -> tuple[Array, tuple[Array]]:
    """Corners of a velocity profile that covers a way in a time, with slope `a` if it can."""
    free = (a * time) ** 2 - 4.0 * a * way
    top = 0.5 * (a * time - free**0.5) if free >= 0.0 else 2.0 * way / time
    ramp = top / a if free >= 0.0 else 0.5 * time
    times = np.array([0.0, ramp, time - ramp, time])
    return times, (np.array([0.0, top, top, 0.0]) * unit.scale,)


def sketched(unit: Unit, asked: Sketched, limits: Array) -> Answered:
    """A sketch of the velocity, and a right one beside one that is wrong once that is on show."""
    v = float(limits[0])
    rate, right = unit.per_second(), asked.trapezoid
    times = np.linspace(0.0, asked.time, len(right))

    def figure(given: object, fine: bool, closed: bool) -> Markup:
        curves, values = [], _typed(given, rate, len(times))
        if values is not None and np.abs(values).max() <= LONGEST * v:
            color = RIGHT if fine else WRONG
            curves.append(Curve("your sketch", times, (values * unit.scale,), color, not fine))
        if closed and not fine:
            curves.append(Curve("a right one", times, (right * unit.scale,), RIGHT))
        if not curves:
            return Markup("")
        rows = (Row(f"Velocity, {unit.name}/s", (-v * unit.scale, v * unit.scale), shows=(0.0,)),)
        return with_legend(rows, tuple(curves), "Sketch of the velocity")

    return figure


def _typed(given: object, unit: Unit, count: int) -> Array | None:
    """So many typed numbers ``(count,)``; None for anything else, such as an answer of an old link."""
    if not isinstance(given, list) or len(given) != count or not all(isinstance(text, str) for text in given):
        return None
    try:
        return np.array([read_number(text, unit) for text in given])
    except EntryError:
        return None
