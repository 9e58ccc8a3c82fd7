"""Easing: the shown configuration glides to the solved one instead of jumping there.

A gizmo drag gives at most twenty solutions a second; a screen shows sixty frames. Between two solutions the shown
configuration moves along a straight line in joint space, fast first and slower towards the end, and ends *exactly*
on the solution. A new solution restarts from the shown configuration, so easing never delays a solve. In joint
space, every shown configuration is within the limits.
"""

from __future__ import annotations

import threading

import numpy as np

from kin.transforms import Array

FRAME = 1 / 60
SHORTEST = 0.05  # s from one browser event to the next: dragging then looks continuous
LONGEST = 0.6
SPEED = 6.0  # rad/s of the joint that travels furthest (weighted, for a prismatic joint)


class Motion:
    """The shown configuration as a function of time.

    Args:
        q: first configuration ``(n,)``.
        weights: radians per unit of each joint, so that metres and radians can share one speed.
    """

    def __init__(self, q: Array, weights: Array) -> None:
        self._weights = weights
        self._start = self._goal = np.array(q)
        self._begun = self._duration = 0.0
        self.moving = False

    @property
    def goal(self) -> Array:
        """The end ``(n,)`` of the motion."""
        return self._goal

    def aim(self, goal: Array, now: float, ease: bool = True) -> None:
        """Start a motion to `goal` from the configuration shown at time `now` (seconds)."""
        self._start = self.at(now)
        self._goal = np.array(goal)
        travel = float((np.abs(self._goal - self._start) * self._weights).max())
        self._duration = min(max(SHORTEST, travel / SPEED), LONGEST) if ease else 0.0
        self._begun = now
        self.moving = True

    def at(self, now: float) -> Array:
        """The configuration to show at time `now`; clears `moving` on arrival."""
        left = 1.0 - (now - self._begun) / self._duration if self._duration > 0 else 0.0
        if not self.moving or left <= 0.0:
            self.moving = False
            return self._goal
        return self._goal + (self._start - self._goal) * min(left, 1.0) ** 2


class Pace:
    """How often moving arms are redrawn; shared by all visitors of a server.

    A frame costs half a millisecond of processor time or more on its way from the solution to the visitor. Thirty
    visitors dragging at sixty frames a second would saturate a core and delay everybody. So visitors share a
    limited rate: a few get smooth easing, more get fewer frames, and beyond that each solution is shown at once.
    The numbers in the panel cost as much again and have a rate of their own.
    """

    def __init__(self, frames_per_second: float = 600.0, readings_per_second: float = 100.0) -> None:
        self._frames = frames_per_second
        self._readings = readings_per_second
        self._moving: set[int] = set()
        self._lock = threading.Lock()

    def moving(self, visitor: int, is_moving: bool) -> None:
        """Report whether this visitor's arm is moving, or may move because the visitor holds the gizmo."""
        if (visitor in self._moving) == is_moving:
            return
        with self._lock:
            (self._moving.add if is_moving else self._moving.discard)(visitor)

    @property
    def interval(self) -> float:
        """Seconds between two frames of one visitor."""
        return max(FRAME, len(self._moving) / self._frames)

    @property
    def reading(self) -> float:
        """Seconds between two updates of one visitor's numbers."""
        return max(SHORTEST, len(self._moving) / self._readings)

    @property
    def eases(self) -> bool:
        """Whether to ease; not if it would show less than one frame per event."""
        return self.interval < SHORTEST
