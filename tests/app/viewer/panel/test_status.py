"""The status line: news end, by themselves or with the next action; what is true now stays."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

import kin
from app.viewer.lessons.postures.lesson import Postures
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.panel import status as module
from app.viewer.panel.status import LOOKING, NEWS, READY, Kind, Notice, StatusLine
from kin.units import DEFAULT_UNITS

UNDONE = Notice("hand", "Undone: Home")


@pytest.fixture(autouse=True)
def seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """News may end at once."""
    monkeypatch.setattr(module, "UNSEEN", 0.0)


def line(first: Notice = READY, ready: Notice = READY) -> tuple[StatusLine, Any]:
    element = SimpleNamespace(content="")

    def add_html(content: str, order: float | None = None) -> Any:
        element.content = content
        return element

    gui = Mock()
    gui.add_html = add_html
    return StatusLine(gui, first, ready), element


def test_news_end_after_some_seconds_and_the_present_state_follows() -> None:
    status, element = line()
    now = time.perf_counter()
    assert status.due(now) is None
    status.show(UNDONE)
    due = status.due(now)
    assert due is not None
    assert NEWS - 1.0 < due <= NEWS + 1.0
    assert status.due(now + NEWS + 1.0) == 0.0
    status.settle(None, DEFAULT_UNITS)
    assert "<b>Ready</b>" in element.content
    assert status.due(now + 10.0 * NEWS) is None


def test_after_the_news_who_may_only_look_is_not_asked_to_drag_anything() -> None:
    status, element = line(LOOKING, LOOKING)
    status.show(UNDONE)
    status.settle(None, DEFAULT_UNITS)
    assert "You may look" in element.content
    assert READY.detail not in element.content


def test_news_are_shown_for_a_moment_whatever_else_happens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "UNSEEN", 60.0)
    status, element = line()
    status.show(UNDONE)
    status.settle(None, DEFAULT_UNITS)
    assert "Undone: Home" in element.content


def test_a_warning_stands_apart_from_the_advice_which_a_led_page_hides() -> None:
    status, element = line()
    status.warn("Link 4 touches the <table>.")
    advice = f'<span class="kb-status-advice">{READY.detail} </span>'
    warning = '<span class="kb-status-warning">⚠ Link 4 touches the &lt;table&gt;. </span>'
    assert advice + warning in element.content
    status.show(Notice("hand", "Home"))
    assert "kb-status-advice" not in element.content
    assert "⚠ Link 4" in element.content
    status.warn("")
    assert "kb-callout-detail" not in element.content


@pytest.mark.parametrize("kind", ["hand", "error"])
def test_news_that_the_next_action_came_too_soon_for_end_after_that_moment(
    monkeypatch: pytest.MonkeyPatch, kind: Kind
) -> None:
    monkeypatch.setattr(module, "UNSEEN", 60.0)
    status, element = line()
    status.show(Notice(kind, "Joint 1 was not changed"))
    status.settle(None, DEFAULT_UNITS)
    due = status.due(time.perf_counter())
    assert due is not None
    assert 0.0 < due <= 60.0
    monkeypatch.setattr(module, "UNSEEN", 0.0)
    assert status.due(time.perf_counter()) == 0.0
    status.settle(None, DEFAULT_UNITS)
    assert "was not changed" not in element.content
    status.show(Notice("error", "Joint 2 was not changed"))
    assert status.due(time.perf_counter()) is None, "the next error is not over"


def test_the_result_for_an_open_target_comes_back_after_news() -> None:
    status, element = line()
    result = kin.solve_ik(kin.get_robot("ur5"), [3.0, 0.0, 0.0], task="position")
    status.show(UNDONE)
    status.settle(result, DEFAULT_UNITS)
    assert 'data-status="unreachable"' in element.content
    # A result is no news: neither time nor another action ends it.
    assert status.due(time.perf_counter() + 10.0 * NEWS) is None
    status.settle(None, DEFAULT_UNITS)
    assert 'data-status="unreachable"' in element.content


def test_an_error_stays_until_the_next_action() -> None:
    status, element = line()
    status.show(Notice("error", "Joint 1 was not changed"))
    assert status.due(time.perf_counter() + 10.0 * NEWS) is None
    status.settle(None, DEFAULT_UNITS)
    assert "was not changed" not in element.content


def test_undo_names_the_action_and_not_its_lesson() -> None:
    velocity, postures = object.__new__(VelocityLesson), object.__new__(Postures)
    assert velocity.step_name(("do", ("on_jog", 1, 2), 0, True)) == "Jog"
    assert velocity.step_name(("at", "frame", 0)) == "Velocity"
    assert postures.step_name(("do", ("on_go", 1), 0, True)) == "Posture"


def test_a_sentence_has_the_short_name_of_a_posture() -> None:
    status, element = line()
    robot = kin.get_robot("pioneer5")
    branch = "shoulder front · elbow positive · wrist flip"
    result = kin.solve_ik(robot, kin.fk(robot, robot.q_home), task="approach", branch=branch)
    status.show_result(result, DEFAULT_UNITS)
    assert "(front · elbow + · flip) needs joint 4" in element.content
    assert "branch" not in result.reason


def test_a_warning_beside_ready_makes_the_card_amber_and_both_are_said() -> None:
    status, element = line()
    assert "kb-blue" in element.content
    status.warn("Link 4 touches the table, 12 mm deep.")
    assert "kb-amber" in element.content
    assert "kb-blue" not in element.content
    assert "<b>Ready, but something touches</b>" in element.content
    assert "⚠ Link 4 touches the table" in element.content
    status.show(Notice("error", "Something is wrong"))
    assert "kb-violet" in element.content, "what is wrong already has a colour of its own"
    status.show(UNDONE)
    assert "kb-amber" in element.content
    assert "<b>Undone: Home</b>" in element.content
    status.show(Notice("reached", "Reached"))
    assert "<b>Reached, but something touches</b>" in element.content
    status.show(UNDONE)
    status.warn("")
    assert "kb-blue" in element.content
    status.show(READY)
    assert "<b>Ready</b>" in element.content


def test_what_has_failed_stands_beside_a_notice_that_all_is_well() -> None:
    status, element = line()
    status.fail("the program cannot be driven to its end")
    assert "<b>Ready, but the program cannot be driven to its end</b>" in element.content
    assert "kb-amber" in element.content
    status.show(Notice("reached", "Reached"))
    assert "<b>Reached, but the program cannot be driven to its end</b>" in element.content
    status.warn("Link 4 touches the table, 12 mm deep.")
    assert "<b>Reached, but something touches</b>" in element.content
    status.warn("")
    status.show(Notice("compromise", "Reached with roll error"))
    assert "<b>Reached with roll error</b>" in element.content
    status.fail("")
    status.show(READY)
    assert "<b>Ready</b>" in element.content


def test_what_can_be_done_stands_below_every_notice_until_it_ends() -> None:
    status, element = line()
    status.offer('<button type="button">Step out</button>')
    status.show(Notice("hand", "Home"))
    assert '<button type="button">Step out</button>' in element.content
    status.offer("")
    assert "Step out" not in element.content
