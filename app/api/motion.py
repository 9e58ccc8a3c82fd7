"""Motions over REST: a program of segments in, a timed motion out, or the reason why it cannot be driven."""

from __future__ import annotations

import threading
from collections.abc import Generator
from contextlib import closing
from functools import partial
from typing import Annotated, Any

from fastapi import Request, Response
from pydantic import Field

from app.api import schemas
from app.api.arms.frames import WorkpiecesBody
from app.api.arms.operation import operation
from app.api.batches import Batch, one_or_all
from app.api.body import versioned
from app.api.options import AvoidingBody
from app.api.problems import invalid
from app.api.program import DescribedBy, ProgramBody
from app.api.schemas import POST_REFUSALS, Configuration, example, settings_of
from app.api.work import Deadline, computed
from app.api.workspace.streaming import ComputedResponse
from app.exports.motion import FORMATS
from app.exports.motion_samples import with_joint_names
from app.shared.answers.motion import MotionAnswer, motion_answer
from app.shared.problems import FieldError
from app.shared.settings import Settings
from kin import InputError, Robot, plan_motion
from kin.motion import Motion, program_from_dict

router = versioned("motion")

MOST_RATE = 1000.0  # samples per second
MOST_SAMPLES = 1_000_000
NUMBER = 21  # bytes of a number in JSON, about
_sampling = threading.Lock()  # samples are made by Python: two threads would take as long, and visitors wait twice

EXAMPLES = {
    "ptp": example(
        "There and back, with a pause",
        {
            "program": {
                "units": {"length": "mm", "angle": "deg"},
                "segments": [
                    {"kind": "ptp", "q": [60, 40, 50, 20, 30], "name": "pick"},
                    {"kind": "dwell", "seconds": 0.5},
                    {"kind": "ptp", "q": [90, 30, 60, 30, 30], "speed": 0.5},
                ],
            },
            "rate": 20,
        },
    ),
    "csv": example(
        "As a table",
        {"program": {"segments": [{"kind": "ptp", "q": [1.0, 0.7, 0.9, 0.3, 0.6]}]}, "format": "csv", "rate": 50},
    ),
    "refused": example(
        "Outside the limits: still an answer", {"program": {"segments": [{"kind": "ptp", "q": [9, 0, 0, 0, 0.5]}]}}
    ),
}


JointName = Annotated[str, Field(min_length=1, max_length=100)]
MOST_NAMES = 64


