"""A driven arm, with a bus in memory and a clock that the test sets: LeRobot's calibrations, limits, stops.

`test_so101.py` has the same session with a page of the viewer and a bus in real time.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest
import serial
from feetech_bus import RecordedLine
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from app.servos import session
from app.servos.bus import Bus
from app.servos.calibration import Calibration
from app.servos.registers import GOAL, MODEL, TORQUE, TURN, VOLTAGE
from app.servos.scale import Scale
from app.servos.simulated import Line, SimulatedPort
from kin.notebook import driving

ARM = kin.get_robot("so101")
NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
RANGES = ((748, 3452), (842, 3218), (893, 3102), (861, 3187), (0, 4095), (2021, 3487))
START = (2000, 1700, 2500, 2200, 2075, 2500)
# As LeRobot's calibrate() writes them: it puts the pose in the middle at 2047 by the homing offset, records the
# ranges, and states a full turn for the motor that can turn one.
OFFSETS = ((-1290, -1148, 1033, -1702, 1925, -1877), (84, -37, 655, -70, -2047, 61))


def calibration(wrist: tuple[int, int] = (0, 4095), offsets: tuple[int, ...] = OFFSETS[0], mode: int = 0) -> Any:
    ranges = (*RANGES[:4], wrist, RANGES[5])
    return {
        name: {"id": i, "drive_mode": mode, "homing_offset": offset, "range_min": low, "range_max": high}
        for i, (name, offset, (low, high)) in enumerate(zip(NAMES, offsets, ranges, strict=True), 1)
    }


CALIBRATIONS = {
    "full turn": calibration(),
    "full turn, other offsets": calibration(offsets=OFFSETS[1]),
    "full turn, drive mode 1": calibration(mode=1),
    "by hand": calibration((40, 4060)),
    "narrower than the model": calibration((1000, 3000)),
    "one tick less than a turn": calibration((0, 4094)),
    "one tick more than nothing": calibration((1, 4095)),
}
UNITS: tuple[Any, ...] = ("deg", "rad", "range_m100_100", "range_0_100")


class Clock:
    """Time passes while somebody sleeps, and the servos move meanwhile."""

    def __init__(self, line: Line) -> None:
        self.now, self._line = 100.0, line
        self.each: Callable[[float], None] = lambda _: None  # called after each sleep, with the time

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self._line.advance(seconds)
        self.now += seconds
        self.each(self.now - 100.0)


class Port(SimulatedPort):
    """A port that can be unplugged; the clock of the test moves the servos."""

    gone = False

    def write(self, data: Any) -> int:
        if self.gone:
            raise serial.SerialException("write failed: Input/output error")
        return super().write(data)


class Page:
    """A page that shows what it is asked to show, and what the test commands."""

    connected = True
    drives: str | None = None
    readings: Any = None
    gripper: float | None = 0.5

    def __init__(self, robot: kin.Robot) -> None:
        self.robot, self.q = robot, robot.q_home
        self.measured = robot.q_home
        self.announced: list[tuple[str, str, list[str]]] = []  # state, words and buttons, one after the other

    def stop(self) -> None:
        pass

    def announce(self, words: str, buttons: Any, state: str) -> None:
        self.announced.append((state, words, [each["name"] for each in buttons]))

    def events(self) -> Iterator[Any]:
        return iter(())


class Rig:
    """An SO-101 on its bus, and the program that drives it.

    Attributes:
        line: the bus.
        page: what the arm follows.
        said: why the arm was stopped or the session has ended; empty: it has had its time.
        typed: what its owner types.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        self._folder = folder
        self.line = RecordedLine(dict(enumerate(map(float, START), 1)))
        self.line.advance(0.0)
        self.clock = Clock(self.line)
        self.line.monotonic = self.clock.monotonic
        self.page = Page(ARM)
        self.said = ""
        self.typed: SimpleQueue[str] = SimpleQueue()
        self.port = Port(self.line, monotonic=None)
        monkeypatch.setattr(serial, "Serial", lambda **_: self.port)
        for module in (session, driving):
            monkeypatch.setattr(module, "time", self.clock)
        monkeypatch.setattr(driving, "PAGE_LOST", 1e6)  # its signs of life come by another clock

    def place(self, number: int, ticks: float) -> None:
        """Put a servo somewhere by hand."""
        self.line.servos[number].position = ticks
        self.line.advance(0.0)

    def drive(
        self, table: Any, seconds: float = 3.0, speed: float = 20.0, release: bool = False, word: str = "enable"
    ) -> Rig:
        file = self._folder / "arm.json"
        file.write_text(json.dumps(table))
        for entry in table.values():
            self.line.servos[entry["id"]].calibrate(entry)
        self.began = self.positions
        self.page.announced.clear()
        self.typed.put(word)
        try:
            bus = Bus("/dev/ttyACM0")
            calibrated = Calibration(str(file), bus.port).applied
            session.Session(self.page, bus, calibrated, self.typed, speed, seconds).run(release)
        except kin.KinematicsError as error:
            self.said = str(error)
        stopped = [words for state, words, _ in self.page.announced if state in ("stopped", "fault")]
        self.said = next((words.removesuffix(".") for words in stopped if words != session.HELD), self.said)
        return self

    @property
    def positions(self) -> list[float]:
        return [self.line.servos[i].position for i in range(1, 6)]

    def goals(self, number: int) -> list[int]:
        """All goals that a servo was ever given."""
        return [int.from_bytes(v, "little") for _, i, a, v in self.line.written if a == GOAL and i == number]

    @property
    def torque(self) -> list[bool]:
        return [bool(self.line.servos[i].memory[TORQUE]) for i in range(1, 6)]


