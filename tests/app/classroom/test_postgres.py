"""Rooms over PostgreSQL, as several machines share them: Debian's server, started for these tests."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from postgres_server import Postgres, running
from sqlalchemy import create_engine, select
from test_hub import attempt, nothing, until

from app.classroom import ClassroomUnavailable, Hub, RefusedError, Ticket
from app.classroom.tables import Attempt, Base, Room, Seat


@pytest.fixture(scope="module")
def server() -> Iterator[Postgres]:
    with running() as server:
        yield server


@pytest.fixture
def database(server) -> str:
    """A new database's URL."""
    return server.create()


@pytest.fixture
def hubs(database, tmp_path):
    """Two hubs, as two machines have them."""
    pair = Hub(tmp_path, database), Hub(tmp_path, database)
    yield pair
    for hub in pair:
        hub.close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
def test_a_class_goes_on_at_another_machine(hubs):
    """As when the proxy sends its pages to another container."""
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    pages = [here.attend(each, nothing) for each in (Ticket(room.id), here.rooms.join(room.code, "Ada"))]
    pages[0].set_follow(True)
    pages[0].tell_page("live")
    pages[0].open_poll("Elbow?", ["up", "down"])
    pages[1].vote(1)
    pages[1].tell_page("mine")
    confirmed = pages[1].submit(attempt())
    until(lambda: pages[0].room.seats[0].page == "mine")
    teacher, student = (there.attend(page.ticket, nothing) for page in pages)
    until(lambda: teacher.room == pages[0].room)  # what is being stored is seen there once it is
    assert student.room.page == "live"
    for page in pages:
        page.leave()
    student.raise_hand(True)
    assert teacher.room.seats[0].hand > 0
    with here.database.read() as connection:
        assert connection.scalars(select(Attempt.id)).all() == [confirmed.id]
    teacher.end_room()
    assert student.room.closed
    with here.database.read() as connection:
        for table in Base.metadata.sorted_tables:
            rows = connection.execute(select(table)).all()
            assert table.name == "setting" or rows == [], table.name


@pytest.mark.full
def test_a_row_that_another_program_keeps_locked_holds_up_its_room_alone(hubs, monkeypatch):
    monkeypatch.setattr("app.classroom.database.WAIT", 0.3)
    hub, _ = hubs
    held, free = (hub.attend(Ticket(hub.rooms.open(title, 3600).id), nothing) for title in ("Held", "Free"))

    def frozen(page):
        with hub.database.read() as connection:
            return connection.scalar(select(Room.state).where(Room.id == page.ticket.room)).get("frozen")

    engine = create_engine(hub.database._url)
    with engine.begin() as other:
        other.execute(select(Room.id).where(Room.id == held.ticket.room).with_for_update())
        held.set_frozen(True)
        until(lambda: held.room.problem)
        free.set_frozen(True)
        until(lambda: frozen(free))
        assert not free.room.problem
    engine.dispose()
    until(lambda: frozen(held) and not held.room.problem)


@pytest.mark.full
def test_a_value_that_the_server_refuses_concerns_its_room_alone(hubs):
    hub, _ = hubs
    bad, well = (hub.rooms.open(title, 3600) for title in ("Bad", "Well"))
    student = hub.attend(hub.rooms.join(bad.code, "Ada"), nothing)
    other = hub.attend(hub.rooms.join(well.code, "Bob"), nothing)
    with pytest.raises(RefusedError, match="cannot be stored"):
        student.submit(attempt(verdict="half\0way"))
    confirmed = student.submit(attempt())
    student.tell_task("no\0thing")
    until(lambda: student.room.problem)
    assert "cannot be stored" in student.room.problem
    other.tell_task("swing")

    def task_stored() -> object:
        with hub.database.read() as connection:
            return connection.scalar(select(Seat.task).where(Seat.id == other.ticket.seat))

    until(lambda: task_stored() == "swing")
    with hub.database.read() as connection:
        assert connection.scalars(select(Attempt.id)).all() == [confirmed.id]
    assert not other.room.problem


@pytest.mark.full
def test_two_machines_that_write_at_the_same_time_lose_nothing(hubs):
    here, there = hubs
    room = here.rooms.open("Kinematics", 3600)
    with ThreadPoolExecutor(8) as pool:
        seats = list(pool.map(lambda k: hubs[k % 2].rooms.join(room.code, f"Student {k}"), range(30)))
        pages = [hubs[k % 2].attend(seat, nothing) for k, seat in enumerate(seats)]
        confirmed = list(pool.map(lambda k: pages[k % 30].submit(attempt(seed=k)), range(90)))
    for k, page in enumerate(pages):
        page.tell_page(f"page {k}")
    teacher = here.attend(here.ticket(room.token), nothing)
    until(lambda: [seat.page for seat in teacher.room.seats].count("") == 0)
    assert {seat.page for seat in teacher.room.seats} == {f"page {k}" for k in range(30)}
    assert {work.tries for seat in teacher.room.seats for work in seat.work.values()} == {3}
    with there.database.read() as connection:
        assert set(connection.scalars(select(Attempt.id))) == {each.id for each in confirmed}


def test_machines_that_start_at_the_same_time_migrate_once(database, tmp_path):
    hubs = [Hub(tmp_path, database) for _ in range(6)]
    with ThreadPoolExecutor(6) as pool:
        rooms = list(pool.map(lambda hub: hub.rooms.open("Kinematics", 3600), hubs))
    assert len({room.code for room in rooms}) == 6
    assert len({hub.rooms.tokens.sign(Ticket("x")) for hub in hubs}) == 1
    with hubs[0].database.read() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    for hub in hubs:
        hub.close()


def test_a_server_that_dies_and_comes_back(hubs, server):
    hub, _ = hubs
    room = hub.rooms.open("Kinematics", 3600)
    teacher = hub.attend(hub.ticket(room.token), nothing)
    student = hub.attend(hub.rooms.join(room.code, "Ada"), nothing)
    first = student.submit(attempt())
    server.stop()
    try:
        with pytest.raises(ClassroomUnavailable, match="cannot be reached"):
            student.submit(attempt())
        teacher.set_frozen(True)
        until(lambda: teacher.room.problem and student.room.problem)
        assert not student.room.closed
    finally:
        server.start()
    until(lambda: student.room.frozen and not student.room.problem)
    second = student.submit(attempt())
    with hub.database.read() as connection:
        assert set(connection.scalars(select(Attempt.id))) == {first.id, second.id}
