"""Optional frames of a request: another base or workpiece frame, and another tool point."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from app.api import schemas
from app.api.problems import from_input_error, invalid
from app.api.schemas import Vector3, Vector4, numbers
from kin import InputError, Robot
from kin.files.read import matrix_of
from kin.transforms import Array, as_transform


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
        description="Pose of the arm's base frame in a frame of your own, such as a workpiece: all poses are in "
        "that frame. By default they are in the base frame. If the arm has a `base` of its own, that is the frame "
        "in which this `base` is stated, not the one of its first row.",
    )
    tool: ConstantFrame | None = Field(
        None,
        description="Pose of your tool (TCP) in the tool frame of the arm: all poses are those of your tool.",
    )

    def framed(self, robot: Robot) -> Robot:
        """The arm with this base and tool; raises 422."""
        if self.base is not None:
            robot = robot.with_base(self.base.resolve("base") @ robot.T_world_base)
        if self.tool is not None:
            robot = robot.with_tool(robot.T_last_tool @ self.tool.resolve("tool"))
        return robot
