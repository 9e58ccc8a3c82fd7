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
from app.shared.answers.ik import Brief, ReachableAnswer, WholeAnswers, reachable_answer, reachable_renewed
from app.shared.problems import Problem
from kin import IKOptions, Robot, Task
from kin.ik import solve
from kin.ik.table import Table
from kin.transforms import Array

router = versioned("workspace")

# Targets between two checks of the deadline and the client: one out of reach may take some ten milliseconds.
AT_ONCE = 16
Answers = Callable[[slice], Sequence[object]]

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
    with deadline.turn:
        together = None
        if isinstance(body.target, list):
            schemas.check_batch("target", len(body.target), settings)
            together = body.poses_of_all(body.target)
        if together is not None:
            answers = _answers_together(robot, body, names, together, deadline)
            count, at_once = len(together[1]), MOST_AT_ONCE if quick(names) else AT_ONCE
        else:
            targets, single = body.resolve_all(robot, body.target, settings)
            answers = partial(_answers, robot, body, names, targets)
            if single:
                return reply(answers(slice(0, 1))[0])
            count, at_once = len(targets), AT_ONCE
    pieces = _pieces(answers, count, at_once, deadline)
    # Invalid options show in the first piece, while the status of the response can still be set.
    pieces = _resumed(next(pieces), pieces)
    return ComputedResponse(pieces, "reachable", "application/json", slot=deadline.slot)


def _options(body: ReachableRequest, task: Task) -> IKOptions:
    return replace(body.options(task), max_solutions=1)


def _answers(
    robot: Robot, body: ReachableRequest, names: tuple[str, ...], targets: list[Goal], some: slice
) -> list[ReachableAnswer | dict[str, Any]]:
    goals = targets[some]
    options = {task: _options(body, task) for task in {goal.task for goal in goals}}
    whole = [reachable_answer(solve(robot, goal.T, options[goal.task], rounding=goal.rounding)) for goal in goals]
    return [brief(each, names) for each in whole] if names else [*whole]


def _answers_together(
    robot: Robot, body: ReachableRequest, names: tuple[str, ...], goals: tuple[Task, Array], deadline: Deadline
) -> Answers:
    """Those of poses ``(k, 4, 4)`` of one task, as far as possible by one compiled pass."""
    task, T = goals
    options = _options(body, task)

    def briefs(some: slice) -> list[dict[str, Any]]:
        return briefly(robot, T[some], options, None, reachable_answer, names, deadline.check)

    if quick(names):
        return briefs
    table = Table.of(robot, T, options, stop=deadline.check)
    whole = WholeAnswers(table, reachable_answer, reachable_renewed)
    return lambda some: [brief(each, names) for each in whole.of(some)] if names else whole.of(some)


def _pieces(answers: Answers, count: int, at_once: int, deadline: Deadline) -> Generator[bytes]:
    """``{"results": [...]}`` in pieces, with the problem if not all were computed in time."""
    for start in range(0, count, at_once):
        try:
            deadline.check()
            with deadline.turn:
                piece = as_json(answers(slice(start, start + at_once)))[1:-1]
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
