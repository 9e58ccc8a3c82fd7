"""What the service says: results of the core as plain dicts, the same for REST and for ``kinboard … --json``.

The types are the contract: REST publishes them as its OpenAPI schemas (the string under a field is its
description), mypy holds the functions below to them, and nothing is validated again while answering, so ten
thousand poses cost little more than printing their digits. Metres, radians and ``wxyz`` quaternions throughout.
"""

from __future__ import annotations

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise
from math import isfinite
from typing import Any, Literal, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypedDict

from kin import (
    BlockedBranch,
    CapabilityMap,
    Estimate,
    IKResult,
    IKSolution,
    Joint,
    PathResult,
    Redundancy,
    Robot,
    Section,
    Status,
    WorkspaceFacts,
    branch_names,
    fk,
    jacobian,
    link_frames,
    manipulability,
)
from kin.ik.results import Cause, LimitViolation
from kin.transforms import Array, wxyz_from_rotation
from kin.workspace import Span

Matrix = list[list[float]]
T = TypeVar("T")


def documented(cls: type[T]) -> type[T]:
    """Lets REST take field descriptions from the strings under the fields.

    Set by name, so that the command line never has to import pydantic. Pydantic's own `use_attribute_docstrings`
    reads the source when the service starts, whether or not anybody asks for the schemas: a quarter of a second.
    """
    setattr(cls, "__pydantic_config__", {"json_schema_extra": _describe})  # noqa: B010
    return cls


def _describe(schema: dict[str, Any], cls: type) -> None:
    """Puts the strings under the fields of `cls` into its JSON schema."""
    for name, text in _field_texts(cls.__module__)[cls.__name__].items():
        schema["properties"][name]["description"] = text


@cache
def _field_texts(module: str) -> dict[str, dict[str, str]]:
    """Of each class of a module, its fields and the string under each."""
    classes = [
        node for node in ast.parse(inspect.getsource(sys.modules[module])).body if isinstance(node, ast.ClassDef)
    ]
    return {
        node.name: {
            field.target.id: inspect.cleandoc(text.value.value)
            for field, text in pairwise(node.body)
            if isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
            and isinstance(text.value.value, str)
        }
        for node in classes
    }


@documented
class Pose(TypedDict):
    """A rigid transform, given twice: as a matrix, and as a position with a quaternion."""

    matrix: Matrix
    """4×4 homogeneous transform in the base frame, row by row; the last column is the position in metres."""
    position: list[float]
    """x, y, z in metres, in the base frame."""
    wxyz: list[float]
    """Unit quaternion w, x, y, z (scalar first, w never negative)."""


@documented
class Frame(TypedDict):
    """The frame at the end of one DH row."""

    name: str
    """Name of the row of the DH table the frame follows."""
    pose: Pose
    """Where it is, in the base frame."""


@documented
class FkAnswer(TypedDict):
    """Forward kinematics of one configuration."""

    pose: Pose
    """Pose of the tool in the base frame."""
    in_limits: bool
    """Whether every joint is inside its limits. Forward kinematics answers either way."""
    frames: list[Frame] | None
    """Frame after every DH row, base to tool, fixed rows included; null unless asked for with `frames`."""


@documented
class Manipulability(TypedDict):
    """Yoshikawa's manipulability: the product of the singular values of the Jacobian; 0 at a singularity."""

    all: float
    """Of all six rows (metres and radians mixed)."""
    linear: float
    """Of the three linear rows (m³ for an arm whose joints all turn)."""
    angular: float
    """Of the three angular rows (no unit)."""


@documented
class JacobianAnswer(TypedDict):
    """The Jacobian of one configuration and what it says about moving from there."""

    jacobian: Matrix
    """6×n, row by row: rows 0–2 give the tool point's linear velocity (m per rad, or m per m for a sliding
    joint), rows 3–5 its angular velocity (rad per rad, or 0)."""
    manipulability: Manipulability
    """How far from a singularity."""
    singular_values: list[float]
    """Of the whole Jacobian, largest first (min(6, n) values; metres and radians mixed)."""


