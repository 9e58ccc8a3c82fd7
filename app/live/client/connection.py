"""The connection of a program to its page: two threads, one that sends and one that receives and comes back.

What streams, as configurations do, waits in one message: the newest value of each field counts, so that a fast
program is never ahead of the network. Other messages wait in order, and are answered. After a lost connection the
program comes back by itself, with the word by which the page knows it: at once, and more slowly each time that the
new connection does not last either. It gives up where the service says again and again that it has failed.
"""

from __future__ import annotations

import json
import math
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, Final
from urllib.parse import quote, urlsplit

from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
from websockets.sync.client import ClientConnection, connect

from kin import KinematicsError

PACE: Final = 0.01  # s between two messages; the service reads 120 a second
MOST_BYTES: Final = 64 * 1024  # of a message
RETRY, LONGEST_RETRY = 0.2, 5.0  # s between two tries to come back, first and at most
STEADY: Final = 30.0  # s that a connection lasts which is not one more failure
FAILURES: Final = 6  # of the service without a steady connection between them, after which the program gives up
INTERNAL_ERROR: Final = 1011  # with which the service closes a connection when it has failed
OPENING: Final = 10.0  # s for a connection
CLOSING: Final = 2.0  # s for the end of the threads
LOCAL: Final = ("localhost", "127.0.0.1", "::1")

Message = dict[str, Any]


class RefusedError(KinematicsError):
    """The page has refused something; nothing has changed.

    Attributes:
        problem: the document, as REST has it: `status`, `detail`, `hint`, and `errors` with field, value and what
            would be valid.
    """

    def __init__(self, problem: Mapping[str, Any]) -> None:
        self.problem = dict(problem)
        super().__init__(f"{problem['detail']} {problem['hint']}".strip())


