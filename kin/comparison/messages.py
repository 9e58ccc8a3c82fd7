"""Sentences about a comparison, in the reader's units. Rows and joints are counted from 1."""

from __future__ import annotations

import math

import numpy as np

from kin.comparison.results import Change, Comparison, Difference, Explanation
from kin.comparison.tables import COLUMNS
from kin.robot import Robot
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Unit, Units

_SYMBOLS = dict(zip(COLUMNS, ("θ", "d", "a", "α"), strict=True))
_MOST_DIGITS = 6  # decimals of a degree or a millimetre
_FEWEST, _MOST_SHOWN = 4, 10  # digits of a cell before and after a change
Names = tuple[str, str]  # how a sentence calls the arms a and b
NAMES: Names = ("a", "b")


def verdict(found: Comparison, a: Robot, b: Robot, units: Units = DEFAULT_UNITS, names: Names = NAMES) -> str:
    """The outcome in a sentence or two."""
    if found.verdict == "different":
        if found.first is None:
            return f"Different arms{_within(found, units)}."
        return f"Different arms: {difference(found.first, a, b, units, names)}."
    if found.verdict == "identical":
        return "Identical: equal joint values give equal poses."
    facts = mapping(found, a, units)
    words = "The same arm" if found.verdict == "same" else f"Nearly the same arm{_within(found, units)}"
    return f"{words}: {'; '.join(facts)}." if facts else f"{words}."


def _within(found: Comparison, units: Units) -> str:
    if found.position is None or found.rotation is None:
        return ""
    return (
        f", with poses up to {units.lengths.value(found.position)} and {units.angles.value(found.rotation)} apart"
    )


def allowing(found: Comparison, units: Units = DEFAULT_UNITS) -> tuple[str, str] | None:
    """The tolerance that would take different arms for one, rounded up: a length and an angle, without units.

    None where the arms are the same, or differ by more than rounded numbers can.
    """
    if found.is_same or found.position is None or found.rotation is None:
        return None
    length, angle = (
        _rounded_up(value, unit)
        for value, unit in ((found.position, units.lengths), (found.rotation, units.angles))
    )
    return length, angle


def nearly(found: Comparison, units: Units = DEFAULT_UNITS) -> str:
    """Within what different arms are the same, in a sentence; "" where there is no `allowing` tolerance."""
    allowed = allowing(found, units)
    if allowed is None:
        return ""
    length, angle = allowed
    return f"They are the same within {length}{units.lengths.suffix} and {angle}{units.angles.suffix}."


def _rounded_up(value: float, unit: Unit) -> str:
    """A value as a number with the decimals of a tenth of a degree or of a millimetre, not less than it is."""
    decimals = unit.decimals(1)
    steps = max(math.ceil(value * unit.scale * 10.0**decimals), 1)
    return f"{steps / 10.0**decimals:.{decimals}f}"


def mapping(found: Comparison, a: Robot, units: Units = DEFAULT_UNITS) -> list[str]:
    """What separates two descriptions of one arm: joints that count otherwise, base, tool."""
    if found.mapping is None:
        return []
    facts = []
    for i, (sign, offset) in enumerate(
        zip(found.mapping.signs.tolist(), found.mapping.offsets.tolist(), strict=True)
    ):
        zero = units.of(bool(a.revolute[i])).text(offset) if offset else ""
        if sign < 0.0 and zero:
            facts.append(f"joint {i + 1} counts the other way, from {zero}")
        elif sign < 0.0:
            facts.append(f"joint {i + 1} counts the other way")
        elif zero:
            facts.append(f"joint {i + 1} counts from {zero}")
    for name, T in (("base", found.mapping.base), ("tool", found.mapping.tool)):
        if not np.array_equal(T, np.eye(4)):
            facts.append(f"the {name} is {_motion(T, units)}")
    return facts


def _motion(T: Array, units: Units) -> str:
    """A rigid motion: how far it shifts, and how far it turns."""
    distance = float(np.linalg.norm(T[:3, 3]))
    angle = math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(T[:3, :3])) - 1.0))))
    parts = []
    if distance > 1e-6:
        parts.append(f"shifted by {units.lengths.value(distance)}")
    if angle > 1e-6:
        parts.append(f"turned by {units.angles.value(angle)}")
    return " and ".join(parts) or "another"


