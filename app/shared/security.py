"""Content security policies, and the check of a websocket's origin.

The query of the viewer's address can name another server (``?websocket=ws://elsewhere``), which could then run
scripts in our origin: ``connect-src 'self'`` prevents that. Browsers do not apply the same-origin rule to
websockets, so a page on another site could control a visitor's viewer: the ``Origin`` header shows where the
page is from.
"""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# Swagger UI sets inline styles and data: images; scripts come from our own files only.
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'; "
    "frame-ancestors 'self'"
)

# viser's client is one self-unpacking file: inline scripts and styles, workers and images from blobs, WebAssembly
# whose glue code builds functions from strings. It may load from and connect to our origin only.
VIEWER_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "media-src 'self' data: blob:; worker-src 'self' blob:; connect-src 'self' data: blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)


class SecurityHeaders:
    """ASGI middleware: a content security policy unless the page has its own, and no content sniffing."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.setdefault("content-security-policy", PAGE_POLICY)
                headers.setdefault("x-content-type-options", "nosniff")
                headers.setdefault("referrer-policy", "same-origin")
            await send(message)

        await self.app(scope, receive, send_with_headers)


def origin_allowed(headers: Headers, allowed_origins: Iterable[str]) -> bool:
    """Whether the page that opens a websocket is one of ours or of an allowed origin.

    A request without ``Origin`` is not from a page of another site: browsers always send it with a websocket.
    ``X-Forwarded-Host`` counts because a proxy may rewrite ``Host``, and a page can set neither.
    """
    origin = headers.get("origin")
    if origin is None:
        return True
    if origin.rstrip("/").lower() in {allowed.rstrip("/").lower() for allowed in allowed_origins}:
        return True
    try:
        page = _host_and_port(urlsplit(origin.lower()).netloc)
    except ValueError:  # no address, such as http://[::1
        return False
    forwarded = headers.get("x-forwarded-host", "").split(",")[0].strip()
    ours = {_host_and_port(host) for host in (headers.get("host", ""), forwarded) if host}
    return bool(page) and page in ours


def _host_and_port(netloc: str) -> str:
    """Lower case, without a default port, which browsers omit in ``Origin`` but proxies may add to ``Host``."""
    return netloc.lower().removesuffix(":80").removesuffix(":443")
