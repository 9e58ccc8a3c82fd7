"""All configurations of three joints for a point, where their axes are in no special position.

Seen from axis 2, joint 2 leaves two numbers of a point as they are: where it turns, its height along the axis and
its distance from a point of it; where it slides, the two coordinates across the axis. So they are the same of the
tool's point X, moved by joint 3, and of the target Y, moved back by joint 1. Each is linear in two coordinates of
its joint, w = (cos q, sin q) of one that turns, w = (d, d²) of one that slides:

    A w₁ = B w₃ + c,  two equations.

Solved for one w, whose coordinates are on a circle or a parabola, they leave one polynomial of degree four in the
other joint's value (Pieper 1968). The joint with the smaller determinant stays. No number is divided by it: where
it vanishes, as with axes that are parallel, the polynomial is a square, and a descent to the point makes up for
the digits that a double root loses.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import wrap
from kin.axes import cross, lines_of, perpendicular_to
from kin.differential.metric import extent
from kin.fk import jacobian
from kin.kernels.compile import jit
from kin.kernels.fk import fk_into
from kin.robot import Robot
from kin.solvers.blocks import one_after_another
from kin.solvers.common import UNBOUNDED, clear
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    SolverInput,
)
from kin.solvers.numeric.descent import descend
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.solvers.slides import dot, if_finite, triple
from kin.solvers.wrist5.point.roots import real_roots
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ROWS = DEGREE = 4
_KEPT = 4 * DEGREE  # roots, with those that are only touched
_STARTS = 2 * (_KEPT + 1)  # two values of the other joint for each, and for what is near the seed
# Layout of the parameters, lengths in shares of the reach: 1.0 for a joint that turns; the axes and a point of
# each; the directions along which joint 2 leaves coordinates as they are; the tool's point; the reach, the model.
TURNS, AXES, PLACES, ACROSS, TOOL, SIZE, MODEL = 0, 3, 12, 21, 27, 30, 31
_MET, _CLOSE = 1e-10, 1e-3  # shares of the reach: of a configuration, and of a root before its descent
_STEPS, _PATIENCE = 40, 8  # of a descent
_NONE = 1e-14  # of the largest coefficient
_REGULAR = 1e-6  # smallest singular value, of the largest
_MERGE = TOLERANCES.merge
# Of each half of the values of a joint, in t from −1 to 1: polynomials of w[0], w[1] and 1, lowest power first.
# One that slides is at t, or at 1 / t, times t²; one that turns at 2 atan t, or half a turn on, times 1 + t².
_HALVES = np.array(
    [
        [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)],
        [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)],
        [(1.0, 0.0, -1.0), (0.0, 2.0, 0.0), (1.0, 0.0, 1.0)],
        [(-1.0, 0.0, 1.0), (0.0, -2.0, 0.0), (1.0, 0.0, 1.0)],
    ]
)


@jit
def _coordinates(turns: bool, q: float) -> tuple[float, float]:
    """w of a joint at a value."""
    if turns:
        return math.cos(q), math.sin(q)
    return q, q * q


@jit
def _curve(turns: bool, z: Array, place: Array, point: Array, sense: float, start: Array, D: Array) -> None:
    """start ``(3,)``, D ``(3, 2)`` ← the curve ``start + D w`` on which a joint moves a point.

    sense: 1.0 for the joint, −1.0 for its inverse.
    """
    along = dot(z, point) - dot(z, place)
    for i in range(3):
        start[i] = place[i] + along * z[i] if turns else point[i]
        D[i, 0] = point[i] - start[i] if turns else sense * z[i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        D[i, 1] = sense * (z[j] * D[k, 0] - z[k] * D[j, 0]) if turns else 0.0


@jit
def _invariants(params: Array, turns: bool, start: Array, D: Array, N: Array) -> None:
    """N ``(2, 3)`` ← rows (a, b, c) of ``a w[0] + b w[1] + c``: the two numbers of a curve that joint 2 leaves."""
    off = np.empty(3)
    for i in range(3):
        off[i] = start[i] - params[PLACES + 3 + i]
    for r in range(2):
        for k in range(3):
            N[r, k] = 0.0
        for i in range(3):
            part = params[ACROSS + 3 * r + i]
            N[r, 0] += part * D[i, 0]
            N[r, 1] += part * D[i, 1]
            N[r, 2] += part * off[i]
    if params[TURNS + 1] > 0.0:  # |start + D w|², where D w of a joint that turns has one length
        N[1, 0], N[1, 1], N[1, 2] = 0.0, 0.0 if turns else 1.0, dot(off, off)
        for i in range(3):
            N[1, 0] += 2.0 * off[i] * D[i, 0]
            N[1, 1] += 2.0 * off[i] * D[i, 1]
            N[1, 2] += D[i, 0] * D[i, 0] if turns else 0.0


@jit
def _kept_values(M: Array, N: Array, turns: bool, gone_turns: bool, out: Array) -> int:
    """out ``(16,)`` ← the values of the joint with the invariants N, from one polynomial; their number.

    M: those of the joint that is gone, all ``(2, 3)``; whether each of them turns.
    """
    det, count = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0], 0
    L, x, p, roots = np.empty((2, 3)), np.empty((2, 3)), np.empty(DEGREE + 1), np.empty(2 * DEGREE)
    for r in range(2):
        # Row r of the adjugate of M's matrix: a coordinate of the joint that is gone, times the determinant.
        u, v = (M[1, 1], -M[0, 1]) if r == 0 else (-M[1, 0], M[0, 0])
        for k in range(3):
            L[r, k] = u * N[0, k] + v * N[1, k]
        L[r, 2] -= u * M[0, 2] + v * M[1, 2]
    for half in range(2):
        h, largest = half + 2 if turns else half, 0.0
        for r in range(2):
            for k in range(3):
                x[r, k] = L[r, 0] * _HALVES[h, 0, k] + L[r, 1] * _HALVES[h, 1, k] + L[r, 2] * _HALVES[h, 2, k]
        for k in range(DEGREE + 1):
            p[k] = 0.0
        for i in range(3):
            for j in range(3):
                one = det * _HALVES[h, 2, j]
                rest = x[1, i] * x[1, j] - det * _HALVES[h, 2, i] * one if gone_turns else -x[1, i] * one
                p[i + j] += x[0, i] * x[0, j] + rest
        for k in range(DEGREE + 1):
            largest = max(largest, abs(p[k]))
        for i in range(real_roots(p, -1.0, 1.0, roots) if largest >= _NONE else 0):
            t = roots[i]
            if turns:
                out[count] = 2.0 * math.atan(t) + math.pi * half
            else:
                out[count] = t if half == 0 or t == 0.0 else 1.0 / t
            count += 1
    return count


@jit
def _values(turns: bool, a: float, b: float, right: float, near: float, out: Array) -> int:
    """out ``(2,)`` ← the values of a joint at which ``a w[0] + b w[1] = right``, or nearest to it; their number.

    `near` if all do.
    """
    size = math.hypot(a, b)
    if size < _NONE:
        out[0] = near
        return 1
    if turns:
        middle, half = math.atan2(b, a), math.acos(min(max(right / size, -1.0), 1.0))
        out[0], out[1] = middle + half, middle - half
        return 2
    if abs(b) * max(1.0, abs(right)) < _NONE * size:
        out[0] = right / a
        return 1
    root = math.sqrt(max(a * a + 4.0 * b * right, 0.0))
    out[0], out[1] = (-a + root) / (2.0 * b), (-a - root) / (2.0 * b)
    return 2


@jit
def _second(params: Array, first: tuple[Array, Array], last: tuple[Array, Array], q: Array, near: float) -> float:
    """The value of joint 2 between those of the other joints; `near` where both points are on its axis."""
    z, a, b = params[AXES + 3 : AXES + 6], np.empty(3), np.empty(3)
    x, y = _coordinates(params[TURNS + 2] > 0.0, q[2])
    u, v = _coordinates(params[TURNS] > 0.0, q[0])
    for i in range(3):
        a[i] = last[0][i] + last[1][i, 0] * x + last[1][i, 1] * y - params[PLACES + 3 + i]
        b[i] = first[0][i] + first[1][i, 0] * u + first[1][i, 1] * v - params[PLACES + 3 + i]
    if not params[TURNS + 1] > 0.0:
        return float(dot(z, b) - dot(z, a))
    sine, cosine = triple(z, a, b), dot(a, b) - dot(z, a) * dot(z, b)
    return math.atan2(sine, cosine) if math.hypot(sine, cosine) > _NONE else near


@jit
def _starts(params: Array, T: Array, near: Array, q: Array) -> int:
    """q ``(34, 3)`` ← where descents start, in radians and shares of the reach; their number."""
    point, start, D, N = np.empty(3), np.empty((2, 3)), np.empty((2, 3, 2)), np.empty((2, 2, 3))
    for i in range(3):
        point[i] = T[i, 3] / params[SIZE]
    tool, z, places = params[TOOL : TOOL + 3], params[AXES : AXES + 9], params[PLACES : PLACES + 9]
    _curve(params[TURNS] > 0.0, z[:3], places[:3], point, -1.0, start[0], D[0])
    _curve(params[TURNS + 2] > 0.0, z[6:], places[6:], tool, 1.0, start[1], D[1])
    for k in range(2):
        _invariants(params, params[TURNS + 2 * k] > 0.0, start[k], D[k], N[k])
    by_first = abs(N[0, 0, 0] * N[0, 1, 1] - N[0, 0, 1] * N[0, 1, 0]) > abs(
        N[1, 0, 0] * N[1, 1, 1] - N[1, 0, 1] * N[1, 1, 0]
    )
    gone, kept = 0 if by_first else 1, 1 if by_first else 0  # of joints 1 and 3; the first is solved for
    turns, gone_turns = params[TURNS + 2 * kept] > 0.0, params[TURNS + 2 * gone] > 0.0
    M, kept_values = N[gone], np.empty(_KEPT + 1)
    found = _kept_values(M, N[kept], turns, gone_turns, kept_values)
    kept_values[found] = near[2 * kept]
    r = 1 if math.hypot(M[1, 0], M[1, 1]) > math.hypot(M[0, 0], M[0, 1]) else 0
    values, count = np.empty(2), 0
    for k in range(found + 1):
        value = kept_values[k]
        x, y = _coordinates(turns, value)
        right = N[kept, r, 0] * x + N[kept, r, 1] * y + N[kept, r, 2] - M[r, 2]
        for i in range(_values(gone_turns, M[r, 0], M[r, 1], right, near[2 * gone], values)):
            q[count, 2 * kept], q[count, 2 * gone] = value, values[i]
            q[count, 1] = _second(params, (start[0], D[0]), (start[1], D[1]), q[count], near[1])
            count += 1
    return count


@jit
def configurations(params: Array, T: Array, near: Array, out: Array) -> None:
    """out ``(4, 3)`` ← the configurations for the point of a finite target T ``(4, 4)``, then NaN.

    What a singular target leaves free is near ``(3,)``.
    """
    clear(out)
    size, model, q, P = params[SIZE], params[MODEL:], np.empty((_STARTS, 3)), np.empty((4, 4))
    unit, there, misses = np.empty(3), np.empty(3), np.empty(_STARTS)
    for j in range(3):
        unit[j] = 1.0 if params[TURNS + j] > 0.0 else size  # of joint values: radians, metres
        there[j] = near[j] / unit[j]
    starts, least = _starts(params, T, there, q), math.inf
    for i in range(starts):
        for j in range(3):
            q[i, j] *= unit[j]
        fk_into(model, q[i], P)
        misses[i] = math.hypot(math.hypot(P[0, 3] - T[0, 3], P[1, 3] - T[1, 3]), P[2, 3] - T[2, 3])
        least = min(least, misses[i])
    goal, upper = (T, POSITION, np.zeros(7), 1.0), np.full(3, UNBOUNDED)
    bounds, count = (np.full(3, -UNBOUNDED), upper, np.zeros(3)), 0
    for i in range(starts):
        if count == ROWS or (least < _CLOSE * size and not misses[i] < _CLOSE * size):
            continue
        if not descend(model, goal, bounds, _STEPS, _PATIENCE, q[i]) < _MET * size:
            continue
        known = False
        for j in range(3):
            out[count, j] = wrap(q[i, j]) if params[TURNS + j] > 0.0 else q[i, j]
        for k in range(count):
            apart = 0.0
            for j in range(3):
                off = out[count, j] - out[k, j]
                apart = max(apart, abs(wrap(off) if params[TURNS + j] > 0.0 else off))
            known = known or apart < _MERGE
        count += 0 if known else 1
    for i in range(count, ROWS):
        for j in range(3):
            out[i, j] = math.nan


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(4, 3)`` ← the configurations for the point of T ``(4, 4)``, then NaN; False if T is not finite."""
    return if_finite(configurations, params, T, near, out)


