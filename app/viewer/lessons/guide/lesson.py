"""A lesson: a feature that says what it teaches and asks."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import ClassVar

from app.exercises import ExerciseFileError
from app.exercises.lesson_text import LessonText
from app.exports.worksheet import Formula, Left
from app.viewer.feature import Feature
from app.viewer.lessons.guide.content import AskedFacts, LessonFacts, outline_of
from app.viewer.lessons.guide.example import example_of
from app.viewer.lessons.guide.outline import Outline, Question, Step
from app.viewer.lessons.guide.progress import Progress
from kin import Robot, get_robot
from kin.units import DEFAULT_UNITS, Units

VERIFIED = DEFAULT_UNITS, Units(degrees=False, length="m")

log = logging.getLogger("kinboard.lessons")


class Lesson(Feature):
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
        return self.stage.arm.now.goal.tolist()

    @staticmethod
    def asked_of(robot: Robot, units: Units) -> LessonFacts | AskedFacts:
        """What the words and questions of its file may use of an arm, in the reader's units."""
        raise NotImplementedError

    @classmethod
    def outline(cls, robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
        """Goal, steps and check for this arm, which the file names for them.

        Args:
            text: None: that of its own file.

        It is made again for each arm and unit while the visitor waits. So what needs inverse kinematics is kept
        for the arm: without a closed form, a target that is missed takes some tenths of a second.
        """
        return outline_of(cls.key, robot, units, cls.asked_of(robot, units), text)

    @classmethod
    def outline_in(cls, robot: Robot, units: Units, text: LessonText | None) -> Outline:
        """The outline in the words of a text; where that is not made for this arm, in those of its own file."""
        try:
            return cls.asked(robot, units, text)
        except ValueError as error:
            if text is None:
                raise
            log.warning("the words of a lesson are left out: %s", error, extra={"kind": text.file})
            return replace(cls.asked(robot, units), unfit=True)

    @classmethod
    def verify(cls, text: LessonText) -> None:
        """Make and judge all questions of a text about each of its arms, and its example, in two sets of units.

        Raises:
            ExerciseFileError: naming the file, the field and the arm.
        """
        for robot, units in product(map(get_robot, text.every_arm), VERIFIED):
            try:
                example_of(text.example, units)
                for key, question in cls.asked(robot, units, text).questions():
                    if not question.judge(question.right()).right:
                        raise ValueError(f"the right answer to question {key} is not accepted")
            except ExerciseFileError:
                raise
            except ValueError as error:
                valid = f"questions that can be asked about the arm “{robot.name}”"
                raise ExerciseFileError(text.file, "steps", str(error), valid) from None

    @property
    def labels(self) -> Mapping[str, str]:
        text = self.stage.activity.text(self.key)
        return {} if text is None else text.controls

    @classmethod
    def asked(cls, robot: Robot, units: Units, text: LessonText | None = None) -> Outline:
        """The outline for an arm that the file names, with the steps that are asked about others."""
        return cls.completed(cls.outline(robot, units, text), robot, units)

    @classmethod
    def completed(cls, found: Outline, robot: Robot, units: Units) -> Outline:
        """An outline for this arm with the steps that are asked about others.

        Raises:
            ValueError: the file leaves a step out for the arm that it is asked about.
        """
        steps, others = list[Step](), dict[str, Outline]()
        for step in found.steps:
            if step.arms and robot.id not in step.arms:
                arm = step.arms[0]
                other = others[arm] = others.get(arm) or cls.outline(get_robot(arm), units, found.text)
                there = next((each for each in other.steps if each.at == step.at), None)
                if there is None:
                    raise ValueError(f"{step.at}when leaves out the step “{step.title}” for its arm {arm}")
                steps.append(replace(there, about=get_robot(arm), pose=there.pose or other.pose))
            else:
                steps.append(step)
        return replace(found, steps=tuple(steps))

    def formulas(self) -> tuple[Formula, ...]:
        """The equations of its worksheet."""
        return ()
