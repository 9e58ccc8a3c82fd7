"""Courses in a visitor's page: followed, edited, kept; result codes; what a link can do."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from fake_browser import FakeBrowser
from lesson_arms import arms_of
from live_server import serve_viewer

from app.classroom.courses import Courses, parse_course, to_data
from app.classroom.hub import Hub
from app.classroom.results import read_code
from app.classroom.results.keys import result_key
from app.exercises import Exercises, Verdict
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.activity.context import ExerciseContext
from app.viewer.activity.practice import Practice
from app.viewer.activity.progress import Progress
from app.viewer.courses.views import CourseView, course_html
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from kin import Robot, get_robot
from kin.files import classic_robots
from kin.parsing import to_toml
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ALL = Exercises()
COURSE = parse_course(
    """
title = "Week <1>"
answers = false
[[item]]
lesson = "velocity"
robot = "scara"
note = "Read <this>."
[[item]]
exercise = "which-joint-goes-down"
[[item]]
exercise = "row-distance"
""",
    ALL,
)
SEED = 77


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    return Settings(data=tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="module")
def server(settings: Settings) -> Iterator[int]:
    with serve_viewer(ViewerServer(Store(), settings, Clouds())) as port:
        yield port


def opened(features: dict[str, dict[str, object]], lesson: str = "course") -> str:
    text = encode(PageState(lesson=lesson, features=features))
    return json.dumps({"address": "http://127.0.0.1/", "state": text})


def linked() -> str:
    """A page that was opened with the link to the course, by a student with our seed."""
    return opened({"course": {"course": to_data(COURSE)}, "exercises": {"seed": SEED, "at": "", "done": {}}})


def press(tab: FakeBrowser, feature: str, key: list[object], value: object = None) -> None:
    tab.say("feature", [feature, key, value])


def shown(tab: FakeBrowser) -> str:
    return html.unescape(tab.html)


def block(tab: FakeBrowser, name: str) -> str:
    """The HTML of a block of the course; empty if it is not there."""
    return next(
        (text for m in tab.gui.values() if f'data-course="{name}"' in (text := m["props"].get("content", ""))), ""
    )


def pass_check(tab: FakeBrowser, lesson: type[Lesson], robot: Robot) -> None:
    """Answer every question of the check of the lesson on show right."""
    outline = lesson.outline(robot, Units())
    press(tab, "guide", ["go", 100], len(outline.steps))
    tab.wait(lambda: 'data-guide="score"' in tab.html)
    asked = [(key, question) for key, question in outline.questions() if key.startswith("c")]
    for serial, (key, question) in enumerate(asked, 101):
        right = question.right()
        options = question.asked().form == "options"
        press(
            tab,
            "guide",
            ["answer" if options else "fields", key, serial],
            right if options else question.cells(right),
        )
    tab.wait(lambda: f"{len(asked)} of {len(asked)} right" in tab.html)


def ask_about(tab: FakeBrowser, robot: Robot) -> None:
    """Leave the arm of the course, which stays on show until then, for one that the lesson asks about."""
    tab.wait(lambda: f"Ask this about {robot.name}" in tab.html)
    press(tab, "guide", ["arm", 71])


def test_a_student_follows_a_course_to_a_result_code(server: int, settings: Settings) -> None:
    with FakeBrowser(server, memory=linked()) as tab:
        tab.wait(lambda: "0 of 3 done" in block(tab, "follow"))
        assert "Week &lt;1&gt;" in block(tab, "follow")
        press(tab, "course", ["next", 1])
        tab.wait(lambda: "1 of 3" in block(tab, "bar") and "1. A column" in tab.html)
        assert "Read &lt;this&gt;." in block(tab, "bar")
        assert tab.value("Robot") == get_robot("scara").name
        press(tab, "course", ["next", 2])
        tab.wait(lambda: "2 of 3" in block(tab, "bar") and 'data-exercise="which-joint-goes-down"' in tab.html)
        assert not re.search("Show the answer|All exercises", tab.html), "the bar leads back to the course"
        press(tab, "exercises", ["reveal", 3])
        assert "kb-exercise-answer" not in block(tab, "bar"), "nothing invites to go on without an answer"
        press(tab, "exercises", ["answer", 4], 2)
        tab.wait(lambda: "✓ Right" in shown(tab))
        assert "Next exercise" not in tab.html, "the course says what comes next"
        assert re.search(r'data-guide-do="next" data-feature="course">Next in the course<', tab.html)
        tab.wait(lambda: "kb-exercise-answer" in block(tab, "bar"))
        press(tab, "course", ["back", 5])
        tab.wait(lambda: "1 of 3" in block(tab, "bar") and "1. A column" in tab.html)
        press(tab, "course", ["list", 6])
        tab.wait(lambda: "1 of 3 done" in block(tab, "follow") and not block(tab, "bar"))
        assert "read, its check is not passed" in block(tab, "follow"), "its pages were only turned"
        assert "Continue" in block(tab, "follow")
        press(tab, "course", ["next", 60])
        tab.wait(lambda: "3 of 3" in block(tab, "bar") and 'data-exercise="row-distance"' in tab.html)  # not begun
        press(tab, "course", ["list", 61])
        tab.wait(lambda: bool(block(tab, "follow")) and not block(tab, "bar"))
        press(tab, "course", ["go", 7], 0)
        ask_about(tab, get_robot("pioneer5"))
        pass_check(tab, VelocityLesson, get_robot("pioneer5"))
        tab.wait(lambda: 'data-feature="course">Next in the course<' in tab.html)
        press(tab, "course", ["list", 8])
        tab.wait(lambda: all(block(tab, "follow").count(s) for s in ("2 of 3 done", "check passed", "nickname")))
        press(tab, "course", ["fields", "alias", 9], [["  "]])
        tab.wait(lambda: "1 to 32 characters" in block(tab, "follow"))
        press(tab, "course", ["fields", "alias", 10], [["Ada <b>"]])
        tab.wait(lambda: "Copy code" in block(tab, "follow"))
        found = re.search(r"\b(?:[0-9A-Z]{5}-){8,}[0-9A-Z]+", block(tab, "follow"))
        assert found is not None
        tab.wait(lambda: any("Ada <b>" in _decoded(text) for text in tab.kept[-1:]))
        kept = tab.kept[-1]
    outcome = read_code(found[0], result_key(Hub.of(settings)))
    assert (outcome.alias, outcome.title, outcome.fingerprint) == ("Ada <b>", COURSE.title, COURSE.fingerprint)
    assert (outcome.score, outcome.solved, outcome.count, outcome.tries) == (50, 1, 2, 1)

    # A reload: the same place, and the marks still count. A teacher checks the code.
    with FakeBrowser(server, memory=json.dumps({"address": "http://127.0.0.1/", "state": kept})) as tab:
        tab.wait(lambda: "2 of 3 done" in block(tab, "follow"))
        press(tab, "course", ["fields", "alias", 1], [["Ada"]])
        tab.wait(lambda: "Copy code" in block(tab, "follow"))
        press(tab, "course", ["close", 2])
        tab.wait(lambda: bool(block(tab, "choose")))
        press(tab, "course", ["fields", "check", 3], [[found[0].lower()]])
        tab.wait(lambda: "Signed by this service" in block(tab, "choose"))
        assert "Ada &lt;b&gt; · Week &lt;1&gt;…: 50 %, 1 of 2 exercises solved" in block(tab, "choose")
        letters = found[0].replace("-", "")
        changed = letters[:-1] + ("A" if letters[-1] != "A" else "B")
        press(tab, "course", ["fields", "check", 4], [[changed]])
        tab.wait(lambda: "Not accepted" in block(tab, "choose"))


def test_a_course_that_is_done_leads_to_the_next_one() -> None:
    courses = Courses(ALL)
    practice = Practice(ALL)
    progress = Progress(courses, practice, lambda: b"secret")
    for number, course in enumerate(courses.all, 1):
        progress.open(course)
        for item in course.items:
            text = course_html(progress, ALL, courses.all, CourseView())
            assert "every step" not in text
            if item.kind == "lesson":
                progress.take_lesson(item.key, item.robot, [item.robot])
            else:
                practice.take(ALL.all[[one.id for one in ALL.all].index(item.key)], Verdict(True, "Yes."), 1.0)
        text = course_html(progress, ALL, courses.all, CourseView())
        assert "You have done every step of this course." in text
        assert "Continue" not in text
        following = [one.title for one in courses.all[number : number + 1]]
        assert re.findall(r'data-guide-do="pick" data-argument="\d">Next course: ([^<]+)<', text) == following
        assert not following or f'data-guide-do="pick" data-argument="{number}"' in text


def test_lessons_of_the_built_in_courses_open_on_an_arm_that_they_ask_about() -> None:
    items = [item for course in Courses(ALL).all for item in course.items if item.kind == "lesson"]
    assert len(items) >= 8
    for item in items:
        assert get_robot(item.robot) in arms_of(item.key), item.key


def _decoded(text: str) -> str:
    return json.dumps(decode(text, builtin_list()).features)


def builtin_list() -> list[object]:
    return [get_robot(robot_id) for robot_id in classic_robots()]


def test_marks_that_were_written_into_a_link_do_not_count(server: int) -> None:
    """A student edits the page's storage: neither the marks nor the answers they would open are shown."""
    done = {"which-joint-goes-down": [2, 1, 0, 5, 100, 0], "row-distance": [3, 1, 0, 5, 100, 0]}
    label = ExerciseContext(f"course {COURSE.fingerprint.hex()} without answers", b"of nobody").label
    for place in ({}, {"in": label}):
        practice = {"seed": SEED, "at": "", "done": done, "proof": "0" * 20, **place}
        memory = opened({"course": {"course": to_data(COURSE)}, "exercises": practice})
        with FakeBrowser(server, memory=memory) as tab:
            tab.wait(lambda: "0 of 3 done" in block(tab, "follow"))
            press(tab, "course", ["go", 1], 2)
            tab.wait(lambda: 'data-exercise="row-distance"' in tab.html)
            assert "data-exercises-solution" not in tab.html


