"""Arms with reversed joints have the same closed form, solutions and workspace as the original arm.

Two properties are tested. The results for an arm with reversed joints are those for the arm that matches the
family as it is, except for signs and rounding. And whichever joints of a built-in arm are reversed, it keeps its
closed form, its postures and its workspace; only the names of branches may change.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from arms import Draw, nested, reversed_at

import kin
from kin import Joint, Robot, Status, solve_ik
from kin.axes import screw_x, screw_z
from kin.solvers import closed_form_of
from kin.solvers.reversed import ReversedJoints, readings

PI = math.pi
ARMS = {name: kin.get_robot(name) for name in ("pioneer5", "redundant7", "redundant7-craig", "iiwa14")}
# Joints whose reversal the family does not accept as it is, by arm; joint 7 only because of approach directions.
UNUSUAL = {"pioneer5": (1, 2, 3), "redundant7": (0, 1, 2, 4), "redundant7-craig": (2, 4, 6), "iiwa14": (2, 4, 6)}


def signs_of(robot, joints):
    signs = np.ones(robot.n)
    signs[list(joints)] = -1.0
    return signs


CASES = [
    (name, joints)
    for name, more in (
        ("pioneer5", [(0, 1, 3), (2, 3), (0, 1, 2, 3, 4)]),
        ("redundant7", [(0, 2, 5), (1, 2, 4, 6), (0, 1, 2, 3, 4, 5, 6)]),
        ("redundant7-craig", [(0, 2, 3), (1, 2, 4, 5, 6)]),
        ("iiwa14", [(0, 2, 4, 5), (0, 1, 2, 3, 4, 5, 6)]),
    )
    for joints in [*((i,) for i in UNUSUAL[name]), *more]
]
IDS = [f"{name}-{''.join(str(i + 1) for i in joints)}" for name, joints in CASES]
cases = pytest.mark.parametrize(("name", "joints"), CASES, ids=IDS)


class ArmPair:
    """An arm with reversed joints, and the plain arm: the one that matches its family as it is."""

    def __init__(self, robot):
        self.robot = robot
        self.match = closed_form_of(robot)
        self.joints = getattr(self.match, "joints", ())
        self.plain = reversed_at(robot, self.joints)
        self.signs = signs_of(robot, self.joints)
        assert not isinstance(closed_form_of(self.plain), ReversedJoints)

    def value(self, name, x):
        """A redundancy value of the plain arm as that of the reversed arm."""
        match = re.fullmatch(r"theta(\d)", name)
        return -x if match and int(match[1]) - 1 in self.joints else x

    def rows(self, plain, other):
        """How many different rows these branches of the two arms are: names may depend on the sense of a joint."""
        return len({kin.branch_names(self.plain).index(plain), kin.branch_names(self.robot).index(other)})

    def both(self, target, **options):
        """Results for the plain arm and for the reversed one."""
        there = dict(options)
        if "q_seed" in options:
            there["q_seed"] = options["q_seed"] * self.signs
        if "limits" in options:
            there["limits"] = [
                pair if sign > 0 else (-pair[1], -pair[0])
                for pair, sign in zip(options["limits"], self.signs, strict=True)
            ]
        if "locked" in options:
            there["locked"] = [
                None if x is None else x * s for x, s in zip(options["locked"], self.signs, strict=True)
            ]
        if "redundancy" in options:
            there["redundancy"] = {k: self.value(k, x) for k, x in options["redundancy"].items()}
        return solve_ik(self.plain, target, **options), solve_ik(self.robot, target, **there)

    def agree(self, a, b, tolerance=1e-7):
        """Check that the result for the reversed arm is that for the plain one."""
        assert (a.status, a.cause, a.solver, len(a.solutions)) == (b.status, b.cause, b.solver, len(b.solutions))
        for x, y in zip(a.solutions, b.solutions, strict=True):
            assert self.rows(x.branch, y.branch) == 1
            assert x.compromise == y.compromise
            if x.compromise == "rotation":  # found by descents, which may end a whole turn away
                assert abs(x.rotation_error - y.rotation_error) < 1e-6
                continue
            assert np.abs(x.q - y.q * self.signs).max() < tolerance
            assert max(y.position_error, y.rotation_error) <= 1e-9 or y.compromise
            self._same_redundancy(x.redundancy, y.redundancy, tolerance)
        if a.solutions:
            self._same_redundancy(a.redundancy, b.redundancy, tolerance)
        here, there = (
            sorted(r.blocked, key=lambda x: kin.branch_names(arm).index(x.branch))  # violations may be equal
            for r, arm in ((a, self.plain), (b, self.robot))
        )
        for x, y in zip(here, there, strict=True):
            assert self.rows(x.branch, y.branch) == 1
            assert [v.joint for v in x.violations] == [v.joint for v in y.violations]
            for v, w in zip(x.violations, y.violations, strict=True):
                sign = self.signs[v.joint]
                assert abs((v.value - v.limit) - (w.value - w.limit) * sign) < 1e-6

    def _same_redundancy(self, a, b, tolerance):
        assert [r.name for r in a] == [r.name for r in b]
        for x, y in zip(a, b, strict=True):
            assert abs(self.value(x.name, y.value) - x.value) < tolerance
            ranges = [tuple(sorted(self.value(x.name, end) for end in pair)) for pair in y.intervals]
            assert np.allclose(wide(ranges), wide(x.intervals), rtol=0.0, atol=max(tolerance, 1e-7))


def wide(intervals):
    """The intervals longer than 1e-6: rounding decides whether a shorter one exists."""
    return np.array(sorted(pair for pair in intervals if pair[1] - pair[0] > 1e-6)).reshape(-1, 2)


def poses(robot, count, seed=0, inside=True):
    """Configurations and their poses; unless `inside`, also poses outside the limits or out of reach."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        q = robot.random_q(rng)
        yield q, kin.fk(robot, q)
        if not inside:
            q = rng.uniform(-PI, PI, robot.n)
            T = kin.fk(robot, q)
            yield q, T
            T = T.copy()
            T[:3, 3] *= rng.uniform(0.9, 1.6)
            yield q, T


