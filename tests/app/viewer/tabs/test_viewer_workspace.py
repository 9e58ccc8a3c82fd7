"""The workspace tab: streaming, pausing, cutting, recolouring and clicking clouds, on the real viewer server."""

from __future__ import annotations

import base64
import html
import io
import math
import re
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from arms import CLASSICS
from bare_page import bare_page
from fake_browser import FakeBrowser
from live_server import serve_viewer
from PIL import Image

import kin
from app.exports.svg import tick_labels
from app.shared.clouds import SAMPLED, Cloud, Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.panel.joints import UNLOCK_ALL
from app.viewer.server import ViewerServer
from app.viewer.tabs.workspace import axes, colours, cut, pick, send_window, sizes, views
from app.viewer.tabs.workspace.section import plot
from app.viewer.tabs.workspace.section.panel import subscribe_section, turned
from app.viewer.tabs.workspace.settings import MAX_POINTS, WorkspaceSettings, default_size
from app.viewer.tabs.workspace.tab import Workspace
from kin.robot import Joint
from kin.units import DEFAULT_UNITS, Units, grouped

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE, SUMMARIES = Store(), Summaries()
PIONEER, PUMA = STORE.get("pioneer5"), STORE.get("puma560")
N = 2 * SAMPLED + 1000  # three parts
HALF = 5e-4  # m: error of half precision


# Colours


@pytest.mark.parametrize("name", colours.MAPS)
def test_the_brightness_of_a_colour_map_increases(name):
    table = colours.table(name).astype(float)
    assert table.shape == (256, 3)
    luminance = table @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > -1.0).all(), "brightness alone tells low from high"
    assert luminance[-1] - luminance[0] > 150


def test_values_outside_a_scale_have_its_end_colours():
    scale = colours.Scale("height", -1.0, 3.0)
    painted = colours.paint(np.array([-9.0, -1.0, 1.0, 3.0, 9.0]), scale, "cividis")
    table = colours.table("cividis")
    assert np.array_equal(painted, table[[0, 0, 127, 255, 255]])


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda r: r.id)
@pytest.mark.parametrize("by", [b for b in colours.BY.values() if b != "one"])
def test_a_scale_covers_nearly_all_points(robot, by):
    chunk = Cloud(robot, 5000, seed=8, measures=colours.measures(by)).slice(0, 5000)
    values = colours.quantity(robot, by, chunk)
    scale = colours.scale_of(robot, by)
    assert scale.low < scale.high
    assert ((values >= scale.low) & (values <= scale.high)).mean() > 0.98
    legend = colours.legend(scale, "viridis", DEFAULT_UNITS)
    assert colours.value_text(by, scale.high, DEFAULT_UNITS) in legend
    assert colours.MEANING[by].replace("'", "&#39;") in legend


def test_radius_and_height_are_those_of_the_section():
    turned = replace(PIONEER, base=tuple(map(tuple, _pose(0.3, -0.2, 0.5).tolist())))
    q = turned.random_q(np.random.default_rng(3), 20)
    section = kin.workspace.workspace_section(turned, resolution=8)
    p = kin.fk_positions(turned, q) - section.origin
    height = p @ section.v
    r, z = colours.radius_and_height(turned, kin.fk_positions(turned, q))
    assert np.allclose(z, height, atol=1e-12)
    assert np.allclose(r, np.linalg.norm(p - height[:, None] * section.v, axis=1), atol=1e-12)


def _pose(x, y, tilt):
    T = np.eye(4)
    T[1:3, 1:3] = [[math.cos(tilt), -math.sin(tilt)], [math.sin(tilt), math.cos(tilt)]]
    T[:2, 3] = x, y
    return T


# Cuts


@pytest.mark.parametrize("axis", ["x", "y", "z", "arm"])
def test_the_visible_part_of_a_cut_ends_at_the_slider(axis):
    points = Cloud(PIONEER, 20_000).slice(0, 20_000).points
    made = cut.cut_of([PIONEER, PUMA], axis, PIONEER.q_home)
    assert made.count <= cut.MAX_SLABS
    slab = made.slabs(points)
    along = points @ np.array(made.normal)
    for k in (0, 1, made.count // 2, made.count):
        at = made.low + k * made.step
        below, above = made.shown(at, "below")[slab], made.shown(at, "above")[slab]
        assert np.array_equal(below, ~above)
        inner = (along > made.low) & (along < made.high) & (np.abs(along - at) > 1e-6)
        assert np.array_equal(below[inner], (along < at)[inner])
        assert made.shown(at, "slice").sum() == 1
    assert made.low < made.middle < made.high
    assert abs(made.middle / made.step - round(made.middle / made.step)) < 1e-9


def test_the_plane_of_the_arm_contains_the_tool_and_the_axis():
    q = PIONEER.random_q(np.random.default_rng(1))
    normal = np.array(cut.cut_of([PIONEER], "arm", q).normal)
    point, axis = colours.axis_of_joint_1(PIONEER)
    assert abs(normal @ axis) < 1e-12
    assert abs(normal @ (kin.fk(PIONEER, q)[:3, 3] - point)) < 1e-12
    assert np.linalg.norm(normal) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("least", "step"), [(0.011, 0.02), (0.02, 0.02), (0.05, 0.05), (0.0051, 0.01), (3.0, 5.0)]
)
def test_steps_are_round(least, step):
    assert cut.nice_step(least) == pytest.approx(step)


