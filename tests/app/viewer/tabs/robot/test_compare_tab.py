"""*Compare with…* in a page: the verdict, proposals, the ghost, links; and tables that are pasted."""

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
from app.viewer.tabs.robot.compare.drawing import ghost_q, mapping_of
from app.viewer.tabs.robot.compare.reference import IN_LINK, of_text, restored
from app.viewer.tabs.robot.compare.views import code
from kin.axes import inverse
from kin.units import DEFAULT_UNITS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UR5, PANDA = STORE.get("ur5"), STORE.get("panda")
CRAIG = """modified  alpha  a  d  theta
0     0      333  q1
-90   0      0    q2
90    0      316  q3
90    82.5   0    q4
-90   −82.5  384  q5
90    0      0    q6
90    88     107  q7
"""


def part(tab: FakeBrowser, name: str) -> str:
    found = [
        m["props"]["content"] for m in tab.gui.values() if f'data-arm="{name}"' in m["props"].get("content", "")
    ]
    return html.unescape(str(found[0])) if found else ""


def say(tab: FakeBrowser, *key: object, value: object = None) -> None:
    number = tab.say("feature", ["robot", list(key), value])
    tab.wait(lambda: tab.script["reply"][0] >= number)


def send(tab: FakeBrowser, text: str) -> None:
    tab.open_file("robot", "their text", text, "other-text")


def compared(tab: FakeBrowser) -> str:
    """The answer, once nothing is sought any more."""
    tab.wait(lambda: "kb-callout" in part(tab, "compared") and "progress" not in part(tab, "compared"))
    return part(tab, "compared")


def type_in(tab: FakeBrowser, row: int, column: str, text: str) -> None:
    found = re.search(r'data-revision="(\d+)"', part(tab, "table"))
    assert found is not None
    say(tab, "cell", row, column, value=[int(found[1]), text])


def saved(tab: FakeBrowser) -> dict[str, object]:
    """What the link has of the comparison."""
    tab.settle(0.8)
    return dict(decode(tab.kept[-1], STORE.robots).features["robot"]["compare"])


def ghosts(tab: FakeBrowser) -> list[str]:
    return [name for name in tab.nodes if re.fullmatch(r"/compare-\d+/ghost", name)]


def open_arm(tab: FakeBrowser, robot: str) -> None:
    tab.settle()
    say(tab, "start", value=robot)
    tab.settle()


@pytest.mark.full
def test_a_mistake_is_named_and_one_click_mends_it_in_one_step(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "ur5")
        type_in(tab, 1, "a", "-400")
        say(tab, "other", value="ur5")
        words = compared(tab)
        assert (
            "the axes of joints 2 and 3 are at a distance of 425.0 mm in the other arm and 400.0 mm in this arm"
            in words
        )
        assert "a of row 2 is wrong (−425 mm, not −400 mm)" in words
        assert len(ghosts(tab)) == 1
        assert tab.value("Joint of both arms") == 3  # the first axis that lies otherwise
        assert "the first that differs" in part(tab, "compared-joint")
        say(tab, "apply", value="0")
        tab.wait(lambda: tab.script["undo"] == "Mistake mended")
        tab.wait(lambda: "Identical: equal joint values give equal poses." in part(tab, "compared"))
        tab.say("undo")
        tab.wait(lambda: "a of row 2 is wrong" in part(tab, "compared"))
        tab.wait(lambda: tab.script["undo"] == "Compare with")
        say(tab, "other", value="")
        assert part(tab, "compared") == ""
        assert ghosts(tab) == []


@pytest.mark.full
def test_a_proposal_for_another_table_is_not_used(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "ur5")
        say(tab, "other", value="ur5")
        compared(tab)
        for index in ("0", "-1", "x", None):
            say(tab, "apply", value=index)
            assert "The table has changed since" in tab.html
            assert tab.value("Robot") == UR5.name


@pytest.mark.full
def test_a_pasted_table_is_compared_and_kept_in_the_link(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "panda")
        say(tab, "other", value="typed")
        assert "data-compare-text" in part(tab, "compare")
        send(tab, CRAIG)
        assert "Identical: equal joint values give equal poses." in compared(tab)
        kept, link = saved(tab), tab.kept[-1]
    again = restored(kept["with"], STORE)
    assert again is not None
    assert kin.compare(again.robot, PANDA).verdict == "identical"
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        assert "Identical" in compared(tab)
        assert "The other arm is the table as entered" in part(tab, "compared")


@pytest.mark.full
def test_frames_that_may_differ_are_a_choice(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "ur5")
        type_in(tab, 2, "theta", "90")
        say(tab, "other", value="ur5")
        words = compared(tab)
        assert "joint 3 counts from −90.0°" in words
        assert "offsets = np.array([0, 0, -1.57079633, 0, 0, 0])" in words
        assert "What was probably mistyped" in words
        say(tab, "agree", value="free")
        assert "joint 3 counts from −90.0°" in compared(tab)
        assert '<option value="free" selected>' in part(tab, "compare")
        assert saved(tab)["frames"] == "free"


@pytest.mark.full
def test_what_cannot_be_read_names_row_and_column(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "ur5")
        send(tab, "q1 89 0 90\nq2 0 wide 0")
        assert "row 2, a" in html.unescape(tab.html)
        assert part(tab, "compared") == ""


@pytest.mark.full
def test_the_joint_slider_walks_along_both_arms(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "panda")
        say(tab, "other", value="ur5")
        assert "the other arm has 6 joints and this arm has 7" in compared(tab)
        tab.wait(lambda: tab.value("Joint of both arms") == 7)
        assert "only one of the arms has it" in part(tab, "compared-joint")
        tab.set("Joint of both arms", 2)
        tab.wait(lambda: "Joint 2" in part(tab, "compared-joint"))
        before = np.array(tab.nodes[ghosts(tab)[0]]["props"]["batched_positions"])
        tab.set("Joint 1", 40)
        tab.wait(
            lambda: not np.array_equal(before, np.array(tab.nodes[ghosts(tab)[0]]["props"]["batched_positions"]))
        )


