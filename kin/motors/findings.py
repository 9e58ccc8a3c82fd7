"""What `match_motors` finds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from kin.motor import Motor, MotorUnit

MotorStatus = Literal["matched", "undecided", "contradiction"]
MotorCause = Literal["still", "half turn", "no change", "unit", "other motor", "pose", "gear", "readings"]


@dataclass(frozen=True)
class MotorFinding:
    """What the readings say of one motor.

    Attributes:
        motor: with the sign and zero that were found, or as it was if none were.
        status: "matched"; "undecided" if both signs fit; "contradiction" if none does.
        cause: why it is not matched, None if it is: the joint stayed "still"; it turned a "half turn", after which
            both signs read the same; "no change" of the reading; the readings fit another "unit", or the joint of
            the "other motor"; one "pose" does not fit the others; the motor turns faster or slower, by a "gear";
            or none of these: "readings".
        error: how far the joint values of the readings are from the poses ``(k,)``, radians (metres). If nothing
            matches, with the sign that fits better.
        moved: the largest difference of the joint between two poses, radians (metres).
        read: the difference of its readings between the same two poses, in the same unit.
        unit: the unit that the readings fit, if the cause is "unit".
        other: the motor whose joint the readings fit, if the cause is "other motor".
        pose: index of the pose that does not fit, if the cause is "pose".
        gear: turns of the motor in a turn of the joint, if the cause is "gear".
        text: a sentence that says all this.
    """

    motor: Motor
    status: MotorStatus
    cause: MotorCause | None
    error: tuple[float, ...]
    moved: float
    read: float
    unit: MotorUnit | None = None
    other: Motor | None = None
    pose: int | None = None
    gear: float | None = None
    text: str = field(default="", repr=False)


@dataclass(frozen=True)
class MotorMatch:
    """What `match_motors` has found.

    Attributes:
        findings: one of each motor that moves a joint, in their order.
        motors: all motors, those that match with their sign and zero.
    """

    findings: tuple[MotorFinding, ...]
    motors: tuple[Motor, ...]

    @property
    def complete(self) -> bool:
        """Whether all motors match."""
        return all(finding.status == "matched" for finding in self.findings)
