"""Access control: an access token, a login page for browsers, a read-only mode, a rate limit per client.

Without a token everybody has full access, which is right on one's own machine. With a token, programs send it
with each request (``Authorization: Bearer …``). A browser is redirected to a login page that asks for it once
and sets a signed cookie (itsdangerous), which holds only the time of the login. In read-only mode visitors
without the token may look but not move anything: pages, descriptions of robots, and a viewer whose arm takes no
commands.

Health checks, the files of the login page, and the pages for joining a classroom are always open. Who has joined
one gets a cookie that opens the viewer, and nothing else, until the room ends.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import html
import re
from collections.abc import Awaitable, Callable
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, quote

from itsdangerous import BadSignature, TimestampSigner, URLSafeSerializer
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from app.api.problems import ProblemError, respond
from app.service.web.rate_limit import SlowTries, TokenBucket, too_many
from app.shared.clients import client_of, is_here
from app.shared.security import SAFE_METHODS, Rights, is_of_page, origin_allowed, set_cookie

COOKIE = "kinboard"
COOKIE_AGE = 30 * 24 * 3600  # seconds until a login ends
GUEST_COOKIE = "kinboard_guest"  # of who has joined a classroom: opens the viewer while the seat is there
_GUESTS = "kinboard.guests"  # in the scope: what signs that cookie, or None
_MAY_OPEN = "kinboard.may-open"  # in the scope of a page of classrooms: whether the client may open one
_RIGHTS = "kinboard.rights"  # in the scope: what the client may cause
OPEN = ("/livez", "/readyz", "/login", "/favicon.ico", "/lti/login", "/lti/launch", "/lti/keys", "/lti/choose")
HEALTH = OPEN[:2]
TRIES, TRY_EVERY = 5, 10.0  # wrong tokens allowed at once per client, then one in this many seconds
# A client above that rate may be many behind one address: the right token goes on being accepted, but each check
# takes this many seconds, and this many are made at a time.
CHECK_TIME, CHECKS = 1.0, 4
MAX_FORM = 4096  # bytes
# Where to go after the login: a path of this service, relative to its root.
_PLACE = re.compile(r"(?!/)(?:[\w.~?=&%+-]|/(?!/))*", re.ASCII)


async def _nobody(room: str, seat: str) -> bool:
    return False


class Access:
    """ASGI middleware that admits a request, redirects it to the login page, or rejects it.

    Args:
        token: the access token; None: no authentication.
        read_only: whether requests without the token are read-only.
        rate: requests per second of one client, in bursts of up to ten seconds' worth; 0: no limit.
        login_page: HTML with the placeholders ``{{message}}`` and ``{{next}}``.
        framed: whether pages of other sites may frame ours.
        admits: whether a room, and a seat in it, are still there.
    """

    def __init__(
        self,
        app: ASGIApp,
        token: str | None,
        read_only: bool,
        rate: float,
        login_page: Path,
        framed: bool = False,
        admits: Callable[[str, str], Awaitable[bool]] = _nobody,
    ) -> None:
        self.app = app
        self._framed = framed
        self._admits = admits
        self._token = token
        self._signer = None
        if token is not None:
            self._signer = TimestampSigner(token, salt="kinboard.login", digest_method=hashlib.sha256)
        self._guests = None
        if token is not None:
            self._guests = URLSafeSerializer(
                token, salt="kinboard.guest", signer_kwargs={"digest_method": hashlib.sha256}
            )
        self._read_only = read_only
        self._requests = TokenBucket(rate, 10.0 * rate) if rate else None
        self._wrong_tokens = TokenBucket(1.0 / TRY_EVERY, TRIES)
        self._slow = SlowTries(CHECKS)
        self._accepted = _encodings(token)
        self._login_page = login_page.read_text(encoding="utf-8")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        path = scope["path"].removeprefix(scope.get("root_path", ""))
        answer: Response | None = None
        request = Request(scope, receive) if scope["type"] == "http" else None
        try:
            if path not in HEALTH:
                self._count(scope)
            scope[_GUESTS] = self._guests
            if path == "/login" and request is not None:
                answer = await self._login(request)
            elif not (path in OPEN or path.startswith("/static/")):
                scope[_MAY_OPEN] = await self._authenticated(scope)
                if scope[_MAY_OPEN] and (self._token is not None or is_here(scope)):
                    scope[_RIGHTS] = Rights.SAVE
                elif not scope[_MAY_OPEN] and not await self._is_guest(scope, path):
                    self._admit_anonymous(scope, path)
        except ProblemError as error:
            answer = respond(error)
        except _LoginNeededError:
            depth = path.count("/") - 1
            place = quote(path.lstrip("/"), safe="/")
            answer = RedirectResponse(f"{'../' * depth}login?next={place}", 303)
        if answer is None:
            await self.app(scope, receive, send)
        elif request is None:
            # Before the handshake, so the browser receives a 403.
            await WebSocket(scope, receive, send).close(1008)
        else:
            answer.headers["cache-control"] = "no-store"
            await answer(scope, receive, send)

    def _count(self, scope: Scope) -> None:
        """Count a request; raises 429 above the rate limit."""
        if self._requests is None:
            return
        client = client_of(scope)
        wait = self._requests.wait(client)
        if wait > 0.0:
            raise too_many("Too many requests from your address.", wait)
        self._requests.take(client)

    async def _authenticated(self, scope: Scope) -> bool:
        """Whether the request has the token or a valid cookie. Raises 401 for a wrong token, 429 after several."""
        if self._token is None:
            return not self._read_only
        headers = dict(scope["headers"])
        kind, _, given = headers.get(b"authorization", b"").partition(b" ")
        if kind.lower() == b"bearer":
            await self._check(scope, given.strip())
            return True
        if self._framed and not _asks_itself(scope):
            return False
        return self._has_valid_cookie(headers.get(b"cookie", b"").decode("latin-1"))

    async def _is_guest(self, scope: Scope, path: str) -> bool:
        """Whether the client may go there without the token: pages of rooms; with a seat, the viewer."""
        if path.startswith("/room/") or (path == "/room" and scope.get("method") in SAFE_METHODS):
            return True
        if self._guests is None or not is_of_page(path):
            return False
        try:
            cookies = SimpleCookie(dict(scope["headers"]).get(b"cookie", b"").decode("latin-1"))
            morsel = cookies.get(GUEST_COOKIE)
            room, seat = self._guests.loads("" if morsel is None else morsel.value)
        except (CookieError, BadSignature, TypeError, ValueError):
            return False
        return await self._admits(str(room), str(seat))

    def _admit_anonymous(self, scope: Scope, path: str) -> None:
        """Admit a request without the token as read-only; else raise `_LoginNeededError`, 401 or 403."""
        if self._read_only:
            scope[_RIGHTS] = rights = Rights.LOOK
            websocket = scope["type"] == "websocket"
            if rights.allow_websocket(path) if websocket else rights.allow_request(scope["method"], path):
                return
            hint = (
                "Send the operator's token: Authorization: Bearer …" if self._token else "It accepts no changes."
            )
            raise ProblemError(403, "read-only", "This service is read-only.", hint)
        if scope["type"] == "http" and scope["method"] in SAFE_METHODS and not path.startswith("/api/"):
            accepted = dict(scope["headers"]).get(b"accept", b"")
            if b"text/html" in accepted:
                raise _LoginNeededError
        raise unauthorized("This service requires an access token.")

    async def _check(self, scope: Scope, given: bytes) -> None:
        """Raises 401 for a wrong token, 429 after too many; slow after too many, also for the right one."""
        client = client_of(scope)
        wait = self._wrong_tokens.wait(client)
        refused = too_many("Too many wrong tokens from your address.", wait)
        if wait > 0.0:
            await self._slow.pause(client, CHECK_TIME, refused)
        if any(hmac.compare_digest(given, accepted) for accepted in self._accepted):
            return
        if wait > 0.0:
            raise refused
        self._wrong_tokens.take(client)
        raise unauthorized("The access token is wrong.")

    async def _login(self, request: Request) -> Response:
        """The login page; after the right token, a redirect to the page the visitor came for."""
        place = request.query_params.get("next", "")
        place = place if _PLACE.fullmatch(place) else ""
        if self._signer is None:
            return RedirectResponse("./" + place, 303)
        message = ""
        status = 200
        if request.method == "POST":
            form = await form_of(request)
            try:
                await self._check(request.scope, form.get("token", "").encode())
                answer = RedirectResponse("./" + place, 303)
                cookie = self._signer.sign(b"visitor").decode()
                set_cookie(answer, COOKIE, cookie, COOKIE_AGE, request.scope, self._framed)
                return answer
            except ProblemError as error:
                message, status = error.problem.detail, error.status_code
        elif request.method not in ("GET", "HEAD"):
            raise ProblemError(
                405, "method-not-allowed", f"/login does not accept {request.method}.", "Use GET or POST."
            )
        page = self._login_page.replace("{{message}}", html.escape(message))
        return HTMLResponse(page.replace("{{next}}", html.escape(quote(place, safe="/"))), status)

    def _has_valid_cookie(self, cookies: str) -> bool:
        """Whether there is a cookie with our signature that is not too old."""
        if self._signer is None:
            return False
        try:
            morsel = SimpleCookie(cookies).get(COOKIE)
            self._signer.unsign("" if morsel is None else morsel.value, max_age=COOKIE_AGE)
        except (CookieError, BadSignature):
            return False
        return True


def _asks_itself(scope: Scope) -> bool:
    """Whether a request that changes something is from one of our pages: a framed page's cookie is not ``Lax``."""
    return scope.get("method") in (None, *SAFE_METHODS) or origin_allowed(Headers(scope=scope), ())


