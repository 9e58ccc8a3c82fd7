"""The scoreboard: the page of a recorded run, and runs that visitors may start if the operator allows it.

``/scoreboard`` is the page, ``/scoreboard.json`` the run that it shows, ``/scoreboard/run`` a run of this machine:
GET tells how far it is, POST starts one, DELETE cancels it. Clients that may only look may not start one
(`app.shared.security.Rights`); nor may pages of other sites: a start must be sent as JSON, which they cannot do
without our consent, and its ``Origin`` must be ours.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from app.api.problems import ProblemError, respond
from app.bench.board.runs import Runs
from app.shared.security import origin_allowed
from app.shared.settings import Settings
from kin import __version__

_FRESH = {"cache-control": "no-store"}
ALLOW = (
    "Its operator can allow it with KINBOARD_BENCH=1. "
    "On your own machine: kinboard bench --quick --html scoreboard.html"
)
FOLDER = "The operator finds it in the folder for temporary files, which may be full or read-only."


class Scoreboard:
    """The routes of the scoreboard.

    Args:
        folder: what the processes of the service share for runs; None: a folder of this process.
        command: what the process of a run executes, for tests.
    """

    def __init__(
        self, settings: Settings, folder: Path | None = None, command: Sequence[str] | None = None
    ) -> None:
        self._origins = (*settings.allowed_origins, *settings.cors_origins)
        self._runs: Runs | None = None
        if settings.bench and sys.platform != "win32":
            self._runs = Runs(folder, command)

    def routes(self) -> list[BaseRoute]:
        """The page, its data, and a run."""
        return [
            Route("/scoreboard", self._page, name="scoreboard"),
            Route("/scoreboard/", _without_slash),
            Route("/scoreboard.json", self._data),
            Route("/scoreboard/run", self._run, methods=["GET", "POST", "DELETE"]),
        ]

    def close(self) -> None:
        """End a run of this process."""
        if self._runs is not None:
            self._runs.close()

    def _shown(self) -> tuple[dict[str, Any], bool]:
        """The run to show, and whether it was started here."""
        from app.bench.board.page import recorded

        found = None if self._runs is None else self._runs.result()
        return (recorded(), False) if found is None else (found, True)

    # Functions without `async` run in a thread: they read files, and templates are loaded when first asked for.
    def _page(self, _: Request) -> Response:
        from app.bench.board.page import Service, page

        document, here = self._shown()
        service = Service(__version__, self._runs is not None, here)
        return HTMLResponse(page(document, service), headers={"cache-control": "no-cache"})

    def _data(self, _: Request) -> Response:
        return JSONResponse(self._shown()[0], headers={"cache-control": "no-cache"})

    def _run(self, request: Request) -> Response:
        try:
            runs = self._allowed(request)
            if request.method == "POST" and not runs.start():
                raise ProblemError(409, "busy", "A run is under way already.", "Wait for it, or cancel it.")
            if request.method == "DELETE" and not runs.cancel():
                raise ProblemError(409, "not-running", "No run is under way.", "There is nothing to cancel.")
            status = runs.status()
        except ProblemError as error:
            return respond(error)
        except OSError as error:
            why = error.strerror or type(error).__name__
            return respond(ProblemError(503, "busy", f"The folder of the runs cannot be used: {why}.", FOLDER))
        return JSONResponse(asdict(status), 202 if request.method in ("POST", "DELETE") else 200, _FRESH)

    def _allowed(self, request: Request) -> Runs:
        """The runs; raises 403 if the operator does not allow them or the request is of another site, or 415."""
        if self._runs is None:
            raise ProblemError(403, "not-allowed", "Visitors may not start runs on this service.", ALLOW)
        if request.method in ("GET", "HEAD"):
            return self._runs
        if not origin_allowed(request.headers, self._origins):
            raise ProblemError(
                403, "not-allowed", "Pages of other sites may not start or cancel runs.", "Use the scoreboard."
            )
        kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if request.method == "POST" and kind != "application/json":
            raise ProblemError(
                415,
                "unsupported-media-type",
                f"The body is {kind or 'of no type'}.",
                "Send {} as application/json.",
            )
        return self._runs


async def _without_slash(_: Request) -> Response:
    return RedirectResponse("../scoreboard")
