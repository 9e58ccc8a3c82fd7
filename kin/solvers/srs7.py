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

from kin.kernels import jit
from kin.robot import Robot
from kin.solvers.common import (
    APPROACH,
    POSE,
    Candidates,
    Freedom,
    Problem,
    chain_of,
    clear,
    copy_row,
    excess,
    extend_arcs,
    inverse,
    is_zero,
    lay_probes,
    merged,
    misfit_of,
    nearest_image,
    nearest_in_arcs,
    screw_z,
    shifted,
    split_sum,
    to_canonical,
    wrap,
    zyz,
    zyz_breaks,
)
from kin.solvers.singular import Singularity, at, off_line, off_square, stretch, those_within
from kin.tolerances import TOLERANCES
from kin.transforms import Array

NAME = "srs7"
TITLE = "closed form, S-R-S arm"
_PSI = Freedom("psi", "arm angle ψ", circular=True)
_THETA7 = Freedom("theta7", "θ7", joint=6)
BRANCHES = tuple(
    f"shoulder {s} · elbow {e} · wrist {w}"
    for s in ("front", "back")
    for e in ("up", "down")
    for w in ("no-flip", "flip")
)
_REACH = TOLERANCES.closure_position * 0.1
_SINGULAR = TOLERANCES.singular
_CALM = 0.05  # rad; a way shorter than this is calm


class Geometry(NamedTuple):
    """The arm in canonical form: joint values are q = θ − offset."""

    inverse_base: Array
    inverse_tool: Array
    offset: Array
    d3: float
    d5: float
    tool_on_axis: bool


def match(robot: Robot) -> Geometry | None:
    """The geometry if the robot is an S-R-S arm, by its axes: 1-2-3 and 5-6-7 concurrent, neighbours square."""
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
    return Geometry(inverse(base), inverse(tool), chain.theta, d3, d5, bool(on_axis))


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
    c1, s1, c2, s2 = math.cos(near[0]), math.sin(near[0]), math.cos(near[1]), math.sin(near[1])
    c3, s3, s4 = math.cos(near[2]), math.sin(near[2]), math.sin(near[3])
    beta = math.atan2(d5 * abs(s4), d3 + d5 * math.cos(near[3]))
    k = -math.cos(beta) if s4 >= 0.0 else math.cos(beta)
    m = math.sin(beta)
    rx = k * (c1 * c2 * c3 - s1 * s3) + m * c1 * s2
    ry = k * (s1 * c2 * c3 + c1 * s3) + m * s1 * s2
    rz = -k * s2 * c3 + m * c2
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


@jit
def _weigh(
    M0: Array, M1: Array, M2: Array, psi: float, near: Array, low: Array, high: Array, first: int, last: int,
    column: int, angles: Array, misfits: Array, ways: Array, j: int,
) -> None:  # fmt: skip
    """misfits, ways [j, column + side] ← how far a spherical joint's angles at ψ are outside the limits, and their
    squared steps from `near`, for either sign of sin B.

    ``Rz(A) Ry(B) Rz(C) = M0 + M1 cos ψ + M2 sin ψ``; the other sign is A + π, −B, C + π. The steps of the joints
    first…last−1 count.
    """
    c, s = math.cos(psi), math.sin(psi)
    x = M0[0, 2] + c * M1[0, 2] + s * M2[0, 2]
    y = M0[1, 2] + c * M1[1, 2] + s * M2[1, 2]
    z = M0[2, 2] + c * M1[2, 2] + s * M2[2, 2]
    xx = M0[0, 0] + c * M1[0, 0] + s * M2[0, 0]
    yx = M0[1, 0] + c * M1[1, 0] + s * M2[1, 0]
    xy = M0[0, 1] + c * M1[0, 1] + s * M2[0, 1]
    yy = M0[1, 1] + c * M1[1, 1] + s * M2[1, 1]
    h = math.sqrt(x * x + y * y)
    k = first + 2
    if h < _SINGULAR:
        sign = 1.0 if z > 0.0 else -1.0
        total = math.atan2(sign * yx, sign * xx)
        if z > 0.0:
            A = split_sum(total, near[first], low[first], high[first], near[k], low[k], high[k])
        else:
            A = split_sum(total, near[first], low[first], high[first], -near[k], -high[k], -low[k])
        ca, sa = math.cos(A), math.sin(A)
    else:
        A = math.atan2(y, x)
        ca, sa = x / h, y / h
    angles[first] = A
    angles[first + 1] = math.atan2(h, z)
    angles[k] = math.atan2(ca * yx - sa * xx, ca * yy - sa * xy)
    for side in range(2):
        misfits[j, column + side] = misfit_of(angles, low, high, first, first + 3)
        ways[j, column + side] = _travel(angles, near, low, high, first, last)
        if h >= _SINGULAR:
            angles[first] += math.pi
            angles[first + 1] = -angles[first + 1]
            angles[k] += math.pi


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
    misfits, ways = np.empty((160, 4)), np.empty((160, 4))
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
        for j in range(n_looks):
            _weigh(A0, A1, A2, looks[j], near, low, high, 0, 3, 0, angles, misfits, ways, j)
            _weigh(B0, B1, B2, looks[j], near, low, high, 4, joints, 2, angles, misfits, ways, j)
        for si in range(2):
            for wi in range(2):
                branch = 4 * si + 2 * e + wi
                psi = wish
                first = found
                best = math.inf
                for j in range(n_probes):
                    misfit = elbow_misfit + misfits[j, si] + misfits[j, 2 + wi]
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
                        outside = respect and elbow_misfit + misfits[j, si] + misfits[j, 2 + wi] > 0.0
                        way = elbow_way + ways[j, si] + ways[j, 2 + wi]
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


