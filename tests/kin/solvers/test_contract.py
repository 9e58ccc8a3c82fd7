"""Every family fulfils `kin.solvers.contract`, and so does an arm with reversed joints.

At the end a family made up for the test shows that a solver is one module and one row of the registry.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import planar3
import pytest
from arms import reversed_at
from few import ELBOW3, ELBOW5, PITCH, PLANAR2, PLANAR4, TURNED3

import kin
from kin import Joint, Robot, Status
from kin.differential.task import task_jacobian
from kin.ik.messages import obstacle, singularity
from kin.solvers import FAMILIES, closed_form_of
from kin.solvers.contract import APPROACH, MASK, POSE, POSITION, ObstacleCode, SolverInput
from kin.solvers.reversed import ReversedJoints
from kin.solvers.singular import Condition, Lost

PI = math.pi
FAR = 1e6
BUILT_IN = tuple(kin.files.classic_robots().values())
SOLVED = tuple(robot for robot in BUILT_IN if closed_form_of(robot) is not None)
# Joints whose direction no closed form accepts.
REVERSED = tuple(
    reversed_at(kin.get_robot(name), joints)
    for name, joints in (("pioneer5", (1, 3)), ("redundant7", (0, 2)), ("iiwa14", (2, 4)))
)
# Arms of no built-in robot's kind, named all the same.
FEW = (*PITCH, ELBOW5, ELBOW3, PLANAR2, PLANAR4, TURNED3)
ARMS = SOLVED + REVERSED + FEW
arms = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)
TASKS = (POSE, APPROACH, POSITION)


def problem(robot, T, task=POSE, values=None, seed=None, respect=False):
    """A target without limits unless they are respected."""
    form = closed_form_of(robot)
    lower, upper = np.full(robot.n, -FAR), np.full(robot.n, FAR)
    if respect:
        lower, upper = robot.lower.copy(), robot.upper.copy()
    values = (math.nan,) * len(form.redundancies(task)) if values is None else values
    seed = robot.q_home.copy() if seed is None else seed
    return SolverInput(T, task, values, respect, seed, lower, upper)


def targets(robot, count, seed=1):
    """Configurations inside the limits and their poses."""
    q = robot.random_q(np.random.default_rng(seed), count)
    return q, kin.fk(robot, q)


def unreachable(T):
    away = T.copy()
    away[:3, 3] += 100.0
    return away


def exists(rows):
    return ~np.isnan(rows[:, 0])


def apart(a, b):
    """Largest joint difference modulo whole turns."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def clear_of_singularities(robot, q):
    return all(s.distance > 0.02 for s in closed_form_of(robot).singularities(q))


# -- identity and matching ----------------------------------------------------------------------------------------


def test_every_row_of_the_registry_has_a_built_in_arm_and_matches_no_arm_of_another_family():
    owners = []
    for robot in BUILT_IN:
        found = [i for i, match in enumerate(FAMILIES) if match(robot) is not None]
        assert len(found) <= 1, robot.id
        owners += found
    assert set(owners) == set(range(len(FAMILIES)))
    # The Panda and the planar arm with two joints are solved by rows of GENERAL.
    names = {closed_form_of(robot).name for robot in SOLVED}
    assert len(names) == len(FAMILIES) + 2


def test_the_closed_form_of_the_reversed_arms_has_reversed_joints():
    assert all(isinstance(closed_form_of(robot), ReversedJoints) for robot in REVERSED)


@arms
def test_family_and_branch_names_are_valid_and_unique(robot):
    form = closed_form_of(robot)
    assert form.name
    assert form.title
    assert form.reason
    assert len(set(form.branches)) == len(form.branches) > 0
    assert all(math.isfinite(length) for length in form.lengths)
    assert kin.branch_names(robot) == (form.branches if form.named else ())


@arms
def test_tasks_and_redundancy_parameters_are_consistent(robot):
    form = closed_form_of(robot)
    assert form.handles(POSE)
    assert not form.handles(MASK)
    for task in filter(form.handles, TASKS):
        parameters = form.redundancies(task)
        assert len({p.name for p in parameters}) == len(parameters)
        assert len({p.label for p in parameters}) == len(parameters)
        for p in parameters:
            assert p.joint in range(-1, robot.n)
            assert p.name.isidentifier()


# -- solve --------------------------------------------------------------------------------------------------------


@arms
@pytest.mark.parametrize("respect", [False, True])
def test_solve_returns_one_row_per_branch_and_does_not_change_its_input(robot, respect):
    form = closed_form_of(robot)
    for task in filter(form.handles, TASKS):
        count = len(form.redundancies(task))
        for pose in targets(robot, 8)[1]:
            for T in (pose, unreachable(pose)):
                asked = problem(robot, T, task, respect=respect)
                before = [x.copy() for x in (asked.T, asked.seed, asked.lower, asked.upper)]
                found = form.solve(asked)
                after = (asked.T, asked.seed, asked.lower, asked.upper)
                assert all(np.array_equal(x, y) for x, y in zip(before, after, strict=True))
                assert found.q.shape == (len(form.branches), robot.n)
                assert found.values.shape == (len(form.branches), count)
                assert len(found.arcs) == count
                missing = np.isnan(found.q)
                assert np.array_equal(missing.all(axis=1), missing.any(axis=1))
                assert missing.all() == (found.obstacle is not None)
                for arcs in found.arcs:
                    assert arcs.shape == (len(arcs), 3)
                    assert np.isin(arcs[:, 0], np.arange(len(form.branches))).all()
                    assert (arcs[:, 1] <= arcs[:, 2]).all()


