"""The Pioneer family with a position task: exact ranges of θ4 and θ5, no solution missed, no limit violated."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from kin import Status, solve_ik
from kin.solvers import closed_form_of
from kin.solvers.contract import POSITION, SolverInput
from kin.solvers.wrist5 import point as point5

ROBOT = kin.get_robot("pioneer5")
FORM = closed_form_of(ROBOT)
GEOMETRY = FORM.geometry
SLACK = 1e-9


def pose_at(point):
    T = np.eye(4)
    T[:3, 3] = point
    return T


def solve_point(point, low, high, seed=None, values=(math.nan, math.nan), respect=True):
    seed = ROBOT.q_home.copy() if seed is None else seed
    return point5.solve(
        GEOMETRY, SolverInput(pose_at(point), POSITION, values, respect, seed, low.copy(), high.copy())
    )


def postures(point, q4, q5):
    """All configurations ``(k, 5)`` with given θ4, θ5, from the geometry and independent of the code under test.

    The tool is m off the arm's plane; in the plane the arm has two links, a2 and (d4 + d6 c5, tx).
    """
    a1, a2, d4, d6, d1 = 0.070, 0.160, 0.140, 0.120, 0.130
    x, y, h = point[0], point[1], d1 - point[2]
    m = d6 * math.sin(q4) * math.sin(q5)
    tx, tz = -d6 * math.cos(q4) * math.sin(q5), d4 + d6 * math.cos(q5)
    found = []
    # At an edge of reach, rounding may lose a double root.
    square = x * x + y * y - m * m
    if square < -1e-14:
        return np.empty((0, 5))
    for side in (1.0, -1.0):
        R = side * math.sqrt(max(0.0, square))
        L2, D2 = tx * tx + tz * tz, (R - a1) ** 2 + h * h
        cosine = (D2 - a2 * a2 - L2) / (2 * a2 * math.sqrt(L2))
        if abs(cosine) > 1 + 1e-13:
            continue
        for elbow in (1.0, -1.0):
            w = elbow * math.acos(min(1.0, max(-1.0, cosine)))
            t3 = w + math.atan2(tx, tz)
            t2 = math.atan2(h, R - a1) - math.atan2(math.sqrt(L2) * math.sin(w), a2 + math.sqrt(L2) * math.cos(w))
            found.append([math.atan2(y, x) - math.atan2(m, R), t2, t3, q4, q5])
    return np.array(found).reshape(-1, 5)


def fits(point, q4, q5, low, high, slack=SLACK):
    """Whether some posture at (θ4, θ5) is inside the limits, up to whole turns."""
    for q in postures(point, q4, q5):
        image = q + 2 * math.pi * np.round((0.5 * (low + high) - q) / (2 * math.pi))
        if ((image >= low - slack) & (image <= high + slack)).all():
            return True
    return False


def inside(rows, value, slack=0.0):
    return any(a - slack <= value <= b + slack for _, a, b in rows)


def random_limits(rng, share):
    width = ROBOT.upper - ROBOT.lower
    low = ROBOT.lower + rng.random(5) * (1 - share) * width
    return low, low + share * width


def test_the_reference_implementation_meets_the_point():
    rng = np.random.default_rng(0)
    for q in ROBOT.random_q(rng, 200):
        point = kin.fk(ROBOT, q)[:3, 3]
        found = postures(point, q[3], q[4])
        assert np.abs(kin.fk(ROBOT, found)[:, :3, 3] - point).max() < 1e-12
        assert np.abs((found - q + np.pi) % (2 * np.pi) - np.pi).max(axis=1).min() < 1e-6


@pytest.mark.parametrize("share", [0.1, 0.25, 0.4, 1.0])
def test_a_point_inside_narrowed_limits_is_always_solved(share):
    rng = np.random.default_rng(int(100 * share))
    for _ in range(150):
        low, high = random_limits(rng, share)
        q = rng.uniform(low, high)
        point = kin.fk(ROBOT, q)[:3, 3]
        found = solve_point(point, low, high, ROBOT.random_q(rng))
        rows = found.q[~np.isnan(found.q[:, 0])]
        assert len(rows)
        assert np.abs(kin.fk(ROBOT, rows)[:, :3, 3] - point).max() < 1e-9
        image = rows + 2 * np.pi * np.round((0.5 * (low + high) - rows) / (2 * np.pi))
        assert ((image >= low - SLACK) & (image <= high + SLACK)).all(axis=1).any()
        assert inside(found.arcs[0], q[3], 1e-7)


def test_points_are_solved_with_locked_joints():
    """Three locked joints leave isolated configurations: rounding must not lose them."""
    rng = np.random.default_rng(5)
    for i in range(200):
        low, high = random_limits(rng, 0.4)
        q = rng.uniform(low, high)
        locked = rng.choice(5, 1 + i % 3, replace=False)
        low[locked] = high[locked] = q[locked]
        result = solve_ik(
            ROBOT,
            kin.fk(ROBOT, q)[:3, 3],
            task="position",
            limits=np.c_[low, high].tolist(),
            locked=[float(q[j]) if j in locked else None for j in range(5)],
        )
        assert result.status is Status.SOLVED, (q.tolist(), locked.tolist(), result.reason)
        assert all((s.q[locked] == q[locked]).all() for s in result.solutions)


def test_the_ranges_of_theta5_are_exact():
    """At the θ4 used, a θ5 of a fine grid is inside the ranges if and only if some posture fits."""
    rng = np.random.default_rng(7)
    inner = outer = 0
    for _ in range(25):
        low, high = random_limits(rng, rng.uniform(0.3, 1.0))
        point = kin.fk(ROBOT, rng.uniform(low, high))[:3, 3]
        found = solve_point(point, low, high)
        for branch in np.flatnonzero(~np.isnan(found.q[:, 0])).tolist():
            q4 = float(found.values[branch, 0])
            ranges = found.arcs[1][found.arcs[1][:, 0] == branch]
            for q5 in np.linspace(low[4], high[4], 60).tolist():
                if inside(ranges, q5):
                    assert fits(point, q4, q5, low, high, 1e-7)
                    inner += 1
        every = found.arcs[1]
        used = sorted({float(v) for v in found.values[~np.isnan(found.values[:, 0]), 0]})
        if len(used) == 1:
            for q5 in np.linspace(low[4], high[4], 60).tolist():
                if not inside(every, q5, 1e-6):
                    assert not fits(point, used[0], q5, low, high, -1e-7)
                    outer += 1
    assert inner > 200
    assert outer > 50


def test_the_ranges_of_theta4_are_exact():
    """A dense grid finds no θ4 outside the ranges, and each θ4 inside has a θ5 in the reported ranges."""
    rng = np.random.default_rng(9)
    checked = 0
    for _ in range(12):
        low, high = random_limits(rng, rng.uniform(0.3, 1.0))
        point = kin.fk(ROBOT, rng.uniform(low, high))[:3, 3]
        found = solve_point(point, low, high)
        for q4 in np.linspace(low[3], high[3], 40).tolist():
            there = [
                q5 for q5 in np.linspace(low[4], high[4], 40).tolist() if fits(point, q4, q5, low, high, -1e-7)
            ]
            if there:
                assert inside(found.arcs[0], q4, 1e-6)
        for _, a, b in found.arcs[0].tolist():
            for q4 in np.linspace(a, b, 5)[1:-1].tolist():
                given = solve_point(point, low, high, values=(q4, math.nan))
                assert any(
                    fits(point, q4, 0.5 * (u + v), low, high, 1e-7) for _, u, v in given.arcs[1].tolist()
                ), (q4, a, b)
                checked += 1
    assert checked > 25


def test_requested_values_are_kept():
    rng = np.random.default_rng(11)
    for q in ROBOT.random_q(rng, 60):
        point = kin.fk(ROBOT, q)[:3, 3]
        requested = {"theta4": float(q[3]), "theta5": float(q[4])}
        result = solve_ik(ROBOT, point, task="position", q_seed=q, redundancy=requested)
        assert result.status is Status.SOLVED
        assert any(np.abs(s.q - q).max() < 1e-6 for s in result.solutions)
        assert all(s.q[3] == q[3] and s.q[4] == q[4] for s in result.solutions)


@pytest.mark.full
def test_no_configuration_of_a_dense_search_is_nearer():
    rng = np.random.default_rng(13)
    for q in ROBOT.random_q(rng, 12):
        point, seed = kin.fk(ROBOT, q)[:3, 3], ROBOT.random_q(rng)
        best = solve_ik(ROBOT, point, task="position", q_seed=seed).best
        dense = [
            float(np.linalg.norm(p - seed))
            for q4 in np.linspace(ROBOT.lower[3], ROBOT.upper[3], 60)
            for q5 in np.linspace(ROBOT.lower[4], ROBOT.upper[4], 40)
            for p in (postures(point, q4, q5) + np.pi / 2) % (2 * np.pi) - np.pi / 2
            if ROBOT.in_limits(p)
        ]
        assert dense
        assert best.distance <= min(dense) + 1e-9


def test_a_drag_moves_smoothly():
    """A line through the workspace in steps of 2 mm: no joint jumps."""
    q = ROBOT.q_home.copy()
    point = kin.fk(ROBOT, q)[:3, 3].copy()
    steps = []
    for _ in range(60):
        point += (0.001, 0.0015, 0.0005)
        result = solve_ik(ROBOT, point, task="position", q_seed=q)
        assert result.status is Status.SOLVED, result.reason
        steps.append(np.abs(result.best.q - q).max())
        q = result.best.q
    assert max(steps) < 0.06


def test_an_arm_with_a_base_transform_belongs_to_the_family():
    text = """
    id = "mounted"
    name = "mounted"
    source = "made up"
    convention = "standard"
    units = { length = "mm", angle = "deg" }
    base = { xyz = [100, -50, 30], rpy = [10, 20, 30] }
    rows = [
      { name = "1", d = 130, a = 50, alpha = 90, limits = [-170, 170] },
      { name = "2", a = 170, limits = [-100, 100] },
      { name = "3", theta = 90, alpha = 90, limits = [-120, 120] },
      { name = "4", d = 150, alpha = -90, limits = [-180, 180] },
      { name = "5", alpha = 90, limits = [-110, 110] },
      { name = "tool", kind = "fixed", d = 80 },
    ]
    """
    robot = kin.load_robot(text)
    # The rows are the same; which of them is in front depends on where the arm faces at θ1 = 0.
    assert set(kin.branch_names(robot)) == set(kin.branch_names(ROBOT))
    rng = np.random.default_rng(15)
    for q, seed in zip(robot.random_q(rng, 60), robot.random_q(rng, 60), strict=True):
        point = kin.fk(robot, q)[:3, 3]
        result = solve_ik(robot, point, task="position", q_seed=seed)
        assert result.status is Status.SOLVED
        assert result.solver == "wrist5"
        for s in result.solutions:
            assert np.abs(kin.fk(robot, s.q)[:3, 3] - point).max() < 1e-9
            assert robot.in_limits(s.q)


def test_the_distance_beyond_reach_is_in_metres():
    straight = 0.160 + 0.140 + 0.120
    found = solve_point((0.070 + straight + 0.25, 0.0, 0.130), ROBOT.lower, ROBOT.upper)
    assert np.isnan(found.q).all()
    assert found.gap == pytest.approx(0.25, abs=1e-12)


def whole_turns():
    """Limits wide enough for every branch, also at the edge of the arm's reach."""
    return np.full(5, -math.pi), np.full(5, math.pi)


