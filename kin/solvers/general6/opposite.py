"""Two slides that are opposite each other in the loop: two equations in two angles.

Written as ``Tz(c) F3 Rz(d) F4 Rz(e) F5 Tz(f) = F2⁻¹ Rz(−b) F1⁻¹ Rz(−a) F6⁻¹``, the slides c and f do not turn
anything, so all nine entries of the rotation are known on both sides. With the third column l and the points p of
both sides without slides, what differs is ``c z + f l``. Its part along z × l is zero: ``(p × l)·z`` is the same
on both sides. These ten quantities are linear in the products of (1, cos, sin) of d and e on the left, of a and b
on the right. Without a and b two equations are left. In half tangents both are quadratic in each of d and e; their
resultant is a polynomial of degree eight in that of d.

The cuts of :mod:`kin.solvers.general6.elimination` are degenerate for such arms.
"""

from __future__ import annotations

import math

import numpy as np

from kin.angles import apart, wrapped
from kin.axes import inverse, links_of
from kin.robot import Robot
from kin.solvers.contract import BatchKernels
from kin.solvers.general6.batch import AGREED, NOT_FINITE, OPEN, loop_of
from kin.solvers.general6.cuts import (
    OFFSET,
    SHIFT,
    SIGN,
    SIZE,
    SIZE_OF_ARM,
    SLIDES,
    TURN_D,
    TURN_E,
    cut_at,
    size_of,
)
from kin.solvers.general6.elimination import COS3, SIN3
from kin.solvers.general6.recovery import polish
from kin.tolerances import TOLERANCES
from kin.transforms import Array

_REAL = 1e-3  # imaginary part of a half tangent, of 1 + its square: roots that are tried
_SAMPLES = np.array([[c, -s, s, c] for c, s in zip(COS3, SIN3, strict=True)]).reshape(3, 2, 2)
# Values at three angles → coefficients of (1, cos, sin); those → coefficients of powers of the half tangent.
_FOURIER = np.linalg.inv(np.column_stack([np.ones(3), COS3, SIN3]))
_POWERS = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [1.0, -1.0, 0.0]])


def loop_with_opposite_slides(robot: Robot) -> Array | None:
    """The parameter array of the loop whose third and last joints slide, None if no others turn.

    Of its two ways round, the axes of the first two joints are the less parallel ones.
    """
    slides = ~robot.revolute
    places = np.flatnonzero(slides).tolist()
    if robot.n != 6 or len(places) != 2 or places[1] - places[0] != 3:
        return None
    links = links_of(robot, (1,) * 5)
    cuts = [cut_at(links, slides, size_of(robot, links), (place + 1) % 6) for place in places]
    return min(cuts, key=lambda cut: abs(float(_loop(cut, np.eye(4))[0, 2, 2])))


def _loop(params: Array, T: Array) -> Array:
    """The fixed transforms of the loop ``(6, 4, 4)``."""
    F, whole = np.empty((6, 3, 4)), np.zeros((6, 4, 4))
    loop_of(params, np.ascontiguousarray(T), F)
    whole[:, :3], whole[:, 3, 3] = F, 1.0
    return whole


def _turns() -> Array:
    """Rz of the three angles ``(3, 4, 4)``."""
    out = np.broadcast_to(np.eye(4), (3, 4, 4)).copy()
    out[:, :2, :2] = _SAMPLES
    return out


_TURNS = _turns()
_BACK = np.swapaxes(_TURNS, 1, 2).copy()


def _quantities(T: Array) -> Array:
    """The ten quantities ``(3, 3, 10)`` of transforms at three by three angles ``(3, 3, 4, 4)``."""
    z, p = T[..., :3, 2], T[..., :3, 3]
    level = p[..., 0] * z[..., 1] - p[..., 1] * z[..., 0]
    return np.concatenate([T[..., :3, :3].reshape(3, 3, 9), level[..., None]], axis=-1)


def _coefficients(values: Array) -> Array:
    """Coefficients ``(10, 3, 3)`` of (1, cos, sin) × (1, cos, sin) of quantities at three by three angles."""
    return np.asarray(np.einsum("ik,jl,klm->mij", _FOURIER, _FOURIER, values))


def _resultant(g: Array, h: Array) -> Array:
    """The polynomial ``(9,)`` in x, lowest power first, of two polynomials ``(3, 3)`` in (x, y), without y."""
    times = np.convolve
    (g0, g1, g2), (h0, h1, h2) = g.T, h.T
    middle = times(g2, h0) - times(g0, h2)
    return np.asarray(times(middle, middle) - times(times(g2, h1) - times(g1, h2), times(g1, h0) - times(g0, h1)))


def _roots(p: Array) -> list[float]:
    """The real roots of a polynomial, or almost real ones."""
    found = np.polynomial.polynomial.polyroots(np.trim_zeros(p, "b")) if p.any() else np.empty(0)
    return [float(x.real) for x in found if abs(x.imag) < _REAL * (1.0 + abs(x) ** 2)]


