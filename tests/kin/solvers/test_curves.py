"""Targets that a whole curve of configurations meets: one solution for each, and all isolated ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_completeness import CRX, DOOSAN, apart, typed
from test_rounded import UR5, rounded

import kin
from kin import Status
from kin.solvers.curves import curve_through

PI = math.pi
PUMA, IRB = kin.get_robot("puma560"), kin.get_robot("irb120")
# At θ5 = 0 joints 4 and 6 turn about one line, also where their axes were typed alike.
WRISTS = (PUMA, IRB, DOOSAN, typed(DOOSAN, 3), rounded(PUMA, 1.5708), rounded(IRB, 1.5708))


def is_curve(robot, T, curve):
    """Steps along the direction, each corrected by Newton's method, keep the tool where it is."""
    q, step = np.array(curve.q), 0.01 * np.array(curve.direction)
    far = q.copy()
    for _ in range(30):
        far = far + step
        for _ in range(4):
            at = kin.fk(robot, far)
            turn = 0.5 * np.cross(at[:3, :3], T[:3, :3], axis=0).sum(axis=1)
            J = kin.jacobian(robot, far)
            far = far + np.linalg.pinv(J, rcond=1e-4) @ np.concatenate([T[:3, 3] - at[:3, 3], turn])
    return np.abs(kin.fk(robot, far) - T).max() < 1e-11 and apart(far, q) > 0.1


@pytest.mark.parametrize("robot", WRISTS, ids=lambda robot: robot.id)
def test_a_singular_wrist_has_one_curve_and_six_isolated_configurations(robot):
    for q in np.random.default_rng(0).uniform(-3, 3, (3, 6)):
        q[4] = 0.0
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T, q_seed=q, respect_limits=False)
        (curve,) = result.details.curves
        assert (result.status, result.details.infinite, len(result.solutions)) == (Status.SOLVED, True, 7)
        assert "infinitely many configurations for this pose, on one curve, and 6 isolated ones" in result.reason
        assert result.completeness != "proved"
        assert any(np.array_equal(curve.q, solution.q) for solution in result.solutions)
        assert np.abs(kin.jacobian(robot, curve.q) @ curve.direction).max() < 1e-6
        assert is_curve(robot, T, curve)
        isolated = [s.q for s in result.solutions if not np.array_equal(curve.q, s.q)]
        assert all(abs(math.sin(s[4])) > 1e-6 for s in isolated)


@pytest.mark.parametrize("robot", [*WRISTS[:4], UR5, CRX], ids=lambda robot: robot.id)
def test_other_targets_have_none(robot):
    for q in np.random.default_rng(1).uniform(-3, 3, (10, 6)):
        result = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q, respect_limits=False)
        assert not result.details.curves
        assert not result.details.infinite
        assert "infinitely" not in result.reason


def test_a_double_solution_is_no_curve():
    q = np.array([0.3, -0.8, 0.0, 0.4, 0.9, 0.2])  # straight elbow
    T = kin.fk(UR5, q)
    assert curve_through(UR5, T, 0, np.arange(6), q) is None
    assert not kin.solve_ik(UR5, T, q_seed=q, respect_limits=False).details.curves


def test_a_folded_arm_with_an_offset_wrist():
    """Upper arm and forearm of one length, folded: the wrist is on the shoulder, and the arm turns about it."""
    q = np.array([0.3, -0.7, -PI / 2, 0.4, 1.1, -0.2])
    T = kin.fk(CRX, q)
    result = kin.solve_ik(CRX, T, q_seed=q)
    assert result.details.infinite
    assert all(is_curve(CRX, T, curve) for curve in result.details.curves)
    on = [curve.q for curve in result.details.curves]
    assert len(on) == 2
    assert apart(result.solutions[0].q, q) < 1e-6


def test_limits_that_leave_one_point_of_a_curve_leave_no_motion():
    q = PUMA.random_q(np.random.default_rng(0), 1)[0]
    q[4] = 0.0
    T = kin.fk(PUMA, q)
    free = kin.solve_ik(PUMA, T, q_seed=q)
    held = kin.solve_ik(PUMA, T, q_seed=q, locked=[None] * 3 + [q[3]] + [None] * 2)
    assert free.details.curves
    assert not held.details.curves
    assert apart(held.solutions[0].q, q) < 1e-6


def test_the_seven_joints_of_a_locked_arm_can_have_a_curve():
    robot, q = kin.get_robot("iiwa14"), np.array([0.3, 0.6, 0.0, -0.9, 0.4, 0.0, 0.2])
    T = kin.fk(robot, q)
    result = kin.solve_ik(robot, T, q_seed=q, locked=[None, None, 0.0, None, None, None, None])
    assert result.details.curves
    assert all(curve.direction[2] == 0.0 and is_curve(robot, T, curve) for curve in result.details.curves)