# -- matching -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ARMS)
def test_reversed_joints_do_not_change_the_family_or_tasks(name):
    base, n = closed_form_of(ARMS[name]), ARMS[name].n
    for count in (0, 1, 2, n - 1, n):
        for joints in itertools.combinations(range(n), count):
            match = closed_form_of(reversed_at(ARMS[name], joints))
            assert match is not None, joints
            assert match.name == base.name
            assert set(match.branches) == set(base.branches)
            for task in range(4):
                assert match.handles(task) == base.handles(task)
            assert len(getattr(match, "joints", ())) <= count


@pytest.mark.parametrize("name", ARMS)
def test_a_single_joint_in_an_unusual_direction_is_the_one_that_is_reversed(name):
    for joint in range(ARMS[name].n):
        match = closed_form_of(reversed_at(ARMS[name], (joint,)))
        unusual = joint in UNUSUAL[name]
        assert isinstance(match, ReversedJoints) == unusual
        assert match.reason.endswith(f"; joint {joint + 1} is reversed") == unusual
    assert closed_form_of(reversed_at(ARMS["iiwa14"], (2, 4))).reason.endswith("; joints 3 and 5 are reversed")
    assert closed_form_of(reversed_at(ARMS["iiwa14"], (2, 4, 6))).reason.endswith(
        "; joints 3, 5 and 7 are reversed"
    )


def test_arms_that_match_as_they_are_or_not_at_all_have_no_reversed_joints():
    for name in ("panda", "ur5", "puma560", "irb120", "stanford", "scara", *ARMS):
        match = closed_form_of(kin.get_robot(name))
        assert match is not None
        assert not isinstance(match, ReversedJoints)
    one = Robot(
        "one", "one", "test", "standard", (Joint("j", 0.0, 0.1, 0.2, 0.3, "revolute", (-1.0, 1.0)),), (0.0,)
    )
    assert not isinstance(closed_form_of(one), ReversedJoints)
    snake = [Joint(f"j{i}", 0.0, 0.0, 0.1, PI * (i % 2) if i % 4 < 3 else 1.0, limits=(-1, 1)) for i in range(40)]
    assert closed_form_of(Robot("snake", "snake", "test", "standard", tuple(snake), (0.0,) * 40)) is None


