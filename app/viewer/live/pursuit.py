"""A recording that a driven arm repeats: it waits wherever the arm is behind what is commanded."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from kin import Robot
from kin.transforms import Array

NEAR: Final = np.radians(5.0)  # rad (for slides: m / 10) that a joint may be behind while the recording goes on
CLOSER: Final = np.radians(0.5)  # by which an arm that is on its way comes closer
RESTS: Final = 2.0  # s without that after which it is not waited for: a limit of its own, or a weak motor


class Pursuit:
    """How closely an arm follows the recording.

    Attributes:
        begun: whether the arm has been where the recording begins: for that, it is waited for however long.
    """

    def __init__(self, robot: Robot) -> None:
        self._size = np.where(robot.revolute, 1.0, 0.1)
        self.begun = False
        self._allowed, self._least, self._rested = NEAR, math.inf, 0.0

    def goes_on(self, commanded: Array, measured: Array, seconds: float) -> bool:
        """Whether the recording goes on, so many seconds after it was last asked.

        Args:
            commanded: where the arm is to be ``(n,)``.
            measured: where it is ``(n,)``.
        """
        gap = float(np.max(np.abs(commanded - measured) / self._size))
        if gap < self._least - CLOSER:
            self._least, self._rested = gap, 0.0
        else:
            self._rested += seconds
        if gap <= NEAR:
            self._allowed = NEAR
        elif self.begun and self._rested >= RESTS:
            self._allowed = gap + CLOSER
        if gap > self._allowed:
            self._allowed = NEAR
            return False
        self.begun = True
        self._least, self._rested = math.inf, 0.0
        return True
