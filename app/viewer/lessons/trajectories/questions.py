"""The facts that the texts of the lesson "Trajectories" use (``lesson.toml``)."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from markupsafe import Markup

from app.exercises.variant import Quantity
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.outline import Lead, Path, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.trajectories import figures
from app.viewer.lessons.trajectories.motions import (
    Ways,
    both_elbows,
    example,
    family,
    frequency,
    joint_ends,
    residual,
    sketched,
    turning_past,
    ways,
)
from kin import Robot
from kin.units import Units, general

LONG = 1.5  # ways of the sketch
POINTS = 41  # of a way that is drawn
SPEED, HALF = 0.2, 0.25  # m/s of the tool, and half the length of the line past the axis
OFFSETS = (0.1, 0.05, 0.02)  # m
LINKS, START, END = (1.0, 0.6), (-1.2, 0.7), (-1.2, -0.3)  # m: two links, and a line in their plane


@lru_cache(maxsize=128)
def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    joint, found, between = example(robot), family(robot), ways(robot)
    assert between is not None
    lengths, angles = units.lengths, units.angles
    past = [turning_past(offset, SPEED, HALF) for offset in OFFSETS]
    share, elbows = both_elbows(START, END, LINKS)
    hertz, decimals = frequency(robot), 0 if units.degrees else 2
    swings = residual(found["trapezoidal"], hertz) / max(residual(found["S-curve"], hertz), 1e-12)
    sketch = sketched(robot)
    long, (v, a, _) = LONG * sketch.way, joint.limits.tolist()
    numbers: dict[str, float | Quantity] = {
        "speed": SPEED,
        "closest": Quantity(OFFSETS[0], "length"),
        "sketched": sketch.way,
        "sketch_time": sketch.time,
        "largest": float(joint.limits[0]),
        "shortest": long / v + v / a,
        "at_top": long / v,
        "as_triangle": 2.0 * math.sqrt(long / a),
        "steepest": float(joint.limits[1]),
    }
    rates = (f"{angles.number(float(rate.max()), decimals)} {angles.name}/s" for _, rate in past)
    words = {
        "joint": joint.name,
        "way": angles.text(joint.way),
        "velocity": angles.per_second().text(float(joint.limits[0]), 0),
        "acceleration": angles.per_second(2).brief(float(joint.limits[1])),
        "long_way": angles.brief(long),
        "sketch_way": angles.brief(sketch.way),
        "sketch_seconds": general(sketch.time, 3),
        "duration": f"{found['cubic'].duration:.2f}",
        "speed_shown": lengths.per_second().brief(SPEED),
        "closest_shown": lengths.brief(OFFSETS[0]),
        "rates": ", ".join(rates),
        "distances": ", ".join(map(lengths.brief, OFFSETS)),
        "hertz": general(hertz, 3),
        "swings_shown": f"{swings:.0f}",
        "cost": general(found["S-curve"].duration - found["trapezoidal"].duration, 2),
        "link1": lengths.brief(LINKS[0]),
        "link2": lengths.brief(LINKS[1]),
        "half_turn": angles.brief(math.pi),
        "start": _place(START, units),
        "stop": _place(END, units),
        "blocked": f"{100.0 * float(share[np.argmax(elbows[1] > math.pi)]):.0f}",
        **_compared(between, units),
    }
    shown = {**_figures(robot, units), "ways": figures.two_ways(between, units)}
    answered = {
        "time": figures.timed(angles, long, joint.limits),
        "sketch": figures.sketched(angles, sketch, joint.limits),
    }
    return LessonFacts(numbers, {}, words, _poses(robot, between), shown, leads(between), answered)


def _figures(robot: Robot, units: Units) -> dict[str, Markup]:
    """The charts that are shown with answers."""
    angles = units.angles
    past = [turning_past(offset, SPEED, HALF) for offset in OFFSETS]
    share, elbows = both_elbows(START, END, LINKS)
    return {
        "cubic": figures.cubic(robot, angles),
        "profiles": figures.family_of(robot, angles),
        "ends": figures.ends(robot, angles),
        "past the axis": figures.past_axis(past, OFFSETS, units),
        "load": figures.load(robot, angles),
        "elbows": figures.elbows(share, elbows, angles),
    }


def _compared(between: Ways, units: Units) -> dict[str, str]:
    """How far the PTP leaves the line, and how long both take."""
    _, off = between.off_line()
    return {
        "off": units.lengths.value(float(off.max())),
        "ptp": f"{between.ptp.duration:.2f}",
        "lin": f"{between.lin.duration:.2f}",
    }


def leads(between: Ways) -> dict[str, Lead | None]:
    """The way of the tool on a PTP, the straight line between its ends, and an arc of a circle."""
    points = between.ptp.sample(np.linspace(0.0, between.ptp.duration, POINTS)).T[:, :3, 3]
    start, end = points[0], points[-1]
    way = end - start
    side = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.9 * np.linalg.norm(way) else [1.0, 0.0, 0.0])
    side *= 0.5 * np.linalg.norm(way) / np.linalg.norm(side)
    turn = np.linspace(0.0, np.pi, POINTS)[:, None]
    arc = 0.5 * (start + end) - 0.5 * np.cos(turn) * way + np.sin(turn) * side
    ways = {"ptp": points, "straight": points[[0, -1]], "arc": arc}
    return {name: Path(tuple(map(tuple, each.tolist()))) for name, each in ways.items()}


def _poses(robot: Robot, between: Ways) -> dict[str, Pose]:
    """Home, joint 1 at both ends of its way, and the ends of the line; the ways are drawn at its end."""
    first, last = joint_ends(robot)
    poses = {
        "home": Pose(as_configuration(robot.q_home), drawing={"paths": False}),
        "start of joint 1": Pose(as_configuration(first), drawing={"paths": False}),
        "end of joint 1": Pose(as_configuration(last)),
    }
    for name, t in (("start of the line", 0.0), ("end of the line", between.ptp.duration)):
        q = between.ptp.derivatives(t)[0]
        poses[name] = Pose(as_configuration(q), drawing={"paths": t > 0.0})
    return poses


def _place(point: tuple[float, float], units: Units) -> str:
    x, y = (units.lengths.number(value) for value in point)
    return f"({x}, {y}) {units.lengths.name}"
