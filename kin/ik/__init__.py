"""Inverse kinematics: the joint values that bring the tool to a target, or the reason why there are none.

`IKOptions` → `IKProblem` → `IKResult`: options are checked once for an arm (:mod:`kin.ik.problem`), a solver gives
raw branches, forward kinematics measures them (:mod:`kin.ik.candidates`), and :mod:`kin.ik.answers` decides which
kind of answer it is. There always is one: its `status` and `cause` are codes, its `details` are numbers, its
`reason` is a sentence (:mod:`kin.ik.messages`).

A closed form gives all branches. Where the task leaves a redundancy parameter (arm angle, θ1, roll), each branch
has the feasible value nearest to the seed, from feasible arcs (exact but for offset7 and general7), so that a pose
that can be reached inside the limits is found. Numeric descents (:mod:`kin.solvers.numeric`) find the closest
configuration to a target that cannot be reached, and solve tasks and arms without a closed form.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

from numpy.typing import ArrayLike

from kin.collision import Obstacle
from kin.errors import InputError
from kin.ik.answers import answer
from kin.ik.options import (
    Frame,
    IKOptions,
    Images,
    JointConstraints,
    Limits,
    Locks,
    Preference,
    Solver,
    Task,
)
from kin.ik.problem import IKProblem
from kin.ik.results import IKResult
from kin.named import robot_of
from kin.robot import Robot
from kin.solvers import closed_form_of

__all__ = [
    "IKOptions",
    "IKProblem",
    "JointConstraints",
    "branch_meanings",
    "branch_names",
    "branch_of",
    "solve",
    "solve_ik",
]


def solve_ik(
    robot: Robot | str,
    target: ArrayLike,
    *,
    task: Task = "pose",
    mask: Sequence[bool] | None = None,
    mask_frame: Frame = "tool",
    q_seed: ArrayLike | None = None,
    respect_limits: bool = True,
    limits: Limits | None = None,
    locked: Locks | None = None,
    branch: str | Sequence[str] | None = None,
    images: Images = "nearest",
    prefer: Preference = "nearest",
    redundancy: float | Mapping[str, float] | None = None,
    max_solutions: int | None = None,
    solver: Solver = "auto",
    position_tolerance: float | None = None,
    rotation_tolerance: float | None = None,
    avoid_self_collision: bool = False,
    obstacles: Sequence[Obstacle] = (),
) -> IKResult:
    """All configurations that bring the tool to `target`, or why there are none.

    `solve` takes the same options as one value.

    Args:
        robot: the arm, or the id of a built-in one.
        target: T_base_tool ``(4, 4)``; for ``task="position"`` also a point ``(3,)`` in metres.
        q_seed: ``(n,)`` configuration to stay near; the home pose by default.
        limits: n pairs (lower, upper) inside the robot's own limits, None for a joint that keeps its own.
        locked: n joint values, None for a joint that may move.
        task, mask, mask_frame, respect_limits, branch, images, prefer, redundancy, max_solutions, solver,
            position_tolerance, rotation_tolerance, avoid_self_collision, obstacles: as in `kin.IKOptions`.

    Raises:
        InputError: a malformed target, seed or option. An unreachable target is not an error.
    """
    plain = (
        task, mask_frame, respect_limits, images, prefer, max_solutions, solver, position_tolerance,
        rotation_tolerance,
    )  # fmt: skip
    if mask is None and limits is None and locked is None and branch is None and redundancy is None:
        try:
            options = _plain_options(*plain)
        except TypeError:  # a value that cannot be looked up, a list for example, is no valid option
            options = _options(*plain)
    else:
        options = _options(*plain, mask, JointConstraints(limits, locked), branch, redundancy)
    if avoid_self_collision or obstacles:
        options = replace(options, avoid_self_collision=avoid_self_collision, obstacles=obstacles)
    return solve(robot, target, options, q_seed)


def solve(
    robot: Robot | str,
    target: ArrayLike,
    options: IKOptions | None = None,
    q_seed: ArrayLike | None = None,
    rounding: float = 0.0,
) -> IKResult:
    """`solve_ik` with all options in one value; None stands for the default options.

    Args:
        rounding: how rounded the numbers are from which `target` was computed, such as the pose of a workpiece. It
            is added to the rounding that shows in the entries of the target.

    Raises:
        InputError: a malformed target or seed, or an option that does not fit the arm.
    """
    given = _plain_options() if options is None else options
    return answer(IKProblem.of(robot_of(robot), target, given, q_seed, rounding))


def branch_names(robot: Robot | str) -> tuple[str, ...]:
    """The names of the arm's branches; none for an arm whose branches have no names."""
    closed_form = closed_form_of(robot_of(robot))
    return closed_form.branches if closed_form is not None and closed_form.named else ()


def branch_meanings(robot: Robot | str) -> dict[str, str]:
    """What each part of the branch names says about a configuration: ``{"elbow up": "the elbow is above …"}``."""
    closed_form = closed_form_of(robot_of(robot))
    return {} if closed_form is None else dict(closed_form.meanings)


def branch_of(robot: Robot | str, q: ArrayLike) -> str:
    """Name of the branch of a configuration ``(n,)``; on the border of two, the one whose sine is not negative.

    Raises `InputError` for an arm whose branches have no names.
    """
    robot = robot_of(robot)
    closed_form = closed_form_of(robot)
    if closed_form is None or not closed_form.named:
        raise InputError("robot", robot.id, "an arm whose branches have names")
    values = robot.check_q(q)
    if values.ndim != 1:
        raise InputError("q", f"shape {values.shape}", f"one configuration of {robot.n} values")
    return closed_form.branches[closed_form.branch_of(values)]


def _options(
    task: Task = "pose",
    mask_frame: Frame = "tool",
    respect_limits: bool = True,
    images: Images = "nearest",
    prefer: Preference = "nearest",
    max_solutions: int | None = None,
    solver: Solver = "auto",
    position_tolerance: float | None = None,
    rotation_tolerance: float | None = None,
    mask: Sequence[bool] | None = None,
    constraints: JointConstraints | None = None,
    branch: str | Sequence[str] | None = None,
    redundancy: float | Mapping[str, float] | None = None,
) -> IKOptions:
    """The keywords of `solve_ik` as one value."""
    return IKOptions(
        task=task,
        mask=mask,
        mask_frame=mask_frame,
        constraints=JointConstraints() if constraints is None else constraints,
        respect_limits=respect_limits,
        branch=branch,
        images=images,
        prefer=prefer,
        redundancy=redundancy,
        max_solutions=max_solutions,
        solver=solver,
        position_tolerance=position_tolerance,
        rotation_tolerance=rotation_tolerance,
    )


# Typed, since True, 1 and 1.0 are not equally valid.
_plain_options = lru_cache(maxsize=256, typed=True)(_options)
