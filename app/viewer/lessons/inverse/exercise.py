"""What the questions are about: a target, the branch that is followed, and all branches with their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

import kin
from app.viewer.lessons.inverse.arm import Arm
from app.viewer.lessons.inverse.derive import Signs, arm_angle, branches, row_of, signs_of
from app.viewer.lessons.inverse.sheet import TURN, Derivation
from kin.transforms import Array, rotation_angle, vector_angle

SLACK = 1e-6  # rad: a limit is exceeded by more
PLAIN = 0.1  # of a sine: an example keeps off special angles by as much
ASIDE = math.radians(20.0)
ACROSS = math.radians(-40.0)  # of joint 1 where it is not seen which way the arm bends: across the default view


@dataclass(frozen=True, eq=False)
class Branch:
    """A branch of the target.

    Attributes:
        q: its joint values ``(n,)``, turned whole turns into the limits where that is possible; None if it fails.
        outside: (index of a joint, by how much) for each joint that is outside its limits.
        error: of position (m) and of rotation or direction (rad), by forward kinematics.
    """

    number: int
    name: str
    derivation: Derivation
    q: Array | None
    outside: tuple[tuple[int, float], ...] = ()
    error: tuple[float, float] = (0.0, 0.0)

    @property
    def available(self) -> bool:
        """Whether the arm can take it."""
        return self.q is not None and not self.outside


@dataclass(frozen=True, eq=False)
class Exercise:
    """A target with all its branches.

    Attributes:
        q: a configuration ``(n,)`` that has the tool at the target.
        signs: of the branch that is followed.
        psi: arm angle of an S-R-S arm.
    """

    arm: Arm
    T: Array
    q: Array
    signs: Signs
    psi: float
    branches: tuple[Branch, ...]

    @property
    def followed(self) -> Branch:
        """The branch that is followed."""
        return self.branch(self.signs)

    def branch(self, signs: Signs) -> Branch:
        """The branch of these signs."""
        return next(branch for branch in self.branches if branch.derivation.signs == signs)

    @property
    def way_back(self) -> Branch | None:
        """Where to go on if the branch that is followed ends: the branch most like it that leads to the target,
        within the limits if there is one.
        """
        if self.followed.q is not None:
            return None

        def apart(branch: Branch) -> tuple[bool, int]:
            pairs = zip(branch.derivation.signs, self.signs, strict=True)
            return not branch.available, sum(a != b for a, b in pairs)

        return min((branch for branch in self.branches if branch.q is not None), key=apart, default=None)

    def beside(self, split: int) -> Branch:
        """The branch with the other sign at a split."""
        return self.branch(flipped(self.signs, split))


def flipped(signs: Signs, split: int) -> Signs:
    """The signs with another one at a split."""
    return tuple(-sign if i == split else sign for i, sign in enumerate(signs))


def example(arm: Arm) -> Array:
    """A configuration ``(n,)`` within the limits whose angles are not special: home, with some joints turned."""
    robot, q = arm.robot, arm.robot.q_home.copy()
    for i in range(robot.n):
        if abs(math.sin(arm.angles(q)[i])) < PLAIN:
            if i == 0 and arm.family == "srs7" and robot.lower[0] < ACROSS:
                q[0] += ACROSS
                continue
            q[i] += ASIDE if q[i] + ASIDE <= robot.upper[i] else -ASIDE
    return q


def exercise(arm: Arm, q: Array, signs: Signs | None = None, psi: float | None = None) -> Exercise:
    """The target that the tool has at a configuration ``(n,)``, on its own branch unless others are given."""
    if psi is None:
        psi = arm_angle(arm, q) if arm.family == "srs7" else 0.0
    T = kin.fk(arm.robot, q)
    return Exercise(arm, T, q, signs_of(arm, q) if signs is None else signs, psi, all_branches(arm, T, q, psi))


def all_branches(arm: Arm, T: Array, near: Array, psi: float) -> tuple[Branch, ...]:
    """All branches of a target ``(4, 4)``, judged by forward kinematics and by the joint limits."""
    return tuple(
        _judged(arm, T, near, number, found) for number, found in enumerate(branches(arm, T, near, psi), 1)
    )


def _judged(arm: Arm, T: Array, near: Array, number: int, found: Derivation) -> Branch:
    name = name_of(arm, found)
    if found.q is None:
        return Branch(number, name, found, None)
    robot = arm.robot
    q = np.array(
        [_inside(x, y, *pair) for x, y, *pair in zip(found.q, near, robot.lower, robot.upper, strict=True)]
    )
    excess = np.maximum(q - robot.upper, robot.lower - q)
    outside = tuple((int(i), float(excess[i])) for i in np.flatnonzero(excess > SLACK))
    return Branch(number, name, found, q, outside, error_of(arm, found.q, T))


def _inside(x: float, near: float, low: float, high: float) -> float:
    """The image of an angle inside the limits that is nearest to another one; the least far outside if none is."""
    images = [x + TURN * k for k in range(-2, 3)]
    return min(images, key=lambda v: (max(v - high - SLACK, low - SLACK - v, 0.0), abs(v - near)))


def error_of(arm: Arm, q: Array, T: Array) -> tuple[float, float]:
    """By how much the tool misses a target ``(4, 4)`` at q ``(n,)``, in what the derivation is to reach."""
    F = kin.fk(arm.robot, q)
    position = float(np.linalg.norm(F[:3, 3] - T[:3, 3]))
    if arm.robot.n == 2:
        return position, 0.0
    turn = vector_angle(F[:3, 2], T[:3, 2]) if arm.robot.n == 5 else rotation_angle(F[:3, :3], T[:3, :3])
    return position, float(turn)


def name_of(arm: Arm, found: Derivation) -> str:
    """The name of a branch, as everywhere in the page."""
    if arm.names and arm.family != "planar":
        return arm.names[row_of(arm, found.signs)]
    if found.q is None:
        return "elbow positive" if found.signs[0] > 0 else "elbow negative"
    return kin.branch_of(arm.robot, found.q)


def part_of(arm: Arm, found: Derivation, split: int) -> str:
    """What the choice at a split is called: shoulder front, for one."""
    return name_of(arm, found).split(" · ")[split]
