"""What both doors share: the robots this service offers."""

from __future__ import annotations

from pathlib import Path

from kin import Robot, RobotFileError, UnknownRobotError, builtin_robots
from kin.files import load_robots


class Store:
    """The robots by id: the built-in ones, then those of the operator's folder.

    Read-only after construction, so any thread may use it.

    Raises:
        RobotFileError: a file of the folder is wrong, or its id is taken.
        kin.InputError: the folder cannot be read.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._robots: dict[str, Robot] = dict(builtin_robots())
        if folder is None:
            return
        if not folder.is_dir():
            raise RobotFileError(str(folder), "robots", str(folder), "an existing folder with robot files")
        for robot in load_robots(folder).values():
            if robot.id in self._robots:
                raise RobotFileError(str(folder), "id", robot.id, "an id that no built-in robot has")
            self._robots[robot.id] = robot

    @property
    def robots(self) -> tuple[Robot, ...]:
        """All robots, in the order they are offered."""
        return tuple(self._robots.values())

    def __contains__(self, robot: Robot) -> bool:
        """Whether it is one of these, and not another of the same description."""
        return self._robots.get(robot.id) is robot

    def get(self, robot_id: str) -> Robot:
        """One robot; raises `UnknownRobotError`, which lists the ids there are."""
        try:
            return self._robots[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id, tuple(self._robots)) from None
