"""Answers of inverse kinematics: a whole result, and only whether a target is reachable."""

from __future__ import annotations

from typing import Literal, cast

from typing_extensions import TypedDict

from app.shared.answers.document import documented
from kin import BlockedBranch, IKResult, IKSolution, Redundancy, Status
from kin.ik.messages import singularity
from kin.ik.results import Cause, LimitViolation
from kin.solvers.singular import Condition, Lost


@documented
class RedundancyAnswer(TypedDict):
    """A parameter the task leaves free."""

    name: str
    """Short name of the free parameter, such as "psi" or "theta1"; the one to use in a request's `redundancy`."""
    label: str
    """The same for people."""
    value: float
    """The value used, in radians."""
    intervals: list[list[float]]
    """Every [lower, upper] range of values, in radians, for which the target can be reached inside the limits.
    Of several free parameters each is told with the others held. Exact, not sampled."""


@documented
class Solution(TypedDict):
    """One joint configuration, with its errors measured by forward kinematics."""

    q: list[float]
    """Joint values, base to tool, in radians (metres for sliding joints)."""
    branch: str
    """Which of the arm's postures this is: one of the robot's `branches`, "numeric" if these have no names."""
    position_error: float
    """Distance of the tool point from the target, in metres; of a mask along its coordinates."""
    rotation_error: float
    """Rotation left to the target in radians: the whole angle for task pose, the angle between the approach
    axes for task approach, 0 for task position, the length of the masked rotation vector for a mask."""
    in_limits: bool
    """Whether every joint is inside its limits."""
    distance: float
    """Distance from the seed in joint space (2-norm, radians)."""
    redundancy: list[RedundancyAnswer]
    """What the task leaves free on this branch: the value used in this solution, and the ranges of the branch."""
    compromise: str | None
    """null for an exact answer; "roll" if the rotation about the approach axis was given up; "rotation" if only
    the point is kept and the whole rotation error is as small as it gets; "closest" for the nearest there is."""


@documented
class Violation(TypedDict):
    """A joint that would have to go beyond its stop."""

    joint: int
    """Index into q, from 0."""
    name: str
    """Name of the joint."""
    value: float
    """The value the joint would need, in radians (metres)."""
    limit: float
    """The stop that value breaks, in radians (metres)."""


@documented
class Blocked(TypedDict):
    """A branch that reaches the target only beyond the limits."""

    branch: str
    """Name of the branch."""
    q: list[float]
    """The configuration it would need, in radians (metres)."""
    violations: list[Violation]
    """The stops in its way."""


@documented
class JointValueAnswer(TypedDict):
    """A value of one joint."""

    joint: int
    """Index of the joint."""
    value: float
    """In radians (metres)."""


@documented
class SingularityAnswer(TypedDict):
    """A way in which a configuration is singular."""

    kind: Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
    """Which part of the arm loses a motion; "algorithmic": only the closed form loses a parameter, the arm
    loses nothing; "jacobian": judged by the smallest singular value, for arms without a closed form."""
    condition: Condition
    """What aligns there."""
    lost: Lost
    """What the arm (for "algorithmic": the closed form) loses there."""
    joints: list[JointValueAnswer]
    """The joints that decide, with the values at which the condition is met; empty where other lengths decide."""
    meaning: str
    """Condition, joint values and loss as one clause."""
    distance: float
    """How far away it is, in `unit`."""
    unit: str
    """"rad", "m", or "SI" for a singular value."""


