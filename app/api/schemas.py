"""Parts that requests share: numbers, configurations, the robot of the URL, and JSON responses."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from fastapi import Path, Request, Response
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import CoreSchema, core_schema

from app.api.problems import ProblemError, invalid
from app.shared.answers.answer import as_json
from app.shared.problems import FieldError, Problem, show
from app.shared.settings import Settings
from app.shared.store import Store
from kin import InputError, Robot
from kin.motors import from_pendant
from kin.transforms import Array

LARGEST = 1e6

# A number beyond a million metres or radians is a mistake, and its square may not even be a number.
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False, strict=True)]


def numbers(count: int) -> Any:
    """Field constraints of a list of exactly `count` numbers; validation stops at the first invalid item."""
    return Field(min_length=count, max_length=count, fail_fast=True)


class OneOf:
    """The values of a text: the names of a registry."""

    def __init__(self, names: Iterable[str]) -> None:
        self._names = list(names)

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> CoreSchema:
        return core_schema.literal_schema(self._names)


def integral(value: object) -> object:
    """JSON has one kind of number, so 10.0 is accepted as the integer 10."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


Vector3 = Annotated[list[Number], numbers(3)]
Vector4 = Annotated[list[Number], numbers(4)]
Configuration = Annotated[list[Number], Field(min_length=1, fail_fast=True)]


def configurations_tag(value: object) -> str:
    """Whether a list is one configuration or several, by its first item, so that errors are about one case."""
    return "many" if isinstance(value, list) and value and isinstance(value[0], list) else "one"


Configurations = Annotated[
    Annotated[Configuration, Tag("one")]
    | Annotated[list[Configuration], Field(min_length=1, fail_fast=True), Tag("many")],
    Discriminator(configurations_tag),
]


class Body(BaseModel):
    """A request body. Unknown fields are rejected by name, because a misspelt option must not be ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def in_json(cls) -> dict[str, Any]:
        """Fields of a query that have another type in a JSON body, with that type."""
        return {}

    @model_validator(mode="before")
    @classmethod
    def forbid_unknown(cls, data: Any) -> Any:
        """Rejects a field that the schema does not have, listing those it has."""
        if isinstance(data, dict):
            fields = cls.__pydantic_fields__  # `model_fields` takes ten times as long, and a batch has many bodies
            for name, value in data.items():
                if name not in fields:
                    raise InputError(str(name)[:80] or '""', value, "only the fields " + ", ".join(fields))
        return data


# Plain functions of the request: a FastAPI dependency takes ten times as long as forward kinematics.


def store_of(request: Request) -> Store:
    """The robots of this service."""
    store = request.app.state.store
    assert isinstance(store, Store)
    return store


def settings_of(request: Request) -> Settings:
    """The settings of this service."""
    settings = request.app.state.settings
    assert isinstance(settings, Settings)
    return settings


RobotId = Annotated[str, Path(description="Id of the robot, as listed by GET /robots.", examples=["pioneer5"])]


def robot_of(request: Request, robot_id: str) -> Robot:
    """A robot of this service by its id; raises `UnknownRobotError`, which becomes a 404."""
    return store_of(request).get(robot_id)


_REFUSALS: dict[int, str] = {
    400: "The body is not valid JSON.",
    404: "There is no such robot; the document lists the valid ids.",
    413: "The body, the batch in it, or its answer is larger than this service allows.",
    415: "The Content-Type of the body is not JSON.",
    422: "A value is invalid; the document names the field, the value and what is valid.",
    500: "Internal error.",
    503: "Busy or too slow; the header Retry-After says when to try again.",
}


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The documented error responses of an operation."""
    return {status: {"model": Problem, "description": _REFUSALS[status]} for status in statuses}


POST_REFUSALS = refusals(400, 404, 413, 415, 422, 500, 503)


def example(summary: str, value: dict[str, Any]) -> dict[str, Any]:
    """A named request example of the OpenAPI document."""
    return {"summary": summary, "value": value}


def reply(content: object) -> Response:
    """`content` as JSON, serialised by compiled code without validation."""
    return Response(as_json(content), media_type="application/json")


def check_batch(field: str, count: int, settings: Settings, most: int | None = None) -> None:
    """Raises 413 for more items than one request may hold (`most`; by default what the settings allow)."""
    most = settings.max_batch if most is None else most
    if count > most:
        error = FieldError(field=field, value=f"a list of {count}", expected=f"at most {most} items")
        detail = f"{field} holds {count} items; one request may hold {most}."
        hint = "Split the list into several requests."
        raise ProblemError(413, "batch-too-large", detail, hint, [error])


Pendant = Annotated[
    bool,
    Field(
        strict=True,
        description="Whether joint values are those that the arm's pendant shows, as its file states them under "
        "`pendant`: FANUC's J3, for example, counts from the horizontal.",
    ),
]


def joint_values(robot: Robot, values: Array, pendant: bool) -> Array:
    """Joint values ``(k, n)`` from what was sent."""
    return from_pendant(robot, values) if pendant else values


def as_configurations(
    robot: Robot, q: list[float] | list[list[float]], settings: Settings, field: str = "q"
) -> tuple[Array, bool]:
    """Configurations as ``(k, n)`` and whether it was a single one.

    Raises:
        ProblemError: 413 for too many; 422 naming the one whose number of values is not the robot's.
    """
    single = not isinstance(q[0], list)
    rows: list[Any] = [q] if single else q
    check_batch(field, len(rows), settings)
    for i, row in enumerate(rows):
        if len(row) != robot.n:
            joints = ", ".join(joint.name for joint in robot.joints)
            error = FieldError(
                field=field if single else f"{field}[{i}]",
                value=f"{len(row)} values: {show(row)}" if len(row) <= 8 else f"{len(row)} values",
                expected=f"{robot.n} values in radians (metres for sliding joints)",
            )
            raise invalid(error, hint=f"The joints of {robot.id} are: {joints}.")
    return np.array(rows, dtype=np.float64), single
