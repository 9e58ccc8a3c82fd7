"""The search for a way out of a singularity: many starts around a configuration, improved side by side.

All is in coordinates in which turns and slides, lengths and angles compare: a metre of the tool counts as a share
of the arm's size, a metre of a slide as a share of its reach. σ is the smallest singular value of the task's
Jacobian in these coordinates, of those that are not zero everywhere.

The best end of a way out has the least deviation ‖e‖ of the tool among the configurations with σ ≥ m inside the
limits; of ends that deviate as little, the one nearest to where the arm is. Levenberg–Marquardt steps minimise

    ‖e(q)‖² + ε ‖q − q₀‖² + μ Σ max(0, m − σₖ(q))²

over the smallest three singular values with a weight μ that grows. ε is a share of ‖e‖² / ‖q − q₀‖². Two shares
are tried: the smaller one decides between ends of equal deviation only; the larger one finds shorter motions,
because on a long one the tool may deviate more than at its end. The slope of a simple singular value is uᵀ ∂J v.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kin.differential.error import task_error
from kin.differential.metric import weights
from kin.differential.task import Task, natural_task, task_rows, usual_rank, weight
from kin.robot import Robot
from kin.transforms import Array

MARGIN = 0.03  # σ of most arms is below it in a quarter of their configurations
_SAMPLES = 256
_DIFFERENCE = 1e-5  # for slopes of the Jacobian
_LOWEST = 3  # singular values that are kept above the margin
_WEIGHTS = (10.0, 1e3, 1e5, 1e7)  # μ
_STEPS = 12  # at each weight
_ABOVE = 1.0005  # the margin that is aimed at, so that rounding does not spoil what was asked for
TIES = (1e-3, 5e-2)  # ε, as shares of what the deviation weighs: a longer motion may deviate more on its way
_LEAST_TIE = 1e-10
_STRIDE = 0.3  # of one step
_DIRECTIONS = 48  # random starts
_ALONG = np.array([0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.1])  # how far starts are looked for along their directions


@dataclass(frozen=True, eq=False)
class Measure:
    """An arm and its natural task in the coordinates of this module.

    Attributes:
        robot, task: the arm, and what of the tool's pose counts.
        rank: how many motions of the tool the joints control almost everywhere.
        rows: ``(m,)`` factors of the rows of the task.
        joints: ``(n,)`` what a radian or a metre of each joint counts.
    """

    robot: Robot
    task: Task
    rank: int
    rows: Array
    joints: Array

    @property
    def spare(self) -> bool:
        """Whether the task leaves the joints a motion almost everywhere."""
        return self.robot.n > self.rank

    def jacobian(self, q: Array) -> Array:
        """The Jacobian ``(..., m, n)`` at ``(..., n)``."""
        return self.rows[:, None] * task_rows(self.robot, q, self.task) / self.joints

    def sigma(self, q: Array) -> Array:
        """σ ``(...)`` at ``(..., n)``."""
        return np.asarray(np.linalg.svd(self.jacobian(q), compute_uv=False)[..., self.rank - 1])

    def error(self, q: Array, T: Array) -> Array:
        """What is missing to the pose T ``(4, 4)`` at ``(..., n)``: ``(..., m)``."""
        return self.rows * task_error(self.robot, q, T, self.task)

    def slopes(self, q: Array) -> tuple[Array, Array, Array]:
        """J ``(k, m, n)`` at q ``(k, n)``, its smallest singular values ``(k, c)``, their slopes ``(k, c, n)``."""
        J = self.jacobian(q)
        U, s, Vt = np.linalg.svd(J)
        low = slice(max(self.rank - _LOWEST, 0), self.rank)
        steps = np.diag(_DIFFERENCE / self.joints)
        near = self.jacobian(q[:, None] + np.concatenate([steps, -steps]))
        bent = (near[:, : self.robot.n] - near[:, self.robot.n :]) / (2.0 * _DIFFERENCE)
        return J, s[:, low], np.einsum("kmc,kimn,kcn->kci", U[:, :, low], bent, Vt[:, low])


@lru_cache(maxsize=256)
def measure_of(robot: Robot) -> Measure:
    """The measure of an arm."""
    task = natural_task(robot)
    count = len(task_rows(robot, robot.q_home, task))
    return Measure(robot, task, usual_rank(robot, task), weight(robot, count), weights(robot))


@lru_cache(maxsize=256)
def usual_margin(robot: Robot) -> float:
    """`MARGIN`, or half of the median of σ over all configurations if that is less."""
    usual = np.median(measure_of(robot).sigma(robot.random_q(np.random.default_rng(2), _SAMPLES)))
    return min(MARGIN, 0.5 * float(usual))


def starts(measure: Measure, q: Array, margin: float, lower: Array, upper: Array) -> Array:
    """Configurations ``(k, n)`` around q ``(n,)`` on whose straight ways σ first reaches the margin.

    Along directions that the singularity leaves without effect on the tool, single joints, and random ones.
    """
    n = measure.robot.n
    null = np.linalg.svd(measure.jacobian(q))[2][max(measure.rank - _LOWEST, 0) :]
    drawn = np.random.default_rng(7).normal(size=(_DIRECTIONS, n))
    ahead = np.concatenate([null, np.eye(n), drawn / np.linalg.norm(drawn, axis=1, keepdims=True)])
    ahead = np.concatenate([ahead, -ahead]) / measure.joints
    places = np.clip(q + _ALONG[:, None, None] * ahead, lower, upper)
    sigma = measure.sigma(places)
    # Where none is beyond the margin, the one with the largest σ: it may be led there.
    first = np.where((sigma >= margin).any(axis=0), np.argmax(sigma >= margin, axis=0), np.argmax(sigma, axis=0))
    return np.asarray(places[first, np.arange(len(ahead))])


def improved(
    measure: Measure, q_start: Array, T: Array, q: Array, margin: float, lower: Array, upper: Array,
    ties: float, cancel: Callable[[], None],
) -> Array:  # fmt: skip
    """Configurations q ``(k, n)`` moved to where the tool deviates least from T ``(4, 4)`` beyond the margin."""
    damping = np.full(len(q), 1e-3)
    goal = margin * _ABOVE
    for strength in _WEIGHTS:
        for _ in range(_STEPS):
            cancel()
            J, sigma, slope = measure.slopes(q)
            missing, moved = measure.error(q, T), (q - q_start) * measure.joints
            tie = np.maximum(ties * (missing**2).sum(1) / np.maximum((moved**2).sum(1), 1e-12), _LEAST_TIE)
            lack = np.maximum(goal - sigma, 0.0)
            before = (missing**2).sum(1) + tie * (moved**2).sum(1) + strength * (lack**2).sum(1)
            slope = slope * (lack > 0.0)[..., None]
            A = np.einsum("kmi,kmj->kij", J, J) + strength * np.einsum("kci,kcj->kij", slope, slope)
            b = np.einsum("kmi,km->ki", J, missing) - tie[:, None] * moved
            b += strength * np.einsum("kci,kc->ki", slope, lack)
            held = ((q <= lower) & (b < 0.0)) | ((q >= upper) & (b > 0.0))
            A[held[:, :, None] | held[:, None, :]] = 0.0
            A += (damping[:, None] * np.einsum("kii->ki", A) + tie[:, None] + held)[:, :, None] * np.eye(
                len(q_start)
            )
            step = np.linalg.solve(A, np.where(held, 0.0, b)[..., None])[..., 0]
            step *= np.minimum(1.0, _STRIDE / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
            trial = np.clip(q + step / measure.joints, lower, upper)
            there = (measure.error(trial, T) ** 2).sum(1) + tie * (((trial - q_start) * measure.joints) ** 2).sum(
                1
            )
            low = np.linalg.svd(measure.jacobian(trial), compute_uv=False)[:, : measure.rank][:, -_LOWEST:]
            there += strength * (np.maximum(goal - low, 0.0) ** 2).sum(1)
            better = there < before
            q = np.where(better[:, None], trial, q)
            damping = np.clip(np.where(better, 0.2 * damping, 8.0 * damping), 1e-12, 1e6)
    return q
