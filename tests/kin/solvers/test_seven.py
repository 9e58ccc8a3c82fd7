"""Arms with seven revolute joints of which one is given: Panda, Gen3, xArm7 (offset7), Sawyer (general7); and any
arm with seven joints of which one is locked."""

from __future__ import annotations

import math
import time
import weakref
from dataclasses import replace

import numpy as np
import pytest
from arms import GEN3, SAWYER, XARM7, Draw, eight_joints, nested, problem_of, reversed_at

import kin
from kin import InputError, Robot, Status
from kin.ik import preferences
from kin.solvers import closed_form_of, general7, offset7
from kin.solvers.contract import POSE, SolverInput
from kin.solvers.locked import form_with_locked
from kin.solvers.reduced import fixed
from kin.solvers.selfmotion.tracing import end_of_motion

PI = math.pi
PANDA = kin.get_robot("panda")
NAMED = (PANDA, GEN3, XARM7)
ALL = (*NAMED, SAWYER)
robots = pytest.mark.parametrize("robot", ALL, ids=lambda robot: robot.id)
named = pytest.mark.parametrize("robot", NAMED, ids=lambda robot: robot.id)
# An arm with six joints of a family, on a turntable.
ON_A_TURNTABLE = replace(
    kin.get_robot("ur5"),
    id="turntable",
    rows=(kin.Joint("turntable", 0.0, 0.3, 0.5, PI / 3, limits=(-2.0, 2.0)), *kin.get_robot("ur5").rows),
    home=(0.0, *kin.get_robot("ur5").home),
)


