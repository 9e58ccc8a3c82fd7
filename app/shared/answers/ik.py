"""Answers of inverse kinematics: a whole result, and only whether a target is reachable."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy
from functools import lru_cache
from typing import Annotated, Generic, Literal, TypeVar

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.details import IkDetails, RedundancyAnswer, SingularityAnswer, Violation
from kin import IKResult, Robot, Status
from kin.ik.details import Solved
from kin.ik.messages import explain
from kin.ik.results import Cause
from kin.ik.table import Table
from kin.motors import to_pendant
from kin.path import PathResult
from kin.solvers.contract import Completeness
from kin.tolerances import TOLERANCES
from kin.units import DEFAULT_UNITS

TaskName = Literal["pose", "approach", "position", "mask"]
StatusName = Literal["solved", "approximate", "limits", "orientation", "unreachable", "collision"]
EXACT = (TOLERANCES.closure_position, TOLERANCES.closure_rotation)


class Solution(Answer):
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
    """Distance from the seed in joint space: 2-norm, radians; a slide counts as a share of the arm's reach."""
    redundancy: list[RedundancyAnswer]
    """Redundancy parameters on this branch: the values used in this solution, and the ranges of the branch."""
    compromise: str | None
    """null for an exact answer; "roll" if the rotation about the approach axis was given up; "rotation" if only
    the point is kept and the whole rotation error is as small as it gets; "closest" for the nearest there is."""
    pendant: list[float] | UnsetType = UNSET
    """With `pendant` in the request: these joint values as the arm's pendant shows them."""


class Blocked(Answer):
    """A posture that reaches the target only outside the limits."""

    branch: str
    """Name of the branch."""
    q: list[float]
    """The configuration it would need, in radians (metres)."""
    violations: list[Violation]
    """Its joint values outside the limits."""


class Tolerances(Answer):
    """Errors of a solution that count as none."""

    position: float
    """Of the tool's point, in metres."""
    rotation: float
    """Of the rotation, in radians."""
    target_error: float
    """How rounded the entries of the target are, if its rotation had to be made one; else 0."""


class IkAnswer(Answer):
    """Inverse kinematics of one target. A target out of reach is an answer too: read `status`."""

    status: Annotated[StatusName, From("status.value")]
    """"solved": at least one exact answer. "approximate": the arm meets only a part of the task; `solutions` are
    the best compromises. "limits": postures exist, all of them outside the joint limits, see `blocked`.
    "orientation": the point can be reached, but not with this orientation; see `nearest_orientation`.
    "unreachable": the point is `distance` metres out of reach, or the requested branch does not exist there.
    "collision": postures exist, but none was found in which nothing touches that was to be avoided."""
    cause: Cause
    """Why it is not solved, as a code; empty when it is solved. "too far", "too near", "around the axis" and
    "outside" say where a point out of reach is."""
    details: IkDetails
    """The numbers behind `cause`."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    task: TaskName
    """The task that was solved for."""
    complete: bool
    """Whether no further posture exists on the requested branches, proved or agreed. Values of redundancy
    parameters and whole turns do not count."""
    completeness: Completeness
    """How that is known. "proved": by the derivation of a closed form, or by a certificate that was checked for
    this target. "agreed": two independent ways found the same postures. "searched": one way looked
    everywhere, and nothing else has confirmed it. "unknown": some may be missing, as after a numeric search."""
    solver: str
    """Name of the method that answered."""
    solver_reason: str
    """Why it was this one."""
    solutions: list[Solution]
    """Nearest to the seed first, or in the order of `prefer`; empty unless "solved" or "approximate"."""
    closest: Solution | None
    """When there is no exact answer, the configuration inside the limits with the least
    √(|Δp|² + (0.1 m · angle)²) on the requested branches; null when solved. For "collision": of the
    solutions without regard to collisions, the one with the fewest contacts."""
    nearest_orientation: Solution | None
    """For "orientation": the exact point with the least rotation error; null otherwise."""
    blocked: list[Blocked]
    """For "limits": every posture outside the limits, the closest to them first."""
    violations: list[Violation]
    """The joint values outside the limits on the first of `blocked`."""
    distance: float
    """How far out of reach the target is, in metres; 0 within reach."""
    redundancy: list[RedundancyAnswer]
    """Redundancy parameters: the values of the first solution, with the ranges of all branches together."""
    singularities: list[SingularityAnswer]
    """The singularities that the first solution (or `closest`) is at."""
    tolerances: Tolerances | UnsetType = UNSET
    """The errors that count as none, if they are not 1e-9."""


def add_pendant(robot: Robot, answer: IkAnswer) -> None:
    """Give each solution of an answer its values on the pendant."""
    for each in (*answer.solutions, answer.closest, answer.nearest_orientation):
        if each is not None:
            each.pendant = to_pendant(robot, each.q).tolist()


def ik_answer(result: IKResult) -> IkAnswer:
    """One result of `kin.solve_ik`."""
    details, reason = _explained(result)
    return IkAnswer.of(result, details=details, reason=reason, tolerances=tolerances_answer(result))


def _explained(result: IKResult) -> tuple[IkDetails, str]:
    """Details and reason of a result."""
    found = result.details
    if isinstance(found, Solved) and not result.singularities and not result.target_error:
        return _solved(found, result.task)
    return IkDetails.of(found), result.reason


@lru_cache(maxsize=512)
def _solved(details: Solved, task: str) -> tuple[IkDetails, str]:
    """Details and reason of most answers: there are few different ones. Both are only read."""
    return IkDetails.of(details), explain(details, "", task, (), DEFAULT_UNITS).text


def tolerances_answer(result: IKResult | PathResult) -> Tolerances | UnsetType:
    """The tolerances of a result; absent if they are the usual ones."""
    if not result.target_error and result.tolerances == EXACT:
        return UNSET
    return Tolerances(*result.tolerances, result.target_error)


class ReachableAnswer(Answer):
    """Whether the arm reaches a target inside its limits."""

    reachable: bool
    """Whether it meets the whole task exactly."""
    status: Annotated[StatusName, From("status.value")]
    """What kind of answer `ik` gives: "solved" if it is reachable."""
    cause: Cause
    """What is in the way, as a code; empty when it is reachable."""
    details: IkDetails
    """The numbers behind `cause`."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    distance: float
    """How far out of reach the point is, in metres; 0 within reach."""
    q: list[float] | None
    """A configuration that reaches the target, in radians (metres), or the closest one; null if the requested
    branch has none."""
    position_error: float | None
    """Distance of the tool point from the target there, in metres, measured by forward kinematics."""
    rotation_error: float | None
    """Rotation left to the target there, in radians, as in the solutions of `ik`."""