@pytest.fixture
def rig(monkeypatch, tmp_path) -> Rig:
    return Rig(monkeypatch, tmp_path)


def degrees(table: Any, positions: list[float]) -> np.ndarray:
    """By hand: LeRobot's degrees begin in the middle of the calibrated range, with 4095 ticks to a turn."""
    ranges = [(entry["range_min"], entry["range_max"]) for entry in table.values()][:5]
    return np.array([(t - 0.5 * sum(ends)) * 360.0 / 4095.0 for t, ends in zip(positions, ranges, strict=True)])


@pytest.mark.parametrize("wrist", [2075, 60, 4050])
@pytest.mark.parametrize("name", CALIBRATIONS)
def test_nothing_moves_before_the_page_commands_it(rig, name, wrist):
    table = CALIBRATIONS[name]
    low, high = table["wrist_roll"]["range_min"], table["wrist_roll"]["range_max"]
    wrist = max(low, min(high, wrist))
    rig.place(5, wrist)
    rig.drive(table, seconds=1.0)
    assert rig.said == ""
    assert rig.positions == rig.began == [*map(float, START[:4]), float(wrist)]
    for number in range(1, 6):
        assert set(rig.goals(number)) == {round(rig.began[number - 1])}
    assert all(rig.torque)
    assert np.degrees(rig.page.measured) == pytest.approx(degrees(table, rig.began), abs=1e-6)


@pytest.mark.parametrize(("wrist", "command"), [(2075, 20.0), (250, 162.7), (3890, -157.0)])
@pytest.mark.parametrize("name", ["full turn", "full turn, drive mode 1", "by hand", "narrower than the model"])
def test_a_wrist_that_can_turn_around_goes_where_the_page_says(rig, name, wrist, command):
    table = CALIBRATIONS[name]
    low, high = table["wrist_roll"]["range_min"], table["wrist_roll"]["range_max"]
    wrist = max(low, min(high, wrist))
    rig.place(5, wrist)

    def move(t: float) -> None:
        if t > 0.2:
            rig.page.q = np.append(rig.page.q[:4], np.radians(command))

    rig.clock.each = move
    rig.drive(table, seconds=3.0, speed=150.0)
    assert rig.said == ""
    goals = rig.goals(5)
    end = max(low, min(high, round(0.5 * (low + high) + command * 4095.0 / 360.0)))
    assert goals[-1] == pytest.approx(end, abs=1)
    assert rig.positions[4] == pytest.approx(end, abs=1)
    assert min(wrist, end) - 1 <= min(goals)
    assert max(goals) <= max(wrist, end) + 1, "straight there"
    steps = np.abs(np.diff(goals))
    assert steps.max() <= 150.0 * session.CYCLE * 4095.0 / 360.0 + 1.5
    assert rig.positions[:4] == rig.began[:4], "the other joints were not commanded"


