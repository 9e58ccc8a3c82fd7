"""What is said about a wrong number: which mistake it is, in words that are true of both numbers."""

from __future__ import annotations

import math

import pytest

from app.exercises.kinds.number import OTHER
from app.exercises.questions import Mistake, Number, apart, count
from app.exercises.typed import QUANTITIES, read_number, units_like
from kin.typed import EntryError
from kin.units import DEGREES, PLAIN, RADIANS, Unit

SPEED, TORQUE = Unit("m/s", 1.0, 3), Unit("N·m", 1.0, 2)
RATE = Unit("°/s", 180.0 / math.pi, 0)
WAY = "Draw it."


def asked(answer: float, unit: Unit, **more: object) -> Number:
    return Number("?", answer, unit, 0.005 * abs(answer), WAY, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("typed", "unit", "value"),
    [
        ("160 mm/s", SPEED, 0.16),
        ("16cm / s", SPEED, 0.16),
        ("0,16", SPEED, 0.16),
        ("2*0.08 m/s", SPEED, 0.16),
        ("90", RATE, math.pi / 2),
        ("90 °/s", RATE, math.pi / 2),
        ("90 deg/s", RATE, math.pi / 2),
        ("pi/2 rad/s", RATE, math.pi / 2),
        ("−4870 N mm", TORQUE, -4.87),
        ("-4.87 Nm", TORQUE, -4.87),
        ("-4.87 N*m", TORQUE, -4.87),
        ("2 kN", Unit("N", 1.0, 2), 2000.0),
        ("20 ms", Unit("s", 1.0, 3), 0.02),
    ],
)
def test_numbers_are_read_in_other_units_of_the_quantity(typed: str, unit: Unit, value: float) -> None:
    assert read_number(typed, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("typed", "unit"),
    [("160 mm", SPEED), ("3 °", SPEED), ("1/s", SPEED), ("2 mN", TORQUE), ("5 rad", RATE), ("", RATE)],
)
def test_another_quantity_is_refused_with_the_units_there_are(typed: str, unit: Unit) -> None:
    with pytest.raises(EntryError) as refused:
        read_number(typed, unit)
    detail = refused.value.detail
    assert detail.endswith(f"units: {', '.join(units_like(unit))}.")
    assert "units: none" not in detail


def test_every_unit_of_an_exercise_has_its_quantity() -> None:
    for name in OTHER:
        assert sum(name in known for known in QUANTITIES) == 1
        assert units_like(Unit(name, 1.0, 2))[name] == 1.0


THIRTY, SIZE = math.radians(30.0), 0.6


@pytest.mark.parametrize(
    ("question", "typed", "said"),
    [
        (
            asked(THIRTY, DEGREES),
            "0.5236",
            "This is the value in radians. The unit is degrees; or type rad after it.",
        ),
        (
            asked(THIRTY, DEGREES),
            "-0.5236",
            "This is the value in radians, with the wrong sign. The unit is degrees;",
        ),
        (asked(THIRTY, RADIANS), "30", "This is the value in degrees."),
        (asked(THIRTY, DEGREES), "-30", "The size is right, the sign is not."),
        (asked(THIRTY, DEGREES), "390", "This is a whole turn too much."),
        (asked(THIRTY, DEGREES), "-330", "A whole turn is missing."),
        (asked(THIRTY, DEGREES), "60", "The two angles make a right angle: were sine and cosine exchanged?"),
        (
            asked(THIRTY, DEGREES),
            "150",
            "The two angles make half a turn: is it the other angle of the two lines?",
        ),
        (asked(THIRTY, DEGREES), "41", "Too large."),
        (asked(-THIRTY, DEGREES), "-41", "The size is too large."),
        (asked(-THIRTY, DEGREES), "41", "The sign is not right, and the size is too large."),
        (asked(-THIRTY, DEGREES), "11", "The sign is not right, and the size is too small."),
        (asked(0.16, SPEED), "160", "This is the value in mm/s. The unit is m/s; or type mm/s after it."),
        (asked(2.007, RATE), "2.007", "This is the value in rad/s. The unit is °/s; or type rad/s after it."),
        (asked(2.007, RATE), "-115", "The size is right, the sign is not."),
        (
            asked(SIZE, PLAIN),
            "0.8",
            "The squares of this and of the right value add up to 1: were sine and cosine",
        ),
        (asked(SIZE, PLAIN), "0.3", "This is half the right value."),
        (asked(SIZE, PLAIN), "1.2", "This is twice the right value."),
        (asked(SIZE, PLAIN), "0.7", "Too large."),
        (asked(SIZE, PLAIN), "0", "Too small."),
        (asked(SIZE, PLAIN), "60", "This is the value in per cent. Type % after it."),
        (asked(-SIZE, PLAIN), "60", "This is the value in per cent, with the wrong sign. Type % after it."),
    ],
)
def test_the_mistake_is_named_before_the_way(question: Number, typed: str, said: str) -> None:
    verdict = question.judge(question.read_text(typed))
    assert not verdict.right
    assert verdict.reason.startswith(said)
    assert verdict.way == WAY
    assert WAY not in verdict.reason


