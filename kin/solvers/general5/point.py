"""All configurations of three joints for a point, where their axes are in no special position.

Seen from axis 2, joint 2 leaves two numbers of a point as they are: where it turns, its height along the axis and
its distance from a point of it; where it slides, the two coordinates across the axis. So they are the same of the
tool's point X, moved by joint 3, and of the target Y, moved back by joint 1. Each is linear in two coordinates of
its joint, w = (cos q, sin q) of one that turns, w = (d, d²) of one that slides:

    A w₁ = B w₃ + c,  two equations.

Solved for one w, whose coordinates are on a circle or a parabola, they leave one polynomial of degree four in the
other joint's value (Pieper 1968). The joint with the smaller determinant stays. No number is divided by it: where
it vanishes, as with axes that are parallel, the polynomial is a square, and Newton steps on the point make up for
the digits that a double root loses.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import apart, wrapped
from kin.axes import cross, lines_of, perpendicular_to
from kin.differential.metric import extent
from kin.fk import fk, jacobian
from kin.robot import Robot
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    Candidates,
    ClosedForm,
    Obstacle,
    PlainKernels,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.singular import Singularity, by_jacobian, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

ROWS = 4
_NEWTON = 12
_MET, _CLOSE = 1e-10, 1e-3  # shares of the reach: of a configuration, and of a root before Newton steps
_NONE = 1e-14  # of the largest coefficient
_REGULAR = 1e-6  # smallest singular value, of the largest


class _Joint:
    """The curve on which a joint moves a point: ``start + D w``, w its coordinates (see above)."""

    def __init__(self, turns: bool, axis: Array, place: Array, point: Array, sense: float) -> None:
        """`sense`: 1.0 for the joint, −1.0 for its inverse; lengths in shares of the reach."""
        self.turns = turns
        if turns:
            along = axis * float(axis @ (point - place))
            arm = point - place - along
            self.start, self.D = place + along, np.column_stack([arm, sense * cross(axis, arm)])
        else:
            self.start, self.D = point, np.column_stack([sense * axis, np.zeros(3)])

    def point(self, q: float) -> Array:
        """Where the joint's value takes the point."""
        w = (math.cos(q), math.sin(q)) if self.turns else (q, q * q)
        return np.asarray(self.start + self.D @ w)

    def invariants(self, turns: bool, axis: Array, place: Array) -> tuple[Array, Array]:
        """The two numbers that joint 2 leaves: ``constant (2,) + M w``, M ``(2, 2)``."""
        off = self.start - place
        if not turns:
            across = perpendicular_to(axis)
            rows = np.stack([across, cross(axis, across)])
            return rows @ off, rows @ self.D
        square = 2.0 * off @ self.D
        if not self.turns:
            square[1] = 1.0  # |D w|² = d²
        constant = float(off @ off) + (float(self.D[:, 0] @ self.D[:, 0]) if self.turns else 0.0)
        return np.array([axis @ off, constant]), np.stack([axis @ self.D, square])

    def values(self, row: Array, right: float) -> list[float]:
        """The values at which ``row · w = right``, or comes nearest to it: one or two, none if all do."""
        a, b = row.tolist()
        size = math.hypot(a, b)
        if size < _NONE:
            return []
        if self.turns:
            half = math.acos(min(max(right / size, -1.0), 1.0))
            return [math.atan2(b, a) + half, math.atan2(b, a) - half]
        if abs(b) * max(1.0, abs(right)) < _NONE * size:
            return [right / a]
        root = math.sqrt(max(a * a + 4.0 * b * right, 0.0))
        return [(-a + root) / (2.0 * b), (-a - root) / (2.0 * b)]


