"""Sine, cosine, arc tangent and the fused operation of kernels, as they are written in Python.

That the extension has the same bits is tested in ``tests/kin/codegen/extension``.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from kin.codegen.source import plain
from kin.kernels import simd

sin_cos, atan2, sin_cos_quarters = map(plain, (simd.sin_cos, simd.atan2, simd.sin_cos_quarters))


@pytest.mark.parametrize("x", [0.0, -0.0, 1.5, -(2.0**-1074), math.inf, -math.inf, math.pi])
def test_bits_are_those_of_numpy(x):
    bits = int(np.float64(x).view(np.int64))
    assert simd.bits_of(x) == bits
    assert math.copysign(1.0, simd.float_of(bits)) == math.copysign(1.0, x)
    assert simd.float_of(bits) == x
    assert simd.float_of(bits ^ (2 << 62)) == -x


def test_the_fused_operation_is_rounded_once():
    rng = np.random.default_rng(60)
    for scale in (0, 30, 300):
        for a, b in (rng.normal(size=(300, 2)) * 10.0 ** rng.uniform(-scale / 2, scale / 2, (300, 2))).tolist():
            for c in (-a * b, -a * b * (1.0 + 2.0**-52), 1.0, 1e-320):
                exact = Fraction(a) * Fraction(b) + Fraction(c)
                assert simd.fma(a, b, c) == float(exact)


@pytest.mark.parametrize(
    ("a", "b", "c", "found"),
    [
        (0.0, -1.0, 0.0, 0.0),
        (0.0, -1.0, -0.0, -0.0),
        (-2.0, 3.0, 6.0, 0.0),
        (5e-324, -0.25, 0.0, -0.0),
        (1e200, 1e200, -1.0, math.inf),
        (1e200, -1e200, 1e308, -math.inf),
        (1e200, 1e200, -math.inf, -math.inf),
        (1.0, 1.0, math.inf, math.inf),
        (math.inf, 0.0, 1.0, math.nan),
        (math.inf, 1.0, -math.inf, math.nan),
        (math.nan, 1.0, 1.0, math.nan),
        (1.0, 1.0, math.nan, math.nan),
    ],
)
def test_zeros_infinities_and_nan_of_the_fused_operation(a, b, c, found):
    assert repr(simd.fma(a, b, c)) == repr(found)


def ulps(found, wanted):
    """Largest error in units of the last place (ulp) of the reference value."""
    return (np.abs(found - wanted) / np.spacing(np.abs(wanted))).max()


@pytest.mark.parametrize("scale", [1e-300, 1e-8, 1.0, 10.0, 1e3, simd.WIDE])
def test_sine_and_cosine_match_the_c_library(scale):
    x = np.random.default_rng(6).uniform(-scale, scale, 2000)
    s, c = np.array(list(map(sin_cos, x.tolist()))).T
    assert ulps(s, np.sin(x)) <= 3.0
    assert ulps(c, np.cos(x)) <= 3.0


@pytest.mark.parametrize("step", [0.0, 1e-12, -1e-7, 1e-3])
def test_sine_and_cosine_near_multiples_of_a_right_angle(step):
    x = np.concatenate([np.arange(-500.0, 500.0), np.arange(-60_000.0, 60_000.0, 199.0)]) * (math.pi / 2) + step
    s, c = np.array(list(map(sin_cos, x.tolist()))).T
    assert ulps(s, np.sin(x)) <= 3.0
    assert ulps(c, np.cos(x)) <= 3.0


def test_quarter_turns_are_sine_and_cosine():
    for quarters in np.linspace(-9.0, 9.0, 73).tolist():
        angle = quarters * math.pi / 2.0
        assert sin_cos_quarters(quarters) == pytest.approx((math.sin(angle), math.cos(angle)), abs=1e-10)


@pytest.mark.parametrize("spread", [0.0, 0.1, 3.0, 30.0])
def test_arc_tangent_matches_the_c_library(spread):
    rng = np.random.default_rng(7)
    x, y = rng.normal(size=(2, 2000)) * 10 ** rng.uniform(-spread, spread, (2, 2000))
    assert ulps(np.array(list(map(atan2, y.tolist(), x.tolist()))), np.arctan2(y, x)) <= 3.0


def test_arc_tangent_on_the_axes_and_of_zero():
    y = (0.0, 0.0, 0.0, -0.0, 1.0, -1.0, 1.0, -1.0, math.nan, 1.0)
    x = (0.0, 1.0, -1.0, -1.0, 0.0, 0.0, 1.0, -1.0, 1.0, math.nan)
    wanted = [0, 0, math.pi, math.pi, math.pi / 2, -math.pi / 2, math.pi / 4, -3 * math.pi / 4]
    found = list(map(atan2, y, x))
    assert found[:8] == pytest.approx(wanted, abs=1e-15)
    assert np.isnan(found[8:]).all()


@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_sine_and_cosine_of_nan_are_nan(x):
    assert np.isnan(sin_cos(x)).all()
