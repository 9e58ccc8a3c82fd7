"""The folder of posture maps: coarse to fine, in words, and its regions as targets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import NODES, PostureRequest, Summaries
from app.viewer.server import ViewerServer
from app.viewer.tabs.workspace.postures import PostureSettings

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UR5 = STORE.get("ur5")


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    kin.warm_up()
    clouds, maps = Clouds(), Maps(threads=1)
    server = ViewerServer(STORE, Settings(), clouds, maps)
    with serve_viewer(server) as opened:
        yield opened
    clouds.close()
    maps.close()


@pytest.fixture
def tab(port) -> Iterator[FakeBrowser]:
    with FakeBrowser(port) as opened:
        opened.choose(UR5.name)
        opened.settle(0.2)
        yield opened


def push(tab: FakeBrowser, label: str, button: str) -> None:
    tab.send("GuiUpdateMessage", uuid=tab.element(label), updates={"value": button})


def test_a_map_is_shown_with_its_regions_in_words_and_cleared(tab):
    push(tab, "Posture map", "Start")
    tab.wait(lambda: "Postures of UR5" in tab.html and " regions. A: " in tab.html, 30.0)
    push(tab, "Posture map", "Clear")
    tab.wait(lambda: "Postures of UR5" not in tab.html)


def test_a_region_becomes_the_target(tab):
    push(tab, "Posture map", "Start")
    tab.wait(lambda: " regions. A: " in tab.html, 30.0)
    tab.settle()
    before = tab.gizmo_pose()
    push(tab, "Go to region", "A")
    tab.wait(lambda: not np.allclose(tab.gizmo_pose(), before, atol=1e-3))
    assert np.allclose(tab.gizmo_pose()[:3, :3], before[:3, :3], atol=1e-6), "the tool keeps its orientation"


def test_an_arm_with_a_freedom_left_says_what_to_do(port):
    with FakeBrowser(port) as tab:
        tab.choose(STORE.get("panda").name)
        tab.settle(0.2)
        push(tab, "Posture map", "Start")
        tab.wait(lambda: "lock the others" in tab.html, 30.0)


def test_maps_come_coarse_to_fine_and_are_shared():
    summaries = Summaries(threads=1)
    T = tuple(map(tuple, kin.fk(UR5, UR5.q_home).tolist()))
    request = PostureRequest(UR5, kin.JointConstraints(), True, T, None, None, None)
    with summaries.postures(request) as first, summaries.postures(request) as second:
        found = first.future.result(30.0)
        assert second.future.result(30.0) is found
        assert found.counts.shape == (NODES[-1], NODES[-1])
        assert first.done == first.total == sum(nodes**2 for nodes in NODES)
        direct = kin.posture_map(UR5, np.array(T), resolution=NODES[-1])
        assert np.array_equal(found.counts, direct.counts)
    summaries.close()


@pytest.mark.parametrize(("name", "value"), [("plane", "sideways"), ("limits", 1)])
def test_a_wrong_setting_is_named(name, value):
    with pytest.raises(kin.InputError, match=name):
        PostureSettings.spec(name).unpack(name, value, UR5)
