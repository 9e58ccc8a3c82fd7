"""The folder of posture maps: coarse to fine, in words, its places as targets, and the loop of a cuspidal arm."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bare_page import BarePage, bare_page
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import NODES, PostureRequest, Summaries
from app.viewer.postures.survey import Posture
from app.viewer.server import ViewerServer
from app.viewer.session.state import KEY, KEY_REPLACE, decode
from app.viewer.tabs.workspace.postures import views
from app.viewer.tabs.workspace.postures.panel import Postures
from app.viewer.tabs.workspace.postures.settings import PostureSettings
from app.viewer.tabs.workspace.tab import Workspace
from kin.angles import wrapped
from kin.units import DEFAULT_UNITS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
UR5 = STORE.get("ur5")


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
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


def progress(tab: FakeBrowser) -> list[float]:
    """Of the page's progress bars: a finer map has other regions, and buttons of its own."""
    bars = {uuid: message for uuid, message in tab.gui.items() if message["type"] == "GuiProgressBarMessage"}
    return [tab.values.get(uuid, message["value"]) for uuid, message in bars.items()]


def test_a_map_is_shown_with_its_regions_in_words_and_cleared(tab):
    push(tab, "Posture map", "Start")
    tab.wait(lambda: "Postures of UR5" in tab.html and " regions. A: " in tab.html, 30.0)
    push(tab, "Posture map", "Clear")
    tab.wait(lambda: "Postures of UR5" not in tab.html)


def test_a_region_becomes_the_target(tab):
    push(tab, "Posture map", "Start")
    tab.wait(lambda: " regions. A: " in tab.html and 100.0 in progress(tab), 30.0)
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


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> Iterator[BarePage]:
    """The folder alone, with coarse maps."""
    monkeypatch.setattr("app.shared.summaries.NODES", (12,))
    summaries = Summaries(threads=1)
    with bare_page(UR5) as opened:
        opened.summaries = summaries  # type: ignore[attr-defined]
        opened.open(Postures)
        yield opened
    summaries.close()


def mapped(page: BarePage, plane: str = "vertical") -> kin.postures.PostureMap:
    """A map of the arm on show."""
    folder = page.feature
    assert isinstance(folder, Postures)
    folder.change(plane=plane)
    page.press("Posture map", "Start")
    page.rest()
    work = page.summaries.postures(folder.settings.request)  # type: ignore[attr-defined]
    found = work.future.result(60.0)
    page.rest()
    assert folder.facts.map is found
    return found


def click(page: BarePage, x: float, y: float) -> tuple[Posture, ...]:
    """Click at these shares of the width and the height of the map; returns the postures in the list."""
    page.post(("feature", "postures", ("map", 1)), [x, y])
    page.rest()
    assert isinstance(page.feature, Postures)
    return page.feature.settings.postures


def ghosts(page: BarePage) -> int:
    return sum(kind.startswith("Batched") for kind, _, _ in page.scene())


def words(page: BarePage) -> str:
    return json.dumps(page.panel(), ensure_ascii=False)


def at_node(found: kin.postures.PostureMap, i: int, j: int) -> tuple[float, float]:
    """The shares of the width and the height at which a node is."""
    a, b = found.counts.shape
    return i / (a - 1), j / (b - 1)


def test_a_click_in_the_map_shows_as_many_postures_as_are_counted_there(page):
    found = mapped(page)
    for node in np.argwhere(found.counts == 8)[:2].tolist() + np.argwhere(found.counts == 0)[:1].tolist():
        there = click(page, *at_node(found, *node))
        assert len(there) == found.counts[*node]
        place = np.array([[found.x[node[0]], found.y[node[1]]]])
        T = found.plane.poses(UR5, place)[0]
        assert np.allclose(page.targets[-1], T), "it is the target"
        for posture in there:
            assert np.allclose(kin.fk(UR5, posture.q), T)
            assert UR5.in_limits(posture.q)
        assert ghosts(page) == len(there)
    assert "No posture at the place chosen." in words(page)


def test_a_posture_of_the_list_is_driven_to_and_has_no_ghost_then(page):
    found = mapped(page)
    i, j = np.argwhere(found.counts == 8)[0].tolist()
    there = click(page, *at_node(found, i, j))
    page.press("Go to posture", "3")
    page.rest()
    assert np.array_equal(page.now.goal, there[2].q)
    assert "data-here" in words(page)
    assert ghosts(page) == 7
    page.set("Draw in the scene", False)
    page.rest()
    assert not page.scene()


def test_a_posture_outside_the_limits_is_listed_and_not_driven_to(page):
    robot = STORE.get("irb120")
    page.change(robot)
    page.set("Inside limits", False)
    found = mapped(page)
    i, j = np.argwhere(found.counts == found.counts.max())[0].tolist()
    there = click(page, *at_node(found, i, j))
    assert len(there) == found.counts.max()
    blocked = [k for k, posture in enumerate(there) if not posture.available]
    assert blocked
    page.press("Go to posture", str(blocked[0] + 1))
    page.rest()
    assert page.notices[-1].title.startswith("Not available")
    assert np.array_equal(page.now.goal, robot.q_home)


