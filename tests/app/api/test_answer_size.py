"""Answers are bounded in bytes: estimated before they are computed, counted while they are held."""

from __future__ import annotations

import asyncio
import gc
import socket
import threading

import httpx2
import numpy as np
import pytest
from fastapi.testclient import TestClient
from live_server import serve, wait_for
from starlette.types import Message

import kin
from app.api import ik
from app.api.batches import SENT, HeldResponse, held_response
from app.service.main import create_app
from app.shared.memory import answers
from app.shared.memory.answers import SMALL, AnswerMemory, AnswerTooLargeError, MemoryFullError, MemoryShare
from app.shared.settings import Settings

API = "/api/v1/robots"
MOST, ALL = 8_000_000, 16_000_000  # more than the system buffers for a client that does not read
UR5 = kin.get_robot("ur5")
POSE = {"matrix": kin.fk(UR5, UR5.random_q(np.random.default_rng(3))).tolist()}  # 512 solutions with all images


@pytest.fixture(scope="module")
def application():
    return create_app(Settings(max_answer=MOST, answer_memory=ALL, max_voxels=100))


@pytest.fixture(scope="module")
def bounded(application):
    return TestClient(application, raise_server_exceptions=False)


def refused(answer, field: str):
    assert answer.status_code == 413, answer.text[:500]
    problem = answer.json()
    assert problem["type"] == "urn:kinboard:problem:answer-too-large"
    assert "KINBOARD_MAX_ANSWER" in problem["hint"]
    (error,) = problem["errors"]
    assert error["field"] == field
    return error


@pytest.mark.full
def test_a_list_whose_answer_would_be_too_large_is_refused_before_it_is_computed(bounded, monkeypatch):
    monkeypatch.setattr(ik, "solve", lambda *_: pytest.fail("computed"))
    body = {"target": [POSE] * 100, "images": "all"}
    error = refused(bounded.post(f"{API}/ur5/ik", json=body), "target")
    assert error["value"] == "a list of 100"
    assert error["expected"].startswith("at most 45 items or images")
    # The same list with small answers, and as many items as are allowed.
    monkeypatch.undo()
    assert bounded.post(f"{API}/ur5/ik", json=body | {"images": "nearest"}).status_code == 200
    assert bounded.post(f"{API}/ur5/ik", json=body | {"max_solutions": 1}).status_code == 200
    assert len(bounded.post(f"{API}/ur5/ik", json=body | {"target": [POSE] * 45}).json()["results"]) == 45


@pytest.mark.full
def test_other_lists_are_refused_too(bounded):
    q = list(UR5.home)
    assert (
        "frames" in refused(bounded.post(f"{API}/ur5/fk", json={"q": [q] * 3000, "frames": True}), "q")["expected"]
    )
    refused(bounded.post(f"{API}/ur5/jacobian", json={"q": [q] * 9000}), "q")
    refused(bounded.post(f"{API}/pioneer5/equations", json={"q": [[0.1] * 5] * 3000}), "q")
    refused(bounded.get(f"{API}/scara/capability?resolution=100&directions=12"), "resolution")


def test_an_answer_that_is_larger_than_estimated_is_refused_all_the_same(bounded, monkeypatch):
    monkeypatch.setattr(ik, "_size", lambda *_: 100)
    refused(bounded.post(f"{API}/ur5/ik", json={"target": [POSE] * 60, "images": "all"}), "target")


@pytest.mark.parametrize("robot_id", tuple(kin.files.classic_robots()))
@pytest.mark.parametrize("images", ["nearest", "all"])
def test_the_estimate_of_an_answer_is_close(client, robot_id, images):
    robot = kin.get_robot(robot_id)
    rng = np.random.default_rng(3)
    targets = [{"matrix": kin.fk(robot, robot.random_q(rng)).tolist()} for _ in range(8)]
    body = {"target": targets, "images": images, "task": "pose" if robot.n > 5 else "approach"}
    size = len(client.post(f"{API}/{robot_id}/ik", json=body).content) / len(targets)
    request = ik.IkRequest.model_validate(body)
    estimate = ik._size(robot, request.options("pose"))
    assert 0.5 * size < estimate < max(5.0 * size, 12_000)


def test_the_largest_lists_of_the_default_settings_are_allowed():
    settings = Settings()
    for robot in kin.files.classic_robots().values():
        request = ik.IkRequest.model_validate({"target": [POSE]})
        assert ik._size(robot, request.options("pose")) * settings.max_batch < settings.max_answer


