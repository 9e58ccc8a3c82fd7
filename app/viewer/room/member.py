"""What all members of a room have in their pages: the tab *Class*, the bar over the scene, and who leads."""

from __future__ import annotations

import math
import time
from abc import abstractmethod
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import cast

from app.classroom.views import ClassroomUnavailable, RefusedError, RoomView
from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory
from app.viewer.declared.work import Work
from app.viewer.feature import Feature, Stage
from app.viewer.live.feature import Connect
from app.viewer.panel import update_html
from app.viewer.panel.part import Block
from app.viewer.panel.status import Notice
from app.viewer.room.following import Follower
from app.viewer.room.member_page import MemberPage
from app.viewer.room.sharing import Sharing
from app.viewer.session.events import RULES, name_of
from app.viewer.session.state import PageState

NEWS: Hashable = "room"
IDLE = 60.0  # s
AGAIN = 6.0  # s within which a button that needs two presses must be pressed again
SURE = 0.5  # s from the first press to the second; earlier ones are of a double click
SETTLED = 0.5  # s without news of who leads after which the target is solved in this page too
GRACE = 0.8  # s after the beginning of a lead in which a drag that is under way does not end it
PRESS = "press"  # the act of pressing what a connected program offers


def _any(text: str) -> str:
    """Whether there is a text, as a text."""
    return "…" if text else ""


def wanted(value: object, now: bool) -> bool:
    """The state that a button brings about, which it names: the second click of a double click changes nothing."""
    return bool(value) if type(value) is int else not now


def act_of(key: Hashable, value: object, features: Iterable[Feature | type[Feature]]) -> str:
    """The name of a visitor's act that changes the page; empty for other events."""
    name = name_of(key)
    if name not in RULES or not RULES[name].act:
        return ""
    if name == "feature":
        match key, value:
            case ("message", *_), [Connect.key, ["stop" | "halt", *_], *_]:  # what is driven may always be stopped
                return ""
            case ("message", *_), [Connect.key, ["press" | "confirm", *_], *_]:
                return PRESS
            case ("feature", Connect.key, ("do", ("on_play",), *_) | ("at", *_)), _:  # a recording moves the arm
                return name
            case ("message", *_), [pressed, *_]:
                return name if all(feature.acts for feature in features if feature.key == pressed) else ""
        return ""
    return name


@dataclass(frozen=True)
class MemberSettings(Settings):
    """What a page shows of its room.

    Attributes:
        bar: over the scene, outside of all tabs; nothing is shown before it is there.
        room: as far as the tab shows it.
        leader: who leads this page: "teacher", or the id of a seat.
        armed: a button that needs two presses and when it was pressed for the first time.
    """

    bar: Block | None = memory(renew=False)
    room: RoomView | None = memory(renew=False)
    leader: str = memory("", renew=False)
    armed: tuple[Hashable, float] | None = memory(renew=False)


