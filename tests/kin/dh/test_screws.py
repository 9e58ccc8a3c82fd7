"""Arms as products of exponentials."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from arms import Draw
from hypothesis import given, settings
from hypothesis import strategies as st

import kin
from kin import InputError
from kin.axes import inverse


def exponential(S, value):
    """exp([S] value) by its series: independent of Rodrigues' formula and of DH rows."""
    w, v = S[:3], S[3:]
    A = np.zeros((4, 4))
    A[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
    A[:3, 3] = v
    T, term = np.eye(4), np.eye(4)
    for k in range(1, 40):
        term = term @ A * (value / k)
        T = T + term
    return T


def product(S, M, q):
    T = np.eye(4)
    for column, value in zip(S.T, q, strict=True):
        T = T @ exponential(column, value)
    return T @ M


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_the_formula_is_the_arm_and_comes_back(robot):
    rng = np.random.default_rng(1)
    S, M = kin.dh.screws(robot)
    for q in robot.random_q(rng, 4):
        assert np.allclose(product(S, M, q), kin.fk(robot, q), atol=1e-13)
    zero = robot.random_q(rng)
    there = kin.dh.screws(robot, zero)
    assert np.allclose(product(*there, robot.q_home - zero), kin.fk(robot, robot.q_home), atol=1e-13)
    limits = [joint.limits for joint in robot.joints]
    for convention in ("standard", "modified"):
        back = kin.dh.robot_from_screws(S, M, limits=limits, home=robot.home, convention=convention)
        assert back.convention == convention
        assert [j.kind for j in back.joints] == [j.kind for j in robot.joints]
        assert (back.lower.tolist(), back.home) == (robot.lower.tolist(), robot.home)
        q = robot.random_q(rng, 100)
        assert np.abs(kin.fk(back, q) - kin.fk(robot, q)).max() < 1e-13
        again = kin.dh.screws(back)
        assert max(np.abs(again.S - S).max(), np.abs(again.M - M).max()) < 1e-13


@pytest.mark.parametrize("robot", kin.files.classic_robots().values(), ids=lambda robot: robot.id)
def test_space_and_body_form_are_forward_kinematics(robot):
    rng = np.random.default_rng(2)
    q = robot.random_q(rng, 20)
    T = kin.fk(robot, q)
    for zero in (np.zeros(robot.n), robot.q_home):
        found = kin.dh.screws(robot, zero)
        assert np.abs(found.pose(q - zero) - T).max() < 1e-12
        body = np.broadcast_to(found.M, T.shape)
        for i, B in enumerate(found.B.T):
            body = body @ kin.dh.exp_screw(B, q[:, i] - zero[i])
        assert np.abs(body - T).max() < 1e-12
        J = kin.jacobian(robot, zero, frame="tool")
        assert np.abs(found.B - np.concatenate([J[3:], J[:3]])).max() < 1e-12, "at zero: the body Jacobian"


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6), st.floats(-2, 2))
def test_a_screw_with_any_pitch_and_speed(S, value):
    S = np.array(S)
    if 0.0 < np.linalg.norm(S[:3]) < 1e-3:  # the axis is then kilometres away
        S[:3] = 0.0
    assert np.abs(kin.dh.exp_screw(S, value) - exponential(S, value)).max() < 1e-6
    one = kin.dh.exp_screw(S, value / 2)
    assert np.abs(one @ one - kin.dh.exp_screw(S, value)).max() < 1e-6
    assert kin.dh.exp_screw(S, [[0.0, value]]).shape == (1, 2, 4, 4)


def test_a_screw_is_six_numbers():
    for S in (np.zeros(5), np.zeros((2, 6)), [0, 0, np.nan, 0, 0, 0]):
        with pytest.raises(InputError):
            kin.dh.exp_screw(S, 1.0)
    with pytest.raises(InputError, match="q"):
        kin.dh.screws("ur5").pose(np.zeros(5))


def random_screws(seed):
    draw = Draw(seed)
    columns = []
    for _ in range(int(draw.rng.integers(1, 8))):
        direction = draw.rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        if draw.rng.random() < 0.25:
            columns.append([0, 0, 0, *direction])
        else:
            columns.append([*direction, *np.cross(draw.rng.normal(size=3), direction)])
    return np.array(columns).T, np.array(draw.pose())


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_any_screws_become_an_arm_with_these_screws(seed):
    S, M = random_screws(seed)
    arm = kin.dh.robot_from_screws(S, M)
    found = kin.dh.screws(arm)
    assert np.abs(found.S - S).max() < 1e-11
    assert np.abs(found.M - M).max() < 1e-11
    q = arm.random_q(np.random.default_rng(0))
    assert np.allclose(product(S, M, q), kin.fk(arm, q), atol=1e-11)
    assert kin.robot_from_dict(kin.robot_to_dict(arm)) == arm


def test_a_moved_base_moves_the_screws():
    ur5 = kin.get_robot("ur5")
    T = np.array(Draw(3).pose())
    S, M = kin.dh.screws(ur5)
    moved = kin.dh.screws(ur5.with_base(T))
    assert np.allclose(moved.M, T @ M)
    for one, other in zip(S.T, moved.S.T, strict=True):
        assert np.allclose(exponential(other, 0.4), T @ exponential(one, 0.4) @ inverse(T), atol=1e-13)


UNIT = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]]).T


@pytest.mark.parametrize(
    ("S", "more", "field"),
    [
        (UNIT * [2, 1], {}, r"S\[:, 0\]"),
        (UNIT * [1, 0], {}, r"S\[:, 1\]"),
        (UNIT + np.outer([0, 0, 0, 0, 0, 0.1], [1, 0]), {}, "pitch"),
        (UNIT[:5], {}, r"^S: got 'shape \(5, 2\)'"),
        (UNIT[:, 0], {}, "^S: got"),
        (UNIT[:, :0], {}, "^S: got"),
        (UNIT * np.nan, {}, "finite"),
        (UNIT, {"limits": [None]}, "^limits: "),
        (UNIT, {"limits": 3}, "^limits: got 3, expected 2 values"),
        (UNIT, {"limits": [3, None]}, "limits"),
        (UNIT, {"names": ["one"]}, "^names: "),
        (UNIT, {"names": "ab"}, "^names: got 'ab', expected 2 values"),
        (UNIT, {"names": itertools.count()}, "^names: "),
        (UNIT, {"home": [0.0]}, "^home: "),
        (UNIT, {"convention": "craig"}, "^convention: "),
        (UNIT, {"M": np.diag([1.0, 1.0, -1.0, 1.0])}, "^M rotation: "),
    ],
)
def test_what_is_no_product_of_exponentials_is_refused(S, more, field):
    with pytest.raises(InputError, match=field):
        kin.dh.robot_from_screws(S, more.pop("M", np.eye(4)), **more)


def test_names_and_limits_may_come_one_by_one():
    arm = kin.dh.robot_from_screws(
        UNIT, np.eye(4), names=(n for n in "ab"), limits=((-1.0, x) for x in (2.0, 3.0))
    )
    assert [(j.name, j.limits) for j in arm.joints] == [("a", (-1.0, 2.0)), ("b", (-1.0, 3.0))]


def test_screws_are_those_of_one_configuration():
    with pytest.raises(InputError, match=r"^q: "):
        kin.dh.screws("ur5", np.zeros((2, 6)))
