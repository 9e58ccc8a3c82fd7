"""One page in a room: what it may ask, report and set."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Hashable, Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from app.classroom.clock import now
from app.classroom.live import LiveRoom
from app.classroom.tokens import Tokens
from app.classroom.views import Confirmed, NewAttempt, RefusedError, RoomView, Ticket

if TYPE_CHECKING:
    from app.classroom.rooms import Swept

LONGEST_PAGE = 16_000  # characters, as `app.viewer.session.state` has it
LONGEST_NAME = 60  # characters of what a program drives
NO_OWN: Mapping[str, str] = MappingProxyType({})
LONGEST_QUESTION, LONGEST_CHOICE, MOST_CHOICES = 200, 80, 8


class StoredRooms(Protocol):
    """What `app.classroom.rooms.Rooms` does for a page."""

    @property
    def tokens(self) -> Tokens: ...

    def submit(self, ticket: Ticket, attempt: NewAttempt) -> Confirmed: ...

    def remove_seat(self, room: str, seat: str) -> None: ...

    def remove_unseen(self, room: str) -> Swept: ...

    def rename_seat(self, room: str, seat: str, alias: str) -> str: ...

    def end(self, room: str) -> bool: ...


class LiveRooms(Protocol):
    """What `app.classroom.hub.Hub` does for a page."""

    on_attempt: Callable[[str], None] | None

    @property
    def rooms(self) -> StoredRooms: ...

    def view(self, ticket: Ticket) -> RoomView: ...

    def tell(self, ticket: Ticket, change: Callable[[LiveRoom], None]) -> None: ...

    def tell_later(self, ticket: Ticket, page: str) -> None: ...

    def refresh(self, room: str) -> None: ...

    def closed(self, room: str) -> None: ...

    def leave(self, page: Attendance) -> None: ...


class Attendance:
    """One page in a room. Methods for the teacher raise `PermissionError` for a student, and the reverse."""

    def __init__(
        self, hub: LiveRooms, ticket: Ticket, changed: Callable[[], None], silence: Callable[[], float]
    ) -> None:
        self.ticket = ticket
        self.changed = changed
        self.silence = silence  # for how many seconds nothing has come from the page's browser
        self.stamp: Hashable = None  # of what the page was last notified of
        self._hub = hub
        self._page = ""  # the teacher's, also while nobody follows
        self._last: RoomView | None = None

    @property
    def room(self) -> RoomView:
        """The latest state that is known."""
        if self._last is not None:
            return self._last
        return self._hub.view(self.ticket)

    def leave(self) -> None:
        """The page has gone; `room` keeps its last value. The seat remains."""
        self._last = self.room
        self._hub.leave(self)

    def tell_page(self, packed: str) -> None:
        """The page's packed state: the teacher's for all who follow, a student's for the teacher's wall."""
        if len(packed) > LONGEST_PAGE:
            raise ValueError(f"the page's state has {len(packed)} characters; at most {LONGEST_PAGE} are allowed")
        if self.ticket.seat:
            self._hub.tell_later(self.ticket, packed)
            return
        self._page = packed
        self._hub.tell(self.ticket, lambda live: live.tell_page(packed) if live.state.get("follow") else None)

    # Students

    def raise_hand(self, up: bool) -> None:
        """Raise or lower the own hand."""
        self._tell_seat(hand=now() if up else 0.0)

    def vote(self, choice: int) -> None:
        """Choose in the open poll; the last choice counts. Raises `RefusedError` if there is no such choice."""
        self._only_student()
        poll = self.room.poll
        if poll is None or not poll.open:
            raise RefusedError("The question is closed.")
        if not 0 <= choice < len(poll.choices):
            raise RefusedError("The question has no such choice.")
        self._tell_seat(voted=poll.id, vote=choice)

    def tell_task(self, exercise: str) -> None:
        """The exercise that the page shows now, or empty."""
        self._only_student()
        seat = self.room.seat
        if seat is not None and seat.task != exercise:
            self._tell_seat(task=exercise[:200])

    def tell_gone(self, gone: bool) -> None:
        """Whether the student has stopped following."""
        self._only_student()
        seat = self.room.seat
        if seat is not None and seat.gone != gone:
            self._tell_seat(gone=gone)

    def tell_driven(self, name: str) -> None:
        """What a program drives with the arm of this page, or empty."""
        self._only_student()
        seat = self.room.seat
        if seat is not None and seat.driven != name:
            self._tell_seat(driven=name[:LONGEST_NAME])

    def secret(self) -> bytes:
        """A secret of the seat, from which the numbers of its exercises follow; raises `ClassroomUnavailable`."""
        self._only_student()
        return self._hub.rooms.tokens.secret(self.ticket)

    def submit(self, attempt: NewAttempt) -> Confirmed:
        """Store an attempt; returns when it is stored for good.

        Raises:
            ClassroomUnavailable: it may not be stored. Submitting the same attempt again stores it once.
            RefusedError: the room has ended, or the seat was removed.
        """
        self._only_student()
        confirmed = self._hub.rooms.submit(self.ticket, attempt)
        self._hub.refresh(self.ticket.room)
        if self._hub.on_attempt is not None:
            self._hub.on_attempt(self.ticket.seat)
        return confirmed

    # The teacher

    def set_follow(self, on: bool) -> None:
        """Whether all pages follow the teacher's."""

        def change(live: LiveRoom) -> None:
            live.tell_state({"follow": on})
            if on and self._page:
                live.tell_page(self._page)

        self._only_teacher()
        self._hub.tell(self.ticket, change)

    def set_frozen(self, on: bool) -> None:
        """Whether students may not move their arms."""
        self._tell_state(frozen=on)

    def send_task(self, exercise: str | None, own: str = "") -> None:
        """Set an exercise for all, which ends following and freezing; None: there is none any more.

        Args:
            own: the text of an exercise that only the teacher's page has.
        """
        if exercise is None:
            self._tell_state(task=None)
        else:
            task = {"exercise": exercise[:200], "at": now(), **({"own": own} if own else {})}
            self._send({exercise: own} if own else {}, task=task, follow=False, frozen=False)

    def send_course(self, packed: str, own: Mapping[str, str] = NO_OWN) -> None:
        """Set a packed course for all, which ends the task, following and freezing; empty: there is none.

        Args:
            own: the texts of the exercises that it brings along, by id.
        """
        if packed:
            self._send(own, course=packed, course_at=now(), task=None, follow=False, frozen=False)
        else:
            self._tell_state(course="")

    def show_seat(self, seat: str | None, named: bool = True) -> None:
        """Show a student's arm to all, with the alias or without; None: nobody's."""
        self._tell_state(shown=None if seat is None else {"seat": seat, "named": named})

    def lower_hand(self, seat: str) -> None:
        """Lower a student's hand."""
        self._only_teacher()
        self._hub.tell(self.ticket, lambda live: live.tell_seat(seat, {"hand": 0.0}))

    def open_poll(self, question: str, choices: Iterable[str]) -> None:
        """Ask all; raises `RefusedError` if the texts are too long or too few."""
        texts = [" ".join(choice.split()) for choice in choices]
        if not 2 <= len(texts) <= MOST_CHOICES or not all(0 < len(each) <= LONGEST_CHOICE for each in texts):
            raise RefusedError(
                f"A question has 2 to {MOST_CHOICES} choices of 1 to {LONGEST_CHOICE} characters.", "choices"
            )
        if not 0 < len(question.strip()) <= LONGEST_QUESTION:
            raise RefusedError(f"A question has 1 to {LONGEST_QUESTION} characters.", "question")
        poll = {"id": secrets.token_hex(8), "question": question.strip(), "choices": texts, "open": True}
        self._tell_state(poll=poll)

    def close_poll(self) -> None:
        """Accept no more votes; the result stays."""
        self._only_teacher()

        def change(live: LiveRoom) -> None:
            if poll := live.state.get("poll"):
                live.tell_state({"poll": {**poll, "open": False}})

        self._hub.tell(self.ticket, change)

    def remove_poll(self) -> None:
        """Take the question and its result off all pages."""
        self._tell_state(poll=None)

    def remove_seat(self, seat: str) -> None:
        """Remove a student, with alias, page and attempts; raises `ClassroomUnavailable`."""
        self._only_teacher()
        self._hub.rooms.remove_seat(self.ticket.room, seat)
        self._hub.refresh(self.ticket.room)

    def remove_unseen(self) -> Swept:
        """Remove who has joined a while ago without ever opening a page; returns how many, and who stays."""
        self._only_teacher()
        swept = self._hub.rooms.remove_unseen(self.ticket.room)
        self._hub.refresh(self.ticket.room)
        return swept

    def rename_seat(self, seat: str, alias: str) -> str:
        """Give a student another alias; returns it, which may have got a number.

        Raises `RefusedError` or `ClassroomUnavailable`.
        """
        self._only_teacher()
        given = self._hub.rooms.rename_seat(self.ticket.room, seat, alias)
        self._hub.refresh(self.ticket.room)
        return given

    def end_room(self) -> None:
        """End the room for all and erase everything in it; raises `ClassroomUnavailable`."""
        self._only_teacher()
        self._hub.rooms.end(self.ticket.room)
        self._hub.closed(self.ticket.room)

    def teacher_token(self) -> str:
        """What the teacher's link holds."""
        self._only_teacher()
        return self._hub.rooms.tokens.sign(self.ticket)

    def _tell_seat(self, **values: object) -> None:
        self._only_student()
        self._hub.tell(self.ticket, lambda live: live.tell_seat(self.ticket.seat, values))

    def _send(self, own: Mapping[str, str], **values: object) -> None:
        """Set this for all, and keep the own exercises that come with it."""

        def change(live: LiveRoom) -> None:
            live.tell_own(own)
            live.tell_state(values)

        self._only_teacher()
        self._hub.tell(self.ticket, change)

    def _tell_state(self, **values: object) -> None:
        self._only_teacher()
        self._hub.tell(self.ticket, lambda live: live.tell_state(values))

    def _only_teacher(self) -> None:
        if self.ticket.seat:
            raise PermissionError("only the teacher may do this")

    def _only_student(self) -> None:
        if not self.ticket.seat:
            raise PermissionError("only a student may do this")
