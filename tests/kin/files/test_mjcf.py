"""MJCF against MuJoCo itself: written arms load and move as they should, and read ones move as in MuJoCo."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import CLASSICS, random_robot

import kin
from kin import InputError, Robot, RobotFileError

mujoco = pytest.importorskip("mujoco")

ARMS = list(kin.builtin_robots().values())
UR5 = kin.get_robot("ur5")
NEAR = 1e-9  # of a pose; the tables are exact to 1e-12


def loaded(text: str):
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def pose(model, data, q: np.ndarray, site: str = "tool") -> np.ndarray:
    """Where MuJoCo puts a site ``(4, 4)``."""
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = data.site(site).xmat.reshape(3, 3), data.site(site).xpos
    return T


def assert_moves_alike(robot: Robot, text: str, site: str = "tool") -> None:
    model, data = loaded(text)
    assert model.nq == len(robot.moving_rows)
    for q in robot.random_q(np.random.default_rng(2), 20):
        assert np.abs(pose(model, data, robot.expand(q), site) - kin.fk(robot, q)).max() < NEAR * max(
            1.0, robot.reach
        )


@pytest.mark.full
@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_a_built_in_arm_is_loaded_by_mujoco_and_read_back(robot):
    text = kin.robot_to_mjcf(robot)
    assert_moves_alike(robot, text)
    model, _ = loaded(text)
    assert model.jnt_range[model.jnt_limited == 1].tolist() == [
        list(row.limits) for row in robot.rows if row.limits is not None
    ]
    assert model.key("home").qpos.tolist() == robot.expand(robot.q_home).tolist()
    back, report = kin.files.read_urdf(text)
    assert report.difference < 1e-12
    assert [joint.limits for joint in back.joints] == [joint.limits for joint in robot.joints]
    assert [joint.effort for joint in back.joints] == [joint.effort for joint in robot.joints]
    q = robot.random_q(np.random.default_rng(1), 50)
    assert kin.fk(back, q) == pytest.approx(kin.fk(robot, q), abs=1e-11)


def test_an_arm_with_rows_that_follow_is_loaded_by_mujoco_with_equalities():
    rows = [
        kin.Joint("lead", d=0.2, a=0.3, alpha=1.2, limits=(-1.0, 1.0)),
        kin.Joint("rod", kind="prismatic", alpha=0.4, follows="lead", ratio=0.1),
        kin.Joint("back", a=0.2, follows="lead", ratio=-2.0),
    ]
    robot = Robot.from_dh(rows)
    model, data = loaded(kin.robot_to_mjcf(robot))
    assert (model.nq, model.neq) == (3, 2)
    for q in robot.random_q(np.random.default_rng(2), 5):
        assert np.abs(pose(model, data, robot.expand(q)) - kin.fk(robot, q)).max() < NEAR
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[: model.neq]).max() < NEAR, "both equalities hold there"


@pytest.mark.parametrize("seed", range(12))
def test_any_arm_is_loaded_by_mujoco(seed):
    robot = random_robot(np.random.default_rng(seed))
    limited = [
        replace(row, limits=row.limits or (-0.4, 0.4)) if row.kind == "prismatic" else row for row in robot.rows
    ]
    assert_moves_alike(replace(robot, rows=tuple(limited)), kin.robot_to_mjcf(robot))


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_capsules_are_where_the_arm_has_them_and_touch_where_it_says(robot):
    """Contacts that MuJoCo finds are those of `kin.clearance`: its capsules and pairs are the same.

    Arms of the library have assumed tubes along their lengths.
    """
    text = kin.robot_to_mjcf(robot)
    model, data = loaded(text)
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    assert solid.sum() == len(kin.collision.capsules(robot))
    assert sorted(model.geom_size[solid, 0]) == pytest.approx(
        sorted(c.radius for c in kin.collision.capsules(robot))
    )
    touching = 0
    for q in robot.random_q(np.random.default_rng(4), 150 if robot in CLASSICS else 25):
        distance = float(kin.clearance(robot, q))
        if abs(distance) < 1e-4:
            continue
        data.qpos[:] = robot.expand(q)
        mujoco.mj_fwdPosition(model, data)
        among = [solid[contact.geom].all() for contact in data.contact]  # the others are with the floor
        assert any(among) == (distance < 0.0), q
        touching += distance < 0.0
    if robot.id in ("ur5", "puma560"):
        assert touching > 3


MOUNTED = [
    ("floor", 0.0, np.eye(3)),
    ("table", -0.75, np.eye(3)),
    ("wall", -1.2, np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])),
    ("ceiling", -2.0, np.diag([1.0, -1.0, -1.0])),
    ("pedestal", None, np.eye(3)),
    (None, -0.3, np.eye(3)),
]


@pytest.mark.full
@pytest.mark.parametrize(("mounting", "floor", "turn"), MOUNTED)
def test_mounting_and_floor_are_written_and_read_back(mounting, floor, turn):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn, (0.1, -0.2, 0.05)
    robot = replace(UR5, base=T, mounting=mounting, floor=floor)
    text = kin.robot_to_mjcf(robot)
    assert_moves_alike(robot, text)
    model, data = loaded(text)
    planes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    mujoco.mj_kinematics(model, data)
    assert [data.geom_xpos[i].tolist() for i in planes] == ([] if floor is None else [[0.0, 0.0, floor]])
    for written in (text, kin.robot_to_urdf(robot)):
        back = kin.load_robot(written)
        assert (back.mounting, back.floor) == (mounting, floor)
        q = robot.random_q(np.random.default_rng(1), 50)
        assert kin.fk(back, q) == pytest.approx(kin.fk(robot, q), abs=1e-11)


def test_links_touch_the_floor_but_for_the_first_one():
    robot = replace(UR5, mounting="floor", floor=0.0)
    model, data = loaded(kin.robot_to_mjcf(robot))

    def on_floor(q: np.ndarray) -> set[int]:
        """The bodies that touch the plane."""
        data.qpos[:] = q
        mujoco.mj_fwdPosition(model, data)
        (plane,) = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
        return {int(model.geom_bodyid[i]) for each in data.contact if plane in each.geom for i in each.geom} - {0}

    assert on_floor(robot.q_home) == set()
    down = np.radians([0.0, 60.0, 0.0, 0.0, 0.0, 0.0])
    assert kin.fk(robot, down)[2, 3] < 0.0, "the tool is below the floor"
    assert on_floor(down)
    assert model.body(robot.joints[0].name).id not in on_floor(down)


def test_a_urdf_with_a_mounting_is_loaded_by_mujoco():
    T = np.diag([1.0, -1.0, -1.0, 1.0])
    robot = replace(UR5, base=T, mounting="ceiling", floor=-2.0)
    bodies = "".join(
        f'<link name="link_{k}"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for k in range(1, 7)
    )
    text = kin.robot_to_urdf(robot)
    for k in range(1, 7):
        text = text.replace(f'  <link name="link_{k}"/>\n', "")
    text = text.replace('  <link name="tool"/>\n', f'  <link name="tool"/>{bodies}\n')
    text = text.replace("<kinboard", '<mujoco><compiler fusestatic="false"/></mujoco><kinboard')
    model, data = loaded(text)
    for q in robot.random_q(np.random.default_rng(2), 5):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        assert data.body("tool").xpos == pytest.approx(kin.fk(robot, q)[:3, 3], abs=1e-9)


@pytest.mark.parametrize(
    ("attributes", "field"),
    [
        ('mounting="boat"', "kinboard: mounting"),
        ('mounting="floor" floor="deep"', "kinboard: floor"),
        ('floor="inf"', "kinboard: floor"),
        ('floor="1e300"', "kinboard: floor"),
    ],
)
def test_what_is_no_mounting_is_refused_by_name(attributes, field):
    text = kin.robot_to_urdf(replace(UR5, mounting="floor")).replace('mounting="floor"', attributes)
    with pytest.raises(RobotFileError) as error:
        kin.load_robot(text)
    assert error.value.field == field


def test_what_an_inner_link_stands_on_is_not_what_the_world_holds():
    robot = replace(UR5, mounting="ceiling", floor=-2.0, base=np.diag([1.0, -1.0, -1.0, 1.0]))
    inner = kin.load_robot(kin.robot_to_urdf(robot), base="base")
    assert (inner.mounting, inner.floor) == ("floor", 0.0)


@pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
def test_masses_are_said_to_be_assumed(robot):
    text = kin.robot_to_mjcf(robot)
    assert "Masses and inertia are assumed: 1000 kg/m3" in text
    model, data = loaded(text)
    assert (model.body_mass[2:] > 0.0).all(), "MuJoCo refuses a moving body without mass"
    shapes = kin.collision.capsules(robot)
    volume = sum(math.pi * c.radius**2 * (math.dist(c.start, c.end) + 4.0 / 3.0 * c.radius) for c in shapes)
    balls = len(robot.moving_rows) - len({c.link for c in shapes} - {0})  # links without a capsule weigh 0.1 kg
    assert model.body_mass.sum() == pytest.approx(1000.0 * volume + 0.1 * balls)
    mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()


def test_limits_that_leave_no_motion_are_refused():
    arm = kin.get_robot("planar2r")
    rows = (replace(arm.rows[0], limits=(0.5, 0.5)), *arm.rows[1:])
    with pytest.raises(InputError, match="limits of"):
        kin.robot_to_mjcf(replace(arm, rows=rows, home=(0.5, 0.0)))


# Everything that is written in another way than `robot_to_mjcf` does.
RICH = """<mujoco model="rich">
  <compiler {compiler}/>
  <default>
    <joint axis="0 1 0" limited="auto"/>
    <default class="big"><joint range="-100 120" damping="2"/><geom type="capsule" size="0.05 0.1"/></default>
    <default class="slow"><joint type="slide" range="0 0.3"/></default>
  </default>
  <asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
  <worldbody>
    <light pos="0 0 3"/><geom type="plane" size="1 1 0.1"/>
    <body name="foot" pos="0.1 0.2 0.3" euler="10 20 30">
      <geom type="box" size="0.1 0.1 0.1"/>
      <body name="turret" pos="0 0 0.1" axisangle="1 2 3 40" childclass="big">
        <joint name="pan" axis="0 0 2" pos="0.02 0 0" ref="25"/>
        <joint name="tilt" pos="0 0.1 0.05" axis="1 1 0"/>
        <geom pos="0 0 0.1" zaxis="1 0 1"/><geom type="mesh" mesh="m" contype="0" conaffinity="0"/>
        <frame pos="0.1 0 0" xyaxes="0 1 0 -1 0 0.2">
          <body name="boom" pos="0.3 0 0" quat="1 0.2 0.3 0">
            <joint name="boom" class="slow" ref="0.1"/>
            <geom type="capsule" size="0.03" fromto="0 0 0 0.2 0 0.1" contype="0" conaffinity="0"/>
            <body zaxis="1 0.3 0.2"><joint name="roll" range="-3 3" limited="false"/>
              <geom type="sphere" size="0.04"/>
              <site name="tcp" pos="0.1 0 0.2" quat="0.5 0.5 0.5 -0.5"/>
            </body>
          </body>
        </frame>
      </body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(
    "compiler",
    ['angle="degree"', "", 'eulerseq="ZYX"', 'eulerseq="zxz" angle="degree"', 'eulerseq="xYz"'],
)
def test_what_is_read_moves_as_in_mujoco(compiler):
    text = RICH.format(compiler=compiler)
    robot, report = kin.files.read_urdf(text)
    assert (report.base, report.tip, report.joints) == ("world", "tcp", ("pan", "tilt", "boom", "roll"))
    assert robot.source.startswith("MJCF")
    assert_moves_alike(robot, text, "tcp")
    model, _ = loaded(text)
    limits = [joint.limits for joint in robot.joints]
    assert limits[3] is None
    assert np.array(limits[:3]) == pytest.approx(model.jnt_range[:3])
    assert report.bodies[1].names == ()
    assert {name for body in report.bodies for name in body.names} >= {"foot", "turret"}


