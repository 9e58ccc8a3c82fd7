"""Programs: read from plain data, written back, refused with the name of the field."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kin

number = st.floats(-5, 5)
joints = st.builds(kin.motion.JointTarget, st.tuples(*[number] * 6))
poses = st.builds(
    kin.motion.PoseTarget,
    st.tuples(number, number, number),
    st.none() | st.just((1.0, 0.0, 0.0, 0.0)) | st.just((0.0, 0.6, 0.0, -0.8)),
)
targets = joints | poses
part = st.floats(0.01, 1)
common = {
    "speed": part,
    "acceleration": part,
    "tool_speed": st.none() | st.floats(0.01, 2),
    "blend": st.just(0.0) | st.floats(0, 0.2),
    "name": st.text(max_size=10),
}
orientation = st.sampled_from(["geodesic", "two-axis"])
segments = (
    st.builds(kin.motion.Ptp, targets, **common)
    | st.builds(kin.motion.Lin, targets, orientation=orientation, **common)
    | st.builds(kin.motion.Circ, st.tuples(number, number, number), targets, orientation=orientation, **common)
    | st.builds(
        kin.motion.Spline, st.lists(poses, min_size=1, max_size=3) | st.lists(joints, min_size=1, max_size=3)
    )
    | st.builds(kin.motion.Dwell, st.floats(0, 5))
    | st.builds(kin.motion.Gripper, st.floats(0, 1), st.floats(0, 5), st.text(max_size=10))
)
programs = st.builds(
    kin.motion.Program,
    st.lists(segments, min_size=1, max_size=4),
    task=st.sampled_from([None, "pose", "approach", "position"]),
    jerk_limited=st.booleans(),
)


@settings(max_examples=20)
@given(programs)
def test_what_is_written_is_read_again(program):
    assert kin.motion.program_from_dict(kin.motion.program_to_dict(program)) == program


def test_units_and_toml():
    program = kin.motion.parse_program(
        """
        name = "pick"
        units = { length = "mm", angle = "deg" }
        [[segments]]
        kind = "ptp"
        q = [90, 0, 100, 180]
        [[segments]]
        kind = "circ"
        via = [100, 0, 0]
        position = [200, 0, 0]
        tool_speed = 250
        tool_turn = 90
        blend = 5
        [[segments]]
        kind = "lin"
        pose = [[1, 0, 0, 300], [0, 1, 0, 0], [0, 0, 1, 10], [0, 0, 0, 1]]
        """,
        kin.get_robot("scara"),
    )
    ptp, circ, lin = program.segments
    assert program.name == "pick"
    assert ptp.target.q == pytest.approx((math.pi / 2, 0, 0.1, math.pi))
    assert (circ.via, circ.target.position, circ.target.wxyz) == ((0.1, 0, 0), (0.2, 0, 0), None)
    assert (circ.tool_speed, circ.tool_turn, circ.blend) == pytest.approx((0.25, math.pi / 2, 0.005))
    assert lin.target == kin.motion.PoseTarget((0.3, 0, 0.01), (1, 0, 0, 0))


LIN = {"kind": "lin", "position": [0, 0, 0]}
PTP = {"kind": "ptp", "q": [0, 0]}


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ([], "program"),
        ({}, "segments"),
        ({"segments": []}, "segments"),
        ({"segments": [5]}, "segments[0]"),
        ({"segments": [{}]}, "segments[0].kind"),
        ({"segments": [{"kind": ["ptp"]}]}, "segments[0].kind"),
        ({"segments": [PTP, {"kind": "ptp"}]}, "segments[1]"),
        ({"segments": [PTP | {"position": [0, 0, 0]}]}, "segments[0]"),
        ({"segments": [PTP | {"wxyz": [1, 0, 0, 0]}]}, "segments[0]"),
        ({"segments": [PTP | {"frame": "base"}]}, "segments[0].frame"),
        ({"segments": [{"kind": "lin", "position": [0, 0, 0], "frame": "moon"}]}, "segments[0].frame"),
        ({"segments": [{"kind": "dwell", "seconds": 1, "frame": "world"}]}, "segments[0].frame"),
        ({"segments": [{"kind": "ptp", "q": [0, "x"]}]}, "segments[0].q[1]"),
        ({"segments": [{"kind": "ptp", "q": []}]}, "segments[0].q"),
        ({"segments": [{"kind": "ptp", "q": [1e9]}]}, "segments[0].q[0]"),
        ({"segments": [PTP | {"speed": 0}]}, "segments[0].speed"),
        ({"segments": [PTP | {"speed": 1.5}]}, "segments[0].speed"),
        ({"segments": [PTP | {"acceleration": True}]}, "segments[0].acceleration"),
        ({"segments": [PTP | {"blend": -1}]}, "segments[0].blend"),
        ({"segments": [PTP | {"via": [0, 0, 0]}]}, "segments[0].via"),
        ({"segments": [PTP | {"name": 5}]}, "segments[0].name"),
        ({"segments": [LIN | {"position": [0, 0]}]}, "segments[0].position"),
        ({"segments": [LIN | {"position": [0, 0, math.nan]}]}, "segments[0].position[2]"),
        ({"segments": [LIN | {"wxyz": [0, 0, 0, 0]}]}, "segments[0].wxyz"),
        ({"segments": [LIN | {"orientation": "slerp"}]}, "segments[0].orientation"),
        ({"segments": [LIN | {"tool_speed": 0}]}, "segments[0].tool_speed"),
        ({"segments": [LIN | {"tool_turn": "fast"}]}, "segments[0].tool_turn"),
        ({"segments": [{"kind": "lin", "pose": np.zeros((4, 4)).tolist()}]}, "segments[0].pose[3]"),
        ({"segments": [{"kind": "circ", "position": [0, 0, 0]}]}, "segments[0].via"),
        ({"segments": [{"kind": "spline", "points": []}]}, "segments[0].points"),
        (
            {"segments": [{"kind": "spline", "points": [{"q": [0]}, {"position": [0, 0, 0]}]}]},
            "segments[0].points",
        ),
        ({"segments": [{"kind": "spline", "points": [{"speed": 1}]}]}, "segments[0].points[0].speed"),
        ({"segments": [{"kind": "dwell"}]}, "segments[0].seconds"),
        ({"segments": [{"kind": "dwell", "seconds": -1}]}, "segments[0].seconds"),
        ({"segments": [PTP], "speed": 1}, "speed"),
        ({"segments": [PTP], "task": "roll"}, "task"),
        ({"segments": [PTP], "jerk_limited": 1}, "jerk_limited"),
        ({"segments": [PTP], "units": "mm"}, "units"),
        ({"segments": [PTP], "units": {"length": "inch"}}, "units.length"),
    ],
)
def test_a_malformed_program_names_the_field(data, field):
    with pytest.raises(kin.InputError) as caught:
        kin.motion.program_from_dict(data)
    assert caught.value.field == field
    assert str(caught.value).startswith(f"{field}: got ")


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: kin.motion.Ptp(target=(0, -1, math.nan, 0, 1, 0)), "target[2]"),
        (lambda: kin.motion.Ptp(target=np.full((4, 4), 2.0)), "target[3]"),
        (lambda: kin.motion.Ptp(target=np.zeros((2, 6))), "target"),
        (lambda: kin.motion.Ptp(target="home"), "target"),
        (lambda: kin.motion.Lin(target=None), "target"),
        (lambda: kin.motion.Circ(via=(0, 0, 0), target=5), "target"),
        (lambda: kin.motion.Spline(points=[(1, 2), "x"]), "points[1]"),
        (lambda: kin.motion.Spline(points=3), "points"),
        (lambda: kin.motion.Program(5), "segments"),
    ],
)
def test_targets_have_a_type(make, field):
    with pytest.raises(kin.InputError) as caught:
        make()
    assert caught.value.field == field


def test_lengths_are_those_that_are_written():
    pose = [[1, 0, 0, 102], [0, 1, 0, 0], [0, 0, 1, 100.7], [0, 0, 0, 1]]
    rows = [{"kind": "lin", "position": [102, 0, 100.7], "blend": 102.5}, {"kind": "lin", "pose": pose}]
    first, second = kin.motion.program_from_dict({"units": {"length": "mm"}, "segments": rows}).segments
    assert (first.target.position, first.blend) == ((0.102, 0, 0.1007), 0.1025)
    assert second.target.position == (0.102, 0, 0.1007)


def test_the_number_of_joint_values_is_checked_against_the_arm():
    with pytest.raises(kin.InputError, match=r"segments\[0\].q: .* 6 joint values"):
        kin.motion.program_from_dict({"segments": [PTP]}, kin.get_robot("ur5"))
    with pytest.raises(kin.InputError, match=r"segments\[0\].q: .* 6 joint values"):
        kin.plan_motion(kin.get_robot("ur5"), [kin.motion.Ptp(kin.motion.JointTarget((0, 0)))])
    with pytest.raises(kin.InputError, match="TOML"):
        kin.motion.parse_program("segments = [")


@pytest.mark.parametrize("text", [Path("program.toml"), "program.toml", "programs/first", b"[[segments]]", None])
def test_a_path_instead_of_the_text_of_a_program_is_named(text):
    with pytest.raises(kin.InputError, match=r"text: .* the text of a program, such as .*read_text\(\)"):
        kin.motion.parse_program(text)


def test_what_is_no_program_is_not_written():
    with pytest.raises(kin.InputError, match=r"program: .* a kin\.motion\.Program"):
        kin.motion.program_to_dict([kin.motion.Dwell(1.0)])


def test_limits_are_those_of_an_arm_or_of_its_id():
    assert np.array_equal(
        kin.motion.motion_limits("ur5").jerk, kin.motion.motion_limits(kin.get_robot("ur5")).jerk
    )
    with pytest.raises(kin.UnknownRobotError):
        kin.motion.motion_limits("nobody")


def test_poses_and_joint_values_are_targets_as_they_are():
    T = kin.pose_from_position_wxyz([0.4, 0.1, 0.3], [0.0, 1.0, 0.0, 0.0])
    q = np.array([0.1, -1.0, 1.2, 0.3, 1.1, 0.2])
    assert kin.motion.Lin(T).target == kin.motion.Lin(T.tolist()).target == kin.motion.PoseTarget.of(T)
    assert (
        kin.motion.Ptp(q, speed=0.5).target
        == kin.motion.Ptp(q.tolist(), speed=0.5).target
        == kin.motion.JointTarget(tuple(q))
    )
    arc = kin.motion.Circ(T, T, blend=0.01)
    assert (arc.via, arc.target) == ((0.4, 0.1, 0.3), kin.motion.PoseTarget.of(T))
    assert kin.motion.Spline(np.stack([T, T])).points == (kin.motion.PoseTarget.of(T),) * 2
    assert (
        kin.motion.Spline([q, kin.motion.JointTarget(tuple(q))]).points == (kin.motion.JointTarget(tuple(q)),) * 2
    )


def test_frames_of_workpieces_become_poses_in_the_world():
    table = kin.pose_from_xyz_rpy([0.3, -0.1, 0.2], [0.1, 0.2, 0.3])
    arm = kin.get_robot("ur5").with_base(kin.pose_from_xyz_rpy([0.0, 0.0, 1.0], [0.0, 0.0, 2.0]))
    T = kin.pose_from_position_wxyz([0.1, 0.2, 0.05], [0.3, 0.9, 0.1, 0.2])
    where = {"position": T[:3, 3].tolist(), "wxyz": kin.wxyz_from_rotation(T[:3, :3]).tolist()}
    data = {
        "segments": [
            {"kind": "lin", "frame": "table", **where},
            {"kind": "ptp", "frame": "base", "pose": T.tolist()},
            {"kind": "circ", "frame": "table", "via": [0.1, 0.0, 0.0], "position": [0.2, 0.0, 0.0]},
            {"kind": "spline", "points": [{**where, "frame": "table"}, {**where, "frame": "world"}]},
        ]
    }
    lin, ptp, circ, spline = kin.motion.program_from_dict(data, arm, {"table": table}).segments
    identity = np.eye(4)
    assert np.allclose(lin.target.pose(identity), table @ T, atol=1e-12)
    assert np.allclose(ptp.target.pose(identity), arm.T_world_base @ T, atol=1e-12)
    assert np.allclose(circ.via, (table @ [0.1, 0.0, 0.0, 1.0])[:3], atol=1e-12)
    assert circ.target.wxyz is None
    assert np.allclose(circ.target.position, (table @ [0.2, 0.0, 0.0, 1.0])[:3], atol=1e-12)
    assert np.allclose(spline.points[0].pose(identity), table @ T, atol=1e-12)
    assert np.allclose(spline.points[1].pose(identity), T, atol=1e-12)


def test_a_motion_is_written_as_a_table(tmp_path):
    arm = kin.get_robot("ur5")
    motion = kin.plan_motion(
        arm, [kin.motion.Ptp(arm.q_home + 0.3), kin.motion.Lin(kin.fk(arm, arm.q_home + 0.25))]
    )
    motion.to_csv(tmp_path / "motion.csv", rate=200)
    lines = (tmp_path / "motion.csv").read_text().splitlines()
    assert lines[0].startswith("t,q1,")
    assert lines[0].endswith(",x,y,z,qw,qx,qy,qz,tool_speed")
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert len(rows) > 1.5 * 200 * motion.duration / 2
    assert np.allclose(np.diff(rows[:-1, 0]), 1 / 200)
    assert rows[-1, 0] == motion.duration
    assert np.abs(kin.fk(arm, rows[:, 1:7])[:, :3, 3] - rows[:, 19:22]).max() < 1e-12
    speeds = np.linalg.norm(np.gradient(rows[:-1, 19:22], rows[:-1, 0], axis=0), axis=1)
    assert np.abs(speeds - rows[:-1, 26])[1:-1].max() < 0.02
    refused = kin.plan_motion(arm, [kin.motion.Ptp([9.0, 0, 0, 0, 0, 0])])
    with pytest.raises(kin.InputError, match="outside the limits"):
        refused.to_csv(tmp_path / "none.csv")
    with pytest.raises(kin.InputError, match="rate"):
        motion.to_csv(tmp_path / "none.csv", rate=0)
    assert not (tmp_path / "none.csv").exists()


def test_the_gripper_takes_its_time_and_the_arm_stands_still_meanwhile():
    program = kin.motion.parse_program(
        """
        units = { length = "mm", angle = "deg" }
        [[segments]]
        kind = "ptp"
        q = [10, -30, 40, 20, 0]
        blend = 5
        [[segments]]
        kind = "gripper"
        opening = 0.25
        seconds = 0.5
        [[segments]]
        kind = "ptp"
        q = [20, -30, 40, 20, 0]
        [[segments]]
        kind = "gripper"
        opening = 1
        name = "let go"
        """,
        kin.get_robot("so101"),
    )
    close, let_go = program.segments[1], program.segments[3]
    assert close == kin.motion.Gripper(0.25, 0.5)
    assert let_go == kin.motion.Gripper(1.0, name="let go")
    motion = kin.plan_motion("so101", program)
    assert motion.reason.startswith("2 motions and 2 gripper moves in")
    assert "the arm pauses there" in motion.reason, "its zone is left out"
    _, first, _, second = motion.segments
    assert [each.opening for each in motion.segments] == [None, 0.25, None, 1.0]
    assert first.end - first.start == pytest.approx(0.5)
    assert second.end - second.start == pytest.approx(2.0)
    q, qd, *_ = motion.derivatives(np.linspace(first.start, first.end, 9))
    assert np.allclose(q, np.radians([10, -30, 40, 20, 0]))
    assert np.abs(qd).max() == 0.0
    times = [0.0, first.start + 0.2, first.end, second.start, second.start + 1.0, motion.duration, 1e3]
    assert motion.opening(times).tolist() == pytest.approx(
        [np.nan, 0.25, 0.25, 0.25, 0.625, 1.0, 1.0], nan_ok=True
    )
    assert motion.opening(first.start + 0.25, before=0.75) == pytest.approx(0.5)
    assert motion.opening(0.0, before=0.75) == 0.75
    at_once = kin.plan_motion("so101", [kin.motion.Gripper(0.0, 0.0)])
    assert at_once.opening(0.0, before=1.0) == 0.0


def test_a_table_of_samples_has_the_gripper_where_it_moves():
    program = [kin.motion.Dwell(0.1), kin.motion.Gripper(0.5, 0.1), kin.motion.Gripper(1.0, 0.1)]
    rows = "".join(kin.plan_motion("so101", program).csv_pieces(20.0)).splitlines()
    assert rows[0].endswith(",tool_speed,gripper")
    last = [row.rpartition(",")[2] for row in rows[1:]]
    assert last[:2] == ["", ""]
    assert [float(cell) for cell in last[2:]] == pytest.approx([0.5, 0.5, 0.5, 0.75, 1.0])
    assert "gripper" not in "".join(kin.plan_motion("so101", [kin.motion.Dwell(0.1)]).csv_pieces())


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, r"segments\[0\]\.opening: got None, expected how far the gripper is open then"),
        ({"opening": 40}, r"segments\[0\]\.opening: got 40, expected a number from 0 \(closed\) to 1 \(open\)"),
        ({"opening": -0.1}, r"segments\[0\]\.opening"),
        ({"opening": "open"}, r"segments\[0\]\.opening"),
        ({"opening": True}, r"segments\[0\]\.opening"),
        ({"opening": 1.0, "seconds": -1.0}, r"segments\[0\]\.seconds"),
        ({"opening": 1.0, "speed": 0.5}, r"segments\[0\]\.speed: .* kind, opening, seconds, name"),
    ],
)
def test_what_is_no_opening_is_refused(fields, message):
    with pytest.raises(kin.InputError, match=message):
        kin.motion.program_from_dict({"segments": [{"kind": "gripper", **fields}]})
