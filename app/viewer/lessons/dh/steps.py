"""A DH table as a walk: one elementary motion after another carries a frame from the base to the tool.

A place on the walk is a number `at`: how many of the motions are done, four to a row, with the share of the one
under way as its fraction. At 4, 8, … a frame has arrived: that is ``T_0i``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from app.viewer.scene.chain import rotation, translation
from kin import Robot, link_frames
from kin.axes import joint_axes, pairs
from kin.robot import Convention
from kin.transforms import Array
from kin.units import Units

Factor = Literal["theta", "d", "a", "alpha"]
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
class Place:
    """Where the walk is.

    Attributes:
        row: index of the row under way, or just done.
        motion: index in that row of the motion under way, or just done; −1 at the start of all.
        share: of that motion, 0 to 1.
        factor, value: what it applies, in radians or metres; the whole value, not the share.
        T_0_before: the frame before that motion ``(4, 4)``, in the base frame.
        T_0_now: the moving frame ``(4, 4)``, in the base frame.
        A: the row's product so far ``(4, 4)``.
    """

    row: int
    motion: int
    share: float
    factor: Factor
    value: float
    T_0_before: Array
    T_0_now: Array
    A: Array

    @property
    def placed(self) -> int:
        """How many frames beyond the base's stand at their places."""
        return self.row + int(self.motion == MOTIONS - 1 and self.share == 1.0)


def reread(robot: Robot) -> Robot:
    """The arm that the same table describes when its rows are read in the other convention's order."""
    return replace(robot, id=f"{robot.id}-reread", convention=OTHER[robot.convention])


def length(robot: Robot) -> int:
    """Number of motions of the whole walk."""
    return MOTIONS * len(robot.rows)


def turns(factor: Factor) -> bool:
    """Whether a motion turns; else it slides."""
    return factor in ("theta", "alpha")


def axis(factor: Factor) -> int:
    """The axis of the moving frame that a motion is about or along: 0 for x, 2 for z."""
    return 2 if factor in ("theta", "d") else 0


def elementary(factor: Factor, value: float) -> Array:
    """One motion ``(4, 4)``: Rz(θ), Tz(d), Tx(a) or Rx(α)."""
    return rotation(axis(factor), value) if turns(factor) else translation(axis(factor), value)


def value(robot: Robot, row: int, factor: Factor, q: Array) -> float:
    """θ, d, a or α of a row at a configuration ``(n,)``: the constant, and the joint's value where that acts."""
    joint = robot.rows[row]
    constant = float(getattr(joint, factor))
    if MOVED.get(joint.kind) != factor:
        return constant
    return constant + float(q[robot.joint_rows.index(row)])


def place(robot: Robot, q: Array, at: float, frames: Array | None = None) -> Place:
    """Where the walk is after `at` motions, for a configuration ``(n,)``.

    `frames` are ``link_frames(robot, q)`` if they are known already.
    """
    at = min(max(at, 0.0), float(length(robot)))
    # The motion that ends at a whole number is done there; the next one has not begun.
    number = math.ceil(at) - 1
    row, motion = divmod(number, MOTIONS) if number >= 0 else (0, -1)
    share = at - number if number >= 0 else 0.0
    frames = link_frames(robot, q) if frames is None else frames
    start = robot.T_world_base if row == 0 else frames[row - 1]
    order = ORDERS[robot.convention]
    A = np.eye(4)
    for factor in order[: max(motion, 0)]:
        A = A @ elementary(factor, value(robot, row, factor, q))
    factor = order[max(motion, 0)]
    whole = value(robot, row, factor, q)
    before = start @ A
    if share > 0.0:
        A = A @ elementary(factor, whole * share)
    return Place(row, motion, share, factor, whole, before, start @ A, A)


@dataclass(frozen=True, eq=False)
class Symbolic:
    """A matrix that is linear in what a joint moves: the sum of a constant ``(4, 4)`` for each of `names`.

    `names` are "1", and "cos" and "sin" of the joint's value, or "q", the value itself.
    """

    names: tuple[str, ...]
    constants: Array


def symbolic(robot: Robot, row: int, motions: int = MOTIONS) -> Symbolic:
    """The first `motions` factors of a row's matrix, its constants put in, what the joint moves left open."""
    joint = robot.rows[row]
    open_ = MOVED.get(joint.kind)
    names: tuple[str, ...] = ("1",)
    parts = np.eye(4)[None]
    for factor in ORDERS[robot.convention][:motions]:
        step = elementary(factor, float(getattr(joint, factor)))
        parts = parts @ step
        if factor == open_:
            names, free = _open(factor)
            # Constant and variable are about the same axis, so their order does not matter.
            parts = parts @ free
    return Symbolic(names, parts)


