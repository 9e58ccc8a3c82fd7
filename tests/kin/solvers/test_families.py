"""Families of arms that are matched by their axes, with random members.

Lengths, offsets, signs of twists, axis directions, convention, base and tool are random. The tests check
properties: each configuration is among the branches of its own pose, every branch meets the pose, and no branch is
missed.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from arms import Draw

import kin
from kin import Joint, Robot, Status, solve_ik
from kin.files import parse_robot
from kin.solvers import closed_form_of, parallel6, scara4, slide6, wrist6
from kin.solvers.numeric import spread
from kin.solvers.parallel6.branches import solve as solve_parallel6
from kin.solvers.wrist6.branches import solve as solve_wrist6

PI = math.pi
FAMILIES = {"wrist6": wrist6, "parallel6": parallel6, "slide6": slide6, "scara4": scara4}


def arm(rows, kinds=None, convention="standard", base=None, tool=None, limits=(-PI, PI)):
    """An arm of standard rows (theta, d, a, alpha), written in either convention; kinds are "r" or "p"."""
    kinds = kinds or "r" * len(rows)
    joints = []
    before = (0.0, 0.0)
    for i, (theta, d, a, alpha) in enumerate(rows):
        x = (a, alpha) if convention == "standard" else before
        kind = "revolute" if kinds[i] == "r" else "prismatic"
        joints.append(Joint(f"joint {i + 1}", theta, d, *x, kind, limits if kinds[i] == "r" else (-4.0, 4.0)))
        before = (a, alpha)
    if convention == "modified":
        joints.append(Joint("end", 0.0, 0.0, *before, "fixed"))
    extra = {name: T for name, T in (("base", base), ("tool", tool)) if T is not None}
    return Robot("arm", "arm", "test", convention, tuple(joints), (0.0,) * len(rows), **extra)


class MemberDraw(Draw):
    """Draws random members of the families."""

    def offset(self):
        return self.length() if self.rng.random() < 0.6 else 0.0

    def oblique(self):
        return float(self.rng.uniform(0.4, 2.7) * self.rng.choice([-1, 1]))

    def pose(self):
        return None if self.rng.random() < 0.4 else super().pose()

    def arm(self, rows, kinds=None):
        return arm(rows, kinds, str(self.rng.choice(["standard", "modified"])), self.pose(), self.pose())

    def last(self):
        return (self.angle(), self.offset(), self.offset(), self.angle())

    def wrist6(self):
        return self.arm(
            [
                (self.angle(), self.offset(), self.offset(), self.square()),
                (self.angle(), self.offset(), self.length(), self.parallel()),
                (
                    self.angle(),
                    self.offset(),
                    self.offset(),
                    float(self.rng.choice([self.square(), self.oblique()])),
                ),
                (self.angle(), self.length(), 0.0, self.square()),
                (self.angle(), 0.0, 0.0, self.square()),
                self.last(),
            ]
        )

    def parallel6(self):
        return self.arm(
            [
                (
                    self.angle(),
                    self.offset(),
                    self.offset(),
                    float(self.rng.choice([self.square(), self.oblique()])),
                ),
                (self.angle(), self.offset(), self.length(), self.parallel()),
                (self.angle(), self.offset(), self.length(), self.parallel()),
                (self.angle(), self.offset(), self.offset(), self.square()),
                (self.angle(), self.length(), 0.0, self.square()),
                self.last(),
            ]
        )

    def slide6(self):
        return self.arm(
            [
                (self.angle(), self.offset(), self.offset(), self.square()),
                (self.angle(), self.offset(), self.offset(), self.square()),
                (
                    self.angle(),
                    self.offset(),
                    self.offset(),
                    float(self.rng.choice([0.0, self.square(), self.oblique()])),
                ),
                (self.angle(), self.offset(), 0.0, self.square()),
                (self.angle(), 0.0, 0.0, self.square()),
                self.last(),
            ],
            "rrprrr",
        )

    def scara4(self):
        kinds = str(self.rng.choice(["rrpr", "rrrp", "prrr", "rprr", "rrr"]))
        rows = [(self.angle(), self.offset(), self.length(), self.parallel()) for _ in kinds]
        return self.arm([*rows[:-1], self.last()], kinds)


def members(family, count, seed=7):
    draw = MemberDraw(seed)
    return [getattr(draw, family)() for _ in range(count)]


def branches(robot, T, near, value=math.nan):
    """All branches ``(b, n)`` by the batch kernel."""
    form = closed_form_of(robot)
    out = np.empty((len(form.branches), robot.n))
    form.kernels.one(form.kernels.params, np.array(T), value, np.array(near), out)
    return out


def existing(rows):
    return rows[~np.isnan(rows[:, 0])]


def apart(a, b):
    """Largest joint difference modulo whole turns."""
    return np.abs((a - b + PI) % (2 * PI) - PI).max(axis=-1)


def merged(rows, within=0.0):
    """Pairs of rows that hold the same joints."""
    return {(i, j) for j in range(len(rows)) for i in range(j) if apart(rows[i], rows[j]) <= within}


def puma560():
    rows = [(-90, 0, 0), (0, 0, 0.4318), (90, 0.15005, 0.0203), (-90, 0.4318, 0), (90, 0, 0), (0, 0, 0)]
    return arm([(0.0, d, a, math.radians(alpha)) for alpha, d, a in rows])


def ur5():
    rows = [
        (90, 0.089159, 0),
        (0, 0, -0.425),
        (0, 0, -0.39225),
        (90, 0.10915, 0),
        (-90, 0.09465, 0),
        (0, 0.0823, 0),
    ]
    return arm([(0.0, d, a, math.radians(alpha)) for alpha, d, a in rows], limits=(-2 * PI, 2 * PI))


def kr6():
    """KR 6 R900: a base that points down, the elbow's offset, and a modified table."""
    rows = [(0, 180, 0), (0.025, 90, 0), (0.455, 0, -PI / 2), (0.035, 90, 0), (0, -90, 0), (0, 90, PI)]
    d = [-0.4, 0, 0, -0.42, 0, -0.08]
    joints = [
        Joint(f"A{i + 1}", theta, d[i], a, math.radians(alpha), "revolute", (-3.0, 3.0))
        for i, (a, alpha, theta) in enumerate(rows)
    ]
    return Robot("kr6", "KR 6", "test", "modified", tuple(joints), (0.0,) * 6)


