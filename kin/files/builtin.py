"""The robots that come with the package."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from kin.errors import UnknownRobotError
from kin.files.read import load_folder
from kin.named import finds_robots
from kin.robot import Robot

BUILTIN = Path(__file__).parents[1] / "robots"
FIRST = ("pioneer5", "redundant7", "redundant7-craig")  # the chapter's arms come first in every list


@lru_cache(maxsize=1)
def builtin_robots() -> dict[str, Robot]:
    """The built-in robots by id: the chapter's first, then in alphabetical order."""
    robots = load_folder(BUILTIN)
    return {robot_id: robots[robot_id] for robot_id in dict.fromkeys((*FIRST, *robots))}


@finds_robots
def get_robot(robot_id: str) -> Robot:
    """A built-in robot; raises `UnknownRobotError` listing the valid ids."""
    robots = builtin_robots()
    if robot_id not in robots:
        raise UnknownRobotError(robot_id, tuple(robots))
    return robots[robot_id]
