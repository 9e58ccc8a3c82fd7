"""One visitor's page: panel, status line, features, camera and saved state, driven by one worker thread.

Browser callbacks post events into the inbox and return. The worker takes all new events, processes them, and sends
one consistent update. While the arm moves it also wakes up for each frame. Nothing is shared or locked here.

The arm itself belongs to the :class:`~app.viewer.session.controller.ArmController`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from functools import partial

import numpy as np
import viser

import kin
from app.classroom.results.keys import result_key
from app.exports.snippets import Service
from app.live import Listener, reserved
from app.shared.security import Rights
from app.viewer import viser_names
from app.viewer.activity.activity import Activity
from app.viewer.feature import Feature
from app.viewer.frames import Frames
from app.viewer.labels import size_labels, text_factor
from app.viewer.live.feature import Connect
from app.viewer.meshes.bodies import Bodies
from app.viewer.obstacles.feature import ObstaclesFeature
from app.viewer.own_arm import OwnArm
from app.viewer.panel import update_html
from app.viewer.panel.fence import Fence
from app.viewer.panel.joints import JointSliders, lock_notice
from app.viewer.panel.layout import LEARN, Panel
from app.viewer.panel.part import bring_parts
from app.viewer.panel.script import Reply
from app.viewer.panel.status import READY, Notice, StatusLine
from app.viewer.panel.theme import configure_theme
from app.viewer.scene.camera import Sphere, VisitorCamera
from app.viewer.scene.chain import center_line
from app.viewer.session.actions.actions import Actions
from app.viewer.session.actions.typed import BY_HAND
from app.viewer.session.channel.channel import Channel
from app.viewer.session.channel.files import Files
from app.viewer.session.choices import ViewState
from app.viewer.session.controller import ArmController
from app.viewer.session.events import FENCE, name_of
from app.viewer.session.forms import Forms
from app.viewer.session.lessons import LessonChoice
from app.viewer.session.live import LiveInput
from app.viewer.session.looks import Looks
from app.viewer.session.numbers import Numbers
from app.viewer.session.palette import Palette
from app.viewer.session.persistence import Persistence
from app.viewer.session.posture import PosturePanel
from app.viewer.session.robots import ShownArm, discard_own, edit, robot_of
from app.viewer.session.services import Services
from app.viewer.session.state import PageState
from app.viewer.session.worker.worker import Worker
from app.viewer.step_out import StepOut
from app.viewer.tabs import TABS
from app.viewer.tabs.program.tab import ProgramTab
from app.viewer.tabs.robot.calibrate.feature import Calibrate
from app.viewer.tabs.robot.motors.feature import Motors
from app.viewer.tabs.robot.tab import RobotTab
from app.viewer.views.templates import render
from app.viewer.viser_outbox import in_one_frame
from app.viewer.viser_patches import SceneFilter, hear_marks
from kin import IKResult, Robot
from kin.ik import Task
from kin.transforms import Array
from kin.units import DEFAULT_UNITS

THICK = 2.5  # half the thickness of the widest housings, in thicknesses of the thickest link


class VisitorPage(ShownArm, Worker):
    """The page of one visitor; `offered` are its tabs between the arm's controls and the view's.

    The methods that `Worker` calls thread-safe may be called by any thread; everything else belongs to the worker.
    The page is the :class:`~app.viewer.feature.Stage` of its features, the listener of its arm's controller, and
    the :class:`~app.viewer.session.parts.Page` of its own parts.

    Args:
        token: whether programs must send an access token.
        failed: called last by a worker that cannot continue.
        rights: what the visitor may cause.
        address: the visitor's name in limits per client.

    Attributes:
        tabs: the features of the tabs, none until the page is built.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        services: Services,
        token: bool = False,
        welcome: Notice = READY,
        failed: Callable[[], None] | None = None,
        rights: Rights = Rights.FULL,
        address: str = "",
    ) -> None:
        super().__init__(client.client_id, failed)
        self.store, self.clouds = services.store, services.clouds
        self.maps, self.summaries = services.maps, services.summaries
        self.own: OwnArm | None = None
        self.meshes = services.meshes.of(address)
        self._library, self._services = services.library, services
        self.bodies = Bodies(services.library, lambda why: self.post("body", why))
        self.frames = Frames()
        self.arm = ArmController(client, services.pace, self.post, self)
        self.view, self.units, self.system_dark = ViewState(), DEFAULT_UNITS, False
        self.client, self._pace = client, services.pace
        self.channel = Channel(self.post, rights, viser_names.MARKS.is_there)
        hear_marks(client, self.channel.mark)
        self.fence = Fence(client, lambda: self.post(FENCE))
        client.gui.add_html(render("panel/channel", name=self.channel.name))
        bring_parts(client.gui, self.channel)
        self._welcome, self._looking, self.may_save = welcome, rights is Rights.LOOK, rights.save
        self.files = Files(self.post, lambda: self.features, self.meshes.memory, rights)
        self.door = Listener(services.lines, self.post, self._looking)
        self._persistence = Persistence(self, token, self._guard, rights)
        self.offered: tuple[type[Feature], ...] = TABS
        self.tabs: list[Feature] = []
        self._result: IKResult | None = None  # for the last target
        self._legend = ""
        self._alone: SceneFilter | None = None  # before all but what is shown alone
        self._palette: Palette | None = None
        # Created by the worker when it builds the page.
        self.camera: VisitorCamera
        self.posture: PosturePanel
        self.panel: Panel
        self.forms: Forms
        self.status: StatusLine
        self.sliders: JointSliders
        self._more_joints: viser.GuiFolderHandle | None = None
        self.numbers: Numbers
        self.lessons: LessonChoice
        self.activity = Activity(
            services.courses,
            partial(result_key, services.classroom),
            self._activity_changed,
        )
        self.looks = Looks(self)
        self.live = LiveInput(self)
        self.driven = ""  # what a program drives with the arm
        self._actions = Actions(self, self.live, self.looks)

    # Stage: what features may use

    @property
    def dark(self) -> bool:
        return self.system_dark if self.view.dark is None else self.view.dark

    @property
    def frame(self) -> float:
        return self._pace.interval

    @property
    def reading(self) -> float:
        return self._pace.reading

    def move_to(self, q: Array, notice: Notice | None = None, at_once: bool = False) -> None:
        self.arm.move_to(q, ease=not at_once)
        self.status.show(notice or BY_HAND)
        if at_once and not self.arm.playing and self._persistence.due is None:
            # A frame of a motion that goes on after its beginning was stored: no event tells of its end.
            self._actions.history.proceed()
            self._persistence.postpone(time.perf_counter())

    def show_own(self, own: OwnArm) -> None:
        self.own = own
        self.change_robot(own.robot)

    def edit_arm(self, own: OwnArm) -> None:
        edit(self, own)

    def discard_own(self) -> OwnArm | None:
        return discard_own(self)

    def redraw_body(self) -> None:
        self.looks.redraw_body()

    def use_frames(self, frames: Frames) -> None:
        self.frames = frames
        self.numbers.use_frames()
        self.for_features(lambda feature: feature.on_style())

    def set_task(self, task: Task) -> None:
        self.arm.set_task(task)
        self.forms.show()

    def unlock(self, joint: int | None = None) -> None:
        self.change_lock(joint, False)

    def notify(self, notice: Notice) -> None:
        self.status.show(notice)

    def show_legend(self, html: str) -> None:
        self._legend = html
        if self._alone is None:
            update_html(self.panel.legend, html)

    def show_alone(self, names: str, notice: Notice) -> None:
        self.show_all()
        self._alone = SceneFilter(self.client.scene, names)
        self.status.cover(notice)
        update_html(self.panel.legend, "")

    def show_all(self) -> None:
        if self._alone is not None:
            self._alone.open()
            self._alone = None
            self.status.cover(None)
            update_html(self.panel.legend, self._legend)

    def show_driven(self, name: str) -> None:
        self.driven = name
        self.channel.show("driven", name)

    def open_choice(self, title: str) -> None:
        self.lessons.choose(title)

    def show_joints(self, folder: viser.GuiFolderHandle | None) -> None:
        self._more_joints = folder
        self.renew_sliders()

    def fit_view(self, spheres: Sequence[Sphere], points: Array | None = None) -> None:
        self.camera.fit(spheres, points)

    def keep_in_view(self, target: Array | None = None, points: Array | None = None) -> None:
        self.camera.keep(kin.link_frames(self.now.robot, self.arm.goal)[:, :3, 3], target, points)

    def toward_camera(self) -> Array:
        return self.camera.toward

    @property
    def service(self) -> Service:
        return self._persistence.service

    @property
    def link(self) -> str:
        return self._persistence.link

    def link_to(self, features: dict[str, dict[str, object]], lesson: str) -> str:
        return self._persistence.link_to(features, lesson)

    # Page: what its parts may use besides

    @property
    def features(self) -> list[Feature]:
        """The tabs, and the open lesson with its steps."""
        return [*self.tabs, *self.lessons.features] if self.tabs else []

    def set_locks(self, locks: Sequence[bool]) -> None:
        """Lock exactly these joints ``(n,)``."""
        self.sliders.show_locks(locks)
        self.arm.set_locks(locks)

    def set_branch(self, branch: str) -> None:
        """Request a branch from the next target on."""
        self.arm.branch = branch
        self.posture.choose(branch)

    def change_robot(self, robot: Robot, q: Array | None = None, glide: bool = False) -> None:
        """Replace the robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""
        self.sliders.remove()
        self.posture.remove()
        self.arm.scene.remove()
        self.panel.robots.show(robot, self.own)
        self._use_robot(robot, q, glide)
        self.forms.show()
        self.for_features(lambda feature: feature.on_robot())

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""
        joints = range(self.arm.robot.n) if joint is None else (joint,)
        locks = [lock if i in joints else before for i, before in enumerate(self.arm.locks)]
        self.status.show(lock_notice(locks))
        self.set_locks(locks)

    def renew_sliders(self) -> None:
        """Make the sliders of the joints anew."""
        self.sliders.remove()
        self.sliders = self._make_sliders()

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""
        self.status.settle(None if self.arm.open_target is None else self._result, self.units)

    def put_back(self) -> None:
        """Show in all controls of the arm what is true."""
        self.numbers.use_goal(None)
        self.sliders.show_locks(self.arm.locks)
        self.panel.robots.show(self.arm.robot, self.own)
        self.forms.show()
        self.posture.choose(self.arm.branch)

    def refuse(self, key: Hashable, why: str) -> None:
        """Say why an event is not handled, and show in all controls of the arm what is true."""
        self.put_back()
        self.status.show(Notice("advice", "Not now", why))
        if isinstance(key, tuple) and key[0] == "message":
            self.channel.reply(Reply(int(key[2]), why))

    def snapshot(self) -> PageState:
        """The present state."""
        return self._persistence.snapshot()

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""
        for feature in self.features:
            self._guard(lambda feature=feature: action(feature))  # type: ignore[misc]

    def _tell(self, name: str, *args: object) -> None:
        """Call the method of this name of every feature that has one of its own; often, while an arm moves."""
        for feature in self.features:
            if getattr(type(feature), name) is not getattr(Feature, name):
                self._guard(partial(getattr(feature, name), *args))

    def _activity_changed(self) -> None:
        """Something else is open or withheld."""
        self.for_features(lambda feature: feature.on_activity())
        if self.tabs:
            self.posture.use_activity()
            self.numbers.use_pose()

    # Reports of the arm's controller

    def on_pose(self, T_base_tool: Array) -> None:
        self.numbers.use_pose()
        self._tell("on_pose", T_base_tool)

    def on_goal(self, dragged: int | None) -> None:
        self.numbers.use_goal(dragged)

    def on_drag(self, start: Array, target: Array | None) -> None:
        self.numbers.use_drag(start, target)

    def on_result(self, result: IKResult) -> None:
        self._result = result
        self.posture.use_result(result)
        self.status.show_result(result, self.units)
        self.numbers.use_result(result)
        self._tell("on_result", result)

    def on_request(self) -> None:
        self.posture.show()
        self.for_features(lambda feature: feature.on_request())

    def on_branch(self, branch: str | None) -> None:
        self.posture.choose(branch)

    def on_obstacles(self) -> None:
        self.for_features(lambda feature: feature.on_obstacles())

    @property
    def _timeout(self) -> float | None:
        times = [feature.due for feature in self.features if feature.due is not None]
        if self.arm.moving or self.camera.gliding:
            times.append(self._pace.interval)
        elif self._persistence.due is not None and not self.arm.dragging:
            times.append(max(0.0, self._persistence.due - time.perf_counter()))
        if (left := self.status.due(time.perf_counter())) is not None:
            times.append(left)
        if (left := self.numbers.waiting) is not None:
            times.append(left)
        return min(times, default=None)

    def _report(self, notice: Notice) -> None:
        self.status.show(notice)
        self.client.flush()

    def _leave(self) -> None:
        self.channel.close()
        self.arm.leave()
        self.for_features(lambda feature: feature.on_leave())

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        played = self.arm.playing
        numbers = (key[2] for key, _ in batch if isinstance(key, tuple) and key[0] == "message")
        with in_one_frame(self.client), self.channel.step(max(numbers, default=0)):
            with self.client.atomic():
                for key, value in batch:
                    # Guarded one by one, so that one bad value does not discard the others.
                    self._guard(lambda key=key, value=value: self._act(key, value))  # type: ignore[misc]
                self.arm.draw(fresh=bool(batch))
                if self.arm.target is None:
                    self.numbers.hide_target()
                now = time.perf_counter()
                if self.status.due(now) == 0.0:
                    self.settle_status()
                self.camera.tick(now)
                for feature in self.features:
                    if feature.due is not None:
                        self._guard(lambda feature=feature: feature.tick(now))  # type: ignore[misc]
                self.status.fail(next((feature.failure for feature in self.features if feature.failure), ""))
                self.status.offer("".join(feature.offer for feature in self.features))
                if batch:
                    self._renew_palette()
            if batch and self._persistence.urgent and not self._inbox.waits:  # what waits may open more
                self._save()  # in the same frame, so that nothing is on show that a reload would lose
            self.live.publish(self._result)
            self.client.flush()
            self.numbers.update()
        if not (self.arm.moving or self.arm.dragging or self.arm.playing):
            self.fence.ask()
        names = {name_of(key) for key, _ in batch} - {FENCE}
        acted = names - {"news"} or (played and not self.arm.playing)
        if acted or (names and self._persistence.due is None):  # news may never pause
            if self._persistence.postpone(now) and not self.arm.dragging:
                self._save()
        elif not (self.arm.moving or self.arm.dragging) and self._persistence.rested(now):
            self.camera.lead_back()
            self._save()
            self._show_hints()
            self.arm.show_gizmo_again()
            self.place_scale()

    def _save(self) -> None:
        self._guard(lambda: self._persistence.save(self._actions.history.take_key()))

    def _act(self, key: Hashable, value: object) -> None:
        self._actions.handle(key, value)

    def _show_hints(self) -> None:
        """Tell ``static/hints.js`` where gizmo and arm are in the picture.

        Of the gizmo: its place, and how long its arrows are there, 0 if it is hidden. Of the arm: how thick it is
        there, and the corners of its centre line. Who may only look gets no hints, and a hidden arm none.
        """
        place = arm = ""
        if not self._looking and self._alone is None:
            gizmo, shown = self.arm.scene.gizmo, self.arm.scene.body
            line = np.vstack([gizmo.position, shown.mount.foot, center_line(self.arm.robot, self.arm.goal)])
            (x, y, metre), *line = self.camera.places(line).tolist()
            place = _numbers(x, y, metre * gizmo.scale if gizmo.visible else 0.0)
            arm = _numbers(metre * THICK * shown.size, *(value for point in line for value in point[:2]))
        update_html(self.panel.hints, render("panel/hints", place=place, arm=arm))

    def _prepare(self) -> None:
        """Find out with what the page starts."""
        self._persistence.load()
        self.own = self._persistence.stored.own

    def _build(self) -> None:
        gui = self.client.gui
        saved = self._persistence.stored
        self.units, self.view, self.system_dark = saved.units, saved.view, self._persistence.system_dark
        self.activity.language = self.view.language
        size_labels(self.client.scene, text_factor(self._persistence.text_size))
        self.frames = saved.frames
        robot = robot_of(self, saved.robot)
        with self.client.atomic(), self.channel.step(0):
            if self.dark:
                configure_theme(gui, True)
            self.camera = VisitorCamera(self.client, self.post)
            self.numbers = Numbers(self, self._pace)
            gui.main_panel.dock_right()
            self.panel = Panel(
                gui,
                self.store.robots,
                self.own,
                robot,
                self.units,
                self.system_dark,
                self._welcome,
                [tab.title for tab in self.offered],
                self.post,
            )
            self.panel.readout.use_rotations(self.view.rotations)
            self.panel.fit(gui.main_panel, self._persistence.embedded)
            self.panel.obstacles.expand_by_default = bool(saved.obstacles)
            self.status = self.panel.status
            self.posture = PosturePanel(self, self.panel.posture, self.post)
            self._use_robot(robot, saved.q)
            if code := reserved(self._persistence.shown):
                self.door.open(robot, code)
            self.forms = Forms(gui, self.panel, self, self._library.offered(self.store.robots), self.post)
            self.lessons = LessonChoice(gui, self.panel.learn, self.panel.sheet, self, self.post)
            tabs = self.panel.tabs
            containers: list[viser.GuiFolderHandle | viser.GuiTabHandle] = [self.panel.obstacles, *tabs]
            features: tuple[type[Feature], ...] = (ObstaclesFeature, *self.offered)
            if RobotTab in self.offered:
                own = tabs[self.offered.index(RobotTab)]
                features, containers = (*features, Motors, Calibrate), [*containers, own, own]
            if not self._looking:
                features, containers = (*features, StepOut), [*containers, self.panel.obstacles]
            if ProgramTab in self.offered:
                features, containers = (*features, Connect), [*containers, tabs[self.offered.index(ProgramTab)]]
            for tab, container in zip(features, containers, strict=True):
                with container:
                    self.tabs.append(tab(self))
            self._persistence.restore(saved)
            self.arm.draw(fresh=False)
            self._show_hints()
            learns = self._persistence.stored.lesson is not None
            self.channel.show("start", [self._persistence.begin(self.panel.share), LEARN if learns else ""])
            self.channel.show("history", ["", ""])
            self.channel.show("driven", self.driven)
            if not (self._looking or self._persistence.embedded):
                self._palette = Palette(gui, self.offered, self.post, self.channel)
                self._renew_palette()
        self.client.flush()

    def _renew_palette(self) -> None:
        if self._palette is not None:
            self._palette.renew(self.features, self.panel.robots.names, self.activity.exercises.all)

    def _use_robot(self, robot: Robot, q: Array | None = None, glide: bool = False) -> None:
        """Show another robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""
        self.bodies.detailed = self.view.detailed
        self.arm.use(robot, q, self.dark, self.view.base_axes, self.bodies.of(robot, self.own))
        self.numbers.use_frames()
        self.sliders = self._make_sliders()
        self.panel.jog.use_robot(robot)
        self.posture.use_robot()
        self.looks.apply()
        self.arm.scene.size_gizmo(self.camera.small)
        self.camera.aim(self.arm.scene.body, kin.link_frames(robot, self.arm.goal)[:, :3, 3], glide)
        self.place_scale()

    def place_scale(self) -> None:
        """Write the length of the floor's scale bar where it covers nothing, as camera and tool are now."""
        scene = self.arm.scene
        seen = self.camera.places(np.array([*scene.floor.ends, scene.gizmo_pose[:3, 3]]))
        scene.floor.turn_label(seen, scene.gizmo.scale)

    def _make_sliders(self) -> JointSliders:
        folders = [self.panel.joints] if self._more_joints is None else [self.panel.joints, self._more_joints]
        arm = self.arm
        before = getattr(self, "sliders", None)
        return JointSliders(
            self.client.gui, folders, arm.robot, arm.goal, arm.locks, self.units, self.post, self.fence, before
        )


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.3f}" for value in values)
