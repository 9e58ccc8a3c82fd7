"""A picture of an arm as PNG."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.schemas import POST_REFUSALS, Configurations, OneOf, example, settings_of
from app.api.work import Deadline, computed
from app.exports.arm_picture import EYES, Side, arm_picture
from kin import Robot
from kin.transforms import Array

router = versioned("robots")
EXAMPLES = {"one": example("One posture", {"q": [1.2, 0.4, 0.9, 0.3, 0.6]})}


class PictureRequest(schemas.Body):
    """What is drawn."""

    q: Configurations | None = Field(
        None,
        description="Joint values in radians (metres for sliding joints); by default the home configuration. A "
        "list is a motion: its last posture is drawn clearly, some before it are pale, and a line is the path of "
        "the tool.",
    )
    side: Annotated[Side, OneOf(EYES)] = Field("corner", description="From which the arm is seen; it faces x.")
    size: int = Field(480, ge=64, le=1024, strict=True, description="Width and height in pixels.")


@operation(
    router,
    "picture",
    name="picture",
    summary="A picture of an arm",
    response_class=Response,
    examples=EXAMPLES,
    responses={
        200: {
            "description": "The picture.",
            "content": {"image/png": {"schema": {"type": "string", "format": "binary"}}},
        },
        **POST_REFUSALS,
    },
)
async def picture(request: Request, robot: Robot, body: PictureRequest) -> Response:
    """The arm as PNG: the capsules that collisions are computed with, the axes of the world frame and a scale."""
    q = robot.q_home[None]
    if body.q is not None:
        q, _ = schemas.as_configurations(robot, body.q, settings_of(request))
    return await computed(request, partial(_drawn, robot, q, body.side, body.size))


def _drawn(robot: Robot, q: Array, side: Side, size: int, _: Deadline) -> Response:
    return Response(arm_picture(robot, q, side, size), media_type="image/png")
