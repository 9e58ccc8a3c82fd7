"""REST: ways around obstacles."""

from __future__ import annotations

import numpy as np
import pytest
from versions import needs_ompl

import kin

UR5 = kin.get_robot("ur5")
GOAL = (UR5.q_home + np.array([2.2, 0.0, 0.0, 0.0, 0.0, 0.0])).tolist()
MIDDLE = kin.fk(UR5, 0.5 * (UR5.q_home + GOAL))[:3, 3].tolist()
POST = {"shape": "box", "xyz": MIDDLE, "size": [0.12, 0.12, 0.9], "name": "post"}
BODY = {"q_goal": GOAL, "obstacles": [POST], "avoid_self_collision": True, "time_limit": 10.0, "seed": 3}


def post(client, body, status=200):
    response = client.post("/api/v1/robots/ur5/way", json=body)
    assert response.status_code == status, response.text
    return response.json()


@needs_ompl
def test_a_way_comes_with_a_program_that_motion_drives_without_touching(client):
    answer = post(client, BODY)
    assert answer["found"], answer["reason"]
    q = np.array(answer["q"])
    assert np.allclose(q[0], UR5.q_home)
    assert np.allclose(q[-1], GOAL)
    assert answer["motion"]["planned"]
    asked = {"program": answer["program"], "obstacles": [POST], "avoid_self_collision": True, "rate": 200}
    motion = client.post("/api/v1/robots/ur5/motion", json=asked).json()
    assert motion["planned"], motion["reason"]
    assert motion["duration"] == pytest.approx(answer["motion"]["duration"])
    post_ = kin.Obstacle("box", tuple(MIDDLE), size=(0.12, 0.12, 0.9))
    assert kin.clearance(UR5, np.array(motion["samples"]["q"]), [post_]).min() > -1e-9
    assert post(client, BODY)["q"] == answer["q"], "the same seed"


@needs_ompl
def test_what_cannot_be_is_an_answer(client):
    ball = {"shape": "sphere", "xyz": kin.fk(UR5, GOAL)[:3, 3].tolist(), "radius": 0.1, "name": "ball"}
    inside = post(client, {**BODY, "obstacles": [ball]})
    assert (inside["found"], inside["q"], inside["program"], inside["motion"]) == (False, None, None, None)
    assert (inside["cause"]["code"], inside["cause"]["contact"]["text"]) == ("goal touches", "link 6 touches ball")
    late = post(client, {**BODY, "time_limit": 1e-6})
    assert late["cause"]["code"] == "time"
    assert "That does not mean that there is none" in late["reason"]
    outside = post(client, {"q_goal": [9.0, *GOAL[1:]]})
    assert [each["joint"] for each in outside["cause"]["violations"]] == [0]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"time_limit": 0}, "time_limit"),
        ({"time_limit": 1e9}, "time_limit"),
        ({"seed": -1}, "seed"),
        ({"q_goal": GOAL[:3]}, "q_goal"),
        ({"q_goal": None}, "q_goal"),
        ({"q_goal": None, "T_goal": [[1.0]]}, "T_goal"),
        ({"obstacles": [{"shape": "cone"}]}, "obstacles[0].shape"),
        ({"speed": 1}, "speed"),
    ],
)
def test_what_is_malformed_is_refused_by_its_field(client, change, field):
    errors = post(client, {**BODY, **change}, 422)["errors"]
    assert errors[0]["field"].startswith(field)
