"""The command palette: what the registries know is in it, and a command does what the control does."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from fake_browser import FakeBrowser

from app.exercises import builtin_exercises
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.events import MESSAGES, RULES
from app.viewer.session.palette import ACTIONS, Palette, commands
from app.viewer.tabs import TABS
from app.viewer.tabs.program.views import MOTIONS
from app.viewer.tabs.robot.files import KINDS


@pytest.fixture(scope="module")
def page(port) -> Iterator[FakeBrowser]:
    with FakeBrowser(port) as page:
        yield page


def test_everything_that_the_registries_know_is_listed_once():
    names = [robot.name for robot in Store().robots]
    labels = [each.label for each in commands(TABS, (), names, builtin_exercises())]
    assert {f"Lesson: {lesson.title}" for lesson in LESSONS} <= set(labels)
    assert {f"Exercise: {each.title}" for each in builtin_exercises()} <= set(labels)
    assert {f"Arm: {name}" for name in names} <= set(labels)
    assert {f"Look from: {side}" for side in SIDES} <= set(labels)
    assert {"Move", "Learn", "View", *(tab.title for tab in TABS)} <= set(labels)
    assert {label for _, label, _ in ACTIONS} <= set(labels)
    assert len(labels) == len(set(labels))
    assert {event for event, *_ in ACTIONS} <= set(RULES)
    assert "feature" in MESSAGES


def test_a_page_offers_it_all_with_its_exports_and_the_keys(page):
    found = page.commands
    assert {f"Save the arm as {about}" for about, *_ in KINDS.values()} <= set(found)
    assert {f"Save the motion as {title}" for title in MOTIONS.values()} <= set(found)
    assert "Save the worksheet as CSV" in found
    abouts = {
        m["props"]["label"]: m["props"]["description"] for m in page.log if m["type"] == "RegisterCommandMessage"
    }
    assert abouts["Undo"] == "Ctrl+Z"
    assert all(m["props"]["hotkey"] is None for m in page.log if m["type"] == "RegisterCommandMessage"), "ours act"


def test_commands_do_what_the_controls_do(page):
    page.trigger("Arm: UR5")
    page.wait(lambda: page.value("Robot") == "UR5")
    page.wait(lambda: page.script["undo"] == "Robot")
    page.trigger("Undo")
    page.wait(lambda: page.value("Robot") != "UR5")
    page.trigger("Exercise: " + builtin_exercises()[0].title)
    page.wait(lambda: page.value("Lesson") == "Exercises" and builtin_exercises()[0].title in page.html)
    assert "tab" in page.kept_as
    page.trigger(f"Lesson: {LESSONS[0].title}")
    page.wait(lambda: page.value("Lesson") == LESSONS[0].title)
    page.trigger("Save the arm as URDF")
    page.wait(lambda: any(m["type"].startswith("FileTransferStart") for m in page.log))


def test_an_exercise_is_opened_in_one_step_and_no_other_one_on_the_way(port):
    first, other = builtin_exercises()[:2]
    with FakeBrowser(port) as page:
        page.trigger(f"Exercise: {first.title}")
        page.wait(lambda: f'data-exercise="{first.id}"' in page.html)
        page.trigger(f"Lesson: {LESSONS[0].title}")
        page.wait(lambda: page.value("Lesson") == LESSONS[0].title and page.script["undo"] == "Lesson")
        page.trigger(f"Exercise: {other.title}")
        page.wait(lambda: f'data-exercise="{other.id}"' in page.html and page.script["undo"] == "Exercise")
        page.trigger("Undo")
        page.wait(lambda: page.script["redo"] == "Exercise")
        page.wait(lambda: page.value("Lesson") == LESSONS[0].title)


def test_an_own_arm_is_found_while_there_is_one(port):
    with FakeBrowser(port) as page:
        page.settle()
        before = set(page.commands)
        page.say("feature", ["robot", ["start"], "planar-2r"])
        page.wait(lambda: "My arm" in page.value("Robot"))
        mine = f"Arm: {page.value('Robot')}"
        page.wait(lambda: set(page.commands) == before | {mine})
        page.say("feature", ["robot", ["delete"], None])
        page.wait(lambda: set(page.commands) == before)
        page.say("undo")
        page.wait(lambda: set(page.commands) == before | {mine})


def test_exercises_that_come_and_go_are_renewed_and_others_stay():
    there: dict[str, int] = {}  # how often each was registered

    def add_command(label: str, description: str | None) -> SimpleNamespace:
        there[label] = there.get(label, 0) + 1
        return SimpleNamespace(on_trigger=lambda act: act, remove=lambda: there.pop(label))

    first, other, last = builtin_exercises()[:3]
    palette = Palette(cast(Any, SimpleNamespace(add_command=add_command)), TABS, cast(Any, None), cast(Any, None))
    palette.renew((), ("A",), (first, other))
    palette.renew((), ("A",), (replace(first, topic="Another topic"), last))
    exercises = {label for label in there if label.startswith("Exercise: ")}
    assert exercises == {f"Exercise: {first.title}", f"Exercise: {last.title}"}
    assert set(there.values()) == {1}, "what stays is not registered again"


def test_a_page_that_shows_the_scene_alone_has_none(port):
    with FakeBrowser(port, memory=json.dumps({"embedded": "scene"})) as page:
        page.settle()
        assert not page.commands
