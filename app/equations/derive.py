"""Forward kinematics of any arm as equations people can read, derived from its DH table with sympy.

Multiplying the rows out blindly gives correct and useless pages. Four ideas keep the result short:

1. **Parallel axes add.** While the twist between rows is 0 or 180° their joints turn about parallel lines, and
   Rz(θ2) Rz(θ3) = Rz(θ2 + θ3): one c23 instead of c2*c3 − s2*s3. After a twist of 180° an angle counts negative. A
   run of such rows is one *link* of the derivation; so no trigonometric identity has to be searched for.
2. **Right angles are exact.** Twists and offsets of 90° turn into 0, ±1, or c into s. Any other constant keeps a
   name (β2 for the offset, cα2 for the cosine of the twist of row 2), so that equations hold no rounded numbers.
3. **The tool hangs on its own z axis.** What the last rows add along it is d a: p = wrist + d a, with a from the
   equations of the third column.
4. **Products stay nested**, c1*(c23*(…) − s23*(…)), as they come out of multiplying from the tool to the base.
   An arm whose entries get longer than `LONGEST` is cut in two: the axes x4, y4, z4 and the origin p4 of a frame
   in the middle, and n', o', a', p', the tool as seen from there. Then n = x4 n'_x + y4 n'_y + z4 n'_z.

sympy is imported on first use: it takes most of a second, for which requests without derived equations should
not wait.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.equations.equation import AXES, COLUMNS
from app.equations.expression import Expression, Name, Negative, Number, Sum, add, multiply, negative, size
from app.equations.symbols import Symbol, Turn, length, trig
from app.equations.typeset import glyphs
from kin import Joint, Robot
from kin.robot import exact_cos_sin
from kin.transforms import Array

LONGEST = 24  # names in one entry
MOST_LINKS = 5  # multiplied without names in between

Order = tuple[int, tuple[int, ...], str]


@dataclass(frozen=True, slots=True)
class Line:
    """An intermediate result: a name for an expression."""

    name: str
    expression: Expression


@dataclass(frozen=True, slots=True)
class Derived:
    """The twelve entries of T_base_tool in closed form.

    Attributes:
        symbols: what the names stand for, by name.
        lines: intermediate results, each using only those before it.
        entries: ``n_x`` … ``p_z``; those of p may use those of a.
    """

    symbols: dict[str, Symbol]
    lines: tuple[Line, ...]
    entries: dict[str, Expression]


def derive(robot: Robot) -> Derived:
    """The closed form of an arm's forward kinematics. Not checked: see `app.equations.books.book`."""
    return _Derivation(robot).result()


class _Link:
    """A run of rows with parallel axes, ``before`` Trans(p) Rz(φ) Rx(0 or 180°), φ a sum of turns.

    `before` is a constant rotation ``(4, 4)``: the twist that Craig's convention puts in front.
    """

    def __init__(self, derivation: _Derivation, before: Any = None) -> None:
        self._derivation = derivation
        self._before = before
        self._turns: list[Turn] = []
        self._quarters = 0
        self._sign = 1
        self.p = [derivation.sp.Integer(0)] * 3
        self.empty = before is None

    def turn(self, turn: Turn) -> None:
        self.empty = False
        quarter = turn.constant / (math.pi / 2)
        turn = turn if self._sign > 0 else turn.reversed
        if turn.joint < 0 and abs(quarter - round(quarter)) < 1e-15 * max(1.0, abs(quarter)):
            self._quarters += self._sign * round(quarter)
        elif turn.reversed in self._turns:  # of a row that turns the joint's angle back
            self._turns.remove(turn.reversed)
        else:
            self._turns.append(turn)

    def move(self, x: Any, y: Any, z: Any) -> None:
        self.empty = False
        c, s = self._cos_sin()
        self.p[0] += x * c - self._sign * y * s
        self.p[1] += x * s + self._sign * y * c
        self.p[2] += self._sign * z

    def flip(self) -> None:
        self.empty = False
        self._sign = -self._sign

    @property
    def along_tool(self) -> Any:
        """The z part of the position as a multiple of the last frame's z axis."""
        return self._sign * self.p[2]

    def matrix(self) -> Any:
        c, s = self._cos_sin()
        g = self._sign
        matrix = self._derivation.sp.Matrix(
            [[c, -g * s, 0, self.p[0]], [s, g * c, 0, self.p[1]], [0, 0, g, self.p[2]], [0, 0, 0, 1]]
        )
        return matrix if self._before is None else self._before * matrix

    def _cos_sin(self) -> tuple[Any, Any]:
        sp = self._derivation.sp
        c, s = sp.Integer(1), sp.Integer(0)
        if self._turns:
            turns = tuple(self._turns)
            n = self._derivation.robot.n
            c, s = (self._derivation.symbol(trig(kind, turns, n)) for kind in ("cos", "sin"))
        return ((c, s), (-s, c), (-c, -s), (s, -c))[self._quarters % 4]


