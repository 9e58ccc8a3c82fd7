"""Angles that were probably typed in the other unit: radians in a file of degrees, or the other way round."""

from __future__ import annotations

import math

from kin.robot import Joint, Robot
from kin.units import general

_DEGREE = math.pi / 180.0
_NEAR = 2e-3  # of a right or half a right angle in radians, with two decimals
_TURNS = 2.0 * math.pi + 0.01
_ROUND = 5.0  # degrees: what people type are multiples of it


def suspicious_angles(robot: Robot) -> list[str]:
    """A sentence for each angle of the rows that makes sense in the other unit only.

    Examples:
        >>> import kin
        >>> arm = kin.Robot.from_dh([(0.0, 0.0, 0.5, 0.0274), (0.0, 0.0, 0.3, 0.0)])
        >>> suspicious_angles(arm)
        ['alpha of row 1 (joint 1) is 1.5699°, and 1.5699 rad is 90°: it was probably typed in radians.']
    """
    found = []
    turning = [row for row in robot.rows if row.kind == "revolute" and row.limits is not None]
    # Limits that all are within ±2π degrees: no arm is made of joints that hardly turn.
    tiny = len(turning) > 1 and all(_extent(row) <= _TURNS * _DEGREE for row in turning)
    for number, row in enumerate(robot.rows, 1):
        where = f"row {number} ({row.name})"
        found += [words for key in ("theta", "alpha") if (words := _odd(f"{key} of {where}", getattr(row, key)))]
        if row.kind == "revolute" and row.limits is not None:
            found += _odd_limits(row, where, tiny)
        if row.kind == "revolute" and row.velocity is not None and _is_typed_radians(row.velocity):
            found.append(
                f"velocity of {where} is {general(row.velocity / _DEGREE, 5)}°/s, and "
                f"{general(row.velocity / _DEGREE, 5)} rad/s is {_degrees(row.velocity / _DEGREE)}/s: "
                "it was probably typed in radians."
            )
    return found


def _odd(what: str, value: float) -> str:
    """Why an angle in radians was probably typed in the other unit; empty if it was not."""
    if _is_typed_radians(value):
        number, meant = general(value / _DEGREE, 5), _degrees(value / _DEGREE)
        return f"{what} is {number}°, and {number} rad is {meant}: it was probably typed in radians."
    if _is_typed_degrees(value):
        number, turns = general(value, 5), general(value / (2.0 * math.pi), 3)
        return f"{what} is {number} rad, {turns} turns: it was probably typed in degrees."
    return ""


def _odd_limits(row: Joint, where: str, tiny: bool) -> list[str]:
    assert row.limits is not None
    if tiny or (all(map(_is_typed_radians, row.limits))):
        low, high = (general(value / _DEGREE, 5) for value in row.limits)
        return [f"limits of {where} are {low}° to {high}°: they were probably typed in radians."]
    if any(map(_is_typed_degrees, row.limits)):
        low, high = (general(value, 5) for value in row.limits)
        return [f"limits of {where} are {low} to {high} rad: they were probably typed in degrees."]
    return []


def _is_typed_radians(value: float) -> bool:
    """Whether the number of degrees is a multiple of π/4, up to two turns."""
    number = abs(value) / _DEGREE
    eighths = round(number / (0.25 * math.pi))
    return 1 <= eighths <= 16 and abs(number - eighths * 0.25 * math.pi) <= _NEAR


def _is_typed_degrees(value: float) -> bool:
    """Whether the number of radians is beyond a turn, and one that is typed as degrees."""
    return abs(value) > _TURNS and abs(value / _ROUND - round(value / _ROUND)) < 1e-9


def _degrees(radians: float) -> str:
    return f"{general(round(radians / _DEGREE / 45.0) * 45.0)}°"


def _extent(row: Joint) -> float:
    return max(map(abs, row.limits or (0.0,)))
