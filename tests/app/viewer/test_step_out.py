"""*Step out*: what the status card says, the ghost, and the motion, without a browser."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from bare_page import STORE, BarePage, bare_page
from fake_browser import FakeBrowser

import kin
from app.shared.summaries import Summaries
from app.viewer.arm import Arm
from app.viewer.drive import locked
from app.viewer.lessons.velocity.lesson import VelocityLesson
from app.viewer.session.state import PageState, encode
from app.viewer.step_out import FINDING, ExitFacts, StepOut, is_singular, left

WRIST = np.array([0.3, -1.2, 1.4, -0.7, 0.0, 0.2])  # of a UR5e
UPRIGHT = np.array([0.1, 0.0, np.pi / 2, -1.2, 0.3, 1.0, 0.4])  # of an iiwa


@pytest.fixture(scope="module")
def summaries() -> Iterator[Summaries]:
    """Those of all pages: each search is made once."""
    made = Summaries(threads=1)
    yield made
    made.close()


@pytest.fixture
def page(summaries: Summaries) -> Iterator[BarePage]:
    with bare_page(STORE.get("ur5e")) as opened:
        opened.summaries = summaries  # type: ignore[attr-defined]
        yield opened


def press(page: BarePage, kind: str) -> None:
    """Press a button of the card."""
    assert kind in buttons(page)
    page.post(("feature", StepOut.key, (kind, 1)))
    page.rest()


def buttons(page: BarePage) -> list[str]:
    assert page.feature is not None
    return re.findall('data-guide-do="([a-z]+)"', page.feature.offer)


def words(page: BarePage) -> str:
    assert page.feature is not None
    return page.feature.offer


def step_out(page: BarePage, q: np.ndarray) -> kin.escape.Exits:
    """Press the button at a configuration, and wait for the answer."""
    page.use(page.now.robot, q)
    page.open(StepOut)
    press(page, "find")
    found = page.summaries.exits(page.now.robot, q, ()).future.result(60.0)  # type: ignore[attr-defined]
    end = time.monotonic() + 60.0
    while "are searched" in words(page):  # the page hears of the answer a moment after it is there
        time.sleep(0.005)
        page.rest()
        assert time.monotonic() < end
    assert isinstance(found, kin.escape.Exits)
    return found


def ghosts(page: BarePage) -> list[object]:
    return [props["batched_positions"] for kind, _, props in page.scene() if kind.startswith("Batched")]


def test_it_is_offered_where_the_arm_rests_at_a_singularity(page: BarePage) -> None:
    page.open(StepOut)
    assert not words(page)
    page.pose(WRIST)
    assert buttons(page) == ["find"]
    page.pose(WRIST + 0.01)
    assert not words(page)
    assert is_singular(STORE.get("ur5e"), WRIST)
    assert not is_singular(STORE.get("ur5e"), STORE.get("ur5e").q_home)


def test_the_ways_out_are_said_and_drawn_before_one_is_driven(page: BarePage) -> None:
    found = step_out(page, WRIST)
    assert len(found.exits) == 2
    assert buttons(page) == ["drive", "next", "stay"]
    assert f"moves by {1e3 * found.exits[0].translation:.1f} mm" in words(page)
    assert "Way 1 of 2: " in words(page)
    first = ghosts(page)
    assert len(first) == 1
    assert np.array_equal(page.now.goal, WRIST), "nothing has moved"
    press(page, "next")
    assert "Way 2 of 2: " in words(page)
    assert "no-flip" in words(page)
    assert ghosts(page) != first
    press(page, "drive")
    assert np.allclose(page.now.goal, found.exits[1].q[-1])
    assert page.notices[-1].title == "Out of the singularity"
    assert not ghosts(page)
    assert not words(page)


def test_the_search_can_be_left(page: BarePage, monkeypatch: pytest.MonkeyPatch) -> None:
    page.use(page.now.robot, WRIST)
    page.open(StepOut)
    monkeypatch.setattr(ExitFacts, "exits", None)
    press(page, "find")
    assert "are searched" in words(page)
    press(page, "stay")
    assert buttons(page) == ["find"]


def test_the_way_after_the_last_is_the_first(page: BarePage) -> None:
    step_out(page, WRIST)
    press(page, "next")
    press(page, "next")
    assert "Way 1 of 2: " in words(page)


def test_the_lesson_velocity_offers_the_same(page: BarePage) -> None:
    page.use(page.now.robot, WRIST)
    lesson = page.open(VelocityLesson)
    assert page.control("Step out").visible
    lesson.on_step_out()
    assert page.events == [(FINDING, None)]
    page.events.clear()
    page.open(StepOut)
    page.post(FINDING)
    page.rest()
    assert page.feature is not None
    assert np.array_equal(page.feature.facts.leaving, WRIST)  # type: ignore[attr-defined]


def test_a_way_out_that_keeps_the_tool_is_driven_by_its_waypoints(page: BarePage) -> None:
    page.use(STORE.get("iiwa14"))
    found = step_out(page, UPRIGHT)
    assert found.exits[0].keeps_tool
    T, seen = kin.fk("iiwa14", UPRIGHT), list[np.ndarray]()
    page.move_to, plain = lambda q, *more, **named: (seen.append(q), plain(q, *more, **named)), page.move_to  # type: ignore[method-assign,assign]
    press(page, "drive")
    assert len(seen) > 3
    assert np.allclose(seen[-1], found.exits[0].q[-1])
    assert np.abs(kin.fk("iiwa14", np.array(seen)) - T).max() < 1e-8
    assert np.abs(np.diff(np.array([UPRIGHT, *seen]), axis=0)).max() < 0.06


def drive(page: BarePage) -> tuple[StepOut, kin.escape.Exits]:
    """Step out of an upright arm, and drive the first frame of its first way, which keeps the tool."""
    page.use(STORE.get("iiwa14"))
    found = step_out(page, UPRIGHT)
    assert len(found.exits) >= 2
    assert found.exits[0].keeps_tool
    feature = page.feature
    assert isinstance(feature, StepOut)
    feature.heard(("drive", 1), None)
    feature._go_on_driving(1 / 30)
    assert not np.array_equal(page.now.goal, UPRIGHT)
    feature.refresh()
    feature.schedule()
    return feature, found


def test_the_press_itself_moves_the_arm_so_that_undo_takes_the_way_back(page: BarePage) -> None:
    page.use(STORE.get("iiwa14"))
    found = step_out(page, UPRIGHT)
    assert page.feature is not None
    page.feature.handle(("drive", 1), None)
    assert any(np.array_equal(page.now.goal, q) for q in found.exits[0].q[1:])
    assert page.notices[-1].title == "Stepping out"


def test_the_status_says_that_the_arm_is_out_at_the_end_of_the_way_alone(page: BarePage) -> None:
    _, found = drive(page)
    page.rest()
    assert np.allclose(page.now.goal, found.exits[0].q[-1])
    assert {one.title for one in page.notices[:-1]} == {"Stepping out"}
    assert page.notices[-1] == left(found, found.exits[0], page.units)


def test_no_other_way_is_chosen_while_one_is_driven(page: BarePage) -> None:
    drive(page)
    assert buttons(page) == ["stay"]


def test_who_stays_on_the_way_is_not_said_to_be_out(page: BarePage) -> None:
    drive(page)
    at = page.now.goal
    press(page, "stay")
    assert np.array_equal(page.now.goal, at)
    assert page.notices[-1].title == "Stopped on the way out"


def test_a_joint_that_is_locked_on_the_way_ends_it(page: BarePage) -> None:
    feature, found = drive(page)
    moves = int(np.ptp(found.exits[0].q, axis=0).argmax())
    at = page.now.goal
    page.pose(at, locks=tuple(i == moves for i in range(7)))
    assert np.array_equal(page.now.goal, at)
    assert feature.settings.drive is None
    assert page.notices[-1].title == "Not moved: a joint is locked"


def test_a_way_that_is_none_any_more_is_not_driven_on(page: BarePage, monkeypatch: pytest.MonkeyPatch) -> None:
    feature, found = drive(page)
    at = page.now.goal
    monkeypatch.setattr(ExitFacts, "exits", replace(found, exits=()))
    page.rest()
    assert np.array_equal(page.now.goal, at)
    assert feature.settings.drive is None
    assert page.notices[-1].detail == "What the arm avoids has changed. Press Step out again."


def place(page: BarePage) -> None:
    """An obstacle is placed, and the page has not looked at what goes on yet."""
    page.use(page.now.robot, page.now.goal, obstacles=(kin.Obstacle("sphere", (9.0, 9.0, 9.0), radius=0.1),))
    assert page.feature is not None
    page.feature.on_arm_changed(page.now.changes(None))


@pytest.mark.parametrize("q", [UPRIGHT, WRIST], ids=["keeps the tool", "moves the tool"])
def test_no_way_is_driven_that_was_found_for_other_obstacles(page: BarePage, q: np.ndarray) -> None:
    page.use(STORE.get("ur5e" if q is WRIST else "iiwa14"))
    step_out(page, q)
    place(page)
    assert page.feature is not None
    page.feature.handle(("drive", 1), None)
    assert np.array_equal(page.now.goal, q)
    assert not page.notices


def test_a_way_is_not_driven_on_once_there_are_other_obstacles(page: BarePage) -> None:
    feature, _ = drive(page)
    at = page.now.goal
    place(page)
    feature._go_on_driving(1 / 30)  # the sweep is due before the search has begun anew
    assert np.array_equal(page.now.goal, at)
    assert feature.settings.drive is None
    assert page.notices[-1].detail == "What the arm avoids has changed. Press Step out again."


def test_the_offer_ends_when_the_arm_is_moved(page: BarePage) -> None:
    step_out(page, WRIST)
    page.pose(STORE.get("ur5e").q_home)
    assert not words(page)
    assert not ghosts(page)


def test_an_open_question_about_singularities_hides_it(page: BarePage) -> None:
    step_out(page, WRIST)
    page.activity.withheld = frozenset({"singularities"})
    assert page.feature is not None
    page.feature.on_activity()
    page.rest()
    assert not words(page)
    assert not ghosts(page)


def test_a_locked_joint_is_not_moved(page: BarePage) -> None:
    step_out(page, WRIST)
    page.now = page.now.__class__(page.now.robot, WRIST, page.now.goal, locks=(False,) * 4 + (True, False))
    press(page, "drive")
    assert page.notices[-1].detail == "Unlock 5 wrist 2 first."
    assert np.array_equal(page.now.goal, WRIST)


def test_a_locked_joint_that_would_come_back_is_not_moved_either() -> None:
    q = np.zeros((3, 6))
    q[1, 1] = 0.2
    q[:, 4] = 0.0, 0.1, 0.3
    for joint, said in ((1, "Unlock 2 shoulder first."), (3, None)):
        arm = Arm(STORE.get("ur5e"), q[0], q[0], locks=tuple(i == joint for i in range(6)))
        found = locked(arm, q[1:])
        assert (found and found.detail) == said


@pytest.mark.full
def test_a_page_steps_out_by_its_status_card(port: int) -> None:
    state = {"address": "http://a/", "state": encode(PageState("ur5e", WRIST))}
    with FakeBrowser(port, memory=json.dumps(state)) as tab:
        for kind, next_ in (("find", "Drive there"), ("drive", "Out of the singularity")):
            tab.wait(lambda kind=kind: f'data-guide-do="{kind}"' in tab.html)  # type: ignore[misc]
            tab.say("feature", [StepOut.key, [kind, 1], None])
            tab.wait(lambda next_=next_: next_ in tab.html)  # type: ignore[misc]
