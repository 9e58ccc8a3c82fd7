"""The registry of closed-form solvers: one module and one row per family of arms, in order of preference.

Which family an arm belongs to is read off its joint axes, never off its name. Neither the convention of its table
nor the positive direction of its joints matters (:mod:`kin.solvers.reversed`). The contract that every family
keeps stands in :mod:`kin.solvers.contract`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from kin.robot import Robot
from kin.solvers import (
    collinear7,
    general5,
    general6,
    general7,
    offset7,
    parallel5,
    parallel6,
    scara4,
    slide6,
    srs7,
    wrist5,
    wrist6,
)
from kin.solvers.contract import APPROACH, ClosedForm
from kin.solvers.reversed import ReversedJoints, readings

FAMILIES: tuple[Callable[[Robot], ClosedForm | None], ...] = (
    wrist5.match,
    srs7.match,
    collinear7.match,
    wrist6.match,
    parallel6.match,
    slide6.match,
    scara4.match,
)
# For arms that fit no family, whatever joints are reversed.
GENERAL: tuple[Callable[[Robot], ClosedForm | None], ...] = (
    parallel5.match,
    offset7.match,
    general6.match,
    lambda robot: general5.match(robot, _six_joints),
    lambda robot: general7.match(robot, _six_joints),
)


@lru_cache(maxsize=256)
def closed_form_of(robot: Robot) -> ClosedForm | None:
    """The closed form of the first family that fits the robot's axes, None if there is none.

    Where none fits the robot with its joints as given, or only one without approach directions, some joints are
    read as reversed. Where none fits then either, a general solver takes the arm.
    """
    found = _first_match(robot, FAMILIES)
    if found is not None and found.handles(APPROACH):
        return found
    readable: list[tuple[tuple[int, ...], ClosedForm]] = [] if found is None else [((), found)]
    for joints, table in readings(robot):
        # Only a last axis turned towards the tool adds approach directions to a family that has none.
        form = _first_match(table, FAMILIES) if found is None or robot.n - 1 in joints else None
        if form is not None:
            readable.append((joints, form))
    if not readable:
        return _first_match(robot, GENERAL)
    joints, form = min(readable, key=_burden)
    return ReversedJoints(form, joints, robot) if joints else form


def _six_joints(robot: Robot) -> ClosedForm | None:
    """The closed form of an arm with six joints that stands for one with more or fewer."""
    return closed_form_of(robot)


def _first_match(robot: Robot, families: tuple[Callable[[Robot], ClosedForm | None], ...]) -> ClosedForm | None:
    """The closed form of the first of these families that fits the robot with its joints as given."""
    return next((form for match in families if (form := match(robot)) is not None), None)


def _burden(reading: tuple[tuple[int, ...], ClosedForm]) -> tuple[bool, int, int]:
    """What speaks against a reading: no approach directions, reversed joints, negative lengths."""
    joints, form = reading
    return not form.handles(APPROACH), len(joints), sum(length < 0.0 for length in form.lengths)
