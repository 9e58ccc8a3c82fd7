"""`examples/so101_webserial/` in Chromium, its port a simulated bus: packets, bounds, and what stops the arm.

No real port and no real arm: `serial_port.js` stands for what a browser offers.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import serial
from feetech_bus import RecordedLine
from playwright.sync_api import Browser, FilePayload, Page, expect
from serial_browser import SerialBus
from so101_webserial.write_page import main, write_page

import kin
from app.servos import session
from app.servos.bus import Bus
from app.servos.registers import GOAL, MODEL, TORQUE, VOLTAGE
from app.servos.scale import MARGIN, Scale
from app.servos.simulated import CALIBRATION, START, SimulatedPort
from kin.notebook import driving

pytestmark = [pytest.mark.browser, pytest.mark.full]

ARM = kin.get_robot("so101")
MOTORS = [*kin.motors.motors_from_lerobot(ARM, CALIBRATION)]
TICK = 360.0 / 4095.0  # deg
# Nothing is drawn: software rendering would hold up the bus of the page.
BLIND = """
{
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...more);
  };
}
"""
HIDE = """(hidden) => {
  Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
  document.dispatchEvent(new Event("visibilitychange"));
}"""
ON_BUS = """async ([act, motors]) => {
  const { Bus } = kinboardServos;
  const bus = new Bus(testPort, motors);
  await bus.open();
  try { return await new Function("bus", "motors", `return (async () => { ${act} })()`)(bus, motors); }
  finally { await bus.close(); }
}"""
GUIDED = """({ motors, measured, limits, speed, steps }) => {
  const guide = new kinboardServos.Guide(motors, measured, steps[0].wanted, limits, speed, 100);
  return steps.map(({ at, wanted, now }) => {
    try { return guide.step(at, wanted, now); } catch (error) { return error.message; }
  });
}"""


def motors_of(robot: kin.Robot = ARM, ranges: dict[str, Any] = CALIBRATION) -> list[dict[str, Any]]:
    """The motors as the scripts have them once the calibration is read."""
    found = []
    for joint, motor in zip(robot.joints, robot.motors, strict=False):
        low, high = joint.limits or (-np.pi, np.pi)
        speed = float(kin.motion.motion_limits(robot).velocity[len(found)])
        entry = ranges[motor.name]
        found.append(
            {
                "id": motor.id,
                "name": motor.name,
                "joint": joint.name,
                "sign": motor.sign,
                "offset": motor.offset,
                "lower": low,
                "upper": high,
                "velocity": speed,
                "range": [entry["range_min"], entry["range_max"]],
            }
        )
    return found


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(ARM, tmp_path_factory.mktemp("webserial") / "so101.html")


@pytest.fixture
def line() -> RecordedLine:
    line = RecordedLine(START)
    for entry in CALIBRATION.values():
        line.servos[entry["id"]].calibrate(entry)
    return line


@pytest.fixture
def bus(line: RecordedLine) -> Iterator[SerialBus]:
    with SerialBus(line) as bus:
        yield bus


@pytest.fixture
def tab(browser: Browser, file: Path, bus: SerialBus) -> Iterator[Page]:
    # The page forbids every connection; that of the test is part of the browser's port.
    context = browser.new_context(bypass_csp=True)
    context.add_init_script(bus.script + BLIND)
    page = context.new_page()
    page.set_default_timeout(20_000)
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(file.as_uri())
    page.wait_for_function("window.kinboardArm && window.kinboardServos")
    page.evaluate("kinboardServos.BOUNDS.ANSWER = 0.3")  # on a busy machine the other end may wait
    yield page
    context.close()
    assert said == []


@pytest.fixture(scope="module")
def scripts(browser: Browser, file: Path) -> Iterator[Page]:
    """A page for its functions alone."""
    page = browser.new_page()
    page.add_init_script(BLIND)
    page.goto(file.as_uri())
    yield page
    page.close()


def pressed(tab: Page, name: str) -> None:
    tab.get_by_role("button", name=name, exact=True).click()


def says(tab: Page, text: str) -> None:
    expect(tab.locator("#servo-status")).to_contain_text(text, timeout=20_000)


def calibrate(tab: Page, table: Any = CALIBRATION) -> None:
    text = table if isinstance(table, str) else json.dumps(table)
    payload = FilePayload(name="my_arm.json", mimeType="application/json", buffer=text.encode())
    tab.get_by_label("LeRobot's calibration").set_input_files(payload)


def enabled(tab: Page, speed: float = 20.0, table: Any = CALIBRATION) -> None:
    """An arm that follows."""
    calibrate(tab, table)
    tab.get_by_label("At most").fill(f"{speed:g}")
    pressed(tab, "Connect")
    says(tab, "6 servos answer")
    pressed(tab, "Enable")
    says(tab, "The arm follows the page.")


def until(tab: Page, true: Callable[[], Any], seconds: float = 20.0) -> None:
    """Wait while the page goes on."""
    for _ in range(int(seconds / 0.02)):
        if true():
            return
        tab.wait_for_timeout(20)
    pytest.fail("it has not happened")


def move(tab: Page, joint: str, degrees: float) -> None:
    field = tab.get_by_label(f"{joint}, exact value")
    field.fill(f"{degrees:g}")
    field.press("Enter")


def goals(line: RecordedLine, number: int) -> list[tuple[float, int]]:
    """All goals that a servo was given, each with its time."""
    return [(t, int.from_bytes(v, "little")) for t, i, a, v in line.written if a == GOAL and i == number]


def rests(line: RecordedLine) -> bool:
    """Whether the servos, still on, stay where they are."""
    before = [line.servos[i].position for i in range(1, 6)]
    line.advance(1.0)
    after = [line.servos[i].position for i in range(1, 6)]
    return before == pytest.approx(after, abs=1.0) and all(line.servos[i].memory[TORQUE] for i in range(1, 6))


# The packets and numbers are those of `kinboard so101`


class RecordingPort(SimulatedPort):
    """A port that remembers what was sent."""

    def __init__(self, line: RecordedLine) -> None:
        super().__init__(line, monotonic=None)
        self.sent: list[bytes] = []

    def write(self, data: Any) -> int:
        self.sent.append(bytes(data))
        return super().write(data)


def test_the_packets_are_byte_by_byte_those_of_the_bus(tab, bus, line, monkeypatch):
    port = RecordingPort(RecordedLine(START))
    monkeypatch.setattr(serial, "Serial", lambda **_: port)
    ours = Bus("/dev/ttyACM0")
    said = ours.check(MOTORS)
    positions = ours.positions(MOTORS)
    ours.hold(MOTORS[:5])
    ours.switch(MOTORS[:5], True)
    ours.move({1: 2003, 4: 255, 5: 4095})
    ours.switch(MOTORS, False)
    act = """
      const said = await bus.check(), positions = await bus.positions(motors), moving = motors.slice(0, 5);
      await bus.hold(moving);
      await bus.torque(moving, true);
      await bus.write(kinboardServos.goals([[1, 2003], [4, 255], [5, 4095]]));
      await bus.torque(motors, false);
      return [said, positions];
    """
    motors = [*motors_of(), {"id": 6, "name": "gripper", "joint": ""}]
    theirs = tab.evaluate(ON_BUS, [act, motors])
    # On a busy machine an answer may be late, and is asked for again.
    assert [packet for packet, _ in groupby(packet for _, packet in bus.came)] == port.sent
    assert theirs[0] == said.replace(" at /dev/ttyACM0", "")
    assert theirs[1] == positions.tolist()
    assert bytes(tab.evaluate("[...kinboardServos.packet(1, 1)]")).hex(" ") == "ff ff 01 02 01 fb"


def test_broken_answers_are_asked_for_again(tab, bus, line):
    act = "return [await bus.positions(motors), testPort.disturb(), await bus.positions(motors)]"
    for broken in (0, 1, 2):
        line.broken = broken
        first, _, second = tab.evaluate(ON_BUS, [act, motors_of()])
        assert first == second == [int(START[i]) for i in range(1, 6)]
    line.broken = 100
    act = "return bus.positions(motors).catch(({ message }) => message)"
    assert "motor 1 (shoulder_pan) answers with broken packets only" in tab.evaluate(ON_BUS, [act, motors_of()])


def test_the_bounds_are_those_of_driving(scripts):
    bounds = scripts.evaluate("(({ ANSWER, ...others }) => others)(kinboardServos.BOUNDS)")
    expected = {name: getattr(driving, name) for name in ("SAME", "LATEST", "BEHIND", "PATIENCE", "AWAY")}
    expected |= {"MARGIN": MARGIN, "CYCLE": session.CYCLE, "RESTING": session.RESTING}
    assert bounds == pytest.approx(expected)


def test_ticks_become_the_same_joint_values(scripts):
    rng = np.random.default_rng(7)
    for _ in range(100):
        ranges = {
            name: {**entry, "range_min": int(rng.integers(0, 1500)), "range_max": int(rng.integers(2500, 4096))}
            for name, entry in CALIBRATION.items()
        }
        given = [
            kin.motors.Motor(
                m.joint, m.id, m.name, int(rng.choice([1, -1])), float(rng.choice([0.0, -95.0, 170.0]))
            )
            for m in ARM.motors[:5]
        ]
        bare = replace(ARM, motors=tuple(given))
        calibrated = kin.motors.motors_from_lerobot(bare, {m.name: ranges[m.name] for m in given})
        robot = replace(ARM, motors=calibrated)
        ticks = np.array([float(rng.integers(*motor.range)) for motor in calibrated])
        expected = Scale(robot, calibrated, ticks)
        q = [rng.uniform(low, high) for low, high in zip(*expected.limits, strict=True)]
        found = scripts.evaluate(
            """([motors, ticks, q]) => {
              const scale = new kinboardServos.Scale(motors, ticks);
              return [scale.q(ticks), scale.limits, scale.ticks(q)];
            }""",
            [motors_of(robot, ranges), ticks.tolist(), q],
        )
        assert found[0] == pytest.approx(expected.q(ticks), abs=1e-9)
        assert np.transpose(found[1]) == pytest.approx(np.array(expected.limits), abs=1e-9)
        assert found[2] == pytest.approx(expected.ticks(np.array(q)), abs=1.0)


class Clock:
    """A clock that the test sets."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


