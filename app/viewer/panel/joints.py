"""One slider per joint, with exact entry, limits and the chosen unit, and a lock for each joint.

A locked joint keeps its value whenever inverse kinematics moves the arm; its slider still moves it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

from app.viewer.panel import Post, listen, listen_click, update_html
from app.viewer.panel.entry import read_value
from app.viewer.panel.fence import Fence, SliderCrossings
from app.viewer.panel.fields import field, fields_html, limit_marks, shown
from app.viewer.panel.part import Block, add_html
from app.viewer.panel.status import Notice
from app.viewer.views.templates import render
from kin import InputError, Robot
from kin.files.numbers import index_of
from kin.motors import from_pendant, to_pendant
from kin.transforms import Array
from kin.typed import EntryError, ReadError, elements, interpret, read_element
from kin.units import Unit, Units, general

DIGITS = 2
_ROUNDED = 0.51  # of the last digit that the pendant shows: so far may what is typed be from what was shown
REMEMBERED = 200  # fields of sliders, also of those that were replaced
# Marks the label of a locked joint; invisible. static/input.js presses such a button, on which viewer.css draws a
# padlock.
LOCKED = "\N{WORD JOINER}"
UNLOCK_ALL = "Unlock all"
LOCK_HINT = (
    "A locked joint keeps its value while the arm follows a target; its slider still moves it. "
    "Click a number to lock or unlock that joint."
)


def label(robot: Robot, index: int) -> str:
    """A joint's name on screen: its number, and its name unless that only repeats the number."""
    name = robot.joints[index].name
    number = str(index + 1)
    return f"Joint {number}" if name.lower() == f"joint {number}" else f"{number} {name}"


def lock_buttons(locked: Sequence[bool]) -> tuple[str, ...]:
    """The labels of the lock buttons: one number per joint, marked if it is locked."""
    buttons = tuple(f"{LOCKED}{i + 1}" if lock else str(i + 1) for i, lock in enumerate(locked))
    return (*buttons, UNLOCK_ALL) if any(locked) else buttons


def lock_notice(locked: Sequence[bool]) -> Notice:
    """The message after a joint was locked or unlocked."""
    numbers = [str(i + 1) for i, lock in enumerate(locked) if lock]
    if not numbers:
        return Notice("hand", "No joint is locked", "Every joint may move to follow a target.")
    joints = "Joint " + numbers[0] if len(numbers) == 1 else "Joints " + ", ".join(numbers)
    detail = "The arm reaches targets with the other joints; sliders still move locked joints."
    return Notice("hand", f"{joints} locked", detail)


def pendant_html(robot: Robot, q: Array, units: Units) -> str:
    """What the pendant of an arm shows at a configuration ``(n,)``."""
    turning = robot.revolute.tolist()
    values = [
        (joint.name, units.of(turns).number(value), units.of(turns).suffix)
        for joint, turns, value in zip(robot.joints, turning, to_pendant(robot, q).tolist(), strict=True)
    ]
    return render("panel/pendant", values=values)


