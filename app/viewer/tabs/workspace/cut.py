"""Cutting a cloud open.

A browser cannot cut points away, and sending some millions of them anew for each step of a slider takes seconds.
So a cloud that is cut is sent once more, sorted into slabs square to the cut, and from then on the slider only
hides and shows slabs: one tiny message for each slab that it passes. Slabs are as thick as the slider's steps, so
what is shown ends where the slider says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.viewer.tabs.workspace.colours import LOOKED_AT, Bytes, line
from kin import Robot, fk, workspace_slice
from kin.transforms import Array

Axis = Literal["x", "y", "z", "arm"]
Keep = Literal["below", "above", "slice"]
AXES: dict[str, Axis] = {"across x": "x", "across y": "y", "across z (level)": "z", "along the arm": "arm"}
KEEP: dict[str, Keep] = {"one side": "below", "other side": "above", "thin slice": "slice"}
MOST = 50  # slabs


@dataclass(frozen=True)
class Cut:
    """Slabs of equal thickness along a unit normal.

    Attributes:
        normal: of the cut, in the base frame.
        low: where the first slab begins (m along the normal from the base's origin).
        step: thickness (m).
        count: how many there are. What lies beyond the ends belongs to the slab at the end.
    """

    normal: tuple[float, float, float]
    low: float
    step: float
    count: int

    @property
    def high(self) -> float:
        """Where the last slab ends."""
        return self.low + self.step * self.count

    @property
    def middle(self) -> float:
        """Where to begin: through the base's origin if that leaves something on both sides, else in the middle."""
        edge = round(-self.low / self.step)
        if not 0.2 * self.count <= edge <= 0.8 * self.count:
            edge = self.count // 2
        return self.low + self.step * edge

    def slabs(self, points: NDArray[np.float32]) -> Bytes:
        """The slab ``(k,)`` each point ``(k, 3)`` is in."""
        along = (points @ np.array(self.normal, dtype=np.float32) - np.float32(self.low)) / np.float32(self.step)
        return np.asarray(np.clip(along, 0.0, self.count - 1.0).astype(np.uint8))

    def shown(self, at: float, keep: Keep) -> NDArray[np.bool_]:
        """Which slabs ``(count,)`` are seen with the cut at `at` (m along the normal)."""
        edge = round((at - self.low) / self.step)
        slabs = np.arange(self.count)
        if keep == "slice":
            return np.asarray(slabs == min(max(edge, 0), self.count - 1))
        return np.asarray(slabs < edge if keep == "below" else slabs >= edge)


def cut_of(robots: Sequence[Robot], axis: Axis, q: Array) -> Cut:
    """Slabs that hold these arms' workspaces: across a base axis, or along the upright plane the first is in at q.

    That plane holds joint 1's line and the tool; the cut's normal points to the left of the arm.
    """
    normal = _beside(robots[0], q) if axis == "arm" else np.eye(3)["xyz".index(axis)]
    clouds = (workspace_slice(robot, LOOKED_AT, 0, LOOKED_AT, strategy="quasi") for robot in robots)
    along = np.concatenate([cloud.points @ normal for cloud in clouds])
    low, high = float(along.min()), float(along.max())
    step = nice_step(max(high - low, 1e-3) / (MOST - 2))
    first, last = math.floor(low / step), math.ceil(high / step)
    return Cut(tuple(float(v) for v in normal), first * step, step, max(last - first, 1))  # type: ignore[arg-type]


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, … mm that is not below `least` (m)."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))


def _beside(robot: Robot, q: Array) -> Array:
    point, axis = line(robot)
    T = fk(robot, q)
    # A tool on the line itself is in every upright plane: then the one it points along, or any.
    for ahead in (T[:3, 3] - point, T[:3, 2], np.eye(3)[0], np.eye(3)[1]):
        normal = np.cross(axis, ahead)
        length = float(np.linalg.norm(normal))
        if length > 1e-6:
            break
    return np.asarray(normal / length)
