"""Arms with one turning and two sliding joints, in any order: both postures of a point.

Let P(θ) be the tool's point with both slides at zero, and u(θ), v(θ) their directions, all in the base frame. A
point p is met where p − P is in the plane of u and v:

    (p − P(θ)) · (u(θ) × v(θ)) = 0.

This is A cos θ + B sin θ + C = 0, wherever the turning joint is. With both slides before it, only P turns. With
both after it, the part R w of P that turns meets the normal R (u × v), and their product does not depend on θ.
With one on each side, R w · (u × R v) = u · R (v × w). So there are two values of θ, or none. The slides follow
from two linear equations.

Degenerate: A = B = 0, where no value or every value of θ is right (planar arms: they cannot reach most points),
and u parallel to v at these values.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.fk import jacobian
from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into
from kin.robot import Robot
from kin.solvers.blocks import each_solved, one_after_another
from kin.solvers.common import clear
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    Obstacle,
    SolverInput,
)
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.solvers.slides import ALIKE, REGULAR, SlidesForm, dot, if_finite, triple
from kin.transforms import Array

NAME = "slides2"
TITLE = "closed form, one turning and two sliding joints"
_FLAT = 1e-14  # square of the sine between two slides that count as parallel
_THIRD = 2.0 * math.pi / 3.0
# Layout of the parameters: the indices of the turning and of the sliding joints, the arm's reach and its model.
TURN_AT, SLIDES, REACH, MODEL = 0, 1, 3, 4


def match(robot: Robot) -> Slides2 | None:
    """The closed form, if one of three joints turns, two slide, and the point can move in any direction."""
    if robot.n != 3 or robot.revolute.sum() != 1:
        return None
    J = jacobian(robot, np.random.default_rng(5).uniform(-1.0, 1.0, (4, 3)))[:, :3]
    J[..., robot.revolute] /= _reach(robot)
    return Slides2(robot) if np.linalg.matrix_rank(J, rtol=REGULAR).max() == 3 else None


def _reach(robot: Robot) -> float:
    """What lengths are shares of, metres."""
    return float(robot.reach) if math.isfinite(robot.reach) else 1.0


@jit
def _at(params: Array, T: Array, angle: float, left: Array, axes: Array) -> float:
    """left ``(3,)`` ← p − P, axes ``(2, 3)`` ← the slides' directions; returns (p − P) · (u × v)."""
    J, P, lines, q = np.empty((6, 3)), np.empty((4, 4)), np.empty((3, 7)), np.zeros(3)
    q[int(params[TURN_AT])] = angle
    jacobian_into(params[MODEL:], q, J, P, lines)
    for i in range(3):
        left[i] = T[i, 3] - P[i, 3]
        for k in range(2):
            axes[k, i] = J[i, int(params[SLIDES + k])]
    return triple(left, axes[0], axes[1])


@jit
def configurations(params: Array, T: Array, near: Array, out: Array) -> None:
    """out ``(2, 3)`` ← the configurations that meet the point of a finite target T ``(4, 4)``, then NaN.

    `near` decides θ where every value is right.
    """
    clear(out)
    left, axes, f = np.empty(3), np.empty((2, 3)), np.empty(3)
    for k in range(3):
        f[k] = _at(params, T, k * _THIRD, left, axes)
    constant = (f[0] + f[1] + f[2]) / 3.0
    cosine, sine = (2.0 * f[0] - f[1] - f[2]) / 3.0, (f[1] - f[2]) / math.sqrt(3.0)
    size = math.sqrt(cosine * cosine + sine * sine)
    if abs(constant) > size * (1.0 + ALIKE):
        return
    if size > 0.0:
        middle, half = math.atan2(sine, cosine), math.acos(min(max(-constant / size, -1.0), 1.0))
    else:
        middle, half = near[int(params[TURN_AT])], 0.0
    for row in range(2):
        angle = middle + half if row == 0 else middle - half
        _at(params, T, angle, left, axes)
        uv, ux, vx = dot(axes[0], axes[1]), dot(axes[0], left), dot(axes[1], left)
        square = 1.0 - uv * uv
        if square < _FLAT:
            continue
        out[row, int(params[TURN_AT])] = wrap(angle)
        out[row, int(params[SLIDES])] = (ux - uv * vx) / square
        out[row, int(params[SLIDES + 1])] = (vx - uv * ux) / square


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(2, 3)`` ← the configurations for the point of T ``(4, 4)``, then NaN; False if T is not finite."""
    return if_finite(configurations, params, T, near, out)


branches_many = one_after_another(branches_one)


@jit
def _surely_regular(params: Array, q: Array) -> bool:
    """Whether each row of q ``(2, 3)`` that is not NaN is far from singular, by a bound that takes little time.

    The smallest of three singular values is their product over that of the two others, which is less than half
    the sum of all squares.
    """
    J, P, lines = np.empty((6, 3)), np.empty((4, 4)), np.empty((3, 7))
    turn = int(params[TURN_AT])
    for row in range(q.shape[0]):
        if math.isnan(q[row, 0]):
            continue
        jacobian_into(params[MODEL:], q[row], J, P, lines)
        squares = 0.0
        for i in range(3):
            J[i, turn] /= params[REACH]
            squares += dot(J[i], J[i])
        if abs(triple(J[0], J[1], J[2])) <= REGULAR * squares:
            return False
    return True


@jit
def _regular(
    params: Array, T: Array, request: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> None:
    """`configurations`, NaN where one of them may be singular."""
    configurations(params, T, near, out)
    if not _surely_regular(params, out):
        clear(out)


solve_many = each_solved(_regular, math.nan, 0)


class Slides2(SlidesForm):
    """The closed form of an arm with one turning and two sliding joints."""

    name, title = NAME, TITLE
    tasks = quick = (POSE, APPROACH, POSITION)  # of all three the point is met, and the caller judges the rest
    reason = "one of three joints turns and two slide"

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        order = np.concatenate([np.flatnonzero(robot.revolute), np.flatnonzero(~robot.revolute)])
        params = np.concatenate([order, [_reach(robot)], robot.model]).astype(np.float64)
        self.kernels = BatchKernels(params, branches_one, branches_many, seeded=solve_many)

    def solve(self, problem: SolverInput) -> Candidates:
        """Both configurations."""
        q = np.empty((2, 3))
        configurations(self.kernels.params, np.ascontiguousarray(problem.T), problem.seed, q)
        there = ~np.isnan(q[:, 0])
        obstacle = None if there.any() else Obstacle("point")
        regular = _surely_regular(self.kernels.params, q) or not (self._smallest(q[there]) < REGULAR).any()
        return Candidates(q, np.empty((2, 0)), (), 0.0, obstacle, "proved" if regular else "searched")

    def _smallest(self, q: Array) -> Array:
        """The smallest singular value of the Jacobian of the point ``(k,)``, lengths in shares of the reach."""
        J = jacobian(self.robot, q)[:, :3]
        J[..., self.robot.revolute] /= _reach(self.robot)
        return np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1])

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian of the point."""
        return those_within(within, by_jacobian(jacobian(self.robot, q)[:3], rank=3))
