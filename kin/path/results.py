"""A path and what is told about it: frozen data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kin.ik.results import Status
from kin.transforms import Array

JumpCause = Literal["limits", "singularity", "branch", "spacing"]


@dataclass(frozen=True, slots=True)
class PathJump:
    """A step that cannot be followed without a leap.

    Attributes:
        index: the leap is between waypoint `index` − 1 and waypoint `index`.
        joints: indices of the joints that move more than the largest step allowed.
        step: the largest of these motions: radians, or 4 per metre for a sliding joint.
        cause: ``"limits"``: the motion goes on continuously, but beyond a stop; ``"singularity"``: so near to a
            singularity that joints must turn fast; ``"branch"``: the branch being followed ends;
            ``"spacing"``: the motion is continuous, the waypoints are just too far apart for the largest step.
        reason: the same as a sentence, with the joint, the stop and the waypoints where it happens.
    """

    index: int
    joints: tuple[int, ...]
    step: float
    cause: JumpCause
    reason: str


@dataclass(frozen=True, slots=True)
class PathGap:
    """A waypoint without an exact answer: its index, and `kin.solve_ik`'s status, sentence and missing metres."""

    index: int
    status: Status
    reason: str
    distance: float


@dataclass(frozen=True, slots=True, eq=False)
class PathResult:
    """A joint path, one configuration per waypoint.

    Attributes:
        q: ``(k, n)``, inside the limits, read-only. In a gap: the closest configuration; of about equally close
            ones one that its neighbours can reach without a leap.
        continuous: whether there is no jump.
        jumps, gaps: by rising index. A waypoint at which an arm of five joints keeps point and approach direction
            and gives up the roll is a gap of status ``approximate``.
        position_error, rotation_error: ``(k,)``, measured by forward kinematics, as in `kin.IKSolution`.
        solver: name of the closed form, ``"numeric"`` if the arm has none for this task.
        reason: the whole in a sentence.
    """

    q: Array
    continuous: bool
    jumps: tuple[PathJump, ...]
    gaps: tuple[PathGap, ...]
    position_error: Array
    rotation_error: Array
    solver: str
    reason: str
