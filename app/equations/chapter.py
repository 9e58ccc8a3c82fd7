"""The equations of the source chapter: as printed, corrected, and compared with the arm itself.

The chapter describes two arms by DH tables, multiplies the row matrices out by hand, and prints the twelve
entries of the product, ``T_base_tool = [n o a p]``: the tool's x, y and z axes in the columns n, o, a, and its
position in p. Equations (4)-(15) describe the 5-DOF Pioneer arm, (17)-(28) the 7-DOF redundant arm. Seven of the
24 are misprinted, and a program that uses them as printed is wrong by up to 97 cm:

- (6) has one term too many, (27) lacks one;
- (13) and (22) have a cosine in place of a sine;
- (25), and (28) which is built on it, have three wrong signs;
- (19) has five errors: three signs, one letter, and a spurious term.

(3), the whole matrix, is garbled in the stored text; its entries are the equations that follow it.

A misprint can be detected without a reference: the columns n, o, a of a rotation are orthonormal, and those of the
printed equations are not. Each equation is stored as text in a small notation. The same text is displayed and
evaluated, so the two cannot differ::

    -d6*c1*s23*c4*s5 - d6*s1*s4*s5 + …      with c1 = cos θ1, s23 = sin(θ2 + θ3), d6 from the arm's own table

``C`` and ``S`` abbreviate sums that the chapter writes out each time, see `ABBREVIATIONS`. In the arm as printed,
joints 1 and 2 share one axis, so these are the cosine and sine of θ1 + θ2.

>>> [e.number for e in equations("pioneer5") if e.verdict == "wrong"]
[6, 13]
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from kin.errors import InputError
from kin.files import get_robot
from kin.fk import fk
from kin.robot import Robot
from kin.transforms import Array

Verdict = Literal["right", "wrong", "garbled"]
Form = Literal["printed", "corrected"]

ABBREVIATIONS = {"C": "c1*c2 - s1*s2", "S": "c1*s2 + s1*c2"}

# The chapter's symbols d1, a2 … as (row, column) of the DH table. Its d7 is the row "End" after row 7.
LENGTHS: dict[str, dict[str, tuple[int, Literal["d", "a"]]]] = {
    "pioneer5": {"d1": (0, "d"), "a1": (0, "a"), "a2": (1, "a"), "d4": (3, "d"), "d6": (5, "d")},
    "redundant7": {"d1": (0, "d"), "d3": (2, "d"), "d5": (4, "d"), "d7": (7, "d")},
}


@dataclass(frozen=True, slots=True)
class Equation:
    """One printed equation.

    Attributes:
        number: the chapter's equation number.
        robot_id: the built-in robot it describes.
        entry: the entry of ``[n o a p]`` it gives, e.g. ``"p_x"``; ``"T"`` for the whole matrix.
        verdict: ``"right"`` if the printed form equals the DH product for every q.
        printed, corrected: right-hand sides in the module's notation; empty where the text is garbled.
        note: the error in the printed form; empty for a right equation.
        largest: largest difference from the DH product inside the joint limits, in metres for ``p``, else a pure
            number; 0 for a right equation.
        largest_at: a configuration inside the limits that attains it, in degrees; empty for a right equation.
        turn: for a wrong equation of an axis (``n``, ``o``, ``a``), the largest angle in radians between that axis
            and the same axis with this entry as printed, see `turned`; else 0.
        turn_at: a configuration inside the limits that attains it, in degrees; empty where `turn` is 0.
    """

    number: int
    robot_id: str
    entry: str
    verdict: Verdict
    printed: str
    corrected: str
    note: str = ""
    largest: float = 0.0
    largest_at: tuple[float, ...] = ()
    turn: float = 0.0
    turn_at: tuple[float, ...] = ()

    @property
    def worst_at(self) -> tuple[float, ...]:
        """The configuration of the largest error: of position for ``p``, of direction for an axis; degrees."""
        return self.turn_at or self.largest_at

    @property
    def index(self) -> tuple[int, int]:
        """Row and column of the entry in T_base_tool; raises ValueError for the garbled matrix (3)."""
        column, row = self.entry.split("_")
        return "xyz".index(row), "noap".index(column)


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Values of one equation at given configurations; every array is ``(...)``.

    `printed` and `corrected` come from the equation, `dh` from the product of the DH matrices, and `difference` is
    printed − dh: in metres for ``p``, pure numbers for ``n``, ``o``, ``a``. `turn` is the same difference as an
    angle in radians, see `turned`; 0 for ``p``.
    """

    number: int
    entry: str
    printed: Array
    corrected: Array
    dh: Array
    difference: Array
    turn: Array