class _Derivation:
    def __init__(self, robot: Robot) -> None:
        import sympy

        self.sp = sympy
        self.robot = robot
        self.symbols: dict[str, Symbol] = {}
        self._lines: list[Line] = []
        self._links: list[Any] = []  # 4×4 sympy matrices
        self._frames: list[int] = []  # how many rows are behind the end of each link
        self._products: dict[tuple[int, int], Any] = {}
        self._along: Any = sympy.Integer(0)
        self._link = _Link(self)

    def symbol(self, symbol: Symbol) -> Any:
        self.symbols[symbol.name] = symbol
        return self.sp.Symbol(symbol.name)

    def result(self) -> Derived:
        self._walk()
        # Nested products double with each link: what is certainly too long is not tried.
        count = math.ceil(len(self._links) / MOST_LINKS) or 1
        while True:
            self._lines = []
            entries = self._assemble(self._chunks(count), "")
            out = self._finish(entries)
            longest = max(map(size, (*out.entries.values(), *(line.expression for line in out.lines))))
            if longest <= LONGEST or count >= len(self._links):
                return out
            count += 1

    # From the table to links

    def _walk(self) -> None:
        self._constant(self.robot.T_world_base, "b", "base")
        moving = iter(self.robot.expansion)
        for i, row in enumerate(self.robot.rows):
            weights = next(moving) if row.moves else np.zeros(self.robot.n)
            if self.robot.convention == "modified":
                self._twist(i, row)
                self._link.move(self._length("a", i, row), 0, 0)
                self._screw(i, row, weights)
            else:
                self._screw(i, row, weights)
                self._link.move(self._length("a", i, row), 0, 0)
                self._twist(i, row)
        rows = len(self.robot.rows)
        tool = self.robot.T_last_tool
        self._move_by(tool, "t", "tool")
        # The part of the last link along its z axis is written as a multiple of a, unless there is nothing else.
        if self._links and not self._link.empty and _no_rotation(tool):
            self._along = self._link.along_tool
            self._link.p[2] = self.sp.Integer(0)
        self._close(rows)
        self._rotate(tool, "t", "tool", rows)

    def _screw(self, i: int, row: Joint, weights: Array) -> None:
        """weights ``(n,)``: how often the value of each joint counts in that of the row."""
        joint = int(np.argmax(np.abs(weights)))
        if row.kind == "revolute":
            sign = 1 if weights[joint] > 0.0 else -1
            for _ in range(abs(round(weights[joint]))):
                self._link.turn(Turn(str(joint + 1), sign, joint))
        self._link.turn(Turn(f"β{i + 1}", 1, constant=row.theta))
        if row.kind != "prismatic":
            self._link.move(0, 0, self._length("d", i, row))
            return
        meaning = f"travel of joint {joint + 1}, {row.name}"
        if row.follows:
            meaning = f"{row.ratio:g} times the value of joint {joint + 1}, {row.follows}"
        if row.d:
            meaning += f", plus {row.d:g} m"
        self._link.move(0, 0, self.symbol(Symbol(f"d{i + 1}", "slide", tuple(weights.tolist()), row.d, meaning)))

    def _length(self, letter: str, i: int, row: Joint) -> Any:
        value = row.d if letter == "d" else row.a
        if value == 0.0:
            return self.sp.Integer(0)
        meaning = f"{letter} of row {i + 1}, {row.name}"
        return self.symbol(length(f"{letter}{i + 1}", value, self.robot.n, meaning))

    def _twist(self, i: int, row: Joint) -> None:
        c, s = exact_cos_sin(row.alpha)
        if s == 0.0:
            if c < 0.0:
                self._link.flip()
            return
        entries: list[Any] = []
        for kind, number in (("cos", c), ("sin", s)):
            if number in (0.0, 1.0, -1.0):
                entries.append(self.sp.Integer(int(number)))
            else:
                meaning = f"{kind} of the twist of row {i + 1}, {row.name}"
                entries.append(self._number(f"{kind[0]}α{i + 1}", number, meaning))
        c, s = entries
        rotation = self.sp.Matrix([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])
        if self.robot.convention == "standard":
            self._close(i + 1, rotation)
        else:
            self._close(i)
            self._link = _Link(self, rotation)

    def _number(self, name: str, value: float, meaning: str) -> Any:
        return self.symbol(Symbol(name, "number", (0.0,) * self.robot.n, value, meaning))

    def _constant(self, T: Array, letter: str, where: str) -> None:
        self._move_by(T, letter, where)
        self._rotate(T, letter, where, 0)

    def _move_by(self, T: Array, letter: str, where: str) -> None:
        if T[:3, 3].any():
            shift: list[Any] = []
            for axis, value in zip(AXES, T[:3, 3].tolist(), strict=True):
                meaning = f"{axis} of the {where}'s origin"
                name = f"{letter}_{axis}"
                shift.append(self.symbol(length(name, value, self.robot.n, meaning)) if value else 0)
            self._link.move(*shift)

    def _rotate(self, T: Array, letter: str, where: str, rows: int) -> None:
        if _no_rotation(T):
            return
        rotation = self.sp.eye(4)
        for r in range(3):
            for c in range(3):
                value = float(T[r, c])
                if value in (0.0, 1.0, -1.0):
                    rotation[r, c] = int(value)
                else:
                    meaning = f"row {r + 1}, column {c + 1} of the {where}'s rotation"
                    rotation[r, c] = self._number(f"{letter}{r + 1}{c + 1}", value, meaning)
        self._close(rows, rotation)

    def _close(self, rows: int, after: Any = None) -> None:
        """The link under way is done, `after` being the constant rotation behind it; begin another."""
        if after is None and self._link.empty:
            return
        matrix = self._link.matrix()
        self._links.append(matrix if after is None else matrix * after)
        self._frames.append(rows)
        self._link = _Link(self)

    # From links to equations

    def _chunks(self, count: int) -> list[tuple[int, Any]]:
        """The links as `count` products of about equally many, the longer ones first, with their last frames."""
        if not self._links:
            return [(0, self.sp.eye(4))]
        out: list[tuple[int, Any]] = []
        start = 0
        for k in range(count):
            stop = start + math.ceil((len(self._links) - start) / (count - k))
            out.append((self._frames[stop - 1], self._product(start, stop)))
            start = stop
        return out

    def _product(self, start: int, stop: int) -> Any:
        """Product of the links from `start` to before `stop`, nested, each computed once."""
        if stop - start == 1:
            return self._links[start]
        if (start, stop) not in self._products:
            link = self._links[start]
            # a1*c1 + c1*(…) as c1*(a1 + …): the angles of the link nearest to the base multiply everything behind.
            angles = [symbol for symbol in link.free_symbols if self.symbols[symbol.name].kind in ("cos", "sin")]
            product = (link * self._product(start + 1, stop)).applyfunc(
                lambda entry: self.sp.collect(entry, angles)
            )
            self._products[start, stop] = product
        return self._products[start, stop]

    def _assemble(self, chunks: list[tuple[int, Any]], primes: str) -> Any:
        """Product of the chunks; of several, the first and the product of the others get names."""
        frame, head = chunks[0]
        if len(chunks) == 1:
            return head
        tail = self._assemble(chunks[1:], primes + "'")
        point = "w" if self._along != 0 else "p"
        head = self._named(head, [f"{axis}{frame}" for axis in (*AXES, "p")], primes)
        tail = self._named(tail, ["n", "o", "a", point], primes + "'")
        return head * tail

    def _named(self, matrix: Any, letters: list[str], primes: str) -> Any:
        """The matrix with a name for each entry that is longer than a name."""
        out = matrix.copy()
        for c, letter in enumerate(letters):
            for r, axis in enumerate(AXES):
                expression = _tree(matrix[r, c])
                if size(expression) > 1:
                    name = f"{letter}_{axis}{primes}"
                    self._lines.append(Line(name, expression))
                    out[r, c] = self.sp.Symbol(name)
        return out

    def _finish(self, matrix: Any) -> Derived:
        entries = {}
        for c, letter in enumerate(COLUMNS):
            for r, axis in enumerate(AXES):
                entry = matrix[r, c]
                if letter == "p" and self._along != 0:
                    a = matrix[r, 2]
                    entry += self._along * (a if a.is_number else self.sp.Symbol(f"a_{axis}"))
                entries[f"{letter}_{axis}"] = _tree(entry)
        return Derived(dict(self.symbols), tuple(self._lines), entries)


