"""Files that a visitor sends and gets: robot files (TOML) and URDF."""

from __future__ import annotations

from typing import NamedTuple

import kin
from app.viewer.own_arm import OwnArm, own_arm
from app.viewer.tabs.robot.expression import cut
from kin import InputError, Robot
from kin.files.urdf.tree import Tip, read_tree

MOST = 300_000  # characters of a file


class Several(NamedTuple):
    """A URDF with several links that can be the tool."""

    name: str
    text: str
    tips: tuple[Tip, ...]


class TooLargeError(ValueError):
    """A file has more than `MOST` characters."""


class Incoming:
    """A file that arrives in parts."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._length = 0

    def take(self, value: object) -> tuple[str, str] | None:
        """Add a part; name and text of the file if it was the last one.

        Raises:
            TooLargeError: the file is too large; its parts are forgotten.
            kin.InputError: not a part of a file.
        """
        match value:
            case [str(name), bool(first), bool(last), str(part)] if part or last:
                pass
            case _:
                raise InputError(
                    "upload", value, "name, whether it is the first part, the last part, and its text"
                )
        if first:
            self._parts, self._length = [], 0
        self._parts.append(part)
        self._length += len(part)
        if self._length > MOST:
            self._parts, self._length = [], 0
            raise TooLargeError
        if not last:
            return None
        text, self._parts, self._length = "".join(self._parts), [], 0
        return cut(name), text


def arm_of(name: str, text: str, tip: str | None = None) -> tuple[OwnArm, str]:
    """The arm of a file, and what is to be said about it.

    Args:
        name: of the file, for messages.
        text: TOML, or URDF, which begins with ``<``.
        tip: the link of a URDF that is the tool.

    Raises:
        kin.KinematicsError: naming the field, the value and what would be valid.
    """
    if not is_urdf(text):
        robot = kin.parse_robot(text, name)
        return own_arm(kin.robot_to_dict(robot)), robot.description
    robot, report = kin.read_urdf(text, tip=tip, file=name)
    words = [f"From link {report.base} to {report.tip}.", *report.notes]
    if report.tilts:
        words.append(f"Almost parallel axes are kept exactly by fixed rows: {', '.join(report.tilts)}.")
    words.append(
        f"The table and the URDF differ by at most {report.difference:.1g} (m) in {report.samples} poses."
    )
    return own_arm(kin.robot_to_dict(robot, length="mm")), " ".join(words)


def tips_of(name: str, text: str) -> tuple[Tip, ...]:
    """The links of a URDF that can be the tool, if there are several; raises `kin.KinematicsError`."""
    tips = read_tree(text, name).tips if is_urdf(text) else ()
    return tips if len(tips) > 1 else ()


def is_urdf(text: str) -> bool:
    """Whether a text is XML rather than TOML."""
    return text.lstrip("\ufeff \t\r\n").startswith("<")


def text_of(robot: Robot, kind: object) -> tuple[str, str]:
    """Name and text of a file of this kind, ``"toml"`` or ``"urdf"``; raises `kin.KinematicsError`."""
    if kind == "toml":
        return f"{robot.id}.toml", kin.robot_to_toml(robot)
    if kind == "urdf":
        return f"{robot.id}.urdf", kin.to_urdf(robot)
    raise InputError("download", kind, "toml or urdf")
