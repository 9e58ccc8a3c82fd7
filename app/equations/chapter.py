"""The equations of the source chapter: as printed, and corrected.

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
printed equations are not. Each equation is stored as text in a small notation, which
`app.equations.expression.from_text` reads. What is displayed is what is evaluated::

    -d6*c1*s23*c4*s5 - d6*s1*s4*s5 + …      with c1 = cos θ1, s23 = sin(θ2 + θ3), d6 from the arm's own table

``C`` and ``S`` abbreviate sums that the chapter writes out each time, see `ABBREVIATIONS`. In the arm as printed,
joints 1 and 2 share one axis, so these are the cosine and sine of θ1 + θ2.

>>> [e.number for e in EQUATIONS["pioneer5"] if e.verdict == "misprinted"]
[6, 13]
"""

from __future__ import annotations

import math
from typing import Literal

from app.equations.equation import Equation
from app.equations.expression import from_text

ABBREVIATIONS = {"C": "c1*c2 - s1*s2", "S": "c1*s2 + s1*c2"}

# The chapter's symbols d1, a2 … as (row, column) of the DH table. Its d7 is the row "End" after row 7.
LENGTHS: dict[str, dict[str, tuple[int, Literal["d", "a"]]]] = {
    "pioneer5": {"d1": (0, "d"), "a1": (0, "a"), "a2": (1, "a"), "d4": (3, "d"), "d6": (5, "d")},
    "redundant7": {"d1": (0, "d"), "d3": (2, "d"), "d5": (4, "d"), "d7": (7, "d")},
}


def _right(number: int, entry: str, text: str) -> Equation:
    form = from_text(text)
    return Equation(str(number), number, entry, "right", form, form)


def _wrong(number: int, entry: str, printed: str, correct: str, note: str, *worst: float) -> Equation:
    """One with a misprint; `worst` in degrees."""
    forms = from_text(printed), from_text(correct)
    return Equation(str(number), number, entry, "misprinted", *forms, note, tuple(map(math.radians, worst)))


_AZ_7 = "-s7*c6*(s3*c4*c5 + c3*s5) + s7*s6*s3*s4 - c7*(s3*c4*s5 - c3*c5)"

