"""What leads past a singularity that a line or an arc comes near: another posture, a shift of the path, a tilt.

The whole path is shifted across its direction, or the tool tilted about one of its own axes, by growing amounts
until the joints can follow it without slowing down; halving then finds the least. Each trial follows the poses
from the start as the planner does, at fewer places.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kin.axes import size
from kin.differential.metric import extent
from kin.differential.task import Task
from kin.ik import branch_names, branch_of, solve_ik
from kin.motion.details import Help
from kin.motion.geometry.chain import ROWS
from kin.motion.geometry.tracking import follow, settle
from kin.motion.tasks import CODES
from kin.robot import Robot
from kin.transforms import Array, rotation_about

_ENOUGH = 0.45  # of the usual speed: the planner notes a place at less than 0.4
_SHIFTS = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16)  # of the arm's reach
_TILTS = tuple(map(math.radians, (1.0, 2.0, 5.0, 10.0, 20.0, 30.0)))
_HALVINGS = 6
_STEP = 0.5  # rad or m between neighbouring places: a longer one is a jump
_NEAR = 1.0  # rad or m: as far may the start of a changed path be
_STILL = 1e-9  # a shorter step of the path is none
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Path:
    """Poses that an arm is to follow.

    Attributes:
        robot, task: the arm, and what it keeps of the poses.
        q: ``(n,)`` where it begins.
        poses: ``(k, 4, 4)``, at about even distances.
        velocity: ``(n,)`` the limits of the joints.
    """

    robot: Robot
    task: Task
    q: Array
    poses: Array
    velocity: Array

    def speeds(self, poses: Array, q_start: Array) -> Array | None:
        """How fast the joints allow each step along other poses ``(k − 1,)``; None: they cannot be followed."""
        robot, rows = self.robot, ROWS[CODES[self.task]]
        first, error = q_start[None].copy(), np.empty(1)
        settle(robot.model, poses[:1], rows, first, error)
        if error[0] > 1e-9 or np.abs(first[0] - q_start).max() > _NEAR:
            return None
        q = np.empty((len(poses), robot.n))
        q[0] = first[0]
        bounds = np.ascontiguousarray(np.stack([robot.lower, robot.upper]))
        s = lengths(robot, self.task, self.poses)
        if follow(robot.model, np.ascontiguousarray(poses), s, rows, bounds, _STEP, 1, q) < len(poses):
            return None
        if ((q < robot.lower - _STILL) | (q > robot.upper + _STILL)).any():
            return None
        slopes = np.abs(np.diff(q, axis=0)) / np.diff(s)[:, None]
        return np.asarray((self.velocity / np.maximum(slopes, 1e-12)).min(axis=1))

    def is_even(self, poses: Array, q_start: Array) -> bool:
        """Whether other poses can be followed without slowing down much anywhere."""
        speeds = self.speeds(poses, q_start)
        return speeds is not None and bool(speeds.min() >= _ENOUGH * np.median(speeds))


def lengths(robot: Robot, task: Task, poses: Array) -> Array:
    """How far along a path each pose is ``(k,)``: lengths as shares of the arm's size, and angles."""
    move = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / size(robot)
    turned = np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3]
    angle = np.linalg.norm(turned - np.eye(3), axis=(1, 2)) / math.sqrt(2.0)
    return np.concatenate([[0.0], np.cumsum(move + angle * (task != "position"))])


def path_of(robot: Robot, task: Task, q: Array, poses: Array, velocity: Array) -> Path | None:
    """The path through poses ``(k, 4, 4)``, without those that repeat the one before; None if one is left."""
    moves = np.concatenate([[True], np.diff(lengths(robot, task, poses)) > _STILL])
    return Path(robot, task, q, poses[moves], velocity) if moves.sum() > 2 else None


def detours(path: Path) -> tuple[Help, ...]:
    """The posture at the start, the least shift and the least tilt with which the path is even."""
    found = [another_posture(path), least_shift(path), least_tilt(path)]
    return tuple(help_ for help_ in found if help_ is not None)


def another_posture(path: Path) -> Help | None:
    """Another posture at the start from which the path is even."""
    others = solve_ik(path.robot, path.poses[0], q_seed=path.q, task=path.task).solutions
    for other in others:
        if np.abs(other.q - path.q).max() > _SAME and path.is_even(path.poses, other.q):
            return Help("posture", branch_of(path.robot, other.q) if branch_names(path.robot) else None)
    return None


def least_shift(path: Path) -> Help | None:
    """The least shift of the whole path across its direction."""
    along = path.poses[-1, :3, 3] - path.poses[0, :3, 3]
    across = np.eye(3) if np.linalg.norm(along) < _STILL else np.linalg.svd(along[None])[2][1:]
    turns = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
    ahead = np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1]

    def shifted(vector: Array) -> Array:
        poses = path.poses.copy()
        poses[:, :3, 3] += vector
        return poses

    vector = _least(path, shifted, ahead, [share * extent(path.robot) for share in _SHIFTS])
    return None if vector is None else Help("shift", None, _triple(vector))


def least_tilt(path: Path) -> Help | None:
    """The least turn of the tool about one of its own axes, the same all along the path."""
    if path.task == "position":
        return None
    axes = np.eye(3)[: 3 if path.task == "pose" else 2]

    def tilted(vector: Array) -> Array:
        angle = float(np.linalg.norm(vector))
        poses = path.poses.copy()
        poses[:, :3, :3] = poses[:, :3, :3] @ rotation_about(vector / angle, angle)
        return poses

    vector = _least(path, tilted, np.concatenate([axes, -axes]), _TILTS)
    return None if vector is None else Help("tilt", None, _triple(vector))


def _least(path: Path, changed: Callable[[Array], Array], ahead: Array, sizes: Sequence[float]) -> Array | None:
    """The shortest vector ``(3,)`` along one of the directions ``(k, 3)`` with which the changed path is even."""
    below = 0.0
    for most in sizes:
        good = [each for each in ahead if path.is_even(changed(most * each), path.q)]
        if good:
            return min((_halved(path, changed, each, below, most) for each in good), key=np.linalg.norm)
        below = most
    return None


def _halved(path: Path, changed: Callable[[Array], Array], ahead: Array, low: float, high: float) -> Array:
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if path.is_even(changed(middle * ahead), path.q):
            high = middle
        else:
            low = middle
    return high * ahead


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = (vector + 0.0).tolist()
    return x, y, z
