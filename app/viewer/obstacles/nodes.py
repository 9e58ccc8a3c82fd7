"""The obstacles in a visitor's scene: neutral bodies, red if the arm touches them, and a gizmo for one."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from itertools import count

import viser

from app.viewer.labels import add_label
from app.viewer.obstacles.placed import Obstacles, pose
from app.viewer.panel import Post
from app.viewer.scene import gizmo
from app.viewer.scene.bodies.nodes import TOUCHING
from app.viewer.scene.key_number import KeyNumber
from app.viewer.viser_patches import assign, keep_private
from kin import Obstacle
from kin.collision.solids import CYLINDER, SPHERE
from kin.transforms import Array, wxyz_from_rotation

Color = tuple[int, int, int]
Mesh = viser.BoxHandle | viser.IcosphereHandle | viser.CylinderHandle
COLOR: Color = (158, 162, 168)
BELOW: Color = (122, 126, 133)  # of a table, under its top
TOP, INSET = 0.06, 0.94  # thickness of a table's top in lengths, and how far what is under it stands back
# What casts the shadow of a table is inside it, and so deep (radii of the sphere around the arm) that its soft
# shadow does not show on the top in dots.
CORE, DEEP = 0.93, 0.25
# Length of the arrows in radii of the sphere around the arm, their thickness in pixels, and how opaque they are:
# smaller, thinner and fainter than those of the target.
GIZMO, LINE, FAINT = 0.17, 2.0, 0.6
_NUMBERS = count(1)  # a node name is never used twice: browsers keep the poses of removed nodes


class _Node:
    """One obstacle in the scene."""

    def __init__(self, scene: viser.SceneApi, each: Obstacle, deep: float, clicked: Callable[[], None]) -> None:
        self.root = f"/obstacle-{next(_NUMBERS)}"
        self.frame = scene.add_frame(self.root, show_axes=False)
        self._red = False
        self._parts = [(node, node.color) for node in _meshes(scene, self.root, each, deep)]
        self._label = add_label(
            scene,
            f"{self.root}/name",
            each.label,
            scale=0.9,
            position=(0.0, 0.0, _above(each)),
            anchor="bottom-center",
            depth_test=True,
            visible=False,
        )
        for node, _ in self._parts:
            _listen(node, clicked)

    def place(self, T: Array) -> None:
        assign(self.frame, T[:3, 3], wxyz_from_rotation(T[:3, :3]))

    def show(self, red: bool, named: bool) -> None:
        if red != self._red:
            self._red = red
            for node, color in self._parts:
                node.color = TOUCHING if red else color
        if self._label.visible != named:
            self._label.visible = named

    def remove(self) -> None:
        self.frame.remove()


def _meshes(scene: viser.SceneApi, root: str, each: Obstacle, deep: float) -> list[Mesh]:
    """`deep`: how far (m) under the top of a table a body may begin that casts a shadow."""
    # A body that casts a shadow and receives it is striped by its own.
    half, solid = each.half, each.kind.solid
    if solid == SPHERE:
        return [scene.add_icosphere(f"{root}/ball", half[0], COLOR, subdivisions=4, receive_shadow=False)]
    length, width, height = (2.0 * half).tolist()
    if solid == CYLINDER:
        can = scene.add_cylinder(f"{root}/can", half[0], height, COLOR, radial_segments=48, receive_shadow=False)
        return [can]
    if not each.kind.topped:
        return [scene.add_box(f"{root}/box", COLOR, (length, width, height), receive_shadow=False)]
    top = min(TOP * min(length, width), height)
    slab, place = (length, width, top), (0.0, 0.0, -0.5 * top)
    found: list[Mesh] = [scene.add_box(f"{root}/top", COLOR, slab, position=place, cast_shadow=False)]
    if height > top:
        block, place = (INSET * length, INSET * width, height - top), (0.0, 0.0, -0.5 * (height + top))
        found.append(
            scene.add_box(f"{root}/below", BELOW, block, position=place, cast_shadow=False, receive_shadow=False)
        )
    if height > max(deep, top):
        size, place = (CORE * length, CORE * width, height - deep), (0.0, 0.0, -0.5 * (height + deep))
        found.append(scene.add_box(f"{root}/core", BELOW, size, position=place, receive_shadow=False))
    return found


def _above(each: Obstacle) -> float:
    """Height of its label over its place."""
    return (0.0 if each.kind.topped else float(each.half[2])) + 0.01


def _listen(node: Mesh, clicked: Callable[[], None]) -> None:
    @node.on_click  # type: ignore[untyped-decorator]
    async def _(event: object) -> None:
        clicked()


class ObstacleNodes:
    """The nodes of one page. The visitor's worker calls it.

    Args:
        post: takes ``"choose"`` with the number of an obstacle that was clicked, and the events of the gizmo.

    Attributes:
        travel: how far one is dragged.
    """

    def __init__(self, scene: viser.SceneApi, post: Post) -> None:
        self._scene, self._post = scene, post
        self._nodes: list[_Node] = []
        self._drawn: list[tuple[object, ...]] = []
        self._gizmo: viser.TransformControlsHandle | None = None
        self.travel = KeyNumber(scene, f"/travel-obstacle-{next(_NUMBERS)}", below=True)

    def show(self, items: Obstacles, radius: float) -> None:
        """Draw these; those whose shape and sizes are as before are only moved.

        `radius`: of the sphere around the arm, whose lamp casts their shadows.
        """
        wanted = [(each.shape, each.label, *each.sizes, radius) for each in items]
        for i, (key, each) in enumerate(zip(wanted, items, strict=True)):
            if i < len(self._drawn) and self._drawn[i] == key:
                continue
            node = _Node(self._scene, each, DEEP * radius, lambda i=i: self._post("choose", i))  # type: ignore[misc]
            if i < len(self._nodes):
                self._nodes[i].remove()
                self._nodes[i] = node
            else:
                self._nodes.append(node)
        for node in self._nodes[len(items) :]:
            node.remove()
        del self._nodes[len(items) :]
        self._drawn = wanted
        for node, each in zip(self._nodes, items, strict=True):
            node.place(pose(each))

    def mark(self, touched: Collection[int], chosen: int | None) -> None:
        """Paint those that the arm touches; name these and the one that is chosen."""
        for i, node in enumerate(self._nodes):
            node.show(i in touched, i in touched or i == chosen)

    def place_gizmo(self, T: Array | None, radius: float) -> None:
        """Put the gizmo at a pose ``(4, 4)``, never while it is held; None: no gizmo.

        `radius`: of the sphere around the arm.
        """
        if T is None:
            if self._gizmo is not None:
                self._gizmo.remove()
                self._gizmo = None
            return
        scale = GIZMO * radius
        if self._gizmo is None or not math.isclose(self._gizmo.scale, scale):
            self.place_gizmo(None, radius)
            self._gizmo = self._scene.add_transform_controls(
                f"/obstacle-gizmo-{next(_NUMBERS)}", scale=scale, line_width=LINE, depth_test=False, opacity=FAINT
            )
            keep_private(self._gizmo)
            gizmo.listen(self._gizmo, ring=False, post=self._post)
        assign(self._gizmo, T[:3, 3], wxyz_from_rotation(T[:3, :3]))

    def remove(self) -> None:
        """Remove everything from the scene."""
        self.travel.hide()
        self.show((), 1.0)
        self.place_gizmo(None, 1.0)
