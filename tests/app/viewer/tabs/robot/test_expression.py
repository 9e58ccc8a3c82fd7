"""Numbers and simple expressions in the cells of the table."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.viewer.tabs.robot.expression import LONGEST, ExpressionError, read
from kin.units import Units

DEGREES, RADIANS = Units().angles, Units(degrees=False).angles
MM, CM, M = (Units(length=name).lengths for name in ("mm", "cm", "m"))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("90", math.pi / 2),
        ("-90°", -math.pi / 2),
        ("−90 °", -math.pi / 2),
        ("pi/2", math.pi / 2),
        ("-π / 2", -math.pi / 2),
        ("PI", math.pi),
        ("2*pi/3", 2 * math.pi / 3),
        ("2pi/3", 2 * math.pi / 3),
        ("pi/2 + 90", math.pi),
        ("1/3", math.radians(1 / 3)),
        ("(45+45)°", math.pi / 2),
        ("--45", math.pi / 4),
        ("1.5708 rad", 1.5708),
        ("12,5", math.radians(12.5)),
        ("0,125", math.radians(0.125)),
        ("1,0005", math.radians(1.0005)),
        ("1000,125", math.radians(1000.125)),
        ("1e1", math.radians(10)),
        (".5", math.radians(0.5)),
        ("5.", math.radians(5)),
        ("3×30", math.pi / 2),
        ("180÷2", math.pi / 2),
        ("2-3-4", math.radians(-5)),
        ("8/4/2", math.radians(1)),
        ("2+3*4", math.radians(14)),
        ("(2+3)*4", math.radians(20)),
        ("-0", 0.0),
    ],
)
def test_an_angle_in_degrees(text, value):
    assert read(text, DEGREES, True) == pytest.approx(value, abs=1e-15)


def test_right_angles_are_exact():
    for text in ("90", "90°", "pi/2", "90 deg", "1.5*60"):
        assert read(text, DEGREES, True) == math.pi / 2
    assert read("pi/2", RADIANS, True) == math.pi / 2
    assert math.copysign(1.0, read("-0", DEGREES, True)) == 1.0


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("350", MM, 0.35),
        ("2*0.35", M, 0.7),
        ("0.35 m", MM, 0.35),
        ("35 cm + 50", MM, 0.4),
        ("100*pi", MM, 0.1 * math.pi),
        ("pi m", MM, math.pi),
        ("12", CM, 0.12),
    ],
)
def test_a_length(text, unit, value):
    assert read(text, unit, False) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("9o", "“9o” is not a number (unknown: o); try -90 or pi/2"),
        ("", "the cell is empty"),
        ("  ", "the cell is empty"),
        ("1,000", "the comma in “1,000” may separate thousands or decimals; type 1000 or 1.000"),
        ("2*(-12,500)", "the comma in “12,500” may separate thousands or decimals; type 12500 or 12.500"),
        ("1,000.5", "the comma in “1,000.5” may separate thousands or decimals; type 1000.5"),
        ("1,000,000", "the comma in “1,000,000” may separate thousands or decimals; type 1000000"),
        ("1" + ",000" * 14, "type 1000000"),
        ("1/0", "divides by zero"),
        ("1e999", "too large"),
        ("1e9", "too large"),
        ("(1", "a bracket is open"),
        ("1)", "is not a number"),
        ("1 2", "is not a number"),
        ("1+", "is not a number"),
        ("*2", "is not a number"),
        ("pi2", "is not a number"),
        ("nan", "unknown: nan"),
        ("inf", "unknown: inf"),
        ("5 mm", "unknown: mm"),
        ("pi*pi", "units do not cancel"),
        ("1/90°", "units do not cancel"),
        ("90°°", "is not a number"),
        ("90° rad", "is not a number"),
        ("pi°", "a unit after a unit"),
        ("2**3", "is not a number"),
        ("0x10", "is not a number"),
        ("1_000", "is not a number"),
        ("__import__('os').system('true')", "is not a number"),
        ("<script>alert(1)</script>", "is not a number"),
        ("pi.real", "is not a number"),
        ("١٢", "is not a number"),
        ("9" * 61, "too long"),
        ("9" * 4000, "too long"),
        ("9" * 60, "too large"),
        ("(" * 60, "is not a number"),
        ("-" * 60, "is not a number"),
        ("\u202e90\u202c", "is not a number"),
        ("9\x000", "is not a number"),
    ],
)
def test_a_wrong_text_is_named(text, words):
    with pytest.raises(ExpressionError) as caught:
        read(text, DEGREES, True)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 130
    assert str(caught.value).isprintable()


@given(st.text(max_size=2 * LONGEST))
def test_any_text_is_a_finite_number_or_refused(text):
    try:
        value = read(text, DEGREES, True)
    except ExpressionError:
        return
    assert math.isfinite(value)


@given(st.text(alphabet="0123456789.+-*/()pi° erad", max_size=40))
def test_what_looks_like_an_expression_is_one_or_refused(text):
    try:
        value = read(text, MM, False)
    except ExpressionError:
        return
    assert math.isfinite(value)


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5).filter(lambda x: abs(x) > 1e-3))
def test_arithmetic_is_that_of_floats(a, b):
    assert read(f"({a!r}) + {b!r}", M, False) == pytest.approx(a + b)
    assert read(f"{a!r} / ({b!r})", M, False) == pytest.approx(a / b) if abs(a / b) < 1e6 else True
