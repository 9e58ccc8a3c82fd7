"""Error responses: problem documents of :mod:`app.shared.problems`, ``application/problem+json``.

A target out of reach is an answer, not a problem (see `app.api.ik`). Routes raise `ProblemError`;
`install_problem_handlers` turns it, errors of the framework and input errors of the core into documents.
"""

from __future__ import annotations

from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import HTTPException, RequestValidationError
from pydantic_core import to_json
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.responses import Response
from starlette.routing import Match, Route

from app.shared.problems import (
    DOCS_HINT,
    MEDIA_TYPE,
    FieldError,
    Problem,
    from_input_error,
    invalid_input,
    problem,
    shorten_text,
    show,
)
from app.shared.problems import unknown_robot as no_such_robot
from kin import InputError, UnknownRobotError

TAGS = {"one", "many"}  # names of union members, which pydantic puts into error locations


class ClientLeftError(Exception):
    """The client has left, so nobody waits for the answer."""


class ProblemError(HTTPException):
    """An error response. `kind` is a row of `KINDS`."""

    def __init__(
        self,
        status: int,
        kind: str,
        detail: str,
        hint: str = DOCS_HINT,
        errors: Sequence[FieldError] = (),
        headers: dict[str, str] | None = None,
    ) -> None:
        super().__init__(status, detail, headers)
        self.problem = problem(status, kind, detail, hint, errors)


def _error(document: Problem) -> ProblemError:
    """The document as an error."""
    kind = document.type.rpartition(":")[2]
    return ProblemError(document.status, kind, document.detail, document.hint, document.errors)


def invalid(*errors: FieldError, hint: str = DOCS_HINT) -> ProblemError:
    """422: the first error in the detail, all of them in `errors`."""
    return _error(invalid_input(*errors, hint=hint))


def unknown_robot(error: UnknownRobotError) -> ProblemError:
    """404 with the ids of all robots."""
    return _error(no_such_robot(error))


def install_problem_handlers(app: FastAPI) -> None:
    """Make every error response of `app`, unhandled exceptions included, a problem document."""
    app.add_exception_handler(StarletteHTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    app.add_exception_handler(UnknownRobotError, _core_error)
    app.add_exception_handler(InputError, _core_error)
    app.add_exception_handler(ClientLeftError, _client_left)
    app.add_exception_handler(Exception, _internal_error)


def respond(error: ProblemError) -> Response:
    """The document as a response."""
    content = to_json(error.problem)
    return Response(content, error.status_code, dict(error.headers or {}), MEDIA_TYPE)


async def _http_error(request: Request, error: Exception) -> Response:
    if isinstance(error, ProblemError):
        return respond(error)
    assert isinstance(error, StarletteHTTPException)
    path = shorten_text(request.url.path)
    headers = dict(error.headers or {})
    if error.status_code == 404:
        return respond(
            ProblemError(404, "not-found", f"There is nothing at {path}.", "See /docs for all addresses.")
        )
    if error.status_code == 405:
        if methods := _methods_at(request):  # a mounted folder sets its own
            headers["Allow"] = ", ".join(methods)
        hint = f"Allowed: {headers['Allow']}." if "Allow" in headers else DOCS_HINT
        detail = f"{path} does not allow {request.method}."
        return respond(ProblemError(405, "method-not-allowed", detail, hint, headers=headers))
    kind = "bad-request" if error.status_code == 400 else "http-error"
    detail = str(error.detail) or HTTPStatus(error.status_code).phrase
    return respond(ProblemError(error.status_code, kind, detail, headers=headers))


def _methods_at(request: Request) -> list[str]:
    """Methods of an address: each may be a route of its own, and the route that rejects knows only one.

    An address that has a route without parameters is not taken for a robot's.
    """
    routes = [
        route
        for route in request.app.routes
        if isinstance(route, Route) and route.matches(request.scope)[0] is not Match.NONE
    ]
    exact = [route for route in routes if not route.param_convertors]
    return sorted(set[str]().union(*(route.methods or () for route in exact or routes)))


async def _validation_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    return respond(invalid(*(field_error(item) for item in error.errors())))


def as_problem(error: Exception) -> ProblemError | None:
    """The error of the core that a client has caused, as a problem; None: it is another error."""
    if isinstance(error, UnknownRobotError):
        return unknown_robot(error)
    return invalid(from_input_error(error)) if isinstance(error, InputError) else None


async def _core_error(request: Request, error: Exception) -> Response:
    problem = as_problem(error)
    assert problem is not None
    return respond(problem)


async def _client_left(request: Request, error: Exception) -> Response:
    return Response(status_code=499)  # for the log: nobody receives it


async def _internal_error(request: Request, error: Exception) -> Response:
    return respond(internal_error())


def internal_error() -> ProblemError:
    """500. The cause is for the log, not for the client."""
    detail = "The request was understood, but answering it failed."
    hint = "Please report it with the request you sent; the log of the server has the cause."
    return ProblemError(500, "internal-error", detail, hint)


def field_error(item: dict[str, Any]) -> FieldError:
    """An error of pydantic as a field error."""
    field = ""
    for part in item["loc"][1:]:
        if part not in TAGS:
            field += f"[{part}]" if isinstance(part, int) else f".{part}" if field else str(part)
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        found = from_input_error(cause, f"{field}." if field else "")
        given = item["input"]
        return found.model_copy(update={"value": show(given[cause.field])}) if cause.field in given else found
    value = show(item["input"])
    expected = item["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    if item["type"] == "missing":
        value = "nothing"
        expected = "a value" if field else "a JSON object in the body"
    elif item["type"] in ("model_attributes_type", "model_type", "dict_type"):
        expected = "a JSON object"
    elif item["type"] == "list_type":
        expected = "a list"
    elif item["type"] == "too_short":
        expected = _items("at least", item["ctx"]["min_length"])
    elif item["type"] == "too_long":
        expected = _items("at most", item["ctx"]["max_length"])
    return FieldError(field=field or "body", value=value, expected=expected)


def _items(how: str, count: int) -> str:
    return f"{how} {count} item" + "s" * (count != 1)
