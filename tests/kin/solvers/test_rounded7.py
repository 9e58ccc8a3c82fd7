"""Typed tables with seven joints, judged by a dense search of their own postures (`dense7`)."""

from __future__ import annotations

import math
import os
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from arms import GEN3, XARM7
from dense7 import Chain, postures, width

import kin
from kin import Status
from kin.solvers import closed_form_of
from kin.solvers.rounded import Rounded

PI = math.pi
# Targets of each arm in the campaign under `-m slow`; each takes a dense search of some seconds.
TARGETS = int(os.environ.get("KINBOARD_CAMPAIGN", "1000"))
PANDA = kin.get_robot("panda")
EXAMPLE = np.array((-2.72143, -1.32953, 2.70694, -1.0972, -0.41593, 1.957, 2.16028))


def typed(robot, quarter):
    """The table with right angles typed as `quarter`, and 180° as twice that."""

    def rounded(angle):
        turns = round(angle / (PI / 2))
        return turns * quarter if abs(angle - turns * PI / 2) < 1e-9 else angle

    rows = tuple(replace(row, alpha=rounded(row.alpha), theta=rounded(row.theta)) for row in robot.rows)
    return replace(robot, id=f"{robot.id} {quarter}", rows=rows)


def urdf(name, quarter, origins, limits):
    """An arm from a URDF with these origins (xyz, roll) and limits; right angles are typed as `quarter`."""
    joints = "".join(
        f'<link name="l{i + 1}"/><joint name="j{i + 1}" type="revolute">'
        f'<origin xyz="{xyz}" rpy="{roll * quarter} 0 0"/><axis xyz="0 0 1"/>'
        f'<parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint>'
        for i, ((xyz, roll), (low, high)) in enumerate(zip(origins, limits, strict=True))
    )
    robot = kin.load_robot(f'<robot name="{name}"><link name="l0"/>{joints}</robot>')
    return replace(robot, id=f"{name} {quarter}")


_XARM = (
    [
        ("0 0 0.267", 0),
        ("0 0 0", -1),
        ("0 -0.293 0", 1),
        ("0.0525 0 0", 1),
        ("0.0775 -0.3425 0", 1),
        ("0 0 0", 1),
        ("0.076 0.097 0", -1),
    ],
    [
        (-6.2832, 6.2832),
        (-2.059, 2.0944),
        (-6.2832, 6.2832),
        (-0.19198, 3.927),
        (-6.2832, 6.2832),
        (-1.69297, 3.1416),
        (-6.2832, 6.2832),
    ],
)
_RM75 = (
    [
        ("0 0 0.2405", 0),
        ("0 0 0", -1),
        ("0 -0.256 0", 1),
        ("0 0 0", -1),
        ("0 -0.21 0", 1),
        ("0 0 0", -1),
        ("0 -0.144 0", 1),
    ],
    [
        (-3.106, 3.106),
        (-2.269, 2.269),
        (-3.106, 3.106),
        (-2.356, 2.356),
        (-3.106, 3.106),
        (-2.234, 2.234),
        (-6.283, 6.283),
    ],
)
# A spherical shoulder, and offsets at elbow and wrist.
_GEN72 = (
    [
        ("0 0 0.218", 0),
        ("0 0 0", -1),
        ("0 -0.28 0", 1),
        ("0.04 0 0", -1),
        ("-0.019 -0.2525 0", 1),
        ("0 0 0", -1),
        ("0.0678 -0.1 0", 1),
    ],
    [(-3.0, 3.0), (-1.832, 1.832), (-3.0, 3.0), (-2.879, 0.959), (-3.0, 3.0), (-1.658, 1.779), (-6.283, 6.283)],
)


def arm_named(name):
    """An arm of the campaign and the exact one it stands for."""
    kind, _, digits = name.partition(" ")
    quarter, makers = float(digits), {"xarm7-urdf": _XARM, "rm75-urdf": _RM75, "gen72-urdf": _GEN72}
    if kind in makers:
        return urdf(kind, quarter, *makers[kind]), urdf(kind, 0.5 * PI, *makers[kind])
    exact = {"gen3": GEN3, "xarm7": XARM7}.get(kind) or kin.get_robot(kind)
    return typed(exact, quarter), exact


