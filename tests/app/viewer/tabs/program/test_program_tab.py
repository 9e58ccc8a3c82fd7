"""The tab *Program* in a page: recording, playing, undo, locks, own arms, and the link."""

from __future__ import annotations

import html
import json
import math
import re

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.session.state import decode
from app.viewer.tabs.program.items import MOST

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5 = STORE.get("pioneer5"), STORE.get("ur5")
TURN = "1 rotating base"


def part(tab: FakeBrowser, name: str) -> str:
    found = [
        m["props"]["content"]
        for m in tab.gui.values()
        if f'data-program="{name}"' in m["props"].get("content", "")
    ]
    return found[0] if found else ""


def clock(tab: FakeBrowser) -> dict[str, str]:
    return dict(re.findall(r'data-(\w+)="([^"]*)"', part(tab, "clock")))


def press(tab: FakeBrowser, name: str, *index: int, value: object = None) -> None:
    tab.serial = getattr(tab, "serial", 0) + 1  # type: ignore[attr-defined]
    number = tab.say("feature", ["program", [name, *index, tab.serial], value])  # type: ignore[attr-defined]
    tab.wait(lambda: tab.script["reply"][0] >= number)


def titles(tab: FakeBrowser) -> list[str]:
    return [html.unescape(t) for t in re.findall(r'kb-program-title" dir="auto">(.*?)<', part(tab, "list"))]


def turned(degrees: float, robot: kin.Robot = PIONEER) -> np.ndarray:
    q = robot.q_home.copy()
    q[0] = math.radians(degrees)
    return q


def shows(tab: FakeBrowser, robot: kin.Robot, q: np.ndarray) -> None:
    T = kin.fk(robot, q)
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-5))


def record(tab: FakeBrowser, *degrees: float) -> None:
    for angle in degrees:
        tab.set(TURN, angle)
        shows(tab, PIONEER, turned(angle))
        press(tab, "record")


def test_recorded_poses_are_played(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20, 50)
        assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
        program = [kin.motion.Ptp(target=kin.motion.JointTarget(tuple(turned(50))))]
        motion = kin.plan_motion(PIONEER, program, turned(20))
        assert float(clock(tab)["duration"]) == pytest.approx(motion.duration, abs=2e-3)
        tab.set(TURN, 100)
        shows(tab, PIONEER, turned(100))
        press(tab, "play")
        assert clock(tab)["playing"] == "1"
        tab.wait(lambda: clock(tab)["playing"] == "0")
        assert clock(tab)["time"] == clock(tab)["duration"]
        shows(tab, PIONEER, turned(50))
        press(tab, "scrub", value=0.0)
        shows(tab, PIONEER, turned(20))
        assert tab.script["undo"] == "Time of the program"


def test_moving_the_arm_ends_playing(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 10, 170)
        press(tab, "loop", value=True)
        press(tab, "play")
        tab.wait(lambda: float(clock(tab)["time"]) > 0.05)
        tab.set(TURN, 35)
        tab.wait(lambda: clock(tab)["playing"] == "0")
        shows(tab, PIONEER, turned(35))


def test_every_change_can_be_undone(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20, 50)
        press(tab, "field", 1, value=["name", "<b>above</b>"])
        assert titles(tab) == ["Waypoint 1", "<b>above</b>"]
        press(tab, "duplicate", 0)
        press(tab, "up", 2)
        assert titles(tab) == ["Waypoint 1", "<b>above</b>", "Waypoint 3"]
        press(tab, "delete", 0)
        press(tab, "clear")
        assert titles(tab) == []
        for expected in (2, 3, 3, 2, 2, 1, 0):
            tab.wait(lambda: bool(tab.script["undo"]))
            while tab.script["undo"] in ("Joint 1",):
                tab.say("undo")
                tab.settle()
            tab.say("undo")
            tab.settle()
            assert len(titles(tab)) == expected
        tab.say("redo")
        tab.settle()
        assert titles(tab) == ["Waypoint 1"]


