"""A home pose for an arm whose file names none.

The middle of the limits is the natural choice, except that for many arms it is the pose with everything
stretched: an elbow at 0° is as far from both stops as can be, and the arm cannot draw its tool in from there
without knowing which way to bend. So a few bent poses are looked at too, each joint a quarter of a half turn
(or half-way to its stop, if that is nearer) to one side or the other of its middle.

A pose is judged by its *margin*: the smallest singular value of the Jacobian that is not zero everywhere, lengths
in units of the reach. Of all candidates with at least half the best margin the one is taken that bends fewest
joints; then the one that keeps the arm highest; then the one with the greatest margin. Slides stay half-way.
Nothing is drawn at random: the same file always gives the same home.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from kin.fk import link_frames
from kin.robot import Robot
from kin.singularity import task_jacobian
from kin.transforms import Array

_BEND = math.pi / 4
_ENOUGH = 0.5
_MOST_BENT = 3
_MOST_CONSIDERED = 8  # further joints stay in their middle: three of eight already give 576 poses


def default_home(robot: Robot) -> tuple[float, ...]:
    """One value per moving joint, inside the limits: the middle of them, or a bent pose that is less singular."""
    q, bent = candidates(robot)
    margin = margins(robot, q)
    good = margin >= _ENOUGH * margin.max()
    lowest = link_frames(robot, q)[:, :, 2, 3].min(axis=1)
    step = 1e-6 * (robot.reach if math.isfinite(robot.reach) else 1.0)  # rounding errors must not decide
    order = np.lexsort((-np.round(margin, 6), -np.round(lowest / (step or 1.0)), bent, ~good))
    return tuple(q[order[0]].tolist())


def candidates(robot: Robot) -> tuple[Array, Array]:
    """The poses looked at ``(k, n)``, and how many joints each bends ``(k,)``; the first is the middle."""
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
    """How far each configuration ``(k, n)`` is from losing a motion ``(k,)``, in radians per radian.

    The motions are those that the best of these configurations has: a flat arm, for one, never leaves its plane.
    """
    J = task_jacobian(robot, q)
    J[:, :3] /= robot.reach if 0.0 < robot.reach < math.inf else 1.0
    values = np.linalg.svd(J, compute_uv=False)
    rank = int((values > 1e-9 * values.max(initial=1e-300)).sum(axis=1).max())
    return np.array(values[:, rank - 1], dtype=np.float64) if rank else np.zeros(len(q))
