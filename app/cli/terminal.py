"""What commands share: arguments to core units, results to text.

Text is in degrees and millimetres, or with ``--rad`` in radians and metres; ``--json`` is always in the latter.
"""

from __future__ import annotations

import math
import os
import sys
import tomllib
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from app.shared.answers.answer import as_json
from app.shared.store import Store
from kin import (
    InputError,
    JointConstraints,
    KinematicsError,
    Obstacle,
    Robot,
    frame_pose,
    load_robot,
    pose_from_xyz_rpy,
)
from kin.collision.obstacles import checked_obstacles
from kin.files.load import XML
from kin.files.numbers import index_of
from kin.frames import FRAMES
from kin.ik import Task
from kin.motors import from_pendant
from kin.poses import read_target
from kin.transforms import Array
from kin.typed import ReadError, read, valid
from kin.units import Unit, Units

LARGEST = 1e6  # rad, m or a plain number


def store_of(arguments: Namespace) -> Store:
    """The built-in robots and those of the folder named by ``--robots`` or KINBOARD_ROBOTS."""
    folder = arguments.robots or os.environ.get("KINBOARD_ROBOTS")
    return Store(Path(folder) if folder else None)


def robot_of(arguments: Namespace) -> Robot:
    """The robot of the argument ``ROBOT``: an id, or the path of a file."""
    return named_robot(arguments, arguments.robot)


def named_robot(arguments: Namespace, named: str) -> Robot:
    """A robot by its id, or by the path of a file."""
    if Path(named).suffix.lower() in (".toml", *XML):
        return load_robot(Path(named))
    return store_of(arguments).get(named)


def mounted_robot_of(arguments: Namespace) -> Robot:
    """The robot of the argument ``ROBOT`` with the base and the tool of ``--base`` and ``--tool``, as in REST."""
    robot, units = robot_of(arguments), units_of(arguments)
    if arguments.base is not None:
        robot = robot.with_base(pose_of(arguments.base, "--base", units) @ robot.T_world_base)
    if arguments.tool is not None:
        robot = robot.with_mounted(pose_of(arguments.tool, "--tool", units))
    return robot


def pose_of(texts: list[str], field: str, units: Units) -> Array:
    """X, Y, Z, ROLL, PITCH, YAW as a transform ``(4, 4)``."""
    values = [quantity(text, units.of(k >= 3), field) for k, text in enumerate(texts)]
    return pose_from_xyz_rpy(values[:3], values[3:])


def typed_target(texts: list[str], form: str | None, units: Units, maker: str, field: str) -> tuple[Array, Task]:
    """A typed target ``(4, 4)`` and the task that it implies; raises `KinematicsError` with the field."""
    try:
        return read_target(" ".join(texts), form, units, maker)
    except ReadError as error:
        raise KinematicsError(f"{field}: {error.reason}") from None


def joint_constraints(robot: Robot, arguments: Namespace) -> JointConstraints:
    """The limits and locks of ``--limit`` and ``--lock``."""
    return JointConstraints(
        _per_joint(robot, arguments.limits, "--limit", 2, units_of(arguments)),
        _per_joint(robot, arguments.locked, "--lock", 1, units_of(arguments)),
        arguments.wider_limits,
    )


def _per_joint(
    robot: Robot, given: list[tuple[str, list[str]]] | None, field: str, count: int, units: Units
) -> Any:
    """``--lock 2=30`` or ``--limit 2=0:30``, joints counted from 1, as one entry per joint in radians (metres)."""
    if given is None:
        return None
    entries: list[float | list[float] | None] = [None] * robot.n
    for joint, texts in given:
        number = index_of(joint, robot.n + 1)
        if not number:
            raise InputError(field, joint, f"a joint from 1 to {robot.n} before the =")
        if len(texts) != count:
            raise InputError(field, texts, "JOINT=VALUE" if count == 1 else "JOINT=LOWER:UPPER")
        i = number - 1
        values = [quantity(text, units.of(bool(robot.revolute[i])), field) for text in texts]
        entries[i] = values[0] if count == 1 else values
    return entries


def units_of(arguments: Namespace) -> Units:
    """The units of numbers without one, and of printed ones."""
    return Units(not arguments.rad, "m" if arguments.rad else "mm")


def quantity(text: str, unit: Unit, field: str) -> float:
    """A typed number in radians, metres or as it is; raises `KinematicsError` with the field and what is valid."""
    try:
        return read(text, unit, largest=LARGEST)
    except ReadError as error:
        hint = "" if error.readings else f"; valid: {valid(unit)}"
        raise KinematicsError(f"{field}: {error.reason}{hint}") from None


