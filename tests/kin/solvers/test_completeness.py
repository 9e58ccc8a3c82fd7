"""No posture lost, no claim too many: what answers for six joints say of themselves on rounded tables."""

from __future__ import annotations

import math
import os
from dataclasses import replace

import numpy as np
import pytest

import kin
from kin import Joint, Robot, Status
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE, SolverInput
from kin.solvers.general6.batch import AGREED, OPEN, PROVED, SOLUTIONS, branches_one, solve_all, solve_cut
from kin.solvers.general6.cuts import SIZE
from kin.solvers.general6.roots import ROOTS, covers_circle

PI, QUARTER = math.pi, math.pi / 2
# Targets of each table in the campaign under `-m slow`; the full size is 100 000.
TARGETS = int(os.environ.get("KINBOARD_CAMPAIGN", "300"))


def arm(name: str, *rows: tuple[float, float, float, float]) -> Robot:
    """Six revolute joints from rows (θ, d, a, α) of a standard table."""
    joints = tuple(Joint(f"joint {i + 1}", *map(float, row), limits=(-PI, PI)) for i, row in enumerate(rows))
    return Robot(name, name, "test", "standard", joints, (0.1, 0.2, -0.3, 0.4, 0.5, 0.6))


def typed(robot: Robot, decimals: int) -> Robot:
    """The same table with angles of so many decimals."""
    rows = tuple(
        replace(row, theta=round(row.theta, decimals), alpha=round(row.alpha, decimals)) for row in robot.rows
    )
    return replace(robot, id=f"{robot.id}-{decimals}", rows=rows)


H = QUARTER
CRX = arm(
    "crx", (0, 0, 0, -H), (0, 0, 0.54, PI), (0, 0, 0, -H), (0, -0.54, 0, H), (0, 0.15, 0, -H), (0, -0.16, 0, PI)
)
HC10 = arm(
    "hc10",
    (0, 0.275, 0, -H),
    (-H, 0, 0.7, PI),
    (0, 0, 0, -H),
    (0, -0.5, 0, H),
    (0, 0.162, 0, -H),
    (0, -0.17, 0, PI),
)
DOOSAN = arm(
    "doosan",
    (0, 0.1525, 0, -H),
    (-H, 0.0345, 0.62, 0),
    (H, 0, 0, H),
    (0, 0.559, 0, -H),
    (0, 0, 0, H),
    (0, 0.121, 0, 0),
)
XARM = arm(
    "xarm6",
    (0, 0.267, 0, -H),
    (-1.3849179, 0, 0.28949, 0),
    (1.3849179, 0, 0.0775, -H),
    (0, 0.3425, 0, H),
    (0, 0, 0.076, -H),
    (0, 0.097, 0, 0),
)
GOFA = arm(
    "gofa",
    (0, 0.265, 0, -H),
    (-H, 0, 0.444, 0),
    (0, 0, 0.11, -H),
    (0, 0.47, 0, H),
    (0, 0, 0.08, -H),
    (PI, 0.101, 0, 0),
)
TX2 = arm(
    "tx2",
    (0, 0.4, 0.05, -H),
    (-H, 0, 0.425, 0),
    (H, 0.05, 0, H),
    (0, 0.425, 0.03, -H),
    (0, 0, 0.05, H),
    (0, 0.1, 0, 0),
)
JACO = arm(
    "jaco",
    (0, 0.2755, 0, H),
    (0, 0, 0.41, PI),
    (0, -0.0098, 0, H),
    (0, -0.25008, 0, PI / 3),
    (0, -0.08556, 0, PI / 3),
    (0, -0.20278, 0, PI),
)
# Angles with 3 decimals keep the arm away from its family; with more, tables of a family are `Rounded`.
GENERAL = [typed(robot, decimals) for robot in (CRX, HC10) for decimals in (3, 4, 5, 6)] + [
    typed(robot, decimals) for robot in (DOOSAN, XARM, GOFA, TX2, JACO) for decimals in (3, 4)
]
# A cut of the HC10 with three decimals that is valid by the rounding alone; see the note on noise in `roots`.
LOST = np.array(
    [
        -0.7421054974565835,
        -2.5565560329908603,
        -2.3832930059431905,
        -0.03904845663065393,
        -1.5011028750531175,
        -2.238855104076985,
    ]
)
QUARTERS = (1.5708, 1.570796, 1.5707963)


