"""From which directions each place can be approached: a capability map in one answer."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import Query, Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from app.api.body import versioned
from app.api.problems import FieldError, invalid
from app.api.schemas import RobotId, refusals, reply, robot_of, settings_of
from app.api.work import Budget, work_of
from app.api.workspace.query import RegionQuery
from app.shared.answers.capability import CapabilityMapAnswer, capability_map_answer
from app.shared.maps import MapRequest, Maps

router = versioned("workspace")

LOOKED = 0.5  # s between two looks whether anybody still waits


class CapabilityQuery(RegionQuery):
    """Which map."""

    resolution: int = Field(
        15,
        ge=1,
        description="Voxels along the longest side; twice as many take eight times as long.",
    )
    # As strings: what an address holds; the values are numbers to whoever reads.
    directions: Literal["12", "24", "48", "96"] = Field(
        "48", description="How many evenly spread directions are asked for at each voxel."
    )
    approachable: bool = Field(False, description="Whether it is wanted which directions fit at each voxel.")


@router.get(
    "/robots/{robot_id}/capability",
    summary="From which directions places can be approached",
    response_model=CapabilityMapAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def capability(
    request: Request,
    robot_id: RobotId,
    query: Annotated[CapabilityQuery, Query()],
) -> Response:
    """The workspace in voxels, and for each that is reachable the share of directions along which the tool can be
    brought to its centre inside the limits, and the best manipulability there.

    It takes seconds, for arms without a closed form minutes; it is computed once for all who ask for the same, and
    ends when nobody waits for it any more. Maps are kept for a while.
    """
    most = settings_of(request).max_voxels
    if query.resolution > most:
        expected = f"a whole number from 1 to {most}"
        wrong = FieldError(field="resolution", value=str(query.resolution), expected=expected)
        raise invalid(wrong, hint="`kinboard capability` computes finer maps, or ask the operator for more.")
    robot = robot_of(request, robot_id)
    limits, locked = query.bounds(robot)
    wanted = MapRequest(robot, query.resolution, int(query.directions), limits, locked)
    maps: Maps = request.app.state.maps
    with request.app.state.gate.place():
        budget, reader = Budget(work_of(request)), maps.subscribe(wanted)
        try:
            answer = asyncio.wrap_future(reader.future)
            while not answer.done():
                budget.check()
                await asyncio.wait([answer], timeout=LOOKED)
                if await request.is_disconnected():
                    return Response(status_code=499)  # nobody reads it
            found = answer.result()
            # Lists of some ten thousand voxels: not on the loop that all share.
            return await run_in_threadpool(lambda: reply(capability_map_answer(found, query.approachable)))
        finally:
            reader.leave()