def apart(a, b):
    """Largest joint difference, whole turns aside."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def recall(robot: Robot, count: int, seed: int = 0) -> tuple[int, int, float]:
    """(random poses that miss their own configuration, poses with an odd number of solutions, µs per pose).

    Each is solved at its own value of the given joint; every solution is checked by forward kinematics.
    """
    given = closed_form_of(robot).given
    missed = odd = 0
    seconds = 0.0
    rng = np.random.default_rng(seed)
    for _ in range(0, count, 1000):
        q = rng.uniform(-PI, PI, (min(count, 1000), 7))
        T = kin.fk(robot, q)
        start = time.perf_counter()
        found = kin.ik_branches(robot, T, q[:, given])
        seconds += time.perf_counter() - start
        there = ~np.isnan(found[..., 0])
        missed += int((np.where(there, apart(found, q[:, None]), math.inf).min(axis=1) > 1e-6).sum())
        odd += int((there.sum(axis=1) % 2).sum())
        assert np.abs(kin.fk(robot, found[there]) - np.repeat(T, there.sum(axis=1), axis=0)).max() < 1e-9
    return missed, odd, 1e6 * seconds / count


@robots
def test_every_pose_finds_the_configuration_it_came_from(robot):
    assert closed_form_of(robot).name == ("general7" if robot is SAWYER else "offset7")
    assert recall(robot, 400)[:2] == (0, 0)


@pytest.mark.slow
@robots
def test_of_a_hundred_thousand_poses_hardly_any_is_missed(robot):
    missed, odd, each = recall(robot, 100_000, seed=1)
    print(f"{robot.id}: missed {missed}, odd {odd} of 100 000, {each:.1f} µs each")
    assert missed <= 10


def test_the_given_joint_is_the_one_that_leaves_a_closed_form():
    givens = {robot.id: closed_form_of(robot).given for robot in ALL}
    assert givens == {"panda": 6, "gen3": 0, "xarm7": 6, "sawyer": 6}
    form = closed_form_of(ON_A_TURNTABLE)
    assert (form.name, form.given, form.form.name) == ("general7", 0, "parallel6")
    assert recall(ON_A_TURNTABLE, 200)[0] == 0


def test_random_arms_with_a_spherical_end_are_solved():
    for seed in range(8):
        draw = Draw(seed)
        rows = [(draw.angle(), draw.length(), draw.length(), draw.rng.uniform(-3, 3)) for _ in range(4)]
        rows[1] = (*rows[1][:2], 0.0, draw.rng.uniform(0.3, 2.8))
        rows += [(0.0, draw.length(), 0.0, draw.square()), (0.3, 0.0, 0.0, draw.square()), (0.1, 0.2, 0.1, 0.4)]
        joints = tuple(kin.Joint(f"{i}", *row, limits=(-PI, PI)) for i, row in enumerate(rows))
        robot = Robot("made up", "", "", "standard", joints, (0.1,) * 7, base=draw.pose(), tool=draw.pose())
        assert isinstance(closed_form_of(robot), offset7.Offset7), seed
        assert recall(robot, 100)[:2] == (0, 0), seed


def test_the_spelling_of_a_table_does_not_matter():
    base = np.array([[0, -1, 0, 0.3], [1, 0, 0, -2], [0, 0, 1, 1], [0, 0, 0, 1.0]])
    q = np.random.default_rng(4).uniform(-PI, PI, (40, 7))

    def counts(robot, q):
        rows = kin.ik_branches(robot, kin.fk(robot, q), q[:, closed_form_of(robot).given])
        return (~np.isnan(rows)).sum(axis=(1, 2)).tolist()

    for robot in ALL:
        moved = replace(robot, id="base and tool", base=nested(base), tool=nested(robot.T_last_tool @ base))
        assert counts(moved, q) == counts(robot, q)
        turned = reversed_at(robot, (0, 3, 6))
        assert counts(turned, q * np.array([-1, 1, 1, -1, 1, 1, -1])) == counts(robot, q)


# -- ranges -------------------------------------------------------------------------------------------------------


def problem_at(robot, T):
    return SolverInput(T, POSE, (math.nan,), True, robot.q_home, robot.lower, robot.upper)


def candidates(robot, T, seed, value=math.nan, respect=True):
    return closed_form_of(robot).solve(SolverInput(T, POSE, (value,), respect, seed, robot.lower, robot.upper))


@robots
def test_inside_a_range_the_joints_keep_their_limits_and_beyond_its_ends_they_do_not(robot):
    form = closed_form_of(robot)
    rng = np.random.default_rng(2)
    tested = ends = 0
    for _ in range(3):
        q = robot.random_q(rng)
        T = kin.fk(robot, q)
        for s in kin.solve_ik(robot, T, q_seed=q).solutions:
            for low, high in s.redundancy[0].intervals:
                if not low <= s.redundancy[0].value <= high:
                    continue
                for value in np.linspace(low, high, 7)[1:-1].tolist():
                    found = kin.solve_ik(robot, T, q_seed=q, redundancy=value)
                    assert found.status is Status.SOLVED
                    assert {x.q[form.given] for x in found.solutions} == {value}
                    tested += 1
                if robot.lower[form.given] + 1e-6 < low and form.named:
                    beyond = kin.solve_ik(robot, T, redundancy=low - 1e-6, branch=s.branch)
                    assert beyond.status is not Status.SOLVED
                    ends += 1
    assert tested > 20
    assert ends > 3 or not form.named


@named
def test_ranges_agree_with_a_dense_sampling(robot):
    form = closed_form_of(robot)
    rng = np.random.default_rng(3)
    low, high = max(robot.lower[form.given], -PI), min(robot.upper[form.given], PI)
    values = np.linspace(low, high, 4001)
    for _ in range(4):
        q = robot.random_q(rng)
        T = kin.fk(robot, q)
        arcs = candidates(robot, T, q).arcs[0]
        rows = kin.ik_branches(robot, np.broadcast_to(T, (len(values), 4, 4)), values)
        low_q, high_q = robot.lower, robot.upper
        shifted = low_q + (rows - low_q) % (2 * PI)
        inside = (shifted <= high_q + 1e-9).all(axis=2)
        for k in range(8):
            own = arcs[arcs[:, 0] == k][:, 1:]
            listed = ((values[:, None] >= own[:, 0] - 1e-9) & (values[:, None] <= own[:, 1] + 1e-9)).any(axis=1)
            # A sample within a step of an end may fall on either side.
            near = (np.abs(values[:, None] - own.reshape(1, -1)) < 1e-3).any(axis=1)
            assert (listed == inside[:, k])[~near].all()


def agrees_with_samples(robot: Robot, T, low: float, high: float, count: int = 4001) -> int:
    """How many samples in [low, high] have another feasibility than the arcs say, those beside an end aside."""
    values = np.linspace(low, high, count)
    arcs = candidates(robot, T, robot.q_home).arcs[0]
    rows = kin.ik_branches(robot, np.broadcast_to(T, (count, 4, 4)), values)
    inside = (robot.lower + (rows - robot.lower) % (2 * PI) <= robot.upper + 1e-9).all(axis=2)
    wrong = 0
    for k in range(8):
        own = arcs[arcs[:, 0] == k][:, 1:]
        listed = ((values[:, None] >= own[:, 0]) & (values[:, None] <= own[:, 1])).any(axis=1)
        near = (np.abs(values[:, None] - own.reshape(1, -1)) < 1e-6).any(axis=1)
        wrong += int((listed != inside[:, k])[~near].sum())
    return wrong


@pytest.mark.parametrize(
    "q",
    [
        # Joint 3 swings past its limit and back within 0.7°, near a singularity of the wrist.
        (1.7433, -0.1791, 1.3295, -3.0052, 0.0422, -3.0468, -0.0408),
        (-2.2914, -0.357, 1.6404, -2.132, 0.3279, 0.1056, -2.1715),
        (1.6057, -1.6426, -2.6017, -3.0676, 1.6966, 1.0596, -2.0583),
        (0.3625, -0.1892, 1.5119, -0.7032, 0.4127, 2.2902, 0.0994),
    ],
)
def test_narrow_gaps_between_ranges_are_found(q):
    assert agrees_with_samples(PANDA, kin.fk(PANDA, np.array(q)), PANDA.lower[6], PANDA.upper[6], 20001) == 0


@named
def test_ranges_agree_with_samples_near_singular_wrists(robot):
    rng = np.random.default_rng(11)
    given = closed_form_of(robot).given
    low, high = max(robot.lower[given], -PI), min(robot.upper[given], PI)
    for size in (0.0, 1e-3, 1e-2, 0.1):
        q = robot.random_q(rng)
        q[1 if given == 6 else 5] = size  # the middle joint of the spherical end
        assert agrees_with_samples(robot, kin.fk(robot, q), low, high) == 0, size


def test_a_branch_that_exists_in_less_than_a_thousandth_of_a_radian_is_found():
    """The wrist centre is near axis 3: as a share of that distance, what is missing grows towards the gap."""
    own = ((0.2128685, 1.08, 4.06), (0, -2.059, 2.0944), (0.3120079, -6.28, 6.28), (0, -0.19198, 3.927))
    own = (*own, (0.356081, -1.94, 3.508), (0, -1.692, PI), (0.064244, -6.28, 6.28))
    rows = tuple(replace(row, d=d, limits=(a, b)) for row, (d, a, b) in zip(XARM7.rows, own, strict=True))
    robot = replace(XARM7, id="narrow", rows=rows, home=(2.0, *XARM7.home[1:]))
    q = np.array([2.8033294514978637, 1.8453646597645297, -2.9523109701268355, 1.5654086570889072])
    T = kin.fk(robot, np.array([*q, 1.3408083197292018, 0.3851070522497897, -1.1356612606113172]))
    arcs = candidates(robot, T, robot.q_home).arcs[0]
    narrow = arcs[(arcs[:, 0] == 7) & (arcs[:, 1] > 0.0)]
    assert len(narrow) == 1
    assert 1e-4 < narrow[0, 2] - narrow[0, 1] < 1e-3
    assert agrees_with_samples(robot, T, narrow[0, 1] - 0.01, narrow[0, 2] + 0.01) == 0


def test_a_self_motion_ends_at_a_limit_or_where_it_turns_back():
    rng = np.random.default_rng(5)
    ended = set()
    for _ in range(6):
        q = SAWYER.random_q(rng)
        T = kin.fk(SAWYER, q)
        for sense in (-1.0, 1.0):
            end = end_of_motion(SAWYER.model, T, 6, sense, q, SAWYER.lower, SAWYER.upper)
            assert sense * (end - q[6]) >= 0.0
            rows = kin.ik_branches(SAWYER, T, end - sense * 1e-7)
            there = rows[~np.isnan(rows[:, 0])]
            room = np.minimum(there - SAWYER.lower, SAWYER.upper - there)
            sigma = [np.linalg.svd(np.delete(kin.jacobian(SAWYER, x), 6, axis=1))[1][-1] for x in there]
            ended.add("limit" if np.abs(room).min() < 1e-4 else "fold")
            assert np.abs(room).min() < 1e-4 or min(sigma) < 1e-2
    assert ended == {"limit", "fold"}


def test_the_ends_of_self_motions_are_those_of_a_closed_form():
    form, rng = closed_form_of(PANDA), np.random.default_rng(11)
    for q in PANDA.random_q(rng, 12):
        T, joint = kin.fk(PANDA, q), form.given
        arcs = candidates(PANDA, T, q).arcs[0]
        own = arcs[(arcs[:, 0] == form.branch_of(q)) & (arcs[:, 1] <= q[joint]) & (q[joint] <= arcs[:, 2])]
        ends = [end_of_motion(PANDA.model, T, joint, sense, q, PANDA.lower, PANDA.upper) for sense in (-1.0, 1.0)]
        assert own[0, 1:] == pytest.approx(ends, abs=1e-8)  # its ends have the slack of limits


# -- answers ------------------------------------------------------------------------------------------------------


@robots
def test_an_answer_has_every_configuration_at_the_value_of_the_seed(robot):
    form = closed_form_of(robot)
    rng = np.random.default_rng(6)
    for _ in range(5):
        q = robot.random_q(rng)
        result = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q)
        assert (result.status, result.solver) == (Status.SOLVED, form.name)
        assert (result.completeness, result.complete) == (
            ("agreed", True) if robot is SAWYER else ("searched", False)
        )
        value = float(q[form.redundancies(POSE)[0].joint])
        assert kin.solve_ik(robot, kin.fk(robot, q), q_seed=q, redundancy=value).complete
        assert np.abs(result.solutions[0].q - q).max() < 1e-8
        (parameter,) = result.redundancy
        assert parameter.name == f"theta{form.given + 1}"
        assert any(low <= parameter.value <= high for low, high in parameter.intervals)


@robots
def test_a_pose_is_found_whatever_the_seed(robot):
    rng = np.random.default_rng(7)
    for _ in range(8):
        q, seed = robot.random_q(rng, 2)
        result = kin.solve_ik(robot, kin.fk(robot, q), q_seed=seed)
        assert result.status is Status.SOLVED
        assert np.abs(kin.fk(robot, result.solutions[0].q) - kin.fk(robot, q)).max() < 1e-9


@robots
def test_a_pose_beyond_a_limit_says_so(robot):
    q = np.array([0.2, -0.6, 0.3, -1.9, 0.2, 1.7, 0.9])
    T = kin.fk(robot, q)
    limits = [None] * 7
    limits[3] = [1.0, 1.05] if robot.upper[3] > 1.05 else [-0.2, -0.15]
    result = kin.solve_ik(robot, T, limits=limits)
    assert (result.status, result.cause) == (Status.LIMITS, "joint limits")
    assert result.blocked
    assert all(4 in {v.joint + 1 for v in posture.violations} for posture in result.blocked)


@pytest.mark.full
def test_the_ranges_of_a_result_are_those_of_all_branches():
    """At each of 600 values inside them there is a solution, and at one outside there is none."""
    rng = np.random.default_rng(1)
    disagree = further = 0
    for q in SAWYER.random_q(rng, 20):
        T = kin.fk(SAWYER, q)
        result = kin.solve_ik(SAWYER, T)
        ranges = result.redundancy[0].intervals
        own = [interval for s in result.solutions for interval in s.redundancy[0].intervals]
        for value in rng.uniform(SAWYER.lower[6], SAWYER.upper[6], 30).tolist():
            exists = kin.solve_ik(SAWYER, T, redundancy={"theta7": value}).status == "solved"
            disagree += exists != any(low <= value <= high for low, high in ranges)
            further += exists and not any(low <= value <= high for low, high in own)
    assert disagree == 0
    assert further > 100  # values that the ranges of the best posture alone do not have


def test_what_is_agreed_is_all_that_a_scan_finds():
    """At 300 values, which share no following of self-motions with the answer."""
    form, rng = closed_form_of(SAWYER), np.random.default_rng(12)
    values = np.linspace(SAWYER.lower[6], SAWYER.upper[6], 302)[1:-1]
    for q in SAWYER.random_q(rng, 4):
        T = kin.fk(SAWYER, q)
        result, sweep = kin.solve_ik(SAWYER, T), form.sweep(problem_at(SAWYER, T))
        rows = kin.ik_branches(SAWYER, np.broadcast_to(T, (len(values), 4, 4)), values)
        inside = ((rows - SAWYER.lower) % (2 * PI) <= SAWYER.upper - SAWYER.lower).all(axis=2)
        claimed = [any(low <= value <= high for low, high in result.redundancy[0].intervals) for value in values]
        assert result.completeness == "agreed"
        assert np.array_equal(inside.any(axis=1), claimed)
        assert np.array_equal(inside.sum(axis=1), general7.closed_form._counts(sweep.ranges, values))
        assert sweep.have(np.ascontiguousarray(rows[inside]))


def test_what_only_one_of_two_ways_finds_is_not_agreed(monkeypatch):
    T = kin.fk(SAWYER, SAWYER.random_q(np.random.default_rng(12)))
    form, asked = closed_form_of(SAWYER), problem_at(SAWYER, T)
    assert form.solve(asked).completeness == "agreed"
    solved = form._at

    def with_a_gap(problem, values):
        rows = solved(problem, values)
        rows[3:-3:5] = math.nan
        return rows

    monkeypatch.setattr(form, "_at", with_a_gap)
    assert form.solve(asked).completeness == "searched"
    monkeypatch.setattr(form, "_at", solved)
    monkeypatch.setattr(general7.closed_form, "_VALUES", 1)  # the motions through few solutions are not all
    assert form.solve(asked).completeness == "searched"


def test_an_answer_does_not_keep_the_points_of_self_motions(monkeypatch):
    """They take megabytes, and batches keep an answer for each of their targets."""
    form, swept, seen = closed_form_of(SAWYER), closed_form_of(SAWYER).sweep, []

    def watched(problem):
        sweep = swept(problem)
        seen.append(weakref.ref(sweep.motions))
        return sweep

    monkeypatch.setattr(form, "sweep", watched)
    found = form.solve(problem_at(SAWYER, kin.fk(SAWYER, SAWYER.random_q(np.random.default_rng(14)))))
    assert [motions() for motions in seen] == [None]
    assert len(found.further())
    assert len(seen) == 1  # nothing is searched again


def swept_by_joint_1():
    """Sawyer's solver with the search over the values of joint 1, as that of a calibrated arm."""
    form = general7.General7(SAWYER, 6, closed_form_of(SAWYER).form)
    form.sweeper = general7.General7(SAWYER, 0, closed_form_of(fixed(SAWYER, {0: 0.0})))
    return form


