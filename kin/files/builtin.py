"""The robots that come with the package: the classics, and the library of makers' arms.

The files of the classics are in ``kin/robots`` itself, those of the library in its folders, each with the arm's id
as its name. Lessons, exercises and docs are written for the classics.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from kin.errors import UnknownRobotError
from kin.files.read import load_toml
from kin.named import finds_robots
from kin.robot import Robot

BUILTIN = Path(__file__).parents[1] / "robots"
FIRST = ("pioneer5", "redundant7", "redundant7-craig")  # the chapter's arms come first in every list


@cache
def _files() -> dict[str, Path]:
    return {path.stem: path for path in sorted(BUILTIN.rglob("*.toml"))}


@cache
def _robot(robot_id: str) -> Robot:
    robot = load_toml(_files()[robot_id])
    if robot.id != robot_id:
        raise ValueError(f"the id in {robot_id}.toml is {robot.id}")
    return robot


@cache
def classic_robots() -> dict[str, Robot]:
    """The classics by id: the chapter's first, then in alphabetical order.

    Returns:
        The twelve arms for which lessons and exercises are written; `builtin_robots` has those of the library too.

    Examples:
        >>> import kin
        >>> len(kin.files.classic_robots()), "ur3e" in kin.files.classic_robots(), "ur3e" in kin.builtin_robots()
        (12, False, True)
    """
    found = (robot_id for robot_id, path in _files().items() if path.parent == BUILTIN)
    return {robot_id: _robot(robot_id) for robot_id in dict.fromkeys((*FIRST, *found))}


@cache
def builtin_robots() -> dict[str, Robot]:
    """The built-in robots by id: the classics first, then the library by maker and name.

    Returns:
        A dict from id to arm.

    Examples:
        >>> import kin
        >>> "panda" in kin.builtin_robots()
        True
    """
    library = [_robot(robot_id) for robot_id in _files() if robot_id not in classic_robots()]
    library.sort(key=lambda each: (not each.maker, each.maker.lower(), each.id))
    return classic_robots() | {robot.id: robot for robot in library}


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
    if robot_id not in _files():  # reading one file takes less time than all
        raise UnknownRobotError(robot_id, tuple(builtin_robots()))
    return _robot(robot_id)
