"""Profiles of one joint between two boundary conditions, as textbooks compare them: q(t), piecewise polynomial.

``cubic`` and ``quintic`` meet boundary velocities (and accelerations) in a given time; ``minimum_jerk`` is the
quintic without boundary accelerations, which minimises the integral of the squared jerk (Flash and Hogan 1985).
``trapezoidal`` (also LSPB) and ``s_curve`` are the fastest under limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError, finite_number
from kin.motion.pieces import JointMotion
from kin.transforms import Array, finite_array


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """q(t) as polynomials.

    Attributes:
        breaks: seconds at which they begin, and the end ``(k + 1,)``.
        coefficients: of powers of the time since the break, the constant one first ``(k, 6)``.
    """

    breaks: Array
    coefficients: Array

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.breaks[-1])

    def sample(self, t: ArrayLike) -> Array:
        """q and its first three derivatives ``(4, k)`` at times ``(k,)``; outside, those of the nearest end."""
        times = np.clip(finite_array("t", t, (None,)), 0.0, self.breaks[-1])
        k = np.clip(np.searchsorted(self.breaks, times, side="right") - 1, 0, len(self.coefficients) - 1)
        r, rows = times - self.breaks[k], self.coefficients[k]
        out: Array = np.zeros((4, len(times)))
        for order in range(4):
            for power in range(5, order - 1, -1):
                out[order] = out[order] * r + rows[:, power] * math.perm(power, order)
        return out


def cubic(start: float, end: float, duration: float, v_start: float = 0.0, v_end: float = 0.0) -> Profile:
    """One polynomial of degree three that meets positions and velocities at both ends."""
    q0, q1, v0, v1 = _finite(start=start, end=end, v_start=v_start, v_end=v_end)
    T = _positive("duration", duration)
    d = q1 - q0
    rows = [q0, v0, (3.0 * d / T - 2.0 * v0 - v1) / T, (v0 + v1 - 2.0 * d / T) / T**2, 0.0, 0.0]
    return Profile(np.array([0.0, T]), np.array([rows]))


def quintic(
    start: float,
    end: float,
    duration: float,
    v_start: float = 0.0,
    v_end: float = 0.0,
    a_start: float = 0.0,
    a_end: float = 0.0,
) -> Profile:
    """One polynomial of degree five that meets positions, velocities and accelerations at both ends."""
    q0, q1, v0, v1 = _finite(start=start, end=end, v_start=v_start, v_end=v_end)
    a0, a1 = _finite(a_start=a_start, a_end=a_end)
    T = _positive("duration", duration)
    # What is left of position, velocity and acceleration at the end after the first three terms.
    p = q1 - q0 - v0 * T - 0.5 * a0 * T**2
    v, a = (v1 - v0 - a0 * T) * T, (a1 - a0) * T**2
    rows = [10.0 * p - 4.0 * v + 0.5 * a, -15.0 * p + 7.0 * v - a, 6.0 * p - 3.0 * v + 0.5 * a]
    powers = [row / T ** (3 + k) for k, row in enumerate(rows)]
    return Profile(np.array([0.0, T]), np.array([[q0, v0, 0.5 * a0, *powers]]))


def minimum_jerk(start: float, end: float, duration: float, v_start: float = 0.0, v_end: float = 0.0) -> Profile:
    """The smallest integral of the squared jerk, without accelerations at the ends."""
    return quintic(start, end, duration, v_start, v_end)


def trapezoidal(
    start: float, end: float, velocity: float, acceleration: float, v_start: float = 0.0, v_end: float = 0.0
) -> Profile:
    """The fastest under limits of velocity and acceleration: linear segments with parabolic blends (LSPB).

    Boundary velocities point to the end, or are zero.

    Raises:
        InputError: boundary velocities that the limits or the distance do not allow.
    """
    q0, q1, v0, v1 = _finite(start=start, end=end, v_start=v_start, v_end=v_end)
    v, a = _positive("velocity", velocity), _positive("acceleration", acceleration)
    sign = -1.0 if q1 < q0 else 1.0
    d, v0, v1 = abs(q1 - q0), sign * v0, sign * v1
    for name, given in (("v_start", v0), ("v_end", v1)):
        if not 0.0 <= given <= v:
            raise InputError(name, sign * given, f"a velocity towards the end of at most {v:g}")
    if abs(v1 * v1 - v0 * v0) > 2.0 * a * d * (1.0 + 1e-12):
        raise InputError("v_end", sign * v1, "a velocity that can be reached from v_start over this distance")
    top = min(v, math.sqrt(a * d + 0.5 * (v0 * v0 + v1 * v1)))
    rise, fall = (top - v0) / a, (top - v1) / a
    covered = 0.5 * (v0 + top) * rise + 0.5 * (v1 + top) * fall
    cruise = max(d - covered, 0.0) / top if top > 0.0 else 0.0
    first, last = 0.5 * (v0 + top) * rise, d - 0.5 * (v1 + top) * fall
    rows = np.zeros((3, 6))
    rows[0, :3], rows[1, :2], rows[2, :3] = (0.0, v0, 0.5 * a), (first, top), (last, top, -0.5 * a)
    rows *= sign
    rows[:, 0] += q0
    return Profile(np.array([0.0, rise, rise + cruise, rise + cruise + fall]), rows)


def s_curve(start: float, end: float, velocity: float, acceleration: float, jerk: float) -> Profile:
    """The fastest from rest to rest under limits of velocity, acceleration and jerk."""
    q0, q1 = _finite(start=start, end=end)
    limits = [_positive("velocity", velocity), _positive("acceleration", acceleration), _positive("jerk", jerk)]
    motion = JointMotion.between(np.array([q0]), np.array([q1]), np.array([limits]))
    return Profile(motion.breaks[0], np.pad(motion.pieces[0], ((0, 0), (0, 2))))


def fastest(way: float, limits: Array) -> dict[str, Profile]:
    """The fastest of each kind from rest to rest over a way, within limits ``(3,)``.

    The jerk of cubic and trapezoidal profiles is not limited: it is infinite at their ends.
    """
    v, a, j = limits.tolist()
    root = math.sqrt(10.0 * way / (math.sqrt(3.0) * a))
    return {
        "cubic": cubic(0.0, way, max(1.5 * way / v, math.sqrt(6.0 * way / a))),
        "quintic": quintic(0.0, way, max(1.875 * way / v, root, math.cbrt(60.0 * way / j))),
        "trapezoidal": trapezoidal(0.0, way, v, a),
        "S-curve": s_curve(0.0, way, v, a, j),
    }


def _finite(**values: float) -> list[float]:
    return [finite_number(name, value, "a finite number") for name, value in values.items()]


def _positive(name: str, value: float) -> float:
    number = finite_number(name, value, "a finite number above 0")
    if not number > 0.0:
        raise InputError(name, value, "a finite number above 0")
    return number
