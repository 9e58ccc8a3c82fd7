"""The routes below ``/room``.

Who has opened or joined a room gets a cookie with a signed token, which the viewer reads when it connects. The
cookie is not sent with requests that other sites make, and forms are only accepted from our own pages.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from app.api.problems import ProblemError
from app.classroom import COOKIE, ClassroomUnavailable, Hub, RefusedError, Ticket, UnknownRoomError
from app.classroom.clock import now
from app.classroom.courses import Courses
from app.classroom.tokens import LONGEST_TOKEN, read_code, show_code
from app.classroom.views import ERASING, in_one_line
from app.service.web.access import forget_guest, form_of, may_open, pass_guest
from app.service.web.rooms.limits import Limits
from app.service.web.rooms.page import ends_at, ends_in_words, join_address, qr_svg, room_page
from app.service.web.rooms.results import Results
from app.shared.clients import client_of
from app.shared.security import origin_allowed, set_cookie
from app.shared.settings import Settings
from kin.files.numbers import number_of

if TYPE_CHECKING:
    from app.classroom.rooms import OpenRoom

Page = Callable[[Request], Awaitable[Response]]

ASK_ERASED = 3  # seconds until the page asks again whether an ended room is erased


def room_routes(
    hub: Hub, settings: Settings, courses: Callable[[], Courses], limits: Limits | None = None
) -> list[BaseRoute]:
    """The pages of rooms; `courses` has the exercises that they name, `limits` counts codes, others' too."""
    results = Results(hub, courses)
    pages = _Pages(hub, settings.allowed_origins, bool(settings.frame_ancestors), limits or Limits())
    return [
        Route("/room", _in_words(pages.show, _away), methods=["GET"], name="room"),
        Route("/room", pages.open, methods=["POST"]),
        Route("/room/join", pages.join, methods=["POST"]),
        Route("/room/teach/{token}", _in_words(pages.teach, _away), methods=["GET"]),
        Route("/room/qr.svg", _in_words(pages.qr, _busy), methods=["GET"]),
        Route("/room/results", _in_words(results.show, results.away), methods=["GET"]),
        Route("/room/results.csv", _in_words(results.download, _busy), methods=["GET"]),
        Route("/room/gains.csv", _in_words(results.download_gains, _busy), methods=["GET"]),
        Route("/room/leave", pages.leave, methods=["POST"]),
        Route("/room/end", _in_words(pages.end, _away), methods=["POST"]),
        Route("/room/ended", _in_words(pages.ended, _away), methods=["GET"]),
    ]


def _in_words(page: Page, away: Callable[[Request, str], Response]) -> Page:
    """A page that says what is wrong with the database while that is away."""

    async def said(request: Request) -> Response:
        try:
            return await page(request)
        except ClassroomUnavailable as error:
            return away(request, str(error))

    return said


def _away(request: Request, why: str) -> Response:
    return room_page(request, 503, code=_code_in(request), may_open=may_open(request.scope), message=why)


def _busy(_: Request, why: str) -> Response:
    raise ProblemError(503, "busy", why)


def _code_in(request: Request) -> str:
    return show_code(read_code(request.query_params.get("code", "")[:20]))