CAMPAIGN = (
    "panda 1.57",
    "panda 1.571",
    "panda 1.5708",
    "panda 1.570796",
    "xarm7 1.571",
    "xarm7-urdf 1.5708",
    "gen3 1.57",
    "gen3 1.5708",
    "gen72-urdf 1.5708",
    "gen72-urdf 1.571",
    "rm75-urdf 1.5708",
    "iiwa14 1.57",
    "iiwa14 1.5708",
    "redundant7-craig 1.5708",
    "redundant7 1.5708",
)
arms = pytest.mark.parametrize("name", CAMPAIGN)


def given_joint(robot):
    """The joint whose values the search holds: that of the redundancy parameter, or joint 3 for an arm angle."""
    joint = closed_form_of(robot).redundancies(0)[0].joint
    return joint if joint >= 0 else 2


class Judge:
    """What an arm's answers miss of what a dense search finds."""

    def __init__(self, name):
        self.robot, self.exact = arm_named(name)
        self.form = closed_form_of(self.robot)
        assert isinstance(self.form, Rounded)
        self.chain, self.joint = Chain(self.robot), given_joint(self.robot)
        self.by_joint = self.form.redundancies(0)[0].joint >= 0

    def postures(self, T, q, rng, values=50, random=200):
        """Those inside the limits ``(k, 7)``, found by descents from random starts and from the exact arm's."""
        low, high = max(-PI, self.chain.lower[self.joint]), min(PI, self.chain.upper[self.joint])
        held = np.linspace(low, high, values)
        starts = [q[None]]
        asked = held if self.by_joint else np.linspace(-PI, PI, values)
        near = kin.ik_branches(self.exact, np.repeat(T[None], values, axis=0), asked).reshape(-1, 7)
        starts.append(near[~np.isnan(near[:, 0])])
        return postures(self.chain, T, self.joint, held, np.concatenate(starts), rng, random)

    def lists(self, T, result, q):
        """Whether an answer has a posture ``(7,)`` in an interval of its branch, or where branches merge."""
        branch = kin.branch_names(self.robot)[self.form.branch_of(q)]
        if self.by_joint:
            own = [s for s in result.solutions if s.branch == branch]
            if any(self._holds(s, float(q[self.joint])) for s in own):
                return True
            others = [s for s in result.solutions if self._holds(s, float(q[self.joint]))]
            asked = {result.redundancy[0].name: float(q[self.joint])} if result.redundancy else {}
        else:
            own = others = list(result.solutions)
            asked = {"psi": self.arm_angle(q)}
            # The straighter the elbow, the less its direction says: ψ of the family and of the table differ more.
            slack = max(100.0, 3.0 / abs(math.sin(q[3]))) * self.form.off
            own = [s for s in own if s.branch == branch and self._holds(s, asked["psi"], slack)]
            if own:
                return True
        if not others or not asked:
            return False
        # Beside a fold branches merge, and which one a posture is on is a matter of rounding.
        there = kin.solve_ik(self.robot, T, q_seed=q, redundancy=asked)
        names = {s.branch for s in others}
        return any(s.branch in names and _apart(s.q, q) < 1e-5 for s in there.solutions)

    def arm_angle(self, q):
        """ψ of a posture: the direction of the elbow around the line from the shoulder to the wrist.

        The family's ψ differs by the rounding.
        """
        points, z = self.chain.axes(q)
        shoulder, elbow, wrist = points[1], points[3], points[5]
        u = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
        e2 = np.cross(u, z[0])
        e2 /= np.linalg.norm(e2)
        r = elbow - shoulder
        return math.atan2(r @ e2, r @ np.cross(e2, u))

    def beyond(self, T, result, values=9):
        """Values inside the listed intervals at which the branch has no posture inside the limits."""
        found = []
        for solution in result.solutions:
            for low, high in solution.redundancy[0].intervals:
                for value in (low + np.linspace(0.05, 0.95, values) * (high - low)).tolist():
                    there = kin.solve_ik(self.robot, T, redundancy=value, branch=solution.branch)
                    if there.status is not Status.SOLVED:
                        found.append((solution.branch, value))
        return found

    def _holds(self, solution, value, slack=1e-7):
        return any(
            low - slack <= value + turn <= high + slack
            for parameter in solution.redundancy
            for low, high in parameter.intervals
            for turn in (-2 * PI, 0.0, 2 * PI)
        )

    def count(self, targets, seed, values=50, random=200):
        """Targets with a missing posture, with a missing branch, with a false claim, and incomplete answers.

        Also those of complete answers that list values at which there is no posture.
        """
        rng, found = np.random.default_rng(seed), Counter()
        for q in self.robot.random_q(np.random.default_rng(seed), targets):
            T = kin.fk(self.robot, q)
            result = kin.solve_ik(self.robot, T)
            found["incomplete"] += result.completeness == "unknown"
            names = {s.branch for s in result.solutions}
            missing = [
                p
                for p in self.postures(T, q, rng, values, random)
                if not self.lists(T, result, p) and width(self.chain, T, p, self.joint) >= 1e-3
            ]
            found["posture"] += bool(missing)
            lost = {kin.branch_names(self.robot)[self.form.branch_of(p)] for p in missing} - names
            found["branch"] += bool(lost)
            found["false"] += bool(missing) and result.completeness != "unknown"
            beyond = self.beyond(T, result) if result.completeness != "unknown" else []
            found["beyond"] += bool(beyond)
            if beyond:
                print(self.robot.id, "lists too much", q.tolist(), beyond[:2])
            if missing:
                print(self.robot.id, "misses", q.tolist(), [p.tolist() for p in missing[:2]])
        return found


