"""Kernels that choose the arm angle at which the joints move least from the seed.

The squared distance from the seed is a smooth function of ψ on each feasible interval, with a few minima. A grid
of arm angles shows where they may be, and narrow ones beside singularities show at those where a joint keeps its
seed value: `lay_out` lets all of them be weighed. Safeguarded Newton steps along the derivatives of the joint
angles refine all minima at the same time, see :mod:`kin.solvers.srs7.minima`.
"""

from __future__ import annotations

import math

from kin.angles import TURN, wrap
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import atan2, sin_cos
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.srs7.minima import (
    AT,
    BRANCH,
    CLOSE,
    DIP,
    FIRST_END,
    FLIP,
    LANES,
    LAST_END,
    RATE,
    SIDE,
    STEPS,
    F,
    G,
    begin,
    finish,
    promising,
    step,
    whole_vectors,
)
from kin.solvers.srs7.redundancy import (
    CELL,
    FIRST,
    GRID,
    PSI,
    SHOULDER_MISFIT,
    SHOULDER_STEP,
    WRIST_MISFIT,
    WRIST_STEP,
    image_of,
)
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_INSET = TOLERANCES.interval_inset
_HAIR = TOLERANCES.limit
Entries = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]
# Arm angles that are tested (redundancy.py), lanes that are refined, and lanes for the grid.
Work = tuple[Array, Array, Array]
_STILL = 1e-14  # least squared sine of an angle between two others whose rates are finite
# A branch that is farther from the seed than another one by more than so many squared rad is not the nearest.
FARTHER = 0.5


@inlined
def _angles(m: Entries, psi: float, sign: float) -> tuple[float, float, float, float, float, float]:
    """The Z-Y-Z angles of a rotation with the entries m, sin B of a sign, then their derivatives by ψ."""
    s, c = sin_cos(psi)
    x, dx = m[0] + c * m[1] + s * m[2], c * m[2] - s * m[1]
    y, dy = m[3] + c * m[4] + s * m[5], c * m[5] - s * m[4]
    z, dz = m[6] + c * m[7] + s * m[8], c * m[8] - s * m[7]
    u, du = m[9] + c * m[10] + s * m[11], c * m[11] - s * m[10]
    v, dv = m[12] + c * m[13] + s * m[14], c * m[14] - s * m[13]
    square = x * x + y * y + _STILL
    across = math.sqrt(square)
    return (
        atan2(sign * y, sign * x), sign * atan2(across, z), atan2(sign * v, -sign * u),
        (x * dy - y * dx) / square, sign * ((x * dx + y * dy) / across * z - across * dz),
        (v * du - u * dv) / square,
    )  # fmt: skip


@inlined
def _entries(parts: Array, joint: int) -> Entries:
    """The third column of ``M0 + M1 cos ψ + M2 sin ψ``, then the first two of the third row: each its three parts.

    In registers: stores to the lanes could change an array.
    """
    M0, M1, M2 = parts[joint, 0], parts[joint, 1], parts[joint, 2]
    return (
        M0[0, 2], M1[0, 2], M2[0, 2], M0[1, 2], M1[1, 2], M2[1, 2], M0[2, 2], M1[2, 2], M2[2, 2],
        M0[2, 0], M1[2, 0], M2[2, 0], M0[2, 1], M1[2, 1], M2[2, 1],
    )  # fmt: skip


@jit
def _evaluate(parts: Array, box: Array, moving: int, count: int, L: Array) -> None:
    """Rows F, G and RATE of `count` lanes ← at their arm angles; moving: angles of the wrist that count."""
    for joint in range(2):
        m, i = _entries(parts, joint), 4 * joint
        last, more = 1.0 if joint == 0 or moving == 3 else 0.0, 1.0 if joint > 0 else 0.0
        near = box[NEAR, i], box[NEAR, i + 1], box[NEAR, i + 2]
        low = box[LOW, i], box[LOW, i + 1], box[LOW, i + 2]
        high = box[HIGH, i], box[HIGH, i + 1], box[HIGH, i + 2]
        for b in range(count):
            sign = L[FLIP, b] if joint > 0 else L[SIDE, b]
            A, B, C, a, k, c = _angles(m, L[AT, b], sign)
            _, x = image_of(A, near[0], low[0], high[0])
            _, y = image_of(B, near[1], low[1], high[1])
            _, z = image_of(C, near[2], low[2], high[2])
            L[F, b] = more * L[F, b] + x * x + y * y + last * (z * z)
            L[G, b] = more * L[G, b] + x * a + y * k + last * (z * c)
            L[RATE, b] = more * L[RATE, b] + a * a + k * k + last * (c * c)


@jit
def add_best(
    branch: int, grid: int, span: tuple[int, int], psi: float, W: Array, arcs: Array, count: int, L: Array
) -> tuple[float, float, int]:
    """Append a lane for the tested arm angle of a branch that is nearest: (squared step, it, number of lanes).

    grid: the first column of W that belongs to the grid. span: which rows of arcs are the branch's intervals, none
    without limits. psi: an arm angle inside the limits.
    """
    f = W[FIRST]
    _weigh_all(branch, grid + GRID, W, f)
    least, at = math.inf, -1
    for k in range(grid + GRID):
        better = f[k] < least
        least, at = f[k] if better else least, k if better else at
    nearest = W[PSI, at] if at >= 0 else psi
    return least, nearest, _add(branch, nearest, span, arcs, count, L)


