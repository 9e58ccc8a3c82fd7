"""Shortening a way: waypoints that are not needed are left out, and corners are cut by random shortcuts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kin.differential.metric import weights
from kin.transforms import Array
from kin.way.free import Space
from kin.way.results import path_length

SHORTCUTS = 120
_WORTH = 1e-3  # part of the length that a shortcut must save


def shortened(space: Space, q: Array, seed: int, is_over: Callable[[], bool]) -> Array:
    """A way ``(m, n)`` with the same ends, no longer, and as free as the given one ``(k, n)``."""
    q = _without_needless(space, q, is_over)
    rng = np.random.default_rng(seed)
    for _ in range(SHORTCUTS):
        if len(q) < 3 or is_over():
            break
        q = _cut(space, q, np.sort(rng.uniform(0.0, 1.0, 2)))
    return _without_needless(space, q, is_over)


def _without_needless(space: Space, q: Array, is_over: Callable[[], bool]) -> Array:
    """The way without waypoints that a straight motion can pass by, from the farthest on."""
    kept, i = [0], 0
    while i < len(q) - 1:
        ahead = range(len(q) - 1, i + 1, -1) if not is_over() else ()
        i = next((j for j in ahead if space.is_free(q[i], q[j])), i + 1)
        kept.append(i)
    return np.asarray(q[kept])


def _cut(space: Space, q: Array, shares: Array) -> Array:
    """The way with a straight motion between two places, given as shares of its length, if that is free."""
    lengths = np.linalg.norm(np.diff(q, axis=0) * weights(space.robot), axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    places = shares * at[-1]
    parts = np.clip(np.searchsorted(at, places, side="right") - 1, 0, len(lengths) - 1)
    if parts[0] == parts[1]:
        return q
    inside = (places - at[parts]) / np.maximum(lengths[parts], 1e-12)
    first, second = (q[i] + share * (q[i + 1] - q[i]) for i, share in zip(parts.tolist(), inside, strict=True))
    shorter = np.concatenate([q[: parts[0] + 1], [first, second], q[parts[1] + 1 :]])
    if path_length(space.robot, shorter) > (1.0 - _WORTH) * at[-1] or not space.is_free(first, second):
        return q
    return np.asarray(shorter)
