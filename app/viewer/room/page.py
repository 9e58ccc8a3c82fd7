"""The page of a member of a room: a visitor's page with the tab *Class*. A freeze stops the visitor's acts."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from typing import Any

import viser

from app.classroom.attendance import Attendance
from app.classroom.views import Role, Ticket
from app.viewer.room.member import NEWS, Member
from app.viewer.room.student import Student
from app.viewer.room.teacher import Teacher
from app.viewer.session.page import VisitorPage
from app.viewer.session.persistence import SAVE_AFTER
from app.viewer.session.services import Services
from app.viewer.session.state import PageState


class ClassroomPage(VisitorPage):
    """A page in a room; arguments as for `VisitorPage`, which a page without a room uses.

    Args:
        ticket: whose seat it is.
    """

    attendance: Attendance

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
        self.exercises, self.guest = services.exercises, token
        self._hub, self._ticket = services.classroom, ticket
        self.offered = (*self.offered, Teacher if ticket.role is Role.TEACHER else Student)
        self._member: Member | None = None

    # What the tab may use

    def adopt(self, state: PageState) -> None:
        """Show robot, requests and configuration of another state."""
        self._actions.adopt(state)

    def guard(self, action: Callable[[], None]) -> None:
        """Run an action; an error is logged and shown."""
        self._guard(action)

    def record(self, label: str, before: PageState) -> None:
        """Let undo lead back to the state `before`."""
        self._actions.record(label, before)

    def put_back(self) -> None:
        """Show in all controls of the arm what is true."""
        self.numbers.use_goal(None)
        self.sliders.show_locks(self.arm.locks)
        self.panel.robots.show(self.robot, self.own)
        self.panel.target.show(self.task)
        self.posture.choose(self.branch)

    def be_led(self, led: bool) -> None:
        """Another page leads this one, or none does."""
        self._persistence.led = led
        if led:
            self.arm.dragging = False

    @property
    def may_compute(self) -> bool:
        """Whether the visitor may cause work."""
        return not self._looking

    # Worker

    def _prepare(self) -> None:
        super()._prepare()
        if self._persistence.embedded:  # a figure in another page: neither led nor frozen, and no arm of the wall
            self.offered = tuple(tab for tab in self.offered if not issubclass(tab, Member))
            return
        # Not while the page is built: a database that does not answer would hold up the pages of everybody.
        self.attendance = self._hub.attend(self._ticket, lambda: self.post(("news", Member.key, NEWS)))

    def _build(self) -> None:
        super()._build()
        self._member = next((tab for tab in self._tabs if isinstance(tab, Member)), None)
        if self._member is None:
            return
        with self.client.atomic():
            self._member.attach(self.client.gui.add_html(""))
        self.client.flush()

    def _act(self, key: Hashable, value: object) -> None:
        if self._member is None or self._member.admit(key, value):
            super()._act(key, value)

    def _step(self, batch: list[tuple[Hashable, object]]) -> None:
        due = self._persistence.due
        super()._step(batch)
        if batch and all(key == ("news", Member.key, NEWS) for key, _ in batch):
            # News come all the time: they must not put off the saving of what the visitor does.
            self._persistence.due = time.perf_counter() + SAVE_AFTER if due is None else due

    def _leave(self) -> None:
        super()._leave()
        if hasattr(self, "attendance"):
            self.attendance.leave()
