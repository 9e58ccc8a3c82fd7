"""The viewer on the public port: its page, and the websockets of its visitors.

The page and the viewer's messages come from :mod:`app.viewer`, which listens on no port: `ViewerBridge` accepts a
websocket, and the viewer receives and sends through `VisitorConnection`, by function calls in the same event loop.
viser's page connects to its own address without the trailing slash, so both forms are routes. Our own scripts in
it have a second websocket, their channel (:mod:`app.viewer.session.channel.channel`).

Messages of visitors are inspected first (:mod:`app.service.web.inspection`); a visitor who sends invalid ones is
disconnected without affecting others. A slow visitor must not fill our memory: sending waits until the socket
takes more, so the backlog stays in viser's bounded buffer, with back pressure by TCP. A visitor who reads nothing
for a minute (``KINBOARD_SEND_TIMEOUT``) is disconnected by :mod:`app.service.guard`;
:mod:`app.service.websocket_protocol` limits the rate of messages.
"""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import logging
from collections.abc import Awaitable, Callable, Iterable
from functools import partial
from typing import Any
from urllib.parse import unquote

from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from app.api.problems import ProblemError
from app.classroom import COOKIE as ROOM_COOKIE
from app.service.web.access import rights_of
from app.service.web.embedding import discovery
from app.service.web.inspection import MalformedMessageError, admitted
from app.service.web.negotiation import accepts_gzip, is_current
from app.service.web.short_page import short_page
from app.shared.clients import client_of
from app.shared.connection import (
    ConnectionEnded,
    FileRefused,
    SentFile,
    Viewer,
)
from app.shared.metrics import DROPPED, STREAMED, VISITORS
from app.shared.security import CHANNEL, UPLOAD, VIEWER_POLICY, origin_allowed
from app.shared.settings import static_folder
from app.shared.slots import Slot, Slots
from kin.parsing import Limits, TextError, read_json

logger = logging.getLogger("kinboard.bridge")

_STARTING_PAGE = short_page(
    "Kinboard is starting", "<p>The viewer is starting and will appear here in a moment.</p>", again=1
)
_FULL_PAGE = short_page(
    "Kinboard is full",
    "<p>All places in the viewer are taken. This page looks again every ten seconds.</p>",
    again=10,
)

FILE, CHANNEL_NAME = "x-kinboard-file", "x-kinboard-channel"  # fields of the head of a request with a file
SAID = "x-kinboard-said"  # of its answer: the page says why the file is not taken
_FILE_LIMITS = Limits(4096, 8, 2)
_FILE_PROBLEMS = {
    400: "bad-request",
    403: "read-only",
    404: "not-found",
    409: "not-allowed",
    413: "body-too-large",
    503: "busy",
}
CHANNEL_PROTOCOL = "kinboard-1"  # the first subprotocol of a channel
ADDRESSES = 8  # of the service, for which a page with an address of its own is kept

# Codes that describe a lost connection and may not travel in a close frame (RFC 6455, 7.4.1).
_UNSENDABLE = {1005: 1000, 1006: 1011, 1015: 1011}

# A tab's memory, and what viser's page lacks. Relative, so that it holds behind any path prefix.
_SCRIPTS = (
    b"dom",  # the others use it
    b"viser_page",  # the others call it
    b"channel",  # the others send by it
    b"vendor/morphdom/morphdom.min",  # parts.js calls it
    b"parts",  # brings HTML up to date before the others look at it
    b"keys",  # may keep keys from the others
    b"viewer",
    b"input",
    b"robot",
    b"robot_menu",
    b"upload",
    b"program",
    b"lesson",
    b"sheets",
    b"class_tab",
    b"layout",
    b"page",
    b"axes",
    b"drawer",
    b"hints",
    b"driven",
    b"looking",
    b"describe",
)
_STYLES = (b"viewer", b"robot", b"program", b"class_tab", b"layout", b"drawer", b"hints", b"keys")
# The first script runs at once, and says so if another one fails. The others are at the end of the body, whose
# elements they use; the head only preloads them. They have no `defer`: viser's script unpacks itself and starts as
# soon as the page is parsed, which may be before deferred scripts have loaded. Styles come after those of viser,
# which its script puts into the head.
_HEAD = b"".join(
    [b'<link rel="stylesheet" href="../static/start.css"><script src="../static/start.js"></script>']
    + [b'<link rel="preload" as="script" href="../static/%s.js">' % name for name in _SCRIPTS]
)
_OUR_STYLES = b"".join(b'<link rel="stylesheet" href="../static/%s.css">' % name for name in _STYLES)
_OUR_SCRIPTS = b"".join(b'<script src="../static/%s.js"></script>' % name for name in _SCRIPTS)


