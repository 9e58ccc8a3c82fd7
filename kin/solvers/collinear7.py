"""The redundant arm as printed: seven joints, of which 1 and 2 turn about the same vertical line.

Only θ12 = θ1 + θ2 matters, so the arm is redundant in a trivial way: it turns joint 1 one way and joint 2 the
other, and nothing else moves. The forearm starts horizontally, along u = (−sin θ12, cos θ12, 0):

- w = W − S, k = w·u = (|w|² + d3² − d5²)/(2 d3), azimuth(u) = atan2(wy, wx) ± acos(k / hypot(wx, wy)): 2 branches;
- R02ᵀ (w − d3 u)/d5 = (c3 s4, s3 s4, c4): θ3, θ4, 2 branches;
- R04ᵀ R = Rz(θ5) Ry(θ6) Rz(θ7): 2 branches.

Eight branches, each with the family θ2 = θ12 + 2πk − θ1: intervals of θ1. Singular: s4 = 0, s6 = 0, and w
vertical. With only a point and an approach direction to meet, the roll φ about that direction is free too, and
R47 is affine in cos φ, sin φ: its feasible arcs are exact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK
from kin.kernels.simd import widest, wrapped
from kin.robot import Robot
from kin.solvers.blocks import OWN, VALUE, Arc, canonical_of, double, each, one, rows_of
from kin.solvers.common import (
    TURN,
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
    screw_z,
    shifted,
    split_sum,
    to_canonical,
    wrap,
    zyz,
    zyz_breaks,
)
from kin.solvers.contract import (
    APPROACH,
    POSE,
    BatchKernels,
    Candidates,
    ClosedForm,
    Obstacle,
    RedundancyParameter,
    SolverInput,
)
from kin.solvers.singular import JointValue, Singularity, elbow_at, off_line, off_perpendicular, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "collinear7"
TITLE = "closed form, joints 1 and 2 on one line"
_THETA1 = RedundancyParameter("theta1", "θ1", joint=0)
_ROLL = RedundancyParameter("roll", "roll about the approach axis", circular=True)
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s in ("left", "right")
    for e in ("up", "down")
    for w in ("no-flip", "flip")
)
_REACH = TOLERANCES.closure_position * 0.1
_MERGE = TOLERANCES.merge
_SINGULAR = TOLERANCES.singular


class Geometry(NamedTuple):
    """The arm in canonical form: joint values are q = θ − offset."""

    inverse_base: Array
    inverse_tool: Array
    offset: Array
    d3: float
    d5: float
    tool_on_axis: bool


def match(robot: Robot) -> Collinear7 | None:
    """The closed form if axes 1 and 2 are one line, 3 is perpendicular to it and 5-6-7 meet in a point."""
    chain = chain_of(robot) if robot.n == 7 else None
    chain = chain.twisted((0, -1, -1, 1, -1, 1)) if chain else None
    if chain is None or not is_zero(*chain.a, chain.d[3], chain.d[5]):
        return None
    d3, d5 = float(chain.d[2]), float(chain.d[4])
    if min(d3, d5) < TOLERANCES.geometry:
        return None
    tool = screw_z(0.0, float(chain.d[6])) @ chain.tool
    base = chain.base @ screw_z(0.0, float(chain.d[0] + chain.d[1]))
    inverse_tool = inverse(tool)
    # The wrist centre in the tool frame: it must stay when the tool rolls about its approach axis.
    on_axis = is_zero(inverse_tool[0, 3], inverse_tool[1, 3])
    return Collinear7(Geometry(inverse(base), inverse_tool, chain.theta, d3, d5, on_axis))


@jit
def _roll_parts(T: Array, inverse_base: Array, inverse_tool: Array, parts: Array) -> None:
    """parts[0:3] ← C0, C1, C2: the canonical rotation of T turned by φ about its approach axis is
    C0 + C1 cos φ + C2 sin φ."""
    column, M = np.zeros((4, 4)), np.empty((4, 4))
    for part in range(3):
        for r in range(3):
            column[r, 0] = 0.0 if part == 0 else (T[r, 0] if part == 1 else T[r, 1])
            column[r, 1] = 0.0 if part == 0 else (T[r, 1] if part == 1 else -T[r, 0])
            column[r, 2] = T[r, 2] if part == 0 else 0.0
        to_canonical(column, inverse_base, inverse_tool, M)
        for r in range(3):
            for c in range(3):
                parts[part, r, c] = M[r, c]


@jit
def _combine(parts: Array, phi: float, out: Array) -> None:
    c, s = math.cos(phi), math.sin(phi)
    for i in range(3):
        for j in range(3):
            out[i, j] = parts[0, i, j] + c * parts[1, i, j] + s * parts[2, i, j]


@jit
def _wrist(R02: Array, t3: float, t4: float, R: Array, out: Array) -> None:
    """out ← R04ᵀ R with R04 = R02 Rz(θ3) Ry(θ4), for any 3×3 array R."""
    c3, s3, c4, s4 = math.cos(t3), math.sin(t3), math.cos(t4), math.sin(t4)
    for j in range(3):
        a = R02[0, 0] * R[0, j] + R02[1, 0] * R[1, j] + R02[2, 0] * R[2, j]
        b = R02[0, 1] * R[0, j] + R02[1, 1] * R[1, j] + R02[2, 1] * R[2, j]
        z = R02[0, 2] * R[0, j] + R02[1, 2] * R[1, j] + R02[2, 2] * R[2, j]
        x = c3 * a + s3 * b
        out[0, j] = c4 * x - s4 * z
        out[1, j] = c3 * b - s3 * a
        out[2, j] = s4 * x + c4 * z


@jit
def _best_roll(
    bent: Array, s6: float, wish: float, given: bool, branch: int, probes: Array, n_probes: int, near: Array,
    low: Array, high: Array, R47: Array, angles: Array, rolls: Array, found: int,
) -> tuple[float, int]:  # fmt: skip
    """The feasible roll nearest to `wish`, or the least bad one; appends the feasible arcs to `rolls`.

    `bent` holds R47's three parts.
    """
    best = math.inf
    phi = wish
    first = found
    for j in range(n_probes):
        _combine(bent, probes[j], R47)
        zyz(R47, s6, near, low, high, 4, angles)
        misfit = misfit_of(angles, low, high, 4, 7)
        if misfit == 0.0 and found < rolls.shape[0]:
            found = extend_arcs(rolls, first, found, branch, probes, j, n_probes)
        elif misfit < best and found == first and not given:
            best, phi = misfit, probes[j]
    if found > first and not given:
        phi = nearest_in_arcs(rolls, first, found, wish)
    return phi, found


@jit
def _solve(
    T: Array, inverse_base: Array, inverse_tool: Array, offset: Array, d3: float, d5: float, free_roll: bool,
    value: float, respect: bool, seed: Array, wish: float, given_roll: bool, lower: Array, upper: Array,
    arcs: Array, rolls: Array, out: Array,
) -> tuple[float, int, int]:  # fmt: skip
    """Branches with θ1, θ2 (and the roll) near the seed. Returns (gap, number of arcs, number of roll arcs)."""
    M = np.empty((4, 4))
    R02, R47 = np.empty((3, 3)), np.empty((3, 3))
    parts, bent = np.empty((3, 3, 3)), np.empty((3, 3, 3))
    angles = np.empty(7)
    breaks, probes = np.empty(64), np.empty(130)
    near, low, high = shifted(seed, offset), shifted(lower, offset), shifted(upper, offset)
    clear(out)
    to_canonical(T, inverse_base, inverse_tool, M)
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    h = math.hypot(x, y)
    k = (x * x + y * y + z * z + d3 * d3 - d5 * d5) / (2.0 * d3)
    if h < 1e-12 and abs(k) < 1e-12:
        azimuth, spread = near[0] + near[1] + 0.5 * math.pi, 0.0
    elif abs(k) - h > _REACH:
        return abs(k) - h, 0, 0
    else:
        azimuth = math.atan2(y, x)
        spread = merged(math.atan2(math.sqrt(max((h - k) * (h + k), 0.0)), k))
    if free_roll:
        _roll_parts(T, inverse_base, inverse_tool, parts)
    found = 0
    turns_found = 0
    for si in range(1 if spread == 0.0 else 2):
        t12 = azimuth + (spread if si == 0 else -spread) - 0.5 * math.pi
        v1 = math.cos(t12) * x + math.sin(t12) * y
        if spread == 0.0 and math.hypot(v1, z) < 100.0 * _MERGE * h and abs(math.sin(near[2])) > 0.0:
            # Two roots merged: what is between them closes as well. Beside a straight elbow that is every θ3, and
            # the seed's is taken; the forearm's height, −z = d5 s3 s4, is not free.
            wanted = -z * math.cos(near[2]) / math.sin(near[2])
            t12 += min(max((wanted - v1) / h, -_MERGE), _MERGE)
        c, s = math.cos(t12), math.sin(t12)
        R02[0, 0], R02[0, 1], R02[0, 2] = c, 0.0, -s
        R02[1, 0], R02[1, 1], R02[1, 2] = s, 0.0, c
        R02[2, 0], R02[2, 1], R02[2, 2] = 0.0, -1.0, 0.0
        v1, v2, v3 = c * x + s * y, -z, c * y - s * x - d3
        side = math.hypot(v1, v2)
        straight = side < 1e-11 * d5
        t1 = split_sum(t12, near[0], low[0], high[0], near[1], low[1], high[1])
        if not math.isnan(value):
            t1 = value + offset[0]
        for ei in range(1 if straight else 2):
            sign = 1.0 if ei == 0 else -1.0
            angles[0], angles[1] = t1, t12 - t1
            angles[2] = near[2] if straight else math.atan2(sign * v2, sign * v1)
            angles[3] = math.atan2(sign * side, v3)
            n_probes = 0
            if free_roll:
                for part in range(3):
                    _wrist(R02, angles[2], angles[3], parts[part], bent[part])
                if respect:
                    count = zyz_breaks(bent[0], bent[1], bent[2], low, high, 4, breaks, 0)
                    n_probes = lay_probes(breaks, count, probes)
            for wi in range(2):
                s6 = 1.0 if wi == 0 else -1.0
                branch = 4 * si + 2 * ei + wi
                if free_roll:
                    phi, turns_found = _best_roll(
                        bent, s6, wish, given_roll, branch, probes, n_probes, near, low, high, R47, angles,
                        rolls, turns_found,
                    )  # fmt: skip
                    _combine(bent, phi, R47)
                    out[branch, 8] = wrap(phi)
                else:
                    if straight and v3 > 0.0:
                        # Elbow straight: θ3 and θ5 turn about one line; θ3 is chosen where θ5 and θ7 can follow.
                        _wrist(R02, 0.0, 0.0, M, R47)
                        zyz(R47, s6, near, low, high, 4, angles)
                        angles[2] = split_sum(angles[4], near[2], low[2], high[2], near[4], low[4], high[4])
                    _wrist(R02, angles[2], angles[3], M, R47)
                zyz(R47, s6, near, low, high, 4, angles)
                for i in range(7):
                    out[branch, i] = wrap(angles[i] - offset[i])
                # θ1 spans more than a turn: the value in use keeps its turn.
                out[branch, 0] = t1 - offset[0]
                out[branch, 7] = t1 - offset[0]
                if misfit_of(angles, low, high, 2, 7) == 0.0:
                    found = _theta1_intervals(t12, offset, low, high, branch, arcs, found)
            if straight:
                copy_row(out, 4 * si, 4 * si + 2)
                copy_row(out, 4 * si + 1, 4 * si + 3)
    if spread == 0.0:
        for branch in range(4):
            copy_row(out, branch, branch + 4)
    return 0.0, found, turns_found


@jit
def _theta1_intervals(
    t12: float, offset: Array, low: Array, high: Array, branch: int, arcs: Array, found: int
) -> int:
    """Append [lo1, hi1] ∩ [θ12 + 2πk − hi2, θ12 + 2πk − lo2] for every whole turn k that leaves something."""
    first = math.ceil((low[0] + low[1] - t12) / TURN - 1e-12)
    last = math.floor((high[0] + high[1] - t12) / TURN + 1e-12)
    for turn in range(int(max(first, -8)), int(min(last, 8)) + 1):
        total = t12 + TURN * turn
        a = max(low[0], total - high[1])
        b = min(high[0], total - low[1])
        if a <= b and found < arcs.shape[0]:
            arcs[found, 0], arcs[found, 1], arcs[found, 2] = branch, a - offset[0], b - offset[0]
            found += 1
    return found


# Thin: all branches at one θ1, without limits, ranges and a choice, as :mod:`kin.solvers.blocks` has it. There are
# two pairs of each angle, one per shoulder. The other six branches are half turns: a sign of θ4 turns θ3 and θ5,
# one of θ6 turns θ5 and θ7.

_PAIRS, _END = 12, OWN + 12
_FIRST, _SECOND, _ROWS = _END + _PAIRS, _END + _PAIRS + 2, _END + _PAIRS + 5  # rows of θ1, θ2, and of all
_TOOL, _OFFSET, _LENGTHS = 12, 24, 31
_UNBOUND = 1e6


@inlined
def _side(
    c: float, s: float, x: float, y: float, z: float, d3: float
) -> tuple[float, float, float, float, float, float, float]:
    """v1, v2, v3 of the forearm seen from the upper arm, its part off the upper arm, c3, s3, 1/|v|."""
    v1, v2, v3 = c * x + s * y, -z, c * y - s * x - d3
    side = math.sqrt(v1 * v1 + v2 * v2)
    inverse_side = 1.0 / side
    return v1, v2, v3, side, v1 * inverse_side, v2 * inverse_side, 1.0 / math.sqrt(side * side + v3 * v3)


@inlined
def _column(
    c: float, s: float, c3: float, s3: float, c4: float, s4: float, m0: float, m1: float, m2: float
) -> tuple[float, float, float]:
    """R04ᵀ · (m0, m1, m2), as in `_wrist`."""
    a, z = c * m0 + s * m1, c * m1 - s * m0
    x = c3 * a - s3 * m2
    return c4 * x - s4 * z, -c3 * m2 - s3 * a, s4 * x + c4 * z


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those to be looked at closely, and how many these are."""
    d3, d5 = params[_LENGTHS], params[_LENGTHS + 1]
    base, tool = rows_of(params, 0), rows_of(params, _TOOL)
    found = 0
    for b in range(count):
        m00, m01, m02, px, m10, m11, m12, py, m20, m21, m22, pz = canonical_of(base, tool, S, b)
        h2 = px * px + py * py
        h = math.sqrt(h2)
        k = (h2 + pz * pz + d3 * d3 - d5 * d5) / (2.0 * d3)
        lost = abs(k) - h > _REACH
        across = (h - k) * (h + k)
        across = math.sqrt(across if across > 0.0 else 0.0)
        across = math.nan if lost else across
        inverse_h2 = 1.0 / h2
        # cos θ12 = sin of the azimuth ± its spread, sin θ12 = −cos of it.
        c = (py * k + px * across) * inverse_h2
        s = (py * across - px * k) * inverse_h2
        S[OWN, b], S[_END, b] = s, c
        e1, e2, e3, side, c3, s3, inverse_v = _side(c, s, px, py, pz, d3)
        S[OWN + 2, b], S[_END + 2, b] = e2, e1
        S[OWN + 4, b], S[_END + 4, b] = side, e3
        c4, s4 = e3 * inverse_v, side * inverse_v
        f0, g0, _ = _column(c, s, c3, s3, c4, s4, m00, m10, m20)
        f1, g1, _ = _column(c, s, c3, s3, c4, s4, m01, m11, m21)
        f2, g2, q2 = _column(c, s, c3, s3, c4, s4, m02, m12, m22)
        tilt = math.sqrt(f2 * f2 + g2 * g2)
        S[OWN + 6, b], S[_END + 6, b] = g2, f2
        S[OWN + 8, b], S[_END + 8, b] = tilt, q2
        S[OWN + 10, b], S[_END + 10, b] = (f2 * g0 - g2 * f0) / tilt, (f2 * g1 - g2 * f1) / tilt
        close0 = (side < 1e-11 * d5) | (tilt < _SINGULAR)
        c = (py * k - px * across) * inverse_h2
        s = (-py * across - px * k) * inverse_h2
        S[OWN + 1, b], S[_END + 1, b] = s, c
        e1, e2, e3, side, c3, s3, inverse_v = _side(c, s, px, py, pz, d3)
        S[OWN + 3, b], S[_END + 3, b] = e2, e1
        S[OWN + 5, b], S[_END + 5, b] = side, e3
        c4, s4 = e3 * inverse_v, side * inverse_v
        f0, g0, _ = _column(c, s, c3, s3, c4, s4, m00, m10, m20)
        f1, g1, _ = _column(c, s, c3, s3, c4, s4, m01, m11, m21)
        f2, g2, q2 = _column(c, s, c3, s3, c4, s4, m02, m12, m22)
        tilt = math.sqrt(f2 * f2 + g2 * g2)
        S[OWN + 7, b], S[_END + 7, b] = g2, f2
        S[OWN + 9, b], S[_END + 9, b] = tilt, q2
        S[OWN + 11, b], S[_END + 11, b] = (f2 * g0 - g2 * f0) / tilt, (f2 * g1 - g2 * f1) / tilt
        close1 = (side < 1e-11 * d5) | (tilt < _SINGULAR)
        special = (close0 | close1 | (h - k < 1e-13 * h) | (h < 1e-12)) & ((not lost) | (h < 1e-12))
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@joined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs.

    θ1 and θ2 go equal parts of the way from near ``(7,)``, unless θ1 is asked for.
    """
    widest()
    for joint in range(1, 7):
        # Half a turn apart for θ3, θ5, θ7, of either sign for θ4, θ6; θ12 has one value.
        offset = params[_OFFSET + joint] if joint > 1 else 0.0
        first = OWN + 2 * joint - 2
        double(arc, S, first, first + 2, _PAIRS, count, 1.0, offset, joint % 2 == 0)
    near1 = near[0] + params[_OFFSET]
    near2 = near[1] + params[_OFFSET + 1]
    both = wrap(near1 + near2)
    middle = wrap(near2 - params[_OFFSET + 1])
    for b in range(count):
        value = S[VALUE, b]
        asked = wrap(value + params[_OFFSET])
        for shoulder in range(2):
            t12 = S[OWN + shoulder, b]
            half = 0.5 * wrapped(t12 - both)
            t1 = value if value == value else near[0] + half
            t2 = wrapped(wrapped(t12 - asked) - params[_OFFSET + 1]) if value == value else wrapped(middle + half)
            S[_FIRST + shoulder, b] = t1 + 0.0 * t12
            S[_SECOND + shoulder, b] = t2


@inlined
def _store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 7)`` ← the branches of target b."""
    for row in range(8):
        shoulder, elbow, wrist = row >> 2, (row >> 1) & 1, row & 1
        out[row, 0] = S[_FIRST + shoulder, b]
        out[row, 1] = S[_SECOND + shoulder, b]
        out[row, 2] = S[_PAIRS * elbow + OWN + 2 + shoulder, b]
        out[row, 3] = S[_PAIRS * elbow + OWN + 4 + shoulder, b]
        out[row, 4] = S[_PAIRS * (elbow ^ wrist) + OWN + 6 + shoulder, b]
        out[row, 5] = S[_PAIRS * wrist + OWN + 8 + shoulder, b]
        out[row, 6] = S[_PAIRS * wrist + OWN + 10 + shoulder, b]


