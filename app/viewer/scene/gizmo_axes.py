"""Which arrows and rings the gizmo has: those motions of the target that the arm can follow in its task.

An arm of five joints matches a point and an approach direction, but not the roll about it: a ring for the roll
would be misleading. A SCARA arm turns its tool about the vertical and never tilts it. The possible motions are
read from the Jacobian: a motion is offered if it lies in the span of the joints' motions.

The gizmo is aligned with the tool or with the base. About a fixed direction, a turn changes approach and roll in
proportions that depend on the configuration; it is offered if the arm can follow the change of the approach.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kin import Robot, fk, jacobian
from kin.ik import Task
from kin.transforms import Array

_SAMPLES = 9
_TILT = 0.1  # a turn that tilts the tool by less than this part of its angle is a roll
_APPROACH_ROWS = 5  # rows of the tool-frame Jacobian that belong to the point and the approach direction


class GizmoAxes(NamedTuple):
    """Whether the gizmo has an arrow along, and a ring about, each of its x, y and z axes."""

    arrows: tuple[bool, bool, bool]
    rings: tuple[bool, bool, bool]


NO_AXES = GizmoAxes((False, False, False), (False, False, False))


@lru_cache(maxsize=256)
def gizmo_axes(robot: Robot, task: Task, in_base: bool = False) -> GizmoAxes:
    """The motions that the arm can follow almost everywhere in this task, judged at a few configurations.

    `in_base`: the gizmo is aligned with the base, not with the tool.
    """
    q = robot.random_q(np.random.default_rng(5), _SAMPLES)
    if in_base:
        return _base_axes(robot, task, q)
    J = jacobian(robot, q, frame="tool")
    point, approach = J[:, :3], J[:, :_APPROACH_ROWS]
    arrows = (_follows(point, 0), _follows(point, 1), _follows(point, 2))
    if task == "position":
        return GizmoAxes(arrows, (False, False, False))
    roll = task == "pose" and _follows(J, 5)
    return GizmoAxes(arrows, (_follows(approach, 3), _follows(approach, 4), roll))


def _base_axes(robot: Robot, task: Task, q: Array) -> GizmoAxes:
    point = jacobian(robot, q)[:, :3]
    arrows = (_follows(point, 0), _follows(point, 1), _follows(point, 2))
    if task == "position":
        return GizmoAxes(arrows, (False, False, False))
    J, R = jacobian(robot, q, frame="tool"), fk(robot, q)[:, :3, :3]
    rings = []
    for axis in range(3):
        twist = np.concatenate([np.zeros((len(q), 3)), R[:, axis]], axis=1)  # in the tool's frame
        approach = twist[:, :_APPROACH_ROWS]
        tilts = np.median(np.linalg.norm(approach, axis=1)) > _TILT
        rings.append(_follow(J, twist) or bool(tilts and _follow(J[:, :_APPROACH_ROWS], approach)))
    return GizmoAxes(arrows, (rings[0], rings[1], rings[2]))


def _follows(J: Array, row: int) -> bool:
    """Whether the unit motion along one row lies in the span of most of the Jacobians ``(k, rows, n)``."""
    motion = np.zeros(J.shape[:2])
    motion[:, row] = 1.0
    return _follow(J, motion)


def _follow(J: Array, motions: Array) -> bool:
    """Whether most of the motions ``(k, rows)`` lie in the span of their Jacobians ``(k, rows, n)``."""
    pairs = zip(J, motions, strict=True)
    residuals = [motion - A @ np.linalg.lstsq(A, motion, rcond=1e-9)[0] for A, motion in pairs]
    return bool(np.median(np.linalg.norm(residuals, axis=1)) < 1e-6)
