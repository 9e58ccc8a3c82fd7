"""URDF files: what they mean, what is refused, and the same arm written again."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from arms import random_robot
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import InputError, Joint, Robot, RobotFileError
from kin.files.urdf.tree import MAX_LINKS
from kin.files.urdf.xml import MAX_BYTES
from kin.solvers import closed_form_of

EXACT = 1e-12
FILES = Path(__file__).parents[1] / "data" / "urdf"

GOOD = """<?xml version="1.0"?>
<robot name="Bench arm 2">
  <link name="world"/><link name="foot"/><link name="upper"/><link name="rail"/><link name="hand"/>
  <link name="tcp"/><link name="camera"/>
  <joint name="stand" type="fixed">
    <parent link="world"/><child link="foot"/><origin xyz="0.1 0 0.5" rpy="0 0 1.5707963267948966"/>
  </joint>
  <joint name="shoulder" type="revolute">
    <parent link="foot"/><child link="upper"/><origin xyz="0 0 0.2"/><axis xyz="0 0 -2"/>
    <limit lower="-1" upper="2" velocity="3" effort="0"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="upper"/><child link="rail"/><origin xyz="0.3 0 0" rpy="0.1 0.2 0.3"/><axis xyz="0 1 1"/>
    <limit lower="0" upper="0.4" velocity="0.5" effort="80"/>
  </joint>
  <joint name="wrist" type="continuous">
    <parent link="rail"/><child link="hand"/><origin xyz="0 0.05 0"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="hand"/><child link="tcp"/><origin xyz="0 0 0.1"/></joint>
  <joint name="mount" type="fixed"><parent link="upper"/><child link="camera"/></joint>
  <transmission name="not a joint"><joint name="shoulder"/></transmission>
</robot>
"""


def test_a_chain_becomes_a_robot():
    robot, report = kin.files.read_urdf(GOOD, tip="tcp")
    assert (robot.id, robot.name, robot.n) == ("bench-arm-2", "Bench arm 2", 3)
    assert [row.kind for row in robot.joints] == ["revolute", "prismatic", "revolute"]
    assert [row.limits for row in robot.joints] == [(-1.0, 2.0), (0.0, 0.4), None]
    assert [row.velocity for row in robot.joints] == [3.0, 0.5, None]
    assert [row.effort for row in robot.joints] == [None, 80.0, None]
    assert (report.base, report.tip, report.joints) == ("world", "tcp", ("shoulder", "slide", "wrist"))
    assert (report.merged, report.ignored) == (("stand", "flange"), ("mount",))
    assert [(tip.link, tip.joints) for tip in report.tips] == [("tcp", 3), ("camera", 1)]
    assert kin.files.urdf_tips(GOOD) == report.tips
    assert report.difference <= EXACT
    # Zero positions and directions are those of the file: the shoulder turns about −z.
    zero, turned = kin.fk(robot, [0, 0, 0]), kin.fk(robot, [0.5, 0, 0])
    c, s = math.cos(0.5), math.sin(0.5)
    place = np.array([0.1, 0, 0])
    assert turned[:3, 3] - place == pytest.approx(
        np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ (zero[:3, 3] - place), abs=1e-12
    )
    assert kin.load_robot(GOOD, tip="tcp") == robot


BESIDE = """
  <joint name="finger" type="prismatic">
    <parent link="hand"/><child link="claw"/><origin xyz="0 0.1 0"/><limit lower="0" upper="0"/>
  </joint>
  <link name="claw"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
