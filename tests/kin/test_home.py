"""Homes of files that name none: inside the limits, off the singularities, the same every time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin.home import candidates, default_home, margins
from kin.robot import Joint, Robot

HEAD = 'id = "x"\nname = "x"\nsource = "x"\nconvention = "standard"\nunits = { length = "m", angle = "deg" }\n'


@pytest.mark.parametrize("robot_id", kin.builtin_robots())
def test_every_arm_gets_a_pose_it_can_move_from(robot_id):
    robot = kin.get_robot(robot_id)
    home = np.array(default_home(robot))
    assert robot.in_limits(home)
    margin = margins(robot, np.vstack([home, candidates(robot)[0]]))
    assert margin[0] >= 0.5 * margin.max() > 0.0
    assert tuple(home.tolist()) == default_home(replace(robot))


def test_a_middle_that_is_good_is_kept():
    text = HEAD + "[[rows]]\na = 1\nlimits = [0, 90]\n[[rows]]\na = 1\nlimits = [30, 150]\n"
    assert kin.parse_robot(text).home == pytest.approx((math.pi / 4, math.pi / 2))


def test_a_stretched_middle_is_bent_upward():
    """Two links in a vertical plane: at zero they are one line; of the bent poses the highest is taken."""
    text = HEAD + "[[rows]]\nalpha = 90\n[[rows]]\na = 1\n[[rows]]\na = 1\n"
    robot = kin.parse_robot(text)
    assert robot.home == pytest.approx((0.0, 0.0, math.pi / 4))
    assert kin.fk(robot, robot.home)[2, 3] > 0.5
    assert all(joint.limits == (-math.pi, math.pi) for joint in robot.joints)


def test_slides_start_half_way():
    text = HEAD + '[[rows]]\nkind = "prismatic"\nalpha = 90\n[[rows]]\nkind = "prismatic"\nlimits = [1, 2]\n'
    assert kin.parse_robot(text).home == (0.5, 1.5)


def test_a_home_that_is_given_is_taken():
    text = HEAD + "[[rows]]\na = 1\n[[rows]]\na = 1\n[home]\nq = [0, 0]\n"
    assert kin.parse_robot(text).home == (0.0, 0.0)


rows = st.lists(
    st.tuples(
        st.floats(-1, 1),
        st.floats(-1, 1),
        st.floats(-math.pi, math.pi),
        st.sampled_from(["revolute", "prismatic"]),
    ),
    min_size=1,
    max_size=8,
)


@given(rows=rows, unlimited=st.booleans())
def test_any_chain_has_a_home(rows, unlimited):
    """Also one whose joints move nothing, or without stops."""
    limits = None if unlimited else (-2.0, 1.0)
    joints = tuple(Joint(f"{i}", 0.0, d, a, alpha, kind, limits) for i, (d, a, alpha, kind) in enumerate(rows))
    robot = Robot("x", "x", "x", "standard", joints, (0.0,) * len(joints))
    home = np.array(default_home(robot))
    assert robot.in_limits(home)
    assert np.isfinite(home).all()


def test_many_joints_do_not_make_many_candidates():
    joints = tuple(Joint(f"{i}", a=0.1, alpha=0.5 * (-1) ** i, limits=(-1.0, 1.0)) for i in range(32))
    robot = Robot("x", "x", "x", "standard", joints, (0.0,) * 32)
    assert len(candidates(robot)[0]) < 1000
    assert len(default_home(robot)) == 32
