"""What can be chosen for a frame: which line is z, its direction, the normal, the origin and x.

Every choice has its reason, the right ones too: often more than one is right. Choices are computed for the frames
assigned so far, with every joint at 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from app.exercises.rows import Line
from app.viewer.lessons.dh.assignment import Assignment
from app.viewer.lessons.dh.normals import Normal, common_normal
from app.viewer.lessons.dh.steps import low
from kin import fk, link_frames
from kin.axes import cross, frame_of, perpendicular_to
from kin.transforms import Array

Part = Literal["axis", "direction", "normal", "origin", "x"]
PARTS: tuple[Part, ...] = ("axis", "direction", "normal", "origin", "x")
SHIFT = 0.25  # of a line's distance from the base, to show a wrong origin


@dataclass(frozen=True, eq=False)
class Choice:
    """One choice: its text, whether it is right and why, and the direction or point ``(3,)`` that it means."""

    text: str
    right: bool
    reason: str
    value: Array


class Lines(NamedTuple):
    """What a frame between two axes is made from: the axis that bears its z, the other one, and their normal."""

    carrier: Line
    other: Line
    normal: Normal
    x: Array  # from the earlier axis to the later one


def choices(work: Assignment, made: dict[Part, int]) -> dict[Part, tuple[Choice, ...]]:
    """The choices for the next frame, after those `made` for earlier parts; without, the first right ones."""
    number = len(work.frames)
    axis = _axes(work, number)
    z = picked(axis, made.get("axis")).value
    direction = _directions(work, number, z)
    z = picked(direction, made.get("direction")).value
    found: dict[Part, tuple[Choice, ...]] = {"axis": axis, "direction": direction}
    lines = _lines(work, number, z)
    if lines is None:
        origin = _end_origins(work, number, z)
        point = picked(origin, made.get("origin")).value
        return {**found, "normal": (), "origin": origin, "x": _end_xs(work, number, z, point)}
    found["normal"] = _normals(work, number, lines)
    # The right one is not always the first.
    found["origin"] = _rotated(_origins(work, number, lines), number)
    found["x"] = _rotated(_xs(work, number, lines), number + 1)
    return found


def _rotated(found: tuple[Choice, ...], by: int) -> tuple[Choice, ...]:
    by %= len(found)
    return found[by:] + found[:by]


def frame(work: Assignment, made: dict[Part, int]) -> Array:
    """The frame ``(4, 4)`` that the choices mean, whether or not they are right: z, and x made perpendicular."""
    found = choices(work, made)
    z, point, x = (picked(found[part], made.get(part)).value for part in ("direction", "origin", "x"))
    x = x - (x @ z) * z
    length = float(np.linalg.norm(x))
    return frame_of(x / length if length > 1e-6 else perpendicular_to(z), z, point)


def picked(found: tuple[Choice, ...], index: int | None) -> Choice:
    """The choice at this place; None: the first one that is right."""
    return found[index] if index is not None else next(choice for choice in found if choice.right)


def relation_words(work: Assignment, number: int) -> str:
    """How the two axes that make a frame lie, and what follows."""
    carrier, partner = work.carrier(number), work.partner(number)
    if carrier is None:
        if number == 0:
            return "Frame 0 does not move: any place will do. Where frame 1 is at 0 makes the first row short."
        return "No joint follows: the last frame may be anywhere that one row reaches. The rest is the tool."
    if partner is None:
        return (
            "No axis comes before: frame 0 may be anywhere on z₀."
            if number == 0
            else "No axis follows: the last frame may be anywhere on its axis. The rest is the tool."
        )
    lines = _lines(work, number, work.axes[carrier].z)
    assert lines is not None
    first, second = (_name(work, joint) for joint in sorted((carrier, partner)))
    free = (
        " A prismatic joint has a direction only; its line is laid through the joint."
        if any(work.slides(joint) for joint in (carrier, partner))
        else ""
    )
    return {
        "skew": f"{first} and {second} are skew: they have one common normal.",
        "meet": f"{first} and {second} intersect: a = 0. x is perpendicular to both; both directions are right.",
        "parallel": f"{first} and {second} are parallel: they have any number of normals. Choose one; d follows.",
        "one": f"{first} and {second} are one line: there is no normal. Point and x are free; a = 0.",
    }[lines.normal.relation] + free


def _name(work: Assignment, joint: int) -> str:
    """The name of a joint's axis: z₀ is the axis of joint 1 in the standard convention, z₁ in Craig's."""
    return "z" + low(joint if work.convention == "standard" else joint + 1)


def _lines(work: Assignment, number: int, z: Array) -> Lines | None:
    """The two axes of a frame between two joints."""
    carrier, partner = work.carrier(number), work.partner(number)
    if carrier is None or partner is None:
        return None
    standard = work.convention == "standard"
    if standard:
        own, other = work.axes[carrier], Line(work.frames[-1][:3, 3], work.frames[-1][:3, 2])
        normal = common_normal(other, Line(own.point, z), work.near, through=other.point)
    else:
        own, other = work.axes[carrier], work.axes[partner]
        normal = common_normal(Line(own.point, z), other, work.near, through=_arrival(work, own))
    return Lines(Line(own.point, z), other, normal, normal.x)


def _arrival(work: Assignment, carrier: Line) -> Array:
    """Where the normal before meets an axis, in Craig's convention: the origin for d = 0."""
    if not work.frames:
        return carrier.nearest(work.robot.T_world_base[:3, 3])
    old = work.frames[-1]
    return carrier.nearest(old[:3, 3] + ((carrier.point - old[:3, 3]) @ old[:3, 0]) * old[:3, 0])


