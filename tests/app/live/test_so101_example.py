"""`examples/so101_arm.py` with a bus on a pseudo-terminal: mirror, drive, broken packets, what can be lost.

What stops a driven arm, and where it may go, is in `test_driving.py`, without waiting for time to pass.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from pathlib import Path

import driving
import numpy as np
import pytest
import so101_arm
from example_run import ExampleRun
from feetech_bus import GOAL, TORQUE, FeetechBus, packet

import kin
from app.live.client.connection import Connection

ARM = kin.get_robot("so101")
NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
RANGES = ((740, 3331), (880, 3280), (910, 3110), (930, 3240), (250, 3900), (2020, 3500))
TICKS = (2000.0, 1700.0, 2500.0, 2200.0, 2075.0, 2500.0)
SPEED = 30.0  # deg/s
TURN = 360.0 / 4096.0  # deg of a tick


def degrees(ticks: dict[int, float]) -> np.ndarray:
    """Joint values by hand: LeRobot's degrees begin in the middle of the calibrated range."""
    return np.array([(ticks[i] - 0.5 * sum(RANGES[i - 1])) * TURN for i in range(1, 6)])


@pytest.fixture
def bus(monkeypatch) -> Iterator[FeetechBus]:
    # Half of the ms that a servo may take to answer: on a busy machine this one's thread may wait.
    monkeypatch.setattr("scservo_sdk.port_handler.LATENCY_TIMER", 150)
    with FeetechBus(dict(enumerate(TICKS, 1))) as bus:
        yield bus


@pytest.fixture
def calibration(tmp_path) -> Path:
    table = {
        name: {"id": i, "drive_mode": 0, "homing_offset": 0, "range_min": low, "range_max": high}
        for i, (name, (low, high)) in enumerate(zip(NAMES, RANGES, strict=True), 1)
    }
    file = tmp_path / "my_arm.json"
    file.write_text(json.dumps(table))
    return file


@pytest.fixture
def run(viewer, page, bus, calibration):
    runs = []
    page.choose(ARM.name)

    def started(*words) -> ExampleRun:
        runs.append(
            ExampleRun(so101_arm.main, viewer, page, ["--port", bus.port, "--calibration", calibration, *words])
        )
        return runs[-1]

    yield started
    for each in runs:
        each.end(page)
    page.settle()


def measured(page) -> list[float]:
    """The values of the ghost, as the tab shows them (degrees)."""
    if "data-live-measured" not in page.html:
        return []
    rows = re.findall(
        r"<tr><th>([^<]+)</th>((?:<td[^>]*>[^<]*</td>)+)", page.html.split("data-live-measured", 1)[1]
    )
    cells = [re.findall(r"<td[^>]*>([^<]*)</td>", text) for _, text in rows[1 : ARM.n + 1]]
    return [float(row[0].replace("−", "-")) for row in cells]


def shows(page, bus) -> bool:
    ticks = {number: servo.position for number, servo in bus.servos.items()}
    found = measured(page)
    return len(found) == ARM.n and np.abs(np.array(found) - degrees(ticks)).max() < 0.15


def test_packets_are_those_of_the_manual():
    assert packet(1, 1).hex(" ") == "ff ff 01 02 01 fb"


@pytest.mark.full
def test_the_mirror_shows_the_encoders_and_writes_nothing(page, bus, run):
    run()
    page.wait(lambda: shows(page, bus))
    bus.servos[2].position += 300.0
    page.wait(lambda: shows(page, bus))
    assert bus.written == []
    assert bus.refused == []


@pytest.mark.full
def test_match_motors_takes_what_the_servos_read(page, bus, run):
    run()
    page.wait(lambda: shows(page, bus))
    page.set("All motors", "Match motors")
    page.wait(lambda: 'data-motors-pose="1"' in page.html)
    page.wait(lambda: "Read program" in str(page.gui[page.element("Poses")]["props"]))
    page.set("Poses", "Read program")
    page.wait(lambda: page.value("Readings") != "")
    found = [float(word) for word in page.value("Readings").split()]
    assert found == pytest.approx(degrees(dict(enumerate(TICKS, 1))) * 4096.0 / 4095.0, abs=1e-6)
    assert bus.written == []


@pytest.mark.full
def test_broken_packets_are_asked_for_again(page, bus, run, capsys):
    started = run()
    page.wait(lambda: shows(page, bus))
    for _ in range(6):  # each way of breaking, one at a time
        bus.broken = 1
        page.wait(lambda: bus.broken == 0)
    assert "hidden" not in capsys.readouterr().out
    bus.servos[3].position -= 200.0
    page.wait(lambda: shows(page, bus))
    bus.broken = 10_000  # more than are tried: nobody knows where the arm is
    page.wait(lambda: "data-live-measured" not in page.html)
    bus.broken = 0
    page.wait(lambda: shows(page, bus))
    assert started.alive
    assert bus.written == []


@pytest.mark.full
def test_a_servo_that_comes_and_goes_hides_the_ghost(page, bus, run, capsys):
    run()
    page.wait(lambda: shows(page, bus))
    bus.missing.add(4)
    page.wait(lambda: "data-live-measured" not in page.html)
    bus.missing.clear()
    page.wait(lambda: shows(page, bus))
    said = capsys.readouterr().out
    assert "motor 4 (wrist_flex) does not answer. The ghost is hidden meanwhile." in said
    assert "All servos answer again." in said


