"""SCARA and planar arms: every axis parallel, three joints that turn and at most one that slides.

Seen along the axes such an arm is a planar chain of two links that carries a tool; the slide, wherever it is in
the chain, only adds to the height z. So the order of the joints (RRPR, RRRP, PRRR, …) makes no difference:

- the angle of the tool ψ is the sum of the joint angles; ψ and the tool's point give the third axis c;
- tan²(θ2/2) = ((a+b)² − |c|²)/(|c|² − (a−b)²), elbow right or left; θ1 = atan2(cy, cx) − atan2(b s2, a + b c2);
- θ3 = ψ − θ1 − θ2, and the slide makes up the height.

Two branches. Only rotations about the axes are reachable: for any other orientation, ψ is the nearest angle and
the tool's point is kept; without a slide the height must fit. The caller decides from the residual whether to
accept the result. When the task is only a point or an approach direction, ψ is the redundancy parameter, and the
values that reach and limits allow are exact arcs. Singular: s2 = 0 only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.angles import wrap
from kin.axes import frame_of, is_along, is_zero, lines_of, perpendicular_to
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import wrapped
from kin.robot import Robot
from kin.solvers.blocks import OWN, Arc, double, elbow_of, in_base, kernels_in_lanes, rows_of, single
from kin.solvers.canonical import pose_params, signed_box
from kin.solvers.common import HIGH, LOW, NEAR, clear, copy_row, split_sum
from kin.solvers.contract import (
    APPROACH,
    POSE,
    POSITION,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.names import Names, left_or_right, names_of, stance_of
from kin.solvers.planar import BASE, LINKS, TOOL, TOOL_X, TOOL_Y, TOOL_Z, held, planar_free, two_links
from kin.solvers.singular import Singularity, by_angle, elbow_at, off_line, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "scara4"
TITLE = "closed form, all axes parallel"
_PSI = RedundancyParameter("psi", "tool angle ψ", circular=True)
_REACH = TOLERANCES.reach
_SINGULAR = TOLERANCES.singular
# Layout of the parameter array: base⁻¹ and the tool, see `kin.solvers.planar`; the two links; for θ1, θ2, θ3 and
# the height the index of the joint (−1: none), its sign and offset; whether the tool is upright.
_A, _B, _JOINT, _SIGN, _OFFSET, _UPRIGHT = LINKS, LINKS + 1, 26, 30, 34, 38


class Geometry(NamedTuple):
    """The arm in canonical form: θ1, θ2, θ3 and the height are ``sign q + offset``.

    Attributes:
        params: what the kernels read.
        order: indices into q of θ1, θ2, θ3 and, if there is one, the slide.
        sign, offset: ``(4,)``, in that order.
        a, b: lengths of the two links.
        upright: whether the tool's z axis is parallel to the arm's axes.
    """

    params: Array
    order: tuple[int, ...]
    sign: Array
    offset: Array
    a: float
    b: float
    upright: bool


def match(robot: Robot) -> Scara4 | None:
    """The closed form if all axes are parallel, three joints turn and at most one slides."""
    turning = np.flatnonzero(robot.revolute).tolist()
    if len(turning) != 3 or robot.n > 4:
        return None
    lines = lines_of(robot)
    z, points = lines.z, lines.points
    if not is_zero(*np.cross(z[0], z).ravel()):
        return None
    # ψ is the sum of the joint angles: x of this frame is where it is counted from.
    base = frame_of(perpendicular_to(z[0]), z[0], points[turning[0]])
    x, y, _ = base[:3, :3].T @ (points[turning] - base[:3, 3]).T
    upper, fore = complex(x[1] - x[0], y[1] - y[0]), complex(x[2] - x[1], y[2] - y[1])
    if min(abs(upper), abs(fore)) < TOLERANCES.geometry:
        return None
    first, second = (math.atan2(link.imag, link.real) for link in (upper, fore))
    order = (*turning, *(i for i in range(robot.n) if i not in turning))
    sign = np.append(lines.sign[list(order)], [1.0] * (4 - robot.n))
    offset = np.array([first, second - first, -second, 0.0])
    wrist = frame_of(base[:3, 0], z[0], base[:3, 3] + base[:3, 0] * x[2] + base[:3, 1] * y[2])
    tool = np.linalg.inv(wrist) @ lines.T_base_tool
    upright = is_along(tool)
    lengths, joints = [abs(upper), abs(fore)], [*order, *[-1] * (4 - robot.n)]
    pose = [*pose_params(base, np.eye(4))[:TOOL], *tool[:3].ravel()]
    params = np.array([*pose, *lengths, *joints, *sign, *offset, float(upright)])
    return Scara4(Geometry(params, order, sign, offset, abs(upper), abs(fore), upright), robot)


@jit
def _put(params: Array, out: Array, row: int, t1: float, t2: float, t3: float, z: float) -> None:
    """out[row] ← joint values of canonical angles and of the tool's height."""
    out[row, int(params[_JOINT])] = wrap(params[_SIGN] * (t1 - params[_OFFSET]))
    out[row, int(params[_JOINT + 1])] = wrap(params[_SIGN + 1] * (t2 - params[_OFFSET + 1]))
    out[row, int(params[_JOINT + 2])] = wrap(params[_SIGN + 2] * (t3 - params[_OFFSET + 2]))
    slide = int(params[_JOINT + 3])
    if slide >= 0:
        out[row, slide] = params[_SIGN + 3] * (z - params[TOOL_Z] - params[_OFFSET + 3])


