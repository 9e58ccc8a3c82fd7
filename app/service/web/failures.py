"""Errors that no route has handled: an answer 500 like every other one, and clients that leave are none."""

from __future__ import annotations

import logging

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Receive, Scope, Send

from app.api.problems import internal_error, respond
from app.service.web.observe import logged_path

logger = logging.getLogger("kinboard.errors")


class Failures:
    """ASGI middleware within `Observe` and others that add headers: the framework's handler is outside of them."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        try:
            await self.app(scope, receive, send)
        except ClientDisconnect:
            return  # during an upload: nobody is there to be answered
        except Exception:
            logger.exception(
                "request %s failed: %s %s",
                scope["kinboard.request_id"],
                scope["method"],
                logged_path(scope["path"]),
            )
            if scope["kinboard.started"]:
                raise  # the server cuts the answer off, so that the client sees that it is incomplete
            await respond(internal_error())(scope, receive, send)
