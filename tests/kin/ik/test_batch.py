"""`ik_branches`, compared with single calls and with the solvers."""

from __future__ import annotations

import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from arms import CHAPTER_ARMS, reversed_at

import kin
from kin import InputError
from kin.codegen.families import alone
from kin.ik import batch, problem
from kin.ik.answers import answer
from kin.robot import Joint, Robot
from kin.solvers import closed_form_of
from kin.solvers.contract import POSE, SolverInput

ROBOTS = CHAPTER_ARMS
CLOSED = tuple(robot.id for robot in kin.files.classic_robots().values() if closed_form_of(robot) is not None)


def moved(robot):
    """The same arm with a base transform in which no entry is zero."""
    c, s = math.cos(0.7), math.sin(0.7)
    tilt = np.array([[1, 0, 0, 0.1], [0, c, -s, -0.2], [0, s, c, 0.3], [0, 0, 0, 1]])
    turn = np.array([[c, -s, 0, 0.4], [s, c, 0, 0.5], [0, 0, 1, 0.6], [0, 0, 0, 1]])
    return replace(robot, id=robot.id + "-moved", base=tuple(map(tuple, (tilt @ turn).tolist())))


ARMS = [robot for known in map(kin.get_robot, CHAPTER_ARMS) for robot in (known, moved(known))]
arms = pytest.mark.parametrize("robot", ARMS, ids=lambda robot: robot.id)


def targets(robot, count, seed=1):
    return kin.fk(robot, robot.random_q(np.random.default_rng(seed), count))


def singular_targets(robot, count=64):
    """Poses at which some joints, not the first, are at canonical angle 0 or at a right angle."""
    rng = np.random.default_rng(2)
    q = robot.random_q(rng, count)
    offset = closed_form_of(robot).geometry.offset
    special = rng.random(q.shape) < 0.4
    special[:, 0] = False
    return kin.fk(robot, np.where(special, rng.integers(-1, 2, q.shape) * (math.pi / 2) - offset, q))


def solver_branches(robot, T, value):
    """The branches by the solver, without limits."""
    form = closed_form_of(robot)
    far = np.full(robot.n, 1e6)
    return form.solve(SolverInput(T, POSE, (value,), False, robot.q_home.copy(), -far, far)).q


def angle_difference(a, b):
    """Differences of angles ``(...)``, NaN where both are NaN."""
    assert np.array_equal(np.isnan(a), np.isnan(b))
    return np.abs(np.mod(a - b + math.pi, 2 * math.pi) - math.pi)


def closure(robot, T, q):
    """Largest difference of point and approach direction (of the point alone with two joints; of all with six)."""
    there = ~np.isnan(q[..., 0])
    wanted = np.broadcast_to(T[..., None, :, :], (*q.shape[:-1], 4, 4))[there]
    return np.abs(kin.fk(robot, q[there]) - wanted)[..., {2: 3, 5: 2}.get(robot.n, 0) :].max()


# Single targets, batches and solvers compared


@arms
@pytest.mark.parametrize("value", [math.nan, 0.3, -4.0])
def test_a_batch_is_bit_identical_to_single_targets(robot, value):
    T = np.concatenate([targets(robot, 130), singular_targets(robot, 20)])
    many = kin.ik_branches(robot, T, value)
    assert many.shape == (150, 8, robot.n)
    for pose, branches in zip(T, many, strict=True):
        assert np.array_equal(kin.ik_branches(robot, pose, value), branches, equal_nan=True)


@arms
def test_each_target_may_have_its_own_value(robot):
    T = targets(robot, 70)
    values = np.linspace(-3, 3, 70)
    values[::7] = math.nan
    each = kin.ik_branches(robot, T, values)
    for pose, value, branches in zip(T, values, each, strict=True):
        assert np.array_equal(kin.ik_branches(robot, pose, value), branches, equal_nan=True)
    assert np.array_equal(
        kin.ik_branches(robot, T.reshape(7, 10, 4, 4), values.reshape(7, 10)).reshape(each.shape),
        each,
        equal_nan=True,
    )


