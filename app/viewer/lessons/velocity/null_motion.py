"""The motion of the lesson "Velocity": the joints move by q̇ = J⁺v + (I − J⁺J) z, frame by frame."""

from __future__ import annotations

import numpy as np

from app.viewer.drive import FASTEST
from app.viewer.lessons.velocity.facts import VelocityFacts
from app.viewer.lessons.velocity.settings import SPEEDS
from app.viewer.null_space import hold
from app.viewer.panel.status import Notice
from kin.transforms import Array

STILL = 1e-3  # of z in the null space: the goal is as good as it gets
MOVING = Notice("reached", "Null space", "The joints move; the tool does only what v says.")
BEST = Notice("reached", "The best place is reached", "z has no part in the null space any more.")
ENDS = Notice("limits", "The motion ends", "A joint is at its limit, or a singularity is reached.")


def after(q: Array, T: Array, facts: VelocityFacts, seconds: float) -> tuple[Array, Array] | Notice:
    """The motion from q ``(n,)``, whose pose is T ``(4, 4)``, so many seconds later; or why it ends.

    Settings are those of the facts.
    """
    robot, there = facts.robot, facts.at(q)
    _, by_v, own = there.speeds
    v, fast = SPEEDS[facts.settings.speed], float(np.abs(own).max())
    if fast < STILL and not v.any():
        return BEST
    T = T.copy()
    T[:3, 3] += seconds * v
    found = hold(robot, q + seconds * (by_v + own * min(1.0, FASTEST / max(fast, 1e-12))), T, there.task)
    if found is None or (found < robot.lower).any() or (found > robot.upper).any():
        return ENDS
    return found, T
