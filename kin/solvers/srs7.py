"""S-R-S arms: seven joints, a spherical shoulder, an elbow and a spherical wrist (KUKA iiwa and kin).

The three shoulder axes meet in S, the three wrist axes in W, and S–elbow = d3, elbow–W = d5. A target pose
fixes W, hence the triangle S–E–W up to a turn of the elbow E about the line SW: the **arm angle ψ**, the one
redundant freedom. With u = unit(W − S), e2 = u × z, e1 = e2 × u (ψ = 0: elbow highest), the elbow lies towards
``radial = e1 cos ψ + e2 sin ψ``. Given ψ there are eight branches, shoulder × elbow × wrist, each two signs of
θ2, θ4, θ6; all eight have the same elbow point.

- θ4 = ±2 atan √(((d3+d5)² − L²) / (L² − (d3−d5)²)), L = |W − S|.
- R03 = [x3 y3 z3] with z3 = (A u + ρ radial)/d3, y3 = −sign(θ4) u × radial: Z-Y-Z gives θ1, θ2, θ3.
- R47 = R04ᵀ R: Z-Y-Z gives θ5, θ6, θ7.

Both rotations are affine in cos ψ and sin ψ, so the arm angles allowed by the joint limits come out as exact
arcs (Shimizu, Kakuya, Yoon, Kitagaki, Kosuge, IEEE Trans. Robotics 24(5), 2008).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import inlined, jit, joined
from kin.kernels.fk import BLOCK, sine_cosine
from kin.kernels.simd import TURN, WIDE, atan2, rounded, sin_cos, widest
from kin.robot import Robot
from kin.solvers.blocks import OWN, VALUE, Arc, double, each, in_base, one, rows_of
from kin.solvers.common import (
    chain_of,
    clear,
    copy_row,
    excess,
    extend_arcs,
    inverse,
    is_zero,
    lay_probes,
    merged,
    nearest_image,
    nearest_in_arcs,
    screw_z,
    shifted,
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

NAME = "srs7"
TITLE = "closed form, S-R-S arm"
_PSI = RedundancyParameter("psi", "arm angle ψ", circular=True)
_THETA7 = RedundancyParameter("theta7", "θ7", joint=6)
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s in ("front", "back")
    for e in ("up", "down")
    for w in ("no-flip", "flip")
)
_REACH = TOLERANCES.closure_position * 0.1
_SINGULAR = TOLERANCES.singular
_LIMIT = TOLERANCES.limit
_PER_TURN = 1.0 / TURN
_CALM = 0.05  # rad; a way shorter than this is calm


class Geometry(NamedTuple):
    """The arm in canonical form: joint values are q = θ − offset."""

    inverse_base: Array
    inverse_tool: Array
    offset: Array
    d3: float
    d5: float
    tool_on_axis: bool


def match(robot: Robot) -> Srs7 | None:
    """The closed form if the robot is an S-R-S arm, by its axes: 1-2-3 and 5-6-7 concurrent, neighbours square."""
    chain = chain_of(robot) if robot.n == 7 else None
    chain = chain.twisted((-1, 1, -1, 1, -1, 1)) if chain else None
    if chain is None or not is_zero(*chain.a, chain.d[1], chain.d[3], chain.d[5]):
        return None
    d3, d5 = float(chain.d[2]), float(chain.d[4])
    if min(d3, d5) < TOLERANCES.geometry:
        return None
    tool = screw_z(0.0, float(chain.d[6])) @ chain.tool
    on_axis = is_zero(tool[0, 3], tool[1, 3]) and abs(tool[2, 2] - 1.0) < TOLERANCES.geometry
    base = chain.base @ screw_z(0.0, float(chain.d[0]))
    return Srs7(Geometry(inverse(base), inverse(tool), chain.theta, d3, d5, bool(on_axis)))


@jit
def _triangle(M: Array, d3: float, d5: float, frame: Array) -> tuple[int, float, float, float, float, float]:
    """Solve S–E–W for a canonical target M: (code, gap, L, A, ρ, |θ4|); frame ← rows u, e1, e2.

    code 0: fits; 1: W is `gap` metres too far; 2: W is `gap` metres too near.
    """
    x, y, z = M[0, 3], M[1, 3], M[2, 3]
    L = math.sqrt(x * x + y * y + z * z)
    far = (d3 + d5) ** 2 - L * L
    near = L * L - (d3 - d5) ** 2
    if L - (d3 + d5) > _REACH:
        return 1, L - (d3 + d5), L, 0.0, 0.0, 0.0
    if abs(d3 - d5) - L > _REACH or L < 1e-12:
        return 2, abs(d3 - d5) - L, L, 0.0, 0.0, 0.0
    theta4 = merged(2.0 * math.atan2(math.sqrt(max(far, 0.0)), math.sqrt(max(near, 0.0))))
    A = d3 * (d3 + d5 * math.cos(theta4)) / L
    rho = d3 * d5 * math.sin(theta4) / L
    ux, uy, uz = x / L, y / L, z / L
    h = math.hypot(ux, uy)
    if h > 1e-12:
        e2x, e2y = uy / h, -ux / h
    else:
        # W on axis 1: "highest" has no meaning there; the reference plane is taken through the base's x axis.
        e2x, e2y = 0.0, -1.0 if uz > 0 else 1.0
    frame[0, 0], frame[0, 1], frame[0, 2] = ux, uy, uz
    frame[1, 0], frame[1, 1], frame[1, 2] = e2y * uz, -e2x * uz, e2x * uy - e2y * ux
    frame[2, 0], frame[2, 1], frame[2, 2] = e2x, e2y, 0.0
    return 0, 0.0, L, A, rho, theta4


@jit
def _rotations(
    M: Array, frame: Array, A: float, rho: float, d3: float, theta4: float, c: float, s: float, k: float,
    R03: Array, R47: Array,
) -> None:  # fmt: skip
    """R03, R47 ← their values at cos ψ = c, sin ψ = s, constant part weighted by k.

    With (c, s, k) = (0, 0, 1), (1, 0, 0), (0, 1, 0) this gives M0, M1, M2 of ``M0 + M1 cos ψ + M2 sin ψ``.
    """
    sign = 1.0 if theta4 >= 0.0 else -1.0
    c4, s4 = math.cos(theta4), math.sin(theta4)
    for i in range(3):
        radial = c * frame[1, i] + s * frame[2, i]
        R03[i, 0] = -sign * (A * radial - k * rho * frame[0, i]) / d3
        R03[i, 1] = -sign * (c * frame[2, i] - s * frame[1, i])
        R03[i, 2] = (k * A * frame[0, i] + rho * radial) / d3
    for j in range(3):
        x = R03[0, 0] * M[0, j] + R03[1, 0] * M[1, j] + R03[2, 0] * M[2, j]
        z = R03[0, 2] * M[0, j] + R03[1, 2] * M[1, j] + R03[2, 2] * M[2, j]
        R47[0, j] = c4 * x - s4 * z
        R47[1, j] = R03[0, 1] * M[0, j] + R03[1, 1] * M[1, j] + R03[2, 1] * M[2, j]
        R47[2, j] = s4 * x + c4 * z


@jit
def _fill(
    M: Array, frame: Array, A: float, rho: float, d3: float, theta4: float, psi: float, s2: float, s6: float,
    near: Array, low: Array, high: Array, R03: Array, R47: Array, out: Array,
) -> None:  # fmt: skip
    """out ← the canonical angles of one branch at one arm angle."""
    _rotations(M, frame, A, rho, d3, theta4, math.cos(psi), math.sin(psi), 1.0, R03, R47)
    zyz(R03, s2, near, low, high, 0, out)
    out[3] = theta4
    zyz(R47, s6, near, low, high, 4, out)


@jit
def _arm_angle(near: Array, frame: Array, d3: float, d5: float) -> float:
    """ψ at the target whose elbow direction is the one the seed has now, carried over.

    Comparing directions in space, not the two values of ψ, keeps the elbow still when W passes over axis 1,
    where ψ's own reference turns round. ``radial = z3 sin β − sign(θ4) x3 cos β`` with β the triangle's angle
    at S also holds for a straight arm.
    """
    rx, ry, rz = _radial(near, d3, d5)
    along1 = rx * frame[1, 0] + ry * frame[1, 1] + rz * frame[1, 2]
    along2 = rx * frame[2, 0] + ry * frame[2, 1] + rz * frame[2, 2]
    if math.hypot(along1, along2) < 1e-12:
        return 0.0
    return math.atan2(along2, along1)


@jit
def _travel(angles: Array, near: Array, low: Array, high: Array, first: int, last: int) -> float:
    """Sum of the squared steps of joints first…last−1 from `near` to `angles`, each at its best image."""
    total = 0.0
    for i in range(first, last):
        total += (nearest_image(angles[i], near[i], low[i], high[i]) - near[i]) ** 2
    return total


@inlined
def _image(x: float, near: float, low: float, high: float) -> tuple[float, float]:
    """How far the angle x is outside [low, high] at its best whole turn, and that turn's step from `near` where
    there is one inside: `excess` and `nearest_image`, without a branch.
    """
    least, most = low - _LIMIT, high + _LIMIT
    y = x + TURN * rounded((near - x) * _PER_TURN)
    turns = (least - x) * _PER_TURN
    up = rounded(turns)
    above = x + TURN * (up + 1.0 if up < turns else up)
    turns = (most - x) * _PER_TURN
    down = rounded(turns)
    below = x + TURN * (down - 1.0 if down > turns else down)
    y = below if y > most else y
    y = above if y < least else y
    under, over = low - (above - TURN), above - high
    outside = under if under < over else over
    return outside if above > most else 0.0, y - near


@jit
def _weigh(
    M0: Array, M1: Array, M2: Array, looks: Array, count: int, near: Array, low: Array, high: Array, first: int,
    last: int, row: int, angles: Array, S: Array, misfits: Array, ways: Array,
) -> None:  # fmt: skip
    """misfits, ways [row + side, j] ← how far a spherical joint's angles at ψ = looks[j], j < count, are outside
    the limits, and their squared steps from `near`, for either sign of sin B.

    ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ``; the other sign is A + π, −B, C + π. The steps of the joints
    first…last−1 count. S ``(3, k)`` and `angles` are scratch. All ψ go through each step together, as vectors.
    """
    widest()
    lost = 0
    for j in range(count):
        s, c = sin_cos(looks[j])
        x = M0[0, 2] + c * M1[0, 2] + s * M2[0, 2]
        y = M0[1, 2] + c * M1[1, 2] + s * M2[1, 2]
        z = M0[2, 2] + c * M1[2, 2] + s * M2[2, 2]
        xx = M0[0, 0] + c * M1[0, 0] + s * M2[0, 0]
        yx = M0[1, 0] + c * M1[1, 0] + s * M2[1, 0]
        xy = M0[0, 1] + c * M1[0, 1] + s * M2[0, 1]
        yy = M0[1, 1] + c * M1[1, 1] + s * M2[1, 1]
        h = math.sqrt(x * x + y * y)
        lost += 1 if h < _SINGULAR else 0
        ca, sa = x / h, y / h
        S[0, j] = atan2(y, x)
        S[1, j] = atan2(h, z)
        S[2, j] = atan2(ca * yx - sa * xx, ca * yy - sa * xy)
    if lost > 0:
        _split_lost(M0, M1, M2, looks, count, near, low, high, first, angles, S)
    for side in range(2):
        k = row + side
        for j in range(count):
            misfits[k, j] = 0.0
            ways[k, j] = 0.0
        for i in range(3):
            here, least, most = near[first + i], low[first + i], high[first + i]
            counts = 1.0 if first + i < last else 0.0
            sign = -1.0 if i == 1 and side == 1 else 1.0
            turn = math.pi if i != 1 and side == 1 else 0.0
            for j in range(count):
                outside, step = _image(sign * S[i, j] + turn, here, least, most)
                misfits[k, j] += outside
                ways[k, j] += counts * (step * step)
    if lost > 0:
        for j in range(count):
            if abs(math.sin(S[1, j])) < _SINGULAR:  # no sign to choose
                misfits[row + 1, j] = misfits[row, j]
                ways[row + 1, j] = ways[row, j]


@jit
def _split_lost(
    M0: Array, M1: Array, M2: Array, looks: Array, count: int, near: Array, low: Array, high: Array, first: int,
    angles: Array, S: Array,
) -> None:  # fmt: skip
    """S ← A, B, C of `_weigh` where sin B vanishes and only A ± C matters."""
    R = np.empty((3, 3))
    for j in range(count):
        s, c = sin_cos(looks[j])
        for r in range(3):
            for q in range(3):
                R[r, q] = M0[r, q] + c * M1[r, q] + s * M2[r, q]
        if math.sqrt(R[0, 2] * R[0, 2] + R[1, 2] * R[1, 2]) < _SINGULAR:
            zyz(R, 1.0, near, low, high, first, angles)
            for i in range(3):
                S[i, j] = angles[first + i]


@jit
def _solve(
    T: Array, inverse_base: Array, inverse_tool: Array, offset: Array, d3: float, d5: float, free_roll: bool,
    value: float, respect: bool, seed: Array, lower: Array, upper: Array, arcs: Array, out: Array,
) -> tuple[int, float, int]:  # fmt: skip
    """Branches at their best arm angles; see `solve`. Returns (code, gap, number of arcs)."""
    M = np.empty((4, 4))
    frame = np.empty((3, 3))
    R03, R47 = np.empty((3, 3)), np.empty((3, 3))
    A0, A1, A2 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    B0, B1, B2 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    angles = np.empty(7)
    breaks = np.empty(64)
    # Arm angles to look at: stops and the middles between them, then those at which some joint stays where it is.
    looks = np.empty(160)
    S, misfits, ways = np.empty((3, 160)), np.empty((4, 160)), np.empty((4, 160))
    near, low, high = shifted(seed, offset), shifted(lower, offset), shifted(upper, offset)
    clear(out)
    to_canonical(T, inverse_base, inverse_tool, M)
    code, gap, _, A, rho, bend = _triangle(M, d3, d5, frame)
    if code != 0:
        return code, gap, 0
    free = math.isnan(value)
    still = shifted(seed, offset)
    if free_roll:
        low[6], high[6] = -1e9, 1e9
        still[6] += 2.0 * math.pi  # a limit that spans a turn never binds
    joints = 6 if free_roll else 7
    wish = _arm_angle(near, frame, d3, d5) if free else value
    if bend == 0.0 and free and math.sin(near[3]) < 0.0:
        # A straight arm has no elbow side; the seed's, seen from the other sign of θ4, keeps θ3 and θ5 still.
        wish += math.pi
    found = 0
    for e in range(2):
        theta4 = bend if e == 0 else -bend
        if e == 1 and bend == 0.0:
            break
        elbow_misfit = excess(theta4, low[3], high[3])
        elbow_way = (nearest_image(theta4, near[3], low[3], high[3]) - near[3]) ** 2
        n_probes = 0
        _rotations(M, frame, A, rho, d3, theta4, 0.0, 0.0, 1.0, A0, B0)
        _rotations(M, frame, A, rho, d3, theta4, 1.0, 0.0, 0.0, A1, B1)
        _rotations(M, frame, A, rho, d3, theta4, 0.0, 1.0, 0.0, A2, B2)
        if respect:
            count = zyz_breaks(A0, A1, A2, low, high, 0, breaks, 0)
            count = zyz_breaks(B0, B1, B2, low, high, 4, breaks, count)
            n_probes = lay_probes(breaks, count, looks)
        n_looks = n_probes
        if free:
            n_looks = zyz_breaks(A0, A1, A2, near, still, 0, looks, n_looks)
            n_looks = zyz_breaks(B0, B1, B2, near, still, 4, looks, n_looks)
        # Shoulder and wrist do not see each other: each is judged once per arm angle and sign.
        _weigh(A0, A1, A2, looks, n_looks, near, low, high, 0, 3, 0, angles, S, misfits, ways)
        _weigh(B0, B1, B2, looks, n_looks, near, low, high, 4, joints, 2, angles, S, misfits, ways)
        for si in range(2):
            for wi in range(2):
                branch = 4 * si + 2 * e + wi
                psi = wish
                first = found
                best = math.inf
                for j in range(n_probes):
                    misfit = elbow_misfit + misfits[si, j] + misfits[2 + wi, j]
                    if misfit == 0.0 and found < arcs.shape[0]:
                        found = extend_arcs(arcs, first, found, branch, looks, j, n_probes)
                    elif misfit < best and found == first:
                        best = misfit
                        psi = looks[j]
                if not free:
                    psi = value
                elif found > first:
                    psi = nearest_in_arcs(arcs, first, found, wish)
                s2 = 1.0 if si == 0 else -1.0
                s6 = 1.0 if wi == 0 else -1.0
                _fill(M, frame, A, rho, d3, theta4, psi, s2, s6, near, low, high, R03, R47, angles)
                way = _travel(angles, near, low, high, 0, joints)
                if free and way >= _CALM**2:
                    # Beside s2 = 0 or s6 = 0 an elbow held still makes two joints spin against each other; one
                    # that gives way by as little as the target misses the alignment keeps them still. So another
                    # arm angle is taken if it halves the way the joints go.
                    least = 0.25 * way
                    calm = -1
                    for j in range(n_looks):
                        between = n_probes > 0 and j % 2 == 1 and j < n_probes
                        outside = respect and elbow_misfit + misfits[si, j] + misfits[2 + wi, j] > 0.0
                        way = elbow_way + ways[si, j] + ways[2 + wi, j]
                        if way < least and not between and not outside:
                            least, calm = way, j
                    if calm >= 0:
                        psi = looks[calm]
                        _fill(M, frame, A, rho, d3, theta4, psi, s2, s6, near, low, high, R03, R47, angles)
                for i in range(7):
                    out[branch, i] = wrap(angles[i] - offset[i])
                if free_roll:
                    out[branch, 6] = min(max(seed[6], lower[6]), upper[6])
                out[branch, 7] = wrap(psi)
    if bend == 0.0:
        for branch in (0, 1, 4, 5):
            copy_row(out, branch, branch + 2)
    return 0, 0.0, found


# Thin: all branches at one arm angle, without limits, ranges and a choice, as :mod:`kin.solvers.blocks` has it.
# One branch is enough: the others are its half turns, a sign of θ2 turns θ1 and θ3, one of θ4 turns θ3 and θ5, one
# of θ6 turns θ5 and θ7.

_PAIRS, _END, _ROWS = 7, OWN + 7, OWN + 15
_TOOL, _OFFSET, _LENGTHS = 12, 24, 31
_UNBOUND = 1e6


@jit
def _radial(near: Array, d3: float, d5: float) -> tuple[float, float, float]:
    """The elbow's direction off the line SW at canonical angles, see `_arm_angle`."""
    s1, c1 = sine_cosine(near[0])
    s2, c2 = sine_cosine(near[1])
    s3, c3 = sine_cosine(near[2])
    s4, c4 = sine_cosine(near[3])
    along, m = d3 + d5 * c4, d5 * abs(s4)
    length = math.sqrt(along * along + m * m)
    along, m = (along / length, m / length) if length > 0.0 else (1.0, 0.0)
    k = -along if s4 >= 0.0 else along
    return (
        k * (c1 * c2 * c3 - s1 * s3) + m * c1 * s2,
        k * (s1 * c2 * c3 + c1 * s3) + m * s1 * s2,
        m * c2 - k * s2 * c3,
    )