@jit
def _box(params: Array, near: Array, lower: Array, upper: Array) -> Array:
    """Seed and limits of θ1, θ2, θ3 ``(3, 4)``; the last column stands for no joint."""
    a, b, c, box = np.zeros(4), np.zeros(4), np.zeros(4), np.empty((3, 4))
    for i in range(3):
        k = int(params[_JOINT + i])
        a[i], b[i], c[i] = near[k], lower[k], upper[k]
    signed_box(a, b, c, params[_SIGN:_OFFSET], params[_OFFSET:_UPRIGHT], box)
    return box


@jit
def _branches(
    params: Array, T: Array, request: tuple[int, float], near: Array, lower: Array, upper: Array, arcs: Array,
    out: Array,
) -> tuple[float, int]:  # fmt: skip
    """out ``(2, n)`` ← both branches: (gap in metres, number of arcs of ψ or −1 if it is fixed).

    request: the task, and a value of ψ, which is free for a point, and for an approach direction along the axes.
    It is then that value, or near the seed's if that is NaN, and out has one column more for it.
    """
    task, value = request
    clear(out)
    x, y, z, psi = held(params, T, task)
    a, b, p, q = params[_A], params[_B], params[TOOL_X], params[TOOL_Y]
    if task == POSITION or (task == APPROACH and params[_UPRIGHT] != 0.0):
        box, angles = _box(params, near, lower, upper), np.empty(4)
        fixed = not math.isnan(value)
        wanted = value if fixed else box[NEAR, 0] + box[NEAR, 1] + box[NEAR, 2]
        arm = (x, y, p, q, a, b)
        found = 0
        for ei in range(2):
            last = (1.0 if ei == 0 else -1.0, 0.0, 0.0)
            psi, found = planar_free(arm, last, (wanted, fixed), ei, box, arcs, found, angles)
            if not math.isnan(psi):
                out[ei, out.shape[1] - 1] = psi
                _put(params, out, ei, angles[0], angles[1], angles[2], z)
        # How far the circle that the third axis may be on is from the reach of the two links.
        R, rho = math.hypot(x, y), math.hypot(p, q)
        return max(abs(R - rho) - a - b, abs(a - b) - R - rho), found
    c, s = math.cos(psi), math.sin(psi)
    cx, cy = x - p * c + q * s, y - p * s - q * c
    miss, bend, _, k1, k2 = two_links(cx, cy, a, b)
    if miss > _REACH:
        return miss, -1
    middle, half = math.atan2(cy, cx), math.atan2(k2, k1)
    for ei in range(2 if bend > 0.0 else 1):
        up = 1.0 if ei == 0 else -1.0
        t1, t2 = middle - up * half, up * bend
        if cx * cx + cy * cy < _SINGULAR * _SINGULAR:
            # The third axis on the first: only θ1 + θ3 counts.
            box = _box(params, near, lower, upper)
            seed, low, high = box[NEAR], box[LOW], box[HIGH]
            t1 = split_sum(psi - t2, seed[0], low[0], high[0], seed[2], low[2], high[2])
        _put(params, out, ei, t1, t2, psi - t1 - t2, z)
    if bend == 0.0:
        copy_row(out, 0, 1)
    return miss, -1