@documented
class RedundancyAnswer(TypedDict):
    """A parameter the task leaves free."""

    name: str
    """Short name of the free parameter, such as "psi" or "theta1"; the one to use in a request's `redundancy`."""
    label: str
    """The same for people."""
    value: float
    """The value used, in radians."""
    intervals: list[list[float]]
    """Every [lower, upper] range of values, in radians, for which the target can be reached inside the limits.
    Of several free parameters each is told with the others held. Exact, not sampled."""


@documented
class Solution(TypedDict):
    """One joint configuration, with its errors measured by forward kinematics."""

    q: list[float]
    """Joint values, base to tool, in radians (metres for sliding joints)."""
    branch: str
    """Which of the arm's postures this is: one of the robot's `branches`, "numeric" if these have no names."""
    position_error: float
    """Distance of the tool point from the target, in metres; of a mask along its coordinates."""
    rotation_error: float
    """Rotation left to the target in radians: the whole angle for task pose, the angle between the approach
    axes for task approach, 0 for task position, the length of the masked rotation vector for a mask."""
    in_limits: bool
    """Whether every joint is inside its limits."""
    distance: float
    """Distance from the seed in joint space (2-norm, radians)."""
    redundancy: list[RedundancyAnswer]
    """What the task leaves free on this branch: the value used in this solution, and the ranges of the branch."""
    compromise: str | None
    """null for an exact answer; "roll" if the rotation about the approach axis was given up; "rotation" if only
    the point is kept and the whole rotation error is as small as it gets; "closest" for the nearest there is."""


@documented
class Violation(TypedDict):
    """A joint that would have to go beyond its stop."""

    joint: int
    """Index into q, from 0."""
    name: str
    """Name of the joint."""
    value: float
    """The value the joint would need, in radians (metres)."""
    limit: float
    """The stop that value breaks, in radians (metres)."""


@documented
class Blocked(TypedDict):
    """A branch that reaches the target only beyond the limits."""

    branch: str
    """Name of the branch."""
    q: list[float]
    """The configuration it would need, in radians (metres)."""
    violations: list[Violation]
    """The stops in its way."""


@documented
class SingularityAnswer(TypedDict):
    """A way in which a configuration is singular."""

    kind: Literal["elbow", "shoulder", "wrist", "algorithmic", "jacobian"]
    """Which part of the arm loses a motion; "algorithmic": only the closed form loses a parameter, the arm
    nothing; "jacobian": told by the least singular value, for arms without a closed form."""
    meaning: str
    """The same for people."""
    distance: float
    """How far away it is, in `unit`."""
    unit: str
    """"rad", "m", or "SI" for a singular value."""


@documented
class IkAnswer(TypedDict):
    """Inverse kinematics of one target. A target out of reach is an answer too: read `status`."""

    status: Literal["solved", "approximate", "limits", "orientation", "unreachable"]
    """"solved": at least one exact answer. "approximate": the arm cannot do the whole task; `solutions` are the
    best compromises. "limits": postures exist, but each needs a joint beyond its stop, see `blocked`.
    "orientation": the point can be reached, not with this orientation; see `nearest_orientation`.
    "unreachable": the point is `distance` metres out of reach, or the branch asked for does not exist there."""
    cause: Cause
    """Why it is not solved, in one or two words; empty when it is. "too far", "too near", "around the axis" and
    "outside" tell where a point out of reach is."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    task: Literal["pose", "approach", "position", "mask"]
    """What was asked of the tool."""
    solver: str
    """Name of the method that answered."""
    solver_reason: str
    """Why it was this one."""
    solutions: list[Solution]
    """Nearest to the seed first, or in the order of `prefer`; empty unless "solved" or "approximate"."""
    closest: Solution | None
    """When there is no exact answer, the configuration inside the limits with the least
    √(|Δp|² + (0.1 m · angle)²) on the branches asked for; null when solved."""
    nearest_orientation: Solution | None
    """For "orientation": the exact point with the least rotation error; null otherwise."""
    blocked: list[Blocked]
    """For "limits": every branch that only the limits forbid, the least offending first."""
    violations: list[Violation]
    """The stops in the way of the first of `blocked`."""
    distance: float
    """How far out of reach the target is, in metres; 0 within reach."""
    redundancy: list[RedundancyAnswer]
    """What the task leaves free: the values of the first solution, with the ranges of all branches together."""
    singularities: list[SingularityAnswer]
    """What is singular about the first solution (or about `closest`)."""


@documented
class JointAnswer(TypedDict):
    """A joint that moves: q[index] belongs to it."""

    index: int
    """Index into q, from 0."""
    name: str
    """Name of the joint, and of its row in the DH table."""
    kind: Literal["revolute", "prismatic"]
    """Whether the joint turns or slides."""
    unit: Literal["rad", "m"]
    """Unit of its value: radians if it turns, metres if it slides."""
    limits: list[float] | None
    """[lower, upper] in that unit; null if it has no stops."""
    home: float
    """Its value in the home configuration, in that unit."""


@documented
class RowAnswer(TypedDict):
    """One row of the DH table. A moving joint adds its value to theta (revolute) or to d (prismatic)."""

    name: str
    """Name of the row."""
    kind: Literal["revolute", "prismatic", "fixed"]
    """What the row's joint does; a fixed row moves nothing (a tool, an adapter)."""
    theta: float
    """Rotation about z in radians, without the joint's value."""
    d: float
    """Translation along z in metres, without the joint's value."""
    a: float
    """Translation along x in metres."""
    alpha: float
    """Rotation about x in radians."""


