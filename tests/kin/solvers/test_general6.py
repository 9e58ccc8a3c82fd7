"""All real solutions of arms with six revolute joints that fit no family."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import nested, reversed_at

import kin
from kin import InputError, Joint, Robot, Status
from kin.solvers import closed_form_of, general6
from kin.solvers.general6.batch import PROVED, SOLUTIONS, misfit_of_degree, solve_all
from kin.solvers.general6.cuts import SHIFT, SIZE, cuts_of
from kin.solvers.reduced import fixed

PI = math.pi
NO_LIMITS = (-PI, PI)


def arm(name: str, *rows: tuple[float, float, float, float]) -> Robot:
    """Six revolute joints from rows (θ, d, a, α) of a standard table."""
    joints = tuple(Joint(f"joint {i + 1}", *row, limits=NO_LIMITS) for i, row in enumerate(rows))
    return Robot(name, name, "test", "standard", joints, (0.1, 0.2, -0.3, 0.4, 0.5, 0.6))


# Lengths as the makers publish them, or round numbers where "like" is said.
JACO = arm(
    "jaco",
    (0, 0.2755, 0, PI / 2),
    (0, 0, 0.41, PI),
    (0, -0.0098, 0, PI / 2),
    (0, -0.25008, 0, PI / 3),
    (0, -0.08556, 0, PI / 3),
    (0, -0.20278, 0, PI),
)
CRX = arm(
    "crx-like",
    (0, 0, 0, -PI / 2),
    (0, 0, 0.54, PI),
    (0, 0, 0, -PI / 2),
    (0, -0.54, 0, PI / 2),
    (0, 0.15, 0, -PI / 2),
    (0, -0.16, 0, PI),
)
XARM = arm(
    "xarm6-like",
    (0, 0.267, 0, -PI / 2),
    (-1.3849, 0, 0.28949, 0),
    (1.3849, 0, 0.0775, -PI / 2),
    (0, 0.3425, 0, PI / 2),
    (0, 0, 0.076, -PI / 2),
    (0, 0.097, 0, 0),
)
GOFA = arm(
    "gofa-like",
    (0, 0.265, 0, -PI / 2),
    (-PI / 2, 0, 0.444, 0),
    (0, 0, 0.11, -PI / 2),
    (0, 0.47, 0, PI / 2),
    (0, 0, 0.08, -PI / 2),
    (PI, 0.101, 0, 0),
)
TX2 = arm(
    "tx2-like",
    (0, 0.4, 0.05, -PI / 2),
    (-PI / 2, 0, 0.425, 0),
    (PI / 2, 0.05, 0, PI / 2),
    (0, 0.425, 0.03, -PI / 2),
    (0, 0, 0.05, PI / 2),
    (0, 0.1, 0, 0),
)
LITE = kin.Robot.from_dh(
    [
        (0.0, 0.2433, 0.0, PI / 2),
        (PI / 2, 0.03, 0.28, PI),
        (PI / 2, 0.02, 0.0, PI / 2),
        (PI / 2, 0.245, 0.0, PI / 2),
        (PI, 0.057, 0.0, PI / 2),
        (PI / 2, 0.235, 0.0, 0.0),
    ],
    robot_id="lite",
    source="the published table of the Gen3 lite",
)
SQUARE = arm(
    "right angles",
    (0, 0.3, 0.1, PI / 2),
    (0, 0.2, 0.3, -PI / 2),
    (0, 0.1, 0.2, PI / 2),
    (0, 0.3, 0, -PI / 2),
    (0, 0.1, 0.1, PI / 2),
    (0, 0.1, 0, 0),
)
NAMED = (JACO, CRX, XARM, GOFA, TX2, SQUARE)
named = pytest.mark.parametrize("robot", NAMED, ids=lambda robot: robot.id)


def random_arm(seed: int) -> Robot:
    """A table of random numbers."""
    rng = np.random.default_rng(seed)
    rows = [(rng.uniform(-3, 3), *rng.uniform(-0.5, 0.5, 2), rng.uniform(-3, 3)) for _ in range(6)]
    return arm(f"random {seed}", *((float(t), float(d), float(a), float(x)) for t, d, a, x in rows))


def apart(a, b):
    """Largest joint difference, whole turns aside."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def rows_of(robot: Robot, T) -> list[np.ndarray]:
    """The solutions of each pose."""
    return [out[~np.isnan(out[:, 0])] for out in kin.ik_branches(robot, T)]


