"""*Review* in a visitor's page: what was missed comes back on the next day, in its lesson or as an exercise."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

from app.exercises import Exercise, Exercises
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.activity import review
from app.viewer.lessons import LESSONS
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ALL = Exercises()
STORE = Store()
UR5 = STORE.get("ur5")
DAY = 86_400.0
TODAY = 20_000
VELOCITY = next(lesson for lesson in LESSONS if lesson.key == "velocity")
QUESTION = next(key for key, one in VELOCITY.outline(UR5, Units()).questions() if key.isdecimal())


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(now=TODAY * DAY + DAY / 2)
    monkeypatch.setattr(review, "time", SimpleNamespace(time=lambda: clock.now))
    return clock


def memory(state: PageState | str, **more: object) -> str:
    text = state if isinstance(state, str) else encode(state)
    return json.dumps({"address": "http://127.0.0.1/", "state": text, **more})


def press(tab: FakeBrowser, feature: str, *key: object, value: object = None) -> None:
    tab.say("feature", [feature, [*key, len(tab.log)], value])


def kept(tab: FakeBrowser) -> dict[str, Any]:
    return decode(tab.kept[-1], STORE.robots).features if tab.kept else {}


def missed(tab: FakeBrowser) -> dict[str, Any]:
    lists = kept(tab).get("review", {}).get("missed", {})
    assert isinstance(lists, dict)
    return lists.get("", {})


def row(tab: FakeBrowser) -> str:
    found = re.findall(r'data-review="row".*?<span>(.*?)</span>', tab.html)
    return html.unescape(found[-1]) if found else ""


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The keys of what was asked again, as far as answers count as remembered or not."""
    found: list[str] = []
    recalled = review.Review.recalled

    def counting(self: review.Review, key: str, right: bool, robot: str = "") -> object:
        found.append(key)
        return recalled(self, key, right, robot)

    monkeypatch.setattr(review.Review, "recalled", counting)
    return found


@pytest.mark.full
def test_an_exercise_that_was_missed_comes_back_with_other_numbers(
    server: int, clock: SimpleNamespace, counted: list[str]
) -> None:
    one = ALL.get("row-distance")
    assert one is not None
    practised = {"exercises": {"seed": 77, "at": "", "done": {}}}
    with FakeBrowser(server, memory=memory(PageState(features=practised))) as tab:
        tab.wait(lambda: row(tab).startswith("Nothing yet."))
        tab.set("Lesson", "Exercises")
        press(tab, "exercises", "open", one.id)
        tab.wait(lambda: f'data-exercise="{one.id}"' in tab.html)
        press(tab, "exercises", "fields", value=[["1"]])
        tab.wait(lambda: missed(tab) == {one.id: [0, TODAY + 1]})
        right = one.kind.answer(one.variant(77))
        press(tab, "exercises", "fields", value=[right])
        tab.wait(lambda: kept(tab)["exercises"]["done"][one.id][0] == 2)
        assert missed(tab) == {one.id: [0, TODAY + 1]}, "it was missed all the same"
        tab.set("Lesson", "None")
        tab.wait(lambda: row(tab) == "Nothing today; 1 later, the first tomorrow.")
        tab.set("Lesson", "Review")
        tab.wait(lambda: 'data-review="list"' in tab.html and "tomorrow" in tab.html)
        assert f'data-question-key="{one.id}"' not in tab.html, "not before its day"
        tab.set("Lesson", "None")
        tab.wait(lambda: decode(tab.kept[-1], STORE.robots).lesson is None)
        before = tab.kept[-1]

    clock.now += DAY
    with FakeBrowser(server, memory=memory(before)) as tab:
        tab.wait(lambda: row(tab) == "1 to answer today.")
        assert "Review (1)" in tab.html
        tab.set("Lesson", "Review")
        tab.wait(lambda: f'data-question-key="{one.id}"' in tab.html)
        press(tab, "review", "open", one.id)
        tab.wait(lambda: f'data-exercise="{one.id}"' in tab.html)
        seed = _seed(tab, one)
        assert one.variant(seed).values != one.variant(77).values
        assert one.variant(seed).text(one.text, Units()) in html.unescape(tab.html)
        press(tab, "review", "fields", value=[one.kind.answer(one.variant(seed))])
        tab.wait(lambda: missed(tab) == {one.id: [1, TODAY + 1 + 3]})
        assert counted == [one.id], "once, in Review"
        assert kept(tab)["exercises"]["done"][one.id][:2] == [2, 2], "the list of exercises is as it was"
        assert "Other numbers" not in tab.html
        press(tab, "review", "list")
        tab.wait(lambda: "Nothing today; 1 later, the first in 3 days." in tab.html)
        tab.say("undo")
        tab.say("undo")
        tab.settle()
        assert missed(tab) == {one.id: [1, TODAY + 4]}, "undo is no way back to the question"