class MotionRequest(AvoidingBody, WorkpiecesBody):
    """What the arm should do, and how the motion is answered."""

    program: Annotated[dict[str, Any], DescribedBy(ProgramBody)] = Field(
        description="The segments of the motion. Poses are those of the tool in the world frame, or in the "
        "`frame` that a segment or a point names: base, or one of `workpieces`."
    )
    q_start: Configuration | None = Field(
        None,
        description="Where the arm is, in radians (metres for sliding joints); by default the home configuration.",
    )
    qd_start: Configuration | None = Field(
        None,
        description="How fast the joints move at the start, in radians (metres for sliding joints) per second; at "
        "rest by default. A PTP without a blend goes on from this motion; before any other segment the arm "
        "brakes, and the segment begins where it then stands. `refusal` has the cause `stop` where a joint cannot "
        "stop before its limit.",
    )
    qdd_start: Configuration | None = Field(
        None, description="The accelerations of the joints at the start, per s²; none by default."
    )
    rate: float = Field(
        100.0, ge=0.1, le=MOST_RATE, strict=True, allow_inf_nan=False, description="Samples per second."
    )
    joint_names: Annotated[list[JointName], Field(min_length=1, max_length=MOST_NAMES)] | None = Field(
        None,
        description="What a file calls the joints, from base to tool, such as the names of a ROS driver; by "
        "default those of the arm.",
        examples=[["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]],
    )
    samples: bool = Field(True, strict=True, description="json: whether to include samples of the motion.")
    format: Annotated[str, schemas.OneOf(FORMATS)] = Field(
        "json", description="; ".join(f"{name}: {each.meaning}" for name, each in FORMATS.items()) + "."
    )


@operation(
    router,
    "motion",
    name="plan_motion",
    examples=EXAMPLES,
    summary="Motion of a program",
    response_model=MotionAnswer,
    responses={
        **POST_REFUSALS,
        200: {
            "description": "The motion, or why the program cannot be driven.",
            "content": {
                each.media_type: {"schema": {"type": "string"}} for each in FORMATS.values() if each.name != "json"
            },
        },
    },
)
async def motion(request: Request, robot: Robot, body: MotionRequest) -> Response:
    """A program of PTP, LIN, CIRC, spline, dwell and gripper segments, timed so that no joint exceeds its limits.

    A program that cannot be driven is answered with 200 and `planned` false, in JSON whatever the format:
    `refusal` holds the segment, the place on its path, the cause as a code with its numbers, and what would help,
    `part` what can be driven up to there. `arrival` says in which posture a segment meets its target: a line to
    joint values `q` may arrive in others, which have the same pose, and a note says by how much.
    A malformed program is refused with 422 and the field. Peaks are measured on the motion, without what the
    planner knows.
    """
    settings = settings_of(request)
    found = await computed(request, partial(_planned, robot, body, settings))
    if isinstance(found, Response):
        return found
    kind = FORMATS[body.format]
    headers = {"content-disposition": f'attachment; filename="{robot.id}-motion{kind.suffix}"'}
    pieces = one_by_one(kind.pieces(found, body.rate))
    return ComputedResponse(pieces, "motion", kind.media_type, headers, request.app.state.streams)


def one_by_one(pieces: Generator[bytes]) -> Generator[bytes]:
    """The same pieces, each computed while no other request's is; closing it ends their computation."""
    with closing(pieces):
        while True:
            with _sampling:
                piece = next(pieces, None)
            if piece is None:
                return
            yield piece


def _planned(robot: Robot, body: MotionRequest, settings: Settings, deadline: Deadline) -> Motion | Response:
    """The response, or the motion whose samples are computed while they are sent."""
    segments = body.program.get("segments")
    if isinstance(segments, list):
        schemas.check_batch("program.segments", len(segments), settings, settings.max_path)
    q_start, qd_start, qdd_start = (
        None if given is None else schemas.as_configurations(robot, given, settings, field)[0][0]
        for field, given in (
            ("q_start", body.q_start),
            ("qd_start", body.qd_start),
            ("qdd_start", body.qdd_start),
        )
    )
    frames = {name: body.constant_frames[f"workpieces.{name}"][0] for name in body.workpieces}
    try:
        program = program_from_dict(body.program, robot, frames)
        found = plan_motion(
            robot,
            program,
            q_start,
            qd_start=qd_start,
            qdd_start=qdd_start,
            cancel=deadline.check,
            **body.keywords,
        )
    except InputError as error:
        known = error.field.partition("[")[0] in ("program", "q_start", "qd_start", "qdd_start")
        raise (error if known else error.within("program")) from None
    if found.driven is not None:
        _check_length(found.driven, body.rate)
    if body.format == "json" or not found.planned:
        return _whole(found, body, deadline)
    if body.joint_names is not None:
        found = with_joint_names(found, body.joint_names, "joint_names")
    kind = FORMATS[body.format]
    if body.format not in ("urscript", "python"):
        kind.check()  # before the answer begins
        return found
    text = b"".join(kind.pieces(found, body.rate))
    headers = {"content-disposition": f'attachment; filename="{robot.id}-motion{kind.suffix}"'}
    return Response(text, media_type=kind.media_type, headers=headers)


def _check_length(found: Motion, rate: float) -> None:
    count = found.duration * rate
    if count > MOST_SAMPLES:
        most = MOST_SAMPLES / found.duration
        expected = f"at most {most:.3g} for a motion of {found.duration:.0f} s: {MOST_SAMPLES} samples"
        raise invalid(FieldError(field="rate", value=f"{rate:g}", expected=expected))


def _whole(found: Motion, body: MotionRequest, deadline: Deadline) -> Response:
    """The answer with its samples, as far as there is memory for it."""
    driven = found if found.driven is None else found.driven
    count = int(driven.duration * body.rate) + 2 if body.samples else 0
    segments = (300 + NUMBER * 2 * found.robot.n) * len(driven.segments)
    size = 4000 + 400 * found.robot.n + segments + count * NUMBER * (3 * found.robot.n + 9)
    batch = Batch("rate", 1, True, size, "a lower rate, format ndjson, or samples false")
    rate = body.rate if body.samples else None
    return one_or_all(lambda _: [motion_answer(found, rate)], batch, deadline)
