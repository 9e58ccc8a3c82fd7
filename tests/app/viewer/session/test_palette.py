"""The command palette: what the registries know is in it, and a command does what the control does."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from fake_browser import FakeBrowser

from app.exercises import builtin_exercises
from app.shared.store import Store
from app.viewer.lessons import LESSONS
from app.viewer.scene.viewpoints import SIDES
from app.viewer.session.events import MESSAGES, RULES
from app.viewer.session.palette import ACTIONS, commands
from app.viewer.tabs import TABS
from app.viewer.tabs.program.views import MOTIONS
from app.viewer.tabs.robot.files import KINDS


@pytest.fixture(scope="module")
def page(port) -> Iterator[FakeBrowser]:
    with FakeBrowser(port) as page:
        yield page


def registered(page: FakeBrowser) -> dict[str, str]:
    """The ids of the commands by their labels."""
    return {m["props"]["label"]: m["uuid"] for m in page.log if m["type"] == "RegisterCommandMessage"}


def run(page: FakeBrowser, label: str) -> None:
    page.send("CommandTriggerMessage", uuid=registered(page)[label])


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
    found = registered(page)
    assert {f"Save the arm as {about}" for about, *_ in KINDS.values()} <= set(found)
    assert {f"Save the motion as {title}" for title in MOTIONS.values()} <= set(found)
    assert "Save the worksheet as CSV" in found
    abouts = {
        m["props"]["label"]: m["props"]["description"] for m in page.log if m["type"] == "RegisterCommandMessage"
    }
    assert abouts["Undo"] == "Ctrl+Z"
    assert all(m["props"]["hotkey"] is None for m in page.log if m["type"] == "RegisterCommandMessage"), "ours act"


def test_commands_do_what_the_controls_do(page):
    run(page, "Arm: UR5")
    page.wait(lambda: page.value("Robot") == "UR5")
    page.wait(lambda: page.script["undo"] == "Robot")
    run(page, "Undo")
    page.wait(lambda: page.value("Robot") != "UR5")
    run(page, "Exercise: " + builtin_exercises()[0].title)
    page.wait(lambda: page.value("Lesson") == "Exercises" and builtin_exercises()[0].title in page.html)
    assert "tab" in page.kept_as
    run(page, f"Lesson: {LESSONS[0].title}")
    page.wait(lambda: page.value("Lesson") == LESSONS[0].title)
    run(page, "Save the arm as URDF")
    page.wait(lambda: any(m["type"].startswith("FileTransferStart") for m in page.log))


def test_a_page_that_shows_the_scene_alone_has_none(port):
    with FakeBrowser(port, memory=json.dumps({"embedded": "scene"})) as page:
        page.settle()
        assert not registered(page)
