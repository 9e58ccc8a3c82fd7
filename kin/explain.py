"""Sentences for people: what an inverse-kinematics answer means, in degrees and millimetres."""

from __future__ import annotations

import math

import numpy as np

from kin.fk import fk, link_frames
from kin.results import IKSolution, LimitViolation
from kin.robot import Robot
from kin.transforms import Array

_WHAT = {"pose": "pose", "approach": "point and approach direction", "position": "point"}


def solved(count: int, task: str, redundant: bool) -> str:
    """Reached, with how many branches."""
    ways = "one configuration" if count == 1 else f"{count} configurations"
    family = ", each with a free parameter" if redundant and count > 1 else ""
    family = " with a free parameter" if redundant and count == 1 else family
    return f"Reached: {ways}{family} for this {_WHAT[task]}."


def limits(robot: Robot, violations: tuple[LimitViolation, ...], given: str) -> str:
    """Which joint would have to go where, for the branch that breaks the limits least."""
    needs = "; ".join(_need(robot, v) for v in violations)
    place = f" with the given {given}" if given else ""
    return f"Out of limits{place}: the least offending branch would need {needs}."


def approximate(robot: Robot, best: IKSolution, violations: tuple[LimitViolation, ...]) -> str:
    """What an arm with too few joints gave up."""
    if best.compromise == "roll":
        return (
            f"Reached with roll error {degrees(best.rotation_error)}: {robot.n} joints keep the point and the "
            "approach direction, not the roll about it."
        )
    why = f": the approach direction would need {_need(robot, violations[0])}" if violations else ""
    return f"Point reached, orientation off by {degrees(best.rotation_error)}{why}."


def unreachable(
    robot: Robot, target: Array, q: Array, distance: float, closest: IKSolution, obstacle: str, gap: float
) -> str:
    """Too far, too near, or an orientation that cannot be had at this point; q is nearest to the point."""
    if distance > 0.0:
        side = _side(robot, target, q)
        return f"Out of reach by {millimetres(distance)}: the point is {side}."
    why = f" ({obstacle}, by {millimetres(gap)})" if obstacle and gap > 0.0 else ""
    return (
        f"This orientation cannot be had at this point{why}; the closest pose is off by "
        f"{millimetres(closest.position_error)} and {degrees(closest.rotation_error)}."
    )


def _side(robot: Robot, target: Array, q: Array) -> str:
    """Whether the point is outside the workspace or inside a hole of it, seen from the shoulder.

    The shoulder is taken on the first joint's axis at the second joint's height.
    """
    first = link_frames(robot, q)[0]
    axis = robot.T_world_base[:3, 2] if robot.convention == "standard" else first[:3, 2]
    foot = robot.T_world_base[:3, 3]
    shoulder = foot + axis * float(axis @ (first[:3, 3] - foot))
    reached = float(np.linalg.norm(fk(robot, q)[:3, 3] - shoulder))
    wanted = float(np.linalg.norm(target[:3, 3] - shoulder))
    if wanted > reached + 1e-6:
        return "too far away"
    if wanted < reached - 1e-6:
        return "too near to the arm"
    return "outside the workspace the joint limits leave"


def _need(robot: Robot, violation: LimitViolation) -> str:
    joint = robot.joints[violation.joint]
    show = degrees if joint.kind == "revolute" else millimetres
    return (
        f"joint {violation.joint + 1} ({violation.name}) at {show(violation.value)}"
        f" (limit {show(violation.limit)})"
    )


def degrees(angle: float) -> str:
    """An angle for a sentence: one decimal, or enough to show that it is not zero."""
    value = math.degrees(angle)
    return f"{value:.1f}°" if abs(value) >= 0.05 or value == 0 else f"{value:.1e}°"


def millimetres(length: float) -> str:
    """A length for a sentence: one decimal, or enough to show that it is not zero."""
    value = 1e3 * length
    return f"{value:.1f} mm" if abs(value) >= 0.05 or value == 0 else f"{value:.1e} mm"
