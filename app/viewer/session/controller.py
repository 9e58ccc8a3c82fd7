"""One visitor: their arm, their panel, and the one thread that touches both.

Callbacks of the browser post into the inbox and return. The worker takes everything that is new, acts on it, and
sends one consistent picture. While the arm is in motion it wakes up for the next picture too; otherwise it
sleeps. Nothing here is locked, because nothing here is shared.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import viser

import kin
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.metrics import SOLVE_SECONDS
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.feature import Feature
from app.viewer.lessons import LESSONS
from app.viewer.panel import assign
from app.viewer.panel.joints import JointSliders, lock_notice
from app.viewer.panel.layout import Panel
from app.viewer.panel.lessons import LessonChoice
from app.viewer.panel.status import Notice, StatusLine
from app.viewer.panel.target import TASKS, default_task
from app.viewer.panel.view import ViewState, configure_theme
from app.viewer.scene import gizmo
from app.viewer.scene.arm import ArmScene
from app.viewer.scene.camera import Sphere, VisitorCamera
from app.viewer.scene.motion import Motion, Pace
from app.viewer.scene.offer import offered
from app.viewer.session.memory import Memory
from app.viewer.session.posture import Posture
from app.viewer.session.worker import Worker
from app.viewer.tabs import TABS
from kin import Robot, Task
from kin.transforms import Array, from_position_wxyz
from kin.units import DEFAULT_UNITS, Units

WELCOME = Notice("hand", "Ready", "Drag the gizmo at the tool, or move a joint.")
_ARMS = itertools.count(1)  # a name is never used twice: browsers keep the poses of removed nodes
BY_HAND = Notice("hand", "Moved by joints", "The target follows the tool.")


class Session(Worker):
    """The state of one visitor.

    What `Worker` promises may be called by any thread; everything else belongs to the worker. For its features it
    is the :class:`~app.viewer.feature.Stage`, for its memory the :class:`~app.viewer.session.memory.Page`.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        store: Store,
        clouds: Clouds,
        maps: Maps,
        summaries: Summaries,
        pace: Pace,
        token: bool = False,
        welcome: Notice = WELCOME,
        failed: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(client.client_id, failed)
        self.store = store
        self.clouds = clouds
        self.maps = maps
        self.summaries = summaries
        self._client = client
        self._pace = pace
        self._welcome = welcome
        self._memory = Memory(self, token, self._guard)
        self._rng = np.random.default_rng()
        self._units = DEFAULT_UNITS
        self.view = ViewState()
        self._dragging = False
        # The pose asked for with the gizmo, for as long as it is the arm's task; None: the gizmo follows the tool.
        self._target: Array | None = None
        self._reached = False
        # What the panel has yet to be told, and when it was told last.
        self._readout_due = self._sliders_due = False
        self._told_at = 0.0
        self._held: int | None = None
        self.locks: list[bool] = []
        self._tabs: list[Feature] = []
        self.lessons: LessonChoice | None = None
        # Made by the worker when it builds the page.
        self._robot: Robot
        self._task: Task
        self._motion: Motion
        self._q: Array  # in the picture
        self._scene: ArmScene
        self.camera: VisitorCamera
        self._panel: Panel
        self._status: StatusLine
        self._sliders: JointSliders
        self.posture: Posture

    # The stage of the features

    @property
    def client(self) -> viser.ClientHandle:
        return self._client

    @property
    def robot(self) -> Robot:
        return self._robot

    @property
    def task(self) -> Task:
        return self._task

    @property
    def goal(self) -> Array:
        return self._motion.goal

    @property
    def q(self) -> Array:
        return self._q

    @property
    def target(self) -> Array | None:
        return self._target

    @property
    def locked(self) -> tuple[float | None, ...] | None:
        if not any(self.locks):
            return None
        return tuple(x if shut else None for x, shut in zip(self.goal.tolist(), self.locks, strict=True))

    @property
    def branch(self) -> str | None:
        return self.posture.branch

    @property
    def units(self) -> Units:
        return self._units

    @property
    def dark(self) -> bool:
        return self.view.dark

    def go(self, q: Array, why: Notice | None = None, at_once: bool = False) -> None:
        """Head for a configuration, or be there at once, the gizmo following the tool."""
        self._target = None
        self._aim(q, ease=not at_once)
        self.posture.let_go()
        self._status.show(why or BY_HAND)

    def ask(self, T_base_tool: Array) -> None:
        """Answer a target as if the gizmo had been put there."""
        self._scene.place_gizmo(T_base_tool)
        self._solve(T_base_tool)

    def ask_again(self, T_base_tool: Array, q: Array | None) -> None:
        """Ask for a pose, and answer with the configuration it had, if that is as near to it."""
        self.ask(T_base_tool)
        if q is None or self._reached:
            return
        point = T_base_tool[:3, 3]
        near, now = (np.linalg.norm(kin.fk(self._robot, x)[:3, 3] - point) for x in (q, self._motion.goal))
        if near <= now + 1e-6:
            self._aim(q, ease=False)

    def require(self, task: Task) -> None:
        """Ask for this much of the target from now on."""
        self._panel.target.show(task)
        self._require(task)

    def unlock(self, joint: int | None = None) -> None:
        """Unlock a joint; None: all of them."""
        self._on_lock(joint, False)

    def lock(self, locks: Sequence[bool]) -> None:
        """Have exactly these joints ``(n,)`` locked."""
        self.locks = list(locks)
        self._sliders.show_locks(self.locks)
        self._ask_anew()

    def any_branch(self) -> None:
        """Let any branch take the target."""
        self.posture.choose(None)
        self._ask_anew()

    def tell(self, notice: Notice) -> None:
        """Show a notice in the status line."""
        self._status.show(notice)

    def make_room(self, room: Sequence[Sphere]) -> None:
        """Have the default view show these spheres too."""
        self.camera.make_room(room)

    @property
    def features(self) -> list[Feature]:
        lesson = self.lessons.shown if self.lessons is not None else None
        return [*self._tabs, lesson] if lesson is not None else self._tabs

    # The worker

    @property
    def _moving(self) -> bool:
        return hasattr(self, "_motion") and self._motion.moving

    @property
    def _rest(self) -> float | None:
        wishes = [feature.due for feature in self.features if feature.due is not None]
        if self._moving:
            wishes.append(self._pace.interval)
        elif self._memory.due is not None and not self._dragging:
            wishes.append(max(0.0, self._memory.due - time.perf_counter()))
        if self._readout_due or self._sliders_due:
            wishes.append(max(0.0, self._told_at + self._pace.reading - time.perf_counter()))
        return min(wishes, default=None)

    def _report(self, notice: Notice) -> None:
        self._status.show(notice)
        self._client.flush()

    def _leave(self) -> None:
        self._pace.moving(self._client.client_id, False)
        self._for_features(lambda feature: feature.on_leave())

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        with self._client.atomic():
            for key, value in batch:
                # Each on its own, so that one bad value does not take the others with it.
                self._guard(lambda key=key, value=value: self._handle(key, value))  # type: ignore[misc]
            self._draw(fresh=bool(batch))
            now = time.perf_counter()
            for feature in self.features:
                if feature.due is not None:
                    self._guard(lambda feature=feature: feature.tick(now))  # type: ignore[misc]
        self._client.flush()
        if time.perf_counter() - self._told_at >= self._pace.reading:
            self._tell_panel()
        if batch:
            self._memory.touch(now)
        elif not (self._moving or self._dragging) and self._memory.rested(now):
            self._guard(self._memory.keep)

    def _tell_panel(self) -> None:
        """Bring the numbers up to date: after the picture, as that takes longer than posing the joints."""
        if not (self._readout_due or self._sliders_due):
            return
        self._told_at = time.perf_counter()
        with self._client.atomic():
            if self._readout_due:
                self._readout_due = False
                self._panel.readout.show(kin.fk(self._robot, self._q), self._units)
            if self._sliders_due:
                self._sliders_due = False
                self._sliders.show(self._motion.goal, self._held)
                self.posture.show()

    def _handle(self, key: Hashable, value: object) -> None:
        match key:
            case "gizmo":
                self._on_gizmo(value)
            case ("joint", str(robot_id), int(index), Units() as units):
                # A late event of sliders that are already replaced says nothing about the present ones.
                if (robot_id, units) == (self._robot.id, self._units):
                    self._on_slider(index, value)
            case ("free", str(robot_id), str(name), Units() as units):
                if (robot_id, units) == (self._robot.id, self._units):
                    self._on_free(name, value)
            case ("lock", str(robot_id), index):
                if robot_id == self._robot.id:
                    self._on_lock(cast("int | None", index), bool(value))
            case ("branch", str(robot_id)):
                if robot_id == self._robot.id:
                    self._on_branch(value)
            case ("feature", str(name), wish):
                for feature in self.features:
                    if feature.key == name:
                        feature.handle(wish, value)
            case "lesson":
                assert self.lessons is not None
                self.lessons.choose(value)
            case "robot":
                self._on_robot(str(value))
            case "task":
                self._on_task(str(value))
            case "radians":
                self._on_units(replace(self._units, degrees=not value))
            case "lengths":
                self._on_units(replace(self._units, length=self._panel.units.read_length(value)))
            case "home":
                self.go(self._robot.q_home)
            case "random":
                self.go(self._robot.random_q(self._rng))
            case "recall":
                self.go(self._motion.goal)
            case "copy-as":
                self._panel.share.choose(value)
            case ("view", str(name)):
                self._on_view(name, bool(value))
            case "camera":
                self.camera.aim(self._scene.body)
            case "looked":
                pass  # where from is asked once the camera rests
            case _:
                raise KeyError(key)

    # What the visitor can do

    def _on_gizmo(self, value: object) -> None:
        phase, position, wxyz, ring = cast(gizmo.Pull, value)
        self._dragging = phase != "end"
        if phase == "start":
            return
        target = from_position_wxyz(position, wxyz)
        if ring:  # the rings hang on the gizmo, which stays as it is until the ring is let go
            target = self._scene.gizmo_pose @ target
        if self._target is None or not np.array_equal(target, self._target):
            self._solve(target)
        if ring and not self._dragging:
            self._scene.place_gizmo(target)

    def _on_slider(self, index: int, value: object) -> None:
        q = self._motion.goal.copy()
        q[index] = self._sliders.read(index, value)
        self._target = None
        self._aim(q, held=index)
        self.posture.let_go()
        self._status.show(BY_HAND)

    def _on_branch(self, value: object) -> None:
        """Take the same pose on another branch, and stay there."""
        self.posture.read(value)
        self._solve(kin.fk(self._robot, self._motion.goal) if self._target is None else self._target)
        self._for_features(lambda feature: feature.on_question())

    def _on_lock(self, joint: int | None, shut: bool) -> None:
        """Lock or unlock a joint, or all of them, where the arm is heading."""
        which = range(self._robot.n) if joint is None else (joint,)
        locks = [shut if i in which else before for i, before in enumerate(self.locks)]
        self._status.show(lock_notice(locks))
        self.lock(locks)

    def _ask_anew(self) -> None:
        """What is asked for was changed, not the target: answer it again."""
        if self._target is not None:
            self._solve(self._target)
        self.posture.show()
        self._for_features(lambda feature: feature.on_question())

    def _on_free(self, name: str, value: object) -> None:
        """Move what is free while the tool stays."""
        q, result = self.posture.move(name, value)
        self._status.answer(result, self._units)
        if q is not None:
            self._target = None
            self._aim(q)

    def _on_robot(self, name: str) -> None:
        robot = next((r for r in self.store.robots if r.name == name), None)
        if robot is None:
            assign(self._panel.robot, self._robot.name)
            robot = self.store.get(name)  # raises with the list of valid ones
        if robot == self._robot:
            return
        self._sliders.remove()
        self.posture.remove()
        self._scene.remove()
        self._use(robot)
        self._status.show(Notice("hand", robot.name, robot.description))
        self._for_features(lambda feature: feature.on_robot())

    def _on_task(self, name: str) -> None:
        if name not in TASKS:
            self._panel.target.show(self._task)
            raise kin.InputError("task", name, "one of " + ", ".join(TASKS))
        self._require(TASKS[name])

    def _require(self, task: Task) -> None:
        self._task = task
        self._offer_gizmo()
        self._ask_anew()

    def _on_units(self, units: Units) -> None:
        self._units = units
        self._status.use(units)
        self._sliders.remove()
        self._sliders = self._make_sliders()
        self.posture.show()
        self._readout_due = True
        self._for_features(lambda feature: feature.on_style())

    def _for_features(self, act: Callable[[Feature], None]) -> None:
        """Let every feature act; the error of one does not keep the others from it."""
        for feature in self.features:
            self._guard(lambda feature=feature: act(feature))  # type: ignore[misc]

    def _on_view(self, name: str, value: bool) -> None:
        setattr(self.view, name, value)
        if name == "dark":
            configure_theme(self._client.gui, value)
            self._for_features(lambda feature: feature.on_style())
        self._apply_view()

    def _solve(self, T: Array) -> None:
        """Answer the gizmo's target: seed with where the arm is heading, so that it stays on its branch."""
        target = T[:3, 3] if self._task == "position" else T
        with SOLVE_SECONDS.labels("viewer").time():
            result = kin.solve_ik(
                self._robot, target, task=self._task, q_seed=self._motion.goal, locked=self.locked,
                branch=self.branch,
            )  # fmt: skip
        self._target = T
        if result.best is not None:
            self._aim(result.best.q)
        self.posture.answered(result)
        self._reached = result.status == "solved"
        self._status.answer(result, self._units)
        self._for_features(lambda feature: feature.on_answer(result))

    def _aim(self, q: Array, held: int | None = None, ease: bool = True) -> None:
        """Head for a configuration; the sliders follow, but for the one in the visitor's hand."""
        self._motion.aim(q, time.perf_counter(), ease and self._pace.eases)
        self._sliders_due, self._held = True, held

    # What the visitor sees

    def _build(self) -> None:
        gui = self._client.gui
        saved = self._memory.recall()
        self._units, self.view = saved.units, saved.view
        robot = self.store.get(saved.robot) if saved.robot is not None else self.store.robots[0]
        with self._client.atomic():
            if self.view.dark:
                configure_theme(gui, True)
            self.camera = VisitorCamera(self._client, self.post)
            if not self.camera.sheet:
                gui.main_panel.dock_right()
            titles = [tab.title for tab in TABS]
            self._panel = Panel(
                gui, self.store.robots, robot, self._units, self.view, self._welcome, bool(LESSONS), titles,
                self.post,
            )  # fmt: skip
            self._status = self._panel.status
            self.posture = Posture(self, self._panel.posture, self.post)
            self._use(robot, saved.q)
            if self._panel.learn is not None:
                self.lessons = LessonChoice(gui, self._panel.learn, self, self.post)
            for tab, place in zip(TABS, self._panel.tabs, strict=True):
                with place:
                    self._tabs.append(tab(self))
            self._memory.restore(saved)
            self._draw(fresh=False)
            self._memory.begin(self._panel.share)
        self._client.flush()

    def _use(self, robot: Robot, q: Array | None = None) -> None:
        """Show another robot, at home or at a configuration ``(n,)``, in a fitting view."""
        self._robot = robot
        self._target = None
        self._dragging = False
        self._readout_due = True
        weights = np.where(robot.revolute, 1.0, 4.0)
        self._motion = Motion(robot.q_home if q is None else q, weights)
        self._q = self._motion.goal
        self.locks = [False] * robot.n
        self._scene = ArmScene(self._client.scene, robot, self.view.dark, f"/arm-{next(_ARMS)}")
        self._task = default_task(robot)
        self._panel.target.show(self._task)
        gizmo.listen(self._scene.gizmo, ring=False, post=self.post)
        self._offer_gizmo()
        self._sliders = self._make_sliders()
        self.posture.use()
        self._apply_view()
        self.camera.aim(self._scene.body)

    def _make_sliders(self) -> JointSliders:
        return JointSliders(
            self._client.gui, self._panel.joints, self._robot, self._motion.goal, self.locks, self._units,
            self.post,
        )  # fmt: skip

    def _offer_gizmo(self) -> None:
        """A gizmo with what the arm can follow in this task."""
        for ring in self._scene.offer(offered(self._robot, self._task)):
            gizmo.listen(ring, ring=True, post=self.post)

    def _apply_view(self) -> None:
        self._scene.show_frames(self.view.frames)
        self._scene.show_labels(self.view.labels)
        self._scene.show_axes(self.view.axes)
        self._scene.use_dark(self.view.dark)

    def _draw(self, fresh: bool) -> None:
        """Send the picture of this moment."""
        now = time.perf_counter()
        # The first picture after an event already shows motion: half a frame of waiting would be felt as lag.
        q = self._motion.at(now + self._pace.interval if fresh else now)
        arrived = not self._motion.moving
        self._pace.moving(self._client.client_id, self._dragging or not arrived)
        T = kin.fk(self._robot, q)
        self._scene.show(q)
        if not np.array_equal(q, self._q):
            self._q = q
            self._readout_due = True
            self._for_features(lambda feature: feature.on_picture(T))
        if self._target is None:
            if not self._dragging:
                self._scene.place_gizmo(T)
            self._scene.show_gap(T[:3, 3], None)
        elif arrived and self._reached and not self._dragging:
            # A task that leaves something free is done: from here on the target is where the tool really is.
            self._target = None
            self._scene.place_gizmo(T)
            self._scene.show_gap(T[:3, 3], None)
        else:
            target = self._target[:3, 3]
            far = float(np.linalg.norm(T[:3, 3] - target)) > 5e-4 and not self._reached
            self._scene.show_gap(T[:3, 3], target if far else None)
