"""Files as people brought them: one arm of three joints, each with one thing that makers and exporters do."""

from __future__ import annotations

import math
import re
import time
from pathlib import Path
from xml.etree.ElementTree import fromstring, tostring

import pytest

import kin
from kin import RobotFileError
from kin.files.mjcf.fields import BESIDE as BESIDE_MJCF
from kin.files.mjcf.fields import READ as READ_MJCF
from kin.files.urdf.causes import cause_of
from kin.files.urdf.fields import ATTRIBUTES, ELEMENTS

FILES = Path(__file__).parents[2] / "data" / "urdf" / "reports"
OK = (FILES / "ok.urdf").read_text(encoding="utf-8")
Q = [0.3, 0.5, 0.1]
TOOL = [0.514727, 0.159224, 0.060287]

# Each file of the same arm, and the note of its import.
READ = {
    "ok": "",
    "quat_v11": "",
    "xacro_property": "elements of xacro that nothing in it uses (<xacro:property>)",
    "comment_first": "<?xml …?> in line 2",
    "blank_first": "<?xml …?> in line 2",
    "amp": "an ampersand in line 2",
    "latin1_undeclared": "no UTF-8",
    "vel_neg": "Joint j1 has velocity -1: it is read as unknown.",
    "lower_eq_upper": "Joint j2 has limits that are both zero, which stand for none: it gets −180° to 180°.",
    "floating_root": "Joint fb is floating: the arm begins behind it, at link base_link.",
    "planar_root": "Joint fb is planar: the arm begins behind it, at link base_link.",
    "type_case": "Joint j1 has the type Revolute: it is read as revolute.",
}


@pytest.mark.parametrize(("name", "note"), READ.items())
def test_what_has_one_meaning_is_read(name, note):
    robot, report = kin.files.read_urdf(FILES / f"{name}.urdf")
    assert report.joints == ("j1", "j2", "j3")
    assert kin.fk(robot, Q)[:3, 3] == pytest.approx(TOOL, abs=1e-6)
    assert robot.joints[0].velocity == (None if name == "vel_neg" else 1.0)
    assert note in " ".join(report.notes)
    assert bool(note) == bool(report.notes)


def test_a_joint_that_follows_is_read_and_its_arm_is_solved():
    robot, report = kin.files.read_urdf(FILES / "mimic_chain.urdf")
    assert (report.joints, report.following) == (("j1", "j2"), ("j3",))
    # q3 = 0.05 q2 + 0.1, along x of a frame that j1 and j2 turn.
    q = [0.3, 0.5]
    reach = 0.4 + 0.05 * 0.5 + 0.1
    across = 0.1 + reach * math.cos(0.5)
    tool = [across * math.cos(0.3), across * math.sin(0.3), 0.3 - reach * math.sin(0.5)]
    assert kin.fk(robot, q)[:3, 3] == pytest.approx(tool, abs=1e-12)
    result = kin.solve_ik(robot, tool, task="position")
    assert result.solutions[0].q == pytest.approx(q, abs=1e-6)
    assert (result.solver, result.completeness) == ("numeric", "unknown")


@pytest.mark.parametrize(
    ("name", "words"),
    [("merge", "a conflict marker of Git, <<<<<<<, in line 1"), ("lfs", "a pointer of Git LFS")],
)
def test_what_is_no_file_of_an_arm_is_named(name, words):
    path = FILES / f"{name}.urdf"
    for source in (path, path.read_text(encoding="utf-8")):
        with pytest.raises(RobotFileError, match=words):
            kin.files.read_urdf(source)
    assert words in kin.doctor.examine_urdf(path).findings[0].text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("404: Not Found", r"no XML: it begins with '404: Not Found'.*the answer of a web site"),
        ('{"robot": 1}', r"no XML: it begins with .*a list"),
        ("PK\x03\x04\x00", r"no XML: it begins with .*an archive"),
        ("<!DOCTYPE html>\n<html><body>", r"DOCTYPE: got 'html'.*the button Raw leads to the file itself"),
        (OK.replace("</robot>", ""), r"an end in line 6 before </robot>.*this one breaks off"),
        ('<robot name="r"><group name="arm"/></robot>', r"link: got 'none'.*this is an SRDF"),
    ],
)
def test_another_file_in_its_place_is_named(tmp_path, text, words):
    path = tmp_path / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RobotFileError, match=words):
        kin.files.read_urdf(path)
    assert re.search(words.replace(": got", ":"), kin.doctor.examine_urdf(path).findings[0].text)


