"""What was missed, and when it comes back: days, seats, and what a stored list may contain."""

from __future__ import annotations

import json
import random
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lesson_arms import arms_of

from app.classroom.courses import Course, Courses, Item
from app.classroom.views import Recalled
from app.exercises import Exercise, Exercises, Verdict
from app.exercises.lesson_text import texts_of
from app.exercises.lessons import LESSONS as KEYS
from app.shared.store import Store
from app.viewer.activity.activity import REVIEW, Activity, GivenUp
from app.viewer.activity.context import ExerciseContext
from app.viewer.activity.review import INTERVALS, MOST_MISSED, Missed, Review, question_key
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide import earlier
from app.viewer.lessons.guide.progress import Progress
from app.viewer.review.arms import other_arm
from app.viewer.review.views import Counts, list_html
from kin.units import Units

ALL = Exercises()
STORE = Store()
DAY = 86_400.0
NOON = 20_000 * DAY + DAY / 2


class Clock:
    """A clock that is set."""

    def __init__(self) -> None:
        self.now = NOON

    def __call__(self) -> float:
        return self.now

    def pass_days(self, days: float) -> None:
        self.now += days * DAY


@pytest.fixture
def clock() -> Clock:
    return Clock()


def keys(rows: list[Missed]) -> list[str]:
    return [one.key for one in rows]


def activity() -> Activity:
    return Activity(Courses(ALL), lambda: b"secret", lambda: None)


def test_what_was_missed_comes_back_after_one_three_and_seven_days(clock: Clock) -> None:
    review = Review(clock)
    assert not review.take("two-elbows", True), "what is right at once is not asked again"
    assert review.take("two-elbows", False)
    assert (keys(review.due), keys(review.later)) == ([], ["two-elbows"])
    assert not review.take("two-elbows", True), "the second try of the same day does not count"
    for days in (1, 3, 7):
        clock.pass_days(days - 1)
        assert review.due == [], days
        clock.pass_days(1)
        assert keys(review.due) == ["two-elbows"], days
        review.take("two-elbows", True)
        assert review.due == []
    assert review.missed == {}


def test_a_wrong_answer_begins_anew(clock: Clock) -> None:
    review = Review(clock)
    review.take("swing", False)
    clock.pass_days(1)
    review.take("swing", True)
    clock.pass_days(1)
    review.take("swing", False)  # before it is due, in the list of exercises
    assert review.missed["swing"].stage == 0
    clock.pass_days(1)
    assert keys(review.due) == ["swing"]


@pytest.mark.parametrize(("zone", "hours"), [(0, 12), (13 * 60, 23), (-11 * 60, 23), (-9 * 60 - 30, 2)])
def test_the_next_day_is_that_of_the_student(clock: Clock, zone: int, hours: int) -> None:
    clock.now = 20_000 * DAY - 60 * zone  # midnight there
    review = Review(clock)
    review.zone = zone
    review.take("swing", False)
    clock.now += 3600 * hours
    assert review.due == []
    clock.now += 3600 * (24 - hours) - 1
    assert review.due == []
    clock.now += 1
    assert keys(review.due) == ["swing"]


def test_a_question_counts_about_its_own_arm_alone(clock: Clock) -> None:
    review, key = Review(clock), question_key("velocity", "3")
    review.take(key, False, "ur5")
    clock.pass_days(1)
    assert not review.take(key, True, "panda")
    review.move(key, "panda")
    assert review.take(key, True, "panda")
    assert (review.missed[key].lesson, review.missed[key].question, review.missed[key].stage) == (
        "velocity",
        "3",
        1,
    )


def test_what_is_remembered_after_a_week_and_about_a_new_arm_is_counted(clock: Clock) -> None:
    review, key = Review(clock), question_key("velocity", "3")
    assert review.recalled(key, True, "ur5") is None, "it was never missed"
    review.take(key, False, "ur5")
    assert review.recalled(key, True, "ur5") is None, "it is not due"
    clock.pass_days(1)
    assert review.recalled(key, True, "panda") is None, "it is asked about the other arm"
    assert review.recalled(key, True, "ur5") == (0, 0, 0, 0), "a day later, about the same arm"
    review.move(key, "panda")
    assert review.recalled(key, True, "panda") == (0, 0, 1, 1)
    review.take(key, True, "panda")
    clock.pass_days(7)  # it was due after three
    assert review.recalled(key, False, "panda") == (1, 0, 0, 0), "it was answered about this arm"
    review.move(key, "ur5")
    assert review.recalled(key, True, "ur5") == (1, 1, 0, 0), "this arm was the first one"
    again = Review(clock)
    again.restore(json.loads(json.dumps(review.state())))
    assert again.missed == review.missed
    review.take(key, False, "gen3")
    clock.pass_days(1)
    review.move(key, "gen3")
    assert review.recalled(key, True, "gen3") == (0, 0, 0, 0), "it was about this arm when it was missed"
    for arm in "abcdefgh":
        review.move(key, arm)
    assert review.missed[key].before == ("g", "f", "e", "d"), "the last ones are kept"
    review.take(key, False, "z")
    assert review.missed[key].before == ("z", "h", "g", "f"), "with the one that it was answered about"
    assert review.recalled(key, True, "z") is None
    clock.pass_days(1)
    assert review.recalled(key, True, "z") == (0, 0, 0, 0)


