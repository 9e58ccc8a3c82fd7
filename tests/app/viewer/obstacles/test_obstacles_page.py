"""Obstacles in a visitor's page: added, touched, dragged, typed, taken back, shared, avoided."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser

import kin
from app.viewer.obstacles.feature import ObstaclesFeature
from app.viewer.panel.joints import label
from app.viewer.scene.bodies.nodes import TOUCHING
from app.viewer.scene.meshes import body
from app.viewer.session import events
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode
from kin.poses import read_pose
from kin.units import DEFAULT_UNITS

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ROBOTS = CLASSICS
UR5 = kin.get_robot("ur5")
AVOID = "Avoid collisions"
WALL = kin.Obstacle("box", (0.0, 0.35, 0.5), size=(1.5, 0.1, 1.5), name="wall")
TOUCHING_AT = next(
    turn for turn in range(-180, 181, 2) if kin.clearance(UR5, [np.radians(turn), *UR5.q_home[1:]], [WALL]) < -0.02
)
UR5_ALONE = PageState("ur5")


def say(tab: FakeBrowser, *key: object, value: object = None) -> None:
    tab.say("feature", ["obstacles", [*key, 1], value])
    tab.settle()


def opened(state: PageState) -> str:
    return json.dumps({"address": "http://a/", "state": encode(state)})


def kept(tab: FakeBrowser) -> PageState:
    return decode(tab.stored(), ROBOTS)


def bodies(tab: FakeBrowser) -> dict[str, tuple[int, ...]]:
    """Nodes of obstacles, and their colours."""
    return {
        name: tuple(m["props"]["color"])
        for name, m in tab.nodes.items()
        if "/obstacle-" in name and "color" in m["props"] and "gizmo" not in name
    }


@pytest.mark.full
def test_a_table_is_added_typed_and_taken_back(port: int) -> None:
    with FakeBrowser(port, memory=opened(UR5_ALONE)) as tab:
        tab.settle()
        say(tab, "add", "table")
        assert "Added: table" in tab.html
        assert len(bodies(tab)) == 3
        assert any("obstacle-gizmo" in name for name in tab.nodes)
        say(tab, "set", "z", value="0.35 m")
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz[2] == 0.35)
        say(tab, "set", "width", value="-5")
        assert "Valid: 0.1 to 100000 mm" in tab.html
        assert 'aria-invalid="true"' in tab.html
        say(tab, "set", "width", value="2*400")
        assert 'aria-invalid="true"' not in tab.html
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].size[1] == pytest.approx(0.8))
        say(tab, "remove")
        assert not bodies(tab)
        for _ in range(4):
            assert tab.script["undo"]
            tab.say("undo")
            tab.settle()
        tab.wait(lambda: not kept(tab).obstacles)
        tab.say("redo")
        tab.settle()
        assert len(bodies(tab)) == 3


@pytest.mark.parametrize(("height", "casts"), [(0.1, set()), (0.4, {"core"})])
def test_no_shadow_of_a_table_shows_on_its_own_top(port: int, height: float, casts: set[str]) -> None:
    """What casts it is far below the top, which receives the shadow of the arm; a thin table casts none."""
    table = kin.Obstacle("table", (0.6, 0.0, 0.4), size=(0.8, 0.6, height))
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(table,)))) as tab:
        tab.settle()
        parts = {name.rpartition("/")[2]: tab.nodes[name]["props"] for name in bodies(tab)}
        assert {name for name, props in parts.items() if props["cast_shadow"]} == casts
        assert {name for name, props in parts.items() if props["receive_shadow"]} == {"top"}
        for name in casts:
            node = next(each for each in bodies(tab) if each.endswith(name))
            below = tab.poses[node]["position"][2] + 0.5 * parts[name]["dimensions"][2]
            assert below == pytest.approx(-0.25 * body(UR5).radius)
            assert tab.poses[node]["position"][2] - 0.5 * parts[name]["dimensions"][2] == pytest.approx(-height)


@pytest.mark.full
def test_what_touches_is_red_and_named(port: int) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(WALL,)))) as tab:
        tab.settle()
        (node,) = bodies(tab)
        assert bodies(tab)[node] != TOUCHING
        assert kin.clearance(UR5, UR5.q_home, [WALL]) > 0.0
        tab.set(label(UR5, 0), float(TOUCHING_AT))
        tab.wait(lambda: "touches wall, " in tab.html and " deep" in tab.html)
        tab.settle()
        assert "⊗ touched" in tab.html
        painted = [m for m in tab.log if m["type"] == "SceneNodeUpdateMessage" and m.get("name") == node]
        assert tuple(painted[-1]["updates"].get("color", ())) == TOUCHING


def test_names_of_obstacles_in_a_link_are_text_on_the_page(port: int) -> None:
    hostile = replace(WALL, name="<img src=x onerror=alert(1)>")
    q = np.array([np.radians(TOUCHING_AT), *UR5.q_home[1:]])
    with FakeBrowser(port, memory=opened(PageState("ur5", q, obstacles=(hostile,)))) as tab:
        tab.wait(lambda: "touches &lt;img src=x" in tab.html)
        assert "<img src=x" not in tab.html


@pytest.mark.full
def test_a_drag_of_the_target_avoids_the_wall_on_request(port: int) -> None:
    q = UR5.q_home.copy()
    q[0] = np.radians(150.0)
    state = PageState("ur5", q, obstacles=(WALL,))
    with FakeBrowser(port, memory=opened(state)) as tab:
        tab.settle()
        tab.set(AVOID, True)
        tab.settle()
        behind = kin.fk(UR5, q)
        behind[:3, 3] = 0.0, 0.75, 0.4
        tab.grab()
        tab.drag(behind)
        tab.settle()
        found = kin.solve_ik(UR5, behind, obstacles=[WALL], avoid_self_collision=True)
        assert found.status == "collision"
        assert "No collision-free posture found" in tab.html
        tab.release()


def gizmo_of_the_obstacle(tab):
    """The name and the owner of the gizmo that appears when the only obstacle is clicked."""
    tab.settle()
    (node,) = bodies(tab)
    tab.click(node)
    tab.wait(lambda: any("obstacle-gizmo" in name for name in tab.nodes))
    tab.settle()
    (gizmo,) = (name for name in tab.nodes if "obstacle-gizmo" in name)
    return gizmo, tab.nodes[gizmo]["owner"]


@pytest.mark.full
def test_obstacles_are_dragged_with_their_gizmo(port: int) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(WALL,)))) as tab:
        gizmo, owner = gizmo_of_the_obstacle(tab)
        tab.send("TransformControlsDragStartMessage", name=gizmo, owner=owner)
        place = {"position": (0.1, 0.9, 0.5), "wxyz": (1.0, 0.0, 0.0, 0.0)}
        tab.send("TransformControlsUpdateMessage", name=gizmo, owner=owner, **place)
        travel = re.compile("/obstacles-.*/travel")
        tab.wait(
            lambda: [m["props"]["text"] for name, m in tab.nodes.items() if travel.match(name)] == ["Δ 559 mm"]
        )
        tab.send("TransformControlsDragEndMessage", name=gizmo, owner=owner)
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz == (0.1, 0.9, 0.5))
        tab.wait(lambda: tab.script["undo"] == "Drag of an obstacle")


@pytest.mark.full
def test_a_drag_of_an_obstacle_is_one_step_however_long_it_rests(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pause of the usual length has passed as soon as the next event comes."""
    monkeypatch.setattr(events, "SHORT_PAUSE", 1e-6)
    places = [(0.1, 0.9, 0.5), (0.2, 0.9, 0.5), (0.3, 0.9, 0.5), (0.4, 0.9, 0.5)]
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(WALL,)))) as tab:
        gizmo, owner = gizmo_of_the_obstacle(tab)
        for drag in (places[:2], places[2:]):
            tab.send("TransformControlsDragStartMessage", name=gizmo, owner=owner)
            for xyz in drag:
                place = {"position": xyz, "wxyz": (1.0, 0.0, 0.0, 0.0)}
                tab.send("TransformControlsUpdateMessage", name=gizmo, owner=owner, **place)
                tab.settle(quiet=0.05)
            tab.send("TransformControlsDragEndMessage", name=gizmo, owner=owner)
            tab.wait(lambda xyz=drag[-1]: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz == xyz)
            tab.settle()
        for xyz in (places[1], WALL.xyz):
            tab.say("undo")
            tab.wait(lambda xyz=xyz: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz == xyz)


