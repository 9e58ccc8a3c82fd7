"""No message to a student's page gives the answer of an open task away, in whichever form."""

from __future__ import annotations

import html
import json
import math
import re
import time
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser, working
from students import ALL, UNITS, Room, begin, exercise, press, text_of

from app.exercises import Asked, Exercise, Variant
from app.exercises.kinds.number import NumberKind
from app.viewer.activity.context import ExerciseContext
from app.viewer.exercises import views
from app.viewer.scene.motion import Pace

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

NUMBER = re.compile(r"[−-]?\d+(?:\.\d+)?(?:e[−-]?\d+)?")
ANGLES, LENGTHS = (1.0, math.degrees(1.0), math.radians(1.0)), (1.0, 1e-3, 0.1, 1e3)
EXACT = 1e-5  # relative: of numbers in the scene, of which there are many


@dataclass
class Heard:
    """What a page got while a task was open.

    Attributes:
        text: all texts.
        block: what the exercise showed before an answer was given.
        said: how often each number was in texts.
        sent: each number that was elsewhere, to six digits and in order.
        times: how often it was.
    """

    text: str
    block: str
    said: Counter[float]
    sent: np.ndarray
    times: np.ndarray


def numbers_in(text: str) -> Counter[float]:
    return Counter(float(found.replace("−", "-")) for found in NUMBER.findall(text))


# What has digits by chance: names of controls, links in base64, outlines of icons.
CHANCE = re.compile(
    r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}|[A-Za-z0-9+/_=-]{40,}|\bd=\"[^\"]*\""
)


def heard(messages: list[dict[str, Any]]) -> Heard:
    texts: list[str] = []
    numbers: list[float] = []
    arrays: list[np.ndarray] = []  # bodies of arms have some 100 000 numbers

    def walk(value: object) -> None:
        match value:
            case str():
                texts.append(value)
            case bool() | None | bytes():
                pass
            case int() | float():
                numbers.append(value)
            case np.ndarray():
                if value.dtype.kind in "fiu":
                    arrays.append(value.ravel())
            case dict():
                for key in value.keys() - {"uuid", "name", "type", "container_uuid", "order"}:
                    walk(value[key])
            case list() | tuple():
                for each in value:
                    walk(each)

    walk(messages)
    text = html.unescape("\n".join(texts))
    said = numbers_in(CHANCE.sub(" ", text))
    sent, times = np.unique(six_digits(np.concatenate([numbers, *arrays])), return_counts=True)
    return Heard(text, "", said, sent, times)


def six_digits(x: np.ndarray) -> np.ndarray:
    """The numbers rounded to six significant digits."""
    with np.errstate(divide="ignore"):
        scale = 10.0 ** (5 - np.clip(np.floor(np.log10(np.abs(x))), -300, 300))
    return np.round(x * scale) / scale


def parts_of(one: Exercise, variant: Variant) -> list[list[tuple[float, float]]]:
    """The numbers of the answer, each as alternatives in other units: a value, and the error that would do."""
    given = one.kind.answer(variant)
    form = one.asked(variant, UNITS).form
    if form == "options" or form == "order" or form == "program":
        return []
    flat = [float(x) for x in np.array(given, float).ravel()] if form != "fields" else [float(x) for x in given]  # type: ignore[attr-defined]
    kind, scales, near = one.kind, ANGLES, 1e-3
    if isinstance(kind, NumberKind):
        unit = kind._shown_unit(UNITS)
        nears = [question.tolerance * unit.scale for question in kind.questions(variant, UNITS)]
        scales = ANGLES if unit == UNITS.angles else LENGTHS if unit == UNITS.lengths else (1.0,)
        return [
            [(value * scale, near * scale) for scale in scales] for value, near in zip(flat, nears, strict=True)
        ]
    if form == "table":
        return [[(x * scale, near * abs(x * scale)) for scale in (*ANGLES, *LENGTHS[1:])] for x in flat]
    return [[(x * scale, near * abs(x * scale)) for scale in scales] for x in flat]


def is_right(number: float, alternatives: list[tuple[float, float]]) -> bool:
    return any(abs(number - value) <= near for value, near in alternatives if value)


def is_among(numbers: np.ndarray, alternatives: list[tuple[float, float]]) -> bool:
    """Whether one of the alternatives is among the numbers, to five digits."""
    return any(
        bool(np.any(np.abs(numbers - value) <= max(EXACT * abs(value), 1e-9)))
        for value, _ in alternatives
        if value
    )


