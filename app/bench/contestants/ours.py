"""Kinboard itself, the floors that nothing can beat, and plain numpy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import kin
from app.bench import capsules
from app.bench.contestants import collisions, motions
from app.bench.contestants.contestant import FLOORS, OURS, SOLVE_IK, Contestant, no_answers, one_answer
from app.bench.rows import COLLISIONS, MOTIONS, Task
from kin.kernels.fk import all_finite
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.sampling.kernels import Points, sample_configurations, sample_points
from kin.workspace.sampling.streams import joint_streams


def floor(task: Task) -> list[Contestant]:
    """Lower bounds for every contestant on this machine: the unit of the gate.

    An *empty call* is one from Python into compiled code that looks at the joint values, and back. *Sine and
    cosine* of every joint value, here by NumPy, are needed by any forward kinematics.
    """
    if task.row.batch:
        q = task.q
        found = [Contestant(FLOORS[1], _sines_and_cosines, [(q,)], no_answers, len(q), floor=True)]
        if task.row.kind == "cloud":
            out = np.empty((len(q), 3), dtype=np.float32)
            found.append(Contestant(FLOORS[2], out.fill, [(1.0,)], no_answers, len(q), floor=True))
        return found
    inputs = [(q,) for q in task.q]
    return [Contestant(FLOORS[0], all_finite, inputs, no_answers, floor=True)]


def _sines_and_cosines(q: Array) -> None:
    np.sin(q)
    np.cos(q)


def ours(task: Task) -> list[Contestant]:
    robot, row = task.robot, task.row
    if row.kind == "cloud":
        return _cloud(task)
    if row.kind in MOTIONS:
        return motions.ours(task)
    if row.kind in COLLISIONS:
        return collisions.ours(task)
    if row.kind == "collision":
        return [
            Contestant(OURS, kin.clearance, [(robot, task.q)], list, len(task.q)),
            Contestant(
                f"{OURS}, kinematics only", kin.link_frames, [(robot, task.q)], no_answers, len(task.q), floor=True
            ),
        ]
    if row.kind == "fk" and row.batch:
        return [Contestant(OURS, kin.fk_positions, [(robot, task.q)], list, len(task.q))]
    if row.kind == "fk":
        return [Contestant(OURS, kin.fk, [(robot, q) for q in task.q], one_answer)]
    if row.kind == "branches" and row.batch:
        return [Contestant(OURS, kin.ik_branches, [(robot, task.T, row.value)], list, len(task.T))]
    if row.batch:
        return _answers(task)
    found = []
    if row.kind == "branches":
        found.append(Contestant(OURS, kin.ik_branches, [(robot, T, row.value) for T in task.T], one_answer))
    kind: kin.ik.Task = "approach" if row.approach else "pose"
    anywhere = row.kind == "branches"
    free = None if math.isnan(row.value) else row.value

    def solve(T: Array) -> kin.IKResult:
        return kin.solve_ik(robot, T, task=kind, respect_limits=not anywhere, redundancy=free)

    found.append(Contestant(SOLVE_IK, solve, [(T,) for T in task.T], _solutions))
    return found


def _answers(task: Task) -> list[Contestant]:
    """The best answers to a batch of targets; and their branches alone, without limits, order and verification."""
    robot = task.robot
    options = kin.IKOptions(task="approach" if task.row.approach else "pose")

    def solve(T: Array) -> Array:
        return kin.solve_ik_many(robot, T, options=options).q

    name = f"{OURS}, branches only"
    return [
        Contestant(OURS, solve, [(task.T,)], lambda q: [*q[:, None]], len(task.T), one=True),
        Contestant(name, kin.ik_branches, [(robot, task.T)], no_answers, len(task.T), floor=True),
    ]


def _cloud(task: Task) -> list[Contestant]:
    """The kernel alone, the generator as users call it, and each step of the computation alone.

    The kernel does the first three steps in one pass and saves the difference to their sum.
    """
    robot, count = task.robot, len(task.q)
    region = Region.of(robot)
    streams = joint_streams(0, region.movable, quasi=False)
    out, q = np.empty((count, 3), dtype=np.float32), np.empty_like(task.q)

    def kernel() -> Points:
        sample_points(region.arm, streams, 0, out)
        return out

    def generator() -> list[kin.workspace.WorkspaceChunk]:
        return list(kin.workspace.sample_workspace(robot, count))

    def numbers() -> None:
        sample_configurations(region.arm, streams, 0, q)

    exact = kin.fk_positions(robot, task.q)

    def part(name: str, call: Callable[[], Any]) -> Contestant:
        return Contestant(f"{OURS}, {name} only", call, [()], no_answers, count, floor=True)

    return [
        Contestant(OURS, kernel, [()], list, count),
        Contestant("kinboard, generator", generator, [()], _chunks, count),
        part("numbers", numbers),
        part("kinematics", lambda: kin.fk_positions(robot, task.q)),
        part("conversion", lambda: exact.astype(np.float32)),
        part("encoding", out.tobytes),
    ]


def _chunks(chunks: list[kin.workspace.WorkspaceChunk]) -> list[Array]:
    return [point for chunk in chunks for point in chunk.points]


def _solutions(result: kin.IKResult) -> list[Array]:
    return [result.q]


def plain_numpy(task: Task) -> list[Contestant]:
    """Plain matrix products. For a cloud, sampling the joint values is not timed."""
    if task.row.kind == "cloud":
        return [Contestant("numpy", lambda q: task.arm.fk(q)[:, :3, 3], [(task.q,)], list, len(task.q))]
    if task.row.kind == "collision":
        return [Contestant("numpy", capsules.distances, [(task.robot, task.q)], list, len(task.q))]
    if task.row.kind == "touch" and task.row.batch:
        inputs = [(task.robot, task.q, task.obstacles)]
        return [Contestant("numpy", capsules.distances, inputs, lambda apart: [*(apart < 0.0)], len(task.q))]
    if task.row.kind != "fk":
        return []
    if task.row.batch:
        return [Contestant("numpy", task.arm.fk, [(task.q,)], list, len(task.q))]
    return [Contestant("numpy", task.arm.fk, [(q,) for q in task.q], one_answer)]
