"""Path result types."""

from __future__ import annotations

from dataclasses import dataclass

from kin.collision.sweep import Touch
from kin.explained import Explained
from kin.ik.details import Details
from kin.ik.messages import explain, rounded_target
from kin.ik.results import Cause, Status
from kin.path import messages
from kin.path.details import JointMove, JumpCause, JumpDetails, MotionEnd
from kin.solvers.singular import Singularity
from kin.tolerances import TOLERANCES
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units


@dataclass(frozen=True, slots=True, repr=False)
class PathJump(Explained):
    """A step of the path that is not continuous.

    Attributes:
        index: the jump is between waypoint `index` − 1 and waypoint `index`.
        joints: indices of the joints that move more than the largest step allowed.
        step: the largest of these motions: radians, or a share of the arm's reach for a slide.
        widest: the joint that moves most, and its motion.
        cause: ``"limits"``: the motion would go on, but outside the joint limits; ``"singularity"``: at or near a
            singularity joints must turn fast; ``"branch"``: the branch being followed ends; ``"spacing"``: the
            motion is continuous, but the waypoints are too far apart for the largest step.
        place: where the continuous motion ends.
        details: the numbers behind the cause, see :mod:`kin.path.details`.
    """

    index: int
    joints: tuple[int, ...]
    step: float
    widest: JointMove
    cause: JumpCause
    place: MotionEnd
    details: JumpDetails

    def __repr__(self) -> str:
        """Where it is and why."""
        return f"PathJump({self.index}, {self.cause}: {self.reason!r})"

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The jump in a sentence, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentence; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> ends = kin.fk("planar2r", [[0.0, 1.0], [2.0, 1.0]])
            >>> kin.solve_path("planar2r", ends, max_step=0.5).jumps[0].explain().partition(":")[0]
            'Between waypoints 0 and 1 joint 1 (shoulder) jumps by 114.6°'
        """
        return messages.jump(self.index, self.joints, self.widest, self.place, self.details, units)


@dataclass(frozen=True, slots=True, repr=False)
class PathGap(Explained):
    """A waypoint without an exact solution.

    Attributes:
        index: which waypoint.
        status, cause, details, task, singularities: as in the `kin.IKResult` of the waypoint.
        distance: metres by which the waypoint is out of reach, 0 if its point can be reached.
    """

    index: int
    status: Status
    cause: Cause
    details: Details
    task: str
    distance: float
    singularities: tuple[Singularity, ...] = ()

    def __repr__(self) -> str:
        """Where it is and why."""
        return f"PathGap({self.index}, {self.status.value}: {self.reason!r})"

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The gap in a sentence, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentence; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> far = kin.pose_from_xyz_rpy([3.0, 0.0, 0.0])
            >>> kin.solve_path("planar2r", [far, far], task="position").gaps[0].explain().partition(":")[0]
            'Out of reach by 1400.0 mm'
        """
        return explain(self.details, self.cause, self.task, self.singularities, units).text


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PathResult(Explained):
    """A joint path, one configuration per waypoint.

    Attributes:
        q: ``(k, n)``, inside the limits, read-only. In a gap: the closest configuration; of about equally close
            ones, one that its neighbours can reach without a jump.
        continuous: whether there is no jump.
        jumps, gaps: by rising index. A waypoint at which an arm of five joints meets point and approach direction
            but not the rotation about it is a gap of status ``approximate``.
        position_error, rotation_error: ``(k,)``, measured by forward kinematics, as in `kin.ik.IKSolution`.
        solver: name of the closed form, ``"numeric"`` if the arm has none for this task.
        largest_step: the largest motion of a joint between neighbours; None for a single waypoint.
        tolerances: errors that count as none, metres and radians; the largest of all waypoints.
        target_error: how rounded the most rounded target is, as in `kin.IKResult`; 0 if none is.
        contacts: if collisions are avoided, the motions between waypoints, and the gaps, at which the arm still
            touches something, or comes closer than 0.01 mm; the others are proven free, also between
            waypoints. A jump is looked at only where it ends.
        avoids: whether they are.
    """

    q: Array
    continuous: bool
    jumps: tuple[PathJump, ...]
    gaps: tuple[PathGap, ...]
    position_error: Array
    rotation_error: Array
    solver: str
    largest_step: JointMove | None
    tolerances: tuple[float, float] = (TOLERANCES.closure_position, TOLERANCES.closure_rotation)
    target_error: float = 0.0
    contacts: tuple[Touch, ...] = ()
    avoids: bool = False

    def __repr__(self) -> str:
        """Number of waypoints, jumps and gaps, solver and reason: arrays are in the attributes."""
        counts = (len(self.q), "waypoint"), (len(self.jumps), "jump"), (len(self.gaps), "gap")
        parts = ", ".join(f"{count} {noun}{'s' * (count != 1)}" for count, noun in counts)
        return f"PathResult({parts}, {self.solver}: {self.reason!r})"

    def explain(self, units: Units = DEFAULT_UNITS) -> str:
        """The whole path in a sentence, in any units.

        Args:
            units: in which numbers are written, a `kin.units.Units`; by default degrees and millimetres.

        Returns:
            The sentence; `reason` is the same in the default units.

        Examples:
            >>> import kin
            >>> kin.solve_path("planar2r", kin.fk("planar2r", [[0.0, 1.0], [0.1, 1.1]])).explain()
            'Continuous through 2 waypoints: the largest step is 5.7°.'
        """
        jumps = [(jump.index, jump.cause) for jump in self.jumps]
        gaps = [gap.index for gap in self.gaps]
        text = messages.summary(len(self.q), self.largest_step, jumps, gaps, units)
        if self.contacts:
            text += f" {messages.contacts(self.contacts, units)}"
        if not self.target_error:
            return text
        return f"{text} {rounded_target(self.target_error, self.tolerances, units, path=True)}"
