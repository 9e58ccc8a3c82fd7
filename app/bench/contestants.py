"""One way of one library to do a task; a library that is not installed is left out, never an error.

What a user of the library would call is timed, on one thread, with inputs already in the library's own form;
`read` turns its answer into our joints afterwards, outside the clock. A contestant that answers with an object the
configurations have yet to be fetched from fetches them inside the clock.

Adding one takes a function from `Task` to its contestants (none for tasks it cannot do) and a row in `PEERS`.
"""

from __future__ import annotations

import contextlib
import importlib.util
import math
import types
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import metadata
from typing import Any

import numpy as np

import kin
from app.bench import floors
from app.bench.arms import Arm, ortho
from app.bench.rows import Task
from kin.transforms import Array
from kin.workspace.region import Region
from kin.workspace.sampling.kernels import Points, sample_configurations, sample_points
from kin.workspace.sampling.streams import joint_streams

OURS = "kinboard"
RICH = "kinboard, rich"
FLOORS = ("floor: empty call", "floor: sine, cosine", "floor: points written")
_TIGHT = 1e-13  # of iterative solvers: on half the squared error, so about 1e-7 m or rad


@dataclass(frozen=True, eq=False)
class Contestant:
    """Something to be timed.

    Attributes:
        name: shown in tables.
        call: what is timed, as ``call(*arguments)``.
        inputs: arguments of each call; together they cover all targets once.
        read: an answer as one entry per target of the call: configurations ``(k, n)`` of our arm, or a pose.
        per_call: targets in a call.
        one: gives one answer and not all; None where there is but one.
        floor: answers nothing; what the others are measured against.
    """

    name: str
    call: Callable[..., Any]
    inputs: Sequence[tuple[Any, ...]]
    read: Callable[[Any], list[Array]]
    per_call: int = 1
    one: bool = False
    floor: bool = False


@dataclass(frozen=True, slots=True)
class Peer:
    """A library: the name of its distribution, the module to look for, and what makes its contestants."""

    name: str
    module: str
    enter: Callable[[Task], list[Contestant]]

    @property
    def installed(self) -> bool:
        """Whether its module can be found."""
        return importlib.util.find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """Version of the distribution; ours when it is ourselves."""
        return kin.__version__ if self.name == "kinboard" else metadata.version(self.name)


# Ourselves, and what nobody can beat


def _floor(task: Task) -> list[Contestant]:
    if task.row.batch:
        q = task.q
        found = [Contestant(FLOORS[1], floors.sines_and_cosines, [(q,)], _nothing, len(q), floor=True)]
        if task.row.kind == "cloud":
            out = np.empty((len(q), 3), dtype=np.float32)
            found.append(Contestant(FLOORS[2], floors.written, [(out,)], _nothing, len(q), floor=True))
        return found
    inputs = [(task.robot.model.copy(), q) for q in task.q]
    return [Contestant(FLOORS[0], floors.empty_call, inputs, _nothing, floor=True)]


def _ours(task: Task) -> list[Contestant]:
    robot, row = task.robot, task.row
    if row.kind == "cloud":
        return _cloud(task)
    if row.kind == "fk" and row.batch:
        return [Contestant(OURS, kin.fk_positions, [(robot, task.q)], list, len(task.q))]
    if row.kind == "fk":
        return [Contestant(OURS, kin.fk, [(robot, q) for q in task.q], _single)]
    if row.kind == "branches" and row.batch:
        return [Contestant(OURS, kin.ik_branches, [(robot, task.T, row.value)], list, len(task.T))]
    found = []
    if row.kind == "branches":
        found.append(Contestant(OURS, kin.ik_branches, [(robot, T, row.value) for T in task.T], _single))
    kind: kin.Task = "approach" if row.approach else "pose"
    anywhere = row.kind == "branches"
    free = None if math.isnan(row.value) else row.value

    def solve(T: Array) -> kin.IKResult:
        return kin.solve_ik(robot, T, task=kind, respect_limits=not anywhere, redundancy=free)

    found.append(Contestant(RICH, solve, [(T,) for T in task.T], _solutions))
    return found