def _axes(work: Assignment, number: int) -> tuple[Choice, ...]:
    """Which line is z of the frame: the right one comes first only for the first joint."""
    name, right = f"z{low(number)}", work.carrier(number)
    n = work.robot.n
    if right is None:
        return (Choice("free", True, f"{name} is no joint axis.", work.robot.T_world_base[:3, 2]),)
    rule = "joint i + 1, because the row of joint i ends there" if work.convention == "standard" else "joint i"
    return tuple(
        Choice(
            f"axis of joint {joint + 1}",
            joint == right,
            f"{name} is the axis of joint {right + 1}: zᵢ is that of {rule}."
            if joint != right
            else f"{name} is the axis of joint {right + 1}.",
            work.axes[joint].z,
        )
        for joint in range(n)
    )


def _directions(work: Assignment, number: int, z: Array) -> tuple[Choice, ...]:
    joint = work.carrier(number)
    if joint is not None:
        against = f"Right, too: joint {joint + 1} then counts backwards, so its column gets a minus sign."
        return (
            Choice("as the joint counts", True, "The value of the joint counts as it is.", z),
            Choice("the other way", True, against, -z),
        )
    if number == 0:
        first = work.axes[0].z
        return (Choice("along z₁", True, "Then α₀ = 0.", first),)
    tool = fk(work.robot, np.zeros(work.robot.n))[:3, 2]
    last, name = work.frames[-1][:3, 2], f"z{low(number - 1)}"
    return (
        Choice("the approach direction", True, "Then z of the last frame is that of the tool.", tool),
        Choice(f"along {name}", True, "Then α = 0; the tool transform has the rest.", last),
    )


def _normals(work: Assignment, number: int, lines: Lines) -> tuple[Choice, ...]:
    before = f"of z{low(number - 1)} and z{low(number)}"
    after = f"of z{low(number)} and z{low(number + 1)}"
    standard = work.convention == "standard"
    why = (
        "Frame i closes the row of joint i: in the standard convention its normal is that of zᵢ₋₁ and zᵢ."
        if standard
        else "Frame i opens the link to joint i + 1: in Craig’s convention its normal is that of zᵢ and zᵢ₊₁."
    )
    fine = (
        "They have a common normal."
        if lines.normal.relation in ("skew", "parallel")
        else relation_words(work, number)
    )
    return (
        Choice(before, standard, fine if standard else why, lines.normal.x),
        Choice(after, not standard, why if standard else fine, lines.normal.x),
    )


