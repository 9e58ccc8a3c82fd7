"""What a lesson teaches and asks: its goal, its steps with their predictions, and the check at its end.

An outline is made for one arm, in the reader's units. All numbers are computed from `kin` for that arm; values are
in radians, metres and SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from markupsafe import Markup

from app.exercises.lesson_text import LessonText
from app.exercises.questions import (
    LEAST,
    Choice,
    Mistake,
    Number,
    Option,
    Question,
    Way,
    apart,
    count,
    one_right,
    two_percent,
)
from kin import Robot
from kin.axes import perpendicular_to
from kin.transforms import Array
from kin.units import PLAIN

__all__ = [
    "LEAST",
    "PLAIN",
    "Bar",
    "Choice",
    "Configuration",
    "Cosine",
    "Drawn",
    "Ghost",
    "Lead",
    "Leads",
    "Mistake",
    "Number",
    "Option",
    "Outline",
    "Path",
    "Pose",
    "Question",
    "SemiAxis",
    "Step",
    "Triad",
    "Way",
    "apart",
    "count",
    "one_right",
    "two_percent",
]

Configuration = tuple[float, ...]
Answered = Callable[[object, bool, bool], Markup]  # of an answer, whether it is right, and a right one is on show


@dataclass(frozen=True)
class Pose:
    """What the scene shows while a step is open. All its numbers, in words, figures and questions, are of it.

    Attributes:
        q: the configuration ``(n,)``.
        target: the target's position (m) and quaternion w, x, y, z; None: it follows the tool.
        drawing: settings of the lesson, by their names in links; the others stay.
    """

    q: Configuration
    target: tuple[float, ...] | None = None
    drawing: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawn:
    """How a wrong joint value is drawn: a copy of the arm that has it, beside the arm on show.

    Attributes:
        q: the configuration ``(n,)`` of the copy, apart from this joint.
        joint: the index of the joint.
        sense, offset: a typed value is sense · joint value + offset.
    """

    q: Configuration
    joint: int
    sense: float = 1.0
    offset: float = 0.0

    def at(self, value: float) -> Configuration:
        """The configuration with a typed value (rad or m)."""
        own = self.sense * (value - self.offset)
        return tuple(own if i == self.joint else other for i, other in enumerate(self.q))


@dataclass(frozen=True)
class Bar:
    """How a length, or a speed as the way in a second, is drawn: as a bar that is as long.

    Attributes:
        start: where it begins, ``(3,)`` (m).
        end: where the right one leads; only the direction counts.
        scale: how long it is in the scene (m) for 1 m or 1 m/s.
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    scale: float = 1.0


@dataclass(frozen=True)
class SemiAxis:
    """How a length, or a speed, is drawn: as a semi-axis of an ellipsoid whose others are known.

    Attributes:
        center: the centre ``(3,)`` (m).
        axes: unit vectors along the axes as rows ``(3, 3)``; the last one is asked for.
        others: the lengths of the first two, in the unit of the answer; 0 of a flat one.
        scale: how long it is in the scene (m) for 1 m or 1 m/s.
    """

    center: tuple[float, ...]
    axes: tuple[tuple[float, ...], ...]
    others: tuple[float, float]
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Cosine:
    """How an entry of a rotation is drawn: as the direction that has it as the cosine of its angle to an axis.

    Attributes:
        start: where the direction is drawn from, ``(3,)`` (m).
        axis: the axis, a unit vector ``(3,)``.
        right: the direction with the right entry, as `axis`; the others lie in the plane of both.
        length: how long it is drawn (m).
    """

    start: Array
    axis: Array
    right: Array
    length: float

    def at(self, entry: float) -> Bar | None:
        """The direction with a typed entry; None: no cosine is so large."""
        if abs(entry) > 1.0 + 1e-9:
            return None
        across = self.right - (self.right @ self.axis) * self.axis
        size = float(np.linalg.norm(across))
        across = across / size if size > 1e-9 else perpendicular_to(self.axis)
        way = entry * self.axis + math.sqrt(max(0.0, 1.0 - entry * entry)) * across
        return Bar(tuple(self.start.tolist()), tuple((self.start + self.length * way).tolist()))


