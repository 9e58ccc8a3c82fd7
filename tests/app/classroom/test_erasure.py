"""Ended means erased: no byte of an alias or answer is left in any file of the folder, or no page says so."""

from __future__ import annotations

import asyncio
import random
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from live_server import wait_for
from postgres_server import running
from sqlalchemy import insert, select, update
from stored_bytes import stored_bytes
from test_hub import nothing, until

from app.classroom import COOKIE, Hub, NewAttempt, erasure
from app.classroom.hub import DATABASE_FILE
from app.classroom.tables import LtiSeat, Seat, Setting
from app.classroom.views import DELETED, ERASED, ERASING
from app.service.main import create_app
from app.service.web.rooms import sweeping
from app.shared.settings import Settings
from app.shared.store import Store

STORE = Store()
SECRETS = ("Ada Lovelace 7361", "Emmy Noether 4482", "answer 90125", "Kinematics 55173", "page 33871", "why 81272")


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[Hub]:
    hub = Hub(tmp_path)
    yield hub
    hub.close()


def left(folder: Path, *secrets: str) -> set[str]:
    """Which of these are in any file of the folder."""
    stored = stored_bytes(folder)
    return {each for each in secrets or SECRETS if each.encode() in stored}


@contextmanager
def reader(folder: Path) -> Iterator[sqlite3.Connection]:
    """Another program in the middle of reading the database."""
    connection = sqlite3.connect(folder / DATABASE_FILE, isolation_level=None)
    try:
        connection.execute("BEGIN")
        assert connection.execute("SELECT count(*) FROM seat").fetchone()
        yield connection
    finally:
        connection.close()


def a_class(hub: Hub):
    """A room with two students and an answer: the ids of room and first seat."""
    room = hub.rooms.open(SECRETS[3], 3600.0)
    seats = [hub.rooms.join(room.code, alias) for alias in SECRETS[:2]]
    hub.rooms.submit(seats[0], NewAttempt("swing", 1, [SECRETS[2]], SECRETS[5], 1.0, 0.0))
    page = hub.attend(seats[0], nothing)
    page.tell_page(SECRETS[4])
    until(lambda: left(hub.folder) == set(SECRETS))
    page.leave()
    return room, seats


def test_an_ended_room_is_erased_at_once_if_nobody_reads(hub, tmp_path) -> None:
    room, _ = a_class(hub)
    assert hub.rooms.end(room.id)
    assert left(tmp_path) == set()
    assert hub.rooms.said_of_ended() == ERASED


@pytest.mark.full
@pytest.mark.parametrize("seen", ["before", "after"])
def test_a_reader_delays_the_erasing_and_nothing_is_called_erased_before(hub, tmp_path, seen) -> None:
    """A reader that sees the room as it was, or one that only keeps the log from being emptied."""
    room, seats = a_class(hub)
    student = hub.attend(seats[0], nothing)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    with reader(tmp_path) as other:
        teacher.end_room()
        if seen == "after":
            other.execute("COMMIT")
            other.execute("BEGIN")
            assert other.execute("SELECT count(*) FROM seat").fetchone() == (0,)
        assert not hub.rooms.erase()
        assert left(tmp_path)
        assert hub.rooms.said_of_ended() == ERASING
        until(lambda: student.room.closed == ERASING)
        began = time.monotonic()
        assert hub.rooms.open("Another", 3600.0)
        assert time.monotonic() - began < 2.0, "writers do not wait for the reader"
    assert hub.rooms.erase()
    assert left(tmp_path) == set()
    until(lambda: student.room.closed == teacher.room.closed == ERASED)


def test_who_is_removed_or_renamed_is_erased(hub, tmp_path) -> None:
    room, seats = a_class(hub)
    with hub.database.write() as connection:
        row = {"id": "x", "seat_id": seats[0].seat, "issuer": "i", "client_id": "c", "subject": "subject 61526"}
        connection.execute(insert(LtiSeat).values(**row, address="", exercise=""))
    page = hub.attend(seats[0], nothing)
    until(lambda: page.room.seat is not None)
    page.tell_driven("SO-101 of bench 41877")
    until(lambda: left(tmp_path, "SO-101 of bench 41877"))
    page.leave()
    hub.rooms.rename_seat(room.id, seats[1].seat, "E.")
    assert left(tmp_path, SECRETS[1]) == set()
    with reader(tmp_path):
        hub.rooms.remove_seat(room.id, seats[0].seat)
        assert left(tmp_path, SECRETS[0]) == {SECRETS[0]}
    assert hub.rooms.erase()
    assert left(tmp_path) == {SECRETS[3]}, "the title stays"
    assert left(tmp_path, "subject 61526", "SO-101 of bench 41877") == set()
    again = hub.rooms.join(room.code, SECRETS[0])
    hub.rooms.join(room.code, "A.", again)
    hub.rooms.sweep()
    assert left(tmp_path) == {SECRETS[3]}


def test_the_next_process_erases_what_an_earlier_one_could_not(tmp_path, caplog) -> None:
    first = Hub(tmp_path)
    room, _ = a_class(first)
    with reader(tmp_path):
        first.rooms.end(room.id)
        first.close()
        second = Hub(tmp_path)
        second.rooms.sweep()
        assert second.rooms.said_of_ended() == ERASING
    second.rooms.sweep()
    assert second.rooms.said_of_ended() == ERASED
    second.close()
    assert left(tmp_path) == set()