@arms
def test_the_solver_gives_the_same_branches_as_its_batch_kernels(robot):
    T = targets(robot, 300)
    thin = kin.ik_branches(robot, T, 0.3)
    difference = angle_difference(thin, np.array([solver_branches(robot, pose, 0.3) for pose in T]))
    assert np.nanmedian(difference) <= 1e-15
    assert np.nanquantile(difference, 0.99) <= 1e-12
    assert np.nanmax(difference) <= 1e-9  # rounding error, amplified near a singularity
    assert closure(robot, T, thin) <= 5e-15


@arms
@pytest.mark.parametrize("value", [math.nan, 0.3])
def test_singular_targets_are_solved(robot, value):
    T = singular_targets(robot)
    thin = kin.ik_branches(robot, T, value)
    assert not np.isnan(thin).all(axis=(1, 2)).any()
    assert closure(robot, T, thin) <= 1e-9
    if not math.isnan(value):
        for pose, branches in zip(T, thin, strict=True):
            for one, other in zip(branches, solver_branches(robot, pose, value), strict=True):
                # Where an angle is free, or nearly so, the poses must agree, not the joints.
                assert np.isnan(one).any() == np.isnan(other).any()


@arms
def test_the_home_configuration_is_among_its_own_branches(robot):
    branches = kin.ik_branches(robot, kin.fk(robot, robot.home))
    assert (
        np.nanmin(angle_difference(branches, np.where(np.isnan(branches), math.nan, robot.q_home)).max(axis=1))
        <= 1e-7
    )


@arms
def test_every_configuration_is_among_the_branches_at_its_redundancy_value(robot):
    q = robot.random_q(np.random.default_rng(3), 300)
    if closed_form_of(robot).name == "srs7":
        values = [
            kin.solve_ik(robot, kin.fk(robot, row), q_seed=row, respect_limits=False).solutions[0]
            for row in q[:20]
        ]
        q, values = q[:20], np.array([s.redundancy[0].value for s in values])
    else:
        values = q[:, 0]
    branches = kin.ik_branches(robot, kin.fk(robot, q), values)
    difference = np.abs(np.mod(branches - q[:, None] + math.pi, 2 * math.pi) - math.pi).max(axis=2)
    assert np.nanmin(difference, axis=1).max() <= 1e-6


@arms
def test_out_of_reach_there_is_no_branch(robot):
    T = targets(robot, 70)
    T[::2, :3, 3] += 10.0
    branches = kin.ik_branches(robot, T)
    assert np.isnan(branches[::2]).all()
    assert not np.isnan(branches[1::2]).all(axis=(1, 2)).any()
    assert np.isnan(kin.ik_branches(robot, T[0])).all()


def test_branches_may_be_out_of_reach_on_one_side_only():
    robot = kin.get_robot("pioneer5")
    branches = kin.ik_branches(robot, targets(robot, 200))
    missing = np.isnan(branches)
    assert np.array_equal(missing.any(axis=2), missing.all(axis=2))
    sides = missing[:, ::4, 0]
    assert sides.any(axis=1).any()
    assert not sides.all(axis=1).any()


@pytest.mark.parametrize("robot_id", CLOSED)
def test_every_family_gives_equal_results_for_batches_and_single_targets(robot_id):
    robot = kin.get_robot(robot_id)
    q = robot.random_q(np.random.default_rng(1), 100)
    T = kin.fk(robot, q)
    first, *_ = (*closed_form_of(robot).redundancies(POSE), None)
    values = np.full(100, math.nan) if first is None or first.joint < 0 else q[:, first.joint]
    many = kin.ik_branches(robot, T, values)
    assert many.shape == (100, len(kin.branch_names(robot)), robot.n)
    assert closure(robot, T, many) <= 1e-12
    assert not np.isnan(many).all(axis=(1, 2)).any()
    for pose, value, branches in zip(T, values.tolist(), many, strict=True):
        assert np.array_equal(kin.ik_branches(robot, pose, value), branches, equal_nan=True)