def test_a_proof_belongs_to_place_seed_and_records() -> None:
    here, there = ExerciseContext("course a", b"k"), ExerciseContext("course b", b"k")
    practice = Practice(ALL)
    practice.enter(here)
    one = ALL.all[0]
    practice.take(one, Verdict(True, "Yes."), 1.0)
    state = practice.state()
    for change, proven in (
        ({}, True),
        ({"seed": 1}, False),
        ({"proof": None}, False),
        ({"in": there.label}, False),
        ({"in": ""}, False),
        ({"done": {one.id: [2, 2, 0, 1, 100, 0]}}, False),
    ):
        other = Practice(ALL)
        other.enter(here)
        other.restore({**state, **change})
        assert other.record(one).closed is proven, change
        late = Practice(ALL)
        late.restore({**state, **change})
        late.enter(here)
        assert late.record(one).closed is proven, change
        assert (late.state().get("done") == state["done"]) is proven


def test_each_place_has_its_own_numbers_and_marks() -> None:
    practice, one = Practice(ALL), ALL.get("two-elbows")
    assert one is not None
    seeds = [practice.seed_of(one)]
    for name, key in (("course a", b"k"), ("course b", b"k"), ("course a", b"other")):
        practice.enter(ExerciseContext(name, key))
        seeds.append(practice.seed_of(one))
        assert not practice.record(one).closed
        practice.take(one, Verdict(True, "Yes."), 1.0)
    assert len(set(seeds)) == 4
    practice.enter(None)
    assert not practice.record(one).closed
    practice.enter(ExerciseContext("course a", b"k"))
    assert practice.record(one).closed, "a course that is opened again"