@pytest.mark.full
@pytest.mark.parametrize(
    ("key", "value"),
    [(("add", "torus"), None), (("choose",), 7), (("choose",), "x"), (("set", "colour"), "1"), (("set", "x"), 5)],
)
def test_messages_that_no_control_sends_change_nothing(port: int, key: tuple[object, ...], value: object) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(WALL,)))) as tab:
        tab.settle()
        say(tab, "choose", value=0)
        say(tab, *key, value=value)
        assert len(bodies(tab)) == 1
        assert "data-obstacles" not in tab.html or ObstaclesFeature.key in tab.html
        say(tab, "set", "x", value="10")
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz[0] == pytest.approx(0.01))


BELOW = "600 200 -60 180 0 -90"  # mm, degrees: the tool points down, below the plane of the base
POSTURES = [x.q for x in kin.solve_ik(UR5, read_pose("pose", BELOW, DEFAULT_UNITS, np.eye(4))[0]).solutions]


def bench(top: float) -> kin.Obstacle:
    """A table in front of the arm, with its top at this height (m)."""
    return kin.Obstacle("table", (0.6, 0.2, top), size=(0.6, 0.6, 0.7), name="bench")


def wait_for(tab: FakeBrowser, kind: str, words: str) -> None:
    """Until the status line shows a notice of this kind with these words."""

    def shown() -> bool:
        place = tab.html.find(f'data-status="{kind}"')
        return place >= 0 and words in tab.html[place : tab.html.index("</div>", place)]

    tab.wait(shown)


