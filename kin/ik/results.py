"""What an inverse-kinematics question is answered with: frozen data, nothing computed here."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, NamedTuple

from kin.solvers.singular import Singularity
from kin.transforms import Array

Task = Literal["pose", "approach", "position"]
Cause = Literal[
    "",
    "roll",
    "rotation",
    "joint limits",
    "orientation",
    "too far",
    "too near",
    "around the axis",
    "outside",
    "branch",
]


class Status(StrEnum):
    """What kind of answer an `IKResult` is.

    ``solved``: exact answers. ``approximate``: an arm of few joints gave something up. ``limits``: branches exist,
    each beyond a stop. ``orientation``: the point can be reached, not with this orientation. ``unreachable``: the
    point cannot be reached, or not on the branch asked for.
    """

    SOLVED = "solved"
    APPROXIMATE = "approximate"
    LIMITS = "limits"
    ORIENTATION = "orientation"
    UNREACHABLE = "unreachable"


class Redundancy(NamedTuple):
    """A parameter the task leaves free: id, label, the value used, and all values the limits allow.

    Of several free parameters each is told with the others held at their values. An angle that is no joint's value
    (``psi``, ``roll``) is told in (−π, π], a range across the seam as two.
    """

    name: str
    label: str
    value: float
    intervals: tuple[tuple[float, float], ...]


@dataclass(slots=True, eq=False)
class IKSolution:
    """One configuration, with what forward kinematics says about it.

    Attributes:
        q: ``(n,)`` joint values, radians or metres, read-only.
        branch: name of the branch, e.g. ``"shoulder front · elbow up · wrist no-flip"``; ``"numeric"`` for an arm
            whose branches have no names.
        position_error: metres between its tool point and the target's (of a mask: along its coordinates).
        rotation_error: radians; the whole angle for a pose, the angle between the approach directions for an
            approach, 0 for a position, the masked part of the rotation vector for a mask.
        in_limits: whether every joint is inside its limits.
        distance: 2-norm of q − seed.
        redundancy: what the task leaves free on this branch.
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
    redundancy: tuple[Redundancy, ...] = ()
    compromise: str | None = None


@dataclass(frozen=True, slots=True)
class LimitViolation:
    """A joint that would have to pass its stop: index, name, the value it would need, the stop (rad or m)."""

    joint: int
    name: str
    value: float
    limit: float


@dataclass(frozen=True, slots=True, eq=False)
class BlockedBranch:
    """A branch that exists but breaks limits: its name, its configuration ``(n,)``, and the stops in its way."""

    branch: str
    q: Array
    violations: tuple[LimitViolation, ...]


@dataclass(slots=True, eq=False)
class IKResult:
    """The answer to one target.

    Attributes:
        status, cause, reason: what kind of answer it is, why, and both in a sentence.
        solutions: in the order asked for (compromises: by what they give up); empty unless solved or approximate.
        closest: the configuration inside the limits with the least ``√(|Δp|² + (0.1 m · angle)²)`` found when
            there is no exact answer; on the branches asked for. None when there is an exact answer.
        nearest_orientation: the configuration with the exact point and the least rotation error (status
            ``orientation``), None if none was found.
        blocked: every branch that only the limits forbid, the least offending first (status ``limits``).
        solver, solver_reason: what found the answer, and why it was chosen.
        distance: metres by which the point is out of reach, 0 if the point itself can be reached.
        redundancy: what the task leaves free: the best solution's values, with the ranges of all branches.
        singularities: those the configuration in `best` is at.
    """

    status: Status
    cause: Cause
    reason: str
    solutions: tuple[IKSolution, ...]
    closest: IKSolution | None
    solver: str
    solver_reason: str
    task: str
    blocked: tuple[BlockedBranch, ...] = ()
    distance: float = 0.0
    nearest_orientation: IKSolution | None = None
    redundancy: tuple[Redundancy, ...] = ()
    singularities: tuple[Singularity, ...] = ()

    @property
    def best(self) -> IKSolution | None:
        """The configuration to show: the first solution, else the closest one."""
        return self.solutions[0] if self.solutions else self.closest

    @property
    def violations(self) -> tuple[LimitViolation, ...]:
        """The stops the least offending branch would break."""
        return self.blocked[0].violations if self.blocked else ()
