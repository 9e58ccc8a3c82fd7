"""The owner of what is open in one page.

Lessons, exercises, courses and the tab of a room do not know each other. Each says here what it opens and judges,
and asks here what the others have open; `Feature.on_activity` reports every change to all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from contextlib import suppress
from typing import Final, NamedTuple, Protocol

from app.classroom.courses import Course, Courses
from app.classroom.views import Recalled
from app.classroom.work import Work
from app.exercises import Exercise, Shelf, Verdict
from app.exercises.lesson_text import LessonText
from app.viewer.activity.context import ExerciseContext
from app.viewer.activity.practice import Practice
from app.viewer.activity.progress import Progress
from app.viewer.activity.review import Review, question_key
from kin import KinematicsError

# The keys under which the exercises are opened, where one is written, and where what was missed is asked again.
EXERCISES: Final = "exercises"
AUTHOR: Final = "author"
REVIEW: Final = "review"

# What questions may withhold, and what is then absent from panel, scene, read-out and messages.
FACTS: Final = {
    "table": "the table of the arm, in every form",
    "order": "in which order the motions of a row are done",
    "motions": "how far a row of the table turns or slides with its joint where it is now",
    "position": "the position of the tool in the read-out",
    "angles": "roll, pitch and yaw in the read-out",
    "quaternion": "the quaternion in the read-out",
    "jacobian": "the Jacobian, its columns and what follows from them",
    "ellipsoid": "the ellipsoid, its semi-axes and the singular values",
    "torques": "the joint torques of a force",
    "singularities": "which singularities are near, and what is lost there",
    "screws": "the six numbers of each joint axis, and what is drawn of them",
    "forms": "a rotation in its other forms",
    "null space": "how many self-motions there are",
    "iterates": "the iterates of a numeric solution, their errors, and how they end",
    "method": "what a numeric method makes of the Jacobian",
    "basins": "which solution each start of a numeric method leads to",
    "postures": "the postures of the arm, which of them reach the target, and the one that it has",
    "equations": "the equations of the tool's pose, and their values",
}


class Judged(NamedTuple):
    """An answer that was judged: the seed of its numbers, the answer as plain data, and how long (s) it took.

    Attributes:
        sending: names the sending of the answer by the page, which may repeat it; empty: it does not.
    """

    exercise: Exercise
    seed: int
    answer: object
    verdict: Verdict
    seconds: float
    sending: str = ""


class GivenUp(NamedTuple):
    """The answer of an exercise is to be shown: the seed of its numbers, and after how long (s)."""

    exercise: Exercise
    seed: int
    seconds: float


class Seat(Protocol):
    """A student's seat in a room, where answers are stored."""

    def submit(self, judged: Judged) -> None:
        """Store an answer that was judged while the right one was not on show."""

    def tell_recalled(self, more: Recalled) -> None:
        """Count what was asked again."""

    def give_up(self, one: GivenUp) -> bool:
        """Store that the answer is shown to a student who has not found it; False: it must not be shown now."""


