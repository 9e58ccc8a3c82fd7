"""Reachability of many targets, decided by inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Annotated, Any

from fastapi import Request, Response
from msgspec import UNSET, UnsetType
from pydantic import Discriminator, Field, Tag
from pydantic_core import to_json

from app.api import schemas
from app.api.arms.operation import operation
from app.api.batches import MOST_AT_ONCE
from app.api.body import versioned
from app.api.brief import BriefAnswers, Fields, brief, briefly, names_of, quick
from app.api.options import Goal, OptionsBody, Target, single_or_list
from app.api.problems import ProblemError
from app.api.schemas import POST_REFUSALS, example, reply, settings_of
from app.api.work import Deadline, DeadlineDep
from app.api.workspace.streaming import ComputedResponse
from app.shared.answers.answer import Answer, as_json
from app.shared.answers.ik import Brief, ReachableAnswer, reachable_answer
from app.shared.problems import Problem
from kin import IKOptions, Robot, Task
from kin.ik import solve
from kin.transforms import Array

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
    response_model=ReachableAnswer | ReachableAnswers | BriefAnswers | Brief,
    responses=POST_REFUSALS,
)
def reachable(
    request: Request,
    robot: Robot,
    deadline: DeadlineDep,
    body: ReachableRequest,
    fields: Fields = None,
) -> Response:
    """Whether each target can be reached inside the limits; if not, why, by how much, and what comes closest.

    The result is that of `ik`, verified by forward kinematics, without the list of solutions. A reachable target
    takes a tenth of a millisecond, others some milliseconds. The answer to a list is sent while it is computed,
    and the computation ends when the client leaves.
    """
    names, settings = names_of(fields), settings_of(request)
    together = None
    with deadline.turn:
        if quick(names) and isinstance(body.target, list):
            schemas.check_batch("target", len(body.target), settings)
            together = body.poses_of_all(body.target)
        if together is None:
            targets, single = body.resolve_all(robot, body.target, settings)
            if single:
                return reply(_answers(robot, body, names, targets)[0])
    if together is None:
        pieces = _pieces(partial(_answers, robot, body, names), targets, AT_ONCE, deadline)
    else:
        task, T = together
        answers = partial(_answers_together, robot, body, names, task, deadline)
        pieces = _pieces(answers, T, MOST_AT_ONCE, deadline)
    # Invalid options show in the first piece, while the status of the response can still be set.
    pieces = _resumed(next(pieces), pieces)
    return ComputedResponse(pieces, "reachable", "application/json", place=deadline.place)


def _options(body: ReachableRequest, task: Task) -> IKOptions:
    return replace(body.options(task), max_solutions=1)


def _answers(
    robot: Robot, body: ReachableRequest, names: tuple[str, ...], targets: list[Goal]
) -> list[ReachableAnswer | dict[str, Any]]:
    options = {task: _options(body, task) for task in {goal.task for goal in targets}}
    whole = [
        reachable_answer(solve(robot, goal.T, options[goal.task], rounding=goal.rounding)) for goal in targets
    ]
    return [brief(each, names) for each in whole] if names else [*whole]


def _answers_together(
    robot: Robot, body: ReachableRequest, names: tuple[str, ...], task: Task, deadline: Deadline, T: Array
) -> list[dict[str, Any]]:
    """Of poses ``(k, 4, 4)`` of one task, as far as possible by one compiled pass."""
    return briefly(robot, T, _options(body, task), None, reachable_answer, names, deadline.check)


def _pieces(
    answers: Callable[[Any], Sequence[object]], targets: Sequence[Goal] | Array, at_once: int, deadline: Deadline
) -> Generator[bytes]:
    """``{"results": [...]}`` in pieces, with the problem if not all were computed in time."""
    for start in range(0, len(targets), at_once):
        try:
            deadline.check()
            with deadline.turn:
                piece = as_json(answers(targets[start : start + at_once]))[1:-1]
        except ProblemError as error:
            if not start:
                raise
            yield b'],"problem":' + to_json(error.problem) + b"}"
            return
        yield (b"," if start else b'{"results":[') + piece
    yield b"]}"


def _resumed(first: bytes, rest: Generator[bytes]) -> Generator[bytes]:
    try:
        yield from chain((first,), rest)
    finally:
        rest.close()
