"""What a visitor sends reaches the log on one line, without control characters, and once a minute."""

from __future__ import annotations

import asyncio
import gc
import io
import logging
import re
import socket
import sys
import threading
import warnings
from collections.abc import Callable, Iterator

import msgspec
import pytest
from fastapi import FastAPI
from uvicorn.logging import DefaultFormatter
from viser._threadpool_exceptions import print_awaited_callback_error

from app.service.log import FIRST, LAST, LOG_EVERY, LONGEST, LogFormatter, LogHandler, escaped, guard_log
from app.service.server import server_config
from app.shared.settings import Settings
from app.viewer.viser_patches import log_what_viser_prints, messages

FORGED = "\x1b[31m\x07red\r\nworker 12 ended\u2028and\u202eback\x9b1m\ud800"
RAW = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u202e\ud800]")


class Log:
    """What a process writes, and a clock."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.written = io.StringIO()

    @property
    def lines(self) -> list[str]:
        return self.written.getvalue().splitlines()

    def clean(self) -> bool:
        """Whether nothing of `FORGED` is there as it was sent, but something of it is."""
        text = self.written.getvalue()
        return not RAW.search(text) and r"\x1b[31m\x07red\r\nworker 12 ended" in text


@pytest.fixture
def log(monkeypatch) -> Iterator[Log]:
    root, made = logging.getLogger(), Log()
    monkeypatch.setattr(root, "handlers", [])
    monkeypatch.setattr(logging.getLogger("asyncio"), "level", logging.NOTSET)
    for owner, name in ((warnings, "showwarning"), (threading, "excepthook"), (sys, "unraisablehook")):
        monkeypatch.setattr(owner, name, getattr(owner, name))
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        guard_log(lambda: made.now).setStream(made.written)
        yield made


def mismatch(text: str) -> None:
    """A message as a visitor may send it, a text in the place of three numbers, on viser's own way."""
    log_what_viser_prints()
    sent = {"type": "ViewerCameraMessage", "wxyz": (1, 0, 0, 0), "position": text, "image_height": 1}
    sent |= {"image_width": 1, "fov": 1.0, "near": 0.1, "far": 9.0, "look_at": text, "up_direction": (0, 0, 1)}
    messages.Message.deserialize(msgspec.msgpack.encode(sent))


def test_a_client_who_leaves_while_it_is_sent_to_writes_no_line(log):
    ends = socket.socketpair()

    async def send() -> None:
        transport, _ = await asyncio.get_running_loop().create_connection(asyncio.Protocol, sock=ends[0])
        ends[1].close()
        for _ in range(20):  # in one round of the event loop
            transport.write(bytes(1000))
        transport.abort()

    asyncio.run(send())
    assert not log.lines
    logging.getLogger("asyncio").error("an error of its own")
    assert len(log.lines) == 1


def test_what_viser_warns_of_is_one_clean_line_a_minute(log):
    hostile = FORGED.replace("\ud800", "")
    for k in range(200):
        mismatch(f"{hostile}{k}")
    assert len(log.lines) == 1
    assert log.clean()
    assert "UserWarning: [viser] " in log.lines[0]
    log.now += LOG_EVERY
    mismatch(hostile + "x" * 60_000)
    assert len(log.lines) == 2
    assert "… (399 more times since the last)" in log.lines[1]
    assert len(log.lines[1]) < LONGEST + 60


def test_viser_warns_past_blocks_of_other_threads_that_catch_warnings(log):
    with warnings.catch_warnings(record=True) as caught:
        mismatch(FORGED.replace("\ud800", ""))
    assert caught == []
    assert log.clean()


def test_warnings_of_python_are_logged_once_a_minute(log):
    for k in range(3):
        warnings.warn(f"{FORGED}{k}", RuntimeWarning, stacklevel=1)
    assert len(log.lines) == 1
    assert log.clean()
    assert log.lines[0].startswith(f"{__file__}:")
    assert "RuntimeWarning: " in log.lines[0]


def failing(text: str) -> None:
    try:
        try:
            raise ValueError(text)
        except ValueError as error:
            raise RuntimeError(text) from error
    except RuntimeError:
        logging.getLogger("kinboard.some").exception("failed: %s", text)


def test_a_traceback_has_its_lines_and_none_of_a_visitors(log):
    failing(FORGED)
    assert log.clean()
    starts = [line.split()[0] for line in log.lines if line]
    assert "worker" not in starts
    assert starts.count("Traceback") == 2
    assert "ValueError:" in starts
    assert "RuntimeError:" in starts
    assert "The above exception was the direct cause" in log.written.getvalue()
    assert f'File "{__file__}"' in log.written.getvalue()


