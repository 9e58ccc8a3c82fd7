"""Loops of the tool that end in another posture without a singularity, found by search and then verified.

The search draws poses, solves each, and joins its postures by straight motions of the joints, in which the tool
leaves its pose and comes back to it. The determinant of the Jacobian has one sign on all of a motion without a
singularity, so postures of equal sign are candidates. If no straight motion will do, one with a corner may.

A candidate is verified between its samples, too. A singular value changes by no more than the matrix does: with
|dJ/ds| ≤ M along a motion, ``σ(s) > M h`` proves that there is no singularity from s − h to s + h. Where it is not
that large, the interval is halved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kin.angles import apart, wrapped
from kin.axes import lines_of, size
from kin.differential.task import natural_task, task_jacobian, weight
from kin.fk import fk
from kin.ik.batch import solve_many
from kin.ik.options import IKOptions
from kin.ik.problem import never_cancel
from kin.robot import Robot
from kin.transforms import Array

_AT_ONCE = 32  # poses
_SAMPLES = 24  # of a motion, while candidates are looked for
_VERIFIED = 12  # candidates of a chunk, the best first
_CORNERS = 8  # for each pair of postures
_PAIRS = 64  # of a chunk that are tried with corners
_OTHER = 0.05  # rad, m: postures differ by more
_SHORTEST = 2.0**-16  # of a motion: intervals that are not verified then are given up


@dataclass(frozen=True, eq=False)
class Search:
    """What a search has found.

    Attributes:
        q: ``(k, n)`` the corners of a loop; None if none was found.
        least: no singular value on the loop is smaller; lengths count as shares of the arm's size.
        poses, pairs: how many random poses were solved, and how many pairs of their postures tried.
    """

    q: Array | None
    least: float
    poses: int
    pairs: int


def search_loop(
    robot: Robot,
    poses: int,
    seed: int,
    within_limits: bool,
    near: Array,
    progress: Callable[[float], object],
    cancel: Callable[[], None] = never_cancel,
) -> Search:
    """A loop of an arm with as many joints as its task has dimensions.

    Args:
        robot: the arm.
        poses: how many random ones to solve.
        seed: of the random poses.
        within_limits: whether the loop keeps the joint limits. Else joints turn either way.
        near: ``(k, n)`` configurations whose poses are tried first, with corners among them.
        progress: called now and then with the part that is done, 0 to 1.
        cancel: called now and then; raises to cancel.
    """
    rng, pairs = np.random.default_rng(seed), 0
    options = IKOptions(task=natural_task(robot), respect_limits=within_limits)
    if within_limits:
        near = near[robot.in_limits(near)]
    solved_poses = 0  # random ones, as are those whose pairs count
    for done in range(-_AT_ONCE if len(near) else 0, poses, _AT_ONCE):
        progress(max(done, 0) / poses)
        q = near if done < 0 else robot.random_q(rng, min(_AT_ONCE, poses - done))
        solved_poses += len(q) * (done >= 0)
        T = fk(robot, q)
        targets = T[:, :3, 3] if options.task == "position" else T
        solved = solve_many(robot, targets, options, cancel=cancel)
        starts, ends = _pairs(robot, [np.array([s.q for s in each.solutions]) for each in solved])
        pairs += len(starts) * (done >= 0)
        for corners in (0, 1):
            cancel()
            among = q if done < 0 else robot.random_q(rng, _CORNERS * _PAIRS)
            motions = _motions(robot, starts, ends, among if corners else None, within_limits, rng)
            for path in _promising(robot, motions):
                least = min(verified(robot, a, b) for a, b in pairwise(path))
                if least > 0.0:
                    return Search(path, least, solved_poses, pairs)
    return Search(None, 0.0, solved_poses, pairs)


def _pairs(robot: Robot, postures: list[Array]) -> tuple[Array, Array]:
    """The pairs of different postures of the same pose ``(m, n)`` whose determinants have the same sign."""
    first, second = [np.empty((0, robot.n))], [np.empty((0, robot.n))]
    for q in postures:
        if len(q) < 2:
            continue
        sign = np.sign(np.linalg.det(task_jacobian(robot, q)))
        i, j = np.triu_indices(len(q), 1)
        kept = (sign[i] == sign[j]) & (apart(q[i], q[j], robot.revolute) > _OTHER)
        first.append(q[i[kept]])
        second.append(q[j[kept]])
    return np.concatenate(first), np.concatenate(second)


def _motions(
    robot: Robot, starts: Array, ends: Array, among: Array | None, within_limits: bool, rng: np.random.Generator
) -> Array:
    """Motions ``(m, 2 or 3, n)`` between pairs of postures: straight, or over corners that are drawn from some."""
    q = np.stack([starts, ends], axis=1)
    if among is not None:
        chosen = rng.permutation(len(starts))[:_PAIRS].repeat(_CORNERS)
        corners = among[rng.integers(len(among), size=len(chosen))]
        q = np.stack([starts[chosen], corners, ends[chosen]], axis=1)
    if not within_limits:  # each joint turns the shorter way
        steps = np.diff(q, axis=1)
        steps = np.where(robot.revolute, wrapped(steps), steps)
        q[:, 1:] = q[:, :1] + np.cumsum(steps, axis=1)
    return q


def _promising(robot: Robot, motions: Array) -> Array:
    """The motions on whose samples the determinant keeps its sign, the one farthest from zero first."""
    if not len(motions):
        return motions
    s = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    legs = motions[:, :-1, None] * (1.0 - s) + motions[:, 1:, None] * s
    det = np.linalg.det(task_jacobian(robot, legs)).reshape(len(motions), -1)
    least = np.where(np.abs(np.sign(det).sum(axis=1)) == det.shape[1], np.abs(det).min(axis=1), 0.0)
    order = np.argsort(-least)[:_VERIFIED]
    return motions[order[least[order] > 0.0]]


def verified(robot: Robot, a: Array, b: Array, most: float = math.inf) -> float:
    """A lower bound of the smallest singular value on the straight motion of the joints from a to b ``(n,)``.

    Args:
        robot: an arm with as many joints as its task has dimensions.
        a, b: configurations.
        most: a motion that needs more samples is given up.

    Returns:
        The bound, lengths counting as shares of the arm's size; 0.0 if there may be a singularity.
    """
    steep = steepness(robot, a, b)
    middle, half, least, samples = np.array([0.5]), 0.5, math.inf, 0
    while len(middle):
        samples += len(middle)
        if samples > most:
            return 0.0
        sigma = smallest(robot, a + middle[:, None] * (b - a))
        done = sigma >= 2.0 * steep * half
        least = min(least, float((sigma[done] - steep * half).min(initial=math.inf)))
        half *= 0.5
        if half < _SHORTEST:
            return 0.0
        middle = (middle[~done, None] + np.array([-half, half])).reshape(-1)
    return least


def smallest(robot: Robot, q: Array) -> Array:
    """The smallest singular value of the task's Jacobian ``(k,)``, lengths as shares of the arm's size."""
    J = task_jacobian(robot, q)
    return np.asarray(np.linalg.svd(weight(robot, J.shape[-2])[:, None] * J, compute_uv=False)[:, -1])


def steepness(robot: Robot, a: Array, b: Array) -> float:
    """A bound of |dJ/ds| on the straight motion q = a + s (b − a), lengths as shares of the arm's size.

    Column i is ``(z_i × (p − o_i), z_i)``. Joint k turns both parts if it comes before i; otherwise it moves p
    about its own axis. So the upper part changes by no more per radian than p is away from the later one of both
    axes, and the lower one by no more than 1. An approach direction turns with all joints, for which 1 is added.
    """
    lines, turns = lines_of(robot, as_counted=True), robot.revolute
    ends = np.vstack([lines.points, lines.T_base_tool[:3, 3]])
    links = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    links += np.where(turns, 0.0, np.maximum(np.abs(a), np.abs(b)))
    away = np.cumsum(links[::-1])[::-1] / size(robot)
    n = robot.n
    i, k = np.indices((n, n))
    both, before = turns[i] & turns[k], k < i
    upper = np.where(both, away[np.maximum(i, k)], 0.0)
    upper = np.where(turns[i] & ~turns[k] & (k > i) | ~turns[i] & turns[k] & before, 1.0, upper)
    upper[turns[i] & ~turns[k]] /= size(robot)
    upper[~turns[i]] /= size(robot)
    task = natural_task(robot)
    lower = (both & before) * (task != "position") + both * (task == "approach") * 1.0
    step = np.abs(b - a)
    return math.hypot(*(upper @ step), *(lower @ step))
