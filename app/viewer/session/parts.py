"""What the parts of a session may use of their page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from app.viewer.feature import Feature, Stage
from app.viewer.panel.layout import Panel
from app.viewer.session.channel.channel import Channel
from app.viewer.session.choices import ViewState
from app.viewer.session.forms import Forms
from app.viewer.session.lessons import LessonChoice
from app.viewer.session.numbers import Numbers
from app.viewer.session.posture import PosturePanel
from app.viewer.session.state import PageState


class Page(Stage, Protocol):
    """A visitor's page. The class itself knows all its parts, so they know it by this description."""

    channel: Channel
    view: ViewState
    system_dark: bool
    panel: Panel
    forms: Forms
    posture: PosturePanel
    lessons: LessonChoice
    numbers: Numbers

    @property
    def features(self) -> list[Feature]:
        """The tabs, and the open lesson with its steps."""

    def for_features(self, action: Callable[[Feature], None]) -> None:
        """Call every feature; an error of one does not stop the others."""

    def snapshot(self) -> PageState:
        """The present state."""

    def settle_status(self) -> None:
        """End the news in the status: show what is true now."""