</robot>"""


@pytest.mark.parametrize(
    ("old", "new", "placed"),
    [
        ("", "", True),
        ('lower="0" upper="0"', 'lower="2" upper="wide"', True),
        ('lower="0" upper="0"', 'lower="wide" upper="nan"', True),
        ('xyz="0 0.1 0"', 'xyz="0 0.1"', False),
        ('type="prismatic"', 'type="magnetic"', True),
    ],
)
def test_only_joints_of_the_chain_are_judged(old, new, placed):
    """A gripper joint beyond the tip may have limits without a range, or say what nobody can read."""
    text = GOOD.replace("</robot>", BESIDE.replace(old, new))
    robot, report = kin.files.read_urdf(text, tip="tcp")
    assert (robot.n, "finger" in report.ignored) == (3, True)
    assert any("claw" in body.names for body in report.bodies) is placed
    if old:
        with pytest.raises(RobotFileError, match="joint finger"):
            kin.files.read_urdf(text, tip="claw")
    else:
        assert (
            "Joint finger has limits that are both zero" in kin.files.read_urdf(text, tip="claw").report.notes[0]
        )


def test_base_and_tip_may_be_any_links_of_the_chain(tmp_path):
    path = tmp_path / "bench.urdf"
    path.write_text(GOOD, encoding="utf-8")
    robot, report = kin.files.read_urdf(path, base="upper", tip="hand")
    assert report.joints == ("slide", "wrist")
    assert robot.source == "URDF bench.urdf, from link upper to link hand"


@pytest.mark.parametrize(
    ("old", "new", "field", "valid"),
    [
        ("<robot name", "<robots name", "file", "well-formed"),
        ('type="continuous"', 'type="spherical"', "joint wrist: type", "continuous"),
        ('type="continuous"', 'type="floating"', "joint wrist: type", "base hand"),
        ('type="continuous"', 'type="planar"', "joint wrist: type", "base hand"),
        ('<parent link="rail"/>', "", "joint wrist: parent", "parent"),
        ('<parent link="rail"/>', "<parent/>", "joint wrist: parent link", "text"),
        ('<parent link="rail"/>', '<parent link="nail"/>', "joint wrist: parent", "link of this file"),
        ('<child link="camera"/>', '<child link="rail"/>', "link rail", "one parent"),
        ('<link name="camera"/>', '<link name="rail"/>', "link", "no other link"),
        ('name="mount"', 'name="wrist"', "joint", "no other joint"),
        ('xyz="0 0 0.2"', 'xyz="0 0 nan"', "joint shoulder: origin xyz[2]", "finite"),
        ('xyz="0 0 0.2"', 'xyz="0 0 1e999"', "joint shoulder: origin xyz[2]", "million"),
        ('xyz="0 0 0.2"', 'xyz="0 0 ${h}"', "joint shoulder: origin xyz[2]", "xacro"),
        ('xyz="0 0 0.2"', 'xyz="0 0.2"', "joint shoulder: origin xyz", "three numbers"),
        ('rpy="0.1 0.2 0.3"', 'rpy="0.1 x 0.3"', "joint slide: origin rpy[1]", "finite"),
        ('xyz="0 0 -2"', 'xyz="0 0 0"', "joint shoulder: axis xyz", "not zero"),
        ('velocity="3"', 'velocity="nan"', "joint shoulder: limit velocity", "0 stands for unknown"),
        ('velocity="3"', 'velocity="3" jerk="fast"', "joint shoulder: limit jerk", "0 stands for unknown"),
        ('xyz="0 0 0.2"', 'xyz="0 0 0.2" quat_xyzw="0 0 1"', "joint shoulder: origin quat_xyzw", "four numbers"),
        ('xyz="0 0 0.2"', 'xyz="0 0 0.2" quat_xyzw="0 0 0 0"', "joint shoulder: origin quat_xyzw", "no direction"),
        ('xyz="0 0 0.2"', 'xyz="0 0 0.2" quat_xyzw="0 0 0.24 0"', "joint shoulder: origin quat_xyzw", "length 1"),
        ('xyz="0 0 0.2"', 'rpy="0 0 0" quat_xyzw="0 0 0 1"', "joint shoulder: origin", "one of them"),
        ('upper="0.4"', 'upper="2e5"', "joint slide: limit", "with the base"),
        ('lower="-1" upper="2"', 'lower="-inf" upper="2"', "joint shoulder: limit lower", "finite"),
        ('xyz="0 0 0.2"', 'xyz="1e5 0 0.2"', "joint shoulder: origin xyz", "with the base"),
        ('<robot name="Bench arm 2">', '<robot xmlns:xacro="x" name="x"><xacro:if value="1"/>', "file", "xacro"),
    ],
)
def test_an_error_names_the_joint_and_what_is_valid(old, new, field, valid):
    assert old in GOOD
    with pytest.raises(RobotFileError) as caught:
        kin.load_robot(GOOD.replace(old, new, 1), tip="tcp")
    assert caught.value.field == field
    assert valid in caught.value.expected


def test_a_tip_is_offered():
    with pytest.raises(RobotFileError, match=r"tip: got 'no tip.*one of tcp \(3 joints\), camera \(1 joint\)"):
        kin.load_robot(GOOD)
    with pytest.raises(RobotFileError, match=r"tip: got 'tool'.*one of tcp"):
        kin.load_robot(GOOD, tip="tool")
    with pytest.raises(RobotFileError, match=r"base: got 'rail'.*on the way to camera"):
        kin.load_robot(GOOD, base="rail", tip="camera")
    with pytest.raises(RobotFileError, match=r"base: got 'ground'"):
        kin.load_robot(GOOD, base="ground", tip="tcp")
    with pytest.raises(RobotFileError, match="a link that joints move"):
        kin.load_robot(GOOD, tip="foot")
    only = GOOD.replace('<link name="camera"/>', "").replace(
        '<joint name="mount" type="fixed"><parent link="upper"/><child link="camera"/></joint>', ""
    )
    assert kin.load_robot(only).n == 3
    with pytest.raises(RobotFileError, match="no moving joints"):
        kin.load_robot('<robot name="x"><link name="a"/></robot>')


def test_cycles_are_refused():
    text = "<robot name='x'><link name='a'/><link name='b'/>"
    for name, parent, child in (("j", "a", "b"), ("k", "b", "a")):
        text += f"<joint name='{name}' type='continuous'><parent link='{parent}'/><child link='{child}'/></joint>"
    with pytest.raises(RobotFileError, match="no cycle"):
        kin.load_robot(text + "</robot>")
    beside = (
        "<link name='c'/><link name='d'/><joint name='l' type='continuous'><parent link='c'/><child link='d'/>"
    )
    assert kin.load_robot(text + beside + "</joint></robot>", tip="d").n == 1  # the cycle is not on its way
    with pytest.raises(RobotFileError, match="no cycle"):
        kin.load_robot(text + beside + "</joint></robot>", tip="b")
    with pytest.raises(RobotFileError, match="no cycle"):
        kin.load_robot(text + beside + "</joint></robot>")


GRIPPER = """
  <link name="palm"/><link name="left"/><link name="right"/>
  <joint name="grip" type="fixed"><parent link="tcp"/><child link="palm"/></joint>
  <joint name="left" type="prismatic"><parent link="palm"/><child link="left"/></joint>
  <joint name="right" type="prismatic"><parent link="palm"/><child link="right"/></joint>
