"""Typed joint values and targets, keys that move the target, and a gizmo along other axes or in steps."""

from __future__ import annotations

import html
import json
import math

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.store import Store
from app.viewer.panel.joints import label
from app.viewer.scene.gizmo import STEP, TURN, snapped
from app.viewer.scene.gizmo_axes import gizmo_axes
from kin.transforms import rotation_about

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
PIONEER, UR5, SCARA, SRS = (STORE.get(name) for name in ("pioneer5", "ur5", "scara", "redundant7-craig"))
HOME = kin.fk(UR5, UR5.q_home)


def arrives(tab: FakeBrowser, T: np.ndarray, atol: float = 1e-6) -> None:
    tab.wait(lambda: np.allclose(tab.tool_pose(), T, atol=atol))
    tab.settle()
    assert np.allclose(tab.tool_pose(), T, atol=atol)


def fields(tab: FakeBrowser) -> dict[str, dict[str, object]]:
    """What the page knows of the fields beside sliders, by the slider's label."""
    found: dict[str, dict[str, object]] = {}
    for message in tab.gui.values():
        content = message["props"].get("content", "")
        if "data-fields" in content:
            text = html.unescape(content.split('data-fields="', 1)[1].split('"', 1)[0])
            for uuid, field in json.loads(text).items():
                found[tab.gui[uuid]["props"]["label"]] = field
    return found


