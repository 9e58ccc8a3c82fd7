"""Disagreements about real arms that people ask about: a maker's table, a URDF, a book, a toolbox.

The tables are those of other people (``tests/data/tables``, with their sources), not made here.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kin
from kin.comparison import messages
from kin.robot import Robot

DATA = Path(__file__).parents[2] / "data"
URDF = DATA / "urdf"


def printed(name: str) -> Robot:
    """A table as somebody published it."""
    return kin.load_robot(DATA / "tables" / f"{name}.toml")


def published(name: str) -> Robot:
    """A maker's arm as its description in URDF has it."""
    about = json.loads((DATA / "library" / f"{name}.json").read_text(encoding="utf-8"))
    parts = [f'<robot name="{name}"><link name="0"/>']
    for i, joint in enumerate(about["joints"]):
        parts.append(f'<link name="{i + 1}"/>{_joint(joint, i)}')
    return kin.load_robot("".join([*parts, "</robot>"]))


def _joint(joint: dict[str, Any], i: int) -> str:
    text = f'<joint name="{joint["name"]}" type="{joint["type"]}"><parent link="{i}"/><child link="{i + 1}"/>'
    text += f'<origin xyz="{_spelled(joint["xyz"])}" rpy="{_spelled(joint["rpy"])}"/>'
    if joint["type"] != "fixed":
        lower, upper = joint["limits"]
        text += f'<axis xyz="{_spelled(joint["axis"])}"/>'
        text += f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'
    return f"{text}</joint>"


def _spelled(values: list[float]) -> str:
    return " ".join(map(repr, values))


def with_cell(arm: Robot, row: int, **cells: float) -> Robot:
    rows = list(arm.rows)
    rows[row] = replace(rows[row], **cells)
    return replace(arm, rows=tuple(rows), capsules=(), capsules_source="")


def said(a: Robot, b: Robot, **options: Any) -> tuple[str, str]:
    """The verdict and the first explanation in words; empty without one."""
    found = kin.compare(a, b, **options)
    first = messages.explanation(found.explanations[0], a, b) if found.explanations else ""
    return messages.verdict(found, a, b), first


def differing(a: Robot, b: Robot) -> list[str]:
    """What differs whatever the frames are, in words."""
    found = kin.compare(a, b, explain=False)
    assert found.verdict == "different"
    return [messages.difference(each, a, b) for each in found.differences]


def test_a_printed_table_has_the_poses_that_its_source_has():
    """One pose of each table, multiplied out by hand at q = 0."""
    q = np.zeros(6)
    at = {
        "ur5-toolbox": [-0.425 - 0.39225, -0.10915 - 0.0823, 0.089459 - 0.09465],
        "puma560-toolbox": [0.4318 + 0.0203, -0.15005, 0.672 + 0.4318],
        "puma560-akb": [0.4318 - 0.0203, 0.2435 - 0.0934, 0.4331],
        "puma560-lee": [0.4318 - 0.02032, 0.14909, 0.43307],
    }
    for name, place in at.items():
        assert kin.fk(printed(name), q)[:3, 3] == pytest.approx(place, abs=1e-12), name


@pytest.mark.parametrize("frames", ["fixed", "free"])
def test_the_ur5_of_ros_counts_joint_1_from_behind(frames):
    """The base of the URDF is turned by half a turn against the maker's table; nothing is wrong in either."""
    maker, ros = kin.get_robot("ur5"), kin.load_robot(URDF / "ur5.urdf", base="base_link", tip="tool0")
    found = kin.compare(maker, ros, frames=frames)
    assert messages.verdict(found, maker, ros) == "The same arm: joint 1 counts from 180.0°."
    assert found.position < 1e-9


def test_the_ur5e_of_ros_counts_joint_1_from_behind():
    """The same numbers in another notation (UniversalRobots/Universal_Robots_ROS2_Description, issue 309)."""
    verdict, first = said(kin.get_robot("ur5e"), published("ur5e"))
    assert verdict == "The same arm: joint 1 counts from 180.0°."
    assert first.startswith("Likely θ of row 1 is half a turn off")


