"""Which drawn body each arm of a visitor has: from the visitor's file, from a package, or our own drawing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from app.shared.memory.answers import Reservation
from app.viewer.meshes.library.library import Library
from app.viewer.meshes.links import carried_over
from app.viewer.own_arm import OwnArm
from app.viewer.scene.bodies.drawing import Drawing, drawing
from kin import Robot, builtin_robots

KEPT = 3  # own arms whose meshes are kept, for undo


@dataclass(frozen=True, eq=False)
class _OwnBody:
    robot: Robot
    drawing: Drawing
    room: Reservation | None
    file: str


class Bodies:
    """The bodies of one visitor's arms. Not thread-safe: the visitor's worker uses it.

    Args:
        library: bodies from installed packages.
        loaded: called from any thread when the library has loaded one, or with the reason why it cannot.

    Attributes:
        last_refusal: the reason that the page has shown last why a body of the library cannot be shown.
        detailed: whether bodies of the library are preferred to our own drawings.
    """

    def __init__(self, library: Library, loaded: Callable[[str], None]) -> None:
        self._library = library
        self._loaded = loaded
        self._own: list[_OwnBody] = []
        self.detailed = False
        self.last_refusal = ""

    def add(self, robot: Robot, body: Drawing, room: Reservation | None, file: str) -> None:
        """Keep the body of an own arm, which was read from a file; the oldest ones are forgotten."""
        self._own = [*self._own[1 - KEPT :], _OwnBody(robot, body, room, file)]

    def clear(self) -> None:
        """The visitor has left: forget everything."""
        self._own = []

    def file_of(self, own: OwnArm) -> str:
        """The file that the body of an own arm came from; empty if it has none from a file."""
        found = self._found(own.robot)
        return "" if found is None else found[1]

    def of(self, robot: Robot, own: OwnArm | None) -> Drawing | None:
        """The drawn body of a robot; None if it has none.

        An own arm also has the body of the robot it was made from, as long as it has the same axes.
        """
        mine = own is not None and own.robot == robot
        if mine and (found := self._found(robot)) is not None:
            return found[0]
        builtin = builtin_robots()
        origin = builtin.get(own.start) if own is not None and mine else robot
        if origin is None:
            return None
        body = self._library.get(origin, self._loaded) if self.detailed else None
        body = drawing(origin) if body is None else body
        return body if body is None or origin == robot else carried_over(body, origin, robot)

    def _found(self, robot: Robot) -> tuple[Drawing, str] | None:
        for kept in reversed(self._own):
            body = carried_over(kept.drawing, kept.robot, robot)
            if body is not None:
                return body, kept.file
        return None
