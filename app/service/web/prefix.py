"""A path prefix in front of the whole service, for reverse proxies (``--root-path /kinboard``).

Some proxies forward the prefix, some strip it. Both kinds of request become what ASGI specifies: ``path`` with the
prefix and ``root_path`` set to it. Otherwise a stripped request would find routes but not the files of a mounted
folder.
"""

from __future__ import annotations

from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send


def clean_prefix(root_path: str) -> str:
    """``kinboard/`` → ``/kinboard``; an empty prefix or ``/`` → an empty string."""
    bare = root_path.strip().strip("/")
    return f"/{bare}" if bare else ""


class PathPrefix:
    """ASGI middleware that serves the same pages with and without the prefix."""

    def __init__(self, app: ASGIApp, prefix: str) -> None:
        self.app = app
        self.prefix = clean_prefix(prefix)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self.prefix or scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        path: str = scope["path"]
        if path == self.prefix and scope["type"] == "http":
            # Relative links on the page need the slash to resolve below the prefix.
            await RedirectResponse(self.prefix + "/")(scope, receive, send)
            return
        if not path.startswith(self.prefix + "/"):
            path = self.prefix + path
        await self.app({**scope, "path": path, "root_path": self.prefix}, receive, send)