def test_a_seat_counts_what_is_remembered(clock: Clock) -> None:
    heard: list[Recalled] = []
    one, missed = activity(), ALL.all[1]
    one.review = Review(clock)
    one.answer(missed, None, Verdict(False, "No."), 1.0)
    seat = SimpleNamespace(submit=lambda _: None, tell_recalled=heard.append, give_up=lambda _: True)
    one.take_seat(ExerciseContext("seat room me", b"key", seat=True), seat)
    one.answer(missed, None, Verdict(False, "No."), 1.0)
    clock.pass_days(8)
    one.take_exercise(missed, right=True, again=True)
    one.take_exercise(missed, right=False, again=True)
    assert heard == [Recalled(1, 1, 0, 0)], "the first answer of the day counts"
    for elsewhere in (
        lambda: one.answer(missed, None, Verdict(False, "No."), 1.0),
        lambda: one.give_up(missed, 1.0),
        lambda: one.take_exercise(missed, right=False),  # as the check of a lesson does
    ):
        clock.pass_days(8)
        assert keys(one.review.due) == [missed.id]
        elsewhere()
        assert one.review.due == []
        assert len(heard) == 1, "what Review has not asked does not count"


def test_a_seat_counts_questions_of_lessons_that_review_has_asked(clock: Clock) -> None:
    heard: list[Recalled] = []
    one = activity()
    one.review = Review(clock)
    seat = SimpleNamespace(submit=lambda judged: None, tell_recalled=heard.append)
    one.take_seat(ExerciseContext("seat room me", b"key", seat=True), seat)
    for question in ("c1", "c2"):
        one.take_question("velocity", question, "ur5", right=False)
    clock.pass_days(8)
    one.question_again = question_key("velocity", "c2")
    one.take_question("velocity", "c1", "ur5", right=True)
    assert heard == []
    one.take_question("velocity", "c2", "ur5", right=True)
    assert heard == [Recalled(1, 1, 0, 0)]


def test_a_long_list_keeps_what_is_known_least(clock: Clock) -> None:
    review = Review(clock)
    review.take("known-best", False)
    clock.pass_days(1)
    review.take("known-best", True)
    for i in range(MOST_MISSED):
        review.take(f"exercise-{i}", False)
    assert len(review.missed) == MOST_MISSED
    assert "known-best" not in review.missed
    assert f"exercise-{MOST_MISSED - 1}" in review.missed
    assert len(json.dumps(review.state())) < 4000, "links keep it"


def test_a_reload_keeps_the_list_and_undo_changes_nothing(clock: Clock) -> None:
    review = Review(clock)
    review.take("swing", False)
    review.take("velocity/c1", False, "ur5")
    before = json.loads(json.dumps(review.state()))
    other = Review(clock)
    other.restore(before)
    assert other.state() == before
    clock.pass_days(1)
    review.take("swing", True)
    review.restore(before)  # as undo does
    assert review.missed["swing"].stage == 1
    for days in INTERVALS[1:]:
        clock.pass_days(days)
        review.take("swing", True)
    review.restore(before)
    assert keys(review.due) == ["velocity/c1"]


def test_seats_have_lists_of_their_own(clock: Clock) -> None:
    review = Review(clock)
    review.take("swing", False)
    first, second = (ExerciseContext(f"seat room {i}", b"key", seat=True).label for i in range(2))
    review.enter(first)
    assert review.missed == {}
    review.take("two-elbows", False)
    kept = review.state()
    review.enter(second)  # the next student in the same browser
    assert review.missed == {}
    assert "two-elbows" not in json.dumps(review.state())
    reloaded = Review(clock)
    reloaded.restore(kept)
    assert keys(reloaded.later) == ["swing"], "until the seat is known"
    assert reloaded.state() == kept
    reloaded.enter(first)
    assert keys(reloaded.later) == ["two-elbows"]