def test_the_intervals_of_a_motion_that_is_lost_are_searched_for_again(monkeypatch):
    form, values = swept_by_joint_1(), np.linspace(SAWYER.lower[6], SAWYER.upper[6], 302)[1:-1]
    T = kin.fk(SAWYER, SAWYER.random_q(np.random.default_rng(12)))
    asked = problem_at(SAWYER, T)
    whole, found, made, plain = form.solve(asked).further(), form.solve(asked), [], form._motions

    def first_lost(problem):
        motions = plain(problem)
        if not made:
            motions.follow = lambda starts: (np.empty((0, 3)), np.empty((0, 3, 7)), np.ones(len(starts), bool))
        made.append(motions)
        return motions

    monkeypatch.setattr(form, "_motions", first_lost)
    claimed = [general7.closed_form._counts(each, values) > 0 for each in (whole, found.further())]
    assert claimed[0].any()
    assert np.array_equal(*claimed)


@pytest.mark.parametrize("seed", [9, 59])
def test_the_value_of_what_is_least_outside_is_one_that_the_given_joint_may_have(seed):
    """The search over joint 1 finds it where joint 7 is outside: at the end of its range are others, or none."""
    form, q = swept_by_joint_1(), SAWYER.random_q(np.random.default_rng(seed))
    lower, upper = SAWYER.lower.copy(), SAWYER.upper.copy()
    lower[3], upper[3] = q[3] + 0.3, q[3] + 0.4
    lower[6], upper[6] = q[6] - 0.2, q[6] + 0.2
    asked = SolverInput(kin.fk(SAWYER, q), POSE, (math.nan,), True, SAWYER.q_home, lower, upper)
    found = form._outside(asked, form.solve(asked).q)
    assert 0.0 < found.min() <= form.sweep(asked).outside.min() + 1e-9


