"""The row, the bar and the list of *Review* as HTML."""

from __future__ import annotations

from dataclasses import dataclass

from app.exercises import Exercises
from app.viewer.activity.review import INTERVALS, Missed, Review
from app.viewer.lessons import LESSONS
from app.viewer.views.templates import render


@dataclass(frozen=True)
class Counts:
    """How much is due today, how much later, and in how many days the next of these is."""

    due: int
    later: int
    days: int

    @classmethod
    def of(cls, review: Review, exercises: Exercises) -> Counts:
        """The counts of a list, of what this service has."""
        due, later = (known(rows, exercises) for rows in (review.due, review.later))
        return cls(len(due), len(later), later[0].due - review.today if later else 0)

    @property
    def words(self) -> str:
        """As a sentence."""
        if not self.due and not self.later:
            return "Nothing yet. What you miss in lessons and exercises is asked again from the next day on."
        later = f"{self.later} later, the first {when(self.days)}." if self.later else ""
        if not self.due:
            return f"Nothing today; {later}"
        return f"{self.due} to answer today{f'; {later}' if later else '.'}"


def when(days: int) -> str:
    """``tomorrow``, ``in 3 days``."""
    return "tomorrow" if days == 1 else f"in {days} days"


def row_html(title: str, counts: Counts, seated: bool) -> str:
    """The row in the overview of the tab, below what leads back to where the browser was left.

    Args:
        seated: as in `list_html`; its seat knows how far it is.
    """
    return render("review/row", title=title, counts=counts, seated=seated)


def bar_html(counts: Counts) -> str:
    """The bar above a lesson that was opened for one of its questions."""
    return render("review/bar", counts=counts)


def list_html(review: Review, exercises: Exercises, seated: bool) -> str:
    """What is due, and what comes later.

    Args:
        seated: whether this is a student's page in a room.
    """
    due, later = (known(rows, exercises) for rows in (review.due, review.later))
    rows = [{"key": one.key, "title": _title(one, exercises), "stage": one.stage} for one in due]
    others = [{"title": _title(one, exercises), "when": when(one.due - review.today)} for one in later]
    return render(
        "review/list", due=rows, later=others, days=INTERVALS, seated=seated, counts=Counts.of(review, exercises)
    )


def known(rows: list[Missed], exercises: Exercises) -> list[Missed]:
    """What this service has of a list."""
    lessons = {lesson.key for lesson in LESSONS}
    return [one for one in rows if one.lesson in lessons or exercises.get(one.key) is not None]


def _title(one: Missed, exercises: Exercises) -> str:
    lesson = next((lesson for lesson in LESSONS if lesson.key == one.lesson), None)
    if lesson is None:
        exercise = exercises.get(one.key)
        return one.key if exercise is None else exercise.title
    where = f"check, question {one.question[1:]}" if one.question.startswith("c") else f"step {one.question}"
    return f"{lesson.title}: {where}"
