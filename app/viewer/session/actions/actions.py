"""The visitor's actions: what each event of the panel and the scene does to the page.

Only the visitor's worker calls these methods, one event at a time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from typing import Any

import kin
from app.viewer.feature import Feature, message_of
from app.viewer.lessons.guide.feature import Guide
from app.viewer.panel.script import Reply
from app.viewer.panel.status import Notice
from app.viewer.scene.gizmo import DragEvent
from app.viewer.session.actions.arm import ArmControls
from app.viewer.session.actions.typed import TypedInput
from app.viewer.session.choices import PageChoices
from app.viewer.session.events import FENCE, MESSAGES, RULES, belongs_before, pause_within
from app.viewer.session.history import History, Step, same, without_results
from app.viewer.session.live import LiveInput
from app.viewer.session.looks import Looks
from app.viewer.session.parts import Page
from app.viewer.session.persistence import link_notice
from app.viewer.session.state import PageState, decode
from kin.units import Units

BURST = ("live",)  # the gesture of a program


class Actions:
    """Handles the events of one page, and keeps its `history`."""

    def __init__(self, page: Page, live: LiveInput, looks: Looks) -> None:
        self._page, self._looks = page, looks
        self.history = History()
        self._gesture: tuple[object, ...] | None = None  # the control of the last step, while it may go on
        self._changed_at = 0.0
        self._live_until = 0.0  # until when the burst of a program may go on
        typed = TypedInput(page, looks)
        self._arm = ArmControls(page, typed)
        # Events by the first part of their key. A handler takes the other parts, and the value.
        self._handlers: dict[str, Callable[..., Any]] = {
            **self._arm.handlers,
            **looks.handlers,
            **live.handlers,
            "grab": self._on_grab,
            FENCE: lambda _: page.fence.passed(),
            "feature": self._on_feature,
            "news": self._on_feature,
            "lesson": self._choose_lesson,
            "axes": typed.switch_axes,
            # Messages of the page's own script
            "undo": self._undo,
            "redo": self._redo,
            "travel": self._travel,
            "released": self._on_release,
            "snap": typed.snap,
            "nudge": typed.nudge,
            "jog": typed.jog,
            "field": typed.set_field,
            "target": typed.set_target,
        }

    def adopt(self, state: PageState) -> None:
        """Show the arm of another state: robot, requests and configuration."""
        self._arm.adopt(state)

    def handle(self, key: Hashable, value: object) -> None:
        """Process one event; raises `kin.InputError` for a value that none of our controls sends."""
        name, *arguments = key if isinstance(key, tuple) else (key,)
        if name == "message":
            name, number = arguments
            if name not in MESSAGES:
                raise kin.InputError("message", name, "one of " + ", ".join(MESSAGES))
            arguments = [number] if RULES[name].answered else []
            if name == "feature":
                try:
                    *arguments, value = message_of(self._page.features, value)
                    self._act(name, arguments, value)
                finally:
                    self._page.channel.reply(Reply(number, ""))
                return
        self._act(name, arguments, value)

    def _act(self, name: str, arguments: list[Any], value: object) -> None:
        action = self._handlers[name]
        if not RULES[name].step:
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
                if gesture == BURST:
                    self._live_until = now + RULES["live"].gradual
                else:
                    self._gesture, self._changed_at = gesture, now
                self._show_history()

    def _continues(self, gesture: tuple[object, ...], value: object, now: float) -> bool:
        """Whether an event belongs to the same step as the one before."""
        if gesture == BURST:  # what the visitor does meanwhile are steps of their own within the burst
            if now > self._live_until:
                return False
            self._live_until = now + RULES["live"].gradual
            self.history.proceed()
            return True
        if belongs_before(gesture):
            self.history.proceed()
            return True
        longest = pause_within(gesture, value)
        if gesture != self._gesture or longest == 0.0 or now - self._changed_at > longest:
            return False
        self._changed_at = now
        self.history.proceed()
        return True

    # History

    def _undo(self, _: object) -> None:
        self._take("Undone", "Redo brings it back.", self.history.undo(self._page.snapshot()))

    def _choose_lesson(self, title: object) -> None:
        """Open a lesson at the pose of its step."""
        self._page.lessons.choose(title)
        self._page.lessons.begin()

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
        state = decode(text, page.services.store.robots) if isinstance(text, str) else PageState(unreadable=True)
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
        self._gesture, self._live_until = None, 0.0
        self.history.arrive()
        if state.units != page.display.units:
            self._looks.use_units(state.units)
        if state.frames != page.display.frames:
            page.display.use_frames(state.frames)
        page.arm.use_obstacles(state.obstacles)
        if state.view != page.view:
            self._looks.use_view(state.view)
        self.adopt(state)
        if state.lesson != page.activity.lesson:
            page.lessons.open(state.lesson, state.features.get(Guide.key))
        for feature in page.features:
            wanted = without_results(state.features.get(feature.key, {}))
            if wanted != without_results(feature.state()):
                feature.restore(wanted)
        page.for_features(lambda feature: feature.on_request())

    def _show_history(self) -> None:
        self._page.channel.show("history", self.history.labels)

    def _on_release(self, _: object) -> None:
        """The visitor has released a control: what follows is another step."""
        self._gesture = None
        self._page.fence.released()

    # Controls of the panel

    def _on_grab(self, pull: DragEvent) -> None:
        self._gesture = None
        self._page.arm.pull(pull)

    def _on_feature(self, name: str, key: Hashable, value: object) -> None:
        for feature in self._page.features:
            if feature.key == name:
                feature.handle(key, value)


def _label(gesture: tuple[object, ...], features: Sequence[Feature]) -> str:
    """What changed, for people."""
    match gesture:
        case ("joint", _, int(index), int()):
            return f"Joint {index + 1}"
        case ("view", _, str(path), int()):
            return PageChoices.spec(path).undo or RULES["view"].label
        case ("feature", name, key, *_):
            return next((feature.step_name(key) for feature in features if feature.key == name), "Lesson")
    return RULES[str(gesture[0])].label
