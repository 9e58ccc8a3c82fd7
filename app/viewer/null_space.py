"""Null space of an arm's task at one configuration, and motions in it, by the Jacobian alone.

It serves every arm: where the core has a closed form, the parameters of :mod:`app.viewer.self_motion` are exact;
here the joints follow ``q̇ = J⁺v + (I − J⁺J) z``, and Newton's method corrects what a finite step misses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from kin import Redundancy, Robot, Task, fk, jacobian
from kin.axes import NEARLY, size
from kin.transforms import Array, rotation_angle, wxyz_from_rotation

Goal = Literal["limits", "manipulability"]
SINGULAR = 1e-9  # of the largest singular value
TOLERANCE = 1e-10  # m and rad; how exactly the task is held
SMOOTH = 0.6  # rad or m of a joint; a larger correction is a jump
FAST = 0.08  # rad or m of any joint in one step
_ITERATIONS = 12
_STEP = 1e-5  # rad or m, for the gradient
_TAKES_PART, _MOVES = 1e-6, 1e-3  # least share of a joint in the null space: to be led, to be offered
_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class NullSpace:
    """Task Jacobian ``(m, n)`` at a configuration, and what follows from its singular values.

    Attributes:
        rank: singular values that are zero for the rounding of a table only count as zero, see `usual_rank`.
        pinv: pseudoinverse J⁺ ``(n, m)``.
        basis: ``(n, n − rank)`` joint speeds that do not move the task, orthonormal columns.
    """

    J: Array
    rank: int
    pinv: Array
    basis: Array

    def project(self, z: Array) -> Array:
        """``(I − J⁺J) z``: the part of joint speeds ``(n,)`` that does not move the task."""
        return np.asarray(self.basis @ (self.basis.T @ z))


def task_rows(robot: Robot, q: Array, task: Task) -> Array:
    """The rows of the Jacobian that a task is about ``(..., m, n)``, in the base frame.

    All six; the velocity of the tool point alone; or this and the turning about the tool's x and y.
    """
    J = jacobian(robot, q)
    if task == "pose":
        return J
    if task == "position":
        return J[..., :3, :]
    R_T = np.swapaxes(fk(robot, q)[..., :3, :2], -1, -2)
    return np.concatenate([J[..., :3, :], R_T @ J[..., 3:, :]], axis=-2)


def null_space(robot: Robot, q: Array, task: Task, locked: Sequence[int] = ()) -> NullSpace:
    """The null space of a task at q ``(n,)``, of the joints that are not locked."""
    J = task_rows(robot, q, task)
    J[:, list(locked)] = 0.0
    weight = _weight(robot, len(J))
    U, s, Vt = np.linalg.svd(weight[:, None] * J)
    rank = min(_above(s, SINGULAR), usual_rank(robot, task, tuple(locked)))
    pinv = (Vt[:rank].T / s[:rank]) @ U[:, :rank].T * weight
    basis = Vt[rank:].T
    if locked:
        still = np.eye(robot.n)[:, list(locked)]
        basis = np.linalg.svd(np.concatenate([Vt[:rank], still.T]))[2][rank + len(locked) :].T
    return NullSpace(J, rank, pinv, basis)


@lru_cache(maxsize=256)
def usual_rank(robot: Robot, task: Task, locked: tuple[int, ...] = ()) -> int:
    """The rank of the task's Jacobian almost everywhere; what is zero but for typed digits counts as zero."""
    J = task_rows(robot, robot.random_q(np.random.default_rng(2), _SAMPLES), task)
    J[..., list(locked)] = 0.0
    values = np.linalg.svd(_weight(robot, J.shape[-2])[:, None] * J, compute_uv=False)
    return max(_above(s, NEARLY) for s in values)


def free_motions(robot: Robot, task: Task, locked: tuple[int, ...] = ()) -> int:
    """The dimension of the null space almost everywhere."""
    return robot.n - len(locked) - usual_rank(robot, task, locked)


def _weight(robot: Robot, rows: int) -> Array:
    """Factors of the rows ``(m,)``: lengths as shares of the arm's size, so that metres and radians compare."""
    weight = np.ones(rows)
    weight[:3] = 1.0 / size(robot)
    return weight


def _above(values: Array, share: float) -> int:
    """How many singular values, descending, are more than a share of the largest."""
    return int((values > share * values[0]).sum()) if len(values) else 0


def measure(robot: Robot, q: Array, task: Task, rank: int) -> Array:
    """Manipulability of a task ``(...)`` at ``(..., n)``: the product of its largest `rank` singular values."""
    values = np.linalg.svd(task_rows(robot, q, task), compute_uv=False)
    return np.asarray(np.prod(values[..., :rank], axis=-1))


