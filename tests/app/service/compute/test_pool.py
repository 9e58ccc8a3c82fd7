"""Processes that compute: what they send back, and when a computation ends early."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pool_jobs
import psutil
import pytest
from fastapi.testclient import TestClient
from live_server import wait_for
from starlette.requests import Request

import kin
from app.api.problems import ClientLeftError, ProblemError
from app.api.work import ComputeSlots, Deadline, TooSlowError
from app.service import startup
from app.service.compute import pool as module
from app.service.compute import process
from app.service.compute.pool import Pool
from app.service.main import create_app
from app.shared.memory.answers import AnswerMemory
from app.shared.settings import Settings
from app.shared.store import Store

SETTINGS, STORE = Settings(), Store()


@pytest.fixture(scope="module")
def pool() -> Iterator[Pool]:
    """One process as the service has it."""
    made = Pool(1, SETTINGS, STORE)
    yield made
    made.stop()


@pytest.fixture
def stand_ins(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Pool]]:
    """Makes pools of processes that start at once."""
    made: list[Pool] = []

    def start(_: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-S", "-c", pool_jobs.STAND_IN]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def make(count: int = 1) -> Pool:
        made.append(Pool(count, SETTINGS, STORE))
        return made[-1]

    monkeypatch.setattr(process, "start_process", start)
    monkeypatch.setattr(process, "APART", 0.0)
    yield make
    for each in made:
        each.stop()


def ask(
    pool: Pool,
    answer: Any,
    seconds: float = 60.0,
    memory: AnswerMemory | None = None,
    leave: Callable[[], bool] | None = None,
) -> Any:
    """What a request gets that is computed by the pool; its client leaves as soon as `leave` says so."""

    async def asked() -> Any:
        work = ComputeSlots(1, seconds, memory=memory, pool=pool)
        async with work.slot(Request({"type": "http", "client": ("192.0.2.1", 1)}), process=True) as deadline:

            def look() -> None:
                if leave is not None and leave():
                    deadline.client_left()
                else:
                    asyncio.get_running_loop().call_later(0.01, look)

            asyncio.get_running_loop().call_soon(look)
            return await pool.run(answer, deadline)

    return asyncio.run(asked())


def test_values_and_responses_come_back(pool):
    assert ask(pool, partial(pool_jobs.given, ("a", 1.5, [2]))) == ("a", 1.5, [2])
    for size in (0, 10, 3_000_000):
        memory = AnswerMemory(1 << 30, 1 << 30)
        found = ask(pool, partial(pool_jobs.body, size, 201), memory=memory)
        assert (found.status_code, found.raw_headers) == (201, [(b"x-size", str(size).encode())])
        content = b"".join(found.taken()) if size > 1000 else found.body
        assert (len(content), content.count(b"a")) == (size, size // 2)
        assert memory.held == 0, "what has been sent is not held"


def test_robots_and_settings_are_named_and_others_are_sent(pool):
    robot = kin.get_robot("ur5")
    assert ask(pool, partial(pool_jobs.shared, (STORE.get("ur5"), SETTINGS))) == [True, True]
    other = robot.with_base(kin.pose_from_xyz_rpy([0.1, 0.0, 0.0]))
    assert ask(pool, partial(pool_jobs.shared, (other, Settings()))) == [False, False]
    assert ask(pool, partial(pool_jobs.given, (other,))) == (other,)
    assert len(pool.message(partial(pool_jobs.given, (STORE.get("ur5"), SETTINGS)), 1.0)) < 300


@pytest.mark.parametrize(
    ("kind", "arguments", "headers", "status", "said"),
    [
        (ProblemError, (413, "batch-too-large", "Too many."), {"X-Of": "it"}, 413, "Too many."),
        (kin.InputError, ("q", 3, "a list"), None, 422, "q: got 3, expected a list"),
        (kin.UnknownRobotError, ("r2d2", ("ur5",)), None, 404, "r2d2"),
    ],
)
def test_a_mistake_of_a_client_is_the_problem_that_it_would_be_here(pool, kind, arguments, headers, status, said):
    named = {} if headers is None else {"headers": headers}
    with pytest.raises(ProblemError) as raised:
        ask(pool, partial(pool_jobs.fails, kind, arguments, named))
    assert raised.value.problem.status == status
    assert said in raised.value.problem.detail
    assert raised.value.headers == headers


def test_any_other_error_says_where_it_was_raised(pool):
    with pytest.raises(ZeroDivisionError) as raised:
        ask(pool, partial(pool_jobs.fails, ZeroDivisionError, ("division by zero",), {}))
    assert "pool_jobs.py" in raised.value.__notes__[0]
    with pytest.raises(RuntimeError, match="a fault of the core") as plain:
        ask(pool, pool_jobs.fails_strangely)
    assert "StrangeError" in plain.value.__notes__[0]


def test_a_computation_ends_when_its_client_leaves_or_its_time_is_over_and_the_process_stays(pool):
    before = ask(pool, pool_jobs.pid)
    with pytest.raises(ClientLeftError):
        ask(pool, pool_jobs.goes_on, leave=lambda: pool.processes[0].job is not None)
    with pytest.raises(TooSlowError):
        ask(pool, pool_jobs.goes_on, seconds=0.05)
    assert ask(pool, pool_jobs.pid) == before


def test_an_answer_for_which_there_is_no_memory_is_refused_and_the_next_one_is_answered(pool):
    memory = AnswerMemory(1_000_000, 1_000_000)
    held = memory.reserve(900_000)
    with pytest.raises(ProblemError, match="take all memory"):
        ask(pool, partial(pool_jobs.body, 500_000, 200), memory=memory)
    held.release()
    assert ask(pool, partial(pool_jobs.body, 500_000, 200), memory=memory).size == 500_000


def test_one_that_goes_on_for_a_client_that_has_left_is_killed(stand_ins, tmp_path, caplog):
    pool, begun = stand_ins(), tmp_path / "begun"
    before = ask(pool, pool_jobs.pid)
    with pytest.raises(ClientLeftError):
        ask(pool, partial(pool_jobs.begins_and_hangs, str(begun)), leave=begun.exists)
    assert ask(pool, pool_jobs.pid) != before
    assert caplog.text == "", "nothing is wrong with it"


@pytest.mark.parametrize("started", [True, False], ids=["meanwhile", "before it begins"])
def test_one_whose_time_is_over_is_killed(stand_ins, monkeypatch, started):
    monkeypatch.setattr(module, "LATE", 0.05)
    pool = stand_ins()
    if started:
        ask(pool, pool_jobs.pid)
    else:
        start = process.start_process
        monkeypatch.setattr(process, "start_process", lambda program: time.sleep(0.3) or start(program))
    with pytest.raises(TooSlowError):
        ask(pool, pool_jobs.hangs, seconds=0.05)
    assert ask(pool, pool_jobs.pid)


def test_a_client_that_leaves_while_its_process_is_started_is_forgotten(stand_ins, monkeypatch):
    start = process.start_process
    monkeypatch.setattr(process, "start_process", lambda program: time.sleep(0.1) or start(program))
    pool = stand_ins()
    with pytest.raises(ClientLeftError):
        ask(pool, pool_jobs.hangs, leave=lambda: True)
    assert ask(pool, pool_jobs.pid) == pool.processes[0].pid, "the process was not killed"


def test_what_one_has_found_that_ends_late_is_not_lost(stand_ins):
    assert ask(stand_ins(), pool_jobs.is_late, seconds=0.02) == "found"


def test_a_process_that_ends_loses_one_request(stand_ins, caplog):
    pool = stand_ins(2)

    async def both() -> list[Any]:
        work = ComputeSlots(1, 60.0, pool=pool)
        deadlines = [Deadline(work), Deadline(work)]
        jobs = (pool_jobs.ends, pool_jobs.pid)
        runs = (pool.run(job, deadline) for job, deadline in zip(jobs, deadlines, strict=True))
        return await asyncio.gather(*runs, return_exceptions=True)

    lost, other = asyncio.run(both())
    assert isinstance(lost, ProblemError)
    assert (lost.problem.status, lost.problem.detail) == (503, "The process that computed this answer has ended.")
    assert isinstance(other, int)
    assert {type(ask(pool, pool_jobs.pid)) for _ in range(4)} == {int}
    assert f"has ended with code -{int(signal.SIGABRT)}" in caplog.text


def test_a_process_that_was_killed_while_idle_costs_nothing(stand_ins):
    pool = stand_ins()
    before = ask(pool, pool_jobs.pid)
    os.kill(before, signal.SIGKILL)
    running = pool.processes[0].child
    assert running is not None
    running.wait()
    assert ask(pool, pool_jobs.pid) != before


@pytest.mark.parametrize("after", [0.0, 0.1], ids=["before it begins", "meanwhile"])
def test_a_stop_of_the_service_ends_what_is_computed(pool, after):
    async def stopped() -> None:
        work = ComputeSlots(1, 60.0, pool=pool)
        running = asyncio.ensure_future(pool.run(pool_jobs.goes_on, Deadline(work)))
        await asyncio.sleep(after)
        work.close()
        await running

    with pytest.raises(ProblemError, match="being stopped"):
        asyncio.run(stopped())


def test_each_process_is_waited_for_and_one_that_does_not_start_is_an_error(stand_ins, monkeypatch):
    pool = stand_ins(2)
    pool.wait()
    assert all(each.pid for each in pool.processes)
    monkeypatch.setattr(pool_jobs, "STAND_IN", "raise SystemExit(1)")
    with pytest.raises(module.LostError):
        stand_ins().wait()


def test_one_that_hangs_while_it_loads_is_killed_and_the_service_is_ready_with_another(
    stand_ins, monkeypatch, caplog
):
    works = pool_jobs.STAND_IN
    monkeypatch.setattr(pool_jobs, "STAND_IN", "import time; time.sleep(60)")
    monkeypatch.setattr(process, "LOADING", 0.3)
    monkeypatch.setattr(startup, "AGAIN", 0.1)
    with TestClient(create_app(SETTINGS, STORE, pool=stand_ins())) as client:
        wait_for(lambda: client.get("/readyz").json()["status"] == "failed", 60)
        assert "has not loaded the core within 0.3 s, and is killed" in caplog.text
        monkeypatch.setattr(process, "LOADING", 60.0)
        monkeypatch.setattr(pool_jobs, "STAND_IN", works)
        wait_for(lambda: client.get("/readyz").json()["status"] == "ready", 60)


def test_a_process_that_hangs_while_it_loads_fails_the_wait_once_it_is_killed(stand_ins, monkeypatch, caplog):
    """Not after another one was given as long."""
    monkeypatch.setattr(pool_jobs, "STAND_IN", "import time; time.sleep(60)")
    monkeypatch.setattr(process, "LOADING", 2.0)
    pool = stand_ins()
    pool.start()
    wait_for(lambda: pool.processes[0].pid is not None)
    with pytest.raises(module.LostError):
        pool.wait()
    assert caplog.text.count("has not loaded the core") == 1


@pytest.mark.parametrize("leaves", [False, True])
def test_a_request_waits_for_a_process_that_loads_no_longer_than_its_time_and_client(
    stand_ins, monkeypatch, leaves
):
    monkeypatch.setattr(pool_jobs, "STAND_IN", "import time; time.sleep(60)")
    pool = stand_ins()
    pool.start()
    wait_for(lambda: pool.processes[0].pid is not None)
    loading, began = pool.processes[0].pid, time.monotonic()
    with pytest.raises(ClientLeftError if leaves else TooSlowError):
        ask(pool, pool_jobs.pid, seconds=60.0 if leaves else 0.1, leave=lambda: leaves)
    assert time.monotonic() - began < module.LATE
    assert pool.processes[0].pid == loading, "others may wait for it"


def test_a_stop_does_not_wait_until_a_process_may_be_started_again(stand_ins, monkeypatch, caplog):
    monkeypatch.setattr(process, "APART", 60.0)
    monkeypatch.setattr(pool_jobs, "STAND_IN", "raise SystemExit(1)")
    pool, ended = stand_ins(), threading.Event()

    def wait() -> None:
        with pytest.raises(module.LostError):
            pool.wait()
        ended.set()

    threading.Thread(target=wait, daemon=True).start()
    wait_for(lambda: "has ended" in caplog.text)
    pool.stop()
    assert ended.wait(10)


def test_the_memory_of_the_processes_is_known(stand_ins):
    pool = stand_ins()
    assert pool.resident == 0
    ask(pool, pool_jobs.pid)
    assert pool.resident > 1 << 20


def test_the_process_ends_with_the_service_and_not_by_a_signal_to_all(pool):
    """The last test of this process."""
    number = ask(pool, pool_jobs.pid)
    assert psutil.Process(number).nice() > psutil.Process().nice()
    os.kill(number, signal.SIGTERM)
    os.kill(number, signal.SIGINT)
    assert ask(pool, pool_jobs.pid) == number
    running = pool.processes[0].child
    assert running is not None
    assert running.stdin is not None
    running.stdin.close()  # as the system does when the service is killed
    wait_for(lambda: running.poll() is not None)