def _no_rotation(T: Array) -> bool:
    return all(T[r, c] == float(r == c) for r in range(3) for c in range(3))


# From the order of sympy to the order of textbooks


def _tree(expression: Any) -> Expression:
    """A sympy expression of symbols, integers, sums and products as ours."""
    if expression.is_Symbol:
        return Name(expression.name)
    if expression.is_Integer:
        number = int(expression)
        return Number(number) if number >= 0 else Negative(Number(-number))
    if expression.is_Add:
        parts = sorted(map(_tree, expression.args), key=_term_order)
        first = next((i for i, part in enumerate(parts) if not isinstance(part, Negative)), 0)
        return add([parts[first], *parts[:first], *parts[first + 1 :]])
    if expression.is_Mul:
        parts = list(map(_tree, expression.args))
        parts = [_turned_over(part) for part in parts]
        minus = sum(isinstance(part, Negative) for part in parts) % 2 == 1
        parts = [part.of if isinstance(part, Negative) else part for part in parts]
        parts = sorted((part for part in parts if part != Number(1)), key=_order)
        product = multiply(parts) if parts else Number(1)
        return negative(product) if minus else product
    raise ValueError(f"not a polynomial: {expression}")


def _turned_over(expression: Expression) -> Expression:
    """−(a + b) for (−a − b)."""
    if isinstance(expression, Sum) and all(isinstance(term, Negative) for term in expression.terms):
        return Negative(add([negative(term) for term in expression.terms]))
    return expression


def _order(expression: Expression) -> Order:
    """Lengths, then cosines and sines by joint, then frames, then the tool as seen from one, then brackets."""
    if isinstance(expression, Number):
        return 0, (), ""
    if not isinstance(expression, Name):
        return 6, (), ""
    name = glyphs(expression.id)
    index = name.index
    numbers = tuple(int(digit) for part in index if part.isdigit() for digit in part)
    if name.letter in "cs" and "α" not in index:
        return 2, numbers, name.letter
    if name.letter in "pxyz" and "," in index:
        return 3, ("pxyz".index(name.letter),), expression.id
    if name.primes:
        return 4, (), expression.id
    if index and index[-1] in AXES and name.letter == "a":
        return 5, (), expression.id
    return 1, numbers, name.letter


def _term_order(term: Expression) -> tuple[list[Order], list[Order], list[Order]]:
    """By the frames in it, then by the joints, and by its lengths last."""
    term = term.of if isinstance(term, Negative) else term
    keys = [_order(factor) for factor in getattr(term, "factors", (term,))]
    return [key for key in keys if 2 < key[0] < 6], [key for key in keys if key[0] in (2, 6)], keys
