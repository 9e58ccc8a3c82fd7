"""The capability folder: voxels shown while they are computed, thresholds, cuts and clicks."""

from __future__ import annotations

import html
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared import mapreduce
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.scene.camera import DIRECTION
from app.viewer.server import ViewerServer
from app.viewer.tabs.workspace import colours, cut
from app.viewer.tabs.workspace.capability import views, voxels
from app.viewer.tabs.workspace.capability.settings import MapSettings
from kin.units import DEFAULT_UNITS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, PUMA = STORE.get("pioneer5"), STORE.get("puma560")
LENGTH = 15


def the_map(robot: kin.Robot = PIONEER, directions: int = 12) -> kin.workspace.CapabilityMap:
    return kin.workspace.capability_map(robot, resolution=LENGTH, directions=directions)


# Levels, settings, words


def test_levels_are_equal_steps_and_include_their_edge():
    values = np.array([0.0, 1.0, 2.0, 3.0, 5.0], dtype=np.float32) / np.float32(48.0)
    assert voxels.levels(values).tolist() == [0, 5, 10, 15, voxels.LEVELS - 1]
    assert voxels.levels(np.zeros(3, np.float32)).tolist() == [0, 0, 0]
    assert voxels.levels(np.zeros(0, np.float32)).tolist() == []
    for k in range(voxels.LEVELS):
        assert voxels.first_level(k / voxels.LEVELS) == k
    assert voxels.first_level(1.0) == voxels.LEVELS - 1, "the best are always seen"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("resolution", v) for v in (14, "15", None, True, [15], 25.5)),
        *(("directions", v) for v in (13, "12", {})),
        *(("by", v) for v in ("taste", None, 1)),
        *(("least", v) for v in ("x", None, float("nan"), True)),
    ],
)
def test_a_wrong_setting_is_named_and_ignored_in_an_address(name, value):
    fresh = MapSettings.fresh(PIONEER)
    with pytest.raises(kin.InputError, match=name):
        MapSettings.spec(name).unpack(name, value, PIONEER)
    other, valid = ("least", 0.5) if name != "least" else ("directions", 12)
    assert fresh.restored({name: value, other: valid}, PIONEER) == replace(fresh, **{other: valid})


@pytest.mark.parametrize("state", [None, 3, "x", [1]])
def test_an_invalid_state_restores_nothing(state):
    fresh = MapSettings.fresh(PIONEER)
    assert fresh.restored(state, PIONEER) == fresh


def test_the_description_matches_the_map():
    found = the_map()
    row = int(found.share.argmax())
    text = html.unescape(views.picked(found, row, DEFAULT_UNITS))
    assert f"{found.approachable[row].sum()} of 12 directions" in text
    none = int(np.flatnonzero(found.share == 0.0)[0])
    assert "not along any" in views.picked(found, none, DEFAULT_UNITS)
    assert views.CERTAINTY["closed form"] in views.facts(found, None, complete=True, units=DEFAULT_UNITS)
    assert f"{found.volume:.4g}" in views.facts(found, None, complete=True, units=DEFAULT_UNITS)
    assert "so far" in views.facts(found, None, complete=False, units=DEFAULT_UNITS)
    assert "With joints 1, 3 locked. " in views.facts(found, (0.0, None, 0.5), complete=True, units=DEFAULT_UNITS)
    empty = kin.workspace.capability_join(found.grid, [])
    assert "0" in views.facts(empty, None, complete=False, units=DEFAULT_UNITS)
    assert 'data-shown="0"' in views.legend(empty, "share", "viridis", 0.0)
    for robot in (PIONEER, PUMA):
        assert kin.workspace.capability_grid(robot, resolution=2).method in views.CERTAINTY


@pytest.mark.parametrize(("length", "scale", "decimals"), [("mm", 1000, 0), ("cm", 100, 1), ("m", 1, 3)])
def test_lengths_follow_the_units(length, scale, decimals):
    found, units = the_map(), Units(length=length)
    row = int(found.share.argmax())
    assert f">{scale * found.grid.voxel:.{decimals + 1}f}<" in views.facts(found, None, True, units)
    x = f"{scale * found.centres[row, 0]:.{decimals}f}".replace("-", "−")
    assert f">{x} " in views.picked(found, row, units)
    for text in (views.facts(found, None, True, units), views.picked(found, row, units)):
        assert f">{length}<" in text


def test_a_cage_has_twelve_edges():
    edges = voxels.edges(2.0)
    assert edges.shape == (12, 2, 3)
    assert np.allclose(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1), 2.0)
    assert len({tuple(sorted(map(tuple, e.tolist()))) for e in edges}) == 12