def families():
    """Rounded tables of families."""
    for name in ("ur5", "puma560", "irb120"):
        robot = kin.get_robot(name)
        for quarter in QUARTERS:
            rows = []
            for row in robot.rows:
                turns = [round(angle / QUARTER) for angle in (row.theta, row.alpha)]
                theta, alpha = (
                    n * quarter if abs(angle - n * QUARTER) < 1e-12 else angle
                    for n, angle in zip(turns, (row.theta, row.alpha), strict=True)
                )
                rows.append(replace(row, theta=theta, alpha=alpha))
            yield replace(robot, id=f"{name}-{quarter}", rows=tuple(rows))


FAMILIES = list(families())


def apart(a, b):
    """Largest joint difference, whole turns aside."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


MET_TWICE = (
    1.719082170075926,
    -0.1362125421475775,
    1.6311147063700666,
    0.6461103606158805,
    -0.017528527194711874,
    -2.118604786682431,
)


def candidates(robot, T, seed):
    """The configurations that the solver finds, and what it says of them."""
    form, wide = closed_form_of(robot), np.full(6, 1e6)
    values = (math.nan,) * len(form.redundancies(POSE))
    found = form.solve(SolverInput(T, POSE, values, False, seed, -wide, wide))
    q = found.q[~np.isnan(found.q[:, 0])]
    return q[np.abs(kin.fk(robot, q) - T).max(axis=(1, 2), initial=0.0) < 1e-9], found.completeness


def test_a_pair_that_a_noisy_cut_loses_is_found():
    table = typed(HC10, 3)
    result = kin.solve_ik(table, kin.fk(table, LOST), q_seed=LOST)
    assert result.status is Status.SOLVED
    assert len(result.solutions) == 8
    assert apart(result.solutions[0].q, LOST) < 1e-9
    assert (result.completeness, result.complete, result.details.complete) == ("proved", True, True)


@pytest.mark.full
def test_cuts_that_are_valid_by_rounding_alone_come_last():
    form = closed_form_of(typed(CRX, 4))
    T = kin.fk(form.robot, LOST)
    first = form.kernels.params[:SIZE]
    q, exact = np.empty((SOLUTIONS, 6)), kin.ik_branches(form.robot, T)
    count, found, proved = solve_cut(first, T, False, q, 0)
    assert proved
    assert count == found == (~np.isnan(exact[:, 0])).sum()


def test_most_targets_are_proved():
    proved = 0
    for robot in (typed(CRX, 4), JACO, typed(DOOSAN, 3)):
        params = closed_form_of(robot).kernels.params[:SIZE]
        for q in np.random.default_rng(5).uniform(-PI, PI, (30, 6)):
            T, out = kin.fk(robot, q), np.empty((SOLUTIONS, 6))
            proved += solve_all(params, T, out) == PROVED
    assert proved > 75


def test_discs_prove_nothing_if_a_solution_is_left_out():
    z = np.exp(1j * np.arange(ROOTS))
    angles, radius = np.arange(16.0), np.full(ROOTS, 1e-6)
    assert covers_circle(z, radius, angles, 16)
    assert not covers_circle(z, radius, angles, 15)
    assert not covers_circle(z, radius, angles + 0.1, 16)
    twins = z.copy()
    twins[1] = twins[0] * (1.0 + 1e-7)
    assert not covers_circle(twins, radius, angles, 16)
    angles[1] = angles[0]
    assert covers_circle(twins, radius, angles, 16)


def test_a_cut_that_loses_solutions_is_not_called_complete():
    """The noisy cut of the lost pair, asked alone."""
    table = typed(HC10, 3)
    T, out = kin.fk(table, LOST), np.empty((SOLUTIONS, 6))
    noisy = closed_form_of(table).kernels.params[SIZE:].copy()
    assert solve_all(noisy, T, out) == OPEN
    assert (~np.isnan(out[:, 0])).sum() < 8


def test_both_levels_find_the_same_rows():
    table = typed(CRX, 5)
    for q in np.random.default_rng(2).uniform(-PI, PI, (20, 6)):
        T, out = kin.fk(table, q), np.empty((SOLUTIONS, 6))
        branches_one(closed_form_of(table).kernels.params, T, math.nan, q, out)
        found, _ = candidates(table, T, q)
        assert np.array_equal(out[: len(found)], found)


@pytest.mark.parametrize("robot", GENERAL + FAMILIES, ids=lambda robot: robot.id)
def test_targets_of_a_few_configurations(robot):
    campaign(robot, 40, seed=3)


@pytest.mark.slow
@pytest.mark.parametrize("robot", GENERAL + FAMILIES, ids=lambda robot: robot.id)
def test_no_configuration_is_absent_where_the_answer_is_called_complete(robot):
    unknown = campaign(robot, TARGETS, seed=1)
    print(f"{robot.id}: unknown {unknown} of {TARGETS}")
    assert unknown <= max(2, TARGETS // 100)


@pytest.mark.full
@pytest.mark.parametrize("robot", FAMILIES, ids=lambda robot: robot.id)
def test_near_folds_of_a_few_configurations(robot):
    near_folds(robot, 6)


@pytest.mark.slow
@pytest.mark.parametrize("robot", FAMILIES, ids=lambda robot: robot.id)
def test_near_folds_nothing_is_missing_that_is_proved(robot):
    near_folds(robot, TARGETS)


PUMA = next(each for each in FAMILIES if each.id == "puma560-1.5708")


def test_the_error_of_a_posture_is_the_motion_that_removes_it():
    form = closed_form_of(PUMA)
    rng = np.random.default_rng(4)
    q = rng.uniform(-PI, PI, (8, 6))
    step = 1e-5 * rng.normal(size=(8, 6))
    for at, by in zip(q, step, strict=True):
        search, T = form._six, kin.fk(PUMA, at + by)
        assert np.abs(search._errors(T, (at + by)[None])).max() < 1e-15
        assert np.abs(search._errors(T, at[None])[0] - search._jacobian(at[None])[0] @ by).max() < 1e-8


@pytest.mark.full
@pytest.mark.parametrize("place", [28, 160, 190, 537, 710, 1092])
def test_doubt_about_targets_of_a_rounded_puma_is_settled(place):
    """By Newton's steps, or by the elimination where continuation has too few postures, or none (28, 160, 190)."""
    q = np.random.default_rng(1).uniform(-PI, PI, (1500, 6))[place]
    found, known = candidates(PUMA, kin.fk(PUMA, q), np.zeros(6))
    assert (len(found), known) == (8, "agreed")
    assert apart(found, q).min() < 1e-6


