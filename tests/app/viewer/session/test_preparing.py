"""A page on a new machine: events wait for their kernels, and the page says so."""

from __future__ import annotations

import json
import re
import threading
import time
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer, wait_for

import kin
from app.api import ComputeSlots, api_routes
from app.classroom.tokens import read_code
from app.live import Lines
from app.live import line as live_line
from app.live.client import page as client_page
from app.live.line import Line, Program, Reply
from app.service.web.rooms.limits import Limits
from app.shared.clouds import Clouds
from app.shared.preparation import Preparation
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.arm import Arm
from app.viewer.server import ViewerServer
from app.viewer.session.preparing import HELD, Preparing
from app.viewer.session.state import PageState, encode
from kin.solvers import family_of
from kin.warmup import COLLISIONS, MOTIONS, all_of, parts

STORE = Store()
PIONEER, UR5, PLANAR = map(STORE.get, ("pioneer5", "ur5", "planar3r"))


@pytest.fixture
def preparation() -> Preparation:
    kin.warm_up()
    made = Preparation()
    made.begin()
    return made


@pytest.fixture
def lines() -> Lines:
    return Lines()


@pytest.fixture
def port(preparation: Preparation, lines: Lines) -> Iterator[int]:
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds(), lines=lines, preparation=preparation)) as port:
        yield port


def compile_parts(preparation: Preparation, names: Collection[str]) -> None:
    for name in names:
        while not preparation.ready((name,)):
            preparation.done(name)


def waits_for(tab: FakeBrowser, what: str) -> None:
    tab.wait(lambda: f"Preparing {what} for the first time on this machine" in tab.html)


def test_an_arm_opens_by_itself_when_it_is_compiled_and_the_page_can_be_used_meanwhile(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        assert "Preparing" not in tab.html
        tab.set("Robot", UR5.name)
        of = len(parts()[family_of(UR5)]) + len(parts()[COLLISIONS])
        waits_for(tab, "the UR5")
        tab.wait(lambda: f"step 1 of {of}" in tab.html)
        assert preparation.next() == (COLLISIONS, parts()[COLLISIONS][0]), (
            "both parts are wanted, this one comes first"
        )
        preparation.done(COLLISIONS)
        tab.wait(lambda: f"step 2 of {of}" in tab.html)
        tab.set("1 rotating base", 37.25)
        q = PIONEER.q_home.copy()
        q[0] = np.radians(37.25)
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(PIONEER, q)))
        assert "Preparing the UR5" in tab.html, "it does not end with other news"
        compile_parts(preparation, (COLLISIONS, family_of(UR5)))
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), kin.fk(UR5, UR5.q_home))


def test_the_last_choice_counts_and_the_arm_on_show_ends_the_waiting(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Robot", UR5.name)
        waits_for(tab, "the UR5")
        tab.set("Robot", PLANAR.name)
        waits_for(tab, f"the {PLANAR.name}")
        tab.set("Robot", PIONEER.name)
        tab.wait(lambda: "Preparing" not in tab.html)
        compile_parts(preparation, parts())
        tab.settle()
        assert tab.value("Robot") == PIONEER.name
        assert np.allclose(tab.tool_pose(), kin.fk(PIONEER, PIONEER.q_home))


def test_a_lesson_waits_for_what_it_calls(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Redundancy")
        waits_for(tab, "the lesson “Redundancy”")
        compile_parts(preparation, (all_of(family_of(PIONEER)),))
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert tab.value("Lesson") == "Redundancy"


def test_a_lesson_that_needs_nothing_opens_at_once_and_stays(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Redundancy")
        waits_for(tab, "the lesson “Redundancy”")
        tab.set("Lesson", "Screws")
        tab.wait(lambda: "Preparing" not in tab.html)
        compile_parts(preparation, parts())
        tab.settle()
        assert tab.value("Lesson") == "Screws", "it was chosen last"


def test_events_of_a_tab_wait(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.say("feature", ["program", ["record"], None])
        waits_for(tab, "“Program”")
        assert preparation.next() == (MOTIONS, parts()[MOTIONS][0])
        compile_parts(preparation, (MOTIONS,))
        tab.wait(lambda: "Preparing" not in tab.html)


def test_a_page_of_a_link_waits_for_its_arm_and_says_so(port, preparation):
    q = UR5.q_home + 0.1
    link = encode(PageState(robot="ur5", q=q, lesson="redundancy"))
    needed = (COLLISIONS, family_of(UR5), all_of(family_of(UR5)))
    of = sum(len(parts()[name]) for name in needed)
    with closing(FakeBrowser(port, memory=json.dumps({"state": link}))) as tab:
        tab.wait(lambda: f"Preparing the UR5 for the first time on this machine: step 1 of {of}" in preparing(tab))
        compile_parts(preparation, needed[:2])
        tab.wait(lambda: "step 1 of" not in preparing(tab))
        assert not any(m["type"] == "TransformControlsMessage" for m in tab.nodes.values()), (
            "its lesson needs more"
        )
        compile_parts(preparation, needed[2:])
        tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(UR5, q)))
        assert tab.value("Lesson") == "Redundancy"
        assert preparing(tab) == ""


def test_a_visitor_who_leaves_is_waited_for_no_longer(port, preparation):
    link = encode(PageState(robot="ur5"))
    with closing(FakeBrowser(port, memory=json.dumps({"state": link}))) as tab:
        tab.wait(lambda: preparing(tab) != "")
    wait_for(lambda: not any(thread.name.startswith("visitor-") for thread in threading.enumerate()))


def test_a_link_to_what_is_compiled_opens_at_once(port):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(lesson="screws"))})) as tab:
        tab.settle()
        assert tab.value("Lesson") == "Screws"
        assert "Preparing" not in tab.html


