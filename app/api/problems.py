"""Error responses: RFC 9457 problem documents, ``application/problem+json``.

``type`` is a stable name for programs, ``detail`` a sentence to show, ``hint`` says what to do about it, and
``errors`` lists the invalid fields. A target out of reach is an answer, not a problem (see `app.api.ik`).

Each kind of problem is one row of `KINDS`. Routes raise `ProblemError`; `install_problem_handlers` turns it,
errors of the framework and input errors of the core into documents.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import HTTPException, RequestValidationError
from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import to_json
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.responses import Response
from starlette.routing import Match, Route

from kin import InputError, UnknownRobotError
from kin.errors import shorten

MEDIA_TYPE = "application/problem+json"
TAGS = {"one", "many"}  # names of union members, which pydantic puts into error locations
SHOWN = 10  # maximum number of field errors in a document
DOCS_HINT = "The /docs page shows the schema of every request, with an example that works."

# kind → title; the kind is the last part of `type`.
KINDS = {
    "bad-request": "The request cannot be read",
    "malformed-json": "The body is not valid JSON",
    "unknown-robot": "There is no such robot",
    "not-found": "There is nothing at this address",
    "method-not-allowed": "The method is not allowed at this address",
    "unauthorized": "An access token is required",
    "forbidden": "This is not allowed",
    "read-only": "The service is read-only",
    "too-many-requests": "Too many requests",
    "body-too-large": "The request body is too large",
    "batch-too-large": "The request contains too many items",
    "answer-too-large": "The answer would be too large",
    "unsupported-media-type": "The body must be JSON",
    "invalid-input": "The request contains an invalid value",
    "request-timeout": "The request did not arrive in time",
    "head-too-large": "The head of the request is too large",
    "bad-range": "The requested range is invalid",
    "not-allowed": "This is not allowed here",
    "not-running": "Nothing is under way",
    "wrong-host": "The request is for another host",
    "busy": "The service is busy",
    "preparing": "What the request needs is being prepared",
    "too-slow": "The computation takes too long",
    "internal-error": "Internal error",
    "http-error": "The request was rejected",
}


class ClientLeftError(Exception):
    """The client has left, so nobody waits for the answer."""


class FieldError(BaseModel):
    """One invalid value."""

    field: str = Field(description="Its place in the request, e.g. `q[2]` or `target.wxyz`.", examples=["q[2]"])
    value: str = Field(description="What was given, shortened.", examples=['"ninety"'])
    expected: str = Field(description="What would be valid.", examples=["a valid number"])


class Problem(BaseModel):
    """Why a request was rejected (RFC 9457)."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "type": "urn:kinboard:problem:invalid-input",
                "title": KINDS["invalid-input"],
                "status": 422,
                "detail": 'q[2]: got "ninety", expected a valid number',
                "hint": DOCS_HINT,
                "errors": [{"field": "q[2]", "value": '"ninety"', "expected": "a valid number"}],
            }
        }
    )

    type: str = Field(description="Stable identifier of the kind of problem, for programs.")
    title: str = Field(description="The kind of problem in words.")
    status: int = Field(description="The HTTP status code.")
    detail: str = Field(description="What was wrong with this request, in one sentence.")
    hint: str = Field(description="What to do about it.")
    errors: list[FieldError] = Field(description="The invalid values; empty for other kinds of problems.")


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
        self.problem = Problem(
            type=f"urn:kinboard:problem:{kind}",
            title=KINDS[kind],
            status=status,
            detail=detail,
            hint=hint,
            errors=list(errors),
        )


def invalid(*errors: FieldError, hint: str = DOCS_HINT) -> ProblemError:
    """422: the first error in the detail, all of them (up to `SHOWN`) in `errors`."""
    first = errors[0]
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    detail = f"{first.field}: got {first.value}, expected {first.expected}{more}"
    return ProblemError(422, "invalid-input", detail, hint, errors[:SHOWN])


def unknown_robot(error: UnknownRobotError) -> ProblemError:
    """404 with the ids of all robots."""
    robot_ids = ", ".join(error.robot_ids)
    field = FieldError(field="robot_id", value=show(error.robot_id), expected=f"one of {robot_ids}")
    detail = f"There is no robot {field.value}."
    hint = f"Robots: {robot_ids}. GET /api/v1/robots describes them."
    return ProblemError(404, "unknown-robot", detail, hint, [field])


def install_problem_handlers(app: FastAPI) -> None:
    """Make every error response of `app`, unhandled exceptions included, a problem document."""
    app.add_exception_handler(StarletteHTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _validation_error)
    app.add_exception_handler(UnknownRobotError, _unknown_robot)
    app.add_exception_handler(InputError, _input_error)
    app.add_exception_handler(ClientLeftError, _client_left)
    app.add_exception_handler(Exception, _internal_error)


def show(value: object) -> str:
    """A value as JSON, shortened; of long lists the length, of objects the keys."""
    if isinstance(value, list | tuple):
        if len(value) <= 8 and not any(isinstance(item, list | dict) for item in value):
            return "[" + ", ".join(show(item) for item in value) + "]"
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "an object with " + (shorten_text(", ".join(list(map(str, value))[:10])) or "nothing in it")
    if value is None or isinstance(value, str | bool | int | float):
        return shorten_text(json.dumps(value, ensure_ascii=False))
    return shorten(value)


def shorten_text(text: str, length: int = 80) -> str:
    """Text cut to `length` characters."""
    return text if len(text) <= length else text[: length - 1] + "…"


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


async def _unknown_robot(request: Request, error: Exception) -> Response:
    assert isinstance(error, UnknownRobotError)
    return respond(unknown_robot(error))


async def _input_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, InputError)
    return respond(invalid(from_input_error(error)))


async def _client_left(request: Request, error: Exception) -> Response:
    return Response(status_code=499)  # for the log: nobody receives it


async def _internal_error(request: Request, error: Exception) -> Response:
    return respond(internal_error())


def internal_error() -> ProblemError:
    """500. The cause is for the log, not for the client."""
    detail = "The request was understood, but answering it failed."
    hint = "Please report it with the request you sent; the log of the server has the cause."
    return ProblemError(500, "internal-error", detail, hint)


def from_input_error(error: InputError, prefix: str = "") -> FieldError:
    """An input error of the core as a field error."""
    return FieldError(field=prefix + error.field, value=error.value, expected=error.expected)


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
