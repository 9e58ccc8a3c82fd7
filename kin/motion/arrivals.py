"""Where a segment arrives, beside the joint values its target was recorded with.

A pose has several configurations. A line or an arc of the tool follows its curve from where the arm is, without a
change of posture, so it may meet the pose of a target that was given by joint values in another configuration. An
`Arrival` says in which one, and by how much each joint differs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from kin.ik import branch_names, branch_of
from kin.motion.program import JointTarget, Move
from kin.robot import Robot
from kin.transforms import Array

OTHERWISE = 1e-3  # radians or metres: a joint that differs by more arrives otherwise


@dataclass(frozen=True, slots=True, eq=False)
class Arrival:
    """The configuration in which a segment meets its target; with a blend, in which it would.

    Attributes:
        robot: the arm.
        q: joint values ``(n,)``, radians or metres.
        recorded: the joint values of the target ``(n,)``; None where it is a pose.
    """

    robot: Robot = field(repr=False)
    q: Array
    recorded: Array | None = None

    @classmethod
    def of(cls, robot: Robot, segment: Move, q: Array) -> Arrival:
        """The arrival of a segment at q ``(n,)``."""
        target = getattr(segment, "target", None)
        recorded = np.array(target.q) if isinstance(target, JointTarget) else None
        return cls(robot, q, recorded)

    @property
    def posture(self) -> str | None:
        """Name of the branch; None if the arm's branches have no names."""
        return self._named(self.q)

    @property
    def recorded_posture(self) -> str | None:
        """Name of the branch that was recorded; None if none was, or it has no name."""
        return None if self.recorded is None else self._named(self.recorded)

    @property
    def difference(self) -> Array | None:
        """Joint values of the arrival minus the recorded ones ``(n,)``; None where the target is a pose."""
        return None if self.recorded is None else self.q - self.recorded

    @property
    def as_recorded(self) -> bool:
        """Whether no joint differs from its recorded value by more than `OTHERWISE`."""
        difference = self.difference
        return difference is None or float(np.abs(difference).max()) <= OTHERWISE

    def _named(self, q: Array) -> str | None:
        return branch_of(self.robot, q) if branch_names(self.robot) else None
