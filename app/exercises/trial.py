"""A draft of an exercise, tried: whether it is one, and what three students get."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from app.exercises.exercise import Exercise, VariantError
from app.exercises.fields import ExerciseFileError
from app.exercises.files import Find, parse_exercise
from app.exercises.kinds.number import MEASURES, OTHER, RATE, SCALES, NumberKind
from app.exercises.variant import Quantity, Variant, unit_of
from kin import KinematicsError
from kin.units import Units, general

SEEDS = (0, 1, 2)


@dataclass(frozen=True)
class Student:
    """What one student gets: the numbers drawn by name, the text, the answer, or why there is nothing."""

    numbers: Mapping[str, str] = field(default_factory=dict)
    text: str = ""
    answer: str = ""
    failure: str = ""


@dataclass(frozen=True, eq=False)
class Trial:
    """What became of a draft.

    Attributes:
        exercise: None: it is none.
        field: of the file, that the error is about; empty if it is not known.
        error: why it is no exercise, or cannot be solved; empty: it was solved for every seed that is tried.
        variants: for the seeds; None where no numbers could be drawn.
    """

    exercise: Exercise | None
    field: str = ""
    error: str = ""
    variants: tuple[Variant | None, ...] = ()

    def students(self, units: Units) -> tuple[Student, ...]:
        """What the students of the seeds get."""
        drawn = zip(SEEDS, self.variants, strict=bool(self.variants))
        return tuple(self._student(seed, variant, units) for seed, variant in drawn)

    def _student(self, seed: int, variant: Variant | None, units: Units) -> Student:
        one = self.exercise
        assert one is not None
        if variant is None:
            return Student(failure=f"No numbers were drawn for seed {seed}.")
        numbers = {name: value.text(units) for name, value in variant.values.items()}
        try:
            return Student(numbers, variant.text(one.text, units), one.solution(variant, units))
        except (KinematicsError, ValueError) as error:
            return Student(numbers, variant.text(one.text, units), failure=str(error))

    def with_taken_id(self) -> Trial:
        """The same of a draft whose id another exercise has."""
        got = "" if self.exercise is None else self.exercise.id
        return replace(self, field="id", error=f"got “{got}”, expected an id that no other exercise has")

    def values(self, units: Units) -> dict[str, tuple[str, ...]]:
        """The values of each expression for the seeds, by its field in the file."""
        if self.exercise is None:
            return {}
        found = {}
        for expression in self.exercise.expressions:
            texts = []
            for variant in self.variants:
                value = None if variant is None else variant.number(expression)  # has one: `Exercise.variant`
                texts.append("–" if value is None else _said(self.exercise, expression.field, value, units))
            found[expression.field] = tuple(texts)
        return found


def tried(text: str, file: str, find: Find) -> Trial:
    """Try a draft: parsed, drawn and solved as ``kinboard check`` does it.

    Args:
        text: TOML.
        file: the name in messages.
        find: gives the arm of an id.
    """
    try:
        exercise = parse_exercise(text, file, find)
    except ExerciseFileError as error:
        return Trial(None, error.field, f"got {error.value}, expected {error.expected}")
    variants: list[Variant | None] = []
    for seed in SEEDS:
        try:
            variants.append(exercise.variant(seed))
        except VariantError:
            variants.append(None)  # `verify` says why
    name, why = "", ""
    try:
        exercise.verify()
    except VariantError as error:
        name, why = error.field or "answer", str(error)
    return Trial(exercise, name, why, tuple(variants))


def _said(exercise: Exercise, name: str, value: float, units: Units) -> str:
    """The value of an expression, in the unit in which the reader sees it."""
    table, _, rest = name.partition(".")
    if table == "let":
        measure = next((measure for expression, measure in exercise.let.values() if expression.field == name), "")
        return Quantity(value, measure).text(units)
    if table.startswith("q[") or name.startswith("target.q["):
        joint = int(name.rpartition("[")[2].rstrip("]"))
        unit = units.of(bool(exercise.robot.revolute[joint]))
        return unit.short(value) + unit.suffix
    if name.startswith("target.position"):
        return units.lengths.short(value) + units.lengths.suffix
    kind = exercise.kind
    if isinstance(kind, NumberKind) and table == "answer" and ("value" in rest or rest == "least"):
        shown = unit_of(MEASURES.get(kind.unit, ""), units)
        if shown is not None:
            return f"{general(value * shown.scale, 5)}{shown.suffix}"
        suffix = f" {kind.unit}" if kind.unit in (*OTHER, RATE) else ""
        return general(value / SCALES.get(kind.unit, 1.0), 5) + suffix
    return general(value, 5)
