"""What the subset leaves out, and why: sentences for constructs, and checks of what typing alone does not see.

Python evaluates from left to right. C does not, inside an expression, and an array that is kept for one round of a
loop is the same memory in the next one. What depends on either is refused, not reordered.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import reduce
from typing import Any

from kin.codegen.source import OutsideSubsetError
from kin.codegen.tree import (
    Assign,
    Call,
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
    Length,
    New,
    Operation,
    Primitive,
    Reshaped,
    Return,
    Statement,
    Store,
    Variable,
    View,
    While,
    parts,
    walk,
)  # fmt: skip
from kin.codegen.types import ArrayOf, TupleOf, Type, holds_arrays

# Of an array, which arguments or variables its memory may be that of: names, with the indices of items of tuples.
# Of a tuple those of its items.
Memory = Any

_STATEMENTS: dict[type[ast.stmt], tuple[str, str]] = {
    ast.For: ("the else of a loop", "set a variable and test it behind the loop"),
    ast.While: ("the else of a loop", "set a variable and test it behind the loop"),
    ast.Assert: ("assert", "return a code"),
    ast.Raise: ("raise", "return a code"),
    ast.Try: ("try", "test before"),
    ast.With: ("with", "write what it does"),
    ast.Delete: ("del", "leave the variable"),
    ast.FunctionDef: ("a function inside a kernel", "define it in the module"),
    ast.Global: ("global", "pass it as an argument"),
    ast.Match: ("match", "write if and elif"),
    ast.Import: ("an import inside a kernel", "import it in the module"),
    ast.ImportFrom: ("an import inside a kernel", "import it in the module"),
}
_EXPRESSIONS: dict[type[ast.expr], tuple[str, str]] = {
    ast.UnaryOp: ("~ or unary +", "write −x − 1, or x"),
    ast.List: ("a list", "use a tuple, or an array"),
    ast.ListComp: ("a comprehension", "write a loop"),
    ast.GeneratorExp: ("a comprehension", "write a loop"),
    ast.Dict: ("a dict", "use a named tuple"),
    ast.Set: ("a set", "use an array of bool"),
    ast.NamedExpr: (":= in an expression", "assign before"),
    ast.Lambda: ("a lambda", "define a kernel in the module"),
    ast.Starred: ("a starred value", "name each item"),
    ast.JoinedStr: ("text", "use numbers"),
}


def statement(node: ast.stmt) -> tuple[str, str]:
    """What a statement outside the subset is, and what to write instead."""
    return _STATEMENTS.get(type(node), ("a statement outside the subset", "use assignments, if, for, while"))


def expression(node: ast.expr) -> tuple[str, str]:
    """What an expression outside the subset is, and what to write instead."""
    return _EXPRESSIONS.get(type(node), ("an expression outside the subset", "use numbers, tuples and arrays"))


def check(made: Instance) -> None:
    """Note which parameters a kernel writes to, and refuse what depends on an order or on a round of a loop."""
    roots = _roots(made)
    written: set[tuple[Any, ...]] = set()
    for node in made.nodes:
        if isinstance(node, Store | Fill):
            written |= _origins(node.place, roots)
        elif isinstance(node, Call):
            arguments = dict(zip(node.callee.parameters, node.arguments, strict=True))
            for name, *items in node.callee.written:
                written |= _flat(reduce(lambda memory, k: memory[k], items, _memory(arguments[name], roots)))
    made.written = frozenset(path for path in written if path[0] in made.parameters)
    _check_whole(made, roots)
    for each in made.nodes:
        if isinstance(each, Statement):
            _check_order(made, each)
        if isinstance(each, For | While):
            _check_rounds(made, each)


def _roots(made: Instance) -> dict[str, Memory]:
    """The memory that each variable may show."""
    roots = {name: _named(kind, (name,)) for name, kind in made.variables.items()}
    for _ in range(3):  # views of views
        for node in made.nodes:
            if isinstance(node, Assign) and holds_arrays(made.variables[node.name]):
                roots[node.name] = _either(roots[node.name], _memory(node.value, roots))
    return roots


def _named(kind: Type, path: tuple[Any, ...]) -> Memory:
    if isinstance(kind, TupleOf):
        return tuple(_named(each, (*path, k)) for k, each in enumerate(kind.items))
    return {path} if isinstance(kind, ArrayOf) else set()


def _spread(kind: Type, origins: set[tuple[Any, ...]]) -> Memory:
    """Of a value that may show any of these."""
    if isinstance(kind, TupleOf):
        return tuple(_spread(each, origins) for each in kind.items)
    return origins if isinstance(kind, ArrayOf) else set()


def _either(a: Memory, b: Memory) -> Memory:
    return tuple(map(_either, a, b)) if isinstance(a, tuple) else a | b


def _flat(memory: Memory) -> set[tuple[Any, ...]]:
    return set().union(*map(_flat, memory)) if isinstance(memory, tuple) else memory


def _memory(value: Expr, roots: dict[str, Memory]) -> Memory:
    match value:
        case Variable(name=name):
            return roots[name]
        case Items(items=items):
            return tuple(_memory(item, roots) for item in items)
        case Item(base=base, index=index):
            items = _memory(base, roots)
            return items[index] if isinstance(index, int) else reduce(_either, items)
        case New() | Copy() | Length():
            return set()
    inner = [_flat(_memory(part, roots)) for part in parts(value) if isinstance(part, Expr)]
    return _spread(value.kind, set().union(*inner))


def _origins(value: Expr, roots: dict[str, Memory]) -> set[tuple[Any, ...]]:
    """Which arguments or variables the memory is of that a value shows, or a place that is stored to."""
    return _flat(_memory(value.array if isinstance(value, Entry) else value, roots))


def _check_whole(made: Instance, roots: dict[str, Memory]) -> None:
    """Refuse arithmetic of whole arrays that share memory with what it is stored in.

    Python computes all of ``a, b = x + y, x − y`` before it stores anything.
    """
    fills = [node for node in made.nodes if isinstance(node, Fill) and isinstance(node.value.kind, ArrayOf)]
    made.apart = bool(fills)
    stored = {id(each) for node in fills for each in _summands(node.value)}
    for node in made.nodes:
        if isinstance(node, Operation) and isinstance(node.kind, ArrayOf) and id(node) not in stored:
            what = "arithmetic of arrays that is not stored"
            raise OutsideSubsetError(made.function, made.function, what, "write a loop over the entries")
    for a in fills:
        for b in fills:
            if a.node is b.node and _origins(a.place, roots) & _origins(b.value, roots):
                what = "arithmetic of arrays stored in one of them"
                raise OutsideSubsetError(made.function, a.node, what, "write a loop over the entries")
    for node in made.nodes:
        if isinstance(node, Call) and node.callee.apart:
            made.apart = True
            origins = [_origins(each, roots) for each in node.arguments]
            if sum(map(len, origins)) != len(set().union(*origins)):
                what = "one array passed twice to a kernel that computes with whole arrays"
                raise OutsideSubsetError(made.function, made.function, what, "copy it before")


def _summands(value: Expr) -> Iterator[Expr]:
    """Arithmetic of arrays that is computed number by number."""
    yield value
    if isinstance(value, Operation):
        yield from (*_summands(value.a), *_summands(value.b))


def _expressions(statement: Statement) -> tuple[Expr, ...]:
    """The expressions of a statement that are evaluated together."""
    match statement:
        case Assign(value=value) | Do(value=value):
            return (value,)
        case Store(place=place, value=value):
            return (*place.indices, value)
        case Fill(place=place, value=value):
            return (place, value)
        case Return(value=value):
            return () if value is None else (value,)
        case If(test=test) | While(test=test):
            return (test,)
        case For(start=start, end=end):
            return start, end
    return ()


def _writes(node: object) -> bool:
    return isinstance(node, Call) and bool(node.callee.written)


def _touches(node: object) -> bool:
    """Whether a node reads or writes memory."""
    if isinstance(node, Call):
        return any(holds_arrays(kind) for kind in node.callee.kinds)
    return isinstance(node, Entry | Copy) or (isinstance(node, Primitive) and node.name == "all_finite")


def _check_order(made: Instance, statement: Statement) -> None:
    """Refuse a call that writes beside another one, or beside a read, in one expression."""

    def visit(together: Iterable[Expr]) -> None:
        groups = [list(walk(each)) for each in together]
        for k, group in enumerate(groups):
            others = [node for j, other in enumerate(groups) if j != k for node in other]
            if any(map(_writes, group)) and any(map(_touches, others)):
                what = "a call that writes to an array beside another one, or beside a read"
                raise OutsideSubsetError(made.function, statement.node, what, "give the first one a name before")
        for each in together:
            inside = [part for part in parts(each) if isinstance(part, Expr)]
            ordered = isinstance(each, Choice) or (isinstance(each, Operation) and each.symbol in ("and", "or"))
            for group in [[part] for part in inside] if ordered else [inside]:
                visit(group)

    visit(_expressions(statement))


def _shown(value: Expr) -> Iterator[str]:
    """The variables whose memory a value goes on to show."""
    match value:
        case Variable(kind=kind, name=name) if holds_arrays(kind):
            yield name
        case View(array=inner) | Reshaped(array=inner) | Item(base=inner):
            yield from _shown(inner)
        case Choice(a=a, b=b):
            yield from (*_shown(a), *_shown(b))
        case Items(items=items):
            for item in items:
                yield from _shown(item)


def _makes(node: object) -> bool:
    """Whether a node makes an array, or calls what makes one and returns it."""
    if isinstance(node, Call):
        return holds_arrays(node.kind) and any(map(_makes, walk(node.callee.body)))
    return isinstance(node, New | Copy)


def _check_rounds(made: Instance, loop: For | While) -> None:
    """Refuse an array of one round of a loop under a second name, which might still be read in the next round.

    Also one of the last round that is an argument of the call that makes it anew.
    """
    inside = [node for node in walk(loop.body) if isinstance(node, Assign) and holds_arrays(node.value.kind)]
    names = [node.name for node in inside]
    fresh: dict[str, set[int]] = {}  # arrays that are made in the loop → where
    for place, node in enumerate(inside):
        if any(map(_makes, walk(node.value))):
            fresh.setdefault(node.name, set()).add(place)
    for node in inside:
        shown = [name for name in _shown(node.value) if name in fresh]
        if shown and isinstance(node.value, Item) and names.count(node.name) == 1:
            fresh[node.name] = fresh[shown[0]]
        elif shown and not isinstance(node.value, View | Reshaped):
            what = "an array that is made in a loop, under a second name"
            raise OutsideSubsetError(
                made.function, node.node, what, "make it before the loop, or copy its entries"
            )
    for place, node in enumerate(inside):
        passed = [name for e in walk(node.value) if isinstance(e, Call) for a in e.arguments for name in _shown(a)]
        if any(place in fresh.get(name, ()) for name in passed):
            what = "an array that a call makes in a loop, passed to it in the next round"
            raise OutsideSubsetError(made.function, node.node, what, "copy its entries into another one")
        if (
            isinstance(node.value, View | Reshaped)
            and any(name in fresh for name in _shown(node.value))
            and names.count(node.name) > 1
        ):
            what = "a view that is assigned more than once in a loop, of an array made in it"
            raise OutsideSubsetError(made.function, node.node, what, "use two variables")
