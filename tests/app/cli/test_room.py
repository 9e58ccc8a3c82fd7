"""``kinboard room``."""

from __future__ import annotations

import json

import pytest

from app.cli.parser import main


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("KINBOARD_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


@pytest.mark.full
def test_a_room_is_opened_listed_and_ended(capsys, folder):
    assert main(["room", "list"]) == 0
    assert "no room" in capsys.readouterr().out
    assert not folder.exists()
    assert main(["room", "open", "Kinematics", "--hours", "2", "--url", "http://lab.example/k/", "--json"]) == 0
    room = json.loads(capsys.readouterr().out)
    assert room["title"] == "Kinematics"
    assert room["teach"].startswith("http://lab.example/k/room/teach/")
    assert main(["room", "list"]) == 0
    assert room["code"] in capsys.readouterr().out
    assert main(["room", "end", room["code"].lower()]) == 0
    assert "erased" in capsys.readouterr().out
    assert main(["room", "end", room["code"]]) == 2
    assert "no room has the code" in capsys.readouterr().err


@pytest.mark.parametrize("wrong", [["--hours", "0"], ["--hours", "nan"], ["--hours", "５"], ["x" * 81]])
def test_what_is_refused_is_named(capsys, wrong):
    assert main(["room", "open", *wrong]) == 2
    assert "kinboard: " in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_named(capsys, folder):
    folder.write_text("a file")
    assert main(["room", "open"]) == 1
    assert "database" in capsys.readouterr().err
