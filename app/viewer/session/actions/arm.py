"""The visitor's actions on the arm: joints, posture, task, robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import kin
from app.viewer.panel.status import Notice, introduction
from app.viewer.session.actions.typed import BY_HAND, TypedInput
from app.viewer.session.choices import DEFAULT_TASK
from app.viewer.session.parts import Page
from app.viewer.session.robots import robot_of
from app.viewer.session.state import PageState
from kin.ik import Task
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
            "home": lambda _: self._move_into_view(arm.move_home, "Home configuration"),
            "random": lambda _: self._move_into_view(arm.move_to_random, "Random configuration"),
            "recall": lambda _: self._move(arm.recall_target, "The target is at the tool"),
            "shown": lambda moved: page.move_to(moved[0], moved[1], True),
        }

    def adopt(self, state: PageState) -> None:
        """Show the arm of another state: robot, requests and configuration."""
        page = self._page
        changed, page.own = state.own != page.own, state.own
        robot = robot_of(page, state.robot)
        if robot != page.now.robot:
            page.change_robot(robot, state.q)
            if state.camera is not None:
                page.camera.restore(state.camera)
        elif changed:
            page.panel.robots.show(robot, page.own)
        self._restore_arm(state)

    def _restore_arm(self, state: PageState) -> None:
        page, arm = self._page, self._page.arm
        task: Task = state.task or DEFAULT_TASK
        locks = [i in state.locks for i in range(page.now.robot.n)]
        page.sliders.show_locks(locks)
        q = page.now.robot.q_home if state.q is None else state.q
        arm.restore(q, state.target, task, state.branch, locks)
        page.forms.show()

    def _move_into_view(self, motion: Callable[[], None], title: str) -> None:
        """Move the arm, and the camera if it would not show the whole arm."""
        self._move(motion, title)
        self._page.keep_in_view()

    def _move(self, motion: Callable[[], None], title: str) -> None:
        motion()
        self._page.status.show(replace(BY_HAND, title=title))

    def _on_slider(self, robot_id: str, index: int, units: Units, place: int, value: object) -> None:
        page = self._page
        # An event of sliders that have been replaced since is ignored.
        if (robot_id, units) == (page.now.robot.id, page.units):
            page.arm.move_joint(index, page.sliders.read(index, value, place))
            page.status.show(BY_HAND)

    def _on_redundancy(self, robot_id: str, name: str, units: Units, value: object) -> None:
        """Move through the self-motion while the tool is held."""
        page = self._page
        if (robot_id, units) != (page.now.robot.id, page.units):
            return
        self._typed.slide(name, value, held=True)

    def _on_lock(self, robot_id: str, joint: int | None, lock: object) -> None:
        if robot_id == self._page.now.robot.id:
            self._page.change_lock(joint, bool(lock))

    def _on_branch_choice(self, robot_id: str, value: object) -> None:
        """Move to the same pose on another branch, and stay on that branch."""
        page = self._page
        if robot_id == page.now.robot.id:
            branch = page.posture.read(value)
            if not page.arm.switch_branch(branch) and branch is not None:
                page.status.show(page.posture.not_here(branch))
                return
            page.for_features(lambda feature: feature.on_request())

    def _on_robot_choice(self, value: object) -> None:
        page = self._page
        if (robot := page.panel.robots.read(value)) == page.now.robot:
            return
        # The visitor's own arm has another id after every change; only the present one can be shown again.
        own = None if page.own is None else page.own.robot.id
        ids = {own, *(offered.id for offered in page.store.robots)}
        self._left = {name: state for name, state in self._left.items() if name in ids}
        self._left[page.now.robot.id] = page.snapshot()
        left = self._left.get(robot.id)
        page.change_robot(robot, None if left is None else left.q)
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
