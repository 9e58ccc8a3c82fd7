"""A line between a browser and the service that can be cut: connections stay, and nothing comes through."""

from __future__ import annotations

import contextlib
import selectors
import socket
import threading
from urllib.parse import urlsplit


class Line:
    """Passes bytes between a port of its own and the service; `address` is where the browser goes."""

    def __init__(self, address: str) -> None:
        found = urlsplit(address)
        self._service = found.hostname or "127.0.0.1", found.port or 80
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{self._listener.getsockname()[1]}/"
        self._up, self._ended = threading.Event(), threading.Event()
        self._up.set()
        self._sockets: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        """From now on nothing arrives, in either direction."""
        self._up.clear()

    def mend(self, anew: bool = False) -> None:
        """What was sent meanwhile arrives; `anew`: the connections of before are broken instead."""
        if anew:
            for each in self._sockets:
                with contextlib.suppress(OSError):
                    each.shutdown(socket.SHUT_RDWR)
            self._sockets.clear()
        self._up.set()

    def close(self) -> None:
        """Break all connections, and accept no more."""
        self._ended.set()
        self._listener.close()
        self.mend(anew=True)

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                near, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(near,), daemon=True).start()

    def _serve(self, near: socket.socket) -> None:
        self._up.wait()
        with near, contextlib.suppress(OSError), socket.create_connection(self._service) as far:
            self._sockets += near, far
            with selectors.DefaultSelector() as ready:
                ready.register(near, selectors.EVENT_READ, far)
                ready.register(far, selectors.EVENT_READ, near)
                while not self._ended.is_set():
                    for key, _ in ready.select(1.0):
                        assert isinstance(key.fileobj, socket.socket)
                        data = key.fileobj.recv(65536)
                        self._up.wait()  # what has been read waits with the rest
                        if not data:
                            return
                        key.data.sendall(data)