@pytest.mark.parametrize(("wrist", "inside"), [(6, -157.2), (4089, 162.78)])
def test_a_wrist_outside_its_limits_stays_there_and_comes_back_without_a_turn(rig, wrist, inside):
    """Both are beyond the limits of the model; the ticks between them lie on the other side."""
    rig.place(5, wrist)

    def move(t: float) -> None:
        if t > 1.0:
            rig.page.q = np.append(rig.page.q[:4], np.radians(-100.0 if wrist < 2048 else 100.0))
        else:
            assert np.degrees(rig.page.q[4]) == pytest.approx(inside, abs=0.05), "the page shows the nearest value"
            assert rig.positions[4] == wrist

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=8.0)
    assert rig.said == ""
    way = np.diff([wrist, *rig.goals(5)])
    assert (way >= 0).all() if wrist < 2048 else (way <= 0).all()
    there = -100.0 if wrist < 2048 else 100.0
    assert degrees(CALIBRATIONS["full turn"], rig.positions)[4] == pytest.approx(there, abs=0.1)


def test_a_wrist_is_on_the_turn_on_which_its_limits_hold_it(rig):
    """The middle of its range is at 170°, outside the limits; where it is, at 230° then, is -130°, inside."""
    rig.page.robot = replace(
        ARM, motors=tuple(replace(motor, offset=-170.0 * (motor.id == 5)) for motor in ARM.motors), id="turned"
    )
    rig.place(5, 2730)

    def move(t: float) -> None:
        if t > 0.2:
            rig.page.q = np.append(rig.page.q[:4], np.radians(-100.0))

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"])
    assert rig.said == ""
    assert rig.positions[4] == pytest.approx(2730 + 30.0 * 4095.0 / 360.0, abs=1)
    assert min(rig.goals(5)) == 2730, "straight there"


def test_no_joint_is_led_beyond_its_calibrated_range_or_the_limits_of_the_page(rig):
    table = CALIBRATIONS["narrower than the model"]
    rng = np.random.default_rng(3)

    def move(t: float) -> None:
        if round(t / session.CYCLE) % 100 == 0:  # long enough to rest at an end
            rig.page.q = ARM.random_q(rng) * 3.0  # a page would not show this

    rig.clock.each = move
    rig.drive(table, seconds=12.0, speed=120.0)
    assert rig.said == ""
    for number, entry in zip(range(1, 6), table.values(), strict=False):
        low, high = entry["range_min"], entry["range_max"]
        goals = np.array(rig.goals(number))
        assert low <= goals.min() < goals.max() <= high
        q = np.radians((goals - 0.5 * (low + high)) * 360.0 / 4095.0)
        assert ARM.lower[number - 1] - 2e-3 <= q.min()
        assert q.max() <= ARM.upper[number - 1] + 2e-3
        assert goals.max() - goals.min() > 1000, "it has moved far"


def shoulder(degrees: float) -> Callable[[Rig], Callable[[float], None]]:
    """A page that commands the first joint after half a second."""

    def of(rig: Rig) -> Callable[[float], None]:
        def move(t: float) -> None:
            if t > 0.5:
                rig.page.q = np.append(np.radians(degrees), rig.page.q[1:])

        return move

    return of


def test_an_arm_that_goes_away_from_its_command_is_stopped_and_held(rig):
    rig.line.servos[1].reversed = True
    rig.clock.each = shoulder(60.0)(rig)
    rig.drive(CALIBRATIONS["full turn"], seconds=20.0)
    assert "shoulder pan has moved" in rig.said
    assert "away from where it was asked to be" in rig.said
    gone = abs(rig.positions[0] - START[0]) * 360.0 / 4095.0
    assert gone < 2.0 * np.degrees(driving.AWAY)
    assert all(rig.torque), "it would fall"
    assert rig.goals(1)[-1] == round(rig.positions[0]), "its goal is where it is"


@pytest.mark.parametrize("push", [300.0, -300.0, 2048.0])
def test_an_arm_that_is_pushed_away_is_stopped_and_held(rig, push):
    def move(t: float) -> None:
        if t > 1.0 and rig.line.servos[5].position == START[4]:
            rig.line.servos[5].stuck = True
            rig.place(5, START[4] + push)

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=20.0)
    assert "wrist roll has moved" in rig.said
    assert all(rig.torque)
    assert rig.goals(5)[-1] == (START[4] + push) % TURN


def test_a_wrist_that_is_turned_past_the_end_of_its_turn_is_not_led_back_around(rig):
    """Its servo reads 3 after 4095, and would go back nearly a whole turn to the goal that it has."""
    rig.place(5, 4090)

    def move(t: float) -> None:
        if t > 1.0 and rig.line.servos[5].position <= 4095:
            rig.line.servos[5].stuck = True
            rig.place(5, 4099)

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=20.0)
    assert "wrist roll has moved" in rig.said
    assert rig.goals(5)[-1] == 3