# Both branches of a regular pose, where neither limits nor the seed count, see :mod:`kin.solvers.blocks`. Rows of
# S are θ2, of which the other is −θ2, ψ, and θ1 of both branches; θ3 is what ψ leaves.
_BEND, _SUM, _UPPER, _END = OWN, OWN + 1, OWN + 2, OWN + 4
_PAIRS, _HEIGHT, _ROWS = _END - OWN, _END + _END - OWN, _END + _END - OWN + 2
_REST = _PAIRS + _UPPER  # θ3
_TINY = 1e-20  # where ψ is anything


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those that need the careful kernel, and how many these are."""
    k, t = rows_of(params, BASE), rows_of(params, TOOL)
    a, b = params[_A], params[_B]
    sign, height = params[_SIGN + 3], params[_OFFSET + 3]
    found = 0
    for i in range(count):
        cosine = sine = 0.0
        for j in range(3):
            x, y, _ = in_base(k, S, j, i)
            cosine += x * t[j] + y * t[4 + j]
            sine += y * t[j] - x * t[4 + j]
        norm2 = cosine * cosine + sine * sine
        inverse = math.sqrt(norm2) / norm2
        c, s = cosine * inverse, sine * inverse
        x, y, z = in_base(k, S, 3, i)
        cx, cy = x + k[3] - t[3] * c + t[7] * s, y + k[7] - t[3] * s - t[7] * c
        c2, s2, scale, close = elbow_of(cx * cx + cy * cy, a, b)
        S[_BEND, i], S[_PAIRS + _BEND, i] = s2, c2
        S[_SUM, i], S[_PAIRS + _SUM, i] = sine, cosine
        A, B = a + b * c2, b * s2
        S[_UPPER, i], S[_PAIRS + _UPPER, i] = (cy * A - cx * B) * scale, (cx * A + cy * B) * scale
        S[_UPPER + 1, i], S[_PAIRS + _UPPER + 1, i] = (cy * A + cx * B) * scale, (cx * A - cy * B) * scale
        S[_HEIGHT, i] = sign * (z + k[11] - t[11] - height) + 0.0 * c2
        marked = close | (norm2 < _TINY)
        S[-1, i] = 1.0 if marked else 0.0
        found += 1 if marked else 0
    return found


@inlined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    s1, s2, s3 = params[_SIGN], params[_SIGN + 1], params[_SIGN + 2]
    o1, o2, o3 = params[_OFFSET], params[_OFFSET + 1], params[_OFFSET + 2]
    double(arc, S, _BEND, _SUM, _PAIRS, count, s2, o2, False)
    # ψ as the third joint would have it with the first two at 0.
    single(arc, S, _SUM, _UPPER, _PAIRS, count, s3, o1 + o2 + o3)
    single(arc, S, _UPPER, _END, _PAIRS, count, s1, o1)
    for b in range(count):
        psi = S[_SUM, b]
        S[_REST, b] = wrapped(wrapped(psi - s3 * s1 * S[_UPPER, b]) - s3 * s2 * S[_BEND, b])
        S[_REST + 1, b] = wrapped(wrapped(psi - s3 * s1 * S[_UPPER + 1, b]) - s3 * s2 * S[_PAIRS + _BEND, b])


@inlined
def _store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(2, n)`` ← the branches of target b."""
    for row in range(2):
        out[row, int(params[_JOINT])] = S[_UPPER + row, b]
        out[row, int(params[_JOINT + 1])] = S[_PAIRS * row + _BEND, b]
        out[row, int(params[_JOINT + 2])] = S[_REST + row, b]
        if params[_JOINT + 3] >= 0.0:
            out[row, int(params[_JOINT + 3])] = S[_HEIGHT, b]


