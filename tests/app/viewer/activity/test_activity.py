"""The owner of what is open: what it withholds and reveals, where answers go, and who hears of changes."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from app.classroom.courses import Course, Courses, Item
from app.classroom.views import Recalled
from app.exercises import Exercise, Exercises, Verdict, parse_exercise
from app.viewer.activity.activity import EXERCISES, Activity, GivenUp, Judged
from app.viewer.activity.context import ExerciseContext
from kin import KinematicsError
from kin.parsing import to_toml

ALL = Exercises()
COURSES = Courses(ALL)
RIGHT = Verdict(True, "Yes.")
TABLE = next(one for one in ALL.all if one.kind.withholds)
OTHER = next(one for one in ALL.all if not one.kind.withholds)


@dataclass
class Room:
    """A seat that notes what it gets, and allows answers to be shown or not."""

    allows: bool = True
    got: list[Judged | GivenUp] = field(default_factory=list)

    def submit(self, judged: Judged) -> None:
        self.got.append(judged)

    def tell_recalled(self, more: Recalled) -> None:
        raise AssertionError("nothing is due")

    def give_up(self, one: GivenUp) -> bool:
        self.got.append(one)
        return self.allows


@pytest.fixture
def changes() -> list[int]:
    return []


@pytest.fixture
def activity(changes: list[int]) -> Activity:
    return Activity(COURSES, lambda: b"secret", lambda: changes.append(1))


def opened(activity: Activity, exercise: Exercise) -> Activity:
    activity.lesson = EXERCISES
    activity.practice.open(exercise.id)
    return activity


def course_of(exercise: Exercise, answers: bool) -> Course:
    return Course("Mine", items=(Item("exercise", exercise.id),), answers=answers)


def test_the_table_is_withheld_while_the_question_about_it_is_open(activity: Activity) -> None:
    assert opened(activity, TABLE).withheld == {"table"}
    activity.lesson = "dh"
    assert (activity.exercise, activity.withheld) == (None, frozenset())
    assert opened(activity, OTHER).withheld == frozenset()
    opened(activity, TABLE).answer(TABLE, [], RIGHT, 1.0)
    assert activity.withheld == frozenset()
    activity.practice.again(TABLE)
    assert activity.withheld == {"table"}


@pytest.mark.parametrize("sent", [False, True])
def test_a_course_without_answers_does_not_reveal_its_own(activity: Activity, sent: bool) -> None:
    course = course_of(TABLE, answers=False)
    if sent:
        activity.sent = course
    else:
        activity.progress.open(course)
    assert not activity.reveals(TABLE)
    assert activity.reveals(OTHER)
    room = Room()
    activity.take_seat(ExerciseContext("seat r s", b"k", seat=True), room)
    assert not activity.give_up(TABLE, 1.0)
    assert not room.got, "nothing is stored as given up that is not shown"
    assert not activity.practice.record(TABLE).closed


def test_an_answer_is_shown_only_when_the_seat_has_stored_that_it_was(activity: Activity) -> None:
    room = Room(allows=False)
    activity.take_seat(ExerciseContext("seat r s", b"k", seat=True), room)
    seed = activity.practice.seed_of(OTHER)
    assert not activity.give_up(OTHER, 2.0)
    assert not activity.practice.record(OTHER).closed
    room.allows = True
    assert activity.give_up(OTHER, 3.0)
    assert activity.practice.record(OTHER).mark == "shown"
    assert room.got == [GivenUp(OTHER, seed, 2.0), GivenUp(OTHER, seed, 3.0)]


def test_answers_go_to_the_seat(activity: Activity) -> None:
    room = Room()
    activity.answer(OTHER, 1, RIGHT, 1.0)  # alone
    activity.take_seat(ExerciseContext("seat r s", b"k", seat=True), room)
    activity.answer(OTHER, 2, RIGHT, 4.0)
    assert room.got == [Judged(OTHER, activity.practice.seed_of(OTHER), 2, RIGHT, 4.0)]


def test_a_course_has_numbers_of_its_own_and_everybody_hears_of_it(activity: Activity, changes: list[int]) -> None:
    before = activity.practice.seed_of(OTHER)
    activity.progress.open(course_of(OTHER, answers=True))
    activity.enter_course()
    assert (activity.practice.seed_of(OTHER) != before, len(changes)) == (True, 1)
    activity.progress.go(0)
    assert (activity.leads("exercise", OTHER.id), activity.leads("exercise", TABLE.id)) == (True, False)
    activity.leave_item()
    assert (activity.leads("exercise", OTHER.id), len(changes)) == (False, 2)
    assert activity.offered[0] == activity.progress.course
    activity.progress.course = None
    activity.enter_course()
    assert activity.practice.seed_of(OTHER) == before


def test_without_a_secret_a_course_has_the_numbers_of_a_page_alone() -> None:
    def none() -> bytes:
        raise KinematicsError("no folder")

    activity = Activity(COURSES, none, lambda: None)
    before = activity.practice.seed_of(OTHER)
    activity.progress.open(course_of(OTHER, answers=True))
    activity.enter_course()
    assert activity.practice.seed_of(OTHER) == before


def test_the_same_note_is_reported_once(activity: Activity, changes: list[int]) -> None:
    for note in ("Storing the answer …", "Storing the answer …", "✓ Stored for your teacher."):
        activity.say(note)
    assert len(changes) == 2


def named(title: str) -> str:
    """The file of an exercise *mine*."""
    return to_toml({**tomllib.loads(OTHER.source), "id": "mine", "title": title})


@pytest.mark.parametrize("seated", [False, True])
def test_whose_exercise_counts_if_a_course_and_the_service_have_the_same_id(seated: bool, tmp_path: Path) -> None:
    known = Exercises(tmp_path)
    activity = Activity(Courses(known), lambda: b"secret", lambda: None)
    if seated:
        activity.take_seat(ExerciseContext("seat r s", b"k", seat=True), Room())
    course = Course("Mine").bringing(parse_exercise(named("Of the course")))
    activity.progress.course = course
    activity.stock()
    ours = course.own[0].exercise
    assert activity.exercises.get("mine") is ours
    saved = known.save(named("Of the service"))
    assert activity.exercises.get("mine") is (saved if seated else ours), "a student replaces no task"
    activity.sent, activity.progress.course = course, None
    activity.stock()
    assert activity.exercises.get("mine") is ours, "what the teacher sends counts"
