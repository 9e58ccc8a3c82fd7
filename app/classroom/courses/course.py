"""A course: its items in order, and the exercises that it brings along.

Courses are immutable; every change gives a new one.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import Literal

from app.exercises import Exercise

ItemKind = Literal["lesson", "exercise"]
MOST_ITEMS = 40
MOST_OWN = 8  # exercises that a course brings along
MOST_PAIRS = 10  # exercises that are compared
LONGEST = {"title": 80, "about": 300, "note": 400}  # characters of each text


@dataclass(frozen=True)
class Item:
    """A lesson or an exercise of a course.

    Attributes:
        kind, key: the key of a lesson, or the id of an exercise.
        title: instead of the lesson's or the exercise's own; may be empty.
        note: what the teacher says about it.
        robot: the id of the arm that a lesson is shown with; empty: the one on show.
    """

    kind: ItemKind
    key: str
    title: str = ""
    note: str = ""
    robot: str = ""


@dataclass(frozen=True)
class Own:
    """An exercise that a course brings along: its text, by which two are the same."""

    text: str
    exercise: Exercise = field(compare=False, repr=False)


@dataclass(frozen=True)
class Course:
    """An ordered list of lessons and exercises.

    Attributes:
        title, about: shown above the list.
        items: in order.
        answers: whether students may ask for the answer of an exercise that they have not solved.
        own: the exercises that it brings along.
        before, after: the ids of exercises of the course that are compared in the results of a room, pair by pair.
    """

    title: str
    about: str = ""
    items: tuple[Item, ...] = ()
    answers: bool = True
    own: tuple[Own, ...] = ()
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()

    @property
    def exercises(self) -> tuple[str, ...]:
        """The ids of its exercises, each once, in order."""
        return tuple(dict.fromkeys(item.key for item in self.items if item.kind == "exercise"))

    @property
    def fingerprint(self) -> bytes:
        """Four bytes that tell it from other courses, by title and items; texts about these do not matter."""
        parts = [self.title, *(f"{item.kind}:{item.key}" for item in self.items), *(one.text for one in self.own)]
        return hashlib.sha256("\n".join(parts).encode()).digest()[:4]

    def exchanged(self) -> Course:
        """With the two exercises of each pair in each other's places, whose titles and notes stay."""
        other = dict(zip((*self.before, *self.after), (*self.after, *self.before), strict=True))
        items = tuple(
            replace(item, key=other.get(item.key, item.key)) if item.kind == "exercise" else item
            for item in self.items
        )
        return replace(self, items=items, before=self.after, after=self.before)

    def added(self, item: Item) -> Course:
        """With one more item, at the end."""
        return replace(self, items=(*self.items, item))

    def removed(self, index: int) -> Course:
        """Without an item."""
        fewer = replace(self, items=self.items[:index] + self.items[index + 1 :])
        for before, after in zip(self.before, self.after, strict=True):
            if not {before, after} <= {*fewer.exercises}:
                fewer = fewer.comparing("", after)
        return replace(fewer, own=tuple(one for one in self.own if one.exercise.id in fewer.exercises))

    def comparing(self, before: str, after: str) -> Course:
        """With a pair, in place of one with the same exercise after; no exercise before: without such a pair."""
        kept = [pair for pair in zip(self.before, self.after, strict=True) if pair[1] != after]
        pairs = [*kept, (before, after)] if before else kept
        return replace(self, before=tuple(one for one, _ in pairs), after=tuple(one for _, one in pairs))

    def bringing(self, exercise: Exercise) -> Course:
        """With an exercise that it brings along, in place of one with the same id, and as an item."""
        others = tuple(one for one in self.own if one.exercise.id != exercise.id)
        course = replace(self, own=(*others, Own(exercise.source, exercise)))
        return course if exercise.id in self.exercises else course.added(Item("exercise", exercise.id))

    def moved(self, index: int, to: int) -> Course:
        """With an item at another place; beyond the ends: nothing changes."""
        if not 0 <= to < len(self.items):
            return self
        items = list(self.items)
        items.insert(to, items.pop(index))
        return replace(self, items=tuple(items))

    def changed(self, index: int, title: str | None = None, note: str | None = None) -> Course:
        """With other texts of an item; None: as it is."""
        items = list(self.items)
        old = items[index]
        title, note = (new if new is not None else was for new, was in ((title, old.title), (note, old.note)))
        items[index] = replace(old, title=title, note=note)
        return replace(self, items=tuple(items))


def parse_item(name: str) -> Item | None:
    """The item of a name such as ``lesson:dh`` or ``exercise:two-elbows``; None: it has no such form."""
    kind, _, key = name.partition(":")
    if kind == "lesson":
        return Item("lesson", key)
    return Item("exercise", key) if kind == "exercise" else None
