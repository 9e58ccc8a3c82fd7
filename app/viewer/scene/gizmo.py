"""Events of the gizmo, as they are posted, and motions of the target in fixed steps."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import viser

from app.viewer.panel import Post
from kin.transforms import Array, rotation_about, rotation_angle, wxyz_from_rotation
from kin.units import Units

# Steps of the target: of a drag with Shift, and of one press of a key (with Shift: a tenth and a fifth).
STEP, TURN = 0.01, math.radians(5.0)  # m, rad
FINE_STEP, FINE_TURN = 0.001, math.radians(1.0)
_SMALLEST = 1e-9
_TURNED = 1e-4  # rad; smaller turns are not said


class DragEvent(NamedTuple):
    """One event of the gizmo, or of a ring attached to it.

    Attributes:
        phase: start, update or end of a drag.
        position, wxyz: pose of the gizmo (m); of a ring, in the gizmo's frame.
        ring: whether it is a ring of its own.
    """

    phase: str
    position: list[float]
    wxyz: list[float]
    ring: bool


def listen(handle: viser.TransformControlsHandle, ring: bool, post: Post) -> None:
    """Post a `DragEvent`: ``"grab"`` when the gizmo is grabbed, ``"gizmo"`` when it is dragged or released.

    It is released where it was dragged last: viser's message of the release has no pose, and a step that began
    before the drag may have placed the handle since.
    """
    last: tuple[list[float], list[float]] | None = None

    @handle.on_update
    async def _(event: viser.TransformControlsEvent) -> None:
        nonlocal last
        if event.client is not None:
            gizmo = event.target
            pose = gizmo.position.tolist(), gizmo.wxyz.tolist()
            if event.phase == "end":
                pose = last or pose
            last = pose if event.phase == "update" else None
            key = "grab" if event.phase == "start" else "gizmo"  # the next event must not replace the start
            post(key, DragEvent(event.phase, *pose, ring))


def travel(start: Array, T: Array, units: Units) -> str:
    """How far a pose ``(4, 4)`` is from another one, and how far it is turned, for a label."""
    parts = [units.distance(math.dist(T[:3, 3].tolist(), start[:3, 3].tolist()))]
    w, *xyz = wxyz_from_rotation(start[:3, :3].T @ T[:3, :3]).tolist()
    angle = 2.0 * math.atan2(math.hypot(*xyz), w)  # as `rotation_angle`, in half of its time: once for each event
    if angle > _TURNED:
        parts.append(units.angle(angle))
        if parts[0] == units.distance(0.0):
            del parts[0]
    return "Δ " + " · ".join(parts)


def snapped(T: Array, start: Array, R_gizmo: Array) -> Array:
    """The pose ``(4, 4)`` nearest to `T` that is whole steps away from `start` along the gizmo's axes."""
    out = T.copy()
    moved = R_gizmo.T @ (T[:3, 3] - start[:3, 3])
    out[:3, 3] = start[:3, 3] + R_gizmo @ (np.round(moved / STEP) * STEP)
    angle = rotation_angle(T[:3, :3], start[:3, :3])
    if angle > _SMALLEST:
        axis = wxyz_from_rotation(T[:3, :3] @ start[:3, :3].T)[1:]
        out[:3, :3] = rotation_about(axis, round(angle / TURN) * TURN) @ start[:3, :3]
    return out


def nudged(T: Array, axis: int, turn: bool, amount: float, in_base: bool) -> Array:
    """`T` ``(4, 4)`` moved along (m), or turned about (rad), one axis of its own or of the base."""
    out = T.copy()
    direction = np.eye(3)[axis] if in_base else T[:3, axis]
    if turn:
        out[:3, :3] = rotation_about(direction, amount) @ T[:3, :3]
    else:
        out[:3, 3] += amount * direction
    return out
