"""The drawings of a program: the path of the tool, coloured by its speed, and a frame at each waypoint."""

from __future__ import annotations

from itertools import count

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.scene.meshes import body
from app.viewer.tabs.workspace.colours import table
from kin import Robot, fk
from kin.motion import Motion
from kin.transforms import Array, wxyz_from_rotation

MAP = "viridis"
LEVELS = 8  # colours of the path
FINEST, MOST = 0.01, 1200  # s between two samples of the path; samples at most
FAULT = (213, 94, 0)
_NUMBERS = count(1)


class Drawing:
    """The drawings of one program; the visitor's worker calls it.

    Args:
        q: configurations ``(k, n)`` of the waypoints, and the text at each.
        fault: index of the waypoint that cannot be reached; None: there is none.
    """

    def __init__(self, scene: viser.SceneApi, robot: Robot, q: Array, names: list[str], fault: int | None) -> None:
        self._scene = scene
        self._root = f"/program-{next(_NUMBERS)}"
        self._size = size = body(robot).size
        self._top = scene.add_frame(self._root, show_axes=False)
        self.top_speed = 0.0
        poses = fk(robot, q)
        scene.add_batched_axes(
            f"{self._root}/waypoints",
            wxyz_from_rotation(poses[:, :3, :3]),
            poses[:, :3, 3],
            axes_length=2.2 * size,
            axes_radius=0.11 * size,
        )
        at: dict[tuple[float, ...], list[str]] = {}  # names of waypoints at the same place share a label
        for pose, name in zip(poses, names, strict=True):
            at.setdefault(tuple(np.round(pose[:3, 3], 3).tolist()), []).append(name)
        for i, (place, words) in enumerate(at.items()):
            add_label(scene, f"{self._root}/name-{i}", " · ".join(words), position=np.array(place), scale=0.9)
        if fault is not None:
            scene.add_icosphere(
                f"{self._root}/fault", 0.5 * size, FAULT, opacity=0.55, position=poses[fault, :3, 3],
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip

    def show_path(self, motion: Motion) -> None:
        """Draw the path of the tool. One node for each colour: the browser shows colours of points brighter."""
        times = np.linspace(0.0, motion.duration, path_samples(motion.duration))
        sample = motion.sample(times)
        points, speed = sample.T[:, :3, 3], sample.tool_speed
        self.top_speed = float(speed.max())
        if self.top_speed < 1e-6:
            return
        chords = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
        middle = 0.5 * (speed[:-1] + speed[1:]) / self.top_speed
        level = np.minimum((middle * LEVELS).astype(int), LEVELS - 1)
        for k in np.unique(level).tolist():
            r, g, b = table(MAP)[int((k + 0.5) * 255 / LEVELS)].tolist()
            self._scene.add_line_segments(
                f"{self._root}/path-{k}", chords[level == k], (r, g, b), thickness=0.3 * self._size
            )

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._top.remove()


def path_samples(duration: float) -> int:
    """How many samples show a motion."""
    return int(min(max(2.0, duration / FINEST), MOST))