@pytest.mark.parametrize(("nominal", "count"), [(SAWYER, 12), (PANDA, 48)], ids=["close", "far"])
def test_only_a_nominal_arm_that_is_close_leaves_values_out(nominal, count, monkeypatch):
    form, tried = general7.General7(SAWYER, 6, closed_form_of(SAWYER).form), []
    form.nominal = closed_form_of(nominal)
    solved = form._at
    monkeypatch.setattr(
        form, "_at", lambda problem, values: (tried.append(len(values)), solved(problem, values))[1]
    )
    T = kin.fk(SAWYER, SAWYER.random_q(np.random.default_rng(12)))
    assert len(form.nominal.solve(problem_at(SAWYER, T)).arcs[0])
    assert form.sweep(problem_at(SAWYER, T)).agreed
    assert tried == [count + 1]  # and the seed's value


@pytest.mark.parametrize("row", [8, 20])
def test_no_narrow_best_value_is_passed_over(row):
    """Against thousands of values; with fewer samples and peaks the answer was 1.5 % short of the best."""
    values = np.linspace(SAWYER.lower[6], SAWYER.upper[6], 3000)
    T = kin.fk(SAWYER, SAWYER.random_q(np.random.default_rng(4), 40)[row])
    result = kin.solve_ik(SAWYER, T, prefer="manipulability")
    best = preferences._best_at(problem_of(SAWYER, T, prefer="manipulability"), values).max()
    assert kin.manipulability(SAWYER, result.best.q) >= (1.0 - 1e-5) * best


