"""Rows that follow joints: one map for poses, Jacobians, limits and clouds, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kin
from kin import InputError, Joint, Robot
from kin.collision.contacts import surroundings
from kin.collision.sweep import lever_arms


def arm(convention: str = "standard") -> Robot:
    """Two joints that turn and one that slides; rows follow each of them, before and after the joint itself."""
    rows = [
        Joint("swing", 0.1, 0.4, 0.05, -1.2, limits=(-2.0, 2.5)),
        Joint("early", 0.3, 0.0, 0.2, 0.4, follows="bend", ratio=-0.5),
        Joint("bend", -0.4, 0.1, 0.3, 1.1, limits=(-1.5, 1.0)),
        Joint("plate", kind="fixed", theta=0.7, a=0.1),
        Joint("level", 0.2, 0.0, 0.25, -0.8, follows="bend", ratio=-1.0),
        Joint("rod", 0.0, 0.1, 0.0, 0.3, "prismatic", (0.0, 0.3)),
        Joint("stage", 0.5, 0.2, 0.1, 0.2, "prismatic", follows="rod", ratio=2.0),
        Joint("screw", 0.0, 0.05, 0.0, 0.6, "prismatic", follows="swing", ratio=0.02),
    ]
    return Robot.from_dh(rows, convention).with_base(kin.pose_from_xyz_rpy([0.1, 0.2, 0.3], [0.4, 0.5, 0.6]))  # type: ignore[arg-type]


ARMS = [arm(), arm("modified")]


@pytest.mark.parametrize("robot", ARMS, ids=["standard", "modified"])
def test_poses_are_those_of_the_free_arm_bit_by_bit(robot):
    q = robot.random_q(np.random.default_rng(1), 150)
    t = robot.expand(q)
    assert (robot.n, robot.free.n, t.shape) == (3, 7, (150, 7))
    assert t[:, 1] == pytest.approx(-0.5 * q[:, 1])
    free = kin.fk(robot.free, t)
    assert np.array_equal(kin.fk(robot, q), free)
    assert np.array_equal(np.array([kin.fk(robot, each) for each in q]), free)
    assert kin.fk_positions(robot, q) == pytest.approx(free[:, :3, 3], abs=1e-14)
    assert np.array_equal(kin.link_frames(robot, q), kin.link_frames(robot.free, t))


@pytest.mark.parametrize("robot", ARMS, ids=["standard", "modified"])
def test_the_jacobian_is_that_of_the_free_arm_times_the_map(robot):
    q = robot.random_q(np.random.default_rng(2), 20)
    expected = kin.jacobian(robot.free, robot.expand(q)) @ robot.expansion
    assert kin.jacobian(robot, q) == pytest.approx(expected, abs=1e-14)
    assert kin.jacobian(robot, q[0].copy()) == pytest.approx(expected[0], abs=1e-14)
    step = 1e-6
    for i, direction in enumerate(np.eye(3) * step):
        moved = kin.fk_positions(robot, q + direction) - kin.fk_positions(robot, q - direction)
        assert kin.jacobian(robot, q)[:, :3, i] == pytest.approx(moved / (2.0 * step), abs=1e-8)


@pytest.mark.parametrize("robot", ARMS, ids=["standard", "modified"])
def test_a_cloud_holds_the_tool_points_of_its_configurations(robot):
    for strategy in ("uniform", "quasi"):
        points = kin.workspace.workspace_slice(robot, 300, 0, 300, strategy=strategy)
        q = kin.workspace.workspace_configurations(robot, range(300), strategy=strategy)
        assert points.points == pytest.approx(kin.fk_positions(robot, q), abs=1e-6)


def test_limits_and_peaks_of_a_joint_keep_those_of_what_follows_it():
    rows = [
        Joint("lead", a=0.3, limits=(-2.0, 2.0), velocity=3.0),
        Joint("twice", a=0.2, limits=(-1.0, 1.0), follows="lead", ratio=2.0, velocity=4.0, acceleration=8.0),
        Joint("back", a=0.1, limits=(-0.2, 1.0), follows="lead", ratio=-1.0, velocity=1.0),
    ]
    robot = Robot.from_dh(rows)
    assert robot.joints[0].limits == (-0.5, 0.2)
    assert (robot.lower.tolist(), robot.upper.tolist()) == ([-0.5], [0.2])
    limits = kin.motion.motion_limits(robot)
    assert (limits.velocity.tolist(), limits.acceleration.tolist()) == ([1.0], [4.0])
    assert robot.rows[0].limits == (-2.0, 2.0), "the row itself keeps what was stated"
    unlimited = Robot.from_dh([Joint("lead", a=0.3), *rows[1:]])
    assert unlimited.joints[0].limits == (-0.5, 0.2)
    assert Robot.from_dh([Joint("lead", a=0.3), replace(rows[1], limits=None)]).joints[0].limits is None


def test_which_joints_may_make_whole_turns():
    def turns(*followers: Joint) -> bool:
        return bool(Robot.from_dh([Joint("lead", a=0.3), *followers]).whole_turns[0])

    assert turns()
    assert turns(Joint("level", a=0.2, follows="lead", ratio=-1.0), Joint("two", follows="lead", ratio=2.0))
    assert not turns(Joint("half", a=0.2, follows="lead", ratio=0.5))
    assert not turns(Joint("screw", kind="prismatic", follows="lead", ratio=1.0))


def test_an_arm_without_followers_is_its_own_free_arm_and_has_the_same_numbers():
    robot = kin.get_robot("ur5")
    assert (robot.coupled, robot.free is robot, robot.leads.any()) == (False, True, False)
    assert robot.expand(robot.q_home) is robot.q_home
    assert np.array_equal(robot.expansion, np.eye(6))
    turn, slide = robot.model[27:].reshape(6, -1)[:, 7:].T.tolist()
    assert (turn, slide) == ([1.0] * 6, [0.0] * 6), "each row turns by the joint value as it is"


@pytest.mark.parametrize(
    ("rows", "field", "valid"),
    [
        ([Joint("a"), Joint("b", follows="c")], "follows of b", "a row that moves by itself: a"),
        ([Joint("a"), Joint("b", follows="b")], "follows of b", "moves by itself: a"),
        ([Joint("a"), Joint("b", follows="a"), Joint("c", follows="b")], "follows of c", "moves by itself: a"),
        ([Joint("a"), Joint("p", kind="fixed"), Joint("b", follows="p")], "follows of b", "moves by itself: a"),
        ([Joint("a"), Joint("a"), Joint("b", follows="a")], "follows of b", "one row, and several"),
        (
            [Joint("a", limits=(1.0, 2.0)), Joint("b", limits=(0.0, 1.0), follows="a", ratio=-3.0)],
            "limits of b",
            "leave a a value",
        ),
    ],
)
def test_a_row_follows_a_joint_of_the_arm_and_leaves_it_a_value(rows, field, valid):
    with pytest.raises(InputError, match=valid) as caught:
        Robot.from_dh(rows)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("given", "field", "valid"),
    [
        ({"ratio": 2.0}, "ratio of a", "1, because the row follows no joint"),
        ({"follows": "b", "ratio": 0.0}, "ratio of a", "not 0"),
        ({"follows": "b", "ratio": math.nan}, "ratio of a", "finite"),
        ({"follows": "b", "ratio": True}, "ratio of a", "finite"),
        ({"follows": "b", "kind": "fixed"}, "follows of a", "fixed"),
        ({"follows": 3}, "follows of a", "name of a row"),
    ],
)
def test_a_ratio_and_a_leader_are_checked(given, field, valid):
    with pytest.raises(InputError, match=valid) as caught:
        Joint("a", **given)
    assert caught.value.field == field


PALLETISER = """
id = "palletiser"
name = "Palletiser"
source = "made up for this test"
convention = "standard"
units = { length = "mm", angle = "deg" }

