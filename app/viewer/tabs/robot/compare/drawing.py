"""Two arms over each other: the reference as a ghost at the joint values of the arm on show, one axis of both."""

from __future__ import annotations

from app.viewer.declared.scene import Node
from app.viewer.lessons.figure_nodes import FigureNodes
from app.viewer.lessons.figure_shapes import BLUE, VERMILION
from app.viewer.scene.chain import link_poses
from app.viewer.scene.meshes import body
from app.viewer.skeleton import ghost
from kin import Robot
from kin.axes import inverse
from kin.comparison import Comparison
from kin.comparison.frames import Mapping, no_mapping
from kin.transforms import Array, wxyz_from_rotation

GHOST = VERMILION
OPACITY = 0.5
REACH = 0.3  # of an axis to both sides, relative to the radius of the sphere around the arm


class Overlay:
    """A ghost of `other` over the arm `shown`, as a comparison has found them.

    Different arms are laid over each other joint by joint: joints that the other one does not have, or of another
    kind, stay at its home.
    """

    def __init__(self, other: Robot, shown: Robot, found: Comparison) -> None:
        self.found, self._other, self._shown = found, other, shown
        self._mapping = mapping_of(found, shown.n)
        self._base = inverse(self._mapping.base)
        self._figure = FigureNodes(body(shown).size)

    def nodes(self, q: Array, joint: int) -> list[Node]:
        """Both arms with the arm on show at `q` ``(n,)``, and the axes of one joint."""
        base, reach = self._base, REACH * body(self._shown).radius
        there = ghost_q(self._other, self._shown, self._mapping, q)
        copy = ghost("ghost", self._other, there, GHOST, OPACITY)
        copy.position, copy.wxyz = base[:3, 3], wxyz_from_rotation(base[:3, :3])
        nodes = [copy]
        with self._figure as figure:
            if joint < self._shown.n:
                T = link_poses(self._shown, q[None])[0, joint + 1]
                nodes += figure.axis("yours", T[:3, 3], T[:3, 2], reach, f"{joint + 1}: yours", BLUE)
            if joint < self._other.n:
                T = base @ link_poses(self._other, there[None])[0, joint + 1]
                nodes += figure.axis("other", T[:3, 3], -T[:3, 2], reach, f"{joint + 1}: the other", GHOST)
        return nodes


def ghost_q(other: Robot, shown: Robot, mapping: Mapping, q: Array) -> Array:
    """The configuration ``(m,)`` of the other arm for one ``(n,)`` of the arm on show."""
    found = other.q_home.copy()
    for i in range(min(other.n, shown.n)):
        if other.joints[i].kind == shown.joints[i].kind:
            found[i] = mapping.signs[i] * (q[i] - mapping.offsets[i])
    return found


def mapping_of(found: Comparison, n: int) -> Mapping:
    """How the arm on show, with n joints, is laid over the other one.

    Of different arms as the likeliest explanation lays it, so that equal parts cover each other.
    """
    if found.mapping is not None:
        return found.mapping
    for explanation in found.explanations[:1]:
        if len(explanation.mapping.signs) == n and found.first is not None and found.first.quantity != "count":
            return explanation.mapping
    return no_mapping(n)