def test_what_is_deleted_while_the_log_is_emptied_is_not_called_erased(hub, tmp_path, monkeypatch) -> None:
    """A note that came after the checkpoint has begun stays."""
    room, seats = a_class(hub)
    forget = erasure.forget

    def another_first(connection, value: str) -> None:
        monkeypatch.setattr(erasure, "forget", forget)
        erasure.note(connection)
        forget(connection, value)

    monkeypatch.setattr(erasure, "forget", another_first)
    hub.rooms.remove_seat(room.id, seats[0].seat)
    assert hub.rooms.said_of_ended() == ERASING
    assert hub.rooms.erase()
    assert hub.rooms.said_of_ended() == ERASED


@pytest.mark.full
def test_a_long_lesson_leaves_nothing(hub, tmp_path) -> None:
    """Rows that grow, move and are split over pages of the file, in an order that chance says."""
    chance = random.Random(7)
    room = hub.rooms.open("Class", 3600.0)
    texts = [f"{chance.getrandbits(64):016x}" for _ in range(300)]
    rest = iter(texts)
    seats = [hub.rooms.join(room.code, next(rest)) for _ in range(40)]
    for text in rest:
        seat = chance.choice(seats)
        match chance.randrange(3):
            case 0:
                hub.rooms.join(room.code, text, seat)
            case 1:
                hub.rooms.submit(seat, NewAttempt("swing", 1, [text * chance.randrange(1, 400)], text, 0.0, 0.0))
            case _:
                with hub.database.write(durable=False) as connection:
                    page = text * chance.randrange(1, 900)
                    connection.execute(update(Seat).where(Seat.id == seat.seat).values(page=page))
    assert len(left(tmp_path, *texts)) > 100
    hub.rooms.end(room.id)
    assert hub.rooms.said_of_ended() == ERASED
    assert left(tmp_path, *texts) == set()


def test_the_page_says_erased_when_it_is(tmp_path) -> None:
    application = create_app(Settings(data=tmp_path), STORE)  # type: ignore[call-arg]
    browser = TestClient(application, follow_redirects=False, base_url="http://school.example")
    hub = application.state.classroom
    assert browser.get("/room/ended").status_code == 200, "without a database"
    room, _ = a_class(hub)
    browser.get(f"/room/teach/{room.token}")
    assert browser.cookies[COOKIE]
    with reader(tmp_path):
        answer = browser.post("/room/end")
        assert ERASING in answer.text
        assert ERASED not in answer.text
        assert answer.headers["refresh"].endswith("url=ended")
        assert ERASING in browser.get("/room/ended").text
    hub.rooms.erase()
    answer = browser.get("/room/ended")
    assert ERASED in answer.text
    assert "refresh" not in answer.headers
    hub.close()


def read_for(folder: Path, seconds: float) -> subprocess.Popen[str]:
    """A program that reads the database for so long, and says when it has begun."""
    code = (
        "import sqlite3, sys, time; c = sqlite3.connect(sys.argv[1], isolation_level=None); c.execute('BEGIN'); "
        "print(c.execute('SELECT count(*) FROM seat').fetchone()[0], flush=True); time.sleep(float(sys.argv[2]))"
    )
    command = [sys.executable, "-c", code, str(folder / DATABASE_FILE), str(seconds)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize("seconds", [3.0, pytest.param(60.0, marks=pytest.mark.slow)])
def test_a_service_erases_as_soon_as_the_reader_lets_go(tmp_path, monkeypatch, caplog, seconds) -> None:
    monkeypatch.setitem(sweeping.__wrapped__.__globals__, "ERASE_EVERY", 0.2)  # type: ignore[attr-defined]
    application = create_app(Settings(data=tmp_path), STORE)  # type: ignore[call-arg]
    hub = application.state.classroom
    room, _ = a_class(hub)
    stop = threading.Event()

    def sweeps() -> None:
        async def run() -> None:
            async with sweeping(hub):
                while not stop.is_set():
                    await asyncio.sleep(0.02)

        asyncio.run(run())

    thread = threading.Thread(target=sweeps)
    with read_for(tmp_path, seconds) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "2\n"
        thread.start()
        try:
            hub.rooms.end(room.id)
            found = ERASING, set(SECRETS)
            while program.poll() is None:  # what was found before that
                assert found[0] == ERASING
                assert found[1], "the file still has what the program reads"
                found = hub.rooms.said_of_ended(), left(tmp_path)
                time.sleep(0.1)
            wait_for(lambda: hub.rooms.said_of_ended() == ERASED, 20)
            assert left(tmp_path) == set()
            wait_for(lambda: "is erased from the database's files" in caplog.text)
        finally:
            stop.set()
            thread.join()
    assert caplog.text.count("another program reads them") == 1, "one line, however often it is tried"


@pytest.mark.full
def test_postgres_deletes_and_nothing_is_called_erased(tmp_path) -> None:
    with running() as server:
        hub = Hub(tmp_path, server.create())
        room = hub.rooms.open("Class", 3600.0)
        student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
        hub.rooms.end(room.id)
        assert hub.rooms.said_of_ended() == DELETED
        assert hub.rooms.erase(), "there is nothing to be tried again"
        until(lambda: student.room.closed == DELETED)
        with hub.database.read() as connection:
            assert set(connection.scalars(select(Setting.name))) <= {"key", "clock"}
        hub.close()
