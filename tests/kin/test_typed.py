"""Numbers that people type: the table of cases, and laws for any text."""

from __future__ import annotations

import itertools
import math
import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from number_cases import DEGREES, MM, READ, REFUSED

from kin.typed import LONGEST, ReadError, elements, read, read_element
from kin.units import LENGTHS, PLAIN, Unit, Units, general

CHOICES = [Units(degrees, length) for degrees, length in itertools.product((True, False), LENGTHS)]
UNITS = [units.of(angle) for units in CHOICES for angle in (True, False)]


@pytest.mark.parametrize(("text", "unit", "value"), READ)
def test_a_text_has_its_value(text: str, unit: Unit, value: float) -> None:
    assert read(text, unit) == pytest.approx(value, rel=1e-15, abs=1e-300)


@pytest.mark.parametrize(("text", "unit", "words"), REFUSED)
def test_a_wrong_text_is_named(text: str, unit: Unit, words: str) -> None:
    with pytest.raises(ReadError) as caught:
        read(text, unit)
    assert words in caught.value.reason
    assert len(caught.value.reason) < 160
    assert caught.value.reason.isprintable()
    for reading in caught.value.readings:
        assert math.isfinite(read(reading, unit))


def test_right_angles_are_exact() -> None:
    for text in ("90", "90°", "pi/2", "90 deg", "1.5*60", "pi/2 rad"):
        assert read(text, DEGREES) == math.pi / 2
    assert math.copysign(1.0, read("-0", DEGREES)) == 1.0


def test_the_limits_of_a_field_decide_about_a_comma() -> None:
    assert read("1,250", MM, (0.0, 1.0)) == pytest.approx(1.25e-3)
    for limits in ((0.0, 2.0), (1.0, 2.0)):
        with pytest.raises(ReadError) as caught:
            read("1,250", MM, limits)
        assert caught.value.readings[-1] == "1250"
        assert ("1.250" in caught.value.readings) == (limits[0] == 0.0)


@given(st.text(max_size=2 * LONGEST), st.sampled_from(UNITS))
def test_any_text_is_a_finite_number_or_refused(text: str, unit: Unit) -> None:
    try:
        value = read(text, unit)
    except ReadError:
        return
    assert math.isfinite(value)


def evaluated(text: str) -> float:
    """The value of a text by Python itself; numbers are made floats, so that 01 is one and powers cannot grow."""
    floats = re.sub(r"\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?", lambda found: repr(float(found[0])), text)
    return float(eval(floats.replace("^", "**"), {"__builtins__": {}}))


@given(st.text(alphabet="0123456789.+-*/()^e ", max_size=30))
def test_what_looks_like_an_expression_is_that_of_python_or_refused(text: str) -> None:
    try:
        value = read(text, PLAIN)
    except ReadError:
        return
    assert value == pytest.approx(evaluated(text), rel=1e-12, abs=1e-300)


numbers = st.floats(-1e4, 1e4).map(lambda x: round(x, 3) + 0.0)
patterns = st.sampled_from(["{a}", "{a}*{b}", "{a}/{b}", "({a}+{b})*{a}", "{a}-{b}", "-({a})/{b}"])


@given(patterns, numbers, numbers, st.sampled_from(UNITS))
def test_arithmetic_is_that_of_floats_in_every_unit(pattern: str, a: float, b: float, unit: Unit) -> None:
    assume(abs(b) > 1e-2)
    text = pattern.format(a=f"({a!r})", b=f"({b!r})")
    expected = unit.read(eval(text, {"__builtins__": {}}))
    for typed in (text, f"({text}) {unit.name}"):
        assert read(typed, unit) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(st.floats(-1e3, 1e3), st.sampled_from(UNITS), st.integers(0, 4))
def test_what_is_written_is_read_back(value: float, unit: Unit, digits: int) -> None:
    half = 0.5 * unit.step(digits) / unit.scale
    for text in (unit.text(value, digits), unit.number(value, digits), str(unit.shown(value, digits))):
        assert read(text, unit) == pytest.approx(value, abs=half * (1 + 1e-6) + 1e-12)
    for other in UNITS:
        if other.is_angle == unit.is_angle:
            assert read(unit.text(value, digits), other) == read(unit.text(value, digits), unit)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 15))
def test_a_number_in_powers_of_ten_is_read_back(value: float, digits: int) -> None:
    assume(value == 0.0 or 1e-300 < abs(value) < 1e300)
    assert read(general(value, digits), PLAIN) == pytest.approx(value, rel=10.0 ** (1 - digits), abs=0.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0.4 0.1 0.3", ["0.4", "0.1", "0.3"]),
        ("0.4, 0.1, 0.3", ["0.4", "0.1", "0.3"]),
        ("1,2,3", ["1", "2", "3"]),
        ("[[1. 0.]\n [0. -1.]]", ["1.", "0.", "0.", "-1."]),
        ("np.array((1, 2, 3))", ["1", "2", "3"]),
        ("(1, 2), (3, 4)", ["1", "2", "3", "4"]),
        ("1 -2 3", ["1", "-2", "3"]),
        ("1-2 3", ["1-2", "3"]),
        ("2*(3+4) (1+1)*2", ["2*(3+4)", "(1+1)*2"]),
        ("400 mm 10cm 0.3 m", ["400 mm", "10cm", "0.3 m"]),
        ("90deg 0 pi/2", ["90deg", "0", "pi/2"]),
        ("(45+45)° 0", ["(45+45)°", "0"]),
        ("0 0 pi", ["0", "0", "pi"]),
        ("1 | 2 ; 3", ["1", "2", "3"]),
        ("1 2 (3", ["1", "2", "3"]),
        ("", []),
    ],
)
def test_a_list_has_these_numbers(text: str, words: list[str]) -> None:
    assert elements(text) == words


@pytest.mark.parametrize(
    ("text", "reason"),
    [("1 - 2 3", "type (1 - 2) or 1 -2"), ("1 2 x", "“x” is not a number"), ("1 2 \x00", "is not a number")],
)
def test_a_list_that_is_unclear_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ReadError, match=re.escape(reason)):
        elements(text)


@given(st.text(alphabet="0123456789.,;-+ ()[]epi°m/", max_size=60))
def test_each_number_of_a_list_stands_in_it(text: str) -> None:
    """Nothing is made up: the numbers, put together, are the text without what separates."""
    try:
        found = elements(text)
    except ReadError:
        return
    assert re.sub(r"[\s,;\[\]()]", "", "".join(found)) == re.sub(r"[\s,;\[\]()]", "", text.lower())


@pytest.mark.parametrize(
    "text", ["(" * 2000, ")" * 500 + "(" * 500 + "1" + ")" * 500, "1+" * 1000, "-" * 2000, "x" * 2000]
)
def test_a_long_text_gets_a_short_message(text: str) -> None:
    for reader in (lambda each: read(each, MM), lambda each: [read_element(part, MM) for part in elements(each)]):
        with pytest.raises(ReadError) as caught:
            reader(text)
        assert len(caught.value.reason) < 200
