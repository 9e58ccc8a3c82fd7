"""Calibrate by touching: postures to touch in, and the table of an arm from what its joints read in touches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal, TypeVar

from fastapi import Request, Response
from pydantic import Field, StrictInt

from app.api import schemas
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.schemas import POST_REFUSALS, Configuration, as_configurations, example, numbers, reply, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.calibration import CalibrationAnswer, TouchPlanAnswer
from kin import InputError, Robot
from kin.calibration import (
    MOST_TOUCHES,
    TableTolerances,
    TouchBoard,
    TouchFixture,
    TouchNoise,
    calibrate,
    touch_postures,
)
from kin.calibration.fixtures import MOST_BOARDS, MOST_SOCKETS
from kin.transforms import Array

T = TypeVar("T")
router = versioned("robots")
MOST_PLANNED = 100
Touches = tuple[Array, list[int]]
Matrix = Annotated[list[schemas.Vector4], numbers(4)]
_PIN: dict[str, Any] = {"boards": [{}]}
_TOUCHES = [  # of pioneer5
    [2.543, 0.635, 0.986, 1.443, 0.772],
    [2.812, 0.423, 1.223, 1.447, 0.28],
    [2.746, 0.5, 0.948, 0.738, 0.601],
    [2.754, 0.498, 0.944, 0.708, 0.601],
    [2.97, 0.407, 1.123, 0.073, 0.272],
    [2.979, 0.516, 0.763, 0.007, 0.761],
]


def _part(place: str, make: Callable[..., T], *given: Any, **options: Any) -> T:
    """What the core makes of a part of a request; errors name the field within it."""
    try:
        return make(*given, **options)
    except InputError as error:
        raise error.within(place) from None


class BoardBody(schemas.Body):
    """One board: `bar`, `sheet` or `sockets`; without these a pin."""

    bar: float | None = Field(
        None, ge=0.01, le=2.0, strict=True, description="Two sockets at this distance in metres."
    )
    sheet: Literal["A5", "A4", "A3"] | None = Field(None, description="Six crosses on a sheet of this size.")
    sockets: Annotated[list[schemas.Vector3], Field(min_length=1, max_length=MOST_SOCKETS)] | None = Field(
        None, description="Sockets in the frame of the board, whose z axis points out of them, in metres."
    )

    def board(self) -> TouchBoard:
        """The board; raises `InputError`."""
        if self.sheet is not None:
            return TouchBoard.sheet(self.sheet)
        if self.sockets is not None:
            return TouchBoard(self.sockets)  # type: ignore[arg-type]  # becomes an array
        return TouchBoard.pin() if self.bar is None else TouchBoard.bar(self.bar)


class FixtureBody(schemas.Body):
    """What is touched. Sockets are numbered through, from 0, in the order of the boards; -1 is the plane."""

    boards: Annotated[list[BoardBody], Field(min_length=1, max_length=MOST_BOARDS)] = Field(
        description="A board that is touched at several places is listed several times."
    )
    plane: bool = Field(False, strict=True, description="Whether a plane is touched as well.")
    at_base: list[Matrix] | None = Field(
        None,
        max_length=MOST_BOARDS,
        description="Poses of the boards in the world frame, 4×4, if they lie at marked places, to 1 mm and 0.5°: "
        "then the base is seen as well.",
    )

    def fixture(self) -> TouchFixture:
        """The fixture; raises `InputError`."""
        boards = [_part(f"fixture.boards[{i}]", each.board) for i, each in enumerate(self.boards)]
        return _part("fixture", TouchFixture, boards, self.plane, self.at_base)


class TolerancesBody(schemas.Body):
    """Largest errors that are expected; the fit takes them to be up to three times as large."""

    zero: float | None = Field(None, ge=1e-6, strict=True, description="Of a joint's zero, in radians.")
    length: float | None = Field(None, ge=1e-6, strict=True, description="Of a length d or a, in metres.")
    twist: float | None = Field(None, ge=1e-6, strict=True, description="Of a twist and a tilt, in radians.")
    tip: float | None = Field(None, ge=1e-6, strict=True, description="Of the tool point, in metres.")
    scale: float | None = Field(None, ge=0.0, strict=True, description="Share by which all lengths may be off.")
    wave: float | None = Field(None, ge=0.0, strict=True, description="Of an encoder in each turn, in radians.")
    keep_family: bool | None = Field(None, strict=True, description="Whether what is 0 stays 0, and all twists.")


class NoiseBody(schemas.Body):
    """What a reading and a contact are off by at random, as standard deviations."""

    joint: float = Field(ge=1e-6, lt=0.5, strict=True, description="Of a reading, in radians (metres).")
    contact: float = Field(ge=1e-6, le=0.1, strict=True, description="Of a contact in each direction, in metres.")


class TouchBody(schemas.Body):
    """What both operations need."""

    fixture: FixtureBody = Field(description="What is touched.")
    tolerances: TolerancesBody | None = Field(None, description="By default what is usual for the arm.")
    noise: NoiseBody | None = Field(None, description="By default what is usual for the arm.")

    def asked(self, robot: Robot) -> dict[str, Any]:
        """The arguments for the core; raises `InputError`."""
        given = {} if self.tolerances is None else self.tolerances.model_dump(exclude_none=True)
        tolerances = _part("tolerances", replace, TableTolerances.of(robot), **given)
        noise = None if self.noise is None else TouchNoise(self.noise.joint, self.noise.contact)
        return {"fixture": self.fixture.fixture(), "tolerances": tolerances, "noise": noise}


class TouchesBody(schemas.Body):
    """What was touched, and what the joints read."""

    q: Annotated[list[Configuration], Field(min_length=1, max_length=MOST_TOUCHES, fail_fast=True)] = Field(
        description="Joint values that were read in the touches, from base to tool, in radians (metres)."
    )
    sockets: Annotated[list[StrictInt], Field(min_length=1, max_length=MOST_TOUCHES, fail_fast=True)] = Field(
        description="What was touched in each: the number of a socket from 0, or -1 for the plane."
    )


class PosturesRequest(TouchBody):
    """What is to be touched."""

    count: int = Field(20, ge=1, le=MOST_PLANNED, strict=True, description="How many touches.")
    places: list[Matrix] | None = Field(
        None,
        max_length=MOST_BOARDS,
        description="Roughly where the boards lie, 4×4 in the world frame with z out of the sockets; proposed "
        "without it.",
    )
    table: schemas.Number | None = Field(None, description="Height of the table in the world frame, in metres.")
    seed: int = Field(0, ge=0, lt=2**31, strict=True, description="Of the random candidates.")
    done: TouchesBody | None = Field(None, description="Touches made already; `count` further ones are proposed.")


class CalibrateRequest(TouchBody, TouchesBody):
    """What was touched, and what the joints read."""


@operation(
    router,
    "touch-postures",
    name="touch_postures",
    summary="Postures to touch in",
    response_model=TouchPlanAnswer,
    examples={"pin": example("One pin", {"fixture": _PIN, "count": 6, "table": -0.24})},
    responses=POST_REFUSALS,
)
async def touch_postures_of(request: Request, robot: Robot, body: PosturesRequest) -> Response:
    """The postures in which touches say most about the tip elsewhere, and how far it will be off afterwards."""
    done = body.done
    made = None if done is None else (_read(request, robot, done, "done.q"), done.sockets)
    return await computed(request, partial(_planned, robot, body, made))


def _planned(robot: Robot, body: PosturesRequest, done: Touches | None, deadline: Deadline) -> Response:
    given = {**body.asked(robot), "count": body.count, "places": body.places, "table": body.table}
    try:
        plan = touch_postures(robot, **given, done=done, seed=body.seed, cancel=deadline.check)
    except InputError as error:
        part = {"done[0]": "done.q", "done[1]": "done.sockets"}.get(error.field[:7])
        raise (error if part is None else error.renamed(part + error.field[7:])) from None
    return reply(TouchPlanAnswer.of(plan))


@operation(
    router,
    "calibrate",
    name="calibrate",
    summary="The table of an arm from touches",
    response_model=CalibrationAnswer,
    examples={"pin": example("Touches of one pin", {"fixture": _PIN, "q": _TOUCHES, "sockets": [0] * 6})},
    responses=POST_REFUSALS,
)
async def calibrate_by_touching(request: Request, robot: Robot, body: CalibrateRequest) -> Response:
    """The arm with its own table, how well it is known, and which touches contradict the others, in words."""
    return await computed(request, partial(_calibrated, robot, _read(request, robot, body, "q"), body))


def _calibrated(robot: Robot, q: Array, body: CalibrateRequest, deadline: Deadline) -> Response:
    found = calibrate(robot, q, body.sockets, **body.asked(robot), cancel=deadline.check)
    return reply(CalibrationAnswer.of(found))


def _read(request: Request, robot: Robot, body: TouchesBody, field: str) -> Array:
    """The joint values of touches ``(k, n)``."""
    return as_configurations(robot, body.q, settings_of(request), field)[0]
