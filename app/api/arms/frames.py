"""Frames of a request: another base, another tool point, and workpiece frames in which targets may be given."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, field_validator

from app.api import schemas
from app.api.problems import invalid
from app.api.schemas import Vector3, Vector4, numbers
from app.shared.problems import FieldError, show
from kin import InputError, Robot, frame_pose
from kin.frames import BASE, FRAMES, TOOL, matrix_of
from kin.ik.options import MOST_METRES
from kin.ik.problem import read_pose
from kin.solvers.contract import POSE
from kin.tolerances import TOLERANCES
from kin.transforms import Array

MOST_WORKPIECES = 32
MOST_ROUNDED = MOST_METRES / 2.0  # of frames: what it lets count as no error is at most what may be requested

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

    def resolve(self, field: str) -> tuple[Array, float]:
        """The transform ``(4, 4)``, and how rounded its matrix is, as `kin.ik.problem.read_pose` says it.

        Raises `InputError` naming `field`.
        """
        if self.matrix is None:
            zero = [0.0, 0.0, 0.0]
            return np.array(matrix_of(self.xyz or zero, self.rpy or zero)), 0.0
        if self.xyz is not None or self.rpy is not None:
            raise InputError(f"{field}.matrix", "a matrix besides xyz or rpy", "one of the two")
        return read_pose(self.matrix, POSE, f"{field}.matrix", always=True)


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
        description="Pose of your tool (TCP) in the tool frame of the arm, on which it is mounted: all poses are "
        "those of your tool. A `tool` of the arm's own stays, and this one goes on it.",
    )

    @cached_property
    def constant_frames(self) -> dict[str, tuple[Array, float]]:
        """`ConstantFrame.resolve` of each frame of this request, by field; read once. Raises 422."""
        given = {"base": self.base, "tool": self.tool}
        return {field: frame.resolve(field) for field, frame in given.items() if frame is not None}

    def framed(self, robot: Robot) -> Robot:
        """The arm with this base and tool; raises 422, whichever frame of this request is invalid."""
        frames = self.constant_frames
        if "base" in frames:
            robot = robot.with_base(frames["base"][0] @ robot.T_world_base)
        if "tool" in frames:
            robot = robot.with_mounted(frames["tool"][0])
        return robot


class WorkpiecesBody(FramesBody):
    """The same with frames in which poses may be stated."""

    present: ClassVar[str] = ""  # the field that says where the tool is; none: its frame cannot be named

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

    @cached_property
    def constant_frames(self) -> dict[str, tuple[Array, float]]:
        """The same with ``workpieces.NAME``."""
        fields = {f"workpieces.{name}": frame for name, frame in self.workpieces.items()}
        return super().constant_frames | {field: frame.resolve(field) for field, frame in fields.items()}

    def pose_of(self, robot: Robot, frame: str, field: str, q: Array | None = None) -> Array:
        """T_world_frame ``(4, 4)`` of a frame of this request; raises 422 naming `field`.

        Args:
            robot: the arm, with the base and tool of this request.
            q: the present configuration, for the frame of the tool.
        """
        if frame in self.workpieces:
            return self.constant_frames[f"workpieces.{frame}"][0]
        fixed = [name for name in FRAMES if name != TOOL or self.present]
        if frame not in fixed:
            expected = "one of " + ", ".join([*fixed, *self.workpieces])
            raise invalid(FieldError(field=field, value=show(frame), expected=expected))
        if frame == TOOL and q is None:
            expected = f"`{self.present}` as well, which says where the tool is"
            raise invalid(FieldError(field=field, value=show(frame), expected=expected))
        return frame_pose(robot, frame, q=q)

    def rounding(self, robot: Robot, frame: str, T: Array) -> float:
        """How much the rounded frames of this request blur a pose ``(4, 4)`` in one of its frames.

        As in `kin.ik.solve`, and where the entries of a target would count. The farther from a frame, the more its
        rotation moves a point.
        """
        blur = 0.0
        for field, (pose, error) in self.constant_frames.items():
            if error > (0.0 if robot.n < 6 else TOLERANCES.rotation_matrix):
                if field == "tool":
                    blur += error * (1.0 + float(np.linalg.norm(pose[:3, 3])))
                elif field == f"workpieces.{frame}" or (field == "base" and frame not in (BASE, TOOL)):
                    blur += error * (1.0 + float(np.linalg.norm(T[:3, 3])))
        return min(blur, MOST_ROUNDED)
