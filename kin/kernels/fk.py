"""Compiled forward kinematics: tool poses, tool points and link frames.

Every kernel is serial, releases the GIL and keeps no state, so any number of threads may call it at once. The arm
is one flat float64 array (`Robot.model`):

====================  =======================================================================
``model[0:3]``        number of rows, number of joints, 1.0 if the convention is modified
``model[3:15]``       base transform, three rows of four
``model[15:27]``      tool transform, three rows of four
``model[27+9i: …]``   row i: θ, d, a, cos α, sin α, kind (0 fixed, 1 revolute, 2 prismatic, 3 and 4 the
                      same of a row that follows a joint), index into q, and by how much θ and d
                      change with that joint value: 1, the ratio of a row that follows, or 0
====================  =======================================================================

All kernels read rows by :func:`z_row` and :func:`x_part`.

A row is applied as two plane rotations of the columns of the running pose instead of a 4×4 product: a rotation
about z mixes the x and y columns, one about x mixes y and z, and a translation adds a multiple of a column.

Batches are processed in blocks of `BLOCK` configurations, stored entry by entry (all x's, then all y's, …), so
that one vector instruction handles several configurations. The operations and their order are the same as for a
single configuration, so a batch gives the same bits.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import inlined, jit, jit_with_gil
from kin.kernels.simd import WIDE, sin_cos
from kin.transforms import Array

BLOCK = 64
# Offsets of the rows of a block, BLOCK values each.
_SIN, _COS, _D, _ANGLE, _T0, _T1, _T2, _T3, _T4, _T5, _T6, _T7, _T8, _T9, _T10, _T11, _SPACE = range(
    0, 17 * BLOCK, BLOCK
)
HEADER = 27
WIDTH = 9


@inlined
def sine_cosine(angle: float) -> tuple[float, float]:
    """(sin, cos) of any angle; from the C library where the polynomials would lose digits."""
    if abs(angle) <= WIDE:
        return sin_cos(angle)
    return math.sin(angle), math.cos(angle)


@jit
def all_finite(values: Array) -> bool:
    """Whether an array ``(k,)`` holds neither NaN nor infinities."""
    bad = 0
    for i in range(values.shape[0]):
        bad += 0 if abs(values[i]) < math.inf else 1
    return bad == 0


@jit
def all_finite_pose(T: Array) -> bool:
    """Whether the entries of a 4×4 array are neither NaN nor infinite."""
    bad = 0
    for r in range(4):
        for c in range(4):
            bad += 0 if abs(T[r, c]) < math.inf else 1
    return bad == 0


@inlined
def _screw(T: Array, axis: int, s: float, c: float, distance: float) -> None:
    """T ← T · a rotation about the axis (0 for x, 2 for z) and a translation along it, on the first three rows."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    for r in range(3):
        x = T[r, i]
        y = T[r, j]
        T[r, i] = c * x + s * y
        T[r, j] = c * y - s * x
        T[r, 3] += distance * T[r, axis]


@jit
def _load(T: Array, model: Array, start: int) -> None:
    for r in range(3):
        for c in range(4):
            T[r, c] = model[start + 4 * r + c]
    T[3, 0] = 0.0
    T[3, 1] = 0.0
    T[3, 2] = 0.0
    T[3, 3] = 1.0


@jit
def copy_pose(T: Array, out: Array) -> None:
    """out ← T for 4×4 arrays."""
    for r in range(4):
        for c in range(4):
            out[r, c] = T[r, c]


@inlined
def x_part(model: Array, i: int) -> tuple[float, float, float]:
    """(a, cos α, sin α) of row i; those of the identity for the row after the last."""
    if i >= int(model[0]):
        return 0.0, 1.0, 0.0
    k = HEADER + WIDTH * i
    return model[k + 2], model[k + 3], model[k + 4]


Row = tuple[float, float, float, float]


@inlined
def advance(row: Row, s: float, c: float, d: float, a: float, ca: float, sa: float) -> Row:
    """One row of T · Rz(θ) Tz(d) Tx(a) Rx(α), from that row of T."""
    x, y, z, p = row
    p += d * z
    u = c * x + s * y
    y = c * y - s * x
    return u, ca * y + sa * z, ca * z - sa * y, p + a * u


@inlined
def kind_of(model: Array, i: int) -> float:
    """The kind of row i."""
    return float(model[HEADER + WIDTH * i + 5])


@inlined
def z_row(model: Array, i: int) -> tuple[float, float, int, float, float]:
    """(θ, d, index into q, turn, slide) of row i: it turns by θ + turn q, and slides by d + slide q."""
    k = HEADER + WIDTH * i
    return model[k], model[k + 1], int(model[k + 6]), model[k + 7], model[k + 8]


@inlined
def z_part(model: Array, i: int, q: Array) -> tuple[float, float, float]:
    """(sin θ, cos θ, d) of row i."""
    theta, d, j, turn, slide = z_row(model, i)
    s, c = sine_cosine(theta + turn * q[j])
    return s, c, d + slide * q[j]