@arms
def test_an_obstacle_has_a_sentence_and_a_gap(robot):
    form = closed_form_of(robot)
    # Without limits, a sliding arm reaches every point that is far enough from the axis that it passes.
    poses = unreachable(targets(robot, 1)[1][0]), robot.T_world_base.copy()
    found = next(x for T in poses if (x := form.solve(problem(robot, T))).obstacle)
    assert obstacle.clause_of(found.obstacle)
    assert found.gap > 0.1


@arms
def test_branch_of_is_the_inverse_of_solve(robot):
    form = closed_form_of(robot)
    tested = 0
    for q, T in zip(*targets(robot, 30), strict=True):
        if not clear_of_singularities(robot, q):
            continue
        rows = form.solve(problem(robot, T, seed=q)).q
        assert apart(rows[form.branch_of(q)], q) < 1e-6
        for i in np.flatnonzero(exists(rows)):
            if clear_of_singularities(robot, rows[i]):
                assert form.branch_of(rows[i]) == i
                tested += 1
    assert tested > 20


@arms
def test_a_requested_value_is_kept(robot):
    form = closed_form_of(robot)
    for task in filter(form.handles, TASKS):
        parameters = form.redundancies(task)
        for k, parameter in enumerate(parameters):
            if parameter.rare:
                continue
            for q, T in zip(*targets(robot, 5), strict=True):
                # Not every roll is possible where the tool is not on the wrist's axes, nor every pitch.
                other = 0.0 if parameter.name == "roll" else 0.3
                if robot in (*PITCH, PLANAR4) or robot.id == "planar3r":
                    free = form.solve(problem(robot, T, task, seed=-q)).values[:, k]
                    other = float(free[~np.isnan(free)][0])
                value = float(q[parameter.joint]) if parameter.joint >= 0 else other
                values = tuple(value if i == k else math.nan for i in range(len(parameters)))
                found = form.solve(problem(robot, T, task, values, seed=q))
                rows = exists(found.q)
                assert rows.any()
                assert found.values[rows, k] == pytest.approx(value, abs=1e-12)
                if parameter.joint >= 0:
                    assert found.q[rows, parameter.joint] == pytest.approx(value, abs=1e-12)


# -- batch kernels ------------------------------------------------------------------------------------------------


@arms
def test_a_batch_is_bit_identical_to_single_targets(robot):
    form = closed_form_of(robot)
    kernels = form.kernels
    params, near = kernels.params.copy(), robot.q_home.copy()
    T = np.concatenate([targets(robot, 40)[1], unreachable(targets(robot, 2)[1][1])[None]])
    shape = (len(form.branches), robot.n)
    for values in (np.array([math.nan]), np.array([0.3]), np.linspace(-2.0, 2.0, len(T))):
        many, one = np.empty((len(T), *shape)), np.empty(shape)
        kernels.many(kernels.params, T, values, near, many)
        for i, pose in enumerate(T):
            assert kernels.one(kernels.params, pose, float(values[min(i, len(values) - 1)]), near, one)
            assert np.array_equal(one, many[i], equal_nan=True)
        assert np.isnan(many[-1]).all() or not robot.revolute.all()
    assert np.array_equal(kernels.params, params)
    assert np.array_equal(near, robot.q_home)


@arms
def test_a_target_that_is_not_finite_is_reported(robot):
    form = closed_form_of(robot)
    T = targets(robot, 1)[1][0]
    T[1, 3] = math.inf
    out = np.empty((len(form.branches), robot.n))
    assert not form.kernels.one(form.kernels.params, T, math.nan, robot.q_home.copy(), out)


@arms
def test_params_are_a_flat_array_that_kernels_can_read(robot):
    params = closed_form_of(robot).kernels.params
    assert params.ndim == 1
    assert params.dtype == np.float64
    assert params.flags.c_contiguous
    assert np.isfinite(params).all()


@arms
def test_the_batch_contains_the_branches_that_solve_finds(robot):
    form = closed_form_of(robot)
    parameters = form.redundancies(POSE)
    free = bool(parameters) and not parameters[0].rare
    for q, T in zip(*targets(robot, 20), strict=True):
        if not clear_of_singularities(robot, q):
            continue
        value = 0.4 if free else math.nan
        rows = form.solve(problem(robot, T, values=(value,) * len(parameters))).q
        if not all(clear_of_singularities(robot, row) for row in rows[exists(rows)]):
            continue
        out = np.empty_like(rows)
        form.kernels.one(form.kernels.params, T, value, robot.q_home.copy(), out)
        assert np.array_equal(np.isnan(rows), np.isnan(out))
        assert apart(rows[exists(rows)], out[exists(rows)]).max(initial=0.0) < 1e-7
        inside = out[exists(out)][:, robot.revolute]
        if not free or parameters[0].joint < 0:
            assert (inside > -PI).all()
            assert (inside <= PI).all()


