"""Path inverse kinematics: a list of targets in, one joint path through all of them out."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.options import OptionsBody, Target
from app.api.problems import invalid
from app.api.schemas import POST_REFUSALS, Configuration, example, reply, settings_of
from app.api.work import Deadline, computed
from app.shared.answers.path import PathAnswer, PosturesAnswer, path_answer, postures_answer
from app.shared.problems import FieldError
from app.shared.settings import Settings
from kin import Robot
from kin.ik.options import IKOptions
from kin.path import path_postures, solve
from kin.transforms import Array

router = versioned("kinematics")

EXAMPLES = {
    "line": example(
        "Down along a line, from the home configuration",
        {
            "targets": [
                {"position": [-0.03, 0.157, -0.194], "approach": [-0.25, -0.433, -0.866]},
                {"position": [-0.03, 0.157, -0.204], "approach": [-0.25, -0.433, -0.866]},
                {"position": [-0.03, 0.157, -0.214], "approach": [-0.25, -0.433, -0.866]},
            ],
            "q_start": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236],
        },
    ),
    "points": example(
        "Three points, the last one out of reach: its neighbours are still exact",
        {
            "targets": [
                {"position": [-0.018, 0.31, -0.181]},
                {"position": [-0.018, 0.32, -0.171]},
                {"position": [-0.018, 0.9, -0.171]},
            ]
        },
    ),
}


class PathRequest(OptionsBody):
    """Where the tool should go, one waypoint after the other."""

    present: ClassVar[str] = "q_start"

    targets: list[Target] = Field(
        description="The waypoints in order; all of them in a form that allows the same task.",
        min_length=1,
        fail_fast=True,
    )
    q_start: Configuration | None = Field(
        None,
        description="Where the arm is, in radians (metres for sliding joints): the way from there to the first "
        "waypoint is kept short. Without it the path begins wherever it is best.",
    )
    max_step: schemas.Number = Field(
        0.5,
        gt=0,
        description="The most a joint may move between neighbouring waypoints, in radians (of a sliding "
        "joint as a share of the arm's reach); a larger step is a jump.",
    )


@operation(
    router,
    "ik/path",
    name="ik_path",
    examples=EXAMPLES,
    summary="Inverse kinematics along a path",
    response_model=PathAnswer,
    responses=POST_REFUSALS,
)
async def path_inverse_kinematics(request: Request, robot: Robot, body: PathRequest) -> Response:
    """One continuous joint path through all targets: as few jumps as possible, then as little motion as possible.

    Branches, whole turns and redundancy parameters are chosen for the path as a whole, so that no joint turns up
    to its limit where another start would have avoided it. Each remaining jump has its place, cause and numbers; a
    waypoint that cannot be reached is a gap, and the path holds the closest configuration there.
    """
    return await computed(request, partial(_solve, robot, body, settings_of(request)))


@operation(
    router,
    "ik/path/postures",
    examples=EXAMPLES,
    summary="Postures along a path",
    response_model=PosturesAnswer,
    responses=POST_REFUSALS,
)
async def postures_along_path(request: Request, robot: Robot, body: PathRequest) -> Response:
    """At each waypoint and in each posture of the arm what is in the way, and how far it gets without a jump.

    It tells why a path flips or stops, and from which posture at its start it would not.
    """
    return await computed(request, partial(_postures, robot, body, settings_of(request)))


def _solve(robot: Robot, body: PathRequest, settings: Settings, deadline: Deadline) -> Response:
    poses, options, q_start, roundings = _read(robot, body, settings)
    return reply(path_answer(solve(robot, poses, options, q_start, body.max_step, deadline.check, roundings)))


def _postures(robot: Robot, body: PathRequest, settings: Settings, deadline: Deadline) -> Response:
    poses, options, q_start, roundings = _read(robot, body, settings)
    found = path_postures(
        robot,
        poses,
        options=options,
        q_start=q_start,
        max_step=body.max_step,
        cancel=deadline.check,
        roundings=roundings,
    )
    return reply(postures_answer(found))


def _read(
    robot: Robot, body: PathRequest, settings: Settings
) -> tuple[list[Array], IKOptions, Array | None, list[float]]:
    """The poses of a request, its options, where the arm is, and how rounded the poses are."""
    schemas.check_batch("targets", len(body.targets), settings, settings.max_path)
    q_start = None
    if body.q_start is not None:
        q_start = schemas.as_configurations(robot, body.q_start, settings, "q_start")[0][0]
    targets = [body.resolve(robot, each, f"targets[{i}]", q_start) for i, each in enumerate(body.targets)]
    task = targets[0].task
    for i, goal in enumerate(targets):
        if goal.task != task:
            expected = f"a target for task {task}, as the first one, or `task` for all of them"
            value = f"a target for task {goal.task}"
            raise invalid(FieldError(field=f"targets[{i}]", value=value, expected=expected))
    poses, roundings = [goal.T for goal in targets], [goal.rounding for goal in targets]
    return poses, body.options(task), q_start, roundings
