"""Arms with three turning and three sliding joints, in any order: both postures of a pose.

Slides do not turn the tool. So the three turning joints alone have to meet the orientation R. With their axes z1,
z2, z3 and the orientation R0 of the zero position, in the base frame,

    exp(z1 θ1) exp(z2 θ2) exp(z3 θ3) = R R0ᵀ = M.

- z1ᵀ exp(z2 θ2) z3 = z1ᵀ M z3 is A cos θ2 + B sin θ2 + C: two values of θ2, or none.
- θ1 turns exp(z2 θ2) z3 about z1 into M z3, and θ3 is the rotation that is left.
- The point is then linear in the three slides, whose directions are known: three equations.

Degenerate: M z3 on axis 1, where only θ1 ± θ3 matters, and a curve of configurations meets the pose; slides in one
plane at these angles, where the three equations have no solution or infinitely many.

D. L. Pieper, The Kinematics of Manipulators under Computer Control, Stanford 1968, treats three turning and three
sliding joints. Two rotations that take one direction into another are a subproblem of B. Paden and S. Sastry.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.fk import fk, jacobian
from kin.kernels.compile import jit
from kin.kernels.jacobian import jacobian_into
from kin.robot import Robot
from kin.solvers.blocks import each_solved, one_after_another
from kin.solvers.common import clear
from kin.solvers.contract import (
    POSE,
    BatchKernels,
    Candidates,
    Completeness,
    SolverInput,
)
from kin.solvers.slides import ALIKE, REGULAR, SlidesForm, dot, if_finite, triple
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "slides3"
TITLE = "closed form, three turning and three sliding joints"
_SINGULAR = TOLERANCES.singular
_FLAT = 1e-7  # volume that the directions of three slides span, where they count as lying in one plane
# Layout of the parameters: the indices of the turning and of the sliding joints, the axes of the former and the
# orientation at zero, the arm's model.
TURNS, SLIDES, AXES, ZERO, MODEL = 0, 3, 6, 15, 24


def match(robot: Robot) -> Slides3 | None:
    """The closed form, if the arm has three joints of each kind and can move its tool in every direction."""
    if robot.n != 6 or robot.revolute.sum() != 3:
        return None
    J = jacobian(robot, np.random.default_rng(5).uniform(-1.0, 1.0, (4, 6)))
    J[:, :3, robot.revolute] /= robot.reach or 1.0
    return Slides3(robot) if np.linalg.matrix_rank(J, rtol=REGULAR).max() == 6 else None


@jit
def _turn(z: Array, angle: float, v: Array, out: Array) -> None:
    """out ``(3,)`` ← v turned about the unit vector z, by Rodrigues' formula."""
    c, s = math.cos(angle), math.sin(angle)
    along = (z[0] * v[0] + z[1] * v[1] + z[2] * v[2]) * (1.0 - c)
    x = c * v[0] + s * (z[1] * v[2] - z[2] * v[1]) + along * z[0]
    y = c * v[1] + s * (z[2] * v[0] - z[0] * v[2]) + along * z[1]
    w = c * v[2] + s * (z[0] * v[1] - z[1] * v[0]) + along * z[2]
    out[0], out[1], out[2] = x, y, w


@jit
def _angle(z: Array, v: Array, w: Array) -> tuple[float, float]:
    """The angle about z from v to w, and how far v is off the axis."""
    a, b = dot(z, v), dot(z, w)
    off = math.sqrt(max(dot(v, v) - a * a, 0.0))
    return math.atan2(triple(z, v, w), dot(v, w) - a * b), off


@jit
def _slide(params: Array, T: Array, q: Array) -> bool:
    """q ``(6,)``, with the slides at zero ← their values that bring the point to that of T; False if none does."""
    J, P, axes, x = np.empty((6, 6)), np.empty((4, 4)), np.empty((6, 7)), np.empty(3)
    directions = np.empty((3, 3))
    jacobian_into(params[MODEL:], q, J, P, axes)
    first, second, third = int(params[SLIDES]), int(params[SLIDES + 1]), int(params[SLIDES + 2])
    for i in range(3):
        directions[0, i], directions[1, i], directions[2, i] = J[i, first], J[i, second], J[i, third]
    a, b, c = directions[0], directions[1], directions[2]
    volume = triple(a, b, c)
    if abs(volume) < _FLAT:
        return False
    for i in range(3):
        x[i] = T[i, 3] - P[i, 3]
    q[first], q[second], q[third] = triple(x, b, c) / volume, triple(a, x, c) / volume, triple(a, b, x) / volume
    return True


