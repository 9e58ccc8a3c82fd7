"""The tab *Robot* in a page: typing, rows, undo, files, and what reaches the link."""

from __future__ import annotations

import base64
import html
import json
import math
import re
import time

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.own_arm import own_arm, pack
from app.viewer.scene.meshes import body
from app.viewer.session.events import SHORT_PAUSE
from app.viewer.session.state import PageState, decode, encode
from app.viewer.tabs.robot import files, views
from app.viewer.tabs.robot.files import MOST
from app.viewer.tabs.robot.presets import PRESETS
from app.viewer.tabs.robot.texts import IN_LINK, Texts
from app.viewer.tabs.robot.texts import MOST as MOST_TEXTS
from app.viewer.tabs.robot.views import MOST_TIPS
from kin.files.urdf.tree import read_tree
from kin.units import DEFAULT_UNITS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5 = STORE.get("pioneer5"), STORE.get("ur5")
HOSTILE = '<script>alert("x")</script>'


def part(tab: FakeBrowser, name: str) -> str:
    (found,) = [
        m["props"]["content"] for m in tab.gui.values() if f'data-arm="{name}"' in m["props"].get("content", "")
    ]
    return str(found)


def cell(tab: FakeBrowser, key: str) -> str:
    """What a field shows, as the server has sent it."""
    found = re.search(
        rf'data-cell="{key}" value="(.*?)"',
        "".join(part(tab, name) for name in ("table", "motion", "frames", "start")),
    )
    assert found is not None, key
    return html.unescape(found[1]).replace("−", "-")


def wrong(tab: FakeBrowser) -> dict[str, str]:
    """The fields that are marked, and why."""
    fields = "".join(part(tab, name) for name in ("start", "table", "motion", "frames"))
    found = re.findall(r'data-cell="([^"]+)"[^>]* aria-invalid="true" title="([^"]*)"', fields)
    return {key: html.unescape(why) for key, why in found}


def revision(tab: FakeBrowser) -> int:
    found = re.search(r'data-revision="(\d+)"', part(tab, "table"))
    assert found is not None
    return int(found[1])


def say(tab: FakeBrowser, *key: object, value: object = None) -> None:
    number = tab.say("feature", ["robot", list(key), value])
    tab.wait(lambda: tab.script["reply"][0] >= number)  # the last of what the message has caused


def type_in(tab: FakeBrowser, row: int | str, column: str, text: str) -> None:
    say(tab, "cell", row, column, value=[revision(tab), text])


def shows(tab: FakeBrowser, robot: kin.Robot, q: np.ndarray) -> None:
    T = kin.fk(robot, q)
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=1e-9))


def saved(tab: FakeBrowser) -> PageState:
    tab.settle(0.8)
    return decode(tab.kept[-1], STORE.robots)


def longer(robot: kin.Robot, row: int, a: float) -> kin.Robot:
    """The robot with another length in a row."""
    data = kin.robot_to_dict(robot)
    data["rows"][row]["a"] = f"{a} m"
    return kin.robot_from_dict(data)


