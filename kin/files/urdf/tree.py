"""The joints and links of a URDF, and the serial chain between two links."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from kin.errors import RobotFileError
from kin.files.mjcf.convert import WRITTEN, as_urdf
from kin.files.numbers import LARGEST, number_of
from kin.files.urdf.causes import parse_mended
from kin.frames import matrix_of
from kin.robot import Kind, Matrix
from kin.transforms import Array, pose_from_position_wxyz

MOVING = ("revolute", "continuous", "prismatic")
FREE = ("floating", "planar")  # not of a serial arm, which may stand on a link that floats
TYPES = (*MOVING, "fixed", *FREE)
XACRO_DEFINITIONS = ("xacro:property", "xacro:arg", "xacro:macro")  # which add nothing by themselves
MOST = 12  # names in a message
MAX_LINKS = 5000
UNLIMITED = {"revolute": 9e5, "prismatic": 1e4}  # rad and m: limits beyond it both ways stand for none
UNIT = 0.01  # by how much the length of a quaternion may differ from 1: it is written with few digits
_COUNTS = {3: "three", 4: "four"}
_ONCE = "a name that no other {} has"


Format = Literal["URDF", "MJCF"]


class Terms(NamedTuple):
    """What a format calls its parts, in messages.

    Attributes:
        link: what joints connect.
        moving: the joints of an arm.
        bodies: what becomes capsules.
        limits: what a joint without limits lacks.
    """

    link: str
    moving: str
    bodies: str
    limits: str


TERMS: dict[Format, Terms] = {
    "URDF": Terms("link", "revolute or prismatic joints", "collision bodies", "limits"),
    "MJCF": Terms("body", "hinge or slide joints", "colliding geoms", "range"),
}


class Tip(NamedTuple):
    """A link at the end of a chain, with the number of moving joints that lead to it from the root."""

    link: str
    joints: int


@dataclass(frozen=True, eq=False)
class UrdfElement:
    """A named element of a URDF; its numbers are read where they are needed."""

    file: str
    element: Element
    name: str

    def pose(self) -> Matrix:
        """Its frame in its parent's: `xyz` in metres, and `rpy` in radians or `quat_xyzw` (URDF 1.1)."""
        origin = self.element.find("origin")
        xyz = self.triple("origin", "xyz", "0 0 0")
        if origin is None or "quat_xyzw" not in origin.keys():  # noqa: SIM118 - an Element iterates over children
            return matrix_of(xyz, self.triple("origin", "rpy", "0 0 0"))
        if "rpy" in origin.keys():  # noqa: SIM118
            raise self.refuse("origin", "rpy and quat_xyzw", "one of them")
        x, y, z, w = quaternion = self.numbers("origin", "quat_xyzw", "", 4)
        length = math.hypot(*quaternion)
        if not abs(length - 1.0) <= UNIT:
            expected = "a quaternion x y z w of length 1" + (", and this one has no direction" * (length == 0.0))
            raise self.refuse("origin quat_xyzw", f"{origin.get('quat_xyzw')} (length {length:.3g})", expected)
        T = pose_from_position_wxyz(xyz, [w, x, y, z]).tolist()
        return tuple(map(tuple, T))

    def triple(self, tag: str, key: str, default: str) -> list[float]:
        """Three numbers of an attribute."""
        return self.numbers(tag, key, default, 3)

    def numbers(self, tag: str, key: str, default: str, count: int) -> list[float]:
        """So many numbers of an attribute."""
        child = self.element.find(tag)
        parts = (default if child is None else child.get(key, default)).split()
        if len(parts) != count:
            words = f"{_COUNTS[count]} numbers separated by spaces"
            raise self.refuse(f"{tag} {key}", " ".join(parts), words)
        return [self.number(tag, f"{key}[{i}]", part) for i, part in enumerate(parts)]

    def number(self, tag: str, key: str, text: str) -> float:
        """A finite number of an attribute."""
        value = number_of(text)
        if not abs(value) < LARGEST:
            hint = "; expand xacro first" if "$" in text else ""
            raise self.refuse(f"{tag} {key}", text, "a finite number, smaller than a million" + hint)
        return value

    def refuse(self, field: str, value: object, expected: str) -> RobotFileError:
        """The error for one of its fields."""
        return RobotFileError(self.file, f"{self.element.tag} {self.name}: {field}", value, expected)