def _roots(kept: _Joint, gone: _Joint, M: Array, N: Array, c: Array) -> list[float]:
    """The values of the kept joint with ``M w' = N w + c`` for coordinates w' of the joint that is gone."""
    det = float(M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0])
    adjugate = np.array([[M[1, 1], -M[0, 1]], [-M[1, 0], M[0, 0]]])
    # w' times the determinant: polynomials in e^iq of degrees −1 to 1, or in d of degrees 0 to 2.
    L = np.column_stack([adjugate @ N, adjugate @ c])
    if kept.turns:
        x, y = (np.array([0.5 * (a + 1j * b), k, 0.5 * (a - 1j * b)]) for a, b, k in L)
    else:
        x, y = (np.array([k, a, b]) for a, b, k in L)
    constant = 2 if kept.turns else 0  # the index of degree 0
    p = np.convolve(x, x)
    if gone.turns:
        p += np.convolve(y, y)
        p[constant] -= det * det
    else:
        p[constant // 2 : constant // 2 + 3] -= det * y
    largest = float(np.abs(p).max())
    if largest < _NONE:
        return []
    p[np.abs(p) < _NONE * largest] = 0.0
    roots = np.roots(p[::-1])
    found: list[float] = (np.angle(roots) if kept.turns else roots.real).tolist()
    return found


class Point3(ClosedForm):
    """All configurations of three joints for a point."""

    name, title = "general5", "all solutions, three to five joints"
    branches = tuple(f"solution {i + 1}" for i in range(ROWS))
    lengths = ()
    named = steady = False

    def __init__(self, robot: Robot) -> None:
        self.robot, self._size = robot, extent(robot)
        lines = lines_of(robot, as_counted=True)
        self._turns, self._z, self._places = robot.revolute.tolist(), lines.z, lines.points / self._size
        self._tool = lines.T_base_tool[:3, 3] / self._size
        kind = "revolute joints" if robot.revolute.all() else "joints"
        self.reason = f"three {kind} whose axes fit no closed form: a polynomial of degree four"
        self._unit = np.where(robot.revolute, 1.0, self._size)  # of joint values: radians, metres
        self.kernels = PlainKernels(np.empty(0), self._one, self._many)

    def handles(self, task: int) -> bool:
        """Points; of a pose or an approach direction the point is met, and the caller judges the rest."""
        return task in (POSE, APPROACH, POSITION)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """None."""
        return ()

    def solve(self, problem: SolverInput) -> Candidates:
        """All configurations; beside singular ones nothing proves that none is missing."""
        q = self._configurations(problem.T, problem.seed)
        there = q[~np.isnan(q[:, 0])]
        obstacle = None if len(there) else Obstacle("point")
        regular = bool((self._smallest(there) > _REGULAR).all())
        return Candidates(q, np.empty((ROWS, 0)), (), 0.0, obstacle, "proved" if regular else "unknown")

    def _smallest(self, q: Array) -> Array:
        """The smallest singular value of the Jacobian of the point ``(k,)``, of the largest."""
        values = np.linalg.svd(jacobian(self.robot, q)[:, :3] * self._unit, compute_uv=False)
        return np.asarray(values[:, -1] / values[:, 0])

    def _one(self, params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
        finite = bool(np.isfinite(T).all())
        out[:] = self._configurations(T, near) if finite else math.nan
        return finite

    def _many(self, params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
        for target, rows in zip(T, out, strict=True):
            self._one(params, target, math.nan, near, rows)

    def _configurations(self, T: Array, near: Array) -> Array:
        """The configurations ``(4, 3)`` for the point of a target, NaN where there are no more.

        What a singular target leaves free is near ``(3,)``.
        """
        target, near = T[:3, 3] / self._size, near / self._unit
        first = _Joint(self._turns[0], self._z[0], self._places[0], target, -1.0)
        last = _Joint(self._turns[2], self._z[2], self._places[2], self._tool, 1.0)
        middle = self._turns[1], self._z[1], self._places[1]
        (c1, A), (c3, B) = first.invariants(*middle), last.invariants(*middle)
        by_first = abs(np.linalg.det(A)) > abs(np.linalg.det(B))  # the joint that is solved for
        gone, M, kept, N, c = (first, A, last, B, c3 - c1) if by_first else (last, B, first, A, c1 - c3)
        place, free = (2, 0) if by_first else (0, 2)
        row = int(np.argmax(np.hypot(*M.T)))
        starts = []
        for value in [*_roots(kept, gone, M, N, c), float(near[place])]:
            w = np.array((math.cos(value), math.sin(value)) if kept.turns else (value, value * value))
            for other in gone.values(M[row], float(N[row] @ w + c[row])) or [float(near[free])]:
                q = np.empty(3)
                q[place], q[free] = value, other
                q[1] = self._second(last.point(q[2]), first.point(q[0]), float(near[1]))
                starts.append(q)
        return self._distinct(self._polished(np.array(starts) * self._unit, T[:3, 3]))

    def _second(self, start: Array, end: Array, near: float) -> float:
        """The value of joint 2 that moves a point to another; `near` where both are on its axis."""
        axis, place = self._z[1], self._places[1]
        if not self._turns[1]:
            return float(axis @ (end - start))
        a, b = start - place, end - place
        sine, cosine = float(axis @ cross(a, b)), float(a @ b - (axis @ a) * (axis @ b))
        return math.atan2(sine, cosine) if math.hypot(sine, cosine) > _NONE else near

    def _polished(self, q: Array, point: Array) -> Array:
        """Configurations ``(k, 3)`` after Newton steps to the point, as long as they bring them nearer."""
        error = point - fk(self.robot, q)[:, :3, 3]
        miss = np.linalg.norm(error, axis=1)
        if (close := miss < _CLOSE * self._size).any():
            q, error, miss = q[close], error[close], miss[close]
        for _ in range(_NEWTON):
            if miss.max(initial=0.0) < _NONE * self._size:
                break
            J = jacobian(self.robot, q)[:, :3] * self._unit
            step = (np.linalg.pinv(J, rcond=1e-9) @ error[..., None])[..., 0] * self._unit
            there = q + step
            left = point - fk(self.robot, there)[:, :3, 3]
            nearer = np.linalg.norm(left, axis=1) < miss
            if not nearer.any():
                break
            q, error = np.where(nearer[:, None], there, q), np.where(nearer[:, None], left, error)
            miss = np.linalg.norm(error, axis=1)
        return np.asarray(q[miss < _MET * self._size])

    def _distinct(self, q: Array) -> Array:
        """The rows ``(k, 3)``, angles in (−π, π], each once, filled up with NaN."""
        q = np.where(self.robot.revolute, wrapped(q), q)
        out, count = np.full((ROWS, 3), math.nan), 0
        for row in q:
            if count < ROWS and not (apart(out[:count], row, self.robot.revolute) < TOLERANCES.merge).any():
                out[count] = row
                count += 1
        return out

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The smallest singular value of the Jacobian of the point."""
        return those_within(within, by_jacobian(jacobian(self.robot, q)[:3], rank=3))
