"""The lesson's drawings: the joint axes with their directions, the chosen screw, and a ghost of the arm."""

from __future__ import annotations

import numpy as np
import viser

from app.viewer.declared.scene import arrow_color
from app.viewer.lessons.figures import GREY, Figure, clear_of, set_visible
from app.viewer.lessons.screws.product import foot
from app.viewer.lessons.velocity.drawing import ring_arrow, wxyz_along
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.meshes import body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Robot
from kin.transforms import Array, wxyz_from_rotation
from kin.units import Units

REACH = 0.42  # of an axis to both sides, relative to the radius of the sphere around the arm
RING, APART = 0.06, 0.13
VELOCITY = (213, 40, 0)
GHOST = (86, 180, 233)
OPACITY = 0.45
_SHORT = 1e-3  # relative; shorter arrows are not drawn


class Drawing:
    """The drawings for one arm, below the node `root`; the visitor's worker calls it.

    Attributes:
        tips: ``(n, 3)`` the ends of the axes.
    """

    def __init__(self, scene: viser.SceneApi, robot: Robot, root: str) -> None:
        self._robot = robot
        self._radius = r = body(robot).radius
        self.tips = np.zeros((robot.n, 3))
        self._figure = figure = Figure(scene, root, body(robot).size)
        ring = ring_arrow(False)
        self._lines, self._marks = [], []
        for i in range(robot.n):
            color, name = joint_color(i), figure.name()
            self._lines.append(figure.line(f"S{_subscript(i + 1)}", color))
            mark: viser.ArrowsHandle | viser.MeshHandle
            if robot.revolute[i]:
                mark = scene.add_mesh_simple(
                    name,
                    np.asarray(ring.vertices),
                    np.asarray(ring.faces),
                    color=color,
                    scale=RING * r,
                    cast_shadow=False,
                )
            else:
                mark = self._arrow(scene, name, color)
            self._marks.append(mark)
        self._frame = scene.add_frame(
            f"{root}/frame", axes_length=0.18 * r, axes_radius=0.006 * r, origin_radius=0.012 * r
        )
        self._foot = figure.dimension("|v|", GREY)
        self._velocity = self._arrow(scene, f"{root}/velocity", VELOCITY)
        self._ghost = self._new_ghost(scene, f"{root}/ghost")

    def _arrow(self, scene: viser.SceneApi, name: str, color: tuple[int, int, int]) -> viser.ArrowsHandle:
        r = self._radius
        return scene.add_arrows(
            name,
            np.zeros((1, 2, 3), np.float32),
            arrow_color(color),
            shaft_radius=0.009 * r,
            head_radius=0.024 * r,
            head_length=0.06 * r,
            visible=False,
        )

    def _new_ghost(self, scene: viser.SceneApi, name: str) -> viser.BatchedMeshHandle:
        vertices, faces = cylinder()
        bones = skeleton(self._robot)
        many = len(bones.links)
        return scene.add_batched_meshes_simple(
            name,
            vertices,
            faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (many, 1)),
            batched_positions=np.zeros((many, 3)),
            batched_scales=bones.scales,
            batched_colors=GHOST,
            opacity=OPACITY,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def show_axes(self, points: Array, directions: Array) -> None:
        """Draw the axes through points ``(n, 3)`` along unit vectors ``(n, 3)``."""
        r = self._radius
        self.tips = tips = spread_tips(points, directions, REACH * r, APART * r)
        for i, (point, z, tip) in enumerate(zip(points, directions, tips, strict=True)):
            self._lines[i].show(point - REACH * r * z, tip)
            mark = self._marks[i]
            if isinstance(mark, viser.ArrowsHandle):
                mark.points = np.array([[tip - 0.2 * r * z, tip + 0.02 * r * z]], np.float32)
                set_visible(mark, True)
            else:
                mark.position = tip - 0.02 * r * z
                mark.wxyz = wxyz_along(z)

    def show_chosen(self, joint: int, S: Array, T: Array, units: Units) -> None:
        """Draw where the numbers of one screw ``(6,)`` come from, seen from the frame T ``(4, 4)``.

        The perpendicular from its origin to the axis, and there the velocity v of a point that moves along.
        """
        self._frame.position, self._frame.wxyz = T[:3, 3], wxyz_from_rotation(T[:3, :3])
        origin = T[:3, 3]
        v = S[3:] + np.cross(S[:3], origin)
        local = np.concatenate([S[:3], v])
        size = float(np.linalg.norm(v))
        there = size > _SHORT * self._radius
        set_visible(self._velocity, there)
        if there and self._robot.revolute[joint]:
            end = origin + foot(local)
            self._foot.show(origin, end, units, clear_of(origin, end, self.tips))
        else:
            self._foot.hide()
        if there:
            self._velocity.points = np.array([[origin, origin + 0.35 * self._radius * v / size]], np.float32)

    def show_ghost(self, q: Array | None) -> None:
        """Draw the arm at a configuration ``(n,)``; None hides it."""
        set_visible(self._ghost, q is not None)
        if q is not None:
            positions, wxyz, _ = places(self._robot, q[None])
            self._ghost.batched_positions = positions[0].astype(np.float32)
            self._ghost.batched_wxyzs = wxyz[0].astype(np.float32)

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._figure.remove()


def spread_tips(points: Array, directions: Array, reach: float, apart: float) -> Array:
    """The ends ``(n, 3)`` of axes drawn from points along directions; those of one line are kept apart."""
    tips: list[Array] = []
    for point, z in zip(points, directions, strict=True):
        tip = point + reach * z
        while any(float(np.linalg.norm(tip - other)) < 0.9 * apart for other in tips):
            tip = tip + apart * z
        tips.append(tip)
    return np.array(tips)


def _subscript(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))
