"""Arms as tables and files: what one is, the other convention, URDF in, files out."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

from fastapi import Body, Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.description import invalid_file
from app.api.arms.operation import operation
from app.api.body import versioned
from app.api.schemas import POST_REFUSALS, example, refusals, reply
from app.api.work import Deadline, computed
from app.exports.robots import FORMATS, file_name, robot_file
from app.shared.answers.examination import ExaminationAnswer, examination_answer
from app.shared.answers.exchange import ConvertAnswer, ImportAnswer, convert_answer, import_answer
from app.shared.answers.inspection import InspectionAnswer, inspect
from kin import Robot, RobotFileError
from kin.doctor import examine_urdf
from kin.files import read_urdf
from kin.files.urdf.xml import MAX_BYTES

router = versioned("robots")

_REFUSALS = refusals(404, 422, 500, 503)
_IMPORT_REFUSALS = {status: text for status, text in POST_REFUSALS.items() if status != 404}
_URDF = """<robot name="two links"><link name="base"/><link name="upper"/><link name="hand"/>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="hand"/><origin xyz="0.3 0 0"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="40"/></joint></robot>"""
IMPORT_EXAMPLES = {"one": example("Two links", {"urdf": _URDF, "tip": "hand"})}


@operation(
    router,
    "inspect",
    method="GET",
    sent="robots/inspect",
    summary="What an arm is",
    response_model=InspectionAnswer,
    responses=_REFUSALS,
)
async def inspect_robot(request: Request, robot: Robot) -> Response:
    """How the joint axes lie, which solver the arm gets and why, its motions, and likely mistakes in its table."""
    return await computed(request, partial(_inspected, robot))


def _inspected(robot: Robot, _: Deadline) -> Response:
    return reply(inspect(robot))


class ConvertQuery(schemas.Body):
    """The requested convention."""

    convention: Literal["standard", "modified", "other"] = Field(
        "other", description="The convention of the new table; other: the one that the arm does not have."
    )


@operation(
    router,
    "convert",
    method="GET",
    sent="robots/convert",
    summary="The other DH convention",
    response_model=ConvertAnswer,
    responses=_REFUSALS,
)
async def convert_robot(request: Request, robot: Robot, query: ConvertQuery) -> Response:
    """The same arm as a table in the other convention, with the base and tool transforms that this requires.

    Joints, limits and poses are the same; `difference` is the proof.
    """
    wanted = query.convention
    if wanted == "other":
        wanted = "modified" if robot.convention == "standard" else "standard"
    return await computed(request, partial(_converted, robot, wanted))


def _converted(robot: Robot, convention: Literal["standard", "modified"], _: Deadline) -> Response:
    return reply(convert_answer(robot, convention))


class ImportRequest(schemas.Body):
    """A URDF and the part of it that is the arm."""

    urdf: str = Field(
        description="The text of a URDF, or of an MJCF file. Expand xacro first: `xacro FILE.xacro > FILE.urdf`.",
        min_length=1,
        max_length=MAX_BYTES,
    )
    base: str | None = Field(
        None, description="The link the arm stands on; by default the root.", max_length=200, min_length=1
    )
    tip: str | None = Field(
        None,
        description="The link that is the tool. It may be left out if only one is possible.",
        max_length=200,
        min_length=1,
    )


class DoctorRequest(ImportRequest):
    """A URDF, the part of it that is the arm, and what is mended in it."""

    mends: Annotated[list[Annotated[int, Field(ge=0)]], Field(max_length=500)] | None = Field(
        None,
        description="Indices, from 0, of the `findings` that `mended` has done, each of them `automatic`; "
        "by default all of these. What a mend of an element uncovers there is mended too.",
    )


@router.post("/robots/import", summary="Read a URDF", response_model=ImportAnswer, responses=_IMPORT_REFUSALS)
async def import_robot(
    request: Request, body: Annotated[ImportRequest, Body(openapi_examples=IMPORT_EXAMPLES)]
) -> Response:
    """A serial chain of revolute, continuous, prismatic and fixed joints of a URDF as a DH table, exactly.

    Joint values, directions and limits are those of the URDF. The report proves it: the tool's poses are compared
    with the product of the URDF's own transforms. If several tips are possible, the problem document lists them.
    """
    return await computed(request, partial(_imported, body))


@router.post(
    "/robots/doctor", summary="Examine a URDF", response_model=ExaminationAnswer, responses=_IMPORT_REFUSALS
)
async def examine(
    request: Request, body: Annotated[DoctorRequest, Body(openapi_examples=IMPORT_EXAMPLES)]
) -> Response:
    """What is wrong, suspicious or left out in a URDF, with line numbers, and the text with it mended.

    A file that cannot be read is no error here: that is a finding. Meshes are not sent along, and not looked at.
    """
    return await computed(request, partial(_examined, body))


def _examined(body: DoctorRequest, _: Deadline) -> Response:
    return reply(examination_answer(examine_urdf(body.urdf, body.base, body.tip, mends=body.mends)))


def _imported(body: ImportRequest, _: Deadline) -> Response:
    try:
        if "<" not in body.urdf:  # kin says how to read a file in Python instead
            raise RobotFileError("URDF", "file", body.urdf, "the text of a URDF")
        found = read_urdf(body.urdf, body.base, body.tip)
    except RobotFileError as error:
        raise invalid_file(error, "urdf") from None
    return reply(import_answer(found))


class ExportQuery(schemas.Body):
    """The format of the file."""

    format: Annotated[str, schemas.OneOf(FORMATS)] = Field(
        "toml", description="; ".join(f"{name}: {each.meaning}" for name, each in FORMATS.items()) + "."
    )


@operation(
    router,
    "export",
    method="GET",
    sent="robots/export",
    summary="An arm as a file",
    response_class=Response,
    responses={
        200: {
            "description": "The file.",
            "content": {each.media_type: {"schema": {"type": "string"}} for each in FORMATS.values()},
        },
        **_REFUSALS,
    },
)
async def export_robot(request: Request, robot: Robot, query: ExportQuery) -> Response:
    """The arm as a robot file in its own or another convention, as URDF without bodies, as MJCF, or as source.

    Source of its forward and inverse kinematics needs nothing of Kinboard. Where an arm's solver is more than can
    be written that way, the problem document says why, and what would help.
    """
    kind = FORMATS[query.format]
    text = await computed(request, partial(_exported, robot, query.format))
    name = file_name(robot, query.format)
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(text, media_type=kind.media_type, headers=headers)


def _exported(robot: Robot, kind: str, _: Deadline) -> str:
    return robot_file(robot, kind)
