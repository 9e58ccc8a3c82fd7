"""The first solution is the configuration nearest to the seed, of all values of the redundancy parameter.

Against scans of that parameter, which share no search with the solvers: all branches at many values, at their
nearest whole turns inside the limits.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kin
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE

TURN = 2.0 * math.pi
LIMIT = 1e-9
ANY = ("gen3", "baxter", "sawyer")  # solved at values of their last joint
SEVEN = ("redundant7", "redundant7-craig", "iiwa14", "iiwa7", "panda", "fr3", "xarm7")


def at_images(robot, q, seed):
    """Configurations ``(k, 7)`` at the whole turns inside the limits that are nearest to the seed."""
    q = q - TURN * np.round((q - seed) / TURN)
    with np.errstate(invalid="ignore"):  # of limits that are infinite
        q = np.where(q > robot.upper + LIMIT, q - TURN * np.ceil((q - robot.upper - LIMIT) / TURN), q)
        q = np.where(q < robot.lower - LIMIT, q + TURN * np.ceil((robot.lower - LIMIT - q) / TURN), q)
    return q[((q >= robot.lower - LIMIT) & (q <= robot.upper + LIMIT)).all(axis=1)]


def least_distance(robot, T, seed, count):
    """The distance of the nearest of the configurations at `count` values of the redundancy parameter."""
    form = closed_form_of(robot)
    joint = form.redundancies(POSE)[0].joint
    low, high = (-math.pi, math.pi) if joint < 0 else (robot.lower[joint], robot.upper[joint])
    if not math.isfinite(high - low):
        low, high = seed[joint] - math.pi, seed[joint] + math.pi
    values = np.linspace(low, high, count)
    rows = np.empty((count, len(form.branches), 7))
    targets = np.ascontiguousarray(np.broadcast_to(T, (count, 4, 4)))
    form.kernels.many(form.kernels.params, targets, values, seed, rows)
    q = rows.reshape(-1, 7)
    found = at_images(robot, q[~np.isnan(q[:, 0])], seed)
    return float(np.linalg.norm(found - seed, axis=1).min(initial=math.inf))


def cases(robot, count):
    """Targets, and seeds: one third each home, near a configuration that meets the target, anywhere."""
    rng = np.random.default_rng(0)
    q, seeds = robot.random_q(rng, count), robot.random_q(rng, count)
    seeds[::3] = robot.q_home
    near = q[1::3] + rng.normal(0.0, 0.5, q[1::3].shape)
    seeds[1::3] = robot.clip(near)
    return kin.fk(robot, q), seeds


def check_nearest(name, targets, values):
    robot = kin.get_robot(name)
    T, seeds = cases(robot, targets)
    for target, seed in zip(T, seeds, strict=True):
        best = kin.solve_ik(robot, target, q_seed=seed).best
        assert best.distance <= least_distance(robot, target, seed, values) + 1e-3
        assert best.distance == pytest.approx(np.linalg.norm(best.q - seed))
        assert best.position_error < 1e-9
        assert best.rotation_error < 1e-9
        assert best.in_limits


@pytest.mark.parametrize("name", ANY)
def test_the_nearest_solution_of_any_seven_joints_is_found(name):
    check_nearest(name, 4, 100)


@pytest.mark.slow
@pytest.mark.parametrize("name", ANY)
def test_of_many_targets_of_any_seven_joints_hardly_one_has_a_nearer_solution(name):
    """A search: an interval narrower than a sample may be missed."""
    robot, missed = kin.get_robot(name), 0
    for target, seed in zip(*cases(robot, 200), strict=True):
        best = kin.solve_ik(robot, target, q_seed=seed).best
        missed += best.distance > least_distance(robot, target, seed, 400) + 1e-3
    assert missed <= 4


@pytest.mark.parametrize("name", SEVEN)
def test_no_configuration_is_nearer(name):
    check_nearest(name, 6, 300)


@pytest.mark.slow
@pytest.mark.parametrize("name", SEVEN)
def test_no_configuration_of_a_dense_scan_is_nearer(name):
    check_nearest(name, 200, 2000)


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_many_targets_get_the_nearest_configurations(name):
    robot = kin.get_robot(name)
    T, seeds = cases(robot, 12)
    many = kin.solve_ik_many(robot, T, q_seed=seeds)
    each = [kin.solve_ik(robot, target, q_seed=seed).best.q for target, seed in zip(T, seeds, strict=True)]
    np.testing.assert_allclose(many.q, each, atol=1e-12)


@pytest.mark.parametrize("name", ["iiwa14", "panda"])
def test_a_seed_beside_a_singularity_is_kept(name):
    """Where joints turn far while the tool barely moves, the nearest configuration is in a narrow dip."""
    robot = kin.get_robot(name)
    rng = np.random.default_rng(5)
    for _ in range(12):
        q = robot.random_q(rng, 1)[0]
        q[[1, 5]] = robot.clip(np.full(7, 1e-3))[[1, 5]]
        T = kin.fk(robot, q)
        seed = robot.clip(q + rng.normal(0.0, 1e-3, 7))
        assert kin.solve_ik(robot, T, q_seed=seed).best.distance <= np.linalg.norm(q - seed) + 1e-9


def typed(name):
    """The arm with right angles of four decimals in its table: its rows are moved onto it from the exact arm."""
    robot = kin.get_robot(name)
    rows = tuple(replace(row, alpha=round(row.alpha, 4), theta=round(row.theta, 4)) for row in robot.rows)
    return replace(robot, id=f"{name}-typed", rows=rows)


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_a_rounded_table_has_the_nearest_configuration_of_all_values(name):
    robot, table = kin.get_robot(name), typed(name)
    for target, seed in zip(*cases(robot, 6), strict=True):
        exact = kin.solve_ik(robot, target, q_seed=seed).best
        assert kin.solve_ik(table, target, q_seed=seed).best.distance <= exact.distance + 2e-2


@pytest.mark.parametrize("name", ["iiwa14", "redundant7-craig"])
def test_the_redundancy_value_of_a_seed_that_meets_the_target_is_its_own(name):
    """Also at folds, where the row that the seed replaces has another one."""
    robot = kin.get_robot(name)
    rng = np.random.default_rng(1)
    steps = np.pi / 4 * np.arange(-4, 5)
    for _ in range(40):
        q = robot.clip(rng.choice(steps, 7))
        if abs(math.sin(q[3])) < 0.1:
            continue  # a straight arm has no side for its elbow
        best = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q).best
        (psi,) = best.redundancy
        elbow = kin.link_frames(robot, q)[3, :3, 3]
        found = kin.solve_ik(
            robot, kin.fk(robot, q), q_seed=q, redundancy={"psi": psi.value}, respect_limits=False
        )
        others = [kin.link_frames(robot, s.q)[3, :3, 3] for s in found.solutions]
        assert min(np.linalg.norm(other - elbow) for other in others) < 1e-8
