"""URDF → `Robot`: any serial chain of revolute, continuous, prismatic and fixed joints, exactly.

The joint values are those of the URDF: zero positions and positive directions are kept, and so are the limits of
position, velocity and effort. Each import is checked: the tool poses of the robot are compared with the product of
the URDF's own transforms at random configurations.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kin.axes import frame_of, inverse, perpendicular_to
from kin.dh import SAMPLES, table_of_chain
from kin.errors import RobotFileError
from kin.files.read import MAX_REACH, MAX_ROWS, matrix_of
from kin.files.urdf.tree import Tip, UrdfJoint, UrdfTree, read_tree
from kin.fk import fk
from kin.home import default_home
from kin.robot import DEFAULT_LIMITS, Joint, Robot
from kin.transforms import Array


@dataclass(frozen=True)
class UrdfReport:
    """What became of a URDF.

    Attributes:
        base, tip: the links between which the arm was read.
        tips: the links that could have been chosen as the tip.
        joints: the moving joints, in the order of q.
        merged: the fixed joints of the chain, which became part of its constant transforms.
        ignored: the joints that are no part of the chain.
        tilts: the fixed rows that hold the small angle between two almost parallel axes.
        notes: what was assumed, one sentence each.
        difference: largest difference of any entry of the tool pose from the product of the URDF's transforms.
        samples: the number of random configurations at which it was measured.
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


class UrdfRobot(NamedTuple):
    """A robot read from a URDF, and the report about it."""

    robot: Robot
    report: UrdfReport


def load_urdf(source: Path | str, base: str | None = None, tip: str | None = None) -> Robot:
    """The robot that a URDF describes; see `read_urdf`, which reports about it as well."""
    return read_urdf(source, base, tip).robot


def read_urdf(source: Path | str, base: str | None = None, tip: str | None = None, file: str = "") -> UrdfRobot:
    """The serial arm between two links of a URDF, as a standard DH table.

    Args:
        source: the path of a file, or the text itself, which contains a ``<``.
        base: the link the arm stands on; by default the root.
        tip: the link that is the tool; needed if several are possible.
        file: the name used in messages.

    Raises:
        RobotFileError: the file is invalid, or describes no serial arm; the message names the joint or link.
    """
    tree = _tree(source, file)
    return _import(tree, tree.chain(base, tip))


def urdf_tips(source: Path | str, file: str = "") -> tuple[Tip, ...]:
    """The links of a URDF that can be the tip of an arm, those with the most joints first; see `read_urdf`."""
    return _tree(source, file).tips


def _tree(source: Path | str, file: str) -> UrdfTree:
    if isinstance(source, str) and "<" in source:
        return read_tree(source.encode("utf-8", "replace"), file or "URDF")
    try:
        content = Path(source).read_bytes()
    except (OSError, ValueError) as error:
        raise RobotFileError(str(source), "file", str(error), "a readable URDF file") from error
    return read_tree(content, file or str(source))


def _import(tree: UrdfTree, chain: Sequence[UrdfJoint]) -> UrdfRobot:
    moving = [joint for joint in chain if joint.moves]
    if len(moving) > MAX_ROWS:
        raise RobotFileError(tree.file, "joint", f"{len(moving)} moving joints", f"at most {MAX_ROWS}")
    notes: list[str] = []
    joints = [_joint(joint, notes) for joint in moving]
    table = table_of_chain(joints, _transforms(chain))
    if len(table.rows) > MAX_ROWS:
        raise RobotFileError(tree.file, "joint", f"{len(table.rows)} DH rows", f"at most {MAX_ROWS}")
    name = tree.name.strip() or "robot"
    robot = Robot(
        id=re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")[:40].strip("-") or "robot",
        name=name[:200],
        source=f"URDF {Path(tree.file).name}, from link {chain[0].parent} to link {chain[-1].child}",
        convention="standard",
        rows=table.rows,
        home=tuple(0.5 * sum(joint.limits or (0.0,)) for joint in joints),
        base=table.base,
        tool=table.tool,
    )
    if robot.reach > MAX_REACH:
        raise RobotFileError(tree.file, "joint", f"a reach of {robot.reach:g} m", f"at most {MAX_REACH:g} m")
    robot = replace(robot, home=default_home(robot))
    used = {joint.name for joint in chain}
    report = UrdfReport(
        base=chain[0].parent,
        tip=chain[-1].child,
        tips=tree.tips,
        joints=tuple(joint.name for joint in moving),
        merged=tuple(joint.name for joint in chain if not joint.moves),
        ignored=tuple(joint.name for joint in tree.joints if joint.name not in used),
        tilts=tuple(row.name for row in table.rows if row.kind == "fixed"),
        notes=tuple(notes),
        difference=_difference(robot, chain),
        samples=SAMPLES,
    )
    return UrdfRobot(robot, report)


def _joint(joint: UrdfJoint, notes: list[str]) -> Joint:
    limits = joint.limits()
    if limits is None and joint.type != "continuous":
        if joint.kind == "prismatic":
            raise joint.refuse("limit", "no lower and upper", "the limits of the slide in metres")
        limits = DEFAULT_LIMITS["revolute"]
        notes.append(f"Joint {joint.name} states no limits: it gets −180° to 180°.")
    return Joint(
        joint.name,
        kind=joint.kind,
        limits=limits,
        velocity=joint.positive("velocity"),
        effort=joint.positive("effort"),
    )


def _transforms(chain: Sequence[UrdfJoint]) -> list[Array]:
    """The constant transforms before, between and after the moving joints, each joint along z of its frame."""
    found, T = [], np.eye(4)
    for joint in chain:
        T = T @ np.array(matrix_of(*joint.origin()))
        if joint.moves:
            turn = _turn_to(np.array(joint.axis()))
            found.append(T @ turn)
            T = inverse(turn)
    return [*found, T]


def _turn_to(axis: Array) -> Array:
    """A rotation ``(4, 4)`` whose z axis is `axis`."""
    if abs(axis[2]) == 1.0:
        return np.diag([1.0, axis[2], axis[2], 1.0])
    return frame_of(perpendicular_to(axis), axis, np.zeros(3))


def _difference(robot: Robot, chain: Sequence[UrdfJoint]) -> float:
    """Largest difference of the robot's tool poses from the product of the URDF's transforms."""
    q = robot.random_q(np.random.default_rng(0), SAMPLES)
    T, i = np.broadcast_to(np.eye(4), (SAMPLES, 4, 4)), 0
    for joint in chain:
        T = T @ np.array(matrix_of(*joint.origin()))
        if joint.moves:
            T = T @ _motion(joint, q[:, i])
            i += 1
    return float(np.abs(fk(robot, q) - T).max())


def _motion(joint: UrdfJoint, values: Array) -> Array:
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