def sent_to_one(pages: list[Heard]) -> list[np.ndarray]:
    """For each page, the numbers that it was sent more often than another."""
    numbers = np.unique(np.concatenate([page.sent for page in pages]))
    times = np.zeros((len(pages), len(numbers)), int)
    for row, page in zip(times, pages, strict=True):
        row[np.searchsorted(numbers, page.sent)] = page.times
    return [numbers[row > times.min(axis=0)] for row in times]


def leaks(one: Exercise, pages: list[tuple[Variant, Heard]]) -> list[str]:
    """What gives the answer away: a text of the solution, an odd option, numbers right for each page alone."""
    found: list[str] = []
    for variant, page in pages:
        solution, asked, answer = (
            one.kind.solution(variant, UNITS),
            one.asked(variant, UNITS),
            one.kind.answer(variant),
        )
        if len(solution) > 12 and solution in page.text and solution.rstrip(".") not in asked.labels:
            found.append(f"the solution: {solution}")
        if len(written := json.dumps(answer)) > 12 and (written in page.text or str(answer) in page.text):
            found.append(f"the answer: {written}")
        if asked.form == "program":
            own = [line for line in str(answer).splitlines() if line.strip() and line not in asked.start]
            found += ["the program"] * all(line in page.text for line in own)
        if asked.form == "order" and isinstance(answer, list):
            written = [str(answer), ",".join(map(str, answer)), " ".join(map(str, answer))]
            found += [f"the order: {text}" for text in written if text in page.text]
        if asked.form == "options":
            found += marked_options(asked, page.text)
            others = max(page.text.count(label) for i, label in enumerate(asked.labels) if i != answer)
            found += ["the label of the right option"] * (page.text.count(asked.labels[answer]) > others)  # type: ignore[call-overload]
    constant_said = _common([page.said for _, page in pages])
    constant_block = _common([numbers_in(page.block) for _, page in pages])
    counts = []
    for (variant, page), sent in zip(pages, sent_to_one([page for _, page in pages]), strict=True):
        parts = parts_of(one, variant)
        if is_small(one):  # such numbers are everywhere: only those of the exercise's own blocks are looked at
            said = numbers_in(page.block) - numbers_in(text_of(one, variant)) - constant_block
            right = one.kind.answer(variant)
            number = float(right[0] if isinstance(right, list) else right)  # type: ignore[arg-type]
            counts.append((int(number in said), 1))
            continue
        given = numbers_in(text_of(one, variant))
        parts = [part for part in parts if not is_among(np.array(list(given)), part)]
        said = [number for number in page.said - constant_said if number not in given]
        hits = [
            any(is_right(number, part) for number in said) or is_among(sent, part)
            for part in parts
            if abs(part[0][0]) > 1e-6
        ]
        counts.append((sum(hits), len(hits)))
    if all(total and hits >= max(1, (total + 1) // 2) for hits, total in counts):
        found.append(f"numbers of the answer on every page: {counts}")
    return found


def is_small(one: Exercise) -> bool:
    """Whether the answer is a small whole number, or the index of an option."""
    counted = isinstance(one.kind, NumberKind) and one.kind.unit in ("count", "joint")
    return counted or one.asked(one.variant(0), UNITS).form == "options"


def marked_options(asked: Asked, text: str) -> list[str]:
    """Whether an option's markup differs from that of the others by more than label and index."""
    rows = re.findall(r'<button[^>]*class="kb-option"[^>]*>', text)
    masked = {re.sub(r'data-argument="\d+"|aria-pressed="\w+"', "", row) for row in rows}
    assert len(rows) >= len(asked.labels)
    return [f"options differ: {masked}"] if len(masked) > 1 else []


def _common(counters: list[Counter[float]]) -> Counter[float]:
    common = counters[0]
    for each in counters[1:]:
        common = common & each
    return common


def wrong_answer(one: Exercise, variant: Variant) -> tuple[list[object], object]:
    """A wrong answer as the page's script sends it: its key and value."""
    asked, answer = one.asked(variant, UNITS), one.kind.answer(variant)
    match asked.form:
        case "options":
            return ["answer"], (answer + 1) % len(asked.labels)  # type: ignore[operator]
        case "fields":
            rows = [[text] * len(asked.labels) for text in ("98765", "98640")]
            return ["fields"], [next(row for row in rows if not one.judge(variant, row, UNITS).right)]
        case "posture":
            return ["posture"], None
        case "order":
            return ["answer"], None
        case "frame":
            return ["fields"], [["1 2 3 4 5 6"]]
        case "program":
            return ["fields"], [[asked.start]]
    return ["fields"], [["98.765"] * len(asked.labels)] * asked.rows


def open_all(students: Room, exercises: list[Exercise]) -> dict[str, list[tuple[Variant, Heard]]]:
    """Every exercise on the pages of two students: opened, and answered wrongly where one press does it."""
    found: dict[str, list[tuple[Variant, Heard]]] = {one.id: [] for one in exercises}
    tickets = [students.join(f"Student {i}") for i in range(2)]
    tabs = [students.student(ticket) for ticket in tickets]
    for one in sorted(exercises, key=lambda one: one.robot.id):
        for ticket, tab in zip(tickets, tabs, strict=True):
            variant = students.variant(ticket, one)
            tab.log.clear()
            begin(tab, one)
            rest(tab)
            shown = [message["props"].get("content", "") for message in tab.gui.values()]
            block = html.unescape(" ".join(text for text in shown if 'data-exercises="' in text))
            key, value = wrong_answer(one, variant)
            press(tab, *key, value=value)
            tab.wait(lambda tab=tab: "data-exercises-verdict><b>" in tab.html)
            rest(tab)
            assert "data-exercises-solution" not in tab.html, one.id
            found[one.id].append((variant, replace(heard(tab.log), block=block)))
    return found


def rest(tab: FakeBrowser) -> None:
    """Read all that was queued so far."""
    end = time.monotonic() + 20.0
    while (working() or tab.read(0.003)) and time.monotonic() < end:
        tab.read(0.003)


@pytest.fixture
def fixed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same numbers in each run; two students have different answers where there are any.

    Arms do not ease: where one is when a read-out of it is sent on its way is chance, and may be anywhere.
    """
    monkeypatch.setattr(Pace, "eases", False)
    names: list[str] = []

    @cache
    def two_seeds(*parts: object) -> tuple[int, int]:
        one = exercise(str(parts[0]))
        seeds = [zlib.crc32(f"{salt}:{parts}".encode()) for salt in range(30)]
        first = one.kind.answer(one.variant(seeds[0]))
        others = (seed for seed in seeds[1:] if one.kind.answer(one.variant(seed)) != first)
        return seeds[0], next(others, seeds[0])

    def seed(self: ExerciseContext, *parts: object) -> int:
        if self.name not in names:
            names.append(self.name)
        return two_seeds(*parts)[names.index(self.name) % 2]

    monkeypatch.setattr(ExerciseContext, "seed", seed)


@pytest.mark.full
@pytest.mark.usefixtures("fixed")
def test_no_message_gives_the_answer_of_an_open_task_away(students: Room) -> None:
    found = open_all(students, list(ALL.all))
    assert len(found) == len(ALL.all) >= 49
    assert {key: what for key, pages in found.items() if (what := leaks(exercise(key), pages))} == {}


PLANTS: list[tuple[str, Callable[[Exercise, Variant], str]]] = [
    ("in full", lambda one, variant: html.escape(json.dumps(one.kind.answer(variant)))),
    ("in words", lambda one, variant: one.kind.solution(variant, UNITS)),
]


@pytest.mark.full
@pytest.mark.usefixtures("fixed")
@pytest.mark.parametrize(("how", "plant"), PLANTS, ids=[how for how, _ in PLANTS])
def test_a_leak_is_found(students: Room, monkeypatch: pytest.MonkeyPatch, how: str, plant: Any) -> None:
    """One exercise of each kind; what is planted is in an attribute of the exercise's head."""
    task_html = views.task_html

    def leaking(one: Exercise, variant: Variant, *rest: Any) -> str:
        return task_html(one, variant, *rest).replace(
            "data-exercise=", f'data-a="{plant(one, variant)}" data-exercise='
        )

    monkeypatch.setattr(views, "task_html", leaking)
    kinds = {
        type(one.kind): one
        for one in ALL.all
        if one.kind.answer(one.variant(0)) != one.kind.answer(one.variant(1))
    }
    assert len(kinds) >= 9, "a misprint is in the same term for all"
    found = open_all(students, list(kinds.values()))
    missed = {
        one.id: one.kind.answer(found[one.id][0][0]) for one in kinds.values() if not leaks(one, found[one.id])
    }
    assert missed == {}
