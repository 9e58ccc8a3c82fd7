"""*Step out* in the lesson "Velocity": what it says, the ghost, and the motion, without a browser."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from bare_page import STORE, BarePage, bare_page

import kin
from app.shared.summaries import Summaries
from app.viewer.arm import Arm
from app.viewer.lessons.velocity.exits import after, left, locked
from app.viewer.lessons.velocity.facts import VelocityFacts
from app.viewer.lessons.velocity.lesson import VelocityLesson
from kin.escape import Exit

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


def step_out(page: BarePage, q: np.ndarray) -> kin.escape.Exits:
    """Press the button at a configuration, and wait for the answer."""
    page.use(page.now.robot, q)
    page.open(VelocityLesson)
    page.press("Step out")
    page.rest()
    found = page.summaries.exits(page.now.robot, q, ()).future.result(60.0)  # type: ignore[attr-defined]
    page.rest()
    assert isinstance(found, kin.escape.Exits)
    return found


def text(page: BarePage) -> str:
    return json.dumps(page.panel(), ensure_ascii=False)


def ghosts(page: BarePage) -> list[object]:
    return [props["batched_positions"] for kind, _, props in page.scene() if kind.startswith("Batched")]


def test_the_ways_out_are_said_and_drawn_before_one_is_driven(page: BarePage) -> None:
    found = step_out(page, WRIST)
    assert len(found.exits) == 2
    for each in found.exits:
        assert f"moves by {1e3 * each.translation:.1f} mm" in text(page)
    assert "no-flip" in text(page)
    first = ghosts(page)
    assert len(first) == 1
    assert np.array_equal(page.now.goal, WRIST), "nothing has moved"
    page.press("Way out", "2")
    page.rest()
    assert ghosts(page) != first
    page.press("Drive there")
    page.rest()
    assert np.allclose(page.now.goal, found.exits[1].q[-1])
    assert page.notices[-1].title == "Out of the singularity"
    assert not ghosts(page)


def test_a_way_out_that_keeps_the_tool_is_driven_by_its_waypoints(page: BarePage) -> None:
    page.use(STORE.get("iiwa14"))
    found = step_out(page, UPRIGHT)
    assert found.exits[0].keeps_tool
    T, seen = kin.fk("iiwa14", UPRIGHT), list[np.ndarray]()
    page.move_to, plain = lambda q, *more, **named: (seen.append(q), plain(q, *more, **named)), page.move_to  # type: ignore[method-assign,assign]
    page.press("Drive there")
    page.rest()
    assert len(seen) > 3
    assert np.allclose(seen[-1], found.exits[0].q[-1])
    assert np.abs(kin.fk("iiwa14", np.array(seen)) - T).max() < 1e-8
    assert np.abs(np.diff(np.array([UPRIGHT, *seen]), axis=0)).max() < 0.06


def drive(page: BarePage, ways: int = 2) -> tuple[VelocityLesson, kin.escape.Exits]:
    """Step out of an upright arm, and drive the first frame of its first way, which keeps the tool."""
    page.use(STORE.get("iiwa14"))
    found = step_out(page, UPRIGHT)
    assert len(found.exits) >= ways
    assert found.exits[0].keeps_tool
    lesson = page.feature
    assert isinstance(lesson, VelocityLesson)
    lesson.on_drive()
    lesson._drive(1 / 30)
    assert not np.array_equal(page.now.goal, UPRIGHT)
    return lesson, found


def test_the_status_says_that_the_arm_is_out_at_the_end_of_the_way_alone(page: BarePage) -> None:
    _, found = drive(page)
    page.rest()
    assert np.allclose(page.now.goal, found.exits[0].q[-1])
    assert {one.title for one in page.notices[:-1]} == {"Stepping out"}
    assert page.notices[-1].title == "Out of the singularity"


def test_no_other_way_is_chosen_while_one_is_driven(page: BarePage) -> None:
    lesson, found = drive(page)
    lesson.on_exit(1)
    lesson.refresh()
    lesson.schedule()
    assert "Stay here" in text(page)
    assert "Way out" not in text(page)
    assert "Drive there" not in text(page)
    page.rest()
    assert page.notices[-1] == left(found, found.exits[0], page.units)


def test_who_stays_on_the_way_is_not_said_to_be_out(page: BarePage) -> None:
    lesson, _ = drive(page)
    at = page.now.goal
    lesson.on_stay()
    page.rest()
    assert np.array_equal(page.now.goal, at)
    assert page.notices[-1].title == "Stopped on the way out"


def test_a_way_that_is_none_any_more_is_not_driven_on(page: BarePage, monkeypatch: pytest.MonkeyPatch) -> None:
    lesson, found = drive(page)
    at = page.now.goal
    monkeypatch.setattr(VelocityFacts, "exits", replace(found, exits=()))
    page.rest()
    assert np.array_equal(page.now.goal, at)
    assert lesson.settings.driven is None
    assert page.notices[-1].detail == "What the arm avoids has changed. Press Step out again."


def test_the_offer_ends_when_the_arm_is_moved_and_is_not_made_far_from_a_singularity(page: BarePage) -> None:
    step_out(page, WRIST)
    page.pose(STORE.get("ur5e").q_home)
    assert "Step out" not in text(page)
    assert "Drive there" not in text(page)
    assert not ghosts(page)


def test_a_locked_joint_is_not_moved(page: BarePage) -> None:
    page.use(page.now.robot, WRIST)
    step_out(page, WRIST)
    page.now = page.now.__class__(page.now.robot, WRIST, page.now.goal, locks=(False,) * 4 + (True, False))
    page.press("Drive there")
    page.rest()
    assert page.notices[-1].detail == "Unlock 5 wrist 2 first."
    assert np.array_equal(page.now.goal, WRIST)


def test_a_locked_joint_that_would_come_back_is_not_moved_either() -> None:
    q = np.zeros((3, 6))
    q[1, 1] = 0.2
    q[:, 4] = 0.0, 0.1, 0.3
    way = Exit(q, 0.1, True, 0.0, 0.0, 0.0, None, 0.4)
    for joint, words in ((1, "Unlock 2 shoulder first."), (3, None)):
        arm = Arm(STORE.get("ur5e"), q[0], q[0], locks=tuple(i == joint for i in range(6)))
        found = locked(arm, way)
        assert (found and found.detail) == words


def test_frames_pass_whole_waypoints_at_most_as_fast_as_joints_may() -> None:
    q = np.linspace(0.0, 1.0, 101)[:, None] * np.array([1.0, -0.5])
    assert after(q, 0, 0.1) == 5
    assert after(q, 98, 1.0) == 100
    assert after(q, 10, 0.0) == 11, "at least one"