@dataclass(frozen=True, eq=False)
class UrdfJoint(UrdfElement):
    """One joint of a URDF."""

    type: str
    parent: str
    child: str
    note: str = ""  # what had to be understood
    held: tuple[str, float] | None = None  # the type and the only value of a joint that is read as fixed

    def pose(self) -> Matrix:
        """As of any element; of a joint that is held, with its value."""
        if self.held is None:
            return super().pose()
        T = np.array(super().pose()) @ motion_of(self, np.array([self.held[1]]))[0]
        return tuple(map(tuple, T.tolist()))

    @property
    def said(self) -> str:
        """Its type, as its file says it."""
        return self.element.get(WRITTEN, self.type)

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.type != "fixed"

    @property
    def follows(self) -> bool:
        """Whether another joint moves it."""
        return self.element.find("mimic") is not None

    @property
    def kind(self) -> Kind:
        """The kind of the row."""
        return "prismatic" if (self.held or (self.type,))[0] == "prismatic" else "revolute"

    def axis(self) -> list[float]:
        """The joint axis, a unit vector in the joint's frame."""
        given = self.triple("axis", "xyz", "1 0 0")
        length = math.hypot(*given)
        if length < 1e-6:
            raise self.refuse("axis xyz", given, "a direction that is not zero")
        return [v / length for v in given]

    def limits(self) -> tuple[float, float] | None:
        """Lower and upper limit as they stand; None if it states none, as a continuous joint does.

        Limits that stand for none are infinite: some files write huge ones, or infinity.
        """
        limit = self.element.find("limit")
        if self.type == "continuous" or limit is None or not {"lower", "upper"} & set(limit.keys()):
            return None
        texts = {key: limit.get(key, "0") for key in ("lower", "upper")}
        lower, upper = map(number_of, texts.values())
        if lower <= -UNLIMITED[self.kind] and upper >= UNLIMITED[self.kind]:
            return -math.inf, math.inf
        lower, upper = (self.number("limit", key, text) for key, text in texts.items())
        return lower, upper

    @property
    def unstated(self) -> str:
        """Which of both limits is missing beside the other one; "" if none is."""
        limit = self.element.find("limit")
        missing = {"lower", "upper"} - set(() if limit is None else limit.keys())
        return missing.pop() if len(missing) == 1 else ""

    def resting(self) -> float:
        """The value of a joint beside the arm: zero, or the limit closest to it.

        Such a joint is not judged: some files hold a finger by limits that are both zero. What cannot be read
        counts as zero.
        """
        limit = self.element.find("limit")
        if self.type == "continuous" or limit is None:
            return 0.0
        low, high = (number_of(limit.get(key, "0")) for key in ("lower", "upper"))
        return min(max(0.0, low), high) if -LARGEST < low <= high < LARGEST else 0.0

    def peak(self, key: str) -> float | None:
        """A limit of velocity, acceleration, deceleration, jerk or effort as it stands; None if it is not stated.

        Zero and negative numbers stand for unknown, and so do huge and infinite ones.
        """
        limit = self.element.find("limit")
        given = None if limit is None else limit.get(key)
        if given is None:
            return None
        if math.isnan(value := number_of(given)):
            raise self.refuse(f"limit {key}", given, "a number; 0 stands for unknown")
        return value