# Clicks


def test_a_click_picks_the_point_on_the_ray_nearest_to_the_eye():
    points = np.array([[0, 0, 5], [0, 0.001, 2], [0, 0, -1], [0.02, 0, 3], [1, 1, 4]], dtype=np.float32)
    ray = (np.zeros(3), np.array([0.0, 0.0, 1.0]))

    def found(visible=None, pts=points):
        return pick.nearest(pts, 100, visible, *ray, 0.003)

    assert found().index == 101
    assert found().hit
    seen = np.array([True, False, True, True, True])
    assert found(seen).index == 100, "what the cut hides is not meant"
    seen[0] = False
    assert found(seen).index == 103, "near is meant where nothing is hit"
    assert not found(seen).hit
    assert found(np.zeros(5, bool)) is None
    assert found(pts=points[4:]) is None
    assert found().before(found(seen))
    assert not found(seen).before(found())
    assert found(seen).before(None)


# WorkspaceSettings


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("n", v) for v in (0, MAX_POINTS + 1, 1.5, "many", None, True, math.nan, math.inf, [])),
        *(("seed", v) for v in (-1, 0.5, 1e300, {})),
        *(("size", v) for v in ("x", math.nan, None, False)),
        *(("strategy", v) for v in ("guess", None, 3, ["uniform"])),
        *(("by", v) for v in ("taste", None)),
        *(("compare", v) for v in (3, ["ur5"])),
        ("axis", "w"),
        ("sizes", 1),
    ],
)
def test_a_wrong_setting_is_named_and_ignored_in_an_address(name, value):
    settings = replace(WorkspaceSettings.fresh(PIONEER), n=77)
    with pytest.raises(kin.InputError, match=name):
        WorkspaceSettings.spec(name).unpack(name, value, PIONEER)
    state = {name: value, "seed": 3 if name != "seed" else value}
    assert settings.restored(state, PIONEER) == replace(settings, seed=3 if name != "seed" else 0)


def test_settings_are_restored_from_their_state():
    settings = WorkspaceSettings(
        5, "quasi", 9, "limit_margin", "viridis", 0.002, "arm", 0.01, "slice", "puma560", True, True, False
    )
    fresh = WorkspaceSettings.fresh(PIONEER)
    assert fresh.restored(settings.state(), PIONEER) == settings
    assert fresh.restored({**settings.state(), "unheard": 1}, PIONEER) == settings
    assert fresh.restored({"by": "limits"}, PIONEER).by == "limit_margin"  # as in older links


def test_a_robot_to_compare_with_that_is_gone_is_left_out() -> None:
    with bare_page(PIONEER) as page:
        opened = page.open(Workspace)
        for name in ("nobody", PIONEER.id):
            page.restore({"compare": name, "seed": 4})
            assert opened.state()["compare"] is None
            assert opened.state()["seed"] == 4
        page.restore({"compare": PUMA.id})
        assert opened.state()["compare"] == PUMA.id
        page.change(PUMA)
        assert opened.state()["compare"] is None


def test_figures_of_the_chapter_are_offered_while_one_of_its_arms_is_on_show() -> None:
    with bare_page(PIONEER) as page:
        page.open(Workspace)
        assert PIONEER.source in page.control("As in the book").hint
        page.change(PUMA)
        assert "As in the book" not in str(page.panel())
        page.change(kin.get_robot("redundant7"))
        assert "table 3" in page.control("As in the book").hint


# Plot and numbers


def test_the_drawn_cloud_is_inside_the_drawn_boundary():
    found = kin.workspace.workspace_section(PIONEER, resolution=32)
    frame = plot.frame_of(found)
    density = plot.Density(frame)
    points = Cloud(PIONEER, 30_000).slice(0, 30_000).points
    density.add(PIONEER, points)
    assert density.counts.sum() == len(points)
    assert density.parts == 1
    alpha = np.asarray(Image.open(io.BytesIO(base64.b64decode(density.image_url().partition(",")[2]))))[..., 3]
    assert np.array_equal(alpha > 0, density.counts > 0)
    drawn = plot.plot_html(found, frame, plot.image(density), DEFAULT_UNITS)
    assert "data:image/png;base64," in drawn
    assert {int(j) for j in re.findall(r'data-arc="(\d)"', drawn)} == {a.joint + 1 for a in found.arcs}
    assert drawn.count("data-arc") == len(found.arcs)
    assert "data:image" not in plot.plot_html(found, frame, "", DEFAULT_UNITS)
    # Equal scales, z upwards.
    a, b, c = frame.at(np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]]))
    assert b[0] - a[0] == pytest.approx(a[1] - c[1])
    x, y = frame.at(np.array([0.2, 0.05]))
    assert f'cx="{x:.1f}" cy="{y:.1f}"' in plot.tool_html(frame, 0.2, 0.05)


def test_the_plot_of_an_arm_in_a_plane_has_room_for_the_title_of_its_axis():
    found = kin.workspace.workspace_section(kin.get_robot("planar2r"), resolution=32)
    height = np.concatenate(found.curves)[:, 1]
    frame = plot.frame_of(found)
    assert np.ptp(height) < 1e-5
    assert frame.bottom - frame.top == pytest.approx(plot.SHORTEST)
    assert sum(frame.y) / 2 == pytest.approx(height.mean(), abs=1e-5), "the section is in the middle"
    assert frame.right == pytest.approx(plot.WIDTH - plot.RIGHT), "and as wide as before"


