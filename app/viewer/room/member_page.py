"""What else the page of a member of a room can do: for its tab *Class*, and for leading it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from app.classroom.attendance import Attendance
from app.classroom.views import Ticket
from app.viewer.page.services import Services
from app.viewer.session.page import VisitorPage
from app.viewer.session.state import PageState


class MemberPage(VisitorPage):
    """A page in a room; arguments as for `VisitorPage`, which a page without a room uses.

    Args:
        ticket: whose seat it is.

    Attributes:
        attendance: the page's place in the room, once it is there.
        guest: whether only the seat lets this page use the service.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        services: Services,
        token: bool = False,
        *arguments: Any,
        ticket: Ticket,
        **options: Any,
    ) -> None:
        super().__init__(client, services, token, *arguments, **options)
        self.guest = token
        self._hub, self._ticket = services.classroom, ticket
        self.attendance: Attendance | None = None

    def adopt(self, state: PageState) -> None:
        """Show robot, requests and configuration of another state."""
        self._actions.adopt(state)

    def guard(self, action: Callable[[], None]) -> None:
        """Run an action; an error is logged and shown."""
        self._guard(action)

    def record(self, label: str, before: PageState) -> None:
        """Let undo lead back to the state `before`."""
        self._actions.record(label, before)

    def set_following(self, led: bool) -> None:
        """Another page leads this one, or none does."""
        self._persistence.led = led
        if led:
            self.arm.dragging = False