class Member(DeclaredFeature[MemberSettings, Facts[MemberSettings]]):
    """The tab *Class* of one page. Subclasses: teacher and student."""

    key = "class"
    title = "Class"
    acts = False
    settings_of, facts_of = MemberSettings, Facts
    pace = 0.2
    led_why = "the class follows its teacher"  # why a real arm is stopped when another page begins to lead

    def __init__(self, stage: Stage) -> None:
        self.page = cast(MemberPage, stage)
        assert self.page.attendance is not None  # taken before the page is built
        self.attendance = self.page.attendance
        self.room: RoomView = self.attendance.room
        self.follower = Follower(self.page, self.page.rights.compute)
        self._sharing = Sharing(self.shared_state, self.attendance.tell_page, lambda: self.share_every)
        super().__init__(stage)

    def attach(self, bar: Block) -> None:
        """Use this element, outside of all tabs, for the bar over the scene."""
        self.change(bar=bar)
        self.apply_updates()
        self.schedule()

    @property
    def leader(self) -> str:
        """Who leads this page: "teacher", or the id of a seat."""
        return self.settings.leader

    @property
    def driven(self) -> str:
        """What a connected program drives with this page; empty: nothing."""
        return "" if (connect := self.page.live.connect) is None else connect.settings.driven

    # To be overridden

    @abstractmethod
    def apply_updates(self) -> None:
        """The room has changed: do at once what concerns the arm."""

    @abstractmethod
    def refreshed(self) -> None:
        """Tab and bar show the room as it is now."""

    @abstractmethod
    def bar(self) -> str:
        """The HTML of the bar over the scene."""

    @abstractmethod
    def shared_state(self) -> PageState | None:
        """What is sent to the room; None: nothing now."""

    @abstractmethod
    def press(self, kind: str, name: str, value: object) -> None:
        """A control of the tab was pressed."""

    @abstractmethod
    def refusal(self, act: str) -> str:
        """Why the visitor may not act now; empty if the act is allowed, which may end a lead."""

    @property
    @abstractmethod
    def share_every(self) -> float:
        """Seconds between two states that are sent."""

    @property
    def frozen(self) -> bool:
        """Whether the visitor may not act."""
        return False

    def words(self, room: RoomView) -> RoomView:
        """The room as far as the tab shows it: not the arms, which move all the time."""
        return replace(
            room,
            page=_any(room.page),
            shown=room.shown and replace(room.shown, page=_any(room.shown.page)),
            seat=room.seat and replace(room.seat, page=""),
            seats=tuple(replace(seat, page=_any(seat.page)) for seat in room.seats),
        )

    # Feature

    def running(self) -> Sequence[Work]:
        armed, moving = self.settings.armed, self.follower.moving
        works = [] if armed is None else [Work("disarm", tuple, (armed,), rest=AGAIN)]
        return [*works, Work("settle", float, (self.follower.moved_at,), rest=SETTLED)] if moving else works

    def worked(self, key: str) -> None:
        if key == "disarm":
            self.change(armed=None)
        else:
            self.follower.settle()

    def handle(self, key: Hashable, value: object) -> None:
        if key == NEWS:
            self._take_room()
            self.due = 0.0  # the tab follows at its pace
        else:
            super().handle(key, value)

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case (str(kind), int()):
                self._press(kind, "", value)
            case ("fields", str(name), int()):
                self._press(name, "", value)
            case (str(kind), str(name), int()):
                self._press(kind, name, value)
            case ("look", str(seat)):
                self._press("look", seat, None)

    def _take_room(self) -> None:
        self.room = self.attendance.room
        if self.settings.bar is not None:
            self.apply_updates()
        if (words := self.words(self.room)) != self.settings.room:
            self.change(room=words)

    def refresh(self) -> None:
        super().refresh()
        if self.settings.bar is not None:
            update_html(self.settings.bar, self.bar())
            self.refreshed()

    def tick(self, now: float) -> None:
        super().tick(now)
        again = self._sharing.tick(now)
        self.due = min(due for due in (self.due, again, IDLE) if due is not None)

    def allows(self, key: Hashable, value: object) -> bool:
        """Whether an event may act on the page."""
        act = act_of(key, value, self.page.features)
        if not act:
            return True
        fresh = self.leader and time.perf_counter() - self.follower.began < GRACE
        if fresh and not self.frozen and act in ("gizmo", "grab", "joint"):
            self.page.put_back()
            return False
        if why := self.refusal(act):
            self.page.refuse(key, why)
        self.due = 0.0
        return not why

    # For subclasses

    def follow(self, leader: str, text: str, title: str = "", before: PageState | None = None) -> None:
        """Show the state of another page from now on, or again; with a title, undo leads back to `before`."""
        stopped: Notice | None = None
        if leader != self.leader:
            stopped = self.stop_driven(self.led_why)
            if not self.leader and title and before is not None:
                self.page.record(title, before)
            self.change(leader=leader)
            self.page.set_following(True)
            self.follower.begin()
        self.follower.show(text)
        if stopped is not None:
            self.page.status.show(stopped)  # what is shown has had words of its own

    def free(self) -> None:
        """Nobody leads this page any more."""
        if self.leader:
            self.change(leader="")
            self.follower.moving = False
            self.page.set_following(False)

    def stop_driven(self, why: str) -> Notice | None:
        """Stop the real arm that a program drives, before another hand than its owner's moves the page's arm.

        Returns what was said of it; None: there is none.
        """
        driven, connect = self.driven, self.page.live.connect
        if connect is None or not connect.halt(f"Stopped: {why}."):
            return None
        notice = Notice("error", f"Stopped: {why}", f"{driven or 'Its program'} moves by your own hand only.")
        self.page.status.show(notice)
        return notice

    def on_driven(self) -> None:
        """A program has begun to drive something: an act of this page, which ends a lead or is refused."""
        if self.leader and (why := self.refusal("live")):
            if (notice := self.stop_driven(self.led_why)) is None:
                return
            self.page.status.show(replace(notice, detail=why))

    def twice(self, what: Hashable) -> bool:
        """Whether a button that needs two presses was pressed for the second time."""
        armed, now = self.settings.armed, time.perf_counter()
        since = now - armed[1] if armed is not None and armed[0] == what else math.inf
        if since < SURE:
            return False
        self.change(armed=None if since < AGAIN else (what, now))
        return since < AGAIN

    def is_armed(self, what: Hashable) -> bool:
        """Whether such a button waits for the second press."""
        return self.settings.armed is not None and self.settings.armed[0] == what

    def try_to(self, action: Callable[[], object]) -> bool:
        """Ask the room for something; says in the status line why it was refused."""
        try:
            action()
        except (RefusedError, ClassroomUnavailable) as error:
            self.page.status.show(Notice("error", "Not done", str(error)))
            return False
        return True

    def _press(self, kind: str, name: str, value: object) -> None:
        if not self.room.closed:
            self.press(kind, name, value)
