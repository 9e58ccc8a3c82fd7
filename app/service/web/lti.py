"""The routes below ``/lti``: login, launch, our public keys, and the choice of exercises and courses.

A platform's page may show them in a frame. Their forms carry what a platform or we have signed. So they need one
cookie of ours only: it ties a launch to the browser of its login.
"""

from __future__ import annotations

import html
import json
import threading
from collections.abc import Callable, Mapping
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

from anyio import CapacityLimiter, move_on_after, to_thread
from itsdangerous import BadSignature, URLSafeTimedSerializer
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from app.classroom import COOKIE, ClassroomUnavailable, Hub, RefusedError, Ticket
from app.classroom.clock import now
from app.classroom.courses import Courses
from app.service.web.access import fields_of, pass_guest
from app.service.web.short_page import short_page
from app.shared.security import PAGE_POLICY, set_cookie
from app.shared.settings import Settings

if TYPE_CHECKING:
    from app.classroom.lti.contents import Content
    from app.classroom.lti.launches import Launch, Logins
    from app.classroom.lti.platforms import Platforms
    from app.classroom.lti.seats import LtiSeats
    from app.classroom.rooms import OpenRoom

STATE_COOKIE = "kinboard_lti"
CHOICE_TIME = 3600  # seconds for choosing
MAX_FORM = 80_000  # bytes; tokens have up to 64 KiB
# Launches have threads of their own: rooms and visitors do not wait behind them.
THREADS, MOST_WAITING = 6, 200
PATIENCE = 4.0  # s that a launch waits for a thread
T = TypeVar("T")
Ts = TypeVarTuple("Ts")


def lti_routes(hub: Hub, settings: Settings, courses: Callable[[], Courses]) -> list[BaseRoute]:
    """The routes, if the operator has a file of platforms; scores of attempts are then sent to them.

    Args:
        courses: reads the courses and exercises that may be linked to.

    Raises:
        ImportError: the extra ``lti`` is not installed.
        PlatformFileError: the file is invalid.
    """
    if settings.lti is None:
        return []
    from app.classroom.lti.passback import Passback
    from app.classroom.lti.platforms import load_platforms

    platforms = load_platforms(settings.lti)
    pages = _Pages(hub, platforms, courses)
    passback = Passback(platforms, lambda seat: pages.seats.column(seat))
    hub.on_attempt = passback.attempted
    return [
        Route("/lti/login", pages.login, methods=["GET", "POST"]),
        Route("/lti/launch", pages.launch, methods=["POST"]),
        Route("/lti/keys", pages.keys, methods=["GET"]),
        Route("/lti/choose", pages.choose, methods=["POST"]),
    ]


class PlatformsRefused(Exception):  # noqa: N818 - a finding, with a sentence for the operator
    """The file of platforms is invalid, or the extra is not installed."""


def check_platforms(settings: Settings) -> None:
    """Raises `PlatformsRefused` if the service cannot start with these settings."""
    if settings.lti is None:
        return
    try:
        from app.classroom.lti.platforms import PlatformFileError, load_platforms
    except ModuleNotFoundError:
        raise PlatformsRefused("KINBOARD_LTI needs an extra: pip install 'kinboard[lti]'") from None
    try:
        load_platforms(settings.lti)
    except PlatformFileError as error:
        raise PlatformsRefused(f"KINBOARD_LTI: {error}") from None


class _TooManyLaunchesError(ClassroomUnavailable):
    """More launches come in than the database takes."""

    def __init__(self) -> None:
        super().__init__("Too many users of learning platforms arrive at the moment.")


class _Threads:
    """Where launches wait for the database; a bounded number for a bounded time."""

    def __init__(self) -> None:
        self._free = CapacityLimiter(THREADS)

    async def run(self, act: Callable[[*Ts], T], *args: *Ts) -> T:
        """The result of a call in one of the threads; raises `_TooManyLaunchesError` if none is free in time."""
        if self._free.statistics().tasks_waiting < MOST_WAITING:
            with move_on_after(PATIENCE):  # ends the wait for a thread, and no call that has begun
                return await to_thread.run_sync(act, *args, limiter=self._free)
        raise _TooManyLaunchesError


