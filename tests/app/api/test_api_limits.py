"""REST: limits on the computing time of a request and on concurrent requests, and the cost of hostile input."""

from __future__ import annotations

import asyncio
import gzip
import json
import threading
import time
from urllib.parse import quote

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.requests import Request

import kin
from app.api import ik
from app.api.batches import Batch, one_or_all
from app.api.problems import ProblemError
from app.api.work import ComputeSlots, Deadline, TooSlowError
from app.service.main import create_app
from app.shared.settings import Settings

ARM = "/api/v1/robots/pioneer5"
PANDA = "/api/v1/robots/panda"
FAR = {"position": [5.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}  # takes the Panda some tenths of a second each
HURRIED = Settings(time_budget=0.1)


@pytest.fixture(scope="module")
def hurried():
    return TestClient(create_app(HURRIED), raise_server_exceptions=False)


def refused_as_too_slow(answer):
    assert answer.status_code == 503, answer.text
    assert answer.json()["type"] == "urn:kinboard:problem:too-slow"
    assert "KINBOARD_TIME_BUDGET" in answer.json()["hint"]
    assert int(answer.headers["retry-after"]) > 0


# -- time ------------------------------------------------------------------------------------------------------


@pytest.mark.full
def test_a_batch_that_takes_too_long_is_abandoned(hurried, monkeypatch):
    solved = []
    solve = ik.solve
    monkeypatch.setattr(ik, "solve", lambda *a, **k: solved.append(1) or solve(*a, **k))
    refused_as_too_slow(hurried.post(f"{PANDA}/ik", json={"target": [FAR] * 10_000}))
    assert len(solved) < 1000


def test_a_path_that_takes_too_long_is_abandoned(hurried):
    panda = kin.get_robot("panda")
    rng = np.random.default_rng(1)
    places = [kin.fk(panda, panda.random_q(rng))[:3, 3].tolist() for _ in range(1000)]
    refused_as_too_slow(
        hurried.post(f"{PANDA}/ik/path", json={"targets": [{**FAR, "position": p} for p in places]})
    )
    refused_as_too_slow(hurried.post(f"{PANDA}/ik/path", json={"targets": [FAR] * 1000}))


@pytest.mark.full
def test_targets_checked_in_time_are_returned_with_a_problem():
    # Long enough for some also where a busy machine lets the computation begin late.
    client = TestClient(create_app(Settings(time_budget=1.0)))
    answer = client.post(f"{PANDA}/reachable", json={"target": [FAR] * 10_000})
    assert answer.status_code == 200
    document = answer.json()
    assert 0 < len(document["results"]) < 10_000
    assert document["problem"]["type"] == "urn:kinboard:problem:too-slow"


def test_few_results_are_lost_to_the_target_that_takes_too_long():
    def answers(some: slice) -> list[object]:
        if some.stop > 4:
            raise TooSlowError(30.0, "")
        return [{"n": n} for n in range(100)[some]]

    response = one_or_all(answers, Batch("target", 100, False, 10), Deadline(ComputeSlots(1, 30.0)), partly=True)
    assert [each["n"] for each in json.loads(response.body)["results"]] == [0, 1, 2]


def test_a_summary_that_took_too_long_is_cached_for_the_next_request(hurried, monkeypatch):
    done = threading.Event()
    facts = kin.workspace.workspace_facts

    def slow(robot, **asked):
        done.wait(30)
        return facts(robot, **asked)

    monkeypatch.setattr("app.shared.summaries.workspace_facts", slow)
    refused_as_too_slow(hurried.get(f"{ARM}/workspace/summary?volume=false"))
    done.set()
    deadline = time.monotonic() + 30
    while (again := hurried.get(f"{ARM}/workspace/summary?volume=false")).status_code == 503:
        assert time.monotonic() < deadline
    assert again.status_code == 200


def test_a_request_without_a_slot_waits_and_is_then_refused():
    async def ask():
        work = ComputeSlots(1, 0.05)
        request = Request({"type": "http", "client": ("192.0.2.1", 1)})
        async with work.slot(request):
            with pytest.raises(ProblemError) as refused:
                async with work.slot(request):
                    pytest.fail("the slot was taken")
        async with work.slot(request) as deadline:  # free again
            deadline.check()
        work.close()
        with pytest.raises(ProblemError):
            deadline.check()
        return refused.value.problem

    problem = asyncio.run(ask())
    assert (problem.status, problem.type) == (503, "urn:kinboard:problem:busy")


@pytest.mark.full
def test_heavy_requests_leave_threads_for_other_requests():
    """With every slot taken and more requests waiting, a page that needs a thread is still served."""
    service = create_app(Settings(max_requests=2, time_budget=3.0))
    with TestClient(service, raise_server_exceptions=False) as client:
        asking = [
            threading.Thread(target=client.post, args=(f"{PANDA}/ik",), kwargs={"json": {"target": [FAR] * 5000}})
            for _ in range(6)
        ]
        for each in asking:
            each.start()
        time.sleep(0.5)
        assert client.get("/static/landing.css").status_code == 200  # read in a thread
        assert any(each.is_alive() for each in asking)
        for each in asking:
            each.join()


# -- hostile input ---------------------------------------------------------------------------------------------

ROUTES = ("fk", "jacobian", "ik", "ik/path", "reachable", "equations")
GOOD = {
    "fk": {"q": [0.1] * 5},
    "jacobian": {"q": [0.1] * 5},
    "equations": {"q": [0.1] * 5},
    "ik": {"target": {"position": [0.045, 0.191, -0.211]}},
    "ik/path": {"targets": [{"position": [0.045, 0.191, -0.211]}]},
    "reachable": {"target": {"position": [0.045, 0.191, -0.211]}},
}


def refused(answer):
    """A problem document, and the field if a value was wrong."""
    assert 400 <= answer.status_code < 500, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == answer.status_code
    assert problem["detail"]
    assert len(answer.content) < 5000
    if answer.status_code == 422:
        assert problem["errors"][0]["field"]
    return problem


def post(client, what, content, **headers):
    headers = {"content-type": "application/json"} | {k.replace("_", "-"): v for k, v in headers.items()}
    return client.post(f"{ARM}/{what}", content=content, headers=headers)


NUMBERS = (
    *("NaN", "-NaN", "Infinity", "-Infinity", "1e308", "-1e308", "1e400", "5e-324", "-0.0", "1" + "0" * 400),
    *("null", "true", '"1"', "{}", "[]", '"\\u0000"', "9007199254740993", "1e6", "1000001"),
)


@pytest.mark.parametrize("what", ROUTES)
@pytest.mark.parametrize("number", NUMBERS)
def test_odd_numbers_in_every_field(client, what, number):
    text = json.dumps(GOOD[what])
    at = text.rindex("0.") if "0." in text else 0
    end = min(i for i in (text.find(c, at) for c in ",]") if i > 0)
    answer = post(client, what, text[:at] + number + text[end:])
    if answer.status_code != 200:
        assert refused(answer)["status"] in (400, 422)


@pytest.mark.parametrize("what", ROUTES)
@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf{}",
        '{"q": [0]}'.encode("utf-16"),
        gzip.compress(b"{}", mtime=0),
        b'{"q": "\\ud800"}',
        b'{"\\ud800": 1}',
        b'{"q": "\xed\xa0\x80"}',
        b'{"q":' * 100_000,
        b"[" * 100_000 + b"]" * 100_000,
        b'{"q":' + b"[" * 150 + b"1" + b"]" * 150 + b"}",
        b"[" + b"1," * 100_000 + b"1]",
        b'{"target": [' + b"{}," * 50_000 + b"{}]}",
        b'{"q": [' + b"[]," * 50_000 + b"[]]}",
        b'{"targets": [' + b"0," * 50_000 + b"0]}",
        b'{"target": {"position": [1,2,3], "position": "x"}}',
        b"{" + b",".join(b'"%d":1' % i for i in range(20_000)) + b"}",
        b"\x00",
    ],
    ids=lambda content: content[:12].hex(),
)
def test_odd_bodies(client, what, content):
    began = time.process_time()
    refused(post(client, what, content))
    assert time.process_time() - began < 5.0  # takes milliseconds; processor time does not depend on other load