def recall(robot: Robot, count: int, seed: int = 0) -> tuple[int, int]:
    """How many of so many random poses miss their own configuration, and how many have an odd number of solutions.

    Every solution is checked by forward kinematics.
    """
    q = np.random.default_rng(seed).uniform(-PI, PI, (count, 6))
    T = kin.fk(robot, q)
    missed = odd = 0
    for own, pose, found in zip(q, T, rows_of(robot, T), strict=True):
        missed += not len(found) or bool(apart(found, own).min() > 1e-6)
        odd += len(found) % 2
        if len(found):
            assert np.abs(kin.fk(robot, found) - pose).max() < 1e-10
        for i, row in enumerate(found):
            assert (apart(found[i + 1 :], row) > 1e-7).all()
    return missed, odd


@named
def test_every_pose_finds_the_configuration_it_came_from(robot):
    assert closed_form_of(robot).name == "general6"
    assert recall(robot, 500) == (0, 0)


def test_random_tables_are_solved():
    for seed in range(12):
        assert recall(random_arm(seed), 60) == (0, 0), seed


@pytest.mark.slow
@named
def test_of_a_hundred_thousand_poses_hardly_any_is_missed(robot):
    missed, odd = recall(robot, 100_000, seed=1)
    print(f"{robot.id}: missed {missed}, odd {odd} of 100 000")
    assert missed <= 10


@pytest.mark.slow
def test_of_a_hundred_random_tables_hardly_any_pose_is_missed():
    missed = odd = 0
    for seed in range(100):
        found = recall(random_arm(seed), 1000)
        missed, odd = missed + found[0], odd + found[1]
    print(f"random tables: missed {missed}, odd {odd} of 100 000")
    assert missed <= 10


@pytest.mark.full
@pytest.mark.parametrize("name", ["puma560", "ur5", "irb120"])
def test_arms_of_a_family_have_the_solutions_of_their_closed_form(name):
    robot = kin.get_robot(name)
    form = general6.match(robot)
    T = kin.fk(robot, robot.random_q(np.random.default_rng(2), 60))
    out = np.empty((16, 6))
    for pose, expected in zip(T, kin.ik_branches(robot, T), strict=True):
        assert form.kernels.one(form.kernels.params, pose, math.nan, robot.q_home, out)
        found = out[~np.isnan(out[:, 0])]
        for row in expected[~np.isnan(expected[:, 0])]:
            assert apart(found, row).min() < 1e-5
        assert len(found) == np.count_nonzero(~np.isnan(expected[:, 0]))


def test_the_spelling_of_a_table_does_not_matter():
    q = np.random.default_rng(4).uniform(-PI, PI, (40, 6))
    counts = [len(found) for found in rows_of(GOFA, kin.fk(GOFA, q))]
    base = np.array([[0, -1, 0, 0.3], [1, 0, 0, -2], [0, 0, 1, 1], [0, 0, 0, 1.0]])
    for other in (
        replace(GOFA, id="base and tool", base=nested(base), tool=nested(base)),
        reversed_at(GOFA, (1, 4)),
        replace(
            GOFA,
            id="larger",
            rows=tuple(replace(row, a=1000 * row.a, d=1000 * row.d) for row in GOFA.rows),
        ),
    ):
        signs = np.ones(6)
        signs[[1, 4]] = -1.0 if other.id.startswith("gofa-like-") else 1.0
        found = rows_of(other, kin.fk(other, q * signs))
        assert [len(rows) for rows in found] == counts, other.id


def test_a_twist_typed_with_few_digits_keeps_every_posture():
    ur5 = kin.get_robot("ur5")
    rows = tuple(replace(row, alpha=round(row.alpha, 4)) for row in ur5.rows)
    typed = replace(ur5, id="typed", rows=rows)
    assert closed_form_of(typed).name == "parallel6"
    q = ur5.random_q(np.random.default_rng(5), 60)
    exact, found = rows_of(ur5, kin.fk(ur5, q)), rows_of(typed, kin.fk(typed, q))
    assert all(apart(rows, own).min() < 1e-6 for rows, own in zip(found, q, strict=True))
    assert sum(map(len, found)) >= 0.98 * sum(map(len, exact))


def test_a_degenerate_cut_is_recognised():
    T = kin.fk(CRX, np.random.default_rng(0).uniform(-PI, PI, 6))
    misfits = [misfit_of_degree(cut, T) for cut in cuts_of(CRX)]
    assert [shift for shift, misfit in enumerate(misfits) if misfit < 1e-9] == [5]
    params = closed_form_of(CRX).kernels.params
    assert [int(x) for x in params[SHIFT::SIZE]] == [5]


def test_arms_of_another_kind_are_left_alone():
    for robot in (kin.get_robot("panda"), kin.get_robot("pioneer5")):
        assert general6.match(robot) is None


# -- answers ------------------------------------------------------------------------------------------------------


