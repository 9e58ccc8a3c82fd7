"""Relations of joint axes: known arms, and random chains with known relations, at any scale."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin import axes
from kin.robot import Joint, Robot


def arm(*rows, convention="standard", scale=1.0):
    """A robot of rows (d, a, alpha) or (kind, d, a, alpha), in metres and radians."""
    joints = []
    for i, row in enumerate(rows):
        kind, d, a, alpha = row if isinstance(row[0], str) else ("revolute", *row)
        joints.append(Joint(f"{i}", 0.3, d * scale, a * scale, alpha, kind, (-2.0, 2.0)))
    return Robot("any", "any", "made", convention, tuple(joints), (0.0,) * len(joints))


def facts(robot):
    """The relations of every pair, without numbers."""
    return [(p.parallel, p.perpendicular, p.intersect, p.almost) for p in axes.pairs(robot)]


SQUARE = math.pi / 2


@pytest.mark.parametrize(
    ("robot_id", "spherical", "parallel"),
    [
        ("pioneer5", (), ((1, 2),)),
        ("redundant7", (2, 4), ((0, 1),)),
        ("redundant7-craig", (0, 2, 4), ()),
        ("iiwa14", (0, 2, 4), ()),
        ("irb120", (3,), ((1, 2),)),
        ("panda", (0,), ()),
        ("puma560", (3,), ((1, 2),)),
        ("scara", (), ((0, 3),)),
        ("stanford", (3,), ((2, 3),)),
        ("ur5", (), ((1, 3),)),
    ],
)
def test_groups_of_the_built_in_arms(robot_id, spherical, parallel):
    robot = kin.get_robot(robot_id)
    assert axes.spherical_groups(robot) == spherical
    assert axes.parallel_groups(robot) == parallel


def test_distances_between_axes_of_known_arms():
    distances = [p.distance for p in axes.pairs(kin.get_robot("puma560"))]
    assert distances == pytest.approx([0.0, 0.4318, 0.0203, 0.0, 0.0], abs=1e-12)
    distances = [p.distance for p in axes.pairs(kin.get_robot("panda"))]
    assert distances == pytest.approx([0.0, 0.0, 0.0825, 0.0825, 0.0, 0.088], abs=1e-12)
    assert math.isnan(
        axes.pairs(kin.get_robot("scara"))[1].distance
    )  # the axis of a prismatic joint has no particular place


twist = st.one_of(st.sampled_from([0.0, SQUARE, -SQUARE, math.pi]), st.floats(0.1, 1.4))
length = st.one_of(st.just(0.0), st.floats(0.05, 0.5))


@given(
    rows=st.lists(st.tuples(length, length, twist), min_size=2, max_size=7),
    convention=st.sampled_from(["standard", "modified"]),
    scale=st.sampled_from([1e-3, 1.0, 50.0]),
)
def test_pairs_have_the_angle_and_distance_of_the_rows(rows, convention, scale):
    """a and α between two joints are the distance and angle of their axes, at any scale."""
    robot = arm(*rows, convention=convention, scale=scale)
    between = rows[:-1] if convention == "standard" else rows[1:]
    for (_, a, alpha), pair in zip(between, axes.pairs(robot), strict=True):
        assert pair.distance == pytest.approx(a * scale, abs=1e-9 * scale)
        assert pair.angle == pytest.approx(math.atan2(abs(math.sin(alpha)), abs(math.cos(alpha))), abs=1e-9)
        assert pair.parallel == (alpha in (0.0, math.pi))
        assert pair.perpendicular == (abs(alpha) == SQUARE)
        assert pair.intersect == (a == 0.0)
        assert pair.one_line == (a == 0.0 and alpha in (0.0, math.pi))
        assert pair.almost == ""


@given(angles=st.tuples(st.floats(0.3, 2.8), st.floats(0.3, 2.8)), d=st.floats(0.01, 1))
def test_three_axes_form_a_spherical_group_only_if_all_meet(angles, d):
    """With a = 0 neighbours intersect; the offset of the middle joint decides whether all three meet."""
    first, second = angles
    ends = (0.2, 0.3, 0.7), (0.4, 0.1, 0.2)
    wrist = arm(ends[0], (0.1, 0.0, first), (0.0, 0.0, second), (d, 0.2, 1.0), ends[1])
    assert axes.spherical_groups(wrist) == (1,)
    offset = arm(ends[0], (0.1, 0.0, first), (d, 0.0, second), (0.1, 0.2, 1.0), ends[1])
    assert axes.spherical_groups(offset) == ()
    sliding = arm(ends[0], (0.1, 0.0, first), ("prismatic", 0.0, 0.0, second), (d, 0.2, 1.0), ends[1])
    assert axes.spherical_groups(sliding) == ()


def test_base_and_tool_do_not_change_the_relations():
    plain = kin.get_robot("puma560")
    turned = ((0.0, -1.0, 0.0, 1.0), (1.0, 0.0, 0.0, 2.0), (0.0, 0.0, 1.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    moved = replace(plain, base=turned, tool=turned)
    assert facts(moved) == facts(plain)
    assert axes.spherical_groups(moved) == axes.spherical_groups(plain) == (3,)


@pytest.mark.parametrize(
    ("row", "almost"),
    [
        ((0.1, 0.3, 1.5708), "perpendicular"),  # π/2 typed with five digits
        ((0.1, 0.3, 1e-4), "parallel"),
        ((0.1, 0.3, 3.1416), "parallel"),
        ((0.1, 1e-4, 1.0), "intersecting"),
        ((0.1, 0.3, 1.5), ""),
        ((0.1, 0.02, 1.0), ""),
    ],
)
def test_axes_that_almost_align_are_reported(row, almost):
    (pair, _) = axes.pairs(arm(row, (0.2, 0.3, SQUARE), (0.1, 0.2, 0.4)))
    assert pair.almost == almost
    assert (pair.parallel, pair.perpendicular, pair.intersect) == (False, False, False)


def test_generic_configurations_are_inside_the_limits_and_regular():
    for robot in kin.files.classic_robots().values():
        q = axes.generic_q(robot)
        assert robot.in_limits(q)
        assert kin.manipulability(robot, q) > 1e-7


@pytest.mark.parametrize("robot_id", kin.files.classic_robots())
@pytest.mark.parametrize("by_rows", [False, True])
def test_links_reproduce_forward_kinematics(robot_id, by_rows):
    """Forward kinematics is base · L1 … Ln · tool, and each joint adds to its link with its sign."""
    robot = kin.get_robot(robot_id)
    if by_rows:
        quarters = tuple(1 - int(pair.parallel) for pair in axes.pairs(robot))
        links = axes.links_by_rows(robot, quarters)
        assert (links is None) == (robot_id in ("scara", "stanford"))  # with prismatic joints
        if links is None:
            return
        assert np.abs(links.alpha[:-1] - np.array(quarters) * SQUARE).max() < 1e-9
    else:
        links = axes.links_of(robot, (1,) * (robot.n - 1))
    for q in robot.random_q(np.random.default_rng(1), 5):
        T = links.base
        for i, turns in enumerate(robot.revolute.tolist()):
            value = links.sign[i] * q[i]
            theta, d = (links.theta[i] + value, links.d[i]) if turns else (links.theta[i], links.d[i] + value)
            T = T @ axes.screw_z(theta, d) @ axes.screw_x(links.a[i], links.alpha[i])
        assert np.allclose(T @ links.tool, kin.fk(robot, q), rtol=0.0, atol=1e-12)


def test_axes_are_the_columns_of_the_jacobian():
    """A revolute column is (ω × r, ω) with r from the axis to the tool point; a prismatic one (ω, 0)."""
    for robot in kin.files.classic_robots().values():
        q = np.zeros(robot.n)
        J, tool = kin.jacobian(robot, q), kin.fk(robot, q)[:3, 3]
        for axis, column in zip(axes.joint_axes(robot), J.T, strict=True):
            moving = axis.direction if axis.slides else np.cross(axis.direction, tool - axis.point)
            assert np.allclose(column[:3], moving, rtol=0.0, atol=1e-12)
            assert np.allclose(column[3:], 0.0 if axis.slides else axis.direction, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("tilt", [2e-9, 1e-6, 4e-5])
def test_a_small_tilt_is_not_along(tilt):
    assert axes.is_along(axes.screw_x(0.2, 0.0) @ axes.screw_z(0.3, 0.1))
    assert axes.is_along(axes.screw_x(0.2, math.pi))
    assert not axes.is_along(axes.screw_x(0.0, tilt))
    assert not axes.is_along(axes.screw_z(1.0, 0.0) @ axes.screw_x(0.0, math.pi - tilt))
