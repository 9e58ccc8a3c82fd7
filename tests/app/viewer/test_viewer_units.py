"""The visitor's choice of units: the whole page follows it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.panel.joints import label
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, decode, encode
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
SCARA, SRS = STORE.get("scara"), STORE.get("redundant7-craig")


@pytest.fixture(scope="module")
def server() -> ViewerServer:
    return ViewerServer(STORE, Settings(), Clouds())


@pytest.fixture(scope="module")
def port(server: ViewerServer) -> Iterator[int]:
    with serve_viewer(server) as served:
        yield served


def numbers(tab: FakeBrowser) -> list[float]:
    """x, y, z as shown in the readout."""
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


@pytest.mark.full
def test_a_sliding_joint_is_moved_in_the_unit_and_late_events_are_dropped(server: ViewerServer, port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(SCARA.name)
        name = label(SCARA, 2)
        tab.set("Lengths", "m")
        tab.wait(lambda: ">m</td>" in tab.html)
        tab.settle()
        T = tab.tool_pose()
        # 100 from the replaced slider is in millimetres; read as metres it would be clamped to the limit.
        *_, session = server.pages.values()
        session.post(("joint", SCARA.id, 2, Units(), 0), 100.0)
        tab.settle()
        assert np.array_equal(tab.tool_pose(), T)
        q = SCARA.q_home.copy()
        q[2] = 0.12345
        tab.set(name, 0.12345)
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(SCARA, q), atol=1e-9))


@pytest.mark.full
def test_the_displayed_answer_is_converted_to_the_new_units(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.choose(SRS.name)
        T = kin.fk(SRS, SRS.q_home)
        T[0, 3] += 2.0
        far = kin.solve_ik(SRS, T, q_seed=SRS.q_home).distance
        tab.grab()
        tab.drag(T)
        tab.release()
        tab.wait(lambda: f" by {1000 * far:.0f} mm" in tab.html)
        tab.set("Lengths", "m")
        tab.wait(lambda: f" by {far:.3f} m" in tab.html)
        T[0, 3] += 1.0
        tab.drag(T)
        tab.release()
        tab.wait(lambda: f" by {far + 1.0:.1f}" in tab.html)
        # A status without an answer stays the same.
        tab.set("Go to", "Home")
        tab.wait(lambda: 'data-status="hand"' in tab.html)
        tab.set("Lengths", "cm")
        tab.wait(lambda: ">cm</td>" in tab.html)
        tab.settle()
        assert 'data-status="hand"' in tab.html


@pytest.mark.full
def test_the_unit_is_stored_and_restored(port: int) -> None:
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


@pytest.mark.full
def test_an_unknown_unit_is_refused_by_name(port: int) -> None:
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lengths", "inch")
        tab.wait(lambda: "Invalid input" in tab.html)
        assert "one of mm, cm, m" in tab.html
        tab.wait(lambda: tab.value("Lengths") == "mm")
