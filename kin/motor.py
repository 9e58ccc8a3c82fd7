"""The motor of a joint, and what it reads.

A motor counts in a unit of its own, from a zero of its own, and perhaps backwards: its reading is
``offset + sign · q`` with the joint value q in that unit. Between a model and a real arm, a wrong sign or zero is
what is wrong most often; `kin.motors` converts between readings and joint values, and finds sign and zero from a
few poses.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from kin.errors import InputError, finite_number, one_of, whole_number

MotorUnit = Literal["deg", "rad", "ticks", "range_m100_100", "range_0_100"]
MOTOR_UNITS: tuple[MotorUnit, ...] = get_args(MotorUnit)
CALIBRATED = {
    "range_m100_100": 200.0,
    "range_0_100": 100.0,
}  # from one end of LeRobot's calibrated range to the other
STS3215 = 4096  # ticks of a turn of Feetech's servo
MOST_TICKS = 2**24  # of a turn
LARGEST_ID = 2**29 - 1  # of a CAN frame; servos on a serial bus have less


@dataclass(frozen=True, slots=True)
class Motor:
    """What the motor of a joint reads: ``offset + sign · q``, with q in `unit`; for conversions see `kin.motors`.

    Attributes:
        joint: name of the row that it moves; "" for a motor that moves none of them, such as that of a gripper.
        id: its number on the bus.
        name: what its bus calls it; by default the name of the joint.
        sign: 1, or −1 for a motor that counts backwards.
        offset: its reading where the joint value is zero, in `unit`.
        unit: "deg"; "rad"; "ticks", which count from 0 in each turn; or LeRobot's calibrated range, from −100 to
            100 ("range_m100_100") or from 0 to 100 ("range_0_100").
        ticks: of one turn; 4096 for Feetech's STS3215.
        lead: metres that a slide moves in one turn; None for a joint that turns.
        range: ticks at the two ends of LeRobot's calibrated range, None if it is not calibrated.
        drive_mode, homing_offset: as LeRobot's calibration states them. The servo subtracts its homing offset
            itself; a drive mode of 1 turns the calibrated range round.

    Raises:
        InputError: a field that is not as described.
    """

    joint: str
    id: int
    name: str = ""
    sign: int = 1
    offset: float = 0.0
    unit: MotorUnit = "deg"
    ticks: int = STS3215
    lead: float | None = None
    range: tuple[int, int] | None = None
    drive_mode: int = 0
    homing_offset: int = 0

    def __post_init__(self) -> None:
        """Check the fields; the name of the joint is the default of `name`."""
        for key in ("joint", "name"):
            if not isinstance(getattr(self, key), str):
                raise InputError(key, getattr(self, key), "a text")
        object.__setattr__(self, "name", self.name or self.joint)
        if not self.name:
            raise InputError("name", self.name, "a name for a motor that moves no joint of the arm")
        object.__setattr__(self, "id", whole_number("id", self.id, 0, LARGEST_ID))
        if isinstance(self.sign, bool) or self.sign not in (1, -1):
            raise InputError("sign", self.sign, "1 or -1")
        object.__setattr__(self, "sign", int(self.sign))
        object.__setattr__(self, "offset", finite_number("offset", self.offset))
        if not isinstance(self.unit, str) or self.unit not in MOTOR_UNITS:
            raise InputError("unit", self.unit, one_of(*MOTOR_UNITS))
        object.__setattr__(self, "ticks", whole_number("ticks", self.ticks, 2, MOST_TICKS))
        if self.lead is not None:
            if not (lead := finite_number("lead", self.lead)) > 0.0:
                raise InputError("lead", self.lead, "a positive length, or None for a joint that turns")
            object.__setattr__(self, "lead", lead)
        if self.range is not None:
            try:
                low, high = (whole_number("range", end, -(2**31), 2**31) for end in self.range)
            except (TypeError, ValueError):
                raise InputError("range", self.range, "two whole numbers of ticks, the lower one first") from None
            if low >= high:
                raise InputError("range", self.range, "two whole numbers of ticks, the lower one first")
            object.__setattr__(self, "range", (low, high))
        elif self.unit in CALIBRATED:
            raise InputError("range", None, f"the two ends in ticks, because the unit is {self.unit}")
        object.__setattr__(self, "drive_mode", whole_number("drive_mode", self.drive_mode, 0, 1))
        object.__setattr__(
            self, "homing_offset", whole_number("homing_offset", self.homing_offset, -(2**31), 2**31)
        )

    @property
    def turn(self) -> float:
        """Its readings of one turn, in `unit`."""
        if self.range is not None and (span := CALIBRATED.get(self.unit)):
            return span * self.ticks / (self.range[1] - self.range[0])
        return {"deg": 360.0, "rad": 2.0 * math.pi, "ticks": float(self.ticks)}[self.unit]

    @property
    def scale(self) -> float:
        """Its readings of one radian of the joint, or of one metre of a slide."""
        return self.turn / (2.0 * math.pi if self.lead is None else self.lead)

    @property
    def begins_again(self) -> bool:
        """Whether readings that differ by whole turns may be of one joint value."""
        return self.lead is None and self.unit not in CALIBRATED


def checked_motors(motors: object) -> tuple[Motor, ...]:
    """Motors of one arm as a tuple; raises `InputError` for what is no motor, and for two of one id."""
    found = tuple(motors) if isinstance(motors, Iterable) else (motors,)
    ids: set[int] = set()
    for i, motor in enumerate(found):
        if not isinstance(motor, Motor):
            raise InputError(f"motors[{i}]", motor, "a Motor")
        if motor.id in ids:
            raise InputError(f"motors[{i}].id", motor.id, "an id that no other motor has")
        ids.add(motor.id)
    return found


def fit_joints(motors: Sequence[Motor], slides: Mapping[str, bool]) -> None:
    """Check that motors fit the joints of an arm.

    Args:
        motors: of the arm.
        slides: the names of its moving joints, and whether they slide.

    Raises:
        InputError: a joint that the arm has not, no lead for a slide, or one for another joint; the field is
            ``motors[2].joint``, say.
    """
    for i, motor in enumerate(motors):
        where = f"motors[{i}]"
        if motor.joint and motor.joint not in slides:
            raise InputError(f"{where}.joint", motor.joint, "a moving joint: " + ", ".join(slides))
        slide = slides.get(motor.joint, False)
        if slide and motor.lead is None:
            raise InputError(f"{where}.lead", None, "how far the slide moves in one turn of the motor")
        if not slide and motor.lead is not None:
            raise InputError(f"{where}.lead", motor.lead, "none, because the joint does not slide")