# In the viewer


class Visitor(FakeBrowser):
    """A visitor of the capability folder."""

    def push(self, button: str) -> None:
        self.send("GuiUpdateMessage", uuid=self.element("Map"), updates={"value": button})

    @property
    def state(self) -> str:
        return re.search(r'data-map="(\w+)"', self.html)[1]

    @property
    def boxes(self) -> dict[str, dict]:
        return {n: m for n, m in self.nodes.items() if m["type"] == "BatchedMeshesMessage"}

    def count(self, only_visible: bool = False) -> int:
        return len(self.centres(only_visible))

    def is_visible(self, name: str) -> bool:
        # Nodes created hidden get a separate message.
        return self.visible.get(name, True)

    def centres(self, only_visible: bool = False) -> np.ndarray:
        found = [
            m["props"]["batched_positions"].reshape(-1, 3)
            for name, m in self.boxes.items()
            if not only_visible or self.is_visible(name)
        ]
        return np.concatenate([np.empty((0, 3)), *found])

    def compute(self, whole: bool = True) -> None:
        if whole:  # who has chosen no cut gets none
            self.set("Cut", "across z (level)")
            self.set("Cut", "none")
        self.set("Grid", f"{LENGTH} voxels long")
        self.set("Directions", "12")
        self.push("Start")

    def done(self, count: int) -> None:
        self.wait(lambda: self.state == "done" and self.count() == count, 60.0)
        self.settle()

    def sent(self, kind: str) -> int:
        return len([m for m in self.log if m["type"] == kind])

    def hit(self, name: str, instance: int) -> None:
        self.send(
            "SceneNodeClickMessage",
            name=name,
            instance_index=instance,
            ray_origin=(0, 0, 0),
            ray_direction=(0, 0, 1),
            screen_pos=(0.5, 0.5),
            modifier=None,
            owner=self.nodes[name]["owner"],
        )


@pytest.fixture(scope="module")
def service() -> Iterator[tuple[int, Maps, ViewerServer]]:
    clouds, maps = Clouds(), Maps(threads=2)
    server = ViewerServer(STORE, Settings(), clouds, maps)
    with serve_viewer(server) as port:
        yield port, maps, server
    clouds.close()
    maps.close()


@pytest.fixture
def tab(service) -> Iterator[Visitor]:
    with Visitor(service[0]) as opened:
        opened.settle(0.2)
        yield opened


def forget_maps(maps: Maps) -> None:
    for computation in list(maps._maps._computations.values()):
        maps._maps._forget(computation)


@pytest.fixture
def held(service, monkeypatch):
    """An empty cache, and blocks that wait until they are released by `held.free += 1`."""
    forget_maps(service[1])

    class Held:
        free = 0
        begun = 0

    compute = mapreduce.capability_block

    def block(grid, number):
        Held.begun += 1
        end = time.monotonic() + 20.0
        while Held.free <= 0 and time.monotonic() < end:
            time.sleep(0.005)
        Held.free -= 1
        return compute(grid, number)

    monkeypatch.setattr(mapreduce, "capability_block", block)
    yield Held
    Held.free = 10**6


def same_places(a: np.ndarray, b: np.ndarray) -> bool:
    key = [np.sort(np.round(1e4 * x).astype(int).view([("", int)] * 3).ravel()) for x in (a, b)]
    return bool(np.array_equal(*key))


def test_a_map_is_drawn_completely_in_its_colours_and_then_idle(tab):
    assert tab.state == "ready"
    tab.compute()
    found = the_map()
    tab.done(len(found.index))
    assert same_places(tab.centres(), found.centres)
    expected = colours.paint(
        found.share.astype(float), colours.Scale("one", 0.0, float(found.share.max())), "cividis"
    )
    expected = np.rint(voxels.LIT * expected).astype(np.uint8)
    at = {tuple(np.round(1e4 * c).astype(int)): tuple(rgb) for c, rgb in zip(found.centres, expected, strict=True)}
    for m in tab.boxes.values():
        places = m["props"]["batched_positions"].reshape(-1, 3)
        painted = m["props"]["batched_colors"].reshape(-1, 3)
        for place, rgb in zip(places, painted, strict=True):
            assert at[tuple(np.round(1e4 * place.astype(float)).astype(int))] == tuple(rgb)
        corners = m["props"]["vertices"].reshape(-1, 3)
        assert np.ptp(corners, axis=0) == pytest.approx(voxels.FILL * found.grid.voxel)
    assert views.CERTAINTY["closed form"] in html.unescape(tab.html)
    sent = tab.sent("BatchedMeshesMessage")
    tab.settle()
    assert tab.sent("BatchedMeshesMessage") == sent