def test_an_answer_has_every_configuration():
    q = np.array([0.3, -0.7, 1.1, 0.4, -1.2, 2.0])
    result = kin.solve_ik(CRX, kin.fk(CRX, q), q_seed=q)
    assert (result.status, result.solver) == (Status.SOLVED, "general6")
    assert np.abs(result.solutions[0].q - q).max() < 1e-9
    assert len(result.solutions) == len(rows_of(CRX, kin.fk(CRX, q)[None])[0]) >= 2


def test_postures_outside_the_limits_are_listed():
    q = np.array([0.3, -0.7, 1.1, 0.4, -1.2, 2.0])
    limits = [(x + 0.1, x + 0.2) for x in q]
    result = kin.solve_ik(JACO, kin.fk(JACO, q), limits=limits)
    assert (result.status, result.solver) == (Status.LIMITS, "general6")
    assert len(result.blocked) == len(rows_of(JACO, kin.fk(JACO, q)[None])[0])


def test_a_point_out_of_reach_is_too_far():
    T = kin.fk(XARM, np.zeros(6))
    T[:3, 3] += 10.0
    assert kin.solve_ik(XARM, T).cause == "too far"


def test_solutions_have_numbers_and_no_names():
    assert kin.branch_names(GOFA) == ()
    with pytest.raises(InputError, match="have no names"):
        kin.solve_ik(GOFA, kin.fk(GOFA, np.ones(6)), branch="elbow up")
    with pytest.raises(InputError, match="have names"):
        kin.branch_of(GOFA, np.ones(6))


def test_an_approach_direction_leaves_the_last_joint():
    q = np.array([0.3, -0.7, 1.1, 0.4, -1.2, 2.0])
    T = kin.fk(GOFA, q)
    result = kin.solve_ik(GOFA, T, task="approach", q_seed=q, redundancy={"theta6": 0.5})
    assert result.status is Status.SOLVED
    assert all(s.q[5] == pytest.approx(0.5) for s in result.solutions)
    assert len(result.solutions) > 1


@pytest.mark.parametrize("q", [np.zeros(6), np.full(6, PI / 2), np.array([0, PI / 2, 0, -PI / 2, 0, PI])])
@named
def test_zeros_and_right_angles_are_no_special_case(robot, q):
    result = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q)
    assert result.status is Status.SOLVED
    assert np.abs(kin.fk(robot, result.solutions[0].q) - kin.fk(robot, q)).max() < 1e-9


def test_a_multiple_root_is_one_posture():
    """Elbow at a right angle, all others at zero: rounding splits the root."""
    q = np.array([0.0, 0.0, PI / 2, 0.0, 0.0, 0.0])
    T = kin.fk(LITE, q)
    found = kin.solve_ik(LITE, T, q_seed=np.full(6, 0.3))
    near = [s for s in found.solutions if apart(s.q, q) < 1e-2]
    assert len(near) == 1
    assert apart(near[0].q, q) < 1e-6
    assert found.details.multiple >= 1


def test_two_postures_beside_a_fold_are_two():
    rng = np.random.default_rng(4)
    a, b = JACO.random_q(rng, 40)[2:4]  # the determinant changes its sign between them
    determinants = [np.linalg.det(kin.jacobian(JACO, a + x * (b - a))) for x in np.linspace(0.0, 1.0, 60)]
    k = int(np.flatnonzero(np.diff(np.sign(determinants)))[0])
    low, high = k / 59, (k + 1) / 59
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = np.linalg.det(kin.jacobian(JACO, a + middle * (b - a))) * determinants[k] > 0.0
        low, high = (middle, high) if same else (low, middle)
    fold = a + low * (b - a)
    off = 3e-4 * np.linalg.svd(kin.jacobian(JACO, fold))[2][5]
    found = kin.solve_ik(JACO, kin.fk(JACO, fold + off), q_seed=fold, respect_limits=False).solutions
    assert sum(apart(s.q, fold) < 2e-3 for s in found) == 2


@pytest.mark.parametrize(
    "robot", [fixed(kin.get_robot("sawyer"), {6: 0.0}), kin.get_robot("gofa")], ids=["sawyer", "gofa"]
)
def test_the_cut_that_proves_most_is_asked_first(robot):
    params, out = closed_form_of(robot).kernels.params, np.empty((SOLUTIONS, 6))
    poses = kin.fk(robot, np.random.default_rng(3).uniform(-PI, PI, (40, 6)))
    proved = [sum(solve_all(cut, T, out) == PROVED for T in poses) for cut in params.reshape(-1, SIZE)]
    assert len(proved) > 1
    assert proved[0] > 0.9 * max(proved) > 30
