"""Answers of forward kinematics: poses, and the frames along the arm."""

from __future__ import annotations

from app.shared.answers.answer import Answer
from kin import Robot, fk, link_frames
from kin.axes import inverse
from kin.frames import WORLD
from kin.poses import form_named
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
    text: str | None
    """The pose as a text in the requested `form`; null unless one was requested."""
    frames: list[Frame] | None
    """Frame after every DH row, base to tool, fixed rows included; null unless requested with `frames`."""


def poses(T: Array, frame: str) -> list[Pose]:
    """Poses of transforms ``(k, 4, 4)``, which are in this frame."""
    columns = zip(T.tolist(), T[:, :3, 3].tolist(), wxyz_from_rotation(T[:, :3, :3]).tolist(), strict=True)
    return [Pose(matrix, position, wxyz, frame) for matrix, position, wxyz in columns]


def fk_answers(
    robot: Robot,
    q: Array,
    frames: bool = False,
    frame: str = WORLD,
    T_world_frame: Array | None = None,
    form: str | None = None,
) -> list[FkAnswer]:
    """Forward kinematics of configurations ``(k, n)`` in radians (metres).

    Args:
        frames: whether to include the frame of each row.
        frame: name of the frame in which poses are answered.
        T_world_frame: its pose ``(4, 4)``; None: the world frame.
        form: of `kin.pose_to_text`, in which tool poses are written as well; None: they are not.
    """

    def framed(T: Array) -> Array:
        return T if T_world_frame is None else inverse(T_world_frame) @ T

    T = framed(fk(robot, q))
    tools, inside = poses(T, frame), robot.in_limits(q).tolist()
    texts = [None if form is None else form_named(form).text(each) for each in T]
    if not frames:
        return [FkAnswer(*each, None) for each in zip(tools, inside, texts, strict=True)]
    names = [row.name for row in robot.rows]
    flat = iter(poses(framed(link_frames(robot, q).reshape(-1, 4, 4)), frame))
    return [
        FkAnswer(*each, [Frame(name, next(flat)) for name in names])
        for each in zip(tools, inside, texts, strict=True)
    ]
