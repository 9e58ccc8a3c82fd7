"""The facts that the texts of the lesson "DH table step by step" use (``lesson.toml``): an arm at home."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import cast

import numpy as np

from app.exercises.rows import Factor, turns
from app.exercises.variant import Quantity
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.dh.axes_drawing import axis_names
from app.viewer.lessons.dh.steps import MOVED, amount, axis_name, expression, low, symbol, value
from app.viewer.lessons.guide.content import LessonFacts, outline_of
from app.viewer.lessons.guide.leads import DOWN, UP, direction, level, line
from app.viewer.lessons.guide.outline import Lead, Outline, Pose
from app.viewer.lessons.guide.poses import as_configuration, distance, moved
from kin import Robot, compare, fk
from kin.axes import joint_axes, pairs
from kin.comparison import Comparison, messages
from kin.units import Units

TURN = math.radians(30.0)
SLIDE = 0.05
ROW = {  # an example whose motions do not commute
    "turn": Quantity(math.radians(40.0), "angle"),
    "rise": Quantity(0.3, "length"),
    "reach_out": Quantity(0.2, "length"),
    "twist": Quantity(math.radians(60.0), "angle"),
}
_SKEW = 0.01  # sine of a twist that turns the next axis
RELATIONS = ("one", "parallel", "perpendicular", "meet", "skew")  # by their numbers in the file
LYING = ("one line", "parallel", "right angle", "another angle", "skew")  # what the options of these are drawn as
ALIKE = 1.25  # of two lengths that look alike, one by the other
OFF = 0.15  # of the reach: between two lines that do not meet
VERDICTS = ("identical", "same", "different")


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    return outline_of("dh", robot, units, facts(robot, units))


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; joints and rows count from 1."""
    n, row, q, taken = robot.n, _telling_row(robot), *moved(robot, 0, _little(robot, 0))
    a, d = (value(robot, row, factor, robot.q_home) for factor in ("a", "d"))
    pair = next((pair.joint + 1 for pair in pairs(robot) if not pair.parallel), 1)
    end = max(n - 1, 1)
    numbers: dict[str, float | Quantity] = {
        "rows": len(robot.rows),
        "n": n,
        "standard": robot.convention == "standard",
        "row": row + 1,
        "before": row,
        "a": Quantity(abs(a), "length"),
        "d": Quantity(abs(d), "length"),
        "pair": pair,
        "pair_next": pair + 1,
        "end": end,
        "end_next": end + 1,
        **where(robot),
        "swings": robot.revolute[0],
        "way": distance(fk(robot, robot.q_home), fk(robot, q)),
        "radius": _radius(robot),
        "tool_moves": _tool_moves(robot),
    }
    words = {
        "last_row": low(len(robot.rows)),
        "lengths": f"{symbol(robot, row, 'd')} = {amount('d', d, units)} along z and "
        f"{symbol(robot, row, 'a')} = {amount('a', a, units)} along x",
        "moved": amount("theta" if robot.revolute[0] else "d", taken, units),
        "last_axis": axis_name(robot, robot.joint_rows[-1], "theta"),
    }
    names = axis_names(robot)
    for name, joint in (("pair", pair), ("end", end)):
        words[f"axes_{name}"] = " and ".join(names[joint - 1 : joint + 1])
        words[f"between_{name}"] = _between(robot, joint - 1, units)
    for more_numbers, more_words in (_wrong_sign(robot, units), _offset(robot, units)):
        numbers |= more_numbers
        words |= more_words
    functions = {
        "lie": lambda joint: float(RELATIONS.index(relation(robot, int(joint) - 1))),
        "slides": lambda joint: float(
            any(axis.slides for axis in joint_axes(robot)[int(joint) - 1 : int(joint) + 1])
        ),
    }
    poses = {"home": Pose(as_configuration(robot.q_home)), "moved": Pose(as_configuration(q))}
    values = {name: x if isinstance(x, Quantity) else float(x) for name, x in numbers.items()}
    return LessonFacts({**values, **ROW}, functions, words, poses, leads=leads(robot, pair))


def where(robot: Robot) -> dict[str, bool]:
    """Whether the tool at home is above, beside or below frame 0's origin; near the diagonal, two of these."""
    way = fk(robot, robot.q_home)[:3, 3] - robot.T_world_base[:3, 3]
    side, up = float(np.hypot(way[0], way[1])), float(way[2])
    return {
        "above": ALIKE * up > side,
        "beside": ALIKE * side >= abs(up),
        "below": -ALIKE * up > side,
    }


def leads(robot: Robot, pair: int) -> dict[str, Lead | None]:
    """Where options lead: from frame 0 to the tool, and along a second axis that lies as an option says.

    Args:
        pair: the number of the first of two axes; the second is where the option says, and truly where it is.
    """
    base, tool = robot.T_world_base[:3, 3], fk(robot, robot.q_home)[:3, 3]
    way = tool - base
    ways = {"above": UP, "beside": level(way), "below": DOWN}
    ways |= {name: way for name, holds in where(robot).items() if holds}
    found = {name: direction(robot, base, each) for name, each in ways.items()}
    if robot.n < 2:
        return {**found, **dict.fromkeys(LYING)}
    points, axes = axes_at(robot, robot.q_home)
    point, z, off = points[pair - 1], axes[pair - 1], OFF * robot.reach
    across = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.7 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    third = np.cross(z, across)
    lines = dict(
        zip(
            LYING,
            (
                (point, z),
                (point + off * third, z),
                (point, across),
                (point, (z + across) / math.sqrt(2.0)),
                (point + off * third, across),
            ),
            strict=True,
        )
    )
    lines[LYING[RELATIONS.index(relation(robot, pair - 1))]] = points[pair], axes[pair]
    return {**found, **{name: line(robot, *each) for name, each in lines.items()}}


