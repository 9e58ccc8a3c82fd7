"""Timing of paths: against toppra, limits between the knots, the cost of limited jerk."""

import json
from pathlib import Path

import numpy as np
import pytest

from kin.motion.geometry.splines import parted, spline, values
from kin.motion.timing.check import evaluate_path, slowdowns
from kin.motion.timing.fastest import fastest
from kin.motion.timing.jerk import averaged, rest_to_rest
from kin.motion.timing.timed import JointPath, timed

CASES = json.loads((Path(__file__).parents[2] / "data/motion-times.json").read_text(encoding="utf-8"))["paths"]


def never():
    pass


def path_of(case, intervals, jerk=20.0):
    knots, pieces = np.array(case["knots"]), np.array(case["pieces"])
    parts = np.full(len(pieces), intervals // len(pieces))
    knots, pieces = parted(knots, np.ascontiguousarray(pieces), parts)
    velocity, acceleration = np.array(case["velocity"]), np.array(case["acceleration"])
    row = np.stack([velocity, acceleration, jerk * acceleration], axis=1)
    return JointPath(
        knots, pieces, np.broadcast_to(row, (len(pieces), *row.shape)).copy(), np.full(len(pieces), 1e6)
    )


@pytest.mark.parametrize("case", CASES)
def test_the_time_is_within_one_percent_of_toppra_on_five_times_as_many_intervals(case):
    found = timed(path_of(case, 800), False, never).duration
    assert case["seconds"] * (1 - 1e-4) <= found <= case["seconds"] * 1.01


def ratios(found, limits, times):
    sizes = np.abs(found.at(times)).max(axis=1)[1:]
    return sizes.T / limits


@pytest.mark.parametrize("case", CASES[::2])
def test_limits_are_kept_between_the_knots_too(case):
    path = path_of(case, 100)
    found = timed(path, False, never)
    times = (found.breaks[:-1, None] + np.diff(found.breaks)[:, None] * np.linspace(1e-9, 1 - 1e-9, 40)).ravel()
    worst = ratios(found, path.limits[0], times)[:, :2].max(axis=0)
    assert worst.max() <= 1 + 1e-9
    assert worst.max() > 0.999


@pytest.mark.parametrize("case", CASES[::3])
def test_limited_jerk_is_kept_and_its_cost_is_known(case):
    path = path_of(case, 100)
    found, plain = timed(path, True, never), timed(path, False, never)
    times = (found.breaks[:-1, None] + np.diff(found.breaks)[:, None] * np.linspace(1e-9, 1 - 1e-9, 40)).ravel()
    assert ratios(found, path.limits[0], times).max() <= 1 + 1e-9
    assert found.without == pytest.approx(plain.duration, rel=1e-3)
    assert case["seconds"] * (1 - 1e-4) < found.duration < 1.03 * case["seconds"]
    # With almost no limit of jerk almost nothing is lost.
    assert timed(path_of(case, 100, 1e4), True, never).duration < 1.01 * case["seconds"]


def test_a_straight_path_takes_the_time_of_a_trapezoid():
    s, q = np.linspace(0, 1, 101), np.linspace(0, 2, 101)[:, None]
    limits = np.broadcast_to(np.array([[[1.0, 4.0, 1e9]]]), (100, 1, 3)).copy()
    found = timed(JointPath(s, spline(s, q), limits, np.full(100, 1e6)), False, never)
    assert found.duration == pytest.approx(2.25, rel=2e-3)
    assert found.when(np.array([0.5]))[0] == pytest.approx(found.duration / 2, rel=1e-6)


def test_the_average_keeps_the_ends_and_takes_one_window_longer():
    times, pieces = np.array([0.0, 1.0, 2.0]), np.array([[0, 0, 0.5, 0], [0.5, 1, -0.5, 0]])
    u, s = np.linspace(0, 2.25, 10), np.empty(10)
    averaged(times, pieces, 0.25, u, s)
    assert s[[0, -1]] == pytest.approx([0, 1], abs=1e-12)
    # The integral of t³/6 over a window, in the first half and until the motion has begun everywhere in it.
    assert s[1] == pytest.approx(0.25**3 / 6 / 0.25, abs=1e-12)
    assert s[4] == pytest.approx((1 - 0.75**3) / 6 / 0.25, abs=1e-12)


def test_a_spline_from_rest_to_rest_has_two_derivatives_and_meets_its_points():
    rng = np.random.default_rng(2)
    t, s = np.cumsum(rng.uniform(0.5, 1, 12)), np.sort(rng.uniform(0, 1, 12))
    pieces = np.empty((11, 4))
    rest_to_rest(t, s, pieces)
    h = np.diff(t)[:, None] ** np.arange(4)
    ends = (h * pieces).sum(axis=1)
    assert np.append(pieces[:, 0], ends[-1])[[0, *range(2, 10), 11]] == pytest.approx(s[[0, *range(2, 10), 11]])
    assert ends[:-1] == pytest.approx(pieces[1:, 0])
    slope = (h[:, :3] * pieces[:, 1:] * [1, 2, 3]).sum(axis=1)
    assert slope[:-1] == pytest.approx(pieces[1:, 1])
    bend = (h[:, :2] * pieces[:, 2:] * [2, 6]).sum(axis=1)
    assert bend[:-1] == pytest.approx(2 * pieces[1:, 2])
    assert [pieces[0, 1], pieces[0, 2], slope[-1], bend[-1]] == pytest.approx([0] * 4, abs=1e-12)


def test_a_straight_path_with_limited_jerk_takes_the_time_of_seven_phases():
    s, q = np.linspace(0, 1, 241), np.linspace(0, 2, 241)[:, None]
    limits = np.broadcast_to(np.array([[[1.0, 4.0, 20.0]]]), (240, 1, 3)).copy()
    found = timed(JointPath(s, spline(s, q), limits, np.full(240, 1e6)), True, never)
    best = 2.0 + 1.0 / 4.0 + 4.0 / 20.0
    assert best <= found.duration < 1.01 * best


def test_what_is_between_the_points_is_bounded():
    # q = s² on one interval; s(t) has its largest jerk and acceleration inside its only piece.
    knots, joints = np.array([0.0, 1.0]), np.array([[[0.0, 0.3, 1.0, -0.6]]])
    breaks, clocks = np.array([0.0, 1.0]), np.array([[0.0, 0.2, 1.6, -0.9]])
    limits, out = np.ones((1, 1, 3)), np.empty(1)
    slowdowns(knots, joints, limits, np.full(1, 1e6), breaks, clocks, out)
    found = np.empty((4, 9999, 1))
    evaluate_path(knots, joints, breaks, clocks, np.linspace(0, 1, 9999), found)
    largest = np.abs(found[1:]).max(axis=(1, 2)) ** (1 / np.arange(1, 4))
    assert largest.max() <= out[0] <= 1.3 * largest.max()


def test_at_a_break_that_is_at_a_knot_the_jerk_of_one_side_is_taken():
    # q‴ and the jerk of s(t) jump together.
    knots, breaks = np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.3, 0.7])
    joints = np.array([[[0.0, 1.0, 0.0, 8.0]], [[1.5, 7.0, 12.0, -8.0]]])
    first = np.array([0.0, 1.8, 0.0, (0.5 - 1.8 * 0.3) / 0.3**3])
    speed, bend = 1.8 + 3 * first[3] * 0.09, 3 * first[3] * 0.3
    last = np.array([0.5, speed, bend, (0.5 - speed * 0.4 - bend * 0.16) / 0.4**3])
    clocks, limits, factors = np.array([first, last]), np.ones((2, 1, 3)), np.empty((2, 2))
    sides = np.array([0.3 * (1 - 1e-9), 0.3 * (1 + 1e-9)])
    ends = sides[:, None] + np.array([-1e-10, 1e-10])
    jerks = np.empty((4, 4, 1))
    evaluate_path(knots, joints, breaks, clocks, ends.ravel(), jerks)
    allowed = jerks[3, [0, 2], 0]
    for moved in (-1e-15, 0.0, 1e-15):
        near = clocks.copy()
        near[1, 0] += moved
        found = np.empty((4, 41, 1))
        times = 0.3 + np.arange(-20, 21) * np.spacing(0.3)
        evaluate_path(knots, joints, breaks, near, times, found)
        assert found[3, :20, 0] == pytest.approx(allowed[0], rel=1e-6)
        assert found[3, 20:, 0] == pytest.approx(allowed[1], rel=1e-6)
        slowdowns(knots, joints, limits, np.full(2, 1e6), breaks, near, factors[0])
        slowdowns(knots, joints, limits, np.full(2, 1e6), breaks * 1.1, near / 1.1 ** np.arange(4), factors[1])
        assert factors[1] * 1.1 == pytest.approx(factors[0], rel=1e-9)


