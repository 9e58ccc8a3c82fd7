"""Formulas as text, from which both their values and their typeset forms are made.

A formula is an expression in Python's syntax with few functions. Names are a letter and an index: ``w_x``, ``θ3``,
``R03``. What is shown is what was computed: `value` and `mathml` walk the same tree.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from html import escape
from typing import Any

import numpy as np

from kin.transforms import Array

Value = float | Array
_NAME = re.compile(r"([A-Za-zα-ω])_?(\w*)")
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "atan2": math.atan2,
    "arccos": lambda x: math.acos(min(max(x, -1.0), 1.0)),
    "cos": math.cos,
    "sin": math.sin,
    "sqrt": lambda x: math.sqrt(max(x, 0.0)),
    "cross": np.cross,
    "unit": lambda v: v / np.linalg.norm(v),
    "inv": lambda R: R.T,
}
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
    ast.MatMult: lambda a, b: a @ b,
}
_LEVELS: dict[type[ast.operator], int] = {
    ast.Add: 1,
    ast.Sub: 1,
    ast.Mult: 2,
    ast.MatMult: 2,
    ast.Div: 3,
    ast.Pow: 3,
}
_BETWEEN: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "−", ast.Mult: "\u2062", ast.MatMult: "\u2062"}


@lru_cache(maxsize=512)
def parsed(text: str) -> ast.expr:
    """The tree of a formula; raises SyntaxError for a text that is none."""
    return ast.parse(text, mode="eval").body


def value(text: str, values: Mapping[str, Value]) -> Any:
    """The value of a formula; arccos and √ take what rounding leaves outside their range for its end."""
    return _value(parsed(text), values)


def _value(node: ast.expr, values: Mapping[str, Value]) -> Any:
    match node:
        case ast.Name(id=name):
            return values[name]
        case ast.Constant(value=number):
            return number
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, values)
        case ast.BinOp(left=left, op=operator, right=right):
            return _OPERATORS[type(operator)](_value(left, values), _value(right, values))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _FUNCTIONS[name](*(_value(argument, values) for argument in arguments))
    raise ValueError(f"not in the notation of formulas: {ast.dump(node)}")


@lru_cache(maxsize=512)
def mathml(*sides: str) -> str:
    """A ``<math>`` element: the sides of an equation, or one expression."""
    return _math("<mo>=</mo>".join(_mathml(parsed(side)) for side in sides))


def _math(content: str) -> str:
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"><mrow>{content}</mrow></math>'


def _level(node: ast.expr) -> int:
    """How strongly the outermost operation binds: 1 a sum, 2 a product, 3 anything closed."""
    if isinstance(node, ast.BinOp):
        return _LEVELS[type(node.op)]
    return 1 if isinstance(node, ast.UnaryOp) else 3


def _mathml(node: ast.expr, least: int = 0) -> str:
    """An expression, in brackets if it binds less strongly than `least`."""
    inside = _open(node)
    if _level(node) < least:
        return f'<mrow><mo stretchy="false">(</mo>{inside}<mo stretchy="false">)</mo></mrow>'
    return inside


def _open(node: ast.expr) -> str:
    match node:
        case ast.Name(id=name):
            return _name(name)
        case ast.Constant(value=number):
            return f"<mn>{number!r}</mn>"
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return f'<mo form="prefix">−</mo>{_mathml(inner, 2)}'
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return f"<mfrac><mrow>{_mathml(left)}</mrow><mrow>{_mathml(right)}</mrow></mfrac>"
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return f"<msup>{_mathml(left, 3)}{_mathml(right)}</msup>"
        case ast.BinOp(left=left, op=operator, right=right):
            level = _LEVELS[type(operator)]
            second = _mathml(right, level + isinstance(operator, ast.Sub))
            return f"{_mathml(left, level)}<mo>{_BETWEEN[type(operator)]}</mo>{second}"
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _call(name, arguments)
    raise ValueError(f"not in the notation of formulas: {ast.dump(node)}")


def _call(name: str, arguments: list[ast.expr]) -> str:
    first = arguments[0]
    if name == "sqrt":
        return f"<msqrt>{_mathml(first)}</msqrt>"
    if name == "inv":
        return f"<msup>{_mathml(first, 3)}<mo>T</mo></msup>"
    if name == "cross":
        return f"{_mathml(first, 3)}<mo>×</mo>{_mathml(arguments[1], 3)}"
    if name == "unit":
        inside = _mathml(first)
        return f"<mfrac><mrow>{inside}</mrow><mrow><mo>|</mo>{inside}<mo>|</mo></mrow></mfrac>"
    if name != "atan2" and isinstance(first, ast.Name):
        return f"<mi>{name}</mi><mo>\u2061</mo><mspace width='0.17em'/>{_mathml(first)}"
    inside = "<mo>,</mo>".join(_mathml(argument) for argument in arguments)
    return f'<mi>{name}</mi><mo stretchy="false">(</mo>{inside}<mo stretchy="false">)</mo>'


def _name(name: str) -> str:
    found = _NAME.fullmatch(name)
    if found is None:
        raise ValueError(f"not a name of a formula: {name!r}")
    letter, index = found.groups()
    index, kind = index.replace("_", ","), "mn" if index.isdigit() else "mi"
    base = f"<mi>{escape(letter)}</mi>"
    return f"<msub>{base}<{kind}>{escape(index)}</{kind}></msub>" if index else base
