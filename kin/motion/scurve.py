"""The time-optimal motion of a joint from rest to rest under limits of velocity, acceleration and jerk.

It has seven phases of constant jerk: the acceleration rises, stays and falls; the speed stays; and the first three
in reverse (Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4).
Phases may be empty. Each phase is a cubic polynomial of the time since its beginning.

The jerk is lower than its limit where the acceleration would rise in less than `SHORTEST` of the time: the
rounding of such a short phase would exceed the limits of acceleration and velocity.
"""

from __future__ import annotations

import math

import numpy as np

from kin.kernels.compile import jit
from kin.transforms import Array

PHASES = 7
SHORTEST = 1e-9  # part of a motion in which its acceleration may rise


Phases = tuple[float, float, float]


@jit
def phase_times(distance: float, v: float, a: float, j: float) -> Phases:
    """Seconds of rising acceleration, of steady acceleration and of steady speed, for a distance ≥ 0.

    v, a, j: the limits of velocity, acceleration and jerk.
    """
    least = SHORTEST * max(math.sqrt(distance / a), distance / v)
    if least == 0.0:  # no distance, or one so short that it takes no time
        return 0.0, 0.0, 0.0
    j = min(j, a / least)
    if v * j <= a * a:
        rise, steady = max(math.sqrt(v / j), least), 0.0
    else:
        rise, steady = a / j, v / a - a / j
    ramp = 2.0 * rise + steady
    if distance >= v * ramp:
        return rise, steady, distance / v - ramp
    if distance >= 2.0 * a * (a / j) ** 2:
        rise = a / j
        ramp = 0.5 * (rise + math.sqrt(rise * rise + 4.0 * distance / a))
        return rise, max(ramp - 2.0 * rise, 0.0), 0.0
    return (0.5 * distance / j) ** (1.0 / 3.0), 0.0, 0.0


@jit
def whole(phases: Phases) -> float:
    """Seconds of all seven phases."""
    rise, steady, cruise = phases
    return 2.0 * (2.0 * rise + steady) + cruise


@jit
def fill(start: float, end: float, phases: Phases, total: float, breaks: Array, pieces: Array) -> None:
    """The motion of one joint, stretched to `total` seconds.

    Args:
        start, end: where it begins and ends.
        phases: its `phase_times`.
        total: seconds, not less than those.
        breaks: ← when each phase begins, and the end ``(8,)``.
        pieces: ← coefficients of each phase, the constant one first ``(7, 4)``.
    """
    rise, steady, cruise = phases
    own = whole(phases)
    if own == 0.0:
        for k in range(PHASES):
            breaks[k] = 0.0
            pieces[k, 0] = start if k < PHASES - 1 else end
            pieces[k, 1] = pieces[k, 2] = pieces[k, 3] = 0.0
        breaks[PHASES] = total
        return
    # The jerk follows from the distance, so that the end is met to the last digits.
    jerk = abs(end - start) / (rise * (rise + steady) * (2.0 * rise + steady + cruise))
    scale = total / own
    rise *= scale
    steady *= scale
    cruise *= scale
    jerk = math.copysign(jerk / scale**3, end - start)
    times = (rise, steady, rise, cruise, rise, steady, rise)
    signs = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)
    t, x, v, a = 0.0, start, 0.0, 0.0
    for k in range(PHASES):
        h, u = times[k], signs[k] * jerk
        breaks[k] = t
        pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3] = x, v, 0.5 * a, u / 6.0
        x += h * (v + h * (0.5 * a + h * u / 6.0))
        v += h * (a + 0.5 * h * u)
        a += h * u
        if k == 2 or k == 3 or k == 6:
            a = 0.0  # exactly, where rounding would leave a rest
        t += h
    breaks[PHASES] = total


@jit
def synchronised(start: Array, end: Array, limits: Array, breaks: Array, pieces: Array) -> float:
    """The motion of all joints: the slowest sets the time, the others are stretched to it; returns the seconds.

    Stretching divides velocity, acceleration and jerk by powers of the same factor, so no limit is exceeded.

    Args:
        start, end: ``(n,)``.
        limits: largest velocity, acceleration and jerk of each joint ``(n, 3)``.
        breaks, pieces: ← as in `fill`, ``(n, 8)`` and ``(n, 7, 4)``.
    """
    total = 0.0
    for i in range(start.shape[0]):
        phases = phase_times(abs(end[i] - start[i]), limits[i, 0], limits[i, 1], limits[i, 2])
        breaks[i, 0], breaks[i, 1], breaks[i, 2] = phases
        total = max(total, whole(phases))
    for i in range(start.shape[0]):
        fill(start[i], end[i], (breaks[i, 0], breaks[i, 1], breaks[i, 2]), total, breaks[i], pieces[i])
    return total


@jit
def evaluate(breaks: Array, pieces: Array, times: Array, out: Array) -> None:
    """out ← position, velocity, acceleration and jerk ``(4, k, n)`` at rising or other times ``(k,)``."""
    for i in range(breaks.shape[0]):
        last = breaks.shape[1] - 2
        k = 0
        for m in range(times.shape[0]):
            t = times[m]
            if k > 0 and t < breaks[i, k]:
                k = 0
            while k < last and t >= breaks[i, k + 1]:
                k += 1
            h = t - breaks[i, k]
            c0, c1, c2, c3 = pieces[i, k, 0], pieces[i, k, 1], pieces[i, k, 2], pieces[i, k, 3]
            out[0, m, i] = c0 + h * (c1 + h * (c2 + h * c3))
            out[1, m, i] = c1 + h * (2.0 * c2 + h * 3.0 * c3)
            out[2, m, i] = 2.0 * c2 + h * 6.0 * c3
            out[3, m, i] = 6.0 * c3


def at(breaks: Array, pieces: Array, times: Array) -> Array:
    """As `evaluate`, into a new array ``(4, k, n)``."""
    out: Array = np.empty((4, len(times), len(breaks)))
    evaluate(breaks, pieces, times, out)
    return out
