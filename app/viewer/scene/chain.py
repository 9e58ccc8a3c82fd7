"""A robot's DH rows regrouped for the scene: one node per moving row, each the parent of the next.

With nodes nested like the arm itself, moving a revolute joint means assigning one quaternion, in either
convention:

    T_base_tool = G_1 M(q_1) G_2 M(q_2) … G_n M(q_n) E

M(q) turns about z (or slides along z); the constants G_k collect everything between two motions. In a standard
row the motion comes first, ``M · Rz(θ) Tz(d) Tx(a) Rx(α)``; in a modified one it stands in the middle,
``Rx(α) Tx(a) · M · Rz(θ) Tz(d)``. Rz and Tz about the same axis commute, so M may be pulled to the front of both.

The q of this formula are the values of all moving rows (`Robot.expand`): of the joints, and of what follows them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from kin import Robot
from kin.robot import Joint, exact_cos_sin
from kin.transforms import Array, wxyz_from_rotation


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid piece: what moves with one row, up to the next one.

    Attributes:
        index: index of the moving row that carries it, −1 for the base.
        leader: index of the joint whose value moves it: its own, or the one that it follows; −1 for the base.
        joint: that moving row, None for the base.
        T_parent_axis: G_k ``(4, 4)``; z is the joint's axis, in coordinates of the previous link.
        path: centre line ``(k, 3)`` from the axis to the next joint (or the tool), in the link's coordinates.
        frames: (row number, T_link_frame) of each DH row's frame that moves with this link.
    """

    index: int
    leader: int
    joint: Joint | None
    T_parent_axis: Array
    path: Array
    frames: tuple[tuple[int, Array], ...]

    def pose(self, value: float) -> tuple[Array, Array]:
        """Position ``(3,)`` and wxyz ``(4,)`` in the parent link, for a joint value in radians or metres."""
        G = self.T_parent_axis
        if self.joint is not None and self.joint.kind == "prismatic":
            return G[:3, 3] + G[:3, 2] * value, self.wxyz
        return G[:3, 3], np.array(turn(self.wxyz, value))

    @cached_property
    def wxyz(self) -> Array:
        """Rotation part of `T_parent_axis` ``(4,)``."""
        return wxyz_from_rotation(self.T_parent_axis[:3, :3])


@dataclass(frozen=True, eq=False)
class Chain:
    """All links, base first, and the tool's pose on the last one."""

    links: tuple[Link, ...]
    T_last_tool: Array


@lru_cache(maxsize=64)
def chain(robot: Robot) -> Chain:
    """The robot's rows regrouped into links."""
    links: list[Link] = []
    leaders = [-1, *robot.expansion.astype(bool).argmax(axis=1).tolist()]
    joint: Joint | None = None
    start, T = np.eye(4), robot.T_world_base.copy()
    path: list[Array] = [T[:3, 3].copy()]
    frames: list[tuple[int, Array]] = []

    def close() -> None:
        number = len(links)
        links.append(Link(number - 1, leaders[number], joint, start, np.array(path), tuple(frames)))

    for number, row in enumerate(robot.rows):
        for step in _steps(row, robot.convention == "modified"):
            if step is None:
                close()
                joint, start, T = row, T, np.eye(4)
                path, frames = [np.zeros(3)], []
                continue
            T = T @ step
            if np.linalg.norm(T[:3, 3] - path[-1]) > 1e-6:
                path.append(T[:3, 3].copy())
        frames.append((number, T))
    T = T @ robot.T_last_tool
    if np.linalg.norm(T[:3, 3] - path[-1]) > 1e-6:
        path.append(T[:3, 3].copy())
    close()
    return Chain(tuple(links), T)


def link_poses(robot: Robot, q: Array) -> Array:
    """Poses ``(k, m + 1, 4, 4)`` of all links, base first, for configurations ``(k, n)``."""
    links, q = chain(robot).links, robot.expand(q)
    found = np.empty((len(q), len(links), 4, 4))
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    found[:, 0] = T
    for i, link in enumerate(links[1:]):
        motion = np.zeros((len(q), 4, 4))
        motion[:, range(4), range(4)] = 1.0
        if link.joint is not None and link.joint.kind == "prismatic":
            motion[:, 2, 3] = q[:, i]
        else:
            c, s = np.cos(q[:, i]), np.sin(q[:, i])
            motion[:, 0, 0], motion[:, 0, 1], motion[:, 1, 0], motion[:, 1, 1] = c, -s, s, c
        T = T @ link.T_parent_axis @ motion
        found[:, i + 1] = T
    return found


def center_line(robot: Robot, q: Array) -> Array:
    """Corners ``(k, 3)`` of the centre line of all links, base to tool, at a configuration ``(n,)``."""
    poses = link_poses(robot, q[None])[0]
    links = chain(robot).links
    return np.vstack([link.path @ T[:3, :3].T + T[:3, 3] for link, T in zip(links, poses, strict=True)])


def _steps(row: Joint, modified: bool) -> list[Array | None]:
    """The row's elementary motions in order; None stands for the joint's own motion."""
    motion: list[Array | None] = [] if row.kind == "fixed" else [None]
    about_z: list[Array | None] = [rotation(2, row.theta), translation(2, row.d)]
    about_x: list[Array | None] = [translation(0, row.a), rotation(0, row.alpha)]
    if modified:
        return [about_x[1], about_x[0], *motion, *about_z]
    return [*motion, *about_z, *about_x]


def rotation(axis: int, angle: float) -> Array:
    """A turn ``(4, 4)`` about x, y or z (0, 1, 2), exact at quarter turns."""
    c, s = exact_cos_sin(angle)
    T = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[i, i] = T[j, j] = c
    T[i, j], T[j, i] = -s, s
    return T


def translation(axis: int, length: float) -> Array:
    """A slide ``(4, 4)`` along x, y or z (0, 1, 2)."""
    T = np.eye(4)
    T[axis, 3] = length
    return T


def turn(wxyz: Array, angle: float) -> tuple[float, float, float, float]:
    """`wxyz` followed by a turn of `angle` about its own z axis."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    w, x, y, z = wxyz.tolist()
    return w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s
