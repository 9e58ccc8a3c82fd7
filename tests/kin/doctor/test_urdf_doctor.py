"""The doctor for URDFs: what it finds on which line, and that its mends do what they say and nothing else."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import kin
from kin import RobotFileError
from kin.doctor.bodies import nearest_possible

FILES = Path(__file__).parents[2] / "data" / "urdf"
DEGREE = math.pi / 180.0

WELL = """<?xml version="1.0"?>
<!-- A small arm. -->
<robot name="small">
  <link name="foot"/>
  <link name="upper">
    <inertial><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.3"/></geometry></collision>
  </link>
  <link name="fore"><visual><geometry><mesh filename="package://small/fore.stl"/></geometry></visual></link>
  <link name="hand"/>
  <link name="claw"/>
  <joint name="shoulder" type="revolute">
    <parent link="foot"/><child link="upper"/>
    <origin xyz="0 0 0.2" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="3" effort="40"/>
  </joint>
  <joint name="elbow" type="revolute"> <!-- bends -->
    <parent link="upper"/><child link="fore"/>
    <origin xyz="0 0 0.3" rpy="1.5707963267948966 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" velocity="3" effort="40"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="fore"/><child link="hand"/>
    <origin xyz="0.2 0 0"/>
    <axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" velocity="0.2" effort="40"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="hand"/><child link="claw"/>
    <axis xyz="0 1 0"/>
    <limit lower="0" upper="0.02" velocity="0.2" effort="4"/>
    <mimic joint="slide" multiplier="0.5" offset="0.01"/>
  </joint>
