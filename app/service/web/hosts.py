"""Which host a request is for, hints about proxies, and why a page of another origin cannot read our answers.

A page of another site can have its name resolve to our address (DNS rebinding). The browser then takes us for a
part of that site and lets its scripts read our answers. But the request still names that host. So a service
without a token, on an address only this machine can reach, answers under its own names only.
"""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Iterable
from functools import lru_cache

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from app.api.problems import ProblemError, respond
from app.shared.clients import client_of, host_name
from app.shared.problems import shorten_text

logger = logging.getLogger("kinboard.connections")

LOCAL_NAMES = ("localhost",)


class Hosts:
    """ASGI middleware that refuses requests for other hosts.

    Args:
        allowed: names of this service; none, or ``*``: any name.
        proxies: whether the operator has named trusted proxies.
    """

    def __init__(self, app: ASGIApp, allowed: Iterable[str], proxies: bool) -> None:
        self.app = app
        self._allowed = frozenset(name.lower().rstrip(".") for name in allowed)
        self._any = not self._allowed or "*" in self._allowed
        self._hinted = proxies
        self._is_ours = lru_cache(maxsize=1024)(self._is_ours_uncached)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        refused = None
        if not (self._any and self._hinted):
            for name, value in scope["headers"]:
                if name == b"host" and not self._any and not self._is_ours(value):
                    refused = value.decode("latin-1")
                elif name == b"x-forwarded-for" and not self._hinted:
                    self._hint(scope)
        if refused is None:
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await WebSocket(scope, receive, send).close(1008)  # before the handshake: a 403
        else:
            await respond(wrong_host(refused))(scope, receive, send)

    def _is_ours_uncached(self, host: bytes) -> bool:
        name = host_name(host)
        if name in self._allowed or name.endswith(".localhost"):
            return True
        try:
            ipaddress.ip_address(name)  # no name that could resolve to us
        except ValueError:
            return False
        return True

    def _hint(self, scope: Scope) -> None:
        self._hinted = True
        logger.warning(
            "%s sends X-Forwarded-For, which is ignored: all its requests count as one client. "
            "If it is your proxy, set KINBOARD_TRUSTED_PROXIES",
            client_of(scope),
        )


def wrong_host(host: str) -> ProblemError:
    """421 naming the host."""
    detail = f"This service is not {shorten_text(host)}."
    hint = "Use localhost or its IP address, or ask the operator to add the name to KINBOARD_ALLOWED_HOSTS."
    return ProblemError(421, "wrong-host", detail, hint)


class Preflights:
    """ASGI middleware that refuses preflights of origins that may not read answers.

    Before a page of another origin sends a request with a JSON body or a token, its browser asks whether it may:
    ``OPTIONS`` with ``Access-Control-Request-Method``. Origins that the operator has named get an answer from
    Starlette's middleware. All others get a refusal that says which setting names them: the page's author finds it
    in the network tab of the browser.

    Args:
        allowed: the origins that may; ``*``: all.
    """

    def __init__(self, app: ASGIApp, allowed: Iterable[str]) -> None:
        self.app = app
        self._allowed = frozenset(allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http" and scope["method"] == "OPTIONS" and "*" not in self._allowed:
            headers = Headers(scope=scope)
            origin = headers.get("origin")
            if origin is not None and "access-control-request-method" in headers and origin not in self._allowed:
                await respond(other_origin(origin))(scope, receive, send)
                return
        await self.app(scope, receive, send)


def other_origin(origin: str) -> ProblemError:
    """403 naming the origin, and the setting that would let it in."""
    detail = f"Pages of {shorten_text(origin)} may not read answers of this service."
    hint = "Ask the operator to add this origin to KINBOARD_CORS_ORIGINS, a JSON list such as "
    return ProblemError(403, "other-origin", detail, hint + '["https://school.example"].')