def test_where_no_pace_is_found_a_smooth_one_is_slowed_down(monkeypatch):
    path = path_of(CASES[0], 100)
    best = timed(path, True, never).duration
    monkeypatch.setattr("kin.motion.timing.timed._FAILED", 0.0)
    found = timed(path, True, never)
    times = np.linspace(0, found.duration, 20001)
    assert best < found.duration < 10 * best
    assert 0.99 < ratios(found, path.limits[0], times).max() <= 1 + 1e-9
    assert (np.diff(found.passed(times)) >= 0).all()


def test_no_motion_is_not_too_fast():
    pieces = np.zeros((3, 2, 4))
    x = np.empty(4)
    fastest(np.ones(3), pieces, np.ones((3, 2, 2)), np.full(3, 4.0), x)
    assert x[[0, -1]].tolist() == [0.0, 0.0]
    assert x.max() <= 4.0


def test_a_spline_reproduces_cubics_and_has_two_derivatives():
    s = np.array([0.0, 0.3, 0.4, 1.0, 1.7, 2.0])
    q = np.stack([s**3 - s, np.sin(s)], axis=1)
    pieces = spline(s, q)
    at = np.linspace(0, 2, 33)
    assert values(s, pieces, at)[:, 0] == pytest.approx(at**3 - at, abs=1e-12)
    h = np.diff(s)[:-1, None]
    ends = 2 * pieces[:-1, :, 2] + 6 * h * pieces[:-1, :, 3]
    assert ends == pytest.approx(2 * pieces[1:, :, 2], abs=1e-9)
