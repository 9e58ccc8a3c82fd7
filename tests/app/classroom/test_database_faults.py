"""Databases that are of a newer version, have gone, or cannot be made: every page of rooms says so with 503."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest
from alembic.config import Config
from alembic.script import ScriptDirectory
from fastapi.testclient import TestClient
from postgres_server import running
from sqlalchemy import create_engine, text

from app.classroom import COOKIE, ClassroomUnavailable, Hub, database
from app.classroom.hub import DATABASE_FILE
from app.classroom.revisions import REVISIONS, revision_of
from app.service import main
from app.service.main import create_app
from app.service.web.rooms import sweeping
from app.shared.settings import Settings
from app.shared.store import Store

STORE = Store()
NEWER = "written by a newer version of Kinboard"
PAGES = [
    ("GET", "/room"),
    ("GET", "/room/results"),
    ("GET", "/room/results.csv"),
    ("GET", "/room/qr.svg"),
    ("GET", "/room/teach/{}"),
    ("POST", "/room"),
    ("POST", "/room/join"),
    ("POST", "/room/end"),
]
FORM = {"hours": "2", "code": "ACDEFGHJ", "alias": "Ada"}


def make_newer(file: Path) -> None:
    with contextlib.closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '0099'")


@pytest.fixture
def teacher(tmp_path: Path) -> Iterator[TestClient]:
    """The browser of a teacher whose room is open."""
    application = create_app(Settings(data=tmp_path / "data"), STORE)  # type: ignore[call-arg]
    browser = TestClient(application, follow_redirects=False, base_url="http://school.example")
    assert browser.post("/room", data={"hours": "2"}).status_code == 303
    yield browser
    application.state.classroom.close()


def again(browser: TestClient, tmp_path: Path) -> TestClient:
    """The same browser after a restart of the service."""
    browser.app.state.classroom.close()  # type: ignore[attr-defined]
    application = create_app(Settings(data=tmp_path / "data"), STORE)  # type: ignore[call-arg]
    cookies = {COOKIE: browser.cookies[COOKIE]}
    return TestClient(application, follow_redirects=False, base_url="http://school.example", cookies=cookies)


def ask(browser: TestClient, method: str, path: str):
    return browser.request(method, path.format(browser.cookies[COOKIE]), data=FORM)


def test_the_list_of_revisions_is_that_of_the_migrations() -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(database.__file__).parent / "migrations"))
    found = [step.revision for step in ScriptDirectory.from_config(config).walk_revisions()]
    assert tuple(reversed(found)) == REVISIONS


def test_every_page_says_that_the_database_is_of_a_newer_version(teacher, tmp_path, caplog) -> None:
    file = tmp_path / "data" / DATABASE_FILE
    teacher.app.state.classroom.close()
    make_newer(file)
    before = file.read_bytes()
    browser = again(teacher, tmp_path)
    assert browser.get("/readyz").json()["classrooms"] == "newer-database"
    for method, path in PAGES:
        answer = ask(browser, method, path)
        assert answer.status_code == 503, path
        assert NEWER in answer.text, path
    assert browser.get("/").status_code == 200
    browser.app.state.classroom.close()
    assert file.read_bytes() == before, "nothing was changed in it"
    assert "its revision is 0099; this version knows up to" in caplog.text
    assert "Traceback" not in caplog.text


def test_a_page_of_a_room_reads_that_the_database_is_of_a_newer_version(tmp_path) -> None:
    first = Hub(tmp_path)
    room = first.rooms.open("Class", 3600.0)
    ticket = first.ticket(room.token)
    first.close()
    make_newer(tmp_path / DATABASE_FILE)
    hub = Hub(tmp_path)
    with pytest.raises(ClassroomUnavailable, match=NEWER):
        hub.ticket(room.token)
    page = hub.attend(ticket, lambda: None)
    assert NEWER in page.room.problem
    page.leave()
    hub.close()


def test_the_start_names_a_newer_database_and_the_service_runs(teacher, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(main, "restarted", lambda *_, **__: 0)
    monkeypatch.setattr(main, "_serve", lambda *_, **__: 0)
    assert main.run(Settings(port=0, data=tmp_path / "data")) == 0  # type: ignore[call-arg]
    assert NEWER not in capsys.readouterr().err
    teacher.app.state.classroom.close()
    make_newer(tmp_path / "data" / DATABASE_FILE)
    assert main.run(Settings(port=0, data=tmp_path / "data")) == 0  # type: ignore[call-arg]
    assert f"the database of classrooms in {tmp_path / 'data'} was {NEWER}" in capsys.readouterr().err


@pytest.mark.full
def test_postgres_of_a_newer_version(tmp_path, caplog) -> None:
    with running() as server:
        url = server.create()
        hub = Hub(tmp_path, url)
        hub.rooms.open("Class", 3600.0)
        hub.close()
        engine = create_engine(url.replace("postgresql:", "postgresql+psycopg:"))
        with engine.begin() as connection:
            connection.execute(text("UPDATE alembic_version SET version_num = '0099'"))
        engine.dispose()
        application = create_app(Settings(database_url=url), STORE)  # type: ignore[call-arg]
        newer = application.state.classroom

        async def start() -> None:
            async with sweeping(newer):
                while "its revision is 0099" not in caplog.text:
                    await asyncio.sleep(0.01)

        asyncio.run(asyncio.wait_for(start(), 20.0))
        browser = TestClient(application, base_url="http://school.example")
        assert browser.get("/readyz").json()["classrooms"] == "newer-database"
        for path in ("/room", "/room/join"):
            assert NEWER in browser.post(path, data=FORM).text
        newer.close()


@pytest.mark.parametrize("restarted", [False, True])
@pytest.mark.parametrize("fault", ["file in its place", "gone"])
def test_every_page_says_that_the_folder_has_gone(teacher, tmp_path, fault, restarted) -> None:
    """Also while it cannot be made again. For a service that has not known it, there just are no rooms yet."""
    data = tmp_path / "data"
    if restarted:
        teacher = again(teacher, tmp_path)
    shutil.rmtree(data)
    if fault != "gone":
        data.write_text("")
    new = restarted and fault == "gone"
    said = "ready" if new else "missing" if fault == "gone" else "read-only"
    assert teacher.get("/readyz").json()["classrooms"] == said
    for method, path in PAGES:
        if new and (method, path) == ("POST", "/room"):
            continue
        answer = ask(teacher, method, path)
        status = {"/room": 200, "/room/join": 404, "/room/qr.svg": 404, "/room/teach/{}": 404}.get(path, 403)
        assert answer.status_code == (status if new else 503), path
    assert not data.is_dir(), "no empty database takes its place"
    teacher.app.state.classroom.close()


def test_a_service_without_rooms_makes_no_database(tmp_path) -> None:
    application = create_app(Settings(data=tmp_path / "data"), STORE)  # type: ignore[call-arg]
    cookies = {COOKIE: "WyJhIiwiYiJd.c2lnbmF0dXJl"}
    browser = TestClient(application, follow_redirects=False, base_url="http://school.example", cookies=cookies)
    assert browser.get("/room").status_code == 200
    assert browser.get("/room/results").status_code == 403
    assert browser.post("/room/join", data={"code": "ACDEFGHJ", "alias": "Ada"}).status_code == 404
    assert not (tmp_path / "data").exists()
    application.state.classroom.close()


def test_what_is_no_database_has_no_revision(tmp_path) -> None:
    file = tmp_path / "odd % name?.db"
    assert revision_of(file) is None
    assert not file.exists()
    file.write_bytes(b"not a database" * 100)
    assert revision_of(file) is None
    file.unlink()
    with contextlib.closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("CREATE TABLE alembic_version (version_num TEXT)")
        assert revision_of(file) is None
        connection.execute("INSERT INTO alembic_version VALUES ('0007')")
        connection.commit()
        assert revision_of(file) == "0007"
