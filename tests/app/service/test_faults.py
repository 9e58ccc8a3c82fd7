"""Faults around the service: a stop during a response, workers that fail, broken files, full disks."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import numpy as np
import pytest
import viser
from fake_browser import FakeBrowser
from live_server import serve_viewer, wait_for
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

import app.viewer.panel.layout
import kin
from app.cli.parser import main
from app.service.main import run
from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.page.controller import ArmController
from app.viewer.server import RESTARTS, ViewerServer

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[3]
ARM = kin.get_robot("pioneer5")
FAR = {"position": [5.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}  # takes the Panda some tenths of a second each


# -- SIGTERM ---------------------------------------------------------------------------------------------------


@contextmanager
def service(ready: bool = True, **environment: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_PORT": "0"} | environment
    with subprocess.Popen(
        [sys.executable, "-m", "app.cli", "serve"],
        cwd=ROOT,
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found
            base = f"127.0.0.1:{found[1]}"
            if ready:
                wait_for(lambda: httpx2.get(f"http://{base}/readyz", trust_env=False).status_code == 200, 120)
            yield process, base
        finally:
            process.kill()


class Asking(threading.Thread):
    """A request in progress."""

    def __init__(self, base: str, robot: str, what: str, body: object) -> None:
        super().__init__()
        self.url = f"http://{base}/api/v1/robots/{robot}/{what}"
        self.body = body
        self.answer: httpx2.Response | None = None
        self.error: Exception | None = None
        self.start()

    def run(self) -> None:
        try:
            method = "GET" if self.body is None else "POST"
            self.answer = httpx2.request(method, self.url, json=self.body, timeout=60, trust_env=False)
        except httpx2.HTTPError as error:
            self.error = error


def stopped(process: subprocess.Popen[str], within: float) -> str:
    """The error output of the process, which must end in time."""
    began = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=60)
    assert time.monotonic() - began < within
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    return errors


def test_a_stop_completes_answers_in_progress_and_notifies_visitors():
    with service(KINBOARD_DRAIN="30", KINBOARD_WORKER_TIMEOUT="2") as (process, base):  # which ends with the loop
        asking = Asking(base, "panda", "ik", {"target": [FAR] * 600, "max_solutions": 1})
        with connect(f"ws://{base}/viewer", subprotocols=[f"viser-v{viser.__version__}"], proxy=None) as visitor:
            assert visitor.recv(timeout=20)
            time.sleep(0.3)
            assert asking.is_alive()
            stopped(process, 33.0)
            with pytest.raises(ConnectionClosed) as closed:
                read_to_the_end(visitor)
        asking.join(5)
    assert asking.answer is not None, asking.error
    assert len(asking.answer.json()["results"]) == 600
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code in (1001, 1012)


@pytest.mark.slow
def test_a_stop_under_load_is_in_time():
    """Next to four processes for each processor, as Docker stops a service that has just started."""
    spin = "import time; end = time.monotonic() + 120\nwhile time.monotonic() < end: pass"
    with contextlib.ExitStack() as stack:
        for _ in range(4 * (os.cpu_count() or 2)):
            spinning = stack.enter_context(subprocess.Popen([sys.executable, "-c", spin]))
            stack.callback(spinning.kill)
        for k in range(3):
            process, _ = stack.enter_context(service(False))
            time.sleep(2.0 + 2.0 * k)
            stopped(process, 10.0)


def started_and_stopped(code: str) -> str:
    """Run a program that starts a service, and stop it once it serves: what it has written to stderr."""
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found
            answer = httpx2.get(f"http://127.0.0.1:{found[1]}/livez", timeout=60, trust_env=False)
            assert answer.status_code == 200
            return stopped(process, 20.0)
        finally:
            process.kill()


def test_a_service_that_cannot_stop_ends_all_the_same():
    """A thread of an executor, for which Python would wait."""
    code = (
        "import sys, time, concurrent.futures as f; from app.service.main import run; "
        "from app.shared.settings import Settings; "
        "pool = f.ThreadPoolExecutor(1); pool.submit(time.sleep, 300); run(Settings(port=0, compute=0))"
    )
    assert started_and_stopped(code) == ""


def test_a_shutdown_that_hangs_is_cut_off_after_the_time_limit():
    code = (
        "import time; from app.service import main, server, startup; from app.shared.settings import Settings; "
        "server.STOP_TIMEOUT = 0.5; startup.Startup.stop = lambda self: time.sleep(300); "
        "main.run(Settings(port=0, drain=1))"
    )
    assert "did not stop within 1.5 s of the signal" in started_and_stopped(code)


def test_a_stop_abandons_long_computations_in_time():
    """A batch, a cloud as a file and over a websocket, and a summary, each of which would take minutes."""
    with service(KINBOARD_DRAIN="4") as (process, base):
        asking = Asking(base, "panda", "ik", {"target": [FAR] * 5000})
        waiting = Asking(base, "panda", "workspace/summary?effort=16", None)
        where = f"{base}/api/v1/robots/panda/workspace"
        with (
            httpx2.stream("GET", f"http://{where}?n=50000000", timeout=60, trust_env=False) as cloud,
            connect(f"ws://{where}/stream?n=50000000", proxy=None) as visitor,
        ):
            taken = cloud.iter_raw()
            assert next(taken)
            assert visitor.recv(timeout=20)
            reading = threading.Thread(target=lambda: drained(taken))
            reading.start()
            stopped(process, 20.0)  # all of it would take minutes
            reading.join(10)
            assert not reading.is_alive()
            with pytest.raises(ConnectionClosed):
                read_to_the_end(visitor)
        asking.join(10)
        waiting.join(10)
    for each in (asking, waiting):
        assert each.answer is not None, each.error
        assert each.answer.status_code == 503
        assert each.answer.json()["type"] == "urn:kinboard:problem:busy"
        assert int(each.answer.headers["retry-after"]) > 0


def read_to_the_end(visitor: ClientConnection) -> None:
    while True:
        visitor.recv(timeout=5)


def drained(pieces: Iterator[bytes]) -> None:
    with pytest.raises(httpx2.HTTPError):  # cut off, and seen to be
        for _ in pieces:
            pass


# -- a visitor's worker ----------------------------------------------------------------------------------------


def test_a_worker_that_dies_is_replaced_and_the_visitor_informed(port, monkeypatch, caplog):
    draw = ArmController.draw
    deaths: list[str] = []

    def dies(self: ArmController, fresh: bool) -> None:
        if fresh and not deaths:
            deaths.append(threading.current_thread().name)
            raise SystemExit  # the guard catches only exceptions
        draw(self, fresh)

    with FakeBrowser(port) as tab:
        tab.settle()
        arm = tab.gizmo
        monkeypatch.setattr(ArmController, "draw", dies)
        tab.set("1 rotating base", 10.0)
        tab.wait(lambda: "Page restarted" in tab.html)
        tab.settle()
        assert tab.gizmo != arm
        assert np.allclose(tab.tool_pose(), kin.fk(ARM, ARM.q_home), atol=1e-6)
        tab.set("1 rotating base", 20.0)
        tab.wait(lambda: 'data-status="hand"' in tab.html)
        assert tab.value("1 rotating base") == 20.0
    assert len(deaths) == 1
    assert "a visitor's worker failed" in caplog.text


def test_a_visitor_who_leaves_while_the_page_restarts_leaves_no_page_behind(monkeypatch):
    viewer = ViewerServer(Store(), Settings(), Clouds())
    draw, reset = ArmController.draw, viser.GuiApi.reset
    restarts, gone = threading.Event(), threading.Event()

    def dies(self: ArmController, fresh: bool) -> None:
        if fresh:
            raise SystemExit
        draw(self, fresh)

    def slow(gui: viser.GuiApi) -> None:
        restarts.set()
        gone.wait(10)
        reset(gui)

    with serve_viewer(viewer) as port:
        with FakeBrowser(port) as tab:
            tab.settle()
            (page,) = viewer.pages.values()
            monkeypatch.setattr(ArmController, "draw", dies)
            monkeypatch.setattr(viser.GuiApi, "reset", slow)
            tab.set("1 rotating base", 10.0)
            assert restarts.wait(10)
        wait_for(lambda: not viewer._connections.visitors)
        gone.set()
        assert page.join(10)
        assert viewer.visitors == 0


def test_a_worker_that_never_starts_is_not_replaced_forever(port, monkeypatch, caplog):
    with FakeBrowser(port) as tab:
        tab.settle()
        monkeypatch.setattr(ArmController, "draw", lambda *_, **__: sys.exit())
        monkeypatch.setattr(app.viewer.panel.layout, "StatusLine", lambda *_: 1 / 0)
        tab.set("1 rotating base", 10.0)
        # Each new worker asks the page for its stored state, so the page must answer.
        wait_for(lambda: tab.read(0.01) is None or "is not started again" in caplog.text)
    assert caplog.text.count("ZeroDivisionError: division by zero") == RESTARTS


# -- files -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x00\xff\xfe", "UTF-8"),
        (b"id = ", "valid TOML"),
        (b"[" * 100_000, "at most 20000 values"),
        (b'id = "x"', "odd.toml"),
        (b"", "odd.toml"),
    ],
)
def test_a_corrupt_robot_file_ends_the_start_with_a_message(content, message, tmp_path, capfd):
    (tmp_path / "odd.toml").write_bytes(content)
    assert run(Settings(port=0, robots=tmp_path)) == 1
    error = capfd.readouterr().err
    assert message in error
    assert "odd.toml" in error
    assert "Traceback" not in error


def test_a_folder_of_robots_that_cannot_be_read_ends_the_start_with_a_message(tmp_path, capfd, monkeypatch):
    def refuses(self: Path) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "iterdir", refuses)  # root may read everything
    assert run(Settings(port=0, robots=tmp_path)) == 1
    assert "Permission denied" in capfd.readouterr().err


def test_a_full_disk_is_reported(capsys):
    assert main(["workspace", "pioneer5", "-n", "100000", "-o", "/dev/full", "--format", "csv"]) == 2
    assert "No space left on device" in capsys.readouterr().err


def test_a_file_that_does_not_fit_is_removed(tmp_path, capsys):
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        assert main(["workspace", "pioneer5", "-n", "100000", "-o", str(tmp_path / "cloud.csv")]) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert "File too large" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