class Unread(NamedTuple):
    """A joint or a link with something wrong that concerns only the arms it belongs to.

    Attributes:
        element: of the file.
        parent, child: the links that it names; the child is the link itself, or the one that a joint moves.
        error: what is wrong.
        connects: whether a joint is left out, so that links behind it hang on nothing.
    """

    element: Element
    parent: str
    child: str
    error: RobotFileError
    connects: bool = False


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """A URDF file: links that joints connect.

    What is wrong beside an arm does not concern it: joints without their links are left out, and `chain` refuses
    faults of the requested arm only.

    Attributes:
        joints: those with a parent and a child.
        unread: what is wrong with links, joints, and joints that were left out.
        format: of the file.
        notes: what had to be understood of the file, a sentence each.
        ignored: of an MJCF file, what of a body or joint is not read, with the link; "" for the whole file.
    """

    file: str
    name: str
    links: tuple[str, ...]
    joints: tuple[UrdfJoint, ...]
    root: Element
    unread: tuple[Unread, ...] = ()
    format: Format = "URDF"
    notes: tuple[str, ...] = ()
    ignored: tuple[tuple[str, str], ...] = ()

    @property
    def terms(self) -> Terms:
        """What its format calls things."""
        return TERMS[self.format]

    @cached_property
    def parents(self) -> dict[str, UrdfJoint]:
        """For each link that has a parent, the joint to it; the first one if there are several."""
        return {joint.child: joint for joint in reversed(self.joints)}

    @cached_property
    def children(self) -> dict[str, list[UrdfJoint]]:
        """For each link that has children, the joints to them: each link is the child of one."""
        found: dict[str, list[UrdfJoint]] = {}
        for joint in self.joints:
            if self.parents[joint.child] is joint:
                found.setdefault(joint.parent, []).append(joint)
        return found

    @cached_property
    def depths(self) -> dict[str, int]:
        """For each link, the joints from its root to it that lead; links of or behind a cycle are missing.

        A floating or planar joint below the root counts as none: the arm begins behind it.
        """
        found = {link: 0 for link in self.links if link not in self.parents}
        links = list(found)
        for link in links:  # grows meanwhile
            for joint in self.children.get(link, ()):
                floats = joint.type in FREE and not found[link]
                found[joint.child] = 0 if floats else found[link] + (joint.moves and not self._is_led(joint))
                links.append(joint.child)
        return found

    def _is_led(self, joint: UrdfJoint) -> bool:
        """Whether a joint follows one before it."""
        mimic = joint.element.find("mimic")
        return mimic is not None and any(each.name == mimic.get("joint") for each in self.to_root(joint.parent))

    @cached_property
    def tips(self) -> tuple[Tip, ...]:
        """What carries fingers, and the links without children that joints move, those with the most joints first.

        Fingers are joints of one link of which some follow another, and all but one of those behind it; otherwise
        they are rods of the arm, as of a parallelogram.
        """
        inner = {joint.parent for joint in self.joints}
        fingers = {link: [each for each in joints if each.moves] for link, joints in self.children.items()}
        hands = {
            link
            for link, each in fingers.items()
            if len(each) > 1 and any(joint.follows for joint in each) and self._leading_behind(link) <= 1
        }
        found = [Tip(link, self.depths.get(link, 0)) for link in self.links if link not in inner - hands]
        return tuple(
            sorted((tip for tip in found if tip.joints), key=lambda tip: (tip.link not in hands, -tip.joints))
        )

    def _leading_behind(self, link: str) -> int:
        """The number of moving joints behind a link that follow none; 0 in a circle of links."""
        if link not in self.depths:
            return 0
        count, links = 0, [link]
        while links:
            for joint in self.children.get(links.pop(), ()):
                count += joint.moves and not joint.follows
                links.append(joint.child)
        return count

    def to_root(self, link: str) -> list[UrdfJoint]:
        """The joints from the root of a link's tree to the link."""
        found: list[UrdfJoint] = []
        while link in self.parents:
            found.append(self.parents[link])
            link = found[-1].parent
            if len(found) > len(self.joints):
                names = ", ".join(joint.name for joint in found[:MOST])
                expected = "no cycle: each chain begins at a link without parent"
                raise RobotFileError(self.file, "joint", names, expected)
        return found[::-1]

    def chain(self, base: str | None, tip: str | None) -> tuple[UrdfJoint, ...]:
        """The joints from `base` (by default the root) to `tip`, which may be left out if there is only one.

        Raises:
            RobotFileError: naming the links to choose from, or a joint that is no part of a serial arm.
        """
        for field, link in (("base", base), ("tip", tip)):
            if link is not None and link not in self.links:
                names = self.names(self.links) if field == "base" else self.choices()
                raise RobotFileError(self.file, field, link, f"one of {names}")
        if tip is None:
            self._check_all()
            if len(self.tips) != 1:
                given = "no tip, and several are possible" if self.tips else "no moving joints"
                expected = f"one of {self.choices()}" if self.tips else f"a chain with {self.terms.moving}"
                raise RobotFileError(self.file, "tip", given, expected)
            tip = self.tips[0].link
        found = self.to_root(tip)
        if base is not None:
            above = [i for i, joint in enumerate(found) if joint.parent == base]
            if not above:
                names = self.names([joint.parent for joint in found])
                raise RobotFileError(self.file, "base", base, f"a link on the way to {tip}: {names}")
            found = found[above[0] :]
        self._check_whole(found, tip, base)
        if base is None:
            found = self._behind_free(found)
        self._check(found, tip)
        return tuple(found)

    def _behind_free(self, found: list[UrdfJoint]) -> list[UrdfJoint]:
        """The joints behind those with which the root floats: a serial arm stands on what they move."""
        moving = (i for i, joint in enumerate(found) if joint.moves and joint.type not in FREE)
        first = next(moving, len(found))
        return found[max((i + 1 for i, joint in enumerate(found[:first]) if joint.type in FREE), default=0) :]

    def _check_all(self) -> None:
        """Without a tip, the whole file is the arm."""
        for each in self.unread:
            raise each.error
        for link in self.links:
            if link not in self.depths:
                self.to_root(link)  # raises: there is a cycle

    def _check_whole(self, chain: list[UrdfJoint], tip: str, base: str | None) -> None:
        """Whether nothing of the chain is wrong, and no joint above it was left out."""
        start = chain[0].parent if chain else tip
        names = {joint.name for joint in chain}
        links = {joint.child for joint in chain} | ({start} if base is None else set())
        for each in self.unread:
            is_link = each.element.tag == "link"
            named = not each.connects and each.element.get("name", "").strip() in names
            if (
                each.child in links
                or (is_link and each.child == start)
                or (named and not is_link)
                or (base is None and each.connects and self._hides_parent(each, start))
            ):
                raise each.error

    def _hides_parent(self, left_out: Unread, start: str) -> bool:
        """Whether a joint without a known child may be what a chain from `start` hangs on."""
        if left_out.child in self.known:
            return False  # it hangs on another joint, or the chain would have met it
        if left_out.parent not in self.known:
            return True
        above = self.to_root(left_out.parent)
        return (above[0].parent if above else left_out.parent) != start  # else it is further down the same tree

    @cached_property
    def known(self) -> frozenset[str]:
        """The names of all links."""
        return frozenset(self.links)

    def _check(self, chain: list[UrdfJoint], tip: str) -> None:
        if not any(joint.moves for joint in chain):
            raise RobotFileError(self.file, "tip", tip, f"a link that joints move, such as {self.choices()}")
        for joint in chain:
            if joint.moves and joint.type not in MOVING:
                behind = f", or an arm behind it: base {joint.child}" if joint.type in FREE else ""
                valid = "one of " + ", ".join((*MOVING, "fixed")) if self.format == "URDF" else "hinge or slide"
                raise joint.refuse("type", joint.said, valid + behind)

    def choices(self) -> str:
        """The tips, for a message."""
        return self.names([f"{tip.link} ({tip.joints} joint{'s' * (tip.joints > 1)})" for tip in self.tips])

    def names(self, all_of_them: list[str] | tuple[str, ...]) -> str:
        """Names, for a message."""
        more = f" and {len(all_of_them) - MOST} more" if len(all_of_them) > MOST else ""
        return ", ".join(all_of_them[:MOST]) + more


