"""What students, strangers and broken neighbours try on classrooms."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import logging
import socketserver
import sqlite3
import threading
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from live_server import wait_for
from sqlalchemy.exc import DBAPIError

from app.classroom import COOKIE, ClassroomUnavailable, Hub, NewAttempt, RefusedError, erasure, rooms
from app.classroom.database import Database
from app.classroom.lti.passback import Passback
from app.classroom.lti.seats import Column
from app.classroom.results import Outcome, write_code
from app.classroom.results.check import check_code
from app.classroom.results.table import csv_of
from app.classroom.work import Attempt
from app.service.main import create_app
from app.service.web.rooms import limits, sweeping
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.panel.script import read_page_json

STORE = Store()
ADA = Outcome("course", b"\x01\x02\x03\x04", "First steps", "Ada", 100, 9, 9, 9, date(2026, 11, 23))


@pytest.fixture
def hub(tmp_path: Path) -> Iterator[Hub]:
    hub = Hub(tmp_path / "data")
    yield hub
    hub.close()


def browsers(tmp_path: Path, count: int, address: str = "http://school.example", **settings: object):
    application = create_app(Settings(data=tmp_path / "data", **settings), STORE)  # type: ignore[arg-type]
    made = [TestClient(application, follow_redirects=False, base_url=address) for _ in range(count)]
    return application.state.classroom, made


def test_a_service_that_has_signed_nothing_calls_no_code_signed(tmp_path: Path) -> None:
    hub = Hub(tmp_path / "data")
    for key in (b"", b"\0" * 32):
        assert check_code(write_code(ADA, key), hub).status == "forged"


def test_log_and_metrics_keep_the_secret_of_the_teachers_link(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "kinboard.access")
    hub, (browser,) = browsers(tmp_path, 1, access_log=True)
    token = hub.rooms.open("Class", 3600.0).token
    assert browser.get(f"/room/teach/{token}").status_code == 303
    hub.close()
    line = json.loads(caplog.records[-1].message)
    assert line["path"] == line["route"] == "/room/teach/{token}"
    assert token not in caplog.text
    for guess in "abc":
        browser.get(f"/room/teach/{guess}")
    metrics = browser.get("/metrics").text
    assert token not in metrics
    assert 'route="/room/teach/{token}"' in metrics
    assert "/room/teach/a" not in metrics, "a series for each guess would fill the memory"


@pytest.mark.full
def test_wrong_codes_take_no_seats_of_the_class(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "SEATS", 3)
    monkeypatch.setattr(limits, "SLOW", 0.0)
    hub, (guesser, student) = browsers(tmp_path, 2)
    code = hub.rooms.open("Class", 3600.0).code
    for _ in range(6):
        assert guesser.post("/room/join", data={"code": "ACDEFGHJ", "alias": "x"}).status_code in (404, 429)
    assert student.post("/room/join", data={"code": code, "alias": "Ada"}).status_code == 303
    hub.close()


def test_half_a_letter_does_not_keep_the_results_from_the_teacher(tmp_path: Path) -> None:
    hub, (teacher, student) = browsers(tmp_path, 2)
    room = hub.rooms.open("Class", 3600.0)
    teacher.get(f"/room/teach/{room.token}")
    student.post("/room/join", data={"code": room.code, "alias": "Ada"})
    attendance = hub.attend(hub.ticket(student.cookies[COOKIE]), lambda: None)
    attendance.submit(NewAttempt("swing", 1, ["\ud800"], "wrong", 0.0, 0.0))
    attendance.leave()
    (row,) = csv.DictReader(io.StringIO(teacher.get("/room/results.csv").text.lstrip("\ufeff")))
    assert row["answer"] == '["?"]'
    assert teacher.get("/room/results").status_code == 200
    hub.close()


def test_messages_with_half_a_letter_are_not_read() -> None:
    for text in ('[1, "fields", [["\\ud800"]]]', '[1, "fields", NaN]'):
        with pytest.raises(ValueError, match=r"."):
            read_page_json(text, finite=True)
    assert read_page_json('[1, "fields", [["\\ud83d\\ude00"]]]', finite=True) == [1, "fields", [["😀"]]]


@pytest.mark.parametrize("argument", ["[" * 40 + "]" * 40, "[" + "0," * 20_001 + "0]", '"' + "x" * 65_536 + '"'])
def test_messages_beyond_the_limits_are_not_read(argument: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        read_page_json(f'[1, "fields", {argument}]', finite=True)
    assert read_page_json(f'["fields", {json.dumps(argument[:40])}]', finite=True) == ["fields", argument[:40]]


@pytest.mark.parametrize("alias", ["a;=1+1", "a;  @SUM(A1)", "a\t-2"])
def test_no_part_between_semicolons_is_a_formula(alias: str) -> None:
    texts = csv_of([[Attempt("s", alias, "x", 3, alias, alias, 0.5, 0.0, 1.0)]], {"x": alias})
    row = "".join(texts).splitlines()[1]
    for part in row.replace("\t", ";").split(";"):
        assert part.strip()[0] not in "=+-@"


class _Babble(socketserver.StreamRequestHandler):
    """Answers what is no HTTP."""

    asked = 0

    def handle(self) -> None:
        type(self).asked += 1
        self.request.recv(4096)
        self.wfile.write(b"220 mail.example ESMTP\r\n")


def test_a_platform_that_speaks_no_http_does_not_end_the_sending_of_scores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from cryptography.hazmat.primitives.asymmetric import rsa

    from app.classroom.lti.platforms import Platform, Platforms

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), _Babble) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        root = f"http://127.0.0.1:{server.server_address[1]}"
        platform = Platform("p", root, "c", ("1",), root, f"{root}/token", f"{root}/keys")
        platforms = Platforms((platform,), rsa.generate_private_key(65537, 2048))
        column = Column(root, "c", f"{root}/columns/5", "user", 1.0, 1, True)
        passback = Passback(platforms, lambda _: column, pauses=(0.0, 0.0))
        for seat in ("one", "two"):
            before = _Babble.asked
            passback.attempted(seat)
            wait_for(lambda before=before: _Babble.asked >= before + 2)
            wait_for(lambda: not passback.busy)
        passback.close()
        server.shutdown()
        thread.join()


def test_every_error_of_sqlite_is_said_in_words(tmp_path: Path) -> None:
    database = Database(tmp_path / "classroom.db")
    assert database.key()

    def refuse(action: int, *_: object) -> int:
        return sqlite3.SQLITE_DENY if action == sqlite3.SQLITE_PRAGMA else sqlite3.SQLITE_OK

    with database.write() as connection:
        erasure.note(connection)
    with database.read() as connection:
        connection.connection.driver_connection.set_authorizer(refuse)  # type: ignore[union-attr]
    with pytest.raises(ClassroomUnavailable), database.write():
        pass
    with pytest.raises(ClassroomUnavailable):
        database.erase()
    database.close()


@pytest.mark.full
def test_one_student_cannot_fill_the_disk_with_answers(hub: Hub) -> None:
    """Long answers of one seat end at a sum; those of others are stored."""
    code = hub.rooms.open("Class", 3600.0).code
    greedy, other = (hub.rooms.join(code, alias) for alias in ("Greedy", "Ada"))
    long = ["x" * 19_900]
    for seed in range(rooms.MAX_STORED // 19_900 + 1):
        hub.rooms.submit(greedy, NewAttempt("swing", seed, long, "wrong", 0.0, 0.0))
    with pytest.raises(RefusedError, match="characters; no more are stored"):
        hub.rooms.submit(greedy, NewAttempt("swing", 999, long, "wrong", 0.0, 0.0))
    assert hub.rooms.submit(other, NewAttempt("swing", 1, long, "right", 1.0, 0.0))


def test_sweeping_goes_on_after_any_error(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    hub.rooms.open("Class", 3600.0)
    monkeypatch.setitem(sweeping.__wrapped__.__globals__, "SWEEP_EVERY", 0.001)  # type: ignore[attr-defined]
    calls = []

    def sweep() -> int:
        calls.append(1)
        raise RuntimeError("broken")

    monkeypatch.setattr(hub.rooms, "sweep", sweep)

    async def look() -> None:
        async with sweeping(hub):
            while len(calls) < 2:
                await asyncio.sleep(0.005)

    asyncio.run(asyncio.wait_for(look(), 20.0))


def test_what_the_database_says_about_values_is_not_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    database = Database(tmp_path / "classroom.db")
    with pytest.raises(ClassroomUnavailable), database.read() as connection:
        connection.exec_driver_sql("SELECT * FROM nothing WHERE alias = ?", ("Ada Lovelace",))
    database._logged = -100.0
    with pytest.raises(ClassroomUnavailable), database.read():
        raise DBAPIError("", {}, Exception("value too long\nDETAIL:  Failing row contains (Ada Lovelace)"))
    assert "value too long" in caplog.text
    assert "Lovelace" not in caplog.text
    database.close()


def test_no_page_of_any_site_may_frame_a_teachers_page(tmp_path: Path) -> None:
    hub, (teacher,) = browsers(tmp_path, 1, frame_ancestors=["*", "https://lms.example"])
    teacher.get(f"/room/teach/{hub.rooms.open('Class', 3600.0).token}")
    for path in ("/room", "/room/results"):
        policy = teacher.get(path).headers["content-security-policy"]
        assert policy.endswith("frame-ancestors 'self' https://lms.example")
    assert (
        teacher.get("/")
        .headers["content-security-policy"]
        .endswith("frame-ancestors 'self' * https://lms.example")
    )
    hub.close()


def test_leaving_a_room_in_a_frame_forgets_its_cookies(tmp_path: Path) -> None:
    hub, (student,) = browsers(
        tmp_path, 1, "https://school.example", frame_ancestors="https://lms.example", token="a-long-enough-token"
    )
    student.post("/room/join", data={"code": hub.rooms.open("Class", 3600.0).code, "alias": "Ada"})
    assert student.get("/viewer/").status_code == 503  # starting: admitted
    cookies = student.post("/room/leave").headers.get_list("set-cookie")
    assert {each.partition("=")[0] for each in cookies} == {COOKIE, "kinboard_guest"}
    for each in cookies:
        assert "Max-Age=0" in each
        assert all(part in each for part in ("Secure", "SameSite=none", "Partitioned"))
    assert student.get("/viewer/", headers={"accept": "text/html"}).status_code == 303
    hub.close()
