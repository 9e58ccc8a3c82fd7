"""Signs and zeros of motors, from readings in poses."""

from __future__ import annotations

from typing import Annotated

from app.shared.answers.answer import Answer, From
from app.shared.answers.robots import MotorAnswer
from kin.motor import MotorUnit
from kin.motors.findings import MotorCause, MotorStatus


class MotorFindingAnswer(Answer):
    """What the readings say of one motor."""

    text: str
    """It in a sentence."""
    motor: MotorAnswer
    """With the sign and zero that were found, or as it was."""
    status: MotorStatus
    """matched; undecided if both signs fit; contradiction if none does."""
    cause: MotorCause | None
    """Why it is not matched; null if it is."""
    error: list[float]
    """How far the joint values of the readings are from the poses, in radians or metres."""
    moved: float
    """The largest difference of the joint between two poses, in radians or metres."""
    read: float
    """The difference of its readings between the same two poses, in the same unit."""
    unit: MotorUnit | None
    """The unit that the readings fit, if that is the cause."""
    other: Annotated[int | None, From(lambda found: None if found.other is None else found.other.id)]
    """The number of the motor whose joint the readings fit, if that is the cause."""
    pose: int | None
    """Index of the pose that does not fit, if that is the cause."""
    gear: float | None
    """Turns of the motor in a turn of the joint, if that is the cause."""


class MotorMatchAnswer(Answer):
    """What the readings say of all motors."""

    complete: bool
    """Whether all motors match."""
    findings: list[MotorFindingAnswer]
    """One of each motor that moves a joint, in their order."""
    motors: list[MotorAnswer]
    """All motors, those that match with their sign and zero."""