def read_tree(text: bytes | str, file: str) -> UrdfTree:
    """The links and joints of a URDF; raises `RobotFileError`. See `UrdfTree` for what is left out."""
    root, _, causes = parse_mended(text, file)
    notes = [f"The file has {cause.what}; right is {cause.expected}. It is read all the same." for cause in causes]
    return tree_of(root, file, notes)


def tree_of(root: Element, file: str, notes: Sequence[str] = ()) -> UrdfTree:
    """The links and joints below the root element of a URDF, or of an MJCF file; raises `RobotFileError`."""
    if root.tag == "mujoco":
        converted = as_urdf(root, file)
        return replace(tree_of(converted.robot, file, notes), format="MJCF", ignored=tuple(converted.ignored))
    if root.tag != "robot":
        raise RobotFileError(file, "root element", root.tag, "<robot>, the root of a URDF, or <mujoco>")
    notes = [*notes, *_leftover_xacro(root, file)]
    elements = root.findall("link")
    if not elements and root.find("group") is not None:
        expected = "links and joints: this is an SRDF, which stands beside the URDF of its arm"
        raise RobotFileError(file, "link", "none", expected)
    if len(elements) > MAX_LINKS:
        raise RobotFileError(file, "link", f"{len(elements)} links", f"at most {MAX_LINKS} links")
    unread: list[Unread] = []
    links: dict[str, Element] = {}
    for element in elements:
        try:
            name = _attribute(element, "name", file, "link")
        except RobotFileError as error:
            unread.append(Unread(element, "", "", error))
            continue
        if name in links:
            unread.append(Unread(element, "", name, RobotFileError(file, "link", name, _ONCE.format("link"))))
        links.setdefault(name, element)
    joints: list[UrdfJoint] = []
    names: set[str] = set()
    children: dict[str, str] = {}
    for element in root.findall("joint"):
        try:
            joint = _joint(element, file, links)
        except RobotFileError as error:
            unread.append(Unread(element, _end(element, "parent"), _end(element, "child"), error, connects=True))
            continue
        if joint.name in names:
            twice = RobotFileError(file, "joint", joint.name, _ONCE.format("joint"))
            unread.append(Unread(element, joint.parent, joint.child, twice))
        elif joint.child in children:
            both = f"the child of {children[joint.child]} and {joint.name}"
            loop = RobotFileError(file, f"link {joint.child}", both, "one parent: a loop is no serial arm")
            unread.append(Unread(element, joint.parent, joint.child, loop))
        names.add(joint.name)
        children.setdefault(joint.child, joint.name)
        joints.append(joint)
    return UrdfTree(
        file, root.get("name", ""), tuple(links), tuple(joints), root, tuple(unread), notes=tuple(notes)
    )