def _cloud(task: Task) -> list[Contestant]:
    """The kernel alone, the generator as it is called, and each step of the way as if the others were not there.

    The kernel does the first three steps in one pass; what the pass saves is the difference to their sum.
    """
    robot, count = task.robot, len(task.q)
    region = Region.of(robot, None, None)
    streams = joint_streams(0, region.movable, quasi=False)
    out, q = np.empty((count, 3), dtype=np.float32), np.empty_like(task.q)

    def kernel() -> Points:
        sample_points(region.arm, streams, 0, out)
        return out

    def generator() -> list[kin.WorkspaceChunk]:
        return list(kin.sample_workspace(robot, count))

    def numbers() -> None:
        sample_configurations(region.arm, streams, 0, q)

    exact = kin.fk_positions(robot, task.q)

    def part(name: str, call: Callable[[], Any]) -> Contestant:
        return Contestant(f"{OURS}, {name} only", call, [()], _nothing, count, floor=True)

    return [
        Contestant(OURS, kernel, [()], list, count),
        Contestant("kinboard, generator", generator, [()], _chunks, count),
        part("numbers", numbers),
        part("kinematics", lambda: kin.fk_positions(robot, task.q)),
        part("conversion", lambda: exact.astype(np.float32)),
        part("encoding", out.tobytes),
    ]


def _chunks(chunks: list[kin.WorkspaceChunk]) -> list[Array]:
    return [point for chunk in chunks for point in chunk.points]


def _solutions(result: kin.IKResult) -> list[Array]:
    return [np.array([s.q for s in result.solutions])]


def _numpy(task: Task) -> list[Contestant]:
    """Plain matrix products: what anybody writes first. Of a cloud it is spared the drawing of numbers."""
    if task.row.kind == "cloud":
        return [Contestant("numpy", lambda q: task.arm.fk(q)[:, :3, 3], [(task.q,)], list, len(task.q))]
    if task.row.kind != "fk":
        return []
    if task.row.batch:
        return [Contestant("numpy", task.arm.fk, [(task.q,)], list, len(task.q))]
    return [Contestant("numpy", task.arm.fk, [(q,) for q in task.q], _single)]


# Closed forms


def _eaik(task: Task) -> list[Contestant]:
    from eaik.IK_HP import HPRobot

    if task.row.kind == "fk":
        H, P, tool = task.arm.screws
        robot = HPRobot(H, P)
        if task.row.batch:
            return []
        return [Contestant("eaik", robot.fwdKin, [(q,) for q in task.q], lambda T: [_with(T, tool)])]
    if task.row.kind != "branches":
        return []
    # A locked joint goes into its own argument, and comes back with the answers.
    whole = task.arm if task.row.lock is not None else task.six
    if whole is None:
        return []
    H, P, tool = whole.screws
    fixed = [] if task.row.lock is None else [(task.row.lock, task.row.value)]
    robot = HPRobot(H, P, fixed_axes=fixed)
    if not robot.hasKnownDecomposition():
        return []
    targets = [np.asfortranarray(_without(T, tool)) for T in task.T]

    def read(answer: tuple[Any, Any]) -> Array:
        q, least_squares = answer
        exact = ~np.asarray(least_squares, dtype=bool)
        return np.asarray(q, dtype=np.float64).reshape(-1, whole.n)[exact, : task.robot.n]

    def solve(T: Array) -> tuple[Any, Any]:
        found = robot.IK(T)
        return found.Q, found.is_LS

    def solve_all(T: list[Array]) -> list[tuple[Any, Any]]:
        return [(found.Q, found.is_LS) for found in robot.IK_batched(T, num_worker_threads=1)]

    if task.row.batch:
        return [Contestant("eaik", solve_all, [(targets,)], lambda found: list(map(read, found)), len(targets))]
    return [Contestant("eaik", solve, [(T,) for T in targets], lambda found: [read(found)])]


