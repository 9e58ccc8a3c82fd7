"""*Review*: what was missed is asked again, with other numbers. ``static/lesson.js`` sends what is pressed there.

An exercise opens here, with numbers and marks of its own: those of the list of exercises, of a course and of a
room stay as they are. The question of a lesson opens in its lesson, on another of its arms.
"""

from __future__ import annotations

import random
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from app.exercises import Exercise, Verdict
from app.viewer.activity.activity import REVIEW
from app.viewer.activity.practice import MOST
from app.viewer.activity.review import Missed
from app.viewer.declared.fields import memory
from app.viewer.declared.panel import Html, Node
from app.viewer.exercises.feature import Practising, PractisingSettings
from app.viewer.exercises.views import Door, Following
from app.viewer.feature import Stage
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.feature import Guide
from app.viewer.review import views
from app.viewer.review.arms import other_arm
from kin import InputError

_DRAWS = 20  # seeds until the numbers are others


@dataclass(frozen=True)
class ReviewSettings(PractisingSettings):
    """The exercise that is asked again, and the lesson.

    Attributes:
        asked_in: the key of the lesson that was opened last, until it is left.
        arrived: whether it is open by now.
    """

    asked_in: str = memory("", renew=False)
    arrived: bool = memory(False, renew=False)


class Reviewing(Practising):
    """The list of what is due, or one exercise of it.

    Its row stands above the list of lessons, and its bar above a lesson that it has opened.
    """

    settings: ReviewSettings

    key = REVIEW
    title = "Review"
    about = "What you have missed, again with other numbers."
    door = Door(REVIEW, "Review", counts=False)
    settings_of = ReviewSettings
    messages = Practising.messages | {"next", "back"}

    def __init__(self, stage: Stage) -> None:
        self._review = stage.activity.review
        super().__init__(stage, stage.activity.asked_again)

    def panel(self) -> Sequence[Node]:
        activity, s = self.stage.activity, self.settings
        counts = views.Counts.of(self._review, activity.courses.exercises)
        bar = views.bar_html(counts) if s.asked_in and activity.lesson == s.asked_in else ""
        row = views.row_html(self.title, counts, activity.practice.seated) if activity.lesson is None else ""
        return [Html(str, (bar,), key="bar"), Html(str, (row,), key="row"), *super().panel()]

    # Events

    def heard(self, key: Hashable, value: object) -> None:
        match key:
            case ("next", int()):
                if (following := self._asked_next) is not None:
                    self.open(following.key)
            case ("back", int()):
                self._practice.close()
                self.stage.post("lesson", self.title)
            case _:
                super().heard(key, value)

    def open(self, exercise_id: object) -> None:
        """Ask something again: an exercise by its id, a question of a lesson by its key in the list."""
        missed = self._review.missed.get(exercise_id) if isinstance(exercise_id, str) else None
        if missed is not None and missed.lesson:
            self._open_question(missed)
            return
        exercise = self.stage.activity.courses.exercises.get(exercise_id)
        if exercise is None:
            raise InputError("review", exercise_id, "a row of the list")
        self._draw_numbers(exercise)
        super().open(exercise_id)

    def _draw_numbers(self, exercise: Exercise) -> None:
        """Other numbers than those of the list of exercises."""
        self._practice.records.clear()
        known = self.stage.activity.practice.variant(exercise).values
        for _ in range(_DRAWS):
            self._practice.seed = random.randrange(1, MOST)
            if not exercise.vary or self._practice.variant(exercise).values != known:
                break

    def _open_question(self, missed: Missed) -> None:
        """Open the lesson of a question, on another of its arms; its other answers there stay."""
        stage = self.stage
        lesson = next((one for one in LESSONS if one.key == missed.lesson), None)
        text = stage.activity.text(missed.lesson)
        if lesson is None or text is None:
            raise InputError("review", missed.key, "a question of a lesson")
        robot = other_arm(lesson, text, missed.question, missed.robot, random.Random())
        self._review.move(missed.key, robot.id)
        self.change(asked_in=lesson.key, arrived=False)
        stage.activity.question_again = missed.key
        stage.activity.leave_item()
        if stage.arm.now.robot != robot:
            stage.robots.show(robot)
        stage.post("lesson", lesson.title)
        stage.post(("feature", Guide.key, ("again", missed.question, 0)), None)

    # As exercises

    def _take(self, exercise: Exercise, given: object, verdict: Verdict, seconds: float, sending: str) -> None:
        self._practice.take(exercise, verdict, seconds)
        self._judged(exercise)

    def _give_up(self, exercise: Exercise, seconds: float) -> bool:
        if not self.stage.activity.reveals(exercise):
            return False
        self._practice.give_up(exercise)
        self._judged(exercise)
        return True

    def _judged(self, exercise: Exercise) -> None:
        mark = self._practice.record(exercise).mark
        self.stage.activity.take_exercise(exercise, right=mark == "right", again=True)
        self.stage.activity.progress.look_back(exercise.id, mark)

    def _following(self, exercise: Exercise) -> Following | None:
        due = self._asked_next
        return None if due is None else Following("Next", "open", due.key)

    def _list(self) -> str:
        activity = self.stage.activity
        return views.list_html(self._review, activity.courses.exercises, activity.practice.seated)

    @property
    def _asked_next(self) -> Missed | None:
        """What is asked next."""
        return next(iter(views.known(self._review.due, self.stage.activity.courses.exercises)), None)

    # The page

    def step_name(self, key: Hashable) -> str:
        return "Review" if isinstance(key, tuple) and key[0] == "next" else super().step_name(key)

    def on_activity(self) -> None:
        s, activity = self.settings, self.stage.activity
        here = s.asked_in != "" and activity.lesson == s.asked_in
        if s.arrived and not here:  # it was left
            activity.question_again = ""
            self.change(asked_in="")
        if here != s.arrived:
            self.change(arrived=here)
        super().on_activity()

    def state(self) -> dict[str, object]:
        missed = self._review.state()
        return {**self._practice.state(), **({"missed": missed} if missed else {})}

    def restore(self, state: dict[str, object]) -> None:
        self._review.restore(state.get("missed"))
        super().restore(state)
        self._begin()
