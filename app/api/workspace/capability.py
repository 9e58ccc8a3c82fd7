"""Capability maps: from which directions the tool can reach each place."""

from __future__ import annotations

from typing import Literal

from fastapi import Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from app.api.arms.operation import operation
from app.api.batches import Batch, held_json
from app.api.body import versioned
from app.api.problems import invalid
from app.api.schemas import refusals, settings_of
from app.api.work import ADVICE, TooSlowError, compute_slots
from app.api.workspace.query import RegionQuery
from app.shared.answers.capability import CapabilityMapAnswer, capability_map_answer
from app.shared.clients import client_of
from app.shared.maps import MapRequest, Maps, MapTimeError
from app.shared.problems import FieldError
from kin import Robot

router = versioned("workspace")

VOXEL = 110  # bytes of a voxel in the answer, without its directions, about


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


@operation(
    router,
    "capability",
    method="GET",
    summary="Capability map",
    response_model=CapabilityMapAnswer,
    responses=refusals(404, 413, 422, 500, 503),
)
async def capability(
    request: Request,
    robot: Robot,
    query: CapabilityQuery,
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
    wanted = MapRequest(robot, query.resolution, int(query.directions), query.constraints(robot))
    maps: Maps = request.app.state.maps
    work, client = compute_slots(request), client_of(request.scope)
    voxel = VOXEL + wanted.directions * query.approachable
    answer = Batch("resolution", 1, True, voxel * query.resolution**3)
    reservation = answer.reserve(work.memory)
    slot = request.app.state.streams.slot(client)
    with slot, work.watched(request) as deadline, maps.subscribe(wanted) as reader:
        try:
            found = await work.wait(reader.future, deadline)
        except MapTimeError as error:  # somebody has waited for it longer than one request may
            raise TooSlowError(error.seconds, ADVICE) from None
        # Lists of some ten thousand voxels would block the event loop.
        return await run_in_threadpool(
            lambda: held_json(capability_map_answer(found, query.approachable), answer, reservation, work.memory)
        )
