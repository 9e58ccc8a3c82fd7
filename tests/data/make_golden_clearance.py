"""Writes golden-clearance.json and golden-obstacles.json: distances between the links of each built-in arm, and
with obstacles around it, computed by coal.

Needs `pip install coal`. With a number as argument, that many configurations of each arm are compared and nothing
is written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import coal
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import kin
from kin.collision import capsules, clearance
from kin.collision.bodies import bodies_of

OBSTACLES = [
    kin.Obstacle("box", (0.5, 0.1, 0.3), (0.1, 0.2, 0.3), size=(0.2, 0.3, 0.4), name="crate"),
    kin.Obstacle("sphere", (0.0, 0.55, 0.4), radius=0.1),
    kin.Obstacle("cylinder", (-0.1, -0.5, 0.3), (0.3, 0.5, 0.0), radius=0.08, height=0.5),
    kin.Obstacle("table", (-0.7, 0.0, -0.1), (0.0, 0.0, 0.4), size=(0.6, 0.9, 0.3)),
]


def solid(obstacle: kin.Obstacle):
    T = coal.Transform3s(obstacle.T[:3, :3], obstacle.T[:3, 3])
    if obstacle.shape == "sphere":
        return coal.Sphere(obstacle.radius), T
    if obstacle.shape == "cylinder":
        return coal.Cylinder(obstacle.radius, obstacle.height), T
    return coal.Box(*obstacle.size), T


def distance_by_coal(robot: kin.Robot, q: np.ndarray, obstacles=()) -> float:
    """The least distance of the pairs that kin compares."""
    frames = kin.link_frames(robot, q)
    shapes = []
    for capsule in capsules(robot):
        T = robot.T_world_base if capsule.row < 0 else frames[capsule.row]
        start, end = (T[:3, :3] @ point + T[:3, 3] for point in (capsule.start, capsule.end))
        way = end - start
        length = float(np.linalg.norm(way))
        R = rotation_to(way / length) if length > 0.0 else np.eye(3)
        shapes.append((coal.Capsule(capsule.radius, length), coal.Transform3s(R, (start + end) / 2.0)))
    found = np.inf
    for i, j in bodies_of(robot).pairs.tolist():
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = min(found, coal.distance(*shapes[i], *shapes[j], request, result))
    for i in bodies_of(robot).moving.tolist():
        for each in obstacles:
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            found = min(found, coal.distance(*shapes[i], *solid(each), request, result))
    return float(found)


def rotation_to(z: np.ndarray) -> np.ndarray:
    """A rotation whose third column is z."""
    x = np.cross([1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def compared(robot: kin.Robot, q: np.ndarray, obstacles=()) -> list[dict]:
    """Configurations with their distances by coal, after a line about the differences."""
    theirs = np.array([distance_by_coal(robot, each, obstacles) for each in q])
    ours = clearance(robot, q, obstacles)
    free = theirs > 0.0 if obstacles else np.ones(len(q), bool)
    apart = np.abs(ours - theirs)[free].max(initial=0.0)
    wrong = int(((theirs < 0.0) != (ours < 0.0)).sum())
    print(f"{robot.id}: {apart:.1e} m apart, {wrong} of {len(q)} judged differently", flush=True)
    return [{"q": row.tolist(), "distance": d} for row, d in zip(q, theirs.tolist(), strict=True)]


def main() -> None:
    rng = np.random.default_rng(5)
    many = int(sys.argv[1]) if sys.argv[1:] else 0
    alone, among = {}, {}
    for robot in kin.files.classic_robots().values():
        if len(bodies_of(robot).pairs):
            alone[robot.id] = compared(robot, robot.random_q(rng, many or 12))
        among[robot.id] = compared(robot, robot.random_q(rng, many or 12), OBSTACLES)
    if not many:
        folder = Path(__file__).parent
        found = {"obstacles": [each.as_dict() for each in OBSTACLES], "arms": among}
        for name, data in (("golden-clearance.json", alone), ("golden-obstacles.json", found)):
            (folder / name).write_text(json.dumps(data, indent=1) + "\n", "utf-8")


main()