def test_an_arm_that_is_held_is_not_pushed_for_long(rig):
    rig.line.servos[1].stuck = True
    rig.clock.each = shoulder(80.0)(rig)
    rig.drive(CALIBRATIONS["full turn"], seconds=20.0, speed=90.0)
    assert "shoulder pan is" in rig.said
    assert "behind: something holds it" in rig.said
    assert rig.goals(1)[-1] == START[0]
    assert all(rig.torque)


def test_a_servo_outside_its_calibrated_range_is_not_driven(rig):
    rig.place(3, RANGES[2][1] + 200)
    rig.drive(CALIBRATIONS["full turn"])
    assert "motor 3 (elbow_flex) is at 3302 ticks, outside its calibrated range from 893 to 3102" in rig.said
    assert rig.line.written == []
    rig.place(3, RANGES[2][1] + 20)  # pressed a little farther than when it was calibrated
    rig.said = ""
    rig.drive(CALIBRATIONS["full turn"])
    assert rig.said == ""
    assert rig.goals(3) == [RANGES[2][1] + 20, RANGES[2][1]], "its servo has a limit of its own; held at the end"


def test_an_arm_whose_limits_exclude_each_other_is_not_driven(rig):
    """With a zero that is far off, the calibrated range is outside the limits of the model."""
    motors = [replace(motor, offset=120.0 * (motor.id == 2)) for motor in ARM.motors]
    rig.page.robot = replace(ARM, motors=tuple(motors), id="odd")
    table = calibration()
    table["shoulder_lift"] |= {"range_min": 2000, "range_max": 2100}
    rig.place(2, 2050)
    rig.drive(table)
    assert "shoulder lift: the arm's own limits are" in rig.said
    assert "no value is inside both" in rig.said
    assert rig.positions == rig.began


def stops(rig: Rig, cause: Callable[[], None], seconds: float = 20.0) -> Rig:
    """Let something happen while the first joint is on its way."""
    begun = shoulder(80.0)(rig)

    def move(t: float) -> None:
        begun(t)
        if t > 1.5:
            cause()

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=seconds)
    assert 5.0 < (rig.positions[0] - START[0]) * 360.0 / 4095.0 < 25.0, "on its way, and no farther"
    return rig


def rests(rig: Rig, *numbers: int) -> bool:
    """Whether these servos stay where they are, switched on."""
    before = [rig.line.servos[i].position for i in numbers]
    rig.line.advance(1.0)
    return before == pytest.approx([rig.line.servos[i].position for i in numbers], abs=0.5) and all(rig.torque)


def test_a_servo_that_is_lost_stops_all_others(rig, capsys):
    stops(rig, lambda: rig.line.missing.add(5))
    assert rig.said == "motor 5 (wrist_roll) does not answer"
    assert rests(rig, 1, 2, 3, 4)
    assert "motor 5 (wrist_roll) does not answer. It goes on to its last goal" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        ({3}, "motor 3 (elbow_flex) does not answer. motor 1 (shoulder_pan), motor 2 (shoulder_lift)"),
        (set(range(1, 7)), "No servo answered at /dev/ttyACM0: is the arm's power on, the cable"),
    ],
)
def test_a_missing_servo_is_named(rig, missing, words):
    rig.line.missing |= missing
    rig.drive(CALIBRATIONS["full turn"])
    assert words in rig.said
    assert rig.line.written == []


def test_servos_of_another_kind_are_refused(rig):
    rig.line.servos[2].put(MODEL, (1284).to_bytes(2, "little"))
    rig.drive(CALIBRATIONS["full turn"])
    assert "motor 2 (shoulder_lift) is of model 1284, expected STS3215 (777)" in rig.said
    assert rig.line.written == []


def test_an_overloaded_servo_stops_the_arm(rig):
    def overload() -> None:
        rig.line.servos[2].error = 1 << 5

    stops(rig, overload)
    assert rig.said.startswith("motor 2 (shoulder_lift) reports an error: overload: take the load off")
    assert rests(rig, *range(1, 6))


def test_a_page_that_is_lost_stops_the_arm(rig):
    stops(rig, lambda: setattr(rig.page, "connected", False))
    assert "the page does not answer: the arm is not moved any further" in rig.said
    assert rests(rig, *range(1, 6))


def test_a_page_that_shows_another_arm_stops_this_one(rig):
    stops(rig, lambda: setattr(rig.page, "robot", kin.get_robot("so100")))
    assert "the page shows another arm" in rig.said
    assert rests(rig, *range(1, 6))


