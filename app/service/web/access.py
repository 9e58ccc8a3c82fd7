"""Who may do what: a token, a way in for browsers, a read-only mode, a limit per client.

Without a token everybody may do everything, which is right on one's own machine. With one, programs send it with
each request (``Authorization: Bearer …``); a browser is shown a page that asks for it once and then carries a
signed cookie that tells when it ends and nothing else, so that any process of the service can check it. In
read-only mode whoever has no token may look, not touch: pages, descriptions of robots, and the viewer with an arm
that can be looked at from all sides but takes no orders.

Health checks stay open, and the files of the login page.
"""

from __future__ import annotations

import hashlib
import hmac
import html
import ipaddress
import re
import time
from collections import OrderedDict
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, quote

from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from app.api.problems import ProblemError, respond

COOKIE = "kinboard"
LASTS = 30 * 24 * 3600  # seconds
LOOK_ONLY = "kinboard.look_only"  # set in the scope of a visitor who may not touch
OPEN = ("/livez", "/readyz", "/login", "/favicon.ico")
HEALTH = OPEN[:2]
READING = ("GET", "HEAD", "OPTIONS")
TRIES, TRY_EVERY = 5, 10.0  # wrong tokens a client may send at once, and then one in so many seconds
MAX_FORM = 4096  # bytes
# What comes after the login: a place of ours, told from the service's root.
_PLACE = re.compile(r"(?!/)(?:[\w.~?=&%+-]|/(?!/))*", re.ASCII)


class Bucket:
    """A budget per client that fills up again: `rate` a second, `burst` at most. Memory is bounded.

    Args:
        clock: seconds that only grow.
    """

    MOST = 20_000  # clients remembered; the one heard of longest ago is forgotten first

    def __init__(self, rate: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._burst = burst
        self._clock = clock
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, client: str) -> float:
        """Seconds until this client may have one; 0 if now."""
        left, _ = self._now(client)
        return max(0.0, (1.0 - left) / self._rate)

    def take(self, client: str) -> None:
        """Use one up."""
        left, now = self._now(client)
        self._left[client] = (left - 1.0, now)
        self._left.move_to_end(client)
        if len(self._left) > self.MOST:
            self._left.popitem(last=False)

    def _now(self, client: str) -> tuple[float, float]:
        now = self._clock()
        left, since = self._left.get(client, (self._burst, now))
        return min(self._burst, left + self._rate * (now - since)), now


