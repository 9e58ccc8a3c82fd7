"""The Pioneer family: a turning base, a planar two-link elbow and a two-axis wrist, five joints.

Five joints meet five demands: the tool point p and the approach direction a (the tool's z axis). The roll about
a is then whatever it is. With w = p − d6 a the wrist centre, r = hypot(wx, wy), ρ = ±r − a1, h = −wz (from the
shoulder's height), D² = ρ² + h²:

- θ1 = atan2(±wy, ±wx), shoulder in front or at the back;
- tan²(θ3/2) = ((a2+d4)² − D²)/(D² − (a2−d4)²), elbow up or down; θ2 = atan2(h, ρ) − atan2(d4 s3, a2 + d4 c3);
- u = R03ᵀ a = (−c4 s5, −s4 s5, c5): θ4 = atan2(∓u2, ∓u1), then θ5 = atan2(−(c4u1 + s4u2), u3).

Eight branches, four when one shoulder side is out of reach. Singular: s3 = 0 (roots merge); s5 = 0 (θ4 free);
the wrist centre on axis 1: θ1 is free, u is affine in cos θ1, sin θ1, and the feasible θ1 are exact arcs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK
from kin.kernels.simd import widest
from kin.robot import Robot
from kin.solvers.blocks import OWN, Arc, double, each, elbow_of, in_base, one, rows_of, single
from kin.solvers.common import (
    TURN,
    add_roots,
    chain_of,
    clear,
    copy_row,
    extend_arcs,
    inverse,
    is_zero,
    lay_probes,
    merged,
    misfit_of,
    nearest_in_arcs,
    screw_x,
    screw_z,
    shifted,
    to_canonical,
    wrap,
)
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
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, those_within
from kin.solvers.wrist5 import point
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "wrist5"
TITLE = "closed form, elbow arm with a two-axis wrist"
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s, elbows in (("front", ("up", "down")), ("back", ("down", "up")))
    for e in elbows
    for w in ("no-flip", "flip")
)
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0, circular=True, rare=True)
_REACH = TOLERANCES.closure_position * 0.1
_SINGULAR = TOLERANCES.singular
_EYE = np.eye(4)


class Geometry(NamedTuple):
    """The arm in canonical form: joint values are q = θ − offset."""

    inverse_base: Array
    offset: Array
    a1: float
    a2: float
    d4: float
    d6: float


def match(robot: Robot) -> Wrist5 | None:
    """The closed form if axes 2 and 3 are parallel, perpendicular to axis 1, and 3-4, 4-5 meet at right angles."""
    chain = chain_of(robot) if robot.n == 5 else None
    chain = chain.twisted((-1, 0, -1, 1)) if chain else None
    if chain is None or not is_zero(*chain.a[2:], chain.d[1] + chain.d[2]):
        return None
    theta, d = chain.theta, chain.d
    a1, a2, d4 = float(chain.a[0]), float(chain.a[1]), float(d[3])
    if min(abs(a2), d4) < TOLERANCES.geometry:
        return None
    tool = screw_x(0.0, math.pi / 2) @ screw_z(0.0, float(d[4])) @ chain.tool
    if abs(tool[2, 2] + 1.0) < TOLERANCES.geometry:
        theta[4] += math.pi
        tool = screw_x(0.0, math.pi / 2) @ screw_z(math.pi, float(d[4])) @ chain.tool
    if not is_zero(tool[0, 3], tool[1, 3], tool[2, 2] - 1.0):
        return None
    # In the formulas θ3 = 0 is the straight elbow, a quarter turn from where the common normals align.
    theta[2] += math.pi / 2
    base = chain.base @ screw_z(0.0, float(d[0]))
    if a2 < 0:
        # A negative length is two half turns: Tx(−a) = Rz(π) Tx(a) Rz(−π).
        theta[1] += math.pi
        theta[2] -= math.pi
        a2 = -a2
    return Wrist5(Geometry(inverse(base), theta, a1, a2, d4, float(tool[2, 3])))


@jit
def _wrist(
    t1: float, t23: float, a: Array, flip: float, near4: float, low4: float, high4: float, out: Array
) -> None:
    """out[3], out[4] ← θ4, θ5 that point the tool along a, given θ1 and θ2 + θ3."""
    c1, s1, c23, s23 = math.cos(t1), math.sin(t1), math.cos(t23), math.sin(t23)
    level = c1 * a[0] + s1 * a[1]
    u1 = s23 * level + c23 * a[2]
    u2 = s1 * a[0] - c1 * a[1]
    u3 = c23 * level - s23 * a[2]
    singular = math.hypot(u1, u2) < _SINGULAR
    t4 = min(max(near4, low4), high4) if singular else math.atan2(-flip * u2, -flip * u1)
    out[3] = t4
    out[4] = math.atan2(-(math.cos(t4) * u1 + math.sin(t4) * u2), u3)


@jit
def _base_breaks(t23: float, a: Array, low: Array, high: Array, breaks: Array) -> int:
    """θ1 where a limit of θ1, θ4 or θ5 may be met when the wrist centre is on axis 1."""
    c23, s23 = math.cos(t23), math.sin(t23)
    count = 0
    for side in range(2):
        if high[0] - low[0] < TURN:
            breaks[count] = wrap(low[0] if side == 0 else high[0])
            count += 1
        if high[3] - low[3] < TURN:
            t = low[3] if side == 0 else high[3]
            c, s = math.cos(t), math.sin(t)
            count = add_roots(
                -a[1] * c - s23 * a[0] * s, a[0] * c - s23 * a[1] * s, -c23 * a[2] * s, breaks, count
            )
        if high[4] - low[4] < TURN:
            t = low[4] if side == 0 else high[4]
            count = add_roots(c23 * a[0], c23 * a[1], -s23 * a[2] - math.cos(t), breaks, count)
    extreme = math.atan2(a[1], a[0])
    breaks[count] = extreme
    breaks[count + 1] = wrap(extreme + math.pi)
    return count + 2


@jit
def _free_base(
    t23: float, a: Array, flip: float, value: float, branch: int, near: Array, low: Array, high: Array,
    breaks: Array, probes: Array, arcs: Array, found: int, angles: Array,
) -> tuple[float, int]:  # fmt: skip
    """θ1 for a wrist centre on axis 1: the feasible one nearest to the seed's; appends the feasible arcs."""
    n_probes = lay_probes(breaks, _base_breaks(t23, a, low, high, breaks), probes)
    first = found
    best = math.inf
    t1 = near[0]
    for j in range(n_probes):
        angles[0] = probes[j]
        _wrist(probes[j], t23, a, flip, near[3], low[3], high[3], angles)
        misfit = misfit_of(angles, low, high, 0, 1) + misfit_of(angles, low, high, 3, 5)
        if misfit == 0.0 and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, branch, probes, j, n_probes)
        elif misfit < best and found == first:
            best, t1 = misfit, probes[j]
    if not math.isnan(value):
        t1 = value
    elif found > first:
        t1 = nearest_in_arcs(arcs, first, found, near[0])
    return t1, found