def test_the_map_respects_locked_joints(tab):
    tab.set("Locked", "1")
    tab.wait(lambda: "Joint 1 locked" in tab.html)
    tab.compute()
    locked = (float(PIONEER.q_home[0]), None, None, None, None)
    found = kin.workspace.capability_map(PIONEER, resolution=15, directions=12, locked=locked)
    tab.done(len(found.index))
    assert same_places(tab.centres(), found.centres)
    assert "With joint 1 locked." in tab.html


def test_a_map_offers_what_fits(tab):
    def offered():
        return tuple(tab.gui[tab.element("Map")]["props"]["options"])

    assert offered() == ("Start",)
    tab.set("Grid", f"{LENGTH} voxels long")
    tab.push("Start")
    tab.wait(lambda: tab.state == "done")
    tab.wait(lambda: offered() == ("Clear",))
    tab.set("Directions", "48")
    tab.wait(lambda: offered() == ("Start", "Clear"))


def test_voxels_are_shown_while_the_map_grows_and_kept_on_stop(tab, held, monkeypatch):
    monkeypatch.setattr("app.shared.maps.PUBLISHED_EVERY", 0.0)
    tab.compute()
    held.free = 1
    tab.wait(lambda: tab.state == "computing" and tab.count() > 0)
    part = tab.count()
    assert part < len(the_map().index)
    assert "so far" in tab.html
    tab.push("Stop")
    tab.wait(lambda: tab.state == "stopped")
    held.free = 10**6
    tab.settle()
    assert tab.count() == part
    tab.push("Clear")
    tab.wait(lambda: tab.count() == 0 and tab.state == "ready")
    assert "so far" not in tab.html
    assert "data-shown" not in tab.html


@pytest.mark.full
def test_the_threshold_hides_levels_without_sending_voxels(tab):
    found = the_map()
    tab.compute()
    tab.done(len(found.index))
    sent = tab.sent("BatchedMeshesMessage")
    for percent in (4, 48, 96, 0):
        tab.set("Hide voxels below (% of the best)", percent)
        first = percent / 100 * voxels.LEVELS
        expected = int((voxels.levels(found.share) >= round(first)).sum())
        tab.wait(lambda expected=expected: f'data-shown="{expected}"' in tab.html)
        tab.settle(0.2)
        assert tab.count(only_visible=True) == expected
    assert tab.sent("BatchedMeshesMessage") == sent
    tab.set("Hide voxels below (% of the best)", 48)
    tab.set("Voxels show", "Manipulability")
    low = voxels.levels(found.manipulability) >= 12
    tab.wait(lambda: f'data-shown="{low.sum()}"' in tab.html and tab.count() == len(found.index))
    tab.wait(lambda: tab.count(only_visible=True) == low.sum())
    assert same_places(tab.centres(only_visible=True), found.centres[low])
    assert 'data-legend="map-manipulability"' in tab.html


@pytest.mark.full
def test_the_cut_of_the_tab_applies_to_the_voxels(tab):
    found = the_map()
    tab.compute()
    tab.done(len(found.index))
    tab.set("Cut", "across z (level)")
    made = cut.cut_of([PIONEER], "z", PIONEER.q_home)
    below = found.centres[:, 2] < made.middle
    tab.wait(lambda: tab.count() == below.sum())
    assert same_places(tab.centres(), found.centres[below])
    tab.set("Keep", "other side")
    tab.wait(lambda: tab.count() == (~below).sum())
    tab.set("Cut", "none")
    tab.wait(lambda: tab.count() == len(found.index))


def test_a_new_map_opens_cut_along_the_arm_on_the_side_of_the_camera(tab):
    found = the_map()
    tab.compute(whole=False)
    made = cut.cut_of([PIONEER], "arm", PIONEER.q_home)
    along = found.centres @ np.array(made.normal)
    toward = float(np.array(made.normal) @ DIRECTION)
    far = along < made.middle if toward > 0.0 else along >= made.middle
    assert 0.2 < far.mean() < 0.8
    tab.done(int(far.sum()))
    assert same_places(tab.centres(), found.centres[far])
    assert tab.value("Cut") == "along the arm"
    tab.push("Clear")
    tab.wait(lambda: tab.value("Cut") == "none")


