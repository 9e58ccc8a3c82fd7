"""Two arms over each other: the reference as a ghost at the joint values of the arm on show, one axis of both."""

from __future__ import annotations

from itertools import count

import numpy as np
import viser

from app.viewer.lessons.figure_shapes import BLUE, VERMILION
from app.viewer.lessons.figures import Figure
from app.viewer.scene.chain import link_poses
from app.viewer.scene.meshes import body
from app.viewer.skeleton import cylinder, places, skeleton
from kin import Comparison, Robot
from kin.axes import inverse
from kin.comparison import Mapping
from kin.comparison.frames import no_mapping
from kin.transforms import Array, wxyz_from_rotation

GHOST = VERMILION
OPACITY = 0.5
REACH = 0.3  # of an axis to both sides, relative to the radius of the sphere around the arm
_NUMBERS = count(1)


class Overlay:
    """A ghost of `other` over the arm `shown`; the visitor's worker calls it.

    Different arms are laid over each other joint by joint: joints that the other one does not have, or of another
    kind, stay at its home.
    """

    def __init__(self, scene: viser.SceneApi, other: Robot, shown: Robot, found: Comparison) -> None:
        self._other, self._shown = other, shown
        self._mapping = mapping_of(found, shown.n)
        self._reach = REACH * body(shown).radius
        root = f"/compare-{next(_NUMBERS)}"
        base = inverse(self._mapping.base)
        self._base = base
        self._top = scene.add_frame(
            root, show_axes=False, position=base[:3, 3], wxyz=wxyz_from_rotation(base[:3, :3])
        )
        bones, (vertices, faces) = skeleton(other), cylinder()
        many = len(bones.links)
        self._ghost = scene.add_batched_meshes_simple(
            f"{root}/ghost", vertices, faces, batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (many, 1)),
            batched_positions=np.zeros((many, 3)), batched_scales=bones.scales, batched_colors=GHOST,
            opacity=OPACITY, lod="off", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._figure = Figure(scene, f"{root}-axes", body(shown).size)
        self._axes = self._figure.line("yours", BLUE), self._figure.line("the other", GHOST)

    def show(self, q: Array, joint: int) -> None:
        """Draw both arms with the arm on show at `q` ``(n,)``, and the axes of one joint."""
        there = ghost_q(self._other, self._shown, self._mapping, q)
        positions, wxyz, _ = places(self._other, there[None])
        self._ghost.batched_positions = positions[0].astype(np.float32)
        self._ghost.batched_wxyzs = wxyz[0].astype(np.float32)
        mine, other = self._axes
        if joint < self._shown.n:
            T = link_poses(self._shown, q[None])[0, joint + 1]
            mine.show_axis(T[:3, 3], T[:3, 2], self._reach, f"{joint + 1}: yours")
        if joint < self._other.n:
            T = self._base @ link_poses(self._other, there[None])[0, joint + 1]
            other.show_axis(T[:3, 3], -T[:3, 2], self._reach, f"{joint + 1}: the other")

    def remove(self) -> None:
        """Remove everything from the scene."""
        self._top.remove()
        self._figure.remove()


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