def _apart(a, b):
    return np.abs((a - b + PI) % (2 * PI) - PI).max()


def test_the_example_has_the_branches_and_the_interval_of_the_exact_arm():
    robot = typed(PANDA, 1.5708)
    found = kin.solve_ik(robot, kin.fk(robot, EXAMPLE))
    exact = kin.solve_ik(PANDA, kin.fk(PANDA, EXAMPLE))
    assert found.completeness != "unknown"
    assert {s.branch for s in found.solutions} == {s.branch for s in exact.solutions}
    assert len(found.solutions) == 4
    (interval,) = found.redundancy[0].intervals
    assert interval == pytest.approx((1.7395607, 2.4046360), abs=1e-6)
    assert interval == pytest.approx(exact.redundancy[0].intervals[0], abs=1e-6)


@pytest.mark.parametrize("respect_limits", [True, False])
def test_between_the_folds_of_the_two_tables_both_postures_at_a_value_are_found(respect_limits):
    robot = typed(PANDA, 1.57)  # the exact arm's fold is at 0.50229, that of the table as entered at 0.502419
    T = kin.fk(robot, (-1.80932, -0.85776, -0.03083, -1.0881, 1.46089, 2.70858, -0.9246))
    folds = [i.redundancy[0].intervals[-1][1] for i in kin.solve_ik(robot, T).solutions if "back" in i.branch]
    assert folds[0] == pytest.approx(folds[1], abs=1e-9)
    apart = []
    for value in folds[0] - np.geomspace(1e-3, 1e-7, 9):
        found = kin.solve_ik(robot, T, redundancy=value, respect_limits=respect_limits)
        assert found.completeness != "unknown"
        back = {s.branch.rpartition(" ")[2]: s.q for s in found.solutions if "back" in s.branch}
        apart.append(back["negative"][0] - back["positive"][0])
    # Beside a fold two postures are apart by the root of the distance.
    assert apart[::2] == pytest.approx(apart[0] * 10.0 ** -np.arange(0.0, 2.5, 0.5), rel=0.05)


@pytest.mark.full
def test_intervals_whose_postures_are_all_beside_folds_belong_to_their_branches():
    robot, _ = arm_named("gen3 1.57")
    T = kin.fk(robot, (1.51258, -0.24395, -2.48770, -0.26665, -1.54266, 2.22576, 1.43931))
    found = kin.solve_ik(robot, T)
    assert found.completeness != "unknown"
    for solution in found.solutions:
        for low, high in solution.redundancy[0].intervals:
            for value in np.linspace(low, high, 7)[1:-1].tolist():
                there = kin.solve_ik(robot, T, redundancy=value, branch=solution.branch)
                assert there.status is Status.SOLVED, (solution.branch, value)


