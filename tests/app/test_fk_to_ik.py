"""What `fk` prints, `ik` takes: through the command line, REST and CSV, with few digits and with many."""

from __future__ import annotations

import csv
import io
import json
import sys

import numpy as np
import pytest

import kin
from app.cli import parser

# An arm of each number of joints here, all of them in the slow test.
FEW = ("planar2r", "planar3r", "scara", "so101", "ur5", "panda")
DIGITS = (4, 6, 9, 17, "float32")


def poses(name):
    """Two configurations well inside the limits and away from singularities, where rounding leads out of reach."""
    robot = kin.get_robot(name)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    share = np.random.default_rng(8).uniform(0.2, 0.8, (40, robot.n))
    rows = (q for q in low + share * (high - low) if not kin.singularities(robot, q, 0.1))
    return robot, np.array([next(rows), next(rows)])


def rounded(values, digits):
    if digits == "float32":
        return np.float32(values).astype(float).tolist()
    return np.vectorize(lambda x: float(f"{x:.{digits}g}"))(values).tolist()


@pytest.fixture
def run(capsys, monkeypatch):
    """Runs one command and returns its exit code and what it prints."""

    def command(*words, given=""):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(given.encode())))
        code = parser.main([str(word) for word in words])
        return code, capsys.readouterr().out

    return command


def printed(text):
    """The position and the quaternion of the tool in the table that `fk` prints."""
    *_, row = (line.split() for line in text.splitlines() if line.startswith("tool "))
    return [f"{x} mm" for x in row[1:4]], row[4:8]


def check_command_line(name, run):
    robot, configurations = poses(name)
    for q in configurations:
        values = [
            f"{np.degrees(x):.3f}" if turns else f"{x:.4f}m" for x, turns in zip(q, robot.revolute, strict=True)
        ]
        code, out = run("fk", name, "--", *values)
        assert code == 0
        position, wxyz = printed(out)
        code, out = run("ik", name, "--position", *position, "--wxyz", *wxyz)
        assert code == 0, out
        assert out.startswith("Reached"), out
        assert ("rounded" in out) <= (robot.n < 6)


def check_csv(name, run):
    _, configurations = poses(name)
    header = ",".join(f"q{i + 1}" for i in range(configurations.shape[1]))
    given = "\n".join([header, *(",".join(map(repr, q)) for q in configurations.tolist())])
    code, table = run("fk", name, "--configurations", "-", given=given)
    assert code == 0
    header, *rows = list(csv.reader(io.StringIO(table)))
    for digits in DIGITS:
        some = [header[:7], *([str(x) for x in rounded([float(x) for x in row[:7]], digits)] for row in rows)]
        code, out = run("ik", name, "--targets", "-", given="\n".join(map(",".join, some)))
        assert code == 0, out
        assert [row["status"] for row in csv.DictReader(io.StringIO(out))] == ["solved"] * 2, (digits, some)


def check_rest(name, client):
    _, configurations = poses(name)
    for q in configurations.tolist():
        pose = client.post(f"/api/v1/robots/{name}/fk", json={"q": q}).json()["pose"]
        for digits in DIGITS:
            position, wxyz = rounded(pose["position"], digits), rounded(pose["wxyz"], digits)
            for target in ({"position": position, "wxyz": wxyz}, {"matrix": rounded(pose["matrix"], digits)}):
                found = client.post(f"/api/v1/robots/{name}/ik", json={"target": target, "task": "pose"}).json()
                assert found["status"] == "solved", (digits, target, found)
                assert ("rounded" in found["reason"]) == ("target_error" in found.get("tolerances", {}))


@pytest.mark.parametrize("name", FEW)
def test_what_fk_prints_ik_takes(name, run, client):
    check_command_line(name, run)
    check_csv(name, run)
    check_rest(name, client)


@pytest.mark.slow
@pytest.mark.parametrize("name", kin.builtin_robots())
def test_what_fk_prints_ik_takes_of_every_arm(name, run, client):
    check_command_line(name, run)
    check_csv(name, run)
    check_rest(name, client)


def test_the_answer_of_fk_is_a_target(client):
    _, configurations = poses("so101")
    pose = client.post("/api/v1/robots/so101/fk", json={"q": configurations[0].tolist()}).json()["pose"]
    found = client.post("/api/v1/robots/so101/ik", json={"target": json.loads(json.dumps(pose))}).json()
    assert found["status"] == "solved"
