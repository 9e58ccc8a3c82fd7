"""A program and a page of the viewer: what the program moves is seen, undone, and heard back."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import wait_for
from playwright._impl._driver import compute_driver_executable
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

import kin
from app.live import VALUES
from app.service.main import create_app
from app.shared.settings import Settings
from app.viewer.declared.scene import Lazy, SceneView
from app.viewer.live.drawings import merged, nodes

ROOT = Path(__file__).parents[3]
DOCUMENT = (ROOT / "docs/connect.md").read_text(encoding="utf-8")
ARM = kin.get_robot("ur5")
Q = [0.3, -1.2, 1.4, -0.4, 0.5, 0.2]
SPHERE = {"shape": "sphere", "xyz": [1.5, 0.0, 0.5], "radius": 0.1}
MOVES = {"segments": [{"kind": "ptp", "q": Q}, {"kind": "ptp", "q": [0.5, -1.2, 1.4, -0.4, 0.5, 0.2]}]}

SLOW = {"segments": [MOVES["segments"][0], {"kind": "dwell", "seconds": 60.0}, MOVES["segments"][1]]}


class Program:
    """A program that is connected to a page."""

    def __init__(self, port: int, page: FakeBrowser, name: str = "arm.py") -> None:
        press(page, "Connect a program")
        page.wait(lambda: "data-live-code" in page.html)
        found = re.search(r"data-live-code>([A-Z0-9-]+)<", page.html)
        assert found is not None
        self.code = found[1]
        self._numbers = 0
        self.heard: dict[str, Any] = {}
        self.socket: ClientConnection = connect(
            f"ws://127.0.0.1:{port}/api/v1/live/{self.code}?name={name}", proxy=None, max_size=None
        )
        self.until("welcome")
        page.wait(lambda: f'data-live="{name}"' in page.html)

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def until(self, kind: str, seconds: float = 10.0) -> dict[str, Any]:
        """The next message of this type; news on the way are noted."""
        deadline = time.monotonic() + seconds
        while True:
            message = dict(json.loads(self.socket.recv(timeout=max(0.0, deadline - time.monotonic()))))
            if message["type"] == "news":
                self.heard |= message
            if message["type"] == kind:
                return message

    def do(self, **message: Any) -> None:
        """Send a message, and wait until the page shows it."""
        self._numbers += 1
        self.send(id=self._numbers, **message)
        assert self.until("done")["id"] == self._numbers

    def refused(self, **message: Any) -> dict[str, Any]:
        """The problem of a message that is refused."""
        self.send(id=0, **message)
        return dict(self.until("problem")["problem"])

    def hears(self, name: str, condition: Any, seconds: float = 10.0) -> Any:
        """Wait for a value that fulfils a condition."""
        deadline = time.monotonic() + seconds
        while name not in self.heard or not condition(self.heard[name]):
            self.until("news", deadline - time.monotonic())
        return self.heard[name]


def press(page: FakeBrowser, label: str) -> None:
    page.send("GuiUpdateMessage", uuid=page.element(label), updates={"value": True})


def driven(page: FakeBrowser) -> str:
    """What the page says that it drives."""
    return str(page.shown.get("driven", ""))


def undo(page: FakeBrowser) -> str:
    return str(page.script["undo"])


@pytest.fixture
def program(viewer, page) -> Iterator[Program]:
    with Program(viewer, page) as program:
        yield program


def test_q_moves_the_arm_and_a_burst_is_one_step_of_undo(page, program):
    before = page.tool_pose()
    for k in range(20):
        program.send(q=[0.3, -1.2 + 0.01 * k, 1.4, -0.4, 0.5, 0.2])
    program.do(q=Q)
    page.settle()
    assert page.tool_pose() == pytest.approx(kin.fk(ARM, Q), abs=1e-5)
    page.wait(lambda: "arm.py" in page.html and undo(page) == "Connected program")
    page.say("undo")
    page.wait(lambda: bool(np.allclose(page.tool_pose(), before, atol=1e-5)))
    assert undo(page) != "Connected program"


@pytest.mark.full
def test_a_target_is_solved_as_if_it_were_dragged_and_its_answer_is_heard(page, program):
    program.send(subscribe={"values": ["q", "target", "result", "contacts"], "rate": 60})
    T = kin.fk(ARM, Q)
    program.do(target={"matrix": T.tolist()})
    result = program.hears("result", lambda found: found is not None)
    assert result["status"] == "solved"
    q = program.hears("q", lambda q: np.allclose(kin.fk(ARM, q), T, atol=1e-6))
    page.settle()
    assert page.tool_pose() == pytest.approx(kin.fk(ARM, q), abs=1e-5)
    program.do(target={"position": [0.4, 0.1, 0.5]})
    q = program.hears("q", lambda q: np.allclose(kin.fk(ARM, q)[:3, 3], [0.4, 0.1, 0.5], atol=1e-6))
    assert kin.fk(ARM, q)[:3, :3] == pytest.approx(T[:3, :3], abs=1e-6)
    program.do(target={"position": [9.0, 0.0, 0.0]})
    assert program.hears("result", lambda found: found["status"] != "solved")["reason"]
    assert program.hears("target", lambda target: target is not None)["position"] == pytest.approx([9, 0, 0])


def test_what_the_visitor_drags_is_heard_and_holds_the_arm_meanwhile(page, program):
    program.send(subscribe={"values": ["q", "target"], "rate": 60})
    program.do(q=Q)
    T = kin.fk(ARM, Q)
    T[2, 3] += 0.05
    page.grab()
    page.drag(T)
    q = program.hears("q", lambda q: np.allclose(kin.fk(ARM, q), T, atol=1e-5))
    said = program.refused(q=Q)
    assert said["status"] == 409
    assert said["detail"] == "The visitor holds the target."
    page.release()
    page.settle()
    program.do(q=Q)
    program.hears("q", lambda found: np.allclose(found, Q))
    assert not np.allclose(q, Q)


def test_another_arm_obstacles_and_contacts(page, program):
    program.send(subscribe={"values": ["contacts", "q"], "rate": 60})
    program.do(robot="pioneer5", q=[1.0, 0.5, 0.5, 0.5, 0.5])
    page.wait(lambda: page.value("Robot") == kin.get_robot("pioneer5").name)
    program.do(robot="ur5", q=Q)
    elbow = kin.link_frames(ARM, np.array(Q))[3, :3, 3]
    program.do(obstacles=[SPHERE | {"xyz": elbow.tolist()}])
    contacts = program.hears("contacts", bool)
    assert contacts[0]["obstacle"] == 0
    program.do(obstacles=[])
    assert program.hears("contacts", lambda found: not found) == []


def test_an_own_arm_is_shown_and_described(page, program):
    rows = [{"name": "a", "a": 0.3}, {"name": "b", "a": 0.2}]
    table = {"name": "Two bars", "convention": "standard", "units": {"length": "m", "angle": "deg"}, "rows": rows}
    program.do(robot=table, q=[0.1, 0.2])
    robot = program.hears("robot", lambda robot: robot["name"] == "Two bars")
    assert [joint["name"] for joint in robot["joints"]] == ["a", "b"]
    error = program.refused(q=Q)["errors"][0]
    assert error["expected"].startswith("2 values")


def test_a_program_is_loaded_played_and_heard(page, program):
    program.send(subscribe={"values": ["program", "q"], "rate": 60})
    program.do(program=MOVES, play=True)
    assert program.hears("program", lambda found: found["playing"])["items"] == 2
    ended = program.hears("program", lambda found: not found["playing"] and found["time"] > 0.0)
    assert ended["time"] == pytest.approx(ended["duration"])
    assert program.hears("q", lambda q: np.allclose(q, MOVES["segments"][1]["q"], atol=1e-4))
    page.say("undo")
    assert program.hears("program", lambda found: found["items"] == 0)
    assert program.refused(play=True)["errors"][0]["field"] == "play"


def test_an_impossible_program_changes_nothing(page, program):
    program.send(subscribe={"values": ["program"], "rate": 60})
    program.do(program=MOVES)
    far = {"segments": [{"kind": "ptp", "position": [9.0, 0.0, 0.0]}]}
    assert program.refused(program=far)["errors"]
    assert program.hears("program", bool)["items"] == 2


def test_drawings_come_change_and_go_with_the_program(page, program):
    def drawn() -> list[str]:
        return sorted(
            m["type"]
            for n, m in page.nodes.items()
            if re.search(r"/connect-\d+/drawn", n) and page.visible.get(n, True)
        )

    line = {"kind": "line", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}
    points = {"kind": "points", "points": [[0.1 * k, 0, 0.2] for k in range(10)], "color": "#00ff00"}
    frame = {"kind": "frame", "position": [0.2, 0.2, 0.2]}
    label = {"kind": "label", "position": [0.2, 0.2, 0.4], "text": "goal"}
    program.do(draw={"wall": line, "scan": points, "place": frame, "name": label})
    page.wait(lambda: len(drawn()) == 4)
    assert [kind.removesuffix("Message") for kind in drawn()] == ["Frame", "Label", "LineSegments", "PointCloud"]
    program.do(draw={"wall": None, "scan": points | {"color": "#ff0000"}})
    page.wait(lambda: len(drawn()) == 3)
    said = program.refused(draw={f"point {k}": label for k in range(101)})
    assert said["errors"][0]["expected"] == "at most 100 in a page"
    program.do(q=Q)
    page.settle()
    assert len(drawn()) == 3
    program.socket.close()
    page.wait(lambda: not drawn())


def test_a_measured_arm_is_a_ghost_with_a_difference_per_joint(page, program):
    def ghosts() -> list[dict[str, Any]]:
        return [m for n, m in page.nodes.items() if n.endswith("/measured") and page.visible.get(n, True)]

    program.do(q=Q)
    program.do(measured=[Q[0] + np.radians(2.0), *Q[1:]])
    page.wait(lambda: len(ghosts()) == 1 and "data-live-measured" in page.html)
    rows = re.findall(
        r"<tr><th>([^<]+)</th>((?:<td[^>]*>[^<]*</td>)+)", page.html.split("data-live-measured", 1)[1]
    )
    gaps = {name: re.findall(r"<td[^>]*>([^<]*)</td>", cells)[1] for name, cells in rows[1:7]}
    assert list(gaps.values()) == ["2.0", "0.0", "0.0", "0.0", "0.0", "0.0"]
    program.do(measured=None)
    page.wait(lambda: not ghosts() and "data-live-measured" not in page.html)


def test_stop_in_the_status_card_ends_the_connection(page, program):
    page.wait(lambda: "arm.py is connected." in page.html)
    page.say("feature", ["connect", ["stop", 0], None])
    assert program.until("end")["reason"] == "The page has withdrawn the code."
    page.wait(lambda: 'data-guide-do="stop"' not in page.html)


def test_stop_stops_the_program_that_the_connection_plays(page, program):
    program.do(program=SLOW, play=True)
    page.wait(lambda: 'data-playing="1"' in page.html)
    page.say("feature", ["connect", ["stop", 0], None])
    page.wait(lambda: 'data-playing="0"' in page.html)
    assert program.until("end")


def test_what_the_visitor_plays_goes_on_when_the_connection_ends(page, program):
    program.do(program=SLOW, play=True)
    for state in "01":
        page.say("feature", ["program", ["play", int(state)], None])
        page.wait(lambda state=state: f'data-playing="{state}"' in page.html)
    page.say("feature", ["connect", ["stop", 0], None])
    assert program.until("end")
    number = page.say("feature", ["connect", ["stop", 0], None])  # a later step of the page
    page.wait(lambda: page.script["reply"][0] >= number)
    assert 'data-playing="1"' in page.html


def test_a_withdrawn_code_ends_the_connection(page, program):
    program.do(measured=Q)
    press(page, "Withdraw the code")
    assert program.until("end")["reason"] == "The page has withdrawn the code."
    with pytest.raises(ConnectionClosed):
        program.socket.recv(timeout=10)
    page.wait(lambda: "data-live-code" not in page.html and "data-live-measured" not in page.html)


def test_a_page_that_leaves_ends_the_connection(viewer):
    page = FakeBrowser(viewer)
    page.wait(
        lambda: bool(page.gui) and any(m["props"].get("label") == "Connect a program" for m in page.gui.values())
    )
    with Program(viewer, page) as program:
        page.close()
        assert program.until("end")["reason"] == "The page was closed."


@pytest.mark.full
def test_no_link_holds_a_code(page, program):
    program.do(q=Q, draw={"a": {"kind": "label", "position": [0, 0, 1], "text": "secret"}})
    stored = page.stored()
    assert program.code.replace("-", "") not in stored
    assert "secret" not in stored


def test_what_a_program_drives_is_said_until_it_stops_or_leaves(viewer, page, program):
    assert driven(page) == ""
    program.do(drives="SO-101 at <ttyACM0>")
    page.wait(lambda: driven(page) == "SO-101 at <ttyACM0>")
    for wrong in ("", "x" * 61, " \u200b ", 7, ["SO-101"]):
        (error,) = program.refused(drives=wrong)["errors"]
        assert error["field"] == "drives"
    assert driven(page) == "SO-101 at <ttyACM0>", "a message that is refused changes nothing"
    program.do(robot="scara", q=[0.1, 0.2, 0.1, 0.0])
    page.wait(lambda: undo(page) == "Connected program")
    page.say("undo")
    page.wait(lambda: undo(page) != "Connected program")
    assert driven(page), "nothing else ends it"
    program.do(drives=None)
    page.wait(lambda: driven(page) == "")
    assert "safety function" not in page.html
    program.do(drives="SO-101")
    page.wait(lambda: driven(page) == "SO-101")
    program.socket.close()
    page.wait(lambda: driven(page) == "")


def test_the_code_that_is_withdrawn_ends_what_is_driven(page, program):
    program.do(drives="SO-101")
    page.wait(lambda: driven(page) == "SO-101")
    press(page, "Withdraw the code")
    page.wait(lambda: driven(page) == "")


def test_the_example_of_the_documents_runs(viewer, page, program, capsys):
    program.socket.close()
    page.wait(lambda: 'data-live=""' in page.html)
    (code,) = re.findall(r"```py\n(import json.*?)```", DOCUMENT, re.DOTALL)
    code = code.replace("127.0.0.1:8000", f"127.0.0.1:{viewer}").replace("K7QF-2M4A", program.code)
    exec(compile(code, "example", "exec"), {})
    assert capsys.readouterr().out.startswith("UR5 ['")
    page.settle()
    assert page.tool_pose() == pytest.approx(kin.fk(ARM, [0.0, -1.2, 1.4, -0.99, 0.5, 0.0]), abs=1e-5)


def test_the_example_in_javascript_runs(viewer, page, program, tmp_path):
    program.socket.close()
    page.wait(lambda: 'data-live=""' in page.html)
    (code,) = re.findall(r"```js\n(.*?)```", DOCUMENT, re.DOTALL)
    script = tmp_path / "first.js"
    script.write_text(code.replace("127.0.0.1:8000", f"127.0.0.1:{viewer}").replace("K7QF-2M4A", program.code))
    node = compute_driver_executable()[0]  # of Playwright
    said = tmp_path / "said"
    with said.open("w") as out, subprocess.Popen([node, script], stdout=out, stderr=out) as process:
        try:
            page.wait(lambda: 'data-live="first.js"' in page.html)
            page.wait(lambda: bool(np.allclose(page.tool_pose(), kin.fk(ARM, [0.1] * 6), atol=1e-5)))
            wait_for(lambda: re.search(r"\[\s*(0\.1,\s*){5}0\.1\s*\]", said.read_text()) is not None)
            page.say("undo")  # the visitor changes it, and the program hears that
            wait_for(lambda: re.search(r"\[\s*3\.14\d*,[^\]]*\]\s*$", said.read_text()) is not None)
            press(page, "Withdraw the code")
            assert process.wait(20) == 0, "it ends with its connection"
        finally:
            process.kill()


def app_schemas() -> set[str]:
    """What the service's OpenAPI document describes."""
    return set(create_app(Settings()).openapi()["components"]["schemas"])