@pytest.mark.parametrize("wide", [False, True])
def test_the_ends_of_theta4_ranges_are_exact(wide):
    """A solution exists at each end, and 1e-6 beyond it a fine scan of θ5 finds none on that branch."""
    rng = np.random.default_rng(21)
    ends = 0
    for _ in range(6 if wide else 40):
        low, high = whole_turns() if wide else random_limits(rng, 0.3)
        if wide:
            low[:2], high[:2] = (-1.5, -1.0), (1.5, 2.0)
        point = kin.fk(ROBOT, rng.uniform(low, high))[:3, 3]
        rows = solve_point(point, low, high).arcs[0]
        for branch, a, b in rows.tolist():
            for end, beyond in ((a, a - 1e-6), (b, b + 1e-6)):
                if not low[3] < beyond < high[3] or inside(rows[rows[:, 0] == branch], beyond):
                    continue
                ends += 1
                met = solve_point(point, low, high, values=(end, math.nan))
                assert any(fits(point, end, q5, low, high, 1e-6) for q5 in met.values[:, 1] if q5 == q5)
                for q5 in np.linspace(low[4], high[4], 400).tolist():
                    for q in postures(point, beyond, q5):
                        image = q + 2 * math.pi * np.round((0.5 * (low + high) - q) / (2 * math.pi))
                        if ((image > low) & (image < high)).all():
                            sines = np.sin(q[[2, 4]])
                            split = np.abs(sines).min() < 1e-6
                            assert split or FORM.branch_of(q) != branch
    assert ends >= 4