def reachable_answer(result: IKResult) -> ReachableAnswer:
    """One result of `kin.solve_ik`, as far as it says whether the target is reached."""
    details, reason = _explained(result)
    best = result.best
    return ReachableAnswer.of(
        result,
        reachable=result.status is Status.SOLVED,
        details=details,
        reason=reason,
        q=None if best is None else best.q.tolist(),
        position_error=None if best is None else best.position_error,
        rotation_error=None if best is None else best.rotation_error,
    )


Whole = TypeVar("Whole", bound=Answer)
# Joint values, branch and figures of a solution, as in `kin.ik.table.Table`.
Row = tuple[list[float], int, list[float]]
Renew = Callable[[Whole, Iterator[Row], tuple[str, ...]], Whole]


class WholeAnswers(Generic[Whole]):
    """Whole answers to the targets of a table.

    One of each kind is made from its result. The others are copies of it with other numbers.

    Args:
        table: the targets, and how their answers differ.
        whole: makes an answer from a result.
        renewed: makes one of another of the same kind, the solutions, and the names of all branches.
    """

    def __init__(self, table: Table, whole: Callable[[IKResult], Whole], renewed: Renew[Whole]) -> None:
        self._table, self._whole, self._renewed = table, whole, renewed
        self._first: dict[int, Whole] = {}

    def of(self, some: slice) -> list[Whole]:
        """The answers to some targets."""
        table, first, renewed, branches = self._table, self._first, self._renewed, self._table.branches
        parts = table.kinds, table.count, table.q, table.branch, table.figures
        found = []
        columns = zip(*(part[some].tolist() for part in parts), strict=True)
        for i, (kind, count, q, branch, figures) in enumerate(columns, some.start):
            if kind in first:
                found.append(renewed(first[kind], zip(q[:count], branch, figures, strict=False), branches))
                continue
            found.append(self._whole(table.result(i)))
            if kind >= 0:
                first[kind] = found[-1]
        return found


def ik_renewed(answer: IkAnswer, rows: Iterator[Row], branches: tuple[str, ...]) -> IkAnswer:
    """The answer with other solutions. All its other parts are shared, and only read."""
    renewed = copy(answer)
    renewed.solutions = [
        Solution(q, branches[branch], position, rotation, overrun == 0.0, distance, [], None)
        for q, branch, (position, rotation, distance, overrun, _) in rows
    ]
    return renewed


def reachable_renewed(answer: ReachableAnswer, rows: Iterator[Row], _branches: tuple[str, ...]) -> ReachableAnswer:
    """The answer with another configuration."""
    renewed = copy(answer)
    renewed.q, _branch, (renewed.position_error, renewed.rotation_error, *_rest) = next(rows)
    return renewed


class Brief(Answer):
    """What is asked for of an answer of `ik` or `reachable`, and nothing else."""

    q: list[float] | UnsetType | None = UNSET
    """Joint values in radians (metres): those of the first solution, of `reachable` those of the closest
    configuration where there is none; null if there is no such configuration."""
    status: StatusName | UnsetType = UNSET
    """What kind of answer it is, as in whole answers."""
    reachable: bool | UnsetType = UNSET
    """Whether the arm meets the whole task exactly inside its limits: the status is "solved"."""
    cause: Cause | UnsetType = UNSET
    """Why it is not solved, as a code; empty when it is solved."""
    reason: str | UnsetType = UNSET
    """Status and cause in a sentence for people, in degrees and millimetres."""
    distance: float | UnsetType = UNSET
    """How far out of reach the target is, in metres; 0 within reach."""
