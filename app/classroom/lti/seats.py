"""Who sits where on behalf of which platform: rooms of resource links, seats of users, nonces that were used."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from sqlalchemy import delete, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from app.classroom.clock import now
from app.classroom.database import PATIENCE, Database
from app.classroom.lti.contents import Content
from app.classroom.lti.launches import Launch
from app.classroom.rooms import LONGEST_ALIAS, LONGEST_TITLE, Rooms, clean_name
from app.classroom.tables import Attempt, LtiNonce, LtiRoom, LtiSeat, Room, Seat
from app.classroom.views import RefusedError, Ticket

LIFE = 120 * 24 * 3600.0  # s: a term


@dataclass(frozen=True)
class Column:
    """Where the score of a seat goes.

    Attributes:
        score: 0 to `most`.
        done: whether nothing is left to do.
    """

    issuer: str
    client_id: str
    address: str
    user: str
    score: float
    most: int
    done: bool


class LtiSeats:
    """Rooms and seats of launches, in the classroom's database."""

    def __init__(self, database: Database, rooms: Rooms) -> None:
        self._database = database
        self._rooms = rooms

    def use_nonce(self, nonce: str, expires: float) -> bool:
        """Use up a nonce until a time of rooms; False if it was used before, by whichever process."""
        with self._database.write(wait=PATIENCE) as connection:
            connection.execute(delete(LtiNonce).where(LtiNonce.expires < now()))
            try:
                with connection.begin_nested():
                    connection.execute(insert(LtiNonce).values(id=nonce, expires=expires))
            except IntegrityError:
                return False
        return True

    def take(self, launch: Launch, content: Content | None) -> Ticket:
        """The room of the launch's link for a teacher, a seat in it for anybody else; raises `RefusedError`.

        Args:
            content: what the link opens, whose score goes to the platform.
        """
        platform = launch.platform
        parts = (platform.issuer, platform.client_id, launch.deployment, launch.resource)
        link = _digest(*parts)
        room, code = self._room(link, launch, content)
        if launch.teacher:
            return Ticket(room)
        user = _digest(link, launch.user)
        with self._database.read() as connection:
            query = select(LtiSeat.seat_id).join(Seat, Seat.id == LtiSeat.seat_id)
            known = connection.scalar(query.where(LtiSeat.id == user, Seat.removed.is_(False)))
        ticket = self._rooms.join(
            code,
            _named(launch.alias, LONGEST_ALIAS, "Student"),
            None if known is None else Ticket(room, known),
        )
        values = {
            "issuer": platform.issuer,
            "client_id": platform.client_id,
            "subject": launch.user,
            "address": launch.grades,
            "exercise": content.key if content is not None and content.kind == "exercise" else "",
            "course": [] if content is None else [*content.exercises],
            "seat_id": ticket.seat,
        }
        with self._database.write(wait=PATIENCE) as connection:
            changed = connection.execute(update(LtiSeat).where(LtiSeat.id == user).values(**values))
            if not changed.rowcount:
                connection.execute(insert(LtiSeat).values(id=user, **values))
        return ticket

    def column(self, seat: str) -> Column | None:
        """Where the score of this seat goes; None: nowhere, or there is none yet.

        The score is that of the best attempt at the link's exercise, or how many exercises of the link's course
        are solved.
        """
        with self._database.read() as connection:
            row = connection.execute(select(LtiSeat).where(LtiSeat.seat_id == seat)).one_or_none()
            if row is None or not row.address:
                return None
            asked = row.course or [row.exercise]
            best = select(func.max(Attempt.score)).where(Attempt.seat_id == seat, Attempt.exercise.in_(asked))
            scores = connection.scalars(best.group_by(Attempt.exercise)).all()
        if not scores:
            return None
        score, most = (sum(each >= 1.0 for each in scores), len(asked)) if row.course else (scores[0], 1)
        done = not row.course or score == most
        return Column(row.issuer, row.client_id, row.address, row.subject, score, most, done)

    def _room(self, link: str, launch: Launch, content: Content | None) -> tuple[str, str]:
        query = select(Room.id, Room.code).join(LtiRoom, LtiRoom.room_id == Room.id).where(LtiRoom.id == link)
        with self._database.read() as connection:
            found = connection.execute(query.where(Room.ends > now())).one_or_none()
        if found is not None:
            return found.id, found.code
        made = self._rooms.open(_named(launch.title, LONGEST_TITLE, "Class"), LIFE)
        state = {} if content is None else content.state(made.created)
        with self._database.write(wait=PATIENCE) as connection:
            found = connection.execute(query).one_or_none()  # another launch may have been faster
            if found is None:
                connection.execute(delete(LtiRoom).where(LtiRoom.id == link))
                connection.execute(insert(LtiRoom).values(id=link, room_id=made.id))
                connection.execute(update(Room).where(Room.id == made.id).values(state=state))
                return made.id, made.code
        self._rooms.end(made.id)
        return found.id, found.code


def _named(text: str, longest: int, default: str) -> str:
    """A platform's name for somebody or something, shortened; the default if nothing is left of it."""
    try:
        return clean_name(text[:longest], longest, "name")
    except RefusedError:
        return default


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]
