"""What the controller of an arm reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from app.viewer.panel.status import Notice
from kin import IKResult
from kin.transforms import Array


class ArmListener(Protocol):
    """Receives the controller's reports, on the worker's thread."""

    def on_pose(self) -> None:
        """The scene shows another configuration, or what is around it has changed."""

    def on_goal(self, dragged: int | None) -> None:
        """The arm is heading elsewhere; `dragged` is the index of the joint whose slider the visitor holds."""

    def on_move(self, notice: Notice, at_once: bool) -> None:
        """The arm is heading for given joint values, `at_once` without easing; `notice` says why."""

    def on_gripper(self) -> None:
        """The gripper was opened or closed by something other than its slider."""

    def on_drag(self, start: Array, target: Array | None) -> None:
        """The visitor drags the target from one pose ``(4, 4)`` to another; None: it is released."""

    def on_result(self, result: IKResult) -> None:
        """Inverse kinematics was solved for a target."""

    def on_lock(self, locks: Sequence[bool]) -> None:
        """Somebody locks or unlocks joints, after which exactly these ``(n,)`` are locked."""

    def on_request(self) -> None:
        """The task, the requested branch, or the locked joints changed."""

    def on_branch(self, branch: str | None) -> None:
        """The requested branch was changed by something other than the visitor's choice in the panel."""