def test_an_arm_with_a_prismatic_first_joint_has_no_section():
    rows = (Joint("slide", kind="prismatic", limits=(0.0, 1.0)), Joint("turn", a=0.5, limits=(-1.0, 1.0)))
    slider = replace(PIONEER, rows=rows, home=(0.0, 0.0))
    assert subscribe_section(SUMMARIES, slider) is None


def test_sizes_mark_values_that_are_not_computed_yet():
    facts = SUMMARIES.facts(PIONEER, effort=None).future.result()
    table = sizes.html(facts, waiting=True, units=DEFAULT_UNITS)
    assert table.count("computing…") == 2
    assert f"{1000 * facts.reach.largest.value:.1f}" in table
    assert "none" in table
    assert "unknown" in sizes.html(facts, waiting=False, units=DEFAULT_UNITS)


@pytest.mark.parametrize(("length", "scale", "decimals"), [("mm", 1000, 0), ("cm", 100, 1), ("m", 1, 3)])
def test_sizes_legend_and_picked_point_follow_the_units(length, scale, decimals):
    units, facts = Units(length=length), SUMMARIES.facts(PIONEER, effort=None).future.result()
    table = sizes.html(facts, True, units)
    assert f">{scale * facts.reach.largest.value:.{decimals + 1}f}<" in table
    assert table.count(f">{length}<") == 7 - table.count(">none<")
    scales = colours.scale_of(PIONEER, "radius")
    assert f"{scale * scales.high:.{decimals}f} {length}" in colours.legend(scales, "viridis", units)
    point = np.array([0.1234, -0.2, 0.0])
    text = views.picked(pick.Picked(Cloud(PIONEER, 8), 7, PIONEER.q_home, point), units)
    assert f">{scale * 0.1234:.{decimals + 1}f} &nbsp; −{scale * 0.2:.{decimals + 1}f} " in text
    assert f">{length}<" in text


@pytest.mark.parametrize(
    ("length", "ticks"), [("mm", ["0", "100", "200"]), ("cm", ["0", "10", "20"]), ("m", ["0.0", "0.1", "0.2"])]
)
def test_the_drawing_of_the_section_follows_the_units(length, ticks):
    found = kin.workspace.workspace_section(PIONEER, resolution=32)
    drawn = plot.plot_html(found, plot.frame_of(found), "", Units(length=length))
    shown = re.findall(r'text-anchor="middle" class="kb-axis">([−\d.]+)</text>', drawn)
    assert [text for text in ticks if text in shown] == ticks
    assert len({len(text.partition(".")[2]) for text in shown if "." in text or length != "m"}) == 1
    assert f"axis, {length}</text>" in drawn
    assert f"z: height, {length}</text>" in drawn
    assert re.search(rf"alone, radius [\d.]+ {length}</title>", drawn)


def test_tick_labels_below_a_millimetre_differ():
    texts = [text for _, text in tick_labels(0.0, 0.003, DEFAULT_UNITS.lengths.scale)]
    assert texts == ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]


def test_progress_in_words():
    assert views.rate(2_345_678) == "2.35 M"
    assert views.rate(940.4) == "940 "
    line = views.progress("paused", 5000, 100_000, 12_300.0)
    assert 'data-cloud="paused"' in line
    assert "12.3 k points/s" in line
    assert "points/s" not in views.progress("ready", 0, 10, 0.0)
    assert ">joint 2 locked<" in views.progress("ready", 0, 10, 0.0, (None, 0.0, None))
    assert "done" not in views.progress("done", 10, 10, 1.0, old=True)
    assert "locked" not in line


def test_points_are_about_two_pixels():
    sizes_ = [default_size(r) for r in CLASSICS]
    assert all(0.0005 <= s <= 0.02 for s in sizes_)
    assert sizes_[0] < max(sizes_)


# In the viewer


