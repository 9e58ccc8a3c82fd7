"""Zeros of the characteristic function det Z(c), a trigonometric polynomial of degree eight.

Its values at seventeen angles give the coefficients of a polynomial of degree sixteen in z = exp(i c), of which
Aberth's iteration finds all complex roots at once (Math. Comp. 27(122), 1973). Those on the unit circle are the
angles.

The function may vary by a factor of 1e16 around the circle, and coefficients keep only what is large. A root where
the function is small is therefore corrected with values of the determinant itself, which are accurate relative to
their own size (Weierstrass's correction, one root at a time, the others held).

How exact the coefficients are is measured on each target: at a few more angles the determinant differs from the
polynomial by its *noise*. It is rounding error for most arms, but far larger where the cut is nearly degenerate,
as on a table whose angles were typed with a few decimals.

With this noise each root gets a disc that bounds how far it may be off (Smith, J. ACM 17(4), 1970). Any k discs
that hang together, apart from the others, hold exactly k roots. Groups that do not reach the unit circle hold no
angle. If each group that does holds as many solutions as it has discs, no solution is missing (`covers_circle`).

Where joint c slides by s = tan(φ/2), the determinant is a polynomial p(s) of degree sixteen times cos²⁴(φ/2), and
p(s) cos¹⁶(φ/2) is a trigonometric polynomial of degree eight in φ. Near φ = π the determinant is too small to be
divided by cos⁸(φ/2): there the coefficients of p, from samples on the circle |s| = 1, give the values.
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
_NOISE = 4e-15  # of the largest coefficient, at least
_MOST_NOISE = 1e-6  # of coefficients that mean anything
_TWINS = 1e-3  # how close the approximations of a double root are, at most
_MARGIN = 10.0  # times the noise measured at a few angles: the noise at any other
_PROBES = 2.0 * np.pi * (np.array([1.0, 6.0, 12.0]) + 0.43) / TERMS  # between the samples
_PROBE_X, _PROBE_Y = np.cos(_PROBES), np.sin(_PROBES)
_PROBE_COSINES = 2.0 * np.cos(np.outer(_PROBES, np.arange(DEGREE + 1)))
_PROBE_SINES = 2.0 * np.sin(np.outer(_PROBES, np.arange(DEGREE + 1)))
_PROBE_COSINES[:, 0] = 1.0
_SURE = 1e-7  # radius of uncertainty below which a root needs no correction
_NEARBY = 0.4  # |log |z||: roots that are corrected
_ON_CIRCLE = 0.03  # |log |z||: roots that are tried as real angles
_OFF_CIRCLE = 1e4  # radii of uncertainty: a root that is farther from the circle is no real angle
_CORRECTIONS = 40
_FAR_OUT = 0.02  # |1 + z|; a slide beyond a hundred sizes of the arm
_STRIDE = 0.1  # of one correction at most
_RADII = 100.0  # the same in radii of uncertainty


@jit
def _sampled_slide(E: Array, f: Array) -> None:
    """f ``(17,)`` ← p(s) cos¹⁶(φ/2) at the samples of φ, where c slides."""
    parts, A, W = (
        np.empty((3, 6, 9)),
        np.empty((2, 6, 9), dtype=np.complex128),
        np.empty((6, 6), dtype=np.complex128),
    )
    p, x, y = np.zeros(TERMS), np.empty(TERMS), np.empty(TERMS)
    parts[0], parts[1], parts[2] = E[0] + E[1], 2.0 * E[2], E[0] - E[1]  # of 1, s, s²
    for j in range(DEGREE + 1):
        s = complex(SAMPLES[j, 0], SAMPLES[j, 1])
        value = times_determinant(condense(parts, s, s * s, A, W), W)
        x[j], y[j] = value.real, value.imag
    for k in range(TERMS):
        p[k] = x[0] / TERMS
        for j in range(1, DEGREE + 1):
            at = (k * j) % TERMS
            p[k] += 2.0 * (x[j] * SAMPLES[at, 0] + y[j] * SAMPLES[at, 1]) / TERMS
    for j in range(TERMS):
        half = math.pi * j / TERMS
        cosine, sine, total, power = math.cos(half), math.sin(half), 0.0, 1.0
        for k in range(TERMS):
            total = total * cosine + p[k] * power
            power *= sine
        f[j] = total


@jit
def _factor(slides: bool, z: complex) -> complex:
    """What the determinant at z = exp(iφ) has besides the trigonometric polynomial: cos⁸(φ/2) where c slides."""
    if not slides:
        return 1.0 + 0.0j
    square = (1.0 + z) * (1.0 + z) / (4.0 * z)
    return square * square * square * square


@jit
def coefficients(E: Array, slides: bool, re: Array, im: Array) -> float:
    """re, im ``(17,)`` ← the polynomial z⁸ det Z, lowest power first, divided by its largest modulus.

    `slides`: whether c does. Returns that modulus.
    """
    A, W, f = np.empty((2, 6, 9)), np.empty((6, 6)), np.empty(TERMS)
    if slides:
        _sampled_slide(E, f)
    for k in range(TERMS):
        if slides:
            break
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
def _noise_of(E: Array, slides: bool, re: Array, im: Array, largest: float) -> float:
    """How far the determinant is from the polynomial between the samples, in largest coefficients."""
    A, W = np.empty((2, 6, 9)), np.empty((6, 6))
    worst = _NOISE
    for j in range(_PROBES.shape[0]):
        value = times_determinant(condense(E, _PROBE_X[j], _PROBE_Y[j], A, W), W) / largest
        factor = _factor(slides, complex(_PROBE_X[j], _PROBE_Y[j])).real
        for k in range(DEGREE + 1):
            value -= factor * (re[DEGREE + k] * _PROBE_COSINES[j, k] - im[DEGREE + k] * _PROBE_SINES[j, k])
        worst = max(worst, abs(value))
    return worst


@jit
def aberth(re: Array, im: Array, noise: float, zx: Array, zy: Array, slope: Array) -> None:
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
            moves = 0.25 < size < 4.0 and px[i] * px[i] + py[i] * py[i] > noise * noise
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
def _correct(E: Array, slides: bool, noise: float, z: Numbers, slope: Array) -> None:
    """Correct the roots z ``(16,)`` complex whose place is uncertain, in place."""
    A, W = np.empty((2, 6, 9), dtype=np.complex128), np.empty((6, 6), dtype=np.complex128)
    lead = 0.0 + 0.0j
    for _ in range(_CORRECTIONS):
        largest = 0.0
        for i in range(ROOTS):
            if slope[i] * _SURE > noise or not _near_circle(z[i], _NEARBY):
                continue
            if slides and abs(1.0 + z[i]) < _NEARBY:
                continue
            if lead == 0.0:
                lead = _leading(E, slides, z)
            far = lead
            for j in range(ROOTS):
                far *= z[i] - z[j] if j != i else 1.0 + 0.0j
            square = far.real * far.real + far.imag * far.imag
            if not 0.0 < square < math.inf:
                continue
            step = polynomial_at(E, slides, z[i], A, W) * far.conjugate() / square
            size, most = abs(step), min(_STRIDE, _RADII * noise / (slope[i] + noise))
            if not size < most:
                step *= most / size
            z[i] -= step
            largest = max(largest, min(size, most))
        if largest < _SURE:
            break


@jit
def polynomial_at(E: Array, slides: bool, z: complex, A: Numbers, W: Numbers) -> complex:
    """z⁸ det Z, without the factor of a slide; A ``(2, 6, 9)`` and W ``(6, 6)`` complex are scratch."""
    back = 1.0 / z
    cosine, sine = 0.5 * (z + back), -0.5j * (z - back)
    z2 = z * z
    z4 = z2 * z2
    return times_determinant(condense(E, cosine, sine, A, W), W) * (z4 * z4) / _factor(slides, z)


@jit
def _leading(E: Array, slides: bool, z: Numbers) -> complex:
    """The leading coefficient a of ``z⁸ det Z = a Π (z − z_j)``, from the sample farthest from all roots."""
    A, W = np.empty((2, 6, 9), dtype=np.complex128), np.empty((6, 6), dtype=np.complex128)
    best, product, at = 0.0, 1.0 + 0.0j, 1.0 + 0.0j
    for k in range(TERMS):
        x = complex(SAMPLES[k, 0], SAMPLES[k, 1])
        far = 1.0 + 0.0j
        for j in range(ROOTS):
            far *= x - z[j]
        if slides and x.real < 0.0:
            continue
        if best < abs(far) < math.inf:
            best, product, at = abs(far), far, x
    return polynomial_at(E, slides, at, A, W) / product


@jit
def zeros(E: Array, slides: bool, doubtful: bool, z: Numbers, radius: Array, out: Array) -> int:
    """out ``(16,)`` ← the angles of all roots on the unit circle or almost there; returns their number.

    z ``(16,)`` complex ← centres of discs around all roots, radius ``(16,)`` ← theirs. With `doubtful` the angles
    are also those of roots that lie beside the circle by more than rounding explains.
    """
    re, im, zx, zy, slope = np.empty(TERMS), np.empty(TERMS), np.empty(ROOTS), np.empty(ROOTS), np.empty(ROOTS)
    noise = _noise_of(E, slides, re, im, coefficients(E, slides, re, im))
    aberth(re, im, noise, zx, zy, slope)
    for i in range(ROOTS):
        z[i] = complex(zx[i], zy[i])
    _correct(E, slides, noise, z, slope)
    count = 0
    for i in range(ROOTS):
        if slides and abs(1.0 + z[i]) < _FAR_OUT:
            continue
        off = abs(math.hypot(z[i].real, z[i].imag) - 1.0)
        if off < _ON_CIRCLE and (doubtful or off * slope[i] < _OFF_CIRCLE * noise):
            out[count] = math.atan2(z[i].imag, z[i].real)
            count += 1
    # A polynomial that is noise itself, as where a whole curve of configurations meets the pose, tells nothing.
    _discs(re, im, _MARGIN * noise if noise < _MOST_NOISE else math.inf, z, radius)
    return count


@jit
def _discs(re: Array, im: Array, noise: float, z: Numbers, radius: Array) -> None:
    """radius ``(16,)`` ← those of discs around the approximate roots z ``(16,)``, of which twins are moved apart.

    r = 16 (|p(z)| + noise max(1, |z|¹⁶)) / |a₁₆ Π (z − z_j)|: any polynomial whose coefficients differ by no more
    than the noise has its roots in the union of the discs, and k in each group of k.
    """
    lead = math.hypot(re[ROOTS], im[ROOTS])
    _part_twins(lead, noise, z)
    for i in range(ROOTS):
        x, y = z[i].real, z[i].imag
        u, v = re[ROOTS], im[ROOTS]
        for k in range(ROOTS - 1, -1, -1):
            u, v = u * x - v * y + re[k], u * y + v * x + im[k]
        far = lead * lead
        for j in range(ROOTS):
            if j != i:
                far *= (x - z[j].real) ** 2 + (y - z[j].imag) ** 2
        growth = max(1.0, (x * x + y * y) ** DEGREE)
        radius[i] = ROOTS * (math.hypot(u, v) + noise * growth) / math.sqrt(far) if far > 0.0 else math.inf
        if not radius[i] >= 0.0:  # NaN
            radius[i] = math.inf


@jit
def _part_twins(lead: float, noise: float, z: Numbers) -> None:
    """Move the centres z ``(16,)`` of a double root apart, as far as makes their discs small.

    Centres may be anywhere. Those of a double root that are closer than the noise explains would get huge discs.
    """
    for i in range(ROOTS):
        for j in range(i):
            square = (z[i].real - z[j].real) ** 2 + (z[i].imag - z[j].imag) ** 2
            if square > _TWINS * _TWINS:
                continue
            middle = 0.5 * (z[i] + z[j])
            far = lead
            for k in range(ROOTS):
                if k != i and k != j:
                    far *= abs(middle - z[k])
            size = abs(middle)
            wanted = ROOTS * noise * max(1.0, size**ROOTS) / far if far > 0.0 else math.inf
            if square < wanted < 1e-4 and size > 0.0:
                step = complex(-middle.imag, middle.real) * (0.5 * math.sqrt(wanted) / size)
                z[i], z[j] = middle + step, middle - step


@jit
def covers_circle(z: Numbers, radius: Array, angles: Array, count: int) -> bool:
    """Whether the first `count` angles ``(16,)`` of solutions are one for each root that may be on the circle.

    z, radius ``(16,)``: the roots and their discs, as `zeros` leaves them.
    """
    if not np.isfinite(radius).all():
        return False
    group = np.arange(ROOTS)
    for i in range(ROOTS):
        for j in range(i):
            apart = math.hypot(z[i].real - z[j].real, z[i].imag - z[j].imag)
            if apart <= radius[i] + radius[j] and group[i] != group[j]:
                old = group[i]
                for k in range(ROOTS):
                    if group[k] == old:
                        group[k] = group[j]
    balance = np.zeros(ROOTS, dtype=np.int64)  # of each group: discs less solutions
    reaches = np.zeros(ROOTS, dtype=np.bool_)
    for i in range(ROOTS):
        balance[group[i]] += 1
        if abs(math.hypot(z[i].real, z[i].imag) - 1.0) <= radius[i]:
            reaches[group[i]] = True
    for k in range(count):
        x, y = math.cos(angles[k]), math.sin(angles[k])
        own = -1
        for i in range(ROOTS):
            if math.hypot(z[i].real - x, z[i].imag - y) <= radius[i]:
                own = group[i]
                break
        if own < 0:
            return False
        balance[own] -= 1
    missing = 0
    for i in range(ROOTS):
        missing += 1 if reaches[i] and balance[i] != 0 else 0
    return missing == 0