# Shapes, kinds of arrays, invalid input


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 3), (0,), (2, 0)])
def test_batch_axes_come_first(robot_id, shape):
    robot = kin.get_robot(robot_id)
    T = kin.fk(robot, robot.random_q(np.random.default_rng(4), shape))
    assert kin.ik_branches(robot, T).shape == (*shape, 8, robot.n)
    assert kin.ik_branches(robot, T, np.zeros(shape)).shape == (*shape, 8, robot.n)


def test_all_kinds_of_arrays_are_accepted():
    robot = kin.get_robot("redundant7-craig")
    T = np.eye(4)
    T[:3, 3] = 0.25, 0.125, 0.5
    wanted = kin.ik_branches(robot, T, 0.5)
    assert not np.isnan(wanted).any()
    read_only = T.copy()
    read_only.flags.writeable = False
    every_second = np.repeat(T, 2, axis=1)[:, ::2]
    for form in (T.tolist(), T.astype(np.float32), read_only, every_second, np.asfortranarray(T)):
        assert np.array_equal(kin.ik_branches(robot, form, 0.5), wanted)
    for form in (np.float32(0.5), np.array(0.5), np.float64(0.5)):
        assert np.array_equal(kin.ik_branches(robot, T, form), wanted)
    batch = np.stack([T] * 6)
    frozen = batch.copy()
    frozen.flags.writeable = False
    for form in (batch[::2], frozen[:3], np.asfortranarray(batch[:3]), batch[:3].astype(np.float32)):
        assert np.array_equal(kin.ik_branches(robot, form, 0.5), np.stack([wanted] * 3))


def with_value(value, *index):
    T = np.stack([np.eye(4)] * 3)
    T[index] = value
    return T


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize(
    ("target", "field"),
    [
        (np.eye(3), "target"),
        (np.zeros((4, 4, 3)), "target"),
        (np.zeros(16), "target"),
        ("home", "target"),
        (None, "target"),
        (with_value(math.nan, 0, 0, 0)[0], "target[0][0]"),
        (with_value(math.inf, 0, 1, 3)[0], "target[1][3]"),
        (with_value(math.nan, 0, 3, 1)[0], "target[3][1]"),
        (with_value(math.nan, 2, 0, 1), "target[2][0][1]"),
        (with_value(-math.inf, 1, 3, 3), "target[1][3][3]"),
        (with_value(math.nan, 2, 0, 1).tolist(), "target[2][0][1]"),
    ],
)
def test_an_invalid_target_is_named(robot_id, target, field):
    with pytest.raises(InputError) as caught:
        kin.ik_branches(kin.get_robot(robot_id), target)
    assert caught.value.field == field


@pytest.mark.parametrize("value", ["psi", None, 1j, [0.0, 1.0], np.zeros((3, 1)), math.inf, [0.0, -math.inf, 0.0]])
def test_an_invalid_redundancy_of_a_batch_is_named(value):
    robot = kin.get_robot("redundant7-craig")
    with pytest.raises(InputError, match="redundancy"):
        kin.ik_branches(robot, targets(robot, 3), value)


@pytest.mark.parametrize("value", ["psi", None, 1j, [0.0], np.zeros((1, 1)), math.inf, -math.inf])
def test_an_invalid_redundancy_of_one_target_is_named(value):
    robot = kin.get_robot("redundant7-craig")
    with pytest.raises(InputError, match="redundancy"):
        kin.ik_branches(robot, kin.fk(robot, robot.home), value)


@pytest.mark.parametrize("copy", [deepcopy, lambda robot: pickle.loads(pickle.dumps(robot))])
def test_an_arm_in_use_can_be_copied(copy):
    robot = replace(kin.get_robot("pioneer5"))
    T = kin.fk(robot, robot.home)
    wanted = kin.ik_branches(robot, T)
    assert np.array_equal(kin.ik_branches(copy(robot), T), wanted, equal_nan=True)


