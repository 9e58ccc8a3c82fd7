"""How near a configuration is to losing a direction of motion.

At a singularity the joints together cannot move the tool in some direction, and near one a slow motion of the tool
takes fast joints. For most families with a closed form the singular sets are known exactly: each is reported with
what aligns there and how far away it is, as an angle or a length. For any other arm one number stands for all of
them: the smallest singular value of the Jacobian, the least tool speed per unit of joint speed.
"""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from kin.differential.task import natural_task, task_jacobian, usual_rank
from kin.errors import InputError
from kin.named import robot_of
from kin.robot import Robot
from kin.solvers import closed_form_of
from kin.solvers.singular import Singularity, by_jacobian
from kin.transforms import Array

__all__ = ["Singularity", "singularities"]


def singularities(robot: Robot | str, q: ArrayLike, within: float = math.inf) -> tuple[Singularity, ...]:
    """The singularities of the arm and their distances from a configuration `q` ``(n,)``, the nearest first.

    To sort angles and lengths together, a length counts as the angle at which it is seen from the arm's reach:
    metres divided by `Robot.reach`. Of equals, what costs a motion comes before what only the closed form loses.

    An arm of the 5-joint family is judged by its task, the tool's point and approach direction; 7-joint arms by
    the whole pose. Only those `within` a distance are returned. An arm without a closed form has one entry of kind
    ``"jacobian"``, see `task_jacobian`.

    Args:
        robot: the arm, or the id of a built-in one.
        q: one configuration ``(n,)``, radians (metres for a slide).
        within: largest distance to report, radians (metres are divided by the reach).

    Returns:
        The singularities, the nearest first.

    Raises:
        InputError: q is not one configuration.

    Examples:
        >>> import kin
        >>> kin.singularities("ur5", [0.0] * 6)[0].kind
        'elbow'
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    if q.ndim != 1:
        raise InputError("q", f"shape {q.shape}", f"one configuration of {robot.n} values")
    return singularities_at(robot, q, within)


def singularities_at(robot: Robot, q: Array, within: float) -> tuple[Singularity, ...]:
    """`singularities` of a configuration ``(n,)`` that has been checked."""
    form = closed_form_of(robot)
    if form is None:
        least = _by_jacobian(robot, q)
        return (least,) if least.distance <= within else ()
    found = form.singularities(q, within)
    if len(found) < 2:
        return found
    return tuple(sorted(found, key=lambda s: s.distance / (robot.reach if s.unit == "m" else 1.0)))


def _by_jacobian(robot: Robot, q: Array) -> Singularity:
    """The last singular value that is not zero everywhere."""
    return by_jacobian(task_jacobian(robot, q), usual_rank(robot, natural_task(robot)))
