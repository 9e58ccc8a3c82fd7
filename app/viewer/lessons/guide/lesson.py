"""A lesson: a feature that says what it teaches and asks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import ClassVar

from app.exports.worksheet import Formula, Left
from app.viewer.feature import Feature
from app.viewer.lessons.guide.outline import Outline, Question, Step
from app.viewer.lessons.guide.progress import Progress
from kin import Robot, get_robot
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
        left: what its worksheet leaves to the student besides the questions.
    """

    computes: ClassVar[bool] = True
    through: ClassVar[bool] = False
    by_rows: ClassVar[bool] = False
    left: ClassVar[Left] = "nothing"

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
        """Goal, steps and check for this arm, which the file names for them.

        It is made again for each arm and unit while the visitor waits. So what needs inverse kinematics is kept
        for the arm: without a closed form, a target that is missed takes some tenths of a second.
        """

    @classmethod
    def asked(cls, robot: Robot, units: Units) -> Outline:
        """The outline for an arm that the file names, with the steps that are asked about others."""
        return cls.completed(cls.outline(robot, units), robot, units)

    @classmethod
    def completed(cls, found: Outline, robot: Robot, units: Units) -> Outline:
        """An outline for this arm with the steps that are asked about others."""
        steps, others = list[Step](), dict[str, Outline]()
        for step in found.steps:
            if step.arms and robot.id not in step.arms:
                arm = step.arms[0]
                other = others[arm] = others.get(arm) or cls.outline(get_robot(arm), units)
                there = next(each for each in other.steps if each.title == step.title)
                steps.append(replace(there, about=get_robot(arm), pose=there.pose or other.pose))
            else:
                steps.append(step)
        return replace(found, steps=tuple(steps))

    def formulas(self) -> tuple[Formula, ...]:
        """The equations of its worksheet."""
        return ()
