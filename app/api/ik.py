"""Inverse kinematics: a target in, joint values out, or the reason why there are none."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import cache, partial
from typing import Annotated, Any, ClassVar
from weakref import WeakValueDictionary

import numpy as np
from fastapi import Request, Response
from pydantic import Discriminator, Field, Tag

from app.api import schemas
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.brief import BriefAnswers, Fields, brief, briefly, names_of, quick, size_of
from app.api.options import Goal, OptionsBody, Target, single_or_list, takes
from app.api.problems import invalid
from app.api.schemas import (
    POST_REFUSALS,
    Configurations,
    Pendant,
    example,
    joint_values,
    reply,
    settings_of,
    store_of,
)
from app.api.work import Deadline, compute_slots, computed, computed_here
from app.shared.answers.answer import Answer
from app.shared.answers.ik import Brief, IkAnswer, WholeAnswers, add_pendant, ik_answer, ik_renewed
from app.shared.metrics import SOLVE_SECONDS
from app.shared.problems import FieldError
from app.shared.settings import Settings
from kin import IKOptions, IKResult, Robot, Status
from kin.ik import Task, branch_names, solve, solve_at_once
from kin.ik.options import DEFAULTS
from kin.ik.table import Table
from kin.transforms import Array

router = versioned("kinematics")

# Bytes of an answer without solutions, of a solution, of one joint's value and of a redundancy parameter, about.
ANSWER, SOLUTION, JOINT, PARAMETER = 2500, 190, 25, 250
NUMERIC = 8  # solutions that the numeric solver finds, about

# Arms that have been asked for a task, by their identity: what solves them is loaded.
_ANSWERED: WeakValueDictionary[tuple[int, Task], Robot] = WeakValueDictionary()

EXAMPLES = {
    "approach": example(
        "Point and approach direction, which is what a five-joint arm can be asked for",
        {"target": {"position": [0.045, 0.191, -0.211], "approach": [-0.31, -0.164, -0.936]}},
    ),
    "pose": example(
        "A whole pose; five joints get there up to a roll, and the answer says so",
        {"target": {"position": [0.045, 0.191, -0.211], "wxyz": [0.045, 0.958, 0.225, -0.173]}, "task": "pose"},
    ),
    "position": example(
        "Only a point, near a given configuration",
        {"target": {"position": [-0.018, 0.31, -0.181]}, "q_seed": [1.2, 0.5, 0.5, 0.5, 0.5], "max_solutions": 1},
    ),
    "branch": example(
        "Only postures in front, joint 5 locked, joint 3 narrowed; a point, as two joints are then gone",
        {
            "target": {"position": [-0.03, 0.157, -0.194]},
            "branch": "shoulder front",
            "locked": [None, None, None, None, 0.5],
            "limits": [None, None, [0.0, 2.0], None, None],
        },
    ),
    "table": example(
        "A point in the frame of a table",
        {
            "target": {"position": [0.05, 0.13, 0.1], "frame": "table"},
            "workpieces": {"table": {"xyz": [0.1, 0.2, -0.3], "rpy": [0.0, 0.0, 1.5708]}},
        },
    ),
    "text": example(
        "As it stands on a pendant", {"target": {"text": "X 45 Y 191 Z -211 W 180 P 0 R 0"}, "task": "position"}
    ),
    "unreachable": example("Out of reach: still an answer", {"target": {"position": [2.0, 0.0, 0.0]}}),
    "many": example(
        "Several targets",
        {
            "target": [{"position": [0.045, 0.191, -0.211]}, {"position": [-0.018, 0.31, -0.181]}],
            "max_solutions": 1,
        },
    ),
}


@takes(DEFAULTS)
class IkRequest(OptionsBody):
    """Where the tool should go, and which solutions are returned."""

    present: ClassVar[str] = "q_seed"

    target: Annotated[
        Annotated[Target, Tag("one")] | Annotated[list[Target], Field(min_length=1, fail_fast=True), Tag("many")],
        Discriminator(single_or_list),
    ] = Field(description="One target, or a list of targets, each answered on its own.")
    q_seed: Configurations | None = Field(
        None,
        description="Configuration to stay near, in radians (metres for sliding joints); answers are sorted "
        "by the distance to it. One for all targets, or a list with one per target. "
        "By default the home configuration.",
    )
    pendant: Pendant = False


class IkAnswers(Answer):
    """Answers to a list of targets."""

    results: list[IkAnswer]
    """One per target, in the same order."""


@operation(
    router,
    "ik",
    name="ik",
    examples=EXAMPLES,
    summary="Inverse kinematics",
    response_model=IkAnswer | IkAnswers | BriefAnswers | Brief,
    responses=POST_REFUSALS,
)
async def inverse_kinematics(request: Request, robot: Robot, body: IkRequest, fields: Fields = None) -> Response:
    """Every configuration that brings the tool to a target, nearest to the seed first, or why there is none.

    A target that cannot be reached is answered with 200: `status` and `cause` are codes, `details` are the numbers
    behind them, `reason` is a sentence, `closest` is the closest configuration. One target gets one answer; a list
    gets `{"results": [...]}` in the same order. Each solution's errors are measured by forward kinematics.
    """
    names, settings = names_of(fields), settings_of(request)
    if not isinstance(body.target, list) and not body.pendant:
        answered = await _alone(request, robot, body, body.target, names)
        if answered is not None:
            return answered
    return await computed(request, partial(_solve, robot, body, names, settings), _observe)


async def _alone(
    request: Request, robot: Robot, body: IkRequest, target: Target, names: tuple[str, ...]
) -> Response | None:
    """The answer to one target if it is there sooner than a thread or process could be asked for it; else None.

    So the arm has been asked before, and joints are not locked: neither kernels nor formulas are made now. Where
    other processes compute, an arm of this service is asked by a thread of this process the first time.
    """
    given = body.keywords
    avoids = given["avoid_self_collision"] or given["obstacles"]
    if given["locked"] is not None or avoids or body.constant_frames:
        return None
    (seed,) = _seeds(robot, body, 1, settings_of(request))
    goal = body.resolve(robot, target, "target", seed)
    if _ANSWERED.get((id(robot), goal.task)) is robot:
        return _at_once(robot, body, goal, seed, names)
    if compute_slots(request).pool is None or robot not in store_of(request):
        return None
    return await computed_here(request, lambda _: _first(robot, body, goal, seed, names))


def _first(
    robot: Robot, body: IkRequest, goal: Goal, seed: Array | None, names: tuple[str, ...]
) -> Response | None:
    """`_at_once`, which loads what solves the arm; later ones are answered by the event loop."""
    answer = _at_once(robot, body, goal, seed, names)
    _ANSWERED[id(robot), goal.task] = robot
    return answer


def _observe(seconds: float) -> None:
    SOLVE_SECONDS.labels("rest").observe(seconds)


def _at_once(
    robot: Robot, body: IkRequest, goal: Goal, seed: Array | None, names: tuple[str, ...]
) -> Response | None:
    began = time.perf_counter()
    result = solve_at_once(robot, goal.T, body.options(goal.task), seed, goal.rounding)
    if result is None:  # what is asked next counts the request
        return None
    whole = ik_answer(result)
    answer = reply(brief(whole, names) if names else whole)
    _observe(time.perf_counter() - began)
    return answer


def _solve(
    robot: Robot, body: IkRequest, names: tuple[str, ...], settings: Settings, deadline: Deadline
) -> Response:
    count = len(body.target) if isinstance(body.target, list) else 1
    schemas.check_batch("target", count, settings)
    seeds = _seeds(robot, body, count, settings)
    several = body.target if isinstance(body.target, list) and not body.pendant else None
    together = None if several is None else body.poses_of_all(several)
    if together is not None:
        return _solve_together(robot, body, names, together, seeds, deadline)
    targets, single = body.resolve_all(robot, body.target, settings, seeds)

    options = {task: body.options(task) for task in {goal.task for goal in targets}}

    def answer(goal: Goal, seed: Array | None) -> IkAnswer | dict[str, Any]:
        deadline.check()
        whole = _whole(robot, goal.task, solve(robot, goal.T, options[goal.task], seed, goal.rounding))
        if body.pendant:
            add_pendant(robot, whole)
        return brief(whole, names) if names else whole

    def answers(some: slice) -> list[IkAnswer | dict[str, Any]]:
        return [answer(goal, seed) for goal, seed in zip(targets[some], seeds[some], strict=True)]

    first = options[targets[0].task]
    batch = Batch("target", len(targets), single, _size(robot, first), _advice(first))
    return one_or_all(answers, batch, deadline)


def _solve_together(
    robot: Robot,
    body: IkRequest,
    names: tuple[str, ...],
    goals: tuple[Task, Array],
    seeds: list[Array | None],
    deadline: Deadline,
) -> Response:
    """The answers to poses ``(k, 4, 4)`` of one task, as far as possible by one compiled pass."""
    task, T = goals
    options = body.options(task)
    given = None if body.q_seed is None else np.array(seeds)
    whole = partial(_whole, robot, task)

    @cache
    def table() -> WholeAnswers[IkAnswer]:
        return WholeAnswers(Table.of(robot, T, options, given, deadline.check), whole, ik_renewed)

    def answers(some: slice) -> Sequence[IkAnswer | dict[str, Any]]:
        if quick(names):
            near = None if given is None else given[some]
            return briefly(robot, T[some], options, near, whole, names, deadline.check)
        found = table().of(some)
        return [brief(each, names) for each in found] if names else found

    size = size_of(robot, names) if quick(names) else _size(robot, options)
    return one_or_all(answers, Batch("target", len(T), False, size, "" if names else _advice(options)), deadline)


def _whole(robot: Robot, task: Task, result: IKResult) -> IkAnswer:
    """The whole answer; the arm is remembered if this loaded what solves it."""
    if result.status is Status.SOLVED:
        _ANSWERED[id(robot), task] = robot
    return ik_answer(result)


def _size(robot: Robot, options: IKOptions) -> int:
    """Estimated bytes of the answer to one target, from the number of branches and their whole-turn images."""
    solutions = len(branch_names(robot)) or NUMERIC
    if options.images == "all":
        lower, upper, _ = options.constraints.bounds(robot)
        turns = (upper - lower)[robot.revolute] / math.tau
        solutions *= math.prod(max(1, math.ceil(turn - 1e-9)) for turn in turns if math.isfinite(turn))
    if options.max_solutions is not None:
        solutions = min(solutions, options.max_solutions)
    return ANSWER + solutions * (SOLUTION + JOINT * robot.n + PARAMETER * max(0, robot.n - 6))


def _advice(options: IKOptions) -> str:
    """What would make the answers smaller."""
    return 'images "nearest" or max_solutions' if options.images == "all" else "max_solutions"


def _seeds(robot: Robot, body: IkRequest, count: int, settings: Settings) -> list[Array | None]:
    """One seed ``(n,)`` per target; None stands for the home configuration."""
    if body.q_seed is None:
        return [None] * count
    seeds, single = schemas.as_configurations(robot, body.q_seed, settings, "q_seed")
    seeds = joint_values(robot, seeds, body.pendant)
    if single:
        return [seeds[0]] * count
    if len(seeds) != count:
        expected = f"one configuration, or a list of {count}, one per target"
        raise invalid(FieldError(field="q_seed", value=f"a list of {len(seeds)}", expected=expected))
    return list(seeds)
