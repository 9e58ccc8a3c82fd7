"""The teacher's page of results: a live table, who is stuck first, and all attempts as CSV."""

from __future__ import annotations

import codecs
import logging
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.types import Send

from app.api.problems import ProblemError
from app.classroom import COOKIE, ClassroomUnavailable, Hub
from app.classroom.clock import now
from app.classroom.courses import Courses, SentExercises
from app.classroom.results.gains import LEAST, Gain, Gains, Pair, csv_of_gains, exercises_of, gains, pairs_of
from app.classroom.results.items import MOST as MOST_CAUSES
from app.classroom.results.items import Item, items
from app.classroom.results.table import Row, csv_of, rows
from app.classroom.views import Recalled
from app.classroom.work import Attempt
from app.service.web.rooms.page import results_page
from kin.units import fixed

if TYPE_CHECKING:
    from app.classroom.results.store import Sent
    from app.classroom.rooms import OpenRoom

logger = logging.getLogger("kinboard.classroom")

MOST = 400  # rows on the screen; the file has all attempts
CSV = "text/csv; charset=utf-8"


class _Read(NamedTuple):
    """What the database has of a class: the room, what it was sent, and what has become of that."""

    room: OpenRoom
    sent: Sent
    table: list[Row]
    pairs: list[Pair]
    gains: list[Gains]
    items: list[Item]
    recalled: Recalled


class Results:
    """The pages of the attempts of a room; only for its teacher."""

    def __init__(self, hub: Hub, courses: Callable[[], Courses]) -> None:
        self._hub, self._courses = hub, courses

    @staticmethod
    def away(request: Request, why: str) -> Response:
        """The page while the database is away."""
        return results_page(request, 503, problem=why)

    async def show(self, request: Request) -> Response:
        """The tables; their script asks for this page again and again."""
        return await run_in_threadpool(self._show, request)  # pages of rooms move meanwhile

    def _show(self, request: Request) -> Response:
        read = self._read(request.cookies.get(COOKIE, ""))
        sent, table, known = read.sent, read.table, self._known(read.sent)
        shown = _rows(known, table[:MOST])
        states = ("stuck", "gave up", "not begun", "at it", "solved", "not here yet")
        counted = [row for row in table if not sent.task or row.exercise == sent.task]
        counts = {state: sum(row.state == state for row in counted) for state in states}
        titles = known.titles if read.pairs or read.items else {}
        return results_page(
            request,
            room=read.room,
            rows=shown,
            counts=counts,
            more=len(table) - len(shown),
            pairs=[[titles.get(key, key) for key in pair] for pair in read.pairs],
            gains=[_compared(row) for row in read.gains[: MOST + 1]],
            items=[(titles.get(one.exercise, one.exercise), _figures(one), one) for one in read.items],
            recalled=read.recalled,
            most_causes=MOST_CAUSES,
        )

    async def download(self, request: Request) -> Response:
        """One row per attempt; what has been read is sent before more is."""
        from app.classroom.results.store import pages_of, sent_to

        room = await run_in_threadpool(self._room, request.cookies.get(COOKIE, ""))
        pages = pages_of(self._hub.database, room.id)
        first: list[Attempt] = await run_in_threadpool(next, pages, [])
        sent = await run_in_threadpool(sent_to, self._hub.database, room.id)
        titles = await run_in_threadpool(lambda: self._known(sent).titles)
        texts = csv_of(chain([first], pages), titles)
        return _Download(_encoded(texts), media_type=CSV, headers=_as_file("results", room))

    async def download_gains(self, request: Request) -> Response:
        """A row for each pair of exercises and student, and for the class."""
        read = await run_in_threadpool(self._read, request.cookies.get(COOKIE, ""))
        text = csv_of_gains(read.gains, read.pairs)
        return Response(codecs.BOM_UTF8 + text.encode(), media_type=CSV, headers=_as_file("gains", read.room))

    def _read(self, token: str) -> _Read:
        """The room of the teacher's cookie.

        Raises:
            ProblemError: 403.
        """
        from app.classroom.results.store import attempts_of, members_of, recalled_of, sent_to  # SQLAlchemy

        room, database = self._room(token), self._hub.database
        attempts = attempts_of(database, room.id, answers=False)
        sent = sent_to(database, room.id)
        members, pairs = members_of(database, room.id), pairs_of(sent.course)
        table = rows(members, attempts, sent.task, now())
        compared = gains(members, attempts, pairs) if pairs else []
        asked = items(members, attempts, exercises_of(sent.course))
        return _Read(room, sent, table, pairs, compared, asked, recalled_of(database, room.id))

    def _room(self, token: str) -> OpenRoom:
        """The room of the teacher's cookie; raises 403."""
        ticket = self._hub.ticket(token)
        room = self._hub.rooms.find(ticket) if ticket is not None and ticket.teaches else None
        if room is None:
            raise ProblemError(
                403, "forbidden", "Only the teacher may see the results.", "Open the teacher's link."
            )
        return room

    def _known(self, sent: Sent) -> SentExercises:
        courses = self._courses()
        return SentExercises(courses.exercises, sent.own, courses.find)


