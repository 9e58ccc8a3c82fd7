"""One page in a room: what it may ask, report and set."""

from __future__ import annotations

import secrets
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from app.classroom.clock import now
from app.classroom.live import LiveRoom, Place
from app.classroom.views import Confirmed, NewAttempt, Recalled, RefusedError, RoomView, Ticket

if TYPE_CHECKING:
    from app.classroom.rooms import Rooms, Swept

LONGEST_PAGE = 16_000  # characters, as `app.viewer.session.state` has it
LONGEST_NAME = 60  # characters of what a program drives
NO_OWN: Mapping[str, str] = MappingProxyType({})
LONGEST_QUESTION, LONGEST_CHOICE, MOST_CHOICES = 200, 80, 8


class Attendance:
    """One page in a room. Methods for the teacher raise `PermissionError` for a student, and the reverse."""

    def __init__(self, rooms: Rooms, live: LiveRoom, place: Place) -> None:
        self.ticket: Ticket = place.ticket
        self._rooms, self._live, self._place = rooms, live, place
        self._page = ""  # the teacher's, also while nobody follows
        self._last: RoomView | None = None

    @property
    def room(self) -> RoomView:
        """The latest state."""
        return self._last or self._live.view(self.ticket)

    def leave(self) -> None:
        """The page has gone; `room` keeps its last value. The seat remains."""
        self._last = self.room
        self._live.leave(self._place)

    def tell_page(self, packed: str) -> None:
        """The page's packed state: the teacher's for all who follow, a student's for the teacher's wall."""
        if len(packed) > LONGEST_PAGE:
            raise ValueError(f"the page's state has {len(packed)} characters; at most {LONGEST_PAGE} are allowed")
        if self.ticket.seat:
            self._live.report_arm(self.ticket.seat, packed)
            return
        self._page = packed
        if self._live.following:
            self._set(page=packed)

    # Students

    def raise_hand(self, up: bool) -> None:
        """Raise or lower the own hand."""
        self._report(hand=now() if up else 0.0)

    def vote(self, choice: int) -> None:
        """Choose in the open poll; the last choice counts. Raises `RefusedError` if there is no such choice."""
        self._only_student()
        poll = self.room.poll
        if poll is None or not poll.open:
            raise RefusedError("The question is closed.")
        if not 0 <= choice < len(poll.choices):
            raise RefusedError("The question has no such choice.")
        self._report(voted=poll.id, vote=choice)

    def tell_task(self, exercise: str) -> None:
        """The exercise that the page shows now, or empty."""
        self._report(task=exercise[:200])

    def tell_gone(self, gone: bool) -> None:
        """Whether the student has stopped following."""
        self._report(gone=gone)

    def tell_driven(self, name: str) -> None:
        """What a program drives with the arm of this page, or empty."""
        self._report(driven=name[:LONGEST_NAME])

    def secret(self) -> bytes:
        """A secret of the seat, from which the numbers of its exercises follow; raises `ClassroomUnavailable`."""
        self._only_student()
        return self._rooms.tokens.secret(self.ticket)

    def tell_recalled(self, more: Recalled) -> None:
        """More answers of *Review*, besides those before."""
        self._only_student()
        self._live.report_recalled(self.ticket.seat, more)

    def submit(self, attempt: NewAttempt) -> Confirmed:
        """Store an attempt; returns when it is stored for good.

        Raises:
            ClassroomUnavailable: it may not be stored. Submitting the same attempt again stores it once.
            RefusedError: the room has ended, or the seat was removed.
        """
        self._only_student()
        return self._rooms.submit(self.ticket, attempt)

    # The teacher

    def set_follow(self, on: bool) -> None:
        """Whether all pages follow the teacher's."""
        self._set(page=self._page if on and self._page else None, follow=on)

    def set_frozen(self, on: bool) -> None:
        """Whether students may not move their arms."""
        self._set(frozen=on)

    def send_task(self, exercise: str | None, own: str = "") -> None:
        """Set an exercise for all, which ends following and freezing; None: there is none any more.

        Args:
            own: the text of an exercise that only the teacher's page has.
        """
        if exercise is None:
            self._set(task=None)
        else:
            task = {"exercise": exercise[:200], "at": now(), **({"own": own} if own else {})}
            self._set(own={exercise: own} if own else NO_OWN, task=task, follow=False, frozen=False)

    def send_course(self, packed: str, own: Mapping[str, str] = NO_OWN) -> None:
        """Set a packed course for all, which ends the task, following and freezing; empty: there is none.

        Args:
            own: the texts of the exercises that it brings along, by id.
        """
        if packed:
            self._set(own=own, course=packed, course_at=now(), task=None, follow=False, frozen=False)
        else:
            self._set(course="")

    def show_seat(self, seat: str | None, named: bool = True) -> None:
        """Show a student's arm to all, with the alias or without; None: nobody's."""
        self._set(shown=None if seat is None else {"seat": seat, "named": named})

    def lower_hand(self, seat: str) -> None:
        """Lower a student's hand."""
        self._only_teacher()
        self._live.report_seat(seat, hand=0.0)

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
        self._set(poll=poll)

    def close_poll(self) -> None:
        """Accept no more votes; the result stays."""
        self._only_teacher()
        if (poll := self.room.poll) is not None:
            asked = {"id": poll.id, "question": poll.question, "choices": [*poll.choices]}
            self._set(poll={**asked, "open": False})

    def remove_poll(self) -> None:
        """Take the question and its result off all pages."""
        self._set(poll=None)

    def remove_seat(self, seat: str) -> None:
        """Remove a student, with alias, page and attempts; raises `ClassroomUnavailable`."""
        self._only_teacher()
        self._rooms.remove_seat(self.ticket.room, seat)

    def remove_unseen(self) -> Swept:
        """Remove who has joined a while ago without ever opening a page; returns how many, and who stays."""
        self._only_teacher()
        return self._rooms.remove_unseen(self.ticket.room)

    def rename_seat(self, seat: str, alias: str) -> str:
        """Give a student another alias; returns it, which may have got a number.

        Raises `RefusedError` or `ClassroomUnavailable`.
        """
        self._only_teacher()
        return self._rooms.rename_seat(self.ticket.room, seat, alias)

    def end_room(self) -> None:
        """End the room for all and erase everything in it; raises `ClassroomUnavailable`."""
        self._only_teacher()
        self._rooms.end(self.ticket.room)

    def _report(self, **columns: object) -> None:
        self._only_student()
        self._live.report_seat(self.ticket.seat, **columns)

    def _set(self, page: str | None = None, own: Mapping[str, str] = NO_OWN, **state: object) -> None:
        self._only_teacher()
        self._live.report(page, own, **state)

    def _only_teacher(self) -> None:
        if not self.ticket.teaches:
            raise PermissionError("only the teacher may do this")

    def _only_student(self) -> None:
        if self.ticket.teaches:
            raise PermissionError("only a student may do this")
