"""The smallest capsule around balls, nearly: the best of many directions, then improved in small steps.

A ball is a row ``(x, y, z, r)``; points have the radius 0. For an axis in a given direction the problem is the
smallest circle around the balls seen along it, and two ends. Whatever the search finds, the radius is measured
last and for all balls, so none is outside.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kin.transforms import Array

MANY, FEW = 96, 12  # directions that are tried
ROUNDS, FEW_ROUNDS = 40, 12  # of the search for a circle's centre
STEPS, AROUND = 50, 24  # of the improvement, and tries in each
BEST = 3  # directions that are improved
EXTREMES, COARSE = 160, 50  # directions in which the farthest balls are looked for
_TINY = 1e-12  # relative: what a rounding may put a ball outside by


class Segment(NamedTuple):
    """A capsule: all points within `radius` of the segment from `start` to `end` (m)."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    @property
    def volume(self) -> float:
        """In m³."""
        return volume(math.dist(self.start, self.end), self.radius)


def volume(length: float, radius: float) -> float:
    """The volume of a capsule with an axis of this length."""
    return math.pi * radius * radius * (length + 4.0 / 3.0 * radius)


def directions(count: int) -> Array:
    """Unit vectors ``(count, 3)`` spread evenly over a half sphere: a Fibonacci lattice."""
    k = np.arange(count) + 0.5
    z, turn = k / count, np.pi * (1.0 + math.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])


def extremes(balls: Array, count: int = EXTREMES) -> Array:
    """The balls that reach farthest in so many directions."""
    if len(balls) <= count:
        return balls
    ways = directions(count // 2)
    along = balls[:, :3] @ ways.T
    r = balls[:, 3:]
    farthest = np.concatenate([(along + r).argmax(axis=0), (along - r).argmin(axis=0)])
    return np.asarray(balls[np.unique(farthest)])


def quick(balls: Array) -> tuple[float, Array]:
    """The volume of a good capsule around extreme balls, and its axis ``(6,)``."""
    found, axes = _by_direction(balls, FEW, FEW_ROUNDS)
    best = int(found.argmin())
    return float(found[best]), axes[best]


def smallest(balls: Array) -> Segment:
    """A capsule around balls ``(k, 4)`` that is about as small as can be; its numbers are rounded outwards."""
    core = extremes(balls)
    found, axes = _by_direction(core, MANY, ROUNDS)
    size = float(np.ptp(core[:, :3], axis=0).max()) + float(core[:, 3].max())
    rng = np.random.default_rng(0)
    improved = [
        _improved(core, axes[i], float(found[i]), size, rng) for i in np.argsort(found, kind="stable")[:BEST]
    ]
    _, axis = min(improved, key=lambda each: each[0])
    return rounded(balls, axis, size)


def rounded(balls: Array, axis: Array, size: float) -> Segment:
    """The capsule about an axis ``(6,)`` that holds all balls, with at least three digits of the size."""
    digits = max(3 - math.floor(math.log10(size)), 0) if size > 0.0 else 6
    axis = np.round(axis, digits)
    least = 10.0**-digits
    radius = float(radii(balls, axis[None])[0]) + _TINY * (size + float(np.abs(axis).max()))
    radius = max(math.ceil(radius / least) * least, least)
    x, y, z, u, v, w = (float(f"{value:.{digits}f}") + 0.0 for value in axis.tolist())
    return Segment((x, y, z), (u, v, w), float(f"{radius:.{digits}f}"))


def radii(balls: Array, axes: Array) -> Array:
    """The radii ``(c,)`` with which capsules about axes ``(c, 6)`` hold all balls."""
    start, way = axes[:, None, :3], axes[:, None, 3:] - axes[:, None, :3]
    square = np.einsum("cki,cki->ck", way, way)
    off = balls[None, :, :3] - start
    t = np.einsum("cki,cki->ck", off, np.broadcast_to(way, off.shape)) / np.where(square > 0.0, square, 1.0)
    off -= np.clip(t, 0.0, 1.0)[..., None] * way
    return np.asarray((np.sqrt(np.einsum("cki,cki->ck", off, off)) + balls[:, 3]).max(axis=1))


def _by_direction(balls: Array, count: int, rounds: int) -> tuple[Array, Array]:
    """Volumes ``(c,)`` and axes ``(c, 6)`` of capsules in many directions, some of them the balls' own."""
    points, r = balls[:, :3], balls[:, 3]
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    off = points - middle
    own = np.linalg.eigh(off.T @ off)[1].T
    base = directions(count // 2)
    along = off @ np.vstack([np.eye(3), own, base]).T
    across = points[along.argmax(axis=0)] - points[along.argmin(axis=0)]
    length = np.linalg.norm(across, axis=1)
    across = across[length > 0.0] / length[length > 0.0, None]
    d = np.vstack([np.eye(3), own, base, across])
    side = np.cross(d, np.eye(3)[np.abs(d).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    t, x, y = off @ d.T, off @ side.T, off @ np.cross(d, side).T  # (k, c)
    u, v, r = np.zeros(len(d)), np.zeros(len(d)), r[:, None]
    every = np.arange(len(d))
    for step in range(rounds):  # Bădoiu and Clarkson: towards the farthest, less each time
        far = (np.hypot(x - u, y - v) + r).argmax(axis=0)
        u += (x[far, every] - u) / (step + 2.0)
        v += (y[far, every] - v) / (step + 2.0)
    gap = np.hypot(x - u, y - v)
    radius = (gap + r).max(axis=0)
    room = np.sqrt(np.maximum((radius - r) ** 2 - gap * gap, 0.0))
    low, high = (t + room).min(axis=0), (t - room).max(axis=0)
    low, high = np.where(low > high, 0.5 * (low + high), [low, high])
    centre = u[:, None] * side + v[:, None] * np.cross(d, side)
    foot = middle + centre
    axes = np.hstack([foot + low[:, None] * d, foot + high[:, None] * d])
    return np.asarray(np.pi * radius * radius * (high - low + 4.0 / 3.0 * radius)), axes


def _improved(
    balls: Array, axis: Array, least: float, size: float, rng: np.random.Generator
) -> tuple[float, Array]:
    """A smaller capsule near one, by random steps that become shorter when they do not help."""
    step = 0.05 * size
    for _ in range(STEPS):
        tried = axis + step * rng.standard_normal((AROUND, 6))
        radius = radii(balls, tried)
        length = np.linalg.norm(tried[:, 3:] - tried[:, :3], axis=1)
        found = np.pi * radius * radius * (length + 4.0 / 3.0 * radius)
        best = int(found.argmin())
        if found[best] < least:
            least, axis = float(found[best]), tried[best]
        else:
            step *= 0.75
    return least, axis
