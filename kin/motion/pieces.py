"""The pieces that a motion is made of: each knows the joints as functions of the time since its beginning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kin.motion import scurve
from kin.transforms import Array

# Where peaks are looked for between two breaks: close to both ends, where an acceleration may jump, and between.
LOOK = np.array([1e-9, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0 - 1e-9])


class Piece(Protocol):
    """A part of a motion."""

    @property
    def duration(self) -> float:
        """Seconds."""
        ...

    def at(self, times: Array) -> Array:
        """Joint values and their first three derivatives ``(4, k, n)`` at times ``(k,)`` in [0, duration]."""
        ...

    def grid(self) -> Array:
        """Times at which to look for peaks."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """The arm at rest at q ``(n,)``."""

    q: Array
    duration: float

    def at(self, times: Array) -> Array:
        """As in `Piece`."""
        out = np.zeros((4, len(times), len(self.q)))
        out[0] = self.q
        return out

    def grid(self) -> Array:
        """As in `Piece`."""
        return np.array([0.0, self.duration])


@dataclass(frozen=True, slots=True, eq=False)
class JointMotion:
    """Each joint by itself, as cubic polynomials: `breaks` ``(n, 8)``, `pieces` ``(n, 7, 4)``.

    All of a PTP asks this class for durations and motions: what profile it has is known to `between` alone.
    """

    breaks: Array
    pieces: Array

    @classmethod
    def between(cls, start: Array, end: Array, limits: Array) -> JointMotion:
        """The fastest motion from rest to rest, all joints together: ``(n,)`` each, limits ``(n, 3)``."""
        breaks, pieces = np.empty((len(start), scurve.PHASES + 1)), np.empty((len(start), scurve.PHASES, 4))
        scurve.synchronised(start, end, limits, breaks, pieces)
        return cls(breaks, pieces)

    @property
    def duration(self) -> float:
        """Seconds."""
        return float(self.breaks[0, -1])

    def at(self, times: Array) -> Array:
        """As in `Piece`."""
        return scurve.at(self.breaks, self.pieces, times)

    def grid(self) -> Array:
        """As in `Piece`."""
        breaks = np.unique(self.breaks)
        return look_between(breaks)


def look_between(breaks: Array) -> Array:
    """Times at which to look for peaks between rising breaks ``(k,)``."""
    return np.asarray(breaks[:-1, None] + np.diff(breaks)[:, None] * LOOK).ravel()