def test_corners_of_the_limits_and_points_above_the_base_are_solved():
    """All joints exactly at limits, some of them locked there: double roots everywhere."""
    values = [(a, 0.5 * (a + b), b) for a, b in zip(ROBOT.lower, ROBOT.upper, strict=True)]
    corners = np.array(np.meshgrid(*values)).reshape(5, -1).T
    for i, q in enumerate(corners):
        point = kin.fk(ROBOT, q)[:3, 3]
        low, high = ROBOT.lower.copy(), ROBOT.upper.copy()
        locked = np.array([(i >> j) % 2 == 1 for j in range(5)])
        low[locked] = high[locked] = q[locked]
        assert solve_ik(ROBOT, point, task="position").status is Status.SOLVED
        rows = solve_point(point, low, high).q
        assert ((rows >= low - SLACK) & (rows <= high + SLACK)).all(axis=1).any(), np.degrees(q)
    low, high = whole_turns()
    for q in np.radians([[0, 0, 90, 0, 90], [30, -60, 45, 180, 60], [10, 20, 30, 40, 0], [0, 0, 0, 0, 0]]):
        point = kin.fk(ROBOT, q)[:3, 3] * (0.0, 0.0, 1.0) if q[4] > 1.0 else kin.fk(ROBOT, q)[:3, 3]
        rows = solve_point(point, low, high).q
        rows = rows[~np.isnan(rows[:, 0])]
        assert len(rows)
        assert np.abs(kin.fk(ROBOT, rows)[:, :3, 3] - point).max() < 1e-9


