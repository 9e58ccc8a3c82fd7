"""Motions that begin while the arm moves.

A *ramp* takes a joint from a speed and an acceleration to another speed, without acceleration, as fast as the
limits of acceleration and jerk allow: the acceleration rises to a peak, stays, and falls (Biagiotti and
Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4). From the motion at the
start to rest at the end, a joint has two ramps with a time of steady speed between them. That speed is the only
unknown: the fastest one that covers the distance, or for joints that have to wait for the slowest one, the one
that takes as long.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kin.motion.pieces import JointMotion
from kin.motion.scurve import PHASES
from kin.transforms import Array

_HALVINGS = 200  # of an interval of speeds; it ends at neighbouring floats
_REST = 1e-12  # radians or metres: a smaller distance from where a joint comes to rest is none

Phases = tuple[tuple[float, float], ...]  # (seconds, jerk) one after the other


class Bounds(NamedTuple):
    """The largest speed, acceleration and jerk of a joint, in rad (m) and seconds."""

    speed: float
    acceleration: float
    jerk: float


class Start(NamedTuple):
    """How a joint moves at the start: its speed and its acceleration."""

    speed: float
    acceleration: float


def ramp(start: Start, speed: float, bounds: Bounds) -> Phases:
    """Three phases to a speed without acceleration; the speed at the start may be any."""
    a, j = start.acceleration, bounds.jerk
    most = max(bounds.acceleration, abs(a))
    sign = math.copysign(1.0, speed - (start.speed + 0.5 * a * abs(a) / j))
    change, a = sign * (speed - start.speed), sign * a
    peak, steady = math.sqrt(max(j * change + 0.5 * a * a, 0.0)), 0.0
    if peak > most:
        peak, steady = most, max((change - (most * most - 0.5 * a * a) / j) / most, 0.0)
    return (max((peak - a) / j, 0.0), sign * j), (steady, 0.0), (peak / j, -sign * j)


def _seconds(phases: Phases) -> float:
    return sum(seconds for seconds, _ in phases)


def _distance(start: Start, phases: Phases) -> float:
    x, v, a = 0.0, start.speed, start.acceleration
    for h, u in phases:
        x += h * (v + h * (0.5 * a + h * u / 6.0))
        v += h * (a + 0.5 * h * u)
        a += h * u
    return x


class _Way(NamedTuple):
    """From the start over a steady speed to rest, with nothing between the two ramps: distance and seconds."""

    first: Phases
    second: Phases
    distance: float
    seconds: float

    @classmethod
    def at(cls, start: Start, speed: float, bounds: Bounds) -> _Way:
        first, second = ramp(start, speed, bounds), ramp(Start(speed, 0.0), 0.0, bounds)
        covered = _distance(start, first) + _distance(Start(speed, 0.0), second)
        return cls(first, second, covered, _seconds(first) + _seconds(second))


def phases_to(distance: float, start: Start, bounds: Bounds, seconds: float = 0.0) -> Phases:
    """To rest at a distance: seven phases of no less than so many seconds, as fast as possible by default.

    A joint that comes to rest at its goal by braking has three phases, and does not wait for others.
    """
    stop = _Way.at(start, 0.0, bounds).distance
    if abs(distance - stop) <= _REST:
        return ramp(start, 0.0, bounds)
    sign = math.copysign(1.0, distance - stop)

    def cruising(speed: float) -> float:
        """Seconds of steady speed that are left at a speed, of the sign in which the goal is."""
        return (distance - _Way.at(start, speed, bounds).distance) / speed

    fastest = sign * bounds.speed
    if cruising(fastest) < 0.0:
        fastest = _halved(0.0, fastest, lambda speed: cruising(speed) >= 0.0)
    slow = _Way.at(start, fastest, bounds).seconds + max(cruising(fastest), 0.0) < seconds
    if slow:
        fastest = _halved(
            0.0, fastest, lambda speed: _Way.at(start, speed, bounds).seconds + cruising(speed) >= seconds
        )
    way = _Way.at(start, fastest, bounds)
    return (*way.first, (max((distance - way.distance) / fastest, 0.0), 0.0), *way.second)


def _halved(low: float, high: float, holds: Callable[[float], bool]) -> float:
    """The value nearest to `high` at which something holds that holds near `low`, but not at `low` itself."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low or high


def together(q: Array, goal: Array, qd: Array, qdd: Array, limits: Array) -> JointMotion:
    """From a motion at q to rest at a goal ``(n,)``, all joints in the time of the slowest; limits ``(n, 3)``."""
    rows = [
        (float(distance), Start(speed, acceleration), Bounds(*bounds))
        for distance, speed, acceleration, bounds in zip(
            goal - q, qd.tolist(), qdd.tolist(), limits.tolist(), strict=True
        )
    ]
    slowest = max(_seconds(phases_to(*row)) for row in rows)
    return _motion(q, qd, qdd, [phases_to(*row, slowest) for row in rows], goal)


def braked(q: Array, qd: Array, qdd: Array, limits: Array) -> JointMotion:
    """From a motion at q ``(n,)`` to rest, each joint as soon as its limits ``(n, 3)`` allow."""
    phases = [
        ramp(Start(speed, acceleration), 0.0, Bounds(*bounds))
        for speed, acceleration, bounds in zip(qd.tolist(), qdd.tolist(), limits.tolist(), strict=True)
    ]
    return _motion(q, qd, qdd, phases, None)


def _motion(q: Array, qd: Array, qdd: Array, phases: list[Phases], goal: Array | None) -> JointMotion:
    """The joints as polynomials; one that is there sooner waits at its goal."""
    n, end = len(q), max(map(_seconds, phases))
    breaks, pieces = np.full((n, PHASES + 1), end), np.zeros((n, PHASES, 4))
    for i, own in enumerate(phases):
        t, x, v, a = 0.0, float(q[i]), float(qd[i]), float(qdd[i])
        for k, (h, u) in enumerate(own):
            breaks[i, k] = t
            pieces[i, k] = x, v, 0.5 * a, u / 6.0
            x += h * (v + h * (0.5 * a + h * u / 6.0))
            v += h * (a + 0.5 * h * u)
            a += h * u
            t += h
        if len(own) < PHASES:
            breaks[i, len(own) : PHASES] = t
            pieces[i, len(own) :, 0] = x if goal is None else float(goal[i])
    return JointMotion(breaks, pieces)


def extremes(motion: JointMotion) -> tuple[Array, Array]:
    """The smallest and the largest value of each joint on the way ``(n,)``."""
    q = motion.at(np.array([0.0, *np.unique(motion.breaks), motion.duration]))[0]
    low, high = q.min(axis=0), q.max(axis=0)
    for i, (breaks, pieces) in enumerate(zip(motion.breaks.tolist(), motion.pieces.tolist(), strict=True)):
        for start, end, (x, v, a, j) in zip(breaks, breaks[1:], pieces, strict=False):
            for h in _roots(3.0 * j, 2.0 * a, v):
                if 0.0 < h < end - start:
                    turning = x + h * (v + h * (a + h * j))
                    low[i], high[i] = min(low[i], turning), max(high[i], turning)
    return low, high


def _roots(a: float, b: float, c: float) -> tuple[float, ...]:
    """The real zeros of a x² + b x + c."""
    square = b * b - 4.0 * a * c
    if square < 0.0:
        return ()
    half = -0.5 * (b + math.copysign(math.sqrt(square), b))
    return (half / a if a else math.inf, c / half if half else math.inf)
