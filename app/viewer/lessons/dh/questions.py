"""What the lesson "DH table step by step" teaches and asks."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import cast

import numpy as np

from app.exercises.rows import Factor, turns
from app.viewer.lessons.dh.steps import MOVED, ORDERS, amount, axis_name, expression, low, symbol, value
from app.viewer.lessons.guide.outline import (
    Choice,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    apart,
    count,
    one_right,
    two_percent,
)
from app.viewer.lessons.guide.poses import as_configuration, distance, moved
from kin import Comparison, Robot, compare, fk, link_frames
from kin.axes import joint_axes, pairs
from kin.comparison import messages
from kin.transforms import Array
from kin.units import Units

GOAL = "You can read each row of a DH table as four motions, and say from its numbers where the next frame is."
TURN = math.radians(30.0)
SLIDE = 0.05
_SKEW = 0.01  # sine of a twist that turns the next axis
MOTIONS = {
    "theta": "turn by θ about z",
    "d": "slide by d along z",
    "a": "slide by a along x",
    "alpha": "turn by α about x",
}
RELATIONS = {
    "one": "They are one line.",
    "parallel": "They are parallel.",
    "perpendicular": "They meet at a right angle.",
    "meet": "They meet at another angle.",
    "skew": "They neither meet nor are parallel.",
}


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    row, home = _telling_row(robot), as_configuration(robot.q_home)
    q, taken = moved(robot, 0, TURN if robot.joints[0].kind == "revolute" else SLIDE)
    first = amount("theta" if robot.joints[0].kind == "revolute" else "d", taken, units)
    steps = (
        Step(
            "Rows and frames",
            f"The table has {len(robot.rows)} rows. Each row carries a copy of one frame to the next one.",
            _frames(robot),
            "Every fourth motion places a frame.",
            practice="Press Next below: a copy of frame 0 leaves the base.",
        ),
        Step(
            "Four motions",
            "A row is four motions of the moving frame, about or along its own axes at that moment.",
            _first_motion(robot),
            "The columns of the table are in the order of the motions: first both of z, or first both of x.",
        ),
        Step(
            f"Row {row + 1} as a distance",
            f"Row {row + 1} has {_row_words(robot, row, units)}. Both lengths are at right angles to each other.",
            _origins(robot, row, units),
            f"The origin of frame {row + 1} is that far from frame {row}.",
            pose=Pose(home),
            practice="Walk through the row to see it.",
        ),
        Step(
            "Joint axes",
            "From axis to axis, α is the angle between them and the size of a their distance.",
            _relation(robot, _telling_pair(robot)),
            "The drawing of the arm shows it: look along one axis, then along the other.",
        ),
        Step(
            "A joint and its column",
            f"A joint adds its value to one number of its row. Joint 1 moves by {first} from where it is at home.",
            _swing(robot, q, units),
            "Everything behind joint 1 has moved as one body; its rows are unchanged.",
            pose=Pose(home),
            end=Pose(as_configuration(q)),
        ),
        *_mistyped(robot, units),
    )
    return Outline(GOAL, steps, _check(robot, units), (frozenset({"motions"}),), Pose(home))


def _telling_row(robot: Robot) -> int:
    """A row with a and d, or else with the longest of them."""
    both = [i for i, row in enumerate(robot.rows) if row.a and row.d]
    lengths = [math.hypot(row.a, row.d) for row in robot.rows]
    return both[0] if both else int(np.argmax(lengths))


def _telling_pair(robot: Robot) -> int:
    """The first joint whose axis is not parallel to the next one's; joint 1 otherwise."""
    return next((pair.joint for pair in pairs(robot) if not pair.parallel), 0)


def _row_words(robot: Robot, row: int, units: Units) -> str:
    a, d = (amount(factor, value(robot, row, factor, robot.q_home), units) for factor in ("a", "d"))
    return f"{symbol(robot, row, 'd')} = {d} along z and {symbol(robot, row, 'a')} = {a} along x"


def _frames(robot: Robot) -> Number:
    rows = len(robot.rows)
    return count(
        "How many frames are there, from the base to the tool?",
        rows + 1,
        "Each row leads from one frame to the next, and there is one at the start.",
        (
            (rows, "Frame 0, at the base, is one more: a row leads from a frame to the next one."),
            (4 * rows, "These are the motions. Only after each fourth one there is a frame."),
        ),
    )


