"""The bridge between a visitor's websocket and the viewer, with a small stand-in for the viewer."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import threading
import time
from collections.abc import AsyncIterator, Iterator
from functools import partial
from urllib.parse import quote

import httpx2
import msgspec
import pytest
from fastapi import FastAPI
from live_server import serve, wait_for
from starlette.types import Message
from starlette.websockets import WebSocket
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from app.service.web.inspection import BURST, RATE, MessageLimit
from app.service.web.negotiation import accepts_gzip, is_current
from app.service.web.viewer_proxy import CHANNEL_PROTOCOL, ViewerBridge, VisitorConnection, _serve
from app.shared.connection import Connection, ConnectionEnded, FileRefused, PageConnection, SentFile
from app.shared.settings import Settings
from app.shared.slots import Slots

PROTOCOL = "viser-v9.9.9"


def said(word: str, **fields: object) -> bytes:
    """A message as sent by our page."""
    return msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": word, "updates": {"value": 1}} | fields)


HELLO = said("hello")


class StandIn:
    """Echoes every message; a few messages make it misbehave."""

    def __init__(self) -> None:
        self.received: list[bytes] = []
        self.endings: list[int] = []
        self.subprotocols: list[str | None] = []
        self.sent = 0
        self.files: list[tuple[str, SentFile, bytes]] = []

    def page(self) -> bytes:
        return b"<html><title>Viser</title>page</html>"

    async def serve(self, connection: Connection) -> ConnectionEnded:
        self.subprotocols.append(connection.subprotocol)
        try:
            while True:
                message = await connection.receive()
                self.received.append(message)
                match msgspec.msgpack.decode(message).get("uuid"):
                    case "close":
                        raise ConnectionEnded(4001, "bye")
                    case "fail":
                        raise RuntimeError("broken")
                    case "flood":
                        for k in range(200):
                            await connection.send(k.to_bytes(4, "little") + bytes(1_000_000))
                            self.sent += 1
                    case "bytes":
                        await connection.send(bytes(range(256)) * 20_000)
                    case _:
                        await connection.send(message)
        except ConnectionEnded as end:
            self.endings.append(end.code)
            return end

    async def receive_file(self, name: str, sent: SentFile, parts: AsyncIterator[bytes]) -> None:
        """Keeps what it gets; refuses files for nobody."""
        if sent.feature == "nobody":
            raise FileRefused(413, "it is too large", said=True)
        self.files.append((name, sent, b"".join([part async for part in parts])))

    async def serve_channel(self, connection: PageConnection, name: str) -> ConnectionEnded:
        """Says the name, and echoes every text."""
        try:
            await connection.send(name)
            while True:
                await connection.send(await connection.receive())
        except ConnectionEnded as end:
            self.endings.append(end.code)
            return end


@pytest.fixture
def viser() -> StandIn:
    return StandIn()


@pytest.fixture
def bridge(viser: StandIn) -> ViewerBridge:
    bridge = ViewerBridge(allowed_origins=("https://school.example",))
    bridge.viewer = viser
    return bridge


@pytest.fixture
def port(bridge: ViewerBridge) -> Iterator[int]:
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app) as port:
        yield port


def visit(port: int, path: str = "/viewer", **options):
    options = {"subprotocols": [PROTOCOL], "max_size": None, "proxy": None} | options
    return connect(f"ws://127.0.0.1:{port}{path}", **options)


@pytest.mark.parametrize("path", ["/viewer", "/viewer/"])
def test_bytes_are_passed_unchanged_in_both_directions(port, viser, path):
    with visit(port, path) as visitor:
        assert visitor.subprotocol == PROTOCOL
        for message in (HELLO, said("é", updates={"value": [1.5, None, b"\x00\xff"]})):
            visitor.send(message)
            assert visitor.recv(timeout=10) == message
        visitor.send(said("bytes"))
        assert visitor.recv(timeout=10) == bytes(range(256)) * 20_000
    assert viser.subprotocols == [PROTOCOL]


def test_a_visitor_without_a_subprotocol_gets_none(port, viser):
    with visit(port, subprotocols=None) as visitor:
        visitor.send(HELLO)
        assert visitor.recv(timeout=10) == HELLO
        assert visitor.subprotocol is None


def test_nothing_is_compressed(port):
    with visit(port) as visitor:
        assert visitor.protocol.extensions == []


@pytest.mark.parametrize(
    ("origin", "headers"),
    [
        (None, {}),
        ("http://127.0.0.1:{port}", {}),
        ("https://arm.example", {"X-Forwarded-Host": "arm.example"}),
        ("https://arm.example", {"X-Forwarded-Host": "arm.example:443, inner.example"}),
        ("https://school.example", {}),
        ("https://SCHOOL.example", {}),
    ],
)
def test_our_own_pages_may_connect(port, origin, headers):
    origin = origin and origin.format(port=port)
    with visit(port, origin=origin, additional_headers=headers) as visitor:
        visitor.send(HELLO)
        assert visitor.recv(timeout=10) == HELLO


@pytest.mark.parametrize(
    ("origin", "headers"),
    [
        ("https://evil.example", {}),
        ("http://127.0.0.1:{port}.evil.example", {}),
        ("http://127.0.0.1:1", {}),
        ("http://127.0.0.1", {}),
        ("null", {}),
        ("", {}),
        ("https://evil.example", {"X-Forwarded-Host": "arm.example"}),
        ("http://school.example.evil", {}),
    ],
)
def test_pages_of_other_sites_are_refused(port, viser, origin, headers, caplog):
    headers = {"Origin": origin.format(port=port)} | headers
    with pytest.raises(InvalidStatus) as refusal:
        visit(port, additional_headers=headers)
    assert refusal.value.response.status_code == 403
    assert viser.subprotocols == [], "viser must not even see the connection"
    assert [record.levelname for record in caplog.records if record.name != "websockets.server"] == ["WARNING"]


@pytest.mark.parametrize(
    "fields",
    [
        {"type": "ShareUrlRequest"},
        {"type": "ShareUrlDisconnect"},
        {"type": "FileTransferStartUpload", "size_bytes": 1 << 40},
        {"type": "GetRenderResponseMessage", "payload": b"x"},
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"update_cb": []}},
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": 1, "gui_api": None}},
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": "value"},
        {"type": "RunJavascriptMessage", "source": "alert(1)"},
        {"type": "RemoveSceneNodeMessage", "name": "/arm"},
        {"type": None},
        {"type": ["GuiUpdateMessage"]},
        {"kind": "GuiUpdateMessage"},
    ],
)
def test_messages_that_a_visitor_may_not_send_are_dropped(port, viser, fields):
    with visit(port) as visitor:
        visitor.send(msgspec.msgpack.encode(fields))
        visitor.send(HELLO)
        assert visitor.recv(timeout=10) == HELLO
    assert viser.received == [HELLO]


def nested(depth: int) -> bytes:
    return HELLO[:-1] + b"\x91" * depth + b"\x00"


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"\xc1",
        b"ShareUrl is not msgpack",
        msgspec.msgpack.encode(["type", "GuiUpdateMessage"]),
        HELLO[:-1],
        HELLO + b"\x00",
        said("a", padding="x" * 65_536),
        nested(20),
        nested(60_000),
        b"\x81\xa4type\xdd\xff\xff\xff\xff",
        b"\x81\xa4\xff\xff\xff\xff\x00",
    ],
    ids=lambda message: f"{len(message)} bytes",
)
def test_an_invalid_message_closes_only_its_own_connection(port, viser, message):
    with visit(port) as honest, visit(port) as visitor:
        visitor.send(message)
        with pytest.raises(ConnectionClosed) as end:
            visitor.recv(timeout=10)
        assert end.value.rcvd is not None
        assert end.value.rcvd.code == 1007
        honest.send(HELLO)
        assert honest.recv(timeout=10) == HELLO
    assert viser.received == [HELLO]


def test_a_huge_message_is_not_read(viser, bridge):
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app) as port, visit(port) as visitor:
        with contextlib.suppress(ConnectionClosed):  # the connection may be closed while sending
            visitor.send(bytes(10_000_000))
        with pytest.raises(ConnectionClosed) as end:
            visitor.recv(timeout=10)
        assert end.value.rcvd is None or end.value.rcvd.code == 1009
    assert viser.received == []


@pytest.mark.full
def test_a_flood_is_throttled_without_delaying_other_visitors(port, viser):
    stop = threading.Event()

    def pour() -> None:
        with visit(port, close_timeout=0.1) as visitor:
            while not stop.is_set():
                visitor.send(said("pour"))

    flooding = threading.Thread(target=pour)
    flooding.start()
    try:
        with visit(port) as honest:
            began = time.monotonic()
            waits = []
            while time.monotonic() < began + 2.0:
                sent = time.monotonic()
                honest.send(HELLO)
                assert honest.recv(timeout=10) == HELLO
                waits.append(time.monotonic() - sent)
                time.sleep(0.02)
            came = sum(1 for message in viser.received if message != HELLO)
            assert BURST <= came < BURST + 4 * RATE
            assert sorted(waits)[len(waits) // 2] < 0.1
    finally:
        stop.set()
        flooding.join(10)


def test_a_budget_allows_fast_dragging_and_refills():
    limit = MessageLimit(10.0, 5.0)
    assert [limit.spend(0.0) for _ in range(5)] == [0.0] * 5
    assert limit.spend(0.0) == pytest.approx(0.1)
    assert limit.spend(1000.0) == 0.0
    assert [limit.spend(1000.0) for _ in range(5)][-1] == pytest.approx(0.1)


def test_a_visitor_who_does_not_read_is_disconnected(bridge, viser):
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app, Settings(send_timeout=0.5)) as port, visit(port, max_queue=1, close_timeout=0.1) as visitor:
        visitor.send(said("flood"))
        wait_for(lambda: len(viser.endings) == 1, 10)
        wait_for(lambda: bridge.slots.taken == 0, 10)
        assert viser.sent < 100, "how much the sockets on the way hold differs by tens of megabytes"


def test_a_visitor_beyond_the_limit_gets_a_page_that_says_so(viser):
    bridge = ViewerBridge(slots=Slots(2))
    bridge.viewer = viser
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app) as port:
        with visit(port) as one, visit(port) as two:
            for visitor in (one, two):
                visitor.send(HELLO)
                assert visitor.recv(timeout=10) == HELLO
            assert turned_away(port) == (1013, "All places are taken.")
            page = httpx2.get(f"http://127.0.0.1:{port}/viewer/", trust_env=False)
            assert page.status_code == 503
            assert "All places in the viewer are taken" in page.text
            assert page.headers["retry-after"] == "10"
        wait_for(lambda: bridge.slots.taken == 0)
        with visit(port) as three:
            three.send(HELLO)
            assert three.recv(timeout=10) == HELLO


def test_one_client_leaves_places_to_others(viser):
    bridge = ViewerBridge(slots=Slots(4, 0.5))
    bridge.viewer = viser
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app) as port:
        with visit(port), visit(port):
            wait_for(lambda: bridge.slots.taken == 2)
            assert turned_away(port) == (1013, "All places are taken.")
            with visit(port, source_address=("127.0.0.2", 0)) as other:
                other.send(HELLO)
                assert other.recv(timeout=10) == HELLO
        wait_for(lambda: bridge.slots.taken == 0)


def test_the_close_reason_of_viser_reaches_the_visitor(port):
    with visit(port) as visitor:
        visitor.send(said("close"))
        with pytest.raises(ConnectionClosed) as end:
            visitor.recv(timeout=10)
    assert end.value.rcvd is not None
    assert (end.value.rcvd.code, end.value.rcvd.reason) == (4001, "bye")


def test_a_failing_viewer_closes_only_the_visitors_connection(port, caplog):
    with visit(port) as visitor:
        visitor.send(said("fail"))
        with pytest.raises(ConnectionClosed) as end:
            visitor.recv(timeout=10)
    assert end.value.rcvd is not None
    assert end.value.rcvd.code == 1011
    assert "RuntimeError: broken" in caplog.text
    with visit(port) as visitor:
        visitor.send(HELLO)
        assert visitor.recv(timeout=10) == HELLO


@pytest.mark.parametrize(("code", "seen"), [(1000, 1000), (1001, 1001), (4242, 4242)])
def test_the_viewer_hears_why_a_visitor_has_left(port, viser, code, seen):
    with visit(port) as visitor:
        visitor.send(HELLO)
        visitor.recv(timeout=10)
        visitor.close(code)
    wait_for(lambda: viser.endings == [seen])


def test_a_visitor_who_vanishes_leaves_no_connection_behind(port, viser):
    for _ in range(10):
        visitor = visit(port)
        visitor.send(HELLO)
        visitor.recv(timeout=10)
        visitor.socket.shutdown(socket.SHUT_RDWR)
        visitor.close()
    wait_for(lambda: len(viser.endings) == 10)


def test_text_messages_are_refused(port, viser):
    with visit(port) as visitor:
        visitor.send("text")
        with pytest.raises(ConnectionClosed) as end:
            visitor.recv(timeout=10)
    assert end.value.rcvd is not None
    assert end.value.rcvd.code == 1003
    assert viser.received == []
    wait_for(lambda: len(viser.endings) == 1)


@pytest.mark.full
def test_a_slow_reader_slows_viser_and_memory_stays_bounded(port, viser):
    with visit(port, max_queue=1) as visitor:
        visitor.send(said("flood"))
        wait_for(lambda: viser.sent > 0)
        time.sleep(1.0)  # enough for 200 MB over loopback without backpressure
        assert viser.sent < 100, "how much the sockets on the way hold differs by tens of megabytes"
        for k in range(200):
            message = visitor.recv(timeout=10)
            assert int.from_bytes(message[:4], "little") == k


def test_a_visitor_before_the_viewer_has_started(port, bridge):
    bridge.viewer = None
    page = httpx2.get(f"http://127.0.0.1:{port}/viewer/", trust_env=False)
    assert page.status_code == 503
    assert "is starting" in page.text
    assert page.headers["retry-after"] == "1"
    assert turned_away(port) == (1013, "The viewer is starting.")


def turned_away(port: int) -> tuple[int, str]:
    with visit(port) as visitor, pytest.raises(ConnectionClosed) as end:
        visitor.recv(timeout=10)
    assert end.value.rcvd is not None
    return end.value.rcvd.code, end.value.rcvd.reason


def test_the_page_of_viser_is_served_with_our_policy(port):
    with httpx2.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False) as browser:
        page = browser.get("/viewer/")
        assert page.text == "<html><title>Kinboard viewer</title>page</html>"
        assert page.headers["content-encoding"] == "gzip"
        plain = browser.get("/viewer/", headers={"Accept-Encoding": "identity"})
        assert plain.text == page.text
        assert "content-encoding" not in plain.headers
        for known in (page.headers["etag"], f'"a", W/{page.headers["etag"]}', "*"):
            again = browser.get("/viewer/", headers={"If-None-Match": known})
            assert (again.status_code, again.content) == (304, b"")
        other = browser.get("/viewer/", headers={"Accept-Encoding": "gzip;q=0, br", "If-None-Match": '"a"'})
        assert (other.status_code, other.text) == (200, page.text)
        assert "content-encoding" not in other.headers
        policy = dict(part.split(" ", 1) for part in page.headers["content-security-policy"].split("; "))
        assert policy["connect-src"].split() == ["'self'", "data:", "blob:"]
        assert "http" not in page.headers["content-security-policy"]


@pytest.mark.parametrize(
    ("header", "accepted"),
    [
        ("gzip", True),
        ("br, GZIP;q=0.5", True),
        ("*", True),
        ("gzip ; q=1", True),
        ("", False),
        ("gzip;q=0", False),
        ("gzip; q=0.000, *", False),
        ("*;q=0", False),
        ("identity", False),
        ("xgzip", False),
        ("gzip;q=x", False),
    ],
)
def test_compression_is_used_if_accepted(header, accepted):
    assert accepts_gzip(header) is accepted


@pytest.mark.parametrize(
    ("header", "current"),
    [
        ('"a"', True),
        ('W/"a"', True),
        ('"b", "a"', True),
        ('"b,c" ,W/"a"', True),
        (" * ", True),
        ("", False),
        ("a", False),
        ('"b"', False),
        ('"xa"', False),
        ('W/"b", "c"', False),
    ],
)
def test_a_version_is_found_in_a_list(header, current):
    assert is_current(header, '"a"') is current


def test_the_address_without_a_slash_redirects_to_the_page(port):
    answer = httpx2.get(f"http://127.0.0.1:{port}/viewer?a=b", trust_env=False)
    assert answer.status_code == 307
    assert answer.headers["location"] == "viewer/?a=b"


def test_a_visitor_whose_connection_breaks_while_something_is_sent_leaves_no_error(viser):
    sent: list[str] = []

    async def send(message: Message) -> None:
        sent.append(message["type"])
        if message["type"] == "websocket.send":
            raise OSError("broken pipe")

    asked = iter([{"type": "websocket.connect"}, {"type": "websocket.receive", "bytes": HELLO}])

    async def receive() -> Message:
        return next(asked)

    scope = {
        "type": "websocket",
        "path": "/viewer",
        "headers": [],
        "subprotocols": [PROTOCOL],
        "client": ("::1", 5),
    }
    visitor = WebSocket(scope, receive, send)
    connection = VisitorConnection(visitor)
    asyncio.run(_serve(visitor, connection, PROTOCOL, partial(viser.serve, connection)))
    assert viser.endings == [1001]
    assert sent == ["websocket.accept", "websocket.send"]
    late = VisitorConnection(visitor)
    with pytest.raises(ConnectionEnded):  # of another message that was on its way
        asyncio.run(late.send(HELLO))


# The channel of a page


def visit_channel(port: int, *protocols: str, **options):
    return visit(
        port, "/viewer/channel", subprotocols=list(protocols) or [CHANNEL_PROTOCOL, "name-1_x"], **options
    )


def test_a_channel_passes_texts_and_its_name_stands_in_no_address(port, viser):
    with visit_channel(port) as page:
        assert page.subprotocol == CHANNEL_PROTOCOL
        assert page.recv(timeout=10) == "name-1_x"
        page.send('[1, "é"]')
        assert page.recv(timeout=10) == '[1, "é"]'


@pytest.mark.parametrize(
    "protocols", [[], ["kinboard-1"], ["name"], ["kinboard-2", "name"], ["kinboard-1", "a", "b"]]
)
def test_a_channel_without_one_name_is_refused(port, protocols):
    with pytest.raises(InvalidStatus, match="403"):
        visit(port, "/viewer/channel", subprotocols=protocols or None)


def test_pages_of_other_sites_open_no_channel(port, caplog):
    with pytest.raises(InvalidStatus, match="403"):
        visit_channel(port, additional_headers={"Origin": "https://evil.example"})
    assert [record.levelname for record in caplog.records if record.name != "websockets.server"] == ["WARNING"]


@pytest.mark.parametrize(("message", "code"), [(b"[1]", 1003), ("x" * (65 * 1024 + 1), 1009)])
def test_a_channel_takes_texts_of_at_most_64_kib(port, viser, message, code):
    with visit_channel(port) as page:
        assert page.recv(timeout=10) == "name-1_x"
        page.send(message)
        with pytest.raises(ConnectionClosed) as end:
            page.recv(timeout=10)
        assert end.value.rcvd is not None
        assert end.value.rcvd.code == code


def test_a_channel_waits_for_the_viewer_and_takes_no_place(viser):
    bridge = ViewerBridge(slots=Slots(1))
    app = FastAPI()
    app.router.routes.extend(bridge.routes())
    with serve(app) as port:
        with visit_channel(port) as page, pytest.raises(ConnectionClosed) as end:
            page.recv(timeout=10)
        assert end.value.rcvd is not None
        assert end.value.rcvd.code == 1013
        bridge.viewer = viser
        with visit(port), visit_channel(port) as page:
            assert page.recv(timeout=10) == "name-1_x"
            assert bridge.slots.taken == 1


# Files


def post_file(port: int, about: object = ("robot", "upload", "a é.zip"), **headers: str) -> httpx2.Response:
    given = {"x-kinboard-channel": "name", "x-kinboard-file": quote(json.dumps(about))} | headers
    address = f"http://127.0.0.1:{port}/viewer/upload"
    return httpx2.post(address, content=b"PK" + bytes(100_000), headers=given, trust_env=False)


def test_a_file_reaches_the_page_with_its_name_and_length(port, viser):
    assert post_file(port).status_code == 204
    ((name, sent, data),) = viser.files
    assert (name, sent, len(data)) == ("name", SentFile("robot", "upload", "a é.zip", 100_002), 100_002)


@pytest.mark.parametrize(
    ("about", "headers", "status"),
    [
        (["robot", "upload"], {}, 400),
        ([1, 2, 3], {}, 400),
        ("x", {}, 400),
        (["x" * 5000, "upload", "a"], {}, 400),
        (["robot", "upload", "a"], {"x-kinboard-file": "%ff[["}, 400),
        (["robot", "upload", "a"], {"origin": "https://evil.example"}, 403),
        (["nobody", "upload", "a"], {}, 413),
    ],
)
def test_a_file_whose_head_is_not_ours_is_refused(port, viser, about, headers, status):
    answer = post_file(port, about, **headers)
    assert answer.status_code == status
    assert ("x-kinboard-said" in answer.headers) == (status == 413)
    assert viser.files == []


def test_a_file_needs_its_length(port, viser):
    address = f"http://127.0.0.1:{port}/viewer/upload"
    assert httpx2.post(address, content=iter([b"PK"]), trust_env=False).status_code == 411
    assert viser.files == []
