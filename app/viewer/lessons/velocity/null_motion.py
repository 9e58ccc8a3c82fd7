"""The motion of the lesson "Velocity": the joints move by q̇ = J⁺v + (I − J⁺J) z, frame by frame."""

from __future__ import annotations

import numpy as np

import kin
from app.viewer.feature import Stage
from app.viewer.lessons.velocity.facts import VelocityFacts
from app.viewer.lessons.velocity.settings import SPEEDS
from app.viewer.panel.status import Notice
from kin.differential.null_space import hold
from kin.transforms import Array

FRAME = 1 / 30  # s
FASTEST = 0.5  # rad/s or m/s of the quickest joint of the self-motion
STILL = 1e-3  # of z in the null space: the goal is as good as it gets
MOVING = Notice("reached", "Null space", "The joints move; the tool does only what v says.")
BEST = Notice("reached", "The best place is reached", "z has no part in the null space any more.")
ENDS = Notice("limits", "The motion ends", "A joint is at its limit, or a singularity is reached.")


class NullMotion:
    """One motion, from where the arm is heading; another motion of the arm ends it."""

    def __init__(self, stage: Stage, now: float) -> None:
        self._stage = stage
        self._sent = stage.now.goal.copy()
        self._T, self._stepped = kin.fk(stage.now.robot, self._sent), now

    def step(self, facts: VelocityFacts, now: float) -> bool:
        """One frame of the motion, with the settings of these facts; returns whether it goes on."""
        stage, robot = self._stage, self._stage.now.robot
        if now - self._stepped < FRAME:
            return True
        if not np.array_equal(self._sent, stage.now.goal):
            return False
        seconds = min(now - self._stepped, 2.0 * FRAME)
        self._stepped = now
        there = facts.at(self._sent)
        _, by_v, own = there.speeds
        v, fast = SPEEDS[facts.settings.speed], float(np.abs(own).max())
        if fast < STILL and not v.any():
            stage.notify(BEST)
            return False
        T: Array = self._T.copy()
        T[:3, 3] += seconds * v
        found = hold(
            robot, self._sent + seconds * (by_v + own * min(1.0, FASTEST / max(fast, 1e-12))), T, there.task
        )
        if found is None or (found < robot.lower).any() or (found > robot.upper).any():
            stage.notify(ENDS)
            return False
        self._sent, self._T = found, T
        stage.move_to(found, MOVING, at_once=True)
        return True
