"""What all members of a room have in their pages: the tab *Class*, the bar over the scene, and who leads."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections.abc import Callable, Hashable, Iterable
from dataclasses import replace
from typing import cast

from app.classroom.views import ClassroomUnavailable, RefusedError, RoomView
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
REFRESH = 0.2  # s between two updates of the tab and of the wall
IDLE = 60.0  # s
AGAIN = 6.0  # s within which a button that needs two presses must be pressed again
SURE = 0.5  # s from the first press to the second; earlier ones are of a double click
SETTLED = 0.5  # s without news of who leads after which the target is solved in this page too
GRACE = 0.8  # s after the beginning of a lead in which a drag that is under way does not end it


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
            case ("message", *_), [Connect.key, ["stop", *_], *_]:  # a frozen student may end a connection
                return ""
            case ("message", *_), [pressed, *_]:
                return name if all(feature.acts for feature in features if feature.key == pressed) else ""
        return ""
    return name


class Member(Feature):
    """The tab *Class* of one page. Subclasses: teacher and student."""

    key = "class"
    title = "Class"
    acts = False

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self.page = cast(MemberPage, stage)
        assert self.page.attendance is not None  # taken before the page is built
        self.attendance = self.page.attendance
        self.room: RoomView = self.attendance.room
        self.follower = Follower(self.page, self.page.may_compute)
        self.leader = ""  # who leads this page: "teacher", or the id of a seat
        self.due = 0.0
        self._began = 0.0
        self._dirty = True
        self._settles: float | None = None  # when the arm of who leads has rested long enough
        self._next = 0.0
        self._sharing = Sharing(self.shared_state, self.attendance.tell_page, lambda: self.share_every)
        self._armed: tuple[Hashable, float] = "", 0.0
        self._bar: Block | None = None

    def attach(self, bar: Block) -> None:
        """Use this element, outside of all tabs, for the bar over the scene."""
        self._bar = bar
        self.apply_updates()

    # To be overridden

    @abstractmethod
    def apply_updates(self) -> None:
        """The room has changed: do at once what concerns the arm."""

    @abstractmethod
    def refresh(self) -> None:
        """Show the room in the tab."""

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

    def handle(self, key: Hashable, value: object) -> None:
        if key == NEWS:
            self._take_room()
        else:
            self._dirty = True
        match key:
            case (str(kind), int()):
                self._press(kind, "", value)
            case ("fields", str(name), int()):
                self._press(name, "", value)
            case (str(kind), str(name), int()):
                self._press(kind, name, value)
            case ("look", str(seat)):
                self._press("look", seat, None)
        self.due = 0.0

    def _take_room(self) -> None:
        before, leader = self.room, self.leader
        self.room = self.attendance.room
        if self._bar is not None:
            self.apply_updates()
        self._dirty |= self.leader != leader or self.words(before) != self.words(self.room)

    def tick(self, now: float) -> None:
        again = self._sharing.tick(now)
        if self._settles is not None and now >= self._settles:
            self._settles = None
            self.follower.settle()
        if self._dirty and now >= self._next:
            self._dirty, self._next = False, now + REFRESH
            if self._bar is not None:
                self.refresh()
                update_html(self._bar, self.bar())
        left = self._next - now if self._dirty else IDLE
        if self._armed[0] and now >= self._armed[1]:
            self._armed, self._dirty, left = ("", 0.0), True, 0.0
        elif self._armed[0]:
            left = min(left, self._armed[1] - now)
        if self._settles is not None:
            left = min(left, self._settles - now)
        self.due = max(0.0, min(left, IDLE if again is None else again))

    def on_style(self) -> None:
        self._dirty = True

    def allows(self, key: Hashable, value: object) -> bool:
        """Whether an event may act on the page."""
        act = act_of(key, value, self.page.features)
        if not act:
            return True
        fresh = self.leader and time.perf_counter() - self._began < GRACE
        if fresh and not self.frozen and act in ("gizmo", "grab", "joint"):
            self.page.put_back()
            return False
        leader, why = self.leader, self.refusal(act)
        if why:
            self.page.refuse(key, why)
        self._dirty |= self.leader != leader
        self.due = 0.0
        return not why

    # For subclasses

    def follow(self, leader: str, text: str, title: str = "", before: PageState | None = None) -> None:
        """Show the state of another page from now on, or again; with a title, undo leads back to `before`."""
        if leader != self.leader:
            if not self.leader and title and before is not None:
                self.page.record(title, before)
            self.leader, self._began = leader, time.perf_counter()
            self.page.set_following(True)
            self.follower.begin()
        self.follower.show(text)
        if self.follower.moving:
            self._settles = time.perf_counter() + SETTLED

    def free(self) -> None:
        """Nobody leads this page any more."""
        if self.leader:
            self.leader, self._settles = "", None
            self.page.set_following(False)

    def twice(self, what: Hashable) -> bool:
        """Whether a button that needs two presses was pressed for the second time."""
        left = self._armed[1] - time.perf_counter() if self._armed[0] == what else 0.0
        if left > AGAIN - SURE:
            return False
        self._armed = ("", 0.0) if left > 0.0 else (what, time.perf_counter() + AGAIN)
        return left > 0.0

    def is_armed(self, what: Hashable) -> bool:
        """Whether such a button waits for the second press."""
        return self._armed[0] == what

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