@pytest.mark.parametrize(
    "entry",
    [
        *(
            None,
            5,
            "x",
            {},
            [],
            [0],
            [0, 1, 2],
            [0, 1, "ur5", *["ur5"] * 5],
            [0, 1, "ur5", 5],
            [3, 20_000],
            [-1, 20_000],
            [0, -1],
        ),
        *([True, 20_000], [0, 1e400], [0, 20_000.0], [0, 10**30], [0, 20_000, "<b>"], [0, 20_000, "x" * 61]),
    ],
    ids=str,
)
def test_what_is_no_entry_is_left_out(clock: Clock, entry: object) -> None:
    review = Review(clock)
    review.restore({"": {"swing": entry, "two-elbows": [1, 20_000]}})
    assert keys(review.due) == ["two-elbows"]


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=20), inner, max_size=4),
    max_leaves=20,
)


@given(
    JSON
    | st.dictionaries(st.text(max_size=14), st.dictionaries(st.text(max_size=70), JSON, max_size=3), max_size=3)
)
def test_a_hostile_list_is_harmless(state: Any) -> None:
    review = Review(lambda: NOON)
    review.restore(state)
    json.dumps(review.state(), allow_nan=False)
    assert all(one.due <= review.today + INTERVALS[-1] for one in review.missed.values())
    assert earlier.read(state, ALL) is not None


def test_a_long_hostile_list_is_cut_and_a_far_day_comes_near(clock: Clock) -> None:
    review = Review(clock)
    review.restore({"": {f"e{i}": [0, 900_000] for i in range(10_000)}, "a": {}, "b": {"swing": [0, 1]}})
    assert len(review.missed) == MOST_MISSED
    clock.pass_days(INTERVALS[-1])
    assert len(review.due) == MOST_MISSED
    assert set(review.state()) == {""}


def test_answers_of_exercises_and_shown_ones_are_collected() -> None:
    one, other = activity(), ALL.all[0]
    one.answer(other, None, Verdict(True, "Yes."), 1.0)
    assert one.review.missed == {}
    second, third = ALL.all[1:3]
    one.answer(second, None, Verdict(False, "No."), 1.0)
    one.give_up(third, 1.0)
    assert set(one.review.missed) == {second.id, third.id}
    one.take_question("velocity", "c2", "ur5", right=False)
    assert one.review.missed["velocity/c2"].robot == "ur5"


def test_the_list_of_a_seat_is_not_that_of_the_page() -> None:
    class Room:
        def submit(self, judged: object) -> None:
            return None

        def tell_recalled(self, more: Recalled) -> None:
            return None

        def give_up(self, one: GivenUp) -> bool:
            return True

    one = activity()
    one.answer(ALL.all[0], None, Verdict(False, "No."), 1.0)
    one.take_seat(ExerciseContext("seat room me", b"key", seat=True), Room())
    assert one.review.missed == {}
    one.answer(ALL.all[1], None, Verdict(False, "No."), 1.0)
    assert set(one.review.missed) == {ALL.all[1].id}


def test_an_exercise_that_is_asked_again_withholds_what_it_asks_for() -> None:
    one = activity()
    table = next(each for each in ALL.all if each.kind.withholds)
    one.lesson = REVIEW
    one.asked_again.open(table.id)
    assert one.withheld == table.kind.withholds
    assert one.exercise is None, "the room sees exercises of the list alone"
    assert one.opens_exercise
    one.asked_again.give_up(table)
    assert one.withheld == frozenset()


# The check of a lesson


@pytest.mark.parametrize("lesson", KEYS)
def test_a_check_asks_two_exercises_of_earlier_lessons(lesson: str) -> None:
    one = activity()
    for seed in range(20):
        drawn = earlier.choose(lesson, one, random.Random(seed))
        assert len(drawn) == (0 if lesson == KEYS[0] else 2)
        lessons = [ALL.get(exercise_id).lesson for exercise_id, _ in drawn]  # type: ignore[union-attr]
        assert all(KEYS.index(name) < KEYS.index(lesson) for name in lessons)
        assert KEYS.index(lesson) < 2 or len(set(lessons)) == 2
        assert earlier.read(json.loads(json.dumps(drawn)), ALL) == drawn
        for question in earlier.questions(drawn, ALL, Units()).values():
            assert question.asked().form in ("fields", "options", "order")
            assert question.judge(question.right()).right
            assert "scene" not in question.prompt


@pytest.mark.parametrize(
    ("exercise", "typed", "way"),
    [
        ("row-distance", (["1 mm"], ["2 mm"]), "√(d² + a²)"),
        ("other-way-round", (["1 mm", "1 mm"], ["2 mm", "2 mm"]), "−Rᵀ p"),
    ],
)
def test_a_check_says_the_way_to_an_earlier_item_at_the_second_miss(
    exercise: str, typed: tuple[list[str], list[str]], way: str
) -> None:
    progress = Progress(LESSONS[-1].outline(STORE.get("ur5"), Units()))
    progress.ask_also(earlier.questions(((exercise, 7),), ALL, Units()))
    said = []
    for answer in typed:
        assert not progress.answer("r1", answer).right
        said.append(progress.feedback("r1"))
    assert said[0].endswith("small.")
    assert way not in said[0]
    assert way in said[1]