def _first_motion(robot: Robot) -> Choice:
    first, *others = ORDERS[robot.convention]
    name = "the standard" if robot.convention == "standard" else "Craig’s"
    why = f"In {name} convention it is motion {{}} of four."
    reason = "That is where this convention begins. The other one begins with the other pair."
    wrong = [(MOTIONS[factor].capitalize() + ".", why.format(k)) for k, factor in enumerate(others, 2)]
    return one_right(
        "Which motion comes first in this table?", (MOTIONS[first].capitalize() + ".", reason), wrong, 2
    )


def origin_distance(robot: Robot, row: int, q: Array) -> float:
    """Between the origins of the frames before and after a row, by forward kinematics."""
    frames = np.concatenate([robot.T_world_base[None], link_frames(robot, q)])
    return distance(frames[row], frames[row + 1])


def _origins(robot: Robot, row: int, units: Units) -> Number:
    a, d = (abs(value(robot, row, factor, robot.q_home)) for factor in ("a", "d"))
    mistakes = (
        Mistake(a + d, "That is the way round the corner. The distance is the straight line."),
        Mistake(max(a, d), "That is only one of the two lengths."),
        Mistake(min(a, d), "That is only one of the two lengths."),
    )
    question = Number(
        f"How far is the origin of frame {row + 1} from the origin of frame {row}, with the arm at home?",
        origin_distance(robot, row, robot.q_home),
        units.lengths,
        0.002,
        "d and a are the sides of a right angle: the distance is √(d² + a²).",
        mistakes,
    )
    return apart(question)


def relation(robot: Robot, joint: int) -> str:
    """How the axes of a joint and the next one lie: a key of `RELATIONS`."""
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


def _relation(robot: Robot, joint: int) -> Choice:
    right = relation(robot, joint)
    slides = any(axis.slides for axis in joint_axes(robot)[joint : joint + 2])
    prompt = f"How do the axes of joints {joint + 1} and {joint + 2} lie?"
    if robot.n < 2:
        prompt = "This arm has one joint. How does its axis lie to itself?"
    if slides:
        prompt += " (A prismatic joint has a direction only; lay its axis so that it meets the other one.)"
    reasons = {
        "one": "Then α and a between them would both be zero.",
        "parallel": "Then α between them would be 0 or 180°.",
        "perpendicular": "Then α between them would be ±90°, and a would be zero.",
        "meet": "Then a between them would be zero, and α no multiple of 90°.",
        "skew": "Then neither α nor a between them would be zero.",
    }
    options = tuple(
        Option(text, "Read α and a of the link between them." if key == right else reasons[key], key == right)
        for key, text in RELATIONS.items()
    )
    return Choice(prompt, options)


def _swing(robot: Robot, q: Array, units: Units) -> Number:
    before, after = fk(robot, robot.q_home), fk(robot, q)
    axis = joint_axes(robot)[0]
    if robot.joints[0].kind == "prismatic":
        method = "A prismatic joint carries the tool along its axis, by its own travel."
        mistakes: tuple[Mistake, ...] = ()
    else:
        foot = before[:3, 3] - axis.point
        far = float(np.linalg.norm(foot - (foot @ axis.direction) * axis.direction))
        method = "The tool moves on a circle about axis 1: with its distance r from that axis, 2 r sin(θ/2)."
        mistakes = (Mistake(far, "That is the distance r of the tool from axis 1."),)
    way = distance(before, after)
    question = Number(
        "How far from its old place is the tool point then?",
        way,
        units.lengths,
        two_percent(way),
        f"{method} Read x, y and z of the tool above.",
        mistakes,
    )
    return apart(question)


