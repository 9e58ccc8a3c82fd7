"""Any serial arm by its axes as lines in space, and the kernels that the closed forms built on it share.

A table of DH rows has many spellings: two conventions, twists of either sign, rows that do not move, joints that
turn backwards. The lines the joints turn about have one. `links_of` reads these lines with every joint at 0, joins
each to the next by their common normal, and so writes every arm down in one and the same way. Whether an arm
belongs to a family is then a matter of which twists are square or zero and which lengths vanish.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.kernels.compile import jit
from kin.kernels.simd import atan2
from kin.robot import Robot
from kin.solvers.common import (
    add_roots,
    excess,
    extend_arcs,
    inverse,
    is_zero,
    lay_probes,
    nearest_in_arcs,
    screw_x,
    screw_z,
    split_sum,
    wrap,
)
from kin.solvers.contract import SolverInput
from kin.tolerances import TOLERANCES
from kin.transforms import Array

TURN = 2.0 * math.pi
_MERGE = TOLERANCES.merge
_SINGULAR = TOLERANCES.singular
_REACH = TOLERANCES.closure_position * 0.1


class Links(NamedTuple):
    """Any serial arm as ``base · L1 L2 … Ln · tool``, read off its axes as lines in space.

    ``Li = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)``; joint i adds ``sign_i q_i`` to theta_i if it turns, to d_i if
    it slides. The last link has neither d nor a nor twist, these are in `tool`; theta_1 = d_1 = 0.
    """

    base: Array
    sign: Array
    theta: Array
    d: Array
    a: Array
    alpha: Array
    tool: Array


def axes_of(robot: Robot) -> tuple[Array, Array, Array, Array]:
    """The joint axes with every joint at 0: (z ``(n, 3)``, points ``(n, 3)``, signs ``(n,)``, T_base_tool).

    An axis that is antiparallel to the one before is turned round, and so is the first if it points down in the
    arm's base: its joint then counts with sign −1.
    """
    T = robot.T_world_base.copy()
    z, points, sign = np.empty((robot.n, 3)), np.empty((robot.n, 3)), np.ones(robot.n)
    joint = 0
    for row in robot.rows:
        parts = [screw_z(row.theta, row.d), screw_x(row.a, row.alpha)]
        turning = 0 if robot.convention == "standard" else 1
        for k, part in enumerate(parts if turning == 0 else parts[::-1]):
            if k == turning and row.kind != "fixed":
                z[joint], points[joint] = T[:3, 2], T[:3, 3]
                joint += 1
            T = T @ part
    up = robot.T_world_base[:3, 2]
    for i in range(robot.n):
        before = z[i - 1] if i else up
        if z[i] @ before < -TOLERANCES.geometry and (i == 0 or is_zero(*np.cross(before, z[i]))):
            z[i], sign[i] = -z[i], -1.0
    return z, points, sign, T @ robot.T_last_tool


def links_of(robot: Robot, twists: tuple[int, ...]) -> Links:
    """The robot as `Links`, each twist with the sign in `twists` (one per joint but the last) or zero.

    Common normals make the frames: so neither the convention nor rows that do not move are seen in the result,
    and of parallel axes all offsets along them are in the last one's d.
    """
    z, points, sign, end = axes_of(robot)
    theta, d, a, alpha = (np.zeros(robot.n) for _ in range(4))
    origin, incoming = points[0], np.zeros(3)
    base = frame = np.eye(4)
    for i, sense in enumerate(twists):
        cross, between = np.cross(z[i], z[i + 1]), points[i + 1] - origin
        sine = float(np.linalg.norm(cross))
        if sine < TOLERANCES.geometry:
            foot, across = origin, between - z[i] * (between @ z[i])
            a[i] = float(np.linalg.norm(across))
            if a[i] < TOLERANCES.geometry:
                a[i], across = 0.0, incoming if incoming.any() else square_to(z[i])
            x = across / np.linalg.norm(across)
            origin = origin + a[i] * x
        else:
            x = sense * cross / sine
            alpha[i] = sense * math.atan2(sine, z[i] @ z[i + 1])
            a[i] = between @ x
            foot = origin + z[i] * (np.cross(between, z[i + 1]) @ cross / sine**2)
            origin = points[i + 1] + z[i + 1] * (np.cross(between, z[i]) @ cross / sine**2)
        if i == 0:
            base = frame_of(x, z[0], foot)
        else:
            theta[i] = math.atan2(np.cross(incoming, x) @ z[i], incoming @ x)
            d[i] = (foot - frame[:3, 3]) @ z[i]
        incoming = x
        frame = frame_of(x, z[i + 1], origin)
    return Links(base, sign, theta, d, a, alpha, inverse(frame) @ end)


def square_to(z: Array) -> Array:
    """Any unit vector square to the unit vector z."""
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    return np.asarray(x / np.linalg.norm(x))


def frame_of(x: Array, z: Array, origin: Array) -> Array:
    """The frame with these axes x and z (unit vectors, square) and this origin ``(4, 4)``."""
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, origin
    return T


def is_square(angle: float) -> bool:
    """Whether an angle is 90° or −90° within the geometric tolerance."""
    return abs(abs(angle) - 0.5 * math.pi) < TOLERANCES.geometry


def rolled(T: Array, angle: float) -> Array:
    """The pose T ``(4, 4)`` turned about its own z axis."""
    return T @ screw_z(angle, 0.0)


def free_last(problem: SolverInput, out: Array) -> Array:
    """Put a last joint that only rolls the tool where it may be, in place; returns its arcs ``(k, 3)``.

    It stays at the seed's value, inside the limits, or goes where the last of the problem's values wants it.
    """
    there = ~np.isnan(out[:, -1])
    low, high, asked = problem.lower[-1], problem.upper[-1], problem.values[-1]
    out[there, -1] = min(max(problem.seed[-1], low), high) if math.isnan(asked) else asked
    return np.array([(i, low, high) for i in np.flatnonzero(there)], dtype=np.float64).reshape(-1, 3)


def pose_params(base: Array, tool: Array) -> list[float]:
    """What `canonical` reads ``(24,)``: the first three rows of base⁻¹ and of tool⁻¹."""
    return [*inverse(base)[:3].ravel().tolist(), *inverse(tool)[:3].ravel().tolist()]


@jit
def canonical(
    params: Array, T: Array
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float]:
    """base⁻¹ · T · tool⁻¹ as twelve numbers, row after row; params[0:24] as from `pose_params`."""
    p = params
    a0 = p[0] * T[0, 0] + p[1] * T[1, 0] + p[2] * T[2, 0]
    a1 = p[0] * T[0, 1] + p[1] * T[1, 1] + p[2] * T[2, 1]
    a2 = p[0] * T[0, 2] + p[1] * T[1, 2] + p[2] * T[2, 2]
    a3 = p[0] * T[0, 3] + p[1] * T[1, 3] + p[2] * T[2, 3] + p[3]
    b0 = p[4] * T[0, 0] + p[5] * T[1, 0] + p[6] * T[2, 0]
    b1 = p[4] * T[0, 1] + p[5] * T[1, 1] + p[6] * T[2, 1]
    b2 = p[4] * T[0, 2] + p[5] * T[1, 2] + p[6] * T[2, 2]
    b3 = p[4] * T[0, 3] + p[5] * T[1, 3] + p[6] * T[2, 3] + p[7]
    c0 = p[8] * T[0, 0] + p[9] * T[1, 0] + p[10] * T[2, 0]
    c1 = p[8] * T[0, 1] + p[9] * T[1, 1] + p[10] * T[2, 1]
    c2 = p[8] * T[0, 2] + p[9] * T[1, 2] + p[10] * T[2, 2]
    c3 = p[8] * T[0, 3] + p[9] * T[1, 3] + p[10] * T[2, 3] + p[11]
    return (
        a0 * p[12] + a1 * p[16] + a2 * p[20],
        a0 * p[13] + a1 * p[17] + a2 * p[21],
        a0 * p[14] + a1 * p[18] + a2 * p[22],
        a0 * p[15] + a1 * p[19] + a2 * p[23] + a3,
        b0 * p[12] + b1 * p[16] + b2 * p[20],
        b0 * p[13] + b1 * p[17] + b2 * p[21],
        b0 * p[14] + b1 * p[18] + b2 * p[22],
        b0 * p[15] + b1 * p[19] + b2 * p[23] + b3,
        c0 * p[12] + c1 * p[16] + c2 * p[20],
        c0 * p[13] + c1 * p[17] + c2 * p[21],
        c0 * p[14] + c1 * p[18] + c2 * p[22],
        c0 * p[15] + c1 * p[19] + c2 * p[23] + c3,
    )


@jit
def signed_box(
    near: Array, lower: Array, upper: Array, sign: Array, offset: Array, out_near: Array, low: Array, high: Array
) -> None:
    """out_near, low, high ← a seed and limits ``(n,)`` in canonical angles ``sign q + offset``."""
    for i in range(sign.shape[0]):
        out_near[i] = sign[i] * near[i] + offset[i]
        a, b = sign[i] * lower[i] + offset[i], sign[i] * upper[i] + offset[i]
        low[i], high[i] = min(a, b), max(a, b)


@jit
def two_links(x: float, y: float, a: float, b: float) -> tuple[float, float, float, float, float]:
    """The elbow of a planar arm of links a, b that ends in (x, y): (miss, bend, cos bend, k1, k2).

    With the elbow angle ±bend, ``k1 = a + b cos bend`` and ``k2 = b sin bend ≥ 0``, the first link points along
    ``(x k1 ± y k2, y k1 ∓ x k2)``. The miss is how far the point is out of reach; what is out of reach is taken as
    straight or folded. tan²(bend/2) = ((a+b)² − D²)/(D² − (a−b)²) has no loss of digits at either end.
    """
    D2 = x * x + y * y
    D = math.sqrt(D2)
    far, near_by = max((a + b) ** 2 - D2, 0.0), max(D2 - (a - b) ** 2, 0.0)
    miss = max(D - (a + b), abs(a - b) - D)
    bend = 2.0 * atan2(math.sqrt(far), math.sqrt(near_by))
    if bend < _MERGE:
        return miss, 0.0, 1.0, a + b, 0.0
    total = far + near_by
    c = (near_by - far) / total
    return miss, bend, c, a + b * c, b * 2.0 * math.sqrt(far * near_by) / total


@jit
def planar_free(
    u: float, v: float, p: float, q: float, a: float, b: float, up: float, spin: float, total: float, wish: float,
    fixed: bool, branch: int, near: Array, low: Array, high: Array, arcs: Array, found: int, angles: Array,
) -> tuple[float, int]:  # fmt: skip
    """Choose the direction ψ of the last link of a planar arm, where the task leaves it free: (ψ, number of arcs).

    The arm is that of `planar_breaks`, its elbow on the side `up` (±1), and `angles` ``(4,)`` ← its three
    angles and those of a fourth joint ``spin (total − ψ)``; there is none if spin is 0. Of the ψ that reach and
    limits allow, exact arcs that are appended to `arcs` for this `branch`, it is the nearest to `wish`, or
    `wish` itself if `fixed`. NaN if none is within reach; outside the limits when that cannot be helped.
    """
    breaks, probes = np.empty(24), np.empty(50)
    count = planar_breaks(u, v, p, q, a, b, low, high, breaks)
    if spin != 0.0 and high[3] - low[3] < TURN:
        breaks[count], breaks[count + 1] = wrap(total - spin * low[3]), wrap(total - spin * high[3])
        count += 2
    n = lay_probes(breaks, count, probes)
    first = found
    best, psi = math.inf, math.nan
    for k in range(n):
        if planar_angles(u, v, p, q, a, b, up, spin, total, probes[k], near, low, high, angles) > _REACH:
            continue
        misfit = 0.0
        for i in range(3 if spin == 0.0 else 4):
            misfit += excess(angles[i], low[i], high[i])
        if misfit == 0.0 and found < arcs.shape[0]:
            found = extend_arcs(arcs, first, found, branch, probes, k, n)
        elif misfit < best and found == first:
            best, psi = misfit, probes[k]
    if fixed:
        psi = wish
    elif found > first:
        psi = nearest_in_arcs(arcs, first, found, wish)
    if planar_angles(u, v, p, q, a, b, up, spin, total, psi, near, low, high, angles) > _REACH:
        psi = math.nan
    return psi, found


@jit
def planar_angles(
    u: float, v: float, p: float, q: float, a: float, b: float, up: float, spin: float, total: float, psi: float,
    near: Array, low: Array, high: Array, angles: Array,
) -> float:  # fmt: skip
    """angles ``(4,)`` ← those of `planar_free` at one ψ; returns by how much the third axis is out of reach."""
    c, s = math.cos(psi), math.sin(psi)
    x, y = u - p * c + q * s, v - p * s - q * c
    miss, bend, _, k1, k2 = two_links(x, y, a, b)
    angles[1] = up * bend
    if math.hypot(x, y) < _SINGULAR:
        # The third axis on the first: links of one length, folded. Only the sum of the two angles counts.
        angles[0] = split_sum(psi - angles[1], near[0], low[0], high[0], near[2], low[2], high[2])
    else:
        angles[0] = math.atan2(y, x) - up * math.atan2(k2, k1)
    angles[2] = psi - angles[0] - angles[1]
    angles[3] = spin * (total - psi)
    return miss


@jit
def planar_breaks(
    u: float, v: float, p: float, q: float, a: float, b: float, low: Array, high: Array, breaks: Array
) -> int:
    """Every ψ where a planar three-link arm reaches the end of its reach or a limit; returns how many.

    The third link has the direction ψ, (p, q) is its end in its own frame and (u, v) where that end is held; so
    the third axis is at ``(u, v) − Rz(ψ)(p, q)``. `low`, `high` ``(3,)`` are limits of the three joint angles.
    In each case the distance of two points is given, of which one goes round a circle:
    ``a cos ψ + b sin ψ + c = 0``.
    """
    count = _distance_roots(u, v, p, q, (a + b) ** 2, breaks, 0)
    count = _distance_roots(u, v, p, q, (a - b) ** 2, breaks, count)
    for side in range(2):
        if high[0] - low[0] < TURN:
            t = low[0] if side == 0 else high[0]
            count = _distance_roots(u - a * math.cos(t), v - a * math.sin(t), p, q, b * b, breaks, count)
        if high[1] - low[1] < TURN:
            t = low[1] if side == 0 else high[1]
            count = _distance_roots(u, v, p, q, a * a + b * b + 2.0 * a * b * math.cos(t), breaks, count)
        if high[2] - low[2] < TURN:
            t = low[2] if side == 0 else high[2]
            count = _distance_roots(u, v, p + b * math.cos(t), q - b * math.sin(t), a * a, breaks, count)
    return count


@jit
def _distance_roots(u: float, v: float, p: float, q: float, square: float, breaks: Array, count: int) -> int:
    """Append the ψ at which ``|(u, v) − Rz(ψ)(p, q)|² = square``; returns the new count."""
    constant = u * u + v * v + p * p + q * q - square
    return int(add_roots(-2.0 * (u * p + v * q), -2.0 * (v * p - u * q), constant, breaks, count))
