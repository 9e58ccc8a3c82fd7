"""The tool as a function of one or two joints, and the numbers of it that joint 1 does not change."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.axes import frame_of, inverse, lines_of, perpendicular_to, size
from kin.kernels.compile import jit
from kin.robot import Robot
from kin.solvers.contract import APPROACH, POSE, POSITION
from kin.transforms import Array

# Layout of the parameter array: the task of the batch kernels, the number of joints, which of two turn (1.0), the
# arm's size, base⁻¹ ``(3, 4)``, and `Geometry.fixed` and `Geometry.wave`.
TASK, JOINTS, TURNS, SCALE, BASE, FIXED, WAVE, SIZE = 0, 1, 2, 4, 5, 17, 29, 53
MOST = 11  # numbers that joint 1 does not change


class Geometry(NamedTuple):
    """The tool in a frame whose z axis is axis 1.

    The point (k = 0) and the tool's three directions (k = 1, 2, 3; in arm sizes) are
    ``fixed[k] + x wave[0, k] + y wave[1, k]`` before joint 1 moves them, with (x, y) = (cos θ2, sin θ2) if joint 2
    turns, (d2, 0) if it slides, (0, 0) if there is none.

    Attributes:
        base: base⁻¹ ``(4, 4)``, with lengths in arm sizes.
        fixed, wave: ``(4, 3)``, ``(2, 4, 3)``.
        turns: which of the joints turn.
        scale: the arm's size, metres.
    """

    base: Array
    fixed: Array
    wave: Array
    turns: tuple[bool, ...]
    scale: float

    @property
    def rows(self) -> int:
        """How many configurations there may be."""
        return 1 if len(self.turns) == 1 or not any(self.turns) else 2

    def params(self, task: int) -> Array:
        """What the kernels read; `task` is that of the batch kernels."""
        turns = [float(turns) for turns in (*self.turns, False)[:2]]
        start = [float(task), float(len(self.turns)), *turns, self.scale]
        return np.array([*start, *self.base[:3].ravel(), *self.fixed.ravel(), *self.wave.ravel()])


def geometry_of(robot: Robot) -> Geometry:
    """The geometry of an arm with one or two joints."""
    lines, scale, turns = lines_of(robot, as_counted=True), size(robot), tuple(robot.revolute.tolist())
    frame = frame_of(perpendicular_to(lines.z[0]), lines.z[0], lines.points[0])
    base = inverse(frame)
    M = base @ lines.T_base_tool
    fixed = np.vstack([M[:3, 3] / scale, M[:3, :3].T])
    wave = np.zeros((2, 4, 3))
    if len(turns) == 2:
        u = base[:3, :3] @ lines.z[1]
        if turns[1]:
            a = (base[:3, :3] @ lines.points[1] + base[:3, 3]) / scale
            v = fixed - np.array([a, *np.zeros((3, 3))])
            along = (v @ u)[:, None] * u
            wave[0], wave[1] = v - along, np.cross(u, v)
            fixed = fixed - wave[0]
        else:
            wave[0, 0] = u
    base[:3, 3] /= scale
    return Geometry(base, fixed, wave, turns, scale)


@jit
def is_kept(task: int, k: int) -> bool:
    """Whether a task keeps the tool's point (k = 0), or its direction x, y, z (1, 2, 3)."""
    return k == 0 or task == POSE or (task == APPROACH and k == 3)


@jit
def see(params: Array, T: Array, seen: Array) -> None:
    """seen ``(4, 3)`` ← point and directions of a target in the frame of axis 1."""
    for r in range(3):
        base = params[BASE + 4 * r : BASE + 4 * r + 4]
        for k in range(4):
            column = k - 1 if k else 3
            seen[k, r] = base[0] * T[0, column] + base[1] * T[1, column] + base[2] * T[2, column]
        seen[0, r] = seen[0, r] / params[SCALE] + base[3]