class Shown:
    """A page of `kinboard so101`, as its guide sees it."""

    connected, drives = True, None

    def __init__(self, q: np.ndarray) -> None:
        self.robot, self.q = ARM, q

    def stop(self) -> None:
        pass


@pytest.mark.parametrize("fault", ["none", "stuck", "pushed"])
def test_the_arm_is_led_as_the_guide_leads_it(scripts, monkeypatch, fault):
    """Step by step, with readings that lag, noise, pauses and commands out of all limits."""
    clock, rng = Clock(), np.random.default_rng(5)
    monkeypatch.setattr(driving, "time", clock)
    monkeypatch.setattr(driving, "PAGE_LOST", 1e6)
    monkeypatch.setattr(driving, "ARM_LOST", 1e6)
    q = ARM.q_home.copy()
    page = Shown(q.copy())
    limits = ARM.lower + 0.2, ARM.upper - 0.3
    guide = driving.Guide(page, "arm", 60.0, q, limits)
    guide.end()
    steps, expected, at = [], [], q.copy()
    for k in range(400):
        clock.now += 0.02 if k % 50 else 0.7
        if k % 60 == 20:
            page.q = page.q + rng.uniform(-1.5, 1.5, 5) * (rng.random(5) < 0.6)
        if not (fault == "stuck" and k > 120):
            at = at + 0.5 * (guide.asked - at) + rng.uniform(-1e-3, 1e-3, 5)
        if fault == "pushed" and k == 200:
            at = at + np.radians([0.0, 12.0, 0.0, 0.0, 0.0])
        steps.append({"at": at.tolist(), "wanted": page.q.tolist(), "now": clock.now})
        try:
            expected.append(guide.step(at, clock.now).tolist())
        except driving.StoppedError as error:
            expected.append(str(error).removesuffix(". The arm is not moved any further"))
            break
    limits = np.transpose(limits).tolist()
    given = {"motors": motors_of(), "measured": q.tolist(), "limits": limits, "speed": np.radians(60.0)}
    found = scripts.evaluate(GUIDED, given | {"steps": steps})
    assert found[-1] == expected[-1] if fault != "none" else isinstance(found[-1], list)
    moved = [row for row in found if isinstance(row, list)]
    assert np.array(moved) == pytest.approx(np.array(expected[: len(moved)]), abs=1e-9)


