"""The kinds find, sort and sketch: what meets the conditions is right, and wrong answers get their reason."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kin
from app.exercises import Exercise, Variant, parse_exercise
from app.exercises.fields import ExerciseFileError
from kin import InputError
from kin.typed import EntryError
from kin.units import Units

UNITS = Units()
HEAD = 'id = "x"\ntitle = "X"\ntopic = "Velocity"\ntext = "?"\nrobot = "planar2r"\n'
PLANAR = kin.get_robot("planar2r")
ON_AXIS = """kind = "find"
[answer]
at = ["30*deg", "-asin(a(1)*sin(30*deg)/a(2)) - 30*deg"]
method = "Bend joint 2 back."
conditions = [
  { text = "on the x axis", holds = "abs(y) < 5*mm", wrong = "Beside it.", value = "y", measure = "length" },
  { text = "joint 1 up", holds = "q(1) > 10*deg", wrong = "Joint 1 is not up." },
]
"""
HELD = """kind = "find"
[target]
q = ["20*deg", "40*deg"]
[answer]
stays = "position"
at = ["20*deg", "40*deg"]
method = "Stay."
conditions = [{ text = "anything", holds = "1", wrong = "Never." }]
"""
SORTED = """kind = "sort"
[answer]
method = "Look."
larger = "heavier"
measure = "length"
items = [
  { text = "c", value = "0.3" },
  { text = "a", value = "0.1" },
  { text = "b", value = "0.2", shown = "two" },
  { text = "other b", value = "0.2" },
  { text = "never", value = "9", offered = "0" },
]
"""


def made(body: str) -> tuple[Exercise, Variant]:
    exercise = parse_exercise(HEAD + body)
    return exercise, exercise.variant(0)


def on_axis(angle: float) -> list[float]:
    """Joints with the tool on the x axis, by the law of sines."""
    l1, l2 = (row.a for row in PLANAR.rows)
    return [angle, -math.asin(l1 * math.sin(angle) / l2) - angle]


@given(st.floats(math.radians(11.0), math.radians(30.0)))
def test_every_posture_that_meets_the_conditions_is_right(angle: float) -> None:
    exercise, variant = made(ON_AXIS)
    q = on_axis(angle)
    assert kin.fk(PLANAR, np.array(q))[1, 3] == pytest.approx(0.0, abs=1e-9)
    assert exercise.judge(variant, q, UNITS).right


def test_a_condition_that_does_not_hold_says_its_value_and_then_the_way() -> None:
    exercise, variant = made(ON_AXIS)
    low = exercise.judge(variant, on_axis(math.radians(5.0)), UNITS)
    assert (low.right, low.credit, low.reason, low.way) == (False, 0.5, "Joint 1 is not up.", "Bend joint 2 back.")
    off = exercise.judge(variant, [0.5, 0.0], UNITS)
    y = 1e3 * kin.fk(PLANAR, np.array([0.5, 0.0]))[1, 3]
    assert off.reason == f"Beside it. Here it is {y:.1f} mm."
    outside = exercise.judge(variant, [on_axis(0.3)[0] + 4.0 * math.pi, on_axis(0.3)[1]], UNITS)
    assert (outside.right, outside.reason) == (False, "Outside its limits: joint 1.")


def test_what_stays_is_judged_by_forward_kinematics() -> None:
    exercise, variant = made(HELD)
    assert "the tool point stays" in exercise.asked(variant, UNITS).note
    T = kin.fk(PLANAR, np.radians([20.0, 40.0]))
    other = kin.solve_ik(PLANAR, T[:3, 3], task="position").solutions
    assert len(other) == 2
    assert all(exercise.judge(variant, s.q.tolist(), UNITS).right for s in other)
    moved = exercise.judge(variant, np.radians([21.0, 40.0]).tolist(), UNITS)
    assert not moved.right
    assert moved.reason.startswith("The tool is ")


@pytest.mark.parametrize("answer", [None, [1.0], ["a", "b"], [math.nan, 0.0], [math.inf, 0.0], {"q": 1}])
def test_what_is_no_configuration_is_refused(answer: object) -> None:
    exercise, variant = made(ON_AXIS)
    with pytest.raises(InputError):
        exercise.judge(variant, answer, UNITS)


def test_every_order_of_equal_things_is_right() -> None:
    exercise, variant = made(SORTED)
    labels, values = exercise.asked(variant, UNITS).labels, {"a": 0.1, "b": 0.2, "other b": 0.2, "c": 0.3}
    assert sorted(labels) == sorted(values)
    for order in itertools.permutations(range(4)):
        sizes = [values[labels[place]] for place in order]
        assert exercise.judge(variant, list(order), UNITS).right == (sizes == sorted(sizes))
    assert "In order: a (100 mm), " in exercise.solution(variant, UNITS)
    assert "b (two)" in exercise.solution(variant, UNITS)


def test_a_wrong_order_names_a_pair_and_not_the_sizes() -> None:
    exercise, variant = made(SORTED)
    labels = exercise.asked(variant, UNITS).labels
    right = [labels.index(name) for name in ("a", "b", "other b", "c")]
    assert exercise.judge(variant, right, UNITS).right
    verdict = exercise.judge(variant, [right[3], *right[:3]], UNITS)
    assert verdict.reason == "“c” stands before “a”, but is heavier."
    assert (verdict.credit, verdict.way) == (0.5, "Look.")


def test_the_first_order_is_never_right() -> None:
    exercise = parse_exercise(HEAD + SORTED)
    for seed in range(20):
        variant = exercise.variant(seed)
        assert not exercise.judge(variant, [0, 1, 2, 3], UNITS).right


@pytest.mark.parametrize(
    "answer", [None, [0, 1], [0, 0, 1, 2], ["0", "1", "2", "3"], [0, 1, 2, True], [0.0, 1, 2, 3]]
)
def test_what_is_no_order_is_refused(answer: object) -> None:
    exercise, variant = made(SORTED)
    with pytest.raises(InputError):
        exercise.judge(variant, answer, UNITS)


@pytest.mark.parametrize(
    ("body", "field"),
    [
        (ON_AXIS.replace('at = ["30', 'at = 5\nold = ["30'), "old"),
        (ON_AXIS.replace('measure = "length"', 'measure = "weight"'), "measure"),
        (HELD.replace('stays = "position"', 'stays = "elbow"'), "stays"),
        (SORTED.replace('text = "a"', 'text = "c"'), "items"),
    ],
)
def test_fields_that_are_not_valid_are_named(body: str, field: str) -> None:
    with pytest.raises(ExerciseFileError, match=field):
        parse_exercise(HEAD + body)


def test_questions_without_an_answer_are_refused() -> None:
    for body in (
        HELD.replace('holds = "1"', 'holds = "0"'),
        HELD.replace('at = ["20*deg", "40*deg"]', "at = [0, 0]"),
        HELD.replace('at = ["20*deg", "40*deg"]', "at = [0]"),
        SORTED.replace("0.1", "0.2").replace("0.3", "0.2"),
    ):
        exercise = parse_exercise(HEAD + body)
        variant = exercise.variant(0)
        with pytest.raises(ValueError):
            exercise.kind.verify(variant)


SKETCH = """kind = "sketch"
[answer]
way = "90*deg"
time = 3
velocity = "50*deg"
acceleration = "50*deg"
method = "The way is the area."
"""


@pytest.mark.parametrize(
    ("cells", "reason"),
    [
        ("0 22.5 45 45 45 22.5 0", ""),
        ("0 20 45 48 45 22 0", ""),  # not symmetric
        ("0° 22.5 45°/s 0.7854 rad/s 45 22.5 0", None),
        ("10 22.5 45 45 45 12.5 0", "It begins and ends at rest: the first and the last value are zero."),
        ("0 20 40 60 40 20 0", "The largest velocity is 60 °/s; its limit 50 °/s."),
        ("0 36 36 36 36 36 0", "The steepest line is an acceleration of 72 °/s²; the limit is 50 °/s²."),
        ("0 20 40 40 40 20 0", "The area under the sketch is 80°; the way is 90°."),
        ("0 -22.5 -45 -45 -45 -22.5 0", "The area under the sketch is −90°; the way is 90°."),
    ],
)
def test_any_sketch_of_the_area_within_the_limits_is_right(cells: str, reason: str | None) -> None:
    exercise, variant = made(SKETCH)
    given = cells.replace(" rad/s", "rad/s").split()
    if reason is None:  # an angle is no velocity
        with pytest.raises(EntryError):
            exercise.judge(variant, given, UNITS)
        return
    verdict = exercise.judge(variant, given, UNITS)
    assert verdict.right == (not reason)
    if reason:
        assert (verdict.reason, verdict.way) == (reason, "The way is the area.")


def test_the_example_of_a_sketch_is_right_in_all_units() -> None:
    exercise, variant = made(SKETCH)
    right = exercise.kind.ask("?", variant, UNITS).right()
    assert exercise.judge(variant, right, Units(degrees=False)).right
    assert exercise.asked(variant, UNITS).labels[1] == "v(0.5 s)"


@pytest.mark.parametrize("answer", [None, [], ["0"] * 6, [0] * 7, "0 0 0 0 0 0 0"])
def test_what_is_no_sketch_is_refused(answer: object) -> None:
    exercise, variant = made(SKETCH)
    with pytest.raises(InputError):
        exercise.judge(variant, answer, UNITS)
