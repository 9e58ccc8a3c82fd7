"""The processes of one service: who serves what, connections handed over, and what happens when one is killed."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import threading
import time
from collections.abc import Iterator

import httpx2
import psutil
import pytest
from attacks import ARM, Victim, answer_to, victim
from fake_browser import FakeBrowser
from live_server import wait_for
from websockets.sync.client import connect

from app.live.codes import unused_code
from app.service.handover import AT_ONCE, LARGEST, SUPPORTED, Handover, Member, Phase, Role, members
from app.service.web.access import TRIES, TRY_EVERY

pytestmark = [pytest.mark.skipif(not SUPPORTED, reason="one process on this system"), pytest.mark.full]

HOST = "Host: localhost\r\n"
TARGET = {"target": {"position": [0.045, 0.191, -0.211]}}


@pytest.fixture(scope="module")
def service() -> Iterator[Victim]:
    with victim(ready=True, KINBOARD_RATE_LIMIT="100000") as service:
        yield service
        assert "Traceback" not in service.log


def parts(service: Victim) -> tuple[psutil.Process, psutil.Process]:
    """The processes of the viewer and of REST, which are there."""
    found: list[psutil.Process] = []

    def both() -> bool:
        found[:] = psutil.Process(service.process.pid).children()
        return len(found) == 2

    wait_for(both, 30)
    viewer, rest = sorted(found, key=lambda process: process.nice())
    return viewer, rest


def owners(service: Victim, connection: socket.socket) -> list[psutil.Process]:
    """The processes that hold the service's end of a connection: for a moment two, while it is handed over."""
    port = connection.getsockname()[1]
    return [
        process
        for process in parts(service)
        for each in process.net_connections("tcp")
        if each.raddr and each.raddr[1] == port
    ]


