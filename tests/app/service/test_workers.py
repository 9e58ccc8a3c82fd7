"""Several processes on one port, started as a user starts them."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import httpx2
import pytest
from fake_browser import FakeBrowser
from live_server import wait_for
from worker_processes import fails, fails_later, ignores, is_broken_once, stops_once

from app.service.main import run
from app.service.workers import supervise
from app.shared.settings import Settings

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[3]


OWN_ARM = (ROOT / "kin" / "robots" / "ur5.toml").read_text("utf-8").replace('id = "ur5"', 'id = "own"')


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The operator's robot files."""
    folder = tmp_path_factory.mktemp("robots")
    (folder / "own.toml").write_text(OWN_ARM, "utf-8")
    return folder


@pytest.fixture(scope="module")
def service(folder: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    with started(folder) as running:
        yield running


@contextmanager
def started(folder: Path, **environment: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    command = [sys.executable, "-m", "app.cli", "serve", "--workers", "2", "--port", "0"]
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_ROBOTS": str(folder)} | environment
    with subprocess.Popen(
        command, cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found
            port = int(found[1])
            wait_for(lambda: len(ready(port)) == 2, 120)
            yield process, port
        finally:
            process.kill()


def ask(port: int, path: str) -> httpx2.Response:
    """Each time over a new connection, so that either process may answer."""
    # No certificates: reading them takes longer than an answer.
    return httpx2.get(f"http://127.0.0.1:{port}{path}", trust_env=False, timeout=20, verify=False)


def pids(port: int) -> list[int]:
    return [ask(port, "/livez").json()["pid"] for _ in range(40)]


def ready(port: int) -> set[int]:
    """The processes that are ready, each requested over one persistent connection."""
    found = set()
    for _ in range(16):
        url = f"http://127.0.0.1:{port}"
        with httpx2.Client(base_url=url, trust_env=False, timeout=20, verify=False) as kept:
            if kept.get("/readyz").status_code == 200:
                found.add(kept.get("/livez").json()["pid"])
    return found


def test_both_processes_answer_and_share_the_requests(service):
    answers = pids(service[1])
    assert len(set(answers)) == 2
    assert min(answers.count(pid) for pid in set(answers)) >= 5


def test_a_visitor_stays_with_the_process_that_took_the_connection(service):
    port = service[1]
    tabs = [FakeBrowser(port, path="/viewer") for _ in range(4)]
    try:
        for k, tab in enumerate(tabs):
            with tab:
                tab.settle()
                tab.set("1 rotating base", 10.0 + k)
                tab.settle()
                assert tab.value("1 rotating base") == 10.0 + k
                assert 'data-status="hand"' in tab.html
    finally:
        for tab in tabs:
            tab.close()


def test_counters_are_summed_over_all_processes(service):
    port = service[1]

    def counted() -> float:
        found = re.search(
            r'requests_total\{method="GET",route="/livez",status="200"\} (\S+)', ask(port, "/metrics").text
        )
        return float(found[1]) if found else 0.0

    before = counted()
    assert len(set(pids(port))) == 2
    wait_for(lambda: counted() >= before + 40)  # a request is counted when its answer has left
    assert counted() == before + 40


def test_a_process_that_dies_is_replaced_by_one_that_offers_the_same(service, folder):
    """The robot files are read once: a restart in the middle of an edit must not change or end the service."""
    port = service[1]
    tabs = [FakeBrowser(port, path="/viewer") for _ in range(4)]
    victim, other = sorted(set(pids(port)))
    wait_for(lambda: counted_visitors(port) == 4)
    (folder / "own.toml").unlink()
    (folder / "broken.toml").write_text("id = ")
    os.kill(victim, signal.SIGKILL)
    wait_for(lambda: len(now := ready(port)) == 2 and victim not in now, 120)
    assert other in pids(port)
    assert [ask(port, "/api/v1/robots/own").status_code for _ in range(20)] == 20 * [200]
    for tab in tabs:
        tab.close()
    wait_for(lambda: counted_visitors(port) == 0)


def counted_visitors(port: int) -> float:
    (count,) = re.findall(r"^kinboard_visitors (\S+)", ask(port, "/metrics").text, re.MULTILINE)
    return float(count)


@pytest.mark.slow
def test_a_stopped_process_is_replaced(folder):
    with started(folder, KINBOARD_WORKER_TIMEOUT="10") as (process, port):
        victim, other = sorted(ready(port))
        os.kill(victim, signal.SIGSTOP)
        wait_for(lambda: not Path(f"/proc/{victim}").exists(), 60)
        wait_for(lambda: len(ready(port)) == 2, 120)
        assert other in pids(port)
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert f"worker {victim} has not answered for 10.0 s and is killed" in errors


def test_one_signal_stops_all_processes(service):
    process, port = service
    children = set(pids(port))
    with FakeBrowser(port, path="/viewer"):
        began = time.monotonic()
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    assert time.monotonic() - began < 15.0
    assert "Traceback" not in errors
    for pid in children:
        assert not Path(f"/proc/{pid}").exists()


def test_a_process_that_fails_at_once_is_not_restarted_forever():
    assert supervise(fails, [1, 2], 1.0, 30.0) == 1


def test_a_process_without_a_sign_of_life_is_replaced(tmp_path, caplog):
    ended: list[tuple[str, int]] = []
    noted = tmp_path / "pids"
    on_end = lambda part, pid: ended.append((part, pid))  # noqa: E731
    assert supervise(partial(stops_once, noted), ["part"], 5.0, 1.0, on_end=on_end) == 0
    first, second = map(int, noted.read_text().split())
    assert ended == [("part", first)]
    assert first != second
    assert f"worker {first} has not answered for 1.0 s and is killed" in caplog.text


def test_a_process_whose_loop_turns_but_that_answers_with_an_error_is_replaced(tmp_path, caplog):
    noted = tmp_path / "pids"
    assert supervise(partial(is_broken_once, noted), ["part"], 5.0, 2.0) == 0
    first, second = map(int, noted.read_text().split())
    assert first != second
    assert f"worker {first} has not answered for 2.0 s and is killed" in caplog.text


def test_one_that_fails_again_and_again_after_it_has_answered_is_replaced_more_and_more_slowly(tmp_path, caplog):
    noted = tmp_path / "pids"
    assert supervise(partial(fails_later, noted), ["part"], 5.0, 30.0) == 0
    assert len(noted.read_text().split()) == 5
    assert re.findall(r"is restarted (now|in \S+ s)", caplog.text) == ["now", "now", "in 1 s", "in 2 s"]


def test_a_process_that_does_not_stop_is_killed(caplog):
    assert supervise(partial(ignores, 0), ["part"], 0.5, 30.0) == 0
    assert "is killed" in caplog.text


def test_a_port_in_use_is_detected_although_sockets_are_shared(capfd):
    with socket.create_server(("127.0.0.1", 0), reuse_port=True) as taken:
        assert run(Settings(port=taken.getsockname()[1], workers=2)) == 1
    assert "cannot listen on" in capfd.readouterr().err
