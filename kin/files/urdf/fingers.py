"""Fingers beside the arm of a URDF: links that joints beside the chain move.

They are no part of the arm, and no pose depends on them; where they are drawn, a gripper opens and closes. Fingers
that follow each other by `<mimic>` have the range of the one that leads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kin.axes import frame_of, perpendicular_to
from kin.errors import RobotFileError
from kin.files.urdf.following import relation_of
from kin.files.urdf.tree import MOVING, UrdfJoint, UrdfTree
from kin.transforms import Array

_DEEPEST = 8  # joints of a finger, one behind the other


@dataclass(frozen=True, eq=False)
class FingerMotion:
    """What a joint beside the chain does.

    Attributes:
        joint: its name.
        carrier: how many joints of the chain move the link that it is on.
        T_root_axis: frame ``(4, 4)`` in the root along whose z axis it slides, or about which it turns, with all
            joints of the chain at zero.
        slides: whether it slides.
        closed, open: the ends of its range from where it is drawn, m or rad; those of the lower and upper limit of
            the joint that leads.
        on: the motion of the part of the finger that carries it; None: it is on a link of the arm.
    """

    joint: str
    carrier: int
    T_root_axis: Array
    slides: bool
    closed: float
    open: float
    on: FingerMotion | None = None


def fingers_of(
    tree: UrdfTree, chain: tuple[UrdfJoint, ...], carriers: dict[str, int], poses: dict[str, Array]
) -> dict[str, FingerMotion]:
    """The motion of each link that joints beside the chain move; the others are left out.

    A joint without a range stays as it is drawn, on what moves it.

    Args:
        carriers, poses: of the links, as `poses_of` gives them.
    """
    own = {joint.name for joint in chain}
    made: dict[str, FingerMotion | None] = {}
    found: dict[str, FingerMotion] = {}
    for link in poses:
        beside: list[UrdfJoint] = []  # the outer ones first
        at = link
        while at in tree.parents and tree.parents[at].name not in own and len(beside) <= _DEEPEST:
            joint = tree.parents[at]
            beside += [joint] * (joint.type in MOVING)
            at = joint.parent
        if len(beside) > _DEEPEST or any(joint.parent not in poses for joint in beside):
            continue
        motion = None
        for joint in reversed(beside):
            if joint.name not in made:
                made[joint.name] = _motion(tree, joint, own, carriers[joint.parent], poses[joint.parent], motion)
            motion = made[joint.name] or motion
        if motion is not None:
            found[link] = motion
    return found


def _motion(
    tree: UrdfTree, joint: UrdfJoint, own: set[str], carrier: int, T_root_parent: Array, on: FingerMotion | None
) -> FingerMotion | None:
    """The motion of a joint beside the chain; None without a range, or if a joint of the chain leads it."""
    try:
        name, multiplier, offset = relation_of(tree, joint)
        leader = next(each for each in tree.joints if each.name == name)
        limits = leader.limits()
        if name in own or limits is None or not all(map(math.isfinite, limits)) or not limits[0] < limits[1]:
            return None
        T, axis = T_root_parent @ np.array(joint.pose()), np.array(joint.axis())
    except RobotFileError:  # a joint beside the arm is not judged
        return None
    turned = frame_of(perpendicular_to(axis), axis, np.zeros(3))
    rest = joint.resting()
    closed, open_ = (multiplier * end + offset - rest for end in limits)
    return FingerMotion(joint.name, carrier, T @ turned, joint.kind == "prismatic", closed, open_, on)