@lru_cache(maxsize=64)
def mistyped(robot: Robot) -> tuple[int, Factor, Robot, Comparison] | None:
    """A row, the number of it that gets the wrong sign, the arm of that table, and what a comparison finds.

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


def _mistyped(robot: Robot, units: Units) -> tuple[Step, ...]:
    found = mistyped(robot)
    if found is None:
        return ()
    row, factor, typed, comparison = found
    name, right = symbol(robot, row, factor), float(getattr(robot.rows[row], factor))
    was = amount(factor, -right, units)
    verdict = messages.verdict(comparison, robot, typed, units, ("this arm", "the typed table"))
    options = (
        Option(
            "Nothing: equal joint values still give equal poses.",
            verdict if comparison.verdict == "identical" else "Some poses differ: try it with all joints bent.",
            comparison.verdict == "identical",
        ),
        Option(
            "It is the same arm, but it has another zero or sense of a joint, another base or another tool.",
            {
                "same": verdict,
                "identical": "Neither a joint nor base or tool has changed.",
            }.get(
                comparison.verdict,
                "Zeros, base and tool never change how an axis lies relative to those before it. Here one does.",
            ),
            comparison.verdict == "same",
        ),
        Option(
            "It is another arm: no zeros, base and tool make up for it.",
            verdict
            if comparison.verdict == "different"
            else "Each axis still lies as it did relative to its neighbours.",
            comparison.verdict == "different",
        ),
    )
    prompt = (
        f"Somebody types {name} = {was} in row {row + 1}, with the wrong sign. What does the table then describe?"
    )
    step = Step(
        "A mistake in the table",
        "A wrong number need not make another arm. What counts is how each axis lies relative to those before it.",
        Choice(prompt, options),
        "So two tables that look different may be one arm, and nearly equal ones may not be.",
        practice="Compare with…, in the tab Robot, finds such mistakes in a table of your own.",
    )
    return (step,)


def _check(robot: Robot, units: Units) -> tuple[Number | Choice, ...]:
    k = _offset_joint(robot)
    row = robot.joint_rows[k]
    factor = MOVED[robot.rows[row].kind]
    offset, q = float(getattr(robot.rows[row], factor)), float(robot.q_home[k])
    name = expression(robot, row, factor, units)
    column = Number(
        f"At home, joint {k + 1} is at {amount(factor, q, units)}, and row {row + 1} has {name}. "
        f"How far does this row {'turn about' if turns(factor) else 'slide along'} z?",
        value(robot, row, factor, robot.q_home),
        units.of(turns(factor)),
        math.radians(0.5) if turns(factor) else 0.001,
        "The value of the joint and the offset of the row are added.",
        (
            Mistake(q, "That is the joint alone. The row’s offset is added."),
            Mistake(q - offset, "The offset is added, not taken away."),
        )
        if offset
        else (),
        whole_turns=turns(factor),
    )
    n = len(robot.rows)
    product = one_right(
        "Which product is the pose of the last frame in the base frame?",
        (f"A₁ A₂ … A{low(n)}", "Each row moves the frame about its own axes, so its matrix goes to the right."),
        [
            (f"A{low(n)} … A₂ A₁", "This order would be right for motions about the axes of the base."),
            (f"A₁ + A₂ + … + A{low(n)}", "Rotations do not add: poses are composed by multiplication."),
        ],
        1,
    )
    last = robot.n - 2 if robot.n > 1 else 0
    return apart(column), product, _relation(robot, last), _tool_axis(robot)


def _offset_joint(robot: Robot) -> int:
    """The first joint whose row has an offset; else the last joint that is not at zero at home."""
    for k, row in enumerate(robot.joint_rows):
        if getattr(robot.rows[row], MOVED[robot.rows[row].kind]):
            return k
    return int(np.flatnonzero(robot.q_home)[-1]) if robot.q_home.any() else 0


def _tool_axis(robot: Robot) -> Choice:
    """Whether the last joint moves the tool point: only if the point is not on its axis."""
    k = robot.n - 1
    q, _ = moved(robot, k, TURN if robot.joints[k].kind == "revolute" else SLIDE)
    moves = distance(fk(robot, robot.q_home), fk(robot, q)) > 1e-6
    line = axis_name(robot, robot.joint_rows[k], "theta")
    return Choice(
        f"Only joint {k + 1}, the last one, moves. Does the tool point move?",
        (
            Option("Yes", f"The tool point is {'not ' if moves else ''}on {line}, the axis of that joint.", moves),
            Option(
                "No", f"The tool point is {'not ' if moves else ''}on {line}, the axis of that joint.", not moves
            ),
        ),
    )