@pytest.mark.full
def test_answers_that_nobody_reads_are_bounded_together_and_freed_when_the_client_leaves(application):
    memory = application.state.compute.memory
    body = {"target": [POSE] * 45, "images": "all"}
    with serve(application) as port:
        address = f"http://127.0.0.1:{port}{API}/ur5/ik"
        lazy = [unread(port, body) for _ in range(4)]
        wait_for(lambda: memory.held > ALL - MOST, 60)
        wait_for(lambda: httpx2.post(address, json=body, trust_env=False).status_code == 503, 60)
        busy = httpx2.post(address, json=body, trust_env=False)
        assert "KINBOARD_ANSWER_MEMORY" in busy.json()["hint"]
        assert memory.held <= ALL
        small = httpx2.post(address, json={"target": POSE, "max_solutions": 1}, trust_env=False)
        assert small.status_code == 200, "small answers are not affected"
        for connection in lazy:
            connection.close()
        wait_for(lambda: memory.held == 0, 30)
        again = httpx2.post(address, json=body, trust_env=False)
        assert len(again.json()["results"]) == 45
        wait_for(lambda: memory.held == 0, 30)


def unread(port: int, body: dict) -> socket.socket:
    """A connection that has sent a request and does not read the answer."""
    request = httpx2.Request("POST", f"http://127.0.0.1:{port}{API}/ur5/ik", json=body)
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect(("127.0.0.1", port))
    head = f"POST {API}/ur5/ik HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in request.headers.items())
    connection.sendall(head.encode() + b"\r\n" + request.read())
    return connection


def test_a_response_is_sent_in_pieces_and_gives_memory_back_as_it_is_read():
    memory = AnswerMemory(1 << 30, 1 << 30)
    pieces = [b"a" * (2 * SENT + 7), b"b" * SENT, b"c" * 10]
    whole = b"".join(pieces)
    reservation = memory.reserve(len(whole))
    sent: list[Message] = []
    held: list[int] = []

    async def send(message: Message) -> None:
        sent.append(message)
        held.append(memory.held)

    response = held_response(pieces, reservation)
    assert isinstance(response, HeldResponse)
    asyncio.run(response({"type": "http"}, lambda: pytest.fail("received"), send))
    bodies = [message["body"] for message in sent[1:]]
    assert b"".join(bodies) == whole
    assert max(map(len, bodies)) <= SENT
    assert sent[-1]["more_body"] is False
    assert dict(sent[0]["headers"])[b"content-length"] == str(len(whole)).encode()
    assert held == sorted(held, reverse=True)
    assert held[0] == len(whole)
    assert memory.held == 0


def test_memory_is_bounded_for_one_and_for_all():
    memory = AnswerMemory(3 * SMALL, 4 * SMALL)
    assert memory.reserve(SMALL).release() is None
    with pytest.raises(AnswerTooLargeError):
        memory.reserve(3 * SMALL + 1)
    first = memory.reserve(3 * SMALL)
    with pytest.raises(MemoryFullError):
        memory.reserve(2 * SMALL)
    first.resize(2 * SMALL)
    second = memory.reserve(2 * SMALL)
    assert memory.held == 4 * SMALL
    del second  # forgotten: the request was cancelled
    assert memory.held == 2 * SMALL
    first.release()
    first.release()
    assert memory.held == 0


@pytest.mark.parametrize("full", ["whole", "share"])
def test_a_reservation_may_be_collected_while_the_memory_is_locked(full, monkeypatch):
    """The garbage collector may begin anywhere, as here where the error of a full memory is made."""

    class CollectedError(MemoryFullError):
        def __init__(self):
            gc.collect()

    monkeypatch.setattr(answers, "MemoryFullError", CollectedError)
    whole = AnswerMemory(4 * SMALL, (4 if full == "whole" else 100) * SMALL)
    share = MemoryShare(whole, (4 if full == "share" else 100) * SMALL)
    kept = share.reserve(2 * SMALL)
    cycle = [share.reserve(2 * SMALL)]
    cycle.append(cycle)
    del cycle
    raised = []

    def reserve():
        with pytest.raises(MemoryFullError):
            share.reserve(4 * SMALL)
        raised.append(True)

    thread = threading.Thread(target=reserve, daemon=True)
    thread.start()
    thread.join(10.0)
    assert raised, "it waits for a lock that it holds"
    assert share.held == whole.held == 2 * SMALL
    share.reserve(2 * SMALL)
    kept.release()


def test_what_was_forgotten_leaves_room_for_the_next():
    memory = AnswerMemory(4 * SMALL, 4 * SMALL)
    for _ in range(3):  # forgotten each time, without `held` being asked
        memory.reserve(3 * SMALL)
    kept = memory.reserve(3 * SMALL)
    kept.release()
    del kept
    assert memory.held == 0, "what was released is not given back again"


def test_concurrent_reservations_are_counted_exactly():
    memory = AnswerMemory(1 << 40, 1 << 40)

    def work():
        for _ in range(2000):
            reservation = memory.reserve(2 * SMALL)
            reservation.resize(3 * SMALL)
            reservation.release()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert memory.held == 0
