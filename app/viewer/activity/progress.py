"""The course of a page: where the student is, what has been seen, and what the exercises gave."""

from __future__ import annotations

from collections.abc import Callable, Collection
from datetime import UTC, datetime

from app.classroom.courses import Course, Courses, Item, Seal, course_of, to_data
from app.classroom.courses.course import MOST_ITEMS
from app.classroom.results import Outcome, write_code
from app.exercises import Exercise
from app.viewer.activity.context import ExerciseContext
from app.viewer.activity.practice import MARKS, Mark, Practice
from kin import InputError

MOST_BACK = 2  # exercises that a course asks at its end
HARDEST = 2  # level of these


class Progress:
    """One page's course.

    Attributes:
        course: None: none is open.
        at: the index of the item on show; None: the list.
        seen: the indices of the lessons that were left with *Next*.
        passed: the indices of the lessons whose check was passed.
        alias: the name in the result code.
        back: the ids of the exercises that the course asks at its end, with what has become of each.
    """

    def __init__(self, courses: Courses, practice: Practice, secret: Callable[[], bytes]) -> None:
        self._courses = courses
        self._seal = Seal(secret)
        self._practice = practice
        self.course: Course | None = None
        self.at: int | None = None
        self.seen: set[int] = set()
        self.passed: set[int] = set()
        self.alias = ""
        self.back: dict[str, Mark] = {}

    def read(self, data: object, file: str = "course") -> Course:
        """A course as a link or a room has it; raises `ExerciseFileError`, or what the secret raises."""
        return course_of(data, self._courses.exercises, file, self._courses.find, self._seal)

    def packed(self, course: Course) -> dict[str, object]:
        """A course for a link or a room; raises what the secret raises if it brings exercises along."""
        return to_data(course, self._seal)

    def open(self, course: Course) -> None:
        """Begin a course; raises what the secret raises if it brings exercises along."""
        self.packed(course)
        self.course = course
        self._begin()

    def edit(self, course: Course) -> None:
        """The course was changed: places and what was seen no longer fit. Raises `ExerciseFileError` as `read`."""
        course = self.read(self.packed(course))  # the same limits as a file's
        if (course.items, course.own) != (self._now.items, self._now.own):
            self._begin()
        self.course = course

    def _begin(self) -> None:
        self.at, self.seen, self.passed, self.back = None, set(), set(), {}

    def bring(self, exercise: Exercise) -> Course:
        """Have the open course bring an exercise along, or a new one; raises `ExerciseFileError` if it is full."""
        if self.course is None:
            self.open(Course("My course"))
        self.edit(self._now.bringing(exercise))
        return self._now

    @property
    def seated(self) -> bool:
        """Whether this is a student's page in a room, which edits no course and stores its answers there."""
        return self._practice.seated

    @property
    def item(self) -> Item | None:
        """The item on show."""
        return None if self.course is None or self.at is None else self.course.items[self.at]

    def go(self, index: int) -> Item:
        """Go to an item; raises `InputError`."""
        if not 0 <= index < len(self._now.items):
            raise InputError("item", index, f"0 to {len(self._now.items) - 1}")
        self.at = index
        return self._now.items[index]

    def next(self) -> Item | None:
        """Go on, from the list to the first item that is not done; None after the last item: back to the list."""
        if self.at is None:
            return self.go(self.first_open())
        if self._now.items[self.at].kind == "lesson":
            self.seen.add(self.at)
        if self.is_last:
            self.at = None
            return None
        return self.go(self.at + 1)

    @property
    def is_last(self) -> bool:
        """Whether nothing comes after the item on show."""
        return self.at == len(self._now.items) - 1

    def mark(self, index: int) -> Mark:
        """What has become of an item."""
        item = self._now.items[index]
        if item.kind == "lesson":
            return "right" if index in self.passed else "wrong" if index in self.seen else "open"
        record = self._practice.records.get(item.key)
        return "open" if record is None else record.mark

    def take_lesson(self, key: str, robot_id: str, arms: Collection[str]) -> bool:
        """The check of a lesson was passed on this arm; returns whether that is news for the course.

        Args:
            arms: those that the lesson asks about. An item with another one is passed on any of these.
        """
        items = () if self.course is None else self.course.items
        passed = {
            i
            for i, item in enumerate(items)
            if (item.kind, item.key) == ("lesson", key) and (item.robot == robot_id or item.robot not in arms)
        }
        news = not passed <= self.passed
        self.passed |= passed
        return news

    def ask_back(
        self, missed: Collection[str], lessons: Collection[str], shown: Callable[[Exercise], bool]
    ) -> None:
        """Choose what the course asks at its end, once something of it is done: exercises of its lessons.

        Args:
            missed: the ids of exercises that were missed: these come first.
            lessons: the keys of lessons in which something was missed: their exercises come next.
            shown: whether the answer of an exercise may be shown.
        """
        course = self.course
        if self.back or course is None or all(self.mark(i) == "open" for i in range(len(course.items))):
            return
        known = self._courses.exercises
        taught = {item.key for item in course.items if item.kind == "lesson"}
        taught |= {one.lesson for one in map(known.get, course.exercises) if one is not None}
        found = [one for one in known.all if one.lesson in taught and one.level <= HARDEST and shown(one)]

        def rank(one: Exercise) -> tuple[bool, bool, bool]:
            return one.id not in missed, one.lesson not in lessons, one.id in course.exercises

        chosen: list[Exercise] = []
        while found and len(chosen) < MOST_BACK:
            used = {one.lesson for one in chosen}
            chosen.append(best := min(found, key=lambda one: (*rank(one), one.lesson in used)))
            found.remove(best)
        self.back = {one.id: "open" for one in chosen}

    def look_back(self, exercise_id: str, mark: Mark) -> None:
        """An exercise was asked again."""
        if exercise_id in self.back:
            self.back[exercise_id] = mark

    def first_open(self) -> int:
        """The first item that was not begun; then the first that is not done; the first one if all are."""
        marks = [self.mark(i) for i in range(len(self._now.items))]
        return next((marks.index(mark) for mark in ("open", "wrong") if mark in marks), 0)

    def outcome(self) -> Outcome:
        """What the exercises of the course gave."""
        course, records = self._now, self._practice.records
        done = [records[key] for key in course.exercises if key in records]
        count = len(course.exercises)
        return Outcome(
            "course",
            course.fingerprint,
            course.title,
            self.alias,
            score=round(sum(record.credit for record in done) / count) if count else 0,
            solved=sum(record.mark == "right" for record in done),
            count=count,
            tries=sum(record.attempts for record in done),
            day=datetime.now(UTC).date(),
        )

    def place(self, key: Callable[[], bytes]) -> ExerciseContext | None:
        """Where its exercises are done; None: no course is open. Raises what `key` raises."""
        course = self.course
        if course is None:
            return None
        answers = (
            "with" if course.answers else "without"
        )  # else a course with answers would show those of one without
        return ExerciseContext(f"course {course.fingerprint.hex()} {answers} answers", key())

    def code(self, key: Callable[[], bytes]) -> str:
        """The result code; raises `InputError` if the answers were not judged by this service."""
        place = self.place(key)
        if place is None or not self._practice.is_in(place):
            valid = "answers that this service has judged; it could not sign when the course was opened"
            raise InputError("progress", "unsigned", f"{valid}. Open the course anew")
        return write_code(self.outcome(), place.key)

    def state(self) -> dict[str, object]:
        """As JSON; empty without a course."""
        if self.course is None:
            return {}
        at = -1 if self.at is None else self.at
        indices = {"seen": sorted(self.seen), "passed": sorted(self.passed)}
        back = {"back": dict(self.back)} if self.back else {}
        return {"course": self.packed(self.course), "at": at, "alias": self.alias, **indices, **back}

    def restore(self, state: dict[str, object]) -> None:
        """Take what `state` returned; raises `ExerciseFileError` for a course that is not valid here."""
        self.course = None
        self._begin()
        if "course" not in state:
            return
        course = self.read(state["course"], "link")
        at, alias = state.get("at"), state.get("alias")
        self.course = course
        if type(at) is int and 0 <= at < len(course.items):
            self.at = at
        self.seen, self.passed = (_indices(state.get(name), len(course.items)) for name in ("seen", "passed"))
        self.alias = alias[:100] if isinstance(alias, str) else ""
        back = state.get("back")
        self.back = {
            key: mark
            for key, mark in list(back.items() if isinstance(back, dict) else ())[:MOST_BACK]
            if mark in MARKS and self._courses.exercises.get(key) is not None
        }

    @property
    def _now(self) -> Course:
        if self.course is None:
            raise InputError("course", None, "an open course")
        return self.course


def _indices(value: object, count: int) -> set[int]:
    """The indices of items in a list of a link; what is none is left out."""
    found = value[:MOST_ITEMS] if isinstance(value, list) else []
    return {i for i in found if type(i) is int and 0 <= i < count}