def equations(robot_id: str) -> tuple[Equation, ...]:
    """The chapter's equations for a built-in robot, in order; empty for a robot that is not in the chapter.

    Raises:
        UnknownRobotError: no built-in robot has this id.
    """
    get_robot(robot_id)
    return tuple(e for e in EQUATIONS if e.robot_id == robot_id)


def compare(robot_id: str, q: ArrayLike) -> list[Comparison]:
    """Compare every readable equation with the DH product at configurations ``(..., n)``.

    Raises:
        UnknownRobotError: no built-in robot has this id.
        InputError: q is not finite numbers ``(..., n)``.
    """
    robot = get_robot(robot_id)
    q = robot.check_q(q)
    T = fk(robot, q)
    values = symbols(robot, q)
    out = []
    for equation in equations(robot_id):
        if equation.verdict == "garbled":
            continue
        printed = evaluate(equation.printed, values)
        corrected = evaluate(equation.corrected, values)
        dh = T[(..., *equation.index)]
        turn = turned(T, equation.index, printed)
        out.append(Comparison(equation.number, equation.entry, printed, corrected, dh, printed - dh, turn))
    return out


def turned(T_base_tool: Array, index: tuple[int, int], entry: Array) -> Array:
    """Angle in radians ``(...)`` between an axis of poses ``(..., 4, 4)`` and that axis with one entry replaced.

    It turns an error in an entry of n, o or a, a pure number, into an error of direction. 0 for an entry of p.
    """
    row, column = index
    if column == 3:
        return np.zeros(T_base_tool.shape[:-2])
    axis = T_base_tool[..., :3, column]
    other = axis.copy()
    other[..., row] = entry
    # atan2, because acos loses half the digits of a small angle.
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(axis, other), axis=-1), (axis * other).sum(axis=-1)))


def matrix(robot_id: str, q: ArrayLike, form: Form = "printed") -> Array:
    """``[n o a p]`` from the chapter's equations, ``(..., 4, 4)`` for configurations ``(..., n)``.

    With the printed forms the result is *not* a rigid transform, which reveals the misprints.

    Raises:
        InputError: bad q or form, or a robot that is not in the chapter.
        UnknownRobotError: no built-in robot has this id.
    """
    if form not in ("printed", "corrected"):
        raise InputError("form", form, 'one of "printed", "corrected"')
    robot = get_robot(robot_id)
    q = robot.check_q(q)
    if robot_id not in LENGTHS:
        raise InputError("robot", robot_id, "one of " + ", ".join(LENGTHS))
    values = symbols(robot, q)
    T = np.zeros((*q.shape[:-1], 4, 4))
    T[..., 3, 3] = 1.0
    for equation in equations(robot_id):
        if equation.verdict != "garbled":
            text = equation.printed if form == "printed" else equation.corrected
            T[(..., *equation.index)] = evaluate(text, values)
    return T


def symbols(robot: Robot, q: Array) -> dict[str, Array]:
    """Values ``(...)`` of the notation's names (c1, …, s23, d1, a2, C, S) at configurations ``(..., n)``."""
    values: dict[str, Array] = {}
    for i in range(robot.n):
        values[f"c{i + 1}"], values[f"s{i + 1}"] = np.cos(q[..., i]), np.sin(q[..., i])
    if robot.n > 2:
        values["c23"], values["s23"] = np.cos(q[..., 1] + q[..., 2]), np.sin(q[..., 1] + q[..., 2])
    for name, (row, column) in LENGTHS.get(robot.id, {}).items():
        values[name] = np.float64(getattr(robot.rows[row], column))  # type: ignore[assignment]  # broadcasts
    for name, text in ABBREVIATIONS.items():
        values[name] = evaluate(text, values)
    return values


def evaluate(text: str, values: Mapping[str, Array]) -> Array:
    """Value of an expression for given values of its names, broadcast together."""
    return np.asarray(_value(parse(text), values))


@lru_cache(maxsize=256)
def parse(text: str) -> ast.expr:
    """Parse an expression of names, ``+``, ``-``, ``*`` and parentheses into Python syntax nodes.

    Raises:
        ValueError: the text contains anything else. It is never executed, only walked.
    """
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise ValueError(f"not an expression of the chapter's notation: {text!r} ({error.msg})") from None
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            raise ValueError(f"not in the chapter's notation: {type(node).__name__} in {text!r}")
    return tree


