"""Files that a visitor sends and gets: robot files (TOML), URDF, and zips of a URDF and its meshes."""

from __future__ import annotations

import base64
import binascii
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import kin
from app.shared.memory.answers import AnswerMemory, MemoryFullError, Reservation
from app.viewer.meshes.archive import MB, MOST_BYTES, MOST_OF_URDF, Archive, MeshError
from app.viewer.meshes.reader import full
from app.viewer.own_arm import OwnArm, own_arm
from kin import InputError, Robot, RobotFileError
from kin.files.urdf.collisions import Fitted, LinkPieces, collisions_of, said, with_bodies
from kin.files.urdf.tree import Tip, read_tree
from kin.typed import cut
from kin.units import general

# The root element after a declaration and comments.
_MJCF = re.compile(r"[\ufeff\s]*(?:<\?[^>]*>\s*)?(?:<!--(?:(?!-->).)*-->\s*)*<mujoco\b", re.DOTALL)
MOST = 300_000  # characters of a file that is text


class Busy(NamedTuple):
    """Something that takes a while: how much of it is done, and of how much; 0: not known."""

    words: str
    done: int
    total: int
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Source:
    """A file from a visitor, and what is known so far of how to use it.

    Attributes:
        name: of the file, for messages; with the name of the URDF if it is a zip.
        text: TOML or URDF; empty while the URDF of a zip is to be chosen.
        archive: the zip, `data` its bytes, and `room` the memory they take.
        urdf: name of the URDF in the zip, one of `urdfs`.
        tips: the links that can be the tool, if there are several.
    """

    name: str
    text: str
    archive: Archive | None = None
    data: bytes = b""
    room: Reservation | None = None
    urdf: str = ""
    urdfs: tuple[str, ...] = ()
    tips: tuple[Tip, ...] = ()

    def with_urdf(self, urdf: str) -> Source:
        """This URDF of the zip; raises `kin.KinematicsError`."""
        assert self.archive is not None
        if urdf not in self.urdfs:
            raise InputError("urdf", urdf, "one of " + ", ".join(self.urdfs))
        try:
            text = self.archive.read(urdf, MOST_OF_URDF).decode("utf-8", "replace")
        except MeshError as error:
            raise file_error(self.name, error) from None
        return replace(self, text=text, urdf=urdf, tips=tips_of(f"{self.name}: {urdf}", text))


class Incoming:
    """A file that arrives in parts: text, or bytes in base64.

    Args:
        memory: where room for a zip is reserved while it arrives.

    Attributes:
        name: of the file of which more is to come; empty if there is none.
        last: when the last part came, as `time.perf_counter` tells it.
        total: bytes of a zip of which more is to come, as its sender says.
    """

    def __init__(self, memory: AnswerMemory) -> None:
        self._memory = memory
        self.forget()

    def forget(self) -> None:
        """Drop what has arrived."""
        self.name, self.last, self.total = "", 0.0, 0
        self._parts: list[str | bytes] = []
        self._length = 0
        self._room = self._memory.reserve(0)

    @property
    def arrived(self) -> int:
        """Bytes of a zip of which more is to come."""
        return self._length if self._parts and isinstance(self._parts[0], bytes) else 0

    def take(self, value: object) -> tuple[str, str | bytes, Reservation] | None:
        """Add a part; name, content and room of the file if it was the last one.

        Raises:
            MeshError: the file is too large; its parts are forgotten.
            kin.InputError: not a part of a file.
        """
        name, first, last, part, from_, total = _part(value)
        from_ = self._length if from_ is None else from_
        if first:
            self.forget()
            self.name, self.total = name, total
        elif not self._parts:
            return None  # the rest of a file that was refused
        elif not self._follows(name, part, from_):
            self.forget()
            raise MeshError(f"{name}: part", "a part that does not follow the one before", "another try")
        self._parts.append(part)
        self.last = time.perf_counter()
        self._length += len(part)
        most = MOST if isinstance(part, str) else MOST_BYTES
        try:
            self._room.resize(0 if isinstance(part, str) else min(self._length, MOST_BYTES))
        except MemoryFullError:
            self.forget()
            raise full() from None
        if self._length > most:
            self.forget()
            limit = f"{MOST // 1000} kB" if isinstance(part, str) else f"{MOST_BYTES // MB} MB for a zip"
            raise MeshError(f"{name}: size", "it is too large", f"at most {limit}")
        if not last:
            return None
        empty: str | bytes = type(part)()
        content, room = empty.join(self._parts), self._room  # type: ignore[arg-type]
        self.forget()
        return name, content, room

    def _follows(self, name: str, part: str | bytes, before: int) -> bool:
        """Whether a part continues what has arrived."""
        same = name == self.name and type(part) is type(self._parts[0])
        return same and before == self._length


