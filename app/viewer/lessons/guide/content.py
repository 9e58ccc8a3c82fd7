"""A lesson's texts and the facts that it computes for an arm, put together to its outline."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from markupsafe import Markup

from app.exercises.expressions import Expression, Function
from app.exercises.fields import ExerciseFileError
from app.exercises.kinds.choice import ChoiceKind
from app.exercises.lesson_text import (
    NO_PREVIEW,
    BarText,
    LessonText,
    QuestionText,
    StepText,
    texts_of,
)
from app.exercises.variant import Quantity, Variant
from app.viewer.lessons.guide.outline import (
    Answered,
    Bar,
    Cosine,
    Drawn,
    Lead,
    Leads,
    Outline,
    Pose,
    Question,
    SemiAxis,
    Step,
)
from kin import Robot, fk, get_robot
from kin.units import Units

T = TypeVar("T")


@dataclass(frozen=True)
class LessonFacts:
    """What the texts of a lesson may use of an arm; the names are those that its file declares.

    Attributes:
        numbers: values in radians, metres and SI units; one with a measure is written in the reader's units.
        functions: of numbers, such as those of joints, which count from 1.
        words: texts, in the reader's units.
        poses: those that steps are about. A step that names none has the pose "home".
        figures: those that are shown with an answer.
        answered: figures of an answer, by the names that steps give.
        leads: where options of choices lead, by the names that questions give; None: nowhere on this arm.
        shapes: as which answers are drawn, such as a semi-axis of an ellipsoid.
    """

    numbers: Mapping[str, float | Quantity]
    functions: Mapping[str, Function] = field(default_factory=dict)
    words: Mapping[str, str] = field(default_factory=dict)
    poses: Mapping[str, Pose] = field(default_factory=dict)
    figures: Mapping[str, Markup] = field(default_factory=dict)
    leads: Mapping[str, Lead | None] = field(default_factory=dict)
    answered: Mapping[str, Answered] = field(default_factory=dict)
    shapes: Mapping[str, SemiAxis | Cosine] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class AskedFacts:
    """The facts of a lesson's file as attributes of a class: its public properties, and its methods of numbers.

    The docstring of each says what it is; nothing lists them again (`app.exercises.lesson_text.facts_of`). Numbers
    are in radians, metres and SI units, texts in the reader's units.
    """

    robot: Robot
    units: Units

    @property
    def poses(self) -> Mapping[str, Pose]:
        """As in `LessonFacts`."""
        return {}

    @property
    def leads(self) -> Mapping[str, Lead | None]:
        """As in `LessonFacts`."""
        return {}

    def listed(self, names: Iterable[str]) -> LessonFacts:
        """Those of these names."""
        found = {name: getattr(self, name) for name in names}
        words = {name: value for name, value in found.items() if isinstance(value, str)}
        functions = {name: value for name, value in found.items() if callable(value)}
        rest = {name: value for name, value in found.items() if name not in {*words, *functions}}
        numbers = {name: x if isinstance(x, Quantity) else float(x) for name, x in rest.items()}
        return LessonFacts(numbers, functions, words, self.poses, leads=self.leads)


def arm_for(text: LessonText | None, robot: Robot) -> Robot:
    """The arm that a lesson asks about while this one is on show: itself if the file names it, else the first."""
    arms = (robot.id,) if text is None else text.arms
    return robot if robot.id in arms else get_robot(arms[0])


def outline_of(
    lesson: str, robot: Robot, units: Units, facts: LessonFacts | AskedFacts, text: LessonText | None = None
) -> Outline:
    """The outline of a lesson.

    Steps and check that the file asks about other arms are left empty.

    Args:
        text: None: that of the lesson's own file.

    Raises:
        ExerciseFileError: the text names what the facts do not have, or something in it has no value for this arm.
    """
    text = text or texts_of(lesson)
    if isinstance(facts, AskedFacts):
        facts = facts.listed(text.facts)
    try:
        return _outline(lesson, robot, units, facts, text)
    except ExerciseFileError:
        raise
    except ValueError as error:  # such as an expression, or a choice without a right option
        field = getattr(error, "field", "") or "steps"
        valid = f"what has a value for the arm “{robot.name}”"
        raise ExerciseFileError(text.file, field, str(error), valid) from None


def _outline(lesson: str, robot: Robot, units: Units, facts: LessonFacts, text: LessonText) -> Outline:
    names = {*facts.numbers, *facts.functions, *facts.words}
    if missing := sorted(text.facts.keys() - names):
        raise ExerciseFileError(text.file, "facts", missing[0], f"one of {', '.join(sorted(names))}")
    values = {name: x if isinstance(x, Quantity) else Quantity(x) for name, x in facts.numbers.items()}
    first = Variant(lesson, robot, robot.q_home, values, None, facts.functions, facts.words)
    words = {name: first.text(alias, units) for name, alias in text.words.items()}
    variant = Variant(lesson, robot, robot.q_home, values, None, facts.functions, {**facts.words, **words})
    made = _Maker(text.file, variant, units, facts)
    steps = tuple(
        made.step(step) if robot.id in (step.arms or text.arms) else made.elsewhere(step)
        for step in text.steps
        if made.holds(step.when)
    )
    check = [one for one in map(made.first, text.check if robot.id in text.arms else ()) if one is not None]
    return Outline(
        variant.text(text.goal, units),
        steps,
        tuple(made.question(one) for one in check),
        tuple(one.withheld for one in check),
        facts.poses.get("home"),
        text,
    )


@dataclass(frozen=True, eq=False)
class _Maker:
    """Makes values of texts for one arm."""

    file: str
    variant: Variant
    units: Units
    facts: LessonFacts

    def holds(self, when: Expression) -> bool:
        return bool(self.variant.number(when))

    def first(self, alternatives: tuple[QuestionText, ...]) -> QuestionText | None:
        return next((one for one in alternatives if self.holds(one.when)), None)

    def question(self, text: QuestionText) -> Question:
        return text.kind.ask(self.variant.text(text.prompt, self.units), self.variant, self.units)

    def named(self, field: str, name: str, offered: Mapping[str, T]) -> T | None:
        """What the lesson has of this name; None for no name."""
        if name and name not in offered:
            raise ExerciseFileError(self.file, field, name, f"one of {', '.join(sorted(offered))}")
        return offered.get(name)

    def leads(self, text: QuestionText | None) -> Leads | None:
        """Where the options lead that are offered for this arm."""
        if text is None or not text.leads or not isinstance(text.kind, ChoiceKind):
            return None
        names = [
            name
            for name, each in zip(text.leads, text.kind.options, strict=True)
            if self.variant.number(each.offered)
        ]
        known = {**self.facts.leads, NO_PREVIEW: None}
        return Leads(tuple(self.named(f"{text.at}leads", name, known) for name in names))

    def drawn(self, text: StepText, asked: QuestionText | None) -> Drawn | Bar | SemiAxis | Cosine | Leads | None:
        """How answers to a step are drawn."""
        if (leads := self.leads(asked)) is not None:
            return leads
        match text.drawn:
            case BarText():
                start = self._point(text, text.drawn.start)
                return Bar(start, self._point(text, text.drawn.end), self.variant.number(text.drawn.scale))
            case (name, joint):
                return self._joint(text.at, name, joint)
            case str(name):
                return self.named(f"{text.at}drawn.shape", name, self.facts.shapes)
        return None

    def _point(self, text: StepText, given: str | tuple[Expression, ...]) -> tuple[float, ...]:
        """A point ``(3,)``: of the arm at the pose of the step, or of the lesson."""
        pose = self.named(f"{text.at}pose", text.pose or "home", self.facts.poses)
        assert pose is not None
        if given == "end":
            pose = self.named(f"{text.at}end", text.end, self.facts.poses) or pose
        if given == "target" and "target" in pose.drawing:
            return tuple(np.reshape(np.array(pose.drawing["target"], float), (4, 4))[:3, 3].tolist())
        if isinstance(given, str):
            return tuple(fk(self.variant.robot, np.array(pose.q))[:3, 3].tolist())
        there = replace(self.variant, q=np.array(pose.q))
        return tuple(there.number(each) for each in given)

    def _joint(self, at: str, name: str, joint: int) -> Drawn:
        """How a wrong value of a joint is drawn, which counts from 1."""
        pose = self.named(f"{at}drawn.pose", name, self.facts.poses)
        if pose is None or joint > len(pose.q):
            raise ExerciseFileError(self.file, f"{at}drawn.joint", joint, "a joint of the arm")
        return Drawn(pose.q, joint - 1)

    def elsewhere(self, text: StepText) -> Step:
        """A step that is asked about other arms."""
        return Step(self.variant.text(text.title, self.units), "", arms=text.arms, at=text.at)

    def step(self, text: StepText) -> Step:
        asked, before = self.first(text.questions), self.first(text.estimate)
        title, body, shown, practice = (
            self.variant.text(one, self.units) for one in (text.title, text.text, text.shown, text.practice)
        )
        return Step(
            title,
            body,
            None if asked is None else self.question(asked),
            shown,
            self.named(f"{text.at}pose", text.pose, self.facts.poses),
            self.named(f"{text.at}end", text.end, self.facts.poses),
            practice,
            self.named(f"{text.at}figure", text.figure, self.facts.figures),
            withheld=frozenset() if asked is None else asked.withheld,
            drawn=self.drawn(text, asked),
            estimate=None if before is None else self.question(before),
            guessed=self.leads(before),
            answered=self.named(f"{text.at}answered", text.answered, self.facts.answered),
            arms=text.arms,
            at=text.at,
        )