def _encodings(token: str | None) -> list[bytes]:
    """The token as clients send it: most as UTF-8, some in the encoding that HTTP once had."""
    if token is None:
        return []
    encodings = {token.encode()}
    with contextlib.suppress(UnicodeEncodeError):
        encodings.add(token.encode("latin-1"))
    return sorted(encodings)


def may_open(scope: Scope) -> bool:
    """Whether the client of a page of classrooms may open one."""
    return bool(scope.get(_MAY_OPEN, False))


def pass_guest(request: Request, answer: Response, place: tuple[str, str], seconds: float, framed: bool) -> None:
    """Let who has joined a classroom use the viewer without the access token.

    Args:
        place: the ids of the room and of the seat; when one of them is gone, so is the access.
        seconds: how long the browser keeps it at most.
    """
    guests = request.scope.get(_GUESTS)
    if guests is not None:
        set_cookie(answer, GUEST_COOKIE, guests.dumps(place), max(1, int(seconds)), request.scope, framed)


def forget_guest(request: Request, answer: Response, framed: bool) -> None:
    """Take that back from who has left the classroom."""
    if GUEST_COOKIE in request.cookies:
        set_cookie(answer, GUEST_COOKIE, "", 0, request.scope, framed)


def rights_of(scope: Scope) -> Rights:
    """What the client of an admitted request may cause."""
    rights = scope.get(_RIGHTS, Rights.FULL)
    assert isinstance(rights, Rights)
    return rights


class _LoginNeededError(Exception):
    """A browser without the token requests a page."""


def unauthorized(detail: str) -> ProblemError:
    """401, with a hint how to authenticate."""
    hint = "Send the header Authorization: Bearer TOKEN, or open /login in a browser."
    return ProblemError(401, "unauthorized", detail, hint, headers={"WWW-Authenticate": 'Bearer realm="kinboard"'})


async def form_of(request: Request) -> dict[str, str]:
    """The first value of each field of a form; raises 413 if it is too large."""
    return {name: values[0] for name, values in (await fields_of(request, MAX_FORM)).items()}


async def fields_of(request: Request, most: int) -> dict[str, list[str]]:
    """The values of each field of a form; raises 413 if it has more bytes."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > most:
            raise ProblemError(413, "body-too-large", f"The form is larger than {most} bytes.")
    return parse_qs(body.decode("utf-8", "replace"))
