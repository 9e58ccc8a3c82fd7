"""Simplified arms: cylinders along the links and about the axes, for copies of an arm in the scene.

The browser draws all cylinders of a copy, or of several copies, in one call; a new posture is a new list of poses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from app.viewer.declared.scene import Color, Node
from app.viewer.scene.chain import chain, link_poses
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array, frame_from_approach, wxyz_from_rotation

SIDES = 12
_SHORT = 1e-4


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The cylinders of a ghost.

    Attributes:
        links: index of the link that carries each piece ``(m,)``, 0 for the base.
        T_link_piece: ``(m, 4, 4)``; the piece is a cylinder about z from 0 to 1.
        scales: ``(m, 3)``, metres.
    """

    links: Array
    T_link_piece: Array
    scales: Array


@lru_cache(maxsize=64)
def skeleton(robot: Robot) -> Skeleton:
    """The pieces of the robot's ghosts."""
    thick = 0.55 * body(robot).size
    links, poses, scales = [], [], []
    for k, link in enumerate(chain(robot).links):
        if k:
            T = np.eye(4)
            T[2, 3] = -1.3 * thick
            links.append(k)
            poses.append(T)
            scales.append((1.5 * thick, 1.5 * thick, 2.6 * thick))
        if link.joint is not None and link.joint.kind == "prismatic" and link.joint.limits is not None:
            # The rod that slides: it reaches back to the link before in every position.
            stroke = max(link.joint.limits, key=abs)
            T = np.eye(4)
            T[2, 3] = -max(stroke, 0.0)
            links.append(k)
            poses.append(T)
            scales.append((thick, thick, abs(stroke)))
        for low, high in zip(link.path[:-1], link.path[1:], strict=True):
            length = float(np.linalg.norm(high - low))
            if length > _SHORT and k:
                T = np.eye(4)
                T[:3, :3] = frame_from_approach((high - low) / length)
                T[:3, 3] = low
                links.append(k)
                poses.append(T)
                scales.append((thick, thick, length))
    return Skeleton(np.array(links), np.array(poses), np.array(scales))


def places(robot: Robot, q: Array) -> tuple[Array, Array, Array]:
    """Positions ``(k, m, 3)`` and wxyz ``(k, m, 4)`` of the pieces at q ``(k, n)``; label points ``(k, 3)``."""
    bones = skeleton(robot)
    frames = link_poses(robot, q)
    T = frames[:, bones.links] @ bones.T_link_piece
    middle = 0.5 * (T[..., :3, 3] + (T[..., :3, 2] * bones.scales[:, None, 2] + T[..., :3, 3]))
    # The label goes to the piece whose positions differ most, usually an elbow.
    apart = np.linalg.norm(middle - middle.mean(axis=0), axis=2).sum(axis=0)
    return T[..., :3, 3], wxyz_from_rotation(T[..., :3, :3]), middle[:, int(apart.argmax())]


@lru_cache(maxsize=1)
def cylinder() -> tuple[Array, Array]:
    """A closed cylinder about z from 0 to 1, of radius 1: vertices and faces."""
    angles = [2.0 * math.pi * i / SIDES for i in range(SIDES)]
    ring = [(math.cos(a), math.sin(a)) for a in angles]
    vertices = [(x, y, z) for z in (0.0, 1.0) for x, y in ring] + [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    faces = []
    for i in range(SIDES):
        j = (i + 1) % SIDES
        faces += [
            (i, j, SIDES + j),
            (i, SIDES + j, SIDES + i),
            (j, i, 2 * SIDES),
            (SIDES + i, SIDES + j, 2 * SIDES + 1),
        ]
    return np.array(vertices), np.array(faces)


def ghost(key: str, robot: Robot, q: Array, color: Color, opacity: float, **more: Any) -> Node:
    """A translucent copy of the arm at q ``(n,)``: one node, of which a new posture takes a few hundred bytes."""
    positions, wxyz, _ = places(robot, q[None])
    return placed(key, robot, positions[0], wxyz[0], color, opacity, **more)


def placed(
    key: str, robot: Robot, positions: Array, wxyz: Array, color: Color, opacity: float, **more: Any
) -> Node:
    """The same of pieces at `positions` ``(m, 3)`` with `wxyz` ``(m, 4)``, see `places`."""
    vertices, faces = cylinder()
    pieces = {"vertices": vertices, "faces": faces, "batched_scales": skeleton(robot).scales}
    where = {
        "batched_positions": positions.astype(np.float32),
        "batched_wxyzs": wxyz.astype(np.float32),
        "batched_colors": color,
    }
    looks = {"opacity": opacity, "lod": "off", "cast_shadow": False, "receive_shadow": False}
    return Node("batched_meshes_simple", key, {**pieces, **where, **looks}, **more)
