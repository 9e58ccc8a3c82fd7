"""What one connection may send: where a request ends, which host it is for, and what comes after its head."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from attacks import answer_to, problem_in
from live_server import serve
from starlette.types import Receive, Scope, Send

from app.service.http_protocol import MAX_HEAD

HOST = b"Host: localhost\r\n"
LAST = HOST + b"Connection: close\r\n"
POST = b"POST / HTTP/1.1\r\n" + LAST
CHUNKED = POST + b"Transfer-Encoding: chunked\r\n\r\n"
H2C = HOST + b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABk\r\n"


async def reflect(scope: Scope, receive: Receive, send: Send) -> None:
    """Answers a POST with its header fields, as they are after the body has been read, and a GET at once."""
    if scope["type"] == "lifespan":
        await receive()
        await send({"type": "lifespan.startup.complete"})
        return
    size, more = 0, scope["method"] == "POST"
    while more:
        message = await receive()
        size, more = size + len(message.get("body", b"")), message.get("more_body", False)
    names = sorted(name.decode() for name, _ in scope["headers"])
    found = json.dumps({"method": scope["method"], "names": names, "size": size}).encode()
    await send(
        {"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"%d" % len(found))]}
    )
    await send({"type": "http.response.body", "body": found})


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    with serve(reflect) as port:
        yield port


def answer(port: int, *parts: bytes) -> bytes:
    """What the service answers before it closes the connection."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        for part in parts:
            connection.sendall(part)
        return answer_to(connection)


def reflected(port: int, *parts: bytes) -> list[dict[str, Any]]:
    """What the service has read: the reflections of all requests, the last of which closes the connection."""
    whole = answer(port, *parts)
    answers = whole.split(b"HTTP/1.1 ")[1:]
    assert all(each.startswith(b"200 ") for each in answers), whole
    return [json.loads(each.partition(b"\r\n\r\n")[2]) for each in answers]


def refused(port: int, status: int, *parts: bytes) -> str:
    """The detail of the problem document with which the connection ends."""
    found = answer(port, *parts)
    assert found.startswith(b"HTTP/1.1 %d " % status), found[:200]
    return str(problem_in(found)["detail"])


def cut_off(port: int, *parts: bytes) -> None:
    """Expect 431, or a reset: the answer is lost if something is unread when the service closes the connection."""
    try:
        found = answer(port, *parts)
    except ConnectionError:
        return
    if found:
        assert found.startswith(b"HTTP/1.1 431 "), found[:200]
        assert "Trailers and chunk extensions" in str(problem_in(found)["detail"])


# -- trailers and chunk extensions -----------------------------------------------------------------------------


def test_trailers_are_dropped(port):
    trailers = b"Authorization: Bearer token\r\nExpect: 100-continue\r\nHost: elsewhere\r\nX-Checksum: 1\r\n"
    (found,) = reflected(port, CHUNKED, b"3\r\nabc\r\n0\r\n", trailers, b"\r\n")
    assert found == {"method": "POST", "names": ["connection", "host", "transfer-encoding"], "size": 3}