@pytest.mark.parametrize("prefer", ["limits", "manipulability"])
@pytest.mark.parametrize("robot", [PANDA, SAWYER], ids=lambda robot: robot.id)
def test_a_preference_is_met_by_the_best_of_the_whole_family(robot, prefer):
    rng = np.random.default_rng(5)
    form = closed_form_of(robot)
    values = np.linspace(robot.lower[form.given], robot.upper[form.given], 400)
    for _ in range(2):
        T = kin.fk(robot, robot.random_q(rng))
        problem = problem_of(robot, T, prefer=prefer)
        result = kin.solve_ik(robot, T, prefer=prefer)
        rows = kin.ik_branches(robot, np.broadcast_to(T, (len(values), 4, 4)), values).reshape(-1, 7)
        q, stats = preferences.centred(problem, rows)
        best = preferences.scores(problem, q[(stats[:, 3] == 0.0) & ~np.isnan(q[:, 0])]).max()
        assert preferences.scores(problem, result.solutions[0].q[None])[0] >= 0.99 * best


def test_only_named_branches_can_be_requested():
    q = np.array([0.2, -0.6, 0.3, -2.1, 0.2, 1.7, 0.9])
    result = kin.solve_ik(PANDA, kin.fk(PANDA, q), q_seed=q, branch="seed")
    assert {s.branch for s in result.solutions} == {kin.branch_of(PANDA, q)}
    assert kin.branch_names(SAWYER) == ()
    with pytest.raises(InputError, match="have no names"):
        kin.solve_ik(SAWYER, kin.fk(SAWYER, q), branch="elbow up")


def test_arms_of_another_kind_are_left_alone():
    slide = replace(PANDA, rows=(replace(PANDA.rows[0], kind="prismatic"), *PANDA.rows[1:]))
    for robot in (slide, eight_joints(PANDA), kin.get_robot("ur5")):
        assert offset7.match(robot) is None
        assert general7.match(robot, closed_form_of, closed_form_of) is None