def test_a_long_traceback_is_cut_in_its_middle(log):
    def down(depth: int) -> None:
        if depth:
            (down, up)[depth % 2](depth - 1)
        else:
            raise ValueError("x" * 9000)

    def up(depth: int) -> None:
        down(depth)

    try:
        down(200)
    except ValueError:
        logging.getLogger("kinboard.some").exception("deep")
    assert len(log.lines) == 1 + FIRST + 1 + LAST
    assert max(map(len, log.lines)) <= LONGEST


@pytest.mark.parametrize("name", ["uvicorn.error", "websockets.server", "kinboard.bridge", "asyncio", "viser"])
def test_loggers_of_all_libraries_go_through_it(log, name):
    server_config(FastAPI(), Settings())  # uvicorn would give its loggers handlers of their own
    for k in range(50):
        logging.getLogger(name).error("refused %s %d", FORGED, k)
    assert len(log.lines) == 1
    assert log.clean()
    assert not any(
        isinstance(handler.formatter, DefaultFormatter)
        for each in ("uvicorn", "uvicorn.error", "uvicorn.access")
        for handler in logging.getLogger(each).handlers
    )


def raise_in_thread() -> None:
    def fail() -> None:
        raise ValueError(FORGED)

    thread = threading.Thread(target=fail, name="kinboard-some")
    thread.start()
    thread.join()


def raise_in_del() -> None:
    class Odd:
        def __del__(self) -> None:
            raise ValueError(FORGED)

    Odd()
    gc.collect()


def raise_in_callback() -> None:
    log_what_viser_prints()
    print_awaited_callback_error(ValueError(FORGED))


def raise_in_task() -> None:
    async def fail() -> None:
        raise ValueError(FORGED)

    async def forget() -> None:
        task = asyncio.get_running_loop().create_task(fail())
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        del task
        gc.collect()

    asyncio.run(forget())


@pytest.mark.parametrize("fail", [raise_in_thread, raise_in_del, raise_in_callback, raise_in_task])
def test_errors_that_python_or_viser_would_print_are_logged(log, capfd, fail: Callable[[], None]):
    guard_log(lambda: log.now).setStream(log.written)  # pytest has set hooks of its own after the fixture
    for _ in range(3):
        fail()
    assert capfd.readouterr().err == ""
    assert log.clean()
    assert sum(line.startswith("ValueError: ") for line in log.lines) == 1


def test_one_place_with_two_errors_is_two_kinds(log):
    def fail(kind: type[Exception]) -> None:
        try:
            raise kind("x")
        except Exception:
            logging.getLogger("kinboard.some").exception("request failed")

    for _ in range(5):
        fail(ValueError)
        fail(KeyError)
    assert [line for line in log.lines if line.startswith("request failed")] == ["request failed"] * 2


def test_kinds_are_counted_for_a_minute_each(log):
    some = logging.getLogger("kinboard.some")

    def note(text: str) -> None:
        some.warning("a %s", text)

    note("1")
    log.now += 0.9 * LOG_EVERY
    note("2")
    some.warning("another place")
    log.now += 0.1 * LOG_EVERY
    note("3")
    log.now += LOG_EVERY
    note("4")
    assert log.lines == ["a 1", "another place", "a 3 (1 more times since the last)", "a 4"]


def test_kinds_of_their_own_pass(log):
    for name in ("x", "y", "x"):
        logging.getLogger("some").warning("file %s", name, extra={"kind": name})
    assert log.lines == ["file x", "file y"]


def test_arguments_that_do_not_fit_are_no_way_around_it(log, capfd):
    handler = LogHandler()  # pytest's own handler would raise
    handler.setStream(log.written)
    handler.handle(logging.LogRecord("some", logging.WARNING, "", 0, "%d bytes", (FORGED,), None))
    assert log.clean()
    assert capfd.readouterr().err == ""


def test_a_stream_that_fails_gets_no_second_copy(log, capfd):
    log.written.close()
    logging.getLogger("some").warning("%s", FORGED)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("text", ["", "plain", "Grüße, 日本語 😀", "a" * LONGEST])
def test_what_can_be_printed_stays(text):
    assert escaped(text) == text
    made = logging.LogRecord("some", logging.WARNING, "", 0, "%s", (text,), None)
    assert LogFormatter().format(made) == text
