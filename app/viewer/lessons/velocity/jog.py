"""Jogging: the tool moves by one step along or about an axis, and the joints follow on their branch.

A step is made exactly or not at all. It is not made either if a joint would have to jump, as it does for a short
step near a singularity: the motion between the two configurations would swing the tool away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

import kin
from app.viewer.panel.joints import label
from app.viewer.panel.posture import short
from app.viewer.panel.status import Notice, notice
from kin import IKOptions, IKResult, IKSolution, Robot, Task
from kin.ik import solve
from kin.transforms import Array, rotation_from_wxyz, vector_angle
from kin.units import DEFAULT_UNITS, Units

Frame = Literal["base", "tool"]
NAMES = ("x", "y", "z", "rx", "ry", "rz")
BUTTONS = tuple((axis, sign) for axis in range(6) for sign in (-1, 1))

# The largest motion of a joint (rad or m) in one step.
SMOOTH = 0.6
_TURNED = 1e-6  # rad


@dataclass(frozen=True, eq=False)
class Step:
    """The configuration ``(n,)`` after a step, or None if the step is not made; and a message."""

    q: Array | None
    notice: Notice


def button(axis: int, sign: int) -> str:
    """A button's label: ``"+rx"``."""
    return ("+" if sign > 0 else "−") + NAMES[axis]


def moved(T_base_tool: Array, axis: int, amount: float, frame: Frame) -> Array:
    """The pose ``(4, 4)`` after a step: axis 0–2 along x, y, z by metres, 3–5 about them at the tool point."""
    T = T_base_tool.copy()
    e = np.zeros(3)
    e[axis % 3] = 1.0
    if axis < 3:
        T[:3, 3] += amount * (T[:3, :3] @ e if frame == "tool" else e)
        return T
    turn = rotation_from_wxyz(np.array([math.cos(0.5 * amount), *(math.sin(0.5 * amount) * e)]))
    T[:3, :3] = T[:3, :3] @ turn if frame == "tool" else turn @ T[:3, :3]
    return T


def step(
    robot: Robot,
    q: Array,
    options: IKOptions,
    axis: int,
    amount: float,
    frame: Frame,
    units: Units = DEFAULT_UNITS,
) -> Step:
    """One step of `amount` (m or rad) from q ``(n,)``; of the options, task and constraints hold, not the branch.

    An arm with fewer than six joints cannot keep the roll, one with fewer than five the orientation; the step is
    then made nevertheless, and the message reports the error.
    """
    T = kin.fk(robot, q)
    goal = moved(T, axis, amount, frame)
    if axis > 2 and (why := _not_in_task(options.task, T, goal)):
        return Step(None, Notice("hand", "Not moved", why))
    target = goal[:3, 3] if options.task == "position" else goal
    # The arm may pass through a singularity to another branch, as long as the joints move smoothly.
    refused: list[Step] = []
    for branch in ("seed", None) if kin.branch_names(robot) else (None,):
        result = solve(robot, target, replace(options, branch=branch, max_solutions=1), q)
        found = _to_step(robot, q, T, axis, amount, frame, result, units)
        if found.q is not None:
            return found
        if result.cause != "branch":
            refused.append(found)
    return refused[0]


def _not_in_task(task: Task, T: Array, goal: Array) -> str:
    """Why a rotation is not made: the task leaves it open."""
    if task == "position":
        return "The task “Point only” leaves the orientation open. Choose the full pose to rotate the tool."
    if task == "approach" and vector_angle(T[:3, 2], goal[:3, 2]) < _TURNED:
        return "The task “Point + approach” leaves the roll open. Choose the full pose to change it."
    return ""


def _to_step(
    robot: Robot, q: Array, T: Array, axis: int, amount: float, frame: Frame, result: IKResult, units: Units
) -> Step:
    """A result as a step: made if it is as exact as this arm allows, and near."""
    best = result.solutions[0] if result.solutions else None
    error = _error_message(robot, T, axis, result, units)
    if best is None or error is None:
        if best is not None:
            return Step(None, Notice("orientation", "Not moved", _too_few(robot, axis, best, units)))
        reason = notice(result, units)
        title = f"Not moved: {reason.title[:1].lower()}{reason.title[1:]}"
        return Step(None, Notice(reason.kind, title, reason.detail))
    off = np.abs(best.q - q)
    worst = int(off.argmax())
    if off[worst] > SMOOTH:
        turn = units.motion(robot.revolute[worst], off[worst])
        return Step(
            None,
            Notice(
                "limits",
                "Not moved: a joint would have to jump",
                f"{label(robot, worst)} by {turn}: a singularity is near, or the step is too long.",
            ),
        )
    size = units.of(axis > 2).brief(abs(amount))
    verb = "along" if axis < 3 else "about"
    title = f"Jogged {size} {verb} {'+' if amount > 0 else '−'}{NAMES[axis][-1]} of the {frame}"
    if error:
        return Step(best.q, Notice("compromise", title, error))
    return Step(best.q, Notice("reached", title, "Exactly, " + _how(robot, q, best.q)))


def _error_message(robot: Robot, T: Array, axis: int, result: IKResult, units: Units) -> str | None:
    """The error of the best solution in words; None if it is larger than necessary for this arm."""
    if result.status == "solved":
        return ""
    best = result.solutions[0] if result.solutions else None
    if best is None or result.status != "approximate" or robot.n > 5:
        return None
    reached = kin.fk(robot, best.q)
    kept = best.compromise == "roll" and (axis < 3 or vector_angle(T[:3, 2], reached[:3, 2]) > _TURNED)
    if kept:
        off = units.angle(best.rotation_error)
        return f"{robot.n} joints keep the point and the approach direction; the roll is off by {off}."
    if best.compromise == "rotation" and robot.n < 5 and axis < 3:
        off = units.angle(best.rotation_error)
        return f"{robot.n} joints keep the point; the orientation is off by {off}."
    return None


def _too_few(robot: Robot, axis: int, best: IKSolution, units: Units) -> str:
    count = "1 joint" if robot.n == 1 else f"{robot.n} joints"
    if axis > 2:
        return f"{count} cannot turn the tool this way and keep its point."
    off = units.angle(best.rotation_error)
    return f"Here {count} can keep the point alone: the orientation would be off by {off}."


def _how(robot: Robot, before: Array, after: Array) -> str:
    """How the posture changed."""
    if not kin.branch_names(robot):
        return "with the joints moving smoothly."
    now = kin.branch_of(robot, after)
    if kin.branch_of(robot, before) != now:
        return f"through a singularity, to the posture {short(now)}."
    return "in the same posture."


class Press:
    """Derives the steps of one button from the events that the browser sends.

    A button held by mouse or finger sends repeated reports and, on release, a click; with the keyboard only the
    click comes. A tap is one step, because repeats count only after `DELAY`.
    """

    DELAY = 0.5  # s
    GAP = 2.0  # s without a report, after which the click that ended the press is considered lost

    def __init__(self) -> None:
        self._since: float | None = None
        self._last = -math.inf
        self.number = 0

    def held(self, now: float) -> bool:
        """Process a report that the button is down; returns whether it is a step."""
        if self._since is None or now - self._last > self.GAP:
            self._since = now
            self.number += 1
        self._last = now
        return now == self._since or now - self._since >= self.DELAY

    def clicked(self, now: float) -> bool:
        """Process a click; returns whether it is a step."""
        alone = self._since is None or now - self._last > self.GAP
        self._since = None
        self.number += alone
        return alone
