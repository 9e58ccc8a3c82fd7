"""Values on the pendant at the doors: REST and the command line read and print the same."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.cli.parser import main

ROBOT = kin.get_robot("lrmate200id")
SHOWN = [0.0, 30.0, 0.0, 0.0, -90.0, 0.0]  # degrees, as on FANUC's pendant
Q = kin.motors.from_pendant(ROBOT, np.radians(SHOWN))


def test_rest_reads_and_answers_values_of_the_pendant(client: TestClient) -> None:
    url = "/api/v1/robots/lrmate200id"
    asked = {"q": np.radians([SHOWN, SHOWN]).tolist(), "pendant": True}
    found = client.post(f"{url}/fk", json=asked).json()["results"][1]["pose"]
    assert found["matrix"] == pytest.approx(kin.fk(ROBOT, Q), abs=1e-12)
    target = {"position": found["position"], "wxyz": found["wxyz"]}
    asked = {"target": target, "task": "pose", "q_seed": np.radians(SHOWN).tolist(), "pendant": True}
    first = client.post(f"{url}/ik", json=asked).json()["solutions"][0]
    assert first["q"] == pytest.approx(Q, abs=1e-9)
    assert first["pendant"] == pytest.approx(np.radians(SHOWN), abs=1e-9)
    several = client.post(f"{url}/ik", json={**asked, "target": [target, target]}).json()["results"]
    assert [each["solutions"][0]["pendant"] for each in several] == [first["pendant"]] * 2
    plain = client.post(f"{url}/ik", json={**asked, "pendant": False}).json()["solutions"][0]
    assert "pendant" not in plain


def test_a_sent_arm_brings_its_pendant_and_what_follows(client: TestClient) -> None:
    robot = kin.robot_to_dict("palletiser") | {"pendant": {"forearm": {"forearm": -1, "offset": 5}}}
    asked = {"robot": robot, "q": [0.1, 0.2, 0.3, 0.4], "pendant": True}
    found = client.post("/api/v1/fk", json=asked).json()["pose"]["matrix"]
    q = [0.1, 0.2, np.radians(5.0) - 0.3, 0.4]
    assert found == pytest.approx(kin.fk("palletiser", q), abs=1e-12)
    robot["rows"][2]["follows"] = "arm"
    refused = client.post("/api/v1/fk", json=asked)
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "robot.rows[2].follows"


def test_the_command_line_reads_and_prints_values_of_the_pendant(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", "lrmate200id", "--pendant", *map(str, SHOWN)]) == 0
    lines = capsys.readouterr().out.splitlines()
    third = next(line for line in lines if line.startswith("J3"))
    assert third.split() == ["J3", "0.000°", "-100.000°", "…", "175.000°"], "its limits at 30° of J2"
    T = kin.fk(ROBOT, Q)
    position, wxyz = T[:3, 3] * 1000.0, kin.wxyz_from_rotation(T[:3, :3])
    place = ["--position", *map(repr, position.tolist()), "--wxyz", *map(repr, wxyz.tolist())]
    main(["ik", "lrmate200id", "--pendant", *place, "--seed", *map(str, SHOWN)])
    assert capsys.readouterr().out.splitlines()[3].split()[:7] == ["1", *(f"{x:.3f}°" for x in SHOWN)]
    main(["ik", "lrmate200id", "--pendant", *place, "--seed", *map(str, SHOWN), "--json"])
    first = json.loads(capsys.readouterr().out)["solutions"][0]
    assert first["pendant"] == pytest.approx(kin.motors.to_pendant(ROBOT, first["q"]), abs=1e-12)


def test_the_table_of_an_arm_says_what_follows(capsys: pytest.CaptureFixture[str]) -> None:
    main(["robots", "palletiser"])
    assert "revolute, -1 × forearm" in capsys.readouterr().out
