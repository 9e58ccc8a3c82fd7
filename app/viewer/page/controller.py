"""The controller of one visitor's arm: robot, configuration, target, task, locked joints, and inverse kinematics.

The controller owns the arm in the scene and the gizmo. It knows neither the panel nor the status line: what the
rest of the page must know or say, it reports to an :class:`~app.viewer.page.listener.ArmListener`.

Two configurations are kept apart. `goal` is where the arm is heading: every answer of inverse kinematics and every
slider sets it at once, and it is the seed of the next solve. `q` is what the scene shows: it eases towards the
goal.

The target is either a pose set with the gizmo (`target`), or it follows the tool (`target` is None). A reached
target goes back to following the tool once the arm has arrived.
"""

from __future__ import annotations

import itertools
import operator
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import viser

import kin
from app.shared.metrics import SOLVE_SECONDS
from app.viewer.arm import DEFAULT_TASK, Arm
from app.viewer.page.listener import ArmListener
from app.viewer.panel import Post
from app.viewer.panel.status import BY_HAND, Notice
from app.viewer.scene import gizmo
from app.viewer.scene.arm.arm_scene import ArmScene
from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.gizmo_axes import NO_AXES, gizmo_axes
from app.viewer.scene.motion import Motion, Pace
from kin import Obstacle, Robot
from kin.differential.metric import weights
from kin.ik import Task, solve
from kin.transforms import Array, rotation_angle, rotation_from_wxyz

# A node name is never used twice: browsers keep the poses of removed nodes.
_ARMS = itertools.count(1)
# Random configurations that are looked at for one clear of pedestal and floor; up to 60 % of an arm's are not.
RANDOM_DRAWS = 50
# A target closer to the tool than this (m) gets no connecting line.
_GAP = 5e-4
_NOT_FOLLOWED = 0.9  # of a step: if the tool is so far behind, it has not followed


def _gap(one: Array, other: Array, turned: bool) -> float:
    """The distance (m) of two poses ``(4, 4)`` or, if `turned`, the angle (rad) between them."""
    if turned:
        return rotation_angle(one[:3, :3], other[:3, :3])
    return float(np.linalg.norm(one[:3, 3] - other[:3, 3]))