def test_a_posture_that_is_met_twice_beside_a_fold_is_counted_once():
    """Two such pairs filled the rows of the family, and the posture itself had none."""
    robot = next(each for each in FAMILIES if each.id == "puma560-1.5708")
    q = np.array(MET_TWICE)
    found, known = candidates(robot, kin.fk(robot, q), q)
    assert known == "agreed"
    assert len(found) == 8
    assert apart(found, q).min() < 1e-9
    assert min(apart(np.delete(found, i, axis=0), row).min() for i, row in enumerate(found)) > 1e-3


def test_postures_that_nothing_certifies_are_listed_all_the_same():
    q = np.random.default_rng(1).uniform(-PI, PI, (1500, 6))[958]
    found, known = candidates(PUMA, kin.fk(PUMA, q), np.zeros(6))
    assert (len(found), known) == (8, "unknown")
    assert apart(found, q).min() < 1e-8


def test_no_posture_at_the_corner_of_the_reach_is_not_called_complete():
    """Elbow stretched and wrist nearest to axis 1: the exact arm reaches the pose by no motion along one axis."""
    robot = next(each for each in FAMILIES if each.id == "puma560-1.5708")
    q = np.array(
        [
            -1.1325942185166853,
            -1.5698179555207745,
            -1.5257294354010233,
            -2.1148235916255356,
            0.7544880020439604,
            -1.445842761747103,
        ]
    )
    found, known = candidates(robot, kin.fk(robot, q), q)
    assert known == "unknown"
    assert apart(found, q).min() < 1e-3
    far = kin.fk(robot, q)
    far[:3, 3] += 1.0
    found, known = candidates(robot, far, q)
    assert (len(found), known) == (0, "agreed")