def test_what_was_missed_is_asked_first() -> None:
    one = activity()
    one.review.take("swing", False)
    one.review.take("lost-direction", False)  # of a later lesson
    one.take_question("equations", "2", "ur5", right=False)
    for seed in range(20):
        first, second = earlier.choose("velocity", one, random.Random(seed))
        assert first[0] == "swing"
        assert ALL.get(second[0]).lesson == "equations"  # type: ignore[union-attr]


def test_what_a_teacher_keeps_back_is_not_asked() -> None:
    one = activity()
    one.review.take("swing", False)
    one.task = ALL.get("swing")
    assert "swing" not in dict(earlier.choose("velocity", one, random.Random(1)))
    one.task, one.sent = None, Course("Exam", items=(Item("exercise", "swing"),), answers=False)
    assert "swing" not in dict(earlier.choose("velocity", one, random.Random(1)))


# The end of a course


def test_a_course_asks_two_exercises_of_its_lessons_at_its_end() -> None:
    one, items = activity(), tuple(Item("lesson", key) for key in ("dh", "velocity", "trajectories"))
    progress = one.progress
    progress.open(Course("Mine", items=(*items, Item("exercise", "swing"))))
    progress.ask_back((), (), lambda _: True)
    assert progress.back == {}, "nothing is done yet"
    progress.take_lesson("dh", "ur5", ["ur5"])
    progress.ask_back({"ptp-or-lin"}, {"velocity"}, one.reveals)
    first, second = progress.back
    assert first == "ptp-or-lin"
    assert ALL.get(second).lesson == "velocity"  # type: ignore[union-attr]
    progress.look_back(first, "right")
    progress.look_back("swing", "right")
    assert progress.back == {first: "right", second: "open"}
    again = activity().progress
    again.restore(json.loads(json.dumps(progress.state())))
    assert again.back == progress.back
    again.restore({**progress.state(), "back": {"swing": "great", "none": "open", first: ["right"]}})
    assert again.back == {}


# With other numbers


@pytest.mark.parametrize("exercise", ALL.all, ids=lambda exercise: exercise.id)
def test_what_varies_comes_back_with_other_numbers(exercise: Exercise) -> None:
    known, seen = exercise.variant(77), [exercise.variant(seed) for seed in range(6)]
    assert any(one.values != known.values for one in seen) == bool(exercise.vary)
    asked = {
        (one.text(exercise.text, Units()), str(exercise.asked(one, Units())), str(one.q)) for one in (known, *seen)
    }
    assert len(asked) > 1 or not exercise.vary, "so that what is asked, or the arm on show, is another"


# On another arm


@pytest.mark.full
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_questions_are_asked_again_on_an_arm_with_other_numbers(lesson: Any) -> None:
    arm = arms_of(lesson.key)[0]
    outline = lesson.asked(arm, Units())
    moved = 0
    for key, question in outline.questions():
        found = other_arm(lesson, texts_of(lesson.key), key, arm.id, random.Random(3))
        if found != arm:
            assert found in arms_of(lesson.key)
            moved += 1
            other = dict(lesson.asked(found, Units()).questions())[key]
            assert other.solution() != question.solution()
            assert other.asked().form == question.asked().form
    assert moved > 0


def test_a_question_that_no_other_arm_has_stays_on_its_arm() -> None:
    screws = next(lesson for lesson in LESSONS if lesson.key == "screws")
    assert other_arm(screws, texts_of("screws"), "3", "scara", random.Random(1)).id == "scara", (
        "the arm of a single step"
    )
    for arm in ("ur5", "puma560"):
        assert other_arm(screws, texts_of("screws"), "c99", arm, random.Random(1)).id == arm
    assert other_arm(screws, texts_of("screws"), "c99", "gone", random.Random(1)).id == "puma560", (
        "the first of the lesson"
    )


# In words


@pytest.mark.parametrize(
    ("due", "later", "days", "words"),
    [
        (0, 0, 0, "Nothing yet. What you miss in lessons and exercises is asked again from the next day on."),
        (0, 2, 1, "Nothing today; 2 later, the first tomorrow."),
        (3, 0, 0, "3 to answer today."),
        (3, 1, 4, "3 to answer today; 1 later, the first in 4 days."),
    ],
)
def test_the_row_says_how_much_is_due(due: int, later: int, days: int, words: str) -> None:
    assert Counts(due, later, days).words == words


def test_students_read_what_the_teacher_sees_of_their_answers() -> None:
    words = "Your teacher does not see what you answer here, only how much of it was right in the whole class."
    assert words in list_html(Review(), ALL, seated=True)
    assert "Your teacher" not in list_html(Review(), ALL, seated=False)
