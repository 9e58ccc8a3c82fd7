"""What a search for a way answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from kin.collision.contacts import Contact
from kin.differential.metric import weights
from kin.explained import Explained
from kin.ik.details import LimitViolation
from kin.ik.messages.values import listed, need
from kin.robot import Robot
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

Code = Literal["start outside", "start touches", "goal outside", "goal touches", "goal unreachable", "time"]


class WayCause(NamedTuple):
    """Why there is no way, or none was found.

    Attributes:
        code: ``"time"``: none was found in time, which does not mean that there is none. All others do: start or
            goal are outside the limits, touch something, or the pose cannot be reached without touching anything.
        violations: of ``"… outside"``.
        contact: of ``"… touches"``.
        words: of ``"goal unreachable"``: what inverse kinematics says.
    """

    code: Code
    violations: tuple[LimitViolation, ...] = ()
    contact: Contact | None = None
    words: str = ""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Way(Explained):
    """Waypoints between which the arm touches nothing, or why there are none.

    Attributes:
        robot: the arm.
        q: ``(k, n)`` waypoints from start to goal, read-only; all joints move on straight lines between them. None
            if none was found.
        cause: why; None if one was found.
        seed, time_limit: as asked for.
        seconds: how long it took, shortening included.
    """

    robot: Robot
    q: Array | None
    cause: WayCause | None
    seed: int
    time_limit: float
    seconds: float

    @property
    def found(self) -> bool:
        """Whether there are waypoints."""
        return self.q is not None

    @property
    def length(self) -> float:
        """Sum of the lengths of its parts in joint space: radians, a slide counting as a share of the arm's
        reach."""
        return 0.0 if self.q is None else path_length(self.robot, self.q)

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The answer in a sentence, in any units."""
        if self.q is not None:
            between = len(self.q) - 2
            how = f"over {between} waypoint{'s' * (between != 1)}" if between else "straight"
            return f"A way was found in {self.seconds:.2f} s, {how}: nothing is touched."
        assert self.cause is not None
        match self.cause:
            case WayCause("time"):
                more = "That does not mean that there is none: more time or another seed may find one."
                return f"None was found in {self.time_limit:g} s. {more}"
            case WayCause("goal unreachable", words=words):
                return f"The goal cannot be reached without touching anything. {words}"
            case WayCause(code, violations) if violations:
                place = listed([need(each, units) for each in violations])
                return f"The {code.split()[0]} is outside the limits: {place}."
            case WayCause(code, _, contact):
                touched = "" if contact is None else f": {contact.text}"
                return f"The {code.split()[0]} touches something{touched}."


def path_length(robot: Robot, q: Array) -> float:
    """The length of a polyline of configurations ``(k, n)``."""
    return float(np.linalg.norm(np.diff(q, axis=0) * weights(robot), axis=1).sum())
