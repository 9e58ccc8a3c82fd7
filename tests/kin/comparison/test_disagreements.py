"""Disagreements about real arms that people ask about: a maker's table, a URDF, a book, a toolbox."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import kin
from kin.comparison import messages
from kin.robot import Robot

URDF = Path(__file__).parents[2] / "data" / "urdf"


def with_cell(arm: Robot, row: int, **cells: float) -> Robot:
    rows = list(arm.rows)
    rows[row] = replace(rows[row], **cells)
    return replace(arm, rows=tuple(rows), capsules=(), capsules_source="")


def said(a: Robot, b: Robot) -> tuple[str, str]:
    """The verdict and the first explanation in words; empty without one."""
    found = kin.compare(a, b)
    first = messages.explanation(found.explanations[0], a, b) if found.explanations else ""
    return messages.verdict(found, a, b), first


@pytest.mark.parametrize("frames", ["fixed", "free"])
def test_the_ur5_of_ros_counts_joint_1_from_behind(frames):
    """The base of the URDF is turned by half a turn against the maker's table; nothing is wrong in either."""
    maker, ros = kin.get_robot("ur5"), kin.load_urdf(URDF / "ur5.urdf", base="base_link", tip="tool0")
    found = kin.compare(maker, ros, frames=frames)
    assert messages.verdict(found, maker, ros) == "The same arm: joint 1 counts from 180.0°."
    assert found.position < 1e-9


def test_the_panda_of_ros_is_the_makers_table():
    maker, ros = kin.get_robot("panda"), kin.load_urdf(URDF / "panda.urdf", tip="panda_link8")
    assert said(maker, ros)[0] == "Identical: equal joint values give equal poses."


def test_the_modified_table_of_the_panda_read_as_standard():
    maker = kin.get_robot("panda")
    verdict, first = said(maker, replace(maker, convention="standard"))
    assert verdict == "Different arms: the axes of joints 1 and 2 are at an angle of 90.0° in a and 0.0° in b."
    assert "the table is in the modified (Craig's) convention" in first


def test_two_books_turn_the_second_axis_of_the_puma_the_other_way():
    """The sign of alpha in row 2 of the modified table is also another zero of joints 1 and 2."""
    puma = kin.get_robot("puma560")
    modified = kin.convert(puma, "modified")
    verdict, first = said(puma, with_cell(modified, 1, alpha=-modified.rows[1].alpha))
    assert verdict == "The same arm: joint 1 counts from 180.0°; joint 2 counts from 180.0°."
    assert first.startswith("Likely α of row 2 has the wrong sign")


def test_a_length_of_the_puma_in_a_table_of_the_stanford_arm():
    """Beside a joint that slides no distance of two axes shows it, but poses do."""
    stanford = kin.get_robot("stanford")
    verdict, first = said(stanford, with_cell(stanford, 2, a=0.0203))
    assert verdict.startswith("Different arms: the axis of joint 4")
    assert first.startswith("Likely a of row 3 is wrong (0 mm, not 20.3 mm)")


@pytest.mark.parametrize(
    ("row", "cell", "typed", "words"),
    [
        (1, {"a": -0.627}, "a", "a of row 2 is wrong (−612.7 mm, not −627 mm)"),
        (3, {"d": 0.135}, "d", "d of row 4 is wrong (174.2 mm, not 135 mm)"),
    ],
)
def test_lengths_of_the_ur10e_in_older_descriptions(row, cell, typed, words):
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