class Visitor(FakeBrowser):
    """A visitor of the workspace tab."""

    def click(self, button: str) -> None:
        self.send("GuiUpdateMessage", uuid=self.element("Cloud"), updates={"value": button})

    @property
    def state(self) -> str:
        return re.search(r'data-cloud="(\w+)"', self.html)[1]

    @property
    def clouds(self) -> list[dict]:
        return [m for m in self.nodes.values() if m["type"] == "PointCloudMessage"]

    @property
    def count(self) -> int:
        return sum(len(m["props"]["points"]) // 3 for m in self.clouds)

    def points(self, only_visible: bool = False) -> np.ndarray:
        shown = [m for m in self.clouds if not only_visible or self.is_visible(m["name"])]
        return np.concatenate([m["props"]["points"].reshape(-1, 3).astype(np.float32) for m in shown])

    def colours(self) -> np.ndarray:
        return np.concatenate([m["props"]["colors"].reshape(-1, 3) for m in self.clouds])

    def is_visible(self, name: str) -> bool:
        parts = name.strip("/").split("/")
        return all(self.visible.get("/" + "/".join(parts[: k + 1]), True) for k in range(len(parts)))

    def done(self, points: int) -> None:
        self.wait(lambda: self.state == "done" and self.count == points, 20.0)

    def draw(self, n: int, seed: int = 0) -> None:
        self.set("Points", n)
        self.set("Seed", seed)
        self.click("Start")
        self.done(n)

    def sent(self, kind: str) -> int:
        return len([m for m in self.log if m["type"] == kind])


@pytest.fixture(scope="module")
def service() -> Iterator[tuple[int, Clouds]]:
    clouds = Clouds()
    server = ViewerServer(STORE, Settings(), clouds)
    with serve_viewer(server) as port:
        yield port, clouds
    clouds.close()


@pytest.fixture
def tab(service) -> Iterator[Visitor]:
    with Visitor(service[0]) as opened:
        opened.settle(0.2)
        yield opened


def whole(robot: kin.Robot, n: int, seed: int = 0, measures=()) -> kin.workspace.WorkspaceChunk:
    return Cloud(robot, n, seed, measures=measures).slice(0, n)


def test_a_cloud_arrives_completely_in_parts(tab):
    assert tab.state == "ready"
    assert tab.clouds == []
    tab.draw(N, seed=11)
    assert len(tab.clouds) == 3
    assert np.abs(tab.points() - whole(PIONEER, N, 11).points).max() < HALF
    values = colours.radius_and_height(PIONEER, whole(PIONEER, N, 11).points)[0]
    expected = colours.paint(values, colours.scale_of(PIONEER, "radius"), "cividis")
    assert np.array_equal(tab.colours(), expected)
    assert "points/s" in tab.html
    sent = tab.sent("PointCloudMessage")
    tab.settle()
    assert tab.sent("PointCloudMessage") == sent, "and then it rests"


def offered(tab):
    """The buttons of the cloud."""
    return tuple(tab.gui[tab.element("Cloud")]["props"]["options"])


def test_many_points_are_warned_of_where_the_page_draws_in_software(tab):
    """The page's script shows the warning; it is there for many points only."""
    tab.set("Points", 200_000)
    tab.settle()
    assert "data-heavy" not in tab.html
    tab.set("Points", MAX_POINTS)
    tab.wait(lambda: "data-heavy" in tab.html)
    assert "with 4\u202f000\u202f000 points the page may freeze for seconds" in tab.html


@pytest.mark.full
def test_pause_stops_the_cloud_and_continue_resumes_it(tab):
    n = 24 * SAMPLED
    tab.set("Points", n)
    tab.set("Seed", 12)
    assert offered(tab) == ("Start",)
    tab.click("Start")
    tab.wait(lambda: tab.count > 0)
    assert offered(tab) == ("Pause", "Stop")
    tab.click("Pause")
    tab.wait(lambda: tab.state == "paused")
    tab.settle()
    held = tab.count
    assert 0 < held < n
    tab.set("Colour by", "Height")
    tab.wait(lambda: tab.sent("SceneNodeUpdateMessage") >= held // SAMPLED)
    tab.settle()
    assert tab.count == held
    assert tab.state == "paused"
    assert offered(tab) == ("Continue", "Clear")
    tab.click("Continue")
    tab.wait(lambda: tab.count > held)
    tab.click("Stop")
    tab.wait(lambda: tab.state == "stopped" or tab.count == n)
    tab.settle()
    tab.click("Start")
    tab.done(n)
    assert offered(tab) == ("Clear",)
    tab.set("Seed", 13)
    tab.wait(lambda: offered(tab) == ("Restart", "Clear"))
    tab.set("Seed", 12)
    assert np.abs(tab.points() - whole(PIONEER, n, 12).points).max() < HALF
    tab.click("Clear")
    tab.wait(lambda: tab.count == 0)
    assert tab.state == "ready"


def test_clear_removes_the_cloud(tab):
    tab.set("Points", MAX_POINTS)
    tab.set("Seed", 13)
    tab.click("Start")
    tab.wait(lambda: tab.count > 0)
    tab.click("Clear")
    tab.wait(lambda: tab.count == 0 and tab.state == "ready")
    tab.settle()
    assert tab.count == 0
    tab.draw(1000)


def test_a_slow_page_is_not_flooded(tab):
    tab.answers = False
    tab.set("Points", MAX_POINTS)
    tab.click("Start")
    tab.wait(lambda: tab.count >= send_window.WINDOW)
    end = time.monotonic() + 0.7
    while time.monotonic() < end:
        tab.read(0.05)
    assert tab.count < send_window.WINDOW + 2 * SAMPLED
    assert tab.state == "running"
    tab.click("Clear")


@pytest.mark.full
def test_a_dragged_arm_and_a_growing_cloud_share_the_connection(tab):
    n = 8 * SAMPLED
    home = kin.fk(PIONEER, PIONEER.q_home)
    tab.grab()
    tab.drag(home)
    tab.wait(lambda: 'data-status="reached"' in tab.html, 60.0)
    tab.set("Points", n)
    tab.set("Seed", 23)
    tab.click("Start")
    end = time.monotonic() + 20.0
    moved = set()
    while tab.count < n:
        assert time.monotonic() < end, f"{tab.count} of {n} points while the arm was dragged"
        T = home.copy()
        T[2, 3] += 0.01 * math.sin(5.0 * time.monotonic())
        tab.drag(T)
        tab.read(0.05)
        moved.add(round(tab.tool_pose()[2, 3], 4))
    tab.release()
    assert len(moved) > 3


@pytest.mark.full
@pytest.mark.parametrize(
    ("label", "by"), [("Height", "height"), ("Manipulability", "manipulability"), ("Limit margin", "limit_margin")]
)
def test_recolouring_sends_colours_and_no_points(tab, label, by):
    tab.draw(N)
    sent = tab.sent("PointCloudMessage")
    tab.set("Colours", "viridis")
    tab.set("Colour by", label)
    chunk = whole(PIONEER, N, measures=colours.measures(by))
    expected = colours.paint(colours.quantity(PIONEER, by, chunk), colours.scale_of(PIONEER, by), "viridis")
    tab.wait(lambda: np.array_equal(tab.colours(), expected) and tab.state == "done")
    assert tab.sent("PointCloudMessage") == sent
    assert f'data-legend="{by}"' in tab.html
    tab.set("Colour by", "One colour")
    tab.wait(lambda: all(len(m["props"]["colors"]) == 3 for m in tab.clouds))


def test_measures_are_computed_only_for_their_colours(tab, monkeypatch):
    asked = []
    part = Clouds.part
    monkeypatch.setattr(Clouds, "part", lambda self, cloud, i: asked.append(cloud) or part(self, cloud, i))
    tab.draw(1000, seed=14)
    assert {c.measures for c in asked} == {()}
    tab.set("Colour by", "Manipulability")
    tab.wait(lambda: any(c.measures for c in asked))
    assert {c.measures for c in asked} == {(), ("manipulability",)}


@pytest.mark.full
def test_a_cut_hides_points_without_sending_any(tab):
    tab.draw(N, seed=15)
    points = tab.points()
    tab.set("Cut", "across z (level)")
    tab.wait(lambda: "Cut at (mm)" in tab.sliders)
    made = cut.cut_of([PIONEER], "z", PIONEER.q_home)
    ends = [mark["label"] for mark in tab.gui[tab.element("Cut at (mm)")]["props"]["_marks"]]
    assert ends == [f"{1000 * made.low:g}".replace("-", "−"), f"{1000 * made.high:g}"]
    assert ends[0].startswith("−")
    tab.wait(lambda: len(tab.clouds) > made.count and tab.count == N and tab.state == "done")
    tab.settle()
    assert np.array_equal(np.sort(tab.points(), axis=0), np.sort(points, axis=0)), "the same points, each once"
    sent = tab.sent("PointCloudMessage")
    for k in (1, made.count // 3, made.count - 2):
        at = made.low + k * made.step
        tab.set("Cut at (mm)", 1000 * at)
        for keep, seen in (("one side", points[:, 2] < at), ("other side", points[:, 2] >= at)):
            tab.set("Keep", keep)
            tab.settle(0.2)
            z = tab.points(only_visible=True)[:, 2]
            assert abs(len(z) - seen.sum()) < 0.01 * N, "half precision moves a few across"
            assert (z < at + HALF).all() if keep == "one side" else (z > at - HALF).all()
    assert tab.sent("PointCloudMessage") == sent
    tab.set("Cut", "none")
    tab.wait(lambda: len(tab.clouds) == 3 and tab.count == N and "Cut at (mm)" not in tab.sliders)
    assert np.array_equal(tab.points(only_visible=True), points)


@pytest.mark.full
def test_the_tab_follows_the_unit_of_length_and_keeps_its_state():
    server = ViewerServer(STORE, Settings(), Clouds())
    with serve_viewer(server) as port, Visitor(port) as tab:
        tab.settle(0.2)
        (session,) = server.pages.values()
        shown = next(tab for tab in session.tabs if tab.key == "workspace")
        tab.draw(2000, seed=17)
        tab.set("Cut", "across z (level)")
        tab.set("Sizes", True)
        tab.set("Section plot", True)
        tab.wait(lambda: "z: height, mm" in tab.html and tab.html.count(" ± ") == 2, 60.0)
        tab.wait(lambda: "Cut at (mm)" in tab.sliders)
        tab.set("Cut at (mm)", 200.0)
        tab.settle()
        size, sent, seen = (
            tab.value("Point size (mm)"),
            tab.sent("PointCloudMessage"),
            tab.points(only_visible=True),
        )
        table = tab.html.count(">mm</td>")
        before = set(shown._panel._live)
        tab.set("Lengths", "cm")
        tab.wait(lambda: "Cut at (cm)" in tab.sliders)
        # Late events of replaced sliders.
        (gone, also) = before - set(shown._panel._live)
        for path, value in (("at", 0.0), ("size", 20.0)):
            shown.post(("at", path, gone, 0), value)
            shown.post(("at", path, also, 0), value)
        tab.settle()
        assert tab.value("Cut at (cm)") == pytest.approx(20.0)
        assert tab.value("Point size (cm)") == pytest.approx(size / 10)
        assert tab.html.count(">cm</td>") == table
        assert "z: height, cm" in tab.html
        assert re.search(r"<span>[−\d.]+ cm</span>", tab.html), "the legend"
        assert not re.search(r"[> ]mm\b(?! or °)", tab.html), "but for the steps of the pad"
        assert tab.sent("PointCloudMessage") == sent
        assert np.array_equal(tab.points(only_visible=True), seen)
        tab.set("Point size (cm)", 0.8)
        tab.wait(lambda: all(m["props"]["point_size"] == pytest.approx(0.004) for m in tab.clouds))
        tab.set("Cut at (cm)", 10.0)
        tab.settle()
        assert tab.points(only_visible=True)[:, 2].max() < 0.1 + HALF


def test_a_cut_while_streaming_loses_no_points(tab):
    n = 12 * SAMPLED
    tab.set("Points", n)
    tab.set("Seed", 16)
    tab.click("Start")
    tab.wait(lambda: tab.count > 0)
    tab.set("Cut", "along the arm")
    tab.wait(lambda: tab.count > 4 * SAMPLED)
    tab.set("Cut", "across x")
    tab.done(n)
    tab.settle()
    a, b = np.sort(tab.points(), axis=0), np.sort(whole(PIONEER, n, 16).points, axis=0)
    assert np.abs(a - b).max() < HALF


def ray_to(point: np.ndarray, eye: np.ndarray) -> dict:
    direction = (point - eye) / np.linalg.norm(point - eye)
    return {
        "event_type": "click",
        "ray_origin": eye.tolist(),
        "ray_direction": direction.tolist(),
        "screen_pos": [[0.5, 0.5]],
        "modifier": None,
    }


@pytest.mark.full
def test_a_click_moves_the_arm_to_the_configuration_of_the_point(tab):
    tab.draw(N, seed=17)
    tab.wait(lambda: tab.sent("ScenePointerEnableMessage") == 1)
    points = whole(PIONEER, N, 17).points
    index = int(np.argmax(points @ np.array([1.0, 1.0, 0.3])))  # on the outside, towards the eye
    tab.send("ScenePointerMessage", **ray_to(points[index].astype(float), np.array([2.0, 2.0, 0.6])))
    tab.wait(lambda: f"Moved to point {grouped(index)}" in tab.html)
    q = kin.workspace.workspace_configurations(PIONEER, index, seed=17)
    tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(PIONEER, q), atol=1e-9))
    tab.settle()
    shown = [tab.value(label) for label in tab.sliders_in("Joints")]
    assert np.abs(np.array(shown) - np.degrees(q)).max() < 0.006
    assert "picked point" in tab.html
    mark = [m for m in tab.nodes.values() if m["type"] == "IcosphereMessage" and "contact" not in m["name"]]
    assert len(mark) == 1
    assert np.allclose(tab.poses[mark[0]["name"]]["position"], kin.fk(PIONEER, q)[:3, 3])
    tab.send("ScenePointerMessage", **ray_to(np.array([9.0, 9.0, 9.0]), np.array([2.0, 2.0, 0.6])))
    tab.wait(lambda: "No point near" in tab.html)


def test_clicks_are_only_handled_while_picking_is_on(tab):
    def wanted() -> bool:
        filters = [m for m in tab.log if m["type"] == "ScenePointerEnableMessage"]
        return bool(filters) and len(filters[-1]["modifiers"]) > 0

    assert not wanted()
    tab.draw(1000)
    tab.wait(wanted)
    tab.set("Click on a point", False)
    tab.wait(lambda: not wanted())
    tab.set("Click on a point", True)
    tab.wait(wanted)
    tab.click("Clear")
    tab.wait(lambda: not wanted())


def test_a_click_respects_the_cut(tab):
    tab.draw(N, seed=18)
    tab.set("Cut", "across x")
    made = cut.cut_of([PIONEER], "x", PIONEER.q_home)
    tab.wait(lambda: len(tab.clouds) > made.count and tab.count == N and tab.state == "done")
    tab.settle()
    eye = np.array([3.0, 0.0, 0.0])
    tab.send("ScenePointerMessage", **ray_to(np.zeros(3), eye))
    tab.wait(lambda: "Moved to point" in tab.html)
    index = int(re.search(r"Moved to point ([\d\u202f]+)", tab.html)[1].replace("\u202f", ""))
    assert whole(PIONEER, N, 18).points[index, 0] < made.middle


def test_the_cloud_respects_locked_joints(tab):
    locked = (None, None, float(PIONEER.q_home[2]), None, float(PIONEER.q_home[4]))
    for joint in ("3", "5"):
        tab.set("Locked", joint)
    tab.wait(lambda: ">joints 3, 5 locked<" in tab.html)
    tab.draw(N, seed=30)
    (chunk,) = kin.workspace.sample_workspace(PIONEER, N, seed=30, locked=locked, chunk=N)
    assert np.abs(tab.points() - chunk.points).max() < HALF
    index = int(np.argmax(chunk.points @ np.array([1.0, 1.0, 0.3])))
    tab.send("ScenePointerMessage", **ray_to(chunk.points[index].astype(float), np.array([2.0, 2.0, 0.6])))
    tab.wait(lambda: f"Moved to point {grouped(index)}" in tab.html)
    q = kin.workspace.workspace_configurations(PIONEER, index, seed=30, locked=locked)
    tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(PIONEER, q), atol=1e-9))
    tab.set("Compare with", PUMA.name)
    tab.done(2 * N)
    tab.set("Compare with", "none")
    tab.set("Locked", UNLOCK_ALL)
    tab.wait(lambda: "No joint is locked" in tab.html)
    assert f">joints 3, 5 locked. {views.OLD}<" in tab.html, "the cloud is the same"
    tab.click("Start")
    tab.wait(lambda: ">joints 3, 5 locked<" not in tab.html)
    tab.done(N)
    assert np.abs(tab.points() - whole(PIONEER, N, 30).points).max() < HALF


