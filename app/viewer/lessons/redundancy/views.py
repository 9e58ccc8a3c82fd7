"""The texts of the lesson: the redundancy, its ranges and their ends, and how exactly the tool is held."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

import kin
from app.viewer.panel.posture import feasible_html
from app.viewer.self_motion import End
from app.viewer.views.templates import render
from kin import Robot
from kin.differential.task import free_motions
from kin.ik import Redundancy, Task
from kin.transforms import Array, rotation_angle, vector_angle
from kin.units import Unit, Units, power

DIMENSIONS: dict[Task, int] = {"pose": 6, "approach": 5, "position": 3}
MATCHED: dict[Task, str] = {"pose": "the full pose", "approach": "point and approach", "position": "the point"}
TRADE = (
    "The axes of joints 1 and 2 coincide. Joint 2 turns back what joint 1 turns, and nothing else moves: neither "
    "the elbow nor the hand. The seventh joint gives this arm no other posture; compare the S-R-S arm."
)
ELBOW = (
    "Seven joints for a task of dimension six: the elbow can move on a circle about the line from shoulder to "
    "wrist while the tool stays. The ring shows the angles within the joint limits."
)


GIVEN = (
    "Seven joints for a task of dimension six: the arm can move while the tool stays. Choose a value of {label}, "
    "and the other six joints follow. The bar shows the values of joint {number} that the joint limits allow in "
    "this posture; the green line is the path of the elbow."
)


def _without_ranges(robot: Robot, task: Task) -> str:
    """Why no ranges are shown for a redundant arm, and what to do."""
    advice = (
        "Match the full pose to see the self-motion."
        if task != "pose" and robot.n == 7
        else "Targets work as usual."
    )
    return f"There is no closed form for this task, so no ranges are shown. {advice}"


def idea(robot: Robot, task: Task, parameters: tuple[Redundancy, ...], trades: bool, elbow: bool) -> str:
    """The redundancy of an arm in a task, in a sentence or two.

    Args:
        trades: whether joints 1 and 2 are coaxial.
        elbow: whether the elbow can move on a circle.
    """
    count = robot.n - DIMENSIONS[task]
    counts = f"{robot.n} joints, task dimension {DIMENSIONS[task]}"
    if not parameters and count <= 0:
        return (
            f"No redundancy: {counts}. Choose a task of smaller dimension (Move, Target must match), or an arm "
            "with seven joints."
        )
    if not parameters:
        return f"Redundancy {count}: {counts}. {_without_ranges(robot, task)}"
    if trades and parameters[0].name == "theta1":
        return TRADE
    if elbow and parameters[0].name == "psi":
        return ELBOW
    if task == "pose" and robot.n == 7:
        return GIVEN.format(label=parameters[0].label, number=parameters[0].name.removeprefix("theta"))
    names = " and ".join(item.label for item in parameters)
    return f"To match {MATCHED[task]}, {names} can have any value within the joint limits."


def numeric_idea(robot: Robot, task: Task, locked: tuple[int, ...] = ()) -> str:
    """The redundancy where no closed form describes it: by the null space of the Jacobian."""
    free = free_motions(robot, task, locked)
    moving = f"{robot.n - len(locked)} joints" if locked else f"{robot.n} joints"
    kinds = "one self-motion" if free == 1 else f"{free} independent self-motions"
    return (
        f"{moving}, and matching {MATCHED[task]} takes {robot.n - len(locked) - free} of their motions: {kinds}. "
        "No formula gives the feasible ranges here, so the null space of the Jacobian is followed in steps: one "
        "joint leads, and the others move as little as possible. The limits of all joints hold."
    )


def idea_html(text: str) -> str:
    """A paragraph of text."""
    return render("redundancy/idea", text=text)


def residual(T: Array, T_held: Array, task: Task) -> tuple[float, float | None]:
    """Position error (m) and rotation error (rad) of the tool at `T` with respect to `T_held`, for this task."""
    position = float(np.linalg.norm(T[:3, 3] - T_held[:3, 3]))
    if task == "position":
        return position, None
    if task == "approach":
        return position, vector_angle(T[:3, 2], T_held[:3, 2])
    return position, rotation_angle(T[:3, :3], T_held[:3, :3])


def small(value: float, unit: Unit) -> str:
    """A residual with its unit: with fixed decimals if they show it, else with a power of ten."""
    shown = value * unit.scale
    if shown == 0.0:
        return f"0{unit.suffix}"
    return unit.text(value, 2) if shown >= unit.step(2) else power(shown, 1) + unit.suffix


def residual_html(position: float, rotation: float | None, elbow: float | None, units: Units) -> str:
    """The residual, measured by forward kinematics; `elbow`: motion (m) of the elbow where it should not move."""
    parts = [small(position, units.lengths)]
    if rotation is not None:
        parts.append(small(rotation, units.angles))
    moved = None if elbow is None else small(elbow, units.lengths)
    return render("redundancy/residual", residual=Markup(", ").join(parts), elbow=moved)


def limits_html(robot: Robot, ends: tuple[End, ...], units: Units) -> str:
    """Each end of a range, with the joint limit that is met there."""
    rows = []
    for end in ends:
        reason = "the posture ends"
        if end.joint >= 0:
            name = robot.joints[end.joint].name
            number = str(end.joint + 1)
            reason = f"limit of joint {number}"
            if name.lower() not in (f"joint {number}", number):
                reason += f", {name}"
        rows.append((units.angles.text(end.value), reason))
    return render("redundancy/limits", rows=rows)


def range_html(robot: Robot, item: Redundancy, units: Units) -> str:
    """The feasible ranges as bars."""
    unit = units.angles
    low, high = bounds(robot, item)
    return feasible_html(item, low * unit.scale, high * unit.scale, unit)


def bounds(robot: Robot, item: Redundancy) -> tuple[float, float]:
    """The range (rad) of a parameter, restricted only by the limits of its own joint, if it is a joint's value."""
    if not item.name.startswith("theta"):
        return -math.pi, math.pi
    joint = int(item.name.removeprefix("theta")) - 1
    low, high = float(robot.lower[joint]), float(robot.upper[joint])
    return (low, high) if math.isfinite(high - low) else (-math.pi, math.pi)


def frame_origins(robot: Robot, q: Array) -> Array:
    """The origins ``(k, 3)`` of all frames between the second joint and the tool: the arm's shape."""
    return kin.link_frames(robot, q)[robot.joint_rows[min(1, robot.n - 1)] :, :3, 3]