@documented
class RobotAnswer(TypedDict):
    """Everything that defines an arm: T_base_tool = base · A_1 … A_m · tool, with one A per DH row."""

    id: str
    """Short name used in addresses."""
    name: str
    """Name for people."""
    description: str
    """What kind of arm it is."""
    n: int
    """Number of moving joints, the length of q."""
    branches: list[str]
    """Names of the arm's inverse-kinematics branches; empty for an arm without a closed form."""
    convention: Literal["standard", "modified"]
    """How a DH row is read. standard: Rz(θ) Tz(d) Tx(a) Rx(α). modified (Craig): Rx(α) Tx(a) Rz(θ) Tz(d)."""
    reach: float
    """An upper bound of the tool's distance from the base origin, in metres."""

    source: str
    """Where the numbers come from."""
    units: str
    """Length unit of the arm's own table, for showing it as its source does. Everything here is in metres."""
    rows: list[RowAnswer]
    """The DH table, base to tool, fixed rows included."""
    joints: list[JointAnswer]
    """The moving rows, in the order of q."""
    home: list[float]
    """The home configuration, one value per moving joint, in radians (metres)."""
    base: Matrix
    """Constant 4×4 transform before the first row."""
    tool: Matrix
    """Constant 4×4 transform after the last row."""


def robot_answer(robot: Robot) -> RobotAnswer:
    """Everything that defines an arm."""
    rows: list[RowAnswer] = [
        {"name": r.name, "kind": r.kind, "theta": r.theta, "d": r.d, "a": r.a, "alpha": r.alpha}
        for r in robot.rows
    ]
    return {
        "id": robot.id,
        "name": robot.name,
        "description": robot.description,
        "n": robot.n,
        "branches": list(branch_names(robot)),
        "convention": robot.convention,
        "reach": robot.reach,
        "source": robot.source,
        "units": robot.units,
        "rows": rows,
        "joints": [_joint(i, joint, robot.home[i]) for i, joint in enumerate(robot.joints)],
        "home": list(robot.home),
        "base": robot.T_world_base.tolist(),
        "tool": robot.T_last_tool.tolist(),
    }


def poses(T: Array) -> list[Pose]:
    """Transforms ``(k, 4, 4)`` one by one."""
    columns = zip(T.tolist(), T[:, :3, 3].tolist(), wxyz_from_rotation(T[:, :3, :3]).tolist(), strict=True)
    return [{"matrix": matrix, "position": position, "wxyz": wxyz} for matrix, position, wxyz in columns]