def test_an_answer_that_was_shown_stays_shown_when_undo_leads_back() -> None:
    practice, one = Practice(ALL), ALL.get("two-elbows")
    assert one is not None
    practice.enter(ExerciseContext("course a", b"k"))
    practice.open(one.id)
    before = practice.state()
    practice.give_up(one)
    practice.restore(before)
    practice.take(one, Verdict(True, "Yes."), 1.0)
    assert practice.record(one).mark == "shown"
    practice.again(one)
    practice.take(one, Verdict(True, "Yes."), 1.0)
    practice.restore(before)
    assert practice.record(one).mark == "shown"


def test_a_seat_is_not_left_for_a_course() -> None:
    practice, one = Practice(ALL), ALL.get("two-elbows")
    assert one is not None
    seat = ExerciseContext("seat r s", b"k", seat=True)
    practice.enter(seat)
    other = Practice(ALL)
    other.enter(seat)
    assert practice.seed != other.seed
    assert practice.seed_of(one) == other.seed_of(one), "two pages of one seat have the same numbers"
    practice.enter(ExerciseContext("course a", b"k"))
    practice.enter(None)
    assert practice.seed_of(one) == other.seed_of(one)
    fixed = ALL.get("five-joints")
    assert fixed is not None
    seed = practice.seed_of(fixed)
    practice.again(fixed)
    assert practice.seed_of(fixed) == seed, "where nothing is drawn, other numbers are no other task"


