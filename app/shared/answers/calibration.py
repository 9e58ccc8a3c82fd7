"""Postures to touch in, and the table of an arm from touches."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from app.shared.answers.answer import Answer, From
from app.shared.answers.fk import Matrix
from kin import robot_to_dict


class ExpectedErrorAnswer(Answer):
    """Expected error of the tip: its root mean square over the workspace, after the best motion of the base."""

    before: float
    """With the nominal table, in metres, if its errors are as large as the tolerances, or as the wider ones that
    the touches ask for."""
    after: float
    """With the touches, in metres."""
    bound: float
    """What 95 % are expected to stay below, in metres; measured on simulated arms only."""
    readings: float
    """What the noise of readings alone does, in metres; no table mends it."""


class TouchPlanAnswer(Answer):
    """The postures in which to touch."""

    text: str
    """What they are expected to bring, in words."""
    q: list[list[float]]
    """Configurations of the nominal arm in radians (metres), each near the one before."""
    sockets: list[int]
    """What is touched in each: the number of a socket from 0, or -1 for the plane."""
    places: list[Matrix]
    """Where the boards are to lie, 4×4 in the world frame; some centimetres beside is as good."""
    table: float
    """Height of the table in the world frame, in metres."""
    expected: ExpectedErrorAnswer
    """How far the tip is expected to be off."""
    advice: str
    """What would be better; empty if nothing is known that would."""


class TableErrorAnswer(Answer):
    """An error of the table or the tool point."""

    text: str
    """It in words."""
    row: str
    """Name of the row; empty for the tool point and the common scale."""
    field: str
    """theta, d, a, alpha or beta (a tilt about y) of the row; sin or cos of the wave of its encoder; x, y or z of
    the tool point; scale."""
    kind: Literal["zero", "length", "twist", "tip", "scale", "wave"]
    """Which tolerance it has."""
    value: float
    """What comes to the nominal value: radians, metres, or a share of all lengths."""
    interval: float
    """Half of the 95 % interval."""
    seen: bool
    """Whether the touches have shown it."""
    unseen: str
    """Why not: alike if other errors move the tip in the same way, hidden if the touches hardly depend on it."""
    in_motor: bool
    """Whether it is in the offset of a motor and not in the table."""


class TouchFaultAnswer(Answer):
    """A mistake in the touches."""

    text: str
    """It in words."""
    touch: int | None
    """Index of the touch, which was left out; null if all touches are meant, for which it was undone."""
    cause: Literal["place", "swap", "sign", "socket", "zero"]
    """place: the tip was beside it. swap: two readings are exchanged. sign: a joint counts backwards. socket:
    another one was touched. zero: that of a joint is far off."""
    joints: list[str]
    """The joints that it is about."""
    value: float
    """Metres beside the socket, or radians that a zero is off; 0 for other causes."""
    socket: int | None
    """The one that was probably touched; null for other causes."""
    in_motors: bool
    """Whether the motors of the arm found make up for it: another sign, joints exchanged."""


class CalibrationAnswer(Answer):
    """The table of an arm from touches."""

    text: str
    """The outcome in words."""
    expected: ExpectedErrorAnswer
    """How far the tip is expected to be off."""
    errors: list[TableErrorAnswer]
    """Of the table and the tool point, in the order of the rows."""
    faults: list[TouchFaultAnswer]
    """Touches that contradict the others, and mistakes of all touches."""
    unseen: list[str]
    """What cannot be seen, and why."""
    kept: list[int]
    """Indices of the touches that were used."""
    misses: list[float]
    """Distance of each touch from what it touched, with the table found, in metres."""
    held_out: list[float | None]
    """Root mean square distance by which touches miss that the fit did not use, in metres: with the nominal table,
    and with the one found; null if each is alone on its board."""
    noise: float
    """How large the noise was, as a multiple of the stated one, 1 or more."""
    wider: float
    """By what factor the tolerances were taken to be wider than stated, 1 to 3."""
    places: list[Matrix]
    """Where the boards are, 4×4 in the world frame."""
    zeros: list[float]
    """What is in the offsets of motors and not in the table, in radians."""
    waves: list[list[float]]
    """Of each joint, what comes to a reading q: the first times sin q, the second times cos q, in radians."""
    advice: str
    """What would help; empty if nothing is known that would."""
    robot: Annotated[dict[str, Any], From(lambda found: robot_to_dict(found.robot))]
    """The arm with its own table, as the fields of a robot file."""
