"""How a misprint is found: term by term next to the right equation, and without one, by RᵀR.

`compared` multiplies both forms out, so that they differ in misprints only and not in their brackets. `suspects`
says which columns of a matrix that should be a rotation cannot be right.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from app.equations.expression import Expression, Name, Number, Term, multiplied_out, multiply, negative
from kin.transforms import Array

Difference = Literal["same", "sign", "factor", "sign and factor", "spurious", "missing"]

SMALLEST = 1e-6  # of an entry of RᵀR − I that counts; rounding is a billion times smaller


@dataclass(frozen=True, slots=True)
class Compared:
    """One term of the printed equation with that of the right one, both multiplied out.

    Attributes:
        printed, correct: the terms with their signs; None where there is none.
        kind: how they differ.
        wrong, right: the factors in which they differ; empty unless `kind` names a factor.
    """

    printed: Expression | None
    correct: Expression | None
    kind: Difference
    wrong: str = ""
    right: str = ""


def compared(printed: Expression, correct: Expression) -> tuple[Compared, ...]:
    """Every term of both, in the order of the print; those that the print lacks come last."""
    ours, theirs = _terms(printed), _terms(correct)
    partner: dict[int, int] = {}
    # First the terms that agree, then those that differ least.
    for distance in range(4):
        for i, term in enumerate(ours):
            if i in partner:
                continue
            for k, other in enumerate(theirs):
                if k not in partner.values() and _distance(term, other) == distance:
                    partner[i] = k
                    break
    rows = [_pair(term, theirs[partner[i]]) if i in partner else _alone(term) for i, term in enumerate(ours)]
    missing = [theirs[k] for k in range(len(theirs)) if k not in partner.values()]
    return (*rows, *(Compared(None, _expression(term), "missing") for term in missing))


def gram(R: Array) -> Array:
    """RᵀR − I ``(..., 3, 3)``: 0 for a rotation."""
    return np.asarray(np.swapaxes(R, -1, -2) @ R - np.eye(3))


def suspects(off: Array) -> tuple[int, ...]:
    """The fewest columns that explain what is not 0 in RᵀR − I ``(3, 3)``; all candidates if that is unclear."""
    entries = [(i, k) for i in range(3) for k in range(i, 3) if abs(off[i, k]) > SMALLEST]
    for count in range(4):
        found = [
            set(columns)
            for columns in combinations(range(3), count)
            if all({i, k} & {*columns} for i, k in entries)
        ]
        if found:
            return tuple(sorted(set().union(*found)))
    raise AssertionError("three columns explain every entry")


def _terms(expression: Expression) -> list[Term]:
    return [(minus, tuple(sorted(factors, key=_order))) for minus, factors in multiplied_out(expression)]


def _order(name: str) -> tuple[int, str, str]:
    """Lengths first, then cosines and sines by joint, then abbreviations."""
    rank = 2 if name in "CS" else 1 if name[0] in "cs" else 0
    return rank, name[1:], name


def _distance(term: Term, other: Term) -> int:
    """0: equal; 1: another sign; 2: one other factor; 3: both; 9: not the same term at all."""
    (minus, factors), (less, others) = term, other
    wrong, right = _difference(factors, others)
    if len(wrong) > 1 or len(wrong) != len(right):
        return 9
    return 2 * len(wrong) + (minus != less)


def _difference(factors: tuple[str, ...], others: tuple[str, ...]) -> tuple[list[str], list[str]]:
    wrong, right = list(factors), list(others)
    for name in factors:
        if name in right:
            right.remove(name)
            wrong.remove(name)
    return wrong, right


def _pair(term: Term, other: Term) -> Compared:
    kinds: tuple[Difference, ...] = ("same", "sign", "factor", "sign and factor")
    wrong, right = _difference(term[1], other[1])
    kind = kinds[_distance(term, other)]
    return Compared(_expression(term), _expression(other), kind, "".join(wrong), "".join(right))


def _alone(term: Term) -> Compared:
    return Compared(_expression(term), None, "spurious")


def _expression(term: Term) -> Expression:
    minus, factors = term
    whole = multiply([Number(int(factor)) if factor.isdigit() else Name(factor) for factor in factors])
    return negative(whole) if minus else whole
