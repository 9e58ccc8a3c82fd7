"""The obstacles in a visitor's scene: neutral bodies, red if the arm touches them, and a gizmo for one."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from app.viewer.declared.scene import Color, Node
from app.viewer.obstacles.placed import pose
from app.viewer.scene.bodies.nodes import TOUCHING
from app.viewer.scene.key_number import BELOW as NUMBER_BELOW
from kin import Obstacle
from kin.collision.solids import CYLINDER, SPHERE
from kin.transforms import Array, wxyz_from_rotation

COLOR: Color = (158, 162, 168)
BELOW: Color = (122, 126, 133)  # of a table, under its top
TOP, INSET = 0.06, 0.94  # thickness of a table's top in lengths, and how far what is under it stands back
# What casts the shadow of a table is inside it, and so deep (radii of the sphere around the arm) that its soft
# shadow does not show on the top in dots.
CORE, DEEP = 0.93, 0.25
# Length of the arrows in radii of the sphere around the arm, their thickness in pixels, and how opaque they are:
# smaller, thinner and fainter than those of the target.
GIZMO, LINE, FAINT = 0.17, 2.0, 0.6


def nodes(
    index: int, each: Obstacle, radius: float, red: bool, named: bool, click: tuple[Hashable, ...]
) -> list[Node]:
    """An obstacle, and its name if it is to be `named`.

    `radius`: of the sphere around the arm, whose lamp casts their shadows.
    """
    parts = _meshes(each, DEEP * radius)
    for part in parts:
        part.click, part.keep = click, False
        part.props["color"] = TOUCHING if red else part.props["color"]
    if named:
        text = {"text": each.label, "scale": 0.9, "anchor": "bottom-center", "depth_test": True}
        above = 0.0 if each.kind.topped else float(each.half[2])
        parts.append(Node("label", "name", text, (0.0, 0.0, above + 0.01)))
    T = pose(each)
    place = T[:3, 3], wxyz_from_rotation(T[:3, :3])
    return [Node("frame", f"obstacle-{index}", {"show_axes": False}, *place, parts, keep=False)]


def _meshes(each: Obstacle, deep: float) -> list[Node]:
    """`deep`: how far (m) under the top of a table a body may begin that casts a shadow."""
    # A body that casts a shadow and receives it is striped by its own.
    half, solid = each.half, each.kind.solid
    length, width, height = (2.0 * half).tolist()
    if solid == SPHERE:
        return [_part("icosphere", "ball", radius=half[0], subdivisions=4)]
    if solid == CYLINDER:
        return [_part("cylinder", "can", radius=half[0], height=height, radial_segments=48)]
    if not each.kind.topped:
        return [_part("box", "box", dimensions=(length, width, height))]
    top = min(TOP * min(length, width), height)
    found = [_block("top", (length, width, top), 0.0, COLOR, cast_shadow=False, receive_shadow=True)]
    if height > top:
        found.append(_block("below", (INSET * length, INSET * width, height - top), top, BELOW, cast_shadow=False))
    if height > max(deep, top):
        found.append(_block("core", (CORE * length, CORE * width, height - deep), deep, BELOW))
    return found


def _part(kind: str, key: str, color: Color = COLOR, **props: Any) -> Node:
    return Node(kind, key, {"color": color, "receive_shadow": False, **props})


def _block(key: str, size: tuple[float, float, float], below: float, color: Color, **props: Any) -> Node:
    """A box that begins `below` (m) the top of a table."""
    part = _part("box", key, color, dimensions=size, **props)
    part.position = (0.0, 0.0, -below - 0.5 * size[2])
    return part


def gizmo(T: Array, radius: float, drag: tuple[Hashable, ...]) -> Node:
    """The gizmo at a pose ``(4, 4)``; `radius`: of the sphere around the arm."""
    props = {"scale": GIZMO * radius, "line_width": LINE, "depth_test": False, "opacity": FAINT}
    where = T[:3, 3], wxyz_from_rotation(T[:3, :3])
    return Node("transform_controls", "obstacle-gizmo", props, *where, drag=drag, keep=False)


def travel(text: str, T: Array, radius: float) -> Node:
    """How far one is dragged, below its pose ``(4, 4)``."""
    place = T[:3, 3] - [0.0, 0.0, NUMBER_BELOW * radius]
    return Node("label", "travel", {"text": text, "anchor": "top-center"}, place)