@pytest.mark.full
def test_a_teacher_pairs_exercises_before_and_after(server: int) -> None:
    with FakeBrowser(server, memory=opened({"course": {}})) as tab:
        tab.wait(lambda: "New course" in shown(tab))
        press(tab, "course", ["new", 1])
        tab.wait(lambda: bool(block(tab, "edit")))
        for serial, name in enumerate(("exercise:two-elbows", "lesson:dh", "exercise:other-wrist"), 2):
            press(tab, "course", ["set", "add", serial], name)
        tab.wait(lambda: block(tab, "edit").count("data-course-row") == 3)
        assert block(tab, "edit").count("Did they learn?") == 1, "only the later exercise has an earlier one"
        press(tab, "course", ["set", "before-2", 5], "two-elbows")
        tab.wait(lambda: 'value="two-elbows" selected' in tab.html)
        press(tab, "course", ["up", 6], 2)
        press(tab, "course", ["up", 7], 1)
        tab.wait(lambda: "expected an item that comes after two-elbows in the course" in shown(tab))
        assert block(tab, "edit").count("data-course-row") == 3
        press(tab, "course", ["set", "before-1", 8], "no-such")
        tab.wait(lambda: "before[0]: got 'no-such'" in shown(tab))
        press(tab, "course", ["finish", 9])
        tab.wait(lambda: "0 of 3 done" in block(tab, "follow"))
        kept = decode(tab.stored(), [get_robot("puma560")]).features["course"]["course"]
        assert (kept["before"], kept["after"]) == (["two-elbows"], ["other-wrist"])


def test_a_teacher_makes_a_course(server: int) -> None:
    with FakeBrowser(server, memory=opened({"course": {}})) as tab:
        tab.wait(lambda: all(course.title in shown(tab) for course in Courses(ALL).all))
        press(tab, "course", ["new", 1])
        tab.wait(lambda: bool(block(tab, "edit")))
        press(tab, "course", ["set", "title", 2], "Mine")
        for serial, name in enumerate(("exercise:two-elbows", "lesson:dh", "exercise:row-distance"), 3):
            press(tab, "course", ["set", "add", serial], name)
        tab.wait(lambda: block(tab, "edit").count("data-course-row") == 3)
        press(tab, "course", ["down", 6], 0)
        press(tab, "course", ["delete", 7], 2)
        press(tab, "course", ["set", "note-0", 8], "Read this")
        press(tab, "course", ["set", "title-1", 9], "Both of them")
        press(tab, "course", ["answers", 10])
        press(tab, "course", ["set", "add", 11], "exercise:no-such")
        tab.wait(lambda: "exercise: got 'no-such'" in shown(tab))
        press(tab, "course", ["finish", 12])
        tab.wait(lambda: "0 of 2 done" in block(tab, "follow"))
        assert "Answers are shown when you have found them" in block(tab, "follow")
        press(tab, "course", ["link", 13])
        tab.wait(lambda: "viewer/#s=" in block(tab, "follow"))
        link = re.search(r"viewer/#s=([\w-]+)", block(tab, "follow"))
        assert link is not None
        press(tab, "course", ["download", 14])
        tab.wait(lambda: "mine.toml is saved" in shown(tab))
    made = parse_course(
        'title = "Mine"\nanswers = false\n[[item]]\nlesson = "dh"\nnote = "Read this"\n'
        '[[item]]\nexercise = "two-elbows"\ntitle = "Both of them"',
        ALL,
    )
    assert decode(link[1], builtin_list()).features == {"course": {"course": to_data(made)}}
    with FakeBrowser(server, memory=opened({"course": {}})) as tab:
        tab.wait(lambda: bool(block(tab, "choose")))
        press(tab, "course", ["upload", 1], ["bad.toml", "title = 3"])
        tab.wait(lambda: "bad.toml: title: got 3, expected a text" in shown(tab).replace("Bad", "bad"))
        press(tab, "course", ["upload", 2], ["mine.toml", to_toml(to_data(made))])
        tab.wait(lambda: "0 of 2 done" in block(tab, "follow"))


def test_a_link_with_an_unknown_exercise_says_so(server: int) -> None:
    course = {"title": "Old", "item": [{"exercise": "gone"}]}
    with FakeBrowser(server, memory=opened({"course": {"course": course}})) as tab:
        tab.wait(
            lambda: "The course cannot be used" in shown(tab) and "item[0].exercise: got 'gone'" in shown(tab)
        )
        tab.wait(lambda: bool(block(tab, "choose")))
        press(tab, "course", ["go", 1], 99)
        press(tab, "course", ["upload", 2], 7)
        tab.wait(lambda: "the name and the text of a file" in shown(tab))
        press(tab, "course", ["upload", 3], ["a.toml", None])
        tab.wait(lambda: "a file of at most 16 kB" in shown(tab))


def test_courses_that_nobody_opens_make_no_database(tmp_path: Path) -> None:
    with (
        serve_viewer(ViewerServer(Store(), Settings(data=tmp_path), Clouds())) as port,
        FakeBrowser(port, memory=opened({"course": {}})) as tab,
    ):
        tab.wait(lambda: bool(block(tab, "choose")))
    assert not list(tmp_path.iterdir())
