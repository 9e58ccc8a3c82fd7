"""What the lesson "Equations" teaches and asks."""

from __future__ import annotations

import numpy as np

from app.viewer.lessons.guide.outline import (
    PLAIN,
    Choice,
    Mistake,
    Number,
    Option,
    Outline,
    Pose,
    Step,
    apart,
    one_right,
)
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot, fk, jacobian
from kin.axes import NEARLY
from kin.differential.task import lifts
from kin.transforms import Array
from kin.units import Units, fixed

GOAL = "You can read the pose of the tool from its equations, and find a misprint in them without a reference."
SAMPLES = 8
EQUATIONS = frozenset({"equations"})  # what questions withhold


def outline(robot: Robot, units: Units) -> Outline:
    """The outline for this arm."""
    T, home = fk(robot, robot.q_home), as_configuration(robot.q_home)
    steps = (
        Step(
            "Four columns",
            "The pose is a matrix of four columns, n, o, a and p: the tool’s axes x, y and z, and the tool point.",
            _approach(T),
            "Each of the twelve entries is a formula of the joint values.",
            pose=Pose(home),
            practice="The menu Equation lists them.",
            withheld=EQUATIONS,
        ),
        Step(
            "The tool point",
            f"At home, the equations of p give {_point(T, units)}.",
            _distance(T, units),
            "The length of p is the same in any turned base frame: a quick test of three equations.",
            pose=Pose(home),
        ),
        Step(
            "A column from two others",
            f"At home, n = {_vector(T[:3, 0])} and o = {_vector(T[:3, 1])}.",
            _cross(T),
            "So three of the equations are not needed. Books print them: that is where misprints hide.",
            pose=Pose(home),
            withheld=EQUATIONS,
        ),
        Step(
            "A test that needs no reference",
            "R has the columns n, o and a. For a rotation, RᵀR is the identity, whatever the joints do.",
            _test(T),
            "RᵀR − I is zero for a correct R. An entry that differs from zero names two columns to look at.",
            withheld=EQUATIONS,
        ),
    )
    check = _check(robot, T, units)
    return Outline(GOAL, steps, check, (EQUATIONS, EQUATIONS), Pose(home))


def _vector(column: Array) -> str:
    return "(" + ", ".join(fixed(value, 3) for value in column.tolist()) + ")"


def _point(T: Array, units: Units) -> str:
    return "(" + ", ".join(units.lengths.number(value) for value in T[:3, 3].tolist()) + f"){units.lengths.suffix}"


def _approach(T: Array) -> Choice:
    direction = _vector(T[:3, 2])
    return one_right(
        f"At home the tool points along {direction}. Which column is that?",
        ("a", "The approach direction a is the tool’s z axis, the third column."),
        [
            ("n", f"n is the tool’s x axis, here {_vector(T[:3, 0])}."),
            ("o", f"o is the tool’s y axis, here {_vector(T[:3, 1])}."),
            ("p", "p is a point, not a direction: its length is not 1."),
        ],
        2,
    )


def _distance(T: Array, units: Units) -> Number:
    x, y, z = np.abs(T[:3, 3]).tolist()
    question = Number(
        "How far is the tool point from the origin of the frame in which p is given?",
        float(np.linalg.norm(T[:3, 3])),
        units.lengths,
        0.002,
        "The distance is √(x² + y² + z²).",
        (
            Mistake(x + y + z, "Coordinates do not add up to a distance: add their squares and take the root."),
            Mistake(float(np.hypot(x, y)), "That is the distance from the z axis; z is missing."),
        ),
    )
    return apart(question)


def _cross(T: Array) -> Number:
    a = np.cross(T[:3, 0], T[:3, 1])
    k = int(np.argmax(np.abs(a)))
    i, j = (k + 1) % 3, (k + 2) % 3
    names = "xyz"
    terms = f"n{names[i]} o{names[j]} − n{names[j]} o{names[i]}"
    question = Number(
        f"What is a{names[k]}, the {names[k]} component of a?",
        float(a[k]),
        PLAIN,
        0.01,
        f"a = n × o, so a{names[k]} = {terms}.",
        (Mistake(float(-a[k]), f"That is o × n. The order counts: a{names[k]} = {terms}."),),
    )
    return apart(question)


def flipped(T: Array, row: int, column: int) -> float:
    """The largest entry of RᵀR − I if one entry of R is printed with the wrong sign."""
    R = T[:3, :3].copy()
    R[row, column] *= -1.0
    return float(np.abs(R.T @ R - np.eye(3)).max())


def _test(T: Array) -> Choice:
    k = int(np.argmax(np.abs(T[:3, 0])))
    shown = flipped(T, k, 0) > NEARLY
    entry = f"n{'xyz'[k]}"
    why = (
        f"Its square is the same, but n·o or n·a is {fixed(flipped(T, k, 0), 3)} then instead of 0."
        if shown
        else f"At home the other entries of that row are 0, so {entry} enters no product but its own square."
    )
    return Choice(
        f"{entry} is printed with the wrong sign. Does RᵀR − I show it at home?",
        (Option("Yes", why, shown), Option("No", why, not shown)),
    )


def changes_height(robot: Robot, joint: int) -> bool:
    """Whether a joint ever changes z of the tool point."""
    q = robot.random_q(np.random.default_rng(5), SAMPLES)
    return lifts(robot, jacobian(robot, q), joint)


def _check(robot: Robot, T: Array, units: Units) -> tuple[Number | Choice, ...]:
    column = {axis: float(T[:3, 2] @ T[:3, k]) for k, axis in enumerate("noa")}
    product = Number(
        "What is n·a, for every configuration?",
        column["n"],
        PLAIN,
        0.01,
        "n and a are axes of one frame.",
        (Mistake(1.0, "That is the product of a column with itself. Different columns are perpendicular."),),
    )
    turns = changes_height(robot, 0)
    why = (
        "Axis 1 is not vertical: turning about it, or sliding along it, raises or lowers the tool."
        if turns
        else "Joint 1 turns about a vertical axis, so its value is in none of the terms of pz."
    )
    height = Choice(
        "Is the value of joint 1 in the equation of pz, the height of the tool?",
        (Option("Yes", why, turns), Option("No", why, not turns)),
    )
    misprint = one_right(
        "px is printed with the wrong sign. Which test finds it?",
        ("Comparing p with a drawing or with forward kinematics", "RᵀR has no entry of p in it."),
        [
            ("RᵀR − I", "p is not a column of R: RᵀR − I is zero, misprint or not."),
            ("det R = 1", "The determinant of R does not contain p either."),
        ],
        1,
    )
    return product, height, misprint
