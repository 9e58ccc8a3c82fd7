"""Libraries that solve inverse kinematics in closed form."""

from __future__ import annotations

import time
import types
from functools import lru_cache
from typing import Any

import numpy as np

from app.bench.arms import Arm, ortho
from app.bench.contestants.contestant import Contestant, our_joints, with_tool_rotation, without_tool_rotation
from app.bench.rows import Task
from kin.dh.tables import table_of_chain
from kin.robot import Joint, Kind
from kin.transforms import Array

_DERIVED = ("puma560", "ur5")  # arms with a special geometry whose solver the toolbox is asked to derive
_ANY = (-10.0, 10.0)  # metres; it demands limits of joints that slide, and then ignores them


def eaik(task: Task) -> list[Contestant]:
    from eaik.IK_HP import HPRobot

    if task.row.kind == "fk":
        H, P, tool = task.arm.screws
        robot = HPRobot(H, P)
        if task.row.batch:
            return []
        return [Contestant("eaik", robot.fwdKin, [(q,) for q in task.q], lambda T: [with_tool_rotation(T, tool)])]
    if task.row.kind != "branches":
        return []
    # A locked joint has an argument of its own, and is part of the solutions.
    whole = task.arm if task.row.lock is not None else task.six
    if whole is None:
        return []
    H, P, tool = whole.screws
    fixed = [] if task.row.lock is None else [(task.row.lock, task.row.value)]
    robot = HPRobot(H, P, fixed_axes=fixed)
    if not robot.hasKnownDecomposition():
        return []
    targets = [np.asfortranarray(without_tool_rotation(T, tool)) for T in task.T]

    def read(answer: tuple[Any, Any]) -> Array:
        q, least_squares = answer
        exact = ~np.asarray(least_squares, dtype=bool)
        q = np.asarray(q, dtype=np.float64).reshape(-1, whole.n)[exact]
        return q if whole is task.arm else our_joints(task, q)

    def solve(T: Array) -> tuple[Any, Any]:
        found = robot.IK(T)
        return found.Q, found.is_LS

    def solve_all(T: list[Array]) -> list[tuple[Any, Any]]:
        return [(found.Q, found.is_LS) for found in robot.IK_batched(T, num_worker_threads=1)]

    if task.row.batch:
        return [Contestant("eaik", solve_all, [(targets,)], lambda found: list(map(read, found)), len(targets))]
    return [Contestant("eaik", solve, [(T,) for T in targets], lambda found: [read(found)])]


def ik_geo(task: Task) -> list[Contestant]:
    from ik_geo import Robot

    if task.row.kind != "branches" or task.row.batch or task.six is None:
        return []
    H, P, tool = task.six.screws
    # Six joints without a special geometry are solved by a search over two joint values.
    robot = getattr(Robot, task.six.family or "gen_six_dof")(H, P)
    # It stores rotation matrices by columns, so R is passed transposed.
    inputs = [
        (np.ascontiguousarray(M[:3, :3].T), M[:3, 3].copy())
        for M in (without_tool_rotation(T, tool) for T in task.T)
    ]

    def read(found: list[tuple[list[float], bool]]) -> list[Array]:
        return [our_joints(task, np.array([q for q, least_squares in found if not least_squares]))]

    return [Contestant("ik-geo", robot.get_ik, inputs, read)]


def ssik(task: Task) -> list[Contestant]:
    if task.row.batch or task.row.kind not in ("fk", "branches"):
        return []
    arm = task.arm if task.row.kind == "fk" else task.six
    if arm is None:
        return []
    if task.row.kind == "fk":
        if arm.n not in (6, 7):
            return []
        import ssik

        H, P, tool = arm.screws
        robot = ssik.Manipulator.from_axes(H, P)
        return [Contestant("ssik", robot.fk, [(q,) for q in task.q], lambda T: [with_tool_rotation(T, tool)])]
    solver, tool, spent = _ssik_artifact(arm) if arm.family else _ssik_general(arm)

    def solve(T: Array) -> Any:
        return solver.solve(T, respect_limits=False, enumerate_windings=False)

    def read(found: Any) -> list[Array]:
        return [our_joints(task, np.array([s.q for s in found]))]

    targets = [(without_tool_rotation(T, tool),) for T in task.T]
    return [Contestant("ssik", solve, targets, read, derivation=spent)]