def fk_answers(robot: Robot, q: Array, frames: bool = False) -> list[FkAnswer]:
    """Forward kinematics of configurations ``(k, n)`` in radians (metres)."""
    tools = poses(fk(robot, q))
    inside: list[bool] = robot.in_limits(q).tolist()
    if not frames:
        return [{"pose": pose, "in_limits": ok, "frames": None} for pose, ok in zip(tools, inside, strict=True)]
    names = [row.name for row in robot.rows]
    flat = iter(poses(link_frames(robot, q).reshape(-1, 4, 4)))
    return [
        {"pose": pose, "in_limits": ok, "frames": [{"name": name, "pose": next(flat)} for name in names]}
        for pose, ok in zip(tools, inside, strict=True)
    ]


def jacobian_answers(robot: Robot, q: Array, frame: Literal["base", "tool"] = "base") -> list[JacobianAnswer]:
    """Jacobians of configurations ``(k, n)`` in radians (metres), in the base or the tool frame."""
    J = jacobian(robot, q, frame)
    columns = zip(
        J.tolist(),
        manipulability(robot, q, "all").tolist(),
        manipulability(robot, q, "linear").tolist(),
        manipulability(robot, q, "angular").tolist(),
        np.linalg.svd(J, compute_uv=False).tolist(),
        strict=True,
    )
    return [
        {
            "jacobian": rows,
            "manipulability": {"all": whole, "linear": linear, "angular": angular},
            "singular_values": values,
        }
        for rows, whole, linear, angular, values in columns
    ]


@documented
class JumpAnswer(TypedDict):
    """A step that cannot be followed without a leap."""

    index: int
    """The leap is between waypoint index − 1 and waypoint index, counted from 0."""
    joints: list[int]
    """The joints that leap, as indices into q."""
    step: float
    """The largest of their motions, in radians (4 per metre for a sliding joint)."""
    cause: Literal["limits", "singularity", "branch", "spacing"]
    """"limits": the motion goes on, but beyond a stop. "singularity": joints must turn fast beside one. "branch":
    the branch being followed ends. "spacing": the waypoints are too far apart for `max_step`."""
    reason: str
    """The same in a sentence for people."""


@documented
class GapAnswer(TypedDict):
    """A waypoint without an exact answer."""

    index: int
    """Which waypoint, counted from 0."""
    status: Literal["approximate", "limits", "orientation", "unreachable"]
    """What kind of answer `ik` gives there."""
    reason: str
    """Its sentence for people."""
    distance: float
    """How far out of reach it is, in metres; 0 within reach."""


@documented
class PathAnswer(TypedDict):
    """A joint path through a list of targets."""

    q: Matrix
    """One configuration per waypoint, in radians (metres for sliding joints), inside the limits."""
    continuous: bool
    """Whether there is no jump."""
    jumps: list[JumpAnswer]
    """Every jump that is left, in order."""
    gaps: list[GapAnswer]
    """Every waypoint without an exact answer, in order; q holds the closest configuration there."""
    position_error: list[float]
    """Distance of the tool point from each waypoint, in metres, measured by forward kinematics."""
    rotation_error: list[float]
    """Rotation left to each waypoint, in radians, as in the solutions of `ik`."""
    solver: str
    """Name of the method that answered."""
    reason: str
    """The whole in a sentence for people."""


def path_answer(result: PathResult) -> PathAnswer:
    """One result of `kin.solve_path`."""
    return {
        "q": result.q.tolist(),
        "continuous": result.continuous,
        "jumps": [
            {
                "index": jump.index,
                "joints": list(jump.joints),
                "step": jump.step,
                "cause": jump.cause,
                "reason": jump.reason,
            }
            for jump in result.jumps
        ],
        "gaps": [
            {
                "index": gap.index,
                "status": cast(Literal["approximate", "limits", "orientation", "unreachable"], gap.status.value),
                "reason": gap.reason,
                "distance": gap.distance,
            }
            for gap in result.gaps
        ],
        "position_error": result.position_error.tolist(),
        "rotation_error": result.rotation_error.tolist(),
        "solver": result.solver,
        "reason": result.reason,
    }


