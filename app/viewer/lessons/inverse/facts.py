"""What the lesson "Inverse kinematics" knows: what is asked, and the branches of the target in the scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from app.exercises.lesson_text import texts_of
from app.viewer.declared.facts import Facts
from app.viewer.lessons.guide.outline import Configuration
from app.viewer.lessons.inverse.arm import Arm, arm_of
from app.viewer.lessons.inverse.derive import Signs, arm_angle
from app.viewer.lessons.inverse.exercise import Branch, Exercise, all_branches, exercise
from app.viewer.lessons.inverse.settings import InverseSettings
from app.viewer.lessons.inverse.sheet import StepKey
from app.viewer.lessons.inverse.tree import Node, tree
from kin import Robot


@dataclass(frozen=True, eq=False)
class InverseFacts(Facts[InverseSettings]):
    """See the module; all but `exists` is known only of arms with a derivation."""

    @property
    def exists(self) -> bool:
        """Whether the lesson has a derivation for the arm."""
        return arm_of(self.robot) is not None

    @property
    def derived(self) -> Arm:
        """The arm as its formulas see it."""
        arm = arm_of(self.robot)
        assert arm is not None
        return arm

    @property
    def keys(self) -> tuple[StepKey, ...]:
        """The steps of the derivation."""
        return self.derived.keys

    @property
    def opened(self) -> tuple[bool, ...]:
        """For each step, whether its numbers are on show."""
        s = self.settings
        if self.robot.id not in texts_of("inverse").arms:  # nothing is asked
            return (True,) * len(self.keys)
        return tuple(s.all or answered for answered in s.answered or (False,) * len(self.keys))

    @property
    def exercise(self) -> Exercise:
        """What the questions are about."""
        return _exercise(self.robot, self.settings.q, self.settings.signs)

    @cached_property
    def psi(self) -> float:
        """The arm angle of the derivation (rad); 0 for arms without one."""
        if self.derived.family != "srs7":
            return 0.0
        return self.settings.psi if self.settings.turned else arm_angle(self.derived, self.arm.goal)

    @cached_property
    def branches(self) -> tuple[Branch, ...]:
        """All branches of the target in the scene."""
        return all_branches(self.derived, self.arm.aim, self.arm.goal, self.psi)

    @property
    def followed(self) -> Branch:
        """That of the branch that is followed."""
        return next(one for one in self.branches if one.derivation.signs == self.settings.signs)

    @cached_property
    def tree(self) -> list[Node]:
        """Where the branches fork."""
        return tree(self.branches, self.settings.signs)


@lru_cache(maxsize=16)
def _exercise(robot: Robot, q: Configuration, signs: Signs) -> Exercise:
    arm = arm_of(robot)
    assert arm is not None
    return exercise(arm, np.array(q), signs)
