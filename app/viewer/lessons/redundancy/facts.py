"""What the lesson "Redundancy" knows: the parameters of the arm where it is heading, and how exactly it holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from app.viewer.declared.facts import Facts
from app.viewer.lessons.redundancy import views
from app.viewer.lessons.redundancy.ring import Circle, Ring, coaxial, elbow_circle
from app.viewer.lessons.redundancy.settings import Held, RedundancySettings
from app.viewer.self_motion import leaders, redundancy_at
from kin.ik import Redundancy


@dataclass(frozen=True, eq=False)
class RedundancyFacts(Facts[RedundancySettings]):
    """See the module."""

    @property
    def is_held(self) -> bool:
        """Whether the arm is where the lesson has sent it."""
        held = self.settings.held
        return held is not None and np.array_equal(held.q, self.arm.goal)

    @cached_property
    def held(self) -> Held:
        """Where the tool is held: where it is heading, if something else has moved the arm."""
        held = self.settings.held
        return held if held is not None and self.is_held else Held.at(self.robot, self.arm.goal)

    @property
    def ring(self) -> Ring | None:
        """What the ring is about, once the ends of the ranges are known."""
        found: Ring | None = self.work("ring").value
        return found

    @cached_property
    def exact(self) -> tuple[Redundancy, ...]:
        """The parameters of a closed form."""
        return redundancy_at(self.robot, self.held.T, self.arm.options, self.arm.goal)

    @property
    def numeric(self) -> bool:
        """Whether joints of the null space lead instead."""
        return not self.exact

    @cached_property
    def parameters(self) -> tuple[Redundancy, ...]:
        """What can be changed while the tool is held."""
        return self.exact or leaders(self.robot, self.arm.goal, self.arm.task, self.locked)

    @property
    def item(self) -> Redundancy | None:
        """The parameter that is changed: the chosen one, or the first."""
        chosen = (item for item in self.parameters if item.name == self.settings.free)
        return next(chosen, self.parameters[0] if self.parameters else None)

    @property
    def locked(self) -> tuple[int, ...]:
        """The joints that are locked."""
        return tuple(i for i, lock in enumerate(self.arm.locks) if lock)

    @property
    def trades(self) -> bool:
        """Whether the parameter only turns two coaxial joints against each other."""
        item = self.item
        return item is not None and item.name == "theta1" and not self.numeric and coaxial(self.robot)

    @cached_property
    def circle(self) -> Circle | None:
        """The elbow's circle at the configuration in the scene."""
        return elbow_circle(self.robot, self.q)

    @cached_property
    def residual(self) -> tuple[float, float | None]:
        """Position and rotation error of the tool in the scene, by forward kinematics."""
        return views.residual(self.T, self.held.T, self.arm.task)

    @cached_property
    def moved(self) -> float | None:
        """How far the arm has moved (m) where it should not: in a trade of two coaxial joints."""
        if not self.trades:
            return None
        return float(np.linalg.norm(views.frame_origins(self.robot, self.q) - self.held.shape, axis=1).max())

    @cached_property
    def idea(self) -> str:
        """The redundancy in a sentence or two."""
        robot, task = self.robot, self.arm.task
        if self.numeric and self.parameters:
            return views.numeric_idea(robot, task, self.locked)
        elbow = elbow_circle(robot, self.arm.goal) is not None
        return views.idea(robot, task, self.exact, coaxial(robot), elbow)
