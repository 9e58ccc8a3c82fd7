"""Joints, joint values and ranges as parts of a sentence."""

from __future__ import annotations

from collections.abc import Sequence

from kin.ik.details import LimitViolation
from kin.units import Units


def joint(index: int, name: str) -> str:
    """A joint: its number, and its name if it has another one, e.g. ``"joint 2 (shoulder)"``."""
    number = f"joint {index + 1}"
    return number if name.lower() in (number, str(index + 1)) else f"{number} ({name})"


def joint_value(kind: str, value: float, units: Units) -> str:
    """A value of a joint, or a motion of it (radians or metres)."""
    return units.of(kind == "revolute").value(value)


def need(violation: LimitViolation, units: Units) -> str:
    """A joint value outside the limits, e.g. ``"joint 2 at 100.0° (limit 90.0°)"``.

    Where both would be written alike, how far apart they are: ``"joint 2 3.1e-03° from its limit 90.0°"``.
    """
    bound = "locked at" if violation.locked else "limit"
    value, limit = (joint_value(violation.kind, x, units) for x in (violation.value, violation.limit))
    if value == limit:
        apart = joint_value(violation.kind, abs(violation.value - violation.limit), units)
        place = "where it is locked," if violation.locked else "its limit"
        return f"{joint(violation.joint, violation.name)} {apart} from {place} {limit}"
    return f"{joint(violation.joint, violation.name)} at {value} ({bound} {limit})"


def ranges(intervals: Sequence[tuple[float, float]], units: Units) -> str:
    """Ranges of an angle, e.g. ``"-20.0° … 35.5°, 80.0° … 90.0°"``."""
    angle = units.angles.value
    return ", ".join(f"{angle(low)} … {angle(high)}" for low, high in intervals)


def count(number: int, one: str, many: str) -> str:
    """A number of things, the number one as a word: ``"one posture"``, ``"3 postures"``."""
    return f"one {one}" if number == 1 else f"{number} {many}"


def numbered(joints: Sequence[int]) -> str:
    """Joints by number: ``"joint 1"``, ``"joints 1 and 3"``."""
    return f"joint{'s' * (len(joints) > 1)} {listed([str(i + 1) for i in joints])}"


def are(things: Sequence[object]) -> str:
    """The verb of one thing or of several."""
    return "is" if len(things) == 1 else "are"


def listed(parts: Sequence[str]) -> str:
    """Parts of a list in words: ``"a"``, ``"a and b"``, ``"a, b and c"``."""
    *most, last = parts
    return f"{', '.join(most)} and {last}" if most else last
