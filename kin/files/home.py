"""The home configuration of an arm whose file has none.

The middle of the limits is the natural choice, but for many arms it is singular: the arm is fully stretched, and
the tool cannot be pulled in along it. Therefore bent configurations are considered too. In these, up to three
joints are 45° to one side of their middle, or half-way to the limit if that is less.

A configuration is judged by its *margin*: the smallest singular value of the Jacobian that is not zero in all of
them, with lengths in units of the reach. Among the candidates with at least half the largest margin, the one with
the fewest bent joints is chosen; then the one whose lowest frame is highest; then the one with the largest margin.
Prismatic joints stay in their middle. The choice is deterministic.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from kin.differential.task import task_jacobian
from kin.fk import link_frames
from kin.robot import Robot
from kin.transforms import Array

_BEND = math.pi / 4
_ENOUGH = 0.5
_MOST_BENT = 3
_MOST_CONSIDERED = 8  # further joints stay in their middle: eight joints already give 577 configurations


def default_home(robot: Robot) -> tuple[float, ...]:
    """One value per moving joint: the middle of its limits, or a bent configuration that is less singular."""
    return tuple(homes(robot)[0].tolist())


def homes(robot: Robot) -> Array:
    """The candidates for a home configuration ``(k, n)``, the best one first."""
    q, bent = candidates(robot)
    margin = margins(robot, q)
    good = margin >= _ENOUGH * margin.max()
    lowest = link_frames(robot, q)[:, :, 2, 3].min(axis=1)
    step = 1e-6 * (robot.reach if math.isfinite(robot.reach) else 1.0)  # rounding errors must not decide a tie
    order = np.lexsort((-np.round(margin, 6), -np.round(lowest / (step or 1.0)), bent, ~good))
    return q[order]


def candidates(robot: Robot) -> tuple[Array, Array]:
    """The candidate configurations ``(k, n)`` and how many joints each bends ``(k,)``; the first is the middle."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -math.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, math.pi)
    middle = 0.5 * (lower + upper)
    bend = np.minimum(_BEND, 0.25 * (upper - lower))
    turning = np.flatnonzero(robot.revolute)[:_MOST_CONSIDERED]
    rows, bent = [middle], [0]
    for count in range(1, min(_MOST_BENT, len(turning)) + 1):
        for joints in itertools.combinations(turning.tolist(), count):
            for signs in itertools.product((1.0, -1.0), repeat=count):
                q = middle.copy()
                q[list(joints)] += np.array(signs) * bend[list(joints)]
                rows.append(q)
                bent.append(count)
    return np.array(rows), np.array(bent, dtype=float)


def margins(robot: Robot, q: Array) -> Array:
    """Distance of each configuration ``(k, n)`` from losing a direction of motion ``(k,)``, in radians per radian.

    Only directions that the best of these configurations has count: a planar arm, for example, never leaves its
    plane.
    """
    J = task_jacobian(robot, q)
    J[:, :3] /= robot.reach if 0.0 < robot.reach < math.inf else 1.0
    values = np.linalg.svd(J, compute_uv=False)
    rank = int((values > 1e-9 * values.max(initial=1e-300)).sum(axis=1).max())
    return np.array(values[:, rank - 1], dtype=np.float64) if rank else np.zeros(len(q))