@documented
class IkAnswer(TypedDict):
    """Inverse kinematics of one target. A target out of reach is an answer too: read `status`."""

    status: Literal["solved", "approximate", "limits", "orientation", "unreachable"]
    """"solved": at least one exact answer. "approximate": the arm cannot do the whole task; `solutions` are the
    best compromises. "limits": postures exist, but each needs a joint beyond its stop, see `blocked`.
    "orientation": the point can be reached, not with this orientation; see `nearest_orientation`.
    "unreachable": the point is `distance` metres out of reach, or the branch asked for does not exist there."""
    cause: Cause
    """Why it is not solved, in one or two words; empty when it is. "too far", "too near", "around the axis" and
    "outside" tell where a point out of reach is."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    task: Literal["pose", "approach", "position", "mask"]
    """What was asked of the tool."""
    solver: str
    """Name of the method that answered."""
    solver_reason: str
    """Why it was this one."""
    solutions: list[Solution]
    """Nearest to the seed first, or in the order of `prefer`; empty unless "solved" or "approximate"."""
    closest: Solution | None
    """When there is no exact answer, the configuration inside the limits with the least
    √(|Δp|² + (0.1 m · angle)²) on the branches asked for; null when solved."""
    nearest_orientation: Solution | None
    """For "orientation": the exact point with the least rotation error; null otherwise."""
    blocked: list[Blocked]
    """For "limits": every branch that only the limits forbid, the least offending first."""
    violations: list[Violation]
    """The stops in the way of the first of `blocked`."""
    distance: float
    """How far out of reach the target is, in metres; 0 within reach."""
    redundancy: list[RedundancyAnswer]
    """What the task leaves free: the values of the first solution, with the ranges of all branches together."""
    singularities: list[SingularityAnswer]
    """What is singular about the first solution (or about `closest`)."""


def ik_answer(result: IKResult) -> IkAnswer:
    """One result of `kin.solve_ik`."""
    return {
        "status": result.status.value,
        "cause": result.cause,
        "reason": result.reason,
        "task": cast(Literal["pose", "approach", "position", "mask"], result.task),
        "solver": result.solver,
        "solver_reason": result.solver_reason,
        "solutions": [_solution(solution) for solution in result.solutions],
        "closest": None if result.closest is None else _solution(result.closest),
        "nearest_orientation": None
        if result.nearest_orientation is None
        else _solution(result.nearest_orientation),
        "blocked": [_blocked(blocked) for blocked in result.blocked],
        "violations": [_violation(violation) for violation in result.violations],
        "distance": result.distance,
        "redundancy": [_redundancy(free) for free in result.redundancy],
        "singularities": [
            {
                "kind": s.kind,
                "condition": s.condition,
                "lost": s.lost,
                "joints": [{"joint": at.joint, "value": at.value} for at in s.met_at],
                "meaning": singularity.long(s),
                "distance": s.distance,
                "unit": s.unit,
            }
            for s in result.singularities
        ],
    }


def _solution(solution: IKSolution) -> Solution:
    return {
        "q": solution.q.tolist(),
        "branch": solution.branch,
        "position_error": solution.position_error,
        "rotation_error": solution.rotation_error,
        "in_limits": solution.in_limits,
        "distance": solution.distance,
        "redundancy": [_redundancy(free) for free in solution.redundancy],
        "compromise": solution.compromise,
    }


def _blocked(blocked: BlockedBranch) -> Blocked:
    return {
        "branch": blocked.branch,
        "q": blocked.q.tolist(),
        "violations": [_violation(violation) for violation in blocked.violations],
    }


def _violation(violation: LimitViolation) -> Violation:
    return {
        "joint": violation.joint,
        "name": violation.name,
        "value": violation.value,
        "limit": violation.limit,
    }


def _redundancy(free: Redundancy) -> RedundancyAnswer:
    intervals = [list(interval) for interval in free.intervals]
    return {"name": free.name, "label": free.label, "value": free.value, "intervals": intervals}


@documented
class ReachableAnswer(TypedDict):
    """Whether the arm gets to a target inside its limits."""

    reachable: bool
    """Whether it gets there exactly, all that the task asks for."""
    status: Literal["solved", "approximate", "limits", "orientation", "unreachable"]
    """What kind of answer `ik` gives: "solved" if it is reachable."""
    cause: Cause
    """What is in the way, in one or two words; empty when it is reachable."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    distance: float
    """How far out of reach the point is, in metres; 0 within reach."""
    q: list[float] | None
    """A configuration that gets there, in radians (metres), or the one that comes closest; null if the branch
    asked for has none."""
    position_error: float | None
    """Distance of the tool point from the target there, in metres, measured by forward kinematics."""
    rotation_error: float | None
    """Rotation left to the target there, in radians, as in the solutions of `ik`."""


def reachable_answer(result: IKResult) -> ReachableAnswer:
    """One result of `kin.solve_ik`, as far as it tells whether the target is reached."""
    best = result.best
    return {
        "reachable": result.status is Status.SOLVED,
        "status": result.status.value,
        "cause": result.cause,
        "reason": result.reason,
        "distance": result.distance,
        "q": None if best is None else best.q.tolist(),
        "position_error": None if best is None else best.position_error,
        "rotation_error": None if best is None else best.rotation_error,
    }
