"""``/mcp``: the tools of agents over HTTP, beside REST and with its limits.

Each message is a request of its own: there are no sessions, and nothing is kept between two of them but the
connections of agents that drive a page. The access token, hosts and rates have been checked when it comes here.
Its bytes and values are bounded before the SDK parses it, as those of a body of REST are.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from mcp.server.streamable_http_manager import StreamableHTTPSessionManager
from starlette.requests import Request
from starlette.routing import Route
from starlette.types import Message, Receive, Scope, Send

from app.api.body import JsonRequest
from app.mcp.page import Pages, inside
from app.mcp.server import agent_server
from app.service.web.hosts import other_origin
from app.shared.clients import client_of
from app.shared.security import origin_allowed
from app.shared.settings import Settings


class Agents:
    """The address of agents, an ASGI application.

    Args:
        app: the service; its routes answer what the tools ask.
    """

    def __init__(self, app: FastAPI, settings: Settings) -> None:
        self._uploads = app.state.uploads
        self._origins = settings.cors_origins
        self._pages = Pages(inside(app.router))
        self._server = agent_server(app, app.router, self._pages)
        self._size = settings.max_body
        self._manager: StreamableHTTPSessionManager
        app.router.routes.append(Route("/mcp", self, methods=["POST"]))

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Serve until the context ends."""
        self._manager = StreamableHTTPSessionManager(
            self._server, json_response=True, stateless=True, max_request_body_size=self._size
        )
        async with self._manager.run():
            yield
            self._pages.close()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        # The memory of the bytes is given back before the call: its request to REST counts them again.
        with self._uploads.body(client_of(scope)) as memory:
            request = JsonRequest(Request(scope, receive), memory)
            if not ("*" in self._origins or origin_allowed(request.headers, self._origins)):
                raise other_origin(request.headers["origin"])
            await request.require_json()
            await request.json()
            body = await request.body()
        waiting: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

        async def replayed() -> Message:
            return waiting.pop() if waiting else await receive()

        await self._manager.handle_request(scope, replayed, send)