</robot>"""


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('<child link="right"/>', '<child link="rihgt"/>', "joint right: child"),
        ('<child link="right"/>', "", "joint right: child"),
        ('<child link="right"/>', '<child link="left"/>', "link left"),
        (
            '<parent link="palm"/><child link="right"/>',
            '<parent link="plam"/><child link="right"/>',
            "joint right: parent",
        ),
        ('<joint name="right"', '<joint name="left"', "joint"),
        ('<joint name="right"', "<joint", "joint name"),
        ('<link name="right"/>', '<link name="right"/><link name="right"/>', "link"),
        ('<link name="right"/>', '<link name="right"/><link/>', "link name"),
        ('<parent link="palm"/><child link="right"/>', '<parent link="right"/><child link="right"/>', "joint"),
    ],
)
def test_what_is_wrong_beside_the_chain_is_left_out(old, new, field):
    """Other readers take such a file; it concerns the arm only if it may be a part of it."""
    assert old in GRIPPER
    text = GOOD.replace("</robot>", GRIPPER.replace(old, new))
    whole, _ = kin.files.read_urdf(GOOD.replace("</robot>", GRIPPER), base="world", tip="tcp")
    robot, _ = kin.files.read_urdf(text, base="world", tip="tcp")
    assert robot == whole
    if "plam" not in new and new != "<joint":
        assert kin.load_robot(text, tip="tcp") == whole
    with pytest.raises(RobotFileError) as caught:
        kin.load_robot(text)
    assert caught.value.field == field


@pytest.mark.parametrize("wrong", ['<child link="rial"/>', ""])
def test_an_arm_is_never_cut_short_by_a_joint_that_is_left_out(wrong):
    """The chain to the tool would begin behind the joint."""
    text = GOOD.replace('<child link="rail"/>', wrong)
    with pytest.raises(RobotFileError, match=r"joint slide: child"):
        kin.load_robot(text, tip="tcp")
    assert kin.load_robot(text, base="rail", tip="tcp").n == 1


TWO = """<robot name="two"><link name="a"/><link name="b"/><link name="c"/><link name="t"/>
  <joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/></joint>
  <joint name="k" type="revolute"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1"/></joint>
  <joint name="end" type="fixed"><parent link="c"/><child link="t"/><origin xyz="1 0 0"/></joint>
