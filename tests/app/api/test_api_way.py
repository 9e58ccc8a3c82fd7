"""REST: ways around obstacles, and ways out of singularities."""

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


WRIST = [0.3, -1.2, 1.4, -0.7, 0.0, 0.2]


def leave(client, body, status=200):
    response = client.post("/api/v1/robots/ur5e/singularity", json=body)
    assert response.status_code == status, response.text
    return response.json()


def test_the_ways_out_are_those_of_the_core(client):
    answer, found = leave(client, {"q": WRIST, "avoid_self_collision": True}), kin.leave_singularity("ur5e", WRIST)
    assert (answer["found"], answer["cause"]) == (True, None)
    assert answer["singularities"][0]["kind"] == "wrist"
    assert answer["reason"] == found.reason
    first, same = answer["exits"][0], found.exits[0]
    assert np.allclose(first["q"], same.q)
    assert np.allclose(first["q"][0], WRIST)
    assert first["sigma"] >= answer["margin"]
    assert (first["posture"], first["keeps_tool"]) == (same.posture, False)
    assert first["translation"] == pytest.approx(same.translation)


def test_a_way_out_may_be_as_the_pendant_shows_it(client):
    shown = [0.0, 0.5, 0.4, 0.0, 0.0, 0.0]
    found = kin.leave_singularity("lrmate200id", kin.motors.from_pendant("lrmate200id", shown))
    response = client.post("/api/v1/robots/lrmate200id/singularity", json={"q": shown, "pendant": True})
    first = response.json()["exits"][0]
    assert np.allclose(first["q"], found.exits[0].q)
    assert np.allclose(first["pendant"], kin.motors.to_pendant("lrmate200id", found.exits[0].q))
    assert np.allclose(first["pendant"][0], shown)
    assert "pendant" not in leave(client, {"q": WRIST})["exits"][0]


def test_a_tool_changes_what_has_to_stay(client):
    plain, long = (
        leave(client, {"q": WRIST, **more})
        for more in ({}, {"tool": {"xyz": [0.0, 0.0, 0.4], "rpy": [0.0, 0.0, 0.0]}})
    )
    assert not np.allclose(plain["exits"][0]["q"][-1], long["exits"][0]["q"][-1], atol=1e-3)


def test_where_there_is_none_the_cause_says_why(client):
    clear = leave(client, {"q": kin.get_robot("ur5e").q_home.tolist()})
    assert (clear["found"], clear["exits"], clear["cause"]["code"]) == (False, [], "clear")
    outside = leave(client, {"q": [*WRIST[:5], 9.0]})
    assert [each["joint"] for each in outside["cause"]["violations"]] == [5]
    far = leave(client, {"q": WRIST, "margin": 0.9})
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
def test_what_is_malformed_of_a_singularity_is_refused_by_its_field(client, change, field):
    errors = leave(client, {"q": WRIST, **change}, 422)["errors"]
    assert errors[0]["field"].startswith(field)
