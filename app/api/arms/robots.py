"""Which arms there are, and everything that defines one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from fastapi import Query, Request, Response
from starlette.concurrency import run_in_threadpool

from app.api.body import versioned
from app.api.schemas import RobotId, refusals, reply, robot_of, store_of
from app.shared.answers.answer import Answer
from app.shared.answers.robots import BriefRobotAnswer, RobotAnswer, brief_answer, robot_answer
from app.shared.finding import FIELDS, LONGEST, find_robots
from kin import Robot

router = versioned("robots")

Find = Annotated[
    str,
    Query(
        max_length=LONGEST,
        description="Only robots that all these words fit, of their id, name, maker or solver, or: "
        + "; ".join(FIELDS.values())
        + ".",
        examples=["kuka joints:7"],
    ),
]

Brief = Annotated[bool, Query(description="Only the id, name, maker, number of joints and solver of each.")]


class RobotList(Answer):
    """The robots this service offers."""

    robots: list[RobotAnswer]
    """In the order they are offered."""


class BriefRobotList(Answer):
    """The same in short."""

    robots: list[BriefRobotAnswer]
    """In the order they are offered."""


@router.get(
    "/robots", summary="List the robots", response_model=RobotList | BriefRobotList, responses=refusals(422, 500)
)
async def list_robots(request: Request, find: Find = "", brief: Brief = False) -> Response:
    """Every arm with its DH table, joints and limits. Its `id` goes into the other addresses."""
    # The solvers of the operator's arms are chosen by solving test poses.
    found = await run_in_threadpool(_answers, store_of(request).robots, find, brief)
    return reply({"robots": found})


def _answers(robots: Iterable[Robot], query: str, brief: bool) -> list[RobotAnswer] | list[BriefRobotAnswer]:
    found = find_robots(robots, query)
    return [brief_answer(robot) for robot in found] if brief else [robot_answer(robot) for robot in found]


@router.get(
    "/robots/{robot_id}", summary="Describe a robot", response_model=RobotAnswer, responses=refusals(404, 422, 500)
)
async def describe_robot(request: Request, robot_id: RobotId) -> Response:
    """DH table, joints with their limits, home configuration and source of one arm, in radians and metres."""
    return reply(robot_answer(robot_of(request, robot_id)))