@inlined
def _zyz_pairs(
    m00: float, m01: float, m02: float, m10: float, m11: float, m12: float
) -> tuple[float, float, float, bool]:
    """y and x of the third angle of Rz Ry Rz, |sin| of the second, and whether that vanishes; see `zyz`."""
    h = math.sqrt(m02 * m02 + m12 * m12)
    c, s = m02 / h, m12 / h
    return c * m10 - s * m00, c * m11 - s * m01, h, h < _SINGULAR


@inlined
def _pairs(params: Array, near: Array, count: int, S: Array) -> int:
    """The pairs of `count` targets; S[-1] ← 1.0 for those to be looked at closely, and how many these are.

    An arm angle of NaN stands for the elbow's direction of near ``(7,)``.
    """
    d3, d5 = params[_LENGTHS], params[_LENGTHS + 1]
    most, least = d3 + d5, abs(d3 - d5)
    nearest = max(least - _REACH, 1e-12)
    half = 0.5 / (d3 * d5)
    base, tool = rows_of(params, 0), rows_of(params, _TOOL)
    t00, t01, t02, t03, t10, t11, t12, t13, t20, t21, t22, t23 = tool
    free, wide = 0, 0
    for b in range(count):
        value = S[VALUE, b]
        free += 0 if value == value else 1
        wide += 1 if abs(value) > WIDE else 0
    if wide > 0:
        for b in range(count):
            S[VALUE, b] = wrap(S[VALUE, b]) if abs(S[VALUE, b]) > WIDE else S[VALUE, b]
    rx, ry, rz = 0.0, 0.0, 0.0
    if free > 0:
        rx, ry, rz = _radial(shifted(near, params[_OFFSET:_LENGTHS]), d3, d5)
    found = 0
    for b in range(count):
        u0, u1, u2 = in_base(base, S, 0, b)
        v0, v1, v2 = in_base(base, S, 1, b)
        w0, w1, w2 = in_base(base, S, 2, b)
        x, y, z = in_base(base, S, 3, b)
        px = u0 * t03 + v0 * t13 + w0 * t23 + (x + base[3])
        py = u1 * t03 + v1 * t13 + w1 * t23 + (y + base[7])
        pz = u2 * t03 + v2 * t13 + w2 * t23 + (z + base[11])
        # The triangle S–E–W: u = (ux, uy, uz) towards W, e1 and e2 across it.
        L2 = px * px + py * py + pz * pz
        far, near_by = most * most - L2, L2 - least * least
        far = far if far > 0.0 else 0.0
        near_by = near_by if near_by > 0.0 else 0.0
        lost = ((most + _REACH) ** 2 < L2) | (nearest * nearest > L2)
        s4 = half * math.sqrt(far * near_by)
        c4 = math.nan if lost else 0.5 * half * (near_by - far)
        inverse_L = 1.0 / math.sqrt(L2)
        along, rho = (d3 + d5 * c4) * inverse_L, d5 * s4 * inverse_L
        ux, uy, uz = px * inverse_L, py * inverse_L, pz * inverse_L
        h = math.sqrt(ux * ux + uy * uy)
        inverse_h = 1.0 / h
        e2x, e2y = uy * inverse_h, -ux * inverse_h
        e1x, e1y = e2y * uz, -e2x * uz
        along1, along2 = rx * e1x + ry * e1y + rz * h, rx * e2x + ry * e2y
        amplitude = math.sqrt(along1 * along1 + along2 * along2)
        s, c = sin_cos(S[VALUE, b])
        asked = c == c
        c = c if asked else along1 / amplitude
        s = s if asked else along2 / amplitude
        qx, qy, qz = c * e1x + s * e2x, c * e1y + s * e2y, c * h
        x0, x1, x2 = rho * ux - along * qx, rho * uy - along * qy, rho * uz - along * qz
        y0, y1, y2 = s * e1x - c * e2x, s * e1y - c * e2y, s * h
        z0, z1, z2 = along * ux + rho * qx, along * uy + rho * qy, along * uz + rho * qz
        S[OWN, b], S[_END, b] = z1, z0
        S[OWN + 2, b], S[_END + 2, b], S[OWN + 1, b], close0 = _zyz_pairs(x0, y0, z0, x1, y1, z1)
        S[_END + 1, b] = z2
        S[OWN + 3, b], S[_END + 3, b] = s4, c4
        # R47 = R04ᵀ R, and R = (u v w)·tool⁻¹ is applied last.
        f0, f1, f2 = c4 * x0 - s4 * z0, c4 * x1 - s4 * z1, c4 * x2 - s4 * z2
        g0, g1, g2 = s4 * x0 + c4 * z0, s4 * x1 + c4 * z1, s4 * x2 + c4 * z2
        fu, fv, fw = f0 * u0 + f1 * u1 + f2 * u2, f0 * v0 + f1 * v1 + f2 * v2, f0 * w0 + f1 * w1 + f2 * w2
        yu, yv, yw = y0 * u0 + y1 * u1 + y2 * u2, y0 * v0 + y1 * v1 + y2 * v2, y0 * w0 + y1 * w1 + y2 * w2
        gu, gv, gw = g0 * u0 + g1 * u1 + g2 * u2, g0 * v0 + g1 * v1 + g2 * v2, g0 * w0 + g1 * w1 + g2 * w2
        m00, m01, m02 = (
            fu * t00 + fv * t10 + fw * t20,
            fu * t01 + fv * t11 + fw * t21,
            fu * t02 + fv * t12 + fw * t22,
        )
        m10, m11, m12 = (
            yu * t00 + yv * t10 + yw * t20,
            yu * t01 + yv * t11 + yw * t21,
            yu * t02 + yv * t12 + yw * t22,
        )
        S[OWN + 4, b], S[_END + 4, b] = m12, m02
        S[OWN + 6, b], S[_END + 6, b], S[OWN + 5, b], close1 = _zyz_pairs(m00, m01, m02, m10, m11, m12)
        S[_END + 5, b] = gu * t02 + gv * t12 + gw * t22
        close = close0 | close1 | (far < 1e-14 * near_by) | (h < 1e-12) | ((not asked) & (amplitude < 1e-12))
        special = close & (not lost)
        S[-1, b] = 1.0 if special else 0.0
        found += 1 if special else 0
    return found