def test_a_cloud_of_other_settings_or_locks_says_so(tab):
    tab.draw(2_000)
    tab.wait(lambda: tab.state == "done")
    tab.set("Seed", 7)
    tab.wait(lambda: tab.state == "outdated" and views.OLD in tab.html)
    grey = [list(colours.OLD)]
    tab.wait(lambda: all(m["props"]["colors"].reshape(-1, 3).tolist() == grey for m in tab.clouds))
    assert offered(tab) == ("Restart", "Clear")
    tab.set("Seed", 0)
    tab.wait(lambda: tab.state == "done" and views.OLD not in tab.html)
    tab.wait(lambda: all(len(m["props"]["colors"].reshape(-1, 3)) > 1 for m in tab.clouds))
    tab.set("Sampling", "joints spread evenly")
    tab.wait(lambda: tab.state == "outdated")
    tab.click("Restart")
    tab.wait(lambda: tab.state == "done" and views.OLD not in tab.html)


def test_a_figure_of_the_chapter_is_one_click(tab):
    tab.set("As in the book", "Figure 10")
    tab.done(20_000)
    expected = whole(kin.get_robot("redundant7"), 20_000, 0).points
    assert np.abs(tab.points() - expected).max() < HALF
    texts = {
        m["props"]["text"]
        for m in tab.nodes.values()
        if m["name"].startswith("/workspace") and "text" in m["props"]
    }
    assert {"x (mm)", "y (mm)", "z (mm)", "0", "1000", "−1000"} <= texts
    tab.set("Axes with numbers", False)
    tab.wait(lambda: not any("(mm)" in m["props"].get("text", "") for m in tab.nodes.values()))


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_the_box_of_the_axes_contains_the_workspace(robot):
    low, high = axes.box_of(robot)
    points = kin.fk_positions(robot, robot.random_q(np.random.default_rng(3), 500))
    assert (points > low).all()
    assert (points < high).all()


