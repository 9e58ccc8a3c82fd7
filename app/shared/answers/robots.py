"""Answers that describe an arm: its DH table, joints and limits."""

from __future__ import annotations

from math import isfinite
from typing import Literal

from typing_extensions import TypedDict

from app.shared.answers.document import documented
from app.shared.answers.fk import Matrix
from kin import Joint, Robot, branch_names


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