def solve(geometry: Geometry, problem: Problem) -> Candidates:
    """All branches, each at the feasible arm angle nearest to the seed's (or at the given one)."""
    free_roll = problem.task == APPROACH
    out = np.empty((8, 8))
    arcs = np.empty((256, 3))
    g = geometry
    code, gap, count = _solve(
        problem.T, g.inverse_base, g.inverse_tool, g.offset, g.d3, g.d5, free_roll, problem.values[0],
        problem.respect_limits, problem.seed, problem.lower, problem.upper, arcs, out,
    )  # fmt: skip
    values, all_arcs = out[:, 7:], [arcs[:count]]
    if free_roll:
        # Joint 7 turns the tool about its own axis and nothing else: it stays, or goes where it is asked to be.
        if not math.isnan(problem.values[1]):
            out[:, 6] = np.where(np.isnan(out[:, 6]), math.nan, problem.values[1])
        values = out[:, [7, 6]]
        spans = [(i, problem.lower[6], problem.upper[6]) for i in range(8) if not math.isnan(out[i, 6])]
        all_arcs.append(np.array(spans, dtype=np.float64).reshape(-1, 3))
    return Candidates(
        q=out[:, :7],
        values=values,
        arcs=tuple(all_arcs),
        gap=gap,
        obstacle="" if code == 0 else _obstacle(code, g),
    )


def _obstacle(code: int, g: Geometry) -> str:
    reach = g.d3 + g.d5 if code == 1 else abs(g.d3 - g.d5)
    word = "farther than" if code == 1 else "nearer than"
    return f"with this orientation the wrist centre is {word} {1e3 * reach:.0f} mm from the shoulder"


def why(geometry: Geometry) -> str:
    """What makes an arm one of this family."""
    return "axes 1, 2, 3 meet in one point and axes 5, 6, 7 in another, with the elbow's axis square to both links"


def handles(geometry: Geometry, task: int) -> bool:
    """Poses, and an approach direction when it is the last joint's own axis (then that joint is free)."""
    return task == POSE or (task == APPROACH and geometry.tool_on_axis)


def freedoms(geometry: Geometry, task: int) -> tuple[Freedom, ...]:
    """The arm angle; for an approach direction joint 7 as well."""
    return (_PSI, _THETA7) if task == APPROACH else (_PSI,)


def branch_of(geometry: Geometry, q: Array) -> int:
    """The branch a configuration is on: "shoulder", "elbow" and "wrist" are the signs of θ2, θ4, θ6."""
    s = np.sin(q + geometry.offset)
    return 4 * int(s[1] < 0.0) + 2 * int(s[3] < 0.0) + int(s[5] < 0.0)


def singularities(geometry: Geometry, q: Array, within: float = math.inf) -> tuple[Singularity, ...]:
    """How far a configuration ``(7,)`` is from each of the arm's singularities.

    √det(J Jᵀ) = d3 d5 |s4| |m|, where m spans the motions that keep the tool still. With s4 ≠ 0 it vanishes for
    s2 = c3 = 0, for s6 = c5 = 0 and for s2 = s6 = 0 only: s2 = 0 or s6 = 0 alone is no singularity of this arm.
    """
    g = geometry
    t = (q + g.offset).tolist()
    shoulder, across3, elbow = off_line(t[1]), off_square(t[2]), off_line(t[3])
    across5, wrist = off_square(t[4]), off_line(t[5])
    side, along = g.d5 * math.sin(t[3]), g.d3 + g.d5 * math.cos(t[3])
    x = math.cos(t[1]) * math.cos(t[2]) * side + math.sin(t[1]) * along
    return those_within(
        within,
        (
            "elbow",
            abs(elbow),
            "rad",
            lambda: f"elbow {stretch(t[3])} ({at(4, q[3], elbow)}): the hand cannot shift along the arm",
        ),
        (
            "shoulder",
            math.hypot(shoulder, across3),
            "rad",
            lambda: (
                f"upper arm on axis 1, axes 2 and 4 square ({at(2, q[1], shoulder)}, {at(3, q[2], across3)}): "
                "the hand cannot shift along the forearm"
            ),
        ),
        (
            "wrist",
            math.hypot(wrist, across5),
            "rad",
            lambda: (
                f"hand in line with the forearm, axes 4 and 6 square ({at(6, q[5], wrist)}, "
                f"{at(5, q[4], across5)}): the hand cannot shift along the upper arm"
            ),
        ),
        (
            "wrist",
            math.hypot(shoulder, wrist),
            "rad",
            lambda: (
                f"upper arm on axis 1 and hand in line with the forearm "
                f"({at(2, q[1], shoulder)}, {at(6, q[5], wrist)}): "
                "joints 1 and 3 turn about one line, joints 5 and 7 about another"
            ),
        ),
        (
            "algorithmic",
            math.hypot(x, math.sin(t[2]) * side),
            "m",
            lambda: "wrist centre on axis 1: the arm angle ψ loses its reference, the arm no motion",
        ),
    )
