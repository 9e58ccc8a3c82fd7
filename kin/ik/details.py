"""The facts behind an IK answer, as numbers: one type per kind of answer.

`kin.IKResult.details` holds one of these. :mod:`kin.ik.messages` makes the sentence from it. Lengths are in
metres, angles in radians, values of prismatic joints in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from kin.collision import Contact
from kin.solvers.contract import Obstacle

JointKind = Literal["revolute", "prismatic"]


@dataclass(frozen=True, slots=True)
class LimitViolation:
    """A joint value outside the joint's limits.

    Attributes:
        joint, name: index and name of the joint.
        value: the value that is outside.
        limit: the limit it exceeds.
        kind: whether the joint turns or slides, which tells the unit of both.
        locked: whether the limit is the value at which the joint is locked.
    """

    joint: int
    name: str
    value: float
    limit: float
    kind: JointKind = "revolute"
    locked: bool = False


class Redundancy(NamedTuple):
    """A redundancy parameter: id, label, the value used, and all values that the limits allow.

    With several parameters, the ranges of each hold for the present values of the others. An angle that is not the
    value of a joint (``psi``, ``roll``) is in (−π, π]; a range across ±π is given as two.
    """

    name: str
    label: str
    value: float
    intervals: tuple[tuple[float, float], ...]


class SolutionCurve(NamedTuple):
    """A curve of configurations that meet the target, at a singular wrist for example.

    Attributes:
        q: ``(n,)`` joint values of the solution that stands for it.
        direction: ``(n,)`` unit vector of joint motion along the curve there, a null vector of the Jacobian.
    """

    q: tuple[float, ...]
    direction: tuple[float, ...]


class Solved(NamedTuple):
    """Exact solutions exist.

    Attributes:
        configurations: how many were found, one for each curve; `max_solutions` may return fewer.
        redundant: whether the task leaves a redundancy parameter.
        chosen_branches: how many postures, branches of one name, were requested; None for all.
        complete: whether these are all; see `kin.IKResult`.
        infinite: whether there are infinitely many configurations, since the task leaves the joints a motion or
            the target is met on a curve.
        postures: on how many branches the configurations are.
        free: labels of the redundancy parameters that may have other values.
        fixed: labels of those whose values were requested.
        touching: how many configurations were left out because something touches.
        curves: the curves among the configurations of a task that usually has isolated ones only.
        multiple: how many of the configurations are multiple roots, in which several postures have merged.
    """

    configurations: int
    redundant: bool
    chosen_branches: int | None = None
    complete: bool = True
    infinite: bool = False
    postures: int = 1
    free: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    touching: int = 0
    curves: tuple[SolutionCurve, ...] = ()
    multiple: int = 0


class Restriction(NamedTuple):
    """The locks and narrowed limits of a problem, where they are what prevents an answer.

    Attributes:
        locked, narrowed: indices of the joints that are locked, and of those whose limits are narrowed.
        distance: metres by which the point is out of reach without them, 0 if it can be reached.
    """

    locked: tuple[int, ...]
    narrowed: tuple[int, ...]
    distance: float = 0.0


class RollError(NamedTuple):
    """An arm of few joints meets point and approach direction, not the rotation about it.

    Attributes:
        joints: number of joints of the arm.
        rotation_error: rotation that is left.
    """

    joints: int
    rotation_error: float


class RotationError(NamedTuple):
    """An arm of few joints meets the point, not the orientation.

    Attributes:
        joints: number of joints of the arm.
        rotation_error: rotation that is left, the smallest found.
        violation: the limit that keeps the arm from the approach direction; None if no limit does.
    """

    joints: int
    rotation_error: float
    violation: LimitViolation | None


class OutsideLimits(NamedTuple):
    """Postures exist, but all of them are outside the limits.

    Attributes:
        branch: the posture that is closest to the limits.
        violations: its joint values outside the limits.
        branches: how many postures are outside the limits, this one included.
        requested: the redundancy parameters whose values were requested, with the values that satisfy
            the limits.
        elsewhere: how many solutions there are on branches that were not requested.
    """

    branch: str
    violations: tuple[LimitViolation, ...]
    branches: int
    requested: tuple[Redundancy, ...]
    elsewhere: int


class Touching(NamedTuple):
    """Configurations exist, but in all that were looked at the arm touches itself or an obstacle.

    Attributes:
        branch: the posture with the fewest contacts; of several, the one whose deepest contact is the least deep.
        contact: the deepest contact there; `distance` is negative.
        postures: how many postures were looked at, this one included.
        searched: labels of the redundancy parameters that were searched.
        contacts: how many pairs of links, and of links and obstacles, touch there.
    """

    branch: str
    contact: Contact
    postures: int
    searched: tuple[str, ...] = ()
    contacts: int = 1


class NotOnBranch(NamedTuple):
    """The requested branch does not exist at the target.

    Attributes:
        elsewhere: how many solutions there are on other branches.
        outside_limits: how many other branches exist, but outside the limits.
        locked: indices of the locked joints.
    """

    elsewhere: int
    outside_limits: int
    locked: tuple[int, ...] = ()


class MaskNotMet(NamedTuple):
    """The coordinates of a mask cannot be met together.

    Attributes:
        position_error, rotation_error: those of the closest configuration; None if the branch has none.
        restriction: the locks and narrowed limits without which they can be met; None if there are none.
    """

    position_error: float | None
    rotation_error: float | None
    restriction: Restriction | None = None


class OutOfReach(NamedTuple):
    """The point cannot be reached.

    Attributes:
        distance: by how many metres.
        restriction: the locks and narrowed limits without which the arm comes nearer; None if there are none.
    """

    distance: float
    restriction: Restriction | None = None


class OrientationNotMet(NamedTuple):
    """The point can be reached, but not with this orientation.

    Attributes:
        obstacle, gap: what does not fit geometrically, and by how many metres; None if nothing is known.
        nearest_rotation: rotation from the target to the nearest orientation found at this point.
        position_error, rotation_error: those of the closest configuration; None if the branch has none.
        restriction: the locks and narrowed limits without which the pose can be met; None if there are none.
    """

    obstacle: Obstacle | None
    gap: float | None
    nearest_rotation: float | None
    position_error: float | None
    rotation_error: float | None
    restriction: Restriction | None = None


Details = (
    Solved
    | RollError
    | RotationError
    | OutsideLimits
    | Touching
    | NotOnBranch
    | MaskNotMet
    | OutOfReach
    | OrientationNotMet
)