@jit
def _closely(params: Array, T: Array, value: float, near: Array, out: Array) -> None:
    """out ``(8, 7)`` ← the branches by `_solve`, which is at home in singularities."""
    inverse_base, inverse_tool = np.empty((4, 4)), np.empty((4, 4))
    arcs, rolls, rows = np.empty((1, 3)), np.empty((1, 3)), np.empty((8, 9))
    offset, lower, upper = np.empty(7), np.empty(7), np.empty(7)
    for i in range(12):
        inverse_base[i // 4, i % 4] = params[i]
        inverse_tool[i // 4, i % 4] = params[_TOOL + i]
    for i in range(7):
        offset[i], lower[i], upper[i] = params[_OFFSET + i], -_UNBOUND, _UNBOUND
    d3, d5 = params[_LENGTHS], params[_LENGTHS + 1]
    no = arcs.shape[0] == 0  # a literal False would compile `_solve` once more
    _solve(
        T,
        inverse_base,
        inverse_tool,
        offset,
        d3,
        d5,
        no,
        value,
        no,
        near,
        0.0,
        no,
        lower,
        upper,
        arcs,
        rolls,
        rows,
    )
    for i in range(8):
        for j in range(7):
            out[i, j] = rows[i, j]


@jit
def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 8, 7)`` ← all branches of each of the targets T ``(N, 4, 4)``; see `branches_one`.

    values: θ1 for each target ``(N,)``, or one for all ``(1,)``.
    """
    widest()
    S = np.empty((_ROWS, BLOCK))
    each(_pairs, _angles, _store, _closely, params, T, values, near, out, S)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 7)`` ← all branches of the target T ``(4, 4)``, NaN if there is none; False if T is not finite.

    value: θ1, which is returned as it is, NaN to part the way from near ``(7,)`` between joints 1 and 2; near also
    has the angles that are free at a singularity.
    """
    S = np.empty((_ROWS, 1))
    return one(_pairs, _angles, _store, _closely, _PAIRS, params, T, value, near, out, S)


class Collinear7(ClosedForm):
    """The closed form of the arm whose joints 1 and 2 turn about one line."""

    name, title, branches = NAME, TITLE, BRANCHES
    reason = "axes 1 and 2 are one line, axis 3 is perpendicular to it, and axes 5, 6, 7 meet in one point"

    def __init__(self, geometry: Geometry) -> None:
        g = self.geometry = geometry
        self.lengths = (g.d3, g.d5)
        # base⁻¹ and tool⁻¹ by rows, offsets, d3, d5.
        offset = [wrap(t) for t in g.offset.tolist()]
        params = np.array([*g.inverse_base[:3].ravel(), *g.inverse_tool[:3].ravel(), *offset, g.d3, g.d5])
        self.kernels = BatchKernels(params, branches_one, branches_many)

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction when it passes through the wrist centre."""
        return task == POSE or (task == APPROACH and self.geometry.tool_on_axis)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """θ1, which joint 2 undoes; for an approach direction the roll about it as well."""
        return (_THETA1, _ROLL) if task == APPROACH else (_THETA1,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, with θ1 and θ2 (and the roll of an approach task) as near the seed as the limits allow."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out = np.empty((8, 9))
        arcs, rolls = np.empty((64, 3)), np.empty((256, 3))
        given = free_roll and not math.isnan(problem.values[1])
        gap, count, roll_count = _solve(
            problem.T, g.inverse_base, g.inverse_tool, g.offset, g.d3, g.d5, free_roll, problem.values[0],
            problem.respect_limits, problem.seed, problem.values[1] if given else problem.seed_roll, given,
            problem.lower, problem.upper, arcs, rolls, out,
        )  # fmt: skip
        obstacle = Obstacle("wrist centre off the upper arm and forearm") if gap > 0.0 else None
        if free_roll:
            return Candidates(out[:, :7], out[:, 7:], (arcs[:count], rolls[:roll_count]), gap, obstacle)
        return Candidates(out[:, :7], out[:, 7:8], (arcs[:count],), gap, obstacle)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: the side of w on which u lies, and the signs of s4 and s6."""
        t = q + self.geometry.offset
        s4 = math.sin(t[3])
        return 4 * int(math.cos(t[2]) * s4 < 0.0) + 2 * int(s4 < 0.0) + int(math.sin(t[5]) < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The three factors of the determinant without joint 2, d3 d5² s4² c3 s6: there are no others.

        s4 counts twice, so an elbow nearly straight costs more than a wrist nearly aligned.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        off = (0.0, 0.0, off_perpendicular(t[2]), off_line(t[3]), 0.0, off_line(t[5]))
        across, along = g.d5 * math.sin(t[3]) * math.cos(t[2]), g.d3 + g.d5 * math.cos(t[3])
        off_axis = math.hypot(across, along)
        if min(abs(off[2]), abs(off[3]), abs(off[5]), off_axis) > within:
            return ()  # as almost everywhere

        def met_at(joint: int) -> tuple[JointValue]:
            return (JointValue(joint, float(q[joint]) - off[joint]),)

        found = [
            Singularity("elbow", elbow_at(t[3]), "hand along the arm", abs(off[3]), "rad", met_at(3)),
            Singularity(
                "shoulder",
                "forearm in one plane with axis 1",
                "hand along the forearm",
                abs(off[2]),
                "rad",
                met_at(2),
            ),
            Singularity(
                "wrist", "hand along the forearm", "joints 5 and 7 coincide", abs(off[5]), "rad", met_at(5)
            ),
        ]
        if g.d5 >= g.d3 - TOLERANCES.geometry:
            # Only a forearm at least as long as the upper arm gets back to axis 1; then θ3 is ±90°, too.
            found.append(
                Singularity("algorithmic", "wrist centre on axis 1", "azimuth of the forearm", off_axis, "m")
            )
        return those_within(within, *found)
