"""*Motors* of the tab *Robot*: the table, its fields, LeRobot's calibration, and a run of *Match motors*."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.viewer.scene.clearance import clearance
from app.viewer.session.state import decode
from app.viewer.tabs.robot.motors.run import COUNT, begun, free, readings_of
from kin import InputError
from kin.motors import Motor

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

SO101 = kin.get_robot("so101")
ROBOTS = kin.builtin_robots()
# Two motors of the real arm count backwards, and all zeros are elsewhere.
REAL = [
    replace(motor, sign=-1 if motor.id in (2, 5) else 1, offset=20.0 * motor.id - 50.0)
    for motor in SO101.motors
    if motor.joint
]


def read(run_or_poses: np.ndarray) -> list[list[float]]:
    return kin.motors.readings_from_q(replace(SO101, motors=REAL), run_or_poses).round(1).tolist()


@pytest.mark.parametrize("robot_id", sorted(ROBOTS))
def test_the_poses_touch_nothing_that_is_drawn(robot_id: str) -> None:
    robot = ROBOTS[robot_id]
    joints = [replace_slide(Motor(joint.name, i), joint.kind) for i, joint in enumerate(robot.joints)]
    run = begun(replace(robot, motors=joints), ())
    drawn = clearance(robot)
    if drawn.at(robot.q_home) is not None:
        assert not robot.revolute.all(), "slides that are drawn into the floor at home"
    else:
        assert [drawn.at(q) for q in run.poses] == [None] * COUNT
    assert (kin.clearance(robot, run.poses) > 0.0).all()


def replace_slide(motor: Motor, kind: str) -> Motor:
    return replace(motor, lead=0.01) if kind == "prismatic" else motor


def test_the_poses_keep_clear_of_the_bodies_of_the_page() -> None:
    poses = begun(SO101, ()).poses
    tool = kin.fk(SO101, poses[1])[:3, 3]
    ball = kin.Obstacle("sphere", xyz=tuple(tool.tolist()), radius=0.05)
    assert not free(SO101, (ball,))(poses[1])
    others = begun(SO101, (ball,)).poses
    assert (kin.clearance(SO101, others, (ball,)) > 0.0).all()


def test_an_arm_that_is_walled_in_is_refused_at_once() -> None:
    wall = kin.Obstacle("sphere", xyz=(0.0, 0.0, 0.1), radius=0.5)
    with pytest.raises(InputError, match="move each joint clearly"):
        begun(SO101, (wall,))
    with pytest.raises(InputError, match="an arm with motors"):
        begun(replace(SO101, motors=()), ())


@pytest.mark.parametrize("text", ["1 2 3 4 5.5", "1, 2,3 ; 4\t5.5", "[1, 2, 3, 4, 5.5]", " 1e0 2 3 4 +5.5\n"])
def test_readings_are_read_as_scripts_print_them(text: str) -> None:
    assert readings_of(text, SO101) == (1.0, 2.0, 3.0, 4.0, 5.5)


def test_readings_of_all_motors_are_taken_without_the_gripper() -> None:
    assert readings_of("1 2 3 4 5.5 77", SO101) == (1.0, 2.0, 3.0, 4.0, 5.5)


@pytest.mark.parametrize(
    "text", ["", "1 2 3 4", "1 2 3 4 5 6 7", "1 2 3 4 nan", "1 2 3 4 1e9", "a b c d e", "1 " * 9999]
)
def test_other_readings_are_refused_with_the_order_of_the_motors(text: str) -> None:
    wanted = "numbers with spaces between: 5 values, of motors 1 shoulder pan, .*, or 6, with 6 gripper"
    with pytest.raises(InputError, match=wanted):
        readings_of(text, SO101)


def test_a_run_solves_from_two_poses_and_from_three() -> None:
    run = begun(SO101, ())
    values = read(run.poses)
    with pytest.raises(InputError):
        run.read(tuple(values[0])).solved()
    for count in (2, 3):
        made = run
        for at in range(count):
            made = made.to(at).read(tuple(values[at]))
        match = made.solved().match
        assert match is not None
        assert match.complete
        assert [m.sign for m in match.motors if m.joint] == [m.sign for m in REAL]
    assert made.solved().to(1).match is None, "what was found is gone where readings may change"


def motors_of(tab: FakeBrowser) -> tuple[Motor, ...]:
    """Those in the link of the page."""
    own = decode(tab.stored(), tuple(ROBOTS.values())).own
    assert own is not None
    return own.robot.motors


def table(tab: FakeBrowser) -> list[list[str]]:
    found = re.search(r'aria-label="Motors">(.*?)</table>', tab.html, re.DOTALL)
    assert found is not None
    rows = re.findall(r"<tr.*?</tr>", found[1], re.DOTALL)[1:]
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


@pytest.mark.full
def test_fields_change_one_motor_and_undo_takes_it_back(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert "Add motors" in str([m["props"].get("label") for m in tab.gui.values()])
        tab.choose("SO-101")
        assert table(tab)[1] == ["2", "shoulder lift", "+", "0", "°"]
        tab.set("Motor", "2 · shoulder lift")
        tab.settle()
        tab.set("Counts", "backwards")
        tab.settle()
        tab.set("Zero at", 91.4)
        tab.settle()
        assert table(tab)[1] == ["2", "shoulder lift", "−", "91.4", "°"]
        assert table(tab)[0] == ["1", "shoulder pan", "+", "0", "°"]
        assert motors_of(tab)[1] == replace(SO101.motors[1], sign=-1, offset=91.4)
        tab.set("Number on the bus", 3)
        tab.wait(lambda: "an id that no other motor has" in tab.html)
        tab.settle()
        assert tab.value("Number on the bus") == 2, "the field shows what counts"
        tab.set("Reads", "LeRobot, 0 to 100")
        tab.wait(lambda: "the two ends in ticks" in tab.html)
        tab.settle()
        calibration = {
            motor.name: {"id": motor.id, "drive_mode": 0, "homing_offset": 5, "range_min": 700, "range_max": 3300}
            for motor in SO101.motors
        }
        tab.set("LeRobot's calibration", json.dumps(calibration))
        tab.settle()
        assert motors_of(tab)[1] == replace(
            SO101.motors[1], sign=-1, offset=91.4, range=(700, 3300), homing_offset=5
        )
        tab.say("undo")
        tab.settle()
        assert motors_of(tab)[1].range is None


@pytest.mark.full
def test_a_calibration_is_opened_as_a_file(port: int) -> None:
    entry = {"drive_mode": 0, "homing_offset": 5, "range_min": 700, "range_max": 3300}
    text = json.dumps({motor.name: {"id": motor.id, **entry} for motor in SO101.motors})
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose("SO-101")
        tab.say("feature", ["motors", ["upload"], ["my_arm.json", text]])
        tab.wait(lambda: "The calibration my_arm.json is used" in tab.html)
        tab.settle()
        assert [motor.range for motor in motors_of(tab)] == [(700, 3300)] * len(SO101.motors)
        for value, message in [
            (["a.json", "{"], "LeRobot's calibration: for each motor the fields"),
            (["a.json", text.replace('"drive_mode": 0', '"drive_mode": 7')], "drive_mode"),
            (["a.json", text.replace("3300", "NaN")], "range_max"),
            (["a.json", "{" * 14_000], "at most 2000 values"),
            (["a.json", None], "a file of at most 15 kB"),
            (["b.json", "x" * 15_001], "a file of at most 15 kB"),
            ("x", "the name and the text of a file"),
        ]:
            tab.log.clear()
            tab.say("feature", ["motors", ["upload"], value])
            tab.wait(lambda: any("The file was not used" in str(m) for m in tab.log))
            assert message in html.unescape(tab.html)
        assert [motor.range for motor in motors_of(tab)] == [(700, 3300)] * len(SO101.motors)
        tab.say("undo")
        tab.wait(lambda: "Calibration" in tab.html)
        tab.settle()
        assert decode(tab.stored(), tuple(ROBOTS.values())).own is None


@pytest.mark.full
def test_match_motors_shows_poses_and_writes_what_it_finds(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose("SO-101")
        poses = begun(SO101, ()).poses
        tab.set("All motors", "Match motors")
        for i, values in enumerate(read(poses)):
            tab.wait(lambda i=i: f'data-motors-pose="{i + 1}"' in tab.html)
            T = kin.fk(SO101, poses[i])
            tab.wait(lambda T=T: np.allclose(tab.tool_pose(), T, atol=1e-6))
            if i == 1:
                tab.set("Readings", "1 2")
                tab.set("Poses", "Next pose")
                tab.wait(lambda: "numbers with spaces between: 5 values" in tab.html)
            tab.settle()
            tab.set("Readings", " ".join(map(str, values)))
            tab.settle()
            tab.set("Poses", "Next pose" if i < COUNT - 1 else "Find signs and zeros")
        tab.wait(lambda: 'data-motors-result="complete"' in tab.html)
        assert "Motor 2, shoulder lift, counts backwards, its zero is at −10.0°." in tab.html
        tab.settle()
        tab.set("Result", "Use")
        tab.wait(lambda: "Signs and zeros are in the arm" in tab.html)
        tab.settle()
        found = {motor.id: motor for motor in motors_of(tab)}
        for motor in REAL:
            assert found[motor.id].sign == motor.sign
            assert found[motor.id].offset == pytest.approx(motor.offset, abs=0.2)
        assert found[6] == SO101.motors[5], "the gripper moves no joint and stays"