branches_many = one_after_another(branches_one)


class Point3(ClosedForm):
    """All configurations of three joints for a point."""

    name, title = "general5", "all solutions, three to five joints"
    branches = tuple(f"solution {i + 1}" for i in range(ROWS))
    lengths = ()
    named = steady = False
    tasks = (POSE, APPROACH, POSITION)  # of all three the point is met, and the caller judges the rest

    def __init__(self, robot: Robot) -> None:
        self.robot, size = robot, extent(robot)
        lines, turns = lines_of(robot, as_counted=True), robot.revolute.astype(np.float64)
        kind = "revolute joints" if robot.revolute.all() else "joints"
        self.reason = f"three {kind} whose axes fit no closed form: a polynomial of degree four"
        self._unit = np.where(robot.revolute, 1.0, size)  # of joint values: radians, metres
        axis = lines.z[1]
        side = perpendicular_to(axis)
        across = [axis, side] if robot.revolute[1] else [side, cross(axis, side)]
        lengths = [lines.points / size, np.stack(across), lines.T_base_tool[:3, 3] / size]
        parts = [turns, lines.z, *lengths, np.array([size]), robot.model]
        params = np.concatenate([np.ravel(part) for part in parts])
        self.kernels = BatchKernels(params, branches_one, branches_many)

    def solve(self, problem: SolverInput) -> Candidates:
        """All configurations; beside singular ones nothing proves that none is missing."""
        q = np.empty((ROWS, 3))
        configurations(self.kernels.params, np.ascontiguousarray(problem.T), problem.seed, q)
        there = q[~np.isnan(q[:, 0])]
        obstacle = None if len(there) else Obstacle("point")
        regular = bool((self._smallest(there) > _REGULAR).all())
        return Candidates(q, np.empty((ROWS, 0)), (), 0.0, obstacle, "proved" if regular else "unknown")

    def _smallest(self, q: Array) -> Array:
        """The smallest singular value of the Jacobian of the point ``(k,)``, of the largest."""
        values = np.linalg.svd(jacobian(self.robot, q)[:, :3] * self._unit, compute_uv=False)
        return np.asarray(values[:, -1] / values[:, 0])

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian of the point."""
        return those_within(within, by_jacobian(jacobian(self.robot, q)[:3], rank=3))
