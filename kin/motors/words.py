"""What has been found of a motor, as a sentence."""

from __future__ import annotations

import math

from kin.motor import Motor
from kin.motors.findings import MotorFinding
from kin.units import fixed, general

_UNITS = {
    "deg": "degrees",
    "rad": "radians",
    "ticks": "ticks",
    "range_m100_100": "the range from −100 to 100",
    "range_0_100": "the range from 0 to 100",
}


def sentence(found: MotorFinding) -> str:
    """The finding on one motor in words, and what to do if it is not matched."""
    motor = found.motor
    who = f"Motor {motor.id}, {motor.joint},"
    joint, slides = f"the joint {motor.joint}", motor.lead is not None
    moved, read = _way(found.moved, slides), _way(found.read, slides)
    if found.status == "matched":
        way = "counts backwards" if motor.sign < 0 else "counts as the joint does"
        return f"{who} {way}, its zero is at {_zero(motor)}."
    match found.cause:
        case "still":
            return (
                f"{who} cannot be matched: {joint} differs by only {moved} between the poses. "
                "Move it further, so that it is clear which way the motor counts."
            )
        case "half turn":
            return (
                f"{who} cannot be matched: between the poses, {joint} turns by {moved}, after which both ways of "
                "counting read nearly the same. Take a pose between them."
            )
        case "no change":
            return (
                f"{who} contradicts the poses: {joint} moves by {moved}, and the reading changes by {read} only. "
                "Either this motor is not the one of the joint, or it does not send its position."
            )
        case "unit":
            return f"{who} seems to read {_UNITS[found.unit or '']}, not {_UNITS[motor.unit]}."
        case "other motor":
            assert found.other is not None
            return (
                f"{who} contradicts the poses: its readings fit the joint {found.other.joint}. "
                f"Are motors {motor.id} and {found.other.id} exchanged?"
            )
        case "pose":
            assert found.pose is not None
            return (
                f"{who} contradicts itself: pose {found.pose + 1} does not fit the others. "
                f"Look whether {joint} is as shown there, and read again."
            )
        case "gear":
            assert found.gear is not None
            return (
                f"{who} turns {general(found.gear, 3)} times as far as {joint}: "
                "there is a gear between them, or a turn has another number of ticks."
            )
    return (
        f"{who} contradicts itself: {joint} moves by {moved} between two poses, and the reading changes by "
        f"{read}. Look whether the joint is as shown, and read again."
    )


def _way(value: float, slides: bool) -> str:
    return f"{fixed(1000.0 * value, 1)} mm" if slides else f"{fixed(math.degrees(value), 1)}°"


def _zero(motor: Motor) -> str:
    """The reading at zero in the unit of the motor, ticks as an angle as well."""
    if motor.unit == "deg":
        return f"{fixed(motor.offset, 1)}°"
    if motor.unit == "rad":
        return f"{fixed(motor.offset, 3)} rad"
    if motor.unit == "ticks":
        return f"{fixed(motor.offset, 0)} ticks ({fixed(360.0 * motor.offset / motor.ticks, 1)}°)"
    return fixed(motor.offset, 1)
