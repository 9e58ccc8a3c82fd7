"""From the source of kernels to typed trees.

A kernel is typed once for each combination of argument types that it is called with. A function
passed as an argument is part of the type, so that every closure is resolved here. Types of variables are found by
passes over the body until none changes.
"""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from kin.codegen import source, subset
from kin.codegen.calls import Calls, length_of
from kin.codegen.source import MISSING, OutsideSubsetError, plain, tree_of
from kin.codegen.tree import (
    Assign,
    Call,
    Cast,
    Choice,
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
    Literal,
    Operation,
    Primitive,
    Return,
    Statement,
    Store,
    Table,
    Unary,
    Variable,
    View,
    While,
    walk,
)  # fmt: skip
from kin.codegen.types import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    NONE,
    SINGLE,
    WORD,
    ArrayOf,
    Constants,
    Kernel,
    Scalar,
    TupleOf,
    Type,
    joined,
    widest,
)  # fmt: skip

PASSES = 12
_SYMBOLS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^",
    ast.LShift: "<<", ast.RShift: ">>", ast.FloorDiv: "//", ast.Mod: "%", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">",
    ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


class Program:
    """All kernels that some entries need, callees first."""

    def __init__(self) -> None:
        self.instances: list[Instance] = []
        self.tables: dict[str, np.ndarray[Any, Any]] = {}
        self._known: dict[tuple[FunctionType, tuple[Type, ...]], Instance | None] = {}

    def add(self, kernel: Any, *kinds: Type) -> Instance:
        """The kernel for these types of arguments, and all that it calls."""
        function = plain(kernel)
        key = function, kinds
        if key not in self._known:
            self._known[key] = None
            made = _Builder(self, function, kinds).run()
            made.name = self._name(function)
            subset.check(made)
            self.instances.append(made)
            self._known[key] = made
        found = self._known[key]
        if found is None:
            raise OutsideSubsetError(function, tree_of(function), "a kernel that calls itself", "write a loop")
        return found

    def _name(self, function: FunctionType) -> str:
        """``parallel6_branches_put``: unique, and readable."""
        skipped = ("kin", "solvers", "kernels", "codegen")
        words = [word.strip("_") for word in function.__module__.split(".") if word not in skipped]
        return _unused("_".join([*words, function.__name__.strip("_")]), {each.name for each in self.instances})

    def table(self, name: str, value: np.ndarray[Any, Any]) -> str:
        """The name of an array of a module."""
        known = next((each for each, other in self.tables.items() if other is value), None)
        if known is None:
            known = _unused("TABLE_" + name.strip("_").upper(), set(self.tables))
            self.tables[known] = value
        return known


def _unused(name: str, taken: set[str]) -> str:
    return next(each for k in range(1, 999) if (each := name if k == 1 else f"{name}_{k}") not in taken)


class _UnknownError(Exception):
    """A variable of which the type is not known in this pass."""


