"""What a client may cause, content security policies, cookies, and the check of a websocket's origin.

`Rights` decides for REST, both websockets of a page and what a link restores. Holders of the access token have
full access; without a token everybody has it, unless the service is read-only. The one exception: exercises are
saved on the service only by holders of the token or, without one, by browsers on the same machine. A read-only
visitor may read pages and robots, and see the arm of a link from all sides, with what they choose in the tab
*View*, and numbers in the frame that they choose. Nothing is moved, solved, sampled or mapped for a read-only
visitor.

The query of the viewer's address can name another server (``?websocket=ws://elsewhere``), which could then run
scripts in our origin: ``connect-src 'self'`` prevents that. Browsers do not apply the same-origin rule to
websockets, so a page on another site could control a visitor's viewer: the ``Origin`` header shows where the
page is from.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from enum import Enum
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

if TYPE_CHECKING:
    from starlette.responses import Response

_TEACHER = "kinboard.teacher"  # in the scope: whether the answer is a teacher's page
SAFE_METHODS = ("GET", "HEAD", "OPTIONS")

# What a camera reports, and what the page remembers, when viser asks for it: a link says what to look at.
CAMERA = "ViewerCameraMessage"
MEMORY = "LocalStorageGetItemResponseMessage"
HELLO = "hello"  # in the page's channel: what it remembers
SYSTEM_DARK = "system-dark"  # there too: whether the visitor's system is dark now
TEXT_SIZE = "text-size"  # there too: of the labels in the visitor's scene
FIT, LOOK_FROM = "fit-arm", "look-from"  # there too: where the visitor's own camera goes
FRAME = "frame"  # there too: the frame in which the tool's pose is written
CONTROL = "GuiUpdateMessage"  # a changed control of viser's; read-only visitors change those of the tab View only
# All messages that a read-only visitor may send: they change only how the visitor's own page shows things.
LOOKS = frozenset({CAMERA, MEMORY, HELLO, SYSTEM_DARK, TEXT_SIZE, FIT, LOOK_FROM, FRAME, CONTROL})

# Of a page and its first websocket, of its channel, of its files: below the prefix of the service.
PAGE, CHANNEL, UPLOAD = "/viewer", "/viewer/channel", "/viewer/upload"

_COMPUTING = re.compile(r"/(workspace|capability)\b")


class Rights(Enum):
    """The rights of one client."""

    SAVE = "save"
    FULL = "full"
    LOOK = "look"

    def allow_request(self, method: str, path: str) -> bool:
        """Whether a request without a websocket is answered; `path` below the prefix of the service."""
        if self.compute:
            return True
        return method in SAFE_METHODS and path != "/metrics" and _COMPUTING.search(path) is None

    def allow_websocket(self, path: str) -> bool:
        """Whether a websocket is accepted: one of a page, or a cloud."""
        return self.compute or is_of_page(path)

    def allow_message(self, kind: object) -> bool:
        """Whether a message of a page, which is known and well-formed, is passed on.

        Args:
            kind: its kind in viser's protocol, or its name in the page's channel.
        """
        return self.compute or kind in LOOKS

    @property
    def compute(self) -> bool:
        """Whether a link may start work: inverse kinematics, clouds, sections, sizes, maps."""
        return self is not Rights.LOOK

    @property
    def save(self) -> bool:
        """Whether a page may save exercises in the folder of the service."""
        return self is Rights.SAVE


def is_of_page(path: str) -> bool:
    """Whether it is the address of a page, of one of its websockets or of its files."""
    return path.rstrip("/") == PAGE or path in (CHANNEL, UPLOAD)


# Swagger UI sets inline styles and data: images; scripts come from our own files only.
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; object-src 'none'; base-uri 'none'; form-action 'self'"
)

# viser's client is one self-unpacking file: inline scripts and styles, workers and images from blobs, WebAssembly
# whose glue code builds functions from strings. It may load from and connect to our origin only.
VIEWER_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "media-src 'self' data: blob:; worker-src 'self' blob:; connect-src 'self' data: blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'"
)

# An origin as `KINBOARD_FRAME_ANCESTORS` lists it: all of its ports, or all names below it, may be starred.
_ANCESTOR = re.compile(r"https?://(\*\.)?[a-z0-9]([a-z0-9.-]*[a-z0-9])?(:(\d{1,5}|\*))?", re.ASCII)


def frame_ancestor(origin: str) -> str:
    """The origin in the form of a content security policy; ``*`` is any. Raises ValueError."""
    cleaned = origin.strip().removesuffix("/").lower()
    if cleaned != "*" and not _ANCESTOR.fullmatch(cleaned):
        raise ValueError(f"{origin!r} is not an origin such as https://school.example or http://localhost:8888")
    return cleaned


def framing_policy(ancestors: Sequence[str]) -> str:
    """The directive of a content security policy: our own pages, and these origins, may frame a page."""
    return "frame-ancestors " + " ".join(("'self'", *ancestors))


def set_cookie(response: Response, name: str, value: str, seconds: int, scope: Scope, framed: bool) -> None:
    """Set a cookie that scripts cannot read, for the path of the service.

    Args:
        framed: whether pages of other sites may frame ours. Over HTTPS the browser then sends the cookie to a
            framed page as well, but only below the site on which it was set (``Partitioned``).
    """
    secure = scope["scheme"] in ("https", "wss")
    response.set_cookie(
        name,
        value,
        seconds,
        path=scope.get("root_path", "") + "/",
        httponly=True,
        samesite="none" if framed and secure else "lax",
        secure=secure,
    )
    if framed and secure:
        name_, header = response.raw_headers.pop()
        response.raw_headers.append((name_, header + b"; Partitioned"))  # Python < 3.14 cannot write it


def guard_teacher(scope: Scope) -> None:
    """Let no page of any site frame the answer: only ours, and those of the sites that the operator names."""
    scope[_TEACHER] = True


class SecurityHeaders:
    """ASGI middleware: a content security policy unless the page has its own, and no content sniffing.

    Args:
        ancestors: origins whose pages may frame ours, as `frame_ancestor` returns them.
    """

    def __init__(self, app: ASGIApp, ancestors: Sequence[str] = ()) -> None:
        self.app = app
        self._framing = framing_policy(ancestors)
        self._named = framing_policy([each for each in ancestors if each != "*"])
        self._others = bool(ancestors)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                policy = headers.get("content-security-policy", PAGE_POLICY)
                framing = self._named if scope.get(_TEACHER) else self._framing
                headers["content-security-policy"] = f"{policy}; {framing}"
                if not self._others:  # for old browsers; it cannot name other origins
                    headers.setdefault("x-frame-options", "SAMEORIGIN")
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