@cases
def test_a_reading_has_the_forward_kinematics_of_the_arm(name, joints):
    robot = reversed_at(ARMS[name], joints)
    q = robot.random_q(np.random.default_rng(1), 5)
    assert np.allclose(kin.fk(robot, q), kin.fk(ARMS[name], q * signs_of(robot, joints)), atol=1e-12)
    for reversed_, read in readings(robot):
        assert np.allclose(kin.fk(read, q * signs_of(robot, reversed_)), kin.fk(robot, q), atol=1e-12)


# -- results ------------------------------------------------------------------------------------------------------


@cases
def test_results_are_those_of_the_plain_arm(name, joints):
    pair = ArmPair(reversed_at(ARMS[name], joints))
    rng = np.random.default_rng(2)
    found = set()
    for q, T in poses(pair.plain, 2, inside=False):
        seed = q + rng.uniform(-0.4, 0.4, len(q))
        for options in (
            {"q_seed": seed},
            {"task": "approach"},
            {"task": "approach", "q_seed": seed, "branch": "seed"},
            {"q_seed": seed, "images": "all", "respect_limits": True},
            {"respect_limits": False, "q_seed": seed},
        ):
            a, b = pair.both(T, **options)
            found.add(a.status)
            pair.agree(a, b)
    assert {Status.SOLVED, Status.LIMITS} <= found


@pytest.mark.parametrize("joints", [joints for name, joints in CASES if name == "pioneer5"], ids=str)
def test_position_task(joints):
    """Only the best solutions are compared: rounding decides whether a branch exists that touches a limit."""
    pair = ArmPair(reversed_at(ARMS["pioneer5"], joints))
    for q, T in poses(pair.plain, 3, seed=4):
        for options in (
            {},
            {"redundancy": {"theta4": float(q[3])}},
            {"redundancy": {"theta4": float(q[3]), "theta5": float(q[4])}},
            {"redundancy": {"theta5": float(q[4])}, "locked": [None, None, None, float(q[3]), None]},
        ):
            a, b = pair.both(T[:3, 3], task="position", q_seed=q + 1e-3, **options)
            assert a.status is b.status is Status.SOLVED
            pair.agree(replace(a, solutions=a.solutions[:1]), replace(b, solutions=b.solutions[:1]), 1e-6)


@cases
def test_narrowed_limits_and_locked_joints(name, joints):
    pair = ArmPair(reversed_at(ARMS[name], joints))
    plain = pair.plain
    rng = np.random.default_rng(5)
    for q, T in poses(plain, 2, seed=5):
        seed = q + rng.uniform(-0.2, 0.2, plain.n)
        near = [
            (max(low, x - 0.9), min(high, x + 0.7))
            for x, low, high in zip(q, plain.lower, plain.upper, strict=True)
        ]
        a, b = pair.both(T, limits=near, q_seed=seed)
        assert a.status is Status.SOLVED
        pair.agree(a, b)
        elsewhere = [(low, low + 0.4 * (high - low)) for low, high in zip(plain.lower, plain.upper, strict=True)]
        pair.agree(*pair.both(T, limits=elsewhere, q_seed=seed))
        locked = [None] * plain.n
        locked[joints[0]] = float(q[joints[0]])
        a, b = pair.both(T, locked=locked, q_seed=seed)
        assert a.status is Status.SOLVED
        pair.agree(a, b)


SEVEN = [(name, joints) for name, joints in CASES if name != "pioneer5"]


@pytest.mark.parametrize(("name", "joints"), SEVEN, ids=IDS[-len(SEVEN) :])
def test_requested_and_preferred_redundancy_values(name, joints):
    pair = ArmPair(reversed_at(ARMS[name], joints))
    free = "theta1" if name == "redundant7" else "psi"
    for q, T in poses(pair.plain, 1, seed=6):
        seed = q + 0.1
        for value in (-1.9, 0.3, 2.0):
            pair.agree(*pair.both(T, redundancy={free: value}, q_seed=seed))
        other = {"redundant7": ("roll", 0.4)}.get(name, ("theta7", float(q[6])))
        pair.agree(*pair.both(T, task="approach", redundancy={free: 0.3, other[0]: other[1]}, q_seed=seed))
        for prefer, worth in (("limits", margin), ("manipulability", kin.manipulability)):
            a, b = pair.both(T, prefer=prefer, q_seed=seed)
            assert a.status is b.status is Status.SOLVED
            # Several values may be equally good.
            here, there = (
                {kin.branch_names(r).index(s.branch): worth(r, s.q) for s in x.solutions}
                for r, x in ((pair.plain, a), (pair.robot, b))
            )
            assert here.keys() == there.keys()
            assert all(abs(here[key] - there[key]) < 1e-3 * max(1.0, abs(here[key])) for key in here)
            assert all(
                there[kin.branch_names(pair.robot).index(x.branch)] >= worth(pair.robot, x.q) - 1e-3
                for x in pair.both(T, q_seed=seed)[1].solutions
            )


