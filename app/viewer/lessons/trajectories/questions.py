"""The facts that the texts of the lesson "Trajectories" use (``lesson.toml``)."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.outline import Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.trajectories import figures
from app.viewer.lessons.trajectories.motions import (
    both_elbows,
    example,
    family,
    frequency,
    joint_ends,
    residual,
    turning_past,
    ways,
)
from kin import Robot
from kin.units import Units

SPEED, HALF = 0.2, 0.25  # m/s of the tool, and half the length of the line past the axis
OFFSETS = (0.1, 0.05, 0.02)  # m
LINKS, START, END = (1.0, 0.6), (-1.2, 0.7), (-1.2, -0.3)  # m: two links, and a line in their plane


@lru_cache(maxsize=128)
def outline(robot: Robot, units: Units) -> Outline:
    """The lesson for this arm."""
    return outline_of("trajectories", robot, units, facts(robot, units))


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares."""
    joint, found, between = example(robot), family(robot), ways(robot)
    unit, lengths, angles = units.of(bool(robot.revolute[0])), units.lengths, units.angles
    past = [turning_past(offset, SPEED, HALF) for offset in OFFSETS]
    share, elbows = both_elbows(START, END, LINKS)
    hertz, decimals = frequency(robot), 0 if units.degrees else 2
    swings = residual(found["trapezoidal"], hertz) / max(residual(found["S-curve"], hertz), 1e-12)
    numbers = {
        "both": float(between is not None),
        "speed": SPEED,
        "closest": OFFSETS[0],
        "swings": swings,
    }
    rates = (f"{angles.number(float(rate.max()), decimals)} {angles.name}/s" for _, rate in past)
    words = {
        "joint": joint.name,
        "way": unit.text(joint.way),
        "velocity": f"{unit.number(float(joint.limits[0]), 0)} {unit.name}/s",
        "duration": f"{found['cubic'].duration:.2f}",
        "speed_shown": f"{lengths.brief(SPEED)}/s",
        "closest_shown": lengths.brief(OFFSETS[0]),
        "rates": ", ".join(rates),
        "distances": ", ".join(map(lengths.brief, OFFSETS)),
        "hertz": f"{hertz:.3g}",
        "swings_shown": f"{swings:.0f}",
        "cost": f"{found['S-curve'].duration - found['trapezoidal'].duration:.2g}",
        "link1": lengths.brief(LINKS[0]),
        "link2": lengths.brief(LINKS[1]),
        "half_turn": angles.brief(math.pi),
        "start": _place(START, units),
        "stop": _place(END, units),
        "blocked": f"{100.0 * float(share[np.argmax(elbows[1] > math.pi)]):.0f}",
        **dict.fromkeys(("off", "ptp", "lin"), ""),
    }
    shown = {
        "cubic": figures.cubic(robot, unit),
        "profiles": figures.family_of(robot, unit),
        "ends": figures.ends(robot, unit),
        "past the axis": figures.past_axis(past, OFFSETS, units),
        "load": figures.load(robot, unit),
        "elbows": figures.elbows(share, elbows, angles),
    }
    if between is not None:
        _, off = between.off_line()
        ptp, lin = between
        words |= {
            "off": lengths.value(float(off.max())),
            "ptp": f"{ptp.duration:.2f}",
            "lin": f"{lin.duration:.2f}",
        }
        shown["ways"] = figures.two_ways(between, units)
    return LessonFacts(numbers, {}, words, _poses(robot), shown)


def _poses(robot: Robot) -> dict[str, Pose]:
    """Home, joint 1 at both ends of its way, and the ends of the line; the ways are drawn at its end."""
    first, last = joint_ends(robot)
    poses = {
        "home": Pose(as_configuration(robot.q_home), drawing={"paths": False}),
        "start of joint 1": Pose(as_configuration(first), drawing={"paths": False}),
        "end of joint 1": Pose(as_configuration(last)),
    }
    if (between := ways(robot)) is not None:
        ptp = between.ptp
        for name, t in (("start of the line", 0.0), ("end of the line", ptp.duration)):
            q = ptp.derivatives(t)[0]
            poses[name] = Pose(as_configuration(q), drawing={"paths": t > 0.0})
    return poses


def _place(point: tuple[float, float], units: Units) -> str:
    x, y = (units.lengths.number(value) for value in point)
    return f"({x}, {y}) {units.lengths.name}"