def test_a_limit_that_is_not_stated_is_zero_and_that_is_said():
    found = kin.doctor.examine_urdf(OK.replace('lower="-2" upper="2"', 'lower="-2"'))
    assert found.arm.robot.joints[1].limits == (-2.0, 0.0)
    assert found.arm.report.notes == ("Joint j2 states no upper limit, which is 0 then.",)
    assert [(each.rank, each.automatic) for each in found.findings] == [("suspicious", False)]


def test_expressions_in_numbers_are_mended():
    found = kin.doctor.examine_urdf(OK.replace('lower="-2" upper="2"', 'lower="-pi/2" upper="2*pi/4"'))
    assert found.arm is None
    assert found.mended_arm.robot.joints[1].limits == pytest.approx((-math.pi / 2, math.pi / 2))
    assert kin.doctor.examine_urdf(OK.replace('upper="2"', 'upper="two"')).mended_arm is None


def test_expressions_of_xacro_in_names_are_noted():
    found = kin.files.read_urdf(OK.replace('name="j1"', 'name="${prefix}j1"'))
    assert found.report.notes == (
        "Names such as ${prefix}j1 have expressions of xacro: they are taken as they stand.",
    )


def test_what_carries_fingers_is_offered_as_the_tip_and_all_say_as_many_joints():
    fingers = "".join(
        f'<link name="{side}"/><joint name="{side}_j" type="prismatic">'
        f'<parent link="tool0"/><child link="{side}"/><axis xyz="0 {sign} 0"/>'
        f'<limit lower="0" upper="0.04" effort="1" velocity="1"/>{mimic}</joint>'
        for side, sign, mimic in (("left", 1, ""), ("right", -1, '<mimic joint="left_j"/>'))
    )
    text = OK.replace("</robot>", fingers + "</robot>")
    with pytest.raises(
        RobotFileError, match=r"tool0 \(3 joints\), left \(4 joints\), right \(4 joints\)"
    ) as caught:
        kin.files.read_urdf(text)
    ends = re.findall(r"(\w+) \((\d) joints\)", caught.value.expected)
    assert ends == re.findall(r"(\w+) \((\d) joints\)", " ".join(kin.doctor.examine_urdf(text).read))
    for tip, joints in ends:
        assert kin.files.read_urdf(text, tip=tip).robot.n == int(joints)


def test_a_rod_of_a_parallelogram_is_no_finger():
    joints = "".join(
        f'<joint name="{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="0 0 1"/><limit lower="-1" upper="1"/>{follows and f"""<mimic joint="{follows}"/>"""}</joint>'
        for parent, child, follows in (
            ("base", "column", ""),
            ("column", "arm", ""),
            ("column", "rod", "arm"),
            ("arm", "fore", ""),
            ("fore", "hand", ""),
        )
    )
    links = "".join(f'<link name="{each}"/>' for each in ("base", "column", "arm", "rod", "fore", "hand"))
    assert kin.files.urdf_tips(f'<robot name="a">{links}{joints}</robot>')[0].link == "hand"


@pytest.mark.parametrize("name", ["comment_first", "blank_first", "amp", "latin1_undeclared", "type_case"])
def test_the_doctor_mends_what_has_one_meaning(name):
    found = kin.doctor.examine_urdf(FILES / f"{name}.urdf")
    assert found.count("wrong") == (2 if name == "type_case" else 1)
    assert all(each.automatic and each.line for each in found.findings if each.rank == "wrong")
    again = kin.doctor.examine_urdf(found.mended)
    assert again.count("wrong") == again.count("suspicious") == 0
    assert found.moved == 0.0
    assert kin.doctor.examine_urdf(FILES / f"{name}.urdf", mends=[]).mended is None


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('lower="-2" upper="2"', 'lower="0" upper="0"'),
        ('lower="-2" upper="2"', 'lower="0.5" upper="0.5"'),
        ('velocity="1"/>', 'velocity="-3"/>'),
        ('lower="0" upper="0.2"', ""),
        ('lower="0" upper="0.2"', 'lower="-999999" upper="999999"'),
    ],
)
def test_the_doctor_asks_where_two_things_may_be_meant(old, new):
    assert old in OK
    found = kin.doctor.examine_urdf(OK.replace(old, new, 1))
    suspicious = [each for each in found.findings if each.rank == "suspicious"]
    assert [each.automatic for each in suspicious] == [False]
    assert suspicious[0].mend
    assert found.mended is None
    assert found.arm.robot.n == (2 if "0.5" in new else 3)