def margin(robot, q):
    """Distance to the nearest limit, as a share of half the joint's range."""
    return float((np.minimum(q - robot.lower, robot.upper - q) / (0.5 * (robot.upper - robot.lower))).min())


@cases
def test_batch_branches(name, joints):
    robot = reversed_at(ARMS[name], joints)
    pair = ArmPair(robot)
    five = robot.n == 5
    q = pair.plain.random_q(np.random.default_rng(7), 40)
    T = kin.fk(pair.plain, q)
    values = np.linspace(-2.5, 2.5, len(q))
    values[::5] = math.nan
    there = -values if name == "redundant7" and 0 in pair.joints else values
    for a, b in ((math.nan, math.nan), (0.7, -0.7 if there is not values else 0.7), (values, there)):
        x, y = kin.ik_branches(pair.plain, T, a), kin.ik_branches(robot, T, b)
        assert np.array_equal(np.isnan(x), np.isnan(y))
        assert apart(x, y * pair.signs).max() < 1e-7
        assert five or not np.isnan(y).all()
        here = ~np.isnan(y)
        assert name == "redundant7" or ((np.abs(y[here]) <= PI).all() and (y[here] > -PI).all())
        for i in range(4):
            one = kin.ik_branches(robot, T[i], b if np.ndim(b) == 0 else float(b[i]))
            assert np.allclose(one, y[i], rtol=0.0, atol=1e-12, equal_nan=True)


def apart(a, b):
    """Joint differences modulo whole turns; 0 where a branch does not exist."""
    return np.nan_to_num(np.abs((a - b + PI) % (2 * PI) - PI))


def test_batch_angles_are_in_the_half_open_turn():
    robot = reversed_at(ARMS["iiwa14"], (2,))
    q = np.array([0.0, 0.5, PI, -0.7, 0.2, 0.4, 0.1])
    rows = kin.ik_branches(robot, kin.fk(robot, q), 0.0)
    rows = rows[~np.isnan(rows[:, 0])]
    assert (rows > -PI).all()
    assert (np.abs(rows) <= PI).all()
    printed = reversed_at(ARMS["redundant7"], (0,))
    q = np.array([-PI, 0.5, 0.4, 0.7, 0.2, 0.4, 0.1])
    rows = kin.ik_branches(printed, kin.fk(printed, q), -PI)
    assert (rows[~np.isnan(rows[:, 0]), 0] == -PI).all()  # as requested


@pytest.mark.parametrize("joint", UNUSUAL["iiwa14"])
def test_the_arm_angle_has_the_same_reference_plane_above_the_base(joint):
    base, robot = ARMS["iiwa14"], reversed_at(ARMS["iiwa14"], (joint,))
    q = np.array([0.5, 0.4, 0.0, 0.4 + math.asin(0.42 / 0.4 * math.sin(0.4)), 0.3, 0.7, 0.2])
    T = kin.fk(base, q)
    assert np.abs(T[:2, 3] - 0.126 * T[:2, 2]).max() < 1e-12  # the wrist centre is on axis 1
    expected, found = (kin.ik_branches(arm, T, 0.3) for arm in (base, robot))
    assert apart(expected, found * signs_of(base, (joint,))).max() < 1e-7
    assert not np.isnan(found).any()


