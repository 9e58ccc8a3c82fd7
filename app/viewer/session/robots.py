"""The robot on show: one of the service's, or the visitor's own arm, which changes while it is on show."""

from __future__ import annotations

from app.viewer.arm import Arm
from app.viewer.own_arm import OwnArm
from app.viewer.panel.status import StatusLine
from app.viewer.session.controller import ArmController
from app.viewer.session.parts import Page
from kin import Obstacle, Robot
from kin.transforms import Array


class ShownArm:
    """What features may read of the arm on show, and do with it; see `app.viewer.feature.Stage`."""

    arm: ArmController
    status: StatusLine

    @property
    def now(self) -> Arm:
        return self.arm.now

    def play(self, on: bool) -> None:
        self.arm.playing = on

    def set_target(self, T_base_tool: Array) -> None:
        self.arm.set_target(T_base_tool)

    def allow_any_branch(self) -> None:
        self.arm.allow_any_branch()

    def see_through(self, on: bool, gizmo: bool = False) -> None:
        self.arm.scene.see_through(on, gizmo)

    def use_obstacles(self, obstacles: tuple[Obstacle, ...]) -> None:
        self.arm.use_obstacles(obstacles)

    def solve_again(self) -> None:
        self.arm.solve_again(self.status.shows_result)


def robot_of(page: Page, robot_id: str | None) -> Robot:
    """The robot with this id, which may be that of the visitor's own; None: the first one of the service."""
    if page.own is not None and page.own.robot.id == robot_id:
        return page.own.robot
    return page.store.robots[0] if robot_id is None else page.store.get(robot_id)


def discard_own(page: Page) -> OwnArm | None:
    """Delete the visitor's own arm, and show the robot it was made from; returns it."""
    own, page.own = page.own, None
    if own is not None:
        page.change_robot(next((r for r in page.store.robots if r.id == own.start), page.store.robots[0]))
    return own


def edit(page: Page, own: OwnArm) -> None:
    """Show a changed version of the arm on show.

    Viewpoint, task and a target that is not reached stay; configuration and locks do if it has as many joints of
    the same kinds.
    """
    robot, q, task, locks, viewpoint = own.robot, page.now.goal, page.now.task, page.arm.locks, page.camera.chosen
    target = page.arm.open_target
    alike = [joint.kind for joint in page.now.robot.joints] == [joint.kind for joint in robot.joints]
    page.own = own
    page.change_robot(robot, robot.clip(q) if alike else None, glide=True)
    if viewpoint is not None:
        page.camera.restore(viewpoint)
    if task != page.now.task:
        page.set_task(task)
    if alike and any(locks):
        page.set_locks(locks)
    if target is not None:
        page.arm.restore_target(target, page.now.goal, ease=True)