@pytest.mark.parametrize("frames", ["fixed", "free"])
def test_the_ur5_of_a_toolbox_stands_lower_or_has_another_d(frames):
    """Poses cannot tell 0.3 mm of the base from 0.3 mm of d in row 1: both are said."""
    verdict, first = said(kin.get_robot("ur5"), printed("ur5-toolbox"), frames=frames)
    assert verdict == "The same arm: the base is shifted by 0.3 mm."
    assert first.startswith("Likely d of row 1 is wrong (89.16 mm, not 89.46 mm)")


def test_the_ur5e_of_a_library_before_its_correction():
    """Two lengths are mistaken. The third that its pull request changes, d1, is a height of the base."""
    maker, library = kin.get_robot("ur5e"), printed("ur5e-visose")
    verdict, first = said(maker, library, frames="free", seconds=60.0)
    assert verdict.startswith("Different arms: the axes of joints 3 and 4 are at a distance of 392.20 mm in a")
    assert first == (
        "Likely d of row 5 is wrong (99.7 mm, not 100.3 mm), and a of row 3 is wrong (−392.2 mm, not −392.25 mm); "
        "it is then the same arm, but the base is shifted by 0.2 mm."
    )


def test_d4_of_the_ur10e_in_an_older_xacro():
    """Read as a table, one of its numbers is 39 mm off; the others are rounded, so only a tolerance shows it."""
    maker, xacro = kin.get_robot("ur10e"), printed("ur10e-xacro")
    assert said(maker, xacro)[1] == ""
    verdict, first = said(maker, xacro, tolerance=(2e-3, 1e-3))
    assert verdict.startswith("Different arms")
    assert first == (
        "Likely d of row 4 is wrong (174.2 mm, not 135 mm); equal joint values then give poses up to 1.6 mm and "
        "0.0° apart."
    )


def test_the_older_xacro_of_the_ur10e_itself_is_the_arm_within_2_mm():
    """Its URDF has what the table lacks: offsets of shoulder and elbow, 176 and −137 mm, beside d4."""
    maker, ros = kin.get_robot("ur10e"), kin.load_robot(URDF / "ur10e-xacro.urdf", tip="tool0")
    found = kin.compare(maker, ros, tolerance=(2e-3, 1e-3), explain=False)
    assert found.verdict == "close"
    assert 1e-3 < found.position < 2e-3
    facts = messages.mapping(found, maker)
    assert facts == ["joint 1 counts from 180.0°"]


def test_the_panda_of_ros_is_the_makers_table():
    maker, ros = kin.get_robot("panda"), kin.load_robot(URDF / "panda.urdf", tip="panda_link8")
    assert said(maker, ros)[0] == "Identical: equal joint values give equal poses."


def test_the_modified_table_of_the_panda_read_as_standard():
    maker = kin.get_robot("panda")
    verdict, first = said(maker, replace(maker, convention="standard"))
    assert verdict == "Different arms: the axes of joints 1 and 2 are at an angle of 90.0° in a and 0.0° in b."
    assert "the table is in the modified (Craig's) convention" in first


def test_the_panda_of_a_toolbox_has_a_tool():
    verdict, first = said(kin.get_robot("panda"), printed("panda-toolbox"))
    assert verdict == "The same arm: the tool is shifted by 103.0 mm and turned by 45.0°."
    assert first == "Likely the tool transform is wrong; equal joint values then give equal poses."


def test_a_standard_table_of_the_panda_is_identical():
    maker = kin.get_robot("panda")
    assert (
        said(maker, kin.dh.convert_dh(maker, "standard"))[0] == "Identical: equal joint values give equal poses."
    )


def test_two_lengths_of_the_puma_differ_between_two_papers():
    """Armstrong, Khatib and Burdick against Corke: modified against standard, and two lengths."""
    assert differing(printed("puma560-toolbox"), printed("puma560-akb")) == [
        "along the axis of joint 3, its two common normals are 150.05 mm apart in a and 150.10 mm in b",
        "along the axis of joint 4, its two common normals are 431.8 mm apart in a and 433.1 mm in b",
    ]


