"""Tolerances of position and rotation, and targets with few digits."""

from __future__ import annotations

import numpy as np
import pytest

import kin
from kin import IKOptions, InputError, Status, solve_ik

EXACT = (1e-9, 1e-9)


def poses(robot, count, seed=0):
    q = robot.random_q(np.random.default_rng(seed), count)
    return q, kin.fk(robot, q)


@pytest.mark.parametrize("name", ["pioneer5", "ur5", "iiwa14", "scara"])
@pytest.mark.parametrize("digits", [4, 5, 6, "float32"])
def test_a_target_of_few_digits_is_met_within_its_precision(name, digits):
    robot = kin.get_robot(name)
    for q, T in zip(*poses(robot, 12), strict=True):
        rounded = T.astype(np.float32) if digits == "float32" else T.round(digits)
        result = solve_ik(robot, rounded, q_seed=q)
        assert result.status is Status.SOLVED, (digits, result.reason)
        assert min(np.abs(s.q - q).max() for s in result.solutions) < 0.05
        position, rotation = result.tolerances
        assert all(s.position_error <= position and s.rotation_error <= rotation for s in result.solutions)
        lists = solve_ik(robot, rounded.tolist(), q_seed=q)
        assert lists.status is Status.SOLVED or digits == "float32"


def test_the_answer_says_that_the_target_was_mended():
    robot = kin.get_robot("ur5")
    T = poses(robot, 1)[1][0].round(4)
    result = solve_ik(robot, T)
    assert 1e-6 < result.target_error < 1e-3
    assert result.tolerances[0] == 2.0 * result.target_error
    assert "The target is rounded" in result.reason
    assert result.best.position_error < 1e-9  # six joints meet the mended target exactly
    clean = solve_ik(robot, poses(robot, 1)[1][0])
    assert (clean.target_error, clean.tolerances) == (0.0, EXACT)
    assert "rounded" not in clean.reason


def test_what_is_no_rotation_is_refused():
    robot = kin.get_robot("ur5")
    T = poses(robot, 1)[1][0]
    scaled, mirrored, last = T.copy(), T.copy(), T.copy()
    scaled[:3, :3] *= 1.01
    mirrored[:3, 0] *= -1.0
    last[3, 0] = 0.1
    for bad in (scaled, mirrored, last, np.full((4, 4), np.nan), np.eye(3)):
        with pytest.raises(InputError, match="target"):
            solve_ik(robot, bad)
    assert solve_ik(robot, T.round(3)).status is Status.SOLVED


def test_a_tolerance_that_is_asked_for():
    robot = kin.get_robot("pioneer5")
    q, T = (x[0] for x in poses(robot, 1))
    turned = T.copy()
    c, s = np.cos(1e-3), np.sin(1e-3)
    turned[:3, :3] = T[:3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    assert solve_ik(robot, turned, q_seed=q).status is Status.APPROXIMATE
    result = solve_ik(robot, turned, q_seed=q, rotation_tolerance=2e-3)
    assert result.status is Status.SOLVED
    assert result.tolerances == (1e-9, 2e-3)
    assert result.best.rotation_error == pytest.approx(1e-3, abs=1e-6)
    assert solve_ik(robot, turned, q_seed=q, rotation_tolerance=5e-4).status is Status.APPROXIMATE
    numeric = solve_ik(robot, turned, q_seed=q, rotation_tolerance=2e-3, position_tolerance=1e-3, solver="numeric")
    assert numeric.status is Status.SOLVED


def test_a_point_just_out_of_reach():
    robot = kin.get_robot("ur5")
    far = kin.fk(robot, np.zeros(6))
    out = far[:3, 3] / np.linalg.norm(far[:3, 3])
    point = far[:3, 3] + 0.3 * out
    reach = point - out * solve_ik(robot, point, task="position").distance
    options = {"task": "position", "q_seed": np.zeros(6)}
    assert solve_ik(robot, reach + 1e-4 * out, **options).status is Status.UNREACHABLE
    assert solve_ik(robot, reach + 1e-4 * out, position_tolerance=1e-3, **options).status is Status.SOLVED


def test_tolerances_are_checked():
    for field in ("position_tolerance", "rotation_tolerance"):
        for value in (0.0, -1.0, 1e-12, 10.0, float("nan"), "small", True):
            with pytest.raises(InputError, match=field):
                IKOptions(**{field: value})
    assert IKOptions(position_tolerance=1e-6) != IKOptions()


@pytest.mark.parametrize("stretch", [1.0, 1.001])
@pytest.mark.parametrize("last", [(0, 0, 0, 1.005), (1e-5, 0, 0, 1)])
def test_the_last_row_of_a_target_is_checked_whatever_its_rotation(stretch, last):
    T = kin.fk(kin.get_robot("ur5"), np.zeros(6))
    T[:3, :3] *= stretch
    T[3] = last
    with pytest.raises(kin.InputError, match=r"target\[3\]"):
        kin.solve_ik(kin.get_robot("ur5"), T)


# -- paths -------------------------------------------------------------------------------------------------------


def straight(robot, count=9):
    q = np.linspace(robot.q_home, robot.clip(robot.q_home + 0.2), count)
    return kin.fk(robot, q)


@pytest.mark.parametrize("name", ["pioneer5", "ur5", "scara"])
@pytest.mark.parametrize("digits", [4, "float32"])
def test_a_path_of_rounded_targets_has_no_gaps(name, digits):
    robot = kin.get_robot(name)
    line = straight(robot)
    rounded = line.astype(np.float32) if digits == "float32" else line.round(digits)
    path = kin.solve_path(robot, rounded, q_start=robot.q_home)
    assert (path.gaps, path.jumps) == ((), ())
    assert (path.position_error <= path.tolerances[0]).all()
    assert (path.rotation_error <= path.tolerances[1]).all()
    if digits == 4:
        assert 1e-6 < path.target_error <= 1e-3
        assert "Targets are rounded" in path.reason
    exact = kin.solve_path(robot, line, q_start=robot.q_home)
    assert (exact.target_error, exact.tolerances) == (0.0, EXACT)
    assert "rounded" not in exact.reason


def test_a_path_meets_its_targets_within_the_tolerances_that_were_requested():
    robot = kin.get_robot("pioneer5")
    line = straight(robot)
    c, s = np.cos(1e-4), np.sin(1e-4)
    line[3, :3, :3] = line[3, :3, :3] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    line[3, :3, 3] += 1e-5
    strict = kin.solve_path(robot, line, q_start=robot.q_home)
    assert [gap.index for gap in strict.gaps] == [3]
    loose = kin.solve_path(robot, line, q_start=robot.q_home, position_tolerance=1e-3, rotation_tolerance=1e-2)
    assert loose.gaps == ()
    assert loose.tolerances == (1e-3, 1e-2)
    assert loose.rotation_error[3] > 1e-9
    with pytest.raises(InputError, match="position_tolerance"):
        kin.solve_path(robot, line, position_tolerance=0.0)
