"""The teacher's page of results and its file."""

from __future__ import annotations

import asyncio
import csv
import io
import math
import re
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import ANY

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import insert
from test_hub import until

from app.classroom import COOKIE, ClassroomUnavailable, NewAttempt, Ticket, tables
from app.classroom.results import store
from app.classroom.rooms import OpenRoom, Rooms
from app.classroom.views import Recalled
from app.classroom.work import SHOWN_ANSWER, Attempt
from app.service.main import create_app
from app.service.web.rooms import results
from app.shared.settings import Settings


class Class:
    """A service with one room, and browsers of its teacher, of a student and of a stranger."""

    def __init__(self, folder: Path) -> None:
        self.app = create_app(Settings(data=folder))
        self.rooms: Rooms = self.app.state.classroom.rooms
        self.room: OpenRoom = self.rooms.open("Class <1>", 3600.0)

    def browser(self, ticket: Ticket | None) -> TestClient:
        """Who has this ticket."""
        cookies = {} if ticket is None else {COOKIE: self.rooms.tokens.sign(ticket)}
        return TestClient(self.app, base_url="http://school.example", cookies=cookies)

    def answer(self, student: Ticket, score: float) -> None:
        """An answer of a student."""
        self.rooms.submit(student, NewAttempt("two-elbows", 7, ["30"], "Too <large>.", score, started=0.0))


@pytest.fixture
def school(tmp_path: Path) -> Iterator[Class]:
    found = Class(tmp_path)
    yield found
    found.app.state.classroom.close()


def test_the_teacher_sees_who_is_stuck_first(school: Class) -> None:
    teacher = school.browser(Ticket(school.room.id))
    assert "Nobody has joined yet" in teacher.get("/room/results").text
    ada, eve = (school.rooms.join(school.room.code, alias) for alias in ("Ada", "=<b>Eve"))
    school.answer(ada, 1.0)
    for _ in range(3):
        school.answer(eve, 0.25)
    page = teacher.get("/room/results").text
    assert page.index("=&lt;b&gt;Eve") < page.index("Ada")
    assert "Both elbows" in page
    assert "Too &lt;large&gt;." in page
    assert "1 stuck" in page
    assert "1 solved" in page
    assert "25 %" in page
    answer = teacher.get("/room/results.csv")
    assert answer.headers["content-type"].startswith("text/csv")
    assert "attachment" in answer.headers["content-disposition"]
    rows = list(csv.DictReader(io.StringIO(answer.content.decode("utf-8-sig"))))
    assert [row["alias"] for row in rows] == ["Ada", "'=<b>Eve", "'=<b>Eve", "'=<b>Eve"]
    assert "Results" in teacher.get("/room").text


def test_the_teacher_sees_causes_figures_and_what_is_remembered(school: Class) -> None:
    teacher, hub = school.browser(Ticket(school.room.id)), school.app.state.classroom
    seats = [school.rooms.join(school.room.code, f"<b>{i}") for i in range(8)]
    for i, seat in enumerate(seats):
        for exercise, score in (("swing", float(i < 5)), ("two-elbows", float(i < 1))):
            given = NewAttempt(exercise, 7, ["30"], "The other <sign>.", score, 0.0, cause="sign" * (score < 1.0))
            school.rooms.submit(seat, given)
    school.rooms.submit(seats[7], NewAttempt.given_up("two-elbows", 7, 0.0))
    page = hub.attend(seats[0], lambda: None)
    for right in (1, 0):
        page.tell_recalled(Recalled(1, right, 0, 0))
    until(lambda: store.recalled_of(hub.database, school.room.id) == (2, 1, 0, 0))
    text = teacher.get("/room/results").text
    table = text.split("<table data-mistakes>")[1].split("</table>")[0]
    row = table.split("Both elbows")[1].split("</tbody>")[0]
    assert "Too hard: 20 % or fewer are right at the first try." in row
    assert re.findall(r'<td class="n"[^>]*>(.*?)</td>', row) == [
        "1 of 8",
        ANY,
        f"{math.sqrt(3 / 35):.2f}",
        "1 of 8",
    ]
    assert '<meter max="8" value="7"' in row
    assert "<b>7</b> sign</summary>" in row
    assert "The other &lt;sign&gt;.<br><bdi>&lt;b&gt;1, &lt;b&gt;2" in row
    assert "seven days and more after the last answer that counted there: 1 of 2 right." in text
    file = teacher.get("/room/results.csv").content.decode("utf-8-sig")
    assert [one["cause"] for one in csv.DictReader(io.StringIO(file))][:3] == ["", "", ""]
    assert file.count(",sign\r\n") == 3 + 7


