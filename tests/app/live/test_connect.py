"""`kin.connect` against a page of the viewer: values both ways, threads, lost connections, refusals."""

from __future__ import annotations

import json
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_code import code_of, fail_network
from live_server import wait_for

import kin
from app import notebook
from app.live.client import Event, RefusedError
from app.notebook import child

DOCUMENT = (Path(__file__).parents[3] / "docs/connect.md").read_text(encoding="utf-8")
ARM = kin.get_robot("ur5")
Q = np.array([0.3, -1.2, 1.4, -0.4, 0.5, 0.2])


@pytest.fixture
def code(page) -> str:
    return code_of(page)


@pytest.fixture
def arm(viewer, code) -> Iterator[Any]:
    with kin.connect(f"http://127.0.0.1:{viewer}", code, name="arm.py", rate=60) as arm:
        yield arm


def shown(page: FakeBrowser, T: np.ndarray) -> None:
    page.wait(lambda: bool(np.allclose(page.tool_pose(), T, atol=1e-5)))


def test_what_is_assigned_is_shown_and_what_is_dragged_is_read(page, arm):
    assert arm.robot == ARM
    assert arm.connected
    arm.q = Q
    assert arm.q.tolist() == Q.tolist()
    shown(page, kin.fk(ARM, Q))
    T = kin.fk(ARM, Q)
    T[2, 3] += 0.05
    page.grab()
    page.drag(T)
    page.release()
    wait_for(lambda: np.allclose(kin.fk(ARM, arm.q), T, atol=1e-6))
    assert not np.allclose(arm.q, Q)


def test_a_target_is_answered_when_it_has_been_assigned(page, arm):
    arm.q = Q
    T = kin.fk(ARM, Q + 0.1)
    arm.target = T
    assert arm.result["status"] == "solved"
    assert arm.result["solutions"][0]["q"] == pytest.approx((Q + 0.1).tolist(), abs=1e-6)
    arm.target = [9.0, 0.0, 0.0]
    assert arm.result["status"] != "solved"
    assert arm.target[:3, 3].tolist() == [9.0, 0.0, 0.0]


def test_what_is_driven_is_shown_as_long_as_the_program_is_there(viewer, page, code):
    address = f"http://127.0.0.1:{viewer}"
    with kin.connect(address, code, drives="SO-101 at /dev/ttyACM0") as arm:
        page.wait(lambda: page.shown.get("driven") == "SO-101 at /dev/ttyACM0")
        assert arm.drives == "SO-101 at /dev/ttyACM0"
        arm.drives = None
        page.wait(lambda: page.shown.get("driven") == "")
        arm.drives = "SO-101"
        fail_network(arm)
        page.wait(lambda: page.shown.get("driven") == "")
        page.wait(lambda: page.shown.get("driven") == "SO-101")
        with pytest.raises(RefusedError, match="drives"):
            arm.drives = "x" * 61
        assert arm.drives == "SO-101"
    page.wait(lambda: page.shown.get("driven") == "")
    with pytest.raises(RefusedError, match="drives"):
        kin.connect(address, code, drives="")
    with kin.connect(address, code):
        pass  # the one that was refused has left