def test_an_arm_without_a_closed_form_is_rejected():
    rows = tuple(Joint(name, kind="prismatic", limits=(0.0, 1.0)) for name in "12")
    slide = Robot("slides", "slides", "", "standard", rows, (0.5, 0.5))
    with pytest.raises(InputError, match="robot"):
        kin.ik_branches(slide, np.eye(4))


@pytest.mark.parametrize("robot_id", CLOSED)
def test_threads_get_the_same_results_as_serial_calls(robot_id):
    robot = kin.get_robot(robot_id)
    batches = [targets(robot, 300, seed) for seed in range(24)]

    def work(T):
        return kin.ik_branches(robot, T), kin.ik_branches(robot, T[0]), kin.ik_branches(robot, T, np.zeros(300))

    serial = [work(T) for T in batches]
    with ThreadPoolExecutor(8) as pool:
        for one, other in zip(serial, pool.map(work, batches), strict=True):
            assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True))


# -- solve_ik_many -----------------------------------------------------------------------------------------------


def test_a_stack_of_targets_has_the_answers_of_each():
    robot = kin.get_robot("pioneer5")
    T = targets(robot, 6)
    T[2, :3, 3] = 9.0
    T[4] = T[4].round(3)
    seeds = robot.random_q(np.random.default_rng(5), 6)
    found = kin.solve_ik_many(robot, T, q_seed=seeds, images="all", limits=[None] * 4 + [(0.3, 0.7)])
    assert len(found) == 6
    assert found.q.shape == (6, 5)
    alone = [
        kin.solve_ik(robot, each, q_seed=seed, images="all", limits=[None] * 4 + [(0.3, 0.7)])
        for each, seed in zip(T, seeds, strict=True)
    ]
    assert list(map(repr, found)) == list(map(repr, alone))
    assert found[4].target_error > 0.0
    for i, result in enumerate(alone):
        assert found.status[i] is result.status
        assert found.solved[i] == (result.status is kin.Status.SOLVED)
        expected = result.solutions[0].q if found.solved[i] else np.full(5, math.nan)
        assert np.array_equal(found.q[i], expected, equal_nan=True)
    assert not found.solved[2]
    assert found.solved.sum() >= 2
    assert [type(part) for part in found[1:3]] == [kin.IKResult] * 2
    assert repr(found).startswith("IKResults(6 targets: ")
    with pytest.raises(ValueError, match="read-only"):
        found.q[0] = 0.0


def test_one_seed_is_the_seed_of_all_targets_and_points_are_targets_too():
    T = targets(kin.get_robot("ur5"), 3)
    seed = np.full(6, 0.5)
    found = kin.solve_ik_many("ur5", list(T), q_seed=seed)
    assert list(map(repr, found)) == [repr(kin.solve_ik("ur5", each, q_seed=seed)) for each in T]
    points = kin.solve_ik_many("ur5", T[:, :3, 3], task="position")
    assert points.solved.all()


@pytest.mark.parametrize(
    ("given", "more", "message"),
    [
        (np.eye(4), {}, r"targets\[0\]: got 'shape \(4,\)'"),
        ("poses", {}, "targets: .*a sequence of poses"),
        ([np.eye(4), np.eye(3)], {}, r"targets\[1\]"),
        ([np.eye(4)] * 2, {"q_seed": np.zeros((3, 6))}, "q_seed: .*one for each of the 2 targets"),
        ([np.eye(4)] * 2, {"q_seed": [[0.0] * 6, [1e9] + [0.0] * 5]}, r"q_seed\[1\]\[0\]: got 1000000000.0"),
        ([np.eye(4)] * 2, {"q_seed": [0.0, 1e9, 0.0, 0.0, 0.0, 0.0]}, r"q_seed\[1\]: got 1000000000.0"),
        ([np.eye(4)], {"task": "place"}, "task: "),
        ([np.eye(4)], {"task": []}, "task: "),
        ([np.eye(4)], {"locked": [0.0]}, "locked: "),
    ],
)
def test_a_malformed_stack_is_refused_by_name(given, more, message):
    with pytest.raises(InputError, match=message):
        kin.solve_ik_many("ur5", given, **more)