[[rows]]
name = "turn"
d = 600
a = 200
alpha = -90
limits = [-180, 180]

[[rows]]
name = "upper arm"
theta = -90
a = 900
limits = [-40, 90]

[[rows]]
name = "parallelogram"
theta = 90
follows = "upper arm"
ratio = -1

[[rows]]
name = "forearm"
a = 1000
limits = [-20, 120]

[[rows]]
name = "level"
follows = "forearm"
ratio = "-2/2"
a = 150
alpha = -90

[[rows]]
name = "tool turn"
d = 200
limits = [-350, 350]

[home]
q = [0, 10, 20, 0]
"""


def test_a_robot_file_states_what_follows_and_is_written_again(tmp_path):
    robot = kin.load_robot(PALLETISER)
    assert [joint.name for joint in robot.joints] == ["turn", "upper arm", "forearm", "tool turn"]
    assert [(row.follows, row.ratio) for row in robot.rows if row.follows] == [
        ("upper arm", -1.0),
        ("forearm", -1.0),
    ]
    kin.save_robot(robot, tmp_path / "again.toml")
    assert kin.load_robot(tmp_path / "again.toml") == robot
    assert kin.robot_from_dict(kin.robot_to_dict(robot, "m", "rad")).rows == robot.rows
    down = kin.fk(robot, robot.random_q(np.random.default_rng(4), 30))[:, :3, 2]
    assert down == pytest.approx(np.tile([0.0, 0.0, -1.0], (30, 1)), abs=1e-15), "the tool stays level"


@pytest.mark.parametrize(
    ("old", "new", "field", "valid"),
    [
        ('follows = "upper arm"', 'follows = "upper"', "rows[2].follows", "moves by itself: turn, upper arm"),
        ('follows = "upper arm"', 'follows = "level"', "rows[2].follows", "moves by itself"),
        ('follows = "upper arm"\nratio = -1', "ratio = -1", "rows[2].ratio", "follows no joint"),
        ("ratio = -1", "ratio = 0", "rows[2].ratio", "not 0"),
        ("ratio = -1", 'ratio = "1/"', "rows[2].ratio", "not a number"),
        ("ratio = -1", "ratio = -1\nlimits = [100, 110]", "rows[2].limits", "leave upper arm a value"),
        ("ratio = -1", 'ratio = -1\nkind = "fixed"', "rows[2].follows", "fixed"),
    ],
)
def test_a_robot_file_with_a_wrong_relation_is_refused_by_its_field(old, new, field, valid):
    with pytest.raises(kin.RobotFileError, match=valid) as caught:
        kin.load_robot(PALLETISER.replace(old, new))
    assert caught.value.field == field


def assert_same_arm(robot: Robot, other: Robot) -> None:
    q = robot.random_q(np.random.default_rng(5), 40)
    assert kin.fk(other, q) == pytest.approx(kin.fk(robot, q), abs=1e-12)
    assert kin.jacobian(other, q) == pytest.approx(kin.jacobian(robot, q), abs=1e-12)
    assert other.lower == pytest.approx(robot.lower)
    assert other.upper == pytest.approx(robot.upper)


@pytest.mark.parametrize("robot", [*ARMS, kin.load_robot(PALLETISER)], ids=["standard", "modified", "palletiser"])
def test_urdf_and_mjcf_carry_what_follows(robot):
    urdf = kin.robot_to_urdf(robot)
    back, report = kin.files.read_urdf(urdf, tip="tool")
    assert report.following == tuple(row.name for row in robot.rows if row.follows)
    assert report.joints == tuple(joint.name for joint in robot.joints)
    assert report.difference < 1e-12
    assert_same_arm(robot, back)
    back, report = kin.files.read_urdf(kin.robot_to_mjcf(robot))
    assert report.following == tuple(row.name for row in robot.rows if row.follows)
    assert_same_arm(robot, back)
    assert_same_arm(robot, kin.dh.convert_dh(robot, "standard" if robot.convention == "modified" else "modified"))


def urdf_of(*joints: str) -> str:
    """A chain of links, each 0.2 m behind the one before; a joint is its name, type and what stands in it."""
    links = "".join(f'<link name="l{i}"/>' for i in range(len(joints) + 2))
    found = ""
    for i, joint in enumerate(joints):
        name, kind, inside = joint.split("|")
        found += (
            f'<joint name="{name}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="0.2 0 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0 0.6 0.8"/>{inside}</joint>'
        )
    return f'<robot name="r">{links}{found}</robot>'


def beside(text: str, name: str, limits: str = "") -> str:
    """The same with a joint of this name beside the chain, on its first link."""
    joint = (
        f'<joint name="{name}" type="revolute"><parent link="l0"/><child link="aside"/><limit {limits}/></joint>'
        '<link name="aside"/></robot>'
    )
    return text.replace("</robot>", joint)


def test_a_mimic_joint_on_the_way_to_the_tool_follows_with_its_offset():
    limit = '<limit lower="-1" upper="1"/>'
    text = urdf_of(
        f'j1|revolute|{limit}<mimic joint="j3" multiplier="-2" offset="0.3"/>',
        f"j2|revolute|{limit}",
        f"j3|revolute|{limit}",
        'j4|prismatic|<limit lower="0" upper="0.2"/><mimic joint="j1" multiplier="0.1" offset="0.1"/>',
    ).replace('<link name="l5"/>', "")
    robot, report = kin.files.read_urdf(text)
    assert (report.joints, report.following) == (("j2", "j3"), ("j1", "j4"))
    assert report.difference < 1e-14
    # j1 = −2 j3 + 0.3 in ±1, and j4 = 0.1 j1 + 0.1 in 0 to 0.2: j1 from −1 to 1.
    assert robot.joints[1].limits == pytest.approx((-0.35, 0.65))
    free = kin.load_robot(text.replace('<mimic joint="j3" multiplier="-2" offset="0.3"/>', "").replace(
        '<mimic joint="j1" multiplier="0.1" offset="0.1"/>', ""
    ))  # fmt: skip
    for j2, j3 in robot.random_q(np.random.default_rng(6), 10):
        j1 = -2.0 * j3 + 0.3
        assert kin.fk(robot, [j2, j3]) == pytest.approx(kin.fk(free, [j1, j2, j3, 0.1 * j1 + 0.1]), abs=1e-14)


def test_the_first_follower_stands_for_a_leader_beside_the_arm():
    text = beside(
        urdf_of(
            'j1|revolute|<limit lower="-1" upper="1"/><mimic joint="motor" multiplier="2" offset="0.1"/>',
            'j2|revolute|<limit lower="-3" upper="3"/><mimic joint="motor" multiplier="-1" offset="0.5"/>',
        ).replace('<link name="l3"/>', ""),
        "motor",
        'lower="-0.2" upper="0.3"',
    )
    robot, report = kin.files.read_urdf(text, tip="l2")
    assert (report.joints, report.following) == (("j1",), ("j2",))
    assert robot.joints[0].limits == pytest.approx((-0.3, 0.7)), "2 times those of the motor, and 0.1"
    assert report.notes[0].startswith("Joint j1 follows motor, which is beside the arm")
    free = kin.load_robot(urdf_of("j1|continuous|", "j2|continuous|").replace('<link name="l3"/>', ""))
    motor = 0.25
    assert kin.fk(robot, [2.0 * motor + 0.1]) == pytest.approx(kin.fk(free, [0.6, -motor + 0.5]), abs=1e-14)


@pytest.mark.parametrize(
    ("mimic", "field", "valid"),
    [
        ('joint="j9"', "joint j2: mimic joint", "a joint of this file"),
        ("", "joint j2: mimic joint", "a joint of this file"),
        ('joint="j2"', "joint j2: mimic joint", "does not follow itself"),
        ('joint="j3"', "joint j3: mimic joint", "does not follow itself"),
        ('joint="j1" multiplier="0"', "joint j2: mimic multiplier", "not 0"),
        ('joint="j1" multiplier="half"', "joint j2: mimic multiplier", "finite"),
        ('joint="j1" offset="inf"', "joint j2: mimic offset", "finite"),
        ('joint="j4"', "joint j2: mimic joint", "turns or slides"),
        ('joint="j1" multiplier="0.1" offset="0.9"', "joint limits of j2", "leave j1 a value"),
    ],
)
def test_a_mimic_joint_that_cannot_be_followed_is_named(mimic, field, valid):
    text = urdf_of(
        'j1|revolute|<limit lower="-1" upper="1"/>',
        f'j2|revolute|<limit lower="0.1" upper="0.5"/><mimic {mimic}/>',
        'j3|revolute|<mimic joint="j2"/>',
        "j4|fixed|",
    )
    with pytest.raises(kin.RobotFileError, match=valid) as caught:
        kin.files.read_urdf(text, tip="l4")
    assert caught.value.field == field


def test_limits_of_a_finger_that_turns_back_do_not_hold_the_joint_that_it_follows():
    """As of Robotiq's 2F-85: both joints from 0 up, although one is −1 times the other."""
    text = urdf_of(
        'j1|revolute|<limit lower="0" upper="0.8"/>',
        'j2|revolute|<limit lower="0" upper="0.8757"/><mimic joint="j1" multiplier="-1"/>',
    ).replace('<link name="l3"/>', "")
    robot, report = kin.files.read_urdf(text)
    assert robot.joints[0].limits == (0.0, 0.8)
    assert report.notes == ("Joint j2 has limits that leave j1, which it follows, one value: they are not kept.",)
    assert kin.doctor.examine_urdf(text).arm.robot == robot


