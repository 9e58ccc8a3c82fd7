"""The tool as a function of one or two joints, and joint 2 from what joint 1 does not change."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.axes import frame_of, inverse, lines_of, perpendicular_to, size
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array

Flags = NDArray[np.bool_]
_DECIDES = 1e-3  # of the arm's size: joint 2 moves the point enough to follow from it
_POLISH = 4
GONE = 1e-2  # of the arm's size: a point that is missed by more is not reached, however rounded it is
REACH = TOLERANCES.closure_position * 0.1  # metres, the same for an exact point
_FLOOR = 4e-16  # of the largest entry: a floor for singular matrices
_TINY = TOLERANCES.singular


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

    def seen(self, T: Array) -> Array:
        """Point and directions ``(N, 4, 3)`` of targets ``(N, 4, 4)`` in the frame of axis 1."""
        R = self.base[:3, :3]
        out = np.empty((len(T), 4, 3))
        out[:, 0] = np.einsum("rk,nk->nr", R, T[:, :3, 3]) / self.scale + self.base[:3, 3]
        out[:, 1:] = np.einsum("rk,nkc->ncr", R, T[:, :3, :3])
        return out


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


class Found(NamedTuple):
    """Configurations of N targets.

    Attributes:
        q: ``(N, rows, n)``, NaN where the point is out of reach.
        off: ``(N, rows)``, how far each misses the point, in metres.
        open: ``(N, rows)``, whether joint 1 may have any value: what the task keeps is on axis 1.
    """

    q: Array
    off: Array
    open: Flags


def configurations(g: Geometry, seen: Array, kept: list[int], near: Array, gone: float) -> Found:
    """All configurations of targets as `seen`, as far as they miss the point by no more than `gone` (metres).

    kept: which of point and directions the task keeps. What they leave free is near ``(n,)``.
    """
    x, y, last = _second(g, seen, kept, near)
    seen = seen[:, None]
    v = g.fixed + x[..., None, None] * g.wave[0] + y[..., None, None] * g.wave[1]
    q = np.empty((*x.shape, len(g.turns)))
    if len(g.turns) == 2:
        q[..., 1] = last
    q[..., 0], free = _first(g, v, seen, kept, near)
    _polish(g, q, seen, kept)
    off = _off(g, q, seen)
    if (off > REACH).any():
        # The point comes first where the directions cannot be met as well.
        at_point = q.copy()
        _polish(g, at_point, seen, [0])
        q = np.where((off > REACH)[..., None], at_point, q)
        off = _off(g, q, seen)
    q[~(off <= gone)] = math.nan
    return Found(q, off, free)


def _off(g: Geometry, q: Array, seen: Array) -> Array:
    """How far configurations miss the point ``(N, rows)``, in metres."""
    return np.asarray(np.linalg.norm(_moved(g, q)[0][..., 0, :] - seen[..., 0, :], axis=-1) * g.scale)


def _second(g: Geometry, seen: Array, kept: list[int], near: Array) -> tuple[Array, Array, Array]:
    """x, y and joint 2 itself ``(N, rows)`` from what joint 1 does not change."""
    shape = (len(seen), g.rows)
    if len(g.turns) == 1:
        return np.zeros(shape), np.zeros(shape), np.zeros(shape)
    if not g.turns[1]:
        last = _slide(g, seen)
        return last, np.zeros(shape), last * g.scale
    A, b = _invariants(g, seen, [0])
    if np.linalg.norm(A, 2) < _DECIDES:
        A, b = _invariants(g, seen, kept)
    main = _main(A)
    along = float(np.linalg.norm(A @ main))
    if along < _TINY:
        last = np.full(shape, near[1])
    else:
        cosine = np.clip(np.einsum("nm,m->n", b, A @ main) / along**2, -1.0, 1.0)
        last = math.atan2(main[1], main[0]) + np.arccos(cosine)[:, None] * (1.0, -1.0)
    return np.cos(last), np.sin(last), last


def _main(A: Array) -> Array:
    """The direction ``(2,)`` that rows ``(m, 2)`` determine best, in the sense of the longest of them."""
    direction = np.linalg.svd(A)[2][0]
    longest = A[int(np.argmax(np.linalg.norm(A, axis=1)))]
    return np.asarray(direction if direction @ longest >= 0.0 else -direction)


def straight(g: Geometry) -> float:
    """θ2 where the point is farthest from a first axis that is parallel to the second."""
    main = _main(_invariants(g, g.fixed[None], [0])[0])
    return math.atan2(main[1], main[0])


def _slide(g: Geometry, seen: Array) -> Array:
    """Joint 2 in arm sizes ``(N, rows)``, if it slides."""
    a, u, p = g.fixed[0], g.wave[0, 0], seen[:, 0]
    if not g.turns[0]:
        across = u - u[2] * np.array([0.0, 0.0, 1.0])
        return np.asarray((np.einsum("ni,i->n", p - a, across) / (across @ across))[:, None])
    # The distance from a point of axis 1: d² + 2 d (a · u) + a² = p².
    half = float(a @ u)
    root = np.sqrt(np.maximum(half * half + np.einsum("ni,ni->n", p, p) - a @ a, 0.0))
    return np.asarray(-half + root[:, None] * (1.0, -1.0))


def _invariants(g: Geometry, seen: Array, kept: list[int]) -> tuple[Array, Array]:
    """A ``(m, 2)`` and b ``(N, m)`` with ``A (x, y) = b`` for what joint 1 does not change."""
    f, w = g.fixed, g.wave
    A, b = [], []
    if not g.turns[0]:
        for k in kept:
            for i in (0, 1) if k == 0 else (0, 1, 2):
                A.append(w[:, k, i])
                b.append(seen[:, k, i] - f[k, i])
        return np.array(A), np.column_stack(b)
    for k in kept:
        A.append(w[:, k, 2])
        b.append(seen[:, k, 2] - f[k, 2])
    p = f[0]
    for k in kept:
        # p · v and (z × p) · v: where v is the point itself, the waves are perpendicular and of one length.
        for across in (False, True) if k else (False,):
            side = _turned if across else np.asarray
            constant = side(p) @ f[k] + (side(w[0, 0]) @ w[0, k] + side(w[1, 0]) @ w[1, k]) / 2.0
            A.append(np.array([side(w[i, 0]) @ f[k] + side(p) @ w[i, k] for i in (0, 1)]))
            b.append(np.einsum("ni,ni->n", side(seen[:, 0]), seen[:, k]) - constant)
    return np.array(A), np.column_stack(b)


def _turned(v: Array) -> Array:
    """Vectors ``(..., 3)`` across axis 1, a quarter turn further."""
    return np.stack([-v[..., 1], v[..., 0], np.zeros(v.shape[:-1])], axis=-1)


def _first(g: Geometry, v: Array, seen: Array, kept: list[int], near: Array) -> tuple[Array, Flags]:
    """Joint 1 ``(N, rows)`` from where the point, or else the directions, are before it moves them, and after.

    Where all of them are on axis 1 it is near[0], and the second result is True.
    """
    free = np.full(v.shape[:2], g.turns[0])
    if not g.turns[0]:
        return np.asarray((seen[..., 0, 2] - v[..., 0, 2]) * g.scale), free
    found = np.full(v.shape[:2], near[0])
    for some in ([0], [k for k in kept if k]):
        if some:
            a, b = v[..., some, :2], np.broadcast_to(seen[..., some, :2], v[..., some, :2].shape)
            sine = (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=-1)
            cosine = (a * b).sum(axis=(-1, -2))
            decides = free & (np.linalg.norm(b, axis=(-1, -2)) > _TINY)
            found = np.where(decides, np.arctan2(sine, cosine), found)
            free &= ~decides
    return found, free


def _moved(g: Geometry, q: Array) -> tuple[Array, Array]:
    """Point and directions ``(N, rows, 4, 3)``, and their derivatives ``(N, rows, 4, 3, n)``, in arm sizes."""
    q = q[..., None, None, :]
    v, after = np.broadcast_to(g.fixed, (*q.shape[:2], 4, 3)), []
    if len(g.turns) == 2:
        x, y = (np.cos(q[..., 1]), np.sin(q[..., 1])) if g.turns[1] else (q[..., 1] / g.scale, 0.0)
        v = v + x * g.wave[0] + y * g.wave[1]
        after = [x * g.wave[1] - y * g.wave[0] if g.turns[1] else np.broadcast_to(g.wave[0], v.shape)]
    if g.turns[0]:
        c, s = np.cos(q[..., 0]), np.sin(q[..., 0])
        v, *after = (u * (0.0, 0.0, 1.0) + c * u * (1.0, 1.0, 0.0) + s * _turned(u) for u in (v, *after))
        first = _turned(v)
    else:
        first = np.zeros(v.shape)
        first[..., 0, 2] = 1.0
        v = v + first * q[..., 0] / g.scale
    return v, np.stack([first, *after], axis=-1)


def _polish(g: Geometry, q: Array, seen: Array, kept: list[int]) -> None:
    """Gauss–Newton steps from configurations ``(N, rows, n)`` that nearly meet the task, in place.

    A double root is as precise as the root of the rounding.
    """
    units = np.where(g.turns, 1.0, g.scale)
    least = math.inf
    for _ in range(_POLISH):
        v, J = _moved(g, q)
        e = (seen - v)[..., kept, :].reshape(*q.shape[:2], -1)
        J = J[..., kept, :, :].reshape(*e.shape, -1)
        least = np.minimum(least, np.linalg.norm(e, axis=-1))
        H = np.swapaxes(J, -1, -2) @ J
        H = H + (_FLOOR * np.trace(H, axis1=-2, axis2=-1) + _FLOOR**2)[..., None, None] * np.eye(q.shape[-1])
        step = np.linalg.solve(H, (np.swapaxes(J, -1, -2) @ e[..., None]))[..., 0] * units
        there = np.where((least < _DECIDES)[..., None], q + step, q)
        left = np.linalg.norm((seen - _moved(g, there)[0])[..., kept, :].reshape(e.shape), axis=-1)
        better = left < least
        if not better.any():
            break
        q[:] = np.where(better[..., None], there, q)
