"""Ghosts: translucent copies of the arm, one node each, posed by sending a few hundred bytes.

A ghost consists of instances of one cylinder: along each link and, short and wide, about each axis. The browser
draws all of them in one call, and a new posture is a new list of their poses.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.lessons.postures.survey import COLORS, Posture, color_of
from app.viewer.scene.meshes import body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot
from kin.transforms import Array

OPACITY, FAINT = 0.42, 0.2


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
        self._colors = [COLORS[i % len(COLORS)] for i in range(count)]
        vertices, faces = cylinder()
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
        color = color_of(i, posture)
        key = (color, posture.available, posture.q.tobytes())
        if key == self._shown[i]:
            return
        self._shown[i] = key
        node = self._nodes[i]
        node.batched_positions = positions.astype(np.float32)
        node.batched_wxyzs = wxyz.astype(np.float32)
        opacity = OPACITY if posture.available else FAINT
        if node.opacity != opacity:
            node.opacity = opacity
        if color != self._colors[i]:
            self._colors[i] = color
            node.batched_colors = np.array(color, dtype=np.uint8)


def _listen(node: viser.BatchedMeshHandle, clicked: Callable[[int], None], number: int) -> None:
    @node.on_click
    async def _(event: object) -> None:
        clicked(number)


def _set_visible(node: viser.SceneNodeHandle, visible: bool) -> None:
    if node.visible != visible:
        node.visible = visible
