"""The robot on show: one of the service's, or the visitor's own arm, which changes while it is on show."""

from __future__ import annotations

from collections.abc import Callable

from app.shared.store import Store
from app.viewer.own_arm import OwnArm
from app.viewer.page.controller import ArmController
from kin import Robot
from kin.transforms import Array


class Robots:
    """The robots of one page. Not thread-safe: the visitor's worker calls it.

    Args:
        change: shows a robot at a configuration ``(n,)``, None: home; and whether it is an edited version of the
            arm on show, whose viewpoint stays.

    Attributes:
        own: the visitor's own arm, whether or not it is on show.
    """

    def __init__(
        self, store: Store, arm: ArmController, change: Callable[[Robot, Array | None, bool], None]
    ) -> None:
        self._store, self._arm, self._change = store, arm, change
        self.own: OwnArm | None = None

    def get(self, robot_id: str | None) -> Robot:
        """The robot with this id, which may be that of the visitor's own; None: the first one of the service."""
        if self.own is not None and self.own.robot.id == robot_id:
            return self.own.robot
        return self._store.robots[0] if robot_id is None else self._store.get(robot_id)

    def show(self, robot: Robot, q: Array | None = None) -> None:
        """Show a robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""
        self._change(robot, q, False)

    def show_own(self, own: OwnArm) -> None:
        """Show an arm of the visitor's own, at its home configuration."""
        self.own = own
        self.show(own.robot)

    def edit(self, own: OwnArm) -> None:
        """Show a changed version of the arm on show as the visitor's own.

        Viewpoint, task and a target that is not reached stay; configuration and locks do if it has as many joints
        of the same kinds.
        """
        arm, before, robot = self._arm, self._arm.now, own.robot
        target = arm.open_target
        alike = [joint.kind for joint in before.robot.joints] == [joint.kind for joint in robot.joints]
        self.own = own
        self._change(robot, robot.clip(before.goal) if alike else None, True)
        if before.task != arm.task:
            arm.set_task(before.task)
        if alike and any(before.locks):
            arm.set_locks(before.locks)
        if target is not None:
            arm.restore_target(target, arm.goal, ease=True)

    def discard_own(self) -> None:
        """Delete the visitor's own arm, and show the robot it was made from."""
        own, self.own = self.own, None
        if own is not None:
            self.show(next((r for r in self._store.robots if r.id == own.start), self._store.robots[0]))
