"""How far a websocket is read while its messages wait: the rest stays in the client's own buffers."""

from __future__ import annotations

import asyncio
from typing import Any

from app.service.websocket_protocol import AHEAD, PIECE, WebSocketProtocol


class Line:
    """A transport that only notes whether it is read."""

    def __init__(self) -> None:
        self.reads, self.stops = True, 0

    def pause_reading(self) -> None:
        self.reads, self.stops = False, self.stops + 1

    def resume_reading(self) -> None:
        self.reads = True


def connected() -> Any:
    """A connection whose messages nobody takes yet."""
    protocol: Any = WebSocketProtocol.__new__(WebSocketProtocol)
    protocol.transport, protocol.queue = Line(), asyncio.Queue()
    protocol.read_paused = protocol.close_sent = False
    return protocol


def arrive(protocol: Any, kind: str, data: bytes) -> None:
    protocol.curr_msg_data_type, protocol.frames = kind, [data]
    protocol.send_receive_event_to_app()


def test_a_few_messages_are_read_ahead_and_no_more() -> None:
    protocol = connected()
    for k in range(AHEAD):
        arrive(protocol, "bytes", bytes([k]))
        assert protocol.transport.reads, k
    arrive(protocol, "bytes", b"x")
    assert not protocol.transport.reads
    arrive(protocol, "text", b"y")  # came in the same piece
    assert protocol.transport.stops == 1


def test_nothing_is_read_after_a_long_message() -> None:
    protocol = connected()
    arrive(protocol, "bytes", bytes(PIECE))
    assert protocol.transport.reads
    arrive(protocol, "bytes", bytes(PIECE + 1))
    assert not protocol.transport.reads
    protocol = connected()
    protocol.curr_msg_data_type, protocol.frames = "text", [bytes(PIECE), b"x"]
    protocol.send_receive_event_to_app()
    assert not protocol.transport.reads, "its fragments count together"


def test_it_is_read_again_when_all_that_waited_is_taken() -> None:
    async def take_all() -> None:
        protocol = connected()
        for k in range(AHEAD + 2):
            arrive(protocol, "text", b"%d" % k)
        for k in range(AHEAD + 2):
            assert not protocol.transport.reads
            event = await WebSocketProtocol.__base__.receive(protocol)  # type: ignore[union-attr]
            assert event == {"type": "websocket.receive", "text": str(k)}
        assert protocol.transport.reads
        arrive(protocol, "text", b"next")
        assert protocol.transport.stops == 1

    asyncio.run(take_all())
