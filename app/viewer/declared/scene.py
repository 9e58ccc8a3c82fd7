"""What a scene shows, as nodes, and the reconciler that keeps viser's scene equal to them.

A node is made when it is first shown. From then on it is posed, changed and hidden, never made again: to show a
part of a moving drawing costs one message. A node with `keep` off is removed instead, such as a cloud.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np
import viser
from numpy.typing import ArrayLike

from app.viewer.declared.panel import same
from app.viewer.labels import add_label
from app.viewer.scene import gizmo
from app.viewer.scene.gizmo import DragEvent
from app.viewer.scene.shapes import Solid
from app.viewer.viser_patches import assign, keep_private
from kin.transforms import Array, wxyz_from_rotation

Color = tuple[int, int, int]
Vector = Array | Sequence[float]
Post = Callable[[Hashable, object], None]
COLORS = frozenset({"colors", "batched_colors"})  # properties
_ROOTS, _DRAGS = count(1), count(1)


@dataclass(slots=True, eq=False)
class Node:
    """A node of the scene: viser's `add_…` of this kind with these properties, below its parent.

    Attributes:
        drag: the event of a handle that is dragged; the method also gets each `DragEvent`.
        click: the event of a click.
        instances: whether the method also gets which of the batched meshes it was.
        keep: whether it is only hidden when it is not shown.
        once: whether its key is never used again once it is gone, so that nobody needs to remember its name.
    """

    kind: str
    key: str
    props: dict[str, Any] = field(default_factory=dict)
    position: Vector | None = None
    wxyz: Vector | None = None
    children: Sequence[Node | Lazy] = ()
    drag: tuple[Hashable, ...] | None = None
    keep: bool = True
    click: tuple[Hashable, ...] | None = None
    once: bool = False
    instances: bool = False


@dataclass(slots=True, eq=False)
class Lazy:
    """Nodes that `view` makes of `args`, beside the others; it is called again only when these have changed."""

    key: str
    view: Callable[..., Sequence[Node]]
    args: tuple[Any, ...]


def frame(key: str, *children: Node | Lazy, position: Vector | None = None, wxyz: Vector | None = None) -> Node:
    """A frame without axes, and what moves with it."""
    return Node("frame", key, {"show_axes": False}, position, wxyz, children)


def axes(key: str, T: Array, length: float, radius: float, **more: Any) -> Node:
    """The three axes of a pose ``(4, 4)``, of this length and radius (m)."""
    props = {"axes_length": length, "axes_radius": radius, **more}
    return Node("frame", key, props, T[:3, 3], wxyz_from_rotation(T[:3, :3]))


def arrows(key: str, points: ArrayLike, color: Color, size: tuple[float, float, float]) -> Node:
    """Arrows ``(k, 2, 3)``; sizes are the radii of shaft and head, and the length of the head, in metres."""
    shaft, head, length = size
    props = {"points": np.asarray(points, np.float32), "colors": arrow_color(color)}
    return Node("arrows", key, {**props, "shaft_radius": shaft, "head_radius": head, "head_length": length})


def lines(key: str, points: ArrayLike, color: Any, width: float, scale: Any = 1.0) -> Node:
    """Lines ``(k, 2, 3)`` of a width in pixels."""
    return bars(key, points, color, width, thickness_units="screen", scale=scale)


def bars(key: str, points: ArrayLike, color: Any, thickness: float, **more: Any) -> Node:
    """Lines ``(k, 2, 3)`` of a thickness in metres."""
    props = {"points": np.asarray(points, np.float32), "colors": color, "thickness": thickness}
    return Node("line_segments", key, {**props, **more})


def mesh(key: str, solid: Solid, color: Color, scale: Any = 1.0, **more: Any) -> Node:
    """A mesh; keep the solid, as with `functools.cache`, so that it is not compared."""
    position, wxyz = more.pop("position", None), more.pop("wxyz", None)
    props = {
        "vertices": solid.vertices,
        "faces": solid.faces,
        "color": color,
        "scale": scale,
        "cast_shadow": False,
    }
    return Node("mesh_simple", key, {**props, **more}, position, wxyz)


def label(key: str, text: str, position: Vector, size: float = 1.0, anchor: str | None = "center-center") -> Node:
    """A text in front of everything; without an anchor, viser's own is used."""
    props = {"text": text, "scale": size, **({"anchor": anchor} if anchor else {})}
    return Node("label", key, props, position)


def handle(key: str, position: Vector, scale: float, drag: tuple[Hashable, ...]) -> Node:
    """Three arrows to drag a point with."""
    props = {"scale": scale, "line_width": 4.0, "disable_rotations": True, "disable_sliders": True}
    return Node("transform_controls", key, {**props, "depth_test": False}, position, drag=drag)


def ends(nodes: Sequence[Node]) -> Array:
    """The points ``(n, 3)`` that a picture has to contain to show these nodes, without their children."""
    found = [np.zeros((0, 3))]
    for node in nodes:
        if "points" in node.props:
            found.append(np.asarray(node.props["points"], float).reshape(-1, 3))
        elif node.position is not None:
            found.append(np.reshape(np.asarray(node.position, float), (1, 3)))
    return np.concatenate(found)


