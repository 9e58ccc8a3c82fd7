"""An exercise: its text, what a seed draws, and its question."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

import kin
from app.exercises import cell
from app.exercises.cell import Declared
from app.exercises.contract import Kind
from app.exercises.expressions import Expression, ExpressionError, Function
from app.exercises.fields import Fields
from app.exercises.questions import Asked, Verdict
from app.exercises.typed import is_number
from app.exercises.variant import Facts, Joined, Quantity, Variant
from kin import Robot
from kin.transforms import Array, pose_from_position_wxyz
from kin.units import Units

TOPICS = ("Frames and DH tables", "Forward kinematics", "Inverse kinematics", "Velocity", "Motions")
CHECKED_SEEDS = range(8)
LONGEST = 5.0  # s of computing until numbers are drawn
_DRAWS = 500
MOST_VALUES = 1_000_000  # from which a number is drawn
# What one is in SI units, and what is measured.
UNITS = {"deg": (math.pi / 180, "angle"), "rad": (1.0, "angle"), "mm": (1e-3, "length"), "m": (1.0, "length")}
UNIT_HELP = "The unit of the numbers; none: they are as they are."


class VariantError(ValueError):
    """An exercise has no valid variant for a seed; the message says why.

    Attributes:
        field: of the file; empty if it is not known.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field


def _read_bound(above: Callable[[Fields], float]) -> cell.Read:
    """Reads a part of a range, for which a list of values may stand."""
    return lambda table, name: 0.0 if table.get("choose") else table.number(name, above=above(table))


def _read_values(table: Fields, name: str) -> tuple[float, ...]:
    found = table.items(name)
    if not all(map(is_number, found)):
        raise table.refuse(name, found, "numbers")
    return tuple(found)


@dataclass(frozen=True)
class Drawn(Declared):
    """A number that the seed draws: one of a range with steps, or one of a list, in its unit."""

    low: float = cell.special("From", "", "number", _read_bound(lambda table: -math.inf), "from")
    high: float = cell.special("To", "", "number", _read_bound(lambda table: table.number("from")), "to")
    step: float = cell.special("Step", "", "number", _read_bound(lambda table: 0.0))
    choose: tuple[float, ...] = cell.special("Or one of", "One in each line.", "numbers", _read_values)
    unit: str = cell.choice("Unit", UNIT_HELP, UNITS, "")

    def check(self, table: Fields) -> None:
        if not self.choose and not (self.high - self.low) / self.step <= MOST_VALUES:
            raise table.refuse("step", self.step, f"a step that gives at most {MOST_VALUES} values")

    def draw(self, source: random.Random) -> Quantity:
        """One of the values."""
        scale, measure = UNITS.get(self.unit, (1.0, ""))
        if self.choose:
            return Quantity(scale * source.choice(self.choose), measure)
        low, high, step = (scale * value for value in (self.low, self.high, self.step))
        return Quantity(low + source.randint(0, int((high - low) / step + 1e-9)) * step, measure)


@dataclass(frozen=True)
class Computed(Declared):
    """A number that is computed from those drawn and from the arm."""

    value: Expression = cell.expression("Value")
    unit: str = cell.choice("Shown in", UNIT_HELP, UNITS, "")

    @property
    def measure(self) -> str:
        """``"angle"``, ``"length"`` or ""."""
        return UNITS.get(self.unit, (1.0, ""))[1]


@dataclass(frozen=True)
class Target:
    """A pose: that of the tool at a configuration, or a point with the orientation at the configuration."""

    q: tuple[Expression, ...] = ()
    position: tuple[Expression, ...] = ()