def test_axes_follow_units_background_and_robot_and_are_in_the_picture() -> None:
    with bare_page(PIONEER) as page:
        page.open(Workspace)

        def texts() -> set[str]:
            return {props["text"] for _, _, props in page.scene() if "text" in props}

        def inks() -> list[list[int]]:
            return [props["colors"] for kind, _, props in page.scene() if kind == "LineSegmentsHandle"]

        page.set("Axes with numbers", True)
        page.rest()
        assert {"x (mm)", "y (mm)", "z (mm)", "0"} <= texts()
        assert np.array_equal(page.views[-1][1], axes.corners_of(PIONEER))
        light = inks()
        page.dark = True
        page.style(Units(length="cm"))
        assert not any("(mm)" in text for text in texts())
        assert {"x (cm)", "y (cm)", "z (cm)"} <= texts()
        assert len(light) == len(inks()) == 1
        assert light != inks()
        page.change(PUMA)
        assert np.array_equal(page.views[-1][1], axes.corners_of(PUMA))
        page.set("Axes with numbers", False)
        page.rest()
        assert not texts()
        assert page.views[-1][1] is None


def test_two_arms_in_one_scene_have_different_colours(tab):
    tab.draw(N, seed=19)
    tab.set("Compare with", PUMA.name)
    tab.done(2 * N)
    tab.settle()
    assert f"orange: {PUMA.name}" in tab.html
    assert f"blue: {PIONEER.name}" in tab.html
    for colour, robot in ((colours.OWN, PIONEER), (colours.OTHER, PUMA)):
        found = [m["props"] for m in tab.clouds if tuple(m["props"]["colors"].tolist()) == colour]
        points = np.concatenate([p["points"].reshape(-1, 3).astype(float) for p in found])
        assert np.abs(points - whole(robot, N, 19).points).max() < 2 * HALF
    tab.set("Compare with", "none")
    tab.wait(lambda: tab.count == N and len(tab.colours()) == N)


