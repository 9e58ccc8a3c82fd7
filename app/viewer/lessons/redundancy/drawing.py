"""The lesson's drawings: the ring of arm angles, the elbow's circle, and the trade of two coaxial joints.

Nodes are created once for an arm, hidden until there is something to show. Only the ring is rebuilt, when the
target changes.
"""

from __future__ import annotations

from itertools import count

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.lessons.figures import set_visible
from app.viewer.lessons.redundancy.path import elbow_paths, has_path
from app.viewer.lessons.redundancy.ring import FLAT, Circle, arc_segments, elbow_circle, trade_segments
from app.viewer.scene.bodies.parts import JOINT_COLORS
from app.viewer.scene.meshes import body
from app.viewer.self_motion import End
from kin import Redundancy, Robot
from kin.transforms import Array

RING = 1.32  # radius of the ring, relative to the elbow's circle
SMALLEST_CIRCLE = 0.25  # of the arm's size unit; a smaller circle has no room for a ring
TRADE_RADIUS = 4.6  # in the arm's size unit
FEASIBLE, BLOCKED, LIMIT, NOW, ELBOW, LINE = (
    (0, 158, 115), (165, 165, 165), (213, 94, 0), (0, 114, 178), (86, 180, 233), (120, 120, 120),
)  # fmt: skip
_NUMBERS = count(1)


class Drawing:
    """The drawings for one arm, below the node `root`; the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self._scene = scene
        self._robot = robot
        self._root = root
        self._size = size = body(robot).size
        self._top = scene.add_frame(root, show_axes=False)
        none = np.zeros((1, 2, 3), np.float32)
        self._line = scene.add_line_segments(
            f"{root}/line", none, LINE, thickness=1.5, thickness_units="screen", visible=False
        )
        self._circle = scene.add_line_segments(
            f"{root}/elbow", none, ELBOW, thickness=2.0, thickness_units="screen", visible=False
        )
        self._pointer = scene.add_line_segments(f"{root}/now", none, NOW, thickness=0.28 * size, visible=False)
        # One node for each colour: the browser shows colours given per point brighter.
        self._trade = [
            scene.add_line_segments(f"{root}/trade-{i}", none, color, thickness=width * size, visible=False)
            for i, (color, width) in enumerate(((JOINT_COLORS[0], 0.35), (JOINT_COLORS[1], 0.35), (LINE, 0.15)))
        ]
        self._ring: list[viser.SceneNodeHandle] = []

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._top.remove()

    def show_ring(self, goal: Array, T: Array, item: Redundancy | None, ends: tuple[End, ...]) -> None:
        """Draw feasible and blocked arcs and their ends; they change with the target, not during a self-motion.

        T ``(4, 4)``: where the tool is held. An arm whose elbow does not move on a circle gets its path instead.
        """
        for node in self._ring:
            node.remove()
        self._ring = []
        if item is not None and has_path(self._robot, item):
            self._show_path(goal, T, item, ends)
            return
        circle = self._circle_at(goal) if item is not None and item.name == "psi" else None
        if item is None or circle is None:
            return
        scene, number = self._scene, next(_NUMBERS)
        chords, inside = arc_segments(circle, item.intervals, RING)
        for kind, rows, color, width in (
            ("feasible", inside, FEASIBLE, 0.5),
            ("blocked", np.logical_not(inside), BLOCKED, 0.25),
        ):
            if rows.any():
                arcs = chords[rows].astype(np.float32)
                name = f"{self._root}/{kind}-{number}"
                self._ring.append(scene.add_line_segments(name, arcs, color, thickness=width * self._size))
        for i, end in enumerate(ends):
            ray = np.array([[circle.at(end.value, RING - 0.12), circle.at(end.value, RING + 0.18)]], np.float32)
            text = f"limit of joint {end.joint + 1}" if end.joint >= 0 else "posture ends"
            name = f"{self._root}/end-{number}-{i}"
            self._ring.append(scene.add_line_segments(name, ray, LIMIT, thickness=0.4 * self._size))
            self._ring.append(add_label(scene, f"{name}-name", text, position=circle.at(end.value, RING + 0.3)))

    def _show_path(self, goal: Array, T: Array, item: Redundancy, ends: tuple[End, ...]) -> None:
        """Draw the path of the elbow, and what ends it."""
        scene, number = self._scene, next(_NUMBERS)
        for i, (interval, path) in enumerate(elbow_paths(self._robot, T, goal, item)):
            if np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < self._size:
                continue
            chords = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            name = f"{self._root}/path-{number}-{i}"
            self._ring.append(scene.add_line_segments(name, chords, FEASIBLE, thickness=0.5 * self._size))
            for k, point in ((0, path[0]), (1, path[-1])):
                close = [end for end in ends if abs(end.value - interval[k]) < 1e-9]
                if len(close) == 1:
                    text = f"limit of joint {close[0].joint + 1}" if close[0].joint >= 0 else "posture ends"
                    self._ring.append(add_label(scene, f"{name}-{k}", text, position=point))

    def show_present(self, q: Array, item: Redundancy | None, trades: bool) -> None:
        """Draw the configuration ``(n,)``: the line from shoulder to wrist and the elbow, or the trade."""
        circle = self._circle_at(q) if item is not None and item.name == "psi" else None
        for node in (self._line, self._circle, self._pointer):
            set_visible(node, circle is not None)
        if circle is not None and item is not None:
            _set_points(self._line, np.array([[circle.shoulder, circle.wrist]]))
            _set_points(self._circle, arc_segments(circle, (), 1.0)[0])
            _set_points(self._pointer, np.array([[circle.center, circle.at(item.value, RING + 0.1)]]))
        for node in self._trade:
            set_visible(node, trades)
        if trades:
            chords, joints = trade_segments(self._robot, q, TRADE_RADIUS * self._size)
            for i, node in enumerate(self._trade):
                _set_points(node, chords[joints == i])

    def _circle_at(self, q: Array) -> Circle | None:
        circle = elbow_circle(self._robot, q)
        smallest = max(FLAT, SMALLEST_CIRCLE * self._size)
        return circle if circle is not None and circle.radius > smallest else None


def _set_points(node: viser.LineSegmentsHandle, points: Array) -> None:
    found = points.astype(np.float32)
    if found.shape != node.points.shape or not np.array_equal(found, node.points):
        node.points = found
