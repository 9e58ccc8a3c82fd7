"""Units in sentences and on screen: arithmetic, precision, and values that would round to zero."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest

import kin
from kin.units import (
    DEFAULT_UNITS,
    DEGREES,
    LENGTHS,
    RADIANS,
    Unit,
    Units,
    general,
    grouped,
    power,
    typeset,
)

ALL = [Units(degrees, length) for degrees, length in itertools.product((True, False), LENGTHS)]
MM, CM, M = (Units(length=length).lengths for length in LENGTHS)


def test_degrees_and_millimetres_are_the_default() -> None:
    assert Units() == DEFAULT_UNITS == Units(True, "mm")
    assert (DEFAULT_UNITS.angles.name, DEFAULT_UNITS.lengths.name) == ("°", "mm")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (general(12.5), "12.5"),
        (general(-0.0), "0"),
        (general(-1e-3, 3), "−0.001"),
        (general(2.5e-7), "2.5·10⁻⁷"),
        (general(-1.25e12), "−1.25·10¹²"),
        (power(3.21e-8), "3.2·10⁻⁸"),
        (power(9.7e-5, 1), "1·10⁻⁴"),
        (power(0.0), "0"),
        (grouped(1_234_567), "1\u202f234\u202f567"),
        (MM.short(0.35, 6), "350"),
        (MM.short(-1e-12), "0"),
        (MM.brief(-2.5e-9), "−2.5·10⁻⁶ mm"),
        (typeset("off by -2.0e-05 mm, x-1, 5-3, (-4)"), "off by −2.0·10⁻⁵ mm, x-1, 5-3, (−4)"),
    ],
)
def test_numbers_are_written_with_a_true_minus_and_powers_of_ten(text: str, shown: str) -> None:
    assert text == shown


@pytest.mark.parametrize("digits", [0, 1, 2, 3])
def test_every_length_unit_resolves_the_same(digits: int) -> None:
    steps = [unit.step(digits) / unit.scale for unit in (MM, CM, M)]
    assert steps == pytest.approx([1e-3 * 10.0**-digits] * 3)


def test_angles_are_never_coarser_in_radians() -> None:
    for digits in (0, 1, 2):
        assert RADIANS.step(digits) <= math.radians(DEGREES.step(digits))


@pytest.mark.parametrize("units", ALL, ids=str)
@pytest.mark.parametrize("is_angle", [True, False])
def test_a_value_shown_by_a_control_is_read_back(units: Units, is_angle: bool) -> None:
    unit = units.of(is_angle)
    for value in (0.0, 0.123456, -2.5, 3.0):
        assert unit.read(unit.shown(value, 2)) == pytest.approx(value, abs=unit.step(2) / unit.scale)
        assert unit.shown(unit.read(unit.shown(value, 2)), 2) == unit.shown(value, 2)


@pytest.mark.parametrize(
    ("unit", "value", "text"),
    [
        (MM, 0.1234, "123.4 mm"),
        (CM, 0.1234, "12.34 cm"),
        (M, 0.1234, "0.1234 m"),
        (M, -1.5, "−1.5000 m"),
        (MM, -1e-9, "0.0 mm"),
        (M, -1e-9, "0.0000 m"),
        (DEGREES, -math.pi, "−180.0°"),
        (RADIANS, -math.pi, "−3.142 rad"),
    ],
)
def test_a_value_with_its_unit(unit: Unit, value: float, text: str) -> None:
    assert unit.text(value) == text


@pytest.mark.parametrize(
    ("units", "metres", "text"),
    [
        (Units(), 0.00001, "< 0.1 mm"),
        (Units(length="cm"), 0.00001, "< 0.01 cm"),
        (Units(length="m"), 0.00001, "< 0.0001 m"),
        (Units(), 0.00456, "4.6 mm"),
        (Units(length="cm"), 0.00456, "0.46 cm"),
        (Units(length="m"), 0.00456, "0.0046 m"),
        (Units(), 0.1234, "123 mm"),
        (Units(length="cm"), -0.1234, "12.3 cm"),
        (Units(length="m"), 0.1234, "0.123 m"),
        (Units(), 0.0, "0 mm"),
    ],
)
def test_small_lengths_are_not_rounded_to_zero(units: Units, metres: float, text: str) -> None:
    assert units.distance(metres) == units.motion(False, metres) == text


def test_small_angles_are_not_rounded_to_zero() -> None:
    assert DEFAULT_UNITS.angle(math.radians(0.01)) == "< 0.1°"
    assert DEFAULT_UNITS.angle(math.radians(-3.21)) == DEFAULT_UNITS.motion(True, math.radians(3.21)) == "3.2°"
    assert Units(degrees=False).angle(1e-5) == "< 0.001 rad"
    assert Units(degrees=False).angle(-0.5) == "0.500 rad"
    assert DEFAULT_UNITS.angle(0.0) == "0.0°"


def test_round_values_have_no_trailing_zeros() -> None:
    assert [unit.brief(0.005) for unit in (MM, CM, M)] == ["5 mm", "0.5 cm", "0.005 m"]
    assert DEGREES.brief(math.radians(2.0)) == "2°"


@pytest.mark.parametrize(
    ("units", "metres", "text"),
    [
        (Units(), 0.1205, "120.5 mm"),
        (Units(length="cm"), 0.1205, "12.05 cm"),
        (Units(length="m"), 0.1205, "0.1205 m"),
        (Units(), 1.2e-6, "1.2e-03 mm"),
        (Units(length="m"), 1.2e-6, "1.2e-06 m"),
        (Units(), 0.0, "0.0 mm"),
    ],
)
def test_a_length_in_a_sentence_is_never_shown_as_zero(units: Units, metres: float, text: str) -> None:
    assert units.lengths.value(metres) == text


def test_sentences_are_in_the_units_of_the_reader() -> None:
    """Every kind of answer of every arm in other units: no millimetres, no degrees, and the sizes are the same."""
    rng = np.random.default_rng(2)
    seen = set()
    for robot in kin.files.classic_robots().values():
        for k in range(4):
            T = kin.fk(robot, robot.random_q(rng))
            T[:3, 3] *= 1.0 + 0.4 * k
            result = kin.solve_ik(robot, T)
            text = result.explain(Units(False, "m")).text
            assert not re.search(r"°| mm\b", text)
            seen.update(re.findall(r"°| mm\b", result.reason))
            lengths = [float(x) * 1e-3 for x in re.findall(r"([\d.]+(?:e-\d+)?) mm", result.reason)]
            assert [float(x) for x in re.findall(r"([\d.]+(?:e-\d+)?) m\b", text)] == pytest.approx(lengths)
    assert seen == {"°", " mm"}