def test_a_bus_that_is_unplugged_ends_the_program(rig, capsys):
    def unplug() -> None:
        rig.port.gone = True

    stops(rig, unplug)
    assert "the bus at /dev/ttyACM0 is gone" in rig.said
    assert "the bus at /dev/ttyACM0 is gone" in capsys.readouterr().err, "and nothing reaches the servos"


def test_motors_are_released_when_asked(rig):
    rig.drive(CALIBRATIONS["full turn"], release=True)
    assert not any(rig.torque)


def test_nothing_is_written_before_the_owner_says_enable(rig, capsys):
    for word in ("stop", "gripper 50", "go"):
        rig.typed.put(word)
    rig.clock.each = shoulder(60.0)(rig)
    rig.drive(CALIBRATIONS["full turn"], word="")
    assert rig.said == ""
    assert rig.line.written == []
    said = capsys.readouterr().out
    assert "6 servos answer at /dev/ttyACM0: 7.4 V, 28 °C at most." in said
    assert "The gripper moves after enable only." in said
    assert "Got 'go'. Type and press Enter:" in said


def test_what_stops_the_arm_is_said_in_the_page_and_the_next_enable_goes_on(rig, capsys):
    def hold(t: float) -> None:
        rig.line.servos[1].stuck = t < 6.0
        if t > 0.5:
            rig.page.q = np.append(np.radians(60.0), rig.page.q[1:])
        if t > 6.0 and len(rig.page.announced) == 3:
            rig.typed.put("enable")

    rig.clock.each = hold
    rig.drive(CALIBRATIONS["full turn"], seconds=14.0, speed=40.0)
    ready, enabled, stopped, again = rig.page.announced
    assert ready == ("ready", session.MIRROR, ["enable", "release"])
    assert enabled == ("enabled", "The arm follows this page at up to 40 deg/s.", ["stop", "release"])
    assert stopped[0] == "stopped"
    assert "shoulder pan is" in stopped[1]
    assert "behind: something holds it" in stopped[1]
    assert stopped[2] == ["enable", "release"]
    assert again == enabled
    assert stopped[1] in capsys.readouterr().err
    assert degrees(CALIBRATIONS["full turn"], rig.positions)[0] == pytest.approx(60.0, abs=0.2)


def test_a_servo_that_is_lost_meanwhile_is_a_fault_in_the_page_until_it_answers(rig):
    def lose(t: float) -> None:
        rig.line.missing = {4} if 0.5 < t < 2.0 else set()

    rig.clock.each = lose
    rig.drive(CALIBRATIONS["full turn"], word="")
    assert [(state, buttons) for state, _, buttons in rig.page.announced] == [
        ("ready", ["enable", "release"]),
        ("fault", ["release"]),
        ("ready", ["enable", "release"]),
    ]
    assert rig.page.announced[1][1] == "motor 4 (wrist_flex) does not answer. The ghost is hidden meanwhile."
    assert rig.line.written == []


def test_a_released_arm_whose_servo_was_lost_is_ready_again_and_not_stopped(rig):
    def move(t: float) -> None:
        if round(t / session.CYCLE) == 25:
            rig.typed.put("release")
        rig.line.missing = {4} if 1.0 < t < 2.0 else set()

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"])
    assert [state for state, *_ in rig.page.announced] == ["ready", "enabled", "ready", "fault", "ready"]
    assert not any(rig.torque)


@pytest.mark.parametrize("follows", [True, False])
def test_release_switches_off_all_that_answer_and_says_which_does_not(rig, follows):
    """A servo that reports an error is switched off, too."""

    def move(t: float) -> None:
        step = round(t / session.CYCLE)
        if not follows and step == 15:
            rig.typed.put("stop")
        if step == 25:
            rig.typed.put("release")
            rig.line.missing, rig.line.servos[5].error = {2}, 1 << 5

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"])
    assert rig.torque == [False, True, False, False, False]
    said = "motor 2 (shoulder_lift) does not answer. The other motors are off."
    assert said in [words for _, words, _ in rig.page.announced]
    assert session.OFF not in [words for _, words, _ in rig.page.announced]


def test_quit_ends_although_not_all_motors_can_be_released(rig):
    def move(t: float) -> None:
        if round(t / session.CYCLE) == 25:
            rig.typed.put("quit")
            rig.line.missing = {2}

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=60.0, release=True)
    assert rig.torque == [False, True, False, False, False]
    assert rig.clock.now < 105.0


