"""Writes golden-clearance.json: distances between the links of each built-in arm, computed by coal.

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
from kin.collision import capsules, self_distance
from kin.collision.bodies import bodies_of


def distance_by_coal(robot: kin.Robot, q: np.ndarray) -> float:
    """The least distance of the pairs that kin compares."""
    frames = kin.link_frames(robot, q)
    shapes = []
    for capsule in capsules(robot):
        T = robot.T_world_base if capsule.row < 0 else frames[capsule.row]
        start, end = (T[:3, :3] @ point + T[:3, 3] for point in (capsule.start, capsule.end))
        way = end - start
        length = float(np.linalg.norm(way))
        turn = coal.Transform3s(rotation_to(way / length), (start + end) / 2.0)
        shapes.append((coal.Capsule(capsule.radius, length), turn))
    found = np.inf
    for i, j in bodies_of(robot).pairs.tolist():
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = min(found, coal.distance(*shapes[i], *shapes[j], request, result))
    return float(found)


def rotation_to(z: np.ndarray) -> np.ndarray:
    """A rotation whose third column is z."""
    x = np.cross([1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def main() -> None:
    rng = np.random.default_rng(5)
    many = int(sys.argv[1]) if sys.argv[1:] else 0
    golden = {}
    for robot in kin.builtin_robots().values():
        if not len(bodies_of(robot).pairs):
            continue
        q = robot.random_q(rng, many or 12)
        theirs = np.array([distance_by_coal(robot, each) for each in q])
        apart = np.abs(self_distance(robot, q) - theirs).max()
        wrong = int((np.sign(theirs) != np.sign(self_distance(robot, q))).sum())
        print(f"{robot.id}: {apart:.1e} m apart, {wrong} of {len(q)} judged differently")
        golden[robot.id] = [{"q": row.tolist(), "distance": d} for row, d in zip(q, theirs.tolist(), strict=True)]
    if not many:
        text = json.dumps(golden, indent=1)
        Path(__file__).with_name("golden-clearance.json").write_text(text + "\n", "utf-8")


main()
