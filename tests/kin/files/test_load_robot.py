"""`kin.load_robot` takes any file of a robot, whatever its name ends with, and any kind of path."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kin
from kin.errors import InputError
from kin.joint import NominalTable

UR5 = kin.get_robot("ur5")


class Place:
    """A path of a library of somebody's."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __fspath__(self) -> str:
        return os.fspath(self.path)


@pytest.mark.parametrize("name", ["arm.URDF", "robot_description", "arm.urdf.txt", "arm.xacro", "arm.xml"])
def test_a_urdf_is_read_whatever_its_name_ends_with(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_text("\ufeff" + kin.robot_to_urdf(UR5), encoding="utf-8")
    assert kin.load_robot(Place(file), tip="tool").n == 6


def test_a_description_may_contain_a_tag() -> None:
    arm = replace(UR5, id="mine", description="made of <robot name='ur5'>")
    assert kin.load_robot(kin.robot_to_toml(arm)).description == arm.description


def test_a_nominal_table_has_rows_of_the_arm_in_their_order() -> None:
    arm = replace(UR5, id="mine", nominal=NominalTable(UR5.rows, UR5.tool))
    text = kin.robot_to_toml(arm)
    assert kin.load_robot(text).nominal_arm is not None
    place = text.index("[[nominal.rows]]")
    fixed = '[[nominal.rows]]\nname = "plate"\nkind = "fixed"\nd = 0.1\n\n'
    with pytest.raises(kin.RobotFileError, match=r"nominal\.rows.*rows of the arm in their order"):
        kin.load_robot(text[:place] + fixed + text[place:])


def test_constraints_are_refused_by_their_names() -> None:
    with pytest.raises(InputError, match=r"constraints.*limits, locked"):
        kin.solve_ik(UR5, np.eye(4), constraints=kin.JointConstraints())  # type: ignore[call-arg]