@jit
def before_joint_1(params: Array, x: float, y: float, v: Array) -> None:
    """v ``(4, 3)`` ← point and directions before joint 1 moves them."""
    for i in range(12):
        v[i // 3, i % 3] = params[FIXED + i] + x * params[WAVE + i] + y * params[WAVE + 12 + i]


@jit
def moved(params: Array, q: Array, v: Array, J: Array) -> None:
    """v ``(4, 3)`` ← point and directions, in arm sizes; J ``(4, 3, 2)`` ← their derivatives."""
    n, scale = int(params[JOINTS]), params[SCALE]
    x = y = dx = dy = 0.0
    if n == 2 and params[TURNS + 1]:
        x, y = math.cos(q[1]), math.sin(q[1])
        dx, dy = -y, x
    elif n == 2:
        x, dx = q[1] / scale, 1.0
    before_joint_1(params, x, y, v)
    c, s = math.cos(q[0]), math.sin(q[0])
    for k in range(4):
        for r in range(3):
            i = 3 * k + r
            J[k, r, 0] = 0.0
            J[k, r, 1] = dx * params[WAVE + i] + dy * params[WAVE + 12 + i]
        if params[TURNS]:
            a, b = v[k, 0], v[k, 1]
            v[k, 0], v[k, 1] = c * a - s * b, s * a + c * b
            a, b = J[k, 0, 1], J[k, 1, 1]
            J[k, 0, 1], J[k, 1, 1] = c * a - s * b, s * a + c * b
            J[k, 0, 0], J[k, 1, 0] = -v[k, 1], v[k, 0]
        elif k == 0:
            v[0, 2] += q[0] / scale
            J[0, 2, 0] = 1.0


@jit
def invariants(params: Array, seen: Array, task: int, A: Array, b: Array) -> int:
    """A ``(MOST, 2)`` and b ``(MOST,)`` with ``A (x, y) = b`` for what joint 1 does not change; how many rows."""
    f, w = params[FIXED:WAVE].reshape(4, 3), params[WAVE:SIZE].reshape(2, 4, 3)
    m = 0
    for k in range(4):
        if not is_kept(task, k):
            continue
        # Where joint 1 slides, it changes the height of the point only; where it turns, no height.
        for i in range(3):
            if (i < 2 or k > 0) if not params[TURNS] else i == 2:
                A[m, 0], A[m, 1], b[m] = w[0, k, i], w[1, k, i], seen[k, i] - f[k, i]
                m += 1
        if not params[TURNS]:
            continue
        # p · v and (z × p) · v: where v is the point itself, the waves are perpendicular and of one length.
        for across in range(2 if k else 1):
            A[m, 0] = _product(w[0, 0], f[k], across) + _product(f[0], w[0, k], across)
            A[m, 1] = _product(w[1, 0], f[k], across) + _product(f[0], w[1, k], across)
            both = _product(w[0, 0], w[0, k], across) + _product(w[1, 0], w[1, k], across)
            b[m] = _product(seen[0], seen[k], across) - _product(f[0], f[k], across) - 0.5 * both
            m += 1
    return m


@jit
def _product(p: Array, v: Array, across: int) -> float:
    """p · v, or (z × p) · v."""
    return float(p[0] * v[1] - p[1] * v[0] if across else p[0] * v[0] + p[1] * v[1] + p[2] * v[2])


@jit
def main_direction(A: Array, m: int) -> tuple[float, float, float]:
    """The direction that rows ``(m, 2)`` determine best, in the sense of the longest of them: (x, y, how well)."""
    xx = xy = yy = longest = 0.0
    row = 0
    for i in range(m):
        xx, xy, yy = xx + A[i, 0] * A[i, 0], xy + A[i, 0] * A[i, 1], yy + A[i, 1] * A[i, 1]
        length = A[i, 0] * A[i, 0] + A[i, 1] * A[i, 1]
        if length > longest * (1.0 + 1e-12):
            longest, row = length, i
    half = 0.5 * math.atan2(2.0 * xy, xx - yy)
    x, y = math.cos(half), math.sin(half)
    if m and A[row, 0] * x + A[row, 1] * y < 0.0:
        x, y = -x, -y
    total = 0.0
    for i in range(m):
        total += (A[i, 0] * x + A[i, 1] * y) ** 2
    return x, y, math.sqrt(total)


def straight(g: Geometry) -> float:
    """θ2 where the point is farthest from a first axis that is parallel to the second."""
    A, b = np.empty((MOST, 2)), np.empty(MOST)
    x, y, _ = main_direction(A, invariants(g.params(POSE), g.fixed, POSITION, A, b))
    return math.atan2(y, x)
