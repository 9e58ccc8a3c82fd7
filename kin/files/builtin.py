"""The robots that come with the package: the classics, and the library of makers' arms.

The files of the classics are in ``kin/robots`` itself, those of the library in its folders. Lessons, exercises and
docs are written for the classics; a service warms up their families of closed forms alone.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from kin.errors import UnknownRobotError
from kin.files.read import load_robots
from kin.named import finds_robots
from kin.robot import Robot

BUILTIN = Path(__file__).parents[1] / "robots"
FIRST = ("pioneer5", "redundant7", "redundant7-craig")  # the chapter's arms come first in every list


@lru_cache(maxsize=1)
def classic_robots() -> dict[str, Robot]:
    """The classics by id: the chapter's first, then in alphabetical order.

    Returns:
        The twelve arms for which lessons and exercises are written; `builtin_robots` has those of the library too.

    Examples:
        >>> import kin
        >>> len(kin.files.classic_robots()), "ur3e" in kin.files.classic_robots(), "ur3e" in kin.builtin_robots()
        (12, False, True)
    """
    robots = load_robots(BUILTIN)
    return {robot_id: robots[robot_id] for robot_id in dict.fromkeys((*FIRST, *robots))}


@lru_cache(maxsize=1)
def builtin_robots() -> dict[str, Robot]:
    """The built-in robots by id: the classics first, then the library by maker and name.

    Returns:
        A dict from id to arm.

    Examples:
        >>> import kin
        >>> "panda" in kin.builtin_robots()
        True
    """
    robots = dict(classic_robots())
    library = [robot for folder in BUILTIN.iterdir() if folder.is_dir() for robot in load_robots(folder).values()]
    for robot in sorted(library, key=lambda each: (not each.maker, each.maker.lower(), each.id)):
        if robot.id in robots:
            raise ValueError(f"two built-in robots have the id {robot.id}")
        robots[robot.id] = robot
    return robots


@finds_robots
def get_robot(robot_id: str) -> Robot:
    """A built-in robot; raises `UnknownRobotError` listing the valid ids.

    Args:
        robot_id: such as ``"ur5"``; `builtin_robots` has them all.

    Returns:
        The arm, the same object each time.

    Raises:
        UnknownRobotError: no built-in robot has this id; the message lists the valid ones.

    Examples:
        >>> import kin
        >>> kin.get_robot("ur5").n
        6
    """
    robots = builtin_robots()
    if robot_id not in robots:
        raise UnknownRobotError(robot_id, tuple(robots))
    return robots[robot_id]
