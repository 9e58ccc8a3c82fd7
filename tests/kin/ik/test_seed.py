"""A seed that meets the target is a solution, at distance 0: where branches merge, on curves, and at limits.

Formulas miss such configurations by the root of the rounding error, or take them to be outside the limits. The
configurations are those where that happens: every joint at a multiple of 45° or at a limit.
"""

import numpy as np
import pytest

import kin
from kin.ik.options import IKOptions
from kin.ik.table import Table
from tests.kin.solvers.few import arm

PI = np.pi
PLANAR4 = arm("planar4", *[(0.0, 0.0, 0.3, 0.0)] * 4)
# One arm of each family, and the arms on which formulas miss most.
FEW = (
    "pioneer5",
    "redundant7",
    "iiwa14",
    "panda",
    "planar3r",
    "stanford",
    "ur5",
    "crx10ia",
    "gen3",
    "so101",
    "rpp",
)


def on_grid(robot, seed, count):
    """Configurations ``(count, n)`` of multiples of 45°, of fifths of a slide, and of limits."""
    rng, q = np.random.default_rng(seed), np.empty((count, robot.n))
    for i, (low, high) in enumerate(zip(robot.lower, robot.upper, strict=True)):
        steps = np.arange(-16, 17) * PI / 4 if robot.revolute[i] else np.linspace(low, high, 5)
        steps = np.append(steps, (low, high))
        q[:, i] = rng.choice(steps[(steps >= low) & (steps <= high) & np.isfinite(steps)], count)
    return q


def check_seeds(name, count):
    """Every configuration on the grid is the answer to its own pose."""
    robot = kin.get_robot(name)
    q = on_grid(robot, 1, count)
    T = kin.fk(robot, q)
    for seed, target in zip(q, T, strict=True):
        best = kin.solve_ik(robot, target, q_seed=seed).best
        assert best.distance == 0.0, seed
        assert best.in_limits
        assert best.compromise is None
        np.testing.assert_array_equal(best.q, seed)
    np.testing.assert_array_equal(kin.solve_ik_many(robot, T, q_seed=q).q, q)


@pytest.mark.parametrize("name", FEW)
def test_a_seed_that_meets_the_target_is_the_answer(name):
    check_seeds(name, 24)


@pytest.mark.slow
@pytest.mark.parametrize("name", kin.builtin_robots())
def test_every_seed_on_a_grid_of_45_degrees_is_the_answer(name):
    check_seeds(name, 2000)


@pytest.mark.parametrize(
    ("name", "q"),
    [
        ("ur5", [0.0] * 6),
        ("ur5e", [-PI / 2, 0.392196, 2 * PI, 2 * PI, -PI, PI / 2]),
        ("panda", [2, 0, -PI / 4, -PI / 2, -PI / 2, 0, -PI / 2]),
        # Two curves cross here, and a later row stands for the other one.
        ("ur5", [0, 2 * PI, -PI / 4, -PI, -PI, 2 * PI]),
    ],
)
def test_seeds_at_folds_and_on_curves(name, q):
    result = kin.solve_ik(name, kin.fk(name, q), q_seed=q)
    assert result.best.distance == 0.0
    for found in result.redundancy:  # the seed's value is one of those that are said to be feasible
        turns = [found.value + 2 * PI * k for k in (-1, 0, 1)]
        assert any(low - 1e-9 <= x <= high + 1e-9 for low, high in found.intervals for x in turns)


def test_an_answer_that_has_only_the_seed_of_a_posture_is_not_complete():
    # The elimination finds sixteen solutions of this pose, none of them beside the seed.
    q = [PI / 4, -PI / 4, 0, 0, 3 * PI / 4, 5 * PI / 4]
    result = kin.solve_ik("crx10ia", kin.fk("crx10ia", q), q_seed=q)
    assert result.best.distance == 0.0
    assert not result.complete


@pytest.mark.parametrize("task", ["approach", "position"])
def test_the_seed_is_the_answer_of_any_task(task):
    robot = kin.get_robot("pioneer5")
    for q in on_grid(robot, 2, 10):
        assert kin.solve_ik(robot, kin.fk(robot, q), q_seed=q, task=task).best.distance == 0.0


def test_a_requested_redundancy_value_a_branch_or_a_limit_is_not_given_up_for_the_seed():
    robot = kin.get_robot("panda")
    q = robot.q_home
    T = kin.fk(robot, q)
    assert kin.solve_ik(robot, T, q_seed=q).best.distance == 0.0
    assert kin.solve_ik(robot, T, q_seed=q, redundancy=q[6] + 0.3).best.q[6] == pytest.approx(q[6] + 0.3)
    other = next(name for name in kin.branch_names(robot) if name != kin.branch_of(robot, q))
    assert all(s.branch == other for s in kin.solve_ik(robot, T, q_seed=q, branch=other).solutions)
    narrow = [None] * 6 + [(q[6] + 0.1, q[6] + 0.5)]
    assert kin.solve_ik(robot, T, q_seed=q, limits=narrow).best.q[6] >= q[6] + 0.1


def test_a_seed_beside_the_target_is_not_the_answer():
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.q_home)
    T[0, 3] += 1e-8
    best = kin.solve_ik(robot, T, q_seed=robot.q_home, position_tolerance=1e-3).best
    assert 0.0 < best.distance < 1e-6
    assert best.position_error < 1e-12


def test_tables_leave_such_targets_to_results():
    robot = kin.get_robot("ur5")
    q = on_grid(robot, 3, 8)
    T = kin.fk(robot, q)
    table = Table.of(robot, T, IKOptions(), q)
    assert (table.kinds == -1).all()
    assert all(table.result(i).best.distance == 0.0 for i in range(8))


@pytest.mark.parametrize(
    ("robot", "task", "q"),
    [
        (PLANAR4, "pose", [0.8, -5e-4, -1.8, -0.4]),  # nearly straight: the value is at an end
        (kin.get_robot("scara"), "position", [0.4, -3e-4, 0.1, 1.0]),
        (kin.get_robot("so100"), "position", [0.3, 0.4, -0.2, 0.5, 0.2]),
    ],
    ids=["planar4", "scara", "so100"],
)
def test_the_redundancy_value_of_a_seed_is_its_own(robot, task, q):
    T = kin.fk(robot, q)
    said = kin.solve_ik(robot, T, q_seed=q, task=task).best
    assert said.distance == 0.0
    values = {each.name: each.value for each in said.redundancy}
    again = kin.solve_ik(robot, T, task=task, redundancy=values)
    assert min(np.abs(each.q - q).max() for each in again.solutions) < 1e-8