def _seed(tab: FakeBrowser, one: Exercise) -> int:
    tab.wait(lambda: kept(tab).get("review", {}).get("at") == one.id)
    seed = kept(tab)["review"]["seed"]
    assert isinstance(seed, int)
    return seed


@pytest.mark.full
def test_a_question_of_a_lesson_comes_back_on_another_arm(
    server: int, clock: SimpleNamespace, counted: list[str]
) -> None:
    key = f"velocity/{QUESTION}"
    with FakeBrowser(server, memory=memory(PageState("ur5", lesson="velocity"))) as tab:
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        press(tab, "guide", "go", value=int(QUESTION) - 1)
        press(tab, "guide", "reveal", QUESTION)
        tab.wait(lambda: missed(tab) == {key: [0, TODAY + 1, "ur5"]})
        before = tab.kept[-1]

    clock.now += DAY
    with FakeBrowser(server, memory=memory(before)) as tab:
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        assert 'data-review="bar"' not in tab.html
        tab.set("Lesson", "Review")
        tab.wait(lambda: f"{VELOCITY.title}: step {QUESTION}" in html.unescape(tab.html))
        press(tab, "review", "open", key)
        tab.wait(lambda: 'data-review="bar"' in tab.html and f'data-question="{QUESTION}"' in tab.html)
        tab.wait(lambda: missed(tab)[key][2] != "ur5")
        robot = STORE.get(missed(tab)[key][2])
        tab.wait(lambda: tab.value("Robot") == robot.name)
        assert re.search(rf'data-question="{QUESTION}" data-closed="0"', tab.html), "it is open again"
        question = dict(VELOCITY.outline(robot, Units()).questions())[QUESTION]
        answer = question.right()
        assert question.asked().form == "fields"
        press(tab, "guide", "fields", QUESTION, value=question.cells(answer))
        tab.wait(lambda: missed(tab) == {key: [1, TODAY + 4, robot.id, robot.id, "ur5"]})
        tab.wait(lambda: "0 to answer today" in tab.html)
        assert counted == [key], "once, in Review"
        press(tab, "review", "back")
        tab.wait(lambda: "Nothing today; 1 later, the first in 3 days." in tab.html)


