"""URDF → `Robot`: any serial chain of revolute, continuous, prismatic and fixed joints, exactly.

The joint values are those of the URDF: zero positions and positive directions are kept, and so are the limits of
position, velocity and effort. Each import is checked: the tool poses of the robot are compared with the product of
the URDF's own transforms at random configurations.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kin.axes import frame_of, inverse, perpendicular_to
from kin.dh.tables import SAMPLES, table_of_chain
from kin.errors import InputError, RobotFileError, one_of
from kin.files.home import default_home
from kin.files.names import unused
from kin.files.numbers import LARGEST, number_of
from kin.files.read import MAX_REACH, MAX_ROWS
from kin.files.urdf.causes import LFS
from kin.files.urdf.collisions import (
    Fit,
    UrdfBody,
    collisions_of,
    said,
    with_bodies,
    with_free_home,
    without_meshes,
)
from kin.files.urdf.fields import ignored_of
from kin.files.urdf.following import Followers, followers_of, left_of
from kin.files.urdf.tree import FREE, UNLIMITED, Format, Terms, Tip, UrdfJoint, UrdfTree, motion_of, read_tree
from kin.fk import fk
from kin.joint import joints_of
from kin.robot import DEFAULT_LIMITS, MOUNTINGS, Joint, Mounting, Robot
from kin.transforms import Array

_UPRIGHT = 0.7  # of the height of a vertical axis of unit length
MOST_IGNORED = 20  # notes about what is not read
EXACT = 1e-12  # a larger difference, per metre of reach, is noted


@dataclass(frozen=True)
class UrdfReport:
    """What became of a URDF.

    Attributes:
        base, tip: the links between which the arm was read.
        tips: the links that could have been chosen as the tip.
        joints: the moving joints, in the order of q.
        following: the joints of the chain that follow one of those.
        merged: the fixed joints of the chain, which became part of its constant transforms.
        ignored: the joints that are no part of the chain.
        tilts: the fixed rows that hold the small angle between two almost parallel axes.
        notes: what was assumed, one sentence each.
        difference: largest difference of any entry of the tool pose from the product of the URDF's transforms.
        samples: the number of random configurations at which it was measured.
        bodies: what stands for each link in collisions, base first.
        format: of the file.
    """

    base: str
    tip: str
    tips: tuple[Tip, ...]
    joints: tuple[str, ...]
    merged: tuple[str, ...]
    ignored: tuple[str, ...]
    tilts: tuple[str, ...]
    notes: tuple[str, ...]
    difference: float
    samples: int
    bodies: tuple[UrdfBody, ...] = ()
    following: tuple[str, ...] = ()
    format: Format = "URDF"

    @property
    def about_bodies(self) -> str:
        """Which bodies are from the file and which are assumed: the rest of a sentence "Collisions: …"."""
        return said(self.bodies, self.format)


class UrdfRobot(NamedTuple):
    """A robot read from a URDF, and the report about it."""

    robot: Robot
    report: UrdfReport


def read_urdf(
    source: Path | str,
    base: str | None = None,
    tip: str | None = None,
    file: str = "",
    fit: Fit | None = None,
) -> UrdfRobot:
    """The serial arm between two links of a URDF, as a standard DH table with capsules around its bodies.

    Boxes, cylinders, spheres and capsules of its `<collision>` elements are read here. Meshes are not, unless
    `fit` reads them: for links with one a tube is assumed.

    Args:
        source: a `Path` of a file, or a `str`, which is the text itself and never a path.
        base: the link the arm stands on; by default the root.
        tip: the link that is the tool; needed if several are possible.
        file: the name used in messages.
        fit: gives the capsules of each URDF link with collision bodies, for an arm with this reach (m).

    Returns:
        The arm, and a report of what was read, assumed and left out.

    Raises:
        RobotFileError: the file is invalid, or describes no serial arm; the message names the joint or link. Only
            the joints of the chain are judged.
        InputError: `source` is neither.

    Examples:
        >>> import kin
        >>> kin.files.read_urdf(kin.robot_to_urdf("ur5")).robot.n
        6
    """
    tree = _tree(source, file)
    chain = tree.chain(base, tip)
    robot, report = _import(tree, chain)
    links = collisions_of(robot, tree, chain)
    fits = (fit or without_meshes)(links, robot.reach)
    robot, bodies = with_bodies(robot, links, fits, tree.format)
    return UrdfRobot(with_free_home(robot, bodies, fits), replace(report, bodies=bodies))


def urdf_tips(source: Path | str, file: str = "") -> tuple[Tip, ...]:
    """The links of a URDF that can be the tip of an arm, those with the most joints first; see `read_urdf`.

    Args:
        source: a `Path` of a file, or a `str`, which is the text itself and never a path.
        file: the name used in messages.

    Returns:
        The links, each with the number of its joints.

    Raises:
        RobotFileError: the file is invalid.
        InputError: `source` is neither a path nor a text.

    Examples:
        >>> import kin
        >>> kin.files.urdf_tips(kin.robot_to_urdf("ur5"))[0].link
        'tool'
    """
    return _tree(source, file).tips


def _tree(source: Path | str, file: str) -> UrdfTree:
    if not isinstance(source, str | Path):
        raise InputError("source", source, "the text of a URDF as str, or the Path of a file")
    if isinstance(source, str):
        if "<" not in source and not source.startswith(LFS):
            wanted = "the text of a URDF, or the Path of a file: pathlib.Path(…)"
            raise RobotFileError(file or "URDF", "file", source, wanted)
        return read_tree(source, file or ("MJCF" if "<mujoco" in source else "URDF"))
    try:
        content = source.read_bytes()
    except (OSError, ValueError) as error:
        raise RobotFileError(str(source), "file", str(error), "a readable URDF file") from error
    return read_tree(content, file or str(source))


def _import(tree: UrdfTree, chain: Sequence[UrdfJoint]) -> UrdfRobot:
    moving = [joint for joint in chain if joint.moves]
    if len(moving) > MAX_ROWS:
        raise RobotFileError(tree.file, "joint", f"{len(moving)} moving joints", f"at most {MAX_ROWS}")
    notes = [*tree.notes, *_above(tree, chain), *(joint.note for joint in chain if joint.note)]
    followers = followers_of(tree, chain)
    joints = [_joint(joint, notes, followers, tree.terms) for joint in moving]
    joints = [_in_place(joint, tree, followers, notes) for joint in joints]
    joints = [_with_range(joint, joints, notes) for joint in joints]
    notes += _ignored(tree, chain)
    table = table_of_chain(joints, _transforms(chain, followers))
    rows = _with_distinct_tilts(table.rows)
    if len(rows) > MAX_ROWS:
        raise RobotFileError(tree.file, "joint", f"{len(rows)} DH rows", f"at most {MAX_ROWS}")
    name = tree.name.strip() or "robot"
    mounting, floor = _stated(tree, chain[0])
    leaders = _leaders(tree, joints)
    robot = Robot(
        id=re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40].strip("-") or "robot",
        name=name[:200].strip(),
        source=f"{_source(tree)}, from {tree.terms.link} {chain[0].parent} to {tree.terms.link} {chain[-1].child}",
        convention="standard",
        rows=rows,
        home=tuple(0.5 * sum(joint.limits or (0.0,)) for joint in leaders),
        base=table.base,
        tool=table.tool,
        mounting=mounting,
        floor=floor,
    )
    if robot.reach + float(np.linalg.norm(robot.T_world_base[:3, 3])) > MAX_REACH:
        expected = f"at most {MAX_REACH:g} m with the base"
        raise RobotFileError(tree.file, _farthest(chain), f"a reach of {robot.reach:g} m", expected)
    robot = replace(robot, home=default_home(robot))
    used = {joint.name for joint in chain}
    difference = _difference(robot, chain, followers)
    if difference > EXACT * max(1.0, robot.reach):
        notes.append(
            f"The poses of the table differ from those of the URDF by up to {difference:.1e}, more than usual."
        )
    report = UrdfReport(
        base=chain[0].parent,
        tip=chain[-1].child,
        tips=tree.tips,
        joints=tuple(joint.name for joint in leaders),
        following=tuple(followers.relations),
        merged=tuple(joint.name for joint in chain if not joint.moves),
        ignored=tuple(joint.name for joint in tree.joints if joint.name not in used),
        tilts=tuple(row.name for row in rows if row.kind == "fixed"),
        notes=tuple(notes),
        difference=difference,
        samples=SAMPLES,
        format=tree.format,
    )
    return UrdfRobot(robot, report)


def _farthest(chain: Sequence[UrdfJoint]) -> str:
    """The field of the joint that makes the arm longest."""

    def slide(joint: UrdfJoint) -> float:
        return max(map(abs, joint.limits() or (0.0,))) if joint.kind == "prismatic" and joint.moves else 0.0

    def offset(joint: UrdfJoint) -> float:
        return math.hypot(*(row[3] for row in joint.pose()[:3]))

    joint = max(chain, key=lambda joint: max(slide(joint), offset(joint)))
    return f"joint {joint.name}: {'limit' if slide(joint) > offset(joint) else 'origin xyz'}"


def _above(tree: UrdfTree, chain: Sequence[UrdfJoint]) -> list[str]:
    """Where the arm begins, if the link that it begins with floats in the root."""
    joint = tree.parents.get(chain[0].parent)
    if joint is None or joint.type not in FREE:
        return []
    kind = f"a {joint.said} joint" if tree.format == "MJCF" else joint.type
    return [f"Joint {joint.name} is {kind}: the arm begins behind it, at {tree.terms.link} {joint.child}."]


def _ignored(tree: UrdfTree, chain: Sequence[UrdfJoint]) -> list[str]:
    """What of the file, and of the joints and links of the arm, is not read, though it may have been meant."""
    if tree.format != "URDF":
        there = {"", chain[0].parent, *(joint.child for joint in chain)}
        return [words for link, words in tree.ignored if link in there]
    names = {chain[0].parent, *(joint.child for joint in chain)}
    links = [link for link in tree.root.findall("link") if link.get("name", "").strip() in names]
    found = []
    for element in [tree.root, *links, *(joint.element for joint in chain)]:
        name = "" if element is tree.root else f" {element.get('name', '').strip()}"
        what = "The file" if element is tree.root else element.tag.capitalize() + name
        found += [f"{what}: {each.words}." for each in ignored_of(element)]
    more = len(found) - MOST_IGNORED
    return found if more <= 0 else [*found[:MOST_IGNORED], f"{more} more elements and attributes are not read."]


def _stated(tree: UrdfTree, first: UrdfJoint) -> tuple[Mounting | None, float | None]:
    """What the arm is mounted on, and the height of the floor: as `robot_to_urdf` writes them, or assumed."""
    stated = tree.root.find("kinboard")
    if stated is None or first.parent in tree.parents:  # a base further up stands somewhere else
        return _mounting(first), 0.0
    mounting, floor = stated.get("mounting"), stated.get("floor")
    if mounting is not None and mounting not in MOUNTINGS:
        raise RobotFileError(tree.file, "kinboard: mounting", mounting, one_of(*MOUNTINGS))
    height = None if floor is None else number_of(floor)
    if height is not None and not abs(height) <= MAX_REACH:
        raise RobotFileError(
            tree.file, "kinboard: floor", floor, f"a height of at most {MAX_REACH:g} m either way"
        )
    return mounting, height


def _mounting(first: UrdfJoint) -> Mounting:
    """What the arm is mounted on: the floor, unless a fixed joint of the link `world` turns its root."""
    if first.moves or first.parent != "world":
        return "floor"
    up = first.pose()[2][2]
    return "floor" if up > _UPRIGHT else "ceiling" if up < -_UPRIGHT else "wall"


def _source(tree: UrdfTree) -> str:
    """The format and the name of the file, if it has one."""
    name = _file_name(tree.file)
    return tree.format if name in ("URDF", "MJCF") and tree.format != "URDF" else f"{tree.format} {name}"


def _file_name(file: str) -> str:
    """Without bytes that are no text: file systems allow them."""
    return Path(file).name.encode("utf-8", "replace").decode()


def _joint(joint: UrdfJoint, notes: list[str], followers: Followers, terms: Terms) -> Joint:
    relation = followers.relations.get(joint.name)
    return Joint(
        joint.name,
        kind=joint.kind,
        follows="" if relation is None else relation.leader,
        ratio=1.0 if relation is None else relation.multiplier,
        limits=_limits(joint, notes, terms)
        if relation is None
        else _limits_of_follower(joint, relation.offset, notes),
        velocity=_peak(joint, "velocity", notes),
        effort=_peak(joint, "effort", notes),
        acceleration=_acceleration(joint, notes),
        jerk=_peak(joint, "jerk", notes),
    )


def _limits(joint: UrdfJoint, notes: list[str], terms: Terms) -> tuple[float, float] | None:
    limits, unit = _in_order(joint, notes), "m" if joint.kind == "prismatic" else "rad"
    if limits is not None and joint.unstated:
        notes.append(f"Joint {joint.name} states no {joint.unstated} limit, which is 0 then.")
    if joint.type == "continuous" or (limits is not None and -math.inf < limits[0] < limits[1]):
        return limits
    why = f"states no {terms.limits}"
    if limits == (0.0, 0.0):
        why = "has limits that are both zero, which stand for none"
    elif limits is not None:
        why = f"has limits of {UNLIMITED[joint.kind]:g} {unit} or more both ways, which stand for none"
        if joint.kind == "revolute":
            notes.append(f"Joint {joint.name} {why}: it is read as unlimited.")
            return None
    assumed = DEFAULT_LIMITS[joint.kind]
    gets = "0 to 1 m" if joint.kind == "prismatic" else "−180° to 180°"
    notes.append(f"Joint {joint.name} {why}: it gets {gets}.")
    return assumed


def _in_order(joint: UrdfJoint, notes: list[str]) -> tuple[float, float] | None:
    """The limits of a joint as they stand, but the smaller one first."""
    limits = joint.limits()
    if limits is None or limits[0] <= limits[1]:
        return limits
    high, low = limits
    words = f"they are read as {low:g} to {high:g} {'m' if joint.kind == 'prismatic' else 'rad'}"
    notes.append(f"Joint {joint.name} has a lower limit above the upper one: {words}.")
    return low, high


def _limits_of_follower(joint: UrdfJoint, offset: float, notes: list[str]) -> tuple[float, float] | None:
    """The limits of a follower, counted from its offset; without any, its leader decides."""
    limits = _in_order(joint, notes)
    if limits is None or not -math.inf < limits[0] < limits[1]:
        return None
    return limits[0] - offset, limits[1] - offset


def _in_place(joint: Joint, tree: UrdfTree, followers: Followers, notes: list[str]) -> Joint:
    """A joint that stands for its leader beside the arm keeps that one's limits too."""
    relation = followers.replaced.get(joint.name)
    if relation is None:
        return joint
    notes.append(
        f"Joint {joint.name} follows {relation.leader}, which is beside the arm: {joint.name} is the joint here."
    )
    leader = next(each for each in tree.joints if each.name == relation.leader)
    limits = left_of(joint.limits, leader, relation)
    if limits is not None and limits[0] > limits[1]:
        text = f"[{joint.limits[0]:g}, {joint.limits[1]:g}]" if joint.limits else "none"
        expected = f"limits that those of {leader.name}, which it follows, leave a value"
        raise RobotFileError(tree.file, f"joint {joint.name}: limit", text, expected)
    return replace(joint, limits=limits)


