"""The schema of a program in requests: one model per kind of segment, distinguished by `kind`.

`kin.motion.program_from_dict` reads and checks programs, with messages of its own. These models tell clients what
it accepts: generated code then has a type for each segment. A test compares the fields with those of the core.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from app.api.schemas import Number, Vector3, Vector4, numbers
from kin.motion.program import (
    GRIPPER_TIME,
    LONGEST_DWELL,
    LONGEST_NAME,
    MOST_POINTS,
    MOST_SEGMENTS,
    MOST_VALUES,
    Orientation,
)
from kin.typed import LONGEST_LIST

Part = Annotated[float, Field(gt=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
Name = Annotated[str, Field(max_length=LONGEST_NAME)]
Row = Annotated[list[Number], numbers(4)]


class _Described(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SegmentTarget(_Described):
    """Where a segment leads to: `q`; `position` with or without `wxyz`; or `pose`."""

    q: list[Number] | None = Field(
        None, min_length=1, max_length=MOST_VALUES, description="One value per joint, in the units of the program."
    )
    position: Vector3 | None = Field(
        None, description="The tool point x, y, z in `frame`, by default the world frame."
    )
    wxyz: Vector4 | None = Field(
        None, description="Orientation at `position`; by default that at the start of the segment."
    )
    pose: Annotated[list[Row], numbers(4)] | Annotated[str, Field(max_length=LONGEST_LIST)] | None = Field(
        None,
        description="In the place of position and wxyz: a 4×4 matrix, or a text as on a maker's pendant.",
    )
    frame: str | None = Field(
        None, description="The frame in which poses and via points are: world (by default), base, or a workpiece."
    )


class _Move(_Described):
    speed: Part = Field(1.0, description="Part of the joints' velocity limits that the segment may use.")
    acceleration: Part = Field(1.0, description="The same for the limits of acceleration and jerk.")
    tool_speed: Positive | None = Field(None, description="Largest speed of the tool point, per second.")
    tool_turn: Positive | None = Field(None, description="Largest angular velocity of the tool, per second.")
    blend: Annotated[float, Field(ge=0.0)] = Field(
        0.0, description="Radius about the target within which the next segment may begin; 0: the arm stops."
    )
    name: Name = Field("", description="For people.")


class PtpSegment(_Move, SegmentTarget):
    """MoveJ: all joints start and end together, as fast as they may."""

    kind: Literal["ptp"] = Field(description="Point to point.")


class LinSegment(_Move, SegmentTarget):
    """MoveL: a straight line of the tool point."""

    kind: Literal["lin"] = Field(description="A line.")
    orientation: Orientation = Field("geodesic", description="How the tool turns on the way.")


class ViaPoint(_Described):
    """A point of an arc."""

    position: Vector3 = Field(description="The point x, y, z in the `frame` of the segment.")


class CircSegment(_Move, SegmentTarget):
    """MoveC: an arc of the tool point."""

    kind: Literal["circ"] = Field(description="An arc.")
    via: Vector3 | ViaPoint = Field(description="A point of the arc between start and target, in `frame`.")
    orientation: Orientation = Field("geodesic", description="How the tool turns on the way.")


class SplineSegment(_Move):
    """A smooth curve through points: all poses, or all configurations."""

    kind: Literal["spline"] = Field(description="A curve.")
    points: list[SegmentTarget] = Field(
        min_length=1, max_length=MOST_POINTS, description="What the curve passes through, in order."
    )


class DwellSegment(_Described):
    """A pause at the place where the segment before ended."""

    kind: Literal["dwell"] = Field(description="A pause.")
    seconds: float = Field(ge=0.0, le=LONGEST_DWELL, description="How long, in seconds.")
    name: Name = Field("", description="For people.")


class GripperSegment(_Described):
    """The gripper opens or closes, and the arm waits for it where the segment before ended."""

    kind: Literal["gripper"] = Field(description="The gripper.")
    opening: float = Field(
        ge=0.0, le=1.0, description="How far it is open then, a part of its range: 0 is closed, 1 open."
    )
    seconds: float = Field(
        GRIPPER_TIME, ge=0.0, le=LONGEST_DWELL, description="How long it moves and the arm waits, in seconds."
    )
    name: Name = Field("", description="For people.")


Segment = Annotated[
    PtpSegment | LinSegment | CircSegment | SplineSegment | DwellSegment | GripperSegment,
    Field(discriminator="kind"),
]
SEGMENTS: tuple[type[BaseModel], ...] = get_args(get_args(Segment)[0])


class ProgramUnits(_Described):
    """Units of the numbers in a program."""

    length: Literal["m", "cm", "mm"] = Field("m", description="Of positions, slides, blends and tool speeds.")
    angle: Literal["rad", "deg"] = Field("rad", description="Of joint values and angular velocities.")


class ProgramBody(_Described):
    """Segments, one after the other, from where the arm is."""

    segments: list[Segment] = Field(
        min_length=1, max_length=MOST_SEGMENTS, description="In order. Errors count them from 0, sentences from 1."
    )
    units: ProgramUnits = Field(
        default_factory=lambda: ProgramUnits(length="m", angle="rad"), description="By default metres and radians."
    )
    pendant: bool = Field(False, description="Whether joint values are those that the arm's pendant shows.")
    name: Name = Field("", description="For people.")
    task: Literal["pose", "approach", "position"] | None = Field(
        None, description="What the tool keeps of poses; by default as much as the joints of the arm can keep."
    )
    jerk_limited: bool = Field(True, description="Whether paths keep the limits of jerk too.")


class DescribedBy:
    """Annotates a field that is read elsewhere: its schema is that of a model."""

    def __init__(self, model: type[BaseModel]) -> None:
        self._model = model

    def __get_pydantic_json_schema__(self, _: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The model by its name in the document: its own schema would be written out in place."""
        model = self._model
        schema: Any = model.__pydantic_core_schema__
        inner, others = (
            (schema["schema"], schema["definitions"]) if schema["type"] == "definitions" else (schema, [])
        )
        ref = f"{model.__module__}.{model.__qualname__}:{id(model)}"
        return handler(
            core_schema.definitions_schema(
                core_schema.definition_reference_schema(ref), [inner | {"ref": ref}, *others]
            )
        )
