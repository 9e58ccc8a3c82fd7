"""The lesson on equations: what it shows, when it moves the arm, and what it costs."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from bare_page import bare_page
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.equations import book, books, typeset
from app.equations.derive import derive
from app.shared.clouds import Clouds
from app.shared.computations import ComputationCache
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.lessons.equations import views
from app.viewer.lessons.equations.lesson import EquationsLesson
from app.viewer.own_arm import OwnArm
from app.viewer.server import ViewerServer
from kin.units import DEFAULT_UNITS, Units, fixed

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

PIONEER = kin.get_robot("pioneer5")
PUMA = kin.get_robot("puma560")


@pytest.fixture
def tab() -> Iterator[FakeBrowser]:
    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port, FakeBrowser(port) as opened:
        opened.settle()
        opened.set("Lesson", "Equations")
        opened.say("feature", ["guide", ["go", 1], 1])  # the first question withholds the equations
        opened.wait(lambda: "data-equation" in opened.html)
        yield opened


def press(tab: FakeBrowser, label: str) -> None:
    tab.send("GuiUpdateMessage", uuid=tab.element(label), updates={"value": True})


def values_shown(tab: FakeBrowser) -> list[float]:
    table = re.search(r'(?s)aria-label="values here".*?</table>', tab.html).group()
    return [float(text.replace("−", "-")) for text in re.findall(r"<td[^>]*>([^<]+)</td>", table)]


def drawn(tab: FakeBrowser) -> list[str]:
    inside = (name for name in tab.nodes if name.startswith("/equations-") and name.count("/") > 1)
    return [name for name in inside if tab.visible.get(name)]


# -- in the page --------------------------------------------------------------------------------------------


def test_it_begins_with_a_misprint_and_its_values_follow_the_arm(tab: FakeBrowser) -> None:
    assert tab.value("Equation") == "(6) z of p ✕ misprinted"
    assert "Equation (6):" in tab.html
    q = np.radians([20.0, 30.0, 60.0, 30.0, 30.0])
    tab.set("1 rotating base", 20)
    tab.set("2 rotating elbow", 41)
    q[1] = np.radians(41.0)
    row = book(PIONEER).values(book(PIONEER).equation("6"), q)
    expected = [round(1000 * float(x), 1) for x in (row.printed, row.correct, row.dh)]
    tab.wait(lambda: values_shown(tab) == expected)
    assert f"<b>{1000 * abs(row.difference):.0f} mm</b> here, by 135 mm at worst" in tab.html


def test_show_where_it_is_worst(tab: FakeBrowser) -> None:
    press(tab, "Show the worst pose")
    worst = np.array(book(PIONEER).equation("6").worst)
    tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(PIONEER, worst), atol=1e-6))
    tab.wait(lambda: "<b>135 mm</b> here" in tab.html)
    assert "Equation (6) at its worst" in tab.html


def test_another_equation_and_its_picture(tab: FakeBrowser) -> None:
    assert len(drawn(tab)) == 2
    tab.set("Equation", "(4) x of p ✓")
    tab.wait(lambda: "equal to the DH product" in tab.html)
    tab.wait(lambda: not drawn(tab))
    tab.set("Equation", "(3) the whole matrix ? unreadable")
    tab.wait(lambda: "unreadable</span>" in tab.html)
    assert 'aria-label="values here"' not in tab.html
    tab.set("Equation", "(13) x of a ✕ misprinted")
    tab.wait(lambda: "tool’s z axis (a)" in tab.html)
    tab.wait(lambda: len(drawn(tab)) == 2)
    tab.set("Radians", True)
    tab.wait(lambda: "by 0.616 rad at worst" in tab.html)
    tab.set("Lesson", "None")
    tab.wait(lambda: not drawn(tab) and "data-equation" not in tab.html)


def test_another_arm_has_its_own_equations(tab: FakeBrowser) -> None:
    tab.set("Robot", PUMA.name)
    tab.wait(lambda: "derived and checked" in tab.html)
    assert tab.value("Equation") == "x of p"
    assert not drawn(tab)
    T = kin.fk(PUMA, PUMA.q_home)
    tab.wait(lambda: values_shown(tab) == [round(1000 * T[0, 3], 1)] * 2)
    tab.set("Robot", PIONEER.name)
    tab.wait(lambda: "Equation (6):" in tab.html)
    tab.wait(lambda: len(drawn(tab)) == 2)


def test_equations_that_are_derived_later_belong_to_the_choice_of_the_arm(
    tab: FakeBrowser, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = threading.Event()

    def late(robot: kin.Robot) -> object:
        assert begin.wait(30)
        return derive(robot)

    monkeypatch.setattr(books, "derive", late)
    monkeypatch.setattr(books, "_BOOKS", ComputationCache(ThreadPoolExecutor(1), 4))
    tab.choose(PUMA.name)
    tab.wait(lambda: "Deriving the equations" in tab.html)
    begin.set()
    tab.wait(lambda: "data-equation" in tab.html)
    tab.settle()
    tab.wait(lambda: tab.script["undo"] == "Robot")
    tab.say("undo")
    tab.wait(lambda: tab.value("Robot") == PIONEER.name)


def test_an_equation_that_there_is_not_is_refused_by_name(tab: FakeBrowser) -> None:
    tab.set("Equation", "E = m c²")
    tab.wait(lambda: "Invalid input" in tab.html)
    tab.wait(lambda: tab.value("Equation") == "(6) z of p ✕ misprinted")


def test_a_failed_check_is_said_instead_of_shown(tab: FakeBrowser, monkeypatch: pytest.MonkeyPatch) -> None:
    true = books.derive

    def wrong(robot):
        derived = true(robot)
        return replace(derived, entries={**derived.entries, "o_z": derived.entries["o_y"]})

    monkeypatch.setattr(books, "derive", wrong)
    monkeypatch.setattr(books, "_BOOKS", ComputationCache(ThreadPoolExecutor(1), 4))
    tab.set("Robot", PUMA.name)
    tab.wait(lambda: "o_z of puma560 is off by" in tab.html)
    assert 'data-status="error"' in tab.html
    assert "data-equation" not in tab.html


def test_what_was_chosen_can_be_restored() -> None:
    book(PIONEER)
    with bare_page(PIONEER) as page:
        chosen = page.open(EquationsLesson)
        page.set("Equation", "(13) x of a ✕ misprinted")
        page.rest()
        assert chosen.state() == {"equation": "13"}
    with bare_page(PIONEER) as page:
        other = page.open(EquationsLesson)
        for hostile in ({"equation": "nonsense"}, {"equation": ["13"]}, {"equation": None}, {}):
            page.restore(hostile)
            assert other.state() == {"equation": "6"}
        page.restore(chosen.state())
        assert other.state() == {"equation": "13"}


def test_only_the_last_of_many_edits_is_derived(monkeypatch: pytest.MonkeyPatch) -> None:
    derived: list[kin.Robot] = []

    def counted(robot: kin.Robot) -> object:
        derived.append(robot)
        return derive(robot)

    monkeypatch.setattr(books, "derive", counted)
    cache = ComputationCache(ThreadPoolExecutor(1), 4)
    monkeypatch.setattr(books, "_BOOKS", cache)
    with bare_page(PIONEER) as page:
        lesson = page.open(EquationsLesson)
        for d in (0.1, 0.2, 0.3):
            robot = replace(PUMA, rows=(replace(PUMA.rows[0], d=d), *PUMA.rows[1:]))
            page.use(robot)
            page.own = OwnArm(robot)
            lesson.on_robot()
            lesson.tick(time.perf_counter())
        assert lesson.due is not None
        assert page.now.robot not in cache
        lesson.tick(time.perf_counter() + 1.0)
        assert page.now.robot in cache
        with books.book_later(page.now.robot) as waiting:
            waiting.future.result(30)
        assert derived == [page.now.robot]
        page.rest()
        assert lesson.state() == {"equation": "p_x"}


def test_a_lesson_that_is_closed_or_left_waits_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    released = threading.Event()
    monkeypatch.setattr(books, "derive", lambda robot: released.wait(30) and derive(robot))
    cache = ComputationCache(ThreadPoolExecutor(1), 4)
    monkeypatch.setattr(books, "_BOOKS", cache)
    with bare_page(PUMA) as page:
        for end in (EquationsLesson.remove, EquationsLesson.on_leave):
            lesson = page.open(EquationsLesson)
            assert PUMA in cache
            assert "Deriving the equations" in str(page.panel())
            end(lesson)
            assert PUMA not in cache
    released.set()


def test_an_arm_with_very_many_rows_has_no_equations() -> None:
    fixed_rows = tuple(kin.Joint(f"spacer {k}", kind="fixed") for k in range(books.MOST_ROWS))
    robot = replace(PUMA, rows=(*PUMA.rows, *fixed_rows))
    with bare_page(robot) as page:
        page.open(EquationsLesson)
        assert "at most 16 rows, this arm has 23" in str(page.panel())


# -- as HTML ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_every_equation_of_every_arm_can_be_shown(robot) -> None:
    found = book(robot)
    assert views.summary(found)
    labels = [views.label(e) for e in found.equations]
    assert len(set(labels)) == len(labels)
    T = kin.fk(robot, robot.q_home)
    for equation in found.equations:
        text = views.equation_html(found, equation)
        assert text.count("<div") == text.count("</div>")
        assert text.count("<math") == text.count("</math>") > (0 if equation.correct else -1)
        assert views.symbols_html(found.symbols_of(equation), DEFAULT_UNITS)
        if equation.correct is None:
            continue
        values = found.values(equation, robot.q_home, T)
        assert views.values_html(equation, values, DEFAULT_UNITS, 1.0).count("<td") == (
            2 if equation.verdict == "derived" else 3
        )
        if equation.verdict == "misprinted":
            lines = views.segments(equation, values, T, 0.3)
            assert np.array_equal(lines[0, 0], T[:3, 3])
            if equation.is_length:
                assert np.linalg.norm(lines[0, 1] - lines[0, 0]) == pytest.approx(abs(values.difference))
            else:
                a, b = lines[:, 1] - lines[:, 0]
                assert np.arccos(a @ b / 0.09) == pytest.approx(float(values.turn), abs=1e-6)


def test_names_that_people_typed_are_escaped() -> None:
    rows = (replace(PUMA.rows[0], name="<script>"), *PUMA.rows[1:])
    robot = replace(PUMA, rows=rows)
    text = views.symbols_html(book(robot).symbols.values(), DEFAULT_UNITS)
    assert "<script>" not in text
    assert "&lt;script&gt;" in text


@pytest.mark.parametrize("length", ["cm", "m"])
def test_lengths_follow_the_units(length: str) -> None:
    found, units = book(PIONEER), Units(length=length)
    equation = next(e for e in found.equations if e.verdict == "misprinted" and e.is_length)
    values = found.values(equation, np.array(equation.worst), kin.fk(PIONEER, np.array(equation.worst)))
    off = abs(float(values.difference))
    text = views.values_html(equation, values, units, off)
    assert f" in {length}, at this pose" in text
    assert f">{fixed(units.lengths.scale * float(values.dh), units.lengths.decimals(1))}<" in text
    assert f"off by <b>{units.distance(off)}</b> here" in text
    assert "mm" not in text
    symbols = views.symbols_html(found.symbols.values(), units)
    assert f"{units.lengths.scale * 0.13:.6g} {length}, " in symbols
    assert " mm" not in symbols


def test_notes_are_typeset() -> None:
    d4, s23 = typeset.mathml_name("d4"), typeset.mathml_name("s23")
    assert views.note_html("-d4*s23 & 5") == f"−{d4}\u2009{s23} &amp; 5"


def test_the_columns_that_fail_are_named() -> None:
    found = book(PIONEER)
    text = views.test_html(found, np.radians([40.0, 40.0, 40.0, 40.0, 40.0]))
    assert text.count('data-wrong="1"') == 5 + 5
    assert "Column a and row x cannot be right" in text
    assert "(13)" in text
    still = views.test_html(found, np.array([0.3, 0.5, 0.7, 0.0, 0.4]))  # θ4 is 0
    assert 'data-wrong="1"' not in still
    assert "Zero at this pose" in still


def test_small_and_vanishing_differences_are_not_called_zero() -> None:
    equation = book(PIONEER).equation("6")
    values = book(PIONEER).values(equation, PIONEER.q_home)
    tiny = replace(values, difference=np.array(1e-6))
    assert "<b>&lt; 0.1 mm</b>" in views.error_in_words(equation, tiny, DEFAULT_UNITS, 0.1)[1]
    none = replace(values, difference=np.array(0.0))
    assert views.error_in_words(equation, none, DEFAULT_UNITS, 0.1)[0] == "✓"
