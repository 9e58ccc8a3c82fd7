"""Request ids, metrics, and an optional access log with one JSON object per line.

The id is returned as ``X-Request-ID``. An id set by a proxy is kept if it is short and plain, so that both logs
can be compared.
"""

from __future__ import annotations

import json
import logging
import re
import secrets
import time

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.shared.clients import client_of
from app.shared.metrics import REQUEST_SECONDS, REQUESTS

logger = logging.getLogger("kinboard.access")

_VALID_ID = re.compile(rb"[\w.:/+=-]{1,128}", re.ASCII)
_SECRET = re.compile(r"/room/teach/.*", re.DOTALL)  # who has this path may teach the class
CLIENT_LEFT = 499  # the status counted for a client that left before it was answered, as nginx does
_METHODS = frozenset(("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"))


class Observe:
    """ASGI middleware around everything that answers requests."""

    def __init__(self, app: ASGIApp, log: bool) -> None:
        self.app = app
        self._log = log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        given = next((value for name, value in scope["headers"] if name == b"x-request-id"), b"")
        request_id = given.decode() if _VALID_ID.fullmatch(given) else secrets.token_hex(8)
        scope["kinboard.request_id"] = request_id
        scope["kinboard.started"] = False  # whether an answer has begun
        # Read now: a mounted folder removes its part of the path.
        path: str = scope["path"].removeprefix(scope.get("root_path", ""))
        began = time.perf_counter()
        status, sent, failed = 0, 0, True

        async def observed(message: Message) -> None:
            nonlocal status, sent
            kind = message["type"]
            if kind == "http.response.start":
                status = message["status"]
                scope["kinboard.started"] = True
                MutableHeaders(scope=message)["x-request-id"] = request_id
            elif kind == "websocket.accept":
                status = 101
            elif kind == "websocket.http.response.start":
                status = message["status"]
            elif kind == "websocket.close" and not status:
                status = 403
            elif kind == "http.response.body":
                sent += len(message.get("body", b""))
            elif kind == "websocket.send":
                sent += len(message.get("bytes") or message.get("text") or b"")
            await send(message)

        try:
            await self.app(scope, receive, observed)
            failed = False
        finally:
            status = status or (500 if failed else CLIENT_LEFT)
            self._record(scope, path, status, sent, time.perf_counter() - began)

    def _record(self, scope: Scope, path: str, status: int, sent: int, seconds: float) -> None:
        websocket = scope["type"] == "websocket"
        # Unknown methods share one label, so that clients cannot create new time series.
        method = "WEBSOCKET" if websocket else scope["method"] if scope["method"] in _METHODS else "OTHER"
        route = _route_of(scope, path)
        REQUESTS.labels(method, route, status).inc()
        if not websocket:
            REQUEST_SECONDS.labels(route).observe(seconds)
        if self._log:
            line = {
                "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
                "id": scope["kinboard.request_id"],
                "client": client_of(scope),
                "method": method,
                "path": logged_path(path),
                "route": route,
                "status": status,
                "bytes": sent,
                "ms": round(1e3 * seconds, 2),
            }
            logger.info(json.dumps(line, ensure_ascii=True))


def write_to_stderr() -> None:
    """Write the access log to standard error."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False


def logged_path(path: str) -> str:
    """A path as it may be written to a log: without the secret of a teacher's link."""
    return _SECRET.sub("/room/teach/{token}", path)


def _route_of(scope: Scope, path: str) -> str:
    """Pattern of the matched route, so that the number of time series is bounded by the number of routes."""
    if "endpoint" not in scope:
        return "none"
    if path.startswith("/static/"):
        return "/static"
    pattern: str = getattr(scope.get("route"), "path", logged_path(path))
    return pattern