def test_an_equality_of_mjcf_counts_from_the_first_configuration():
    def mjcf(polycoef: str) -> str:
        return f"""<mujoco><compiler angle="radian"/><worldbody><body name="a">
            <joint name="lead" ref="0.4" range="-1 1"/><geom size="0.1"/><body name="b" pos="0.3 0 0">
            <joint name="follow" ref="0.1" axis="0 1 0"/><geom size="0.1"/>
            <site name="tip" pos="0.2 0 0"/></body></body></worldbody>
            <equality><joint joint1="follow" joint2="lead" {polycoef}/></equality></mujoco>"""

    robot, report = kin.files.read_urdf(mjcf('polycoef="0.05 -2 0 0 0"'), tip="tip")
    assert (report.joints, report.following) == (("lead",), ("follow",))
    free = kin.load_robot(mjcf('active="false"'), tip="tip")
    follow = 0.1 + 0.05 - 2.0 * (0.7 - 0.4)
    assert kin.fk(robot, [0.7]) == pytest.approx(kin.fk(free, [0.7, follow]), abs=1e-15)
    assert kin.fk(kin.load_robot(mjcf(""), tip="tip"), [0.7]) == pytest.approx(kin.fk(free, [0.7, 0.4]), abs=1e-15)
    with pytest.raises(kin.RobotFileError, match="linear") as caught:
        kin.load_robot(mjcf('polycoef="0 1 0.5"'), tip="tip")
    assert caught.value.field == "joint follow: equality polycoef"


