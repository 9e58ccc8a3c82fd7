"""The scene of a worked example: its arm in place of the visitor's, at a size that fills the same view.

Everything is computed from the configuration that is shown, in every frame of a motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from app.exercises.variant import Quantity
from app.exercises.worked import Drawn, Mark, configuration
from app.viewer.declared.scene import Color, Node, arrows, axes, bars, label
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import AMBER, BLUE, PURPLE, SKY, clear_of
from app.viewer.lessons.guide.example import Example
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.camera import round_points
from app.viewer.scene.chain import rotation, translation
from app.viewer.scene.meshes import body
from app.viewer.scene.viewpoints import FOV
from app.viewer.skeleton import placed, places, skeleton
from kin import Robot, fk, jacobian, link_frames
from kin.axes import cross
from kin.transforms import Array
from kin.units import Units

LINK, JOINT = (86, 140, 190), (44, 62, 80)
GHOST_OPACITY = 0.35
FILLED = 0.72  # of the radius of the sphere that the picture shows
FRAME, LARGE = 0.2, 0.3  # length of a frame's axes, in radii of the sphere around the arm
AXIS = 0.45  # of a joint axis to both sides, in these radii
SAMPLE = 0.6  # s for which a velocity is drawn as a way
_PATH = 25  # points of the tool's way
_SHORT = 1e-4


def walked(frames: Array, robot: Robot, q: Array, at: float) -> Array:
    """The frame ``(4, 4)`` after so many motions from the base, four for each row of a standard table.

    Args:
        frames: the base and the frame of each row ``(rows + 1, 4, 4)``.
    """
    number = min(int(at) // 4, len(robot.rows) - 1)
    row, T, left = robot.rows[number], frames[number], at - 4 * number
    value = float(q[robot.joint_rows.index(number)])
    turn, slide = (value, 0.0) if row.kind == "revolute" else (0.0, value)
    for motion, axis, whole in (
        (rotation, 2, row.theta + turn),
        (translation, 2, row.d + slide),
        (translation, 0, row.a),
        (rotation, 0, row.alpha),
    ):
        T = T @ motion(axis, whole * min(max(left, 0.0), 1.0))
        left -= 1.0
    return np.asarray(T)


@dataclass(frozen=True, eq=False)
class View:
    """What the picture shows: a sphere, and the direction from there to the camera ``(3,)``."""

    center: Array
    radius: float
    out: Array

    @classmethod
    def of(cls, position: Array, look_at: Array, aspect: float) -> View:
        """As seen by a camera, in a picture of this aspect ratio."""
        way = position - look_at
        distance = max(float(np.linalg.norm(way)), _SHORT)
        return cls(look_at, distance * math.sin(math.atan(math.tan(FOV / 2) * min(1.0, aspect))), way / distance)


def facing(out: Array) -> Array:
    """The frame ``(4, 4)`` that stands upright, with x to the right as seen from a direction ``(3,)``."""
    level = np.array([out[0], out[1], 0.0])
    length = float(np.linalg.norm(level))
    out = level / length if length > _SHORT else np.array([1.0, 0.0, 0.0])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([cross(np.array([0.0, 0.0, 1.0]), out), [0.0, 0.0, 1.0], out])
    return T


@dataclass(frozen=True, eq=False)
class Scaling:
    """Moves and scales the points of an example so that a sphere around them becomes another one."""

    scale: float
    center: Array
    at: Array

    @classmethod
    def of(cls, points: Array, view: View) -> Scaling:
        """Points ``(k, 3)`` in the middle of the picture."""
        center, radius = round_points(points)
        return cls(FILLED * view.radius / radius, center, view.center)

    def points(self, p: Array) -> Array:
        """Points ``(…, 3)`` in the scene."""
        return np.asarray(self.at + self.scale * (p - self.center))

    def pose(self, T: Array) -> Array:
        """A frame ``(4, 4)`` in the scene."""
        found = T.copy()
        found[:3, 3] = self.points(T[:3, 3])
        return found


class ExampleDrawing:
    """Makes the nodes of one example."""

    def __init__(self, example: Example, view: View) -> None:
        self._T = facing(view.out) if example.upright else np.eye(4)
        self._robot = robot = example.robot.with_base(self._T)
        ways = [q for step in example.steps for q in step.way[::10]]
        seen = [self._frames(q)[:, :3, 3] for q in ways]
        marks = [self._mark(mark) for step in example.steps for mark in step.drawn.marks]
        self._place = Scaling.of(np.vstack([*seen, *marks]), view)
        self._figure = FigureNodes(0.8 * self._place.scale * body(robot).size)
        self._radius = FILLED * view.radius

    def _frames(self, q: Array) -> Array:
        """The base and the frame of each row ``(rows + 1, 4, 4)``."""
        return np.concatenate([self._robot.T_world_base[None], link_frames(self._robot, q)])

    def _mark(self, mark: Mark) -> Array:
        """A point ``(3,)`` that is given in the frame of the base."""
        return np.asarray(self._T[:3, :3] @ [each.value({}) for each in mark.at])

    def nodes(self, q: Array, drawn: Drawn, way: Array, walk: float, units: Units) -> list[Node]:
        """The arm at q ``(n,)`` with what is drawn of it.

        Args:
            way: the configurations ``(m, n)`` that are behind in this step.
            walk: the place of the large frame, in motions from the base.
        """
        robot = self._robot
        frames = self._frames(q)
        with self._figure:
            nodes = [self._arm("arm", q)]
            nodes += [
                self._arm(f"copy-{i}", configuration(each), SKY, GHOST_OPACITY)
                for i, each in enumerate(drawn.ghosts)
            ]
            for joint in drawn.axes:
                nodes += self._axis(joint, frames[robot.joint_rows[joint - 1]])
            for number in drawn.frames:
                nodes += self._frame(f"frame-{number}", frames[number], str(number), FRAME)
            if drawn.walk is not None:
                nodes += self._frame("walk", walked(frames, robot, q, walk), "", LARGE)
            for joint in drawn.angles:
                nodes += self._angle(joint, q, frames, units)
            for joint in drawn.columns:
                nodes += self._column(joint, q)
            if drawn.path and len(way) > 1:
                nodes.append(self._path(way))
            for i, ruler in enumerate(drawn.rulers):
                nodes += self._ruler(f"ruler-{i}", frames, ruler.start, ruler.end, ruler.name, units)
            for i, mark in enumerate(drawn.marks):
                nodes += self._figure.point(f"mark-{i}", self._place.points(self._mark(mark)), mark.name, AMBER)
        return nodes

    def _arm(self, key: str, q: Array, color: Color | None = None, opacity: float = 1.0) -> Node:
        robot = self._robot
        positions, wxyz, _ = places(robot, q[None])
        node = placed(key, robot, self._place.points(positions[0]), wxyz[0], color or LINK, opacity)
        node.props["batched_scales"] = self._place.scale * skeleton(robot).scales
        if color is None:
            thick = skeleton(robot).scales[:, :1]
            drums = thick >= 0.99 * thick.max()
            node.props["batched_colors"] = np.where(drums, JOINT, LINK).astype(np.uint8)
        return node

    def _axis(self, joint: int, before: Array) -> list[Node]:
        """The axis of a joint is z of the frame before its row, as all these arms have standard tables."""
        z, at = before[:3, 2], self._place.points(before[:3, 3])
        color = joint_color(joint - 1)
        return self._figure.axis(f"axis-{joint}", at, z, AXIS * self._radius, f"axis {joint}", color)

    def _frame(self, key: str, T: Array, name: str, length: float) -> list[Node]:
        T, size = self._place.pose(T), length * self._radius
        nodes = [axes(key, T, size, 0.035 * size)]
        if name:
            nodes.append(label(f"{key}-name", name, T[:3, 3] - 0.3 * size * T[:3, :3].sum(axis=1)))
        return nodes

    def _angle(self, joint: int, q: Array, frames: Array, units: Units) -> list[Node]:
        """The turn of a joint from where its value is zero."""
        robot, row = self._robot, self._robot.joint_rows[joint - 1]
        if not robot.revolute[joint - 1]:
            return []
        T, zero = frames[row], robot.rows[row].theta
        start = T[:3, 0] * math.cos(zero) + T[:3, 1] * math.sin(zero)
        corner, value = self._place.points(T[:3, 3]), float(q[joint - 1])
        words = f"joint {joint}: {Quantity(value, 'angle').text(units)}"
        radius = 0.22 * self._radius
        return self._figure.angle(
            f"angle-{joint}", corner, start, T[:3, 2], value, "", units, joint_color(joint - 1), radius, words
        )

    def _column(self, joint: int, q: Array) -> list[Node]:
        tool = self._place.points(fk(self._robot, q)[:3, 3])
        v = jacobian(self._robot, q)[:3, joint - 1]
        end = tool + SAMPLE * self._place.scale * v
        if np.linalg.norm(end - tool) < _SHORT:
            return []
        r, color = self._radius, joint_color(joint - 1)
        words = f"column {joint}: {float(np.linalg.norm(v)):.2f} m/s"
        return [
            arrows(f"column-{joint}", np.array([[tool, end]]), color, (0.014 * r, 0.036 * r, 0.08 * r)),
            label(f"column-{joint}-name", words, end + 0.1 * (end - tool)),
        ]

    def _path(self, way: Array) -> Node:
        rows = way[np.linspace(0, len(way) - 1, _PATH).round().astype(int)]
        points = self._place.points(fk(self._robot, rows)[:, :3, 3])
        pairs = np.stack([points[:-1], points[1:]], axis=1)
        return bars("path", pairs, PURPLE, 0.4 * self._figure.size)

    def _ruler(self, key: str, frames: Array, start: int, end: int, name: str, units: Units) -> list[Node]:
        a, b = frames[start][:3, 3], frames[end][:3, 3]
        words = f"{name} = {Quantity(float(np.linalg.norm(b - a)), 'length').text(units)}"
        a, b = self._place.points(a), self._place.points(b)
        aside = clear_of(a, b, self._place.points(frames[:, :3, 3]))
        return self._figure.dimension(key, a, b, name, units, aside, BLUE, words)
