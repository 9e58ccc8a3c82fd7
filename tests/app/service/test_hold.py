"""What a service holds, and for how long, when clients misbehave: real processes, connections, bounded loads."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator

import httpx2
import pytest
from test_faults import service

FAR = {"position": [5.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}  # takes the Panda some tenths of a second each
API = "/api/v1/robots"


@pytest.fixture
def base() -> Iterator[str]:
    """Address of a service with the default settings."""
    with service() as (_, address):
        yield address


def drop(base: str, count: int, requests: Iterator[bytes], within: float) -> None:
    """Send `count` requests over connections of their own, and close them all after `within` seconds."""
    host, _, port = base.partition(":")
    sockets = [socket.create_connection((host, int(port)), timeout=10) for _ in range(count)]
    for connection in sockets:
        connection.sendall(next(requests))
    time.sleep(within)
    for connection in sockets:
        connection.close()


def get(address: str) -> bytes:
    return f"GET {address} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()


def post(address: str, body: object) -> bytes:
    content = json.dumps(body).encode()
    head = f"POST {address} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content


@pytest.mark.slow
def test_abandoned_summaries_do_not_delay_the_next_one(base):
    """32 summaries of some ten seconds each, all dropped within two seconds."""
    addresses = (f"{API}/irb120/workspace/summary?effort=16&limit=1:-1:{1 + k / 100}" for k in range(32))
    drop(base, 32, (get(address) for address in addresses), 2.0)
    began = time.monotonic()
    while (
        answer := httpx2.get(
            f"http://{base}{API}/pioneer5/workspace/summary?volume=false", trust_env=False, timeout=60
        )
    ).status_code == 503:
        assert time.monotonic() - began < 30, answer.text
    print(f"the next summary took {time.monotonic() - began:.1f} s")
    assert time.monotonic() - began < 30


@pytest.mark.slow
def test_abandoned_batches_do_not_delay_a_target(base):
    """16 batches that take every slot for half a minute, all dropped after a second."""
    body = post(f"{API}/panda/ik", {"target": [FAR] * 5000})
    drop(base, 16, iter([body] * 16), 1.0)
    began = time.monotonic()
    answer = httpx2.post(
        f"http://{base}{API}/pioneer5/ik",
        json={"target": {"position": [0.045, 0.191, -0.211]}},
        trust_env=False,
        timeout=60,
    )
    print(f"the next target took {time.monotonic() - began:.1f} s")
    assert answer.status_code == 200
    assert time.monotonic() - began < 15
