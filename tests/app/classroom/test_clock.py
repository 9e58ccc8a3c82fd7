"""The time of rooms on machines whose clock is set, with processes that start before and after that."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import TypeVar

import pytest

from app.classroom import Hub, Ticket, UnknownRoomError, clock
from app.classroom.rooms import Rooms

T = TypeVar("T")
HOUR, YEAR = 3600.0, 365 * 24 * 3600.0
TODAY = 1.8e9


class Machine:
    """A machine that runs no faster than a test says, with a clock that can be set."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.wall, self.steady, self.boot = TODAY, 1000.0, "first"
        self._folder = folder
        self.processes: list[Process] = []
        read = SimpleNamespace(
            time=lambda: self.wall,
            monotonic=lambda: self.steady,
            clock_gettime=lambda _: self.steady,
            CLOCK_BOOTTIME=7,
        )
        monkeypatch.setattr(clock, "time", read)
        monkeypatch.setattr(clock, "_boot", lambda: self.boot)
        monkeypatch.setattr(clock._Count, "start", None)

    def process(self) -> Process:
        self.processes.append(Process(Hub(self._folder)))
        return self.processes[-1]

    def wait(self, seconds: float) -> None:
        self.wall += seconds
        self.steady += seconds

    def start_anew(self, wall: float) -> None:
        """Switched off and on; all processes have ended."""
        self.wall, self.steady, self.boot = wall, 20.0, self.boot + "+"


class Process:
    """A process of the service, or a command: it has a count of the time and a connection of its own."""

    def __init__(self, hub: Hub) -> None:
        self.hub = hub
        self._start: float | None = None

    def do(self, act: Callable[[Rooms], T]) -> T:
        clock._Count.start = self._start
        try:
            clock.now()  # as a service does when it starts
            return act(self.hub.rooms)
        finally:
            self._start = clock._Count.start

    def sees(self, room: str) -> bool:
        return self.do(lambda rooms: rooms.is_open(Ticket(room)))

    def sweep(self) -> int:
        return self.do(lambda rooms: rooms.sweep())

    def open(self, life: float = HOUR) -> str:
        return self.do(lambda rooms: rooms.open("Kinematics", life)).id


@pytest.fixture
def machine(tmp_path, monkeypatch):
    made = Machine(tmp_path, monkeypatch)
    yield made
    for process in made.processes:
        process.hub.close()


@pytest.mark.parametrize("jump", [10 * YEAR, 2 * HOUR, -2 * HOUR, -50 * YEAR])
def test_a_full_restart_after_the_clock_was_set_neither_ends_rooms_nor_keeps_them(machine, jump):
    room = machine.process().open()
    machine.wait(600)
    machine.wall += jump
    service = machine.process()
    assert service.sees(room)
    assert service.sweep() == 0
    machine.wait(HOUR - 601)
    assert service.sees(room)
    machine.wait(2)
    assert not service.sees(room)
    assert machine.process().sweep() == 1


@pytest.mark.parametrize("jump", [10 * YEAR, -10 * YEAR])
def test_a_command_counts_as_the_service_that_runs(machine, jump):
    service = machine.process()
    service.open(2 * HOUR)
    machine.wait(60)
    machine.wall += jump
    command = machine.process()
    room = command.open()
    assert service.sees(room)
    machine.wait(HOUR - 1)
    assert service.sees(room)
    machine.wait(2)
    assert not service.sees(room)
    assert not command.sees(room)


@pytest.mark.parametrize("jump", [10 * YEAR, -10 * YEAR])
def test_a_service_without_rooms_follows_the_one_that_opens_the_first(machine, jump):
    service = machine.process()
    service.do(lambda rooms: rooms.end(service.open()))
    machine.wall += jump
    room = machine.process().open()
    assert service.sweep() == 0
    assert service.sees(room)
    machine.wait(HOUR + 1)
    assert service.sweep() == 1


def test_a_machine_whose_clock_is_behind_after_a_new_start_counts_on(machine):
    service = machine.process()
    room = service.open()
    machine.wait(600)
    service.sweep()  # as once a minute
    for _ in range(4):
        machine.start_anew(wall=0.0)
        service, other = machine.process(), machine.process()
        assert service.sees(room)
        machine.wait(600)
        assert other.sees(room)
        assert (service.sweep(), other.sweep()) == (0, 0)
        assert service.do(lambda _: clock.now()) == pytest.approx(other.do(lambda _: clock.now()), abs=1e-3)
    machine.start_anew(wall=0.0)
    service = machine.process()
    assert service.sees(room)
    machine.wait(601)
    assert not service.sees(room)
    assert service.sweep() == 1


def test_a_room_whose_time_has_passed_while_the_machine_was_off_is_erased(machine):
    room = machine.process().open()
    machine.start_anew(machine.wall + 24 * HOUR)
    service = machine.process()
    assert not service.sees(room)
    assert service.sweep() == 1
    with pytest.raises(UnknownRoomError):
        service.do(lambda rooms: rooms.join("KVNWZTRB", "Ada"))


def test_a_clock_that_was_far_ahead_is_forgotten_with_the_last_room(machine):
    machine.wall = TODAY + 50 * YEAR
    service = machine.process()
    service.do(lambda rooms: rooms.end(service.open()))
    machine.wall = TODAY
    service = machine.process()
    opened = service.do(lambda rooms: rooms.open("Kinematics", HOUR))
    assert opened.created == pytest.approx(TODAY, abs=1)
    machine.start_anew(TODAY + 60)
    service = machine.process()
    assert service.sees(opened.id)
    assert service.do(lambda _: clock.now()) == pytest.approx(TODAY + 60, abs=1)


def test_the_kernel_names_its_start(monkeypatch):
    assert clock.mark().boot == clock.mark().boot
    assert clock.is_of_this_start(clock.mark())
    assert not clock.is_of_this_start(clock.Mark(TODAY, 0.0, ""))
    assert not clock.is_of_this_start(clock.Mark(TODAY, 0.0, "other"))
