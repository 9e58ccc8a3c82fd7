"""What a program may send to a page, and how it is read.

Each message is a JSON object; all its fields are optional. Values are checked against the arm on show, or the one
that the same message brings, before the page hears of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from app.api.arms.description import RobotDescription
from app.api.body import parsed
from app.api.options import ObstacleBody, Target
from app.api.problems import ProblemError, invalid
from app.api.program import DescribedBy, ProgramBody
from app.api.schemas import Body, Configuration, Vector3, Vector4, integral
from app.api.workspace.query import validated
from app.live import VALUES
from app.live.announced import Announcement, Button, State
from app.shared.problems import FieldError, show
from app.shared.store import Store
from kin import InputError, Robot, UnknownRobotError
from kin.collision.obstacles import MOST_OBSTACLES, checked_obstacles
from kin.motion import Program, program_from_dict
from kin.motors import q_from_readings
from kin.motors.joints import moving_motors, of_moving
from kin.poses import check_length
from kin.transforms import Array

MOST_BYTES = 64 * 1024  # of a message
MOST_POINTS = 2000  # of a drawing
MOST_RATE, USUAL_RATE = 60.0, 30.0  # messages a second that a program may ask for, and gets by default
LONGEST_NAME, LONGEST_LABEL = 60, 200  # characters
LONGEST_WORDS, LONGEST_BUTTON, MOST_BUTTONS = 300, 24, 4  # of what a program announces
SLACK = 1e-6  # rad or m beyond a limit: rounding of who computed the values

_Color = Annotated[str, Field(pattern="^#[0-9a-fA-F]{6}$")]
_Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME)]


class PointsDrawing(Body):
    """Points."""

    kind: Literal["points"] = Field(description="Points.")
    points: list[Vector3] = Field(
        min_length=1, max_length=MOST_POINTS, fail_fast=True, description="x, y, z in metres, in the world frame."
    )
    size: float = Field(0.01, ge=0.0005, le=0.2, strict=True, description="Their diameter in metres.")
    color: _Color = Field("#e8590c", description="As in CSS.")


class LineDrawing(Body):
    """A line through points."""

    kind: Literal["line"] = Field(description="A line through points.")
    points: list[Vector3] = Field(
        min_length=2, max_length=MOST_POINTS, fail_fast=True, description="x, y, z in metres, in the world frame."
    )
    width: float = Field(3.0, ge=0.5, le=20.0, strict=True, description="In pixels.")
    color: _Color = Field("#e8590c", description="As in CSS.")


def _unit(wxyz: list[float]) -> list[float]:
    try:
        check_length(wxyz)
    except InputError as error:
        raise ValueError(error.expected) from None
    return wxyz


class FrameDrawing(Body):
    """The three axes of a frame."""

    kind: Literal["frame"] = Field(description="Three axes.")
    position: Vector3 = Field(description="Its origin in metres, in the world frame.")
    wxyz: Annotated[Vector4, AfterValidator(_unit)] = Field(
        [1.0, 0.0, 0.0, 0.0], description="Its orientation as a quaternion w, x, y, z of length 1."
    )
    length: float = Field(0.1, ge=0.001, le=10.0, strict=True, description="Of an axis, in metres.")


class LabelDrawing(Body):
    """A text at a point."""

    kind: Literal["label"] = Field(description="A text.")
    position: Vector3 = Field(description="Where it is, in metres, in the world frame.")
    text: str = Field(min_length=1, max_length=LONGEST_LABEL, description="What it says.")


Drawing = Annotated[PointsDrawing | LineDrawing | FrameDrawing | LabelDrawing, Field(discriminator="kind")]


class AnnouncedButton(Body):
    """What the visitor can ask of the program."""

    name: str = Field(
        pattern="^[a-z][a-z0-9_-]{0,31}$", description="Its name, which the program hears when it is pressed."
    )
    label: str = Field(min_length=1, max_length=LONGEST_BUTTON, description="What the page writes on it.")
    confirm: str | None = Field(
        None,
        min_length=1,
        max_length=LONGEST_WORDS,
        description="What happens then: the page shows this sentence, and asks before it passes the press on.",
    )
    stops: bool = Field(
        False,
        strict=True,
        description="true: it stops something. It can be pressed at once, in a class that is frozen, too, and is "
        "in the red frame of `drives`.",
    )


class Announced(Body):
    """What the program says of itself in the status card, and the buttons there."""

    words: str = Field(min_length=1, max_length=LONGEST_WORDS, description="One sentence.")
    state: State = Field(
        "ready",
        description="ready: nothing moves. enabled: what the page shows is followed. stopped: no longer, and the "
        "sentence says why. fault: what is wrong.",
    )
    buttons: list[AnnouncedButton] = Field([], max_length=MOST_BUTTONS, description="Each with a name of its own.")


class Subscription(Body):
    """What the program wants to hear."""

    values: list[Literal["q", "gripper", "target", "result", "contacts", "program"]] = Field(
        max_length=len(VALUES),
        description="q: the configuration on show. gripper: how far the gripper is open, from 0 (closed) to 1 "
        "(open), null for an arm without one that opens. target: the pose that the arm is asked for, null while "
        "it follows the tool. result: the last answer of inverse kinematics. contacts: what the arm touches. "
        "program: the program of the tab Program, and where it is.",
    )
    rate: float = Field(
        USUAL_RATE, ge=0.1, le=MOST_RATE, strict=True, description="At most so many messages a second."
    )


def _robot_tag(value: object) -> str:
    return "sent" if isinstance(value, dict) else "id"


class LiveMessage(Body):
    """A message of a program. Of each field the page uses the newest value."""

    id: Annotated[int, Field(strict=True, ge=0, le=2**53), BeforeValidator(integral)] | None = Field(
        None, description="A number of the program's: the page answers `done`, or a problem, with the same one."
    )
    subscribe: Subscription | None = Field(None, description="What the program wants to hear, in place of before.")
    robot: (
        Annotated[
            Annotated[str, Field(max_length=100), Tag("id")] | Annotated[RobotDescription, Tag("sent")],
            Discriminator(_robot_tag),
        ]
        | None
    ) = Field(None, description="Another arm: an id of this service, or the fields of a robot file.")
    obstacles: list[ObstacleBody] | None = Field(
        None, max_length=MOST_OBSTACLES, description="All obstacles of the page."
    )
    program: Annotated[dict[str, Any], DescribedBy(ProgramBody)] | None = Field(
        None, description="A program for the tab Program, in place of the one that is there."
    )
    play: Annotated[bool, Field(strict=True)] | None = Field(
        None, description="true: play the program of the page from its beginning; false: stop."
    )
    q: Configuration | None = Field(
        None, description="The configuration, in radians (metres for sliding joints), within the limits."
    )
    gripper: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] | None = Field(
        None, description="How far the gripper is open, a part of its range: 0 is closed, 1 open."
    )
    target: Target | None = Field(
        None,
        description="The pose that the arm is asked for, in the world frame. The page solves it as if it had been "
        "dragged there; a position alone keeps the orientation.",
    )
    measured: Configuration | None = Field(
        None,
        description="Where a real arm is, drawn as a ghost beside the commanded one; null removes it. It may be "
        "outside the limits.",
    )
    measured_gripper: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] | None = Field(
        None,
        description="How far the gripper of a real arm is open, a part of its range: 0 is closed, 1 open. Beside "
        "`measured` in the tab Program; null removes it.",
    )
    readings: Configuration | None = Field(
        None,
        description="What the motors of a real arm read, one of each motor that moves a joint, or of every motor, "
        "in their order and units. The page shows the arm as `measured`, and *Match motors* takes them; null "
        "removes them.",
    )
    drives: _Name | None = Field(
        None,
        description="What the program moves beside the page, such as `SO-101 at /dev/ttyACM0`: the page has a red "
        "frame with this name until the program leaves, or says null.",
    )
    announce: Announced | None = Field(
        None,
        description="State, words and buttons of the program in the status card of the page; null removes them. "
        "The program hears `pressed`, with the name of the button.",
    )
    clear: Annotated[bool, Field(strict=True)] | None = Field(
        None, description="true: remove everything that the program has drawn, before `draw`."
    )
    draw: dict[_Name, Drawing | None] | None = Field(
        None, description="Drawings by name. One of the same name is replaced; null removes it."
    )


@dataclass(frozen=True)
class Message:
    """A message that was read.

    Attributes:
        id: to answer with.
        subscription: what the program wants to hear from now on.
        values: for the page, by name, in the order in which they are used.
    """

    id: int | None
    subscription: Subscription | None
    values: dict[str, Any]


def id_of(text: str) -> int | None:
    """The `id` of a message that is wrong in another field; None also for one that is too large to be read."""
    if len(text) > MOST_BYTES:
        return None
    try:
        found = parsed(text.encode("utf-8", "replace"))
    except ProblemError:
        return None
    given = found.get("id") if isinstance(found, dict) else None
    return given if isinstance(given, int) and not isinstance(given, bool) and 0 <= given <= 2**53 else None


def read(text: str, robot: Robot, store: Store) -> Message:
    """Read a message for a page that shows this robot; raises `ProblemError` or `InputError` naming the field."""
    if len(text) > MOST_BYTES or len(text.encode("utf-8", "replace")) > MOST_BYTES:
        size = len(text.encode("utf-8", "replace"))
        error = FieldError(field="message", value=f"{size} bytes", expected=f"at most {MOST_BYTES} bytes")
        raise ProblemError(
            413,
            "body-too-large",
            f"The message has {size} bytes, more than {MOST_BYTES}.",
            "Send less at a time.",
            [error],
        )
    body = validated(LiveMessage, parsed(text.encode("utf-8", "replace")), "body")
    given = body.model_fields_set
    if body.q is not None and body.target is not None:
        raise invalid(FieldError(field="target", value="a target besides q", expected="one of the two"))
    values: dict[str, Any] = {}
    if body.robot is not None:
        values["robot"] = sent = _robot(body.robot, store)
        robot = sent if isinstance(sent, Robot) else body.robot.robot()  # type: ignore[union-attr]
    if body.obstacles is not None:
        values["obstacles"] = checked_obstacles([each.model_dump(exclude_none=True) for each in body.obstacles])
    if body.program is not None:
        values["program"] = _program(body.program, robot)
    if body.q is not None:
        values["q"] = configuration(robot, body.q, "q", within=True)
    if body.gripper is not None:
        values["gripper"] = body.gripper
    if body.target is not None:
        values["target"] = _target(body.target)
    if body.play is not None:
        values["play"] = body.play
    if "drives" in given:
        values["drives"] = None if body.drives is None else _printable(body.drives)
    if "announce" in given:
        values["announce"] = None if body.announce is None else _announced(body.announce)
    if body.clear:
        values["clear"] = True
    if body.draw is not None:
        values["draw"] = {name: None if each is None else each.model_dump() for name, each in body.draw.items()}
    if "readings" in given:
        values |= _read_motors(robot, body.readings)
    if "measured" in given:
        measured = body.measured
        values["measured"] = None if measured is None else configuration(robot, measured, "measured")
    if "measured_gripper" in given:
        values["measured_gripper"] = body.measured_gripper
    return Message(body.id, body.subscribe, values)


def _program(given: dict[str, Any], robot: Robot) -> Program:
    """A program; raises `InputError`."""
    try:
        return program_from_dict(given, robot)
    except InputError as error:
        raise error.within("program") from None


def _read_motors(robot: Robot, readings: list[float] | None) -> dict[str, Any]:
    """The readings and, where each joint has a motor, the configuration that they mean; raises `InputError`."""
    if readings is None:
        return {"readings": None, "measured": None}
    try:
        motors = moving_motors(robot)
    except InputError as error:
        raise InputError("readings", readings, error.expected) from None
    read = of_moving(robot.motors, readings)
    driven = {motor.joint for motor in motors}
    known = all(joint.name in driven for joint in robot.joints)
    return {"readings": read.tolist(), **({"measured": q_from_readings(robot, read)} if known else {})}


def _announced(given: Announced) -> Announcement:
    """What the program announces; raises 422."""
    names = [button.name for button in given.buttons]
    buttons = []
    for i, button in enumerate(given.buttons):
        field = f"announce.buttons[{i}]"
        if button.name in names[:i]:
            raise invalid(FieldError(field=f"{field}.name", value=show(button.name), expected="another name each"))
        if button.stops and button.confirm is not None:
            expected = "none: a button that stops something is pressed at once"
            raise invalid(FieldError(field=f"{field}.confirm", value=show(button.confirm), expected=expected))
        label = _printable(button.label, f"{field}.label")
        confirm = "" if button.confirm is None else _printable(button.confirm, f"{field}.confirm")
        buttons.append(Button(button.name, label, confirm, button.stops))
    return Announcement(_printable(given.words, "announce.words"), given.state, tuple(buttons))


def _printable(text: str, field: str = "drives") -> str:
    """A text as the page shows it; raises 422 for one in which there is nothing to be seen."""
    found = "".join(c for c in " ".join(text.split()) if c.isprintable())
    if not found:
        raise invalid(FieldError(field=field, value=show(text), expected="a text that can be read, or null"))
    return found


def configuration(robot: Robot, q: list[float], field: str, within: bool = False) -> Array:
    """A configuration ``(n,)``; raises 422 naming the joint that does not fit."""
    if len(q) != robot.n:
        names = ", ".join(joint.name for joint in robot.joints)
        given = f"{len(q)} values: {show(q)}" if len(q) <= 8 else f"{len(q)} values"
        expected = f"{robot.n} values in radians (metres for sliding joints)"
        error = FieldError(field=field, value=given, expected=expected)
        raise invalid(error, hint=f"The joints of the {robot.name} on the page are: {names}.")
    found = np.array(q)
    if within:
        for i, (value, low, high) in enumerate(zip(q, robot.lower, robot.upper, strict=True)):
            if not low - SLACK <= value <= high + SLACK:
                unit = "rad" if robot.revolute[i] else "m"
                expected = f"{low:.6g} to {high:.6g} {unit}, the limits of the joint {robot.joints[i].name}"
                raise invalid(FieldError(field=f"{field}[{i}]", value=show(value), expected=expected))
        found = robot.clip(found)
    return found


def _robot(given: str | RobotDescription, store: Store) -> Robot | dict[str, Any]:
    """An arm of the service, or the fields of one that is sent along, which are checked."""
    if isinstance(given, str):
        try:
            return store.get(given)
        except UnknownRobotError as error:
            expected = f"one of {', '.join(error.robot_ids)}, or the fields of a robot file"
            raise invalid(FieldError(field="robot", value=show(given), expected=expected)) from None
    given.robot()
    return dict(given.root)


def _target(given: Target) -> tuple[Array, bool]:
    """T_world_tool ``(4, 4)``, and whether it has an orientation."""
    task, T = given.in_world(None, "target")
    return T, task != "position"