def test_another_robot_clears_the_cloud(tab):
    tab.set("Points", MAX_POINTS)
    tab.set("Cut", "along the arm")
    tab.set("Compare with", PUMA.name)
    tab.click("Start")
    tab.wait(lambda: tab.count > 0)
    tab.set("Robot", PUMA.name)
    tab.wait(lambda: tab.count == 0 and tab.state == "ready", 60.0)
    tab.settle()
    assert tab.count == 0
    assert tab.value("Cut") == "none"
    assert tab.value("Compare with") == "none"
    compare = tab.gui[tab.element("Compare with")]["props"]["options"]
    assert PUMA.name not in compare
    assert PIONEER.name in compare
    tab.draw(1000)
    assert np.abs(tab.points() - whole(PUMA, 1000).points).max() < 2 * HALF


def test_a_second_visitor_gets_the_parts_from_the_cache(tab, service, monkeypatch):
    computed = []
    slice_of = Cloud.slice

    def counting(self, *args):
        computed.append(args)
        return slice_of(self, *args)

    monkeypatch.setattr(Cloud, "slice", counting)
    tab.draw(N, seed=20)
    assert len(computed) == 3
    with Visitor(service[0]) as other:
        other.settle(0.2)
        other.draw(N, seed=20)
        assert np.array_equal(other.points(), tab.points())
    assert len(computed) == 3


def test_wrong_numbers_are_reported_and_the_page_keeps_working(tab):
    for label, value in (("Points", 0), ("Seed", -1), ("Sampling", "by hand"), ("Cut", "in half")):
        tab.set(label, value)
        tab.wait(lambda value=value: f"got {value!r}" in html.unescape(tab.html) and "Invalid input" in tab.html)
    tab.set("Points", 1)
    tab.set("Seed", 0)
    tab.draw(1000)


