"""The visitor's actions on the arm: joints, posture, task, robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import kin
from app.viewer.arm import DEFAULT_TASK
from app.viewer.panel.status import BY_HAND, Notice, introduction
from app.viewer.session.actions.typed import TypedInput
from app.viewer.session.parts import Page
from app.viewer.session.state import PageState
from kin.ik import Task
from kin.transforms import Array
from kin.units import Units


class ArmControls:
    """Changes the arm of one page.

    Attributes:
        handlers: by the first part of an event's key; each takes the other parts, and the value.
    """

    def __init__(self, page: Page, typed: TypedInput) -> None:
        self._page = page
        self._typed = typed
        self._left: dict[str, PageState] = {}  # the state in which each robot was left
        arm = page.arm
        self.handlers: dict[str, Callable[..., Any]] = {
            "gizmo": arm.pull,
            "joint": self._on_slider,
            "redundancy": self._on_redundancy,
            "lock": self._on_lock,
            "branch": self._on_branch_choice,
            "robot": self._on_robot_choice,
            "find": self._on_find,
            "task": self._on_task,
            "home": lambda _: self._move_into_view(arm.robot.q_home, "Home configuration"),
            "random": lambda _: self._move_into_view(arm.random_q(), "Random configuration"),
            "recall": lambda _: self._move(arm.goal, "The target is at the tool"),
            "shown": lambda moved: arm.move_to(moved[0], moved[1], at_once=True),
        }

    def adopt(self, state: PageState) -> None:
        """Show the arm of another state: robot, requests and configuration."""
        page = self._page
        changed, page.robots.own = state.own != page.robots.own, state.own
        robot = page.robots.get(state.robot)
        if robot != page.arm.robot:
            page.robots.show(robot, state.q)
            if state.camera is not None:
                page.camera.restore(state.camera)
        elif changed:
            page.panel.robots.show(robot, page.robots.own)
        self._restore_arm(state)

    def _restore_arm(self, state: PageState) -> None:
        arm = self._page.arm
        task: Task = state.task or DEFAULT_TASK
        locks = [i in state.locks for i in range(arm.robot.n)]
        q = arm.robot.q_home if state.q is None else state.q
        arm.restore(q, state.target, task, state.branch, locks)

    def _move_into_view(self, q: Array, title: str) -> None:
        """Move the arm, and the camera if it would not show the whole arm."""
        self._move(q, title)
        self._page.picture.keep_in_view()

    def _move(self, q: Array, title: str) -> None:
        self._page.arm.move_to(q, replace(BY_HAND, title=title))

    def _on_slider(self, robot_id: str, index: int, units: Units, place: int, value: object) -> None:
        page = self._page
        # An event of sliders that have been replaced since is ignored.
        if (robot_id, units) == (page.arm.robot.id, page.display.units):
            page.arm.move_joint(index, page.joints.sliders.read(index, value, place))

    def _on_redundancy(self, robot_id: str, name: str, units: Units, value: object) -> None:
        """Move through the self-motion while the tool is held."""
        page = self._page
        if (robot_id, units) != (page.arm.robot.id, page.display.units):
            return
        self._typed.slide(name, value, held=True)

    def _on_lock(self, robot_id: str, joint: int | None, lock: object) -> None:
        if robot_id == self._page.arm.robot.id:
            self._page.arm.change_lock(joint, bool(lock))

    def _on_branch_choice(self, robot_id: str, value: object) -> None:
        """Move to the same pose on another branch, and stay on that branch."""
        page = self._page
        if robot_id == page.arm.robot.id:
            branch = page.posture.read(value)
            if not page.arm.switch_branch(branch) and branch is not None:
                page.status.show(page.posture.not_here(branch))
                return
            page.for_features(lambda feature: feature.on_request())

    def _on_robot_choice(self, value: object) -> None:
        page = self._page
        if (robot := page.panel.robots.read(value)) == page.arm.robot:
            return
        # The visitor's own arm has another id after every change; only the present one can be shown again.
        own = None if page.robots.own is None else page.robots.own.robot.id
        ids = {own, *(offered.id for offered in page.services.store.robots)}
        self._left = {name: state for name, state in self._left.items() if name in ids}
        self._left[page.arm.robot.id] = page.snapshot()
        left = self._left.get(robot.id)
        page.robots.show(robot, None if left is None else left.q)
        if left is None:
            page.lessons.begin(keep_arm=True)  # the open step is about a pose of this arm
        page.status.show(introduction(robot))
        if left is not None:
            self._restore_arm(left)

    def _on_find(self, value: object) -> None:
        """Shorten the menu of robots. It is called while words are typed: one that is not complete is no error."""
        page = self._page
        try:
            count = page.panel.robots.find(value)
        except kin.InputError as error:
            detail = f"Not yet a query: {error.value!r}. Expected {error.expected}."
            page.status.show(Notice("hand", "Find", detail))
            return
        if not value:
            page.status.show(Notice("hand", "Find", "The menu Robot offers all arms."))
            return
        words = {0: "No arm fits", 1: "One arm fits"}.get(count, f"{count} arms fit")
        page.status.show(Notice("hand", words, "The menu Robot offers what fits, and the arm on show."))

    def _on_task(self, place: str, path: str, serial: int, value: object) -> None:
        self._page.arm.set_task(self._page.forms.read(place, path, serial, value).task)
