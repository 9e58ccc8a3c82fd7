"""The symbols in the equations of an arm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from app.equations.chapter import LENGTHS
from kin import Robot
from kin.transforms import Array

Kind = Literal["cos", "sin", "length", "slide", "number"]


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name whose value is f(weights · q + constant), with f the cosine, the sine, or nothing at all.

    Attributes:
        name: as in expressions.
        kind: what f is, and whether the value is a length (metres), a joint's travel (metres) or a pure number.
        weights: one per joint.
        constant: in radians (cos, sin) or metres; a pure number for numbers.
        meaning: the same for people, e.g. ``cos(θ2 + θ3)``.
    """

    name: str
    kind: Kind
    weights: tuple[float, ...]
    constant: float
    meaning: str

    @property
    def fixed(self) -> bool:
        """Whether the value is the same in every configuration."""
        return not any(self.weights)

    def value(self, q: Array) -> Array:
        """Its value ``(...)`` at configurations ``(..., n)``."""
        inside = np.full(q.shape[:-1], self.constant)
        for i, weight in enumerate(self.weights):
            if weight:
                inside = inside + weight * q[..., i]
        if self.kind == "cos":
            return np.asarray(np.cos(inside))
        return np.asarray(np.sin(inside)) if self.kind == "sin" else inside


@dataclass(frozen=True, slots=True)
class Turn:
    """Part of an angle: a joint value or a constant of the table; `sign` is −1 for a reversed axis."""

    label: str  # "2" for θ2, "β2" for the constant in row 2
    sign: int
    joint: int = -1
    constant: float = 0.0

    @property
    def reversed(self) -> Turn:
        return Turn(self.label, -self.sign, self.joint, self.constant)


def trig(kind: Literal["cos", "sin"], turns: tuple[Turn, ...], n: int) -> Symbol:
    """Cosine or sine of a sum of angles of an arm with n joints: c1, s23, c12-4."""
    weights = [0.0] * n
    for turn in turns:
        if turn.joint >= 0:
            weights[turn.joint] += turn.sign
    constant = math.fsum(turn.sign * turn.constant for turn in turns)
    words = ""
    for i, turn in enumerate(turns):
        letter = "" if turn.label.startswith("β") else "θ"
        words += (" − " if turn.sign < 0 else " + " if i else "") + letter + turn.label
    meaning = f"{kind}({words})" if len(turns) > 1 else f"{kind} {words}"
    return Symbol(kind[0] + index(turns), kind, tuple(weights), constant, meaning)


def index(turns: tuple[Turn, ...]) -> str:
    """The index of a sum of angles: 23, 9,10, 12-4."""
    out = turns[0].label
    plain = all(turn.sign > 0 and turn.label.isdigit() for turn in turns)
    short = all(len(turn.label) == 1 for turn in turns)
    for before, turn in pairwise(turns):
        digits = before.sign > 0 and before.label.isdigit() and turn.label.isdigit() and len(turn.label) == 1
        if turn.sign < 0:
            out += "-"
        elif not plain and not digits:
            out += "+"
        elif not short:
            out += ","
        out += turn.label
    return out


def length(name: str, value: float, n: int, meaning: str) -> Symbol:
    """A constant length in metres."""
    return Symbol(name, "length", (0.0,) * n, value, meaning)


def chapter_symbols(robot: Robot) -> dict[str, Symbol]:
    """Those of the chapter's equations about one of its arms, by name: the angles' and the table's lengths."""
    single = [(Turn(str(i + 1), 1, i),) for i in range(robot.n)]
    groups = [*single, (*single[1], *single[2])]
    symbols = [trig(kind, turns, robot.n) for turns in groups for kind in ("cos", "sin")]
    for name, (row, column) in LENGTHS[robot.id].items():
        meaning = f"{column} of row {row + 1}, {robot.rows[row].name}"
        symbols.append(length(name, getattr(robot.rows[row], column), robot.n, meaning))
    return {symbol.name: symbol for symbol in symbols}
