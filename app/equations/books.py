"""The equations of one arm, ready to be shown: the chapter's own, or derived ones that have passed their check.

`book` returns them when they are ready, for scripts. A visitor's worker and the event loop must not wait for it,
so they call `book_later`. Both share one cache and one thread.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from app.equations import chapter
from app.equations.derive import Line, derive
from app.equations.equation import AXES, Equation, turned
from app.equations.expression import Expression, from_text, names, value, written_out
from app.equations.symbols import Symbol, chapter_symbols
from app.shared.computations import ComputationCache, SharedComputation, Subscription
from kin import Robot, fk, get_robot
from kin.transforms import Array

CHECKED = 1000  # random configurations at which a derived form is checked
AGREES = 1e-12  # tolerance, relative to the size of the arm; absolute for directions
KEPT = 64  # books
MOST_ROWS = 16  # of an arm whose equations are derived: a second, and pages that can be read
MAX_PENDING = 8  # derivations


class DerivationError(RuntimeError):
    """A derived closed form disagrees with forward kinematics."""


class NotDerivedError(DerivationError):
    """Equations are not derived for such an arm: see `book_later`."""


@dataclass(frozen=True)
class Values:
    """One equation at configurations: arrays ``(...)``, in metres for p, else pure numbers.

    `printed` is None where nothing is printed. `difference` and `turn` are those of what is on show, the printed
    form if there is one, from the DH product: the latter as an angle, see `app.equations.equation.turned`.
    """

    printed: Array | None
    correct: Array
    dh: Array
    difference: Array
    turn: Array


@dataclass(frozen=True, eq=False)
class Book:
    """All equations of one arm.

    Attributes:
        source: whether they are the chapter's or derived here.
        symbols: what the names stand for, by name.
        lines: intermediate results, each using only those before it.
        equations: position first for derived ones, in the order of the print for the chapter's.
    """

    robot: Robot
    source: Literal["chapter", "derived"]
    symbols: dict[str, Symbol]
    lines: tuple[Line, ...]
    equations: tuple[Equation, ...]

    def equation(self, key: str) -> Equation:
        """The one with this id; raises KeyError."""
        return self._by_id[key]

    def values(self, equation: Equation, q: Array, T_base_tool: Array | None = None) -> Values:
        """An equation that can be read, at configurations ``(..., n)``; their poses may be given."""
        return self._values(equation, q, fk(self.robot, q) if T_base_tool is None else T_base_tool, {})

    def compare(self, q: Array) -> list[tuple[Equation, Values]]:
        """Every equation that can be read, at configurations ``(..., n)``."""
        T = fk(self.robot, q)
        values: dict[str, Array] = {}
        return [(e, self._values(e, q, T, values)) for e in self.equations if e.correct is not None]

    def as_printed(self, q: Array) -> Array:
        """The tool's pose ``(..., 4, 4)`` by the equations as they are printed; it need not be one."""
        T = np.array(fk(self.robot, q))
        for equation, values in self.compare(q):
            T[(..., *equation.index)] = values.correct if values.printed is None else values.printed
        return T

    def written_out(self, expression: Expression) -> Expression:
        """The expression as the chapter writes it, which has no names for intermediate results."""
        return written_out(expression, {name: line.expression for name, line in self._lines.items()})

    def _values(self, equation: Equation, q: Array, T: Array, values: dict[str, Array]) -> Values:
        forms = [form for form in (equation.printed, equation.correct) if form is not None]
        for form in forms:
            for name in names(form):
                self._value(name, q, values)
        *printed, correct = (np.broadcast_to(value(form, values), q.shape[:-1]) for form in forms)
        dh = T[(..., *equation.index)]
        shown = printed[0] if printed else correct
        turn = turned(T, equation.index, shown)
        return Values(printed[0] if printed else None, correct, dh, shown - dh, turn)

    def lines_of(self, equation: Equation) -> list[Line]:
        """The intermediate results it needs, in order; not among them: entries with an equation of their own."""
        wanted: set[str] = set()
        fresh = [name for form in (equation.printed, equation.correct) if form for name in names(form)]
        while fresh:
            line = self._lines.get(fresh.pop())
            if line is not None and line.name not in wanted:
                wanted.add(line.name)
                fresh += names(line.expression)
        return [line for line in self.lines if line.name in wanted]

    def symbols_of(self, equation: Equation) -> list[Symbol]:
        """The symbols in it and in its intermediate results."""
        forms = [equation.printed, equation.correct, *(line.expression for line in self.lines_of(equation))]
        found = {name for form in forms if form is not None for name in names(form)}
        return [symbol for name, symbol in self.symbols.items() if name in found]

    @cached_property
    def _by_id(self) -> dict[str, Equation]:
        return {equation.id: equation for equation in self.equations}

    @cached_property
    def _lines(self) -> dict[str, Line]:
        return {line.name: line for line in self.lines}

    @cached_property
    def _entries(self) -> dict[str, Expression]:
        return {e.entry: e.correct for e in self.equations if e.correct is not None}

    def _value(self, name: str, q: Array, values: dict[str, Array]) -> None:
        """Add the value of a name to `values`, after the values it depends on."""
        if name in values:
            return
        if name in self.symbols:
            values[name] = self.symbols[name].value(q)
            return
        form = self._lines[name].expression if name in self._lines else self._entries[name]
        for inner in names(form):
            self._value(inner, q, values)
        values[name] = value(form, values)


