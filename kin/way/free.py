"""The free space of an arm: configurations inside the limits that touch nothing, and motions between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kin.collision.contacts import Surroundings
from kin.collision.sweep import first_contacts
from kin.ik.details import JointKind, LimitViolation
from kin.ik.options import IKOptions
from kin.robot import Robot
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.way.results import WayCause

TURNING, SLIDING = 2.0 * np.pi, 1.0  # radians or metres searched to both sides of joints without limits


@dataclass(frozen=True, slots=True, eq=False)
class Space:
    """What a way is searched in.

    Attributes:
        robot, near: the arm, and what it must not touch.
        lower, upper: ``(n,)`` what is searched.
        cancel: cancels by raising.
    """

    robot: Robot
    near: Surroundings
    lower: Array
    upper: Array
    cancel: Callable[[], None]

    @classmethod
    def of(cls, robot: Robot, near: Surroundings, cancel: Callable[[], None]) -> Space:
        """The space of an arm; joints without limits are searched for a turn or a metre to both sides."""
        room = np.where(robot.revolute, TURNING, SLIDING)
        lower = np.where(np.isfinite(robot.lower), robot.lower, robot.q_home - room)
        upper = np.where(np.isfinite(robot.upper), robot.upper, robot.q_home + room)
        return cls(robot, near, lower, upper, cancel)

    @property
    def options(self) -> IKOptions:
        """Options of inverse kinematics with solutions in this space only."""
        avoid = bool(len(self.near.pairs))
        return IKOptions(avoid_self_collision=avoid, obstacles=self.near.obstacles)

    def is_free_at(self, q: Array) -> bool:
        """Whether nothing touches at a configuration ``(n,)``."""
        return bool(self.near.distances(q[None])[0][0] >= 0.0)

    def is_free(self, start: Array, end: Array) -> bool:
        """Whether the straight motion of the joints between two configurations ``(n,)`` is proven free."""
        way = end - start
        farthest = np.maximum(np.abs(start), np.abs(end))
        found = first_contacts(
            self.near, lambda rows, share: start + share[:, None] * way, np.abs(way)[None], farthest, self.cancel
        )
        return not bool(np.isfinite(found[0]))

    def refusal(self, q: Array, which: str) -> WayCause | None:
        """Why a configuration cannot be ``"start"`` or ``"goal"``; None if it can."""
        violations = []
        for i, joint in enumerate(self.robot.joints):
            low, high = float(self.robot.lower[i]), float(self.robot.upper[i])
            if not low - TOLERANCES.limit <= q[i] <= high + TOLERANCES.limit:
                kind: JointKind = "prismatic" if joint.kind == "prismatic" else "revolute"
                limit = low if q[i] < low else high
                violations.append(LimitViolation(i, joint.name, float(q[i]), limit, kind))
        if violations:
            return WayCause("start outside" if which == "start" else "goal outside", tuple(violations))
        contact = self.near.touching(q)
        if contact is not None:
            return WayCause("start touches" if which == "start" else "goal touches", (), contact)
        return None
