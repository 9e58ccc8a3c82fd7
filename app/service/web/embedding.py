"""oEmbed: what other sites ask for when somebody pastes a link to the viewer (https://oembed.com).

The answer is the code of a frame. Only links to the viewer of this service are answered, and the address in the
code is put together from checked parts.
"""

from __future__ import annotations

import html
import json
import re
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from app.api.problems import ProblemError, respond
from app.shared.answers.embedding import HEIGHT, MODES, WIDTH, frame
from app.shared.problems import shorten_text
from app.shared.security import origin_allowed

LEAST, MOST = 200, 4096  # pixels that may be asked for
MAX_LINK = 20_000  # characters; states have up to 16 000
_STATE = re.compile(r"[A-Za-z0-9_-]*", re.ASCII)
_NETLOC = re.compile(r"[\w.:\[\]-]{1,260}", re.ASCII)
_TAB = re.compile(r"[A-Za-z ]{1,40}", re.ASCII)


def embedding_routes() -> list[BaseRoute]:
    """``/oembed``."""
    return [Route("/oembed", _oembed)]


async def _oembed(request: Request) -> Response:
    try:
        answer = _answer(request)
    except ProblemError as error:
        return respond(error)
    headers = {"cache-control": "public, max-age=3600", "access-control-allow-origin": "*"}
    return Response(json.dumps(answer), media_type="application/json", headers=headers)


def _answer(request: Request) -> dict[str, Any]:
    query = request.query_params
    form = query.get("format", "json")
    if form != "json":
        raise ProblemError(501, "http-error", f"There is no oEmbed as {shorten_text(form)}.", "Use format=json.")
    width = min(WIDTH, _pixels("maxwidth", query.get("maxwidth"), WIDTH))
    height = min(HEIGHT, _pixels("maxheight", query.get("maxheight"), HEIGHT))
    source = _embedded(query.get("url", ""), request)
    return {
        "version": "1.0",
        "type": "rich",
        "provider_name": "Kinboard",
        "provider_url": source.partition("/viewer/")[0] + "/",
        "title": "Kinboard viewer: a robot arm",
        "cache_age": 86400,
        "width": width,
        "height": height,
        "html": frame(source, width, height),
    }


def _pixels(name: str, given: str | None, default: int) -> int:
    if given is None:
        return default
    if not re.fullmatch(r"\d{1,6}", given, re.ASCII) or not LEAST <= int(given) <= MOST:
        expected = f"Use whole pixels from {LEAST} to {MOST}."
        raise ProblemError(422, "invalid-input", f"{name} is {shorten_text(given)}.", expected)
    return int(given)


def _embedded(link: str, request: Request) -> str:
    """The address to embed for a link to the viewer of this service; raises 404 for any other."""
    refused = ProblemError(
        404,
        "not-found",
        f"{shorten_text(link)} is not a link to this viewer.",
        "Give the link that the viewer's tab View offers under Share as the query parameter url.",
    )
    try:
        parts = urlsplit(link)
    except ValueError:
        raise refused from None
    path = request.scope.get("root_path", "") + "/viewer"
    origin = f"{parts.scheme}://{parts.netloc}"
    asked = {name: request.headers.get(name, "") for name in ("host", "x-forwarded-host")}
    here = Headers({**asked, "origin": origin})
    if len(link) > MAX_LINK or parts.scheme not in ("http", "https") or not origin_allowed(here, ()):
        raise refused
    if parts.path.rstrip("/") != path or not _NETLOC.fullmatch(parts.netloc):
        raise refused
    query, fragment = parse_qs(parts.query), parse_qs(parts.fragment)
    state, tab = ((fragment.get(name) or [""])[0] for name in ("s", "tab"))
    mode = (query.get("embed") or ["panel"])[0]
    if not _STATE.fullmatch(state) or mode not in MODES:
        raise refused
    kept = [f"s={state}"] if state else []
    kept += [f"tab={quote(tab)}"] if _TAB.fullmatch(tab) and mode == "panel" else []
    return f"{origin}{path}/?embed={mode}" + ("#" + "&".join(kept) if kept else "")


def discovery(request: Request) -> str:
    """The element of the viewer's page by which other sites find its oEmbed answer; empty if the host is odd."""
    netloc = request.headers.get("x-forwarded-host", "").split(",")[0].strip() or request.headers.get("host", "")
    if not _NETLOC.fullmatch(netloc):
        return ""
    service = f"{request.url.scheme}://{netloc}{request.scope.get('root_path', '')}/"
    source = f"{service}oembed?url={quote(service + 'viewer/', safe='')}"
    return f'<link rel="alternate" type="application/json+oembed" href="{html.escape(source)}" title="Kinboard">'