# An arm in the page


def test_the_mirror_writes_nothing_and_the_arm_follows_after_enable(tab, line, file):
    pressed(tab, "Connect")
    says(tab, "6 servos answer: 7.4 V, 28 °C at most. Choose its calibration")
    row = tab.locator("tr").filter(has_text="wrist flex").first
    expect(row).to_contain_text("2200 ticks")
    expect(tab.get_by_role("button", name="Enable")).to_be_disabled()
    calibrate(tab)
    expect(row).to_contain_text(f"{(2200 - 0.5 * (861 + 3187)) * TICK:.1f}°")
    line.servos[4].position = 2100.0
    expect(row).to_contain_text(f"{(2100 - 0.5 * (861 + 3187)) * TICK:.1f}°")
    assert line.written == []
    pressed(tab, "Enable")
    says(tab, "The arm follows the page.")
    began = {i: servo.position for i, servo in line.servos.items()}
    tab.wait_for_timeout(300)
    assert {i: servo.position for i, servo in line.servos.items()} == began, "nothing moves before the page does"
    assert tab.evaluate("document.body.hasAttribute('data-driven')")
    q = np.degrees(tab.evaluate("kinboardArm.q()"))
    assert q == pytest.approx([(began[m["id"]] - 0.5 * sum(m["range"])) * TICK for m in motors_of()], abs=0.01)
    move(tab, "shoulder pan", 15.0)
    until(tab, lambda: abs(line.servos[1].position - (2100 + 15.0 / TICK)) < 1.0)
    assert [goals(line, i)[-1][1] for i in range(2, 6)] == [began[i] for i in range(2, 6)], "others are not asked"
    steps = [(t, tick * TICK) for t, tick in goals(line, 1)]
    for (before, low), (after, high) in zip(steps, steps[5:], strict=False):
        assert abs(high - low) <= 20.0 * (after - before + 0.1) + 2 * TICK, "at most the speed"
    pressed(tab, "Stop")
    says(tab, "The arm holds its place")
    assert rests(line)
    assert not line.servos[6].memory[TORQUE], "the gripper is not driven"
    pressed(tab, "Release")
    says(tab, "The motors are off.")
    assert not any(servo.memory[TORQUE] for servo in line.servos.values())
    pressed(tab, "Disconnect")
    says(tab, "Disconnected")
    assert line.refused == 0


