"""One visitor's page: panel, status line, features, camera and saved state, driven by one worker thread.

Browser callbacks post events into the inbox and return. The worker takes all new events, processes them, and sends
one consistent update. While the arm moves it also wakes up for each frame. Nothing is shared or locked here.

The arm itself belongs to the :class:`~app.viewer.page.controller.ArmController`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from functools import partial

import viser

from app.classroom.results.keys import result_key
from app.live import Listener, reserved
from app.shared.security import Rights
from app.viewer import viser_names
from app.viewer.activity.activity import Activity
from app.viewer.arm import Arm
from app.viewer.feature import Feature
from app.viewer.labels import size_labels, text_factor
from app.viewer.live.feature import Connect
from app.viewer.meshes.bodies import Bodies
from app.viewer.obstacles.feature import ObstaclesFeature
from app.viewer.page.controller import ArmController
from app.viewer.page.display import Display
from app.viewer.page.joints import Joints
from app.viewer.page.links import Links
from app.viewer.page.picture import Picture
from app.viewer.page.robots import Robots
from app.viewer.page.services import Services
from app.viewer.panel.fence import Fence
from app.viewer.panel.joints import lock_notice
from app.viewer.panel.layout import LEARN, Panel
from app.viewer.panel.part import bring_parts
from app.viewer.panel.script import Reply
from app.viewer.panel.status import READY, Notice, StatusLine
from app.viewer.panel.theme import configure_theme
from app.viewer.scene.camera import VisitorCamera
from app.viewer.session.actions.actions import Actions
from app.viewer.session.channel.channel import Channel
from app.viewer.session.channel.files import Files
from app.viewer.session.choices import ViewState
from app.viewer.session.events import FENCE, name_of
from app.viewer.session.forms import Forms
from app.viewer.session.lessons import LessonChoice
from app.viewer.session.live import LiveInput
from app.viewer.session.looks import Looks
from app.viewer.session.numbers import Numbers
from app.viewer.session.palette import Palette
from app.viewer.session.persistence import Persistence
from app.viewer.session.posture import PosturePanel
from app.viewer.session.state import PageState, encode_features
from app.viewer.session.worker.worker import Worker
from app.viewer.step_out import StepOut
from app.viewer.tabs import TABS
from app.viewer.tabs.program.tab import ProgramTab
from app.viewer.tabs.robot.calibrate.feature import Calibrate
from app.viewer.tabs.robot.motors.feature import Motors
from app.viewer.tabs.robot.tab import RobotTab
from app.viewer.views.templates import render
from app.viewer.viser_outbox import in_one_frame
from app.viewer.viser_patches import hear_marks
from kin import IKResult, Robot
from kin.collision import Contact
from kin.transforms import Array


class VisitorPage(Worker):
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
        self.client, self.services, self.rights = client, services, rights
        self.meshes = services.meshes.of(address)
        self.bodies = Bodies(services.library, lambda why: self.post("body", why))
        self.arm = ArmController(client, services.pace, self.post, self, rights.compute)
        self.robots = Robots(services.store, self.arm, self._change_robot)
        self.display = Display(self._frames_changed)
        self.view, self.system_dark = ViewState(), False
        self.links = Links(token, encode_features)
        self.channel = Channel(self.post, rights, viser_names.IMPROVEMENTS.is_there)
        hear_marks(client, self.channel.mark)
        self.fence = Fence(client, lambda: self.post(FENCE))
        client.gui.add_html(render("panel/channel", name=self.channel.name))
        bring_parts(client.gui, self.channel)
        self._welcome = welcome
        self.files = Files(self.post, lambda: self.features, self.meshes.memory, rights)
        self.door = Listener(services.lines, self.post, not rights.compute)
        self._persistence = Persistence(self, self._guard)
        self.offered: tuple[type[Feature], ...] = TABS
        self.tabs: list[Feature] = []
        self._result: IKResult | None = None  # for the last target
        self._palette: Palette | None = None
        # Created by the worker when it builds the page.
        self.camera: VisitorCamera
        self.picture: Picture
        self.posture: PosturePanel
        self.panel: Panel
        self.forms: Forms
        self.status: StatusLine
        self.joints: Joints
        self.numbers: Numbers
        self.lessons: LessonChoice
        self.activity = Activity(
            services.courses,
            partial(result_key, services.classroom),
            self._activity_changed,
        )
        self.looks = Looks(self)
        self.live = LiveInput(self)
        self._heard_of: Arm | None = None  # the arm that features have heard of
        self._actions = Actions(self, self.live, self.looks)

    @property
    def features(self) -> list[Feature]:
        """The tabs, and the open lesson with its steps."""
        return [*self.tabs, *self.lessons.features] if self.tabs else []

    def lets_change(self, uuid: str) -> bool:
        """Whether a visitor who may only look may change the control with this id. Any thread may ask."""
        return bool(self.tabs) and (uuid in self.forms.view_ids or uuid == self.panel.share.choice_id)

    def open_choice(self, title: str) -> None:
        """Open another choice of the tab *Learn*, in the same step for undo."""
        self.lessons.choose(title)

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""
        self.status.settle(None if self.arm.open_target is None else self._result, self.display.units)

    def put_back(self) -> None:
        """Show in all controls of the arm what is true."""
        self.numbers.use_goal(None)
        self.joints.sliders.show_locks(self.arm.locks)
        self.panel.robots.show(self.arm.robot, self.robots.own)
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

    def _tell(self) -> None:
        """Tell every feature that the arm is another one, if it is."""
        now, before = self.arm.now, self._heard_of
        if now is not before:
            self._heard_of, changed = now, now.changes(before)
            self.for_features(lambda feature: feature.on_arm_changed(changed))

    # Reports of the page's parts

    def _activity_changed(self) -> None:
        """Something else is open or withheld."""
        self.for_features(lambda feature: feature.on_activity())
        if self.tabs:
            self.posture.use_activity()
            self.numbers.use_pose()

    def _contacts_changed(self, contacts: Sequence[Contact]) -> None:
        """The arm touches something else."""
        self.for_features(lambda feature: feature.on_contacts(contacts))

    def _frames_changed(self) -> None:
        """There are other frames, or poses are shown in another one."""
        self.numbers.use_frames()
        self.for_features(lambda feature: feature.on_style())

    def _change_robot(self, robot: Robot, q: Array | None, edited: bool) -> None:
        """See `Robots`."""
        viewpoint = self.camera.chosen if edited else None
        self.posture.remove()
        self.arm.scene.remove()
        self.panel.robots.show(robot, self.robots.own)
        self._use_robot(robot, q, glide=edited)
        self.forms.show()
        self.for_features(lambda feature: feature.on_robot())
        if viewpoint is not None:
            self.camera.restore(viewpoint)

    def on_pose(self) -> None:
        self.numbers.use_pose()

    def on_goal(self, dragged: int | None) -> None:
        self.numbers.use_goal(dragged)

    def on_move(self, notice: Notice, at_once: bool) -> None:
        self.status.show(notice)
        if at_once and not self.arm.playing and self._persistence.due is None:
            # A frame of a motion that goes on after its beginning was stored: no event tells of its end.
            self._actions.history.proceed()
            self._persistence.postpone(time.perf_counter())

    def on_gripper(self) -> None:
        self.panel.gripper.offer(self.arm.opening)
        if (connect := self.live.connect) is not None:
            connect.follow_gripper()

    def on_drag(self, start: Array, target: Array | None) -> None:
        self.numbers.use_drag(start, target)

    def on_result(self, result: IKResult) -> None:
        self._result = result
        self.posture.use_result(result)
        self.status.show_result(result, self.display.units)
        self.numbers.use_result(result)
        for feature in self.features:
            if type(feature).on_result is not Feature.on_result:  # few have one, and targets come often
                self._guard(partial(feature.on_result, result))

    def on_lock(self, locks: Sequence[bool]) -> None:
        self.status.show(lock_notice(locks))

    def on_request(self) -> None:
        self.posture.show()
        if self.tabs:
            self.forms.show()
            self.joints.sliders.show_locks(self.arm.locks)
        self.for_features(lambda feature: feature.on_request())

    def on_branch(self, branch: str | None) -> None:
        self.posture.choose(branch)

    # Worker

    @property
    def _timeout(self) -> float | None:
        times = [feature.due for feature in self.features if feature.due is not None]
        if self.arm.moving or self.camera.gliding:
            times.append(self.services.pace.interval)
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
                self._tell()
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
                if batch and not self.arm.dragging:
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
            self.picture.show_hints(self.rights.compute)
            self.arm.show_gizmo_again()
            self.picture.place_scale()

    def _save(self) -> None:
        self._guard(lambda: self._persistence.save(self._actions.history.take_key()))

    def _act(self, key: Hashable, value: object) -> None:
        self._actions.handle(key, value)

    def _prepare(self) -> None:
        """Find out with what the page starts."""
        self._persistence.load()
        self.robots.own = self._persistence.stored.own

    def _build(self) -> None:
        gui = self.client.gui
        saved = self._persistence.stored
        display = self.display
        self.view, self.system_dark = saved.view, self._persistence.system_dark
        display.units, display.frames = saved.units, saved.frames
        display.dark = self.view.is_dark(self.system_dark)
        self.activity.language = self.view.language
        size_labels(self.client.scene, text_factor(self._persistence.text_size))
        robot = self.robots.get(saved.robot)
        with self.client.atomic(), self.channel.step(0):
            if display.dark:
                configure_theme(gui, True)
            self.camera = VisitorCamera(self.client, self.post)
            gui.main_panel.dock_right()
            self.panel = Panel(
                gui,
                self.services.store.robots,
                self.robots.own,
                robot,
                display.units,
                self._welcome,
                [tab.title for tab in self.offered],
                self.post,
                self.rights.compute,
            )
            self.panel.readout.use_rotations(self.view.rotations)
            self.panel.fit(gui.main_panel, self._persistence.embedded)
            self.panel.obstacles.expand_by_default = bool(saved.obstacles)
            self.status = self.panel.status
            self.picture = Picture(self.client.scene, self.camera, self.arm, self.panel)
            self.joints = Joints(gui, self.panel.joints, self.arm, display, self.post, self.fence)
            self.posture = PosturePanel(self, self.panel.posture, self.post)
            self.numbers = Numbers(self, self.panel, self.posture, self._contacts_changed)
            self._use_robot(robot, saved.q)
            if code := reserved(self._persistence.shown):
                self.door.open(robot, code)
            detailed = self.services.library.offered(self.services.store.robots)
            self.forms = Forms(gui, self.panel, self, lambda: self.view, detailed, self.post)
            self.lessons = LessonChoice(gui, self.panel.learn, self.panel.sheet, self, self.post)
            self._build_tabs()
            self._persistence.restore(saved)
            self.arm.draw(fresh=False)
            self._tell()
            self.picture.show_hints(self.rights.compute)
            learns = self._persistence.stored.lesson is not None
            self.channel.show("start", [self._persistence.begin(self.panel.share), LEARN if learns else ""])
            self.channel.show("history", ["", ""])
            self.channel.show("driven", "")
            if self.rights.compute and not self._persistence.embedded:
                self._palette = Palette(gui, self.offered, self.post, self.channel)
                self._renew_palette()
        self.client.flush()

    def _build_tabs(self) -> None:
        """Make the features of the tabs, each in its container."""
        tabs = self.panel.tabs
        containers: list[viser.GuiFolderHandle | viser.GuiTabHandle] = [self.panel.obstacles, *tabs]
        features: tuple[type[Feature], ...] = (ObstaclesFeature, *self.offered)
        if RobotTab in self.offered:
            own = tabs[self.offered.index(RobotTab)]
            features, containers = (*features, Motors, Calibrate), [*containers, own, own]
        if self.rights.compute:
            features, containers = (*features, StepOut), [*containers, self.panel.obstacles]
        if ProgramTab in self.offered:
            features, containers = (*features, Connect), [*containers, tabs[self.offered.index(ProgramTab)]]
        for tab, container in zip(features, containers, strict=True):
            with container:
                self.tabs.append(tab(self))

    def _renew_palette(self) -> None:
        if self._palette is not None:
            self._palette.renew(self.features, self.panel.robots.names, self.activity.exercises.all)

    def _use_robot(self, robot: Robot, q: Array | None, glide: bool = False) -> None:
        """Show another robot, at its home configuration or at `q` ``(n,)``, in a fitting view."""
        self.bodies.detailed = self.view.detailed
        drawn = self.bodies.of(robot, self.robots.own)
        self.arm.use(robot, q, self.display.dark, self.view.base_axes, drawn)
        self.numbers.use_frames()
        self.joints.renew()
        self.panel.jog.use_robot(robot)
        self.posture.use_robot()
        self.looks.apply()
        self.arm.scene.size_gizmo(self.camera.small)
        self.camera.aim(self.arm.scene.body, self.arm.now.goal_points, glide)
        self.picture.place_scale()
