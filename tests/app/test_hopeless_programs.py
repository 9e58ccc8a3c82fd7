"""Programs that no arm can drive, and texts that are no programs, in Python, over REST and on the command line.

All three say the same words and name the place, and keep what can be driven. The tab *Program* is tested in
``viewer/tabs/program``.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass

import numpy as np
import pytest

import kin
from app.cli import parser
from kin.motion.program import MOST_POINTS, MOST_SEGMENTS
from kin.way import find_way

UR5 = kin.get_robot("ur5")
HOME = np.round(UR5.q_home, 2).tolist()
NEAR, AWAY = ([round(HOME[0] + turn, 2), *HOME[1:]] for turn in (0.4, 1.5))
PTP = {"kind": "ptp", "q": NEAR}


def ball(q: list[float]) -> dict[str, object]:
    """A ball around the tool at a configuration."""
    return {"shape": "sphere", "xyz": kin.fk(UR5, q)[:3, 3].tolist(), "radius": 0.1, "name": "ball"}


def obstacles(rows: list[dict[str, object]]) -> list[kin.Obstacle]:
    return [kin.Obstacle(**row) for row in rows]  # type: ignore[arg-type]


@pytest.fixture
def run(capsys, tmp_path):
    """Runs a command with obstacles: its exit code, and what it prints."""

    def command(name, *words, bodies=()):
        file = tmp_path / "obstacles.toml"
        file.write_text("".join(f"[[obstacles]]\n{toml(body)}" for body in bodies) or "obstacles = []")
        code = parser.main([name, "ur5", *map(str, words), "--obstacles", str(file)])
        out, err = capsys.readouterr()
        return code, out + err

    return command


def toml(table: dict[str, object]) -> str:
    return "".join(f"{key} = {json.dumps(value)}\n" for key, value in table.items())


@dataclass(frozen=True)
class Hopeless:
    """A program that cannot be driven: the number of the segment at fault, words about it, and what is driven."""

    segments: list[dict[str, object]]
    number: int
    words: str
    driven: int
    bodies: tuple[dict[str, object], ...] = ()


HOPELESS = {
    "a path outside the workspace": Hopeless(
        [PTP, {"kind": "lin", "position": [9.0, 0.0, 0.3]}], 2, "out of reach by", 2
    ),
    "a start that touches": Hopeless([PTP], 1, "touches ball", 0, (ball(HOME),)),
    "a goal inside an obstacle": Hopeless([PTP, {"kind": "ptp", "q": AWAY}], 2, "touches ball", 1, (ball(AWAY),)),
}


@pytest.mark.parametrize("case", HOPELESS.values(), ids=HOPELESS)
def test_a_program_that_cannot_be_driven_is_an_answer_with_its_place_that_keeps_what_can(
    client, run, tmp_path, case
):
    motion = kin.plan_motion(UR5, {"segments": case.segments}, obstacles=obstacles(case.bodies))
    assert not motion.planned
    assert motion.refusal.segment == case.number - 1
    assert motion.reason.startswith(f"Segment {case.number} (")
    assert case.words in motion.reason
    duration = 0.0 if motion.driven is None else motion.driven.duration
    assert (duration > 0.0) == (case.driven > 0)
    if duration:
        q = motion.driven.derivatives(np.linspace(0.0, duration, 500))[0]
        assert len(motion.driven.segments) >= case.driven
        assert not case.bodies or kin.clearance(UR5, q, obstacles(case.bodies)).min() > -1e-9

    body = {"program": {"segments": case.segments}, "obstacles": list(case.bodies)}
    answer = client.post("/api/v1/robots/ur5/motion", json=body).json()
    assert (answer["planned"], answer["reason"]) == (False, motion.reason)
    assert answer["refusal"]["segment"] == case.number - 1
    assert (0.0 if answer["part"] is None else answer["part"]["duration"]) == pytest.approx(duration)

    file = tmp_path / "program.json"
    file.write_text(json.dumps({"segments": case.segments}))
    code, said = run("move", file, bodies=case.bodies)
    assert code == 1
    assert motion.reason in said
    code, said = run("move", file, "--json", bodies=case.bodies)
    assert (code, json.loads(said)["reason"]) == (1, motion.reason)


NO_PROGRAMS = {
    "no speed": ([{**PTP, "speed": 0}], "segments[0].speed"),
    "no acceleration": ([PTP, {**PTP, "acceleration": 0}], "segments[1].acceleration"),
    "no speed of the tool": ([PTP, {**PTP, "tool_speed": 0}], "segments[1].tool_speed"),
    "no turn of the tool": ([{**PTP, "tool_turn": 0}], "segments[0].tool_turn"),
    "ten thousand waypoints": ([PTP] * 10_000, "segments"),
    "ten thousand points of a spline": (
        [{"kind": "spline", "points": [{"q": HOME}] * 10_000}],
        "segments[0].points",
    ),
}


@pytest.mark.parametrize(("segments", "field"), NO_PROGRAMS.values(), ids=NO_PROGRAMS)
def test_limits_of_zero_and_ten_thousand_waypoints_are_refused_by_their_field(
    client, run, tmp_path, segments, field
):
    program = {"segments": segments}
    with pytest.raises(kin.InputError) as caught:
        kin.plan_motion(UR5, program)
    assert caught.value.field == field
    if field.endswith("s"):
        most = MOST_POINTS if "points" in field else MOST_SEGMENTS
        assert re.search(rf"got '10000 \w+', expected 1 to {most} ", str(caught.value))

    response = client.post("/api/v1/robots/ur5/motion", json={"program": program})
    assert response.status_code in (413, 422)
    (error,) = response.json()["errors"]
    assert error["field"] == f"program.{field}"

    file = tmp_path / "program.json"
    file.write_text(json.dumps(program))
    code, said = run("move", file)
    assert code == 2
    assert f"{field}: got " in said
    assert len(said) < 1000


@pytest.mark.parametrize("limit", ["velocity", "acceleration", "jerk"])
def test_an_arm_with_a_limit_of_zero_is_refused_by_its_joint(client, capsys, tmp_path, limit):
    arm = kin.robot_to_dict(UR5)
    arm["rows"][1][limit] = 0.0
    with pytest.raises(kin.RobotFileError, match=rf"rows\[1\]\.{limit}: got 0\.0, expected a positive number"):
        kin.robot_from_dict(arm)
    body = {"robot": arm, "program": {"segments": [PTP]}}
    response = client.post("/api/v1/motion", json=body)
    assert response.status_code == 422
    assert response.json()["errors"][0]["field"] == f"robot.rows[1].{limit}"
    robot, program = tmp_path / "arm.toml", tmp_path / "program.json"
    rows = kin.robot_to_toml(UR5).split("[[rows]]")
    rows[2] = re.sub(rf"\n{limit} = .*", "", rows[2]).replace("\n", f"\n{limit} = 0.0\n", 1)
    robot.write_text("[[rows]]".join(rows))
    program.write_text(json.dumps({"segments": [PTP]}))
    assert parser.main(["move", str(robot), str(program)]) == 2
    assert f"rows[1].{limit}: got 0.0, expected a positive number" in capsys.readouterr().err


WAYS = {
    "start touches": (HOME, AWAY, ball(HOME), "The start touches something: "),
    "goal touches": (HOME, AWAY, ball(AWAY), "The goal touches something: link 6 touches ball."),
    "start outside": ([9.0, *HOME[1:]], AWAY, ball(AWAY), "The start is outside the limits: joint 1"),
    "goal outside": (HOME, [9.0, *HOME[1:]], ball(AWAY), "The goal is outside the limits: joint 1"),
}


@pytest.mark.parametrize("code", WAYS)
def test_a_way_that_cannot_be_is_an_answer_and_no_program_is_written(client, run, tmp_path, code):
    start, goal, body, words = WAYS[code]
    way = find_way(UR5, start, goal, obstacles=obstacles([body]), avoid_self_collision=True)
    assert (way.found, way.cause.code) == (False, code)
    assert way.reason.startswith(words)
    asked = {"q_start": start, "q_goal": goal, "obstacles": [body], "avoid_self_collision": True}
    answer = client.post("/api/v1/robots/ur5/way", json=asked).json()
    assert (answer["found"], answer["cause"]["code"], answer["reason"]) == (False, code, way.reason)
    file = tmp_path / "way.toml"
    degrees = [np.degrees(q).tolist() for q in (start, goal)]
    got, said = run("way", "--start", *degrees[0], "--goal", *degrees[1], "-o", file, bodies=[body])
    assert (got, file.exists()) == (1, False)
    assert way.reason in said


@pytest.mark.full
def test_postures_along_a_path_outside_the_workspace_are_an_answer_and_ten_thousand_places_are_too_many(client):
    T = np.repeat(kin.fk(UR5, HOME)[None], 5, axis=0)
    T[:, 0, 3] += 9.0
    found = kin.path.path_postures(UR5, T)
    assert found.through == ()
    assert found.reason == "The arm cannot be at the first place of the path in any posture."
    assert (found.states == kin.path.postures.STATES.index("none")).all()
    body = {"targets": [{"matrix": pose.tolist()} for pose in T]}
    assert client.post("/api/v1/robots/ur5/ik/path/postures", json=body).json()["reason"] == found.reason
    many = {"targets": [{"position": [0.4, 0.1, 0.3]}] * 10_000}
    response = client.post("/api/v1/robots/ur5/ik/path/postures", json=many)
    assert response.status_code == 413
    (error,) = response.json()["errors"]
    assert (error["field"], "10000" in error["value"]) == ("targets", True)
