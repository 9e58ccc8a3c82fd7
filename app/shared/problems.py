"""Problem documents (RFC 9457), which REST answers and ``kinboard --json`` prints.

``type`` is a stable name for programs, ``detail`` a sentence to show, ``hint`` says what to do about it, and
``errors`` lists the invalid fields. Each kind of problem is one row of `KINDS`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict, Field

from kin import InputError, KinematicsError, RobotFileError, UnknownRobotError
from kin.errors import shorten

MEDIA_TYPE = "application/problem+json"
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
    "other-origin": "Pages of this origin may not read answers",
    "busy": "The service is busy",
    "too-slow": "The computation takes too long",
    "internal-error": "Internal error",
    "http-error": "The request was rejected",
}


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


def problem(
    status: int, kind: str, detail: str, hint: str = DOCS_HINT, errors: Sequence[FieldError] = ()
) -> Problem:
    """A document; `kind` is a row of `KINDS`."""
    return Problem(
        type=f"urn:kinboard:problem:{kind}",
        title=KINDS[kind],
        status=status,
        detail=detail,
        hint=hint,
        errors=list(errors),
    )


def invalid_input(*errors: FieldError, hint: str = DOCS_HINT) -> Problem:
    """422: the first error in the detail, all of them (up to `SHOWN`) in `errors`."""
    first = errors[0]
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    detail = f"{first.field}: got {first.value}, expected {first.expected}{more}"
    return problem(422, "invalid-input", detail, hint, errors[:SHOWN])


def unknown_robot(error: UnknownRobotError, hint: str = "GET /api/v1/robots describes them.") -> Problem:
    """404 with the ids of all robots."""
    robot_ids = ", ".join(error.robot_ids)
    field = FieldError(field="robot_id", value=show(error.robot_id), expected=f"one of {robot_ids}")
    detail = f"There is no robot {field.value}."
    return problem(404, "unknown-robot", detail, f"Robots: {robot_ids}. {hint}", [field])


def problem_of(error: KinematicsError, hint: str, robots_hint: str) -> Problem:
    """The document for an error of the core; `hint`: what to do, `robots_hint`: what describes the robots."""
    if isinstance(error, UnknownRobotError):
        return unknown_robot(error, robots_hint)
    fields = [from_input_error(error)] if isinstance(error, InputError | RobotFileError) else []
    return problem(422, "invalid-input", str(error), hint, fields)


def from_input_error(error: InputError | RobotFileError, prefix: str = "") -> FieldError:
    """An input error of the core as a field error."""
    return FieldError(field=prefix + error.field, value=error.value, expected=error.expected)


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
