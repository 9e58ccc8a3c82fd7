"""What an inverse-kinematics question is answered with: frozen data, nothing computed here."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from kin.transforms import Array

Task = Literal["pose", "approach", "position"]


class Status(StrEnum):
    """What kind of answer an `IKResult` is."""

    SOLVED = "solved"
    APPROXIMATE = "approximate"
    LIMITS = "limits"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, slots=True, eq=False)
class IKSolution:
    """One configuration, with what forward kinematics says about it.

    Attributes:
        q: ``(n,)`` joint values, radians or metres, read-only.
        branch: name of the branch, e.g. ``"shoulder front · elbow up · wrist no-flip"``.
        position_error: metres between its tool point and the target's.
        rotation_error: radians; the whole angle for a pose, the angle between the approach directions for an
            approach, 0 for a position.
        in_limits: whether every joint is inside its limits.
        distance: 2-norm of q − seed.
        redundancy: value of the free parameter that was used, None where there is none.
        compromise: None for an exact answer; ``"roll"``: point and approach direction are exact, the roll about
            it is given up; ``"rotation"``: the point is exact, the orientation as near as it gets;
            ``"closest"``: the nearest configuration there is.
    """

    q: Array
    branch: str
    position_error: float
    rotation_error: float
    in_limits: bool
    distance: float
    redundancy: float | None = None
    compromise: str | None = None


@dataclass(frozen=True, slots=True)
class LimitViolation:
    """A joint that would have to pass its stop: index, name, the value it would need, the stop (rad or m)."""

    joint: int
    name: str
    value: float
    limit: float


@dataclass(frozen=True, slots=True)
class Redundancy:
    """The free parameter of a redundant answer: id, label, the value used, and all values the limits allow."""

    name: str
    label: str
    value: float
    intervals: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, eq=False)
class IKResult:
    """The answer to one target; see the module docstring.

    Attributes:
        solutions: sorted by distance to the seed (compromises: by what they give up); empty unless solved or
            approximate.
        closest: the configuration inside the limits with the least ``√(|Δp|² + (0.1 m · angle)²)`` found when
            there is no exact answer; None when there is one.
        violations: the stops the least offending branch would break (status ``limits``).
        distance: metres by which the point is out of reach, 0 if the point itself can be reached.
    """

    status: Status
    reason: str
    solutions: tuple[IKSolution, ...]
    closest: IKSolution | None
    solver: str
    task: str
    violations: tuple[LimitViolation, ...] = ()
    distance: float = 0.0
    redundancy: Redundancy | None = None

    @property
    def best(self) -> IKSolution | None:
        """The configuration to show: the first solution, else the closest one."""
        return self.solutions[0] if self.solutions else self.closest
