"""Whether an arm touches itself or obstacles: ours, coal and VAMP.

coal compares the same capsules as we do, the same pairs of them, and the same spheres around the arm; pinocchio
moves them and stops at the first pair that touches. VAMP compares spheres of its own on the Panda with a hand, in
single precision: `Contestant.bodies` is the arm with these spheres. It has no call for a batch, nor has pinocchio.

We compute the least distance at a configuration, which says more than whether something touches. On a motion, ours
is the proof that nothing touches anywhere; the others look at configurations `STEP` apart.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

import kin
from app.bench.contestants.contestant import OURS, Contestant
from app.bench.contestants.iterative import pinocchio_model
from app.bench.rows import COLLISIONS, Task
from kin.axes import frame_of, perpendicular_to
from kin.collision.bodies import bodies_of
from kin.collision.contacts import surroundings
from kin.collision.sweep import Rows, first_contacts
from kin.ik.problem import never_cancel
from kin.robot import Capsule, Robot
from kin.transforms import Array
from kin.way.free import Space

STEP = 1.0 / 32.0  # rad, the length of all joint values together: what VAMP's planners take
_MOVED = 1e-4  # m, single precision


def ours(task: Task) -> list[Contestant]:
    robot, obstacles = task.robot, task.obstacles
    near = surroundings(robot, obstacles)
    if task.ends is not None:
        start, ways = task.q, task.ends - task.q

        def all_at_once() -> Array:
            farthest = np.maximum(np.abs(start), np.abs(start + ways)).max(axis=0)

            def at(rows: Rows, shares: Array) -> Array:
                return np.asarray(start[rows] + shares[:, None] * ways[rows])

            return first_contacts(near, at, np.abs(ways), farthest, never_cancel)

        motions = list(zip(task.q, task.ends, strict=True))
        return [
            Contestant(OURS, Space.of(robot, near, never_cancel).is_free, motions, _unless_free),
            Contestant(f"{OURS}, all at once", all_at_once, [()], lambda found: [*np.isfinite(found)], len(start)),
        ]
    if task.row.batch:
        inputs = [(robot, task.q, obstacles)]
        return [Contestant(OURS, kin.clearance, inputs, lambda apart: [*(apart < 0.0)], len(task.q))]
    return [
        Contestant(OURS, near.distances, [(q[None],) for q in task.q], lambda found: [found[0][0] < 0.0]),
        Contestant(f"{OURS}, clearance", kin.clearance, [(robot, q, obstacles) for q in task.q], _if_negative),
    ]


def _unless_free(free: bool) -> list[Any]:
    return [not free]


def _if_negative(distance: Array) -> list[Any]:
    return [bool(distance < 0.0)]


def coal(task: Task) -> list[Contestant]:
    import coal as shapes
    import pinocchio as pin

    if task.row.kind not in COLLISIONS:
        return []
    robot, model, scene = task.robot, pinocchio_model(task), pin.GeometryModel()
    data = model.createData()
    pin.forwardKinematics(model, data, robot.q_home)
    frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, robot.q_home)])
    bodies = bodies_of(robot)
    for i, each in enumerate(bodies.capsules):
        T = frames[each.row + 1]
        start, end = (T[:3, :3] @ point + T[:3, 3] for point in (each.start, each.end))
        way = end - start
        length = float(np.linalg.norm(way))
        z = way / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
        at = pin.SE3(frame_of(perpendicular_to(z), z, 0.5 * (start + end)))
        capsule = shapes.Capsule(each.radius, length)
        scene.addGeometryObject(
            pin.GeometryObject(f"capsule {i}", each.link, data.oMi[each.link].actInv(at), capsule)
        )
    for k, obstacle in enumerate(task.obstacles):
        ball = shapes.Sphere(obstacle.sizes[0])
        scene.addGeometryObject(pin.GeometryObject(f"obstacle {k}", 0, pin.SE3(obstacle.T), ball))
    pairs = [(i, j) for i, j in bodies.pairs.tolist()]
    pairs += [(i, len(bodies.capsules) + k) for i in bodies.moving.tolist() for k in range(len(task.obstacles))]
    for pair in pairs:
        scene.addCollisionPair(pin.CollisionPair(*pair))
    places = scene.createData()

    def touches(q: Array) -> bool:
        return bool(pin.computeCollisions(model, data, scene, places, q, True))

    def touches_between(q: Array, end: Array) -> bool:
        return any(map(touches, _steps(q, end)))

    if task.ends is not None:
        motions = list(zip(task.q, task.ends, strict=True))
        return [Contestant("coal", touches_between, motions, lambda found: [found])]
    if task.row.batch:
        return [Contestant("coal, one by one", lambda q: list(map(touches, q)), [(task.q,)], list, len(task.q))]
    return [Contestant("coal", touches, [(q,) for q in task.q], lambda found: [found])]


def _steps(q: Array, end: Array) -> Array:
    count = max(math.ceil(float(np.linalg.norm(end - q)) / STEP), 1)
    return np.asarray(q + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - q))


def vamp(task: Task) -> list[Contestant]:
    import vamp as library

    arm = getattr(library, task.robot.id, None)
    if task.row.kind not in COLLISIONS or arm is None:
        return []
    scene = library.Environment()
    for each in task.obstacles:
        scene.add_sphere(library.Sphere(list(each.xyz), each.sizes[0]))
    bodies, q = with_spheres(task.robot, arm), task.q.astype(np.float32)

    def validate_all(q: Array) -> list[bool]:
        return [arm.validate(each, scene) for each in q]

    def read(free: list[bool]) -> list[Any]:
        return [not each for each in free]

    if task.ends is not None:
        paths = []
        for ends in zip(q, task.ends.astype(np.float32), strict=True):
            path = arm.Path()
            for each in ends:
                path.append(each)
            paths.append((path, scene))
        return [Contestant("vamp-planner", arm.Path.validate, paths, _unless_free, bodies=bodies)]
    if task.row.batch:
        name = "vamp-planner, one by one"
        return [Contestant(name, validate_all, [(q,)], read, len(q), bodies=bodies)]
    return [Contestant("vamp-planner", arm.validate, [(each, scene) for each in q], _unless_free, bodies=bodies)]


def with_spheres(robot: Robot, arm: Any) -> Robot:
    """The robot with the spheres of VAMP's arm as bodies: each belongs to the last link that moves it."""

    def spheres(q: Array) -> Array:
        return np.array([(each.x, each.y, each.z, each.r) for each in arm.fk(q.astype(np.float32))])

    home = robot.q_home
    frames = np.concatenate([robot.T_world_base[None], kin.link_frames(robot, home)])
    rest, link = spheres(home), np.zeros(arm.n_spheres(), dtype=np.int64)
    for joint in range(robot.n):
        moved = home.copy()
        moved[joint] += 1.0
        link[np.abs(spheres(moved) - rest).max(axis=1) > _MOVED] = joint + 1
    rows = (-1, *robot.moving_rows)
    found = []
    for k, (x, y, z, radius) in zip(link.tolist(), rest.tolist(), strict=True):
        T = frames[rows[k] + 1]
        point = tuple((T[:3, :3].T @ (np.array([x, y, z]) - T[:3, 3])).tolist())
        found.append(Capsule(k, rows[k], point, point, radius))
    return replace(robot, capsules=tuple(sorted(found, key=lambda each: each.row)))
