"""Comparing arms over REST: by id and sent along, mistakes in words, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.service.main import create_app
from app.shared.settings import Settings


@pytest.fixture(scope="module")
def client():
    return TestClient(create_app(Settings()))


def described(arm: str, **change: object) -> dict[str, object]:
    return {**kin.robot_to_dict(kin.get_robot(arm)), **change}


def asked(client: TestClient, path: str, body: dict[str, object], status: int = 200) -> dict[str, object]:
    answer = client.post(f"/api/v1/{path}", json=body)
    assert answer.status_code == status, answer.text
    return answer.json()


def test_an_arm_is_identical_to_its_other_table(client):
    modified = kin.robot_to_dict(kin.dh.convert_dh("ur5", "modified"))
    found = asked(client, "robots/ur5/compare", {"other": modified})
    assert found["verdict"] == "identical"
    assert found["text"] == "Identical: equal joint values give equal poses."
    assert found["explanations"] == []


def test_both_arms_may_be_sent_along(client):
    found = asked(client, "robots/compare", {"robot": described("panda"), "other": "panda"})
    assert found["verdict"] == "identical"


def test_a_mistake_is_named_and_its_mend_is_an_arm_that_other_requests_take(client):
    wrong = described("ur5", convention="modified")
    found = asked(client, "robots/ur5/compare", {"other": wrong})
    assert found["verdict"] == "different"
    first = found["explanations"][0]
    assert [change["mistake"] for change in first["changes"]] == ["convention"]
    assert found["differences"][0]["quantity"] == "twist"
    q = [0.1, -0.5, 0.8, 0.3, 0.9, -0.2]
    mended = asked(client, "fk", {"robot": first["robot"], "q": q})
    assert np.allclose(mended["pose"]["position"], kin.fk("ur5", q)[:3, 3], atol=1e-9)


def test_a_tolerance_makes_rounded_tables_close(client):
    rounded = described("ur5")
    for row in rounded["rows"]:
        for key in {"alpha", "a", "d"} & row.keys():
            row[key] = round(row[key], 3)
    body = {"other": rounded}
    assert asked(client, "robots/ur5/compare", body)["verdict"] == "different"
    found = asked(client, "robots/ur5/compare", {**body, "tolerance": {"position": 0.003, "rotation": 0.005}})
    assert found["verdict"] == "close"
    assert 0.0 < found["position"] < 0.003


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "other"),
        ({"other": "ur55"}, "robot"),
        ({"other": described("ur5", convention="craig")}, "other.convention"),
        ({"other": "ur5", "frames": "loose"}, "frames"),
        ({"other": "ur5", "tolerance": {"position": -1, "rotation": 0}}, "tolerance.position"),
        ({"other": "ur5", "tolerance": {"position": 0, "rotation": False}}, "tolerance.rotation"),
    ],
)
def test_bad_input_names_the_field(client, body, field):
    answer = client.post("/api/v1/robots/ur5/compare", json=body)
    assert answer.status_code in (404, 422)
    assert field in answer.text
