"""Databases of earlier versions: a room that was open before an update is there after it, and all in it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from postgres_server import Postgres, running
from sqlalchemy import Connection, MetaData, create_engine, event, insert, select
from test_hub import attempt, nothing, until

from app.classroom import Hub, Ticket, clock, database
from app.classroom.revisions import REVISIONS
from app.classroom.tables import REVISION, Attempt, Base

MIGRATIONS = Path(database.__file__).parent / "migrations"
FIRST = "0001"


@pytest.fixture(scope="module")
def server() -> Iterator[Postgres]:
    with running() as server:
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def hub(request, tmp_path) -> Iterator[Hub]:
    """A hub that has not opened its database yet, which is new."""
    url = None
    if request.param == "postgresql":
        url = request.getfixturevalue("server").create()
    hub = Hub(tmp_path, url)
    yield hub
    hub.close()


@pytest.fixture
def old(hub) -> Iterator[Connection]:
    """A connection to the database of the hub, at the first revision."""
    engine = create_engine(hub.database._url)
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", lambda raw, _: raw.execute("PRAGMA foreign_keys=ON"))
    with engine.connect() as connection:
        with connection.begin():
            command.upgrade(config(connection), FIRST)
        yield connection
    engine.dispose()


def config(connection: Connection) -> Config:
    made = Config()
    made.set_main_option("script_location", str(MIGRATIONS))
    made.attributes["connection"] = connection
    return made


def fill(connection: Connection, now: float) -> None:
    """A class in progress, in the tables that this database has: a room, two students, one of them removed."""
    tables = MetaData()
    tables.reflect(connection)
    room = {
        "id": "room1",
        "code": "KVNWZTRB",
        "title": "Kinematics – übung",
        "created": now - 600,
        "ends": now + 3000,
        "version": 7,
        "state": {"follow": True, "task": {"exercise": "two-elbows", "at": now - 60}},
        "page": "arm",
        "beat": 5,
    }
    seat = {
        "id": "seat1",
        "room_id": "room1",
        "alias": "Ada",
        "joined": now - 500,
        "hand": now - 5,
        "task": "two-elbows",
        "tries": 2,
        "solved": False,
        "voted": "",
        "vote": 0,
        "page": "mine",
        "beat": 4,
        "version": 6,
        "removed": False,
    }
    answer = {
        "id": "attempt1",
        "room_id": "room1",
        "seat_id": "seat1",
        "exercise": "two-elbows",
        "seed": 2**48 + 1,
        "answer": ["30", {"θ": 0.5}],
        "verdict": "Half of it.",
        "score": 0.5,
        "started": now - 60,
        "at": now - 30,
    }
    connection.execute(insert(tables.tables["setting"]), {"name": "key", "value": "ab" * 32})
    connection.execute(insert(tables.tables["room"]), room)
    connection.execute(insert(tables.tables["seat"]), [seat, seat | {"id": "seat2", "alias": "", "removed": True}])
    connection.execute(insert(tables.tables["attempt"]), answer)


@pytest.mark.full
def test_a_class_of_the_first_version_goes_on_after_all_migrations(hub, old) -> None:
    with old.begin():
        fill(old, clock.now())
        before = contents(old)
    steps = [step.revision for step in ScriptDirectory.from_config(config(old)).walk_revisions()]
    assert steps[0] == REVISION
    for step in steps[-2::-1]:  # as if every version had been installed in turn
        with old.begin():
            command.upgrade(config(old), step)
            after = contents(old)
        for table, rows in before.items():
            kept = [{name: row[name] for name in rows[0]} for row in after[table]]
            assert kept == rows, (step, table)
    goes_on(hub)


@pytest.mark.full
@pytest.mark.parametrize("revision", REVISIONS[:-1])
def test_the_service_migrates_a_class_of_each_earlier_version(hub, old, revision) -> None:
    with old.begin():
        command.upgrade(config(old), revision)
        fill(old, clock.now())
    goes_on(hub)
    with old.begin():
        context = MigrationContext.configure(old, opts={"compare_type": True})
        assert context.get_current_revision() == REVISION
        assert compare_metadata(context, Base.metadata) == []


def contents(connection: Connection) -> dict[str, list[dict[str, object]]]:
    """All rows by table, in the order of their keys."""
    tables = MetaData()
    tables.reflect(connection)
    return {
        table.name: [
            dict(row) for row in connection.execute(select(table).order_by(*table.primary_key)).mappings()
        ]
        for table in tables.sorted_tables
        if table.name != "alembic_version"
    }


def goes_on(hub: Hub) -> None:
    """The teacher and the student come back; another one joins; what is stored is read, added to, and erased."""
    assert hub.database.key() == "ab" * 32
    teacher = hub.attend(Ticket("room1"), nothing)
    student = hub.attend(Ticket("room1", "seat1"), nothing)
    until(lambda: teacher.room.seats)
    assert [(seat.alias, seat.page, seat.work["two-elbows"].tries) for seat in teacher.room.seats] == [
        ("Ada", "mine", 1)
    ]
    hub.rooms.join("KVNWZTRB", "Emmy")
    confirmed = student.submit(attempt())
    until(lambda: {seat.alias for seat in teacher.room.seats} == {"Ada", "Emmy"})
    with hub.database.read() as connection:
        stored = {row.id: row for row in connection.execute(select(Attempt))}
    assert set(stored) == {"attempt1", confirmed.id}
    assert stored["attempt1"].seed == 2**48 + 1
    assert json.dumps(stored["attempt1"].answer, ensure_ascii=False) == '["30", {"θ": 0.5}]'
    teacher.end_room()
    until(lambda: student.room.closed)
    with hub.database.read() as connection:
        for table in Base.metadata.sorted_tables:
            assert table.name == "setting" or connection.execute(select(table)).all() == [], table.name
