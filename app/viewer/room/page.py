"""The page of a member of a room: a visitor's page with the tab *Class*. A freeze stops the visitor's acts."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from app.classroom.views import Ticket
from app.viewer.panel.part import add_html
from app.viewer.room.member import NEWS, Member
from app.viewer.room.member_page import MemberPage
from app.viewer.room.student import Student
from app.viewer.room.teacher import Teacher


class ClassroomPage(MemberPage):
    """The page of a teacher or a student, with the tab of that role."""

    def __init__(self, *arguments: Any, ticket: Ticket, **options: Any) -> None:
        super().__init__(*arguments, ticket=ticket, **options)
        self.offered = (*self.offered, Teacher if ticket.teaches else Student)
        self._member: Member | None = None

    # Worker

    def _prepare(self) -> None:
        super()._prepare()
        if self._persistence.embedded:  # a figure in another page: neither led nor frozen, and no arm of the wall
            self.offered = tuple(tab for tab in self.offered if not issubclass(tab, Member))
            return
        if self._inbox.closed:
            return
        # Not while the page is built: a database that does not answer would hold up the pages of everybody.
        news = ("news", Member.key, NEWS)
        self.attendance = self._hub.attend(self._ticket, lambda: self.post(news), self.channel.silence)

    def _build(self) -> None:
        super()._build()
        self._member = next((tab for tab in self.tabs if isinstance(tab, Member)), None)
        if self._member is None:
            return
        with self.client.atomic():
            self._member.attach(add_html(self.client.gui))
        self.client.flush()

    def _act(self, key: Hashable, value: object) -> None:
        if self._member is None or self._member.allows(key, value):
            driven = self._member is None or self._member.driven
            super()._act(key, value)
            if self._member is not None and self._member.driven and not driven:
                self._member.on_driven()
        elif key == "live":
            self.live.refuse(self._member.refusal("live"))

    def _leave(self) -> None:
        try:
            super()._leave()
        finally:
            if self.attendance is not None:
                self.attendance.leave()
