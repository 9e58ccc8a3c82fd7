"""A DH table with a mistake in it. The student corrects it and hears what `kin.compare` finds in the result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from typing import ClassVar, cast

import numpy as np

import kin
from app.exercises import cell
from app.exercises.contract import Kind
from app.exercises.fields import Fields
from app.exercises.questions import Asked, Verdict
from app.exercises.rows import ANGULAR, FACTORS, NAMES, Accepted, Factor, Row, read_rows, typed_rows
from app.exercises.variant import Variant
from kin import Robot
from kin.comparison import messages
from kin.comparison.diagnosis import differences
from kin.comparison.mistakes import Edit, Mistake, edits
from kin.comparison.tables import Tables
from kin.units import Units

# Mistakes that change cells and keep the rows.
MISTAKES: tuple[Mistake, ...] = (
    "sign",
    "quarter turn",
    "half turn",
    "offset",
    "twist",
    "exchanged",
    "rows exchanged",
    "shifted",
    "decimal point",
    "degrees",
    "radians",
    "millimetres",
    "metres",
    "centimetres",
)
ACCEPTED = Accepted(math.radians(0.2), 2e-3)  # of the poses
SECONDS = 0.5  # for pairs of mistakes in what a student has made of the table
_PROBES = 40
_DIGITS = 6
_CALLED: messages.Names = ("the arm", "your table")
_COUNTS = {1: "One change", 2: "Two changes"}


def _read_mistakes(table: Fields, name: str) -> tuple[Mistake, ...]:
    found = table.items(name, 1)
    for i, one in enumerate(found):
        if one not in MISTAKES:
            raise table.refuse(f"{name}[{i}]", one, "one of " + ", ".join(f'"{each}"' for each in MISTAKES))
    return tuple(found)


@dataclass(frozen=True)
class MistakeKind(Kind):
    """See the module.

    A table is right if equal joint values give equal poses. So another right table counts, and a change that makes
    no difference is never drawn as the mistake.
    """

    name: ClassVar[str] = "mistake"
    about: ClassVar[str] = "A DH table has one mistake and is corrected; any table with the arm's poses is right."
    shows_posture: ClassVar[bool] = True
    withholds: ClassVar[frozenset[str]] = frozenset({"table"})

    mistakes: tuple[Mistake, ...] = cell.special(
        "Mistakes", "One in each line: " + ", ".join(MISTAKES) + ".", "lines", _read_mistakes
    )

    def _wrong(self, variant: Variant) -> Robot:
        """The arm's table with the mistake drawn for this variant."""
        arm = variant.robot
        table = Tables.of(arm)
        source = variant.draw("mistake")
        kinds = list(dict.fromkeys(self.mistakes))
        source.shuffle(kinds)
        for kind in kinds:  # first the kind, so that one of which there are many is not drawn more often
            several: list[Edit] = [edit for edit in edits(table.rows, arm, False) if edit.mistake == kind]
            source.shuffle(several)
            for edit in several:
                made = edit.apply(table).robot(0, arm)
                if not _is_right(arm, made):
                    return made
        raise ValueError(f"none of the mistakes {', '.join(self.mistakes)} changes the poses of the arm")

    def asked(self, variant: Variant, units: Units) -> Asked:
        arm = variant.robot
        names = tuple(units.of(angular).name for angular in ANGULAR)
        slides = [str(joint + 1) for joint in range(arm.n) if not arm.revolute[joint]]
        added = "The value of a joint is added to θ of its row"
        if slides:
            added += f", that of joint {' and '.join(slides)} to d"
        if fixed := [str(i + 1) for i, row in enumerate(arm.rows) if row.kind == "fixed"]:
            added += (
                f"; row{'s' * (len(fixed) > 1)} {' and '.join(fixed)} {'is' if len(fixed) == 1 else 'are'} fixed"
            )
        convention = "the standard" if arm.convention == "standard" else "Craig’s"
        note = (
            f"In {convention} convention. {added}. "
            "Correct the table, so that equal joint values give the pose of the arm. "
            "The tab Robot shows the arm’s own table when the answer is known."
        )
        cells = tuple(tuple(row) for row in _texts(self._wrong(variant), units))
        return Asked("table", NAMES, names, note, len(arm.rows), cells=cells)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        arm, wrong = variant.robot, self._wrong(variant)
        shown = _texts(wrong, units)
        rows = read_rows(given, len(arm.rows), 0, units)
        kept = [  # a number that was not touched is exact
            Row(*(exact if text == old else new for exact, text, old, new in zip(*each, strict=True)))
            for each in zip(
                map(astuple, _rows(wrong)), cast("list[list[str]]", given), shown, map(astuple, rows), strict=True
            )
        ]
        table = _with_rows(arm, kept)
        if _is_right(arm, table):
            return Verdict(True, f"{_praise(arm, table, units)} {_diagnosis(arm, wrong, units)}")
        found = kin.compare(arm, table, tolerance=(ACCEPTED.length, ACCEPTED.angle), seconds=SECONDS)
        untouched = all(not _differing(one, other) for one, other in zip(kept, _rows(wrong), strict=True))
        said = ["This is still the table with its mistake."] if untouched else []
        said.append(messages.verdict(found, arm, table, units, _CALLED))
        if found.is_same:
            said.append("Equal joint values have to give equal poses.")
        if not untouched and found.explanations:
            first = found.explanations[0]
            left = "the arm" if first.mapping.is_trivial else "the same arm, but for zeros, base or tool"
            said.append(f"{_COUNTS[len(first.changes)]} would make it {left}.")
        elif not untouched and found.complete:
            said.append("More than two numbers are wrong in it.")
        return Verdict(False, " ".join(said))

    def answer(self, variant: Variant) -> object:
        return typed_rows(_rows(variant.robot))

    def solution(self, variant: Variant, units: Units) -> str:
        arm, wrong = variant.robot, self._wrong(variant)
        said = []
        for i, (right, typed_row) in enumerate(zip(_rows(arm), _rows(wrong), strict=True)):
            for factor in _differing(right, typed_row):
                unit = units.of(ANGULAR[FACTORS.index(factor)])
                name = NAMES[FACTORS.index(factor)]
                now, was = (unit.short(getattr(row, factor), 2) for row in (right, typed_row))
                said.append(f"{name} of row {i + 1} is {now}{unit.suffix}, not {was}{unit.suffix}")
        return f"{'; '.join(said)}."

    def verify(self, variant: Variant) -> None:
        super().verify(variant)
        if self.judge(variant, _texts(self._wrong(variant), Units()), Units()).right:
            raise ValueError("the table counts as right as it stands")