@jit
def _solve(
    T: Array, inverse_base: Array, offset: Array, a1: float, a2: float, d4: float, d6: float, value: float,
    seed: Array, lower: Array, upper: Array, arcs: Array, out: Array,
) -> tuple[float, int]:  # fmt: skip
    """The branches, see `solve`. Returns (gap, number of arcs)."""
    M, a = np.empty((4, 4)), np.empty(3)
    angles = np.empty(5)
    breaks, probes = np.empty(32), np.empty(66)
    near, low, high = shifted(seed, offset), shifted(lower, offset), shifted(upper, offset)
    clear(out)
    to_canonical(T, inverse_base, _EYE, M)
    for i in range(3):
        a[i] = M[i, 2]
    wx, wy = M[0, 3] - d6 * a[0], M[1, 3] - d6 * a[1]
    h = d6 * a[2] - M[2, 3]
    r = math.hypot(wx, wy)
    on_axis = r < _SINGULAR
    gap = math.inf
    found = 0
    for si in range(1 if on_axis else 2):
        shoulder = 1.0 if si == 0 else -1.0
        rho = shoulder * r - a1
        D2 = rho * rho + h * h
        D = math.sqrt(D2)
        miss = max(D - (a2 + d4), abs(a2 - d4) - D)
        gap = min(gap, miss)
        if miss > _REACH:
            continue
        far, near_by = (a2 + d4) ** 2 - D2, D2 - (a2 - d4) ** 2
        bend = merged(2.0 * math.atan2(math.sqrt(max(far, 0.0)), math.sqrt(max(near_by, 0.0))))
        for ei in range(2 if bend > 0.0 else 1):
            t3 = bend if ei == 0 else -bend
            t2 = math.atan2(h, rho) - math.atan2(d4 * math.sin(t3), a2 + d4 * math.cos(t3))
            for wi in range(2):
                flip = 1.0 if wi == 0 else -1.0
                branch = 4 * si + 2 * ei + wi
                t1 = math.atan2(shoulder * wy, shoulder * wx)
                if on_axis:
                    given = value if math.isnan(value) else value + offset[0]
                    t1, found = _free_base(
                        t2 + t3, a, flip, given, branch, near, low, high, breaks, probes, arcs, found, angles
                    )
                    out[branch, 5] = wrap(t1 - offset[0])
                angles[0], angles[1], angles[2] = t1, t2, t3
                _wrist(t1, t2 + t3, a, flip, near[3], low[3], high[3], angles)
                for i in range(5):
                    out[branch, i] = wrap(angles[i] - offset[i])
        if bend == 0.0:
            copy_row(out, 4 * si, 4 * si + 2)
            copy_row(out, 4 * si + 1, 4 * si + 3)
    if on_axis:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return gap, found