def test_what_follows_a_locked_joint_stands_still_with_it():
    from kin.solvers.reduced import fixed

    robot = arm()
    q = robot.q_home.copy()
    q[0], q[2] = 0.3, 0.1
    locked = fixed(robot, {1: float(q[1])})
    assert locked.n == 2
    assert kin.fk(locked, q[[0, 2]]) == pytest.approx(kin.fk(robot, q), abs=1e-15)


def test_what_has_no_meaning_for_rows_that_follow_is_refused():
    robot = arm()
    with pytest.raises(InputError, match=r"Robot\.free"):
        kin.dh.screws(robot)
    with pytest.raises(InputError, match=r"Robot\.free"):
        kin.compare(robot, robot.free)
    q = robot.random_q(np.random.default_rng(4), 20)
    assert np.abs(kin.dh.screws(robot.free).pose(robot.expand(q)) - kin.fk(robot, q)).max() < 1e-12
    assert kin.compare(robot, kin.dh.convert_dh(robot, "modified")).verdict == "identical"


def test_bodies_of_a_follower_are_where_its_offset_puts_them():
    text = urdf_of(
        'j1|revolute|<limit lower="-1" upper="1"/>',
        'j2|revolute|<mimic joint="j1" multiplier="-1" offset="0.7"/>',
    ).replace('<link name="l3"/>', "")
    ball = '<link name="l2"><collision><origin xyz="0.1 0 0"/>'
    ball += '<geometry><sphere radius="0.05"/></geometry></collision>'
    robot = kin.load_robot(text.replace('<link name="l2"/>', ball + "</link>"))
    (capsule,) = [each for each in robot.capsules if not each.assumed]
    end = kin.link_frames(robot, [0.3])[capsule.row] @ [*capsule.start, 1.0]
    tool = kin.fk(robot, [0.3]) @ [0.1, 0.0, 0.0, 1.0]
    assert end == pytest.approx(tool, abs=1e-6)
    assert capsule.link == 2


