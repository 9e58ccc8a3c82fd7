"""Joint values as the pendant of an arm shows them, and back; what it shows is stated in :mod:`kin.joint`."""

from __future__ import annotations

from numpy.typing import ArrayLike

from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array


def to_pendant(robot: Robot | str, q: ArrayLike) -> Array:
    """Joint values as the pendant of an arm shows them.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(..., n)`` joint values, radians (metres).

    Returns:
        ``(..., n)`` what is shown, radians (metres); q itself for an arm whose file states nothing of it.

    Raises:
        InputError: q has another number of joints, or values that are not finite.

    Examples:
        >>> import kin, numpy as np
        >>> shown = kin.motors.to_pendant("lrmate200id", np.radians([0, 30, 50, 0, -90, 0]))
        >>> np.degrees(shown).round(6) + 0.0  # FANUC counts J3 from the horizontal
        array([  0.,  30.,  20.,   0., -90.,   0.])
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    found = robot.pendant_map
    return q if found is None else found.shown(q)


def from_pendant(robot: Robot | str, shown: ArrayLike) -> Array:
    """Joint values from what the pendant of an arm shows: the opposite of `to_pendant`.

    Args:
        robot: the arm, or the id of a built-in one.
        shown: ``(..., n)`` values on the pendant, radians (metres).

    Returns:
        ``(..., n)`` joint values, radians (metres).

    Raises:
        InputError: another number of joints, or values that are not finite.

    Examples:
        >>> import kin, numpy as np
        >>> q = kin.motors.from_pendant("lrmate200id", np.radians([0, 30, 20, 0, -90, 0]))
        >>> np.degrees(q).round(6) + 0.0
        array([  0.,  30.,  50.,   0., -90.,   0.])
    """
    robot = robot_of(robot)
    values = robot.check_q(shown, "shown")
    found = robot.pendant_map
    return values if found is None else found.joint_values(values)


def shown_limits(robot: Robot, q: Array) -> list[tuple[float, float] | None]:
    """The limits of each joint as its pendant shows them with the others at q ``(n,)``; None without any.

    Where other joints count in what is shown, as in FANUC's J3, the limits move with them.
    """
    limits, own = [joint.limits for joint in robot.joints], robot.pendant_map
    if own is None:
        return limits
    found: list[tuple[float, float] | None] = []
    for i, given in enumerate(limits):
        rest = float(own.shown(q)[i] - own.B[i, i] * q[i])
        low, high = sorted(float(own.B[i, i]) * limit + rest for limit in given or (0.0, 0.0))
        found.append((low, high) if given is not None and low < high else None)
    return found