def stanford():
    """Paul 1981: the slide is on axis 4."""
    rows = [(-90, 0.412, 0), (90, 0.154, 0), (0, 0, 0), (-90, 0, 0), (90, 0, 0), (0, 0.263, 0)]
    return arm([(0.0, d, a, math.radians(alpha)) for alpha, d, a in rows], "rrprrr")


SCARA = """
id = "scara"
name = "SCARA"
source = "test"
convention = "standard"
units = { length = "mm", angle = "deg" }
rows = [
  { name = "1", d = 387, a = 325, limits = [-132, 132] },
  { name = "2", a = 275, alpha = 180, limits = [-150, 150] },
  { name = "3", kind = "prismatic", limits = [0, 200] },
  { name = "4", d = 50, limits = [-360, 360] },
]
"""


def scara():
    return parse_robot(SCARA)


NAMED = [
    (puma560(), "wrist6"),
    (kr6(), "wrist6"),
    (ur5(), "parallel6"),
    (stanford(), "slide6"),
    (scara(), "scara4"),
]


@pytest.mark.full
@pytest.mark.parametrize("family", FAMILIES)
def test_every_configuration_is_among_the_branches_of_its_pose_and_all_meet_it(family):
    rng = np.random.default_rng(1)
    for robot in members(family, 60):
        match = closed_form_of(robot)
        assert match is not None, robot
        if family != match.name:
            continue  # a member of two families
        for q in rng.uniform(-3, 3, (6, robot.n)):
            T = kin.fk(robot, q)
            rows = branches(robot, T, q)
            assert apart(rows[match.branch_of(q)], q) < 1e-6
            assert np.abs(kin.fk(robot, existing(rows)) - T).max() < 1e-9
            for i in np.flatnonzero(~np.isnan(rows[:, 0])):
                assert match.branch_of(rows[i]) == i


@pytest.mark.parametrize(("robot", "family"), NAMED, ids=[family + "-" + robot.id for robot, family in NAMED])
def test_named_arms_are_recognised_and_have_all_their_branches(robot, family):
    match = closed_form_of(robot)
    assert family == match.name
    assert match.reason
    rng = np.random.default_rng(2)
    counts = []
    for q in robot.random_q(rng, 20):
        result = solve_ik(robot, kin.fk(robot, q), q_seed=q)
        assert result.status == Status.SOLVED
        assert result.solver == family
        assert apart(result.solutions[0].q, q) < 1e-6
        counts.append(len(existing(branches(robot, kin.fk(robot, q), q))))
    assert max(counts) == len(match.branches)