def arrow_color(color: Color) -> Color:
    """The colour to send for arrows that look like a mesh of `color`: the scene applies gamma to arrows."""
    red, green, blue = (round(255 * ((v / 255 + 0.055) / 1.055) ** 2.4) for v in color)
    return red, green, blue


@dataclass(slots=True, eq=False)
class _Shown:
    handle: Any
    kind: str
    props: dict[str, Any]
    keep: bool
    visible: bool = True
    held: bool = False
    drag: int = 0
    args: tuple[Any, ...] | None = None  # of a `Lazy`, which has no handle
    children: dict[str, _Shown] = field(default_factory=dict)


def _is_same_kind(one: _Shown, node: Node | Lazy) -> bool:
    """Whether what is shown can become this node: a bar cannot become a frame by other properties."""
    return isinstance(node, Node) and one.kind == node.kind and one.props.keys() == node.props.keys()


class SceneView:
    """The drawings of one feature.

    Names are never used again: browsers give the pose of a removed node to the next one of its name.
    """

    def __init__(self, scene: viser.SceneApi, key: str, post: Post) -> None:
        self._scene, self._key, self._post = scene, key, post
        self._again, self._names = count(2), set[str]()
        self._top: viser.FrameHandle | None = None
        self._shown: dict[str, _Shown] = {}

    def show(self, nodes: Sequence[Node | Lazy]) -> None:
        """Make the scene equal to these nodes."""
        if self._top is None and not nodes:
            return
        if self._top is None:
            self._top = self._scene.add_frame(f"/{self._key}-{next(_ROOTS)}", show_axes=False)
        self._fill(self._top.name, nodes, self._shown)

    def remove(self) -> None:
        """Remove everything; what is shown afterwards is made anew."""
        if self._top is not None:
            self._top.remove()
        self._top = None
        self._shown.clear()

    def _fill(
        self, parent: str, nodes: Sequence[Node | Lazy], shown: dict[str, _Shown], once: bool = False
    ) -> None:
        gone = set(shown)
        for node in nodes:
            gone.discard(node.key)
            one = shown.get(node.key)
            if one is not None and one.handle is not None and not _is_same_kind(one, node):
                shown.pop(node.key).handle.remove()
                one = None
            if isinstance(node, Lazy):
                if one is None:
                    one = shown[node.key] = _Shown(None, "", {}, True)
                if not one.visible or one.args is None or not same(node.args, one.args):
                    one.args, one.visible = node.args, True
                    self._fill(parent, node.view(*node.args), one.children, once)
                continue
            if one is None:
                name = f"{parent}/{node.key}"
                name = f"{name}~{next(self._again)}" if name in self._names else name
                if not (once or node.once):
                    self._names.add(name)
                one = shown[node.key] = self._make(name, node)
            else:
                self._update(one, node)
            if node.children or one.children:
                self._fill(one.handle.name, node.children, one.children, once or node.once)
        for key in gone:
            if shown[key].handle is None:
                shown[key].visible = False
                self._fill(parent, (), shown[key].children)
            elif not shown[key].keep:
                shown.pop(key).handle.remove()
            elif shown[key].visible:
                shown[key].visible = shown[key].handle.visible = False

    def _make(self, name: str, node: Node) -> _Shown:
        scene: Any = self._scene
        add = add_label if node.kind == "label" else None
        made = add(scene, name, **node.props) if add else getattr(scene, f"add_{node.kind}")(name, **node.props)
        assign(made, node.position, node.wxyz)
        one = _Shown(made, node.kind, node.props, node.keep)
        if node.drag is not None:
            self._listen(made, one, node.drag)
        if node.click is not None:
            self._listen_click(made, node.click, node.instances)
        return one

    def _update(self, one: _Shown, node: Node) -> None:
        if not one.visible:
            one.visible = one.handle.visible = True
        before = one.props
        for name, value in node.props.items():
            if value is not before[name] and (type(value) is np.ndarray or value != before[name]):
                # viser makes nodes with a tuple as colour, but later takes only arrays, which it compares itself.
                setattr(one.handle, name, np.array(value, np.uint8) if name in COLORS else value)
        one.props = node.props
        if not one.held:
            assign(one.handle, node.position, node.wxyz)

    def _listen(self, handle: Any, one: _Shown, event: tuple[Hashable, ...]) -> None:
        keep_private(handle)

        def post(key: Hashable, pull: object) -> None:
            assert isinstance(pull, DragEvent)
            one.held = pull.phase != "end"
            if pull.phase == "start":
                one.drag = next(_DRAGS)  # each is a step of its own in the history
            self._post(("drag", event, one.drag), pull)

        gizmo.listen(handle, ring=False, post=post)

    def _listen_click(self, node: Any, event: tuple[Hashable, ...], instances: bool) -> None:
        @node.on_click  # type: ignore[untyped-decorator]
        async def _(click: Any) -> None:
            self._post(("do", (*event, click.instance_index) if instances else event, 0, 0), None)
