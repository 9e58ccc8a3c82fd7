"""Why a page of another origin cannot read our answers.

Before a page of another origin sends a request with a JSON body or a token, its browser asks whether it may: an
``OPTIONS`` request with ``Access-Control-Request-Method``, a preflight. Origins that the operator has named get an
answer from Starlette's middleware. All others get a refusal that says which setting names them: the page's author
finds it in the network tab of the browser.
"""

from __future__ import annotations

from collections.abc import Iterable

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from app.api.problems import ProblemError, respond
from app.shared.problems import shorten_text


class Preflights:
    """ASGI middleware that refuses preflights of origins that may not read answers.

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
