"""The program that is connected to a page: what it sends is an event like any other, and it hears what follows.

A burst of a program is one step of undo, whatever the visitor does meanwhile. While the visitor holds the target,
what would move the arm is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from app.live import Line
from app.shared.problems import Problem, from_input_error, invalid_input, problem_of
from app.shared.problems import problem as problem_document
from app.viewer.live.feature import Connect, check_gripper
from app.viewer.own_arm import own_arm
from app.viewer.panel.status import Notice
from app.viewer.session.parts import Page
from app.viewer.tabs.program.tab import ProgramTab
from kin import IKResult, InputError, KinematicsError, Obstacle, Robot
from kin.motion import Program
from kin.transforms import Array

HINT = "Values fit the arm that the page shows now; welcome and news say which one that is."
HELD = "The visitor holds the target."


class LiveInput:
    """Applies what the program of one page sends, and publishes what the page shows. The worker calls it.

    Attributes:
        handlers: by the first part of an event's key.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._done: list[int] = []
        self._plays = False  # whether the program of the tab plays because it was asked for here
        self.handlers: dict[str, Callable[[object], None]] = {"live": self._move, "drawn": self._draw}
        self._used: dict[str, Callable[[Any], None]] = {
            "robot": self._use_robot,
            "obstacles": self._use_obstacles,
            "program": self._use_program,
            "q": self._use_q,
            "gripper": self._use_gripper,
            "target": self._use_target,
            "play": self._play,
        }

    @property
    def _name(self) -> str:
        line = self._page.door.line
        return "A program" if line is None or line.program is None else line.program.name

    def _move(self, _: object) -> None:
        if (line := self._page.door.line) is None:
            return
        pending = line.take("live")
        problem: Problem | None = None
        for name, value in pending.values.items():
            if self._page.arm.dragging and name in ("q", "target"):
                problem = problem_document(409, "not-allowed", HELD, "Send again when it is released.")
                continue
            problem = self._problem_of(lambda name=name, value=value: self._used[name](value)) or problem  # type: ignore[misc]
        self._answer(line, pending.numbers, problem)

    @property
    def connect(self) -> Connect | None:
        """The feature that shows the program and what it says; None: the page does not offer it."""
        return next((each for each in self._page.features if isinstance(each, Connect)), None)

    def _draw(self, _: object) -> None:
        feature = self.connect
        if (line := self._page.door.line) is None or feature is None:
            return
        pending = line.take("drawn")
        self._answer(line, pending.numbers, self._problem_of(lambda: feature.use(pending.values)))

    def refuse(self, why: str) -> None:
        """Drop what the program has sent, and tell it why."""
        if (line := self._page.door.line) is not None:
            pending = line.take("live")
            self._answer(line, pending.numbers, problem_document(409, "not-allowed", why, "Try again later."))

    def _answer(self, line: Line, numbers: list[int], problem: Problem | None) -> None:
        """The newest message gets the problem; the others are done when the page shows it."""
        if problem is not None:
            line.write(numbers.pop() if numbers else None, problem)
        self._done += numbers

    @staticmethod
    def _problem_of(action: Callable[[], None]) -> Problem | None:
        try:
            action()
        except InputError as error:
            return invalid_input(from_input_error(error), hint=HINT)
        except KinematicsError as error:
            return problem_of(error, HINT, HINT)
        return None

    # What it sends

    def _use_robot(self, given: Robot | Mapping[str, Any]) -> None:
        page = self._page
        if isinstance(given, Robot):
            if given != page.arm.robot:
                page.robots.show(given)
        else:
            own = own_arm(given)
            if page.robots.own is None or own.robot != page.robots.own.robot or own.robot != page.arm.robot:
                page.robots.show_own(own)
        self._say("Another arm")

    def _use_obstacles(self, obstacles: tuple[Obstacle, ...]) -> None:
        self._page.arm.use_obstacles(obstacles)
        self._say("Other obstacles")

    def _use_program(self, program: Program) -> None:
        self._tab.load(program, self._name)

    def _play(self, on: bool) -> None:
        self._tab.start(on)
        self._plays = on

    @property
    def _tab(self) -> ProgramTab:
        return next(each for each in self._page.features if isinstance(each, ProgramTab))

    def _use_q(self, q: Array) -> None:
        robot = self._page.arm.robot
        q = robot.check_q(q)
        if not robot.in_limits(q, slack=1e-6):
            raise InputError("q", np.asarray(q).tolist(), "a configuration within the limits of the arm on show")
        self._page.arm.move_to(robot.clip(q), Notice("hand", f"Joints moved by {self._name}"), at_once=True)

    def _use_gripper(self, opening: float) -> None:
        check_gripper(self._page.arm, "gripper", opening)
        self._page.arm.open_gripper(opening)

    def _use_target(self, target: tuple[Array, bool]) -> None:
        T, oriented = target
        if not oriented:
            T = T.copy()
            T[:3, :3] = self._page.arm.now.aim[:3, :3]
        self._page.arm.set_target(T)

    def _say(self, what: str) -> None:
        self._page.status.show(Notice("hand", f"{what} from {self._name}"))

    # What it hears

    def publish(self, result: IKResult | None) -> None:
        """Let the program know what the page shows now; `result` is the last answer of inverse kinematics."""
        page, line = self._page, self._page.door.line
        self._plays = self._plays and self._tab.settings.playing
        if line is None:
            self._done.clear()
            if self._plays:  # the visitor has ended the connection, and so what it does
                self._plays = False
                self._tab.start(False)
            return
        line.use_robot(page.arm.robot)
        if line.program is None:
            self._done.clear()
            return
        connect = self.connect
        values = {
            "q": page.arm.q,
            "gripper": page.arm.opening,
            "target": page.arm.open_target,
            "result": None if page.activity.withheld else result,
            "contacts": () if connect is None else connect.contacts,
            "program": self._tab.progress,
        }
        for name, value in values.items():
            line.publish(name, value, anew=False)
        for number in self._done:
            line.write(number)
        self._done.clear()
