"""A page on a new machine: events wait for their kernels, and the page says so."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import serve_viewer

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
from app.viewer.panel.joints import label
from app.viewer.server import ViewerServer
from app.viewer.session.preparing import HELD, Preparing
from app.viewer.session.state import PageState, encode
from kin.solvers import family_of
from kin.warmup import COLLISIONS, MOTIONS, all_of, parts

STORE = Store()
PIONEER, UR5, PLANAR, PUMA, SCARA = map(STORE.get, ("pioneer5", "ur5", "planar3r", "puma560", "scara"))


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
        assert preparation.next() == (COLLISIONS, 0), "both parts are wanted, this one comes first"
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


def test_a_lesson_waits_for_what_it_calls_and_others_open_at_once(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.set("Lesson", "Redundancy")
        waits_for(tab, "the lesson “Redundancy”")
        tab.set("Lesson", "Screws")
        tab.settle()
        assert "Preparing" in tab.html
        compile_parts(preparation, (all_of(family_of(PIONEER)),))
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert tab.value("Lesson") == "Redundancy"


def test_events_of_a_tab_wait(port, preparation):
    with FakeBrowser(port) as tab:
        tab.settle()
        tab.say("feature", ["program", ["record"], None])
        waits_for(tab, "“Program”")
        assert preparation.next() == (MOTIONS, 0)
        compile_parts(preparation, (MOTIONS,))
        tab.wait(lambda: "Preparing" not in tab.html)


def test_a_link_opens_when_its_arm_is_compiled(port, preparation):
    q = UR5.q_home + 0.1
    link = encode(PageState(robot="ur5", q=q, lesson="redundancy"))
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        waits_for(tab, "the UR5")
        assert tab.value("Robot") == PIONEER.name
        assert arrows_of_hints(tab) == 0.0
        compile_parts(preparation, (COLLISIONS, family_of(UR5)))
        tab.settle()
        assert tab.value("Robot") == PIONEER.name, "its lesson needs more"
        compile_parts(preparation, (all_of(family_of(UR5)),))
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), kin.fk(UR5, q))
        assert tab.value("Lesson") == "Redundancy"
        tab.wait(lambda: arrows_of_hints(tab) > 0.0)


def test_a_link_to_what_is_compiled_opens_at_once(port):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(lesson="screws"))})) as tab:
        tab.settle()
        assert tab.value("Lesson") == "Screws"
        assert "Preparing" not in tab.html


def sliders(tab: FakeBrowser, name: str) -> list[str]:
    """The ids of the sliders with this label, one in each folder that shows the joints."""
    return [uuid for uuid, m in tab.gui.items() if m["type"] == "GuiSliderMessage" and m["props"]["label"] == name]


def has_arrows(tab: FakeBrowser) -> bool:
    """Whether the target of the arm on show can be seen, and dragged."""
    return tab.visible.get(tab.gizmo, True)


def arrows_of_hints(tab: FakeBrowser) -> float:
    """How long the arrows are of which the first hint speaks; 0: it is not shown."""
    found = re.search(r'data-hints="\S+ \S+ (\S+)"', tab.html)
    assert found is not None
    return float(found[1])


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


@pytest.mark.parametrize(
    "event", [("jog", ["tool", 0, 1, 10]), ("nudge", [2, False, 1, False]), ("target", ["position", "100 0 100"])]
)
def test_what_would_move_the_arm_on_show_says_that_the_page_waits_for_that_of_a_link(port, preparation, event):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(robot="puma560"))})) as tab:
        waits_for(tab, "the PUMA 560")
        tab.wait(lambda: not has_arrows(tab))
        before = tab.value(label(PIONEER, 0))
        tab.set(label(PIONEER, 0), before + 20.0)
        tab.wait(lambda: tab.value(label(PIONEER, 0)) == before)
        number = tab.say(*event)
        refused = "The page waits for the PUMA 560. It can be moved when it is there."
        tab.wait(lambda: refused in tab.html)
        tab.wait(lambda: tab.script["reply"][:2] == [number, refused])
        compile_parts(preparation, parts())
        tab.wait(lambda: "Preparing" not in tab.html and tab.value("Robot") == PUMA.name)
        tab.settle()
        assert has_arrows(tab)
        assert np.allclose(tab.tool_pose(), kin.fk(PUMA, PUMA.q_home))


def test_the_arm_on_show_can_be_dragged_again_when_another_robot_is_chosen(port, preparation):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(robot="puma560"))})) as tab:
        waits_for(tab, "the PUMA 560")
        tab.wait(lambda: not has_arrows(tab))
        tab.set("Robot", PLANAR.name)
        waits_for(tab, f"the {PLANAR.name}")
        tab.wait(lambda: has_arrows(tab))
        tab.wait(lambda: arrows_of_hints(tab) > 0.0)


def test_a_lesson_chosen_before_the_arm_of_a_link_is_compiled_opens_with_that_arm(port, preparation):
    link = encode(PageState(robot="puma560", lesson="velocity"))
    with FakeBrowser(port, memory=json.dumps({"state": link})) as tab:
        waits_for(tab, "the PUMA 560")
        tab.set("Lesson", "Screws")
        tab.settle()
        compile_parts(preparation, parts())
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert tab.value("Robot") == PUMA.name
        assert tab.value("Lesson") == "Screws", "it is not lost to that of the link"
        assert 'data-lesson="Screws"' in tab.html


def test_a_lesson_chosen_for_a_link_opens_with_another_robot_that_is_chosen_instead(port, preparation):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(robot="ur5"))})) as tab:
        waits_for(tab, "the UR5")
        tab.set("Lesson", "Screws")
        tab.set("Robot", PLANAR.name)
        waits_for(tab, f"the {PLANAR.name}")
        compile_parts(preparation, parts())
        tab.wait(lambda: "Preparing" not in tab.html and 'data-lesson="Screws"' in tab.html)
        assert tab.value("Robot") == PLANAR.name


def test_what_a_program_sends_waits_for_the_arm_of_a_link(port, preparation, lines):
    q = SCARA.q_home + 0.05
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(robot="scara"))})) as tab:
        waits_for(tab, f"the {SCARA.name}")
        line = program(tab, lines)
        line.send({"q": q}, 1)
        tab.settle()
        assert all(reply.preparing is not None for reply in line.replies())
        compile_parts(preparation, parts())
        tab.wait(lambda: "Preparing" not in tab.html)
        tab.settle()
        assert np.allclose(tab.tool_pose(), kin.fk(SCARA, q))
        assert [reply for reply in line.replies() if reply.preparing is None] == [Reply(1)]


def test_a_program_that_sends_q_for_a_link_is_answered_if_another_robot_is_chosen(port, preparation, lines):
    with FakeBrowser(port, memory=json.dumps({"state": encode(PageState(robot="scara"))})) as tab:
        waits_for(tab, f"the {SCARA.name}")
        line = program(tab, lines)
        line.send({"q": SCARA.q_home}, 1)
        tab.settle()
        tab.set("Robot", PLANAR.name)
        waits_for(tab, f"the {PLANAR.name}")
        tab.settle()
        (reply,) = [reply for reply in line.replies() if reply.preparing is None]
        assert reply.number == 1
        assert reply.problem is not None, "it has too many values for the arm on show"


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