@jit
def _careful(
    params: Array, T: Array, value: float, near: Array, lower: Array, upper: Array, arcs: Array, out: Array
) -> tuple[float, int]:
    """As `_branches`, which also handles singular targets, for a pose."""
    return _branches(params, T, (POSE, value), near, lower, upper, arcs, out)


branches_one, branches_many, solve_one, solve_many = kernels_in_lanes(
    __name__, _pairs, _angles, _store, _careful, _ROWS, _PAIRS
)


class Scara4(ClosedForm):
    """The closed form of a SCARA or planar arm."""

    name, title, quick = NAME, TITLE, (POSE,)
    tasks = (POSE, APPROACH, POSITION)  # `kin.ik` judges the tilt that is left

    def __init__(self, geometry: Geometry, robot: Robot) -> None:
        g = self.geometry = geometry
        self.reason = "all axes are parallel" + ", and one joint slides" * (len(g.order) == 4)
        self.lengths = (g.a, g.b)
        self.kernels = BatchKernels(g.params, branches_one, branches_many, seeded=solve_many)
        self.branches, self.meanings = self.names(robot, np.ones(robot.n))

    def names(self, robot: Robot, sense: Array) -> Names:
        """The rows are the signs of s2: positive with the elbow on the right, where z is up."""
        g = self.geometry
        sense1 = float(g.sign[0] * sense[g.order[0]])
        stance = stance_of(robot, g.params[BASE:TOOL].reshape(3, 4), float(g.offset[0]), sense1)
        return names_of(
            (left_or_right(stance, "elbow", "the elbow", "the last axis").times(-1.0),), [(1.0,), (-1.0,)]
        )

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The tool's angle about the axes, for a point alone or for a direction along the axes."""
        return (_PSI,) if task == POSITION or (task == APPROACH and self.geometry.upright) else ()

    def solve(self, problem: SolverInput) -> Candidates:
        """Both branches that bring the tool to the target's point, at the requested ψ or the best one."""
        g, n = self.geometry, len(self.geometry.order)
        free = bool(self.redundancies(problem.task))
        out, arcs = np.empty((2, n + free)), np.empty((64, 3))
        value = problem.values[0] if free else math.nan
        p = problem
        if p.task == POSE:
            gap, count = solve_one(g.params, p.T, value, p.seed, p.lower, p.upper, arcs, out)
        else:
            gap, count = _branches(g.params, p.T, (p.task, value), p.seed, p.lower, p.upper, arcs, out)
        exists = bool((~np.isnan(out[:, 0])).any())
        obstacle = None if exists else Obstacle("last axis beyond the links' reach")
        ranges = (arcs[:count],) if free else ()
        return Candidates(out[:, :n], out[:, n:], ranges, 0.0 if exists else max(gap, 0.0), obstacle)

    def value_at(self, T: Array, q: Array) -> float:
        """The tool's angle about the axes."""
        g, turning = self.geometry, list(self.geometry.order[:3])
        return wrap(float(g.sign[:3] @ q[turning] + g.offset[:3].sum()))

    def _elbow(self, q: Array) -> float:
        """θ2: 0 where the arm is straight."""
        g = self.geometry
        return float(g.sign[1] * q[g.order[1]] + g.offset[1])

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the sign of s2."""
        return int(math.sin(self._elbow(q)) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The elbow: the determinant is a b s2."""
        g, elbow = self.geometry, self._elbow(q)
        off, joint = off_line(elbow), g.order[1]
        return those_within(
            within, by_angle("elbow", elbow_at(elbow), "last axis along the arm", off, q, joint, g.sign[1])
        )
