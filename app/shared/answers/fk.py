"""Answers of forward kinematics: poses, and the frames along the arm."""

from __future__ import annotations

from app.shared.answers.answer import Answer
from kin import Robot, fk, link_frames
from kin.axes import inverse
from kin.frames import WORLD
from kin.transforms import Array, wxyz_from_rotation

Matrix = list[list[float]]


class Pose(Answer):
    """A rigid transform, as a matrix and as a position with a quaternion."""

    matrix: Matrix
    """4×4 homogeneous transform, row by row; the last column is the position in metres."""
    position: list[float]
    """x, y, z in metres."""
    wxyz: list[float]
    """Unit quaternion w, x, y, z (scalar first, w never negative)."""
    frame: str
    """Name of the frame in which these numbers are: world unless another one was requested. The world frame is the
    base frame, that of the first DH row, unless the arm or the request has a `base`."""


class Frame(Answer):
    """The frame at the end of one DH row."""

    name: str
    """Name of the row of the DH table the frame follows."""
    pose: Pose
    """Its pose."""


class FkAnswer(Answer):
    """Forward kinematics of one configuration."""

    pose: Pose
    """Pose of the tool."""
    in_limits: bool
    """Whether every joint is inside its limits. The pose is computed in either case."""
    frames: list[Frame] | None
    """Frame after every DH row, base to tool, fixed rows included; null unless requested with `frames`."""


def poses(T: Array, frame: str) -> list[Pose]:
    """Poses of transforms ``(k, 4, 4)``, which are in this frame."""
    columns = zip(T.tolist(), T[:, :3, 3].tolist(), wxyz_from_rotation(T[:, :3, :3]).tolist(), strict=True)
    return [Pose(matrix, position, wxyz, frame) for matrix, position, wxyz in columns]


def fk_answers(
    robot: Robot, q: Array, frames: bool = False, frame: str = WORLD, T_world_frame: Array | None = None
) -> list[FkAnswer]:
    """Forward kinematics of configurations ``(k, n)`` in radians (metres).

    Args:
        frames: whether to include the frame of each row.
        frame: name of the frame in which poses are answered.
        T_world_frame: its pose ``(4, 4)``; None: the world frame.
    """

    def framed(T: Array) -> list[Pose]:
        return poses(T if T_world_frame is None else inverse(T_world_frame) @ T, frame)

    tools = framed(fk(robot, q))
    inside: list[bool] = robot.in_limits(q).tolist()
    if not frames:
        return [FkAnswer(pose, ok, None) for pose, ok in zip(tools, inside, strict=True)]
    names = [row.name for row in robot.rows]
    flat = iter(framed(link_frames(robot, q).reshape(-1, 4, 4)))
    return [
        FkAnswer(pose, ok, [Frame(name, next(flat)) for name in names])
        for pose, ok in zip(tools, inside, strict=True)
    ]
