"""What the exercises of a page say to a room, and what a course says to them."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from app.exercises import Exercise, Verdict


class Judged(NamedTuple):
    """An answer that was judged: the seed of its numbers, the answer as plain data, and how long (s) it took."""

    exercise: Exercise
    seed: int
    answer: object
    verdict: Verdict
    seconds: float


class GivenUp(NamedTuple):
    """The answer of an exercise is to be shown: the seed of its numbers, and after how long (s)."""

    exercise: Exercise
    seed: int
    seconds: float


class Lead(Protocol):
    """The course of the page, as far as exercises care."""

    def reveals(self, exercise_id: str) -> bool:
        """Whether the answer of an exercise may be shown to who has not found it."""

    def leads(self, exercise_id: str) -> bool:
        """Whether the course says what comes after an exercise."""

    def refresh(self) -> None:
        """The marks have changed."""