class ViewerBridge:
    """Routes for ``/viewer``. `viewer` serves the visitors, None until it has started."""

    def __init__(self, allowed_origins: Iterable[str] = (), slots: Slots | None = None) -> None:
        self.viewer: Viewer | None = None
        self.slots = slots or Slots(200)
        self._allowed_origins = tuple(allowed_origins)
        self._pages: dict[str, _Page] = {}  # by what depends on the service's address

    def routes(self) -> list[BaseRoute]:
        """The page and viser's websocket, each with and without the trailing slash, and the page's channel."""
        return [
            Route("/viewer", _add_slash),
            Route("/viewer/", self.page),
            WebSocketRoute("/viewer", self.websocket),
            WebSocketRoute("/viewer/", self.websocket),
            WebSocketRoute(CHANNEL, self.channel),
            Route(UPLOAD, self.upload, methods=["POST"]),
        ]

    async def page(self, request: Request) -> Response:
        """viser's page with our content policy; until the viewer has started, 503 and a page that tries again."""
        if self.viewer is None:
            return HTMLResponse(_STARTING_PAGE, status_code=503, headers={"retry-after": "1"})
        if not self.slots.free(client_of(request.scope)):
            return HTMLResponse(_FULL_PAGE, status_code=503, headers={"retry-after": "10"})
        link = discovery(request)
        if link not in self._pages and len(self._pages) >= ADDRESSES:
            link = ""  # a page costs a compression, and names may be forged
        if link not in self._pages:
            self._pages[link] = _Page(self.viewer.page(), link)
        return self._pages[link].response(request)

    async def websocket(self, visitor: WebSocket) -> None:
        """One visitor's connection, from the handshake to whichever side ends first."""
        if not self._is_ours(visitor):
            await visitor.close()  # before the handshake: a 403
            return
        if self.viewer is None:
            await _turn_away(visitor, "The viewer is starting.")
            return
        client = client_of(visitor.scope)
        if not self.slots.take(client):
            DROPPED.labels("full").inc()
            await _turn_away(visitor, "All places are taken.")
            return
        with Slot(self.slots, client), VISITORS.track_inprogress():
            connection = VisitorConnection(visitor)
            await _serve(visitor, connection, connection.subprotocol, partial(self.viewer.serve, connection))

    async def channel(self, visitor: WebSocket) -> None:
        """The channel of a page, whose name is the second of the subprotocols: addresses are logged, it is not.

        It takes no place of a visitor: the page has one, and its channel one connection at a time.
        """
        protocols = list(visitor.scope["subprotocols"])
        if not self._is_ours(visitor):
            await visitor.close()
        elif self.viewer is None:
            await _turn_away(visitor, "The viewer is starting.")
        elif protocols[:1] != [CHANNEL_PROTOCOL] or len(protocols) != 2:
            await visitor.close()
        else:
            connection = ChannelConnection(visitor)
            serve = partial(self.viewer.serve_channel, connection, protocols[1])
            await _serve(visitor, connection, CHANNEL_PROTOCOL, serve)

    async def upload(self, request: Request) -> Response:
        """A file for a page, whose channel's name and what it is for are in the head: addresses are logged."""
        if not self._is_ours(request):
            raise ProblemError(403, "forbidden", "Pages of other sites may not send files.", "")
        if self.viewer is None:
            raise ProblemError(503, "busy", "The viewer is starting.", "Try again in a moment.")
        sent = _sent_file(request)
        try:
            await self.viewer.receive_file(request.headers.get(CHANNEL_NAME, ""), sent, request.stream())
        except FileRefused as refused:
            kind = _FILE_PROBLEMS.get(refused.status, "http-error")
            headers = {"connection": "close"} | ({SAID: "1"} if refused.said else {})
            raise ProblemError(refused.status, kind, refused.why, "", headers=headers) from None
        except ClientDisconnect:
            pass  # nobody hears the answer
        return Response(status_code=204)

    def _is_ours(self, visitor: HTTPConnection) -> bool:
        """Whether a websocket may be opened, or a file sent, by the page that does."""
        if origin_allowed(visitor.headers, self._allowed_origins):
            return True
        logger.warning("refused a %s from a page of %.200r", visitor.scope["type"], visitor.headers.get("origin"))
        return False


def _sent_file(request: Request) -> SentFile:
    """What the head of a request says of its file; raises `ProblemError`."""
    length = request.headers.get("content-length", "")
    if not (length.isascii() and length.isdecimal() and len(length) < 12):
        raise ProblemError(411, "bad-request", "A file needs a Content-Length.", "")
    try:
        match read_json(unquote(request.headers.get(FILE, "")), _FILE_LIMITS):
            case [str(feature), str(key), str(name)]:
                return SentFile(feature, key, name, int(length))
    except TextError:
        pass
    hint = "Send [feature, event, name of the file] as JSON with percent signs."
    raise ProblemError(400, "bad-request", f"The field {FILE} does not say what the file is for.", hint)


async def _serve(
    visitor: WebSocket,
    connection: _SocketConnection,
    protocol: str | None,
    serve: Callable[[], Awaitable[ConnectionEnded]],
) -> None:
    """Accept a websocket, and close it as the viewer says that its connection has ended."""
    await visitor.accept(protocol)
    try:
        end = await serve()
    except Exception:
        logger.exception("a visitor's connection failed")
        end = ConnectionEnded(1011, "internal error")
    if end.code == 1007:
        DROPPED.labels("malformed").inc()
    if visitor.client_state is WebSocketState.CONNECTED and connection.is_open:
        # A visitor who has just left cannot receive the close frame.
        with contextlib.suppress(WebSocketDisconnect):
            await visitor.close(end.code, end.reason)


