"""The key number: what is missing to the target, beside the target."""

from __future__ import annotations

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.viewer.panel.status import key_number, notice
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
