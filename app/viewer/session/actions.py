"""The visitor's actions: what each event of the panel and the scene does to the page.

Only the visitor's worker calls these methods, one event at a time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from typing import Any, Protocol

import kin
from app.viewer.feature import Feature, message_of
from app.viewer.labels import size_labels, text_factor
from app.viewer.panel.script import Reply
from app.viewer.panel.status import Notice, introduction
from app.viewer.panel.target import DEFAULT_TASK, TASKS
from app.viewer.panel.view import SIDES
from app.viewer.scene.gizmo import Pull
from app.viewer.session.history import LONG_PAUSE, SHORT_PAUSE, History, Step, pause_within, same, without_results
from app.viewer.session.looks import Looks
from app.viewer.session.persistence import link_notice
from app.viewer.session.robots import RobotPage, robot_of
from app.viewer.session.state import PageState, decode
from app.viewer.session.typed import BY_HAND, TypedInput, TypedPage
from kin import Task
from kin.transforms import Array
from kin.units import Units

# Events that change nothing that undo restores.
NO_STEP = frozenset(
    {
        *("camera", "fit-arm", "look-from", "looked", "resized", "system-dark", "grab", "copy-as"),
        *("undo", "redo", "travel", "released", "snap", "text-size", "body", "shown", "news"),
    }
)
# Controls that send many values on the way to the one the visitor means: how long (s) a step may pause.
GRADUAL = {"gizmo": math.inf, "joint": LONG_PAUSE, "redundancy": LONG_PAUSE, "nudge": SHORT_PAUSE}
MESSAGES = (
    "undo", "redo", "travel", "released", "snap", "nudge", "axes", "field", "target", "fit-arm", "look-from",
    "lesson", "feature", "text-size", "frame",
)  # fmt: skip
ANSWERED = frozenset({"field", "target"})  # messages whose handlers reply
LABELS = {
    "gizmo": "Drag of the target",
    "redundancy": "Redundancy",
    "lock": "Lock",
    "branch": "Posture",
    "lesson": "Lesson",
    "robot": "Robot",
    "task": "Target must match",
    "radians": "Unit of angles",
    "lengths": "Unit of lengths",
    "home": "Home",
    "random": "Random",
    "recall": "Move target to tool",
    "view": "View",
    "look": "Show arm as",
    "colours": "Page colours",
    "axes": "Arrows along",
    "nudge": "Target moved by keys",
    "frame": "Frame of the read-out",
    "field": "Typed value",
    "target": "Typed target",
}


class ActionsPage(TypedPage, RobotPage, Protocol):
    """What actions may use of a page, in addition to what is saved of it and to its panel."""

    system_dark: bool
    looks: Looks

    def snapshot(self) -> PageState:
        """The present state."""

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""


class Actions:
    """Handles the events of one page, and keeps its `history`."""

    def __init__(self, page: ActionsPage) -> None:
        self._page = page
        self.history = History()
        self._gesture: tuple[object, ...] | None = None  # the control of the last step, while it may go on
        self._changed_at = 0.0
        self._left: dict[str, PageState] = {}  # the state in which each robot was left
        self._typed = TypedInput(page)
        arm = page.arm
        # Events by the first part of their key. A handler takes the other parts, and the value.
        self._handlers: dict[str, Callable[..., None]] = {
            "grab": self._on_grab,
            "gizmo": arm.pull,
            "joint": self._on_slider,
            "redundancy": self._on_redundancy,
            "lock": self._on_lock,
            "branch": self._on_branch_choice,
            "feature": self._on_feature,
            "news": self._on_feature,
            "lesson": lambda title: page.lessons.choose(title) if page.lessons is not None else None,
            "robot": self._on_robot_choice,
            "task": self._on_task,
            "radians": lambda radians: page.looks.use_units(replace(page.units, degrees=not radians)),
            "lengths": lambda name: page.looks.use_units(page.panel.units.with_length(page.units, name)),
            "home": lambda _: self._move_into_view(arm.move_home, "Home configuration"),
            "random": lambda _: self._move_into_view(arm.move_to_random, "Random configuration"),
            "recall": lambda _: self._move(arm.recall_target, "The target is at the tool"),
            "copy-as": lambda name: page.panel.share.choose(name),
            "view": self._on_view,
            "look": self._on_drawn_as,
            "body": page.looks.use_library,
            "colours": self._on_colours,
            "system-dark": lambda dark: page.looks.use_colours(page.view.dark, bool(dark)),
            "camera": lambda _: page.camera.aim(arm.scene.body, self._frames(), glide=True),
            "fit-arm": lambda _: page.camera.look_at_arm(self._frames()),
            "look-from": self._look_from,
            "resized": self._on_resize,
            "looked": self._on_look,  # the viewpoint is read when the camera rests
            "axes": self._typed.use_axes,
            "frame": lambda name: page.use_frames(page.frames.choose(name)),
            "text-size": lambda name: size_labels(page.client.scene, text_factor(name)),
            "shown": lambda moved: page.move_to(moved[0], moved[1], True),
            # Messages of the page's own script
            "undo": self._undo,
            "redo": self._redo,
            "travel": self._travel,
            "released": self._on_release,
            "snap": self._typed.snap,
            "nudge": self._typed.nudge,
            "field": self._typed.set_field,
            "target": self._typed.set_target,
        }

    def handle(self, key: Hashable, value: object) -> None:
        """Process one event; raises `kin.InputError` for a value that none of our controls sends."""
        name, *arguments = key if isinstance(key, tuple) else (key,)
        if name == "message":
            name, number = arguments
            if name not in MESSAGES:
                raise kin.InputError("message", name, "one of " + ", ".join(MESSAGES))
            arguments = [number] if name in ANSWERED else []
            if name == "feature":
                try:
                    *arguments, value = message_of(self._page.features, value)
                    self._act(name, arguments, value)
                finally:
                    self._page.panel.script.reply(Reply(number, ""))
                return
        self._act(name, arguments, value)

    def _act(self, name: str, arguments: list[Any], value: object) -> None:
        action = self._handlers[name]
        if name in NO_STEP:
            action(*arguments, value)
            return
        shown = self._page.status.count
        gesture = (name, *(a for a in arguments if not isinstance(a, Units)))
        now = time.perf_counter()
        if self._continues(gesture, value, now):
            action(*arguments, value)
            return
        before = self._page.snapshot()
        try:
            action(*arguments, value)
            if self._page.status.count == shown:  # the news were about an earlier action
                self._page.settle_status()
        finally:
            if not same(before, self._page.snapshot()):
                self.history.record(_label(gesture, self._page.features), before)
                self._gesture, self._changed_at = gesture, now
                self._show_history()

    def _on_resize(self, _: object) -> None:
        self._page.camera.refit()
        self._on_look(None)

    def _on_look(self, _: object) -> None:
        self._page.arm.scene.size_gizmo(self._page.camera.small)

    def _look_from(self, side: object, _: object = None) -> None:
        if side not in SIDES:
            raise kin.InputError("look-from", side, "one of " + ", ".join(SIDES))
        self._page.camera.look_from(side, self._frames())

    def _continues(self, gesture: tuple[object, ...], value: object, now: float) -> bool:
        """Whether an event belongs to the same step as the one before."""
        name = str(gesture[0])
        longest = pause_within(gesture[2], value) if name == "feature" else GRADUAL.get(name, 0.0)
        if gesture != self._gesture or longest == 0.0 or now - self._changed_at > longest:
            return False
        self._changed_at = now
        self.history.proceed()
        return True

    # History

    def _undo(self, _: object) -> None:
        self._take("Undone", "Redo brings it back.", self.history.undo(self._page.snapshot()))

    def _redo(self, _: object) -> None:
        self._take("Redone", "Undo takes it back again.", self.history.redo(self._page.snapshot()))

    def _take(self, verb: str, detail: str, step: Step | None) -> None:
        if step is None:
            self._page.status.show(Notice("hand", f"Nothing can be {verb.lower()}"))
        else:
            self._page.status.show(Notice("hand", f"{verb}: {step.label}", detail))
            self.show(step.state)
        self._show_history()

    def _travel(self, text: object) -> None:
        """Go to the state of an entry in the browser's history."""
        page = self._page
        state = decode(text, page.store.robots) if isinstance(text, str) else PageState(unreadable=True)
        if (notice := link_notice(state)) is not None:
            page.status.show(notice)
            return
        page.status.show(Notice("hand", "Back to this point of the browser's history"))
        self.show(self.history.travel(state, page.snapshot()))
        self._show_history()

    def record(self, label: str, before: PageState) -> None:
        """Let undo lead back to the state `before`."""
        self.history.record(label, before)
        self._show_history()

    def show(self, state: PageState) -> None:
        """Show another state, except for the viewpoint unless the robot is another one."""
        page = self._page
        self._gesture = None
        self.history.arrive()
        if state.units != page.units:
            page.panel.units.show(state.units)
            page.looks.use_units(state.units)
        if state.frames != page.frames:
            page.use_frames(state.frames)
        page.use_obstacles(state.obstacles)
        if state.view != page.view:
            page.looks.use_view(replace(state.view))
        self.adopt(state)
        if page.lessons is not None and state.lesson != page.lessons.key:
            page.lessons.open(state.lesson)
        for feature in page.features:
            wanted = without_results(state.features.get(feature.key, {}))
            if wanted != without_results(feature.state()):
                feature.restore(wanted)
        page.for_features(lambda feature: feature.on_request())

    def adopt(self, state: PageState) -> None:
        """Show the arm of another state: robot, requests and configuration."""
        page = self._page
        changed, page.own = state.own != page.own, state.own
        robot = robot_of(page, state.robot)
        if robot != page.robot:
            page.change_robot(robot, state.q)
            if state.camera is not None:
                page.camera.restore(state.camera)
        elif changed:
            page.panel.robots.show(robot, page.own)
        self._restore_arm(state)

    def _restore_arm(self, state: PageState) -> None:
        page, arm = self._page, self._page.arm
        task: Task = state.task or DEFAULT_TASK
        locks = [i in state.locks for i in range(page.robot.n)]
        page.panel.target.show(task)
        page.sliders.show_locks(locks)
        q = page.robot.q_home if state.q is None else state.q
        arm.restore(q, state.target, task, state.branch, locks)

    def _show_history(self) -> None:
        self._page.panel.script.show_history(*self.history.labels)

    def _on_release(self, _: object) -> None:
        """The visitor has released a control: what follows is another step."""
        self._gesture = None

    # Controls of the panel

    def _frames(self) -> Array:
        """Origins ``(n, 3)`` of the frames of the arm where it is heading."""
        frames: Array = kin.link_frames(self._page.robot, self._page.goal)[:, :3, 3]
        return frames

    def _move_into_view(self, motion: Callable[[], None], title: str) -> None:
        """Move the arm, and the camera if it would not show the whole arm."""
        self._move(motion, title)
        self._page.camera.keep(self._frames())

    def _move(self, motion: Callable[[], None], title: str) -> None:
        motion()
        self._page.status.show(replace(BY_HAND, title=title))

    def _on_grab(self, pull: Pull) -> None:
        self._gesture = None
        self._page.arm.pull(pull)

    def _on_slider(self, robot_id: str, index: int, units: Units, place: int, value: object) -> None:
        page = self._page
        # An event of sliders that have been replaced since is ignored.
        if (robot_id, units) == (page.robot.id, page.units):
            page.arm.move_joint(index, page.sliders.read(index, value, place))
            page.status.show(BY_HAND)

    def _on_redundancy(self, robot_id: str, name: str, units: Units, value: object) -> None:
        """Move through the self-motion while the tool is held."""
        page = self._page
        if (robot_id, units) != (page.robot.id, page.units):
            return
        self._typed.slide(name, value, held=True)

    def _on_lock(self, robot_id: str, joint: int | None, lock: object) -> None:
        if robot_id == self._page.robot.id:
            self._page.change_lock(joint, bool(lock))

    def _on_branch_choice(self, robot_id: str, value: object) -> None:
        """Move to the same pose on another branch, and stay on that branch."""
        page = self._page
        if robot_id == page.robot.id:
            branch = page.posture.read(value)
            if not page.arm.switch_branch(branch) and branch is not None:
                page.status.show(page.posture.not_here(branch))
                return
            page.for_features(lambda feature: feature.on_request())

    def _on_feature(self, name: str, key: Hashable, value: object) -> None:
        for feature in self._page.features:
            if feature.key == name:
                feature.handle(key, value)

    def _on_robot_choice(self, value: object) -> None:
        page = self._page
        if (robot := page.panel.robots.read(value)) == page.robot:
            return
        # The visitor's own arm has another id after every change; only the present one can be shown again.
        own = None if page.own is None else page.own.robot.id
        ids = {own, *(offered.id for offered in page.store.robots)}
        self._left = {name: state for name, state in self._left.items() if name in ids}
        self._left[page.robot.id] = page.snapshot()
        left = self._left.get(robot.id)
        page.change_robot(robot, None if left is None else left.q)
        page.status.show(introduction(robot))
        if left is not None:
            self._restore_arm(left)

    def _on_task(self, value: object) -> None:
        page = self._page
        if value not in TASKS:
            page.panel.target.show(page.task)
            raise kin.InputError("task", value, "one of " + ", ".join(TASKS))
        page.arm.set_task(TASKS[str(value)])

    def _on_colours(self, name: object) -> None:
        page = self._page
        page.looks.use_colours(page.panel.colours.read(name, page.view.dark), page.system_dark)

    def _on_drawn_as(self, name: object) -> None:
        page = self._page
        page.looks.use_view(replace(page.view, look=page.panel.view.read_look(name, page.view.look)))

    def _on_view(self, name: str, value: object) -> None:
        view = replace(self._page.view)
        setattr(view, name, bool(value))
        self._page.looks.use_view(view)
        if name == "avoid":
            self._page.solve_again()


def _label(gesture: tuple[object, ...], features: Sequence[Feature]) -> str:
    """What changed, for people."""
    match gesture:
        case ("joint", _, int(index), int()):
            return f"Joint {index + 1}"
        case ("feature", name, key, *_):
            return next((feature.step_name(key) for feature in features if feature.key == name), "Lesson")
    return LABELS[str(gesture[0])]