class _Pages:
    def __init__(self, hub: Hub, platforms: Platforms, courses: Callable[[], Courses]) -> None:
        self._hub = hub
        self._threads = _Threads()
        self._platforms = platforms
        self._courses = courses
        self._seats: LtiSeats | None = None
        self._logins: Logins | None = None
        self._lock = threading.Lock()

    @property
    def seats(self) -> LtiSeats:
        """Rooms and seats; the first use opens the database."""
        if self._seats is None:
            from app.classroom.lti.seats import LtiSeats

            rooms = self._hub.rooms
            self._seats = LtiSeats(self._hub.database, rooms)
        return self._seats

    @cached_property
    def _contents(self) -> list[Content]:
        """What links may open; read when it is first asked for."""
        from app.classroom.lti.contents import contents_of

        return contents_of(self._courses())

    def _key(self) -> str:
        seats = self.seats
        assert seats is not None
        return self._hub.database.key()

    def _begun(self) -> Logins:
        if self._logins is None:
            from app.classroom.lti.launches import Logins

            key = self._key()  # waits for the database
            with self._lock:  # all launches share what is known of a platform's keys
                if self._logins is None:
                    self._logins = Logins(self._platforms, key, self.seats.use_nonce)
        return self._logins

    async def keys(self, _: Request) -> Response:
        """Our public keys."""
        return Response(json.dumps(self._platforms.key_set()), media_type="application/json")

    async def login(self, request: Request) -> Response:
        """Send the browser to the platform."""
        from app.classroom.lti.launches import LaunchRefused

        asked: Mapping[str, str] = request.query_params
        if request.method == "POST":
            asked = {name: values[0] for name, values in (await fields_of(request, MAX_FORM)).items()}
        try:
            logins = await self._threads.run(self._begun)
            address, state = logins.begin(asked, f"{request.base_url}lti/launch")
        except LaunchRefused as error:
            return refused(str(error), 400)
        except ClassroomUnavailable as error:
            return unavailable(error)
        answer = RedirectResponse(address, 303, headers={"cache-control": "no-store"})
        set_cookie(answer, STATE_COOKIE, state, 600, request.scope, framed=True)
        return answer

    async def launch(self, request: Request) -> Response:
        """Verify a launch, and take the user to the room of its link, or to the choice of contents."""
        from app.classroom.lti.keys import PlatformAway
        from app.classroom.lti.launches import LINK, LaunchRefused

        form = {name: values[0] for name, values in (await fields_of(request, MAX_FORM)).items()}
        if form.get("error"):
            return refused(f"The platform refused the launch: {form['error'][:200]}.", 400)
        cookie = request.cookies.get(STATE_COOKIE, "")
        try:
            logins = await self._threads.run(self._begun)
            launch = await logins.finish(form.get("id_token", ""), form.get("state", ""), cookie)
            if launch.kind == LINK:
                return await self._threads.run(self._choices, logins, launch)
            entered = await self._threads.run(self._enter, logins, launch)
        except (LaunchRefused, RefusedError) as error:
            return refused(str(error), 403)
        except PlatformAway as error:
            return refused(str(error), 503, error.wait)
        except ClassroomUnavailable as error:
            return unavailable(error)
        if entered is None:
            return refused("The teacher has removed you from this room, or it has ended.", 403)
        ticket, room = entered
        answer = RedirectResponse("../viewer/", 303, headers={"cache-control": "no-store"})
        token = self._hub.rooms.tokens.cookie(ticket, room.code)
        set_cookie(answer, COOKIE, token, int(room.ends - room.created), request.scope, framed=True)
        pass_guest(request, answer, (ticket.room, ticket.seat), room.ends - now(), framed=True)
        set_cookie(answer, STATE_COOKIE, "", 0, request.scope, framed=True)
        return answer

    def _enter(self, logins: Logins, launch: Launch) -> tuple[Ticket, OpenRoom] | None:
        """The seat of a launch and its room; waits for the database."""
        from app.classroom.lti.contents import content_of

        logins.use(launch)
        ticket = self.seats.take(launch, content_of(launch, self._contents))
        room = self._hub.rooms.find(ticket)
        return None if room is None else (ticket, room)

    def _choices(self, logins: Logins, launch: Launch) -> Response:
        """The page on which a teacher chooses what the platform's link opens; waits for the database."""
        logins.use(launch)
        platform = launch.platform
        about = [platform.issuer, platform.client_id, launch.deployment, launch.back, launch.data]
        signed = self._signer().dumps(about)
        kind = "checkbox" if launch.many else "radio"

        def rows(what: str) -> str:
            return "".join(
                f'<label><input type="{kind}" name="content" value="{html.escape(each.name)}"> '
                f"<span>{html.escape(each.title)}{_extent(each)}</span></label>"
                for each in self._contents
                if each.kind == what
            )

        body = (
            f'<form method="post" action="choose"><input type="hidden" name="about" value="{html.escape(signed)}">'
            f"<fieldset><legend>Whole courses</legend>{rows('course')}</fieldset>"
            f"<fieldset><legend>Single exercises</legend>{rows('exercise')}</fieldset>"
            "<button>Add to the course</button></form>"
        )
        return HTMLResponse(short_page("Kinboard for your course", body))

    async def choose(self, request: Request) -> Response:
        """The signed answer with what was chosen, which the browser takes back to the platform."""
        from app.classroom.lti.platforms import origin_of
        from app.classroom.lti.services import link_answer

        form = await fields_of(request, MAX_FORM)
        signed = form.get("about", [""])[0]
        try:
            about = await self._threads.run(lambda: self._signer().loads(signed, max_age=CHOICE_TIME))
            issuer, client_id, deployment, back, data = about
            known = {each.name: each for each in await self._threads.run(lambda: self._contents)}
        except (BadSignature, ValueError, TypeError):
            return refused("The choice is not valid any more. Start it again on the platform.", 403)
        except ClassroomUnavailable as error:
            return unavailable(error)
        platform = self._platforms.find(issuer, client_id)
        if platform is None:
            return refused("The platform is no longer registered here.", 403)
        chosen = [known[name] for name in dict.fromkeys(form.get("content", [])) if name in known]
        answer = link_answer(self._platforms, platform, deployment, data, chosen, f"{request.base_url}lti/launch")
        body_html = (
            f'<p>{len(chosen)} chosen.</p><form method="post" action="{html.escape(back)}">'
            f'<input type="hidden" name="JWT" value="{html.escape(answer)}">'
            "<button>Back to the course</button></form>"
        )
        policy = PAGE_POLICY.replace("form-action 'self'", f"form-action {origin_of(back)}")
        page = short_page("Kinboard for your course", body_html)
        return HTMLResponse(page, headers={"content-security-policy": policy, "cache-control": "no-store"})

    def _signer(self) -> URLSafeTimedSerializer:
        return URLSafeTimedSerializer(self._key(), salt="kinboard.lti.choice")


def _extent(content: Content) -> str:
    """How many points a course gives; nothing for an exercise."""
    if content.kind == "exercise":
        return ""
    many = content.most
    return f" <small>{many} exercise{'s' if many != 1 else ''}{'' if many else ', no score'}</small>"


def refused(words: str, status: int, wait: float = 0.0) -> Response:
    """A page that says why, and when it is worth another try."""
    again = f"<p>Try again in {ceil(wait)} seconds.</p>" if wait else ""
    page = short_page("Kinboard could not be opened", f"<p>{html.escape(words)}</p>{again}")
    headers = {"cache-control": "no-store"} | ({"retry-after": str(ceil(wait))} if wait else {})
    return HTMLResponse(page, status, headers=headers)


def unavailable(error: ClassroomUnavailable) -> Response:
    """The page while the database is away, or has too much to do."""
    return refused(str(error), 503, PATIENCE if isinstance(error, _TooManyLaunchesError) else 0.0)