# Thin: all branches, without limits, ranges and a choice, as :mod:`kin.solvers.blocks` has it; the pairs come out
# of the geometry without any sine or cosine of an angle. Rows of S are θ1, θ3 of each shoulder, then θ2, θ4, θ5 of
# each shoulder and elbow. The other shoulder is half a turn on in θ1, the other elbow −θ3, the other wrist −θ5 and
# half a turn on in θ4.

_FRONT, _BEND, _UPPER, _ROLL, _TILT, _END = (OWN + i for i in (0, 1, 3, 7, 11, 15))
_PAIRS, _ROWS = _END - OWN, _END + _END - OWN + 1
_OFFSET, _LENGTHS = 12, 17
_UNBOUND = 1e6


@inlined
def _hand(
    rho: float,
    h: float,
    a2: float,
    d4: float,
    c3: float,
    s3: float,
    scale: float,
    level: float,
    u2: float,
    az: float,
) -> tuple[float, float, float, float, float, bool]:
    """s2, c2, u1, |(u1, u2)|, u3, given the elbow, scale = 1/D² and the approach direction in the arm's plane."""
    A, B = a2 + d4 * c3, d4 * s3
    s2, c2 = (h * A - rho * B) * scale, (rho * A + h * B) * scale
    c23, s23 = c2 * c3 - s2 * s3, s2 * c3 + c2 * s3
    u1 = s23 * level + c23 * az
    w = math.sqrt(u1 * u1 + u2 * u2)
    return s2, c2, u1, w, c23 * level - s23 * az, w < _SINGULAR


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those to be looked at closely, and how many these are."""
    a1, a2, d4, d6 = params[_LENGTHS], params[_LENGTHS + 1], params[_LENGTHS + 2], params[_LENGTHS + 3]
    base = rows_of(params, 0)
    found = 0
    for b in range(count):
        ax, ay, az = in_base(base, S, 2, b)
        x, y, z = in_base(base, S, 3, b)
        wx, wy, h = x + base[3] - d6 * ax, y + base[7] - d6 * ay, d6 * az - (z + base[11])
        r = math.sqrt(wx * wx + wy * wy)
        inverse_r = 1.0 / r
        level, u2 = (wx * ax + wy * ay) * inverse_r, (wy * ax - wx * ay) * inverse_r
        S[_FRONT, b], S[_PAIRS + _FRONT, b] = wy, wx
        rho = r - a1
        c3, s3, scale, close0 = elbow_of(rho, h, a2, d4)
        S[_BEND, b], S[_PAIRS + _BEND, b] = s3, c3
        s2, c2, u1, w, u3, close1 = _hand(rho, h, a2, d4, c3, s3, scale, level, u2, az)
        S[_UPPER, b], S[_PAIRS + _UPPER, b] = s2, c2
        S[_ROLL, b], S[_PAIRS + _ROLL, b] = -u2, -u1
        S[_TILT, b], S[_PAIRS + _TILT, b] = w, u3
        s2, c2, u1, w, u3, close2 = _hand(rho, h, a2, d4, c3, -s3, scale, level, u2, az)
        S[_UPPER + 1, b], S[_PAIRS + _UPPER + 1, b] = s2, c2
        S[_ROLL + 1, b], S[_PAIRS + _ROLL + 1, b] = -u2, -u1
        S[_TILT + 1, b], S[_PAIRS + _TILT + 1, b] = w, u3
        rho = -r - a1
        c3, s3, scale, close3 = elbow_of(rho, h, a2, d4)
        S[_BEND + 1, b], S[_PAIRS + _BEND + 1, b] = s3, c3
        s2, c2, u1, w, u3, close4 = _hand(rho, h, a2, d4, c3, s3, scale, -level, -u2, az)
        S[_UPPER + 2, b], S[_PAIRS + _UPPER + 2, b] = s2, c2
        S[_ROLL + 2, b], S[_PAIRS + _ROLL + 2, b] = u2, -u1
        S[_TILT + 2, b], S[_PAIRS + _TILT + 2, b] = w, u3
        s2, c2, u1, w, u3, close5 = _hand(rho, h, a2, d4, c3, -s3, scale, -level, -u2, az)
        S[_UPPER + 3, b], S[_PAIRS + _UPPER + 3, b] = s2, c2
        S[_ROLL + 3, b], S[_PAIRS + _ROLL + 3, b] = u2, -u1
        S[_TILT + 3, b], S[_PAIRS + _TILT + 3, b] = w, u3
        special = close0 | close1 | close2 | close3 | close4 | close5 | (r < _SINGULAR)
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@joined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    widest()
    double(arc, S, _FRONT, _BEND, _PAIRS, count, 1.0, params[_OFFSET], True)
    double(arc, S, _BEND, _UPPER, _PAIRS, count, 1.0, params[_OFFSET + 2], False)
    single(arc, S, _UPPER, _ROLL, _PAIRS, count, 1.0, params[_OFFSET + 1])
    double(arc, S, _ROLL, _TILT, _PAIRS, count, 1.0, params[_OFFSET + 3], True)
    double(arc, S, _TILT, _END, _PAIRS, count, 1.0, params[_OFFSET + 4], False)
    for b in range(count):
        # θ1 is NaN, too, on the side where the arm does not reach.
        S[_FRONT, b] += 0.0 * S[_BEND, b]
        S[_PAIRS + _FRONT, b] += 0.0 * S[_BEND + 1, b]


@inlined
def _store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 5)`` ← the branches of target b."""
    for row in range(8):
        back, down, flip = row >> 2, (row >> 1) & 1, row & 1
        arm = row >> 1
        out[row, 0] = S[_PAIRS * back + _FRONT, b]
        out[row, 1] = S[_UPPER + arm, b]
        out[row, 2] = S[_PAIRS * down + _BEND + back, b]
        out[row, 3] = S[_PAIRS * flip + _ROLL + arm, b]
        out[row, 4] = S[_PAIRS * flip + _TILT + arm, b]


