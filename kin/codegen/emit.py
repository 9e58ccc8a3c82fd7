"""What C and JavaScript share: statements, operators, and when a variable is declared.

Both have the same statements and the same operators with the same precedence, and doubles that are added and
multiplied in the same order give the same bits. How tuples, arrays and complex numbers are written is each
language's own: the methods that raise `NotImplementedError` here.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable

from kin.codegen.tree import (
    Assign,
    Call,
    Cast,
    Choice,
    Copy,
    Do,
    Entry,
    Expr,
    Fill,
    For,
    If,
    Instance,
    Item,
    Items,
    Leave,
    Length,
    Literal,
    New,
    Operation,
    Primitive,
    Reshaped,
    Return,
    Statement,
    Store,
    Unary,
    Variable,
    View,
    While,
    walk,
)  # fmt: skip
from kin.codegen.types import COMPLEX, FLOAT, INT, ArrayOf, Kernel, TupleOf, Type

CHOICE, OR, AND, EQUAL, ORDER, ADD, MULTIPLY, UNARY, ATOM = range(9)
_RANKS = {
    "or": OR, "and": AND, "==": EQUAL, "!=": EQUAL, "<": ORDER, "<=": ORDER, ">": ORDER, ">=": ORDER,
    "+": ADD, "-": ADD, "*": MULTIPLY, "/": MULTIPLY,
}  # fmt: skip
_COMPLEX = {"+": "cadd", "-": "csub", "*": "cmul", "/": "cdiv", "==": "cequal", "!=": "!cequal"}
Text = tuple[str, int]


class Emitter:
    """The text of one kernel.

    Args:
        taken: names that no variable may have.
    """

    equal, different = "==", "!="
    lines: list[str]

    def __init__(self, made: Instance, taken: frozenset[str]) -> None:
        self.made, self.taken = made, taken
        self.lines, self.depth, self.counter = [], 1, itertools.count(1)
        self.read = _read(made)
        self.own = _own_counters(made)

    # ---- what a language writes its own way ----

    def declared(self, kind: Type, name: str, value: str) -> str:
        raise NotImplementedError

    def literal(self, kind: Type, value: float | complex) -> Text:
        raise NotImplementedError

    def items(self, kind: TupleOf, items: Iterable[str]) -> str:
        raise NotImplementedError

    def item(self, base: str, kind: TupleOf, index: int | str) -> str:
        raise NotImplementedError

    def entry(self, array: Expr, kind: ArrayOf, place: str) -> str:
        raise NotImplementedError

    def view(self, value: View) -> str:
        raise NotImplementedError

    def length(self, array: Expr, axis: int) -> str:
        raise NotImplementedError

    def new(self, value: New) -> str:
        raise NotImplementedError

    def copied(self, value: Copy) -> str:
        raise NotImplementedError

    def reshaped(self, value: Reshaped) -> str:
        raise NotImplementedError

    def operator(self, value: Operation) -> Text:
        """An operator that the languages write differently."""
        raise NotImplementedError

    def primitive(self, value: Primitive, arguments: list[str]) -> str:
        raise NotImplementedError

    def cast(self, value: Cast) -> Text:
        raise NotImplementedError

    def called(self, value: Call, arguments: list[str]) -> str:
        raise NotImplementedError

    def stored(self, place: Entry, value: Expr) -> str:
        raise NotImplementedError

    def filled(self, node: Fill) -> list[str]:
        raise NotImplementedError

    def returned(self, value: Expr | None) -> list[str]:
        raise NotImplementedError

    # ---- statements ----

    def name(self, name: str) -> str:
        """A variable's name; one that is all capitals might be a macro of the user's."""
        return name + "_" if name in self.taken or name.isupper() else name

    def fresh(self, stem: str) -> str:
        return next(n for k in self.counter if (n := f"{stem}{k}") not in self.made.variables)

    def line(self, text: str) -> None:
        self.lines.append("  " * self.depth + text)

    def block(self, body: Iterable[Statement]) -> None:
        self.depth += 1
        for statement in body:
            self.statement(statement)
        self.depth -= 1

    def statement(self, node: Statement) -> None:
        match node:
            case Assign(name=name, value=value) if name in self.read:
                self.line(f"{self.name(name)} = {self.text(value)};")
            case Assign(value=value) | Do(value=value):
                if any(isinstance(each, Call) for each in walk(value)):
                    self.line(f"{self.text(value)};")
            case Store(place=place, value=value):
                self.line(self.stored(place, value))
            case Fill():
                for line in self.filled(node):
                    self.line(line)
            case Return(value=value):
                for line in self.returned(value):
                    self.line(line)
            case If():
                self.choice(node, "if")
            case While(test=test, body=body):
                self.line(f"while ({self.text(test)}) {{")
                self.block(body)
                self.line("}")
            case For():
                self.loop(node)
            case Leave(word=word):
                self.line(word + ";")

    def choice(self, node: If, word: str) -> None:
        self.line(f"{word} ({self.text(node.test)}) {{")
        self.block(node.body)
        if len(node.other) == 1 and isinstance(node.other[0], If):
            self.choice(node.other[0], "} else if")
            return
        if node.other:
            self.line("} else {")
            self.block(node.other)
        self.line("}")

    def loop(self, node: For) -> None:
        """A range is computed once, and its variable ends at the last value, whatever the body does to it."""
        own = node.name in self.own
        at = self.name(node.name) if own else self.fresh("at")
        start, end = self.text(node.start), self.text(node.end)
        head = self.declared(INT, at, start)
        if not isinstance(node.end, Literal):
            last = self.fresh("end")
            head, end = f"{head}, {last} = {end}", last
        step = f"{at}++" if node.step == 1 else f"{at}--" if node.step == -1 else f"{at} += {node.step}"
        self.line(f"for ({head}; {at} {'<' if node.step > 0 else '>'} {end}; {step}) {{")
        if not own and node.name in self.read:
            self.depth += 1
            self.line(f"{self.name(node.name)} = {at};")
            self.depth -= 1
        self.block(node.body)
        self.line("}")

    # ---- expressions ----

    def text(self, value: Expr, rank: int = CHOICE) -> str:
        """An expression, in brackets if an operator of this rank binds more."""
        text, own = self.expr(value)
        return f"({text})" if own < rank else text

    def expr(self, value: Expr) -> Text:
        match value:
            case Literal(kind=kind, value=number):
                return self.literal(kind, number)
            case Variable(name=name):
                return self.name(name), ATOM
            case Operation():
                return self.operation(value)
            case Unary(kind=kind, symbol=symbol, a=a):
                return self.unary(kind, symbol, a)
            case Choice(test=test, a=a, b=b):
                return f"{self.text(test, OR)} ? {self.text(a, OR)} : {self.text(b, OR)}", CHOICE
            case Cast():
                return self.cast(value)
            case Items(kind=TupleOf() as kind, items=items):
                return self.items(kind, [self.text(item) for item in items]), ATOM
            case Item(base=base, index=index):
                assert isinstance(base.kind, TupleOf)
                place = self.text(index) if isinstance(index, Expr) else index
                return self.item(self.text(base, ATOM), base.kind, place), ATOM
            case Entry(array=array, indices=indices):
                assert isinstance(array.kind, ArrayOf)
                return self.entry(array, array.kind, self.offset(array, indices)), ATOM
            case Primitive(arguments=arguments):
                return self.primitive(value, [self.text(each) for each in arguments]), ATOM
            case Call(arguments=arguments):
                passed = [self.text(each) for each in arguments if not isinstance(each.kind, Kernel)]
                return self.called(value, passed), ATOM
        return self.memory(value), ATOM

    def memory(self, value: Expr) -> str:
        """An expression that shows memory."""
        match value:
            case View():
                return self.view(value)
            case Length(array=array, axis=axis):
                return self.length(array, axis)
            case New():
                return self.new(value)
            case Copy():
                return self.copied(value)
            case Reshaped():
                return self.reshaped(value)
        raise TypeError(value)

    def operation(self, value: Operation) -> Text:
        symbol, kind = value.symbol, value.a.kind
        if kind == COMPLEX:
            return f"{_COMPLEX[symbol]}({self.text(value.a)}, {self.text(value.b)})", UNARY
        if symbol not in _RANKS or (symbol == "*" and kind == INT):
            return self.operator(value)
        rank = _RANKS[symbol]
        word = {"or": "||", "and": "&&", "==": self.equal, "!=": self.different}.get(symbol, symbol)
        # `or` beside `and`, and `==` of comparisons, get brackets too, as compilers ask for.
        inner = AND + 1 if rank == OR and isinstance(value.a, Operation) and value.a.symbol == "and" else rank
        right = self.text(value.b, ADD if rank == EQUAL else max(rank, AND) + 1)
        right = f"({right})" if right.startswith("-") else right
        return f"{self.text(value.a, ADD if rank == EQUAL else inner)} {word} {right}", rank

    def unary(self, kind: Type, symbol: str, a: Expr) -> Text:
        text = self.text(a, ATOM)
        if symbol == "not":
            return f"!{text}", UNARY
        if kind == COMPLEX:
            return f"cneg({text})", ATOM
        return (f"-{text}", UNARY) if kind == FLOAT else (f"0 - {text}", ADD)

    def offset(self, array: Expr, indices: tuple[Expr, ...]) -> str:
        """The place of an entry, or of the first entry of a view."""
        assert isinstance(array.kind, ArrayOf)
        terms = []
        for axis, index in enumerate(indices):
            strides = [self.length(array, k) for k in range(axis + 1, array.kind.ndim)]
            if isinstance(index, Literal) and index.value == 0:
                continue
            if isinstance(index, Literal) and index.value == 1 and strides:
                terms.append(" * ".join(strides))
            else:
                terms.append(" * ".join([self.text(index, MULTIPLY if strides else ADD), *strides]))
        return " + ".join(terms)

    def number_at(self, value: Expr, k: str) -> Text:
        """The k-th number of an expression of arrays."""
        if not isinstance(value.kind, ArrayOf):
            return self.expr(value)
        if isinstance(value, Operation):
            rank = _RANKS[value.symbol]
            sides = [self.number_at(each, k) for each in (value.a, value.b)]
            a, b = (f"({t})" if own < rank + (i > 0) else t for i, (t, own) in enumerate(sides))
            return f"{a} {value.symbol} {b}", rank
        return self.entry(value, value.kind, k), ATOM


def _read(made: Instance) -> set[str]:
    """The variables that something depends on."""
    read: set[str] = set()
    statements = [node for node in made.nodes if isinstance(node, Statement)]
    while True:
        before = len(read)
        for node in statements:
            if not (isinstance(node, Assign) and _is_idle(node, read)):
                inner = [part for part in vars(node).values() if isinstance(part, Expr)]
                read |= {e.name for each in inner for e in walk(each) if isinstance(e, Variable)}
        if len(read) == before:
            return read


def _is_idle(node: Assign, read: set[str]) -> bool:
    return node.name not in read and not any(isinstance(each, Call) for each in walk(node.value))


def _own_counters(made: Instance) -> set[str]:
    """The variables that only count in loops: nothing else assigns or reads them."""
    loops = [node for node in made.nodes if isinstance(node, For)]
    assigned = {node.name for node in made.nodes if isinstance(node, Assign)} | set(made.parameters)
    found = {loop.name for loop in loops} - assigned
    for name in sorted(found):
        everywhere = [n for n in made.nodes if isinstance(n, Variable) and n.name == name]
        inside = [n for loop in loops if loop.name == name for n in walk(loop.body) if isinstance(n, Variable)]
        nested = any(
            isinstance(n, For) and n.name == name for loop in loops if loop.name == name for n in walk(loop.body)
        )
        if nested or len(everywhere) != sum(n.name == name for n in inside):
            found.discard(name)
    return found
