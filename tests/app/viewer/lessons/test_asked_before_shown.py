"""What a step asks is not shown before: in no message, control, label or read-out while its question is open."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import pytest
from fake_browser import FakeBrowser
from lesson_arms import ASKED, arms_of
from live_server import serve_viewer

from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.activity.activity import FACTS
from app.viewer.lessons import LESSONS
from app.viewer.lessons.guide.outline import Choice, Number, Outline
from app.viewer.lessons.guide.progress import Progress
from app.viewer.server import ViewerServer
from kin import Robot
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE, UNITS = Store(), Units()
UR5 = STORE.get("ur5")
KEYS = (
    *("rotations", "screws", "redundancy", "velocity", "trajectories"),
    *("numeric", "postures", "equations", "dh", "inverse"),
)
MOVED = [lesson for lesson in LESSONS if lesson.key in KEYS]
COMMON = {float(n) for n in range(-12, 13)}  # numbers of joints and steps
# What is to be read from the page, or equals other numbers of it by chance.
READ = {
    ("dh", "c1"): "right angles are in many columns of a table; test_dh_facts asks at other configurations",
}
SCALES = {"°": (1.0, math.radians(1.0)), "mm": (1.0, 1e-3, 0.1)}  # of a value in the question's unit
NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?![\w.]*\d)")
MARKUP = re.compile(r"<(?:svg|style)\b.*?</(?:svg|style)>|<[^>]*>", re.DOTALL)


@pytest.fixture(scope="module")
def server() -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port:
        yield port


@dataclass
class Seen:
    """The numbers of a page while a question is open: which it may know, and which it may not."""

    question: Number
    given: set[float]
    shown: set[float]

    @property
    def hits(self) -> set[float]:
        """Numbers on show that would be right answers."""
        unit = self.question.unit
        answer, near = self.question.answer * unit.scale, self.question.tolerance * unit.scale
        if abs(answer) < 1e-6 or answer in COMMON:
            return set()
        error = min(near, 0.005 * abs(answer))
        scales = SCALES.get(unit.name, (1.0,))
        unknown = self.shown - self.given - COMMON
        return {x for x in unknown if any(abs(abs(x) - abs(answer * s)) <= error * s for s in scales)}


def numbers(text: str) -> set[float]:
    plain = html.unescape(MARKUP.sub(" ", text))
    return {float(found.replace("−", "-")) for found in NUMBER.findall(plain)}


def texts(props: dict[str, Any]) -> str:
    return " ".join(str(props[key]) for key in ("content", "text", "label", "hint") if props.get(key))


def press(tab: FakeBrowser, *key: object, value: object = None) -> None:
    tab.say("feature", ["guide", [*key, len(tab.log)], value])


def seen(tab: FakeBrowser, outline: Outline, before: set[str]) -> Iterator[tuple[str, Seen]]:
    """Every number that is asked, with what the page shows meanwhile: the lesson, the scene and the read-out."""
    for key, question in outline.questions():
        if not isinstance(question, Number) or question.whole:
            continue
        at = len(outline.steps) if key.startswith("c") else int(key) - 1
        start = len(tab.log)
        press(tab, "go", value=at)
        tab.settle()
        press(tab, "fields", key, value=[["98765.4"]])
        tab.wait(lambda key=key: "98765.4" in tab.html and "Not quite" in tab.html)  # type: ignore[misc]
        tab.settle()
        own = [m for u, m in tab.gui.items() if u not in before or "kb-readout" in str(m["props"].get("content"))]
        sent = [m.get("updates") or m.get("props") or {} for m in tab.log[start:] if m.get("uuid") not in before]
        words = [texts(m["props"]) for m in [*own, *tab.nodes.values()]] + [texts(props) for props in sent]
        step = None if key.startswith("c") else outline.steps[at]
        stated = [question.prompt, *(one.text for one in (() if step is None else outline.steps[: at + 1]))]
        stated += [q.prompt for _, q in outline.questions()] if step is None else []
        stated += [o.text for _, q in outline.questions() if isinstance(q, Choice) for o in q.options]
        yield key, Seen(question, numbers(" ".join(stated)), numbers(" ".join(words)))


def leaks(server: int, lesson: Any) -> dict[str, list[tuple[str, set[float]]]]:
    """Questions whose answers were on show on at least half of the arms that have them."""
    found: dict[str, list[tuple[str, set[float]]]] = {}
    asked: dict[str, int] = {}
    for robot in arms_of(lesson.key):
        with FakeBrowser(server) as tab:
            tab.settle()
            tab.choose(robot.name)
            before = set(tab.gui)
            tab.set("Lesson", lesson.title)
            tab.wait(lambda: 'data-guide="steps"' in tab.html)
            outline = lesson.asked(robot, UNITS)
            for key, each in seen(tab, outline, before):
                name = key if key.startswith("c") else outline.steps[int(key) - 1].title
                asked[name] = asked.get(name, 0) + 1
                if each.hits and (lesson.key, key) not in READ:
                    found.setdefault(name, []).append((robot.id, each.hits))
    return {name: hits for name, hits in found.items() if 2 * len(hits) >= max(2, asked[name])}


@pytest.mark.full
@pytest.mark.parametrize("lesson", MOVED, ids=lambda lesson: lesson.key)
def test_no_answer_is_on_show_before_it_is_given(server: int, lesson: Any) -> None:
    assert leaks(server, lesson) == {}


# What the panel and the scene have of each lesson when the first question has been answered, and never before.
ANSWERED = {
    "numeric": ("data-outcome=", 'data-plot="iterations"', "/way"),
    "postures": ("data-posture=", "data-branch=", "/postures-"),
    "equations": ("data-equation=", 'aria-label="values here"', "/equations-"),
}


@pytest.mark.full
@pytest.mark.parametrize("key", ANSWERED)
def test_what_a_lesson_draws_and_lists_comes_with_the_answer(server: int, key: str) -> None:
    title = next(lesson.title for lesson in LESSONS if lesson.key == key)
    marks = ANSWERED[key]

    def shown(tab: FakeBrowser) -> list[bool]:
        content = [str(m["props"].get("content")) for m in tab.gui.values() if m["props"].get("visible", True)]
        nodes = [name for name in tab.nodes if name.count("/") > 1 and tab.visible.get(name, True)]
        return [any(mark in text for text in (*content, *nodes)) for mark in marks]

    with FakeBrowser(server) as tab:
        tab.settle()
        if key != "equations":  # the first arm has the chapter's equations
            tab.choose("PUMA 560")
        tab.set("Lesson", title)
        tab.wait(lambda: "data-asked" in tab.html)
        tab.settle()
        assert shown(tab) == [False, False, False]
        press(tab, "reveal", "1")
        tab.wait(lambda: all(shown(tab)))
        assert "data-asked" not in tab.html


def given_away(robot: Robot, outline: Outline) -> list[tuple[str, str]]:
    """Questions, and the reason of an estimate that states the answer, also as a share of the reach."""
    found = []
    for step in outline.steps:
        asked, estimate = step.question, step.estimate
        if not isinstance(estimate, Choice):
            continue
        stated = numbers(" ".join((step.text, estimate.prompt, *(option.text for option in estimate.options))))
        for option in estimate.options:
            said = numbers(option.reason) - stated
            if isinstance(asked, Number):
                shown = float(asked.value_text.removesuffix(asked.unit.suffix.rstrip()).replace("−", "-"))
                values = {abs(shown), abs(shown) * 1e-3, round(100.0 * abs(asked.answer) / robot.reach)}
                leak = bool({abs(x) for x in said} & values)
            elif isinstance(asked, Choice):
                rights = {re.escape(each.text.rstrip(".")) for each in asked.options if each.right}
                leak = any(re.search(rf"(?<!\w){right}(?!\w)", option.reason) for right in rights)
            else:
                leak = False
            if leak:
                found.append((asked.prompt if asked else "", option.reason))
    return found


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_the_reason_of_an_estimate_does_not_answer_the_question_after_it(lesson: Any) -> None:
    for robot in arms_of(lesson.key):
        assert not given_away(robot, lesson.outline(robot, UNITS)), robot.id


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.key)
def test_the_reason_of_an_estimate_speaks_of_what_is_seen(lesson: Any) -> None:
    """Of no symbol, matrix or number of a computation: these are what is asked next."""
    computed = re.compile(r"[₀-₉]|\bp[xyz]\b|\b(column|entry|component|matrix|Jacobian|determinant)\b|\d\.\d{2}")
    for robot in arms_of(lesson.key):
        for step in lesson.outline(robot, UNITS).steps:
            for option in step.estimate.options if isinstance(step.estimate, Choice) else ():
                assert not computed.search(option.reason), (robot.id, option.reason)


def test_a_reason_that_answers_the_question_after_it_is_found() -> None:
    numeric = next(lesson for lesson in LESSONS if lesson.key == "numeric")
    outline = numeric.outline(UR5, UNITS)
    first = outline.steps[0]
    assert isinstance(first.question, Number)
    assert isinstance(first.estimate, Choice)
    share = round(100.0 * first.question.answer / UR5.reach)
    for reason in (f"It is {share} % of the reach.", f"It is {first.question.value_text}."):
        options = tuple(replace(option, reason=reason) for option in first.estimate.options)
        step = replace(first, estimate=replace(first.estimate, options=options))
        assert given_away(UR5, replace(outline, steps=(step,)))


@pytest.mark.full
def test_an_answer_on_show_is_found(server: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Progress, "withheld", frozenset())
    velocity = next(lesson for lesson in LESSONS if lesson.key == "velocity")
    assert "The ellipsoid" in leaks(server, velocity)


def test_steps_withhold_facts_that_there_are() -> None:
    for lesson, robot in ASKED:
        outline = lesson.outline(robot, UNITS)
        named = [step.withheld for step in outline.steps] + [*outline.withheld]
        assert frozenset().union(*named) <= FACTS.keys()
        assert len(outline.withheld) <= len(outline.check)
        assert not any(step.withheld and step.question is None for step in outline.steps)
