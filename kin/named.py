"""Robots by name: whatever takes a `Robot` takes the id of a built-in one as well.

The robots are read by :mod:`kin.files`, which needs forward kinematics, which takes names. So the function that
finds a robot by its id is registered here when the core is imported.
"""

from __future__ import annotations

from collections.abc import Callable

from kin.errors import InputError
from kin.robot import Robot

Finder = Callable[[str], Robot]
_finders: list[Finder] = []


def finds_robots(finder: Finder) -> Finder:
    """Decorator of the function that returns the built-in robot of an id."""
    _finders[:] = [finder]
    return finder


def robot_of(robot: Robot | str) -> Robot:
    """The robot itself, or the built-in one of this id; raises `InputError` or `UnknownRobotError`."""
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str):
        raise InputError("robot", robot, 'a Robot, or the id of a built-in one such as "ur5"')
    return _finders[0](robot)
