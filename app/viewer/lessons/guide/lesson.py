"""A lesson: a feature that says what it teaches and asks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from app.exports.worksheet import Formula, Left
from app.viewer.feature import Feature
from app.viewer.lessons.guide.outline import Outline, Question
from app.viewer.lessons.guide.progress import Progress
from kin import Robot
from kin.units import Units


class Lesson(Feature, ABC):
    """A feature of the tab *Learn*. The page shows its outline above its controls.

    After a change that concerns `on_steps`, call ``stage.activity.changed()``: the outline is shown again.

    Attributes:
        computes: whether it solves the pose, or has a scene of its own. Links do not open it for visitors who may
            only look.
        through: whether it says itself when the arm is transparent. Otherwise it is while an answer is drawn, so
            that the arm does not hide it.
        by_rows: whether it takes each moving row of the table for a joint, so that it is not for arms with rows
            that follow joints.
    """

    computes: ClassVar[bool] = True
    through: ClassVar[bool] = False
    by_rows: ClassVar[bool] = False

    @staticmethod
    def left(robot: Robot) -> Left:
        """What its worksheet leaves to the student besides the questions."""
        return "nothing"

    def on_steps(self, progress: Progress) -> Outline | None:
        """The steps are about to be shown, after an answer for example; returns another outline to go on with."""
        return None

    def on_offer(self) -> None:
        """The button that the step on show offers was pressed."""

    def driven(self, question: Question) -> object:
        """The answer to a question that is answered by driving the arm: by itself, where the arm is heading."""
        return self.stage.now.goal.tolist()

    @staticmethod
    @abstractmethod
    def outline(robot: Robot, units: Units) -> Outline:
        """Goal, steps and check for this arm.

        It is made again for each arm and unit while the visitor waits. So what needs inverse kinematics is kept
        for the arm: without a closed form, a target that is missed takes some tenths of a second.
        """

    def formulas(self) -> tuple[Formula, ...]:
        """The equations of its worksheet."""
        return ()
