"""Answers of forward kinematics: poses, and the frames along the arm."""

from __future__ import annotations

from typing_extensions import TypedDict

from app.shared.answers.document import documented
from kin import Robot, fk, link_frames
from kin.transforms import Array, wxyz_from_rotation

Matrix = list[list[float]]


@documented
class Pose(TypedDict):
    """A rigid transform, as a matrix and as a position with a quaternion."""

    matrix: Matrix
    """4×4 homogeneous transform in the base frame, row by row; the last column is the position in metres."""
    position: list[float]
    """x, y, z in metres, in the base frame."""
    wxyz: list[float]
    """Unit quaternion w, x, y, z (scalar first, w never negative)."""


@documented
class Frame(TypedDict):
    """The frame at the end of one DH row."""

    name: str
    """Name of the row of the DH table the frame follows."""
    pose: Pose
    """Its pose in the base frame."""


@documented
class FkAnswer(TypedDict):
    """Forward kinematics of one configuration."""

    pose: Pose
    """Pose of the tool in the base frame."""
    in_limits: bool
    """Whether every joint is inside its limits. The pose is computed in either case."""
    frames: list[Frame] | None
    """Frame after every DH row, base to tool, fixed rows included; null unless requested with `frames`."""


def poses(T: Array) -> list[Pose]:
    """Poses of transforms ``(k, 4, 4)``."""
    columns = zip(T.tolist(), T[:, :3, 3].tolist(), wxyz_from_rotation(T[:, :3, :3]).tolist(), strict=True)
    return [{"matrix": matrix, "position": position, "wxyz": wxyz} for matrix, position, wxyz in columns]


def fk_answers(robot: Robot, q: Array, frames: bool = False) -> list[FkAnswer]:
    """Forward kinematics of configurations ``(k, n)`` in radians (metres)."""
    tools = poses(fk(robot, q))
    inside: list[bool] = robot.in_limits(q).tolist()
    if not frames:
        return [{"pose": pose, "in_limits": ok, "frames": None} for pose, ok in zip(tools, inside, strict=True)]
    names = [row.name for row in robot.rows]
    flat = iter(poses(link_frames(robot, q).reshape(-1, 4, 4)))
    return [
        {"pose": pose, "in_limits": ok, "frames": [{"name": name, "pose": next(flat)} for name in names]}
        for pose, ok in zip(tools, inside, strict=True)
    ]