def test_a_program_lives_in_the_link_one_for_each_robot(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20, 50)
        press(tab, "field", 1, value=["speed", "50"])
        tab.choose(UR5.name)
        assert titles(tab) == []
        press(tab, "record")
        tab.settle(0.8)
        link = tab.kept[-1]
        programs = decode(link, STORE.robots).features["program"]["programs"]
        assert set(programs) == {"pioneer5", "ur5"}  # type: ignore[call-overload]
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        tab.settle()
        assert titles(tab) == ["Waypoint 1"]
        tab.choose(PIONEER.name)
        assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
        assert "PTP at 50 % speed" in part(tab, "list")


def type_limit(tab: FakeBrowser, text: str) -> None:
    """Type the upper limit of the first row in the tab *Robot*."""
    revision = int(re.findall(r'data-revision="(\d+)"><?', tab.html.split('data-arm="table"')[1])[0])
    number = tab.say("feature", ["robot", ["cell", 0, "high"], [revision, text]])
    tab.wait(lambda: tab.script["reply"][0] >= number)


def test_an_arm_of_ones_own_has_a_program_and_a_refusal_is_at_its_waypoint(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20)
        type_limit(tab, "170")
        assert titles(tab) == []
        record(tab, 20, 150, 40)
        assert titles(tab) == ["Waypoint 1", "Waypoint 2", "Waypoint 3"]
        type_limit(tab, "100")
        rows = part(tab, "list").split("<li")
        assert ["kb-fault" in row for row in rows[1:]] == [False, True, False]
        assert "Segment 2 (PTP) cannot be driven: the target is outside the limits" in rows[2]
        assert 'aria-disabled="true" aria-label="Play"' in part(tab, "player")
        tab.say("undo")
        tab.wait(lambda: "kb-fault" not in part(tab, "list"))


def test_a_locked_joint_keeps_its_value(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 20, 50)
        lock = next(
            u for u, m in tab.gui.items() if m["type"] == "GuiButtonGroupMessage" and "1" in m["props"]["options"]
        )
        tab.send("GuiUpdateMessage", uuid=lock, updates={"value": "1"})
        tab.settle()
        assert "Joint 1 is locked at 50.0°, and this waypoint has it at 20.0°" in html.unescape(part(tab, "list"))
        before = tab.tool_pose()
        press(tab, "play")
        assert clock(tab)["playing"] == "0"
        assert np.allclose(tab.tool_pose(), before)


def test_a_line_that_cannot_be_driven_says_what_would_help(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        record(tab, 10, 170)
        press(tab, "field", 1, value=["kind", "lin"])
        assert "Segment 2 (LIN) cannot be driven" in part(tab, "list")
        assert part(tab, "list").count("kb-fault") == 1
        press(tab, "field", 1, value=["kind", "ptp"])
        assert "kb-fault" not in part(tab, "list")


def test_a_file_is_opened_and_one_that_does_not_fit_is_refused(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        text = "units = { angle = 'deg' }\n" + "[[segments]]\nkind = 'ptp'\nq = [90, 30, 60, 30, 30]\n" * 2
        press(tab, "upload", value=["two.toml", text])
        assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
        for name, content in (
            ("wrong.toml", "kind ="),
            ("other.toml", text.replace(", 30]", "]")),
            ("big.toml", None),
        ):
            press(tab, "upload", value=[name, content])
            tab.wait(lambda: "The file was not used" in tab.html)
            assert titles(tab) == ["Waypoint 1", "Waypoint 2"]


def test_a_program_has_an_end(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for _ in range(MOST + 2):
            press(tab, "record")
        assert len(titles(tab)) == MOST
        assert "The program is full" in tab.html


@pytest.mark.parametrize(
    ("key", "value"),
    [("scrub", "x"), ("scrub", -1), ("rate", 3), ("field", ["q", 1]), ("upload", 5), ("nothing", 1)],
)
def test_messages_that_no_control_sends(port: int, key: str, value: object) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        press(tab, "record")
        press(tab, key, *([0] if key == "field" else []), value=value)
        tab.wait(lambda: 'data-status="error"' in tab.html)
        press(tab, "record")
        assert titles(tab) == ["Waypoint 1", "Waypoint 2"]