@pytest.mark.full
def test_a_typed_cell_changes_the_arm_and_undo_takes_it_back(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("1 rotating base", 50)
        tab.settle()
        q = PIONEER.q_home.copy()
        q[0] = math.radians(50)
        before = tab.tool_pose()
        type_in(tab, 1, "a", "250")
        shows(tab, longer(PIONEER, 1, 0.25), q)
        assert cell(tab, "1 a") == "250"
        assert tab.value("Robot") == f"My arm ({PIONEER.name} variant)"
        tab.wait(lambda: tab.script["undo"] == "Row 2, a")
        type_in(tab, 1, "a", "255")
        shows(tab, longer(PIONEER, 1, 0.255), q)
        say(tab, "left")
        assert cell(tab, "1 a") == "255"
        tab.say("undo")
        tab.settle()
        assert np.allclose(tab.tool_pose(), before, atol=1e-9)
        assert tab.value("Robot") == PIONEER.name
        assert cell(tab, "1 a") == "160"
        tab.say("redo")
        tab.settle()
        shows(tab, longer(PIONEER, 1, 0.255), q)
        assert tab.value("Robot") == f"My arm ({PIONEER.name} variant)"


@pytest.mark.full
def test_home_and_limits_of_motion_are_typed_and_kept(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert cell(tab, "0 velocity") == ""
        assert 'data-cell="0 velocity" value="" placeholder="180"' in part(tab, "motion")
        type_in(tab, 0, "home", "50")
        type_in(tab, 0, "velocity", "45")
        tab.wait(lambda: tab.script["undo"] == "Row 1, velocity")
        say(tab, "left")
        assert (cell(tab, "0 home"), cell(tab, "0 velocity")) == ("50", "45")
        type_in(tab, 0, "velocity", "0")
        assert list(wrong(tab)) == ["0 velocity"]
        assert "Row 1, velocity: “0” is not valid: expected a positive number" in part(tab, "wrong-motion")
        assert "Not used yet" not in part(tab, "wrong"), "it is said beside its field alone"
        say(tab, "discard")
        own = saved(tab).own
        assert own is not None
        assert own.robot.q_home.tolist() == [math.radians(50), *PIONEER.q_home[1:]]
        assert own.robot.rows[0].velocity == math.radians(45)


def test_no_arm_is_offered_twice_to_start_from(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        titles = re.findall(r"<option[^>]*>(.*?)</option>", part(tab, "start").split('id="kb-arm-name"')[0])
        assert len(titles) == len(set(titles))
        assert set(titles) >= {robot.name for robot in STORE.robots}
        say(tab, "start", value="planar-2r")
        assert '<option value="planar-2r" selected>' in part(tab, "start"), "a link of before still has its name"


@pytest.mark.full
def test_undo_forgets_the_only_expression_that_was_typed(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 2, "alpha", "pi/3")
        assert saved(tab).features["robot"]["texts"] == {"2 alpha": "pi/3"}
        tab.say("undo")
        tab.settle()
        assert "texts" not in saved(tab).features.get("robot", {})


def test_each_choice_is_a_step_and_typing_is_one(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "cell", 1, "kind", value=[revision(tab), "prismatic"])
        say(tab, "cell", 1, "kind", value=[revision(tab), "fixed"])
        tab.say("undo")
        tab.settle()
        assert '<option value="prismatic" selected>' in part(tab, "table")
        tab.say("undo")
        tab.settle()
        assert tab.value("Robot") == PIONEER.name


@pytest.mark.full
def test_slow_typing_is_one_step_until_the_cell_is_left(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 1, "a", "2")
        time.sleep(1.1 * SHORT_PAUSE)
        type_in(tab, 1, "a", "250")
        tab.say("released")
        type_in(tab, 1, "a", "255")
        tab.say("undo")
        tab.settle()
        assert cell(tab, "1 a") == "250"
        tab.say("undo")
        tab.settle()
        assert tab.value("Robot") == PIONEER.name


def test_what_is_wrong_with_a_frame_is_said_below_the_frames(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, "tool", "x", "5o")
        assert "Tool, x: “5o” is not a number" in part(tab, "wrong-frames")
        assert list(wrong(tab)) == ["tool x"]
        assert "5o" not in part(tab, "wrong").partition(">")[2]


@pytest.mark.full
def test_the_mounting_is_chosen_and_the_floor_is_typed(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert '<option value="pedestal" selected>' in part(tab, "frames")
        assumed = re.search(r'data-cell="arm floor" value="" placeholder="(.*?)"', part(tab, "frames"))
        assert assumed is not None
        assert float(assumed[1].replace("−", "-")) == pytest.approx(1000.0 * body(PIONEER).mount.floor)
        type_in(tab, "arm", "mounting", "ceiling")
        assert '<option value="ceiling" selected>' in part(tab, "frames")
        assert (cell(tab, "base roll"), tab.script["undo"]) == ("180", "Mounting")
        type_in(tab, "arm", "floor", "-800")
        type_in(tab, "arm", "floor", "-8oo")
        assert "Floor: “-8oo” is not a number" in part(tab, "wrong-frames")
        own = saved(tab).own
        assert own is not None
        assert (own.robot.mounting, own.robot.floor) == ("ceiling", -0.8)
        floor = next(name for name in tab.nodes if name.endswith("-floor"))
        assert tab.local(floor)[2, 3] == pytest.approx(-0.8)


def test_a_wrong_cell_is_marked_and_the_last_valid_arm_stays(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 2, "alpha", "9o")
        assert "“9o” is not a number" in wrong(tab)["2 alpha"]
        assert "Row 3, α: “9o” is not a number" in part(tab, "wrong")
        assert tab.value("Robot") == PIONEER.name
        tab.wait(lambda: tab.script["undo"] == "")
        type_in(tab, 1, "a", "250")
        assert list(wrong(tab)) == ["2 alpha"]
        shows(tab, longer(PIONEER, 1, 0.25), PIONEER.q_home)
        type_in(tab, 2, "alpha", "90°")
        assert wrong(tab) == {}
        type_in(tab, 0, "low", "200")
        assert list(wrong(tab)) == ["0 low"]
        type_in(tab, 0, "high", "300")
        assert wrong(tab) == {}, "both limits are valid together"
        type_in(tab, 0, "d", "x")
        say(tab, "discard")
        assert wrong(tab) == {}
        assert cell(tab, "0 d") == "130"


def test_what_is_not_valid_ends_with_its_row_unit_or_frame(port: int) -> None:
    with FakeBrowser(port) as tab:

        def lost() -> set[str]:
            return set(re.findall(r"Not used: ([^.]*)\.", html.unescape(tab.html)))

        tab.settle()
        type_in(tab, 0, "low", "9o")
        type_in(tab, 0, "home", "8o")
        type_in(tab, 1, "alpha", "7o")
        type_in(tab, 0, "kind", "fixed")
        assert list(wrong(tab)) == ["1 alpha"], "a fixed row has no such fields"
        assert [text in part(tab, "wrong") for text in ("9o", "7o")] == [False, True]
        assert "8o" not in part(tab, "wrong-motion")
        assert lost() == {"row 1, lower limit (“9o”), row 1, home (“8o”)"}
        type_in(tab, 0, "kind", "revolute")
        assert list(wrong(tab)) == ["1 alpha"]
        say(tab, "discard")
        type_in(tab, 0, "low", "")
        type_in(tab, 0, "high", "")
        assert wrong(tab) == {}, "it has no limits now"
        type_in(tab, 1, "alpha", "7o")
        type_in(tab, 0, "high", "90")
        assert list(wrong(tab)) == ["0 high", "1 alpha"], "it waits for the other limit"
        type_in(tab, 0, "kind", "none")
        assert list(wrong(tab)) == ["0 high", "1 alpha"], "what is refused changes nothing else"
        assert "Row 1, kind" in part(tab, "wrong")
        type_in(tab, 0, "kind", "revolute")
        assert list(wrong(tab)) == ["1 alpha"]
        assert lost() == {"row 1, upper limit (“90”)"}

        say(tab, "discard")
        tab.set("Radians", True)
        tab.settle()
        upper = cell(tab, "1 high")
        type_in(tab, 1, "low", "9")
        assert list(wrong(tab)) == ["1 low"]
        tab.set("Radians", False)
        tab.settle()
        assert wrong(tab) == {}, "9 would be another angle now"
        assert lost() == {"row 2, lower limit (“9”)"}
        assert float(cell(tab, "1 high")) == pytest.approx(math.degrees(float(upper)), abs=1e-3)

        type_in(tab, 1, "a", "6o")
        before = revision(tab)
        say(tab, "frame-add")
        type_in(tab, "frame-0", "x", "5o")
        type_in(tab, "frame-0", "y", "5")
        assert list(wrong(tab)) == ["1 a", "frame-0 x"]
        assert "frame 1, x (“5o”)" not in lost()
        assert revision(tab) == before, "what is typed into the rows meanwhile counts"
        for _ in range(2):
            tab.say("undo")
            tab.settle()
        assert "5o" not in part(tab, "wrong-frames")
        say(tab, "frame-add")
        assert list(wrong(tab)) == ["1 a"], "the new frame is another one"


def test_rows_examples_convention_and_reset(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "start", value="planar-2r")
        two = own_arm(PRESETS["planar-2r"]).robot
        shows(tab, two, two.q_home)
        assert "2 and" in part(tab, "about") or "1 and 2 parallel" in part(tab, "about")
        say(tab, "row", "add", 1)
        assert len(re.findall("data-row=", part(tab, "table"))) == 3
        old = revision(tab)
        say(tab, "row", "up", 2)
        say(tab, "cell", 1, "a", value=[old, "777"])
        assert cell(tab, "1 a") != "777", "a message about rows as they were is dropped"
        say(tab, "row", "remove", 0)
        say(tab, "row", "remove", 0)
        say(tab, "row", "remove", 0)
        assert "The row stays" in tab.html
        say(tab, "convention", value="modified")
        assert "modified convention" in part(tab, "table")
        say(tab, "reset")
        shows(tab, two, two.q_home)
        say(tab, "start", value="ur5")
        assert tab.value("Robot") == UR5.name
        type_in(tab, "tool", "z", "100")
        assert cell(tab, "2 a") == "-392.25"
        say(tab, "reset")
        assert tab.value("Robot") == UR5.name


@pytest.mark.full
def test_the_link_restores_the_arm(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, "arm", "name", HOSTILE)
        type_in(tab, 0, "d", "2*65 + 10")
        state = saved(tab)
        assert state.own is not None
        assert state.own.robot.id == state.robot
        assert state.own.robot.rows[0].d == pytest.approx(0.14)
        memory = json.dumps({"state": tab.kept[-1], "address": "http://x/"})
    with FakeBrowser(port, memory=memory) as again:
        again.settle()
        shows(again, state.own.robot, PIONEER.q_home)
        assert again.value("Robot") == f"My arm ({HOSTILE})"
        assert "<script>" not in again.html
        assert cell(again, "arm name") == HOSTILE
        again.choose(UR5.name)
        again.choose(f"My arm ({HOSTILE})")
        shows(again, state.own.robot, PIONEER.q_home)
        again.set("Copy as", "Python, kin")
        again.wait(lambda: "kin.robot_from_dict(" in again.html)
        again.settle()


def test_an_invalid_arm_in_a_link_is_named(port: int) -> None:
    own = own_arm(PRESETS["planar-2r"])
    text = encode(PageState(own.robot.id, own=own))
    assert decode(text, STORE.robots).own == own
    broken = {"v": 1, "robot": "own", "own": {"n": HOSTILE, "r": [[HOSTILE, 0, 100, 0]]}}
    memory = json.dumps({"state": base64.urlsafe_b64encode(json.dumps(broken).encode()).decode().rstrip("=")})
    with FakeBrowser(port, memory=memory) as tab:
        tab.settle()
        assert tab.value("Robot") == PIONEER.name
        assert "The arm of the link cannot be used" in tab.html
        assert "rows[0].theta" in tab.html
        assert "<script>" not in tab.html


def test_files_go_out_and_come_in(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 1, "a", "250")
        say(tab, "download", value="toml")
        tab.wait(lambda: any(m["type"] == "FileTransferPart" for m in tab.log))
        content = b"".join(bytes(m["content"]) for m in tab.log if m["type"] == "FileTransferPart").decode()
        robot = kin.load_robot(content)
        assert robot.rows[1].a == 0.25
        assert robot.id == "pioneer-arm-variant"
        text = kin.robot_to_toml(UR5)
        assert tab.open_file("robot", "ur5.toml", text) == 204
        shows(tab, UR5, UR5.q_home)
        type_in(tab, 0, "d", "95")
        say(tab, "reset")
        shows(tab, UR5, UR5.q_home)
        tab.open_file("robot", "bad.toml", text.replace("kind", "kand").replace("alpha", "alhpa"))
        assert "The file was not used" in tab.html
        assert "bad.toml: rows[0].alhpa" in html.unescape(tab.html)
        tab.open_file("robot", "big.toml", "x" * (MOST + 1))
        assert "too large" in tab.html
        shows(tab, UR5, UR5.q_home)


UNEXPECTED: list[tuple[list[object], object]] = [
    (["cell", 99, "a"], [1, "1"]),
    (["cell", -1, "a"], [1, "1"]),
    (["cell", 0, "x"], [1, "1"]),
    (["cell", "tool", "a"], [1, "1"]),
    (["cell", "arm", "x"], [1, "1"]),
    (["cell", 0, "a"], "1"),
    (["cell", 0], [1, "1"]),
    (["row", "add", 10**9], None),
    (["row", "burn", 0], None),
    (["row"], None),
    (["start"], "nobody"),
    (["start"], {"a": 1}),
    (["convention"], ["standard"]),
    (["upload"], "x"),
    (["kill"], None),
    (["convert"], "away"),
    (["download"], "exe"),
    (["cell", 0.5, "a"], [1, "1"]),
]


@pytest.mark.full
def test_messages_that_the_page_does_not_send_change_nothing(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for key, value in UNEXPECTED:
            tab.set("Robot", UR5.name if tab.value("Robot") == PIONEER.name else PIONEER.name)
            tab.wait(lambda: "Invalid input" not in tab.html)
            say(tab, *key, value=value)
            assert "Invalid input" in tab.html, key
        assert tab.value("Robot") == PIONEER.name
        tab.wait(lambda: tab.script["undo"] == "Robot")


def test_units_of_the_page_are_those_of_the_table(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Radians", True)
        tab.set("Lengths", "m")
        tab.wait(lambda: cell(tab, "0 d") == "0.13")
        assert cell(tab, "0 alpha") == "-1.57079633"
        type_in(tab, 1, "a", "0.25")
        shows(tab, longer(PIONEER, 1, 0.25), PIONEER.q_home)


@pytest.mark.full
def test_every_lesson_follows_an_arm_that_changes(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for lesson in LESSONS:
            tab.set("Lesson", lesson.title)
            for start in ("wrist-6r", "one-joint"):
                say(tab, "start", value=start)
                say(tab, "row", "add", 0)
                type_in(tab, 0, "alpha", "33")
                assert "Something went wrong" not in tab.html, (lesson.key, start)
                assert "Invalid input" not in tab.html, (lesson.key, start)


def test_an_arm_of_one_posture_is_not_said_to_have_up_to_one() -> None:
    said = {robot.id: views.about(robot, DEFAULT_UNITS) for robot in Store().robots}
    said["empty"] = views.about(own_arm(PRESETS["one-joint"]).robot, DEFAULT_UNITS)
    assert not [name for name, text in said.items() if "up to 1 " in text]
    assert ", one posture:" in said["empty"]
    assert "up to 8 postures" in said["ur5"]


@pytest.mark.full
def test_the_same_arm_in_the_other_convention(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "convert", value="show")
        shown = html.unescape(part(tab, "convert"))
        assert "in the modified (Craig) convention" in shown
        assert "configurations" in shown
        assert "proof" not in shown, "a check of some configurations is none"
        assert "Tool</b> stays as it is" in shown, "the last row of this arm is fixed and has no length a"
        say(tab, "convert", value="use")
        shows(tab, PIONEER, PIONEER.q_home)
        assert "modified convention" in part(tab, "table")
        assert tab.value("Robot").startswith("My arm")
        assert "Show as standard" in part(tab, "convert")
        tab.say("undo")
        tab.settle()
        assert tab.value("Robot") == PIONEER.name


def test_a_urdf_comes_in_with_the_tip_that_is_chosen(port: int) -> None:
    text = kin.robot_to_urdf(UR5)
    branch = (
        '<link name="camera"/><joint name="mount" type="revolute"><parent link="link_2"/><child link="camera"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    there = kin.load_robot(text)
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.open_file("robot", "ur5.urdf", text)
        shows(tab, there, there.q_home)
        assert "The table and the URDF differ by at most" in tab.html
        say(tab, "start", value="planar-2r")
        tab.open_file("robot", "two.urdf", text.replace("</robot>", branch))
        assert "tool (6 joints)" in part(tab, "files")
        say(tab, "tip", value="tool")
        shows(tab, there, there.q_home)
        assert "tool (6 joints)" not in part(tab, "files")
        bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;">]><robot name="x">&b;</robot>'
        for name, bad in (
            ("bomb", bomb),
            ("cut", text[:200]),
            ("empty", "<robot name='x'/>"),
            ("/etc/passwd", "x"),
        ):
            tab.open_file("robot", name, bad)
            assert "The file was not used" in tab.html, name
        shows(tab, there, there.q_home)
        say(tab, "download", value="urdf")
        tab.wait(lambda: any(m["type"] == "FileTransferPart" for m in tab.log))
        content = b"".join(bytes(m["content"]) for m in tab.log if m["type"] == "FileTransferPart").decode()
        assert np.abs(kin.fk(kin.load_robot(content), UR5.q_home) - kin.fk(UR5, UR5.q_home)).max() < 1e-12


def test_a_target_out_of_reach_waits_for_a_longer_arm(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "start", value="planar-2r")
        tab.set("Target must match", "Point only")
        tab.say("target", ["position", "1750 0 0"])
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)
        type_in(tab, 0, "a", "1100")
        assert 'data-status="unreachable"' in tab.html
        type_in(tab, 0, "a", "1200")
        tab.wait(lambda: 'data-status="reached"' in tab.html)
        tab.wait(lambda: np.allclose(tab.tool_pose()[:3, 3], [1.75, 0.0, 0.0], atol=1e-6))


@pytest.mark.full
def test_the_own_arm_keeps_its_pose_while_another_robot_is_on_show(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        say(tab, "start", value="planar-2r")
        tab.settle()
        two = own_arm(PRESETS["planar-2r"]).robot
        tab.set("1 shoulder", 77)
        q = np.radians([77, 60])
        shows(tab, two, q)
        tab.settle()
        mine = tab.value("Robot")
        tab.choose(UR5.name)
        tab.choose(mine)
        shows(tab, two, q)


def packed(own: object) -> str:
    text = json.dumps({"v": 1, "robot": "own", "own": own})
    return json.dumps({"state": base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")})


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ("my-lab-arm", "The arm was made from “my-lab-arm”, which this service does not have."),
        ("own-0123456789ab", "The arm came from a file, which this page no longer has: open the file again."),
        ("", "The arm came with a link."),
        ({"a": 1}, "The arm came with a link."),
    ],
)
def test_the_origin_that_a_link_names_may_be_unknown(port: int, start: object, words: str) -> None:
    own = pack(own_arm(PRESETS["planar-2r"]))
    with FakeBrowser(port, memory=packed({**own, "from": start})) as tab:
        tab.settle()
        assert '<option value="" selected>a link</option>' in part(tab, "start")
        say(tab, "reset")
        assert "There is nothing to reset to" in tab.html
        assert words in html.unescape(tab.html)
        assert tab.value("Robot").startswith("My arm")


@pytest.mark.full
def test_reset_goes_back_to_the_file_that_the_arm_came_from(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for robot in (UR5, PIONEER):
            tab.open_file("robot", "arm.toml", kin.robot_to_toml(robot))
            shows(tab, robot, robot.q_home)
            tab.wait(lambda: '<option value="" selected>your own file</option>' in part(tab, "start"))
            if robot is UR5:
                type_in(tab, 0, "d", "95")
                tab.settle()
        tab.say("undo")
        tab.settle()
        assert cell(tab, "0 d") == "95"
        assert '<option value="" selected>a link</option>' in part(tab, "start")
        say(tab, "reset")
        assert "open the file again" in tab.html
        assert cell(tab, "0 d") == "95"
        tab.say("redo")
        tab.settle()
        type_in(tab, 0, "d", "96")
        say(tab, "reset")
        shows(tab, PIONEER, PIONEER.q_home)
        assert cell(tab, "0 d") == "130"


def test_a_file_that_waits_for_its_tip_is_read_once(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    arms = "".join(
        f'<link name="end{i}"/><joint name="j{i}" type="revolute"><parent link="base"/><child link="end{i}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for i in range(MOST_TIPS + 7)
    )
    read = []
    monkeypatch.setattr(files, "read_tree", lambda text, name: read.append(name) or read_tree(text, name))
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.open_file("robot", "many.urdf", f'<robot name="x"><link name="base"/>{arms}</robot>')
        assert part(tab, "files").count("(1 joint)") == MOST_TIPS
        assert "7 more are not shown" in part(tab, "files")
        tab.set("Radians", True)
        tab.set("Lengths", "m")
        tab.wait(lambda: cell(tab, "0 d") == "0.13")
        assert "many.urdf" in part(tab, "files")
        assert read == ["many.urdf"]
        tab.choose(UR5.name)
        assert "many.urdf" not in part(tab, "files")


def test_long_texts_are_not_kept(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 1, "a", "9" * 20_000)
        assert "too long" in wrong(tab)["1 a"]


@pytest.mark.full
def test_the_status_says_what_a_change_has_put_back_or_replaced(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        type_in(tab, 2, "alpha", "9o")
        type_in(tab, "tool", "x", "1o")
        type_in(tab, "tool", "y", "5")
        assert list(wrong(tab)) == ["2 alpha", "tool x"], "what was typed stays"
        assert (cell(tab, "2 alpha"), cell(tab, "tool y")) == ("9o", "5")
        type_in(tab, 2, "a", "1o0")
        say(tab, "row", "add", 0)
        assert "A field that was not valid is as before" in tab.html
        assert "Not used: row 3, α (“9o”), tool, x (“1o”), row 3, a (“1o0”)." in html.unescape(tab.html)
        assert wrong(tab) == {}
        mine = tab.value("Robot")
        tab.choose(UR5.name)
        type_in(tab, 0, "d", "95")
        assert f"{mine} was replaced" in tab.html
        assert "Undo brings the other back" in tab.html
        type_in(tab, 0, "d", "96")
        tab.settle()
        tab.say("undo")
        tab.settle()
        tab.choose(mine)
        assert len(re.findall("data-row=", part(tab, "table"))) == len(PIONEER.rows) + 1


@pytest.mark.full
def test_expressions_stay_in_their_cells_and_in_the_link(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        typed = {"0 alpha": "-pi/2 + 1/3", "1 a": "2*175", "2 high": "pi/3", "tool z": "12 cm"}
        for key, text in typed.items():
            row, column = key.split()
            type_in(tab, int(row) if row.isdecimal() else row, column, text)
        say(tab, "left")
        shown = {key: cell(tab, key) for key in typed}
        assert shown == typed
        say(tab, "row", "add", 0)
        assert (cell(tab, "0 alpha"), cell(tab, "2 a"), cell(tab, "3 high")) == ("-pi/2 + 1/3", "2*175", "pi/3")
        tab.say("undo")
        tab.settle()
        tab.set("Radians", True)
        tab.settle()
        assert cell(tab, "1 a") == "2*175"
        assert cell(tab, "2 high") == "pi/3", "pi is a half turn in all units"
        assert cell(tab, "0 alpha").startswith("-1.5"), "a number without a unit would now be another angle"
        tab.set("Radians", False)
        state = saved(tab)
    with FakeBrowser(port, memory=json.dumps({"state": encode(state)})) as again:
        again.settle()
        assert {key: cell(again, key) for key in shown} == shown
        type_in(again, 1, "a", "350")
        say(again, "left")
        assert cell(again, "1 a") == "350", "a plain number is shown as numbers are"


def test_texts_of_a_link_are_checked() -> None:
    texts = Texts.of(
        {"0 a": "2*175", "0 name": "x*y", "99 b1": "1+1", "1 a": "9" * 101, "tool x": 5, "arm name": "pi"}
    )
    assert texts.state() == {"0 a": "2*175"}
    assert texts.shown((0, "a"), 0.35, DEFAULT_UNITS.lengths) == "2*175"
    assert texts.shown((0, "a"), 0.36, DEFAULT_UNITS.lengths) is None
    for k in range(3 * MOST_TEXTS):
        texts = texts.taken({(k % 30, "a" if k % 2 else "d"): f"{k}+1"})
    assert len(texts.state()) <= MOST_TEXTS
    assert sum(len(key) + len(text) for key, text in texts.state().items()) <= IN_LINK
    assert Texts.of(["0 a"]) == Texts()


@pytest.mark.parametrize(
    ("action", "rows"),
    [("add", [0, 1, 3, 4]), ("remove", [0, 1, 2]), ("up", [0, 2, 1, 3]), ("down", [0, 1, 3, 2])],
)
def test_texts_move_with_their_rows(action: str, rows: list[int]) -> None:
    """Row 2 is the one that is changed; for an added row, row 1."""
    texts = Texts()
    for row in range(4):
        texts = texts.taken({(row, "a"): f"{row}+0"})
    texts = texts.moved(action, 1 if action == "add" else 2)
    expected = {0: "0+0", 1: "1+0", 2: "2+0", 3: "3+0"}
    kept = [row for row in range(4) if not (action == "remove" and row == 2)]
    assert texts.state() == {f"{to} a": expected[row] for row, to in zip(kept, rows, strict=True)}