@pytest.mark.parametrize("none", [[], np.empty((0, 4, 4))])
def test_no_target_has_no_answer(none):
    found = kin.solve_ik_many("ur5", none, q_seed=[0.0] * 6)
    assert (list(found), found.q.shape, found.status) == ([], (0, 6), ())


def test_each_target_of_a_stack_is_read_once(monkeypatch):
    read = []
    once = problem.read_pose
    monkeypatch.setattr(problem, "read_pose", lambda *given, **more: read.append(1) or once(*given, **more))
    T = targets(kin.get_robot("ur5"), 3)
    assert kin.solve_ik_many("ur5", [T[0].round(4), *T[1:]]).solved.all()
    assert len(read) == 3


def test_a_stack_given_to_solve_ik_is_refused_with_what_takes_it():
    with pytest.raises(InputError, match=r"kin\.solve_ik_many takes several"):
        kin.solve_ik("ur5", targets(kin.get_robot("ur5"), 2))


@pytest.mark.parametrize(
    "name",
    [
        *("pioneer5", "puma560", "ur5", "irb120", "stanford", "scara"),
        *("iiwa14", "redundant7", "redundant7-craig", "panda"),
        *("planar2r", "planar3r", "so100", "wx250", "gantry", "rpp", "rrp", "gofa"),
    ],
)
@pytest.mark.parametrize("more", [{}, {"respect_limits": False}, {"locked": True}], ids=["limits", "none", "lock"])
def test_the_best_of_many_is_that_of_one_bit_for_bit(name, more):
    """At regular and singular targets, inside and outside the limits, with a seed for each."""
    robot, rng = kin.get_robot(name), np.random.default_rng(7)
    q = robot.random_q(rng, 24)
    q[::3] = robot.q_home
    q[::4, 4:] = 0.0
    q[::5] *= 1.5
    T, seeds = kin.fk(robot, q), robot.random_q(rng, 24)
    seeds[1::2] = q[1::2] + 0.05  # the other elbow is then too far to be the nearest, and left out
    T[7, :3, 3] = 9.0
    if more == {"locked": True}:
        more = {"locked": [0.6 if name == "gantry" else 0.2, *[None] * (robot.n - 1)]}
    found = kin.solve_ik_many(robot, T, q_seed=seeds, **more)
    for i, (each, seed) in enumerate(zip(T, seeds, strict=True)):
        alone = kin.solve_ik(robot, each, q_seed=seed, **more)
        assert found.status[i] is alone.status
        expected = alone.solutions[0].q if alone.status is kin.Status.SOLVED else np.full(robot.n, math.nan)
        assert np.array_equal(found.q[i], expected, equal_nan=True)
        assert repr(found[i]) == repr(alone)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "task", "turned"),
    [("planar2r", "pose", False), ("so100", "pose", True), ("rpp", "position", True), ("rpp", "approach", True)],
)
def test_few_joints_meet_what_they_can_in_a_batch_as_alone(name, task, turned):
    """The branch nearest to the seed need not meet the whole task where another one does."""
    robot, rng = kin.get_robot(name), np.random.default_rng(8)
    q, seeds = robot.random_q(rng, 40), robot.random_q(rng, 40)
    T = kin.fk(robot, q)
    if turned:
        T[::2, :3, :3] = T[::2, :3, :3] @ kin.pose_from_xyz_rpy(np.zeros(3), [0.3, -0.2, 0.1])[:3, :3]
    found = kin.solve_ik_many(robot, T, q_seed=seeds, task=task)
    nearest = 0
    for i, (each, seed) in enumerate(zip(T, seeds, strict=True)):
        alone = kin.solve_ik(robot, each, q_seed=seed, task=task)
        assert found.status[i] is alone.status
        expected = alone.solutions[0].q if alone.status is kin.Status.SOLVED else np.full(robot.n, math.nan)
        assert np.array_equal(found.q[i], expected, equal_nan=True)
        rows = kin.ik_branches(robot, each)
        rows = rows[~np.isnan(rows[:, 0])]
        nearest += len(rows) == 0 or np.allclose(rows[np.argmin(np.linalg.norm(rows - seed, axis=1))], found.q[i])
    assert found.solved.sum() >= 20
    if name == "planar2r":
        assert nearest < 30  # elsewhere the other elbow is nearer, and turns the tool another way


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("panda", {}),
        ("panda", {"redundancy": {"theta7": 0.4}}),
        ("iiwa14", {"redundancy": {"psi": 0.5}}),
        ("ur5", {"task": "approach"}),
        ("so100", {"respect_limits": False}),
        ("gofa", {}),
    ],
    ids=str,
)
def test_branches_that_are_computed_one_target_at_a_time_are_computed_once(name, more, monkeypatch):
    """For the best solution and for the whole answer, which are those of a single call."""
    robot, rng = kin.get_robot(name), np.random.default_rng(10)
    T, seeds = kin.fk(robot, robot.random_q(rng, 12)), robot.random_q(rng, 12)
    alone = [kin.solve_ik(robot, each, q_seed=seed, **more) for each, seed in zip(T, seeds, strict=True)]
    form, asked = closed_form_of(robot), []
    solve = type(form).solve
    monkeypatch.setattr(type(form), "solve", lambda form, given: asked.append(given.T) or solve(form, given))
    found = kin.solve_ik_many(robot, T, q_seed=seeds, **more)
    solved = [i for i, result in enumerate(alone) if result.status is kin.Status.SOLVED]
    assert len(solved) >= 6
    for i in solved:
        assert np.array_equal(found.q[i], alone[i].best.q)
        assert repr(found[i]) == repr(alone[i])
        assert found[i].redundancy == alone[i].redundancy
        assert [s.q.tolist() for s in found[i].solutions] == [s.q.tolist() for s in alone[i].solutions]
        assert sum(np.allclose(each, T[i], atol=1e-9) for each in asked) == 1