class Connection:
    """See the module. All methods are thread-safe.

    Args:
        address: of the service, as in a browser.
        code: of the page.
        name: of the program, which the page shows.
        token: access token of the service.
        heard: called with each message, by the thread that receives.
        again: what is sent after each connection, in order.
        sent: called with each message that was sent.

    Raises:
        KinematicsError: no connection, or the page has refused it.
    """

    def __init__(
        self,
        address: str,
        code: str,
        name: str,
        token: str | None,
        heard: Callable[[Message], None],
        again: Callable[[], list[Message]],
        sent: Callable[[Message], None],
    ) -> None:
        self._uri, self._options = where(address, code, name, token)
        self._heard, self._again, self._sent = heard, again, sent
        self._lock = threading.Condition()
        self._outbox: list[Message] = []
        self._streams: Message | None = None  # the last of the outbox, if it still takes newer values
        self._answers: dict[int, Future[None]] = {}
        self._number = 0
        self._socket: ClientConnection | None = None
        self._opened = -math.inf  # when the connection was opened
        self._lost = 0  # connections since the last steady one
        self._failed = 0  # how often the service has failed since then
        self.ended = ""  # why it has ended for good
        self._open()
        self._threads = [
            threading.Thread(target=work, name=f"kinboard-{kind}", daemon=True)
            for kind, work in (("receive", self._receive), ("send", self._send))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def connected(self) -> bool:
        """Whether there is a connection now."""
        return self._socket is not None

    # Sending

    def stream(self, **fields: Any) -> int:
        """Send fields of which only the newest value counts; returns the number that its answer will have."""
        with self._lock:
            self._check()
            if self._streams is None:
                self._streams = {}
                self._outbox.append(self._streams)
            self._number += 1
            self._streams.update(fields, id=self._number)
            self._lock.notify_all()
            return self._number

    def request(self, timeout: float, **fields: Any) -> None:
        """Send a message and wait until the page has done it; raises `RefusedError`, or `KinematicsError`."""
        answer: Future[None] = Future()
        with self._lock:
            self._check()
            self._number += 1
            number = self._number
            message = {**fields, "id": number}
            if (size := len(json.dumps(message).encode())) > MOST_BYTES:
                names = ", ".join(fields)
                raise KinematicsError(f"{names}: got {size} bytes, expected at most {MOST_BYTES} in a message")
            self._answers[number] = answer
            self._outbox.append(message)
            self._streams = None
            self._lock.notify_all()
        try:
            answer.result(timeout)
        except TimeoutError:
            raise KinematicsError(f"the page has not answered within {timeout:g} s") from None
        finally:
            with self._lock:
                self._answers.pop(number, None)

    def _check(self) -> None:
        if self.ended:
            raise KinematicsError(f"the connection to the page has ended: {self.ended}")

    def _send(self) -> None:
        while True:
            with self._lock:
                self._lock.wait_for(lambda: bool(self.ended) or (self._socket is not None and bool(self._outbox)))
                if self.ended:
                    return
                message, socket = self._outbox[0], self._socket
                streams = message is self._streams
                if streams:
                    self._streams = None
            assert socket is not None
            lost = False
            try:
                socket.send(json.dumps(message))
            except (ConnectionClosed, OSError):
                lost = True
            else:
                self._sent(message)
            with self._lock:
                if not lost or streams:  # what was asked is asked again, what streams is newer by then
                    self._outbox.pop(0)
            time.sleep(PACE)

    # Receiving

    def _receive(self) -> None:
        while not self.ended:
            socket = self._socket
            if socket is None:
                self._come_back()
                continue
            try:
                self._take(json.loads(socket.recv()))
            except (ConnectionClosed, OSError, EOFError) as error:
                self._lose(socket, error)

    def _take(self, message: Message) -> None:
        number = message.get("id")
        with self._lock:
            answer = self._answers.get(number) if isinstance(number, int) else None
        if message["type"] == "end":
            self.end(message["reason"])
        self._heard(message | {"asked": answer is not None})
        if answer is not None and not answer.done():
            if message["type"] == "problem":
                answer.set_exception(RefusedError(message["problem"]))
            elif message["type"] == "done":
                answer.set_result(None)

    def _lose(self, socket: ClientConnection, error: Exception) -> None:
        with self._lock:
            self._socket = None
        socket.close()
        if time.monotonic() - self._opened >= STEADY:
            self._lost = self._failed = 0
        self._lost += 1
        self._count(error)
        if not self.ended:
            self._heard({"type": "disconnected"})

    def _count(self, error: Exception) -> None:
        """Count what has ended a connection, if it is an error of the service."""
        if isinstance(error, ConnectionClosed) and error.rcvd is not None and error.rcvd.code == INTERNAL_ERROR:
            self._failed += 1

    def _come_back(self) -> None:
        tries = self._lost - 1
        while not self.ended:
            if self._failed >= FAILURES:
                self._give_up(
                    f"the service has failed {self._failed} times in a row (internal error, {INTERNAL_ERROR}). "
                    "Its log says why; connect again when that is mended"
                )
                return
            with self._lock:
                self._lock.wait_for(lambda: bool(self.ended), retry_after(tries))
            if self.ended:
                return
            tries += 1
            try:
                self._open()
            except RefusedError as error:
                self._give_up(str(error))
            except KinematicsError:
                continue
            else:
                return

    def _give_up(self, why: str) -> None:
        """End the connection, and let those know who wait for something to happen in the page."""
        self.end(why)
        self._heard({"type": "end", "reason": why})

    def _open(self) -> None:
        try:
            socket = connect(self._uri, **self._options)
            first = json.loads(socket.recv(OPENING))
        except InvalidStatus as error:
            status = error.response.status_code
            why = "it needs an access token (token=…), or does not allow this" if status == 403 else "see its log"
            raise RefusedError(
                {"status": status, "detail": f"The service refused the connection with {status}.", "hint": why}
            ) from None
        except (OSError, WebSocketException, TimeoutError, EOFError) as error:
            self._count(error)
            place = urlsplit(self._uri).netloc
            raise KinematicsError(f"no connection to {place}: {error or type(error).__name__}") from None
        if first["type"] == "problem":
            socket.close()
            raise RefusedError(first["problem"])
        self._heard(first)
        with suppress(ConnectionClosed, OSError):  # the thread that receives finds it lost
            for message in self._again():
                socket.send(json.dumps(message))
                self._sent(message)
        with self._lock:
            self._socket, self._opened = socket, time.monotonic()
            self._lock.notify_all()

    # The end

    def end(self, why: str) -> None:
        """End the connection; does not wait."""
        with self._lock:
            self.ended = self.ended or why
            answers, self._answers = list(self._answers.values()), {}
            self._lock.notify_all()
        for answer in answers:
            if not answer.done():
                answer.set_exception(KinematicsError(f"the connection to the page has ended: {why}"))

    def close(self) -> None:
        """Send what waits, end the connection, and wait for the threads."""
        deadline = time.monotonic() + CLOSING
        while self._outbox and self.connected and not self.ended and time.monotonic() < deadline:
            time.sleep(PACE)
        self.end("the program has closed it")
        if (socket := self._socket) is not None:
            socket.close()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(CLOSING)


def retry_after(tries: int) -> float:
    """Seconds to wait before coming back, after so many connections or tries that have failed before the last."""
    return 0.0 if tries <= 0 else min(RETRY * 2.0 ** min(tries - 1, 30), LONGEST_RETRY)


def where(address: str, code: str, name: str, token: str | None) -> tuple[str, dict[str, Any]]:
    """The address of the websocket, and the options of the connection."""
    parts = urlsplit(address if "://" in address else f"http://{address}")
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise KinematicsError(f"address: got {address!r}, expected the service's, such as http://localhost:8000")
    scheme = "wss" if parts.scheme == "https" else "ws"
    path = f"{parts.path.split('/viewer')[0].rstrip('/')}/api/v1/live/{quote(code.strip(), safe='')}"
    query = f"name={quote(name)}&session={secrets.token_urlsafe(12)}"
    options: dict[str, Any] = {"max_size": None, "open_timeout": OPENING, "close_timeout": CLOSING}
    if token is not None:
        options["additional_headers"] = {"Authorization": f"Bearer {token}"}
    if parts.hostname in LOCAL:
        options["proxy"] = None
    return f"{scheme}://{parts.netloc}{path}?{query}", options