def ik_answer(result: IKResult) -> IkAnswer:
    """One result of `kin.solve_ik`."""
    return {
        "status": result.status.value,
        "cause": result.cause,
        "reason": result.reason,
        "task": cast(Literal["pose", "approach", "position", "mask"], result.task),
        "solver": result.solver,
        "solver_reason": result.solver_reason,
        "solutions": [_solution(solution) for solution in result.solutions],
        "closest": None if result.closest is None else _solution(result.closest),
        "nearest_orientation": None
        if result.nearest_orientation is None
        else _solution(result.nearest_orientation),
        "blocked": [_blocked(blocked) for blocked in result.blocked],
        "violations": [_violation(violation) for violation in result.violations],
        "distance": result.distance,
        "redundancy": [_redundancy(free) for free in result.redundancy],
        "singularities": [
            {"kind": s.kind, "meaning": s.meaning, "distance": s.distance, "unit": s.unit}
            for s in result.singularities
        ],
    }


def _blocked(blocked: BlockedBranch) -> Blocked:
    return {
        "branch": blocked.branch,
        "q": blocked.q.tolist(),
        "violations": [_violation(violation) for violation in blocked.violations],
    }


def _violation(violation: LimitViolation) -> Violation:
    return {
        "joint": violation.joint,
        "name": violation.name,
        "value": violation.value,
        "limit": violation.limit,
    }


def _redundancy(free: Redundancy) -> RedundancyAnswer:
    intervals = [list(interval) for interval in free.intervals]
    return {"name": free.name, "label": free.label, "value": free.value, "intervals": intervals}


def _solution(solution: IKSolution) -> Solution:
    return {
        "q": solution.q.tolist(),
        "branch": solution.branch,
        "position_error": solution.position_error,
        "rotation_error": solution.rotation_error,
        "in_limits": solution.in_limits,
        "distance": solution.distance,
        "redundancy": [_redundancy(free) for free in solution.redundancy],
        "compromise": solution.compromise,
    }


def _joint(index: int, joint: Joint, home: float) -> JointAnswer:
    # JSON has no infinity: a joint without stops says null.
    bounded = joint.limits is not None and all(map(isfinite, joint.limits))
    return {
        "index": index,
        "name": joint.name,
        "kind": "prismatic" if joint.kind == "prismatic" else "revolute",
        "unit": "m" if joint.kind == "prismatic" else "rad",
        "limits": list(joint.limits) if joint.limits is not None and bounded else None,
        "home": home,
    }


@documented
class ExtremeAnswer(TypedDict):
    """The least or largest value of a coordinate or distance."""

    value: float
    """Its value in metres, exact to rounding."""
    q: list[float]
    """A configuration that has it, in radians (metres)."""
    point: list[float]
    """The tool point there, x, y, z in metres."""


@documented
class SpanAnswer(TypedDict):
    """From the least to the largest."""

    least: ExtremeAnswer
    """The least value."""
    largest: ExtremeAnswer
    """The largest value."""


@documented
class EstimateAnswer(TypedDict):
    """A number with its standard error."""

    value: float
    """The number, in m³ (volume) or m² (surface)."""
    error: float
    """Its standard error, in the same unit; more `effort` makes it smaller."""
    method: str
    """How it was made."""


@documented
class ArcAnswer(TypedDict):
    """A stretch of a section's boundary that one joint draws alone."""

    joint: int
    """Index of the joint that moves."""
    start: float
    """Its value at the beginning of the stretch, in radians (metres)."""
    stop: float
    """Its value at the end, in radians (metres)."""
    q: list[float]
    """The configuration at the beginning, in radians (metres)."""
    points: Matrix
    """Points [r, z] along the stretch, in metres, by forward kinematics."""
    centre: list[float] | None
    """Centre [r, z] in metres of the circle it is part of; null if it is part of none."""
    radius: float | None
    """Radius of that circle in metres; null if it is part of none."""


@documented
class SectionAnswer(TypedDict):
    """The cut of the workspace with a half-plane through the line of joint 1, whatever joint 1 does.

    The point [r, z] of the section is origin + r·u + z·v. Or the cut with the plane that was asked for: then u and
    v are any two axes of it, v upright if the plane is, and there are no arcs."""

    origin: list[float]
    """Where r and z are 0: x, y, z in metres."""
    u: list[float]
    """Direction of r."""
    v: list[float]
    """Direction of z, along the line of joint 1."""
    curves: list[Matrix]
    """Closed polylines of points [r, z] in metres, the workspace on their left; holes run the other way round."""
    arcs: list[ArcAnswer]
    """Stretches of the boundary that one joint draws alone: exact curves."""
    area: float
    """Area in m²."""
    step: float
    """Side in metres of the squares that were looked at; what is smaller can be missed."""


