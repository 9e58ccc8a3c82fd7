"""The visible bodies of a URDF as the drawn body of the arm that was read from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.viewer.meshes.archive import MeshError
from app.viewer.meshes.reader import Meshes
from app.viewer.meshes.surface import Points, Rgb, Surface, by_color
from app.viewer.scene.bodies import Drawing
from app.viewer.scene.bodies.parts import Part
from app.viewer.scene.chain import link_poses
from app.viewer.scene.shapes import Solid, ball, box, cylinder
from kin import Robot
from kin.axes import inverse
from kin.files.urdf.visuals import Box, Cylinder, MeshFile, Shape, Sphere, Visual
from kin.transforms import Array

PLAIN: Rgb = (196, 201, 208)  # of what nothing gives a colour
COLORS = 8  # of one link
FARTHEST = 10.0  # times the reach of the arm: a mesh beyond is not in metres
COVER = 150  # points of a link that are tested against pedestal and floor
LOOKED_AT = 20_000  # points of a link among which these are chosen
MOST_DRAWN = 120_000  # triangles of an arm, its boxes, cylinders and spheres included
SAME = 1e-7  # of the reach, or rad: differences of two tables that describe one arm


def mesh_files(visuals: Sequence[Visual]) -> dict[str, int]:
    """The paths of the mesh files, and how often each is drawn."""
    paths = [visual.shape.path for visual in visuals if isinstance(visual.shape, MeshFile)]
    return {path: paths.count(path) for path in dict.fromkeys(paths)}


def drawing_of(robot: Robot, visuals: Sequence[Visual], meshes: Meshes) -> Drawing:
    """The drawn body of a robot that was read from a URDF.

    Args:
        meshes: of all files in `visuals`, by their path there.

    Raises:
        MeshError: a mesh is far too large, as one in millimetres is.
    """
    poses = link_poses(robot, np.zeros((1, robot.n)))[0]
    links: list[list[Surface]] = [[] for _ in poses]
    size = max(robot.reach, 0.01)
    drawn = 0
    for visual in visuals:
        T = inverse(poses[visual.carrier]) @ visual.T_root_visual
        for surface in _surfaces(visual.shape, visual.color, meshes):
            drawn += len(surface.faces)
            if drawn > MOST_DRAWN:
                expected = f"at most {MOST_DRAWN} with all shapes"
                raise MeshError("meshes: triangles to draw", f"more than {MOST_DRAWN}", expected)
            placed = _placed(surface, T)
            extent = float(np.abs(placed.points).max())
            if not extent <= FARTHEST * size:
                mesh = visual.shape.path if isinstance(visual.shape, MeshFile) else ""
                name = f"mesh {mesh}" if mesh else f"a shape of link {visual.link}"
                expected = f"at most {FARTHEST:g} times the reach of {robot.reach:.3g} m"
                hint = "; is it in millimetres? Then give it the scale 0.001 0.001 0.001"
                raise MeshError(f"{name}: size", f"{extent:.3g} m", expected + hint)
            links[visual.carrier].append(placed)
    return _drawing(links)


def size_of(body: Drawing) -> int:
    """The bytes of a drawn body."""
    meshes = [part.mesh for link in body.parts for part in link]
    return sum(mesh.vertices.nbytes + mesh.faces.nbytes for mesh in meshes)


def _surfaces(shape: Shape, color: tuple[float, float, float] | None, meshes: Meshes) -> list[Surface]:
    """A shape in its own coordinates; the colours of a mesh file come before that of the URDF."""
    plain: Rgb = PLAIN
    if color is not None:
        red, green, blue = (round(255 * value) for value in color)
        plain = red, green, blue
    if isinstance(shape, MeshFile):
        scale = np.array(shape.scale, dtype=np.float32)
        mirrored = scale.prod() < 0.0
        return [
            Surface(color or plain, points * scale, faces[:, ::-1] if mirrored else faces)
            for color, points, faces in meshes.files[shape.path]
        ]
    match shape:
        case Box(size):
            solid = box(-0.5 * np.array(size), 0.5 * np.array(size))
        case Cylinder(radius, length):
            solid = cylinder(radius, -0.5 * length, 0.5 * length, bevel=0.0)
        case Sphere(radius):
            solid = ball(radius)
    return [Surface(plain, np.asarray(solid.vertices, dtype=np.float32), np.asarray(solid.faces, dtype=np.uint32))]


def _placed(surface: Surface, T: Array) -> Surface:
    points = surface.points @ T[:3, :3].T.astype(np.float32) + T[:3, 3].astype(np.float32)
    return surface._replace(points=points)


def _drawing(links: Sequence[Sequence[Surface]]) -> Drawing:
    parts, spheres = [], []
    for surfaces in links:
        joined = by_color(surfaces, COLORS)
        parts.append(
            tuple(
                Part(f"mesh-{k}", Solid(surface.points, surface.faces), surface.color or PLAIN, double_sided=True)
                for k, surface in enumerate(joined)
            )
        )
        spheres.append(_cover([surface.points for surface in joined]))
    return Drawing(tuple(parts), tuple(spheres))


def _cover(clouds: Sequence[Points]) -> Array:
    """Some points of the surfaces, spread evenly, as spheres ``(k, 4)`` without a radius."""
    if not clouds:
        return np.empty((0, 4))
    points = np.vstack(clouds)
    points = points[:: max(1, len(points) // LOOKED_AT)].astype(float)
    low, high = points.min(axis=0), points.max(axis=0)
    cell = float((high - low).max()) / 8.0 or 1.0
    x, y, z = np.floor((points - low) / cell).astype(np.int64).T
    _, first = np.unique((x << 32) | (y << 16) | z, return_index=True)
    chosen = points[np.sort(first)]
    chosen = chosen[:: max(1, len(chosen) // COVER)]
    return np.column_stack([chosen, np.zeros(len(chosen))])


def carried_over(drawing: Drawing, before: Robot, robot: Robot) -> Drawing | None:
    """The drawn body of one robot for another table of the same arm; None if it is another arm.

    Names, limits, tool and base may differ, and the convention, as long as every joint turns or slides the same
    link about the same line by the same amount.
    """
    if [joint.kind for joint in before.joints] != [joint.kind for joint in robot.joints]:
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
    if all(np.abs(shift - np.eye(4)).max() < 1e-12 for shift in shifts):
        return drawing
    parts = tuple(
        tuple(_moved(part, shift) for part in link) for link, shift in zip(drawing.parts, shifts, strict=True)
    )
    spheres = tuple(
        np.column_stack([cover[:, :3] @ shift[:3, :3].T + shift[:3, 3], cover[:, 3]])
        for cover, shift in zip(drawing.spheres, shifts, strict=True)
    )
    return Drawing(parts, spheres)


def _moved(part: Part, T: Array) -> Part:
    points = part.mesh.vertices @ T[:3, :3].T.astype(np.float32) + T[:3, 3].astype(np.float32)
    return Part(part.name, Solid(points, part.mesh.faces), part.color, double_sided=part.double_sided)
