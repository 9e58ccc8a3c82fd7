"""The menu of robots: those of the service, and the visitor's own arm."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from app.viewer.own_arm import OwnArm, label
from app.viewer.panel import Post, assign, listen
from kin import InputError, Robot


class RobotMenu:
    """Posts ``"robot"``."""

    def __init__(
        self, gui: viser.GuiApi, robots: Sequence[Robot], own: OwnArm | None, robot: Robot, post: Post
    ) -> None:
        self._robots = tuple(robots)
        self._options = self._named(own)
        self._shown = robot
        self._menu = gui.add_dropdown("Robot", tuple(self._options), initial_value=self._name(robot))
        listen(self._menu, post, "robot")

    def hide(self) -> None:
        """Offer no other robot."""
        self._menu.visible = False

    def show(self, robot: Robot, own: OwnArm | None) -> None:
        """Show this robot, and offer this arm of the visitor's own besides those of the service."""
        self._shown = robot
        options = self._named(own)
        if tuple(options) != tuple(self._options):
            self._menu.options = tuple(options)
        self._options = options
        assign(self._menu, self._name(robot))

    def read(self, value: object) -> Robot:
        """The chosen robot; raises `InputError` for an unknown one."""
        if value not in self._options:
            assign(self._menu, self._name(self._shown))
            raise InputError("robot", value, "one of " + ", ".join(self._options))
        return self._options[str(value)]

    def _named(self, own: OwnArm | None) -> dict[str, Robot]:
        """The robots by the names in the menu. A name that is taken is followed by the robot's id."""
        named: dict[str, Robot] = {}
        for robot in self._robots:
            named[f"{robot.name} ({robot.id})" if robot.name in named else robot.name] = robot
        if own is not None:
            name = label(own.robot)
            named[f"{name} ({own.robot.id})" if name in named else name] = own.robot
        return named

    def _name(self, robot: Robot) -> str:
        return next(name for name, offered in self._options.items() if offered.id == robot.id)
