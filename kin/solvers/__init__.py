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
    coupled,
    general5,
    general6,
    general7,
    offset7,
    pair2,
    parallel5,
    parallel6,
    planar4,
    scara4,
    slide6,
    slides2,
    slides3,
    srs7,
    turned,
    wrist5,
    wrist6,
)
from kin.solvers.contract import APPROACH, ClosedForm
from kin.solvers.reversed import ReversedJoints, readings
from kin.solvers.rounded import Rounded, Rounded7, intended_arm
from kin.solvers.scaled import Scaled, in_unit, unit_of

FAMILIES: tuple[Callable[[Robot], ClosedForm | None], ...] = (
    wrist5.match,
    srs7.match,
    collinear7.match,
    wrist6.match,
    parallel6.match,
    slide6.match,
    scara4.match,
)
# Families that read joints of either direction.
UNDIRECTED: tuple[Callable[[Robot], ClosedForm | None], ...] = (
    parallel5.match,
    offset7.match,
    planar4.match,
    pair2.match,
    turned.match,
)
NUMERIC = "numeric"  # the family of arms without a closed form
# Radians, shares of the arm's size.
FAR = 2e-5
# For arms that fit no family.
GENERAL: tuple[Callable[[Robot], ClosedForm | None], ...] = (
    slides3.match,
    slides2.match,
    general6.match,
    lambda robot: turned.with_point(robot, general5.match(robot, _six_joints, _family_alone), _six_joints),
    lambda robot: general7.match(robot, _six_joints, _family_alone),
)


@lru_cache(maxsize=256)
def closed_form_of(robot: Robot) -> ClosedForm | None:
    """The closed form of the first family that fits the robot's axes, None if there is none.

    A table that is rounded gets the nominal family. Where no family fits then either, or the table is far
    from it, a general solver takes the arm. One with rows that follow joints is solved by that of its free arm,
    where the joints decide which of its configurations they can make. One that is much smaller or larger than a
    metre is solved in another unit of length.
    """
    if robot.coupled:
        return coupled.match(robot, closed_form_of)
    unit = unit_of(robot)
    if unit == 1.0:
        return _closed_form(robot, GENERAL)
    form = closed_form_of(in_unit(robot, unit))
    return None if form is None else Scaled(form, robot, unit)


def family_of(robot: Robot) -> str:
    """The name of the family of a robot, `NUMERIC` for one without a closed form."""
    form = closed_form_of(robot)
    return NUMERIC if form is None else form.name


def _closed_form(robot: Robot, solvers: tuple[Callable[[Robot], ClosedForm | None], ...]) -> ClosedForm | None:
    """`closed_form_of`, with these general solvers for an arm that fits no family."""
    found, intended = _family(robot, robot), intended_arm(robot)
    if intended is None:
        return found or _first_match(robot, solvers)
    if found is None:
        form = _family(intended.table, robot)
        # Close to singularities some postures of a table that is far from its family would be missed.
        far = form is not None and intended.off > FAR and robot.n < 7
        general = _first_match(robot, solvers) if form is None or far else None
        if form is None or general is not None or (far and not solvers):
            return general
        return _rounded(robot, form, intended.off)
    return _rounded(robot, found, intended.off) if intended.hidden else found


def _rounded(robot: Robot, form: ClosedForm, off: float) -> ClosedForm:
    return (Rounded7 if robot.n == 7 else Rounded)(robot, form, off)


def _family(table: Robot, robot: Robot) -> ClosedForm | None:
    """The family of a table; the branches are named as those of the robot that it stands for.

    Where none fits the table with its joints as given, or only one without approach directions, some joints are
    read as reversed.
    """
    found = _first_match(table, FAMILIES)
    if found is not None and found.handles(APPROACH):
        return found
    readable: list[tuple[tuple[int, ...], ClosedForm]] = [] if found is None else [((), found)]
    for joints, other in readings(table):
        # Only a last axis turned towards the tool adds approach directions to a family that has none.
        form = _first_match(other, FAMILIES) if found is None or robot.n - 1 in joints else None
        if form is not None:
            readable.append((joints, form))
    if not readable:
        return _first_match(table, UNDIRECTED)
    joints, form = min(readable, key=_burden)
    return ReversedJoints(form, joints, robot) if joints else form


def _six_joints(robot: Robot) -> ClosedForm | None:
    """The closed form of an arm with six joints that stands for one with more or fewer."""
    return closed_form_of(robot)


def _family_alone(robot: Robot) -> ClosedForm | None:
    """The same without the general solvers, in less time."""
    return _closed_form(robot, ())


def _first_match(robot: Robot, families: tuple[Callable[[Robot], ClosedForm | None], ...]) -> ClosedForm | None:
    """The closed form of the first of these families that fits the robot with its joints as given."""
    return next((form for match in families if (form := match(robot)) is not None), None)


def _burden(reading: tuple[tuple[int, ...], ClosedForm]) -> tuple[bool, int, int]:
    """What speaks against a reading: no approach directions, reversed joints, negative lengths."""
    joints, form = reading
    return not form.handles(APPROACH), len(joints), sum(length < 0.0 for length in form.lengths)