class JointSliders:
    """The sliders of one robot in the visitor's units; rebuilt when either changes, or the folders.

    Posts ``("joint", robot id, i, units, k)`` with the value of the slider in the k-th folder in screen units, and
    ``("lock", robot id, i)`` with whether to lock the joint (i is None for all joints).

    Args:
        folders: each gets a slider per joint; all show the same values.
        before: the sliders that these replace. What is typed into one of their fields counts for the same joint:
            the page may send it when they are gone.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        folders: Sequence[viser.GuiFolderHandle],
        robot: Robot,
        q: Array,
        locked: Sequence[bool],
        units: Units,
        post: Post,
        fence: Fence,
        before: JointSliders | None = None,
    ) -> None:
        self.robot = robot
        self._units = units
        self._held = 0  # index of the folder whose slider was moved last
        # By folder and joint.
        self._crossings = SliderCrossings[tuple[int, int]](fence, lambda key: self._sliders[key[0]][key[1]])
        if before is not None:  # what was sent to a slider is on its way to the one that replaces it
            self._crossings.sent(itertools.product(range(len(folders)), range(robot.n)))
        # Of each field: index and kind of its joint, and the unit of what is typed there.
        self._fields: dict[object, tuple[int, str, Unit]] = {} if before is None else before._fields
        self._sliders: list[list[viser.GuiSliderHandle[float]]] = []
        self._others: list[Any] = []  # controls besides sliders
        self._pendants: list[Block] = []
        self._locks: list[viser.GuiButtonGroupHandle] = []
        for place, folder in enumerate(folders):
            with folder:
                self._sliders.append([self._slider(gui, i, q, place, post) for i in range(robot.n)])
                locks = gui.add_button_group("Locked", lock_buttons(locked), hint=LOCK_HINT)
                fields = dict(field(slider, self._unit(i)) for i, slider in enumerate(self._sliders[-1]))
                self._others.append(add_html(gui, fields_html(fields)))
                if robot.pendant_map is not None:
                    self._pendants.append(add_html(gui, pendant_html(robot, q, units)))
            joints = [(i, joint.kind, self._unit(i)) for i, joint in enumerate(robot.joints)]
            self._fields |= zip(fields, joints, strict=True)
            self._locks.append(locks)
            self._listen_locks(locks, post)
        while len(self._fields) > max(REMEMBERED, len(folders) * robot.n):
            del self._fields[next(iter(self._fields))]

    def _slider(self, gui: viser.GuiApi, i: int, q: Array, place: int, post: Post) -> viser.GuiSliderHandle[float]:
        joint, unit = self.robot.joints[i], self._unit(i)
        low, high = joint.limits or (-math.pi, math.pi)
        bounds = (unit.shown(low, DIGITS), unit.shown(high, DIGITS))
        limits = f"{general(bounds[0])} … {general(bounds[1])}{unit.suffix}"
        slider = gui.add_slider(
            label(self.robot, i),
            min=bounds[0],
            max=bounds[1],
            step=unit.step(DIGITS),
            marks=limit_marks(*bounds),
            initial_value=min(max(shown(float(q[i]), unit, DIGITS), bounds[0]), bounds[1]),
            hint=f"{joint.name}: {limits}. Arrow keys: {unit.step(0):g}{unit.suffix}.",
        )
        listen(slider, post, ("joint", self.robot.id, i, self._units, place))
        return slider

    def index_of(self, uuid: object) -> int | None:
        """The joint whose slider has, or had, this id; None if there is none."""
        found = self._fields.get(uuid) if isinstance(uuid, str) else None
        return None if found is None else found[0]

    def read_text(self, uuid: object, text: str) -> float:
        """What was typed beside the slider with this id, in radians or metres.

        Raises:
            EntryError: it is not within the limits, or the arm on show has no such joint.
        """
        index, kind, unit = self._fields[uuid]
        if index >= self.robot.n or self.robot.joints[index].kind != kind:
            raise EntryError(f"Joint {index + 1} was not changed", f"The {self.robot.name} has no such joint.")
        limits = self.robot.joints[index].limits or (-math.pi, math.pi)
        return read_value(text, f"Joint {index + 1}", unit, limits)

    def read_pendant(self, text: str) -> Array:
        """The configuration ``(n,)`` of which the pendant shows what was typed.

        Raises:
            EntryError: it is no list of as many numbers as there are joints, or not within the limits.
        """
        robot, units, title = self.robot, [self._unit(i) for i in range(self.robot.n)], "The joints were not moved"

        def evaluate(way: str) -> Array:
            words = elements(way)
            if len(words) != robot.n:
                raise ReadError(f"found {len(words)} numbers; valid are {robot.n}, one for each joint")
            return np.array(list(map(read_element, words, units)))

        try:
            shown = interpret(text, evaluate, np.array_equal)
        except ReadError as error:
            raise EntryError(title, error.sentence, error.readings) from None
        q = from_pendant(robot, shown)
        slack = np.array([unit.read(_ROUNDED * unit.step(1)) for unit in units])
        if robot.pendant_map is not None:
            slack = np.abs(robot.pendant_map.back) @ slack
        for joint, unit, value, off in zip(robot.joints, units, q.tolist(), slack.tolist(), strict=True):
            low, high = joint.limits or (-math.pi, math.pi)
            if not low - off <= value <= high + off:
                valid = f"Valid: {unit.number(low)} … {unit.text(high)}."
                raise EntryError(
                    title, f"Joint {joint.name} would have {unit.text(value)}, outside its limits. {valid}"
                )
        return robot.clip(q)

    def read(self, index: int, value: object, place: int = 0) -> float:
        """A slider's value in radians or metres, within the limits; raises `InputError` for anything else.

        Args:
            place: index of the slider's folder.
        """
        self._held = place
        self._crossings.heard((place, index))
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"joint {index + 1}", value, "a finite number")
        raw = self._unit(index).read(float(value))
        return float(np.clip(raw, self.robot.lower[index], self.robot.upper[index]))

    def show(self, q: Array, dragged: int | None = None) -> None:
        """Set every slider except the one the visitor drags: it would jump under the pointer.

        That one is set too if the value typed into it is outside the limits.
        """
        for place, sliders in enumerate(self._sliders):
            for i, slider in enumerate(sliders):
                held = i == dragged and place == self._held and slider.min <= slider.value <= slider.max
                self._crossings.set((place, i), self._value(slider, i, q), held)
        for html in self._pendants:
            update_html(html, pendant_html(self.robot, q, self._units))

    def _value(self, slider: viser.GuiSliderHandle[float], i: int, q: Array) -> float:
        """What the slider of joint i shows at a configuration ``(n,)``."""
        return min(max(shown(float(q[i]), self._unit(i), DIGITS), slider.min), slider.max)

    def show_locks(self, locked: Sequence[bool]) -> None:
        """Show which joints are locked ``(n,)``."""
        for locks in self._locks:
            if locks.options != lock_buttons(locked):
                locks.options = lock_buttons(locked)

    def _unit(self, index: int) -> Unit:
        return self._units.of(self.robot.joints[index].kind == "revolute")

    def _listen_locks(self, locks: viser.GuiButtonGroupHandle, post: Post) -> None:
        @locks.on_click
        async def _(event: Any) -> None:
            if event.client is None:
                return
            text = str(event.target.value)
            number = text.removeprefix(LOCKED)
            joint = index_of(number, self.robot.n + 1)
            if text == UNLOCK_ALL:
                post(("lock", self.robot.id, None), False)
            elif joint:
                # Post the requested state, not a toggle: two quick clicks arrive as one.
                post(("lock", self.robot.id, joint - 1), text == number)

    def remove(self) -> None:
        """Remove the sliders from the panel."""
        self._crossings.clear()
        for control in (
            *self._locks,
            *self._others,
            *self._pendants,
            *(s for sliders in self._sliders for s in sliders),
        ):
            control.remove()


def go_to_buttons(gui: viser.GuiApi, post: Post) -> None:
    """The buttons that move the arm. Post ``"home"`` and ``"random"``."""
    buttons = gui.add_button_group("Go to", ("Home", "Random"))
    listen_click(buttons, post, {"Home": "home", "Random": "random"})