@documented
class WorkspaceAnswer(TypedDict):
    """Sizes of the set of points the tool reaches inside the limits, in the base frame."""

    x: SpanAnswer
    """The bounding box along x."""
    y: SpanAnswer
    """The bounding box along y."""
    z: SpanAnswer
    """The bounding box along z."""
    axis_point: list[float]
    """A point of the line of joint 1 (of the base's z axis if joint 1 slides), in metres."""
    axis: list[float]
    """Direction of that line."""
    shoulder: list[float]
    """The point of that line nearest to the first joint axis that is not parallel to it, in metres."""
    radius: SpanAnswer
    """Distance from that line; the least is the radius of the hole around it."""
    reach: SpanAnswer
    """Distance from the shoulder; the least is the radius of the hole around it."""
    volume: EstimateAnswer | None
    """Volume in m³; null where it was not asked for."""
    surface: EstimateAnswer | None
    """Area of the whole boundary in m², holes included; null where volume was not asked for."""
    section: SectionAnswer | None
    """The section in r and z, or in a plane; null unless asked for."""


def workspace_answer(facts: WorkspaceFacts, cut: Section | None = None) -> WorkspaceAnswer:
    """Sizes by `kin.workspace_facts`, and a section by `kin.section`."""
    return {
        "x": _span(facts.x),
        "y": _span(facts.y),
        "z": _span(facts.z),
        "axis_point": facts.axis_point.tolist(),
        "axis": facts.axis.tolist(),
        "shoulder": facts.shoulder.tolist(),
        "radius": _span(facts.radius),
        "reach": _span(facts.reach),
        "volume": None if facts.volume is None else _estimate(facts.volume),
        "surface": None if facts.surface is None else _estimate(facts.surface),
        "section": None if cut is None else _section(cut),
    }


def _span(span: Span) -> SpanAnswer:
    least, largest = (ExtremeAnswer(value=end.value, q=end.q.tolist(), point=end.point.tolist()) for end in span)
    return {"least": least, "largest": largest}


def _estimate(estimate: Estimate) -> EstimateAnswer:
    return {"value": estimate.value, "error": estimate.error, "method": estimate.method}


def _section(cut: Section) -> SectionAnswer:
    return {
        "origin": cut.origin.tolist(),
        "u": cut.u.tolist(),
        "v": cut.v.tolist(),
        "curves": [curve.tolist() for curve in cut.curves],
        "arcs": [
            {
                "joint": arc.joint,
                "start": arc.start,
                "stop": arc.stop,
                "q": arc.q.tolist(),
                "points": arc.points.tolist(),
                "centre": None if arc.centre is None else list(arc.centre),
                "radius": arc.radius,
            }
            for arc in cut.arcs
        ],
        "area": cut.area,
        "step": cut.step,
    }


@documented
class ReachableAnswer(TypedDict):
    """Whether the arm gets to a target inside its limits."""

    reachable: bool
    """Whether it gets there exactly, all that the task asks for."""
    status: Literal["solved", "approximate", "limits", "orientation", "unreachable"]
    """What kind of answer `ik` gives: "solved" if it is reachable."""
    cause: Cause
    """What is in the way, in one or two words; empty when it is reachable."""
    reason: str
    """Status and cause in a sentence for people, in degrees and millimetres."""
    distance: float
    """How far out of reach the point is, in metres; 0 within reach."""
    q: list[float] | None
    """A configuration that gets there, in radians (metres), or the one that comes closest; null if the branch
    asked for has none."""
    position_error: float | None
    """Distance of the tool point from the target there, in metres, measured by forward kinematics."""
    rotation_error: float | None
    """Rotation left to the target there, in radians, as in the solutions of `ik`."""