def test_a_short_interval_between_two_folds_has_every_branch_at_each_value():
    robot, _ = arm_named("xarm7 1.571")
    q = (-3.76229, -0.52417, -6.23626, 3.22697, -4.34217, -0.39924, 4.77939)
    T = kin.fk(robot, q)  # on 2.4 mrad of θ7 the elbow turns by more than a radian
    (span,) = {
        (round(low, 6), round(high, 6))
        for s in kin.solve_ik(robot, T).solutions
        for low, high in s.redundancy[0].intervals
        if high - low < 0.01 and low < 0.0
    }
    assert span == pytest.approx((-1.506149, -1.503710), abs=2e-6)
    for share in (1e-3, 1e-2, 0.1, 0.5, 0.9, 0.99, 0.999):
        found = kin.solve_ik(robot, T, redundancy=span[0] + share * (span[1] - span[0]))
        assert found.completeness != "unknown"
        assert {s.branch for s in found.solutions} == set(kin.branch_names(robot))


def test_a_posture_beside_a_singular_wrist_is_found_at_each_value():
    robot, _ = arm_named("iiwa14 1.57")
    T = kin.fk(robot, (-1.196114, -1.353726, 2.868948, 1.587245, -1.41769, 0.329724, -2.732397))
    branch = "shoulder front · elbow positive · wrist no-flip"  # sin θ6 passes zero by 0.0023 on this interval
    (own,) = [s for s in kin.solve_ik(robot, T).solutions if s.branch == branch]
    low, high = own.redundancy[0].intervals[-1]
    assert high - low < 0.02
    for value in np.linspace(low, high, 41)[1:-1].tolist():
        found = kin.solve_ik(robot, T, redundancy=value, branch=branch)
        assert found.status is Status.SOLVED, value


@pytest.mark.parametrize("name", ["panda 1.5708", "panda 1.571", "xarm7-urdf 1.5708", "gen72-urdf 1.5708"])
def test_the_generating_configuration_is_found_with_the_given_joint_locked(name):
    robot, _ = arm_named(name)
    joint = given_joint(robot)
    for q in robot.random_q(np.random.default_rng(6), 20):
        locked = [float(q[i]) if i == joint else None for i in range(7)]
        found = kin.solve_ik(robot, kin.fk(robot, q), locked=locked)
        assert found.status is Status.SOLVED
        assert min(_apart(s.q, q) for s in found.solutions) < 1e-6
        assert all(s.q[joint] == q[joint] for s in found.solutions)


@pytest.mark.full
@arms
def test_no_posture_is_missing(name):
    found = Judge(name).count(2, seed=5, values=12, random=30)
    assert found["posture"] == found["false"] == found["beyond"] == 0


@pytest.mark.slow
@arms
def test_no_posture_is_missing_of_many_targets(name):
    found = Judge(name).count(TARGETS, seed=1)
    print(name, dict(found))
    assert found["posture"] == found["branch"] == found["false"] == found["beyond"] == 0


@pytest.mark.parametrize("name", ["panda 1.57", "panda 1.571"])
def test_a_branch_is_kept_whose_interval_ends_where_another_one_begins(name):
    """The middle of one of its two intervals is beyond the fold, on the other branch."""
    robot, exact = arm_named(name)
    q = np.array((-1.140407242, -0.163947841, -2.120581981, -1.861654815, -1.718358262, 0.971421293, 1.450763132))
    T = kin.fk(robot, q)
    found = kin.solve_ik(robot, T)
    assert {s.branch for s in found.solutions} == {s.branch for s in kin.solve_ik(exact, T).solutions}
    assert len(found.solutions) == 4
    for solution in found.solutions:
        assert np.abs(kin.fk(robot, solution.q) - T).max() < 1e-9
        (low, high), *_ = solution.redundancy[0].intervals
        assert low - 1e-3 <= solution.redundancy[0].value
        assert high - low > 0.4


