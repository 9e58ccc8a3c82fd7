"""Every request gets an id, is counted, and is written down if the operator wants it: one JSON object a line.

The id comes back as ``X-Request-ID``; a proxy's own is kept if it is a harmless one, so that its log and ours can
be laid side by side.
"""

from __future__ import annotations

import json
import logging
import re
import secrets
import time

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.service.web.access import client_of
from app.shared.metrics import REQUEST_SECONDS, REQUESTS

logger = logging.getLogger("kinboard.access")

_HARMLESS = re.compile(rb"[\w.:/+=-]{1,128}", re.ASCII)
_METHODS = frozenset(("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"))


class Observe:
    """ASGI middleware around everything that answers."""

    def __init__(self, app: ASGIApp, log: bool) -> None:
        self.app = app
        self._log = log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        given = next((value for name, value in scope["headers"] if name == b"x-request-id"), b"")
        request_id = given.decode() if _HARMLESS.fullmatch(given) else secrets.token_hex(8)
        scope["kinboard.request_id"] = request_id
        path: str = scope["path"].removeprefix(scope.get("root_path", ""))  # a mounted folder takes its part off
        began = time.perf_counter()
        status, sent = 0, 0

        async def watching(message: Message) -> None:
            nonlocal status, sent
            kind = message["type"]
            if kind == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["x-request-id"] = request_id
            elif kind == "websocket.accept":
                status = 101
            elif kind == "websocket.close" and not status:
                status = 403
            elif kind == "http.response.body":
                sent += len(message.get("body", b""))
            elif kind == "websocket.send":
                sent += len(message.get("bytes") or message.get("text") or b"")
            await send(message)

        try:
            await self.app(scope, receive, watching)
        finally:
            self._tell(scope, path, status or 500, sent, time.perf_counter() - began)

    def _tell(self, scope: Scope, path: str, status: int, sent: int, seconds: float) -> None:
        websocket = scope["type"] == "websocket"
        # What a client makes up must not become a series of its own.
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
                "path": path,
                "route": route,
                "status": status,
                "bytes": sent,
                "ms": round(1e3 * seconds, 2),
            }
            logger.info(json.dumps(line, ensure_ascii=True))


def write_to_stderr() -> None:
    """Have lines written, as they are."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logger.propagate = False


def _route_of(scope: Scope, path: str) -> str:
    """The pattern that the address matched, so that there are as many series as routes, whatever is asked for."""
    if "endpoint" not in scope:
        return "none"
    if path.startswith("/static/"):
        return "/static"
    pattern: str = getattr(scope.get("route"), "path", path)
    return pattern