def mixture(robot, rng):
    """Targets ``(150, 4, 4)`` in random order: regular, singular or nearly, and moved, possibly out of reach."""
    form, q_of = canonical(robot)
    g = form.geometry
    q = rng.uniform(-3, 3, (150, robot.n))
    eps = rng.choice([0.0, 1e-12, 1e-9, 1e-7], 60)
    for i in range(60):
        if form.name == "scara4":
            q[i, g.order[1]] = g.sign[1] * (PI * rng.integers(0, 2) + eps[i] - g.offset[1])
            continue
        t = g.sign * q[i] + g.offset
        kind = rng.integers(0, 3)
        if kind == 0:
            t2 = reach_zero(g, t)
            t[1] = t[1] if t2 is None else t2 + eps[i]
        elif kind == 1:
            t[4] = PI * rng.integers(0, 2) + eps[i]
        else:
            t[2] = (0.0 if form.name == "slide6" else PI * rng.integers(0, 2)) + eps[i]
        q[i] = q_of(t)
    T = kin.fk(robot, q)
    if robot.n > 3:  # a planar arm would leave its plane
        T[60:100, :3, 3] *= rng.uniform(0.5, 2.0, (40, 1))
    return T[rng.permutation(150)]


CAREFUL = {
    "wrist6": solve_wrist6, "slide6": solve_wrist6, "parallel6": solve_parallel6, "scara4": scara4._careful,
}  # fmt: skip


def careful(robot, T):
    """The branches of one target by the careful kernel, of regular targets too, without limits."""
    form, far = closed_form_of(robot), np.full(robot.n, 1e6)
    out, pose = np.empty((len(form.branches), robot.n)), np.ascontiguousarray(T)
    CAREFUL[form.name](form.kernels.params, pose, math.nan, robot.q_home.copy(), -far, far, np.empty((0, 3)), out)
    return out


@pytest.mark.full
@pytest.mark.parametrize("family", FAMILIES)
def test_a_batch_is_bit_identical_to_single_targets_and_misses_no_branch(family):
    rng = np.random.default_rng(3)
    counts = set()
    for robot in members(family, 20, seed=3):
        T = mixture(robot, rng)
        rows = kin.ik_branches(robot, T)
        for pose, alone in zip(T, rows, strict=True):
            np.testing.assert_array_equal(kin.ik_branches(robot, pose), alone)
            wanted = careful(robot, pose)
            np.testing.assert_array_equal(np.isnan(alone), np.isnan(wanted))
            assert apart(existing(alone), existing(wanted)).max(initial=0.0) < 1e-6
            assert merged(alone, 1e-12) >= merged(wanted)
        exists = ~np.isnan(rows[..., 0])
        assert np.array_equal(np.isnan(rows).any(axis=2), ~exists)
        assert np.array_equal(np.isnan(rows).all(axis=2), ~exists)
        targets = np.broadcast_to(T[:, None], (*exists.shape, 4, 4))
        assert np.abs(kin.fk(robot, rows[exists]) - targets[exists]).max() < 1e-9
        counts |= set(exists.sum(axis=1).tolist())
    assert counts >= ({0, 2} if family == "scara4" else {0, 4, 8})


@pytest.mark.parametrize("family", FAMILIES)
def test_the_kernels_report_a_target_that_is_not_finite(family):
    robot = members(family, 1, seed=3)[0]
    form = closed_form_of(robot)
    T = kin.fk(robot, robot.q_home)
    out = np.empty((len(form.branches), robot.n))
    assert form.kernels.one(form.kernels.params, T, math.nan, robot.q_home.copy(), out)
    T[1, 3] = math.nan
    assert not form.kernels.one(form.kernels.params, T, math.nan, robot.q_home.copy(), out)
    assert np.isnan(out).any(axis=1).all()


