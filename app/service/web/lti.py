"""The routes below ``/lti``: login, launch, our public keys, and the choice of exercises and courses.

A platform's page may show them in a frame. Their forms carry what a platform or we have signed, so they need no
cookie of ours except the one that ties a launch to the browser of its login.
"""

from __future__ import annotations

import html
import json
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from itsdangerous import BadSignature, URLSafeTimedSerializer
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from app.api.problems import ProblemError
from app.classroom import COOKIE, ClassroomUnavailable, Hub, RefusedError
from app.classroom.clock import now
from app.classroom.courses import Courses
from app.service.web.access import pass_guest
from app.shared.security import PAGE_POLICY, set_cookie
from app.shared.settings import Settings

if TYPE_CHECKING:
    from app.classroom.lti.contents import Content
    from app.classroom.lti.launches import Launch, Logins
    from app.classroom.lti.platforms import Platforms
    from app.classroom.lti.seats import LtiSeats

STATE_COOKIE = "kinboard_lti"
CHOICE_TIME = 3600  # seconds for choosing
MAX_FORM = 80_000  # bytes; tokens have up to 64 KiB
_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta name="color-scheme" content="light dark"><title>{title}</title>
<link rel="stylesheet" href="../static/lti.css">
<main><h1>{title}</h1>{body}</main></html>"""


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
    except ImportError:
        raise PlatformsRefused("KINBOARD_LTI needs an extra: pip install 'kinboard[lti]'") from None
    try:
        load_platforms(settings.lti)
    except PlatformFileError as error:
        raise PlatformsRefused(f"KINBOARD_LTI: {error}") from None


class _Pages:
    def __init__(self, hub: Hub, platforms: Platforms, courses: Callable[[], Courses]) -> None:
        self._hub = hub
        self._platforms = platforms
        self._courses = courses
        self._seats: LtiSeats | None = None
        self._logins: Logins | None = None

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

            self._logins = Logins(self._platforms, self._key(), self.seats.use_nonce)
        return self._logins

    async def keys(self, _: Request) -> Response:
        """Our public keys."""
        return Response(json.dumps(self._platforms.key_set()), media_type="application/json")

    async def login(self, request: Request) -> Response:
        """Send the browser to the platform."""
        from app.classroom.lti.launches import LaunchRefused

        asked: Mapping[str, str] = request.query_params
        if request.method == "POST":
            asked = {name: values[0] for name, values in (await _form(request)).items()}
        try:
            logins = await run_in_threadpool(self._begun)
            address, state = logins.begin(asked, f"{request.base_url}lti/launch")
        except LaunchRefused as error:
            return refused(str(error), 400)
        except ClassroomUnavailable as error:
            return refused(str(error), 503)
        answer = RedirectResponse(address, 303, headers={"cache-control": "no-store"})
        set_cookie(answer, STATE_COOKIE, state, 600, request.scope, framed=True)
        return answer

    async def launch(self, request: Request) -> Response:
        """Verify a launch, and take the user to the room of its link, or to the choice of contents."""
        from app.classroom.lti.contents import content_of
        from app.classroom.lti.launches import LINK, LaunchRefused

        form = {name: values[0] for name, values in (await _form(request)).items()}
        if form.get("error"):
            return refused(f"The platform refused the launch: {form['error'][:200]}.", 400)
        cookie = request.cookies.get(STATE_COOKIE, "")
        try:
            logins = await run_in_threadpool(self._begun)
            launch = await run_in_threadpool(
                logins.finish, form.get("id_token", ""), form.get("state", ""), cookie
            )
            contents = await run_in_threadpool(lambda: self._contents)
            if launch.kind == LINK:
                return self._choices(launch)
            ticket = await run_in_threadpool(self.seats.take, launch, content_of(launch, contents))
            room = await run_in_threadpool(self._hub.rooms.find, ticket)
        except (LaunchRefused, RefusedError) as error:
            return refused(str(error), 403)
        except ClassroomUnavailable as error:
            return refused(str(error), 503)
        if room is None:
            return refused("The teacher has removed you from this room, or it has ended.", 403)
        answer = RedirectResponse("../viewer/", 303, headers={"cache-control": "no-store"})
        token = self._hub.rooms.tokens.sign(ticket)
        set_cookie(answer, COOKIE, token, int(room.ends - room.created), request.scope, framed=True)
        pass_guest(request, answer, (ticket.room, ticket.seat), room.ends - now(), framed=True)
        set_cookie(answer, STATE_COOKIE, "", 0, request.scope, framed=True)
        return answer

    def _choices(self, launch: Launch) -> Response:
        from app.classroom.lti.platforms import is_safe

        back = launch.linking.get("deep_link_return_url")
        if not isinstance(back, str) or not is_safe(back):
            return refused("The platform names no safe address for the answer.", 400)
        many = launch.linking.get("accept_multiple") is not False
        about = [
            launch.platform.issuer,
            launch.platform.client_id,
            launch.deployment,
            back,
            launch.linking.get("data"),
        ]
        signed = self._signer().dumps(about)
        kind = "checkbox" if many else "radio"

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
        return HTMLResponse(_PAGE.format(title="Kinboard for your course", body=body))

    async def choose(self, request: Request) -> Response:
        """The signed answer with what was chosen, which the browser takes back to the platform."""
        from app.classroom.lti.launches import LINK, Launch
        from app.classroom.lti.services import link_answer

        form = await _form(request)
        signed = form.get("about", [""])[0]
        try:
            issuer, client_id, deployment, back, data = self._signer().loads(signed, max_age=CHOICE_TIME)
        except (BadSignature, ValueError, TypeError):
            return refused("The choice is not valid any more. Start it again on the platform.", 403)
        platform = self._platforms.find(issuer, client_id)
        if platform is None:
            return refused("The platform is no longer registered here.", 403)
        known = {each.name: each for each in await run_in_threadpool(lambda: self._contents)}
        chosen = [known[name] for name in dict.fromkeys(form.get("content", [])) if name in known]
        linking: dict[str, Any] = {} if data is None else {"data": data}
        launch = Launch(platform, LINK, deployment, "", "", True, "", "", "", "", "", linking)
        answer = link_answer(self._platforms, launch, chosen, f"{request.base_url}lti/launch")
        body_html = (
            f'<p>{len(chosen)} chosen.</p><form method="post" action="{html.escape(back)}">'
            f'<input type="hidden" name="JWT" value="{html.escape(answer)}">'
            "<button>Back to the course</button></form>"
        )
        parts = urlsplit(back)
        policy = PAGE_POLICY.replace("form-action 'self'", f"form-action {parts.scheme}://{parts.netloc}")
        page = _PAGE.format(title="Kinboard for your course", body=body_html)
        return HTMLResponse(page, headers={"content-security-policy": policy, "cache-control": "no-store"})

    def _signer(self) -> URLSafeTimedSerializer:
        return URLSafeTimedSerializer(self._key(), salt="kinboard.lti.choice")


def _extent(content: Content) -> str:
    """How many points a course gives; nothing for an exercise."""
    if content.kind == "exercise":
        return ""
    many = content.most
    return f" <small>{many} exercise{'s' if many != 1 else ''}{'' if many else ', no score'}</small>"


async def _form(request: Request) -> dict[str, list[str]]:
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > MAX_FORM:
            raise ProblemError(413, "body-too-large", f"The form is larger than {MAX_FORM} bytes.")
    return parse_qs(body.decode("utf-8", "replace"))


def refused(words: str, status: int) -> Response:
    """A page that says why."""
    page = _PAGE.format(title="Kinboard could not be opened", body=f"<p>{html.escape(words)}</p>")
    return HTMLResponse(page, status, headers={"cache-control": "no-store"})
