"""Arithmetic in exercise files: ``a1*cos(t1) + 20*mm``. In radians, metres and SI units.

Only numbers, names, ``+ - * / **``, comparisons, ``and``, ``or``, ``not`` and calls of known functions are valid.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping

Function = Callable[..., float]

LONGEST = 400  # characters
MOST_POWER = 8.0
LARGEST = 1e12  # of the values of expressions: the squares of what is made of them are still numbers
CONSTANTS = {"pi": math.pi, "deg": math.pi / 180.0, "mm": 1e-3, "cm": 1e-2}
FUNCTIONS: dict[str, Function] = {
    "abs": abs,
    "acos": math.acos,
    "asin": math.asin,
    "atan": math.atan,
    "atan2": math.atan2,
    "cos": math.cos,
    "hypot": math.hypot,
    "max": max,
    "min": min,
    "round": lambda value: float(round(value)),
    "sign": lambda value: math.copysign(1.0, value) if value else 0.0,
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARE: dict[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
VALID = "numbers, names, + - * / **, comparisons, and, or, not, " + ", ".join(sorted(FUNCTIONS))


class ExpressionError(ValueError):
    """A text is no expression, or it has no value; the message says why.

    Attributes:
        field: of the file that it comes from, if any.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(f"{field}: {message}" if field else message)
        self.field = field


class Expression:
    """One expression.

    Attributes:
        text: as written.
        field: where in a file, for messages.
        names: the names and functions in it that are not built in.
    """

    def __init__(self, text: str, field: str = "") -> None:
        if len(text) > LONGEST:
            raise ExpressionError(f"longer than {LONGEST} characters")
        try:
            self._body = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, MemoryError, RecursionError):
            raise ExpressionError("not an expression") from None
        self.text, self.field = text, field
        self.names: frozenset[str] = frozenset()
        self._check(self._body)

    def _check(self, node: ast.AST) -> None:
        """Refuse what is not arithmetic; collect the names."""
        match node:
            case ast.Constant(value=bool() | int() | float()) | ast.operator() | ast.unaryop():
                pass
            case ast.cmpop() if type(node) in _COMPARE:
                pass
            case ast.boolop() | ast.Load():
                pass
            case ast.Name(id=name):
                self.names |= {name} - CONSTANTS.keys()
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                self.names |= {name} - FUNCTIONS.keys()
                for argument in arguments:
                    self._check(argument)
            case ast.BinOp() | ast.UnaryOp() | ast.BoolOp() | ast.Compare():
                for child in ast.iter_child_nodes(node):
                    self._check(child)
            case _:
                raise ExpressionError(f"“{ast.unparse(node)}” is not arithmetic")

    def value(self, scope: Mapping[str, float | Function]) -> float:
        """The value with these names; raises `ExpressionError` if there is none."""
        try:
            found = float(_value(self._body, scope))
        except KeyError as error:
            raise ExpressionError(f"unknown name {error.args[0]}", self.field) from None
        except (ArithmeticError, ValueError, TypeError, IndexError, RecursionError) as error:
            raise ExpressionError(f"{self.text}: {error}", self.field) from None
        if not abs(found) <= LARGEST:
            expected = f"a number from {-LARGEST:g} to {LARGEST:g}"
            raise ExpressionError(f"{self.text}: got {found:g}, expected {expected}", self.field)
        return found


def _value(node: ast.expr, scope: Mapping[str, float | Function]) -> float:
    match node:
        case ast.Constant(value=value):
            return float(value)  # type: ignore[arg-type]  # checked when it was read
        case ast.Name(id=name):
            found = CONSTANTS[name] if name in CONSTANTS else scope[name]
            if callable(found):
                raise TypeError(f"{name} needs arguments in brackets")
            return found
        case ast.Call(func=ast.Name(id=name), args=arguments):
            function = scope.get(name)
            if not callable(function):
                function = FUNCTIONS[name] if name in FUNCTIONS else scope[name]
            if not callable(function):
                raise TypeError(f"{name} is not a function")
            return float(function(*(_value(argument, scope) for argument in arguments)))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return float(not _value(operand, scope))
        case ast.UnaryOp(op=sign, operand=operand):
            value = _value(operand, scope)
            return -value if isinstance(sign, ast.USub) else value
        case ast.BoolOp(op=ast.And(), values=values):
            return float(all(_value(each, scope) for each in values))
        case ast.BoolOp(values=values):
            return float(any(_value(each, scope) for each in values))
        case ast.Compare(left=left, ops=operators, comparators=others):
            compared = [_value(each, scope) for each in (left, *others)]
            pairs = zip(operators, compared[:-1], compared[1:], strict=True)
            return float(all(_COMPARE[type(op)](a, b) for op, a, b in pairs))
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            power = _value(right, scope)
            if abs(power) > MOST_POWER:
                raise ValueError(f"a power beyond {MOST_POWER:g}")
            result = _value(left, scope) ** power
            if isinstance(result, complex):
                raise ValueError("the root of a negative number")
            return float(result)
        case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _BINARY:
            return _BINARY[type(sign)](_value(left, scope), _value(right, scope))
    raise TypeError("an operator that is not valid here")