def newton(robot, target, q):
    """Damped Gauss–Newton on the pose error, independent of the code under test: ``(n,)`` or None."""
    for _ in range(60):
        T = kin.fk(robot, q)
        e = np.zeros(6)
        e[:3] = target[:3, 3] - T[:3, 3]
        for i in range(3):
            e[3:] += 0.5 * np.cross(T[:3, i], target[:3, i])
        J = kin.jacobian(robot, q)
        step = J.T @ np.linalg.solve(J @ J.T + 1e-7 * np.eye(6), e)
        q = q + step / max(1.0, np.abs(step).max())
        if not np.abs(q).max() < 50:
            return None
        if np.linalg.norm(e) < 1e-12:
            return q if np.trace(T[:3, :3].T @ target[:3, :3]) > 2.7 else None
    return None


@pytest.mark.parametrize("family", FAMILIES)
def test_a_numeric_search_from_many_starts_finds_no_further_branch(family):
    rng = np.random.default_rng(4)
    found = 0
    for robot in members(family, 6, seed=4):
        target = kin.fk(robot, rng.uniform(-3, 3, robot.n))
        for start in spread(np.full(robot.n, -PI), np.full(robot.n, PI), 25):
            q = newton(robot, target, start)
            if q is None or kin.singularities(robot, q)[0].distance < 0.02:
                continue
            found += 1
            assert np.nanmin(apart(branches(robot, target, q), q)) < 1e-6
    assert found >= 40


@pytest.mark.parametrize("family", FAMILIES)
def test_an_axis_slightly_off_does_not_match(family):
    """The twists that the family requires, one after another, with an error of a milliradian."""
    required = {"wrist6": (0, 1, 3, 4), "parallel6": (1, 2, 3, 4), "slide6": (0, 1, 3, 4), "scara4": (0, 1)}[
        family
    ]
    checked = 0
    for robot in members(family, 12, seed=5):
        if robot.convention != "standard" or family != closed_form_of(robot).name:
            continue
        for row in required:
            rows = list(robot.rows)
            rows[row] = replace(rows[row], alpha=rows[row].alpha + 1e-3)
            assert FAMILIES[family].match(replace(robot, rows=tuple(rows))) is None
            checked += 1
    assert checked >= 8


def test_axes_that_do_not_quite_intersect_do_not_match():
    for make, row in ((puma560, 4), (ur5, 4)):
        rows = list(make().rows)
        rows[row] = replace(rows[row], a=1e-4)
        robot = replace(make(), rows=tuple(rows))
        assert wrist6.match(robot) is None
        assert parallel6.match(robot) is None


def canonical(robot):
    """(closed form, q of canonical angles)."""
    form = closed_form_of(robot)
    g = form.geometry

    def q_of(t):
        q = g.sign * (np.asarray(t) - g.offset)
        return np.where(robot.revolute, (q + PI) % (2 * PI) - PI, q)

    return form, q_of


def reach_zero(g, t):
    """θ2 for which the wrist centre is on axis 1, or None."""
    if g.a2 == 0.0:
        arm_vector = t[2] - 1j * g.f
    elif hasattr(g, "f"):
        arm_vector = g.a2 + g.f * np.exp(1j * t[2])
    else:
        arm_vector = g.a2 + g.a3 * np.exp(1j * t[2]) + (g.a4 + 1j * g.d5) * np.exp(1j * (t[2] + t[3]))
    if abs(arm_vector) <= abs(g.a1):
        return None
    cosine = -g.a1 / abs(arm_vector)
    return math.acos(cosine) - np.angle(arm_vector)


@pytest.mark.parametrize("family", ["wrist6", "parallel6", "slide6"])
def test_singular_targets_are_solved(family):
    """Elbow, shoulder and wrist singular, alone and together, exactly and nearly; inside the limits."""
    rng = np.random.default_rng(6)
    seen = set()
    for robot in members(family, 40, seed=6):
        if family != closed_form_of(robot).name:
            continue
        form, q_of = canonical(robot)
        g = form.geometry
        for mode in range(1, 8):
            t = rng.uniform(-3, 3, 6)
            eps = float(rng.choice([0.0, 1e-12, 1e-9, 1e-7]))
            if mode & 2:
                t[4] = PI * rng.integers(0, 2) + eps
            if mode & 4:
                t[2] = (0.0 if family == "slide6" else PI * rng.integers(0, 2)) + eps
            if mode & 1:
                t2 = reach_zero(g, t)
                if t2 is None:
                    continue
                t[1] = t2 + eps
            q = q_of(t)
            T = kin.fk(robot, q)
            result = solve_ik(robot, T, q_seed=rng.uniform(-3, 3, 6))
            assert result.status == Status.SOLVED, (robot, q.tolist(), mode, eps)
            for s in result.solutions:
                assert np.abs(kin.fk(robot, s.q) - T).max() < 1e-8
            if mode in (1, 2, 4):
                rows = branches(robot, T, rng.uniform(-3, 3, 6))
                assert len(existing(rows))
                assert np.abs(kin.fk(robot, existing(rows)) - T).max() < 1e-9
                seen.add(mode)
    assert seen == {1, 2, 4}


