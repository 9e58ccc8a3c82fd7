"""The program's end of a connection, with sockets of the test's own: when it comes back, and when it gives up."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from live_server import wait_for
from websockets.exceptions import ConnectionClosedError
from websockets.frames import Close

import kin
from app.api.live.answers import news, welcome
from app.live.client import Page, connection
from app.live.client.connection import FAILURES, INTERNAL_ERROR, LONGEST_RETRY, RETRY, STEADY, retry_after
from app.shared.answers.answer import as_json

ARM = kin.get_robot("planar2r")
WELCOME = as_json(welcome("K7QF-2M4A", ARM, 120.0)).decode()
PATIENCE = 30.0  # s, for threads on a busy machine
NEWS = as_json(news({"q": np.zeros(2)})).decode()


def closed(code: int) -> ConnectionClosedError:
    """What `websockets` raises where the service has closed with this code."""
    return ConnectionClosedError(Close(code, "Internal error."), None)


class Socket:
    """A connection that says something and is then lost, or stays until it is closed."""

    def __init__(self, said: list[str], lost: Exception | None, before: Callable[[], None] = lambda: None) -> None:
        self._said, self._lost, self._before = list(said), lost, before
        self._over = threading.Event()

    def recv(self, _timeout: float | None = None) -> str:
        if self._said:
            return self._said.pop(0)
        if self._lost is None:
            self._over.wait(PATIENCE)
        self._before()
        raise self._lost or closed(1000)

    def send(self, text: str) -> None:
        assert isinstance(json.loads(text), dict)
        if self._lost is not None and not self._said:
            raise self._lost

    def close(self) -> None:
        self._over.set()


class Service:
    """Opens the connections that it is given, one after the other; the last one again and again."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *sockets: Callable[[], Socket]) -> None:
        self._sockets, self.opened, self.now = sockets, 0, 0.0
        self.pauses: list[int] = []
        monkeypatch.setattr(connection, "connect", self._connect)
        monkeypatch.setattr(connection, "retry_after", self._pause)
        monkeypatch.setattr(connection, "time", SimpleNamespace(monotonic=lambda: self.now, sleep=lambda _: None))

    def _connect(self, *_: Any, **__: Any) -> Socket:
        self.opened += 1
        return self._sockets[min(self.opened, len(self._sockets)) - 1]()

    def _pause(self, tries: int) -> float:
        self.pauses.append(tries)
        return 0.0


def failing() -> Socket:
    return Socket([WELCOME, NEWS], closed(INTERNAL_ERROR))


class Reader:
    """Reads the events of a page until they end; the first connection is lost when it does."""

    def __init__(self) -> None:
        self._reads = threading.Event()

    def first(self) -> Socket:
        """A connection that lasts until somebody reads."""
        return Socket([WELCOME, NEWS], closed(INTERNAL_ERROR), lambda: assert_set(self._reads))

    def ends(self, page: Page) -> bool:
        """Whether the events of the page come to an end."""
        events = page.events()
        reader = threading.Thread(target=lambda: list(events), daemon=True)
        reader.start()
        self._reads.set()
        reader.join(PATIENCE)
        return not reader.is_alive()


def assert_set(event: threading.Event) -> None:
    assert event.wait(PATIENCE)


def test_a_service_that_fails_again_and_again_is_left(monkeypatch):
    reader = Reader()
    service = Service(monkeypatch, reader.first, failing)
    page = Page("http://localhost:8000", "K7QF-2M4A")
    assert reader.ends(page)
    with pytest.raises(kin.KinematicsError, match=r"has ended: the service has failed 6 times in a row .*1011"):
        page.q = ARM.q_home
    assert service.opened == FAILURES
    assert service.pauses == list(range(FAILURES - 1)), "it waits longer each time"
    page.close()


@pytest.mark.parametrize("said", [[], [WELCOME]], ids=["before the welcome", "while the program subscribes"])
def test_a_service_that_fails_at_once_is_left_too(monkeypatch, said):
    reader = Reader()
    service = Service(monkeypatch, reader.first, lambda: Socket(said, closed(INTERNAL_ERROR)))
    page = Page("http://localhost:8000", "K7QF-2M4A")
    assert reader.ends(page)
    with pytest.raises(kin.KinematicsError, match="has failed 6 times in a row"):
        _ = page.robot
    assert service.opened == FAILURES
    page.close()


def test_those_who_wait_are_woken_at_the_end(monkeypatch):
    Service(monkeypatch, failing)
    heard: list[dict[str, Any]] = []
    line = connection.Connection("localhost:8000", "K7QF-2M4A", "", None, heard.append, list, lambda _: None)
    wait_for(lambda: bool(line.ended) and heard[-1] == {"type": "end", "reason": line.ended})
    assert [message["type"] for message in heard].count("disconnected") == FAILURES
    line.close()


def test_a_request_that_waits_hears_that_there_will_be_no_answer(monkeypatch):
    asked = threading.Event()

    class Asked(Socket):
        """Lost when it has been asked for something."""

        def send(self, text: str) -> None:
            if "play" in json.loads(text):
                asked.set()

    Service(
        monkeypatch,
        lambda: Asked([WELCOME, NEWS], closed(INTERNAL_ERROR), lambda: assert_set(asked)),
        failing,
    )
    page = Page("http://localhost:8000", "K7QF-2M4A")
    with pytest.raises(kin.KinematicsError, match="has failed 6 times in a row"):
        page.stop()
    page.close()


def test_failures_with_steady_connections_between_them_are_no_row(monkeypatch):
    def steady() -> Socket:
        def pass_time() -> None:
            service.now += STEADY

        return Socket([WELCOME, NEWS], closed(INTERNAL_ERROR), pass_time)

    service = Service(monkeypatch, *[steady] * (3 * FAILURES), lambda: Socket([WELCOME, NEWS], None))
    page = Page("http://localhost:8000", "K7QF-2M4A")
    wait_for(lambda: service.opened > 3 * FAILURES and page.connected)
    assert set(service.pauses) == {0}, "after a steady connection it comes back at once"
    page.close()


def test_a_network_that_fails_is_tried_for_as_long_as_it_takes(monkeypatch):
    def torn() -> Socket:
        return Socket([WELCOME, NEWS], ConnectionResetError("the network is down"))

    service = Service(monkeypatch, *[torn] * (3 * FAILURES), lambda: Socket([WELCOME, NEWS], None))
    page = Page("http://localhost:8000", "K7QF-2M4A")
    wait_for(lambda: service.opened > 3 * FAILURES and page.connected)
    assert service.pauses == list(range(3 * FAILURES)), "more and more slowly"
    page.close()


def test_it_comes_back_at_once_then_more_slowly():
    waits = [retry_after(k) for k in range(8)]
    assert waits[:4] == pytest.approx([0.0, RETRY, 2 * RETRY, 4 * RETRY])
    assert waits == sorted(waits)
    assert retry_after(10_000) == LONGEST_RETRY
