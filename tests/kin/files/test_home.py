"""Default home configurations: inside the limits, away from singularities, reproducible."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from kin.files.home import candidates, default_home, margins
from kin.robot import Joint, Robot

HEAD = 'id = "x"\nname = "x"\nsource = "x"\nconvention = "standard"\nunits = { length = "m", angle = "deg" }\n'


@pytest.mark.parametrize("robot_id", kin.files.classic_robots())
def test_the_default_home_of_every_arm_is_not_singular(robot_id):
    robot = kin.get_robot(robot_id)
    home = np.array(default_home(robot))
    assert robot.in_limits(home)
    margin = margins(robot, np.vstack([home, candidates(robot)[0]]))
    assert margin[0] >= 0.5 * margin.max() > 0.0
    assert tuple(home.tolist()) == default_home(replace(robot))


def test_the_middle_of_the_limits_is_preferred():
    text = HEAD + "[[rows]]\na = 1\nlimits = [0, 90]\n[[rows]]\na = 1\nlimits = [30, 150]\n"
    assert kin.load_robot(text).home == pytest.approx((math.pi / 4, math.pi / 2))


def test_a_stretched_arm_is_bent_upward():
    """Two links in a vertical plane: collinear at zero; the highest bent pose is chosen."""
    text = HEAD + "[[rows]]\nalpha = 90\n[[rows]]\na = 1\n[[rows]]\na = 1\n"
    robot = kin.load_robot(text)
    assert robot.home == pytest.approx((0.0, 0.0, math.pi / 4))
    assert kin.fk(robot, robot.home)[2, 3] > 0.5
    assert all(joint.limits == (-math.pi, math.pi) for joint in robot.joints)


def test_prismatic_joints_start_in_the_middle():
    text = HEAD + '[[rows]]\nkind = "prismatic"\nalpha = 90\n[[rows]]\nkind = "prismatic"\nlimits = [1, 2]\n'
    assert kin.load_robot(text).home == (0.5, 1.5)


def test_an_explicit_home_is_used():
    text = HEAD + "[[rows]]\na = 1\n[[rows]]\na = 1\n[home]\nq = [0, 0]\n"
    assert kin.load_robot(text).home == (0.0, 0.0)


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
    """Also arms whose joints move no point or have no limits."""
    limits = None if unlimited else (-2.0, 1.0)
    joints = tuple(Joint(f"{i}", 0.0, d, a, alpha, kind, limits) for i, (d, a, alpha, kind) in enumerate(rows))
    robot = Robot("x", "x", "x", "standard", joints, (0.0,) * len(joints))
    home = np.array(default_home(robot))
    assert robot.in_limits(home)
    assert np.isfinite(home).all()


def test_the_number_of_candidates_is_bounded():
    joints = tuple(Joint(f"{i}", a=0.1, alpha=0.5 * (-1) ** i, limits=(-1.0, 1.0)) for i in range(32))
    robot = Robot("x", "x", "x", "standard", joints, (0.0,) * 32)
    assert len(candidates(robot)[0]) < 1000
    assert len(default_home(robot)) == 32