def _leftover_xacro(root: Element, file: str) -> list[str]:
    """A note about definitions of xacro that nothing in the file uses; what would add to the arm is refused."""
    left = [element.tag for element in root.iter() if element.tag.startswith("xacro:")]
    outside = [element for child in root if child.tag not in XACRO_DEFINITIONS for element in child.iter()]
    values = (value for each in [root, *outside] for value in each.attrib.values())
    used = next((value for value in values if "${" in value or "$(" in value), None)
    other = next((each.tag for each in outside if each.tag.startswith("xacro:")), None)
    if not left:
        return [f"Names such as {used} have expressions of xacro: they are taken as they stand."] if used else []
    if other is None and used is None:
        names = ", ".join(f"<{tag}>" for tag in dict.fromkeys(left))
        return [f"The file has elements of xacro that nothing in it uses ({names}): they are left out."]
    expected = "plain URDF; `xacro FILE.xacro > FILE.urdf`, or `kinboard import FILE.xacro`, expands it"
    raise RobotFileError(file, "file", f"xacro that is not expanded: {used or f'<{other}>'}", expected)


def _joint(element: Element, file: str, links: Collection[str]) -> UrdfJoint:
    name = _attribute(element, "name", file, "joint")
    ends = []
    for tag in ("parent", "child"):
        child = element.find(tag)
        if child is None:
            raise RobotFileError(file, f"joint {name}: {tag}", "nothing", f'<{tag} link="…"/>')
        ends.append(_attribute(child, "link", file, f"joint {name}: {tag}"))
    given = element.get("type", "")
    meant = given.strip().lower()
    kind = meant if meant in TYPES else given
    note = f"Joint {name} has the type {given}: it is read as {kind}." if kind != given else ""
    joint = _held(UrdfJoint(file, element, name, kind, ends[0], ends[1], note))
    for field, link in (("parent", joint.parent), ("child", joint.child)):
        if link not in links:
            raise joint.refuse(field, link, "the name of a link of this file")
    return joint


def _held(joint: UrdfJoint) -> UrdfJoint:
    """The joint, or if both of its limits are one value other than zero, a fixed one at this value."""
    limit = joint.element.find("limit")
    if joint.type not in ("revolute", "prismatic") or limit is None or joint.element.find("mimic") is not None:
        return joint
    lower, upper = (number_of(limit.get(key, "nan")) for key in ("lower", "upper"))
    if not (lower == upper != 0.0 and abs(lower) < LARGEST):
        return joint
    unit = "m" if joint.type == "prismatic" else "rad"
    note = f"Joint {joint.name} has no other value than its limits, {lower:g} {unit}: it is read as fixed there."
    return replace(joint, type="fixed", note=f"{joint.note} {note}".strip(), held=(joint.type, lower))


def motion_of(joint: UrdfJoint, values: Array) -> Array:
    """The motion of a joint ``(k, 4, 4)``, by Rodrigues' formula or along its axis."""
    x, y, z = axis = np.array(joint.axis())
    T = np.tile(np.eye(4), (len(values), 1, 1))
    if joint.kind == "prismatic":
        T[:, :3, 3] = values[:, None] * axis
        return T
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(values)[:, None, None], 2.0 * np.sin(0.5 * values)[:, None, None] ** 2
    T[:, :3, :3] += s * K + c * (K @ K)
    return T


def _end(joint: Element, tag: str) -> str:
    """The link that a joint names as its parent or child; empty if it names none."""
    child = joint.find(tag)
    return "" if child is None else child.get("link", "").strip()


def _attribute(element: Element, key: str, file: str, field: str) -> str:
    value = element.get(key, "").strip()
    if not value or len(value) > 200:
        raise RobotFileError(file, f"{field} {key}", value, "a text of 1 to 200 characters")
    return value