def test_of_two_rows_that_are_equally_near_but_for_rounding_the_first_is_taken():
    """Their squared distances to the seed differ in the last digit, their distances do not."""
    robot, seed = kin.get_robot("planar2r"), np.array([-0.0, math.pi / 2])
    T = kin.fk(robot, [-1.5707963267953369, 3.1415778224127107])
    prepared, rows = problem.prepare(robot, kin.IKOptions()), np.empty((1, 2, 2))
    closed_form_of(robot).solve_many(T[None], seed[None], prepared.lower, prepared.upper, rows)
    squares = ((rows[0] - seed) ** 2).sum(axis=1)
    assert squares[1] < squares[0]
    assert math.sqrt(squares[1]) == math.sqrt(squares[0])
    assert np.array_equal(
        kin.solve_ik_many(robot, T[None], q_seed=seed).q[0], kin.solve_ik(robot, T, q_seed=seed).best.q
    )


@pytest.mark.parametrize("name", ["planar2r", "planar3r", "so100", "gantry", "rpp"])
def test_regular_targets_of_few_joints_take_no_results(name, monkeypatch):
    """All best solutions are from the compiled pass."""
    monkeypatch.setattr(batch, "answer", None)
    robot, rng = kin.get_robot(name), np.random.default_rng(9)
    q, seeds = robot.random_q(rng, 300), robot.random_q(rng, 300)
    assert kin.solve_ik_many(robot, kin.fk(robot, q), q_seed=seeds).solved.all()


IN_LANES = [
    *map(kin.get_robot, ("pioneer5", "puma560", "ur5", "irb120", "stanford")),
    reversed_at(kin.get_robot("pioneer5"), (1, 3)),
    reversed_at(kin.get_robot("ur5"), (0, 2, 4)),
]