def test_radians_are_read_as_such():
    text = RICH.format(compiler='angle="radian"').replace("-100 120", "-2 2").replace('ref="25"', 'ref="0.4"')
    text = text.replace("1 2 3 40", "1 2 3 0.7").replace("10 20 30", "0.1 0.2 0.3")
    robot = kin.load_robot(text)
    assert robot.joints[0].limits == (-2.0, 2.0)
    assert_moves_alike(robot, text, "tcp")


@pytest.mark.full
def test_capsules_of_mjcf_are_those_of_the_arm():
    arm = kin.get_robot("ur5")
    back = kin.load_robot(kin.robot_to_mjcf(arm))
    q = arm.random_q(np.random.default_rng(9), 40)
    assert kin.clearance(back, q) == pytest.approx(kin.clearance(arm, q), abs=0.02)


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("<worldbody>", '<include file="/etc/passwd"/><worldbody>', "<include>"),
        ('euler="10 20 30"', 'euler="10 20"', "body foot: euler"),
        ('euler="10 20 30"', 'euler="10 20 nan"', "body foot: euler"),
        ('axis="1 1 0"', 'axis="0 0 0"', "joint tilt: axis"),
        ('class="slow" ref', 'class="fast" ref', "joint boom: class"),
        ('quat="1 0.2 0.3 0"', 'quat="0 0 0 0"', "body boom: quat"),
        ('name="roll" range="-3 3"', 'name="roll" type="ball"', "joint roll: type"),
        ('name="roll" range="-3 3"', 'name="roll" type="screw"', "joint roll: type"),
        ('range="0 0.3"', 'range="0.3 0" limited="true"', "joint boom: range"),
        ('<compiler angle="degree"/>', '<compiler eulerseq="abc"/>', "compiler eulerseq"),
        ('<compiler angle="degree"/>', '<compiler coordinate="global"/>', "compiler coordinate"),
        (
            "</worldbody>",
            '</worldbody><equality><joint joint1="roll" joint2="pan" polycoef="0 1 0.1"/></equality>',
            "joint roll: equality polycoef",
        ),
    ],
)
def test_what_is_no_serial_arm_is_refused_with_its_place(old, new, field):
    text = RICH.format(compiler='angle="degree"')
    assert old in text
    with pytest.raises(RobotFileError) as caught:
        kin.load_robot(text.replace(old, new, 1))
    assert caught.value.field == field


