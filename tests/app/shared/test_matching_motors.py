"""Matching motors over REST and on the command line: what they find is what the arm was made with."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import kin
from app.api.arms.motors import EXAMPLES
from app.cli.parser import main
from app.service.main import create_app
from app.shared.settings import Settings

SO101 = kin.get_robot("so101")
POSES = kin.motors.motor_poses(SO101)
# Two motors of the real arm count backwards, and all zeros are elsewhere.
REAL = tuple(
    replace(motor, sign=-1 if motor.id in (2, 5) else 1, offset=20.0 * motor.id - 50.0) if motor.joint else motor
    for motor in SO101.motors
)
READINGS = kin.motors.readings_from_q(replace(SO101, motors=REAL), POSES).round(2).tolist()


@pytest.fixture(scope="module")
def client():
    return TestClient(create_app(Settings()))


def asked(client: TestClient, path: str, body: dict[str, Any], status: int = 200) -> dict[str, Any]:
    answer = client.post(f"/api/v1/{path}", json=body)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_signs_and_zeros_are_found(client):
    found = asked(client, "robots/so101/motors/match", {"q": POSES.tolist(), "readings": READINGS})
    assert found["complete"] is True
    assert [motor["sign"] for motor in found["motors"]] == [motor.sign for motor in REAL]
    assert [motor["offset"] for motor in found["motors"]] == pytest.approx([m.offset for m in REAL], abs=0.02)
    assert found["findings"][1]["text"] == "Motor 2, shoulder lift, counts backwards, its zero is at −10.0°."


def test_motors_and_arm_may_be_sent_along(client):
    arm = {**kin.robot_to_dict(kin.get_robot("planar2r"))}
    body = {
        "robot": arm,
        "motors": [{"joint": "shoulder", "id": 1}, {"joint": "elbow", "id": 2}],
        "q": np.radians([[0, 0], [40, 60]]).tolist(),
        "readings": [[91, 10], [50, 71]],
    }
    found = asked(client, "motors/match", body)
    assert [motor["sign"] for motor in found["motors"]] == [-1, 1]
    still = asked(client, "motors/match", {**body, "readings": [[91, 10], [91, 71]]})
    assert still["complete"] is False
    assert (still["findings"][0]["status"], still["findings"][0]["cause"]) == ("contradiction", "no change")
    swapped = asked(client, "motors/match", {**body, "readings": [[10, 91], [71, 50]]})
    assert (swapped["findings"][0]["cause"], swapped["findings"][0]["other"]) == ("other motor", 2)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_example_of_the_document_is_answered(client, name):
    found = asked(client, "robots/pioneer5/motors/match", EXAMPLES[name]["value"])
    assert found["complete"] is True
    assert found["findings"][0]["motor"]["sign"] == -1


@pytest.mark.parametrize(
    ("change", "field", "expected"),
    [
        ({"q": POSES.tolist()[:1]}, "q", "at least 2"),
        ({"q": [[0.0], [1.0]]}, "q[0]", "5 values"),
        ({"readings": READINGS[:2]}, "readings", "two poses or more"),
        ({"readings": [[1.0, 2.0]] * 3}, "readings", "5"),
        ({"readings": [[1.0], [1.0, 2.0], [1.0]]}, "readings", "5"),
        ({"motors": []}, "motors", "an arm with motors"),
        ({"motors": [{"joint": "nobody", "id": 1}]}, "motors[0].joint", "shoulder pan"),
        ({"motors": [{"joint": "shoulder pan", "id": -1}]}, "motors[0].id", "0"),
        ({"motors": "x"}, "motors", "list"),
        ({"tolerance": 0.0}, "tolerance", "0"),
        ({"unknown": 1}, "unknown", ""),
    ],
)
def test_what_does_not_fit_is_named(client, change, field, expected):
    body = {"q": POSES.tolist(), "readings": READINGS, **change}
    problem = asked(client, "robots/so101/motors/match", body, 422)
    assert problem["errors"][0]["field"] == field, problem
    assert expected in problem["errors"][0]["expected"]


# The command line


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = main(["motors", *words])
    out, err = capsys.readouterr()
    return code, out, err


def texts(rows: list[list[float]]) -> list[str]:
    return [word for row in rows for word in ("--read", *map(str, row))]


def test_the_command_proposes_poses_and_finds_the_motors(capsys, tmp_path):
    code, out, _ = said(capsys, "so101", "--json")
    assert code == 0
    assert json.loads(out)["q"] == POSES.tolist()
    file = tmp_path / "mine.toml"
    code, out, _ = said(capsys, "so101", *texts(READINGS), "-o", str(file))
    assert code == 0
    assert "Motor 2, shoulder lift, counts backwards, its zero is at −10.0°." in out
    made = kin.load_robot(Path(file))
    assert [motor.sign for motor in made.motors] == [motor.sign for motor in REAL]
    code, out, _ = said(capsys, "so101", *texts(READINGS[:2]), "--json")
    assert (code, json.loads(out)["complete"]) == (0, True)
    wrong = [READINGS[0], [READINGS[0][0], *READINGS[1][1:]], READINGS[2]]
    code, out, _ = said(capsys, "so101", *texts(wrong))
    assert code == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["so101", "--read", "1", "2"], "--read"),
        (["so101", "--read", "nan", "0", "0", "0", "0"], "--read: got 'nan'"),
        (["so101", "--pose", "0", "0", "--read", "1"], "--pose: got '2 values'"),
        (["so101", "--pose", *"00000", "--read", *"00000", "--read", *"00000"], "as many as --pose: 1"),
        (["so101", *texts(READINGS * 2)], "2 or 3"),
        (["ur5"], "motors"),
    ],
)
def test_what_the_command_cannot_use_is_named(capsys, words, message):
    code, _, err = said(capsys, *words)
    assert code == 2
    assert message in err
