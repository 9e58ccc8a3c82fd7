"""A DH table that a student makes: frames chosen one after another, and a row of numbers from each to the next.

All of it is for the arm with every joint at 0, so that a row has its constants only; `frames_at` moves it. A table
is right if it moves the tool as the arm does, whatever its numbers are: `family` has all rows that lead from a
frame to the next axis, and `judge` compares what was typed with them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from app.exercises.rows import Accepted, Factor, Line, Row
from app.viewer.lessons.dh.normals import angle_about, axis_lines, common_normal
from app.viewer.lessons.dh.steps import MOVED
from kin import Robot, fk, link_frames
from kin.axes import NEARLY, frame_of, inverse, size
from kin.robot import Convention
from kin.transforms import Array

ACCEPTED = Accepted(math.radians(0.3), 5e-4)  # of typed values


@dataclass(frozen=True, eq=False)
class Assignment:
    """The frames and rows assigned so far.

    Attributes:
        frames: poses ``(4, 4)`` of frame 0, 1, … in the world, with every joint at 0.
        rows: a row for each frame after the first.
    """

    robot: Robot
    frames: tuple[Array, ...] = ()
    rows: tuple[Row, ...] = ()

    @property
    def convention(self) -> Convention:
        """The convention of the arm's own table."""
        return self.robot.convention

    @cached_property
    def axes(self) -> tuple[Line, ...]:
        """The axes of the joints."""
        return axis_lines(self.robot, np.zeros(self.robot.n))

    @cached_property
    def near(self) -> float:
        """Distance (m) below which axes meet."""
        return NEARLY * size(self.robot) * 0.1

    @property
    def complete(self) -> bool:
        """Whether every joint has its row."""
        return len(self.rows) == self.robot.n

    def carrier(self, frame: int) -> int | None:
        """Index of the joint on whose axis z of this frame lies; None: it is free."""
        joint = frame if self.convention == "standard" else frame - 1
        return joint if 0 <= joint < self.robot.n else None

    def partner(self, frame: int) -> int | None:
        """Index of the other joint of the common normal on which x of this frame lies; None: it is free."""
        joint = frame - 1 if self.convention == "standard" else frame
        return joint if 0 <= joint < self.robot.n and self.carrier(frame) is not None else None

    def slides(self, joint: int) -> bool:
        """Whether the joint is prismatic: its axis has a direction only."""
        return not bool(self.robot.revolute[joint])

    def sense(self, joint: int, frames: Sequence[Array] | None = None) -> float:
        """−1 if z of the joint's frame is against the joint's positive direction, which reverses its value."""
        frames = self.frames if frames is None else frames
        number = joint if self.convention == "standard" else joint + 1
        return 1.0 if frames[number][:3, 2] @ self.axes[joint].z > 0.0 else -1.0

    def with_base(self, frame: Array) -> Assignment:
        """Begin with this frame 0."""
        return replace(self, frames=(frame,), rows=())

    def with_row(self, row: Row) -> Assignment:
        """One more row, and the frame to which it leads."""
        frame = self.frames[-1] @ row.matrix(self.convention)
        return replace(self, frames=(*self.frames, frame), rows=(*self.rows, row))

    def without_last(self) -> Assignment:
        """The last frame taken away."""
        return replace(self, frames=self.frames[:-1], rows=self.rows[:-1])

    def frames_at(self, q: Array, more: Row | None = None, then: Array | None = None) -> list[Array]:
        """The frames at a configuration ``(n,)``; `more`: one more row.

        `then`: the frame to which that row should lead; by default the one to which it does. Its z axis says in
        which direction the joint counts.
        """
        if not self.frames:
            return []
        rows = self.rows if more is None else (*self.rows, more)
        ends = list(self.frames)
        if more is not None:
            ends.append(self.frames[-1] @ more.matrix(self.convention) if then is None else then)
        found = [self.frames[0]]
        for joint, row in enumerate(rows):
            factor = MOVED[self.robot.joints[joint].kind]
            moved = getattr(row, factor) + self.sense(joint, ends) * float(q[joint])
            found.append(found[-1] @ replace(row, **{factor: moved}).matrix(self.convention))
        return found

    def carried(self, T: Array, q: Array) -> Array:
        """The next frame, given ``(4, 4)`` with all joints at 0, where its link carries it at ``(n,)``."""
        joints = len(self.frames)
        if joints == 0:
            return T
        row = self.robot.joint_rows[joints - 1]
        at_zero, now = (link_frames(self.robot, each)[row] for each in (np.zeros(self.robot.n), q))
        return np.asarray(now @ inverse(at_zero) @ T)

    def tool(self) -> Array:
        """The constant transform from the last frame to the tool ``(4, 4)``."""
        return np.asarray(inverse(self.frames[-1]) @ fk(self.robot, np.zeros(self.robot.n)))

    def error(self, q: Array) -> float:
        """The largest entry by which the tool's pose differs from the arm's at configurations ``(k, n)``."""
        tool = self.tool()
        return max(float(np.abs(self.frames_at(each)[-1] @ tool - fk(self.robot, each)).max()) for each in q)