@pytest.mark.full
def test_the_search_can_be_cancelled_and_the_verdict_stays(port: int) -> None:
    with FakeBrowser(port) as tab:
        open_arm(tab, "panda")
        for row, column, text in ((1, "alpha", "20"), (3, "a", "200"), (4, "d", "500"), (5, "alpha", "33")):
            type_in(tab, row, column, text)
        say(tab, "other", value="panda")
        tab.wait(lambda: "Looking for mistakes" in part(tab, "compared"))
        say(tab, "compare-stop")
        words = compared(tab)
        assert "Different arms" in words
        assert "The search for mistakes was ended" in words


# Without a page


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("q1 10 0 90", [("revolute", 0, 10, 0, 90)]),
        ("1 | q1+90 | 10 | 0 | pi/2 |", [("revolute", 90, 10, 0, 90)]),
        ("theta d a alpha\nq1 - 90\t5 cm\t0\t0", [("revolute", -90, 50, 0, 0)]),
        ("0; d1 + 20; 3; −90", [("prismatic", 0, 20, 3, -90)]),
        ("[q1, 1, 2, 3],\n[0, 4, 5, 6] fixed", [("revolute", 0, 1, 2, 3), ("fixed", 0, 4, 5, 6)]),
        ("a alpha d theta # Craig\n1 2 3 θ1", [("revolute", 0, 3, 1, 2)]),
    ],
)
def test_bare_tables_are_read_as_they_are_written(text, rows):
    robot = of_text("text", text, DEFAULT_UNITS, 6).robot
    found = [(r.kind, math.degrees(r.theta), 1e3 * r.d, 1e3 * r.a, math.degrees(r.alpha)) for r in robot.rows]
    assert [each[0] for each in found] == [each[0] for each in rows]
    assert [each[1:] for each in found] == [pytest.approx(each[1:]) for each in rows]


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("", "text"),
        ("q1 0 10", "row 1"),
        ("q1 0 10 0\nq2 0 0 wide", "row 2, alpha"),
        ("theta d a\nq1 0 10 0", "first line"),
        ("q1 0 1 0\n" * 33, "rows"),
        ("<robot/>", "tip"),
    ],
)
def test_what_is_wrong_in_a_text_is_named(text, field):
    with pytest.raises(kin.RobotFileError) as caught:
        of_text("text", text, DEFAULT_UNITS, 6)
    assert caught.value.field == field


def test_a_urdf_with_several_ends_is_read_to_the_one_with_as_many_joints():
    urdf = kin.robot_to_urdf(UR5)
    finger = '<link name="finger"/><joint name="g" type="prismatic"><parent link="{}"/><child link="finger"/>'
    links = re.findall(r'<link name="([^"]+)"', urdf)
    side = (
        finger.format(links[2])
        + '<axis xyz="1 0 0"/><limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>'
    )
    found = of_text("two ends", urdf.replace("</robot>", side + "</robot>"), DEFAULT_UNITS, 6)
    assert found.robot.n == 6
    assert kin.compare(found.robot, UR5, frames="free").is_same


def test_a_long_text_stays_out_of_the_link_and_a_bad_link_is_ignored():
    rows = "\n".join(f"q{i + 1} 12.3456789{i} 23.456789{i} 34.56789{i}" for i in range(30))
    long = of_text("long", rows, DEFAULT_UNITS, 6)
    assert long.kept is None or len(str(long.kept)) <= IN_LINK
    assert restored("no such arm", STORE) is None
    assert restored({"r": [["x"]]}, STORE) is None
    assert restored(3, STORE) is None


def test_the_ghost_stands_where_the_mapping_puts_it() -> None:
    """The tool of the ghost is at that of the arm on show, for another base, sense and zero."""
    other = kin.dh.convert_dh(kin.dh.robot_from_screws(*_moved(UR5)), "modified")
    found = kin.compare(other, UR5, frames="free")
    assert found.verdict == "same"
    mapping = mapping_of(found, UR5.n)
    q = UR5.random_q(np.random.default_rng(4))
    there = inverse(mapping.base) @ kin.fk(other, ghost_q(other, UR5, mapping, q)) @ inverse(mapping.tool)
    assert np.abs(there - kin.fk(UR5, q)).max() < 1e-6


def _moved(robot: kin.Robot) -> tuple[np.ndarray, np.ndarray]:
    """Screws and home pose with joint 2 counting the other way, and a base that is turned and shifted."""
    screws = kin.dh.screws(robot, np.zeros(robot.n))
    signs = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    S = signs * screws.S
    shift = np.array([0.1, -0.2, 0.3])
    S = np.vstack([S[:3], S[3:] + np.cross(shift, S[:3], axisb=0, axisc=0)])
    M = screws.M.copy()
    M[:3, 3] += shift
    return S, M


def test_the_code_that_is_shown_maps_joint_values():
    other = kin.dh.convert_dh(kin.dh.robot_from_screws(*_moved(UR5)), "standard")
    found = kin.compare(other, UR5, frames="free")
    assert found.mapping is not None
    names: dict[str, object] = {}
    exec(code(found.mapping, other), names)
    q = UR5.random_q(np.random.default_rng(5))
    mapped = names["to_b"](q)  # type: ignore[operator]
    T = names["base"] @ kin.fk(UR5, mapped) @ names["tool"]  # type: ignore[operator]
    assert np.abs(T - kin.fk(other, q)).max() < 1e-6