def test_the_smallest_limit_violation_is_found():
    """It is at most that of the known configuration, where θ5 alone is outside its limit, by 5°."""
    q = np.radians([90, 60, 40, 40, 50])
    point = kin.fk(ROBOT, q)[:3, 3]
    low, high = ROBOT.lower, np.where(np.arange(5) == 4, ROBOT.upper, q)
    found = solve_point(point, low, high)
    rows = found.q[~np.isnan(found.q[:, 0])]
    assert len(rows)
    over = np.maximum(0.0, np.maximum(low - rows, rows - high)).sum(axis=1)
    assert over.min() <= math.radians(5) + 1e-9
    assert np.abs(kin.fk(ROBOT, rows)[:, :3, 3] - point).max() < 1e-9


def test_equal_problems_have_equal_solutions():
    rng = np.random.default_rng(23)
    for q in ROBOT.random_q(rng, 20):
        point = kin.fk(ROBOT, q)[:3, 3]
        first, again = (solve_point(point, ROBOT.lower, ROBOT.upper) for _ in range(2))
        assert np.array_equal(first.q, again.q, equal_nan=True)
        assert all(np.array_equal(a, b) for a, b in zip(first.arcs, again.arcs, strict=True))


def test_gap_is_the_distance_a_dense_search_finds():
    """Without limits, no configuration of a dense sample is nearer than the gap, and some are almost as near."""
    rng = np.random.default_rng(25)
    q = rng.uniform(-math.pi, math.pi, (400_000, 5))
    cloud = kin.fk(ROBOT, q)[:, :3, 3]
    for point in ((0.9, 0.2, 0.3), (0.0, 0.0, 1.0), (-0.3, 0.5, -0.4)):
        gap = solve_point(point, ROBOT.lower, ROBOT.upper).gap
        nearest = float(np.linalg.norm(cloud - np.array(point), axis=1).min())
        assert gap <= nearest <= gap + 0.03
