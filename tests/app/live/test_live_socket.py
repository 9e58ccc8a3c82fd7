"""The websocket of a page's program, with a page that only notes what it is asked: refusals, limits, news."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fastapi import FastAPI
from live_server import serve, wait_for
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

import kin
from app.api import ComputeSlots, api_routes
from app.classroom.tokens import show_code
from app.live import VALUES, Line, Lines, Listener, codes
from app.live.announced import Announcement, Button
from app.live.recording import Recording
from app.service.web.rooms.limits import Limits
from app.shared.problems import problem
from app.shared.settings import Settings
from app.shared.store import Store
from kin.collision.obstacles import MOST_OBSTACLES

ARM = kin.get_robot("ur5")
TABLE = {
    "convention": "standard",
    "units": {"length": "m", "angle": "deg"},
    "rows": [{"name": "a", "a": 0.3}, {"name": "b", "a": 0.2}],
}


class Page:
    """Takes what its program sends, as a page's worker does, and shows it."""

    def __init__(self, lines: Lines) -> None:
        self.posts: list[str] = []
        self.taken: dict[str, Any] = {}
        self.door = Listener(lines, self._post)
        self.door.open(ARM)
        assert self.door.line is not None
        self.line = self.door.line
        self.held = threading.Event()  # whether it takes nothing for now

    def _post(self, key: str, value: object) -> None:
        self.posts.append(key)
        if not self.held.is_set():
            self.take()

    def take(self) -> None:
        for pending in map(self.line.take, ("live", "drawn")):
            self.taken |= pending.values
            for number in pending.numbers:
                self.line.write(number)


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()
    app.state.settings = Settings(allowed_origins=("https://school.example",))
    app.state.store, app.state.compute = Store(), ComputeSlots(2, 5.0)
    app.state.lines, app.state.tries = Lines(), Limits()
    app.router.routes.extend(api_routes())
    return app


@pytest.fixture
def port(app) -> Iterator[int]:
    with serve(app) as port:
        yield port


@pytest.fixture
def page(app, port) -> Page:
    page = Page(app.state.lines)
    page.held.clear()
    return page


def call(port: int, code: str, query: str = "name=arm.py", **options: Any) -> ClientConnection:
    return connect(f"ws://127.0.0.1:{port}/api/v1/live/{code}?{query}", proxy=None, max_size=None, **options)


def heard(program: ClientConnection, kind: str, seconds: float = 10.0) -> dict[str, Any]:
    """The next message of this type."""
    deadline = time.monotonic() + seconds
    while True:
        message = json.loads(program.recv(timeout=max(0.0, deadline - time.monotonic())))
        if message["type"] == kind:
            return dict(message)


def say(connection: ClientConnection, /, **message: Any) -> None:
    connection.send(json.dumps(message))


def refused(connection: ClientConnection, /, **message: Any) -> dict[str, str]:
    """The first invalid value of a message that is refused."""
    say(connection, id=7, **message)
    answer = heard(connection, "problem")
    assert answer["id"] == 7
    (error, *_) = answer["problem"]["errors"]
    return dict(error)


def test_a_program_is_welcomed_and_its_values_reach_the_page(page, port):
    with call(port, show_code(page.line.code)) as program:
        welcome = heard(program, "welcome")
        assert welcome["robot"]["id"] == "ur5"
        assert [joint["name"] for joint in welcome["robot"]["joints"]] == [joint.name for joint in ARM.joints]
        wait_for(lambda: page.line.program is not None)
        assert page.line.program is not None
        assert page.line.program.name == "arm.py"
        q = [0.1, -1.0, 1.2, 0.3, 0.2, 0.1]
        say(
            program,
            id=1,
            q=q,
            measured=[9.0] * 6,
            draw={"wall": {"kind": "line", "points": [[0, 0, 0], [1, 0, 0]]}},
        )
        assert heard(program, "done") == {"type": "done", "id": 1}
        assert page.taken["q"].tolist() == q
        assert page.taken["measured"].tolist() == [9.0] * 6
        assert page.taken["draw"]["wall"]["points"] == [[0, 0, 0], [1, 0, 0]]
    wait_for(lambda: page.line.program is None)
    wait_for(lambda: page.taken.get("clear") is True)
    assert page.taken["measured"] is None