def test_commands_beyond_the_calibrated_range_end_at_its_end(tab, line):
    narrow = {**CALIBRATION, "elbow_flex": {**CALIBRATION["elbow_flex"], "range_max": 2600}}
    enabled(tab, 180.0, narrow)
    move(tab, "elbow flex", 96.8)
    until(tab, lambda: round(line.servos[3].position) == 2600)
    assert max(tick for _, tick in goals(line, 3)) == 2600


FAULTS: dict[str, tuple[Callable[[RecordedLine], Any], str]] = {
    "missing": (
        lambda line: line.missing.add(3),
        "motor 3 (elbow_flex) does not answer. motor 1 (shoulder_pan), motor 2 (shoulder_lift)",
    ),
    "silence": (lambda line: line.missing.update(range(1, 7)), "No servo answered: is the arm's power on"),
    "supply": (
        lambda line: line.servos[4].put(VOLTAGE, bytes([120, 28])),
        "motor 4 (wrist_flex) gets 12.0 V, expected 4.0 to 8.0 V",
    ),
    "heat": (lambda line: line.servos[2].put(VOLTAGE, bytes([74, 71])), "is at 71 °C, expected less than 70 °C"),
    "model": (lambda line: line.servos[6].put(MODEL, bytes([9, 5])), "motor 6 (gripper) is of model 1289"),
    "error": (
        lambda line: setattr(line.servos[5], "error", 32),
        "(wrist_roll) reports an error: overload",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_bus_is_named(tab, line, name):
    spoil, words = FAULTS[name]
    spoil(line)
    pressed(tab, "Connect")
    says(tab, words)
    expect(tab.get_by_role("button", name="Connect", exact=True)).to_be_enabled()
    assert line.written == []


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("{", "Calibration: expected the JSON file that LeRobot writes"),
        ("5", "Calibration: it has no shoulder_pan"),
        (
            {**CALIBRATION, "elbow_flex": {"id": 3}},
            "elbow_flex.range_min is undefined, expected a whole number",
        ),
        (
            {**CALIBRATION, "elbow_flex": {"id": 3, "range_min": 2000, "range_max": 2000}},
            "elbow_flex.range_max is 2000, expected a whole number from 2001 to 4095",
        ),
        (" " * 100_001, "Calibration: 100001 bytes, expected at most 100000"),
    ],
)
def test_a_wrong_calibration_is_refused(tab, table, words):
    calibrate(tab, table)
    says(tab, words)
    pressed(tab, "Connect")
    says(tab, "6 servos answer")
    expect(tab.get_by_role("button", name="Enable")).to_be_disabled()


