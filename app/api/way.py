"""Ways around obstacles over REST: a start and a goal in, waypoints and a checked program out."""

from __future__ import annotations

from functools import partial

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.options import AvoidingBody
from app.api.schemas import POST_REFUSALS, Configuration, example, reply, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.way import WayAnswer, way_answer
from app.shared.settings import Settings
from kin import InputError, Robot
from kin.transforms import Array
from kin.way import find_way, way_program

router = versioned("motion")

LONGEST = 10.0  # seconds of a search
EXAMPLES = {
    "free": example("Nothing in between", {"q_goal": [1.0, 0.7, 0.9, 0.3, 0.6]}),
    "ball": example(
        "A goal inside an obstacle: still an answer",
        {
            "q_goal": [1.0, 0.7, 0.9, 0.3, 0.6],
            "obstacles": [{"shape": "sphere", "xyz": [0.0, 0.0, 0.0], "radius": 1.0}],
        },
    ),
}


class WayRequest(AvoidingBody):
    """From where to where, and what must not be touched."""

    q_start: Configuration | None = Field(
        None,
        description="Where the arm is, in radians (metres for sliding joints); by default the home configuration.",
    )
    q_goal: Configuration | None = Field(None, description="Where it should go; or `T_goal`.")
    T_goal: list[list[float]] | None = Field(
        None, description="Where the tool should go, as a 4×4 matrix in the world frame, in any posture."
    )
    seed: int = Field(0, ge=0, lt=2**32, strict=True, description="Of the random search.")
    time_limit: float = Field(
        5.0, gt=0.0, le=LONGEST, strict=True, allow_inf_nan=False, description="Seconds for the search."
    )


@operation(
    router,
    "way",
    examples=EXAMPLES,
    summary="A way around obstacles",
    response_model=WayAnswer,
    responses=POST_REFUSALS,
)
async def way(request: Request, robot: Robot, body: WayRequest) -> Response:
    """Waypoints between which the arm touches nothing, and a program through them.

    Motions are proven free, between waypoints too. That none is found in time does not mean that there is none; a
    goal that touches something, or is outside the limits, is an answer with its cause.
    """
    return await computed(request, partial(_find, robot, body, settings_of(request)))


def _find(robot: Robot, body: WayRequest, settings: Settings, deadline: Deadline) -> Response:
    def read(q: Configuration | None, field: str) -> Array | None:
        return None if q is None else schemas.as_configurations(robot, q, settings, field)[0][0]

    start, end = read(body.q_start, "q_start"), read(body.q_goal, "q_goal")
    goal = body.T_goal if end is None else end
    if goal is None or (end is not None and body.T_goal is not None):
        raise InputError("q_goal", body.q_goal, "q_goal or T_goal, one of them")
    try:
        found = find_way(
            robot,
            robot.q_home if start is None else start,
            goal,
            seed=body.seed,
            time_limit=body.time_limit,
            cancel=deadline.check,
            **body.keywords,
        )
        motion = way_program(found, cancel=deadline.check, **body.keywords) if found.found else None
    except InputError as error:
        raise (error.renamed("T_goal") if error.field == "goal" else error) from None
    return reply(way_answer(found, motion))
