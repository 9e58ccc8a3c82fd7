"""Typed values, typed targets, and keys that move the target: messages of the page's own script."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

import kin
from app.viewer.panel.jog import STEPS
from app.viewer.panel.script import Reply
from app.viewer.panel.status import BY_HAND, Notice
from app.viewer.scene.gizmo import FINE_STEP, FINE_TURN, STEP, TURN
from app.viewer.session.looks import Looks
from app.viewer.session.parts import Page
from kin.axes import inverse
from kin.poses import FORMS, PoseKind, read_pose
from kin.typed import EntryError
from kin.units import NAMES

_NO_FURTHER = Notice("unreachable", "No further in this direction", "The tool does not follow the target there.")
_AT_LIMIT = Notice("limits", "The joint is at its limit", "It goes no further in this direction.")


LONGEST_LABEL = 40  # characters
_UNIT = re.compile(rf"(?<=[\d)\]] )(?:{NAMES})(?![a-z])")


def _amount(step: int, turn: bool) -> float:
    """A step of so many degrees or millimetres, in rad or m."""
    return math.radians(step) if turn else step / 1000.0


def _label(reading: str) -> str:
    """What a button says that takes a reading: a form in front of it, or the units of a long one."""
    form, units = FORMS.get(reading.split()[0]), " and ".join(dict.fromkeys(_UNIT.findall(reading)))
    if form is not None:
        return f"{form.title}, in {units}" if units and form.units is None else form.title
    return reading if len(reading) <= LONGEST_LABEL else f"Lengths in {units}"


class TypedInput:
    """Handles what was typed. Invalid text changes nothing; the status line and the page name it."""

    def __init__(self, page: Page, looks: Looks) -> None:
        self._page, self._looks = page, looks

    def set_field(self, number: int, value: object) -> None:
        """A value typed beside a slider."""
        page = self._page
        match value:
            case [uuid, str(text)]:
                joint, name = page.joints.sliders.index_of(uuid), page.posture.name_of(uuid)
            case _:
                raise kin.InputError("field", value, "an id and a text")
        if joint is not None:
            self._answer(number, lambda: self._set_joint(joint, uuid, text))
        elif name is not None:
            self._answer(number, lambda: self.slide(name, page.posture.read_text(name, text), held=False))

    def _set_joint(self, joint: int, uuid: object, text: str) -> None:
        self._page.arm.move_joint(joint, self._page.joints.sliders.read_text(uuid, text), held=False)

    def set_target(self, number: int, value: object) -> None:
        """A typed target, or what the pendant shows of the joints."""
        match value:
            case [("position" | "angles" | "quaternion" | "pose") as kind, str(text)]:
                self._answer(number, lambda: self._set_target(kind, text, False))
            case [("position" | "angles" | "quaternion" | "pose") as kind, str(text), "tool"]:
                self._answer(number, lambda: self._set_target(kind, text, True))
            case ["pendant", str(text)]:
                self._answer(number, lambda: self._set_pendant(text))
            case _:
                raise kin.InputError("target", value, 'what was typed, a text, and "tool" if it is relative to it')

    def _set_pendant(self, text: str) -> None:
        """Joint values as the arm's pendant shows them."""
        self._page.arm.move_to(self._page.joints.sliders.read_pendant(text))

    def _set_target(self, kind: PoseKind, text: str, relative: bool) -> None:
        """Typed numbers are in the frame of the read-out, or `relative` to the tool."""
        page, arm = self._page, self._page.arm
        tool = kin.fk(page.arm.robot, arm.goal)
        frame = page.display.frames.pose(page.arm.robot, arm.goal, relative)
        present = inverse(frame) @ (tool if relative or arm.target is None else arm.target)
        maker = page.arm.robot.maker
        T, given = read_pose(kind, text, page.display.units, present, page.view.rotations, maker)
        T = frame @ T
        arm.target = None  # a changed task must not solve for the target of before
        if given != "pose" and page.arm.task != given:
            page.arm.set_task(given)
        elif given == "pose" and kind != "position" and page.arm.task == "position":
            page.arm.set_task("pose")
        arm.set_target(T)
        page.picture.keep_in_view(T[:3, 3])

    def _answer(self, number: int, action: Callable[[], None]) -> None:
        """Act on a typed text, and tell the page whether it was valid."""
        try:
            action()
        except EntryError as error:
            self._page.status.show(Notice("error", error.title, error.detail))
            readings = tuple((_label(text), text) for text in error.readings)
            self._page.channel.reply(Reply(number, f"{error.title}. {error.detail}", readings))
        else:
            self._page.channel.reply(Reply(number, ""))

    def nudge(self, value: object) -> None:
        """Move the target by one step along, or about, an axis of the gizmo."""
        match value:
            case [(0 | 1 | 2) as axis, bool(turn), (-1 | 1) as sign, bool(fine)]:
                step, angle = (FINE_STEP, FINE_TURN) if fine else (STEP, TURN)
                self._page.arm.nudge(axis, turn, sign * (angle if turn else step))
            case _:
                raise kin.InputError("nudge", value, "an axis, whether to turn, a sign, whether it is a fine step")

    def jog(self, value: object) -> None:
        """Move the tool, or one joint, by one step of so many millimetres or degrees."""
        arm, robot = self._page.arm, self._page.arm.robot
        match value:
            case [("tool" | "base") as frame, (0 | 1 | 2 | 3 | 4 | 5) as axis, (-1 | 1) as sign, int(step)]:
                self._check_step(step)
                turn = axis >= 3
                if not arm.jog(axis % 3, turn, sign * _amount(step, turn), frame == "base"):
                    self._page.status.show(_NO_FURTHER)
            case ["joints", int(joint), (-1 | 1) as sign, int(step)] if 0 <= joint < robot.n:
                self._check_step(step)
                moved = arm.goal.copy()
                moved[joint] += sign * _amount(step, bool(robot.revolute[joint]))
                within = robot.clip(moved)[joint]
                notice = BY_HAND if within == moved[joint] else _AT_LIMIT
                arm.move_joint(joint, float(within), held=False, notice=notice)
            case _:
                raise kin.InputError("jog", value, "tool, base or joints, an axis or a joint, a sign and a step")

    def _check_step(self, step: int) -> None:
        if step not in STEPS:
            raise kin.InputError("jog", step, "a step of " + ", ".join(map(str, STEPS)))

    def switch_axes(self, _: object) -> None:
        """Align the gizmo with the base if it is aligned with the tool, and the reverse."""
        page = self._page
        self._looks.use_view(replace(page.view, base_axes=not page.view.base_axes))

    def snap(self, value: object) -> None:
        """Drag the gizmo in steps, or freely."""
        self._page.arm.snap = value is True

    def slide(self, name: str, value: object, held: bool) -> None:
        """Set a redundancy parameter, in screen units, while the tool stays; `held`: with its slider."""
        page = self._page
        q, result = page.posture.move(name, value, held)
        page.status.show_result(result, page.display.units)
        if q is not None:
            page.arm.slide_along(q)