@jit
def _closely(params: Array, T: Array, value: float, near: Array, out: Array) -> None:
    """out ``(8, 5)`` ← the branches by `_solve`, which is at home in singularities."""
    inverse_base, arcs, rows = np.empty((4, 4)), np.empty((8, 3)), np.empty((8, 6))
    offset, lower, upper = np.empty(5), np.empty(5), np.empty(5)
    for i in range(12):
        inverse_base[i // 4, i % 4] = params[i]
    for i in range(5):
        offset[i], lower[i], upper[i] = params[_OFFSET + i], -_UNBOUND, _UNBOUND
    a1, a2, d4, d6 = params[_LENGTHS], params[_LENGTHS + 1], params[_LENGTHS + 2], params[_LENGTHS + 3]
    _solve(T, inverse_base, offset, a1, a2, d4, d6, value, near, lower, upper, arcs, rows)
    for i in range(8):
        for j in range(5):
            out[i, j] = rows[i, j]


@jit
def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 8, 5)`` ← all branches of each of the targets T ``(N, 4, 4)``; see `branches_one`.

    values: θ1 for each target ``(N,)``, or one for all ``(1,)``.
    """
    widest()
    S = np.empty((_ROWS, BLOCK))
    each(_pairs, _angles, _store, _closely, params, T, values, near, out, S)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 5)`` ← all branches of the target T ``(4, 4)``, NaN where there is none; False if T is not finite.

    value: θ1 where the wrist centre is on axis 1, NaN for that of near ``(5,)``; near also has a free θ4.
    """
    S = np.empty((_ROWS, 1))
    return one(_pairs, _angles, _store, _closely, _PAIRS, params, T, value, near, out, S)