def narrow(robot, widths):
    """The arm with limits of these half widths about 0, None for a joint that keeps its own."""
    spans = iter(widths)
    rows = [
        row if row.kind == "fixed" or (w := next(spans)) is None else replace(row, limits=(-w, w))
        for row in robot.rows
    ]
    return replace(robot, rows=tuple(rows))


def check_arcs(robot, q, joint, task="pose"):
    """Check that solutions inside the limits exist exactly inside the reported ranges of the redundant joint."""
    T = kin.fk(robot, q)
    result = solve_ik(robot, T, q_seed=q)
    (free,) = result.redundancy
    assert abs(free.value - result.solutions[0].q[joint]) < 1e-12
    inside = 0
    values = np.linspace(-PI + 0.01, PI - 0.01, 61)
    for value in values:
        rows = existing(branches(robot, T, q, value))
        assert np.abs(kin.fk(robot, rows) - T).max() < 1e-9 if len(rows) else True
        possible = bool(len(rows)) and bool(robot.in_limits(rows, 1e-9).any())
        in_range = any(low - 1e-6 <= value <= high + 1e-6 for low, high in free.intervals)
        near_end = any(min(abs(value - low), abs(value - high)) < 1e-5 for low, high in free.intervals)
        assert possible == in_range or near_end, (value, free.intervals)
        inside += in_range
    return inside, len(values)


def test_with_the_wrist_centre_on_axis_1_the_ranges_of_theta_1_are_exact():
    rows = tuple(replace(row, d=0.4318 * (i == 3)) for i, row in enumerate(puma560().rows))
    robot = narrow(replace(puma560(), rows=rows), (2.5, 3.1, 3.1, 1.5, 1.4, 2.0))
    form, q_of = canonical(robot)
    g = form.geometry
    assert g.beside == 0.0
    rng = np.random.default_rng(8)
    some = 0
    for _ in range(6):
        t = g.sign * rng.uniform(-1.2, 1.2, 6) + g.offset
        t[1] = reach_zero(g, t)
        q = q_of(t)
        if robot.in_limits(q):
            inside, total = check_arcs(robot, q, 0)
            some += 0 < inside < total
    assert some >= 1


def test_with_axis_6_parallel_to_the_three_the_ranges_of_theta_6_are_exact():
    robot = narrow(ur5(), (3.1, 2.8, 2.5, 2.0, 2.0, 2.6))
    rng = np.random.default_rng(9)
    some = 0
    for _ in range(6):
        q = rng.uniform(-1.9, 1.9, 6)
        q[4] = 0.0
        inside, total = check_arcs(robot, q, 5)
        some += 0 < inside < total
    assert some >= 1


@pytest.mark.parametrize("family", FAMILIES)
def test_the_reported_distances_are_the_factors_of_the_determinant(family):
    rng = np.random.default_rng(10)
    for robot in members(family, 15, seed=10):
        if family != closed_form_of(robot).name:
            continue
        form = closed_form_of(robot)
        g = form.geometry
        ratios = []
        for q in rng.uniform(-3, 3, (5, robot.n)):
            J = kin.jacobian(robot, q)
            volume = math.sqrt(np.linalg.det(J.T @ J)) if family == "scara4" else abs(np.linalg.det(J))
            found = form.singularities(q)
            factors = math.prod(math.sin(s.distance) if s.unit == "rad" else s.distance for s in found)
            ratios.append(volume / factors)
        if family == "scara4":
            # With a tool off the axis, the determinant is no product of these factors; only the zeros agree.
            q[g.order[1]] = -g.sign[1] * g.offset[1]
            J = kin.jacobian(robot, q)
            assert np.linalg.svd(J, compute_uv=False)[robot.n - 1] < 1e-12
            assert form.singularities(q)[0].distance < 1e-12
        else:
            np.testing.assert_allclose(ratios, ratios[0], rtol=1e-6)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("task", ["pose", "approach"])