def test_a_fault_holds_the_arm_even_where_the_end_would_release_it(rig):
    rig.line.servos[1].stuck = True

    def held(t: float) -> None:
        shoulder(80.0)(rig)(t)
        if t > 7.0:
            assert all(rig.torque), "it would fall"

    rig.clock.each = held
    rig.drive(CALIBRATIONS["full turn"], seconds=8.0, speed=90.0, release=True)
    assert "behind: something holds it" in rig.said
    assert not any(rig.torque), "at the end"


def test_stop_holds_the_arm_until_the_next_enable(rig):
    """It goes on from where it is then, although the page shows another place meanwhile."""
    begun = shoulder(80.0)(rig)
    where: list[float] = []

    def move(t: float) -> None:
        begun(t) if t < 2.0 else None
        if not where and t > 1.5:
            rig.typed.put("stop")
            where.append(t)
        elif len(where) == 1 and t > 3.0:
            where.append(rig.positions[0])
            rig.place(1, where[1])
            rig.typed.put("enable")

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"], seconds=5.0)
    assert rig.said == ""
    assert 5.0 < (where[1] - START[0]) * 360.0 / 4095.0 < 25.0
    assert rig.positions[0] == pytest.approx(where[1], abs=1.0)
    assert all(rig.torque)


def test_the_gripper_goes_to_its_goal_slowly_and_squeezes_no_harder(rig, capsys):
    low, high = RANGES[5]

    def move(t: float) -> None:
        if round(t / session.CYCLE) == 10:
            assert not rig.line.servos[6].memory[TORQUE], "it has no goal yet"
            rig.typed.put("gripper 90")
        if t > 3.0 and rig.line.servos[6].position < high - 200:
            rig.line.servos[6].stuck = True

    rig.clock.each = move
    for word in ("enable", "gripper 101", "gripper"):
        rig.typed.put(word)
    rig.drive(CALIBRATIONS["full turn"])
    goals = rig.goals(6)
    assert rig.said == ""
    assert rig.line.servos[6].position == pytest.approx(low + 0.9 * (high - low), abs=1.0)
    assert np.abs(np.diff([START[5], *goals])).max() <= 0.5 * (high - low) * session.CYCLE + 1.0
    assert "gripper: got '101', expected a number from 0 (closed) to 100 (open)." in capsys.readouterr().out
    rig.line.servos[6].stuck = True  # something is between its jaws
    rig.clock.each = lambda _: None
    rig.typed.put("enable")
    here = rig.line.servos[6].position
    rig.drive(CALIBRATIONS["full turn"], word="gripper 0")
    assert min(rig.goals(6)[len(goals) :]) == pytest.approx(here - session.SQUEEZE, abs=1.0)
    assert rig.goals(6)[-1] == pytest.approx(here, abs=1.0), "held where it is at the end"


def test_the_gripper_follows_the_page_once_its_slider_was_moved(rig):
    """What the page showed before is no command; the page takes over where the gripper is."""
    low, high = RANGES[5]
    shown: list[float | None] = []

    def move(t: float) -> None:
        step = round(t / session.CYCLE)
        if step == 10:
            shown.append(rig.page.gripper)
            assert rig.goals(6) == [], "it has no goal yet"
        if step == 20:
            rig.page.gripper = 0.9

    rig.clock.each = move
    rig.drive(CALIBRATIONS["full turn"])
    assert rig.said == ""
    assert shown == [pytest.approx((START[5] - low) / (high - low), abs=1e-3)]
    assert rig.line.servos[6].position == pytest.approx(low + 0.9 * (high - low), abs=1.0)
    goals = [START[5], *rig.goals(6)]
    assert np.abs(np.diff(goals)).max() <= 0.5 * (high - low) * session.CYCLE + 1.0
    rig.clock.each = lambda _: None
    rig.drive(CALIBRATIONS["full turn"])
    assert rig.page.gripper == pytest.approx(0.9, abs=2e-3), "taken over again"
    assert rig.goals(6)[-1] == goals[-1]


def test_a_typed_opening_is_that_of_the_page(rig):
    rig.typed.put("enable")
    rig.drive(CALIBRATIONS["full turn"], word="gripper 40")
    assert rig.page.gripper == 0.4
    low, high = RANGES[5]
    assert rig.line.servos[6].position == pytest.approx(low + 0.4 * (high - low), abs=1.0)
    rig.page.gripper = None  # an arm that is drawn without a gripper
    rig.typed.put("enable")
    rig.drive(CALIBRATIONS["full turn"], word="gripper 60")
    assert rig.page.gripper is None
    assert rig.line.servos[6].position == pytest.approx(low + 0.6 * (high - low), abs=1.0)


