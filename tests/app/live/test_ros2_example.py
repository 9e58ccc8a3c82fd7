"""`examples/ros2_arm.py` with a rosbridge of the test's own: the ghost, a driven arm, and every reason to stop."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest
import ros2_arm
from example_run import ExampleRun
from live_code import code_of
from rosbridge import Rosbridge

import kin
from kin.notebook import driving

UR5 = kin.get_robot("ur5")
NAMES = [f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
HERE = np.array([0.3, -1.2, 1.4, -0.4, 0.5, 0.2])
SPEED = 40.0  # deg/s


@pytest.fixture
def bridge() -> Iterator[Rosbridge]:
    with Rosbridge(dict(zip(NAMES, HERE, strict=True)), ros2_arm.TRAJECTORY) as bridge:
        bridge.extra = [("finger_joint", 0.04), ("broken_joint", None)]
        yield bridge


def started_with(viewer, page, bridge, *words) -> ExampleRun:
    return ExampleRun(ros2_arm.main, viewer, page, ["--rosbridge", bridge.address, *words])


@pytest.fixture
def run(viewer, page, bridge):
    runs = []

    def started(*words) -> ExampleRun:
        runs.append(started_with(viewer, page, bridge, "--joints", ",".join(NAMES), *words))
        return runs[-1]

    yield started
    for each in runs:
        each.end(page)
    page.settle()


def ghost(page) -> list[str]:
    return [n for n in page.nodes if n.endswith("/measured") and page.visible.get(n, True)]


def test_the_ghost_is_where_the_arm_of_ros_is(page, bridge, run):
    run()
    page.wait(lambda: bool(ghost(page)))
    assert bridge.received == []
    assert bridge.errors == []
    bridge.silent = True
    page.set("Robot", kin.get_robot("panda").name)
    page.wait(lambda: "data-live-measured" not in page.html)


@pytest.mark.full
def test_a_driven_arm_follows_slowly_and_starts_where_it_is(page, bridge, run, patient, capsys):
    run("--drive", "--yes", "--speed", f"{SPEED}")
    page.wait(lambda: page.shown.get("driven", "").startswith("ROS 2 arm at ws://127.0.0.1"))
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.wait(lambda: bool(np.allclose(page.tool_pose(), kin.fk(UR5, HERE), atol=1e-5)))
    assert bridge.received == [], "nothing moves before the page does"
    page.set("1 base", 60.0)
    goal = np.radians(60.0)
    page.wait(lambda: abs(bridge.q[NAMES[0]] - goal) < 1e-3)
    assert bridge.errors == []
    rest = bridge.configuration(NAMES)[1:]
    assert rest == pytest.approx(HERE[1:], abs=1e-6)
    asked = np.array(
        [
            dict(zip(b["joint_names"], b["points"][0]["positions"], strict=True))[NAMES[0]]
            for _, b in bridge.received
        ]
    )
    times = np.array([t for t, _ in bridge.received])
    assert len(asked) > 5
    assert (np.diff(asked) > 0.0).all()
    average = (asked[-1] - asked[0]) / (times[-1] - times[0])
    assert average < np.radians(SPEED) * 1.5


@pytest.mark.parametrize("answer", ["", "no", "YES!"])
def test_without_a_yes_nothing_moves(page, bridge, run, monkeypatch, capsys, answer):
    monkeypatch.setattr("builtins.input", lambda _: answer)
    started = run("--drive")
    started.wait()
    assert started.codes == [1]
    assert "not confirmed: the arm was not moved" in capsys.readouterr().err
    assert bridge.received == []


def driven(page, bridge, run, capsys, *words):
    """A run whose arm is on its way."""
    started = run("--drive", "--yes", "--speed", "10", *words)
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.set("1 base", 90.0)
    page.wait(lambda: len(bridge.received) > 3)
    return started


@pytest.mark.full
def test_a_silent_arm_is_not_moved_any_further(page, bridge, run, patient, monkeypatch, capsys):
    started = driven(page, bridge, run, capsys)
    monkeypatch.setattr(driving, "ARM_LOST", 0.5)
    bridge.silent = True
    started.wait()
    assert started.codes == [1]
    assert "the arm has said nothing for 0.5 s" in capsys.readouterr().err
    assert bridge.q[NAMES[0]] < np.radians(45.0)
    page.wait(lambda: page.shown["driven"] == "")


@pytest.mark.full
def test_a_page_that_leaves_stops_the_arm(page, bridge, run, patient, capsys):
    started = driven(page, bridge, run, capsys)
    started.end(page)
    assert started.codes == [1]
    said = capsys.readouterr().err
    assert "The page has withdrawn the code." in said or "the page does not answer" in said
    sent = len(bridge.received)
    time.sleep(3 * ros2_arm.CYCLE + ros2_arm.HORIZON)
    assert len(bridge.received) == sent
    assert bridge.q[NAMES[0]] == pytest.approx(bridge.received[-1][1]["points"][0]["positions"][0], abs=1e-6)


@pytest.mark.full
def test_an_arm_that_is_held_is_not_pushed(page, bridge, run, patient, capsys):
    started = driven(page, bridge, run, capsys, "--speed", "60")
    bridge.stuck = True
    started.wait()
    assert started.codes == [1]
    assert "base is" in (said := capsys.readouterr().err)
    assert "behind: something holds it" in said
    pushed = bridge.received[-1][1]["points"][0]["positions"][0] - bridge.q[NAMES[0]]
    assert pushed < np.radians(25.0 + 60.0 * 1.0)


def test_another_arm_in_the_page_stops(page, bridge, run, patient, capsys):
    started = driven(page, bridge, run, capsys)
    page.set("Robot", kin.get_robot("panda").name)
    started.wait()
    assert started.codes == [1]
    assert "the page shows" in capsys.readouterr().err


def test_a_lost_rosbridge_stops(viewer, page, patient, monkeypatch, capsys):
    with Rosbridge(dict(zip(NAMES, HERE, strict=True)), ros2_arm.TRAJECTORY) as bridge:
        started = started_with(viewer, page, bridge, "--joints", ",".join(NAMES), "--drive", "--yes")
        page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
        monkeypatch.setattr(driving, "ARM_LOST", 0.5)
    started.wait()
    assert started.codes == [1]
    assert "the arm has said nothing for 0.5 s" in capsys.readouterr().err


def test_joints_of_other_names_are_listed(viewer, page, bridge, monkeypatch, capsys):
    monkeypatch.setattr(ros2_arm, "WAITING", 0.2)
    started = started_with(viewer, page, bridge)
    started.wait()
    said = capsys.readouterr().err
    assert started.codes == [1]
    assert "/joint_states says nothing of base, shoulder, elbow, wrist 1, wrist 2, wrist 3" in said
    assert "it has elbow_joint, finger_joint, shoulder_lift_joint" in said


def test_what_goes_wrong_is_one_line(viewer, page, bridge, monkeypatch, capsys):
    monkeypatch.setattr(ros2_arm, "OPENING", 0.3)
    address = ["--address", f"http://127.0.0.1:{viewer}"]
    for words, said in (
        (["--joints", "a,b"], "--joints: got a, b, expected 6 different names, for the joints base, shoulder"),
        (
            ["--rosbridge", "localhost"],
            "--rosbridge: got 'localhost', expected an address such as ws://localhost:9090",
        ),
        (["--rosbridge", "ws://127.0.0.1:9"], "no rosbridge at ws://127.0.0.1:9: is it running?"),
    ):
        code = code_of(page)
        assert ros2_arm.main([code, *address, "--rosbridge", bridge.address, *words]) == 1
        assert said in capsys.readouterr().err
        page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
        page.wait(lambda: "data-live-code" not in page.html)
