"""REST: motions of programs, as JSON, tables, streams and code, and why some cannot be driven."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest

import kin
from app.api import motion as motion_module
from app.exports.motion import FORMATS
from kin.motion.tables import AT_ONCE, columns

UR5 = kin.get_robot("ur5")
Q = [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]
PROGRAM = {
    "name": "pick",
    "segments": [
        {"kind": "ptp", "q": Q, "name": "above"},
        {"kind": "dwell", "seconds": 0.25},
        {"kind": "ptp", "q": [0.5, -1.2, 1.4, 0.2, 1.2, 0.1], "speed": 0.5},
    ],
}
EXPECTED = kin.plan_motion(UR5, PROGRAM)


def post(client, body, status=200, path="robots/ur5/motion"):
    response = client.post(f"/api/v1/{path}", json={"program": PROGRAM, **body})
    assert response.status_code == status, response.text
    return response


def test_a_motion_is_that_of_the_core(client):
    answer = post(client, {"rate": 50}).json()
    assert (answer["planned"], answer["refusal"], answer["reason"]) == (True, None, EXPECTED.reason)
    assert answer["duration"] == pytest.approx(EXPECTED.duration)
    assert [each["kind"] for each in answer["segments"]] == ["ptp", "dwell", "ptp"]
    assert [each["name"] for each in answer["segments"]] == ["above", "", ""]
    peaks = [peak for peak in answer["peaks"] if peak["joint"] is not None]
    assert len(peaks) == 18
    assert all(peak["ratio"] <= 1 + 1e-9 for peak in peaks)
    assert answer["limits"][0]["velocity"] == pytest.approx(EXPECTED.limits.velocity[0])
    samples = answer["samples"]
    times = EXPECTED.step_times(50)
    assert samples["t"] == times.tolist()
    assert samples["t"][-1] == pytest.approx(answer["duration"])
    expected = EXPECTED.sample(times)
    assert np.allclose(samples["q"], expected.q, atol=1e-12)
    assert np.allclose(samples["qdd"], expected.qdd, atol=1e-9)
    assert np.allclose(samples["position"], expected.T[:, :3, 3], atol=1e-12)
    assert "samples" not in post(client, {"samples": False}).json()


def test_the_same_arm_sent_along_has_the_same_motion(client):
    sent = {"robot": kin.robot_to_dict(UR5), "rate": 20}
    assert post(client, sent, path="motion").json() == post(client, {"rate": 20}).json()


def test_poses_of_a_motion_are_those_of_the_tool_and_base_of_the_request(client):
    frames = {"base": {"xyz": [0, 0, 0.5]}, "tool": {"xyz": [0, 0, 0.1]}}
    answer = post(client, {**frames, "rate": 10, "q_start": Q}).json()["samples"]
    tool = UR5.T_last_tool @ kin.pose_from_xyz_rpy([0, 0, 0.1])
    arm = UR5.with_base(kin.pose_from_xyz_rpy([0, 0, 0.5])).with_tool(tool)
    assert answer["q"][0] == Q
    assert np.allclose(answer["position"][0], kin.fk(arm, np.array(Q))[:3, 3], atol=1e-12)


def test_units_of_a_program_are_its_own(client):
    program = {"units": {"angle": "deg"}, "segments": [{"kind": "ptp", "q": [0, -90, 90, 0, 90, 0]}]}
    answer = post(client, {"program": program}).json()
    assert np.allclose(answer["samples"]["q"][-1], np.radians([0, -90, 90, 0, 90, 0]), atol=1e-12)


def test_tables_and_streams_hold_the_samples(client):
    rate = 400.0
    times = EXPECTED.step_times(rate)
    assert len(times) > AT_ONCE, "more than one chunk"
    expected = EXPECTED.sample(times)
    response = post(client, {"rate": rate, "format": "csv"})
    assert response.headers["content-type"].startswith("text/csv")
    assert response.headers["content-disposition"] == 'attachment; filename="ur5-motion.csv"'
    head, *rows = csv.reader(io.StringIO(response.text))
    assert head == columns(EXPECTED.robot.n)
    values = np.array(rows, float)
    assert np.allclose(values[:, 0], times, atol=1e-12)
    assert np.allclose(values[:, 1:7], expected.q, atol=1e-12)
    assert np.allclose(values[:, -1], expected.tool_speed, atol=1e-9)
    lines = [json.loads(line) for line in post(client, {"rate": rate, "format": "ndjson"}).text.splitlines()]
    assert lines[0] == post(client, {"samples": False}).json()
    assert np.allclose([line["q"] for line in lines[1:]], expected.q, atol=1e-12)
    assert np.allclose([line["position"] for line in lines[1:]], expected.T[:, :3, 3], atol=1e-12)


@pytest.mark.parametrize("form", ["csv", "ndjson"])
def test_one_request_at_a_time_makes_samples(client, monkeypatch, form):
    class Counted:
        taken, held = 0, False

        def __enter__(self):
            self.taken, self.held = self.taken + 1, True

        def __exit__(self, *_):
            self.held = False

    lock = Counted()
    monkeypatch.setattr(motion_module, "_sampling", lock)
    lines = post(client, {"rate": 1000, "format": form}).text.splitlines()
    assert lock.taken >= 2 + len(lines) / AT_ONCE
    assert not lock.held


def test_samples_that_nobody_reads_are_not_computed():
    seen = []

    def pieces():
        try:
            for piece in (b"1", b"2", b"3"):
                seen.append(motion_module._sampling.locked())
                yield piece
        finally:
            seen.append("closed")

    found = motion_module.one_by_one(pieces())
    assert next(found) == b"1"
    assert not motion_module._sampling.locked()
    found.close()
    assert seen == [True, "closed"]


def test_code_is_text_and_python_plans_the_same_motion(client, capsys):
    script = post(client, {"format": "urscript"}).text
    assert script.startswith("def pick():\n")
    assert "sleep(0.25)" in script
    assert script.count("movej(") == 3
    text = post(client, {"format": "python", "rate": 50}).text
    found: dict[str, object] = {}
    exec(compile(text, "motion.py", "exec"), found)
    assert found["motion"].duration == pytest.approx(EXPECTED.duration, abs=1e-9)
    assert EXPECTED.reason in capsys.readouterr().out
    problem = post(
        client,
        {"format": "urscript", "program": {"segments": [{"kind": "dwell", "seconds": 1}]}},
        422,
        "robots/scara/motion",
    ).json()
    assert problem["errors"][0]["field"] == "format"


def test_urscript_is_for_arms_of_universal_robots(client):
    still = {"format": "urscript", "program": {"segments": [{"kind": "dwell", "seconds": 1}]}}
    error = post(client, still, 422, "robots/kr6/motion").json()["errors"][0]
    assert error["expected"] == "an arm of Universal Robots; the maker of KUKA KR 6 R900 sixx is KUKA"
    assert "No maker is stated" not in post(client, still, path="robots/ur5/motion").text
    table = {"robot": {**kin.robot_to_dict(kin.get_robot("ur5")), "id": "mine", "maker": ""}, **still}
    assert "# No maker is stated" in post(client, table, path="motion").text


def test_a_file_calls_the_joints_as_a_driver_does(client):
    names = [f"{name}_joint" for name in ("pan", "lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
    still = {"program": {"segments": [{"kind": "dwell", "seconds": 0.1}]}, "joint_names": names}
    text = post(client, {**still, "format": "trajectory-yaml"}, path="robots/ur5/motion").text
    assert f"joint_names: {json.dumps(names)}" in text
    for wrong in (names[:5], [*names[:5], names[0]], [*names[:5], " "]):
        error = post(client, {**still, "format": "csv", "joint_names": wrong}, 422, "robots/ur5/motion").json()
        assert error["errors"][0]["field"] == "joint_names"
        assert "6 different names" in error["errors"][0]["expected"]


@pytest.mark.parametrize("form", FORMATS)
def test_what_cannot_be_driven_is_an_answer_with_a_reason(client, form):
    program = {"segments": [{"kind": "ptp", "q": Q}, {"kind": "ptp", "q": [9.0, *Q[1:]], "name": "far"}]}
    answer = post(client, {"program": program, "format": form}).json()
    refusal = answer["refusal"]
    assert (answer["planned"], answer["duration"], answer["segments"], answer["peaks"]) == (False, 0.0, [], [])
    assert (refusal["segment"], refusal["kind"], refusal["name"], refusal["cause"]) == (1, "ptp", "far", "target")
    (violation,) = refusal["details"]["violations"]
    assert (violation["joint"], violation["value"]) == (0, 9.0)
    assert refusal["reason"] == answer["reason"]
    assert "joint 1" in answer["reason"]
    assert answer["samples"]["t"] == []


def test_a_pose_out_of_reach_is_explained_as_inverse_kinematics_does(client):
    program = {"segments": [{"kind": "ptp", "position": [3.0, 0.0, 0.5], "wxyz": [0, 1, 0, 0]}]}
    refusal = post(client, {"program": program}).json()["refusal"]
    assert (refusal["cause"], refusal["details"]["cause"]) == ("unreachable", "too far")
    assert refusal["ik"]["distance"] > 1.0
    assert refusal["details"]["details"] == refusal["ik"], "where it was before"


def test_a_slow_place_beside_a_singularity_comes_with_what_leads_past_it(client):
    robot, q = kin.get_robot("ur5"), np.array([0.0, -1.2, 1.6, -1.9, 0.3, 0.2])
    end = kin.fk(robot, np.add(q, [0.02, 0.0, 0.0, 0.0, -0.6, 0.0]))
    position, wxyz = end[:3, 3].tolist(), kin.wxyz_from_rotation(end[:3, :3]).tolist()
    program = {"segments": [{"kind": "lin", "position": position, "wxyz": wxyz}]}
    body = {"program": program, "q_start": q.tolist(), "samples": False}
    notes = client.post("/api/v1/robots/ur5/motion", json=body).json()["notes"]
    (note,) = [each for each in notes if each["code"] == "slowed"]
    assert (note["segment"], 0.4 < note["fraction"] < 0.6) == (0, True)
    assert [each["code"] for each in note["helps"]] == ["ptp", "posture", "shift", "tilt"]
    assert ["vector" in each for each in note["helps"]] == [False, False, True, True]
    assert all("helps" not in each for each in notes if each is not note)


def test_a_start_outside_the_limits_is_an_answer(client):
    refusal = post(client, {"q_start": [7.0, *Q[1:]]}).json()["refusal"]
    assert (refusal["cause"], refusal["helps"]) == ("start", [{"code": "start", "posture": None}])


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"program": {}}, "program.segments"),
        ({"program": {"segments": []}}, "program.segments"),
        ({"program": {"segments": 3}}, "program.segments"),
        ({"program": {"segments": [{"kind": "fly"}]}}, "program.segments[0].kind"),
        ({"program": {"segments": [{"kind": "ptp"}]}}, "program.segments[0]"),
        ({"program": {"segments": [{"kind": "ptp", "q": Q, "blend": -1}]}}, "program.segments[0].blend"),
        ({"program": {"segments": [{"kind": "ptp", "q": Q, "speed": 2}]}}, "program.segments[0].speed"),
        ({"program": {"segments": [{"kind": "ptp", "q": Q[:3]}]}}, "program.segments[0].q"),
        ({"program": {"segments": [{"kind": "dwell", "seconds": 1e9}]}}, "program.segments[0].seconds"),
        (
            {"program": {"segments": [{"kind": "dwell", "seconds": 1}], "units": {"length": "ft"}}},
            "program.units.length",
        ),
        ({"program": {"segments": [{"kind": "dwell", "seconds": 1}], "colour": 1}}, "program.colour"),
        ({"program": 3}, "program"),
        ({"q_start": Q[:2]}, "q_start"),
        ({"rate": 0}, "rate"),
        ({"rate": 1e5}, "rate"),
        ({"format": "pdf"}, "format"),
        ({"program": {"segments": [{"kind": "dwell", "seconds": 3600}]}, "rate": 1000}, "rate"),
        ({"samples": 1}, "samples"),
    ],
)
def test_what_is_malformed_is_refused_by_its_field(client, body, field):
    problem = post(client, body, 422).json()
    assert problem["errors"][0]["field"].startswith(field), problem["errors"]


@pytest.mark.usefixtures("computes_here")
def test_programs_and_answers_have_a_largest_size(client, app, monkeypatch):
    narrow = app.state.settings.model_copy(update={"max_path": 2})
    with monkeypatch.context() as patched:
        patched.setitem(app.state._state, "settings", narrow)
        problem = post(client, {}, 413).json()
    assert problem["errors"][0]["field"] == "program.segments"
    monkeypatch.setattr(motion_module, "NUMBER", 10**9)
    problem = post(client, {}, 413).json()
    assert problem["errors"][0]["field"] == "rate"
    assert "ndjson" in problem["errors"][0]["expected"]


def test_lines_and_arcs_are_written_with_their_own_targets(client):
    p = kin.fk(UR5, np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0]))[:3, 3]
    program = {
        "segments": [
            {"kind": "ptp", "q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
            {"kind": "lin", "position": (p - [0, 0, 0.1]).tolist(), "blend": 0.02, "tool_speed": 0.2},
            {"kind": "lin", "position": (p + np.array([0, 0.1, -0.1])).tolist()},
            {
                "kind": "circ",
                "via": (p + np.array([0, 0.12, -0.05])).tolist(),
                "position": (p + np.array([0, 0.1, 0])).tolist(),
            },
        ]
    }
    answer = post(client, {"program": program, "rate": 100}).json()
    assert answer["planned"], answer["reason"]
    assert all(peak["ratio"] <= 1 + 1e-9 for peak in answer["peaks"] if peak["ratio"] is not None)
    assert np.allclose(answer["samples"]["position"][-1], p + np.array([0, 0.1, 0]), atol=1e-6)
    script = post(client, {"program": program, "format": "urscript"}).text
    assert script.count("movel(") == 2
    assert script.count("movec(") == 1
    assert f"{p[2] - 0.1:.9g}" in script, "the target of the line, not the middle of its blend"


def test_zones_of_urscript_are_those_that_are_planned(client):
    p = kin.fk(UR5, np.array(Q))[:3, 3]
    places = [(0.1, 0, 0), (0.1, 0, 0.1), (0.2, 0, 0.1), (0.2, 0, 0.2)]
    blends = [0.04, 0.0003, 0.2, 0.01]
    program = {
        "segments": [
            {"kind": "lin", "position": (p - np.array(place)).tolist(), "blend": blend}
            for place, blend in zip(places, blends, strict=True)
        ]
    }
    answer = post(client, {"program": program, "q_start": Q}).json()
    assert answer["planned"], answer["reason"]
    lines = post(client, {"program": program, "q_start": Q, "format": "urscript"}).text.splitlines()
    lines = [line for line in lines if "movel" in line]
    assert lines[0].endswith(", r=0.04)")
    assert " r=" not in lines[1], "passing takes longer than a stop"
    assert lines[2].endswith(", r=0.05)"), "half of the shorter segment"
    assert " r=" not in lines[3], "the last one"


def test_a_line_that_leaves_the_workspace_is_refused_at_its_place(client):
    program = {"segments": [{"kind": "ptp", "q": Q}, {"kind": "lin", "position": [2.0, 0.0, 0.5], "name": "away"}]}
    refusal = post(client, {"program": program}).json()["refusal"]
    assert (refusal["segment"], refusal["kind"], refusal["name"]) == (1, "lin", "away")
    assert 0.0 < refusal["fraction"] < 1.0
    assert "% of the way" in refusal["reason"]
    ends = kin.fk(UR5, np.array(Q))
    ends[:3, 3] = 2.0, 0.0, 0.5
    missing = kin.solve_ik(UR5, ends).details.distance
    assert missing > 0.5
    assert f"at the worst place after it, out of reach by {missing * 1000:.1f} mm" in refusal["reason"]


def test_a_line_that_arrives_otherwise_and_the_part_of_a_refused_program_are_answered(client):
    first = [math.radians(x) for x in (215.70215832, -94.13277042, 106.01340862, -101.8806382, -90.0, 35.70215832)]
    then = [math.radians(x) for x in (209.38701291, -192.42399488, 91.0728513, 11.35114358, -90.0, 29.38701291)]
    segments = [{"kind": "ptp", "q": first}, {"kind": "lin", "q": then}, {"kind": "lin", "position": [9, 0, 0.3]}]
    body = {"program": {"segments": segments}, "rate": 20}
    answer = post(client, body, path="robots/ur5/motion").json()
    part = answer["part"]
    assert (answer["planned"], answer["refusal"]["segment"], len(part["segments"])) == (False, 2, 3)
    arrival = part["segments"][1]["arrival"]
    assert not arrival["as_recorded"]
    assert arrival["posture"] != arrival["recorded_posture"]
    assert np.allclose(arrival["difference"], np.subtract(arrival["q"], then))
    assert max(map(abs, arrival["difference"])) == pytest.approx(math.radians(149.3), abs=1e-3)
    assert "arrives otherwise" in [note["code"] for note in part["notes"]]
    assert part["samples"]["t"][-1] == pytest.approx(part["duration"])
    whole = post(client, {"program": {"segments": segments[:2]}}, path="robots/ur5/motion").json()
    assert whole["part"] is None
    assert whole["segments"][1]["arrival"]["q"] == pytest.approx(arrival["q"])
    assert whole["segments"][1]["end"] == pytest.approx(part["segments"][1]["end"])


def test_postures_along_a_path_are_those_of_the_core(client):
    T = np.repeat(kin.fk(UR5, UR5.q_home)[None], 12, axis=0)
    T[:, :3, 3] += np.linspace(0.0, 1.0, 12)[:, None] * (0.55, 0.0, 0.0)
    body = {"targets": [{"matrix": pose.tolist()} for pose in T], "max_step": 2.0}
    response = client.post("/api/v1/robots/ur5/ik/path/postures", json=body)
    assert response.status_code == 200, response.text
    answer, found = response.json(), kin.path.path_postures(UR5, T, max_step=2.0)
    assert answer["postures"] == list(found.postures)
    assert answer["through"] == list(found.through)
    assert answer["reach"] == found.reach.tolist()
    assert answer["reason"] == found.reason
    assert len(answer["stretches"]) == len(found.stretches)
    q = np.array(answer["q"], dtype=float)
    assert np.allclose(q, found.q, atol=1e-9, equal_nan=True)
    assert {state for row in answer["states"] for state in row} == {each.state for each in found.stretches}
    assert np.allclose(answer["best"]["q"], found.best.q)
    refused = client.post("/api/v1/robots/ur5/ik/path/postures", json={**body, "max_step": 0})
    assert refused.status_code == 422


def test_poses_in_the_frame_of_a_workpiece_are_those_of_the_world(client):
    table = kin.pose_from_xyz_rpy([0.1, 0.05, -0.1], [0.0, 0.0, 0.4])
    base = kin.pose_from_xyz_rpy([0.0, 0.0, 0.2], [0.0, 0.0, 1.0])
    arm = kin.get_robot("pioneer5").with_base(base)
    there = np.linalg.inv(table) @ kin.fk(arm, [1.3, 0.6, 0.9, 0.4, 0.6])
    body = {
        "base": {"xyz": [0.0, 0.0, 0.2], "rpy": [0.0, 0.0, 1.0]},
        "workpieces": {"table": {"xyz": [0.1, 0.05, -0.1], "rpy": [0.0, 0.0, 0.4]}},
        "program": {
            "units": {"length": "mm"},
            "segments": [
                {
                    "kind": "ptp",
                    "frame": "table",
                    "position": (1e3 * there[:3, 3]).tolist(),
                    "wxyz": kin.wxyz_from_rotation(there[:3, :3]).tolist(),
                },
            ],
        },
    }
    found = client.post("/api/v1/robots/pioneer5/motion", json=body).json()
    assert found["planned"], found["reason"]
    assert found["samples"]["position"][-1] == pytest.approx((table @ there)[:3, 3].tolist(), abs=1e-8)
    assert np.abs(kin.fk(arm, found["samples"]["q"][-1]) - table @ there)[:3, 2:].max() < 1e-8
    body["program"]["segments"][0]["frame"] = "tool"
    refused = client.post("/api/v1/robots/pioneer5/motion", json=body).json()
    assert refused["errors"] == [
        {"field": "program.segments[0].frame", "value": "'tool'", "expected": "one of world, table, base"}
    ]


def test_a_motion_starts_while_the_arm_moves_or_says_which_joint_cannot_stop(client):
    body = {"program": {"segments": [{"kind": "ptp", "q": [3.5, -1.5, 1.5, -1.2, -1.2, 0.3]}]}, "rate": 50}
    start = {"qd_start": [0.6, 0, 0, 0, 0, -0.3], "qdd_start": [0, 0, 0, 0, 0, 1.0]}
    answer = client.post("/api/v1/robots/ur5/motion", json=body | start).json()
    assert answer["planned"]
    assert answer["samples"]["qd"][0] == pytest.approx(start["qd_start"])
    assert answer["samples"]["qdd"][0] == pytest.approx(start["qdd_start"])
    code = client.post("/api/v1/robots/ur5/motion", json=body | start | {"format": "python"}).text
    script = client.post("/api/v1/robots/ur5/motion", json=body | start | {"format": "urscript"})
    assert script.status_code == 422
    assert "starts at rest" in script.json()["errors"][0]["expected"]
    assert f"qd_start={start['qd_start']}".replace(" 0,", " 0.0,") in code
    near = [float(UR5.upper[0]) - 0.01, *UR5.home[1:]]
    moving = {"q_start": near, "qd_start": [3.0, 0, 0, 0, 0, 0]}
    refused = client.post("/api/v1/robots/ur5/motion", json=body | moving).json()["refusal"]
    assert refused["cause"] == "stop"
    assert refused["details"]["violation"]["joint"] == 0
    assert refused["details"]["speed"] == 3.0
    assert 0.0 < refused["details"]["time"] < 0.01
    for field, given in (("qd_start", [9, 0, 0, 0, 0, 0]), ("qdd_start", [0, 0]), ("qd_start", "fast")):
        problem = client.post("/api/v1/robots/ur5/motion", json=body | {field: given})
        assert problem.status_code == 422
        assert problem.json()["errors"][0]["field"].startswith(field)