@robots
def test_an_approach_direction_leaves_two_parameters(robot):
    first = "theta1" if robot is GEN3 else "roll"
    rng = np.random.default_rng(8)
    inside = 0
    for _ in range(6):
        q = robot.random_q(rng)
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T, task="approach", q_seed=q)
        assert (result.status, result.completeness) == (
            Status.SOLVED,
            "agreed" if robot is SAWYER else "searched",
        )
        assert [r.name for r in result.redundancy] == [first, "theta7"]
        assert np.abs(result.solutions[0].q - q).max() < 1e-6
        for s in result.solutions:
            assert np.abs(kin.fk(robot, s.q)[:3, 2:] - T[:3, 2:]).max() < 1e-9
            low, high = next(x for x in s.redundancy[0].intervals if x[0] <= s.redundancy[0].value <= x[1])
            for value in np.linspace(low, high, 5)[1:-1].tolist():
                wanted = {first: value, "theta7": float(s.q[6])}
                found = kin.solve_ik(robot, T, task="approach", q_seed=s.q, redundancy=wanted)
                assert found.status is Status.SOLVED
                assert found.solutions[0].redundancy[0].value == pytest.approx(value)
                assert found.solutions[0].q[6] == pytest.approx(s.q[6])
                inside += 1
    assert inside > 20


def test_the_rolls_of_an_approach_are_those_at_which_there_is_a_posture():
    """Also on branches that none of the answer's postures is on."""
    rng, rolls, further = np.random.default_rng(13), np.linspace(-PI, PI, 182)[1:-1], 0
    for q in SAWYER.random_q(rng, 3):
        T = kin.fk(SAWYER, q)
        result = kin.solve_ik(SAWYER, T, task="approach", q_seed=q)
        turned = np.tile(T, (len(rolls), 1, 1))
        turned[:, :3, 0] = np.cos(rolls)[:, None] * T[:3, 0] + np.sin(rolls)[:, None] * T[:3, 1]
        turned[:, :3, 1] = np.cos(rolls)[:, None] * T[:3, 1] - np.sin(rolls)[:, None] * T[:3, 0]
        rows = kin.ik_branches(SAWYER, turned, result.redundancy[1].value)
        inside = ((rows - SAWYER.lower) % (2 * PI) <= SAWYER.upper - SAWYER.lower).all(axis=2).any(axis=1)
        intervals = result.redundancy[0].intervals
        own = [interval for s in result.solutions for interval in s.redundancy[0].intervals]
        claimed = [any(low <= roll <= high for low, high in intervals) for roll in rolls]
        assert all(-PI <= low <= high <= PI for low, high in intervals)
        assert np.array_equal(inside, claimed)
        further += sum(claimed) - sum(any(low <= roll <= high for low, high in own) for roll in rolls)
    assert further > 0


def test_an_approach_whose_values_were_searched_by_a_preference_is_not_agreed():
    q = SAWYER.random_q(np.random.default_rng(8))
    given = {"theta7": float(q[6])}
    result = kin.solve_ik(SAWYER, kin.fk(SAWYER, q), task="approach", q_seed=q, prefer="limits", redundancy=given)
    assert (result.status, result.completeness) == (Status.SOLVED, "searched")


def test_a_tool_that_points_against_the_last_axis_rolls_the_other_way():
    robot = replace(PANDA, id="turned", tool=nested(PANDA.T_last_tool @ np.diag([1.0, -1.0, -1.0, 1.0])))
    q = np.array([0.2, -0.6, 0.3, -1.9, 0.2, 1.7, 0.9])
    T = kin.fk(robot, q)
    for roll in (-0.05, 0.05):
        found = kin.solve_ik(robot, T, task="approach", q_seed=q, redundancy={"roll": roll})
        R = T[:3, :3].T @ kin.fk(robot, found.solutions[0].q)[:3, :3]
        assert math.atan2(R[1, 0], R[0, 0]) == pytest.approx(roll)


# -- a locked joint -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", [*map(kin.get_robot, ("iiwa14", "redundant7-craig")), PANDA, SAWYER], ids=repr)
@pytest.mark.parametrize("joint", [0, 1, 2, 4, 5, 6])
def test_an_arm_with_a_locked_joint_has_all_postures_and_no_free_parameter(robot, joint):
    rng = np.random.default_rng(joint)
    named_first = []
    for _ in range(4):
        q = robot.random_q(rng)
        locked = [None] * 7
        locked[joint] = float(q[joint])
        T = kin.fk(robot, q)
        result = kin.solve_ik(robot, T, locked=locked)
        assert result.status is Status.SOLVED
        assert result.complete
        assert not result.details.redundant
        assert all(s.q[joint] == pytest.approx(q[joint], abs=1e-9) for s in result.solutions)
        assert min(apart(s.q, q) for s in result.solutions) < 1e-6
        again = kin.solve_ik(robot, T, locked=locked, q_seed=q)
        assert len(again.solutions) == len(result.solutions)
        named_first += [s.branch == kin.branch_of(robot, s.q) for s in result.solutions if kin.branch_names(robot)]
    assert all(named_first)


