"""The viewer on the public port: its page, and a bridge from its websocket to the internal viser server.

viser listens on a port of its own, reachable from this machine only. Visitors see one port: this module serves
viser's page under ``/viewer/`` and forwards the messages of each websocket both ways, unchanged. The page connects
to its own address without the trailing slash, so both forms are routes.

Messages of visitors are inspected first (:mod:`app.service.web.inspection`); a visitor who sends invalid ones is
disconnected without affecting others. A slow visitor must not fill our memory: with ``max_queue=1`` and both pumps
waiting until the other side takes a message, the backlog stays in viser's bounded buffer, with back pressure by
TCP. A visitor who reads nothing for a minute is disconnected.
"""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import hashlib
import http.client
import logging
import time
from collections.abc import Iterable

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from app.service.web.access import LOOK_ONLY
from app.service.web.inspection import BURST, RATE, MalformedMessageError, MessageLimit, admitted
from app.shared.metrics import DROPPED, STREAMED, VISITORS
from app.shared.security import VIEWER_POLICY, origin_allowed

logger = logging.getLogger("kinboard.bridge")

# Seconds that sending one message may take: unread messages wait in our memory.
PATIENCE = 60.0

_PAGE = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="{again}">'
    '<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">'
    "<title>{title}</title><style>body{{display:grid;place-items:center;min-height:90vh;margin:1rem;"
    "font:1.05rem/1.6 system-ui,sans-serif;text-align:center}}</style><p>{words}</p></html>"
)
_WARMING_PAGE = _PAGE.format(
    again=1,
    title="Kinboard is warming up",
    words="The viewer is warming up and will appear here in a moment.",
)
_FULL_PAGE = _PAGE.format(
    again=10,
    title="Kinboard is full",
    words="All places in the viewer are taken. This page looks again every ten seconds.",
)

# Codes that describe a lost connection and may not travel in a close frame (RFC 6455, 7.4.1).
_UNSENDABLE = {1005: 1000, 1006: 1011, 1015: 1011}

# A tab's memory, and what viser's controls lack. Relative, so that it holds behind any path prefix.
_OURS = b'<link rel="stylesheet" href="../static/viewer.css"><script src="../static/viewer.js"></script>'

# Close code and reason.
_Ending = tuple[int, str]


class ViewerBridge:
    """Routes for ``/viewer``. `port` is that of the internal viser server, None until it listens."""

    def __init__(self, allowed_origins: Iterable[str] = (), max_visitors: int = 200) -> None:
        self.port: int | None = None
        self.visitors = 0
        self._max_visitors = max_visitors
        self._allowed_origins = tuple(allowed_origins)
        self._page: _Page | None = None

    def routes(self) -> list[BaseRoute]:
        """The page and the websocket, each with and without the trailing slash."""
        return [
            Route("/viewer", _add_slash),
            Route("/viewer/", self.page),
            WebSocketRoute("/viewer", self.websocket),
            WebSocketRoute("/viewer/", self.websocket),
        ]

    async def page(self, request: Request) -> Response:
        """viser's page with our content policy; until viser listens, 503 and a page that tries again."""
        if self.port is None:
            return HTMLResponse(_WARMING_PAGE, status_code=503, headers={"retry-after": "1"})
        if self.visitors >= self._max_visitors:
            return HTMLResponse(_FULL_PAGE, status_code=503, headers={"retry-after": "10"})
        if self._page is None:
            self._page = await run_in_threadpool(_fetch_page, self.port)
        return self._page.response(request)

    async def websocket(self, visitor: WebSocket) -> None:
        """One visitor's connection, from the handshake to whichever side ends first."""
        if not origin_allowed(visitor.headers, self._allowed_origins):
            logger.warning("refused a websocket from a page of %.200r", visitor.headers.get("origin"))
            await visitor.close()  # before the handshake: a 403
            return
        if self.port is None:
            await _turn_away(visitor, "The viewer is warming up.")
            return
        if self.visitors >= self._max_visitors:
            DROPPED.labels("full").inc()
            await _turn_away(visitor, "All places are taken.")
            return
        self.visitors += 1
        try:
            with VISITORS.track_inprogress():
                await self._serve(visitor, self.port)
        finally:
            self.visitors -= 1

    async def _serve(self, visitor: WebSocket, port: int) -> None:
        try:
            upstream = await connect(
                f"ws://127.0.0.1:{port}/",
                subprotocols=[Subprotocol(name) for name in visitor.scope.get("subprotocols", ())] or None,
                compression=None,
                max_size=None,
                max_queue=1,
                ping_interval=None,
                open_timeout=5,
                close_timeout=1,
                proxy=None,
            )
        except (OSError, TimeoutError, InvalidHandshake) as error:
            logger.warning("the viewer's server does not answer: %s", error)
            await _turn_away(visitor, "The viewer does not answer.")
            return
        async with upstream:
            await visitor.accept(upstream.subprotocol)
            await _carry(visitor, upstream)