def _as_file(name: str, room: OpenRoom) -> dict[str, str]:
    """Header fields of a file."""
    file = f"{name}-{room.code.lower()}.csv"
    return {"content-disposition": f'attachment; filename="{file}"', "cache-control": "no-store"}


def _rows(known: SentExercises, table: Iterable[Row]) -> list[dict[str, object]]:
    """The rows as the page has them."""
    found: list[dict[str, object]] = []
    for row in table:
        work, said = row.work, str(row.work.answer or "")
        found.append(
            {
                "alias": row.member.alias,
                "number": row.member.number,
                "state": row.state,
                "title": known.title(row.exercise),
                "tries": work.tries,
                "score": round(100 * work.score),
                "time": _clock(row.seconds),
                "answer": known.said(row.exercise, work.seed, said) if work.tries else said,
                "verdict": work.verdict,
                "begun": bool(work.numbers),
            }
        )
    return found


def _figures(one: Item) -> list[str]:
    """The figures of an exercise as the page has them, in the order of its columns."""
    r, seconds = one.discrimination, one.seconds
    return [
        f"{one.first} of {one.students}",
        "" if seconds is None else _clock(seconds),
        "" if r is None else fixed(r, 2),
        f"{one.looked} of {one.students}",
    ]


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


def _compared(row: Gains) -> dict[str, object]:
    """A row of gains as the page has it."""
    alias = "" if row.member is None else row.member.alias
    return {"alias": alias, "compared": [_in_words(one) for one in (*row.items, row.whole)]}


def _in_words(one: Gain) -> dict[str, object]:
    scores = ["–" if value is None else f"{100 * value:.0f} %" for value in (one.before, one.after)]
    said = []
    if one.orders and one.difference is not None:
        interval = "no interval: within each order, all changed alike"
        if one.interval is not None:
            interval = "95 %: {:+.0f} to {:+.0f}".format(*(100.0 * end for end in one.interval))
        said.append(f"{100 * one.difference:+.0f} points ({interval})".replace("-", "−"))
        if one.orders == 1:
            said.append("all in one order: a harder exercise counts as a loss, an easier one as a gain")
    if one.gain is not None:
        said.append(f"g = {fixed(one.gain, 2)}")
    elif one.difference is not None:
        said.append("all right before")
    fewer = "" if one.enough else f"; a gain is said from {LEAST} on"
    return {
        "before": scores[0],
        "after": scores[1],
        "said": said,
        "students": f"{one.students} answered both{fewer}",
        "exchanged": one.exchanged,
    }


class _Download(StreamingResponse):
    """A file that is cut off if the database is lost meanwhile: its end is not sent, so the browser says so."""

    async def stream_response(self, send: Send) -> None:
        try:
            await super().stream_response(send)
        except ClassroomUnavailable as error:
            logger.warning("a file of results was cut off: %s", error)


def _encoded(texts: Iterable[str]) -> Iterator[bytes]:
    yield codecs.BOM_UTF8  # tells spreadsheets which letters these are
    for text in texts:
        yield text.encode()
