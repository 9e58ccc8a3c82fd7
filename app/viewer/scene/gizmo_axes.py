"""Which arrows and rings the gizmo has: those motions of the target that the arm can follow in its task.

An arm of five joints matches a point and an approach direction, but not the roll about it: a ring for the roll
would be misleading. A SCARA arm turns its tool about the vertical and never tilts it. The possible motions are
read from the Jacobian: a motion is offered if it lies in the span of the joints' motions.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kin import Robot, Task, jacobian
from kin.transforms import Array

_SAMPLES = 9
_APPROACH_ROWS = 5  # rows of the tool-frame Jacobian that belong to the point and the approach direction


class GizmoAxes(NamedTuple):
    """Whether the gizmo has an arrow along, and a ring about, each of the tool's x, y and z axes."""

    arrows: tuple[bool, bool, bool]
    rings: tuple[bool, bool, bool]


@lru_cache(maxsize=256)
def gizmo_axes(robot: Robot, task: Task) -> GizmoAxes:
    """The motions that the arm can follow almost everywhere in this task, judged at a few configurations."""
    q = robot.random_q(np.random.default_rng(5), _SAMPLES)
    J = jacobian(robot, q, frame="tool")
    point, approach = J[:, :3], J[:, :_APPROACH_ROWS]
    arrows = (_follows(point, 0), _follows(point, 1), _follows(point, 2))
    if task == "position":
        return GizmoAxes(arrows, (False, False, False))
    roll = task == "pose" and _follows(J, 5)
    return GizmoAxes(arrows, (_follows(approach, 3), _follows(approach, 4), roll))


def _follows(J: Array, row: int) -> bool:
    """Whether the unit motion along one row lies in the span of most of the Jacobians ``(k, rows, n)``."""
    motion = np.zeros(J.shape[1])
    motion[row] = 1.0
    residuals = [motion - A @ np.linalg.lstsq(A, motion, rcond=1e-9)[0] for A in J]
    return bool(np.median(np.linalg.norm(residuals, axis=1)) < 1e-6)
