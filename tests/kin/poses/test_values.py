"""Poses as numbers and back, their logarithm, and poses between two."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin.transforms import rotation_angle

part = st.floats(-3.0, 3.0)
three = st.tuples(part, part, part)


def by_squaring(twist):
    """exp of the 4×4 matrix of a twist (v, ω), without any formula of rotations."""
    (vx, vy, vz), (wx, wy, wz) = np.split(np.asarray(twist), 2)
    A = np.array([[0.0, -wz, wy, vx], [wz, 0.0, -wx, vy], [-wy, wx, 0.0, vz], [0.0] * 4]) / 2.0**20
    return np.linalg.matrix_power(np.eye(4) + A + A @ A / 2.0, 2**20)


@given(three, three)
def test_the_exponential_is_that_of_the_matrix_and_the_logarithm_its_inverse(v, omega):
    twist = np.array([*v, *omega])
    T = kin.pose_exp(twist)
    assert pytest.approx(by_squaring(twist), abs=1e-8) == T
    back = kin.pose_log(T)
    assert kin.pose_exp(back) == pytest.approx(T, abs=1e-12)
    if np.linalg.norm(omega) < 3.1:
        assert back == pytest.approx(twist, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-5, 1.9e-4, 2.1e-4, 1.0, np.pi - 1e-9, np.pi])
def test_the_logarithm_is_exact_for_small_angles_and_half_turns(angle):
    twist = np.array([0.3, -0.2, 0.5, 0.0, 0.6 * angle, -0.8 * angle])
    if angle < 3.0:
        assert kin.pose_log(kin.pose_exp(twist)) == pytest.approx(twist, abs=1e-11)
    assert kin.pose_exp(kin.pose_log(kin.pose_exp(twist))) == pytest.approx(kin.pose_exp(twist), abs=1e-14)


@given(three, three)
def test_numbers_of_a_pose_give_it_again(xyz, rpy):
    T = kin.pose_from_xyz_rpy(xyz, rpy)
    for parts, pose in (
        (kin.xyz_rpy_from_pose(T), kin.pose_from_xyz_rpy),
        (kin.position_wxyz_from_pose(T), kin.pose_from_position_wxyz),
    ):
        assert pose(*parts) == pytest.approx(T, abs=1e-12)
    assert abs(kin.xyz_rpy_from_pose(T)[1][1]) <= np.pi / 2
    assert kin.position_wxyz_from_pose(T)[1][0] >= 0.0


@given(three, three, st.floats(0.0, 1.0))
def test_a_pose_between_two_is_on_the_line_and_on_the_shortest_turn(v, omega, share):
    a = kin.pose_from_xyz_rpy([0.1, 0.2, 0.3], [0.4, 0.5, 0.6])
    b = a @ kin.pose_exp([*v, *omega])
    first, there, last = kin.interpolate_poses(a, b, [0.0, share, 1.0])
    assert first == pytest.approx(a, abs=1e-12)
    assert last == pytest.approx(b, abs=1e-9)
    assert there[:3, 3] == pytest.approx((1.0 - share) * a[:3, 3] + share * b[:3, 3], abs=1e-12)
    whole = rotation_angle(a[:3, :3], b[:3, :3])
    assert rotation_angle(a[:3, :3], there[:3, :3]) == pytest.approx(share * whole, abs=1e-9)
    assert kin.interpolate_poses(a, b, share).tolist() == there.tolist()


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: kin.pose_log(np.eye(3)), "T"),
        (lambda: kin.xyz_rpy_from_pose(np.diag([1.0, 1.0, -1.0, 1.0])), "T rotation"),
        (lambda: kin.position_wxyz_from_pose([[1.0]]), "T"),
        (lambda: kin.pose_exp([0.0] * 5), "twist"),
        (lambda: kin.pose_exp([[0.0] * 6]), "twist"),
        (lambda: kin.interpolate_poses(np.eye(4), np.zeros((4, 4)), 0.5), "b[3]"),
        (lambda: kin.interpolate_poses(np.eye(4), np.eye(4), [0.5, np.nan]), "share[1]"),
    ],
)
def test_what_is_no_pose_is_named(call, field):
    with pytest.raises(kin.InputError) as caught:
        call()
    assert caught.value.field == field