@cases
def test_reversing_joints_renames_branches_one_to_one(name, joints):
    base, robot = ARMS[name], reversed_at(ARMS[name], joints)
    signs = signs_of(base, joints)
    names = {}
    for q, _ in poses(base, 60, seed=8):
        here, there = kin.branch_of(base, q), kin.branch_of(robot, q * signs)
        assert names.setdefault(here, there) == there
    assert len(set(names.values())) == len(names)
    exact = getattr(closed_form_of(robot), "joints", ()) == joints
    if exact:
        rows = [kin.branch_names(arm).index for arm in (base, robot)]
        assert all(rows[0](here) == rows[1](there) for here, there in names.items())
    for q, T in poses(base, 3, seed=9):
        a, b = solve_ik(base, T, q_seed=q + 0.1), solve_ik(robot, T, q_seed=(q + 0.1) * signs)
        assert a.status is b.status is Status.SOLVED
        assert min(np.abs(s.q - q * signs).max() for s in solve_ik(robot, T, q_seed=q * signs).solutions) < 1e-6
        assert {names.get(s.branch, s.branch) for s in a.solutions} == {s.branch for s in b.solutions}
        for s in b.solutions:
            assert s.branch == kin.branch_of(robot, s.q)
        if exact:
            indices = [[row(s.branch) for s in r.solutions] for row, r in zip(rows, (a, b), strict=True)]
            assert indices[0] == indices[1]
            assert all(
                np.abs(x.q - y.q * signs).max() < 1e-6 for x, y in zip(a.solutions, b.solutions, strict=True)
            )


@cases
def test_singularities_give_values_of_the_arms_own_joints(name, joints):
    pair = ArmPair(reversed_at(ARMS[name], joints))
    reversed_values = 0
    for q, _ in poses(pair.plain, 20, seed=10):
        expected = kin.singularities(pair.plain, q)
        found = kin.singularities(pair.robot, q * pair.signs)
        assert len(expected) == len(found)
        for a, b in zip(expected, found, strict=True):
            assert (a.kind, a.condition, a.lost, a.unit) == (b.kind, b.condition, b.lost, b.unit)
            assert abs(a.distance - b.distance) < 1e-9
            for (i, x), (k, y) in zip(a.met_at, b.met_at, strict=True):
                assert i == k
                assert abs(x * pair.signs[i] - y) < 1e-9
                reversed_values += i in pair.joints
    alone = {"pioneer5": {2, 4}, "redundant7": {2, 3, 5}}.get(name, {1, 2, 3, 4, 5})
    assert reversed_values > 0 or not alone & set(pair.joints)


@cases
def test_the_arm_is_singular_at_the_joint_values_given(name, joints):
    robot = reversed_at(ARMS[name], joints)
    for s in kin.singularities(robot, robot.q_home):
        q = robot.q_home.copy()
        for i, value in s.met_at:
            q[i] = value
        there = next(x for x in kin.singularities(robot, q) if (x.kind, x.lost) == (s.kind, s.lost))
        assert there.condition == s.condition
        assert there.distance < 1e-9 or not s.met_at


# -- paths and maps -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "joints"), [("pioneer5", (2,)), ("redundant7", (0, 2)), ("iiwa14", (2, 4, 6))])
def test_paths_are_those_of_the_plain_arm(name, joints):
    pair = ArmPair(reversed_at(ARMS[name], joints))
    start, end = (q for q, _ in poses(pair.plain, 2, seed=11))
    way = [kin.fk(pair.plain, start + s * 0.3 * (end - start)) for s in np.linspace(0.0, 1.0, 8)]
    a, b = kin.solve_path(pair.plain, way), kin.solve_path(pair.robot, way)
    assert a.solver == b.solver == closed_form_of(pair.plain).name
    assert len(a.jumps) == len(b.jumps)
    assert np.allclose(a.q, b.q * pair.signs, atol=1e-5, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "joints"), [("pioneer5", (1,)), ("pioneer5", (2, 3)), ("redundant7", (0, 4)), ("iiwa14", (2, 6))]
)
def test_reversing_joints_does_not_change_the_capability_map(name, joints):
    base = ARMS[name]
    a, b = (
        kin.workspace.capability_map(r, resolution=5, directions=12) for r in (base, reversed_at(base, joints))
    )
    assert a.grid.method == b.grid.method == "closed form"
    assert np.array_equal(a.index, b.index)
    assert np.array_equal(a.approachable, b.approachable)
    seen = a.approachable.any(axis=1)  # elsewhere, manipulability is that of whatever a descent found
    assert seen.any()
    assert np.allclose(a.manipulability[seen], b.manipulability[seen], rtol=1e-5, atol=1e-9)


