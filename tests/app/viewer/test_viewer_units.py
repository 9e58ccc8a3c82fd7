"""The units a visitor reads and types: their arithmetic, and that a whole page follows them."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.panel.joints import label
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from app.viewer.units import DEGREES, LENGTHS, RADIANS, USUAL, Unit, Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
SCARA, SRS = STORE.get("scara"), STORE.get("redundant7-craig")
ALL = [Units(degrees, length) for degrees, length in itertools.product((True, False), LENGTHS)]
MM, CM, M = (Units(length=length).lengths for length in LENGTHS)


# The arithmetic


def test_a_fresh_page_is_in_degrees_and_millimetres() -> None:
    assert Units() == USUAL == Units(True, "mm")
    assert (USUAL.angles.name, USUAL.lengths.name) == ("°", "mm")


@pytest.mark.parametrize("digits", [0, 1, 2, 3])
def test_every_length_unit_resolves_the_same(digits: int) -> None:
    steps = [unit.step(digits) / unit.scale for unit in (MM, CM, M)]
    assert steps == pytest.approx([1e-3 * 10.0**-digits] * 3)


def test_angles_are_never_coarser_in_radians() -> None:
    for digits in (0, 1, 2):
        assert RADIANS.step(digits) <= math.radians(DEGREES.step(digits))


@pytest.mark.parametrize("units", ALL, ids=str)
@pytest.mark.parametrize("turning", [True, False])
def test_what_a_control_shows_is_read_back(units: Units, turning: bool) -> None:
    unit = units.of(turning)
    for value in (0.0, 0.123456, -2.5, 3.0):
        assert unit.read(unit.shown(value, 2)) == pytest.approx(value, abs=unit.step(2) / unit.scale)
        assert unit.shown(unit.read(unit.shown(value, 2)), 2) == unit.shown(value, 2)


@pytest.mark.parametrize(
    ("unit", "value", "text"),
    [
        (MM, 0.1234, "123.4 mm"),
        (CM, 0.1234, "12.34 cm"),
        (M, 0.1234, "0.1234 m"),
        (M, -1.5, "−1.5000 m"),
        (MM, -1e-9, "0.0 mm"),
        (M, -1e-9, "0.0000 m"),
        (DEGREES, -math.pi, "−180.0°"),
        (RADIANS, -math.pi, "−3.142 rad"),
    ],
)
def test_a_value_with_its_unit(unit: Unit, value: float, text: str) -> None:
    assert unit.text(value) == text


@pytest.mark.parametrize(
    ("units", "metres", "text"),
    [
        (Units(), 0.00001, "< 0.1 mm"),
        (Units(length="cm"), 0.00001, "< 0.01 cm"),
        (Units(length="m"), 0.00001, "< 0.0001 m"),
        (Units(), 0.00456, "4.6 mm"),
        (Units(length="cm"), 0.00456, "0.46 cm"),
        (Units(length="m"), 0.00456, "0.0046 m"),
        (Units(), 0.1234, "123 mm"),
        (Units(length="cm"), -0.1234, "12.3 cm"),
        (Units(length="m"), 0.1234, "0.123 m"),
        (Units(), 0.0, "0 mm"),
    ],
)
def test_small_lengths_are_not_rounded_to_nothing(units: Units, metres: float, text: str) -> None:
    assert units.distance(metres) == units.motion(False, metres) == text


def test_small_angles_are_not_rounded_to_nothing() -> None:
    assert USUAL.angle(math.radians(0.01)) == "< 0.1°"
    assert USUAL.angle(math.radians(-3.21)) == USUAL.motion(True, math.radians(3.21)) == "3.2°"
    assert Units(degrees=False).angle(1e-5) == "< 0.001 rad"
    assert Units(degrees=False).angle(-0.5) == "0.500 rad"
    assert USUAL.angle(0.0) == "0.0°"


def test_what_somebody_chose_is_told_without_zeros() -> None:
    assert [unit.brief(0.005) for unit in (MM, CM, M)] == ["5 mm", "0.5 cm", "0.005 m"]
    assert DEGREES.brief(math.radians(2.0)) == "2°"


@pytest.mark.parametrize(
    ("sentence", "units", "expected"),
    [
        ("Out of reach by 120.5 mm: too far.", Units(length="cm"), "Out of reach by 12.05 cm: too far."),
        ("Out of reach by 120.5 mm: too far.", Units(length="m"), "Out of reach by 0.1205 m: too far."),
        ("off by 1.2e-03 mm and -3.0°", Units(length="m"), "off by 1.2e-06 m and -3.0°"),
        ("off by 2.0 mm and -3.0°", Units(degrees=False), "off by 2.0 mm and -0.052 rad"),
        ("(412 mm from the shoulder)", Units(length="cm"), "(41.2 cm from the shoulder)"),
        ("8 of 12 branches, a mmm, 3 m", Units(False, "m"), "8 of 12 branches, a mmm, 3 m"),
    ],
)
def test_sentences_of_the_core_are_retold(sentence: str, units: Units, expected: str) -> None:
    assert units.retold(sentence) == expected
    assert USUAL.retold(sentence) == sentence


def test_nothing_of_an_answer_is_left_in_the_units_of_the_core() -> None:
    """Every kind of answer of every arm, retold: no millimetres, no degrees, and the sizes are the same."""
    rng = np.random.default_rng(2)
    seen = set()
    for robot in STORE.robots:
        for k in range(4):
            T = kin.fk(robot, robot.random_q(rng))
            T[:3, 3] *= 1.0 + 0.4 * k
            reason = kin.solve_ik(robot, T).reason
            retold = Units(False, "m").retold(reason)
            assert not re.search(r"°| mm\b", retold)
            seen.update(re.findall(r"°| mm\b", reason))
            told = [float(x) * 1e-3 for x in re.findall(r"([\d.]+(?:e-\d+)?) mm", reason)]
            assert [float(x) for x in re.findall(r"([\d.]+(?:e-\d+)?) m\b", retold)] == pytest.approx(told)
    assert seen == {"°", " mm"}


# The page


@pytest.fixture(scope="module")
def server() -> Iterator[ViewerServer]:
    kin.warm_up()
    made = ViewerServer(STORE, Settings(), Clouds())
    yield made
    made.stop()


@pytest.fixture(scope="module")
def port(server: ViewerServer) -> int:
    return server.start()


def numbers(tab: FakeBrowser) -> list[float]:
    """x, y, z as the readout shows them."""
    table = tab.html.split('aria-label="tool pose"', 1)[1].split("</tr>", 1)[0]
    return [float(x.replace("−", "-")) for x in re.findall(r">([−\d.]+)</span>", table)]


def test_changing_the_unit_changes_every_number_and_moves_nothing(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(SCARA.name)
        slide = label(SCARA, 2)
        T, d = tab.tool_pose(), float(SCARA.q_home[2])
        angle = tab.value(label(SCARA, 0))
        for units in (Units(length="cm"), Units(length="m"), Units()):
            unit = units.lengths
            tab.set("Lengths", units.length)
            tab.wait(lambda unit=unit: f">{unit.name}</td>" in tab.html)  # type: ignore[misc]
            tab.settle()
            assert numbers(tab) == pytest.approx((unit.scale * T[:3, 3]).tolist(), abs=0.51 * unit.step(1))
            assert tab.value(slide) == unit.shown(d, 2)
            assert tab.gui[tab.element(slide)]["props"]["step"] == unit.step(2)
            assert tab.value(label(SCARA, 0)) == angle
            assert np.array_equal(tab.tool_pose(), T)
            assert tab.value("Lengths") == units.length


def test_a_sliding_joint_is_moved_in_the_unit_and_late_events_are_dropped(server: ViewerServer, port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(SCARA.name)
        name = label(SCARA, 2)
        tab.set("Lengths", "m")
        tab.wait(lambda: ">m</td>" in tab.html)
        tab.settle()
        T = tab.tool_pose()
        # 100 of the slider that is gone were millimetres; as metres they would mean the stop.
        *_, session = server._sessions.values()
        session.post(("joint", SCARA.id, 2, Units()), 100.0)
        tab.settle()
        assert np.array_equal(tab.tool_pose(), T)
        q = SCARA.q_home.copy()
        q[2] = 0.12345
        tab.set(name, 0.12345)
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(SCARA, q), atol=1e-9))


def test_an_answer_on_show_is_told_again_in_the_new_units(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(SRS.name)
        T = kin.fk(SRS, SRS.q_home)
        T[0, 3] += 2.0
        far = kin.solve_ik(SRS, T, q_seed=SRS.q_home).distance
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: f"Out of reach by {1000 * far:.0f} mm" in tab.html)
        tab.set("Lengths", "m")
        tab.wait(lambda: f"Out of reach by {far:.3f} m" in tab.html)
        T[0, 3] += 1.0
        tab.drag(T)
        tab.release()
        tab.wait(lambda: f"Out of reach by {far + 1.0:.1f}" in tab.html)
        # What is no answer stays as it was told.
        tab.set("Go to", "Home")
        tab.wait(lambda: 'data-status="hand"' in tab.html)
        tab.set("Lengths", "cm")
        tab.wait(lambda: ">cm</td>" in tab.html)
        tab.settle()
        assert 'data-status="hand"' in tab.html


def test_the_unit_is_remembered_and_restored(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lengths", "cm")
        tab.set("Radians", True)
        tab.wait(lambda: any(decode(text, STORE.robots).units == Units(False, "cm") for text in tab.kept))
    state = encode(PageState(robot="scara", units=Units(False, "cm")))
    with FakeBrowser(port, memory=json.dumps({"address": "", "state": state})) as tab:
        tab.settle()
        assert tab.value("Lengths") == "cm"
        assert tab.value("Radians") is True
        assert ">cm</td>" in tab.html
        assert tab.value(label(SCARA, 2)) == pytest.approx(100 * SCARA.q_home[2])


def test_a_unit_that_there_is_not_is_refused_by_name(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lengths", "inch")
        tab.wait(lambda: "Not understood" in tab.html)
        assert "one of mm, cm, m" in tab.html
        tab.wait(lambda: tab.value("Lengths") == "mm")
