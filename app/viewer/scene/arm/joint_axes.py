"""The joint axes of an arm through its drawn body: rods that stand out of it on both sides.

A rod is as long as the axis is inside the body: from its first to its last crossing with a surface of the two
links of the joint. A surface of the next link that follows at once, as in a wrist, counts as well.
"""

from __future__ import annotations

import numpy as np

from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.bodies.parts import Part, joint_color
from app.viewer.scene.meshes import Body, rod
from app.viewer.scene.shapes import Solid, placed
from kin import Robot
from kin.axes import inverse
from kin.transforms import Array, pose_from_position_wxyz

NEAR = 4.0  # from the end of a rod to where the next link counts, in thicknesses of the arm
BEHIND, AHEAD = 1.5, 2.4  # how far a rod stands out, in thicknesses of the arm


def axes(robot: Robot, made: Body, drawn: Drawing) -> tuple[Part, ...]:
    """One rod about z for each moving row, in the frame of its link; its arrow shows the positive turn."""
    links, parts, r = made.chain.links, [], made.size
    home = robot.expand(robot.q_home)
    for k, link in enumerate(links[1:], 1):
        heights = [
            *_heights(drawn.parts[k - 1], inverse(link.T_parent_axis)),
            *_heights(drawn.parts[k], np.eye(4)),
        ]
        low, high = min(heights, default=0.0), max(heights, default=0.0)
        if k + 1 < len(links):
            after = links[k + 1].pose(float(home[k]))
            beyond = _heights(drawn.parts[k + 1], pose_from_position_wxyz(*after))
            near = [height for height in beyond if low - NEAR * r < height < high + NEAR * r]
            low, high = min([low, *near]), max([high, *near])
        parts.append(Part("joint-axis", rod(r, low - BEHIND * r, high + AHEAD * r), joint_color(link.leader)))
    return tuple(parts)


def _heights(group: tuple[Part, ...], T: Array) -> list[float]:
    """Where the z axis crosses the surfaces of a link, whose pose is `T` ``(4, 4)``."""
    return [height for part in group for height in _crossings(placed(part.mesh, T)).tolist()]


def _crossings(mesh: Solid) -> Array:
    """The heights z ``(k,)`` at which the z axis crosses the faces of a mesh."""
    corners = np.asarray(mesh.vertices, dtype=float)[np.asarray(mesh.faces)]
    x, y, z = np.moveaxis(corners, 2, 0)
    # Twice the areas between axis and edges, seen along the axis: of one sign where it passes through the face.
    areas = x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)
    whole = areas.sum(axis=1)
    through = ((areas >= 0.0).all(axis=1) | (areas <= 0.0).all(axis=1)) & (whole != 0.0)
    weights = np.roll(areas[through], -1, axis=1)  # of a corner: the area of the edge that it is not on
    out: Array = (weights * z[through]).sum(axis=1) / whole[through]
    return out
