"""Match motors: their signs and zeros, from what they read in two poses or more."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import Field, WithJsonSchema

from app.api import schemas
from app.api.arms.description import MOTORS
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.problems import invalid
from app.api.schemas import POST_REFUSALS, Configuration, as_configurations, example, reply, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.motors import MotorMatchAnswer
from app.shared.problems import from_input_error
from kin import Robot, RobotFileError, robot_from_dict, robot_to_dict
from kin.motors import Motor, match_motors
from kin.transforms import Array

router = versioned("robots")

_JOINTS = ("rotating base", "rotating elbow", "pivoting elbow", "rotating wrist", "pivoting wrist")


Motors = Annotated[list[dict[str, Any]], WithJsonSchema(MOTORS)]  # as in a robot file


class MatchRequest(schemas.Body):
    """What motors read in poses."""

    q: Annotated[list[Configuration], Field(min_length=2, fail_fast=True)] = Field(
        description="Two poses or more: joint values from base to tool, in radians (metres for sliding joints)."
    )
    readings: Annotated[list[Configuration], Field(min_length=2, fail_fast=True)] = Field(
        description="In each pose the readings of all motors that move a joint, or of every motor, in their order "
        "and units. Those that begin again after a turn may have done so."
    )
    motors: Motors | None = Field(
        None, description="The motors whose signs and zeros are not known; by default those of the arm."
    )
    tolerance: float | None = Field(
        None,
        gt=0.0,
        lt=0.78,
        strict=True,
        description="How far from a pose the arm may have been put, in radians; 10° by default. Of a slide, its "
        "share of what the slide moves counts, 15 % for 10°.",
    )


EXAMPLES = {
    "two": example(
        "Two poses, by hand",
        {
            "q": [[0.2, 0.2, 0.3, 0.1, 0.3], [0.8, 1.0, 1.1, 0.9, 0.75]],
            "readings": [[79.9, 11.5, 17.2, 5.7, 17.2], [45.6, 57.3, 63.0, 51.6, 43.0]],
            "motors": [{"joint": joint, "id": number} for number, joint in enumerate(_JOINTS, 1)],
        },
    )
}


@operation(
    router,
    "motors/match",
    name="match_motors",
    summary="Signs and zeros of motors",
    response_model=MotorMatchAnswer,
    examples=EXAMPLES,
    responses=POST_REFUSALS,
)
async def match_motors_of(request: Request, robot: Robot, body: MatchRequest) -> Response:
    """Sign and zero of each motor, and which readings contradict themselves, in words."""
    settings = settings_of(request)
    poses, _ = as_configurations(robot, body.q, settings)
    schemas.check_batch("readings", len(body.readings), settings)
    motors = None if body.motors is None else _motors_of(robot, body.motors)
    options = {} if body.tolerance is None else {"tolerance": body.tolerance}

    return await computed(request, partial(_matched, robot, poses, body.readings, motors, options))


def _matched(
    robot: Robot,
    poses: Array,
    readings: list[list[float]],
    motors: tuple[Motor, ...] | None,
    options: dict[str, float],
    _: Deadline,
) -> Response:
    return reply(MotorMatchAnswer.of(match_motors(robot, poses, readings, motors, **options)))


def _motors_of(robot: Robot, described: list[dict[str, Any]]) -> tuple[Motor, ...]:
    """These motors of an arm; raises 422 naming the field."""
    try:
        return robot_from_dict({**robot_to_dict(robot), "motors": described}, "motors").motors
    except RobotFileError as error:
        raise invalid(from_input_error(error)) from None
