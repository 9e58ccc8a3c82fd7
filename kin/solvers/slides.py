"""What the closed forms of arms with several slides share: products of directions, and all but their formulas."""

from __future__ import annotations

from collections.abc import Callable

from kin.kernels.compile import inlined, jit
from kin.kernels.fk import all_finite_pose
from kin.robot import Robot
from kin.solvers.common import clear
from kin.solvers.contract import ClosedForm
from kin.tolerances import TOLERANCES
from kin.transforms import Array

BRANCHES = ("solution 1", "solution 2")
REGULAR = TOLERANCES.regular
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


@inlined
def if_finite(
    configurations: Callable[[Array, Array, Array, Array], object], params: Array, T: Array, near: Array,
    out: Array,
) -> bool:  # fmt: skip
    """out ``(k, n)`` ← the configurations of a target T ``(4, 4)``; False, and NaN, if T is not finite."""
    if not all_finite_pose(T):
        clear(out)
        return False
    configurations(params, T, near, out)
    return True


class SlidesForm(ClosedForm):
    """A closed form with two configurations that have no names and leave nothing free."""

    robot: Robot
    branches = BRANCHES
    lengths = ()
    named = False
