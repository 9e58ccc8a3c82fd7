"""Requests that need a kernel which is in no cache: they wait for it, as long as they may compute."""

from __future__ import annotations

import socket
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from importlib import import_module, invalidate_caches
from pathlib import Path
from typing import Any

import httpx2
import pytest
from compiling import kernel, stand_in_for_the_compiler
from live_server import serve, wait_for

import kin
from app.api import fk, ik
from app.service import startup
from app.service.compiler import Compilers
from app.service.main import create_app
from app.shared.settings import Settings

ARM = next(iter(kin.files.classic_robots().values()))  # whose kernels every service has
ROUTE = f"/api/v1/robots/{ARM.id}"
BODY = {"target": {"position": kin.fk(ARM, ARM.q_home)[:3, 3].tolist()}, "max_solutions": 1}
HOME = ARM.q_home.tolist()
KERNEL = "from kin.kernels.compile import jit\n\n@jit\ndef twice(x):\n    return 2.0 * x\n"


class Service:
    """A served app in which inverse kinematics needs kernels that are missing.

    Attributes:
        line: of the kernel that the next request needs.
    """

    def __init__(self, app: Any, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.app, self.port = app, port
        self.line = ""
        self.compilers = Compilers()
        self.compiled: list[bool] = []
        monkeypatch.setattr(ik, "solve", self.after_compiling(ik.solve))

    def after_compiling(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The same function, which first waits for a kernel, as numba's dispatch does if it is in no cache."""

        def call(*arguments: Any) -> Any:
            self.compiled.append(self.compilers.compile(self.line))
            return function(*arguments)

        return call

    @contextmanager
    def asking(self, count: int = 1) -> Iterator[list[Future[httpx2.Response]]]:
        """Requests that wait for the kernel, in threads; at the end it is there in any case."""
        with ThreadPoolExecutor(count) as threads:
            try:
                yield [threads.submit(self.post) for _ in range(count)]
            finally:
                Path(self.line).touch()

    @property
    def used(self) -> int:
        """How many requests compute."""
        return int(self.app.state.compute.used)

    def post(self, path: str = f"{ROUTE}/ik", body: Any = BODY) -> httpx2.Response:
        """The answer to a request of its own connection."""
        return httpx2.post(f"http://127.0.0.1:{self.port}{path}", json=body, trust_env=False, timeout=30)

    def get(self, path: str) -> httpx2.Response:
        """The answer to a request of its own connection."""
        return httpx2.get(f"http://127.0.0.1:{self.port}{path}", trust_env=False, timeout=30)


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[Any, int]]:
    """An app with one place for requests, which has the kernels of the first arm only."""
    app = create_app(Settings(max_requests=1, client_share=1.0, time_budget=300.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(startup, "rest_compiled", lambda: True)
        patch.setattr(startup, "warm_up_rest", lambda stop: None)
        with serve(app) as port:
            ready = f"http://127.0.0.1:{port}/readyz"
            wait_for(lambda: httpx2.get(ready, trust_env=False).json()["complete"], 300)
            assert httpx2.post(f"http://127.0.0.1:{port}{ROUTE}/ik", json=BODY, trust_env=False).status_code == 200
            yield app, port


@pytest.fixture
def service(served: tuple[Any, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    stand_in_for_the_compiler(monkeypatch)
    made = Service(*served, monkeypatch)
    made.line = kernel(tmp_path, "kernel", ready=False)
    yield made
    made.compilers.stop()
    wait_for(lambda: made.used == 0)


def test_a_request_waits_for_its_kernel_while_the_service_answers_others(service):
    with service.asking() as (waiting,):
        wait_for(lambda: service.used == 1)
        assert service.get("/livez").status_code == 200
        assert service.get("/").status_code == 200
        assert service.get("/readyz").status_code == 200
        assert service.post(f"{ROUTE}/fk", {"q": HOME}).status_code == 200, "few poses need no place"
        assert not waiting.done()
        Path(service.line).touch()
        answer = waiting.result(20)
    assert (answer.status_code, answer.json()["status"]) == (200, "solved")
    assert service.compiled == [True]


def test_beyond_its_time_a_request_is_refused_and_the_next_one_finds_the_kernel(service, monkeypatch):
    monkeypatch.setattr(service.app.state.compute, "seconds", 0.05)
    refused = service.post()
    assert (refused.status_code, refused.headers["retry-after"]) == (503, "5")
    problem = refused.json()
    assert problem["type"] == "urn:kinboard:problem:preparing"
    assert problem["detail"].endswith("for the first time on this machine, and is not ready after 0.05 s.")
    assert service.used == 0
    monkeypatch.undo()
    answer = service.compilers.asked.submit(service.line)
    assert not answer.done(), "the compilation goes on"
    Path(service.line).touch()
    assert answer.result(20)
    assert service.post().json()["status"] == "solved"


def test_the_place_of_a_client_that_has_left_is_free_while_its_kernel_is_compiled(service):
    body = httpx2.Request("POST", f"http://127.0.0.1:{service.port}{ROUTE}/ik", json=BODY)
    head = f"POST {ROUTE}/ik HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with socket.create_connection(("127.0.0.1", service.port)) as client:
        client.sendall(f"{head}Content-Length: {len(body.content)}\r\n\r\n".encode() + body.content)
        wait_for(lambda: service.used == 1)
    wait_for(lambda: service.used == 0)
    assert not service.compilers.asked.submit(service.line).done()


def test_one_that_waits_for_a_place_gets_it_when_the_kernel_is_there(service):
    with service.asking(2) as waiting:
        wait_for(lambda: service.used == 1 and service.app.state.compute.waiting == 1)
        Path(service.line).touch()
        assert [each.result(20).status_code for each in waiting] == [200, 200]


def test_those_that_wait_do_not_hold_up_others(service, monkeypatch):
    slots = service.app.state.compute._slots
    monkeypatch.setattr(slots, "most", 100)
    monkeypatch.setattr(slots, "most_of_one", 100)
    count = 5
    with service.asking(count) as waiting:
        wait_for(lambda: service.used == count)
        assert len(service.post(f"{ROUTE}/fk", {"q": [HOME] * (fk.FEW + 1)}).json()["results"]) == fk.FEW + 1
        assert not any(each.done() for each in waiting)
        Path(service.line).touch()
        assert {each.result(20).status_code for each in waiting} == {200}


def test_a_request_whose_compiling_process_ends_is_answered(service, tmp_path):
    service.line = kernel(tmp_path, "end")
    assert service.post().json()["status"] == "solved"
    assert service.compiled == [False]


def test_a_request_that_waits_when_the_service_stops_gets_an_error(service):
    with service.asking() as (waiting,):
        wait_for(lambda: service.used == 1)
        service.compilers.stop()
        refused = waiting.result(20)
    assert (refused.status_code, refused.json()["detail"]) == (503, "The service is being stopped.")


@pytest.mark.full
def test_a_kernel_that_a_request_calls_is_compiled_by_another_process(served, tmp_path, monkeypatch):
    """The whole way, with a kernel of one line."""
    _, port = served
    name = f"kernel_{uuid.uuid4().hex}"  # which is in no cache
    (tmp_path / f"{name}.py").write_text(KERNEL)
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    twice = import_module(name).twice
    solve, found = ik.solve, []

    def call(*arguments: Any) -> Any:
        found.append(twice(1.5))
        return solve(*arguments)

    monkeypatch.setattr(ik, "solve", call)
    answer = httpx2.post(f"http://127.0.0.1:{port}{ROUTE}/ik", json=BODY, trust_env=False, timeout=300)
    assert (answer.status_code, found) == (200, [3.0])
    assert sum(twice.stats.cache_hits.values()) == 1
    assert not twice.stats.cache_misses


def test_readyz_names_what_is_left_to_be_compiled(served):
    app, port = served
    preparation = app.state.startup.preparation
    preparation.begin()
    try:
        assert httpx2.get(f"http://127.0.0.1:{port}/readyz", trust_env=False).json()["kernels"]["waiting"]
    finally:
        preparation.finish()
    assert httpx2.get(f"http://127.0.0.1:{port}/readyz", trust_env=False).json()["kernels"] is None
