"""The right-hand side of an equation as a tree, from which its value and its typeset forms are made.

The shown and the computed form are always the same: `value`, `latex` and `mathml` (:mod:`app.equations.typeset`)
walk the same tree. The chapter's equations get theirs from the text of :mod:`app.equations.chapter`, in
the order of the print; derived ones get theirs from sympy, in an order that people would write.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from kin.transforms import Array


@dataclass(frozen=True, slots=True)
class Name:
    """A symbol: c1, s23, d6, n_x. A `Symbol` or a `Line` of the same name defines it."""

    id: str


@dataclass(frozen=True, slots=True)
class Number:
    """A whole number, 0 or larger."""

    value: int


@dataclass(frozen=True, slots=True)
class Negative:
    """−of."""

    of: Expression


@dataclass(frozen=True, slots=True)
class Product:
    """Two or more factors, none of them a product; the first is not negative, its sign is the product's."""

    factors: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Sum:
    """Two or more terms, none of them a sum."""

    terms: tuple[Expression, ...]


Expression = Name | Number | Negative | Product | Sum


def value(expression: Expression, values: Mapping[str, Array]) -> Array:
    """The value for given values of the names, broadcast together."""
    match expression:
        case Name(id=name):
            return values[name]
        case Number(value=number):
            return np.asarray(float(number))
        case Negative(of=inner):
            return -value(inner, values)
        case Product(factors=factors):
            out = value(factors[0], values)
            for factor in factors[1:]:
                out = out * value(factor, values)
            return out
        case Sum(terms=terms):
            out = value(terms[0], values)
            for term in terms[1:]:
                out = out + value(term, values)
            return out


def names(expression: Expression) -> list[str]:
    """Every name in it, in order of appearance, each once."""
    match expression:
        case Name(id=name):
            return [name]
        case Negative(of=inner):
            return names(inner)
        case Product(factors=parts) | Sum(terms=parts):
            return list(dict.fromkeys(name for part in parts for name in names(part)))
    return []


def size(expression: Expression) -> int:
    """Number of names and numbers in it, a measure of its length."""
    match expression:
        case Negative(of=inner):
            return size(inner)
        case Product(factors=parts) | Sum(terms=parts):
            return sum(size(part) for part in parts)
    return 1


def terms(expression: Expression) -> tuple[Expression, ...]:
    """The outer terms of a sum; otherwise the expression itself."""
    return expression.terms if isinstance(expression, Sum) else (expression,)


def negative(expression: Expression) -> Expression:
    """−expression, without two minus signs in a row."""
    return expression.of if isinstance(expression, Negative) else Negative(expression)


def multiply(factors: list[Expression]) -> Expression:
    """Their product, nested products written as one, the sign of the first in front of all."""
    minus = isinstance(factors[0], Negative)
    flat: list[Expression] = []
    for i, factor in enumerate(factors):
        if i == 0 and isinstance(factor, Negative):
            factor = factor.of
        flat += factor.factors if isinstance(factor, Product) else [factor]
    out = flat[0] if len(flat) == 1 else Product(tuple(flat))
    return Negative(out) if minus else out


def add(parts: list[Expression]) -> Expression:
    """Their sum, nested sums written as one."""
    flat = [term for part in parts for term in terms(part)]
    return flat[0] if len(flat) == 1 else Sum(tuple(flat))


def from_text(text: str) -> Expression:
    """An expression of names, ``+``, ``-``, ``*`` and parentheses, in the order of the text.

    Raises:
        ValueError: the text contains anything else. It is never executed, only walked.
    """
    try:
        return _from_ast(ast.parse(text, mode="eval").body)
    except SyntaxError as error:
        raise ValueError(f"not an expression of the chapter's notation: {text!r} ({error.msg})") from None


def _from_ast(node: ast.expr) -> Expression:
    match node:
        case ast.Name(id=name):
            return Name(name)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return negative(_from_ast(inner))
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return multiply([_from_ast(left), _from_ast(right)])
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return add([_from_ast(left), _from_ast(right)])
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return add([_from_ast(left), *map(negative, terms(_from_ast(right)))])
    raise ValueError(f"not in the chapter's notation: {ast.dump(node)}")


def astray(expression: Expression, other: Expression) -> tuple[bool, ...]:
    """For each of the `terms`, whether it does not belong to `other`, both multiplied out.

    Of a misprinted equation and the right one these are the misprints, however differently the two are bracketed;
    the other way round, what is missing.
    """
    known = expanded(other)
    return tuple(bool(expanded(term) - known) for term in terms(expression))


def expanded(expression: Expression) -> Counter[Term]:
    """Multiplied out: its terms with sorted names, and how often each occurs."""
    return Counter((minus, tuple(sorted(factors))) for minus, factors in multiplied_out(expression))


Term = tuple[bool, tuple[str, ...]]  # whether it is negative, and its names and numbers


def multiplied_out(expression: Expression) -> list[Term]:
    """Its terms without brackets, in order of appearance."""
    match expression:
        case Name(id=name):
            return [(False, (name,))]
        case Number(value=number):
            return [(False, (str(number),))]
        case Negative(of=inner):
            return [(not minus, factors) for minus, factors in multiplied_out(inner)]
        case Sum(terms=parts):
            return [term for part in parts for term in multiplied_out(part)]
        case Product(factors=parts):
            return [
                (sum(minus for minus, _ in choice) % 2 == 1, tuple(name for _, names in choice for name in names))
                for choice in product(*map(multiplied_out, parts))
            ]


def written_out(expression: Expression, meanings: Mapping[str, Expression]) -> Expression:
    """The expression with these names replaced by what they stand for."""
    match expression:
        case Name(id=name):
            return meanings.get(name, expression)
        case Number():
            return expression
        case Negative(of=inner):
            return negative(written_out(inner, meanings))
        case Product(factors=factors):
            return multiply([written_out(factor, meanings) for factor in factors])
        case Sum(terms=parts):
            return add([written_out(part, meanings) for part in parts])
