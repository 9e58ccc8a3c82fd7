"""Zeros of the characteristic function det Z(c), a trigonometric polynomial of degree eight.

Its values at seventeen angles give the coefficients of a polynomial of degree sixteen in z = exp(i c), of which
Aberth's iteration finds all complex roots at once (Math. Comp. 27(122), 1973). Those on the unit circle are the
angles.

The function may vary by a factor of 1e16 around the circle, and coefficients keep only what is large. A root where
the function is small is therefore corrected with values of the determinant itself, which are accurate relative to
their own size (Weierstrass's correction, one root at a time, the others held).
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.solvers.general6.elimination import Numbers, condense, times_determinant
from kin.transforms import Array

DEGREE = 8
ROOTS = 2 * DEGREE
TERMS = ROOTS + 1
SAMPLES = np.array(
    [(math.cos(2.0 * math.pi * k / TERMS), math.sin(2.0 * math.pi * k / TERMS)) for k in range(TERMS)]
)
_ANGLES = 2.0 * np.pi * np.outer(np.arange(DEGREE + 1), np.arange(TERMS)) / TERMS
_COSINES, _SINES = np.cos(_ANGLES) / TERMS, np.sin(_ANGLES) / TERMS
# Starts beside the circle and in no symmetry, since roots mirrored in the circle would never meet on it.
_START = np.exp(1j * (0.4 + 2.0 * np.pi * np.arange(ROOTS) / ROOTS)) * 1.07
_START_X, _START_Y = _START.real.copy(), _START.imag.copy()
_STEPS = 40
_SETTLED = 1e-16  # square of a step; the iteration is of third order
_NOISE = 4e-15  # of the largest coefficient
_SURE = 1e-7  # radius of uncertainty below which a root needs no correction
_NEARBY = 0.4  # |log |z||: roots that are corrected
_ON_CIRCLE = 0.03  # |log |z||: roots that are tried as real angles
_OFF_CIRCLE = 1e4  # radii of uncertainty: a root that is farther from the circle is no real angle
_CORRECTIONS = 40
_STRIDE = 0.1  # of one correction at most
_RADII = 100.0  # the same in radii of uncertainty


@jit
def coefficients(E: Array, re: Array, im: Array) -> float:
    """re, im ``(17,)`` ← the polynomial z⁸ det Z, lowest power first, divided by its largest modulus.

    Returns that modulus.
    """
    A, W, f = np.empty((2, 6, 9)), np.empty((6, 6)), np.empty(TERMS)
    for k in range(TERMS):
        f[k] = times_determinant(condense(E, SAMPLES[k, 0], SAMPLES[k, 1], A, W), W)
    largest = 1e-300
    for k in range(DEGREE + 1):
        x = y = 0.0
        for j in range(TERMS):
            x += f[j] * _COSINES[k, j]
            y -= f[j] * _SINES[k, j]
        re[DEGREE + k], im[DEGREE + k] = x, y
        largest = max(largest, x * x + y * y)
    largest = math.sqrt(largest)
    for k in range(DEGREE + 1):
        re[DEGREE + k] /= largest
        im[DEGREE + k] /= largest
        re[DEGREE - k], im[DEGREE - k] = re[DEGREE + k], -im[DEGREE + k]
    return largest


@jit
def aberth(re: Array, im: Array, zx: Array, zy: Array, slope: Array) -> None:
    """zx, zy ``(16,)`` ← all roots of the polynomial, slope ``(16,)`` ← |derivative| there.

    Roots are columns of arrays of real numbers, so that the loops over them are vectorised.
    """
    for i in range(ROOTS):
        zx[i], zy[i] = _START_X[i], _START_Y[i]
    px, py, dx, dy = np.empty(ROOTS), np.empty(ROOTS), np.empty(ROOTS), np.empty(ROOTS)
    sx, sy = np.empty(ROOTS), np.empty(ROOTS)
    for _ in range(_STEPS):
        for i in range(ROOTS):
            px[i], py[i], dx[i], dy[i], sx[i], sy[i] = re[ROOTS], im[ROOTS], 0.0, 0.0, 0.0, 0.0
        for k in range(ROOTS - 1, -1, -1):
            for i in range(ROOTS):
                u, v = dx[i] * zx[i] - dy[i] * zy[i] + px[i], dx[i] * zy[i] + dy[i] * zx[i] + py[i]
                dx[i], dy[i] = u, v
                u, v = px[i] * zx[i] - py[i] * zy[i] + re[k], px[i] * zy[i] + py[i] * zx[i] + im[k]
                px[i], py[i] = u, v
        for j in range(ROOTS):
            x, y = zx[j], zy[j]
            for i in range(ROOTS):
                u, v = zx[i] - x, zy[i] - y
                scale = 1.0 / (u * u + v * v + 1e-40)
                sx[i] += u * scale
                sy[i] -= v * scale
        largest = 0.0
        for i in range(ROOTS):
            # Newton's p/p' and Aberth's 1 / (p'/p − Σ 1/(z − z_j)) = p / (p' − p Σ).
            u = dx[i] - (px[i] * sx[i] - py[i] * sy[i])
            v = dy[i] - (px[i] * sy[i] + py[i] * sx[i])
            scale = 1.0 / (u * u + v * v + 1e-300)
            x, y = (px[i] * u + py[i] * v) * scale, (py[i] * u - px[i] * v) * scale
            zx[i] -= x
            zy[i] -= y
            size = zx[i] * zx[i] + zy[i] * zy[i]
            # Where the polynomial is noise, or far from the circle, steps need not become small.
            moves = 0.25 < size < 4.0 and px[i] * px[i] + py[i] * py[i] > _NOISE * _NOISE
            largest = max(largest, x * x + y * y if moves else 0.0)
        if largest < _SETTLED:
            break
    for i in range(ROOTS):
        slope[i] = math.sqrt(dx[i] * dx[i] + dy[i] * dy[i])


@jit
def _near_circle(z: complex, bound: float) -> bool:
    """Whether |log |z|| is below `bound`; not if z is not finite."""
    square = z.real * z.real + z.imag * z.imag
    return math.exp(-2.0 * bound) < square < math.exp(2.0 * bound)


@jit
def _correct(E: Array, z: Numbers, slope: Array) -> None:
    """Correct the roots z ``(16,)`` complex whose place is uncertain, in place."""
    A, W = np.empty((2, 6, 9), dtype=np.complex128), np.empty((6, 6), dtype=np.complex128)
    lead = 0.0 + 0.0j
    for _ in range(_CORRECTIONS):
        largest = 0.0
        for i in range(ROOTS):
            if slope[i] * _SURE > _NOISE or not _near_circle(z[i], _NEARBY):
                continue
            if lead == 0.0:
                lead = _leading(E, z)
            far = lead
            for j in range(ROOTS):
                far *= z[i] - z[j] if j != i else 1.0 + 0.0j
            square = far.real * far.real + far.imag * far.imag
            if not 0.0 < square < math.inf:
                continue
            step = polynomial_at(E, z[i], A, W) * far.conjugate() / square
            size, most = abs(step), min(_STRIDE, _RADII * _NOISE / (slope[i] + _NOISE))
            if not size < most:
                step *= most / size
            z[i] -= step
            largest = max(largest, min(size, most))
        if largest < _SURE:
            break


@jit
def polynomial_at(E: Array, z: complex, A: Numbers, W: Numbers) -> complex:
    """z⁸ det Z; A ``(2, 6, 9)`` and W ``(6, 6)`` complex are scratch."""
    back = 1.0 / z
    cosine, sine = 0.5 * (z + back), -0.5j * (z - back)
    z2 = z * z
    z4 = z2 * z2
    return times_determinant(condense(E, cosine, sine, A, W), W) * (z4 * z4)


@jit
def _leading(E: Array, z: Numbers) -> complex:
    """The leading coefficient a of ``z⁸ det Z = a Π (z − z_j)``, from the sample farthest from all roots."""
    A, W = np.empty((2, 6, 9), dtype=np.complex128), np.empty((6, 6), dtype=np.complex128)
    best, product, at = 0.0, 1.0 + 0.0j, 1.0 + 0.0j
    for k in range(TERMS):
        x = complex(SAMPLES[k, 0], SAMPLES[k, 1])
        far = 1.0 + 0.0j
        for j in range(ROOTS):
            far *= x - z[j]
        if best < abs(far) < math.inf:
            best, product, at = abs(far), far, x
    return polynomial_at(E, at, A, W) / product


@jit
def zeros(E: Array, doubtful: bool, out: Array) -> int:
    """out ``(16,)`` ← the angles of all roots on the unit circle or almost there; returns their number.

    With `doubtful` these are also roots that lie beside the circle by more than rounding explains.
    """
    re, im, zx, zy, slope = np.empty(TERMS), np.empty(TERMS), np.empty(ROOTS), np.empty(ROOTS), np.empty(ROOTS)
    coefficients(E, re, im)
    aberth(re, im, zx, zy, slope)
    z = np.empty(ROOTS, dtype=np.complex128)
    for i in range(ROOTS):
        z[i] = complex(zx[i], zy[i])
    _correct(E, z, slope)
    count = 0
    for i in range(ROOTS):
        off = abs(math.hypot(z[i].real, z[i].imag) - 1.0)
        if off < _ON_CIRCLE and (doubtful or off * slope[i] < _OFF_CIRCLE * _NOISE):
            out[count] = math.atan2(z[i].imag, z[i].real)
            count += 1
    return count