@lru_cache(maxsize=8)
def _ssik_artifact(arm: Arm) -> tuple[Any, Array, float]:
    """The module that `ssik build` writes for an arm, with its native solvers: its fastest way."""
    import ssik
    from ssik.core.codegen import emit_artifact

    H, P, tool = arm.screws
    began = time.process_time()
    robot = ssik.Manipulator.from_axes(H, P)
    source = emit_artifact(kb=robot.kinbody, plan=robot.dispatch_plan, module_name="bench_ik").source
    module = types.ModuleType("bench_ik")
    exec(compile(source, "bench_ik.py", "exec"), module.__dict__)
    return module, tool, time.process_time() - began


@lru_cache(maxsize=8)
def _ssik_general(arm: Arm) -> tuple[Any, Array, float]:
    """The solver of an arm without a special geometry: its derivation takes up to a minute and is kept on disk."""
    import ssik

    H, P, tool = arm.screws
    began = time.process_time()
    robot = ssik.Manipulator.from_axes(H, P)
    robot.prepare()
    return robot, tool, time.process_time() - began


def toolbox_analytic(task: Task) -> list[Contestant]:
    """The toolbox's symbolic solver: of arms without a special geometry, and of three arms of the textbooks.

    Deriving it takes seconds; for the Panda with joint 7 locked it gives up after two minutes.
    """
    from roboticstoolbox import DHRobot, PrismaticDH, RevoluteDH
    from spatialmath import SE3

    six = task.arm if task.arm.slides else task.six
    if task.row.kind != "branches" or task.row.batch or six is None or six.n != 6 or task.robot.id == "panda":
        return []
    if not six.slides and six.family and task.robot.id not in _DERIVED:
        return []
    kinds: list[Kind] = ["prismatic" if i in six.slides else "revolute" for i in range(6)]
    joints = [Joint(f"joint {i + 1}", kind=kind) for i, kind in enumerate(kinds)]
    base, rows, tool = table_of_chain(joints, list(six.constants))
    if len(rows) != 6:
        return []
    links = [
        PrismaticDH(theta=row.theta, a=row.a, alpha=row.alpha, offset=row.d, qlim=_ANY)
        if row.kind == "prismatic"
        else RevoluteDH(d=row.d, a=row.a, alpha=row.alpha, offset=row.theta)
        for row in rows
    ]
    robot = DHRobot(links, base=SE3(np.array(base), check=False), tool=SE3(np.array(tool), check=False))
    began = time.process_time()
    solver = robot.analytic_ik()
    spent = time.process_time() - began

    def solve(T: Array) -> Any:
        return solver.solve(T, joint_limits=False)

    return [
        Contestant(
            "roboticstoolbox analytic",
            solve,
            [(T,) for T in task.T],
            lambda found: [our_joints(task, found.q)],
            derivation=spent,
        )
    ]


def opw(task: Task) -> list[Contestant]:
    from py_opw_kinematics import KinematicModel, Robot
    from scipy.spatial.transform import RigidTransform

    six = task.arm.with_roll() if task.row.kind == "fk" and task.arm.n == 5 else task.six
    shape = ortho(six) if six is not None else None
    if shape is None or task.row.kind not in ("fk", "branches"):
        return []
    robot = Robot(KinematicModel(**shape.lengths), degrees=False)
    tool = RigidTransform.from_matrix(shape.tool)
    name = "py-opw-kinematics"
    if task.row.kind == "fk":
        whole = np.zeros((len(task.q), 6))
        whole[:, : task.robot.n] = task.q
        theirs = (whole - shape.upright) * shape.signs
        if task.row.batch:
            return [
                Contestant(
                    name, lambda q: robot.batch_forward(q, tool).translation, [(theirs,)], list, len(theirs)
                )
            ]
        inputs = [(tuple(q), tool) for q in theirs.tolist()]
        return [Contestant(name, robot.forward, inputs, lambda T: [T.as_matrix()])]

    def ours(q: Any) -> Array:
        return our_joints(task, shape.upright + shape.signs * np.asarray(q).reshape(-1, 6))

    if task.row.batch:
        poses = RigidTransform.from_matrix(task.T)
        return [
            Contestant(
                name,
                lambda T: robot.reach(T, ee_transform=tool).joints,
                [(poses,)],
                lambda found: list(map(ours, found)),
                len(task.T),
            )
        ]
    targets = [(RigidTransform.from_matrix(T),) for T in task.T]
    return [Contestant(name, lambda T: robot.inverse(T, ee_transform=tool), targets, lambda found: [ours(found)])]
