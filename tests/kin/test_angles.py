"""Whole turns: of single angles, of arrays, and inside limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kin.angles import TURN, apart, excess, images_near, nearest_image, wrap, wrapped
from kin.tolerances import TOLERANCES

ANGLES = np.array([0.0, 1e-12, 1.0, -1.0, math.pi, -math.pi, 3.5, -3.5, 7.0, -20.0, 1e3])


def test_wrapped_angles_are_the_same_angles_above_minus_pi():
    for one, many in zip(map(wrap, ANGLES.tolist()), wrapped(ANGLES).tolist(), strict=True):
        assert one == pytest.approx(many, abs=1e-12)
        assert -math.pi < many <= math.pi
    assert np.abs(np.exp(1j * wrapped(ANGLES)) - np.exp(1j * ANGLES)).max() < 1e-12


@pytest.mark.parametrize(
    ("x", "near", "low", "high", "expected"),
    [
        (0.5, 0.0, -1.0, 1.0, 0.5),
        (0.5, 7.0, -10.0, 10.0, 0.5 + TURN),
        (0.5, 7.0, -10.0, 6.0, 0.5),  # the nearest one is outside
        (0.5, -9.0, -5.5, 10.0, 0.5),
        (3.0, 0.0, -4.0, -3.0, 3.0 - TURN),
        (2.0, 0.0, -1.0, 1.0, 2.0),  # none is inside: the least far outside
    ],
)
def test_the_nearest_image_inside_limits(x, near, low, high, expected):
    assert nearest_image(x, near, low, high) == pytest.approx(expected, abs=1e-12)


def test_excess_is_the_distance_of_the_best_image_from_the_limits():
    assert excess(0.5, -1.0, 1.0) == excess(0.5 + TURN, -1.0, 1.0) == 0.0
    assert excess(1.0 + 0.5 * TOLERANCES.limit, -1.0, 1.0) == 0.0
    assert excess(1.5 + TURN, -1.0, 1.0) == pytest.approx(0.5)


def test_images_near_values_and_the_distance_of_configurations():
    assert images_near(np.array([0.1, 7.0]), np.array([6.0, 0.0])) == pytest.approx([0.1 + TURN, 7.0 - TURN])
    a, b = np.array([[0.1, 0.2], [3.1, 0.0]]), np.array([0.1 + TURN, 0.2])
    assert apart(a, b) == pytest.approx([0.0, 3.0])
    assert apart(a, b, np.array([False, True])) == pytest.approx([TURN, TURN - 3.0])
    assert apart(np.empty((2, 0)), np.empty(0)).tolist() == [0.0, 0.0]