class ArmController:
    """The arm of one visitor. Not thread-safe: the visitor's worker calls it.

    Call `use` before anything else.

    Args:
        draggable: whether the gizmo has arrows and rings.

    Attributes:
        robot: the selected robot.
        task: how much of the target pose the arm must match.
        branch: the requested branch, as `kin.IKOptions` takes it.
        locks: whether each joint ``(n,)`` is locked.
        q: the configuration ``(n,)`` shown in the scene.
        target: the target pose ``(4, 4)``; None while the target follows the tool.
        dragging: whether the visitor holds the gizmo.
        playing: whether a feature moves the arm frame by frame.
        snap: whether the gizmo is dragged in fixed steps.
        avoid: whether targets are solved so that the arm touches neither itself nor an obstacle.
        obstacles: those that the visitor has placed.
        scene: the arm's nodes.
    """

    robot: Robot
    scene: ArmScene
    q: Array
    _motion: Motion

    def __init__(
        self, client: viser.ClientHandle, pace: Pace, post: Post, listener: ArmListener, draggable: bool
    ) -> None:
        self._client = client
        self._pace = pace
        self._post = post
        self._listener = listener
        self._draggable = draggable
        self._rng = np.random.default_rng()
        self._reached = False
        self.task: Task = DEFAULT_TASK
        self.branch: str | None = None
        self.locks: tuple[bool, ...] = ()
        self.target: Array | None = None
        self.dragging = False
        self._pulled = False  # since `show_gizmo_again`
        self.playing = False
        self.snap = False
        self.avoid = False
        self.obstacles: tuple[Obstacle, ...] = ()
        self._in_base = False
        self._parts: tuple[object, ...] | None = None  # of `_now`
        self._now: Arm
        self._drag_start: tuple[Array, Array] = np.eye(4), np.eye(3)  # target pose, gizmo orientation

    def use(
        self, robot: Robot, q: Array | None, dark: bool, base_axes: bool, drawn: Drawing | None = None
    ) -> None:
        """Show a robot with this body, at its home configuration or at `q` ``(n,)``.

        The nodes of the one before are not removed: they are those of `scene`.
        """
        self.robot = robot
        self.task = DEFAULT_TASK
        self.branch = None
        self.locks = (False,) * robot.n
        self.target = None
        self.dragging = self.playing = False
        self._motion = Motion(robot.q_home if q is None else q, weights(robot))
        self.q = self._motion.goal
        self.scene = ArmScene(self._client.scene, robot, dark, f"/arm-{next(_ARMS)}", drawn)
        self._in_base = self.scene.gizmo_in_base = base_axes
        gizmo.listen(self.scene.gizmo, ring=False, post=self._post)
        self._set_gizmo_axes()

    @property
    def goal(self) -> Array:
        """The configuration ``(n,)`` the arm is moving to, or has reached."""
        return self._motion.goal

    @property
    def open_target(self) -> Array | None:
        """The target ``(4, 4)`` that the tool will not have on arrival; None if there is none."""
        return None if self._reached and not self.dragging else self.target

    @property
    def moving(self) -> bool:
        """Whether the shown configuration is still on its way to the goal."""
        return self._motion.moving

    @property
    def now(self) -> Arm:
        """The arm as it is now; the same object, with what was computed from it, until something has changed."""
        parts = (
            self.robot,
            self.q,
            self.goal,
            self.target,
            self.task,
            self.branch,
            self.locks,
            self.obstacles,
            self.avoid,
        )
        # Nothing here is changed in place, so what is the same object has the same value.
        if self._parts is None or not all(map(operator.is_, parts, self._parts)):
            self._parts, self._now = parts, Arm(*parts)
        return self._now

    def use_obstacles(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take these obstacles. An arm that is at rest stays, whatever it touches: see `solve_again`."""
        if obstacles != self.obstacles:
            self.obstacles = obstacles
            self._surroundings_changed(self.avoid)

    def avoid_collisions(self, avoid: bool) -> None:
        """Solve targets with or without regard to self-collisions and obstacles."""
        if avoid != self.avoid:
            self.avoid = avoid
            self._surroundings_changed(True)

    def solve_again(self, renew: bool) -> None:
        """The visitor changed what is to be avoided: solve at the tool's pose if the arm touches something there.

        `renew`: solve in any case, because the page shows an answer of before. A target that is still open has
        been solved already. An arm that a feature moves is left alone.
        """
        if self.target is not None or self.dragging or self.playing:
            return
        if renew or (self.avoid and self.now.contacts_at(self.goal)):
            self._solve(self.now.T_goal)

    def _surroundings_changed(self, solve_again: bool) -> None:
        if solve_again:
            self._request_changed()
        self._listener.on_pose()

    # Motions

    def move_to(
        self, q: Array, notice: Notice | None = None, at_once: bool = False, dragged: int | None = None
    ) -> None:
        """Move to a configuration ``(n,)``; the target follows the tool, and the status shows `notice`.

        The motion is eased unless `at_once`: between two configurations, easing takes the tool off its target.
        """
        self.target = None
        self._head_for(q, not at_once, dragged)
        self._release_branch()
        self._listener.on_move(notice or BY_HAND, at_once)

    def random_q(self) -> Array:
        """A random configuration ``(n,)`` within the limits that is clear of pedestal and floor, if one is found.

        Locked joints stay where they are.
        """
        drawn = np.where(self.locks, self.goal, self.robot.random_q(self._rng, RANDOM_DRAWS))
        clear: Array = next((q for q in drawn if self.scene.contact_at(q) is None), drawn[0])
        return clear

    def move_joint(self, index: int, value: float, held: bool = True, notice: Notice | None = None) -> None:
        """Set one joint (rad or m); `held`: with its slider, which is not moved then."""
        q = self.goal.copy()
        q[index] = value
        self.move_to(q, notice, dragged=index if held else None)

    def slide_along(self, q: Array) -> None:
        """Move to a configuration ``(n,)`` of a self-motion: the branch stays, the target follows the tool."""
        self.target = None
        self._head_for(q)

    def follow(self, q: Array, target: Array | None) -> None:
        """Move to a configuration ``(n,)`` for a target ``(4, 4)`` that were solved in another page."""
        self.target = target
        if target is not None:
            self._reached = bool(np.linalg.norm(kin.fk(self.robot, q)[:3, 3] - target[:3, 3]) <= _GAP)
            self.scene.place_gizmo(target)
        self._head_for(q)

    def _head_for(self, q: Array, ease: bool = True, dragged: int | None = None) -> None:
        self._motion.aim(q, time.perf_counter(), ease and self._pace.eases)
        self._listener.on_goal(dragged)

    def _release_branch(self) -> None:
        """A joint moved by hand may leave the requested branch; the request is dropped then."""
        # Computed only if a branch was requested: an arm without a closed form has no branch names.
        if self.branch not in (None, "seed") and self.branch != kin.branch_of(self.robot, self.goal):
            self.set_branch(None)

    def restore(
        self, q: Array, target: Array | None, task: Task, branch: str | None, locks: Sequence[bool]
    ) -> None:
        """Return to an earlier state of this robot: configuration ``(n,)``, open target, and requests."""
        self.task, self.branch, self.locks, self.target = task, branch, tuple(locks), None
        self._set_gizmo_axes()
        self._listener.on_branch(branch)
        self._head_for(q)
        if target is not None:
            self.restore_target(target, q, ease=True)
        self._listener.on_request()

    # Targets

    def set_target(self, T: Array) -> None:
        """Make `T` ``(4, 4)`` the target, as if the gizmo had been dragged there."""
        self.scene.place_gizmo(T)
        self._solve(T)

    def nudge(self, axis: int, turn: bool, amount: float) -> None:
        """Move the target along (m), or turn it about (rad), one axis of the gizmo."""
        T = self.now.aim
        self.set_target(gizmo.nudged(T, axis, turn, amount, self._in_base))

    def jog(self, axis: int, turn: bool, amount: float, in_base: bool) -> bool:
        """Move the target along (m), or turn it about (rad), one axis of its own or of the base.

        Returns:
            False where nothing was done: the tool did not follow the step before, and would not follow this one.
        """
        T, tool = self.now.aim, self.now.T_goal
        wanted = gizmo.nudged(T, axis, turn, amount, in_base)
        before, after = (_gap(each, tool, turn) for each in (T, wanted))
        if min(before, after - before) > _NOT_FOLLOWED * abs(amount):
            return False
        self.set_target(wanted)
        return True

    def use_base_axes(self, in_base: bool) -> None:
        """Align the gizmo with the base, or with the tool."""
        self._in_base = self.scene.gizmo_in_base = in_base
        self._set_gizmo_axes()
        if not self.dragging:
            self._place_gizmo()

    def restore_target(self, T: Array, q: Array | None, ease: bool = False) -> None:
        """Set a saved target, and keep its saved configuration ``(n,)`` unless the new answer is closer to it."""
        self.set_target(T)
        if q is None or self._reached:
            return
        saved, solved = (np.linalg.norm(kin.fk(self.robot, x)[:3, 3] - T[:3, 3]) for x in (q, self.goal))
        if saved <= solved + 1e-6:
            self._head_for(q, ease)

    def pull(self, pull: gizmo.DragEvent) -> None:
        """Process one event of the gizmo, or of a ring attached to it."""
        phase, position, wxyz, ring = pull
        self._pulled, self.dragging = True, phase != "end"
        target = self.scene.pulled(position, wxyz, ring)
        if phase == "start":
            self._drag_start = (
                target,
                self.scene.gizmo_pose[:3, :3] if ring else rotation_from_wxyz(np.array(wxyz)),
            )
            return
        if self.snap:
            target = gizmo.snapped(target, *self._drag_start)
        self._listener.on_drag(self._drag_start[0], target if self.dragging else None)
        if self.target is None or not np.array_equal(target, self.target):
            self._solve(target)
        if not self.dragging and (ring or self.snap or self._in_base):
            self.scene.place_gizmo(target)

    @property
    def opening(self) -> float | None:
        """How far the gripper is open, from 0 (closed) to 1 (open); None: the arm has none that opens."""
        return self.scene.opened

    def open_gripper(self, opening: float) -> None:
        """Open the gripper so far, as if its slider were moved there."""
        if opening != self.scene.opened:  # else it would be news for a program
            self.scene.open_gripper(opening)
            self._listener.on_gripper()

    def set_task(self, task: Task) -> None:
        """Change how much of the target pose the arm must match."""
        self.task = task
        self._set_gizmo_axes()
        self._request_changed()

    def set_locks(self, locks: Sequence[bool]) -> None:
        """Lock exactly these joints ``(n,)``."""
        self.locks = tuple(locks)
        self._request_changed()

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""
        joints = range(self.robot.n) if joint is None else (joint,)
        locks = tuple(lock if i in joints else before for i, before in enumerate(self.locks))
        self._listener.on_lock(locks)
        self.set_locks(locks)

    def set_branch(self, branch: str | None) -> None:
        """Request a branch from the next target on."""
        self.branch = branch
        self._listener.on_branch(branch)

    def switch_branch(self, branch: str | None) -> bool:
        """Request a branch and move to it, with the tool where its target is.

        False, and nothing changes, if the tool would have to leave a target that it has.
        """
        T = self.now.aim
        if self.open_target is None and branch is not None:
            target = T[:3, 3] if self.task == "position" else T
            if solve(self.robot, target, replace(self.now.options, branch=branch), self.goal).status != "solved":
                self._listener.on_branch(self.branch)
                return False
        self.branch = branch
        self._solve(T)
        return True

    def allow_any_branch(self) -> None:
        """Drop the request for a branch, and solve again."""
        self.set_branch(None)
        self._request_changed()

    def _request_changed(self) -> None:
        """Solve the same target again after a change of task, branch or locks."""
        if self.target is not None:
            self._solve(self.target)
        self._listener.on_request()

    def _solve(self, T: Array) -> None:
        """Solve for a target, seeded with the goal so that the arm stays on its branch."""
        target = T[:3, 3] if self.task == "position" else T
        with SOLVE_SECONDS.labels("viewer").time():
            result = solve(self.robot, target, self.now.options, self.goal)
        self.target = T
        if result.best is not None:
            self._head_for(result.best.q)
        self._reached = result.status == "solved"
        self._listener.on_result(result)

    # The scene

    def draw(self, fresh: bool) -> None:
        """Update the scene to the present moment; `fresh`: an event was just processed."""
        now = time.perf_counter()
        # The first frame after an event already shows motion: waiting half a frame would be felt as lag.
        q = self._motion.at(now + self._pace.interval if fresh else now)
        arrived = not self._motion.moving
        self._pace.moving(self._client.client_id, self.dragging or self.playing or not arrived)
        self.scene.show(q)
        if not np.array_equal(q, self.q):
            self.q = q
            self._listener.on_pose()
        if self.target is not None and arrived and self._reached and not self.dragging:
            # A task that leaves some motion open is complete: the target now is where the tool really is.
            self.target = None
        tool, target = self.now.T_tool[:3, 3], None if self.target is None else self.target[:3, 3]
        if target is None and not self.dragging:
            self._place_gizmo()
        missed = target is not None and not self._reached and float(np.linalg.norm(tool - target)) > _GAP
        self.scene.show_gap(tool, target if missed else None)

    def _place_gizmo(self, again: bool = False) -> None:
        """Place the gizmo at the target, or at the tool if the target follows it."""
        self.scene.place_gizmo(self.now.T_tool if self.target is None else self.target, again)

    def show_gizmo_again(self) -> None:
        """Send the gizmo's pose once more after a drag, now that the visitor rests.

        The page shows what came last, and a pose of ours may have come to it after the poses of the drag.
        """
        if self._pulled and not self.dragging:
            self._pulled = False
            self._place_gizmo(again=True)

    def leave(self) -> None:
        """The visitor has disconnected: stop counting as a moving arm."""
        self._pace.moving(self._client.client_id, False)

    def _set_gizmo_axes(self) -> None:
        """Give the gizmo the arrows and rings that the arm can follow in this task."""
        axes = gizmo_axes(self.robot, self.task, self._in_base) if self._draggable else NO_AXES
        for ring in self.scene.set_gizmo_axes(axes):
            gizmo.listen(ring, ring=True, post=self._post)
