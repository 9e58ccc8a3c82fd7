"""A client that leaves ends its work, unless somebody else waits for the same."""

from __future__ import annotations

import threading
import time
from concurrent.futures import CancelledError, ThreadPoolExecutor

import httpx2
import pytest
from fastapi import FastAPI
from live_server import serve, wait_for

import kin
from app.api import StreamLimit, UploadMemory, api_routes, ik, install_problem_handlers
from app.api.work import ComputeSlots
from app.shared.settings import Settings
from app.shared.store import Store
from app.shared.summaries import Summaries

ARM = "/api/v1/robots/pioneer5"
SUMMARY = f"{ARM}/workspace/summary?volume=false"
POINT = {"position": [0.045, 0.191, -0.211]}
AIMED = {**POINT, "approach": [-0.31, -0.164, -0.936]}
SOON = 0.4  # s after which an impatient client leaves: its connection is watched by then


@pytest.fixture
def live():
    """REST alone on a real port, one request at a time, and a client: disconnecting needs a real connection."""
    app = FastAPI()
    app.state.settings, app.state.store = Settings(), Store()
    app.state.compute, app.state.streams = ComputeSlots(1, 300.0), StreamLimit(1)
    app.state.summaries, app.state.uploads = Summaries(threads=1), UploadMemory(1 << 30, 1.0)
    install_problem_handlers(app)
    app.router.routes.extend(api_routes())
    with serve(app) as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=60) as c:
        assert c.post(f"{ARM}/ik", json={"target": POINT}, timeout=300).status_code == 200
        yield app, c
    app.state.summaries.close()


class Endless:
    """A replacement of `workspace_facts` that computes until it is stopped or released."""

    def __init__(self):
        self.begun = 0
        self.released = threading.Event()
        self.cancelled = threading.Event()
        self._facts = kin.workspace.workspace_facts

    def __call__(self, robot, *, cancel, **options):
        self.begun += 1
        try:
            while not self.released.wait(0.01):
                cancel()
        except CancelledError:
            self.cancelled.set()
            raise
        return self._facts(robot, **options)


@pytest.fixture
def endless(monkeypatch):
    made = Endless()
    monkeypatch.setattr("app.shared.summaries.workspace_facts", made)
    yield made
    made.released.set()


def leave_soon(client, method, address, **options):
    with pytest.raises(httpx2.TimeoutException):
        client.request(method, address, timeout=SOON, **options)


def test_a_summary_that_nobody_waits_for_is_cancelled(live, endless):
    _, client = live
    leave_soon(client, "GET", SUMMARY)
    assert endless.cancelled.wait(20)


@pytest.mark.full
def test_summaries_that_wait_for_their_turn_are_cancelled_too(live, endless):
    app, client = live
    with ThreadPoolExecutor(4) as callers:
        addresses = [f"{SUMMARY}&lock=5:0.{k}" for k in range(3, 7)]
        list(callers.map(lambda address: leave_soon(client, "GET", address), addresses))
    wait_for(lambda: not len(app.state.summaries._facts), 20)
    assert endless.cancelled.wait(20)


@pytest.mark.full
def test_a_client_that_leaves_does_not_cancel_the_summary_for_others(live, endless):
    _, client = live
    with ThreadPoolExecutor(1) as other:
        answer = other.submit(client.get, SUMMARY)
        wait_for(lambda: endless.begun == 1, 20)
        leave_soon(client, "GET", SUMMARY)
        time.sleep(0.5)  # until it is noticed
        endless.released.set()
        assert answer.result(30).status_code == 200
    assert endless.begun == 1
    assert not endless.cancelled.is_set()


@pytest.mark.full
def test_a_summary_that_was_refused_goes_on_for_a_while_and_is_then_cancelled(live, endless):
    app, client = live
    app.state.compute.seconds = 0.3
    assert client.get(SUMMARY).json()["type"] == "urn:kinboard:problem:too-slow"
    assert client.get(SUMMARY).json()["type"] == "urn:kinboard:problem:too-slow"
    assert endless.begun == 1, "the second request joined the first one's computation"
    assert endless.cancelled.wait(20)


@pytest.mark.full
@pytest.mark.parametrize(
    ("work", "targets"),
    [
        pytest.param("ik_renewed", [AIMED] * 2000, id="in-one-pass"),
        pytest.param("solve", [POINT, AIMED] * 1000, id="one-by-one"),
    ],
)
def test_a_batch_ends_when_its_client_leaves_and_gives_its_slot_back(live, monkeypatch, work, targets):
    _, client = live
    answered = []
    does = getattr(ik, work)

    def slowly(*arguments):
        time.sleep(0.02)
        answered.append(1)
        return does(*arguments)

    monkeypatch.setattr(ik, work, slowly)
    leave_soon(client, "POST", f"{ARM}/ik", json={"target": targets})
    answer = client.post(f"{ARM}/ik", json={"target": POINT}, timeout=15)
    assert answer.status_code == 200
    assert 0 < len(answered) < 500


@pytest.mark.full
def test_a_client_that_leaves_while_it_waits_for_a_slot_is_forgotten(live, monkeypatch):
    _, client = live
    begun = []
    solve = ik.solve
    release = threading.Event()

    def held(robot, T, *arguments):
        begun.append(T[0, 3])
        release.wait(20)
        return solve(robot, T, *arguments)

    monkeypatch.setattr(ik, "solve", held)
    with ThreadPoolExecutor(1) as other:
        first = other.submit(client.post, f"{ARM}/ik", json={"target": POINT})
        wait_for(lambda: len(begun) == 1)
        leave_soon(client, "POST", f"{ARM}/ik", json={"target": {"position": [0.5, 0.5, 0.5]}})
        time.sleep(0.5)
        release.set()
        assert first.result(20).status_code == 200
    assert client.post(f"{ARM}/ik", json={"target": POINT}).status_code == 200
    assert begun == [POINT["position"][0]] * 2
