"""Postures over REST: how many there are where, and whether one turns into another without a singularity."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import Field

from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.options import Target, takes
from app.api.schemas import POST_REFUSALS, Body, Configuration, OneOf, Vector3, example, refusals, reply
from app.api.work import Deadline, computed
from app.api.workspace.query import RegionQuery
from app.exports.postures import FORMATS
from app.shared.answers.postures import CuspidalAnswer, PostureMapAnswer
from kin import JointConstraints, Robot, cuspidal, posture_map
from kin.postures.verdicts import MOST_SEED, POSES

router = versioned("kinematics")

MOST_POSES = 2000  # of a request


class CuspidalQuery(RegionQuery):
    """Limits and locks, and the extent of the search."""

    poses: int = Field(
        POSES,
        ge=1,
        le=MOST_POSES,
        description="How many random poses to solve at most, inside the limits, and as many again without limits.",
    )
    seed: int = Field(0, ge=0, le=MOST_SEED, description="Of the search: equal seeds find equal loops.")


@operation(
    router,
    "cuspidal",
    method="GET",
    name="cuspidal",
    summary="Whether the arm is cuspidal",
    response_model=CuspidalAnswer,
    responses=refusals(404, 422, 500, 503),
)
async def is_cuspidal(request: Request, robot: Robot, query: CuspidalQuery) -> Response:
    """Whether the arm can change its posture without meeting a singularity, and how that is known.

    A yes comes with a loop of the tool, verified between its samples. A no is proved. The arm must have as many
    joints that move as its task has dimensions: six for a pose, five for a point and an approach direction, three
    for a point; `lock` the others.
    """
    constraints = query.constraints(robot)
    return await computed(request, partial(_cuspidal, robot, constraints, query.poses, query.seed))


def _cuspidal(robot: Robot, constraints: JointConstraints, poses: int, seed: int, deadline: Deadline) -> Response:
    found = cuspidal(robot, constraints=constraints, poses=poses, seed=seed, cancel=deadline.check)
    return reply(CuspidalAnswer.of(found))


MAP_EXAMPLES = {
    "section": example("A section through the home configuration", {"resolution": 12}),
    "joints": example("A plane of joints 2 and 3", {"joints": [1, 2], "resolution": 12}),
    "picture": example("As a picture", {"resolution": 40, "format": "svg"}),
}
MOST_NODES = 200  # along a side, of a request
_FILES: dict[str, Any] = {
    each.media_type.partition(";")[0]: {"schema": {"type": "string"}} for each in FORMATS.values()
}


@takes(["limits", "locked", "wider_limits", "respect_limits"])
class PostureMapRequest(Body):
    """What to map, and how finely."""

    target: Target | None = Field(
        None,
        description="A pose of the tool in the world frame: the section contains its point, and the tool keeps "
        "its orientation. By default that of the home configuration.",
    )
    normal: Vector3 | None = Field(
        None,
        description="Normal of the section; by default it contains the z axis of the base.",
        examples=[[0, 1, 0]],
    )
    joints: Annotated[list[int], Field(min_length=2, max_length=2)] | None = Field(
        None,
        description="Indices of two joints: the map is of the plane of their values, in the place of a section.",
    )
    q: Configuration | None = Field(
        None,
        description="Where the other joints are, then, in radians (metres); by default the home configuration.",
    )
    resolution: int = Field(60, ge=8, le=MOST_NODES, strict=True, description="Nodes along a side.")
    format: Annotated[str, OneOf(("json", *FORMATS))] = Field(
        "json", description="json: numbers, borders and regions; svg, png: a picture; csv: a row for each node."
    )

    @property
    def keywords(self) -> dict[str, Any]:
        """The arguments of `kin.posture_map`."""
        names = ("limits", "locked", "wider_limits")
        given = {name: getattr(self, name) for name in names}
        more = {name: getattr(self, name) for name in ("normal", "joints", "q", "respect_limits", "resolution")}
        return {"constraints": JointConstraints(**given), **more}


@operation(
    router,
    "postures",
    name="posture_map",
    examples=MAP_EXAMPLES,
    summary="How many postures there are where",
    response_model=PostureMapAnswer,
    responses={200: {"content": _FILES}, **POST_REFUSALS},
)
async def postures(request: Request, robot: Robot, body: PostureMapRequest) -> Response:
    """The number of exact postures at each node of a section of the task space, or of a plane of two joints, with
    the borders between the regions, and the postures in each region.

    The arm must have as many joints that move as its task has dimensions; lock the others. A map of 200 × 200
    nodes takes half a second with a closed form of its own, and seconds to half a minute for other arms.
    """
    return await computed(request, partial(_map, robot, body))


def _map(robot: Robot, body: PostureMapRequest, deadline: Deadline) -> Response:
    pose = None if body.target is None else body.target.in_world("pose", "target", robot.maker)[1]
    found = posture_map(robot, pose, cancel=deadline.check, **body.keywords)
    if body.format == "json":
        return reply(PostureMapAnswer.of(found))
    kind = FORMATS[body.format]
    name = f'attachment; filename="{robot.id}-postures.{kind.name}"'
    return Response(kind.write(found), media_type=kind.media_type, headers={"content-disposition": name})
