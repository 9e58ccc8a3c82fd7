"""Reachability of many targets, decided by inverse kinematics."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from itertools import chain
from typing import Annotated

from fastapi import Request, Response
from msgspec import UNSET, UnsetType
from pydantic import Discriminator, Field, Tag
from pydantic_core import to_json

from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.options import Goal, OptionsBody, Target, single_or_list
from app.api.problems import ProblemError
from app.api.schemas import POST_REFUSALS, example, reply, settings_of
from app.api.work import Deadline, DeadlineDep
from app.api.workspace.streaming import ComputedResponse
from app.shared.answers.answer import Answer, as_json
from app.shared.answers.ik import ReachableAnswer, reachable_answer
from app.shared.problems import Problem
from kin import Robot
from kin.ik import solve

router = versioned("workspace")

# Targets between two checks of the deadline and the client: one out of reach may take some ten milliseconds.
AT_ONCE = 16

EXAMPLES = {
    "points": example(
        "Points", {"target": [{"position": [-0.018, 0.31, -0.181]}, {"position": [0.045, 0.191, -0.211]}]}
    ),
    "approach": example(
        "A point and an approach direction",
        {"target": {"position": [0.045, 0.191, -0.211], "approach": [-0.31, -0.164, -0.936]}},
    ),
    "locked": example(
        "A point, joint 5 locked and joint 3 narrowed",
        {
            "target": {"position": [-0.03, 0.157, -0.194]},
            "locked": [None, None, None, None, 0.5],
            "limits": [None, None, [0.0, 2.0], None, None],
        },
    ),
    "unreachable": example("Out of reach", {"target": {"position": [2.0, 0.0, 0.0]}}),
}


class ReachableRequest(OptionsBody):
    """Targets, and options of inverse kinematics."""

    target: Annotated[
        Annotated[Target, Tag("one")] | Annotated[list[Target], Field(min_length=1, fail_fast=True), Tag("many")],
        Discriminator(single_or_list),
    ] = Field(description="One target, or a list of targets, each judged on its own.")


class ReachableAnswers(Answer):
    """Answers to a list of targets."""

    results: list[ReachableAnswer]
    """One per target, in the same order."""
    problem: Problem | UnsetType = UNSET
    """Why results are missing: the time limit of the request was reached. Absent if all are there."""


@operation(
    router,
    "reachable",
    examples=EXAMPLES,
    summary="Reachability of targets",
    response_model=ReachableAnswer | ReachableAnswers,
    responses=POST_REFUSALS,
)
def reachable(
    request: Request,
    robot: Robot,
    deadline: DeadlineDep,
    body: ReachableRequest,
) -> Response:
    """Whether each target can be reached inside the limits; if not, why, by how much, and what comes closest.

    The result is that of `ik`, verified by forward kinematics, without the list of solutions. A reachable target
    takes a tenth of a millisecond, others some milliseconds. The answer to a list is sent while it is computed,
    and the computation ends when the client leaves.
    """
    with deadline.turn:
        targets, single = body.resolve_all(robot, body.target, settings_of(request))
        if single:
            return reply(_answers(robot, body, targets)[0])
    # Invalid options show in the first piece, while the status of the response can still be set.
    pieces = _pieces(robot, body, targets, deadline)
    pieces = _resumed(next(pieces), pieces)
    return ComputedResponse(pieces, "reachable", "application/json", place=deadline.place)


def _answers(robot: Robot, body: ReachableRequest, targets: list[Goal]) -> list[ReachableAnswer]:
    options = {goal.task: replace(body.options(goal.task), max_solutions=1) for goal in targets}
    return [reachable_answer(solve(robot, goal.T, options[goal.task], rounding=goal.rounding)) for goal in targets]


def _pieces(robot: Robot, body: ReachableRequest, targets: list[Goal], deadline: Deadline) -> Generator[bytes]:
    """``{"results": [...]}`` in pieces, with the problem if not all were computed in time."""
    for start in range(0, len(targets), AT_ONCE):
        try:
            deadline.check()
        except ProblemError as error:
            if not start:
                raise
            yield b'],"problem":' + to_json(error.problem) + b"}"
            return
        with deadline.turn:
            piece = as_json(_answers(robot, body, targets[start : start + AT_ONCE]))[1:-1]
        yield (b"," if start else b'{"results":[') + piece
    yield b"]}"


def _resumed(first: bytes, rest: Generator[bytes]) -> Generator[bytes]:
    try:
        yield from chain((first,), rest)
    finally:
        rest.close()
