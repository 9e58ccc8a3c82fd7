"""Reach a pose or a point, with what else the posture has to meet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import DEGREE, MILLIMETRE, Declared
from app.exercises.contract import Kind, listed, numbers
from app.exercises.expressions import Expression
from app.exercises.fields import Fields
from app.exercises.questions import Asked, Verdict
from app.exercises.variant import Variant
from kin import IKOptions, JointConstraints, Robot
from kin.ik import Task
from kin.ik.options import TASKS
from kin.motion import Lin, PoseTarget, Program
from kin.transforms import Array, rotation_angle, vector_angle
from kin.units import Units, general

FAR = 3.0  # position tolerances that a negated joint must have moved the tool by
PLACES = 40  # of a line, at which its postures are computed
LOCKED = (math.radians(0.5), 5e-4)  # rad, m: a locked joint may be off by this


@dataclass(frozen=True)
class Lock(Declared):
    """A joint, counted from 1, that must be at a value."""

    joint: int = cell.whole("Joint", "Its number.", 1, 32)
    value: Expression = cell.expression("Value")


@dataclass(frozen=True)
class ReachKind(Kind):
    """See the module. The answer is a configuration: in the page, that of the arm."""

    name: ClassVar[str] = "reach"
    about: ClassVar[str] = "The arm is moved to a target, in a posture that meets further conditions."

    task: Task = cell.choice("What must match", "", TASKS, "position")
    branch: str = cell.line("Posture", "Such as: elbow up.", "")
    locked: tuple[Lock, ...] = cell.rows(
        Lock, "Locked joints", "Joints that must be at a value.", "joint", {"joint": 1, "value": "0"}
    )
    margin: float = cell.number("Margin to the limits, %", "Of the range of each joint.", 0.0, above=-math.inf)
    manipulability: Expression = cell.expression("Least manipulability", "", "0")
    position_tolerance: float = cell.number("Accepted distance, mm", "", 3.0, MILLIMETRE)
    rotation_tolerance: float = cell.number("Accepted rotation, degrees", "", 3.0, DEGREE)
    line: tuple[Expression, ...] = cell.expressions(
        "Line to", "x, y and z of the end of a line that the tool drives from there."
    )

    def check(self, table: Fields) -> None:
        if self.line and len(self.line) != 3:
            raise table.refuse("line", len(self.line), "three values x, y, z")

    def asked(self, variant: Variant, units: Units) -> Asked:
        robot = variant.robot
        conditions = [f"the tool within {units.lengths.brief(self.position_tolerance)}"]
        if self.task != "position":
            what = "orientation" if self.task == "pose" else "approach direction"
            conditions.append(f"its {what} within {units.angles.brief(self.rotation_tolerance)}")
        if branch := variant.text(self.branch, units):
            conditions.append(f"posture: {branch}")
        for lock in self.locked:
            joint, value = lock.joint - 1, lock.value
            unit = units.of(bool(robot.revolute[joint]))
            conditions.append(f"joint {joint + 1} at {unit.brief(variant.number(value))}")
        if self.margin:
            conditions.append(f"every joint {self.margin:g} % of its range away from its limits")
        if (least := variant.number(self.manipulability)) > 0.0:
            conditions.append(f"manipulability at least {general(least, 3)}")
        if self.line:
            conditions.append("from there the whole line can be driven")
        return Asked("posture", note=f"Required: {listed(conditions)}.", goal=variant.pose)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        robot = variant.robot
        q = numbers(given, robot.n, "one configuration in radians and metres")
        parts = [at_target(variant, q, units, self.task, self.position_tolerance, self.rotation_tolerance)]
        if outside := outside_limits(robot, q):
            parts.append((False, outside))
        if branch := variant.text(self.branch, units):
            name = kin.branch_of(robot, q)
            fits = has_parts(name, branch)
            parts.append((fits, f"The posture is “{name}”{'' if fits else f', asked is “{branch}”'}."))
        for lock in self.locked:
            joint, value = lock.joint - 1, lock.value
            unit, wanted = units.of(bool(robot.revolute[joint])), variant.number(value)
            fits = abs(q[joint] - wanted) <= LOCKED[0 if robot.revolute[joint] else 1]
            there = unit.text(float(q[joint]), 1)
            parts.append(
                (fits, f"Joint {joint + 1} is at {there}{'' if fits else f', not at {unit.brief(wanted)}'}.")
            )
        if self.margin:
            parts.append(self._in_margin(robot, q, units))
        if (least := variant.number(self.manipulability)) > 0.0:
            w = float(kin.manipulability(robot, q))
            below = "" if w >= least else f", below {general(least, 3)}"
            parts.append((w >= least, f"The manipulability is {general(w, 3)}{below}."))
        if self.line:
            parts.append(self._along_line(variant, q, units) if parts[0][0] else (False, "The line begins there."))
        return Verdict.of(parts, " ".join(reason for _, reason in parts))

    def _along_line(self, variant: Variant, q: Array, units: Units) -> tuple[bool, str]:
        """Whether the tool can drive the line from a configuration without a change of posture."""
        x, y, z = (variant.number(value) for value in self.line)
        program = Program((Lin(PoseTarget((x, y, z))),), jerk_limited=False)
        motion = kin.plan_motion(variant.robot, program, variant.robot.clip(q))
        if motion.planned:
            return True, "From this posture the whole line can be driven."
        return False, f"From this posture the line does not go through. {motion.explain(units)}"

    def _in_margin(self, robot: Robot, q: Array, units: Units) -> tuple[bool, str]:
        span = robot.upper - robot.lower
        share = 100.0 * np.minimum(q - robot.lower, robot.upper - q) / span
        worst = int(np.nanargmin(share))
        fits = bool(share[worst] >= self.margin)
        left = units.of(bool(robot.revolute[worst])).text(
            float(min(q[worst] - robot.lower[worst], robot.upper[worst] - q[worst])), 1
        )
        return fits, f"Joint {worst + 1} is nearest to a limit, {left} away, {share[worst]:.0f} % of its range."

    def answer(self, variant: Variant) -> object:
        robot = variant.robot
        locks = {lock.joint - 1: lock.value for lock in self.locked}
        limits, locked = None, None
        if locks:
            locked = tuple(variant.number(locks[i]) if i in locks else None for i in range(robot.n))
        if self.margin:
            inset = (self.margin + 1e-6) / 100.0 * (robot.upper - robot.lower)
            limits = [
                (float(low + by), float(high - by)) if np.isfinite(by) else None
                for low, high, by in zip(robot.lower, robot.upper, inset, strict=True)
            ]
        options = IKOptions(
            task=self.task,
            branch=variant.text(self.branch, Units()) or None,
            constraints=JointConstraints(limits=limits, locked=locked),
            prefer="manipulability" if variant.number(self.manipulability) > 0.0 else "nearest",
        )
        if self.line:
            return self._first_through(variant, options)
        found = kin.ik.solve(robot, variant.pose, options, robot.q_home)
        if not found.solutions:
            raise ValueError(f"no posture meets the conditions: {found.reason}")
        return found.solutions[0].q.tolist()

    def _first_through(self, variant: Variant, options: IKOptions) -> object:
        """Of the postures at the start of the line, the first one that leads to its end."""
        T = np.repeat(variant.pose[None], PLACES, axis=0)
        way = np.array([variant.number(value) for value in self.line]) - variant.pose[:3, 3]
        T[:, :3, 3] += np.linspace(0.0, 1.0, PLACES)[:, None] * way
        found = kin.path.path_postures(variant.robot, T, options=options)
        if not found.through:
            raise ValueError(f"no posture leads along the line: {found.reason}")
        return found.q[0, found.through[0]].tolist()

    def solution(self, variant: Variant, units: Units) -> str:
        robot = variant.robot
        values = ", ".join(
            f"joint {i + 1} at {units.of(bool(turns)).text(value, 1)}"
            for i, (value, turns) in enumerate(zip(self.answer(variant), robot.revolute, strict=True))  # type: ignore[call-overload]
        )
        return f"For instance {values}."


def has_parts(name: str, wanted: str) -> bool:
    """Whether the name of a branch, such as ``"shoulder left · elbow up"``, has the parts asked for."""
    return all(part.strip() in name for part in wanted.split(","))


def at_target(
    variant: Variant, q: Array, units: Units, task: str, position_tolerance: float, rotation_tolerance: float
) -> tuple[bool, str]:
    """Whether the tool is at the pose of a variant as far as the task asks, and what is said; m and rad."""
    T, goal = kin.fk(variant.robot, q), variant.pose
    off = float(np.linalg.norm(T[:3, 3] - goal[:3, 3]))
    if off > position_tolerance:
        negated = _negated(variant, q, position_tolerance)
        return False, f"The tool is {units.lengths.text(off, 1)} from the target.{negated}"
    turned = (
        float(rotation_angle(T[:3, :3], goal[:3, :3]))
        if task == "pose"
        else float(vector_angle(T[:3, 2], goal[:3, 2]))
    )
    if task != "position" and turned > rotation_tolerance:
        what = "orientation" if task == "pose" else "approach direction"
        return False, f"The point is reached; the {what} is off by {units.angles.text(turned, 1)}."
    return True, "The target is reached."


def _negated(variant: Variant, q: Array, near: float) -> str:
    """Whether one joint with the other sign would reach the target."""
    for i in range(variant.robot.n):
        flipped = q.copy()
        flipped[i] = -flipped[i]
        point, now = kin.fk(variant.robot, flipped)[:3, 3], kin.fk(variant.robot, q)[:3, 3]
        there = np.linalg.norm(point - variant.pose[:3, 3]) <= near
        # A small joint value brings the tool there by chance, when another joint is a little wrong.
        if there and np.linalg.norm(point - now) > FAR * near:
            return f" With the other sign of joint {i + 1} it would be there."
    return ""


def outside_limits(robot: Robot, q: Array) -> str:
    """Which joints are outside their limits, in words; "" if none is."""
    if robot.in_limits(q, 1e-6):
        return ""
    outside = [f"joint {i + 1}" for i in range(robot.n) if not robot.lower[i] <= q[i] <= robot.upper[i]]
    return f"Outside its limits: {listed(outside)}."
