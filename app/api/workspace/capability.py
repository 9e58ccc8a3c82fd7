"""Capability maps: from which directions the tool can reach each place."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import Query, Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from app.api.body import versioned
from app.api.problems import FieldError, invalid
from app.api.schemas import RobotId, refusals, reply, robot_of, settings_of
from app.api.work import Deadline, compute_slots
from app.api.workspace.query import RegionQuery
from app.shared.answers.capability import CapabilityMapAnswer, capability_map_answer
from app.shared.clients import client_of
from app.shared.maps import MapRequest, Maps

router = versioned("workspace")

POLL = 0.5  # s between two checks whether the client is still connected


class CapabilityQuery(RegionQuery):
    """Parameters of a map."""

    resolution: int = Field(
        15,
        ge=1,
        description="Voxels along the longest side; twice as many take eight times as long.",
    )
    # Strings, as in the query of a URL.
    directions: Literal["12", "24", "48", "96"] = Field(
        "48", description="Number of evenly spread directions that are tested at each voxel."
    )
    approachable: bool = Field(False, description="Whether to list the possible directions of each voxel.")


@router.get(
    "/robots/{robot_id}/capability",
    summary="Capability map",
    response_model=CapabilityMapAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def capability(
    request: Request,
    robot_id: RobotId,
    query: Annotated[CapabilityQuery, Query()],
) -> Response:
    """For each reachable voxel of the workspace, the share of directions along which the tool can approach its
    centre inside the limits, and the largest manipulability there.

    A map takes seconds, for arms without a closed form minutes. Equal requests share one computation, which ends
    when no client waits for it any more. Maps are cached for a while.
    """
    most = settings_of(request).max_voxels
    if query.resolution > most:
        expected = f"a whole number from 1 to {most}"
        wrong = FieldError(field="resolution", value=str(query.resolution), expected=expected)
        raise invalid(
            wrong, hint="`kinboard capability` computes finer maps; the operator can raise KINBOARD_MAX_VOXELS."
        )
    robot = robot_of(request, robot_id)
    wanted = MapRequest(robot, query.resolution, int(query.directions), query.constraints(robot))
    maps: Maps = request.app.state.maps
    with request.app.state.streams.slot(client_of(request.scope)):
        deadline, reader = Deadline(compute_slots(request)), maps.subscribe(wanted)
        try:
            answer = asyncio.wrap_future(reader.future)
            while not answer.done():
                deadline.check()
                await asyncio.wait([answer], timeout=POLL)
                if await request.is_disconnected():
                    return Response(status_code=499)  # the client has left
            found = answer.result()
            # Lists of some ten thousand voxels would block the event loop.
            return await run_in_threadpool(lambda: reply(capability_map_answer(found, query.approachable)))
        finally:
            reader.leave()