@pytest.mark.parametrize(
    ("supply", "words"),
    [
        ((120, 28), "gets 12.0 V, expected 4.0 to 8.0 V: is this the arm's own power supply?"),
        ((74, 71), "is at 71 °C, expected less than 70 °C: switch the arm's power off, and let it cool"),
    ],
)
def test_a_servo_that_is_not_fit_to_move_is_named(rig, supply, words):
    rig.line.servos[4].put(VOLTAGE, bytes(supply))
    rig.drive(CALIBRATIONS["full turn"])
    assert f"motor 4 (wrist_flex) {words}" in rig.said
    assert rig.line.written == []


def test_servos_of_another_baud_rate_are_found(rig):
    rig.line.baud = 115_200
    rig.drive(CALIBRATIONS["full turn"])
    assert "motor 1 (shoulder_pan) talks at 115200 baud, expected 1000000. lerobot-setup-motors sets" in rig.said
    assert rig.line.written == []


# The guide of all programs that drive an arm


@pytest.fixture
def clock(monkeypatch) -> Iterator[Clock]:
    clock = Clock(Line({}))
    monkeypatch.setattr(driving, "time", clock)
    monkeypatch.setattr(driving, "PAGE_LOST", 1e6)
    return clock


def guided(page: Page, measured: np.ndarray, speed: float = 20.0, **options: Any) -> driving.Guide:
    guide = driving.Guide(page, "arm", speed, measured, **options)
    guide.end()
    return guide


def test_after_a_pause_nothing_is_caught_up(clock):
    page = Page(ARM)
    guide = guided(page, ARM.q_home)
    page.q = ARM.q_home + 0.5
    clock.sleep(5.0)  # the machine was busy
    moved = np.abs(guide.step(ARM.q_home, clock.now) - ARM.q_home)
    assert 0.0 < moved.max() <= np.radians(20.0) * driving.LATEST + 1e-12


def test_no_joint_is_faster_than_its_arm_allows(clock):
    slow = replace(ARM, rows=tuple(replace(row, velocity=0.05) for row in ARM.rows))
    page = Page(slow)
    guide = guided(page, ARM.q_home, speed=200.0)
    page.q = ARM.q_home + 0.3
    clock.sleep(0.02)
    assert np.abs(guide.step(ARM.q_home, clock.now) - ARM.q_home).max() == pytest.approx(0.05 * 0.02)


def test_a_joint_that_was_measured_outside_its_limits_waits_and_never_goes_farther(clock):
    outside = ARM.upper + np.radians([5.0, 0.0, -9.0, -9.0, -9.0])
    page = Page(ARM)
    guide = guided(page, outside)
    for _ in range(20):
        clock.sleep(0.02)
        assert guide.step(outside, clock.now).tolist() == outside.tolist()
    page.q = page.q + np.radians([0.0, -10.0, 0.0, 0.0, 0.0])
    for _ in range(50):
        clock.sleep(0.02)
        asked = guide.step(guide.asked, clock.now)
    assert asked[0] == outside[0], "it is another joint that was commanded"
    assert asked[1] == pytest.approx(outside[1] - np.radians(10.0))
    page.q = page.q + np.radians([3.0, 0.0, 0.0, 0.0, 0.0])  # a page would not show this
    before = asked
    for _ in range(50):
        clock.sleep(0.02)
        asked = guide.step(guide.asked, clock.now)
        assert asked[0] <= before[0]
        before = asked


def test_an_arm_that_has_given_way_begins_where_it_is(clock):
    page = Page(ARM)
    guide = guided(page, ARM.q_home)
    sunk = ARM.q_home + np.radians([0.0, 4.0, 0.0, 0.0, 0.0])
    for _ in range(20):
        clock.sleep(0.02)
        assert guide.step(sunk, clock.now).tolist() == ARM.q_home.tolist(), "nothing is asked for yet"
    page.q = ARM.q_home + np.radians([30.0, 0.0, 0.0, 0.0, 0.0])
    clock.sleep(0.02)
    asked = guide.step(sunk, clock.now)
    assert asked[1:].tolist() == sunk[1:].tolist()
    assert 0.0 < asked[0] - sunk[0] <= np.radians(20.0) * 0.02 + 1e-12


