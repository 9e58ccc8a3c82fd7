"""Ghosts: translucent copies of the arm, one node each, posed by sending a few hundred bytes.

A ghost consists of instances of one cylinder: along each link and, short and wide, about each axis. The browser
draws all of them in one call, and a new posture is a new list of their poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.lessons.postures.survey import BLOCKED_COLOR, COLORS, Posture
from app.viewer.scene.chain import chain, link_poses
from app.viewer.scene.meshes import body
from kin import Robot
from kin.transforms import Array, frame_from_approach, wxyz_from_rotation

SIDES = 12
OPACITY, FAINT = 0.42, 0.2
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


class Ghosts:
    """The ghosts of one arm in a visitor's scene, below the node `root`.

    `clicked` receives a ghost's number; viser calls it from another thread.
    """

    def __init__(
        self, scene: viser.SceneApi, robot: Robot, count: int, root: str, clicked: Callable[[int], None]
    ) -> None:
        self._robot = robot
        self._size = body(robot).size
        self._shown: list[tuple[object, ...]] = [()] * count
        vertices, faces = _cylinder()
        bones = skeleton(robot)
        still = np.zeros((len(bones.links), 3)), np.tile([1.0, 0.0, 0.0, 0.0], (len(bones.links), 1))
        self._nodes: list[viser.BatchedMeshHandle] = []
        self._labels: list[viser.LabelHandle] = []
        for i in range(count):
            node = scene.add_batched_meshes_simple(
                f"{root}/ghost/{i + 1}",
                vertices,
                faces,
                batched_wxyzs=still[1],
                batched_positions=still[0],
                batched_scales=bones.scales,
                batched_colors=COLORS[i % len(COLORS)],
                opacity=OPACITY,
                lod="off",
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
            _listen(node, clicked, i)
            self._nodes.append(node)
            self._labels.append(add_label(scene, f"{root}/name/{i + 1}", str(i + 1), visible=False))

    def show(self, postures: tuple[Posture, ...], shown: frozenset[str]) -> None:
        """Draw the ghosts of these branches; unchanged ones are not sent again."""
        visible = [p.q is not None and p.name in shown for p in postures]
        rows = [i for i, w in enumerate(visible) if w]
        named: dict[tuple[float, ...], str] = {}
        if rows:
            q = np.array([postures[i].q for i in rows])
            positions, wxyz, anchors = places(self._robot, q)
            for k, i in enumerate(rows):
                self._pose(i, postures[i], positions[k], wxyz[k])
                at = tuple((np.round(anchors[k] / self._size) * self._size).tolist())
                named[at] = f"{named[at]} · {i + 1}" if at in named else str(i + 1)
        for i, node in enumerate(self._nodes):
            _set_visible(node, i < len(visible) and visible[i])
        names = list(named.items())
        for i, label in enumerate(self._labels):
            if i < len(names):
                at, text = names[i]
                label.position = np.array(at)
                if label.text != text:
                    label.text = text
            _set_visible(label, i < len(names))

    def _pose(self, i: int, posture: Posture, positions: Array, wxyz: Array) -> None:
        assert posture.q is not None
        key = (posture.available, posture.q.tobytes())
        if key == self._shown[i]:
            return
        self._shown[i] = key
        node = self._nodes[i]
        node.batched_positions = positions.astype(np.float32)
        node.batched_wxyzs = wxyz.astype(np.float32)
        opacity = OPACITY if posture.available else FAINT
        if node.opacity != opacity:
            node.opacity = opacity
            color = COLORS[i % len(COLORS)] if posture.available else BLOCKED_COLOR
            node.batched_colors = np.array(color, dtype=np.uint8)


def _listen(node: viser.BatchedMeshHandle, clicked: Callable[[int], None], number: int) -> None:
    @node.on_click
    async def _(event: object) -> None:
        clicked(number)


def _set_visible(node: viser.SceneNodeHandle, visible: bool) -> None:
    if node.visible != visible:
        node.visible = visible


@lru_cache(maxsize=1)
def _cylinder() -> tuple[Array, Array]:
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