class _Builder(Calls):
    """The typed tree of one kernel."""

    def __init__(self, program: Program, function: FunctionType, kinds: tuple[Type, ...]) -> None:
        arguments = tree_of(function).args
        names = tuple(each.arg for each in arguments.args)
        kernels = {n: k.value for n, k in zip(names, kinds, strict=False) if isinstance(k, Kernel)}
        super().__init__(function, kernels)
        plain_arguments = not (arguments.defaults or arguments.kwonlyargs or arguments.vararg or arguments.kwarg)
        if len(names) != len(kinds) or not plain_arguments:
            raise self.refuse(self.tree, "a call with other arguments than the kernel's", "pass each by position")
        self.program = program
        note = (ast.get_docstring(self.tree) or "").split("\n")[0]
        variables = dict(zip(names, kinds, strict=True))
        self.made = Instance(function, kinds, parameters=names, variables=variables, note=note)
        self.variables, self.returned = variables, False

    def run(self) -> Instance:
        for _ in range(PASSES):
            before = dict(self.variables), self.made.result
            self.unknown: ast.stmt | None = None
            self.count = 0
            body = tuple(self.block(self.tree.body))
            if before == (self.variables, self.made.result):
                if self.unknown is not None:
                    raise self.refuse(self.unknown, "a variable without a value", "assign it before")
                self.made.body = body
                return self.made
        raise self.refuse(self.tree, "types that do not settle", "give each variable one type")

    def callee(self, function: FunctionType, kinds: tuple[Type, ...]) -> Instance:
        """The kernel that is called with these types."""
        return self.program.add(function, *kinds)

    # ---- statements ----

    def block(self, body: list[ast.stmt]) -> list[Statement]:
        found: list[Statement] = []
        for statement in body:
            try:
                found += self.statement(statement)
            except _UnknownError:
                self.unknown = statement
        return found

    def statement(self, node: ast.stmt) -> list[Statement]:
        match node:
            case ast.Assign(targets=[ast.Name() as target], value=ast.BinOp(left=ast.Call()) as sum_):
                return self.in_order(node, target, sum_)
            case ast.Assign(targets=[target]):
                return self.assign(node, target, self.expr(node.value))
            case ast.Assign():
                value = self.expr(node.value)
                first = [] if isinstance(value, Literal) else self.assign(node, self.fresh(), value)
                held = value if isinstance(value, Literal) else Variable(value.kind, _name_of(first[0]))
                return [*first, *(each for t in node.targets for each in self.assign(node, t, held))]
            case ast.AnnAssign(target=target, value=ast.expr() as value_node):
                return self.assign(node, target, self.expr(value_node))
            case ast.AugAssign():
                return self.augmented(node)
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return []
            case ast.Expr():
                return [Do(node, self.expr(node.value))]
            case ast.Return():
                return [self.leave(node)]
            case ast.If():
                body, other = tuple(self.block(node.body)), tuple(self.block(node.orelse))
                return [If(node, self.truth(node.test), body, other)]
            case ast.While(orelse=[]):
                body = tuple(self.block(node.body))
                return [While(node, self.truth(node.test), body)]
            case ast.For(orelse=[]):
                return self.loop(node)
            case ast.Break() | ast.Continue():
                return [Leave(node, type(node).__name__.lower())]
        raise self.refuse(node, *subset.statement(node))

    def in_order(self, node: ast.stmt, target: ast.Name, sum_: ast.BinOp) -> list[Statement]:
        """``x = f(…) + g(…)``: by way of a new variable where both calls write to arrays."""
        a, b, first = self.expr(sum_.left), self.expr(sum_.right), list[Statement]()
        if isinstance(a, Call) and a.callee.written and any(isinstance(e, Call) for e in walk(b)):
            first = self.assign(node, self.fresh(), a)
            a = Variable(a.kind, _name_of(first[0]))
        return [*first, *self.assign(node, target, self.operation(sum_, type(sum_.op), a, b))]

    def fresh(self) -> ast.Name:
        """A variable that the source does not have."""
        while True:
            self.count += 1
            if (name := f"u{self.count}") not in self.own:
                return ast.Name(name, ast.Store())

    def leave(self, node: ast.Return) -> Return:
        value = None if node.value is None else self.expr(node.value)
        kind = NONE if value is None else value.kind
        both = joined(self.made.result, kind) if self.returned else kind
        if both is None:
            raise self.refuse(node, f"results of two types, {self.made.result} and {kind}", "return one type")
        self.returned, self.made.result = True, both
        return Return(node, None if value is None or both == NONE else self.cast(value, both, node))

    def augmented(self, node: ast.AugAssign) -> list[Statement]:
        read = _read(node.target)
        value = self.operation(node, type(node.op), self.expr(read), self.expr(node.value))
        if isinstance(value.kind, ArrayOf):
            raise self.refuse(node, "an array that is changed as a whole", "write a loop over its entries")
        if any(isinstance(n, ast.Call) for n in ast.walk(node.target)):
            raise self.refuse(node, "a call in the index of what is changed", "compute the index before")
        return self.assign(node, node.target, value)

    def loop(self, node: ast.For) -> list[Statement]:
        if isinstance(node.iter, ast.Call) and self.constant(node.iter.func) is range:
            if not isinstance(node.target, ast.Name) or node.iter.keywords:
                raise self.refuse(node, "a range with several variables", "name one")
            bounds = [self.whole(each) for each in node.iter.args]
            step = self.number(node.iter.args[2]) if len(bounds) == 3 else 1
            if not isinstance(step, int) or step == 0:
                raise self.refuse(node, "a range with a step that is no constant", "write a while loop")
            start, end = (Literal(INT, 0), bounds[0]) if len(bounds) == 1 else bounds[:2]
            self.declare(node, node.target.id, INT)
            return [For(node, node.target.id, start, end, step, tuple(self.block(node.body)))]
        items = self.expr(node.iter)
        if not (isinstance(items.kind, TupleOf) and items.kind.items and items.kind.alike):
            what = "a loop over something that is neither a range nor a tuple of one type"
            raise self.refuse(node, what, "loop over range(n)")
        first = self.assign(node, self.fresh(), items)
        k = self.fresh().id
        self.declare(node, k, INT)
        item = Item(items.kind.items[0], Variable(items.kind, _name_of(first[-1])), Variable(INT, k))
        body = (*self.assign(node, node.target, item), *self.block(node.body))
        return [*first, For(node, k, Literal(INT, 0), Literal(INT, len(items.kind.items)), 1, body)]

    # ---- assignments ----

    def declare(self, node: ast.AST, name: str, kind: Type) -> Type:
        """The type of a variable that is assigned a value of this type too."""
        if kind == NONE or isinstance(kind, Kernel):
            raise self.refuse(node, "a variable that is no number, array or tuple", "name it where it is used")
        if name in self.kernels:
            raise self.refuse(node, "a kernel that is assigned", "choose with if")
        before = self.variables.get(name)
        both = kind if before is None else joined(before, kind)
        if both is None:
            raise self.refuse(node, f"one variable of two types, {before} and {kind}", "use two variables")
        self.variables[name] = both
        return both

    def assign(self, node: ast.stmt, target: ast.expr, value: Expr) -> list[Statement]:
        match target:
            case ast.Name(id="_"):
                return [Do(node, value)] if any(isinstance(e, Call) for e in walk(value)) else []
            case ast.Name():
                if isinstance(value, Operation) and isinstance(value.kind, ArrayOf):
                    raise self.refuse(node, "arithmetic of arrays", "write a loop over the entries")
                return [Assign(node, target.id, self.cast(value, self.declare(node, target.id, value.kind), node))]
            case ast.Subscript():
                return [self.store(node, target, value)]
            case ast.Tuple():
                return self.unpack(node, target.elts, value)
        raise self.refuse(node, "an assignment to something else than a variable or an entry", "name it")

    def store(self, node: ast.stmt, target: ast.Subscript, value: Expr) -> Statement:
        place = self.subscript(target)
        base = next((e for e in walk(place) if isinstance(e, Table)), None)
        if base is not None:
            raise self.refuse(node, "a write to an array of a module", "pass an array to write to")
        if isinstance(place, Entry) and isinstance(value.kind, Scalar) and isinstance(place.kind, Scalar):
            if value.kind != NONE and value.kind.rank <= place.kind.rank:
                return Store(node, place, self.cast(value, place.kind, node))
        elif isinstance(place, View) and isinstance(place.kind, ArrayOf):
            number = isinstance(value.kind, Scalar) and value.kind != NONE
            if number or value.kind == place.kind:
                return Fill(node, place, self.cast(value, place.kind.item, node) if number else value)
        raise self.refuse(node, f"{value.kind} for a place of type {place.kind}", "write a loop over the entries")

    def unpack(self, node: ast.stmt, targets: list[ast.expr], value: Expr) -> list[Statement]:
        """``a, b = …``: in order, by way of new variables where a later value reads what was written before."""
        if not isinstance(value.kind, TupleOf) or len(value.kind.items) != len(targets):
            raise self.refuse(node, f"{len(targets)} variables for {value.kind}", "name as many as there are")
        found: list[Statement] = []
        if isinstance(value, Items):
            values = list(value.items)
            computed = any(isinstance(each, Operation) and isinstance(each.kind, ArrayOf) for each in values)
            if not computed and _conflict(targets, values):
                for k, each in enumerate(values):
                    if not isinstance(each, Literal):
                        found += self.assign(node, self.fresh(), each)
                        values[k] = Variable(each.kind, _name_of(found[-1]))
        else:
            if not isinstance(value, Variable):
                found += self.assign(node, self.fresh(), value)
                value = Variable(value.kind, _name_of(found[-1]))
            assert isinstance(value.kind, TupleOf)
            values = [Item(kind, value, k) for k, kind in enumerate(value.kind.items)]
        return found + [s for t, v in zip(targets, values, strict=True) for s in self.assign(node, t, v)]

    def cast(self, value: Expr, want: Type, node: ast.AST) -> Expr:
        """A value as one of a wider type."""
        if value.kind == want:
            return value
        if isinstance(value.kind, TupleOf) and isinstance(want, TupleOf):
            if value.kind.items == want.items:
                return dataclasses.replace(value, kind=want)
            if isinstance(value, Items):
                items = zip(value.items, want.items, strict=True)
                return Items(want, tuple(self.cast(item, kind, node) for item, kind in items))
        if widest(value.kind, want) == want and isinstance(want, Scalar):
            if isinstance(value, Literal):
                return Literal(want, {INT: int, FLOAT: float, COMPLEX: complex}[want](value.value))
            return Cast(want, value)
        raise self.refuse(node, f"{value.kind} where {want} is needed", "give both the same type")

    # ---- expressions ----

    def expr(self, node: ast.expr) -> Expr:
        constant = self.constant(node)
        if constant is not MISSING:
            return self.known(node, constant)
        match node:
            case ast.Name():
                if node.id not in self.variables:
                    raise _UnknownError(node.id)
                return Variable(self.variables[node.id], node.id)
            case ast.Attribute():
                return self.attribute(node)
            case ast.Tuple():
                items = tuple(map(self.expr, node.elts))
                return Items(TupleOf(tuple(item.kind for item in items)), items)
            case ast.UnaryOp(op=ast.Not()):
                return Unary(BOOL, "not", self.truth(node.operand))
            case ast.UnaryOp(op=ast.USub()):
                value = self.expr(node.operand)
                kind = widest(value.kind, INT)
                if kind is None:
                    raise self.refuse(node, f"− of {value.kind}", "write a loop over the entries")
                return Unary(kind, "-", self.cast(value, kind, node))
            case ast.BinOp():
                return self.operation(node, type(node.op), self.expr(node.left), self.expr(node.right))
            case ast.BoolOp():
                return self.logic(node, self.expr)
            case ast.Compare():
                return self.comparison(node)
            case ast.IfExp():
                a, b = self.expr(node.body), self.expr(node.orelse)
                both = joined(a.kind, b.kind)
                if both is None:
                    raise self.refuse(node, f"one value of two types, {a.kind} and {b.kind}", "use if")
                return Choice(both, self.truth(node.test), self.cast(a, both, node), self.cast(b, both, node))
            case ast.Subscript():
                return self.subscript(node)
            case ast.Call():
                return self.call(node)
        raise self.refuse(node, *subset.expression(node))

    def whole(self, node: ast.expr) -> Expr:
        value = self.expr(node)
        if value.kind not in (INT, BOOL):
            raise self.refuse(node, f"{value.kind} where a whole number is needed", "convert it with int()")
        return self.cast(value, INT, node)

    def truth(self, node: ast.expr) -> Expr:
        """An expression as a condition."""
        value = self.logic(node, self.truth) if isinstance(node, ast.BoolOp) else self.expr(node)
        if value.kind == BOOL:
            return value
        if value.kind not in (INT, FLOAT):
            raise self.refuse(node, f"{value.kind} as a condition", "compare it with something")
        assert isinstance(value.kind, Scalar)
        return Operation(BOOL, "!=", value, self.cast(Literal(INT, 0), value.kind, node))

    def known(self, node: ast.expr, value: Any) -> Expr:
        """A constant."""
        match value:
            case bool():
                return Literal(BOOL, value)
            case int():
                if abs(value) >= 1 << 53:
                    raise self.refuse(node, "a whole number beyond 2⁵³", "write a float")
                return Literal(INT, value)
            case float():
                return Literal(FLOAT, value)
            case complex():
                return Literal(COMPLEX, value)
            case _ if isinstance(value, np.uint64):
                return Literal(WORD, int(value))
            case tuple():
                items = tuple(self.known(node, item) for item in value)
                names = getattr(value, "_fields", ())
                return Items(TupleOf(tuple(item.kind for item in items), names), items)
            case np.ndarray() if value.flags.c_contiguous and value.dtype.type in source.ITEMS:
                name = node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")
                return Table(ArrayOf(source.ITEMS[value.dtype.type], value.ndim), self.program.table(name, value))
            case FunctionType() | Constants():
                return Literal(Kernel(value), None)
        raise self.refuse(node, f"a constant of type {type(value).__name__}", "use numbers, tuples and arrays")

    def attribute(self, node: ast.Attribute) -> Expr:
        base = self.expr(node.value)
        kind = base.kind
        if isinstance(kind, ArrayOf) and node.attr == "shape":
            return Items(TupleOf((INT,) * kind.ndim), tuple(length_of(base, k) for k in range(kind.ndim)))
        if kind in (FLOAT, COMPLEX) and node.attr in ("real", "imag"):
            real, rest = node.attr == "real", Literal(FLOAT, 0.0)
            return Primitive(FLOAT, node.attr, (base,)) if kind == COMPLEX else base if real else rest
        if isinstance(kind, TupleOf) and node.attr in kind.names:
            return _item(base, kind.names.index(node.attr))
        raise self.refuse(node, f"an attribute of {kind}", "use shape, real, imag, or a field of a named tuple")

    def operation(self, node: ast.AST, op: type[ast.operator], a: Expr, b: Expr) -> Expr:
        kind, symbol = widest(a.kind, b.kind), _SYMBOLS.get(op, "")
        if kind is None:
            return self.of_arrays(node, symbol, a, b)
        if symbol in ("&", "|", "^") and a.kind == b.kind and kind in (BOOL, INT, WORD):
            return Operation(kind, symbol, a, b)
        if kind == WORD and symbol in ("+", "-", "*", ">>"):
            return Operation(kind, symbol, a, b)
        kind = kind if kind.rank > BOOL.rank else INT
        if op is ast.Pow:
            return self.power(node, kind, a, b)
        if symbol == "/" and kind == INT:
            kind = FLOAT
        allowed = symbol in ("+", "-", "*", "/") or (symbol in ("//", "%") and kind != COMPLEX)
        if kind in (WORD, SINGLE) or (not allowed and not (symbol in ("<<", ">>") and kind == INT)):
            raise self.refuse(node, f"this operator between {a.kind} and {b.kind}", "write + − × ÷, // or %")
        return Operation(kind, symbol, self.cast(a, kind, node), self.cast(b, kind, node))

    def of_arrays(self, node: ast.AST, symbol: str, a: Expr, b: Expr) -> Expr:
        """Arithmetic number by number, of arrays of floats with one shape and of floats."""
        arrays = {x.kind for x in (a, b) if isinstance(x.kind, ArrayOf) and x.kind.item == FLOAT}
        others = {x.kind for x in (a, b)} - arrays
        if len(arrays) != 1 or others - {FLOAT} or symbol not in ("+", "-", "*", "/"):
            raise self.refuse(node, f"arithmetic of {a.kind} and {b.kind}", "write a loop over the entries")
        return Operation(arrays.pop(), symbol, a, b)

    def power(self, node: ast.AST, kind: Scalar, a: Expr, b: Expr) -> Expr:
        if isinstance(b, Literal) and b.kind == INT:
            if kind == FLOAT and 1 <= b.value <= 16:
                return Primitive(kind, "power", (a, b))
        elif kind == FLOAT:
            return Primitive(kind, "pow", (self.cast(a, kind, node), self.cast(b, kind, node)))
        raise self.refuse(node, "a power of this kind", "write a float to a constant from 1 to 16, or to a float")

    def logic(self, node: ast.BoolOp, read: Callable[[ast.expr], Expr]) -> Expr:
        values = list(map(read, node.values))
        if any(value.kind != BOOL for value in values):
            raise self.refuse(node, "and / or of something that is no truth value", "compare it with 0")
        found, *rest = values
        for value in rest:
            found = Operation(BOOL, "and" if isinstance(node.op, ast.And) else "or", found, value)
        return found

    def comparison(self, node: ast.Compare) -> Expr:
        values = [self.expr(each) for each in (node.left, *node.comparators)]
        if any(isinstance(e, Call) for value in values[1:-1] for e in walk(value)):
            raise self.refuse(node, "a call in the middle of a comparison", "call it before")
        found: Expr | None = None
        for op, a, b in zip(node.ops, values, values[1:], strict=False):
            kind, symbol = widest(a.kind, b.kind), _SYMBOLS.get(type(op))
            if kind is None or symbol is None or (a.kind == BOOL) != (b.kind == BOOL):
                raise self.refuse(node, f"a comparison of {a.kind} and {b.kind}", "compare numbers with < or ==")
            if kind.rank in (BOOL.rank, COMPLEX.rank) and symbol not in ("==", "!="):
                raise self.refuse(node, f"an order of {kind}", "compare numbers")
            one = Operation(BOOL, symbol, self.cast(a, kind, node), self.cast(b, kind, node))
            found = one if found is None else Operation(BOOL, "and", found, one)
        assert found is not None
        return found

    # ---- indices ----

    def subscript(self, node: ast.Subscript) -> Expr:
        base: Expr = self.expr(node.value)
        if isinstance(base.kind, TupleOf):
            return self.item(node, base, base.kind)
        if not isinstance(base.kind, ArrayOf):
            raise self.refuse(node, f"an index of {base.kind}", "index arrays and tuples")
        indices: list[Expr] = []
        if isinstance(base, View) and not base.sliced:
            indices = list(base.indices)
            base = base.array
        elif not isinstance(base, Variable | Table | Item):
            raise self.refuse(node, "an index of something that has no name", "give it a name before")
        kind, bounds = base.kind, None
        assert isinstance(kind, ArrayOf)
        for each in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            if bounds is not None or len(indices) >= kind.ndim:
                raise self.refuse(node, "an index after a slice, or one too many", "index first, then slice")
            if isinstance(each, ast.Slice):
                if each.step is not None:
                    raise self.refuse(node, "a slice with a step", "write a loop")
                bounds = tuple(None if end is None else self.whole(end) for end in (each.lower, each.upper))
            else:
                indices.append(self.index(each, base, len(indices)))
        left = kind.ndim - len(indices)
        if left == 0:
            return Entry(kind.item, base, tuple(indices))
        low, high = bounds or (None, None)
        return View(ArrayOf(kind.item, left), base, tuple(indices), low, high, bounds is not None)

    def index(self, node: ast.expr, base: Expr, axis: int) -> Expr:
        """An index from 0 on: Python counts negative ones from the end."""
        value = self.whole(node)
        if isinstance(value, Literal) and value.value < 0:
            return Operation(INT, "-", length_of(base, axis), Literal(INT, -value.value))
        if self.is_natural(node):
            return value
        return Primitive(INT, "at", (value, length_of(base, axis)))

    def item(self, node: ast.Subscript, base: Expr, kind: TupleOf) -> Expr:
        index = self.number(node.slice)
        if isinstance(index, int) and -len(kind.items) <= index < len(kind.items):
            return _item(base, index % len(kind.items))
        if index is MISSING and kind.alike and not isinstance(node.slice, ast.Slice):
            position = self.whole(node.slice)
            if not self.is_natural(node.slice):
                position = Primitive(INT, "at", (position, Literal(INT, len(kind.items))))
            return Item(kind.items[0], base, position)
        raise self.refuse(node, "an index of a tuple of several types", "index by a constant")


def _name_of(statement: Statement) -> str:
    assert isinstance(statement, Assign)
    return statement.name


def _read(target: ast.expr) -> ast.expr:
    """What is assigned to, as a value."""
    made: ast.expr = type(target)(**{name: getattr(target, name) for name in target._fields})
    made.ctx = ast.Load()  # type: ignore[attr-defined]
    return ast.copy_location(made, target)


def _item(base: Expr, k: int) -> Expr:
    assert isinstance(base.kind, TupleOf)
    if isinstance(base, Items) and not any(isinstance(each, Call) for each in walk(base)):
        return base.items[k]
    return Item(base.kind.items[k], base, k)


def _conflict(targets: list[ast.expr], values: list[Expr]) -> bool:
    """Whether assigning in order would give a later value the new value of an earlier target."""
    for k, target in enumerate(targets):
        names = {n.id for n in ast.walk(target) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        stores = any(isinstance(n, ast.Subscript) for n in ast.walk(target))
        for each in walk(tuple(values[k + 1 :])):
            if isinstance(each, Variable) and each.name in names:
                return True
            if stores and isinstance(each, Entry | Call | View):
                return True
    return False
