"""Profiles for teaching: boundary conditions, limits, and what each of them minimises."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import kin
from app.viewer import profiles

value = st.floats(-5, 5)
size = st.floats(0.1, 10)


def ends(profile):
    return profile.sample([0.0, profile.duration])


@given(value, value, size, value, value)
def test_a_cubic_meets_positions_and_velocities(start, end, duration, v0, v1):
    found = ends(profiles.cubic(start, end, duration, v0, v1))
    scale = 1e-9 * (1 + duration + 1 / duration)
    assert found[0] == pytest.approx([start, end], abs=scale)
    assert found[1] == pytest.approx([v0, v1], abs=scale)


@given(value, value, size, value, value, value, value)
def test_a_quintic_meets_accelerations_too(start, end, duration, v0, v1, a0, a1):
    found = ends(profiles.quintic(start, end, duration, v0, v1, a0, a1))
    for row, pair in zip(found, ((start, end), (v0, v1), (a0, a1)), strict=False):
        assert row == pytest.approx(pair, abs=1e-9 * (1 + duration + 1 / duration**2) ** 2)


@given(value, value, size, size, st.floats(0, 1), st.floats(0, 1))
def test_a_trapezoid_keeps_its_limits_and_is_continuous(start, end, v, a, part0, part1):
    sign = 1 if end >= start else -1
    v0, v1 = sign * part0 * v, sign * part1 * v
    assume(abs(v1**2 - v0**2) <= 2 * a * abs(end - start))
    profile = profiles.trapezoidal(start, end, v, a, v0, v1)
    found = ends(profile)
    assert found[0] == pytest.approx([start, end], abs=1e-9)
    if profile.duration > 0:
        assert found[1] == pytest.approx([v0, v1], abs=1e-9)
    inner = profile.sample(np.linspace(0, profile.duration, 101))
    assert np.abs(inner[1]).max() <= v * (1 + 1e-9)
    assert np.abs(inner[2]).max() <= a * (1 + 1e-9)
    assert np.abs(np.diff(inner[0])).max() <= v * profile.duration / 100 * (1 + 1e-6) + 1e-12


def test_minimum_jerk_has_the_smallest_squared_jerk():
    def cost(profile):
        jerk = profile.sample(np.linspace(0, 1, 20001))[3]
        return float((jerk**2).mean())

    least = cost(profiles.minimum_jerk(0, 1, 1, 0.3, -0.2))
    for a0, a1 in ((0.5, 0), (-0.5, 0), (0, 1)):
        # Other curves with the same ends: add a polynomial that vanishes there with two derivatives.
        bent = profiles.minimum_jerk(0, 1, 1, 0.3, -0.2)
        times = np.linspace(0, 1, 20001)
        bump = np.polynomial.Polynomial([0, 0, 0, 1]) * np.polynomial.Polynomial([1, -1]) ** 3
        jerk = bent.sample(times)[3] + (a0 + a1) * bump.deriv(3)(times)
        assert float((jerk**2).mean()) > least
    assert least == pytest.approx(cost(profiles.quintic(0, 1, 1, 0.3, -0.2)))


@given(value, value, size, size, size)
def test_an_s_curve_is_slower_than_a_trapezoid_by_its_jerk(start, end, v, a, j):
    smooth, sharp = profiles.s_curve(start, end, v, a, j), profiles.trapezoidal(start, end, v, a)
    assert ends(smooth)[0] == pytest.approx([start, end], abs=1e-9)
    assert smooth.duration >= sharp.duration * (1 - 1e-12)
    assert profiles.s_curve(start, end, v, a, 1e9).duration == pytest.approx(sharp.duration, abs=1e-6)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: profiles.cubic(0, 1, 0), "duration"),
        (lambda: profiles.cubic(0, float("nan"), 1), "end"),
        (lambda: profiles.trapezoidal(0, 1, 1, -1), "acceleration"),
        (lambda: profiles.trapezoidal(0, 1, 1, 1, v_start=-0.5), "v_start"),
        (lambda: profiles.trapezoidal(0, 0.1, 5, 1, v_start=0, v_end=4), "v_end"),
        (lambda: profiles.s_curve(0, 1, 1, 1, 0), "jerk"),
    ],
)
def test_what_cannot_be_names_the_field(call, field):
    with pytest.raises(kin.InputError, match=f"^{field}:"):
        call()


@pytest.mark.parametrize("jerk", [1e6, 1e12, 2e17, 1e20])
def test_a_large_jerk_does_not_exceed_the_acceleration(jerk):
    profile = profiles.s_curve(0.0, 0.33, 1, 4, jerk)
    times = np.linspace(0.0, profile.duration, 1001)
    assert (np.abs(profile.sample(times)[2]) <= 4 * (1 + 1e-9)).all()
