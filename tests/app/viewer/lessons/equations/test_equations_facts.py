"""What the lesson "Equations" knows, without a page, against poses by NumPy alone."""

from __future__ import annotations

import math

import numpy as np
import numpy_arm
import pytest
from arms import CLASSICS
from bare_page import STORE, bare_page

import kin
from app.equations import book
from app.viewer.arm import Arm
from app.viewer.declared.work import Result
from app.viewer.lessons.equations.facts import EquationsFacts
from app.viewer.lessons.equations.lesson import EquationsLesson
from app.viewer.lessons.equations.settings import EquationsSettings

ARMS = pytest.mark.parametrize("robot", CLASSICS, ids=[robot.id for robot in CLASSICS])
AXES, COLUMNS = "xyz", "noap"


def facts(robot: kin.Robot, q: np.ndarray, equation: str = "") -> EquationsFacts:
    return EquationsFacts(EquationsSettings(equation), Arm(robot, q, q), {"book": Result(book(robot))})


@ARMS
def test_values_are_those_of_the_pose_and_misprints_differ_by_what_is_said(robot: kin.Robot) -> None:
    rng = np.random.default_rng(5)
    for each in book(robot).equations:
        for q in robot.random_q(rng, 2):
            known = facts(robot, q, each.id)
            assert known.equation is each
            if each.correct is None:
                continue
            column, row = each.entry.split("_")
            T = numpy_arm.pose(robot, q)
            true = T[AXES.index(row), COLUMNS.index(column)]
            assert float(known.values.correct) == pytest.approx(true, abs=1e-9)
            assert float(known.values.dh) == pytest.approx(true, abs=1e-12)
            if not known.misprinted:
                assert known.largest == 0.0
                assert float(known.values.difference) == pytest.approx(0.0, abs=1e-9)
                continue
            printed = float(known.values.printed)
            assert float(known.values.difference) == pytest.approx(printed - true)
            far, tool = known.segments[0, 1], T[:3, 3]
            assert known.segments[0, 0] == pytest.approx(tool)
            if each.is_length:
                assert abs(printed - true) <= known.largest + 1e-9
                assert far[AXES.index(row)] == pytest.approx(printed)
            else:
                wrong = T[:3, COLUMNS.index(column)].copy()
                right = wrong.copy()
                wrong[AXES.index(row)] = printed
                cosine = float(wrong @ right) / float(np.linalg.norm(wrong))
                assert float(known.values.turn) == pytest.approx(math.acos(min(1.0, cosine)), abs=1e-6)
                assert float(known.values.turn) <= known.largest + 1e-9
                assert np.cross(far - tool, wrong) == pytest.approx(np.zeros(3), abs=1e-9)


@ARMS
def test_it_begins_with_a_misprint_if_there_is_one_that_can_be_read(robot: kin.Robot) -> None:
    first = facts(robot, robot.q_home).equation
    wrong = [e for e in book(robot).equations if e.verdict == "misprinted"]
    assert first is (wrong[0] if wrong else next(e for e in book(robot).equations if e.correct is not None))
    assert facts(robot, robot.q_home, "no such equation").equation is first
    none = EquationsFacts(EquationsSettings(), Arm(robot, robot.q_home, robot.q_home))
    assert none.equation is None
    assert not none.misprinted
    assert none.largest == 0.0


# The page


def test_a_link_that_is_made_while_equations_are_derived_keeps_the_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = STORE.get("pioneer5")
    monkeypatch.setattr(EquationsLesson, "running", lambda self: ())
    with bare_page(robot) as page:
        lesson = page.open(EquationsLesson)
        assert lesson.state() == {}
        page.restore({"equation": "13"})
        assert lesson.state() == {"equation": "13"}


# Messages from one update of the numbers to the next, as many as before this lesson was declared.
FRAMES = {"pioneer5": 4.9, "ur5": 1.6, "scara": 1.6}


@pytest.mark.parametrize("name", FRAMES)
def test_new_numbers_take_no_more_messages_than_before(name: str) -> None:
    robot, count = STORE.get(name), 10
    book(robot)
    with bare_page(robot) as page:
        lesson = page.open(EquationsLesson)
        page.watch()
        for share in np.linspace(0.0, 1.0, count + 1)[1:]:
            page.use(robot, robot.q_home + share * np.array([0.3, -0.2, 0.25, 0.1, 0.2, 0.3])[: robot.n])
            lesson.on_arm_changed(page.now.changes(None))
            page.rest()
        assert 0.5 <= len(page.sent) / count <= FRAMES[name]