</robot>
"""
HAND = {"base": "foot", "tip": "hand"}


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def worth_saying(found: kin.doctor.UrdfExamination) -> list[kin.doctor.UrdfFinding]:
    return [each for each in found.findings if each.rank != "left out"]


def test_a_healthy_file_has_no_findings_but_what_is_left_out():
    found = kin.doctor.examine_urdf(WELL, **HAND)
    assert worth_saying(found) == []
    assert (found.refusal, found.mended, found.moved) == ("", None, None)
    assert found.arm.report.joints == ("shoulder", "elbow", "slide")
    assert found.read[0] == "5 links; 4 joints (2 revolute, 2 prismatic); 1 visible bodies, 1 for collisions."
    assert found.read[1] == "Read: foot to hand, 3 moving joints (shoulder, elbow, slide)."
    left = {each.symptom: each for each in found.findings}
    assert left["beside the arm"].text == "Joint beside the way from foot to hand: grip."
    assert left["beside the arm"].line == line_of(WELL, '<joint name="grip"')
    assert "masses and inertia" in left["element"].text
    assert left["mesh"].text == "1 mesh file is named, but none came along: they were not looked at."


# What is written instead of what, on which line it is found, as what, and what the mended text has there.
CASES = [
    (
        'lower="-2" upper="2"',
        'lower="-120" upper="120"',
        "degrees",
        "suspicious",
        'lower="-2.0943951023931953" upper="2.0943951023931953"',
    ),
    (
        'lower="-2" upper="2"',
        'lower="-10" upper="10"',
        "degrees",
        "suspicious",
        f'lower="{-10 * DEGREE!r}" upper="{10 * DEGREE!r}"',
    ),
    ('lower="-2" upper="2"', 'lower="-1e5" upper="1e5"', "limit", "suspicious", 'type="continuous"'),
    ('lower="-2" upper="2"', 'lower="-1e9" upper="1e9"', "limit", "suspicious", 'type="continuous"'),
    ('lower="-2" upper="2"', 'lower="2" upper="-2"', "limit", "wrong", 'lower="-2.0" upper="2.0"'),
    ('lower="-2" upper="2"', 'lower="-1,5" upper="2"', "number", "wrong", 'lower="-1.5" upper="2"'),
    (
        'lower="-2" upper="2" velocity="3"',
        'lower="-2" upper="2" velocity="-1"',
        "limit",
        "suspicious",
        'velocity="0"',
    ),
    ('lower="-2" upper="2" velocity="3"', 'lower="-2" upper="2"', "limit", "suspicious", 'velocity="0"'),
    ('lower="0" upper="0.1"', 'lower="0" upper="100"', "millimetres", "suspicious", 'lower="0.0" upper="0.1"'),
    (
        '<axis xyz="0 0 1"/>\n    <limit lower="-2"',
        '<axis xyz="0 0 2"/>\n    <limit lower="-2"',
        "axis",
        "suspicious",
        '<axis xyz="0.0 0.0 1.0"/>',
    ),
    (
        '<axis xyz="0 0 1"/>\n    <limit lower="-2"',
        '<limit lower="-2"',
        "axis",
        "suspicious",
        '<axis xyz="1 0 0"/>',
    ),
    ('xyz="0 0 0.2"', 'xyz="0 0 200"', "millimetres", "suspicious", 'xyz="0.0 0.0 0.2"'),
    ('xyz="0 0 0.2"', 'xyz="0, 0, 0.2"', "number", "wrong", 'xyz="0 0 0.2"'),
    ('rpy="1.5707963267948966 0 0"', 'rpy="90 0 0"', "degrees", "suspicious", 'rpy="1.5707963267948966 0.0 0.0"'),
    ('rpy="1.5707963267948966 0 0"', 'rpy="1.57 0 0"', "rounded", "suspicious", 'rpy="1.5707963267948966 0 0"'),
    (
        'type="prismatic">\n    <parent link="fore"',
        'type="Prismatc">\n    <parent link="fore"',
        "type",
        "wrong",
        '<joint name="slide" type="prismatic">',
    ),
    ('<child link="hand"/>', '<child link="hnad"/>', "tree", "wrong", '<child link="hand"/>'),
    ('  <link name="claw"/>\n', "", "tree", "wrong", '<link name="claw"/>'),
    ('<joint name="grip"', '<joint name="elbow"', "name", "wrong", '<joint name="elbow_2" type="prismatic">'),
    ('<link name="claw"/>', '<link name="claw"/><link name="claw"/>', "name", "wrong", '<link name="claw"/>\n'),
    ('<mimic joint="slide"', '<mimic joint="slid"', "mimic", "wrong", '<mimic joint="slide"'),
    ('ixx="0.02"', 'ixx="0.05"', "inertia", "suspicious", None),
    ('ixx="0.02"', 'ixx="-0.02"', "inertia", "suspicious", None),
    (' ixy="0"', "", "inertia", "wrong", 'ixy="0"'),
    ('<mass value="2"/>', '<mass value="0"/>', "inertia", "suspicious", None),
    ('<mass value="2"/>', '<mass value="2500"/>', "inertia", "suspicious", '<mass value="2.5"/>'),
    ('<box size="0.1 0.1 0.3"/>', '<box size="0.1 -0.1 0.3"/>', "body", "wrong", 'size="0.1 0.1 0.3"'),
    ('<geometry><box size="0.1 0.1 0.3"/></geometry>', "", "body", "wrong", None),
]


@pytest.mark.full
@pytest.mark.parametrize(("old", "new", "symptom", "rank", "mended"), CASES, ids=lambda value: str(value)[:32])
def test_what_is_wrong_is_found_on_its_line_and_mended(old, new, symptom, rank, mended):
    assert WELL.count(old) == 1
    text = WELL.replace(old, new)
    found = kin.doctor.examine_urdf(text, **HAND)
    first = next(each for each in worth_saying(found) if each.symptom == symptom)
    assert first.rank == rank
    place = WELL.index(old)
    first_line, last_line = (text[:end].count("\n") + 1 for end in (place, place + len(new)))
    above = 8 if symptom in ("limit", "axis", "tree") else 0  # the joint itself is named, or what names it
    assert first_line - above <= first.line <= last_line + 3 * above
    assert first.mend
    assert first.automatic
    assert found.mended is not None
    assert mended is None or mended in found.mended
    after = kin.doctor.examine_urdf(found.mended, **HAND)
    assert worth_saying(after) == []
    assert after.arm is not None
    # Everything else is as it was written.
    changed = set(text.splitlines()) ^ set(found.mended.splitlines())
    assert len(changed) <= 4
    assert "<!-- A small arm. -->" in found.mended
    assert "<!-- bends -->" in found.mended


@pytest.mark.full
@pytest.mark.parametrize(
    ("old", "new", "symptom", "words"),
    [
        ('xyz="1 0 0"', 'xyz="0 0 0"', "axis", "Its axis is zero"),
        ('lower="0" upper="0.1" ', "", "limit", "without lower and upper"),
        ('<child link="upper"/>', "", "tree", "has no child"),
        ('<child link="claw"/>', '<child link="fore"/>', "tree", "the child of elbow and grip"),
        ('<link name="claw"/>', "<link/>", "name", "link name"),
        ('lower="-2" upper="2"', 'lower="${min}" upper="2"', "number", "“${min}”"),
        ('<mass value="2"/>', "<mass/>", "inertia", "no mass"),
        ('ixx="0.02"', 'ixx="200"', "inertia", "No body has"),
        (
            'ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"',
            'ixx="20" ixy="0" ixz="0" iyy="20" iyz="0" izz="20"',
            "inertia",
            "more than the arm reaches",
        ),
        (
            'lower="-2" upper="2" velocity="3"',
            'lower="-2" upper="2" velocity="180"',
            "degrees",
            "29 turns in a second",
        ),
        ('lower="-2" upper="2"', 'lower="0.5" upper="0.5"', "limit", "cannot move"),
        ("<robot", "<robots", "file", "mismatched tag"),
        ("</robot>", "<joint", "file", "breaks off"),
        ('<robot name="small">', "<!DOCTYPE robot><robot>", "file", "DOCTYPE"),
    ],
)
def test_what_needs_a_decision_is_named_with_advice(old, new, symptom, words):
    text = WELL.replace(old, new, 1)
    found = kin.doctor.examine_urdf(text, **HAND)
    assert any(each.symptom == symptom and words in each.text for each in worth_saying(found)), found.findings
    assert all(each.mend for each in worth_saying(found))


@pytest.mark.full
def test_ordinary_limits_are_not_suspicious():
    """Turns of a joint that count in radians: ±2π of the UR arms, ±4π, five turns of a joint without stops."""
    for limit in (2 * math.pi, 4 * math.pi, 6.2832, 10 * math.pi, 7.5):
        text = WELL.replace('lower="-2" upper="2"', f'lower="{-limit!r}" upper="{limit!r}"')
        assert worth_saying(kin.doctor.examine_urdf(text, **HAND)) == []


@pytest.mark.full
def test_angles_that_were_meant_are_not_rounded():
    for angle in ("1.5", "0.79", "3.1", "1.570796326794897", "0.123", "-2.36"):
        text = WELL.replace('rpy="1.5707963267948966 0 0"', f'rpy="{angle} 0 0"')
        off = abs(float(angle) / (math.pi / 4) - round(float(angle) / (math.pi / 4)))
        found = worth_saying(kin.doctor.examine_urdf(text, **HAND))
        assert bool(found) == (1e-7 < off < 6e-3), (angle, found)


@pytest.mark.full
def test_a_chain_of_followers_becomes_one_step():
    third = """<link name="tip2"/><joint name="third" type="prismatic"><parent link="claw"/><child link="tip2"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.02" velocity="1" effort="1"/>
    <mimic joint="grip" multiplier="-2" offset="0.1"/></joint></robot>"""
    found = kin.doctor.examine_urdf(WELL.replace("</robot>", third), **HAND)
    (finding,) = worth_saying(found)
    assert finding.text == "It follows grip, which follows slide; many readers take one step only."
    # q3 = −2 (0.5 q + 0.01) + 0.1
    assert '<mimic joint="slide" multiplier="-1.0" offset="0.08"/>' in found.mended


@pytest.mark.full
def test_a_follower_on_the_way_to_the_tool_follows():
    found = kin.doctor.examine_urdf(WELL, base="foot", tip="claw")
    assert worth_saying(found) == []
    assert (found.arm.report.joints, found.arm.report.following) == (("shoulder", "elbow", "slide"), ("grip",))
    assert "Following one of them: grip." in found.read


@pytest.mark.parametrize(
    ("leader", "said"), [("motor", "“motor”, which does not exist"), ("grip", "follows itself")]
)
def test_a_follower_on_the_way_to_the_tool_is_never_mended_into_a_joint(leader, said):
    """It would be another arm, with a joint that nobody drives."""
    text = WELL.replace('<mimic joint="slide"', f'<mimic joint="{leader}"')
    found = kin.doctor.examine_urdf(text, base="foot", tip="claw")
    (finding,) = worth_saying(found)
    assert (finding.symptom, finding.line) == ("mimic", line_of(text, "<mimic"))
    assert said in finding.text
    assert "Write the joint that it follows" in finding.mend
    assert (found.arm, found.mended) == (None, None)


@pytest.mark.full
def test_the_effect_of_mends_on_the_tool_is_measured():
    text = WELL.replace('rpy="1.5707963267948966 0 0"', 'rpy="1.57 0 0"')
    found = kin.doctor.examine_urdf(text, **HAND)
    q = found.arm.robot.random_q(np.random.default_rng(5), 500)
    apart = np.linalg.norm(
        kin.fk(found.arm.robot, q)[:, :3, 3] - kin.fk(found.mended_arm.robot, q)[:, :3, 3], axis=1
    )
    assert apart.max() == pytest.approx(found.moved, rel=0.3)
    assert found.moved > 1e-5
    limits = WELL.replace('lower="-2" upper="2"', 'lower="-120" upper="120"')
    assert kin.doctor.examine_urdf(limits, **HAND).moved == 0.0


@pytest.mark.parametrize("name", ["ur5.urdf", "panda.urdf", "so101.urdf"])
def test_makers_files_are_read_and_only_rounded_angles_are_suspicious(name):
    found = kin.doctor.examine_urdf(FILES / name)
    assert {each.symptom for each in worth_saying(found)} <= {"rounded"}
    assert "It has several ends" in found.read[1]
    assert found.refusal == ""


def test_every_end_is_tried():
    found = kin.doctor.examine_urdf(
        WELL.replace(
            "</robot>",
            '<link name="eye"/><joint name="e" type="fixed">'
            '<parent link="hand"/><child link="eye"/></joint></robot>',
        )
    )
    assert found.arm is None
    assert "claw (3 joints)" in found.read[1]
    assert "eye (3 joints)" in found.read[1]


class Sent:
    """Meshes that came along: their sides by path."""

    def __init__(self, **sides: float) -> None:
        self._sides = sides

    def extent(self, path: str) -> np.ndarray | None:
        name = path.rpartition("/")[2].partition(".")[0]
        if name not in self._sides or path.startswith("package://small/gone"):
            raise LookupError("no file of that name came along")
        return np.full(3, self._sides[name]) if self._sides[name] else None

    def elsewhere(self, path: str) -> str | None:
        return "meshes/fore.stl" if "gone" in path else None


@pytest.mark.full
@pytest.mark.parametrize(
    ("side", "scale"),
    [(250.0, "0.001 0.001 0.001"), (0.25, None), (0.0, None), (2.5e-4, "1000.0 1000.0 1000.0")],
)
def test_a_mesh_in_another_unit_gets_a_scale(side, scale):
    found = kin.doctor.examine_urdf(WELL, **HAND, files=Sent(fore=side))
    if scale is None:
        assert worth_saying(found) == []
        return
    (finding,) = worth_saying(found)
    assert (finding.symptom, finding.line) == ("millimetres", line_of(WELL, "fore.stl"))
    assert f'<mesh filename="package://small/fore.stl" scale="{scale}"/>' in found.mended


@pytest.mark.full
def test_a_mesh_that_is_missing_is_named_and_found_elsewhere():
    found = kin.doctor.examine_urdf(WELL, **HAND, files=Sent())
    (finding,) = worth_saying(found)
    assert finding.text == "The mesh “package://small/fore.stl” cannot be used: no file of that name came along."
    assert not finding.automatic
    gone = WELL.replace("package://small/fore", "package://small/gone/fore")
    assert 'filename="meshes/fore.stl"' in kin.doctor.examine_urdf(gone, **HAND, files=Sent(fore=0.1)).mended


def test_the_nearest_possible_inertia_is_that_of_a_body():
    rng = np.random.default_rng(3)
    for _ in range(50):
        A = rng.normal(size=(3, 3))
        inertia = nearest_possible(A + A.T + 2.0 * np.eye(3))
        if inertia is None:
            continue
        low, middle, high = np.linalg.eigvalsh(inertia)
        assert low > 0.0
        assert high <= (low + middle) * (1.0 + 1e-9)
    body = np.diag([0.02, 0.02, 0.01])
    assert nearest_possible(body) == pytest.approx(body)
    assert nearest_possible(-body) is None


@pytest.mark.full
@pytest.mark.parametrize("encoding", ["utf-8-sig", "iso-8859-1", "utf-16"])
def test_files_in_other_encodings_are_mended_as_utf_8(tmp_path, encoding):
    text = WELL.replace('version="1.0"', f'version="1.0" encoding="{encoding.removesuffix("-sig")}"')
    text = text.replace("A small arm.", "Für Ärmel.").replace('lower="-2"', 'lower="-200"')
    path = tmp_path / "small.urdf"
    path.write_bytes(text.encode(encoding))
    found = kin.doctor.examine_urdf(path, **HAND)
    assert "Für Ärmel." in found.mended
    assert 'encoding="utf-8"' in found.mended
    saved = tmp_path / "mended.urdf"
    saved.write_text(found.mended, encoding="utf-8")
    assert kin.load_robot(saved, **HAND).rows == found.mended_arm.robot.rows


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(RobotFileError, match="readable"):
        kin.doctor.examine_urdf(tmp_path / "none.urdf")
    with pytest.raises(kin.InputError, match="source"):
        kin.doctor.examine_urdf(7)
    path = tmp_path / "bytes.urdf"
    path.write_bytes(b"\xff\x00<robot/>\x9d")
    assert "no XML" in kin.doctor.examine_urdf(path).refusal
    path.write_bytes(b'<?xml version="1.0" encoding="klingon"?><robot/>')
    with pytest.raises(RobotFileError, match="encoding"):
        kin.doctor.examine_urdf(path)


def test_many_findings_are_bounded():
    joints = "".join(f'<joint name="j{k}"/>' for k in range(3000))
    found = kin.doctor.examine_urdf(f'<robot name="x">{joints}</robot>')
    assert len(found.findings) == 501
    assert "more findings" in found.findings[-1].text


THREE = (
    '<robot name="three"><link name="a"/><link name="b"/><link name="c"/><link name="d"/>'
    '<joint name="one" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/>'
    '<limit lower="1.5" upper="-1.5" effort="1" velocity="1"/></joint>'
    '<joint name="two" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/>'
    '<axis xyz="0 3 0"/>'
    '<limit lower="-180" upper="180" effort="1" velocity="1"/></joint>'
    '<joint name="three" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.3 0 0"/>'
    '<axis xyz="0 1 0"/>'
    '<limit lower="170" upper="-170" effort="1" velocity="1"/></joint></robot>'
)


def test_findings_are_mended_one_by_one():
    whole = kin.doctor.examine_urdf(THREE)
    can = [i for i, each in enumerate(whole.findings) if each.automatic]
    assert len(can) >= 5
    assert [each.done for each in whole.findings] == [each.automatic for each in whole.findings]
    for i in can:
        one = kin.doctor.examine_urdf(THREE, mends=[i])
        assert [k for k, each in enumerate(one.findings) if each.done] == [i]
        assert one.mends == 1
        assert one.mendable == len(can)
        assert one.mended is not None
        left = {(e.place, e.symptom, e.text) for e in kin.doctor.examine_urdf(one.mended).findings if e.automatic}
        before = {k: (e.place, e.symptom, e.text) for k, e in enumerate(whole.findings) if e.automatic}
        assert before[i] not in left
        others = [each for k, each in before.items() if k != i and each[0] != before[i][0]]
        assert set(others) <= left, "another place was mended too"
    assert kin.doctor.examine_urdf(THREE, mends=can).mended == whole.mended
    none = kin.doctor.examine_urdf(THREE, mends=[])
    assert none.mended is None
    assert none.mends == 0


@pytest.mark.parametrize("mends", [[99], [-1], ["0"], [True]])
def test_what_cannot_be_mended_is_refused(mends):
    with pytest.raises(
        kin.InputError, match=r"mends: got .*, expected indices of findings that can be mended: 0, 1"
    ):
        kin.doctor.examine_urdf(THREE, mends=mends)
    with pytest.raises(kin.InputError, match="none, for nothing can be mended"):
        kin.doctor.examine_urdf(kin.robot_to_urdf("planar2r"), mends=[0])
