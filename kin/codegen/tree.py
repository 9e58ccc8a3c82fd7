"""The typed tree that kernels are turned into, and that each language is written from.

It has fewer constructs than Python: an assignment has one target, a chain of comparisons is a conjunction, a range
is a loop from one number to another, and every promotion of a number is a `Cast`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from types import FunctionType
from typing import Any

from kin.codegen.types import NONE, Type


@dataclass(frozen=True)
class Expr:
    """An expression and its type."""

    kind: Type


@dataclass(frozen=True)
class Literal(Expr):
    """A number."""

    value: Any


@dataclass(frozen=True)
class Variable(Expr):
    """A variable of the kernel."""

    name: str


@dataclass(frozen=True)
class Table(Expr):
    """An array of a module, which nothing writes to."""

    name: str


@dataclass(frozen=True)
class Items(Expr):
    """A tuple of its items."""

    items: tuple[Expr, ...]


@dataclass(frozen=True)
class Item(Expr):
    """An item of a tuple; `index` is a number, or an expression if all items have one type."""

    base: Expr
    index: int | Expr


@dataclass(frozen=True)
class Entry(Expr):
    """A number of an array."""

    array: Expr
    indices: tuple[Expr, ...]


@dataclass(frozen=True)
class View(Expr):
    """A part of an array: at some indices, then from `low` up to `high` if there are bounds."""

    array: Expr
    indices: tuple[Expr, ...]
    low: Expr | None = None
    high: Expr | None = None
    sliced: bool = False


@dataclass(frozen=True)
class Length(Expr):
    """The length of an axis of an array."""

    array: Expr
    axis: int


@dataclass(frozen=True)
class Operation(Expr):
    """An operator between two numbers of one type, or two arrays; of comparisons the result is a truth value."""

    symbol: str
    a: Expr
    b: Expr


@dataclass(frozen=True)
class Unary(Expr):
    """``-x`` or ``not x``."""

    symbol: str
    a: Expr


@dataclass(frozen=True)
class Choice(Expr):
    """``a if test else b``."""

    test: Expr
    a: Expr
    b: Expr


@dataclass(frozen=True)
class Cast(Expr):
    """A number as one of a wider type."""

    a: Expr


@dataclass(frozen=True)
class Primitive(Expr):
    """A call of a function that the languages bring along."""

    name: str
    arguments: tuple[Expr, ...]


@dataclass(frozen=True)
class Call(Expr):
    """A call of a kernel."""

    callee: Instance
    arguments: tuple[Expr, ...]


@dataclass(frozen=True)
class New(Expr):
    """An array of some shape, filled with a number unless that is None."""

    shape: tuple[Expr, ...]
    fill: Expr | None


@dataclass(frozen=True)
class Copy(Expr):
    """An array with the same numbers."""

    array: Expr


@dataclass(frozen=True)
class Reshaped(Expr):
    """The same numbers in another shape."""

    array: Expr
    shape: tuple[Expr, ...]


@dataclass(frozen=True)
class Statement:
    """A statement, with the Python that it comes from."""

    node: ast.AST = field(repr=False, compare=False)


@dataclass(frozen=True)
class Assign(Statement):
    """``name = value``."""

    name: str
    value: Expr


@dataclass(frozen=True)
class Store(Statement):
    """``array[indices] = value``, of one number."""

    place: Entry
    value: Expr


@dataclass(frozen=True)
class Fill(Statement):
    """``view[:] = value``, number by number; `value` is a number, or arithmetic of arrays of the same shape."""

    place: View
    value: Expr


@dataclass(frozen=True)
class Do(Statement):
    """A call without a result that is used."""

    value: Expr


@dataclass(frozen=True)
class Return(Statement):
    """``return value``."""

    value: Expr | None


@dataclass(frozen=True)
class If(Statement):
    """``if test: … else: …``."""

    test: Expr
    body: tuple[Statement, ...]
    other: tuple[Statement, ...]


@dataclass(frozen=True)
class While(Statement):
    """``while test: …``."""

    test: Expr
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class For(Statement):
    """``for name in range(start, end, step): …``."""

    name: str
    start: Expr
    end: Expr
    step: int
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Leave(Statement):
    """``break`` or ``continue``."""

    word: str


@dataclass(eq=False, repr=False)
class Instance:
    """A kernel with the types of its arguments.

    Attributes:
        written: the arrays it writes to: the parameter, then the indices of items of tuples.
        apart: whether its arrays must not share memory, since it computes with whole arrays.
    """

    function: FunctionType
    kinds: tuple[Type, ...]
    name: str = ""
    parameters: tuple[str, ...] = ()
    variables: dict[str, Type] = field(default_factory=dict)
    result: Type = NONE
    body: tuple[Statement, ...] = ()
    note: str = ""
    written: frozenset[tuple[Any, ...]] = frozenset()
    apart: bool = False

    @cached_property
    def nodes(self) -> list[Any]:
        """All expressions and statements of the body, which is complete, in its order."""
        return list(walk(self.body))


def parts(node: Any) -> Iterator[Any]:
    """What an expression or a statement is made of, not what is inside of that."""
    for name in node.__dataclass_fields__:  # those of `fields`, which takes long
        value = getattr(node, name)
        yield from value if isinstance(value, tuple) else (value,)


def walk(node: Any) -> Iterator[Any]:
    """All expressions and statements in one, or in several, each before what is in it."""
    waiting = list(reversed(node)) if isinstance(node, tuple) else [node]
    while waiting:
        each = waiting.pop()
        if isinstance(each, _NODES):
            yield each
            waiting.extend(reversed([part for part in parts(each) if isinstance(part, _NODES)]))


_NODES = (Expr, Statement)
