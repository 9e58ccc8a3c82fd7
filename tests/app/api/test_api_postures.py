"""REST: posture maps, and whether an arm is cuspidal."""

from __future__ import annotations

import numpy as np
import pytest

import kin


def get(client, address, status=200):
    response = client.get(f"/api/v1/robots/{address}")
    assert response.status_code == status, response.text
    return response.json()


def test_a_cuspidal_arm_is_answered_with_its_loop(client):
    answer = get(client, "gofa/cuspidal?seed=2")
    found = kin.cuspidal("gofa", seed=2)
    assert (answer["verdict"], answer["evidence"], answer["in_limits"]) == ("yes", "loop", True)
    assert np.allclose(answer["loop"], found.loop)
    assert answer["reason"] == found.reason


def test_locks_make_an_arm_of_seven_joints_one_of_six(client):
    assert get(client, "panda/cuspidal?lock=7:0.8")["evidence"] == "stages"
    refused = get(client, "panda/cuspidal", 422)
    assert refused["errors"][0]["field"] == "robot"
    assert "3, 5 or 6" in refused["errors"][0]["expected"]


def test_an_arm_may_be_sent_along(client):
    robot = kin.robot_to_dict(kin.get_robot("puma560"))
    response = client.post("/api/v1/cuspidal", json={"robot": robot, "poses": 64})
    assert response.status_code == 200, response.text
    assert response.json()["evidence"] == "factors"


@pytest.mark.parametrize(("query", "field"), [("poses=0", "poses"), ("poses=99999", "poses"), ("seed=-1", "seed")])
def test_what_is_out_of_range_is_named(client, query, field):
    assert get(client, f"ur5/cuspidal?{query}", 422)["errors"][0]["field"] == field


def post(client, body, status=200, arm="ur5"):
    response = client.post(f"/api/v1/robots/{arm}/postures", json=body)
    assert response.status_code == status, response.text
    return response


def test_a_map_of_a_section_is_that_of_the_core(client):
    target = {"position": [0.4, 0.1, 0.3], "rpy": [0.4, 0.9, -0.3]}
    answer = post(client, {"target": target, "normal": [0, 0, 1], "resolution": 12}).json()
    pose = kin.pose_from_xyz_rpy([0.4, 0.1, 0.3], [0.4, 0.9, -0.3])
    found = kin.posture_map("ur5", pose, normal=[0.0, 0.0, 1.0], resolution=12)
    assert answer["counts"] == found.counts.tolist()
    assert np.allclose(answer["rotation"], pose[:3, :3])
    assert (answer["joints"], answer["q"]) == (None, None)
    assert answer["reason"] == found.reason
    assert [each["name"] for each in answer["regions"]] == [each.name for each in found.regions]


def test_a_map_of_two_joints(client):
    answer = post(client, {"joints": [2, 4], "resolution": 10, "respect_limits": False}).json()
    assert answer["joints"] == [2, 4]
    assert np.allclose(answer["q"], kin.get_robot("ur5").q_home)
    assert (answer["origin"], answer["rotation"]) == (None, None)


@pytest.mark.parametrize(
    ("kind", "media_type", "begin"),
    [("svg", "image/svg+xml", b"<svg"), ("png", "image/png", b"\x89PNG"), ("csv", "text/csv", b"x,y,postures\n")],
)
def test_a_map_as_a_file(client, kind, media_type, begin):
    response = post(client, {"resolution": 10, "format": kind})
    assert response.headers["content-type"].startswith(media_type)
    assert response.content.startswith(begin)
    assert f"ur5-postures.{kind}" in response.headers["content-disposition"]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"resolution": 5000}, "resolution"),
        ({"resolution": "12"}, "resolution"),
        ({"joints": [1, 1]}, "joints"),
        ({"joints": [1, 2], "normal": [0, 0, 1]}, "joints"),
        ({"normal": [0, 0, 0]}, "normal"),
        ({"format": "gif"}, "format"),
        ({"target": {"position": [0.4, 0.1, 0.3]}}, "target"),
        ({"target": {"position": [0.4, 0.1, 0.3], "rpy": [0, 0, 0], "frame": "base"}}, "target.frame"),
        ({"target": {"position": [0.4, 0.1, 0.3], "rpy": [0, 0, 0], "frame": "tool"}}, "target.frame"),
        ({"target": {"position": [0.0, 0.0, 9.0], "rpy": [0, 0, 0]}, "normal": [0, 0, 1]}, "target"),
    ],
)
def test_what_cannot_be_mapped_is_named(client, body, field):
    assert post(client, body, 422).json()["errors"][0]["field"].startswith(field)
