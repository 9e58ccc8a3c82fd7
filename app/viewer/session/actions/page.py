"""The page that the visitor's actions change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from app.viewer.feature import Feature
from app.viewer.session.actions.typed import TypedPage
from app.viewer.session.looks import Looks
from app.viewer.session.robots import RobotPage
from app.viewer.session.state import PageState


class ActionsPage(TypedPage, RobotPage, Protocol):
    """What actions may use of a page, in addition to what is saved of it and to its panel."""

    system_dark: bool
    looks: Looks

    def snapshot(self) -> PageState:
        """The present state."""

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""

    def change_lock(self, joint: int | None, lock: bool) -> None:
        """Lock or unlock one joint, or all of them, at the value it is heading for."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""
