"""Printed equations of the chapter: which are correct, which are wrong, and by how much."""

from __future__ import annotations

import math

import numpy as np
import pytest

import kin
from app.equations import book, chapter, gram
from app.equations.equation import turned
from app.equations.expression import from_text

# The largest difference of wrong ones inside the limits, as in errata.md: metres, or a pure number.
WRONG = {
    6: 0.14 * math.cos(math.radians(15)),
    13: 0.704416,
    19: 2.3774,
    22: math.sqrt(2),
    25: 4 / math.sqrt(3),
    27: 0.35,
    28: 0.42 * 4 / math.sqrt(3),
}
TURNS = {13: 0.6157384581117262, 19: math.pi, 22: math.pi, 25: math.pi}  # radians, of the axis
ARMS = tuple(chapter.EQUATIONS)
EVALUABLE = [(arm, e) for arm, some in chapter.EQUATIONS.items() for e in some if e.verdict != "unreadable"]
MISPRINTED = [(arm, e) for arm, e in EVALUABLE if e.verdict == "misprinted"]


def label(given):
    return given if isinstance(given, str) else f"({given.number})"


def values_of(arm, equation, q):
    return book(kin.get_robot(arm)).values(equation, q)


def defect(T):
    """Largest entry of |RᵀR − I| for each matrix."""
    return np.abs(gram(T[..., :3, :3])).max(axis=(-1, -2))


def maximum(robot, size):
    """Largest `size(q)` inside the limits: a hill climb with shrinking steps from many random configurations.

    Moving one joint at a time is not enough: for (19) it stops at 2.3746, below the maximum.
    """
    rng = np.random.default_rng(0)
    q = robot.random_q(rng, 10_000)
    q = q[np.argsort(size(q))[-100:]]
    best = size(q)
    step = 0.6
    for _ in range(500):
        moved = rng.random(q.shape) < 0.5
        there = robot.clip(q + step * moved * rng.normal(size=q.shape))
        higher = size(there)
        better = higher > best
        q[better], best[better] = there[better], higher[better]
        step *= 0.97
    return float(best.max())


def test_every_equation_of_the_chapter_is_there():
    numbers = [e.number for some in chapter.EQUATIONS.values() for e in some]
    assert numbers == [*range(3, 16), *range(17, 29)]
    assert {e.number for _, e in MISPRINTED} == set(WRONG)
    assert set(numbers) - {e.number for _, e in EVALUABLE} == {3}


@pytest.mark.parametrize(("arm", "equation"), EVALUABLE, ids=label)
def test_correct_equals_the_dh_product_and_the_verdict_says_whether_the_printed_does(arm, equation):
    """Right ones hold up to rounding error; wrong ones approach their maximum and never exceed it."""
    robot = kin.get_robot(arm)
    values = values_of(arm, equation, robot.random_q(np.random.default_rng(equation.number), 20_000))
    assert np.abs(values.correct - values.dh).max() < 1e-14
    worst = float(np.abs(values.difference).max())
    if equation.verdict == "right":
        assert worst < 1e-14
        assert equation.printed == equation.correct
    else:
        assert 0.8 * WRONG[equation.number] < worst <= WRONG[equation.number] * (1.0 + 3e-5)
        assert equation.note


@pytest.mark.parametrize(("arm", "equation"), MISPRINTED, ids=label)
def test_a_search_inside_the_limits_finds_the_largest_difference_and_no_larger_one(arm, equation):
    found = maximum(kin.get_robot(arm), lambda q: np.abs(values_of(arm, equation, q).difference))
    assert found == pytest.approx(WRONG[equation.number], rel=3e-5)


@pytest.mark.parametrize(("arm", "equation"), MISPRINTED, ids=label)
def test_the_worst_place_is_listed(arm, equation):
    """Of a position where it is farthest off, of an axis where it is turned most: a search finds no more."""
    robot, q = kin.get_robot(arm), np.array(equation.worst)
    assert robot.in_limits(q, 1e-9)
    there = values_of(arm, equation, q)
    if equation.is_length:
        assert abs(there.difference) == pytest.approx(WRONG[equation.number], rel=1e-8)
        return
    assert there.turn == pytest.approx(TURNS[equation.number], rel=1e-9)

    def turn(q):
        return values_of(arm, equation, q).turn

    assert turn(robot.random_q(np.random.default_rng(1), 100_000)).max() <= TURNS[equation.number] + 1e-9
    assert maximum(robot, turn) == pytest.approx(TURNS[equation.number], abs=1e-4)  # at 180° it is a sharp peak


def test_a_turn_is_the_angle_between_the_axis_and_the_printed_vector():
    T = np.eye(4)
    assert turned(T, (0, 2), np.float64(1.0)) == pytest.approx(math.pi / 4)
    assert turned(T, (2, 2), np.float64(-0.1)) == pytest.approx(math.pi)
    assert turned(T, (2, 2), np.float64(0.3)) == 0.0
    assert turned(T, (0, 3), np.float64(0.3)) == 0.0


@pytest.mark.parametrize(("arm", "largest"), [("pioneer5", 1.2346318), ("redundant7", 3.0562825)])
def test_printed_matrix_is_not_a_rotation(arm, largest):
    """The misprints are visible without a reference: RᵀR differs from I, by this much inside the limits."""
    robot = kin.get_robot(arm)
    assert maximum(robot, lambda q: defect(book(robot).as_printed(q))) == pytest.approx(largest, abs=1e-6)


@pytest.mark.parametrize("text", ["c1**2", "f(c1)", "c1.real", "c1 if c2 else c3", "c1 +", "1", "c1; c2", "+c1"])
def test_only_the_notation_is_read(text):
    with pytest.raises(ValueError, match="notation"):
        from_text(text)