@jit
def load_base(model: Array, T: Array) -> int:
    """T ← the transform before the first z part; returns the row offset of the x part after a z part.

    A modified row is x before z. If the z part of each row is combined with the x part of the next one, both
    conventions share one loop.
    """
    _load(T, model, 3)
    if model[2] == 0.0:
        return 0
    _screw(T, 0, model[HEADER + 4], model[HEADER + 3], model[HEADER + 2])
    return 1


Rows = tuple[float, float, float, float, float, float, float, float, float, float, float, float]


@inlined
def base_rows(model: Array, ahead: int) -> Rows:
    """The three rows of the transform before the first z part, as in `load_base`, but held in registers.

    Reading it back from memory right after writing it takes as long as the rest of the arm.
    """
    x0, y0, z0, p0 = model[3], model[4], model[5], model[6]
    x1, y1, z1, p1 = model[7], model[8], model[9], model[10]
    x2, y2, z2, p2 = model[11], model[12], model[13], model[14]
    if ahead == 1:
        a, ca, sa = x_part(model, 0)
        x0, y0, z0, p0 = advance((x0, y0, z0, p0), 0.0, 1.0, 0.0, a, ca, sa)
        x1, y1, z1, p1 = advance((x1, y1, z1, p1), 0.0, 1.0, 0.0, a, ca, sa)
        x2, y2, z2, p2 = advance((x2, y2, z2, p2), 0.0, 1.0, 0.0, a, ca, sa)
    return x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2


@inlined
def apply_tool(model: Array, rows: Rows, T: Array) -> None:
    """T ← the three rows · tool."""
    x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2 = rows
    for k in range(3):
        u, v, w = model[15 + k], model[19 + k], model[23 + k]
        T[0, k] = x0 * u + y0 * v + z0 * w
        T[1, k] = x1 * u + y1 * v + z1 * w
        T[2, k] = x2 * u + y2 * v + z2 * w
        T[3, k] = 0.0
    u, v, w = model[18], model[22], model[26]
    T[0, 3] = p0 + (x0 * u + y0 * v + z0 * w)
    T[1, 3] = p1 + (x1 * u + y1 * v + z1 * w)
    T[2, 3] = p2 + (x2 * u + y2 * v + z2 * w)
    T[3, 3] = 1.0


@jit
def fk_into(model: Array, q: Array, T: Array) -> None:
    """T ← T_base_tool(q) for one configuration ``(n,)``; T is ``(4, 4)``."""
    ahead = 0 if model[2] == 0.0 else 1
    x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2 = base_rows(model, ahead)
    for i in range(int(model[0])):
        theta, d, j, turn, slide = z_row(model, i)
        theta, d = theta + turn * q[j], d + slide * q[j]
        # `sine_cosine` expanded by hand: a call would double the time of the loop.
        if abs(theta) <= WIDE:
            s, c = sin_cos(theta)
        else:
            s, c = math.sin(theta), math.cos(theta)
        a, ca, sa = x_part(model, i + ahead)
        x0, y0, z0, p0 = advance((x0, y0, z0, p0), s, c, d, a, ca, sa)
        x1, y1, z1, p1 = advance((x1, y1, z1, p1), s, c, d, a, ca, sa)
        x2, y2, z2, p2 = advance((x2, y2, z2, p2), s, c, d, a, ca, sa)
    apply_tool(model, (x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2), T)


@jit_with_gil
def fk_one(model: Array, q: Array, T: Array) -> bool:
    """T ← T_base_tool ``(4, 4)`` of one configuration; False if q is not n finite numbers."""
    if q.shape[0] != int(model[1]):
        return False
    fk_into(model, q, T)
    return math.isfinite(T[0, 3])  # a NaN or an infinity anywhere in q reaches every entry of the position


@inlined
def _joint_block(model: Array, i: int, q: Array, first: int, count: int, S: Array) -> int:
    """S ← sin θ, cos θ, d of row i for a block of configurations; returns how many values are not finite."""
    theta, d, j, turn, slide = z_row(model, i)
    wide = 0
    bad = 0
    if turn != 0.0:
        for b in range(count):
            S[_ANGLE + b] = theta + turn * q[first + b, j]
        for b in range(count):
            angle = S[_ANGLE + b]
            wide += 0 if abs(angle) <= WIDE else 1
            s, c = sin_cos(angle)
            S[_SIN + b] = s
            S[_COS + b] = c
            S[_D + b] = d
        if wide > 0:
            for b in range(count):
                angle = S[_ANGLE + b]
                S[_SIN + b], S[_COS + b] = sine_cosine(angle)
                bad += 0 if abs(angle) < math.inf else 1
    else:
        s, c = sine_cosine(theta)
        for b in range(count):
            S[_SIN + b] = s
            S[_COS + b] = c
            S[_D + b] = d + slide * q[first + b, j]
            bad += 0 if abs(S[_D + b]) < math.inf else 1
    return bad