def _ik_geo(task: Task) -> list[Contestant]:
    from ik_geo import Robot

    if task.row.kind != "branches" or task.row.batch or task.six is None or not task.six.family:
        return []
    H, P, tool = task.six.screws
    robot = getattr(Robot, task.six.family)(H, P)
    # Its rotation matrices are the other way round in memory: it wants R transposed.
    inputs = [(np.ascontiguousarray(M[:3, :3].T), M[:3, 3].copy()) for M in (_without(T, tool) for T in task.T)]

    def read(found: list[tuple[list[float], bool]]) -> list[Array]:
        return [_ours_of(task, np.array([q for q, least_squares in found if not least_squares]))]

    return [Contestant("ik-geo", robot.get_ik, inputs, read)]


def _ssik(task: Task) -> list[Contestant]:
    if task.row.batch or task.row.kind == "answer":
        return []
    arm = task.arm if task.row.kind == "fk" else task.six
    if arm is None or (task.row.kind == "branches" and not arm.family):
        return []  # six joints of no family are its strength, but their derivation takes minutes
    if task.row.kind == "fk":
        if arm.n not in (6, 7):
            return []
        import ssik

        H, P, tool = arm.screws
        robot = ssik.Manipulator.from_axes(H, P)
        return [Contestant("ssik", robot.fk, [(q,) for q in task.q], lambda T: [_with(T, tool)])]
    artifact, tool = _ssik_artifact(arm)

    def solve(T: Array) -> Any:
        return artifact.solve(T, respect_limits=False, enumerate_windings=False)

    def read(found: Any) -> list[Array]:
        return [_ours_of(task, np.array([s.q for s in found]))]

    return [Contestant("ssik", solve, [(_without(T, tool),) for T in task.T], read)]


@lru_cache(maxsize=8)
def _ssik_artifact(arm: Arm) -> tuple[Any, Array]:
    """The module `ssik build` writes for an arm, kept in memory: its quick way, with the native solvers."""
    import ssik
    from ssik.core.codegen import emit_artifact

    H, P, tool = arm.screws
    robot = ssik.Manipulator.from_axes(H, P)
    source = emit_artifact(kb=robot.kinbody, plan=robot.dispatch_plan, module_name="bench_ik").source
    module = types.ModuleType("bench_ik")
    exec(compile(source, "bench_ik.py", "exec"), module.__dict__)
    return module, tool


def _opw(task: Task) -> list[Contestant]:
    from py_opw_kinematics import KinematicModel, Robot
    from scipy.spatial.transform import RigidTransform

    six = task.arm.with_roll() if task.row.kind == "fk" and task.arm.n == 5 else task.six
    shape = ortho(six) if six is not None else None
    if shape is None or task.row.kind in ("answer", "cloud"):
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
        return _ours_of(task, shape.upright + shape.signs * np.asarray(q).reshape(-1, 6))

    if task.row.batch:
        poses = RigidTransform.from_matrix(task.T)
        return [
            Contestant(
                name, lambda T: robot.reach(T, ee_transform=tool).joints, [(poses,)],
                lambda found: list(map(ours, found)), len(task.T),
            )
        ]  # fmt: skip
    targets = [(RigidTransform.from_matrix(T),) for T in task.T]
    return [Contestant(name, lambda T: robot.inverse(T, ee_transform=tool), targets, lambda found: [ours(found)])]


# Forward kinematics and iteration


def _pinocchio(task: Task) -> list[Contestant]:
    import pinocchio as pin

    if task.row.kind != "fk":
        return []
    model = pin.Model()
    last = 0
    for i in range(task.arm.n):
        last = model.addJoint(last, pin.JointModelRZ(), pin.SE3(task.arm.constants[i]), f"joint {i + 1}")
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
        # A view of its own memory, which the next call writes over; and what a caller can keep.
        Contestant("pinocchio, its own SE3", pose, inputs, lambda T: [T.homogeneous]),
        Contestant("pinocchio", lambda q: pose(q).homogeneous, inputs, _single),
    ]


