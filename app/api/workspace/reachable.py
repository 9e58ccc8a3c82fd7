"""Reachability of many targets, decided by inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

from fastapi import Request, Response
from msgspec import UNSET, UnsetType
from pydantic import Discriminator, Field, Tag

from app.api import schemas
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.brief import BriefAnswers, Fields, brief, briefly, names_of, quick, size_of
from app.api.options import Goal, OptionsBody, Target, single_or_list
from app.api.schemas import POST_REFUSALS, example, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.answer import Answer
from app.shared.answers.ik import Brief, ReachableAnswer, WholeAnswers, reachable_answer, reachable_renewed
from app.shared.problems import Problem
from app.shared.settings import Settings
from kin import IKOptions, Robot
from kin.ik import Task, solve
from kin.ik.table import Table
from kin.transforms import Array

router = versioned("workspace")

ANSWER, JOINT = 700, 25  # bytes of an answer and of one joint's value, about
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
async def reachable(request: Request, robot: Robot, body: ReachableRequest, fields: Fields = None) -> Response:
    """Whether each target can be reached inside the limits; if not, why, by how much, and what comes closest.

    The result is that of `ik`, verified by forward kinematics, without the list of solutions. A reachable target
    takes a tenth of a millisecond, others some milliseconds. If the time of the request is over, the answer to a
    list has the results until then and a `problem`.
    """
    return await computed(request, partial(_judged, robot, body, names_of(fields), settings_of(request)))


def _judged(
    robot: Robot, body: ReachableRequest, names: tuple[str, ...], settings: Settings, deadline: Deadline
) -> Response:
    """The answer to all targets, as far as they are judged in time."""
    together, size = None, size_of(robot, names) if quick(names) else ANSWER + JOINT * robot.n
    if isinstance(body.target, list):
        schemas.check_batch("target", len(body.target), settings)
        together = body.poses_of_all(body.target)
    if together is not None:
        answers = _answers_together(robot, body, names, together, deadline)
        return one_or_all(answers, Batch("target", len(together[1]), False, size), deadline, partly=True)
    targets, single = body.resolve_all(robot, body.target, settings)
    answers = partial(_answers, robot, body, names, targets, deadline)
    return one_or_all(answers, Batch("target", len(targets), single, size), deadline, partly=True)


def _options(body: ReachableRequest, task: Task) -> IKOptions:
    return replace(body.options(task), max_solutions=1)


def _answers(
    robot: Robot,
    body: ReachableRequest,
    names: tuple[str, ...],
    targets: list[Goal],
    deadline: Deadline,
    some: slice,
) -> list[ReachableAnswer | dict[str, Any]]:
    goals = targets[some]
    options = {task: _options(body, task) for task in {goal.task for goal in goals}}

    def answer(goal: Goal) -> ReachableAnswer | dict[str, Any]:
        deadline.check()  # one out of reach may take some ten milliseconds
        whole = reachable_answer(solve(robot, goal.T, options[goal.task], rounding=goal.rounding))
        return brief(whole, names) if names else whole

    return [answer(goal) for goal in goals]


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
    table = Table.of(robot, T, options, cancel=deadline.check)
    whole = WholeAnswers(table, reachable_answer, reachable_renewed)
    return lambda some: [brief(each, names) for each in whole.of(some)] if names else whole.of(some)
