"""An arm with rows that follow joints in the page: its sliders, its drawing, the lessons that are not for it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from bare_page import bare_page
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.own_arm import own_arm, pack, unpack
from app.viewer.panel.joints import JointSliders
from app.viewer.scene.chain import chain, link_poses
from app.viewer.server import ViewerServer
from app.viewer.tabs.robot.edits import EditError, changed_rows, typed
from kin.typed import EntryError
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
ROBOT = kin.get_robot("palletiser")


@pytest.fixture(scope="module")
def tab() -> Iterator[FakeBrowser]:
    with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port, FakeBrowser(port) as opened:
        opened.choose(ROBOT.name)
        yield opened


def test_links_are_drawn_where_the_rows_are() -> None:
    q = ROBOT.random_q(np.random.default_rng(1), 5)
    links = chain(ROBOT)
    assert [link.leader for link in links.links] == [-1, 0, 1, 1, 2, 2, 3]
    tools = link_poses(ROBOT, q)[:, -1] @ links.T_last_tool
    assert tools == pytest.approx(kin.fk(ROBOT, q), abs=1e-14)


def test_there_is_a_slider_for_each_joint_and_what_follows_moves_with_it(tab: FakeBrowser) -> None:
    assert tab.sliders_in("Joints")[:4] == ["1 turn", "2 upper arm", "3 forearm", "4 hand turn"]
    tab.set("3 forearm", 55.0)
    tab.settle()
    q = ROBOT.q_home.copy()
    q[2] = np.radians(55.0)
    assert tab.tool_pose() == pytest.approx(kin.fk(ROBOT, q), abs=1e-6)


def test_a_lesson_about_rows_says_that_it_is_not_for_this_arm(tab: FakeBrowser) -> None:
    tab.set("Lesson", "DH table step by step")
    tab.wait(lambda: "has rows that follow joints: choose another arm" in tab.html)
    assert tab.value("Lesson") == "None"
    tab.set("Lesson", "Velocity")
    tab.wait(lambda: 'data-step="1"' in tab.html)
    tab.set("Lesson", "None")
    tab.choose(ROBOT.name)  # the lesson has brought its own


def test_the_table_says_what_follows(tab: FakeBrowser) -> None:
    assert "-1 × forearm" in tab.html.replace("\u2212", "-")


def test_a_renamed_joint_keeps_its_followers_and_a_fixed_row_follows_nothing() -> None:
    renamed = typed(ROBOT, None, {(3, "name"): "jib"}, Units()).robot
    assert [row.follows for row in renamed.rows if row.follows] == ["upper arm", "jib"]
    assert renamed.home == ROBOT.home
    held = typed(ROBOT, None, {(4, "kind"): "fixed"}, Units()).robot
    assert [row.follows for row in held.rows if row.follows] == ["upper arm"]
    assert held.home == ROBOT.home
    with pytest.raises(EditError, match="follows forearm"):
        typed(ROBOT, None, {(4, "home"): "1"}, Units())
    with pytest.raises(EditError, match="moves by itself"):
        changed_rows(ROBOT, None, lambda rows: rows.pop(3))
    own = changed_rows(ROBOT, None, lambda rows: rows.insert(0, {"name": "rail", "kind": "prismatic"})).robot
    assert own.home[1:] == ROBOT.home


def test_a_link_carries_what_follows_and_the_pendant() -> None:
    data = kin.robot_to_dict(ROBOT) | {"pendant": {"forearm": {"forearm": -1, "upper arm": 1, "offset": 5}}}
    own = own_arm(data)
    back = unpack(json.loads(json.dumps(pack(own))))
    assert back == own
    assert [(row.follows, row.ratio) for row in back.robot.rows] == [(r.follows, r.ratio) for r in ROBOT.rows]
    assert kin.motors.to_pendant(back.robot, ROBOT.q_home) == pytest.approx(
        kin.motors.to_pendant(kin.robot_from_dict(data), ROBOT.q_home), abs=1e-15
    )
    data["rows"][3]["name"] = "fore\u200barm"  # which cannot be shown as it is
    data["rows"][4]["follows"] = "fore\u200barm"
    data["pendant"] = {"fore\u200barm": {"fore\u200barm": -1}}
    renamed = own_arm(data).robot
    assert (renamed.rows[4].follows, renamed.pendant[0].joint) == ("forearm", "forearm")
    for wrong in ("p", [1], [[1]], [[0, 0, "x", 1]], [[0, 0, 99, 1]], [[99, 0, 0, 1]]):
        with pytest.raises(kin.KinematicsError, match="pendant"):
            unpack({**pack(own), "p": wrong})


def test_the_page_shows_what_the_pendant_shows(tab: FakeBrowser) -> None:
    fanuc = kin.get_robot("lrmate200id")
    tab.choose(fanuc.name)

    def said() -> str:
        return re.sub("<.*?>", "", tab.html).replace("\u2212", "-")

    assert "Pendant: J1 0.0°, J2 0.0°, J3 0.0°" in said()
    tab.set("2 J2", 30.0)
    tab.wait(lambda: "J2 30.0°, J3 -30.0°" in said())
    tab.say("target", ["pendant", "[0, 30, 0; 0 -pi/2 rad 0]"])
    tab.wait(lambda: "J2 30.0°, J3 0.0°, J4 0.0°, J5 -90.0°" in said())
    assert tab.value("3 J3") == 30.0
    for text, words in (
        ("0 30 0", "Found 3 numbers; valid are 6, one for each joint"),
        ("0 30 190 0 0 0", "Joint J3 would have 220.0°, outside its limits. Valid: -70.0 … 205.0°."),
        ("0 30 x 0 0 0", "“x” is not a number"),
    ):
        number = tab.say("target", ["pendant", text])
        tab.wait(lambda number=number: tab.script["reply"][0] == number)
        assert words in tab.script["reply"][1].replace("\u2212", "-")
    assert tab.value("3 J3") == 30.0
    tab.choose(ROBOT.name)
    assert "Pendant:" not in said()


@pytest.mark.parametrize("units", [Units(), Units(degrees=False)], ids=["degrees", "radians"])
def test_what_the_pendant_shows_at_a_limit_can_be_typed_as_it_is_shown(units: Units) -> None:
    fanuc = kin.get_robot("lrmate200id")
    inside = np.radians(0.028)  # the ends of J1 are shown rounded outwards: 169.972° as 170.0, 2.9666 rad as 2.967
    rows = tuple(
        replace(row, limits=(row.limits[0] + inside, row.limits[1] - inside)) if row.limits else row
        for row in fanuc.rows
    )
    robot = replace(fanuc, rows=rows)
    with bare_page(robot) as page:
        gui = page.client.gui
        arguments = [False] * robot.n, units, page.post, page.fence
        sliders = JointSliders(gui, [gui.add_folder("Joints")], robot, robot.q_home, *arguments)
        for q in (robot.lower, robot.upper):
            shown = [units.angles.number(value) for value in kin.motors.to_pendant(robot, q).tolist()]
            found = sliders.read_pendant(" ".join(shown))
            assert found == pytest.approx(q, abs=1.1 * units.angles.read(units.angles.step(1)))
            assert robot.clip(found).tolist() == found.tolist()
            shown = [units.angles.number(1.005 * value) for value in kin.motors.to_pendant(robot, q).tolist()]
            with pytest.raises(EntryError, match="outside its limits"):
                sliders.read_pendant(" ".join(shown))
