"""Compare an arm with another one: are they the same, and what was mistyped if not?"""

from __future__ import annotations

from functools import partial
from typing import Literal

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.description import EXAMPLE, RobotDescription
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.schemas import POST_REFUSALS, example, reply, robot_of
from app.api.work import Deadline, computed
from app.shared.answers.comparison import ComparisonAnswer, comparison_answer
from kin import Robot, compare

router = versioned("robots")

EXAMPLES = {
    "two": example("Another table", {"other": EXAMPLE, "frames": "free"}),
    "built-in": example("Another arm of this service", {"other": "puma560"}),
}


class Tolerance(schemas.Body):
    """Largest difference of the poses of arms that count as close."""

    position: float = Field(ge=0.0, le=1.0, strict=True, description="In metres.")
    rotation: float = Field(ge=0.0, le=1.0, strict=True, description="In radians.")


class CompareRequest(schemas.Body):
    """The arm that is compared with the reference."""

    other: RobotDescription | str = Field(
        description="The table in question: the id of an arm of this service, or the fields of a robot file."
    )
    frames: Literal["fixed", "free"] = Field(
        "fixed",
        description="`fixed`: equal joint values should give equal poses, so that another base, tool or zero is a "
        "mistake too. `free`: these are expected to differ, as between a URDF and a book.",
    )
    tolerance: Tolerance | None = Field(
        None, description="By default only digits beyond those that are printed are forgiven: 0.01 mm and 0.001°."
    )


@operation(
    router,
    "compare",
    sent="robots/compare",
    summary="Compare two arms",
    response_model=ComparisonAnswer,
    examples=EXAMPLES,
    responses=POST_REFUSALS,
)
async def compare_robots(request: Request, robot: Robot, body: CompareRequest) -> Response:
    """Whether two tables describe one arm in different frames, with other zeros or in the other convention.

    If not, where they differ first, and which one or two mistakes in the other table explain it. Every "same" and
    every explanation is confirmed by forward kinematics.
    """

    other = robot_of(request, body.other) if isinstance(body.other, str) else body.other
    tolerance = None if body.tolerance is None else (body.tolerance.position, body.tolerance.rotation)
    return await computed(request, partial(_compared, robot, other, body.frames, tolerance))


def _compared(
    robot: Robot,
    other: Robot | RobotDescription,
    frames: Literal["fixed", "free"],
    tolerance: tuple[float, float] | None,
    _: Deadline,
) -> Response:
    if isinstance(other, RobotDescription):
        other = other.robot("other")
    return reply(comparison_answer(compare(robot, other, frames=frames, tolerance=tolerance), robot, other))
