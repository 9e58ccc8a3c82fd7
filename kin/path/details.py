"""The facts behind the jumps of a path, as codes and numbers.

`kin.path.messages` makes the sentences from them. Lengths are in metres, angles in radians, motions of prismatic
joints in metres.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from kin.ik.details import JointKind, LimitViolation
from kin.solvers.singular import Singularity

JumpCause = Literal["limits", "singularity", "branch", "spacing"]


class JointMove(NamedTuple):
    """A motion of one joint: its index and name, whether it turns or slides, and how far it moves."""

    joint: int
    name: str
    kind: JointKind
    motion: float


class MotionEnd(NamedTuple):
    """Between which neighbouring waypoints a continuous motion ends.

    Attributes:
        before, after: the waypoints, before < after.
        is_jump: whether the path jumps there; otherwise the motion that the path leaves would end there.
        backwards: whether the motion was followed from the end of the path to its start.
    """

    before: int
    after: int
    is_jump: bool
    backwards: bool


class LimitInTheWay(NamedTuple):
    """Cause ``limits``: the motion would take a joint outside its limits."""

    violation: LimitViolation


class NearSingularity(NamedTuple):
    """Cause ``singularity``.

    Attributes:
        met: whether the motion meets the singularity; otherwise it passes close to it, with fast joints.
        singularity: which one; None if no condition is known.
    """

    met: bool
    singularity: Singularity | None


class BranchEnds(NamedTuple):
    """Cause ``branch``: the branch that the motion follows ends.

    Attributes:
        branch: its name, None if the arm's branches have no names.
        singularity: one that the motion is close to there, else None.
    """

    branch: str | None
    singularity: Singularity | None


class TooFarApart(NamedTuple):
    """Cause ``spacing``: the motion is continuous, but too large for one step.

    Attributes:
        max_step: the largest step allowed, as a motion of the joint that moves most.
        distance: distance between the tool points of the two waypoints.
        rotation: rotation between their orientations, 0.0 if the task does not count it.
    """

    max_step: JointMove
    distance: float
    rotation: float


JumpDetails = LimitInTheWay | NearSingularity | BranchEnds | TooFarApart
