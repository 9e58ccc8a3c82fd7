"""The teacher's page of results and its file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from app.classroom import COOKIE, NewAttempt, Ticket
from app.classroom.rooms import OpenRoom, Rooms
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
    assert "No answers yet" in teacher.get("/room/results").text
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


def test_the_page_does_not_read_the_answers(school: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    ada = school.rooms.join(school.room.code, "Ada")
    school.answer(ada, 0.5)
    read: list[object] = []
    rows = results.rows
    monkeypatch.setattr(
        results, "rows", lambda found, now: read.extend(one.answer for one in found) or rows(found, now)
    )
    assert "Ada" in school.browser(Ticket(school.room.id)).get("/room/results").text
    assert read == [None]
    assert '"[""30""]"' in school.browser(Ticket(school.room.id)).get("/room/results.csv").text


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
