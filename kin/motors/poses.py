"""Poses in which the readings of motors tell sign and zero.

Between the first two poses each joint moves clearly and less than half a turn, so that two are enough. No two
joints move alike over three poses: if two motors are exchanged, their readings show it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from kin.collision import capsules, clearance
from kin.errors import InputError
from kin.fk import link_frames
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array

COUNTS = (2, 3)
_NEAR, _FAR = math.radians(40.0), math.radians(100.0)  # between these a joint moves, if its limits allow it
_INSIDE = 0.06  # share of a joint's range that is left at either limit
_WIDEST = 0.75 * math.pi  # from the middle of a joint's range
_LEAST = 0.6  # share of a joint's range that it moves at least, where that is less than `_NEAR`
_STARTS, _SETS, _TRIES = 60, 6, 100  # poses to begin with, sets from each, steps for each set
_CHECKS = 3000  # configurations that are looked at
_APART = 0.001  # m between links, and above the floor


def motor_poses(robot: Robot | str, count: int = 3, allowed: Callable[[Array], bool] | None = None) -> Array:
    """Poses for `match_motors`, in which every joint moves clearly: inside the limits and free of collisions.

    Args:
        robot: the arm, or the id of a built-in one.
        count: 2 or 3. With two, sign and zero are found; a third one shows which reading is wrong.
        allowed: whether a configuration ``(n,)``, radians (metres), may be shown. By default no link touches
            another one, and none is below the floor, if the arm's `floor` is stated.

    Returns:
        ``(count, n)`` radians (metres), the same for each call.

    Raises:
        InputError: another count, or an arm for which no such poses are found.

    Examples:
        >>> import kin, numpy as np
        >>> poses = kin.motors.motor_poses("so101")
        >>> bool(np.abs(poses[1] - poses[0]).min() > np.radians(35))
        True
    """
    robot = robot_of(robot)
    if count not in COUNTS:
        raise InputError("count", count, "2 or 3 poses")
    allowed = _counted(allowed or (lambda q: _free(robot, q)))
    low, high = _range(robot)
    rng = np.random.default_rng(1)
    starts = [np.clip(robot.q_home, low, high), *rng.uniform(low, high, (_STARTS, robot.n))]
    for start in starts:
        if not allowed(start):
            continue
        sets = [_from(robot, start, count, rng, allowed) for _ in range(_SETS)]
        found = [poses for poses in sets if poses is not None]
        if found:
            return max(found, key=lambda poses: _apart(robot, poses))
    raise InputError("robot", robot.id, "an arm that can move each joint clearly without touching anything")


def _counted(allowed: Callable[[Array], bool]) -> Callable[[Array], bool]:
    """The same; after so many configurations none is allowed, so that a hopeless search ends."""
    left = itertools.count(_CHECKS, -1)
    return lambda q: next(left) > 0 and allowed(q)


def _from(
    robot: Robot, start: Array, count: int, rng: np.random.Generator, allowed: Callable[[Array], bool]
) -> Array | None:
    """Poses that begin with this one, None if none are found."""
    low, high = _range(robot)
    near, far = (np.where(robot.revolute, angle, high - low) for angle in (_NEAR, _FAR))
    least, most = np.minimum(near, _LEAST * (high - low)), np.minimum(far, high - low)
    poses = [start]
    for _ in range(_TRIES):
        up, down = np.minimum(high - poses[-1], most), np.minimum(poses[-1] - low, most)
        if np.any((up < least) & (down < least)):  # a joint is too far in the middle of its range
            poses.pop()
            if not poses:
                return None
            continue
        rises = (down < least) | ((up >= least) & (rng.random(start.shape) < 0.5))
        step = rng.uniform(least, np.where(rises, up, down))
        q = poses[-1] + np.where(rises, step, -step)
        if allowed(q):
            poses.append(q)
            if len(poses) == count:
                return np.array(poses)
    return None


def _range(robot: Robot) -> tuple[Array, Array]:
    """Where joints are shown: inside their limits, at most a turn about the middle."""
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    low, high = np.where(bounded, robot.lower, -math.pi), np.where(bounded, robot.upper, math.pi)
    inset = _INSIDE * (high - low)
    low, high = low + inset, high - inset
    middle = 0.5 * (low + high)
    half = np.where(robot.revolute, np.minimum(0.5 * (high - low), _WIDEST), 0.5 * (high - low))
    return middle - half, middle + half


def _apart(robot: Robot, poses: Array) -> float:
    """How far the ways of two joints are apart, the least of all pairs, for either direction."""
    ways = [
        np.diff(way) / scale
        for way, scale in zip(poses.T, np.where(robot.revolute, 1.0, robot.reach), strict=True)
    ]
    pairs = [
        min(float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b))) for a, b in itertools.combinations(ways, 2)
    ]
    return min(pairs, default=math.inf)


def _free(robot: Robot, q: Array) -> bool:
    """Whether no link touches another one, and none is below the floor."""
    if clearance(robot, q) < _APART:
        return False
    if robot.floor is None:
        return True
    frames = link_frames(robot, q)
    for capsule in capsules(robot):
        if capsule.row < 0:
            continue
        T = frames[capsule.row]
        ends = [float((T[:3, :3] @ np.array(end) + T[:3, 3])[2]) for end in (capsule.start, capsule.end)]
        if min(ends) - capsule.radius < robot.floor + _APART:
            return False
    return True