@dataclass(frozen=True)
class Ghost:
    """An option that leads the arm to a configuration ``(n,)``: a copy of it is drawn there."""

    q: Configuration


@dataclass(frozen=True)
class Path:
    """An option that leads along points ``(k, 3)`` (m)."""

    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Triad:
    """An option that leads a frame to a pose ``(4, 4)``, by rows; its axes are drawn with this length (m)."""

    T: tuple[tuple[float, ...], ...]
    length: float


Lead = Bar | Ghost | Path | Triad


@dataclass(frozen=True)
class Leads:
    """Where the options of a choice lead, in their order; None: this one leads nowhere."""

    options: tuple[Lead | None, ...]


@dataclass(frozen=True)
class Step:
    """One step of a lesson. Opening it brings the scene to its pose, as one step of undo.

    Attributes:
        text: what to do or to know.
        question: the prediction that is asked before `shown`.
        shown: what is revealed after a right answer, or on request; on paper too, among the solutions.
        pose: what it is about; None: the pose of the outline.
        end: what the scene shows when the answer is revealed.
        practice: what to see or to do on the page then, in words that follow `shown`.
        figure: a figure that belongs to `shown`.
        drawn: what the scene shows of an answer, beside what it shows anyway.
        estimate: what is asked before the question, and answered by looking.
        guessed: how its answer is drawn, as `drawn`.
        answered: a figure of the last answer, which also has the right one once it is on show.
        arms: ids of the arms of the library that it is asked about; empty: those of the lesson.
        about: the arm of its question, if that is another one than that of the outline.
        offer: what a button below the words does, by `Lesson.on_offer`, as its label; "": there is none.
        withheld: facts that nothing in the page shows while the question is open:
            names of `app.viewer.activity.activity.FACTS`.
        at: its place in the file, which it has for every arm.
    """

    title: str
    text: str
    question: Question | None = None
    shown: str = ""
    pose: Pose | None = None
    end: Pose | None = None
    practice: str = ""
    figure: Markup | None = None
    withheld: frozenset[str] = frozenset()
    drawn: Drawn | Bar | SemiAxis | Cosine | Leads | None = None
    estimate: Question | None = None
    guessed: Leads | None = None
    answered: Answered | None = None
    arms: tuple[str, ...] = ()
    about: Robot | None = None
    offer: str = ""
    at: str = ""


@dataclass(frozen=True)
class Outline:
    """The goal of a lesson in one sentence, its steps in order, and the questions of its check.

    Attributes:
        withheld: for each question of the check, as in `Step`; what is left out withholds nothing.
        pose: what the scene shows during the check, and where a step has no pose of its own.
        text: whose words these are; None: the lesson has no file.
        unfit: whether the words of another file are wanted, which cannot be asked about this arm.
    """

    goal: str
    steps: tuple[Step, ...]
    check: tuple[Question, ...]
    withheld: tuple[frozenset[str], ...] = ()
    pose: Pose | None = None
    text: LessonText | None = None
    unfit: bool = False

    def pose_of(self, at: int) -> Pose | None:
        """What the scene shows for the step of this index, or during the check if there is none."""
        step = self.steps[at] if at < len(self.steps) else None
        return self.pose if step is None or step.pose is None else step.pose

    def step_like(self, other: Outline, at: int) -> int:
        """The index of the step that has the title of another outline's: the nearest one, or that of its check."""
        if at == len(other.steps):
            return len(self.steps)
        alike = [i for i, step in enumerate(self.steps) if step.title == other.steps[at].title]
        return min(alike, key=lambda i: abs(i - at), default=min(at, len(self.steps)))

    def questions(self) -> Iterator[tuple[str, Question]]:
        """Every question with its key: the number of its step, e and this number for an estimate, or c and its
        number in the check."""
        for number, step in enumerate(self.steps, 1):
            if step.estimate is not None:
                yield f"e{number}", step.estimate
            if step.question is not None:
                yield str(number), step.question
        for number, question in enumerate(self.check, 1):
            yield f"c{number}", question
