"""Links that touch each other are red and named, and the drag avoids them on request."""

from __future__ import annotations

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.viewer.panel.joints import label
from app.viewer.scene.bodies.nodes import TOUCHING
from kin.collision.contacts import surroundings

UR5 = kin.get_robot("ur5")
FOLDED = 168.5  # degrees of the elbow: the wrist is in the upper arm
AVOID = "Avoid collisions"


def red(tab: FakeBrowser) -> set[str]:
    """The nodes of links that are painted."""
    return {
        name
        for name, m in tab.nodes.items()
        if m["type"] == "MeshMessage"
        and tuple(m["props"].get("color") or ()) == TOUCHING
        and "contact" not in name
    }


@pytest.mark.full
def test_links_that_touch_are_red_and_named(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose("UR5")
        tab.settle()
        assert not red(tab)
        tab.set(label(UR5, 2), FOLDED)
        tab.wait(lambda: "Link 4 touches link 2, " in tab.html)
        tab.settle()
        depths = {name.count("/") for name in red(tab)}
        folded = UR5.q_home.copy()
        folded[2] = np.radians(FOLDED)
        contacts = surroundings(UR5).touches(folded)
        assert len(depths) == len(
            {link for each in contacts for link in (each.link, each.other)}
        )  # links are nested
        before = len(tab.log)
        tab.set(label(UR5, 2), FOLDED + 0.5)
        tab.settle()
        painted = [
            m for m in tab.log[before:] if m["type"] == "SceneNodeUpdateMessage" and "color" in m["updates"]
        ]
        assert not painted  # the same ones still touch
        tab.set("Go to", "Home")
        tab.wait(lambda: "touches link" not in tab.html)
        tab.settle()
        assert not red(tab)


@pytest.mark.full
def test_dragging_avoids_self_collision_on_request(port: int) -> None:
    q = UR5.q_home.copy()
    q[2] = np.radians(FOLDED)
    T = kin.fk(UR5, q)
    with FakeBrowser(port) as tab:
        tab.choose("UR5")
        tab.settle()
        tab.set(AVOID, True)
        tab.set(label(UR5, 2), FOLDED - 20.0)
        tab.settle()
        tab.grab()
        tab.drag(T)
        tab.settle()
        shown = np.radians([tab.value(label(UR5, i)) for i in range(6)])
        result = kin.solve_ik(UR5, T, avoid_self_collision=True)
        if result.status == "solved":
            assert kin.clearance(UR5, shown) >= -1e-6
        else:
            assert "No collision-free posture found" in tab.html
        tab.release()
        tab.set(AVOID, False)
        tab.settle()
