"""The visitor's actions: what each event of the panel and the scene does to the page.

Only the visitor's worker calls these methods, one event at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Protocol

import kin
from app.viewer.feature import Feature
from app.viewer.panel import assign
from app.viewer.panel.joints import JointSliders
from app.viewer.panel.layout import Panel
from app.viewer.panel.status import Notice, StatusLine, introduction
from app.viewer.panel.target import TASKS
from app.viewer.session.persistence import SavedPage
from app.viewer.session.posture import PosturePanel
from kin import Robot
from kin.transforms import Array
from kin.units import Units

BY_HAND = Notice("hand", "Joints moved by hand", "The target follows the tool.")


class ActedPage(SavedPage, Protocol):
    """What actions may use of a page, in addition to what is saved of it."""

    panel: Panel
    sliders: JointSliders
    posture: PosturePanel
    status: StatusLine
    system_dark: bool

    def use_colours(self, dark: bool | None, system_dark: bool) -> None:
        """Make the page dark or light; None: as the visitor's system is."""

    def change_robot(self, robot: Robot, q: Array | None = None) -> None:
        """Replace the robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""

    def use_units(self, units: Units) -> None:
        """Show all numbers in these units."""

    def apply_view(self) -> None:
        """Show the scene as `view` says."""

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""


class Actions:
    """Handles the events of one page."""

    def __init__(self, page: ActedPage) -> None:
        self._page = page
        arm = page.arm
        # Events by the first part of their key. A handler takes the other parts, and the value.
        self._handlers: dict[str, Callable[..., None]] = {
            "gizmo": arm.pull,
            "joint": self._on_slider,
            "redundancy": self._on_redundancy,
            "lock": self._on_lock,
            "branch": self._on_branch_choice,
            "feature": self._on_feature,
            "lesson": lambda title: page.lessons.choose(title) if page.lessons is not None else None,
            "robot": self._on_robot_choice,
            "task": self._on_task,
            "radians": lambda radians: page.use_units(replace(page.units, degrees=not radians)),
            "lengths": lambda name: page.use_units(page.panel.units.with_length(page.units, name)),
            "home": lambda _: self._move_into_view(arm.move_home),
            "random": lambda _: self._move_into_view(arm.move_to_random),
            "recall": lambda _: self._move_by_hand(arm.recall_target),
            "copy-as": lambda name: page.panel.share.choose(name),
            "view": self._on_view,
            "colours": self._on_colours,
            "system-dark": lambda dark: page.use_colours(page.view.dark, bool(dark)),
            "camera": lambda _: page.camera.aim(arm.scene.body, self._frames(), glide=True),
            "fit-arm": lambda _: page.camera.look_at_arm(self._frames()),
            "look-from": lambda side, _: page.camera.look_from(side, self._frames()),
            "resized": lambda _: page.camera.refit(),
            "looked": lambda _: None,  # the viewpoint is read when the camera rests
        }

    def handle(self, key: Hashable, value: object) -> None:
        """Process one event; raises `kin.InputError` for a value that none of our controls sends."""
        name, *arguments = key if isinstance(key, tuple) else (key,)
        if name not in self._handlers:
            raise KeyError(key)
        self._handlers[name](*arguments, value)

    def _frames(self) -> Array:
        """Origins ``(n, 3)`` of the frames of the arm where it is heading."""
        frames: Array = kin.link_frames(self._page.robot, self._page.goal)[:, :3, 3]
        return frames

    def _move_into_view(self, motion: Callable[[], None]) -> None:
        """Move the arm, and the camera if it would not show the whole arm."""
        self._move_by_hand(motion)
        self._page.camera.keep(self._frames())

    def _move_by_hand(self, motion: Callable[[], None]) -> None:
        motion()
        self._page.status.show(BY_HAND)

    def _on_slider(self, robot_id: str, index: int, units: Units, value: object) -> None:
        page = self._page
        # An event of sliders that have been replaced since is ignored.
        if (robot_id, units) == (page.robot.id, page.units):
            page.arm.move_joint(index, page.sliders.read(index, value))
            page.status.show(BY_HAND)

    def _on_redundancy(self, robot_id: str, name: str, units: Units, value: object) -> None:
        """Move through the self-motion while the tool is held."""
        page = self._page
        if (robot_id, units) != (page.robot.id, page.units):
            return
        q, result = page.posture.move(name, value)
        page.status.show_result(result, page.units)
        if q is not None:
            page.arm.slide_along(q)

    def _on_lock(self, robot_id: str, joint: int | None, lock: object) -> None:
        if robot_id == self._page.robot.id:
            self._page.change_lock(joint, bool(lock))

    def _on_branch_choice(self, robot_id: str, value: object) -> None:
        """Move to the same pose on another branch, and stay on that branch."""
        page = self._page
        if robot_id == page.robot.id:
            page.arm.switch_branch(page.posture.read(value))
            page.for_features(lambda feature: feature.on_request())

    def _on_feature(self, name: str, key: Hashable, value: object) -> None:
        for feature in self._page.features:
            if feature.key == name:
                feature.handle(key, value)

    def _on_robot_choice(self, value: object) -> None:
        page, name = self._page, str(value)
        robot = next((r for r in page.store.robots if r.name == name), None)
        if robot is None:
            assign(page.panel.robot, page.robot.name)
            robot = page.store.get(name)  # raises with the list of valid ones
        if robot != page.robot:
            page.change_robot(robot)
            page.status.show(introduction(robot))

    def _on_task(self, value: object) -> None:
        page = self._page
        if value not in TASKS:
            page.panel.target.show(page.task)
            raise kin.InputError("task", value, "one of " + ", ".join(TASKS))
        page.arm.set_task(TASKS[str(value)])

    def _on_colours(self, name: object) -> None:
        page = self._page
        page.use_colours(page.panel.colours.read(name, page.view.dark), page.system_dark)

    def _on_view(self, name: str, value: object) -> None:
        page = self._page
        setattr(page.view, name, bool(value))
        page.apply_view()
