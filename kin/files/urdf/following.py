"""Joints of a chain that follow others: `<mimic>` of URDF, and the equalities of two joints that MJCF has.

A follower has the value ``multiplier · leader + offset``. A leader may itself follow: then the relations are put
together. Rows of a table follow a joint of the same arm, so where a leader is beside the chain, as where a motor
in the base drives a linkage, the first of its followers becomes the joint in its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from kin.errors import RobotFileError
from kin.files.mjcf.convert import POLYNOMIAL
from kin.files.urdf.tree import MOVING, UrdfJoint, UrdfTree


class Relation(NamedTuple):
    """How a joint follows: its value is ``multiplier · leader + offset`` (rad or m)."""

    leader: str
    multiplier: float
    offset: float


class Followers(NamedTuple):
    """The followers of a chain.

    Attributes:
        relations: by the name of the follower; each leader is a joint of the chain that moves by itself.
        replaced: by the name of the first follower of a leader beside the chain, how it follows that one.
    """

    relations: dict[str, Relation]
    replaced: dict[str, Relation]


def followers_of(tree: UrdfTree, chain: Sequence[UrdfJoint]) -> Followers:
    """The joints of a chain that follow others.

    Raises:
        RobotFileError: a leader that does not exist or does not move, a circle, or a relation that is not linear.
    """
    known = {joint.name: joint for joint in reversed(tree.joints)}
    own = {joint.name for joint in chain if joint.moves and joint.element.find("mimic") is None}
    relations: dict[str, Relation] = {}
    replaced: dict[str, Relation] = {}
    instead: dict[str, str] = {}  # by leaders beside the chain, the joints in their places
    for joint in chain:
        if not joint.moves or joint.element.find("mimic") is None:
            continue
        found = _relation(joint, known)
        if found.leader in own:
            relations[joint.name] = found
        elif found.leader not in instead:
            instead[found.leader] = joint.name
            replaced[joint.name] = found
        else:
            first = instead[found.leader]
            share = found.multiplier / replaced[first].multiplier
            relations[joint.name] = Relation(first, share, found.offset - share * replaced[first].offset)
    return Followers(relations, replaced)


def relation_of(tree: UrdfTree, joint: UrdfJoint) -> Relation:
    """How any joint follows the one at the end of its leaders; itself if it follows none.

    Raises:
        RobotFileError: as `followers_of`.
    """
    return _relation(joint, {each.name: each for each in reversed(tree.joints)})


def _relation(joint: UrdfJoint, known: dict[str, UrdfJoint]) -> Relation:
    """How a joint follows the one at the end of its leaders, which moves by itself."""
    multiplier, offset = 1.0, 0.0
    seen, at = [joint.name], joint
    while (mimic := at.element.find("mimic")) is not None:
        if (curve := mimic.get(POLYNOMIAL)) is not None:
            raise at.refuse("equality polycoef", curve, "a linear relation: no numbers but 0 after the second")
        name = mimic.get("joint", "").strip()
        if name not in known:
            raise at.refuse("mimic joint", name, "the name of a joint of this file")
        if name in seen:
            raise at.refuse("mimic joint", ", ".join([*seen, name]), "a joint that does not follow itself")
        own = at.number("mimic", "multiplier", mimic.get("multiplier", "1"))
        if own == 0.0:
            expected = "a number that is not 0: a joint that stands still is fixed"
            raise at.refuse("mimic multiplier", mimic.get("multiplier"), expected)
        offset += multiplier * at.number("mimic", "offset", mimic.get("offset", "0"))
        multiplier *= own
        seen.append(name)
        at = known[name]
    if at.type not in MOVING:
        raise joint.refuse("mimic joint", at.name, "a joint that turns or slides")
    return Relation(at.name, multiplier, offset)


def left_of(
    limits: tuple[float, float] | None, leader: UrdfJoint, relation: Relation
) -> tuple[float, float] | None:
    """The limits of a joint that stands for its leader: its own, as far as the leader's allow."""
    try:
        given = leader.limits()
    except RobotFileError:  # a joint beside the arm is not judged
        given = None
    if given is None or not all(map(math.isfinite, given)) or not given[0] < given[1]:
        return limits
    low, high = sorted(relation.multiplier * end + relation.offset for end in given)
    if limits is None:
        return low, high
    return max(limits[0], low), min(limits[1], high)
