"""How far branches are from losing their feasibility, at many values of the given joint at once.

A *lane* is one value of the given joint with one elbow and one side of the plane of chain axes 2 and 3; it stands
for two branches, those of the two signs of sin t6. Lanes are stored entry by entry (all values, then all elbows,
…); their arithmetic has no jumps and no calls, so that one vector instruction handles several lanes. It is that of
`all_branches`, which itself computes a lane at a singularity, where an angle is free.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import TURN, wrap
from kin.kernels.compile import inlined, jit
from kin.kernels.simd import atan2, sin_cos
from kin.solvers.blocks import Entries, rows_of
from kin.solvers.common import HIGH, LOW, NEAR
from kin.solvers.offset7.branches import all_branches, chain_pose, distances
from kin.solvers.offset7.geometry import D1, OFFSET, REACH, SIGN, Y4
from kin.tolerances import TOLERANCES
from kin.transforms import Array

MOST = 1024  # lanes at a time
_WIDE = 8  # lanes are computed in groups of so many: those left over, one by one, would cost as much as a group
# Columns are that far apart. At a multiple of 512 their entries would compete for the same lines of the cache.
STRIDE = MOST + _WIDE
# Offsets of the columns of lanes: value, sign of the elbow and of the side; then the slack of both branches, how
# far inside the arm's reach they are, 1.0 where an angle is free, and the angles of joints 2, 3, 4, 5, 7 of the
# first branch from the middles of their limits, and of joint 6 from 0.
VALUE, ELBOW, SIDE, FIRST, SECOND, MARGIN, MARK, ANGLES = range(0, 8 * STRIDE, STRIDE)
JOINTS = 6
SPACE = ANGLES + JOINTS * STRIDE
# Layout of the setup of a target: the canonical pose; the chain's lengths and twists, and more of them with what
# `distances` gives and the first joint; middles and halves of the limits of joints 2 to 7.
_SHAPE, _DISTANCES, _LIMITS, _HALVES, SETUP = 12, 24, 36, 48, 60
Angles = tuple[float, float, float, float, float, float]
_SINGULAR = TOLERANCES.singular
_TINY = 1e-300
_LIMIT = TOLERANCES.limit


@jit
def set_up(params: Array, T: Array, box: Array, setup: Array) -> None:
    """setup ``(SETUP,)`` ← all that `lanes` needs of an arm, a target ``(4, 4)`` and limits, box ``(3, 7)``."""
    N = np.empty((3, 4))
    chain_pose(params, T, N)
    for r in range(3):
        for k in range(4):
            setup[4 * r + k] = N[r, k]
    for i in range(12):
        setup[_SHAPE + i] = params[D1 + i]
    constant, a, b = distances(params)
    size = math.sqrt(a * a + b * b)
    for i in range(4):
        setup[_DISTANCES + i] = params[Y4 + i]
    setup[_DISTANCES + 4], setup[_DISTANCES + 5] = constant, size
    setup[_DISTANCES + 6], setup[_DISTANCES + 7] = a / size, b / size
    setup[_DISTANCES + 8], setup[_DISTANCES + 9] = params[SIGN], params[OFFSET]
    setup[_DISTANCES + 10] = params[REACH]
    for i in range(6):
        half, middle = 0.5 * (box[HIGH, i + 1] - box[LOW, i + 1]), 0.5 * (box[HIGH, i + 1] + box[LOW, i + 1])
        bound = half < math.pi
        setup[_LIMITS + i] = math.cos(middle) if bound else 1.0
        setup[_LIMITS + 6 + i] = math.sin(middle) if bound else 0.0
        setup[_HALVES + i] = half + _LIMIT if bound else math.inf
    bound = setup[_HALVES + 4] < math.inf
    setup[_HALVES + 6] = wrap(0.5 * (box[HIGH, 5] + box[LOW, 5])) if bound else 0.0


@inlined
def _off(sine: float, cosine: float, m: Entries, i: int) -> float:
    """An angle from the middle of the limits of joint i + 2."""
    return float(atan2(sine * m[i] - cosine * m[6 + i], cosine * m[i] + sine * m[6 + i]))


@inlined
def _root(rest: float, size: float, slack: float, sign: float) -> tuple[float, float, float]:
    """(share of the amplitude that `rest` is inside it with the slack, cos δ, ± sin δ), as in `two_roots`."""
    margin = size - abs(rest)
    square = margin * (size + abs(rest))
    across = math.sqrt(square if square > 0.0 else 0.0)
    scale = 1.0 / math.sqrt(across * across + rest * rest + _TINY)
    return (margin + slack) / (size + _TINY), rest * scale, sign * across * scale


@inlined
def _lane(
    value: float, elbow: float, side: float, n: Entries, p: Entries, d: Entries, m: Entries, h: Entries
) -> tuple[float, float, bool, Angles]:
    """(margin of the elbow, of the side, if an angle is free, angles) of one lane; n, p, d, m, h: its setup."""
    D1, A1, C1, S1, D2, C2, S2, A3, D3, C3, S3, X4 = p
    Y4, Z4, C4, S4, constant, size, along, beside, sign, offset, reach, _ = d
    s, c = sin_cos(sign * value + offset)
    x, y, z = c * n[3] + s * n[7] - A1, c * n[7] - s * n[3], n[11] - D1
    wx, wy, wz = x, C1 * y + S1 * z, C1 * z - S1 * y - D2
    square = wx * wx + wy * wy + wz * wz
    bent, cosine, sine = _root(0.5 * (square - constant), size, reach * math.sqrt(square), elbow)
    c4, s4 = along * cosine - beside * sine, beside * cosine + along * sine
    x, y = c4 * X4 - s4 * Y4, s4 * X4 + c4 * Y4
    y0, y1, y2 = A3 + x, C3 * y - S3 * Z4, D3 + S3 * y + C3 * Z4
    a, b = S2 * y1, S2 * y0
    wide = math.sqrt(a * a + b * b)
    level, cosine, sine = _root(wz - C2 * y2, wide, reach, side)
    # A share of the arm's size: a share of `wide` would have poles beside narrow gaps, where it is small.
    level *= (wide + _TINY) / math.sqrt(size)
    scale = 1.0 / (wide + _TINY)
    c3, s3 = (a * cosine - b * sine) * scale, (b * cosine + a * sine) * scale
    x, y = c3 * y0 - s3 * y1, C2 * (s3 * y0 + c3 * y1) - S2 * y2
    cosine, sine = wx * x + wy * y, wy * x - wx * y
    far = math.sqrt(cosine * cosine + sine * sine)
    c2, s2 = cosine / (far + _TINY), sine / (far + _TINY)
    level = level if wide >= _SINGULAR else (1.0 if abs(wz - C2 * y2) <= reach else -1.0)
    # The rotation left for the wrist, its columns 0 to 2; of its last row the last entry only.
    twists, turned = (C1, S1, C2, S2, C3, S3, C4, S4), (c2, s2, c3, s3, c4, s4)
    x, y, z = c * n[0] + s * n[4], c * n[4] - s * n[0], n[8]
    r00, r10, _ = _wrist(x, y, z, twists, turned)
    x, y, z = c * n[1] + s * n[5], c * n[5] - s * n[1], n[9]
    r01, r11, _ = _wrist(x, y, z, twists, turned)
    x, y, z = c * n[2] + s * n[6], c * n[6] - s * n[2], n[10]
    r02, r12, r22 = _wrist(x, y, z, twists, turned)
    across = math.sqrt(r02 * r02 + r12 * r12)
    t6 = atan2(across, r22)
    angles = (
        _off(s2, c2, m, 0), _off(s3, c3, m, 1), _off(s4, c4, m, 2), _off(r12, r02, m, 3),
        _off(r02 * r10 - r12 * r00, r02 * r11 - r12 * r01, m, 5), t6,
    )  # fmt: skip
    free = (wide < _SINGULAR) | (far <= _SINGULAR) | (across < _SINGULAR)
    return bent, level, free, angles


@inlined
def insides(angles: Angles, second: bool, h: Entries) -> Angles:
    """How far the joints of a branch are inside their limits, from the angles of a lane; h: `limits_of`."""
    a2, a3, a4, a5, a7, t6 = angles
    off = abs(t6 + h[6] if second else t6 - h[6])
    o5, o7 = abs(a5), abs(a7)
    o5, o7 = (math.pi - o5 if second else o5), (math.pi - o7 if second else o7)
    return (
        h[0] - abs(a2), h[1] - abs(a3), h[2] - abs(a4), h[3] - o5, h[5] - o7,
        h[4] - (TURN - off if off > math.pi else off),
    )  # fmt: skip


@inlined
def _least(x: Angles) -> float:
    return min(min(x[0], min(x[1], x[2])), min(x[3], min(x[4], x[5])))


@inlined
def _wrist(
    x: float, y: float, z: float, twists: tuple[float, float, float, float, float, float, float, float],
    turned: Angles,
) -> tuple[float, float, float]:  # fmt: skip
    """A vector of the target, seen from O with joint 1 turned, in the wrist's frame; turned: cosines and sines."""
    C1, S1, C2, S2, C3, S3, C4, S4 = twists
    c2, s2, c3, s3, c4, s4 = turned
    y, z = C1 * y + S1 * z, C1 * z - S1 * y
    x, y = c2 * x + s2 * y, c2 * y - s2 * x
    y, z = C2 * y + S2 * z, C2 * z - S2 * y
    x, y = c3 * x + s3 * y, c3 * y - s3 * x
    y, z = C3 * y + S3 * z, C3 * z - S3 * y
    x, y = c4 * x + s4 * y, c4 * y - s4 * x
    return x, C4 * y + S4 * z, C4 * z - S4 * y