def _rows(robot: Robot) -> list[Row]:
    return [Row.of(row) for row in robot.rows]


def _texts(robot: Robot, units: Units) -> list[list[str]]:
    """The cells as they are shown."""
    return [
        [
            f"{value * units.of(angular).scale + 0.0:.{_DIGITS}g}"
            for value, angular in zip(astuple(row), ANGULAR, strict=True)
        ]
        for row in _rows(robot)
    ]


def _with_rows(arm: Robot, rows: Sequence[Row]) -> Robot:
    cells = [
        replace(own, theta=row.theta, d=row.d, a=row.a, alpha=row.alpha)
        for own, row in zip(arm.rows, rows, strict=True)
    ]
    return replace(arm, rows=tuple(cells), capsules=(), capsules_source="")


def _differing(one: Row, other: Row) -> tuple[Factor, ...]:
    return one.differing(other, Accepted(1e-9, 1e-9))


def _apart(arm: Robot, table: Robot) -> tuple[float, float]:
    """The largest difference of the poses at equal joint values: metres, radians."""
    q = arm.random_q(np.random.default_rng(3), _PROBES)
    position, rotation = differences(kin.fk(arm, q), kin.fk(table, q))
    return float(position.max()), float(rotation.max())


def _is_right(arm: Robot, table: Robot) -> bool:
    position, rotation = _apart(arm, table)
    return position <= ACCEPTED.length and rotation <= ACCEPTED.angle


def _praise(arm: Robot, table: Robot, units: Units) -> str:
    position, rotation = _apart(arm, table)
    if position > 1e-6 or rotation > 1e-6:
        near = f"{units.lengths.size(position)} and {units.angles.size(rotation)}"
        return f"Equal joint values give poses that differ by no more than {near}, as far as was tried."
    own = not any(_differing(one, other) for one, other in zip(_rows(arm), _rows(table), strict=True))
    return "Equal joint values give equal poses" + ("." if own else ", though some rows are not the arm’s own.")


def _diagnosis(arm: Robot, wrong: Robot, units: Units) -> str:
    """What the comparison says of the table as it was asked."""
    found = kin.compare(arm, wrong, seconds=SECONDS)
    if not found.explanations:
        return ""
    text = messages.explanation(found.explanations[0], arm, wrong, units)
    return f"kin.compare says of the table as it was: “{text}”"
