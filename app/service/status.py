"""Routes for operators: liveness, readiness, metrics."""

from __future__ import annotations

import os
from typing import Literal

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.responses import PlainTextResponse

from app.classroom import Hub
from app.service.startup import Status
from app.shared.metrics import CONTENT_TYPE, exposition
from app.shared.preparation import Preparation

router = APIRouter(tags=["service"], generate_unique_id_function=lambda route: route.name)


class Alive(BaseModel):
    """The process answers."""

    status: Literal["alive"] = "alive"
    pid: int = Field(description="Process id.")


class Kernels(BaseModel):
    """The parts of the compiled core: families of arms as `closed_form` names them, with "-all" what they do
    besides being moved, and what belongs to no family."""

    ready: list[str] = Field(description="Those that are compiled.")
    preparing: str | None = Field(description="The part that is being compiled.")
    waiting: list[str] = Field(description="Those after it; what a visitor waits for comes first.")


class Readiness(BaseModel):
    """Whether the kernels that move the first arm are compiled and the viewer listens."""

    status: Status
    complete: bool = Field(
        description="Whether all kernels are compiled. Until then, first uses may take seconds."
    )
    kernels: Kernels | None = Field(
        description="Those besides the first arm's, while they are compiled; null before that, and when all are."
    )
    classrooms: Literal["ready", "off", "read-only", "missing", "newer-database"] = Field(
        description="Whether rooms can be opened: not if KINBOARD_MAX_ROOMS is 0 (off), if the folder "
        "KINBOARD_DATA cannot be written (read-only), if the database was there and has gone (missing), or if a "
        "newer version of Kinboard has written it (newer-database). The service is ready all the same."
    )


@router.get("/metrics", summary="Metrics, for Prometheus", response_class=PlainTextResponse)
async def metrics() -> Response:
    return Response(exposition(), media_type=CONTENT_TYPE)


@router.get("/livez", summary="Is the process alive?")
async def livez() -> Alive:
    return Alive(pid=os.getpid())


@router.get(
    "/readyz",
    summary="Is the service ready?",
    responses={503: {"model": Readiness, "description": "Still warming up, or the viewer failed."}},
)
async def readyz(request: Request, response: Response) -> Readiness:
    startup = request.app.state.startup
    status: Status = startup.status
    response.headers["cache-control"] = "no-store"
    response.status_code = 200 if status == "ready" else 503
    return Readiness(
        status=status,
        complete=startup.complete,
        kernels=_kernels(startup.preparation) if status == "ready" else None,
        classrooms=await run_in_threadpool(_classrooms, request),
    )


def _kernels(preparation: Preparation) -> Kernels | None:
    if preparation.complete:
        return None
    ready, preparing, waiting = preparation.state
    return Kernels(ready=ready, preparing=preparing, waiting=waiting)


def _classrooms(request: Request) -> Literal["ready", "off", "read-only", "missing", "newer-database"]:
    state = request.app.state
    hub: Hub = state.classroom
    return "off" if state.settings.max_rooms == 0 else hub.state
