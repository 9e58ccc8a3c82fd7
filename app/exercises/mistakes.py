"""The mistake behind a wrong number: it is usually the right answer to a wrong model.

Each row of `ROWS` is one mistake that students make: it turns the arm, the configuration, the pose or the numbers
of a question into the mistaken ones, each with a clause that says what is mistaken. The question's expressions
give the number that the mistake leads to. A mistake is named only if it is the only one of the simplest that gives
the student's number: one alone goes before two at once. So that a number that is wrong by chance is not explained,
it must agree more closely the more mistakes give values near the answer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

import kin
from app.exercises.expressions import CONSTANTS, FUNCTIONS, Expression, ExpressionError, Function
from app.exercises.variant import Facts, Variant
from kin import KinematicsError, Robot
from kin.axes import inverse
from kin.comparison.mistakes import Edit, edits_by_themselves
from kin.comparison.tables import Tables
from kin.transforms import Array
from kin.units import Units, general

CHANCES = (0.02, 0.01)  # that a random number within ± 50 % of the answer is explained by one mistake, by a pair
NEAR, BESIDE_ZERO = 0.5, 10.0  # where random numbers are, of the answer, and of its tolerance if it is about zero
ROUNDING = 1e-6  # of the tolerance: numbers that differ by less are the same
_SYMBOLS = {"theta": "θ", "d": "d", "a": "a", "alpha": "α"}
_DEGREE = CONSTANTS["deg"]

Clauses = Iterator[tuple[str, Variant]]  # what is mistaken, after "You get this with", and the mistaken variant


@dataclass(frozen=True, eq=False)
class Case:
    """A question to make mistakes in: its expressions for a variant, in the reader's units.

    Attributes:
        by_table: whether rows of the DH table may be mistaken.
    """

    variant: Variant
    expressions: tuple[Expression, ...]
    units: Units
    by_table: bool = True

    @cached_property
    def names(self) -> frozenset[str]:
        """What its expressions use."""
        return frozenset[str]().union(*(each.names for each in self.expressions))

    @cached_property
    def _alone(self) -> frozenset[str]:
        """What is asked for as it is: no number that is given."""
        return frozenset(each.text.strip() for each in self.expressions)

    @cached_property
    def asks_arm(self) -> bool:
        """Whether the answer is computed from the arm. The tool point in a formula is given, like its numbers."""
        scope, facts = self.variant.scope, Facts(self.variant.robot, self.variant.q)
        known = self.names & facts.keys() - self.variant.values.keys() - self.variant.functions.keys()
        return any(name in self._alone or callable(scope[name]) for name in known)

    def numbers(self, measures: tuple[str, ...] = ("angle", "length", "")) -> Iterator[tuple[str, float, str]]:
        """The numbers that the student calculates with: name, value, and the words for it."""
        posed = [each.names for each in self.variant.posed] if self.asks_arm else []
        for name in sorted(self.names.union(*posed) - self._alone):
            value, known = self.variant.scope.get(name), self.variant.values.get(name)
            if isinstance(value, float) and (known.measure if known else "") in measures:
                shown = name if known is None else known.text(self.units) if known.measure else general(value, 4)
                yield name, value, shown

    def joints(self) -> Iterator[tuple[int, str]]:
        """The joints that no number of the text stands for: index and words."""
        posed = self.variant.posed
        for i in range(self.variant.robot.n if self.asks_arm else 0):
            if not posed or not posed[i].names:
                yield i, f"joint {i + 1}"

    def with_number(self, clause: str, name: str, value: float) -> Clauses:
        """Another value of a number, if the arm has a configuration for it."""
        with suppress(ExpressionError):
            yield clause, self.variant.with_number(name, value)

    def with_joint(self, joint: int, value: float) -> Variant:
        """The variant with another value of one joint."""
        q = self.variant.q.copy()
        q[joint] = value
        return replace(self.variant, q=q)

    def tables(self, mistake: str) -> Iterator[tuple[Edit, Variant]]:
        """The arms whose table has one mistake of `kin.comparison`'s kinds in it."""
        robot = self.variant.robot
        if self.asks_arm and self.by_table:
            for edit in edits_by_themselves(len(robot.rows)):
                if edit.mistake == mistake and (arm := _edited(edit, robot)) is not None:
                    yield edit, replace(self.variant, robot=arm)

    def seen(self, clause: str, pose: Callable[[Array], Array]) -> Clauses:
        """The tool taken to be elsewhere: `pose` makes it of the frames ``(rows + 1, 4, 4)`` from base to tool."""
        if self.asks_arm:
            robot, q = self.variant.robot, self.variant.q
            frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, q)])
            frames[-1] = kin.fk(robot, q)
            yield clause, replace(self.variant, facts=Facts(robot, q, pose(frames)))

    def function(self, name: str) -> Function:
        """What the calculator does for a name: after another mistake not the built-in function."""
        return self.variant.functions.get(name, FUNCTIONS[name])

    def calculated(self, clause: str, functions: dict[str, Function]) -> Clauses:
        """Other functions in place of those of the expressions."""
        yield clause, replace(self.variant, functions={**self.variant.functions, **functions})