def reach(tab: FakeBrowser) -> None:
    """Type the target, and wait until the arm has arrived."""
    tab.say("target", ["pose", BELOW])
    wait_for(tab, "reached", "configurations for this pose")
    tab.settle(0.4)


@pytest.mark.full
def test_the_answer_is_about_the_present_choice_of_avoiding(port: int) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(bench(0.0),)))) as tab:
        tab.settle()
        reach(tab)
        wait_for(tab, "reached", "touches bench")
        tab.set(AVOID, True)
        wait_for(tab, "collision", "No collision-free posture found")
        tab.set(AVOID, False)
        wait_for(tab, "reached", "8 configurations for this pose.")


@pytest.mark.full
def test_a_table_that_is_raised_or_lowered_is_avoided_at_a_target_that_was_reached(port: int) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(bench(-0.1),)))) as tab:
        tab.settle()
        tab.set(AVOID, True)
        reach(tab)
        wait_for(tab, "reached", "4 others collide")
        say(tab, "choose", value=0)
        say(tab, "set", "z", value="0")
        wait_for(tab, "collision", "No collision-free posture found")
        say(tab, "set", "z", value="-300 mm")
        wait_for(tab, "reached", "2 others collide")
        tab.settle(0.4)
        tab.set(AVOID, False)
        wait_for(tab, "reached", "8 configurations for this pose.")


@pytest.mark.full
def test_an_arm_that_touches_moves_to_a_free_posture_only_when_that_is_switched_on(port: int) -> None:
    touching = next(q for q in POSTURES if kin.clearance(UR5, q, [bench(-0.1)]) < -0.01)
    before = PageState("ur5", touching, obstacles=(bench(-0.1),))
    saved = replace(before, view=ViewState(avoid=True))
    with FakeBrowser(port, memory=opened(saved)) as tab:
        tab.settle()
        tab.wait(lambda: "touches bench" in tab.html)
    with FakeBrowser(port, memory=opened(before)) as tab:
        tab.settle()
        tab.wait(lambda: "touches bench" in tab.html)
        tab.set(AVOID, True)
        wait_for(tab, "reached", "4 others collide")
        tab.wait(lambda: "touches bench" not in tab.html)
        tab.wait(lambda: kin.clearance(UR5, kept(tab).q, [bench(-0.1)]) > 0.0)
        assert kin.fk(UR5, kept(tab).q) == pytest.approx(kin.fk(UR5, touching), abs=1e-6)
        tab.say("undo")
        tab.wait(lambda: "touches bench" in tab.html)
