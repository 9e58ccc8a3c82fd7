"""Named frames: world, base, tool and workpieces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin

UR5 = kin.get_robot("ur5")
Q = np.array([0.3, -1.2, 1.4, 0.2, 0.7, 0.1])
T_TABLE = kin.pose_from_xyz_rpy([0.3, 0.2, 0.1], [0.1, -0.2, 0.3])
ANGLES = st.floats(-math.pi, math.pi)


@given(st.tuples(ANGLES, ANGLES, ANGLES))
def test_roll_pitch_yaw_are_three_turns_about_fixed_axes(rpy):
    def turn(axis, angle):
        w, v = math.cos(angle / 2), math.sin(angle / 2)
        return kin.pose_from_position_wxyz([0, 0, 0], [w, *(v * np.eye(3)[axis])])

    roll, pitch, yaw = rpy
    expected = turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)
    expected[:3, 3] = [1.0, 2.0, 3.0]
    assert np.allclose(kin.pose_from_xyz_rpy([1, 2, 3], rpy), expected, atol=1e-14)


def test_each_frame_has_its_pose():
    stand = kin.pose_from_xyz_rpy([0.0, 0.5, 0.0], [0.0, 0.0, math.pi / 2])
    arm = UR5.with_base(stand)
    assert np.array_equal(kin.frame_pose(arm, "world"), np.eye(4))
    assert np.array_equal(kin.frame_pose(arm, "base"), arm.T_world_base)
    assert np.array_equal(kin.frame_pose(arm, "tool", q=Q), kin.fk(arm, Q))
    assert np.allclose(kin.frame_pose(arm, "table", {"table": T_TABLE}), T_TABLE, atol=1e-15)
    assert np.array_equal(kin.frame_pose(UR5, "base"), np.eye(4)), (
        "an arm without a base stands in the world frame"
    )


@pytest.mark.parametrize("frame", ["world", "base", "tool", "table"])
def test_the_pose_of_a_frame_is_the_callers_own(frame):
    T = kin.frame_pose(UR5, frame, {"table": T_TABLE}, Q)
    T[0, 3] += 1.0
    assert not np.array_equal(T, kin.frame_pose(UR5, frame, {"table": T_TABLE}, Q))


@pytest.mark.parametrize("frame", ["world", "base", "tool", "table"])
def test_a_target_in_a_frame_is_the_same_place(frame):
    T_world_frame = kin.frame_pose(UR5, frame, {"table": T_TABLE}, Q)
    result = kin.solve_ik(UR5, T_world_frame @ np.linalg.solve(T_world_frame, kin.fk(UR5, Q)), q_seed=Q)
    assert np.allclose(result.solutions[0].q, Q, atol=1e-9)


@pytest.mark.parametrize(
    ("frame", "workpieces", "q", "field"),
    [
        ("table", {}, Q, "frame"),
        ("tool", {}, None, "frame"),
        ("tool", {}, Q[:3], "q"),
        ("tool", {}, [Q, Q], "q"),
        ("table", {"table": np.zeros((4, 4))}, Q, "workpieces.table"),
        ("world", {"base": T_TABLE}, Q, "workpieces"),
        ("world", {" ": T_TABLE}, Q, "workpieces"),
        (["world"], {}, Q, "frame"),
        ("world", "abc", Q, "workpieces"),
        ("world", [], Q, "workpieces"),
    ],
)
def test_what_is_no_frame_is_refused_by_name(frame, workpieces, q, field):
    with pytest.raises(kin.InputError) as refused:
        kin.frame_pose(UR5, frame, workpieces, q)
    assert refused.value.field.startswith(field)


@pytest.mark.parametrize(
    ("xyz", "rpy"), [([1, 2], [0, 0, 0]), ([1, 2, 3], [0, 0, math.nan]), ([[1, 2, 3]], [0, 0, 0])]
)
def test_what_is_no_position_or_rotation_is_refused(xyz, rpy):
    with pytest.raises(kin.InputError, match=r"^(xyz|rpy)"):
        kin.pose_from_xyz_rpy(xyz, rpy)
