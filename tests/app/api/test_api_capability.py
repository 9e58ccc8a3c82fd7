"""REST: capability maps in one answer."""

from __future__ import annotations

import threading

import httpx2
import numpy as np
import pytest
from fastapi import FastAPI
from live_server import serve, wait_for
from pydantic import TypeAdapter

import kin
from app.api import ComputeSlots, StreamLimit, api_routes, install_problem_handlers
from app.shared import mapreduce
from app.shared.answers.answer import as_plain
from app.shared.answers.capability import CapabilityMapAnswer, capability_answer
from app.shared.maps import Maps
from app.shared.settings import Settings
from app.shared.store import Store

PIONEER = kin.get_robot("pioneer5")
ADDRESS = "/api/v1/robots/pioneer5/capability"


@pytest.fixture
def live():
    """REST alone on a real port, one map at a time, and a client: disconnecting needs a real connection."""
    app = FastAPI()
    app.state.settings, app.state.store = Settings(), Store()
    app.state.maps, app.state.streams, app.state.compute = Maps(threads=1), StreamLimit(1), ComputeSlots(4, 60.0)
    install_problem_handlers(app)
    app.router.routes.extend(api_routes())
    with serve(app) as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", trust_env=False, timeout=60) as c:
        yield app, c
    app.state.maps.close()


@pytest.fixture
def held(monkeypatch):
    """(event, blocks): a block is computed once the event is set; `blocks` lists those that were started."""
    go, begun, compute = threading.Event(), [], mapreduce.capability_block

    def block(grid, number):
        begun.append(number)
        go.wait(20)
        return compute(grid, number)

    monkeypatch.setattr(mapreduce, "capability_block", block)
    yield go, begun
    go.set()


def test_the_answer_is_the_map_of_the_core(client):
    query = "resolution=7&directions=12&limit=2:0:1&lock=1:0.25&approachable=true"
    answer = client.get(f"{ADDRESS}?{query}").json()
    TypeAdapter(CapabilityMapAnswer).validate_python(answer, strict=True)
    limits, locked = [None, (0.0, 1.0), None, None, None], [0.25, None, None, None, None]
    found = kin.workspace.capability_map(PIONEER, resolution=7, directions=12, limits=limits, locked=locked)
    assert answer["summary"] == as_plain(capability_answer(found))
    assert answer["directions"] == found.grid.directions.tolist()
    voxels = answer["voxels"]
    assert len(voxels["centres"]) == len(found.index) > 3
    assert voxels["centres"] == found.centres.tolist()
    assert voxels["share"] == pytest.approx(found.share)
    assert voxels["manipulability"] == pytest.approx(found.manipulability)
    fits = np.array([[c == "1" for c in row] for row in voxels["approachable"]])
    assert np.array_equal(fits, found.approachable)


def test_a_repeated_request_is_served_from_the_cache(client, monkeypatch):
    first = client.get(f"{ADDRESS}?resolution=6&directions=12")
    assert first.json()["voxels"]["approachable"] is None
    monkeypatch.setattr(mapreduce, "capability_block", None)
    assert client.get(f"{ADDRESS}?resolution=6&directions=12").content == first.content


@pytest.mark.parametrize(
    ("query", "field", "said"),
    [
        ("resolution=0", "resolution", "greater than or equal to 1"),
        ("resolution=41", "resolution", "from 1 to 40"),
        ("resolution=many", "resolution", "integer"),
        ("directions=13", "directions", "'96'"),
        ("limit=9:0:1", "limit[0]", "joint from 1 to 5"),
        ("lock=2:9", "lock[0]", "inside the limits"),
        ("voxel=1", "voxel", "only the fields"),
    ],
)
def test_a_wrong_value_is_named(client, app, query, field, said):
    answer = client.get(f"{ADDRESS}?{query}")
    assert answer.status_code == 422
    error = answer.json()["errors"][0]
    assert error["field"] == field
    assert said in error["expected"]
    assert app.state.streams.open == 0


def test_an_unknown_robot_is_a_404(client):
    assert client.get("/api/v1/robots/nobody/capability").status_code == 404


def test_a_client_that_disconnects_cancels_the_map_and_frees_its_slot(live, held):
    app, client = live
    go, begun = held
    with pytest.raises(httpx2.TimeoutException):
        client.get(f"{ADDRESS}?resolution=30&directions=12", timeout=1.0)
    wait_for(lambda: app.state.streams.open == 0)
    go.set()
    wait_for(lambda: len(app.state.maps._maps) == 0)
    assert len(begun) <= 2


def test_requests_beyond_the_limit_get_a_503_with_retry_after(live, held):
    _, client = live
    go, begun = held
    answers = []
    first = threading.Thread(target=lambda: answers.append(client.get(f"{ADDRESS}?resolution=5&directions=12")))
    first.start()
    wait_for(lambda: len(begun) > 0)
    refused = client.get(f"{ADDRESS}?resolution=4")
    assert refused.status_code == 503
    assert refused.headers["retry-after"] == "2"
    go.set()
    first.join(60)
    assert answers[0].status_code == 200


def test_a_map_that_takes_too_long_is_abandoned(live, held):
    app, client = live
    app.state.compute.seconds = 0.2
    answer = client.get(f"{ADDRESS}?resolution=5&directions=12")
    assert answer.status_code == 503
    assert answer.json()["type"] == "urn:kinboard:problem:too-slow"
    assert app.state.streams.open == 0


def test_a_failure_is_a_500_and_is_not_cached(client, monkeypatch, caplog):
    with monkeypatch.context() as broken:
        broken.setattr(mapreduce, "capability_block", lambda grid, block: 1 / 0)
        assert client.get(f"{ADDRESS}?resolution=5&directions=24").status_code == 500
    assert client.get(f"{ADDRESS}?resolution=5&directions=24").status_code == 200