def _toolbox(task: Task) -> list[Contestant]:
    from roboticstoolbox import ET, ETS
    from spatialmath import SE3

    arm = task.six if task.row.approach and task.six is not None else task.arm
    lower, upper = _spans(task, arm)
    parts = [ET.SE3(SE3(arm.constants[0], check=False))]
    for i in range(arm.n):
        limits = [float(lower[i]), float(upper[i])]
        parts += [ET.Rz(jindex=i, qlim=limits), ET.SE3(SE3(arm.constants[i + 1], check=False))]
    chain = ETS(parts)
    name = "roboticstoolbox"
    if task.row.kind == "fk":
        if task.row.batch:
            return [Contestant(name, lambda q: chain.eval(q)[:, :3, 3], [(task.q,)], list, len(task.q))]
        return [Contestant(name, chain.eval, [(q,) for q in task.q], _single)]
    if task.row.batch:
        return []
    start = _start(task, arm)
    inside = task.row.kind == "answer"

    def solve(T: Array) -> Any:
        return chain.ik_LM(T, q0=start, tol=_TIGHT, joint_limits=inside)

    def read(found: Any) -> list[Array]:
        return [np.asarray(found.q)[None, : task.robot.n] if found.success else np.empty((0, task.robot.n))]

    return [Contestant(f"{name} ik_LM", solve, [(T,) for T in task.T], read, one=True)]


def _ikpy(task: Task) -> list[Contestant]:
    from ikpy.chain import Chain
    from ikpy.link import OriginLink, URDFLink
    from scipy.spatial.transform import Rotation

    arm = task.arm
    lower, upper = _spans(task, arm)

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
        return [Contestant("ikpy", chain.forward_kinematics, inputs, _single)]
    start = np.concatenate([[0.0], _start(task, arm), [0.0]])

    def solve(T: Array) -> Any:
        if task.row.approach:
            return chain.inverse_kinematics(T[:3, 3], T[:3, 2], "Z", initial_position=start, tol=1e-12)
        return chain.inverse_kinematics_frame(T, initial_position=start, orientation_mode="all", tol=1e-12)

    return [Contestant("ikpy", solve, [(T,) for T in task.T], lambda q: [np.asarray(q)[None, 1:-1]], one=True)]


KINBOARD = Peer("kinboard", "kin", _ours)
FLOOR = Peer("floor", "kin", _floor)
PEERS: tuple[Peer, ...] = (
    Peer("numpy", "numpy", _numpy),
    Peer("pin", "pinocchio", _pinocchio),
    Peer("eaik", "eaik", _eaik),
    Peer("ssik", "ssik", _ssik),
    Peer("ik-geo", "ik_geo", _ik_geo),
    Peer("py-opw-kinematics", "py_opw_kinematics", _opw),
    Peer("roboticstoolbox-python", "roboticstoolbox", _toolbox),
    Peer("ikpy", "ikpy", _ikpy),
)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Other libraries' warnings are not ours to show."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


# Shared


def _nothing(_: Any) -> list[Array]:
    return []


def _single(answer: Any) -> list[Array]:
    return [answer]


def _without(T: Array, tool: Array) -> Array:
    """The target of a chain of screws, whose tool has no rotation at zero."""
    M = T.copy()
    M[:3, :3] = T[:3, :3] @ tool.T
    return M


def _with(M: Any, tool: Array) -> Array:
    """Our pose of a chain of screws' pose."""
    T = np.array(M, dtype=np.float64)
    T[:3, :3] = T[:3, :3] @ tool
    return T


def _ours_of(task: Task, q: Array) -> Array:
    """Configurations ``(k, 6)`` of the six-joint arm as those of ours: without the roll, with the locked joint."""
    q = np.asarray(q, dtype=np.float64).reshape(-1, 6)
    if task.row.lock is not None:
        return np.insert(q, task.row.lock, task.row.value, axis=1)
    return q[:, : task.robot.n]


def _spans(task: Task, arm: Arm) -> tuple[Array, Array]:
    """Where an iteration may go ``(n,)``, ``(n,)``: the limits, ±π for a roll and where there are none."""
    lower, upper = np.full(arm.n, -math.pi), np.full(arm.n, math.pi)
    if task.row.kind == "answer":
        n = task.robot.n
        lower[:n] = np.where(np.isfinite(task.robot.lower), task.robot.lower, -math.pi)
        upper[:n] = np.where(np.isfinite(task.robot.upper), task.robot.upper, math.pi)
    return lower, upper


def _start(task: Task, arm: Arm) -> Array:
    """Where an iteration starts: the home pose, our own default seed."""
    start = np.zeros(arm.n)
    start[: task.robot.n] = task.robot.q_home
    return start