def hard_targets(robot, near, count):
    """Targets, and seeds ``(count, n)``, beside singularities, limits, the end of the reach and half turns."""
    rng, form = np.random.default_rng(11), closed_form_of(robot)
    q, seeds = robot.random_q(rng, count), robot.random_q(rng, count)
    seeds[::2] = q[::2] + 0.05 * rng.normal(size=q[::2].shape)
    tiny = 10.0 ** rng.uniform(-13.0, -2.0, q.shape) * rng.choice([-1.0, 1.0], q.shape)
    if near in {"singular", "reach"}:
        for row, by in zip(q, tiny, strict=True):
            kinds = [s.met_at for s in form.singularities(row) if s.kind == "elbow" or near == "singular"]
            for joint, value in kinds[rng.integers(len(kinds))]:
                row[joint] = value + by[joint] * (near == "singular")
    if near == "limits":
        end = np.where(rng.random(q.shape) < 0.5, robot.lower, robot.upper)
        q = np.where(rng.random(q.shape) < 0.3, end + tiny, q)
    if near == "grid":
        q = np.round(q / (math.pi / 4)) * (math.pi / 4) + tiny
        seeds = np.round(seeds / (math.pi / 2)) * (math.pi / 2)
    T = kin.fk(robot, q)
    if near == "reach":
        T[:, :3, 3] *= 1.0 + tiny[:, :1] * 1e-4
    return T, seeds


@pytest.mark.parametrize("robot", IN_LANES, ids=lambda robot: robot.id)
@pytest.mark.parametrize("near", ["", "singular", "limits", "reach", "grid"])
def test_targets_in_lanes_have_the_branches_of_the_careful_kernel(robot, near):
    """In a batch all of them but those that leave a parameter free, and bit by bit those of a single target."""
    T, seeds = hard_targets(robot, near, 200)
    form, limits = closed_form_of(robot), (robot.lower, robot.upper)
    careful = alone(robot, form)
    many, expected = np.empty((2, len(T), len(form.branches), robot.n))
    form.solve_many(T, seeds, *limits, many)
    regular = 0
    for i, (each, seed) in enumerate(zip(T, seeds, strict=True)):
        values = (math.nan,) * len(form.redundancies(POSE))
        found = form.solve(SolverInput(each, POSE, values, True, seed, *limits))
        careful.rows(careful.inner, careful.params, each, math.nan, seed, limits, np.empty((256, 3)), expected[i])
        assert np.array_equal(np.isnan(found.q), np.isnan(expected[i]))
        off = np.abs(found.q - expected[i])
        off = np.where(robot.revolute, np.minimum(off, 2.0 * math.pi - off), off)
        assert np.nanmax(off, initial=0.0) < 1e-9
        free = not np.isnan(found.values).all()
        assert np.array_equal(many[i], np.full_like(found.q, math.nan) if free else found.q, equal_nan=True)
        regular += not (free or np.array_equal(found.q, expected[i], equal_nan=True))
    assert regular >= {"": 100, "limits": 100}.get(near, 0)


def test_results_are_made_when_they_are_asked_for(monkeypatch):
    made = []
    monkeypatch.setattr(batch, "answer", lambda *given: made.append(given) or answer(*given))
    robot = kin.get_robot("ur5")
    T = targets(robot, 5)
    T[3, :3, 3] = 9.0
    found = kin.solve_ik_many(robot, T)
    assert len(made) == 1  # the one that is out of reach
    assert found.solved.tolist() == [True, True, True, False, True]
    assert len(made) == 1
    assert found[-1] is found[4]
    assert len(made) == 2
    again = pickle.loads(pickle.dumps(found))
    assert np.array_equal(again.q, found.q, equal_nan=True)
    assert list(map(repr, again)) == list(map(repr, found))
    assert again.status == found.status
    with pytest.raises(IndexError):
        found[5]
