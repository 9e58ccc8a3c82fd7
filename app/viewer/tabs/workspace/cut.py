"""Cutting a cloud open.

A browser cannot hide single points of a cloud, and sending millions of points for each step of a slider takes
seconds. So a cut cloud is sent once more, sorted into slabs perpendicular to the cut. From then on the slider only
hides and shows slabs, with one tiny message per slab. A slab is as thick as a step of the slider, so the visible
part ends exactly where the slider says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.viewer.tabs.workspace.colours import SAMPLES, Bytes, axis_of_joint_1
from kin import Robot, fk
from kin.transforms import Array
from kin.workspace import workspace_slice

Axis = Literal["x", "y", "z", "arm"]
Keep = Literal["below", "above", "slice"]
AXES: dict[str, Axis] = {"across x": "x", "across y": "y", "across z (level)": "z", "along the arm": "arm"}
KEEP: dict[str, Keep] = {"one side": "below", "other side": "above", "thin slice": "slice"}
MAX_SLABS = 50


@dataclass(frozen=True)
class Cut:
    """Slabs of equal thickness along a unit normal.

    Attributes:
        normal: of the cut, in the base frame.
        low: start of the first slab (m along the normal from the base's origin).
        step: thickness (m).
        count: number of slabs. Points beyond the ends belong to the first or last slab.
    """

    normal: tuple[float, float, float]
    low: float
    step: float
    count: int

    @property
    def high(self) -> float:
        """End of the last slab."""
        return self.low + self.step * self.count

    @property
    def middle(self) -> float:
        """The initial position: at the base's origin if there is enough on both sides, else in the middle."""
        edge = round(-self.low / self.step)
        if not 0.2 * self.count <= edge <= 0.8 * self.count:
            edge = self.count // 2
        return self.low + self.step * edge

    def slabs(self, points: NDArray[np.float32]) -> Bytes:
        """The slab ``(k,)`` of each point ``(k, 3)``."""
        along = (points @ np.array(self.normal, dtype=np.float32) - np.float32(self.low)) / np.float32(self.step)
        return np.asarray(np.clip(along, 0.0, self.count - 1.0).astype(np.uint8))

    def shown(self, at: float, keep: Keep) -> NDArray[np.bool_]:
        """Which slabs ``(count,)`` are visible with the cut at `at` (m along the normal)."""
        edge = round((at - self.low) / self.step)
        slabs = np.arange(self.count)
        if keep == "slice":
            return np.asarray(slabs == min(max(edge, 0), self.count - 1))
        return np.asarray(slabs < edge if keep == "below" else slabs >= edge)


def cut_of(robots: Sequence[Robot], axis: Axis, q: Array) -> Cut:
    """Slabs that contain these robots' workspaces: across a base axis, or along the plane of the first one at q.

    That plane contains joint 1's axis and the tool; the cut's normal points to the left of the arm.
    """
    normal = _arm_normal(robots[0], q) if axis == "arm" else np.eye(3)["xyz".index(axis)]
    clouds = (workspace_slice(robot, SAMPLES, 0, SAMPLES, strategy="quasi") for robot in robots)
    along = np.concatenate([cloud.points @ normal for cloud in clouds])
    low, high = float(along.min()), float(along.max())
    step = nice_step(max(high - low, 1e-3) / (MAX_SLABS - 2))
    first, last = math.floor(low / step), math.ceil(high / step)
    return Cut(tuple(float(v) for v in normal), first * step, step, max(last - first, 1))  # type: ignore[arg-type]


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, … mm that is not below `least` (m)."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= least * (1.0 - 1e-9))


def _arm_normal(robot: Robot, q: Array) -> Array:
    point, axis = axis_of_joint_1(robot)
    T = fk(robot, q)
    # A tool on the axis is in every such plane: then take the plane of the approach direction, or any.
    for ahead in (T[:3, 3] - point, T[:3, 2], np.eye(3)[0], np.eye(3)[1]):
        normal = np.cross(axis, ahead)
        length = float(np.linalg.norm(normal))
        if length > 1e-6:
            break
    return np.asarray(normal / length)
