"""What the closed forms of arms with several slides share: products of directions, and all but their formulas."""

from __future__ import annotations

import math

from kin.kernels.compile import jit
from kin.robot import Robot
from kin.solvers.contract import ClosedForm, RedundancyParameter
from kin.transforms import Array

BRANCHES = ("solution 1", "solution 2")
REGULAR = 1e-4  # smallest singular value of the Jacobian, of the largest
ALIKE = 1e-9  # how far beyond ±1 the cosine of an angle may be: rounding error


@jit
def dot(a: Array, b: Array) -> float:
    """a · b of two directions ``(3,)``."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@jit
def triple(a: Array, b: Array, c: Array) -> float:
    """a · (b × c)."""
    return float(
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


@jit
def is_finite(T: Array) -> bool:
    """Whether a target ``(4, 4)`` has no NaN and no infinity."""
    for r in range(4):
        for k in range(4):
            if not math.isfinite(T[r, k]):
                return False
    return True


class SlidesForm(ClosedForm):
    """A closed form with two configurations that have no names and leave nothing free."""

    robot: Robot
    branches = BRANCHES
    lengths = ()
    named = False

    def redundancies(self, task: int) -> tuple[RedundancyParameter, ...]:
        """None."""
        return ()