_ALLOWED = (ast.BinOp, ast.UnaryOp, ast.Name, ast.Load, ast.Add, ast.Sub, ast.Mult, ast.USub)


def _value(node: ast.expr, values: Mapping[str, Array]) -> Array:
    match node:
        case ast.Name(id=name):
            return values[name]
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, values)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _value(left, values) + _value(right, values)
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return _value(left, values) - _value(right, values)
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _value(left, values) * _value(right, values)
    raise ValueError(f"not in the chapter's notation: {ast.dump(node)}")


def _right(number: int, robot_id: str, entry: str, text: str) -> Equation:
    return Equation(number, robot_id, entry, "right", text, text)


_PIONEER = "pioneer5"
_REDUNDANT = "redundant7"
_AZ_7 = "-s7*c6*(s3*c4*c5 + c3*s5) + s7*s6*s3*s4 - c7*(s3*c4*s5 - c3*c5)"

EQUATIONS: tuple[Equation, ...] = (
    Equation(
        3,
        _PIONEER,
        "T",
        "garbled",
        "",
        "",
        "The matrix cannot be read in the stored text; its entries follow as (4) to (15).",
    ),
    _right(4, _PIONEER, "p_x", "-d6*c1*s23*c4*s5 - d6*s1*s4*s5 + d6*c1*c23*c5 + d4*c1*c23 + a2*c1*c2 + a1*c1"),
    _right(5, _PIONEER, "p_y", "-d6*s1*s23*c4*s5 + d6*c1*s4*s5 + d6*s1*c23*c5 + d4*s1*c23 + a2*s1*c2 + a1*s1"),
    Equation(
        6,
        _PIONEER,
        "p_z",
        "wrong",
        "-d6*c23*c4*s5 - d6*s23*c5 - d4*s23*c5 - d4*s23 - a2*s2 + d1",
        "-d6*c23*c4*s5 - d6*s23*c5 - d4*s23 - a2*s2 + d1",
        "The term -d4*s23*c5 is spurious.",
        largest=0.13522961568046956,
        largest_at=(0.0, 73.0, 17.0, 0.0, 15.0),
    ),
    _right(7, _PIONEER, "n_x", "c1*s23*c4*c5 + s1*s4*c5 + c1*c23*s5"),
    _right(8, _PIONEER, "n_y", "s1*s23*c4*c5 - c1*s4*c5 + s1*c23*s5"),
    _right(9, _PIONEER, "n_z", "c23*c4*c5 - s23*s5"),
    _right(10, _PIONEER, "o_x", "-c1*s23*s4 + s1*c4"),
    _right(11, _PIONEER, "o_y", "-s1*s23*s4 - c1*c4"),
    _right(12, _PIONEER, "o_z", "-c23*s4"),
    Equation(
        13,
        _PIONEER,
        "a_x",
        "wrong",
        "-c1*s23*c4*s5 - s1*s4*c5 + c1*c23*c5",
        "-c1*s23*c4*s5 - s1*s4*s5 + c1*c23*c5",
        "In the second term, c5 should be s5.",
        largest=0.7044160264027588,
        largest_at=(90.0, 0.0, 0.0, 85.0, 15.0),
        turn=0.6157384581117262,
        turn_at=(115.1104, 61.7465, 116.9157, 85.0, 15.0),
    ),
    _right(14, _PIONEER, "a_y", "-s1*s23*c4*s5 + c1*s4*s5 + s1*c23*c5"),
    _right(15, _PIONEER, "a_z", "-c23*c4*s5 - s23*c5"),
    _right(
        17,
        _REDUNDANT,
        "n_x",
        "(c7*c6*c5 - s7*s5)*(c3*c4*C - s4*S) + (c7*s5*c6 + s7*c5)*(-s3*C) + s6*c7*(-c3*s4*C - c4*S)",
    ),
    _right(
        18,
        _REDUNDANT,
        "n_y",
        "(c7*c6*c5 - s7*s5)*(c3*c4*S + s4*C) + (c7*s5*c6 + s7*c5)*(-s3*S) + s6*c7*(-c3*s4*S + c4*C)",
    ),
    Equation(
        19,
        _REDUNDANT,
        "n_z",
        "wrong",
        "c7*c6*s3*c4*s5 - c7*c6*s5*c3 + c7*s6*s3*c3 + c7*s6*s3*s4 + s7*c3*c5 - s7*s3*c4*s5",
        "-c7*c6*(s3*c4*c5 + c3*s5) + c7*s6*s3*s4 - s7*(c3*c5 - s3*c4*s5)",
        "Five errors: the sign of the first term, and its s5, which should be c5; a spurious third term; the "
        "signs of the last two.",
        largest=2.377382821692843,
        largest_at=(0.0, 0.0, -66.55, 0.0, 60.35, 16.2679, -236.7554),
        turn=math.pi,
        turn_at=(0.0, 0.0, 0.0, -45.0, 0.0, 0.0, 90.0),
    ),
    _right(20, _REDUNDANT, "o_x", "c6*(-c3*s4*C - c4*S) - s6*c5*(c3*c4*C - s4*S) - s6*s5*(-s3*C)"),
    _right(21, _REDUNDANT, "o_y", "c6*(-c3*s4*S + c4*C) - s6*c5*(c3*c4*S + s4*C) - s6*s5*(-s3*S)"),
    Equation(
        22,
        _REDUNDANT,
        "o_z",
        "wrong",
        "s6*s3*c4*c5 + s5*c3*s6 + s3*c4*c6",
        "s6*(s3*c4*c5 + c3*s5) + c6*s3*s4",
        "In the last term, c4 should be s4.",
        largest=1.4142135623730951,
        largest_at=(0.0, 0.0, 90.0, -45.0, 0.0, 0.0, 0.0),
        turn=math.pi,
        turn_at=(0.0, 0.0, -90.0, -67.5, 0.0, -22.5, 0.0),
    ),
    _right(
        23,
        _REDUNDANT,
        "a_x",
        "(s7*c6*c5 + c7*s5)*(c3*c4*C - s4*S) + (s7*s5*c6 - c7*c5)*(-s3*C) + s6*s7*(-c3*s4*C - c4*S)",
    ),
    _right(
        24,
        _REDUNDANT,
        "a_y",
        "(s7*c6*c5 + c7*s5)*(c3*c4*S + s4*C) + (s7*c6*s5 - c7*c5)*(-s3*S) + s7*s6*(-c3*s4*S + c4*C)",
    ),
    Equation(
        25,
        _REDUNDANT,
        "a_z",
        "wrong",
        "s7*c6*s3*c4*c5 - s7*c6*s5*c3 + s7*s6*s4*s3 + c7*c4*s3*s5 - c3*c5*c7",
        _AZ_7,
        "Three signs are wrong: those of the first term and of the last two.",
        largest=2.3094010767585034,
        largest_at=(0.0, 0.0, 54.7356, 0.0, -35.2644, 0.0, -215.2644),
        turn=math.pi,
        turn_at=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    _right(
        26,
        _REDUNDANT,
        "p_x",
        "d7*(s7*c6*c5 + c7*s5)*(c3*c4*C - s4*S) + d7*(s7*s5*c6 - c7*c5)*(-s3*C)"
        " + (d7*s7*s6 + d5)*(-c3*s4*C - c4*S) - d3*S",
    ),
    Equation(
        27,
        _REDUNDANT,
        "p_y",
        "wrong",
        "d7*(s7*c6*c5 + s5*c7)*(c3*c4*S + s4*C) + d7*(s7*s5*c6 - c7*c5)*(-s3*S)"
        " + (d7*s7*s6 + d5)*(-c3*s4*S + c4*C)",
        "d7*(s7*c6*c5 + s5*c7)*(c3*c4*S + s4*C) + d7*(s7*s5*c6 - c7*c5)*(-s3*S)"
        " + (d7*s7*s6 + d5)*(-c3*s4*S + c4*C) + d3*C",
        "The last term, d3*C, is missing.",
        largest=0.35,
        largest_at=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    Equation(
        28,
        _REDUNDANT,
        "p_z",
        "wrong",
        "d7*s7*s3*c6*c5*c4 - d7*s7*s5*c6*c3 + d7*s7*s6*s4*s3 + d7*s5*s3*c7*c4 - d7*c7*c5*c3 + d5*s4*s3 + d1",
        f"d1 + d5*s3*s4 + d7*({_AZ_7})",
        "The same three signs as in (25), which appears here multiplied by d7.",
        largest=0.9699484522385713,
        largest_at=(0.0, 0.0, -54.7356, 0.0, -144.7356, 0.0, 215.2644),
    ),
)