class _Pages:
    def __init__(self, hub: Hub, origins: tuple[str, ...], framed: bool, limits: Limits) -> None:
        self._hub = hub
        self._framed = framed
        self._origins = origins
        self._limits = limits

    async def show(self, request: Request) -> Response:
        """The room of this browser; else the forms for joining and opening one."""
        code, ticket = _code_in(request), await self._ticket(request)
        if ticket is None:
            return room_page(request, code=code, may_open=may_open(request.scope))
        room = await run_in_threadpool(self._hub.rooms.find, ticket)
        if room is None:
            words = "Your room has ended, or the teacher has removed you." if not code else ""
            answer = room_page(request, code=code, may_open=may_open(request.scope), message=words)
            self._forget(request, answer)
            return answer
        if code and read_code(code) != room.code:
            return room_page(request, code=code, may_open=may_open(request.scope))  # an invitation to another room
        return self._room_of(request, room, teacher=ticket.teaches)

    def _room_of(self, request: Request, room: OpenRoom, message: str = "", teacher: bool = False) -> Response:
        """The page of a room, for who is in it."""
        return room_page(
            request,
            room=room,
            code=show_code(room.code),
            teacher=teacher,
            message=message,
            join=join_address(request, room.code),
            teach=f"{str(request.base_url).rstrip('/')}/room/teach/{room.token}" if teacher else "",
            ends=ends_in_words(room.ends - now()),
            ends_at=ends_at(room.ends),
        )

    async def open(self, request: Request) -> Response:
        """Open a room."""
        form = await self._form(request)
        title, hours = form.get("title", ""), form.get("hours", "12")
        again = partial(room_page, request, title=title[:200], hours=hours, may_open=True)
        life = number_of(hours) * 3600.0
        if math.isnan(life):
            return again(422, message=f"The duration {hours[:20]!r} is not a number of hours.", field="hours")
        client = client_of(request.scope)
        self._limits.opening(client)
        try:
            room = await run_in_threadpool(self._hub.rooms.open, title, life, client)
        except RefusedError as error:
            return again(422, message=str(error), field=error.field)
        except ClassroomUnavailable as error:
            return again(503, message=str(error))
        answer = RedirectResponse("room", 303)
        await self._remember(request, answer, Ticket(room.id), room)
        return answer

    async def join(self, request: Request) -> Response:
        """Take a seat by code and alias."""
        form, client = await self._form(request), client_of(request.scope)
        code, alias = form.get("code", "")[:40], form.get("alias", "")[:200]
        again = partial(room_page, request, code=code, alias=alias, may_open=may_open(request.scope))
        try:
            known = await self._ticket(request)
            async with self._limits.trying(client):
                self._limits.sitting(client)
                try:
                    ticket = await run_in_threadpool(self._hub.join, code, alias, known)
                except UnknownRoomError:
                    self._limits.wrong(client)
                    raise
                self._limits.sat(client)
            room = await run_in_threadpool(self._hub.rooms.find, ticket)
        except RefusedError as error:
            return again(
                404 if isinstance(error, UnknownRoomError) else 422, message=str(error), field=error.field
            )
        except ProblemError as error:
            return again(error.status_code, message=error.problem.detail)
        except ClassroomUnavailable as error:
            return again(503, message=str(error))
        answer: Response = RedirectResponse("../viewer/", 303)
        if room is None:  # ended meanwhile, or the seat was removed: the viewer is that of nobody
            return answer
        if room.alias != in_one_line(alias):
            words = f"Another student has this alias: you are “{room.alias}” here."
            answer = self._room_of(request, room, words)
        await self._remember(request, answer, ticket, room)
        return answer

    async def teach(self, request: Request) -> Response:
        """The teacher's link."""
        ticket = await run_in_threadpool(self._hub.ticket, request.path_params["token"][: LONGEST_TOKEN + 1])
        room = await run_in_threadpool(self._hub.rooms.find, ticket) if ticket and ticket.teaches else None
        if ticket is None or room is None:
            words = "This link for a teacher is not valid: its room has ended, or the link is not complete."
            return room_page(request, 404, message=words, may_open=may_open(request.scope))
        answer = RedirectResponse("../../viewer/", 303)
        await self._remember(request, answer, ticket, room)
        return answer

    async def qr(self, request: Request) -> Response:
        """The address for joining as a QR code, for who is in the room."""
        ticket = await self._ticket(request)
        room = None if ticket is None else await run_in_threadpool(self._hub.rooms.find, ticket)
        if room is None:
            raise ProblemError(404, "not-found", "You are not in a room.", "Open or join one at /room.")
        picture = qr_svg(join_address(request, room.code))
        return Response(picture, media_type="image/svg+xml", headers={"cache-control": "no-store"})

    async def leave(self, request: Request) -> Response:
        """Forget the room in this browser; the seat stays for who joins again from here until the room ends."""
        await self._form(request)
        answer = RedirectResponse("../room", 303)
        self._forget(request, answer)
        return answer

    async def end(self, request: Request) -> Response:
        """End the room and erase everything in it."""
        await self._form(request)
        ticket = await self._ticket(request)
        if ticket is None or not ticket.teaches:
            raise ProblemError(403, "forbidden", "Only the teacher may end the room.", "Open the teacher's link.")
        await run_in_threadpool(self._hub.rooms.end, ticket.room)
        answer = await self.ended(request)
        self._forget(request, answer)
        return answer

    async def ended(self, request: Request) -> Response:
        """What is true of rooms that have ended; the page asks again while something of them is left."""
        if not self._hub.in_use:
            return room_page(request, may_open=may_open(request.scope))
        words = await run_in_threadpool(lambda: self._hub.rooms.said_of_ended())
        answer = room_page(request, message=words, may_open=may_open(request.scope))
        if words == ERASING:
            answer.headers["refresh"] = f"{ASK_ERASED}; url=ended"
        return answer

    async def _form(self, request: Request) -> dict[str, str]:
        if not origin_allowed(request.headers, self._origins):
            raise ProblemError(
                403, "forbidden", "This form was sent by a page of another site.", "Use our own page."
            )
        return await form_of(request)

    async def _ticket(self, request: Request) -> Ticket | None:
        """The ticket in the cookie; raises `ClassroomUnavailable`."""
        token = request.cookies.get(COOKIE, "")
        return await run_in_threadpool(self._hub.ticket, token) if token else None

    async def _remember(self, request: Request, answer: Response, ticket: Ticket, room: OpenRoom) -> None:
        token, left = await run_in_threadpool(self._hub.rooms.tokens.cookie, ticket, room.code), room.ends - now()
        set_cookie(answer, COOKIE, token, max(1, int(left)), request.scope, self._framed)
        answer.headers["cache-control"] = "no-store"
        pass_guest(request, answer, (ticket.room, ticket.seat), left, self._framed)

    def _forget(self, request: Request, answer: Response) -> None:
        set_cookie(answer, COOKIE, "", 0, request.scope, self._framed)
        forget_guest(request, answer, self._framed)