def _little(robot: Robot, joint: int) -> float:
    """By how much a joint is moved to see what it does (rad or m)."""
    return TURN if robot.revolute[joint] else SLIDE


def _telling_row(robot: Robot) -> int:
    """A row with a and d, or else with the longest of them."""
    both = [i for i, row in enumerate(robot.rows) if row.a and row.d]
    lengths = [math.hypot(row.a, row.d) for row in robot.rows]
    return both[0] if both else int(np.argmax(lengths))


def relation(robot: Robot, joint: int) -> str:
    """How the axes of a joint and the next one lie: one of `RELATIONS`."""
    if robot.n < 2:
        return "one"
    pair = pairs(robot)[joint]
    axes = joint_axes(robot)
    slides = axes[joint].slides or axes[joint + 1].slides
    if pair.parallel:
        return "one" if pair.intersect and not slides else "parallel"
    if pair.intersect or slides:
        return "perpendicular" if pair.perpendicular else "meet"
    return "skew"


def _between(robot: Robot, joint: int, units: Units) -> str:
    """The angle and the distance between the axes of a joint, which counts from 0, and the next one."""
    if robot.n < 2:
        return "It is the same line."
    pair = pairs(robot)[joint]
    angle = units.angles.text(pair.angle)
    if math.isnan(pair.distance):
        return f"The angle between them is {angle}."
    return f"The angle between them is {angle}, and their distance {units.lengths.text(pair.distance)}."


def _radius(robot: Robot) -> float:
    """The distance of the tool from axis 1 at home."""
    axis = joint_axes(robot)[0]
    foot = fk(robot, robot.q_home)[:3, 3] - axis.point
    return float(np.linalg.norm(foot - (foot @ axis.direction) * axis.direction))


def _tool_moves(robot: Robot) -> bool:
    """Whether the last joint moves the tool point: only if the point is not on its axis."""
    q, _ = moved(robot, robot.n - 1, _little(robot, robot.n - 1))
    return distance(fk(robot, robot.q_home), fk(robot, q)) > 1e-6


@lru_cache(maxsize=64)
def mistyped(robot: Robot) -> tuple[int, Factor, Robot, Comparison] | None:
    """A row, which of its numbers gets the wrong sign, the arm of that table, and the findings of a comparison.

    The sign of α that turns an axis, or else of the first length; None if the table has neither.
    """
    twists = [(row, "alpha") for row, joint in enumerate(robot.rows) if abs(math.sin(joint.alpha)) > _SKEW]
    lengths = [
        (row, factor) for factor in ("a", "d") for row, each in enumerate(robot.rows) if getattr(each, factor)
    ]
    for row, factor in [*twists[1:], *twists[:1], *lengths]:
        rows = list(robot.rows)
        rows[row] = replace(rows[row], **{factor: -getattr(rows[row], factor)})
        typed = replace(robot, rows=tuple(rows), capsules=(), capsules_source="")
        return row, cast(Factor, factor), typed, compare(robot, typed, explain=False)
    return None


def _wrong_sign(robot: Robot, units: Units) -> tuple[dict[str, float], dict[str, str]]:
    """What the step on a mistake in the table is about."""
    found = mistyped(robot)
    if found is None:
        return {"mistyped": 0.0, "wrong_row": 0.0, "compared": 0.0}, {"wrong": "", "verdict": ""}
    row, factor, typed, comparison = found
    was = amount(factor, -float(getattr(robot.rows[row], factor)), units)
    verdict = messages.verdict(comparison, robot, typed, units, ("this arm", "the typed table"))
    numbers = {"mistyped": 1.0, "wrong_row": row + 1.0, "compared": float(VERDICTS.index(comparison.verdict))}
    return numbers, {"wrong": f"{symbol(robot, row, factor)} = {was}", "verdict": verdict}


def _offset(robot: Robot, units: Units) -> tuple[dict[str, float | Quantity], dict[str, str]]:
    """A joint and the number of its row that it changes, at home."""
    k = _offset_joint(robot)
    row, q = robot.joint_rows[k], float(robot.q_home[k])
    factor = MOVED[robot.rows[row].kind]
    measure = "angle" if turns(factor) else "length"
    numbers: dict[str, float | Quantity] = {
        "joint": k + 1.0,
        "joint_row": row + 1.0,
        "joint_turns": float(turns(factor)),
        "offset": Quantity(float(getattr(robot.rows[row], factor)), measure),
        "alone": Quantity(q, measure),
    }
    return numbers, {"joint_at": amount(factor, q, units), "expression": expression(robot, row, factor, units)}


def _offset_joint(robot: Robot) -> int:
    """The first joint whose row has an offset; else the last joint that is not at zero at home."""
    for k, row in enumerate(robot.joint_rows):
        if getattr(robot.rows[row], MOVED[robot.rows[row].kind]):
            return k
    return int(np.flatnonzero(robot.q_home)[-1]) if robot.q_home.any() else 0