def _open(factor: Factor) -> tuple[tuple[str, ...], Array]:
    """Rz or Tz of an unknown: its names and their constants ``(names, 4, 4)``."""
    rest = np.eye(4)
    if factor == "theta":
        cosine, sine = np.zeros((4, 4)), np.zeros((4, 4))
        cosine[0, 0] = cosine[1, 1] = 1.0
        sine[0, 1], sine[1, 0] = -1.0, 1.0
        return ("1", "cos", "sin"), np.array([rest - cosine, cosine, sine])
    slide = np.zeros((4, 4))
    slide[2, 3] = 1.0
    return ("1", "q"), np.array([rest, slide])


def low(number: int) -> str:
    """A number as an index: ₁₂."""
    return str(number).translate(_LOWERED)


def index(robot: Robot, row: int, factor: Factor) -> int:
    """The number that a row's value carries: Craig counts a and α from the link before, so his are one less."""
    return row if robot.convention == "modified" and factor in ("a", "alpha") else row + 1


def symbol(robot: Robot, row: int, factor: Factor) -> str:
    """θ₂, or α₁ in row 2 of a table in Craig's convention."""
    return LETTERS[factor] + low(index(robot, row, factor))


def axis_name(robot: Robot, row: int, factor: Factor) -> str:
    """The axis of a motion as the textbooks call it: z₁ is the joint's line, x₂ the common normal beside it."""
    number = row + (1 if (axis(factor) == 2) == (robot.convention == "modified") else 0)
    return "xyz"[axis(factor)] + low(number)


def amount(factor: Factor, shown: float, units: Units) -> str:
    """A value with its unit, as the panel shows it."""
    return units.of(turns(factor)).text(shown)


def caption(robot: Robot, at: Place, units: Units) -> str:
    """The motion under way in words."""
    if at.motion < 0:
        return "Frame 0 stands on the base. Each row of the table now carries a copy of it to the next frame."
    joint = robot.rows[at.row]
    name = symbol(robot, at.row, at.factor)
    line = axis_name(robot, at.row, at.factor)
    opening = f"Row {at.row + 1} of {len(robot.rows)}: "
    mover = ""
    if MOVED.get(joint.kind) == at.factor:
        mover = f", joint {robot.joint_rows.index(at.row) + 1}"
    if at.value == 0.0 and not mover:
        nothing = "nothing to turn about" if turns(at.factor) else "nothing to slide along"
        words = f"{name} = 0, {nothing} {line}"
    else:
        verb = "turn {} about {}" if turns(at.factor) else "slide {} along {}"
        words = verb.format(amount(at.factor, at.value, units), line) + f" ({name}{mover})"
    end = f". Frame {at.row + 1} is placed." if at.placed > at.row else "."
    return opening + words + end


def shared_lines(robot: Robot) -> list[int]:
    """Indices of joints that turn about the same line as the next one."""
    return [pair.joint for pair in pairs(robot) if pair.one_line]


def freedoms(robot: Robot) -> int:
    """How many of the joints are not just another turn about the line of the joint before."""
    return robot.n - len(shared_lines(robot))


@lru_cache(maxsize=64)
def verdict(robot: Robot, units: Units) -> tuple[str, ...]:
    """What each reading makes of the table, and which of its numbers decides it, in words."""
    readings = sorted((robot, reread(robot)), key=lambda r: r.convention, reverse=True)
    if any(shared_lines(reading) for reading in readings):
        return tuple(_lines(reading, units) for reading in readings)
    return (
        "In neither order do two neighbouring joints share a line. The arms differ all the same: "
        "a row’s a and α come after its joint in the standard order, and before it in Craig’s.",
    )


def _lines(robot: Robot, units: Units) -> str:
    """Which neighbouring joints share a line when the table is read so, and why."""
    opening = "Standard order: " if robot.convention == "standard" else "Craig’s order: "
    shared = shared_lines(robot)
    if not shared:
        first = shared_lines(reread(robot))[0]
        link = _link(robot, first, units)
        return (
            f"{opening}{link} stands between joints {first + 1} and {first + 2}, and all {robot.n} joints count."
        )
    told = "; ".join(
        f"{_link(robot, k, units)} leaves {_axes(robot, k)} one line, so joints {k + 1} and {k + 2} turn "
        f"about it together and only {_sum(robot, k)} counts"
        for k in shared
    )
    return f"{opening}{told}: {robot.n} joints, {freedoms(robot)} freedoms."


def _link(robot: Robot, k: int, units: Units) -> str:
    """The numbers between joints k and k + 1."""
    before, after = robot.joint_rows[k], robot.joint_rows[k + 1]
    if after - before > 1:
        return f"what the rows {before + 1} to {after + 1} say"
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
    """What of two turns about one line can be told from outside."""
    first, second = joint_axes(robot)[k : k + 2]
    sign = "+" if first.direction @ second.direction > 0.0 else "−"
    return f"θ{low(robot.joint_rows[k] + 1)} {sign} θ{low(robot.joint_rows[k + 1] + 1)}"