def secondary(robot: Robot, q: Array, task: Task, goal: Goal) -> Array:
    """Joint speeds z ``(n,)`` that serve a goal: the direction of steepest improvement, not yet projected.

    ``limits``: −∇ ½Σ((q − middle)/half range)². ``manipulability``: ∇ ln w, with w of the task.
    """
    if goal == "limits":
        half = 0.5 * (robot.upper - robot.lower)
        bounded = np.isfinite(half)
        middle = np.where(bounded, 0.5 * (robot.lower + robot.upper), 0.0)
        return np.asarray(np.where(bounded, (middle - q) / np.where(bounded, half, 1.0) ** 2, 0.0))
    rank = null_space(robot, q, task).rank
    near = q + _STEP * np.concatenate([np.eye(robot.n), -np.eye(robot.n)])
    w = np.log(np.maximum(measure(robot, near, task, rank), 1e-300))
    return np.asarray((w[: robot.n] - w[robot.n :]) / (2.0 * _STEP))


def margin(robot: Robot, q: Array) -> float:
    """The smallest distance to a joint limit as a share of half the range, 0 to 1; 1 without limits."""
    half = 0.5 * (robot.upper - robot.lower)
    room = np.minimum(q - robot.lower, robot.upper - q)
    shares = [r / h for r, h in zip(room.tolist(), half.tolist(), strict=True) if math.isfinite(h) and h > 0.0]
    return float(min(shares, default=1.0))


def error(robot: Robot, q: Array, T_held: Array, task: Task) -> Array:
    """What is missing to the held pose ``(4, 4)``, in the rows of the task ``(m,)``: metres and radians."""
    T = fk(robot, q)
    way = T_held[:3, 3] - T[:3, 3]
    if task == "position":
        return np.asarray(way)
    if task == "approach":
        axis = np.cross(T[:3, 2], T_held[:3, 2])
        sine, cosine = float(np.linalg.norm(axis)), float(T[:3, 2] @ T_held[:3, 2])
        turn = axis * (math.atan2(sine, cosine) / sine if sine > 0.0 else 1.0)
        return np.concatenate([way, T[:3, :2].T @ turn])
    angle = rotation_angle(T_held[:3, :3], T[:3, :3])
    axis = wxyz_from_rotation(T_held[:3, :3] @ T[:3, :3].T)[1:]
    length = float(np.linalg.norm(axis))
    return np.concatenate([way, axis * (angle / length) if length > 0.0 else np.zeros(3)])


def hold(robot: Robot, q: Array, T_held: Array, task: Task, locked: Sequence[int] = ()) -> Array | None:
    """The configuration near q ``(n,)`` that holds the task exactly; None if Newton's method finds none nearby."""
    return _newton(robot, q, T_held, task, locked, None)


def lead(
    robot: Robot, q: Array, T_held: Array, task: Task, joint: int, value: float, locked: Sequence[int] = ()
) -> Array | None:
    """The configuration near q ``(n,)`` that holds the task with one joint at a value; None if none is nearby.

    Configurations outside the limits of the joints are none.
    """
    found = _newton(robot, q, T_held, task, locked, (joint, value))
    if found is None or (found < robot.lower - 1e-9).any() or (found > robot.upper + 1e-9).any():
        return None
    return np.clip(found, robot.lower, robot.upper)


def within(robot: Robot, q: Array, task: Task, joint: int, value: float, locked: Sequence[int] = ()) -> float:
    """The value nearest to the wanted one to which a joint leads while no joint moves more than `FAST`."""
    basis = null_space(robot, q, task, locked).basis
    along = basis @ basis[joint]
    share = float(along[joint])
    if share < _TAKES_PART:
        return float(q[joint])
    most = FAST * share / float(np.abs(along).max())
    return float(q[joint] + min(max(value - q[joint], -most), most))


def _newton(
    robot: Robot,
    q: Array,
    T_held: Array,
    task: Task,
    locked: Sequence[int],
    given: tuple[int, float] | None,
) -> Array | None:
    """Minimum-norm Newton steps for the task and, if one is given, the value of a joint."""
    start, q = q, q.copy()
    for _ in range(_ITERATIONS):
        missing = error(robot, q, T_held, task)
        apart = 0.0 if given is None else given[1] - q[given[0]]
        if max(float(np.abs(missing).max()), abs(apart)) < TOLERANCE:
            return q if float(np.abs(q - start).max()) < SMOOTH else None
        space = null_space(robot, q, task, locked)
        step = space.pinv @ missing
        if given is not None:
            along = space.basis @ space.basis[given[0]]
            share = float(along[given[0]])
            if share < _TAKES_PART:
                return None
            step = step + along * (apart - step[given[0]]) / share
        q = q + step
        if float(np.abs(q - start).max()) > 4.0 * SMOOTH:
            return None
    return None


def leaders(robot: Robot, q: Array, task: Task, locked: tuple[int, ...] = ()) -> tuple[Redundancy, ...]:
    """The revolute joints that take part in the null space at q ``(n,)``, as parameters that can be given a value.

    Without a closed form nobody knows the feasible range: it is that of the joint's own limits.
    """
    if not free_motions(robot, task, locked):
        return ()
    basis = null_space(robot, q, task, locked).basis
    found = []
    for i in np.flatnonzero(robot.revolute & (np.linalg.norm(basis, axis=1) > _MOVES)).tolist():
        low, high = float(robot.lower[i]), float(robot.upper[i])
        ends = (low, high) if math.isfinite(high - low) else (-math.pi, math.pi)
        found.append(Redundancy(f"theta{i + 1}", f"θ{i + 1}", float(q[i]), (ends,)))
    return tuple(found)