def test_an_arm_of_another_calibration_is_not_driven(tab, line):
    line.servos[2].position = 3300.0
    calibrate(tab)
    pressed(tab, "Connect")
    says(tab, "6 servos answer")
    pressed(tab, "Enable")
    says(tab, "motor 2 (shoulder_lift) is at 3300 ticks, outside its calibrated range from 842 to 3218")
    assert line.written == []


def on_its_way(tab: Page, line: RecordedLine) -> None:
    enabled(tab, 30.0)
    move(tab, "shoulder pan", 90.0)
    until(tab, lambda: line.servos[1].position > 2060.0)


def test_a_hidden_page_holds_the_arm(tab, line):
    on_its_way(tab, line)
    tab.evaluate(HIDE, True)
    says(tab, "This page was hidden. The arm holds its place")
    assert rests(line)
    tab.evaluate(HIDE, False)
    where = line.servos[1].position
    tab.wait_for_timeout(300)
    assert line.servos[1].position == where, "it follows no more until the next Enable"
    pressed(tab, "Enable")
    says(tab, "The arm follows the page.")


def stuck(line: RecordedLine) -> None:
    line.servos[1].stuck = True


def pushed(line: RecordedLine) -> None:
    stuck(line)
    line.servos[1].position -= 300.0


STOPS: dict[str, tuple[Callable[[RecordedLine], Any], str]] = {
    "stuck": (stuck, "behind: something holds it"),
    "pushed": (pushed, "away from where it was asked to be"),
    "lost": (lambda line: line.missing.add(4), "motor 4 (wrist_flex) does not answer"),
    "error": (
        lambda line: setattr(line.servos[1], "error", 4),
        "(shoulder_pan) reports an error: temperature",
    ),
}


@pytest.mark.parametrize("name", STOPS)
def test_an_arm_that_cannot_follow_is_held(tab, line, name):
    spoil, words = STOPS[name]
    on_its_way(tab, line)
    spoil(line)
    says(tab, words)
    says(tab, "The arm is not moved any further")
    assert rests(line)
    assert not tab.evaluate("document.body.hasAttribute('data-driven')")


def test_an_unplugged_adapter_is_named_and_can_come_back(tab, line, bus):
    on_its_way(tab, line)
    bus.unplug()
    says(tab, "The port is gone")
    says(tab, "goes on to its last goal, which is close by")
    assert abs(goals(line, 1)[-1][1] - line.servos[1].position) < 30.0 / TICK * 0.2
    pressed(tab, "Connect")
    says(tab, "6 servos answer")


def test_a_page_that_goes_away_leaves_goals_that_are_near(tab, line, bus):
    """Nobody can tell the servos anything more: each goes on to its last goal."""
    on_its_way(tab, line)
    tab.reload()
    came = len(bus.came)
    tab.wait_for_timeout(300)
    assert len(bus.came) == came
    # 0.1 s of a step at most, which a servo may have just begun
    assert abs(goals(line, 1)[-1][1] - line.servos[1].position) <= 30.0 * driving.LATEST / TICK + 2.0
    assert all(line.servos[i].memory[TORQUE] for i in range(1, 6))


def test_escape_stops_and_a_wrong_speed_is_refused(tab, line):
    on_its_way(tab, line)
    tab.keyboard.press("Escape")
    says(tab, "The arm holds its place")
    tab.get_by_label("At most").fill("400")
    pressed(tab, "Enable")
    says(tab, "Speed: got 400, expected 1 to 180 degrees per second")


def test_a_browser_without_webserial_is_named(browser, file):
    context = browser.new_context()
    context.add_init_script(BLIND + "Object.defineProperty(navigator, 'serial', { value: undefined });")
    page = context.new_page()
    page.goto(file.as_uri())
    says(page, "This browser has no WebSerial")
    expect(page.get_by_role("button", name="Connect")).to_be_disabled()
    context.close()


def test_the_page_is_written_from_the_command_line(tmp_path, capsys):
    assert main(["so101", "-o", str(tmp_path / "arm.html")]) == 0
    assert "Open it in Chromium" in capsys.readouterr().out
    text = (tmp_path / "arm.html").read_text(encoding="utf-8")
    assert text.count("</body>") == 1
    assert '"joint": "wrist roll"' in text
    assert main(["so100", "-o", str(tmp_path / "other.html")]) == 1
    assert "one motor in degrees, and limits, of shoulder pan" in capsys.readouterr().err
