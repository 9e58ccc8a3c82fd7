"""From a joint path to a motion: time-optimal under limits of velocity and acceleration, or of jerk too.

Without limits of jerk :mod:`kin.motion.timing.fastest` is the answer. Its s(t), averaged over a window of time and
slowed down evenly until it keeps the limits of jerk, is where :mod:`kin.motion.timing.jerk` begins. That compares
limits at points; between them :mod:`kin.motion.timing.check` bounds what is exceeded. Where it is, the limits are
tightened and the motion is improved again, some times; what is left is removed by making the whole motion slower.
Where that fails, as it may at a very small corner, the pace is that of a polynomial of degree five, slowed down.
`TimedPath.without` is the time-optimal duration without limits of jerk, so that their cost is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kin.motion.geometry.splines import parted
from kin.motion.pieces import look_between
from kin.motion.timing.check import evaluate_path, reached, slowdowns
from kin.motion.timing.fastest import clock, fastest
from kin.motion.timing.jerk import averaged, conditions, faster, passing, rest_to_rest
from kin.transforms import Array

# Intervals of a motion with limited jerk: of the time in which an acceleration rises, and how many.
_SHARE, _EVEN, _PARTS, _MOST = 0.15, 400, 40, 2000
_FAR, _NEAR, _GAP, _STEPS = 0.3, 0.05, 0.01, 60  # how much longer than necessary, as a part; steps at most
_JUMP = 0.2  # of a limit: a change at a knot of the path that is worth a knot of s(t)
_ENDS = 1.01  # the first and the last interval are slowed down by this factor: the spline differs there
_FAILED = 100.0  # a motion that has to be slower by this factor goes back, or almost
_CUTS, _CUT = 2, 4  # of the first and the last interval: how often, and into how many parts
_ROUNDS, _CLOSE = 3, 1.003  # of tightening limits that are exceeded; less than this factor is not worth another


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """A path of the joints with its limits.

    Attributes:
        knots, joints: q(s), piecewise cubic with a continuous second derivative: knots ``(k + 1,)`` and
            coefficients of each interval ``(k, n, 4)``.
        limits: velocity, acceleration and jerk on each interval ``(k, n, 3)``.
        most: the largest ṡ² on each interval ``(k,)``, from limits of the tool.
    """

    knots: Array
    joints: Array
    limits: Array
    most: Array


@dataclass(frozen=True, slots=True, eq=False)
class TimedPath:
    """A path and s(t), piecewise cubic: breaks ``(c + 1,)`` and coefficients ``(c, 4)``.

    Attributes:
        path: the path.
        breaks, clocks: s(t).
        without: seconds that it would take without limits of jerk.
    """

    path: JointPath
    breaks: Array
    clocks: Array
    without: float

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.breaks[-1])

    def at(self, times: Array) -> Array:
        """As in `kin.motion.pieces.Piece`."""
        out: Array = np.empty((4, len(times), self.path.joints.shape[1]))
        evaluate_path(
            self.path.knots, self.path.joints, self.breaks, self.clocks, np.ascontiguousarray(times), out
        )
        return out

    def grid(self) -> Array:
        """As in `kin.motion.pieces.Piece`."""
        return look_between(self.breaks)

    def when(self, places: Array) -> Array:
        """The times at which s reaches rising places ``(m,)``."""
        out: Array = np.empty(len(places))
        reached(self.breaks, self.clocks, places, out)
        return out

    def passed(self, times: Array) -> Array:
        """s at times ``(m,)``."""
        c = np.clip(np.searchsorted(self.breaks, times, side="right") - 1, 0, len(self.clocks) - 1)
        r, p = times - self.breaks[c], self.clocks[c].T
        return np.asarray(p[0] + r * (p[1] + r * (p[2] + r * p[3])))


def timed(path: JointPath, jerk_limited: bool, cancel: Callable[[], None]) -> TimedPath:
    """The fastest motion along a path, at rest at both ends."""
    plain = _fastest(path)
    without = float(plain[0][-1])
    if jerk_limited:
        return _limited(path, plain, cancel)
    endless = path.limits.copy()
    endless[:, :, 2] = np.inf
    free = JointPath(path.knots, path.joints, endless, path.most)
    factor = float(_slowdowns(free, *plain).max())
    return _stretched(path, *plain, max(factor, 1.0), without)


def shortest(path: JointPath) -> float:
    """Seconds of the fastest motion along a path without limits of jerk, about."""
    h = np.diff(path.knots)
    x = np.empty(len(h) + 1)
    fastest(h, path.joints, path.limits, path.most, x)
    speed = np.sqrt(x)
    return float((2.0 * h / (speed[:-1] + speed[1:])).sum())


def _limited(path: JointPath, plain: tuple[Array, Array], cancel: Callable[[], None]) -> TimedPath:
    """The fastest motion that keeps the limits of jerk too, from the fastest one that does not."""
    moving = np.abs(path.joints[:, :, 1:]).max(axis=(0, 2)) > 0.0
    rise = float((path.limits[:, moving, 1] / path.limits[:, moving, 2]).max()) if moving.any() else 0.0
    without = float(plain[0][-1])
    rise = max(rise, 1e-6 * without)
    u, s = _nodes(path, plain, rise)
    slower, best = np.ones(len(u) - 1), (np.inf, u, np.empty((0, 4)), 1.0)
    slower[[0, -1]] = _ENDS
    for round_ in range(_ROUNDS):
        cancel()
        u, clocks = _improved(path, u, s, slower, _FAR if round_ == 0 else _NEAR)
        factors = _slowdowns(path, u, clocks)
        factor = float(factors.max())
        if factor * u[-1] < best[0]:
            best = factor * float(u[-1]), u, clocks, factor
        if factor < _CLOSE:
            break
        slower = slower * np.maximum(factors, 1.0)
    _, times, clocks, factor = best
    if factor > _FAILED:
        times, clocks = _smooth(path, without)
        factor = float(_slowdowns(path, times, clocks).max())
    return _stretched(path, times, clocks, factor, without)


def _nodes(path: JointPath, plain: tuple[Array, Array], rise: float) -> tuple[Array, Array]:
    """Times and places of a motion to begin with: where the knots of the path are passed, and some between."""
    duration = float(plain[0][-1]) + rise
    u, s = np.linspace(0.0, duration, _EVEN + 1), np.empty(_EVEN + 1)
    averaged(*plain, rise, u, s)
    s[-1] = path.knots[-1]
    clocks = np.empty((_EVEN, 4))
    rest_to_rest(u, s, clocks)
    found = TimedPath(path, u, clocks, duration)
    times = np.concatenate([[0.0], found.when(path.knots[1:-1]), [duration]])
    longest = max(_SHARE * rise, duration / _MOST)
    kept = _kept(path, found, times, 0.5 * longest)
    times = times[kept]
    h = np.diff(times)
    parts = np.minimum(np.ceil(h / longest), _PARTS).astype(np.int64)
    old = np.repeat(np.arange(len(h)), parts)
    step = np.arange(len(old)) - np.repeat(np.cumsum(parts) - parts, parts)
    u = np.append(times[old] + (h / parts)[old] * step, duration)
    s = found.passed(u)
    s[np.append(step == 0, True)] = path.knots[kept]
    return u, s


def _kept(path: JointPath, found: TimedPath, times: Array, shortest: float) -> NDArray[np.int64]:
    """Which knots of the path become knots of s(t): no close ones, but all where q‴ or a limit jumps."""
    c = np.clip(np.searchsorted(found.breaks, times[1:-1], side="right") - 1, 0, len(found.clocks) - 1)
    r, p = times[1:-1] - found.breaks[c], found.clocks[c].T
    speed = p[1] + r * (2.0 * p[2] + 3.0 * r * p[3])
    jumps = 6.0 * np.abs(np.diff(path.joints[:, :, 3], axis=0)) * speed[:, None] ** 3 / path.limits[1:, :, 2]
    wanted = jumps.max(axis=1) > _JUMP
    wanted |= (path.limits[1:] != path.limits[:-1]).any(axis=(1, 2))
    wanted |= np.abs(np.diff(np.log(path.most))) > _JUMP
    place = np.floor(times / shortest)
    wanted |= place[1:-1] != place[:-2]
    return np.flatnonzero(np.concatenate([[True], wanted, [True]]))


def _improved(path: JointPath, u: Array, s: Array, slower: Array, away: float) -> tuple[Array, Array]:
    """s(t) of the fastest motion, from any motion that is at s ``(k + 1,)`` at times u: breaks, coefficients.

    `away`: by which part of its time that is too slow, about.
    """
    k, n = len(u) - 1, path.joints.shape[1]
    base, clocks, times = np.empty((k, 4)), np.empty((k, 4)), np.empty(k + 1)
    rows, caps = np.empty((2 * k, n, 5)), np.empty(2 * k)
    rest_to_rest(u, s, base)
    x = conditions(path.knots, path.joints, path.limits, path.most, u, base, slower, rows, caps)
    c = np.full(k + 2, x)
    faster(u, rows, caps, away, _GAP, _STEPS, c)
    passing(u, c, times)
    rest_to_rest(times, s, clocks)
    return times, clocks


def _smooth(path: JointPath, duration: float) -> tuple[Array, Array]:
    """s(t) from rest to rest close to the polynomial of degree five: breaks, coefficients. It never goes back."""
    f = np.linspace(0.0, 1.0, _EVEN + 1)
    clocks = np.empty((_EVEN, 4))
    rest_to_rest(f * duration, path.knots[-1] * f**3 * (10.0 - f * (15.0 - 6.0 * f)), clocks)
    return f * duration, clocks


def finer_ends(path: JointPath) -> JointPath:
    """The path with its first and last interval cut, ever finer towards the rest at the end.

    On a grid ṡ² is linear between knots, so a first interval that is passed at a limit of velocity would take
    twice as long as necessary.
    """
    for _ in range(_CUTS):
        parts = np.ones(len(path.joints), dtype=np.int64)
        parts[[0, -1]] = _CUT
        knots, joints = parted(path.knots, path.joints, parts)
        path = JointPath(knots, joints, np.repeat(path.limits, parts, axis=0), np.repeat(path.most, parts))
    return path


def _fastest(path: JointPath) -> tuple[Array, Array]:
    """s(t) of the fastest motion without limits of jerk."""
    path = finer_ends(path)
    h = np.diff(path.knots)
    x, times, pieces = np.empty(len(h) + 1), np.empty(len(h) + 1), np.empty((len(h), 4))
    fastest(h, path.joints, path.limits, path.most, x)
    clock(h, x, times, pieces)
    pieces[:, 0] += path.knots[0]
    return times, pieces


def _slowdowns(path: JointPath, breaks: Array, clocks: Array) -> Array:
    out: Array = np.empty(len(clocks))
    slowdowns(path.knots, path.joints, path.limits, path.most, breaks, clocks, out)
    return out


def _stretched(path: JointPath, breaks: Array, clocks: Array, factor: float, without: float) -> TimedPath:
    """The motion, slower by a factor."""
    return TimedPath(path, breaks * factor, clocks / factor ** np.arange(4.0), without)