def test_a_cup_on_the_table_is_no_end_of_the_arm_but_a_camera_on_a_pole_is():
    text = RICH.format(compiler='angle="degree"')
    cup = text.replace("</worldbody>", '<body name="cup"><freejoint/></body></worldbody>')
    assert kin.load_robot(cup) == kin.load_robot(text)
    pole = text.replace("</worldbody>", '<body name="pole"><joint/></body></worldbody>')
    with pytest.raises(RobotFileError, match=r"tip: got .*tcp \(4 joints\), pole \(1 joint\)"):
        kin.load_robot(pole)
    assert kin.load_robot(pole, tip="tcp").n == 4


def test_a_slide_may_be_unlimited():
    text = RICH.format(compiler='angle="degree"').replace('range="0 0.3"', 'range="0 0.3" limited="false"')
    robot, report = kin.files.read_urdf(text)
    assert "Joint boom states no range: it gets 0 to 1 m." in report.notes
    assert (0.0, 1.0) in [joint.limits for joint in robot.joints]


def test_deep_and_large_files_are_bounded():
    deep = "<mujoco><worldbody>" + "<body>" * 200 + "</body>" * 200 + "</worldbody></mujoco>"
    with pytest.raises(RobotFileError, match="nested"):
        kin.load_robot(deep)
    many = "<mujoco><worldbody>" + "<body><joint/></body>" * 6000 + "</worldbody></mujoco>"
    with pytest.raises(RobotFileError, match="at most 5000 links"):
        kin.load_robot(many)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name="roll" range', 'name="roll" rnage="1 2" range', "Joint roll: rnage of <joint> is not read"),
        ('<body name="foot"', '<body mocap="true" name="foot"', "Body foot: mocap of <body> is not read: a body"),
        ('<body name="foot"', '<body rpy="0 0 1" name="foot"', "Body foot: rpy of <body> is not read"),
        ('<compiler angle="degree"', '<compiler unit="mm" angle="degree"', "The file: unit of <compiler>"),
    ],
)
def test_what_is_not_read_of_the_arm_is_named(old, new, words):
    text = RICH.format(compiler='angle="degree"')
    assert old in text
    robot, report = kin.files.read_urdf(text.replace(old, new, 1))
    assert sum(words in note for note in report.notes) == 1
    assert np.allclose(kin.fk(robot, robot.q_home), kin.fk(kin.load_robot(text), robot.q_home), atol=1e-12)


