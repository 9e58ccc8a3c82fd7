"""Whether an arm touches itself or obstacles: distances of capsules that stand for its links.

`clearance` is the number for any batch of configurations, to the arm itself and to obstacles
(`kin.collision.obstacles`); `nearest_contact` says what it is between, `nearest_links` which two links are
nearest, and where. Distances are those of capsules, which robot files state or which are assumed from the DH
table (`kin.collision.bodies`): they warn early or late by the difference to the real bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kin.collision.bodies import bodies_of, capsules
from kin.collision.contacts import Contact, surroundings
from kin.collision.kernels import least_distance
from kin.collision.obstacles import Obstacle, checked_obstacles, obstacle_from_dict
from kin.errors import InputError
from kin.named import robot_of
from kin.robot import Capsule, Robot
from kin.transforms import Array

CROSSING = 1e-9  # m between two axes: below this it has no direction

__all__ = [
    "Capsule",
    "Contact",
    "NearestLinks",
    "Obstacle",
    "capsules",
    "clearance",
    "nearest_contact",
    "nearest_links",
    "obstacle_from_dict",
]


@dataclass(frozen=True, eq=False)
class NearestLinks:
    """The two links of an arm that are nearest to each other.

    Attributes:
        distance: m, negative where their capsules overlap.
        links: 0 for the base, k for the link that joint k moves.
        points: where the distance is, on the surfaces of both capsules ``(2, 3)``, m in the world frame; if their
            axes cross, twice the crossing.
    """

    distance: float
    links: tuple[int, int]
    points: Array


def nearest_links(robot: Robot | str, q: ArrayLike) -> NearestLinks | None:
    """The two nearest links at one configuration ``(n,)``; None for an arm of which no two links could meet.

    Args:
        robot: the arm, or the id of a built-in one.
        q: one configuration ``(n,)``, radians (metres for a slide).

    Returns:
        The two links, their distance and the nearest points; None as said above.

    Raises:
        InputError: q is not one configuration.

    Examples:
        >>> import kin
        >>> kin.collision.nearest_links("panda", kin.get_robot("panda").q_home).distance > 0.0
        True
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    if q.ndim != 1:
        raise InputError("q", f"shape {q.shape}", f"one configuration of {robot.n} values")
    body = bodies_of(robot)
    found = np.empty(7)
    ends = np.empty((len(body.rows), 6))
    pair = least_distance(robot.model, body.rows, body.shape, body.pairs, q.copy(), ends, found)
    if pair < 0:
        return None
    first, second = (body.capsules[k] for k in body.pairs[pair].tolist())
    points = found[1:].reshape(2, 3)
    apart = float(np.linalg.norm(points[1] - points[0]))
    if apart > CROSSING:
        way = (points[1] - points[0]) / apart
        points = points + np.outer([first.radius, -second.radius], way)
    return NearestLinks(float(found[0]), (first.link, second.link), points)


def clearance(robot: Robot | str, q: ArrayLike, obstacles: Sequence[Obstacle] = ()) -> Array:
    """Least distance of an arm to itself and to obstacles ``(...)`` in metres, for configurations ``(..., n)``.

    Negative where something touches; infinite if there is nothing to touch.

    Args:
        robot: the arm, or the id of a built-in one.
        q: ``(n,)`` or any batch ``(..., n)`` of configurations, radians (metres for a slide).
        obstacles: bodies in the world frame.

    Returns:
        One distance for each configuration.

    Raises:
        InputError: as in `fk`, or a malformed obstacle (named ``obstacles[i]``).

    Examples:
        >>> import kin
        >>> crate = kin.Obstacle("box", xyz=(2.0, 0.0, 0.5), size=(0.3, 0.3, 0.4))
        >>> bool(kin.clearance("ur5", kin.get_robot("ur5").q_home, [crate]) > 0.0)
        True
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    out, _ = surroundings(robot, checked_obstacles(obstacles)).distances(q.reshape(-1, robot.n))
    return out.reshape(q.shape[:-1])


def nearest_contact(robot: Robot | str, q: ArrayLike, obstacles: Sequence[Obstacle] = ()) -> Contact | None:
    """What that distance is between, at one configuration ``(n,)``; None if there is nothing to touch.

    Args:
        robot: the arm, or the id of a built-in one.
        q: one configuration ``(n,)``, radians (metres for a slide).
        obstacles: bodies in the world frame.

    Returns:
        What is nearest or touches, and how deep.

    Raises:
        InputError: q is not one configuration, or an obstacle is malformed (named ``obstacles[i]``).

    Examples:
        >>> import kin
        >>> crate = kin.Obstacle("box", xyz=(0.5, 0.0, 0.0), size=(2.0, 2.0, 2.0), name="crate")
        >>> "crate" in kin.collision.nearest_contact("ur5", kin.get_robot("ur5").q_home, [crate]).text
        True
    """
    robot = robot_of(robot)
    q = robot.check_q(q)
    if q.ndim != 1:
        raise InputError("q", f"shape {q.shape}", f"one configuration of {robot.n} values")
    return surroundings(robot, checked_obstacles(obstacles)).nearest(q)
