"""Motions over time as files, read by what others read them with."""

from __future__ import annotations

import csv
import io
import json
import sys

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader

import kin
from app.exports.motion import FORMATS
from kin.motion import program_to_dict, tables

RATE = 50.0
UR5, STANFORD = kin.get_robot("ur5"), kin.get_robot("stanford")


def motion_of(robot: kin.Robot) -> kin.motion.Motion:
    """A PTP to a place nearby, with values such as 1e-05 on the way, and a pause."""
    q = robot.clip(robot.q_home + 0.3 * np.where(robot.revolute, 1.0, 0.1))
    segments = (kin.motion.Ptp(kin.motion.JointTarget(tuple(q.tolist())), name="über"), kin.motion.Dwell(0.1))
    return kin.plan_motion(robot, kin.motion.Program(segments, name="test"))


@pytest.fixture(params=[UR5, STANFORD], ids=lambda robot: robot.id)
def motion(request: pytest.FixtureRequest) -> kin.motion.Motion:
    return motion_of(request.param)


def written(motion: kin.motion.Motion, name: str) -> bytes:
    return b"".join(FORMATS[name].pieces(motion, RATE))


def check_trajectory(message: dict, motion: kin.motion.Motion) -> None:
    times = motion.step_times(RATE)
    assert message["joint_names"] == motion.robot.ros_names
    assert message["header"]["stamp"] == {"sec": 0, "nanosec": 0}
    points = message["points"]
    at = [point["time_from_start"] for point in points]
    assert all(0 <= each["nanosec"] < 10**9 for each in at)
    assert np.allclose([each["sec"] + 1e-9 * each["nanosec"] for each in at], times, atol=1e-9)
    wanted = motion.derivatives(times)
    for row, name in enumerate(("positions", "velocities", "accelerations")):
        values = [point[name] for point in points]
        assert all(isinstance(value, float) for value in np.ravel(np.array(values, dtype=object)))
        assert np.array_equal(np.array(values), wanted[row])


def says_what_is_in_it(words: str, motion: kin.motion.Motion) -> None:
    assert motion.robot.id in words
    assert "radians" in words
    assert "seconds" in words
    assert repr(float(motion.limits.velocity[0])) in words
    assert repr(float(motion.robot.upper[-1])) in words
    assert "acceleration of" in words, "what is assumed"


def test_a_trajectory_as_yaml_is_the_message_of_ros(motion: kin.motion.Motion) -> None:
    text = written(motion, "trajectory-yaml").decode()
    check_trajectory(yaml.safe_load(text), motion)
    says_what_is_in_it("".join(line for line in text.splitlines() if line.startswith("#")), motion)


def test_a_trajectory_as_json_has_the_message_in_a_field(motion: kin.motion.Motion) -> None:
    found = json.loads(written(motion, "trajectory-json"))
    check_trajectory(found.pop("joint_trajectory"), motion)
    says_what_is_in_it(json.dumps(found), motion)


def test_the_commented_table_is_the_table_behind_its_comments(motion: kin.motion.Motion) -> None:
    lines = written(motion, "csv-commented").decode().splitlines(keepends=True)
    head = [line for line in lines if line.startswith("#")]
    assert "".join(lines[len(head) :]).encode() == written(motion, "csv")
    rows = list(csv.DictReader(io.StringIO("".join(lines[len(head) :]))))
    assert list(rows[0]) == tables.columns(motion.robot.n)
    sample = motion.sample(float(rows[3]["t"]))
    assert [float(rows[3][name]) for name in "xyz"] == pytest.approx(sample.T[:3, 3].tolist())
    says_what_is_in_it("".join(head), motion)


def test_a_recording_is_read_by_the_reader_of_mcap(motion: kin.motion.Motion) -> None:
    reader = make_reader(io.BytesIO(written(motion, "mcap")), validate_crcs=True)
    times = motion.step_times(RATE)
    summary = reader.get_summary()
    assert summary is not None
    assert {schema.name for schema in summary.schemas.values()} == {
        "foxglove.JointStates",
        "foxglove.FrameTransforms",
    }
    found: dict[str, list[tuple[int, dict]]] = {}
    for schema, channel, message in reader.iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        assert json.loads(schema.data)["type"] == "object"
        found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    assert sorted(found) == ["/joint_states", "/tf"]
    q, qd, qdd, _ = motion.derivatives(times)
    for k, (at, state) in enumerate(found["/joint_states"]):
        assert at == round(times[k] * 1e9)
        assert state["timestamp"] == {"sec": at // 10**9, "nsec": at % 10**9}
        assert [joint["name"] for joint in state["joints"]] == motion.robot.ros_names
        for name, row in (("position", q), ("velocity", qd), ("acceleration", qdd)):
            assert [joint[name] for joint in state["joints"]] == row[k].tolist()
    for k, (_, transforms) in enumerate(found["/tf"]):
        tool = transforms["transforms"][-1]
        assert (tool["parent_frame_id"], tool["child_frame_id"]) == ("world", "tool")
        T = kin.fk(motion.robot, q[k])
        assert list(tool["translation"].values()) == pytest.approx(T[:3, 3].tolist())
        r = tool["rotation"]
        R = kin.transforms.pose_from_position_wxyz((0, 0, 0), (r["w"], r["x"], r["y"], r["z"]))[:3, :3]
        assert np.allclose(R, T[:3, :3], atol=1e-12)
        assert len(transforms["transforms"]) == len(motion.robot.rows) + 1
    (metadata,) = reader.iter_metadata()
    says_what_is_in_it(json.dumps(metadata.metadata), motion)
    (program,) = reader.iter_attachments()
    assert kin.motion.program_from_dict(json.loads(program.data), motion.robot) == motion.program
    assert program_to_dict(motion.program) == json.loads(program.data)


def test_without_the_package_a_recording_is_refused_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(kin.InputError, match="kinboard\\[mcap\\]"):
        written(motion_of(UR5), "mcap")


def test_no_format_drops_the_gripper() -> None:
    """Python plans it again; tables and messages say when it moves, and URScript where its command belongs."""
    motion = kin.plan_motion("ur5", [kin.motion.Gripper(0.25, 1.0, "grip"), kin.motion.Ptp(UR5.q_home + 0.1)])
    said = "0.25 from 0.0 s to 1.0 s"
    for name in ("csv-commented", "trajectory-yaml", "trajectory-json"):
        assert said in written(motion, name).decode()
    (metadata,) = make_reader(io.BytesIO(written(motion, "mcap"))).iter_metadata()
    assert said in metadata.metadata.values()
    assert written(motion, "csv").decode().splitlines()[0].endswith(",gripper")
    assert json.loads(written(motion, "ndjson").splitlines()[0])["segments"][0]["opening"] == 0.25
    assert json.loads(written(motion, "json"))["segments"][1]["opening"] is None
    assert (
        "{'kind': 'gripper', 'opening': 0.25, 'seconds': 1.0, 'name': 'grip'}"
        in written(motion, "python").decode()
    )
    script = written(motion, "urscript").decode()
    assert "  # gripper 25 % open: the command of your gripper goes here\n  sleep(1)  # grip\n" in script
    still = kin.plan_motion("ur5", [kin.motion.Ptp(UR5.q_home + 0.1)])
    assert "gripper" not in "".join(written(still, name).decode() for name in ("csv-commented", "urscript"))
