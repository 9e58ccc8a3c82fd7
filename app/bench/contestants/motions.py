"""Motions: ours, and those of other libraries. Limits are ours, assumed ones included."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import kin
from app.bench.contestants.contestant import OURS, Contestant
from app.bench.rows import Task
from kin.ik.problem import never_cancel
from kin.motion.geometry.curves import natural
from kin.motion.geometry.splines import parted
from kin.motion.pieces import JointMotion, Piece
from kin.motion.timing.timed import JointPath, timed
from kin.transforms import Array

POINTS = 100
_INTERVALS, _WAYPOINTS = 120, 5
_LOOK = 2001  # times at which a motion is compared with its limits
_FREE = 1e6  # the largest squared speed along a path where nothing else limits it


def limits_of(task: Task) -> Array:
    """Velocity, acceleration and jerk of each joint ``(n, 3)``."""
    limits = kin.motion.motion_limits(task.robot)
    return np.stack([limits.velocity, limits.acceleration, limits.jerk], axis=1)


def waypoints(task: Task, end: Array) -> Array:
    """Configurations ``(k, n)`` from home to `end`, on a path with bends."""
    part = np.linspace(0.0, 1.0, _WAYPOINTS)[:, None]
    bends = 0.3 * np.sin(np.arange(_WAYPOINTS)[:, None] * np.arange(1, len(end) + 1)) * (part * (1.0 - part) * 4.0)
    return np.asarray(task.robot.q_home + (end - task.robot.q_home) * part + bends)


def ours(task: Task) -> list[Contestant]:
    robot, home, limits = task.robot, task.robot.q_home, limits_of(task)
    match task.row.kind:
        case "ptp":
            programs = [
                kin.motion.Program((kin.motion.Ptp(kin.motion.JointTarget(tuple(q))),)) for q in task.q.tolist()
            ]
            return [
                Contestant(OURS, JointMotion.between, [(home, q, limits) for q in task.q], _of_piece),
                Contestant(
                    "kinboard, plan_motion", kin.plan_motion, [(robot, each) for each in programs], _of_motion
                ),
            ]
        case "points":

            def points(q: Array) -> Array:
                piece = JointMotion.between(home, q, limits)
                return piece.at(np.linspace(0.0, piece.duration, POINTS))

            return [Contestant(OURS, points, [(q,) for q in task.q], lambda found: [found])]
        case "pace":
            paths = []
            for q in task.q:
                knots = np.linspace(0.0, 1.0, _WAYPOINTS)
                parts = np.full(_WAYPOINTS - 1, _INTERVALS // (_WAYPOINTS - 1))
                knots, pieces = parted(knots, natural(knots, waypoints(task, q)), parts)
                rows = np.broadcast_to(limits, (len(pieces), *limits.shape)).copy()
                paths.append((JointPath(knots, pieces, rows, np.full(len(pieces), _FREE)), False, never_cancel))
            return [Contestant(OURS, timed, paths, lambda found: [_of_piece(found)[0][:3]])]
        case _:

            def line(target: kin.motion.PoseTarget) -> Array:
                motion = kin.plan_motion(robot, [kin.motion.Lin(target)])
                return motion.sample(np.linspace(0.0, motion.duration, POINTS)).T

            return [
                Contestant(OURS, line, [(kin.motion.PoseTarget.of(T),) for T in task.T], lambda found: [found[-1]])
            ]


def _of_piece(piece: Piece) -> list[Array]:
    return [piece.at(np.linspace(0.0, piece.duration, _LOOK))]


def _of_motion(motion: kin.motion.Motion) -> list[Array]:
    return [motion.derivatives(np.linspace(0.0, motion.duration, _LOOK))]


def ruckig(task: Task) -> list[Contestant]:
    from ruckig import InputParameter, Ruckig, Trajectory

    if task.row.kind != "ptp":
        return []
    n, rows, inputs = task.robot.n, limits_of(task).T.tolist(), []
    for q in task.q:
        wanted = InputParameter(n)
        wanted.current_position, wanted.target_position = task.robot.q_home.tolist(), q.tolist()
        wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = rows
        inputs.append((wanted,))
    solver = Ruckig(n)

    def solve(wanted: Any) -> Any:
        found = Trajectory(n)
        solver.calculate(wanted, found)
        return found

    def read(found: Any) -> list[Array]:
        times = np.linspace(0.0, found.duration, _LOOK).tolist()
        return [np.moveaxis(np.array([found.at_time(t) for t in times]), 0, 1)]

    return [Contestant("ruckig", solve, inputs, read)]


def toppra(task: Task) -> list[Contestant]:
    import toppra as ta
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    if task.row.kind != "pace":
        return []
    velocity, acceleration, _ = limits_of(task).T
    rows = [
        JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]
    grid, knots = np.linspace(0.0, 1.0, _INTERVALS + 1), np.linspace(0.0, 1.0, _WAYPOINTS)
    paths = [(ta.SplineInterpolator(knots, waypoints(task, q), bc_type="natural"),) for q in task.q]

    def solve(path: Any) -> Any:
        return TOPPRA(rows, path, gridpoints=grid, solver_wrapper="seidel").compute_trajectory(0.0, 0.0)

    def read(found: Any) -> list[Array]:
        times = np.linspace(0.0, found.duration, _LOOK)
        return [np.array([found(times, order) for order in range(3)])]

    return [Contestant("toppra", solve, paths, read)]


def roboplan(task: Task) -> list[Contestant]:
    from roboplan import core, toppra

    if task.row.kind != "pace":
        return []
    # Joints and links have one name space there.
    urdf = re.sub(r'<joint name="([^"]*)"', r'<joint name="joint of \1"', kin.robot_to_urdf(task.robot))
    scene = core.Scene("arm", core.loadUrdfSceneDescriptionFromXml(urdf))
    names = scene.getJointNames()
    lines = ["joint_limits:"]
    for name, (velocity, acceleration, _) in zip(names, limits_of(task).tolist(), strict=True):
        lines += [f"  {name}:", f"    max_velocity: [{velocity}]", f"    max_acceleration: [{acceleration}]"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "limits.yaml")
        file.write_text("\n".join(lines), "utf-8")
        scene.importJointLimitsFromConfig(core.loadJointLimitsConfig(file))
    options = toppra.TOPPRAOptions()
    options.mode = toppra.SplineFittingMode.Cubic
    inputs = []
    for q in task.q:
        path = core.JointPath()
        path.joint_names, path.positions = names, list(waypoints(task, q))
        inputs.append((path, options))

    def read(found: Any) -> list[Array]:
        return [np.array([found.positions, found.velocities, found.accelerations])]

    solve = toppra.PathParameterizerTOPPRA(scene).generate
    return [Contestant("roboplan, sampled", solve, inputs, read)]


def toolbox(task: Task) -> list[Contestant]:
    from roboticstoolbox import ctraj, jtraj
    from spatialmath import SE3

    home, limits = task.robot.q_home, limits_of(task)
    if task.row.kind == "points":
        # In the time that the fastest motion takes.
        inputs = [
            (home, q, np.linspace(0.0, JointMotion.between(home, q, limits).duration, POINTS)) for q in task.q
        ]
        return [
            Contestant(
                "roboticstoolbox jtraj", jtraj, inputs, lambda found: [np.array([found.q, found.qd, found.qdd])]
            )
        ]
    if task.row.kind != "line":
        return []
    start = SE3(kin.fk(task.robot, home), check=False)
    lines = [(start, SE3(T, check=False), POINTS) for T in task.T]
    return [Contestant("roboticstoolbox ctraj, poses only", ctraj, lines, lambda found: [found[-1].A])]
