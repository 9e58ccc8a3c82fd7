"""The page of a room: HTML from a template, and the QR code of the address for joining."""

from __future__ import annotations

import time
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import HTMLResponse

from app.classroom.views import Recalled
from app.service.web.rooms.network import ANY, url_for_others
from app.shared.clients import is_local_name
from app.shared.security import guard_teacher

if TYPE_CHECKING:
    from jinja2 import Template

LIVES = ((2, "2 hours"), (12, "12 hours"), (24 * 7, "a week"), (24 * 120, "a term (120 days)"))


@cache
def _template(name: str) -> Template:
    # Imported with the first page: the start need not wait.
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    ).get_template(name)


def room_page(request: Request, status: int = 200, **values: object) -> HTMLResponse:
    """The page; values that are not given are empty."""
    depth = request.scope["path"].removeprefix(request.scope.get("root_path", "")).count("/") - 1
    known: dict[str, object] = dict.fromkeys(
        ("room", "code", "alias", "title", "message", "field", "join", "teach"), ""
    )
    known |= {"hours": 12, "may_open": False, "teacher": False, "ends": "", "ends_at": ""}
    known |= _for_others(request)
    known |= {"lives": LIVES, "root": "../" * depth or "./"}
    if values.get("teacher"):
        guard_teacher(request.scope)
    text = _template("room.html").render(**{**known, **values})
    return HTMLResponse(text, status, headers={"cache-control": "no-store"})


def results_page(request: Request, status: int = 200, **values: object) -> HTMLResponse:
    """The teacher's page of results; values that are not given are empty."""
    known: dict[str, object] = {
        "room": None,
        "rows": (),
        "counts": {},
        "more": 0,
        "problem": "",
        "pairs": (),
        "gains": (),
        "items": (),
        "recalled": Recalled(),
    }
    guard_teacher(request.scope)
    text = _template("results.html").render(**{**known, **values, "root": "../"})
    return HTMLResponse(text, status, headers={"cache-control": "no-store"})


def ends_in_words(seconds: float) -> str:
    """How long a room still lasts."""
    minutes = max(0, round(seconds / 60))
    if minutes < 120:
        return f"{minutes} minutes"
    hours = round(minutes / 60)
    return f"{hours} hours" if hours < 48 else f"{round(hours / 24)} days"


def ends_at(ends: float) -> str:
    """When a room ends, in UTC; the page shows it in the reader's time."""
    return time.strftime("%Y-%m-%dT%H:%MZ", time.gmtime(ends))


def join_address(request: Request, code: str) -> str:
    """The address for joining, as the client of this request may give it to others."""
    root = str(request.base_url).rstrip("/")
    return f"{root}/room?code={code}"


def _for_others(request: Request) -> dict[str, object]:
    """Whether other machines cannot open the address of the request, or any, and which one they can, if known."""
    local, (_, port) = only_here(request), request.scope.get("server") or ("", None)
    host, others = request.app.state.settings.host, None
    if local and port is not None:
        others = url_for_others(host, port, request.scope.get("root_path", ""))
    return {"local": local, "alone": host not in ANY, "others": others or ""}


def only_here(request: Request) -> bool:
    """Whether the address of the request is one that other machines cannot use."""
    return is_local_name(request.url.hostname or "")


def qr_svg(address: str) -> bytes:
    """An address as a QR code, dark on light in both colour schemes."""
    import segno

    text: str = segno.make(address, error="m", micro=False).svg_inline(
        omitsize=True, border=2, dark="#000", light="#fff"
    )
    return text.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1).encode()
