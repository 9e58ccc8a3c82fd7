"""DH tables of given chains, and the same arm in the other convention."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import nested, random_robot
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import InputError, Joint, Robot
from kin.axes import inverse, screw_x, screw_z
from kin.dh.tables import convert_dh, largest_difference, table_of_chain

EXACT = 1e-12
OTHER = {"standard": "modified", "modified": "standard"}


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_both_conventions_describe_the_same_arm(robot):
    other = kin.dh.convert_dh(robot, OTHER[robot.convention])
    assert other.convention != robot.convention
    assert (other.joints[0].limits, other.home, other.id) == (robot.joints[0].limits, robot.home, robot.id)
    assert largest_difference(robot, other) <= EXACT
    # The table itself is another one: read in the wrong convention it is another arm.
    assert largest_difference(robot, replace(other, convention=robot.convention)) > 1e-3
    again = kin.dh.convert_dh(other, robot.convention)
    assert largest_difference(robot, again) <= EXACT
    assert kin.dh.convert_dh(robot, robot.convention) is robot


def test_converting_shifts_the_table_by_half_a_row():
    puma = kin.get_robot("puma560")
    modified = kin.dh.convert_dh(puma, "modified")
    assert [(row.theta, row.d) for row in modified.rows] == [(row.theta, row.d) for row in puma.rows]
    assert [(row.a, row.alpha) for row in modified.rows[1:]] == [(row.a, row.alpha) for row in puma.rows[:-1]]
    assert modified.tool == puma.tool
    pioneer = kin.dh.convert_dh(kin.get_robot("pioneer5"), "modified")
    last = kin.get_robot("pioneer5").rows[-1]
    assert pioneer.T_last_tool == pytest.approx(screw_x(last.a, last.alpha))
    with pytest.raises(InputError, match="convention"):
        kin.dh.convert_dh(puma, "craig")


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_any_table_is_converted(seed):
    robot = random_robot(seed)
    other = convert_dh(robot, OTHER[robot.convention])
    assert largest_difference(robot, other, 16) <= EXACT
    assert largest_difference(robot, convert_dh(other, robot.convention), 16) <= EXACT


def turn_about(axis, angle):
    """Rotation about a unit vector, exact for angles as small as 1e-17."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + 2 * math.sin(angle / 2) ** 2 * K @ K


def random_transform(rng):
    """Any pose, or one whose z axis is parallel, antiparallel, almost so, perpendicular or intersecting."""
    T = np.eye(4)
    axis = rng.normal(size=3)
    tilt = turn_about(axis / np.linalg.norm(axis), 10.0 ** rng.uniform(-17, -1))
    about_z = turn_about((0, 0, 1), rng.uniform(-3, 3))
    flipped = np.diag([1.0, -1.0, -1.0])
    quarter = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    any_of_them = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    choices = [np.eye(3), flipped, about_z, quarter, tilt, tilt @ flipped @ about_z]
    k = int(rng.integers(len(choices) + 1))
    T[:3, :3] = choices[k] if k < len(choices) else any_of_them * np.linalg.det(any_of_them)
    T[:3, 3] = rng.uniform(-1, 1, 3) * rng.choice([0.0, 1.0], 3, p=[0.4, 0.6])
    return T


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_any_chain_of_joints_has_an_exact_table(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    kinds = [str(kind) for kind in rng.choice(["revolute", "prismatic"], n, p=[0.8, 0.2])]
    joints = [Joint(f"joint {i + 1}", kind=kind, limits=(-2, 2)) for i, kind in enumerate(kinds)]
    transforms = [random_transform(rng) for _ in range(n + 1)]
    table = table_of_chain(joints, transforms)
    robot = Robot("chain", "Chain", "test", "standard", table.rows, (0.0,) * n, base=table.base, tool=table.tool)
    assert [row.name for row in robot.joints] == [joint.name for joint in joints]
    for q in robot.random_q(rng, 4):
        T = transforms[0]
        for kind, value, after in zip(kinds, q, transforms[1:], strict=True):
            T = T @ (screw_z(value, 0.0) if kind == "revolute" else screw_z(0.0, value)) @ after
        assert np.abs(kin.fk(robot, q) - T).max() <= EXACT


def test_round_numbers_stay_round():
    """A table multiplied out and found again, with the numbers as they were typed."""
    for robot in (kin.get_robot("irb120"), kin.get_robot("iiwa14")):
        transforms = [np.eye(4)]
        for row in robot.rows:
            transforms[-1] = transforms[-1] @ screw_z(row.theta, row.d)
            transforms.append(screw_x(row.a, row.alpha))
        table = table_of_chain(robot.joints, transforms)
        assert [row.alpha for row in table.rows] == [row.alpha for row in robot.rows]
        for ours, theirs in zip(table.rows, robot.rows, strict=True):
            assert (ours.theta, ours.d, ours.a) == pytest.approx((theirs.theta, theirs.d, theirs.a), abs=1e-15)
        assert (table.base, table.tool) == (robot.base, robot.tool)


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12])
def test_almost_parallel_axes_lose_no_digits(angle):
    tilted = np.eye(4)
    tilted[:3, :3] = turn_about((0.6, 0.8, 0.0), angle)
    tilted[:3, 3] = 0.4, 0.1, 0.2
    joints = [Joint("one", limits=(-3, 3)), Joint("two", limits=(-3, 3))]
    end = screw_z(0.3, 0.5)
    table = table_of_chain(joints, [np.eye(4), tilted, end])
    assert [row.name for row in table.rows] == ["one", "one tilt", "two"]
    assert abs(table.rows[1].alpha) == pytest.approx(angle, rel=1e-3)
    assert max(abs(row.d) + abs(row.a) for row in table.rows) < 1.0
    robot = Robot("almost", "Almost", "test", "standard", table.rows, (0.0, 0.0), tool=nested(table.tool))
    for q in ((0.0, 0.0), (1.0, -2.0), (-3.0, 2.5)):
        T = screw_z(q[0], 0.0) @ tilted @ screw_z(q[1], 0.0) @ end
        assert np.abs(kin.fk(robot, q) - T).max() < 1e-15


def test_the_inverse_chain():
    """A chain read backwards brings the base to the tool."""
    rng = np.random.default_rng(5)
    transforms = [random_transform(rng) for _ in range(4)]
    joints = [Joint(f"joint {i}", limits=(-3, 3)) for i in range(3)]
    there = table_of_chain(joints, transforms)
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    ends = [np.eye(4), *[flip] * 6, np.eye(4)]
    back = [ends[2 * k] @ inverse(T) @ ends[2 * k + 1] for k, T in enumerate(transforms[::-1])]
    here = table_of_chain(joints[::-1], back)
    arms = [
        Robot("x", "X", "test", "standard", t.rows, (0.0,) * 3, base=t.base, tool=t.tool) for t in (there, here)
    ]
    q = np.array([0.4, -1.1, 2.0])
    assert kin.fk(arms[0], q) @ kin.fk(arms[1], q[::-1]) == pytest.approx(np.eye(4), abs=EXACT)
