"""Changes of an arm by typed cells and by rows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kin
from app.viewer.own_arm import own_arm
from app.viewer.tabs.robot.edits import (
    MOTION,
    EditError,
    add_row,
    changed_rows,
    converted,
    frame_values,
    move_row,
    reread,
    typed,
)
from app.viewer.tabs.robot.presets import PRESETS
from kin.robot import NominalTable
from kin.transforms import pose_from_position_wxyz
from kin.units import Units

UR5, PANDA, STANFORD = (kin.get_robot(name) for name in ("ur5", "panda", "stanford"))
MM, RADIANS = Units(), Units(degrees=False, length="m")


def type_in(robot, *texts, units=MM, own=None):
    return typed(robot, own, dict(texts), units)


def test_a_typed_number_changes_one_number_and_nothing_else():
    own = type_in(PANDA, ((2, "a"), "12.5"))
    assert own.robot.rows[2].a == 0.0125
    assert own.start == "panda"
    assert own.robot.name.endswith("variant")
    for i, (row, before) in enumerate(zip(own.robot.rows, PANDA.rows, strict=True)):
        for key in ("theta", "d", "alpha", "kind", "limits", "name", *(("a",) if i != 2 else ())):
            assert getattr(row, key) == getattr(before, key)
    assert own.robot.home == PANDA.home


def test_a_right_angle_is_exact_in_any_unit():
    for text, units in (("90", MM), ("pi/2", MM), ("pi/2", RADIANS), ("90°", RADIANS)):
        assert type_in(UR5, ((1, "alpha"), text), units=units).robot.rows[1].alpha == math.pi / 2


def test_limits_are_typed_one_by_one_or_together():
    own = type_in(UR5, ((0, "low"), "-10"), ((0, "high"), "10"))
    assert own.robot.rows[0].limits == (math.radians(-10), math.radians(10))
    assert own.robot.in_limits(own.robot.q_home)
    with pytest.raises(EditError, match="lower below upper") as caught:
        type_in(own.robot, ((0, "low"), "20"), own=own)
    assert caught.value.cell == (0, "low")
    both = type_in(own.robot, ((0, "low"), "20"), ((0, "high"), "30"), own=own)
    assert both.robot.rows[0].limits == (math.radians(20), math.radians(30))


def test_a_joint_without_limits_has_neither():
    free = type_in(UR5, ((0, "low"), ""), ((0, "high"), " "))
    assert free.robot.rows[0].limits is None
    with pytest.raises(EditError, match="give both limits, or none") as caught:
        type_in(UR5, ((0, "low"), ""))
    assert caught.value.cell == (0, "low")
    with pytest.raises(EditError, match="two numbers"):
        type_in(STANFORD, ((2, "low"), ""), ((2, "high"), ""))


def test_home_and_limits_of_motion_are_typed_in_the_units_of_the_joint():
    limits = (((1, "velocity"), "90 °/s"), ((2, "acceleration"), "3 rad/s²"), ((3, "jerk"), "5000"))
    own = type_in(UR5, ((1, "home"), "-80"), *limits)
    robot = own.robot
    assert robot.q_home.tolist() == [UR5.q_home[0], math.radians(-80), *UR5.q_home[2:]]
    assert robot.rows[1].velocity == pytest.approx(math.pi / 2)
    assert robot.rows[2].acceleration == 3.0
    assert kin.motion.motion_limits(robot).jerk[3] == pytest.approx(math.radians(5000))
    assert "jerk" not in kin.motion.motion_limits(robot).assumed[3]
    assumed = type_in(robot, ((1, "velocity"), " "), own=own)
    assert assumed.robot.rows[1].velocity is None
    assert assumed.robot.rows[2].acceleration == 3.0
    slide = type_in(STANFORD, ((2, "home"), "40 cm"), ((2, "velocity"), "250")).robot
    assert (slide.q_home[2], slide.rows[2].velocity) == (0.4, 0.25)
    assert type_in(STANFORD, ((2, "velocity"), "0.25 m/s"), units=RADIANS).robot.rows[2].velocity == 0.25


def test_home_values_stay_with_their_joints():
    own = type_in(UR5, *(((i, "home"), str(10 * i)) for i in range(6)))
    home = np.degrees(own.robot.q_home).round(9).tolist()
    assert home == [0, 10, 20, 30, 40, 50]

    def after(change):
        return np.degrees(changed_rows(own.robot, own, change).robot.q_home).round(9).tolist()

    added = after(lambda rows: add_row(rows, 1, "mm"))
    assert [*added[:2], *added[3:]] == home, "a new joint alone has an assumed value"
    assert after(lambda rows: rows.__delitem__(2)) == [0, 10, 30, 40, 50]
    assert after(lambda rows: move_row(rows, 0, 1)) == [10, 0, 20, 30, 40, 50]


def test_a_home_value_that_is_not_valid_any_more_is_the_only_one_replaced():
    own = type_in(UR5, *(((i, "home"), str(10 * i)) for i in range(6)))
    narrow = type_in(own.robot, ((2, "low"), "-90"), ((2, "high"), "-80"), own=own).robot
    assert np.degrees(np.delete(narrow.q_home, 2)).round(9).tolist() == [0, 10, 30, 40, 50]
    assert -90 <= np.degrees(narrow.q_home[2]) <= -80
    slides = type_in(own.robot, ((3, "kind"), "prismatic"), ((4, "home"), "45"), own=own).robot
    assert np.degrees(np.delete(slides.q_home, 3)).round(9).tolist() == [0, 10, 20, 45, 50]
    fixed = type_in(own.robot, ((3, "kind"), "fixed"), ((4, "home"), "45"), own=own).robot
    assert np.degrees(fixed.q_home).round(9).tolist() == [0, 10, 20, 45, 50]


@pytest.mark.parametrize(
    ("column", "text", "words"),
    [
        ("home", "400", "“400” is outside the limits: −360.0° to 360.0°"),
        ("home", "", "the field is empty"),
        ("velocity", "0", "expected a positive number"),
        ("jerk", "-5", "expected a positive number"),
        ("acceleration", "fast", "“fast” is not a number"),
        ("acceleration", "nan", "“nan”"),
    ],
)
def test_a_home_outside_the_limits_and_a_limit_of_nothing_are_named_by_their_cell(column, text, words):
    with pytest.raises(EditError) as caught:
        type_in(UR5, ((1, column), text))
    assert caught.value.cell == (1, column)
    assert words in caught.value.message


def test_another_kind_takes_its_default_limits_and_a_new_home():
    own = type_in(UR5, ((2, "kind"), "prismatic"))
    assert own.robot.rows[2].limits == (0.0, 1.0)
    assert own.robot.in_limits(own.robot.q_home)
    fixed = type_in(UR5, ((2, "kind"), "fixed"))
    assert fixed.robot.n == 5
    with pytest.raises(EditError):
        type_in(fixed.robot, ((2, "low"), "1"), own=fixed)
    for column in MOTION:
        with pytest.raises(EditError, match="a fixed row does not move"):
            type_in(fixed.robot, ((2, column), "1"), own=fixed)
    later = type_in(fixed.robot, ((3, "home"), "-45"), own=fixed).robot
    assert later.q_home.tolist() == [*fixed.robot.q_home[:2], math.radians(-45), *fixed.robot.q_home[3:]]
    with pytest.raises(EditError, match="one of"):
        type_in(UR5, ((2, "kind"), "ball"))


@pytest.mark.parametrize(
    ("cell", "text", "words"),
    [
        ((2, "alpha"), "9o", "“9o” is not a number"),
        ((2, "a"), "", "the field is empty"),
        ((2, "a"), "99999999999", "too large"),
        ((2, "a"), "999 m + 9*1e5", "expected lengths"),
        ((1, "name"), "joint 1", "a different name"),
        (("tool", "x"), "1 rad", "is not a unit of a length"),
        (("base", "z"), "1001 m", "at most 1000 m"),
    ],
)
def test_a_wrong_text_is_named_by_its_cell(cell, text, words):
    first = type_in(UR5, ((0, "name"), "joint 1"))
    with pytest.raises(EditError) as caught:
        typed(first.robot, first, {cell: text}, MM)
    assert caught.value.cell == cell
    assert words in caught.value.message


def test_all_lengths_zero_is_no_arm_and_empty_has_the_one_length_it_needs():
    own = own_arm(PRESETS["one-joint"])
    (row,) = own.robot.rows
    assert [value for value in (row.theta, row.d, row.a, row.alpha) if value] == [row.a]
    assert not own.robot.q_home.any()
    flat = type_in(own.robot, ((0, "d"), "0"), own=own)
    with pytest.raises(EditError, match="expected lengths a and d"):
        type_in(flat.robot, ((0, "a"), "0"), own=flat)


def test_a_tool_moves_the_tool_point_and_a_base_the_whole_arm():
    own = type_in(UR5, (("tool", "z"), "120"), (("tool", "roll"), "180"))
    T = kin.fk(UR5, UR5.q_home) @ pose_from_position_wxyz([0, 0, 0.12], [0, 1, 0, 0])
    assert np.abs(kin.fk(own.robot, UR5.q_home) - T).max() < 1e-15
    based = type_in(own.robot, (("base", "x"), "0.5"), (("base", "yaw"), "pi/2"), units=RADIANS, own=own)
    B = pose_from_position_wxyz([0.5, 0, 0], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    assert np.abs(kin.fk(based.robot, UR5.q_home) - B @ T).max() < 1e-15
    assert frame_values(based.robot, "tool")[2:4] == (0.12, math.pi)
    assert frame_values(based.robot, "base") == (0.5, 0.0, 0.0, 0.0, 0.0, math.pi / 2)


def test_motors_follow_their_joints_and_go_with_them():
    so101 = kin.get_robot("so101")
    joints = [motor.joint for motor in so101.motors]

    def left(robot):
        return [motor.joint for motor in robot.motors]

    renamed = type_in(so101, ((1, "name"), "upper arm"))
    assert left(renamed.robot) == [joints[0], "upper arm", *joints[2:]]
    assert renamed.robot.motors[1].name == "shoulder_lift"
    for change in ("fixed", "prismatic"):
        changed = type_in(so101, ((1, "kind"), change))
        assert left(changed.robot) == [joints[0], *joints[2:]]
    removed = changed_rows(so101, None, lambda rows: rows.__delitem__(2))
    assert left(removed.robot) == [*joints[:2], *joints[3:]]
    moved = changed_rows(so101, None, lambda rows: move_row(rows, 0, 1))
    assert left(moved.robot) == joints, "a motor names its joint, wherever that is"
    assert converted(so101, None).robot.motors == so101.motors


def test_another_mounting_turns_the_arm_with_its_base_and_back():
    q, placed = UR5.q_home, UR5.with_base(kin.pose_from_xyz_rpy([0.1, 0.2, 0.3], [0.0, 0.0, 0.4]))
    own, T = None, kin.fk(placed, q)
    robot = placed
    for mounting, turn in (
        ("ceiling", [math.pi, 0.0, 0.0]),
        ("wall", [0.0, math.pi / 2, 0.0]),
        ("table", [0.0] * 3),
    ):
        own = type_in(robot, (("arm", "mounting"), mounting), own=own)
        robot = own.robot
        assert robot.mounting == mounting
        about = kin.pose_from_xyz_rpy([0.0, 0.0, 0.0], turn)[:3, :3]
        expected = about @ (T[:3, 3] - [0.1, 0.2, 0.3]) + [0.1, 0.2, 0.3]
        assert np.abs(kin.fk(robot, q)[:3, 3] - expected).max() < 1e-12
        assert np.abs(kin.fk(robot, q)[:3, :3] - about @ T[:3, :3]).max() < 1e-12
    assert np.abs(robot.T_world_base - placed.T_world_base).max() < 1e-15


def test_the_floor_is_typed_emptied_and_forgotten_with_the_mounting():
    own = type_in(UR5, (("arm", "floor"), "-25 cm"))
    assert (own.robot.floor, own.robot.mounting) == (-0.25, None)
    assert type_in(own.robot, (("arm", "floor"), " "), own=own).robot.floor is None
    hanging = type_in(own.robot, (("arm", "mounting"), "ceiling"), own=own)
    assert hanging.robot.floor is None, "the floor of a pedestal is none of a ceiling"
    for column, text, words in (
        ("mounting", "sky", "“sky” is none of pedestal"),
        ("floor", "deep", "not a number"),
    ):
        with pytest.raises(EditError, match=words) as caught:
            type_in(UR5, (("arm", column), text))
        assert caught.value.cell == ("arm", column)


def test_rows_are_added_moved_and_removed():
    robot = UR5
    added = changed_rows(robot, None, lambda rows: add_row(rows, 2, robot.units))
    assert added.robot.n == 7
    assert added.robot.rows[3].a == 0.1
    assert len({row.name for row in added.robot.rows}) == 7
    moved = changed_rows(added.robot, added, lambda rows: move_row(rows, 3, -1))
    assert moved.robot.rows[2] == added.robot.rows[3]
    removed = changed_rows(moved.robot, moved, lambda rows: rows.pop(2) and None)
    assert removed.robot.rows == robot.rows
    assert removed.start == "ur5"
    with pytest.raises(EditError):
        changed_rows(robot, None, lambda rows: rows.clear())


def test_the_same_table_in_the_other_convention_is_another_arm():
    own = reread(UR5, None, "modified")
    assert own.robot.rows == UR5.rows
    assert np.abs(kin.fk(own.robot, UR5.q_home) - kin.fk(UR5, UR5.q_home)).max() > 0.01


def test_a_row_without_a_name_is_named_by_its_number():
    assert type_in(UR5, ((1, "name"), " \u200b ")).robot.rows[1].name == "joint 2"


def test_a_calibrated_arm_stays_one_until_other_rows_move():
    made = own_arm(kin.robot_to_dict(replace(UR5, nominal=NominalTable(UR5.rows, UR5.tool))))
    for cell, text in (((1, "a"), "-426"), ((1, "name"), "lift"), (("arm", "name"), "Mine")):
        changed = type_in(made.robot, (cell, text), own=made)
        assert changed.robot.nominal_arm is not None, cell
    assert changed.robot.nominal == made.robot.nominal
    assert converted(made.robot, made).robot.nominal_arm is not None
    assert type_in(made.robot, ((5, "kind"), "fixed"), own=made).robot.nominal is None
    assert changed_rows(made.robot, made, lambda rows: add_row(rows, 2, "mm")).robot.nominal is None
    assert reread(made.robot, made, "modified").robot.nominal is None
