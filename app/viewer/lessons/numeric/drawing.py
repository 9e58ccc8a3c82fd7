"""The iterates in the scene: translucent copies of the arm, the way of the tool, start and target."""

from __future__ import annotations

import numpy as np
import viser

from app.viewer.lessons.figures import AMBER, BLUE, GREEN, Figure
from app.viewer.scene.meshes import body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot, fk
from kin.transforms import Array, wxyz_from_rotation

COPIES = 10  # ghosts at most, with the first and the last iterate among them
POINTS = 128  # of the way of the tool
OPACITY = 0.45
# From the start to the last iterate.
FIRST, LAST = np.array([105.0, 115.0, 130.0]), np.array([213.0, 94.0, 0.0])


class Drawing:
    """The iterates of one arm, below the node `root`; the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self._robot = robot
        self._top = scene.add_frame(root, show_axes=False)
        self._figure = Figure(scene, f"{root}/figure", body(robot).size)
        self._marks = (
            self._figure.point("start", BLUE),
            self._figure.point("", AMBER),
            self._figure.point("target", GREEN),
        )
        self._size = size = body(robot).size
        self._aim = scene.add_frame(f"{root}/aim", axes_length=5.0 * size, axes_radius=0.25 * size)
        self._way = scene.add_line_segments(
            f"{root}/way", np.zeros((POINTS, 2, 3), np.float32), (230, 159, 0), thickness=0.3 * size
        )
        vertices, faces = cylinder()
        self._scales = skeleton(robot).scales
        count = COPIES * len(self._scales)
        self._ghosts = scene.add_batched_meshes_simple(
            f"{root}/ghosts",
            vertices,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            batched_positions=np.zeros((count, 3)),
            batched_scales=np.full((count, 3), 1e-6),
            batched_colors=np.zeros((count, 3), np.uint8),
            opacity=OPACITY,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def show(self, T: Array, q: Array) -> None:
        """Draw the target pose ``(4, 4)`` and the iterates ``(k, n)``."""
        start, here, aim = self._marks
        tools = fk(self._robot, q)[:, :3, 3]
        aim.show(T[:3, 3])
        self._aim.position, self._aim.wxyz = T[:3, 3], wxyz_from_rotation(T[:3, :3])
        start.show(tools[0])
        if np.linalg.norm(tools[-1] - T[:3, 3]) > 4.0 * self._size and len(q) > 1:
            here.show(tools[-1], text=str(len(q) - 1))
        else:
            here.hide()
        chords = np.repeat(tools[-1][None, None], 2, axis=1).repeat(POINTS, axis=0)
        recent = tools[-POINTS - 1 :]
        chords[: len(recent) - 1] = np.stack([recent[:-1], recent[1:]], axis=1)
        self._way.points = chords.astype(np.float32)
        self._show_ghosts(q[chosen(len(q))])

    def _show_ghosts(self, q: Array) -> None:
        pieces = len(self._scales)
        positions, wxyz, _ = places(self._robot, q)
        shape = (COPIES, pieces, 3)
        everywhere, turned = np.zeros(shape), np.tile([1.0, 0.0, 0.0, 0.0], (COPIES, pieces, 1))
        scales, colours = np.full(shape, 1e-6), np.zeros(shape)
        k = len(q)
        everywhere[:k], turned[:k], scales[:k] = positions, wxyz, self._scales
        share = np.linspace(0.0, 1.0, k)[:, None, None] if k > 1 else np.ones((1, 1, 1))
        colours[:k] = FIRST + share * (LAST - FIRST)
        self._ghosts.batched_positions = everywhere.reshape(-1, 3).astype(np.float32)
        self._ghosts.batched_wxyzs = turned.reshape(-1, 4).astype(np.float32)
        self._ghosts.batched_scales = scales.reshape(-1, 3).astype(np.float32)
        self._ghosts.batched_colors = colours.reshape(-1, 3).astype(np.uint8)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._figure.remove()
        self._top.remove()


def chosen(count: int) -> list[int]:
    """Which of `count` iterates are drawn: the first ones, where steps are large, and the last."""
    if count <= COPIES:
        return list(range(count))
    return [*range(COPIES - 1), count - 1]