@pytest.mark.parametrize("place", [318, 4823, 5020])
def test_two_postures_beside_a_fold_are_agreed_where_targets_close_by_lead_to_no_other(place):
    """A spherical wrist whose twists are typed 1.571, nearly straight: both of its postures are known."""
    robot = typed(DOOSAN, 3)
    q = np.random.default_rng(21).uniform(-PI, PI, (6000, 6))[place]
    found, known = candidates(robot, kin.fk(robot, q), q)
    assert known == "agreed"
    assert len(found) == 8
    assert apart(found, q).min() < 1e-6
    assert min(np.linalg.svd(kin.jacobian(robot, each), compute_uv=False)[-1] for each in found) < 2e-4


def test_two_postures_that_every_cut_misses_are_found_from_a_target_close_by():
    """Beside a singular wrist, θ5 = ±1.4e-5; both cuts find the same six others."""
    robot = typed(DOOSAN, 3)
    q = np.array(
        [
            -0.926370889048842,
            -1.5971670753402643,
            -1.2896098019173872,
            -3.0344181577557308,
            1.420662846363033e-05,
            -2.964900921710099,
        ]
    )
    T, out = kin.fk(robot, q), np.empty((SOLUTIONS, 6))
    assert solve_all(closed_form_of(robot).kernels.params, T, out) == AGREED
    assert apart(out[:6], q).min() > 1.0
    found, known = candidates(robot, T, np.zeros(6))
    assert (len(found), known) == (8, "unknown")
    assert apart(found, q).min() < 1e-6


def near_folds(robot, count):
    """Targets within 1e-5 to 0.1 rad of a fold: what is called complete has the configuration."""
    rng = np.random.default_rng(2)
    for _ in range(count):
        q = beside_fold(robot, rng)
        found, known = candidates(robot, kin.fk(robot, q), q)
        if known == "proved":
            assert apart(found, q).min() < 1e-5, q.tolist()
        if known == "agreed" and np.linalg.svd(kin.jacobian(robot, q), compute_uv=False)[-1] > 1e-5:
            assert apart(found, q).min() < 1e-4, q.tolist()


def beside_fold(robot, rng):
    """A random configuration with one of joints 2 to 5 beside a zero of det J."""
    while True:
        q, joint = rng.uniform(-PI, PI, 6), rng.integers(1, 5)
        values = np.linspace(-PI, PI, 60)
        rows = np.repeat(q[None], 60, axis=0)
        rows[:, joint] = values
        signs = np.sign(np.linalg.det(kin.jacobian(robot, rows)))
        changes = np.flatnonzero(signs[:-1] != signs[1:])
        if not len(changes):
            continue
        k = rng.choice(changes)
        low, high = values[k], values[k + 1]
        for _ in range(50):
            q[joint] = 0.5 * (low + high)
            same = np.sign(np.linalg.det(kin.jacobian(robot, q))) == signs[k]
            low, high = (q[joint], high) if same else (low, q[joint])
        q[joint] += rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-5, -1)
        return q


def campaign(robot, count, seed):
    """Ask for the poses of random configurations; how many answers are `unknown`.

    The ground truth is the configuration that a pose was made from: whatever is called complete must contain it.
    """
    unknown = 0
    for q in np.random.default_rng(seed).uniform(-PI, PI, (count, 6)):
        found, known = candidates(robot, kin.fk(robot, q), q)
        unknown += known == "unknown"
        if known != "unknown":
            assert len(found) % 2 == 0, q.tolist()
            assert apart(found, q).min() < 1e-5, q.tolist()
    return unknown