@pytest.mark.full
def test_a_driven_arm_starts_where_it_is_and_follows_slowly(page, bus, run, patient, capsys):
    started = run("--drive", "--yes", "--speed", SPEED)
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.wait(lambda: page.shown.get("driven", "").startswith("SO-101 at /dev/pts"))
    page.wait(lambda: all(servo.memory[TORQUE] for i, servo in bus.servos.items() if i < 6))
    assert not bus.servos[6].memory[TORQUE], "the gripper is no joint of the arm"
    first_goals = {i: values for _, i, address, values in reversed(bus.written) if address == GOAL}
    first_torque = min(t for t, _, address, _ in bus.written if address == TORQUE)
    assert min(t for t, _, address, _ in bus.written if address == GOAL) < first_torque
    assert {i: int.from_bytes(values, "little") for i, values in first_goals.items()} == {
        i: TICKS[i - 1] for i in range(1, 6)
    }
    page.wait(lambda: shows(page, bus))
    before = degrees({number: servo.position for number, servo in bus.servos.items()})
    began = time.monotonic()
    page.set("1 shoulder pan", float(before[0] + 30.0))
    page.wait(lambda: abs(bus.servos[1].position - TICKS[0]) * TURN > 29.5)
    seconds = time.monotonic() - began
    goals = np.array(
        [int.from_bytes(v, "little") for t, i, a, v in bus.written if a == GOAL and i == 1 and t > began]
    )
    times = np.array([t for t, i, a, _ in bus.written if a == GOAL and i == 1 and t > began])
    moving = np.flatnonzero(np.diff(goals) > 0)
    assert seconds > 0.9
    steps = np.diff(goals)[moving] * TURN / np.diff(times)[moving]
    assert np.median(steps) < 2.0 * SPEED
    assert (goals[-1] - goals[0]) * TURN / (times[moving[-1] + 1] - times[moving[0]]) < 1.5 * SPEED
    assert abs(bus.servos[2].position - TICKS[1]) <= 2
    assert bus.refused == []
    started.end(page)
    assert all(servo.memory[TORQUE] for i, servo in bus.servos.items() if i < 6), "it would fall"


def on_its_way(page, bus, run, capsys, *words):
    """A run whose arm turns its base slowly."""
    started = run("--drive", "--yes", "--speed", 10, *words)
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.set("1 shoulder pan", 60.0)
    page.wait(lambda: bus.servos[1].position - TICKS[0] > 30)
    return started


def rests(bus) -> bool:
    before = bus.servos[1].position
    time.sleep(0.2)
    return bus.servos[1].position == before and before - TICKS[0] < 500


@pytest.mark.full
def test_a_page_that_leaves_stops_the_arm(page, bus, run, patient, capsys):
    started = on_its_way(page, bus, run, capsys)
    started.end(page)
    assert started.codes == [1]
    assert rests(bus)
    said = capsys.readouterr()
    assert "The arm holds its place: its motors stay on" in said.out
    assert "withdrawn" in said.err or "does not answer" in said.err


@pytest.mark.full
def test_a_page_that_is_silent_stops_the_arm(page, bus, run, patient, monkeypatch, capsys):
    """The connection stands, and nothing comes: the page is asked for signs of life."""
    started = on_its_way(page, bus, run, capsys)
    monkeypatch.setattr(driving, "PAGE_LOST", 0.5)
    monkeypatch.setattr(Connection, "_take", lambda *_: None)
    started.wait()
    assert "the page does not answer" in capsys.readouterr().err
    assert rests(bus)


@pytest.mark.full
def test_a_bus_that_is_unplugged_ends_the_program(page, bus, run, patient, capsys):
    started = on_its_way(page, bus, run, capsys)
    bus.unplug()
    started.wait()
    assert started.codes == [1]
    assert f"the bus at {bus.port} is gone" in capsys.readouterr().err


@pytest.mark.full
def test_without_a_yes_nothing_is_written(page, bus, run, monkeypatch, capsys):
    monkeypatch.setattr("builtins.input", lambda _: "y")
    started = run("--drive")
    started.wait()
    assert started.codes == [1]
    assert "not confirmed: the arm was not moved" in capsys.readouterr().err
    assert bus.written == []


def test_what_is_lacking_is_said(viewer, page, bus, tmp_path, capsys):
    page.choose(ARM.name)
    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    for words, said in (
        (["--port", bus.port], "has no calibrated range of motor 1 (shoulder_pan), motor 2"),
        (["--port", bus.port, "--calibration", wrong], "expected LeRobot's calibration"),
        (["--port", bus.port, "--calibration", tmp_path / "none.json"], "No such file or directory"),
    ):
        started = ExampleRun(so101_arm.main, viewer, page, words)
        started.wait()
        assert started.codes == [1]
        assert said in capsys.readouterr().err
        page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
        page.wait(lambda: "data-live-code" not in page.html)


def test_ports_that_cannot_be_opened_say_what_to_do():
    with pytest.raises(so101_arm.BusError, match=r"there is no port /dev/ttyACM77\. Ports of this machine: "):
        so101_arm.Bus("/dev/ttyACM77", [])
    denied = PermissionError(13, "could not open port /dev/ttyACM0: Permission denied")
    assert "sudo usermod -aG dialout $USER" in so101_arm.port_problem("/dev/ttyACM0", denied)
    busy = OSError(16, "Device or resource busy")
    assert "cannot be opened" in so101_arm.port_problem("/dev/ttyACM0", busy)
