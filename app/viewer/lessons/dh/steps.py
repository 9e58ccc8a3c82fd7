"""A DH table as a walk: one elementary motion after another carries a frame from the base to the tool.

A place on the walk is a number `at`: the number of completed motions, four per row, with the completed share of
the present motion as its fraction. At 4, 8, … a frame is complete: that is ``T_0i``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from app.exercises.rows import Factor, turns
from app.viewer.scene.chain import rotation, translation
from kin import Robot, link_frames
from kin.axes import joint_axes, pairs
from kin.robot import Convention, exact_cos_sin
from kin.transforms import Array
from kin.units import Units

ORDERS: dict[Convention, tuple[Factor, ...]] = {
    "standard": ("theta", "d", "a", "alpha"),
    "modified": ("alpha", "a", "theta", "d"),
}
OTHER: dict[Convention, Convention] = {"standard": "modified", "modified": "standard"}
LETTERS: dict[Factor, str] = {"theta": "θ", "d": "d", "a": "a", "alpha": "α"}
MOVED: dict[str, Factor] = {"revolute": "theta", "prismatic": "d"}
MOTIONS = 4
_LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True, eq=False)
class WalkState:
    """A place on the walk.

    Attributes:
        row: index of the row in progress, or just completed.
        motion: index in that row of the motion in progress, or just completed; −1 at the very start.
        share: completed share of that motion, 0 to 1.
        factor, value: the parameter it applies, and its whole value (rad or m).
        T_0_before: the frame before that motion ``(4, 4)``, in the base frame.
        T_0_now: the moving frame ``(4, 4)``, in the base frame.
        A: the row's product so far ``(4, 4)``.
        values: all four parameters of the row, in the order of the motions (rad or m).
    """

    row: int
    motion: int
    share: float
    factor: Factor
    value: float
    T_0_before: Array
    T_0_now: Array
    A: Array
    values: tuple[float, ...]

    @property
    def placed(self) -> int:
        """The number of completed frames, without the base's."""
        return self.row + int(self.motion == MOTIONS - 1 and self.share == 1.0)


@lru_cache(maxsize=64)
def reread(robot: Robot) -> Robot:
    """The arm that the same table describes in the other convention."""
    return replace(robot, id=f"{robot.id}-reread", convention=OTHER[robot.convention])


def length(robot: Robot) -> int:
    """Number of motions of the whole walk."""
    return MOTIONS * len(robot.rows)


def axis(factor: Factor) -> int:
    """The axis of the moving frame that a motion is about or along: 0 for x, 2 for z."""
    return 2 if factor in ("theta", "d") else 0


def elementary(factor: Factor, value: float) -> Array:
    """One motion ``(4, 4)``: Rz(θ), Tz(d), Tx(a) or Rx(α)."""
    return rotation(axis(factor), value) if turns(factor) else translation(axis(factor), value)


def value(robot: Robot, row: int, factor: Factor, q: Array) -> float:
    """θ, d, a or α of a row at a configuration ``(n,)``, with the joint's value if it is the variable."""
    joint = robot.rows[row]
    constant = float(getattr(joint, factor))
    if MOVED.get(joint.kind) != factor:
        return constant
    return constant + float(q[robot.joint_rows.index(row)])


def place(robot: Robot, q: Array, at: float, frames: Array | None = None) -> WalkState:
    """The place after `at` motions, for a configuration ``(n,)``.

    `frames` is ``link_frames(robot, q)``, if computed already.
    """
    at = min(max(at, 0.0), float(length(robot)))
    # At a whole number a motion is complete; the next one has not begun.
    number = math.ceil(at) - 1
    row, motion = divmod(number, MOTIONS) if number >= 0 else (0, -1)
    share = at - number if number >= 0 else 0.0
    frames = link_frames(robot, q) if frames is None else frames
    start = robot.T_world_base if row == 0 else frames[row - 1]
    order = ORDERS[robot.convention]
    A = np.eye(4)
    values = tuple(value(robot, row, factor, q) for factor in order)
    for factor, amount_ in zip(order[: max(motion, 0)], values, strict=False):
        A = A @ elementary(factor, amount_)
    factor, whole = order[max(motion, 0)], values[max(motion, 0)]
    before = start @ A
    if share > 0.0:
        A = A @ elementary(factor, whole * share)
    return WalkState(row, motion, share, factor, whole, before, start @ A, A, values)


@dataclass(frozen=True, eq=False)
class Symbolic:
    """A matrix as a linear combination of functions of the joint variable: one ``(4, 4)`` coefficient per name.

    The variable is the joint's value; the constant of its row is in the coefficients. `names` are "1", and "cos"
    and "sin" of the variable, or "q", the variable itself.
    """

    names: tuple[str, ...]
    constants: Array


