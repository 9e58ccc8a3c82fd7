"""Goal, steps and check of the lesson "Trajectories"."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from app.viewer.lessons.guide.outline import PLAIN, Choice, Mistake, Number, Outline, Pose, Step, one_right
from app.viewer.lessons.guide.poses import as_configuration
from app.viewer.lessons.trajectories.chart import Curve, Row, chart
from app.viewer.lessons.trajectories.motions import (
    Ways,
    both_elbows,
    example,
    family,
    frequency,
    residual,
    sampled,
    swing,
    turning_past,
    ways,
)
from kin import Robot
from kin.motion import profiles
from kin.units import Unit, Units

GOAL = (
    "You can choose a profile by its boundary conditions, say what PTP and LIN make of the same two poses, and "
    "why "
    "a line past a singularity is slow and a jump of the acceleration makes the tool shake."
)
SPEED, HALF = 0.2, 0.25  # m/s of the tool, and half the length of the line past the axis
OFFSETS = (0.1, 0.05, 0.02)  # m
LINKS, START, END = (1.0, 0.6), (-1.2, 0.7), (-1.2, -0.3)  # m: two links, and a line in their plane
_TITLES = ("Position", "Velocity", "Acceleration", "Jerk")


@lru_cache(maxsize=128)
def outline(robot: Robot, units: Units) -> Outline:
    """The lesson for this arm."""
    found = ways(robot)
    steps = [_boundary(robot, units), _side_by_side(robot, units), _velocities(robot, units)]
    if found is not None:
        steps.append(_two_ways(found, units))
    steps += [_singularity(robot, units), _jerk(robot, units), _postures(units)]
    return Outline(GOAL, tuple(steps), _check(), pose=Pose(as_configuration(robot.q_home)))


def _unit(robot: Robot, units: Units) -> Unit:
    return units.of(bool(robot.revolute[0]))


def _rows(unit: Unit, quantities: tuple[int, ...], limits: tuple[float, ...] = ()) -> tuple[Row, ...]:
    """Rows of position and its derivatives; `limits` of velocity, acceleration and jerk in this unit."""
    titles = [f"{_TITLES[k]}, {unit.name}{('', '/s', '/s²', '/s³')[k]}" for k in quantities]
    return tuple(
        Row(title, limits[k - 1] if limits and k else None) for k, title in zip(quantities, titles, strict=True)
    )


def _boundary(robot: Robot, units: Units) -> Step:
    joint, unit = example(robot), _unit(robot, units)
    times, values = sampled(family(robot)["cubic"], unit.scale)
    return Step(
        "A cubic from rest to rest",
        f"Joint 1 ({joint.name}) goes {unit.text(joint.way)} from rest to rest. A polynomial of degree three "
        f"has four "
        "coefficients: they meet position and velocity at both ends. Nothing is left to choose the acceleration.",
        one_right(
            "What does the acceleration of the cubic do at the start?",
            (
                "It jumps to its largest value.",
                "Velocity is a parabola, so acceleration is a falling line: largest at the start.",
            ),
            (
                ("It starts at zero and rises steadily.", "That would need a fifth condition: a quintic has it."),
                (
                    "It is zero all the time.",
                    "Then the velocity would not change, and the joint would stay at rest.",
                ),
            ),
            1,
        ),
        "Acceleration falls on a line from +a to −a; at both ends it jumps, and the jerk there is infinite.",
        figure=chart(_rows(unit, (0, 1, 2)), (Curve("cubic", times, values[:3]),), "A cubic from rest to rest"),
    )


def _side_by_side(robot: Robot, units: Units) -> Step:
    joint, unit, found = example(robot), _unit(robot, units), family(robot)
    curves = []
    for name, profile in found.items():
        times, values = sampled(profile, unit.scale)
        curves.append(Curve(f"{name} {profile.duration:.2f} s", times, values[:3]))
    limits = tuple((joint.limits * unit.scale).tolist())
    ratio = (
        "The mean velocity is way / time. Differentiate q = d (3 s² − 2 s³) with s = t / T, and take the "
        "middle, s = ½."
    )
    return Step(
        "Profiles side by side",
        f"The same way with the same limits: {unit.number(limits[0] / unit.scale, 0)} {unit.name}/s, and "
        f"acceleration to "
        "match. A cubic is at its largest velocity only for a moment.",
        Number(
            "By which factor is the largest velocity of a cubic from rest to rest above its mean velocity?",
            1.5,
            PLAIN,
            0.02,
            ratio,
            (
                Mistake(
                    2.0,
                    "That is a triangle: it rises and falls on straight lines. The cubic's velocity is "
                    "a parabola.",
                ),
                Mistake(1.875, "That is the quintic's: its velocity is narrower."),
                Mistake(1.0, "Then it would be constant, and jump at both ends."),
            ),
        ),
        "1.5 for the cubic, 1.875 for the quintic; a trapezoidal profile stays at the limit and is the "
        "fastest. It "
        "and the cubic jump in acceleration; quintic and S-curve do not.",
        figure=chart(_rows(unit, (0, 1, 2), limits), tuple(curves), "Four profiles of the same way"),
    )


def _velocities(robot: Robot, units: Units) -> Step:
    joint, unit = example(robot), _unit(robot, units)
    duration = family(robot)["cubic"].duration
    mean = joint.way / duration
    curves = []
    for name, end in (
        ("ends at rest", 0.0),
        ("ends with the mean velocity", mean),
        ("ends moving back", -2.0 * mean),
    ):
        times, values = sampled(profiles.cubic(0.0, joint.way, duration, 0.0, end), unit.scale)
        curves.append(Curve(name, times, values[:2]))
    return Step(
        "Boundary velocities",
        "Waypoints that are passed without a stop need velocities at the ends. The same cubic meets any: here "
        "it ends at "
        f"the same place after {duration:.2f} s, at rest, going on, or moving back.",
        one_right(
            "Where is the joint largest if it has to arrive with a velocity that points back?",
            (
                "Beyond the target.",
                "It has to come back to the target, so it passes it before: check limits inside a move too.",
            ),
            (
                ("At the target.", "There the velocity points back, so a moment before the joint was farther."),
                ("Before the target.", "It arrives at the target, so it is at least as large as that."),
            ),
            2,
        ),
        "Boundary conditions shape the whole curve: it may overshoot between two points that are both allowed.",
        figure=chart(_rows(unit, (0, 1)), tuple(curves), "Three cubics with different velocities at the end"),
    )


def _two_ways(found: Ways, units: Units) -> Step:
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
    start, end = (tuple(found.ptp.derivatives(t)[0].tolist()) for t in (0.0, found.ptp.duration))
    return Step(
        "Joints or tool",
        "The same two configurations, joined twice: PTP interpolates the joints, LIN the pose of the tool. Both "
        "keep every "
        "limit of the joints. Start and end are the same.",
        one_right(
            "Which way does the tool take on the PTP?",
            (
                "A curve that nobody has chosen.",
                "Turning joints move the tool on arcs; together they give a curve.",
            ),
            (
                (
                    "A straight line: all joints start and end together.",
                    "Straight in the space of the joints, not of the tool.",
                ),
                ("An arc of a circle.", "Only if a single joint turns."),
            ),
            0,
        ),
        f"The tool leaves the line by up to {lengths.value(float(off.max()))}. PTP takes "
        f"{found.ptp.duration:.2f} s, LIN "
        f"{found.lin.duration:.2f} s: PTP is never slower between two given configurations, LIN goes where "
        f"you expect.",
        figure=chart(rows, curves, "PTP and LIN between the same two configurations"),
        pose=Pose(start),
        end=Pose(end),
    )


def _singularity(robot: Robot, units: Units) -> Step:
    lengths, angles = units.lengths, units.angles
    curves, largest = [], []
    for offset in OFFSETS:
        x, rate = turning_past(offset, SPEED, HALF)
        curves.append(Curve(lengths.brief(offset), x * lengths.scale, (rate * angles.scale,)))
        largest.append(float(rate.max()))
    speed = f"{lengths.brief(SPEED)}/s"
    decimals = 0 if units.degrees else 2
    rates = ", ".join(f"{angles.number(rate, decimals)} {angles.name}/s" for rate in largest)
    return Step(
        "Past a singularity",
        f"The tool moves on a straight line at {speed} and passes the axis of a turning joint at a small "
        f"distance. On the "
        "axis itself that joint cannot move the tool: a singularity. Beside it, the joint has to turn the arm "
        "around.",
        Number(
            f"The line passes the axis at {lengths.brief(OFFSETS[0])}. How fast must the joint turn at the "
            f"closest place, in "
            f"{angles.name}/s?",
            SPEED / OFFSETS[0],
            angles,
            0.02 * SPEED / OFFSETS[0],
            "At the closest place the tool moves perpendicular to the radius: angular velocity = speed / "
            "distance.",
            (
                Mistake(
                    SPEED * OFFSETS[0], "Divide the speed by the distance: a smaller radius needs a faster turn."
                ),
            ),
        ),
        f"Half the distance needs twice the rate: {rates} at {', '.join(map(lengths.brief, OFFSETS))}. No "
        f"joint can "
        "do that on the axis. A planner slows down near it, or refuses the line; a PTP, whose joints never "
        "hurry, is "
        "possible.",
        figure=chart(
            (Row(f"Rate of the joint, {angles.name}/s"),),
            tuple(curves),
            "Rate of the joint along three lines",
            lengths.name,
        ),
    )


def _jerk(robot: Robot, units: Units) -> Step:
    unit, found, hertz = _unit(robot, units), family(robot), frequency(robot)
    curves = []
    for name in ("trapezoidal", "S-curve"):
        times, x = swing(found[name], hertz)
        push = np.where(times < found[name].duration, found[name].sample(times)[2], 0.0)
        curves.append(Curve(name, times, (push * unit.scale, x * unit.scale)))
    rows = (Row(f"Acceleration, {unit.name}/s²"), Row(f"Swing of the load, {unit.name}"))
    ratio = residual(found["trapezoidal"], hertz) / max(residual(found["S-curve"], hertz), 1e-12)
    cost = found["S-curve"].duration - found["trapezoidal"].duration
    swings = (
        f"After the stop, the load swings {ratio:.0f} times as far with the trapezoidal profile as with the "
        f"S-curve, which takes {cost:.2g} s more."
        if ratio > 1.5
        else "Here the load swings about as far with both: the ramps of the S-curve are short beside its period."
    )
    return Step(
        "Why jerk matters",
        f"A load hangs on the joint like on a spring; left alone it swings {hertz:.3g} times a second. The "
        f"joint makes "
        "the same way with a trapezoidal profile and with an S-curve, and stops.",
        one_right(
            "What makes the load swing on after the stop?",
            (
                "Jumps of the acceleration.",
                "Each jump is a blow on the spring. Limited jerk spreads it over a ramp.",
            ),
            (
                ("The largest velocity.", "At a constant velocity the spring feels nothing."),
                ("The duration of the motion.", "A slow motion with blows swings too; a smooth one hardly."),
            ),
            1,
        ),
        f"{swings} A ramp that lasts as long as one swing leaves the load at rest.",
        figure=chart(rows, tuple(curves), "A swinging load behind two profiles"),
    )


def _postures(units: Units) -> Step:
    lengths, angles = units.lengths, units.angles
    share, found = both_elbows(START, END, LINKS)
    half = angles.brief(np.pi)
    curves = tuple(
        Curve(f"elbow {name}", 100.0 * share, (row * angles.scale,))
        for name, row in zip(("positive", "negative"), found, strict=True)
    )
    stop = 100.0 * float(share[np.argmax(found[1] > np.pi)])
    places = [f"({lengths.number(x)}, {lengths.number(y)}) {lengths.name}" for x, y in (START, END)]
    return Step(
        "From which posture a line goes through",
        f"Two links of {lengths.brief(LINKS[0])} and {lengths.brief(LINKS[1])}, whose joints turn ±{half}. The "
        f"tool drives a line from {places[0]} to {places[1]}, across the negative x axis. At its start the arm "
        "has two postures, and on a line it keeps the one it has.",
        one_right(
            "From which posture does the line go through?",
            (
                "Elbow positive: joint 1 points less far round than the tool.",
                "It stays behind the direction to the tool, and has not come to its limit when the line ends.",
            ),
            (
                (
                    "Elbow negative: joint 1 points farther round than the tool.",
                    "It runs ahead of the direction to the tool, and comes to its limit first.",
                ),
                ("From both: the start and the end are within reach.", "Reach is not enough: follow joint 1."),
                ("From none: the line crosses the axis.", "The tool crosses it, joint 1 need not."),
            ),
            0,
        ),
        f"With the elbow negative, joint 1 is at {half} after {stop:.0f} % of the line, and cannot go on. So a "
        "line that stops or is refused may go through from another posture at its start.",
        practice="In the tab Program, Postures… at a line or an arc shows all postures of the arm along it, and "
        "what is in the way of each.",
        figure=chart(
            (Row(f"Joint 1, {angles.name}", np.pi * angles.scale),),
            curves,
            "Joint 1 along the line, both elbows",
            "%",
        ),
    )


def _check() -> tuple[Number | Choice, ...]:
    return (
        Number(
            "A cubic moves 2 units from rest to rest in 2 s. What is its acceleration at the start?",
            3.0,
            PLAIN,
            0.02,
            "a = 6 d / T².",
            (
                Mistake(6.0, "Divide by the square of the time: 6 · 2 / 2²."),
                Mistake(1.5, "That is its largest velocity."),
            ),
        ),
        one_right(
            "Velocity and acceleration have to be continuous through every waypoint. Which profile?",
            ("quintic", "Six coefficients meet position, velocity and acceleration at both ends."),
            (
                ("cubic", "Its four coefficients leave the acceleration open."),
                ("trapezoidal", "Its acceleration jumps four times."),
            ),
            1,
        ),
        Number(
            "A line passes an axis at 50 mm, and its joint may turn at 4 rad/s. How fast may the tool be there, "
            "in m/s?",
            0.2,
            PLAIN,
            0.005,
            "speed = angular velocity · distance.",
            (
                Mistake(80.0, "Multiply by the distance, in metres."),
                Mistake(200.0, "That is in mm/s."),
            ),
        ),
        one_right(
            "A line across a singularity is refused, and only its end matters. What helps?",
            ("A PTP to the same target.", "The joints go straight there, and none has to hurry."),
            (
                ("A smaller tool speed.", "On the singularity even a slow line would need an infinite rate."),
                ("A larger zone at the start.", "It changes the corner, not the line."),
            ),
            2,
        ),
    )
