"""Connections whose clients misbehave: too many, too slow, too much at once."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress

import httpx2
import pytest
import viser
from attacks import ARM, GET, Victim, answer_to, closed, problem_in, victim
from fastapi import FastAPI
from live_server import serve, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.frames import Close
from websockets.sync.client import ClientConnection, connect

from app.api.body import UploadMemory
from app.api.problems import ProblemError
from app.service.guard import Guard
from app.service.http_protocol import MAX_HEAD, MAX_PIPELINE
from app.service.websocket_protocol import MAX_FRAGMENTS
from app.shared.settings import Settings


@pytest.fixture(scope="module")
def service() -> Iterator[Victim]:
    with victim(
        ready=True,
        KINBOARD_RECEIVE_TIMEOUT="1",
        KINBOARD_SEND_TIMEOUT="2",
        KINBOARD_MAX_CONNECTIONS="20",
        KINBOARD_MAX_VISITORS="4",
    ) as service:
        yield service
        assert "Traceback" not in service.log


UPLOAD = f"POST {ARM}/fk HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n".encode()

# -- requests --------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_requests_sent_ahead_are_answered_in_order(service):
    paths = ["livez", "nothing", "livez", "static/landing.css", "livez"]
    requests = b"".join(f"GET /{path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode() for path in paths[:-1])
    with service.connection() as connection:
        connection.sendall(requests + b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        answer = answer_to(connection)
    assert [int(part[:3]) for part in answer.split(b"HTTP/1.1 ")[1:]] == [200, 404, 200, 200, 200]


def test_a_pipeline_is_answered_up_to_a_bound(service):
    with service.connection() as connection:
        connection.sendall(GET * 2000)
        answer = answer_to(connection)
    assert 1 <= answer.count(b"HTTP/1.1 200 OK") <= MAX_PIPELINE + 1
    assert b"connection: close" in answer
    wait_for(lambda: "requests ahead" in service.log)


def test_requests_sent_ahead_take_no_memory(service):
    before = service.memory()
    with service.connection() as connection:
        connection.settimeout(0.5)
        with pytest.raises(OSError):  # noqa: PT012 - which of them is the first not to be taken depends on the system
            for _ in range(650):
                connection.sendall(GET * 1000)
            connection.sendall(GET)
    assert service.memory() - before < 50e6


@pytest.mark.full
@pytest.mark.parametrize(
    ("sent", "status", "kind"),
    [
        (b"GET / HTTP/1.1\r\nHost: local", 408, "request-timeout"),
        (UPLOAD + b"{", 408, "request-timeout"),
        (b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 1000, 431, "head-too-large"),
        (b"GET / HTTP/1.1\r\na: " + b"b" * 600_000, 431, "head-too-large"),
        (b"GET /" + b"b" * 600_000, 431, "head-too-large"),
        (b"nonsense\r\n\r\n", 400, "bad-request"),
        (b"GET / HTTP/1.1\r\nHost: \x00\r\n\r\n", 400, "bad-request"),
    ],
    ids=["head", "body", "many fields", "long field", "long address", "no method", "bad field"],
)
def test_what_is_no_request_is_refused_in_time(service, sent, status, kind):
    with service.connection() as connection:
        try:
            connection.sendall(sent)
        except ConnectionError:
            assert len(sent) > MAX_HEAD
        answer = answer_to(connection)
    if len(sent) > MAX_HEAD and not answer:
        return  # reset by the service, which had not read everything
    assert answer.startswith(b"HTTP/1.1 %d " % status)
    assert problem_in(answer)["type"] == f"urn:kinboard:problem:{kind}"


@pytest.mark.parametrize("part", ["field", "fields", "address"])
@pytest.mark.parametrize(("size", "passes"), [(60_000, True), (66_000, False), (130_000, False), (250_000, False)])
def test_a_head_that_comes_at_once_is_bounded_too(service, part, size, passes):
    sent = {
        "field": b"GET /livez HTTP/1.1\r\nHost: localhost\r\na: " + b"b" * size,
        "fields": b"GET /livez HTTP/1.1\r\nHost: localhost" + (b"\r\na: " + b"b" * (size // 100)) * 100,
        "address": b"GET /livez?" + b"b" * size + b" HTTP/1.1\r\nHost: localhost",
    }[part] + b"\r\nConnection: close\r\n\r\n"
    with service.connection() as connection:
        try:
            connection.sendall(sent)
        except ConnectionError:
            assert not passes
        answer = answer_to(connection)
    if answer or passes:  # it may be lost with what the service has not read
        assert answer.startswith(b"HTTP/1.1 200 " if passes else b"HTTP/1.1 431 "), answer[:200]


def test_a_body_that_trickles_is_cut_off(service):
    with service.connection() as connection:
        connection.sendall(UPLOAD)
        began = time.monotonic()
        with pytest.raises(OSError):  # noqa: PT012 - any send after the refusal may fail
            for _ in range(300):
                connection.sendall(b" ")
                time.sleep(0.1)
        assert time.monotonic() - began < 20


def test_idle_connections_are_closed(service):
    """New, after a blank line, after a request, and after a request and a blank line."""
    with ExitStack() as stack:
        idle = [stack.enter_context(service.connection()) for _ in range(4)]
        for connection, sent in zip(idle, [b"", b"\r\n", GET, GET + b"\r\n"], strict=True):
            connection.sendall(sent)
        for connection in idle:
            wait_for(lambda connection=connection: closed(connection), 20)


def test_answers_are_sent_at_once(monkeypatch):
    """Else the body of each answer would wait until the client acknowledges its head."""
    accept, delays = Guard.accept, []

    def accepted(self: Guard, transport: asyncio.Transport, check: Callable[[float], None]) -> str | None:
        why = accept(self, transport, check)
        delays.append(transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        return why

    monkeypatch.setattr(Guard, "accept", accepted)
    with serve(FastAPI()) as port, socket.create_connection(("127.0.0.1", port)):
        wait_for(lambda: delays)
        assert delays[0]


def test_a_pause_between_two_requests_is_no_offence(service):
    with service.connection() as connection:
        for _ in range(3):
            connection.sendall(GET)
            assert b"200 OK" in answer_to(connection, until_closed=False)
            time.sleep(0.4)


# -- answers ---------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_an_answer_that_nobody_reads_ends(service):
    request = f"GET {ARM}/workspace?n=20000000&format=bin HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with service.connection(receive=4096) as connection:
        connection.sendall(request.encode())
        assert connection.recv(1000).startswith(b"HTTP/1.1 200")
        wait_for(lambda: "read nothing of what it was sent" in service.log, 30)
        wait_for(lambda: closed(connection), 30)


@pytest.mark.full
def test_an_answer_that_is_read_byte_by_byte_ends(service):
    ended = 'kinboard_refused_connections_total{why="unread"}'
    before = service.metric(ended)
    request = f"GET {ARM}/workspace?n=20000000&format=bin HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with service.connection(receive=4096) as connection:
        connection.sendall(request.encode())

        def has_ended() -> bool:
            with suppress(ConnectionError):
                connection.recv(1)
            return service.metric(ended) > before

        wait_for(has_ended, 60)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["workspace", "stream", "reachable"])
def test_clients_that_read_nothing_keep_no_place(what):
    """More of them than there are places, from one address; another client, and one of theirs, is served."""
    targets = json.dumps({"target": [{"position": [0.0, 0.2, 0.1]}] * 10_000}).encode()
    post = f"POST {ARM}/reachable HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    requests = {
        "workspace": f"GET {ARM}/workspace?n=90000000&format=bin HTTP/1.1\r\nHost: localhost\r\n\r\n".encode(),
        "stream": handshake(f"{STREAM}?n=90000000"),
        "reachable": f"{post}Content-Length: {len(targets)}\r\n\r\n".encode() + targets,
    }
    with (
        victim(
            ready=True, KINBOARD_MAX_STREAMS="3", KINBOARD_MAX_REQUESTS="3", KINBOARD_SEND_TIMEOUT="60"
        ) as service,
        ExitStack() as stack,
    ):
        for _ in range(4):
            stack.enter_context(service.connection(receive=4096)).sendall(requests[what])
        time.sleep(0.5)
        for source in ("127.0.0.2", "127.0.0.1"):
            transport = httpx2.HTTPTransport(local_address=source)
            with httpx2.Client(transport=transport, timeout=60, base_url=service.url) as client:

                def served() -> bool:
                    cloud = client.get(f"{ARM}/workspace?n=10")
                    return cloud.status_code == 200

                def solved() -> bool:
                    """Their targets are computed before: until then there may be no place."""
                    body = {"target": [{"position": [0.0, 0.2, 0.1]}] * 20}
                    answer = client.post(f"{ARM}/reachable", json=body)
                    return answer.status_code == 200 and len(answer.json()["results"]) == 20

                wait_for(served, 30)
                wait_for(solved, 30)
        assert "Traceback" not in service.log


# -- clients that leave ----------------------------------------------------------------------------------------


def test_an_upload_that_is_abandoned_is_no_failure_of_the_service(service):
    counted = 'kinboard_requests_total{method="POST",route="/api/v1/robots/{robot_id}/fk",status="%s"}'
    before = service.metric(counted % 499)
    with service.connection() as connection:
        connection.sendall(UPLOAD + b"{")
    wait_for(lambda: service.metric(counted % 499) == before + 1, 10)
    assert service.metric(counted % 500) == 0


@pytest.mark.slow
def test_stalled_uploads_hold_a_bounded_amount_of_memory():
    """Thirty uploads of 7 MB that never end: before, they held 210 MB."""
    with victim(ready=True, KINBOARD_UPLOAD_MEMORY=str(40 << 20)) as service, ExitStack() as stack:
        before = service.memory()
        head = f"POST {ARM}/fk HTTP/1.1\r\nHost: localhost\r\nContent-Length: 8000000\r\n\r\n".encode()
        uploads = [stack.enter_context(service.connection(f"127.0.1.{k}")) for k in range(1, 31)]
        for upload in uploads:
            with suppress(OSError):  # refused meanwhile
                upload.sendall(head + bytes(7_000_000))
        assert service.answers_after() < 10
        assert service.memory() - before < 120e6
        refused = [upload for upload in uploads if closed(upload)]
        assert 20 <= len(refused) < 30


def test_the_memory_of_uploads_is_shared_fairly():
    memory = UploadMemory(100, 0.5)
    with memory.body("a") as large:
        large.grow(120)  # alone: accepted whatever its size
        with memory.body("b") as other, pytest.raises(ProblemError) as refused:
            other.grow(1)
        assert refused.value.problem.type == "urn:kinboard:problem:busy"
        assert refused.value.headers is not None
        assert refused.value.headers["Connection"] == "close"
    assert memory.held == 0
    with memory.body("a") as first, memory.body("a") as second, memory.body("b") as third:
        first.grow(40)
        second.grow(10)
        with pytest.raises(ProblemError):
            second.grow(1)  # the share of one client
        third.grow(50)
        with pytest.raises(ProblemError):
            first.grow(1)
    assert memory.held == 0


# -- websockets ------------------------------------------------------------------------------------------------


def handshake(path: str, *fields: bytes) -> bytes:
    lines = [f"GET {path} HTTP/1.1".encode(), b"Host: localhost", b"Upgrade: websocket", b"Connection: Upgrade"]
    lines += [b"Sec-WebSocket-Version: 13", b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", *fields]
    return b"\r\n".join([*lines, b"", b""])


def upgraded(service: Victim, path: str) -> socket.socket:
    """A websocket. Connections of tests before count for a moment after they were closed: 503 is asked again."""
    found: list[socket.socket] = []

    def accepted() -> bool:
        with ExitStack() as stack:
            connection = stack.enter_context(service.connection())
            connection.sendall(handshake(path, f"Sec-WebSocket-Protocol: viser-v{viser.__version__}".encode()))
            answer = answer_to(connection, until_closed=False)
            assert answer.startswith((b"HTTP/1.1 101 ", b"HTTP/1.1 503 ")), answer[:200]
            if answer.startswith(b"HTTP/1.1 101 "):
                found.append(connection)
                stack.pop_all()
        return bool(found)

    wait_for(accepted)
    return found[0]


STREAM = f"{ARM}/workspace/stream"
LONG_STREAM = f"{STREAM}?n=50000000"


def frame(opcode: int, data: bytes = b"", final: bool = True) -> bytes:
    """A masked frame, with a mask that changes nothing."""
    assert len(data) < 126
    return bytes([final << 7 | opcode, 0x80 | len(data), 0, 0, 0, 0]) + data


@pytest.mark.parametrize("path", ["/viewer", STREAM])
@pytest.mark.parametrize(
    ("field", "status"),
    [
        (b"Origin: http://[::1", 403),
        (b"Origin: \xff", 403),
        (b"Origin: http://", 403),
        (b"Sec-WebSocket-Protocol: \xff\xfe", 400),
        (b"Sec-WebSocket-Protocol: a, \xc3\xa9", 400),
        (b"Sec-WebSocket-Key: short", 400),
        (b"X-Long: " + b"x" * 20_000, 400),
    ],
    ids=["origin", "origin bytes", "empty origin", "protocol", "one protocol", "two keys", "long field"],
)
def test_a_handshake_that_cannot_be_read_is_refused(service, path, field, status):
    with service.connection() as connection:
        connection.sendall(handshake(path, field))
        answer = answer_to(connection)
    assert answer.startswith(b"HTTP/1.1 %d " % status), answer


FLOODS = {
    "pings": frame(9),
    "pongs": frame(10),
    "fragments": frame(0, final=False),
    "long pings": frame(9, bytes(125)),
}


@pytest.mark.parametrize(
    ("flood", "path"),
    [
        ("pings", LONG_STREAM),
        ("pings", "/viewer"),
        ("fragments", LONG_STREAM),
        pytest.param("pongs", LONG_STREAM, marks=pytest.mark.slow),
        pytest.param("long pings", LONG_STREAM, marks=pytest.mark.slow),
    ],
)
def test_a_flood_of_frames_is_not_read(service, flood, path):
    """The buffers on the way fill up, and stay full. Without a budget, half a megabyte is read per second."""
    frames = FLOODS[flood] * (65536 // len(FLOODS[flood]))
    with upgraded(service, path) as connection:
        if flood == "fragments":
            connection.sendall(frame(2, final=False))
        connection.settimeout(0.5)
        with suppress(OSError):  # blocked, or refused: too many fragments for one message
            while True:
                connection.send(frames)
        more = 0
        end = time.monotonic() + 1.5
        while time.monotonic() < end:
            try:
                more += connection.send(frames)
            except TimeoutError:
                continue
            except OSError:
                break  # too many fragments for one message, or too long without reading what it is sent
        assert more < 200_000
        assert service.answers_after() < 10


@pytest.mark.parametrize("path", ["/viewer", "/viewer?not=/api/v1/live/", LONG_STREAM])
@pytest.mark.parametrize(
    ("sent", "code"),
    [
        (frame(1, b"\xff\xfe"), 1007),
        (frame(1, b"\xff", final=False) + frame(0, b"x"), 1007),
        (frame(3, b"x"), 1002),
        (frame(0, b"x"), 1002),
        (bytes([0x82, 0xFF]) + b"\x7f" * 8 + bytes(4), 1009),
        (bytes([0x82, 0xFF]) + (1 << 20).to_bytes(8, "big") + bytes(4), 1009),
    ],
    ids=["not UTF-8", "not UTF-8 in parts", "unknown", "out of order", "huge", "of a program's size"],
)
def test_a_malformed_message_ends_the_connection(service, path, sent, code):
    """And nothing else: the log has no traceback at the end of these tests."""
    with upgraded(service, path) as connection:
        connection.sendall(sent)
        received = b""
        while (code).to_bytes(2, "big") not in received[-200:]:
            chunk = connection.recv(1 << 20)
            assert chunk, "closed without a reason"
            received = received[-200:] + chunk


@pytest.mark.full
def test_a_client_that_answers_no_ping_is_disconnected(service):
    with upgraded(service, "/viewer") as connection:
        wait_for(lambda: closed(connection, 0.1), 30)


def test_a_message_in_too_many_fragments_is_refused(service):
    with upgraded(service, LONG_STREAM) as connection:
        connection.sendall(frame(2, b"x", final=False))
        connection.sendall(frame(0, b"x", final=False) * MAX_FRAGMENTS)
        received = b""
        while b"more than %d fragments" % MAX_FRAGMENTS not in received[-200:]:
            chunk = connection.recv(1 << 20)
            assert chunk, "closed without a reason"
            received = received[-200:] + chunk


def test_a_ping_is_answered_and_a_message_in_fragments_is_read(service):
    with upgraded(service, LONG_STREAM) as connection:
        connection.sendall(frame(9, b"hello"))
        received = b""
        while b"\x8a\x05hello" not in received:
            received += connection.recv(1 << 20)
        connection.sendall(frame(1, b'{"can', final=False) + frame(0, b'cel"', final=False) + frame(0, b": true}"))
        while b"cancelled" not in received:
            received = received[-20:] + connection.recv(1 << 20)


@pytest.mark.full
def test_a_client_that_does_not_read_its_websocket_is_disconnected(service):
    before = service.metric('kinboard_refused_connections_total{why="unread"}')
    with service.connection(receive=4096) as connection:
        connection.sendall(handshake(LONG_STREAM))
        assert connection.recv(12) == b"HTTP/1.1 101"
        wait_for(lambda: service.metric('kinboard_refused_connections_total{why="unread"}') > before, 30)
        wait_for(lambda: closed(connection), 30)
    assert "read nothing of what it was sent" in service.log  # perhaps of an earlier connection: one line a minute


# -- how many --------------------------------------------------------------------------------------------------


def test_one_client_gets_its_share_of_the_connections_and_others_the_rest(service):
    wait_for(lambda: service.metric("kinboard_connections") == 1, 30)
    with ExitStack() as stack:
        for _ in range(15):
            stack.enter_context(service.connection("127.0.0.2"))
        with service.connection("127.0.0.2") as one_more:
            answer = answer_to(one_more)
        assert answer.startswith(b"HTTP/1.1 503 ")
        assert "127.0.0.2 has 15 connections" in str(problem_in(answer)["detail"])
        assert service.answers_after() < 10
        for _ in range(5):
            stack.enter_context(service.connection("127.0.0.3"))
        with service.connection("127.0.0.4") as too_many:
            assert "20 connections" in str(problem_in(answer_to(too_many))["detail"])
    wait_for(lambda: "KINBOARD_CLIENT_SHARE" in service.log)
    wait_for(lambda: "KINBOARD_MAX_CONNECTIONS" in service.log)
    wait_for(lambda: service.answers_after() < 10, 10)


@pytest.mark.full
def test_one_client_gets_its_share_of_the_viewer_and_others_the_rest(service):
    wait_for(lambda: service.metric("kinboard_visitors") == 0, 30)
    with ExitStack() as stack:

        def visit(source: str) -> ClientConnection:
            protocol = f"viser-v{viser.__version__}"
            line = service.connection(source)
            url = f"ws://127.0.0.1:{service.port}/viewer"
            # Reads everything, so that pings are answered.
            return stack.enter_context(connect(url, sock=line, subprotocols=[protocol], max_queue=None))

        for _ in range(3):
            assert visit("127.0.0.2").recv(timeout=30)
        with pytest.raises(ConnectionClosed) as refused:
            visit("127.0.0.2").recv(timeout=30)
        assert refused.value.rcvd == Close(1013, "All places are taken.")
        assert visit("127.0.0.3").recv(timeout=30)
        with pytest.raises(ConnectionClosed):
            visit("127.0.0.4").recv(timeout=30)
        assert service.metric("kinboard_visitors") == 4


@pytest.mark.full
def test_connections_beyond_the_open_files_are_refused():
    guard = Guard(Settings(), files=100)
    assert guard.refusal("192.0.2.1", 80) is None

    async def refused() -> str | None:
        return guard.refusal("192.0.2.1", 90)

    assert "100 files" in str(asyncio.run(refused()))


@pytest.mark.slow
def test_a_small_limit_of_open_files_is_reported_and_survived():
    with victim(files=64) as service, ExitStack() as stack:
        wait_for(lambda: "only 64 files" in service.log)
        connections = [stack.enter_context(service.connection()) for _ in range(80)]
        answers = []
        for connection in connections:
            connection.settimeout(0.05)
            try:
                answers.append(connection.recv(65536))
            except TimeoutError:
                answers.append(None)
        refused = [answer for answer in answers if answer]
        assert len(refused) > 20
        assert all("ulimit -n" in str(problem_in(answer)["detail"]) for answer in refused)
        assert "ulimit -n" in service.log
        for connection in connections:
            connection.close()
        wait_for(lambda: service.answers_after() < 10, 10)
        assert "Traceback" not in service.log