def test_lee_turns_the_pumas_axes_the_other_way():
    """With Corke's lengths, Lee's table is the same arm: a righty at zero instead of a lefty."""
    paul, lee = printed("puma560-toolbox"), printed("puma560-lee")
    assert differing(paul, lee) == [
        "the axes of joints 3 and 4 are at a distance of 20.30 mm in a and 20.32 mm in b",
        "along the axis of joint 3, its two common normals are 150.0 mm apart in a and 149.1 mm in b",
        "along the axis of joint 4, its two common normals are 431.8 mm apart in a and 433.1 mm in b",
    ]
    for row, cells in enumerate(({"d": 0.672}, {"d": 0.15005}, {"a": -0.0203}, {"d": 0.4318})):
        lee = with_cell(lee, row, **cells)
    found = kin.compare(paul, lee)
    assert found.verdict == "same"
    assert found.position < 1e-9
    assert [i for i, offset in enumerate(found.mapping.offsets) if abs(offset) > 3.0] == [0, 1, 2, 5]


def test_two_books_turn_the_second_axis_of_the_puma_the_other_way():
    """The sign of alpha in row 2 of the modified table is also another zero of joints 1 and 2."""
    puma = kin.get_robot("puma560")
    modified = kin.dh.convert_dh(puma, "modified")
    verdict, first = said(puma, with_cell(modified, 1, alpha=-modified.rows[1].alpha))
    assert verdict == "The same arm: joint 1 counts from 180.0°; joint 2 counts from 180.0°."
    assert first.startswith("Likely α of row 2 has the wrong sign")


def test_a_length_of_the_puma_in_a_table_of_the_stanford_arm():
    """Beside a joint that slides no distance of two axes shows it, but poses do."""
    stanford = kin.get_robot("stanford")
    verdict, first = said(stanford, with_cell(stanford, 2, a=0.0203))
    assert verdict.startswith("Different arms: the axis of joint 4")
    assert first.startswith("Likely a of row 3 is wrong (0 mm, not 20.3 mm)")


def test_the_stanford_arm_of_a_toolbox_has_a_length_of_the_puma():
    """Its a₃ was copied along; its boom has another zero, and it ends at the wrist."""
    verdict, first = said(kin.get_robot("stanford"), printed("stanford-toolbox"))
    assert verdict.startswith("Different arms: the axis of joint 4")
    assert first == (
        "Likely a of row 3 is wrong (0 mm, not 20.3 mm); it is then the same arm, but joint 4 counts from 90.0°; "
        "the tool is shifted by 263.0 mm."
    )


@pytest.mark.parametrize(
    ("row", "cell", "words"),
    [
        (1, {"a": -0.627}, "a of row 2 is wrong (−612.7 mm, not −627 mm)"),
        (3, {"d": 0.135}, "d of row 4 is wrong (174.2 mm, not 135 mm)"),
    ],
)
def test_lengths_of_the_ur10e_in_older_descriptions(row, cell, words):
    """Each alone in the maker's table (ros-industrial/universal_robot, pull request 616 and issue 600)."""
    maker = kin.get_robot("ur10e")
    verdict, first = said(maker, with_cell(maker, row, **cell))
    assert verdict.startswith("Different arms")
    assert words in first


def test_the_xarm6_without_its_offsets():
    """A table without the offsets of joints 2 and 3 is the same arm, with other zeros."""
    arm = kin.get_robot("xarm6")
    rows = tuple(replace(row, theta=0.0) for row in arm.rows)
    found = kin.compare(arm, replace(arm, rows=rows, capsules=(), capsules_source=""))
    assert found.verdict == "same"
    assert {i for i, offset in enumerate(found.mapping.offsets) if offset} == {1, 2}


def test_the_xarm6_as_printed_is_that_of_ros():
    """Both are rounded, a₂ in the table and right angles in the URDF: 0.004 mm of the poses."""
    found = kin.compare(published("xarm6"), printed("xarm6-printed"))
    assert found.verdict == "identical"
    assert 1e-7 < found.position < 1e-5


def test_a_ur5_under_the_name_of_an_xarm6():
    """Lengths of the UR5 with the offsets of the xArm 6, as found in public code: a UR5 with other zeros."""
    ur5, offset = kin.get_robot("ur5"), 1.3849179
    wrong = with_cell(with_cell(ur5, 1, theta=-offset), 2, theta=offset)
    assert said(ur5, wrong)[0] == "The same arm: joint 2 counts from 79.3°; joint 3 counts from −79.3°."
    assert kin.compare(kin.get_robot("xarm6"), wrong, explain=False).verdict == "different"