@inlined
def limits_of(setup: Array) -> Entries:
    """What `insides` needs of a setup."""
    return rows_of(setup, _HALVES)


@inlined
def _read(setup: Array) -> tuple[Entries, Entries, Entries, Entries, Entries]:
    """The setup in registers."""
    return (
        rows_of(setup, 0), rows_of(setup, _SHAPE), rows_of(setup, _DISTANCES), rows_of(setup, _LIMITS),
        rows_of(setup, _HALVES),
    )  # fmt: skip


@jit
def lanes(params: Array, T: Array, box: Array, setup: Array, L: Array, count: int) -> None:
    """Columns FIRST to ANGLES of `count` lanes L ``(≥ SPACE,)`` ← from their values, elbows and sides (±1.0)."""
    n, p, d, m, h = _read(setup)
    padded = count + (-count) % _WIDE
    for b in range(count, padded):
        L[VALUE + b], L[ELBOW + b], L[SIDE + b] = L[VALUE], L[ELBOW], L[SIDE]
    for b in range(padded):
        bent, level, free, angles = _lane(L[VALUE + b], L[ELBOW + b], L[SIDE + b], n, p, d, m, h)
        margin = min(bent, level)
        L[MARGIN + b], L[MARK + b] = margin, 1.0 if free & (margin >= 0.0) else 0.0
        L[FIRST + b], L[SECOND + b] = _least(insides(angles, False, h)), _least(insides(angles, True, h))
        a2, a3, a4, a5, a7, t6 = angles
        L[ANGLES + b], L[ANGLES + STRIDE + b], L[ANGLES + 2 * STRIDE + b] = a2, a3, a4
        L[ANGLES + 3 * STRIDE + b], L[ANGLES + 4 * STRIDE + b], L[ANGLES + 5 * STRIDE + b] = a5, a7, t6
    marked = 0.0
    for b in range(count):
        marked += L[MARK + b]
    if marked > 0.0:
        for b in range(count):
            if L[MARK + b] > 0.0:
                k = (4 if L[ELBOW + b] < 0.0 else 0) + (2 if L[SIDE + b] < 0.0 else 0)
                L[FIRST + b] = _slack(params, T, L[VALUE + b], box, k)
                L[SECOND + b] = _slack(params, T, L[VALUE + b], box, k + 1)


