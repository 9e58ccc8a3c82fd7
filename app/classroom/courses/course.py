"""A course: its items in order. Courses are immutable; every change gives a new one."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import Literal

ItemKind = Literal["lesson", "exercise"]
MOST_ITEMS = 40
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
class Course:
    """An ordered list of lessons and exercises.

    Attributes:
        title, about: shown above the list.
        items: in order.
        answers: whether students may ask for the answer of an exercise that they have not solved.
    """

    title: str
    about: str = ""
    items: tuple[Item, ...] = ()
    answers: bool = True

    @property
    def exercises(self) -> tuple[str, ...]:
        """The ids of its exercises, each once, in order."""
        return tuple(dict.fromkeys(item.key for item in self.items if item.kind == "exercise"))

    @property
    def fingerprint(self) -> bytes:
        """Four bytes that tell it from other courses, by title and items; texts about these do not matter."""
        parts = [self.title, *(f"{item.kind}:{item.key}" for item in self.items)]
        return hashlib.sha256("\n".join(parts).encode()).digest()[:4]

    def added(self, item: Item) -> Course:
        """With one more item, at the end."""
        return replace(self, items=(*self.items, item))

    def removed(self, index: int) -> Course:
        """Without an item."""
        return replace(self, items=self.items[:index] + self.items[index + 1 :])

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
