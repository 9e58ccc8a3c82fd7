"""IK result types."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from kin.ik.details import Details, LimitViolation, OutOfReach, Redundancy
from kin.ik.messages import Explanation, explain, rounded_target
from kin.solvers.contract import Completeness, is_complete
from kin.solvers.singular import Singularity
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units

_SURELY_MISTAKEN = 20.0  # metres out of reach: no arm is that large, so the target was probably millimetres

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
    "self-collision",
    "obstacle",
]


class Status(StrEnum):
    """The kind of answer that an `IKResult` is.

    ``solved``: exact solutions. ``approximate``: an arm of few joints meets a part of the task. ``limits``:
    postures exist, all of them outside the joint limits. ``orientation``: the point can be reached, but not with
    this orientation. ``unreachable``: the point cannot be reached, or not on the requested branch. ``collision``:
    postures exist, but none was found in which the arm touches neither itself nor an obstacle, as was asked.
    """

    SOLVED = "solved"
    APPROXIMATE = "approximate"
    LIMITS = "limits"
    ORIENTATION = "orientation"
    UNREACHABLE = "unreachable"
    COLLISION = "collision"


class Deferred:
    """Base of a dataclass with slots whose fields may be computed when they are first read.

    A field that has not been set is asked of `_source`, under the same name, and then set. A field that has been
    set takes no longer to read than without this class. Copies and pickles have all fields and no source.
    """

    __slots__ = ("_source",)
    _source: object
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def read_from(self, source: object) -> None:
        """Where fields that have not been set are read."""
        self._source = source

    if not TYPE_CHECKING:  # a type checker would accept any name

        def __getattr__(self, name: str) -> Any:
            """Called for a field that has not been set."""
            if name not in self.__dataclass_fields__:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
            value = getattr(self._source, name)
            setattr(self, name, value)
            return value

    def __getstate__(self) -> tuple[None, dict[str, Any]]:
        return None, {name: getattr(self, name) for name in self.__dataclass_fields__}


@dataclass(slots=True, eq=False, repr=False)
class IKSolution(Deferred):
    """One configuration, with errors measured by forward kinematics.

    Attributes:
        q: ``(n,)`` joint values, radians or metres, read-only.
        branch: name of the branch, e.g. ``"shoulder front · elbow up · wrist no-flip"``; ``"numeric"`` for an arm
            whose branches have no names.
        position_error: distance of the tool point from the target's, metres (of a mask: along its coordinates).
        rotation_error: radians; the whole angle for a pose, the angle between the approach directions for an
            approach, 0 for a position, the masked part of the rotation vector for a mask.
        in_limits: whether every joint is inside its limits.
        distance: 2-norm of q − seed, radians; a slide counts as a share of the arm's reach, see
            `kin.differential.metric.weights`.
        redundancy: the redundancy parameters on this branch.
        compromise: None for an exact solution; ``"roll"``: point and approach direction are exact, the rotation
            about it is not; ``"rotation"``: the point is exact, the orientation as near as possible;
            ``"closest"``: the closest configuration found.
    """

    q: Array
    branch: str
    position_error: float
    rotation_error: float
    in_limits: bool
    distance: float
    redundancy: tuple[Redundancy, ...] = ()
    compromise: str | None = None

    def __repr__(self) -> str:
        """Joint values with six digits, the branch, and what a compromise gives up."""
        q = ", ".join(f"{value:.6g}" for value in self.q.tolist())
        compromise = "" if self.compromise is None else f", compromise={self.compromise!r}"
        return f"IKSolution([{q}], {self.branch!r}{compromise})"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BlockedBranch:
    """A posture outside the joint limits: its branch, its configuration ``(n,)``, and what is outside."""

    branch: str
    q: Array
    violations: tuple[LimitViolation, ...]

    def __repr__(self) -> str:
        """The branch and the joints that are outside."""
        return f"BlockedBranch({self.branch!r}, {', '.join(v.name for v in self.violations)})"


@dataclass(slots=True, eq=False, repr=False)
class IKResult(Deferred):
    """The answer to one target. Of exact solutions, Python objects are made when they are first read.

    Attributes:
        status, cause: the kind of answer and its cause, as codes.
        details: the numbers behind them; see :mod:`kin.ik.details`.
        solutions: in the requested order (compromises: by their error); empty unless solved or approximate.
        closest: without a solution, the configuration inside the limits with the smallest
            ``√(|Δp|² + (0.1 m · angle)²)`` found on the requested branches, else None. Status ``collision``:
            of the solutions without regard to collisions, the one with the fewest contacts.
        nearest_orientation: the configuration with the exact point and the smallest rotation error (status
            ``orientation``), None if none was found.
        blocked: every posture that is outside the limits, the closest to them first (status ``limits``).
        completeness: how it is known that there is no further posture on the requested branches: ``"proved"`` by
            the derivation of a closed form or by a certificate for this target, ``"agreed"`` if two independent
            ways found the same, ``"searched"`` if one way looked everywhere, or ``"unknown"``, as after a numeric
            search, which may miss some.
        tolerances: errors that count as none, metres and radians; larger than 1e-9 if that was asked for, or for a
            target of few digits.
        target_error: how rounded the entries of the target are, if its rotation had to be made one or, for an arm
            with fewer than six joints, if it is not met more closely; else 0.
        solver, solver_reason: name of the method that found the answer, and why it was chosen.
        task: the task that was solved for.
        distance: metres by which the point is out of reach, 0 if the point can be reached.
        redundancy: the redundancy parameters of the best solution, with the ranges of all branches together.
        singularities: those that the configuration `best` is at.
        joints: how many joints the arm has.
    """

    status: Status
    cause: Cause
    details: Details
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
    completeness: Completeness = "unknown"
    tolerances: tuple[float, float] = (TOLERANCES.closure_position, TOLERANCES.closure_rotation)
    target_error: float = 0.0
    joints: int = 0

    def __repr__(self) -> str:
        """Status, number of solutions, solver and reason: arrays and ranges are in the attributes."""
        count = len(self.solutions)
        solutions = f"{count} solution{'s' * (count != 1)}"
        return f"IKResult({self.status.value}, {solutions}, {self.solver}: {self.reason!r})"

    @property
    def complete(self) -> bool:
        """Whether there is no further posture on the requested branches, proved or agreed."""
        return is_complete(self.completeness)

    @property
    def q(self) -> Array:
        """``(k, n)`` joint values of the solutions in their order, radians or metres; k is 0 without one."""
        return np.array([each.q for each in self.solutions]).reshape(-1, self.joints)

    @property
    def best(self) -> IKSolution | None:
        """The configuration to show: the first solution, else the closest configuration."""
        return self.solutions[0] if self.solutions else self.closest

    @property
    def violations(self) -> tuple[LimitViolation, ...]:
        """The joint values outside the limits on the posture that is closest to the limits."""
        return self.blocked[0].violations if self.blocked else ()

    @property
    def reason(self) -> str:
        """The answer in a sentence, in degrees and millimetres; of a target too far to be in metres it says so."""
        text = self.explain().text
        far = isinstance(self.details, OutOfReach) and self.details.distance > _SURELY_MISTAKEN
        return f"{text} Targets are in metres." if far else text

    def explain(self, units: Units = DEFAULT_UNITS) -> Explanation:
        """The answer in words, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            Texts: `text` is everything in one line, `headline` the outcome, `body` why, `note` a further sentence.

        Examples:
            >>> import kin
            >>> far = kin.pose_from_xyz_rpy([3.0, 0.0, 0.0])
            >>> kin.solve_ik("planar2r", far, task="position").explain().headline
            'Out of reach by 1400.0 mm'
        """
        found = explain(self.details, self.cause, self.task, self.singularities, units)
        if not self.target_error:
            return found
        mended = rounded_target(self.target_error, self.tolerances, units)
        return found._replace(note=" ".join(filter(None, (found.note, mended))))
