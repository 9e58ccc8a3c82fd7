"""Obstacles in a visitor's page: added, touched, dragged, typed, taken back, shared, avoided."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.obstacles.feature import ObstaclesFeature
from app.viewer.panel.joints import label
from app.viewer.scene.bodies.nodes import TOUCHING
from app.viewer.session.state import PageState, decode, encode

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

ROBOTS = Store().robots
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
    tab.wait(lambda: bool(tab.kept))
    return decode(tab.kept[-1], ROBOTS)


def bodies(tab: FakeBrowser) -> dict[str, tuple[int, ...]]:
    """Nodes of obstacles, and their colours."""
    return {
        name: tuple(m["props"]["color"])
        for name, m in tab.nodes.items()
        if name.startswith("/obstacle-") and "color" in m["props"] and "gizmo" not in name
    }


def test_a_table_is_added_typed_and_taken_back(port: int) -> None:
    with FakeBrowser(port, memory=opened(UR5_ALONE)) as tab:
        tab.settle()
        say(tab, "add", "table")
        assert "Added: table" in tab.html
        assert len(bodies(tab)) == 2
        assert any("obstacle-gizmo" in name for name in tab.nodes)
        say(tab, "set", "z", value="0.35 m")
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz[2] == 0.35)
        say(tab, "set", "width", value="-5")
        assert "valid: 0.1 mm to 100 m" in tab.html
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
        assert len(bodies(tab)) == 2


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


def test_obstacles_are_dragged_with_their_gizmo(port: int) -> None:
    with FakeBrowser(port, memory=opened(PageState("ur5", obstacles=(WALL,)))) as tab:
        tab.settle()
        (node,) = bodies(tab)
        tab.click(node)
        tab.wait(lambda: any("obstacle-gizmo" in name for name in tab.nodes))
        tab.settle()
        (gizmo,) = (name for name in tab.nodes if "obstacle-gizmo" in name)
        owner = tab.nodes[gizmo]["owner"]
        tab.send("TransformControlsDragStartMessage", name=gizmo, owner=owner)
        place = {"position": (0.1, 0.9, 0.5), "wxyz": (1.0, 0.0, 0.0, 0.0)}
        tab.send("TransformControlsUpdateMessage", name=gizmo, owner=owner, **place)
        tab.send("TransformControlsDragEndMessage", name=gizmo, owner=owner)
        tab.wait(lambda: bool(kept(tab).obstacles) and kept(tab).obstacles[0].xyz == (0.1, 0.9, 0.5))
        assert tab.script["undo"] == "Drag of an obstacle"


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
