"""Timing of paths: against toppra, limits between the knots, the cost of limited jerk."""

import json
from pathlib import Path

import numpy as np
import pytest

from kin.motion.geometry.splines import parted, spline, values
from kin.motion.timing.fastest import fastest
from kin.motion.timing.timed import JointPath, averaged, timed

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
    assert found.without == pytest.approx(plain.duration, rel=1e-6)
    assert plain.duration < found.duration < 1.25 * plain.duration
    # With almost no limit of jerk almost nothing is lost.
    assert timed(path_of(case, 100, 1e5), True, never).duration < 1.01 * plain.duration


def test_a_straight_path_takes_the_time_of_a_trapezoid():
    s, q = np.linspace(0, 1, 101), np.linspace(0, 2, 101)[:, None]
    limits = np.broadcast_to(np.array([[[1.0, 4.0, 1e9]]]), (100, 1, 3)).copy()
    found = timed(JointPath(s, spline(s, q), limits, np.full(100, 1e6)), False, never)
    assert found.duration == pytest.approx(2.25, rel=2e-3)
    assert found.when(0.5) == pytest.approx(found.duration / 2, rel=1e-6)


def test_the_average_keeps_the_ends_and_takes_one_window_longer():
    times, pieces = np.array([0.0, 1.0, 2.0]), np.array([[0, 0, 0.5, 0], [0.5, 1, -0.5, 0]])
    breaks, clocks = averaged(times, pieces, 0.25)
    assert breaks.tolist() == [0.0, 0.25, 1.0, 1.25, 2.0, 2.25]
    end = clocks[-1] @ (0.25 ** np.arange(4))
    assert (clocks[0, 0], end) == (0.0, pytest.approx(1.0, abs=1e-12))
    assert clocks[:, 3] * 6 == pytest.approx([4, 0, -8, 0, 4], abs=1e-12)


def test_no_motion_is_not_too_fast():
    pieces = np.zeros((3, 2, 4))
    x = np.empty(4)
    fastest(np.ones(3), pieces, np.ones((3, 2)), np.ones((3, 2)), np.full(3, 4.0), x)
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
