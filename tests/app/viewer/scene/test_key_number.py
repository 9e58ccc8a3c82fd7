"""The key number: what is missing to the target, beside the target."""

from __future__ import annotations

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.viewer.panel.status import key_number, notice
from app.viewer.scene.gizmo import travel
from app.viewer.scene.key_number import place_beside
from kin.transforms import rotation_about
from kin.units import DEFAULT_UNITS, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

PIONEER, UR5 = kin.get_robot("pioneer5"), kin.get_robot("ur5")


def text(robot: kin.Robot, T: np.ndarray, units: Units = DEFAULT_UNITS) -> str:
    return key_number(kin.solve_ik(robot, T, q_seed=robot.q_home), units)


def test_each_kind_of_miss_has_its_number() -> None:
    home = kin.fk(UR5, UR5.q_home)
    assert text(UR5, home) == ""
    far = home.copy()
    far[:3, 3] *= 10.0
    assert text(UR5, far).endswith(" mm too far")
    assert text(UR5, far, Units(True, "m")).endswith(" m too far")
    tilted = kin.fk(PIONEER, PIONEER.q_home)
    tilted[:3, :2] = tilted[:3, 1::-1] * [1.0, -1.0]  # a quarter turn about the approach direction
    assert text(PIONEER, tilted).startswith("roll ")
    beyond = PIONEER.q_home.copy()
    beyond[0] = PIONEER.lower[0] - 0.5
    found = text(PIONEER, kin.fk(PIONEER, beyond))
    assert found.startswith("joint 1: limit ") or found.endswith(" off"), found


def test_the_number_is_the_distance_that_one_sees() -> None:
    """A point out of reach by little, whose orientation keeps the tool much farther away."""
    q = PIONEER.q_home.copy()
    q[0] = np.radians(144.0)
    T = kin.fk(PIONEER, q)
    T[:2, 3] += 0.18 * np.array([np.cos(q[0]), np.sin(q[0])])
    result = kin.solve_ik(PIONEER, T, q_seed=q, task="approach")
    assert result.closest is not None
    seen = float(np.linalg.norm(kin.fk(PIONEER, result.closest.q)[:3, 3] - T[:3, 3]))
    assert result.distance is not None
    assert seen > 5.0 * result.distance
    assert key_number(result, DEFAULT_UNITS).startswith(f"{DEFAULT_UNITS.distance(seen)} and ")
    assert f"is {DEFAULT_UNITS.distance(seen)} and" in notice(result, DEFAULT_UNITS).detail


def test_the_number_is_beside_a_missed_target_only(port: int) -> None:
    name = "/key-number"
    with FakeBrowser(port) as tab:
        tab.settle()
        assert tab.visible[name] is False
        T = kin.fk(PIONEER, PIONEER.q_home)
        T[:3, 3] *= 4.0
        tab.drag(T)
        tab.wait(lambda: tab.visible[name])
        assert "too far" in tab.nodes[name]["props"]["text"]
        assert np.linalg.norm(np.array(tab.poses[name]["position"]) - T[:3, 3]) < 0.3
        tab.set("Go to", "Home")
        tab.wait(lambda: not tab.visible[name])


@pytest.mark.parametrize("higher", [-0.3, -0.1, -0.01, 0.0, 0.01, 0.1, 0.3])
def test_the_words_at_a_contact_leave_room_for_the_number_above_a_missed_target(higher: float) -> None:
    radius, size, room = 0.8, 0.06, 0.1  # of a line of text in a picture of the whole arm (m)
    contact, target = np.array([0.0, 0.0, 0.2 + higher]), np.array([0.1, 0.0, 0.2])
    height, anchor = place_beside(contact, size, target, radius)
    number = target[2] + 0.16 * radius  # its lower edge
    edge = contact[2] + height
    assert edge <= target[2] if anchor == "top-center" else edge >= number + room
    assert place_beside(contact, size, None, radius) == (size, "bottom-center")


@pytest.mark.full
def test_labels_follow_the_size_of_the_text(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()

        def sizes() -> dict[str, float]:
            labels = {name: node["props"] for name, node in tab.nodes.items() if "Label" in node["type"]}
            return {name: props["font_screen_scale"] for name, props in labels.items()}

        before = sizes()
        assert len(before) > 5
        tab.say("text-size", "Projector")
        tab.wait(lambda: sizes()["/key-number"] == pytest.approx(1.7))
        assert sizes() == pytest.approx({name: 1.7 * size for name, size in before.items()})
        tab.choose(UR5.name)
        assert {round(size, 9) for size in sizes().values()} == {1.7, round(1.7 * 0.9, 9)}, (
            "also those of another arm"
        )
        tab.say("text-size", "Tiny")
        tab.wait(lambda: "Normal, Large, Projector" in tab.html)
        assert sizes()["/key-number"] == pytest.approx(1.7)


@pytest.mark.full
def test_how_far_the_target_is_dragged_stands_beside_it_until_it_is_released(port: int) -> None:
    home = kin.fk(UR5, UR5.q_home)
    moved = home.copy()
    moved[:3, 3] += [0.03, 0.0, -0.04]
    turned = moved.copy()
    turned[:3, :3] = rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(12.0)) @ home[:3, :3]
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(UR5.name)

        def label() -> str:
            return str(tab.nodes["/travel"]["props"]["text"]) if tab.visible.get("/travel") else ""

        assert label() == ""
        tab.grab()
        tab.drag(moved)
        tab.wait(lambda: label() == "Δ 50 mm")
        place = tab.local("/travel")[:3, 3]
        assert np.allclose(place[:2], moved[:2, 3])
        assert place[2] < moved[2, 3]
        tab.drag(turned)
        tab.wait(lambda: label() == "Δ 50 mm · 12.0°")
        tab.release()
        tab.wait(lambda: label() == "")
        tab.grab()
        tab.drag(turned)
        tab.choose(PIONEER.name)
        tab.wait(lambda: label() == "")


def test_a_turn_alone_is_said_without_a_length() -> None:
    T = np.eye(4)
    T[:3, :3] = rotation_about(np.array([1.0, 0.0, 0.0]), 0.5)
    assert travel(np.eye(4), T, Units(False, "m")) == "Δ 0.500 rad"
    assert travel(np.eye(4), np.eye(4), DEFAULT_UNITS) == "Δ 0 mm"
    T[0, 3] = -0.0042
    assert travel(np.eye(4), T, DEFAULT_UNITS) == "Δ 4.2 mm · 28.6°"
