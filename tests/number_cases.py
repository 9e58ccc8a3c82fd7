"""What people type as one number, what it means, and what is refused: one table for all fields and commands."""

from __future__ import annotations

import math

from kin.units import PLAIN, Unit, Units

DEGREES, RADIANS = Units().angles, Units(degrees=False).angles
MM, CM, M = (Units(length=name).lengths for name in ("mm", "cm", "m"))  # type: ignore[arg-type]

# Text, unit of the field, and value in radians, metres or as it is.
READ: list[tuple[str, Unit, float]] = [
    ("90", DEGREES, math.pi / 2),
    ("-90°", DEGREES, -math.pi / 2),
    ("−90 °", DEGREES, -math.pi / 2),  # U+2212, as the page writes it
    ("–90º", DEGREES, -math.pi / 2),  # an en dash and an ordinal sign
    ("90deg", RADIANS, math.pi / 2),
    ("90 DEG", DEGREES, math.pi / 2),
    ("1.57 rad", DEGREES, 1.57),
    ("1.57", RADIANS, 1.57),
    ("pi/2", DEGREES, math.pi / 2),
    ("pi/2", RADIANS, math.pi / 2),
    ("-π / 2", DEGREES, -math.pi / 2),
    ("PI", DEGREES, math.pi),
    ("2π", DEGREES, 2 * math.pi),
    ("3*pi/4", DEGREES, 3 * math.pi / 4),
    ("3pi/4", DEGREES, 3 * math.pi / 4),
    ("pi/2 rad", DEGREES, math.pi / 2),
    ("0.5*pi rad", DEGREES, math.pi / 2),
    ("pi/2 + 90", DEGREES, math.pi),
    ("1/3", DEGREES, math.radians(1 / 3)),
    ("1/90°", DEGREES, math.radians(1 / 90)),  # what else could it be
    ("(45+45)°", DEGREES, math.pi / 2),
    ("--45", DEGREES, math.pi / 4),
    ("1,250", DEGREES, math.radians(1.25)),  # nobody types 1250°
    ("12,5", DEGREES, math.radians(12.5)),
    ("1.5e1", DEGREES, math.radians(15)),
    ("1e-3 rad", DEGREES, 1e-3),
    ("2.5·10⁻³ rad", DEGREES, 2.5e-3),
    ("3×30", DEGREES, math.pi / 2),
    ("180÷2", DEGREES, math.pi / 2),
    ("１２", DEGREES, math.radians(12)),  # full width
    ("١٢", DEGREES, math.radians(12)),
    ("350", MM, 0.35),
    ("0.4 m", MM, 0.4),
    ("400 mm", M, 0.4),
    ("400mm", M, 0.4),
    ("40 cm", MM, 0.4),
    ("0.4", M, 0.4),
    ("0,4 m", MM, 0.4),
    ("1,250 m", MM, 1.25),  # an arm of 1250 m is none
    ("0,125", MM, 0.125e-3),
    ("1000,125", MM, 1.000125),
    (",5", MM, 0.5e-3),
    (".5", MM, 0.5e-3),
    ("5.", MM, 5e-3),
    ("+5", MM, 5e-3),
    ("1_000", MM, 1.0),
    ("1\u202f234,5", MM, 1.2345),  # grouped as the page does
    ("\u2009\u00a0350\u202fmm\u3000", M, 0.35),
    ("2*175", MM, 0.35),
    ("3/4 m", MM, 0.75),
    ("2*0.35", M, 0.7),
    ("35 cm + 50", MM, 0.4),
    ("100*pi", MM, 0.1 * math.pi),
    ("pi m", MM, math.pi),
    ("12", CM, 0.12),
    ("-0", MM, 0.0),
    ("0.25", PLAIN, 0.25),
    ("1/3", PLAIN, 1 / 3),
    ("2^0.5/2", PLAIN, math.sqrt(0.5)),
    ("2*10**-3", PLAIN, 2e-3),
    ("10⁻³", PLAIN, 1e-3),
    ("-2²", PLAIN, -4.0),
    ("1e6", PLAIN, 1e6),
]

# Text, unit of the field, and words of the message.
REFUSED: list[tuple[str, Unit, str]] = [
    ("", MM, "the field is empty"),
    ("  ", DEGREES, "the field is empty"),
    ("9o", DEGREES, "“9o” is not a number (unknown: o)"),
    ("abc", MM, "“abc” is not a number (unknown: abc)"),
    ("nan", DEGREES, "is not a number"),
    ("inf", DEGREES, "is not a number"),
    ("-inf", MM, "is not a number"),
    ("1e999", DEGREES, "too large"),
    ("10^400", PLAIN, "too large"),
    ("9" * 101, MM, "too long"),
    ("9" * 4000, MM, "too long"),
    ("5 mm", DEGREES, "“mm” in “5 mm” is not a unit of an angle; units: °, deg, rad"),
    ("5 rad", MM, "“rad” in “5 rad” is not a unit of a length; units: mm, cm, m"),
    ("5 m", PLAIN, "“m” in “5 m” is not a unit of this number; units: none"),
    ("1,000", MM, "“1,000” may be written with thousands or with decimals; type 1.000 or 1000"),
    ("2*(-12,500)", MM, "type 2*(-12.500) or 2*(-12500)"),
    ("1,000", PLAIN, "type 1.000 or 1000"),
    ("1,000.5", MM, "type 1000.5"),
    ("1.234,5", MM, "type 1234.5"),
    ("1.234,5", DEGREES, "type 1234.5"),
    ("1,000,000", MM, "type 1000000"),
    ("1.000.000", MM, "type 1000000"),
    ("1.2.3", DEGREES, "is not a number"),
    ("1/0", DEGREES, "divides by zero"),
    ("0^-1", PLAIN, "divides by zero"),
    ("(-8)^0.5", PLAIN, "a root of a negative number"),
    ("2^3^2", PLAIN, "is not a number"),
    ("5mm^2", MM, "is not a number"),
    ("(1", DEGREES, "a bracket is open"),
    ("1)", DEGREES, "is not a number"),
    ("1 2", DEGREES, "is not a number"),
    ("1+", DEGREES, "is not a number"),
    ("*2", DEGREES, "is not a number"),
    ("pi2", DEGREES, "is not a number"),
    ("pi*pi", DEGREES, "units do not cancel"),
    ("1/(90°)", DEGREES, "units do not cancel"),
    ("90°°", DEGREES, "is not a"),
    ("90° rad", DEGREES, "is not a"),
    ("pi°", DEGREES, "a unit after a unit"),
    ("0x10", DEGREES, "is not a number"),
    ("__import__('os').system('true')", DEGREES, "is not a number"),
    ("<script>alert(1)</script>", DEGREES, "is not a number"),
    ("pi.real", DEGREES, "is not a number"),
    ("(" * 60, DEGREES, "brackets"),
    ("-" * 60, DEGREES, "is not a number"),
    ("\u202e90\u202c", DEGREES, "is not a number"),  # shown as 09
    ("9\x000", DEGREES, "is not a number"),
    ("½", MM, "is not a number"),
]
