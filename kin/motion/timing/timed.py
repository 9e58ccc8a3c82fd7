"""From a joint path to a motion: time-optimal, then with limited jerk.

For limited jerk the time-optimal s(t) is averaged over a window of time. Then s̈ is continuous, and its slope is
the change of s̈ within the window divided by its length; the motion takes one window longer. Where the averaged
motion exceeds a limit, the path is made slower there and timed again, some times; what is left is removed by
making the whole motion slower. `TimedPath.without` is the time-optimal duration, so that the cost is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kin.motion.pieces import look_between
from kin.motion.timing.check import evaluate_path, slowdowns
from kin.motion.timing.fastest import clock, fastest
from kin.transforms import Array

# Part of each limit that is kept free for what lies between the points that are checked; rounds of making the path
# slower where it exceeds a limit, and the power of what is missing by which it is; windows that are tried, as
# multiples of the longest acceleration / jerk; the second one only if the first costs more than this.
_MARGIN, _ROUNDS, _POWER, _WINDOWS, _CHEAP = 1e-3, 10, 0.6, (2.0, 0.8), 1.03
_POINTS, _CLOSE = 3, 13  # points of each piece of s(t) that are compared with the limits, and at the end


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

    def when(self, s: float) -> float:
        """The time at which s is reached."""
        c = int(np.clip(np.searchsorted(self.clocks[:, 0], s, side="right") - 1, 0, len(self.clocks) - 1))
        low, high = 0.0, float(self.breaks[c + 1] - self.breaks[c])
        p0, p1, p2, p3 = self.clocks[c].tolist()
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = p0 + middle * (p1 + middle * (p2 + middle * p3)) < s
            low, high = (middle, high) if below else (low, middle)
        return float(self.breaks[c]) + low

    def passed(self, times: Array) -> Array:
        """s at times ``(m,)``."""
        c = np.clip(np.searchsorted(self.breaks, times, side="right") - 1, 0, len(self.clocks) - 1)
        r, p = times - self.breaks[c], self.clocks[c].T
        return np.asarray(p[0] + r * (p[1] + r * (p[2] + r * p[3])))


def timed(path: JointPath, jerk_limited: bool, stop: Callable[[], None]) -> TimedPath:
    """The fastest motion along a path, at rest at both ends."""
    h = np.diff(path.knots)
    plain = _fastest(path, h, np.ones(len(h)))
    without = float(plain[0][-1])
    if not jerk_limited:
        endless = path.limits.copy()
        endless[:, :, 2] = np.inf
        free = JointPath(path.knots, path.joints, endless, path.most)
        return _stretched(path, free, *plain, 1.0, without)
    moving = np.abs(path.joints[:, :, 1:]).max(axis=(0, 2)) > 0.0
    ratio = float((path.limits[:, moving, 1] / path.limits[:, moving, 2]).max()) if moving.any() else 0.0
    kept = JointPath(path.knots, path.joints, path.limits * (1.0 - _MARGIN), path.most * (1.0 - _MARGIN) ** 2)
    found = _smoothed(kept, h, plain, _WINDOWS[0] * ratio, stop, 4)
    if min(found, key=lambda each: each[0])[0] > _CHEAP * without:
        found += _smoothed(kept, h, plain, _WINDOWS[1] * ratio, stop, _ROUNDS)
    _, breaks, clocks, slower = min(found, key=lambda each: each[0])
    return _stretched(path, kept, breaks, clocks, slower, without)


def _smoothed(
    path: JointPath, h: Array, plain: tuple[Array, Array], window: float, stop: Callable[[], None], rounds: int
) -> list[tuple[float, Array, Array, float]]:
    """Averaged motions with the factor that they have to be slower: (seconds, breaks, clocks, factor)."""
    scale, (times, pieces), found = np.ones(len(h)), plain, []
    for round_ in range(rounds):
        stop()
        if round_:
            times, pieces = _fastest(path, h, scale)
        breaks, clocks = averaged(times, pieces, window)
        slow = _slowdowns(path, breaks, clocks)
        worst = max(float(slow.max()), 1.0)
        found.append((worst * float(breaks[-1]), breaks, clocks, worst))
        if worst < 1.0 + 1e-9:
            break
        first = np.searchsorted(times, breaks[:-1] - window, side="right") - 1
        last = np.searchsorted(times, breaks[1:], side="left")
        factor = np.ones(len(h))
        for c in np.flatnonzero(slow > 1.0).tolist():
            part = factor[max(first[c], 0) : last[c]]
            np.maximum(part, slow[c], out=part)
        scale = scale / factor**_POWER
    return found


def _fastest(path: JointPath, h: Array, scale: Array) -> tuple[Array, Array]:
    """s(t) of the fastest motion; speeds are scaled on each interval ``(k,)``, accelerations twice."""
    x, times, pieces = np.empty(len(h) + 1), np.empty(len(h) + 1), np.empty((len(h), 4))
    one = scale[:, None]
    velocity, acceleration = path.limits[:, :, 0] * one, path.limits[:, :, 1] * one**2
    fastest(h, path.joints, velocity, acceleration, path.most * scale**2, x)
    clock(h, x, times, pieces)
    pieces[:, 0] += path.knots[0]
    return times, pieces


def _slowdowns(path: JointPath, breaks: Array, clocks: Array, points: int = _POINTS) -> Array:
    out: Array = np.empty(len(clocks))
    slowdowns(path.knots, path.joints, path.limits, path.most, breaks, clocks, points, out)
    return out


def _stretched(
    path: JointPath, near: JointPath, breaks: Array, clocks: Array, factor: float, without: float
) -> TimedPath:
    """The motion, slower by a factor, and by what a closer look at the limits of `near` demands."""
    breaks, clocks = breaks * factor, clocks / factor ** np.arange(4.0)
    more = float(_slowdowns(near, breaks, clocks, _CLOSE).max())
    if more > 1.0:
        breaks, clocks = breaks * more, clocks / more ** np.arange(4.0)
    return TimedPath(path, breaks, clocks, without)


def averaged(times: Array, pieces: Array, window: float) -> tuple[Array, Array]:
    """s(t), at rest before and after, averaged over a window of time: breaks and cubic coefficients."""
    if window <= 0.0:
        return times, pieces
    total = float(times[-1])
    breaks = np.unique(np.concatenate([times, times + window]))
    breaks = breaks[np.concatenate([[True], np.diff(breaks) > 1e-12 * (total + window)])]
    breaks[-1] = total + window
    h = np.diff(times)
    sums = np.concatenate(
        [[0.0], np.cumsum(h * (pieces[:, 0] + h * (pieces[:, 1] / 2.0 + h * pieces[:, 2] / 3.0)))]
    )
    end = float(pieces[-1, 0] + h[-1] * (pieces[-1, 1] + h[-1] * pieces[-1, 2]))

    def moments(t: Array) -> tuple[Array, Array, Array, Array]:
        """The integral of s, s, ṡ and s̈ at any times."""
        inside = np.clip(t, 0.0, total)
        i = np.clip(np.searchsorted(times, inside, side="right") - 1, 0, len(h) - 1)
        r, (p0, p1, p2, _) = inside - times[i], pieces[i].T
        moving = (t > 0.0) & (t < total)
        integral = sums[i] + r * (p0 + r * (p1 / 2.0 + r * p2 / 3.0)) + (t - inside) * np.where(t > total, end, p0)
        return (
            integral,
            p0 + r * (p1 + r * p2),
            np.where(moving, p1 + 2.0 * r * p2, 0.0),
            np.where(moving, p2, 0.0),
        )

    middle = 0.5 * (breaks[:-1] + breaks[1:])
    late, early = moments(breaks[:-1]), moments(breaks[:-1] - window)
    jerk = moments(middle)[3] - moments(middle - window)[3]
    rows = [(a - b) / window for a, b in zip(late[:3], early[:3], strict=True)]
    return breaks, np.stack([rows[0], rows[1], rows[2] / 2.0, jerk / (3.0 * window)], axis=1)