def test_a_followed_interval_belongs_to_the_branch_of_its_posture_that_is_clear_of_folds():
    """An interval of one branch was taken for one of the other beyond its fold, which was then lost."""
    robot, exact = arm_named("gen72-urdf 1.571")
    q = np.array((-1.180831024, -0.170383733, -2.195749817, -1.331852358, -1.779268556, -0.756429049, 3.146082476))
    T = kin.fk(robot, q)
    found, meant = kin.solve_ik(robot, T), kin.solve_ik(exact, T)
    counts = [{s.branch: len(s.redundancy[0].intervals) for s in each.solutions} for each in (found, meant)]
    assert len(counts[0]) == 4
    assert counts[0] == counts[1]


@pytest.mark.parametrize(
    ("name", "q"),
    [
        # Followed intervals were known at another whole turn than their postures: three branches had no row.
        ("xarm7 1.571", (-2.17612, 0.919077, -2.260411, 2.665009, 0.484992, 2.59883, 2.932553)),
        # An interval was named by a posture beside a fold, and its branch lost to another one.
        ("gen3 1.57", (1.812197, 0.009301, -1.721985, -2.158063, 2.565146, 1.13676, -2.027949)),
        ("gen3 1.57", (-1.807653, 1.253057, -2.146223, -1.598254, -1.347517, 0.487404, 2.113698)),
        # Following a curve ended before it had come from outside the limits to its first interval.
        ("iiwa14 1.57", (2.464489, 0.713379, 1.144468, -1.408516, -2.825301, -1.819765, 2.837233)),
        # At a fold of the table as entered, the nominal arm has no row at all.
        ("xarm7-urdf 1.5708", (-5.798085, 0.856477, -0.54751, 3.505769, 4.212046, 0.168799, 5.952437)),
    ],
)
def test_followed_curves_keep_every_interval(name, q):
    judge, q = Judge(name), np.array(q)
    T = kin.fk(judge.robot, q)
    found, exact = kin.solve_ik(judge.robot, T), kin.solve_ik(judge.exact, T)
    assert found.completeness != "unknown"
    assert len(found.solutions) == len(exact.solutions) == 8
    dense = judge.postures(T, q, np.random.default_rng(3), values=25, random=40)
    assert len(dense) >= 30
    assert [p.tolist() for p in dense if not judge.lists(T, found, p)] == []


def test_a_branch_without_any_row_inside_the_limits_leaves_no_doubt():
    """A Panda's elbow that would have to bend backwards: rows beyond the limits need not meet the target."""
    robot, exact = arm_named("panda 1.5708")
    for q in robot.random_q(np.random.default_rng(2), 100):
        T = kin.fk(robot, q)
        found = kin.solve_ik(robot, T)
        assert found.completeness != "unknown"
        assert {s.branch for s in found.solutions} == {s.branch for s in kin.solve_ik(exact, T).solutions}


@pytest.mark.full
@pytest.mark.parametrize(("name", "target"), [("iiwa14 1.57", 40), ("iiwa14 1.57", 44), ("rm75-urdf 1.5708", 6)])
def test_followed_intervals_leave_out_what_a_step_passes(name, target):
    """A joint that lacks less of a whole turn than a step is long went out of its limits and in again unseen."""
    robot, _ = arm_named(name)
    T = kin.fk(robot, robot.random_q(np.random.default_rng(2), 60)[target])
    found = kin.solve_ik(robot, T)
    intervals = {s.branch: s.redundancy[0].intervals for s in found.solutions}
    outside = 0
    for psi in np.linspace(-PI + 1e-3, PI - 1e-3, 400):
        there = {s.branch for s in kin.solve_ik(robot, T, redundancy=float(psi)).solutions}
        claimed = {b for b, spans in intervals.items() if any(low <= psi <= high for low, high in spans)}
        assert there == claimed, psi
        outside += len(there) < 8
    assert outside > 20


