"""Inverse kinematics: the joint values that bring the tool to a target, or the reason why there are none.

`IKOptions` → `IKProblem` → `IKResult`: options are checked once for an arm (:mod:`kin.ik.problem`), a solver gives
raw branches, forward kinematics measures them (:mod:`kin.ik.candidates`), and :mod:`kin.ik.answers` decides which
kind of answer it is. There always is one: its `status` and `cause` are codes, its `details` are numbers, its
`reason` is a sentence (:mod:`kin.ik.messages`).

A closed form gives all branches. Where the task leaves a redundancy parameter (arm angle, θ1, roll), each branch
has the value at which it is nearest to the seed, in feasible arcs (exact but for offset7 and general7), so that a
pose that can be reached inside the limits is found. Numeric descents (:mod:`kin.solvers.numeric`) find the closest
configuration to a target that cannot be reached, and solve tasks and arms without a closed form.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Unpack

from numpy.typing import ArrayLike

from kin.differential.task import Task
from kin.errors import InputError
from kin.ik.answers import answer, answer_at_once
from kin.ik.batch import IKResults, ik_branches, solve_ik_many
from kin.ik.details import LimitViolation, Redundancy
from kin.ik.options import IKKeywords, IKOptions, JointConstraints
from kin.ik.problem import IKProblem
from kin.ik.results import BlockedBranch, IKResult, IKSolution, Status
from kin.named import robot_of
from kin.robot import Robot
from kin.solvers.locked import named_form_of
from kin.solvers.singular import Singularity

__all__ = [
    "BlockedBranch",
    "IKOptions",
    "IKResult",
    "IKResults",
    "IKSolution",
    "JointConstraints",
    "LimitViolation",
    "Redundancy",
    "Singularity",
    "Status",
    "Task",
    "branch_meanings",
    "branch_names",
    "branch_of",
    "ik_branches",
    "solve_ik",
    "solve_ik_many",
]


def solve_ik(
    robot: Robot | str,
    target: ArrayLike,
    *,
    options: IKOptions | None = None,
    q_seed: ArrayLike | None = None,
    **keywords: Unpack[IKKeywords],
) -> IKResult:
    """All configurations that bring the tool to `target`, or why there are none.

    Args:
        robot: the arm, or the id of a built-in one.
        target: pose ``(4, 4)`` of the tool in the world frame, metres; for ``task="position"`` also a point
            ``(3,)``.
        options: all further arguments but the seed as one value.
        q_seed: ``(n,)`` configuration to stay near, radians (metres); the home pose by default.
        keywords: the fields of `kin.IKOptions` one by one, with those of `kin.JointConstraints` in the place of
            `constraints`, radians and metres.

    Returns:
        Solutions, the best first, each with its branch and the error measured by FK; without one, the status, the
        reason in words and numbers, and the closest configuration.

    Raises:
        InputError: a malformed target, seed or option; a keyword besides `options`. An unreachable target is not
            an error.

    Examples:
        >>> import kin
        >>> arm = kin.get_robot("ur5")
        >>> result = kin.solve_ik(arm, kin.fk(arm, arm.q_home))
        >>> result.status.value, len(result.solutions), result.complete
        ('solved', 8, True)
        >>> far = kin.pose_from_xyz_rpy([2.0, 0.0, 0.5])
        >>> kin.solve_ik(arm, far).status.value
        'unreachable'
        >>> left = kin.solve_ik(arm, kin.fk(arm, arm.q_home), branch="shoulder left", prefer="limits")
        >>> left.solutions[0].branch.startswith("shoulder left")
        True
    """
    if options is None and all(type(value) in _PLAIN for value in keywords.values()):
        wanted = _plain_options(**keywords)
    else:
        wanted = IKOptions.of(options, **keywords)
    return answer(IKProblem.of(robot_of(robot), target, wanted, q_seed))


def solve(
    robot: Robot | str,
    target: ArrayLike,
    options: IKOptions | None = None,
    q_seed: ArrayLike | None = None,
    rounding: float = 0.0,
) -> IKResult:
    """`solve_ik` for callers that have an `IKOptions`, or rounded frames; None stands for the default options.

    Args:
        rounding: how rounded the numbers are from which `target` was computed, such as the pose of a workpiece. It
            is added to the rounding that shows in the entries of the target.

    Raises:
        InputError: a malformed target or seed, or an option that does not fit the arm.
    """
    given = _DEFAULT if options is None else options
    return answer(IKProblem.of(robot_of(robot), target, given, q_seed, rounding))


def solve_at_once(
    robot: Robot, target: ArrayLike, options: IKOptions, q_seed: ArrayLike | None = None, rounding: float = 0.0
) -> IKResult | None:
    """`solve` where that takes some ten microseconds, for callers who can wait no longer; else None.

    That holds once the arm has been asked for this task, with or without an answer: the first time takes longer.
    """
    return answer_at_once(IKProblem.of(robot, target, options, q_seed, rounding))


def branch_names(robot: Robot | str) -> tuple[str, ...]:
    """The names of the arm's branches; none for an arm whose branches have no names.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        The names, in the order of `ik_branches`.

    Raises:
        UnknownRobotError: an id that does not exist.

    Examples:
        >>> import kin
        >>> kin.branch_names("planar2r")
        ('elbow positive', 'elbow negative')
    """
    closed_form = named_form_of(robot_of(robot))
    return closed_form.branches if closed_form is not None and closed_form.named else ()


def branch_meanings(robot: Robot | str) -> dict[str, str]:
    """What each part of the branch names says about a configuration: ``{"elbow up": "the elbow is above …"}``.

    Args:
        robot: the arm, or the id of a built-in one.

    Returns:
        A dict from a part of a name to its meaning.

    Raises:
        UnknownRobotError: an id that does not exist.

    Examples:
        >>> import kin
        >>> sorted(kin.ik.branch_meanings("planar2r"))
        ['elbow negative', 'elbow positive']
    """
    closed_form = named_form_of(robot_of(robot))
    return {} if closed_form is None else dict(closed_form.meanings)


def branch_of(robot: Robot | str, q: ArrayLike) -> str:
    """Name of the branch of a configuration ``(n,)``; on the border of two, the one whose sine is not negative.

    Args:
        robot: the arm, or the id of a built-in one.
        q: one configuration ``(n,)``, radians (metres for a slide).

    Returns:
        The name, one of `branch_names`.

    Raises:
        InputError: an arm whose branches have no names, or q is not one configuration.

    Examples:
        >>> import kin
        >>> kin.branch_of("planar2r", [0.3, 0.8])
        'elbow positive'
    """
    robot = robot_of(robot)
    closed_form = named_form_of(robot)
    if closed_form is None or not closed_form.named:
        raise InputError("robot", robot.id, "an arm whose branches have names")
    values = robot.check_q(q)
    if values.ndim != 1:
        raise InputError("q", f"shape {values.shape}", f"one configuration of {robot.n} values")
    return closed_form.branches[closed_form.branch_of(values)]


_DEFAULT = IKOptions()
_PLAIN = {bool, int, float, str, type(None)}  # values of other types are not equal only if they are equally valid


# Typed, since True, 1 and 1.0 are not equally valid.
@lru_cache(maxsize=256, typed=True)
def _plain_options(**keywords: Any) -> IKOptions:
    """The options of a call whose keywords can be looked up."""
    return IKOptions.of(None, **keywords)
