"""Result codes and CSV from the command line and over REST."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from collections.abc import Iterator
from datetime import date
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from app.classroom import Hub, NewAttempt, Ticket
from app.classroom.results import Outcome, write_code
from app.classroom.results.check import check_code
from app.classroom.results.keys import result_key
from app.classroom.results.store import attempts_of
from app.cli.parser import main
from app.service.main import create_app
from app.shared.settings import Settings

ADA = Outcome("course", b"\x01\x02\x03\x04", "First steps", "Ada", 83, 9, 12, 14, date(2026, 11, 23))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KINBOARD_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


@pytest.fixture
def hub(folder: Path) -> Iterator[Hub]:
    hub = Hub(folder)
    yield hub
    hub.close()


def test_the_command_line_checks_a_code(hub: Hub, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = write_code(ADA, result_key(hub))
    assert main(["result", code]) == 0
    assert "83 %, 9 of 12 solved, 14 answers" in capsys.readouterr().out
    assert main(["result", "--json", *code.lower().split("-")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "signed"
    assert found["outcome"]["alias"] == "Ada"
    assert found["outcome"]["day"] == "2026-11-23"
    wrong = ("0" if code[0] != "0" else "1") + code[1:]
    assert main(["result", wrong]) == 1
    assert "mistyped: Code: got" in capsys.readouterr().err
    assert main(["result", write_code(ADA, b"another")]) == 1
    assert "forged: Code: got" in capsys.readouterr().err


def test_a_check_makes_no_database(folder: Path) -> None:
    hub = Hub(folder)
    assert check_code(write_code(ADA, b"another"), hub).status == "forged"
    assert check_code("12345", hub).status == "mistyped"
    assert not folder.exists()


def test_rest_checks_a_code(hub: Hub, folder: Path) -> None:
    code = write_code(ADA, result_key(hub))
    application = create_app(Settings(data=folder))
    with contextlib.closing(application.state.classroom):
        client = TestClient(application)
        found = client.get(f"/api/v1/results/{code}").json()
        assert found["status"] == "signed"
        assert found["outcome"]["fingerprint"] == "01020304"
        assert found["outcome"]["solved"] == 9
        found = client.get(f"/api/v1/results/{write_code(ADA, b'another')}").json()
        assert (found["status"], found["outcome"]) == ("forged", None)
        assert client.get("/api/v1/results/UUU").json()["status"] == "mistyped"
        assert client.get(f"/api/v1/results/{'A' * 500}").status_code == 422
    folder.joinpath("classroom.db").unlink()
    folder.joinpath("classroom.db").mkdir()
    assert TestClient(create_app(Settings(data=folder))).get(f"/api/v1/results/{code}").status_code == 503


def test_a_rooms_attempts_become_csv(
    hub: Hub, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    room = hub.rooms.open("Class", 3600.0)
    ada, eve = (hub.rooms.join(room.code, alias) for alias in ("Ada", "=HYPERLINK(1)"))
    for ticket, score in ((ada, 0.0), (eve, 0.5), (ada, 1.0)):
        hub.rooms.submit(ticket, NewAttempt("two-elbows", 7, ["30", "-60"], "Too large.", score, started=100.0))
    attempts = attempts_of(hub.database, room.id)
    assert [(one.alias, one.score) for one in attempts] == [("Ada", 0.0), ("=HYPERLINK(1)", 0.5), ("Ada", 1.0)]
    assert main(["results", room.code]) == 0
    printed = capsys.readouterr().out
    assert main(["results", room.code, "-o", "-"]) == 0
    assert capsys.readouterr().out == printed
    rows = list(csv.DictReader(io.StringIO(printed)))
    assert [(row["alias"], row["attempt"]) for row in rows] == [
        ("Ada", "1"),
        ("'=HYPERLINK(1)", "1"),
        ("Ada", "2"),
    ]
    assert rows[0]["title"] == "Both elbows"
    assert main(["results", room.code.lower(), "-o", str(tmp_path / "out.csv")]) == 0
    assert (tmp_path / "out.csv").read_bytes().startswith(b"\xef\xbb\xbfalias,")
    hub.rooms.remove_seat(room.id, eve.seat)
    assert len(attempts_of(hub.database, room.id)) == 2
    assert attempts_of(hub.database, Ticket("none").room) == []
    capsys.readouterr()
    assert main(["results", "NOPE"]) == 2
    assert "the join code of a room" in capsys.readouterr().err
