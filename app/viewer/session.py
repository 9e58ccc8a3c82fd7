"""One visitor: their arm, their panel, and the one thread that touches both.

Callbacks of the browser post into the inbox and return. The worker takes everything that is new, acts on it, and
sends one consistent picture. While the arm is in motion it wakes up for the next picture too; otherwise it
sleeps. Nothing here is locked, because nothing here is shared.
"""

from __future__ import annotations

import itertools
import logging
import threading
import time
from collections.abc import Callable, Hashable
from typing import cast

import numpy as np
import viser

import kin
from app.clouds import Clouds
from app.maps import Maps
from app.metrics import SOLVE_SECONDS
from app.snippets import LOCAL, Moment
from app.store import Store
from app.viewer import camera
from app.viewer.feature import Feature
from app.viewer.inbox import Inbox
from app.viewer.lessons import LESSONS
from app.viewer.motion import Motion, Pace
from app.viewer.offer import offered
from app.viewer.panel import assign, listen, listen_click
from app.viewer.panel.joints import JointSliders
from app.viewer.panel.lessons import LessonChoice
from app.viewer.panel.posture import BranchChoice, FreeSliders
from app.viewer.panel.readout import PoseReadout
from app.viewer.panel.share import SharePanel
from app.viewer.panel.status import Notice, StatusLine, notice
from app.viewer.panel.target import TASKS, TargetChoice, default_task
from app.viewer.panel.view import ViewOptions, ViewState, configure_theme
from app.viewer.scene import ArmScene
from app.viewer.selfmotion import self_motion
from app.viewer.state import KEY, PageMemory, PageState, decode, encode, read_memory
from app.viewer.tabs import TABS
from kin import Robot, Task
from kin.transforms import Array, from_position_wxyz

log = logging.getLogger(__name__)

KEEP_AFTER = 0.5  # seconds of rest before the page is told what to remember
ANSWER_WITHIN = 10.0  # seconds for the page to tell what it remembers; it may still be busy starting
NARROW = 700  # pixels
# Phase (start, update, end), position (m) and wxyz of the gizmo, and whether it is one of its rings.
GizmoEvent = tuple[str, list[float], list[float], bool]
WELCOME = Notice("hand", "Ready", "Drag the gizmo at the tool, or move a joint.")
_ARMS = itertools.count(1)  # a name is never used twice: browsers keep the poses of removed nodes
BY_HAND = Notice("hand", "Moved by joints", "The target follows the tool.")


