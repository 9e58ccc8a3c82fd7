"""Answers to many targets as arrays are those of `kin.solve_ik`, and leave to it what numbers do not tell."""

import math

import numpy as np
import pytest
from arms import reversed_at

import kin
from kin.ik import IKOptions
from kin.ik.table import Table

ARMS = [
    (kin.get_robot("pioneer5"), "approach"),
    (kin.get_robot("ur5"), "pose"),
    (kin.get_robot("puma560"), "pose"),
    (reversed_at(kin.get_robot("pioneer5"), (1, 3)), "approach"),
]
FEW = [
    *((kin.get_robot(name), "pose") for name in ("planar2r", "scara", "so100", "gantry", "rpp")),
    (kin.get_robot("rpp"), "position"),
]
arms = pytest.mark.parametrize(("robot", "task"), ARMS, ids=lambda part: getattr(part, "id", part))


def apart_from_solutions(result):
    """All of an answer but its solutions."""
    names = (
        "status",
        "cause",
        "details",
        "completeness",
        "closest",
        "blocked",
        "distance",
        "nearest_orientation",
        "redundancy",
        "singularities",
        "tolerances",
        "target_error",
        "solver",
        "solver_reason",
        "task",
        "reason",
    )
    return [getattr(result, name) for name in names]


def assert_same_solutions(table, i, result):
    count = table.count[i]
    assert len(result.solutions) == count
    rows = zip(result.solutions, table.q[i], table.branch[i], table.figures[i], strict=False)
    for solution, q, branch, (position, rotation, distance, overrun, _) in rows:
        assert np.array_equal(solution.q, q)
        assert solution.branch == table.branches[branch]
        assert (solution.position_error, solution.rotation_error) == (position, rotation)
        assert (solution.distance, solution.in_limits) == (distance, overrun == 0.0)
        assert (solution.redundancy, solution.compromise) == ((), None)


@pytest.mark.parametrize(("robot", "task"), ARMS + FEW, ids=lambda part: getattr(part, "id", part))
@pytest.mark.parametrize(
    "given",
    [{}, {"max_solutions": 2}, {"respect_limits": False}, {"position_tolerance": 1e-5}],
    ids=lambda given: next(iter(given), "plain"),
)
def test_answers_of_one_kind_differ_in_their_solutions_only(robot, task, given):
    rng = np.random.default_rng(2)
    q, seeds = robot.random_q(rng, 60), robot.random_q(rng, 60)
    T = kin.fk(robot, q)
    T[5, :3, 3] += 9.0
    options = IKOptions(task=task, **given)
    table = Table.of(robot, T, options, seeds)
    first = {}
    for i, kind in enumerate(table.kinds.tolist()):
        result = kin.solve_ik(robot, T[i], options=options, q_seed=seeds[i])
        if kind >= 0:
            assert_same_solutions(table, i, result)
            assert apart_from_solutions(result) == apart_from_solutions(first.setdefault(kind, result))
        else:
            assert table.result(i).status is result.status
    assert (table.kinds >= 0).sum() > 50
    assert first
    # Slides without limits may go as far as the target.
    far = kin.solve_ik(robot, T[5], options=options, q_seed=seeds[5])
    assert (table.kinds[5] >= 0) == (far.status is kin.Status.SOLVED)
    assert table.kinds[5] == -1 or not robot.revolute.all()


@arms
def test_singular_targets_are_left_to_results(robot, task):
    q = robot.random_q(np.random.default_rng(3), 40)
    form = kin.solvers.closed_form_of(robot)
    for k, row in enumerate(q):
        wrist = next(s for s in form.singularities(row) if s.kind == ("elbow" if k % 2 else "wrist"))
        for joint, value in wrist.met_at:
            row[joint] = value + (0.0, 1e-9, 5e-5, 0.05)[k // 10]
    T = kin.fk(robot, q)
    # Without limits the solution beside the seed is the best one.
    near = q + 1e-3
    table = Table.of(robot, T, IKOptions(task=task, respect_limits=False), near)
    for i in range(40):
        result = kin.solve_ik(robot, T[i], q_seed=near[i], task=task, respect_limits=False)
        if result.singularities or result.details.infinite or result.redundancy:
            assert table.kinds[i] == -1
    assert (table.kinds[:30] == -1).all()
    assert (table.kinds[30:] >= 0).any()
    on_seed = Table.of(robot, T[30:], IKOptions(task=task, respect_limits=False), q[30:])
    assert all(on_seed.result(i).solutions[0].distance == 0.0 for i in range(10))


def test_rounded_targets_and_choices_among_postures_are_left_to_results():
    robot = kin.get_robot("ur5")
    T = kin.fk(robot, robot.random_q(np.random.default_rng(4), 8))
    assert (Table.of(robot, T, IKOptions()).kinds >= 0).all()
    rounded = T.copy()
    rounded[3] = T[3].round(4)
    assert (Table.of(robot, rounded, IKOptions()).kinds < 0).tolist() == [k == 3 for k in range(8)]
    for choice in (
        {"branch": "elbow positive"},
        {"images": "all"},
        {"prefer": "limits"},
        {"solver": "numeric"},
        {"avoid_self_collision": True},
        {"task": "position"},
    ):
        assert (Table.of(robot, T, IKOptions(**choice)).kinds == -1).all(), choice
    assert (Table.of(kin.get_robot("iiwa14"), T, IKOptions()).kinds == -1).all()


def test_a_wrong_target_is_named():
    T = np.tile(np.eye(4), (3, 1, 1))
    T[1, 0, 0] = math.nan
    with pytest.raises(kin.InputError, match=r"targets\[1\]"):
        Table.of(kin.get_robot("ur5"), T, IKOptions())


def test_a_table_can_be_stopped():
    class StoppedError(Exception):
        pass

    def cancel():
        raise StoppedError

    robot = kin.get_robot("ur5")
    with pytest.raises(StoppedError):
        Table.of(robot, kin.fk(robot, robot.q_home[None]), IKOptions(), cancel=cancel)
