"""Fingers of a gripper: parts beside the way to the tool, which one slider opens and closes.

No row of the table moves them, and no pose depends on them. They are drawn as the file has them, in the
coordinates of the link that carries them. How far the gripper is open is one share for all of them, from 0
(closed) to 1 (open), as fingers that follow one motor are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from app.viewer.scene.bodies.parts import Part
from kin.transforms import Array, pose_from_position_wxyz, wxyz_from_rotation


@dataclass(frozen=True, eq=False)
class Finger:
    """Parts that move together when the gripper opens.

    Attributes:
        link: that carries them, 0 for the base.
        parts: in the coordinates of that link, as they are drawn.
        T_link_axis: frame ``(4, 4)`` along whose z axis they slide, or about which they turn.
        slides: whether they slide.
        closed, open: how far they are from where they are drawn when the gripper is closed and open, m or rad.
        on: the part of the finger that carries them; None: they are on the link.
    """

    link: int
    parts: tuple[Part, ...]
    T_link_axis: Array
    slides: bool
    closed: float
    open: float
    on: Finger | None = None

    def place(self, share: float) -> tuple[Array, Array]:
        """Position ``(3,)`` and wxyz ``(4,)`` of the parts in the link with the gripper open to a share."""
        if self.on is None:
            return self._own_place(share)
        T = pose_from_position_wxyz(*self.on.place(share)) @ pose_from_position_wxyz(*self._own_place(share))
        return T[:3, 3], wxyz_from_rotation(T[:3, :3])

    def _own_place(self, share: float) -> tuple[Array, Array]:
        value = self.closed + share * (self.open - self.closed)
        z, origin = self.T_link_axis[:3, 2], self.T_link_axis[:3, 3]
        if self.slides:
            return value * z, np.array([1.0, 0.0, 0.0, 0.0])
        c, s = math.cos(value), math.sin(value)
        turned = c * origin + s * np.cross(z, origin) + (1.0 - c) * (z @ origin) * z
        return origin - turned, np.array([math.cos(value / 2), *(math.sin(value / 2) * z)])

    def moved(self, parts: tuple[Part, ...], T: Array) -> Finger:
        """The same in another frame of the link, with parts that have been moved there by `T` ``(4, 4)``."""
        on = None if self.on is None else self.on.moved((), T)
        return replace(self, parts=parts, T_link_axis=T @ self.T_link_axis, on=on)
