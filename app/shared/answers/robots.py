"""Answers that describe an arm: its DH table, joints and limits."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Literal

from msgspec import UNSET, UnsetType

from app.shared.answers.answer import Answer, From
from app.shared.answers.fk import Matrix
from app.shared.solver_names import solver_names
from kin import Joint, Robot


class JointAnswer(Answer):
    """A moving joint; q[index] is its value."""

    index: int
    """Index into q, from 0."""
    name: str
    """Name of the joint, and of its row in the DH table."""
    kind: Literal["revolute", "prismatic"]
    """revolute: it turns. prismatic: it slides."""
    unit: Literal["rad", "m"]
    """Unit of its value: rad if revolute, m if prismatic."""
    limits: list[float] | None
    """[lower, upper] in that unit; null if it is unlimited."""
    velocity: float | None
    """Its largest speed, in that unit per second; null if it is not known."""
    acceleration: float | None
    """Its largest acceleration, in that unit per second squared; null if it is not known."""
    jerk: float | None
    """Its largest jerk, in that unit per second cubed; null if it is not known."""
    effort: float | None
    """Its largest torque in N·m (revolute) or force in N (prismatic); null if it is not known."""
    home: float
    """Its value in the home configuration, in that unit."""


class RowAnswer(Answer):
    """One row of the DH table. A moving joint adds its value to theta (revolute) or to d (prismatic).

    A row that follows a joint adds `ratio` times that joint's value instead.
    """

    name: str
    """Name of the row."""
    kind: Literal["revolute", "prismatic", "fixed"]
    """Kind of the joint; a fixed row does not move (a tool, an adapter)."""
    theta: float
    """Rotation about z in radians, without the joint value."""
    d: float
    """Translation along z in metres, without the joint value."""
    a: float
    """Translation along x in metres."""
    alpha: float
    """Rotation about x in radians."""
    follows: Annotated[str | UnsetType, From("follows", unless_empty=True)] = UNSET
    """Name of the joint that moves this row, which is none itself; absent for any other row."""
    ratio: Annotated[float | UnsetType, From(lambda row: row.ratio if row.follows else UNSET)] = UNSET
    """By how many times that joint's value it moves, radians (metres) for each; absent for any other row."""


class MotorAnswer(Answer):
    """What the motor of a joint reads: offset + sign · q, with q in its unit."""

    joint: str
    """Name of the joint that it moves; empty for one that moves none of them, such as that of a gripper."""
    id: int
    """Its number on the bus."""
    name: str
    """What its bus calls it."""
    sign: Literal[1, -1]
    """-1: it counts backwards."""
    offset: float
    """Its reading where the joint value is zero, in its unit."""
    unit: Literal["deg", "rad", "ticks", "range_m100_100", "range_0_100"]
    """Degrees, radians, ticks from 0 in each turn, or LeRobot's calibrated range from -100 or 0 to 100."""
    ticks: int
    """Ticks of a turn."""
    lead: float | None
    """Metres that a slide moves in a turn; null for a joint that turns."""
    range: list[int] | None
    """Ticks at both ends of LeRobot's calibrated range; null if it is not calibrated."""
    drive_mode: int
    """That of LeRobot's calibration; 1 turns the calibrated range round."""
    homing_offset: int
    """That of LeRobot's calibration, which the servo subtracts itself."""


class RobotAnswer(Answer):
    """Everything that defines an arm: T_world_tool = base · A_1 … A_m · tool, with one A per DH row.

    Poses are answered in the world frame. It is the base frame unless `base` is another transform than 1.
    """

    id: str
    """Short name, used in URLs."""
    name: str
    """Display name."""
    description: str
    """Short description of the arm."""
    maker: str
    """Who builds or built the arm; empty for an arm of textbooks."""
    payload: float | None
    """What it may carry, in kg; null if it is not known."""
    mass: float | None
    """What it weighs, in kg; null if it is not known."""
    n: int
    """Number of moving joints, the length of q."""
    solver: str
    """The family of closed forms that solves its inverse kinematics, or numeric."""
    branches: list[str]
    """Names of the arm's inverse-kinematics branches; empty for an arm without a closed form."""
    branch_meanings: dict[str, str]
    """What each part of these names says about a configuration."""
    convention: Literal["standard", "modified"]
    """DH convention. standard: Rz(θ) Tz(d) Tx(a) Rx(α). modified (Craig): Rx(α) Tx(a) Rz(θ) Tz(d)."""
    mounting: Literal["pedestal", "floor", "table", "wall", "ceiling"] | None
    """What it is mounted on; null if that is not stated. How it is turned, `base` states."""
    floor: float | None
    """Height of the floor in the world frame, in metres; null if it is not stated."""
    motors: list[MotorAnswer]
    """What the motors of its joints read; empty if that is not stated."""
    reach: float
    """An upper bound of the tool's distance from the base origin, in metres."""

    source: str
    """Source of the numbers."""
    units: str
    """Length unit of the table in the robot file, for display. All lengths here are in metres."""
    rows: list[RowAnswer]
    """The DH table, base to tool, fixed rows included."""
    joints: list[JointAnswer]
    """The moving rows, in the order of q."""
    home: list[float]
    """The home configuration, one value per moving joint, in radians (metres)."""
    base: Annotated[Matrix, From("T_world_base")]
    """Pose of the base frame, that of the first row, in the world frame: constant, 4×4, metres."""
    tool: Annotated[Matrix, From("T_last_tool")]
    """Pose of the tool frame, which targets are about, in the frame after the last row: constant, 4×4, metres."""


class BriefRobotAnswer(Answer):
    """What an arm is called, and its kind."""

    id: str
    """Short name, used in URLs."""
    name: str
    """Display name."""
    maker: str
    """Who builds or built the arm; empty for an arm of textbooks."""
    n: int
    """Number of moving joints, the length of q."""
    solver: str
    """The family of closed forms that solves its inverse kinematics, or numeric."""


def brief_answer(robot: Robot) -> BriefRobotAnswer:
    """What an arm is called, and its kind."""
    return BriefRobotAnswer.of(robot, solver=solver_names(robot).solver)


def robot_answer(robot: Robot) -> RobotAnswer:
    """Everything that defines an arm."""
    names = solver_names(robot)
    return RobotAnswer.of(
        robot,
        solver=names.solver,
        branches=names.branches,
        branch_meanings=names.meanings,
        joints=[_joint(i, joint, robot.home[i]) for i, joint in enumerate(robot.joints)],
    )


def _joint(index: int, joint: Joint, home: float) -> JointAnswer:
    # JSON has no infinity: the limits of an unlimited joint are null.
    bounded = joint.limits is not None and all(map(isfinite, joint.limits))
    slides = joint.kind == "prismatic"
    return JointAnswer.of(
        joint,
        index=index,
        kind="prismatic" if slides else "revolute",
        unit="m" if slides else "rad",
        limits=list(joint.limits) if joint.limits is not None and bounded else None,
        home=home,
    )