@pytest.mark.parametrize(("size", "passes"), [(60_000, True), (250_000, False)])
@pytest.mark.parametrize("at_once", [True, False])
def test_trailers_are_bounded(port, size, passes, at_once):
    field = b"b" * (size // 2)
    trailers = b"0\r\na: " + field + b"\r\nc: " + field + b"\r\n\r\n"
    sent = [CHUNKED + trailers] if at_once else [CHUNKED, trailers]
    if passes:
        assert reflected(port, *sent)[0]["size"] == 0
    else:
        cut_off(port, *sent)


LONG = b"0" * 3 * MAX_HEAD  # up to one `MAX_HEAD` may come with the head, and is not counted
CHUNKS = {
    "one extension": b"1;name=" + LONG + b"\r\nb\r\n",
    "one value": b'1;name="' + LONG + b'"\r\nb\r\n',
    "many extensions": b"1" + b";x" * 2 * MAX_HEAD + b"\r\nb\r\n",
    "one extension each": (b"1;" + b"x" * 40 + b"\r\nb\r\n") * 6000,
    "a long size": LONG + b"1\r\nb\r\n",
}


@pytest.mark.parametrize("what", CHUNKS)
def test_chunk_extensions_are_bounded(port, what):
    cut_off(port, CHUNKED, CHUNKS[what], b"0\r\n\r\n")


def test_many_small_chunks_with_short_extensions_are_read(port):
    (found,) = reflected(port, CHUNKED, b"1;a=b\r\nc\r\n" * 30_000 + b"0\r\n\r\n")
    assert found["size"] == 30_000


@pytest.mark.parametrize("piece", [b"a: b\r\n", b"a" * 64], ids=["fields", "one field"])
def test_trailers_after_the_answer_end_the_connection(port, piece):
    """A request that nobody reads is answered before its trailers come."""
    block, count = piece * (65536 // len(piece)), 0
    with socket.create_connection(("127.0.0.1", port), timeout=30) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\n" + HOST + b"Transfer-Encoding: chunked\r\n\r\n0\r\n")
        assert answer_to(connection, until_closed=False).startswith(b"HTTP/1.1 200 ")
        with suppress(OSError):
            while count < 1000:  # 64 MB, more than fits between the two
                connection.sendall(block)
                count += 1
    assert count < 1000


# -- hosts, lengths, versions ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "hosts", "valid"),
    [
        (b"GET / HTTP/1.1", [b"localhost"], True),
        (b"GET / HTTP/1.1", [], False),
        (b"GET / HTTP/1.1", [b"localhost", b"localhost"], False),
        (b"GET http://localhost/ HTTP/1.1", [], False),
        (b"GET / HTTP/1.0", [], True),
        (b"GET / HTTP/1.0", [b"a", b"b"], False),
    ],
)
def test_a_request_has_one_host(port, start, hosts, valid):
    fields = b"".join(b"Host: " + host + b"\r\n" for host in hosts)
    sent = start + b"\r\n" + fields + b"Connection: close\r\n\r\n"
    if valid:
        assert reflected(port, sent)
    else:
        assert "Host" in refused(port, 400, sent)


def test_a_websocket_has_one_host_too(port):
    fields = b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    assert "Host" in refused(port, 400, b"GET / HTTP/1.1\r\n" + fields + b"Sec-WebSocket-Key: eA==\r\n\r\n")


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        (b"Content-Length: 3\r\nContent-Length: 3", 400),
        (b"Content-Length: 3\r\nContent-Length: 4", 400),
        (b"Content-Length: 3, 3", 400),
        (b"Content-Length: +3", 400),
        (b"Content-Length: 99999999999999999999", 400),
        (b"Content-Length : 3", 400),
        (b"Content-Length: 3\r\nTransfer-Encoding: chunked", 400),
        (b"Transfer-Encoding: chunked\r\nContent-Length: 3", 400),
        (b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked", 400),
        (b"Transfer-Encoding: chunked, identity", 400),
        (b"Transfer-Encoding:\r\n chunked", 400),
        (b"X-Folded: a\r\n b", 400),
        (b"X-Bare: a\nContent-Length: 3", 400),
        (b"Transfer-Encoding: gzip, chunked", 501),
        (b"Transfer-Encoding: identity", 501),
    ],
)
def test_a_request_ends_in_one_place(port, fields, status):
    refused(port, status, POST + fields + b"\r\n\r\n")


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (b"GET /\r\n\r\n", 505),
        (b"GET / HTTP/2.0\r\n" + HOST + b"\r\n", 505),
        (b"GET / HTTP/1.2\r\n" + HOST + b"\r\n", 400),
        (b"CONNECT localhost:80 HTTP/1.1\r\n" + HOST + b"\r\n", 501),
        (b"CONNECT / HTTP/1.1\r\n" + HOST + b"\r\n", 501),
        (b"GET http://:80:/ HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    ],
)
def test_another_kind_of_request_is_refused_without_a_traceback(port, sent, status, caplog):
    refused(port, status, sent)
    assert "Traceback" not in caplog.text


# -- another protocol that is offered --------------------------------------------------------------------------


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize("chunked", [True, False])
def test_a_body_stays_a_body_when_another_protocol_is_offered(port, at_once, chunked):
    """As Java's client does with each first request: otherwise its body would be taken for the next request."""
    body = b"GET /second HTTP/1.1\r\n" + HOST + b"\r\n"
    framed = b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body) if chunked else body
    length = b"Transfer-Encoding: chunked" if chunked else b"Content-Length: %d" % len(body)
    parts = [b"POST / HTTP/1.1\r\n" + H2C + length + b"\r\n\r\n", framed, b"GET / HTTP/1.1\r\n" + LAST + b"\r\n"]
    found = reflected(port, *([b"".join(parts)] if at_once else parts))
    assert [(each["method"], each["size"]) for each in found] == [("POST", len(body)), ("GET", 0)]
    assert "upgrade" not in found[0]["names"]