def test_a_speed_that_is_not_known_stays_unknown_when_it_is_mended():
    found = kin.doctor.examine_urdf(FILES / "vel_neg.urdf")
    assert 'velocity="0"' in found.mended
    assert found.mended_arm.robot.joints[0].velocity is None


def test_a_slide_without_limits_is_read():
    robot, report = kin.files.read_urdf(FILES / "slide.urdf")
    assert kin.fk(robot, [10.0])[0, 3] == pytest.approx(20.0)
    assert report.notes == ("Joint m1 states no limits: it gets 0 to 1 m.",)
    huge = OK.replace('lower="0" upper="0.2"', 'lower="-999999" upper="999999"')
    assert kin.files.read_urdf(huge).report.notes == (
        "Joint j3 has limits of 10000 m or more both ways, which stand for none: it gets 0 to 1 m.",
    )


def test_acceleration_and_jerk_are_kept():
    limit = 'velocity="1" acceleration="2" deceleration="3" jerk="5"/>'
    robot, report = kin.files.read_urdf(OK.replace('velocity="1"/>', limit, 1))
    assert (robot.joints[0].acceleration, robot.joints[0].jerk) == (2.0, 5.0)
    assert report.notes == ("Joint j1 has acceleration 2 and deceleration 3: the smaller counts.",)
    again = kin.load_robot(kin.robot_to_urdf(robot))
    assert [(j.acceleration, j.jerk) for j in again.joints] == [(j.acceleration, j.jerk) for j in robot.joints]
    limits = kin.motion.motion_limits(robot)
    assert (limits.acceleration[0], limits.jerk[0]) == (2.0, 5.0)
    assert limits.assumed[0] == ()


# URDF 1.0 to 1.2, https://wiki.ros.org/urdf/XML and the schema of urdfdom.
URDF_1_2 = {
    "robot": "name version",
    "link": "name type",
    "joint": "name type",
    "parent": "link",
    "child": "link",
    "origin": "xyz rpy quat_xyzw",
    "axis": "xyz",
    "limit": "lower upper effort velocity acceleration deceleration jerk",
    "mimic": "joint multiplier offset",
    "dynamics": "damping friction",
    "calibration": "rising falling reference_position",
    "safety_controller": "soft_lower_limit soft_upper_limit k_position k_velocity",
}
BESIDE = {"link type", "dynamics damping", "dynamics friction"}
BESIDE |= {f"calibration {key}" for key in URDF_1_2["calibration"].split()}
BESIDE |= {f"safety_controller {key}" for key in URDF_1_2["safety_controller"].split()}


