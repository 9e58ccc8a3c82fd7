"""What a student has missed, and when it is asked again.

It comes back on the next day, with other numbers. After a right answer it comes back after three days, then after
seven, and is done. Recalling something that is nearly forgotten makes it last; what returns at growing distances
lasts longest (Latimier, Peyre and Ramus, 2021). A wrong answer begins anew.

Days are those of the student's browser. Like the marks of exercises, the list is kept in the page's state, and a
seat in a room has a list of its own.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from app.classroom.views import Recalled
from app.viewer.activity.context import LABEL

INTERVALS: Final = (1, 3, 7)  # days
MOST_MISSED: Final = 60  # in a list
MOST_ARMS: Final = 4  # in `Missed.before`
FARTHEST_ZONE: Final = 14 * 60  # minutes from UTC
_DAY = 86_400  # s
_LATEST = 10**6  # day
_KEY = re.compile(r"[a-z0-9-]{1,40}(?:/c?[1-9][0-9]?)?")
_ROBOT = re.compile(r"[A-Za-z0-9_.-]{0,60}")


def question_key(lesson: str, question: str) -> str:
    """The key of a lesson's question: of a step, or of the check (c and its number)."""
    return f"{lesson}/{question}"


@dataclass(frozen=True)
class Missed:
    """An exercise, or a question of a lesson.

    Attributes:
        key: the id of the exercise, or `question_key`.
        stage: how often it was right since, on days when it was due.
        due: the day from which it is asked again, counted from 1 January 1970.
        robot: the id of the arm that the question of a lesson is about.
        before: the ids of the arms that it was about before, the last first, `MOST_ARMS` at most. From the second
            time that it is asked on, the present one is among them once it is answered, or asked about again.
    """

    key: str
    stage: int
    due: int
    robot: str = ""
    before: tuple[str, ...] = ()

    def about(self, robot: str) -> Missed:
        """The same, asked about this arm, which may be the present one."""
        before = tuple(dict.fromkeys((self.robot, *self.before)))[:MOST_ARMS] if self.robot else self.before
        return replace(self, robot=robot, before=before)

    @property
    def lesson(self) -> str:
        """The key of the lesson; "": it is an exercise."""
        return self.key.partition("/")[0] if "/" in self.key else ""

    @property
    def question(self) -> str:
        """The key of the question in its lesson."""
        return self.key.partition("/")[2]


class Review:
    """The lists of one page: its own, and that of a seat in a room. Not thread-safe.

    Args:
        now: seconds since 1 January 1970, UTC.

    Attributes:
        zone: minutes by which the browser's clock is ahead of UTC.
    """

    def __init__(self, now: Callable[[], float] | None = None) -> None:
        self._now = now
        self.zone = 0
        self._label = ""
        self._lists: dict[str, dict[str, Missed]] = {}
        self._done: set[tuple[str, str]] = set()  # by label and key: undo does not bring them back

    @property
    def today(self) -> int:
        """The present day of the student, counted from 1 January 1970."""
        seconds = time.time() if self._now is None else self._now()
        return int((seconds + 60 * self.zone) // _DAY)

    def enter(self, label: str) -> None:
        """Have the list of this seat from now on."""
        self._label = label
        self._lists = {name: entries for name, entries in self._lists.items() if name in ("", label)}

    @property
    def missed(self) -> dict[str, Missed]:
        """The present list, by key."""
        return self._lists.setdefault(self._label, {})

    def take(self, key: str, right: bool, robot: str = "") -> bool:
        """A question was answered, or its answer shown (not right); returns whether the list has changed.

        Args:
            robot: the arm that the question of a lesson was about. A right answer about another one counts for
                nothing.
        """
        known, today = self.missed.get(key), self.today
        if not right:
            asked = Missed(key, 0, 0, robot) if known is None else known.about(robot)
            new = replace(asked, stage=0, due=today + INTERVALS[0])
        elif known is None or known.due > today or known.robot != robot:
            return False
        elif known.stage + 1 < len(INTERVALS):
            stage = known.stage + 1
            new = replace(known, stage=stage, due=today + INTERVALS[stage])
        else:
            del self.missed[key]
            self._done.add((self._label, key))
            return True
        if robot and new.before:
            new = replace(new, before=tuple(dict.fromkeys((robot, *new.before)))[:MOST_ARMS])
        self.missed[key] = new
        if len(self.missed) > MOST_MISSED:  # what is known best goes first
            others = [one for one in self.missed.values() if one.key != key]
            del self.missed[max(others, key=lambda one: (one.stage, one.due)).key]
        return new != known

    def move(self, key: str, robot: str) -> None:
        """A question of a lesson is asked about this arm."""
        self.missed[key] = self.missed[key].about(robot)

    def recalled(self, key: str, right: bool, robot: str = "") -> Recalled | None:
        """What an answer says of what is remembered, before `take` has it; None: not due, or another arm."""
        known = self.missed.get(key)
        if known is None or known.due > self.today or known.robot != robot:
            return None
        late = self.today - (known.due - INTERVALS[known.stage]) >= INTERVALS[-1]
        new = bool(known.before) and robot not in known.before
        return Recalled(int(late), int(late and right), int(new), int(new and right))

    @property
    def due(self) -> list[Missed]:
        """What is to be asked today, the longest waiting first."""
        return [one for one in self._sorted() if one.due <= self.today]

    @property
    def later(self) -> list[Missed]:
        """What is to be asked on another day, the next first."""
        return [one for one in self._sorted() if one.due > self.today]

    def _sorted(self) -> list[Missed]:
        return sorted(self.missed.values(), key=lambda one: (one.due, one.stage, one.key))

    def state(self) -> dict[str, object]:
        """As JSON; empty if nothing was missed."""
        return {
            label: {
                one.key: [one.stage, one.due, *([one.robot, *one.before] if one.robot else [])]
                for one in entries.values()
            }
            for label, entries in self._lists.items()
            if entries
        }

    def restore(self, state: object) -> None:
        """Add what `state` returned, as far as it is valid; what this page knows already stays as it is."""
        lists = list(state.items())[:2] if isinstance(state, dict) else []
        for label, entries in lists:
            if not isinstance(entries, dict) or len(label) > LABEL:
                continue
            known = self._lists.setdefault(label, {})
            for key, entry in list(entries.items())[:MOST_MISSED]:
                one = self._read(key, entry)
                if one is not None and len(known) < MOST_MISSED and (label, key) not in self._done:
                    known.setdefault(key, one)

    def _read(self, key: str, entry: object) -> Missed | None:
        match entry:
            case [int(stage), int(due), *given] if _KEY.fullmatch(key) and len(given) <= 1 + MOST_ARMS:
                arms = [arm for arm in given if isinstance(arm, str) and _ROBOT.fullmatch(arm)]
                counts = type(stage) is int and type(due) is int and 0 <= stage < len(INTERVALS)
                if counts and 0 <= due <= _LATEST and len(arms) == len(given):
                    robot, *before = arms or [""]
                    return Missed(key, stage, min(due, self.today + INTERVALS[-1]), robot, tuple(before))
        return None
