"""The Jacobian: how the tool moves when the joints do."""

from __future__ import annotations

from functools import partial
from typing import Literal

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.frames import FramesBody
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.schemas import POST_REFUSALS, Configurations, example, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.answer import Answer
from app.shared.answers.jacobian import JacobianAnswer, jacobian_answers
from kin import Robot
from kin.transforms import Array

router = versioned("kinematics")

ENTRY, REST = 22, 300  # bytes of an entry, and of the rest of an answer, about

EXAMPLES = {
    "one": example("One configuration", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236]}),
    "tool": example("In the tool's own frame", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236], "frame": "tool"}),
    "many": example("Several configurations", {"q": [[0.0, 0.0, 0.0, 0.0, 0.5], [1.2, 0.4, 0.9, 0.3, 0.6]]}),
}


class JacobianRequest(FramesBody):
    """Where to evaluate the Jacobian, and in which frame."""

    q: Configurations = Field(
        description="Joint values from base to tool, in radians (metres for sliding joints): "
        "one configuration of n numbers, or a list of configurations."
    )
    frame: Literal["base", "tool"] = Field(
        "base",
        description="The directions in which the velocities of the tool point are expressed: those of the world "
        "frame, in which poses are (base), or of the tool.",
    )


class JacobianAnswers(Answer):
    """Answers to a list of configurations."""

    results: list[JacobianAnswer]
    """One per configuration, in the same order."""


@operation(
    router,
    "jacobian",
    name="jacobian",
    examples=EXAMPLES,
    summary="Jacobian and manipulability",
    response_model=JacobianAnswer | JacobianAnswers,
    responses=POST_REFUSALS,
)
async def geometric_jacobian(request: Request, robot: Robot, body: JacobianRequest) -> Response:
    """The geometric 6×n Jacobian (linear rows first), its singular values and Yoshikawa's manipulability.

    One configuration gets one answer; a list gets `{"results": [...]}` in the same order.
    """
    q, single = schemas.as_configurations(robot, body.q, settings_of(request))
    batch = Batch("q", len(q), single, REST + ENTRY * 6 * robot.n)
    return await computed(request, partial(_answers, robot, q, "tool" if body.frame == "tool" else "world", batch))


def _answers(
    robot: Robot, q: Array, frame: Literal["world", "tool"], batch: Batch, deadline: Deadline
) -> Response:
    return one_or_all(lambda some: jacobian_answers(robot, q[some], frame), batch, deadline)