def _edited(edit: Edit, robot: Robot) -> Robot | None:
    """The arm with the change; None if it makes no arm, or other joints: a slide is not taken for a hinge."""
    try:
        arm = edit.apply(Tables.of(robot)).robot(0, robot)
    except KinematicsError:
        return None
    return arm if np.array_equal(arm.revolute, robot.revolute) else None


def _sign(case: Case) -> Clauses:
    for name, value, shown in case.numbers():
        yield from case.with_number(f"the other sign of {shown}", name, -value)
    for joint, shown in case.joints():
        yield f"the other sign of {shown}", case.with_joint(joint, -case.variant.q[joint])
    for edit, mistaken in case.tables("sign"):
        if edit.rows:
            yield f"the other sign of {_SYMBOLS[edit.columns[0]]} in row {edit.rows[0] + 1}", mistaken


def _left_out(case: Case) -> Clauses:
    numbers, joints = list(case.numbers()), list(case.joints())
    if len(numbers) + len(joints) < 2:
        return  # nobody leaves out all that there is
    for name, _, shown in numbers:
        yield from case.with_number(f"{shown} left out", name, 0.0)
    for joint, shown in joints:
        yield f"{shown} left out", case.with_joint(joint, 0.0)


def _angle_unit(clause: str, factor: float) -> Callable[[Case], Clauses]:
    """Angles that a calculator takes for `factor` times as large ones."""

    def row(case: Case) -> Clauses:
        functions = _of_scaled(case, factor)
        q, turns = case.variant.q, case.variant.robot.revolute & case.asks_arm
        for words, mistaken in case.calculated(clause, functions):
            yield words, replace(mistaken, q=np.where(turns, factor * q, q))

    return row


def _of_scaled(case: Case, factor: float) -> dict[str, Function]:
    def scaled(function: Function) -> Function:
        return lambda angle: function(factor * angle)

    return {name: scaled(case.function(name)) for name in ("sin", "cos", "tan")}


def _length_unit(case: Case) -> Clauses:
    lengths = [one for one in case.numbers(("length",)) if one[1]]
    if len(lengths) + (case.asks_arm and any(row.d or row.a for row in case.variant.robot.rows)) < 2:
        return  # there are no other lengths
    for name, value, shown in lengths:
        yield from case.with_number(f"{shown} in millimetres, and other lengths in metres", name, 1e3 * value)


def _offset(case: Case) -> Clauses:
    for edit, mistaken in case.tables("offset"):
        yield f"the offset of row {edit.rows[0] + 1} forgotten", mistaken


def _convention(case: Case) -> Clauses:
    for _, mistaken in case.tables("convention"):
        name = "the standard" if mistaken.robot.convention == "standard" else "Craig’s"
        yield f"the table read in {name} convention", mistaken


def _rows(case: Case) -> Clauses:
    for edit, mistaken in case.tables("rows exchanged"):
        if edit.rows[1] == edit.rows[0] + 1:
            yield f"rows {edit.rows[0] + 1} and {edit.rows[1] + 1} exchanged", mistaken


def _transposed(case: Case) -> Clauses:
    def pose(frames: Array) -> Array:
        T = np.array(frames[-1])
        T[:3, :3] = frames[-1, :3, :3].T
        return T

    yield from case.seen("the transpose of the rotation", pose)


def _frame(case: Case) -> Clauses:
    if case.asks_arm and case.names & {"x", "y", "z", "J"}:  # a rotation alone is transposed
        robot, q = case.variant.robot, case.variant.q
        T = kin.fk(robot, q)
        facts = Facts(robot, q, inverse(T), T[:3, :3])
        yield "the frame of the tool in place of that of the base", replace(case.variant, facts=facts)


def _steps(frames: Array) -> list[Array]:
    """What each row adds ``(4, 4)``, the last one with the tool."""
    return [inverse(before) @ after for before, after in pairwise(frames)]


