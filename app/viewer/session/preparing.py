"""Events that wait until their kernels are compiled. That happens on a new machine only.

Compiling takes seconds. If an event were handled before that, the page would stand still without a reason. So it
is held, the status card says what is being prepared, and the page can be used meanwhile. A page that opens with a
stored state waits as a whole, and its cover says for what.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from typing import Final, NamedTuple

from app.shared.preparation import Preparation
from app.viewer.feature import Feature, message_of
from app.viewer.own_arm import own_arm
from app.viewer.session.events import RULES, name_of
from app.viewer.session.lessons import lesson_titled, lesson_with_key
from app.viewer.session.parts import Page
from app.viewer.session.state import PageState
from kin import InputError, Robot
from kin.solvers import family_of
from kin.warmup import ALL, COLLISIONS, all_of

LOOK_AGAIN: Final = 0.2  # s
HELD: Final = 64  # events of one page; the oldest are dropped


class _Held(NamedTuple):
    key: Hashable
    value: object
    parts: tuple[str, ...]
    what: str


class Preparing:
    """Holds the events of one page. Not thread-safe: the visitor's worker calls it."""

    def __init__(self, page: Page, preparation: Preparation) -> None:
        self._page = page
        self._preparation = preparation
        self._held: dict[Hashable, _Held] = {}

    @property
    def due(self) -> float | None:
        """Seconds until `tick`; None: nothing is held."""
        return LOOK_AGAIN if self._held else None

    def wait(
        self, state: PageState, robot: Robot, tabs: Sequence[type[Feature]], left: Callable[[], bool]
    ) -> None:
        """Wait until a stored state of this robot can be shown, or the visitor has left."""
        if self._preparation.complete:
            return
        parts = _parts(robot, lesson_with_key(state.lesson), *(tab for tab in tabs if tab.key in state.features))
        while not (self._preparation.ready(parts) or left()):
            self._preparation.want(parts)
            self._page.channel.show("preparing", self._words(f"the {robot.name}", parts))
            time.sleep(LOOK_AGAIN)
        self._page.channel.forget("preparing")

    def admits(self, key: Hashable, value: object) -> bool:
        """Whether an event can be handled now. Otherwise it is held, and posted again when it can."""
        if self._preparation.complete and not self._held:
            return True
        rule = RULES.get(name_of(key))
        if rule is not None and rule.replaces:
            self._held.pop("robot", None)
        event = key[1] if isinstance(key, tuple) and key[0] == "message" else key
        try:
            parts, what = self._needs(event, value)
        except InputError:  # who handles it says what is wrong
            return True
        self._held.pop(event, None)
        if not (ready := self._preparation.ready(parts)):
            self._held[event] = _Held(key, value, parts, what)
            while len(self._held) > HELD:
                del self._held[next(iter(self._held))]
            self._preparation.want(parts)
        self._show()
        return ready

    def tick(self) -> None:
        """Post the events that can be handled by now, and show how far the others are."""
        for name, held in list(self._held.items()):
            if self._preparation.ready(held.parts):
                del self._held[name]
                self._page.post(held.key, held.value)
        self._show()

    def _show(self) -> None:
        """Say in the status card what the visitor has asked for last, and how far it is."""
        if not self._held:
            self._page.status.wait("")
            return
        if (asked := self._held.get("live")) is not None and self._page.door.line is not None:
            self._page.door.line.prepare(asked.what, *self._step(asked.parts))
        held = list(self._held.values())[-1]
        self._page.status.wait(self._words(held.what, held.parts))

    def _words(self, what: str, parts: Sequence[str]) -> str:
        step, of = self._step(parts)
        return (
            f"Preparing {what} for the first time on this machine: step {step} of {of}. This continues by itself."
        )

    def _step(self, parts: Sequence[str]) -> tuple[int, int]:
        """At which step the preparation of these parts is, and how many there are."""
        done, of = self._preparation.steps(parts)
        return min(done + 1, of), of

    def _needs(self, event: Hashable, value: object) -> tuple[tuple[str, ...], str]:
        """The parts of the core that an event needs, and what they are for."""
        arm = self._page.now
        page = self._page
        match event:
            case "robot":
                robot = page.panel.robots.read(value)
                return (_parts(robot, page.lessons.shown) if robot != arm.robot else ()), f"the {robot.name}"
            case "live":
                line = page.door.line
                sent = None if line is None else line.waiting("robot")
                if sent is None:
                    return (), ""
                robot = sent if isinstance(sent, Robot) else own_arm(sent).robot
                return (_parts(robot, page.lessons.shown) if robot != arm.robot else ()), f"the {robot.name}"
            case "lesson":
                chosen = lesson_titled(value)
                if chosen is None:
                    return (), ""
                return _parts_for(arm.robot, chosen.kernels), f"the lesson “{chosen.title}”"
            case "feature":
                name, key, _ = message_of(page.features, value)
            case ("feature", str(name), key):
                pass
            case _:
                return (), ""
        feature = next((each for each in page.features if each.key == name), None)
        if feature is None:
            return (), ""
        return _parts_for(arm.robot, feature.kernels_of(key)), f"“{feature.title}”"


def _parts(robot: Robot, *shown: Feature | type[Feature] | None) -> tuple[str, ...]:
    """What moves a robot, with what these features need of it."""
    collisions = (COLLISIONS,) if robot.capsules else ()
    needs = [name for each in shown if each is not None for name in each.kernels]
    return (family_of(robot), *collisions, *_parts_for(robot, needs))


def _parts_for(robot: Robot, kernels: Sequence[str]) -> tuple[str, ...]:
    return tuple(all_of(family_of(robot)) if name == ALL else name for name in kernels)
