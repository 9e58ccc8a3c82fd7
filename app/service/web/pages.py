"""Routes of the landing page, the page of the API documentation, the scoreboard, and the files in ``static/``.

All their links are relative, so they work below any path prefix, and nothing is loaded from another host.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import Message, Receive, Scope, Send

from app.api.problems import ProblemError, respond
from app.service.web.landing import landing_page
from app.shared.settings import static_folder
from app.shared.store import Store


def page_routes(store: Store) -> list[BaseRoute]:
    """``/``, ``/docs``, ``/scoreboard`` with its data, and ``/static``."""
    folder = static_folder()
    return [
        Route("/", landing_page(store), name="landing"),
        Route("/docs", _html_page(folder / "docs.html"), name="docs"),
        Route("/docs/", partial(_without_slash, "docs")),
        Route("/scoreboard", _scoreboard, name="scoreboard"),
        Route("/scoreboard/", partial(_without_slash, "scoreboard")),
        Route("/scoreboard.json", _scoreboard_data),
        Route("/favicon.ico", _favicon),
        Mount("/static", _FreshStaticFiles(directory=folder), name="static"),
    ]


def _html_page(file: Path) -> Callable[[Request], Awaitable[Response]]:
    body = file.read_text(encoding="utf-8")

    async def page(_: Request) -> Response:
        return HTMLResponse(body, headers={"cache-control": "no-cache"})

    return page


async def _without_slash(page: str, _: Request) -> Response:
    return RedirectResponse(f"../{page}")


# Functions without `async` run in a thread: the run is read, and templates are loaded when first asked for.
def _scoreboard(_: Request) -> Response:
    from app.bench.board.page import page, recorded

    return HTMLResponse(page(recorded(), served=True), headers={"cache-control": "no-cache"})


def _scoreboard_data(_: Request) -> Response:
    from app.bench.board.page import recorded

    return JSONResponse(recorded(), headers={"cache-control": "no-cache"})


async def _favicon(_: Request) -> Response:
    return RedirectResponse("static/favicon.svg")


class _FreshStaticFiles(StaticFiles):
    """Static files that browsers revalidate each time (with a 304), so that an upgrade takes effect at once."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers.setdefault("cache-control", "no-cache")
        return _File(response) if isinstance(response, FileResponse) else response


class _File(Response):
    """A file, or a problem document if a range of it is requested that does not exist."""

    def __init__(self, file: FileResponse) -> None:
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        refused: dict[int, Message] = {}

        async def with_problem(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] in (400, 416):
                refused[message["status"]] = message
            elif not refused:
                await send(message)

        await self._file(scope, receive, with_problem)
        for status, message in refused.items():
            headers = Headers(scope=message)
            await respond(_bad_range(status, headers.get("content-range")))(scope, receive, send)


def _bad_range(status: int, size: str | None) -> ProblemError:
    detail = "The Range header cannot be read." if status == 400 else "The file has no such range."
    headers = None if size is None else {"Content-Range": size}
    return ProblemError(status, "bad-range", detail, "Ranges look like bytes=0-99.", headers=headers)
