"""The facts that the texts of the lesson "DH table step by step" use (``lesson.toml``): an arm at home."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from app.exercises.variant import Quantity
from app.viewer.lessons.axes import axes_at
from app.viewer.lessons.dh.axes_drawing import axis_names
from app.viewer.lessons.dh.steps import amount, axis_name, expression, low, symbol, value
from app.viewer.lessons.guide.content import LessonFacts
from app.viewer.lessons.guide.leads import DOWN, UP, direction, line
from app.viewer.lessons.guide.outline import Lead, Pose
from app.viewer.lessons.guide.poses import as_configuration, distance, moved
from kin import Robot, compare, fk
from kin.axes import pairs
from kin.comparison import Comparison, messages
from kin.units import Units

TURN = math.radians(30.0)
ROW = {  # an example whose motions do not commute
    "turn": Quantity(math.radians(40.0), "angle"),
    "rise": Quantity(0.3, "length"),
    "reach_out": Quantity(0.2, "length"),
    "twist": Quantity(math.radians(60.0), "angle"),
}
_SKEW = 0.01  # sine of a twist that turns the next axis
OFF = 0.15  # of the reach: between two lines that do not meet


def facts(robot: Robot, units: Units) -> LessonFacts:
    """What the file declares; joints and rows count from 1."""
    n, row, q, taken = robot.n, _telling_row(robot), *moved(robot, 0, TURN)
    a, d = (value(robot, row, factor, robot.q_home) for factor in ("a", "d"))
    pair, end = next((pair.joint + 1 for pair in pairs(robot) if pair.parallel), 1), n - 1
    numbers: dict[str, float | Quantity] = {
        "rows": len(robot.rows),
        "n": n,
        "row": row + 1,
        "before": row,
        "a": Quantity(abs(a), "length"),
        "d": Quantity(abs(d), "length"),
        "pair": pair,
        "pair_next": pair + 1,
        "end": end,
        "end_next": end + 1,
        "way": distance(fk(robot, robot.q_home), fk(robot, q)),
        "radius": _off_axis(robot, 0),
        "off_axis": _off_axis(robot, n - 1),
    }
    words = {
        "last_row": low(len(robot.rows)),
        "lengths": f"{symbol(robot, row, 'd')} = {amount('d', d, units)} along z and "
        f"{symbol(robot, row, 'a')} = {amount('a', a, units)} along x",
        "moved": amount("theta", taken, units),
        "last_axis": axis_name(robot, robot.joint_rows[-1], "theta"),
    }
    names = axis_names(robot)
    for name, joint in (("pair", pair), ("end", end)):
        words[f"axes_{name}"] = " and ".join(names[joint - 1 : joint + 1])
        words[f"between_{name}"] = _between(robot, joint - 1, units)
    for more_numbers, more_words in (_wrong_sign(robot, units), _offset(robot, units)):
        numbers |= more_numbers
        words |= more_words
    poses = {"home": Pose(as_configuration(robot.q_home)), "moved": Pose(as_configuration(q))}
    values = {name: x if isinstance(x, Quantity) else float(x) for name, x in numbers.items()}
    return LessonFacts({**values, **ROW}, {}, words, poses, leads=leads(robot, pair))


def leads(robot: Robot, pair: int) -> dict[str, Lead | None]:
    """Where options lead: from frame 0 to the tool, and along a second axis that lies as an option says.

    Args:
        pair: the number of the first of two parallel axes; a second one is where an option says.
    """
    base, tool = robot.T_world_base[:3, 3], fk(robot, robot.q_home)[:3, 3]
    ways = {"above": UP, "beside": tool - base, "below": DOWN}
    found = {name: direction(robot, base, each) for name, each in ways.items()}
    points, axes = axes_at(robot, robot.q_home)
    point, z, off = points[pair - 1], axes[pair - 1], OFF * robot.reach
    across = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.7 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    lines = {
        "one line": (point, z),
        "parallel": (points[pair], axes[pair]),
        "right angle": (point, across),
        "another angle": (point, (z + across) / math.sqrt(2.0)),
        "skew": (point + off * np.cross(z, across), across),
    }
    return {**found, **{name: line(robot, *each) for name, each in lines.items()}}


def _telling_row(robot: Robot) -> int:
    """A row with a and d, or else with the longest of them."""
    both = [i for i, row in enumerate(robot.rows) if row.a and row.d]
    lengths = [math.hypot(row.a, row.d) for row in robot.rows]
    return both[0] if both else int(np.argmax(lengths))


def _between(robot: Robot, joint: int, units: Units) -> str:
    """The angle and the distance between the axes of a joint, which counts from 0, and the next one."""
    pair = pairs(robot)[joint]
    angle = units.angles.text(pair.angle)
    return f"The angle between them is {angle}, and their distance {units.lengths.text(pair.distance)}."


def _off_axis(robot: Robot, joint: int) -> float:
    """The distance (m) of the tool point from the axis of a joint, at home."""
    points, axes = axes_at(robot, robot.q_home)
    return float(np.linalg.norm(np.cross(fk(robot, robot.q_home)[:3, 3] - points[joint], axes[joint])))


@lru_cache(maxsize=64)
def mistyped(robot: Robot) -> tuple[int, Robot, Comparison]:
    """A row whose α gets the wrong sign, the arm of that table, and the findings of a comparison.

    If there is such a row, the table describes the same arm with other zeros, base or tool.
    """
    twists = [row for row, joint in enumerate(robot.rows) if abs(math.sin(joint.alpha)) > _SKEW]
    assert twists
    for row in [*twists[1:], *twists[:1]]:
        rows = list(robot.rows)
        rows[row] = replace(rows[row], alpha=-rows[row].alpha)
        typed = replace(robot, rows=tuple(rows), capsules=(), capsules_source="")
        found = compare(robot, typed, explain=False)
        if found.verdict == "same":
            break
    return row, typed, found


def _wrong_sign(robot: Robot, units: Units) -> tuple[dict[str, float], dict[str, str]]:
    """What the step on a mistake in the table is about."""
    row, typed, comparison = mistyped(robot)
    was = amount("alpha", -float(robot.rows[row].alpha), units)
    verdict = messages.verdict(comparison, robot, typed, units, ("this arm", "the table as entered"))
    return {"wrong_row": row + 1.0}, {"wrong": f"{symbol(robot, row, 'alpha')} = {was}", "verdict": verdict}


def _offset(robot: Robot, units: Units) -> tuple[dict[str, float | Quantity], dict[str, str]]:
    """A joint and the number of its row that it changes, at home."""
    k = _offset_joint(robot)
    row, q = robot.joint_rows[k], float(robot.q_home[k])
    numbers: dict[str, float | Quantity] = {
        "joint": k + 1.0,
        "joint_row": row + 1.0,
        "offset": Quantity(robot.rows[row].theta, "angle"),
        "alone": Quantity(q, "angle"),
    }
    return numbers, {"joint_at": amount("theta", q, units), "expression": expression(robot, row, "theta", units)}


def _offset_joint(robot: Robot) -> int:
    """The first joint whose row has an offset; else the last joint that is not at zero at home."""
    for k, row in enumerate(robot.joint_rows):
        if robot.rows[row].theta:
            return k
    return int(np.flatnonzero(robot.q_home)[-1])