@pytest.mark.parametrize(
    ("question", "typed", "said"),
    [
        (Number("?", 0.0, PLAIN, 0.01, WAY), "1", "Too large."),
        (Number("?", 0.0, PLAIN, 0.01, WAY), "0.015", "Too large."),
        (Number("?", 0.0, PLAIN, 0.01, WAY), "-1", "The size is too large."),
        (Number("?", 0.0, SPEED, 0.001, WAY), "1", "Too large."),
        (Number("?", 0.001, SPEED, 0.001, WAY), "1.5", "Too large."),
    ],
)
def test_beside_zero_no_number_is_right_in_another_unit_or_twice_too_large(
    question: Number, typed: str, said: str
) -> None:
    verdict = question.judge(question.read_text(typed))
    assert not verdict.right
    assert verdict.reason == said


def test_a_known_mistake_goes_before_a_relation() -> None:
    question = asked(THIRTY, DEGREES, mistakes=(Mistake(math.radians(60.0), "That is the angle to y."),))
    assert question.judge(math.radians(60.0)).reason == "That is the angle to y."


@pytest.mark.parametrize("typed", ["60 %", "60%", " 0.6", "3/5"])
def test_a_share_is_read_in_per_cent(typed: str) -> None:
    question = asked(SIZE, PLAIN)
    assert question.judge(question.read_text(typed)).right
    with pytest.raises(EntryError):
        count("?", 2, WAY).read_text("200 %")


def test_the_value_in_another_unit_goes_before_a_mistake_that_is_near_it() -> None:
    one = math.radians(1.0)
    question = Number("?", 1.0, DEGREES, 0.02, WAY, (Mistake(0.02, "Divide by it."),))
    assert question.judge(one).reason.startswith("This is the value in radians.")
    assert question.judge(0.02).reason == "Divide by it."
    assert question.tolerance_text == "± 1.1°"


def test_what_no_right_value_can_be_is_said_of_all_larger_sizes() -> None:
    reason = "It is a cosine: between −1 and 1."
    question = apart(asked(-SIZE, PLAIN, mistakes=(Mistake(0.8, "The sine."), Mistake(1.0, reason, beyond=True))))
    assert question.judge(77.0).reason == question.judge(-1.2).reason == reason
    assert question.judge(77.0).way == WAY
    assert question.judge(0.8).reason == "The sine."
    assert question.judge(1.0).reason == "The sign is not right, and the size is too large."


def test_relations_are_not_said_of_counts_and_whole_turns() -> None:
    whole = asked(THIRTY, DEGREES, whole_turns=True)
    assert whole.judge(math.radians(390.0)).right
    joint = Number("?", 2.0, PLAIN, 0.1, WAY, ordered=False)
    assert joint.judge(1.0).reason == "", "the number of a joint is no size"
