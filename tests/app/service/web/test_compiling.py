"""A request whose kernel is still being compiled gets 503 in words, and the next one its answer."""

from __future__ import annotations

import asyncio
import gc
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import pytest
from live_server import serve, wait_for
from numba.core.compiler_lock import global_compiler_lock

from app.api import ik
from app.service import status
from app.service.main import create_app
from app.service.web import compiling
from app.shared.settings import Settings
from app.shared.threads.turns import MOST
from kin.solvers import family_of
from kin.warmup import all_of, parts

UR5 = "/api/v1/robots/ur5"
BODY = {"target": {"position": [0.3, 0.2, 0.4]}, "max_solutions": 1}
PATIENCE = 0.4  # s


class Compiler:
    """Stands for a long compilation: while it is busy, every thread that needs the compiler waits for it."""

    def __init__(self) -> None:
        self.done = threading.Event()
        self._busy = threading.Event()
        self._thread = threading.Thread(target=self._hold)

    def _hold(self) -> None:
        with global_compiler_lock:
            self._busy.set()
            self.done.wait(60)

    def __enter__(self) -> Compiler:
        self._thread.start()
        assert self._busy.wait(10)
        return self

    def __exit__(self, *_: object) -> None:
        self.done.set()
        self._thread.join()


def after_compiling(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, which asks for numba's compiler first, as one does whose kernel is in no cache."""

    def call(*arguments: Any) -> Any:
        with global_compiler_lock:
            return function(*arguments)

    return call


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[Any, httpx2.Client]]:
    app = create_app(Settings(max_requests=1, client_share=1.0, bench=False))
    with serve(app) as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=60) as c:
        wait_for(lambda: c.get("/readyz").json()["complete"], 300)
        assert c.post(f"{UR5}/ik", json=BODY).status_code == 200
        yield app, c


@pytest.fixture
def live(served: tuple[Any, httpx2.Client], monkeypatch: pytest.MonkeyPatch) -> tuple[Any, httpx2.Client]:
    monkeypatch.setattr(compiling, "PATIENCE", PATIENCE)
    monkeypatch.setattr(ik, "solve", after_compiling(ik.solve))
    return served


@pytest.mark.full
def test_a_request_that_waits_for_the_compiler_is_answered_in_time_and_the_next_one_with_200(
    live: tuple[Any, httpx2.Client],
) -> None:
    app, client = live
    with Compiler() as compiler:
        began = time.monotonic()
        refused = client.post(f"{UR5}/ik", json=BODY)
        assert PATIENCE <= time.monotonic() - began < PATIENCE + 2.0
        assert refused.status_code == 503
        assert refused.headers["content-type"] == "application/problem+json"
        assert refused.headers["retry-after"] == "5"
        assert refused.json()["type"] == "urn:kinboard:problem:preparing"
        assert refused.json()["detail"] == "The UR5 is being prepared for the first time on this machine."
        assert app.state.compute.used == 1, "its thread goes on, and keeps its place"
        compiler.done.set()
        wait_for(lambda: app.state.compute.used == 0, 20)
        assert client.post(f"{UR5}/ik", json=BODY).json()["status"] == "solved"


def test_one_that_waits_for_the_place_of_such_a_request_is_answered_in_time_too(
    live: tuple[Any, httpx2.Client],
) -> None:
    app, client = live
    with Compiler(), ThreadPoolExecutor(2) as callers:
        answers = list(callers.map(lambda _: client.post(f"{UR5}/ik", json=BODY), range(2)))
        assert [answer.json()["type"].rpartition(":")[2] for answer in answers] == ["preparing"] * 2
        assert app.state.compute.used == 1
    wait_for(lambda: app.state.compute.used == 0, 20)


def test_those_that_wait_for_the_compiler_take_no_turn_from_others(
    served: tuple[Any, httpx2.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    """More of them than there are turns, also beyond the usual number."""
    app, client = served
    monkeypatch.setattr(compiling, "PATIENCE", PATIENCE)
    monkeypatch.setattr(app.state.compute._slots, "most", 100)
    monkeypatch.setattr(app.state.compute._slots, "most_of_one", 100)
    solve, waiting = ik.solve, 2 * MOST + 1
    with Compiler(), ThreadPoolExecutor(waiting) as callers:
        monkeypatch.setattr(ik, "solve", after_compiling(solve))
        for answer in callers.map(lambda _: client.post(f"{UR5}/ik", json=BODY), range(waiting)):
            assert answer.json()["type"] == "urn:kinboard:problem:preparing"
        assert app.state.compute.used == waiting
        monkeypatch.setattr(ik, "solve", solve)
        assert client.post(f"{UR5}/ik", json=BODY).status_code == 200
    wait_for(lambda: app.state.compute.used == 0, 20)


def test_a_request_that_computes_beside_the_compiler_is_not_refused(
    served: tuple[Any, httpx2.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, client = served
    monkeypatch.setattr(compiling, "PATIENCE", PATIENCE)
    solve = ik.solve

    def slowly(*arguments: Any) -> Any:
        time.sleep(2 * PATIENCE)
        return solve(*arguments)

    monkeypatch.setattr(ik, "solve", slowly)
    with Compiler():
        assert client.post(f"{UR5}/ik", json=BODY).status_code == 200


def test_on_a_new_machine_the_step_is_said_and_the_arm_comes_first(live: tuple[Any, httpx2.Client]) -> None:
    app, client = live
    family = family_of(app.state.store.get("ur5"))
    steps = sum(len(parts()[name]) for name in (family, all_of(family)))
    preparation = app.state.startup.preparation
    preparation.begin()
    assert preparation.next()[0] != family
    with Compiler():
        detail = client.post(f"{UR5}/ik", json=BODY).json()["detail"]
        assert detail == f"The UR5 is being prepared for the first time on this machine: step 1 of {steps}."
        assert preparation.next()[0] == family
    preparation.finish()


def test_readyz_does_not_wait_for_the_compiler(
    served: tuple[Any, httpx2.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, client = served
    monkeypatch.setattr(status, "_kernels", after_compiling(status._kernels))
    app.state.startup.preparation.begin()
    try:
        assert client.get("/readyz").json()["kernels"]["waiting"]
        with Compiler():
            began = time.monotonic()
            assert client.get("/readyz").json()["kernels"] is None
            assert time.monotonic() - began < 3.0
    finally:
        app.state.startup.preparation.finish()


def test_a_count_that_takes_long_goes_on_after_its_question(monkeypatch: pytest.MonkeyPatch) -> None:
    """The event loop has weak references to tasks: the collector would take one that nobody awaits."""

    async def ask() -> None:
        async def count(_: Callable[[], None]) -> str:
            return await asyncio.get_running_loop().create_future()  # type: ignore[no-any-return]

        monkeypatch.setattr(compiling, "run_in_threadpool", count)
        monkeypatch.setattr(compiling, "COUNTING", 0.0)
        assert await compiling.known_soon(lambda: None) is None
        gc.collect()
        (counting,) = asyncio.all_tasks() - {asyncio.current_task()}
        counting.cancel()
        await asyncio.wait((counting,))

    asyncio.run(ask())
