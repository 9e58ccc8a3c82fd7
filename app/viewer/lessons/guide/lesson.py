"""A lesson: a feature that says what it teaches and asks."""

from __future__ import annotations

from abc import ABC, abstractmethod

from app.viewer.feature import Feature
from app.viewer.lessons.guide.outline import Outline
from kin import Robot
from kin.units import Units


class Lesson(Feature, ABC):
    """A feature of the tab *Learn*. The page shows its outline above its controls."""

    @staticmethod
    @abstractmethod
    def outline(robot: Robot, units: Units) -> Outline:
        """Goal, steps and check for this arm.

        It is made again for each arm and unit while the visitor waits. So what needs inverse kinematics is kept
        for the arm: without a closed form, a target that is missed takes some tenths of a second.
        """