@jit
def _closely(params: Array, T: Array, value: float, near: Array, out: Array) -> None:
    """out ``(8, 7)`` ← the branches by `_solve`, which is at home in singularities."""
    inverse_base, inverse_tool, M, frame = np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4)), np.empty((3, 3))
    arcs, rows = np.empty((1, 3)), np.empty((8, 8))
    offset, lower, upper = np.empty(7), np.empty(7), np.empty(7)
    for i in range(12):
        inverse_base[i // 4, i % 4] = params[i]
        inverse_tool[i // 4, i % 4] = params[_TOOL + i]
    for i in range(7):
        offset[i], lower[i], upper[i] = params[_OFFSET + i], -_UNBOUND, _UNBOUND
    d3, d5 = params[_LENGTHS], params[_LENGTHS + 1]
    if math.isnan(value):
        to_canonical(T, inverse_base, inverse_tool, M)
        code, _, _, _, _, bend = _triangle(M, d3, d5, frame)
        if code == 0:
            angles = shifted(near, offset)
            value = _arm_angle(angles, frame, d3, d5)
            if bend == 0.0 and math.sin(angles[3]) < 0.0:
                value += math.pi  # as in `_solve`
    no = arcs.shape[0] == 0  # a literal False would compile `_solve` once more
    _solve(T, inverse_base, inverse_tool, offset, d3, d5, no, value, no, near, lower, upper, arcs, rows)
    for i in range(8):
        for j in range(7):
            out[i, j] = rows[i, j]


@joined
def _angles(arc: Arc, params: Array, near: Array, count: int, S: Array) -> None:
    """S ← the joint values of `count` targets, from the pairs."""
    widest()
    for k in range(_PAIRS):
        # Half a turn apart for an even k (θ1, θ3, θ5, θ7), of either sign for an odd one.
        double(arc, S, OWN + k, OWN + k + 1, _PAIRS, count, 1.0, params[_OFFSET + k], k % 2 == 0)


@inlined
def _store(params: Array, S: Array, b: int, out: Array) -> None:
    """out ``(8, 7)`` ← the branches of target b."""
    for row in range(8):
        shoulder, elbow, wrist = row >> 2, (row >> 1) & 1, row & 1
        out[row, 0] = S[_PAIRS * shoulder + OWN, b]
        out[row, 1] = S[_PAIRS * shoulder + OWN + 1, b]
        out[row, 2] = S[_PAIRS * (shoulder ^ elbow) + OWN + 2, b]
        out[row, 3] = S[_PAIRS * elbow + OWN + 3, b]
        out[row, 4] = S[_PAIRS * (elbow ^ wrist) + OWN + 4, b]
        out[row, 5] = S[_PAIRS * wrist + OWN + 5, b]
        out[row, 6] = S[_PAIRS * wrist + OWN + 6, b]


@jit
def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 8, 7)`` ← all branches of each of the targets T ``(N, 4, 4)``; see `branches_one`.

    values: the arm angle for each target ``(N,)``, or one for all ``(1,)``.
    """
    widest()
    S = np.empty((_ROWS, BLOCK))
    each(_pairs, _angles, _store, _closely, params, T, values, near, out, S)


@jit
def branches_one(params: Array, T: Array, value: float, near: Array, out: Array) -> bool:
    """out ``(8, 7)`` ← all branches of the target T ``(4, 4)``, NaN if there is none; False if T is not finite.

    value: the arm angle, NaN for the elbow direction of near ``(7,)``; near also has the angles that are free at a
    singularity.
    """
    S = np.empty((_ROWS, 1))
    return one(_pairs, _angles, _store, _closely, _PAIRS, params, T, value, near, out, S)


class Srs7(ClosedForm):
    """The closed form of an S-R-S arm."""

    name, title, branches = NAME, TITLE, BRANCHES
    reason = (
        "axes 1, 2, 3 meet in one point and axes 5, 6, 7 in another, "
        "with the elbow's axis perpendicular to both links"
    )

    def __init__(self, geometry: Geometry) -> None:
        g = self.geometry = geometry
        self.lengths = (g.d3, g.d5)
        # base⁻¹ and tool⁻¹ by rows, offsets, d3, d5.
        offset = [wrap(t) for t in g.offset.tolist()]
        params = np.array([*g.inverse_base[:3].ravel(), *g.inverse_tool[:3].ravel(), *offset, g.d3, g.d5])
        self.kernels = BatchKernels(params, branches_one, branches_many)

    def handles(self, task: int) -> bool:
        """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
        return task == POSE or (task == APPROACH and self.geometry.tool_on_axis)

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """The arm angle; for an approach direction joint 7 as well."""
        return (_PSI, _THETA7) if task == APPROACH else (_PSI,)

    def solve(self, problem: SolverInput) -> Candidates:
        """All branches, each at the feasible arm angle nearest to the seed's (or at the requested one)."""
        g, free_roll = self.geometry, problem.task == APPROACH
        out, arcs = np.empty((8, 8)), np.empty((256, 3))
        code, gap, count = _solve(
            problem.T, g.inverse_base, g.inverse_tool, g.offset, g.d3, g.d5, free_roll, problem.values[0],
            problem.respect_limits, problem.seed, problem.lower, problem.upper, arcs, out,
        )  # fmt: skip
        values, all_arcs = out[:, 7:], [arcs[:count]]
        if free_roll:
            # Joint 7 turns the tool about its own axis and nothing else: it stays, or takes the requested value.
            if not math.isnan(problem.values[1]):
                out[:, 6] = np.where(np.isnan(out[:, 6]), math.nan, problem.values[1])
            values = out[:, [7, 6]]
            spans = [(i, problem.lower[6], problem.upper[6]) for i in range(8) if not math.isnan(out[i, 6])]
            all_arcs.append(np.array(spans, dtype=np.float64).reshape(-1, 3))
        obstacle = None
        if code == 1:
            obstacle = Obstacle("wrist centre too far from the shoulder", g.d3 + g.d5)
        elif code == 2:
            obstacle = Obstacle("wrist centre too near to the shoulder", abs(g.d3 - g.d5))
        return Candidates(out[:, :7], values, tuple(all_arcs), gap, obstacle)

    def branch_of(self, q: Array) -> int:
        """The branch a configuration is on: "shoulder", "elbow" and "wrist" are the signs of θ2, θ4, θ6."""
        s = np.sin(q + self.geometry.offset)
        return 4 * int(s[1] < 0.0) + 2 * int(s[3] < 0.0) + int(s[5] < 0.0)

    def singularities(self, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
        """The zeros of √det(J Jᵀ) = d3 d5 |s4| |m|, where m spans the motions that keep the tool still.

        With s4 ≠ 0 it vanishes for s2 = c3 = 0, for s6 = c5 = 0 and for s2 = s6 = 0 only: s2 = 0 or s6 = 0 alone
        is no singularity of this arm.
        """
        g = self.geometry
        t = (q + g.offset).tolist()
        off = (
            0.0,
            off_line(t[1]),
            off_perpendicular(t[2]),
            off_line(t[3]),
            off_perpendicular(t[4]),
            off_line(t[5]),
        )
        side, along = g.d5 * math.sin(t[3]), g.d3 + g.d5 * math.cos(t[3])
        x = math.cos(t[1]) * math.cos(t[2]) * side + math.sin(t[1]) * along
        above, before = math.hypot(off[1], off[2]), math.hypot(off[5], off[4])
        both, off_axis = math.hypot(off[1], off[5]), math.hypot(x, math.sin(t[2]) * side)
        if min(abs(off[3]), above, before, both, off_axis) > within:
            return ()  # as almost everywhere

        def met_at(*joints: int) -> tuple[JointValue, ...]:
            return tuple(JointValue(i, float(q[i]) - off[i]) for i in joints)

        return those_within(
            within,
            Singularity("elbow", elbow_at(t[3]), "hand along the arm", abs(off[3]), "rad", met_at(3)),
            Singularity("shoulder", "upper arm on axis 1", "hand along the forearm", above, "rad", met_at(1, 2)),
            Singularity(
                "wrist",
                "hand along the forearm, axes 4 and 6 perpendicular",
                "hand along the upper arm",
                before,
                "rad",
                met_at(5, 4),
            ),
            Singularity(
                "wrist",
                "upper arm on axis 1, hand along the forearm",
                "joints 1 and 3, 5 and 7 coincide",
                both,
                "rad",
                met_at(1, 5),
            ),
            Singularity("algorithmic", "wrist centre on axis 1", "reference of the arm angle", off_axis, "m"),
        )