@pytest.mark.full
def test_a_new_map_stays_whole_for_who_has_chosen_no_cut_and_where_it_is_flat(service, tab):
    tab.compute()
    tab.done(len(the_map().index))
    assert tab.value("Cut") == "none"
    flat = STORE.get("planar3r")
    with Visitor(service[0]) as other:
        other.settle(0.2)
        other.set("Robot", flat.name)
        other.settle(0.2)
        other.compute(whole=False)
        other.done(len(the_map(flat).index))
        assert other.value("Cut") == "none"


def test_a_click_describes_the_voxel_and_draws_its_directions(tab):
    found = the_map()
    tab.compute()
    tab.done(len(found.index))
    row = int(found.share.argmax())
    name, instance = next(
        (name, int(hits[0]))
        for name, m in tab.boxes.items()
        if len(
            hits := np.flatnonzero(
                np.abs(m["props"]["batched_positions"].reshape(-1, 3) - found.centres[row]).max(axis=1) < 1e-5
            )
        )
    )
    tab.hit(name, instance)
    tab.wait(lambda: "picked voxel" in tab.html)
    fits = found.approachable[row]
    assert f"{fits.sum()} of 12 directions" in tab.html
    (arrows,) = [m for m in tab.nodes.values() if m["type"] == "ArrowMessage"]
    ends = arrows["props"]["points"].reshape(-1, 2, 3).astype(float)
    along = ends[:, 1] - ends[:, 0]
    assert np.allclose(along / np.linalg.norm(along, axis=1)[:, None], found.grid.directions[fits], atol=1e-5)
    top = arrows["name"].rsplit("/", 1)[0]
    assert np.allclose(tab.poses[top]["position"], found.centres[row])
    tab.hit(name, 10**6)  # no such instance
    tab.settle()
    assert "picked voxel" in tab.html
    tab.push("Clear")
    tab.wait(lambda: "picked voxel" not in tab.html and top not in tab.nodes)


def test_another_robot_clears_the_map(tab):
    tab.compute()
    tab.wait(lambda: tab.state == "done" and tab.count() > 0, 60.0)
    tab.set("Robot", PUMA.name)
    tab.wait(lambda: tab.state == "ready" and tab.count() == 0, 60.0)
    tab.settle()
    tab.compute()
    tab.done(len(the_map(PUMA).index))


def test_two_visitors_share_a_map_and_the_last_to_leave_cancels_it(service, held):
    port, maps, _ = service
    with Visitor(port) as one, Visitor(port) as two:
        for visitor in (one, two):
            visitor.settle(0.2)
            visitor.compute()
            visitor.wait(lambda visitor=visitor: visitor.state == "computing")
        (computation,) = maps._maps._computations.values()
        assert computation._subscribers == 2
        one.push("Clear")
        one.wait(lambda: one.state == "ready")
        assert computation._subscribers == 1
        assert not computation._cancelled
    end = time.monotonic() + 10.0
    while not computation._cancelled:
        assert time.monotonic() < end, "a visitor who closes the page wants nothing any more"
        time.sleep(0.02)
    held.free = 10**6
    while any(t.name.startswith("capability") for t in threading.enumerate()):
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_failure_is_reported_and_the_next_attempt_succeeds(tab, service, monkeypatch, caplog):
    forget_maps(service[1])
    with monkeypatch.context() as broken:
        broken.setattr(mapreduce, "capability_block", lambda grid, block: 1 / 0)
        tab.compute()
        tab.wait(lambda: tab.state == "failed" and "Something went wrong" in tab.html)
    assert "ZeroDivisionError" in caplog.text
    tab.push("Start")
    tab.done(len(the_map().index))


def test_wrong_values_are_reported_and_the_page_keeps_working(tab):
    for label, value in (("Grid", "huge"), ("Directions", 12), ("Voxels show", None)):
        tab.set(label, value)
        tab.wait(lambda: "Invalid input" in tab.html)
    tab.compute()
    tab.done(len(the_map().index))


def test_an_address_restores_the_map(service):
    port, _, server = service
    with Visitor(port) as tab:
        tab.settle(0.2)
        feature = next(t for t in server.pages[max(server.pages)].tabs if t.key == "workspace")
        state = {"resolution": LENGTH, "directions": 12, "by": "manipulability", "least": 0.4, "drawn": True}
        with feature.stage.client.atomic():
            feature.restore({"capability": state, "map": "viridis"})
        feature.post("more")
        found = the_map()
        tab.done(len(found.index))
        assert tab.value("Voxels show") == "Manipulability"
        assert tab.value("Hide voxels below (% of the best)") == 40
        assert tab.count(only_visible=True) == (voxels.levels(found.manipulability) >= 10).sum()
        assert feature.state()["capability"] == state
