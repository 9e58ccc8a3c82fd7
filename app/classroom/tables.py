"""The tables of the classroom. `REVISION` names the migration that makes them as they are here.

A change of a table comes with a new file in ``migrations/versions`` and its name in `REVISIONS`; a test compares
what the migrations make with what is written here.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import JSON, BigInteger, Double, ForeignKey, Index, String, Text, false, text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from app.classroom.revisions import REVISIONS

REVISION = REVISIONS[-1]
ID = String(32)
TOKEN_BYTES = 8  # of random ids


class Base(DeclarativeBase):
    """All tables."""


class Setting(Base):
    """What all processes share, such as the key that signs links."""

    __tablename__ = "setting"

    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    value: Mapped[str] = mapped_column(Text)


class Room(Base):
    """One class. Everything else hangs on it and is deleted with it.

    Attributes:
        version: grows by one with each change of this row or of a seat.
        state: what the teacher has set: follow, frozen, task, shown, poll, course, course_at, own.
        page: the packed state of the teacher's page.
        beat: of earlier versions; not read any more.
        opener: a number from 1 to 1000 that the address which opened the room shares with many others; 0: none.
    """

    __tablename__ = "room"

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    code: Mapped[str] = mapped_column(String(16), unique=True)
    title: Mapped[str] = mapped_column(String(200))
    created: Mapped[float] = mapped_column(Double)
    ends: Mapped[float] = mapped_column(Double, index=True)
    version: Mapped[int] = mapped_column(BigInteger, default=0)
    state: Mapped[dict[str, Any]] = mapped_column(JSON, default=dict)
    page: Mapped[str] = mapped_column(Text, default="")
    beat: Mapped[int] = mapped_column(BigInteger, default=0)
    opener: Mapped[int] = mapped_column(default=0, server_default=text("0"))


class Seat(Base):
    """One student, who has no other name than the alias.

    Attributes:
        hand: when it was raised; 0: it is down.
        task: the exercise that the page shows, or empty.
        tries: how many attempts are stored.
        solved, version: of earlier versions; not read any more.
        gone: whether the student has stopped following.
        driven: what a program drives with the arm of the page, or empty.
        recalled: counts of answers in *Review*, as `app.classroom.views.Recalled` has them; empty: there are none.
        voted: id of the poll that `vote` belongs to.
        beat: 0 until a page of this seat has come.
        removed: by the teacher; alias, page and attempts are then erased.
    """

    __tablename__ = "seat"

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    room_id: Mapped[str] = mapped_column(ForeignKey("room.id", ondelete="CASCADE"), index=True)
    alias: Mapped[str] = mapped_column(String(64))
    joined: Mapped[float] = mapped_column(Double)
    hand: Mapped[float] = mapped_column(Double, default=0.0)
    task: Mapped[str] = mapped_column(String(200), default="")
    tries: Mapped[int] = mapped_column(default=0)
    solved: Mapped[bool] = mapped_column(default=False)
    voted: Mapped[str] = mapped_column(ID, default="")
    vote: Mapped[int] = mapped_column(default=0)
    page: Mapped[str] = mapped_column(Text, default="")
    beat: Mapped[int] = mapped_column(BigInteger, default=0)
    version: Mapped[int] = mapped_column(BigInteger, default=0)
    removed: Mapped[bool] = mapped_column(default=False, server_default=false())
    gone: Mapped[bool] = mapped_column(default=False, server_default=false())
    driven: Mapped[str] = mapped_column(Text, default="", server_default="")
    recalled: Mapped[list[int]] = mapped_column(JSON, default=list, server_default=text("'[]'"))


class Attempt(Base):
    """One answer to an exercise.

    Attributes:
        cause: the code of the mistake that led to it, or empty.
    """

    __tablename__ = "attempt"
    __table_args__ = (Index("ix_attempt_room_id_at", "room_id", "at", "id"),)  # results are read in this order

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    room_id: Mapped[str] = mapped_column(ForeignKey("room.id", ondelete="CASCADE"))
    seat_id: Mapped[str] = mapped_column(ForeignKey("seat.id", ondelete="CASCADE"), index=True)
    exercise: Mapped[str] = mapped_column(String(200))
    seed: Mapped[int] = mapped_column(BigInteger)
    answer: Mapped[Any] = mapped_column(JSON)
    verdict: Mapped[str] = mapped_column(Text)
    score: Mapped[float] = mapped_column(Double)
    started: Mapped[float] = mapped_column(Double)
    at: Mapped[float] = mapped_column(Double)
    cause: Mapped[str] = mapped_column(String(60), default="", server_default="")


class LtiRoom(Base):
    """The room of a link of a learning platform; `id` is a digest of platform, deployment and link."""

    __tablename__ = "lti_room"

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    room_id: Mapped[str] = mapped_column(ForeignKey("room.id", ondelete="CASCADE"), index=True)


class LtiSeat(Base):
    """The seat of a platform's user; `id` is a digest of the link and the user.

    Attributes:
        subject: the platform's opaque id of the user, by which it takes scores.
        address: of the gradebook's column, or empty.
        exercise: whose score goes there, or empty.
        course: ids of exercises, of which the number that is solved goes there instead; empty: none.
    """

    __tablename__ = "lti_seat"

    id: Mapped[str] = mapped_column(ID, primary_key=True)
    seat_id: Mapped[str] = mapped_column(ForeignKey("seat.id", ondelete="CASCADE"), index=True)
    issuer: Mapped[str] = mapped_column(Text)
    client_id: Mapped[str] = mapped_column(Text)
    subject: Mapped[str] = mapped_column(String(255))
    address: Mapped[str] = mapped_column(Text)
    exercise: Mapped[str] = mapped_column(String(200))
    course: Mapped[list[str]] = mapped_column(JSON, default=list, server_default=text("'[]'"))


class LtiNonce(Base):
    """A nonce of a launch that was used."""

    __tablename__ = "lti_nonce"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    expires: Mapped[float] = mapped_column(Double, index=True)
