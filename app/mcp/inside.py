"""Requests to the routes of REST from within the process: no port, no second parser, the limits of REST."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

from pydantic_core import to_json
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Scope

from app.api.problems import internal_error

logger = logging.getLogger("kinboard.mcp")

# An address is no name that a service could refuse.
HEADERS = [(b"host", b"127.0.0.1"), (b"content-type", b"application/json")]
# Of a caller on this machine, who has no request of its own: standard input and output.
ALONE: Scope = {
    "asgi": {"version": "3.0"},
    "http_version": "1.1",
    "scheme": "http",
    "client": ("127.0.0.1", 0),
    "server": ("localhost", 80),
    "root_path": "",
}


@dataclass(frozen=True)
class Reply:
    """An answer of REST.

    Attributes:
        status: of HTTP.
        kind: its media type, without parameters.
        content: its bytes.
    """

    status: int
    kind: str
    content: bytes


def scope_of(request: Request | None, kind: str, path: str, query: Mapping[str, str]) -> Scope:
    """The scope of a request, or of a websocket, that is made for this caller: its limits are those of the client.

    Args:
        request: of the agent; None: it has none.
        kind: ``"http"`` or ``"websocket"``.
    """
    outer = ALONE if request is None else request.scope
    path = outer["root_path"] + path
    return {
        **outer,
        "type": kind,
        "path": path,
        "raw_path": path.encode(),
        "query_string": urlencode(query).encode(),
        "headers": HEADERS,
        "path_params": {},
    }


async def ask(
    service: ASGIApp,
    request: Request | None,
    method: str,
    path: str,
    query: Mapping[str, str],
    body: Mapping[str, Any] | None,
) -> Reply:
    """What `service` answers. A computation ends when the agent leaves or takes the call back."""
    scope = {**scope_of(request, "http", path, query), "method": method}
    content = b"" if body is None else to_json(body, inf_nan_mode="constants")
    waiting: list[Message] = [{"type": "http.request", "body": content, "more_body": False}]
    left = asyncio.Event()
    found: list[Message] = []

    async def receive() -> Message:
        if waiting:
            return waiting.pop()
        if request is not None:
            return await request.receive()
        await left.wait()
        return {"type": "http.disconnect"}

    async def send(message: Message) -> None:
        found.append(message)

    answering = asyncio.ensure_future(service(scope, receive, send))
    try:
        # Not cancelled with the call: what computes ends by itself, and has its place until then.
        await asyncio.shield(answering)
    except asyncio.CancelledError:
        left.set()
        raise
    except Exception:
        logger.exception("a tool failed")
        return _failed()
    head, *parts = found
    kinds = [value.decode() for name, value in head["headers"] if name == b"content-type"]
    content = b"".join(part.get("body", b"") for part in parts)
    if not content:  # the agent has left: nobody reads this
        return _failed()
    return Reply(head["status"], (kinds or [""])[0].partition(";")[0], content)


def _failed() -> Reply:
    return Reply(500, "application/problem+json", to_json(internal_error().problem))
