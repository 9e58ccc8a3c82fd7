"""Calls in kernels: of other kernels, of functions of the languages, of NumPy for arrays, and methods."""

from __future__ import annotations

import ast
from types import FunctionType
from typing import Any

import numpy as np

from kin.codegen import source
from kin.codegen.source import MISSING, PRIMITIVES, Scope
from kin.codegen.tree import (
    Call,
    Cast,
    Copy,
    Expr,
    Instance,
    Item,
    Items,
    Length,
    Literal,
    New,
    Primitive,
    Reshaped,
    View,
)  # fmt: skip
from kin.codegen.types import BOOL, COMPLEX, FLOAT, INT, SINGLE, WORD, ArrayOf, TupleOf, Type, widest


class Calls(Scope):
    """The calls of a kernel; how its other expressions are read is given by who inherits from it."""

    def expr(self, node: ast.expr) -> Expr:
        """An expression."""
        raise NotImplementedError

    def whole(self, node: ast.expr) -> Expr:
        """An expression that is a whole number."""
        raise NotImplementedError

    def truth(self, node: ast.expr) -> Expr:
        """An expression as a condition."""
        raise NotImplementedError

    def cast(self, value: Expr, want: Type, node: ast.AST) -> Expr:
        """A value as one of a wider type."""
        raise NotImplementedError

    def callee(self, function: FunctionType, kinds: tuple[Type, ...]) -> Instance:
        """The kernel that is called with these types."""
        raise NotImplementedError

    def call(self, node: ast.Call) -> Expr:
        function = self.constant(node.func)
        if function is MISSING and isinstance(node.func, ast.Attribute):
            return self.method(node, node.func)
        if isinstance(function, np.ufunc | FunctionType) or callable(function):
            if function in source.ALLOCATIONS:
                return self.allocation(node, source.ALLOCATIONS[function])
            if function is np.arange and len(node.args) == 1 and not node.keywords:
                kind = ArrayOf(INT, 1)
                return Primitive(kind, "counted", (New(kind, (self.whole(node.args[0]),), None),))
            if node.keywords or any(isinstance(each, ast.Starred) for each in node.args):
                raise self.refuse(node, "keyword or starred arguments", "pass each by position")
            values = tuple(map(self.expr, node.args))
            if function in PRIMITIVES:
                return self.primitive(node, PRIMITIVES[function], values)
            if isinstance(function, type) and issubclass(function, tuple) and hasattr(function, "_fields"):
                if len(values) == len(function._fields):
                    return Items(TupleOf(tuple(v.kind for v in values), function._fields), values)
            elif isinstance(function, type) or function in (abs, min, max, len):
                return self.builtin(node, function, values)
            elif isinstance(function, FunctionType) and function.__module__.startswith("kin."):
                callee = self.callee(function, tuple(value.kind for value in values))
                return Call(callee.result, callee, values)
        raise self.refuse(node, "a call of something that is neither a kernel nor known", "call kernels and math")

    def primitive(self, node: ast.Call, row: tuple[str, Any, Type], values: tuple[Expr, ...]) -> Expr:
        name, kinds, result = row
        if len(values) != len(kinds):
            raise self.refuse(node, f"{len(values)} arguments", f"pass {len(kinds)}")
        if any(widest(value.kind) is None for value in values):
            raise self.refuse(node, "an array where a number is needed", "write a loop over the entries")
        return Primitive(result, name, tuple(self.cast(v, k, node) for v, k in zip(values, kinds, strict=True)))

    def builtin(self, node: ast.Call, function: Any, values: tuple[Expr, ...]) -> Expr:
        kind = widest(*(value.kind for value in values)) if values else None
        if function is len and len(values) == 1 and isinstance(values[0].kind, ArrayOf):
            return length_of(values[0], 0)
        if kind is not None and function in (min, max) and len(values) > 1 and kind in (INT, FLOAT):
            found, *rest = (self.cast(value, kind, node) for value in values)
            for each in rest:
                found = Primitive(kind, "least" if function is min else "most", (found, each))
            return found
        if kind is not None and len(values) == 1:
            if function is abs and kind in (INT, FLOAT, COMPLEX):
                return Primitive(FLOAT if kind == COMPLEX else kind, "abs", values)
            if function is int and kind != COMPLEX:
                return Primitive(INT, "whole", values) if kind == FLOAT else self.cast(values[0], INT, node)
            if function is float and kind in (BOOL, INT, FLOAT):
                return self.cast(values[0], FLOAT, node)
            if function is bool:
                return self.truth(node.args[0])
            to = {np.uint64: (INT, WORD), np.float32: (FLOAT, SINGLE), float: (kind, FLOAT)}.get(function)
            if to is not None and to[0] == kind:
                return Cast(to[1], values[0])
        if function is complex and len(values) == 2 and kind in (INT, FLOAT):
            return Primitive(COMPLEX, "complex", tuple(self.cast(value, FLOAT, node) for value in values))
        raise self.refuse(
            node, "this use of a function of Python", "use abs, min, max, len, int, float of numbers"
        )

    def method(self, node: ast.Call, name: ast.Attribute) -> Expr:
        inner = name.value
        if name.attr == "all" and isinstance(inner, ast.Call) and self.constant(inner.func) is np.isfinite:
            value = self.expr(inner.args[0])
            if value.kind == ArrayOf(FLOAT, 1):
                return Primitive(BOOL, "all_finite", (value,))
        elif not node.keywords:
            base = self.expr(inner)
            if isinstance(base.kind, ArrayOf) and name.attr == "copy" and not node.args:
                return Copy(base.kind, base)
            if isinstance(base.kind, ArrayOf) and name.attr == "reshape" and node.args:
                sizes = tuple(map(self.whole, node.args))
                if not any(isinstance(size, Literal) and size.value < 0 for size in sizes):
                    return Reshaped(ArrayOf(base.kind.item, len(sizes)), base, sizes)
            if base.kind == COMPLEX and name.attr == "conjugate":
                return Primitive(COMPLEX, "conjugate", (base,))
        raise self.refuse(node, "a method", "use copy, reshape, conjugate, or np.isfinite(…).all()")

    def allocation(self, node: ast.Call, fill: float | None) -> Expr:
        function = self.constant(node.func)
        given = {each.arg: each.value for each in node.keywords}
        if len(node.args) != 1 + (function is np.full) or set(given) - {"dtype"}:
            raise self.refuse(node, "an allocation with other arguments", "give the shape, and dtype by name")
        dtype = self.constant(given["dtype"]) if "dtype" in given else np.float64
        item = source.ITEMS.get(getattr(dtype, "type", dtype))
        if item is None:
            raise self.refuse(
                node, "an array of this dtype", "use float64, int64, uint64, float32, bool or complex128"
            )
        shape = self.expr(node.args[0])
        sizes = shape.items if isinstance(shape, Items) else (shape,)
        if not isinstance(shape, Items) and isinstance(shape.kind, TupleOf):
            sizes = tuple(Item(each, shape, k) for k, each in enumerate(shape.kind.items))
        if any(size.kind not in (INT, BOOL) for size in sizes):
            raise self.refuse(node, "a shape of something else than whole numbers", "write a tuple of them")
        sizes = tuple(self.cast(size, INT, node) for size in sizes)
        filled: Expr | None = None if fill is None else Literal(FLOAT, fill)
        if function is np.full:
            filled = self.expr(node.args[1])
            item = item if "dtype" in given else widest(filled.kind)
            if item is None:
                raise self.refuse(node, "an array filled with an array", "write a loop over the entries")
        if filled is not None and item in (INT, BOOL) and isinstance(filled, Literal):
            filled = Literal(item, bool(filled.value) if item == BOOL else int(filled.value))
        filled = None if filled is None else self.cast(filled, item, node)
        return New(ArrayOf(item, len(sizes)), sizes, filled)


def length_of(array: Expr, axis: int) -> Expr:
    """The length of an axis; that of a view is that of what it shows."""
    if isinstance(array, View) and not array.sliced:
        return length_of(array.array, axis + len(array.indices))
    return Length(INT, array, axis)