def test_a_region_of_a_plane_of_joints_is_gone_to(page):
    found = mapped(page, "joints")
    page.press("Go to region", "A")
    page.rest()
    assert np.allclose(page.now.goal[[1, 2]], found.regions[0].place)
    assert np.array_equal(page.now.goal[[0, 3, 4, 5]], UR5.q_home[[0, 3, 4, 5]])
    assert not any(kind.startswith("Image") for kind, _, _ in page.scene()), "it lies nowhere in the scene"


def locks(joint: int) -> tuple[bool, ...]:
    return tuple(i == joint for i in range(6))


def test_a_locked_joint_is_not_moved(page, verdict):
    found = mapped(page, "joints")
    i, j = np.argwhere(found.counts > 0)[0].tolist()
    judged(page)
    page.use(UR5, locks=locks(1))
    click(page, *at_node(found, i, j))
    page.press("Play the loop")
    page.rest()
    assert [one.detail for one in page.notices] == ["Unlock 2 shoulder first."] * 2
    assert page.feature.settings.loop is None
    assert np.array_equal(page.now.goal, UR5.q_home)


def test_a_posture_that_would_move_a_locked_joint_is_not_driven_to(page):
    found = mapped(page)
    i, j = np.argwhere(found.counts == 8)[0].tolist()
    there = click(page, *at_node(found, i, j))
    turned = next(k for k, one in enumerate(there) if one.available and abs(one.q[4] - UR5.q_home[4]) > 0.1)
    page.use(UR5, locks=locks(4))
    page.feature.on_posture(turned)
    assert page.notices[-1].detail == "Unlock 5 wrist 2 first."
    assert np.array_equal(page.now.goal, UR5.q_home)


def test_an_arm_whose_postures_have_no_names_shows_them_all(page):
    robot = STORE.get("crx10ia")
    page.change(robot)
    found = mapped(page)
    i, j = np.argwhere(found.counts > 2)[0].tolist()
    there = click(page, *at_node(found, i, j))
    assert [posture.name for posture in there] == [str(k + 1) for k in range(len(there))]
    assert len(there) == found.counts[i, j]


@pytest.mark.parametrize("value", [None, [0.5], [0.5, 1.1], [-0.1, 0.5], [float("nan"), 0.5], ["0.5", 0.5]])
def test_a_click_that_is_none_is_refused(page, value):
    with pytest.raises(kin.InputError, match="map"):
        page.feature.heard(("map", 1), value)


def test_postures_that_a_question_asks_for_are_hidden_in_the_tab(page):
    page.feature.remove()
    tab = page.open(Workspace)
    page.press("Posture map", "Start")
    page.rest()
    request = tab._postures.settings.request
    found = page.summaries.postures(request).future.result(60.0)
    page.rest()
    i, j = np.argwhere(found.counts == 8)[0].tolist()
    page.post(("feature", "workspace", ("map", 1)), list(at_node(found, i, j)))
    page.rest()
    for asked, count in ((False, 8), (True, 0), (False, 8)):
        page.activity.withheld = frozenset({"postures"} if asked else ())
        tab.on_activity()
        page.rest()
        assert ghosts(page) == count
        assert ("Go to posture" in words(page)) is not asked


def test_a_late_click_does_nothing(page):
    assert click(page, 0.5, 0.5) == ()
    assert not page.targets


def test_a_section_lies_in_the_scene_where_its_nodes_are(page):
    found = mapped(page)
    (image,) = [(T, props) for kind, T, props in page.scene() if kind.startswith("Image")]
    T = np.vstack([np.reshape(image[0], (3, 4)), [0.0, 0.0, 0.0, 1.0]])
    a, b = found.counts.shape
    # viser turns a picture by half a turn about x, so that its rows go down along y.
    for i, j in ((0, 0), (a - 1, 0), (3, b - 2)):
        across = ((i + 0.5) / a - 0.5) * image[1]["render_width"]
        down = ((b - 1 - j + 0.5) / b - 0.5) * image[1]["render_height"]
        place = found.plane.poses(UR5, np.array([[found.x[i], found.y[j]]]))[0, :3, 3]
        assert np.allclose((T @ [across, down, 0.0, 1.0])[:3], place)
    drawn = views.section_nodes(found, dark=True)[0].props["image"]
    assert (drawn[0, :, 3] > 0).tolist() == (found.counts[:, -1] > 0).tolist()


def test_colours_of_the_map_are_those_of_the_page(page):
    html = views.map_html(mapped(page), DEFAULT_UNITS)
    assert 'fill="#fff"' not in html
    assert "data-guide-map" in html
    assert "along u, mm" in html


LOOP = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.15, 0.2, 0.3, 0.4, 0.5, 0.6], [0.1, 0.2, 0.3, 0.7, 0.5, 0.6]])


@pytest.fixture
def verdict(monkeypatch):
    """What is found of any arm."""
    found = kin.postures.Cuspidality(UR5, "yes", "loop", LOOP, True, 0.02, 8, 3)
    asked = SimpleNamespace(found=found)
    monkeypatch.setattr(kin, "cuspidal", lambda *_, **__: asked.found)
    return asked