def _with_range(joint: Joint, joints: Sequence[Joint], notes: list[str]) -> Joint:
    """A follower without limits that leave its leader one value only.

    Makers write such ones for fingers that turn back by a multiplier of −1, with limits from 0 up for all joints.
    """
    leader = next((each for each in joints if each.name == joint.follows), None)
    if leader is None or leader.limits is None or joint.limits is None:
        return joint
    low, high = sorted(limit / joint.ratio for limit in joint.limits)
    if leader.limits[0] == leader.limits[1] or max(low, leader.limits[0]) != min(high, leader.limits[1]):
        return joint
    notes.append(
        f"Joint {joint.name} has limits that leave {leader.name}, which it follows, one value: they are not kept."
    )
    return replace(joint, limits=None)


def _leaders(tree: UrdfTree, joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints that move by themselves, with what their followers leave of their limits."""
    try:
        return joints_of(joints)
    except InputError as error:
        raise RobotFileError(tree.file, f"joint {error.field}", error.value, error.expected) from None


def _peak(joint: UrdfJoint, key: str, notes: list[str]) -> float | None:
    value = joint.peak(key)
    if value is None or 0.0 < value < LARGEST:
        return value
    if value:  # zero is how a URDF says that it is not known
        notes.append(f"Joint {joint.name} has {key} {value:g}: it is read as unknown.")
    return None


def _acceleration(joint: UrdfJoint, notes: list[str]) -> float | None:
    """The largest acceleration; a row has one for speeding up and slowing down, so the smaller one counts."""
    up, down = (_peak(joint, key, notes) for key in ("acceleration", "deceleration"))
    if up is not None and down is not None and up != down:
        notes.append(f"Joint {joint.name} has acceleration {up:g} and deceleration {down:g}: the smaller counts.")
    return min((value for value in (up, down) if value is not None), default=None)


def _with_distinct_tilts(rows: Sequence[Joint]) -> tuple[Joint, ...]:
    """The rows of a table; the name made for a tilt may be that of a joint."""
    taken = {row.name for row in rows if row.moves}
    found = []
    for row in rows:
        found.append(replace(row, name=unused(row.name, taken)) if row.kind == "fixed" else row)
        taken.add(found[-1].name)
    return tuple(found)


def _transforms(chain: Sequence[UrdfJoint], followers: Followers) -> list[Array]:
    """The constant transforms before, between and after the moving joints, each joint along z of its frame.

    The offset of a follower is a part of the transform before it.
    """
    found, T = [], np.eye(4)
    for joint in chain:
        T = T @ np.array(joint.pose())
        if (relation := followers.relations.get(joint.name)) is not None and relation.offset:
            T = T @ motion_of(joint, np.array([relation.offset]))[0]
        if joint.moves:
            turn = _turn_to(np.array(joint.axis()))
            found.append(T @ turn)
            T = inverse(turn)
    return [*found, T]


def _turn_to(axis: Array) -> Array:
    """A rotation ``(4, 4)`` whose z axis is `axis`."""
    if axis[0] == axis[1] == 0.0:
        return np.diag([1.0, axis[2], axis[2], 1.0])
    return frame_of(perpendicular_to(axis), axis, np.zeros(3))


def _difference(robot: Robot, chain: Sequence[UrdfJoint], followers: Followers) -> float:
    """Largest difference of the robot's tool poses from the product of the URDF's transforms."""
    q = robot.random_q(np.random.default_rng(0), SAMPLES)
    names = [joint.name for joint in robot.joints]
    values = dict(zip(names, q.T, strict=True))
    T = np.broadcast_to(np.eye(4), (SAMPLES, 4, 4))
    for joint in chain:
        T = T @ np.array(joint.pose())
        if (relation := followers.relations.get(joint.name)) is not None:
            T = T @ motion_of(joint, relation.multiplier * values[relation.leader] + relation.offset)
        elif joint.moves:
            T = T @ motion_of(joint, values[joint.name])
    return float(np.abs(fk(robot, q) - T).max())
