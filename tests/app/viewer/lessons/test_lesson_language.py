"""Lessons in a page whose language is another one, and files that do not fit the arm."""

from __future__ import annotations

import json
import re
import threading
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.exercises import Lessons, shelf
from app.exercises.lesson_text import LessonText, lesson_files
from app.shared.clouds import Clouds
from app.shared.settings import Settings, static_folder
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState, encode
from kin.parsing import to_toml

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

GERMAN = """
title = "Tempo"
about = "Wie schnell."
[steps."A column"]
"A column" = "Eine Spalte"
[controls]
"Frame" = "Bezug"
"Base" = "Basis"
"Tool" = "Werkzeug"
"Jog" = "Fahren"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(shelf, "EVERY", 0.0)
    (tmp_path / "velocity.de.toml").write_text(GERMAN, encoding="utf-8")
    return tmp_path


@pytest.fixture
def server(folder: Path) -> Iterator[int]:
    with serve_viewer(ViewerServer(Store(), Settings(lessons=folder), Clouds())) as port:
        yield port


def test_a_page_shows_lessons_in_its_language(server: int) -> None:
    with FakeBrowser(server) as tab:
        tab.settle()
        assert "Tempo" not in tab.html
        tab.set("Language", "Deutsch")
        tab.wait(lambda: ">Tempo</button>" in tab.html and "Wie schnell." in tab.html)
        tab.set("Lesson", "Tempo")
        tab.wait(lambda: "1. Eine Spalte" in tab.html)
        assert "Not translated yet: “Eine Spalte”, “Turning”" in tab.html
        assert tab.value("Bezug") == "Basis"
        tab.set("Bezug", "Werkzeug")
        tab.settle()
        kept = tab.stored()
        tab.set("Language", "English")
        tab.wait(lambda: "1. A column" in tab.html)
        assert tab.value("Frame") == "Tool", "the same control"
        assert "Not translated yet" not in tab.html
        assert tab.value("Lesson") == "Velocity"
    memory = json.dumps({"address": "http://127.0.0.1/", "state": kept})
    with FakeBrowser(server, memory=memory) as tab:
        tab.wait(lambda: "1. Eine Spalte" in tab.html)
        assert tab.value("Bezug") == "Werkzeug"
        tab.set("Lesson", "DH table step by step")
        tab.wait(lambda: "This lesson is not translated yet." in tab.html)


@pytest.mark.parametrize(
    ("lesson", "old", "new", "first"),
    [
        ("velocity", 'value = "speed"', 'value = "speed/0"', "1. A column"),
        ("inverse", 'when = "planar"\n', 'when = "planar/(joints - joints)"\n', "1. The wrist centre"),
    ],
)
def test_a_file_that_does_not_fit_the_arm_leaves_the_original(
    folder: Path, server: int, caplog: pytest.LogCaptureFixture, lesson: str, old: str, new: str, first: str
) -> None:
    own = lesson_files()[lesson].read_text(encoding="utf-8")
    (folder / f"{lesson}.toml").write_text(own.replace(old, new, 1), encoding="utf-8")
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Lesson", next(each.title for each in LESSONS if each.key == lesson))
        tab.wait(lambda: "the original is shown" in tab.html)
        assert first in tab.html
    assert any("the words of a lesson are left out" in record.message for record in caplog.records)


def test_a_lesson_is_chosen_by_the_title_that_the_page_offers(
    folder: Path, server: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def offered(tab: FakeBrowser) -> list[str]:
        return list(tab.gui[tab.element("Lesson")]["props"]["options"])

    def own(self: Lessons, lesson: str, language: str = "") -> LessonText | None:
        threads.add(threading.current_thread().name.partition("-")[0])
        return read(self, lesson, language)

    threads, read = set[str](), Lessons.own
    (folder / "dh.de.toml").write_text('title = "Tempo"', encoding="utf-8")
    (folder / "equations.de.toml").write_text('title = "None"', encoding="utf-8")
    with FakeBrowser(server) as tab:
        tab.settle()
        tab.set("Language", "Deutsch")
        tab.wait(lambda: "Wie schnell." in tab.html)
        assert [title for title in offered(tab) if "Tempo" in title] == ["Tempo", "Tempo (Velocity)"]
        assert [title for title in offered(tab) if "None" in title] == ["None", "None (Equations)"]
        (folder / "dh.de.toml").write_text('title = "Tabelle"', encoding="utf-8")
        monkeypatch.setattr(Lessons, "own", own)
        tab.set("Lesson", "Tempo (Velocity)")
        tab.wait(lambda: "1. Eine Spalte" in tab.html and tab.value("Lesson") == "Tempo")
        assert "Tabelle" in offered(tab)
        assert threads == {"visitors"}, "none in the event loop, which all pages share"


def test_of_a_file_that_is_edited_the_answers_stay_that_fit_its_questions(folder: Path, server: int) -> None:
    data = tomllib.loads(lesson_files()["velocity"].read_text(encoding="utf-8"))
    (folder / "velocity.toml").write_text(to_toml(data), encoding="utf-8")
    with FakeBrowser(server) as tab:

        def press(kind: str, *more: str, value: object = None) -> None:
            tab.say("feature", ["guide", [kind, *more, 1], value])

        tab.settle()
        tab.set("Lesson", "Velocity")
        tab.wait(lambda: "1. A column" in tab.html)
        press("fields", "1", value=[["98765.4"]])
        press("reveal", "5")
        press("go", value=4)
        press("watch", value=0)
        for _ in range(3):
            press("watch", value=1)
        tab.wait(lambda: "<b>4 of" in tab.html)
        data["steps"][0]["question"] = next(one for one in data["check"] if one.get("kind") == "choice")
        data["steps"], data["example"]["steps"] = data["steps"][:1], data["example"]["steps"][:3]
        (folder / "velocity.toml").write_text(to_toml(data), encoding="utf-8")
        tab.set("Radians", True)
        tab.wait(lambda: f"0 of {len(data['check'])} right" in tab.html)
        assert "Something went wrong" not in tab.html
        assert "Watch a worked example" in tab.html
        press("go", value=0)
        tab.wait(lambda: 'data-question="1"' in tab.html)
        assert 'data-question="1" data-closed="1"' not in tab.html


def test_who_may_only_look_chooses_a_language_that_comes_while_the_page_is_open(folder: Path) -> None:
    (folder / "velocity.de.toml").unlink()
    viewer = ViewerServer(Store(), Settings(lessons=folder), Clouds())
    access = {"token": None, "read_only": True, "rate": 0.0, "login_page": static_folder() / "login.html"}
    memory = json.dumps({"address": "http://127.0.0.1/", "state": encode(PageState(lesson="velocity"))})
    with serve_viewer(viewer, access=access) as port, FakeBrowser(port, memory=memory) as tab:

        def labels() -> list[str]:
            return [element["props"].get("label", "") for element in tab.gui.values()]

        tab.settle()
        assert "Language" not in labels()
        (folder / "velocity.de.toml").write_text(GERMAN, encoding="utf-8")
        for radians in (True, False):  # the files are read at the first change, and chosen from at the next
            tab.set("Radians", radians)
            tab.settle()
        tab.wait(lambda: "Language" in labels(), 5.0)
        tab.set("Language", "Deutsch")
        tab.wait(lambda: "1. Eine Spalte" in tab.html)


@pytest.mark.parametrize(
    ("lesson", "at"),
    [
        ("velocity", 0),
        ("inverse", 3),  # a step that the lesson itself asks about the arm on show
        ("screws", 4),
    ],
)
def test_a_file_that_no_longer_names_the_arm_asks_about_one_that_it_names(
    folder: Path, server: int, lesson: str, at: int
) -> None:
    data = tomllib.loads(lesson_files()[lesson].read_text(encoding="utf-8"))
    before, after = (kin.get_robot(arm).name for arm in data["arms"][:2])
    with FakeBrowser(server) as tab:

        def texts() -> list[str]:
            """Those of the step on show, below what is said of the arm."""
            step = tab.html.partition('data-guide="steps"')[2].partition("</section>")[0]
            return re.findall("<p>(.+?)</p>", step)

        tab.settle()
        if data["arms"][0] != "pioneer5":  # which is on show at first
            tab.choose(before)
        tab.set("Lesson", next(each.title for each in LESSONS if each.key == lesson))
        tab.wait(lambda: 'data-guide="steps"' in tab.html)
        tab.say("feature", ["guide", ["go", 1], at])
        tab.wait(lambda: f'data-step="{at + 1}"' in tab.html)
        (folder / f"{lesson}.toml").write_text(to_toml(data | {"arms": data["arms"][1:]}), encoding="utf-8")
        tab.set("Radians", True)
        tab.wait(lambda: f"Ask this about {after}" in tab.html)
        assert texts()
        tab.say("feature", ["guide", ["arm", 1], None])
        tab.wait(lambda: f"This is asked about {after}" in tab.html)
        tab.settle()
        assert texts()
