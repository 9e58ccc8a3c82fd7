"""What a calibration has found, in words."""

from __future__ import annotations

import math

from kin.calibration.results import Calibration, ExpectedError, TableError, TouchFault
from kin.ik.messages.values import listed
from kin.units import fixed

_FIELDS = {
    "theta": "θ",
    "d": "d",
    "a": "a",
    "alpha": "α",
    "beta": "tilt β",
    "sin": "wave (sine)",
    "cos": "wave (cosine)",
}
_SEVERAL = 2.0  # times the stated noise: worth a sentence


def millimetres(metres: float) -> str:
    """A small length, with as many digits as are worth it."""
    value = 1000.0 * metres
    return f"{fixed(value, 2 if abs(value) < 1.0 else 1)} mm"


def degrees(radians: float) -> str:
    """A small angle."""
    return f"{fixed(math.degrees(radians), 2)}°"


def name_of(error: TableError) -> str:
    """What an error is of."""
    if error.kind == "scale":
        return "all lengths"
    if error.kind == "tip":
        return f"tip, {error.field}"
    return f"{error.row}, {'zero' if error.kind == 'zero' else _FIELDS[error.field]}"


def error_text(error: TableError) -> str:
    """An error of the table with its 95 % interval."""
    if error.kind == "scale":
        value, interval = f"{fixed(100.0 * error.value, 2)} %", f"{fixed(100.0 * error.interval, 2)} %"
    else:
        write = millimetres if error.kind == "tip" or error.field in ("d", "a") else degrees
        value, interval = write(error.value), write(error.interval)
    sign = "" if error.value < 0.0 else "+"
    text = f"{name_of(error)}: {sign}{value} ± {interval}"
    if error.in_motor:
        text += ", in the offset of its motor"
    if error.unseen:
        text += "; not seen: " + (
            "other errors move the tip alike" if error.unseen == "alike" else "these touches hardly depend on it"
        )
    return text


def fault_text(fault: TouchFault, socket: int) -> str:
    """A mistake, and what was done about it; `socket` is what was to be touched."""
    who = "In all touches" if fault.touch is None else f"In touch {fault.touch + 1}"
    joints = listed(fault.joints) if fault.joints else ""
    done = "It was left out."
    if fault.in_motors:
        done = "The motors of the arm found make up for it."
    elif fault.touch is None:
        done = "The table is that of corrected readings: correct yours too before you use it."
    match fault.cause:
        case "swap":
            return f"{who}, the readings of {joints} are exchanged. {done}"
        case "sign":
            return f"{who}, {joints} counts backwards. {done}"
        case "zero":
            return f"{who}, the zero of {joints} is off by {degrees(fault.value)}. The result makes up for it."
        case "socket":
            assert fault.socket is not None
            return f"{who}, socket {fault.socket + 1} was touched, not {socket + 1}. {done}"
    where = "the plane" if socket < 0 else f"socket {socket + 1}"
    touch, beside = (fault.touch or 0) + 1, millimetres(fault.value)
    return f"Touch {touch} does not fit the others: the tip was {beside} beside {where}. {done}"


def expected_text(expected: ExpectedError, count: int) -> str:
    """What touches are expected to bring, before the first one."""
    before, after, bound, readings = map(
        millimetres, (expected.before, expected.after, expected.bound, expected.readings)
    )
    return (
        f"With the nominal table, the tip is expected to be off by {before}. {count} touches are expected to "
        f"bring {after} (95 %: below {bound}). The noise of readings alone moves the tip by {readings}."
    )


def outcome(found: Calibration, count: int) -> str:
    """The whole result in a few sentences."""
    first, *rest = remarks(found, count)
    return " ".join([first, *(fault.text for fault in found.faults), *rest])


def remarks(found: Calibration, count: int) -> list[str]:
    """The result of so many touches, without the mistakes in them, a sentence or two each."""
    before, after, bound = map(millimetres, (found.expected.before, found.expected.after, found.expected.bound))
    lines = [f"The tip is expected to be off by {after} (95 %: below {bound}), from {before}."]
    if not math.isnan(found.held_out[1]):
        nominal, held_out = map(millimetres, found.held_out)
        lines.append(f"Touches that the fit did not use miss by {held_out}; with the nominal table by {nominal}.")
    if found.noise >= _SEVERAL:
        lines.append(
            f"The touches scatter {fixed(found.noise, 1)} times as much as stated: play, bending or a loose "
            "board, which no table mends."
        )
    if found.wider > 1.0:
        wider = fixed(found.wider, 1)
        lines.append(f"Errors are larger than the tolerances, which were taken to be {wider} times as wide.")
    if len(found.kept) < count:
        lines.append(f"{len(found.kept)} of {count} touches were used.")
    lines += found.unseen
    if found.advice:
        lines.append(found.advice)
    return lines
