"""Collisions over REST and on the command line."""

from __future__ import annotations

import json

import pytest
from fastapi.testclient import TestClient

import kin
from app.cli.parser import main

UR5 = kin.get_robot("ur5")
T = kin.fk(UR5, UR5.q_home)
TARGET = {"matrix": T.tolist()}
CRATE = {"shape": "box", "xyz": T[:3, 3].tolist(), "size": [0.3, 0.3, 0.3], "name": "crate"}


def test_ik_says_what_touches(client: TestClient) -> None:
    url = "/api/v1/robots/ur5/ik"
    blocked = client.post(url, json={"target": [TARGET, TARGET], "obstacles": [CRATE]}).json()["results"]
    for answer in blocked:
        assert (answer["status"], answer["cause"], answer["solutions"]) == ("collision", "obstacle", [])
        assert answer["details"]["contact"]["obstacle"] == 0
        assert "crate" in answer["reason"]
        assert answer["closest"]["position_error"] < 1e-9
    free = client.post(url, json={"target": TARGET, "avoid_self_collision": True}).json()
    assert free["status"] == "solved"
    details, every = free["details"], kin.solve_ik(UR5, T).solutions
    assert details.get("touching", 0) + details["configurations"] == len(every)


@pytest.mark.full
def test_paths_and_motions_are_checked(client: TestClient) -> None:
    path = client.post("/api/v1/robots/ur5/ik/path", json={"targets": [TARGET], "obstacles": [CRATE]}).json()
    assert path["gaps"][0]["status"] == "collision"
    assert path["contacts"][0]["contact"]["text"].endswith("touches crate")
    body = {"targets": [TARGET], "avoid_self_collision": True}
    clear = client.post("/api/v1/robots/ur5/ik/path", json=body).json()
    assert clear["contacts"] == []
    program = {"segments": [{"kind": "ptp", "q": UR5.q_home.tolist()}, {"kind": "dwell", "seconds": 0.1}]}
    start = (UR5.q_home + 0.8).tolist()
    body = {"program": program, "q_start": start, "obstacles": [CRATE], "samples": False}
    refused = client.post("/api/v1/robots/ur5/motion", json=body).json()
    assert refused["refusal"]["cause"] == "collision"
    assert refused["refusal"]["details"]["time"] > 0.0
    assert refused["refusal"]["details"]["contact"]["obstacle"] == 0


@pytest.mark.parametrize(
    ("obstacle", "field", "value"),
    [
        ({"shape": "cone"}, "obstacles[0].shape", '"cone"'),
        ({"shape": "box"}, "obstacles[0].size", "None"),
        ({"shape": "box", "size": [300, 300, 400]}, "obstacles[0].size[0]", "300.0"),
        ({"shape": "sphere", "radius": -1}, "obstacles[0].radius", "-1.0"),
        ({"shape": "sphere", "radius": 1, "color": "red"}, "obstacles[0].color", '"red"'),
    ],
)
def test_malformed_obstacles_are_refused(client: TestClient, obstacle, field, value) -> None:
    answer = client.post("/api/v1/robots/ur5/ik", json={"target": TARGET, "obstacles": [obstacle]})
    assert answer.status_code == 422
    assert (field, value) in [(each["field"], each["value"]) for each in answer.json()["errors"]]


def test_inspect_lists_the_bodies(client: TestClient) -> None:
    stated = client.get("/api/v1/robots/ur5/inspect").json()["bodies"]
    assert not stated["assumed"]
    assert len(stated["capsules"]) == len(UR5.capsules)
    assert [2, 4] in stated["compared"]
    assert client.get("/api/v1/robots/pioneer5/inspect").json()["bodies"]["assumed"]


def test_the_command_line_takes_obstacles(tmp_path, capsys) -> None:
    file = tmp_path / "cell.toml"
    x, y, z = CRATE["xyz"]
    file.write_text(
        f'[[obstacles]]\nshape = "sphere"\nname = "ball"\nradius = 0.2\nxyz = [{x}, {y}, {z}]\n', "utf-8"
    )
    position = [str(1000.0 * value) for value in (x, y, z)]
    command = ["ik", "ur5", "--position", *position, "--json", "--obstacles", str(file)]
    assert main(command) == 1
    assert json.loads(capsys.readouterr().out)["status"] == "collision"