def test_readings_of_motors_are_kept_and_shown_as_the_measured_arm(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        say(program, id=1, robot="so101", readings=[10.0, 20.0, -30.0, 40.0, 50.0])
        assert heard(program, "done") == {"type": "done", "id": 1}
        assert np.degrees(page.taken["measured"]).round(9).tolist() == [10.0, 20.0, -30.0, 40.0, 50.0]
        assert page.line.readings == [10.0, 20.0, -30.0, 40.0, 50.0]
        say(program, id=2, robot="so101", readings=None)
        assert heard(program, "done") == {"type": "done", "id": 2}
        assert page.taken["measured"] is None
        assert page.line.readings is None


def test_the_newest_value_wins_and_drawings_are_merged(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        page.held.set()
        for k in range(20):
            say(program, q=[0.01 * k] * 6)
            say(program, draw={f"point {k % 3}": {"kind": "label", "position": [0, 0, k], "text": "p"}})
        # One more is drawn: the page is woken when the program connects.
        wait_for(lambda: page.posts.count("live") == 20 and page.posts.count("drawn") == 21)
        page.take()
        assert page.taken["q"].tolist() == pytest.approx([0.19] * 6)
        assert {name: each["position"][2] for name, each in page.taken["draw"].items()} == {
            "point 0": 18,
            "point 1": 19,
            "point 2": 17,
        }


@pytest.mark.parametrize(
    ("message", "field", "value", "expected"),
    [
        ({"speed": 3}, "speed", "3", "only the fields"),
        ({"q": [0.0] * 5}, "q", "5 values", "6 values in radians"),
        ({"q": [0.0, float("nan"), 0, 0, 0, 0]}, "q[1]", "NaN", "finite"),
        ({"q": [0.0, 99.0, 0, 0, 0, 0]}, "q[1]", "99.0", "the limits of the joint"),
        ({"q": "home"}, "q", '"home"', "a list"),
        ({"q": [0.0] * 6, "target": {"position": [0, 0, 0]}}, "target", "besides", "one of the two"),
        ({"target": {"position": [0, 0]}}, "target.position", "", "at least 3"),
        ({"target": {"position": [0, 0, 0], "frame": "tool"}}, "target.frame", "tool", "world"),
        ({"target": {"position": [0, 0, 1], "wxyz": [0, 0, 0, 0]}}, "target.wxyz", "0", ""),
        ({"measured": [1.0]}, "measured", "1 values", "6 values"),
        ({"readings": [1.0] * 6}, "readings", "1.0", "an arm with motors"),
        ({"robot": "so101", "readings": [1.0] * 7}, "readings", "7 values", "or 6, with 6 gripper in its place"),
        ({"readings": ["a"]}, "readings", "a", ""),
        ({"robot": "ur500"}, "robot", "ur500", "one of"),
        ({"robot": {"rows": []}}, "robot", "", ""),
        ({"obstacles": [{"shape": "ball"}]}, "obstacles[0].shape", "ball", "box"),
        (
            {"obstacles": [{"shape": "sphere"}] * (MOST_OBSTACLES + 1)},
            "obstacles",
            "33",
            f"at most {MOST_OBSTACLES}",
        ),
        ({"obstacles": [{"shape": "sphere", "radius": -1}]}, "obstacles[0].radius", "-1", "0.0001 to 100"),
        ({"program": {"segments": []}}, "program", "", "segments"),
        (
            {"program": {"segments": [{"kind": "ptp", "q": [0.0] * 3}]}},
            "program.segments[0]",
            "[0.0, 0.0, 0.0]",
            "6",
        ),
        ({"play": "yes"}, "play", "yes", "boolean"),
        ({"draw": {"a": {"kind": "sphere"}}}, "draw", "", "points"),
        ({"draw": {"a": {"kind": "line", "points": [[0, 0, 0]]}}}, "draw", "", "at least 2"),
        ({"draw": {"a": {"kind": "points", "points": [[0, 0, 0]] * 2001}}}, "draw", "", "at most 2000"),
        ({"subscribe": {"values": ["joints"]}}, "subscribe.values[0]", "joints", "'q'"),
        ({"subscribe": {"values": ["q"], "rate": 1000}}, "subscribe.rate", "1000", "60"),
    ],
)
def test_what_is_invalid_is_named_and_changes_nothing(page, port, message, field, value, expected):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        error = refused(program, **message)
        assert field in error["field"]
        assert value in error["value"]
        assert expected in error["expected"]
        say(program, id=8, q=[0.2] * 6)
        assert heard(program, "done")["id"] == 8  # the connection goes on
        assert set(page.taken) == {"q"}


@pytest.mark.parametrize("text", ["", "stop", "[" * 50_000, "[1]", '{"q": [1e999,0,0,0,0,0]}', b"\x00"])
def test_what_is_no_message_is_refused(page, port, text):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        program.send(text)
        assert heard(program, "problem")["problem"]["status"] in (400, 422)
        say(program, id=2, q=[0.2] * 6)
        assert heard(program, "done")["id"] == 2


def test_an_own_arm_is_checked_with_the_values_that_come_with_it(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        assert refused(program, robot=TABLE, q=[0.0] * 6)["expected"].startswith("2 values")
        assert not page.taken
        say(program, id=3, robot=TABLE, q=[0.1, 0.2])
        heard(program, "done")
        assert list(page.taken) == ["robot", "q"]


def test_large_messages_are_refused_and_huge_ones_end_the_connection(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        program.send(json.dumps({"id": 4, "draw": {"a" * 65_000: None}}) + " " * 1000)
        said = heard(program, "problem")["problem"]
        assert said["type"].endswith("body-too-large")
        assert said["errors"][0]["expected"] == "at most 65536 bytes"
        for size in (1_000_000, 2 << 20):
            text = json.dumps({"id": 5, "draw": {}})
            program.send(text + " " * (size - len(text)))
            said = heard(program, "problem")["problem"]
            assert said["status"] == 413
            assert said["errors"][0] == {
                "field": "message",
                "value": f"{size} bytes",
                "expected": "at most 65536 bytes",
            }
        say(program, id=6, q=[0.3] * 6)
        assert heard(program, "done")["id"] == 6
    codes = [_code_of_a_huge_message(page, port)]
    while codes[-1] is None and len(codes) < 5:
        codes.append(_code_of_a_huge_message(page, port))
    assert codes[-1] == 1009


def _send_and_hear(program, text):
    program.send(text)
    heard(program, "done")


def _code_of_a_huge_message(page, port):
    """The code that ends the connection; None: lost, where the system resets one with bytes that are not read."""
    wait_for(lambda: page.line.program is None)
    page.taken.clear()
    with call(port, page.line.code) as program, pytest.raises(ConnectionClosed) as end:
        _send_and_hear(program, json.dumps({"q": [0.0] * 500_000}))
    wait_for(lambda: page.line.program is None)
    assert "q" not in page.taken
    return None if end.value.rcvd is None else end.value.rcvd.code


@pytest.mark.full
def test_large_messages_wait_for_their_turn(page, port):
    """A message of 2 MiB costs as much as 256 others: two may come at once, the next ones one a second."""
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        began = time.monotonic()
        for _ in range(4):
            program.send(" " * (2 << 20))
        for _ in range(4):
            assert heard(program, "problem")["problem"]["status"] == 413
        assert time.monotonic() - began > 1.0


def test_too_many_messages_a_second_are_refused_aloud_and_the_last_one_counts(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        for k in range(700):
            say(program, q=[0.001 * k] * 6)
        said = heard(program, "problem")["problem"]
        assert said["status"] == 429
        assert said["errors"][0]["expected"] == "at most 120 a second"
        wait_for(lambda: page.taken["q"].tolist() == pytest.approx([0.699] * 6))
        assert page.posts.count("live") < 500


def test_a_second_program_is_refused_by_name_and_the_first_comes_back(page, port):
    with call(port, page.line.code, "name=first&session=a") as program:
        heard(program, "welcome")
        with call(port, page.line.code, "name=second&session=b") as other:
            said = heard(other, "problem")["problem"]
            assert said["status"] == 409
            assert "first" in said["detail"]
            with pytest.raises(ConnectionClosed):
                other.recv(timeout=10)
        with call(port, page.line.code, "name=first&session=a") as again:
            heard(again, "welcome")
            assert heard(program, "end")["reason"] == "The program has connected again."
            with pytest.raises(ConnectionClosed):
                program.recv(timeout=10)
            say(again, id=1, q=[0.3] * 6)
            heard(again, "done")
            assert "clear" not in page.taken  # the end of the old connection took nothing away


def test_a_subscriber_hears_what_changes_and_nothing_else(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        page.line.publish("q", np.zeros(6))
        say(program, subscribe={"values": ["q", "target", "result", "contacts"], "rate": 60}, id=1)
        assert heard(program, "news") == {"type": "news", "q": [0.0] * 6}
        T = kin.fk(ARM, np.full(6, 0.5))
        result = kin.solve_ik(ARM, T)
        for name, value in (("target", T), ("result", result), ("contacts", ()), ("program", {"playing": True})):
            page.line.publish(name, value)
        seen: dict[str, Any] = {}
        while not {"target", "result", "contacts"} <= seen.keys():
            seen |= heard(program, "news")
        assert seen["target"]["position"] == pytest.approx(T[:3, 3].tolist())
        assert seen["result"]["status"] == "solved"
        assert seen["result"]["solutions"][0]["q"] == pytest.approx(result.solutions[0].q.tolist())
        assert seen["contacts"] == []
        assert "program" not in seen
        page.line.publish("target", None)
        assert heard(program, "news")["target"] is None


FAR = np.eye(4) + np.outer([0, 0, 1, 0], [0, 0, 0, 9.0])  # a pose out of reach
# Of each value that a page publishes, what it may be.
PUBLISHED: dict[str, list[Any]] = {
    "robot": [kin.get_robot("scara"), replace(ARM, name="A “quoted” \u2028 name")],
    "q": [np.zeros(6), np.array([1e-17, -0.0, 1e16, np.pi, -1.2, 5.0])],
    "gripper": [None, 0.5, 1.0],
    "target": [None, kin.fk(ARM, np.full(6, 0.5))],
    "result": [None, kin.solve_ik(ARM, kin.fk(ARM, np.full(6, 0.5))), kin.solve_ik(ARM, FAR)],
    "contacts": [
        (),
        (
            kin.collision.Contact(-0.01, 6, 2),
            kin.collision.Contact(-0.002, 3, None, 0, 'a "table"', True),
            kin.collision.Contact(-1e-9, 2, 0),
        ),
    ],
    "program": [{"items": 2, "playing": True, "time": 0.25, "duration": 1.5, "complete": False}],
}


def test_a_recording_has_every_message_that_the_program_hears(page, port):
    """Each value, and each message that is said once: as the program received it, and the connection goes on."""
    assert PUBLISHED.keys() == {"robot", *VALUES}, "a value that is published is recorded here, too"
    recording = page.line.recording = Recording(ARM)
    received: list[dict[str, Any]] = []
    with call(port, page.line.code) as program:

        def until(kind: str, number: int | None = None) -> None:
            while True:
                received.append(json.loads(program.recv(timeout=10.0)))
                if received[-1]["type"] == kind and received[-1].get("id") == number:
                    return

        until("welcome")
        say(program, subscribe={"values": list(VALUES), "rate": 60}, id=1)
        until("done", 1)
        for k in range(max(map(len, PUBLISHED.values()))):
            for name, values in PUBLISHED.items():
                page.line.publish(name, values[k % len(values)])
            say(program, id=100 + k, play=False)  # the news come before its answer
            until("done", 100 + k)
        page.line.write(3)
        page.line.write(4, problem(422, "invalid-input", "q[0]: “7”", "Send less."))
        page.line.write(problem=problem(409, "not-allowed", "The target is held."))
        say(program, id=200, q="no configuration")
        until("problem", 200)
        page.door.close()
        until("end")
    expected = [(f"/heard/{topic}", content) for message in received for topic, content in spread(message)]
    found = [(e.topic, json.loads(e.data)) for e in recording.entries if e.topic.startswith("/heard/")]
    assert found == expected
    assert {topic for topic, _ in found} == {
        f"/heard/{name}" for name in ("welcome", "done", "problem", "end", "robot", *VALUES)
    }
    assert recording.ended is None


def spread(message: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The topics of a message, each with what is recorded under it."""
    content = {name: value for name, value in message.items() if name != "type"}
    if message["type"] == "news":
        yield from ((name, {name: value}) for name, value in content.items())
    else:
        yield message["type"], content


def test_a_recording_may_be_discarded_at_any_moment(page):
    """The page's worker takes it away while another thread is about to write to it."""

    class Fading(Line):
        """Its recording is there when it is asked for the first time."""

        asked = 0

        @property
        def recording(self) -> Recording | None:
            self.asked += 1
            return Recording(ARM) if self.asked == 1 else None

        @recording.setter
        def recording(self, value: Recording | None) -> None:
            pass

    for act in (lambda line: line.note("heard", b'{"type":"done"}'), lambda line: line.publish("q", np.zeros(6))):
        act(Fading("K7QF2M4A", ARM, lambda *_: None))


def test_news_come_at_the_rate_that_was_asked_for_and_the_last_one_comes(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        say(program, subscribe={"values": ["q"], "rate": 10})
        wait_for(lambda: page.line.program is not None and "q" in page.line.program.wants)
        began, found = time.monotonic(), []
        for k in range(100):
            page.line.publish("q", np.full(6, 0.01 * k))
            time.sleep(0.01)
        while not found or found[-1] != pytest.approx(0.99):
            found.append(heard(program, "news")["q"][0])
        assert len(found) <= 10 * (time.monotonic() - began) + 2
        assert found == sorted(found)


def test_a_page_that_withdraws_its_code_ends_the_connection_and_the_code(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        page.door.close()
        assert heard(program, "end")["reason"] == "The page has withdrawn the code."
        with pytest.raises(ConnectionClosed) as end:
            program.recv(timeout=10)
        assert end.value.rcvd is not None
        assert end.value.rcvd.code == 1000
    with call(port, page.line.code) as program:
        assert heard(program, "problem")["problem"]["status"] == 404


def test_a_problem_of_the_page_reaches_the_program(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        page.line.write(5, problem(422, "invalid-input", "The program cannot be driven."))
        said = heard(program, "problem")
        assert said["id"] == 5
        assert said["problem"]["detail"] == "The program cannot be driven."


def test_guesses_are_limited_as_those_of_rooms(page, port, monkeypatch):
    monkeypatch.setattr("app.service.web.rooms.limits.SLOW", 0.01)
    for k in range(31):
        with call(port, "ACDEFGHJ") as program:
            said = heard(program, "problem")["problem"]
        assert said["status"] == (404 if k < 30 else 429)
    with call(port, page.line.code) as program:
        heard(program, "welcome")  # a right code still counts


@pytest.mark.parametrize("code", ["1", "K7Q-F2M", "%F0%9F%A6%BE", "A" * 5000])
def test_texts_that_are_no_codes_are_refused(page, port, code):
    with call(port, code) as program:
        said = heard(program, "problem")["problem"]
    assert said["errors"][0]["field"] == "code"
    assert said["errors"][0]["expected"] == "8 letters and digits, such as K7QF-2M4A"


def test_pages_of_other_sites_are_rejected(page, port):
    with pytest.raises(InvalidStatus) as rejected:
        call(port, page.line.code, origin="https://evil.example")
    assert rejected.value.response.status_code == 403
    with call(port, page.line.code, origin="https://school.example") as program:
        heard(program, "welcome")


def test_each_page_has_a_code_of_its_own(monkeypatch):
    lines = Lines()
    assert len({lines.open(ARM, lambda *_: None).code for _ in range(100)}) == 100
    drawn = iter(("AAAAAAAA", "BBBBBBBB"))
    monkeypatch.setattr(codes, "new_code", lambda: next(drawn))
    assert codes.unused_code({"AAAAAAAA"}) == "BBBBBBBB"


@pytest.mark.full
def test_delay_and_rate_are_measured(page, port):
    with call(port, page.line.code) as program:
        heard(program, "welcome")
        for _ in range(10):
            say(program, q=[0.1] * 6)
        wait_for(lambda: page.line.program is not None and page.line.program.rate() == 10)
        assert page.line.program is not None
        wait_for(lambda: page.line.program.delay() is not None, 10.0)
        assert page.line.program.rate() == 0
        assert 0.0 < (page.line.program.delay() or 0.0) < 1.0


def test_a_press_is_heard_before_the_news_that_waits(page, port):
    """It may stop what follows the news."""
    with call(port, page.line.code) as program:
        say(program, subscribe={"values": ["q"], "rate": 1}, id=1)
        heard(program, "done")
        page.line.send({"announce": Announcement("It follows.", "enabled", (Button("stop", "Stop", stops=True),))})
        page.line.publish("q", np.zeros(6))
        heard(program, "news")
        page.line.publish("q", np.ones(6))  # within the second in which no more news is sent
        time.sleep(0.1)
        assert page.line.press("stop")
        assert [json.loads(program.recv(timeout=5.0))["type"] for _ in range(2)] == ["pressed", "news"]