def difference(found: Difference, a: Robot, b: Robot, units: Units = DEFAULT_UNITS, names: Names = NAMES) -> str:
    """A quantity of the axes that differs, without a full stop."""
    one, other = names
    if found.quantity == "count":
        return f"{one} has {a.n} joints and {other} has {b.n}"
    if found.quantity == "kind":
        return f"joint {found.joints[0] + 1} is {found.in_a} in {one} and {found.in_b} in {other}"
    if found.quantity == "direction":
        return f"the axis of joint {found.joints[0] + 1} lies differently relative to those before it"
    unit = units.of(found.quantity == "twist")
    in_a, in_b = _distinct_texts(float(found.in_a or 0.0), float(found.in_b or 0.0), unit)
    if found.quantity == "offset":
        joint = found.joints[0] + 1
        normals = f"along the axis of joint {joint}, its two common normals"
        return f"{normals} are {in_a} apart in {one} and {in_b} in {other}"
    first, second = (joint + 1 for joint in found.joints)
    what = "at an angle of" if found.quantity == "twist" else "at a distance of"
    return f"the axes of joints {first} and {second} are {what} {in_a} in {one} and {in_b} in {other}"


def _distinct_texts(one: float, other: float, unit: Unit) -> tuple[str, str]:
    """Two values with as many decimals as tell them apart, one at least."""
    texts = unit.text(one), unit.text(other)
    for digits in range(2, _MOST_DIGITS + 1):
        if abs(one - other) * unit.scale >= 10.0 ** (1 - unit.decimals(digits)):
            break
        texts = unit.text(one, digits), unit.text(other, digits)
    return texts


def explanation(found: Explanation, a: Robot, b: Robot, units: Units = DEFAULT_UNITS) -> str:
    """The mistakes, and what is left when they are undone."""
    changes = ", and ".join(change(each, b, units) for each in found.changes)
    if found.mapping.is_trivial and found.is_exact:
        left = "equal joint values then give equal poses"
    elif found.mapping.is_trivial:
        apart = f"{units.lengths.value(found.position)} and {units.angles.value(found.rotation)}"
        left = f"equal joint values then give poses up to {apart} apart"
    else:
        left = "it is then the same arm, but " + "; ".join(mapping(Comparison("same", found.mapping), a, units))
    return f"Likely {changes}; {left}."


def change(found: Change, b: Robot, units: Units = DEFAULT_UNITS) -> str:
    """One mistake, without a full stop and beginning in lower case."""
    where = _place(found)
    numbers = ""
    if found.was is not None and found.now is not None and found.columns:
        numbers = _numbers(found.was, found.now, units.of(found.columns[0] in ("theta", "alpha")))
    other = "modified (Craig's)" if b.convention == "standard" else "standard"
    words = {
        "convention": f"the table is in the {other} convention",
        "degrees": f"{where} was typed in degrees where radians are expected",
        "radians": f"{where} was typed in radians where degrees are expected",
        "millimetres": f"{where} was typed in millimetres where metres are expected",
        "metres": f"{where} was typed in metres where millimetres are expected",
        "centimetres": f"{where} was typed in another unit of length",
        "sign": f"{where} has the wrong sign",
        "quarter turn": f"{where} is a quarter turn off",
        "half turn": f"{where} is half a turn off",
        "offset": f"{where} has an offset too many",
        "twist": f"{where} is wrong",
        "exchanged": f"{where} are exchanged",
        "shifted": f"{where} was typed one row too early or too late",
        "typed twice": f"{where} was typed twice",
        "superfluous row": f"{where} is superfluous",
        "missing row": f"a row is missing before row {found.rows[0] + 1}" if found.rows else "a row is missing",
        "rows exchanged": f"{where} are exchanged",
        "kind": f"{where} has the wrong kind of joint",
        "decimal point": f"{where} has its decimal point in the wrong place",
        "base": f"the base transform {_left_out(b.T_world_base)}",
        "tool": f"the tool transform {_left_out(b.T_last_tool)}",
        "value": f"{where} is wrong",
    }
    return words[found.mistake] + numbers


def _numbers(was: float, now: float, unit: Unit) -> str:
    """A cell after and before a change, with as many digits as tell the two apart."""
    for digits in range(_FEWEST, _MOST_SHOWN + 1):
        after, before = unit.brief(now, digits), unit.brief(was, digits)
        if after != before:
            break
    return f" ({after}, not {before})"


def _left_out(T: Array) -> str:
    """What is wrong with a transform of table b: there is none, or another one."""
    return "was left out" if np.array_equal(T, np.eye(4)) else "is wrong"


def _place(found: Change) -> str:
    """The cells that a change names."""
    columns = " and ".join(_SYMBOLS[column] for column in found.columns)
    if found.rows and found.columns:
        return f"{columns} of row {found.rows[0] + 1}"
    if found.rows:
        return " and ".join(f"row {row + 1}" for row in found.rows)
    return f"the column{'s' if len(found.columns) > 1 else ''} {columns}"
