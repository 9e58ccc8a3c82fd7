"""A room whose students open exercises, for tests."""

from __future__ import annotations

import json

from fake_browser import FakeBrowser

from app.classroom import COOKIE, Hub, Ticket
from app.classroom.results.store import attempts_of
from app.exercises import Exercise, Exercises, Variant
from app.viewer.activity.context import ExerciseContext
from app.viewer.session.state import PageState, encode
from kin.units import Units

ALL = Exercises()
UNITS = Units()


class Room:
    """A room, and pages of its students."""

    def __init__(self, port: int, hub: Hub) -> None:
        self.port, self.hub = port, hub
        self.room = hub.rooms.open("Tasks", 3600.0)
        self._open: list[FakeBrowser] = []

    def student(self, ticket: Ticket | None, **features: dict[str, object]) -> FakeBrowser:
        """A page of a seat; None: of nobody."""
        state = encode(PageState(lesson="exercises", features=features))
        memory = json.dumps({"address": "http://127.0.0.1/", "state": state})
        cookie = "" if ticket is None else f"{COOKIE}={self.hub.rooms.tokens.sign(ticket)}"
        tab = FakeBrowser(self.port, memory=memory, additional_headers={"Cookie": cookie}, close_timeout=0.1)
        self._open.append(tab)
        tab.__enter__()
        tab.wait(lambda: "data-exercises" in tab.html or "data-course=" in tab.html)
        return tab

    def join(self, alias: str) -> Ticket:
        return self.hub.rooms.join(self.room.code, alias)

    def variant(self, ticket: Ticket, exercise: Exercise) -> Variant:
        """The numbers of a seat."""
        place = ExerciseContext(
            f"seat {ticket.room} {ticket.seat}", self.hub.rooms.tokens.secret(ticket), seat=True
        )
        return exercise.variant(place.seed(exercise.id, 0))

    def attempts(self, ticket: Ticket) -> list[tuple[str, float]]:
        """Verdict and score of what is stored of a seat."""
        stored = attempts_of(self.hub.database, ticket.room)
        return [(one.verdict, one.score) for one in stored if one.seat == ticket.seat]

    def close(self) -> None:
        for tab in self._open:
            tab.close()
        self.hub.rooms.end(self.room.id)


def press(tab: FakeBrowser, *key: object, value: object = None) -> None:
    tab.say("feature", ["exercises", [*key, len(tab.log)], value])


def begin(tab: FakeBrowser, exercise: Exercise) -> None:
    press(tab, "open", exercise.id)
    tab.wait(lambda: f'data-exercise="{exercise.id}"' in tab.html)


def text_of(exercise: Exercise, variant: Variant) -> str:
    return variant.text(exercise.text, UNITS)


def exercise(exercise_id: str) -> Exercise:
    found = ALL.get(exercise_id)
    assert found is not None
    return found
