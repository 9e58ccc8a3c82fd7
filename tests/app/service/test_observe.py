"""Ids, counters, the log of requests."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from app.service.main import create_app
from app.shared.metrics import exposition
from app.shared.settings import Settings

ROOT = Path(__file__).parents[3]
FK = "/api/v1/robots/pioneer5/fk"
FK_ROUTE = "/api/v1/robots/{robot_id}/fk"


def counted(name: str, **labels: str) -> float:
    """The value of a series, 0 if there is none yet."""
    for line in exposition().decode().splitlines():
        found = re.fullmatch(rf"{name}(?:\{{(.*)\}})? (\S+)", line)
        if found and dict(re.findall(r'(\w+)="([^"]*)"', found[1] or "")) == labels:
            return float(found[2])
    return 0.0


def test_each_answer_has_an_id_of_its_own(client):
    ids = {client.get("/livez").headers["x-request-id"] for _ in range(20)}
    assert len(ids) == 20
    assert all(re.fullmatch("[0-9a-f]{16}", name) for name in ids)


def test_a_proxys_id_is_kept_if_it_is_harmless(client):
    assert client.get("/livez", headers={"x-request-id": "abc-1.2:3"}).headers["x-request-id"] == "abc-1.2:3"
    for hostile in ('a"b', "a b", "x" * 200, ""):
        assert client.get("/livez", headers={"x-request-id": hostile}).headers["x-request-id"] != hostile


def test_refusals_have_one_too(client):
    assert "x-request-id" in client.get("/nowhere").headers
    assert "x-request-id" in client.post(FK, content=b"{").headers


def test_requests_are_counted_by_route_not_by_address(client):
    def seen(status: str) -> float:
        return counted("kinboard_requests_total", method="POST", route=FK_ROUTE, status=status)

    good, bad = seen("200"), seen("422")
    client.post(FK, json={"q": [0, 0, 0, 0, 0]})
    client.post(FK, json={"q": [0]})
    assert (seen("200"), seen("422")) == (good + 1, bad + 1)
    assert counted("kinboard_request_seconds_count", route=FK_ROUTE) >= 2


def test_a_client_cannot_make_up_series(client):
    def series():
        return exposition().decode().count("kinboard_requests_total{")

    before = series()
    client.request("BREW", "/livez")
    for k in range(50):
        client.get(f"/made-up-{k}")
        client.get(f"/static/made-up-{k}")
    text = exposition().decode()
    assert "made-up" not in text
    assert "BREW" not in text
    assert series() <= before + 4


def test_the_metrics_page_is_what_prometheus_reads(client):
    answer = client.get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    for name in ("kinboard_requests_total", "kinboard_visitors ", "kinboard_solve_seconds"):
        assert name in answer.text
    for kind in ("requests", "streams", "viewer"):
        assert f'kinboard_places{{kind="{kind}"}} 0.0' in answer.text
    for kind in ("requests", "summaries", "maps", "clouds"):
        assert f'kinboard_pending{{kind="{kind}"}} 0.0' in answer.text
    for kind in ("answers", "clouds", "maps"):
        assert f'kinboard_held_bytes{{kind="{kind}"}} ' in answer.text
    assert counted("kinboard_resident_bytes") > 50e6


@pytest.mark.full
def test_the_times_of_requests_up_to_their_limit_fall_into_different_buckets(client):
    client.get("/livez")
    edges = [
        float(edge)
        for edge in re.findall(r'request_seconds_bucket{le="([0-9.e+-]+)"', client.get("/metrics").text)
    ]
    assert sum(Settings().time_budget <= edge <= 2 * Settings().time_budget for edge in edges) >= 2


def test_with_a_token_the_metrics_are_not_for_everybody():
    guarded = TestClient(create_app(Settings(token="long enough")))  # type: ignore[arg-type]
    assert guarded.get("/metrics").status_code == 401


def test_solves_are_timed(client):
    """Each request once: also one that is answered without a thread, and one for which that was tried in vain."""
    for position in ([0.045, 0.191, -0.211], [0.045, 0.191, -0.211], [0.1, 0.2, 0.1]):
        before = counted("kinboard_solve_seconds_count", door="rest")
        client.post("/api/v1/robots/pioneer5/ik", json={"target": {"position": position}})
        assert counted("kinboard_solve_seconds_count", door="rest") == before + 1


def test_the_log_has_one_object_a_line(caplog):
    caplog.set_level(logging.INFO, "kinboard.access")
    logged = TestClient(create_app(Settings(access_log=True)))
    answer = logged.get('/nowhere/"%0A', headers={"x-request-id": "abc"})
    line = json.loads(caplog.records[-1].message)
    assert line["id"] == answer.headers["x-request-id"] == "abc"
    assert (line["method"], line["status"], line["route"]) == ("GET", 404, "none")
    assert line["path"].startswith("/nowhere/")
    assert line["bytes"] == len(answer.content)
    assert line["ms"] >= 0.0
    assert "\n" not in caplog.records[-1].message


def test_without_the_setting_nothing_is_logged(caplog, client):
    caplog.set_level(logging.INFO, "kinboard.access")
    client.get("/livez")
    assert not [record for record in caplog.records if record.name == "kinboard.access"]


@pytest.mark.parametrize("path", ["/livez", FK])
def test_the_id_is_there_below_a_prefix(path):
    prefixed = TestClient(create_app(Settings(root_path="/arm")))
    assert "x-request-id" in prefixed.get(f"/arm{path}").headers