@pytest.mark.parametrize(("tag", "key"), [(tag, key) for tag, keys in URDF_1_2.items() for key in keys.split()])
def test_each_attribute_of_urdf_is_read_or_beside_the_geometry(tag, key):
    """What is read changes the arm, its names, or is refused if it cannot be a value of it."""
    assert ATTRIBUTES[tag][key] == ("beside" if f"{tag} {key}" in BESIDE else "read")
    if f"{tag} {key}" in BESIDE:
        return
    root = fromstring(OK)
    joint = root.findall("joint")[1]
    element = root if tag == "robot" else joint if tag == "joint" else next(iter(root)) if tag == "link" else None
    if element is None:
        element = joint.find(tag)
    if element is None:
        element = joint.makeelement(tag, {"joint": "j1"})
        joint.append(element)
    element.attrib.pop("rpy", None)
    element.set(key, "?")
    written = tostring(root, encoding="unicode")
    try:
        changed = kin.files.read_urdf(written)
    except RobotFileError:
        return
    was = kin.files.read_urdf(OK)
    assert (changed.robot.name, changed.report.joints, changed.report.notes) != (
        was.robot.name,
        was.report.joints,
        was.report.notes,
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('xyz="0.1 0 0" rpy=', 'xyz="0.1 0 0" RPY=', "Joint j2: RPY of <origin> is not read, "),
        ('<axis xyz="0 0 1"/><limit lower="-2"', '<axis rpy="0 0 1"/><limit lower="-2"', "rpy of <axis>"),
        ('<limit lower="-2"', '<limit soft="1" lower="-2"', "Joint j2: soft of <limit>"),
        ('<child link="l2"/>', '<child link="l2"/><orgin xyz="0 0 1"/>', "<orgin> is not read, .*; origin may be"),
        ('<child link="l2"/>', '<child link="l2"/><axis xyz="1 0 0"/>', "of 2 elements <axis> only the first"),
        ('<child link="l2"/>', '<child link="l2"><origin xyz="0 0 1"/></child>', "<origin> in <child>"),
        ('<link name="l2"/>', '<link name="l2"><origin xyz="0 0 1"/></link>', "Link l2: <origin> is not read"),
        ('<link name="l2"/>', '<link name="l2" scale="2"/>', "Link l2: scale of <link>"),
        ('<robot name="r"', '<robot name="r" version="2.0"', "The file: version 2.0 is read as 1.2"),
        ('<robot name="r"', '<robot name="r" unit="mm"', "The file: unit of <robot>"),
    ],
)
def test_what_is_not_read_is_named(old, new, words):
    assert old in OK
    text = OK.replace(old, new, 1)
    (note,) = kin.files.read_urdf(text).report.notes
    assert re.search(words, note), note
    if "<link" not in new:
        suspicious = [each for each in kin.doctor.examine_urdf(text).findings if each.rank == "suspicious"]
        assert any(each.symptom == "element" for each in suspicious)


def test_many_notes_about_what_is_not_read_are_bounded():
    extra = "".join(f' x{k}="1"' for k in range(50))
    notes = kin.files.read_urdf(OK.replace('<robot name="r"', f'<robot name="r"{extra}')).report.notes
    assert (len(notes), notes[-1]) == (21, "30 more elements and attributes are not read.")


@pytest.mark.parametrize(
    "text",
    [
        OK.replace("<robot", '<xacro:property name="a" value="1"/><robot'),
        OK.replace('<link name="l1"/>', '<link name="${p}l1"/><xacro:property name="p" value=""/>'),
        OK.replace('<link name="l1"/>', '<link name="l1"/><xacro:arm prefix=""/>'),
        OK.replace('<link name="l1"/>', '<link name="l1"/><xacro:include filename="arm.xacro"/>'),
    ],
)
def test_xacro_that_adds_to_the_arm_is_refused(text):
    with pytest.raises(RobotFileError, match=r"xacro|well-formed"):
        kin.files.read_urdf(text)


@pytest.mark.parametrize("part", ["<!--", "<![CDATA[", "<?", "<?xml ", "&", "&a", "<" * 7 + " "])
def test_a_cause_is_found_in_linear_time(part):
    start = time.process_time()
    cause_of(part * (900_000 // len(part)))
    assert time.process_time() - start < 3.0


def documented(title: str) -> dict[str, tuple[set[str], set[str]]]:
    """The first table below a title of the page *Formats*: of each element what is read, and what is not."""
    page = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    table = page.partition(f"## {title}\n")[2].partition("\n|---|---|---|\n")[2].partition("\n\n")[0]
    cells = [[set(re.findall("`([^`]+)`", cell)) for cell in row.split("|")[1:4]] for row in table.splitlines()]
    return {tag.pop().strip("<>"): (read, beside) for tag, read, beside in cells}


def test_the_page_formats_lists_what_is_read_of_a_urdf():
    expected = {}
    for tag, attributes in ATTRIBUTES.items():
        uses = {**attributes, **{f"<{key}>": use for key, use in ELEMENTS.get(tag, {}).items()}}
        expected[tag] = tuple({key for key, each in uses.items() if each == use} for use in ("read", "beside"))
    assert documented("What is read of a URDF") == expected


def test_the_page_formats_lists_what_is_read_of_an_mjcf_file():
    expected = {tag: (set(READ_MJCF[tag]), set(BESIDE_MJCF[tag])) for tag in READ_MJCF}
    assert documented("What is read of an MJCF file") == expected
