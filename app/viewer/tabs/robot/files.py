"""Files that a visitor sends and gets: robot files (TOML), URDF, and zips of a URDF and its meshes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import kin
from app.shared.memory.answers import Reservation
from app.viewer.meshes.archive import MOST_OF_URDF, Archive, MeshError
from app.viewer.own_arm import OwnArm, own_arm
from kin import InputError, Robot, RobotFileError
from kin.files.read import parse_robot
from kin.files.urdf.collisions import Fitted, LinkPieces, collisions_of, said, with_bodies
from kin.files.urdf.tree import Tip, read_tree
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
        robot = parse_robot(text, name)
        return own_arm(kin.robot_to_dict(robot)), robot.description
    robot, report = kin.files.read_urdf(text, tip=tip, file=name)
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


KINDS = {
    "toml": ("a robot file", ".toml", kin.robot_to_toml),
    "urdf": ("URDF", ".urdf", kin.robot_to_urdf),
    "mjcf": ("MJCF", ".xml", kin.robot_to_mjcf),
}


def text_of(robot: Robot, kind: object) -> tuple[str, str]:
    """Name and text of a file of one of `KINDS`; raises `kin.KinematicsError`."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError("download", kind, "one of " + ", ".join(KINDS))
    _, suffix, text = KINDS[kind]
    return robot.id + suffix, text(robot)
