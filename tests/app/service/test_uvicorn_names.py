"""uvicorn's undocumented names: without one, uvicorn's own protocols serve."""

from __future__ import annotations

import logging

import httpx2
import pytest
from fastapi import FastAPI, WebSocket
from live_server import serve
from private_names import asked_again, leave_out, take_away
from websockets.sync.client import connect

from app.service.http_protocol import HttpProtocol
from app.service.server import protocols
from app.service.uvicorn_names import PROTOCOLS
from app.service.websocket_protocol import WebSocketProtocol


def test_the_installed_version_has_all_names() -> None:
    assert PROTOCOLS.missing() == []
    assert protocols() == (HttpProtocol, WebSocketProtocol)


@pytest.mark.parametrize("name", PROTOCOLS.names)
def test_without_a_name_uvicorn_s_own_protocol_is_taken(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, name: str
) -> None:
    take_away(monkeypatch, name)
    asked_again(monkeypatch, PROTOCOLS)
    with caplog.at_level(logging.WARNING, "kinboard.libraries"):
        found = [protocols() for _ in range(2)]
    assert found == 2 * [("auto", "auto")]
    (line,) = caplog.messages
    assert name in line
    assert line.endswith(PROTOCOLS.without)


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.get("/double")
    async def _(number: int) -> int:
        return 2 * number

    @app.websocket("/echo")
    async def _(visitor: WebSocket) -> None:
        await visitor.accept()
        await visitor.send_bytes(await visitor.receive_bytes())
        await visitor.close()

    return app


@pytest.mark.parametrize("lacking", [False, True])
def test_requests_and_websockets_are_served_all_the_same(
    monkeypatch: pytest.MonkeyPatch, app: FastAPI, lacking: bool
) -> None:
    if lacking:
        leave_out(monkeypatch, PROTOCOLS)
    with serve(app) as port:
        assert httpx2.get(f"http://127.0.0.1:{port}/double?number=21").json() == 42
        with connect(f"ws://127.0.0.1:{port}/echo") as websocket:
            websocket.send(b"a message")
            assert websocket.recv() == b"a message"