def get(path: str, *fields: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\n{HOST}{''.join(f'{field}{chr(13)}{chr(10)}' for field in fields)}\r\n".encode()


def post(path: str, body: object) -> bytes:
    data = json.dumps(body).encode()
    fields = f"{HOST}Content-Type: application/json\r\nContent-Length: {len(data)}\r\n"
    return f"POST {path} HTTP/1.1\r\n{fields}\r\n".encode() + data


def one_answer(connection: socket.socket) -> tuple[int, bytes]:
    """Status and body of an answer with a length."""
    received = answer_to(connection, until_closed=False)
    head, _, body = received.partition(b"\r\n\r\n")
    (length,) = (int(line[16:]) for line in head.lower().split(b"\r\n") if line.startswith(b"content-length: "))
    while len(body) < length:
        body += connection.recv(1 << 16)
    return int(head[9:12]), body


@pytest.mark.parametrize(
    ("path", "viewer", "rest"),
    [
        ("/viewer", True, False),
        ("/viewer/", True, False),
        ("/viewer/x", True, False),
        ("/viewers", False, True),
        ("/", True, True),
        ("/static/viewer.js", True, True),
        ("/favicon.ico", True, True),
        ("/api/v1/robots", False, True),
        ("/livez", False, True),
        ("/docs", False, True),
        ("/login", False, True),
        ("", False, True),
        ("/api/v1/viewer", False, True),
    ],
)
def test_who_serves_what(path, viewer, rest):
    assert Role.VIEWER.serves(path) is viewer
    assert Role.REST.serves(path) is rest
    assert Role.ALL.serves(path)


def test_requests_of_both_kinds_on_one_connection(service):
    """A reverse proxy mixes them. Each request is served where it belongs, and counted once."""
    viewer, rest = parts(service)
    where = {ARM: [rest], "/static/viewer.css": [rest], "/viewer/": [viewer], "/": [viewer], "/livez": [rest]}
    before = service.metric('kinboard_requests_total{method="GET",route="/api/v1/robots/{robot_id}",status="200"}')
    with service.connection() as connection:
        for path in [*where] * 10:
            connection.sendall(get(path))
            assert one_answer(connection)[0] == 200
            wait_for(lambda: owners(service, connection) == where[path], 30)  # noqa: B023
        # And that of the request for metrics.
        wait_for(lambda: service.metric("kinboard_connections") == 2, 30)
    counted = service.metric(
        'kinboard_requests_total{method="GET",route="/api/v1/robots/{robot_id}",status="200"}'
    )
    assert counted - before == 10


def test_a_path_is_recognised_however_it_is_written(service):
    _, rest = parts(service)
    for path in ("/%61pi/v1/robots", "/api/v1/robots?x=/viewer/", "http://localhost/api/v1/robots"):
        with service.connection() as connection:
            connection.sendall(b"\r\n" + get(path))
            assert one_answer(connection)[0] == 200
            wait_for(lambda: owners(service, connection) == [rest], 30)


def test_a_head_and_a_large_body_in_pieces(service):
    q = [0.1, 0.2, 0.3, 0.4, 0.5]
    sent = post(f"{ARM}/fk", {"q": [q] * 8000})
    with service.connection() as connection:
        connection.sendall(get("/"))
        assert one_answer(connection)[0] == 200
        end = sent.index(b"\r\n\r\n") + 4
        pieces = [sent[k : k + 1] for k in range(end)]
        pieces += [sent[k : k + 50_000] for k in range(end, len(sent), 50_000)]
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for piece in pieces:
            connection.sendall(piece)
        status, body = one_answer(connection)
        assert status == 200
        assert len(json.loads(body)["results"]) == 8000
        connection.sendall(sent)  # at once
        assert one_answer(connection) == (200, body)


def test_a_websocket_after_a_request_of_the_other_kind(service):
    viewer, rest = parts(service)
    upgrade = ("Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13")
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="
    stream = f"{ARM}/workspace/stream?n=1000"
    for first, then, owner in (("/livez", "/viewer", viewer), ("/", stream, rest)):
        with service.connection() as connection:
            connection.sendall(get(first))
            assert one_answer(connection)[0] == 200
            connection.sendall(get(then, *upgrade, key))
            assert connection.recv(12) == b"HTTP/1.1 101"
            wait_for(lambda: owners(service, connection) == [owner], 30)  # noqa: B023


def test_requests_sent_ahead(service):
    with service.connection() as connection:  # of one kind: all are answered
        connection.sendall(get(ARM) * 5 + get(ARM, "Connection: close"))
        assert answer_to(connection).count(b"HTTP/1.1 200") == 6
    with service.connection() as connection:  # of both kinds: those before the change
        connection.sendall(get("/") * 2 + get(ARM) * 3)
        answer = answer_to(connection)
    assert answer.count(b"HTTP/1.1 200") == 2
    assert b"robots" not in answer.rpartition(b"\r\n\r\n")[2][:20]
    with service.connection() as connection:
        connection.sendall(post(f"{ARM}/ik", TARGET) + get("/viewer/"))
        assert answer_to(connection).count(b"HTTP/1.1 200") == 1


def test_malformed_requests_are_refused_by_either(service):
    with service.connection() as connection:
        connection.sendall(b"nonsense\r\n\r\n")
        assert answer_to(connection).startswith(b"HTTP/1.1 400")
    with service.connection() as connection:
        connection.sendall(get(ARM) + b"nonsense\r\n\r\n")
        assert answer_to(connection).count(b"HTTP/1.1 ") >= 1


class Asking(threading.Thread):
    """Requests over new connections, one after the other, until the end of the context."""

    def __init__(self, service: Victim) -> None:
        super().__init__()
        self.url = f"{service.url}{ARM}/ik"
        self.ended = threading.Event()
        self.statuses: list[int] = []
        self.errors: list[Exception] = []

    def __enter__(self) -> Asking:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self.join(60)

    def run(self) -> None:
        while not self.ended.is_set():
            try:
                answer = httpx2.post(self.url, json=TARGET, trust_env=False, timeout=60, verify=False)
                self.statuses.append(answer.status_code)
            except httpx2.HTTPError as error:
                self.errors.append(error)


def test_visitors_and_programs_do_not_notice_that_the_process_for_rest_is_killed(service):
    viewer, rest = parts(service)
    with FakeBrowser(service.port) as tab, Asking(service) as asking:
        wait_for(lambda: len(asking.statuses) > 3, 30)
        rest.kill()
        wait_for(lambda: not rest.is_running() or rest.status() == "zombie", 30)
        tab.set("1 rotating base", 12.0)
        tab.settle()
        assert tab.value("1 rotating base") == 12.0
        wait_for(lambda: livez(service) not in (rest.pid, viewer.pid), 60)
        wait_for(lambda: ready(service), 60)
        count = len(asking.statuses)
        wait_for(lambda: len(asking.statuses) > count + 3, 30)
    # A request that the process was working on is lost with it.
    assert len(asking.errors) <= 1
    assert set(asking.statuses) == {200}
    assert parts(service)[0] == viewer


def test_programs_do_not_notice_that_the_process_of_the_viewer_is_killed(service):
    viewer, rest = parts(service)
    wait_for(lambda: ready(service), 60)
    with service.connection() as kept, Asking(service) as asking:
        kept.sendall(get(ARM))
        assert one_answer(kept)[0] == 200
        viewer.kill()
        kept.sendall(get("/livez"))
        assert json.loads(one_answer(kept)[1])["pid"] == rest.pid
        wait_for(lambda: ready(service), 60)
        count = len(asking.statuses)
        wait_for(lambda: len(asking.statuses) > count + 3, 30)
    assert len(asking.errors) <= 1  # one that the process had just accepted
    assert set(asking.statuses) == {200}
    now, same = parts(service)
    assert same == rest
    assert now != viewer
    with FakeBrowser(service.port) as tab:
        tab.settle()
    with service.connection() as connection:  # accepted by the new one
        wait_for(lambda: owners(service, connection) == [now], 10)


def livez(service: Victim) -> int:
    pid = httpx2.get(f"{service.url}/livez", trust_env=False, timeout=60).json()["pid"]
    assert isinstance(pid, int)
    return pid


def ready(service: Victim) -> bool:
    return httpx2.get(f"{service.url}/readyz", trust_env=False, timeout=60).status_code == 200


def test_a_stop_ends_both_in_order_and_the_end_of_the_supervisor_too():
    with victim(ready=True) as service:
        children = parts(service)
        with connect(f"ws://127.0.0.1:{service.port}{ARM}/workspace/stream?n=1000", proxy=None) as stream:
            assert stream.recv(timeout=30)
            service.process.kill()
            wait_for(lambda: not any(each.is_running() for each in children), 30)
        with contextlib.suppress(OSError):
            socket.create_connection(("127.0.0.1", service.port)).close()
            raise AssertionError("somebody still listens")


def test_limits_of_clients_are_counted_once():
    limits = {
        "KINBOARD_MAX_CONNECTIONS": "12",
        "KINBOARD_TOKEN": "a long token",
        "KINBOARD_RECEIVE_TIMEOUT": "120",
    }
    with victim(ready=True, **limits) as service, contextlib.ExitStack() as stack:
        url = f"{service.url}{ARM}"
        wrong = {"authorization": "Bearer wrong"}
        began = time.monotonic()
        tries = [httpx2.get(url, headers=wrong, trust_env=False, timeout=60).status_code for _ in range(TRIES)]
        while tries[-1] == 401 and len(tries) < 2 * TRIES:
            form = httpx2.post(f"{service.url}/login", data={"token": "wrong"}, trust_env=False, timeout=60)
            tries.append(form.status_code)
        allowed = TRIES + int((time.monotonic() - began) / TRY_EVERY)  # of a slow machine, some are forgotten
        assert tries[-1] == 429
        assert TRIES <= tries.count(401) <= allowed
        kept = [stack.enter_context(service.connection("127.0.0.2")) for _ in range(9)]
        for connection in kept:  # the share of one client, all handed over
            connection.sendall(get("/livez"))
            assert one_answer(connection)[0] == 200
        with service.connection("127.0.0.2") as one_more:
            one_more.sendall(get("/livez"))
            answer = answer_to(one_more)
        assert answer.startswith(b"HTTP/1.1 503")
        assert b"127.0.0.2 has 9 connections" in answer
        for connection in kept:
            connection.close()
        wait_for(lambda: httpx2.get(f"{service.url}/livez", trust_env=False).status_code == 200, 10)


# -- the channel by itself -------------------------------------------------------------------------------------


class FakeTransport:
    """One end of a connection that is to be handed over."""

    def __init__(self) -> None:
        self.client, self._ours = socket.socketpair()
        self.aborted = False

    def get_extra_info(self, name: str) -> socket.socket:
        assert name == "socket"
        return self._ours

    def is_closing(self) -> bool:
        return self.aborted

    def abort(self) -> None:
        self.aborted = True
        self._ours.close()


@pytest.fixture
def pair() -> Iterator[tuple[Member, Member]]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        viewer, rest = members([listener], 1, bytearray)
        yield viewer, rest
        for end in (*viewer.links.values(), *rest.links.values()):
            end.close()


def test_more_than_the_socket_holds_waits_and_arrives_in_order(pair):
    viewer, rest = pair
    count = 40

    async def run() -> list[bytes]:
        sender, receiver = Handover(viewer), Handover(rest)
        found: list[bytes] = []
        transports = [FakeTransport() for _ in range(count)]
        for k, transport in enumerate(transports):
            sender.send(1, transport, b"%03d" % k + bytes(LARGEST - 3))  # type: ignore[arg-type]
        assert not transports[-1].aborted  # its turn has not come
        transports[-2].abort()

        def adopt(connection: socket.socket, data: bytes) -> None:
            assert len(data) == LARGEST
            connection.sendall(data[:3])
            connection.close()
            found.append(data[:3])

        receiver.start(adopt)
        while len(found) < count - 1:
            await asyncio.sleep(0.01)
        receiver.stop()
        for k, transport in enumerate(transports):
            assert transport.client.recv(3) == (b"" if k == count - 2 else b"%03d" % k)
            transport.client.close()
        return found

    assert asyncio.run(asyncio.wait_for(run(), 30)) == [b"%03d" % k for k in range(count) if k != count - 2]


def test_what_was_sent_before_the_end_is_taken(pair):
    viewer, rest = pair

    async def run() -> int:
        sender, receiver = Handover(viewer), Handover(rest)
        transports = [FakeTransport() for _ in range(3 * AT_ONCE)]
        for transport in transports:
            sender.send(1, transport, b"GET")  # type: ignore[arg-type]
        taken: list[bytes] = []
        receiver.start(lambda connection, data: (connection.close(), taken.append(data))[0])
        receiver.stop()
        for transport in transports:
            transport.client.close()
        return len(taken)

    assert asyncio.run(run()) == 3 * AT_ONCE


def test_nothing_is_handed_to_a_process_that_is_away(pair):
    viewer, rest = pair
    handover = Handover(viewer, "/arm")
    assert handover.destination("/livez") is None
    rest.report(Phase.SERVING)
    assert handover.destination("/livez") == 1
    assert handover.destination("/arm/livez") == 1
    assert handover.destination("/arm/viewer/") is None
    assert handover.destination("/viewer/") is None


def test_a_program_reaches_the_process_with_its_page():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        found = members([listener] * 3, 1, bytearray)
        for member in found:
            member.report(Phase.READY)
        assert [member.place for member in found[::2]] == [(0, 3), (1, 3), (2, 3)]
        path = f"/api/v1/live/{unused_code((), place=2, places=3)}"
        handovers = [Handover(member) for member in found]
        assert [handover.destination(path) for handover in handovers] == [4, 0, 4, 2, None, 4]
        assert handovers[2].destination(path, adopted=True) == 4  # a process for REST has sent it half the way
        assert handovers[4].destination(path, adopted=True) is None
        assert handovers[2].destination("/livez") == 3  # other requests stay within their group
        assert handovers[3].destination("/livez", adopted=True) is None
        found[4].report(Phase.AWAY)
        assert [handover.destination(path) for handover in handovers] == [None, 0, None, 2, None, None]
        for member in found:
            for end in member.links.values():
                end.close()


def test_several_processes_take_turns():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        found = members([listener], 3, bytearray)
        for member in found[1:]:
            member.report(Phase.READY)
        handover = Handover(found[0])
        assert sorted(handover.destination("/livez") or 0 for _ in range(6)) == [1, 1, 2, 2, 3, 3]
        found[2].report(Phase.AWAY)
        assert {handover.destination("/livez") for _ in range(6)} == {1, 3}
        for member in found:
            for end in member.links.values():
                end.close()
