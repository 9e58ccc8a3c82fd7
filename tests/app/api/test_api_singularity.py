"""REST: the way out of a singularity."""

from __future__ import annotations

import numpy as np
import pytest

import kin

WRIST = [0.3, -1.2, 1.4, -0.7, 0.0, 0.2]


def post(client, body, status=200):
    response = client.post("/api/v1/robots/ur5e/singularity", json=body)
    assert response.status_code == status, response.text
    return response.json()


def test_the_ways_out_are_those_of_the_core(client):
    answer, found = post(client, {"q": WRIST, "avoid_self_collision": True}), kin.leave_singularity("ur5e", WRIST)
    assert (answer["found"], answer["cause"]) == (True, None)
    assert answer["singularities"][0]["kind"] == "wrist"
    assert answer["reason"] == found.reason
    first, same = answer["exits"][0], found.exits[0]
    assert np.allclose(first["q"], same.q)
    assert np.allclose(first["q"][0], WRIST)
    assert first["sigma"] >= answer["margin"]
    assert (first["posture"], first["keeps_tool"]) == (same.posture, False)
    assert first["translation"] == pytest.approx(same.translation)


def test_a_tool_changes_what_has_to_stay(client):
    plain, long = (
        post(client, {"q": WRIST, **more})
        for more in ({}, {"tool": {"xyz": [0.0, 0.0, 0.4], "rpy": [0.0, 0.0, 0.0]}})
    )
    assert not np.allclose(plain["exits"][0]["q"][-1], long["exits"][0]["q"][-1], atol=1e-3)


def test_where_there_is_none_the_cause_says_why(client):
    clear = post(client, {"q": kin.get_robot("ur5e").q_home.tolist()})
    assert (clear["found"], clear["exits"], clear["cause"]["code"]) == (False, [], "clear")
    outside = post(client, {"q": [*WRIST[:5], 9.0]})
    assert [each["joint"] for each in outside["cause"]["violations"]] == [5]
    far = post(client, {"q": WRIST, "margin": 0.9})
    assert far["cause"]["code"] == "margin"
    assert 0.1 < far["cause"]["largest"] < 0.9


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"q": WRIST[:3]}, "q"),
        ({"q": [WRIST]}, "q"),
        ({"margin": 0}, "margin"),
        ({"margin": "far"}, "margin"),
        ({"obstacles": [{"shape": "cone"}]}, "obstacles[0].shape"),
        ({"speed": 1}, "speed"),
    ],
)
def test_what_is_malformed_is_refused_by_its_field(client, change, field):
    errors = post(client, {"q": WRIST, **change}, 422)["errors"]
    assert errors[0]["field"].startswith(field)
