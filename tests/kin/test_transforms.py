"""Quaternions, rotation angles and the checks of targets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin import InputError, transforms
from kin.transforms import (
    as_transform,
    frame_from_approach,
    pose_from_position_wxyz,
    rotation_about,
    rotation_angle,
    rotation_from_wxyz,
    vector_angle,
    wxyz_from_rotation,
)

components = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 1e-3)


def about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


@given(components)
def test_quaternions_round_trip(q):
    q = np.array(q) / np.linalg.norm(q)
    R = rotation_from_wxyz(q)
    assert pytest.approx(np.eye(3), abs=1e-14) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1)
    back = wxyz_from_rotation(R)
    assert back[0] >= 0
    assert abs(back @ q) == pytest.approx(1, abs=1e-14)
    assert rotation_from_wxyz(back) == pytest.approx(R, abs=1e-14)


@pytest.mark.parametrize("axis", np.vstack([np.eye(3), [[0.6, 0.8, 0], [0.48, 0.6, 0.64]]]))
def test_half_turns_round_trip(axis):
    R = 2 * np.outer(axis, axis) - np.eye(3)
    q = wxyz_from_rotation(R)
    assert abs(q[0]) < 1e-12
    assert rotation_from_wxyz(q) == pytest.approx(R, abs=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-3, 1.0, 3.0, math.pi - 1e-9, math.pi])
def test_angles_are_accurate_from_zero_to_half_a_turn(angle):
    start = rotation_from_wxyz(np.array([0.3, -0.2, 0.9, 0.1]))
    assert rotation_angle(start, start @ about_z(angle)) == pytest.approx(angle, rel=1e-6, abs=1e-15)
    assert vector_angle(about_z(angle)[:, 0], np.eye(3)[:, 0]) == pytest.approx(angle, rel=1e-6, abs=1e-15)


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 1e-6))
def test_an_approach_direction_becomes_a_frame(direction):
    R = frame_from_approach(direction)
    assert pytest.approx(np.eye(3), abs=1e-12) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1)
    assert R[:, 2] == pytest.approx(np.array(direction) / np.linalg.norm(direction), abs=1e-12)


def test_a_rounded_target_is_made_orthonormal():
    T = pose_from_position_wxyz([0.1, 0.2, 0.3], [0.3, -0.2, 0.9, 0.1])
    R = as_transform(np.round(T, 7))[:3, :3]
    assert np.abs(R.T @ R - np.eye(3)).max() < 1e-14
    assert as_transform(T) == pytest.approx(T, abs=1e-15)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda T: T * 2, "target[3]"),
        (lambda T: T @ np.diag([1, 1, -1, 1]), "target rotation"),
        (lambda T: T @ np.diag([1.001, 1, 1, 1]), "target rotation"),
        (lambda T: np.where(T == 0.2, np.nan, T), "target[1][3]"),
        (lambda T: T[:3], "target"),
        (lambda T: np.stack([T, T]), "target"),
        (lambda T: np.vstack([T[:3], [1, 0, 0, 1]]), "target[3]"),
        (lambda T: T * 1e308, "target"),
        (lambda T: "up", "target"),
    ],
)
def test_an_invalid_pose_is_rejected(change, field):
    with pytest.raises(InputError) as caught:
        as_transform(change(pose_from_position_wxyz([0.1, 0.2, 0.3], [1, 0, 0, 0])))
    assert caught.value.field.startswith(field)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: pose_from_position_wxyz([0, 0], [1, 0, 0, 0]), "position"),
        (lambda: pose_from_position_wxyz([0, 0, math.inf]), "position[2]"),
        (lambda: pose_from_position_wxyz([0, 0, 0], [0, 0, 0, 0]), "wxyz"),
        (lambda: pose_from_position_wxyz([0, 0, 0], [1, 0, 0]), "wxyz"),
        (lambda: frame_from_approach([0, 0, 0]), "approach"),
        (lambda: frame_from_approach([[0, 0, 1]]), "approach"),
    ],
)
def test_invalid_input_names_the_field(call, field):
    with pytest.raises(InputError) as caught:
        call()
    assert caught.value.field == field


def test_a_quaternion_may_be_a_list_of_any_length():
    """Also where the squares of its numbers overflow or vanish."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for size in (1e200, 1.0, 1e-11):
        assert transforms.rotation_from_wxyz([size, 0, 0, size]) == pytest.approx(quarter, abs=1e-15)


@pytest.mark.parametrize(
    ("wxyz", "field"),
    [
        (None, "wxyz"),
        ("abc", "wxyz"),
        ([1, 0, 0], "wxyz"),
        ([[1, 0, 0, 0]], "wxyz"),
        ([1, math.nan, 0, 0], "wxyz[1]"),
        ([0, 0, 0, 0], "wxyz"),
    ],
)
def test_what_is_no_quaternion_is_refused(wxyz, field):
    with pytest.raises(kin.InputError) as caught:
        kin.rotation_from_wxyz(wxyz)
    assert caught.value.field == field


@pytest.mark.parametrize("length", [1.0, 0.01, 70.0])
def test_a_rotation_about_an_axis_turns_what_is_perpendicular_to_it_by_the_angle(length: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    R = rotation_about(length * axis, 0.7)
    assert np.allclose(R @ axis, axis, atol=1e-15)
    side = np.array([1.0, 2.0, 0.0]) / math.sqrt(5.0)
    assert np.allclose(R @ side, math.cos(0.7) * side + math.sin(0.7) * np.cross(axis, side), atol=1e-15)
