"""Frames of a request: another base, another tool point, and workpiece frames in which targets may be given."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from app.api import schemas
from app.api.problems import FieldError, from_input_error, invalid, show
from app.api.schemas import Vector3, Vector4, numbers
from kin import InputError, Robot, frame_pose
from kin.files.read import matrix_of
from kin.frames import FRAMES, TOOL
from kin.transforms import Array, as_transform

MOST_WORKPIECES = 32

FrameName = Annotated[str, Field(min_length=1, max_length=40)]


class ConstantFrame(schemas.Body):
    """A constant transform: `xyz` and `rpy`, or `matrix`."""

    xyz: Vector3 | None = Field(None, description="Translation in metres.", examples=[[0.0, 0.0, 0.1]])
    rpy: Vector3 | None = Field(
        None, description="Roll, pitch, yaw in radians: Rz(yaw) Ry(pitch) Rx(roll).", examples=[[0.0, 0.0, 0.0]]
    )
    matrix: Annotated[list[Vector4], numbers(4)] | None = Field(
        None, description="4×4 homogeneous transform, row by row, instead; positions in metres."
    )

    def resolve(self, field: str) -> Array:
        """The transform ``(4, 4)``; raises 422 naming `field`."""
        try:
            if self.matrix is None:
                zero = [0.0, 0.0, 0.0]
                return np.array(matrix_of(self.xyz or zero, self.rpy or zero))
            if self.xyz is not None or self.rpy is not None:
                raise InputError(f"{field}.matrix", "a matrix besides xyz or rpy", "one of the two")
            return as_transform(self.matrix, f"{field}.matrix")
        except InputError as error:
            raise invalid(from_input_error(error)) from None


class FramesBody(schemas.Body):
    """Frames that the poses of a request and its answer refer to."""

    base: ConstantFrame | None = Field(
        None,
        description="Pose of the arm in a world frame of your own: all poses are in that frame. By default the "
        "world frame is the one in which the arm's own `base` is stated, or its base frame if it has none. A "
        "`base` of its own stays: this one is put in front of it.",
    )
    tool: ConstantFrame | None = Field(
        None,
        description="Pose of your tool (TCP) in the tool frame of the arm: all poses are those of your tool.",
    )

    workpieces: Annotated[dict[FrameName, ConstantFrame], Field(max_length=MOST_WORKPIECES)] = Field(
        {},
        description="Frames of your own by name, such as a table or a fixture, each with its pose in the world "
        "frame. A `frame` may name one of them.",
        examples=[{"table": {"xyz": [0.3, 0.1, 0.0], "rpy": [0.0, 0.0, 1.5708]}}],
    )

    @field_validator("workpieces")
    @classmethod
    def no_fixed_names(cls, value: dict[str, ConstantFrame]) -> dict[str, ConstantFrame]:
        """Rejects empty names and those of the other frames."""
        for name in value:
            if name in FRAMES or not name.strip():
                raise ValueError("names that are not empty, and not " + ", ".join(FRAMES))
        return value

    def pose_of(self, robot: Robot, frame: str, field: str, q: Array | None = None) -> Array:
        """T_world_frame ``(4, 4)`` of a frame of this request; raises 422 naming `field`.

        Args:
            robot: the arm, with the base and tool of this request.
            q: the present configuration, for the frame of the tool.
        """
        known = {}
        if frame in self.workpieces:
            known = {frame: self.workpieces[frame].resolve(f"workpieces.{frame}")}
        elif frame not in FRAMES:
            expected = "one of " + ", ".join([*FRAMES, *self.workpieces])
            raise invalid(FieldError(field=field, value=show(frame), expected=expected))
        if frame == TOOL and q is None:
            expected = "`q_seed` (`q_start` of a path) as well, which says where the tool is"
            raise invalid(FieldError(field=field, value=show(frame), expected=expected))
        return frame_pose(robot, frame, known, q)

    def framed(self, robot: Robot) -> Robot:
        """The arm with this base and tool; raises 422."""
        if self.base is not None:
            robot = robot.with_base(self.base.resolve("base") @ robot.T_world_base)
        if self.tool is not None:
            robot = robot.with_tool(robot.T_last_tool @ self.tool.resolve("tool"))
        return robot