def _origins(work: Assignment, number: int, lines: Lines) -> tuple[Choice, ...]:
    """Where the origin is; it lies on z of the frame."""
    standard, relation = work.convention == "standard", lines.normal.relation
    own, far = (lines.normal.end, lines.normal.start) if standard else (lines.normal.start, lines.normal.end)
    name, other = f"z{low(number)}", f"z{low(number - 1 if standard else number + 1)}"
    inner = "outer" if standard else "inner"
    if relation == "meet":
        away = own + max(0.1, SHIFT * float(np.linalg.norm(own))) * lines.carrier.z
        return (
            Choice("the intersection", True, "Both feet of the normal are there.", own),
            Choice(f"above it on {name}", False, f"From there x would not meet {other} at a right angle.", away),
        )
    if relation == "skew":
        return (
            Choice(f"its foot on {name}", True, f"Origin i lies on zᵢ, the {inner} axis.", own),
            Choice(f"its foot on {other}", False, f"Origin i lies on zᵢ, the {inner} axis of the two.", far),
        )
    following = _following(work, number, lines)
    if relation == "parallel":
        kept = Choice(f"on {name}, so that d = 0", True, "Of all normals the one that makes this row short.", own)
        wrong = Choice(f"its foot on {other}", False, f"Origin i lies on zᵢ, the {inner} axis of the two.", far)
        if following is None or np.allclose(following, own, atol=1e-9):
            return kept, wrong
        return kept, Choice("where the next normal meets it", True, "Then d is in this row.", following), wrong
    kept = Choice("so that d = 0", True, "Any point of the axis is right.", own)
    if following is None or np.allclose(following, own, atol=1e-9):
        return (kept,)
    return kept, Choice("where the next normal meets it", True, "Then d is in this row.", following)


def _following(work: Assignment, number: int, lines: Lines) -> Array | None:
    """Where the normal to the axis after both meets them, as a point of the frame's own axis."""
    carrier, partner = work.carrier(number), work.partner(number)
    assert carrier is not None
    assert partner is not None
    after = max(carrier, partner) + 1
    if after >= work.robot.n:
        return None
    later = lines.carrier if carrier > partner else lines.other
    normal = common_normal(later, work.axes[after], work.near)
    return lines.carrier.nearest(normal.start) if normal.relation in ("skew", "meet") else None


def _xs(work: Assignment, number: int, lines: Lines) -> tuple[Choice, ...]:
    standard, relation = work.convention == "standard", lines.normal.relation
    first, second = (number - 1, number) if standard else (number, number + 1)
    one, two = f"z{low(first)}", f"z{low(second)}"
    z = lines.carrier.z
    if relation == "one":
        old = work.frames[-1][:3, 0] if work.frames else work.robot.T_world_base[:3, 0]
        same = old - (old @ z) * z
        length = float(np.linalg.norm(same))
        same = same / length if length > 1e-6 else perpendicular_to(z)
        side = cross(z, same)
        return (
            Choice(f"as x{low(max(number - 1, 0))}", True, "Every direction perpendicular to z is right.", same),
            Choice("a quarter turn on", True, "Every direction perpendicular to z is right.", side),
        )
    x = lines.x
    if relation == "meet":
        along = lines.other.z
        return (
            Choice(f"{one} × {two}", True, "Perpendicular to both axes.", x),
            Choice(f"{two} × {one}", True, "The opposite direction is as right: α changes its sign.", -x),
            Choice(
                f"along z{low(number - 1 if standard else number + 1)}",
                False,
                "x is perpendicular to both axes.",
                along,
            ),
        )
    across = cross(z, x)
    return (
        Choice(f"from {one} to {two}", True, "Along the normal; a is positive.", x),
        Choice(f"from {two} to {one}", True, "Along the normal, against it: a is negative.", -x),
        Choice("across the normal", False, "x lies along the common normal: a is measured along it.", across),
    )