@dataclass(frozen=True, eq=False)
class Exercise:
    """One exercise. It knows neither student nor page: exercise, seed and answer give a verdict.

    Attributes:
        id, title, topic, level, place, lesson: for lists; level 1 is the easiest, place orders those of one level,
            lesson is the key of a lesson, or "".
        robot: the id of the arm.
        text: the task; numbers drawn stand in braces.
        hints: shown one after the other.
        shown: why the answer is right; shown at the end.
        vary, let: what is drawn, and what is computed from it, each with its measure.
        require: what must hold of the numbers drawn.
        q: the configuration that the exercise is about; the home pose if empty.
        target: the pose that it is about.
        kind: its question.
        expressions: all of the file; each has a value in every variant.
        file: where it was read, for messages.
        source: the text of the file.
        builtin: whether it belongs to the package.
    """

    id: str
    title: str
    topic: str
    level: int
    place: int
    lesson: str
    robot: Robot
    text: str
    hints: tuple[str, ...]
    shown: str
    vary: Mapping[str, Drawn]
    let: Mapping[str, tuple[Expression, str]]
    require: tuple[Expression, ...]
    q: tuple[Expression, ...]
    target: Target | None
    kind: Kind
    expressions: tuple[Expression, ...] = ()
    file: str = ""
    source: str = ""
    builtin: bool = False

    @property
    def rank(self) -> tuple[int, int, int]:
        """Where it is in a list: by topic, level and place."""
        return TOPICS.index(self.topic), self.level, self.place

    def variant(self, seed: int) -> Variant:
        """The variant of a seed: the same in every process and version of Python.

        Raises:
            VariantError: no valid numbers were drawn.
        """
        name = f"{self.id}:{seed}"
        source, begun = random.Random(name), time.thread_time()
        for _ in range(_DRAWS if self.vary else 1):
            if time.thread_time() - begun > LONGEST:
                raise VariantError(f"the numbers for seed {seed} take longer than {LONGEST:g} s to draw")
            drawn = {key: rule.draw(source) for key, rule in self.vary.items()}
            try:
                variant = self._made(name, drawn)
                if all(variant.number(condition) for condition in self.require):
                    variant.vector(self.expressions)  # what has no value would fail when the question is shown
                    return variant
            except ExpressionError as error:
                raise VariantError(str(error), error.field) from None
        raise VariantError(f"no numbers that meet the conditions under require were drawn for seed {seed}")

    def _made(self, name: str, drawn: dict[str, Quantity]) -> Variant:
        robot, values = self.robot, dict(drawn)
        plain = {key: value.value for key, value in drawn.items()}
        scope: Mapping[str, float | Function] = plain
        q = robot.q_home
        waiting = dict(self.let)
        for needs_arm in (False, True):  # q may use what is computed without the arm
            for key, (expression, measure) in tuple(waiting.items()):
                if needs_arm or expression.names <= plain.keys():
                    values[key] = Quantity(expression.value(scope), measure)
                    plain[key] = values[key].value
                    del waiting[key]
            if not needs_arm:
                q = np.array([value.value(scope) for value in self.q]) if self.q else q
                scope = Joined(plain, Facts(robot, q))
        return Variant(name, robot, q, values, self._pose(q, scope), posed=self.q)

    def _pose(self, q: Array, scope: Mapping[str, float | Function]) -> Array | None:
        if self.target is None:
            return None
        if self.target.q:
            return np.asarray(kin.fk(self.robot, np.array([value.value(scope) for value in self.target.q])))
        T = pose_from_position_wxyz([value.value(scope) for value in self.target.position])
        T[:3, :3] = kin.fk(self.robot, q)[:3, :3]
        return T

    def asked(self, variant: Variant, units: Units) -> Asked:
        """What is asked; nothing in it gives the answer away."""
        return self.kind.asked(variant, units)

    def judge(self, variant: Variant, given: object, units: Units) -> Verdict:
        """Judge an answer; raises `kin.InputError` or `EntryError` for what is no answer."""
        return self.kind.judge(variant, given, units)

    def solution(self, variant: Variant, units: Units) -> str:
        """The right answer and why, for who has answered or given up."""
        return " ".join(filter(None, (self.kind.solution(variant, units), variant.text(self.shown, units))))

    def verify(self, tick: Callable[[], None] = lambda: None) -> None:
        """Try some seeds; raises `VariantError` naming the first for which the exercise makes no sense."""
        for seed in CHECKED_SEEDS if self.vary else (0,):
            tick()
            try:
                variant = self.variant(seed)
                if not self.robot.in_limits(variant.q, 1e-9):
                    raise ValueError("q is outside the limits of the arm")
                self.kind.verify(variant)
                for text in (self.text, *self.hints):
                    variant.text(text, Units())
                self.solution(variant, Units())
            except (ValueError, ExpressionError) as error:
                raise VariantError(f"seed {seed}: {error}", getattr(error, "field", "")) from None
