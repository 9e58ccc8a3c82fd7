"""The menu of robots, those of the service and the visitor's own arm, and a field that shortens it."""

from __future__ import annotations

import json
from collections.abc import Sequence

import viser

from app.shared.finding import find_robots
from app.viewer.own_arm import OwnArm, label
from app.viewer.panel import Post, assign, listen, update_html
from app.viewer.panel.part import add_html
from app.viewer.views.templates import render
from kin import InputError, Robot, builtin_robots

FIND_HINT = (
    "Shortens the menu Robot to arms that all words fit: a part of id, name, maker or solver, joints:6, "
    "reach:0.5..1.2 (metres), maker:kuka, solver:wrist6"
)


class RobotMenu:
    """Posts ``"robot"`` and ``"find"``."""

    def __init__(
        self, gui: viser.GuiApi, robots: Sequence[Robot], own: OwnArm | None, robot: Robot, post: Post
    ) -> None:
        self._robots = tuple(robots)
        self._options = self._named(own)
        self._shown = robot
        self._query = ""
        self._about = add_html(gui)
        self._menu = gui.add_dropdown("Robot", tuple(self._options), initial_value=self._name(robot))
        self._field: viser.GuiInputHandle[str] | None = None
        listen(self._menu, post, "robot")
        self._describe()

    def add_field(self, gui: viser.GuiApi, post: Post) -> None:
        """Add the field that shortens the menu, in the container that is open."""
        self._field = gui.add_text("Find an arm", "", hint=FIND_HINT)
        listen(self._field, post, "find")

    @property
    def names(self) -> tuple[str, ...]:
        """The robots that can be chosen."""
        return tuple(self._options)

    def hide(self) -> None:
        """Offer no other robot."""
        self._menu.visible = False

    def find(self, query: object) -> int:
        """Offer the robots that all words of a query fit, and the one on show; returns how many fit.

        Raises:
            kin.InputError: naming a word that cannot be read; the menu stays as it is.
        """
        text = query if isinstance(query, str) else ""
        count = len(find_robots(self._options.values(), text))
        self._query = text
        if self._field is not None:
            assign(self._field, text)
        self._offer()
        return count

    def _offer(self) -> None:
        """Put the names of the robots that fit into the menu."""
        fit = {robot.id for robot in find_robots(self._options.values(), self._query)} | {self._shown.id}
        # The menu keeps the name that it shows: without it, viser would choose another.
        names = tuple(name for name, robot in self._options.items() if robot.id in fit or name == self._menu.value)
        if names != tuple(self._menu.options):
            self._menu.options = names

    def _describe(self) -> None:
        """Tell ``static/robot_menu.js`` the picture and the maker of each."""
        pictured = builtin_robots()
        about = {
            name: (robot.id if pictured.get(robot.id) == robot else "", robot.maker)
            for name, robot in self._options.items()
        }
        update_html(self._about, render("panel/robots", robots=json.dumps(about)))

    def show(self, robot: Robot, own: OwnArm | None) -> None:
        """Show this robot, and offer this arm of the visitor's own besides those of the service."""
        self._shown = robot
        self._options = self._named(own)
        self._describe()
        self._offer()
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