class Session:
    """The state of one visitor.

    `start`, `post`, `end` and `join` may be called by any thread; everything else belongs to the worker, which
    says good-bye with `failed` if it cannot go on. For its
    features it is the :class:`~app.viewer.feature.Stage`.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        store: Store,
        clouds: Clouds,
        maps: Maps,
        pace: Pace,
        token: bool = False,
        welcome: Notice = WELCOME,
        failed: Callable[[], None] | None = None,
    ) -> None:
        self.store = store
        self.clouds = clouds
        self.maps = maps
        self._client = client
        self._pace = pace
        self._token = token  # whether programs have to send one
        self._welcome = welcome
        self._failed = failed
        self._inbox = Inbox()
        self._thread = threading.Thread(target=self._run, name=f"visitor-{client.client_id}", daemon=True)
        self._rng = np.random.default_rng()
        self._degrees = True
        self._view = ViewState()
        self._dragging = False
        # The pose asked for with the gizmo, for as long as it is the arm's task; None: the gizmo follows the tool.
        self._target: Array | None = None
        self._reached = False
        # What the panel has yet to be told, and when it was told last.
        self._readout_due = self._sliders_due = False
        self._told_at = 0.0
        self._held: int | None = None
        self._branch: str | None = None  # as solve_ik takes it
        self._held_free: str | None = None
        self._locks: list[bool] = []
        self._sheet = False
        self._address = LOCAL
        self._kept = ""
        self._keep_at: float | None = None
        self._tabs: list[Feature] = []
        self._lessons: LessonChoice | None = None
        # Made by the worker when it builds the page.
        self._robot: Robot
        self._task: Task
        self._motion: Motion
        self._q: Array  # in the picture
        self._scene: ArmScene
        self._status: StatusLine
        self._readout: PoseReadout
        self._robot_choice: viser.GuiDropdownHandle[str]
        self._joint_folder: viser.GuiFolderHandle
        self._sliders: JointSliders
        self._target_choice: TargetChoice
        self._posture_folder: viser.GuiFolderHandle
        self._branch_choice: BranchChoice
        self._free: FreeSliders
        self._share: SharePanel

    def start(self) -> None:
        """Build the visitor's page and begin to answer."""
        self._thread.start()

    def post(self, key: Hashable, value: object = None) -> None:
        """Tell the worker that the visitor did something."""
        self._inbox.post(key, value)

    def end(self) -> None:
        """Let the worker finish."""
        self._inbox.close()

    def join(self, timeout: float | None = None) -> bool:
        """Wait for the worker to finish; whether it did."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

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
        if not any(self._locks):
            return None
        return tuple(x if shut else None for x, shut in zip(self.goal.tolist(), self._locks, strict=True))

    @property
    def branch(self) -> str | None:
        return self._branch

    @property
    def degrees(self) -> bool:
        return self._degrees

    @property
    def dark(self) -> bool:
        return self._view.dark

    def go(self, q: Array, why: Notice | None = None, at_once: bool = False) -> None:
        """Head for a configuration, or be there at once, the gizmo following the tool."""
        self._target = None
        self._aim(q, ease=not at_once)
        self._let_go_of_branch()
        self._status.show(why or BY_HAND)

    def ask(self, T_base_tool: Array) -> None:
        """Answer a target as if the gizmo had been put there."""
        self._scene.place_gizmo(T_base_tool)
        self._solve(T_base_tool)

    def require(self, task: Task) -> None:
        """Ask for this much of the target from now on."""
        self._target_choice.show(task)
        self._require(task)

    def unlock(self, joint: int | None = None) -> None:
        """Unlock a joint; None: all of them."""
        self._on_lock(joint, False)

    def any_branch(self) -> None:
        """Let any branch take the target."""
        self._branch_choice.choose(None)
        self._branch = None
        self._ask_anew()

    def tell(self, notice: Notice) -> None:
        """Show a notice in the status line."""
        self._status.show(notice)

    @property
    def _features(self) -> list[Feature]:
        lesson = self._lessons.shown if self._lessons is not None else None
        return [*self._tabs, lesson] if lesson is not None else self._tabs

    # The worker

    def _run(self) -> None:
        try:
            self._build()
            while (batch := self._inbox.take(self._rest)) is not None:
                self._guard(lambda batch=batch: self._step(batch))  # type: ignore[misc]
        except BaseException:
            gone = self._inbox.closed
            self._inbox.close()
            log.log(logging.DEBUG if gone else logging.ERROR, "a visitor's worker failed", exc_info=True)
            if self._failed is not None and not gone:
                self._failed()
        finally:
            self._pace.moving(self._client.client_id, False)
            self._for_features(lambda feature: feature.on_leave())

    @property
    def _moving(self) -> bool:
        return hasattr(self, "_motion") and self._motion.moving

    @property
    def _rest(self) -> float | None:
        """Seconds the worker may sleep if nothing happens."""
        wishes = [feature.due for feature in self._features if feature.due is not None]
        if self._moving:
            wishes.append(self._pace.interval)
        elif self._keep_at is not None and not self._dragging:
            wishes.append(max(0.0, self._keep_at - time.perf_counter()))
        if self._readout_due or self._sliders_due:
            wishes.append(max(0.0, self._told_at + self._pace.reading - time.perf_counter()))
        return min(wishes, default=None)

    def _guard(self, act: Callable[[], None]) -> None:
        """Run one step; an error is logged and shown, and the session lives on."""
        try:
            act()
        except Exception as error:
            if self._inbox.closed:
                log.debug("visitor %s left in mid-motion: %s", self._client.client_id, error)
                return
            log.exception("visitor %s", self._client.client_id)
            self._show_error(error)

    def _show_error(self, error: Exception) -> None:
        expected = isinstance(error, kin.KinematicsError)
        detail = str(error) if expected else f"{type(error).__name__}; the server's log has the details."
        try:
            self._status.show(Notice("error", "Not understood" if expected else "Something went wrong", detail))
            self._client.flush()
        except Exception:
            log.exception("visitor %s: the error could not be shown", self._client.client_id)

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        with self._client.atomic():
            for key, value in batch:
                # Each on its own, so that one bad value does not take the others with it.
                self._guard(lambda key=key, value=value: self._handle(key, value))  # type: ignore[misc]
            self._draw(fresh=bool(batch))
            now = time.perf_counter()
            for feature in self._features:
                if feature.due is not None:
                    self._guard(lambda feature=feature: feature.tick(now))  # type: ignore[misc]
        self._client.flush()
        if time.perf_counter() - self._told_at >= self._pace.reading:
            self._tell_panel()
        if batch:
            self._keep_at = now + KEEP_AFTER
        elif self._keep_at is not None and now >= self._keep_at and not (self._moving or self._dragging):
            self._keep_at = None
            self._guard(self._keep)

    def _tell_panel(self) -> None:
        """Bring the numbers up to date: after the picture, as that takes longer than posing the joints."""
        if not (self._readout_due or self._sliders_due):
            return
        self._told_at = time.perf_counter()
        with self._client.atomic():
            if self._readout_due:
                self._readout_due = False
                self._readout.show(kin.fk(self._robot, self._q), self._degrees)
            if self._sliders_due:
                self._sliders_due = False
                self._sliders.show(self._motion.goal, self._held)
                self._show_posture()

    def _handle(self, key: Hashable, value: object) -> None:
        match key:
            case "gizmo":
                self._on_gizmo(value)
            case ("joint", str(robot_id), int(index), bool(degrees)):
                # A late event of sliders that are already replaced says nothing about the present ones.
                if (robot_id, degrees) == (self._robot.id, self._degrees):
                    self._on_slider(index, value)
            case ("free", str(robot_id), str(name), bool(degrees)):
                if (robot_id, degrees) == (self._robot.id, self._degrees):
                    self._on_free(name, value)
            case ("lock", str(robot_id), index):
                if robot_id == self._robot.id:
                    self._on_lock(cast("int | None", index), bool(value))
            case ("branch", str(robot_id)):
                if robot_id == self._robot.id:
                    self._on_branch(value)
            case ("feature", str(name), wish):
                for feature in self._features:
                    if feature.key == name:
                        feature.handle(wish, value)
            case "lesson":
                assert self._lessons is not None
                self._lessons.choose(value)
            case "robot":
                self._on_robot(str(value))
            case "task":
                self._on_task(str(value))
            case "units":
                self._on_units(bool(value))
            case "home":
                self.go(self._robot.q_home)
            case "random":
                self.go(self._robot.random_q(self._rng))
            case "recall":
                self.go(self._motion.goal)
            case "copy-as":
                self._share.choose(value)
            case ("view", str(name)):
                self._on_view(name, bool(value))
            case "camera":
                camera.aim(self._client.camera, self._scene.body, self._sheet)
            case _:
                raise KeyError(key)

    # What the visitor can do

    def _on_gizmo(self, value: object) -> None:
        phase, position, wxyz, ring = cast(GizmoEvent, value)
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
        self._let_go_of_branch()
        self._status.show(BY_HAND)

    def _on_branch(self, value: object) -> None:
        """Take the same pose on another branch, and stay there."""
        self._branch = self._branch_choice.read(value)
        self._solve(kin.fk(self._robot, self._motion.goal) if self._target is None else self._target)
        self._for_features(lambda feature: feature.on_question())

    def _on_lock(self, joint: int | None, shut: bool) -> None:
        """Lock or unlock a joint, or all of them, where the arm is heading."""
        which = range(self._robot.n) if joint is None else (joint,)
        for i in which:
            self._locks[i] = shut
        self._sliders.show_locks(self._locks)
        numbers = [str(i + 1) for i, kept in enumerate(self._locks) if kept]
        if numbers:
            joints = "Joint " + numbers[0] if len(numbers) == 1 else "Joints " + ", ".join(numbers)
            detail = "A target leaves what is locked where it is; its slider still moves it."
            self._status.show(Notice("hand", f"{joints} locked", detail))
        else:
            self._status.show(Notice("hand", "No joint is locked", "Every joint may move to follow a target."))
        self._ask_anew()

    def _ask_anew(self) -> None:
        """What is asked for was changed, not the target: answer it again."""
        if self._target is not None:
            self._solve(self._target)
        self._show_posture()
        self._for_features(lambda feature: feature.on_question())

    def _on_free(self, name: str, value: object) -> None:
        """Move what is free while the tool stays; where the limits end, the arm stops and the status says why."""
        wanted = self._free.read(name, value)
        result = self._self_motion(name, wanted)
        if result.status != "solved":
            self._status.show(notice(result))
            ranges = [r.intervals for r in self._posture().redundancy if r.name == name]
            inside = [min(max(wanted, low), high) for low, high in (ranges[0] if ranges else ())]
            if not inside:
                return
            result = self._self_motion(name, min(inside, key=lambda v: abs(v - wanted)))
        else:
            self._status.show(notice(result))
        best = result.solutions[0] if result.solutions else None
        if best is not None:
            self._target = None
            self._held_free = name
            self._aim(best.q)

    def _self_motion(self, name: str, value: float) -> kin.IKResult:
        """The tool where it is with a free value set."""
        q = self._motion.goal
        return self_motion(self._robot, kin.fk(self._robot, q), self._task, q, self.locked, name, value)

    def _posture(self) -> kin.IKResult:
        """What is free where the arm is heading, on the branch it is on."""
        q = self._motion.goal
        seed = "seed" if kin.branch_names(self._robot) else None
        return kin.solve_ik(
            self._robot, kin.fk(self._robot, q), task=self._task, q_seed=q, locked=self.locked, branch=seed,
            max_solutions=1,
        )  # fmt: skip

    def _on_robot(self, name: str) -> None:
        robot = next((r for r in self.store.robots if r.name == name), None)
        if robot is None:
            assign(self._robot_choice, self._robot.name)
            robot = self.store.get(name)  # raises with the list of valid ones
        if robot == self._robot:
            return
        self._sliders.remove()
        self._branch_choice.remove()
        self._free.remove()
        self._scene.remove()
        self._use(robot)
        self._status.show(Notice("hand", robot.name, robot.description))
        self._for_features(lambda feature: feature.on_robot())

    def _on_task(self, name: str) -> None:
        if name not in TASKS:
            self._target_choice.show(self._task)
            raise kin.InputError("task", name, "one of " + ", ".join(TASKS))
        self._require(TASKS[name])

    def _require(self, task: Task) -> None:
        self._task = task
        self._offer_gizmo()
        self._ask_anew()

    def _on_units(self, radians: bool) -> None:
        self._degrees = not radians
        self._sliders.remove()
        self._sliders = self._make_sliders()
        self._show_posture()
        self._readout_due = True
        self._for_features(lambda feature: feature.on_style())

    def _for_features(self, act: Callable[[Feature], None]) -> None:
        """Let every feature act; the error of one does not keep the others from it."""
        for feature in self._features:
            self._guard(lambda feature=feature: act(feature))  # type: ignore[misc]

    def _on_view(self, name: str, value: bool) -> None:
        setattr(self._view, name, value)
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
                branch=self._branch,
            )  # fmt: skip
        self._target = T
        if result.best is not None:
            self._aim(result.best.q)
        self._reached = result.status == "solved"
        self._status.show(notice(result))
        self._for_features(lambda feature: feature.on_answer(result))

    def _let_go_of_branch(self) -> None:
        """A joint moved by hand may leave the branch that was chosen: from then on none is."""
        # Asked only where one was chosen: an arm without a closed form has no branches to name.
        if self._branch not in (None, "seed") and self._branch != kin.branch_of(self._robot, self._motion.goal):
            self._branch = None
            self._branch_choice.choose(None)

    def _aim(self, q: Array, held: int | None = None, ease: bool = True) -> None:
        """Head for a configuration; the sliders follow, but for the one in the visitor's hand."""
        self._motion.aim(q, time.perf_counter(), ease and self._pace.eases)
        self._sliders_due, self._held = True, held

    # What the visitor sees

    def _build(self) -> None:
        gui = self._client.gui
        memory = self._remembered()
        self._address = memory.address or LOCAL
        saved = decode(memory.state, self.store.robots)
        self._degrees, self._view = saved.degrees, saved.view
        with self._client.atomic():
            if self._view.dark:
                configure_theme(gui, True)
            # A phone shows the panel as a sheet from below. Asked once: a docked panel makes the picture narrower.
            self._sheet = self._client.camera.image_width < NARROW
            if not self._sheet:
                gui.main_panel.dock_right()
            robot = self.store.get(saved.robot) if saved.robot is not None else self.store.robots[0]
            self._task = default_task(robot)
            self._status = StatusLine(gui, self._welcome)
            names = tuple(r.name for r in self.store.robots)
            self._robot_choice = gui.add_dropdown("Robot", names, initial_value=robot.name)
            listen(self._robot_choice, self.post, "robot")
            self._readout = PoseReadout(gui, kin.fk(robot, robot.q_home), self._degrees)
            tabs = gui.add_tab_group()
            with tabs.add_tab("Move"):
                self._joint_folder = gui.add_folder("Joints")
                buttons = gui.add_button_group("Go to", ("Home", "Random"))
                listen_click(buttons, self.post, {"Home": "home", "Random": "random"})
                self._target_choice = TargetChoice(gui, self._task, self.post)
                self._posture_folder = gui.add_folder("Posture")
                self._free = FreeSliders(gui, self._posture_folder, self.post)
            learn = tabs.add_tab("Learn") if LESSONS else None
            places = [(tab, tabs.add_tab(tab.title)) for tab in TABS]
            with tabs.add_tab("View"):
                units = gui.add_checkbox("Radians", not self._degrees, hint="Angles in radians instead of degrees")
                listen(units, self.post, "units")
                ViewOptions(gui, self._view, self.post)
                with gui.add_folder("Share"):
                    self._share = SharePanel(gui, self.post)
            self._use(robot, saved.q)
            if learn is not None:
                self._lessons = LessonChoice(gui, learn, self, self.post)
            for tab, place in places:
                with place:
                    self._tabs.append(tab(self))
            self._restore(saved)
            self._draw(fresh=False)
            self._kept = encode(self._snapshot())
            self._offer()
        self._client.flush()

    # What the page remembers

    def _remembered(self) -> PageMemory:
        try:
            return read_memory(self._client.local_storage.get_item(KEY, timeout=ANSWER_WITHIN))
        except (RuntimeError, TimeoutError) as error:  # storage forbidden, page gone, no answer
            log.debug("visitor %s remembers nothing: %s", self._client.client_id, error)
            return PageMemory()

    def _restore(self, saved: PageState) -> None:
        """Set what a fresh page lacks; whatever cannot be set is told, and the rest is set all the same."""
        if saved.task is not None:
            self._task = saved.task
            self._target_choice.show(saved.task)
        if saved.branch is not None:
            self._branch = saved.branch
            self._branch_choice.choose(saved.branch)
        if saved.target is not None:
            self._guard(lambda: self._restore_target(cast(Array, saved.target), saved.q))
        lesson = next((lesson for lesson in LESSONS if lesson.key == saved.lesson), None)
        if self._lessons is not None and lesson is not None:
            self._guard(lambda: cast(LessonChoice, self._lessons).choose(lesson.title))
        for feature in self._features:
            if feature.key in saved.features:
                told = saved.features[feature.key]
                self._guard(lambda feature=feature, told=told: feature.restore(told))  # type: ignore[misc]
        if saved.missing:
            detail = f"There is no robot “{saved.missing}” here."
            self._status.show(Notice("error", "The link asks for another robot", detail))

    def _restore_target(self, T: Array, q: Array | None) -> None:
        """Ask for the pose again, and answer with the configuration it had, if that is as near to it."""
        self.ask(T)
        if q is None or self._reached:
            return
        near, now = (np.linalg.norm(kin.fk(self._robot, x)[:3, 3] - T[:3, 3]) for x in (q, self._motion.goal))
        if near <= now + 1e-6:
            self._aim(q, ease=False)

    def _snapshot(self) -> PageState:
        lesson = self._lessons.shown if self._lessons is not None else None
        told = {feature.key: feature.state() for feature in self._features}
        return PageState(
            robot=self._robot.id,
            q=self._motion.goal,
            target=self._target,
            task=self._task,
            branch=self._branch,
            lesson=None if lesson is None else lesson.key,
            degrees=self._degrees,
            view=self._view,
            features={key: state for key, state in told.items() if state},
        )

    def _keep(self) -> None:
        """Have the page remember how it is now."""
        text = encode(self._snapshot())
        if text != self._kept:
            self._kept = text
            self._client.local_storage.set_item(KEY, text)
            self._offer()
            self._client.flush()

    def _offer(self) -> None:
        q = self._motion.goal
        target = kin.fk(self._robot, q) if self._target is None else self._target
        moment = Moment(self._robot, q, target, self._task, self._address, self._token)
        self._share.show(f"{self._address}viewer/#s={self._kept}", moment)

    def _use(self, robot: Robot, q: Array | None = None) -> None:
        """Show another robot, at home or at a configuration ``(n,)``, in a fitting view."""
        self._robot = robot
        self._target = None
        self._dragging = False
        self._readout_due = True
        weights = np.where(robot.revolute, 1.0, 4.0)
        self._motion = Motion(robot.q_home if q is None else q, weights)
        self._q = self._motion.goal
        self._locks = [False] * robot.n
        self._scene = ArmScene(self._client.scene, robot, self._view.dark, f"/arm-{next(_ARMS)}")
        self._task = default_task(robot)
        self._target_choice.show(self._task)
        self._listen_gizmo(self._scene.gizmo, ring=False)
        self._offer_gizmo()
        self._sliders = self._make_sliders()
        self._branch = None
        with self._posture_folder:
            self._branch_choice = BranchChoice(self._client.gui, robot, self.post)
        self._show_posture()
        self._apply_view()
        camera.aim(self._client.camera, self._scene.body, self._sheet)

    def _show_posture(self) -> None:
        """The branch the arm is on, and what is free there."""
        found = self._posture()
        if kin.branch_names(self._robot):
            self._branch_choice.show(kin.branch_of(self._robot, self._motion.goal))
        self._free.show(found.redundancy, self._robot, self._degrees, self._held_free)
        self._held_free = None

    def _make_sliders(self) -> JointSliders:
        return JointSliders(
            self._client.gui, self._joint_folder, self._robot, self._motion.goal, self._locks, self._degrees,
            self.post,
        )  # fmt: skip

    def _offer_gizmo(self) -> None:
        """A gizmo with what the arm can follow in this task."""
        for ring in self._scene.offer(offered(self._robot, self._task)):
            self._listen_gizmo(ring, ring=True)

    def _listen_gizmo(self, handle: viser.TransformControlsHandle, ring: bool) -> None:
        @handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.client is not None:
                gizmo = event.target
                self.post("gizmo", (event.phase, gizmo.position.tolist(), gizmo.wxyz.tolist(), ring))

    def _apply_view(self) -> None:
        self._scene.show_frames(self._view.frames)
        self._scene.show_labels(self._view.labels)
        self._scene.show_axes(self._view.axes)
        self._scene.use_dark(self._view.dark)

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
