"""The numbers that follow the arm: read-out, sliders, warning of a contact, and the number beside a missed target.

They are updated after the scene, and at most once per interval, because that takes longer than posing the joints.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from app.viewer.feature import Stage
from app.viewer.frames import FrameAxes
from app.viewer.obstacles.words import sentence
from app.viewer.panel.layout import Panel
from app.viewer.panel.status import key_number
from app.viewer.scene.gizmo import travel
from app.viewer.scene.key_number import KeyNumber
from app.viewer.session.posture import PosturePanel
from kin import IKResult
from kin.axes import inverse
from kin.collision import Contact
from kin.frames import WORLD
from kin.transforms import Array

FRAME_AXES = 0.16  # length of the axes of a workpiece, in radii of the sphere around the arm


class Numbers:
    """The numbers of one page. Not thread-safe: the visitor's worker calls it.

    Args:
        touched: called with what the arm touches when that has changed, the deepest contact first.
    """

    def __init__(
        self, page: Stage, panel: Panel, posture: PosturePanel, touched: Callable[[Sequence[Contact]], None]
    ) -> None:
        self._page, self._panel, self._posture, self._touched = page, panel, posture, touched
        self._pose_due = self._sliders_due = False
        self._updated_at = 0.0
        self._dragged: int | None = None  # the joint whose slider the visitor holds
        self._beside_target = KeyNumber(page.client.scene)
        self._travel = KeyNumber(page.client.scene, "/travel", below=True)
        self._axes = FrameAxes(page.client.scene)
        self._contacts: tuple[Contact, ...] = ()

    def use_frames(self) -> None:
        """The page has other frames, or another arm."""
        arm = self._page.arm
        shown = arm.scene.body
        self._axes.show(self._page.display.frames, arm.robot, FRAME_AXES * shown.radius, shown.mount.aside)
        self._panel.readout.show_frames(self._page.display.frames)
        self._pose_due = True

    def use_pose(self) -> None:
        """The arm has another pose, or numbers have other units."""
        self._pose_due = True

    def use_goal(self, dragged: int | None) -> None:
        """The arm is heading for another configuration; the visitor holds the slider of joint `dragged`."""
        self._sliders_due, self._dragged = True, dragged

    def use_result(self, result: IKResult) -> None:
        """The target has been solved: write the most important number beside it."""
        arm = self._page.arm
        if arm.target is not None:
            self._beside_target.show(
                key_number(result, self._page.display.units), arm.target[:3, 3], arm.scene.body.radius
            )

    def use_drag(self, start: Array, target: Array | None) -> None:
        """The target is dragged from one pose ``(4, 4)`` to another: write how far; None: it is released."""
        if target is None:
            self._travel.hide()
        else:
            radius = self._page.arm.scene.body.radius
            self._travel.show(travel(start, target, self._page.display.units), target[:3, 3], radius)

    def hide_target(self) -> None:
        """There is no target."""
        self._beside_target.hide()
        self._travel.hide()

    @property
    def waiting(self) -> float | None:
        """Seconds until the next update; None if no number is out of date."""
        if not (self._pose_due or self._sliders_due):
            return None
        return max(0.0, self._updated_at + self._page.services.pace.reading - time.perf_counter())

    def update(self) -> None:
        """Update the numbers that are out of date, if it is time."""
        if self.waiting != 0.0:
            return
        page, arm = self._page, self._page.arm
        self._updated_at = time.perf_counter()
        with page.client.atomic():
            if self._pose_due:
                self._pose_due = False
                target = None if arm.open_target is None else arm.open_target[:3, 3]
                passes = arm.scene.show_contact(arm.scene.contact_at(arm.q), target)
                page.status.warn(" ".join(filter(None, (self._show_contacts(), passes))))
                self._show_pose(arm.now.T_tool, arm.open_target)
            if self._sliders_due:
                self._sliders_due = False
                page.joints.sliders.show(arm.goal, self._dragged)
                self._posture.show()

    def _show_contacts(self) -> str:
        """Paint what touches; returns the sentence about it, or ""."""
        page, contacts = self._page, self._page.arm.now.contacts_at(self._page.arm.q)
        page.arm.scene.colors.show(contacts)
        if contacts != self._contacts:
            self._contacts = contacts
            self._touched(contacts)
        return sentence(contacts, page.display.units)

    def _show_pose(self, tool: Array, target: Array | None) -> None:
        """Show the pose of the tool, and of a target that it has missed, in the frame of the read-out."""
        page, frames = self._page, self._page.display.frames
        if frames.shown != WORLD:
            T = inverse(frames.pose(page.arm.robot, page.arm.q))
            tool, target = T @ tool, None if target is None else T @ target
        self._panel.readout.show(tool, page.display.units, target, frames.shown, page.activity.withheld)
