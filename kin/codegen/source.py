"""The source of a kernel, and what its names mean.

A name is looked up where Python would, around the function and in its globals: so constants, tables and
tolerances are those with which the tests run. Whatever is outside the subset raises `OutsideSubsetError`, which
says where, what, and what to write instead: nothing is passed on in the hope that a language might know it.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import operator
import textwrap
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from kin.codegen.types import BOOL, COMPLEX, FLOAT, INT, SINGLE, WORD, Constants, Scalar, TupleOf, Type
from kin.kernels import simd
from kin.kernels.compile import inlined
from kin.kernels.plain import names_around

MISSING = object()


class OutsideSubsetError(Exception):
    """A construct that no language is written from."""

    def __init__(self, function: FunctionType, node: Any, what: str, instead: str) -> None:
        line = function.__code__.co_firstlineno + getattr(node, "lineno", 1) - 1
        text = ast.unparse(node).split("\n")[0] if isinstance(node, ast.expr | ast.stmt) else ""
        file = Path(function.__code__.co_filename).name
        super().__init__(f"{file}:{line}: {what}: {text[:90]}; {instead}")


def plain(value: Any) -> Any:
    """A kernel without its compiler."""
    return getattr(value, "py_func", value)


# Functions that a language brings along: their names there, the types of the arguments and of the result.
_FLOATS = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "fabs")
PRIMITIVES: Mapping[Any, tuple[str, tuple[Scalar, ...], Type]] = {
    **{getattr(math, name): (name, (FLOAT,), FLOAT) for name in _FLOATS},
    **{getattr(math, name): (name, (FLOAT, FLOAT), FLOAT) for name in ("hypot", "atan2", "copysign")},
    math.isnan: ("isnan", (FLOAT,), BOOL),
    math.isfinite: ("isfinite", (FLOAT,), BOOL),
    math.floor: ("floor_whole", (FLOAT,), INT),
    math.ceil: ("ceil_whole", (FLOAT,), INT),
    np.round: ("rint", (FLOAT,), FLOAT),
    np.rint: ("rint", (FLOAT,), FLOAT),
    # Their polynomials read the bits of a float, which JavaScript cannot: it has its own functions.
    plain(simd.sin_cos): ("sin_cos", (FLOAT,), TupleOf((FLOAT, FLOAT))),
    plain(simd.atan2): ("arctan2", (FLOAT, FLOAT), FLOAT),
    simd.fma: ("fused", (FLOAT, FLOAT, FLOAT), FLOAT),
    simd.bits_of: ("bits_of", (FLOAT,), INT),
    simd.float_of: ("float_of", (INT,), FLOAT),
}
ALLOCATIONS: dict[Any, float | None] = {np.empty: None, np.zeros: 0.0, np.ones: 1.0, np.full: math.nan}
ITEMS = {np.float64: FLOAT, float: FLOAT, np.int64: INT, np.intp: INT, int: INT, np.bool_: BOOL, bool: BOOL}
ITEMS |= {np.complex128: COMPLEX, complex: COMPLEX, np.uint64: WORD, np.float32: SINGLE}
_FOLDED: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow, ast.LShift: operator.lshift,
}  # fmt: skip


@cache
def tree_of(function: FunctionType) -> ast.FunctionDef:
    """The definition of a function; its first line is line 1."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise OutsideSubsetError(function, tree, "no function", "define it with def")
    return tree


def decorators(function: FunctionType) -> set[str]:
    """The names of the decorators of a kernel."""
    return {each.id for each in tree_of(function).decorator_list if isinstance(each, ast.Name)}


def is_inlined(function: FunctionType) -> bool:
    """Whether a kernel is compiled into its callers, so that their loops are vectorised."""
    return inlined.__name__ in decorators(function)


