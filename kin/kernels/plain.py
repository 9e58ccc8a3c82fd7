"""Kernels in plain Python, with the arithmetic of compiled ones.

Where a division or a function of the C library gives an infinity or NaN, Python raises an error, and it computes
powers otherwise. So these become calls of the functions here. All else stays as it is written, with its lines, for
a debugger and where coverage is measured.
"""

from __future__ import annotations
import __future__

import ast
import inspect
import math
import textwrap
from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

_NAME = "_in_plain_python"  # of the functions below, in the modules of kernels
_LEAST = -(1 << 63)


def written(function: FunctionType) -> Callable[..., Any]:
    """A kernel as it is written, with the arithmetic of compiled ones."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    ast.increment_lineno(tree, function.__code__.co_firstlineno - 1)
    (definition,) = tree.body
    assert isinstance(definition, ast.FunctionDef)
    definition.decorator_list.clear()
    changed = ast.fix_missing_locations(_Arithmetic().visit(tree))
    flags = __future__.annotations.compiler_flag
    scope: dict[str, Any] = {}
    around = names_around(function)
    names = function.__globals__ | around if around else function.__globals__
    names[_NAME] = _FUNCTIONS
    exec(compile(changed, function.__code__.co_filename, "exec", flags), names, scope)
    made = scope[function.__name__]

    def call(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return made(*arguments)

    return call


def names_around(function: FunctionType) -> dict[str, Any]:
    """What a function that another one has made uses of that one, by its names."""
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    return dict(zip(function.__code__.co_freevars, cells, strict=True))


class _Arithmetic(ast.NodeTransformer):
    """Puts functions in the place of operators, of `int` and of the module `math`."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """A division or a power."""
        self.generic_visit(node)
        return _replaced(node, node.op, node.left, node.right)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        """A division or a power in place."""
        self.generic_visit(node)
        old = ast.parse(ast.unparse(node.target), mode="eval").body
        new = _replaced(old, node.op, ast.copy_location(old, node), node.value)
        return node if new is old else ast.copy_location(ast.Assign([node.target], new), node)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """A call of `int`."""
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id == "int":
            node.func = _function(node.func, "int")
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """The module `math`."""
        return _function(node, "math") if node.id == "math" else node


def _function(node: ast.expr, name: str) -> ast.expr:
    base = ast.copy_location(ast.Name(_NAME, ast.Load()), node)
    return ast.copy_location(ast.Attribute(base, name, ast.Load()), node)


def _replaced(node: ast.expr, operator: ast.operator, left: ast.expr, right: ast.expr) -> ast.expr:
    name = "divided" if isinstance(operator, ast.Div) else "power" if isinstance(operator, ast.Pow) else ""
    return ast.copy_location(ast.Call(_function(node, name), [left, right], []), node) if name else node


def _divided(a: Any, b: Any) -> Any:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return a / b
    kind = complex if isinstance(a, complex) or isinstance(b, complex) else float
    a, b = kind(a), kind(b)
    try:
        return a / b
    except ZeroDivisionError:
        if kind is complex:
            return complex(math.nan, math.nan)
        return math.nan if a == 0.0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _power(x: float, n: float) -> float:
    if not isinstance(n, int):
        return float(np.float64(x) ** np.float64(n))
    found = 1.0
    while n > 0:
        if n & 1:
            found *= x
        x *= x
        n >>= 1
    return float(found)


def _whole(function: Callable[[float], int]) -> Callable[[float], int]:
    def call(x: float) -> int:
        try:
            found = function(x)
        except (ValueError, OverflowError):  # an infinity or NaN
            return _LEAST
        return found if -_LEAST > found >= _LEAST else _LEAST

    return call


def _of_library(function: Callable[[float], float], beyond: float = math.nan) -> Callable[[float], float]:
    def call(x: float) -> float:
        try:
            return function(x)
        except (ValueError, OverflowError):
            return beyond

    return call


def _log(x: float) -> float:
    return math.log(x) if x > 0.0 else -math.inf if x == 0.0 else math.nan


_NAN = {name: _of_library(getattr(math, name)) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos")}
_WHOLE = {"floor": _whole(math.floor), "ceil": _whole(math.ceil)}
_MATH = vars(math) | _NAN | _WHOLE | {"exp": _of_library(math.exp, math.inf), "log": _log}
_FUNCTIONS = SimpleNamespace(divided=_divided, power=_power, int=_whole(int), math=SimpleNamespace(**_MATH))
