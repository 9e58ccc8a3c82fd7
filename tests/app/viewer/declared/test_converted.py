"""Packages of declared features leave viser, its callbacks and the entries of links to `app.viewer.declared`."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from app.viewer.declared.feature import DeclaredFeature
from app.viewer.lessons import LESSONS

ROOT = Path(__file__).parents[4] / "app" / "viewer"
PACKAGES = sorted(
    path.name for path in (ROOT / "lessons").iterdir() if (path / "lesson.py").exists() and path.name != "guide"
)
BANNED = {"listen", "listen_click", "assign", "update_html"}  # of `app.viewer.panel`


def offences(source: str) -> list[str]:
    """What a module does that only `app.viewer.declared` may do."""
    found = []
    for node in ast.walk(ast.parse(source)):
        names = [alias.name for alias in getattr(node, "names", [])] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
            found += [
                f"imports {a.name}" for a in node.names if names == ["app.viewer.panel"] and a.name in BANNED
            ]
        found += [f"imports {name}" for name in names if name.partition(".")[0] == "viser"]
        if isinstance(node, ast.FunctionDef):
            # Entries of links come as `object`; what a feature takes of them is declared in its fields.
            entries = {one.arg for one in node.args.args if one.arg in ("entry", "state", "value", "posted")}
            found += [
                f"{node.name} looks at the type of {ast.unparse(inner.args[0])}"
                for inner in ast.walk(node)
                if isinstance(inner, ast.Call) and getattr(inner.func, "id", "") in ("isinstance", "type")
                if entries & {name.id for name in ast.walk(inner.args[0]) if isinstance(name, ast.Name)}
            ]
    return found


def test_the_lessons_are_declared() -> None:
    assert {lesson.key for lesson in LESSONS if issubclass(lesson, DeclaredFeature)} == set(PACKAGES)
    assert {lesson.key for lesson in LESSONS} == set(PACKAGES)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_declared_lesson_names_no_handle_of_viser(package: str) -> None:
    for path in (ROOT / "lessons" / package).glob("*.py"):
        assert offences(path.read_text(encoding="utf-8")) == [], path.name


def test_offences_are_found() -> None:
    assert offences("import viser") == ["imports viser"]
    assert offences("from viser.infra import x") == ["imports viser.infra"]
    assert offences("from app.viewer.panel import Post, listen") == ["imports listen"]
    assert offences("def restore(self, state):\n    return isinstance(state['a'], int)") == [
        "restore looks at the type of state['a']"
    ]
    assert offences("from app.viewer.panel.status import Notice") == []