@pytest.mark.full
def test_a_typed_joint_value_keeps_its_digits(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        elbow = label(PIONEER, 1)
        number = tab.say("field", [tab.element(elbow), "45.678"])
        q = PIONEER.q_home.copy()
        q[1] = math.radians(45.678)
        arrives(tab, kin.fk(PIONEER, q), 1e-12)
        assert tab.value(elbow) == 45.678
        tab.set(label(PIONEER, 0), 12)
        tab.settle()
        assert tab.value(elbow) == 45.678, "another joint's motion does not round it"
        assert tab.script["reply"] == [number, "", []]


def test_a_value_typed_into_a_field_that_was_replaced_counts_for_the_same_joint(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        elbow, third = (tab.element(label(PIONEER, i)) for i in (1, 2))
        tab.set("Radians", True)
        tab.wait(lambda: tab.element(label(PIONEER, 1)) != elbow)
        tab.say("field", [elbow, "45"])
        q = PIONEER.q_home.copy()
        q[1] = math.radians(45)  # it was typed into a field in degrees
        arrives(tab, kin.fk(PIONEER, q), 1e-12)
        tab.choose(SCARA.name)
        number = tab.say("field", [third, "45"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert tab.script["reply"][1] == f"Joint 3 was not changed. The {SCARA.name} has no such joint."
        arrives(tab, kin.fk(SCARA, SCARA.q_home))


@pytest.mark.full
@pytest.mark.parametrize("text", ["abc", "NaN", "  ", "200", "-5", "1e999"])
def test_an_invalid_joint_value_is_named_and_moves_nothing(port: int, text: str) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        elbow = label(PIONEER, 1)
        number = tab.say("field", [tab.element(elbow), text])
        tab.wait(lambda: tab.script["reply"][0] == number)
        tab.settle()
        assert "Joint 2 was not changed" in tab.html
        assert "Valid: 0 … 150°" in tab.script["reply"][1]
        assert tab.value(elbow) == 30
        assert np.allclose(tab.tool_pose(), kin.fk(PIONEER, PIONEER.q_home), atol=1e-9)
        tab.wait(lambda: tab.script["undo"] == "")


def test_every_field_has_its_unit_and_steps(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SCARA.name)
        assert set(fields(tab)) >= set(tab.sliders_in("Joints"))
        assert fields(tab)[label(SCARA, 0)] == {"unit": "°", "step": 1.0, "fine": 0.1, "page": 10.0}
        assert fields(tab)[label(SCARA, 2)] == {"unit": "mm", "step": 1.0, "fine": 0.1, "page": 10.0}
        tab.set("Radians", True)
        tab.set("Lengths", "m")
        tab.wait(lambda: fields(tab)[label(SCARA, 2)]["unit"] == "m")
        tab.settle()
        assert fields(tab)[label(SCARA, 0)] == {"unit": "rad", "step": 0.01, "fine": 0.001, "page": 0.1}
        assert fields(tab)[label(SCARA, 2)] == {"unit": "m", "step": 0.001, "fine": 0.0001, "page": 0.01}


def test_a_typed_redundancy_parameter_holds_the_tool(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SRS.name)
        (name,) = tab.sliders_in("Posture and redundancy")
        assert fields(tab)[name]["unit"] == "°"
        T = tab.tool_pose()
        tab.say("field", [tab.element(name), "20"])
        tab.wait(lambda: tab.value(name) == 20)
        arrives(tab, T)
        number = tab.say("field", [tab.element(name), "abc"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert "“abc” is not a number" in tab.script["reply"][1]


def test_a_target_is_pasted_as_it_stands_on_a_pendant(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        T = HOME.copy()
        T[:3, 3] += (0.02, -0.03, 0.01)
        tab.say("target", ["pose", kin.pose_to_text(T, "polyscope")])  # Stäubli and others have RX RY RZ as well
        arrives(tab, T, 3e-6)
        number = tab.say("target", ["pose", "X 400 Y 100 Z 300 A 10 B 20 C 30"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert "KUKA, Doosan or Mitsubishi" in tab.script["reply"][1]
        assert [label for label, _ in tab.script["reply"][2]] == ["KUKA", "Doosan", "Mitsubishi"]
        number = tab.say("target", ["pose", "400.25 100.5 300.125 0 3.1416 0"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert [label for label, _ in tab.script["reply"][2]] == [
            *("roll pitch yaw, in rad", "roll pitch yaw, in °", "UR (pendant)")
        ]
        tab.say("target", ["pose", tab.script["reply"][2][2][1]])
        down = np.diag([-1.0, 1.0, -1.0, 1.0])
        down[:3, 3] = 0.40025, 0.1005, 0.300125
        arrives(tab, down, 1e-5)


def test_a_typed_target_is_solved_like_a_dragged_one(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        T = HOME.copy()
        T[:3, 3] += (0.02, -0.03, 0.01)
        tab.say("target", ["position", " ".join(f"{1000 * v:.6f}" for v in T[:3, 3])])
        arrives(tab, T)
        assert 'data-status="reached"' in tab.html
        T[:3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), 0.2) @ T[:3, :3]
        tab.say("target", ["pose", str(np.round(T, 9).tolist()) + " m"])
        arrives(tab, T)
        number = tab.say("target", ["pose", "1 2 3 4"])
        tab.wait(lambda: tab.script["reply"][0] == number)
        assert "Found 4" in tab.script["reply"][1]
        arrives(tab, T)
        tab.say("target", ["position", "3000 0 300"])
        tab.wait(lambda: 'data-status="unreachable"' in tab.html)


@pytest.mark.full
def test_a_point_alone_sets_the_task_and_a_pose_sets_it_back(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        x, y, z = 1000 * HOME[:3, 3] + (30, 20, -10)
        tab.say("target", ["pose", f"{x} {y} {z}"])
        tab.wait(lambda: tab.value("Target must match") == "Point only")
        tab.wait(lambda: np.allclose(1000 * tab.tool_pose()[:3, 3], (x, y, z), atol=1e-3))
        tab.settle()
        tab.say("target", ["position", f"{x} {y} {z + 5}"])
        tab.wait(lambda: np.allclose(1000 * tab.tool_pose()[:3, 3], (x, y, z + 5), atol=1e-3))
        assert tab.value("Target must match") == "Point only"
        tab.settle()
        tab.say("target", ["pose", str(HOME.tolist()) + " m"])
        arrives(tab, HOME)
        assert tab.value("Target must match") == "Full pose"


def test_a_point_and_a_direction_set_the_task_to_both(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        x, y, z = 1000 * HOME[:3, 3] + (30, 20, -10)
        tab.say("target", ["pose", f"{x} {y} {z} along 0 0.6 -0.8"])
        tab.wait(lambda: tab.value("Target must match") == "Point + approach")
        tab.wait(lambda: np.allclose(1000 * tab.tool_pose()[:3, 3], (x, y, z), atol=1e-3))
        tab.settle()  # on its way, the point may be right before the direction is
        assert np.allclose(tab.tool_pose()[:3, 2], (0.0, 0.6, -0.8), atol=1e-6)


@pytest.mark.full
def test_keys_move_the_target_along_tool_and_base_axes(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        for _ in range(3):
            tab.say("nudge", [2, False, 1, False])
        T = HOME.copy()
        T[:3, 3] += 0.03 * HOME[:3, 2]
        arrives(tab, T)
        tab.say("nudge", [0, True, -1, True])
        T[:3, :3] = T[:3, :3] @ rotation_about(np.array([1.0, 0.0, 0.0]), -math.radians(1.0))
        arrives(tab, T)
        tab.say("axes")
        tab.wait(lambda: tab.value("Arrows along") == "Base axes")
        tab.settle()
        tab.say("nudge", [1, False, -1, True])
        T[1, 3] -= 0.001
        arrives(tab, T)
        gizmo = np.eye(4)
        gizmo[:3, 3] = T[:3, 3]
        assert np.allclose(tab.gizmo_pose(), gizmo, atol=1e-6)


@pytest.mark.full
def test_jog_moves_the_tool_along_its_own_axes_and_those_of_the_base(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        tab.say("jog", ["tool", 2, 1, 10])
        T = HOME.copy()
        T[:3, 3] += 0.01 * HOME[:3, 2]
        arrives(tab, T)
        tab.say("jog", ["base", 0, -1, 5])
        T[0, 3] -= 0.005
        arrives(tab, T)
        tab.say("jog", ["tool", 3, 1, 1])
        T[:3, :3] = T[:3, :3] @ rotation_about(np.array([1.0, 0.0, 0.0]), math.radians(1.0))
        arrives(tab, T)
        tab.say("jog", ["base", 5, 1, 10])
        T[:3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), math.radians(10.0)) @ T[:3, :3]
        arrives(tab, T)


@pytest.mark.full
def test_jog_moves_a_joint_as_far_as_its_limit(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(SCARA.name)
        q = SCARA.q_home.copy()
        for joint, step in ((0, math.radians(5.0)), (2, 0.005)):
            tab.say("jog", ["joints", joint, 1, 5])
            q[joint] += step
            arrives(tab, kin.fk(SCARA, q))
        for _ in range(80):
            tab.say("jog", ["joints", 2, 1, 10])
        q[2] = SCARA.upper[2]
        arrives(tab, kin.fk(SCARA, q))
        assert "The joint is at its limit" in tab.html


def test_a_target_that_is_jogged_out_of_reach_waits_beside_the_tool(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        for _ in range(120):  # 1200 mm; the arm is stretched before
            tab.say("jog", ["base", 2, 1, 10])
        tab.wait(lambda: "No further in this direction" in tab.html)
        tab.settle()
        assert 0.009 < np.linalg.norm(tab.gizmo_pose()[:3, 3] - tab.tool_pose()[:3, 3]) < 0.02
        highest = tab.tool_pose()[2, 3]
        for _ in range(3):
            tab.say("jog", ["base", 2, -1, 10])
        tab.wait(lambda: tab.tool_pose()[2, 3] < highest - 0.009)


@pytest.mark.full
@pytest.mark.parametrize(
    "value",
    [
        None,
        ["tool", 6, 1, 5],
        ["tool", 0, 0, 5],
        ["world", 0, 1, 5],
        ["joints", 6, 1, 5],
        ["joints", -1, 1, 5],
        ["tool", 0, 1, 7],
    ],
)
def test_a_jog_that_no_button_sends_changes_nothing(port: int, value: object) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        tab.say("jog", value)
        tab.say("jog", ["base", 0, 1, 1])
        T = HOME.copy()
        T[0, 3] += 0.001
        arrives(tab, T)


@pytest.mark.full
def test_a_gizmo_along_the_base_turns_the_target_about_the_base(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        tab.set("Arrows along", "Base axes")
        tab.settle()
        assert np.allclose(tab.gizmo_pose()[:3, :3], np.eye(3), atol=1e-12)
        turn = rotation_about(np.array([0.0, 0.0, 1.0]), 0.3)
        gizmo = tab.gizmo_pose()
        gizmo[:3, :3] = turn
        gizmo[0, 3] += 0.02
        tab.grab()
        tab.drag(gizmo)
        T = HOME.copy()
        T[:3, :3] = turn @ T[:3, :3]
        T[0, 3] += 0.02
        arrives(tab, T)
        tab.release()
        tab.settle()
        arrives(tab, T)
        assert np.allclose(tab.gizmo_pose()[:3, :3], np.eye(3), atol=1e-9), "aligned with the base again"
        tab.choose(PIONEER.name)
        assert np.allclose(tab.gizmo_pose()[:3, :3], np.eye(3), atol=1e-12), "for every robot"


@pytest.mark.full
def test_with_shift_the_gizmo_moves_in_steps(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.choose(UR5.name)
        tab.say("snap", True)
        tab.grab()
        T = HOME.copy()
        T[:3, 3] += 0.0274 * HOME[:3, 0]
        tab.drag(T)
        wanted = HOME.copy()
        wanted[:3, 3] += 0.03 * HOME[:3, 0]
        arrives(tab, wanted)
        tab.release()
        tab.settle()
        assert np.allclose(tab.gizmo_pose(), wanted, atol=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.02, 0.08, 1.0, -2.0, 3.1])
def test_steps_are_whole_multiples(angle: float) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    T = HOME.copy()
    T[:3, :3] = rotation_about(axis, angle) @ T[:3, :3]
    T[:3, 3] += HOME[:3, :3] @ (0.0149, -0.026, 0.004)
    S = snapped(T, HOME, HOME[:3, :3])
    moved = HOME[:3, :3].T @ (S[:3, 3] - HOME[:3, 3])
    assert np.allclose(moved / STEP, (1, -3, 0), atol=1e-9)
    expected = rotation_about(axis, round(angle / TURN) * TURN)
    assert np.allclose(S[:3, :3] @ HOME[:3, :3].T, expected, atol=1e-9)


def test_base_axes_offer_what_the_arm_can_follow() -> None:
    three = (True, True, True)
    assert gizmo_axes(UR5, "pose", in_base=True) == (three, three)
    assert gizmo_axes(SCARA, "pose", in_base=True) == (three, (False, False, True))
    assert gizmo_axes(PIONEER, "pose", in_base=True) == (three, three)
    assert gizmo_axes(PIONEER, "position", in_base=True) == (three, (False, False, False))
