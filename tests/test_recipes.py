"""The recipes of CONTRIBUTING.md (*How to add…*) in a copy of the tree: the registries are the only lists."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from compiled import lend_kernels

ROOT = Path(__file__).parents[1]
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

LESSON = """
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Option, Outline, Step


class SumsLesson(Lesson):
    key = "sums"
    title = "Sums"
    about = "Learns to count."

    @staticmethod
    def outline(robot, units, text=None):
        question = Choice("1 + 1?", (Option("2", "Counted.", True), Option("3", "One too many.")))
        steps = (
            Step("Two", f"At the {robot.name}.", question, "It is 2."),
            Step("Again", "Once more.", question, "It is 2."),
        )
        return Outline("You can count.", steps, (question, question))
"""
TAB = """
from app.viewer.feature import Feature


class Notes(Feature):
    key = "notes"
    title = "Notes"

    def __init__(self, stage):
        super().__init__(stage)
        stage.client.gui.add_html("A place for notes")
"""
FORMAT = """
def _xyz(table: Table, source: Source) -> Bytes:
    with closing(source(table.measures, table.joints > 0)) as chunks:
        for chunk in chunks:
            yield "".join(f"{x} {y} {z}\\n" for x, y, z in chunk.points.tolist()).encode()


def _ply("""
KIND = """
from dataclasses import dataclass

from app.exercises.contract import Kind
from app.exercises.questions import Asked, Verdict, index


@dataclass(frozen=True)
class ParityKind(Kind):
    name = "parity"
    about = "Whether a number is even."

    number: int

    @classmethod
    def read(cls, fields):
        return cls(fields.whole("number", 0, 99))

    def asked(self, variant, units):
        return Asked("options", ("even", "odd"))

    def judge(self, variant, given, units):
        return Verdict(index(given, 2) == self.number % 2, f"{self.number} divided by two.")

    def answer(self, variant):
        return self.number % 2

    def solution(self, variant, units):
        return ("even", "odd")[self.number % 2]
"""
ROBOT = """
id = "two-links"
name = "Two links"
description = "Two links that turn in one plane."
source = "an example"
convention = "standard"
units = { length = "m", angle = "deg" }
rows = [{ name = "one", a = 0.7 }, { name = "two", a = 0.5 }]
"""
EXERCISE = """
id = "even-or-odd"
title = "Even or odd"
topic = "Velocity"
lesson = "sums"
robot = "two-links"
kind = "parity"
text = "Is 7 even?"
answer = { number = 7 }
"""
# What each recipe adds: new files, and texts that take the place of others.
RECIPES: dict[str, dict[str, str | list[tuple[str, str]]]] = {
    "robot": {"kin/robots/two-links.toml": ROBOT},
    "tab": {
        "app/viewer/tabs/notes.py": TAB,
        "app/viewer/tabs/__init__.py": [
            (
                "from app.viewer.tabs.program",
                "from app.viewer.tabs.notes import Notes\nfrom app.viewer.tabs.program",
            ),
            ("ProgramTab, Workspace)", "ProgramTab, Workspace, Notes)"),
        ],
    },
    "lesson": {
        "app/viewer/lessons/sums/__init__.py": "",
        "app/viewer/lessons/sums/lesson.py": LESSON,
        "app/exercises/lessons.py": [('"trajectories",\n', '"trajectories",\n    "sums",\n')],
    },
    "kind of exercise": {
        "app/exercises/kinds/parity.py": KIND,
        "app/exercises/kinds/__init__.py": [
            ("\nKINDS", "\nfrom app.exercises.kinds.parity import ParityKind\n\nKINDS"),
            ("        ProgramKind,\n", "        ProgramKind,\n        ParityKind,\n"),
        ],
    },
    "exercise": {"app/exercises/library/even-or-odd.toml": EXERCISE},
    "export format": {
        "app/exports/formats.py": [
            ("\ndef _ply(", FORMAT),
            (
                "= (\n    Format(",
                '= (\n    Format("xyz", "text/plain", "three numbers per line", _xyz),\n    Format(',
            ),
        ],
        "app/cli/arguments/space.py": [('"ndjson", "bin")', '"ndjson", "bin", "xyz")')],
    },
}
# What a process of the copy finds.
LOOK = """
import json, sys
from fake_browser import FakeBrowser
from live_server import serve_viewer
import app, kin
from app.api.workspace.download import DownloadQuery
from app.classroom.courses import Courses, parse_course
from app.cli.parser import main
from app.exercises import Exercises
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.room.following import shared
from app.viewer.server import ViewerServer
from app.viewer.session.state import PageState
from kin.units import Units

exercises = Exercises()
one = exercises.get("even-or-odd")
course = parse_course('title = "Sums"\\n[[item]]\\nlesson = "sums"', exercises)
found = {
    "folders": [app.__file__, kin.__file__],
    "verdicts": [one.judge(one.variant(1), given, Units()).right for given in (0, 1)],
    "course": [item.key for item in course.items],
    "format": DownloadQuery(format="xyz").format,
    "ended": main(["workspace", "two-links", "-n", "20", "--format", "xyz", "-o", "cloud.txt"]),
    "rows": open("cloud.txt").read().count("\\n"),
}
with serve_viewer(ViewerServer(Store(), Settings(), Clouds())) as port, FakeBrowser(port) as tab:
    tab.wait(lambda: "A place for notes" in tab.html)
    tab.set("Robot", "Two links")
    tab.set("Lesson", "Sums")
    tab.wait(lambda: "You can count." in tab.html and "At the Two links." in tab.html)
    tab.say("feature", ["guide", ["answer", "1", 1], 1])
    tab.wait(lambda: "One too many." in tab.html)
    tab.set("Lesson", "Exercises")
    tab.wait(lambda: "Even or odd" in tab.html)
    tab.say("feature", ["exercises", ["open", "even-or-odd", 2], None])
    tab.wait(lambda: "Is 7 even?" in tab.html)
    tab.say("feature", ["exercises", ["answer", 3], 1])
    tab.wait(lambda: "7 divided by two." in tab.html)
    tab.wait(lambda: tab.script["undo"] not in ("Lesson", "Exercise"))
    found["undo"] = tab.script["undo"]
print(json.dumps(found))
"""


def bullets() -> dict[str, str]:
    """What is added, and how, of the list in CONTRIBUTING.md."""
    text = CONTRIBUTING.partition("## How to add…\n")[2].partition("\n## ")[0]
    return dict(re.findall(r"^- \*\*an? ([^*]+)\*\*: (.*?)(?=\n- |\Z)", text, re.DOTALL | re.MULTILINE))


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree after all recipes; its kernels are those of this tree."""
    copy = tmp_path_factory.mktemp("recipes")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "app", copy / "app", ignore=ignored)
    (copy / "kin").mkdir()
    for path in (ROOT / "kin").iterdir():
        if path.name != "robots":
            (copy / "kin" / path.name).symlink_to(path)
    shutil.copytree(ROOT / "kin" / "robots", copy / "kin" / "robots", ignore=ignored)
    lend_kernels(copy / "kin")
    (copy / "static").symlink_to(ROOT / "static")
    for files in RECIPES.values():
        for name, change in files.items():
            path = copy / name
            path.parent.mkdir(exist_ok=True)
            if isinstance(change, str):
                assert not path.exists(), path
                path.write_text(change, encoding="utf-8")
                continue
            text = path.read_text(encoding="utf-8")
            for before, after in change:
                assert text.count(before) == 1, (name, before)
                text = text.replace(before, after)
            path.write_text(text, encoding="utf-8")
    return copy


@pytest.fixture(scope="module")
def found(scratch: Path) -> dict[str, Any]:
    path = os.pathsep.join(map(str, (scratch, ROOT / "tests" / "app", ROOT / "tests")))
    done = subprocess.run(
        [sys.executable, "-c", LOOK],
        cwd=scratch,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("what", RECIPES)
def test_the_recipe_names_every_place_that_has_to_change(what: str) -> None:
    named = [path for path in re.findall(r"`([^`\n]+)`", bullets()[what]) if "/" in path]
    for path in RECIPES[what]:
        assert any(path == each or (each.endswith("/") and path.startswith(each)) for each in named), path


@pytest.mark.full
def test_what_was_added_is_found_everywhere(scratch: Path, found: dict[str, Any]) -> None:
    assert all(file.startswith(str(scratch)) for file in found["folders"])
    assert found["verdicts"] == [False, True]
    assert found["course"] == ["sums"]
    assert (found["format"], found["ended"], found["rows"]) == ("xyz", 0, 20)
    assert found["undo"] == "Answer"