async def _carry(visitor: WebSocket, upstream: ClientConnection) -> None:
    """Run both pumps until one side ends; then stop the other pump and close both sides with the same code."""
    pumps = (
        asyncio.create_task(_to_viser(visitor, upstream)),
        asyncio.create_task(_to_visitor(upstream, visitor)),
    )
    try:
        ended, _ = await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for pump in pumps:
            pump.cancel()
        await asyncio.gather(*pumps, return_exceptions=True)
    code, reason = ended.pop().result()
    await upstream.close(code, reason)
    if visitor.client_state is WebSocketState.CONNECTED:
        # A visitor who has just left cannot receive the close frame.
        with contextlib.suppress(WebSocketDisconnect):
            await visitor.close(code, reason)


async def _to_viser(visitor: WebSocket, upstream: ClientConnection) -> _Ending:
    look_only = bool(visitor.scope.get(LOOK_ONLY, False))
    limit = MessageLimit(RATE, BURST)
    try:
        while True:
            event = await visitor.receive()
            if event["type"] == "websocket.disconnect":
                return _sendable(event["code"]), ""
            data = event.get("bytes")
            if data is None:
                return 1003, "binary messages only"
            try:
                passes = admitted(data, look_only)
            except MalformedMessageError as error:
                DROPPED.labels("malformed").inc()
                return 1007, str(error)
            if passes:
                await upstream.send(data)
            else:
                DROPPED.labels("refused").inc()
            # Messages above the rate are not read: they wait in the buffers of the sender.
            if (wait := limit.spend(time.monotonic())) > 0.0:
                await asyncio.sleep(wait)
    except ConnectionClosed:
        return _ending_of(upstream)


async def _to_visitor(upstream: ClientConnection, visitor: WebSocket) -> _Ending:
    streamed = STREAMED.labels("viewer")
    try:
        while True:
            message = await upstream.recv(decode=False)
            async with asyncio.timeout(PATIENCE):
                await visitor.send({"type": "websocket.send", "bytes": message})
            streamed.inc(len(message))
    except ConnectionClosed:
        return _ending_of(upstream)
    except TimeoutError:
        DROPPED.labels("slow").inc()
        return 1008, "the connection is too slow"
    except WebSocketDisconnect:
        return 1001, ""


def _ending_of(upstream: ClientConnection) -> _Ending:
    return _sendable(upstream.close_code or 1006), upstream.close_reason or ""


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
    """viser's single-file client with a script and a style sheet of ours in front, plain and compressed."""

    def __init__(self, html: bytes) -> None:
        html = html.replace(b"<title>Viser</title>", b"<title>Kinboard viewer</title>", 1)
        # Before viser's own script, for which it prepares the page.
        self._html = html.replace(b"<head>", b"<head>" + _OURS, 1)
        self._gzipped = gzip.compress(self._html, 6)
        self._headers = {
            "content-security-policy": VIEWER_POLICY,
            "cache-control": "no-cache",
            "etag": f'"{hashlib.sha256(self._html).hexdigest()[:32]}"',
            "vary": "accept-encoding",
        }

    def response(self, request: Request) -> Response:
        if request.headers.get("if-none-match") == self._headers["etag"]:
            return Response(status_code=304, headers=self._headers)
        if "gzip" in request.headers.get("accept-encoding", ""):
            return HTMLResponse(self._gzipped, headers=self._headers | {"content-encoding": "gzip"})
        return HTMLResponse(self._html, headers=self._headers)


def _fetch_page(port: int) -> _Page:
    # Directly to this machine: urllib would use a proxy named in the environment.
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    try:
        connection.request("GET", "/")
        answer = connection.getresponse()
        html = answer.read()
    finally:
        connection.close()
    if answer.status != 200:
        raise RuntimeError(f"the viewer's server answered {answer.status} for its page")
    return _Page(html)
