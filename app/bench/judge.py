"""Checks of contestants: every answer is compared with forward kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import kin
from app.bench.capsules import distances, touches_between
from app.bench.rows import Task
from kin.robot import Robot
from kin.transforms import Array

ACCURACY = 1e-6
"""Metres and radians; answers with a larger error do not count. Closed forms stay a million times below."""
SAME = 1e-6
"""Radians, modulo whole turns and joint by joint, within which two solutions are equal."""


@dataclass(frozen=True, slots=True)
class Check:
    """Errors and counts over all targets.

    Attributes:
        success: share of targets with at least one correct answer.
        branches: correct and distinct answers per target, on average; None for forward kinematics.
        position_error, rotation_error: largest errors of the correct answers, metres and radians.
        wrong: answers per target with an error above `ACCURACY`.
        same: share of targets with the same set of branches as ours, or the same verdict; None where there is
            nothing to compare.
        recall: share of targets at which the configuration they were made from is among the correct answers; None
            where one answer is enough.
    """

    success: float
    branches: float | None
    position_error: float
    rotation_error: float
    wrong: float
    same: float | None
    recall: float | None = None


def judge_poses(task: Task, poses: list[Array]) -> Check:
    """Forward kinematics: poses ``(4, 4)`` or positions ``(3,)``, one per target, against matrix products."""
    position, rotation = 0.0, 0.0
    right = 0
    for got, T in zip(poses, task.T, strict=True):
        if got.shape == (3,):
            p, r = float(np.linalg.norm(got - T[:3, 3])), 0.0
        else:
            p, r = float(np.linalg.norm(got[:3, 3] - T[:3, 3])), float(_angle(got[None], T)[0])
        if max(p, r) <= ACCURACY:
            right += 1
            position, rotation = max(position, p), max(rotation, r)
    count = len(task.T)
    return Check(right / count, None, position, rotation, (count - right) / count, None)


def judge_distances(task: Task, answers: list[Array]) -> Check:
    """Distances between links, one per configuration, against plain numpy."""
    error = np.abs(np.array(answers) - distances(task.robot, task.q))
    right, count = error <= ACCURACY, len(task.q)
    success = float(right.mean())
    return Check(success, None, float(error[right].max(initial=0.0)), 0.0, float((~right).sum()) / count, None)


def judge_verdicts(task: Task, answers: list[Array], arm: Robot | None) -> Check:
    """Whether something touches, one verdict per target, against plain numpy with the bodies of `arm`."""
    right, count = np.array(answers) == touching(task, arm or task.robot), len(task.q)
    return Check(float(right.mean()), None, 0.0, 0.0, float((~right).sum()) / count, None)


@lru_cache(maxsize=8)
def touching(task: Task, arm: Robot) -> NDArray[np.bool_]:
    """Whether something touches at each target ``(N,)``, with the bodies of `arm`, by plain numpy."""
    if task.ends is None:
        return np.asarray(distances(arm, task.q, task.obstacles) < 0.0)
    return touches_between(arm, task.q, task.ends, task.obstacles)


def judge_motions(task: Task, motions: list[Array], limits: Array) -> Check:
    """Motions as values and derivatives ``(d, k, n)``, one per target: at rest at both ends, within the limits.

    Args:
        task, motions: the targets, and what leads to them from home.
        limits: ``(n, 3)``, of the first three derivatives.
    """
    right, worst = 0, 0.0
    for got, q in zip(motions, task.q, strict=True):
        miss = max(float(np.abs(got[0, 0] - task.robot.q_home).max()), float(np.abs(got[0, -1] - q).max()))
        moving = float(np.abs(got[1][[0, -1]]).max())
        peaks = np.abs(got[1:]).max(axis=1) / limits.T[: len(got) - 1]
        if max(miss, moving) <= ACCURACY and peaks.max() <= 1.0 + ACCURACY:
            right += 1
            worst = max(worst, miss)
    return Check(right / len(task.q), None, worst, 0.0, (len(task.q) - right) / len(task.q), None)


def right_sets(task: Task, answers: list[Array]) -> tuple[list[Array], Check]:
    """The correct and distinct answers ``(k, n)`` of each target, and their check without `same`."""
    kept: list[Array] = []
    position, rotation, wrong = 0.0, 0.0, 0
    for got, T in zip(answers, task.T, strict=True):
        q = np.asarray(got, dtype=np.float64).reshape(-1, task.robot.n)
        q = np.ascontiguousarray(q[np.isfinite(q).all(axis=1)])
        if not len(q):
            kept.append(q)
            continue
        poses = kin.fk(task.robot, q)
        p = np.linalg.norm(poses[:, :3, 3] - T[:3, 3], axis=1)
        r = _tilt(poses, T) if task.row.approach else _angle(poses, T)
        good = (p <= ACCURACY) & (r <= ACCURACY)
        if task.row.kind == "answer":
            good &= task.robot.in_limits(q, slack=1e-9)
        wrong += int((~good).sum())
        if good.any():
            position, rotation = max(position, float(p[good].max())), max(rotation, float(r[good].max()))
        kept.append(_distinct(q[good]))
    count = len(task.T)
    success = sum(len(q) > 0 for q in kept) / count
    recall = sum(bool(_near(q, own).any()) for q, own in zip(kept, task.q, strict=True)) / count
    return kept, Check(
        success,
        sum(map(len, kept)) / count,
        position,
        rotation,
        wrong / count,
        None,
        recall if task.row.kind == "branches" else None,
    )


def share_of_same(ours: list[Array], theirs: list[Array]) -> float:
    """Share of targets with the same set of branches."""
    return sum(same_set(a, b) for a, b in zip(ours, theirs, strict=True)) / len(ours)


def same_set(a: Array, b: Array) -> bool:
    """Whether two lists of configurations ``(k, n)`` are the same set, modulo whole turns."""
    return len(a) == len(b) and all(bool(_near(b, q).any()) for q in a) and all(bool(_near(a, q).any()) for q in b)


def _near(many: Array, one: Array) -> NDArray[np.bool_]:
    gap = (many - one + math.pi) % (2 * math.pi) - math.pi
    return np.asarray((np.abs(gap) <= SAME).all(axis=-1))


def _distinct(q: Array) -> Array:
    kept: list[Array] = []
    for row in q:
        if not kept or not _near(np.array(kept), row).any():
            kept.append(row)
    return np.array(kept).reshape(-1, q.shape[1])


def _angle(poses: Array, T: Array) -> Array:
    """Angles between rotations, from the chord, which is accurate for small angles."""
    chord = np.linalg.norm(poses[:, :3, :3] - T[:3, :3], axis=(1, 2)) / math.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))


def _tilt(poses: Array, T: Array) -> Array:
    """Angles between the approach directions."""
    return np.asarray(2.0 * np.arcsin(np.clip(np.linalg.norm(poses[:, :3, 2] - T[:3, 2], axis=1) / 2.0, 0.0, 1.0)))