def test_a_range_of_zeros_is_none_and_an_unlimited_force_is_unknown():
    text = RICH.format(compiler='angle="degree"').replace(
        'name="roll" range="-3 3"', 'name="roll" range="0 0" actuatorfrcrange="-5 5" actuatorfrclimited="false"'
    )
    joint = next(each for each in kin.load_robot(text).joints if each.name == "roll")
    assert (joint.limits, joint.effort) == (None, None)


def test_a_site_from_a_point_to_another_is_where_mujoco_has_it():
    text = (
        '<mujoco><worldbody><body name="b"><joint name="a"/><geom size="1"/>'
        '<site name="s" type="capsule" size=".1" fromto="0.1 0.2 0.3 1 0 0.5"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    T = kin.fk(kin.load_robot(text, tip="s"), [0.0])
    assert np.allclose(T[:3, 3], data.site_xpos[0], atol=1e-12)
    assert np.allclose(T[:3, :3], data.site_xmat[0].reshape(3, 3), atol=1e-12)


BALL = "joint j: type", "hinge or slide"
ONE = """<mujoco model="one"><compiler angle="radian"/><worldbody><body name="base">{joint}
<body name="arm" pos="0 0 0.3"><joint name="bend" axis="0 1 0" range="-1 1"/><geom size="0.02" mass="1"/></body>
</body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("joint", "words"),
    [
        ('<joint name="j" type="slide"/>', "Joint j states no range: it gets 0 to 1 m."),
        ('<joint name="j" type="ball"/>', "Joint j is a ball joint: the arm begins behind it, at body j of base."),
        ('<freejoint name="j"/>', "Joint j is a free joint: the arm begins behind it, at body j of base."),
    ],
)
def test_notes_are_in_the_words_of_mujoco(joint, words):
    robot, report = kin.files.read_urdf(ONE.format(joint=joint))
    assert words in report.notes
    assert robot.source.startswith("MJCF, from body ")
    assert robot.source.endswith(" to body arm")
    assert "URDF" not in f"{robot.source}{report.about_bodies}{report.notes}"


@pytest.mark.parametrize(
    ("joint", "keywords", "field", "valid"),
    [
        ('<joint name="j" limited="true" range="1 -1"/>', {}, "joint j: range", "range[0] < range[1]"),
        ('<joint name="j" limited="true" range="1 1"/>', {}, "joint j: range", "range[0] < range[1]"),
        ('<joint name="j" range="0 2e6"/>', {}, "joint j: range", "smaller than a million"),
        ('<joint name="j" range="0"/>', {}, "joint j: range", "2 numbers"),
        ('<joint name="j" type="turn"/>', {}, "joint j: type", "hinge, slide, ball, free"),
        ('<body name="m"><joint name="j" type="ball"/></body>', {"base": "base", "tip": "m"}, *BALL),
    ],
)
def test_refusals_are_in_the_words_of_mujoco(joint, keywords, field, valid):
    with pytest.raises(kin.RobotFileError) as refused:
        kin.files.read_urdf(ONE.format(joint=joint), **keywords)
    assert refused.value.field == field
    assert valid in refused.value.expected
    assert "URDF" not in str(refused.value)


def test_a_file_without_joints_of_an_arm_says_which_it_lacks():
    with pytest.raises(kin.RobotFileError, match="a chain with hinge or slide joints"):
        kin.files.read_urdf('<mujoco><worldbody><body name="a"><geom size="1"/></body></worldbody></mujoco>')


@pytest.mark.parametrize("limited", ["auto", "true", "false"])
@pytest.mark.parametrize("values", ["-1 1", "1 -1", "1 1", "0 0"])
def test_which_ranges_count_and_which_are_refused_is_mujocos_choice(limited, values):
    text = ONE.format(joint=f'<joint name="j" limited="{limited}" range="{values}"/><geom size="0.1" mass="1"/>')
    if limited == "true" and values != "-1 1":
        with pytest.raises(ValueError, match=r"range\[0\] should be smaller than range\[1\]"):
            mujoco.MjModel.from_xml_string(text)
        with pytest.raises(kin.RobotFileError, match="range"):
            kin.load_robot(text)
        return
    model = mujoco.MjModel.from_xml_string(text)
    limits = tuple(model.jnt_range[0].tolist()) if model.jnt_limited[0] else None
    assert kin.load_robot(text).joints[0].limits == limits