@pytest.mark.full
def test_the_documents_have_the_schema_and_every_field():
    written = (ROOT / "docs/live-schema.json").read_text(encoding="utf-8")
    run = [sys.executable, "-c", "import sys; from scripts.live_schema import schema; sys.stdout.write(schema())"]
    anew = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert written == anew, "python scripts/live_schema.py writes it anew"
    schema, defined = json.loads(written), app_schemas()
    names = set(re.findall(r"/openapi.json#/components/schemas/(\w+)", written))
    assert {"RobotDescription", "Target", "ObstacleBody"} <= names <= defined
    sent, heard = DOCUMENT.split("### What a program hears")
    assert set(re.findall(r"^\| `(\w+)` \|", sent, re.MULTILINE)) == set(schema["properties"])
    assert set(VALUES) < set(re.findall(r"^\| `(\w+)` \|", heard, re.MULTILINE))


def test_drawings_that_are_replaced_all_day_leave_no_names_behind(monkeypatch):
    made: list[str] = []

    class Scene:
        """A scene of viser's, as far as drawings use it."""

        def __getattr__(self, add: str) -> Callable[..., Any]:
            def added(name: str, *_: Any, **__: Any) -> Any:
                made.append(name)
                return SimpleNamespace(name=name, visible=True, remove=lambda: None)

            return added

    monkeypatch.setattr("app.viewer.declared.scene.assign", lambda *_: None)
    view, numbers, drawings = SceneView(Scene(), "connect", lambda *_: None), count(1), {}  # type: ignore[arg-type]
    more = {
        "wall": {"kind": "line", "points": [[0, 0, 0], [0, 0, 1]], "width": 2, "color": "#ff0000"},
        "place": {"kind": "frame", "position": [0, 0, 0], "wxyz": [1, 0, 0, 0], "length": 0.1},
    }
    for _ in range(100):
        drawings = merged(drawings, more, numbers)
        view.show([Lazy("drawings", nodes, (tuple(drawings.values()),))])
    assert len(made) >= 200
    assert len(set(made)) == len(made), "browsers give the pose of a removed node to the next one of its name"
    assert len(view._names) == 0