def solve_opposite(params: Array, T: Array, out: Array) -> int:
    """out ``(16, 6)`` ← all solutions of the target T ``(4, 4)``, then NaN; OPEN, AGREED, or NOT_FINITE.

    They are agreed if each real root has led to one, and their number is even.
    """
    out[:] = math.nan
    if not np.isfinite(T).all():
        return NOT_FINITE
    F = _loop(params, T)
    left = _coefficients(_quantities(F[2] @ _TURNS[:, None] @ F[3] @ _TURNS[None] @ F[4]))
    right = _coefficients(
        _quantities(inverse(F[1]) @ _BACK[None] @ inverse(F[0]) @ _BACK[:, None] @ inverse(F[5]))
    )
    # Combinations of the ten quantities in which a and b cancel, but for the constant monomial.
    Q = right.reshape(10, 9)
    free = np.linalg.svd(Q[:, 1:])[0][:, 8:].T
    equations = (free @ left.reshape(10, 9)).reshape(2, 3, 3)
    equations[:, 0, 0] -= free @ Q[:, 0]
    g, h = (_POWERS @ equation @ _POWERS.T for equation in equations)
    slides, back = params[SLIDES:SIZE].copy(), np.asarray(np.linalg.pinv(Q[:, 1:]), dtype=np.float64)
    roots, met, count = _roots(_resultant(g, h)), 0, 0
    for x in roots:
        before = count
        powers = np.array([1.0, x, x * x])
        # The root of one equation that is the root of the other too.
        tried = [y for p in (g, h) for y in _roots(powers @ p)]
        tried.sort(key=lambda y: _size(powers @ g, y) + _size(powers @ h, y))
        for y in tried[:2]:
            t = _configuration(F, left, Q[:, 0], back, 2.0 * math.atan(x), 2.0 * math.atan(y))
            if not polish(np.ascontiguousarray(F[:, :3]), slides, t):
                continue
            row = _row(params, t)
            if count < len(out) and not _known(out[:count], row, slides, int(params[SHIFT])):
                out[count] = row
                count += 1
        met += count > before
    return AGREED if 0 < met == count == len(roots) and count % 2 == 0 else OPEN


def _size(p: Array, y: float) -> float:
    """How far from zero the quadratic p ``(3,)`` is at y, of the largest it could be."""
    return float(abs(p[0] + y * (p[1] + y * p[2])) / (np.abs(p).sum() * (1.0 + y * y) + 1e-300))


def _configuration(F: Array, left: Array, constant: Array, back: Array, d: float, e: float) -> Array:
    """The values ``(6,)`` of the loop's joints near a solution with these d and e."""
    at_d, at_e = np.array([1.0, math.cos(d), math.sin(d)]), np.array([1.0, math.cos(e), math.sin(e)])
    m = back @ (left @ at_e @ at_d - constant)
    a, b = math.atan2(m[5], m[2]), math.atan2(m[1], m[0])
    t = np.array([a, b, 0.0, d, e, 0.0])
    L = F[2] @ _screw(d) @ F[3] @ _screw(e) @ F[4]
    R = inverse(F[1]) @ _screw(-b) @ inverse(F[0]) @ _screw(-a) @ inverse(F[5])
    directions = np.column_stack([[0.0, 0.0, 1.0], L[:3, 2]])
    t[[2, 5]] = np.linalg.lstsq(directions, R[:3, 3] - L[:3, 3])[0]
    return t


def _screw(angle: float) -> Array:
    """Rz."""
    out = np.eye(4)
    out[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return out


def _row(params: Array, t: Array) -> Array:
    """The joint values ``(6,)`` of the arm from those of the loop."""
    t = t + np.array([0.0, 0.0, 0.0, TURN_D, TURN_E, 0.0])
    q = params[SIGN:OFFSET] * (np.roll(t, int(params[SHIFT])) - params[OFFSET : OFFSET + 6])
    slides = np.roll(params[SLIDES:SIZE], int(params[SHIFT])) != 0.0
    return np.where(slides, q * params[SIZE_OF_ARM], wrapped(q))


def _known(rows: Array, row: Array, slides: Array, shift: int) -> bool:
    """Whether a configuration is among the rows."""
    return bool((apart(rows, row, np.roll(slides, shift) == 0.0) < TOLERANCES.merge).any())


def branches_many(params: Array, T: Array, values: Array, near: Array, out: Array) -> None:
    """out ``(N, 16, 6)`` ← all solutions of each of the targets T ``(N, 4, 4)``."""
    for k in range(len(T)):
        solve_opposite(params, T[k], out[k])


def opposite_kernels(params: Array) -> BatchKernels:
    """The batch kernels of an arm as `solve_opposite` reads it."""
    return BatchKernels.of_many(params, branches_many)
