"""Where the words of a drawing stand: each has several places, and takes the one with the most room."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kin.transforms import Array

LETTER, LINE = 0.62, 1.1  # width of a letter and height of a line, in units of the size
BASE = 0.36  # of the size, from the middle of a word down to its base line
GAP = 1.0  # drawing units between words
_STEP = 6.0
_TURNS = np.radians([0.0, 35.0, -35.0, 70.0, -70.0, 110.0, -110.0, 180.0])
_WIDTHS = {"m": 1.5, **dict.fromkeys("₀₁₂₃₄₅₆₇₈₉ₜ.,", 0.6)}


@dataclass(frozen=True)
class Label:
    """A word, and the places where its middle may be ``(k, 2)``, the best one first."""

    text: str
    places: Array
    colour: str
    size: float

    @property
    def room(self) -> Array:
        """Width and height ``(2,)``."""
        return np.array([LETTER * sum(_WIDTHS.get(letter, 1.0) for letter in self.text), LINE]) * self.size


def around(start: Array, tip: Array, off: float) -> Array:
    """Places for the name of an arrow ``(k, 2)``: beyond its tip, then beside it, then farther away."""
    x, y = tip - start
    direction = math.atan2(y, x) if math.hypot(x, y) > 1e-6 else -0.5 * math.pi
    turned = direction + _TURNS
    ways = np.stack([np.cos(turned), np.sin(turned)], axis=1)
    return np.concatenate([tip + far * ways for far in (off, 1.6 * off, 2.4 * off, 3.2 * off)])


def along(start: Array, end: Array, half: float, off: float) -> Array:
    """Places for the length of a line ``(k, 2)``: beside its middle, then beside other points of it.

    half: half the width of the word, which a line that is not level has to be away from.
    """
    way = end - start
    size = float(np.hypot(*way))
    across = np.array([-way[1], way[0]]) / size if size > 1e-6 else np.array([1.0, 0.0])
    if across[0] < 0.0:
        across = -across
    places = []
    for far in (1.0, 2.0, 3.5, 5.5, 8.0):
        reach = half * abs(across[0]) + far * off
        for share in (0.5, 0.3, 0.7, 0.1, 0.9):
            places += [start + share * way + side * reach * across for side in (1.0, -1.0)]
    return np.array(places)


def covered(points: Array, width: float) -> Array:
    """Rows (x, y, width, height) of small boxes ``(k, 4)`` along a line through points ``(n, 2)``."""
    rows = []
    for start, end in pairwise(points):
        share = np.linspace(0.0, 1.0, 2 + int(np.hypot(*(end - start)) / _STEP))[:, None]
        rows.append(start + share * (end - start))
    at = np.concatenate(rows)
    return np.concatenate([at, np.full_like(at, width)], axis=1)


def placed(labels: Sequence[Label], taken: Array, page: Array) -> list[Array]:
    """The middle of each label ``(2,)``: the first place that is free, or the one that covers least.

    Args:
        taken: middle and size of what is there already ``(k, 4)``.
        page: width and height, which no label leaves ``(2,)``.
    """
    out: list[Array] = []
    for label in labels:
        half = 0.5 * label.room + 1.0
        places = np.clip(label.places, half, page - half)
        over = 0.5 * (label.room + taken[:, 2:]) + GAP - np.abs(places[:, None] - taken[:, :2])
        lost = np.maximum(over, 0.0).prod(axis=-1).sum(axis=1)
        best = places[int(np.argmin(lost))]  # the first of equal ones
        taken = np.concatenate([taken, [[*best, *label.room]]])
        out.append(best)
    return out