def _part(value: object) -> tuple[str, bool, bool, str | bytes, int | None, int]:
    """Name, whether it is the first and the last part, content; of a zip how much came before, and its size."""
    match value:
        case [str(name), bool(first), bool(last), str(part)] if part or last:
            return cut(name), first, last, part, None, 0
        case [str(name), bool(first), bool(last), str(part), "base64", int(before), int(total)] if part or last:
            try:
                return cut(name), first, last, base64.b64decode(part, validate=True), before, total
            except (binascii.Error, ValueError):
                pass
    raise InputError("upload", value, "name, whether it is the first part, the last part, and its text or base64")


def opened(name: str, content: str | bytes, room: Reservation) -> Source:
    """A file as far as it says itself what is wanted of it.

    Raises:
        kin.KinematicsError: naming the field, the value and what would be valid.
    """
    if isinstance(content, str):
        return Source(name, content, tips=tips_of(name, content))
    try:
        archive = Archive(content)
    except MeshError as error:
        raise file_error(name, error) from None
    urdfs = tuple(archive.urdfs)
    if not urdfs:
        raise RobotFileError(name, "zip", archive.about, "a zip with a file NAME.urdf and its meshes")
    source = Source(name, "", archive, content, room, urdfs=urdfs)
    return source.with_urdf(urdfs[0]) if len(urdfs) == 1 else source


def file_error(name: str, error: MeshError) -> RobotFileError:
    """What is wrong with a zip or a mesh, with the name of the file."""
    return RobotFileError(name, error.field, error.value, error.expected)


def arm_of(name: str, text: str, tip: str | None = None, reading: bool = False) -> tuple[OwnArm, str]:
    """The arm of a file, and what is to be said about it.

    Args:
        name: of the file, for messages.
        text: TOML, or URDF, which begins with ``<``.
        tip: the link of a URDF that is the tool.
        reading: whether its meshes are read next, and bodies are spoken of then.

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
        f"The table and the URDF differ by at most {general(report.difference, 1)} m in {report.samples} poses."
    )
    if not reading:
        words.append(f"Collisions: {report.about_bodies}")
    return own_arm(kin.robot_to_dict(robot, length="mm")), " ".join(words)


def bodies_in(name: str, text: str, tip: str | None, robot: Robot) -> list[LinkPieces]:
    """The collision bodies of a URDF, in the frames of the arm that was read from it."""
    tree = read_tree(text, name)
    return collisions_of(robot, tree, tree.chain(None, tip))


def with_capsules(own: OwnArm, links: Sequence[LinkPieces], fits: Sequence[Fitted]) -> tuple[OwnArm, str]:
    """The arm with these capsules around its collision bodies, and what is to be said about them."""
    robot, bodies = with_bodies(replace(own.robot, capsules=(), capsules_source=""), links, fits)
    found = own_arm(kin.robot_to_dict(robot), own.start)
    return replace(found, start=found.robot.id), f"Collisions: {said(bodies)}"


def tips_of(name: str, text: str) -> tuple[Tip, ...]:
    """The links of a URDF that can be the tool, if there are several; raises `kin.KinematicsError`."""
    tips = read_tree(text, name).tips if is_urdf(text) else ()
    return tips if len(tips) > 1 else ()


def is_urdf(text: str) -> bool:
    """Whether a text is XML, a URDF or MJCF, rather than TOML."""
    return text.lstrip("\ufeff \t\r\n").startswith("<")


def is_mjcf(text: str) -> bool:
    """Whether a text is XML whose root is `<mujoco>`."""
    return is_urdf(text) and bool(_MJCF.match(text))


def text_of(robot: Robot, kind: object) -> tuple[str, str]:
    """Name and text of a file of this kind, ``"toml"``, ``"urdf"`` or ``"mjcf"``; raises `kin.KinematicsError`."""
    if kind == "toml":
        return f"{robot.id}.toml", kin.robot_to_toml(robot)
    if kind == "urdf":
        return f"{robot.id}.urdf", kin.to_urdf(robot)
    if kind == "mjcf":
        return f"{robot.id}.xml", kin.to_mjcf(robot)
    raise InputError("download", kind, "toml, urdf or mjcf")