def _order(case: Case) -> Clauses:
    def pose(frames: Array) -> Array:
        return np.asarray(np.linalg.multi_dot([frames[0], *reversed(_steps(frames))]))

    yield from case.seen("the matrices multiplied in the other order", pose)


def _fixed_axes(case: Case) -> Clauses:
    def pose(frames: Array) -> Array:
        steps = _steps(frames)
        T = steps[-1].copy()
        T[:3, 3] = np.sum([step[:3, 3] for step in steps], axis=0)
        return np.asarray(frames[0] @ T)

    yield from case.seen("each link’s angle measured from the base, not from the link before it", pose)


def _previous(case: Case) -> Clauses:
    yield from case.seen("the frame before the last row", lambda frames: frames[-2])


def _sine(case: Case) -> Clauses:
    pairs = (("sin", "cos"), ("cos", "sin"), ("asin", "acos"), ("acos", "asin"))
    yield from case.calculated("sine and cosine exchanged", {name: case.function(other) for name, other in pairs})


def _atan(case: Case) -> Clauses:
    yield from case.calculated("atan in place of atan2", {"atan2": lambda y, x: math.atan(y / x)})


def _double_angle(case: Case) -> Clauses:
    for factor, words in ((2.0, "twice the angle"), (0.5, "half the angle")):
        yield from case.calculated(words, _of_scaled(case, factor))


def _diameter(case: Case) -> Clauses:
    for name, value, shown in case.numbers(("length",)):
        yield from case.with_number(f"twice {shown}", name, 2.0 * value)
        yield from case.with_number(f"half of {shown}", name, 0.5 * value)


def _branch(case: Case) -> Clauses:
    yield from case.calculated("the other sign of the angle", {"acos": lambda c: -math.acos(c)})
    yield from case.calculated("the other angle of this sine", {"asin": lambda s: math.pi - math.asin(s)})
    yield from case.calculated("the other sign of the root", {"sqrt": lambda square: -math.sqrt(square)})


def _other_angle(case: Case) -> Clauses:
    yield from case.calculated("180° minus the angle", {"acos": lambda c: math.pi - math.acos(c)})


def _sum(case: Case) -> Clauses:
    yield from case.calculated("the sides added", {"hypot": lambda *sides: sum(map(abs, sides))})


def _root(case: Case) -> Clauses:
    functions = {"sqrt": lambda square: square, "hypot": lambda *sides: math.hypot(*sides) ** 2}
    yield from case.calculated("the root left out", functions)


class Row(NamedTuple):
    """A mistake: what it makes of a question, what is said after the clause, and whether pairs have it."""

    mistaken: Callable[[Case], Clauses]
    advice: str
    likely: bool = False


# By their codes, as files and results name them.
ROWS: dict[str, Row] = {
    "sign": Row(_sign, "Look at the positive sense, and at the signs of the formula.", True),
    "left out": Row(_left_out, "It counts too."),
    "degrees": Row(
        _angle_unit("degrees taken for radians", 1.0 / _DEGREE), "Set the calculator to the unit of the angle."
    ),
    "radians": Row(
        _angle_unit("radians taken for degrees", _DEGREE), "Set the calculator to the unit of the angle."
    ),
    "millimetres": Row(_length_unit, "All lengths need the same unit."),
    "offset": Row(_offset, "A row turns by its offset and by the value of its joint."),
    "convention": Row(_convention, "Standard rows move along and about z first, Craig’s along and about x."),
    "rows exchanged": Row(_rows, "Rows follow one another from the base to the tool."),
    "transposed": Row(
        _transposed, "The columns of R are the axes of the tool; those of Rᵀ are the axes of the base."
    ),
    "frame": Row(_frame, "Components depend on the axes along which they are measured."),
    "order": Row(_order, "From left to right, the product leads from the base to the tool."),
    "fixed axes": Row(_fixed_axes, "A joint carries all that follows it along.", True),
    "previous frame": Row(_previous, "The last row leads from there to the tool."),
    "sine for cosine": Row(
        _sine, "The cosine belongs to the side beside the angle, the sine to the one opposite.", True
    ),
    "atan for atan2": Row(_atan, "Only atan2 tells the four quadrants apart."),
    "double angle": Row(_double_angle, "Look which angle the formula contains.", True),
    "diameter": Row(_diameter, "Look which length the formula contains."),
    "branch": Row(_branch, "There are two: look which one is asked for."),
    "other angle": Row(_other_angle, "Two lines make two angles. Look which one is asked for."),
    "sum": Row(_sum, "At a right angle add the squares, and take the root."),
    "root": Row(_root, "Squares add up to a square: take the root."),
}