class Wrist5(ClosedForm):
    """The closed form of a five-joint elbow arm with a two-axis wrist."""

    name, title, branches = NAME, TITLE, BRANCHES
    reason = (
        "axes 2 and 3 are parallel and perpendicular to axis 1, "
        "axes 3 and 4 meet at a right angle, and so do axes 4 and 5"
    )

    def __init__(self, geometry: Geometry) -> None:
        g = self.geometry = geometry
        self.lengths = (g.a1, g.a2, g.d4, g.d6)
        # base⁻¹ by rows, offsets, a1, a2, d4, d6.
        offset = [wrap(t) for t in g.offset.tolist()]
        params = np.array([*g.inverse_base[:3].ravel(), *offset, g.a1, g.a2, g.d4, g.d6])
        self.kernels = BatchKernels(params, branches_one, branches_many)

    def handles(self, task: int) -> bool:
        """A point, with or without an approach direction; :mod:`kin.ik` judges the roll that a pose gets."""
        return task in (POSE, APPROACH, POSITION)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ4 and θ5 for a point alone; otherwise θ1 when the wrist centre is on axis 1, else nothing."""
        return point.REDUNDANCIES if task == POSITION else (_THETA1,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches that bring the tool point and the approach direction to the target's.

        Of a point alone θ4 and θ5 are free: that is :mod:`kin.solvers.wrist5.point`.
        """
        g = self.geometry
        if problem.task == POSITION:
            return point.solve(g, problem)
        out, arcs = np.empty((8, 6)), np.empty((128, 3))
        gap, count = _solve(
            problem.T, g.inverse_base, g.offset, g.a1, g.a2, g.d4, g.d6, problem.values[0], problem.seed,
            problem.lower, problem.upper, arcs, out,
        )  # fmt: skip
        arcs = arcs[:count]
        if count:
            arcs[:, 1:] -= g.offset[0]
        obstacle = None if gap <= _REACH else Obstacle("approach direction")
        return Candidates(out[:, :5], out[:, 5:], (arcs,), max(gap, 0.0), obstacle)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on.

        "Front" is the side of axis 1 the arm faces with the wrist centre before it; the elbow is "up" when it is
        above the line from the shoulder to the wrist centre; the wrist is the sign of θ5.
        """
        g = self.geometry
        t = q + g.offset
        reach = g.a1 + g.a2 * math.cos(t[1]) + g.d4 * math.cos(t[1] + t[2])
        return 4 * int(reach < 0.0) + 2 * int(math.sin(t[2]) < 0.0) + int(math.sin(t[4]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """Those of the task point and approach direction.

        The three are the factors of the determinant, −a2 d4 s3 (a1 + a2 c2 + d4 c23) s5: there are no others.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        elbow, wrist = off_line(t[2]), off_line(t[4])
        reach = g.a1 + g.a2 * math.cos(t[1]) + g.d4 * math.cos(t[1] + t[2])
        if min(abs(elbow), abs(reach), abs(wrist)) > within:
            return ()  # as almost everywhere
        straight, aligned = float(q[2]) - elbow, float(q[4]) - wrist
        return those_within(
            within,
            Singularity(
                "elbow",
                elbow_at(t[2]),
                "wrist centre along the arm",
                abs(elbow),
                "rad",
                (JointValue(2, straight),),
            ),
            Singularity("shoulder", "wrist centre on axis 1", "wrist centre sideways", abs(reach), "m"),
            Singularity(
                "wrist", "tool along the forearm", "tilt sideways", abs(wrist), "rad", (JointValue(4, aligned),)
            ),
        )