def test_the_branches_of_a_locked_arm_can_be_requested():
    robot = kin.get_robot("iiwa14")
    rng = np.random.default_rng(3)
    several = 0
    for _ in range(10):
        q = robot.random_q(rng)
        locked = [None, None, float(q[2]), *[None] * 4]
        result = kin.solve_ik(robot, kin.fk(robot, q), q_seed=q, locked=locked, branch="seed")
        assert {s.branch for s in result.solutions} == {kin.branch_of(robot, q)}
        assert result.details.chosen_branches == 1
        several += len(result.solutions) > 1
    assert several > 1
    with pytest.raises(InputError, match="with these joints locked"):
        kin.solve_ik(robot, kin.fk(robot, q), locked=locked, redundancy=0.3)


def test_a_lock_that_does_not_remove_the_redundancy_keeps_it():
    robot = kin.get_robot("iiwa14")
    q = robot.random_q(np.random.default_rng(4))
    locked = [None, None, None, float(q[3]), None, None, None]
    result = kin.solve_ik(robot, kin.fk(robot, q), locked=locked)
    assert result.status is Status.SOLVED
    assert [r.name for r in result.redundancy] == ["psi"]


@pytest.mark.parametrize("joint", [0, 1, 2, 4, 5, 6])
def test_a_table_with_a_joint_fixed_has_all_postures(joint):
    """Two axes meet where three met: from base to tool some cuts are degenerate, from tool to base others."""
    robot = fixed(kin.get_robot("iiwa14"), {joint: 0.4})
    q = np.random.default_rng(joint).uniform(-math.pi, math.pi, (100, 6))
    rows = kin.ik_branches(robot, kin.fk(robot, q))
    found = np.nan_to_num(np.abs((rows - q[:, None] + math.pi) % (2 * math.pi) - math.pi).max(axis=2), nan=9.0)
    assert (found.min(axis=1) > 1e-6).sum() <= 1
    assert ((~np.isnan(rows[:, :, 0])).sum(axis=1) == 8).sum() >= 98


def on_a_rail(name):
    """A built-in arm on a rail, and the locks that hold the rail at 0.2 m."""
    arm = kin.get_robot(name)
    rail = kin.Joint("rail", kind="prismatic", limits=(-1.0, 1.0))
    robot = replace(arm, id=f"railed-{name}", rows=(rail, *arm.rows), home=(0.0, *arm.home))
    return robot, (0.2, *[None] * 6)


def test_singularities_of_a_locked_arm_name_its_own_joints():
    robot, locked = on_a_rail("puma560")
    form = form_with_locked(robot, locked)
    found = form.singularities(np.array([0.2, *robot.q_home[1:]]))
    assert {at.joint for s in found for at in s.met_at} == {3, 5}


def test_the_batch_kernels_of_a_locked_arm_are_its_own():
    robot, rail = on_a_rail("irb120")
    iiwa, single = kin.get_robot("iiwa14"), (None, None, 0.3, *[None] * 4)
    for arm, locked in ((robot, rail), (iiwa, single), (iiwa, (0.3, *[None] * 6)), (PANDA, (0.3, *[None] * 6))):
        form = form_with_locked(arm, locked)
        q = arm.random_q(np.random.default_rng(1))
        q = np.array([x if value is None else value for x, value in zip(q, locked, strict=True)])
        T, out = kin.fk(arm, np.stack([q, q])), np.empty((2, len(form.branches), arm.n))
        form.kernels.many(form.kernels.params, T, np.array([math.nan]), q, out)
        assert np.array_equal(out[0], out[1], equal_nan=True)
        rows = out[0][~np.isnan(out[0][:, 0])]
        assert np.abs(kin.fk(arm, rows) - T[0]).max() < 1e-9
        assert apart(rows, q).min() < 1e-6
        T[0, 0, 3] = math.inf
        assert not form.kernels.one(form.kernels.params, T[0], math.nan, q, out[0])


def test_a_preference_is_kept_at_a_singular_target_of_a_locked_arm():
    arm = kin.get_robot("irb120")
    q = np.array([0.9, 0.0, 0.6, 0.4, 0.7, 0.2])

    def beside_axis_1(joint2):
        q[1] = joint2
        return next(s.distance for s in kin.singularities(arm, q) if s.kind == "shoulder")

    # The wrist centre on axis 1: joint 1 is free.
    tried = np.linspace(-1.5, 1.0, 2001)
    low, high = (tried[np.argmin([beside_axis_1(x) for x in tried])] + step for step in (-2e-3, 2e-3))
    for _ in range(200):
        third = (high - low) / 3.0
        low, high = (
            (low, high - third)
            if beside_axis_1(low + third) < beside_axis_1(high - third)
            else (low + third, high)
        )
    assert beside_axis_1(low) < 1e-12
    robot, locked = on_a_rail("irb120")
    whole = np.array([0.2, *q])
    T, found = kin.fk(robot, whole), []
    for start in (-2.0, 2.0):  # outside what the limits allow, and near its end
        whole[1] = start
        found.append(kin.solve_ik(robot, T, prefer="limits", q_seed=whole, locked=locked))
        assert found[-1].redundancy[0].name == "theta2"
    assert np.ptp([result.best.q[1] for result in found]) < 1e-3


