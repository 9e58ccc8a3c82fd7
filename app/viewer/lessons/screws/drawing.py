"""The lesson's drawings: the joint axes with their directions, the chosen screw, and a ghost of the arm."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from app.viewer.declared.scene import Color, Node, arrows, axes, mesh
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import GREY, clear_of
from app.viewer.lessons.velocity.drawing import ring_arrow, wxyz_along
from app.viewer.scene.bodies.parts import joint_color
from app.viewer.scene.meshes import body
from app.viewer.skeleton import ghost
from kin import Robot
from kin.dh import Screws
from kin.transforms import Array
from kin.units import Units

REACH = 0.42  # of an axis to both sides, relative to the radius of the sphere around the arm
RING, APART = 0.06, 0.13
VELOCITY = (213, 40, 0)
GHOST = (86, 180, 233)
OPACITY = 0.45
_SHORT = 1e-3  # relative; shorter arrows are not drawn


class Drawn(Protocol):
    """What is drawn of the facts of the lesson."""

    @property
    def robot(self) -> Robot: ...
    @property
    def axes(self) -> tuple[Array, Array]: ...
    @property
    def screws(self) -> Screws: ...
    @property
    def origin(self) -> Array: ...
    @property
    def chosen(self) -> int: ...
    @property
    def ghost(self) -> Array | None: ...


def foot(S: Array) -> Array:
    """The point ``(3,)`` of a revolute joint's axis nearest to the origin; the origin for a prismatic joint."""
    return np.cross(S[:3], S[3:])


def tips(facts: Drawn) -> Array:
    """The ends of the axes ``(n, 3)``."""
    r = body(facts.robot).radius
    return spread_tips(*facts.axes, REACH * r, APART * r)


def scene(facts: Drawn, figure: FigureNodes, units: Units, asked: bool = False) -> list[Node]:
    """All drawings; only the axes if the numbers of the screws are asked."""
    with figure:
        ends = tips(facts)
        nodes = _axes(facts, figure, ends)
        if not asked:
            nodes += _chosen(facts, figure, ends, units)
    if facts.ghost is not None:
        nodes.append(ghost("ghost", facts.robot, facts.ghost, GHOST, OPACITY))
    return nodes


def _axes(facts: Drawn, figure: FigureNodes, ends: Array) -> list[Node]:
    r, nodes = body(facts.robot).radius, []
    for i, (point, z, tip) in enumerate(zip(*facts.axes, ends, strict=True)):
        color = joint_color(i)
        nodes += figure.line(f"axis-{i}", point - REACH * r * z, tip, f"S{_subscript(i + 1)}", color)
        if facts.robot.revolute[i]:
            place = {"position": tip - 0.02 * r * z, "wxyz": wxyz_along(z)}
            nodes.append(mesh(f"turn-{i}", ring_arrow(False), color, RING * r, **place))
        else:
            nodes.append(_arrow(f"slide-{i}", tip - 0.2 * r * z, tip + 0.02 * r * z, color, r))
    return nodes


def _chosen(facts: Drawn, figure: FigureNodes, ends: Array, units: Units) -> list[Node]:
    """Where the numbers of one screw come from, seen from their own frame.

    The perpendicular from its origin to the axis, and there the velocity v of a point that moves along.
    """
    r, T, S = body(facts.robot).radius, facts.origin, facts.screws.S[:, facts.chosen]
    nodes = [axes("frame", T, 0.18 * r, 0.006 * r, origin_radius=0.012 * r)]
    origin = T[:3, 3]
    v = S[3:] + np.cross(S[:3], origin)
    size = float(np.linalg.norm(v))
    if size <= _SHORT * r:
        return nodes
    if facts.robot.revolute[facts.chosen]:
        end = origin + foot(np.concatenate([S[:3], v]))
        nodes += figure.dimension("foot", origin, end, "|v|", units, clear_of(origin, end, ends), GREY)
    return [*nodes, _arrow("velocity", origin, origin + 0.35 * r * v / size, VELOCITY, r)]


def _arrow(key: str, start: Array, end: Array, color: Color, r: float) -> Node:
    return arrows(key, np.array([[start, end]]), color, (0.009 * r, 0.024 * r, 0.06 * r))


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