@inlined
def _weigh_all(branch: int, count: int, W: Array, f: Array) -> None:
    """f ← the squared steps of `count` columns of W on a branch, infinity outside the limits."""
    moved, turned = W[SHOULDER_STEP + (branch >> 2)], W[WRIST_STEP + (branch & 1)]
    shoulder, wrist = W[SHOULDER_MISFIT + (branch >> 2)], W[WRIST_MISFIT + (branch & 1)]
    for k in range(count):
        f[k] = moved[k] + turned[k] if shoulder[k] + wrist[k] == 0.0 else math.inf


@jit
def add_others(
    joints: tuple[Array, Array, int], branch: int, columns: tuple[int, int], span: tuple[int, int], least: float,
    work: Work, arcs: Array, count: int,
) -> int:  # fmt: skip
    """Append lanes for the other minima of a branch that may be below `least`; returns the number of lanes.

    joints: parts, box, and how many angles of the wrist count. columns: the first one of W that is neither a limit
    nor a middle, and the first one of the grid, where the derivative is needed too: its signs tell minima between
    two arm angles.
    """
    W, L, D = work
    parts, box, moving = joints
    f, picked, cell = W[FIRST], W[FIRST + 1], W[CELL]
    kept, grid = columns
    _weigh_all(branch, grid + GRID, W, f)
    for j in range(GRID):
        D[AT, j], D[SIDE, j], D[FLIP, j] = W[PSI, grid + j], 1.0 - 2.0 * (branch >> 2), 1.0 - 2.0 * (branch & 1)
        D[F, j] = D[G, j] = D[RATE, j] = 0.0
    _evaluate(parts, box, moving, GRID, D)
    # Without jumps, as nothing foretells which arm angles are picked.
    n = 0
    for k in range(kept, grid):
        j = int(cell[k])
        beside = min(f[grid + j], f[grid if j == GRID - 1 else grid + j + 1])
        picked[n] = W[PSI, k]
        n += 1 if (f[k] - DIP < beside) & (f[k] - DIP < least) else 0
    width = TURN / GRID
    for j in range(GRID):
        i = 0 if j == GRID - 1 else j + 1
        here, there, down, up = f[grid + j], f[grid + i], D[G, j], D[G, i]
        # Between them, where the derivative changes its sign or the side that is downhill is higher; or beyond one
        # of them towards the end of an interval. Joints that turn far may come near anywhere on their way.
        inside = (here < math.inf) & (there < math.inf)
        way = width * math.sqrt(max(D[RATE, j], D[RATE, i]))
        reach = 0.5 * (math.sqrt(here) + math.sqrt(there) - way)
        possible = inside & ((min(here, there) - DIP < least) | (reach <= 0.0) | (reach * reach < least))
        between = possible & (down < 0.0) & (up > 0.0)
        ahead = possible & (down < 0.0) & (up <= 0.0) & (there > here)
        back = possible & (up > 0.0) & (down >= 0.0) & (here > there)
        ahead |= (here < math.inf) & (there == math.inf) & (down <= 0.0) & (here - DIP < least)
        back |= (here == math.inf) & (there < math.inf) & (up >= 0.0) & (there - DIP < least)
        share = down / (down - up) if between else (1.0 if back else 0.0)
        picked[n] = W[PSI, grid + j] + share * width
        n += 1 if between | ahead | back else 0
    for i in range(n):
        count = _add(branch, picked[i], span, arcs, count, L)
    for i in range(span[0], span[1]):
        if arcs[i, 2] - arcs[i, 1] < width:
            count = _add(branch, 0.5 * (arcs[i, 1] + arcs[i, 2]), (i, i + 1), arcs, count, L)
    return count


@jit
def _add(branch: int, psi: float, span: tuple[int, int], arcs: Array, count: int, L: Array) -> int:
    """Append a lane that starts at an arm angle in one of the intervals arcs[span]; returns how many there are."""
    x, low, high = psi, psi - math.pi, psi + math.pi
    there = span[0] == span[1]
    for i in range(span[0], span[1]):
        middle, half = 0.5 * (arcs[i, 1] + arcs[i, 2]), 0.5 * (arcs[i, 2] - arcs[i, 1])
        if 2.0 * half >= TURN - 1e-12:
            there = True
        elif abs(wrap(psi - middle)) <= half + _HAIR:
            x = middle + wrap(psi - middle)
            low, high, there = x - wrap(psi - middle) - half, x - wrap(psi - middle) + half, True
    for _ in range(2):  # neighbours that a hair divides
        for i in range(span[0], span[1]):
            if high - low < TURN and abs(wrap(arcs[i, 1] - high)) < _HAIR:
                high += arcs[i, 2] - arcs[i, 1]
            if high - low < TURN and abs(wrap(arcs[i, 2] - low)) < _HAIR:
                low -= arcs[i, 2] - arcs[i, 1]
    if there and count < LANES:
        inset = min(_INSET, 0.5 * (high - low))
        low, high = low + inset, high - inset
        L[AT, count], L[FIRST_END, count], L[LAST_END, count] = min(max(x, low), high), low, high
        L[SIDE, count], L[FLIP, count] = 1.0 - 2.0 * (branch >> 2), 1.0 - 2.0 * (branch & 1)
        L[BRANCH, count] = branch
        count += 1
    return count


@jit
def refine(parts: Array, box: Array, moving: int, count: int, L: Array) -> int:
    """Move `count` lanes downhill, each to a minimum in its interval; rows LEAST and BEST ← what it is.

    Returns how many lanes are left: those that cannot be a branch's best are given up.
    """
    begin(count, L)
    for k in range(STEPS):
        filled = whole_vectors(count, L)
        _evaluate(parts, box, moving, filled, L)
        if step(filled, k == 0, L) < CLOSE:
            break
        if k == 1:
            count = promising(count, L)
    finish(count, L)
    return count