class Access:
    """ASGI middleware that lets in, sends to the login page, or refuses.

    Args:
        token: what opens everything; None: nothing is asked for.
        read_only: whoever has no token may look.
        rate: requests per second of one client, with ten seconds' worth at once; 0: no limit.
        login_page: HTML with ``{{message}}`` and ``{{next}}`` in it.
    """

    def __init__(self, app: ASGIApp, token: str | None, read_only: bool, rate: float, login_page: Path) -> None:
        self.app = app
        self._token = token
        self._read_only = read_only
        self._requests = Bucket(rate, 10.0 * rate) if rate else None
        self._wrong = Bucket(1.0 / TRY_EVERY, TRIES)
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
            if path == "/login" and request is not None:
                answer = await self._login(request)
            elif not (path in OPEN or path.startswith("/static/") or self._known(scope)):
                self._admit(scope, path)
        except ProblemError as error:
            answer = respond(error)
        except _LoginNeededError:
            depth = path.count("/") - 1
            place = quote(path.lstrip("/"), safe="/")
            answer = RedirectResponse(f"{'../' * depth}login?next={place}", 303)
        if answer is None:
            await self.app(scope, receive, send)
        elif request is None:
            # Before the handshake: the visitor's browser is told 403.
            await WebSocket(scope, receive, send).close(1008)
        else:
            answer.headers["cache-control"] = "no-store"
            await answer(scope, receive, send)

    def _count(self, scope: Scope) -> None:
        """Raises 429 for a client that asks for too much."""
        if self._requests is None:
            return
        client = client_of(scope)
        wait = self._requests.wait(client)
        if wait > 0.0:
            raise too_many("Too many requests from your address.", wait)
        self._requests.take(client)

    def _known(self, scope: Scope) -> bool:
        """Whether the token came along, or the cookie for it; raises 429 for who is guessing."""
        if self._token is None:
            return not self._read_only
        headers = dict(scope["headers"])
        kind, _, given = headers.get(b"authorization", b"").decode("latin-1").partition(" ")
        if kind.lower() == "bearer":
            self._check(scope, given.strip())
            return True
        return self._signed(headers.get(b"cookie", b"").decode("latin-1"))

    def _admit(self, scope: Scope, path: str) -> None:
        """Let somebody unknown look, send them to the login page, or refuse."""
        if self._read_only:
            websocket = scope["type"] == "websocket"
            looks = path.startswith("/viewer") if websocket else scope["method"] in READING
            if looks and not re.search(r"/(workspace|capability)\b", path):
                scope[LOOK_ONLY] = True
                return
            hint = "Send the operator's token: Authorization: Bearer …" if self._token else "It is for everybody."
            raise ProblemError(403, "read-only", "This service is read-only.", hint)
        if scope["type"] == "http" and scope["method"] in READING and not path.startswith("/api/"):
            accepted = dict(scope["headers"]).get(b"accept", b"")
            if b"text/html" in accepted:
                raise _LoginNeededError
        raise unauthorized("This service wants a token.")

    def _check(self, scope: Scope, given: str) -> None:
        """Raises 401 for a wrong token, 429 after too many."""
        client = client_of(scope)
        wait = self._wrong.wait(client)
        if wait > 0.0:
            raise too_many("Too many wrong tokens from your address.", wait)
        if self._token is None or not hmac.compare_digest(given.encode(), self._token.encode()):
            self._wrong.take(client)
            raise unauthorized("That is not the token.")

    async def _login(self, request: Request) -> Response:
        """The page that asks for the token; with the right one, on to where the visitor wanted to go."""
        place = request.query_params.get("next", "")
        place = place if _PLACE.fullmatch(place) else ""
        if self._token is None:
            return RedirectResponse("./" + place, 303)
        message = ""
        status = 200
        if request.method == "POST":
            form = await _form(request)
            try:
                self._check(request.scope, form.get("token", ""))
                answer = RedirectResponse("./" + place, 303)
                answer.set_cookie(
                    COOKIE, self._sign(int(time.time()) + LASTS), LASTS,
                    path=request.scope.get("root_path", "") + "/", httponly=True, samesite="lax",
                    secure=request.url.scheme == "https",
                )  # fmt: skip
                return answer
            except ProblemError as error:
                message, status = error.problem.detail, error.status_code
        elif request.method not in ("GET", "HEAD"):
            raise ProblemError(
                405, "method-not-allowed", f"/login does not take {request.method}.", "It takes GET."
            )
        page = self._login_page.replace("{{message}}", html.escape(message))
        return HTMLResponse(page.replace("{{next}}", html.escape(quote(place, safe="/"))), status)

    def _sign(self, ends: int) -> str:
        assert self._token is not None
        return f"{ends}.{hmac.new(self._token.encode(), f'kinboard {ends}'.encode(), hashlib.sha256).hexdigest()}"

    def _signed(self, cookies: str) -> bool:
        """Whether there is a cookie that we signed and that has not ended."""
        try:
            morsel = SimpleCookie(cookies).get(COOKIE)
        except CookieError:
            return False
        value = "" if morsel is None else morsel.value
        ends = value.partition(".")[0]
        if not re.fullmatch(r"[0-9]{1,12}", ends) or int(ends) < time.time():
            return False
        return hmac.compare_digest(value.encode(), self._sign(int(ends)).encode())


class _LoginNeededError(Exception):
    """A browser without a token wants a page."""


def client_of(scope: Scope) -> str:
    """Whose budget it is: the address, of IPv6 the network, of which one host has as many as it likes."""
    host = str((scope.get("client") or ("unknown", 0))[0])
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if address.version == 4:
        return host
    return str(address.ipv4_mapped or ipaddress.ip_network((address, 64), strict=False))


def too_many(detail: str, wait: float) -> ProblemError:
    """429, with when to come again."""
    seconds = max(1, int(wait + 0.999))
    return ProblemError(
        429, "too-many-requests", detail, f"Try again in {seconds} s.", headers={"Retry-After": str(seconds)}
    )


def unauthorized(detail: str) -> ProblemError:
    """401, with how to do better."""
    hint = "Send the header Authorization: Bearer TOKEN, or open /login in a browser."
    return ProblemError(401, "unauthorized", detail, hint, headers={"WWW-Authenticate": 'Bearer realm="kinboard"'})


async def _form(request: Request) -> dict[str, str]:
    """The fields of a small form; raises 413."""
    body = b""
    async for chunk in request.stream():
        body += chunk
        if len(body) > MAX_FORM:
            raise ProblemError(413, "body-too-large", f"The form is larger than {MAX_FORM} bytes.")
    return {name: values[0] for name, values in parse_qs(body.decode("utf-8", "replace")).items()}