def reachable_answer(result: IKResult) -> ReachableAnswer:
    """One result of `kin.solve_ik`, as far as it tells whether the target is reached."""
    best = result.best
    return {
        "reachable": result.status is Status.SOLVED,
        "status": result.status.value,
        "cause": result.cause,
        "reason": result.reason,
        "distance": result.distance,
        "q": None if best is None else best.q.tolist(),
        "position_error": None if best is None else best.position_error,
        "rotation_error": None if best is None else best.rotation_error,
    }


@documented
class CapabilityAnswer(TypedDict):
    """A capability map in numbers: from which directions the voxels of the workspace can be approached."""

    robot: str
    """Id of the arm."""
    method: Literal["closed form", "sweep", "search"]
    """How directions were decided. "closed form": exactly; "sweep": with some rolls about each, so that one that
    few rolls fit may be missing; "search": by descents, which miss a few."""
    directions: int
    """How many directions were asked for, spread evenly over the sphere."""
    voxel: float
    """Side of a voxel in metres."""
    origin: list[float]
    """The least corner of the grid: x, y, z in metres."""
    shape: list[int]
    """Voxels along x, y, z."""
    reachable: int
    """Voxels whose centre the tool point reaches, with any orientation."""
    volume: float
    """Their volume in m³."""
    mean_share: float
    """Mean of their shares: which part of the directions the tool can be brought to a centre along, 0 to 1."""
    best_share: float
    """The largest share."""
    best_share_at: list[float] | None
    """Centre of the voxel that has it, in metres; null if no direction fits anywhere."""
    best_manipulability: float
    """The largest manipulability found at any centre, as `all` of the Jacobian's answer."""
    best_manipulability_at: list[float] | None
    """Centre of the voxel that has it, in metres; null if it is 0 everywhere."""


def capability_answer(found: CapabilityMap) -> CapabilityAnswer:
    """The numbers that sum up a map by `kin.capability_map`."""
    grid = found.grid
    return {
        "robot": grid.robot.id,
        "method": grid.method,
        "directions": grid.count,
        "voxel": grid.voxel,
        "origin": list(grid.origin),
        "shape": list(grid.shape),
        "reachable": len(found.index),
        "volume": found.volume,
        "mean_share": float(found.share.mean(dtype=np.float64)) if len(found.share) else 0.0,
        "best_share": float(found.share.max(initial=0.0)),
        "best_share_at": _centre_of_best(found, found.share),
        "best_manipulability": float(found.manipulability.max(initial=0.0)),
        "best_manipulability_at": _centre_of_best(found, found.manipulability),
    }


def _centre_of_best(found: CapabilityMap, values: NDArray[np.float32]) -> list[float] | None:
    """Centre of the voxel with the largest value, None if that is 0 or there is no voxel."""
    if not values.max(initial=0.0) > 0.0:
        return None
    centre: list[float] = found.centres[int(np.argmax(values))].tolist()
    return centre


@documented
class VoxelAnswer(TypedDict):
    """The reachable voxels of a capability map, one entry each, in one order."""

    centres: Matrix
    """Their centres: x, y, z in metres."""
    share: list[float]
    """Share of the directions along which the tool can be brought there, 0 to 1; 0 where it gets there with others
    only."""
    manipulability: list[float]
    """The best manipulability found there."""
    approachable: list[str] | None
    """Which directions fit, "1" or "0" for each; null unless asked for."""


@documented
class CapabilityMapAnswer(TypedDict):
    """A capability map: its numbers, its directions, its voxels."""

    summary: CapabilityAnswer
    """The map in numbers."""
    directions: Matrix
    """The directions of the tool's z axis that were asked for, unit vectors in the base frame."""
    voxels: VoxelAnswer
    """The voxels that are reachable; all others of the grid are not."""


def capability_map_answer(found: CapabilityMap, approachable: bool = False) -> CapabilityMapAnswer:
    """A whole map by `kin.capability_map`; `approachable`: with the directions of each voxel."""
    fits = ["".join("01"[fit] for fit in row) for row in found.approachable.tolist()] if approachable else None
    return {
        "summary": capability_answer(found),
        "directions": found.grid.directions.tolist(),
        "voxels": {
            "centres": found.centres.tolist(),
            "share": found.share.tolist(),
            "manipulability": found.manipulability.tolist(),
            "approachable": fits,
        },
    }
