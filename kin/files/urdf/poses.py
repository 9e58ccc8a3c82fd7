"""Where the links of a URDF are."""

from __future__ import annotations

import numpy as np

from kin.errors import RobotFileError
from kin.files.urdf.following import followers_of
from kin.files.urdf.tree import MOVING, UrdfJoint, UrdfTree, motion_of
from kin.transforms import Array


def poses_of(tree: UrdfTree, chain: tuple[UrdfJoint, ...]) -> tuple[dict[str, int], dict[str, Array]]:
    """For each link below the root of the chain: the joints of the chain that move it, and its pose at zero.

    Links behind a joint beside the chain whose numbers cannot be read are left out: only the chain is judged.
    """
    moving = {joint.name for joint in chain if joint.moves}
    relations = followers_of(tree, chain).relations
    links = [chain[0].parent]
    carriers, poses = {links[0]: 0}, {links[0]: np.eye(4)}
    for link in links:  # grows meanwhile
        for joint in tree.children.get(link, ()):
            try:
                T = poses[link] @ np.array(joint.pose())
                if joint.type in MOVING and joint.name not in moving:
                    T = T @ motion_of(joint, np.array([joint.resting()]))[0]
                elif joint.name in relations:  # where it is with its leader at zero
                    T = T @ motion_of(joint, np.array([relations[joint.name].offset]))[0]
            except RobotFileError:
                if joint in chain:
                    raise
                continue  # nobody knows where the links behind it are
            carriers[joint.child] = carriers[link] + (joint.name in moving)
            poses[joint.child] = T
            links.append(joint.child)
    return carriers, poses
