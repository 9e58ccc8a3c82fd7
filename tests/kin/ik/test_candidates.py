"""The kernels between a solver's raw rows and a result, each compared with a version in plain Python."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kin import InputError, fk, get_robot, ik_branches
from kin.ik.candidates import (
    DISTANCE,
    Requirement,
    Rows,
    accept,
    measure_and_sort,
    measure_rows,
    ranges,
    select,
)
from kin.kernels.checks import straighten
from kin.solvers.contract import POSE
from kin.transforms import as_transform, rotation_from_wxyz

angle = st.floats(-10, 10)


def joined(arcs, rows, together, circular):
    out = np.full((4 * len(arcs) + 2, 3), math.nan)
    count = ranges(np.array(arcs, dtype=float).reshape(-1, 3), np.array(rows), together, circular, out)
    return count, [[(a, b) for k, a, b in out[: max(count, 0)].tolist() if k == i] for i in range(len(rows) + 1)]


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 2), angle, st.floats(0, 7)), max_size=8), st.booleans())
def test_ranges_contain_exactly_the_values_of_their_arcs(arcs, circular):
    arcs = [(b, low, low + width) for b, low, width in arcs]
    together = np.array([True, False, True])
    _, found = joined(arcs, [2, 0], together, circular)
    wanted = [[a for a in arcs if a[0] == 2], [a for a in arcs if a[0] == 0], [a for a in arcs if a[0] != 1]]
    for intervals, mine in zip(found, wanted, strict=True):
        assert intervals == sorted(intervals)
        assert all(b[0] > a[1] for a, b in itertools.pairwise(intervals)), "joined where they touch"
        for x in np.linspace(-math.pi, math.pi, 101) if circular else np.linspace(-12, 18, 101):
            images = [x + 2 * math.pi * k for k in range(-3, 5)] if circular else [x]
            depth = max((min(y - low, high - y) for _, low, high in mine for y in images), default=-1.0)
            if abs(depth) > 1e-9:
                assert any(low <= x <= high for low, high in intervals) == (depth > 0)


def test_an_unbounded_range_is_reported():
    assert joined([(0, -math.inf, 1.0)], [0], np.array([True]), False)[0] == -1
    assert joined([], [0], np.array([True]), False) == (0, [[], []])
    assert joined([(0, 3.0, 3.5)], [0], np.array([False]), True)[1][0] == [
        pytest.approx((-math.pi, 3.5 - 2 * math.pi)),
        pytest.approx((3.0, math.pi)),
    ]
    assert joined([(0, 1.0, 9.0)], [0], np.array([True]), True)[1] == [[(-math.pi, math.pi)]] * 2


def test_rows_are_selected_by_rising_key_without_duplicates():
    q = np.array([[3.0, 0.0], [1.0, 0.0], [1.0, 1e-9], [2.0, 0.0], [0.0, 0.0]])
    kept, count = select(q, np.array([3.0, 1.5, 1.0, 2.0, math.inf]))
    assert kept[:count].tolist() == [2, 3, 0]
    kept, count = select(q, np.array([math.nan, 1.0, math.inf, 0.5, math.nan]))
    assert kept[:count].tolist() == [3, 1]


@pytest.mark.parametrize("respect", [True, False])
def test_measuring_and_sorting_in_one_call_equals_separate_steps(respect):
    arm = get_robot("puma560")
    rng = np.random.default_rng(3)
    q = rng.uniform(1.4 * arm.lower, 1.4 * arm.upper, (8, arm.n))
    q[3], q[5] = math.nan, q[2] + 2.0 * math.pi
    T, turns = fk(arm, q[2]), np.full(arm.n, 2.0 * math.pi)
    q[0] = ik_branches(arm, T)[4]
    seed, mask = rng.uniform(arm.lower, arm.upper), np.array([1.0] * 6 + [0.0])
    requirement = Requirement(
        arm.model, mask, arm.lower.copy(), arm.upper.copy(), turns, np.ones(arm.n), POSE, respect
    )
    rows = Rows(q.copy(), np.empty((8, 5)), np.empty(8, bool), np.empty(8, bool), np.empty(8, np.int64))
    count = measure_and_sort(requirement, T, seed, seed, rows)
    twin, stats = q.copy(), np.empty((8, 5))
    measure_rows(requirement, T, seed, seed, twin, stats)
    closed, good = np.empty((2, 8), bool)
    accept(requirement, stats, respect, closed, good)
    kept, expected = select(twin, np.where(good, stats[:, DISTANCE], math.inf))
    assert np.array_equal(rows.q, twin, equal_nan=True)
    assert np.array_equal(rows.stats, stats, equal_nan=True)
    assert (rows.closed.tolist(), rows.good.tolist()) == (closed.tolist(), good.tolist())
    assert rows.order[:count].tolist() == kept[:expected].tolist()
    assert closed[[0, 2, 5]].all()
    assert closed.sum() == 3
    assert count == len({0, 2} & set(np.flatnonzero(good).tolist()))


def test_accepted_rows_meet_the_task_and_the_limits():
    nan = math.nan
    stats = np.array(
        [[0, 0, 1, 0, 0], [0, 0, 1, 0.1, 0], [1e-8, 0, 1, 0, 0], [0, 1e-8, 1, 0, 0], [nan, nan, nan, nan, nan]],
        dtype=float,
    )
    closed, good = np.empty((2, 5), dtype=bool)
    ends = np.array([-1.0]), np.array([1.0])
    requirement = Requirement(get_robot("puma560").model, np.ones(7), *ends, np.zeros(1), np.ones(1), POSE, True)
    assert accept(requirement, stats, True, closed, good) == 1
    assert (closed.tolist(), good.tolist()) == ([True, True, False, False, False], [True] + [False] * 4)
    assert accept(requirement, stats, False, closed, good) == 2
    assert good.tolist() == closed.tolist()
    accept(requirement._replace(position=1e-8), stats, True, closed, good)
    assert closed.tolist() == [True, True, True, False, False]
    accept(requirement._replace(rotation=1e-8), stats, True, closed, good)
    assert closed.tolist() == [True, True, False, True, False]


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.floats(-1, 1), min_size=4, max_size=4),
    st.sampled_from([0.0, 1e-12, 1e-7, 4e-7, 3e-6, 1e-2, 1.0]),
    st.integers(0, 15),
    st.sampled_from([1.0, -1.0, math.nan, math.inf, 3.0]),
)
def test_the_compiled_check_of_a_target_agrees_with_the_one_in_python(wxyz, noise, entry, factor):
    if np.linalg.norm(wxyz) < 1e-3:
        wxyz = [1, 0, 0, 0]
    T = np.eye(4)
    T[:3, :3] = rotation_from_wxyz(np.array(wxyz))
    T[:3, 3] = (0.1, -5.0, 2e7)
    T.flat[entry] = factor if not math.isfinite(factor) else T.flat[entry] * factor + noise
    out = np.empty((4, 4))
    sound = straighten(T, 1e8, out) >= 0.0
    try:
        expected = as_transform(T)
    except InputError:
        assert not sound
    else:
        assert sound
        assert np.abs(out - expected).max() <= 1e-14 * max(1.0, np.abs(expected).max())