def test_poses_inside_random_limits_are_solved(family, task):
    """Every joint has random limits; the pose of a configuration inside them is solved from the home pose."""
    rng = np.random.default_rng(11)
    for robot in members(family, 15, seed=11):
        rows = tuple(
            row
            if row.kind == "fixed"
            else replace(row, limits=(low := float(rng.uniform(-3, 0)), low + float(rng.uniform(0.5, 5))))
            for row in robot.rows
        )
        robot = replace(robot, rows=rows, home=tuple(0.5 * sum(r.limits) for r in rows if r.kind != "fixed"))
        q = robot.random_q(rng)
        result = solve_ik(robot, kin.fk(robot, q), task=task)
        assert result.status == Status.SOLVED
        assert robot.in_limits(result.solutions[0].q, 1e-9)


def test_a_scara_meets_upright_poses_and_reports_the_error_of_others():
    robot = scara()
    q = np.array([0.4, -0.9, 0.11, 0.7])
    T = kin.fk(robot, q)
    tilted = T.copy()
    c, s = math.cos(0.3), math.sin(0.3)
    tilted[:3, :3] = T[:3, :3] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    result = solve_ik(robot, tilted, q_seed=q)
    assert result.status == Status.APPROXIMATE
    assert result.solutions[0].position_error < 1e-9
    assert result.solutions[0].rotation_error == pytest.approx(0.3)
    too_high = T.copy()
    too_high[2, 3] += 1.0
    assert solve_ik(robot, too_high).status != Status.SOLVED


@pytest.mark.parametrize("task", ["approach", "position"])
def test_the_free_angle_of_a_scara_has_exact_ranges(task):
    """With a tool off the last axis, reach and all three limits restrict the angle."""
    lever = ((1.0, 0.0, 0.0, 0.15), (0.0, 1.0, 0.0, 0.05), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    robot = replace(scara(), tool=lever)
    robot = replace(robot, rows=tuple(replace(r, limits=(-1.0, 1.4)) if r.name == "4" else r for r in robot.rows))
    rng = np.random.default_rng(12)
    some = 0
    for q in robot.random_q(rng, 6):
        T = kin.fk(robot, q)
        result = solve_ik(robot, T, task=task, q_seed=q)
        assert result.status == Status.SOLVED
        assert result.solver == "scara4"
        assert apart(result.solutions[0].q, q) < 1e-6
        (free,) = result.redundancy
        for value in np.linspace(-3, 3, 25):
            in_range = any(low - 1e-6 <= value <= high + 1e-6 for low, high in free.intervals)
            requested = solve_ik(robot, T, task=task, redundancy=float(value))
            assert (requested.status == Status.SOLVED) == in_range
            some += in_range
    assert 10 < some < 140


def test_a_planar_arm_solves_poses_in_its_plane_only():
    robot = arm([(0.0, 0.0, 0.3, 0.0), (0.0, 0.0, 0.25, 0.0), (0.0, 0.0, 0.1, 0.0)])
    q = np.array([0.3, 0.8, -0.4])
    T = kin.fk(robot, q)
    result = solve_ik(robot, T, q_seed=q)
    assert result.status == Status.SOLVED
    assert len(result.solutions) == 2
    T[2, 3] = 0.05
    assert solve_ik(robot, T).status == Status.UNREACHABLE


def test_a_free_roll_stays_at_the_seed():
    """For an approach direction along axis 6, joint 6 keeps its value, also at the wrist singularity."""
    for robot in (puma560(), ur5()):
        for flat in (False, True):
            q = np.array([0.3, -0.7, 0.9, 0.4, 0.0 if flat else 0.6, 0.2])
            seed = q + np.array([0.05, 0.1, -0.1, 0.1, 0.02, 0.3])
            result = solve_ik(robot, kin.fk(robot, q), task="approach", q_seed=seed)
            assert result.status == Status.SOLVED
            assert result.solver in FAMILIES
            assert result.solutions[0].q[5] == pytest.approx(seed[5])
            requested = solve_ik(robot, kin.fk(robot, q), task="approach", redundancy={"theta6": -1.0})
            assert requested.solutions[0].q[5] == pytest.approx(-1.0)


def test_theta_1_is_redundant_only_if_the_wrist_centre_can_be_on_axis_1():
    offset, centred = puma560(), kr6()
    for robot, names in ((offset, []), (centred, ["theta1"])):
        form = closed_form_of(robot)
        assert [f.name for f in form.redundancies(0)] == names
