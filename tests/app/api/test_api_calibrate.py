"""Calibrating by touching over REST: postures, a fit, arms sent along, bad input by its field."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.service.main import create_app
from app.shared.settings import Settings

BAR = {"boards": [{"bar": 0.15}]}
EYE = np.eye(4).tolist()
FAR = kin.pose_from_xyz_rpy([5.0, 0.0, 0.0]).tolist()


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app(Settings()))


def asked(client: TestClient, path: str, body: dict[str, Any], status: int = 200) -> dict[str, Any]:
    answer = client.post(f"/api/v1/{path}", json=body)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


@pytest.fixture(scope="module")
def plan(client: TestClient) -> dict[str, Any]:
    return asked(client, "robots/ur5e/touch-postures", {"fixture": BAR, "count": 8})


def test_postures_are_those_of_the_core(plan: dict[str, Any]) -> None:
    fixture = kin.calibration.TouchFixture([kin.calibration.TouchBoard.bar(0.15)])
    core = kin.calibration.touch_postures("ur5e", fixture, 8)
    assert np.allclose(plan["q"], core.q)
    assert plan["sockets"] == core.sockets.tolist()
    assert plan["text"] == core.text


def test_touches_give_an_arm_that_other_requests_take(client: TestClient, plan: dict[str, Any]) -> None:
    body = {"fixture": BAR, "q": plan["q"], "sockets": plan["sockets"]}
    found = asked(client, "robots/ur5e/calibrate", body)
    assert found["faults"] == []
    assert found["kept"] == list(range(8))
    assert found["expected"]["after"] < found["expected"]["before"]
    there = asked(client, "fk", {"robot": found["robot"], "q": plan["q"][0]})
    assert np.allclose(there["pose"]["position"], kin.fk("ur5e", plan["q"][0])[:3, 3], atol=1e-4)
    sent = {"robot": kin.robot_to_dict(kin.get_robot("ur5e")), **body}
    assert asked(client, "calibrate", sent)["expected"] == found["expected"]
    kept = asked(client, "robots/ur5e/calibrate", {**body, "tolerances": {"keep_family": True, "zero": 0.1}})
    assert len(kept["errors"]) < len(found["errors"])


def test_further_postures_take_account_of_touches(client: TestClient, plan: dict[str, Any]) -> None:
    done = {"q": plan["q"], "sockets": plan["sockets"]}
    more = asked(client, "robots/ur5e/touch-postures", {"fixture": BAR, "count": 2, "done": done})
    assert len(more["q"]) == 2
    assert more["expected"]["after"] < plan["expected"]["after"]


@pytest.mark.parametrize(
    ("change", "field", "said"),
    [
        ({"fixture": {"boards": []}}, "fixture.boards", ""),
        ({"fixture": {"boards": [{}] * 17}}, "fixture.boards", ""),
        ({"fixture": {"boards": [{"sheet": "B5"}]}}, "fixture.boards[0].sheet", ""),
        ({"fixture": {"boards": [{}, {"sockets": [[0, 0, 0], [0, 0, 0]]}]}}, "fixture.boards[1].sockets[1]", ""),
        ({"fixture": {"boards": [{"sockets": [[0, 0, 0]] * 65}]}}, "fixture.boards[0].sockets", ""),
        ({"fixture": {"boards": [{}], "at_base": []}}, "fixture.at_base", ""),
        ({"fixture": {"boards": [{}], "at_base": [[[1e9] * 4] * 4]}}, "fixture.at_base[0][0][0]", ""),
        ({"fixture": {"boards": [{}], "at_base": [[[2.0] * 4] * 4]}}, "fixture.at_base[0][3]", ""),
        ({"tolerances": {"zero": 9.0}}, "tolerances.zero", ""),
        ({"noise": {"joint": 0.7, "contact": 1e-4}}, "noise.joint", ""),
        ({"q": [[0.0] * 6] * 1001, "sockets": [0] * 1001}, "q", ""),
        ({"q": [[0.0] * 5] * 8}, "q[0]", ""),
        ({"q": [[9.0] * 6] * 8}, "q[0][0]", "are these degrees"),
        ({"q": [[0.1] * 6] * 8}, "q", "differ by 5°"),
        ({"q": [[0.1] * 6] * 3, "sockets": [0] * 3}, "q", "7 to 1000 touches"),
        ({"sockets": [0] * 7}, "sockets", ""),
        ({"sockets": [0] * 7 + [2]}, "sockets[7]", "a socket of the fixture, 0 to 1"),
        ({"sockets": [0] * 7 + [True]}, "sockets[7]", ""),
        ({"sockets": [0] * 7 + [0.5]}, "sockets[7]", ""),
    ],
    ids=str,
)
def test_bad_input_names_the_field(
    client: TestClient, plan: dict[str, Any], change: dict[str, Any], field: str, said: str
) -> None:
    body = {"fixture": BAR, "q": plan["q"], "sockets": plan["sockets"], **change}
    found = asked(client, "robots/ur5e/calibrate", body, 422)
    assert found["errors"][0]["field"] == field, found
    assert said in found["errors"][0]["expected"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"count": 101}, "count"),
        ({"count": 0}, "count"),
        ({"places": [EYE, EYE]}, "places"),
        ({"places": [FAR]}, "places"),
        ({"table": 5.0}, "table"),
        ({"done": {"q": [[9.0] * 6], "sockets": [0]}}, "done.q[0][0]"),
        ({"done": {"q": [[0.0] * 6], "sockets": [7]}}, "done.sockets[0]"),
        ({"done": {"q": [[0.0] * 5], "sockets": [0]}}, "done.q[0]"),
    ],
    ids=str,
)
def test_a_plan_names_the_field_too(client: TestClient, change: dict[str, Any], field: str) -> None:
    found = asked(client, "robots/ur5e/touch-postures", {"fixture": BAR, "count": 3, **change}, 422)
    assert found["errors"][0]["field"] == field, found


def test_a_computation_ends_with_the_time_of_its_request() -> None:
    """Touches of which each contradicts the others are sorted out one by one, for minutes."""
    slow = TestClient(create_app(Settings(time_budget=0.3)))
    q = kin.get_robot("ur5e").random_q(np.random.default_rng(1), 600).tolist()
    answer = slow.post("/api/v1/robots/ur5e/calibrate", json={"fixture": BAR, "q": q, "sockets": [0, 1] * 300})
    assert answer.status_code == 503, answer.text
    assert answer.json()["type"].endswith(":too-slow")
