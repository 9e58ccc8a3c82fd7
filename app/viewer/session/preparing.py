"""Events that wait until their kernels are compiled. That happens on a new machine only.

Compiling takes seconds. If an event were handled before that, the page would stand still without a reason. So it
is held, the status card says what is being prepared, and the page can be used meanwhile.

A page that opens with a stored state of such an arm shows another arm until then, which has no arrows to drag.
What would move that arm is refused in words; the choice of a lesson and what a program sends wait.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Final

from app.shared.preparation import Preparation
from app.viewer.feature import Feature, message_of
from app.viewer.own_arm import own_arm
from app.viewer.session.events import LINK, RULES, name_of
from app.viewer.session.lessons import lesson_titled, lesson_with_key
from app.viewer.session.parts import Page
from app.viewer.session.state import PageState
from kin import InputError, Robot
from kin.solvers import family_of
from kin.warmup import ALL, COLLISIONS, all_of

LOOK_AGAIN: Final = 0.2  # s
HELD: Final = 64  # events of one page; the oldest are dropped
FOR_STATE: Final = ("live", "lesson")  # events that wait for a stored state with another arm


@dataclass(frozen=True)
class _Held:
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

    def admits(self, key: Hashable, value: object) -> bool:
        """Whether an event can be handled now. Otherwise it is held, and posted again when it can, or refused."""
        if self._preparation.complete and not self._held:
            return True
        event = key[1] if isinstance(key, tuple) and key[0] == "message" else key
        name = name_of(key)
        rule = RULES.get(name)
        if rule is not None and rule.replaces:
            self._give_up(key)
        elif rule is not None and rule.act and name != "feature" and (state := self._held.get(LINK)) is not None:
            if name in FOR_STATE:
                self._hold(key, _Held(key, value, state.parts, state.what))
            else:
                self._page.refuse(key, f"The page waits for {state.what}. It can be moved when it is there.")
            return False
        try:
            parts, what = self._needs(event, value)
        except InputError:  # who handles it says what is wrong
            return True
        if self._preparation.ready(parts):
            self._show()
            return True
        self._hold(event, _Held(key, value, parts, what))
        return False

    def lacks(self, state: PageState, robot: Robot, tabs: Sequence[type[Feature]]) -> bool:
        """Whether a stored state of this robot cannot be shown yet."""
        return not (self._preparation.complete or self._preparation.ready(_parts_of(state, robot, tabs)))

    def hold_state(self, state: PageState, robot: Robot, tabs: Sequence[type[Feature]]) -> None:
        """Post a stored state as `LINK` when it can be shown."""
        self._page.arm.scene.gizmo.visible = False
        self._hold(LINK, _Held(LINK, state, _parts_of(state, robot, tabs), f"the {robot.name}"))

    def tick(self) -> None:
        """Post the events that can be handled by now, and show how far the others are."""
        for name, held in list(self._held.items()):
            if self._preparation.ready(held.parts):
                if name != LINK:  # which is waited for until it is handled
                    del self._held[name]
                self._page.post(held.key, held.value)
        self._show()

    def _give_up(self, key: Hashable) -> None:
        """Drop held events that this one replaces, a stored state among them."""
        if LINK in self._held:
            self._page.arm.scene.gizmo.visible = True
        for name in list(self._held):
            if RULES[name_of(name)].replaces:
                del self._held[name]
            elif name_of(name) in FOR_STATE and key != LINK:  # any arm can have them
                held = self._held.pop(name)
                self._page.post(held.key, held.value)

    def _hold(self, event: Hashable, held: _Held) -> None:
        self._held.pop(event, None)
        self._held[event] = held
        while len(self._held) > HELD:
            del self._held[next(name for name in self._held if name != LINK)]
        self._preparation.want(held.parts)
        self._show()

    def _show(self) -> None:
        """Say in the status card what the visitor has asked for last, and how far it is."""
        if not self._held:
            self._page.status.wait("")
            return
        held = list(self._held.values())[-1]
        at, of = self._step(held)
        if (asked := self._held.get("live")) is not None and self._page.door.line is not None:
            self._page.door.line.prepare(asked.what, *self._step(asked))
        step = f"step {at} of {of}"
        self._page.status.wait(
            f"Preparing {held.what} for the first time on this machine: {step}. This continues by itself."
        )

    def _step(self, held: _Held) -> tuple[int, int]:
        """At which step its preparation is, and how many there are."""
        done, of = self._preparation.steps(held.parts)
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


def _parts_of(state: PageState, robot: Robot, tabs: Sequence[type[Feature]]) -> tuple[str, ...]:
    return _parts(robot, lesson_with_key(state.lesson), *(tab for tab in tabs if tab.key in state.features))
