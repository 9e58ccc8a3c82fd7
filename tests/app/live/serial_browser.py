"""A browser whose serial port is a simulated bus: `serial_port.js` in a page, its websocket ends here."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from pathlib import Path

from feetech_bus import RecordedLine
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from app.servos.simulated import SimulatedPort

PORT = (Path(__file__).parent / "serial_port.js").read_text(encoding="utf-8")


class SerialBus:
    """Carries the bytes of a page to the servos of a line, and their answers back; they move in real time.

    Attributes:
        line: the servos.
        came: each packet of the page, with its time.
    """

    def __init__(self, line: RecordedLine) -> None:
        self.line = line
        self.came: list[tuple[float, bytes]] = []
        self._port = SimulatedPort(line)
        self._clients: list[ServerConnection] = []
        self._server = serve(self._hear, "127.0.0.1", 0, compression=None)
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    @property
    def script(self) -> str:
        """What runs in the page first."""
        return PORT.replace("ADDRESS", f'"ws://127.0.0.1:{self._server.socket.getsockname()[1]}"')

    def __enter__(self) -> SerialBus:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self.unplug()
        self._thread.join()

    def unplug(self) -> None:
        """Take the adapter out of the machine."""
        for client in self._clients:
            client.close()
        self._clients.clear()

    def _hear(self, client: ServerConnection) -> None:
        self._clients.append(client)
        with suppress(ConnectionClosed):
            for message in client:
                assert isinstance(message, bytes)
                self.came.append((time.monotonic(), message))
                self._port.write(message)
                if answer := self._port.read(self._port.in_waiting):
                    client.send(answer)
