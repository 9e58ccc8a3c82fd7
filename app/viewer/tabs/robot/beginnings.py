"""What an own arm begins with: an example, a robot of the service, a file or a link; and the way back to it."""

from __future__ import annotations

from collections.abc import Callable

from app.viewer.feature import Stage
from app.viewer.own_arm import KEY, OwnArm, label, own_arm
from app.viewer.panel.status import Notice
from app.viewer.tabs.robot import views
from app.viewer.tabs.robot.presets import PRESETS, TITLES
from kin import InputError


class Beginnings:
    """Shows arms to begin with.

    Args:
        opened: gives the arm of the file that was opened last.
    """

    def __init__(self, stage: Stage, opened: Callable[[], OwnArm | None]) -> None:
        self._stage = stage
        self._opened = opened

    @property
    def own(self) -> OwnArm | None:
        """The visitor's own arm if it is on show."""
        own = self._stage.robots.own
        return own if own is not None and own.robot == self._stage.arm.now.robot else None

    @property
    def origin(self) -> str:
        """What the arm on show was made from: a key of *Start from*, or `views.FILE` or `views.LINK`."""
        own = self.own
        start = self._stage.arm.now.robot.id if own is None else own.start
        if start in PRESETS or any(robot.id == start for robot in self._stage.services.store.robots):
            return start
        last = self._opened()
        return views.FILE if last is not None and start == last.robot.id else views.LINK

    def start(self, key: object) -> None:
        """Begin with an example, or show a robot of the service."""
        if isinstance(key, str) and key in PRESETS:
            own = own_arm(PRESETS[key], key)
            self.begin(own, own.robot.description)
            return
        robot = next((r for r in self._stage.services.store.robots if r.id == key), None)
        if robot is None:
            valid = [*TITLES, *(r.id for r in self._stage.services.store.robots)]
            raise InputError("start", key, "one of " + ", ".join(valid))
        self._stage.robots.show(robot)
        self._stage.status.show(Notice("hand", robot.name, "Change its table: it becomes an arm of your own."))

    def begin(self, own: OwnArm, words: str) -> None:
        """Show another own arm; one that this replaces is not lost without a word."""
        replaced = self._stage.robots.own
        self._stage.robots.show_own(own)
        if replaced is None or replaced == own or _is_as_it_began(replaced):
            self._stage.status.show(Notice("hand", own.robot.name, words))
        else:
            self.say_replaced(replaced, f"{own.robot.name}: {words}" if words else f"{own.robot.name} is shown.")

    def say_replaced(self, replaced: OwnArm, words: str, lost: str = "") -> None:
        """Say that another arm has taken the place of an own one."""
        detail = f"{words} Undo brings the other back. {lost}".strip()
        self._stage.status.show(Notice("advice", f"{label(replaced.robot)} was replaced", detail))

    def delete(self) -> None:
        """Delete the own arm on show; undo brings it back."""
        if self.own is None:
            return
        name = label(self.own.robot)
        self._stage.robots.discard_own()
        detail = f"{self._stage.arm.now.robot.name} is shown. Undo brings your arm back."
        self._stage.status.show(Notice("advice", f"{name} was deleted", detail))

    def reset(self) -> str:
        """Show the arm that the own one was made from; returns why that is not possible, or ""."""
        own, origin = self.own, self.origin
        if own is None:
            return ""
        last = self._opened()
        if origin == views.FILE and last is not None:
            self._stage.robots.show_own(last)
            self._stage.status.show(Notice("hand", last.robot.name, last.robot.description))
        elif origin in PRESETS:
            self._stage.robots.show_own(own_arm(PRESETS[origin], origin))
            self._stage.status.show(
                Notice("hand", self._stage.arm.now.robot.name, self._stage.arm.now.robot.description)
            )
        elif origin != views.LINK:
            self.start(origin)
        else:
            if own.start.startswith(f"{KEY}-"):
                words = "The arm came from a file, which this page no longer has: open the file again."
            elif own.start:
                words = f"The arm was made from “{own.start}”, which this service does not have."
            else:
                words = "The arm came with a link."
            return f"{words} Undo goes back one step."
        return ""


def _is_as_it_began(own: OwnArm) -> bool:
    """Whether an own arm is an example that nobody has changed."""
    return own.start in PRESETS and own.robot == own_arm(PRESETS[own.start]).robot
