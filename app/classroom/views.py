"""What pages and programs see of a room. All of it is immutable and knows no database."""

from __future__ import annotations

import secrets
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import NamedTuple

from app.classroom.work import ANSWER_SHOWN, Work

BUSY = "The classroom's database has too much to do at present. Try again in a moment."
NO_ROOM = "No room has this code. Ask your teacher; rooms end after a while."
# What can be said of a room that has ended.
ERASED = "The room has ended. Everything in it was erased."
ERASING = (
    "The room has ended, and nobody can open it any more. Another program is reading the database: "
    "what was in the room is erased from its file as soon as that program lets go."
)
DELETED = (
    "The room has ended. Everything in it was deleted from the database; "
    "its server overwrites it later, and backups may have it."
)


class ClassroomUnavailable(Exception):  # noqa: N818 - a state of the service, not a mistake of the caller
    """The classroom's database is gone, locked or full. The message is a sentence for the page."""


class RefusedError(Exception):
    """What was asked is not possible, such as joining with a wrong code; the message is a sentence for the page.

    Attributes:
        field: the name of the wrong field of a form, or empty.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field


class UnknownRoomError(RefusedError):
    """There is no room with this code, or it has ended."""


@dataclass(frozen=True)
class Ticket:
    """Whom a verified token admits to which room: its teacher, or the student of one seat."""

    room: str
    seat: str = ""

    @property
    def teaches(self) -> bool:
        """Whether it is the teacher's, who has no seat."""
        return not self.seat


@dataclass(frozen=True)
class SeatView:
    """A student's seat.

    Attributes:
        hand: when the hand was raised, in seconds since 1970; 0: it is down.
        task: the exercise that the student's page shows, or empty.
        gone: whether the student has stopped following.
        driven: what a program drives with the arm of the student's page, or empty.
        work: what was answered, by exercise.
        page: the packed state of the page (`app.viewer.session.state`), or empty.
        away: whether no page of this seat is connected.
        came: whether one ever was, or an answer of it is stored.
    """

    id: str
    alias: str
    hand: float = 0.0
    task: str = ""
    gone: bool = False
    driven: str = ""
    work: Mapping[str, Work] = field(default_factory=dict)
    page: str = ""
    away: bool = False
    came: bool = True


@dataclass(frozen=True)
class Task:
    """What the teacher has set for all.

    Attributes:
        exercise: id of the exercise.
        at: when, in seconds since 1970; the same exercise set again is another task.
        own: its text, if only the teacher's page has it.
    """

    exercise: str
    at: float
    own: str = ""


@dataclass(frozen=True)
class Shown:
    """A student's arm that all see.

    Attributes:
        alias: empty if the teacher hides it.
        page: packed state of the student's page.
    """

    seat: str
    alias: str
    page: str


@dataclass(frozen=True)
class Poll:
    """An anonymous question to all.

    Attributes:
        votes: how many chose each of the choices.
        chosen: the choice of the seat that looks, or None.
    """

    id: str
    question: str
    choices: tuple[str, ...]
    open: bool
    votes: tuple[int, ...]
    chosen: int | None = None


@dataclass(frozen=True)
class RoomView:
    """The latest known state of a room, as one page may see it.

    Attributes:
        ends: when everything in it is erased, in seconds since 1970.
        page: the teacher's packed page state; empty before the teacher has shared one.
        follow: whether pages follow the teacher.
        frozen: whether students may not move their arms.
        course: the packed course, or empty.
        course_at: when it was sent, in seconds since 1970; the same course sent again opens again.
        exchanged: whether this student gets the exercises that the course compares in the other order, as every
            second one in the order of joining does.
        own: the texts of the exercises that the teacher wrote and sent, by id, the newest at the end; empty for
            students.
        teacher_away: whether no page of the teacher is connected: the class is paused.
        students: number of seats.
        seat: the own seat; None for the teacher.
        seats: all seats in the order of joining, for the teacher; empty for students.
        closed: why the room is over for this page, as a sentence; empty while it is not.
        problem: what is wrong with the database at present, as a sentence; empty if nothing is.
    """

    id: str
    code: str = ""
    title: str = ""
    created: float = 0.0
    ends: float = 0.0
    page: str = ""
    follow: bool = False
    frozen: bool = False
    task: Task | None = None
    shown: Shown | None = None
    poll: Poll | None = None
    course: str = ""
    course_at: float = 0.0
    exchanged: bool = False
    own: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    teacher_away: bool = False
    students: int = 0
    seat: SeatView | None = None
    seats: tuple[SeatView, ...] = ()
    closed: str = ""
    problem: str = ""


@dataclass(frozen=True)
class NewAttempt:
    """An answer to an exercise that has been judged, or a request for the right answer (`gave_up`).

    Attributes:
        answer: plain data, as the page gave it.
        verdict: the sentence the student saw.
        score: 0 to 1.
        started: when the student began, in seconds since 1970.
        id: made once per attempt: storing it again, after an error, stores nothing twice.
        cause: of a wrong answer, the code of the mistake.
    """

    exercise: str
    seed: int
    answer: object
    verdict: str
    score: float
    started: float
    id: str = field(default_factory=lambda: secrets.token_hex(8))
    cause: str = ""

    @property
    def gave_up(self) -> bool:
        """Whether the answer is shown instead: later answers to these numbers do not count."""
        return self.verdict == ANSWER_SHOWN

    @classmethod
    def given_up(cls, exercise: str, seed: int, started: float) -> NewAttempt:
        """The answer is to be shown."""
        return cls(exercise, seed, None, ANSWER_SHOWN, 0.0, started)


class Recalled(NamedTuple):
    """Counts of what was asked again in *Review*: of one answer, of a student or of a class.

    Attributes:
        late, late_right: what was asked seven days and more after the last answer that counted, and how much of it
            was right.
        new, new_right: the same of questions about another arm than those that the list of what was missed knows.
    """

    late: int = 0
    late_right: int = 0
    new: int = 0
    new_right: int = 0

    def plus(self, counts: Iterable[int]) -> Recalled:
        """With other counts; none: they are zero."""
        return Recalled(*map(sum, zip_longest(self, counts, fillvalue=0)))


@dataclass(frozen=True)
class Confirmed:
    """An attempt that is stored: neither a crash nor a power failure loses it."""

    id: str
    at: float


def in_one_line(text: str) -> str:
    """A name in one line, without control characters, as rooms keep it."""
    text = unicodedata.normalize("NFC", text)
    kept = "".join(letter if unicodedata.category(letter)[0] not in "CZ" else " " for letter in text)
    return " ".join(kept.split())