def symbolic(robot: Robot, row: int, motions: int = MOTIONS) -> Symbolic:
    """The product of the first `motions` factors of a row, as a function of its joint variable."""
    joint = robot.rows[row]
    open_ = MOVED.get(joint.kind)
    names: tuple[str, ...] = ("1",)
    parts = np.eye(4)[None]
    for factor in ORDERS[robot.convention][:motions]:
        if factor == open_:
            names, free = _open(factor, float(getattr(joint, factor)))
            parts = parts @ free
        else:
            parts = parts @ elementary(factor, float(getattr(joint, factor)))
    return Symbolic(names, parts)


def _open(factor: Factor, offset: float) -> tuple[tuple[str, ...], Array]:
    """Rz or Tz of a variable plus a constant: the names and their coefficients ``(names, 4, 4)``."""
    rest = np.eye(4)
    if factor == "theta":
        cosine, sine = np.zeros((4, 4)), np.zeros((4, 4))
        cosine[0, 0] = cosine[1, 1] = 1.0
        sine[0, 1], sine[1, 0] = -1.0, 1.0
        c, s = exact_cos_sin(offset)
        # cos(θ + offset) and sin(θ + offset), expanded.
        return ("1", "cos", "sin"), np.array([rest - cosine, c * cosine + s * sine, c * sine - s * cosine])
    slide = np.zeros((4, 4))
    slide[2, 3] = 1.0
    return ("1", "q"), np.array([rest + offset * slide, slide])


def low(number: int) -> str:
    """A number as a subscript: ₁₂."""
    return str(number).translate(_LOWERED)


def index(robot: Robot, row: int, factor: Factor) -> int:
    """The index of a row's parameter: Craig's a and α have the index of the previous link, one less."""
    return row if robot.convention == "modified" and factor in ("a", "alpha") else row + 1


def symbol(robot: Robot, row: int, factor: Factor) -> str:
    """θ₂, or α₁ in row 2 of a table in Craig's convention."""
    return LETTERS[factor] + low(index(robot, row, factor))


def expression(robot: Robot, row: int, factor: Factor, units: Units, sense: float = 1.0) -> str:
    """The symbol of a parameter; where a joint changes it, with its offset: θ₃ − 90°. θ₃ is the joint's value.

    `sense`: −1 if the joint counts backwards, as in 90° − θ₃.
    """
    name, joint = symbol(robot, row, factor), robot.rows[row]
    offset = float(getattr(joint, factor))
    if MOVED.get(joint.kind) != factor:
        return name
    unit = units.of(turns(factor))
    if not round(offset * unit.scale, 6):
        return name if sense > 0.0 else f"−{name}"
    if sense < 0.0:
        return f"{unit.brief(offset)} − {name}"
    return f"{name} {'−' if offset < 0.0 else '+'} {unit.brief(abs(offset))}"


def axis_name(robot: Robot, row: int, factor: Factor) -> str:
    """The name of a motion's axis in the textbooks: z₁ is the joint axis, x₂ the common normal after it."""
    number = row + (1 if (axis(factor) == 2) == (robot.convention == "modified") else 0)
    return "xyz"[axis(factor)] + low(number)


def amount(factor: Factor, shown: float, units: Units) -> str:
    """A value with its unit, as the panel shows it."""
    return units.of(turns(factor)).text(shown)


def caption(robot: Robot, at: WalkState, units: Units, asked: bool = False) -> str:
    """The present motion in words; `asked`: without what a joint makes of its row."""
    if at.motion < 0:
        return "Frame 0 is at the base. Each row of the table carries a copy of it to the next frame."
    joint = robot.rows[at.row]
    name = expression(robot, at.row, at.factor, units)
    line = axis_name(robot, at.row, at.factor)
    opening = f"Row {at.row + 1} of {len(robot.rows)}: "
    mover = ""
    if MOVED.get(joint.kind) == at.factor:
        mover = f", joint {robot.joint_rows.index(at.row) + 1}"
        offset = float(getattr(joint, at.factor))
        if offset:
            mover += f" at {amount(at.factor, at.value - offset, units)}"
    if at.value == 0.0 and not mover:
        none = "no rotation about" if turns(at.factor) else "no translation along"
        words = f"{name} = 0, {none} {line}"
    else:
        verb = "turn {} about {}" if turns(at.factor) else "slide {} along {}"
        far = "?" if asked and mover else amount(at.factor, at.value, units)
        words = verb.format(far, line) + f" ({name}{mover})"
    end = f". {frames_name([at.row + 1], len(robot.rows)).capitalize()} is placed." if at.placed > at.row else "."
    return opening + words + end