# -- singularities ------------------------------------------------------------------------------------------------


def least_sigma(robot, q):
    rolls = closed_form_of(robot).name == "parallel5"  # one of its five joints only rolls the tool
    J = task_jacobian(robot, q) if robot.n >= 5 and not rolls else kin.jacobian(robot, q)
    rank = 3 if robot is PLANAR4 else min(robot.n, 6)
    return np.linalg.svd(J, compute_uv=False)[rank - 1]


@arms
def test_distances_are_zero_on_the_singular_set_and_only_there(robot):
    form = closed_form_of(robot)
    met = 0
    for q in np.random.default_rng(3).uniform(-3.0, 3.0, (40, robot.n)):
        here = form.singularities(q)
        assert all(s.distance > 0.0 for s in here)
        if clear_of_singularities(robot, q):
            assert least_sigma(robot, q) > 1e-9
        for s in here:
            assert {at.joint for at in s.met_at} <= set(range(robot.n))
            if not s.met_at:
                continue
            there = q.copy()
            for joint, value in s.met_at:
                there[joint] = value
            same = next(x for x in form.singularities(there) if (x.kind, x.lost) == (s.kind, s.lost))
            assert same.distance < 1e-12
            assert same.condition == s.condition
            assert s.distance == pytest.approx(float(np.linalg.norm(there - q)), abs=1e-9)
            assert least_sigma(robot, there) < 1e-9
            met += 1
    assert met >= 40 or all(s.kind == "jacobian" for s in here)


@arms
def test_within_omits_singularities_farther_away(robot):
    form = closed_form_of(robot)
    for q in np.random.default_rng(4).uniform(-3.0, 3.0, (40, robot.n)):
        everything = form.singularities(q)
        for limit in (0.0, 0.1, 0.5):
            assert form.singularities(q, limit) == tuple(s for s in everything if s.distance <= limit)


def test_every_code_has_a_sentence():
    assert set(singularity.CONDITIONS) == set(get_args(Condition))
    assert set(singularity.LOSSES) == set(get_args(Lost))
    assert set(obstacle.CLAUSES) == set(get_args(ObstacleCode))


# -- a solver is one module and one row ---------------------------------------------------------------------------


@pytest.fixture
def planar_arm(monkeypatch):
    """A planar arm, and a registry with `planar3` in place of the family that matches the arm otherwise."""
    rows = tuple(
        Joint(f"joint {i + 1}", theta, 0.0, a, 0.0, limits=(-PI, PI))
        for i, (theta, a) in enumerate([(0.3, 0.5), (-0.2, 0.4), (0.1, 0.2)])
    )
    robot = Robot("planar", "planar", "test", "standard", rows, (0.2, 0.5, -0.3))
    others = tuple(match for match in FAMILIES if match(robot) is None)
    assert len(others) == len(FAMILIES) - 1
    monkeypatch.setattr("kin.solvers.FAMILIES", (*others, planar3.match))
    closed_form_of.cache_clear()
    yield replace(robot, id="planar3-arm")
    closed_form_of.cache_clear()


@pytest.mark.full
def test_a_new_solver_needs_its_module_and_one_row(planar_arm):
    assert kin.branch_names(planar_arm) == ("elbow left", "elbow right")
    for q, T in zip(*targets(planar_arm, 20), strict=True):
        rows = kin.ik_branches(planar_arm, T)
        assert np.abs(kin.fk(planar_arm, rows) - T).max() < 1e-9
        result = kin.solve_ik(planar_arm, T, q_seed=q)
        assert (result.status, result.solver) == (Status.SOLVED, "planar3")
        assert result.solver_reason == "all three axes are parallel"
        assert result.solutions[0].branch == kin.branch_of(planar_arm, q)
        assert np.abs(result.solutions[0].q - q).max() < 1e-6
    assert np.isnan(kin.ik_branches(planar_arm, unreachable(T))).all()


def test_a_new_solver_reports_singularities_and_obstacles(planar_arm):
    q = np.array([0.4, 0.5 + 0.02, 0.1])  # at θ2 = 0.5 the two links are in line
    found = kin.singularities(planar_arm, q)
    assert [s.kind for s in found] == ["elbow"]
    form = closed_form_of(planar_arm)
    straight = float(-form.elbow)
    assert found[0].met_at == ((1, pytest.approx(straight)),)
    q[1] = straight
    assert kin.singularities(planar_arm, q)[0].distance < 1e-12
    assert singularity.short(kin.singularities(planar_arm, q)[0]).startswith("elbow straight (θ2 = ")
