"""Singularities over REST: a configuration in, the ways out of its singularity out."""

from __future__ import annotations

from functools import partial

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.options import AvoidingBody
from app.api.schemas import POST_REFUSALS, Configuration, Pendant, example, joint_values, reply, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.way import ExitsAnswer, exits_answer
from kin import Robot, leave_singularity
from kin.transforms import Array

router = versioned("kinematics")

LARGEST = 1e3  # of a margin
EXAMPLES = {
    "elbow": example("The elbow is straight", {"q": [1.0, 1.0, 0.0, 0.5, 0.5]}),
    "far": example("Far from a singularity: still an answer", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236]}),
}


class SingularityRequest(AvoidingBody):
    """Where the arm is, how far it should get, and what must not be touched."""

    q: Configuration = Field(description="Where the arm is, in radians (metres for sliding joints).")
    pendant: Pendant = False
    margin: float | None = Field(
        None,
        gt=0.0,
        le=LARGEST,
        strict=True,
        allow_inf_nan=False,
        description="σ at the end, at least; by default 0.03, or half of the arm's usual σ if that is less.",
    )


@operation(
    router,
    "singularity",
    name="leave_singularity",
    examples=EXAMPLES,
    summary="The way out of a singularity",
    response_model=ExitsAnswer,
    responses=POST_REFUSALS,
)
async def singularity(request: Request, robot: Robot, body: SingularityRequest) -> Response:
    """Motions of the joints that lead out of a singularity, those first that keep the tool where it is.

    Otherwise the tool deviates as little as it can. Limits are kept; each motion is proven free of contacts.
    """
    q = joint_values(robot, schemas.as_configurations(robot, body.q, settings_of(request))[0], body.pendant)[0]
    return await computed(request, partial(_leave, robot, q, body))


def _leave(robot: Robot, q: Array, body: SingularityRequest, deadline: Deadline) -> Response:
    found = leave_singularity(robot, q, margin=body.margin, cancel=deadline.check, **body.keywords)
    return reply(exits_answer(found, body.pendant))