# By the id of the built-in arm, in order.
EQUATIONS: dict[str, tuple[Equation, ...]] = {
    "pioneer5": (
        Equation(
            *("3", 3, "T", "unreadable", None, None),
            "The matrix cannot be read in the stored text; its entries follow as (4) to (15).",
        ),
        _right(4, "p_x", "-d6*c1*s23*c4*s5 - d6*s1*s4*s5 + d6*c1*c23*c5 + d4*c1*c23 + a2*c1*c2 + a1*c1"),
        _right(5, "p_y", "-d6*s1*s23*c4*s5 + d6*c1*s4*s5 + d6*s1*c23*c5 + d4*s1*c23 + a2*s1*c2 + a1*s1"),
        _wrong(
            6,
            "p_z",
            "-d6*c23*c4*s5 - d6*s23*c5 - d4*s23*c5 - d4*s23 - a2*s2 + d1",
            "-d6*c23*c4*s5 - d6*s23*c5 - d4*s23 - a2*s2 + d1",
            "The term -d4*s23*c5 is spurious.",
            *(0.0, 73.0, 17.0, 0.0, 15.0),
        ),
        _right(7, "n_x", "c1*s23*c4*c5 + s1*s4*c5 + c1*c23*s5"),
        _right(8, "n_y", "s1*s23*c4*c5 - c1*s4*c5 + s1*c23*s5"),
        _right(9, "n_z", "c23*c4*c5 - s23*s5"),
        _right(10, "o_x", "-c1*s23*s4 + s1*c4"),
        _right(11, "o_y", "-s1*s23*s4 - c1*c4"),
        _right(12, "o_z", "-c23*s4"),
        _wrong(
            13,
            "a_x",
            "-c1*s23*c4*s5 - s1*s4*c5 + c1*c23*c5",
            "-c1*s23*c4*s5 - s1*s4*s5 + c1*c23*c5",
            "In the second term, c5 should be s5.",
            *(115.1104, 61.7465, 116.9157, 85.0, 15.0),
        ),
        _right(14, "a_y", "-s1*s23*c4*s5 + c1*s4*s5 + s1*c23*c5"),
        _right(15, "a_z", "-c23*c4*s5 - s23*c5"),
    ),
    "redundant7": (
        _right(
            17,
            "n_x",
            "(c7*c6*c5 - s7*s5)*(c3*c4*C - s4*S) + (c7*s5*c6 + s7*c5)*(-s3*C) + s6*c7*(-c3*s4*C - c4*S)",
        ),
        _right(
            18,
            "n_y",
            "(c7*c6*c5 - s7*s5)*(c3*c4*S + s4*C) + (c7*s5*c6 + s7*c5)*(-s3*S) + s6*c7*(-c3*s4*S + c4*C)",
        ),
        _wrong(
            19,
            "n_z",
            "c7*c6*s3*c4*s5 - c7*c6*s5*c3 + c7*s6*s3*c3 + c7*s6*s3*s4 + s7*c3*c5 - s7*s3*c4*s5",
            "-c7*c6*(s3*c4*c5 + c3*s5) + c7*s6*s3*s4 - s7*(c3*c5 - s3*c4*s5)",
            "Five errors: the sign of the first term, and its s5, which should be c5; a spurious third term; the "
            "signs of the last two.",
            *(0.0, 0.0, 0.0, -45.0, 0.0, 0.0, 90.0),
        ),
        _right(20, "o_x", "c6*(-c3*s4*C - c4*S) - s6*c5*(c3*c4*C - s4*S) - s6*s5*(-s3*C)"),
        _right(21, "o_y", "c6*(-c3*s4*S + c4*C) - s6*c5*(c3*c4*S + s4*C) - s6*s5*(-s3*S)"),
        _wrong(
            22,
            "o_z",
            "s6*s3*c4*c5 + s5*c3*s6 + s3*c4*c6",
            "s6*(s3*c4*c5 + c3*s5) + c6*s3*s4",
            "In the last term, c4 should be s4.",
            *(0.0, 0.0, -90.0, -67.5, 0.0, -22.5, 0.0),
        ),
        _right(
            23,
            "a_x",
            "(s7*c6*c5 + c7*s5)*(c3*c4*C - s4*S) + (s7*s5*c6 - c7*c5)*(-s3*C) + s6*s7*(-c3*s4*C - c4*S)",
        ),
        _right(
            24,
            "a_y",
            "(s7*c6*c5 + c7*s5)*(c3*c4*S + s4*C) + (s7*c6*s5 - c7*c5)*(-s3*S) + s7*s6*(-c3*s4*S + c4*C)",
        ),
        _wrong(
            25,
            "a_z",
            "s7*c6*s3*c4*c5 - s7*c6*s5*c3 + s7*s6*s4*s3 + c7*c4*s3*s5 - c3*c5*c7",
            _AZ_7,
            "Three signs are wrong: those of the first term and of the last two.",
            *[0.0] * 7,
        ),
        _right(
            26,
            "p_x",
            "d7*(s7*c6*c5 + c7*s5)*(c3*c4*C - s4*S) + d7*(s7*s5*c6 - c7*c5)*(-s3*C)"
            " + (d7*s7*s6 + d5)*(-c3*s4*C - c4*S) - d3*S",
        ),
        _wrong(
            27,
            "p_y",
            "d7*(s7*c6*c5 + s5*c7)*(c3*c4*S + s4*C) + d7*(s7*s5*c6 - c7*c5)*(-s3*S)"
            " + (d7*s7*s6 + d5)*(-c3*s4*S + c4*C)",
            "d7*(s7*c6*c5 + s5*c7)*(c3*c4*S + s4*C) + d7*(s7*s5*c6 - c7*c5)*(-s3*S)"
            " + (d7*s7*s6 + d5)*(-c3*s4*S + c4*C) + d3*C",
            "The last term, d3*C, is missing.",
            *[0.0] * 7,
        ),
        _wrong(
            28,
            "p_z",
            "d7*s7*s3*c6*c5*c4 - d7*s7*s5*c6*c3 + d7*s7*s6*s4*s3 + d7*s5*s3*c7*c4 - d7*c7*c5*c3 + d5*s4*s3 + d1",
            f"d1 + d5*s3*s4 + d7*({_AZ_7})",
            "The same three signs as in (25), which appears here multiplied by d7.",
            *(0.0, 0.0, -54.7356, 0.0, -144.7356, 0.0, 215.2644),
        ),
    ),
}