def test_a_failing_part_is_reported_pauses_the_cloud_and_can_be_retried(tab, monkeypatch, caplog):
    slice_of = Cloud.slice

    def failing(self, start, *args):
        if start >= SAMPLED:
            raise RuntimeError("out of chalk")
        return slice_of(self, start, *args)

    monkeypatch.setattr(Cloud, "slice", failing)
    tab.set("Points", N)
    tab.set("Seed", 21)
    tab.click("Start")
    tab.wait(lambda: "Something went wrong" in tab.html and tab.state == "paused")
    assert tab.count == SAMPLED
    assert "out of chalk" in caplog.text
    monkeypatch.setattr(Cloud, "slice", slice_of)
    tab.click("Start")
    tab.done(N)
    assert np.abs(tab.points() - whole(PIONEER, N, 21).points).max() < HALF


@pytest.mark.full
def test_section_and_sizes_appear_when_they_are_ready(tab):
    robot = STORE.get("scara")  # the fastest to compute
    tab.set("Robot", robot.name)
    tab.wait(lambda: robot.description.partition(". ")[0] in html.unescape(tab.html), 60.0)
    tab.settle()
    tab.draw(5000)
    tab.set("Sizes", True)
    tab.set("Section plot", True)
    tab.wait(lambda: 'data-plot="section"' in tab.html, 60.0)
    tab.wait(lambda: "data:image/png" in tab.html, 60.0)
    tab.wait(lambda: "sizes of the workspace" in tab.html and "computing…" not in tab.html, 60.0)
    before = re.search(r'data-plot="tool".*?cx="([\d.]+)"', tab.html)[1]
    tab.set(next(label for label in tab.sliders if label.startswith(("2 ", "Joint 2"))), 25)
    tab.wait(lambda: re.search(r'data-plot="tool".*?cx="([\d.]+)"', tab.html)[1] != before)
    tab.settle()
    frame = plot.frame_of(kin.workspace.workspace_section(robot))
    r, z = colours.radius_and_height(robot, tab.tool_pose()[None, :3, 3])
    x, y = frame.at(np.stack([r, z], axis=1))[0]
    assert f'cx="{x:.1f}" cy="{y:.1f}"' in tab.html
    signed = kin.workspace.workspace_section(robot, signed=True)
    outline: list[str] = []

    def drawn():
        outline[:] = [
            m["name"] for m in tab.nodes.values() if m["name"].startswith("/workspace") and "Line" in m["type"]
        ]
        return len(outline) == len(signed.curves) + len(signed.arcs)

    tab.wait(drawn, 60.0)
    tab.draw(4000, seed=24)
    density = plot.Density(frame)
    density.add(robot, whole(robot, 4000, 24).points)
    expected = density.image_url()
    tab.wait(lambda: expected in tab.html, 20.0)  # the points of the new cloud only
    tab.click("Clear")
    tab.wait(lambda: "data:image/png" not in tab.html)
    tab.set("Section plot", False)
    tab.wait(lambda: tab.sent("GuiPanelRemoveMessage") == 1)
    assert not any(name in tab.nodes for name in outline)
    tab.set("Sizes", False)
    tab.wait(lambda: "sizes of the workspace" not in tab.html)


def test_the_outline_faces_as_joint_1_does_and_contains_the_tool():
    section = kin.workspace.workspace_section(PIONEER, resolution=8, signed=True)
    sides = set()
    for q in PIONEER.random_q(np.random.default_rng(5), 40):
        tool = kin.fk(PIONEER, q)[:3, 3]
        front = kin.transforms.rotation_from_wxyz(turned(section, tool, float(q[0]))) @ section.u
        across = (tool - section.origin) * (1.0, 1.0, 0.0)
        assert np.linalg.norm(np.cross(front, across)) < 1e-9, "the tool is in the plane"
        assert front @ (math.cos(q[0]), math.sin(q[0]), 0.0) >= 0.0
        sides.add(front @ across > 0.0)
    assert sides == {True, False}


def test_no_thread_is_left_running(tab):
    tab.draw(5000)
    tab.settle()
    end = time.monotonic() + 5.0
    while any(t.name.startswith("workspace") for t in threading.enumerate()):
        assert time.monotonic() < end
        time.sleep(0.01)


def test_an_address_restores_the_tab(service):
    with Visitor(service[0]) as tab:
        tab.settle(0.2)
    clouds = service[1]
    server = ViewerServer(STORE, Settings(), clouds)
    with serve_viewer(server) as port, Visitor(port) as tab:
        tab.settle(0.2)
        feature = next(t for t in next(iter(server.pages.values())).tabs if t.key == "workspace")
        with feature.stage.client.atomic():
            feature.restore({"n": 3000, "seed": 5, "axis": "z", "at": 0.1, "by": "nonsense", "drawn": True})
        feature.post("more")
        tab.done(3000)
        tab.settle()
        assert tab.value("Points") == 3000
        assert tab.value("Cut") == "across z (level)"
        assert tab.value("Cut at (mm)") == pytest.approx(100)
        assert tab.value("Colour by") == "Radius"
        assert (tab.points(only_visible=True)[:, 2] < 0.1 + HALF).all()
        state = feature.state()
        assert (state["n"], state["at"], state["drawn"]) == (3000, 0.1, True)
    server.stop()
