"""Padlocks of joints, and a gizmo that offers what the arm can follow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arms import CLASSICS
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.panel.joints import LOCKED, UNLOCK_ALL, label, lock_buttons
from app.viewer.scene.gizmo_axes import gizmo_axes
from kin.transforms import wxyz_from_rotation

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, SRS, SCARA = (STORE.get(name) for name in ("pioneer5", "redundant7-craig", "scara"))


def options(tab: FakeBrowser) -> tuple[str, ...]:
    return tuple(tab.gui[tab.element("Locked")]["props"]["options"])


def joint(tab: FakeBrowser, robot: kin.Robot, index: int) -> float:
    return float(tab.value(label(robot, index)))


def test_the_buttons_tell_what_is_locked() -> None:
    assert lock_buttons([False, False]) == ("1", "2")
    assert lock_buttons([False, True]) == ("1", f"{LOCKED}2", UNLOCK_ALL)


@pytest.mark.full
def test_a_locked_joint_stays_while_the_target_is_dragged_and_moves_by_hand(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        tab.set("Locked", "3")
        tab.wait(lambda: f"{LOCKED}3" in options(tab))
        assert "Joint 3 locked" in tab.html
        kept = joint(tab, SRS, 2)
        T = kin.fk(SRS, SRS.q_home)
        tab.grab()
        for _ in range(8):
            T[:3, 3] += (-0.01, 0.012, -0.006)
            tab.drag(T)
        tab.release()
        tab.settle()
        assert 'data-status="reached"' in tab.html
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        assert joint(tab, SRS, 2) == kept
        others = [joint(tab, SRS, i) for i in (0, 1, 3)]
        assert np.abs(np.subtract(others, np.degrees(SRS.q_home[[0, 1, 3]]))).max() > 1
        tab.set("Joint 3", 12.5)
        tab.settle()
        T = tab.tool_pose()
        T[:3, 3] += (0.0, 0.01, 0.01)
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.settle()
        assert joint(tab, SRS, 2) == 12.5
        assert f"{LOCKED}3" in options(tab)


@pytest.mark.full
def test_unlocking_frees_the_joint_and_another_arm_has_no_locks(port: int) -> None:
    T = kin.fk(SRS, SRS.q_home)
    T[:3, 3] += (0.0, 0.15, 0.0)
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        for number in "124":
            tab.set("Locked", number)
            tab.settle(0.1)
        assert options(tab)[-1] == UNLOCK_ALL
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.settle()
        assert 'data-status="reached"' not in tab.html
        tab.set("Locked", UNLOCK_ALL)
        tab.settle()
        assert options(tab) == tuple("1234567")
        assert 'data-status="reached"' in tab.html, "the waiting target is answered anew"
        assert np.allclose(tab.tool_pose(), T, atol=1e-6)
        tab.set("Locked", "5")
        tab.settle(0.1)
        tab.choose(PIONEER.name)
        assert options(tab) == tuple("12345")


def test_a_locked_joint_leaves_no_self_motion(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        tab.wait(lambda: "Arm angle ψ" in {m["props"].get("label") for m in tab.gui.values()})
        tab.set("Locked", "3")
        tab.wait(lambda: "Arm angle ψ" not in {m["props"].get("label") for m in tab.gui.values()})
        tab.set("Locked", f"{LOCKED}3")
        tab.wait(lambda: "Arm angle ψ" in {m["props"].get("label") for m in tab.gui.values()})


def test_hostile_lock_events_are_ignored(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        for value in ("99", "0", "-1", "<b>1</b>", "", f"{LOCKED}99"):
            tab.set("Locked", value)
        tab.settle()
        assert options(tab) == tuple("12345")


def test_what_each_arm_can_follow() -> None:
    every, none = (True,) * 3, (False,) * 3
    for robot in CLASSICS:
        flat = robot.id.startswith("planar")
        assert gizmo_axes(robot, "pose").arrows == (True, True, not flat)
        assert gizmo_axes(robot, "position").rings == none
    assert gizmo_axes(PIONEER, "pose").rings == gizmo_axes(PIONEER, "approach").rings == (True, True, False)
    assert gizmo_axes(SCARA, "pose").rings == (False, False, True)
    assert gizmo_axes(SCARA, "approach").rings == none
    assert gizmo_axes(SRS, "pose").rings == every
    assert gizmo_axes(SRS, "approach").rings == (True, True, False)


def test_a_flat_arm_is_offered_its_plane() -> None:
    flat = kin.load_robot(
        'id = "flat"\nname = "Flat"\nsource = "test"\nconvention = "standard"\n'
        'units = { length = "m", angle = "deg" }\n'
        + "".join(f'[[rows]]\nname = "hinge {i}"\na = 0.3\n' for i in range(3))
    )
    assert gizmo_axes(flat, "pose") == ((True, True, False), (False, False, True))


def rings(tab: FakeBrowser) -> dict[str, str]:
    names = [n for n, m in tab.nodes.items() if m["type"] == "TransformControlsMessage" and "/ring-" in n]
    return {name.split("/ring-")[1][0]: name for name in names}


def test_rings_hang_on_the_gizmo_where_not_every_turn_is_gizmo_axes(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        assert sorted(rings(tab)) == ["x", "y"]
        assert tab.nodes[tab.gizmo]["props"]["disable_rotations"]
        tab.set("Target must match", "Point only")
        tab.wait(lambda: not rings(tab))
        tab.choose(SCARA.name)
        assert sorted(rings(tab)) == ["z"]
        tab.choose(SRS.name)
        assert not rings(tab)
        tab.set("Target must match", "Point + approach")
        tab.settle()
        assert sorted(rings(tab)) == ["x", "y"]


def test_dragging_a_ring_tilts_the_target_and_the_gizmo_follows_on_release(port: int) -> None:
    home = kin.fk(PIONEER, PIONEER.q_home)
    c, s = math.cos(0.1), math.sin(0.1)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    with FakeBrowser(port) as tab:
        tab.set("Target must match", "Point + approach")
        tab.settle()
        ring = rings(tab)["x"]
        owner = tab.nodes[ring]["owner"]
        wxyz = wxyz_from_rotation(turn).tolist()
        tab.send("TransformControlsDragStartMessage", name=ring, owner=owner)
        tab.send("TransformControlsUpdateMessage", name=ring, position=(0, 0, 0), wxyz=wxyz, owner=owner)
        tab.wait(lambda: 'data-status="reached"' in tab.html)
        tab.settle(0.2)
        wanted = home[:3, :3] @ turn
        assert np.allclose(tab.tool_pose()[:3, 2], wanted[:, 2], atol=1e-6)
        assert np.allclose(tab.gizmo_pose(), home, atol=1e-6), "the gizmo waits until the ring is let go"
        tab.send("TransformControlsDragEndMessage", name=ring, owner=owner)
        tab.settle()
        assert np.allclose(tab.gizmo_pose()[:3, 2], wanted[:, 2], atol=1e-6)
        assert np.allclose(tab.local(ring), np.eye(4), atol=1e-6)
