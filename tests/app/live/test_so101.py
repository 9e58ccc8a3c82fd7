"""`kinboard so101` with a bus on a pseudo-terminal: mirror, drive, broken packets, what can be lost.

What stops a driven arm, and where it may go, is in `test_driving.py`, without waiting for time to pass.
"""

from __future__ import annotations

import json
import re
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import SimpleQueue
from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from example_run import ExampleRun
from fake_browser import FakeBrowser
from feetech_bus import FeetechBus
from live_server import ready, wait_for
from test_gripper_channel import beside

import kin
from app.cli.parser import main
from app.live.client.connection import Connection
from app.live.recording.table import GRIPPER, heads
from app.servos import command
from app.servos.bus import Bus
from app.servos.calibration import Calibration
from app.servos.ports import BusError, find_port, port_problem
from app.servos.registers import GOAL, TORQUE
from app.servos.simulated import packet
from kin.notebook import driving

ROOT = Path(__file__).parents[3]
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


def so101(words: Sequence[str]) -> int:
    """The command, with the code of a page."""
    return main(["so101", "--code", *words])


@pytest.fixture
def typed(monkeypatch) -> SimpleQueue[str]:
    """What the owner types."""
    lines: SimpleQueue[str] = SimpleQueue()
    monkeypatch.setattr(command, "typed", lambda: lines)
    return lines


@pytest.fixture
def run(viewer, page, bus, calibration, typed):
    runs = []
    page.choose(ARM.name)

    def started(*words) -> ExampleRun:
        runs.append(ExampleRun(so101, viewer, page, ["--port", bus.port, "--calibration", calibration, *words]))
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
    low, high = RANGES[5]
    bus.servos[6].position = low + 0.25 * (high - low)
    page.wait(lambda: beside(page)[:1] == ["25"])
    assert bus.written == []
    assert bus.refused == 0


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
def test_a_driven_arm_starts_where_it_is_and_follows_slowly(page, bus, run, typed, patient, capsys):
    typed.put("enable")
    started = run("--speed", SPEED)
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
    assert bus.refused == 0
    started.end(page)
    assert all(servo.memory[TORQUE] for i, servo in bus.servos.items() if i < 6), "it would fall"


def on_its_way(page, bus, run, typed, capsys):
    """A run whose arm turns its base slowly."""
    typed.put("enable")
    started = run("--speed", 10)
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.set("1 shoulder pan", 60.0)
    page.wait(lambda: bus.servos[1].position - TICKS[0] > 30)
    return started


def rests(bus) -> bool:
    before = bus.servos[1].position
    time.sleep(0.2)
    return bus.servos[1].position == before and before - TICKS[0] < 500


@pytest.mark.full
def test_a_page_that_leaves_stops_the_arm(page, bus, run, typed, patient, capsys):
    started = on_its_way(page, bus, run, typed, capsys)
    started.end(page)
    assert started.codes == [1]
    assert rests(bus)
    said = capsys.readouterr()
    assert "The arm holds its place: its motors stay on" in said.out
    assert "withdrawn" in said.err or "does not answer" in said.err


@pytest.mark.full
def test_a_page_that_is_silent_stops_the_arm(page, bus, run, typed, patient, monkeypatch, capsys):
    """The connection stands, and nothing comes: the page is asked for signs of life."""
    started = on_its_way(page, bus, run, typed, capsys)
    monkeypatch.setattr(driving, "PAGE_LOST", 0.5)
    monkeypatch.setattr(Connection, "_take", lambda *_: None)
    started.wait()
    assert "the page does not answer" in capsys.readouterr().err
    assert rests(bus)


@pytest.mark.full
def test_a_bus_that_is_unplugged_ends_the_program(page, bus, run, typed, patient, capsys):
    started = on_its_way(page, bus, run, typed, capsys)
    bus.unplug()
    started.wait()
    assert started.codes == [1]
    assert f"the bus at {bus.port} is gone" in capsys.readouterr().err


