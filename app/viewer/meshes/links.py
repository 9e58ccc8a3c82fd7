"""The visible bodies of a URDF as the drawn body of the arm that was read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.viewer.meshes.fitting import bodies_of
from app.viewer.meshes.placing import PLAIN, Piece, Shapes, placed
from app.viewer.meshes.surface import LinkBody, Surface
from app.viewer.scene.bodies.drawing import Drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.bodies.parts import Part
from app.viewer.scene.chain import link_poses
from app.viewer.scene.shapes import Solid, ball, box, cylinder
from kin import Robot, link_frames
from kin.axes import inverse
from kin.collision import Capsule
from kin.files.urdf.collisions import LinkPieces
from kin.files.urdf.fingers import FingerMotion
from kin.files.urdf.visuals import Box, Cylinder, MeshFile, Sphere, Visual
from kin.transforms import Array

CARRIED = 6  # decimals of metres of capsules in the frames of another table
SAME = 1e-7  # of the reach, or rad: differences of two tables that describe one arm


def shapes_of(robot: Robot, visuals: Sequence[Visual], links: Sequence[LinkPieces] = ()) -> Shapes:
    """The visible bodies of a robot from a URDF, in the frames of its links.

    Args:
        links: its collision bodies.
    """
    poses = [inverse(T) for T in link_poses(robot, np.zeros((1, robot.n)))[0]]
    motions = _motions(visuals)
    pieces: list[Piece] = []
    solids: list[Surface] = []
    for visual in visuals:
        pose = (poses[visual.carrier] @ visual.T_root_visual)[:3].ravel().tolist()
        color = None if visual.color is None else [round(255 * value) for value in visual.color]
        # Fingers come behind the links of the arm, as `drawing_of` takes them apart.
        carrier = visual.carrier if visual.finger is None else len(poses) + motions.index(visual.finger)
        if isinstance(visual.shape, MeshFile):
            path, scale = visual.shape
            pieces.append(Piece(path, carrier, pose, scale, color, visual.link))
        else:
            pieces.append(Piece(len(solids), carrier, pose, color=color, link=visual.link))
            solids.append(_solid(visual.shape))
    return Shapes(pieces, solids, len(poses) + len(motions), robot.reach, bodies_of(links))


def _motions(visuals: Sequence[Visual]) -> list[FingerMotion]:
    """The motions of fingers, each once."""
    return list(dict.fromkeys(visual.finger for visual in visuals if visual.finger is not None))


def fingers_of(robot: Robot, visuals: Sequence[Visual]) -> tuple[Finger, ...]:
    """The fingers of a robot from a URDF, without parts, in the order in which `shapes_of` has them."""
    poses = [inverse(T) for T in link_poses(robot, np.zeros((1, robot.n)))[0]]

    def finger(each: FingerMotion) -> Finger:
        on, T = None if each.on is None else finger(each.on), poses[each.carrier] @ each.T_root_axis
        return Finger(each.carrier, (), T, each.slides, each.closed, each.open, on)

    return tuple(map(finger, _motions(visuals)))


def drawing_without_meshes(shapes: Shapes, fingers: Sequence[Finger] = ()) -> Drawing:
    """The drawn body of a robot whose URDF has boxes, cylinders and spheres only; raises `MeshError`."""
    return drawing_of(placed(shapes, {}), fingers)


def drawing_of(links: Sequence[LinkBody], fingers: Sequence[Finger] = ()) -> Drawing:
    """The drawn body of finished links; the last ones are the bodies of the fingers, which have no parts yet."""
    every = tuple(
        tuple(
            Part(f"mesh-{k}", Solid(surface.points, surface.faces), surface.color or PLAIN, double_sided=True)
            for k, surface in enumerate(link.surfaces)
        )
        for link in links
    )
    spheres = [np.column_stack([link.cover.astype(float), np.zeros(len(link.cover))]) for link in links]
    count = len(links) - len(fingers)
    for finger, cover in zip(fingers, spheres[count:], strict=True):  # as it is drawn
        spheres[finger.link] = np.concatenate([spheres[finger.link], cover])
    moving = tuple(replace(finger, parts=parts) for finger, parts in zip(fingers, every[count:], strict=True))
    return Drawing(every[:count], tuple(spheres[:count]), moving)


def size_of(body: Drawing) -> int:
    """The bytes of a drawn body."""
    links = (*body.parts, *(finger.parts for finger in body.fingers))
    meshes = [part.mesh for link in links for part in link]
    return sum(mesh.vertices.nbytes + mesh.faces.nbytes for mesh in meshes)


def _solid(shape: Box | Cylinder | Sphere) -> Surface:
    """A shape in its own coordinates."""
    match shape:
        case Box(size):
            solid = box(-0.5 * np.array(size), 0.5 * np.array(size))
        case Cylinder(radius, length):
            solid = cylinder(radius, -0.5 * length, 0.5 * length, bevel=0.0)
        case Sphere(radius):
            solid = ball(radius)
    return Surface(None, np.asarray(solid.vertices, dtype=np.float32), np.asarray(solid.faces, dtype=np.uint32))


def carried_over(drawing: Drawing, before: Robot, robot: Robot) -> Drawing | None:
    """The drawn body of one robot for another table of the same arm; None if it is another arm.

    Names, limits, tool and base may differ, and the convention, as long as every joint turns or slides the same
    link about the same line by the same amount.
    """
    shifts = _shifts(before, robot)
    if shifts is None:
        return None
    if all(np.abs(shift - np.eye(4)).max() < 1e-12 for shift in shifts):
        return drawing
    parts = tuple(
        tuple(_moved(part, shift) for part in link) for link, shift in zip(drawing.parts, shifts, strict=True)
    )
    spheres = tuple(
        np.column_stack([cover[:, :3] @ shift[:3, :3].T + shift[:3, 3], cover[:, 3]])
        for cover, shift in zip(drawing.spheres, shifts, strict=True)
    )
    fingers = tuple(
        each.moved(tuple(_moved(part, shifts[each.link]) for part in each.parts), shifts[each.link])
        for each in drawing.fingers
    )
    return Drawing(parts, spheres, fingers)


def capsules_for(before: Robot, robot: Robot) -> Robot:
    """A robot with the capsules of another table of the same arm, as `carried_over`; without, if it is another."""
    bare = replace(robot, capsules=(), capsules_source="")
    if not before.capsules or _shifts(before, robot) is None:
        return bare
    zeros = [np.zeros(each.n) for each in (before, robot)]
    old, new = (link_frames(each, q) for each, q in zip((before, robot), zeros, strict=True))
    move = robot.T_world_base @ inverse(before.T_world_base)
    found = []
    for each in before.capsules:
        row = robot.moving_rows[each.link - 1] if each.link else -1
        there = old[each.row] if each.row >= 0 else before.T_world_base
        T = inverse(new[row] if each.link else robot.T_world_base) @ move @ there
        if np.abs(T - np.eye(4)).max() < 1e-12:
            found.append(replace(each, row=row))
            continue
        points = np.array([each.start, each.end]) @ T[:3, :3].T + T[:3, 3]
        (x, y, z), (u, v, w) = np.round(points, CARRIED).tolist()
        radius = round(each.radius + 2.0 * 10.0**-CARRIED, CARRIED)
        found.append(Capsule(each.link, row, (x, y, z), (u, v, w), radius, each.assumed))
    return replace(bare, capsules=tuple(found), capsules_source=before.capsules_source)


def _shifts(before: Robot, robot: Robot) -> list[Array] | None:
    """What leads from each link's frame of one table to that of the other; None if it is another arm."""
    if [joint.kind for joint in before.free.joints] != [joint.kind for joint in robot.free.joints]:
        return None
    if not np.array_equal(before.expansion, robot.expansion):
        return None
    zeros = np.zeros((1, robot.n))
    move = robot.T_world_base @ inverse(before.T_world_base)
    # What the table moves from one link's frame to the other's: the base may stand elsewhere.
    poses = [*(move @ T for T in link_poses(before, zeros)[0])]
    shifts = [inverse(new) @ old for old, new in zip(poses, link_poses(robot, zeros)[0], strict=True)]
    close = SAME * max(robot.reach, 1.0)
    for shift in shifts[1:]:
        along = max(abs(shift[2, 2] - 1.0), float(np.abs(shift[:2, 2]).max()))
        if along > SAME or np.abs(shift[:2, 3]).max() > close:
            return None
    return shifts


def _moved(part: Part, T: Array) -> Part:
    points = part.mesh.vertices @ T[:3, :3].T.astype(np.float32) + T[:3, 3].astype(np.float32)
    return Part(part.name, Solid(points, part.mesh.faces), part.color, double_sided=part.double_sided)