class Activity:
    """What one page works on. Not thread-safe: the visitor's worker calls it.

    Args:
        courses: those of the service, with its exercises.
        secret: the service's, for numbers and result codes of courses; raises `KinematicsError` if it has none.
        changed: called after every change.

    Attributes:
        courses: as given.
        exercises: those of the service, and those of this page.
        lesson: the key of what the tab *Learn* shows: a lesson, the exercises or the courses; None: the overview.
        practice: what has been done of the exercises, and which one is open.
        progress: the open course and its item on show.
        review: what was missed, and when it is asked again.
        asked_again: exercises that are asked again, with numbers and marks of their own, which nobody else sees.
        question_again: the key of a lesson’s question that is asked again, until the lesson is left; or empty.
        sent: the course that the teacher of the room sent.
        draft: the exercise that is written in this page.
        lent: an exercise that the room brings along.
        kept: on a teacher's page, the own exercises that were sent to the room, perhaps by another page.
        task: the exercise that the teacher of the room sent.
        note: a sentence below the verdict: whether the answer is stored.
        asked: what the open question of a lesson withholds.
        language: of the words of lessons, as the visitor has chosen it; "": as the service is set.
        news: grows when other pages of the seat have answered.
    """

    def __init__(self, courses: Courses, secret: Callable[[], bytes], changed: Callable[[], None]) -> None:
        self.courses, self.exercises = courses, Shelf(courses.exercises)
        self.secret, self.changed = secret, changed
        self.practice = Practice(self.exercises)
        self.progress = Progress(courses, self.practice, secret)
        self.review = Review()
        self.asked_again = Practice(self.exercises)
        self.question_again = ""
        self.lesson: str | None = None
        self.sent: Course | None = None
        self.draft: Exercise | None = None
        self.lent: Exercise | None = None
        self.kept: tuple[Exercise, ...] = ()
        self.task: Exercise | None = None
        self.note = ""
        self.asked: frozenset[str] = frozenset()
        self.language = ""
        self.news = 0
        self._seat: Seat | None = None

    def text(self, lesson: str) -> LessonText | None:
        """The words and questions of a lesson in the language of the page; None of one without a file."""
        return self.courses.lessons.text(lesson, self.language)

    def own_text(self, lesson: str) -> LessonText | None:
        """The same, if a file of the operator's has it."""
        return self.courses.lessons.own(lesson, self.language)

    # What is open

    @property
    def exercise(self) -> Exercise | None:
        """The exercise on show."""
        return self.practice.at if self.lesson == EXERCISES else None

    @property
    def opens_exercise(self) -> bool:
        """Whether an exercise is on show, as a task or as one that is asked again."""
        practice = self._open_practice
        return practice is not None and practice.at is not None

    @property
    def opened(self) -> Hashable:
        """What is open and how far it has come: what a reload brings back, however soon it comes."""
        practice = self._open_practice
        exercise = None if practice is None else practice.at
        record = None if practice is None or exercise is None else practice.record(exercise)
        done = None if record is None else (record.mark, record.attempts, record.hints, record.variant)
        return self.lesson, None if exercise is None else exercise.id, done, self.progress.at

    @property
    def withheld(self) -> frozenset[str]:
        """The names of `FACTS` that nothing in the page shows now, because an open question asks for them."""
        practice = self._open_practice
        exercise = None if practice is None else practice.at
        if practice is None or exercise is None or practice.record(exercise).closed:
            return self.asked
        return self.asked | exercise.kind.withholds

    @property
    def _open_practice(self) -> Practice | None:
        """What the exercise on show belongs to, if the tab *Learn* shows exercises."""
        return {EXERCISES: self.practice, REVIEW: self.asked_again}.get(self.lesson or "")

    @property
    def offered(self) -> tuple[Course, ...]:
        """What a teacher may send: the open course, and those of the service."""
        mine = self.progress.course
        return tuple(dict.fromkeys(([mine] if mine is not None and mine.items else []) + [*self.courses.all]))

    def reveals(self, exercise: Exercise) -> bool:
        """Whether the answer of an exercise may be shown to a student who has not found it."""
        courses = filter(None, (self.progress.course, self.sent))
        return all(course.answers or exercise.id not in course.exercises for course in courses)

    def leads(self, kind: str, key: str) -> bool:
        """Whether the course says what comes after a lesson or an exercise, as `Item` has its kind and key."""
        item = self.progress.item
        return item is not None and (item.kind, item.key) == (kind, key)

    def leave_item(self) -> None:
        """Something else is opened above which the bar of the course must not stand; the course stays open."""
        self.progress.at = None
        self.changed()

    def stock(self) -> None:
        """Take in the exercises of courses and of the room, and the one written here."""
        sent, opened = ([one.exercise for one in c.own] if c else [] for c in (self.sent, self.progress.course))
        mine = [] if self.practice.seated else opened  # of a student in a room, none takes the place of the task
        self.exercises.put([*sent, *mine, *filter(None, (self.lent, self.draft))], weak=[*self.kept, *opened])
        self.practice.invalidate()

    # Where exercises are done

    def enter_course(self) -> None:
        """Exercises of a course have numbers and marks of their own, with a secret of this service.

        Where there is no place for the secret, they are as without a course; a request for a result code then gets
        the reason.
        """
        self.stock()
        place = None
        with suppress(KinematicsError):
            place = self.progress.place(self.secret)
        self.practice.enter(place)
        self.changed()

    def take_seat(self, place: ExerciseContext, seat: Seat) -> None:
        """This is a student's page in a room from now on."""
        self._seat = seat
        self.practice.enter(place)
        self.review.enter(place.label)

    # Answers

    def know(self, work: Mapping[str, Work], waiting: bool) -> None:
        """Take what is stored of this seat, by exercise: answers on other pages of the seat count here too.

        Args:
            waiting: whether answers of this page are not stored yet.
        """
        if self.practice.know(work, waiting):
            self.news += 1
            self.changed()

    def answer(
        self, exercise: Exercise, given: object, verdict: Verdict, seconds: float, sending: str = ""
    ) -> None:
        """An answer was judged while the right one was not on show; `sending` as in `Judged`."""
        self.practice.take(exercise, verdict, seconds)
        self.take_exercise(exercise, verdict.right)
        if self._seat is not None:
            self._seat.submit(Judged(exercise, self.practice.seed_of(exercise), given, verdict, seconds, sending))

    def give_up(self, exercise: Exercise, seconds: float) -> bool:
        """The answer is to be shown; False: in a room, only when it is stored that it was."""
        given_up = GivenUp(exercise, self.practice.seed_of(exercise), seconds)
        if not self.reveals(exercise) or (self._seat is not None and not self._seat.give_up(given_up)):
            return False
        self.practice.give_up(exercise)
        self.take_exercise(exercise, right=False)
        return True

    def take_exercise(self, exercise: Exercise, right: bool, again: bool = False) -> None:
        """An exercise was answered, or its answer shown: what was missed comes back.

        Only exercises of the service do; others may be gone by then.

        Args:
            again: whether *Review* asked it, which counts as remembered or not.
        """
        if self.courses.exercises.get(exercise.id) is not None:
            self._take_again(exercise.id, right, again)

    def take_question(self, lesson: str, question: str, robot_id: str, right: bool) -> None:
        """A question of a lesson was answered about this arm, or its answer shown."""
        key = question_key(lesson, question)
        self._take_again(key, right, key == self.question_again, robot_id)

    def _take_again(self, key: str, right: bool, again: bool, robot: str = "") -> None:
        recalled = self.review.recalled(key, right, robot) if again else None
        self.review.take(key, right, robot)
        if recalled is not None and self._seat is not None:
            self._seat.tell_recalled(recalled)

    def pass_lesson(self, key: str, robot_id: str, arms: Collection[str]) -> None:
        """The check of a lesson was passed on this arm, of `arms` that it asks about."""
        if self.progress.take_lesson(key, robot_id, arms):
            self.changed()

    def say(self, note: str) -> None:
        """Write a sentence below the verdict."""
        if note != self.note:
            self.note = note
            self.changed()
