"""A lesson is answered in one page from its first step to its check, wrongly and then rightly: nothing breaks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fake_browser import FakeBrowser
from lesson_arms import arms_of
from live_server import serve_viewer

from app.exercises.questions import Question
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.outline import Choice, Number
from app.viewer.server import ViewerServer
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
BROKEN = "Something went wrong"  # what the status says after an exception


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


def wrong_answers(question: Question) -> Iterator[tuple[list[object], object]]:
    """Presses that answer a question wrongly, each with its value."""
    if isinstance(question, Choice):
        yield from ((["answer"], i) for i, option in enumerate(question.options) if not option.right)
    elif isinstance(question, Number):
        yield ["fields"], [["98765.4"]]
    elif question.asked().form == "frame":
        yield ["fields"], [["10 20 30 40 50 60"]]


@pytest.mark.full
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_a_lesson_is_answered_from_end_to_end(server: int, lesson: Any) -> None:
    robot = arms_of(lesson.key)[-1]
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.choose(robot.name)
        tab.set("Lesson", lesson.title)
        tab.wait(lambda: 'data-guide="steps"' in tab.html)

        def press(*key: object, value: object = None) -> None:
            tab.say("feature", ["guide", [*key, len(tab.log)], value])
            tab.settle()
            assert BROKEN not in tab.html, f"{lesson.key}, {key}: {value}"

        outline = lesson.asked(robot, Units())
        at = -1
        for key, question in outline.questions():
            step = len(outline.steps) if key.startswith("c") else int(key.removeprefix("e")) - 1
            if step != at:
                press("go", value=(at := step))
            for kind, value in wrong_answers(question):
                press(*kind, key, value=value)
                assert "Not quite" in tab.html, f"{lesson.key}, {key}: {value}"
            if key.startswith("e"):
                assert isinstance(question, Choice)
                press("answer", key, value=question.right())
            else:
                press("reveal", key)
            assert f'data-question="{key}" data-closed="1"' in tab.html