def book(robot: Robot) -> Book:
    """The equations of an arm: the chapter's if it prints any, else derived and checked, which may take a second.

    Raises:
        DerivationError: the check failed, the message states the difference; or the arm has too many rows.
    """
    with book_later(robot) as waiting:
        return waiting.future.result()


def book_later(robot: Robot, limited: bool = False) -> Subscription[Book]:
    """`book`, computed in a background thread, one arm after the other. A caller that waits no more must `leave`.

    Args:
        robot: the arm.
        limited: raise `TooManyPendingError` instead of queueing behind too many derivations.

    Raises:
        NotDerivedError: at once, for an arm with too many rows, or a row that turns by a part of a joint's angle.
    """
    kinds = {row.name: row.kind for row in robot.rows}
    for row in robot.rows:
        whole = row.ratio.is_integer() and kinds.get(row.follows) == "revolute"
        if row.follows and row.kind == "revolute" and not whole:
            expected = "rows that turn by whole multiples of a joint's angle"
            raise NotDerivedError(f"equations are derived for {expected}, {row.name} does not")
    rows = len(robot.rows)
    if rows > MOST_ROWS:
        raise NotDerivedError(f"equations are derived for at most {MOST_ROWS} rows, this arm has {rows}")
    return _BOOKS.subscribe(robot, lambda computation: _make(robot, computation), MAX_PENDING if limited else None)


_BOOKS: ComputationCache[Book] = ComputationCache(ThreadPoolExecutor(1, thread_name_prefix="equations"), KEPT)


def _make(robot: Robot, computation: SharedComputation[Book]) -> Book:
    if robot.id in chapter.EQUATIONS and robot == get_robot(robot.id):
        return _chapter_book(robot)
    derived = derive(robot)
    computation.check()
    order = [f"{column}_{row}" for column in "pnoa" for row in AXES]
    equations = tuple(Equation(key, None, key, "derived", None, derived.entries[key]) for key in order)
    out = Book(robot, "derived", derived.symbols, derived.lines, equations)
    check(out)
    return out


def check(found: Book) -> None:
    """Compare a book with forward kinematics; raises `DerivationError` where they disagree."""
    robot = found.robot
    q = robot.random_q(np.random.default_rng(0), CHECKED)
    size = robot.reach + float(np.linalg.norm(robot.T_world_base[:3, 3]))
    if not math.isfinite(size):  # a prismatic joint without limits
        size = 1.0 + float(np.abs(q).max())
    for equation, values in found.compare(q):
        error = float(np.abs(values.correct - values.dh).max())
        # Written so that a NaN fails too.
        if not error <= AGREES * (size if equation.is_length else 1.0):
            raise DerivationError(
                f"the closed form derived for {equation.entry} of {robot.id} is off by {error:.2g} and not shown"
            )


def _chapter_book(robot: Robot) -> Book:
    equations = chapter.EQUATIONS[robot.id]
    used = {name for e in equations for form in (e.printed, e.correct) if form is not None for name in names(form)}
    lines = tuple(Line(name, from_text(text)) for name, text in chapter.ABBREVIATIONS.items() if name in used)
    return Book(robot, "chapter", chapter_symbols(robot), lines, equations)
