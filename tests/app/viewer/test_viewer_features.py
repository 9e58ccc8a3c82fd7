"""Lessons and tabs in a visitor's page: when they are called, and that errors in them stay contained."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

import kin
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer import lessons
from app.viewer.feature import Feature, Stage
from app.viewer.lessons.guide.lesson import Lesson
from app.viewer.lessons.guide.outline import Choice, Option, Outline, Step
from app.viewer.panel import listen
from app.viewer.server import ViewerServer
from app.viewer.session import lessons as choice
from app.viewer.session import page
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

VIEWER = Path(__file__).parents[3] / "app" / "viewer"
STORE = Store()
PIONEER, OTHER = STORE.get("pioneer5"), STORE.get("puma560")


class Witness(Feature):
    """Records its calls."""

    key = "witness"
    title = "Witness"
    calls: ClassVar[list[tuple[object, ...]]] = []
    threads: ClassVar[set[str]] = set()

    def __init__(self, stage):
        super().__init__(stage)
        self.note("made", stage.arm.now.robot.id)
        listen(stage.client.gui.add_slider(self.title, 0, 10, 1, 0), self.post, "slider")

    def note(self, *call):
        self.calls.append(call)
        self.threads.add(threading.current_thread().name)

    def handle(self, key, value):
        self.note("handle", key, value)
        if value == 9:
            raise RuntimeError("broken on purpose")
        if value == 8:
            self.due = 0.01
        if value == 7:
            self.stage.arm.move_to(self.stage.arm.now.robot.lower)

    def on_robot(self):
        self.note("robot", self.stage.arm.now.robot.id)

    def on_arm_changed(self, changed):
        self.note("arm", *self.stage.arm.now.q)

    def on_result(self, result):
        self.note("result", result.status)

    def on_style(self):
        self.note("style", self.stage.display.units, self.stage.display.dark)

    def tick(self, now):
        self.note("tick")
        self.due = None if len([c for c in self.calls if c == ("tick",)]) > 4 else 0.01

    def remove(self):
        self.note("remove")


class Pupil(Witness, Lesson):
    key = "pupil"
    title = "Pupil"
    about = "Learns & reports."

    @staticmethod
    def outline(robot, units, text=None):
        sum_ = Choice("1 + 1?", (Option("2", "Counted.", True), Option("3", "One too many.")))
        return Outline("You can count.", (Step("Sums", f"At the {robot.id}.", sum_, "It is 2."),), (sum_,))


@pytest.fixture
def tab(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeBrowser]:
    monkeypatch.setattr(page, "TABS", (Witness,))
    monkeypatch.setattr(choice, "LESSONS", (Pupil,))
    Witness.calls.clear()
    Witness.threads.clear()
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as port, FakeBrowser(port) as opened:
        opened.settle()
        yield opened


def wait_for_call(tab: FakeBrowser, *call: object, times: int = 1) -> None:
    end = time.monotonic() + 10.0
    while Witness.calls.count(call) < times:
        tab.read(0.05)
        assert time.monotonic() < end, Witness.calls


@pytest.mark.full
def test_a_tab_is_called_by_the_workers_threads_alone(tab: FakeBrowser) -> None:
    assert Witness.calls[0] == ("made", "pioneer5")
    tab.set("Witness", 3)
    wait_for_call(tab, "handle", "slider", 3)
    tab.set("1 rotating base", 50)
    q = PIONEER.q_home.copy()
    q[0] = np.radians(50)
    wait_for_call(tab, "arm", *q)
    T = kin.fk(PIONEER, PIONEER.q_home)
    tab.drag(T)
    wait_for_call(tab, "result", "solved")
    tab.set("Radians", True)
    wait_for_call(tab, "style", Units(degrees=False), False)
    tab.set("Lengths", "cm")
    wait_for_call(tab, "style", Units(False, "cm"), False)
    tab.set("Page colours", "Dark")
    wait_for_call(tab, "style", Units(False, "cm"), True)
    tab.set("Robot", OTHER.name)
    wait_for_call(tab, "robot", "puma560")
    assert {name.partition("-")[0] for name in Witness.threads} == {"visitors"}


def test_a_feature_gets_its_ticks_and_then_none(tab: FakeBrowser) -> None:
    tab.set("Witness", 8)
    wait_for_call(tab, "tick", times=5)
    tab.settle()
    assert Witness.calls.count(("tick",)) == 5


def test_a_feature_moves_the_arm(tab: FakeBrowser) -> None:
    tab.set("Witness", 7)
    tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(PIONEER, PIONEER.lower), atol=1e-9))


def test_an_error_in_a_feature_is_reported_and_the_page_keeps_working(
    tab: FakeBrowser, caplog: pytest.LogCaptureFixture
) -> None:
    tab.set("Witness", 9)
    tab.wait(lambda: "Something went wrong" in tab.html)
    assert "broken on purpose" in caplog.text
    tab.set("1 rotating base", 50)
    tab.wait(lambda: 'data-status="hand"' in tab.html)


def test_one_lesson_at_a_time(tab: FakeBrowser) -> None:
    assert len([c for c in Witness.calls if c[0] == "made"]) == 1
    assert "Learns &amp; reports." in tab.html, "the list of lessons"
    tab.set("Lesson", "Pupil")
    wait_for_call(tab, "made", "pioneer5")
    tab.wait(lambda: "Learns" not in tab.html)
    tab.wait(lambda: "Pupil" in tab.sliders)
    tab.set("Pupil", 4)
    wait_for_call(tab, "handle", "slider", 4)
    tab.set("Lesson", "None")
    wait_for_call(tab, "remove")
    tab.wait(lambda: "Pupil" not in tab.sliders)
    tab.wait(lambda: "Learns &amp; reports." in tab.html)


def test_an_unknown_lesson_is_refused_by_name(tab: FakeBrowser) -> None:
    tab.set("Lesson", "Astrology")
    tab.wait(lambda: "Astrology" in tab.html)
    assert "Invalid input" in tab.html
    tab.wait(lambda: tab.value("Lesson") == "None")


def test_every_lesson_has_a_short_description() -> None:
    assert all(lesson.about.endswith(".") and len(lesson.about) < 100 for lesson in lessons.LESSONS)


def test_keys_and_titles_are_unique() -> None:
    features = [*lessons.LESSONS, *page.TABS]
    assert len({f.key for f in features}) == len({f.title for f in features}) == len(features)


def test_features_get_the_parts_of_the_page_and_use_each_of_them():
    methods = {name for name, value in vars(Stage).items() if callable(value) and not name.startswith("_")}
    assert methods == {"post", "open_choice"}, "what a part can do stands in its class"
    sources = [path.read_text(encoding="utf-8") for path in VIEWER.rglob("*.py") if "session" not in path.parts]
    used = {name for source in sources for name in re.findall(r"\b_?stage\.(\w+)", source)}
    assert {*Stage.__annotations__, *methods} <= used
