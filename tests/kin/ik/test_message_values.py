"""Parts of sentences about joint values."""

from __future__ import annotations

import math

from kin.ik.details import LimitViolation
from kin.ik.messages.values import need
from kin.units import Units

LIMIT = math.radians(45.0)


def test_a_value_outside_its_limits_stands_beside_the_limit():
    violation = LimitViolation(4, "wrist", math.radians(50.0), LIMIT)
    assert need(violation, Units()) == "joint 5 (wrist) at 50.0° (limit 45.0°)"


def test_a_value_that_would_be_written_as_its_limit_is_followed_by_their_distance():
    violation = LimitViolation(4, "wrist", LIMIT + math.radians(0.003), LIMIT)
    assert need(violation, Units()) == "joint 5 (wrist) 3.0e-03° from its limit 45.0°"
    locked = LimitViolation(1, "slide", 0.20001, 0.2, "prismatic", locked=True)
    assert need(locked, Units()) == "joint 2 (slide) 1.0e-02 mm from where it is locked, 200.0 mm"