def test_what_is_lacking_is_said(viewer, page, bus, typed, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("HF_LEROBOT_CALIBRATION", str(tmp_path))
    page.choose(ARM.name)
    wrong = tmp_path / "wrong.json"
    wrong.write_text("{}")
    for words, said in (
        (["--port", bus.port], "has no calibrated range of motor 1 (shoulder_pan), motor 2"),
        (["--port", bus.port, "--calibration", wrong], "expected LeRobot's calibration"),
        (["--port", bus.port, "--calibration", tmp_path / "none.json"], "No such file or directory"),
    ):
        started = ExampleRun(so101, viewer, page, words)
        started.wait()
        assert started.codes == [1]
        assert said in capsys.readouterr().err
        page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
        page.wait(lambda: "data-live-code" not in page.html)


def test_ports_that_cannot_be_opened_say_what_to_do():
    with pytest.raises(BusError, match=r"there is no port /dev/ttyACM77\. Ports of this machine:"):
        Bus("/dev/ttyACM77")
    denied = PermissionError(13, "could not open port /dev/ttyACM0: Permission denied")
    assert "sudo usermod -aG dialout $USER" in port_problem("/dev/ttyACM0", denied)
    for busy in (OSError(16, "Device or resource busy"), OSError("could not open port 'COM3': Access is denied.")):
        assert "is in use by another program: close it" in port_problem("/dev/ttyACM0", busy)


def test_a_port_has_one_user(bus):
    first = Bus(bus.port)
    try:
        with pytest.raises(BusError, match="is in use by another program"):
            Bus(bus.port)
    finally:
        first.close()


def test_the_port_is_the_only_one_on_usb(capsys):
    def port(device: str, vid: int | None) -> SimpleNamespace:
        return SimpleNamespace(device=device, description=f"the thing at {device}", vid=vid)

    board, arm, other = port("/dev/ttyS0", None), port("/dev/ttyACM0", 0x1A86), port("/dev/ttyACM1", 0x1A86)
    assert find_port(lambda: [board, arm]) == "/dev/ttyACM0"
    assert "Serial port /dev/ttyACM0: the thing at /dev/ttyACM0." in capsys.readouterr().out
    with pytest.raises(BusError, match=r"there is no serial port on USB: .*--port sim"):
        find_port(lambda: [board])
    both = r"(?s)say which with --port:.*  /dev/ttyACM0: the thing at /dev/ttyACM0.*  /dev/ttyACM1"
    with pytest.raises(BusError, match=both):
        find_port(lambda: [other, arm])


def test_the_calibration_is_the_only_one_of_lerobots_folder(calibration, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("HF_LEROBOT_CALIBRATION", str(tmp_path))
    with pytest.raises(kin.KinematicsError, match=r"(?s)no calibrated range of .*lerobot-calibrate --robot"):
        Calibration(None, "/dev/ttyACM0").applied(ARM)
    folder = tmp_path / "robots" / "so101_follower"
    folder.mkdir(parents=True)
    (folder / "one.json").write_text(calibration.read_text())
    found = Calibration(None, "/dev/ttyACM0").applied(ARM)
    assert [motor.range for motor in found.motors] == list(RANGES)
    assert "one.json" in capsys.readouterr().out
    (folder / "two.json").write_text("{}")
    with pytest.raises(kin.KinematicsError, match=r"(?s)which of these\?.*one\.json.*two\.json"):
        Calibration(None, "/dev/ttyACM0")


DOCUMENTED = re.findall(
    r"^kinboard so101(.*)$", (ROOT / "docs/so101.md").read_text(encoding="utf-8"), re.MULTILINE
)


@pytest.mark.full
@pytest.mark.parametrize("words", DOCUMENTED)
def test_commands_of_the_page_run(viewer, page, bus, typed, calibration, tmp_path, monkeypatch, patient, words):
    """With the bus of the test on the only port, and a page that is open in place of one that would be opened."""
    page.choose(ARM.name)
    folder = tmp_path / "robots" / "so101_follower"
    folder.mkdir(parents=True)
    (folder / "mine.json").write_text(calibration.read_text())
    monkeypatch.setenv("HF_LEROBOT_CALIBRATION", str(tmp_path))
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    found = SimpleNamespace(device=bus.port, description="USB Single Serial", vid=0x1A86)
    monkeypatch.setattr(find_port, "__defaults__", (lambda: [found],))
    words = words.replace("/dev/ttyACM0", bus.port).replace("my_arm.json", str(calibration))
    given = re.sub(r"--(code|address) \S+", "", words).split()
    for word in ("enable", "gripper 40", "stop", "release", "quit"):
        typed.put(word)
    started = ExampleRun(so101, viewer, page, given)
    started.wait()
    assert started.codes == [0]
    assert "--port sim" in words or not any(servo.memory[TORQUE] for servo in bus.servos.values())
    page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
    page.settle()


@pytest.mark.full
def test_the_page_of_the_command_has_a_process_of_its_own(typed, monkeypatch, patient, capsys):
    """A lost browser stops the arm, and the service ends with the command."""
    opened: list[FakeBrowser] = []

    def show(url: str) -> bool:
        parts = urlsplit(url)
        memory = {"shown": parse_qs(parts.query)["shown"][0], "address": f"http://{parts.netloc}/"}
        memory["state"] = parse_qs(parts.fragment)["s"][0]
        wait_for(lambda: ready(memory["address"]), 120.0)
        opened.append(FakeBrowser(f"ws://127.0.0.1:{parts.port}/viewer", memory=json.dumps(memory)))
        typed.put("enable")
        threading.Thread(target=leave, daemon=True).start()
        return True

    def leave() -> None:
        page = opened[0]
        page.wait(lambda: page.shown.get("driven", "").startswith("SO-101 at sim"))
        page.close()

    monkeypatch.setattr(command.webbrowser, "open", show)
    assert main(["so101", "--port", "sim"]) == 1
    said = capsys.readouterr()
    assert "The arm holds its place" in said.out
    assert re.search("closed|does not answer|No page", said.err), said.err
    address = re.search(r"http://localhost:(\d+)/", said.out)
    assert address is not None
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", int(address[1])), 5.0)


@pytest.mark.full
def test_the_gripper_follows_slider_and_program(page, bus, run, typed, patient, capsys):
    """The page takes over where it is; then the slider leads it, a program that is played, and a recording."""
    low, high = RANGES[5]

    def opening() -> float:
        return (bus.servos[6].position - low) / (high - low)

    typed.put("enable")
    started = run("--speed", 60)
    page.wait(lambda: "The arm follows the page." in capsys.readouterr().out)
    page.wait(lambda: page.value("Gripper (%)") == round(100.0 * (TICKS[5] - low) / (high - low)))
    assert not bus.servos[6].memory[TORQUE], "it is switched on when the slider is moved"
    page.set("Gripper (%)", 80)
    page.wait(lambda: opening() == pytest.approx(0.8, abs=0.005))
    page.wait(lambda: beside(page) == ["80", "0", "%"])
    q = np.radians(measured(page)).tolist()
    rows = f"[[segments]]\nkind = 'ptp'\nq = {q}\n[[segments]]\nkind = 'gripper'\nopening = 0.3\nseconds = 1\n"
    for name, value in (("upload", ["grip.toml", rows]), ("play", None)):
        number = page.say("feature", ["program", [name, 1], value])
        page.wait(lambda number=number: page.script["reply"][0] >= number)
    page.wait(lambda: opening() == pytest.approx(0.3, abs=0.005))
    there, nothing = ",".join(map(repr, q)), "," * (ARM.n - 1)  # commanded, measured
    lines = [",".join([*heads(ARM), GRIPPER]), f"0.0,{there},{nothing},0.3", f"1.0,{there},{nothing},0.9"]
    page.open_file("connect", "run.csv", "\n".join(lines))
    page.wait(lambda: "run.csv is open" in page.html)
    page.send("GuiUpdateMessage", uuid=page.element("Play recording"), updates={"value": True})
    page.wait(lambda: opening() == pytest.approx(0.9, abs=0.005))
    assert bus.refused == 0
    started.end(page)


@pytest.mark.full
def test_the_simulated_arm_is_shown_and_driven(viewer, page, typed, patient, capsys):
    page.choose(ARM.name)
    typed.put("enable")
    started = ExampleRun(so101, viewer, page, ["--port", "sim", "--speed", 60])
    said = ""

    def follows() -> bool:
        nonlocal said
        said += capsys.readouterr().out
        return "The arm follows the page." in said

    page.wait(follows)
    assert "6 servos answer at sim: 7.4 V, 28 °C at most." in said
    page.set("1 shoulder pan", 30.0)
    page.wait(lambda: bool(measured(page)) and abs(measured(page)[0] - 30.0) < 0.2)
    typed.put("quit")
    started.wait()
    assert started.codes == [0]
    said += capsys.readouterr().out
    assert "The arm holds its place" in said
    page.settle()


@pytest.mark.full
def test_the_owner_enables_replays_stops_and_releases_from_the_page(viewer, page, typed, patient):
    def pressed(event: str, name: str) -> None:
        number = re.findall(rf'data-question-key="{name}" data-argument="(\d+)"', page.html)[0]
        page.say("feature", ["connect", [event, name, len(page.log)], int(number)])

    def button(label: str) -> None:
        page.send("GuiUpdateMessage", uuid=page.element(label), updates={"value": True})

    def at(degrees: float) -> bool:
        return bool(measured(page)) and abs(measured(page)[0] - degrees) < 1.0

    page.choose(ARM.name)
    started = ExampleRun(so101, viewer, page, ["--port", "sim", "--speed", 60])
    page.wait(lambda: 'data-announced="ready"' in page.html)
    assert "at up to 60 deg/s. Keep its power switch within reach." in page.html
    pressed("confirm", "enable")
    page.wait(lambda: 'data-announced="enabled"' in page.html)
    page.wait(lambda: page.shown["stop"] == ["stop", "Stop"])
    begins = measured(page)[0]
    button("Record the connection")
    time.sleep(1.0)  # how long the arm stays there when it is replayed
    page.set("1 shoulder pan", begins + 40.0)
    page.wait(lambda: at(begins + 40.0))
    button("Stop recording")
    page.wait(lambda: 'data-live-recording="ended"' in page.html)
    button("Play recording")
    page.wait(lambda: at(begins))
    page.wait(lambda: at(begins + 40.0))
    pressed("halt", "stop")
    page.wait(lambda: 'data-announced="stopped"' in page.html and page.shown["driven"] == "")
    pressed("confirm", "release")
    page.wait(lambda: "The motors are off." in page.html)
    typed.put("quit")
    started.wait()
    assert started.codes == [0]
    page.settle()


def test_the_help_states_the_default_speed(capsys):
    assert main(["so101", "--help"]) == 0
    assert f"(default {driving.SLOW:g})" in " ".join(capsys.readouterr().out.split())