@dataclass(frozen=True, eq=False)
class Model:
    """One or two mistakes.

    Attributes:
        codes: keys of `ROWS`.
        clauses: what is mistaken.
        variant: what the question is about then.
        values: what its expressions give there ``(k,)``.
    """

    codes: tuple[str, ...]
    clauses: tuple[str, ...]
    variant: Variant
    values: Array

    @property
    def said(self) -> str:
        """The mistake in words of the course."""
        advice = " ".join(dict.fromkeys(ROWS[code].advice for code in self.codes))
        return f"You get this with {' and with '.join(self.clauses)}. {advice}"

    @property
    def code(self) -> str:
        """For results."""
        return " + ".join(sorted(self.codes, key=list(ROWS).index))


@dataclass(frozen=True, eq=False)
class Models:
    """The mistakes that can be made in a question.

    Attributes:
        tolerances: accepted errors of its values.
        whole_turns: whether values that differ by whole turns are equal.
        without: codes of the rows that its file switches off.
    """

    case: Case
    tolerances: tuple[float, ...]
    whole_turns: bool
    without: frozenset[str]

    @cached_property
    def single(self) -> list[Model]:
        """One mistake each; only those that change the answer."""
        return self._apart(self._made(self.case, self.without))

    @cached_property
    def pairs(self) -> list[Model]:
        """Two of the likeliest each; not those that lead where one alone does: then the other changes nothing."""
        case = replace(self.case, by_table=False)
        off = self.without.union(code for code, row in ROWS.items() if not row.likely)
        alone = np.array([one.values for one in self.single]).reshape(-1, len(self.tolerances))
        found: dict[frozenset[str], Model] = {}
        for first in self._apart(self._made(case, off)):
            for then in self._made(replace(case, variant=first.variant), off):
                key = frozenset(first.clauses + then.clauses)
                if len(key) == 2 and not self._is_one_of(alone, then.values):
                    codes, clauses = first.codes + then.codes, first.clauses + then.clauses
                    found.setdefault(key, Model(codes, clauses, then.variant, then.values))
        return self._apart(found.values())

    def named(self, given: Sequence[float]) -> Model | None:
        """The only one of the simplest mistakes that gives these values; None if there is none, or another one."""
        for models, chance in zip((self.single, self.pairs), CHANCES, strict=True):
            accepted = self._accepted(models, chance)
            fits = [one for one in models if np.all(self._gaps(one.values, np.array(given)) <= accepted)]
            if fits:
                return fits[0] if len(fits) == 1 else None
        return None

    @cached_property
    def _right(self) -> Array:
        return self.case.variant.vector(self.case.expressions)

    def _gaps(self, values: Array, others: Array) -> Array:
        gaps = values - others
        return np.abs(np.remainder(gaps + math.pi, 2.0 * math.pi) - math.pi if self.whole_turns else gaps)

    def _is_one_of(self, rows: Array, values: Array) -> bool:
        same = self._gaps(rows, values) <= ROUNDING * np.array(self.tolerances)
        return bool(np.any(np.all(same, axis=1)))

    def _accepted(self, models: list[Model], chance: float) -> Array:
        """How far a number may be from that of a mistake ``(k,)``."""
        tolerances = np.array(self.tolerances)
        if len(tolerances) > 1:
            return tolerances  # all of several numbers agree by chance far too rarely
        size, zero = abs(float(self._right[0])), 2.0 * tolerances[0]
        most = NEAR * size if size > zero else BESIDE_ZERO * tolerances[0]
        values = sorted(float(one.values[0]) for one in models if self._gaps(one.values, self._right)[0] <= most)
        different = sum(b - a > tolerances[0] for a, b in zip([-math.inf, *values], values, strict=False))
        return np.asarray(np.minimum(tolerances, chance * most / max(different, 1)))

    def _made(self, case: Case, off: frozenset[str]) -> Iterator[Model]:
        for code, row in ROWS.items():
            for clause, variant in row.mistaken(case) if code not in off else ():
                try:
                    values = variant.vector(case.expressions)
                except (ExpressionError, KinematicsError):
                    continue  # the mistaken model has no such number
                yield Model((code,), (clause,), variant, values)

    def _apart(self, models: Iterable[Model]) -> list[Model]:
        """Those whose values nobody takes for the right ones, and that are not nothing: zero has many causes."""
        tolerances = 2.0 * np.array(self.tolerances)
        return [
            one
            for one in models
            if np.any(self._gaps(one.values, self._right) > tolerances) and np.any(np.abs(one.values) > tolerances)
        ]