@jit
def configurations(params: Array, T: Array, near: Array, out: Array) -> bool:
    """out ``(2, 6)`` ← the configurations of a finite target T ``(4, 4)``, then NaN; whether these are all.

    Others may exist where the slides lie in one plane. `near` decides θ1 where only θ1 ± θ3 matters.
    """
    clear(out)
    whole = True
    z1, z2, z3 = params[AXES : AXES + 3], params[AXES + 3 : AXES + 6], params[AXES + 6 : AXES + 9]
    M = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            M[i, j] = 0.0
            for k in range(3):
                M[i, j] += T[i, k] * params[ZERO + 3 * j + k]
    w, v, side, there = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        w[i] = M[i, 0] * z3[0] + M[i, 1] * z3[1] + M[i, 2] * z3[2]
    constant = dot(z1, z2) * dot(z2, z3)
    cosine, sine = dot(z1, z3) - constant, triple(z1, z2, z3)
    size = math.sqrt(cosine * cosine + sine * sine)
    share = (dot(z1, w) - constant) / size
    if abs(share) > 1.0 + ALIKE:
        return whole
    middle, half = math.atan2(sine, cosine), math.acos(min(max(share, -1.0), 1.0))
    # A direction across axis 3, which shows the rotation about it.
    across = 0 if abs(z3[0]) < 0.6 else 1
    for k in range(3):
        side[k] = (1.0 if k == across else 0.0) - z3[across] * z3[k]
    q, angles = np.zeros(6), np.empty(3)
    row = 0
    for sign in range(2):
        angles[1] = middle + half if sign == 0 else middle - half
        _turn(z2, angles[1], z3, v)
        angles[0], off = _angle(z1, v, w)
        if off < _SINGULAR:
            angles[0] = near[int(params[TURNS])]
        for i in range(3):
            there[i] = M[i, 0] * side[0] + M[i, 1] * side[1] + M[i, 2] * side[2]
        _turn(z1, -angles[0], there, there)
        _turn(z2, -angles[1], there, there)
        angles[2] = _angle(z3, side, there)[0]
        for i in range(6):
            q[i] = 0.0
        for k in range(3):
            q[int(params[TURNS + k])] = wrap(angles[k])
        if not _slide(params, T, q):
            whole = False
            continue
        for i in range(6):
            out[row, i] = q[i]
        row += 1
    return whole


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(2, 6)`` ← the configurations of T ``(4, 4)``, then NaN; False if T is not finite."""
    return if_finite(configurations, params, T, near, out)


branches_many = one_after_another(branches_one)


@jit
def _all(
    params: Array, T: Array, request: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> None:
    """`configurations`, NaN where others may exist."""
    if not configurations(params, T, near, out):
        clear(out)


solve_many = each_solved(_all, math.nan, 0)


class Slides3(SlidesForm):
    """The closed form of an arm with three turning and three sliding joints."""

    name, title, quick = NAME, TITLE, (POSE,)
    reason = "three joints turn and three slide"

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        turns, slides = np.flatnonzero(robot.revolute), np.flatnonzero(~robot.revolute)
        zero = np.zeros(6)
        axes, R = jacobian(robot, zero)[3:, turns].T, fk(robot, zero)[:3, :3]
        params = np.concatenate([turns, slides, axes.ravel(), R.ravel(), robot.model]).astype(np.float64)
        self.kernels = BatchKernels(params, branches_one, branches_many, seeded=solve_many)

    def solve(self, problem: SolverInput) -> Candidates:
        """Both configurations."""
        q = np.empty((2, 6))
        known = self.add_missing(problem.T, problem.seed, q)
        return Candidates(q, np.empty((2, 0)), (), completeness=known)

    def add_missing(self, T: Array, near: Array, q: Array) -> Completeness:
        """q ``(2, 6)`` ← all configurations; more may exist where the slides lie in one plane."""
        whole = configurations(self.kernels.params, np.ascontiguousarray(T), near, q)
        return "proved" if whole else "unknown"
