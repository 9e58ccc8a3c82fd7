"""Undo, redo, the browser's history, and robots that keep their pose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.panel.joints import lock_buttons
from app.viewer.session.history import LIMIT, History
from app.viewer.session.state import KEY, KEY_REPLACE, KEY_RETURN, PageState, encode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, PUMA, UR5 = (STORE.get(name) for name in ("pioneer5", "puma560", "ur5"))
BASE, ELBOW = "1 rotating base", "2 rotating elbow"


def shows(tab: FakeBrowser, robot: kin.Robot, q: np.ndarray) -> None:
    T = kin.fk(robot, q)
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-9))
    tab.settle()
    assert np.allclose(tab.tool_pose(), T, atol=1e-9)


def turned(base: float = 90.0, elbow: float = 30.0) -> np.ndarray:
    q = PIONEER.q_home.copy()
    q[:2] = np.radians([base, elbow])
    return q


def state(base: float) -> PageState:
    return PageState("pioneer5", turned(base))


def test_states_are_taken_back_in_order_and_forgotten_when_there_are_too_many() -> None:
    history = History()
    for k in range(LIMIT + 5):
        history.record(f"step {k}", state(k))
    present, taken = state(170), 0
    while (step := history.undo(present)) is not None:
        taken += 1
        assert step.label == f"step {LIMIT + 5 - taken}"
        present = step.state
    assert taken == LIMIT
    assert history.labels == ("", "step 5")
    step = history.redo(present)
    assert step is not None
    assert step.state.q is not None
    assert step.state.q[0] == turned(6)[0]
    history.record("another", step.state)
    assert history.labels == ("another", "")


@pytest.mark.full
def test_the_status_of_an_undone_step_ends_with_the_next_action(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.set(BASE, 45.0)
        shows(tab, PIONEER, turned(45.0))
        tab.say("undo")
        tab.wait(lambda: "Undone: Joint 1" in tab.html)
        tab.set("Link frames", True)
        tab.wait(lambda: "<b>Ready</b>" in tab.html)
        assert "Undone" not in tab.html


def test_a_step_that_changed_nothing_is_skipped() -> None:
    history = History()
    history.record("first", state(10))
    history.record("nothing", state(20))
    step = history.undo(state(20))
    assert step is not None
    assert step.label == "first"


@pytest.mark.full
def test_joints_target_and_locks_are_undone_and_redone(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert (tab.script["undo"], tab.script["redo"]) == ("", "")
        tab.set(BASE, 40)
        tab.settle()
        tab.set(ELBOW, 60)
        tab.settle()
        tab.set("Locked", "2")
        tab.wait(lambda: tab.script["undo"] == "Lock")
        tab.say("undo")
        tab.wait(lambda: tab.script["redo"] == "Lock")
        assert tuple(tab.gui[tab.element("Locked")]["props"]["options"]) == lock_buttons([False] * 5)
        assert "Undone: Lock" in tab.html
        tab.say("undo")
        shows(tab, PIONEER, turned(40))
        assert tab.value(ELBOW) == 30
        tab.say("undo")
        shows(tab, PIONEER, turned())
        assert tab.value(BASE) == 90
        tab.say("undo")
        tab.wait(lambda: "Nothing can be undone" in tab.html)
        tab.say("redo")
        tab.say("redo")
        shows(tab, PIONEER, turned(40, 60))
        tab.set(BASE, 80)
        shows(tab, PIONEER, turned(80, 60))
        assert tab.script["redo"] == "", "a new step cannot be followed by an old one"


@pytest.mark.full
def test_a_drag_is_one_step_however_long_it_takes(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        T = kin.fk(UR5, UR5.q_home)
        for _ in range(2):
            tab.grab()
            for _ in range(4):
                T[1, 3] += 0.01
                tab.drag(T)
                tab.settle(quiet=0.05)
            tab.release()
            tab.settle()
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        tab.wait(lambda: tab.script["undo"] == "Drag of the target")
        tab.say("undo")
        tab.settle()
        T[1, 3] -= 0.04
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        tab.say("undo")
        shows(tab, UR5, UR5.q_home)


@pytest.mark.full
def test_a_slider_is_one_step_until_it_is_released(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for value in (80, 70, 60):
            tab.set(BASE, value)
            tab.settle()
        tab.say("released")
        tab.set(BASE, 50)
        tab.settle()
        tab.say("undo")
        shows(tab, PIONEER, turned(60))
        tab.say("undo")
        shows(tab, PIONEER, turned())


@pytest.mark.full
def test_an_unreachable_target_comes_back_with_its_reason(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        T = kin.fk(UR5, UR5.q_home)
        T[:3, 3] = [2.0, 0.0, 0.3]
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)
        tab.settle()
        there = tab.tool_pose()
        tab.set("Go to", "Home")
        shows(tab, UR5, UR5.q_home)
        tab.say("undo")
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), there, atol=1e-9)
        assert np.allclose(tab.gizmo_pose(), T, atol=1e-9)


@pytest.mark.full
def test_settings_are_undone(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        changes = {
            "Radians": True,
            "Lengths": "cm",
            "Target must match": "Point only",
            "Posture": "Keep current",
            "Link frames": True,
            "Arrows along": "Base axes",
            "Show arm as": "Both",
            "Rotations": "Euler Z-Y-Z",
            "Page colours": "Dark",
            "Avoid collisions": True,
            "Lesson": "Velocity",
        }
        labels = {
            "Radians": "Unit of angles",
            "Lengths": "Unit of lengths",
            "Link frames": "View",
            "Rotations": "How rotations are written",
            "Avoid collisions": "View",
        }
        before = {name: tab.value(name) for name in changes}
        for name, value in changes.items():
            tab.set(name, value)
            tab.settle(quiet=0.1)
            assert tab.script["undo"] == labels.get(name, name)
        for name in reversed(changes):
            assert tab.value(name) != before[name]
            tab.say("undo")
            tab.wait(lambda name=name: tab.value(name) == before[name])  # type: ignore[misc]
        tab.settle()
        tab.wait(lambda: tab.script["undo"] == "")
        for name, value in changes.items():
            tab.say("redo")
            tab.wait(lambda name=name, value=value: tab.value(name) == value)  # type: ignore[misc]


@pytest.mark.full
def test_robots_keep_their_pose_and_a_change_of_robot_is_undone(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set(BASE, 40)
        tab.settle()
        tab.choose(PUMA.name)
        tab.set("Locked", "3")
        tab.settle()
        tab.set("Go to", "Random")
        tab.settle()
        q = [tab.value(name) for name in tab.sliders_in("Joints")]
        there = tab.tool_pose()
        tab.choose(PIONEER.name)
        shows(tab, PIONEER, turned(40))
        tab.say("undo")
        tab.wait(lambda: tab.value("Robot") == PUMA.name)
        tab.settle()
        assert np.allclose(tab.tool_pose(), there, atol=1e-9)
        tab.say("redo")
        tab.wait(lambda: tab.value("Robot") == PIONEER.name)
        tab.settle()
        shows(tab, PIONEER, turned(40))
        tab.choose(PUMA.name)
        assert [tab.value(name) for name in tab.sliders_in("Joints")] == q
        assert np.allclose(tab.tool_pose(), there, atol=1e-9)
        locked = tuple(tab.gui[tab.element("Locked")]["props"]["options"])
        assert locked == lock_buttons([i == 2 for i in range(6)])


@pytest.mark.full
def test_the_browser_goes_back_and_forward_through_the_same_steps(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        start = str(tab.script["start"])
        tab.set(BASE, 40)
        tab.wait(lambda: len(tab.kept) == 1)
        tab.set(ELBOW, 60)
        tab.wait(lambda: len(tab.kept) == 2)
        tab.say("travel", tab.kept[0])
        shows(tab, PIONEER, turned(40))
        assert (tab.script["undo"], tab.script["redo"]) == ("Joint 1", "Joint 2")
        tab.say("travel", start)
        shows(tab, PIONEER, turned())
        tab.say("travel", tab.kept[1])
        shows(tab, PIONEER, turned(40, 60))
        assert tab.script["redo"] == ""
        tab.say("travel", encode(PageState("ur5")))
        tab.wait(lambda: tab.value("Robot") == UR5.name)
        tab.say("undo")
        tab.wait(lambda: tab.value("Robot") == PIONEER.name)
        tab.settle()
        shows(tab, PIONEER, turned(40, 60))
        tab.say("travel", "broken")
        tab.wait(lambda: "The link cannot be read" in tab.html)


@pytest.mark.full
def test_a_return_and_a_viewpoint_are_stored_as_what_they_are(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set(BASE, 40)
        tab.wait(lambda: len(tab.kept) == 1)
        tab.look()
        tab.look(position=(1.2, 2.0, 1.5), look_at=(0.0, 0.0, 0.2))
        tab.wait(lambda: len(tab.kept) == 2)
        tab.say("undo")
        tab.wait(lambda: len(tab.kept) == 3)
        assert tab.kept_as == [KEY, KEY_REPLACE, KEY_RETURN]
        assert math.isclose(tab.value(BASE), 90)


@pytest.mark.full
def test_a_step_that_goes_on_after_a_rest_replaces_its_entry(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for count, degrees in enumerate((40, 45, 50), start=1):
            tab.set(BASE, degrees)
            tab.wait(lambda count=count: len(tab.kept) == count)
        tab.set(ELBOW, 20)
        tab.wait(lambda: len(tab.kept) == 4)
        assert tab.kept_as == [KEY, KEY_REPLACE, KEY_REPLACE, KEY]
        tab.say("undo")
        tab.say("undo")
        tab.wait(lambda: tab.value(BASE) == 90)


@pytest.mark.full
def test_a_hostile_message_changes_nothing(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for name in ("nudge", "field", "target", "travel"):
            for argument in (None, 5, [], ["pose", 5], [7, True, 1, False], {"a": 1}, "x" * 20_000):
                tab.say(name, argument)
        tab.settle()
        tab.set(BASE, 45)
        shows(tab, PIONEER, turned(45))
