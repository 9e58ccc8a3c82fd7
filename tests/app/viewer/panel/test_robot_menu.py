"""The menu of robots in the page, and the field that shortens it."""

from __future__ import annotations

import html
import json
import re

import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.settings import static_folder
from app.shared.store import Store
from app.viewer.own_arm import label, own_arm
from app.viewer.tabs.robot.presets import PRESETS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER = STORE.robots[0]


def offered(tab: FakeBrowser) -> set[str]:
    return set(tab.gui[tab.element("Robot")]["props"]["options"])


def test_the_page_knows_pictures_and_makers(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        said = re.search(r'data-robots="([^"]*)"', tab.html)
        assert said is not None
        about = json.loads(html.unescape(said[1]))
        assert about == {robot.name: [robot.id, robot.maker] for robot in STORE.robots}
        for picture, _ in about.values():
            assert (static_folder() / "robots" / f"{picture}.webp").is_file()
        own = own_arm(PRESETS["wrist-6r"])
        tab.say("feature", ["robot", ["start"], "wrist-6r"])
        tab.wait(lambda: html.escape(label(own.robot)) in tab.html)
        said = re.search(r'data-robots="([^"]*)"', tab.html)
        assert said is not None
        assert json.loads(html.unescape(said[1]))[label(own.robot)] == ["", ""], "nobody has drawn it"


def test_words_shorten_the_menu_and_the_arm_on_show_stays(port: int) -> None:
    sevens = {robot.name for robot in STORE.robots if robot.n == 7 and "KUKA" in robot.maker}
    assert len(sevens) == 2
    with FakeBrowser(port) as tab:
        tab.settle()
        everything = offered(tab)
        assert everything == {robot.name for robot in STORE.robots}
        tab.set("Find an arm", "kuka joints:7")
        tab.wait(lambda: offered(tab) == {PIONEER.name, *sevens})
        assert tab.value("Robot") == PIONEER.name
        tab.set("Find an arm", "kuka joints:")
        tab.wait(lambda: "Not yet a query" in tab.html)
        assert offered(tab) == {PIONEER.name, *sevens}, "an incomplete word changes nothing"
        tab.set("Find an arm", "no-such-arm")
        tab.wait(lambda: "No arm fits" in tab.html)
        assert offered(tab) == {PIONEER.name}
        tab.set("Find an arm", "")
        tab.wait(lambda: offered(tab) == everything)


@pytest.mark.full
def test_an_arm_that_was_found_opens(port: int) -> None:
    kr6 = STORE.get("kr6")
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Find an arm", "kr6")
        tab.wait(lambda: kr6.name in offered(tab))
        tab.choose(kr6.name)
        tab.wait(lambda: tab.value("Robot") == kr6.name)
        tab.settle()
        assert tab.tool_pose() == pytest.approx(kin.fk(kr6, kr6.q_home), abs=1e-4)