@jit
def fk_many(model: Array, q: Array, out: Array) -> bool:
    """out ← T_base_tool ``(k, 4, 4)`` of configurations ``(k, n)``; False if any of them is not finite."""
    S = np.empty(_SPACE)
    T = np.empty((4, 4))
    ahead = load_base(model, T)
    bad = 0
    for first in range(0, q.shape[0], BLOCK):
        count = min(BLOCK, q.shape[0] - first)
        for r in range(3):
            for k in range(4):
                for b in range(count):
                    S[_T0 + (4 * r + k) * BLOCK + b] = T[r, k]
        for i in range(int(model[0])):
            bad += _joint_block(model, i, q, first, count, S)
            a, ca, sa = x_part(model, i + ahead)
            for b in range(count):
                s, c, d = S[_SIN + b], S[_COS + b], S[_D + b]
                x, y, z, p = advance((S[_T0 + b], S[_T1 + b], S[_T2 + b], S[_T3 + b]), s, c, d, a, ca, sa)
                S[_T0 + b], S[_T1 + b], S[_T2 + b], S[_T3 + b] = x, y, z, p
                x, y, z, p = advance((S[_T4 + b], S[_T5 + b], S[_T6 + b], S[_T7 + b]), s, c, d, a, ca, sa)
                S[_T4 + b], S[_T5 + b], S[_T6 + b], S[_T7 + b] = x, y, z, p
                x, y, z, p = advance((S[_T8 + b], S[_T9 + b], S[_T10 + b], S[_T11 + b]), s, c, d, a, ca, sa)
                S[_T8 + b], S[_T9 + b], S[_T10 + b], S[_T11 + b] = x, y, z, p
        for b in range(count):
            for r in range(3):
                x = S[_T0 + 4 * r * BLOCK + b]
                y = S[_T1 + 4 * r * BLOCK + b]
                z = S[_T2 + 4 * r * BLOCK + b]
                for k in range(3):
                    out[first + b, r, k] = x * model[15 + k] + y * model[19 + k] + z * model[23 + k]
                out[first + b, r, 3] = S[_T3 + 4 * r * BLOCK + b] + (x * model[18] + y * model[22] + z * model[26])
            out[first + b, 3, 0] = 0.0
            out[first + b, 3, 1] = 0.0
            out[first + b, 3, 2] = 0.0
            out[first + b, 3, 3] = 1.0
    return bad == 0


@jit
def positions_many(model: Array, q: Array, out: Array) -> bool:
    """out ← tool points ``(k, 3)`` of configurations ``(k, n)``; False if any of them is not finite.

    It works backwards from the tool: each row then moves one point instead of a frame.
    """
    X, Y, Z = _T0, _T1, _T2
    S = np.empty(_SPACE)
    T = np.empty((4, 4))
    ahead = load_base(model, T)
    bad = 0
    for first in range(0, q.shape[0], BLOCK):
        count = min(BLOCK, q.shape[0] - first)
        for b in range(count):
            S[X + b] = model[18]
            S[Y + b] = model[22]
            S[Z + b] = model[26]
        for i in range(int(model[0]) - 1, -1, -1):
            bad += _joint_block(model, i, q, first, count, S)
            a, ca, sa = x_part(model, i + ahead)
            for b in range(count):
                s = S[_SIN + b]
                c = S[_COS + b]
                x = S[X + b] + a
                y = ca * S[Y + b] - sa * S[Z + b]
                z = sa * S[Y + b] + ca * S[Z + b]
                S[X + b] = c * x - s * y
                S[Y + b] = s * x + c * y
                S[Z + b] = z + S[_D + b]
        for b in range(count):
            for r in range(3):
                out[first + b, r] = T[r, 0] * S[X + b] + T[r, 1] * S[Y + b] + T[r, 2] * S[Z + b] + T[r, 3]
    return bad == 0


@jit
def _apply_row(T: Array, model: Array, i: int, q: Array) -> None:
    """T ← T · A_i in the convention of the arm."""
    s, c, d = z_part(model, i, q)
    a, ca, sa = x_part(model, i)
    if model[2] == 0.0:
        _screw(T, 2, s, c, d)
        _screw(T, 0, sa, ca, a)
    else:
        _screw(T, 0, sa, ca, a)
        _screw(T, 2, s, c, d)


@jit
def frames_many(model: Array, q: Array) -> Array:
    """Frames after each row ``(k, rows, 4, 4)`` of configurations ``(k, n)``; the tool is not applied."""
    rows = int(model[0])
    out = np.empty((q.shape[0], rows, 4, 4))
    T = np.empty((4, 4))
    for j in range(q.shape[0]):
        _load(T, model, 3)
        for i in range(rows):
            _apply_row(T, model, i, q[j])
            copy_pose(T, out[j, i])
    return out