# The first and the last frame


def _end_origins(work: Assignment, number: int, z: Array) -> tuple[Choice, ...]:
    """The origin of a frame that is not between two joint axes."""
    robot = work.robot
    zero = np.zeros(robot.n)
    base = robot.T_world_base[:3, 3]
    if number == 0:
        first = work.axes[0]
        low_ = Choice("level with the base", True, "Any point of the axis is right.", first.nearest(base))
        if robot.n < 2:
            return (low_,)
        normal = common_normal(first, work.axes[1], work.near, through=base)
        if normal.relation not in ("skew", "meet") or np.allclose(normal.start, low_.value, atol=1e-9):
            return (low_,)
        return low_, Choice("where the first normal meets z", True, "Then d of the first row is 0.", normal.start)
    last, tool = work.frames[-1], fk(robot, zero)
    if work.convention == "modified":
        joint = work.axes[-1]
        kept = Choice("so that d = 0", True, "Any point of the axis is right.", _arrival(work, joint))
        level = Choice("level with the tool", True, "Any point of the axis is right.", joint.nearest(tool[:3, 3]))
        return kept, level
    at_tool = Choice("the tool point", True, "Then the tool transform has no translation.", tool[:3, 3])
    stays = Choice(f"origin {number - 1}", True, "Then a = d = 0; the tool transform has the rest.", last[:3, 3])
    axis = Line(last[:3, 3], last[:3, 2])
    out = tool[:3, 3] - axis.nearest(tool[:3, 3])
    # Off the last axis, x points at it; so z must be at a right angle to that.
    reachable = abs(float(out @ z)) < work.near
    return (at_tool, stays) if reachable else (stays,)


def _end_xs(work: Assignment, number: int, z: Array, point: Array) -> tuple[Choice, ...]:
    """x of a frame that is not between two joint axes: what the row to it, or from it, allows."""
    robot = work.robot
    if number == 0 or work.convention == "modified":
        ways = [("along x of the base", robot.T_world_base[:3, 0])]
        if number:
            ways = [(f"as x{low(number - 1)}", work.frames[-1][:3, 0])]
        if number == 0 and robot.n > 1:
            normal = common_normal(work.axes[0], work.axes[1], work.near)
            ways.append(("along the first normal", normal.x))
        found = [
            Choice(text, True, "Any direction perpendicular to z is right.", x - (x @ z) * z)
            for text, x in ways
            if float(np.linalg.norm(x - (x @ z) * z)) > 1e-6
        ]
        free = Choice("any", True, "Any direction perpendicular to z is right.", perpendicular_to(z))
        return tuple(found) or (free,)
    last = Line(work.frames[-1][:3, 3], work.frames[-1][:3, 2])
    out = point - last.nearest(point)
    x = out if float(np.linalg.norm(out)) > work.near else cross(last.z, z)
    if float(np.linalg.norm(x)) < 1e-6:
        old = fk(robot, np.zeros(robot.n))[:3, 0]
        x = old - (old @ z) * z
        if float(np.linalg.norm(x)) < 1e-6:
            x = perpendicular_to(z)
    x = x / float(np.linalg.norm(x))
    why = f"x is perpendicular to z{low(number - 1)} and through it: one row can do no more."
    return Choice("from the last axis", True, why, x), Choice("towards the last axis", True, why, -x)


def published(work: Assignment) -> Array | None:
    """The frame of the arm's own table with the number of the next one; None after fixed rows."""
    number = len(work.frames)
    robot = work.robot
    rows = (-1, *robot.joint_rows)
    if number > robot.n or list(robot.joint_rows[:number]) != list(range(number)):
        return None
    if number == 0:
        return robot.T_world_base.copy()
    return np.asarray(link_frames(robot, np.zeros(robot.n))[rows[number]])