def configuration(robot: Robot, texts: list[str], field: str, units: Units, pendant: bool = False) -> Array:
    """Joint values as ``(n,)`` in radians (metres); raises `KinematicsError` unless there are n of them.

    `pendant`: they are typed as the arm's pendant shows them.
    """
    if len(texts) != robot.n:
        joints = ", ".join(joint.name for joint in robot.joints)
        raise InputError(field, f"{len(texts)} values", f"{robot.n}, one for each of: {joints}")
    turning = map(bool, robot.revolute)
    named = [
        (text, units.of(turns), f"{field}[{i}]")
        for i, (text, turns) in enumerate(zip(texts, turning, strict=True))
    ]
    values = robot.check_q(np.array([quantity(*each) for each in named]), field)
    return from_pendant(robot, values) if pendant else values


def text_of(path: str, field: str) -> str:
    """The text of a file, or of standard input for "-"; raises `InputError`."""
    try:
        return sys.stdin.read() if path == "-" else Path(path).read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(field, path, f"a readable text file ({error})") from None


@contextmanager
def report_beside(*outputs: str | None) -> Iterator[None]:
    """What is printed in it goes to standard error if one of the files is "-": standard output has that alone."""
    with redirect_stdout(sys.stderr if "-" in outputs else sys.stdout):
        yield


def obstacles_of(arguments: Namespace) -> tuple[Obstacle, ...]:
    """The bodies in the file of ``--obstacles``."""
    if arguments.obstacles is None:
        return ()
    try:
        data = tomllib.loads(text_of(arguments.obstacles, "--obstacles"))
    except tomllib.TOMLDecodeError as error:
        raise InputError("--obstacles", arguments.obstacles, f"a readable TOML file ({error})") from None
    if set(data) != {"obstacles"}:
        raise InputError("--obstacles", sorted(data), "tables [[obstacles]] and nothing else")
    return checked_obstacles(data["obstacles"])


def workpieces_of(arguments: Namespace) -> dict[str, Array]:
    """The frames of ``--workpiece``, T_world_frame ``(4, 4)`` by name; raises `InputError`."""
    workpieces: dict[str, Array] = {}
    for name, texts in arguments.workpiece:
        if name in workpieces or name in FRAMES:
            raise InputError("--workpiece", name, f"names other than {', '.join(FRAMES)}, each once")
        workpieces[name] = pose_of(texts, f"--workpiece {name}", units_of(arguments))
    return workpieces


def frame_of(robot: Robot, arguments: Namespace, q: Array | None = None, name: str | None = None) -> Array:
    """T_world_frame ``(4, 4)`` of a frame, with those of ``--workpiece``; raises `InputError`.

    Args:
        q: where the arm is, for the frame of the tool.
        name: of the frame; None: the one of ``--frame``.
    """
    frame = arguments.frame if name is None else name
    workpieces = workpieces_of(arguments)
    if frame not in (*FRAMES, *workpieces):
        raise InputError("--frame", frame, "one of " + ", ".join([*FRAMES, *workpieces]))
    return frame_pose(robot, frame, workpieces, q)


class Notation:
    """Values as text: degrees and millimetres, or radians and metres."""

    def __init__(self, robot: Robot, rad: bool) -> None:
        self.rad = rad
        self.of_length = "m" if rad else "mm"
        self._revolute: list[bool] = robot.revolute.tolist()

    def angle(self, value: float) -> str:
        """An angle given in radians."""
        return f"{clean(value, 6)} rad" if self.rad else f"{clean(math.degrees(value), 3)}°"

    def length(self, value: float) -> str:
        """A length given in metres, without its unit."""
        return clean(value, 6) if self.rad else clean(value * 1e3, 3)

    def joint(self, index: int, value: float) -> str:
        """The value of a joint; "none" for a limit that it does not have."""
        if math.isinf(value):
            return "none"
        return self.angle(value) if self._revolute[index] else f"{self.length(value)} {self.of_length}"


def table(head: list[str], rows: list[list[str]]) -> str:
    """A text table; columns of numbers are aligned to the right."""
    lines = [head, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(head))]
    numeric = [all(not row[k] or row[k][:1] in "-0123456789" for row in rows) for k in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if right else cell.ljust(width)
            for cell, width, right in zip(line, widths, numeric, strict=True)
        ).rstrip()
        for line in lines
    )


def clean(value: float, digits: int) -> str:
    """Fixed-point notation without negative zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}"


def print_json(answer: object) -> int:
    """Print an answer on one line, in the bytes that REST answers; returns the exit code 0."""
    print(as_json(answer).decode())
    return 0