def test_a_fast_program_ends_where_it_says(page, arm):
    """Ten thousand a second: no error, and the last one is on show."""
    began = time.monotonic()
    for k in range(5000):
        arm.q = Q + 1e-4 * k * np.array([1, 0, 0, 0, 0, 0])
        time.sleep(max(0.0, began + 1e-4 * k - time.monotonic()))
    assert arm.q[0] == pytest.approx(Q[0] + 0.4999)
    shown(page, kin.fk(ARM, Q + np.array([0.4999, 0, 0, 0, 0, 0])))
    arm.q = Q  # nothing was refused
    time.sleep(0.1)
    arm.q = Q


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("q", [0.0] * 5, "expected 6 joint values in radians"),
        ("q", [0.0, np.nan, 0, 0, 0, 0], "finite"),
        ("q", [0.0, 99.0, 0, 0, 0, 0], "q[1]: got 99.0, expected -6.28319 to 6.28319"),
        ("measured", [0.0], "measured"),
        ("target", [0.0, 0.0], "a pose (4, 4) or a point (3,)"),
        ("target", np.full((4, 4), 7.0), "target.matrix"),
        ("robot", "ur500", "expected one of"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(page, arm, name, value, words):
    before = arm.q
    with pytest.raises(kin.KinematicsError) as refused:
        setattr(arm, name, value)
    assert words in str(refused.value)
    assert arm.q.tolist() == before.tolist()
    arm.q = Q
    shown(page, kin.fk(ARM, Q))


def test_another_arm_comes_with_its_table(page, arm):
    arm.robot = "pioneer5"
    assert arm.robot == kin.get_robot("pioneer5")
    own = kin.Robot.from_dh([[0.0, 0.0, 0.3, 0.0], [0.0, 0.0, 0.2, 0.0]])
    arm.robot = own
    assert arm.robot.n == 2
    arm.q = [0.2, 0.3]
    wait_for(lambda: arm.q.tolist() == [0.2, 0.3])
    page.wait(lambda: len(page.sliders_in("Joints")) == 2)


@pytest.mark.full
def test_readings_of_motors_show_the_real_arm_and_match_motors_takes_them(page, arm):
    with pytest.raises(kin.InputError, match="an arm with motors"):
        arm.readings = [1.0] * 6
    arm.robot = "so101"
    with pytest.raises(kin.InputError, match="readings: got '7 values'"):
        arm.readings = [1.0] * 7
    arm.readings = [10.0, -20.0, 30.0, 40.0, -50.0, 77.0]
    assert arm.readings.tolist() == [10.0, -20.0, 30.0, 40.0, -50.0]
    page.wait(lambda: "data-live-measured" in page.html)
    page.settle()
    page.set("All motors", "Match motors")
    page.wait(lambda: 'data-motors-pose="1"' in page.html)
    page.settle()
    arm.readings = [10.5, -20.0, 30.0, 40.0, -50.25]
    page.settle()
    page.set("Poses", "Read program")
    page.wait(lambda: page.value("Readings") == "10.5 -20 30 40 -50.25")


def test_a_motion_is_played_and_its_events_are_heard(page, arm):
    arm.q = Q
    program = kin.motion.Program(
        (kin.motion.Ptp(kin.motion.JointTarget(Q)), kin.motion.Ptp(kin.motion.JointTarget(Q + 0.2)))
    )
    events = arm.events()
    arm.play(kin.plan_motion(ARM, program, Q))
    playing = [event.value["playing"] for event in until(events, "program", lambda value: value["time"] > 0.1)]
    assert playing[-1]
    until(events, "program", lambda value: not value["playing"] and value["time"] > 0.1)
    wait_for(lambda: np.allclose(arm.q, Q + 0.2, atol=1e-6))
    arm.play()
    arm.stop()
    assert not arm.program["playing"]


def until(events: Iterator[Event], kind: str, condition: Any) -> list[Event]:
    """The events of a kind up to the one that fulfils a condition."""
    found = []
    for event in events:
        if event.kind == kind:
            found.append(event)
            if condition(event.value):
                return found
    raise AssertionError("the events have ended")


def test_obstacles_contacts_and_drawings(page, arm):
    arm.q = Q
    elbow = kin.link_frames(ARM, Q)[3, :3, 3]
    arm.place([kin.Obstacle("sphere", xyz=tuple(elbow), radius=0.1)])
    wait_for(lambda: bool(arm.contacts))
    assert arm.contacts[0]["obstacle"] == 0
    arm.place([])
    wait_for(lambda: not arm.contacts)
    arm.draw.line("wall", [[0, 0, 0], [1, 0, 0]])
    arm.draw.points("scan", np.random.default_rng(1).random((50, 3)), color="#2b8a3e")
    arm.draw.frame("goal", kin.fk(ARM, Q))
    arm.draw.label("name", [0, 0, 1], "goal")
    page.wait(lambda: len(drawn(page)) == 4)
    arm.draw.remove("scan")
    page.wait(lambda: len(drawn(page)) == 3)
    with pytest.raises(kin.InputError, match="at least 2 points"):
        arm.draw.line("wall", [[0, 0, 0]])
    with pytest.raises(RefusedError, match="color"):
        arm.draw.line("wall", [[0, 0, 0], [1, 0, 0]], color="red")
    with pytest.raises(kin.KinematicsError, match="at most 65536"):
        arm.draw.points("cloud", np.random.default_rng(1).random((5000, 3)))
    arm.draw.clear()
    page.wait(lambda: not drawn(page))


def drawn(page: FakeBrowser) -> list[str]:
    return [n for n in page.nodes if re.search(r"/connect-\d+/drawn", n) and page.visible.get(n, True)]


@pytest.mark.full
def test_a_lost_connection_comes_back_with_what_was_drawn(page, arm):
    arm.draw.label("name", [0, 0, 1], "goal")
    arm.measured = Q
    page.wait(lambda: len(drawn(page)) == 1)
    events = arm.events()
    fail_network(arm)
    until(events, "disconnected", lambda _: True)
    until(events, "connected", lambda _: True)
    page.wait(lambda: len(drawn(page)) == 1 and "data-live-measured" in page.html)
    arm.q = Q
    shown(page, kin.fk(ARM, Q))


@pytest.mark.full
def test_many_threads_may_use_it(page, arm):
    failed: list[BaseException] = []

    def work(k: int) -> None:
        try:
            for i in range(20):
                arm.q = Q + 0.001 * i
                arm.draw.label(f"label {k}", [0, 0, 0.1 * k], str(i))
                assert arm.q.shape == (6,)
        except BaseException as error:  # noqa: BLE001 - shown by the test
            failed.append(error)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    page.wait(lambda: len(drawn(page)) == 4)
    shown(page, kin.fk(ARM, Q + 0.019))


def test_a_withdrawn_code_is_said_by_every_use(page, arm):
    events = arm.events()
    page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
    for _ in events:  # ends
        pass
    assert not arm.connected
    for use in (lambda: arm.q, lambda: setattr(arm, "q", Q), arm.play, lambda: arm.draw.clear()):
        with pytest.raises(kin.KinematicsError, match="The page has withdrawn the code"):
            use()


def test_a_closed_page_leaves_no_thread_and_no_drawing(viewer, page, code):
    with kin.connect(f"http://127.0.0.1:{viewer}/viewer/#s=abc", code.lower()) as arm:
        arm.draw.label("name", [0, 0, 1], "goal")
        page.wait(lambda: len(drawn(page)) == 1)
        arm.q = Q
    page.wait(lambda: not drawn(page))
    shown(page, kin.fk(ARM, Q))  # what was assigned last has arrived
    ours = ("kinboard-receive", "kinboard-send")
    wait_for(lambda: not any(thread.name in ours for thread in threading.enumerate()), 5.0)
    with pytest.raises(kin.KinematicsError, match="has closed it"):
        arm.q = Q


def test_connections_that_cannot_be_say_why(viewer, page, code):
    with pytest.raises(kin.KinematicsError, match=r"no connection to 127\.0\.0\.1:9"):
        kin.connect("http://127.0.0.1:9", code)
    with pytest.raises(kin.KinematicsError, match="such as http://localhost:8000"):
        kin.connect("ftp://127.0.0.1", code)
    with pytest.raises(RefusedError, match="No page has the code ACDE-FGHJ") as refused:
        kin.connect(f"http://127.0.0.1:{viewer}", "ACDE-FGHJ")
    assert refused.value.problem["status"] == 404
    with (
        kin.connect(f"http://127.0.0.1:{viewer}", code, name="first.py"),
        pytest.raises(RefusedError, match=r"Another program is connected to this page: first\.py"),
    ):
        kin.connect(f"http://127.0.0.1:{viewer}", code)


def test_the_example_of_the_documents_runs(viewer, page, code):
    (text,) = re.findall(r"```py\n(import kin\n.*?)```", DOCUMENT, re.DOTALL)
    text = text.replace("http://localhost:8000", f"http://127.0.0.1:{viewer}").replace("K7QF-2M4A", code)
    exec(compile(text, "example", "exec"), {})
    page.settle()


class InProcess:
    """Stands for the process that serves a notebook: a viewer of the test's own."""

    alive = True

    def __init__(self, port: int) -> None:
        self.port = port

    def send(self, command: dict[str, Any]) -> None:
        child.follow([json.dumps(command)])


def frame(arm: notebook.ArmView, viewer: int) -> FakeBrowser:
    """A browser that opens the frame of the arm."""
    parts = urlsplit(arm.url)
    stored = {
        "state": parse_qs(parts.fragment)["s"][0],
        "shown": parse_qs(parts.query)["shown"][0],
        "address": f"http://127.0.0.1:{viewer}/",
    }
    return FakeBrowser(viewer, memory=json.dumps(stored))


def test_a_notebook_says_what_it_drives(viewer, monkeypatch):
    monkeypatch.setattr(notebook, "_service", InProcess(viewer))
    for name in ("", " \t", "x" * 61, "\x00", 3):
        with pytest.raises(kin.InputError, match=r"drives: got .*a name of at most 60 characters"):
            notebook.show("ur5", Q, None, 4.0, True, 400, 300, None, name)
    arm = notebook.show("ur5", Q, None, 4.0, True, 400, 300, None, "SO-101 at /dev/ttyACM0")
    with frame(arm, viewer) as page:
        page.wait(lambda: "data-live-code" in page.html)
        page.wait(lambda: "driven" in page.shown)
        assert page.shown["driven"] == "", "the notebook has not moved it yet"
        arm.q = Q + 0.1
        page.wait(lambda: page.shown.get("driven") == "SO-101 at /dev/ttyACM0")
        with pytest.raises(kin.InputError, match="drives"):
            arm.drives = "\n"
        assert arm.drives == "SO-101 at /dev/ttyACM0"
        arm.drives = None
        page.wait(lambda: page.shown.get("driven") == "")
        arm.drives = "Panda"
        page.wait(lambda: page.shown.get("driven") == "Panda")
        arm.page.close()
        page.wait(lambda: page.shown.get("driven") == "")


def test_a_notebook_reads_what_is_dragged_in_its_frame(viewer, monkeypatch):
    monkeypatch.setattr(notebook, "_service", InProcess(viewer))
    arm = notebook.show("ur5", Q, None, 4.0, True, 400, 300, None)
    assert arm.q.tolist() == Q.tolist()  # no frame is open
    for _ in range(40):  # which is no guess
        with pytest.raises(RefusedError, match="No page has the code"):
            _ = arm.page
    with frame(arm, viewer) as page:
        page.wait(lambda: "data-live-code" in page.html)
        shown(page, kin.fk(ARM, Q))
        T = kin.fk(ARM, Q)
        T[2, 3] += 0.05
        page.grab()
        page.drag(T)
        page.release()
        wait_for(lambda: np.allclose(kin.fk(ARM, arm.q), T, atol=1e-6))
        arm.q = Q + 0.1
        assert arm.q.tolist() == (Q + 0.1).tolist()
        shown(page, kin.fk(ARM, Q + 0.1))
        arm.page.target = kin.fk(ARM, Q)
        assert arm.page.result["status"] == "solved"
        arm.page.close()