</robot>"""
BOMB = '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>'


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (BOMB, "DOCTYPE"),
        ('<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot/>', "DOCTYPE"),
        ("<robot>" + "<link>" * 100 + "</link>" * 100 + "</robot>", "<link>"),
        ("<robot>" + "<link/>" * 100_001 + "</robot>", "file"),
        ("<robot>" + " " * MAX_BYTES + "</robot>", "file"),
        ("<robot>", "file"),
        ("<!-- nothing -->", "file"),
        ("<sdf/>", "root element"),
        (TWO.replace('xyz="0 0 1"', f'xyz="{"1" * 100_000}x 0 0"'), "joint k: axis xyz[0]"),
        (TWO.replace('xyz="0 0 1"', f'xyz="{"1" * 61} 0 0"'), "joint k: axis xyz[0]"),
        ("/etc/hostname", "file"),
        ("<robot name='x'>\ud800</robot>", "tip"),
    ],
    ids=lambda value: value[:24],
)
def test_hostile_xml_is_refused_at_once(text, field):
    start = time.process_time()
    with pytest.raises(RobotFileError) as caught:
        kin.files.read_urdf(text)
    assert caught.value.field == field
    assert len(str(caught.value)) < 400
    assert time.process_time() - start < 5.0


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.urdf", tmp_path, Path("a\0b")):
        with pytest.raises(RobotFileError, match="readable"):
            kin.load_robot(path)
    path = tmp_path / "klingon.urdf"
    path.write_text('<?xml version="1.0" encoding="klingon"?>' + TWO)
    with pytest.raises(RobotFileError, match="file: got 'unknown encoding"):
        kin.load_robot(path)


def test_a_text_of_read_urdf_is_never_a_path(tmp_path):
    path = tmp_path / "two.urdf"
    path.write_text(TWO, encoding="utf-8")
    assert kin.load_robot(path).n == kin.load_robot(str(path)).n == 2
    with pytest.raises(RobotFileError, match=r"the text of a URDF, or the Path of a file: pathlib\.Path"):
        kin.files.read_urdf(str(path))


@pytest.mark.parametrize("encoding", ["iso-8859-1", "utf-16", "klingon"])
def test_a_text_is_decoded_already(encoding):
    text = f'<?xml version="1.0" encoding="{encoding}"?>' + TWO.replace('"two"', '"Bär"')
    assert kin.load_robot(text).name == "Bär"


@pytest.mark.parametrize("axis", ["0 1e-8 1", "1e-8 0 -1", "1e-9 2e-9 1", "0 1e-300 1", "0 0 -1"])
def test_axes_that_are_almost_z_are_kept(axis):
    _, report = kin.files.read_urdf(TWO.replace('xyz="0 0 1"', f'xyz="{axis}"'))
    assert report.difference < 2e-15
    assert report.notes == ()


def test_a_difference_beyond_rounding_is_noted(monkeypatch):
    monkeypatch.setattr("kin.files.urdf.read._difference", lambda *_: 3e-12)
    assert "up to 3.0e-12" in kin.files.read_urdf(TWO).report.notes[0]
    far = TWO.replace('origin xyz="1 0 0"', 'origin xyz="2 0 0"')
    assert kin.files.read_urdf(far).report.notes == ()  # of a reach of 4 m


def test_huge_limits_stand_for_none():
    limit = '<limit lower="-1e16" upper="1e16" effort="1e6" velocity="inf"/>'
    robot, report = kin.files.read_urdf(TWO.replace('<limit lower="-1" upper="1"/>', limit))
    joint = robot.joints[1]
    assert (joint.limits, joint.velocity, joint.effort) == (None, None, None)
    assert report.notes == (
        "Joint k has limits of 900000 rad or more both ways, which stand for none: it is read as unlimited.",
        "Joint k has velocity inf: it is read as unknown.",
        "Joint k has effort 1e+06: it is read as unknown.",
    )


def test_names_of_tilts_are_distinct():
    text = TWO.replace('xyz="0 0 1"', 'xyz="1e-3 0 1"').replace('name="k"', 'name="j tilt"')
    robot, report = kin.files.read_urdf(text)
    assert [row.name for row in robot.rows] == ["j", "j tilt 2", "j tilt"]
    assert report.tilts == ("j tilt 2",)
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot


def test_what_is_read_from_a_long_name_can_be_written():
    robot = kin.load_robot(TWO.replace('name="two"', f'name="{"x" * 199} y"'))
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot


def test_too_many_joints_are_refused():
    links = "".join(f"<link name='l{i}'/>" for i in range(34))
    joints = "".join(
        f"<joint name='j{i}' type='continuous'><parent link='l{i}'/><child link='l{i + 1}'/></joint>"
        for i in range(33)
    )
    with pytest.raises(RobotFileError, match="33 moving joints"):
        kin.load_robot(f"<robot name='x'>{links}{joints}</robot>")


def comb(teeth: int) -> str:
    """A chain with another link at each of its links."""
    parts = ["<link name='l0'/>"]
    for i in range(teeth):
        for child in (f"l{i + 1}", f"t{i}"):
            ends = f"<parent link='l{i}'/><child link='{child}'/>"
            parts.append(f"<link name='{child}'/><joint name='to_{child}' type='continuous'>{ends}</joint>")
    return f"<robot name='comb'>{''.join(parts)}</robot>"


def steps_to_read(teeth: int) -> int:
    """Lines of Python that reading a comb takes."""
    text, steps, before = comb(teeth), 0, sys.gettrace()

    def count(*_: object) -> object:
        nonlocal steps
        steps += 1
        return count

    sys.settrace(count)
    try:
        kin.files.read_urdf(text, tip="t3")
    finally:
        sys.settrace(before)
    return steps


def test_the_work_grows_no_faster_than_the_file():
    steps_to_read(10)  # fills caches
    few, many, most = map(steps_to_read, (100, 300, 500))
    assert most - many <= 1.1 * (many - few)


def test_the_number_of_links_is_bounded():
    largest = comb((MAX_LINKS - 1) // 2)
    assert len(largest) < MAX_BYTES
    robot, report = kin.files.read_urdf(largest, tip="t3")
    assert robot.n == 4
    assert report.tips[0] == ("l2499", 2499)
    with pytest.raises(RobotFileError, match=r"link: got '5001 links'.*at most 5000 links"):
        kin.files.read_urdf(comb(MAX_LINKS // 2), tip="t3")


def test_a_joint_without_limits_is_noted():
    robot, report = kin.files.read_urdf(GOOD.replace('lower="-1" upper="2" ', ""), tip="tcp")
    assert robot.joints[0].limits == (-math.pi, math.pi)
    assert report.notes == ("Joint shoulder states no limits: it gets −180° to 180°.",)


@pytest.mark.parametrize(
    ("name", "tip", "family", "same_as"),
    [
        ("panda", "panda_link8", "offset7", "panda"),
        ("ur5", "ee_link", "parallel6", None),
        ("so101", "gripper_frame_link", "parallel5", None),
    ],
)
def test_manufacturers_files(name, tip, family, same_as):
    robot, report = kin.files.read_urdf(FILES / f"{name}.urdf", tip=tip)
    assert report.difference <= EXACT
    assert report.tilts == ()
    form = closed_form_of(robot)
    assert (form and form.name) == family
    assert kin.load_robot(kin.robot_to_toml(robot)) == robot
    if same_as:  # the built-in arm, up to its own rounding
        ours = kin.get_robot(same_as)
        q = ours.random_q(np.random.default_rng(0), 100)
        assert np.abs(kin.fk(ours, q) - kin.fk(robot, q)).max() < 1e-9


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_a_built_in_arm_written_and_read(robot):
    again, report = kin.files.read_urdf(kin.robot_to_urdf(robot))
    q = robot.random_q(np.random.default_rng(0), 100)
    assert np.abs(kin.fk(robot, q) - kin.fk(again, q)).max() <= EXACT
    assert report.difference <= EXACT
    assert [joint.limits for joint in again.joints] == [joint.limits for joint in robot.joints]
    assert len(again.rows) <= len(robot.rows)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_any_arm_written_and_read(seed):
    robot = random_robot(seed)
    again, report = kin.files.read_urdf(kin.robot_to_urdf(robot))
    q = robot.random_q(np.random.default_rng(0), 16)
    assert np.abs(kin.fk(robot, q) - kin.fk(again, q)).max() <= EXACT
    assert report.difference <= EXACT


@pytest.mark.parametrize(
    ("parent", "rpy", "mounting"),
    [
        ("world", "0 0 1.5708", "floor"),
        ("world", "3.14159265 0 0", "ceiling"),
        ("world", "0 1.5707963 0", "wall"),
        ("pillar", "3.14159265 0 0", "floor"),  # the base of the arm may be modelled upside down
    ],
)
def test_an_arm_stands_on_the_floor_at_its_root_unless_the_world_turns_it(parent, rpy, mounting):
    joint = f'<joint name="held" type="fixed"><parent link="{parent}"/><child link="a"/>'
    joint += f'<origin xyz="0 0 1.2" rpy="{rpy}"/></joint><link name="{parent}"/>'
    moving = '<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>'
    robot = kin.load_robot(f'<robot name="r"><link name="a"/><link name="b"/>{joint}{moving}</robot>')
    assert (robot.mounting, robot.floor) == (mounting, 0.0)
    assert kin.fk(robot, [0.0])[2, 3] == pytest.approx(1.2)
    inside = kin.load_robot(f'<robot name="r"><link name="a"/><link name="b"/>{joint}{moving}</robot>', base="a")
    assert inside.mounting == "floor", "the arm was read without what holds it"


def test_names_and_limits_are_written():
    rows = [
        Joint('a <b> & "c" \x01', d=0.1, limits=None, velocity=2.5, effort=87.0),
        Joint("twin", a=0.2, kind="prismatic", limits=(0, 1)),
        Joint("twin", alpha=0.3, limits=(-1, 1)),
    ]
    text = kin.robot_to_urdf(Robot.from_dh(rows))
    robot = kin.load_robot(text)
    assert [joint.name for joint in robot.joints] == ['a <b> & "c" _', "twin 2", "twin 3"]
    assert (robot.joints[0].limits, robot.joints[0].velocity, robot.joints[0].effort) == (None, 2.5, 87.0)
    assert robot.joints[1].velocity is None


@pytest.mark.parametrize(
    ("names", "written"),
    [
        (["a", "a", "a 2"], ["a 1", "a 3", "a 2", "tool"]),
        (["tool", "tool end"], ["tool", "tool end", "tool end 2"]),
        (["tool", "b"], ["tool", "b", "tool end"]),
        (["a\x01", "a_", " a_"], ["a_ 1", "a_ 2", "a_ 3", "tool"]),
        (["", " ", "x" * 300], ["joint 1", "joint 2", "x" * 180, "tool"]),
    ],
)
def test_names_are_written_once(names, written):
    text = kin.robot_to_urdf(Robot.from_dh([Joint(name, a=0.1, limits=(-1, 1)) for name in names]))
    _, report = kin.files.read_urdf(text)
    assert [*report.joints, *report.merged] == written


def test_exchanged_limits_are_put_in_order_and_the_report_says_so():
    robot, report = kin.files.read_urdf(GOOD.replace('lower="-1" upper="2"', 'lower="2" upper="-1"'), tip="tcp")
    assert robot.joints[0].limits == (-1.0, 2.0)
    assert [note for note in report.notes if "shoulder" in note] == [
        "Joint shoulder has a lower limit above the upper one: they are read as -1 to 2 rad."
    ]


@pytest.mark.parametrize(
    ("old", "new", "at", "note"),
    [
        ('lower="-1" upper="2"', 'lower="0.7" upper="0.7"', 0, "Joint shoulder has no other value than"),
        ('lower="0" upper="0.4"', 'lower="0.3" upper="0.3"', 1, "its limits, 0.3 m: it is read as fixed there."),
    ],
)
def test_a_joint_with_one_value_only_is_fixed_there(old, new, at, note):
    whole = kin.load_robot(GOOD, tip="tcp")
    held, report = kin.files.read_urdf(GOOD.replace(old, new), tip="tcp")
    assert held.n == 2
    assert note in " ".join(report.notes)
    assert report.difference < EXACT
    value = 0.7 if at == 0 else 0.3
    for q in held.random_q(np.random.default_rng(1), 5):
        assert kin.fk(held, q) == pytest.approx(kin.fk(whole, np.insert(q, at, value)), abs=1e-12)


def test_a_slide_without_limits_is_not_written():
    with pytest.raises(InputError, match="URDF has no slide without them"):
        kin.robot_to_urdf(Robot.from_dh([Joint("slide", kind="prismatic")]))


def test_a_joint_that_cannot_move_is_not_written():
    with pytest.raises(InputError, match=r"limits of stuck: .*lower below upper"):
        kin.robot_to_urdf(Robot.from_dh([Joint("stuck", a=0.1, limits=(0.5, 0.5))]))
