"""*Review*: what was missed is asked again, with other numbers. ``static/lesson.js`` sends what is pressed there.

An exercise opens here, with numbers and marks of its own: those of the list of exercises, of a course and of a
room stay as they are. The question of a lesson opens in its lesson, on another arm.
"""

from __future__ import annotations

import random
from collections.abc import Hashable

from app.exercises import Exercise, Verdict
from app.viewer.activity.activity import REVIEW
from app.viewer.activity.practice import MOST
from app.viewer.activity.review import Missed
from app.viewer.exercises.feature import Practising
from app.viewer.exercises.views import Door, Following
from app.viewer.feature import Stage
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.feature import Guide
from app.viewer.panel import update_html
from app.viewer.panel.part import add_html
from app.viewer.review import views
from app.viewer.review.arms import other_arm
from kin import InputError, UnknownRobotError

_DRAWS = 20  # seeds until the numbers are others


class Reviewing(Practising):
    """The list of what is due, or one exercise of it.

    Its row stands above the list of lessons, and its bar above a lesson that it has opened; both live as long as
    the page. `show` and `hide` build and remove the rest.
    """

    key = REVIEW
    title = "Review"
    about = "What you have missed, again with other numbers."
    door = Door(REVIEW, "Review", counts=False)
    messages = Practising.messages | {"next", "back"}

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage, stage.activity.asked_again)
        self._review = stage.activity.review
        self._asked_in = ""  # the key of the lesson that was opened last, until it is left
        self._arrived = False  # whether it is open by now
        self._bar = add_html(stage.client.gui)
        self._row = add_html(stage.client.gui)
        self._show_row()

    # Events

    def handle(self, key: Hashable, value: object) -> None:
        match key:
            case ("next", int()):
                if (following := self._due) is not None:
                    self.open(following.key)
            case ("back", int()):
                self._practice.close()
                self.stage.post("lesson", self.title)
            case _:
                super().handle(key, value)

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
        """Open the lesson of a question, on another arm; its other answers there stay."""
        stage = self.stage
        lesson = next((one for one in LESSONS if one.key == missed.lesson), None)
        if lesson is None:
            raise InputError("review", missed.key, "a question of a lesson")
        try:
            robot = stage.store.get(missed.robot)
        except UnknownRobotError:  # of a visitor's own arm, or of a service with other arms
            robot = stage.store.robots[0]
        robot = other_arm(lesson, missed.question, robot, stage.store.robots, random.Random())
        self._review.move(missed.key, robot.id)
        self._asked_in, self._arrived = lesson.key, False
        stage.activity.question_again = missed.key
        stage.activity.leave_item()
        if stage.now.robot != robot:
            stage.change_robot(robot)
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
        due = self._due
        return None if due is None else Following("Next", "open", due.key)

    def _list(self) -> str:
        activity = self.stage.activity
        return views.list_html(self._review, activity.courses.exercises, activity.practice.seated)

    @property
    def _due(self) -> Missed | None:
        """What is asked next."""
        return next(iter(views.known(self._review.due, self.stage.activity.courses.exercises)), None)

    # The page

    def step_name(self, key: Hashable) -> str:
        return "Review" if isinstance(key, tuple) and key[0] == "next" else super().step_name(key)

    def on_activity(self) -> None:
        self._show_row()
        super().on_activity()

    def _show_row(self) -> None:
        activity = self.stage.activity
        counts = views.Counts.of(self._review, activity.courses.exercises)
        here = self._asked_in != "" and activity.lesson == self._asked_in
        if self._arrived and not here:
            self._asked_in = activity.question_again = ""
        self._arrived = here
        row = views.row_html(self.title, counts, activity.practice.seated) if activity.lesson is None else ""
        update_html(self._row, row)
        update_html(self._bar, views.bar_html(counts) if here else "")

    def state(self) -> dict[str, object]:
        missed = self._review.state()
        return {**self._practice.state(), **({"missed": missed} if missed else {})}

    def restore(self, state: dict[str, object]) -> None:
        self._review.restore(state.get("missed"))
        super().restore(state)
        self._show_row()
