"""Inverse kinematics: where the tool should be in, joint values out, or why there are none."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Response
from pydantic import Discriminator, Field, Tag
from typing_extensions import TypedDict

from app.answers import IkAnswer, documented, ik_answer
from app.api import schemas
from app.api.body import JsonRoute
from app.api.problems import FieldError, invalid
from app.api.schemas import POST_REFUSALS, Configurations, Number, RobotDep, SettingsDep, example, one_or_all
from app.api.targets import Target
from app.settings import Settings
from kin import Robot, Task, solve_ik
from kin.transforms import Array

router = APIRouter(tags=["kinematics"], route_class=JsonRoute)

EXAMPLES = {
    "approach": example(
        "Point and approach direction, which is what a five-joint arm can be asked for",
        {"target": {"position": [0.045, 0.191, -0.211], "approach": [-0.31, -0.164, -0.936]}},
    ),
    "pose": example(
        "A whole pose; five joints get there up to a roll, and the answer says so",
        {"target": {"position": [0.045, 0.191, -0.211], "wxyz": [0.022, 0.921, 0.347, -0.177]}, "task": "pose"},
    ),
    "position": example(
        "Only a point, near a given configuration",
        {"target": {"position": [-0.018, 0.31, -0.181]}, "q_seed": [1.2, 0.5, 0.5, 0.5, 0.5], "max_solutions": 1},
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


def one_or_many(value: object) -> str:
    """Whether one target was sent or a list of them."""
    return "many" if isinstance(value, list) else "one"


class IkRequest(schemas.Body):
    """Where the tool should go, and which answers are wanted."""

    target: Annotated[
        Annotated[Target, Tag("one")] | Annotated[list[Target], Field(min_length=1, fail_fast=True), Tag("many")],
        Discriminator(one_or_many),
    ] = Field(description="One target, or a list of targets, each answered on its own.")
    task: Task | None = Field(
        None,
        description="pose: the whole pose. approach: the point and the direction of the tool's z axis. "
        "position: the point alone. By default what each target's form implies: "
        "`approach` given → approach, `position` alone → position, else pose.",
    )
    q_seed: Configurations | None = Field(
        None,
        description="Configuration to stay near, in radians (metres for sliding joints); answers are sorted "
        "by the distance to it. One for all targets, or a list with one per target. "
        "By default the home configuration.",
    )
    respect_limits: bool = Field(
        True, strict=True, description="Whether answers outside the joint limits are left out."
    )
    max_solutions: Annotated[int, Field(ge=1, le=10_000, strict=True)] | None = Field(
        None, description="Most solutions per target, nearest to the seed first. By default all."
    )
    redundancy: Number | None = Field(
        None,
        description="Value in radians for the arm's free parameter (the arm angle psi, or theta1; see "
        "`redundancy` in the answers). By default the feasible value nearest to the seed.",
    )


@documented
class IkAnswers(TypedDict):
    """Answers to a list of targets."""

    results: list[IkAnswer]
    """One per target, in the same order."""


@router.post(
    "/robots/{robot_id}/ik",
    summary="Inverse kinematics",
    response_model=IkAnswer | IkAnswers,
    responses=POST_REFUSALS,
)
def inverse_kinematics(
    robot: RobotDep, settings: SettingsDep, body: Annotated[IkRequest, Body(openapi_examples=EXAMPLES)]
) -> Response:
    """Every configuration that brings the tool to a target, nearest to the seed first, or why there is none.

    A target that cannot be reached is answered with 200: `status` tells the kind of answer, `reason` says it in a
    sentence, `closest` is the nearest the arm gets. One target gets one answer; a list gets
    `{"results": [...]}` in the same order. Each solution's errors are measured by forward kinematics.
    """
    single = isinstance(body.target, Target)
    targets = [body.target] if isinstance(body.target, Target) else body.target
    schemas.check_batch("target", len(targets), settings)
    # All targets are read before the first is solved: a mistake in the last one costs nothing.
    questions = [
        target.resolve(body.task, "target" if single else f"target[{i}]") for i, target in enumerate(targets)
    ]
    seeds = _seeds(robot, body, len(targets), settings)

    def answers(some: slice) -> list[IkAnswer]:
        return [
            ik_answer(
                solve_ik(
                    robot,
                    T,
                    task=task,
                    q_seed=seed,
                    respect_limits=body.respect_limits,
                    max_solutions=body.max_solutions,
                    redundancy=body.redundancy,
                )
            )
            for (task, T), seed in zip(questions[some], seeds[some], strict=True)
        ]

    return one_or_all(answers, len(targets), single)


def _seeds(robot: Robot, body: IkRequest, count: int, settings: Settings) -> list[Array | None]:
    """One seed ``(n,)`` per target; None stands for the home configuration."""
    if body.q_seed is None:
        return [None] * count
    seeds, single = schemas.as_configurations(robot, body.q_seed, settings, "q_seed")
    if single:
        return [seeds[0]] * count
    if len(seeds) != count:
        expected = f"one configuration, or a list of {count}, one per target"
        raise invalid(FieldError(field="q_seed", value=f"a list of {len(seeds)}", expected=expected))
    return list(seeds)
