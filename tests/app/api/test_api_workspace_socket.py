"""The websocket of clouds: the same rows as the file, progress, cancellation, refusals with a reason."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator

import numpy as np
import pytest
from fastapi import FastAPI
from live_server import serve, wait_for
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

import kin
from app.api import ComputeSlots, StreamLimit, api_routes
from app.api.workspace import socket as socket_module
from app.shared.clouds import Cloud, Clouds
from app.shared.settings import Settings
from app.shared.store import Store

PIONEER = kin.get_robot("pioneer5")
ENDLESS = "n=100000000"


@pytest.fixture
def app() -> Iterator[FastAPI]:
    """REST alone, two streams at a time."""
    app = FastAPI()
    app.state.settings = Settings(allowed_origins=("https://school.example",))
    app.state.store = Store()
    app.state.clouds, app.state.streams = Clouds(max_bytes=0, threads=1), StreamLimit(2)
    app.state.compute = ComputeSlots(2, 5.0)
    app.router.routes.extend(api_routes())
    yield app
    app.state.clouds.close()


@pytest.fixture
def port(app) -> Iterator[int]:
    with serve(app) as port:
        yield port


def visit(port, query="", robot="pioneer5", **options):
    address = f"ws://127.0.0.1:{port}/api/v1/robots/{robot}/workspace/stream?{query}"
    return connect(address, proxy=None, max_size=None, **options)


def ending(visitor) -> tuple[list[bytes | str], int, str]:
    """The remaining messages, the close code and the reason."""
    messages: list[bytes | str] = []
    while True:
        try:
            messages.append(visitor.recv(timeout=20))
        except ConnectionClosed as end:
            close = end.rcvd or pytest.fail("the connection was cut without a word")
            return messages, close.code, close.reason


def test_the_rows_are_the_cloud_and_progress_reaches_its_end(port, monkeypatch):
    monkeypatch.setattr(socket_module, "PROGRESS_EVERY", 0.0)
    with visit(port, "n=200000&seed=5&strategy=quasi&measure=limits&q=true&limit=1:0:0.5&lock=3:0.2") as visitor:
        messages, code, reason = ending(visitor)
    assert (code, reason) == (1000, "done")
    start, *progress = [json.loads(m) for m in messages if isinstance(m, str)]
    columns = ["x", "y", "z", "limits", "q1", "q2", "q3", "q4", "q5"]
    assert start == {"type": "start", "total": 200_000, "columns": columns}
    limits, locked = ((0.0, 0.5), None, None, None, None), (None, None, 0.2, None, None)
    chunk = Cloud(PIONEER, 200_000, 5, "quasi", ("limits",), kin.JointConstraints(limits, locked)).slice(
        0, 200_000, True
    )
    expected = np.column_stack([chunk.points, chunk.measures["limits"], chunk.q]).astype(np.float32)
    rows = np.frombuffer(b"".join(m for m in messages if isinstance(m, bytes)), "<f4").reshape(-1, len(columns))
    assert np.array_equal(rows, expected)
    assert [p["type"] for p in progress] == ["progress"] * len(progress)
    done = [p["done"] for p in progress]
    assert done == sorted(set(done))
    assert done[-1] == 200_000
    assert len(done) == 4
    assert all(p["total"] == 200_000 and p["points_per_second"] > 0 for p in progress)


def test_a_cloud_in_one_piece_reports_its_end(port):
    with visit(port, "n=10") as visitor:
        messages, code, _ = ending(visitor)
    assert [type(m) for m in messages] == [str, bytes, str]
    assert json.loads(messages[-1])["done"] == 10
    assert code == 1000


def test_a_visitor_can_cancel(port, app):
    with visit(port, ENDLESS) as visitor:
        visitor.recv(timeout=10)
        visitor.send('{"cancel": true}')
        _, code, reason = ending(visitor)
    assert (code, reason) == (1000, "cancelled")
    wait_for(lambda: app.state.streams.open == 0)
    wait_for(lambda: app.state.clouds._executor._work_queue.empty())


@pytest.mark.parametrize("message", ["stop", "", "[" * 50_000, '{"cancel": false}', b"\x01"])
def test_other_messages_are_refused(port, app, message):
    with visit(port, ENDLESS) as visitor:
        visitor.send(message)
        _, code, reason = ending(visitor)
    assert code == 1003
    assert "cancel" in reason
    wait_for(lambda: app.state.streams.open == 0)


def test_a_visitor_who_disconnects_cancels_the_cloud(port, app, monkeypatch):
    begun = []
    slice_of = Cloud.slice
    monkeypatch.setattr(Cloud, "slice", lambda self, *rest: begun.append(1) or slice_of(self, *rest))
    for vanish in (True, False):
        visitor = visit(port, ENDLESS)
        visitor.recv(timeout=10)
        if vanish:
            visitor.socket.close()
        else:
            visitor.close()
    wait_for(lambda: app.state.streams.open == 0)
    wait_for(lambda: app.state.clouds._executor._work_queue.empty())
    time.sleep(0.1)
    count = len(begun)
    time.sleep(0.2)
    assert len(begun) == count < 1000


def test_a_slow_visitor_slows_the_computation(port, monkeypatch):
    begun = []
    slice_of = Cloud.slice
    monkeypatch.setattr(Cloud, "slice", lambda self, *rest: begun.append(1) or slice_of(self, *rest))
    with visit(port, ENDLESS, max_queue=1) as visitor:
        visitor.recv(timeout=10)
        time.sleep(1.0)  # enough for a gigabyte without backpressure
        assert len(begun) < 100
        # A visitor who does not read can still cancel.
        visitor.send('{"cancel": true}')
        assert ending(visitor)[1:] == (1000, "cancelled")


@pytest.mark.parametrize(
    ("query", "robot", "kind", "said"),
    [
        ("n=0", "pioneer5", "invalid-input", 'n: got "0"'),
        ("n=1&n=2&sed=3", "pioneer5", "invalid-input", "sed: got"),
        ("limit=9:0:1", "pioneer5", "invalid-input", "limit[0]: got"),
        ("lock=1:0&lock=2:9", "pioneer5", "invalid-input", "lock[1]: got"),
        ("measure=beauty", "pioneer5", "invalid-input", "measure[0]: got"),
        ("n=100000001", "pioneer5", "invalid-input", "n: got 100000001"),
        ("format=bin", "pioneer5", "invalid-input", "format: got"),
        ("", "nobody", "unknown-robot", 'There is no robot "nobody"'),
        (f"strategy={'ö' * 200}", "pioneer5", "invalid-input", "strategy: got"),
    ],
)
def test_a_refusal_has_the_same_reason_as_in_rest(port, query, robot, kind, said):
    with visit(port, query, robot) as visitor:
        messages, code, reason = ending(visitor)
    (message,) = [json.loads(m) for m in messages]
    assert message["type"] == "problem"
    assert message["problem"]["type"] == f"urn:kinboard:problem:{kind}"
    assert message["problem"]["detail"].startswith(said)
    assert code == 1008
    assert reason
    assert message["problem"]["detail"].startswith(reason)


def test_streams_beyond_the_limit_are_closed_with_try_again_later(port, app):
    slow = {"max_queue": 1, "close_timeout": 0.2}
    with visit(port, ENDLESS, **slow) as first, visit(port, ENDLESS, **slow) as second:
        first.recv(timeout=10)
        second.recv(timeout=10)
        with visit(port, "n=10") as third:
            messages, code, _ = ending(third)
        assert json.loads(messages[0])["problem"]["type"].endswith("busy")
        assert code == 1013
    wait_for(lambda: app.state.streams.open == 0)
    with visit(port, "n=10") as again:
        assert ending(again)[1] == 1000


def test_a_failure_is_reported_and_logged(port, app, monkeypatch, caplog):
    def broken(*args):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(Cloud, "slice", broken)
    with visit(port, "n=10") as visitor:
        _, code, reason = ending(visitor)
    assert (code, reason) == (1011, "Internal error.")
    assert "a bug" in caplog.text
    assert app.state.streams.open == 0


@pytest.mark.parametrize("origin", ["https://evil.example", "null"])
def test_foreign_origins_are_refused(port, origin, caplog):
    with pytest.raises(InvalidStatus) as refused:
        visit(port, "n=1", origin=origin)
    assert refused.value.response.status_code == 403
    assert origin in caplog.text


def test_own_and_allowed_origins_are_accepted(port):
    for origin in (f"http://127.0.0.1:{port}", "https://school.example", None):
        with visit(port, "n=1", origin=origin) as visitor:
            assert ending(visitor)[1] == 1000


def sent_along(port, message):
    """What a client gets whose first message is this."""
    with connect(f"ws://127.0.0.1:{port}/api/v1/workspace/stream", proxy=None, max_size=None) as visitor:
        visitor.send(message if isinstance(message, bytes | str) else json.dumps(message))
        return ending(visitor)


def test_the_cloud_of_an_arm_sent_along_is_that_of_the_same_arm_of_the_service(port, app):
    arm = kin.robot_to_dict(PIONEER)
    asked = {"n": 3000, "seed": 4, "measure": ["manipulability"], "lock": [[1, 0.5]], "q": True}
    messages, code, reason = sent_along(port, {"robot": arm, **asked})
    with visit(port, "n=3000&seed=4&measure=manipulability&lock=1:0.5&q=true") as visitor:
        expected, *_ = ending(visitor)
    assert (code, reason) == (1000, "done")
    rows, same = (b"".join(m for m in each if isinstance(m, bytes)) for each in (messages, expected))
    assert rows == same
    assert json.loads(messages[0])["columns"] == json.loads(expected[0])["columns"]
    assert app.state.streams.open == 0


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ("{", "The body is not valid JSON"),
        (b"\x00", "body: got a binary message"),
        ("[]", "body: got [], expected a JSON object"),
        ({"n": 10}, "robot: got nothing"),
        ({"robot": {"rows": []}}, "robot."),
        ({"robot": kin.robot_to_dict(PIONEER), "n": "10"}, 'n: got "10"'),
        ({"robot": kin.robot_to_dict(PIONEER), "n": 100000001}, "n: got 100000001"),
        ({"robot": kin.robot_to_dict(PIONEER), "limit": [[9, 0, 1]]}, "limit[0]: got [9, 0, 1]"),
        ({"robot": kin.robot_to_dict(PIONEER), "limit": [[10**400, 0, 1]]}, "limit[0]: got [1000"),
        ({"robot": kin.robot_to_dict(PIONEER), "n": 10**400}, "n: got 1000"),
        ({"robot": kin.robot_to_dict(PIONEER), "format": "csv"}, 'format: got "csv"'),
    ],
)
def test_a_first_message_that_is_wrong_is_refused_with_a_reason(port, app, message, said):
    messages, code, _ = sent_along(port, message)
    (problem,) = [json.loads(m)["problem"] for m in messages]
    assert problem["detail"].startswith(said)
    assert code == 1008
    assert app.state.streams.open == 0


def test_a_client_that_sends_nothing_is_not_waited_for(port, monkeypatch):
    monkeypatch.setattr(socket_module, "PATIENCE", 0.05)
    with connect(f"ws://127.0.0.1:{port}/api/v1/workspace/stream", proxy=None) as visitor:
        messages, code, _ = ending(visitor)
    assert json.loads(messages[0])["problem"]["type"].endswith("request-timeout")
    assert code == 1008