class _SocketConnection:
    """A websocket of a page."""

    def __init__(self, visitor: WebSocket) -> None:
        self._visitor = visitor
        self.rights = rights_of(visitor.scope)

    @property
    def is_open(self) -> bool:
        """Whether nothing has failed to be sent: after that Starlette takes no more, not even the close frame."""
        return self._visitor.application_state is WebSocketState.CONNECTED

    async def _receive(self, kind: str) -> Any:
        """The next message of this kind, bytes or text; raises `ConnectionEnded`."""
        event = await self._visitor.receive()
        if event["type"] == "websocket.disconnect":
            raise ConnectionEnded(_sendable(event["code"]))
        data = event.get(kind)
        if data is None:
            raise ConnectionEnded(1003, f"{'binary' if kind == 'bytes' else kind} messages only")
        return data

    async def _send(self, kind: str, data: bytes | str) -> None:
        """Send a message; raises `ConnectionEnded`."""
        if not self.is_open:
            raise ConnectionEnded(1001)
        try:
            await self._visitor.send({"type": "websocket.send", kind: data})
        except WebSocketDisconnect:
            raise ConnectionEnded(1001) from None


class ChannelConnection(_SocketConnection):
    """A websocket of a page's channel."""

    def __init__(self, visitor: WebSocket) -> None:
        super().__init__(visitor)
        self._streamed = STREAMED.labels("channel")

    async def receive(self) -> str:
        """The page's next text; raises `ConnectionEnded`."""
        text: str = await self._receive("text")
        return text

    async def send(self, text: str) -> None:
        """Send a text; raises `ConnectionEnded`."""
        await self._send("text", text)
        self._streamed.inc(len(text))


class VisitorConnection(_SocketConnection):
    """A visitor's websocket for the viewer, whose messages are inspected."""

    def __init__(self, visitor: WebSocket) -> None:
        super().__init__(visitor)
        self.subprotocol: str | None = next(iter(visitor.scope.get("subprotocols", ())), None)
        self.client = client_of(visitor.scope)
        self.room_token: str = visitor.cookies.get(ROOM_COOKIE, "")
        self._streamed = STREAMED.labels("viewer")

    async def receive(self) -> bytes:
        """The visitor's next message that is passed on; raises `ConnectionEnded`."""
        while True:
            data: bytes = await self._receive("bytes")
            try:
                passes = admitted(data, self.rights)
            except MalformedMessageError as error:
                raise ConnectionEnded(1007, str(error)) from None
            if passes:
                return data
            DROPPED.labels("refused").inc()

    async def send(self, data: bytes) -> None:
        """Send a message of the viewer; raises `ConnectionEnded`."""
        await self._send("bytes", data)
        self._streamed.inc(len(data))


async def _turn_away(visitor: WebSocket, why: str) -> None:
    """Close with "try again later": viser's client does so by itself."""
    await visitor.accept(next(iter(visitor.scope["subprotocols"]), None))
    await visitor.close(1013, why)


def _sendable(code: int) -> int:
    return _UNSENDABLE.get(code, code)


async def _add_slash(request: Request) -> Response:
    # Relative, so that it holds behind any proxy, whatever it does to host and path.
    query = f"?{request.url.query}" if request.url.query else ""
    return RedirectResponse(f"viewer/{query}")


class _Page:
    """viser's single-file client with our scripts, styles and what lies beside its parts, plain and compressed."""

    def __init__(self, html: bytes, link: str) -> None:
        html = html.replace(b"<title>Viser</title>", b"<title>Kinboard viewer</title>", 1)
        # A menu that opens beside a phone's screen must not widen the page.
        html = html.replace(b"initial-scale=1", b"initial-scale=1, minimum-scale=1", 1)
        html = html.replace(b"<head>", b"<head>" + _HEAD + link.encode(), 1)
        beside = (static_folder() / "viewer.html").read_bytes()
        self._html = html.replace(b"</body>", _OUR_STYLES + beside + _OUR_SCRIPTS + b"</body>", 1)
        self._gzipped = gzip.compress(self._html, 6)
        self._headers = {
            "content-security-policy": VIEWER_POLICY,
            "cache-control": "no-cache",
            "etag": f'"{hashlib.sha256(self._html).hexdigest()[:32]}"',
            "vary": "accept-encoding",
        }

    def response(self, request: Request) -> Response:
        if is_current(request.headers.get("if-none-match", ""), self._headers["etag"]):
            return Response(status_code=304, headers=self._headers)
        if accepts_gzip(request.headers.get("accept-encoding", "")):
            return HTMLResponse(self._gzipped, headers=self._headers | {"content-encoding": "gzip"})
        return HTMLResponse(self._html, headers=self._headers)
