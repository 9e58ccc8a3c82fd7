"""Forward kinematics: joint values in, pose of the tool out."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.frames import FrameName, WorkpiecesBody
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.schemas import (
    POST_REFUSALS,
    Configurations,
    OneOf,
    Pendant,
    example,
    joint_values,
    settings_of,
)
from app.api.work import Deadline, compute_slots, computed
from app.shared.answers.answer import Answer
from app.shared.answers.fk import FkAnswer, fk_answers
from kin import Robot
from kin.frames import WORLD
from kin.poses import FORMS as POSES
from kin.transforms import Array

POSE, FRAME, TEXT = 570, 520, 120  # bytes of a pose, of a frame and of a text, about
FEW = 16  # configurations that are answered sooner than a thread could be asked to

router = versioned("kinematics")

EXAMPLES = {
    "one": example("One configuration", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236]}),
    "frames": example(
        "With the frame of every link", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236], "frames": True}
    ),
    "table": example(
        "In the frame of a table",
        {
            "q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236],
            "workpieces": {"table": {"xyz": [0.1, 0.2, -0.3], "rpy": [0.0, 0.0, 1.5708]}},
            "frame": "table",
        },
    ),
    "form": example("As it stands on a pendant", {"q": [1.5708, 0.5236, 1.0472, 0.5236, 0.5236], "form": "fanuc"}),
    "many": example(
        "Several configurations",
        {"q": [[0.0, 0.0, 0.0, 0.0, 0.5], [1.2, 0.4, 0.9, 0.3, 0.6], [3.0, 1, 1, 1, 0.3]]},
    ),
}


class FkRequest(WorkpiecesBody):
    """Which configurations to put the arm in."""

    q: Configurations = Field(
        description="Joint values from base to tool, in radians (metres for sliding joints): "
        "one configuration of n numbers, or a list of configurations."
    )
    pendant: Pendant = False
    frames: bool = Field(
        False,
        strict=True,
        description="Whether to return the frame after every DH row as well, not only the tool's.",
    )
    frame: FrameName = Field(
        WORLD,
        description="The frame in which poses are answered: world, base (that of the first DH row), or the name "
        "of one of `workpieces`.",
    )

    form: Annotated[str, OneOf(POSES)] | None = Field(
        None,
        description="The form in which the tool's pose is answered as `text` as well: a notation in metres and "
        "radians, or a maker's in the units of its pendants.",
    )

    def axes(self, robot: Robot) -> Array | None:
        """T_world_frame ``(4, 4)`` of the requested frame; None: the world frame. Raises 422."""
        return None if self.frame == WORLD else self.pose_of(robot, self.frame, "frame")


class FkAnswers(Answer):
    """Answers to a list of configurations."""

    results: list[FkAnswer]
    """One per configuration, in the same order."""


@operation(
    router,
    "fk",
    name="fk",
    examples=EXAMPLES,
    summary="Forward kinematics",
    response_model=FkAnswer | FkAnswers,
    responses=POST_REFUSALS,
)
async def forward_kinematics(request: Request, robot: Robot, body: FkRequest) -> Response:
    """Pose of the tool for joint values, as a 4×4 matrix and as position with quaternion.

    One configuration gets one answer; a list gets `{"results": [...]}` in the same order. Joint values outside the
    limits are answered too, with `in_limits` false.
    """
    q, single = schemas.as_configurations(robot, body.q, settings_of(request))
    q = joint_values(robot, q, body.pendant)
    axes = body.axes(robot)
    size = POSE + FRAME * len(robot.rows) * body.frames + TEXT * (body.form is not None)
    batch = Batch("q", len(q), single, size, "frames false")
    answer = partial(_answers, robot, q, (body.frames, body.frame, axes, body.form), batch)
    if len(q) <= FEW:
        return answer(Deadline(compute_slots(request)))
    return await computed(request, answer)


def _answers(
    robot: Robot, q: Array, options: tuple[bool, str, Array | None, str | None], batch: Batch, deadline: Deadline
) -> Response:
    return one_or_all(lambda some: fk_answers(robot, q[some], *options), batch, deadline)