@pytest.mark.parametrize("what", ROUTES)
def test_the_last_value_of_a_duplicate_key_is_used(client, what):
    name = next(iter(GOOD[what]))
    text = json.dumps(GOOD[what])
    assert post(client, what, text[:-1] + f', "{name}": 3}}').status_code == 422
    assert post(client, what, f'{{"{name}": 3, {text[1:]}').status_code == 200


@pytest.mark.parametrize("what", ROUTES)
def test_chunked_bodies_without_a_content_length(client, what):
    text = json.dumps(GOOD[what]).encode()
    answer = post(client, what, iter([text[:3], b"", text[3:]]))
    assert answer.status_code == 200, answer.text


@pytest.mark.parametrize("what", ROUTES)
@pytest.mark.parametrize("encoding", ["gzip", "br", "identity, gzip"])
def test_a_compressed_body_is_not_decompressed(client, what, encoding):
    assert refused(post(client, what, gzip.compress(b"{}"), content_encoding=encoding))["status"] in (400, 415)


NASTY = (
    "%00",
    "%2e%2e",
    "%ff%fe",
    "a" * 3000,
    "%F0%9F%A4%96",
    "%0d%0aX-Evil:1",
    "'\"<script>",
    "%25",
    "..;",
    "%C0%AF",
)


