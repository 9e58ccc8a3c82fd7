"""Motions of the arm along waypoints, frame by frame, as a `Sweep` of a feature carries them on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np

from app.viewer.arm import Arm
from app.viewer.panel.joints import label
from app.viewer.panel.status import Notice
from kin.transforms import Array

FRAME = 1 / 30  # s
FASTEST = 0.5  # rad/s or m/s of the quickest joint
_STEP = 0.004  # rad or m between waypoints of straight motions
_MOVES = 1e-6  # rad or m


@dataclass(frozen=True, eq=False)
class Drive:
    """How far a motion has come; at the waypoints alone the tool is where it should be.

    Attributes:
        q: the waypoints ``(k, n)``.
        passed: the one at which the arm is.
    """

    q: Array
    passed: int = 0

    @classmethod
    def straight(cls, corners: Array) -> Self:
        """All joints move on straight lines between corners ``(c, n)``."""
        parts = [corners[:1]]
        for a, b in pairwise(corners):
            count = max(1, math.ceil(float(np.abs(b - a).max()) / _STEP))
            parts.append(np.linspace(a, b, count + 1)[1:])
        return cls(np.concatenate(parts))

    @property
    def here(self) -> Array:
        """The configuration ``(n,)`` at which the arm is."""
        return np.asarray(self.q[self.passed])

    @property
    def arrived(self) -> bool:
        """Whether the arm is at the last waypoint."""
        return self.passed == len(self.q) - 1

    def after(self, seconds: float) -> Self:
        """The same so many seconds later: whole waypoints, one at least."""
        covered = np.cumsum(np.abs(np.diff(self.q[self.passed :], axis=0)).max(axis=1))
        more = max(int(np.searchsorted(covered, FASTEST * seconds, side="right")), 1)
        return replace(self, passed=min(self.passed + more, len(self.q) - 1))


def locked(arm: Arm, q: Array) -> Notice | None:
    """What keeps an arm from going from where it is to waypoints ``(k, n)``: a locked joint; None: nothing."""
    moves = np.ptp(np.vstack([arm.goal, q]), axis=0) > _MOVES  # also of a joint that comes back
    held = [label(arm.robot, i) for i, lock in enumerate(arm.locks) if lock and moves[i]]
    return Notice("limits", "Not moved: a joint is locked", f"Unlock {held[0]} first.") if held else None