def test_noise_and_a_command_that_turns_round_are_no_reason_to_stop(clock):
    """Encoders that read a tick more or less, a servo that follows 0.1 s late, for two minutes."""
    page, rng = Page(ARM), np.random.default_rng(5)
    guide = guided(page, ARM.q_home, speed=60.0)
    late = [ARM.q_home] * 5
    for k in range(6000):
        clock.sleep(0.02)
        if k % 23 == 0:
            page.q = ARM.clip(ARM.q_home + rng.uniform(-0.5, 0.5, 5))
        late = [*late[1:], guide.step(late[0] + rng.integers(-1, 2, 5) * np.radians(0.088), clock.now)]


# From ticks to joint values and back


@st.composite
def arms(draw: st.DrawFn) -> tuple[kin.Robot, np.ndarray]:
    """An SO-101 with any calibration, and where its servos are."""
    motors, ticks = [], []
    for motor in ARM.motors[:5]:
        low = draw(st.sampled_from([0, 1, 40, 900]))
        high = draw(st.sampled_from([4095, 4094, 4060, 3000]))
        unit = draw(st.sampled_from(UNITS))
        offset = draw(st.sampled_from([0.0, 1.0, -95.0, 170.0, 181.0]))
        if unit not in ("deg", "rad"):
            offset = 0.1 * offset
        motors.append(
            replace(
                motor,
                range=(low, high),
                unit=unit,
                offset=np.radians(offset) if unit == "rad" else offset,
                sign=draw(st.sampled_from([1, -1])),
                drive_mode=draw(st.sampled_from([0, 1])),
            )
        )
        ticks.append(draw(st.integers(low, high)))
    return replace(ARM, motors=tuple(motors)), np.array(ticks, dtype=float)


@settings(max_examples=50)
@given(arms())
def test_ticks_and_joint_values_are_in_a_straight_line(drawn):
    robot, ticks = drawn
    scale = Scale(robot, robot.motors, ticks)
    q = scale.q(ticks)
    assert scale.ticks(q).tolist() == ticks.tolist(), "where it is, nothing moves"
    read = kin.motors.q_from_readings(robot, kin.motors.readings_from_ticks(robot.motors, ticks))
    turns = (read - q) / (2.0 * np.pi)
    assert turns == pytest.approx(np.round(turns), abs=1e-9), "the same place as the mirror shows"
    inside = (read >= robot.lower) & (read <= robot.upper)
    assert q[inside] == pytest.approx(read[inside], abs=1e-9), "and the same value, if it is inside the limits"
    low, high = scale.limits
    ends = np.array([motor.range for motor in robot.motors], dtype=float).T
    for end in (low, high):
        assert (np.abs(scale.ticks(end) - ends).min(axis=0) <= 1).all()
    assert (low <= q + 1e-9).all()
    assert (q <= high + 1e-9).all()
    grid = np.array([scale.ticks(low + part * (high - low)) for part in np.linspace(0.0, 1.0, 21)])
    steps = np.diff(grid, axis=0)
    assert ((steps > 0).all(axis=0) | (steps < 0).all(axis=0)).all(), "never back by a turn"


# The simulated arm of the command


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("missing=3", r"motor 3 \(elbow_flex\) does not answer"),
        ("kind=2", r"motor 2 \(shoulder_lift\) is of model 1284"),
        ("overload=5,stuck=1", r"motor 5 \(wrist_roll\) reports an error: overload"),
        ("baud=115200", "talks at 115200 baud"),
        ("volts=12", r"gets 12\.0 V, expected 4\.0 to 8\.0 V"),
        ("celsius=75", "is at 75 °C, expected less than 70 °C"),
    ],
)
def test_a_simulated_arm_has_the_faults_that_are_asked_for(fault, words):
    port = f"sim:{fault}"
    bus = Bus(port)
    robot = Calibration(None, port).applied(ARM)
    with pytest.raises(kin.KinematicsError, match=words):
        bus.check(robot.motors)


def test_a_simulated_servo_that_is_stuck_answers():
    port = "sim:stuck=1"
    robot = Calibration(None, port).applied(ARM)
    assert "6 servos answer at sim:stuck=1" in Bus(port).check(robot.motors)


@pytest.mark.parametrize(
    "fault", ["fire", "missing", "missing=7", "missing=0", "volts=-1", "baud=٣", "stuck=1,", "celsius=1e9"]
)
def test_a_fault_that_there_is_not_is_refused_with_what_there_is(fault):
    with pytest.raises(
        kin.InputError, match=r"^--port: got '?sim:.*, expected (sim, or sim: and faults of|\w+=N, )"
    ):
        Bus(f"sim:{fault}")