@pytest.mark.parametrize("name", NASTY)
@pytest.mark.parametrize("what", ["", *ROUTES, "workspace", "workspace/summary", "capability"])
def test_nasty_names_of_robots(client, name, what):
    method = "POST" if what in ROUTES else "GET"
    answer = client.request(method, f"/api/v1/robots/{name}/{what}".rstrip("/"), json=GOOD.get(what))
    assert refused(answer)["status"] in (404, 405)
    assert "x-evil" not in answer.headers


@pytest.mark.parametrize("value", [*NASTY, "", "NaN", "1e400", "9" * 5000, "-1", "1.5", "0x10", "１", "1_0"])
@pytest.mark.parametrize("name", ["n", "seed", "strategy", "measure", "format", "q", "limit", "lock", "made-up"])
def test_nasty_queries(client, name, value):
    raw = value if "%" in value else quote(value)
    answer = client.get(f"{ARM}/workspace?n=5&{name}={raw}" if name != "n" else f"{ARM}/workspace?n={raw}")
    if answer.status_code != 200:
        assert refused(answer)["status"] == 422
        assert answer.json()["errors"][0]["field"].startswith(name[:4])


numbers = st.one_of(st.floats(), st.integers(), st.sampled_from([10**400, 1e308, 5e-324, -0.0, True, None]))
junk = st.recursive(
    numbers | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=40,
)


@pytest.mark.full
@pytest.mark.parametrize("what", ROUTES)
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_junk_in_any_field(client, what, data):
    fields = sorted(client.get("/openapi.json").json()["components"]["schemas"][SCHEMAS[what]]["properties"])
    body = dict(GOOD[what])
    for field in data.draw(st.lists(st.sampled_from(fields), min_size=1, max_size=3, unique=True)):
        body[field] = data.draw(junk)
    answer = post(client, what, json.dumps(body))
    if answer.status_code != 200:
        refused(answer)


SCHEMAS = {
    "fk": "FkRequest",
    "jacobian": "JacobianRequest",
    "ik": "IkRequest",
    "ik/path": "PathRequest",
    "reachable": "ReachableRequest",
    "equations": "EquationsRequest",
}