def frames_name(numbers: Sequence[int], rows: int) -> str:
    """The name of the frames with these numbers, in a table of so many rows: the last one is the tool's."""
    names = [f"{number} (tool)" if number == rows else str(number) for number in numbers]
    return f"frame{'s' * (len(names) > 1)} {', '.join(names)}"


def coinciding(robot: Robot) -> list[list[int]]:
    """The numbers of all frames, grouped: frames of one group always have one origin."""
    groups = [[0]]
    for row, joint in enumerate(robot.rows):
        fixed = joint.kind != "prismatic" and joint.a == 0.0 and joint.d == 0.0
        groups[-1:] = [[*groups[-1], row + 1]] if fixed else [groups[-1], [row + 1]]
    return groups


def coaxial_joints(robot: Robot) -> list[int]:
    """Indices of joints that turn about the same axis as the next one."""
    return [pair.joint for pair in pairs(robot) if pair.one_line]


def degrees_of_freedom(robot: Robot) -> int:
    """The number of joints that do not share the axis of the previous joint."""
    return robot.n - len(coaxial_joints(robot))


@lru_cache(maxsize=64)
def verdict(robot: Robot, units: Units) -> tuple[str, ...]:
    """In words: the arm that each convention makes of the table, and the numbers that decide which is meant."""
    readings = sorted((robot, reread(robot)), key=lambda r: r.convention, reverse=True)
    if any(coaxial_joints(reading) for reading in readings):
        return tuple(_lines(reading, units) for reading in readings)
    return (
        "In neither convention do two neighbouring joints share an axis. The arms differ nevertheless: "
        "a row’s a and α follow its joint in the standard convention, and precede it in Craig’s.",
    )


def _lines(robot: Robot, units: Units) -> str:
    """Which neighbouring joints share an axis in this convention, and why."""
    opening = "Standard convention: " if robot.convention == "standard" else "Craig’s convention: "
    shared = coaxial_joints(robot)
    if not shared:
        first = coaxial_joints(reread(robot))[0]
        link = _link(robot, first, units)
        return f"{opening}{link} {_leads(robot, first, units)}, so no two neighbouring axes coincide."
    reasons = "; ".join(
        f"{_link(robot, k, units)} makes {_axes(robot, k)} coincide, so joints {k + 1} and {k + 2} turn "
        f"about the same axis and only {_sum(robot, k)} matters"
        for k in shared
    )
    return f"{opening}{reasons}: {robot.n} joints, {degrees_of_freedom(robot)} degrees of freedom."


def _leads(robot: Robot, k: int, units: Units) -> str:
    """The axes between which the parameters of joints k and k + 1 lead, and the effect of one row of them."""
    before, after = robot.joint_rows[k], robot.joint_rows[k + 1]
    leads = f"leads from axis {k + 1} to axis {k + 2}"
    if after - before > 1:
        return leads
    row = robot.rows[before if robot.convention == "standard" else after]
    if row.alpha:
        return f"{leads} and tilts it by {units.angles.text(row.alpha)}"
    return f"{leads} and shifts it by {units.distance(abs(row.a))}" if row.a else leads


def _link(robot: Robot, k: int, units: Units) -> str:
    """The parameters between joints k and k + 1."""
    before, after = robot.joint_rows[k], robot.joint_rows[k + 1]
    if after - before > 1:
        return f"the product of rows {before + 1} to {after + 1}"
    row = before if robot.convention == "standard" else after
    factors: tuple[Factor, ...] = ("a", "alpha")
    numbers = (
        f"{symbol(robot, row, factor)} = {amount(factor, number, units) if number else '0'}"
        for factor in factors
        for number in [getattr(robot.rows[row], factor)]
    )
    return f"row {row + 1} ({', '.join(numbers)})"


def _axes(robot: Robot, k: int) -> str:
    """Names of the axes of joints k and k + 1."""
    return " and ".join(axis_name(robot, robot.joint_rows[j], "theta") for j in (k, k + 1))


def _sum(robot: Robot, k: int) -> str:
    """The combination of two joints with the same axis that moves the tool."""
    first, second = joint_axes(robot)[k : k + 2]
    sign = "+" if first.direction @ second.direction > 0.0 else "−"
    return f"θ{low(robot.joint_rows[k] + 1)} {sign} θ{low(robot.joint_rows[k + 1] + 1)}"
