"""The lesson's drawings at the tool: ellipsoid, arrows of a column, lost directions.

Nodes are created once for an arm and then posed: the ellipsoid is a unit sphere with a rotation and three scales.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import viser

from app.viewer.labels import add_label
from app.viewer.lessons.figures import set_visible
from app.viewer.scene.arm.arm_scene import GIZMO
from app.viewer.scene.meshes import body
from app.viewer.scene.shapes import Solid, cone, merged, placed, tube
from kin import Robot
from kin.differential.ellipsoids import Ellipsoid
from kin.transforms import Array, frame_from_approach, wxyz_from_rotation

COLORS: dict[Ellipsoid, tuple[int, int, int]] = {
    "velocity": (86, 180, 233),
    "turning": (204, 121, 167),
    "force": (230, 159, 0),
    "moment": (240, 228, 66),
}
COLUMN, LOST, SLOW = (0, 114, 178), (213, 40, 0), (184, 122, 0)
AXIS_LINE = (90, 90, 90)
# Relative to the radius of the sphere around the arm.
FLAT, LONGEST = 0.004, 0.62
# What is lost is drawn outside of the gizmo, whose arrows are `GIZMO` long: from `CLEAR` on.
CLEAR = 1.12 * GIZMO
RING, LOST_RING, LOST_ARROW = 0.13, 0.075, CLEAR + 0.2
MOST_LOST = 3
CHOICES = np.array([(1.0, b, c) for b in (1.0, -1.0) for c in (1.0, -1.0)])


class Drawing:
    """The drawings for one arm, below the node `root`; the visitor's worker calls it."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self.radius = body(robot).radius
        r = self.radius
        self._root = scene.add_frame(root, show_axes=False)
        self._kind: Ellipsoid | None = None
        self._tips = np.zeros(3)
        self._R = np.eye(3)
        # All parts of the ellipsoid are children of its principal axes: rotating it is one message.
        self._body = scene.add_frame(f"{root}/body", show_axes=False, visible=False)
        from trimesh.creation import icosphere  # its import takes a quarter of a second

        sphere = icosphere(subdivisions=3)
        self._ellipsoid = scene.add_mesh_simple(
            f"{root}/body/ellipsoid",
            np.asarray(sphere.vertices),
            np.asarray(sphere.faces),
            opacity=0.32,
            cast_shadow=False,
            receive_shadow=False,
        )
        ends = np.eye(3, dtype=np.float32)
        self._axes = scene.add_line_segments(
            f"{root}/body/axes",
            np.stack([-ends, ends], axis=1),
            AXIS_LINE,
            thickness=2.0,
            thickness_units="screen",
        )
        self._labels = [
            add_label(scene, f"{root}/body/value-{k + 1}", "", scale=0.8, anchor="center-center") for k in range(3)
        ]
        self._column, self._lost = (
            scene.add_arrows(
                f"{root}/{name}",
                np.zeros((1, 2, 3), np.float32),
                arrow_color(color),
                shaft_radius=0.011 * r,
                head_radius=0.028 * r,
                head_length=0.07 * r,
                visible=False,
            )
            for name, color in (("column", COLUMN), ("lost", LOST))
        )
        self._turn = self._ring(scene, f"{root}/turn", False, COLUMN, RING)
        self._lost_turns = [
            self._ring(scene, f"{root}/lost-turn-{k + 1}", True, LOST, LOST_RING) for k in range(MOST_LOST)
        ]

        self._lost_axes = scene.add_line_segments(
            f"{root}/lost-axes",
            np.zeros((1, 2, 3), np.float32),
            LOST,
            thickness=1.5,
            thickness_units="screen",
            visible=False,
        )

    def _ring(
        self, scene: viser.SceneApi, name: str, double: bool, color: tuple[int, int, int], radius: float
    ) -> viser.MeshHandle:
        mesh = ring_arrow(double)
        return scene.add_mesh_simple(
            name,
            np.asarray(mesh.vertices),
            np.asarray(mesh.faces),
            color=color,
            scale=radius * self.radius,
            cast_shadow=False,
            visible=False,
        )

    def place(self, tool: Array) -> None:
        """Move everything to the tool point ``(3,)``."""
        self._root.position = tool

    def show_ellipsoid(self, kind: Ellipsoid, R: Array, lengths: Array) -> bool:
        """Draw an ellipsoid with axes R ``(3, 3)`` and semi-axes `lengths` ``(3,)`` in metres.

        Flat ellipsoids are drawn as thin discs, very long ones truncated; returns whether it was truncated.
        """
        shown = np.clip(lengths, FLAT * self.radius, LONGEST * self.radius)
        if kind != self._kind:
            self._kind = kind
            self._ellipsoid.color = COLORS[kind]
            self._body.visible = True
        self._R = R
        self._body.wxyz = wxyz_from_rotation(R)
        self._ellipsoid.scale = self._axes.scale = (float(shown[0]), float(shown[1]), float(shown[2]))
        # Values are outside of the gizmo too.
        self._tips = np.maximum(shown + 0.05 * self.radius, CLEAR * self.radius)
        return bool((lengths > LONGEST * self.radius).any())

    def write_values(self, texts: tuple[str, str, str], eye: Array) -> None:
        """Label the axes of the ellipsoid with their values, as seen from a point ``(3,)``."""
        ends = np.diag(self._tips * sides(self._R * self._tips, eye - self._root.position))
        for label, text, end in zip(self._labels, texts, ends, strict=True):
            label.text = text
            label.position = end

    def hide_ellipsoid(self) -> None:
        """Hide the ellipsoid."""
        self._kind = None
        self._body.visible = False

    def show_column(self, linear: Array | None, angular: Array | None) -> None:
        """Draw a straight arrow ``(3,)`` in metres and a turning arrow about ``(3,)``; None or zero hides one."""
        straight = linear is not None and float(np.linalg.norm(linear)) > 0.02 * self.radius
        set_visible(self._column, straight)
        if straight:
            self._column.points = np.array([[np.zeros(3), linear]], np.float32)
        turning = angular is not None and float(np.linalg.norm(angular)) > 1e-6
        set_visible(self._turn, turning)
        if angular is not None and turning:
            self._turn.wxyz = wxyz_along(angular)

    def show_lost(self, twists: Array, certain: bool) -> None:
        """Draw double arrows along and about twists ``(k, 6)``: red if lost, amber if only slow."""
        color = LOST if certain else SLOW
        arrows = []
        for twist in twists[:MOST_LOST]:
            size = float(np.linalg.norm(twist[:3]))
            if size > 1e-3:
                end = twist[:3] / size * LOST_ARROW * self.radius
                start = end * (CLEAR / LOST_ARROW)
                arrows += [[start, end], [-start, -end]]
        set_visible(self._lost, bool(arrows))
        if arrows:
            self._lost.points = np.array(arrows, np.float32)
            self._lost.colors = np.array(arrow_color(color), np.uint8)
        turning = [twist for twist in twists[:MOST_LOST] if float(np.linalg.norm(twist[3:])) > 1e-3]
        set_visible(self._lost_axes, bool(turning))
        if turning:
            places = np.array([[np.zeros(3), self._ring_place(twist)] for twist in turning], np.float32)
            self._lost_axes.points = places
            self._lost_axes.colors = np.array(color, np.uint8)
        for k, node in enumerate(self._lost_turns):
            shown = k < len(twists) and float(np.linalg.norm(twists[k, 3:])) > 1e-3
            set_visible(node, shown)
            if shown:
                node.wxyz = wxyz_along(twists[k, 3:])
                node.position = self._ring_place(twists[k])
                node.color = color

    def _ring_place(self, twist: Array) -> Array:
        """Where the arrow of a lost rotation is, on its axis ``(3,)``: at the side that is farther up.

        Beyond the arrow of the motion that is lost with it, if they are along the same line.
        """
        axis = twist[3:] / float(np.linalg.norm(twist[3:]))
        axis = axis if axis[2] >= 0.0 else -axis
        along = float(np.linalg.norm(twist[:3])) > 1e-3 and abs(float(axis @ twist[:3])) > 0.8 * float(
            np.linalg.norm(twist[:3])
        )
        return np.asarray(axis * ((LOST_ARROW if along else CLEAR) + 0.5 * LOST_RING) * self.radius)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._root.remove()


