"""What visitors type: joint values and target poses, valid and invalid."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.viewer.panel.entry import read_value
from app.viewer.panel.fields import shown
from kin.poses import read_pose, roll_pitch_yaw
from kin.transforms import wxyz_from_rotation
from kin.typed import EntryError
from kin.units import Units

DEGREES, RADIANS = Units(), Units(degrees=False, length="m")
LIMITS = (math.radians(-5.0), math.radians(150.0))
UR5 = kin.get_robot("ur5")
START = kin.fk(UR5, UR5.q_home)


def angle(text: str, units: Units = DEGREES) -> float:
    return read_value(text, "Joint 2", units.angles, LIMITS)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        *(("45.678", 45.678), ("45,678", 45.678), (" −5 ", -5.0), ("+.5", 0.5), ("1e2", 100.0), ("150", 150.0)),
        *(("45°", 45.0), ("45 deg", 45.0), ("0.5 rad", math.degrees(0.5)), ("1e2deg", 100.0)),
    ],
)
def test_a_number_is_read_with_its_own_precision_and_unit(text: str, degrees: float) -> None:
    assert math.degrees(angle(text)) == pytest.approx(degrees, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        *(("abc", "“abc” is not a number"), ("NaN", "“NaN” is not a number"), ("   ", "field is empty")),
        *(("200", "outside the limits"), ("-5.1", "outside the limits"), ("1e999", "too large")),
        *(("inf", "is not a number"), ("1.2.3", "is not a"), ("5 mm", "not a unit of an angle")),
        ("9" * 3000, "too long"),
    ],
)
def test_an_invalid_value_is_named_with_the_range(text: str, reason: str) -> None:
    with pytest.raises(EntryError, match=re.escape(reason)) as error:
        angle(text)
    if "limits" in reason or "not a number" in reason:
        assert "−5 … 150°" in error.value.detail


def test_a_length_is_read_in_its_unit() -> None:
    for text, units in (("100", DEGREES), ("0.1", RADIANS), ("10 cm", DEGREES), ("100 mm", RADIANS)):
        assert read_value(text, "Joint 3", units.lengths, (0.0, 0.3)) == pytest.approx(0.1)


@given(st.integers(-15_000_000, 15_000_000), st.integers(0, 6))
def test_what_was_typed_is_shown_again(number: int, decimals: int) -> None:
    typed = round(number / 10**decimals / 10**2, decimals)
    value = DEGREES.angles.read(typed)
    assert shown(value, DEGREES.angles, 2) == pytest.approx(typed, abs=1e-12 * max(1.0, abs(typed)))


def test_a_solution_is_shown_with_two_decimals() -> None:
    assert shown(math.radians(12.3456789123), DEGREES.angles, 2) == 12.35


angles = st.floats(-math.pi, math.pi)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_angles_are_those_of_the_readout(roll: float, pitch: float, yaw: float) -> None:
    R = read_pose("angles", f"{roll!r} {pitch!r} {yaw!r}", Units(degrees=False), np.eye(4))[0][:3, :3]
    again = roll_pitch_yaw(R)
    assert np.abs(np.exp(1j * np.array(again)) - np.exp(1j * np.array([roll, pitch, yaw]))).max() < 1e-9


@given(st.integers(0, 2**32 - 1))
def test_every_way_to_type_a_pose_gives_that_pose(seed: int) -> None:
    T = kin.fk(UR5, UR5.random_q(np.random.default_rng(seed)))
    xyz, R = 1000 * T[:3, 3], T[:3, :3]
    turned = np.degrees(roll_pitch_yaw(R))
    on_screen = T.copy()
    on_screen[:3, 3] = xyz
    for kind, numbers in (
        ("pose", [*xyz, *turned]),
        ("pose", [*xyz, *wxyz_from_rotation(R)]),
        ("pose", on_screen.ravel()),
        ("pose", on_screen[:3].ravel()),
    ):
        text = ", ".join(f"{v:.12f}" for v in numbers)
        read, given = read_pose(kind, text, DEGREES, START)  # type: ignore[arg-type]
        assert given == "pose"
        assert np.abs(read - T).max() < 1e-9
    read, given = read_pose("pose", np.array2string(T, precision=10) + " m", DEGREES, START)
    assert given == "pose"
    assert np.abs(read - T).max() < 1e-9


def test_parts_keep_the_rest_of_the_target() -> None:
    T, given = read_pose("position", "1 2 3", RADIANS, START)
    assert given == "pose"
    assert T[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert np.array_equal(T[:3, :3], START[:3, :3])
    T, _ = read_pose("angles", "0 0 90", DEGREES, START)
    assert np.allclose(T[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    T, _ = read_pose("quaternion", "(0.707, 0, 0, 0.707)", DEGREES, START)
    assert np.allclose(T[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.array_equal(T[:3, 3], START[:3, 3])
    T, given = read_pose("pose", "100 200 300", DEGREES, START)
    assert given == "position"
    assert T[:3, 3].tolist() == [0.1, 0.2, 0.3]


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-9, 1e-4, 0.02, 0.05, 3.0]))
def test_a_point_and_a_direction_turn_the_tool_by_no_more_than_it_takes(seed: int, off: float) -> None:
    rng = np.random.default_rng(seed)
    T = kin.fk(UR5, UR5.random_q(rng))
    way = off * rng.normal(size=3) + rng.choice([-1.0, 1.0]) * T[:3, 2]
    text = "100 200 300 along " + " ".join(f"{v:.17g}" for v in way)
    read, given = read_pose("pose", text, DEGREES, T)
    z = way / np.linalg.norm(way)
    assert given == "approach"
    assert read[:3, 3].tolist() == [0.1, 0.2, 0.3]
    assert np.abs(read[:3, 2] - z).max() < 1e-12
    assert np.abs(read[:3, :3].T @ read[:3, :3] - np.eye(3)).max() < 1e-11  # near a half turn 1 + cos is 1e-3
    turn = np.arccos(np.clip((np.trace(read[:3, :3] @ T[:3, :3].T) - 1.0) / 2.0, -1.0, 1.0))
    least = np.arctan2(np.linalg.norm(np.cross(T[:3, 2], z)), T[:3, 2] @ z)
    assert turn == pytest.approx(least, abs=1e-6) or least > np.radians(177.0)


@pytest.mark.parametrize(
    ("kind", "text", "reason"),
    [
        ("pose", "1 2", "Found 2"),
        ("pose", "", "Found 0"),
        ("pose", "1 2 3 along 0 0", "Found 3 before and 2 after"),
        ("pose", "1 2 3 along 0 0 0", "not all zero"),
        ("pose", "1 2 3 along a b c", "“a” is not a number"),
        ("pose", "1 2 3 4 along 0 0 1", "Found 4 before and 3 after"),
        ("position", "1 2 3 along 0 0 1", "“along” is not a number"),
        ("position", "1 2 x", "“x” is not a number"),
        ("position", "1 2 3 4", "x y z in mm"),
        ("position", "1e9 0 0", "too far away"),
        ("position", "1e999 0 0", "too large"),
        ("angles", "1 2", "Rz(yaw)·Ry(pitch)·Rx(roll)"),
        ("quaternion", "1 1 0 0", "norm of w x y z is 1.414"),
        ("quaternion", "0 0 0 0", "norm of w x y z is 0"),
        ("pose", "1 0 0 0 0 1 0 0 0 0 2 0", "not a rotation"),
        ("pose", "1 0 0 0 0 1 0 0 0 0 -1 0", "right-handed"),
        ("pose", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1", "last row 0, 0, 0, 1"),
    ],
)
def test_an_invalid_target_is_named(kind: str, text: str, reason: str) -> None:
    with pytest.raises(EntryError, match=re.escape(reason)):
        read_pose(kind, text, DEGREES, START)  # type: ignore[arg-type]
