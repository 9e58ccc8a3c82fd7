"""Libraries for forward kinematics and for inverse kinematics by iteration."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.bench.contestants.contestant import TOLERANCE, Contestant, one_answer, search_range, start_of
from app.bench.rows import MOTIONS, Task
from kin.transforms import Array


def pinocchio(task: Task) -> list[Contestant]:
    import pinocchio as pin

    if task.row.kind != "fk":
        return []
    model = pinocchio_model(task)
    last = model.njoints - 1
    tool = model.addFrame(pin.Frame("tool", last, pin.SE3(task.arm.constants[-1]), pin.FrameType.OP_FRAME))
    data = model.createData()

    def pose(q: Array) -> Any:
        pin.forwardKinematics(model, data, q)
        return pin.updateFramePlacement(model, data, tool)

    def positions(q: Array) -> Array:
        out = np.empty((len(q), 3))
        for i in range(len(q)):
            pin.forwardKinematics(model, data, q[i])
            out[i] = pin.updateFramePlacement(model, data, tool).translation
        return out

    if task.row.batch:
        return [Contestant("pinocchio", positions, [(task.q,)], list, len(task.q))]
    inputs = [(q,) for q in task.q]
    return [
        # A view of its own memory, which the next call overwrites; and a copy that a caller can keep.
        Contestant("pinocchio, its own SE3", pose, inputs, lambda T: [T.homogeneous]),
        Contestant("pinocchio", lambda q: pose(q).homogeneous, inputs, one_answer),
    ]


def pinocchio_model(task: Task) -> Any:
    """The arm as a chain of joints about z; its joint k is ours, 0 the world."""
    import pinocchio as pin

    model = pin.Model()
    for i in range(task.arm.n):
        model.addJoint(i, pin.JointModelRZ(), pin.SE3(task.arm.constants[i]), f"joint {i + 1}")
    return model


def toolbox(task: Task) -> list[Contestant]:
    from roboticstoolbox import ET, ETS
    from spatialmath import SE3

    arm = task.six if task.row.approach and task.six is not None else task.arm
    lower, upper = search_range(task, arm)
    parts = [ET.SE3(SE3(arm.constants[0], check=False))]
    for i in range(arm.n):
        limits = [float(lower[i]), float(upper[i])]
        joint = ET.tz if i in arm.slides else ET.Rz
        parts += [joint(jindex=i, qlim=limits), ET.SE3(SE3(arm.constants[i + 1], check=False))]
    chain = ETS(parts)
    name = "roboticstoolbox"
    if task.row.kind == "fk":
        if task.row.batch:
            return [Contestant(name, lambda q: chain.eval(q)[:, :3, 3], [(task.q,)], list, len(task.q))]
        return [Contestant(name, chain.eval, [(q,) for q in task.q], one_answer)]
    if task.row.batch:
        return []
    start = start_of(task, arm)
    inside = task.row.kind == "answer"

    def solve(T: Array) -> Any:
        return chain.ik_LM(T, q0=start, tol=TOLERANCE, joint_limits=inside)

    def read(found: Any) -> list[Array]:
        return [np.asarray(found.q)[None, : task.robot.n] if found.success else np.empty((0, task.robot.n))]

    return [Contestant(f"{name} ik_LM", solve, [(T,) for T in task.T], read, one=True)]


def ikpy(task: Task) -> list[Contestant]:
    from ikpy.chain import Chain
    from ikpy.link import OriginLink, URDFLink
    from scipy.spatial.transform import Rotation

    if task.row.kind in (*MOTIONS, "collision") or task.arm.slides:
        return []
    arm = task.arm
    lower, upper = search_range(task, arm)

    def link(name: str, T: Array, **more: Any) -> Any:
        turn = Rotation.from_matrix(T[:3, :3]).as_euler("xyz")
        return URDFLink(name, T[:3, 3], turn, use_symbolic_matrix=False, **more)

    links = [OriginLink()]
    for i in range(arm.n):
        bounds = (float(lower[i]), float(upper[i]))
        links.append(link(f"joint {i + 1}", arm.constants[i], rotation=[0, 0, 1], bounds=bounds))
    links.append(link("tool", arm.constants[-1], joint_type="fixed"))
    chain = Chain(links, active_links_mask=[False] + [True] * arm.n + [False])
    if task.row.batch:
        return []
    if task.row.kind == "fk":
        inputs = [(np.concatenate([[0.0], q, [0.0]]),) for q in task.q]
        return [Contestant("ikpy", chain.forward_kinematics, inputs, one_answer)]
    start = np.concatenate([[0.0], start_of(task, arm), [0.0]])

    def solve(T: Array) -> Any:
        if task.row.approach:
            return chain.inverse_kinematics(T[:3, 3], T[:3, 2], "Z", initial_position=start, tol=1e-12)
        return chain.inverse_kinematics_frame(T, initial_position=start, orientation_mode="all", tol=1e-12)

    return [Contestant("ikpy", solve, [(T,) for T in task.T], lambda q: [np.asarray(q)[None, 1:-1]], one=True)]
