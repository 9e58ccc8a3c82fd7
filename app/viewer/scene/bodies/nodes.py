"""The nodes of a drawn body in a scene; another body can take its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.bodies.parts import Color, Part
from app.viewer.scene.shapes import merged, placed
from app.viewer.viser_patches import assign
from kin.axes import inverse
from kin.collision import Contact
from kin.transforms import Array

GHOST = 0.35  # opacity of the hand at a target

TOUCHING: Color = (204, 20, 60)


class LinkColors:
    """Paints links that touch something. Nothing is sent while the same links touch."""

    def __init__(self) -> None:
        self._parts: dict[str, tuple[viser.MeshHandle, int, Color]] = {}
        self._marked: frozenset[int] = frozenset()

    def add(self, link: int, node: viser.MeshHandle, color: Color) -> None:
        """A mesh of a link, 0 for the base."""
        self._parts[node.name] = node, link, color
        if link in self._marked:
            node.color = TOUCHING

    def forget(self, nodes: Sequence[viser.MeshHandle]) -> None:
        """These meshes have been removed."""
        for node in nodes:
            self._parts.pop(node.name, None)

    def show(self, contacts: Sequence[Contact]) -> None:
        """Paint the links that touch each other or an obstacle."""
        links = frozenset(link for each in contacts for link in (each.link, each.other) if link is not None)
        changed, self._marked = links ^ self._marked, links
        if not changed:
            return
        for node, link, color in self._parts.values():
            if link in changed:
                node.color = TOUCHING if link in links else color


class DrawnBody:
    """The drawn body of one arm, and its hand as a ghost at the target.

    Args:
        add: adds a part below a node of the scene.
        links: names of the nodes of the links, base first.
        target: name of the node that the ghost hangs on.
        T_last_tool: the tool in the last link ``(4, 4)``.
        color: of the ghost.

    Attributes:
        drawing: how it is drawn; None if there is none.
        nodes: the meshes of the body; empty if there is none.
        hand: the meshes of the ghost.
        count: of bodies so far: browsers keep the poses of removed nodes, so names are used once.
        opened: how far the gripper is open, from 0 to 1.
    """

    def __init__(
        self,
        add: Callable[..., viser.MeshHandle],
        links: Sequence[str],
        target: str,
        T_last_tool: Array,
        color: Color,
    ) -> None:
        self._add = add
        self._links = links
        self._target = target
        self._T_tool_last = inverse(T_last_tool)
        self._color = color
        self.count = 0
        self.drawing: Drawing | None = None
        self.nodes: list[viser.MeshHandle] = []
        self.hand: list[viser.MeshHandle] = []
        self.opened = 0.5
        self._fingers: list[tuple[viser.MeshHandle, Finger]] = []

    def use(self, drawing: Drawing | None, colors: LinkColors) -> None:
        """Replace the body; the new one is visible, its ghost is not."""
        colors.forget(self.nodes)
        for node in (*self.nodes, *self.hand):
            node.remove()
        self.count += 1
        self.drawing, self.nodes, self.hand, self._fingers = drawing, [], [], []
        if drawing is None:
            return
        for k, (parent, parts) in enumerate(zip(self._links, drawing.parts, strict=True)):
            for part in parts:
                self.nodes.append(self._add(parent, part, name=f"{part.name}-{k}-{self.count}"))
                colors.add(k, self.nodes[-1], part.color)
        for k, finger in enumerate(drawing.fingers):
            for part in finger.parts:
                name = f"{part.name}-finger-{k}-{self.count}"
                self.nodes.append(self._add(self._links[finger.link], part, name=name))
                colors.add(finger.link, self.nodes[-1], part.color)
                self._fingers.append((self.nodes[-1], finger))
        self.open(self.opened)
        if drawing.parts[-1]:
            hand = merged([placed(part.mesh, self._T_tool_last) for part in drawing.parts[-1]])
            ghost = Part(f"hand-{self.count}", hand, self._color)
            self.hand = [self._add(self._target, ghost, opacity=GHOST, visible=False)]

    def open(self, share: float) -> None:
        """Open the gripper to a share, from 0 (closed) to 1."""
        self.opened = share
        for node, finger in self._fingers:
            assign(node, *finger.place(share))