def preparing(tab: FakeBrowser) -> str:
    """What the cover of the page says that it waits for."""
    return tab.shown.get("preparing") or ""


def program(tab: FakeBrowser, lines: Lines) -> Line:
    """The line of the page, with a program connected to it."""
    tab.settle()
    tab.send("GuiUpdateMessage", uuid=tab.element("Connect a program"), updates={"value": True})
    tab.wait(lambda: "data-live-code" in tab.html)
    found = re.search(r"data-live-code>([A-Z0-9-]+)<", tab.html)
    assert found is not None
    line = lines.find(read_code(found[1]))
    assert line is not None
    line.connect(Program("arm.py", "session", lambda: None))
    return line


def test_a_robot_that_a_program_sends_waits_for_its_kernels(port, preparation, lines):
    q = UR5.q_home + 0.1
    with FakeBrowser(port) as tab:
        tab.settle()
        line = program(tab, lines)
        line.send({"robot": UR5, "q": q}, 1)
        waits_for(tab, "the UR5")
        assert tab.value("Robot") == PIONEER.name
        first, *more = line.replies()
        assert (first.number, first.problem) == (1, None)
        assert first.preparing is not None
        what, step, of = first.preparing
        assert (what, step) == ("the UR5", 1)
        assert set(more) <= {first}, "again now and then, so that the program knows that the page is there"
        compile_parts(preparation, (COLLISIONS,))
        tab.wait(lambda: f"step 1 of {of}" not in tab.html)
        later = [reply.preparing for reply in line.replies()]
        assert later
        assert all(at is not None and at[0] == what and 1 < at[1] <= at[2] for at in later)
        tab.say("undo")  # the page can be used meanwhile
        compile_parts(preparation, (family_of(UR5),))
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), kin.fk(UR5, q))
        assert [reply for reply in line.replies() if reply.preparing is None] == [Reply(1)]


@pytest.mark.full
def test_a_program_that_shows_another_arm_waits_until_it_is_compiled(preparation, lines, monkeypatch):
    monkeypatch.setattr(live_line, "PREPARING", 0.1)
    monkeypatch.setattr(client_page, "TIMEOUT", 0.5)
    state = {
        "settings": Settings(),
        "store": STORE,
        "compute": ComputeSlots(2, 5.0),
        "lines": lines,
        "tries": Limits(),
    }
    viewer = ViewerServer(STORE, Settings(), Clouds(), lines=lines, preparation=preparation)
    with serve_viewer(viewer, api_routes(), **state) as port, FakeBrowser(port) as tab:
        tab.settle()
        line = program(tab, lines)
        line.disconnect(line.program)
        with kin.connect(f"http://127.0.0.1:{port}", line.code) as arm, ThreadPoolExecutor() as pool:
            heard = arm.events()
            asked = pool.submit(setattr, arm, "robot", "ur5")
            event = next(each for each in heard if each.kind == "preparing")
            assert (event.value["what"], event.value["step"]) == ("the UR5", 1)
            time.sleep(1.2)  # longer than an answer may take
            assert not asked.done()
            compile_parts(preparation, (COLLISIONS, family_of(UR5)))
            asked.result(30)
            assert arm.robot == UR5


def test_an_impatient_visitor_fills_no_memory(preparation):
    class Page:
        """Has one tab that needs kernels."""

        lessons = None
        now = Arm(PIONEER, PIONEER.q_home, PIONEER.q_home)
        status = type("Status", (), {"wait": lambda self, words: None})()
        posted: list[object]

        class _Tab:
            key, title = "program", "Program"

            @staticmethod
            def kernels_of(key):
                return (MOTIONS,)

        features = (_Tab,)

        def post(self, key, value=None):
            self.posted.append(key)

    page = Page()
    page.posted = []
    held = Preparing(page, preparation)
    for number in range(3 * HELD):
        assert not held.admits(("feature", "program", number), None)
    compile_parts(preparation, (MOTIONS,))
    held.tick()
    assert page.posted == [("feature", "program", number) for number in range(2 * HELD, 3 * HELD)]
    assert held.due is None
