"""Size of the workspace: bounding box, reach, holes, volume, surface, and its section."""

from __future__ import annotations

import asyncio
import contextlib
import math
from typing import Any

from fastapi import Request, Response
from pydantic import Field

from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.problems import invalid
from app.api.schemas import refusals, reply
from app.api.work import TooSlowError, busy, compute_slots
from app.api.workspace.query import NUMBER, RegionQuery, form_of, listed, numbers_of
from app.shared.answers.workspace import WorkspaceAnswer, workspace_answer
from app.shared.computations import TooManyPendingError
from app.shared.problems import FieldError, show
from app.shared.summaries import Plane, Summaries
from kin import Robot

GOES_ON = "The computation goes on: repeat the request later, or request less"

router = versioned("workspace")

_PLANE, _FORM = rf"^{NUMBER}(:{NUMBER}){{5}}$", "X:Y:Z:NX:NY:NZ"


class SummaryQuery(RegionQuery):
    """Parameters of a summary."""

    volume: bool = Field(
        True,
        description="Whether to compute volume and surface, which takes seconds; the rest takes 0.1 s.",
    )
    effort: int = Field(4, ge=2, le=16, description="Precision of volume and surface; larger values take longer.")
    section: bool = Field(
        False, description="Whether to include the section in r and z, with the arcs of its boundary."
    )
    plane: str | None = Field(
        None,
        max_length=200,
        description="Section in this plane instead, `X:Y:Z:NX:NY:NZ`: a point in metres, and a normal.",
        examples=["0:0:0.1:0:0:1"],
        json_schema_extra={"pattern": _PLANE},
    )
    resolution: int = Field(96, ge=8, le=400, description="Grid squares along the longer side of the section.")

    @classmethod
    def in_json(cls) -> dict[str, Any]:
        """In JSON, the plane may be a list of numbers."""
        return {**super().in_json(), "plane": listed(_PLANE, _FORM, joint=False) | None}

    def cut(self) -> Plane | None:
        """Point and normal of the plane; raises 422."""
        if self.plane is None:
            return None
        values = numbers_of(self.plane)
        if len(values) != 6 or not all(map(math.isfinite, values)) or not any(values[3:]):
            expected = f"{form_of(self.plane, _FORM)}, a point in metres and a normal that is not zero"
            raise invalid(FieldError(field="plane", value=show(self.plane), expected=expected))
        return values[:3], values[3:]


@operation(
    router,
    "workspace/summary",
    method="GET",
    summary="Size of the workspace",
    response_model=WorkspaceAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def summary(request: Request, robot: Robot, query: SummaryQuery) -> Response:
    """Bounding box, reach and holes, exact and with configurations; volume and surface with their errors.

    `section` adds the section with a half-plane through the axis of joint 1: closed curves and the arcs of their
    boundary; `plane` the section with any plane instead. Answers are cached for a while and shared. A request that
    is refused because it takes too long can be repeated: the computation goes on for as long again.
    """
    constraints = query.constraints(robot)
    plane = query.cut()
    if query.section and plane is None and robot.joints[0].kind != "revolute":
        expected = f"false: joint 1 of {robot.id} slides, so there is no section in r and z"
        raise invalid(FieldError(field="section", value="true", expected=expected))
    summaries: Summaries = request.app.state.summaries
    work = compute_slots(request)
    with work.watched(request) as deadline, contextlib.ExitStack() as subscriptions:
        cut = None
        try:
            facts = summaries.facts(robot, constraints, query.effort if query.volume else None, limited=True)
            subscriptions.enter_context(facts)
            if query.section or plane is not None:
                cut = summaries.section(robot, plane, constraints, query.resolution, limited=True)
                subscriptions.enter_context(cut)
        except TooManyPendingError as error:
            raise busy(f"{error.pending} summaries are being computed already.") from None
        try:
            sizes = await work.wait(facts.future, deadline, GOES_ON)
            section = None
            if cut is not None:
                section = await work.wait(cut.future, deadline, GOES_ON)
        except TooSlowError:
            # The client may come back for it.
            asyncio.get_running_loop().call_later(work.seconds, subscriptions.pop_all().close)
            raise
    return reply(workspace_answer(sizes, section))
