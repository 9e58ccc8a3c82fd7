"""Kernels in plain Python: infinities and NaN, powers, whole numbers, and lines are those of compiled ones."""

from __future__ import annotations

import math
import traceback

import numpy as np
import pytest

from kin.kernels.plain import written


def quotient(a, b):
    return a / b


def in_place(values, i, by):
    values[i] /= by
    values[i] **= 2
    values[i] += 1.0
    return values[i]


def power(x, n):
    return x**n


def whole(x):
    return int(x), math.floor(x), math.ceil(x), np.zeros(2, dtype=int).shape[0]


def library(x):
    return math.sqrt(x), math.log(x), math.asin(x), math.exp(x), math.sin(x), math.pi


def sums(a, b):
    total = a
    total = total + b
    return total * b


def fails(a):
    b = a + 1
    return b.nothing


@pytest.mark.parametrize("kind", [float, np.float64])
@pytest.mark.parametrize(
    ("a", "b", "found"),
    [
        (1.0, 0.0, math.inf),
        (1.0, -0.0, -math.inf),
        (-2.0, 0.0, -math.inf),
        (0.0, 0.0, math.nan),
        (math.nan, 0.0, math.nan),
        (math.inf, 0.0, math.inf),
        (-0.0, 4.0, -0.0),
        (1.0, 3.0, 1.0 / 3.0),
    ],
)
def test_a_division_is_that_of_floats(kind, a, b, found):
    assert repr(float(written(quotient)(kind(a), kind(b)))) == repr(found)


def test_a_division_of_arrays_and_of_complex_numbers_is_python_s():
    a, b = np.array([1.0, 0.0, -1.0]), np.zeros(3)
    assert repr(written(quotient)(a, b).tolist()) == "[inf, nan, -inf]"
    z, w = 1.1 - 0.3j, -0.7 + 2.9j
    assert written(quotient)(np.complex128(z), np.complex128(w)) == z / w
    assert np.isnan(written(quotient)(z, 0j))


def test_an_item_is_divided_and_raised_in_place():
    values = np.array([0.0, 6.0])
    assert written(in_place)(values, 1, 2.0) == 10.0
    assert values.tolist() == [0.0, 10.0]
    assert written(in_place)(values, 1, 0.0) == math.inf


def test_a_whole_power_is_multiplied():
    rng = np.random.default_rng(60)
    for x in rng.normal(size=50).tolist():
        square = x * x
        assert written(power)(x, 1) == x
        assert written(power)(x, 2) == square
        assert written(power)(x, 3) == x * square
        assert written(power)(x, 7) == x * square * (square * square)
    assert written(power)(2.0, 0.5) == math.sqrt(2.0)
    assert written(power)(0.0, -1.5) == math.inf
    assert math.isnan(written(power)(-8.0, 1.0 / 3.0))


@pytest.mark.parametrize(
    ("x", "found"), [(2.5, (2, 2, 3)), (-2.5, (-2, -3, -2)), (math.nan, (-(2**63),) * 3), (1e300, (-(2**63),) * 3)]
)
def test_a_whole_number_has_64_bits(x, found):
    assert written(whole)(x) == (*found, 2)


@pytest.mark.parametrize(
    ("x", "found"),
    [
        (1.0, [1.0, 0.0, math.asin(1.0), math.e, math.sin(1.0)]),
        (0.0, [0.0, -math.inf, 0.0, 1.0, 0.0]),
        (-2.0, [math.nan, math.nan, math.nan, math.exp(-2.0), math.sin(-2.0)]),
        (math.inf, [math.inf, math.inf, math.nan, math.inf, math.nan]),
        (1e3, [math.sqrt(1e3), math.log(1e3), math.nan, math.inf, math.sin(1e3)]),
    ],
)
def test_functions_of_the_library_raise_nothing(x, found):
    assert written(library)(x) == pytest.approx((*found, math.pi), rel=0.0, abs=0.0, nan_ok=True)


def test_numbers_of_numpy_that_overflow_are_no_warning():
    assert written(sums)(np.float64(1e308), np.float64(1e308)) == math.inf
    assert written(sums)(np.uint64(2**63), np.uint64(2)) == 4


def test_lines_are_those_of_the_file():
    with pytest.raises(AttributeError) as raised:
        written(fails)(1.0)
    last = traceback.extract_tb(raised.value.__traceback__)[-1]
    assert (last.filename, last.lineno) == (__file__, fails.__code__.co_firstlineno + 2)
    assert last.line == "return b.nothing"