def read_row(convention: Convention, old: Array, new: Array) -> Row:
    """The row from a frame to the next one, which was chosen by the rules."""
    z, x = (old[:3, 2], new[:3, 0]) if convention == "standard" else (new[:3, 2], old[:3, 0])
    between = new[:3, 3] - old[:3, 3]
    return Row(
        angle_about(z, old[:3, 0], new[:3, 0]),
        float(between @ z),
        float(between @ x),
        angle_about(x, old[:3, 2], new[:3, 2]),
    )


def opposite_x(row: Row, convention: Convention) -> Row:
    """The row to the same frame with x reversed."""
    if convention == "standard":
        return Row(row.theta + math.pi, row.d, -row.a, -row.alpha)
    return replace(row, theta=row.theta + math.pi)


def free_factors(work: Assignment, chosen: Array) -> frozenset[Factor]:
    """The parameters of the next row that the arm does not determine: every value of them leads to a right table.

    `chosen`: the frame ``(4, 4)`` to which the row leads. The last frame is the one that was chosen.
    """
    number = len(work.frames)
    standard = work.convention == "standard"
    carrier, partner = work.carrier(number), work.partner(number)
    free: set[Factor] = set()
    if carrier is None or partner is None:
        return frozenset()
    other = work.frames[-1][:3, 2] if standard else work.axes[partner].z
    parallel = float(np.linalg.norm(np.cross(chosen[:3, 2], other))) < NEARLY
    sliding = work.slides(carrier if standard else partner)  # the axis to which the row, or the next one, leads
    if standard and sliding:
        free |= {"d", "a"}
    if not standard and work.slides(carrier):
        free.add("a")
    if not standard and sliding:
        free.add("d")
    if parallel:
        free.add("d")
        if sliding or _is_one(work, chosen, partner):
            free.add("theta")
    return frozenset(free)


def _is_one(work: Assignment, chosen: Array, partner: int) -> bool:
    """Whether the chosen frame's z, parallel to the other axis, is the same line."""
    if work.convention == "standard":
        other = Line(work.frames[-1][:3, 3], work.frames[-1][:3, 2])
    else:
        other = work.axes[partner]
    return float(np.linalg.norm(other.nearest(chosen[:3, 3]) - chosen[:3, 3])) < work.near


def family(work: Assignment, chosen: Array, typed: Row) -> tuple[Row, Row]:
    """The right row for the chosen frame, and the one for x reversed; free parameters are as they were typed."""
    names = free_factors(work, chosen)
    if "a" in names and work.convention == "modified":
        chosen = _beside(work, chosen, typed.a)
        names = free_factors(work, chosen)  # beside it, parallel axes are no longer one line
    free = {factor: getattr(typed, factor) for factor in names}
    row = read_row(work.convention, work.frames[-1], chosen)
    if "theta" in free and work.convention == "standard":
        # Another x turns the sense of α, which is 0° or 180°, and of a, which is 0 or free: nothing to change.
        return replace(row, **free), replace(row, **free)
    return replace(row, **free), replace(opposite_x(row, work.convention), **free)


def _beside(work: Assignment, chosen: Array, a: float) -> Array:
    """The frame on the axis of a prismatic joint if that is laid at a distance `a` along x of the frame before."""
    old, partner = work.frames[-1], work.partner(len(work.frames))
    assert partner is not None
    line = Line(old[:3, 3] + a * old[:3, 0], chosen[:3, 2])
    normal = common_normal(line, work.axes[partner], work.near, through=chosen[:3, 3])
    x = normal.x if normal.x @ chosen[:3, 0] > 0.0 else -normal.x
    return frame_of(x if normal.x.any() else chosen[:3, 0], line.z, normal.start)


@dataclass(frozen=True)
class Verdict:
    """What was typed, judged.

    Attributes:
        wrong: the parameters that are wrong; none if the row is accepted.
        row: the exact row that was meant; the nearest right one if it was wrong.
        as_chosen: whether it leads to the chosen frame; otherwise to another one that is as right.
    """

    wrong: tuple[Factor, ...]
    row: Row
    as_chosen: bool


def judge(work: Assignment, chosen: Array, typed: Row, others: Sequence[Array] = ()) -> Verdict:
    """Judge a typed row: accepted if it is one of the `family`, or of that of one of the `others`.

    Args:
        chosen: the frame ``(4, 4)`` that was chosen by the rules.
        others: further frames ``(4, 4)`` that the row may lead to, such as the published last one.
    """
    rows = family(work, chosen, typed)
    # The chosen direction of x counts, unless more of what was typed is right for the other one.
    row = min(rows, key=lambda each: len(typed.differing(each, ACCEPTED)))
    if typed.differing(row, ACCEPTED):
        more = (each for other in others if is_reachable(work, other) for each in family(work, other, typed))
        row = next((each for each in more if not typed.differing(each, ACCEPTED)), row)
    exact = read_row(work.convention, work.frames[-1], chosen)
    return Verdict(typed.differing(row, ACCEPTED), row, not row.differing(exact, ACCEPTED))


def is_reachable(work: Assignment, frame: Array) -> bool:
    """Whether one row leads from the last frame to this one ``(4, 4)``."""
    row = read_row(work.convention, work.frames[-1], frame)
    return bool(np.abs(work.frames[-1] @ row.matrix(work.convention) - frame).max() < work.near)