@named
def test_the_configuration_of_the_seed_is_found_however_narrow_its_range(robot):
    q = robot.random_q(np.random.default_rng(21), 300)
    for own, T in zip(q, kin.fk(robot, q), strict=True):
        assert kin.solve_ik(robot, T, q_seed=own).solutions[0].distance < 1e-6


def ranges_missed(count, seed, rows=slice(None)):
    """Panda's configurations whose given joint is in no range of their branch, asked for from the home pose."""
    q = PANDA.random_q(np.random.default_rng(seed), count)[rows]
    form, missed = closed_form_of(PANDA), 0
    for own, T in zip(q, kin.fk(PANDA, q), strict=True):
        asked = SolverInput(T, POSE, (math.nan,), True, PANDA.q_home, PANDA.lower, PANDA.upper)
        arcs = form.solve(asked).arcs[0]
        there = (arcs[:, 0] == form.branch_of(own)) & (arcs[:, 1] < own[6] + 1e-6) & (own[6] - 1e-6 < arcs[:, 2])
        missed += not there.any()
    return missed


def test_ranges_narrower_than_the_samples_are_found_from_a_foreign_seed():
    # Between the end of the reach and a limit, between two limits, or between two ends of the reach.
    assert ranges_missed(3000, 1, [3, 195, 811, 966, 1205, 1249, 1522, 1629, 1918, 2045, 2142]) == 0
    assert ranges_missed(12000, 2, [310, 484, 618, 879, 1426, 6544, 9570, 9577, 11193, 11351]) == 0


@pytest.mark.slow
def test_no_range_is_missed_from_a_foreign_seed():
    assert ranges_missed(20_000, 3) == 0


def test_a_branch_between_the_samples_of_narrow_limits_is_no_obstacle():
    rng = np.random.default_rng(0)
    elbow = closed_form_of(PANDA).geometry
    straight = elbow.sign[3] * (elbow.elbow - elbow.offset[3])  # almost all of the reach: short self-motions
    for _ in range(1500):
        q = PANDA.random_q(rng)
        q[3] = straight + rng.uniform(-1.0, 1.0) * 10.0 ** rng.uniform(-4.0, -1.5)
        low = float(q[6] - rng.uniform(0.0, 0.1))
        lower, upper = PANDA.lower.copy(), PANDA.upper.copy()
        lower[6], upper[6] = low, low + 0.1
        found = closed_form_of(PANDA).solve(
            SolverInput(kin.fk(PANDA, q), POSE, (math.nan,), True, PANDA.q_home, lower, upper)
        )
        assert (found.obstacle is not None) == (found.gap > 0.0)


def test_the_range_of_an_unlimited_given_joint_is_a_turn_around_the_seed():
    robot = replace(GEN3, id="unlimited", rows=(replace(GEN3.rows[0], limits=None), *GEN3.rows[1:]))
    rng = np.random.default_rng(0)
    for _ in range(100):
        q = robot.random_q(rng)
        seed = q + np.array([-0.1, *[0.0] * 6])
        q[0], seed[0] = PI + 0.05, PI - 0.05
        found = kin.solve_ik(robot, kin.fk(robot, q), q_seed=seed, branch="seed")
        assert min(abs(s.q[0] - seed[0]) for s in found.solutions) <= 0.1 + 1e-9


def test_a_fixed_joint_has_no_limits_of_any_kind():
    peaks = {"velocity": 2.0, "acceleration": 5.0, "jerk": 50.0, "effort": 50.0}
    rows = tuple(replace(row, **peaks) if row.limits else row for row in SAWYER.rows)
    limited = replace(SAWYER, rows=rows)
    assert closed_form_of(limited) is not None
    row = fixed(limited, {2: 0.3}).rows[limited.joint_rows[2]]
    assert (row.kind, row.limits, row.velocity, row.acceleration, row.jerk, row.effort) == ("fixed", *5 * [None])


def test_an_arm_on_a_rail_has_all_postures_at_a_value_of_the_rail():
    """As a whole it goes to descents, which say that they may miss postures."""
    ur5 = kin.get_robot("ur5")
    rail = kin.Joint("rail", 0.0, 0.1, 0.0, PI / 2, limits=(0.0, 2.0), kind="prismatic")
    robot = replace(ur5, id="rail", rows=(rail, *ur5.rows), home=(0.5, *ur5.home))
    for q in robot.random_q(np.random.default_rng(0), 5):
        T = kin.fk(robot, q)
        whole = kin.solve_ik(robot, T)
        assert (whole.status, whole.solver, whole.completeness) == (Status.SOLVED, "numeric", "unknown")
        assert whole.redundancy == ()
        found = kin.solve_ik(robot, T, locked=[float(q[0]), *[None] * 6])
        assert found.completeness == "proved"
        assert min(apart(s.q, q) for s in found.solutions) < 1e-8
        assert all(np.abs(kin.fk(robot, s.q) - T).max() < 1e-9 for s in found.solutions)