# -- random tables -----------------------------------------------------------------------------------------------


class Table(Draw):
    """Random arms of a family: lengths and twists of either sign, any base, either convention."""

    def rows(self, lengths, twists):
        return [(self.angle(), d, a, alpha) for (d, a), alpha in zip(lengths, twists, strict=True)]

    def srs7(self):
        d = [self.length(), 0.0, self.length(), 0.0, self.length(), 0.0, self.length()]
        twists = [self.square() for _ in range(6)] + [self.parallel()]
        return self.rows([(x, 0.0) for x in d], twists), None if self.rng.random() < 0.5 else self.pose()

    def collinear7(self):
        d = [self.length(), self.length(), self.length(), 0.0, self.length(), 0.0, self.length()]
        twists = [self.parallel(), *(self.square() for _ in range(5)), self.parallel()]
        return self.rows([(x, 0.0) for x in d], twists), None if self.rng.random() < 0.5 else self.pose()

    def wrist5(self):
        middle, beside = self.parallel(), self.length()
        back = -beside if middle == 0.0 else beside
        lengths = [
            (self.length(), self.length()),
            (beside, self.length()),
            (back, 0.0),
            (self.length(), 0.0),
            (0, 0),
        ]
        # The tool is perpendicular to the last axis, for any zero of the last joint.
        tool = screw_z(self.angle(), 0.0) @ screw_x(0.0, self.square()) @ screw_z(0.0, self.length())
        return self.rows(lengths, [self.square(), middle, self.square(), self.square(), 0.0]), nested(tool)

    def arm(self, family):
        rows, tool = getattr(self, family)()
        table, before, modified = [], (0.0, 0.0), self.rng.random() < 0.5
        with_fixed_rows = self.rng.random() < 0.4
        turn, shift = 0.0, 0.0  # of the preceding fixed row
        for i, (theta, d, a, alpha) in enumerate(rows):
            if modified:
                table.append(Joint(f"j{i}", theta, d, *before, limits=(-PI, PI)))
            elif with_fixed_rows:
                table.append(Joint(f"j{i}", theta - turn, d - shift - 0.1, limits=(-PI, PI)))
                turn, shift = (0.4, 0.2) if i + 1 < len(rows) else (0.0, 0.0)
                table.append(Joint(f"fixed {i}", 0.0, 0.1, a, alpha, "fixed"))
                table.append(Joint(f"and {i}", turn, shift, 0.0, 0.0, "fixed"))
            else:
                table.append(Joint(f"j{i}", theta, d, a, alpha, limits=(-PI, PI)))
            before = (a, alpha)
        if modified:
            table.append(Joint("end", 0.0, 0.0, *before, "fixed"))
        extra = {} if tool is None else {"tool": tool}
        convention = "modified" if modified else "standard"
        return Robot(
            "drawn", "drawn", "test", convention, tuple(table), (0.1,) * len(rows), base=self.pose(), **extra
        )


@pytest.mark.parametrize("family", ["srs7", "collinear7", "wrist5"])
def test_random_tables_match_their_family(family):
    draw = Table(12)
    unreversed = 0
    for _ in range(25):
        robot = draw.arm(family)
        match = closed_form_of(robot)
        assert match is not None
        assert family == match.name
        unreversed += not isinstance(match, ReversedJoints)
        q = robot.random_q(draw.rng, 3)
        T = kin.fk(robot, q)
        for row in kin.ik_branches(robot, T).swapaxes(0, 1):
            there = ~np.isnan(row[:, 0])
            off = kin.fk(robot, row[there]) - T[there]
            assert np.abs(off[:, :3, 2:] if robot.n == 5 else off).max(initial=0.0) < 1e-9
        for seed, pose in zip(q, T, strict=True):
            result = solve_ik(robot, pose, q_seed=seed)
            assert result.solver == family
            assert np.abs(result.solutions[0].q - seed).max() < 1e-6
            assert result.solutions[0].branch == kin.branch_of(robot, seed)
            assert all(s.branch == kin.branch_of(robot, s.q) for s in result.solutions)
            assert match.handles(1) == (family == "wrist5" or robot.T_last_tool[0, 3] == 0.0)
    assert 0 < unreversed < 20