def test_a_branch_is_listed_of_which_only_narrow_intervals_are_far_from_folds():
    """Two branches of a Gen3 meet at folds 3e-3 rad inside their limits; following the curves had lost one."""
    robot, exact = arm_named("gen3 1.57")
    q = np.array(
        (-0.9107511846, -1.4923641253, -0.1655527070, -1.6937266603, 1.8787194783, 0.5121045217, -1.3626296674)
    )
    found, meant = (kin.solve_ik(each, kin.fk(each, q)) for each in (robot, exact))
    assert {s.branch for s in found.solutions} == {s.branch for s in meant.solutions}
    assert len(found.solutions) == 8


@pytest.mark.full
@pytest.mark.parametrize(("seed", "target"), [(2, 41), (3, 23)])
def test_an_interval_has_gaps_that_the_nearby_exact_arm_hides(seed, target):
    """With wider limits the exact arm has one interval, with narrower ones the first part of it only."""
    judge = Judge("gen3 1.57")
    T = kin.fk(judge.robot, judge.robot.random_q(np.random.default_rng(seed), 60)[target])
    found = kin.solve_ik(judge.robot, T)
    assert found.completeness != "unknown"
    assert len(found.solutions) == 8
    assert judge.beyond(T, found, 60) == []


@pytest.mark.full
@pytest.mark.parametrize(
    "q",
    [
        (0.322045155, 0.501934879, -1.697468857, -2.274873744, -1.720549566, 1.386618580, -0.884839859),
        (-0.707108243, 0.375488532, 1.702363168, -1.677333702, -2.719872889, 1.022693079, 0.703666762),
    ],
)
def test_every_value_of_a_listed_interval_is_found_when_it_is_asked_for(q):
    """Also where the shoulder is nearly outstretched: a row there is far from that of the nominal arm."""
    judge = Judge("panda 1.57")
    T = kin.fk(judge.robot, np.array(q))
    found = kin.solve_ik(judge.robot, T)
    assert min(high - low for s in found.solutions for low, high in s.redundancy[0].intervals) < 0.5
    assert judge.beyond(T, found, 60) == []


@pytest.mark.full
@pytest.mark.parametrize("name", ["panda 1.5708", "iiwa14 1.57"])
def test_one_branch_at_each_value_is_that_of_all_branches_bit_for_bit(name):
    (robot, _), rng = arm_named(name), np.random.default_rng(9)
    form = closed_form_of(robot)
    T, values, branches = kin.fk(robot, robot.random_q(rng, 60)), rng.uniform(-2.0, 2.0, 60), np.arange(60) % 8
    found, every = form.rows_at(T, values, robot.q_home, branches), kin.ik_branches(robot, T, values)
    assert np.array_equal(found, every[np.arange(60), branches], equal_nan=True)
    there = ~np.isnan(found[:, 0])
    assert there.sum() > 15
    assert np.abs(kin.fk(robot, found[there]) - T[there]).max() < 1e-9


@pytest.mark.parametrize("name", ["gen3 1.57", "gen3 1.5708", "xarm7 1.571"])
def test_intervals_are_inside_the_range_of_a_joint_that_turns_all_the_way(name):
    robot, _ = arm_named(name)
    joint = given_joint(robot)
    low, high = robot.lower[joint], robot.upper[joint]
    across = 0
    for q in robot.random_q(np.random.default_rng(2), 30):
        found = kin.solve_ik(robot, kin.fk(robot, q))
        for solution in found.solutions:
            intervals = solution.redundancy[0].intervals
            assert all(low <= a <= b <= high for a, b in intervals)
            across += len(intervals) > 1 and (intervals[0][0], intervals[-1][1]) == (low, high)
    assert across > 5


def test_branches_of_a_rounded_table_are_kept_where_the_exact_arm_does_not_reach():
    """Where the shoulder's two branches merge, 3e-3 rad away, the exact arm misses the target by 4e-7 m."""
    judge = Judge("redundant7 1.5708")
    q = np.array((-1.21640234, -1.70789843, -1.56822525, 1.30920408, 1.99902314, 0.52566833, -0.27720542))
    T = kin.fk(judge.robot, q)
    found = kin.solve_ik(judge.robot, T)
    assert found.completeness != "unknown"
    assert len(found.solutions) == 8
    assert judge.lists(T, found, q)
    assert judge.beyond(T, found) == []