@jit
def slack_at(params: Array, T: Array, box: Array, setup: Array, value: float, k: int) -> float:
    """How far branch k is inside the limits at one value of the given joint; negative where it does not exist."""
    n, p, d, m, h = _read(setup)
    elbow, side = 1.0 if k < 4 else -1.0, 1.0 if k & 2 == 0 else -1.0
    bent, level, free, angles = _lane(value, elbow, side, n, p, d, m, h)
    if min(bent, level) < 0.0:
        return min(bent, level)
    if free:
        return _slack(params, T, value, box, k)
    return _least(insides(angles, k & 1 == 1, h))


@jit
def reach_margin(setup: Array, value: float, elbow: float) -> float:
    """How far inside the arm's reach the branches with an elbow (±1.0) are, as a share; negative if outside."""
    n, p, d, m, h = _read(setup)
    bent, level, _, _ = _lane(value, elbow, 1.0, n, p, d, m, h)  # the compiler leaves out the angles
    return min(bent, level)


@jit
def level_margin(setup: Array, value: float, elbow: float) -> float:
    """The part of the margin that is due to the height of the wrist centre along axis 2."""
    n, p, d, m, h = _read(setup)
    return _lane(value, elbow, 1.0, n, p, d, m, h)[1]


@jit
def reach_margins(setup: Array, values: Array, elbow: float, margin: Array, levels: Array) -> None:
    """margin, levels ``(n,)`` ← `reach_margin` and `level_margin` each of the values ``(n,)``."""
    n, p, d, m, h = _read(setup)
    for i in range(values.shape[0]):
        bent, level, _, _ = _lane(values[i], elbow, 1.0, n, p, d, m, h)
        margin[i], levels[i] = min(bent, level), level


@jit
def _slack(params: Array, T: Array, value: float, box: Array, k: int) -> float:
    """The slack of branch k by `all_branches`, which takes angles that are free from the seed."""
    rows, margin, t = np.empty((8, 7)), np.empty(8), box[NEAR].copy()
    t[0] = params[SIGN] * value + params[OFFSET]
    all_branches(params, T, box[NEAR], t, k, rows, margin)
    if margin[k] < 0.0:
        return float(margin[k])
    least = math.inf
    for i in range(1, 7):
        half = 0.5 * (box[HIGH, i] - box[LOW, i])
        if half < math.pi:
            inside = half + _LIMIT - abs(wrap(rows[k, i] - 0.5 * (box[HIGH, i] + box[LOW, i])))
            least = min(least, inside)
    return least