def arrow_color(color: tuple[int, int, int]) -> tuple[int, int, int]:
    """The colour to send for arrows that look like a mesh of `color`: the scene applies gamma to arrows."""
    red, green, blue = (round(255 * ((v / 255 + 0.055) / 1.055) ** 2.4) for v in color)
    return red, green, blue


def sides(tips: Array, towards: Array) -> Array:
    """The end of each axis to label, ±1 ``(3,)``: the choice that keeps the labels farthest apart on screen.

    Args:
        tips: the axes' ends as columns ``(3, 3)``, relative to their common centre.
        towards: vector ``(3,)`` from there to the eye.
    """
    ahead = towards / max(float(np.linalg.norm(towards)), 1e-9)
    flat = (tips - np.outer(ahead, ahead @ tips)).T
    ends = CHOICES[:, :, None] * flat
    apart = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).min(axis=1)
    # The first of equals: the labels of a moving arm must not jump needlessly.
    best: Array = CHOICES[int(np.argmax(apart > apart.max() - 1e-3 * np.abs(tips).max()))]
    return best


def wxyz_along(direction: Array) -> tuple[float, float, float, float]:
    """The shortest rotation that takes z to a nonzero direction ``(3,)``."""
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    if z < -1.0 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    size = math.sqrt(2.0 * (1.0 + z))
    return 0.5 * size, -y / size, x / size, 0.0


@lru_cache(maxsize=2)
def ring_arrow(double: bool) -> Solid:
    """A circular arrow about z, counter-clockwise, of radius 1; with a head at each end if `double`."""
    first, last = math.radians(35.0 if double else 0.0), math.radians(290.0)
    angles = np.linspace(first, last, 40)
    path = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    heads = [(last, 1.0)] + ([(first, -1.0)] if double else [])
    parts = [tube(path, 0.05)]
    for angle, way in heads:
        T = np.eye(4)
        T[:3, :3] = frame_from_approach((-way * math.sin(angle), way * math.cos(angle), 0.0))
        T[:3, 3] = math.cos(angle), math.sin(angle), 0.0
        parts.append(placed(cone(0.16, 0.0, 0.42), T))
    return merged(parts)