def test_the_page_reads_only_the_beginnings_of_answers(school: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    ada = school.rooms.join(school.room.code, "Ada")
    school.rooms.submit(ada, NewAttempt("two-elbows", 7, ["3" * 5000], "Too large.", 0.5, started=0.0))
    read: list[object] = []
    rows = results.rows
    monkeypatch.setattr(
        results,
        "rows",
        lambda members, found, *rest: read.extend(one.answer for one in found) or rows(members, found, *rest),
    )
    assert "Ada" in school.browser(Ticket(school.room.id)).get("/room/results").text
    assert [len(answer) for answer in read] == [SHOWN_ANSWER]
    assert "3" * 5000 in school.browser(Ticket(school.room.id)).get("/room/results.csv").text


def test_nobody_else_does(school: Class) -> None:
    student = school.rooms.join(school.room.code, "Ada")
    school.answer(student, 1.0)
    other = school.rooms.open("Another", 3600.0)
    for browser in (school.browser(None), school.browser(student)):
        for path in ("/room/results", "/room/results.csv"):
            answer = browser.get(path)
            assert answer.status_code == 403
            assert "two-elbows" not in answer.text
    forged = TestClient(school.app, cookies={COOKIE: "made-up"}, base_url="http://school.example")
    assert forged.get("/room/results").status_code == 403
    assert "Ada" not in school.browser(Ticket(other.id)).get("/room/results").text
    assert "room/results" not in school.browser(student).get("/room").text


@pytest.mark.full
def test_a_lost_database_is_said(school: Class, tmp_path: Path) -> None:
    teacher = school.browser(Ticket(school.room.id))
    assert teacher.get("/room/results").status_code == 200
    for path in tmp_path.glob("classroom.db*"):
        path.unlink()
    (tmp_path / "classroom.db").mkdir()
    answer = teacher.get("/room/results")
    assert answer.status_code == 503
    assert "The classroom" in answer.text
    assert teacher.get("/room/results.csv").status_code == 503


def download(school: Class, body: Callable[[bytes], None]) -> bool:
    """Send the teacher's file part by part to `body`; returns whether its end was sent."""
    ended = False

    async def send(message: dict[str, Any]) -> None:
        nonlocal ended
        body(message.get("body", b""))
        ended = message["type"] == "http.response.body" and not message.get("more_body")

    async def receive() -> dict[str, Any]:
        await asyncio.sleep(60)
        return {"type": "http.disconnect"}

    token = school.rooms.tokens.sign(Ticket(school.room.id))
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": "GET",
        "scheme": "http",
        "path": "/room/results.csv",
        "raw_path": b"/room/results.csv",
        "query_string": b"",
        "root_path": "",
        "client": ("127.0.0.1", 1),
        "server": ("school.example", 80),
        "headers": [(b"host", b"school.example"), (b"cookie", f"{COOKIE}={token}".encode())],
    }
    asyncio.run(school.app(scope, receive, send))
    return ended


def answer_much(school: Class, each: int) -> None:
    """30 students with so many long answers each."""
    seats = [school.rooms.join(school.room.code, f"Student {i}").seat for i in range(30)]
    attempts = [
        {
            "id": f"{i}",
            "room_id": school.room.id,
            "seat_id": seats[i % 30],
            "exercise": "two-elbows",
            "seed": i % 600,  # 20 for each student, whose work is kept by the seed
            "answer": ["9" * 2000],
            "verdict": "Too large.",
            "score": 0.5,
            "started": 0.0,
            "at": float(i // 7),
        }
        for i in range(30 * each)
    ]
    with school.app.state.classroom.database.write(durable=False) as connection:
        connection.execute(insert(tables.Attempt), attempts)


@pytest.mark.parametrize("each", [50, pytest.param(1000, marks=pytest.mark.slow)])
def test_the_file_is_sent_while_it_is_read(school: Class, each: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first rows leave after one page is read, and memory does not grow with the file."""
    school.answer(school.rooms.join(school.room.code, "Ada"), 1.0)
    assert download(school, lambda _: None), "what is imported with the first file does not count"
    answer_much(school, each)
    database = school.app.state.classroom.database
    read, reads, rows = database.read, 0, 0
    first = -1  # reads of the database before the first row was sent

    def counted() -> object:
        nonlocal reads
        reads += 1
        return read()

    def took(body: bytes) -> None:
        nonlocal first, rows
        rows += body.count(b"\r\n")
        if rows > 1 and first < 0:
            first = reads

    monkeypatch.setattr(database, "read", counted)
    tracemalloc.start()
    try:
        assert download(school, took)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert rows == 2 + 30 * each
    assert first <= reads - 30 * each // store.PAGE, "the first rows leave before the second page is read"
    assert peak < 4e6, f"{peak / 1e6:.1f} MB at a time"


def test_a_file_is_cut_off_when_the_database_is_lost(
    school: Class, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    ada = school.rooms.join(school.room.code, "Ada")
    for _ in range(3):
        school.answer(ada, 0.5)
    pages_of = store.pages_of

    def lost(*arguments: Any) -> Iterator[list[Attempt]]:
        yield next(pages_of(*arguments, size=2))
        raise ClassroomUnavailable("The disk is full.")

    monkeypatch.setattr(store, "pages_of", lost)
    parts: list[bytes] = []
    assert not download(school, parts.append), "a browser says that the file is not complete"
    assert b"".join(parts).count(b"Ada") == 2
    assert "a file of results was cut off: The disk is full." in caplog.text
