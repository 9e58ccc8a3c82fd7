"""A student's way through *Assign it yourself*: which choice is next, and what has become of the last one.

It knows neither the page nor the scene. Values are typed for the pose of the arm at that moment: a joint's own
value is taken away from its θ or d, so that the row has its constant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from app.exercises.rows import FACTORS, Factor, Row, turns
from app.exercises.typed import read_number
from app.viewer.declared.fields import numbers, ordinal, record, rows
from app.viewer.lessons.dh import choices
from app.viewer.lessons.dh.assignment import ACCEPTED, Assignment, Verdict, judge, opposite_x, read_row
from app.viewer.lessons.dh.choices import PARTS, Choice, Part
from app.viewer.lessons.dh.steps import MOVED, ORDERS, low
from kin import InputError, Robot
from kin.transforms import Array, as_transform
from kin.typed import LONGEST, EntryError
from kin.units import Units

_DIGITS = 9  # of metres and radians in a link
LARGEST = 1e6  # number in a link
SAMPLES = 64


@dataclass(frozen=True)
class Feedback:
    """What has become of the last step: right or wrong, and sentences."""

    right: bool
    title: str
    sentences: tuple[str, ...] = ()


@dataclass(eq=False)
class Attempt:
    """The frames assigned so far, and the choices made for the next one.

    What is among the settings of a page does not change: take a `copy` for the next step.

    Attributes:
        made: index of the choice made for each part of the next frame; at most the last of them is wrong.
        typed: what was typed for its row.
        ghost: the row that was typed, if it was wrong.
        wrong: its wrong parameters, or those that could not be read.
        feedback: on the last step.
        finished: the choices made for each frame, as far as they are known: a link does not have them.
    """

    work: Assignment
    made: dict[Part, int] = field(default_factory=dict)
    typed: dict[Factor, str] = field(default_factory=dict)
    ghost: Row | None = None
    wrong: tuple[Factor, ...] = ()
    feedback: Feedback | None = None
    finished: tuple[dict[Part, int], ...] = ()

    def __post_init__(self) -> None:
        """Make the choices that are no choice."""
        self._settle()

    @classmethod
    def begun(cls, robot: Robot) -> Attempt:
        """An attempt at the beginning."""
        return cls(Assignment(robot))

    def copy(self) -> Attempt:
        """Another one at the same place."""
        return replace(self, made=dict(self.made))

    @property
    def number(self) -> int:
        """The number of the next frame."""
        return len(self.work.frames)

    @property
    def part(self) -> Part | None:
        """The part of the frame to choose now; None: its row is to be typed, or all is done."""
        if self.work.complete:
            return None
        found = choices.choices(self.work, self.made)
        for part in PARTS:
            if found[part] and (part not in self.made or not found[part][self.made[part]].right):
                return part
        return None

    @property
    def chosen(self) -> Array:
        """The frame ``(4, 4)`` that the choices mean so far, with every joint at 0."""
        return choices.frame(self.work, self.made)

    def offered(self) -> dict[Part, tuple[Choice, ...]]:
        """The choices for each part of the next frame."""
        return choices.choices(self.work, self.made)

    def choose(self, part: object, index: object) -> None:
        """Make a choice; raises `kin.InputError` for one that is not offered now."""
        now = self.part
        if now is None or part != now:
            raise InputError("choice", part, f"a choice of {now}" if now else "no choice: the row is typed")
        found = self.offered()[now]
        if type(index) is not int or not 0 <= index < len(found):
            raise InputError("choice", index, f"an index from 0 to {len(found) - 1}")
        self.made[now] = index
        choice = found[index]
        self.feedback = Feedback(choice.right, "Right" if choice.right else "Not quite", (choice.reason,))
        self._settle()

    def check(self, texts: object, q: Array, units: Units) -> None:
        """Judge typed values at a configuration ``(n,)``; raises `kin.InputError` unless a row is to be typed."""
        if self.part is not None or self.work.complete or not isinstance(texts, dict):
            raise InputError("row", texts, "the four values of a row, when its frame has been chosen")
        self.typed = {factor: str(texts.get(factor, ""))[: LONGEST + 1] for factor in FACTORS}
        values: dict[Factor, float] = {}
        for factor in FACTORS:
            try:
                values[factor] = read_number(self.typed[factor], units.of(turns(factor)))
            except EntryError as error:
                self.ghost, self.wrong = None, (factor,)
                self.feedback = Feedback(False, f"{self.symbol(factor)} was not read", (error.detail,))
                return
        moved = self.variable()
        values[moved] -= self.own_value(q)
        typed = Row(**values)
        there = choices.published(self.work)
        last = self.number == self.work.robot.n
        verdict = judge(self.work, self.chosen, typed, [there] if last and there is not None else [])
        if verdict.wrong:
            wrong = tuple(factor for factor in ORDERS[self.work.convention] if factor in verdict.wrong)
            self.ghost, self.wrong = typed, wrong
            sentences = tuple(self._explain(factor, typed, verdict, q) for factor in wrong)
            names = ", ".join(self.symbol(factor) for factor in wrong)
            are = "is" if len(wrong) == 1 else "are"
            self.feedback = Feedback(False, f"{names} {are} wrong", sentences)
            return
        self._accept(verdict, "Right")

    def show(self) -> None:
        """Make the next choice right, or fill the row in."""
        if self.work.complete:
            return
        part = self.part
        if part is not None:
            found = self.offered()[part]
            index = next(i for i, choice in enumerate(found) if choice.right)
            self.made[part] = index
            self.feedback = Feedback(True, f"The answer: {found[index].text}", (found[index].reason,))
            self._settle()
            return
        row = read_row(self.work.convention, self.work.frames[-1], self.chosen)
        self._accept(Verdict((), row, True), "Filled in")

    def back(self) -> None:
        """Take back the last choice, or the last row; of a frame from a link, all of it."""
        self._forget_row()
        self.feedback = None
        if not self._take_choice_back() and self.work.frames:
            self.work, self.made = self.work.without_last(), dict(self.finished[-1]) if self.finished else {}
            self.finished = self.finished[:-1]
            if self.number == 0:  # it has no row
                self._take_choice_back()
        self._settle()

    def _take_choice_back(self) -> bool:
        """Take back the last choice for the next frame that was one; returns whether there is one."""
        offered = self.offered() if not self.work.complete else {}
        own = [part for part in PARTS if part in self.made and len(offered.get(part, ())) > 1]
        for part in PARTS[PARTS.index(own[-1]) :] if own else ():
            self.made.pop(part, None)
        return bool(own)

    def restart(self) -> None:
        """Begin again."""
        self.__init__(Assignment(self.work.robot))  # type: ignore[misc]

    # Words and numbers

    def variable(self) -> Factor:
        """The parameter of the next row that its joint changes."""
        return MOVED[self.work.robot.joints[self.number - 1].kind]

    def own_value(self, q: Array) -> float:
        """What the joint of the next row adds to it at a configuration ``(n,)``."""
        joint = self.number - 1
        return self.work.sense(joint, [*self.work.frames, self.chosen]) * float(q[joint])

    def symbol(self, factor: Factor) -> str:
        """θ, d, a or α with its index; plain θ or d where the joint changes it: θ₃ is the joint's value."""
        letter = {"theta": "θ", "d": "d", "a": "a", "alpha": "α"}[factor]
        if factor == self.variable():
            return letter
        craig = self.work.convention == "modified" and factor in ("a", "alpha")
        return letter + low(self.number - 1 if craig else self.number)

    def meaning(self, factor: Factor) -> str:
        """What the parameter of the next row is, as step 7 says."""
        old, new = self.number - 1, self.number
        standard = self.work.convention == "standard"
        z, x = f"z{low(old if standard else new)}", f"x{low(new if standard else old)}"
        return {
            "theta": f"from x{low(old)} to x{low(new)}, about {z}",
            "d": f"from origin {old} to the normal, along {z}" if standard else f"to origin {new}, along {z}",
            "a": f"from z{low(old)} to z{low(new)}, along {x}",
            "alpha": f"from z{low(old)} to z{low(new)}, about {x}",
        }[factor]

    def _explain(self, factor: Factor, typed: Row, verdict: Verdict, q: Array) -> str:
        """Why a value is wrong, without the right one."""
        name = self.symbol(factor)
        meaning = f"the {'angle' if turns(factor) else 'distance'} {self.meaning(factor)}"
        own = self.own_value(q) if factor == self.variable() else 0.0
        given, right = (getattr(row, factor) + own for row in (typed, verdict.row))
        if own and ACCEPTED.is_near(factor, given, right - own):
            joint = self.number
            return f"{name} is measured at the pose on show: what you typed is its value with joint {joint} at 0."
        if not ACCEPTED.is_near(factor, given, 0.0) and ACCEPTED.is_near(factor, given, -right):
            rule = "Turn as a right-handed screw would." if turns(factor) else "Count along the arrow of the axis."
            return f"The size of {name} is right, its sign is not. It is {meaning}. {rule}"
        if turns(factor) and ACCEPTED.is_near(factor, given, right + math.pi):
            return f"{name} is half a turn off. It is {meaning}."
        swapped = {"d": "a", "a": "d"}.get(factor)
        if swapped and ACCEPTED.is_near(factor, given, getattr(verdict.row, swapped)):
            return f"{name} is {meaning}. You typed the other length."
        return f"{name} is {meaning}."

    def _accept(self, verdict: Verdict, title: str) -> None:
        number = self.number
        exact = read_row(self.work.convention, self.work.frames[-1], self.chosen)
        sentences = [f"Row {number} leads to frame {number}."]
        if not verdict.as_chosen:
            reverse = not verdict.row.differing(opposite_x(exact, self.work.convention), ACCEPTED)
            sentences = [
                f"Your numbers lead to another frame {number} than the one you chose, and to the same arm: "
                + (f"x{low(number)} points the other way." if reverse else "this place or direction is free.")
            ]
        self.work, self.finished = self.work.with_row(verdict.row), (*self.finished, self.made)
        self.made = {}
        self._forget_row()
        self.feedback = Feedback(True, title, tuple(sentences))
        self._settle()

    def _forget_row(self) -> None:
        self.typed, self.ghost, self.wrong = {}, None, ()

    def _settle(self) -> None:
        """Make choices of which there is one; place frame 0 when it has all of its."""
        while not self.work.complete:
            part = self.part
            if part is not None and part not in self.made and len(self.offered()[part]) == 1:
                self.made[part] = 0
            elif part is None and self.number == 0:
                self.finished = (*self.finished, self.made)
                self.work, self.made = self.work.with_base(self.chosen), {}
            else:
                return

    # In the link of the page

    def state(self) -> dict[str, object]:
        """As JSON."""
        frames = self.work.frames
        base = [] if not frames else [round(v, _DIGITS) for v in frames[0].ravel().tolist()]
        rows = [[round(getattr(row, f), _DIGITS) + 0.0 for f in FACTORS] for row in self.work.rows]
        return {"base": base, "rows": rows, "made": {str(part): index for part, index in self.made.items()}}

    @classmethod
    def restored(cls, robot: Robot, entry: object) -> Attempt:
        """An attempt from what `state` returned, as far as it is valid.

        Raises:
            InputError: the entry has no names.
        """
        values = record("assign", entry)
        attempt = cls(_restored(robot, values))
        with suppress(InputError):
            made = record("made", values.get("made"))
            for part in PARTS:
                index = ordinal(part, made.get(part))
                if index is not None and attempt.part == part and index < len(attempt.offered()[part]):
                    attempt.made = {**attempt.made, part: index}
        attempt._settle()
        return attempt


def _restored(robot: Robot, values: Mapping[str, object]) -> Assignment:
    """The frames and rows of a link, up to the first that is not valid."""
    work = Assignment(robot)
    with suppress(InputError):
        base = np.array(numbers("base", values.get("base"), 16, LARGEST)).reshape(4, 4)
        work = work.with_base(as_transform(base, "base"))
        for row in rows("rows", values.get("rows"), robot.n):
            work = work.with_row(Row(*numbers("row", row, 4, LARGEST)))
    return work


def error_of(work: Assignment) -> float:
    """The largest difference of a complete table from the arm, at random configurations."""
    return work.error(work.robot.random_q(np.random.default_rng(0), SAMPLES))


def table_robot(work: Assignment) -> Robot:
    """The rows assigned so far as the table of a robot, to be shown as one."""
    robot = work.robot
    rows = tuple(
        replace(joint, theta=row.theta, d=row.d, a=row.a, alpha=row.alpha)
        for joint, row in zip(robot.joints, work.rows, strict=False)
    )
    return replace(robot, id=f"{robot.id}-assigned", rows=rows, home=robot.home[: len(rows)])
