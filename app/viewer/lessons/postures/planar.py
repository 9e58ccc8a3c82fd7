"""Both postures of a planar arm by hand: the ring that it reaches, the cosine rule, the other elbow."""

from __future__ import annotations

import math

from app.viewer.lessons.guide.outline import Mistake, Number, Pose, Step, apart
from app.viewer.lessons.guide.poses import as_configuration
from kin import Robot
from kin.robot import IDENTITY
from kin.transforms import Array
from kin.units import Units

STRAIGHT = 0.05  # rad: an elbow bent by less is no example
ANGLE, LENGTH = math.radians(0.5), 0.002


def is_planar(robot: Robot) -> bool:
    """Whether the table is that of two or three links in the plane of x₀ and y₀, with the elbow bent at home."""
    flat = all(row.kind == "revolute" and row.theta == row.d == row.alpha == 0.0 < row.a for row in robot.rows)
    bent = robot.n in (2, 3) and abs(math.sin(robot.q_home[1])) > STRAIGHT
    return flat and bent and robot.convention == "standard" and robot.base == robot.tool == IDENTITY


def other_elbow(robot: Robot) -> Array:
    """The configuration ``(n,)`` with the other elbow, for the tool pose or point that the arm has at home."""
    l1, l2 = robot.rows[0].a, robot.rows[1].a
    q = robot.q_home.copy()
    # The angle from the first link to the line from axis 1 to the point.
    beside = math.atan2(l2 * math.sin(q[1]), l1 + l2 * math.cos(q[1]))
    q[0], q[1] = math.remainder(q[0] + 2.0 * beside, 2.0 * math.pi), -q[1]
    if robot.n == 3:
        q[2] = math.remainder(float(robot.q_home.sum() - q[0] - q[1]), 2.0 * math.pi)
    return q


def steps(robot: Robot, units: Units) -> tuple[Step, ...]:
    """The derivation in three steps, for the point that the second link has at home."""
    l1, l2 = robot.rows[0].a, robot.rows[1].a
    q, other = robot.q_home, other_elbow(robot)
    x, y = l1 * math.cos(q[0]) + l2 * math.cos(q[0] + q[1]), l1 * math.sin(q[0]) + l2 * math.sin(q[0] + q[1])
    point = "the tool point" if robot.n == 2 else "axis 3"
    length, home = units.lengths, as_configuration(q)
    bend = abs(float(q[1]))
    stretched = q.copy()
    stretched[1] = min(max(0.0, robot.lower[1]), robot.upper[1])
    links = f"l₁ = {length.text(l1)} and l₂ = {length.text(l2)}"
    at = f"({length.number(x)}, {length.number(y)}){length.suffix}"
    ring = apart(Number(
        f"How near can {point} come to axis 1?",
        abs(l1 - l2), length, LENGTH,
        "Folded back, the shorter link lies on the longer one.",
        (Mistake(l1 + l2, "That is how far it can go: the outer radius of the ring."),),
    ))  # fmt: skip
    triangle = apart(Number(
        "How large is θ₂, without its sign?",
        bend, units.angles, ANGLE,
        "The cosine rule: cos θ₂ = (x² + y² − l₁² − l₂²) / (2 l₁ l₂).",
        (Mistake(math.pi - bend, "That is the angle inside the triangle; θ₂ is 0 for the stretched arm."),),
    ))  # fmt: skip
    elbow = apart(Number(
        "Which θ₁ belongs to the other sign of θ₂?",
        float(other[0]), units.angles, ANGLE,
        "θ₁ = atan2(y, x) − atan2(l₂ sin θ₂, l₁ + l₂ cos θ₂), with the other sign of θ₂.",
        (Mistake(float(q[0]), "That is θ₁ of the arm at home. The elbow is on the other side now."),),
        whole_turns=True,
    ))  # fmt: skip
    turned = "The tool points elsewhere." if robot.n == 2 else "θ₃ keeps the direction of the tool."
    return (
        Step(
            "By hand: the ring",
            f"The links are {links}.",
            ring,
            f"The workspace of {point} is a ring from {length.text(abs(l1 - l2))} to {length.text(l1 + l2)}.",
        ),
        Step(
            "By hand: the triangle",
            f"The links are {links}; {point} is to come to (x, y) = {at}.",
            triangle,
            "An arc cosine has two signs: two elbows.",
            pose=Pose(as_configuration(stretched)),
            end=Pose(home),
            practice="The arm has come there, with one of them.",
        ),
        Step(
            "By hand: the other elbow",
            f"{point.capitalize()} stays at (x, y) = {at}. At home, θ₂ is {units.angles.text(float(q[1]))}.",
            elbow,
            f"The elbow is on the other side now. {turned}",
            pose=Pose(home),
            end=Pose(as_configuration(other)),
            withheld=frozenset({"postures"}),
        ),
    )