def judged(page: BarePage) -> None:
    page.press("Cuspidal or not")
    page.rest()
    page.feature._judge(page.now.robot, page.now.options.constraints).future.result(60.0)
    page.rest()


def test_the_loop_of_a_cuspidal_arm_is_driven_round(page, verdict):
    judged(page)
    assert "stays above 0.02" in words(page)
    assert [kind for kind, _, _ in page.scene()] == ["LineSegmentsHandle", "BatchedMeshHandle"], "loop and start"
    seen: list[np.ndarray] = []
    page.move_to, plain = lambda q, *more, **named: (seen.append(q), plain(q, *more, **named)), page.move_to
    page.press("Play the loop")
    page.rest()
    assert np.array_equal(seen[0], LOOP[0])
    assert np.array_equal(page.now.goal, LOOP[-1])
    assert np.abs(np.diff(seen, axis=0)).max() < 0.06
    assert any(np.allclose(q, LOOP[1], atol=0.02) for q in seen)
    assert page.notices[-1].title == "The tool is back in another posture"
    assert "Joint 4 is 17.2° from where it was" in page.notices[-1].detail
    assert "Play the loop" in words(page)


@pytest.mark.full
def test_the_link_has_the_end_of_the_loop_and_undo_its_beginning(tab, verdict):
    tab.set("Cuspidal or not", True)
    tab.wait(lambda: "stays above 0.02" in tab.html)
    tab.stored()
    tab.kept.clear()
    tab.kept_as.clear()
    tab.set("Play the loop", True)

    def kept(q: np.ndarray) -> bool:
        return bool(tab.kept) and np.allclose(decode(tab.kept[-1], STORE.robots).q, q, atol=1e-6)

    tab.wait(lambda: kept(LOOP[-1]))
    assert tab.kept_as[0] == KEY
    assert set(tab.kept_as[1:]) <= {KEY_REPLACE}, "one entry of the browser's history"
    tab.say("undo")
    tab.wait(lambda: kept(UR5.q_home))


def test_another_motion_of_the_arm_ends_the_loop(page, verdict):
    judged(page)
    page.feature.on_loop()
    page.feature._play(0.1)
    assert page.feature.settings.loop.passed > 0
    page.pose(UR5.q_home)
    assert page.feature.settings.loop is None
    assert np.array_equal(page.now.goal, UR5.q_home)


def test_a_joint_that_is_locked_on_the_loop_ends_it(page, verdict):
    judged(page)
    page.feature.on_loop()
    page.feature._play(0.1)
    at = page.now.goal
    page.pose(at, locks=locks(3))
    assert page.feature.settings.loop is None
    assert np.array_equal(page.now.goal, at)
    assert page.notices[-1].detail.startswith("Unlock 4 ")


def test_a_loop_outside_the_limits_is_said_and_not_driven(page, verdict):
    verdict.found = replace(verdict.found, in_limits=False)
    judged(page)
    assert "with the joint limits left aside" in words(page)
    assert "Play the loop" not in words(page)


def test_the_press_itself_goes_on_from_the_start_of_the_loop(page, verdict):
    judged(page)
    page.pose(LOOP[0])
    page.feature.on_loop()
    assert page.feature.settings.loop.passed > 0
    assert np.array_equal(page.now.goal, page.feature.settings.loop.here)


def test_an_arm_that_is_not_cuspidal_says_why(page):
    judged(page)
    assert "Not cuspidal: each posture is a combination of signs" in words(page)
    assert "Play the loop" not in words(page)
    page.change(STORE.get("panda"))
    page.press("Cuspidal or not")
    page.rest()
    with pytest.raises(kin.InputError):
        page.feature._judge(page.now.robot, page.now.options.constraints).future.result(60.0)
    page.rest()
    assert "lock the others" in words(page)


def test_of_several_loops_the_highest_is_shown(monkeypatch):
    low = LOOP * np.array([1.0, 5.0, 1.0, 1.0, 1.0, 1.0])

    def search(*_, seed=0, **__):
        loop = {0: low, 3: LOOP, 4: None}.get(seed, low)
        return kin.postures.Cuspidality(UR5, "yes", "loop", loop, loop is not None, 0.02, 8, 3, seed)

    monkeypatch.setattr(kin, "cuspidal", search)
    assert views.judge(UR5, kin.JointConstraints(), lambda: None).seed == 3


@pytest.mark.full
def test_the_gofa_comes_back_in_another_posture(page):
    """With the loop that is found, not one that a test has made."""
    page.change(STORE.get("gofa"))
    judged(page)
    found = page.feature.facts.drivable
    assert found is not None
    first, last = kin.fk(found.robot, found.loop[[0, -1]])
    assert np.allclose(first, last, atol=1e-6)
    assert np.abs(wrapped(found.loop[-1] - found.loop[0])).max() > 0.05
    q = np.linspace(found.loop[0], found.loop[-1], 50)
    assert len(found.loop) > 2 or kin.link_frames(found.robot, q)[..., 2, 3].min() > 0.0, "above the floor"
