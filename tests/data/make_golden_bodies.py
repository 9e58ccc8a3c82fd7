"""Writes golden-bodies.json: which links of makers' arms touch, by coal on their collision meshes.

Needs `pip install coal`. With a number as argument, that many configurations of each arm are compared with the
verdicts of the capsules and nothing is written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import coal
import numpy as np
import trimesh

sys.path.insert(0, str(Path(__file__).parents[2]))

import kin
from kin.files.urdf.collisions import Pill
from kin.files.urdf.visuals import Box, Cylinder, MeshFile, Sphere
from kin.fitting import bodies
from tests.described import ARMS, imported, triangles


def surface(name: str, shape) -> np.ndarray:
    match shape:
        case MeshFile(path, scale):
            return triangles(name, path) * np.array(scale)
        case Box(size):
            return bodies.box(*size)
        case Cylinder(radius, length):
            return np.asarray(trimesh.creation.cylinder(radius, length, sections=64).triangles)
        case Sphere(radius):
            return np.asarray(trimesh.creation.icosphere(4, radius).triangles)
        case Pill(radius, length):
            return np.asarray(trimesh.creation.capsule(length, radius).triangles)
    raise ValueError(shape)


def model(flat: np.ndarray):
    """A mesh of coal's; its triangles ``(k, 3, 3)`` need not be closed."""
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for k, point in enumerate(flat.reshape(-1, 3)):
        points.append(point)
        if k % 3 == 2:
            faces.append(coal.Triangle(k - 2, k - 1, k))
    found = coal.BVHModelOBBRSS()
    found.beginModel(len(flat), 3 * len(flat))
    found.addSubModel(points, faces)
    found.endModel()
    return found


def contacts(name: str, q: np.ndarray) -> list[list[list[int]]]:
    """The pairs of links that touch at configurations ``(k, n)``, without those that share a joint."""
    robot, links = imported(name)[0].robot, imported(name)[1]
    pieces: dict[int, list[np.ndarray]] = {}
    for link in links:
        for shape, pose in link.pieces:
            pieces.setdefault(link.link, []).append(bodies.moved(surface(name, shape), pose))
    models = {link: model(np.concatenate(each)) for link, each in pieces.items()}
    pairs = [[i, j] for i in models for j in models if j > i + 1]
    found = []
    for frames in kin.link_frames(robot, q):
        poses = {k: robot.T_world_base if k == 0 else frames[robot.joint_rows[k - 1]] for k in models}
        placed = {k: coal.Transform3s(T[:3, :3], T[:3, 3]) for k, T in poses.items()}
        found.append(
            [
                [i, j]
                for i, j in pairs
                if coal.collide(
                    *(models[i], placed[i], models[j], placed[j]), coal.CollisionRequest(), coal.CollisionResult()
                )
            ]
        )
    return found


def main() -> None:
    rng = np.random.default_rng(7)
    many = int(sys.argv[1]) if sys.argv[1:] else 0
    data = {}
    for name in ARMS:
        robot = imported(name)[0].robot
        q = robot.random_q(rng, many or 240).round(3)
        touching = contacts(name, q)
        true = np.array([bool(each) for each in touching])
        ours = kin.clearance(robot, q) < 0.0
        false = (ours & ~true).sum() / max(1, (~true).sum())
        print(
            f"{name}: {len(robot.capsules)} capsules; {true.mean():.1%} touch, {(true & ~ours).sum()} missed "
            f"({sorted({tuple(pair) for k in np.flatnonzero(true & ~ours) for pair in touching[k]})}), "
            f"{false:.1%} of the free ones are false alarms",
            flush=True,
        )
        data[name] = {"q": q.tolist(), "touching": touching}
    if not many:
        Path(__file__).with_name("golden-bodies.json").write_text(json.dumps(data) + "\n", "utf-8")


main()
