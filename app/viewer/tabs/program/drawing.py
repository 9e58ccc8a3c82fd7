"""The drawings of a program: the path of the tool, coloured by its speed, and its waypoints."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.scene.meshes import body
from app.viewer.skeleton import cylinder, places, skeleton
from app.viewer.tabs.program.plan import Fault, Plan
from app.viewer.tabs.workspace.colours import table
from kin import fk
from kin.motion import Circ, Motion
from kin.transforms import Array, wxyz_from_rotation

MAP = "viridis"
LEVELS = 8  # colours of the path
FINEST, MOST = 0.01, 1200  # s between two samples of the path; samples at most
FAULT, VIA, OTHER, GHOST = (213, 94, 0), (204, 121, 167), (213, 94, 0), (120, 144, 168)
GHOSTS = 12  # at most; waypoints between are left out evenly
FRAMES = 14  # frames along the path
LABEL = 1.2  # of the arm's size: labels that are closer share one
_NUMBERS = count(1)


@dataclass(frozen=True)
class Shown:
    """What is drawn beside waypoints and faults: the path, copies of the arm, frames along the path."""

    path: bool = True
    ghosts: bool = False
    frames: bool = False


class Drawing:
    """The drawings of one program; the visitor's worker calls it.

    Args:
        plan: of the program.
        fault: what cannot be driven; None: nothing.

    Attributes:
        points: ``(k, 3)`` of the tool's way and its waypoints.
        top_speed: of the tool on the path that is drawn.
    """

    def __init__(self, scene: viser.SceneApi, plan: Plan, fault: Fault | None) -> None:
        robot = plan.motion.robot
        self._scene, self._robot = scene, robot
        self._root = f"/program-{next(_NUMBERS)}"
        self._size = body(robot).size
        self._top = scene.add_frame(self._root, show_axes=False)
        self.top_speed = 0.0
        self._q = np.array([q for row in plan.q for q in row])
        poses = fk(robot, self._q)
        self.points = poses[:, :3, 3]
        self._axes("waypoints", poses, 2.2, 0.11)
        labels = list(zip(self.points, _names(plan), strict=True))
        if fault is not None and fault.place is not None:
            labels.append((np.array(fault.place), "✕ cannot go on"))
        for i, (place, words) in enumerate(shared(labels, LABEL * self._size)):
            add_label(scene, f"{self._root}/name-{i}", words, position=place, scale=0.9)
        for i, row in enumerate(plan.segments):
            if isinstance(row, Circ):
                self._dot(f"via-{i}", 0.3, VIA, 1.0, np.array(row.via))
        if fault is not None and fault.index < len(plan.q) and plan.q[fault.index]:
            self._show_fault(fault, fk(robot, plan.q[fault.index][-1])[:3, 3])

    def _show_fault(self, fault: Fault, end: Array) -> None:
        self._dot("fault", 0.5, FAULT, 0.55, end)
        if len(fault.way) > 1:
            points = np.array(fault.way, dtype=np.float32)
            chords = np.stack([points[:-1], points[1:]], axis=1)
            self._scene.add_line_segments(f"{self._root}/fault-way", chords, FAULT, thickness=0.22 * self._size)
        if fault.place is not None:
            self._dot("fault-place", 0.36, FAULT, 1.0, np.array(fault.place))

    def _dot(self, name: str, radius: float, colour: tuple[int, int, int], opacity: float, at: Array) -> None:
        self._scene.add_icosphere(
            f"{self._root}/{name}",
            radius * self._size,
            colour,
            opacity=opacity,
            position=at,
            cast_shadow=False,
            receive_shadow=False,
        )

    def _axes(self, name: str, poses: Array, length: float, radius: float) -> None:
        self._scene.add_batched_axes(
            f"{self._root}/{name}",
            wxyz_from_rotation(poses[:, :3, :3]),
            poses[:, :3, 3],
            axes_length=length * self._size,
            axes_radius=radius * self._size,
        )

    def show_path(self, motion: Motion) -> None:
        """Draw the path of the tool. One node for each colour: the browser shows colours of points brighter."""
        points, speed = _path(motion)
        self.points = np.vstack([self.points, points])
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

    def show_other(self, motion: Motion) -> None:
        """Draw the path of a motion that is compared with the program, as dashes."""
        points, _ = _path(motion)
        chords = np.stack([points[:-1:2], points[1::2]], axis=1) if len(points) % 2 == 0 else None
        if chords is None:
            chords = np.stack([points[:-2:2], points[1:-1:2]], axis=1)
        self._scene.add_line_segments(
            f"{self._root}/other", chords.astype(np.float32), OTHER, thickness=0.18 * self._size
        )

    def show_frames(self, motion: Motion) -> None:
        """Draw small frames along the path, at equal distances."""
        T = motion.sample(np.linspace(0.0, motion.duration, path_samples(motion.duration))).T
        steps = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1) + 1e-9
        way = np.concatenate([[0.0], np.cumsum(steps)])
        rows = np.searchsorted(way, np.linspace(0.0, way[-1], FRAMES + 2)[1:-1])
        self._axes("frames", T[rows], 1.1, 0.05)

    def show_ghosts(self) -> None:
        """Draw translucent copies of the arm at the waypoints."""
        bones, (vertices, faces) = skeleton(self._robot), cylinder()
        rows = np.unique(np.linspace(0, len(self._q) - 1, min(len(self._q), GHOSTS)).astype(int))
        positions, wxyz, _ = places(self._robot, self._q[rows])
        self._scene.add_batched_meshes_simple(
            f"{self._root}/ghosts",
            vertices,
            faces,
            batched_wxyzs=wxyz.reshape(-1, 4).astype(np.float32),
            batched_positions=positions.reshape(-1, 3).astype(np.float32),
            batched_scales=np.tile(bones.scales, (len(rows), 1)),
            batched_colors=GHOST,
            opacity=0.3,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._top.remove()


def _names(plan: Plan) -> list[str]:
    """The label of each target: the number of its row and, at its end, its name; other points have two numbers."""
    found = []
    for i, (row, q) in enumerate(zip(plan.segments, plan.q, strict=True)):
        found += [f"{i + 1}.{k + 1}" for k in range(len(q) - 1)]
        found += [f"{i + 1} {row.name}".strip()] if q else []
    return found


def _path(motion: Motion) -> tuple[Array, Array]:
    """Points ``(k, 3)`` of the tool's path, and its speed there."""
    sample = motion.sample(np.linspace(0.0, motion.duration, path_samples(motion.duration)))
    return sample.T[:, :3, 3], sample.tool_speed


def shared(labels: list[tuple[Array, str]], near: float) -> list[tuple[Array, str]]:
    """Labels of places ``(3,)``; those within `near` (m) of one another are one, which would overprint else."""
    found: list[tuple[Array, list[str]]] = []
    for place, name in labels:
        other = next((words for at, words in found if np.linalg.norm(at - place) < near), None)
        if other is None:
            found.append((place, [name]))
        else:
            other.append(name)
    return [(place, " · ".join(words)) for place, words in found]


def path_samples(duration: float) -> int:
    """How many samples show a motion."""
    return int(min(max(2.0, duration / FINEST), MOST))
