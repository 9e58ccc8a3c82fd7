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

router = APIRouter(tags=["service"], generate_unique_id_function=lambda route: route.name)


class Alive(BaseModel):
    """The process answers."""

    status: Literal["alive"] = "alive"
    pid: int = Field(description="Process id.")


class Readiness(BaseModel):
    """Whether the viewer serves visitors and the processes that compute have started."""

    status: Status
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
    responses={
        503: {
            "model": Readiness,
            "description": "It is starting, or the viewer or a process that computes could not start.",
        }
    },
)
async def readyz(request: Request, response: Response) -> Readiness:
    status: Status = request.app.state.startup.status
    response.headers["cache-control"] = "no-store"
    response.status_code = 200 if status == "ready" else 503
    return Readiness(status=status, classrooms=await run_in_threadpool(_classrooms, request))


def _classrooms(request: Request) -> Literal["ready", "off", "read-only", "missing", "newer-database"]:
    state = request.app.state
    hub: Hub = state.classroom
    return "off" if state.settings.max_rooms == 0 else hub.state
