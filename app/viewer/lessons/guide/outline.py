"""What a lesson teaches and asks: its goal, its steps with their predictions, and the check at its end.

An outline is made for one arm, in the reader's units. All numbers are computed from `kin` for that arm; values are
in radians, metres and SI units.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from markupsafe import Markup

from app.exercises.questions import (
    LEAST,
    WHOLE,
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
from kin.units import PLAIN

__all__ = [
    "LEAST",
    "PLAIN",
    "WHOLE",
    "Choice",
    "Configuration",
    "Mistake",
    "Number",
    "Option",
    "Outline",
    "Question",
    "Step",
    "Way",
    "apart",
    "count",
    "one_right",
    "two_percent",
]

Configuration = tuple[float, ...]


@dataclass(frozen=True)
class Step:
    """One step of a lesson.

    Attributes:
        text: what to do or to know.
        question: the prediction that is asked before `shown`.
        shown: what is revealed after a right answer, or on request; on paper too, among the solutions.
        start: the configuration that the step is about; a button moves the arm there.
        end: the configuration to which the arm moves when the answer is revealed.
        practice: what to see or to do on the page then, in words that follow `shown`.
        figure: a figure that belongs to `shown`.
    """

    title: str
    text: str
    question: Question | None = None
    shown: str = ""
    start: Configuration | None = None
    end: Configuration | None = None
    practice: str = ""
    figure: Markup | None = None


@dataclass(frozen=True)
class Outline:
    """The goal of a lesson in one sentence, its steps in order, and the questions of its check."""

    goal: str
    steps: tuple[Step, ...]
    check: tuple[Question, ...]

    def questions(self) -> Iterator[tuple[str, Question]]:
        """Every question with its key: the number of its step, or c and its number in the check."""
        for number, step in enumerate(self.steps, 1):
            if step.question is not None:
                yield str(number), step.question
        for number, question in enumerate(self.check, 1):
            yield f"c{number}", question
