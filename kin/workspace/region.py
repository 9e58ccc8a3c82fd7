"""The region of joint values that a workspace belongs to: the box that limits and locks leave."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kin.errors import InputError
from kin.ik.options import FREE, JointConstraints
from kin.robot import Robot
from kin.transforms import Array


class BoundedArm(NamedTuple):
    """An arm and its joint limits as compiled functions take them.

    Attributes:
        model: the arm, `Robot.model`.
        lower, upper: ``(n,)`` finite joint limits.
    """

    model: Array
    lower: Array
    upper: Array


@dataclass(frozen=True)
class Region:
    """An arm and the box its joints may move in. Hashable: a key for results that are cached.

    Attributes:
        robot: the arm.
        bounds: (lower, upper) of each joint, equal for a locked one; ±π for a joint without limits.
    """

    robot: Robot
    bounds: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, robot: Robot, constraints: JointConstraints = FREE) -> Region:
        """The region that the constraints leave; raises `InputError` naming the wrong limit or lock."""
        lower, upper, _ = constraints.bounds(robot)
        lower = np.where(np.isfinite(lower), lower, -math.pi)
        upper = np.where(np.isfinite(upper), upper, math.pi)
        return cls(robot, tuple(zip(lower.tolist(), upper.tolist(), strict=True)))

    @classmethod
    def finite(cls, robot: Robot, constraints: JointConstraints = FREE) -> Region:
        """As `of`; raises `InputError` for a slide without limits, which has no end."""
        lower, upper, _ = constraints.bounds(robot)
        for i in np.flatnonzero(~robot.revolute & ~np.isfinite(upper - lower)).tolist():
            expected = "limits, given here or by the robot: it slides without end"
            raise InputError(f"limits of {robot.joints[i].name}", "none", expected)
        return cls.of(robot, constraints)

    @cached_property
    def arm(self) -> BoundedArm:
        """The region as compiled functions take it."""
        return BoundedArm(self.robot.model, self.lower, self.upper)

    @cached_property
    def lower(self) -> Array:
        """Lower limits ``(n,)``."""
        return np.array([low for low, _ in self.bounds])

    @cached_property
    def upper(self) -> Array:
        """Upper limits ``(n,)``."""
        return np.array([high for _, high in self.bounds])

    @cached_property
    def movable(self) -> NDArray[np.bool_]:
        """Which joints are not locked ``(n,)``."""
        return self.upper > self.lower

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.robot, self.bounds))


def checked_integer(field: str, value: object, low: int, high: int, expected: str) -> int:
    """An integer in [low, high]; raises `InputError` naming `field`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise InputError(field, value, expected)
    return int(value)