@pytest.mark.parametrize("robot", [*ARMS, kin.load_robot(PALLETISER)], ids=["standard", "modified", "palletiser"])
def test_levers_bound_how_far_bodies_move_with_what_follows(robot):
    """The proof that a motion touches nothing rests on these bounds."""
    near = surroundings(robot, ())
    body, rng = near.bodies, np.random.default_rng(8)
    for q in robot.random_q(rng, 30):
        step = rng.uniform(-0.05, 0.05, robot.n)
        bound = lever_arms(near, np.maximum(np.abs(q), np.abs(q + step))) @ np.abs(step)
        ends = []
        for at in (q, q + step):
            frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, at)])[body.rows + 1]
            points = np.concatenate([body.shape[:, k : k + 3] for k in (0, 3)])
            both = np.concatenate([frames, frames])
            ends.append((both[:, :3, :3] @ points[:, :, None])[..., 0] + both[:, :3, 3])
        moved = np.linalg.norm(ends[1] - ends[0], axis=1)
        assert (moved <= np.concatenate([bound, bound]) + 1e-12).all()


def test_motions_keep_the_speeds_of_what_follows():
    rows = list(kin.load_robot(PALLETISER).rows)
    rows[4] = replace(rows[4], velocity=0.2)
    robot = replace(kin.load_robot(PALLETISER), rows=tuple(rows))
    target = robot.q_home + np.array([0.5, 0.4, 0.6, 1.0])
    T = kin.fk(robot, robot.q_home)
    T[:3, 3] += [0.1, 0.3, -0.1]
    motion = kin.plan_motion(
        robot, [kin.motion.Ptp(kin.motion.JointTarget(tuple(target))), kin.motion.Lin(kin.motion.PoseTarget.of(T))]
    )
    times = np.linspace(0.0, motion.duration, 200)
    sample = motion.sample(times)
    assert np.abs(sample.qd[:, 2]).max() == pytest.approx(0.2, rel=0.05)
    assert np.abs(sample.qd[:, 2]).max() <= 0.2 + 1e-9
    assert kin.fk(robot, sample.q)[:, :3, 2] == pytest.approx(np.tile([0.0, 0.0, -1.0], (200, 1)), abs=1e-12)


def test_where_joint_1_is_followed_the_workspace_is_no_body_of_revolution():
    turn = (-math.pi, math.pi)
    rows = [
        Joint("a", a=0.3, alpha=1.0, limits=turn),
        Joint("b", a=0.2, follows="a", ratio=0.5),
        Joint("c", a=0.2, limits=turn),
    ]
    robot = Robot.from_dh(rows)
    with pytest.raises(InputError, match="does not turn the whole arm"):
        kin.workspace.workspace_section(robot, resolution=8)
    x = [end.value for end in kin.workspace.workspace_facts(robot, effort=2, volume=False).x]
    sampled = kin.fk_positions(robot, robot.random_q(np.random.default_rng(9), 20_000))[:, 0]
    assert (x[0] <= sampled.min(), sampled.max() <= x[1]) == (True, True)
    assert x == pytest.approx((sampled.min(), sampled.max()), abs=0.02)