def test_a_check_ends_with_two_questions_of_earlier_lessons(server: int, clock: SimpleNamespace) -> None:
    stored: dict[str, dict[str, object]] = {"review": {"missed": {"": {"row-distance": [0, TODAY]}}}}
    steps = len(VELOCITY.outline(UR5, Units()).steps)
    with FakeBrowser(server, memory=memory(PageState("ur5", lesson="velocity", features=stored))) as tab:
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        assert "From earlier lessons" not in tab.html
        press(tab, "guide", "go", value=steps)
        tab.wait(lambda: 'data-guide="earlier">0 of 2 right' in tab.html)
        tab.wait(lambda: len(kept(tab).get("guide", {}).get("earlier", ())) == 2)
        drawn = kept(tab)["guide"]["earlier"]
        assert drawn[0][0] == "row-distance", "what was missed comes first"
        first, second = (ALL.get(exercise_id) for exercise_id, _ in drawn)
        assert first is not None
        assert second is not None
        text = first.variant(drawn[0][1]).text(first.text, Units())
        assert text in html.unescape(tab.html)

        press(tab, "guide", "fields", "r1", value=[["1"]])
        tab.wait(lambda: missed(tab)["row-distance"] == [0, TODAY + 1])
        press(tab, "guide", "fields", "r1", value=[first.kind.answer(first.variant(drawn[0][1]))])
        tab.wait(lambda: 'data-guide="earlier">1 of 2 right' in tab.html)
        press(tab, "guide", "reveal", "r2")
        tab.wait(lambda: missed(tab).get(second.id) == [0, TODAY + 1])
        solution = second.solution(second.variant(drawn[1][1]), Units())
        assert solution[:40] in html.unescape(tab.html)
        tab.wait(lambda: kept(tab)["guide"].get("revealed") == ["r2"])
        before = tab.kept[-1]

    with FakeBrowser(server, memory=memory(before)) as tab:
        tab.wait(lambda: 'data-guide="earlier">1 of 2 right' in tab.html)
        assert text in html.unescape(tab.html), "a reload keeps numbers and answers"
        tab.set("Length unit", "cm") if "Length unit" in tab.html else None
        press(tab, "guide", "restart")
        press(tab, "guide", "go", value=steps)
        tab.wait(lambda: 'data-guide="earlier">0 of 2 right' in tab.html)


@pytest.mark.parametrize(
    "state",
    [
        {"missed": 5, "seed": "x", "at": [], "done": []},
        {"missed": {"": {"velocity/99": [0, 1, "<b>"], "no-such": [0, 1], "swing": [0, 1], "velocity/3": [0, 1]}}},
    ],
    ids=["no list", "rows of nothing"],
)
def test_a_hostile_list_opens_a_page(server: int, clock: SimpleNamespace, state: dict[str, object]) -> None:
    guide = {"earlier": [["swing", -1], ["no-such", 3], ["two-elbows", 3], 5], "given": {"r1": "<b>"}}
    features = {"review": state, "guide": guide}
    with FakeBrowser(server, memory=memory(PageState("ur5", lesson="velocity", features=features))) as tab:
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        press(tab, "review", "open", "no-such")
        press(tab, "review", "open", "velocity/99")
        tab.set("Lesson", "Review")
        tab.wait(lambda: 'data-review="list"' in tab.html)
        if "velocity/3" in str(state):
            press(tab, "review", "open", "velocity/3")
            tab.wait(lambda: 'data-review="bar"' in tab.html)
        assert "<b>" not in tab.html.split('data-guide="steps"')[-1][:0] + row(tab)


def test_a_course_looks_back(server: int, clock: SimpleNamespace) -> None:
    items = [{"lesson": "velocity"}, {"exercise": "row-distance"}]
    course = {"course": {"title": "Mine", "item": items}, "at": -1, "alias": "", "seen": [], "passed": [0]}
    stored: dict[str, dict[str, object]] = {"course": course, "review": {"missed": {"": {"swing": [0, TODAY]}}}}
    with FakeBrowser(server, memory=memory(PageState(lesson="course", features=stored))) as tab:
        tab.wait(lambda: "data-course-back" in tab.html)
        assert html.unescape(tab.html).index("Looking back") > 0
        press(tab, "course", "recall", "swing")
        tab.wait(lambda: 'data-exercise="swing"' in tab.html)
        one = ALL.get("swing")
        assert one is not None
        answer = one.kind.answer(one.variant(_seed(tab, one)))
        press(tab, "review", "fields", value=[answer])
        tab.wait(lambda: missed(tab).get("swing") == [1, TODAY + 3])
        tab.wait(lambda: kept(tab)["course"].get("back", {}).get("swing") == "right")
        tab.set("Lesson", "Courses")
        tab.wait(lambda: re.search(r'data-course-back.*?title="solved"', tab.html, re.DOTALL) is not None)