class Scope:
    """Names and constants as one kernel sees them."""

    def __init__(self, function: FunctionType, kernels: Mapping[str, FunctionType | Constants]) -> None:
        self.function, self.tree, self.kernels = function, tree_of(function), kernels
        self.around = names_around(function)
        names = [n.id for n in ast.walk(self.tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        self.own = {*names, *(each.arg for each in self.tree.args.args)}
        self.never_negative = self._never_negative()

    def refuse(self, node: Any, what: str, instead: str) -> OutsideSubsetError:
        """The error for a construct."""
        return OutsideSubsetError(self.function, node, what, instead)

    def constant(self, node: ast.expr) -> Any:
        """The value of an expression that only names globals and modules; `MISSING` if it needs variables."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name() if node.id in self.own:
                return self.kernels.get(node.id, MISSING)
            case ast.Name():
                found = self.around.get(node.id, self.function.__globals__.get(node.id, MISSING))
                return getattr(builtins, node.id, MISSING) if found is MISSING else plain(found)
            case ast.Attribute():
                base = self.constant(node.value)
                owns = isinstance(base, ModuleType | Constants)
                return plain(getattr(base, node.attr, MISSING)) if owns else MISSING
            case ast.UnaryOp(op=ast.USub()):
                inner = self.number(node.operand)
                return MISSING if inner is MISSING else -inner
            case ast.BinOp():
                a, b = self.number(node.left), self.number(node.right)
                fold = _FOLDED.get(type(node.op))
                return MISSING if MISSING in (a, b) or fold is None else self._folded(node, fold, a, b)
            case ast.Tuple():
                items = tuple(map(self.constant, node.elts))
                return MISSING if any(item is MISSING for item in items) else items
            case ast.Call(func=ast.Name(id="len"), args=[argument]):
                items = self.constant(argument)
                return len(items) if isinstance(items, tuple | np.ndarray) else MISSING
            case ast.Subscript():
                base, index = self.constant(node.value), self.number(node.slice)
                return base[index] if isinstance(base, tuple) and isinstance(index, int) else MISSING
        return MISSING

    def _folded(self, node: ast.expr, fold: Callable[[Any, Any], Any], a: Any, b: Any) -> Any:
        try:
            return fold(a, b)
        except (ArithmeticError, ValueError):
            raise self.refuse(node, "a constant that has no value", "write the number") from None

    def number(self, node: ast.expr) -> Any:
        """The value of a constant number, else `MISSING`."""
        found = self.constant(node)
        return found if isinstance(found, bool | int | float | complex) else MISSING

    def _never_negative(self) -> set[str]:
        """The variables that only ever get whole numbers from 0 on: no index that is one of them is negative."""
        sources: dict[str, list[ast.expr | None]] = {}
        for node in ast.walk(self.tree):
            match node:
                case ast.Assign():
                    for target in node.targets:
                        _note(sources, target, node.value)
                case ast.AnnAssign(target=ast.Name(id=name)):
                    sources.setdefault(name, []).append(node.value)
                case ast.AugAssign(target=ast.Name(id=name), op=ast.Add() | ast.Mult()):
                    sources.setdefault(name, []).append(node.value)
                case ast.AugAssign(target=ast.Name(id=name)):
                    sources.setdefault(name, []).append(None)
                case ast.For(target=ast.Name(id=name), iter=ast.Call(args=[*bounds])) if bounds:
                    step = self.number(bounds[2]) if len(bounds) == 3 else 1
                    first: list[ast.expr] = bounds[:1] if len(bounds) > 1 else [ast.Constant(0)]
                    if isinstance(step, int) and step < 0:
                        first.append(ast.BinOp(bounds[1], ast.Add(), ast.Constant(1)))
                    sources.setdefault(name, []).extend(first if isinstance(step, int) else [None])
                case ast.For():
                    _note(sources, node.target, None)
        found = self.own - {each.arg for each in self.tree.args.args}
        while True:
            self.never_negative = found
            kept = {n for n in found if all(e is not None and self.is_natural(e) for e in sources.get(n, [None]))}
            if kept == found:
                return found
            found = kept

    def is_natural(self, node: ast.expr) -> bool:
        """Whether a whole number is surely not negative."""
        value = self.number(node)
        if value is not MISSING:
            return bool(isinstance(value, int) and value >= 0)
        match node:
            case ast.Name():
                return node.id in self.never_negative
            case ast.BinOp(op=ast.Add() | ast.Mult()):
                return self.is_natural(node.left) and self.is_natural(node.right)
            case ast.BinOp(op=ast.Mod()):
                return self.is_natural(node.right) and self.number(node.right) != 0
            case ast.BinOp(op=ast.FloorDiv() | ast.RShift()):
                return self.is_natural(node.left) and self.is_natural(node.right)
            case ast.Subscript(value=ast.Attribute(attr="shape")):
                return True
            case ast.IfExp():
                return self.is_natural(node.body) and self.is_natural(node.orelse)
            case ast.Call(func=ast.Name(id="len" | "min" | "max" as name)):
                return name == "len" or (any if name == "max" else all)(map(self.is_natural, node.args))
        return False


def _note(sources: dict[str, list[ast.expr | None]], target: ast.expr, value: ast.expr | None) -> None:
    """Note what the variables of a target are assigned."""
    if isinstance(target, ast.Name):
        sources.setdefault(target.id, []).append(value)
    elif isinstance(target, ast.Tuple):
        values = value.elts if isinstance(value, ast.Tuple) else [None] * len(target.elts)
        for each, item in zip(target.elts, values, strict=False):
            _note(sources, each, item)
